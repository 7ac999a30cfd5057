"""The second intersection of a line through a fixed point A, as the root of a deflated function.

The line starts at a point C of a surface f = 0 or of a curve and points at A: C + lam W, W = A - C.
C itself is a root; it is divided out, by an integral where the other root is near (the line nearly
a tangent), so that the other is a simple root even where both are one.

Source: geometry.md, section 5 (Yang).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from devcad.geometry import taylor
from devcad.geometry.curve import Curve
from devcad.geometry.freeform import HUGE
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array

NODES, WEIGHTS = (0.5 * x for x in np.polynomial.legendre.leggauss(16))
NODES = NODES + 0.5  # on [0, 1]
NEAR = 0.5
"""A root nearer than this, as a share of W, is divided out by an integral."""
NEAR_ON_CURVE = 0.1
"""The same on a curve, as a share of its domain."""
FARTHEST = 21.0
"""lam = sinh(x) is looked at for |x| up to this: 6e8 W either way, closest at C."""
LOOKS = 401
"""Places on each line that are looked at."""
SIDE = 1e-9
"""A place nearer than this to a mark, as a share of the domain, is put on the side it is on."""
PERIODIC = 1e-7
"""Two series at the ends of a closed curve that differ by less, of its size, are one."""


class Secant(Protocol):
    """What the two kinds share; the unknown u places D on the line."""

    def looks(self, t: Array) -> Array:
        """Values of u (m, n) between which a root is looked for."""

    def residual(self, t: Array, u: Array) -> Array:
        """The deflated function's series (K + 1, n) at t (n,) and the series u."""

    def slope(self, t: Array, u: Array) -> Array:
        """Its derivative in u, (n,), at t and u (n,)."""

    def point(self, t: Array, u: Array) -> Array:
        """The series of D (K + 1, n, 3)."""

    def way(self, t: Array, u: Array) -> Array:
        """lam (n,), D = C + lam W, nan where D is not on the line."""

    def nearest(self, u: Array, to: float) -> Array:
        """The values that mean the same as u and are nearest to another one."""


@dataclass(frozen=True, slots=True)
class SurfaceSecant:
    """The lines from C(t) meet f = 0 again at D; the unknown is lam."""

    f: Expression
    curve: Curve
    point_a: Array

    def looks(self, t: Array) -> Array:
        """As Secant."""
        lam = np.sinh(np.linspace(-FARTHEST, FARTHEST, LOOKS))
        return np.repeat(lam[:, None], len(t), axis=1)

    def residual(self, t: Array, u: Array) -> Array:
        """(f(C + lam W) - f(C)) / lam."""
        start, way = self._line(t, len(u) - 1)
        near = np.abs(u[0]) < NEAR
        out = np.empty_like(u)
        if near.any():
            out[:, near] = self._mean(start[:, near], way[:, near], u[:, near])
        far = np.logical_not(near)
        c, w, lam = start[:, far], way[:, far], u[:, far]
        out[:, far] = taylor.div(value(self.f, c + taylor.mul(lam, w)) - value(self.f, c), lam)
        return out

    def _mean(self, start: Array, way: Array, lam: Array) -> Array:
        """The mean of <grad f, W> between C and C + lam W."""
        total = np.zeros_like(lam)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            total += weight * slope(self.f, start + taylor.mul(node * lam, way), way)
        return total

    def slope(self, t: Array, u: Array) -> Array:
        """As Secant."""
        start, way = self._line(t, 0)
        out = np.zeros_like(u)
        near = np.abs(u) < NEAR
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            out += weight * node * 2.0 * self._bend(start, way, node * u)[2]
        far = self._bend(start, way, u)
        with np.errstate(all="ignore"):
            direct = (far[1] - (far[0] - value(self.f, start)[0]) / u) / u
        return np.where(near, out, direct)

    def _bend(self, start: Array, way: Array, lam: Array) -> Array:
        """The series (3, n) of f(C + lam W) in lam."""
        line = np.stack([start[0] + lam[:, None] * way[0], way[0], np.zeros_like(way[0])])
        return value(self.f, line)

    def point(self, t: Array, u: Array) -> Array:
        """As Secant."""
        start, way = self._line(t, len(u) - 1)
        return start + taylor.mul(u, way)

    def way(self, t: Array, u: Array) -> Array:
        """As Secant."""
        return u

    def nearest(self, u: Array, to: float) -> Array:
        """As Secant."""
        return u

    def _line(self, t: Array, order: int) -> tuple[Array, Array]:
        """The series of C and W."""
        start = self.curve.jet(t, order)
        way = -start
        way[0] += self.point_a
        return start, way


