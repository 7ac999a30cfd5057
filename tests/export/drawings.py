"""Parts whose patterns are closed forms, for the drawing formats; and dense points on what
was read, from centre, radius and angle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from parts import panel as empty_panel

from devcad.flatten.pattern import Edge, Line, Pattern
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

TURN = 2.0 * np.pi
APEX, OUTER, INNER = 260.0, 260.0, 130.0  # lampshade: radii 100 and 50, height 120
SWEEP = 2.4166097335306103
LAMPSHADE_AREA = 0.5 * SWEEP * (OUTER**2 - INNER**2)


def edge(name: str, form: Callable[[Array], tuple[Array, Array, Array, Array]], *u: float) -> Edge:
    """An edge from x, y, dx/du, dy/du."""

    def curve(at: Array) -> tuple[Array, Array]:
        x, y, dx, dy = np.broadcast_arrays(*form(np.asarray(at, dtype=float)))
        return np.stack([x, y], axis=1), np.stack([dx, dy], axis=1)

    return Edge(name, curve, np.array(u, dtype=float))


def straight(name: str, a: tuple[float, float], b: tuple[float, float]) -> Edge:
    dx, dy = b[0] - a[0], b[1] - a[1]
    one = np.ones_like
    return edge(name, lambda u: (a[0] + u * dx, a[1] + u * dy, dx * one(u), dy * one(u)), 0.0, 1.0)


def bow(
    name: str,
    centre: tuple[float, float],
    radii: tuple[float, float],
    start: float,
    end: float,
) -> Edge:
    """An arc of an ellipse along the axes."""
    a, b = radii
    return edge(
        name,
        lambda u: (
            centre[0] + a * np.cos(u),
            centre[1] + b * np.sin(u),
            -a * np.sin(u),
            b * np.cos(u),
        ),
        start,
        end,
    )


def boxed(edges: tuple[Edge, ...]) -> tuple[float, float, float, float]:
    points = np.concatenate([e.curve(np.linspace(e.u[0], e.u[-1], 20001))[0] for e in edges])
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def panel(
    outline: tuple[Edge, ...],
    area: float,
    lines: tuple[Line, ...] = (),
    holes: tuple[tuple[Edge, ...], ...] = (),
    name: str = "body",
) -> Panel:
    base = empty_panel(shapes=(), area=area, name=name)
    return replace(base, pattern=Pattern(outline, lines, area, boxed(outline), holes))


def lampshade(name: str = "body") -> Panel:
    """A frustum's sector with two reference lines, a round hole and an oval one."""
    last = np.array([np.cos(np.pi - SWEEP), np.sin(np.pi - SWEEP)])
    centre = np.array([APEX, 0.0])
    p, q = (tuple(float(x) for x in centre + r * last) for r in (INNER, OUTER))
    outline = (
        straight("start", (0.0, 0.0), (INNER, 0.0)),
        bow("top", (APEX, 0.0), (INNER, INNER), np.pi, np.pi - SWEEP),
        straight("end", (p[0], p[1]), (q[0], q[1])),
        bow("base", (APEX, 0.0), (OUTER, OUTER), np.pi - SWEEP, np.pi),
    )
    holes = (
        (bow("hole", (70.0, 40.0), (8.0, 8.0), 0.7, 0.7 + TURN),),
        (bow("hole", (110.0, 130.0), (12.0, 5.0), 0.0, TURN),),
    )
    lines = (
        Line("RULING", np.array([20.0, 8.0]), np.array([120.0, 7.0])),
        Line("BEND_UP", np.array([20.1, 9.3]), np.array([120.0, 12.0]), 0.5),
    )
    area = LAMPSHADE_AREA - np.pi * 64.0 - np.pi * 60.0
    return panel(outline, area, lines, holes, name)


def lens(scale: float = 1.0) -> Panel:
    """Half an ellipse over its axis: one edge that no arc fits."""
    outline = (
        straight("start", (-80.0 * scale, 0.0), (80.0 * scale, 0.0)),
        bow("top", (0.0, 0.0), (80.0 * scale, 30.0 * scale), 0.0, np.pi),
    )
    return panel(outline, 0.5 * np.pi * 80.0 * 30.0 * scale**2)


def job(*panels: Panel, name: str = "job", tolerance: float = 0.05) -> Part:
    return Part(name, panels, 0.0, tolerance, ())


