"""Mesh: triangles in space with their normals and their places in the pattern."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles of one panel, ready for shading and for printing.

    vertices (n, 3) in mm; normals (n, 3), unit, outward of the body or the front of a sheet;
    flat (n, 2) the vertex's place in the pattern, mm; triangles (m, 3) int32, counterclockwise
    seen from outside. Vertices are repeated where normals or pattern places differ;
    ``weld`` (n,) int32 gives each its number among the distinct points, so that
    ``weld[triangles]`` is the watertight body. ``watertight`` is False for an open sheet.
    ``deviation`` is the certified distance to the true surface in mm.
    """

    vertices: Array
    normals: Array
    flat: Array
    triangles: NDArray[np.int32]
    weld: NDArray[np.int32]
    watertight: bool
    deviation: float
