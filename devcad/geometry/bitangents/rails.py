"""Rails: curves without corners whose parameter may run on, and means of theirs over chords.

The means between s and t, with m = (s + t)/2, h = (t - s)/2, are

    E = 1/2 int a'(m + h x) dx,   F = 1/4 int a''(m + h x) dx,
    V = 1/8 int (1 - x^2) a'''(m + h x) dx      (x from -1 to 1; E, F, V -> a', a''/2, a'''/6)

looked up by quadrature where h is small, so that nothing cancels, and else from
E = D/(2h), F = D'/(4h), V = (S - D/h)/(4h^2), D = a(t) - a(s), D' and S likewise from a'.

Source: Peano's kernel of the trapezoidal rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry import chebyshev, taylor
from devcad.geometry.curve import Curve
from devcad.geometry.taylor import Array

NODES = 16
"""Gauss nodes of a quadrature between two points of one curve."""
NEAR = 0.6
"""Share of the curve's own scale below which two of its points count as near."""
TOUCHING = 1e-10
"""Two points nearer than this share of the domain have no break between them that matters."""
SMOOTHER = 1e-9
"""A jump of the first five derivatives below this share is none."""


@dataclass(frozen=True, slots=True)
class Rail:
    """A curve without corners whose parameter may run on beyond its period (0: it is open).

    ``breaks`` are those of the curve within one period, its seam among them if it is one.
    ``reach`` gives, at increasing ``places``, half the distance of parameters that count as near.
    """

    curve: Curve
    period: float
    breaks: tuple[float, ...]
    places: Array
    reach: Array

    def jet(self, x: Array, order: int) -> Array:
        """The Taylor coefficients at parameters (n,), beyond the ends of an open curve its last."""
        return self.curve.jet(self.inside(x), order)

    def inside(self, x: Array) -> Array:
        """Parameters (n,) brought into the curve's domain."""
        low, high = self.curve.domain
        x = low + np.mod(x - low, self.period) if self.period else x
        return np.clip(x, low, high)

    def along(self, x: Array, derivatives: int = 0) -> list[Array]:
        """The series of the curve and of its derivatives along x (K + 1, n), a series itself."""
        order = len(x) - 1
        jet = self.jet(x[0], order + derivatives)
        out = []
        for _ in range(derivatives + 1):
            out.append(taylor.compose(jet[: order + 1], x))
            jet = taylor.derivative(jet)
        return out

    def cuts(self, low: float, high: float) -> Array:
        """The breaks strictly between two parameters, whole periods included."""
        breaks = np.array(self.breaks)
        if self.period and len(breaks):
            first = np.floor((low - breaks.max()) / self.period)
            last = np.ceil((high - breaks.min()) / self.period)
            turns = self.period * np.arange(first, last + 1)
            breaks = np.sort((breaks + turns[:, None]).ravel())
        return breaks[(breaks > low) & (breaks < high)]

    def wrapped(self, s: Array, t: Array) -> Array:
        """t - s, brought between plus and minus half a period."""
        away = t - s
        period = self.period
        return away - period * np.round(away / period) if period else away

    def middle(self, s: Array, t: Array) -> tuple[Array, Array, Array]:
        """Where to look the reach up: halfway between s and t; and the table."""
        middle = self.inside(s + 0.5 * self.wrapped(s, t))
        return middle, self.places, self.reach

    def means(self, s: Array, t: Array, number: int) -> list[Array]:
        """The first of E, F, V along the series s <= t."""
        near = 0.5 * (t[0] - s[0]) < np.interp(*self.middle(s[0], t[0]))
        out = [np.empty((*s.shape, 3)) for _ in range(number)]
        for chosen, means in ((~near, self._far), (near, self._close)):
            if chosen.any():
                parts = means(s[:, chosen], t[:, chosen], number)
                for whole, part in zip(out, parts, strict=True):
                    whole[:, chosen] = part
        return out

    def chord(self, start: float, step: Array) -> tuple[Array, Array]:
        """The series of A = D / step and of (a' - A) / step at start + step, D = a - a(start), for
        a series ``step`` of either sign, zero too: -> a', a''/2."""
        low, high = np.zeros_like(step), np.zeros_like(step)
        ahead = step[0] >= 0.0
        low[:, ~ahead], high[:, ahead] = step[:, ~ahead], step[:, ahead]
        low[0] = self.inside(start + low[0])
        high[0] = low[0] + np.abs(step[0])
        mean, turn, excess = self.means(low, high, 3)
        return mean, turn + taylor.mul(0.5 * step, excess)

    def _far(self, s: Array, t: Array, number: int) -> list[Array]:
        """E, F, V from the end points."""
        half = 0.5 * (t - s)
        ends = [(x, y) for x, y in zip(self.along(s, 1), self.along(t, 1), strict=True)]
        way = ends[0][1] - ends[0][0]
        mean = taylor.div(0.5 * way, half)
        if number == 1:
            return [mean]
        turn = taylor.div(0.25 * (ends[1][1] - ends[1][0]), half)
        excess = ends[1][0] + ends[1][1] - 2.0 * mean
        return [mean, turn, taylor.div(0.25 * excess, taylor.mul(half, half))]

    def _close(self, s: Array, t: Array, number: int) -> list[Array]:
        """E, F, V by quadrature, each smooth piece of the curve between s and t for itself."""
        if not self.breaks:
            return self._quadrature(s, t, (), number)
        out = [np.zeros((*s.shape, 3)) for _ in range(number)]
        low, high = self.curve.domain
        cuts = self.cuts(low - (high - low), high + (high - low))
        spans = np.stack([np.searchsorted(cuts, s[0], "right"), np.searchsorted(cuts, t[0])])
        spans[:, t[0] - s[0] < TOUCHING * (high - low)] = 0
        for i, j in np.unique(spans, axis=1).T.tolist():
            members = (spans[0] == i) & (spans[1] == j)
            between = tuple(cuts[i:j].tolist())
            part = self._quadrature(s[:, members], t[:, members], between, number)
            for whole, some in zip(out, part, strict=True):
                whole[:, members] = some
        return out

    def _quadrature(self, s: Array, t: Array, cuts: tuple[float, ...], number: int) -> list[Array]:
        """E, F, V of pairs that have the same breaks between them."""
        x, weight = np.polynomial.legendre.leggauss(NODES)
        order, n = s.shape[0] - 1, s.shape[1]
        middle, half = 0.5 * (s + t), 0.5 * (t - s)
        ends = [s, *(taylor.constant(cut, order, n) for cut in cuts), t]
        out = [np.zeros((*s.shape, 3)) for _ in range(number)]
        for low, high in pairwise(ends):
            centre, reach = 0.5 * (low + high), 0.5 * (high - low)
            at = (centre[:, :, None] + reach[:, :, None] * x).reshape(order + 1, -1)
            parts = self.along(at, number)[1:]
            share, place = taylor.constant(1.0, order, n), taylor.constant(0.0, order, at.shape[1])
            place[0] = np.tile(x, n)
            if cuts:
                share = taylor.div(reach, half)
                away = at - np.repeat(middle, NODES, axis=1)
                place = taylor.div(away, np.repeat(half, NODES, axis=1))
            if number == 3:
                inside = -taylor.mul(place, place)
                inside[0] += 1.0
                parts[2] = taylor.mul(inside, parts[2])
            for whole, part, factor in zip(out, parts, (0.5, 0.25, 0.125), strict=False):
                summed = part.reshape(order + 1, n, NODES, 3) * (factor * weight)[:, None]
                whole += taylor.mul(share, summed.sum(axis=2))
        return out


