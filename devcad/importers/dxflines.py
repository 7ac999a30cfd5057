"""Entities of a DXF as smooth lines in the plane, in mm: each stays exactly what it is.

A refusal is a JobError without a place; any other exception means that the entity is damaged.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from devcad.errors import JobError
from devcad.flatten.pattern import CUTOUT, Edge
from devcad.flatten.rings import Contour
from devcad.flatten.shapes import conic_arc, line
from devcad.geometry.splines import bspline
from devcad.geometry.taylor import Array
from devcad.geometry.values import check_bspline
from devcad.importers.strokes import SNAP

FULL = 2.0 * np.pi
WHOLE = 1e-6
"""Radians: a sweep as near to a whole turn is one."""
FLAT = 1e-9
"""Sine of the angle by which an entity's plane may lean; a bulge below it is none."""


def _line(entity: Any, mm: float) -> Contour:
    ends = _flat(mm, np.array([entity.dxf.start, entity.dxf.end]), "LINE")
    return (line(*ends),)


def _arc(entity: Any, mm: float) -> Contour:
    """An ARC or a CIRCLE: its angles are counterclockwise as seen from its own side."""
    side = _side(entity)
    center = mm * np.array([side * entity.dxf.center[0], entity.dxf.center[1]])
    radius = mm * abs(float(entity.dxf.radius))
    angles = (0.0, FULL)
    if entity.dxftype() == "ARC":
        degrees = entity.dxf.start_angle, entity.dxf.end_angle
        angles = _sweep(*(float(np.radians(a)) for a in degrees))
    return (conic_arc(center, np.array([side * radius, 0]), np.array([0, radius]), angles),)


def _ellipse(entity: Any, mm: float) -> Contour:
    side = _side(entity)
    center, major = np.array(entity.dxf.center), np.array(entity.dxf.major_axis)
    _flat(mm, np.stack([center, center + major]), "ELLIPSE")
    x, y, _ = mm * major
    minor = side * float(entity.dxf.ratio) * np.array([-y, x])
    angles = _sweep(float(entity.dxf.start_param), float(entity.dxf.end_param))
    return (conic_arc(mm * center[:2], np.array([x, y]), minor, angles),)


def _sweep(start: float, end: float) -> tuple[float, float]:
    """Both angles of an arc counterclockwise, the second at most a turn later."""
    sweep = (end - start) % FULL
    round_once = end == start or sweep > 1.0 or abs(end - start) > 1.0
    if round_once and min(sweep, FULL - sweep) <= WHOLE:
        sweep = FULL
    return start, start + sweep


def _lwpolyline(entity: Any, mm: float) -> Contour:
    side = _side(entity)
    rows = np.array(entity.get_points("xyb"), dtype=float).reshape(-1, 3)
    return _bulged(rows, side, bool(entity.closed), mm)


def _polyline(entity: Any, mm: float) -> Contour:
    if not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise JobError(
            "a POLYLINE that is a mesh bounds no plane contour",
            value="mesh",
            remedy="put it on another layer",
        )
    frame = 16  # the flag of a spline's control points, which are not on the line
    vertices = [v for v in entity.vertices if not v.dxf.get("flags", 0) & frame]
    points = np.array([tuple(v.dxf.location) for v in vertices]).reshape(-1, 3)
    bulges = np.array([float(v.dxf.get("bulge", 0.0)) for v in vertices])
    side = 1.0
    if entity.is_2d_polyline:
        side = _side(entity)
        points[:, 2] = 0.0
    elif len(points):
        _flat(mm, points, "POLYLINE")
        bulges[:] = 0.0
    rows = np.column_stack([points[:, :2], bulges])
    return _bulged(rows, side, bool(entity.is_closed), mm)


def _bulged(rows: Array, side: float, closed: bool, mm: float) -> Contour:
    """The lines and arcs of a polyline (x, y, bulge): tan of a quarter of the arc's angle."""
    if not len(rows):
        return ()
    points, bulges = mm * rows[:, :2] * [side, 1.0], side * rows[:, 2]
    following = np.roll(points, -1, axis=0)
    edges = []
    for k in range(len(rows) if closed else len(rows) - 1):
        a, b, bulge = points[k], following[k], float(bulges[k])
        if np.abs(b - a).max() == 0.0:
            continue
        edges.append(_bulge_arc(a, b, bulge) if abs(bulge) > FLAT else line(a, b))
    return tuple(edges)


def _bulge_arc(a: Array, b: Array, bulge: float) -> Edge:
    """The arc from a to b, counterclockwise where the bulge is positive."""
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    center = middle + np.array([-half[1], half[0]]) * (1.0 - bulge**2) / (2.0 * bulge)
    x = a - center
    y = np.copysign(1.0, bulge) * np.array([-x[1], x[0]])
    return conic_arc(center, x, y, (0.0, float(4.0 * np.arctan(abs(bulge)))))


def _spline(entity: Any, mm: float) -> Contour:
    """A B-spline, rational or not, one edge for each of its pieces without a corner."""
    tool = entity.construction_tool()
    control = _flat(mm, np.array([tuple(p) for p in tool.control_points]), "SPLINE")
    knots = np.array(tool.knots(), dtype=float)
    weights = np.array(tool.weights(), dtype=float) if len(tool.weights()) else None
    degree = int(tool.order) - 1
    if not np.isfinite(knots).all() or (weights is not None and not (weights > 0.0).all()):
        raise ValueError("a SPLINE has knots or weights that are none")
    try:
        check_bspline(degree, knots.tolist(), len(control), None)
    except JobError as error:
        raise ValueError(f"a SPLINE has {error.what}") from None
    spatial = np.column_stack([control, np.zeros(len(control))])
    return tuple(
        Edge(
            CUTOUT,
            _plane_curve(piece.jet),
            np.array([*piece.domain[:1], *piece.breaks, *piece.domain[1:]]),
        )
        for piece in bspline(degree, knots, spatial, weights).pieces()
    )


def _plane_curve(jet: Callable[[Array, int], Array]) -> Callable[[Array], tuple[Array, Array]]:
    def curve(u: Array) -> tuple[Array, Array]:
        series = jet(np.asarray(u, dtype=float), 1)
        return series[0, :, :2], series[1, :, :2]

    return curve


def _flat(mm: float, points: Array, what: str) -> Array:
    """Points (n, 3) of the drawing in mm, (n, 2); they must lie in one height."""
    points = mm * np.asarray(points, dtype=float)
    height = np.ptp(points[:, 2])
    if height > SNAP + FLAT * np.abs(points).max():
        raise _leaning(what, f"{height:.3g} mm high")
    return np.asarray(points[:, :2])


def _side(entity: Any) -> float:
    """1 where an entity is drawn seen from above, -1 from below."""
    x, y, z = entity.dxf.get("extrusion", (0.0, 0.0, 1.0))
    if not np.hypot(x, y) <= FLAT * abs(z):
        raise _leaning(entity.dxftype(), f"extrusion ({x:.3g}, {y:.3g}, {z:.3g})")
    return float(np.copysign(1.0, z))


def _leaning(what: str, value: str) -> JobError:
    return JobError(
        f"a {what} does not lie flat in the xy plane: {value}",
        value=value,
        remedy="draw the contours in the xy plane",
    )


LINES: dict[str, Callable[[Any, float], Contour]] = {
    "ARC": _arc,
    "CIRCLE": _arc,
    "ELLIPSE": _ellipse,
    "LINE": _line,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
    "SPLINE": _spline,
}
"""Entities that may bound a contour, and what makes them lines: entity, mm per unit -> edges in
the order of the run."""
