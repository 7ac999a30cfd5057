"""From stretches in known cells to tracks: their Chebyshev series on the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from devcad.flatten.contours import Contours, Flags
from devcad.flatten.cover import Cover, Index
from devcad.flatten.stretches import NOWHERE, Stretches, followers
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.cuts import Track
from devcad.geometry.resolving import resolve_many
from devcad.geometry.taylor import Array

Solve = Callable[[Index, Array, Array], tuple[Array, Array]]
"""Stretches (n,), u (n,) and t (n,) where it is known, else nan -> t and v, (n,)."""


def on_pattern(stretches: Stretches, lines: Contours, cover: Cover) -> Solve:
    """The places of the contours' points on the sheet."""

    def solve(which: Index, u: Array, fixed: Array) -> tuple[Array, Array]:
        points = lines.points(stretches.piece[which], u)
        return cover.solve(points, stretches.cell[which], fixed)

    return solve


def borders_met(stretches: Stretches, closed: Flags, cover: Cover) -> tuple[Array, Array]:
    """t at the start and at the end of stretches where they go on in a neighbouring cell, (n,)
    each; nan where they do not."""
    after = followers(stretches, closed)
    cell, number = stretches.cell, stretches.cell % cover.count
    start, end = np.full(len(cell), np.nan), np.full(len(cell), np.nan)
    on = (after >= 0) & (cell != NOWHERE) & (cell[after] != NOWHERE)
    step = np.where(on, cell[after] - cell, 0)
    for way, mine, other in ((1, cover.high, cover.low), (-1, cover.low, cover.high)):
        k = np.flatnonzero(step == way)
        end[k] = mine[number[k]]
        start[after[k]] = other[number[after[k]]]
    return start, end


def tracks(
    stretches: Stretches,
    solve: Solve,
    ends: tuple[Array, Array],
    closed: Flags,
    cover: Cover,
    periods: Array,
) -> list[list[tuple[Track, ...]]]:
    """The runs of tracks of each contour: one closed run, or what lies on the sheet of it.

    Args:
        solve: the places on the surface; ``ends`` the t known at the ends of stretches.
        closed: (k,) whether each contour is closed; ``periods`` (k,) its parameter's length.
    """
    on = np.flatnonzero(stretches.cell != NOWHERE)
    pieces = _series(stretches, on, solve, ends, cover)
    of_stretch = dict(zip(on.tolist(), pieces, strict=True))
    out: list[list[tuple[Track, ...]]] = []
    for owner in range(len(closed)):
        low, high = np.searchsorted(stretches.owner, [owner, owner + 1]).tolist()
        runs = _runs(stretches, low, high, bool(closed[owner]), float(periods[owner]), cover)
        out.append([_joined(run, of_stretch, stretches, cover) for run in runs])
    return out


def _series(
    stretches: Stretches, on: Index, solve: Solve, ends: tuple[Array, Array], cover: Cover
) -> list[Piecewise]:
    low, high = stretches.low[on], stretches.high[on]

    def sample(which: Index, u: Array) -> Array:
        k = on[which]
        fixed = np.where(u == low[which], ends[0][k], np.nan)
        fixed = np.where(u == high[which], ends[1][k], fixed)
        return np.column_stack(solve(k, u, fixed))

    number = stretches.cell[on] % cover.count
    domain = np.array([p.domain for p in cover.chain.patches])[cover.patch[number]]
    width = domain[:, 1] - domain[:, 0]
    reach = np.array([line.reach for line in cover.lines])[cover.patch[number]]
    scale = np.column_stack([width, reach])
    return resolve_many(sample, low, high, scale=scale).series(len(on))


Run = list[tuple[int, float]]
"""Stretches one after the other with what is added to their parameter."""


def _runs(
    s: Stretches, low: int, high: int, closed: bool, period: float, cover: Cover
) -> list[Run]:
    """The maximal runs of stretches on the sheet, beginning where a track has to if there is such
    a place."""
    number = list(range(low, high))
    if not number:
        return []
    whole = all(s.cell[k] != NOWHERE for k in number)
    turned: Run = [(k, 0.0) for k in number]
    if closed:
        starts = [k for k in number if not whole and s.cell[k] == NOWHERE]
        if whole:
            starts = [k for k in number if _begins(s, k, number, cover)]
        if starts:
            at = starts[0] - low
            turned = turned[at:] + [(k, period) for k in number[:at]]
    runs: list[Run] = [[]]
    for entry in turned:
        if s.cell[entry[0]] == NOWHERE:
            runs.append([])
        else:
            runs[-1].append(entry)
    return [run for run in runs if run]


def _begins(s: Stretches, k: int, number: list[int], cover: Cover) -> bool:
    """Whether a track begins at the start of stretch k."""
    return _parted(s, k - 1 if k > number[0] else number[-1], k, cover)


def _parted(s: Stretches, before: int, k: int, cover: Cover) -> bool:
    """Whether one track ends with a stretch and another begins with the one that follows it."""
    if s.corner[k] or _home(s, before, cover) != _home(s, k, cover):
        return True
    cells = int(s.cell[before]), int(s.cell[k])
    return cells[0] != cells[1] and bool(cover.corners[max(cells) % cover.count])


def _home(s: Stretches, k: int, cover: Cover) -> tuple[int, int]:
    """The copy and the patch of a stretch."""
    copy, cell = divmod(int(s.cell[k]), cover.count)
    return copy, int(cover.patch[cell])


def _joined(
    run: Run, series: dict[int, Piecewise], s: Stretches, cover: Cover
) -> tuple[Track, ...]:
    """The tracks of a run: a new one at every corner, in the pattern or in space, and on every
    other patch."""
    out: list[Track] = []
    group: list[Piecewise] = []
    for i, (k, later) in enumerate(run):
        piece = series[k]
        piece = replace(piece, knots=piece.knots + later) if later else piece
        if i and _parted(s, run[i - 1][0], k, cover):
            out.append(Track(_home(s, run[i - 1][0], cover)[1], _chained(group)))
            group = []
        group.append(piece)
    out.append(Track(_home(s, run[-1][0], cover)[1], _chained(group)))
    return tuple(out)


def _chained(parts: list[Piecewise]) -> Piecewise:
    """Series that follow one another as one, knots where they meet."""
    if len(parts) == 1:
        return parts[0]
    width = max(part.coefficients.shape[1] for part in parts)
    tables = []
    for part in parts:
        short = width - part.coefficients.shape[1]
        tables.append(np.pad(part.coefficients, ((0, 0), (0, short), (0, 0))))
    knots = np.concatenate([parts[0].knots[:1], *(part.knots[1:] for part in parts)])
    return Piecewise(knots, np.concatenate(tables))
