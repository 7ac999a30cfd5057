"""Contours in DXF as chains of SPLINE, LINE and ARC entities, and their measurement."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from devcad.export.binary import torn
from devcad.flatten import loops
from devcad.flatten.arcs import pieces, traced_edges
from devcad.flatten.loops import Loop, Path
from devcad.flatten.measure import loop_deviation
from devcad.flatten.pattern import Edge
from devcad.flatten.splines2d import Spline, spline_deviation
from devcad.flatten.trace import Trace, evaluate
from devcad.geometry.taylor import Array
from devcad.part import Panel

JOINED = 1e-9  # mm per mm of the pattern's size: how far apart neighbouring ends may be

Chain = tuple["Path | Spline", ...]
Ends = tuple[Array, Array]
"""Start and end (2,) of an entity."""


def add_chains(space: Any, chains: tuple[Chain, ...], style: dict[str, Any]) -> None:
    """Write each edge's lines, arcs and splines in the order of the run."""
    for item in (item for chain in chains for item in chain):
        if isinstance(item, Spline):
            entity = space.add_spline(degree=item.degree, dxfattribs=style)
            entity.control_points = [(float(x), float(y), 0.0) for x, y in item.control]
            entity.knots = item.knots.tolist()
            continue
        for start, end, bulge in zip(item.points[:-1], item.points[1:], item.bulges, strict=True):
            _add_segment(space, start, end, float(bulge), style)


def _add_segment(space: Any, start: Array, end: Array, bulge: float, style: dict[str, Any]) -> None:
    """A LINE, or an ARC, which DXF knows counterclockwise only."""
    if bulge == 0.0:
        space.add_line(tuple(start.tolist()), tuple(end.tolist()), dxfattribs=style)
        return
    half = 2.0 * np.arctan(bulge)
    chord = end - start
    centre = 0.5 * (start + end) + 0.5 * np.array([-chord[1], chord[0]]) / np.tan(half)
    radius = float(np.hypot(*chord) / (2.0 * abs(np.sin(half))))
    a, b = (float(np.degrees(np.arctan2(*(p - centre)[::-1]))) for p in (start, end))
    a, b = (a, b) if bulge > 0.0 else (b, a)
    space.add_arc((float(centre[0]), float(centre[1])), radius, a, b, dxfattribs=style)


def chain_deviation(
    space: Any, panel: Panel, layers: Sequence[str], limit: float, path: FilePath
) -> float:
    """The largest distance in mm between the chains as read and the pattern's true curves;
    ``layers`` are those of the holes in their order and the outline's.

    Raises:
        CheckFailed: dxf-readback, when entities are missing or ends do not meet.
    """
    left = {layer: [e for e in space if e.dxf.layer == layer] for layer in layers}
    worst = 0.0
    contours = (*panel.pattern.holes, panel.pattern.outline)
    for edges, layer in zip(contours, layers, strict=True):
        found = _contour_deviation(left[layer], edges, limit, panel.name, path)
        worst = max(worst, found)
    if any(left.values()):
        raise torn("dxf-readback", path, "more contours were read than written", panel=panel.name)
    x0, y0, x1, y1 = panel.pattern.bbox
    exact = worst <= JOINED * max(x1 - x0, y1 - y0) and not any(
        entity.dxftype() == "SPLINE" for entity in space
    )
    return 0.0 if exact else worst


def _contour_deviation(
    entities: list[Any], edges: tuple[Edge, ...], limit: float, panel: str, path: FilePath
) -> float:
    """The deviation of one contour's entities, taken from the front of the list."""
    if entities and entities[0].dxftype() == "CIRCLE":
        start = edges[0].curve(edges[0].u[:1])[0][0]
        return loop_deviation(circle_loop(entities.pop(0), start), edges, limit / 5.0)
    traces, _ = traced_edges(edges, limit)
    size = max(traced.size for traced in traces)
    worst = 0.0
    ends: list[Ends] = []
    for traced in traces:
        found, chain = edge_deviation(entities, traced, panel, path)
        worst, ends = max(worst, found), ends + chain
    for (_, a), (b, _) in zip(ends, ends[1:] + ends[:1], strict=True):
        if np.hypot(*(a - b)) > JOINED * size:
            raise torn("dxf-readback", path, "a contour is not closed", panel=panel)
    return worst


def edge_deviation(
    entities: list[Any], traced: Trace, panel: str, path: FilePath
) -> tuple[float, list[Ends]]:
    """The deviation of one edge's entities, taken from the front of the list, and their ends in
    the order of the run.

    Raises:
        CheckFailed: dxf-readback, when entities are missing.
    """
    worst = 0.0
    ends: list[Ends] = []
    for i, j, exact in pieces(traced):
        points, _ = evaluate(traced.edge, _dense(traced.u[i : j + 1]))
        for part in np.array_split(points, 1 if exact is None else len(exact.bulges)):
            if not entities:
                raise torn("dxf-readback", path, "entities are missing", panel=panel)
            entity = entities.pop(0)
            worst = max(worst, _entity_deviation(entity, part))
            ends.append(_ends(entity, ends[-1][1] if ends else part[0]))
    return worst, ends


def _dense(u: Array) -> Array:
    """The parameters with others between, at least 400 in all."""
    more = max(2, 400 // len(u))
    share = np.arange(more) / more
    return np.append((u[:-1, None] + np.diff(u)[:, None] * share).ravel(), u[-1])


def _entity_deviation(entity: Any, points: Array) -> float:
    """The largest distance of curve points from the entity that stands for them."""
    kind = entity.dxftype()
    if kind == "SPLINE":
        spline = _spline(entity)
        steps = np.hypot(*np.diff(points, axis=0).T)
        return spline_deviation(spline, points, np.concatenate([[0.0], np.cumsum(steps)]))
    if kind == "ARC":
        centre = np.array(tuple(entity.dxf.center))[:2]
        return float(np.abs(np.hypot(*(points - centre).T) - entity.dxf.radius).max())
    start, end = _ends(entity, points[0])
    many = np.ones((len(points), 1))
    return float(
        loops.segment_distance(many * start, many * end, np.zeros(len(points)), points).max()
    )


def _spline(entity: Any) -> Spline:
    control = np.array([tuple(p)[:2] for p in entity.control_points])
    return Spline(int(entity.dxf.degree), np.array(entity.knots), control)


def circle_loop(entity: Any, start: Array) -> Loop:
    """A CIRCLE as a clockwise loop that begins towards ``start``."""
    centre = np.array(tuple(entity.dxf.center))[:2]
    arm = entity.dxf.radius * (start - centre) / np.hypot(*(start - centre))
    return Loop(np.stack([centre + arm, centre - arm]), np.array([-1.0, -1.0]))


def _ends(entity: Any, near: Array) -> tuple[Array, Array]:
    """Start and end of an entity in the order of the run, the start being at ``near``."""
    if entity.dxftype() == "SPLINE":
        control = _spline(entity).control
        return control[0], control[-1]
    names = ("start_point", "end_point") if entity.dxftype() == "ARC" else ("start", "end")
    source = entity if entity.dxftype() == "ARC" else entity.dxf
    a, b = (np.array(tuple(getattr(source, name)))[:2] for name in names)
    swapped = np.hypot(*(near - b)) < np.hypot(*(near - a))
    return (b, a) if swapped else (a, b)
