"""Conic: rails that are arcs of conics at one rational parameter, as the B-splines that they are.

An arc of a conic is a Bezier curve of degree 2 with one weight. Where both edges of a strip are
such arcs, points or lines, and the rulings join equal parameters, the face between them is the
surface itself. Nothing is known of the edges but their values; their own parameter may be any.

Source: The NURBS Book, 7.2 and 7.3 (rational arcs); Farin, Curves and Surfaces for CAGD, chapter
12 (the middle point as the pole of the chord).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry.fit import Course, Curves, Spline
from devcad.geometry.polynomial import ROUNDING, settled
from devcad.geometry.taylor import Array, rows_dot

QUARTER = 0.5 * np.pi  # of the eccentric angle: the longest arc in one span
MOST_CURVED = 1e3  # the largest weight of a hyperbola's arc: beyond it the arc is two lines

_COUNT = 33  # samples of an arc
_FLAT = 1e-6  # an arc whose sagitta is a smaller share of its chord is a line to the eye
_CLOSE = 1e-9  # residual of a conic through samples that is worth a closer look
_OPEN = 1e-10  # relative determinant below which a conic is a parabola
_ROUNDS = 6  # corrections of a cut's parameter; none is needed where that is the angle


@dataclass(frozen=True, slots=True)
class Conic:
    """A conic in its plane: the zeros of (x, y, 1) ``matrix`` (x, y, 1) where a point is
    ``centre`` + x ``axes`` [0] + y ``axes`` [1]; ``dual`` (2, 3) gives x and y of a point."""

    centre: Array
    axes: Array
    dual: Array
    matrix: Array

    def places(self, points: Array) -> Array:
        """The coordinates (n, 2) of points (n, 3) of the plane."""
        return np.asarray((points - self.centre) @ self.dual.T)

    @property
    def curvature(self) -> float:
        """Positive for an ellipse, 0 for a parabola, negative for a hyperbola."""
        square = self.matrix[:2, :2]
        share = float(np.linalg.det(square)) / max(float(np.trace(square)) ** 2, 1e-300)
        if abs(share) <= _OPEN or (share > 0.0 and self._level() <= 0.0):
            return 0.0
        return share

    def angles(self, points: Array) -> Array:
        """The eccentric angles of points (n, 3) of an ellipse in their order, without jumps."""
        middle, lower = self._ellipse()
        round_ = (self.places(points) - middle) @ lower
        return np.unwrap(np.arctan2(round_[:, 1], round_[:, 0]))

    @property
    def diameters(self) -> tuple[Array, Array, Array]:
        """The centre of an ellipse and its points from there at the angles 0 and a quarter."""
        middle, lower = self._ellipse()
        first, second = np.linalg.inv(lower) @ self.axes
        return self.centre + middle @ self.axes, first, second

    def _ellipse(self) -> tuple[Array, Array]:
        """The centre in the plane, and the matrix that makes the place from there a unit circle."""
        square = self.matrix[:2, :2]
        middle = -np.linalg.solve(square, self.matrix[:2, 2])
        return np.asarray(middle), np.asarray(np.linalg.cholesky(square / self._level()))

    def _level(self) -> float:
        """Minus the form's value at the centre of a conic that has one: not positive where no
        real ellipse is there."""
        linear = self.matrix[:2, 2]
        return -float(self.matrix[2, 2] - linear @ np.linalg.solve(self.matrix[:2, :2], linear))

    def between(self, start: Array, end: Array) -> tuple[Array, float] | None:
        """The middle point (3,) and the weight of the arc below a half turn between two points of
        the conic, None where there is none."""
        p, q = (np.append(self.places(x[None])[0], 1.0) for x in (start, end))
        pole = np.linalg.solve(self.matrix, np.cross(p, q))
        if abs(pole[2]) <= 1e-12 * float(np.abs(pole).max()):
            return None
        pole /= pole[2]
        outside = 2.0 * float(pole @ self.matrix @ pole)
        square = -float(p @ self.matrix @ q) / outside if outside else 0.0
        if not 0.0 < square < MOST_CURVED**2:
            return None
        whole = float(settled(np.array(square), 1.0, ROUNDING))  # a quarter turn: one half
        return self.centre + pole[:2] @ self.axes, float(np.sqrt(whole))


@dataclass(frozen=True, slots=True)
class Arcs:
    """The spline that the curves are, and the places ``s`` (n,) on it of their points at ``t``."""

    spline: Spline
    t: Array
    s: Array


def arcs(curves: Curves, course: Course, ends: tuple[Array, Array]) -> Arcs | None:
    """The curves as one span of degree 2 with weights that is equal to them, or None.

    Equal means within 4e-13 of the largest coordinate, at one parameter for all; one of the
    curves must be an arc of a conic, of at most a quarter turn where that is an ellipse.

    Args:
        curves: points (n, 3 k) at t (n,), k curves in space.
        course: t against s, without a break; the spline's parameter is s over the same ends.
        ends: the points (3 k,) at both ends as the spline shall have them.
    """
    if len(course.s) != 2:
        return None
    t = np.linspace(course.t[0], course.t[1], _COUNT)
    points = _apart(curves(t))
    if not np.isfinite(points).all():
        return None
    points[[0, -1]] = [e.reshape(-1, 3) for e in ends]
    near = 4.0 * ROUNDING * float(np.abs(points).max())
    for k in _longest_first(points):
        conic = conic_through(points[:, k], near)
        span = None if conic is None else conic.between(points[0, k], points[-1, k])
        if span is None or span[1] < np.cos(0.5 * QUARTER) - 1e-6:
            continue
        r = _parameter(points[:, k], *span)
        if not (np.diff(r) > 0.0).all():
            continue
        found = [_follow(points[:, i], r, span[1], near) for i in range(points.shape[1])]
        whole = [f for f in found if f is not None]
        if len(whole) < len(found):
            return None
        low, high = course.s
        poles = np.concatenate([p for p, _ in whole], axis=1)
        poles = settled(poles, 0.25 * near / ROUNDING, ROUNDING)
        weights = np.repeat([w for _, w in whole], 3, axis=0).T
        spline = Spline(2, np.repeat([low, high], 3), poles, True, weights)
        return Arcs(spline, t, np.clip(low + r * (high - low), low, high))
    return None


def arc_borders(curves: Curves, start: float, end: float) -> Array | None:
    """The parameters, the ends included, at which curves between two breaks are cut so that each
    part is one span of conics: an ellipse in equal parts of at most a quarter turn.

    None where they are not conics at one parameter; a parabola is left to the polynomials.
    """
    t = np.linspace(start, end, 2 * _COUNT - 1)
    points = _apart(curves(t))
    if not np.isfinite(points).all():
        return None
    near = 4.0 * ROUNDING * float(np.abs(points).max())
    for k in _longest_first(points):
        conic = conic_through(points[:, k], near)
        if conic is None or conic.curvature == 0.0:
            continue
        borders = np.array([start, end])
        if conic.curvature > 0.0:
            borders = _quarters(conic, curves, k, t, points[:, k])
        for a, b in pairwise(borders):
            part = np.array([a, b])
            low, high = curves(part)
            if arcs(curves, Course(part, part), (low, high)) is None:
                return None
        return borders
    return None


def conic_through(points: Array, near: float) -> Conic | None:
    """The conic on which points (n, 3) lie, their plane within ``near``, or None: none, or a line.

    The plane's coordinates are stretched until the arc is as deep as wide: a shallow one loses
    no digits. How closely it goes through is for the caller to measure.
    """
    centre = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - centre, full_matrices=False)
    if not size[1] > _FLAT * size[0]:
        return None
    if np.abs((points - centre) @ axes[2]).max() > near:
        return None
    scale = size[:2, None] / np.sqrt(len(points))
    dual = axes[:2] / scale
    x, y = ((points - centre) @ dual.T).T
    rows = np.stack([x * x, 2.0 * x * y, y * y, 2.0 * x, 2.0 * y, np.ones_like(x)], axis=1)
    _, weights, forms = np.linalg.svd(rows, full_matrices=False)
    if weights[5] > _CLOSE * weights[0]:
        return None
    a, b, c, d, e, f = forms[5]
    matrix = np.array([[a, b, d], [b, c, e], [d, e, f]])
    if a + c < 0.0:
        matrix = -matrix
    if abs(np.linalg.det(matrix)) <= 1e-12:
        return None  # a pair of lines
    return Conic(centre, axes[:2] * scale, dual, matrix)


def _quarters(conic: Conic, curves: Curves, k: int, t: Array, points: Array) -> Array:
    """The borders of equal parts of the arc of an ellipse that the k-th curve is."""
    angles = conic.angles(points)
    parts = max(int(np.ceil(abs(angles[-1] - angles[0]) / QUARTER - 1e-9)), 1)
    wanted = np.linspace(angles[0], angles[-1], parts + 1)[1:-1]
    if not (np.diff(angles) * np.sign(angles[-1] - angles[0]) > 0.0).all():
        return t[[0, -1]]
    falling = angles[-1] < angles[0]
    over, back = (angles[::-1], t[::-1]) if falling else (angles, t)
    cuts = np.interp(wanted, over, back)
    slope = np.interp(wanted, over, np.gradient(back, over))
    for _ in range(_ROUNDS if parts > 1 else 0):
        there = conic.angles(np.concatenate([points[:1], _apart(curves(cuts))[:, k]]))[1:]
        off = np.remainder(wanted - there + np.pi, 2.0 * np.pi) - np.pi
        if np.abs(off).max() <= 1e-14:
            break
        cuts = np.clip(cuts + slope * off, t[0], t[-1])
    return np.concatenate([t[:1], cuts, t[-1:]])


def _parameter(points: Array, middle: Array, weight: float) -> Array:
    """The rational parameter, 0 to 1, of points (n, 3) on the arc from the first to the last.

    Barycentric coordinates a, b, c of a point on it are (1 - r)^2, 2 r (1 - r) w and r^2 over one
    denominator, so that r = (b / 2w + c) / (a + b / w + c).
    """
    first, last = points[0], points[-1]
    sides = np.stack([middle - first, last - first], axis=1)
    b, c = np.linalg.lstsq(sides, (points - first).T, rcond=None)[0]
    a = 1.0 - b - c
    with np.errstate(divide="ignore", invalid="ignore"):  # far off the arc: not increasing
        r = (0.5 * b / weight + c) / (a + b / weight + c)
    r[[0, -1]] = 0.0, 1.0
    return np.asarray(r)


def _follow(points: Array, r: Array, weight: float, near: float) -> tuple[Array, Array] | None:
    """Poles (3, 3) and weights (3,) of a curve that has the points (n, 3) at the parameters r.

    The weights are 1, ``weight``, 1 where that will do (parallel ends, a point), else its own.
    """
    basis = np.stack([(1.0 - r) ** 2, 2.0 * r * (1.0 - r), r * r])
    first, last = points[0], points[-1]
    if np.abs(points - first).max() <= near:
        return np.array([first, first, last]), np.array([1.0, weight, 1.0])
    for weights in (np.array([1.0, weight, 1.0]), _own_weights(points, basis)):
        if weights is None:
            return None
        shares = weights[:, None] * basis
        shares = shares / shares.sum(axis=0)
        rest = points - shares[0][:, None] * first - shares[2][:, None] * last
        middle = (shares[1] @ rest) / float(shares[1] @ shares[1])
        poles = np.array([first, middle, last])
        if np.abs(shares.T @ poles - points).max() <= near:
            return poles, weights
    return None


def _own_weights(points: Array, basis: Array) -> Array | None:
    """The weights (3,) of a curve of degree 2 through the points (n, 3), the first 1."""
    first, last = points[0], points[-1]
    reach = float(np.abs(points - first).max())
    columns = [
        basis[0][:, None] * (points - first),
        basis[2][:, None] * (points - last),
        basis[1][:, None] * (points - first),
    ]
    known = np.stack([c.ravel() / reach for c in columns], axis=1)
    free = -np.kron(basis[1][:, None], np.eye(3))
    found = np.linalg.svd(np.concatenate([known, free], axis=1), full_matrices=False)[2][5]
    weights = np.array([found[0], found[2], found[1]])
    weights *= np.sign(weights[0])
    if not (weights > 1e-3 * weights.max()).all():
        return None
    return np.asarray(weights / weights[0])


def _apart(rows: Array) -> Array:
    """Curves side by side (n, 3 k) as (n, k, 3)."""
    return np.array(rows).reshape(len(rows), -1, 3)


def _longest_first(points: Array) -> list[int]:
    """The curves of (n, k, 3) by the length of their steps."""
    steps = np.diff(points, axis=0)
    length = np.sqrt(rows_dot(steps.reshape(-1, 3), steps.reshape(-1, 3)))
    return [int(k) for k in np.argsort(-length.reshape(steps.shape[:2]).sum(axis=0))]
