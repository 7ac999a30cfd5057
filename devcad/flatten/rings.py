"""Closed contours in the plane: which way they run, whether they cross themselves or another."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from devcad.flatten.pattern import Edge, sample
from devcad.geometry.taylor import Array

Contour = tuple[Edge, ...]
"""Edges in the order of the run, each end the next one's start, the last end the first start."""
STEPS = 32
"""Sides of the polygon that stands for one piece of a contour."""
_AT = re.compile(r"\[(\S+) (\S+)\]")


def polygon_of(contour: Contour) -> Array:
    """Points on a closed contour in the order of its run, (n, 2)."""
    return np.concatenate([sample(edge, STEPS)[:-1] for edge in contour])


def counterclockwise(contour: Contour) -> Contour:
    """The same closed contour, run counterclockwise."""
    return contour if twice_area(polygon_of(contour)) >= 0.0 else backwards(contour)


def backwards(contour: Contour) -> Contour:
    """The same contour, run the other way."""
    return tuple(Edge(edge.name, edge.curve, edge.u[::-1]) for edge in contour[::-1])


def twice_area(polygon: Array) -> float:
    """Twice the area inside a closed polygon (n, 2), negative where it runs clockwise."""
    x, y = (polygon - polygon[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def self_crossing(polygon: Array) -> tuple[float, float] | None:
    """Where a closed polygon (n, 2) crosses or touches itself, None where it does not."""
    import shapely

    shape = shapely.Polygon(polygon)
    if shapely.is_valid(shape):
        return None
    found = _AT.search(shapely.is_valid_reason(shape))
    x, y = (float(found[1]), float(found[2])) if found else polygon[0].tolist()
    return x, y


def meeting(polygons: Sequence[Array]) -> tuple[int, int] | None:
    """Two closed polygons (by number) that cross, touch, or lie one inside the other, if any do."""
    import shapely

    shapes = [shapely.Polygon(polygon) for polygon in polygons]
    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    pairs = sorted((int(i), int(j)) for i, j in zip(one, other, strict=True) if i < j)
    return pairs[0] if pairs else None
