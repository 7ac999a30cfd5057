"""Many short curves fitted at once: equal spans, as many as the worst of those left needs."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from devcad.export._step_tracks import Indices
from devcad.geometry.fit import Course, Demand, Ends, Spline, fit, least_squares
from devcad.geometry.taylor import Array

Rows = Callable[[Indices, Array], Array]
"""Numbers of curves (n,) and shares of them (m,) -> columns in mm, (n, m, k)."""

SPANS = (*range(1, 21), 22, 24, 27, 30, 34, 38, 43, 48, 54, 64)
FIRST = 4
MOST_POINTS = 200_000
"""Rows worked on at a time."""
INSIDE = np.array([0.0, 0.12, 0.3, 0.5, 0.7, 0.88])
"""Shares of a span at which the error is measured."""


def fitted(
    rows: Rows,
    breaks: list[tuple[float, ...]],
    tolerances: Array,
    blocks: tuple[slice, ...],
    degree: int,
) -> list[Spline]:
    """Each curve as a spline within its tolerance in every block of columns, ends met exactly.

    Spans are equal between a curve's ``breaks`` (shares, 0 and 1 with them); a curve that 64
    equal spans do not reach is graded by itself. The parameter counts spans.

    Raises:
        GeometryError: out of reach even so.
    """
    done: dict[int, Spline] = {}
    for given in dict.fromkeys(breaks):
        left = np.array([k for k, b in enumerate(breaks) if b == given])
        count: int | None = FIRST
        while len(left) and count is not None:
            excess = np.zeros(len(left))
            for k in _batches(len(left), count * (degree + 1)):
                splines, excess[k] = _equal(
                    rows, left[k], np.array(given), count, tolerances[left[k]], blocks, degree
                )
                for i in np.flatnonzero(excess[k] <= 1.0):
                    done[int(left[k][i])] = splines[i]
            more = excess[excess > 1.0]
            left = left[excess > 1.0]
            count = _next(count, more, degree)
        for k in left.tolist():
            done[k] = _graded(rows, k, np.array(given), tolerances[k], blocks, degree)
    return [done[k] for k in range(len(breaks))]


def _batches(number: int, points: int) -> list[slice]:
    size = max(MOST_POINTS // points, 1)
    return [slice(k, k + size) for k in range(0, number, size)]


def _next(count: int, excess: Array, degree: int) -> int | None:
    """The number of spans that should do for the better half of what is left."""
    if not len(excess):
        return count
    wanted = count * float(np.median(excess)) ** (1.0 / (degree + 1))
    return next((n for n in SPANS if n > count and n >= 0.95 * wanted), None)


def _equal(
    rows: Rows,
    which: Indices,
    breaks: Array,
    count: int,
    tolerances: Array,
    blocks: tuple[slice, ...],
    degree: int,
) -> tuple[list[Spline], Array]:
    """The curves on about ``count`` spans, and how many times they exceed their tolerance, (n,)."""
    parts = np.maximum(np.round(count * np.diff(breaks)), 1.0).astype(int)
    total = float(parts.sum())
    course = Course(breaks, breaks * total)
    spans = [
        np.linspace(a, b, n, endpoint=False)
        for (a, b), n in zip(pairwise(course.s), parts.tolist(), strict=True)
    ]
    knots = np.concatenate([*spans, course.s[-1:]])

    def side_by_side(shares: Array) -> Array:
        found = rows(which, shares)
        return np.asarray(found.transpose(1, 0, 2).reshape(len(shares), -1))

    ends = side_by_side(np.array([0.0, 1.0]))
    spline = least_squares(side_by_side, course, knots, Ends((ends[0], ends[1])), degree)
    s = (knots[:-1, None] + np.diff(knots)[:, None] * INSIDE).ravel()
    off = (spline(s) - side_by_side(course(s))).reshape(len(s), len(which), -1)
    worst = np.max([np.linalg.norm(off[:, :, b], axis=2) for b in blocks], axis=(0, 1))
    width = off.shape[2]
    splines = [spline.part(slice(width * k, width * k + width)) for k in range(len(which))]
    return splines, worst / tolerances


def _graded(
    rows: Rows, k: int, breaks: Array, tolerance: float, blocks: tuple[slice, ...], degree: int
) -> Spline:
    """One curve on graded spans."""

    def alone(shares: Array) -> Array:
        return np.asarray(rows(np.array([k]), shares)[0])

    ends = alone(np.array([0.0, 1.0]))
    course = Course(breaks, breaks * float(SPANS[-1]))
    return fit(alone, course, Ends((ends[0], ends[1])), Demand(degree, tolerance, blocks)).spline
