"""The fewest tangent continuous arcs along a smooth curve within a tolerance.

Nodes lie on the curve, dense enough that a good chain of arcs finds its joints among them. An
arc from node i to node j has one free number, half its sweep h; a curve point Q is within the
tolerance for an interval of h about the angle turned at Q from i to j (inscribed angle), and
the intervals of all Q between i and j intersect to one. The next arc must start where the last
one points, so its h is given. Chains are therefore grown level by level, one arc a level, over
states (node, direction); the first level that reaches the last node has the fewest arcs.

Between nodes on the curve the best chain has directions that are NOT the curve's tangents (for
a curvature that grows linearly they are off by k' a^2 / 12, a the arc's length); letting them
go costs a third fewer arcs than biarcs between true tangents.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.flatten import loops
from devcad.geometry.taylor import Array

INNER = 24  # curve points tried between the ends of an arc
BINS = 12  # directions told apart at a node
SPREAD = 16.0  # range of directions, in tolerances per arc length; the best chains use 10.4
LARGEST = 0.5 * np.pi * (1.0 + 1e-9)  # half sweep of half a turn
RATIOS = (0.35, 0.6, 1.0, 1.7, 2.9)  # of the two arms of a closing biarc

Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Nodes:
    """A curve to be followed: points (m * fine + 1, 2), of which every ``fine``-th is a node.

    ``angles`` (m + 1,) are the curve's directions at the nodes. ``start`` and ``end`` are the
    directions to keep at the two ends, None where the path may turn freely. ``shortest`` is
    the least length of an arc in mm.
    """

    points: Array
    fine: int
    angles: Array
    start: float | None
    end: float | None
    tolerance: float
    shortest: float

    @property
    def at(self) -> Array:
        """The nodes themselves, (m + 1, 2)."""
        return self.points[:: self.fine]


@dataclass(frozen=True, slots=True)
class _Reach:
    """For arcs from node i over k + 1 steps, arrays (m, K): the least and the largest half
    sweep that keep the tolerance (nan where none does) and the direction of the chord."""

    low: Array
    high: Array
    chord: Array
    spread: Array  # (m + 1,) the range of directions worth telling apart at each node


@dataclass(frozen=True, slots=True)
class _Level:
    """The ends of all chains of one length: node, direction, cost and the row of the state
    before it in the level before."""

    node: Index
    angle: Array
    cost: Array
    parent: Index


def fewest_arcs(nodes: Nodes) -> tuple[Array, Array] | None:
    """Points (k + 1, 2) and bulges (k,) of the shortest chain, or None when there is none.

    None means that the nodes lie too far apart for the tolerance. The path is measured at the
    points between nodes only, to first order in the tolerance: certify it afterwards.
    """
    last = len(nodes.angles) - 1
    reach = _reach(nodes)
    first = np.full(last + 1, 2 * last + 9)  # the level at which each node is first reached
    seen = np.zeros((last + 1) * BINS, dtype=bool)
    levels = [_start(nodes, reach)]
    while len(levels[-1].node) and len(levels) <= last + 1:
        if nodes.end is not None:
            closing = _close(nodes, reach, levels[-1])
            if closing is not None:
                return _backtrack(nodes, levels, *closing)
        levels.append(_grow(nodes, reach, levels[-1], len(levels), first, seen))
        arrived = np.flatnonzero(levels[-1].node == last)
        if nodes.end is None and len(arrived):
            best = int(arrived[np.argmin(levels[-1].cost[arrived])])
            return _backtrack(nodes, levels, best, [])
    return None


def _reach(nodes: Nodes) -> _Reach:
    """All arcs between two nodes that keep the tolerance."""
    points, fine, at = nodes.points, nodes.fine, nodes.at
    count = len(at) - 1
    rows: list[tuple[Array, Array, Array]] = []
    longest = np.hypot(*np.diff(at, axis=0).T)
    i = np.arange(count)
    for k in range(1, count + 1):
        i = i[i + k <= count]
        if len(i) == 0:
            break
        between = np.arange(1, fine * k, max(1, fine * k // INNER))
        low, high, angle, chord = _interval(
            at[i], at[i + k], points[fine * i[:, None] + between], nodes.tolerance
        )
        row = tuple(np.full(count, np.nan) for _ in range(3))
        held = low <= high
        usable = held & (chord >= nodes.shortest)
        for target, value in zip(row, (low, high, angle), strict=True):
            target[i[usable]] = value[usable]
        longest[i[held]] = chord[held]
        rows.append(row)  # type: ignore[arg-type]
        i = i[held]
    low, high, angle = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
    spread = np.clip(SPREAD * nodes.tolerance / longest, 1e-12, 0.5)
    return _Reach(low, high, angle, np.append(spread, spread[-1]))


def _interval(
    a: Array, b: Array, between: Array, tolerance: float
) -> tuple[Array, Array, Array, Array]:
    """Half sweeps (low, high) of the arcs from a to b that pass all points ``between``
    (n, w, 2) within the tolerance, the chord's direction and its length, each (n,)."""
    qa, bq = between - a[:, None], b[:, None] - between
    turned = np.arctan2(loops.cross(qa, bq), loops.dot(qa, bq))
    chord = b - a
    length = np.hypot(*chord.T)
    arms = np.sqrt(loops.dot(qa, qa) * loops.dot(bq, bq))
    width = tolerance * length[:, None] / np.maximum(arms, np.finfo(float).tiny)
    low = np.maximum((turned - width).max(axis=1), -LARGEST)
    high = np.minimum((turned + width).min(axis=1), LARGEST)
    return low, high, np.arctan2(chord[:, 1], chord[:, 0]), length


