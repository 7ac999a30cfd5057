"""Measuring lines and arcs against the true curves of a pattern."""

from __future__ import annotations

import numpy as np

from devcad.flatten import loops
from devcad.flatten.edges import smooth_edges
from devcad.flatten.loops import Loop
from devcad.flatten.pattern import Edge
from devcad.flatten.trace import Trace, evaluate, trace
from devcad.geometry.taylor import Array

CERTIFICATE = 1.002  # sampled maxima, sharpened by a parabola, miss less than this
SAME = 1e-6  # of the outline's size: vertices that may be meant by one corner


def loop_deviation(loop: Loop, outline: tuple[Edge, ...], resolution: float) -> float:
    """The largest distance between a closed loop and the outline it stands for, both ways, mm.

    The loop may run either way round but starts near the outline's first corner. ``resolution``
    (mm) is the fineness with which the outline is sampled; take a tenth of what matters.
    """
    traces = [trace(edge, resolution) for edge in smooth_edges(outline)]
    around = np.concatenate([traced.points[:-1] for traced in traces])
    side = float(loops.cross(around - around[0], np.roll(around, -1, 0) - around[0]).sum())
    if side * loops.area(loop) < 0.0:
        loop = loops.reverse(loop)
    at = _corners(loop, traces, float(np.hypot(*np.ptp(around, axis=0))))
    points = np.concatenate([loop.points, loop.points, loop.points[:1]])
    bulges = np.concatenate([loop.bulges, loop.bulges])
    return max(
        deviation(traced, points[i : j + 1], bulges[i:j])
        for traced, i, j in zip(traces, at[:-1], at[1:], strict=True)
    )


def _corners(loop: Loop, traces: list[Trace], size: float) -> list[int]:
    """The vertices at the edges' starts, increasing, and the first one again a round later.

    Where several vertices are as near (a seam without a gap) the length along the loop decides.
    """
    along = np.cumsum(loops.lengths(loop.points, loop.ends, loop.bulges))
    share = np.concatenate([[0.0], along[:-1]]) / along[-1]
    total = np.cumsum([0.0, *(float(traced.s[-1]) for traced in traces)])
    found: list[int] = []
    for traced, before in zip(traces, total[:-1] / total[-1], strict=True):
        away = np.hypot(*(loop.points - traced.points[0]).T)
        near = away <= away.min() + SAME * size
        apart = np.abs((share - before + 0.5) % 1.0 - 0.5)
        k = int(np.argmin(np.where(near, apart, np.inf)))
        k += len(loop.points) * (bool(found) and k <= found[-1])
        found.append(k)
    return [*found, found[0] + len(loop.points)]


def deviation(traced: Trace, points: Array, bulges: Array) -> float:
    """The largest distance between an edge and a path of lines and arcs, both ways, in mm.

    points (k + 1, 2) and bulges (k,): the path runs along with the edge. Each of its points is
    put to its foot on the edge, which cuts the edge into one piece a segment; every piece is
    measured densely on the true curve against its own segment, and the maxima are sharpened.
    That bounds the way back too: the nearest point runs along the segment without a gap.
    The value is a bound (CERTIFICATE times the largest found).
    """
    feet, apart = _feet(traced, points, bulges)
    count = len(bulges)
    inner = int(np.clip(6000 // count, 6, 24))
    share = np.linspace(0.0, 1.0, inner, endpoint=False)
    u = np.concatenate([(feet[:-1, None] + np.diff(feet)[:, None] * share).ravel(), traced.u])
    forward = feet[-1] >= feet[0]
    u = np.unique(u) if forward else np.unique(u)[::-1]

    def measure(at: Array) -> Array:
        sign = 1.0 if forward else -1.0
        k = np.clip(np.searchsorted(sign * feet, sign * at, side="right") - 1, 0, count - 1)
        found, _ = evaluate(traced.edge, at)
        return loops.segment_distance(points[k], points[k + 1], bulges[k], found)

    distance = measure(u)
    worst = max(float(distance.max()), float(apart.max()))
    peaks = _peaks(u, distance, 0.8 * worst)
    if len(peaks):
        worst = max(worst, float(measure(peaks).max()))
    return CERTIFICATE * worst


def _peaks(u: Array, y: Array, floor: float) -> Array:
    """The tops of the parabolas through the local maxima above ``floor``."""
    k = np.flatnonzero((y[1:-1] >= y[:-2]) & (y[1:-1] >= y[2:]) & (y[1:-1] >= floor)) + 1
    h0, h1 = u[k] - u[k - 1], u[k + 1] - u[k]
    s0, s1 = (y[k] - y[k - 1]) / h0, (y[k + 1] - y[k]) / h1
    bend = s0 - s1
    good = np.abs(bend) > 0.0
    top = u[k] + 0.5 * np.where(good, (s0 * h1 + s1 * h0) / np.where(good, bend, 1.0), 0.0)
    low, high = np.minimum(u[k - 1], u[k + 1]), np.maximum(u[k - 1], u[k + 1])
    return np.clip(top, low, high)


def _feet(traced: Trace, points: Array, bulges: Array) -> tuple[Array, Array]:
    """The parameters of the path's points on the edge, in order, and their distances to it."""
    lengths = loops.lengths(points[:-1], points[1:], bulges)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    along *= traced.s[-1] / max(along[-1], np.finfo(float).tiny)
    u = np.interp(along, traced.s, traced.u)
    low, high = min(traced.u[0], traced.u[-1]), max(traced.u[0], traced.u[-1])
    for _ in range(4):
        found, slopes = evaluate(traced.edge, u)
        speed2 = loops.dot(slopes, slopes)
        step = loops.dot(points - found, slopes) / np.where(speed2 > 0.0, speed2, np.inf)
        u = np.clip(u + step, low, high)
    u[0], u[-1] = traced.u[0], traced.u[-1]
    forward = u[-1] >= u[0]
    u = np.maximum.accumulate(u) if forward else np.minimum.accumulate(u)
    found, _ = evaluate(traced.edge, u)
    return u, np.hypot(*(points - found).T)
