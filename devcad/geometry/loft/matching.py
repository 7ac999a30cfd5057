"""The matching of two rails: a monotone path through their square on which nothing warps.

A global search on a coarse grid finds the topology; on every anti-diagonal u + v = const, which a
monotone path meets once, the warp's root is then found to rounding.

Source: algorithms.md, section 1 (the signed warp, dynamic programming, polish on the
anti-diagonals); Wang and Tang 2005 for the matching as a shortest path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.loft.rail import Rail
from devcad.geometry.taylor import Array

GRID = 192
"""Cells of the search along each rail."""
MOVES = ((1, 0), (0, 1), (1, 1), (1, 2), (2, 1), (1, 3), (3, 1), (2, 3), (3, 2))
STEADY = 1e-6
"""What turning aside costs (rad^2): chooses a path where warp leaves it free."""
FAN = np.radians(0.5) ** 2
"""What a fan about an end of a rail costs, per length of path (rad^2): decides where the search
goes, never how exact the result is."""
STARTS = 4
CLEARLY = 0.8
"""A later start must cost less than this share of the best so far."""
"""Starts of a closed matching that are searched."""
JUMP = 1.5
"""Two warps that differ by more have the half turn between them, not a root."""
REACHES = (3.0, 12.0, 48.0)
"""Cells around the searched path in which a root is looked for."""
LOOKS = 13
ALONG = 1e-9
"""A ruling that runs along a rail within this angle has no warp of its own: a limit of others."""
ROUNDING = 1e-13
ZERO = 1e-10
"""A warp in radians below this, at a place that is known exactly, is none."""


@dataclass(frozen=True, slots=True)
class Path:
    """Rulings from u (n,) on the first rail to v (n,) on the second, both not decreasing.

    ``solved`` (n,) tells where the warp has a root; ``warp`` (n,) is what is left, in radians.
    ``marks`` are places (u, v) on it where one part ends and another begins.
    """

    u: Array
    v: Array
    solved: NDArray[np.bool_]
    warp: Array
    marks: tuple[tuple[float, float], ...] = ()


def warp(points: Array, tangents: Array, others: Array, other_tangents: Array) -> Array:
    """The signed angle by which the tangent plane turns from one rail to the other, (...,)."""
    x, y, z = _parts(others - points)
    size = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-300)
    d = (x / size, y / size, z / size)
    p, q = (_across(_parts(tangent), d) for tangent in (tangents, other_tangents))
    turned = (p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0])
    value = np.arctan2(_inner(d, turned), _inner(p, q))
    along = np.minimum(_inner(p, p), _inner(q, q)) <= ALONG**2
    return np.asarray(np.where(along, 0.0, value))


Parts = tuple[Array, Array, Array]
"""The three coordinates of vectors, apart: a table of them fills the memory's lines."""
Value = Callable[[Array], Array]
"""Places of any shape to values."""
Rows = Callable[[NDArray[np.intp]], Value]
"""The function of each of some rows: places (n,) or (n, k) to values."""


def _parts(x: Array) -> Parts:
    return x[..., 0], x[..., 1], x[..., 2]


def _inner(x: Parts, y: Parts) -> Array:
    return np.asarray(x[0] * y[0] + x[1] * y[1] + x[2] * y[2])


def _across(x: Parts, d: Parts) -> Parts:
    along = _inner(x, d)
    return x[0] - along * d[0], x[1] - along * d[1], x[2] - along * d[2]


def warp_at(a: Rail, b: Rail, u: Array, v: Array) -> Array:
    """The warp of the rulings from u to v, arrays of one shape."""
    return warp(*a(u.ravel()), *b(v.ravel())).reshape(u.shape)


