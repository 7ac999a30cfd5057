"""Features laid on the sheet: cutouts and marks in its pattern become tracks on its surface."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devcad.errors import GeometryError
from devcad.features import Cutout, Drill, Features, Mark, Placing
from devcad.flatten.contours import Contours, Flags, contours, placed
from devcad.flatten.cover import COPIES, Cover, Index, cover
from devcad.flatten.development import Development
from devcad.flatten.drilling import along_walls, space, stretches_of, walls
from devcad.flatten.edges_met import SIDES, excess, leaving, rooms
from devcad.flatten.settling import Laid, settled
from devcad.flatten.stretches import (
    NOWHERE,
    Copies,
    Stretches,
    boxes,
    crossings,
    in_cells,
    joined,
    merged,
    off_borders,
    split,
)
from devcad.flatten.tracks import borders_met, on_pattern, tracks
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.drawing import Drawing
from devcad.geometry.taylor import Array

NOTCH = "move it, or give it notch = true"
"""What helps where a cutout crosses an edge."""
SMALLEST = 1e-9
"""Of its box: a contour that goes round less of an area has none."""


def laid(
    features: Features,
    chain: Chain,
    developments: tuple[Development, ...],
    jumps: Sequence[Sequence[float]] = (),
) -> tuple[tuple[Cut, ...], tuple[Drawing, ...]]:
    """The cuts and the drawings (on layer MARK) that a panel's cutouts and marks are.

    ``chain`` is the middle surface of the sheet, not bent, with the breaks of its pattern;
    ``developments`` lay it out, and at ``jumps`` of each patch not smoothly. A feature ``at`` a
    place of the pattern goes on round a tube: the pattern repeats by the motion that carries its
    first ruling to its last. ``at_surface`` = (ft, fv) counts shares of the parameter's total
    range, patch after patch, and shares of the extent there.

    A contour that passes a ruling or an edge by less than 1e-10 of the pattern's size touches it:
    a ruling between patches is not crossed then, an edge is. Marks are not clipped by cutouts.

    Raises:
        GeometryError: a cutout crosses an edge or another cutout, or parts the panel; a mark
            leaves the sheet; a drill misses or grazes the surface.
    """
    if not features.cutouts and not features.marks:
        return (), ()
    sheet = cover(chain, developments, jumps)
    flat = iter(cutouts([c for c in features.cutouts if isinstance(c, Cutout)], sheet))
    bored = iter(drills([c for c in features.cutouts if isinstance(c, Drill)], sheet))
    found = [
        one
        for cutout in features.cutouts
        for one in ([next(flat)] if isinstance(cutout, Cutout) else next(bored))
    ]
    return settled(found, sheet), marks(features.marks, sheet)


def drills(features: Sequence[Drill], sheet: Cover) -> list[list[Laid]]:
    """The holes that drills make, one entry for each wall, named place, place-2, ..."""
    if not features:
        return []
    room = space(sheet)
    of_drill = [walls(drill, room) for drill in features]
    rims = [wall for found in of_drill for wall in found]
    stretches = joined([stretches_of(wall, k, room) for k, wall in enumerate(rims)])
    closed = np.ones(len(rims), dtype=bool)
    ends = borders_met(stretches, closed, sheet)
    solve = along_walls(stretches, rims, room)
    periods = np.full(len(rims), 2.0 * np.pi)
    runs = iter(tracks(stretches, solve, ends, closed, sheet, periods))
    out = []
    for drill, found in zip(features, of_drill, strict=True):
        names = [f"{drill.place}-{k + 1}" if k else drill.place for k in range(len(found))]
        out.append([Laid(name, drill.notch, True, next(runs)) for name in names])
    flat = [one for found in out for one in found]
    runs_of, names = [one.runs for one in flat], [one.name for one in flat]
    remedies = ["move it or make it smaller"] * len(flat)
    _refuse_touching(runs_of, closed, sheet, names, remedies)
    return out


def cutouts(flat: Sequence[Cutout], sheet: Cover) -> list[Laid]:
    """The cutouts of the pattern on the surface, one entry each."""
    if not flat:
        return []
    lines = contours([cutout.contour for cutout in flat], closed=True)
    area = lines.areas()
    _refuse_flat(flat, lines, area)
    lines = lines.reversed(area > 0.0)
    lines = _placed(lines, [cutout.placing for cutout in flat], sheet)
    notch = np.array([cutout.notch for cutout in flat])
    names = [cutout.place for cutout in flat]
    near = sheet.restricted([cutout.patches for cutout in flat])
    stretches, runs, whole = _runs(lines, near, names, notch, "cutout-crosses-edge")
    return [
        Laid(
            names[k],
            bool(notch[k]),
            bool(whole[k]),
            runs[k],
            () if whole[k] else _polygons(k, lines, stretches, sheet),
        )
        for k in range(len(flat))
    ]


def _polygons(k: int, lines: Contours, stretches: Stretches, sheet: Cover) -> tuple[Array, ...]:
    """Contour k as a polygon in the pattern, for each copy of it that it lies on."""
    points = _points(k, lines)
    cells = stretches.cell[(stretches.owner == k) & (stretches.cell != NOWHERE)]
    motions = [sheet.motion(-copy) for copy in np.unique(cells // sheet.count).tolist()]
    return tuple(points @ rotation.T + shift for rotation, shift in motions)


def _points(k: int, lines: Contours) -> Array:
    """Points all along contour k."""
    own = np.flatnonzero(lines.owner == k)
    share = np.linspace(0.0, 1.0, 129)
    u = lines.low[own, None] + (lines.high - lines.low)[own, None] * share
    return lines.points(np.repeat(own, len(share)), u.ravel())


def marks(features: Sequence[Mark], sheet: Cover) -> tuple[Drawing, ...]:
    """The marks' lines as drawings on layer MARK."""
    lines = [(mark, edge) for mark in features for edge in mark.lines]
    if not lines:
        return ()
    laid_out = contours([(edge,) for _, edge in lines], closed=False)
    laid_out = _placed(laid_out, [mark.placing for mark, _ in lines], sheet)
    names = [mark.place for mark, _ in lines]
    _, runs, _ = _runs(
        laid_out, sheet, names, np.zeros(len(lines), dtype=bool), "mark-leaves-sheet"
    )
    return tuple(track.drawn("MARK") for line in runs for run in line for track in run)


