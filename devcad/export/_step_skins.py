"""The skins of one strip: what its faces stand on, exact where it is a plane, a circular cylinder
or a right circular cone, else splines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import Plane, Point, Ruled, Straight, Surface, Trace
from devcad.export._step_chart import chart
from devcad.export._step_conics import arc_edge
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_rails import LongEdge, Piece, fitted_rails
from devcad.export._step_rims import edge_tolerance
from devcad.export._step_strips import Strip
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.taylor import Array

AREA_SIZE = 250.0  # mm: below it the tolerance shrinks with the part, for areas are relative


def skin_of(
    strip: Strip, draft: Draft, lifts: Array, tolerance: float, degree: int, start: Array | None
) -> Skin:
    """Surfaces and long edges of one strip."""
    if lifts.any() and strip.shape.type != "plane":
        raise GeometryError(
            "a crease beside a rolled patch has no mitre with thickness",
            remedy="give corner_radius, or thickness 0",
        )
    if strip.ruled:
        fine = face_tolerance(draft.size, tolerance)
        return _fitted_skin(strip, draft.corner_points(strip), lifts, fine, degree, start)
    return exact_skin(strip, draft, lifts, edge_tolerance(draft.size, tolerance), degree)


def face_tolerance(size: float, tolerance: float) -> float:
    """How closely fitted faces are fitted, mm."""
    return max(tolerance * min(1.0, size / AREA_SIZE), FLOOR * size)


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
    return ruled_skin(strip, corners, lifts, (low, high), probe, true)


def ruled_skin(
    strip: Strip,
    corners: Array,
    lifts: Array,
    rails: tuple[list[Spline], list[Spline]],
    probe: Array,
    true: Array,
) -> Skin:
    """A strip between the splines of its two sides, each layer by layer; ``true`` (k, 2, layers,
    3) are its true edges at the parameters ``probe`` (k,)."""
    low, high = rails
    surfaces = [Ruled(b, a) for a, b in zip(low, high, strict=True)]
    surfaces[-1] = Ruled(low[-1], high[-1])  # the front
    sides = [
        [_rail_piece(strip, s, side, corners, probe, true)] for s, side in enumerate((low, high))
    ]
    return Skin(strip, tuple(surfaces), (sides[0], sides[1]), lifts, None, probe, true)


def exact_skin(strip: Strip, draft: Draft, lifts: Array, tolerance: float, degree: int) -> Skin:
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
