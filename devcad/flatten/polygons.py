"""Contours as polygons: to see where they cross and what they go round."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.pattern import Edge
from devcad.flatten.trace import trace
from devcad.geometry.taylor import Array

PARTS = 8
"""Steps of a polygon between two samples of a traced edge."""
STRAIGHT = 1e-12
"""rad; an edge whose tangents differ by no more is a straight line."""


def places(edge: Edge, resolution: float) -> Array:
    """Parameters of an edge in the order of its run: traced to ``resolution`` (mm), so that no
    wave is missed, and eight steps between; of a ruling or another straight line its ends."""
    if edge.name in ("start", "end"):
        return edge.u
    traced = trace(edge, resolution)
    if np.abs(traced.tangents - traced.tangents[0]).max() < STRAIGHT:
        return edge.u[[0, -1]]
    u = traced.u
    between = u[:-1, None] + np.diff(u)[:, None] * (np.arange(PARTS) / PARTS)
    return np.append(between.ravel(), u[-1])


def polygon(contour: tuple[Edge, ...], resolution: float) -> Array:
    """A closed contour as a polygon, (k, 2)."""
    return np.concatenate([edge.curve(places(edge, resolution))[0][:-1] for edge in contour])


def winding(polygon: Array, point: Array) -> int:
    """How often a closed polygon runs counterclockwise around a point."""
    away = polygon - point
    after = np.roll(away, -1, axis=0)
    turn = np.arctan2(
        away[:, 0] * after[:, 1] - away[:, 1] * after[:, 0], (away * after).sum(axis=1)
    )
    return round(float(turn.sum()) / (2.0 * np.pi))


def cross(polygons: list[Array]) -> bool:
    """Whether two sides of closed polygons cross properly (touching does not count)."""
    start = np.concatenate(polygons)
    end = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons])
    size = float(np.linalg.norm(np.ptp(start, axis=0)))
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.argsort(low[:, 0])
    start, end, low, high = start[order], end[order], low[order], high[order]
    last = np.searchsorted(low[:, 0], high[:, 0], side="right")
    count = np.maximum(last - np.arange(len(start)) - 1, 0)
    for rows in _batches(count):
        i = np.repeat(rows, count[rows])
        offset = np.arange(len(i)) - np.repeat(np.cumsum(count[rows]) - count[rows], count[rows])
        j = i + 1 + offset
        near = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
        i, j = i[near], j[near]
        first = _side(start[i], end[i], start[j]) * _side(start[i], end[i], end[j])
        second = _side(start[j], end[j], start[i]) * _side(start[j], end[j], end[i])
        # below rounding of the coordinates a point lies on the line, not beside it
        noise = (1e-12 * size) ** 2
        if ((first < -noise) & (second < -noise)).any():
            return True
    return False


def _batches(count: NDArray[np.intp], most: int = 2_000_000) -> list[NDArray[np.intp]]:
    """Rows in groups whose pairs fit the memory."""
    group = (np.cumsum(count) // most).astype(int)
    return [np.flatnonzero(group == g) for g in range(int(group[-1]) + 1)]


def _side(a: Array, b: Array, p: Array) -> Array:
    """The signed distance of p from the line a b, (n,)."""
    along = b - a
    length = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-300)
    away = p - a
    return np.asarray((along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / length)
