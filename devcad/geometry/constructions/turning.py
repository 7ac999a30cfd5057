"""The rulings of a family of planes n(t).x = d(t), also where the plane stands still for a moment.

A ruling is where neighbouring planes meet: n.x = d and n'.x = d', with n of unit length, so its
direction is n x n' and its point nearest the origin d n + (d'/|n'|^2) n'. Both depend on the
4-vector (n', d') up to a factor only, so that where n' vanishes the power of t in it may be left
out (``standstill``).

Source: geometry.md, sections 3 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import Extent, Rays, strip
from devcad.geometry.constructions.sampling import SAMPLES
from devcad.geometry.constructions.standstill import (
    Planes,
    Scales,
    Search,
    Zero,
    no_ruling,
    shifted,
    unit_series,
)
from devcad.geometry.curve import Curve
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

PARALLEL = 1e-9
"""Turning of the plane over the whole domain, in radians, below which it does not turn."""
SAME_RULING = 1e-9
"""Two unit rulings on the two sides of a break that differ by less are one."""
SAME_RATE = 1e-9
"""Two derivatives at a break that differ by less, against their largest, are one."""


@dataclass(frozen=True, slots=True)
class Turning:
    """The rulings of a family of planes over ``knots``, its ends and breaks.

    ``backward`` are the parameters at which n x n' goes over into the opposite direction: the
    ruling keeps its own there, as it is continuous; the planes turn back.
    """

    planes: Planes
    knots: Array
    zeros: tuple[Zero, ...] = ()
    backward: tuple[float, ...] = ()

    @property
    def stops(self) -> list[float]:
        """The parameters in the domain at which n' vanishes."""
        return [z.t for z in self.zeros if z.low <= z.t <= z.high]

    def rays(self, t: Array, order: int) -> tuple[Array, Array]:
        """The series of the ruling's point nearest the origin and of its direction, (K + 1, n, 3).

        The direction is unit(n x n') at the start and continuous after it.
        """
        plane, rate, sign = self._deflated(t, order)
        n, d, turn = plane[..., :3], plane[..., 3], rate[..., :3]
        rise = taylor.div(rate[..., 3], taylor.dot(turn, turn))
        foot = taylor.mul(d, n) + taylor.mul(rise, turn)
        e = sign[:, None] * taylor.unit(taylor.cross(n, turn))
        units = np.ptp(self.knots) ** -np.arange(order + 1.0)[:, None, None]
        return units * foot, units * e

    def _deflated(self, t: Array, order: int) -> tuple[Array, Array, Array]:
        """(n, d), and (n', d') without its zeros, in powers of t over the domain's length; and
        the sign of the ruling."""
        unit = float(np.ptp(self.knots))
        plane = unit_series(self.planes, t, order + 1, unit)
        rate = taylor.derivative(plane)
        sign = np.where(np.searchsorted(self.backward, t, side="right") % 2, -1.0, 1.0)
        for zero in self.zeros:
            step = (t - zero.t) / unit
            near = (np.abs(step) < zero.reach) & (t >= zero.low) & (t <= zero.high)
            rate[:, near] = shifted(zero.series, step[near], order)
            sign[near] = zero.sign
        return plane[: order + 1], rate, sign


