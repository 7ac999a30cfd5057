"""Rulings as lines: on which of them a point of the plane or a line in space lies.

Whether a point lies on a line, or two lines of space meet, is one linear equation in the
coordinates of the lines (Pluecker). So f(t) = <row, L(t)> for a family of lines L(t) and a row
that belongs to the point, and all that is asked of a developable comes down to roots of f:

- a point P of the plane on the ruling X + v e:   f = e x (P - X), falling where q + v a > 0;
- a line (Q, D) of space that meets c0 + v e:     f = <D, e x (Q - c0)>;
- the foot of a point Q on the surface:           f = <m, Q - c0>;
- the foot of a point Q on a rail R:              f = <R', Q - R>.

L is kept as Chebyshev series on panels so short that the lines turn little on each: f is then a
polynomial of low degree, and its roots are found for any number of rows at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import clenshaw
from devcad.geometry.resolving import resolve_many
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]

TURN = 0.3
"""Radians that the lines turn on one panel, about."""
LOOKS = 65
"""Where the turning is looked at between two breaks."""
NODES = 17
"""Chebyshev nodes of one panel."""
PARTS = 4
"""Parts of a panel at whose ends f is looked at."""
CHUNK = 1 << 21
"""Values of f held at a time."""
STEPS = 60
"""Steps to a root at most: each halves its interval or better."""

Family = Callable[[Array], tuple[Array, Array]]
"""t (n,) -> coordinates of the lines (n, k) and, of any use to the caller, places (n, j)."""


@dataclass(frozen=True, slots=True)
class Roots:
    """Where f vanishes: for which rows (n,), at which t (n,), and the sign (n,) of its slope."""

    row: Index
    t: Array
    slope: Array


@dataclass(frozen=True, slots=True)
class Lines:
    """A family of lines in Chebyshev form: ``knots`` (g + 1,), ``table`` (g, N, k + j), the
    first ``width`` = k columns the lines' coordinates, the others places along them; ``reach``
    is the size in mm of what they cover."""

    knots: Array
    table: Array
    width: int
    reach: float

    def places(self, t: Array) -> Array:
        """The places at t (n,), (n, j)."""
        panel, x = self._panel(t)
        return clenshaw(self.table[panel, :, self.width :], x)

    def roots(self, rows: Array, slack: float = 0.0) -> Roots:
        """All t with <row, L(t)> = 0 for the rows (n, k), in the order of the rows.

        Where f does not change its sign at an end of the family but is within ``slack`` of 0
        there, the end counts as a root. Roots closer together than f can be looked at are found
        where f turns back between them.
        """
        step = max(1, CHUNK // (len(self.table) * PARTS + 1))
        found = [self._roots(rows[i : i + step], slack, i) for i in range(0, len(rows), step)]
        if not found:
            return Roots(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))
        row, t, slope = (np.concatenate(part) for part in zip(*found, strict=True))
        order = np.argsort(row, kind="stable")
        return Roots(row[order], t[order], slope[order])

    def _panel(self, t: Array) -> tuple[Index, Array]:
        """The panel of each t and the place in it from -1 to 1."""
        panel = np.clip(np.searchsorted(self.knots, t, side="right") - 1, 0, len(self.table) - 1)
        low, high = self.knots[panel], self.knots[panel + 1]
        return panel, ((t - low) - (high - t)) / (high - low)

    def _roots(self, rows: Array, slack: float, first: int) -> tuple[Index, Array, Array]:
        values, slopes = self._looks(rows)
        pair, bracket = self._brackets(rows, values, slopes)
        panel, a = self._polynomials(rows, pair)
        x, slope = _solved(a, bracket)
        low, high = self.knots[panel], self.knots[panel + 1]
        t = 0.5 * ((1.0 - x) * low + (1.0 + x) * high)
        out = [(pair[0], t, np.sign(slope))]
        for end, part in ((0, 0), (-1, -1)):
            near = np.abs(values[:, end]) <= slack
            near &= (values[:, end] < 0.0) == (values[:, 1 if end == 0 else -2] < 0.0)
            row = np.flatnonzero(near)
            at = np.full(len(row), self.knots[end])
            out.append((row, at, np.sign(slopes[row, part, end])))
        row, t, sign = (np.concatenate(column) for column in zip(*out, strict=True))
        return row + first, t, sign

    def _looks(self, rows: Array) -> tuple[Array, Array]:
        """f at all ends of parts (n, g PARTS + 1), and its slope per part's half width at both
        ends of each part, (n, 2, g PARTS)."""
        lines = self.table[:, :, : self.width]
        x = np.linspace(-1.0, 1.0, PARTS + 1)
        at = np.polynomial.chebyshev.chebvander(x, lines.shape[1] - 1)
        rise = at @ chebyshev.differentiation(lines.shape[1])
        seen = np.einsum("pj,gjk->gpk", at, lines)
        moved = np.einsum("pj,gjk->gpk", rise, lines) / PARTS
        ends = np.concatenate([seen[:, :-1].reshape(-1, self.width), seen[-1:, -1]])
        sides = np.stack([moved[:, :-1], moved[:, 1:]]).reshape(2, -1, self.width)
        return rows @ ends.T, np.einsum("nk,spk->nsp", rows, sides, optimize=True)

    def _brackets(
        self, rows: Array, values: Array, slopes: Array
    ) -> tuple[tuple[Index, Index], Array]:
        """Rows and parts (each (m,)) where f changes its sign, with the ends x (m, 2) between
        which it does, in the part's panel."""
        negative = values < 0.0
        row, part = np.nonzero(negative[:, 1:] != negative[:, :-1])
        ends = np.stack([np.zeros(len(row)), np.ones(len(row))], axis=1)
        # the same sign at both ends, but turning towards zero: the tangents meet beyond it
        side = np.where(negative[:, 1:], -1.0, 1.0)
        left, right = side * slopes[:, 0], side * slopes[:, 1]
        turning = (negative[:, 1:] == negative[:, :-1]) & (left < 0.0) & (right > 0.0)
        k, p = np.nonzero(turning)
        lost, gain = -left[k, p], right[k, p]
        depth = 2.0 * lost * gain / (lost + gain)
        deep = depth >= 0.5 * np.minimum(np.abs(values[k, p]), np.abs(values[k, p + 1]))
        k, p = k[deep], p[deep]
        if len(k):
            _, a = self._polynomials(rows, (k, p))
            turn = _turned(a, *_part_ends(p))
            crossed = (_value(a, turn) < 0.0) != negative[k, p]
            k, p = k[crossed], p[crossed]
            low, high = _part_ends(p)
            share = (turn[crossed] - low) / (high - low)
            row, part = np.concatenate([row, k, k]), np.concatenate([part, p, p])
            zero, one = np.zeros(len(k)), np.ones(len(k))
            more = [np.stack([zero, share], axis=1), np.stack([share, one], axis=1)]
            ends = np.concatenate([ends, *more])
        low, high = _part_ends(part)
        return (row, part), low[:, None] + (high - low)[:, None] * ends

    def _polynomials(self, rows: Array, pair: tuple[Index, Index]) -> tuple[Index, Array]:
        """The panels (m,) and the Chebyshev coefficients (m, N) of f on them."""
        row, part = pair
        panel = part // PARTS
        lines = self.table[:, :, : self.width]
        return panel, np.einsum("mjk,mk->mj", lines[panel], rows[row], optimize=True)


