"""Corners of parallel curves: what joins two of them, or where they end because they cross."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.loops import cross, dot
from devcad.flatten.pattern import CUTOUT, Edge
from devcad.flatten.polygons import places
from devcad.flatten.shapes import arc, line
from devcad.geometry.taylor import Array

CORNER = "corner"
"""The name of the edges that join two sides of an outline at a corner."""
MITRE_LIMIT = 4.0
"""A mitre reaches at most this many distances from its corner, then it is cut off at right angles
to its bisector: only corners sharper than 29 degrees are (as in SVG and PDF)."""
SMOOTH = 1e-6
"""rad; sides that turn by less have one normal."""
CLOSED = 1e-9
"""Of the size: ends that lie no further apart are one point."""
LOOKS = (0.01, 0.03, 0.1, 0.3)
"""Shares of two edges after which it is seen on which side of each other they lie."""
NEWTON = 30
TRIED = 6  # crossings looked at, the nearest to the corner first


@dataclass(frozen=True, slots=True)
class Side:
    """The parallel curve ``edge`` of a ``source`` over the whole of its run, at ``distance`` (mm)
    to the right; ends (2, 2) and unit tangents along the run (2, 2); ``corners`` (2, 2) the ends
    of the source."""

    source: Edge
    edge: Edge
    distance: float
    ends: Array
    tangents: Array
    corners: Array

    @property
    def where(self) -> str:
        """The place of the side's start, for people."""
        return place(self.corners[0])


@dataclass(frozen=True, slots=True)
class Joint:
    """What happens between two sides: where the first ends and the second begins (their u), None
    where that is the end; and the edges between them."""

    until: float | None = None
    since: float | None = None
    links: tuple[Edge, ...] = ()


def place(point: Array) -> str:
    """A point of the pattern, for people."""
    return f"pattern ({point[0]:.3f}, {point[1]:.3f})"


def join(before: Side, after: Side, kind: str, size: float) -> Joint:
    """The joint between two consecutive sides; ``kind`` is that of an opening corner, ``size`` the
    contour's, mm.

    Raises:
        GeometryError: the sides would have to cross and do not.
    """
    a, b = before.ends[1], after.ends[0]
    if np.hypot(*(b - a)) <= CLOSED * size:
        return Joint()
    link = Links(before.edge.name, CLOSED * size)
    t, w = before.tangents[1], after.tangents[0]
    sine, cosine = float(cross(t, w)), float(dot(t, w))
    d, e = before.distance, after.distance
    way = float(np.sign(sine))
    if abs(sine) >= SMOOTH:
        ahead, back = (e - d * cosine) / sine, (d - e * cosine) / sine  # to where tangents meet
    elif cosine > 0.0:
        return Joint(links=link.lines(a, b))
    else:
        way = _way_round(before.source, after.source)
        ahead = back = float(np.copysign(np.inf, way * (d + e)))
    reach = MITRE_LIMIT * max(abs(d), abs(e))
    if ahead >= 0.0 and back >= 0.0:
        return Joint(links=_opening(before, after, kind, (ahead, back), way, link))
    if max(ahead, back) > reach:
        return Joint(links=link.lines(a, b))
    return _crossing(before, after, (ahead, back), size, link)


def _way_round(before: Edge, after: Edge) -> float:
    """+1 where the second edge lies to the left of the first near their cusp, else -1."""
    for share in LOOKS:
        a = before.u[-1] + share * (before.u[0] - before.u[-1])
        b = after.u[0] + share * (after.u[-1] - after.u[0])
        from_a, from_b = (
            edge.curve(np.array([u, end]))[0]
            for edge, u, end in ((before, a, before.u[-1]), (after, b, after.u[0]))
        )
        one, other = from_a[1] - from_a[0], from_b[0] - from_b[1]
        area = float(cross(one, other))
        if abs(area) > SMOOTH * float(np.hypot(*one) * np.hypot(*other)):
            return float(np.sign(area))
    return 1.0


