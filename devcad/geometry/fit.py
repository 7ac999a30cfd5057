"""Fit: curves that run side by side, as B-splines on one shared knot vector.

A ruled face needs its two edges (a thick strip its four) as splines of one degree on one knot
vector; then the face between them is the spline of their poles. Knots are graded by the measured
error and by the twist of the face between the fitted edges, not of the true ones.

Source: Piegl and Tiller, The NURBS Book, A2.2, 3.3 and 9.4; algorithms.md, sections 1 and 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array, rows_dot

Curves = Callable[[Array], Array]
"""t (n,) -> points (n, k): several curves side by side, all columns in mm."""

Indices = NDArray[np.integer[Any]]

TWIST_LIMIT = np.radians(0.01)
INSIDE = 1e-3  # where an edge has no tangent plane, twist counts from this fraction inside
FLOOR = 1e-9  # no fit closer than this fraction of the size: rounding would be fitted
MAX_SPANS = 4000

_AIM = 0.9  # share of the tolerance that regrading aims at
_GRADING = 1.7  # largest ratio of neighbouring spans: beyond it the twist stalls
_ROUNDS = 40
_PROBES: Array = np.linspace(0.0, 1.0, 11)  # places in a span where the error is measured
_DENSE: Array = np.linspace(0.0, 1.0, 33)  # the same for the final certificate


@dataclass(frozen=True, slots=True)
class Spline:
    """A clamped B-spline: ``knots`` (n + degree + 1,), ``poles`` (n, k).

    ``exact`` says that it is the curve itself and no fit; ``weights`` (n, k), alike in the
    columns that are one point, make it rational.
    """

    degree: int
    knots: Array
    poles: Array
    exact: bool = False
    weights: Array | None = None

    def __call__(self, s: Array) -> Array:
        """The points at s (m,), shape (m, k)."""
        last = len(self.poles)
        span = np.searchsorted(self.knots[self.degree + 1 : last], s, side="right") + self.degree
        weights = _basis(self.knots, self.degree, span, s)
        picked = span[:, None] + np.arange(-self.degree, 1)
        if self.weights is None:
            return np.asarray(np.einsum("ma,mak->mk", weights, self.poles[picked]))
        shares = weights[:, :, None] * self.weights[picked]
        return np.asarray((shares * self.poles[picked]).sum(axis=1) / shares.sum(axis=1))

    def denominator(self, s: Array) -> Array:
        """The sum of the first curve's weighted basis functions at s (m,), 1 without weights."""
        if self.weights is None:
            return np.ones(len(s))
        return Spline(self.degree, self.knots, self.weights[:, :1])(s)[:, 0]

    @property
    def derivative(self) -> Spline:
        """The derivative of a spline without weights, one degree less."""
        p = self.degree
        width = self.knots[p + 1 : -1] - self.knots[1 : -p - 1]
        poles = p * np.diff(self.poles, axis=0) / width[:, None]
        return Spline(p - 1, self.knots[1:-1], poles, self.exact)

    def part(self, columns: slice) -> Spline:
        """Some of the curves alone, on the same knots."""
        weights = None if self.weights is None else self.weights[:, columns]
        return Spline(self.degree, self.knots, self.poles[:, columns], self.exact, weights)


@dataclass(frozen=True, slots=True)
class Course:
    """The spline's parameter s against the patch's t: straight pieces between breaks.

    ``t`` and ``s`` (k + 1,) are the breaks in both. The slopes differ from piece to piece so
    that a curve whose speed jumps at a break is smooth in s.
    """

    t: Array
    s: Array

    def __call__(self, s: Array) -> Array:
        """t at s."""
        return np.asarray(np.interp(s, self.s, self.t))


@dataclass(frozen=True, slots=True)
class Fit:
    """The spline, its course, and what was measured between the samples that made it.

    ``error`` is the largest distance in mm at equal parameter, ``twist`` the largest turn in
    radians of the tangent plane along a ruling.
    """

    spline: Spline
    course: Course
    error: float
    twist: float


