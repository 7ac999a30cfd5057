"""Rulings between two curves at paired parameters, as a patch.

A strip's pairs solve F = det(a', b', b - a) = 0. With the lengths along both curves added up as
the parameter (both grow, so it does), the pairs are a smooth function of it, known to rounding:
a root by Newton's rule, its derivatives by the implicit function's series.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.curve import Curve
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array, rows_cross, rows_dot

Pairs = Callable[[Array, int], tuple[Array, Array]]
"""x (n,) and an order K to the series (K + 1, n) of both curves' parameters."""

NEWTON = 20


def between(
    a: Curve, b: Curve, pairs: Pairs, domain: tuple[float, float], breaks: tuple[float, ...] = ()
) -> Patch:
    """The patch of the rulings from a to b at the pairs: c0 on a, v from 0 to the distance."""

    def field(x: Array, order: int) -> RulingJet:
        s, t = pairs(x, order)
        c0 = taylor.compose(a.jet(s[0], order), s)
        ray = taylor.compose(b.jet(t[0], order), t) - c0
        return RulingJet(c0, taylor.unit(ray), np.zeros((order + 1, len(x))), taylor.norm(ray))

    return Patch(field, domain, breaks)


@dataclass(frozen=True, slots=True)
class Strip:
    """The pairs from (s0, t0) to (s1, t1) on F = 0, seeded by ``x`` and ``d`` (k,).

    x = rates[0] (s - s0) + rates[1] (t - t0) is the parameter, d the difference of the two.
    """

    a: Curve
    b: Curve
    starts: tuple[float, float]
    ends: tuple[float, float]
    rates: tuple[float, float]
    x: Array
    d: Array

    @property
    def length(self) -> float:
        """The parameter's end."""
        return float(self.x[-1])

    def __call__(self, x: Array, order: int) -> tuple[Array, Array]:
        """The series of both parameters at x (n,)."""
        d = np.zeros((order + 1, len(x)))
        d[0] = self._root(x, np.interp(x, self.x, self.d))
        s, t = self.parameters(x, d)
        if order == 0:
            return s, t
        jet_a, jet_b = self.a.jet(s[0], order + 1), self.b.jet(t[0], order + 1)
        slope = self._slope(jet_a, jet_b)
        da, db = taylor.derivative(jet_a), taylor.derivative(jet_b)
        for k in range(1, order + 1):  # the k-th coefficient enters the k-th of F linearly
            s, t = self.parameters(x, d[: k + 1])
            way = taylor.compose(jet_b[: k + 1], t) - taylor.compose(jet_a[: k + 1], s)
            turned = taylor.cross(taylor.compose(db[: k + 1], t), way)
            d[k] -= taylor.dot(taylor.compose(da[: k + 1], s), turned)[k] / slope
        return self.parameters(x, d)

    def parameters(self, x: Array, d: Array) -> tuple[Array, Array]:
        """The series of both parameters from those of x and d, kept inside the strip."""
        both = np.zeros_like(d), np.zeros_like(d)
        for out, sign, start, end, rate in zip(
            both, (1.0, -1.0), self.starts, self.ends, self.rates, strict=True
        ):
            out += sign * 0.5 * d / rate
            out[0] += start + 0.5 * x / rate
            if len(d) > 1:
                out[1] += 0.5 / rate
            out[0] = np.clip(out[0], min(start, end), max(start, end))
        return both

    def _slope(self, jet_a: Array, jet_b: Array) -> Array:
        """dF/dd (n,)."""
        way = jet_b[0] - jet_a[0]
        first = rows_dot(2.0 * jet_a[2], rows_cross(jet_b[1], way)) / self.rates[0]
        second = rows_dot(jet_a[1], rows_cross(2.0 * jet_b[2], way)) / self.rates[1]
        return np.asarray(0.5 * (first - second))

    def _root(self, x: Array, d: Array) -> Array:
        """The difference d at x, by Newton's rule from the seeds."""
        for _ in range(NEWTON):
            s, t = self.parameters(x, d[None])
            jet_a, jet_b = self.a.jet(s[0], 2), self.b.jet(t[0], 2)
            value = rows_dot(jet_a[1], rows_cross(jet_b[1], jet_b[0] - jet_a[0]))
            slope = self._slope(jet_a, jet_b)
            step = np.divide(value, slope, out=np.zeros_like(value), where=slope != 0.0)
            d = d - np.clip(step, -0.02 * self.length, 0.02 * self.length)
            if np.abs(step).max(initial=0.0) <= 1e-15 * self.length:
                break
        return d


def strip(
    a: Curve, b: Curve, starts: tuple[float, float], ends: tuple[float, float], seeds: Array
) -> Strip:
    """The strip between two pairs through seeds (2, k) of increasing pairs."""
    s = np.concatenate([[starts[0]], seeds[0], [ends[0]]])
    t = np.concatenate([[starts[1]], seeds[1], [ends[1]]])
    rates = tuple(
        float(np.linalg.norm(np.diff(curve.point(at), axis=0), axis=1).sum()) / abs(at[-1] - at[0])
        if at[-1] != at[0]
        else 1.0
        for curve, at in ((a, s), (b, t))
    )
    first, second = rates[0] * (s - s[0]), rates[1] * (t - t[0])
    return Strip(a, b, starts, ends, (rates[0], rates[1]), first + second, first - second)
