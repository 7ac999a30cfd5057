"""Points along cuts: where their chords begin and end, the same for every cell and layer.

Every stretch of a cut between two places that it must pass (the ends of its tracks, its
crossings of rulings) is divided by itself, so that the cells on both sides of a ruling see the
same points. A stretch of length l that turns by theta has n chords of sagitta theta l / 8 n^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.layers import layer_points
from devcad.geometry.taylor import Array, rows_cross

Numbers = NDArray[np.intp]
TURN = np.radians(45.0)
"""Largest turning within one chord: a circle has 8 chords at least."""
UNEVEN = 1.2
"""A chord of a division may turn so much more: it does only where the cut all but has a corner."""
USED = 0.95
"""Share of the tolerance that a division aims at; the rest covers what it did not see."""
SHARES = np.array([0.0, 1.0 / 32.0, 0.25, 0.5, 0.75, 31.0 / 32.0, 1.0])
"""Where a cut is compared with its chord, in shares of u; the outer ones tell its directions."""
SEEN = 31.0 / 32.0
"""Of an arc's turning, what is seen from the first of the steps between these to the last."""
STEPS = 32
"""Chords of the polygon that a stretch's bending is taken from."""
ROUNDS = 8
"""How often chords that are still too far from the cut are divided again."""
FEWEST = 3
"""Chords of a closed cut: a slit of two arcs would have no width with one for each."""
BLOCK = 4096
"""Places that are evaluated at a time."""


@dataclass(frozen=True, slots=True)
class Contours:
    """The points of all cuts in rows: cut by cut, track by track, u rising to the track's end.

    line (n,): the track's number, counted through all cuts; patch, u, t, v (n,); points
    (layers, n, 3). ``group`` (n,) numbers the distinct points: where a track ends and the next
    one starts, and where points are too near to be told apart, rows are one point, equal to the
    bit. ``deviation`` is the largest distance in mm between chords and cuts on all layers.
    """

    line: Numbers
    patch: Numbers
    u: Array
    t: Array
    v: Array
    group: Numbers
    points: Array
    deviation: float


class Lines:
    """All tracks of all cuts, looked at together: many short series, one evaluation."""

    def __init__(self, cuts: Sequence[Cut], chain: Chain, layers: tuple[float, ...]) -> None:
        tracks = [track for cut in cuts for track in cut.tracks]
        self.chain, self.layers = chain, layers
        self.cut = np.repeat(np.arange(len(cuts)), [len(cut.tracks) for cut in cuts])
        self.closed = np.array([cut.closed for cut in cuts])
        self.patch = np.array([track.patch for track in tracks])
        self.u = np.array([track.u for track in tracks])
        series = [track.series for track in tracks]
        counts = [len(s.coefficients) for s in series]
        self._first = np.concatenate([[0], np.cumsum(counts)])
        self._low = np.concatenate([s.knots[:-1] for s in series])
        self._high = np.concatenate([s.knots[1:] for s in series])
        self._values = _padded([s.coefficients for s in series])
        self._slopes = _padded([s.derivative().coefficients for s in series])
        owner = np.repeat(np.arange(len(tracks)), counts)
        self._keys = 2.0 * owner + self._share(owner, self._low)

    def numbers(self, cuts: Sequence[Cut]) -> dict[tuple[int, int], int]:
        """(cut, track) -> the line's number."""
        pairs = [(c, k) for c, cut in enumerate(cuts) for k in range(len(cut.tracks))]
        return {pair: number for number, pair in enumerate(pairs)}

    def places(self, line: Numbers, u: Array) -> tuple[Array, Array]:
        """t and v at u on the lines, each (n,); t within the patch's domain."""
        found = self._evaluated(self._values, line, u)
        low, high = np.array([patch.domain for patch in self.chain.patches])[self.patch[line]].T
        inside = np.clip(found[:, 0], np.nextafter(low, high), np.nextafter(high, low))
        return inside, found[:, 1]

    def slopes(self, line: Numbers, u: Array) -> tuple[Array, Array]:
        """dt/du and dv/du, each (n,)."""
        found = self._evaluated(self._slopes, line, u)
        return found[:, 0], found[:, 1]

    def points(self, line: Numbers, t: Array, v: Array) -> Array:
        """The points (t, v) of the lines' patches on all layers, (layers, n, 3)."""
        out = np.empty((len(self.layers), len(line), 3))
        numbers = self.patch[line]
        for k in np.flatnonzero(np.bincount(numbers)).tolist():
            here = np.flatnonzero(numbers == k)
            for layer, distance in zip(out, self.layers, strict=True):
                layer[here] = layer_points(self.chain, k, t[here], v[here], distance)
        return out

    def _share(self, line: Numbers, u: Array) -> Array:
        low, high = self.u[line].T
        return np.asarray((u - low) / (high - low))

    def _evaluated(self, table: Array, line: Numbers, u: Array) -> Array:
        panel = np.searchsorted(self._keys, 2.0 * line + self._share(line, u), side="right") - 1
        panel = np.clip(panel, self._first[line], self._first[line + 1] - 1)
        low, high = self._low[panel], self._high[panel]
        x = ((u - low) - (high - u)) / (high - low)
        out = np.empty((len(u), 2))
        for start in range(0, len(u), BLOCK):
            rows = slice(start, start + BLOCK)
            # one coefficient of all places side by side: the recurrence goes through the cache once
            taken = np.take(table, panel[rows], axis=1).transpose(1, 0, 2)
            out[rows] = chebyshev.clenshaw(taken, x[rows])
        return out


