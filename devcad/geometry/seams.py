"""Seams: whether two edges of sheets are one curve in space, and how they run along each other.

An edge is held against another as a curve, whatever their parameters, directions and patches:
the gap is the largest distance from a point of either to the nearest point of the other. Where
there is none the two run along each other at equal lengths, from the start of the one to the
start or the end of the other, and round a closed edge from anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from devcad.geometry.chain import Chain
from devcad.geometry.classify import panels
from devcad.geometry.taylor import Array, rows_dot

EDGES = ("start", "end", "base", "top")
"""A panel's edges: its first and last ruling, the rails at v_from and v_to."""
SAMPLES, LEAST = 512, 16
"""Samples of an edge, and of each of its smooth stretches."""
GAUSS = 6
"""Nodes of the quadrature of length between two samples."""
ROUNDS, ZOOM = 4, 33
"""The largest distance is looked for on finer and finer grids of so many points."""
STEPS = 60
"""Newton's steps and halvings, at most, until the nearest point is known to rounding."""
FOUND = 4e-15
"""Of an edge: a nearest point that a step moves by less is found."""
BLOCK = 400_000
"""Pairs of a point and a sample that are compared at a time."""


Key = tuple[int, int]
"""A sheet's number, and that of one of its points or edges."""


class Ties:
    """What is one with what; the smallest key stands for all that are tied."""

    def __init__(self) -> None:
        self._above: dict[Key, Key] = {}

    @property
    def keys(self) -> list[Key]:
        """All that was ever named, in that order."""
        return list(self._above)

    def root(self, key: Key) -> Key:
        """The key that stands for this one."""
        while (up := self._above.setdefault(key, key)) != key:
            key = up
        return key

    def tie(self, one: Key, other: Key) -> None:
        """Make the two one."""
        low, high = sorted((self.root(one), self.root(other)))
        self._above[high] = low


@dataclass(frozen=True, slots=True)
class Meeting:
    """What became of a seam of two edges, each (panel, edge).

    ``gap`` is the largest distance between them and ``length`` what each measures, mm;
    ``matched`` says that the gap is within the job's tolerance, ``joined`` that the meshes have
    the same points there, to the bit. ``stitches`` are the figures of a seam that is sewn.
    """

    edges: tuple[tuple[str, str], tuple[str, str]]
    gap: float
    length: tuple[float, float]
    matched: bool
    joined: bool
    stitches: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Border:
    """An edge of a chain as one curve: x from 0 to the number of its stretches.

    ``stretches`` (n, 3) hold the patch's number and the parameters at which each smooth stretch
    begins and ends: t along a rail, v along a ruling. ``x``, ``points`` and ``s`` are samples,
    the length up to them in mm; a ``loop`` ends where it begins.
    """

    chain: Chain
    name: str
    stretches: Array
    x: Array
    points: Array
    s: Array
    loop: bool

    @property
    def length(self) -> float:
        """The length in mm; 0 of an apex."""
        return float(self.s[-1])

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """The points at x (n,) and their derivatives d/dx, each (n, 3)."""
        return _curve(self.chain, self.name, self.stretches, self.inside(x))

    def places(self, x: Array) -> tuple[Array, Array, Array]:
        """The patch's number, t and v of the points at x, each (n,)."""
        return _places(self.chain, self.name, self.stretches, self.inside(x))

    def arc(self, x: Array) -> Array:
        """The length from the start to x (n,), mm."""
        x = self.inside(x)
        at = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2)
        half = 0.5 * (x - self.x[at])
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        inner = (self.x[at] + half)[:, None] + half[:, None] * nodes
        slopes = _curve(self.chain, self.name, self.stretches, inner.ravel())[1]
        speed = np.linalg.norm(slopes, axis=1).reshape(inner.shape)
        return np.asarray(self.s[at] + half * (speed @ weights))

    def inside(self, x: Array) -> Array:
        """The same x (n,) from 0 to the number of stretches: round a loop, else at its ends."""
        count = float(len(self.stretches))
        return np.mod(x, count) if self.loop else np.clip(x, 0.0, count)


