"""Paths of straight lines and circular arcs in the plane, as cutters know them.

Segment k of a path runs from points[k] to points[k + 1]; its bulge is tan(sweep / 4), positive
counterclockwise and 0 for a straight line, as in DXF. Functions take arrays of segments: starts
and ends (n, 2), bulges (n,), sweeps of at most half a turn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Path:
    """An open path: points (k + 1, 2), bulges (k,).

    ``exact`` says that every segment is the true curve and no approximation (to 1e-9 of its
    size); ``deviation`` is the largest distance between path and true curve in mm, both ways.
    """

    points: Array
    bulges: Array
    exact: bool
    deviation: float


@dataclass(frozen=True, slots=True)
class Loop:
    """A closed path: points (k, 2), bulges (k,), the last segment returning to points[0].

    ``exact`` and ``deviation`` as for a Path.
    """

    points: Array
    bulges: Array
    exact: bool = False
    deviation: float = 0.0

    @property
    def ends(self) -> Array:
        """The end of every segment, (k, 2)."""
        return np.roll(self.points, -1, axis=0)


SHORTEST = 0.01
"""mm; cutters stumble over shorter segments."""
FULL = 2.0 * np.pi - 2e-9
"""Arcs that sweep as much are full circles, radians."""
SPIKE = 0.3
"""A corner within this of a half turn, in radians, is a spike."""


def cross(a: Array, b: Array) -> Array:
    """a x b for vectors in the plane, (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def dot(a: Array, b: Array) -> Array:
    """a . b for vectors in the plane, (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def direction(angle: Array) -> Array:
    """The unit vectors at the given angles, (..., 2)."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def wrap(angle: Array) -> Array:
    """The same angle between -pi and pi."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def half_sweeps(bulges: Array) -> Array:
    """Half the angle each segment turns, which is also the angle between chord and end tangent."""
    return 2.0 * np.arctan(bulges)


def lengths(starts: Array, ends: Array, bulges: Array) -> Array:
    """The arc length of each segment, (n,)."""
    chord = np.hypot(*(ends - starts).T)
    return np.asarray(chord / np.sinc(half_sweeps(bulges) / np.pi))


def area(loop: Loop) -> float:
    """The signed area by Green's theorem, exact: chords plus circular segments, mm2."""
    a, b = loop.points - loop.points[0], loop.ends - loop.points[0]
    chord2 = dot(b - a, b - a)
    sweep = 2.0 * half_sweeps(loop.bulges)
    return float(0.5 * cross(a, b).sum() + (chord2 * segment_factor(sweep)).sum())


def segment_factor(x: Array) -> Array:
    """(x - sin x) / (8 sin(x/2)^2): a circular segment's area over its chord squared."""
    small = np.abs(x) < 0.05
    y = np.where(small, 1.0, x)
    series = x / 12.0 * (1.0 + x**2 / 30.0 + x**4 / 1120.0)  # next term 1e-14 relative
    return np.where(small, series, (y - np.sin(y)) / (8.0 * np.sin(0.5 * y) ** 2))


def perimeter(loop: Loop) -> float:
    """The length of a loop, mm."""
    return float(lengths(loop.points, loop.ends, loop.bulges).sum())


def turning(loop: Loop) -> float:
    """How often the tangent turns round along the loop: +1 for a simple counterclockwise one.

    nan where a corner turns back on itself: which way it does lies within the fit of its sides.
    """
    half = half_sweeps(loop.bulges)
    chord = np.arctan2(*(loop.ends - loop.points).T[::-1])
    corner = wrap(np.roll(chord - half, -1) - (chord + half))
    if np.any(np.abs(corner) > np.pi - SPIKE):
        return float("nan")
    return float((2.0 * half.sum() + corner.sum()) / (2.0 * np.pi))


def reverse(loop: Loop) -> Loop:
    """The same loop run the other way, from the same first point."""
    points = np.roll(loop.points[::-1], 1, axis=0)
    return replace(loop, points=points, bulges=-loop.bulges[::-1])


def counterclockwise(loop: Loop) -> Loop:
    """The loop or its reverse, whichever has its inside on the left."""
    return loop if area(loop) > 0.0 else reverse(loop)


def circle(loop: Loop) -> tuple[Array, float] | None:
    """Centre (2,) and radius when the loop is one full circle of exact arcs, else None."""
    around = Path(np.concatenate([loop.points, loop.points[:1]]), loop.bulges, loop.exact, 0.0)
    found = arc(around)
    return None if found is None or abs(found[3]) < FULL else found[:2]


def arc(path: Path) -> tuple[Array, float, float, float] | None:
    """Centre (2,), radius, first angle and sweep (radians, positive counterclockwise) when the
    path is one exact arc or one full circle, else None."""
    if not path.exact or np.any(path.bulges == 0.0):
        return None
    half = half_sweeps(path.bulges)
    starts, ends = path.points[:-1], path.points[1:]
    chord = ends - starts
    normal = np.stack([-chord[:, 1], chord[:, 0]], axis=1)
    centres = 0.5 * (starts + ends) + 0.5 * normal / np.tan(half)[:, None]
    centre = centres.mean(axis=0)
    arms = path.points - centre
    radii = np.hypot(*arms.T)
    radius = float(radii.mean())
    spread = max(float(np.abs(radii - radius).max()), float(np.abs(centres - centre).max()))
    sweep = float(2.0 * half.sum())
    turns_back = np.any(half * half[0] < 0.0) or abs(sweep) > 2.0 * np.pi + 1e-9
    if turns_back or spread > 1e-9 * radius:
        return None
    return centre, radius, float(np.arctan2(arms[0, 1], arms[0, 0])), sweep


def arc_path(centre: Array, radius: float, start: float, sweep: float) -> Path:
    """An arc as an exact path of segments of at most half a turn."""
    parts = int(np.ceil(abs(sweep) / np.pi - 1e-9))
    at = start + sweep * np.arange(parts + 1) / parts
    bulges = np.full(parts, np.tan(0.25 * sweep / parts))
    return Path(centre + radius * direction(at), bulges, True, 0.0)


def segment_distance(starts: Array, ends: Array, bulges: Array, points: Array) -> Array:
    """The distance of points[k] to segment k, (n,), stable from straight lines to half circles.

    With half sweep h and chord c, N = sin h (Q - A).(Q - B) - cos h (B - A) x (Q - A) vanishes
    on the circle, and the distance to it is |N| / (sqrt(N sin h + c^2/4) + c/2).
    """
    half = half_sweeps(bulges)
    chord, qa, qb = ends - starts, points - starts, points - ends
    c = np.sqrt(dot(chord, chord))
    sine, cosine = np.sin(half), np.cos(half)
    level = sine * dot(qa, qb) - cosine * cross(chord, qa)
    root = np.sqrt(np.maximum(level * sine + 0.25 * c**2, 0.0))
    to_circle = np.abs(level) / np.maximum(root + 0.5 * c, np.finfo(float).tiny)
    to_ends = np.sqrt(np.minimum(dot(qa, qa), dot(qb, qb)))
    angle = np.arctan2(chord[:, 1], chord[:, 0])
    inside = (dot(direction(angle - half), qa) >= 0.0) & (dot(direction(angle + half), qb) <= 0.0)
    return np.where(inside, to_circle, to_ends)


def split(starts: Array, bulge: float, ends: Array, parts: int) -> tuple[Array, float]:
    """One segment in equal parts: the points between, (parts - 1, 2), and the bulge of a part."""
    half = float(half_sweeps(np.array(bulge)))
    chord = ends - starts
    if abs(half) < 1e-300:
        share = np.arange(1, parts)[:, None] / parts
        return starts + share * chord, 0.0
    fractions = np.arange(1, parts) / parts
    # The chord from the start to the point at sweep fraction f has length
    # c sin(f h) / sin(h) and leaves at the angle -h + f h from the chord.
    size = np.sin(fractions * half) / np.sin(half)
    turn = direction(half * (fractions - 1.0))
    x = size * (turn[:, 0] * chord[0] - turn[:, 1] * chord[1])
    y = size * (turn[:, 1] * chord[0] + turn[:, 0] * chord[1])
    return starts + np.stack([x, y], axis=1), float(np.tan(0.5 * half / parts))