def _start(nodes: Nodes, reach: _Reach) -> _Level:
    """The states before the first arc: the direction to keep, or a fan of free ones."""
    if nodes.start is not None:
        angle = np.array([nodes.start])
    else:
        angle = nodes.angles[0] + reach.spread[0] * np.linspace(-1.0, 1.0, 2 * BINS + 1)
    zero = np.zeros(len(angle), dtype=np.intp)
    return _Level(zero, angle, np.zeros(len(angle)), zero)


def _grow(
    nodes: Nodes, reach: _Reach, level: _Level, depth: int, first: Index, seen: NDArray[np.bool_]
) -> _Level:
    """All chains one arc longer, the best for each node and direction; marks first and seen."""
    alive = np.flatnonzero(level.node < len(reach.low))
    i = level.node[alive]
    half = loops.wrap(reach.chord[i] - level.angle[alive, None])
    low, high = reach.low[i], reach.high[i]
    with np.errstate(invalid="ignore"):
        row, step = np.nonzero((half >= low) & (half <= high))
    low, high, half = low[row, step], high[row, step], half[row, step]
    node = i[row] + step + 1
    angle = reach.chord[i[row], step] + half
    offset = (half - 0.5 * (low + high)) / np.maximum(0.5 * (high - low), 1e-300)
    cost = level.cost[alive[row]] + offset**2  # spends what is left of the tolerance evenly
    place = loops.wrap(angle - nodes.angles[node]) / reach.spread[node]
    key = node * BINS + np.clip((0.5 * (place + 1.0) * BINS).astype(int), 0, BINS - 1)
    np.minimum.at(first, node, depth)
    # Any direction at a node can be had with at most two arcs more than its first visit took.
    keep = ~seen[key] & (depth <= first[node] + 1)
    keep = np.flatnonzero(keep)
    keep = keep[np.lexsort((cost[keep], key[keep]))]
    keep = keep[np.unique(key[keep], return_index=True)[1]]
    seen[key[keep]] = True
    return _Level(node[keep], angle[keep], cost[keep], alive[row[keep]])


