"""From a panel to a body: which vertices, edges and faces there are, and how they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import Body, Plane, Point, Ruled, Straight, Surface, Trace
from devcad.export._step_chart import chart
from devcad.export._step_conics import arc_edge
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_faces import Rims, add_skins
from devcad.export._step_folds import folds, mirrored_knots, split
from devcad.export._step_places import Ground
from devcad.export._step_rails import LongEdge, Piece, fitted_rails
from devcad.export._step_regions import Region, regions
from devcad.export._step_rims import edge_tolerance, rims
from devcad.export._step_solid import add_end, add_walls
from devcad.export._step_strips import Strip, panel_size, strips
from devcad.export._step_touches import hair
from devcad.geometry.cells import Run
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.proofs import sheet_volume

AREA_SIZE = 250.0  # mm: below it the tolerance shrinks with the part, for areas are relative


def body(panel: Panel, tolerance: float, degree: int) -> Body:
    """The body of a panel: a solid with thickness, else a shell.

    Fitted faces lie within max(tolerance, 1e-9 of the size) of the true surface and twist by at
    most 0.01 degree.
    Raises:
        GeometryError: the fit is not reached, or patches and layers do not meet.
    """
    size = panel_size(panel)
    parts, count = split(*strips(panel), size)
    corners, lifts = _corners(parts, count, size)
    folded = folds(parts, size)
    draft = Draft(parts, corners, size, folded)
    skins: list[Skin] = []
    for k, strip in enumerate(parts):
        start = _start(strip, [skins[i] for (j, _), (i, _) in folded.items() if j == k])
        skins.append(_skin(strip, draft, lifts[k], tolerance, degree, start))
    left = regions(panel, parts)
    edges = [
        _rims(panel, draft, skin, found, tolerance, degree)
        for skin, found in zip(skins, left, strict=True)
    ]
    for skin, found, around in zip(skins, left, edges, strict=True):
        add_skins(draft, skin, found, around)
        if panel.thickness:
            add_walls(draft, skin, found, around)
    if panel.thickness and count > len(parts):
        add_end(draft, skins[0], 0, left[0])
        add_end(draft, skins[-1], 1, left[-1])
    return Body(
        panel.name,
        np.array(draft.points),
        tuple(draft.edges),
        tuple(draft.faces),
        panel.thickness > 0.0,
        sheet_volume(panel),
        draft.moved,
    )


def _rims(
    panel: Panel,
    draft: Draft,
    skin: Skin,
    left: tuple[Region, ...],
    tolerance: float,
    degree: int,
) -> Rims:
    """The edges of all cuts in one strip."""
    items = [item for region in left for item in (*region.loop, *region.holes)]
    runs = [item for item in items if isinstance(item, Run)]
    if not runs:
        return {}
    ground = Ground(panel.chain, skin, hair(tolerance))
    edge = edge_tolerance(draft.size, tolerance)
    return dict(zip(runs, rims(draft, ground, panel.cuts, runs, edge, degree), strict=True))


def _start(strip: Strip, folded: list[Skin]) -> Array | None:
    """The knots for a strip of which a long edge is an earlier one's run backwards: that one's."""
    for skin in folded:
        surface = skin.surfaces[0]
        if strip.ruled and isinstance(surface, Ruled):
            return mirrored_knots(surface.low.knots, strip)
    return None


def _skin(
    strip: Strip, draft: Draft, lifts: Array, tolerance: float, degree: int, start: Array | None
) -> Skin:
    """Surfaces and long edges of one strip."""
    if lifts.any() and strip.shape.type != "plane":
        raise GeometryError(
            "a crease beside a rolled patch has no mitre with thickness",
            remedy="give corner_radius, or thickness 0",
        )
    if strip.ruled:
        fine = max(tolerance * min(1.0, draft.size / AREA_SIZE), FLOOR * draft.size)
        return _fitted_skin(strip, draft.corner_points(strip), lifts, fine, degree, start)
    return _exact_skin(strip, draft, lifts, edge_tolerance(draft.size, tolerance), degree)


def _fitted_skin(
    strip: Strip,
    corners: Array,
    lifts: Array,
    tolerance: float,
    degree: int,
    start: Array | None,
) -> Skin:
    """A strip whose faces are splines: the surface itself where it is one, else fitted."""
    rails, probe, true = fitted_rails(strip, corners, tolerance, degree, start)
    layers = len(strip.layers)
    columns = [
        [slice(3 * k, 3 * k + 3) for k in range(layers * s, layers * s + layers)] for s in (0, 1)
    ]
    low, high = ([rails.part(c) for c in side] for side in columns)
    surfaces = [Ruled(b, a) for a, b in zip(low, high, strict=True)]
    surfaces[-1] = Ruled(low[-1], high[-1])  # the front
    sides = [
        [_rail_piece(strip, s, side, corners, probe, true)] for s, side in enumerate((low, high))
    ]
    return Skin(strip, tuple(surfaces), (sides[0], sides[1]), lifts, None, probe, true)


def _exact_skin(strip: Strip, draft: Draft, lifts: Array, tolerance: float, degree: int) -> Skin:
    """A strip on a plane, a circular cylinder or a right circular cone."""
    corners = draft.corner_points(strip)
    reach = strip.rails(np.linspace(strip.ends[0], strip.ends[1], 33))
    frame, round_ = None, None
    surfaces: Sequence[Surface] = [
        Plane(corners[0, 0, k], n) for k, n in enumerate(_outward(strip))
    ]
    if strip.shape.type != "plane":
        frame = chart(strip)
        round_ = [
            frame.surface(k, x.reshape(-1, 3)) for k, x in enumerate(np.moveaxis(reach, 2, 0))
        ]
        surfaces = round_
    edges = [
        LongEdge(strip, s, corners[:, s], lifts, round_, frame, draft.size, tolerance, degree)
        for s in (0, 1)
    ]
    sides = (edges[0].pieces(), edges[1].pieces())
    return Skin(strip, tuple(surfaces), sides, lifts, frame, true=reach)


def _rail_piece(
    strip: Strip, side: int, rails: list[Spline], corners: Array, probe: Array, true: Array
) -> Piece:
    """A long edge of a fitted strip; the front's surface has the from side at u = 0."""
    s = strip.course.s
    layers = len(rails)
    tip = strip.tips[side] and layers == 1
    traces: list[Trace] = []
    for k in range(layers):
        u = float(side) if k == layers - 1 else float(1 - side)
        traces.append(Straight(np.array([u, 0.0]), np.array([0.0, 1.0])))
    plain = Piece(
        (float(strip.ends[0]), float(strip.ends[1])),
        corners[:, side],
        (Point(),) * layers if tip else tuple(rails),
        ((float(s[0]), float(s[-1])),) * layers,
        tuple(traces),
        (probe, true[:, side]),
    )
    found = None if tip or layers > 1 else arc_edge(rails[0])
    if found is None:
        return plain
    (curve, span), along = found
    image = np.concatenate([np.full_like(along.poles, float(side)), along.poles], axis=1)
    return replace(plain, curves=(curve,), spans=(span,), traces=(replace(along, poles=image),))


