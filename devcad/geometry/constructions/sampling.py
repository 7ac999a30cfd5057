"""Where something comes closest to nothing along a curve: dense samples, refined by the slope."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from devcad.errors import JobError
from devcad.geometry.curve import Curve
from devcad.geometry.taylor import Array

SAMPLES = 1025
"""Parameters looked at on a whole curve; at least 17 between two breaks."""

VANISHES = 1e-9
"""A length, relative to its largest value along the curve, that counts as zero."""

BISECTIONS = 60
"""Halvings of a bracket: more than the 53 bits of its ends."""

INFINITE = 1e100
"""A number from here on counts as infinite: its square must not overflow."""

Scalar = Callable[[Array, int], Array]
"""Parameters t (n,) and an order K to the series (K + 1, n) of a number."""


def grid(curve: Curve) -> Array:
    """Increasing parameters over the domain, its ends included, both sides of every break."""
    knots = [curve.domain[0], *curve.breaks, curve.domain[1]]
    each = max(17, SAMPLES // (len(knots) - 1))
    runs = [np.linspace(a, b, each) for a, b in pairwise(knots)]
    for run in runs[:-1]:
        run[-1] = np.nextafter(run[-1], run[0])  # the series left of the break
    return np.concatenate(runs)


def dips(value: Scalar, curve: Curve) -> Array:
    """The parameters inside the curve at which a smooth scalar has a minimum, increasing.

    Each is found where the slope changes sign, so that an isolated zero of a square is met to
    rounding and not only to the square root of it.
    """
    return _bottoms(value, grid(curve))[0]


def lowest(value: Scalar, curve: Curve) -> tuple[float, float]:
    """The parameter at which a smooth scalar is smallest along the curve, and its value: one of
    its ``dips``, an end or a break."""
    t = grid(curve)
    inside, series = _bottoms(value, t)
    at = np.concatenate([t, inside])
    values = np.concatenate([series[0], value(inside, 0)[0]])
    best = int(np.argmin(values))
    return float(at[best]), float(values[best])


def _bottoms(value: Scalar, t: Array) -> tuple[Array, Array]:
    """The minima between the parameters t (n,), and the scalar's series (2, n) at these."""
    series = value(t, 1)
    sloping = np.flatnonzero(series[1])  # a sample may be the minimum itself
    slopes = series[1, sloping]
    falling = np.flatnonzero((slopes[:-1] < 0.0) & (slopes[1:] > 0.0))
    low, high = t[sloping[falling]], t[sloping[falling + 1]]
    if falling.size:
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            falls = value(middle, 1)[1] < 0.0
            low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    ends = np.stack([low, high])
    lower = np.argmin(value(ends.ravel(), 0)[0].reshape(ends.shape), axis=0)
    return np.asarray(np.take_along_axis(ends, lower[None], axis=0)[0]), series


def crossing(value: Scalar, curve: Curve) -> float:
    """The first parameter at which a scalar changes its sign; the curve's start if it does not."""
    t = grid(curve)
    positive = value(t, 0)[0] > 0.0
    changes = np.flatnonzero(positive[:-1] != positive[1:])
    if not changes.size:
        return float(t[0])
    low, high = t[changes[:1]], t[changes[:1] + 1]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        same = (value(middle, 0)[0] > 0.0) == positive[changes[0]]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return float(low[0])


def require_finite(series: Array, t: Array, name: str) -> None:
    """Raise a JobError naming the first t (n,) at which a series (K + 1, n[, 3]) is no number."""
    numbers = np.abs(series).reshape(len(series), len(t), -1).max(axis=2) < INFINITE
    if numbers.all():
        return
    first = int(np.argmin(numbers.all(axis=0)))
    what = "derivative" if numbers[0, first] else "value"
    raise JobError(
        f"{name} has no finite {what} at t = {t[first]:.6g}",
        value=float(t[first]),
        remedy="keep t inside the range where the expression is smooth",
    )