def _placed(lines: Contours, placings: Sequence[Placing], sheet: Cover) -> Contours:
    """The contours where their placings put them."""
    origin = np.zeros((len(placings), 2))
    angle = np.array([placing.angle for placing in placings])
    domains = np.array([patch.domain for patch in sheet.chain.patches])
    before = np.concatenate([[0.0], np.cumsum(domains[:, 1] - domains[:, 0])])
    shares = np.full((len(placings), 2), np.nan)
    for k, placing in enumerate(placings):
        if placing.at is not None:
            origin[k] = placing.at
        elif placing.at_surface is not None:
            shares[k] = placing.at_surface
    far = shares[:, 0] * before[-1]
    number = np.clip(np.searchsorted(before, far, side="right") - 1, 0, len(domains) - 1)
    for n, patch in enumerate(sheet.chain.patches):
        own = np.flatnonzero((number == n) & ~np.isnan(far))
        if len(own):
            t = np.clip(domains[n, 0] + far[own] - before[n], *patch.domain)
            jet = patch.jet(t, 0)
            v = jet.v_from[0] + shares[own, 1] * (jet.v_to[0] - jet.v_from[0])
            origin[own] = sheet.developments[n].points(t, v)
            angle[own] += sheet.developments[n].series(t)[:, 0]
    return placed(lines, origin, angle)


