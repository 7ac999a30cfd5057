"""Hinges along the rulings of a cylinder, as a laser cuts them: holes for a pin that is threaded
along the joint, knuckles that are curled round it, and perforations of a sheet that stays one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.errors import JobError
from devcad.geometry.constructions.base import Hole
from devcad.geometry.drawing import Drawing
from devcad.geometry.linkage import TURN, Link
from devcad.geometry.staggering import fingers
from devcad.geometry.taylor import Array

Interval = tuple[float, float]

TO_EDGE = 1.5
"""From the middle of a hole to the link's edge, in diameters: one of material beside it."""
NARROWEST = 2.0 * TO_EDGE + 2.0
"""Of a link with two holes at each joint, in diameters: as much between them too."""
APART = 2.0
"""Between the joints of a link, in diameters of its holes."""
SHORTEST = 5e-4
"""Of the longest link, along the circle: holes to match are lost in any tolerance of the part."""
BEYOND = 0.5
"""How far a notch runs beyond the edge that it crosses, as a share of the reach."""


@dataclass(frozen=True, slots=True)
class Hinge:
    """How links are joined: ``kind`` hole, tab or living; the diameter of the ``pin``, how far a
    link ``reach``-es beyond the joint, the ``clearance`` between links, the number of ``knuckles``
    of two links in one band, and the ``perforation`` (cut, bridge, width), None for a score."""

    kind: str
    pin: float
    reach: float
    clearance: float
    knuckles: int
    perforation: tuple[float, float, float] | None

    def require_room(self, radius: float, links: Sequence[Link]) -> None:
        """JobError where a link is too small for its hinges."""
        longest = radius * max(abs(link.sweep) for link in links)
        for k, link in enumerate(links):
            width, arc = link.band[0][1] - link.band[0][0], radius * abs(link.sweep)
            if self.kind != "living":
                what = f"link {k + 1} is too short for hinges beside the longest"
                _least(arc, SHORTEST * longest, "links", what)
                most = 0.5 * (radius * TURN - arc - self.clearance)
                _most(self.reach, most, "reach", f"link {k + 1} goes round onto itself")
            if self.kind == "hole":
                _least(self.reach, self.pin, "reach", "the ears end beside the holes")
                _least(width, NARROWEST * self.pin, "widths", f"link {k + 1} is too narrow")
                _least(arc, APART * self.pin, "pin", f"link {k + 1} is too short along the circle")
            elif self.kind == "tab":
                common = _common(link.band[0], links[k - 1].band[0])
                if common is None:
                    continue
                share = (common[1] - common[0]) / self.knuckles
                least = self.pin + self.clearance
                _least(share, least, "knuckles", f"those of link {k + 1} are too narrow")
                least = 2.0 * (self.reach + self.clearance)
                for number in (k, k - 1):
                    arc = radius * abs(links[number].sweep)
                    what = f"link {number % len(links) + 1} is too short for its knuckles"
                    _least(arc, least, "reach", what)
            elif self.perforation is not None:
                least = self.perforation[0] + 2.0 * self.perforation[1]
                _least(width, least, "perforation", "the links are too narrow for one cut")


def _least(value: float, limit: float, key: str, what: str) -> None:
    """JobError where a length is below its limit; rounding counts for it."""
    if value < limit * (1.0 - 1e-12):
        raise JobError(
            f"{key}: {what}: {value:.6g}, at least {limit:.6g}",
            value=value,
            limit=limit,
            remedy="give smaller hinges or larger links",
        )


def _most(value: float, limit: float, key: str, what: str) -> None:
    """JobError where a length is above its limit."""
    if value > limit:
        raise JobError(
            f"{key}: {what}: {value:.6g}, at most {limit:.6g}",
            value=value,
            limit=limit,
            remedy="give smaller hinges or a larger radius",
        )


def axis_line(layer: str, t: float, low: float, high: float) -> Drawing:
    """The ruling at t between two heights, drawn on a layer."""

    def path(u: Array) -> tuple[Array, Array, Array, Array]:
        return np.full_like(u, t), u, np.zeros_like(u), np.ones_like(u)

    return Drawing(layer, 0, path, (low, high))


def pin_holes(
    hinge: Hinge, ends: Interval, domain: Interval, band: Interval
) -> tuple[list[Hole], list[Drawing]]:
    """Two holes on each joint ruling, through which the pin is threaded in and out, and the ruling
    between them."""
    inset = TO_EDGE * hinge.pin
    low, high = band[0] + inset, band[1] - inset
    holes = [
        Hole((_share(end, domain), _share(height, band)), hinge.pin, hinge.pin)
        for end in ends
        for height in (low, high)
    ]
    half = 0.5 * hinge.pin
    return holes, [axis_line("MARK", end, low + half, high - half) for end in ends]


def knuckle_notches(
    hinge: Hinge,
    end: float,
    outward: float,
    domain: Interval,
    band: Interval,
    neighbour: Link,
    *,
    first: bool,
) -> tuple[list[Hole], list[Drawing]]:
    """The notches that let the neighbour's knuckles in, and the joint ruling across the own ones.

    ``outward`` is the angle of a unit of length beyond the joint at the angle ``end``. Where both
    links lie in one band they take turns along it, beginning with the ``first``, by whose last
    joint it is; elsewhere the knuckle is as wide as the link.
    """
    common = _common(band, neighbour.band[0])
    if common is None:
        return [], [axis_line("MARK", end, *band)]
    inward, beyond = hinge.reach + hinge.clearance, (1.0 + BEYOND) * hinge.reach
    at = _share(end + 0.5 * (beyond - inward) * outward, domain)
    notches, own = [], band[0]
    drawn: list[Drawing] = []
    for k, (a, b) in enumerate(fingers(*common, hinge.knuckles)):
        if (k % 2 == 0) is first:
            continue
        a, b = a - 0.5 * hinge.clearance, b + 0.5 * hinge.clearance
        # at an edge of the link as far beyond it as within
        middle = band[0] if a <= band[0] else band[1] if b >= band[1] else 0.5 * (a + b)
        half = max(b - middle, middle - a)
        notches.append(
            Hole((at, _share(middle, band)), 2.0 * half, inward + beyond, square=True, notch=True)
        )
        if a > own:
            drawn.append(axis_line("MARK", end, own, a))
        own = b
    if own < band[1]:
        drawn.append(axis_line("MARK", end, own, band[1]))
    return notches, drawn


def living_holes(perforation: tuple[float, float, float], at: float, band: Interval) -> list[Hole]:
    """A row of slots along the ruling at the share ``at`` of t: as many cuts as leave a bridge
    between them and at both ends."""
    cut, bridge, width = perforation
    count = int((band[1] - band[0] - bridge) * (1.0 + 1e-12) // (cut + bridge))
    first = 0.5 * (band[0] + band[1]) - 0.5 * (count - 1) * (cut + bridge)
    return [
        Hole((at, _share(first + k * (cut + bridge), band)), max(cut, width), width)
        for k in range(count)
    ]


def _common(one: Interval, other: Interval) -> Interval | None:
    """What two intervals have in common, None where that has no length."""
    low, high = max(one[0], other[0]), min(one[1], other[1])
    return (low, high) if low < high else None


def _share(value: float, interval: Interval) -> float:
    return (value - interval[0]) / (interval[1] - interval[0])