def border(chain: Chain, name: str, closeness: float) -> Border:
    """The edge ``name`` of a chain; a loop if its ends are at most ``closeness`` (mm) apart."""
    stretches = _stretches(chain, name)
    steps = max(LEAST, -(-SAMPLES // len(stretches)))
    x = np.linspace(0.0, len(stretches), steps * len(stretches) + 1)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    half = 0.5 / steps
    inner = (x[:-1] + half)[:, None] + half * nodes
    slopes = _curve(chain, name, stretches, inner.ravel())[1]
    speed = np.linalg.norm(slopes, axis=1).reshape(inner.shape)
    s = np.concatenate([[0.0], np.cumsum(half * (speed @ weights))])
    points = _curve(chain, name, stretches, x)[0]
    apart = float(np.linalg.norm(points[-1] - points[0]))
    return Border(
        chain, name, stretches, x, points, s, bool(s[-1] > 4.0 * closeness >= 4.0 * apart)
    )


def nearest(edge: Border, points: Array) -> tuple[Array, Array]:
    """For each point (n, 3) the x of the nearest one of an edge, and its distance, each (n,)."""
    samples = edge.points[:-1] if edge.loop else edge.points
    rows = max(1, BLOCK // len(samples))
    found = [
        np.argmin(((block[:, None] - samples) ** 2).sum(axis=2), axis=1)
        for block in np.split(points, range(rows, len(points), rows))
    ]
    x = edge.x[np.concatenate(found)]
    return closest(edge, points, x, edge.x[1])


def closest(edge: Border, points: Array, x: Array, reach: float | Array) -> tuple[Array, Array]:
    """The nearest points of an edge to points (n, 3) within ``reach`` of x (n,): their x, and how
    far they are, each (n,)."""
    low, high = x - reach, x + reach
    if not edge.loop:
        low, high = np.maximum(low, 0.0), np.minimum(high, float(len(edge.stretches)))
    x = np.clip(x, low, high)
    corner = np.floor(low) + 1.0  # between two stretches, where the edge may turn
    before = np.minimum(high, np.nextafter(corner, low))
    place, off = _foot(edge, points, np.minimum(x, before), low, before)
    across = np.flatnonzero(corner < high)
    if across.size:
        begin = corner[across]
        later = np.maximum(x[across], begin)
        there, away = _foot(edge, points[across], later, begin, high[across])
        nearer = away < off[across]
        place[across[nearer]], off[across[nearer]] = there[nearer], away[nearer]
    return edge.inside(place), off


def _foot(edge: Border, points: Array, x: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The nearest points of an edge between ``low`` and ``high`` (n,), sought from x on.

    Newton's steps for the foot of the perpendicular, halved wherever they leave the bracket.
    """
    count = float(len(edge.stretches))
    ends = low, high
    for step in range(STEPS):
        there, slope = edge(x)
        pull = rows_dot(there - points, slope)
        low, high = np.where(pull <= 0.0, x, low), np.where(pull >= 0.0, x, high)
        speed = rows_dot(slope, slope)
        stride = np.divide(pull, speed, out=np.full_like(x, np.inf), where=speed > 0.0)
        found = (np.abs(stride) <= FOUND * count) | (pull == 0.0) | (high - low <= FOUND * count)
        if found.all():
            break
        good = (x - stride > low) & (x - stride < high) & (step % 4 < 3)
        x = np.where(found, x, np.where(good, x - stride, 0.5 * (low + high)))
    trials = np.stack([x, *ends])
    off = np.linalg.norm([edge(trial)[0] - points for trial in trials], axis=2)
    best = np.argmin(off, axis=0)
    rows = np.arange(len(x))
    return trials[best, rows], off[best, rows]


def largest_gap(first: Border, second: Border) -> tuple[float, Array]:
    """The largest distance in mm from a point of either edge to the other one, and that point."""
    ways = [_farthest(first, second), _farthest(second, first)]
    return max(ways, key=lambda way: way[0])


@dataclass(frozen=True, slots=True)
class Match:
    """How ``second`` runs along ``first``: from ``start`` (mm along the first) on, or back."""

    first: Border
    second: Border
    start: float
    forward: bool

    def carried(self, x: Array) -> tuple[Array, Array]:
        """Where the points at x (n,) of the second edge lie on the first, and how far off."""
        s = self.second.arc(x) * (self.first.length / self.second.length)
        s = self.start + (s if self.forward else -s)
        if self.first.loop:
            s = np.mod(s, self.first.length)
        guess = np.interp(s, self.first.s, self.first.x)
        return closest(self.first, self.second(x)[0], guess, 2.0 * self.first.x[1])


def match(first: Border, second: Border, closeness: float) -> Match | None:
    """How two edges run along each other within ``closeness`` (mm); None where they do not."""
    if first.loop != second.loop or min(first.length, second.length) <= closeness:
        return None
    starts = (0.0, first.length)
    if first.loop:
        at = nearest(first, second.points[:1])[0]
        starts = (float(first.arc(at)[0]),) * 2
    trials = [
        Match(first, second, s, forward) for s, forward in zip(starts, (True, False), strict=True)
    ]
    probe = second.x[:: max(1, len(second.x) // 64)]
    off = [float(trial.carried(probe)[1].max()) for trial in trials]
    best = int(np.argmin(off))
    return trials[best] if off[best] <= 2.0 * closeness else None


def _stretches(chain: Chain, name: str) -> Array:
    if name in ("base", "top"):
        rows = [
            (k, low, high)
            for k, patch in enumerate(chain.patches)
            for low, high in pairwise(panels(patch))
        ]
    else:
        k = 0 if name == "start" else len(chain.patches) - 1
        patch = chain.patches[k]
        jet = patch.jet([patch.domain[0 if name == "start" else 1]], 0)
        rows = [(k, float(jet.v_from[0, 0]), float(jet.v_to[0, 0]))]
    return np.array(rows)


def _places(chain: Chain, name: str, stretches: Array, x: Array) -> tuple[Array, Array, Array]:
    at = np.clip(np.floor(x).astype(int), 0, len(stretches) - 1)
    number, low, high = stretches[at].T
    along = low + (x - at) * (high - low)
    if name in ("start", "end"):
        t = chain.patches[int(number[0])].domain[0 if name == "start" else 1] if len(x) else 0.0
        return number, np.full(len(x), t), along
    # a rounding inside its stretch, a patch answers for this side of a break
    t = np.clip(along, np.nextafter(low, high), np.nextafter(high, low))
    v = np.empty(len(x))
    for k in np.unique(number):
        here = number == k
        jet = chain.patches[int(k)].jet(t[here], 0)
        v[here] = (jet.v_from if name == "base" else jet.v_to)[0]
    return number, t, v


def _curve(chain: Chain, name: str, stretches: Array, x: Array) -> tuple[Array, Array]:
    at = np.clip(np.floor(x).astype(int), 0, len(stretches) - 1)
    number, low, high = stretches[at].T
    along = low + (x - at) * (high - low)
    points, slopes = np.empty((len(x), 3)), np.empty((len(x), 3))
    for k in np.unique(number):
        here = number == k
        patch = chain.patches[int(k)]
        if name in ("start", "end"):
            jet = patch.jet([patch.domain[0 if name == "start" else 1]], 0)
            points[here], slopes[here] = jet.c0[0] + along[here, None] * jet.e[0], jet.e[0]
        else:
            t = np.clip(along, np.nextafter(low, high), np.nextafter(high, low))[here]
            jet = patch.jet(t, 1)
            points[here], slopes[here] = jet.rail(jet.v_from if name == "base" else jet.v_to)
    return points, slopes * (high - low)[:, None]


def _farthest(first: Border, second: Border) -> tuple[float, Array]:
    """The point of the first edge that is farthest from the second: its distance, and itself."""
    x, points = first.x, first.points
    for _ in range(ROUNDS):
        away = nearest(second, points)[1]
        k = int(np.argmax(away))
        best = float(away[k]), points[k]
        x = np.linspace(x[max(k - 1, 0)], x[min(k + 1, len(x) - 1)], ZOOM)
        points = first(x)[0]
    return best
