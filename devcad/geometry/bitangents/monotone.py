"""Smooth functions for a branch of bitangent pairs: s and t of one parameter, piece by piece.

Between two turning points of a branch both s and t are monotone. With u = w_s |s - s0| and
v = w_t |t - t0| the piece is a graph over sigma = u + v: eta = u - v, |d eta / d sigma| <= 1, also
where one of the two stands still; so eta is found on each line sigma = const by Newton's method in
one unknown. Near a node of the branch, where other branches come close, eta is a series: the
function's own along (x, eta0 x + eta1 x^2 + ..), its first terms divided off.

A piece that ends where curves meet is given by the slopes (s - s0)/x, (t - t0)/x from there, for
the ruling's direction there is that of its length over x; eta/x is found by Newton's method on a
function of which x^2 is divided off (``Pairs.leaving``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry import chebyshev, taylor
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.branches import Path, linear, meet, spans
from devcad.geometry.bitangents.rails import Rail
from devcad.geometry.bitangents.zeroset import Unresolved
from devcad.geometry.chebyshev import Function, Piecewise
from devcad.geometry.taylor import Array

TERMS = 9
"""Coefficients of the series at a node."""
ROUNDING = 4e-16
"""Steps of Newton's method below this share of the domain are rounding."""
NOISE = 4e-16
"""Last coefficients of a piece below this share of its length are noise: left out."""
STEEP = 33
"""Most coefficients of a panel: its derivative loses the square of them."""
MISSED = 2e-14
"""Between the samples of a panel it is right to this share of the domain."""
BETWEEN = np.array([0.07, 0.19, 0.33, 0.46, 0.61, 0.74, 0.88, 0.97])
"""Where on a panel that is looked at."""
MANY = 64
"""Panels of a piece beyond which they are not halved for that."""


@dataclass(frozen=True, slots=True)
class Piece:
    """s and t over ``domain``, both monotone: ``series`` has the components s and t.

    Where curves meet at an end, ``pivot`` is (sigma0, s0, t0) there and ``series`` has the slopes
    (s - s0) / x and (t - t0) / x, x = sigma - sigma0. ``low`` and ``high`` (k, 2) bound s and t on
    each panel of the series, so that a parameter stays on its own side of a curve's breaks;
    ``breaks`` are where one is passed.
    """

    series: Piecewise
    domain: tuple[float, float]
    breaks: tuple[float, ...]
    low: Array
    high: Array
    pivot: tuple[float, float, float] | None = None

    def at(self, sigma: Array, order: int) -> tuple[Array, Array]:
        """The Taylor series of s and of t, each (order + 1, n)."""
        out = self._series(sigma, order)
        if self.pivot is not None:
            out = taylor.mul(self._from_pivot(sigma, order), out)
            out[0] += self.pivot[1:]
        knots = self.series.knots
        panel = np.clip(np.searchsorted(knots, sigma, side="right") - 1, 0, len(knots) - 2)
        out[0] = np.clip(out[0], self.low[panel], self.high[panel])
        return out[..., 0], out[..., 1]

    def rulings(self, pairs: Pairs, sigma: Array, order: int) -> tuple[Array, Array, Array]:
        """The series of the points on the first curve, of the directions and of the lengths."""
        if self.pivot is None:
            return pairs.ruling(*self.at(sigma, order))
        x = self._from_pivot(sigma, order)
        way = pairs.leaving(np.array(self.pivot[1:]), x, self._series(sigma, order))[1]
        side = 1.0 if self.pivot[0] == self.domain[0] else -1.0
        length = taylor.mul(side * x, taylor.norm(way))
        length[0] = np.maximum(length[0], 0.0)
        return pairs.first.along(self.at(sigma, order)[0])[0], side * taylor.unit(way), length

    def _series(self, sigma: Array, order: int) -> Array:
        """The Taylor series of ``series``, (order + 1, n, 2)."""
        out = np.empty((order + 1, len(sigma), 2))
        function, factor = self.series, 1.0
        for k in range(order + 1):
            out[k] = factor * function(sigma)
            function, factor = function.derivative(), factor / (k + 1)
        return out

    def _from_pivot(self, sigma: Array, order: int) -> Array:
        """x as a series, (order + 1, n)."""
        assert self.pivot is not None
        return taylor.variable(sigma - self.pivot[0], order)

    def shifted(self, shift: float) -> Piece:
        """The same piece, its parameter larger by ``shift``."""
        low, high = self.domain
        pivot = self.pivot
        return replace(
            self,
            series=replace(self.series, knots=self.series.knots + shift),
            domain=(low + shift, high + shift),
            breaks=tuple(x + shift for x in self.breaks),
            pivot=None if pivot is None else (pivot[0] + shift, *pivot[1:]),
        )