def lines_over(family: Family, ends: Array, dimension: int, reach: float) -> Lines:
    """The lines of a family over the ends of its smooth stretches (k + 1,), increasing.

    The first ``dimension`` coordinates are a direction, whose turning decides how long a panel
    is; the others are moments of it about the origin, at most ``reach`` mm away. Of the places
    the first ``dimension`` columns are a point, the others a unit direction.
    """
    share = np.linspace(0.0, 1.0, LOOKS)
    knots = [ends[:1]]
    for low, high in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        way = family(low + (high - low) * share)[0][:, :dimension]
        size = max(float(np.linalg.norm(way, axis=1).max()), 1e-300)
        turning = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) / size
        number = int(np.clip(np.ceil(turning / TURN), 1, 4 * LOOKS))
        knots.append(np.linspace(low, high, number + 1)[1:])
    grid = np.concatenate(knots)
    lines, places = family(grid[:-1] + 0.5 * np.diff(grid))
    scale = np.ones(lines.shape[1] + places.shape[1])
    scale[: lines.shape[1]] = np.abs(lines[:, :dimension]).max()
    scale[dimension : lines.shape[1] + dimension * (places.shape[1] > 0)] *= reach

    def look(_: Index, t: Array) -> Array:
        return np.concatenate(family(t), axis=1)

    owner = np.zeros(len(grid) - 1, dtype=np.intp)
    scales = np.broadcast_to(scale, (len(owner), len(scale)))
    panels = resolve_many(look, grid[:-1], grid[1:], scale=scales, sizes=(NODES,), owner=owner)
    return Lines(np.append(panels.low, panels.high[-1]), panels.coefficients, lines.shape[1], reach)


