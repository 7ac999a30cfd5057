"""Where a family of planes n(t).x = d(t) stands still: the zeros of n', of any order.

Near such a zero t0 the 4-vector (n', d') is its Taylor polynomial about t0 of high order; without
the power of t - t0 in it, it tells where neighbouring planes meet, to full accuracy.

Source: geometry.md, sections 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import comb

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.taylor import Array

Planes = Callable[[Array], Array]
"""The series of t (K + 1, n) to those of (n, d) (K + 1, n, 4); n may have any length but 0."""

TERMS = 48
"""Order of the expansion about a zero of n'."""
SHARE = 0.35
"""Share of the radius of convergence up to which it is used: 0.35 ** 46 drowns in rounding."""
MOST = 8
"""Highest order of a zero of n' that is passed."""
NEAR = 0.3
"""|n'| against its largest from which on no zero is looked for."""
VANISHED = 1e-10
"""A coefficient of n' that counts as 0 at a zero, against the largest |n'|."""
PRESENT = 1e-6
"""The first one that does not must exceed this."""
SAME_PLACE = 1e-9
"""A coefficient of d' that counts as 0 at a zero of n', against the largest |d'|."""
SAME_ZERO = 1e-7
"""Two zeros nearer than this share of the domain are one found twice."""
REAL = 0.05
"""The imaginary part, as a share of the reach, of a root that may be a real one."""
LOST = 1e-7
"""|n'| against its largest below which n x n' has too few digits, when it is no zero."""


@dataclass(frozen=True, slots=True)
class Zero:
    """Where n' vanishes: the order, and the series of (n', d') without the power of t - t0.

    It is used from ``low`` to ``high`` within ``reach``, as a share of the domain; ``sign`` turns
    the ruling there into the one before and after.
    """

    t: float
    order: int
    series: Array
    reach: float
    low: float
    high: float
    sign: float = 1.0


@dataclass(frozen=True, slots=True)
class Scales:
    """The largest |n'| and |d'| over the whole domain, per length of the domain, and |d|."""

    turn: float
    rise: float
    offset: float

    @property
    def motion(self) -> float:
        """What |d'| is measured against: its largest, or that of a turn about the origin."""
        return max(self.rise, self.turn * self.offset)


def unit_series(planes: Planes, t: Array, order: int, unit: float) -> Array:
    """The series of (n, d) / |n| at t in powers of t / unit, (order + 1, n, 4)."""
    variable = taylor.variable(t, order)
    if order:
        variable[1] = unit
    plane = planes(variable)
    plane = plane / np.abs(plane[0, :, :3]).max(axis=1)[None, :, None]
    length = taylor.power(taylor.dot(plane[..., :3], plane[..., :3]), -0.5)
    return taylor.mul(length, plane)


def shifted(series: Array, step: Array, order: int) -> Array:
    """The series (order + 1, n, 4), at steps (n,) away, of the one polynomial (M, 4)."""
    out = np.zeros((order + 1, len(step), series.shape[1]))
    step = step[:, None]
    for k in range(min(order, len(series) - 1) + 1):
        for j in range(len(series) - 1, k - 1, -1):  # Horner
            out[k] = out[k] * step + comb(j, k) * series[j]
    return out


