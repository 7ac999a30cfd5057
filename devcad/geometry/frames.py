"""Frames along a curve, Euclidean and Lorentzian: Frenet data and parallel normal fields.

A metric is its diagonal (3,): ``EUCLID`` or ``LORENTZ`` (z is time). The sign of a vector x is
that of <x, x>: +1 spacelike (always, when Euclidean), -1 timelike.

Source: geometry.md, sections 0 and 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.chebyshev import Piecewise, nodes, resolve
from devcad.geometry.curve import Curve
from devcad.geometry.taylor import Array

EUCLID: Array = np.array([1.0, 1.0, 1.0])
LORENTZ: Array = np.array([1.0, 1.0, -1.0])


def inner(x: Array, y: Array, metric: Array) -> Array:
    """The series of <x, y> of two vector series (K + 1, n, 3) in the metric."""
    return taylor.dot(metric * x, y)


def tangent(jet: Array, metric: Array) -> tuple[Array, Array]:
    """The unit tangent T = r'/|<r', r'>|^(1/2) (K, n, 3) of a curve's series (K + 1, n, 3), and
    its sign (n,). Where r' is lightlike T is not finite."""
    velocity = taylor.derivative(jet)
    square = inner(velocity, velocity, metric)
    sign = np.where(square[0] < 0.0, -1.0, 1.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return taylor.mul(taylor.power(sign * square, -0.5), velocity), sign


@dataclass(frozen=True, slots=True)
class Frenet:
    """Series of one order: speed, curvature, torsion (K + 1, n), T, N, B (K + 1, n, 3); and the
    signs of T, N, B (n,). What does not exist (k = 0, a lightlike T or T') is not finite."""

    speed: Array
    curvature: Array
    torsion: Array
    T: Array
    N: Array
    B: Array
    signs: tuple[Array, Array, Array]


def frenet(jet: Array, metric: Array = EUCLID) -> Frenet:
    """The Frenet data of a curve's series (K + 4, n, 3), to order K >= 0.

    k = |<w, w>|^(1/2)/v^3 and tau = det(r', r'', r''')/|<w, w>| with w = r' x r'', for any
    parameter; N = T'/|T'| and det(T, N, B) = +1. In the Lorentzian metric the Frenet equations
    carry the signs of T, N and B.

    Source: geometry.md (1.4).
    """
    order = len(jet) - 3
    first = taylor.derivative(jet)
    second = taylor.derivative(first)
    third = taylor.derivative(second)
    w = metric * taylor.cross(first[: order + 1], second)
    square = inner(w, w, metric)
    velocity = inner(first, first, metric)
    sign_t = np.where(velocity[0] < 0.0, -1.0, 1.0)
    area = np.where(square[0] < 0.0, -1.0, 1.0) * square  # |<w, w>|
    unit_tangent, _ = tangent(jet, metric)
    turning = taylor.derivative(unit_tangent)
    along = inner(turning, turning, metric)
    sign_n = np.where(along[0] < 0.0, -1.0, 1.0)
    product = metric.prod()
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speed = taylor.sqrt(sign_t * velocity)
        curvature = taylor.mul(taylor.sqrt(area), taylor.power(speed[: order + 1], -3.0))
        torsion = taylor.div(inner(w[:order], third, metric), area[:order])
        normal = taylor.mul(taylor.power(sign_n * along, -0.5), turning)
    sign_b = product * sign_t * sign_n
    binormal = sign_b[:, None] * metric * taylor.cross(unit_tangent[: order + 1], normal)
    return Frenet(
        speed[:order],
        curvature[:order],
        torsion[:order],
        unit_tangent[:order],
        normal[:order],
        binormal[:order],
        (sign_t, sign_n, sign_b),
    )


@dataclass(frozen=True, slots=True)
class ParallelNormal:
    """A parallel normal field b along a curve: <b, T> = 0, <b, b> constant, b' along T.

    b is held as coordinates on a smooth basis (P, Q) of the normal planes, P the projection of
    the fixed ``axis``: branch (cos phi, sin phi), or (cosh phi, sinh phi), or (sinh, cosh).
    """

    metric: Array
    axis: Array
    wave: str
    branch: float
    phase: Piecewise
    offset: float

    def series(self, t: Array, curve: Array) -> Array:
        """The series of b at t (n,), (K + 1, n, 3), from the curve's (K + 2, n, 3): its value by
        the phase, its derivatives by the recursion of equation (1.3)."""
        unit_tangent, sign = tangent(curve, self.metric)
        p, q = _normal_basis(unit_tangent[:1], sign, self.metric, self.axis)
        phi = self.offset + self.phase(t)[:, 0]
        x, y = _WAVES[self.wave](phi)
        start = self.branch * (x[:, None] * p[0] + y[:, None] * q[0])
        return _continued(start, unit_tangent, sign, self.metric)


def parallel_normal(curve: Curve, start: Array, metric: Array = EUCLID) -> ParallelNormal:
    """The normal field that is ``start`` (3,) at the curve's start and is carried along without
    turning: db/dt = -eps <b, dT/dt> T, eps the sign of T.

    Solved by one quadrature, to rounding: on the basis (P, Q) the field turns (or is boosted) by
    phi with phi' = -<P', Q>. Inflections and lightlike T' do not matter. Not checked: the curve
    is regular, T keeps its sign, ``start`` is orthogonal to T and of length one.

    Source: geometry.md (1.3).
    """
    knots = np.array([curve.domain[0], *curve.breaks, curve.domain[1]])
    at_start, sign = tangent(curve.jet(knots[:1], 2), metric)
    axis = _axis(curve, knots, metric, float(sign[0]))

    def rate(t: Array) -> Array:
        unit_tangent, signs = tangent(curve.jet(t, 2), metric)
        p, q = _normal_basis(unit_tangent, signs, metric, axis)
        return -np.asarray(inner(taylor.derivative(p), q[:1], metric)[0])[:, None]

    p, q = _normal_basis(at_start[:1], sign, metric, axis)
    wave, branch, offset = _phase_of(start, p[0, 0], q[0, 0], metric)
    # one radian over the whole curve is the size against which the rate's rounding counts
    phase = resolve(rate, knots, scale=max(1.0, _turning(curve, knots, metric)) / np.ptp(knots))
    return ParallelNormal(metric, axis, wave, branch, phase.antiderivative(), offset)


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the table of geometry.md section 1: b = along_n(th) N + along_b(th) B and
    b' = mu(th) k T, with dth/ds = -tau."""

    along_n: Callable[[Array], Array]
    along_b: Callable[[Array], Array]
    mu: Callable[[Array], Array]


ROWS: dict[str, Row] = {
    "E": Row(lambda th: -np.sin(th), np.cos, np.sin),
    "TL": Row(lambda th: -np.sin(th), np.cos, lambda th: -np.sin(th)),
    "SB": Row(np.cosh, np.sinh, lambda th: -np.cosh(th)),
    "SB'": Row(np.sinh, np.cosh, lambda th: -np.sinh(th)),
    "SN": Row(np.sinh, np.cosh, np.sinh),
    "SN'": Row(np.cosh, np.sinh, np.cosh),
}
"""E Euclidean; TL timelike curve; SB, SN spacelike curve whose B, N is timelike, on a spacelike
surface, primed on a timelike one."""


def line_of_curvature_type(curve: Curve, angle: float, row: str) -> str:
    """ "cylinder", "cone" or "tangent": what the developable through ``curve`` as a line of
    curvature is, from the curve's curvature and torsion alone.

    mu k vanishes identically on a cylinder and is constant on a cone (necessary and sufficient
    where k != 0); judged on a dense sample relative to k, to 1e-9.

    Args:
        angle: theta at the start, in radians, or a rapidity in rows SB, SB', SN, SN'.
        row: a key of ``ROWS``; not checked against the curve.
    Source: geometry.md, section 1.
    """
    metric = EUCLID if row == "E" else LORENTZ
    knots = np.array([curve.domain[0], *curve.breaks, curve.domain[1]])

    def turning(t: Array) -> Array:
        data = frenet(curve.jet(t, 3), metric)
        return np.asarray((data.torsion[0] * data.speed[0])[:, None])

    t = _inside(knots, 65)
    size = max(1.0, _turning(curve, knots, metric)) / np.ptp(knots)
    theta = angle - resolve(turning, knots, scale=size).antiderivative()(t)[:, 0]
    curvature = frenet(curve.jet(t, 3), metric).curvature[0]
    bending = ROWS[row].mu(theta) * curvature
    if np.abs(bending).max() <= SAME * curvature.max():
        return "cylinder"
    return "cone" if np.ptp(bending) <= SAME * np.abs(bending).max() else "tangent"


SAME = 1e-9
"""Relative difference below which two curvatures along a curve count as one."""


def _circular(phi: Array) -> tuple[Array, Array]:
    return np.cos(phi), np.sin(phi)


def _timelike(phi: Array) -> tuple[Array, Array]:
    return np.cosh(phi), np.sinh(phi)


def _spacelike(phi: Array) -> tuple[Array, Array]:
    return np.sinh(phi), np.cosh(phi)


_WAVES = {"circular": _circular, "timelike": _timelike, "spacelike": _spacelike}


def _phase_of(start: Array, p: Array, q: Array, metric: Array) -> tuple[str, float, float]:
    """The wave, the branch and the phase of a unit vector on the basis p, q (3,)."""
    sign_p, sign_q = (math.copysign(1.0, v @ (metric * v)) for v in (p, q))
    x, y = sign_p * float(start @ (metric * p)), sign_q * float(start @ (metric * q))
    if sign_p == sign_q:
        return "circular", 1.0, math.atan2(y, x)
    if start @ (metric * start) < 0.0:
        branch = math.copysign(1.0, x)
        return "timelike", branch, math.asinh(branch * y)
    branch = math.copysign(1.0, y)
    return "spacelike", branch, math.asinh(branch * x)


def _normal_basis(
    unit_tangent: Array, sign: Array, metric: Array, axis: Array
) -> tuple[Array, Array]:
    """Series of an orthonormal basis of the normal planes: the axis projected, and its
    complement. Lorentzian: timelike axis for spacelike T, so that P is always timelike."""
    order, count = len(unit_tangent) - 1, unit_tangent.shape[1]
    fixed = taylor.constant_vector(axis, order, count)
    along = sign * inner(fixed, unit_tangent, metric)
    across = fixed - taylor.mul(along, unit_tangent)
    square = inner(across, across, metric)
    p = taylor.mul(taylor.power(np.abs(square[0]) / square[0] * square, -0.5), across)
    return p, metric * taylor.cross(unit_tangent, p)


def _axis(curve: Curve, knots: Array, metric: Array, sign: float) -> Array:
    """The fixed direction whose projections make the basis.

    Lorentzian: time for a spacelike T (its projection is timelike, <P, P> = -1 - T3^2 before
    scaling), +x for a timelike one (1 + T1^2). Euclidean: of directions spread over the sphere
    the one that stays farthest from +-T.
    """
    if metric[2] < 0.0:
        return np.array([0.0, 0.0, 1.0] if sign > 0.0 else [1.0, 0.0, 0.0])
    t = _inside(knots, 34)
    unit_tangent, _ = tangent(curve.jet(t, 1), metric)
    k = np.arange(101) + 0.5
    height, turn = k / 101, k * (np.pi * (3.0 - np.sqrt(5.0)))  # Fibonacci half sphere
    ring = np.sqrt(1.0 - height**2)
    candidates = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    closest = np.abs(unit_tangent[0] @ candidates.T).max(axis=0)
    return np.asarray(candidates[int(np.argmin(closest))])


def _turning(curve: Curve, knots: Array, metric: Array) -> float:
    """The largest |dT/dt| (Euclidean length) seen, times the length of the domain."""
    t = _inside(knots, 34)
    unit_tangent, _ = tangent(curve.jet(t, 2), metric)
    return float(np.linalg.norm(unit_tangent[1], axis=1).max() * np.ptp(knots))


def _inside(knots: Array, each: int) -> Array:
    """Increasing parameters strictly between consecutive knots."""
    return np.concatenate([nodes(a, b, each) for a, b in pairwise(knots.tolist())])


def _continued(start: Array, unit_tangent: Array, sign: Array, metric: Array) -> Array:
    """The series of b from its values (n, 3): (k + 1) b_(k+1) = -eps [<b, T'> T]_k."""
    order = len(unit_tangent) - 1
    turning = metric * taylor.derivative(unit_tangent)
    b = np.zeros_like(unit_tangent)
    b[0] = start
    falls = np.zeros(unit_tangent.shape[:2])
    for k in range(order):
        falls[k] = np.einsum("jni,jni->n", b[: k + 1], turning[k::-1])
        slope = np.einsum("jn,jni->ni", falls[: k + 1], unit_tangent[k::-1])
        b[k + 1] = -sign[:, None] * slope / (k + 1)
    return b
