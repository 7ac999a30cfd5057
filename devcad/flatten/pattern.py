"""Pattern: a panel's true shape in the plane, and everything drawn on it.

The pattern shows the front of the sheet, never mirrored. At the panel's start the base curve's
point is the origin, the ruling is +x and t grows towards +y. Coordinates are mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from devcad.geometry.edge import Edge as Edge
from devcad.geometry.edge import PlaneCurve as PlaneCurve
from devcad.geometry.taylor import Array

CUTOUT = "cutout"
"""The name of the edges along which a feature was cut."""
STITCH = "stitch"
"""The name of the edges of a hole for a thread."""


class Unrolled(Protocol):
    """A patch laid out in a plane, its rulings straight and evenly divided."""

    def axes(self, t: Array) -> tuple[Array, Array, Array]:
        """The images of c0(t), e(t) and m(t), each (n, 2)."""

    def points(self, t: Array, v: Array) -> Array:
        """The images of the surface points (t, v), each (n,), shape (n, 2)."""


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line on the pattern from ``start`` to ``end`` (2,): a ruling or a bend.

    ``layer`` is RULING, BEND_UP, BEND_DOWN; ``angle`` is a bend's angle in radians,
    positive towards the front, 0 for a ruling. ``radius`` are the inside radii in mm at both ends
    of the whole bend, where there are any, ``order`` is its place in the order of bending.
    """

    layer: str
    start: Array
    end: Array
    angle: float = 0.0
    radius: tuple[float, float] | None = None
    order: int | None = None


@dataclass(frozen=True, slots=True)
class Pattern:
    """``outline`` runs counterclockwise along the edges in order, each end the next start.

    ``lines`` are the reference lines inside it, ``area`` is the exact area in mm2 without the
    holes, ``bbox`` = (xmin, ymin, xmax, ymax) the exact bounding box. ``holes`` are closed
    contours inside the outline, clockwise. ``drawings`` are curves on the sheet that no cutter
    cuts through, open or closed, each on the layer that its name says.
    """

    outline: tuple[Edge, ...]
    lines: tuple[Line, ...]
    area: float
    bbox: tuple[float, float, float, float]
    holes: tuple[tuple[Edge, ...], ...] = ()
    drawings: tuple[Edge, ...] = ()


def sample(edge: Edge, per_piece: int) -> Array:
    """Points on an edge in the order of the run, (k, 2), ``per_piece`` steps between its u's."""
    s = np.linspace(0.0, 1.0, per_piece, endpoint=False)
    u = np.concatenate(
        [*(a + (b - a) * s for a, b in zip(edge.u[:-1], edge.u[1:], strict=True)), edge.u[-1:]]
    )
    return edge.curve(u)[0]


def length_bound(edge: Edge) -> float:
    """The length of a coarse polygon on an edge: zero where the edge is a point."""
    u = np.linspace(edge.u[0], edge.u[-1], 9)
    return float(np.linalg.norm(np.diff(edge.curve(u)[0], axis=0), axis=1).sum())