def sample(lines: Lines, passed: Sequence[Array], tolerance: Array, least: float) -> Contours:
    """The points of all lines, their chords near the cut on every layer.

    Args:
        tolerance: per line, the largest distance of a chord in mm.
        passed: per line, the increasing u that must be points, its two ends included.
        least: points of a line nearer than this in mm are one point.
    """
    counts = np.array([len(u) - 1 for u in passed])
    chords = _Chords(
        np.repeat(np.arange(len(passed)), counts),
        np.concatenate([u[:-1] for u in passed]),
        np.concatenate([u[1:] for u in passed]),
    )
    chords, error = _within(lines, chords, tolerance, least)
    ends = np.arange(len(passed))
    line = np.concatenate([chords.line, ends])
    u = np.concatenate([chords.low, lines.u[:, 1]])
    order = np.lexsort((u, line))
    line, u = line[order], u[order]
    t, v = lines.places(line, u)
    points = lines.points(line, t, v)
    group = _groups(lines, line, points, least)
    first = np.unique(group, return_index=True)[1]
    return Contours(
        line, lines.patch[line], u, t, v, group, points[:, first[group]], float(error.max())
    )


@dataclass(frozen=True, slots=True)
class _Chords:
    """Chords from ``low`` to ``high`` on lines, each (n,)."""

    line: Numbers
    low: Array
    high: Array

    def at(self, rows: Numbers | NDArray[np.bool_]) -> _Chords:
        """Some of them."""
        return _Chords(self.line[rows], self.low[rows], self.high[rows])


