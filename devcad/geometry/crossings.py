"""Where cuts cross rulings: every track in passages, each within one cell.

All tracks of a patch are worked on together: their Chebyshev series are cut where t turns back,
and on every monotone stretch the rulings that it crosses are found by bisection and Newton steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]

SNAP = 1e-11
"""Of the patch's domain: a corner of a cut as near to a ruling lies on it."""
TURNS = 64
"""Places on one polynomial between which t is seen to turn back."""
SLOPE = 1e-4
"""Of a step between two such places: what a polynomial's slope at its ends is taken from."""
HALVINGS, NEWTON = 24, 4
"""Steps to a crossing: 24 halvings leave 6e-8 of the stretch, Newton steps square it."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a cut meets a border; as :class:`devcad.geometry.cells.Spot`."""

    side: int
    patch: int
    at: float
    key: tuple[int, int, float]


@dataclass(frozen=True, slots=True)
class Passage:
    """A stretch of a track within cell number ``cell``; ``enters`` and ``leaves`` are the places
    on the cell's border, None where the cut goes on in the same cell."""

    cut: int
    track: int
    u: tuple[float, float]
    cell: int
    enters: Place | None
    leaves: Place | None


@dataclass(frozen=True, slots=True)
class _Table:
    """The polynomials of all tracks of a patch, one in a row: Chebyshev coefficients of t and v
    (k, N, 2) over u from ``low`` to ``high`` (k,), and whose they are (k,)."""

    coefficients: Array
    low: Array
    high: Array
    cut: Index
    track: Index

    def at(self, row: Index, u: Array) -> Array:
        """(t, v) of row[i] at u[i], (n, 2)."""
        low, high = self.low[row], self.high[row]
        x = ((u - low) - (high - u)) / (high - low)
        return chebyshev.clenshaw(self.coefficients[row], x)


def passages(
    cuts: Sequence[Cut], chain: Chain, number: int, borders: Array | None
) -> list[Passage]:
    """The passages of all cuts on patch ``number``, in the order of cuts, tracks and u.

    ``borders`` (k + 1,) are rulings from end to end of the patch; None for its ends alone.
    """
    patch = chain.patches[number]
    table = _table(cuts, number)
    if table is None:
        return []
    inner = np.zeros(0) if borders is None else np.asarray(borders, dtype=float)[1:-1]
    row, u, t = _monotone(table, patch.domain)
    t = _snapped(t, inner, patch.domain)
    crossing = _crossings(table, row, u, t, inner)
    firsts = np.flatnonzero(np.diff(table.cut, prepend=-1) | np.diff(table.track, prepend=-1))
    begin = np.searchsorted(inner, t[np.searchsorted(row, firsts), 0], side="right")
    out: dict[int, list[Passage]] = {}
    for k, cell in zip(firsts.tolist(), begin.tolist(), strict=True):
        c, i = int(table.cut[k]), int(table.track[k])
        found = _track_passages(cuts, chain, c, i, cell, crossing.get((c, i), []))
        out.setdefault(c, []).extend(found)
    return [passage for found in out.values() for passage in without_touches(found)]


def without_touches(found: list[Passage]) -> list[Passage]:
    """The passages of one cut in order without those of no length: there it touches a border and
    turns back, has its corner on it, or begins or ends where a ruling meets the sheet's edge."""
    ring = list(found)
    k = 0
    while k < len(ring) and len(ring) > 1:
        p = ring[k]
        if p.u[0] < p.u[1]:
            k += 1
            continue
        before, after = k - 1, (k + 1) % len(ring)
        sides = p.enters and p.enters.side, p.leaves and p.leaves.side
        back = None not in sides and sides[0] == sides[1]
        if p.leaves is None or back or sides[0] in (1, 3):
            ring[after] = replace(ring[after], enters=None if back else p.enters)
        if p.enters is None or back or sides[1] in (1, 3):
            ring[before] = replace(ring[before], leaves=None if back else p.leaves)
        del ring[k]
        k = max(k - 1, 0)
    return ring