def _close(
    nodes: Nodes, reach: _Reach, level: _Level
) -> tuple[int, list[tuple[Array, float, float]]] | None:
    """The best biarc from a state to the end and its kept direction: the state's row and the
    two half sweeps with the joint between, or None."""
    count = len(reach.low)
    near = np.flatnonzero((level.node >= count - 2 * reach.low.shape[1]) & (level.node < count))
    if len(near) == 0 or nodes.end is None:
        return None
    state = np.repeat(near, len(RATIOS))
    ratio = np.tile(RATIOS, len(near))
    a, b = nodes.at[level.node[state]], nodes.at[-1]
    t0, t1 = loops.direction(level.angle[state]), loops.direction(np.array(nodes.end))
    joint, middle = _biarc(a, b, t0, t1, ratio)
    h0 = np.arctan2(loops.cross(t0, joint - a), loops.dot(t0, joint - a))
    h1 = np.arctan2(loops.cross(b - joint, t1), loops.dot(b - joint, t1))
    share = np.linspace(0.0, 1.0, INNER + 2)[1:-1]
    from_ = nodes.fine * level.node[state][:, None]
    index = np.rint(from_ + (nodes.fine * count - from_) * share).astype(int)
    q = nodes.points[index]  # (n, INNER, 2)
    second = loops.dot(q - joint[:, None], middle[:, None]) > 0.0
    starts = np.where(second[..., None], joint[:, None], a[:, None])
    ends = np.where(second[..., None], b, joint[:, None])
    bulges = np.tan(0.5 * np.where(second, h1[:, None], h0[:, None]))
    flat = (starts.reshape(-1, 2), ends.reshape(-1, 2), bulges.ravel(), q.reshape(-1, 2))
    worst = loops.segment_distance(*flat).reshape(index.shape).max(axis=1)
    sizes = np.minimum(np.hypot(*(joint - a).T), np.hypot(*(b - joint).T))
    fits = (worst <= nodes.tolerance) & (np.maximum(np.abs(h0), np.abs(h1)) <= LARGEST)
    fits &= sizes >= max(nodes.shortest, 1e-300)
    if not fits.any():
        return None
    best = int(np.argmin(np.where(fits, (worst / nodes.tolerance) ** 2, np.inf)))
    return int(state[best]), [(joint[best], float(h0[best]), float(h1[best]))]


def _biarc(a: Array, b: Array, t0: Array, t1: Array, ratio: Array) -> tuple[Array, Array]:
    """The joint of the biarcs from a along t0 to b along t1 and the direction there; ``ratio``
    of the second arm of the control polygon to the first. nan where there is none."""
    v = b - a
    along = loops.dot(v, t0 + ratio[:, None] * t1)
    bend = 2.0 * ratio * (1.0 - loops.dot(t0, t1))
    with np.errstate(invalid="ignore", divide="ignore"):
        arm = loops.dot(v, v) / (along + np.sqrt(along**2 + bend * loops.dot(v, v)))
        q0, q1 = a + arm[:, None] * t0, b - (ratio * arm)[:, None] * t1
        joint = q0 + (q1 - q0) / (1.0 + ratio)[:, None]
        return joint, (q1 - q0) / np.hypot(*(q1 - q0).T)[:, None]


def _backtrack(
    nodes: Nodes, levels: list[_Level], row: int, closing: list[tuple[Array, float, float]]
) -> tuple[Array, Array]:
    """Points and bulges of the chain that ends in row ``row`` of the last level."""
    chain: list[int] = []
    angles: list[float] = []
    for level in reversed(levels):
        chain.append(int(level.node[row]))
        angles.append(float(level.angle[row]))
        row = int(level.parent[row])
    points = nodes.at[chain[::-1]]
    chord = np.diff(points, axis=0)
    half = loops.wrap(np.array(angles[::-1][1:]) - np.arctan2(chord[:, 1], chord[:, 0]))
    for joint, h0, h1 in closing:
        points = np.concatenate([points, joint[None], nodes.at[-1:]])
        half = np.concatenate([half, [h0, h1]])
    return points, np.tan(0.5 * half)