def _runs(
    lines: Contours, sheet: Cover, names: Sequence[str], notch: Flags, error: str
) -> tuple[Stretches, list[list[tuple[Track, ...]]], Flags]:
    """The stretches and the runs of tracks of all contours, and which lie wholly on the sheet."""
    turns = 1
    if not sheet.copies(*boxes(lines), turns):  # far from every copy of the sheet
        raise _leaves(0, lines, sheet, f"{error}: {names[0]}", "move it")
    stretches = _in_cells(lines, sheet, sheet.copies(*boxes(lines), turns), notch)
    while sheet.shift is not None and turns < COPIES and _reach(stretches, sheet, turns):
        turns = min(4 * turns, COPIES)  # a contour that winds round the tube
        stretches = _in_cells(lines, sheet, sheet.copies(*boxes(lines), turns), notch)
    lost = np.bincount(stretches.owner, stretches.cell == NOWHERE, len(names)) > 0
    none = np.bincount(stretches.owner, stretches.cell != NOWHERE, len(names)) == 0
    for k in np.flatnonzero(none | (lost & ~notch)).tolist():
        may = not notch[k] and error.startswith("cutout")
        raise _leaves(k, lines, sheet, f"{error}: {names[k]}", NOTCH if may else "move it")
    for k in off_borders(stretches, lines, sheet).tolist():
        raise GeometryError(
            f"{error}: {names[k]} runs round a tip of the sheet and would cut it off",
            remedy="move it off the tip, or let the extent begin behind the tip",
        )
    ends = borders_met(stretches, lines.closed, sheet)
    periods = np.array([lines.period(k) for k in range(len(names))])
    solve = on_pattern(stretches, lines, sheet)
    runs = tracks(stretches, solve, ends, lines.closed, sheet, periods)
    if error == "cutout-crosses-edge":
        remedies = ["move it in or further out" if n else NOTCH for n in notch.tolist()]
        _refuse_touching(runs, ~lost, sheet, names, remedies)
    return stretches, runs, ~lost


def _reach(stretches: Stretches, sheet: Cover, turns: int) -> bool:
    """Whether a contour lies on the outermost copies that were looked at."""
    on = stretches.cell[stretches.cell != NOWHERE]
    return bool((np.abs(np.floor_divide(on, sheet.count)) >= turns).any())


def _in_cells(lines: Contours, sheet: Cover, copies: Copies, notch: Flags) -> Stretches:
    """The contours' stretches with their cells; those that may cross edges cut there too."""
    piece, u = crossings(lines, sheet, copies)
    stretches = split(lines, piece, u)
    own = notch[stretches.owner]
    if own.any():
        some = _some(stretches, np.flatnonzero(own))
        at, where = leaving(some, lines, sheet, copies)
        stretches = split(lines, np.concatenate([piece, at]), np.concatenate([u, where]))
    least = np.where(notch, 0.0, -sheet.near)
    return merged(in_cells(stretches, lines, sheet, copies, least))


def _some(s: Stretches, k: Index) -> Stretches:
    return Stretches(s.owner[k], s.piece[k], s.low[k], s.high[k], s.corner[k], s.cell[k])


def _leaves(k: int, lines: Contours, sheet: Cover, what: str, remedy: str) -> GeometryError:
    """The error of contour k, which leaves the sheet."""
    far, side, partly = excess(_points(k, lines), sheet)
    remedy = remedy if partly else "move it"
    where = f"leaves the sheet over its edge {side} by {far:.4g} mm" if side else "leaves the sheet"
    return GeometryError(f"{what} {where}", value=far, limit=0.0, remedy=remedy)


def _refuse_flat(flat: Sequence[Cutout], lines: Contours, area: Array) -> None:
    low, high = boxes(lines)
    least = SMALLEST * ((high - low) ** 2).sum(axis=1)
    for k in np.flatnonzero(~(np.abs(area) > least)).tolist():
        raise GeometryError(
            f"{flat[k].place} goes round no area", value=float(area[k]), limit=0.0,
            remedy="give a contour that does not run back on itself",
        )  # fmt: skip


def _refuse_touching(
    runs: list[list[tuple[Track, ...]]],
    whole: Flags,
    sheet: Cover,
    names: Sequence[str],
    remedies: Sequence[str],
) -> None:
    """Refuse cutouts inside the sheet that touch its edges, and notches that leave it unseen."""
    flat = [(k, track) for k, line in enumerate(runs) for run in line for track in run]
    if not flat:
        return
    least = rooms([track for _, track in flat], sheet)
    limit = np.where([whole[k] for k, _ in flat], sheet.near, -10.0 * sheet.near)
    for i in np.flatnonzero(least.room <= limit).tolist():
        k, by = flat[i][0], max(-float(least.room[i]), 0.0)
        side = SIDES[int(least.side[i])]
        how = f"leaves the sheet over its edge {side} by {by:.4g} mm"
        raise GeometryError(
            f"cutout-crosses-edge: {names[k]} "
            + (how if by > sheet.near else f"touches the sheet's edge {side}"),
            value=by,
            limit=0.0,
            remedy=remedies[k],
        )
