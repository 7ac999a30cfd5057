"""Edge: one smooth line in the plane of a pattern."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from devcad.geometry.taylor import Array

PlaneCurve = Callable[[Array], tuple[Array, Array]]
"""u (n,) -> points (n, 2) and derivatives d/du (n, 2)."""


@dataclass(frozen=True, slots=True)
class Edge:
    """One smooth line, run from ``u[0]`` to ``u[-1]`` (increasing or decreasing).

    ``curve`` is callable at any u between; ``u`` (k,) lists the ends and, between them, the
    places where the curve is only tangent continuous. ``name`` is start, end, base or top for a
    piece of an outline, "cutout" where a feature was cut, the layer (ENGRAVE) for a drawing.
    """

    name: str
    curve: PlaneCurve
    u: Array
