"""Drawings on the sheet as DXF entities, and their measurement: a LINE where straight, an ARC or
CIRCLE where one arc, else an open LWPOLYLINE with bulges (R12: POLYLINE), or a chain with
splines. Lines of a mark that follow one another are one stroke. Each stands on its own layer,
behind that layer's reference lines."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from devcad.export.binary import torn
from devcad.export.dxfsplines import JOINED, add_chains, edge_deviation
from devcad.export.outline import fitted_strokes, strokes_deviation
from devcad.export.profile import Style
from devcad.flatten import loops
from devcad.flatten.edges import strokes
from devcad.flatten.loops import Path
from devcad.flatten.splines2d import spline_edge
from devcad.flatten.trace import Trace, trace, turns
from devcad.geometry.taylor import Array
from devcad.part import Panel

READBACK = "dxf-readback"


def add_drawings(space: Any, panel: Panel, limit: float, how: Style) -> None:
    """Write the pattern's drawings in order, within ``limit`` (mm) of the true curves.

    Raises:
        CheckFailed: the limit cannot be kept.
    """
    pattern = panel.pattern
    if how.curves == "spline":
        for edge in pattern.drawings:
            add_chains(space, (spline_edge(edge, limit),), how.attributes(edge.name))
        return
    for role, path in fitted_strokes(pattern, limit, how.curves):
        _add_path(space, path, how.attributes(role), old=how.old_polylines)


def _add_path(space: Any, path: Path, style: dict[str, Any], *, old: bool) -> None:
    start, end = path.points[0].tolist(), path.points[-1].tolist()
    if len(path.bulges) == 1 and path.bulges[0] == 0.0:
        space.add_line(start, end, dxfattribs=style)
        return
    arc = loops.arc(path)
    if arc is None:
        rows = np.column_stack([path.points, np.append(path.bulges, 0.0)]).tolist()
        if old:
            space.add_polyline2d(rows, format="xyb", dxfattribs=style)
        else:
            space.add_lwpolyline(rows, format="xyb", dxfattribs=style)
        return
    centre, radius, angle, sweep = arc
    if abs(sweep) >= loops.FULL:
        space.add_circle(centre.tolist(), radius, dxfattribs=style)
        return
    first, last = np.degrees(sorted([angle, angle + sweep])) % 360.0 % 360.0  # -1e-15 % 360 = 360
    space.add_arc(centre.tolist(), radius, float(first), float(last), dxfattribs=style)


def drawings_deviation(space: Any, panel: Panel, limit: float, path: FilePath, how: Style) -> float:
    """The largest distance in mm between the drawings as read and the true curves, 0 where exact.
    On its layer a drawing stands behind the reference lines, in the order of the pattern.

    Raises:
        CheckFailed: dxf-readback, when there are too few or too many entities.
    """
    drawings, lines = panel.pattern.drawings, panel.pattern.lines
    on = {name: role.layer for name, role in how.profile.roles.items()}
    left: dict[str, list[Any]] = {}
    for layer in dict.fromkeys(on[edge.name] for edge in drawings):
        before = sum(on[line.layer] == layer for line in lines)
        left[layer] = [entity for entity in space if entity.dxf.layer == layer][before:]
    if how.curves == "spline":
        traces = [trace(edge, limit / 50.0) for edge in drawings]
        worst = max((_chain(left[on[t.edge.name]], t, panel, path) for t in traces), default=0.0)
    else:
        traces = [trace(stroke[0], limit / 50.0) for stroke in strokes(drawings)]
        read = [_path(left[on[t.edge.name]], t, panel, path) for t in traces]
        worst = strokes_deviation(read, panel.pattern, limit)
    if any(left.values()):
        raise torn(READBACK, path, "more drawings were read than written", panel=panel.name)
    return worst


def _chain(entities: list[Any], traced: Trace, panel: Panel, path: FilePath) -> float:
    """The deviation of one drawing's chain, taken from the front of the list."""
    worst, ends = edge_deviation(entities, traced, panel.name, path)
    for (_, a), (b, _) in pairwise(ends):
        if np.hypot(*(a - b)) > JOINED * traced.size:
            raise torn(READBACK, path, "a drawing is interrupted", panel=panel.name)
    return 0.0 if worst <= JOINED * traced.size else worst


def _path(entities: list[Any], traced: Trace, panel: Panel, path: FilePath) -> Path:
    """One stroke as it was read, taken from the front of the list, in its curve's direction."""
    if not entities:
        raise torn(READBACK, path, "a drawing is missing", panel=panel.name)
    entity = entities.pop(0)
    kind = entity.dxftype()
    if kind == "LINE":
        points = np.array([tuple(entity.dxf.start)[:2], tuple(entity.dxf.end)[:2]])
        return Path(points, np.zeros(1), False, 0.0)
    if kind in ("LWPOLYLINE", "POLYLINE"):
        rows = _rows(entity)
        return Path(rows[:, :2], rows[:-1, 2], False, 0.0)
    centre, radius = np.array(tuple(entity.dxf.center))[:2], float(entity.dxf.radius)
    way = float(np.copysign(1.0, turns(traced.tangents).sum()))
    if kind == "CIRCLE":
        angle = float(np.arctan2(*(traced.points[0] - centre)[::-1]))
        return loops.arc_path(centre, radius, angle, way * 2.0 * np.pi)
    first, last = (float(np.radians(a)) for a in (entity.dxf.start_angle, entity.dxf.end_angle))
    sweep = (last - first) % (2.0 * np.pi)
    return loops.arc_path(centre, radius, first if way > 0.0 else last, way * sweep)


def _rows(entity: Any) -> Array:
    """x, y and bulge of the vertices of a polyline of either kind."""
    if entity.dxftype() == "LWPOLYLINE":
        return np.array(entity.get_points("xyb"), dtype=float)
    return np.array([[*list(v.dxf.location)[:2], v.dxf.bulge] for v in entity.vertices])
