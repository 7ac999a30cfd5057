"""What a job may say: plain checks of its numbers, points and directions.

Each takes a value, gives it back in the form that the geometry wants, and otherwise raises a
JobError with the value, the limit and the remedy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from devcad.errors import JobError
from devcad.geometry import jets
from devcad.geometry.curve import COINCIDENT, size
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array

Triple = tuple[float, float, float]

MAX_DEGREE = 15  # of a B-spline; CAD systems stop between 9 and 25
ORTHONORMAL = 1e-6  # a frame written with six decimals


def expression(value: Any, names: tuple[str, ...]) -> Expression:
    """A number or an expression in the names."""
    if isinstance(value, Expression):
        return value
    if isinstance(value, str):
        return jets.parse(value, names)
    return jets.parse(repr(finite(value)), names)


def constant(value: Any) -> float:
    """A number, or an expression without variables."""
    if isinstance(value, str):
        return jets.parse(value, ()).constant()
    return finite(value)


def finite(value: Any) -> float:
    """A number that is one."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise JobError(
            f"{value!r:.60} is neither a number nor an expression",
            remedy='write a number, or an expression in quotation marks such as "2*pi"',
        )
    number = float(value) if abs(value) < 10**300 else math.inf
    if not math.isfinite(number):
        raise JobError(f"{value} is not a finite number", remedy="write a number below 1e300")
    return number


def nonzero(value: Triple) -> Triple:
    """A direction that has a length."""
    if not any(value):
        raise JobError("the direction [0, 0, 0] has no length", value=0.0, remedy="give another")
    return value


def increasing(value: tuple[float, float]) -> tuple[float, float]:
    """An interval with from < to."""
    if not value[0] < value[1]:
        raise JobError(
            f"the interval starts at {value[0]:.9g} and ends at {value[1]:.9g}",
            value=value[1],
            limit=value[0],
            remedy="the first number must be smaller than the second",
        )
    return value


def sweep(value: float) -> float:
    """A sweep given in degrees, in radians."""
    if value == 0.0 or abs(value) > 360.0:
        raise JobError(
            f"the sweep is {value:.9g} degrees, allowed are -360 to 360 without 0",
            value=value,
            limit=360.0,
            remedy="a helix or a natural curve may turn further",
        )
    return math.radians(value)


def unit(direction: Triple) -> Array:
    """The unit vector of a direction, (3,)."""
    vector = np.array(direction)
    vector = vector / np.abs(vector).max()  # first, so that tiny and huge ones do not underflow
    return np.asarray(vector / np.linalg.norm(vector))


def distinct(points: Sequence[Triple], closed: bool, least: int) -> Array:
    """The points (n, 3), no two neighbours alike.

    A first point that is repeated at the end of a closed curve is dropped.
    """
    array = np.array(points, dtype=float).reshape(-1, 3)
    limit = COINCIDENT * size(array) if len(array) else 0.0
    if closed and len(array) > 1 and np.linalg.norm(array[-1] - array[0]) <= limit:
        array = array[:-1]
    if len(array) < least:
        raise JobError(
            f"{len(array)} points are too few, at least {least} different ones are needed",
            value=len(array),
            limit=least,
            remedy="give more points",
        )
    following = np.concatenate([array[1:], array[:1]]) if closed else array[1:]
    steps = np.linalg.norm(following - array[: len(following)], axis=1)
    if steps.min() <= limit:
        first = int(np.argmin(steps))
        raise JobError(
            f"points {first} and {(first + 1) % len(array)} (counted from 0) are the same",
            value=float(steps.min()),
            limit=limit,
            remedy="remove one of them",
        )
    return array


def check_bspline(
    degree: int, knots: Sequence[float], count: int, weights: Sequence[float] | None
) -> None:
    """Refuse knots and weights that do not make a continuous spline of ``count`` control points."""
    if count < degree + 1:
        raise JobError(
            f"{count} control points are too few for degree {degree}, at least {degree + 1}",
            value=count,
            limit=degree + 1,
            remedy="give more control points or a lower degree",
        )
    if len(knots) != count + degree + 1:
        raise JobError(
            f"{len(knots)} knots, but {count} control points of degree {degree} need"
            f" {count + degree + 1}",
            value=len(knots),
            limit=count + degree + 1,
            remedy="give the full knot vector, end knots repeated",
        )
    if weights is not None and len(weights) != count:
        raise JobError(
            f"{len(weights)} weights for {count} control points",
            value=len(weights),
            limit=count,
            remedy="give one weight for each control point",
        )
    _check_knots(degree, np.array(knots), count)


def _check_knots(degree: int, knots: Array, count: int) -> None:
    falling = np.flatnonzero(np.diff(knots) < 0.0)
    if falling.size:
        i = int(falling[0])
        raise JobError(
            f"knot {i + 1} (counted from 0) is {knots[i + 1]:.9g}, less than the one before",
            value=float(knots[i + 1]),
            limit=float(knots[i]),
            remedy="knots must not decrease",
        )
    distinct_knots, multiplicity = np.unique(knots, return_counts=True)
    inside = (distinct_knots > knots[degree]) & (distinct_knots < knots[count])
    allowed = np.where(inside, degree, degree + 1)
    if not knots[degree] < knots[count] or (multiplicity > allowed).any():
        worst = int(np.argmax(multiplicity - allowed))
        raise JobError(
            f"knot {distinct_knots[worst]:.9g} occurs {multiplicity[worst]} times,"
            f" limit {allowed[worst]}",
            value=int(multiplicity[worst]),
            limit=int(allowed[worst]),
            remedy="a knot inside may occur degree times, at an end once more",
        )


def plane_axes(normal: Triple, x_axis: Triple | None) -> tuple[Array, Array]:
    """The unit vectors X and Y = normal x X of a plane, (3,) each.

    X is ``x_axis`` projected into the plane; by default +x, or +y if the normal is along x.
    """
    n = unit(normal)
    if x_axis is None:
        along_x = np.linalg.norm(np.cross(n, (1.0, 0.0, 0.0))) < ORTHONORMAL
        x_axis = (0.0, 1.0, 0.0) if along_x else (1.0, 0.0, 0.0)
    x = unit(x_axis)
    x = x - (x @ n) * n
    length = float(np.linalg.norm(x))
    if length < ORTHONORMAL:
        raise JobError(
            f"x_axis {list(x_axis)} is along the normal {list(normal)}",
            value=length,
            limit=ORTHONORMAL,
            remedy="give an x_axis across the normal, or leave it out",
        )
    x = x / length
    x = x - (x @ n) * n  # again, for an x_axis near the normal
    x = x / np.linalg.norm(x)
    return x, np.cross(n, x)


def orthonormal(frame: tuple[Triple, Triple, Triple]) -> Array:
    """The rows T, N, B made exactly orthonormal, (3, 3)."""
    rows = np.array(frame)
    defect = float(np.abs(rows @ rows.T - np.eye(3)).max())
    if not (defect <= ORTHONORMAL and np.linalg.det(rows) > 0.0):
        raise JobError(
            f"the frame is not three perpendicular unit vectors, right-handed: off by {defect:.3g}",
            value=defect,
            limit=ORTHONORMAL,
            remedy="give T, N and B = T x N, each of length 1",
        )
    u, _, v = np.linalg.svd(rows)
    return np.asarray(u @ v)
