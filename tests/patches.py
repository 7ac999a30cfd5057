"""Patches written down by hand from closed forms: the tests' own geometry."""

from __future__ import annotations

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array


def frustum(
    lower: float = 100.0, upper: float = 50.0, height: float = 120.0, sweep: float = 2 * np.pi
) -> Patch:
    """Cone frustum about z; with lower == upper a cylinder, with upper == 0 a full cone."""
    slant = float(np.hypot(height, lower - upper))

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        zero = np.zeros_like(sin)
        rise = taylor.constant(height / slant, order, t.size)
        lean = (upper - lower) / slant
        return RulingJet(
            np.stack([lower * cos, lower * sin, zero], axis=-1),
            np.stack([lean * cos, lean * sin, rise], axis=-1),
            taylor.constant(0.0, order, t.size),
            taylor.constant(slant, order, t.size),
        )

    return Patch(field, (0.0, sweep))


def helix_tangent(
    radius: float = 3.0,
    rise: float = 4.0,
    length: float = 10.0,
    extent: tuple[float, float] = (1.0, 3.0),
) -> Patch:
    """Tangent surface of the helix (a cos, a sin, b .), by arc length: a flat annulus."""
    speed = float(np.hypot(radius, rise))

    def field(t: Array, order: int) -> RulingJet:
        angle = taylor.variable(t, order + 1) / speed
        sin, cos = taylor.sin_cos(angle)
        curve = np.stack([radius * cos, radius * sin, rise * angle], axis=-1)
        return RulingJet(
            curve[: order + 1],
            taylor.derivative(curve),
            taylor.constant(extent[0], order, t.size),
            taylor.constant(extent[1], order, t.size),
        )

    return Patch(field, (0.0, length))


def ellipse_cylinder(a: float = 3.0, b: float = 2.0, height: float = 1.0) -> Patch:
    """Upright cylinder over an ellipse, by the eccentric angle."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        return RulingJet(
            np.stack([a * cos, b * sin, np.zeros_like(sin)], axis=-1),
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(height, order, t.size),
        )

    return Patch(field, (0.0, 2 * np.pi))


def slanted_pipe(radius: float = 10.0) -> Patch:
    """Cylinder cut by the plane z = 20 + x: its pattern ends in z = 20 + 10 cos(s / 10)."""
    whole = frustum(radius, radius, 1.0)

    def field(t: Array, order: int) -> RulingJet:
        jet = whole.field(t, order)
        _, cos = taylor.sin_cos(taylor.variable(t, order))
        top = radius * cos
        top[0] += 2.0 * radius
        return RulingJet(jet.c0, jet.e, jet.v_from, top)

    return Patch(field, whole.domain)


def hyperboloid(reach: float = 1.0) -> Patch:
    """One family of rulings of x^2 + y^2 - z^2 = 1: ruled, not developable."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        zero = np.zeros_like(sin)
        return RulingJet(
            np.stack([cos, sin, zero], axis=-1),
            np.stack([-sin, cos, zero + taylor.constant(1.0, order, t.size)], axis=-1)
            / np.sqrt(2.0),
            taylor.constant(-reach, order, t.size),
            taylor.constant(reach, order, t.size),
        )

    return Patch(field, (0.0, 2 * np.pi))


def wall(start: Array, end: Array, height: float) -> Patch:
    """An upright rectangle over the segment start -> end (3,), t in [0, 1]."""

    def field(t: Array, order: int) -> RulingJet:
        share = taylor.variable(t, order)
        c0 = taylor.mul(share, taylor.constant_vector(end - start, order, t.size))
        c0[0] += start
        return RulingJet(
            c0,
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(height, order, t.size),
        )

    return Patch(field, (0.0, 1.0))


def prism(corners: Array, height: float) -> tuple[Patch, ...]:
    """The upright walls around a closed polygon (n, 2)."""
    at = np.column_stack([corners, np.zeros(len(corners))])
    return tuple(wall(at[k], at[(k + 1) % len(at)], height) for k in range(len(at)))
