"""A pattern's contours as lines, circular arcs and splines, end to end, the sheet on their left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.export._step_strips import smooth_courses
from devcad.flatten import loops
from devcad.flatten.arcs import pieces, traced_edges
from devcad.flatten.loops import Path
from devcad.flatten.pattern import Edge, Pattern
from devcad.flatten.trace import Trace, evaluate
from devcad.geometry.fit import FLOOR, Course, Demand, Ends, Spline, fit
from devcad.geometry.polynomial import ROUNDING, polynomial, settled
from devcad.geometry.taylor import Array

AREA_SIZE = 250.0  # mm: below it the tolerance shrinks with the contour, for areas are relative
HOLE_SHARE = 0.1  # of the tolerance, in holes: their area counts for itself
FLATTEST = 1e-9  # 1 - cos of half the angle: the centre of a flatter arc is too far away
CLOSED_PARTS = 4  # a closed curve in as many edges
PER_SPAN = (np.arange(5) + 0.5) / 5.0  # places in a span where the written file is measured
MOST_POINTS = 65  # true points to which a line or an arc is held
SNAP = 0.05  # of a closed curve: a cut this close to a knot is made there
STEP = 1e-4  # of the span next to an end: from where slopes are carried there
AGREE = 1e-6  # relative: slopes carried from two distances, or the curve has none at its end


@dataclass(frozen=True, slots=True)
class Round:
    """A circular arc: ``centre`` (2,), ``radius`` and the angle ``sweep`` that it turns by,
    positive counterclockwise."""

    centre: Array
    radius: float
    sweep: float


@dataclass(frozen=True, slots=True)
class Side:
    """One edge of a contour from ``start`` to ``end`` (2,), straight where ``curve`` is None.

    ``points`` (k, 2) are points of the pattern on it, at the spline's ``places`` (k,).
    """

    start: Array
    end: Array
    curve: Round | Spline | None
    points: Array
    places: Array


def contours(pattern: Pattern, tolerance: float, degree: int) -> list[list[Side]]:
    """The closed contours of a pattern: its outline counterclockwise, then its holes clockwise.

    Lines and arcs are recognised to 1e-9 of their size and turn by half a turn at most; what is
    neither is a spline, the curve itself where it is a polynomial, else a fit within max(tolerance,
    1e-9 of the size), less in small contours and in holes. A slit without width, where a closed
    flat panel was cut open, is left out: a ring has an outline and a hole.

    Raises:
        GeometryError: the fit is not reached.
    """
    outer = _healed(_contour(pattern.outline, tolerance, degree, hole=False))
    holes = [_contour(edges, tolerance, degree, hole=True) for edges in pattern.holes]
    return [*sorted(outer, key=_reach, reverse=True), *holes]


def _contour(edges: tuple[Edge, ...], tolerance: float, degree: int, *, hole: bool) -> list[Side]:
    """The sides of one closed contour, run so that the sheet is on their left."""
    traces, _ = traced_edges(edges, tolerance)
    around = np.concatenate([traced.points[:-1] for traced in traces])
    centred = around - around[0]
    if (loops.cross(centred, np.roll(centred, -1, 0)).sum() > 0.0) == hole:
        edges = tuple(replace(edge, u=edge.u[::-1]) for edge in reversed(edges))
        traces, _ = traced_edges(edges, tolerance)
    size = float(np.hypot(*np.ptp(around, axis=0)))
    fine = tolerance * min(1.0, size / AREA_SIZE) * (HOLE_SHARE if hole else 1.0)
    demand = Demand(degree, max(fine, FLOOR * size), (slice(0, 2),))
    corners = [traced.points[0] for traced in traces]
    sides: list[Side] = []
    for traced, ends in zip(traces, pairwise([*corners, corners[0]]), strict=True):
        sides += _sides(traced, ends, demand)
    return sides


def _healed(sides: list[Side]) -> list[list[Side]]:
    """The contour without the straight sides that it runs along twice, to and fro: one loop, or
    several where that parts it."""
    twin = _twins(sides)
    if not twin:
        return [sides]
    left = [k for k in range(len(sides)) if k not in twin]
    found: list[list[Side]] = []
    while left:
        first = k = left[0]
        run: list[Side] = []
        while k in left:
            left.remove(k)
            run.append(sides[k])
            k = (k + 1) % len(sides)
            while k in twin:
                k = (twin[k] + 1) % len(sides)
        run = [replace(a, end=b.start) for a, b in pairwise([*run, sides[first]])]
        found.append(run)
    return found


def _twins(sides: list[Side]) -> dict[int, int]:
    """The straight sides that are another one run backwards, both ways."""
    starts, ends = (np.array([getattr(side, x) for side in sides]) for x in ("start", "end"))
    limit = FLOOR * float(np.hypot(*np.ptp(starts, axis=0)))
    place = (starts + ends).sum(axis=1)  # alike for twins
    straight = [k for k in np.argsort(place).tolist() if sides[k].curve is None]
    found: dict[int, int] = {}
    for n, i in enumerate(straight):
        for j in straight[n + 1 :]:
            if place[j] - place[i] > 4.0 * limit or i in found:
                break
            apart = np.abs([starts[i] - ends[j], ends[i] - starts[j]]).max()
            if apart <= limit and j not in found:
                found |= {i: j, j: i}
    return found


def _reach(run: list[Side]) -> float:
    """The width of a loop."""
    return float(np.ptp(np.concatenate([side.points for side in run]), axis=0).max())


def _sides(traced: Trace, ends: tuple[Array, Array], demand: Demand) -> list[Side]:
    """The sides of one smooth edge, from corner to corner."""
    parts = pieces(traced)
    joints = [ends[0], *(traced.points[j] for _, j, _ in parts[:-1]), ends[1]]
    round_ = len(parts) == 1 and np.abs(ends[1] - ends[0]).max() <= FLOOR * traced.size
    out: list[Side] = []
    for (i, j, exact), (start, end) in zip(parts, pairwise(joints), strict=True):
        if exact is not None and not _too_flat(exact):
            out += _exact_sides(exact, traced.points[i : j + 1], start, end)
        else:
            count = CLOSED_PARTS if round_ else 1
            out += _free_sides(traced, i, j, (start, end), demand, count)
    return out


def _too_flat(path: Path) -> bool:
    """Whether the path is an arc whose centre lies too far away for a kernel."""
    cosine = np.cos(loops.half_sweeps(path.bulges))
    return bool(((path.bulges != 0.0) & (1.0 - cosine <= FLATTEST)).any())


def _exact_sides(path: Path, true: Array, start: Array, end: Array) -> list[Side]:
    """The segments of a recognised path; its arcs go through their ends to rounding."""
    points = np.concatenate([start[None], path.points[1:-1], end[None]])
    picked = np.linspace(0, len(true) - 1, min(MOST_POINTS, len(true))).round().astype(int)
    return [
        Side(a, b, _round(a, b, float(bulge)), true[picked], np.zeros(0))
        for a, b, bulge in zip(points[:-1], points[1:], path.bulges, strict=True)
    ]


def _round(start: Array, end: Array, bulge: float) -> Round | None:
    """The arc of a segment, without the rounding of short decimals."""
    if bulge == 0.0:
        return None
    half = 2.0 * float(np.arctan(bulge))
    chord = end - start
    across = np.array([-chord[1], chord[0]])
    centre = 0.5 * (start + end) + 0.5 * across / np.tan(half)
    radius = float(np.hypot(*(start - centre)))
    size = float(np.abs(centre).max()) + radius
    centre = settled(centre, size, ROUNDING)
    return Round(centre, float(settled(np.array(radius), size, ROUNDING)), 2.0 * half)


def _free_sides(
    traced: Trace, i: int, j: int, ends: tuple[Array, Array], demand: Demand, count: int
) -> list[Side]:
    """Splines along samples i to j of a trace: ``count`` or more, cut where no speed along the
    curve makes it smooth."""
    turn = 1.0 if traced.u[j] >= traced.u[i] else -1.0

    def curve(x: Array) -> Array:
        return evaluate(traced.edge, turn * x)[0]

    def slope(x: Array) -> Array:
        return turn * evaluate(traced.edge, turn * x)[1]

    x = turn * traced.u[i : j + 1]
    knots = turn * traced.u[traced.knots]
    borders = np.concatenate([x[:1], knots[(knots > x[0]) & (knots < x[-1])], x[-1:]])
    along = np.linspace(traced.s[i], traced.s[j], count + 1)[1:-1]
    cuts = np.interp(along, traced.s[i : j + 1], x)
    for border in borders[1:-1]:  # a knot that is there already costs nothing
        cuts[np.abs(cuts - border) < SNAP * (x[-1] - x[0])] = border
    courses = smooth_courses(slope, borders, np.concatenate([x[:1], np.unique(cuts), x[-1:]]))
    corners = [ends[0], *(curve(course.t[:1])[0] for course in courses[1:]), ends[1]]
    return [
        _fitted(curve, slope, course, pair, demand)
        for course, pair in zip(courses, pairwise(corners), strict=True)
    ]


def _fitted(
    curve: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    course: Course,
    ends: tuple[Array, Array],
    demand: Demand,
) -> Side:
    """One smooth stretch as a spline."""
    spline = polynomial(curve, course, ends)
    if spline is None:
        spline = fit(curve, course, Ends(ends, _end_slopes(slope, course)), demand).spline
    knots = np.unique(spline.knots)
    places = (knots[:-1, None] + np.diff(knots)[:, None] * PER_SPAN).ravel()
    return Side(*ends, spline, curve(course(places)), places)


def _end_slopes(slope: Callable[[Array], Array], course: Course) -> tuple[Array, Array] | None:
    """d/ds at both ends, carried there from inside to third order; None where there is none."""
    carry = np.array([3.0, -3.0, 1.0])
    scale = float(np.abs(slope(np.linspace(course.t[0], course.t[-1], 11)[1:-1])).max())
    steps = STEP * np.diff(course.t)[[0, -1]] * [1.0, -1.0]
    speeds = np.diff(course.t)[[0, -1]] / np.diff(course.s)[[0, -1]]
    found = []
    for end, step, speed in zip(course.t[[0, -1]], steps, speeds, strict=True):
        far, near = (carry @ slope(end + x * step * np.arange(1.0, 4.0)) for x in (1.0, 0.5))
        if not np.abs(far - near).max() <= AGREE * scale:
            return None
        found.append(speed * near)
    return found[0], found[1]
