"""Patterns moved in their plane: turned and shifted, never mirrored, their curves still exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devcad.flatten.green import bounds
from devcad.flatten.pattern import Edge, Line, Pattern
from devcad.geometry.taylor import Array

QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


def turn(angle_deg: float) -> Array:
    """The matrix (2, 2) that turns columns counterclockwise; to the bit at quarter turns."""
    quarter, rest = divmod(angle_deg, 90.0)
    if rest == 0.0:
        cos, sin = QUARTERS[int(quarter) % 4]
    else:
        cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[cos, -sin], [sin, cos]])


def moved_edge(edge: Edge, matrix: Array, shift: Array) -> Edge:
    """The edge turned by a matrix (2, 2) about the origin, then shifted by (2,)."""

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        return points @ matrix.T + shift, slopes @ matrix.T

    return Edge(edge.name, curve, edge.u)


def moved_pattern(pattern: Pattern, angle_deg: float, shift: Array) -> Pattern:
    """The pattern turned counterclockwise about its origin, then shifted by (2,) mm."""
    matrix = turn(angle_deg)

    def edges(contour: tuple[Edge, ...]) -> tuple[Edge, ...]:
        return tuple(moved_edge(edge, matrix, shift) for edge in contour)

    outline = edges(pattern.outline)
    return replace(
        pattern,
        outline=outline,
        lines=tuple(_moved_line(line, matrix, shift) for line in pattern.lines),
        bbox=bounds(outline),
        holes=tuple(edges(hole) for hole in pattern.holes),
        drawings=edges(pattern.drawings),
    )


def _moved_line(line: Line, matrix: Array, shift: Array) -> Line:
    return replace(line, start=matrix @ line.start + shift, end=matrix @ line.end + shift)