def turning(planes: Planes, knots: Array, name: str) -> Turning:
    """The rulings of a family of planes over the domain whose ends and breaks are ``knots``.

    ``name`` is the key that errors speak of. Not checked: the planes are finite and n is not 0.

    Raises:
        GeometryError: the plane stands still in an interval, or changes without turning; or the
            ruling jumps at a break.
    """
    unit = float(np.ptp(knots))
    each = max(33, SAMPLES // (len(knots) - 1))
    runs = [_inside(low, high, each, last=high == knots[-1]) for low, high in pairwise(knots)]
    samples = [unit_series(planes, t, 1, unit) for t in runs]
    sizes = [np.linalg.norm(s[1, :, :3], axis=1) for s in samples]
    scales = Scales(
        float(max(size.max() for size in sizes)),
        float(max(np.abs(s[1, :, 3]).max() for s in samples)),
        float(max(np.abs(s[0, :, 3]).max() for s in samples)),
    )
    _require_turn(scales, name, knots)
    search = Search(planes, unit, scales, name)
    found: list[Zero] = []
    for t, size in zip(runs, sizes, strict=True):
        found += search.zeros(t, size)
    zeros, backward, sign = [], [], 1.0
    for zero in found:
        power = (-1.0) ** zero.order
        if zero.low < zero.t < zero.high and power < 0.0:
            sign, power = -sign, 1.0
            backward.append(zero.t)
        before = zero.t <= zero.low
        zeros.append(replace(zero, sign=sign if before or zero.t < zero.high else sign * power))
    return _through_breaks(Turning(planes, knots, tuple(zeros), tuple(backward)), name)


def _inside(low: float, high: float, number: int, *, last: bool) -> Array:
    """Increasing parameters over a stretch; before a break the last is one rounding before it."""
    t = np.linspace(low, high, number)
    t[-1] = high if last else np.nextafter(high, low)
    return t


def _require_turn(scales: Scales, name: str, knots: Array) -> None:
    """Raise a GeometryError where the plane does not turn anywhere."""
    if scales.turn > PARALLEL:
        return
    moves = scales.rise > PARALLEL * scales.offset
    raise no_ruling(name, float(knots[0]), moves=moves, throughout=True)


def _through_breaks(found: Turning, name: str) -> Turning:
    """The same with the ruling continuous through the breaks.

    Raises:
        GeometryError: it jumps at a break by more than its orientation.
    """
    after = found.knots[1:-1]
    if not after.size:
        return found
    before = np.nextafter(after, found.knots[0])
    left, right = found.rays(before, 0)[1][0], found.rays(after, 0)[1][0]
    turned = np.einsum("ni,ni->n", left, right) < 0.0
    jump = np.linalg.norm(left - np.where(turned, -1.0, 1.0)[:, None] * right, axis=1)
    worst = int(np.argmax(jump))
    if jump[worst] > SAME_RULING:
        raise GeometryError(
            f"{name}: the ruling turns at once by {np.degrees(jump[worst]):.3g} deg "
            f"at t = {after[worst]:.6g}",
            value=float(jump[worst]),
            limit=SAME_RULING,
            remedy="make the second derivatives continuous there, or end the surface there",
        )
    more = after[turned].tolist()
    zeros = tuple(
        replace(z, sign=z.sign * (-1.0) ** sum(t <= z.low for t in more)) for z in found.zeros
    )
    return replace(found, zeros=zeros, backward=tuple(sorted([*found.backward, *more])))


def strips(found: Turning, base: Curve, rays: Rays, extent: Extent) -> tuple[Patch, ...]:
    """The patches along the rays: one, or several where an edge of it would have a corner.

    Across a break the ruling is continuous but may begin to turn at another rate: a new patch
    begins there, with the same tangent plane.
    """
    after = found.knots[1:-1]
    before = np.nextafter(after, found.knots[0])
    corners: list[float] = []
    if after.size:
        (c0, e, _), (d0, f, _) = rays(before, 1), rays(after, 1)
        rate = np.linalg.norm(c0[1], axis=1).max(initial=0.0)
        spin = np.linalg.norm(e[1], axis=1).max(initial=0.0)
        jumps = np.linalg.norm(c0[1] - d0[1], axis=1) > SAME_RATE * rate
        jumps |= np.linalg.norm(e[1] - f[1], axis=1) > SAME_RATE * spin
        corners = after[jumps].tolist()
    whole = replace(
        base, breaks=tuple(t for t in base.breaks if t not in corners), corners=tuple(corners)
    )
    return tuple(_one_sided(piece, rays, extent, found.knots[-1]) for piece in whole.pieces())


def _one_sided(piece: Curve, rays: Rays, extent: Extent, last: float) -> Patch:
    """The patch over a piece whose rays at its end are those just before it."""
    low, high = piece.domain
    top = high if high == last else float(np.nextafter(high, low))
    return strip(piece, lambda t, order: rays(np.clip(t, low, top), order), extent)
