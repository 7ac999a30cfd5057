"""The body while it grows: which vertices, edges and faces there are, and how they share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from devcad.export._step_body import Edge, Face, Line, Surface
from devcad.export._step_chart import Chart
from devcad.export._step_folds import Folds
from devcad.export._step_rails import Piece
from devcad.export._step_strips import Strip
from devcad.geometry.cells import Key, Spot
from devcad.geometry.fit import FLOOR
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Skin:
    """What the faces of one strip stand on: a surface for each layer and its two long edges.

    ``lifts`` (2 ends, 3) is what a mitre adds to the skins' offset for a unit of thickness.
    """

    strip: Strip
    surfaces: tuple[Surface, ...]
    sides: tuple[list[Piece], list[Piece]]
    lifts: Array
    frame: Chart | None = None
    places: Array = field(default_factory=lambda: np.zeros(0))
    true: Array = field(default_factory=lambda: np.zeros((0, 2, 1, 3)))


class Draft:
    """Vertices, edges by their names, and faces.

    ``shares`` has for places of cuts on long edges where these are cut: the parameter on every
    layer. ``touches`` has for a station the vertices, layer by layer, where cuts touch its ruling.
    ``moved`` is how far cuts were moved to stay off rulings, mm. ``homes`` has for the long edges
    of strips beyond a crease, (first station, side), those of the strips before it that they are.
    """

    def __init__(
        self,
        parts: list[Strip],
        corners: Array,
        size: float,
        folds: Folds,
        joins: Folds | None = None,
    ) -> None:
        self.size = size
        joins = joins or {}
        self.homes = {
            (parts[k].first, side): (parts[i].first, other)
            for (k, side), (i, other) in joins.items()
        }
        self.folds = {
            (parts[k].first, side): (parts[i].first, other)
            for (k, side), (i, other) in folds.items()
        }
        self.layers = corners.shape[2]
        self.corners = corners
        self.points: list[Array] = []
        self.edges: list[Edge] = []
        self.faces: list[Face] = []
        self.names: dict[tuple[object, ...], int] = {}
        self.shares: dict[Key, tuple[float, ...]] = {}
        self.touches: dict[int, list[tuple[int, ...]]] = {}
        self.moved = 0.0
        self._corner_of = self._number_corners(parts, folds, joins)

    def _number_corners(
        self, parts: list[Strip], folds: Folds, joins: Folds
    ) -> dict[tuple[int, int, int], int]:
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
        for (k, side), (i, other) in joins.items():
            for here, there in ((parts[k].first, parts[i].first), (parts[k].last, parts[i].last)):
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

    def home(self, strip: Strip, side: int) -> tuple[int, int]:
        """The first station and the side by which a strip's long edge is known."""
        return self.homes.get((strip.first, side), (strip.first, side))

    def forget_cuts(self) -> None:
        """Free the names of a flank's cuts: those of the next flank are numbered anew."""
        for name in [name for name in self.names if name[0] in ("spot", "rim")]:
            del self.names[name]
        self.shares.clear()

    def corner(self, station: int, side: int, layer: int) -> int:
        """The vertex at the end of a station's ruling."""
        return self._corner_of[station, side, layer]

    def corner_points(self, strip: Strip) -> Array:
        """The strip's corners as the vertices have them, (2 ends, 2 sides, layers, 3)."""
        pick = [
            [[self.points[self.corner(i, s, k)] for k in range(self.layers)] for s in (0, 1)]
            for i in (strip.first, strip.last)
        ]
        return np.array(pick)

    def add_point(self, point: Array) -> int:
        """The number of a new vertex."""
        self.points.append(np.array(point))
        return len(self.points) - 1

    def spot(self, spot: Spot) -> tuple[int, ...]:
        """The vertices of a spot, layer by layer."""
        return tuple(self.names["spot", spot.key, layer] for layer in range(self.layers))

    def edge(self, name: tuple[object, ...], make: Callable[[], Edge]) -> int:
        """The number of the edge of that name, made at its first use."""
        if name not in self.names:
            self.names[name] = len(self.edges)
            self.edges.append(make())
        return self.names[name]

    def line(self, start: int, end: int) -> int:
        """The straight edge between two vertices."""
        length = float(np.linalg.norm(self.points[end] - self.points[start]))
        return self.edge((start, end), lambda: Edge(start, end, Line(), (0.0, length)))

    def line_use(self, start: int, end: int) -> tuple[int, bool]:
        """The straight edge between two vertices, and whether it runs from ``start``."""
        if (start, end) not in self.names and (end, start) in self.names:
            return self.names[end, start], False
        return self.line(start, end), True

    def length(self, edge: int) -> float:
        """The end of an edge's span."""
        return self.edges[edge].span[1]

    def end_vertex(self, edge: int, end: int) -> int:
        """The vertex at an edge's start (0) or end (1)."""
        return (self.edges[edge].start, self.edges[edge].end)[end]

    def ends(self, edge: int) -> Array:
        """The points at both ends of an edge, (2, 3)."""
        return np.array([self.points[self.end_vertex(edge, k)] for k in (0, 1)])
