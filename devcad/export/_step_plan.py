"""From a panel to a body: which vertices, edges and faces there are, and how they share."""

from __future__ import annotations

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import Body, Ruled
from devcad.export._step_creases import alongside, joined_skins
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_faces import Rims, add_skins
from devcad.export._step_folds import folds, mirrored_knots, split
from devcad.export._step_places import Ground
from devcad.export._step_regions import Region, regions
from devcad.export._step_rims import edge_tolerance, rims
from devcad.export._step_skins import skin_of
from devcad.export._step_solid import add_end, add_walls
from devcad.export._step_strips import Strip, panel_size, strips
from devcad.export._step_touches import hair
from devcad.geometry.cells import Run
from devcad.geometry.fit import FLOOR
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.proofs import sheet_volume


def body(panel: Panel, tolerance: float, degree: int) -> Body:
    """The body of a panel: a solid with thickness, else a shell.

    Fitted faces lie within max(tolerance, 1e-9 of the size) of the true surface and twist by at
    most 0.01 degree.
    Raises:
        GeometryError: the fit is not reached, or patches and layers do not meet.
    """
    if panel.folds:
        return _folded_sheet(panel, tolerance, degree)
    size = panel_size(panel)
    parts, count = split(*strips(panel), size)
    corners, lifts = _corners(parts, count, size)
    folded = folds(parts, size)
    draft = Draft(parts, corners, size, folded)
    skins: list[Skin] = []
    for k, strip in enumerate(parts):
        start = _start(strip, [skins[i] for (j, _), (i, _) in folded.items() if j == k])
        skins.append(skin_of(strip, draft, lifts[k], tolerance, degree, start))
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


def _folded_sheet(panel: Panel, tolerance: float, degree: int) -> Body:
    """The shell of a sheet without thickness that is folded along curved creases."""
    size = panel_size(panel)
    sheet = alongside(panel, size)
    parts = sheet.parts
    corners, _ = _corners(parts, sheet.stations, size)
    draft = Draft(parts, corners, size, {}, sheet.joins)
    skins = joined_skins(draft, sheet, tolerance, degree)
    for flank, own in zip(panel.flanks, sheet.flanks, strict=True):
        mine = [skins[k] for k in own]
        left = regions(flank, [parts[k] for k in own])
        edges = [
            _rims(flank, draft, skin, found, tolerance, degree)
            for skin, found in zip(mine, left, strict=True)
        ]
        for skin, found, around in zip(mine, left, edges, strict=True):
            add_skins(draft, skin, found, around)
        draft.forget_cuts()
    return Body(
        panel.name,
        np.array(draft.points),
        tuple(draft.edges),
        tuple(draft.faces),
        False,
        0.0,
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
