"""Plane facets between sharp creases whose edges are curved, written down from closed forms."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import parts

from devcad.geometry.classify import Shape
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.part import Panel

Facet = tuple[Patch, Shape, float]


def sector(
    apex: Array, first: Array, last: Array, inner: float, outer: float | Callable[[Array], Array]
) -> Facet:
    """The plane facet of a cone between the unit rulings ``first`` and ``last``, v from the apex:
    round edges about it, or any outer one, whose area is then not told."""
    across = last - (last @ first) * first
    across /= np.linalg.norm(across)
    turn = float(np.arctan2(last @ across, last @ first))

    def ruling(x: Array) -> Array:
        sin, cos = parts.taylor.sin_cos(x)
        return np.asarray(cos[..., None] * first + sin[..., None] * across)

    patch = parts.patch(lambda x: parts.constant(x, apex), ruling, inner, outer, (0.0, turn))
    area = 0.0 if callable(outer) else 0.5 * turn * (outer**2 - inner**2)
    normal = np.cross(first, across)
    return patch, Shape("plane", apex + inner * first, normal), area


def rulings(number: int, half_angle: float, turn: float = 2.0 * np.pi) -> Array:
    """The creases of a pyramid of ``number`` sides, as directions down from its apex."""
    angle = np.linspace(0.0, turn, number + 1)
    return np.stack(
        [
            np.sin(half_angle) * np.cos(angle),
            np.sin(half_angle) * np.sin(angle),
            np.full_like(angle, -np.cos(half_angle)),
        ],
        axis=1,
    )


def bumped_cone(
    number: int,
    half_angle: float = 0.5,
    *,
    inner: float = 120.0,
    outer: float = 260.0,
    turn: float = 2.0 * np.pi,
    thickness: float = 1.5,
) -> Panel:
    """A cone as a press brake makes it: ``number`` plane sectors, closed over a whole turn."""
    way = rulings(number, half_angle, turn)
    if turn == 2.0 * np.pi:
        way[-1] = way[0]
    apex = np.array([0.0, 0.0, 300.0])
    made = [sector(apex, a, b, inner, outer) for a, b in pairwise(way)]
    return parts.chained(made, closed=turn == 2.0 * np.pi, thickness=thickness)


WAVE = 0.05
"""Radians per mm: the edges of plates are sine waves of 4 and 6 mm."""


def plates(widths: list[float], angles: list[float], *, thickness: float) -> Panel:
    """Plane plates side by side with parallel creases, folded by ``angles``, 80 mm long between
    two waves that run on over the creases."""
    start, heading, origin = 0.0, 0.0, np.zeros(3)
    made = []
    for k, width in enumerate(widths):
        way = np.array([0.0, np.cos(heading), np.sin(heading)])
        made.append(_plate(start, width, origin, way))
        origin, start = origin + width * way, start + width
        heading += angles[k] if k < len(angles) else 0.0
    return parts.chained(made, closed=False, thickness=thickness)


def _plate(start: float, width: float, origin: Array, way: Array) -> Facet:
    """The plate from ``origin`` on along ``way``, rulings along x, arc length as parameter."""

    def base(x: Array) -> Array:
        return np.asarray(parts.constant(x, origin - start * way) + x[..., None] * way)

    def low(x: Array) -> Array:
        return np.asarray(4.0 * parts.taylor.sin_cos(WAVE * x)[0])

    def high(x: Array) -> Array:
        return np.asarray(parts.constant(x, 80.0) + 6.0 * parts.taylor.sin_cos(WAVE * x)[1])

    ends = np.array([start, start + width])
    patch = parts.patch(
        base, lambda x: parts.constant(x, np.array([1.0, 0.0, 0.0])), low, high, (start, ends[1])
    )
    waves = np.diff(6.0 * np.sin(WAVE * ends) + 4.0 * np.cos(WAVE * ends)) / WAVE
    area = 80.0 * width + float(waves[0])
    return patch, Shape("plane", origin, np.cross([1.0, 0.0, 0.0], way)), area
