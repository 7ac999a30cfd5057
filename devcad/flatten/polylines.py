"""Pattern edges as straight segments only, for cutters that know nothing else."""

from __future__ import annotations

import numpy as np

from devcad.errors import CheckFailed
from devcad.flatten.arcs import Keep, assemble
from devcad.flatten.loops import Loop, Path
from devcad.flatten.measure import deviation
from devcad.flatten.pattern import Edge
from devcad.flatten.trace import Trace, evaluate, trace, turns, unit_tangents
from devcad.geometry.taylor import Array

CHORD = 0.02  # mm, the largest distance that a polyline may keep from its curve
FINER = 4  # steps between samples of a trace, for a smooth density


def polyline_outline(outline: tuple[Edge, ...], tolerance: float) -> Loop:
    """A closed outline as straight segments, counterclockwise, its points on the true curve
    and no segment further from it than ``tolerance`` or 0.02 mm, whichever is less.

    Raises:
        CheckFailed: the tolerance is below the rounding of the numbers.
    """
    return assemble(outline, min(tolerance, CHORD), polyline)


def polyline_edge(edge: Edge, tolerance: float) -> Path:
    """One edge as straight segments, as in :func:`polyline_outline`."""
    return polyline(trace(edge, tolerance / 50.0), min(tolerance, CHORD))


def polyline(traced: Trace, tolerance: float, keep: Keep = (None, None)) -> Path:
    """One edge as straight segments of equal chord error (``keep`` does not apply to them).

    A chord of length a leaves k a^2 / 8, so that segments follow at the rate sqrt(k / 8 tol).
    """
    u, density = _density(traced, tolerance)
    count = max(1, int(np.ceil(density[-1])))
    for _ in range(8):
        points = _chords(traced, u, density, count)
        bulges = np.zeros(len(points) - 1)
        found = deviation(traced, points, bulges)
        straight = len(bulges) == 1 and found <= 1e-9 * traced.size
        if found <= tolerance or straight:
            return Path(points, bulges, straight, found)
        count = max(count + 1, int(np.ceil(count * np.sqrt(found / tolerance))))
    raise CheckFailed(
        f"an outline cannot be followed: {found:.3g} mm off, limit {tolerance:.3g} mm",
        value=found,
        limit=tolerance,
        remedy="use a larger tolerance",
    )


def _density(traced: Trace, tolerance: float) -> tuple[Array, Array]:
    """Parameters along the edge and the segments expected up to each, from 0."""
    share = np.arange(FINER) / FINER
    u = (traced.u[:-1, None] + np.diff(traced.u)[:, None] * share).ravel()
    u = np.append(u, traced.u[-1])
    points, slopes = evaluate(traced.edge, u)
    ds = np.hypot(*np.diff(points, axis=0).T)
    turn = turns(unit_tangents(traced.edge, points, slopes)[0])
    rate = np.sqrt(np.abs(turn) * ds / (8.0 * tolerance)) + 1e-9 * ds / ds.sum()
    return u, np.concatenate([[0.0], np.cumsum(rate)])


def _chords(traced: Trace, u: Array, density: Array, count: int) -> Array:
    """``count`` + 1 points on the edge at equal steps of the density."""
    levels = np.linspace(0.0, density[-1], count + 1)
    points, _ = traced.edge.curve(np.interp(levels, density, u))
    points = points.copy()
    points[0], points[-1] = traced.points[0], traced.points[-1]
    return points
