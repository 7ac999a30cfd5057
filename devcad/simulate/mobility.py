"""Whether links leave the reference cylinder, or enter it, when a mechanism begins to move.

Extramobile: all moving links stay outside the cylinder on which they lie in the conformal pose;
intramobile: all stay inside. The terms are those of Greenwood and others, whose definitions were
read in abstracts only; the tests are ours. Points of the joints' arcs are looked at, not the ears
that stand over beyond them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bodies import Arc, Complex, Drive, Flags, Poses, Twists
from devcad.simulate.search import first_failure

Side = Literal["out", "in", "across", "still"]
Mobility = Literal["extramobile", "intramobile", "both", "none"]

NOTHING = 1e-11
"""Of a radius: a distance below it is none. Shifts are known to 1e-12 where they begin."""
FIRST = 1e-4
"""Radians of the input, where a motion is looked at first: a range below it is none."""


@dataclass(frozen=True, slots=True)
class Departure:
    """How a link begins to move when the input turns counterclockwise: the least and the largest
    radial speed on its arc, mm a radian of the input, and to which side that takes the link;
    "across": a part of it to either side. ``centre`` is the instant centre, None where the link
    only shifts."""

    least: float
    largest: float
    side: Side
    centre: complex | None


def departures(arcs: Sequence[Arc], twists: Twists) -> tuple[Departure, ...]:
    """The first-order motion of every link against the reference cylinder.

    A point in the direction psi has the radial speed Re(conj(w) exp(i psi)), w the speed of the
    link's point on the axis: w = -i omega I with the instant centre I. So a link goes to one side
    where the line from the axis to I does not cut its arc.

    Source: geometry.md, 7.
    """
    out = []
    for arc, turning, axis, centre in zip(
        arcs, twists.turning.tolist(), twists.axis.tolist(), twists.centres.tolist(), strict=True
    ):
        speed = abs(axis)
        still = not speed > NOTHING * arc.radius
        low, high = (0.0, 0.0) if still else _extremes(arc, axis)
        known = None if still or not abs(turning) * 1e9 > speed / arc.radius else complex(centre)
        out.append(Departure(low, high, _side(low, high, speed, still), known))
    return tuple(out)


def _side(low: float, high: float, speed: float, still: bool) -> Side:
    if still:
        return "still"
    if low >= -1e-9 * speed:
        return "out"
    return "in" if high <= 1e-9 * speed else "across"


def _extremes(arc: Arc, axis: complex) -> tuple[float, float]:
    """The least and the largest of Re(conj(axis) exp(i psi)) on an arc."""
    ends = np.exp(1j * np.array([arc.start, arc.start + arc.sweep]))
    found = list((np.conj(axis) * ends).real)
    along = np.angle(np.array([-axis, axis]))
    found += [
        sign * abs(axis)
        for sign, inside in zip((-1.0, 1.0), arc.holds(along), strict=True)
        if inside
    ]
    return float(min(found)), float(max(found))


# --- along the motion -----------------------------------------------------------------------


def clearances(arcs: Sequence[Arc], drive: Drive, poses: Poses) -> tuple[Array, Array]:
    """The least and the largest radial distance (m, n) in mm of each link from its own cylinder as
    it lay in the conformal pose: exact extremes over the arc, no samples of it."""
    low, high = np.zeros(poses.turns.shape), np.zeros(poses.turns.shape)
    for k in drive.moving:
        arc, shift, turn = arcs[k], poses.shifts[:, k], poses.turns[:, k]
        apart = np.abs(shift)
        ends = [_off(arc, shift, arc.start + part * arc.sweep + turn) for part in (0.0, 1.0)]
        near, far = np.minimum(*ends), np.maximum(*ends)
        with np.errstate(invalid="ignore"):
            away = np.angle(shift) - turn
            near = np.where(arc.holds(away + np.pi), np.abs(apart - arc.radius) - arc.radius, near)
            far = np.where(arc.holds(away), apart, far)
        low[:, k], high[:, k] = near, far
    return low, high


def _off(arc: Arc, shift: Complex, direction: Array) -> Array:
    """How far points of a shifted circle are from its first place, radially."""
    along = (shift.conj() * np.exp(1j * direction)).real
    squares = np.abs(shift) ** 2 + 2.0 * arc.radius * along
    far = np.abs(shift + arc.radius * np.exp(1j * direction)) + arc.radius
    return np.asarray(squares / far)


def stays(arcs: Sequence[Arc], drive: Drive, poses: Poses, *, outside: bool) -> Flags:
    """Whether all moving links are outside (inside) of the cylinder, (m,); True where none moved.

    The sign of |shift| + 2 rho cos(angle between shift and point) at both ends of each arc, a joint
    that stands left out, and at the point of the arc that is nearest (furthest). Divided by the
    shift as it is, that is of the size of rho from the first instant on.
    """
    sign = 1.0 if outside else -1.0
    good = np.ones(len(poses.turns), dtype=bool)
    for k in drive.moving:
        arc, shift, turn = arcs[k], poses.shifts[:, k], poses.turns[:, k]
        apart = np.abs(shift)
        moved = apart > 1e-13 * arc.radius
        with np.errstate(invalid="ignore", divide="ignore"):
            away = np.where(moved, shift / np.where(moved, apart, 1.0), 0.0)
            worst = np.full(len(good), np.inf)
            for joint, part in ((arc.first, 0.0), (arc.last, 1.0)):
                if joint not in drive.pivots:
                    point = np.exp(1j * (arc.start + part * arc.sweep + turn))
                    height = apart + 2.0 * arc.radius * (away.conj() * point).real
                    worst = np.minimum(worst, sign * height)
            nearest = np.angle(-sign * away) - turn
            extreme = sign * apart - 2.0 * arc.radius
            # a link that stands on its pivot there turns in or out as the square of a turn
            extreme = np.where(extreme < 1e-12 * arc.radius, -np.inf, extreme)
            worst = np.where(arc.holds(nearest), np.minimum(worst, extreme), worst)
        good &= ~moved | (worst >= -NOTHING * arc.radius)
    return good


def ranges(
    arcs: Sequence[Arc], drive: Drive, reach: tuple[float, float]
) -> dict[tuple[int, str], float]:
    """How far the input can turn from the conformal pose, radians (>= 0), until a link enters or
    leaves the cylinder: by direction (-1, 1) and side ("outside", "inside"); 0 where that is less
    than 1e-4, the reach where no link does. To 1e-10, as ``first_failure``."""
    out: dict[tuple[int, str], float] = {}
    for sign, end in zip((-1, 1), reach, strict=True):
        for side in ("outside", "inside"):

            def holds(x: Array, sign: int = sign, side: str = side) -> Flags:
                return stays(arcs, drive, drive.poses(sign * x), outside=side == "outside")

            start = min(FIRST, 0.5 * abs(end))
            found = first_failure(holds, abs(end), start=start)
            out[sign, side] = found if found > start else 0.0
    return out


def mobility(found: dict[tuple[int, str], float]) -> Mobility:
    """What a mechanism can do from its conformal pose, turned one way or the other."""
    outside = max(found[-1, "outside"], found[1, "outside"]) > 0.0
    inside = max(found[-1, "inside"], found[1, "inside"]) > 0.0
    if outside and inside:
        return "both"
    return "extramobile" if outside else "intramobile" if inside else "none"


def first_order(found: Sequence[Departure]) -> Mobility | Literal["undecided"]:
    """The same to first order: all links to one side when the input turns one way means all to the
    other when it turns back. A link that does not depart to first order leaves it undecided."""
    sides = {departure.side for departure in found} - {"still"}
    if sides in ({"out"}, {"in"}):
        return "both"
    return "none" if sides else "undecided"