@dataclass(frozen=True, slots=True)
class Links:
    """Makes the edges of a joint: a cutout's where it belongs to one, none that is a point."""

    side: str
    shortest: float

    @property
    def name(self) -> str:
        """That of the edges."""
        return CUTOUT if self.side == CUTOUT else CORNER

    def lines(self, *points: Array) -> tuple[Edge, ...]:
        """Straight edges through the points."""
        return tuple(
            line(a, b, self.name) for a, b in pairwise(points) if np.hypot(*(b - a)) > self.shortest
        )

    def arc(self, center: Array, start: Array, end: Array, way: float) -> tuple[Edge, ...]:
        """The arc about a centre from one point to another, in the sense of ``way``."""
        one, other = start - center, end - center
        first = float(np.arctan2(one[1], one[0]))
        sweep = float(np.arctan2(cross(one, other), dot(one, other)))
        if sweep * way < 0.0:
            sweep += float(np.copysign(2.0 * np.pi, way))
        radius = float(np.hypot(*one))
        if abs(sweep) * radius <= self.shortest:
            return ()
        return (arc(center, radius, (first, first + sweep), self.name),)


def _opening(
    before: Side, after: Side, kind: str, meet: tuple[float, float], way: float, link: Links
) -> tuple[Edge, ...]:
    """The edges over a corner at which the parallel curves leave a gap; ``way`` is its turn."""
    a, b = before.ends[1], after.ends[0]
    t, w = before.tangents[1], after.tangents[0]
    corner = 0.5 * (before.corners[1] + after.corners[0])
    d, e = abs(before.distance), abs(after.distance)
    if kind == "round" and before.distance * after.distance >= 0.0:
        if d >= e:
            reached = b - np.sqrt(max(d * d - e * e, 0.0)) * w
            return link.arc(corner, a, reached, way) + link.lines(reached, b)
        reached = a + np.sqrt(e * e - d * d) * t
        return link.lines(a, reached) + link.arc(corner, reached, b, way)
    far = max(d, e) * (1.0 if kind == "square" else MITRE_LIMIT)
    out = t - w  # along the bisector
    out = out / max(float(np.hypot(*out)), np.finfo(float).tiny)
    rise, fall = float(dot(t, out)), float(-dot(w, out))
    if rise > 0.0 and fall > 0.0:
        cut = (
            (far - float(dot(a - corner, out))) / rise,
            (far - float(dot(b - corner, out))) / fall,
        )
        if 0.0 <= cut[0] < meet[0] and 0.0 <= cut[1] < meet[1]:
            return link.lines(a, a + cut[0] * t, b - cut[1] * w, b)
    return link.lines(a, a + meet[0] * t, b)


# --- crossings -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Leg:
    """A side seen from the corner: w = 0 there, 1 at its other end; below 0 the straight ray on
    which it would go on, ``ray`` mm for each unit of w."""

    edge: Edge
    near: float
    far: float
    end: Array
    ahead: Array
    ray: float

    def u(self, w: float) -> float:
        """The edge's parameter at w, 0 <= w <= 1."""
        return float(self.near + w * (self.far - self.near))

    def at(self, w: float) -> tuple[Array, Array]:
        """The point and its derivative at w."""
        if w < 0.0:
            return self.end - w * self.ray * self.ahead, -self.ray * self.ahead
        u = np.array([self.near + w * (self.far - self.near)])
        point, slope = self.edge.curve(u)
        return point[0], slope[0] * (self.far - self.near)

    def samples(self) -> tuple[Array, Array, Array]:
        """w (k,), points (k, 2) and lengths from the corner (k,), the ray's end first."""
        u = places(self.edge, 1e-4 * self.ray)
        u = u if abs(u[0] - self.near) < abs(u[-1] - self.near) else u[::-1]
        w = (u - self.near) / (self.far - self.near)
        points = self.edge.curve(u)[0]
        run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
        tip = (self.end + self.ray * self.ahead)[None]
        return (
            np.concatenate([[-1.0], w]),
            np.concatenate([tip, points]),
            np.concatenate([[self.ray], run]),
        )


def _crossing(
    before: Side, after: Side, meet: tuple[float, float], size: float, link: Links
) -> Joint:
    """The joint of sides that cross, or of which one reaches the other when it goes on straight:
    at the crossing nearest to the corner along both."""
    ray = MITRE_LIMIT * max(abs(before.distance), abs(after.distance))
    u, v = before.edge.u, after.edge.u
    legs = (
        Leg(before.edge, u[-1], u[0], before.ends[1], before.tangents[1], ray),
        Leg(after.edge, v[0], v[-1], after.ends[0], -after.tangents[0], ray),
    )
    low = (-1.0 if meet[0] > 0.0 else 0.0, -1.0 if meet[1] > 0.0 else 0.0)
    found = crossing(legs, low, size)
    if found is not None:
        x = legs[0].at(found[0])[0]
        return Joint(
            None if found[0] < 0.0 else legs[0].u(found[0]),
            None if found[1] < 0.0 else legs[1].u(found[1]),
            (link.lines(before.ends[1], x) if found[0] < 0.0 else ())
            + (link.lines(x, after.ends[0]) if found[1] < 0.0 else ()),
        )
    short = min(before, after, key=lambda side: float(np.hypot(*np.diff(side.corners, axis=0)[0])))
    length = float(np.hypot(*np.diff(short.corners, axis=0)[0]))
    raise GeometryError(
        f"an offset of {max(abs(before.distance), abs(after.distance)):.4g} mm leaves nothing of a "
        f"side {length:.4g} mm long at this corner",
        place=place(before.corners[1]),
        value=length,
        limit=max(abs(before.distance), abs(after.distance)),
        remedy="use a smaller offset, or round the corner",
    )