@dataclass(frozen=True, slots=True)
class Demand:
    """What a fit must reach: ``tolerance`` in mm for each of ``blocks`` (columns that are one
    point), ``twist`` in radians for each of ``faces`` (pairs of blocks with rulings between), and
    ``gap_tolerance`` for the step between each of ``gaps`` (pairs of blocks across a thickness).
    """

    degree: int
    tolerance: float
    blocks: tuple[slice, ...]
    faces: tuple[tuple[slice, slice], ...] = ()
    gaps: tuple[tuple[slice, slice], ...] = ()
    gap_tolerance: float = np.inf
    twist: float = TWIST_LIMIT


@dataclass(frozen=True, slots=True)
class Ends:
    """Points (k,) at both ends, met exactly, and slopes d/ds (k,) there, met too if given."""

    points: tuple[Array, Array]
    slopes: tuple[Array, Array] | None = None


def fit(
    curves: Curves, course: Course, ends: Ends, demand: Demand, start: Array | None = None
) -> Fit:
    """Splines within the demanded tolerance and twist on as few spans as grading finds.

    Least squares on Chebyshev points per span, ends met exactly; spans are regraded all together
    until every one holds, and once or twice more to spare some. Breaks become knots of
    multiplicity degree - 1.

    Args:
        curves: points (n, k) at t (n,), k columns in mm.
        course: t against s, with the breaks.
        start: distinct knots that are taken as they are if they reach the demand.
    Returns:
        the fit with its error and twist, measured at 33 places per span.
    Raises:
        GeometryError: not reached with 4000 spans, or the curves are not numbers.
    """
    if start is not None:
        spline = least_squares(curves, course, start, ends, demand.degree)
        if (given := _certified(spline, curves, course, start, demand)) is not None:
            return given
    first = max(4 // (len(course.s) - 1), 1) + 1
    knots = np.unique(np.concatenate([np.linspace(a, b, first) for a, b in pairwise(course.s)]))
    best: Fit | None = None
    tries = 0
    worst = np.inf
    for _ in range(_ROUNDS):
        spline = least_squares(curves, course, knots, ends, demand.degree)
        error, twist = _measure(spline, curves, course, knots, demand, _PROBES)
        worst = float(max(error.max() / demand.tolerance, twist.max() / demand.twist))
        if worst <= 1.0:
            tries += 1
            done = _certified(spline, curves, course, knots, demand)
            if done is not None and (best is None or len(spline.poles) < len(best.spline.poles)):
                best = done
        size = _wanted_sizes(knots, error / demand.tolerance, twist / demand.twist, demand.degree)
        if worst > 1.0:  # errors spread to neighbours: without a push the rounds may swing
            size *= min(1.0, float(np.sum(np.diff(knots) / size)) / len(knots))
        finer = _regraded(knots, course.s, size)
        if best is None and len(finer) < 1.05 * len(knots):
            finer = _regraded(knots, course.s, 0.85 * size)  # many waves: grading alone stalls
        if best is not None and (tries >= 3 or len(finer) >= len(_distinct(best.spline.knots))):
            return best
        if len(finer) > MAX_SPANS:
            break
        knots = finer
    if best is not None:
        return best
    raise GeometryError(
        f"no spline of {MAX_SPANS} spans reaches {demand.tolerance:.3g} mm and 0.01 deg of twist;"
        f" {len(knots) - 1} spans exceed it {worst:.3g} times",
        value=worst,
        limit=1.0,
        remedy="raise step.tolerance, or keep the extent away from the regression curve",
    )


def ruled_twist(start: Array, slope: Array, end: Array, end_slope: Array) -> Array:
    """The turn of the tangent plane along each ruling from ``start`` to ``end``, radians, (n,).

    All arguments are (n, 3). 180 degrees: the regression curve lies between. Where an end has no
    tangent plane it counts from 1e-3 of the ruling inside; where neither has, or the ruling has
    no length, the turn is 0. Source: algorithms.md, section 1.
    """
    ruling = end - start
    length = np.linalg.norm(ruling, axis=1)
    real = length > FLOOR * max(float(length.max(initial=0.0)), np.finfo(float).tiny)
    d = ruling / np.where(real, length, 1.0)[:, None]
    p = slope - rows_dot(slope, d)[:, None] * d
    q = end_slope - rows_dot(end_slope, d)[:, None] * d
    size_p, size_q = np.linalg.norm(p, axis=1), np.linalg.norm(q, axis=1)
    inner_p = np.where((size_p < INSIDE * size_q)[:, None], p + INSIDE * (q - p), p)
    inner_q = np.where((size_q < INSIDE * size_p)[:, None], q + INSIDE * (p - q), q)
    real &= np.maximum(size_p, size_q) > FLOOR * float(np.maximum(size_p, size_q).max(initial=0.0))
    turn = np.arctan2(rows_dot(d, np.cross(inner_p, inner_q)), rows_dot(inner_p, inner_q))
    return np.where(real, np.abs(turn), 0.0)


def _certified(
    spline: Spline, curves: Curves, course: Course, knots: Array, demand: Demand
) -> Fit | None:
    """The fit with its densely measured figures, or None where they exceed the demand."""
    error, twist = _measure(spline, curves, course, knots, demand, _DENSE)
    if error.max() > demand.tolerance or twist.max() > demand.twist:
        return None
    return Fit(spline, course, float(error.max()), float(twist.max()))


def _measure(
    spline: Spline, curves: Curves, course: Course, knots: Array, demand: Demand, places: Array
) -> tuple[Array, Array]:
    """The largest error and twist in every span, (spans,) each, at the given places in it."""
    s = (knots[:-1, None] + np.diff(knots)[:, None] * places).ravel()
    fitted = spline(s)
    off = fitted - _points(curves, course, s)
    error = np.max([np.linalg.norm(off[:, b], axis=1) for b in demand.blocks], axis=0)
    for a, b in demand.gaps:  # in proportion, so that one tolerance speaks for both
        step = np.linalg.norm(off[:, a] - off[:, b], axis=1)
        error = np.maximum(error, step * (demand.tolerance / demand.gap_tolerance))
    twist = np.zeros(s.size)
    if demand.faces:
        slope = spline.derivative(s)
        for a, b in demand.faces:
            turn = ruled_twist(fitted[:, a], slope[:, a], fitted[:, b], slope[:, b])
            twist = np.maximum(twist, turn)
    shape = (len(knots) - 1, places.size)
    return error.reshape(shape).max(axis=1), twist.reshape(shape).max(axis=1)


def _points(curves: Curves, course: Course, s: Array) -> Array:
    """The true points at s, all of them numbers."""
    points = curves(course(s))
    if not np.isfinite(points).all():
        raise GeometryError("the edges of the surface are not finite numbers")
    return points


def _wanted_sizes(knots: Array, error: Array, twist: Array, degree: int) -> Array:
    """Span sizes that bring error and twist (relative to their limits) to 0.9, where the spans
    are now.

    Error falls with the power degree + 1 of the span, twist, a derivative, with degree.
    """
    with np.errstate(divide="ignore"):
        by_error = (_AIM / error) ** (1 / (degree + 1))
        factor = np.minimum(by_error, (_AIM / twist) ** (1 / degree))
    size: Array = np.diff(knots) * np.clip(factor, 0.25, 2.5)
    for k in range(1, size.size):
        size[k] = min(size[k], _GRADING * size[k - 1])
    for k in range(size.size - 2, -1, -1):
        size[k] = min(size[k], _GRADING * size[k + 1])
    return size


def _regraded(knots: Array, breaks: Array, size: Array) -> Array:
    """New distinct knots of the given sizes (one for each old span) between the breaks."""
    amount = np.concatenate([[0.0], np.cumsum(np.diff(knots) / size)])
    pieces = []
    for a, b in pairwise(breaks):
        low, high = np.interp([a, b], knots, amount)
        n = max(int(np.ceil(high - low - 1e-9)), 1)
        inner = np.interp(np.linspace(low, high, n + 1)[1:-1], amount, knots)
        pieces.append(np.concatenate([[a], inner]))
    return np.concatenate([*pieces, breaks[-1:]])


def least_squares(
    curves: Curves, course: Course, distinct: Array, ends: Ends, degree: int
) -> Spline:
    """The spline on the distinct knots (k + 1,) that is nearest to the curves at Chebyshev points.

    The ends are met exactly; breaks of the course become knots of multiplicity degree - 1.
    """
    knots = _clamped(distinct, course.s, degree)
    count = len(knots) - degree - 1
    poles = np.zeros((count, ends.points[0].size))
    poles[0], poles[-1] = ends.points
    held = 1
    if ends.slopes is not None:
        poles[1] = poles[0] + ends.slopes[0] * (distinct[1] - distinct[0]) / degree
        poles[-2] = poles[-1] - ends.slopes[1] * (distinct[-1] - distinct[-2]) / degree
        held = 2
    free = slice(held, count - held)
    if held * 2 < count:
        nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        s = distinct[:-1, None] + np.diff(distinct)[:, None] * nodes
        centre = poles[0].copy()  # normal equations lose digits far from the origin
        shifted = Spline(degree, knots, np.where(_held(count, held), poles - centre, 0.0))
        target = _points(curves, course, s.ravel()) - centre - shifted(s.ravel())
        poles[free] = centre + _normal_equations(knots, degree, s, target, free)
    return Spline(degree, knots, poles)


def _normal_equations(knots: Array, degree: int, s: Array, target: Array, free: slice) -> Array:
    """The free poles of the least squares problem with samples s (spans, degree + 1)."""
    from scipy.linalg import solveh_banded  # type: ignore[import-untyped,unused-ignore]

    count = len(knots) - degree - 1
    span = np.searchsorted(knots[degree + 1 : count], s[:, 0], side="right") + degree
    weights = _basis(knots, degree, np.repeat(span, s.shape[1]), s.ravel())
    weights = weights.reshape(*s.shape, degree + 1)  # (spans, samples, degree + 1)
    square = np.einsum("sqa,sqb->sab", weights, weights)
    right = np.einsum("sqa,sqk->sak", weights, target.reshape(*s.shape, -1))
    band = np.zeros((degree + 1, count))
    load = np.zeros((count, target.shape[1]))
    for a in range(degree + 1):
        load[span - degree + a] += right[:, a]
        for b in range(a, degree + 1):
            band[degree - (b - a), span - degree + b] += square[:, a, b]
    return np.asarray(solveh_banded(band[:, free], load[free]))


def _basis(knots: Array, degree: int, span: Indices, s: Array) -> Array:
    """The degree + 1 basis functions that live on the knot span, (n, degree + 1)."""
    out = np.ones((s.size, 1))
    for j in range(1, degree + 1):
        upper = knots[span[:, None] + np.arange(1, j + 1)]
        lower = knots[span[:, None] + np.arange(1 - j, 1)]
        share = out / (upper - lower)
        grown = np.zeros((s.size, j + 1))
        grown[:, :-1] = (upper - s[:, None]) * share
        grown[:, 1:] += (s[:, None] - lower) * share
        out = grown
    return out


def _clamped(distinct: Array, breaks: Array, degree: int) -> Array:
    """The knot vector: ends of multiplicity degree + 1, breaks of degree - 1, others of 1."""
    times = np.ones(distinct.size, dtype=int)
    times[np.isin(distinct, breaks)] = degree - 1
    times[[0, -1]] = degree + 1
    return np.repeat(distinct, times)


def _held(count: int, held: int) -> Array:
    """A column (count, 1) that is True at the poles that the ends give."""
    index = np.arange(count)[:, None]
    return np.asarray((index < held) | (index >= count - held))


def _distinct(knots: Array) -> Array:
    return np.unique(knots)