def _part_ends(part: Index) -> tuple[Array, Array]:
    """The ends of parts within their panels, from -1 to 1."""
    low = np.asarray((part % PARTS) * (2.0 / PARTS) - 1.0, dtype=float)
    return low, np.asarray(low + 2.0 / PARTS)


def _value(a: Array, x: Array) -> Array:
    return clenshaw(a[:, :, None], x)[:, 0]


def _with_slope(a: Array) -> Array:
    """Polynomials (m, N) and their derivatives side by side, (m, N, 2)."""
    return np.stack([a, a @ chebyshev.differentiation(a.shape[1]).T], axis=2)


def _turned(a: Array, low: Array, high: Array) -> Array:
    """Where polynomials whose slope changes its sign between low and high turn."""
    slope = a @ chebyshev.differentiation(a.shape[1]).T
    return _solved(slope, np.stack([low, high], axis=1))[0]


def _solved(a: Array, bracket: Array) -> tuple[Array, Array]:
    """The roots (m,) of polynomials (m, N) within brackets (m, 2), and the slopes there.

    Newton steps, halving instead where one would leave the bracket.
    """
    both = _with_slope(a)
    low, high = bracket[:, 0].copy(), bracket[:, 1].copy()
    start, end = _value(a, low), _value(a, high)
    below = start < 0.0
    # a root at an end, where rounding has taken the change of sign away
    lost = below == (end < 0.0)
    x = np.where(lost, np.where(np.abs(start) <= np.abs(end), low, high), 0.5 * (low + high))
    slope = clenshaw(both, x)[:, 1]
    open_ = np.flatnonzero(~lost)
    for _ in range(STEPS):
        if not len(open_):
            break
        at = x[open_]
        f, df = clenshaw(both[open_], at).T
        slope[open_] = df
        left = (f < 0.0) == below[open_]
        low[open_] = np.where(left, at, low[open_])
        high[open_] = np.where(left, high[open_], at)
        with np.errstate(invalid="ignore", divide="ignore"):
            ahead = at - f / df
        inside = (ahead >= low[open_]) & (ahead <= high[open_])
        x[open_] = np.where(inside, ahead, 0.5 * (low[open_] + high[open_]))
        moving = (np.abs(x[open_] - at) > 4e-16) & (f != 0.0)
        x[open_] = np.where(f == 0.0, at, x[open_])
        open_ = open_[moving]
    return x, slope


def sign_changes(a: Array, depth: float) -> tuple[Index, Array]:
    """Where polynomials (m, N) change their sign on [-1, 1]: their rows and x, (n,), in order.

    A value within ``depth`` of zero has no sign: that the polynomial touches zero, runs along it,
    ends on it or crosses it for no further than that is no change.
    """
    slope = a @ chebyshev.differentiation(a.shape[1]).T
    grid = -np.cos(np.linspace(0.0, np.pi, 4 * a.shape[1] + 1))
    rising = slope @ np.polynomial.chebyshev.chebvander(grid, a.shape[1] - 1).T > 0.0
    row, step = np.nonzero(rising[:, 1:] != rising[:, :-1])
    turn, _ = _solved(slope[row], np.stack([grid[step], grid[step + 1]], axis=1))
    # between its ends and the places where it turns a polynomial is monotone
    every = np.arange(len(a))
    rows = np.concatenate([every, row, every])
    x = np.concatenate([np.full(len(a), -1.0), turn, np.full(len(a), 1.0)])
    value = _value(a[rows], x)
    order = np.lexsort([x, rows])
    order = order[np.abs(value[order]) > depth]
    rows, x, negative = rows[order], x[order], value[order] < 0.0
    k = np.flatnonzero((rows[1:] == rows[:-1]) & (negative[1:] != negative[:-1]))
    root, _ = _solved(a[rows[k]], np.stack([x[k], x[k + 1]], axis=1))
    return rows[k], root