def rail(curve: Curve) -> Rail:
    """The rail of a curve without corners; a closed one goes round if its tangent does."""
    low, high = curve.domain
    places = np.linspace(low, high, 257)
    breaks, period = curve.breaks, 0.0
    if curve.closed:
        jets = curve.jet(np.array([low, high]), 5)
        size = np.abs(jets).max(axis=(1, 2))
        jump = np.linalg.norm(jets[:, 0] - jets[:, 1], axis=1)
        tangents = jets[1] / np.linalg.norm(jets[1], axis=1)[:, None]
        if np.linalg.norm(tangents[0] - tangents[1]) <= SMOOTHER:
            period = high - low
            if (jump > SMOOTHER * size).any():
                breaks = (low, *breaks)
    return Rail(curve, period, breaks, places, _reach(curve, places))


def _reach(curve: Curve, places: Array) -> Array:
    """Half the distance within which a quadrature resolves the curve, at each place."""
    span = curve.domain[1] - curve.domain[0]
    sizes = np.linalg.norm(curve.jet(places, 8), axis=2)[1:]
    with np.errstate(divide="ignore"):
        scales = (sizes[0] / sizes[1:]) ** (1.0 / np.arange(1, 8))[:, None]
    scale = np.minimum(NEAR * scales.min(axis=0), 0.125 * span)
    # the curve may wind up nearby: nowhere more than what the neighbours allow
    step = places[1] - places[0]
    for _ in range(2):
        for k in range(1, len(scale)):
            scale[k] = min(scale[k], scale[k - 1] + step)
        scale = scale[::-1]
    return np.asarray(scale)


def complexity(one: Rail) -> int:
    """How many Chebyshev coefficients the tangent needs: how wavy the curve is."""
    knots = np.array([one.curve.domain[0], *one.curve.breaks, one.curve.domain[1]])
    size = float(np.abs(one.curve.jet(one.places, 1)[1]).max())
    tangent = chebyshev.resolve(lambda x: one.curve.jet(x, 1)[1], knots, scale=1e4 * size)
    table = tangent.coefficients
    return int((np.abs(table).max(axis=2) > 1e-4 * size).sum())
