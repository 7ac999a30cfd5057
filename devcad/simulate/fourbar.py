"""The planar four-bar: its positions, its toggles, which of its links go all the way round.

Ground from the origin along +x, of length ``ground``; the input turns about the origin, the output
about the ground's end, and the coupler joins their free ends. Angles are radians counterclockwise
from +x, at the end of a link that is nearer to the origin: theta2 of the input, theta3 of the
coupler, theta4 of the output. A branch is +1 or -1: the sense of the turn from A (input to coupler)
over the output's pivot to B (coupler to output).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array

EQUAL = 1e-12
"""Sums of lengths that differ by less than this share of the perimeter are the same."""

Kind = Literal["crank-rocker", "double-crank", "double-rocker", "triple-rocker", "change-point"]
Names = ("ground", "input", "coupler", "output")


@dataclass(frozen=True, slots=True)
class FourBar:
    """Four lengths, in one unit.

    Raises:
        GeometryError: a length is not positive, or the longest is as long as the others together.
    """

    ground: float
    input: float
    coupler: float
    output: float

    def __post_init__(self) -> None:
        for name, length in zip(Names, self.lengths, strict=True):
            if not (length > 0.0 and math.isfinite(length)):
                raise GeometryError(
                    f"the {name} has the length {length:.9g}",
                    value=length,
                    limit=0.0,
                    remedy="give four lengths above 0",
                )
        longest = max(self.lengths)
        others = math.fsum(self.lengths) - longest
        if not longest < others:
            name = Names[self.lengths.index(longest)]
            raise GeometryError(
                f"the {name} of length {longest:.9g} is not shorter than the other three links "
                f"together, {others:.9g}: the linkage does not close",
                value=longest,
                limit=others,
                remedy="shorten it, or lengthen the others",
            )

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Ground, input, coupler, output."""
        return self.ground, self.input, self.coupler, self.output


@dataclass(frozen=True, slots=True)
class Grashof:
    """``kind`` by Grashof's rule; ``excess`` = s + l - (p + q), below 0 where a link goes round;
    ``shortest`` names the shortest link. ``input_turns``, ``output_turns``: all the way round."""

    kind: Kind
    excess: float
    shortest: str
    input_turns: bool
    output_turns: bool


@dataclass(frozen=True, slots=True)
class Toggle:
    """A position in which two links lie in line: ``angle`` of the input (of the output) in radians
    in (-pi, pi], and whether the two are "extended" or "folded" upon each other."""

    angle: float
    shape: Literal["extended", "folded"]


def grashof(bar: FourBar) -> Grashof:
    """The class of a four-bar; s the shortest, l the longest length, p and q the others.

    s + l < p + q: the shortest link goes round against its neighbours, so the class is that of the
    link that is shortest (ground: double-crank; input or output: crank-rocker; coupler:
    double-rocker). s + l > p + q: no link goes round (triple-rocker). Equal, to 1e-12 of the
    perimeter: change-point; all joints can then come to lie on one line.

    Source:
        Grashof, Theoretische Maschinenlehre, 1883; Norton, Design of Machinery, 2.13.
    """
    least, first, second, most = sorted(bar.lengths)
    excess = (most - second) - (first - least)  # differences first: exact where they are equal
    shortest = Names[bar.lengths.index(least)]
    if abs(excess) <= EQUAL * math.fsum(bar.lengths):
        return Grashof("change-point", excess, shortest, *_turns(bar))
    if excess > 0.0:
        return Grashof("triple-rocker", excess, shortest, False, False)
    kinds: dict[str, Kind] = {"ground": "double-crank", "coupler": "double-rocker"}
    kind = kinds.get(shortest, "crank-rocker")
    return Grashof(
        kind, excess, shortest, shortest in ("ground", "input"), shortest in ("ground", "output")
    )


def _turns(bar: FourBar) -> tuple[bool, bool]:
    """Whether input and output of a change-point linkage go round: they meet no toggle but where
    all joints are on one line."""
    return len(reach(bar)) == 1 and _whole(bar), _whole(_mirrored(bar))


def _whole(bar: FourBar) -> bool:
    low, high = reach(bar)[0]
    return high - low >= 2.0 * math.pi