def _within(lines: Lines, chords: _Chords, tolerance: Array, least: float) -> tuple[_Chords, Array]:
    """The chords divided until each is within the tolerance, and how far each is from the cut."""
    error, turn, length = _measured(lines, chords)
    per_cut = np.bincount(lines.cut[chords.line], minlength=len(lines.closed))
    fewest = np.where(lines.closed, -(-FEWEST // np.maximum(per_cut, 1)), 1)
    fewest = fewest[lines.cut[chords.line]]
    most = np.maximum(length // (2.0 * least), 1.0)
    coarse = ((error > tolerance[chords.line]) | (turn > TURN * (1.0 + 1e-6)) | (fewest > 1)) & (
        most > 1.0
    )
    if not coarse.any():
        return chords, error
    done = [chords.at(~coarse)]
    errors = [error[~coarse]]
    chords = _bent(lines, chords.at(coarse), fewest[coarse], most[coarse], tolerance)
    for _ in range(ROUNDS):
        error, turn, length = _measured(lines, chords)
        excess = error / tolerance[chords.line]
        parts = np.where(excess > 1.0, np.ceil(1.05 * np.sqrt(excess)), 1.0)
        parts = np.where(turn > UNEVEN * TURN, np.maximum(parts, np.ceil(turn / TURN)), parts)
        parts = np.minimum(parts, np.maximum(length // (2.0 * least), 1.0)).astype(int)
        fine = parts == 1
        done.append(chords.at(fine))
        errors.append(error[fine])
        if fine.all():
            break
        chords = _equal(chords.at(~fine), parts[~fine])
    else:
        done.append(chords)
        errors.append(_measured(lines, chords)[0])
    whole = _Chords(
        np.concatenate([c.line for c in done]),
        np.concatenate([c.low for c in done]),
        np.concatenate([c.high for c in done]),
    )
    return whole, np.concatenate(errors)


def _measured(lines: Lines, chords: _Chords) -> tuple[Array, Array, Array]:
    """The distance of each chord, or of the wall's quad, to the cut; how far it turns; its length
    on the shortest layer: each (n,)."""
    n = len(chords.line)
    u = chords.low[:, None] + (chords.high - chords.low)[:, None] * SHARES
    u[:, -1] = chords.high
    line = np.repeat(chords.line, len(SHARES))
    points = lines.points(line, *lines.places(line, u.ravel())).reshape(-1, n, len(SHARES), 3)
    start, chord = points[:, :, :1], points[:, :, -1:] - points[:, :, :1]
    square = np.maximum((chord**2).sum(axis=3, keepdims=True), 1e-300)
    away = points[:, :, 1:-1] - start
    share = np.clip((away * chord).sum(axis=3, keepdims=True) / square, 0.0, 1.0)
    error = np.linalg.norm(away - share * chord, axis=3).max(axis=(0, 2), initial=0.0)
    steps = np.diff(points, axis=2)
    turn = _angles(steps).sum(axis=2).max(axis=0, initial=0.0) / SEEN
    length = np.linalg.norm(steps, axis=3).sum(axis=2).min(axis=0, initial=np.inf)
    return error + 0.25 * _skew(points), turn, length


def _skew(points: Array) -> Array:
    """How far the corners of a wall's quads miss one plane: (n,) from points (layers, n, k, 3)."""
    if len(points) == 1:
        return np.zeros(points.shape[1])
    back, front = points[0][:, [0, -1]], points[-1][:, [0, -1]]
    chord = front[:, 1] - front[:, 0] + back[:, 1] - back[:, 0]
    normal = rows_cross(chord, front[:, 0] - back[:, 0])
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    warp = front[:, 1] - front[:, 0] - back[:, 1] + back[:, 0]
    return np.asarray(np.abs((warp * normal).sum(axis=1)) / size)


def _angles(steps: Array) -> Array:
    """The angles between consecutive steps (layers, n, k, 3), (layers, n, k - 1)."""
    a, b = steps[:, :, :-1], steps[:, :, 1:]
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=3), (a * b).sum(axis=3)))


def _bent(lines: Lines, chords: _Chords, fewest: Array, most: Array, tolerance: Array) -> _Chords:
    """The chords divided so that their sagittas and turnings are equal, each by its own bending."""
    n = len(chords.line)
    share = np.linspace(0.0, 1.0, STEPS + 1)
    u = chords.low[:, None] + (chords.high - chords.low)[:, None] * share
    line = np.repeat(chords.line, STEPS + 1)
    points = lines.points(line, *lines.places(line, u.ravel())).reshape(-1, n, STEPS + 1, 3)
    steps = np.diff(points, axis=2)
    length = np.linalg.norm(steps, axis=3)
    turn = _angles(steps)  # at the inner nodes
    sagitta = tolerance[chords.line][:, None]
    sagitta = tolerance[chords.line][:, None]
    local = 0.5 * (length[:, :, 1:] + length[:, :, :-1])
    weight = np.maximum(np.sqrt(turn * local / (8.0 * USED * sagitta)), turn / TURN)
    weight = weight.max(axis=0)
    outer = np.concatenate([weight[:, :1], weight, weight[:, -1:]], axis=1)
    weight = 0.5 * (outer[:, 1:] + outer[:, :-1])  # on the steps
    number = np.maximum(np.ceil(weight.sum(axis=1) - 1e-6), fewest)
    number = np.minimum(number, most).astype(int)
    # a floor keeps u increasing where nothing bends
    weight += 1e-3 * np.maximum(weight.sum(axis=1, keepdims=True), 1.0) / STEPS
    density = np.concatenate([np.zeros((n, 1)), np.cumsum(weight, axis=1)], axis=1)
    out = []
    for k, parts in enumerate(number.tolist()):
        at = np.interp(np.arange(parts + 1) * (density[k, -1] / parts), density[k], u[k])
        at[0], at[-1] = chords.low[k], chords.high[k]
        out.append(at)
    return _Chords(
        np.repeat(chords.line, number),
        np.concatenate([at[:-1] for at in out]),
        np.concatenate([at[1:] for at in out]),
    )


def _equal(chords: _Chords, parts: Numbers) -> _Chords:
    """Every chord in so many equal parts."""
    row = np.repeat(np.arange(len(parts)), parts)
    nth = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    low, high, count = chords.low[row], chords.high[row], parts[row]
    start = low + (high - low) * (nth / count)
    end = np.where(nth + 1 == count, high, low + (high - low) * ((nth + 1) / count))
    return _Chords(chords.line[row], start, end)


def _groups(lines: Lines, line: Numbers, points: Array, least: float) -> Numbers:
    """The number of each row's distinct point."""
    gap = np.linalg.norm(np.diff(points, axis=1), axis=2).min(axis=0)
    over = line[1:] != line[:-1]
    same_cut = lines.cut[line[1:]] == lines.cut[line[:-1]]
    joined = np.where(over, same_cut, gap < least)
    group = np.concatenate([[0], np.cumsum(~joined)])
    cut = lines.cut[line]
    first = np.searchsorted(cut, np.arange(len(lines.closed)))
    last = np.searchsorted(cut, np.arange(len(lines.closed)), side="right") - 1
    same = np.arange(group[-1] + 1)
    same[group[last[lines.closed]]] = group[first[lines.closed]]
    return np.asarray(np.unique(same[group], return_inverse=True)[1], dtype=np.intp)


def _padded(tables: list[Array]) -> Array:
    """Coefficients (k, N, d) of all series as one table (N, K, d), as wide as the widest."""
    width = max(table.shape[1] for table in tables)
    out = np.zeros((sum(len(table) for table in tables), width, tables[0].shape[2]))
    start = 0
    for table in tables:
        out[start : start + len(table), : table.shape[1]] = table
        start += len(table)
    used = int(np.flatnonzero(np.abs(out).max(axis=(0, 2)))[-1:].sum()) + 1
    return np.ascontiguousarray(out[:, :used].transpose(1, 0, 2))
