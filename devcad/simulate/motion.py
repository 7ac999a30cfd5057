"""The motion of a mechanism in a cylinder: what it can do from its conformal pose.

The input turns about its pivot by x radians, 0 in the conformal pose, counterclockwise positive
seen from the axis' tip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from devcad.geometry.linkage import Linkage
from devcad.geometry.taylor import Array
from devcad.simulate.bodies import Arc, Complex, Drive, arcs_of, joints_of
from devcad.simulate.clash import Clash, clash, meet
from devcad.simulate.drives import FourBarDrive, RingDrive, four_bar, ring
from devcad.simulate.fourbar import transmission
from devcad.simulate.mobility import (
    Departure,
    clearances,
    departures,
    first_order,
    mobility,
    ranges,
)

LIVING = "living"
RING = (
    "{n} links in a ring have {dof} degrees of freedom in their plane; the motion shown is the one "
    "that keeps the {fold}-fold symmetry: every other joint stays on its ray, the links turn one "
    "way and the other in turn, and the ring is held at its axis, not at a link"
)
FREE = (
    "{n} links in a ring have {dof} degrees of freedom in their plane; no motion is computed: the "
    "joints do not repeat after every second one, so there is no symmetric motion of one degree"
)
STIFF = "three links do not move: a triangle"
CHANGE = (
    "a change-point linkage: where all joints lie in line it may go on in two ways; the range ends "
    "there"
)


@dataclass(frozen=True, slots=True)
class Direction:
    """What happens when the input turns one way, in radians (>= 0) from the conformal pose.

    ``reach`` is where it stops and ``end`` what stops it; ``outside`` and ``inside`` are how far
    all moving links stay outside and inside of the cylinder; ``clash`` the first two links that
    run into each other.
    """

    sign: int
    reach: float
    end: str
    outside: float
    inside: float
    clash: Clash | None

    @property
    def free(self) -> float:
        """How far it can turn until a toggle or a clash, radians, signed."""
        return self.sign * (self.reach if self.clash is None else self.clash.angle)


@dataclass(frozen=True, slots=True)
class Motion:
    """A linkage with what drives it, None where it has no motion of one degree of freedom.

    ``directions`` are clockwise and counterclockwise, ``departures`` one for each link,
    ``overlaps`` the links that lie over each other in one band in the conformal pose, and then do
    not count as clashes on the way.
    """

    linkage: Linkage
    arcs: tuple[Arc, ...]
    drive: FourBarDrive | RingDrive | None
    directions: tuple[Direction, ...] = ()
    departures: tuple[Departure, ...] = ()
    mobility: str = "none"
    first_order: str = "none"
    overlaps: tuple[tuple[int, int], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def freedom(self) -> int:
        """The degrees of freedom in the plane, one link held: n - 3."""
        return len(self.arcs) - 3

    @property
    def whole(self) -> bool:
        """Whether the input goes all the way round, and nothing is in its way."""
        return bool(self.directions) and all(
            way.end == "whole turn" and way.clash is None for way in self.directions
        )

    def stretch(self) -> tuple[float, float]:
        """The turns of the input, from and to, that outputs show: a turn, or from stop to stop."""
        if self.whole:
            return -math.pi, math.pi
        back, on = (way.free for way in self.directions)
        if on - back > 2.0 * math.pi:
            return max(back, -math.pi), max(back, -math.pi) + 2.0 * math.pi
        return back, on


@lru_cache(maxsize=8)
def motion(linkage: Linkage) -> Motion:
    """The motion of a linkage.

    A four-bar moves on the branch of its conformal pose (Freudenstein), a ring whose links repeat
    after every second one symmetrically, which the notes say; of others the degrees of freedom are
    told and no more.

    Raises:
        GeometryError: links without length, or such as do not close.
    """
    arcs, joints = arcs_of(linkage), joints_of(linkage)
    n = len(arcs)
    if n == 4:
        drive: FourBarDrive | RingDrive | None = four_bar(joints, linkage.ground)
    else:
        drive = ring(joints)
    if drive is None:
        words = STIFF if n == 3 else FREE.format(n=n, dof=n - 3)
        return Motion(linkage, arcs, None, notes=(words,))
    overlaps = meet(arcs, drive)
    found = ranges(arcs, drive, drive.reach)
    first = departures(arcs, drive.twists())
    return Motion(
        linkage,
        arcs,
        drive,
        tuple(
            Direction(
                sign,
                abs(end),
                word,
                found[sign, "outside"],
                found[sign, "inside"],
                None if overlaps else clash(arcs, drive, end),
            )
            for sign, end, word in zip((-1, 1), drive.reach, drive.ends, strict=True)
        ),
        first,
        mobility(found),
        first_order([first[k] for k in drive.moving]),
        overlaps,
        tuple(_notes(linkage, drive, overlaps)),
    )


def _notes(
    linkage: Linkage, drive: FourBarDrive | RingDrive, overlaps: tuple[tuple[int, int], ...]
) -> list[str]:
    n = len(linkage.links)
    out = []
    if isinstance(drive, RingDrive):
        out.append(RING.format(n=n, dof=n - 3, fold=n // 2))
    if "change point" in drive.ends:
        out.append(CHANGE)
    if overlaps:
        names = [f"{linkage.links[i].name} and {linkage.links[j].name}" for i, j in overlaps]
        out.append(
            f"links lie over each other in one axial band in the conformal pose: "
            f"{', '.join(names)}; clashes on the way are not looked for"
        )
    if linkage.hinge == LIVING:
        out.append(
            "the links hang together in living hinges: the motion is that of rigid links about "
            "the hinge lines"
        )
    return out


# --- samples for outputs --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Track:
    """Samples of a motion, m of them: ``turn`` (m,) of the input, ``turns`` (m, n) of the links,
    without jumps, ``shifts`` and ``joints`` (m, n) complex, the least and the largest radial
    distance ``low``, ``high`` (m,) of the moving links from the cylinder, and of a four-bar
    ``angles`` (m, 3) theta2, theta3, theta4 without jumps and ``transmission`` (m,)."""

    turn: Array
    turns: Array
    shifts: Complex
    joints: Complex
    low: Array
    high: Array
    angles: Array | None = None
    transmission: Array | None = None


def track(found: Motion, turn: Array) -> Track:
    """The poses of a motion at turns (m,) of its input, in order, as closely spaced as angles
    without jumps want it.

    Raises:
        ValueError: a linkage without a motion of one degree of freedom.
    """
    if found.drive is None:
        raise ValueError("no motion of one degree of freedom")
    drive: Drive = found.drive
    poses = drive.poses(turn)
    low, high = clearances(found.arcs, drive, poses)
    moving = list(drive.moving)
    angles = opened = None
    if isinstance(found.drive, FourBarDrive):
        angles = np.unwrap(np.stack(found.drive.angles(turn), axis=1), axis=0)
        opened = transmission(found.drive.bar, angles[:, 0])
    return Track(
        turn,
        np.unwrap(poses.turns, axis=0),
        poses.shifts,
        poses.joints,
        low[:, moving].min(axis=1),
        high[:, moving].max(axis=1),
        angles,
        opened,
    )
