"""Flanks: the chains of a sheet folded along curved creases, side by side in one pattern."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain as chained

import numpy as np

from devcad.flatten.development import Development
from devcad.flatten.green import bounds
from devcad.flatten.pattern import Edge, Pattern
from devcad.geometry.creasing import Crease, Side, heading
from devcad.geometry.taylor import Array

SIDES = ("start", "top", "end", "base")
"""The sides of a flank, in the order of its outline."""
SCORE = "SCORE"
"""The name of curved creases among a pattern's drawings."""
Hanging = tuple[int, int, Side]
"""A flank's parent, its own number, and the parent's side that is its crease."""


def beside(crease: Crease, development: Development) -> tuple[float, Array]:
    """Where the child's first ruling lies in the pattern in which its parent has this
    ``development``: its angle, and the place (2,) of the crease's start."""
    t = np.array([crease.parent.domain[0]])
    jet = crease.parent.jet(t, 1)
    v, slope = (jet.v_from if crease.side == "base" else jet.v_to)[:2]
    child = crease.child.frame(t)
    turn = heading(crease.parent.frame(t), v, slope) - heading(child, 0.0 * t)
    omega = float(development.series(t)[0, 0] + turn[0])
    return omega, development.points(t, v)[0]


def apart(crease: Crease, developments: tuple[Development, Development], t: Array) -> Array:
    """How far the crease as the parent's side of the pattern has it is from the child's, at t (n,),
    mm: ``developments`` are theirs."""
    jet = crease.parent.jet(t, 0)
    v = (jet.v_from if crease.side == "base" else jet.v_to)[0]
    one, other = developments
    return np.asarray(np.linalg.norm(one.points(t, v) - other.origin(t), axis=1))


def from_left(hangings: Sequence[Hanging]) -> list[int]:
    """The flanks' numbers from the left of the sheet to its right."""
    order = [0]
    for parent, child, side in hangings:
        at = order.index(parent)
        order.insert(at if side == "base" else at + 1, child)
    return order


def one_sheet(patterns: Sequence[Pattern], hangings: Sequence[Hanging]) -> Pattern:
    """The pattern of a whole sheet from those of its flanks: one outline, and the creases drawn on
    it as SCORE, in the direction of growing t."""
    order = from_left(hangings)
    sides = [_sides(pattern) for pattern in patterns]
    outline = (
        *chained(*(sides[k]["start"] for k in order)),
        *sides[order[-1]]["top"],
        *chained(*(sides[k]["end"] for k in reversed(order))),
        *sides[order[0]]["base"],
    )
    scores = [
        Edge(SCORE, edge.curve, edge.u if side == "top" else edge.u[::-1].copy())
        for parent, _, side in hangings
        for edge in _in_order(sides[parent][side], side)
    ]
    return Pattern(
        outline,
        tuple(chained(*(patterns[k].lines for k in order))),
        sum(pattern.area for pattern in patterns),
        bounds(outline),
        tuple(chained(*(patterns[k].holes for k in order))),
        (*scores, *chained(*(patterns[k].drawings for k in order))),
    )


def _sides(pattern: Pattern) -> dict[str, list[Edge]]:
    """The outline by sides, each with the notches that follow upon its edges."""
    out: dict[str, list[Edge]] = {name: [] for name in SIDES}
    first = next((k for k, edge in enumerate(pattern.outline) if edge.name in SIDES), 0)
    name = SIDES[0]
    for edge in (*pattern.outline[first:], *pattern.outline[:first]):
        name = edge.name if edge.name in SIDES else name
        out[name].append(edge)
    return out


def _in_order(edges: list[Edge], side: Side) -> list[Edge]:
    """The edges of a side, first that with the smallest t: along the base they run back."""
    return edges if side == "top" else edges[::-1]
