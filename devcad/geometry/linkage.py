"""Planar linkages whose joints lie on a circle: the conformal pose of a mechanism in a cylinder.

Link k of n joins joint k to joint k + 1; the last link, back to joint 0, is the ground. All
lengths are in one unit, all angles in radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np
import numpy.typing as npt

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array

ROLES = ("input", "coupler", "output", "ground")
"""The links of a four-bar, in order."""
ROUNDING = 8.0 * float(np.finfo(float).eps)
"""Sums of lengths that differ by a smaller share are equal."""
TURN = 2.0 * math.pi
HALF = 1e-12
"""Radians: a link nearer than this to half a turn spans one. Rounding of degrees is 1e-15."""
HALVINGS = 200
"""Of a bracket: more than a float has bits, counted from the smallest angle."""

STEEP = 0.7
"""Sines above it know their angle worse than a sum of angles does."""

Matrix = tuple[tuple[float, float, float, float], ...]
STANDING: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
"""The place (3, 4) of a mechanism about the z axis."""


@dataclass(frozen=True, slots=True)
class Link:
    """One link: the arc of its cylinder from joint ``first`` to joint ``last``.

    ``sweep`` is the signed angle between the two, the shorter way round; ``overhang`` the angles of
    material beyond the first and the last joint; ``band`` its intervals along the axis. ``radius``
    is that of the middle of its sheet, ``layer`` how many thicknesses that was put outwards.
    """

    name: str
    first: int
    last: int
    sweep: float
    overhang: tuple[float, float]
    band: tuple[tuple[float, float], ...]
    radius: float
    layer: float = 0.0


@dataclass(frozen=True, slots=True)
class Linkage:
    """Links round a cylinder of ``radius``, on which all joint axes lie, about the z axis of its
    ``place`` (3, 4).

    ``joints`` are angles from +x; ``branch`` says whether the polygon of the joints is "open"
    (convex) or "crossed"; ``panels`` names the panel of each link.
    """

    radius: float
    joints: tuple[float, ...]
    links: tuple[Link, ...]
    branch: str
    hinge: str
    thickness: float = 0.0
    place: Matrix = STANDING
    panels: tuple[str, ...] = ()

    @property
    def ground(self) -> int:
        """The number of the link that stands."""
        return len(self.links) - 1

    @property
    def lengths(self) -> tuple[float, ...]:
        """The distances between the joint axes of each link."""
        return tuple(chord(self.radius, link.sweep) for link in self.links)

    @property
    def grashof(self) -> bool | None:
        """Whether a link of a four-bar turns fully (no change point); None with more links."""
        if len(self.links) != len(ROLES):
            return None
        return bool(is_grashof(np.array([self.lengths]))[0])

    def scaled(self, factor: float) -> Linkage:
        """The linkage with all its lengths times ``factor``."""
        links = tuple(
            replace(
                link,
                band=tuple((factor * low, factor * high) for low, high in link.band),
                radius=factor * link.radius,
            )
            for link in self.links
        )
        return replace(
            self, radius=factor * self.radius, links=links, thickness=factor * self.thickness
        )


def chord(radius: float, sweep: float) -> float:
    """2 R |sin(sweep/2)|: the distance of two joints on the circle."""
    return 2.0 * radius * abs(math.sin(0.5 * sweep))


def sweeps_of(joints: Sequence[float]) -> tuple[float, ...]:
    """The signed angle (-pi to pi) from each joint to the next, and from the last to the first: the
    shorter way round, where both are as long the one in which the other links go."""
    turned = [math.remainder(b - a, TURN) for a, b in pairwise((*joints, joints[0]))]
    halves = [math.pi - abs(sweep) <= HALF for sweep in turned]
    rest = sum(sweep for sweep, half in zip(turned, halves, strict=True) if not half)
    way = -math.pi if rest < -HALF else math.pi
    return tuple(way if half else sweep for sweep, half in zip(turned, halves, strict=True))


def is_linkage(lengths: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Whether links of these lengths (n, k) close: the longest is below the sum of the others."""
    sides = np.asarray(lengths, dtype=float)
    total, longest = sides.sum(axis=-1), sides.max(axis=-1)
    return np.asarray(2.0 * longest < total * (1.0 - ROUNDING))