def value(f: Expression, x: Array) -> Array:
    """The series of f at the points x (K + 1, n, 3)."""
    with np.errstate(all="ignore"):
        return f.series(x=x[..., 0], y=x[..., 1], z=x[..., 2])


def slope(f: Expression, x: Array, along: Array) -> Array:
    """The series of <grad f, along> at x, (K + 1, n, 3) each, by Kronecker's substitution."""
    return value(f, np.concatenate([x, HUGE * along]))[len(x) :] / HUGE


@dataclass(frozen=True, slots=True)
class CurveSecant:
    """The lines from C(t) meet the curve again at D = C(u).

    ``axis`` is the normal of the curve's plane, or any direction across a space curve. Past the
    ends of a closed curve u goes on, a ``period`` further; 0 for an open one.
    """

    curve: Curve
    point_a: Array
    axis: Array
    period: float
    marks: tuple[float, ...]
    reach: float

    def looks(self, t: Array) -> Array:
        """As Secant."""
        if self.period:
            share = (np.arange(LOOKS + 1) - 0.5) / LOOKS  # once round, through C itself
            return np.asarray(t + self.period * share[:, None])
        return np.repeat(np.linspace(*self.curve.domain, LOOKS)[:, None], len(t), axis=1)

    def residual(self, t: Array, u: Array) -> Array:
        """The distance of C(u) from the line, over u - t (or a sine that vanishes with it)."""
        order = len(u) - 1
        start, way = self._line(t, order)
        step = self._step(u[0] - t)
        near = self._near(t, step)
        far = np.logical_not(near)
        out = np.empty_like(u)
        chord = self.point(t[far], u[:, far]) - start[:, far]
        out[:, far] = self._across(chord, way[:, far]) * self._scale(t, u[0])[far]
        if near.any():
            gap = u[:, near] - taylor.variable(t[near], order)
            gap[0] = step[near]
            mean = self._mean(t[near], gap, way[:, near])
            out[:, near] = self._turns(t[near], u[0, near]) * mean
        return out

    def _mean(self, t: Array, gap: Array, way: Array) -> Array:
        """The mean of <axis, C' cross W> over the parameters from t to t + gap."""
        order = len(gap) - 1
        total = np.zeros_like(gap)
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            place = taylor.variable(t, order) + node * gap
            velocity = taylor.derivative(self.curve.jet(self.inside(place[0]), order + 1))
            total += weight * self._across(taylor.compose(velocity, place), way)
        return total

    def slope(self, t: Array, u: Array) -> Array:
        """As Secant."""
        _, way = self._line(t, 0)
        step = self._step(u - t)
        near = self._near(t, step)
        far = np.logical_not(near)
        out = np.zeros_like(u)
        velocity = self.curve.jet(self.inside(u[far]), 1)[1:]
        out[far] = self._across(velocity, way[:, far])[0] * self._scale(t, u)[far]
        start, gap = t[near], step[near]
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            bend = 2.0 * self.curve.jet(self.inside(start + node * gap), 2)[2:]
            out[near] += weight * node * self._across(bend, way[:, near])[0]
        out[near] *= self._turns(start, u[near])
        return out

    def point(self, t: Array, u: Array) -> Array:
        """As Secant."""
        return taylor.compose(self.curve.jet(self.inside(u[0]), len(u) - 1), u)

    def way(self, t: Array, u: Array) -> Array:
        """As Secant."""
        start, way = (x[0] for x in self._line(t, 0))
        chord = self.point(t, u[None])[0] - start
        lam = taylor.rows_dot(chord, way) / taylor.rows_dot(way, way)
        off = np.linalg.norm(chord - lam[:, None] * way, axis=1)
        return np.where(off <= self.reach, lam, np.nan)

    def nearest(self, u: Array, to: float) -> Array:
        """As Secant."""
        return u + self.period * np.round((to - u) / self.period) if self.period else u

    def inside(self, u: Array) -> Array:
        """The same places within the curve's domain."""
        low, high = self.curve.domain
        if not self.period:
            return np.clip(u, low, high)
        return np.where((u < low) | (u > high), low + (u - low) % self.period, u)

    def beside(self, u: Array, middle: Array) -> Array:
        """u within the domain, on the side of every mark on which ``middle`` is."""
        low, high = self.curve.domain
        room = SIDE * (high - low)
        place, cuts = self.inside(u), sorted(self.marks)
        piece = np.searchsorted(cuts, middle, side="right") - 1
        if self.period:
            piece = piece % max(len(cuts), 1)
        for j, mark in enumerate(cuts):
            after, near = piece == j, np.abs(place - mark) < room
            right = np.maximum(place, mark)
            left = np.minimum(place, np.nextafter(mark, -np.inf))
            if mark == low:  # the seam: before it is the other end
                near |= high - place < room
                right, left = np.full_like(place, low), np.full_like(place, high)
            place = np.where(near, np.where(after, right, left), place)
        return place

    def _line(self, t: Array, order: int) -> tuple[Array, Array]:
        start = self.curve.jet(t, order)
        way = -start
        way[0] += self.point_a
        return start, way

    def _across(self, x: Array, way: Array) -> Array:
        """The series of <axis, x cross W>."""
        a, b, c = np.moveaxis(taylor.cross(x, way), -1, 0)
        return np.asarray(self.axis[0] * a + self.axis[1] * b + self.axis[2] * c)

    def _step(self, away: Array) -> Array:
        """u - t by the shorter way round."""
        return away - self.period * np.round(away / self.period) if self.period else away

    def _near(self, t: Array, step: Array) -> npt.NDArray[np.bool_]:
        """Where D is near C and no mark lies between the two."""
        width = self.curve.domain[1] - self.curve.domain[0]
        near = np.abs(step) < NEAR_ON_CURVE * width
        for mark in self.marks:
            for shift in (-self.period, 0.0, self.period):
                near &= (mark + shift - t) * (mark + shift - t - step) > 0.0
        return near

    def _turns(self, t: Array, u: Array) -> Array:
        """-1 where the sine has been through an odd number of its zeros, else 1."""
        odd = np.round((u - t) / self.period) % 2 if self.period else np.zeros_like(t)
        return np.where(odd, -1.0, 1.0)

    def _scale(self, t: Array, u: Array) -> Array:
        """1 / (u - t), or of the sine in its place."""
        with np.errstate(divide="ignore"):
            if not self.period:
                return 1.0 / (u - t)
            share = math.pi / self.period
            return share / np.sin(share * (u - t))


def curve_secant(curve: Curve, point_a: Array, size: float) -> CurveSecant:
    """The lines through A of a curve; ``size`` is that of the curve and A."""
    points = curve.point(np.linspace(*curve.domain, 257)) - point_a
    axis = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][-1]
    low, high = curve.domain
    marks = [*curve.breaks, *curve.corners]
    if curve.closed and not _periodic(curve, size):
        marks.append(low)
    period = high - low if curve.closed else 0.0
    return CurveSecant(curve, point_a, axis, period, tuple(marks), 1e-7 * size)


def _periodic(curve: Curve, size: float) -> bool:
    """Whether a closed curve goes on smoothly through its ends."""
    low, high = curve.domain
    ends = curve.jet(np.array([low, high]), 4) * (high - low) ** np.arange(5.0)[:, None, None]
    return bool(np.abs(ends[:, 0] - ends[:, 1]).max() <= PERIODIC * size)