def _outward(strip: Strip) -> list[Array]:
    """The outward normals of a strip's layers at its first ruling."""
    n = strip.patch.frame(strip.ends[:1]).n[0]
    return [n] if len(strip.layers) == 1 else [-n, n]


def _corners(parts: list[Strip], count: int, size: float) -> tuple[Array, Array]:
    """The corners (stations, 2 sides, layers, 3), and for each strip and end what a mitre adds to
    the skin's offset for a unit of thickness, (strips, 2, 3): 0 where its pull has that.

    At a crease a layer lies at c + d (n1 + n2) / (1 + n1.n2) (design.md, section 7).
    """
    lifts = np.zeros((len(parts), 2, 3))
    rails = [s.rails(s.ends) for s in parts]  # (2 ends, 2 sides, layers, 3) each
    if parts[0].layers != (0.0,):
        normals = [s.patch.frame(s.ends).n for s in parts]
        for k in range(len(parts)):
            after = (k + 1) % len(parts)
            if parts[k].last != parts[after].first:
                continue
            n1, n2 = normals[k][1], normals[after][0]
            if np.linalg.norm(np.cross(n1, n2)) <= 1e-9:
                continue
            mitre = (n1 + n2) / (1.0 + n1 @ n2)
            if parts[k].pull is None:
                lifts[k, 1] = mitre - n1
            if parts[after].pull is None:
                lifts[after, 0] = mitre - n2
    corners = np.full((count, *rails[0].shape[1:]), np.nan)
    for k, s in enumerate(parts):
        d = np.array(s.layers)[:, None]
        for end, station in ((0, s.first), (1, s.last)):
            here = rails[k][end] + d * lifts[k, end]
            if np.isnan(corners[station]).any():
                corners[station] = here
            elif (gap := float(np.abs(corners[station] - here).max())) > FLOOR * size:
                raise GeometryError(
                    f"neighbouring patches miss each other by {gap:.3g} mm at their ruling",
                    value=gap,
                    limit=FLOOR * size,
                    remedy="with thickness, end the extent before the apex",
                )
    return corners, lifts
