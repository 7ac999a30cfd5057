"""Pattern: a panel's true shape in the plane, and everything drawn on it.

The pattern shows the front of the sheet, never mirrored. At the panel's start the base curve's
point is the origin, the ruling is +x and t grows towards +y. Coordinates are mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from devcad.geometry.taylor import Array

PlaneCurve = Callable[[Array], tuple[Array, Array]]
"""u (n,) -> points (n, 2) and derivatives d/du (n, 2)."""


class Unrolled(Protocol):
    """A patch laid out in a plane, its rulings straight and evenly divided."""

    def axes(self, t: Array) -> tuple[Array, Array, Array]:
        """The images of c0(t), e(t) and m(t), each (n, 2)."""

    def points(self, t: Array, v: Array) -> Array:
        """The images of the surface points (t, v), each (n,), shape (n, 2)."""


@dataclass(frozen=True, slots=True)
class Edge:
    """One smooth line, run from ``u[0]`` to ``u[-1]`` (increasing or decreasing).

    ``curve`` is callable at any u between; ``u`` (k,) lists the ends and, between them, the
    places where the curve is only tangent continuous. ``name`` is start, end, base or top for a
    piece of an outline, and the layer, such as ENGRAVE, for a drawing.
    """

    name: str
    curve: PlaneCurve
    u: Array


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line on the pattern from ``start`` to ``end`` (2,): a ruling or a bend.

    ``layer`` is RULING, BEND_UP, BEND_DOWN; ``angle`` is a bend's angle in radians,
    positive towards the front, 0 for a ruling.
    """

    layer: str
    start: Array
    end: Array
    angle: float = 0.0


@dataclass(frozen=True, slots=True)
class Pattern:
    """``outline`` runs counterclockwise along the edges in order, each end the next start.

    ``lines`` are the reference lines inside it, ``area`` is the exact area in mm2,
    ``bbox`` = (xmin, ymin, xmax, ymax) the exact bounding box. ``drawings`` are curves on the
    sheet that no cutter cuts through, open or closed, each on the layer that its name says.
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