def _mirrored(bar: FourBar) -> FourBar:
    """The same linkage seen from the output: it is the input now."""
    return FourBar(bar.ground, bar.output, bar.coupler, bar.input)


def distance(bar: FourBar, theta2: Array) -> Array:
    """The distance (n,) of A from the output's pivot: f of f^2 = (a1 - a2)^2 + 4 a1 a2 sin^2."""
    root = 2.0 * math.sqrt(bar.ground) * math.sqrt(bar.input) * np.sin(0.5 * theta2)
    return np.hypot(bar.ground - bar.input, root)


def positions(bar: FourBar, theta2: Array, branch: int) -> tuple[Array, Array]:
    """theta3 and theta4, each (n,) in (-pi, pi], of one branch; nan where nothing closes.

    The roots of Freudenstein's equation K1 cos th4 - K2 cos th2 + K3 = cos(th2 - th4), that is of
    A w^2 + B w + C = 0 in w = tan(th4 / 2): its discriminant is the product of the four factors
    below up to a square, and th4 = psi + branch gamma, where psi is the direction of A from the
    output's pivot. In this form neither A = 0 nor a toggle costs digits of the loop.

    Args:
        theta2: (n,) angles of the input.
        branch: +1 or -1, as in the head of this module.
    Source:
        Freudenstein, Trans. ASME 76 (1954); geometry.md, 7.
    """
    half = np.sin(0.5 * theta2)
    x = (bar.input - bar.ground) - 2.0 * bar.input * half * half  # of A from the output's pivot
    y = bar.input * np.sin(theta2)
    f = np.hypot(x, y)
    folded = (bar.coupler - (f - bar.output)) * (bar.coupler + (f - bar.output))
    extended = (f + (bar.output - bar.coupler)) * (f + bar.output + bar.coupler)
    near = 1e-15 * (bar.ground + bar.input) * (f + bar.coupler + bar.output)
    with np.errstate(invalid="ignore"):
        gamma = 2.0 * np.arctan2(
            np.sqrt(np.where(folded < -near, np.nan, np.maximum(folded, 0.0))),
            np.sqrt(np.where(extended < -near, np.nan, np.maximum(extended, 0.0))),
        )
    theta4 = np.arctan2(y, x) + branch * gamma
    bx, by = bar.output * np.cos(theta4), bar.output * np.sin(theta4)
    return np.arctan2(by - y, bx - x), wrapped(theta4)


def freudenstein(bar: FourBar, theta2: Array) -> Array:
    """theta4 (2, n) of both branches, -1 first, in (-pi, pi]; nan where nothing closes."""
    return np.stack([positions(bar, theta2, branch)[1] for branch in (-1, 1)])


