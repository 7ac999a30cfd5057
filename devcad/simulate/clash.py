"""Links that run into each other: arcs of one axial band and one layer that cross."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bodies import Arc, Complex, Drive, Flags, Poses
from devcad.simulate.search import first_failure

SAME = 1e-9
"""Of a radius: circles whose centres are nearer than that are one circle."""


@dataclass(frozen=True, slots=True)
class Clash:
    """Two links, by number, that cross when the input has turned by ``angle`` radians (>= 0) from
    the conformal pose; 0: they cross there."""

    links: tuple[int, int]
    angle: float


def pairs(arcs: Sequence[Arc]) -> tuple[tuple[int, int], ...]:
    """The links that fill a common interval of the axis and, with their thickness, of the radius:
    those that can run into each other."""
    return tuple(
        (i, j)
        for (i, a), (j, b) in combinations(enumerate(arcs), 2)
        if _abreast(a, b) and abs(a.radius - b.radius) < a.half + b.half + SAME * a.radius
    )


def _abreast(a: Arc, b: Arc) -> bool:
    """Whether two links share a part of the axis; what has no band is everywhere."""
    if not a.bands or not b.bands:
        return True
    size = max(high - low for low, high in (*a.bands, *b.bands))
    return any(min(p[1], q[1]) - max(p[0], q[0]) > 1e-9 * size for p in a.bands for q in b.bands)


def clash(arcs: Sequence[Arc], drive: Drive, end: float) -> Clash | None:
    """The first clash while the input turns from 0 to ``end`` (signed), None where there is none.

    The middles of hinged links are compared, and where these cross nearer to the joint than its
    hinge reaches is the hinge's own affair; of other links both skins. To 1e-10, as
    ``first_failure``.
    """
    found = None
    sign = 1.0 if end >= 0.0 else -1.0
    for i, j in pairs(arcs):
        last = abs(end) if found is None else found.angle

        def clear(x: Array, i: int = i, j: int = j) -> Flags:
            return ~crossing(arcs[i], arcs[j], (i, j), drive.poses(sign * x))

        start = min(1e-4, 0.5 * last)
        angle = first_failure(clear, last, start=start)
        if angle < last:
            found = Clash((i, j), angle if angle > start else 0.0)
    return found


def crossing(a: Arc, b: Arc, links: tuple[int, int], poses: Poses) -> Flags:
    """Whether two links cross, (m,)."""
    i, j = links
    joint = _shared(a, b)
    halves: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    if joint is None and min(a.half, b.half) > 0.0:
        halves = tuple((p * a.half, q * b.half) for p in (-1.0, 1.0) for q in (-1.0, 1.0))
    out = np.zeros(len(poses.turns), dtype=bool)
    for p, q in halves:
        first = poses.shifts[:, i], poses.turns[:, i], a.radius + p
        second = poses.shifts[:, j], poses.turns[:, j], b.radius + q
        place = None if joint is None else poses.joints[:, joint]
        out |= _cross(a, first, b, second, place, max(a.hinge, b.hinge))
    return out


def _shared(a: Arc, b: Arc) -> int | None:
    """The joint that two links share; of two links that share both (n = 2), none is told."""
    common = {a.first, a.last} & {b.first, b.last}
    return common.pop() if len(common) == 1 else None


Placed = tuple[Complex, Array, float]
"""Shift, turn and radius of an arc."""


def _cross(
    a: Arc, first: Placed, b: Arc, second: Placed, joint: Complex | None, hinge: float
) -> Flags:
    """Whether two arcs cross inside of both: two circles meet in two points. Hinged arcs through
    their joint meet there and in its mirror image in the line of centres."""
    (ca, ta, ra), (cb, tb, rb) = first, second
    apart = np.abs(cb - ca)
    one = apart < SAME * ra
    with np.errstate(invalid="ignore", divide="ignore"):
        along = (cb - ca) / np.where(one, 1.0, apart)
        if joint is not None and hinge == 0.0:
            meetings = [ca + along * ((joint - ca) / along).conj()]
        else:
            reach = 0.5 * (apart + (ra - rb) * (ra + rb) / np.where(one, np.nan, apart))
            side = np.sqrt(ra * ra - reach * reach)
            meetings = [ca + along * (reach + sign * 1j * side) for sign in (1.0, -1.0)]
        out = np.zeros(len(apart), dtype=bool)
        ears = joint is None  # the ears of a hinge lie over each other by design
        for point in meetings:
            inside = a.holds(np.angle(point - ca) - ta, ears=ears)
            inside &= b.holds(np.angle(point - cb) - tb, ears=ears)
            if joint is not None and hinge > 0.0:
                inside &= np.abs(point - joint) > hinge
            out |= inside & np.isfinite(point)
    if ra == rb:
        out = np.where(one, _overlap(a, ta, b, tb), out)
    return out


def _overlap(a: Arc, ta: Array, b: Arc, tb: Array) -> Flags:
    """Whether two arcs of one circle lie over each other: an end or the middle of one is inside
    of the other."""
    parts = np.array([0.0, 0.5, 1.0])
    out = np.zeros(len(ta), dtype=bool)
    for part in parts:
        out |= b.holds(a.start + part * a.sweep + ta - tb)
        out |= a.holds(b.start + part * b.sweep + tb - ta)
    return out


def meet(arcs: Sequence[Arc], drive: Drive) -> tuple[tuple[int, int], ...]:
    """The pairs of links that could run into each other and lie over each other already in the
    conformal pose."""
    poses = drive.poses(np.zeros(1))
    return tuple((i, j) for i, j in pairs(arcs) if crossing(arcs[i], arcs[j], (i, j), poses).any())