def search(a: Rail, b: Rail, *, fans: bool, through: tuple[tuple[float, float], ...] = ()) -> Path:
    """The cheapest monotone path of the grid, with the rulings in ``through`` on it."""
    steps = np.linspace(0.0, 1.0, GRID + 1)
    u = a.start + steps if a.closed else steps
    if not (a.closed and b.closed):
        return _stitched(a, b, [(0.0, 0.0), *through, (1.0, 1.0)], fans=fans and not through)
    if through:
        places = [through[0]]
        for x, y in through[1:]:  # on and on around, never back
            before = places[-1]
            onwards = x + float(np.ceil(before[0] - x)), y + float(np.ceil(before[1] - y))
            places.append(onwards)
        places.append((places[0][0] + 1.0, places[0][1] + 1.0))
        return _stitched(a, b, places, fans=False)
    best: tuple[float, Path] | None = None
    for start in _starts(a, b):
        v = start + steps
        table = _table(a, b, u, v)
        cost, path = _cheapest(table**2, fans=False)
        if best is None or cost < CLEARLY * best[0]:
            left = table[path[:, 0], path[:, 1]]
            best = (cost, Path(u[path[:, 0]], v[path[:, 1]], np.zeros(len(path), dtype=bool), left))
    assert best is not None
    return best[1]


def _starts(a: Rail, b: Rail) -> list[float]:
    """Where on the closed second rail a matching may start: the roots of the warp against the
    first rail's start, or else the places of least warp, the best first."""
    v = np.linspace(0.0, 1.0, GRID + 1)

    def of(s: Array) -> Array:
        return warp_at(a, b, np.full_like(s, a.start), s)

    value = of(v)
    change = np.flatnonzero((value[:-1] * value[1:] <= 0.0) & (np.abs(np.diff(value)) < JUMP))
    roots = illinois(of, v[change], v[change + 1], value[change], value[change + 1])
    first = np.abs(value[:-1])
    lows = np.flatnonzero((first <= np.roll(first, 1)) & (first <= np.roll(first, -1)))
    every = np.concatenate([roots, v[lows]])
    every = np.concatenate([b.knots[:-1], every])  # where nothing decides, a corner
    order = np.argsort(np.abs(of(every)).round(10), kind="stable")
    kept: list[float] = []
    for start in every[order].tolist():
        if all(abs((start - other + 0.5) % 1.0 - 0.5) > 0.5 / GRID for other in kept):
            kept.append(start)
    return kept[:STARTS]


def _stitched(a: Rail, b: Rail, places: list[tuple[float, float]], *, fans: bool) -> Path:
    """The path from place to place, in parts."""
    steps = np.linspace(0.0, 1.0, GRID + 1)
    parts: list[Array] = []
    for (u0, v0), (u1, v1) in pairwise(places):
        u, v = u0 + (u1 - u0) * steps, v0 + (v1 - v0) * steps
        _, path = _cheapest(_table(a, b, u, v) ** 2, fans=fans)
        part = np.column_stack([u[path[:, 0]], v[path[:, 1]]])
        parts.append(part[1:] if parts else part)
    way = np.concatenate(parts)
    left = warp_at(a, b, way[:, 0], way[:, 1])
    return Path(way[:, 0], way[:, 1], np.zeros(len(way), dtype=bool), left)


def _table(a: Rail, b: Rail, u: Array, v: Array) -> Array:
    (p, s), (q, t) = a(u), b(v)
    return warp(p[:, None], s[:, None], q[None], t[None])


def _cheapest(squares: Array, *, fans: bool) -> tuple[float, NDArray[np.intp]]:
    """The cost and the grid places (k, 2) of the cheapest path from corner to corner.

    Anti-diagonal after anti-diagonal: every move goes to a later one.
    """
    rows, columns = squares.shape[0] - 1, squares.shape[1] - 1
    h = 1.0 / rows
    cost = np.full(squares.shape, np.inf)
    back = np.zeros(squares.shape, dtype=np.int8)
    cost[0, 0] = 0.0
    for k in range(1, rows + columns + 1):
        i = np.arange(max(0, k - columns), min(rows, k) + 1)
        j = k - i
        tried = np.full((len(MOVES), len(i)), np.inf)
        here = squares[i, j]
        for m, (di, dj) in enumerate(MOVES):
            ok = (i >= di) & (j >= dj)
            pi, pj = i[ok] - di, j[ok] - dj
            paid = 0.5 * (here[ok] + squares[pi, pj]) * (di + dj)
            if fans and di * dj == 0:
                edge = (pi % rows == 0) if di == 0 else (pj % columns == 0)
                paid = np.where(edge, np.minimum(paid, FAN), paid)
            tried[m, ok] = cost[pi, pj] + h * (paid + STEADY * (di - dj) ** 2 / (di + dj))
        back[i, j] = np.argmin(tried, axis=0)
        cost[i, j] = tried.min(axis=0)
    place = (rows, columns)
    path = [place]
    while place != (0, 0):
        di, dj = MOVES[back[place]]
        place = (place[0] - di, place[1] - dj)
        path.append(place)
    return float(cost[-1, -1]), np.array(path[::-1])