def _table(cuts: Sequence[Cut], number: int) -> _Table | None:
    found = [
        (c, i, track.series)
        for c, cut in enumerate(cuts)
        for i, track in enumerate(cut.tracks)
        if track.patch == number
    ]
    if not found:
        return None
    width = max(series.coefficients.shape[1] for _, _, series in found)
    counts = [len(series.coefficients) for _, _, series in found]
    coefficients = np.zeros((sum(counts), width, 2))
    start = 0
    for (_, _, series), count in zip(found, counts, strict=True):
        coefficients[start : start + count, : series.coefficients.shape[1]] = series.coefficients
        start += count
    return _Table(
        coefficients,
        np.concatenate([series.knots[:-1] for _, _, series in found]),
        np.concatenate([series.knots[1:] for _, _, series in found]),
        np.repeat([c for c, _, _ in found], counts),
        np.repeat([i for _, i, _ in found], counts),
    )


def _monotone(table: _Table, domain: tuple[float, float]) -> tuple[Index, Array, Array]:
    """Stretches on which t rises or falls: their rows (m,), u and t at both ends (m, 2)."""
    count = len(table.low)
    share = np.linspace(0.0, 1.0, TURNS + 1)
    # a turn right behind the start, or before the end, shows in the slope there alone
    share = np.concatenate([[0.0, SLOPE * share[1]], share[1:-1], [1.0 - SLOPE * share[1], 1.0]])
    rows = np.repeat(np.arange(count), len(share))
    u = (table.low[:, None] + (table.high - table.low)[:, None] * share).ravel()
    t = table.at(rows, u)[:, 0].reshape(count, -1)
    rise = np.sign(np.diff(t, axis=1))
    rise[np.abs(np.diff(t, axis=1)) <= SNAP * (domain[1] - domain[0])] = 0.0
    seen = np.maximum.accumulate(np.where(rise != 0.0, np.arange(len(share) - 1), 0), axis=1)
    rise = np.take_along_axis(rise, seen, axis=1)  # where t stands still, as before
    row, step = np.nonzero(rise[:, 1:] * rise[:, :-1] < 0.0)
    grid = u.reshape(count, -1)
    turn = _turn(table, row, grid[row, step], grid[row, step + 2], rise[row, step])
    turns: list[list[float]] = [[] for _ in range(count)]
    for k, at in zip(row.tolist(), turn.tolist(), strict=True):
        turns[k].append(at)
    ends = [
        np.array([a, *inner, b])
        for a, b, inner in zip(table.low.tolist(), table.high.tolist(), turns, strict=True)
    ]
    which = np.repeat(np.arange(count), [len(e) - 1 for e in ends])
    low = np.concatenate([e[:-1] for e in ends])
    high = np.concatenate([e[1:] for e in ends])
    both = np.stack([table.at(which, low)[:, 0], table.at(which, high)[:, 0]], axis=1)
    return which, np.stack([low, high], axis=1), both


def _turn(table: _Table, row: Index, low: Array, high: Array, rise: Array) -> Array:
    """Where t turns back between low and high, by golden section: (n,)."""
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(40 if len(row) else 0):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        ahead = rise * (table.at(row, b)[:, 0] - table.at(row, a)[:, 0]) > 0.0
        low, high = np.where(ahead, a, low), np.where(ahead, high, b)
    return np.asarray(0.5 * (low + high))


def _snapped(t: Array, inner: Array, domain: tuple[float, float]) -> Array:
    """The parameters t, those as near to a border as a rounding moved onto it."""
    if not len(inner):
        return t
    reach = SNAP * (domain[1] - domain[0])
    near = np.searchsorted(inner, t)
    for k in (near - 1, near):
        border = inner[np.clip(k, 0, len(inner) - 1)]
        t = np.where(np.abs(t - border) <= reach, border, t)
    return t


def _crossings(
    table: _Table, row: Index, u: Array, t: Array, inner: Array
) -> dict[tuple[int, int], list[tuple[float, int, float]]]:
    """For each track the places (u, cell after, v) where it passes an inner border."""
    cell = np.searchsorted(inner, t, side="right")
    passed = np.abs(cell[:, 1] - cell[:, 0])
    which = np.repeat(np.arange(len(row)), passed)
    if not len(which):
        return {}
    nth = np.arange(len(which)) - np.repeat(np.cumsum(passed) - passed, passed)
    rising = cell[which, 1] > cell[which, 0]
    border = np.where(rising, cell[which, 0] + nth, cell[which, 0] - 1 - nth)
    at = inner[border]
    places = _solved(table, row[which], u[which], t[which], at)
    heights = table.at(row[which], places)[:, 1]
    out: dict[tuple[int, int], list[tuple[float, int, float]]] = {}
    after = np.where(rising, border + 1, border)
    for k, w in enumerate(which.tolist()):
        key = int(table.cut[row[w]]), int(table.track[row[w]])
        entry = float(places[k]), int(after[k]), float(heights[k])
        out.setdefault(key, []).append(entry)
    return out


