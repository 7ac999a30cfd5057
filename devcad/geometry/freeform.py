"""Freeform surfaces S(u, v): their series along a curve, exact partial derivatives, nearest points.

A surface is a function of two series, so that whatever follows from it is a series too. Its
partial derivatives come by Kronecker's substitution: along u(t) + B t^(K + 1), v(t) the
coefficients K + 1 to 2 K + 1 are B times those of S_u, and B is so large that S itself, which
they hold too, drowns in their rounding.

Source: Griewank and Walther, Evaluating Derivatives, chapter 13; Piegl and Tiller, The NURBS
Book, chapter 3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from devcad.geometry import splines, taylor
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array

HUGE = 2.0**400
"""B: times 1e-16 it still exceeds the growth of 50 coefficients, and it is far from overflow."""
STEPS = 60
"""Newton's iterations towards a nearest point; from near by a handful does."""
SETTLED = 1e-13
"""A share of the squared distance that is not worth another step."""
HALVINGS = 20
"""Halvings of a step that leads away from the point."""

Mask = npt.NDArray[np.bool_]

Sheet = Callable[[Array, Array, Array], Array]
"""The series of u and v (K + 1, n) and places (2, n) next to which they lie, which choose the
spans of a spline, to the series of S (K + 1, n, 3)."""


@dataclass(frozen=True, slots=True)
class Freeform:
    """``sheet`` is the surface; ``knots`` its inner knot lines in u and in v, ``box`` the domain
    ((u0, u1), (v0, v1)); both are empty, and the domain the plane, where there are none."""

    sheet: Sheet
    knots: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    box: tuple[tuple[float, float], tuple[float, float]] | None = None

    def partials(self, u: Array, v: Array, at: Array) -> tuple[Array, Array]:
        """The series of S_u and S_v along the series of u and v, (K + 1, n, 3) each."""
        order, count = u.shape
        still = np.zeros((2 * order, count))
        still[order] = HUGE
        lifted = np.concatenate([np.stack([u, v], axis=1), np.zeros((order, 2, count))])
        low, high = lifted[:, 0], lifted[:, 1]
        along_u = self.sheet(low + still, high, at)[order:]
        along_v = self.sheet(low, high + still, at)[order:]
        return along_u / HUGE, along_v / HUGE

    def normal(self, u: Array, v: Array, at: Array) -> Array:
        """The series of S_u x S_v, (K + 1, n, 3)."""
        return taylor.cross(*self.partials(u, v, at))


def of_expressions(x: Expression, y: Expression, z: Expression) -> Freeform:
    """The surface with the coordinates x, y, z, expressions in u and v."""

    def sheet(u: Array, v: Array, at: Array) -> Array:
        return np.stack([part.series(u=u, v=v) for part in (x, y, z)], axis=-1)

    return Freeform(sheet)


def of_bspline(
    degrees: tuple[int, int],
    knots: tuple[Array, Array],
    control: Array,
    weights: Array | None = None,
) -> Freeform:
    """The tensor-product B-spline with control points (nu, nv, 3), rational with weights (nu, nv).

    Not checked: the knots fit the degrees and numbers of control points.
    """
    one = np.ones(control.shape[:2]) if weights is None else weights
    points = np.concatenate([control * one[..., None], one[..., None]], axis=2)
    nu, nv = points.shape[:2]
    first = splines.piecewise(knots[0], points.reshape(nu, -1), degrees[0])
    rows, spans = first.coefficients.shape[:2]  # (p + 1, mu, nv * 4)
    table = np.moveaxis(first.coefficients.reshape(rows, spans, nv, 4), 2, 0)
    second = splines.piecewise(knots[1], table.reshape(nv, -1), degrees[1])
    # (q + 1, mv, p + 1, mu, 4)
    local = second.coefficients.reshape(*second.coefficients.shape[:2], rows, spans, 4)
    lines = (first.knots, second.knots)
    rational = weights is not None

    def sheet(u: Array, v: Array, at: Array) -> Array:
        i, x = _local(lines[0], u, at[0])
        j, y = _local(lines[1], v, at[1])
        out = np.zeros((*u.shape, 4))
        for b in range(len(local) - 1, -1, -1):  # Horner in v, and for each power in u
            row = np.zeros((*u.shape, 4))
            for a in range(rows - 1, -1, -1):
                row = taylor.mul(x, row)
                row[0] += local[b, j, a, i]
            out = taylor.mul(y, out) + row
        return taylor.div(out[..., :3], out[..., 3]) if rational else out[..., :3]

    inner = (tuple(lines[0][1:-1].tolist()), tuple(lines[1][1:-1].tolist()))
    ends = [(float(line[0]), float(line[-1])) for line in lines]
    return Freeform(sheet, inner, (ends[0], ends[1]))


