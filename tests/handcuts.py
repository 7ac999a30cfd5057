"""Cuts written down by hand: contours in the pattern of a cylinder or a cone, carried to (t, v) by
the closed form of its development."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.taylor import Array

Plane = Callable[[Array], tuple[Array, Array]]
"""u -> x, y in the pattern."""
Inverse = Callable[[Array, Array], tuple[Array, Array]]
"""x, y in the pattern -> t, v."""
Piece = tuple[Plane, float, float]
TURN = 2.0 * np.pi


def on_cylinder(radius: float) -> Inverse:
    """Of ``frustum(radius, radius, height)``."""
    return lambda x, y: (y / radius, x)


def on_cone(lower: float, upper: float, height: float) -> Inverse:
    """Of ``frustum(lower, upper, height)``: a sector about (apex, 0)."""
    slant = float(np.hypot(height, lower - upper))
    sine = (lower - upper) / slant
    apex = lower / sine
    return lambda x, y: (np.arctan2(y, apex - x) / sine, apex - np.hypot(apex - x, y))


def line(a: tuple[float, float], b: tuple[float, float]) -> Piece:
    return lambda u: (a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])), 0.0, 1.0


def arc(centre: tuple[float, float], radius: float, start: float, sweep: float) -> Piece:
    """From the angle ``start`` on, clockwise by ``sweep``, both in radians."""
    x, y = centre
    return (
        lambda u: (x + radius * np.cos(start - u), y + radius * np.sin(start - u)),
        0.0,
        sweep,
    )


def track(inverse: Inverse, piece: Piece, patch: int = 0, period: float = 0.0) -> Track:
    """The piece on a patch; on a tube what lies before t = 0 lies at the end."""
    plane, low, high = piece

    def places(u: Array) -> Array:
        t, v = inverse(*plane(u))
        return np.column_stack([t, v])

    later = period if places(np.array([0.5 * (low + high)]))[0, 0] < 0.0 else 0.0
    series = chebyshev.resolve(
        lambda u: places(u) + np.array([later, 0.0]),
        np.array([low, high]),
        scale=np.array([1.0, 1.0]),
    )
    return Track(patch, Piecewise(series.knots, series.coefficients))


def cut(inverse: Inverse, pieces: list[Piece], *, period: float = 0.0, closed: bool = True) -> Cut:
    return Cut("hand", tuple(track(inverse, p, 0, period) for p in pieces), closed)


def circle(
    inverse: Inverse, centre: tuple[float, float], radius: float, *, start: float = 0.3
) -> Cut:
    return cut(inverse, [arc(centre, radius, start, TURN)])


def slot(centre: tuple[float, float], length: float, width: float, angle: float) -> list[Piece]:
    """Two lines and two half circles, clockwise from the start of the upper line."""
    r, half = 0.5 * width, 0.5 * (length - width)
    along = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-along[1], along[0]])

    def place(a: float, b: float) -> tuple[float, float]:
        x, y = np.array(centre) + a * along + b * across
        return float(x), float(y)

    return [
        line(place(-half, r), place(half, r)),
        arc(place(half, 0.0), r, angle + 0.5 * np.pi, np.pi),
        line(place(half, -r), place(-half, -r)),
        arc(place(-half, 0.0), r, angle - 0.5 * np.pi, np.pi),
    ]


def polygon(*corners: tuple[float, float]) -> list[Piece]:
    """Straight from corner to corner, clockwise."""
    return [line(a, b) for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)]


def over_seam(x: float, radius: float) -> list[Piece]:
    """A circle about (x, 0) on the seam of a tube, as its halves after and before the seam."""
    return [arc((x, 0.0), radius, np.pi, np.pi), arc((x, 0.0), radius, 0.0, np.pi)]


def on_wall(length: float, start: float = 0.0) -> Inverse:
    """Of a wall over a segment of this length, which begins at y = ``start``."""
    return lambda x, y: ((y - start) / length, x)
