"""Ends of allowances that are not those of a parallel contour: square to their edge, mirrored so
that a turned flap lies on its sheet, or on the bisector of a hollow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.loops import cross, dot
from devcad.flatten.pattern import Edge
from devcad.flatten.rings import backwards
from devcad.flatten.shapes import line
from devcad.geometry.taylor import Array
from devcad.shop.corners import (
    CLOSED,
    CORNER,
    MITRE_LIMIT,
    SMOOTH,
    Joint,
    Leg,
    Links,
    Side,
    between,
    crossing,
    join,
    place,
)

End = Literal["plain", "square", "mirror", "half", "bisector"]
"""How a side's strip ends at a corner.

plain: as a parallel contour does.
square: at right angles to its edge, where its edge prolonged meets the other side's cut.
mirror: along the mirror image of the other side's cut about the edge's tangent, from that place on.
half: as mirror, with the corner's bisector instead of the other side: turned flaps meet there.
bisector: on the bisector of the void of a hollow corner.
"""


@dataclass(frozen=True, slots=True)
class Wing:
    """A side seen from the corner at the end (``last``) or at the start of its run."""

    side: Side
    last: bool

    @property
    def corner(self) -> Array:
        """The corner of the source, (2,)."""
        return np.asarray(self.side.corners[int(self.last)])

    @property
    def end(self) -> Array:
        """The parallel curve's end at the corner, (2,)."""
        return np.asarray(self.side.ends[int(self.last)])

    @property
    def ahead(self) -> Array:
        """The unit tangent along which the edge goes on over the corner, (2,)."""
        return np.asarray(self.side.tangents[1] if self.last else -self.side.tangents[0])

    @property
    def out(self) -> Array:
        """The unit normal away from the sheet, (2,)."""
        t = self.side.tangents[int(self.last)]
        return np.array([t[1], -t[0]])

    def cut(self, ray: float) -> Leg:
        """The parallel curve as a leg."""
        return self._leg(self.side.edge, self.end, ray)

    def seam(self, ray: float) -> Leg:
        """The source as a leg."""
        return self._leg(self.side.source, self.corner, ray)

    def _leg(self, edge: Edge, end: Array, ray: float) -> Leg:
        near, far = (-1, 0) if self.last else (0, -1)
        return Leg(edge, edge.u[near], edge.u[far], end, self.ahead, ray)


def turn(before: Side, after: Side) -> float:
    """The angle from one side to the next at their corner, radians, positive to the left."""
    t, w = before.tangents[1], after.tangents[0]
    return float(np.arctan2(cross(t, w), dot(t, w)))


def end_between(before: Side, after: Side, ends: tuple[End, End], kind: str, size: float) -> Joint:
    """The joint of two sides whose strips end as ``ends`` say; ``kind`` is that of plain ends.

    One of two different ends is plain. Where an edge, prolonged, meets the other side's cut only
    beyond four allowances, or not at all, the corner is a mitre; where a cut does not meet the path
    of its end, it ends square. Whether the contour then crosses itself is not looked at.

    Raises:
        GeometryError: a cut does not even meet the square end.
    """
    if ends == ("plain", "plain") or abs(np.sin(turn(before, after))) < SMOOTH:
        return _plain(before, after, kind, size)
    one, other = Wing(before, True), Wing(after, False)
    link = Links(CORNER, CLOSED * size)
    reach = MITRE_LIMIT * max(before.distance, after.distance)
    if "plain" not in ends:
        until, first = _strip(one, other.seam(reach), (one.corner, 0.0), ends[0], link, size)
        since, second = _strip(other, one.seam(reach), (one.corner, 0.0), ends[1], link, size)
        return Joint(until, since, first + backwards(second))
    if ends[0] == "plain":
        one, other = other, one
    cut = other.cut(reach)
    root = _root(one, other, cut, size)
    if root is None:
        return _plain(before, after, "mitre", size)
    end, links = _strip(one, cut, root, ends[0 if one.last else 1], link, size)
    foot, w = root
    kept = None if w <= 0.0 else cut.u(w)
    links += link.lines(foot, other.end) if w < 0.0 else ()
    return Joint(end, kept, links) if one.last else Joint(kept, end, backwards(links))