def _solved(table: _Table, row: Index, u: Array, t: Array, at: Array) -> Array:
    """u where t(u) = at on monotone stretches; an end that lies on the border is the place."""
    low, high = u[:, 0].copy(), u[:, 1].copy()
    rise = np.sign(t[:, 1] - t[:, 0])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        below = rise * (table.at(row, middle)[:, 0] - at) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    place = 0.5 * (low + high)
    step = 1e-6 * (u[:, 1] - u[:, 0])
    for _ in range(NEWTON):
        ahead = table.at(row, place + 0.5 * step)[:, 0] - table.at(row, place - 0.5 * step)[:, 0]
        miss = table.at(row, place)[:, 0] - at
        with np.errstate(invalid="ignore", divide="ignore"):
            moved = place - miss * step / ahead
        place = np.where(np.isfinite(moved), np.clip(moved, low, high), place)
    place = np.where(t[:, 0] == at, u[:, 0], place)
    return np.asarray(np.where(t[:, 1] == at, u[:, 1], place))


def _track_passages(
    cuts: Sequence[Cut],
    chain: Chain,
    c: int,
    i: int,
    cell: int,
    crossed: list[tuple[float, int, float]],
) -> list[Passage]:
    """The passages of one track, from its start in cell number ``cell``."""
    cut, track = cuts[c], cuts[c].tracks[i]
    start, end = track.u
    enters = _end_place(cuts, chain, c, i, last=False)
    out: list[Passage] = []
    position = start
    for u, after, v in crossed:
        rising = after > cell
        key = _key(cut, c, i, u)
        leaves = Place(2 if rising else 0, track.patch, v, key)
        out.append(Passage(c, i, (position, u), cell, enters, leaves))
        enters = Place(0 if rising else 2, track.patch, v, key)
        position, cell = u, after
    leaves_ = _end_place(cuts, chain, c, i, last=True)
    out.append(Passage(c, i, (position, end), cell, enters, leaves_))
    return out


def _key(cut: Cut, c: int, i: int, u: float) -> tuple[int, int, float]:
    """The key of a place on track i: its end is the next track's start."""
    if u < cut.tracks[i].u[1] or (i == len(cut.tracks) - 1 and not cut.closed):
        return c, i, u
    following = (i + 1) % len(cut.tracks)
    return c, following, cut.tracks[following].u[0]


def _end_place(cuts: Sequence[Cut], chain: Chain, c: int, i: int, *, last: bool) -> Place | None:
    """Where a track ends (or starts) on its patch's border, None where the cut goes on there."""
    cut, track = cuts[c], cuts[c].tracks[i]
    other = i + 1 if last else i - 1
    u = track.u[1 if last else 0]
    t, v = track.series(np.array([u]))[0].tolist()
    patch = chain.patches[track.patch]
    low, high = patch.domain
    if cut.closed or 0 <= other < len(cut.tracks):
        neighbour = cut.tracks[other % len(cut.tracks)]
        t2 = float(neighbour.series(np.array([neighbour.u[0 if last else 1]]))[0, 0])
        if neighbour.patch == track.patch and abs(t2 - t) <= 0.5 * (high - low):
            return None
        side = 2 if high - t < t - low else 0
        return Place(side, track.patch, v, _key(cut, c, i, u))
    frame = patch.frame([min(max(t, low), high)])
    pace = float(np.abs(frame.q + v * frame.a)[0])
    away = [(abs(v - float(frame.v_to[0])), 1, t), (abs(v - float(frame.v_from[0])), 3, t)]
    if not chain.closed:  # a corner of the sheet, or of a patch, counts to the rail
        away += [(pace * abs(t - low), 0, v)] * (track.patch == 0)
        away += [(pace * abs(high - t), 2, v)] * (track.patch == len(chain.patches) - 1)
    _, side, at = min(away, key=lambda place: place[0])
    return Place(side, track.patch, at, _key(cut, c, i, u))
