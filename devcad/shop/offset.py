"""Offsets of closed contours: exact parallel curves, joined at corners, trimmed where they cross.

A point of an edge moves along the unit normal of the edge: lines stay lines, circles circles.
Nothing is sampled but to see that the result does not cross itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.pattern import Edge, length_bound
from devcad.flatten.rings import self_crossing, twice_area
from devcad.flatten.trace import evaluate
from devcad.geometry import chebyshev
from devcad.geometry.taylor import Array
from devcad.shop.corners import CLOSED, Joint, Side, cut, join, place
from devcad.shop.polygons import fine_polygon

INWARDS = 1e-7  # of an edge: where its derivative vanishes, its normal is taken so far inside
LOOKS = 65  # places between two of an edge's u's at which it is asked whether it folds
FOLDED = 1e-9
"""Of an edge's speed: a parallel curve that is slower stands still or runs backwards."""
APART = 0.5
"""The cosine of 60 degrees, at which two sides of a neck are seen from between them at least."""
FINE = 1e-5  # of the contour's size: the sagitta of the polygon that may not cross itself


def offset_edge(edge: Edge, distance: float) -> Edge:
    """The parallel curve of an edge at ``distance`` mm to the right of its run, over the same u.

    To the right is outwards of a counterclockwise contour. Points are exact; the derivative is
    the edge's own plus that of the normal's Chebyshev series. Where the edge curls to the right
    with a radius below the distance the parallel curve runs backwards; that is not checked here.
    """
    if distance == 0.0:
        return edge
    normals = _normals(edge)
    turn = chebyshev.resolve(
        lambda u: normals(u, edge.curve(u)[1]), np.sort(edge.u), scale=1.0
    ).derivative()

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        return points + distance * normals(u, slopes), slopes + distance * turn(u)

    return Edge(edge.name, curve, edge.u)


def offset_contour(
    contour: tuple[Edge, ...],
    distances: Sequence[float],
    corners: Sequence[str] | str = "mitre",
) -> tuple[Edge, ...]:
    """A closed contour moved by ``distances[k]`` mm along each edge, to the right of its run.

    To the right is outwards of a counterclockwise outline and into the void of a clockwise hole:
    positive distances add material. At a corner that opens, ``corners`` (one word, or one for
    the end of each edge) says what closes it: "mitre", the tangents prolonged until they meet, at
    most four distances from the corner; "square", cut off at right angles to the bisector one
    distance from the corner; "round", an arc about the corner. Sides that cross end there. Where
    the distance changes between tangent edges a straight step joins them.

    Returns:
        The new contour, each end the next start, in the order of the old. A piece of a side has
        its edge's name and parameter; edges between sides are named "corner", those of a cutout
        "cutout". Edges without length are left out.
    Raises:
        GeometryError: a hollow is narrower than the distance, a neck is narrower than two, a side
        or the whole contour vanishes.
    """
    kinds = [corners] * len(contour) if isinstance(corners, str) else list(corners)
    size = size_of(contour)
    rows = zip(contour, distances, kinds, strict=True)
    kept = [row for row in rows if length_bound(row[0]) > CLOSED * size]
    if not any(distance for _, distance, _ in kept):
        return tuple(edge for edge, _, _ in kept)
    made = [(side_of(edge, distance), kind) for edge, distance, kind in kept]
    # an arc about the end of its normals becomes a point: there its neighbours meet
    made = [(side, kind) for side, kind in made if length_bound(side.edge) > CLOSED * size]
    if not made:
        _refuse_nothing(contour, distances)
    sides = [side for side, _ in made]
    joints = [
        join(side, after, kind, size)
        for (side, kind), after in zip(made, [*sides[1:], sides[0]], strict=True)
    ]
    result = _assembled(sides, joints)
    _refuse_crossing(result, contour, max(abs(d) for d in distances), size)
    return result


def size_of(contour: tuple[Edge, ...]) -> float:
    """About the larger side of a contour's box, mm."""
    size = float(np.ptp(np.concatenate([_ends(edge) for edge in contour]), axis=0).max())
    return max(size, max(length_bound(edge) for edge in contour) / np.pi)


def side_of(edge: Edge, distance: float) -> Side:
    """An edge's parallel curve with what its joints ask for."""
    moved = offset_edge(edge, distance)
    u = np.array([edge.u[0], edge.u[-1]])
    points, slopes = edge.curve(u)
    normals = _normals(edge)(u, slopes)
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    return Side(edge, moved, distance, points + distance * normals, tangents, points)


def _ends(edge: Edge) -> Array:
    return edge.curve(np.array([edge.u[0], edge.u[-1]]))[0]


