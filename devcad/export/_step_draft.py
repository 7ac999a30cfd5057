"""The body while it grows: which vertices, edges and faces there are, and how they share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from devcad.export._step_body import (
    Arc,
    Edge,
    Face,
    Line,
    Plane,
    Point,
    Ruled,
    Straight,
    Stretch,
    Surface,
    Trace,
    Use,
)
from devcad.export._step_chart import Chart, heights
from devcad.export._step_folds import Folds, reversed_equal, reversed_trace
from devcad.export._step_rails import Piece
from devcad.export._step_strips import Strip
from devcad.export._step_walls import (
    arc_wall,
    flat_wall,
    grid,
    segment,
    turned,
    wall_probes,
    wall_traces,
)
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Skin:
    """What the faces of one strip stand on: a surface for each layer and its two long edges."""

    strip: Strip
    surfaces: tuple[Surface, ...]
    sides: tuple[list[Piece], list[Piece]]
    frame: Chart | None = None
    places: Array = field(default_factory=lambda: np.zeros(0))
    true: Array = field(default_factory=lambda: np.zeros((0, 2, 1, 3)))


class Draft:
    """The body while it grows: vertices, edges by their names, faces."""

    def __init__(self, parts: list[Strip], corners: Array, size: float, folds: Folds) -> None:
        self.size = size
        self._folds = {
            (parts[k].first, side): (parts[i].first, other)
            for (k, side), (i, other) in folds.items()
        }
        self.layers = corners.shape[2]
        self.corners = corners
        self.points: list[Array] = []
        self.edges: list[Edge] = []
        self.faces: list[Face] = []
        self._names: dict[tuple[object, ...], int] = {}
        self._vertex_of = self._number_corners(parts, folds)

    def _number_corners(self, parts: list[Strip], folds: Folds) -> dict[tuple[int, int, int], int]:
        """One vertex for each corner; corners that a collapsed edge draws together share one, and
        so do those of long edges that lie on one another."""
        keys = list(np.ndindex(self.corners.shape[:3]))
        root = {key: key for key in keys}

        def find(key: tuple[int, ...]) -> tuple[int, ...]:
            while root[key] != key:
                key = root[key]
            return key

        for s in parts:
            for side in (0, 1):
                if s.tips[side] and not (s.ruled and self.layers == 2):
                    for k in range(self.layers):
                        root[find((s.last, side, k))] = find((s.first, side, k))
        for (k, side), (i, other) in folds.items():
            for here, there in ((parts[k].first, parts[i].last), (parts[k].last, parts[i].first)):
                root[find((here, side, 0))] = find((there, other, 0))
        for i, _, k in keys:
            if np.abs(self.corners[i, 0, k] - self.corners[i, 1, k]).max() <= FLOOR * self.size:
                root[find((i, 1, k))] = find((i, 0, k))
        numbers: dict[tuple[int, ...], int] = {}
        for key in keys:
            top = find(key)
            if top not in numbers:
                numbers[top] = self.add_point(self.corners[top])
        return {(i, s, k): numbers[find((i, s, k))] for i, s, k in keys}

    def corner_points(self, strip: Strip) -> Array:
        """The strip's corners as the vertices have them, (2 ends, 2 sides, layers, 3)."""
        pick = [
            [[self.points[self._vertex_of[i, s, k]] for k in range(self.layers)] for s in (0, 1)]
            for i in (strip.first, strip.last)
        ]
        return np.array(pick)

    def add_point(self, point: Array) -> int:
        """The number of a new vertex."""
        self.points.append(np.array(point))
        return len(self.points) - 1

    def edge(self, name: tuple[object, ...], make: Callable[[], Edge]) -> int:
        """The number of the edge of that name, made at its first use."""
        if name not in self._names:
            self._names[name] = len(self.edges)
            self.edges.append(make())
        return self._names[name]

    def line(self, start: int, end: int) -> int:
        """The straight edge between two vertices."""
        length = float(np.linalg.norm(self.points[end] - self.points[start]))
        return self.edge((start, end), lambda: Edge(start, end, Line(), (0.0, length)))

    def length(self, edge: int) -> float:
        """The end of an edge's span."""
        return self.edges[edge].span[1]

    # faces of a strip

    def add_strip(self, skin: Skin) -> None:
        """The skins and the walls of one strip."""
        for layer in range(self.layers):
            self._add_skin(skin, layer)
        if self.layers == 2:
            for side in (0, 1):
                for piece in range(len(skin.sides[side])):
                    self._add_wall(skin, side, piece)

    def _ends(self, strip: Strip, side: int, piece: int, total: int, layer: int) -> tuple[int, int]:
        """The vertices of a piece of a long edge."""
        ends = []
        for k, (index, station) in enumerate(((0, strip.first), (total - 1, strip.last))):
            if piece == index:
                ends.append(self._vertex_of[station, side, layer])
            else:
                ends.append(self._names["kink", strip.first, side, piece + k, layer])
        return ends[0], ends[1]

    def _long_edge(self, skin: Skin, side: int, index: int, layer: int) -> int:
        """The edge of a piece of a long side on a layer."""
        strip, pieces = skin.strip, skin.sides[side]
        piece = pieces[index]
        for k, corner in ((index, piece.corners[0]), (index + 1, piece.corners[1])):
            name = ("kink", strip.first, side, k, layer)
            if 0 < k < len(pieces) and name not in self._names:
                self._names[name] = self.add_point(corner[layer])
        start, end = self._ends(strip, side, index, len(pieces), layer)
        curve = piece.curves[layer]
        if isinstance(curve, Line):
            return self.line(start, end)
        probes = None
        if isinstance(curve, Spline):
            probes = (piece.probes[0], piece.probes[1][:, layer])
        return self.edge(
            ("long", strip.first, side, index, layer),
            lambda: Edge(start, end, curve, piece.spans[layer], probes),
        )

    def _long_use(self, skin: Skin, side: int, index: int, layer: int, *, forward: bool) -> Use:
        """A piece of a long edge as its skin runs along it: the earlier strip's own edge, run
        backwards, where the two lie on one another."""
        piece = skin.sides[side][index]
        source = self._folds.get((skin.strip.first, side))
        shared = self._names.get(("long", *source, 0, layer)) if source else None
        if shared is not None and len(skin.sides[side]) == 1:
            known = self.edges[shared]
            trace = reversed_trace(piece.traces[layer], piece.spans[layer], known.span)
            if trace is not None and reversed_equal(piece.curves[layer], known.curve, self.size):
                return Use(shared, not forward, trace)
        return Use(self._long_edge(skin, side, index, layer), forward, piece.traces[layer])

    def _add_skin(self, skin: Skin, layer: int) -> None:
        """The front (last layer) or the back of a strip."""
        run = [self._ruling_use(skin, 0, layer)]
        for side, forward in ((1, True), (0, False)):
            pieces = skin.sides[side]
            order = range(len(pieces)) if forward else range(len(pieces) - 1, -1, -1)
            uses = [self._long_use(skin, side, i, layer, forward=forward) for i in order]
            run += [u for u in uses if self._drawn(u)]
            if forward:
                end = self._ruling_use(skin, 1, layer)
                run.append(None if end is None else Use(end.edge, False, end.trace))
        loop = [u for u in run if u is not None]
        front = layer == self.layers - 1
        surface = skin.surfaces[layer]
        flipped = not isinstance(surface, (Plane, Ruled)) and (
            (skin.frame is not None and skin.frame.side > 0.0) != front
        )
        places, points = _skin_probes(skin, layer)
        self.faces.append(
            Face(surface, tuple(loop if front else turned(loop)), flipped, True, places, points)
        )

    def _drawn(self, use: Use) -> bool:
        """Whether the edge appears in a loop: a collapsed edge only where a surface needs it."""
        return not (isinstance(self.edges[use.edge].curve, Point) and use.trace is None)

    def _ruling_use(self, skin: Skin, end: int, layer: int) -> Use | None:
        """The ruling at an end of the strip, from the from side to the to side."""
        strip = skin.strip
        station = (strip.first, strip.last)[end]
        low, high = (self._vertex_of[station, side, layer] for side in (0, 1))
        surface = skin.surfaces[layer]
        if low == high:
            if not isinstance(surface, Ruled):
                return None
            s = float(strip.course.s[-end])
            u = 0.0 if layer == self.layers - 1 else 1.0
            trace: Trace = Straight(np.array([u, s]), np.array([1.0 - 2.0 * u, 0.0]))
            name = ("tip", strip.first, end, layer)
            return Use(self.edge(name, lambda: Edge(low, low, Point(), (0.0, 1.0))), True, trace)
        edge = self.line(low, high)
        if isinstance(surface, Plane):
            return Use(edge, True)
        if isinstance(surface, Ruled):
            s = float(strip.course.s[-end])
            u = 0.0 if layer == self.layers - 1 else 1.0
            return Use(edge, True, Stretch(np.array([u, s]), np.array([1.0 - u, s])))
        assert skin.frame is not None
        u = float(skin.frame.angle(strip.ends[[-end]])[0])
        v0, v1 = heights(surface, np.array([self.points[low], self.points[high]]))
        return Use(edge, True, Straight(np.array([u, v0]), np.array([0.0, np.sign(v1 - v0)])))

    def _across(self, minus: int, plus: int, apex: int | None) -> list[int]:
        """The edges from the back's vertex to the front's, by way of the apex if there is one."""
        stops = [minus, plus] if apex is None else [minus, apex, plus]
        return [self.line(a, b) for a, b in pairwise(stops)]

    def _apex(self, strip: Strip, side: int) -> int | None:
        """The vertex where the layers' edges of a fitted thick cone cross, if this side has it."""
        if not (strip.ruled and strip.tips[side] and self.layers == 2):
            return None
        name = ("apex", side)
        if name not in self._names:
            point = strip.patch.jet(strip.ends[:1], 0).rail
            jet = strip.patch.jet(strip.ends[:1], 0)
            self._names[name] = self.add_point(point((jet.v_from, jet.v_to)[side])[0, 0])
        return self._names[name]

    def _add_wall(self, skin: Skin, side: int, index: int) -> None:
        """The wall between the layers along a piece of a long side."""
        piece = skin.sides[side][index]
        if isinstance(piece.curves[0], Point):
            return
        rails = [self._long_edge(skin, side, index, layer) for layer in (0, 1)]
        apex = self._apex(skin.strip, side)
        if apex is not None:
            self._add_waist(skin, side, rails, apex)
            return
        posts = [
            self.line(*(self._vertex(rails[layer], end) for layer in (0, 1))) for end in (0, 1)
        ]
        loop = [(rails[1], True), (posts[1], False), (rails[0], False), (posts[0], True)]
        curves = [self.edges[e].curve for e in rails]
        ends = np.array([[self.points[self._vertex(e, k)] for k in (0, 1)] for e in rails])
        places = None
        points = piece.probes[1].reshape(-1, 3)
        flipped = False
        traces: list[Trace | None] = [None] * 4
        surface: Surface
        if isinstance(curves[0], Arc) and isinstance(curves[1], Arc):
            surface, flipped, traces = arc_wall(
                side, (curves[0], curves[1]), ends, self.size, self.length(rails[0])
            )
        else:
            lower, upper = (
                c if isinstance(c, Spline) else segment(x)
                for c, x in zip(curves, ends, strict=True)
            )
            flat = flat_wall(side, lower, upper)
            if flat is not None:
                surface = flat
            else:
                surface = Ruled(lower, upper) if side == 0 else Ruled(upper, lower)
                traces = wall_traces(side, surface, [isinstance(c, Spline) for c in curves])
                if isinstance(curves[0], Spline):
                    places, points = wall_probes(side, piece.probes)
        uses = [Use(e, f, t) for (e, f), t in zip(loop, traces, strict=True)]
        self.faces.append(
            Face(
                surface, tuple(uses if side == 0 else turned(uses)), flipped, False, places, points
            )
        )

    def _vertex(self, edge: int, end: int) -> int:
        return (self.edges[edge].start, self.edges[edge].end)[end]

    def _add_waist(self, skin: Skin, side: int, rails: list[int], apex: int) -> None:
        """Two faces that meet in the apex of a thick cone that is not a right circular one."""
        for layer in (0, 1):
            rail = self.edges[rails[layer]]
            assert isinstance(rail.curve, Spline)
            tip = Spline(
                rail.curve.degree, rail.curve.knots, 0.0 * rail.curve.poles + self.points[apex]
            )
            curve, span, low = rail.curve, rail.span, (side == 0) != (layer == 1)
            surface = Ruled(curve, tip) if low else Ruled(tip, curve)
            u = 0.0 if low else 1.0
            pinch = self.edge(
                ("pinch", skin.strip.first, side, layer),
                lambda span=span: Edge(apex, apex, Point(), span),  # type: ignore[misc]
            )
            along = np.array([0.0, 1.0])
            run = [Use(rails[layer], layer == 1, Straight(np.array([u, 0.0]), along))]
            for end in (1, 0):
                s = span[end]
                vertex = self._vertex(rails[layer], end)
                stops = (apex, vertex) if layer == 1 else (vertex, apex)
                reach = (1.0 - u, u) if layer == 1 else (u, 1.0 - u)
                trace = Stretch(np.array([reach[0], s]), np.array([reach[1], s]))
                run.append(Use(self.line(*stops), end == 0, trace))
            closing = Use(pinch, layer == 0, Straight(np.array([1.0 - u, 0.0]), along))
            uses = (
                [run[0], run[1], closing, run[2]]
                if layer == 1
                else [run[0], run[2], closing, run[1]]
            )
            self.faces.append(Face(surface, tuple(uses if side == 0 else turned(uses))))

    def add_end(self, strip: Strip, skin: Skin, end: int) -> None:
        """The plane wall at the first or the last ruling of an open solid."""
        station = (strip.first, strip.last)[end]
        if self._vertex_of[station, 0, 0] == self._vertex_of[station, 1, 0]:
            return  # the sheet ends in a point: its walls meet in one edge
        rulings = []
        for layer in (0, 1):
            low, high = (self._vertex_of[station, side, layer] for side in (0, 1))
            rulings.append(self.line(low, high))
        posts = []
        for side in (0, 1):
            minus, plus = (self._vertex_of[station, side, layer] for layer in (0, 1))
            posts.append(self._across(minus, plus, self._apex(strip, side)))
        run = [Use(rulings[1], False)]
        run += [Use(e, False) for e in reversed(posts[0])]
        run += [Use(rulings[0], True)]
        run += [Use(e, True) for e in posts[1]]
        m = strip.patch.frame(strip.ends[[-end]]).m[0]
        plane = Plane(self.corners[station, 1, 0], m if end else -m)
        points = self.corners[station].reshape(-1, 3)
        loop = run if end == 0 else turned(run)
        self.faces.append(Face(plane, tuple(loop), points=points))


def _skin_probes(skin: Skin, layer: int) -> tuple[Array | None, Array]:
    """Places on a skin and the true points there: on both edges and half way."""
    low, high = skin.true[:, 0, layer], skin.true[:, 1, layer]
    points = np.concatenate([low, 0.5 * (low + high), high])
    surface = skin.surfaces[layer]
    if not isinstance(surface, Ruled):
        return None, points
    u = 0.0 if layer == len(skin.strip.layers) - 1 else 1.0
    places = grid(skin.places, (u, 0.5, 1.0 - u))
    weights = [x.denominator(skin.places) for x in (surface.low, surface.high)]
    places[len(low) : -len(low), 0] = weights[0] / (weights[0] + weights[1])
    return places, points
