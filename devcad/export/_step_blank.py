"""The flat blank of a panel as a body: one plane on top, one below, and walls along the pattern.

The pattern lies in x and y with the front up: a solid stands on z = 0 and its front is z =
thickness; without thickness the blank is a plane face in z = 0 that shows its front.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import (
    Arc,
    Body,
    Curve,
    Cylinder,
    Edge,
    Face,
    Line,
    Plane,
    Ruled,
    Straight,
    Stretch,
    Surface,
    Trace,
    Use,
)
from devcad.export._step_contour import Round, Side, contours
from devcad.export._step_walls import grid, turned
from devcad.flatten.green import enclosed_area
from devcad.flatten.pattern import Pattern
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array
from devcad.part import Panel

UP: Array = np.array([0.0, 0.0, 1.0])


def flat_area(pattern: Pattern) -> float:
    """The area inside a pattern's outline without its holes, mm2.

    Raises:
        GeometryError: there is no outline.
    """
    if not pattern.outline:
        raise GeometryError("the panel has no pattern to make a blank of")
    outer, *holes = (abs(enclosed_area(edges)) for edges in (pattern.outline, *pattern.holes))
    return outer - sum(holes)


def blank(panel: Panel, area: float, shift: float, tolerance: float, degree: int) -> Body:
    """The blank of a panel's pattern, whose net ``area`` is known, moved by ``shift`` mm along x.

    Walls are planes along lines, cylinders along arcs (a circle is two) and otherwise straight
    connections of two splines on the same knots. Edges are within ``tolerance`` of the pattern.

    Raises:
        GeometryError: the fit is not reached.
    """
    thickness = panel.thickness
    draft = _Draft((0.0, thickness) if thickness else (0.0,), np.array([shift, 0.0]))
    runs = [draft.add(sides) for sides in contours(panel.pattern, tolerance, degree)]
    return draft.body(panel.name, runs, thickness * area)


@dataclass(slots=True)
class _Draft:
    """The body while it grows: vertices, edges and walls, on one level z or between two.

    ``posts`` has for each lower vertex the edge up from it.
    """

    levels: tuple[float, ...]
    shift: Array
    points: list[Array] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    walls: list[Face] = field(default_factory=list)

    def add(self, sides: list[Side]) -> list[list[int]]:
        """The edges of a contour, level by level; its walls are kept."""
        corners = [[self._vertex(side.start, z) for side in sides] for z in self.levels]
        rails = []
        for vertices, z in zip(corners, self.levels, strict=True):
            ends = zip(vertices, vertices[1:] + vertices[:1], strict=True)
            rails.append([self._edge(s, *e, z) for s, e in zip(sides, ends, strict=True)])
        if len(self.levels) == 2:
            posts = [self._post(low, high) for low, high in zip(*corners, strict=True)]
            for k, side in enumerate(sides):
                around = (rails[0][k], posts[(k + 1) % len(sides)], rails[1][k], posts[k])
                self.walls.append(self._wall(side, around))
        return rails

    def body(self, name: str, runs: list[list[list[int]]], volume: float) -> Body:
        """The finished body: the front, the back below it, the walls; of ``runs``, the edges of
        every contour level by level, the first is the outline."""
        faces = []
        for level, z in reversed(list(enumerate(self.levels))):
            front = level == len(self.levels) - 1
            plane = Plane(self._place(np.zeros(2), z), UP if front else -UP)
            uses = [[Use(edge, True) for edge in rails[level]] for rails in runs]
            outer, *holes = (tuple(loop if front else turned(loop)) for loop in uses)
            faces.append(Face(plane, outer, skin=True, holes=tuple(holes)))
        return Body(
            name,
            np.array(self.points),
            tuple(self.edges),
            (*faces, *self.walls),
            len(self.levels) == 2,
            volume,
        )

    def _place(self, point: Array, z: float) -> Array:
        """A place of the pattern in space."""
        return np.array([*(point + self.shift), z])

    def _vertex(self, point: Array, z: float) -> int:
        self.points.append(self._place(point, z))
        return len(self.points) - 1

    def _post(self, low: int, high: int) -> int:
        self.edges.append(Edge(low, high, Line(), (0.0, self.levels[1])))
        return len(self.edges) - 1

    def _edge(self, side: Side, start: int, end: int, z: float) -> int:
        """A side of a contour on a level."""
        curve, span = self._curve(side, z)
        probes = None
        if isinstance(curve, Spline):
            probes = (side.places, self._lifted(side.points, z))
        elif isinstance(curve, Line):
            span = (0.0, float(np.linalg.norm(self.points[end] - self.points[start])))
        self.edges.append(Edge(start, end, curve, span, probes))
        return len(self.edges) - 1

    def _curve(self, side: Side, z: float) -> tuple[Curve, tuple[float, float]]:
        """The curve of a side on a level, and the span of all but lines."""
        curve = side.curve
        if isinstance(curve, Round):
            axis, x = _sense(curve), _start(side, curve)
            return Arc(self._place(curve.centre, z), axis, x, curve.radius), (0.0, abs(curve.sweep))
        if isinstance(curve, Spline):
            poles = self._lifted(curve.poles, z)
            span = float(curve.knots[0]), float(curve.knots[-1])
            return Spline(curve.degree, curve.knots, poles, curve.exact), span
        return Line(), (0.0, 0.0)

    def _lifted(self, points: Array, z: float) -> Array:
        """Places of the pattern (k, 2) in space, (k, 3)."""
        return np.concatenate([points + self.shift, np.full((len(points), 1), z)], axis=1)

    def _wall(self, side: Side, around: tuple[int, int, int, int]) -> Face:
        """The wall on a side; ``around`` counterclockwise seen from outside."""
        low, after, high, before = around
        top = self.levels[1]
        places: Array | None = None
        points = np.concatenate([self._lifted(side.points, z) for z in self.levels])
        surface: Surface
        traces: Iterator[Trace | None]
        flipped = False
        if isinstance(side.curve, Round):
            axis = _sense(side.curve)
            foot = self._place(side.curve.centre, 0.0)
            surface = Cylinder(foot, axis, _start(side, side.curve), side.curve.radius)
            flipped = side.curve.sweep < 0.0
            traces = _round_traces(abs(side.curve.sweep), top * axis[2])
        elif isinstance(side.curve, Spline):
            curves = self.edges[low].curve, self.edges[high].curve
            assert isinstance(curves[0], Spline) and isinstance(curves[1], Spline)
            surface = Ruled(curves[1], curves[0])
            places = grid(side.places, (1.0, 0.0))
            traces = _ruled_traces(*self.edges[low].span)
        else:
            run = side.end - side.start
            normal = np.array([run[1], -run[0], 0.0]) / float(np.hypot(*run))
            surface = Plane(self._place(side.start, 0.0), normal)
            traces = iter([None] * 4)
        loop = ((low, True), (after, True), (high, False), (before, False))
        uses = tuple(Use(edge, forward, next(traces)) for edge, forward in loop)
        return Face(surface, uses, flipped, False, places, points)


def _sense(curve: Round) -> Array:
    """The axis about which an arc turns counterclockwise."""
    return UP if curve.sweep > 0.0 else -UP


def _start(side: Side, curve: Round) -> Array:
    """The unit direction from an arc's centre to its start."""
    arm = side.start - curve.centre
    return np.array([*(arm / np.hypot(*arm)), 0.0])


def _round_traces(sweep: float, rise: float) -> Iterator[Trace]:
    """The edges of a wall on a cylinder: below, at the end, above, at the start."""
    along, up = np.array([1.0, 0.0]), np.array([0.0, np.sign(rise)])
    yield Straight(np.array([0.0, 0.0]), along)
    yield Straight(np.array([sweep, 0.0]), up)
    yield Straight(np.array([0.0, rise]), along)
    yield Straight(np.array([0.0, 0.0]), up)


def _ruled_traces(start: float, end: float) -> Iterator[Trace]:
    """The edges of a wall between splines, the upper one at u = 0: below, at the end, above, at
    the start."""
    along = np.array([0.0, 1.0])
    yield Straight(np.array([1.0, 0.0]), along)
    yield Stretch(np.array([1.0, end]), np.array([0.0, end]))
    yield Straight(np.array([0.0, 0.0]), along)
    yield Stretch(np.array([1.0, start]), np.array([0.0, start]))
