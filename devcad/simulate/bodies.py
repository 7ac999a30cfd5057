"""The links of a mechanism as arcs in the cross-section, and their poses as plane motions.

The cross-section is the plane of complex numbers, the axis of the reference cylinder at 0. In the
conformal pose every link lies on that cylinder. In any other a link has turned by some angle, and
the axis of its own cylinder, which was at 0, has moved to its ``shift``: so a point of it that was
at rho exp(i psi) is at shift + rho exp(i (psi + turn)).
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.linkage import Linkage
from devcad.geometry.taylor import Array

Complex = NDArray[np.complex128]
Flags = NDArray[np.bool_]

EDGE = 1e-11
"""Radians: a direction nearer than this to the end of an arc is not inside of it."""


@dataclass(frozen=True, slots=True)
class Arc:
    """A link: the arc from joint ``first`` to joint ``last``, which begins at the angle ``start``
    and goes through ``sweep`` radians, counterclockwise if positive, at its own middle radius
    (mm). ``bands`` are the intervals (mm) along the axis that it fills, ``half`` is half its
    thickness, ``beyond`` the radians of sheet beyond its first and its last joint, ``hinge`` how
    far in mm its hinges reach from their axes."""

    first: int
    last: int
    start: float
    sweep: float
    radius: float
    bands: tuple[tuple[float, float], ...] = ()
    half: float = 0.0
    beyond: tuple[float, float] = (0.0, 0.0)
    hinge: float = 0.0

    def holds(self, angle: Array, *, ears: bool = False) -> Flags:
        """Whether directions (n,), in the link's own frame, lie inside the arc between its joints,
        or inside all of the link."""
        before, after = self.beyond if ears else (0.0, 0.0)
        sign = 1.0 if self.sweep >= 0.0 else -1.0
        along = np.mod(sign * (angle - self.start) + before, 2.0 * np.pi)
        total = abs(self.sweep) + before + after
        return np.asarray((along > EDGE) & (along < total - EDGE))


def arcs_of(linkage: Linkage) -> tuple[Arc, ...]:
    """The links of a linkage, in their order. Ears that are curled round a pin are none here."""
    flat = linkage.hinge == "hole"
    half = 0.5 * linkage.thickness
    return tuple(
        Arc(
            link.first,
            link.last,
            linkage.joints[link.first],
            link.sweep,
            link.radius,
            link.band,
            half,
            link.overhang if flat else (0.0, 0.0),
            max(link.overhang) * link.radius + abs(link.radius - linkage.radius) + half,
        )
        for link in linkage.links
    )


def joints_of(linkage: Linkage) -> tuple[complex, ...]:
    """The joints in the conformal pose, mm."""
    return tuple(linkage.radius * cmath.exp(1j * angle) for angle in linkage.joints)


@dataclass(frozen=True, slots=True)
class Poses:
    """m poses of n links: ``turns`` (m, n) radians and ``shifts`` (m, n) mm against the conformal
    pose, and the ``joints`` (m, n) in mm; nan where the linkage does not close."""

    turns: Array
    shifts: Complex
    joints: Complex


@dataclass(frozen=True, slots=True)
class Twists:
    """How the links begin to move from the conformal pose, each (n,): radians a radian of the
    input, and the speed (mm a radian) of the point of each that lies on the axis."""

    turning: Array
    axis: Complex

    @property
    def centres(self) -> Complex:
        """The instant centres (n,) in mm; not finite for a link that does not turn."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(1j * self.axis / self.turning)


class Drive(Protocol):
    """What moves a mechanism with one degree of freedom: the input's turn x in radians, 0 in the
    conformal pose."""

    @property
    def pivots(self) -> tuple[int, ...]:
        """The joints that stand."""

    @property
    def moving(self) -> tuple[int, ...]:
        """The links that move."""

    @property
    def reach(self) -> tuple[float, float]:
        """How far x can go back (<= 0) and on (>= 0)."""

    @property
    def ends(self) -> tuple[str, str]:
        """What stops it there."""

    def poses(self, x: Array) -> Poses:
        """The poses at x (m,)."""

    def twists(self) -> Twists:
        """The first-order motion in the conformal pose."""


def less_one(angle: Array) -> Complex:
    """exp(i angle) - 1 to full relative accuracy."""
    return np.asarray(2j * np.sin(0.5 * angle) * np.exp(0.5j * angle))


def turned_about(angle: Array, pivot: Complex | complex) -> Complex:
    """Where the point that was at 0 is after a turn about a pivot."""
    return np.asarray(-less_one(angle) * pivot)