def pieces(pairs: Pairs, path: Path) -> tuple[Piece, ...]:
    """The pieces of a family between its turning points; sigma begins with the first s.

    Raises:
        Unresolved: the path is too coarse to begin from.
    """
    out: list[Piece] = []
    start = float(path.places[0, 0])
    path = _halved(pairs, path)
    for first, last in zip(path.splits[:-1], path.splits[1:], strict=True):
        piece = _Chart(pairs, path, first, last, start).piece()
        out.append(piece)
        start = piece.domain[1]
    return tuple(out)


def _halved(pairs: Pairs, path: Path) -> Path:
    """The path with one more split if its only piece has a tip at either end, and curves meet."""
    if len(path.splits) > 2 or not any(path.meets):
        return path
    free = [k for k in range(1, len(path.places) - 1) if k not in path.nodes]
    if not free:
        raise Unresolved(path.places[0])
    middle = free[len(free) // 2]
    places = path.places.copy()
    way = path.tangents[middle] / spans(pairs) ** 2
    along = linear((float(way[0]), float(way[1])), float(way @ places[middle]))
    places[middle] = meet(pairs, places[middle], along)
    return replace(path, places=places, splits=(0, middle, path.splits[-1]))


class _Chart:
    """The coordinates (sigma, eta) of one monotone piece of a path, and eta as their function."""

    def __init__(self, pairs: Pairs, path: Path, first: int, last: int, start: float) -> None:
        rows = slice(first, last + 1)
        places, tangents = path.places[rows], path.tangents[rows]
        way = places[-1] - places[0]
        span = spans(pairs)
        signs = np.where(way < 0.0, -1.0, 1.0)
        self.pairs, self.places, self.start = pairs, places, start
        self.scale = signs * 0.5 * np.array([1.0, span[0] / span[1]])
        u, v = ((places - places[0]) * self.scale).T
        self.sigma, self.eta = start + (u + v), u - v
        if not (np.diff(self.sigma) > 0.0).all():
            raise Unresolved(places[int(np.argmin(np.diff(self.sigma)))])
        du, dv = (tangents * self.scale).T
        self.slope = np.clip((du - dv) / np.maximum(du + dv, 1e-300), -1.0, 1.0)
        here = {k - first: n.degree for k, n in path.nodes.items() if first <= k <= last}
        self.nodes = [
            passage
            for degree in sorted(set(here.values()))
            for passage in self._passages([k for k in here if here[k] == degree], degree)
        ]
        ends = {0: path.meets[0] and first == 0}
        ends[len(places) - 1] = path.meets[1] and last == len(path.places) - 1
        self.pivot = next((k for k, meets in ends.items() if meets), None)

    def place(self, sigma: Array, eta: Array) -> Array:
        """s and t of chart coordinates, (..., 2); also of their series (no constant terms)."""
        both = np.stack([sigma + eta, sigma - eta], axis=-1)
        return np.asarray(both / (2.0 * self.scale))

    def _passages(self, index: list[int], degree: int) -> list[tuple[float, float, Array, float]]:
        """At nodes of one degree: sigma, eta, the series of eta, and how far it is right."""
        at, count = self.places[index], len(index)
        span = float(self.sigma[-1] - self.sigma[0])
        eta = np.zeros((TERMS + degree + 1, count))
        eta[1] = self.slope[index]
        # the slope of the lowest form in the direction: central differences, exact to degree 4
        d = 0.01
        low = np.tile(eta[: degree + 1], 4)
        low[1] += np.repeat([d, -d, 2.0 * d, -2.0 * d], count)
        form = self._along(np.tile(at, (4, 1)), low)[degree].reshape(4, count)
        slope = (8.0 * (form[0] - form[1]) - (form[2] - form[3])) / (12.0 * d)
        if not (slope != 0.0).all():
            raise Unresolved(at[int(np.argmin(np.abs(slope)))])
        for k in range(1, TERMS + 1):  # the first is the direction itself, once more
            term = degree + k - 1
            eta[k] -= self._along(at, eta[: term + 1])[term] / slope
        sizes, powers = np.abs(eta[TERMS - 1 : TERMS + 1]), np.array([[TERMS - 1.0], [TERMS]])
        with np.errstate(divide="ignore"):
            reach = np.minimum(((1e-16 * span / sizes) ** (1.0 / powers)).min(axis=0), 0.02 * span)
        return [
            (float(self.sigma[k]), float(self.eta[k]), eta[: TERMS + 1, j], float(reach[j]))
            for j, k in enumerate(index)
        ]

    def _along(self, at: Array, eta: Array) -> Array:
        """The series of the pairs' function from places (n, 2) on, along eta(x), (K + 1, n)."""
        x = np.zeros_like(eta)
        x[1] = 1.0
        path = self.place(x, eta)
        path[0] = at
        return np.asarray(self.pairs.series(path[..., 0], path[..., 1]))

    def solved(self, sigma: Array) -> Array:
        """s and t, (n, 2), at sigma (n,) within the piece."""
        eta = self._guess(sigma)
        near = np.zeros(len(sigma), bool)
        for at, here, coefficients, reach in self.nodes:
            x = sigma - at
            chosen = np.abs(x) <= reach
            eta[chosen] = here + np.polynomial.polynomial.polyval(x[chosen], coefficients)
            near |= chosen
        free = ~near
        if free.any():
            eta[free] = self._newton(sigma[free], eta[free])
        return np.asarray(self.places[0] + self.place(sigma - self.start, eta))

    def slopes(self, sigma: Array) -> Array:
        """(s - s0) / x and (t - t0) / x from the pivot, (n, 2), at sigma (n,) within the piece."""
        assert self.pivot is not None
        at, level = self.sigma[self.pivot], self.eta[self.pivot]
        x = sigma - at
        with np.errstate(all="ignore"):
            slope = (self._guess(sigma) - level) / x
        near = np.zeros(len(sigma), bool)
        for place, here, coefficients, reach in self.nodes:
            chosen = np.abs(sigma - place) <= reach
            if place == at:
                slope[chosen] = np.polynomial.polynomial.polyval(x[chosen], coefficients[1:])
            else:
                eta = np.polynomial.polynomial.polyval(sigma[chosen] - place, coefficients)
                slope[chosen] = (here - level + eta) / x[chosen]
            near |= chosen
        free = ~near
        if free.any():
            slope[free] = self._slope(x[free], slope[free])
        return np.asarray(np.stack([1.0 + slope, 1.0 - slope], axis=-1) / (2.0 * self.scale))

    def _slope(self, x: Array, slope: Array) -> Array:
        """eta / x beside the pivot."""
        place, limit = self.places[self.pivot], 0.1
        step = np.full(len(x), np.inf)
        beside = np.stack([x, np.zeros_like(x)])
        tilt = np.array([1.0, -1.0])
        for _ in range(12):
            rates = np.stack([1.0 + slope[:, None] * tilt, np.tile(tilt, (len(x), 1))])
            value, rise = self.pairs.leaving(place, beside, rates / (2.0 * self.scale))[0]
            with np.errstate(all="ignore"):
                new = np.clip(np.nan_to_num(-value / rise, nan=limit), -limit, limit)
            done = np.abs(new) >= np.maximum(0.5 * np.abs(step), ROUNDING)
            step = np.where(done & (np.abs(step) < 1e-10), 0.0, new)
            slope = slope + step
            if not (np.abs(step) > ROUNDING).any():
                break
        if not np.abs(step).max(initial=0.0) <= 1e-9:
            raise Unresolved(place)
        return slope

    def _guess(self, sigma: Array) -> Array:
        """eta by cubic interpolation of the path."""
        k = np.clip(np.searchsorted(self.sigma, sigma, side="right") - 1, 0, len(self.sigma) - 2)
        step = self.sigma[k + 1] - self.sigma[k]
        x = (sigma - self.sigma[k]) / step
        y = 1.0 - x
        ends = self.eta[k] * y * y * (1.0 + 2.0 * x) + self.eta[k + 1] * x * x * (1.0 + 2.0 * y)
        return np.asarray(ends + step * x * y * (self.slope[k] * y - self.slope[k + 1] * x))

    def _newton(self, sigma: Array, eta: Array) -> Array:
        """eta where the pairs' function vanishes."""
        span = float(spans(self.pairs)[0])
        tilt = 0.5 / self.scale * np.array([1.0, -1.0])
        limit = 0.5 * float(np.diff(self.sigma).max())
        step = np.full(len(eta), np.inf)
        for _ in range(12):
            s, t = (self.places[0] + self.place(sigma - self.start, eta)).T
            value, slope = self.pairs.towards(s, t, float(tilt[0]), float(tilt[1]), 1)
            with np.errstate(all="ignore"):
                new = np.clip(np.nan_to_num(-value / slope, nan=limit), -limit, limit)
            # a step that no longer shrinks is rounding
            done = np.abs(new) >= np.maximum(0.5 * np.abs(step), ROUNDING * span)
            step = np.where(done & (np.abs(step) < 1e-10 * span), 0.0, new)
            eta = eta + step
            if not (np.abs(step) > ROUNDING * span).any():
                break
        if not np.abs(step).max(initial=0.0) <= 1e-9 * span:
            worst = int(np.argmax(np.abs(step)))
            raise Unresolved(self.place(sigma - self.start, eta)[worst] + self.places[0])
        return eta

    def piece(self) -> Piece:
        """The piece, resolved to rounding between the breaks.

        Raises:
            Unresolved: s or t turns where the path did not say so.
        """
        breaks = self._breaks()
        knots = np.array([self.sigma[0], *breaks, self.sigma[-1]])
        pivot, function, size = None, self.solved, spans(self.pairs)
        if self.pivot is not None:
            s, t = self.places[self.pivot]
            pivot = float(self.sigma[self.pivot]), float(s), float(t)
            function, size = self.slopes, 1.0 / np.abs(self.scale)
        series = self._resolved(function, knots, size)
        free = np.full((len(series.knots) - 1, 2), np.inf)
        domain = (float(knots[0]), float(knots[-1]))
        piece = Piece(series, domain, tuple(breaks), -free, free, pivot)
        s, t = piece.at(np.linspace(knots[0], knots[-1], 257)[1:-1], 1)
        if (np.stack([s[1], t[1]], axis=-1) * self.scale).min() < -1e-6:
            raise Unresolved(self.places[len(self.places) // 2])
        middle = piece.at(0.5 * (series.knots[1:] + series.knots[:-1]), 0)
        both = zip((self.pairs.first, self.pairs.second), middle, strict=True)
        bounds = [_bounds(rail, x[0]) for rail, x in both]
        low, high = (np.column_stack([bounds[0][k], bounds[1][k]]) for k in (0, 1))
        return replace(piece, low=low, high=high)

    def _resolved(self, function: Function, knots: Array, size: Array) -> Piecewise:
        """A function to rounding of its size, of degrees that leave its derivatives most of it."""
        while True:
            series = _chopped(chebyshev.resolve(function, knots, scale=size))
            step = np.diff(series.knots)[:, None]
            between = (series.knots[:-1, None] + step * BETWEEN).ravel()
            missed = np.abs(series(between) - function(between)).max(axis=0) / size
            steep = series.coefficients.shape[1] > STEEP
            if not (steep or missed.max() > MISSED) or len(knots) > MANY:
                return series
            knots = np.sort(np.concatenate([knots, 0.5 * (knots[1:] + knots[:-1])]))

    def _breaks(self) -> list[float]:
        """Where s or t passes a break of its curve, increasing."""
        out = []
        for axis, rail in enumerate((self.pairs.first, self.pairs.second)):
            values = self.places[:, axis]
            margin = 1e-9 * spans(self.pairs)[axis]
            for cut in rail.cuts(float(values.min()), float(values.max())):
                if self.pivot is not None and abs(cut - values[self.pivot]) <= margin:
                    continue
                k = int(np.flatnonzero((values[:-1] - cut) * (values[1:] - cut) <= 0.0)[0])
                run = values[k + 1] - values[k]
                share = (cut - values[k]) / run if run else 0.5
                guess = (1.0 - share) * self.places[k] + share * self.places[k + 1]
                row = (1.0, 0.0) if axis == 0 else (0.0, 1.0)
                place = meet(self.pairs, guess, linear(row, float(cut)))
                u, v = (place - self.places[0]) * self.scale
                out.append(self.start + float(u + v))
        length = self.sigma[-1] - self.sigma[0]
        inside = [x for x in sorted(out) if 1e-9 * length < x - self.sigma[0] < (1 - 1e-9) * length]
        return [x for k, x in enumerate(inside) if not k or x - inside[k - 1] > 1e-9 * length]


def _bounds(rail: Rail, values: Array) -> tuple[Array, Array]:
    """The smooth run of a rail around each parameter (n,): from its start to just below its end."""
    low, high = rail.curve.domain
    margin = high - low
    cuts = rail.cuts(float(values.min()) - margin, float(values.max()) + margin)
    if rail.period:
        cuts = np.concatenate([[-np.inf], cuts, [np.inf]])
    else:
        cuts = np.concatenate([[low], cuts, [high]])
    k = np.clip(np.searchsorted(cuts, values, side="right") - 1, 0, len(cuts) - 2)
    ends = cuts[k + 1]
    last = k == len(cuts) - 2
    return cuts[k], np.where(last, ends, np.nextafter(ends, -np.inf))


def _chopped(series: Piecewise) -> Piecewise:
    """The series without the last coefficients that are rounding: they spoil derivatives."""
    table = series.coefficients.copy()
    size = np.abs(table).max(axis=1, keepdims=True)
    loud = np.abs(table) > NOISE * np.maximum(size, 1e-300)
    last = table.shape[1] - np.argmax(loud[:, ::-1], axis=1)  # (panels, 2)
    keep = np.arange(table.shape[1])[None, :, None] < last[:, None, :]
    table = np.where(keep, table, 0.0)
    return replace(series, coefficients=table[:, : max(int(last.max()), 2)])