@dataclass(frozen=True, slots=True)
class Search:
    """Looks for the zeros of n' on one stretch between two breaks after the other."""

    planes: Planes
    unit: float
    scales: Scales
    name: str

    def zeros(self, t: Array, size: Array) -> list[Zero]:
        """The zeros at or near the stretch sampled at t (n,) with |n'| = size, in order."""
        low, high = float(t[0]), float(t[-1])
        every = [z for at in self._anchors(t, size) for z in self._zeros_from(at, low, high)]
        found: list[Zero] = []
        for zero in sorted(every, key=lambda z: -z.order):  # a double one is no two simple ones
            if all(abs(zero.t - z.t) > self.unit * _width(z) for z in found):
                found.append(zero)
        found.sort(key=lambda zero: zero.t)
        gaps = [0.5 * (b.t - a.t) / self.unit for a, b in pairwise(found)]
        room = [min(left, right) for left, right in pairwise([np.inf, *gaps, np.inf])]
        return [replace(z, reach=min(z.reach, free)) for z, free in zip(found, room, strict=False)]

    def _anchors(self, t: Array, size: Array) -> list[float]:
        """The parameters at which |n'| is smallest among its neighbours, and small."""
        share = size / self.scales.turn
        share = np.where(share <= 1e-13, 0.0, share)  # rounding
        padded = np.concatenate([[np.inf], share, [np.inf]])
        low = (share <= padded[:-2]) & (share <= padded[2:]) & (share <= NEAR)
        places = np.flatnonzero(low)
        if not places.size:
            return []
        groups = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
        return [float(t[group[len(group) // 2]]) for group in groups]

    def _zeros_from(self, anchor: float, low: float, high: float) -> list[Zero]:
        """The zeros that the expansion at ``anchor`` shows, each told by the one at itself.

        Raises:
            GeometryError: n' all but vanishes there, and is no zero.
        """
        series = self._expansion(anchor)
        length, reach = self._measures(series, anchor)
        tries = [self._root(series, length, reach, start) for start in _starts(series, reach)]
        roots = [root for root, _ in tries if root.order]
        if roots:
            return [self._settled(anchor, root, length, reach, (low, high)) for root in roots]
        near, least = min(tries, key=lambda pair: pair[1])
        at = self._snapped(anchor + near.step * self.unit, low, high)
        if least > LOST or not low <= at <= high:
            return []
        raise GeometryError(
            f"{self.name}: the plane all but stands still at t = {at:.6g}, "
            "so the direction of its ruling is lost in rounding",
            value=least,
            limit=LOST,
            remedy="leave that place out, or give a family that turns there",
        )

    def _settled(
        self, anchor: float, root: _Root, length: float, reach: float, stretch: tuple[float, float]
    ) -> Zero:
        """The zero, expanded about itself if the stretch reaches it."""
        low, high = stretch
        for _ in range(3):
            at = self._snapped(anchor + root.step * self.unit, low, high)
            if at == anchor or not low <= at <= high:
                break
            series = self._expansion(at)
            measures = self._measures(series, at)
            again, _ = self._root(series, *measures, 0.0)
            if not again.order:
                break
            anchor, root, (length, reach) = at, again, measures
        at = self._snapped(anchor + root.step * self.unit, low, high)
        self._require_near(root, length, at)
        return Zero(at, root.order, root.series[root.order :], min(reach, 1.0), low, high)

    def _measures(self, series: Array, at: float) -> tuple[float, float]:
        """The length over which n' changes, and how far the expansion at ``at`` is used.

        Raises:
            GeometryError: there is nothing in it, for the plane stands still.
        """
        length = self._length(series)
        self._require_some(series, length, at)
        return length, SHARE * self._radius(series)

    def _snapped(self, t: float, low: float, high: float) -> float:
        """An end of the stretch where t is within rounding of it."""
        width = 1e-12 * self.unit
        return low if abs(t - low) < width else high if abs(t - high) < width else t

    def _expansion(self, at: float) -> Array:
        """The series (TERMS + 1, 4) of (n', d') at one parameter."""
        t = np.array([at])
        with np.errstate(over="ignore", invalid="ignore"):
            return taylor.derivative(unit_series(self.planes, t, TERMS + 1, self.unit))[:, 0]

    def _length(self, series: Array) -> float:
        """The length over which n' changes by as much as its largest value, at most 1."""
        sizes = np.linalg.norm(series[1:, :3], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = (self.scales.turn / sizes) ** (1.0 / np.arange(1, len(series)))
        return float(np.nanmin(lengths, initial=1.0))

    def _radius(self, series: Array) -> float:
        """The radius of convergence by the root test."""
        rise = self.scales.motion
        sizes = np.linalg.norm(series[:, :3], axis=1) / self.scales.turn
        sizes = np.maximum(sizes, np.abs(series[:, 3]) / rise if rise else 0.0)
        k = np.arange(len(series))[TERMS // 2 :]
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.nanmin((1.0 / sizes[TERMS // 2 :]) ** (1.0 / k), initial=1.0 / SHARE))

    def _root(
        self, series: Array, length: float, reach: float, start: float
    ) -> tuple[_Root, float]:
        """The zero of n' within ``reach`` of the place of an expansion, and |n'| there, looked
        for from the step ``start``.

        Where there is none: order 0, and the place where |n'| is least.
        """
        powers: Array = length ** np.arange(MOST + 1.0) / self.scales.turn
        best, least = _Root(0.0, 0, series), float(np.linalg.norm(series[0, :3])) * powers[0]
        for order in range(1, MOST + 1):
            root = _newton(series, order, powers, reach, start)
            if root is None:
                continue
            sizes = np.linalg.norm(root.series[: order + 1, :3], axis=1) * powers[: order + 1]
            if sizes[:-1].max() <= VANISHED and sizes[-1] > PRESENT:
                return root, 0.0
            if sizes[0] < least:
                best, least = replace(root, order=0), float(sizes[0])
        return best, least

    def _require_some(self, series: Array, length: float, at: float) -> None:
        """Raise a GeometryError where all of the expansion vanishes: the plane stands still."""
        powers = length ** np.arange(len(series))
        sizes = np.linalg.norm(series[:, :3], axis=1) * powers
        if sizes.max() > PRESENT * self.scales.turn:
            return
        rises = np.abs(series[:, 3]) * powers
        raise no_ruling(self.name, at, moves=bool(rises.max() > PRESENT * self.scales.motion))

    def _require_near(self, root: _Root, length: float, at: float) -> None:
        """Raise a GeometryError where n' vanishes but d' does not: the ruling is at infinity."""
        rises = np.abs(root.series[: root.order, 3]) * length ** np.arange(root.order)
        if rises.max() > SAME_PLACE * self.scales.motion:
            raise no_ruling(self.name, at, moves=True)


@dataclass(frozen=True, slots=True)
class _Root:
    """A zero of n' at a step from an expansion, its order, and the series there."""

    step: float
    order: int
    series: Array


def _width(zero: Zero) -> float:
    """How far from a zero, as a share of the domain, n' is too small to tell others from it."""
    return max(SAME_ZERO, float(VANISHED ** (1.0 / zero.order)) * zero.reach)


def _starts(series: Array, reach: float) -> list[float]:
    """Steps from which a zero may be found: none, and the real zeros of one component of n'."""
    scaled = series[:, :3] * reach ** np.arange(len(series))[:, None]
    if not np.isfinite(scaled).all():
        return [0.0]
    lead = scaled[int(np.argmax(np.linalg.norm(scaled, axis=1)))]
    roots = np.roots((scaled @ lead)[::-1])
    real = roots[(np.abs(roots) <= 1.0) & (np.abs(roots.imag) < REAL)].real * reach
    return [0.0, *np.unique(real).tolist()]


def _newton(series: Array, order: int, powers: Array, reach: float, start: float) -> _Root | None:
    """Where the coefficient before ``order`` has no part along that of ``order``, within reach."""
    step = start
    moved = shifted(series, np.array([step]), len(series) - 1)[:, 0]
    for _ in range(40):
        lead = moved[order, :3]
        square = float(lead @ lead)
        if not np.sqrt(square) * powers[order] > PRESENT:
            return None
        change = -float(moved[order - 1, :3] @ lead) / (order * square)
        step += change
        if not abs(step) <= reach:
            return None
        moved = shifted(series, np.array([step]), len(series) - 1)[:, 0]
        if abs(change) <= 1e-16:
            break
    return _Root(step, order, moved)


def no_ruling(name: str, t: float, *, moves: bool, throughout: bool = False) -> GeometryError:
    """The error of planes that do not meet in one line."""
    where = "throughout" if throughout else f"at t = {t:.6g}"
    if moves:
        return GeometryError(
            f"{name}: neighbouring planes are parallel {where}, so they meet in no ruling",
            value=t,
            limit=0.0,
            remedy="turn the planes while they move, or leave that place out",
        )
    return GeometryError(
        f"{name}: the plane stands still {where}, so no ruling is determined",
        value=t,
        limit=0.0,
        remedy="leave out where it stands still, or make that part a plane of its own",
    )
