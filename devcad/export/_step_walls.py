"""The walls of a solid: the straight connections of the two skins' edges, normal to the sheet.

Loops and traces run in the order of a wall on the from side seen from outside: the front's edge
forward, the post at the end down to the back, the back's edge backward, the post at the start up.
"""

from __future__ import annotations

import numpy as np

from devcad.export._step_body import (
    Arc,
    Cone,
    Cylinder,
    Plane,
    Ruled,
    Straight,
    Stretch,
    Surface,
    Trace,
    Use,
)
from devcad.export._step_chart import heights
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.taylor import Array

PLANAR = 1e-8  # mm: a wall flatter than this is a plane to every kernel


def turned(loop: list[Use]) -> list[Use]:
    """The same loop the other way round."""
    return [Use(u.edge, not u.forward, u.trace) for u in reversed(loop)]


def segment(ends: Array) -> Spline:
    """The straight line between two points as a spline over [0, 1]."""
    return Spline(1, np.array([0.0, 0.0, 1.0, 1.0]), ends)


def flat_wall(side: int, lower: Spline, upper: Spline) -> Plane | None:
    """The plane of a wall between two splines, outward, if it is one."""
    points = np.concatenate([lower.poles, upper.poles])
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre, full_matrices=False)[2][2]
    if np.abs((points - centre) @ normal).max() > PLANAR:
        return None
    chords = np.diff(0.5 * (lower.poles + upper.poles), axis=0)
    post = upper.poles[:-1] - lower.poles[:-1]
    outward = np.cross(chords, -post if side == 0 else post).sum(axis=0)
    return Plane(centre, normal if normal @ outward > 0.0 else -normal)


def wall_traces(side: int, surface: Ruled, fitted: list[bool]) -> list[Trace | None]:
    """The traces of a wall's edges in the order plus, post at the end, minus, post at the start."""
    knots = surface.low.knots
    s0, s1 = float(knots[0]), float(knots[-1])
    plus = 1.0 if side == 0 else 0.0

    def rail(u: float, spline: bool) -> Trace:
        if spline:
            return Straight(np.array([u, 0.0]), np.array([0.0, 1.0]))
        return Stretch(np.array([u, s0]), np.array([u, s1]))

    def post(s: float) -> Trace:
        return Stretch(np.array([1.0 - plus, s]), np.array([plus, s]))

    return [rail(plus, fitted[1]), post(s1), rail(1.0 - plus, fitted[0]), post(s0)]


def arc_wall(
    side: int, arcs: tuple[Arc, Arc], ends: Array, size: float, sweep: float
) -> tuple[Surface, bool, list[Trace | None]]:
    """The wall between two arcs about one axis: plane, cylinder or cone, whether its normal points
    inward, and the traces of its edges."""
    minus, plus = arcs
    axis, x = minus.axis, minus.x
    rise = float((plus.centre - minus.centre) @ axis)
    widening = plus.radius - minus.radius
    post = rise * axis + widening * x
    outward = np.cross(np.cross(axis, x), -post if side == 0 else post)
    if abs(rise) <= FLOOR * size:
        return Plane(minus.centre, outward / np.linalg.norm(outward)), False, [None] * 4
    turn = 1.0
    wide = plus if widening > 0.0 else minus
    surface: Cylinder | Cone
    if abs(widening) <= FLOOR * size:
        surface = Cylinder(minus.centre, axis, x, minus.radius)
    else:
        if rise * widening < 0.0:  # a cone's axis points to where it is wide
            x = np.cos(sweep) * x + np.sin(sweep) * np.cross(axis, x)
            axis, turn = -axis, -1.0
        angle = float(np.arctan2(abs(widening), abs(rise)))
        surface = Cone(wide.centre, axis, x, wide.radius, angle)
    v = heights(surface, ends[:, 0])  # of the minus and the plus arc
    start = 0.0 if turn > 0.0 else sweep
    along = np.array([turn, 0.0])
    up = np.array([0.0, np.sign(v[1] - v[0])])
    traces: list[Trace | None] = [
        Straight(np.array([start, v[1]]), along),
        Straight(np.array([sweep - start, v[0]]), up),
        Straight(np.array([start, v[0]]), along),
        Straight(np.array([start, v[0]]), up),
    ]
    return surface, bool(minus.x @ outward < 0.0), traces


def wall_probes(side: int, probes: tuple[Array, Array]) -> tuple[Array, Array]:
    """Places on a fitted wall and the true points there."""
    s, true = probes
    minus, plus = true[:, 0], true[:, 1]
    u = 0.0 if side == 0 else 1.0
    points = np.concatenate([minus, 0.5 * (minus + plus), plus])
    return grid(s, (u, 0.5, 1.0 - u)), points


def grid(s: Array, across: tuple[float, ...]) -> Array:
    """Places (u, s) for every u of ``across`` and every s, (n, 2)."""
    return np.concatenate([np.stack([np.full_like(s, u), s], axis=1) for u in across])
