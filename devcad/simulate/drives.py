"""What drives a mechanism: of a four-bar the turn of its input, of a ring that of link 0."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bodies import Complex, Poses, Twists, less_one, turned_about
from devcad.simulate.fourbar import EQUAL, FourBar, grashof, positions, reach_from, speeds, wrapped

REGULAR = 1e-9
"""Of the radius: joints of a ring that are off the regular order by less are in it."""
STEP = 1e-6
"""Radians, of a central difference: its error is STEP^2, rounding adds 1e-10."""


@dataclass(frozen=True, slots=True)
class FourBarDrive:
    """A four-bar whose joints in the conformal pose are ``joints`` (complex, mm); link k joins the
    joints k and k + 1. ``ground`` stands, the link after it is the input, then come the coupler
    and the output. ``branch`` is that of the conformal pose.

    Three distinct points of a circle are never in line: so no conformal pose is a toggle, neither
    of the input nor of the output, and its branch is never in doubt.
    """

    joints: tuple[complex, complex, complex, complex]
    ground: int
    bar: FourBar
    start: tuple[float, float, float]
    branch: int

    @property
    def order(self) -> tuple[int, int, int, int]:
        """Ground, input, coupler and output as numbers of links."""
        g = self.ground
        return g, (g + 1) % 4, (g + 2) % 4, (g + 3) % 4

    @property
    def places(self) -> tuple[complex, complex, complex, complex]:
        """The input's pivot, A, B and the output's pivot in the conformal pose."""
        p, g = self.joints, self.ground
        return p[(g + 1) % 4], p[(g + 2) % 4], p[(g + 3) % 4], p[g]

    @property
    def pivots(self) -> tuple[int, ...]:
        """The joints that stand."""
        return (self.ground + 1) % 4, self.ground

    @property
    def moving(self) -> tuple[int, ...]:
        """Input, coupler and output."""
        return self.order[1:]

    @property
    def reach(self) -> tuple[float, float]:
        """How far the input can turn back and on."""
        low, high, _ = reach_from(self.bar, self.start[0])
        return low, high

    @property
    def ends(self) -> tuple[str, str]:
        """A whole turn, a toggle, or a change point, where the motion could go on in two ways."""
        low, high, whole = reach_from(self.bar, self.start[0])
        if whole:
            return "whole turn", "whole turn"
        change = grashof(self.bar).kind == "change-point"
        return tuple(self._end(x, change) for x in (low, high))  # type: ignore[return-value]

    def _end(self, x: float, change: bool) -> str:
        sine = math.sin(self.start[0] + x)
        return "change point" if change and abs(sine) < 1e-6 else "toggle"

    def angles(self, x: Array) -> tuple[Array, Array, Array]:
        """theta2, theta3, theta4 of fourbar.py, each (m,)."""
        theta2 = self.start[0] + x
        return (theta2, *positions(self.bar, theta2, self.branch))

    def poses(self, x: Array) -> Poses:
        """The poses at x (m,); the conformal one at 0, exactly."""
        _, theta3, theta4 = self.angles(np.append(x, 0.0))
        coupler, output = wrapped(theta3 - theta3[-1])[:-1], wrapped(theta4 - theta4[-1])[:-1]
        o2, a, b, o4 = self.places
        ground, first, second, third = self.order
        turns = np.zeros((len(x), 4))
        shifts = np.zeros((len(x), 4), dtype=complex)
        joints = np.zeros((len(x), 4), dtype=complex)
        turns[:, first], turns[:, second], turns[:, third] = x, coupler, output
        stepped = less_one(x) * (a - o2)
        shifts[:, first] = turned_about(x, o2)
        shifts[:, second] = stepped + turned_about(coupler, a)
        shifts[:, third] = turned_about(output, o4)
        joints[:, first], joints[:, second] = o2, a + stepped
        joints[:, third], joints[:, ground] = b + less_one(output) * (b - o4), o4
        return Poses(turns, shifts, joints)

    def twists(self) -> Twists:
        """The first-order motion: every link turns about its instant centre."""
        coupler, output = (
            float(w[0]) for w in speeds(self.bar, np.array(self.start[:1]), self.branch)
        )
        o2, a, _, o4 = self.places
        turning = np.zeros(4)
        axis = np.zeros(4, dtype=complex)
        _, first, second, third = self.order
        turning[first], turning[second], turning[third] = 1.0, coupler, output
        axis[first] = -1j * o2
        axis[second] = 1j * (a - o2) - 1j * coupler * a
        axis[third] = -1j * output * o4
        return Twists(turning, axis)


def four_bar(joints: Sequence[complex], ground: int) -> FourBarDrive:
    """The drive of four joints in their conformal pose (mm), on the branch of that pose.

    Raises:
        GeometryError: a link has no length, or the linkage does not close.
    """
    a, b, c, d = joints
    g = ground
    o2, first, second, o4 = (joints[(g + k) % 4] for k in (1, 2, 3, 4))
    bar = FourBar(abs(o4 - o2), abs(first - o2), abs(second - first), abs(second - o4))
    along = (o4 - o2) / abs(o4 - o2)
    start = tuple(
        math.atan2(turn.imag, turn.real)
        for turn in ((first - o2) / along, (second - first) / along, (second - o4) / along)
    )
    cross = ((first - o4).conjugate() * (second - o4)).imag
    return FourBarDrive((a, b, c, d), g, bar, start, -1 if cross < 0.0 else 1)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class RingDrive:
    """A ring of n links, n even, whose joints in the conformal pose repeat after every second one:
    links of two lengths a and b in turn.

    Of its n - 3 degrees of freedom this is the motion that keeps the n / 2-fold symmetry about the
    axis: the joints 0, 2, 4, ... stay on their rays and on a circle, the others on another circle.
    Link 0 turns by x, the other even ones with it, the odd ones against it. With P0 = r and
    P2 = r exp(i gamma) the triangle P0 P1 P2 has the base rho = 2 r sin(gamma / 2), so that
    rho = a sin(beta) +- sqrt(b^2 - a^2 cos(beta)^2), beta = phi + x - gamma / 2.
    """

    joints: tuple[complex, ...]

    @property
    def pivots(self) -> tuple[int, ...]:
        """None: the ring is held at its centre."""
        return ()

    @property
    def moving(self) -> tuple[int, ...]:
        """All links."""
        return tuple(range(len(self.joints)))

    @property
    def reach(self) -> tuple[float, float]:
        """How far link 0 can turn back and on: until every other joint meets at the axis (a = b),
        or until the other links are square to the rays' base (a > b), |cos(beta)| = b/a. Where it
        is the shorter one it goes all the way round."""
        a, b, beta, _ = self._sides()
        if a < b:
            return -2.0 * math.pi, 2.0 * math.pi
        turned = abs(beta)
        if a == b:
            return -turned, turned
        least = math.acos(b / a)
        low, high = least - turned, math.pi - least - turned
        return (low, high) if beta > 0.0 else (-high, -low)

    @property
    def ends(self) -> tuple[str, str]:
        """What stops it: joints that meet at the axis, a toggle, or nothing."""
        a, b, _, _ = self._sides()
        word = "whole turn" if a < b else "joints meet" if a == b else "toggle"
        return word, word

    def _sides(self) -> tuple[float, float, float, float]:
        """a, b, the beta of the conformal pose, and 2 sin(gamma / 2)."""
        c0, c1, c2 = self.joints[:3]
        a, b = abs(c1 - c0), abs(c2 - c1)
        gamma = cmath.phase(c2 / c0)
        beta = math.remainder(cmath.phase((c1 - c0) / c0) - 0.5 * gamma, 2.0 * math.pi)
        return a, a if abs(a - b) < EQUAL * a else b, beta, 2.0 * math.sin(0.5 * gamma)

    def _two(self, x: Array) -> Complex:
        """Joints 0 and 1 at x, (2, m)."""
        c0 = self.joints[0]
        ray = c0 / abs(c0)
        a, b, beta0, sine = self._sides()
        phi = cmath.phase((self.joints[1] - c0) / ray)
        root = 1.0 if abs(c0) * sine >= a * math.sin(beta0) else -1.0
        beta = beta0 + x
        inside = b * b - (a * np.cos(beta)) ** 2
        length = np.sqrt(np.where(inside < -1e-14 * b * b, np.nan, np.maximum(inside, 0.0)))
        rho = a * np.sin(beta) + root * (length if a != b else root * a * np.sin(beta))
        p0 = rho / sine * ray
        return np.stack([p0, p0 + ray * a * np.exp(1j * (phi + x))])

    def poses(self, x: Array) -> Poses:
        """The poses at x (m,)."""
        n = len(self.joints)
        built = np.array(self.joints)
        p0, p1 = self._two(x)
        spin = (built[2] / built[0]) ** (np.arange(n) // 2)
        joints = np.where(np.arange(n) % 2 == 0, p0[:, None], p1[:, None]) * spin
        along = np.roll(joints, -1, axis=1) - joints
        turns = np.angle(along / (np.roll(built, -1) - built))
        turns[:, ::2] = x[:, None]
        shifts = joints - np.exp(1j * turns) * built
        return Poses(turns, shifts, joints)

    def twists(self) -> Twists:
        """The first-order motion, by central differences."""
        poses = self.poses(np.array([-STEP, STEP]))
        turning = (poses.turns[1] - poses.turns[0]) / (2.0 * STEP)
        return Twists(turning, (poses.shifts[1] - poses.shifts[0]) / (2.0 * STEP))


def ring(joints: Sequence[complex]) -> RingDrive | None:
    """The symmetric motion of a ring, None where the joints do not repeat after every second."""
    n = len(joints)
    p = np.array(joints)
    if n < 6 or n % 2:
        return None
    step = p[2] / p[0]
    size = float(np.abs(p).max())
    whole = abs(abs(np.angle(step)) * (n // 2) - 2.0 * np.pi) < REGULAR * n
    if not whole or np.abs(np.roll(p, -2) - p * step).max() > REGULAR * size:
        return None
    return RingDrive(tuple(complex(z) for z in joints))
