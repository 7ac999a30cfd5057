"""Curve: a space curve as Taylor series at any parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from devcad.geometry.taylor import Array

CurveJet = Callable[[Array, int], Array]
"""Parameters t (n,) and an order K to Taylor coefficients (K + 1, n, 3)."""

COINCIDENT = 1e-9
"""Largest distance, as a fraction of the size, between two points that count as one."""

SAME_DIRECTION = 1e-9
"""Largest angle in radians between two tangents that count as one."""


@dataclass(frozen=True, slots=True)
class Curve:
    """``jet(t, K)`` gives the Taylor coefficients (K + 1, n, 3) at t (n,) on the closed domain.

    ``breaks`` are interior parameters where the tangent direction is continuous but the curve is
    less smooth than elsewhere (spline knots, line to arc); ``corners`` those where the tangent
    direction jumps. There the jet is that of the part to the right; the end of the domain
    belongs to the last part. ``closed`` says that the end point is the start point.
    """

    jet: CurveJet
    domain: tuple[float, float]
    breaks: tuple[float, ...] = ()
    corners: tuple[float, ...] = ()
    closed: bool = False

    def point(self, t: npt.ArrayLike) -> Array:
        """The points at t, a number or (n,), shape (n, 3)."""
        return np.asarray(self.jet(np.atleast_1d(np.asarray(t, dtype=float)), 0)[0])

    def pieces(self) -> tuple[Curve, ...]:
        """The parts between the corners, each without corners.

        A part evaluates one-sidedly at its ends: to the left of a corner it takes the series
        one rounding before it.
        """
        if not self.corners:
            return (self,)
        ends = (self.domain[0], *self.corners, self.domain[1])
        last = len(ends) - 2
        return tuple(
            self._part(ends[i], ends[i + 1], ends[i + 1] if i == last else None)
            for i in range(last + 1)
        )

    def _part(self, lo: float, hi: float, limit: float | None) -> Curve:
        """The part over [lo, hi]; parameters are clipped to ``limit``, default just below hi."""
        top = float(np.nextafter(hi, lo)) if limit is None else limit

        def jet(t: Array, order: int) -> Array:
            return self.jet(np.clip(t, lo, top), order)

        part = replace(
            self,
            jet=jet,
            domain=(lo, hi),
            breaks=tuple(b for b in self.breaks if lo < b < hi),
            corners=(),
        )
        return replace(part, closed=ends_meet(part))


def size(points: Array) -> float:
    """The diagonal of the box around the points (n, 3)."""
    return float(np.linalg.norm(points.max(axis=0) - points.min(axis=0)))


def samples(curve: Curve, count: int = 64) -> Array:
    """``count`` + 1 parameters over the domain with the breaks and corners among them."""
    lo, hi = curve.domain
    even = np.linspace(lo, hi, count + 1)
    return np.unique(np.concatenate([even, curve.breaks, curve.corners]))


def ends_meet(curve: Curve) -> bool:
    """Whether the end point is the start point, within 1e-9 of the curve's size."""
    points = curve.point(samples(curve))
    return bool(np.linalg.norm(points[-1] - points[0]) <= COINCIDENT * size(points))


def turns(curve: Curve, t: npt.ArrayLike) -> Array:
    """The angles by which the tangent turns at once at t (n,), in radians; pi where it vanishes."""
    t = np.atleast_1d(np.asarray(t, dtype=float))
    before = curve.jet(np.nextafter(t, -np.inf), 1)[1]
    return angles(before, curve.jet(t, 1)[1])


def angles(x: Array, y: Array) -> Array:
    """The angles between the vectors x and y (n, 3), in radians; pi where one of them is 0."""
    sine = np.linalg.norm(np.cross(x, y), axis=-1)
    cosine = np.einsum("...i,...i->...", x, y)
    return np.where((sine == 0.0) & (cosine == 0.0), np.pi, np.arctan2(sine, cosine))