def drawn(points: Array, bulges: Array, per_segment: int = 400) -> Array:
    """Dense points on a closed path of lines and arcs."""
    z = points[:, 0] + 1j * points[:, 1]
    share = np.arange(per_segment) / per_segment
    out = []
    for a, b, bulge in zip(z, np.roll(z, -1), bulges, strict=True):
        sweep = 4.0 * np.arctan(bulge)
        if bulge == 0.0:
            out.append(a + share * (b - a))
        else:
            centre = 0.5 * (a + b) + 0.5j * (b - a) / np.tan(0.5 * sweep)
            out.append(centre + (a - centre) * np.exp(1j * sweep * share))
    path = np.concatenate(out)
    return np.stack([path.real, path.imag], axis=1)


def off_ellipse(points: Array, a: float, b: float) -> Array:
    """The distances of points near an ellipse from it: Newton for the foot's eccentric angle."""
    x, y = points.T
    u = np.arctan2(y / b, x / a)
    for _ in range(30):
        c, s = np.cos(u), np.sin(u)
        level = (b * b - a * a) * s * c + a * x * s - b * y * c
        u = u - level / ((b * b - a * a) * (c * c - s * s) + a * x * c + b * y * s)
    return np.asarray(np.hypot(x - a * np.cos(u), y - b * np.sin(u)))


ROLES = ("ENGRAVE", "MARK", "SCORE", "SEW", "GRAIN", "LABEL", "GLUE", "NOTCH_MARK")
WORKPIECE_AREA = 200.0 * 100.0 + 0.5 * np.pi * 50.0 * 20.0 - np.pi * 64.0 - 4.0 * np.pi * 0.25


def workpiece(name: str = "body", curved: bool = True) -> Panel:
    """A plate 200 x 100 whose upper side is half an ellipse (or straight), with a round hole of
    diameter 16, four stitch holes of diameter 1, a bend each way, a ruling, and every kind of
    drawing: a straight line each, of the sew line two, of a label an L, an arc to score."""
    upper = (
        bow("top", (150.0, 100.0), (50.0, 20.0), 0.0, np.pi)
        if curved
        else straight("top", (200.0, 100.0), (100.0, 100.0))
    )
    outline = (
        straight("start", (0.0, 0.0), (200.0, 0.0)),
        straight("base", (200.0, 0.0), (200.0, 100.0)),
        upper,
        straight("top", (100.0, 100.0), (0.0, 100.0)),
        straight("end", (0.0, 100.0), (0.0, 0.0)),
    )
    holes = (
        (bow("cutout", (150.0, 50.0), (8.0, 8.0), TURN, 0.0),),
        *((bow("stitch", (20.0 + 10.0 * k, 5.0), (0.5, 0.5), TURN, 0.0),) for k in range(4)),
    )
    lines = (
        Line("RULING", np.array([40.0, 10.0]), np.array([40.0, 90.0])),
        Line("BEND_UP", np.array([60.0, 0.0]), np.array([60.0, 100.0]), np.radians(30.0)),
        Line("BEND_DOWN", np.array([80.0, 0.0]), np.array([80.0, 100.0]), -np.radians(45.0)),
    )
    drawings = (
        straight("ENGRAVE", (10.0, 20.0), (30.0, 20.0)),
        straight("MARK", (10.0, 25.0), (30.0, 25.0)),
        bow("SCORE", (100.0, 50.0), (10.0, 10.0), 0.0, 1.5),
        straight("SEW", (2.0, 8.0), (2.0, 92.0)),
        straight("SEW", (2.0, 92.0), (60.0, 92.0)),
        straight("GRAIN", (110.0, 10.0), (110.0, 60.0)),
        straight("GRAIN", (110.0, 60.0), (107.0, 54.0)),
        straight("LABEL", (10.0, 40.0), (10.0, 35.0)),
        straight("LABEL", (10.0, 35.0), (13.0, 35.0)),
        straight("GLUE", (120.0, 80.0), (140.0, 80.0)),
        straight("NOTCH_MARK", (5.0, 50.0), (0.0, 50.0)),
    )
    area = WORKPIECE_AREA - (0.0 if curved else 0.5 * np.pi * 50.0 * 20.0)
    made = panel(outline, area, lines, holes, name)
    return replace(made, pattern=replace(made.pattern, drawings=drawings))