def _normals(edge: Edge) -> Callable[[Array, Array], Array]:
    """The unit normals (n, 2) to the right of the run, from u (n,) and the derivatives there."""
    low, high = float(min(edge.u[0], edge.u[-1])), float(max(edge.u[0], edge.u[-1]))
    way = 1.0 if edge.u[-1] >= edge.u[0] else -1.0
    top = float(np.hypot(*evaluate(edge, np.linspace(low, high, 17))[1].T).max())

    def normals(u: Array, slopes: Array) -> Array:
        still = ~(np.hypot(*slopes.T) > 1e-9 * top)  # also where it is not a number
        if still.any():
            inside = u[still] + INWARDS * (0.5 * (low + high) - u[still])
            slopes = slopes.copy()
            slopes[still] = edge.curve(inside)[1]
        slopes = way * slopes / np.hypot(*slopes.T)[:, None]
        return np.column_stack([slopes[:, 1], -slopes[:, 0]])

    return normals


def _assembled(sides: list[Side], joints: list[Joint]) -> tuple[Edge, ...]:
    """What is left of the sides, and the edges between them, in order."""
    out: list[Edge] = []
    for side, before, after in zip(sides, [joints[-1], *joints[:-1]], joints, strict=True):
        out += [left_of(side, before, after), *after.links]
    return tuple(out)


def left_of(side: Side, before: Joint, after: Joint) -> Edge:
    """What the joints at its ends leave of a side.

    Raises:
        GeometryError: nothing, or the parallel curve runs backwards.
    """
    left = cut(side, before.since, after.until)
    if left is None:
        length = length_bound(side.edge)
        raise GeometryError(
            f"an offset of {side.distance:.4g} mm leaves nothing of the side {side.edge.name}",
            place=side.where,
            value=length,
            limit=abs(side.distance),
            remedy="use a smaller offset",
        )
    _refuse_fold(left)
    return left.edge


def _refuse_nothing(contour: tuple[Edge, ...], distances: Sequence[float]) -> NoReturn:
    """The error of a contour that becomes a point."""
    reach = max(abs(distance) for distance in distances)
    raise GeometryError(
        f"an offset of {reach:.4g} mm leaves nothing of the contour",
        place=place(_ends(contour[0])[0]),
        value=reach,
        remedy="use a smaller offset",
    )


def _refuse_fold(side: Side) -> None:
    """GeometryError where an edge curls away with a radius below its distance.

    The parallel curve's derivative is the edge's times 1 + distance x curvature.
    """
    pairs = zip(side.edge.u[:-1], side.edge.u[1:], strict=True)
    u = np.concatenate([np.linspace(a, b, LOOKS) for a, b in pairs])
    (points, slopes), moved = evaluate(side.source, u), side.edge.curve(u)[1]
    square = (slopes**2).sum(axis=1)
    stretch = np.divide(
        (moved * slopes).sum(axis=1), square, out=np.ones_like(square), where=square > 0.0
    )
    worst = int(stretch.argmin())
    if stretch[worst] > FOLDED:
        return
    radius = abs(side.distance) / (1.0 - float(stretch[worst]))
    raise GeometryError(
        f"an offset of {side.distance:.4g} mm folds: the contour curls there with a radius of "
        f"{radius:.4g} mm",
        place=place(points[worst]),
        value=radius,
        limit=abs(side.distance),
        remedy="use a smaller offset, or a larger radius",
    )


def _refuse_crossing(
    made: tuple[Edge, ...], contour: tuple[Edge, ...], reach: float, size: float
) -> None:
    """GeometryError where the new contour crosses or touches itself, or runs the other way."""
    found = crossing_at(made, contour, size)
    if found is None:
        return
    point, width = found
    raise GeometryError(
        f"an offset of up to {reach:.4g} mm crosses itself where the contour is {width:.4g} mm "
        "wide",
        place=place(point),
        value=width,
        limit=2.0 * reach,
        remedy="use a smaller offset, or widen the neck",
    )


def crossing_at(
    made: tuple[Edge, ...], contour: tuple[Edge, ...], size: float
) -> tuple[Array, float] | None:
    """Where a contour made from another crosses or touches itself, or where it is when it runs the
    other way, and about how wide the old one is there in mm; None where it does not."""
    new, old = (fine_polygon(edges, FINE * size)[0] for edges in (made, contour))
    at = self_crossing(new)
    if at is None and twice_area(new) * twice_area(old) > 0.0:
        return None
    point = np.array(at) if at else new.mean(axis=0)
    return point, _width(old, point)


def _width(polygon: Array, point: Array) -> float:
    """The distance between the two sides of a polygon (k, 2) that a point lies between, about."""
    along = np.roll(polygon, -1, axis=0) - polygon
    share = ((point - polygon) * along).sum(axis=1) / (along**2).sum(axis=1)
    away = polygon + np.clip(share, 0.0, 1.0)[:, None] * along - point
    far = np.hypot(*away.T)
    first = int(far.argmin())
    opposite = away @ away[first] <= APART * far * far[first]
    if not opposite.any():
        return float(2.0 * far[first])
    second = np.flatnonzero(opposite)[far[opposite].argmin()]
    return float(np.hypot(*(away[second] - away[first])))