def polished(a: Rail, b: Rail, path: Path, number: int) -> Path:
    """``number`` rulings along the path, each at the nearest root of the warp on its anti-diagonal.

    The cost grows linearly with the number.
    """
    t = np.linspace(path.u[0] + path.v[0], path.u[-1] + path.v[-1], number)
    x = np.interp(t, path.u + path.v, path.u - path.v)
    low, high = np.full(number, -np.inf), np.full(number, np.inf)
    if not (a.closed and b.closed):
        low, high = np.maximum(-t, t - 2.0), np.minimum(t, 2.0 - t)
    solved = np.zeros(number, dtype=bool)
    solved[[0, -1]] = np.abs(path.warp[[0, -1]]) <= ZERO  # where it starts and ends stays
    # between straight rails in one plane nothing warps: there the searched path is as good as any
    solved |= np.abs(warp_at(a, b, 0.5 * (t + x), 0.5 * (t - x))) <= ROUNDING

    def of(rows: NDArray[np.intp]) -> Value:
        def value(s: Array) -> Array:
            sums = t[rows].reshape(-1, *(1,) * (s.ndim - 1))
            return warp_at(a, b, 0.5 * (sums + s), 0.5 * (sums - s))

        return value

    for reach in REACHES:
        left = np.flatnonzero(~solved)
        if not left.size:
            break
        near = x[left, None] + reach / GRID * np.linspace(-1.0, 1.0, LOOKS)
        near = np.clip(near, low[left, None], high[left, None])
        found, root = nearest_root(of, left, near, x[left])
        x[left[found]] = root
        solved[left[found]] = True
    u, v = 0.5 * (t + x), 0.5 * (t - x)
    return Path(u, v, solved, warp_at(a, b, u, v))


def nearest_root(
    of: Rows, rows: NDArray[np.intp], looks: Array, wanted: Array
) -> tuple[NDArray[np.bool_], Array]:
    """Which rows (n,) have a root between two looks (n, k), and the one nearest to ``wanted``."""
    values = of(rows)(looks)
    change = (values[:, :-1] * values[:, 1:] <= 0.0) & (np.abs(np.diff(values, axis=1)) < JUMP)
    change &= np.diff(looks, axis=1) > 0.0
    away = np.where(change, np.abs(0.5 * (looks[:, :-1] + looks[:, 1:]) - wanted[:, None]), np.inf)
    k = np.argmin(away, axis=1)
    found = np.isfinite(away[np.arange(len(rows)), k])
    r, k = np.flatnonzero(found), k[found]
    return found, illinois(
        of(rows[found]), looks[r, k], looks[r, k + 1], values[r, k], values[r, k + 1]
    )


def illinois(function: Value, low: Array, high: Array, below: Array, above: Array) -> Array:
    """Roots between low and high (n,) to rounding, by the Illinois rule, rows apart."""
    best = np.where(np.abs(below) < np.abs(above), low, high)
    least = np.minimum(np.abs(below), np.abs(above))
    kept = np.zeros(len(low), dtype=bool)
    for _ in range(60):
        if not low.size or (least <= ROUNDING).all():
            break
        rise = above - below
        part = np.divide(above, rise, out=np.full_like(rise, 0.5), where=rise != 0.0)
        middle = high - np.clip(part, 0.0, 1.0) * (high - low)
        value = function(middle)
        better = np.abs(value) < least
        best, least = np.where(better, middle, best), np.minimum(least, np.abs(value))
        same = value * above > 0.0
        below = np.where(same, np.where(kept, 0.5, 1.0) * below, above)
        low = np.where(same, low, high)
        kept = same
        high, above = middle, value
    return np.asarray(best)