def _plain(before: Side, after: Side, kind: str, size: float) -> Joint:
    """The joint of a parallel contour; a straight step where curved cuts, or cuts at very different
    distances, do not meet as they should."""
    try:
        return join(before, after, kind, size)
    except GeometryError:
        link = Links(CORNER, CLOSED * size)
        return Joint(links=link.lines(before.ends[1], after.ends[0]))


def _root(one: Wing, other: Wing, cut: Leg, size: float) -> tuple[Array, float] | None:
    """Where an edge prolonged straight meets the other side's cut, and the place w there."""
    if other.side.distance == 0.0:
        return other.corner, 0.0
    ray = _straight(one.corner, one.ahead, cut.ray)
    found = crossing((ray, cut), (0.0, -1.0), size)
    return None if found is None else (ray.at(found[0])[0], found[1])


@dataclass(frozen=True, slots=True)
class _Path:
    """Where a strip's end may run: a leg, from its place ``since`` outwards."""

    leg: Leg
    since: float


def _path(one: Wing, other: Leg, root: tuple[Array, float], end: str) -> _Path:
    """The path of a side's end beside another side, which is given by its cut or its seam."""
    foot, w = root
    if end == "mirror":
        return _Path(_mirrored(other, one.corner, one.ahead), w)
    if end == "square":
        return _Path(_straight(foot, one.out, other.ray), 0.0)
    half = 0.5 * abs(np.arctan2(cross(one.ahead, other.ahead), dot(one.ahead, other.ahead)))
    along = np.sin(half) * one.out - np.cos(half) * one.ahead
    return _Path(_straight(foot, along, other.ray), 0.0)


def _straight(start: Array, along: Array, length: float) -> Leg:
    """A straight leg from a point."""
    return Leg(line(start, start + length * along, CORNER), 0.0, 1.0, start, -along, length)


def _mirrored(leg: Leg, point: Array, along: Array) -> Leg:
    """The mirror image of a leg about the line through a point along a unit vector."""
    matrix = 2.0 * np.outer(along, along) - np.eye(2)
    source = leg.edge.curve

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = source(u)
        return point + (points - point) @ matrix, slopes @ matrix

    edge = Edge(CORNER, curve, leg.edge.u)
    return replace(leg, edge=edge, end=point + (leg.end - point) @ matrix, ahead=leg.ahead @ matrix)


def _strip(
    one: Wing, other: Leg, root: tuple[Array, float], end: End, link: Links, size: float
) -> tuple[float | None, tuple[Edge, ...]]:
    """Where a side's cut ends (its u, None where it is prolonged), and the edges from there along
    the path of its end to the path's foot."""
    cut = one.cut(other.ray)
    for wish in (end, "square"):
        path = _path(one, other, root, wish)
        found = crossing((cut, path.leg), (-1.0, path.since), size)
        if found is not None:
            return _along(cut, path, found, root[0], link)
    raise GeometryError(  # the square end of a straight or curved cut is its own normal
        f"an offset of {one.side.distance:.4g} mm has no end at this corner",
        place=place(one.corner),
        value=one.side.distance,
    )


def _along(
    cut: Leg, path: _Path, found: tuple[float, float], foot: Array, link: Links
) -> tuple[float | None, tuple[Edge, ...]]:
    """As :func:`_strip`, from the places at which cut and path cross."""
    w, far = found
    x = cut.at(w)[0]
    leg, links = path.leg, link.lines(cut.end, x) if w < 0.0 else ()
    if far > max(path.since, 0.0):
        links += (between(leg.edge, leg.u(far), leg.u(max(path.since, 0.0))),)
        links += link.lines(leg.end, foot) if path.since < 0.0 else ()
    else:
        links += link.lines(x, foot)
    return (None if w <= 0.0 else cut.u(w)), links
