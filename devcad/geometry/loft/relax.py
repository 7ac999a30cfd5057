"""Where no developable exists: one rail moved as little as possible so that one does.

The moved rail is the given one plus smooth displacements. Along the best matching the warp is
brought to nothing by Newton's rule, among all such displacements by the smallest; then the rails
are matched anew, until the loft between them is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import factorial

import numpy as np
from numpy.polynomial import chebyshev

from devcad.geometry.curve import Curve
from devcad.geometry.loft.matching import search, warp
from devcad.geometry.loft.rail import Rail, blown_up
from devcad.geometry.taylor import Array

MODES = (6, 10, 16)
"""Displacements tried: Chebyshev polynomials of an open rail, waves of a closed one."""
PLACES = 241
"""Rulings along the matching at which the warp is brought to nothing."""
ROUNDS = 30
STIFF = (1.0, 3.0, 10.0, 100.0, 1e3, 1e4)
"""What a radian of warp weighs against a displacement of the rail's size, one after the other."""

Modes = Callable[[Array, int], Array]
"""t (n,) and an order K to the series of every mode (K + 1, n, m)."""


def relaxed(still: Curve, moved: Curve, modes: int) -> tuple[Curve, float]:
    """The second curve moved towards a developable with the first, and its largest displacement.

    Levenberg's rule on the warp at the rulings of the matching, the weight of the warp raised
    step by step.
    """
    basis = _modes(moved, modes)
    a = blown_up(still)
    places = np.linspace(*moved.domain, 4 * PLACES)
    shapes = basis(places, 0)[0]
    gram = np.kron(shapes / (a.size * np.sqrt(len(places))), np.eye(3))
    gram = np.asarray(np.linalg.qr(gram, mode="r"))
    weights = np.zeros((shapes.shape[1], 3))
    for stiff in STIFF:
        pairs = _pairs(a, blown_up(_displaced(moved, basis, weights)))
        weights = _settled(still, moved, basis, weights, pairs, gram, stiff)
    away = np.linalg.norm(shapes @ weights, axis=1)
    return _displaced(moved, basis, weights), float(away.max())


def _settled(
    still: Curve,
    moved: Curve,
    basis: Modes,
    weights: Array,
    pairs: tuple[Array, Array],
    gram: Array,
    stiff: float,
) -> Array:
    """The weights that cost least for one matching: stiff^2 |warp|^2 / k + displacement^2."""
    rate = stiff / np.sqrt(len(pairs[0]))
    value, slope = _warped(still, moved, basis, weights, pairs)
    flat = weights.ravel()
    cost = float(np.sum((rate * value) ** 2) + np.sum((gram @ flat) ** 2))
    damping = 1.0
    for _ in range(ROUNDS):
        rows = np.vstack([rate * slope, gram, np.sqrt(damping) * gram])
        aim = np.concatenate([-rate * value, -gram @ flat, np.zeros(len(gram))])
        step = np.linalg.lstsq(rows, aim, rcond=None)[0]
        tried = (flat + step).reshape(weights.shape)
        new, new_slope = _warped(still, moved, basis, tried, pairs)
        paid = float(np.sum((rate * new) ** 2) + np.sum((gram @ tried.ravel()) ** 2))
        if paid < cost:
            small = cost - paid <= 1e-6 * cost
            weights, flat, value, slope, cost = tried, tried.ravel(), new, new_slope, paid
            damping *= 0.1
            if small:
                break
        else:
            damping *= 10.0
            if damping > 1e12:
                break
    return weights


def _modes(curve: Curve, count: int) -> Modes:
    """Smooth functions over the curve's domain, periodic on a closed one."""
    low, high = curve.domain
    width = high - low

    def waves(t: Array, order: int) -> Array:
        angle = 2.0 * np.pi * (t - low) / width
        out = np.zeros((order + 1, len(t), 2 * count + 1))
        out[0, :, 0] = 1.0
        for k in range(1, count + 1):
            rate = 2.0 * np.pi * k / width
            for j in range(order + 1):
                scale = rate**j / factorial(j)
                out[j, :, 2 * k - 1] = scale * np.cos(k * angle + 0.5 * np.pi * j)
                out[j, :, 2 * k] = scale * np.sin(k * angle + 0.5 * np.pi * j)
        return out

    def polynomials(t: Array, order: int) -> Array:
        x = 2.0 * (t - low) / width - 1.0
        out = np.zeros((order + 1, len(t), count))
        for k in range(count):
            series = np.eye(count)[k, : k + 1]
            for j in range(order + 1):
                out[j, :, k] = chebyshev.chebval(x, series)
                series = np.asarray(chebyshev.chebder(series) * (2.0 / width / (j + 1)))
        return out

    return waves if curve.closed else polynomials


def _displaced(curve: Curve, basis: Modes, weights: Array) -> Curve:
    """The curve plus the displacements."""

    def jet(t: Array, order: int) -> Array:
        return np.asarray(curve.jet(t, order) + basis(t, order) @ weights)

    return replace(curve, jet=jet)


def _pairs(a: Rail, b: Rail) -> tuple[Array, Array]:
    """The parameters of both rails at the rulings of the best matching."""
    rough = search(a, b, fans=False)
    sums = np.linspace(rough.u[0] + rough.v[0], rough.u[-1] + rough.v[-1], PLACES)
    x = np.interp(sums, rough.u + rough.v, rough.u - rough.v)
    return _parameters(a, 0.5 * (sums + x)), _parameters(b, 0.5 * (sums - x))


def _parameters(rail: Rail, x: Array) -> Array:
    """The curve's parameters at the coordinates x; a corner's at its point."""
    out = np.empty(len(x))
    for k, (number, place) in enumerate(zip(rail.index(x), x, strict=True)):
        span, turn = rail.span(int(number))
        while span.piece is None:
            number = number + 1
            span, turn = rail.span(int(number))
            place = span.x0 + turn
        out[k] = span.parameter(float(place) - turn)
    return out


def _warped(
    still: Curve, moved: Curve, basis: Modes, weights: Array, pairs: tuple[Array, Array]
) -> tuple[Array, Array]:
    """The warp (k,) at the pairs and its slopes by the weights (k, 3 m)."""
    s, t = pairs
    first = still.jet(s, 1)
    second = moved.jet(t, 1)
    modes = basis(t, 1)
    tangent = first[1] / np.linalg.norm(first[1], axis=1)[:, None]
    points, speeds = second[0] + modes[0] @ weights, second[1] + modes[1] @ weights

    def of(point: Array, speed: Array) -> Array:
        return warp(first[0], tangent, point, speed / np.linalg.norm(speed, axis=1)[:, None])

    value = of(points, speeds)
    slope = np.empty((len(t), modes.shape[2], 3))
    step = 1e-7 * float(np.linalg.norm(np.ptp(points, axis=0)))
    rate = 1e-7 * float(np.linalg.norm(speeds, axis=1).max())
    for axis in range(3):
        shift = np.eye(3)[axis]
        by_point = (of(points + step * shift, speeds) - of(points - step * shift, speeds)) / (
            2 * step
        )
        by_speed = (of(points, speeds + rate * shift) - of(points, speeds - rate * shift)) / (
            2 * rate
        )
        slope[:, :, axis] = by_point[:, None] * modes[0] + by_speed[:, None] * modes[1]
    return value, slope.reshape(len(t), -1)