def wrapped(angle: Array) -> Array:
    """Angles in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2.0 * np.pi)


# --- toggles and reach ----------------------------------------------------------------------


def toggles(bar: FourBar) -> tuple[Toggle, ...]:
    """The positions in which coupler and output lie in line: the input cannot go on. In order.

    f = a4 + a3 (extended) or f = |a4 - a3| (folded), that is cos theta2 = (a1^2 + a2^2 - f^2) /
    (2 a1 a2), where that is a cosine. At 0 and pi there is one, elsewhere a pair.
    """
    found: list[Toggle] = []
    shapes: tuple[tuple[Literal["extended", "folded"], float], ...] = (
        ("extended", bar.coupler + bar.output),
        ("folded", abs(bar.coupler - bar.output)),
    )
    for shape, f in shapes:
        angle = _opening(bar, f)
        if angle is not None:
            sides = {angle, -angle} if 0.0 < angle < math.pi else {angle}
            found += [Toggle(side, shape) for side in sides]
    return tuple(sorted(found, key=lambda toggle: toggle.angle))


def output_toggles(bar: FourBar) -> tuple[Toggle, ...]:
    """The positions in which input and coupler lie in line, as angles theta4 of the output: its
    extremes. In order."""
    mirrored = toggles(_mirrored(bar))
    angles = (Toggle(float(wrapped(np.array(math.pi - t.angle))), t.shape) for t in mirrored)
    return tuple(sorted(angles, key=lambda toggle: toggle.angle))


def _opening(bar: FourBar, f: float) -> float | None:
    """The angle in [0, pi] of the input at which A is f away, None where it never is."""
    inner, outer = abs(bar.ground - bar.input), bar.ground + bar.input
    none = EQUAL * math.fsum(bar.lengths)  # the same two sums as in Grashof's rule
    if f < inner - none or f > outer + none:
        return None
    if f <= inner + none:
        return 0.0
    if f >= outer - none:
        return math.pi
    return 2.0 * math.atan2(
        math.sqrt((f - inner) * (f + inner)), math.sqrt((outer - f) * (outer + f))
    )


def reach(bar: FourBar) -> tuple[tuple[float, float], ...]:
    """The intervals (low, high) of theta2 in which the linkage closes: (-pi, pi) where the input
    goes all the way round, one that is symmetric about 0 or pi, or two that mirror each other.

    Positions through which two links can only just pass, change points, do not end an interval.
    """
    inner = _opening(bar, abs(bar.coupler - bar.output))
    outer = _opening(bar, bar.coupler + bar.output)
    low = 0.0 if inner is None else inner
    high = math.pi if outer is None else outer
    if low == 0.0:
        return ((-high, high),)
    if high == math.pi:
        return ((low, 2.0 * math.pi - low),)
    return ((-high, -low), (low, high))


def reach_from(bar: FourBar, theta2: float) -> tuple[float, float, bool]:
    """How far the input can turn from theta2, clockwise (<= 0) and counterclockwise (>= 0), in
    radians, and whether that is a whole turn: then both are 2 pi, and nothing stops it."""
    turn = 2.0 * math.pi
    if not toggles(bar):
        return -turn, turn, True
    if grashof(bar).kind == "change-point":
        stops = [t.angle for t in toggles(bar)]
        ahead = [(stop - theta2) % turn or turn for stop in stops]
        return -min(turn - a if a < turn else turn for a in ahead), min(ahead), False
    for low, high in reach(bar):
        for lap in (-turn, 0.0, turn):
            if low + lap <= theta2 <= high + lap:
                return low + lap - theta2, high + lap - theta2, False
    return 0.0, 0.0, False  # rounding: at a toggle


# --- what moves how fast --------------------------------------------------------------------


def transmission(bar: FourBar, theta2: Array) -> Array:
    """The angle (n,) in [0, pi] between coupler and output at B, radians; at 0 and pi the coupler
    cannot turn the output. mu of f^2 = (a3 - a4)^2 + 4 a3 a4 sin^2(mu / 2)."""
    f = distance(bar, theta2)
    low = (f - (bar.coupler - bar.output)) * (f + (bar.coupler - bar.output))
    high = (bar.coupler + bar.output - f) * (bar.coupler + bar.output + f)
    least = 4e-15 * (bar.coupler + bar.output) ** 2  # rounding: a toggle is one to the last digit
    low, high = np.where(low < least, 0.0, low), np.where(high < least, 0.0, high)
    return 2.0 * np.arctan2(np.sqrt(low), np.sqrt(high))


def transmission_extremes(bar: FourBar, low: float, high: float) -> tuple[float, float]:
    """The least and the largest transmission angle for theta2 in [low, high], radians.

    It grows with f, and f with the angle of the input away from the ground: so the extremes are at
    the ends, or at multiples of pi between them.
    """
    first, last = math.ceil(low / math.pi), math.floor(high / math.pi)
    inner = [k * math.pi for k in range(first, min(last, first + 1) + 1)]
    found = transmission(bar, np.array([low, high, *inner]))
    return float(found.min()), float(found.max())


def speeds(bar: FourBar, theta2: Array, branch: int) -> tuple[Array, Array]:
    """theta3' and theta4', each (n,): radians a radian of the input; infinite at toggles."""
    theta3, theta4 = positions(bar, theta2, branch)
    sine = np.sin(theta4 - theta3)
    with np.errstate(divide="ignore"):
        coupler = bar.input * np.sin(theta2 - theta4) / (bar.coupler * sine)
        output = bar.input * np.sin(theta2 - theta3) / (bar.output * sine)
    return coupler, output