def is_grashof(lengths: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Whether shortest + longest < the sum of the other two, to rounding; lengths (n, 4)."""
    s, p, q, l = _sorted(lengths)  # noqa: E741  # Grashof's own letters
    return np.asarray(_excess(p, q, s, l) > ROUNDING * (s + p + q + l))


def open_radius(lengths: npt.ArrayLike) -> Array:
    """The radius (n,) of the circle round the convex quadrilateral of sides (n, 4), nan where there
    is none. The order of the sides does not matter. All digits hold, also where the longest is
    almost as long as the others together.

    Source: geometry.md, section 7 (Parameshvara's formula).
    """
    s, p, q, l = _sorted(lengths)  # noqa: E741
    with np.errstate(invalid="ignore", divide="ignore"):
        room = _excess(s, p, l, -q)
        bottom = (p + q + (l - s)) * (s + q + (l - p)) * (s + p + (l - q)) * room
        square = (l * q + p * s) * (l * p + q * s) * (q * p + l * s) / bottom
        return np.where(is_linkage(lengths), np.sqrt(square), np.nan)


def crossed_radius(lengths: npt.ArrayLike) -> Array:
    """The radius (n,) of the circle through the joints of the crossed quadrilateral of sides
    (n, 4), nan where there is none, that is without Grashof's condition.

    It is the convex one with the shortest side negative, here in sums of positive terms: all digits
    hold, also near a change point. That it exists exactly for Grashof
    linkages was found on random linkages, not proven. Source: geometry.md, section 7.
    """
    s, p, q, l = _sorted(lengths)  # noqa: E741
    with np.errstate(invalid="ignore", divide="ignore"):
        more = _excess(p, q, s, l)
        top = (l * (q - p) + p * (l - s)) * (l * (p - s) + s * (l - q))
        top *= l * more + (l - p) * (l - q)  # q p - l s
        bottom = (l + q + p + s) * more * ((l - q) + (p - s)) * ((l - p) + (q - s))
        closes = is_linkage(lengths) & is_grashof(lengths)
        return np.where(closes, np.sqrt(top / bottom), np.nan)


def conformal(lengths: Sequence[float], branch: str) -> tuple[float, tuple[float, ...]]:
    """The radius of the circle on which the joints of these links lie, and the signed angle that
    each link spans there, the shorter way round, the first one positive.

    ``branch`` is "open" (convex) or, for four links, "crossed". Their sum is a turn where the
    centre lies inside the polygon, else 0.

    Raises:
        GeometryError: the links do not close; a crossed pose that does not lie on a circle.
    Source:
        geometry.md, section 7. More than four links: half the arcs add up to pi, by bisection.
    """
    longest = max(range(len(lengths)), key=lengths.__getitem__)
    _require_closing(lengths, longest)
    if branch == "open":
        radius, half = _open(lengths, longest)
    else:
        radius, half = _crossed(lengths, longest)
    forward = 1.0 if half[0] > 0.0 else -1.0
    return radius, tuple(2.0 * forward * angle for angle in half)


def joints_of(sweeps: Sequence[float]) -> tuple[float, ...]:
    """The angles of the joints, the first one 0, in [0, 2 pi)."""
    return tuple(angle % TURN for angle in (0.0, *accumulate(sweeps[:-1])))


def branch_of(joints: Sequence[float]) -> str:
    """Whether the polygon of joints on a circle is "open" (convex) or "crossed"."""
    turns = [(joint - joints[0]) % TURN for joint in joints[1:]]
    rising = all(a < b for a, b in pairwise(turns))
    falling = all(a > b for a, b in pairwise(turns))
    return "open" if rising or falling else "crossed"


def _sorted(lengths: npt.ArrayLike) -> tuple[Array, Array, Array, Array]:
    s, p, q, l = np.moveaxis(np.sort(np.asarray(lengths, dtype=float), axis=-1), -1, 0)  # noqa: E741
    return s, p, q, l


def _excess(a: Array, b: Array, c: Array, d: Array) -> Array:
    """a + b - c - d to all digits, where a is near c or b near d."""
    one, lost = _difference(a, c)
    other, more = _difference(b, d)
    return np.asarray((one + other) + (lost + more))


def _difference(a: Array, b: Array) -> tuple[Array, Array]:
    """a - b, and what rounding takes from it: exact. Source: Knuth, TAOCP 2, 4.2.2."""
    found = a - b
    back = found - a
    return found, (a - (found - back)) - (b + back)


def _require_closing(lengths: Sequence[float], longest: int) -> None:
    """GeometryError where one link is as long as all others together."""
    if bool(is_linkage(lengths)):
        return
    others = sum(lengths) - lengths[longest]
    raise GeometryError(
        f"the links do not close: link {longest + 1} is {lengths[longest]:.9g} long, the others "
        f"together {others:.9g}",
        value=float(lengths[longest]),
        limit=others,
        remedy="make the longest link shorter than the sum of the others",
    )


def _open(lengths: Sequence[float], longest: int) -> tuple[float, list[float]]:
    """The radius and half the signed arcs of the convex polygon.

    With x half the arc that the longest link leaves to the others, R = longest/(2 sin x), and
    x is the sum of their half arcs; beyond a quarter turn the centre lies inside.
    """
    shares = [length / lengths[longest] for k, length in enumerate(lengths) if k != longest]
    low, high = 0.0, math.pi
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        sine = math.sin(middle)
        rest = sum(math.asin(min(share * sine, 1.0)) for share in shares) - middle
        low, high = (middle, high) if rest > 0.0 else (low, middle)
        if not low < 0.5 * (low + high) < high:
            break
    around = 0.5 * (low + high)
    radius = lengths[longest] / (2.0 * math.sin(around))
    if len(lengths) == len(ROLES):
        radius = float(open_radius(lengths))
    half = [math.asin(min(length / (2.0 * radius), 1.0)) for length in lengths]
    half[longest] = _closing(lengths[longest] / (2.0 * radius), around)
    return radius, half


def _crossed(lengths: Sequence[float], longest: int) -> tuple[float, list[float]]:
    """The radius and half the signed arcs of the crossed quadrilateral.

    The convex one's rule with the arc of the shortest link negative.
    """
    shortest = min(range(len(lengths)), key=lengths.__getitem__)
    extreme, others = lengths[shortest] + lengths[longest], sum(lengths)
    others -= extreme
    radius = float(crossed_radius(lengths))
    if not math.isfinite(radius):
        change = abs(others - extreme) <= ROUNDING * (others + extreme)
        raise GeometryError(
            "no crossed conformal pose: shortest + longest = "
            f"{extreme:.9g} is {'equal to' if change else 'above'} the sum of the other two, "
            f"{others:.9g} ({'change point: the circle is infinite' if change else 'no Grashof'})",
            value=extreme,
            limit=others,
            remedy='make shortest + longest less than the other two, or conformal = "open"',
        )
    half = [math.asin(min(length / (2.0 * radius), 1.0)) for length in lengths]
    half[shortest] = -half[shortest]
    around = sum(half) - half[longest]
    half[longest] = _closing(lengths[longest] / (2.0 * radius), around)
    return radius, half


def _closing(sine: float, around: float) -> float:
    """Half the signed arc of the longest link, whose sine is known and what the others leave; from
    the one of the two that loses no digits."""
    inside = around > 0.5 * math.pi
    size = math.asin(sine) if sine < STEEP else math.pi - around if inside else around
    return size if inside else -size
