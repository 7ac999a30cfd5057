"""Splines as piecewise polynomials with every derivative exact: interpolation and B-splines.

Each span keeps the Taylor coefficients about its middle, so that a point is reached from half
a span away and derivatives of any order (0 above the degree) are sums, not differences.

Source: de Boor, A Practical Guide to Splines, chapters IX and XIII (not-a-knot, periodic).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb, factorial

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.curve import SAME_DIRECTION, Curve, CurveJet, ends_meet, turns
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Spans:
    """A piecewise polynomial: ``knots`` (m + 1,) distinct, ``coefficients`` (degree + 1, m, d).

    On span i the value is the sum of coefficients[k, i] (t - middle_i) ** k; at a knot the span
    on its right answers.
    """

    knots: Array
    coefficients: Array

    def jet(self, t: Array, order: int) -> Array:
        """The Taylor coefficients (order + 1, n, d) at t (n,)."""
        last = len(self.knots) - 2
        span = np.clip(np.searchsorted(self.knots, t, side="right") - 1, 0, last)
        step = (t - 0.5 * (self.knots[span] + self.knots[span + 1]))[:, None]
        local = self.coefficients[:, span]  # (degree + 1, n, d)
        degree = len(local) - 1
        out = np.zeros((order + 1, *local.shape[1:]))
        for k in range(min(order, degree) + 1):
            for j in range(degree, k - 1, -1):  # Horner
                out[k] = out[k] * step + comb(j, k) * local[j]
        return out


def interpolating(points: Array, degree: int) -> Curve:
    """The spline of ``degree`` through the points (n, 3), n >= 2, not-a-knot at both ends.

    The parameter is the cumulative chord length over its total, [0, 1]. Fewer than degree + 1
    points lower the degree to n - 1. Neighbouring points must differ; that is not checked.
    """
    from scipy.interpolate import make_interp_spline

    u = _chord_fractions(points)
    k = min(degree, len(points) - 1)
    skip = (k + 1) // 2  # the ends of a spline of odd degree: this many points carry no knot
    inner = u[skip:-skip] if len(u) > k + 1 else u[:0]
    knots = np.concatenate([np.zeros(k + 1), inner, np.ones(k + 1)])
    return _smooth(piecewise(knots, np.asarray(make_interp_spline(u, points, k, t=knots).c), k))


def interpolating_closed(points: Array, degree: int) -> Curve:
    """The periodic spline of ``degree`` through the points (n, 3), n >= 3, the first not repeated.

    The parameter is the cumulative chord length over its total, [0, 1]; all degree - 1 derivatives
    agree across the seam. Fewer than degree + 1 points lower the degree to n - 1.
    """
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import splu

    n = len(points)
    k = min(degree, n - 1)
    u = _chord_fractions(np.concatenate([points, points[:1]]))
    knots = np.concatenate([u[n - k : n] - 1.0, u, u[1 : k + 1] + 1.0])
    full = BSpline.design_matrix(u[:-1], knots, k).tocoo()
    system = csr_array((full.data, (full.row, full.col % n)), shape=(n, n))
    control = splu(system.tocsc()).solve(points)
    return _smooth(piecewise(knots, control[np.arange(n + k) % n], k))


def bspline(degree: int, knots: Array, control: Array, weights: Array | None) -> Curve:
    """The B-spline with the full knot vector (n + degree + 1,) and control points (n, 3).

    With weights (n,) it is rational. The parameter is the knot parameter, from knots[degree] to
    knots[n]. A knot of multiplicity >= degree is a corner if the tangent direction jumps there,
    a break otherwise.
    """
    if weights is None:
        return _with_corners(piecewise(knots, control, degree).jet, degree, knots)
    weighted = np.concatenate([control * weights[:, None], weights[:, None]], axis=1)
    spans = piecewise(knots, weighted, degree)

    def jet(t: Array, order: int) -> Array:
        homogeneous = spans.jet(t, order)
        return taylor.div(homogeneous[..., :3], homogeneous[..., 3])

    return _with_corners(jet, degree, knots)


def _chord_fractions(points: Array) -> Array:
    """The cumulative chord length over its total, (n,), exactly 0 and 1 at the ends."""
    u = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.asarray(u / u[-1])


def piecewise(knots: Array, control: Array, degree: int) -> Spans:
    """The B-spline with control points (n, d) as a piecewise polynomial over its domain."""
    from scipy.interpolate import BSpline

    spline = BSpline(knots, control, degree)
    distinct = np.unique(knots[degree : len(control) + 1])
    middle = 0.5 * (distinct[:-1] + distinct[1:])
    coefficients = [spline(middle, nu=k) / factorial(k) for k in range(degree + 1)]
    return Spans(distinct, np.stack(coefficients))


def _smooth(spans: Spans) -> Curve:
    """The curve of a spline without corners."""
    curve = Curve(spans.jet, (0.0, 1.0), tuple(spans.knots[1:-1].tolist()))
    return replace(curve, closed=ends_meet(curve))


def _with_corners(jet: CurveJet, degree: int, knots: Array) -> Curve:
    """The curve of a B-spline; knots of multiplicity >= degree may be corners."""
    domain = (float(knots[degree]), float(knots[-degree - 1]))
    distinct, multiplicity = np.unique(knots, return_counts=True)
    inside = (distinct > domain[0]) & (distinct < domain[1])
    distinct, multiplicity = distinct[inside], multiplicity[inside]
    curve = Curve(jet, domain)
    corner = (multiplicity >= degree) & (turns(curve, distinct) > SAME_DIRECTION)
    return replace(
        curve,
        breaks=tuple(distinct[~corner].tolist()),
        corners=tuple(distinct[corner].tolist()),
        closed=ends_meet(curve),
    )