def crossing(
    legs: Sequence[Leg], low: tuple[float, float], size: float
) -> tuple[float, float] | None:
    """Where (w) two legs cross nearest to the corner, not before ``low`` on either (-1 allows the
    ray); None where they do not. ``size`` is the contour's, mm."""
    starts = _guesses(legs, (low[0] < 0.0, low[1] < 0.0))
    for start in (*starts, (0.0, 0.0)):  # chords of curves that are almost tangent may not cross
        found = _newton(legs, start, CLOSED * 1e-4 * size)
        if found is not None and all(
            least - 1e-12 <= w <= 1.0 + 1e-12 for w, least in zip(found, low, strict=True)
        ):
            return found
    return None


def _guesses(legs: Sequence[Leg], beyond: tuple[bool, bool]) -> list[tuple[float, float]]:
    """Places near which two legs cross, those nearest to the corner first."""
    (wa, pa, ra), (wb, pb, rb) = (leg.samples() for leg in legs)
    a, b = pa[:-1], pb[:-1]
    s, r = np.diff(pa, axis=0), np.diff(pb, axis=0)
    gap = b[None, :] - a[:, None]
    area = cross(s[:, None], r[None, :])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = cross(gap, np.broadcast_to(r[None, :], gap.shape)) / area
        y = cross(gap, np.broadcast_to(s[:, None], gap.shape)) / area
    loose = 1e-6  # chords pass their curves by a little
    hit = (x >= -loose) & (x <= 1.0 + loose) & (y >= -loose) & (y <= 1.0 + loose)
    hit[0, :] &= beyond[0]
    hit[:, 0] &= beyond[1]
    i, j = np.nonzero(hit)
    run = ra[i] + rb[j] + np.abs(x[i, j]) + np.abs(y[i, j])
    order = np.argsort(run, kind="stable")[:TRIED]
    i, j = i[order], j[order]
    first = wa[i] + x[i, j] * np.diff(wa)[i]
    second = wb[j] + y[i, j] * np.diff(wb)[j]
    return list(zip(first.tolist(), second.tolist(), strict=True))


def _newton(
    legs: Sequence[Leg], start: tuple[float, float], near: float
) -> tuple[float, float] | None:
    """The places at which two legs cross, to rounding; None where the steps do not settle."""
    w = np.array(start)
    best, least = w, np.inf
    for _ in range(NEWTON):
        (p, dp), (q, dq) = (leg.at(float(x)) for leg, x in zip(legs, w, strict=True))
        miss = float(np.hypot(*(q - p)))
        if miss < least:
            best, least = w, miss
        elif least <= near:
            break
        matrix = np.column_stack([dp, -dq])
        if abs(np.linalg.det(matrix)) < 1e-14 * float(np.prod(np.hypot(*matrix))):
            break
        w = np.clip(w + np.linalg.solve(matrix, q - p), -1.0, 1.0)
    return (float(best[0]), float(best[1])) if least <= near else None


def cut(side: Side, since: float | None, until: float | None) -> Side | None:
    """The side between two of its u, None where nothing is left."""
    u = side.edge.u
    low, high = (float(u[0]) if since is None else since, float(u[-1]) if until is None else until)
    way = 1.0 if u[-1] > u[0] else -1.0
    if way * (high - low) <= 0.0:
        return None
    return replace(side, edge=between(side.edge, low, high))


def between(edge: Edge, low: float, high: float) -> Edge:
    """The piece of an edge run from one of its u to another, either way."""
    inner = edge.u[(edge.u > min(low, high)) & (edge.u < max(low, high))]
    inner = np.sort(inner) if high > low else np.sort(inner)[::-1]
    return replace(edge, u=np.concatenate([[low], inner, [high]]))