def _local(lines: Array, series: Array, at: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """The span of each place, and the series counted from the span's middle."""
    span = np.clip(np.searchsorted(lines, at, side="right") - 1, 0, len(lines) - 2).astype(np.intp)
    out = series.copy()
    out[0] -= 0.5 * (lines[span] + lines[span + 1])
    return span, out


@dataclass(frozen=True, slots=True)
class Feet:
    """The nearest points found: ``where`` (2, n) on the surface, ``distance`` (n,), whether the
    distance is ``least`` (n,) there, and no saddle of it, and whether the point lies ``beyond``
    (n,) the edge of the surface."""

    where: Array
    distance: Array
    least: Mask
    beyond: Mask


def feet(surface: Freeform, points: Array, start: Array) -> Feet:
    """The nearest points to ``points`` (n, 3) that Newton's method finds from ``start`` (2, n).

    It is made to descend, and stays in the domain where the surface has one. They need not be
    the nearest of all where the surface comes by twice.
    """
    where = start
    least = _squares(surface, points, where)
    for _ in range(STEPS):
        step, convex, beyond = _step(surface, points, where)
        trial, squares = _descended(surface, points, where, step, least)
        better = squares < (1.0 - SETTLED) * least
        where, least = np.where(better, trial, where), np.where(better, squares, least)
        if not better.any():
            break
    return Feet(where, np.sqrt(least), convex, beyond)


def _descended(
    surface: Freeform, points: Array, where: Array, step: Array, least: Array
) -> tuple[Array, Array]:
    """The places after the steps, each halved until it leads nearer, and the squared distances."""
    share = np.ones(len(points))
    for _ in range(HALVINGS):
        trial = _within(surface, where + share * step)
        with np.errstate(all="ignore"):
            squares = _squares(surface, points, trial)
        worse = ~(squares <= least)
        if not worse.any():
            break
        share = np.where(worse, 0.5 * share, share)
    return trial, squares


def _within(surface: Freeform, place: Array) -> Array:
    """The place moved into the domain."""
    if surface.box is None:
        return place
    box = np.array(surface.box)
    return np.clip(place, box[:, :1], box[:, 1:])


def _squares(surface: Freeform, points: Array, where: Array) -> Array:
    """The squared distances of the surface's points at ``where`` (2, n) from the points."""
    away = surface.sheet(where[:1], where[1:], where)[0] - points
    return np.asarray((away * away).sum(axis=1))


def _step(surface: Freeform, points: Array, where: Array) -> tuple[Array, Mask, Mask]:
    """Newton's step (2, n) towards the foot point, or Gauss's where the distance is not convex;
    where it is; and where an edge of the domain holds the step up."""
    pure = [_along(surface, where, du, dv) for du, dv in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))]
    su, sv = pure[0][1], pure[1][1]
    suu, svv = 2.0 * pure[0][2], 2.0 * pure[1][2]
    suv = pure[2][2] - pure[0][2] - pure[1][2]
    away = pure[0][0] - points
    dot = taylor.rows_dot
    gradient = np.stack([dot(away, su), dot(away, sv)])
    gauss = np.stack([dot(su, su), dot(su, sv), dot(sv, sv)])
    full = gauss + np.stack([dot(away, suu), dot(away, suv), dot(away, svv)])
    held = _held(surface, where, gradient)
    gradient = np.where(held, 0.0, gradient)
    convex: Mask = (full[0] * full[2] > full[1] ** 2) & (full[0] > 0.0)
    a, b, c = np.where(convex, full, gauss)
    b = np.where(held.any(axis=0), 0.0, b)
    with np.errstate(all="ignore"):
        step = -np.stack([c * gradient[0] - b * gradient[1], a * gradient[1] - b * gradient[0]])
        step = step / (a * c - b * b)
    return np.where(np.isfinite(step), step, 0.0), convex, np.any(held, axis=0)


def _held(surface: Freeform, where: Array, gradient: Array) -> Mask:
    """Where the way down leads over the edge of the domain, (2, n)."""
    if surface.box is None:
        return np.zeros(where.shape, dtype=bool)
    box = np.array(surface.box)
    return np.asarray(
        ((where <= box[:, :1]) & (gradient > 0.0)) | ((where >= box[:, 1:]) & (gradient < 0.0))
    )


def _along(surface: Freeform, where: Array, du: float, dv: float) -> Array:
    """The series (3, n, 3) of the surface in the direction (du, dv) of its parameters."""
    zero = np.zeros_like(where[0])
    u, v = (
        np.stack([place, np.full_like(place, rate), zero])
        for place, rate in zip(where, (du, dv), strict=True)
    )
    return surface.sheet(u, v, where)
