"""Sampling a pattern edge until nothing is left between the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.flatten import loops
from devcad.flatten.pattern import Edge
from devcad.geometry.taylor import Array

START = 16  # first steps between two of the edge's u's
LEVELS = 24  # halvings at most: 1e-8 of a step, below which a curve is a point of it
ROUNDING = 1e-13  # of the coordinates: finer than that, samples are noise


@dataclass(frozen=True, slots=True)
class Trace:
    """Samples of an edge in the order of its run.

    u (n,); points (n, 2); tangents (n, 2) unit, along the run; s (n,) the length from the
    start in mm; ``knots`` the places of the edge's own u's among them, (k,). ``cusps`` says for
    start and end whether the derivative vanishes there, so that the tangent is only a limit.
    """

    edge: Edge
    u: Array
    points: Array
    tangents: Array
    s: Array
    knots: NDArray[np.intp]
    cusps: tuple[bool, bool]

    @property
    def size(self) -> float:
        """The diagonal of the samples' bounding box, mm."""
        return float(np.hypot(*np.ptp(self.points, axis=0)))


def trace(edge: Edge, resolution: float) -> Trace:
    """Samples of an edge so dense that the cubic through two neighbours along their tangents
    passes the curve between them at ``resolution`` (mm) or less."""
    steps = np.linspace(0.0, 1.0, START, endpoint=False)
    ends = np.asarray(edge.u, dtype=float)
    u = np.concatenate([(ends[:-1, None] + np.diff(ends)[:, None] * steps).ravel(), ends[-1:]])
    points, slopes = evaluate(edge, u)
    resolution = max(resolution, ROUNDING * float(np.abs(points).max()))
    active = np.ones(len(u) - 1, dtype=bool)  # intervals not yet seen to be resolved
    for _ in range(LEVELS):
        left = np.flatnonzero(active)
        if len(left) == 0:
            break
        tangents, _ = unit_tangents(edge, points, slopes)
        middle = 0.5 * (u[left] + u[left + 1])
        found, slope = evaluate(edge, middle)
        rough = _misses(points, tangents, left, found) > resolution
        u, points, slopes, active = (
            np.insert(old, left + 1, new, axis=0)
            for old, new in ((u, middle), (points, found), (slopes, slope), (active, rough))
        )
        active[left + np.arange(len(left))] = rough
    return _assemble(edge, u, points, slopes)


def _misses(points: Array, tangents: Array, left: NDArray[np.intp], found: Array) -> Array:
    """How far points found between samples left and left + 1 lie off the cubic graph over the
    chord with the samples' tangents; speeds do not matter, so that they may jump at knots."""
    a, chord = points[left], points[left + 1] - points[left]
    length = np.hypot(*chord.T)
    safe = np.where(length > 0.0, length, 1.0)
    axis = chord / safe[:, None]
    slopes = [
        loops.cross(axis, t) / np.maximum(loops.dot(axis, t), 0.5)  # 60 degrees: not resolved
        for t in (tangents[left], tangents[left + 1])
    ]
    steep = np.minimum(*(loops.dot(axis, t) for t in (tangents[left], tangents[left + 1]))) < 0.5
    w = loops.dot(axis, found - a) / safe
    height = length * w * (1.0 - w) * ((1.0 - w) * slopes[0] - w * slopes[1])
    offset = np.abs(loops.cross(axis, found - a) - height)
    reach = np.maximum(np.hypot(*(found - a).T), length)
    unresolved = steep | (w < 0.0) | (w > 1.0) | (length == 0.0)
    return np.asarray(np.where(unresolved, reach, offset))


def evaluate(edge: Edge, u: Array) -> tuple[Array, Array]:
    """Points and derivatives; a derivative that does not exist counts as zero."""
    points, slopes = edge.curve(u)
    return points, np.where(np.isfinite(slopes).all(axis=1, keepdims=True), slopes, 0.0)


def _assemble(edge: Edge, u: Array, points: Array, slopes: Array) -> Trace:
    tangents, defined = unit_tangents(edge, points, slopes)
    chords = np.diff(points, axis=0)
    half = 0.5 * turns(tangents)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*chords.T) / np.sinc(half / np.pi))])
    knots = np.flatnonzero(np.isin(u, edge.u))
    return Trace(edge, u, points, tangents, s, knots, (not defined[0], not defined[-1]))


def unit_tangents(edge: Edge, points: Array, slopes: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Unit tangents along the run at samples, and where the derivative gives them.

    Elsewhere, at a cusp, it is the neighbour's tangent mirrored about the chord between.
    """
    slopes = slopes * np.sign(edge.u[-1] - edge.u[0])
    speed = np.hypot(*slopes.T)
    defined = speed > 1e-9 * speed.max(initial=0.0)
    tangents = slopes / np.where(defined, speed, 1.0)[:, None]
    for k in np.flatnonzero(~defined):
        near = k + 1 if k + 1 < len(points) else k - 1
        chord = (points[near] - points[k]) * (near - k)
        length = np.hypot(*chord)
        chord = chord / length if length > 0.0 else np.array([1.0, 0.0])
        other = tangents[near] if defined[near] else chord
        tangents[k] = 2.0 * (chord @ other) * chord - other
    return tangents, defined


def turns(tangents: Array) -> Array:
    """The angle from each tangent to the next, (n - 1,)."""
    a, b = tangents[:-1], tangents[1:]
    return np.arctan2(loops.cross(a, b), loops.dot(a, b))
