"""Borders that are only ours: where a face is cut although the surface goes on, clear of holes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from devcad.geometry.cuts import Cut
from devcad.geometry.fit import Course
from devcad.geometry.taylor import Array

MOST_HOLES = 200
"""Holes in one face: a reader's time grows with their square."""
CLEARANCE = 0.05
"""Of a hole's extent in t: how near a border may pass beside it."""
TRIES = 24
"""Places on either side that a border may be moved to."""
PLACES = np.linspace(0.0, 1.0, 33)


def extents(cuts: tuple[Cut, ...], number: int) -> Array:
    """From where to where cuts reach in t on patch ``number``, (n, 2): tracks of one cut that
    overlap count as one."""
    out: list[list[float]] = []
    for cut in cuts:
        found = []
        for track in (x for x in cut.tracks if x.patch == number):
            low, high = track.u
            t = track.series(low + (high - low) * PLACES)[:, 0]
            found.append([float(t.min()), float(t.max())])
        own: list[list[float]] = []
        for reach in sorted(found):
            if own and own[-1][1] >= reach[0]:
                own[-1][1] = max(own[-1][1], reach[1])
            else:
                own.append(reach)
        out += own
    return np.array(out).reshape(-1, 2)


def clear(place: float, holes: Array, reach: float) -> float:
    """A place in t at most ``reach`` away where a border crosses no hole, the nearest one; if
    there is none, where it crosses or passes holes as far from their ends as can be."""
    if not len(holes):
        return place
    steps = np.arange(2 * TRIES + 1)
    offsets = np.where(steps % 2, steps + 1, -steps) // 2 * (reach / TRIES)
    tries = place + offsets
    low, high = holes.T
    aside = CLEARANCE * (high - low)
    free = ((tries[:, None] < low - aside) | (tries[:, None] > high + aside)).all(axis=1)
    if free.any():
        return float(tries[int(np.argmax(free))])
    near = np.minimum(np.abs(tries[:, None] - low), np.abs(tries[:, None] - high)) / (high - low)
    return float(tries[int(np.argmax(near.min(axis=1)))])


def parted(course: Course, holes: Array) -> list[Course]:
    """A course in parts of at most about 200 holes each."""
    a, b = course.t[[0, -1]]
    own = holes[(holes[:, 1] > a) & (holes[:, 0] < b)]
    count = -(-len(own) // MOST_HOLES)
    if count < 2:
        return [course]
    middles = np.sort(own.mean(axis=1))
    wanted = np.interp(np.arange(1, count) / count, np.linspace(0.0, 1.0, len(own)), middles)
    reach = 0.4 * float(np.diff([a, *wanted, b]).min())
    return between(course, np.array([clear(t, own, reach) for t in wanted.tolist()]))


def between(course: Course, cuts: Array) -> list[Course]:
    """The parts of a course between places in t."""
    places = np.interp(cuts, course.t, course.s)
    out = []
    for (a, b), (low, high) in zip(
        pairwise([course.t[0], *cuts, course.t[-1]]),
        pairwise([course.s[0], *places, course.s[-1]]),
        strict=True,
    ):
        inside = (course.t > a) & (course.t < b)
        t = np.concatenate([[a], course.t[inside], [b]])
        out.append(Course(t, np.concatenate([[low], course.s[inside], [high]])))
    return out
