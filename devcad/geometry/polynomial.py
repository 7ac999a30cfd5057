"""Polynomial: curves that are polynomials between their breaks, as the B-splines that they are.

What is a polynomial already needs no fit: its B-spline of the lowest degree, with as few knots as
its smoothness allows, is the curve itself. Nothing is known of the curves but their values.

Source: Trefethen, Approximation Theory and Approximation Practice, chapter 3 (the series through
Chebyshev points); The NURBS Book, 2.2 (multiplicity p - k where the curve is C^k).
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.polynomial import chebyshev

from devcad.geometry.fit import Course, Curves, Indices, Spline
from devcad.geometry.taylor import Array

MAX_DEGREE = 9  # where the narrowest of the CAD systems stop
ROUNDING = 1e-13  # of the largest coordinate: what two ways to the same point may differ by
NOISE = 3e-15  # of the largest coordinate: ten times what the coefficients' rounding usually is
DISTINCT = 1e-12  # of the largest coordinate: a smaller leading coefficient only fades out
MOST_SPANS = 1000  # beyond it a fit is a better file: a reader's time grows with the poles

_COUNT = MAX_DEGREE + 5  # samples a span: the four highest coefficients must vanish
_NODES: Array = np.cos(np.pi * (np.arange(_COUNT) + 0.5) / _COUNT)
_SERIES = np.linalg.inv(chebyshev.chebvander(_NODES, _COUNT - 1))
_PROBES: Array = np.linspace(0.0, 1.0, 12)  # places in a span where the spline is compared
_AT_END: Array = np.array(  # [j, n]: the j-th derivative of T_n at 1, divided by j!
    [
        [
            chebyshev.chebval(1.0, chebyshev.chebder(np.eye(MAX_DEGREE + 1)[n], j)) / factorial(j)
            for n in range(MAX_DEGREE + 1)
        ]
        for j in range(MAX_DEGREE + 1)
    ]
)


def polynomial(curves: Curves, course: Course, ends: tuple[Array, Array]) -> Spline | None:
    """The curves as B-splines of the lowest common degree that are equal to them, or None.

    Equal means within 1e-13 of the largest coordinate; up to degree 9 and 1000 spans. A break
    becomes a knot of the lowest multiplicity that the curves' smoothness allows, none where they
    are one polynomial across it; curves that are not C1 in s are left to a fit.

    Args:
        curves: points (n, k) at t (n,), k columns of one unit.
        course: t against s, with the breaks; the spline's parameter is s.
        ends: the points (k,) at both ends as the spline shall have them.
    """
    spans = np.diff(course.s)
    if len(spans) > MOST_SPANS:
        return None
    longest = int(np.argmax(spans))  # any curve is a polynomial on a span that is short enough
    if _degree(_series(curves, course, np.array([longest]))) is None:
        return None
    series = _series(curves, course, np.arange(len(spans)))
    degree = _degree(series)
    if degree is None:
        return None
    fewest = degree - _smoothness(series[:, : degree + 1], spans)
    for more in range(degree):  # beside a long span a short one hides a jump
        times = np.minimum(fewest + more, degree - 1)
        spline = _through(curves, course, degree, times, ends)
        if spline is not None or (times == degree - 1).all():
            return spline
    return None


def _series(curves: Curves, course: Course, which: Indices) -> Array:
    """The Chebyshev coefficients of the curves on the spans ``which``, (spans, 14, k)."""
    low, high = course.s[which], course.s[which + 1]
    s = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * _NODES
    points = curves(course(s.ravel())).reshape(len(which), _COUNT, -1)
    with np.errstate(invalid="ignore"):  # numbers that are none are for the fit to refuse
        return np.asarray(_SERIES @ points)


def _degree(series: Array) -> int | None:
    """The highest degree that any of the curves has, None above 9 or where they are no numbers.

    The coefficients of other curves fade out: no polynomial, even where the rest is rounding.
    """
    there = np.abs(series).max(axis=(0, 2))
    if not np.isfinite(there).all():
        return None
    there /= _reach(series) or 1.0
    degree = int(np.flatnonzero(there > NOISE).max(initial=1))
    return degree if degree <= MAX_DEGREE and (degree == 1 or there[degree] > DISTINCT) else None


def _reach(series: Array) -> float:
    """The largest coordinate, to a factor of two."""
    return float(np.abs(series).sum(axis=1).max())


def _smoothness(series: Array, spans: Array) -> Indices:
    """How many derivatives, the value not counted, agree at each break, up to the degree, (m,).

    The j-th counts by what its jump does to the points of the shorter neighbour; what the
    coefficients' rounding may make of it is allowed for.
    """
    number = series.shape[1]
    at_end = _AT_END[:number, :number]
    signs = (-1.0) ** (np.arange(number)[:, None] + np.arange(number))  # T_n is odd or even
    before = np.einsum("jn,snk->sjk", at_end, series[:-1])
    after = np.einsum("jn,snk->sjk", at_end * signs, series[1:])
    short = np.minimum(spans[:-1], spans[1:])[:, None]
    powers = np.arange(number)
    left, right = (short / spans[:-1, None]) ** powers, (short / spans[1:, None]) ** powers
    jump = np.abs(left[..., None] * before - right[..., None] * after).max(axis=2)
    allowed = NOISE * _reach(series) * np.abs(at_end).sum(axis=1)
    agree = np.cumprod(jump <= allowed, axis=1)
    return np.asarray(np.maximum(agree.sum(axis=1) - 1, 0))


def _through(
    curves: Curves, course: Course, degree: int, times: Indices, ends: tuple[Array, Array]
) -> Spline | None:
    """The spline with the breaks ``times`` (m,) as knots, if it is equal to the curves."""
    from scipy.interpolate import make_interp_spline  # type: ignore[import-untyped,unused-ignore]

    first, last = course.s[[0, -1]]
    inner = np.repeat(course.s[1:-1], times)
    knots = np.concatenate([[first] * (degree + 1), inner, [last] * (degree + 1)])
    count = len(knots) - degree - 1
    places = np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree)[:count].mean(axis=1)
    places[[0, -1]] = first, last
    points = curves(course(places))
    centre = points[0].copy()  # so that a distant origin costs the poles no digits
    poles = np.asarray(make_interp_spline(places, points - centre, degree, t=knots).c) + centre
    poles = settled(poles, float(np.abs(points).max()))
    poles[[0, -1]] = ends
    spline = Spline(degree, knots, poles, exact=True)
    s = np.unique(course.s[:-1, None] + np.diff(course.s)[:, None] * _PROBES)
    true = curves(course(s))
    off = float(np.abs(spline(s) - true).max())
    return spline if off <= 4.0 * ROUNDING * float(np.abs(true).max()) else None


def settled(numbers: Array, size: float, noise: float = NOISE) -> Array:
    """The numbers, those that are short decimals but for ``noise`` as these: 300 stays 300."""
    if not size > 0.0:
        return numbers
    short = np.round(numbers, 11 - int(np.ceil(np.log10(size)))) + 0.0  # no negative zero
    return np.where(np.abs(numbers - short) <= noise * size, short, numbers)
