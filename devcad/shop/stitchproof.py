"""The proof that stitch hole k of one edge meets hole k of the other, from the patterns alone."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.checks import Check, Where, at_most
from devcad.flatten.pattern import Edge, Pattern
from devcad.geometry.locate import on_plane
from devcad.geometry.seams import nearest
from devcad.geometry.taylor import Array, rows_dot
from devcad.part import Panel
from devcad.shop.seamends import foot_on, looks
from devcad.shop.seamlines import Flags, SeamLine, blank_of

CHECK = "stitch"
LIMIT = 1e-6
"""mm: how far apart in space the feet of two holes may be that are sewn together."""
ROUNDING = 1e-12
"""Of the part's size: what rounding alone may move a foot."""
ASIDE = 1e-10
"""Of a seam's size: beside a singular point its surface is asked for."""
TURN = 1e-3
"""rad; edges that turn by more from one to the next have a corner between them."""
EVEN = 1e-7
"""mm; a hole that is as near to both sides of a corner belongs to the corner."""


@dataclass(frozen=True, slots=True)
class Proof:
    """The check of a seam, and what was measured: the lengths ``s`` (n,) of the feet along the
    first edge, and the largest distance in space between two feet that belong together, mm."""

    check: Check
    s: Array
    apart: float


def prove(line: SeamLine, centres: tuple[Array, Array]) -> Proof:
    """The check ``stitch`` of a seam from its holes' ``centres`` (n, 2) in the two patterns.

    The foot of each hole is found anew on the outline of its pattern, and looked up on the
    surface: on which ruling of the development it lies, and where. The feet of a pair may be apart
    in space by no more than 1e-6 mm, and the steps from foot to foot along the two edges may
    differ by no more. Where the edges themselves are apart (within the job's tolerance) that gap
    is taken off, across the seam: along it the feet still have to meet.
    """
    points, corner = [], np.zeros(len(centres[0]), dtype=bool)
    for side in (0, 1):
        panel, edge = line.sides[side], line.borders[side]
        flat, turns = outline_feet(panel.pattern, edge.name, centres[side])
        points.append(_on_face(panel, line, side, flat))
        corner |= turns
    one, other = points
    size = max(float(np.ptp(edge.points, axis=0).max()) for edge in line.borders)
    limit = max(LIMIT, ROUNDING * size)
    missing = np.asarray(np.isnan(one + other).any(axis=1))
    one, other = np.where(missing[:, None], np.inf, one), np.where(missing[:, None], 0.0, other)
    with np.errstate(invalid="ignore"):
        slip = np.where(missing, np.inf, _slips(line, one, other, corner | missing))
        s, uneven = _steps(line, one, other, missing)
    worst = int(np.argmax(np.maximum(slip, uneven)))
    value = float(max(slip[worst], uneven[worst]))
    x, y, z = np.where(missing[worst], np.nan, 0.5 * (one + other)[worst]).tolist()
    names = " and ".join(".".join(name) for name in line.names)
    check = at_most(
        CHECK,
        line.names[0][0],
        value,
        limit,
        "mm",
        where=Where(point=None if missing[worst] else (x, y, z)),
        says=f"holes {worst + 1} of {names} miss each other by {value:.4g} mm",
        remedy="the holes do not follow the edges: use a smaller inset",
    )
    apart = np.linalg.norm(one - other, axis=1)
    return Proof(check, s, float(apart.max()))


def _slips(line: SeamLine, one: Array, other: Array, corner: Flags) -> Array:
    """How far the feet of pairs are apart beyond the gap of the edges themselves, (n,)."""
    step = other - one
    apart = np.linalg.norm(step, axis=1)
    plain = np.maximum(apart - line.gap, 0.0)
    if not line.gap:
        return np.asarray(plain)
    kept = ~corner
    slope = line.borders[1](nearest(line.borders[1], other[kept])[0])[1]
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    along = np.abs(rows_dot(step[kept], slope))
    across = np.sqrt(np.maximum(apart[kept] ** 2 - along**2, 0.0))
    plain[kept] = np.maximum(along, across - line.gap)
    return np.asarray(plain)


def _steps(line: SeamLine, one: Array, other: Array, missing: Flags) -> tuple[Array, Array]:
    """The lengths of the feet along the first edge, and by how much more than the gap allows the
    step to each differs on the second, both (n,)."""
    kept = ~missing
    s = np.full((2, len(one)), np.nan)
    for row, (edge, points) in enumerate(zip(line.borders, (one, other), strict=True)):
        if kept.any():
            s[row, kept] = edge.arc(nearest(edge, points[kept])[0])
    steps = np.abs(np.diff(s, axis=1))
    lengths = np.array([[edge.length] for edge in line.borders])
    if line.borders[0].loop:  # the second may run over its own start
        steps = np.minimum(steps, lengths - steps)
    uneven = np.maximum(np.abs(steps[0] - steps[1]) - 2.0 * line.gap, 0.0)
    return s[0], np.concatenate([[0.0], np.nan_to_num(uneven, nan=0.0)])


def _on_face(panel: Panel, line: SeamLine, side: int, flat: Array) -> Array:
    """The points (n, 3) of a panel's face over points (n, 2) of its pattern; nan where none is."""
    blank, chain = blank_of(panel), line.borders[side].chain
    places = on_plane(blank.chain.patches, blank.developments, flat)
    if (places.patch < 0).any() and len(flat) > 1:
        aside = np.where((places.patch < 0)[:, None], _aside(flat), flat)
        places = on_plane(blank.chain.patches, blank.developments, aside)
    out = np.full((len(flat), 3), np.nan)
    for number, patch in enumerate(chain.patches):
        here = places.patch == number
        if here.any():
            jet = patch.jet(places.t[here], 0)
            out[here] = jet.c0[0] + places.v[here, None] * jet.e[0]
    return out


def _aside(flat: Array) -> Array:
    """Points (n, 2) moved a little towards the next, the last one towards the one before.

    Where an edge touches the regression curve no ruling runs through it but its own tangent.
    """
    way = np.diff(flat, axis=0, append=flat[-2:-1])
    way /= np.maximum(np.hypot(*way.T), np.finfo(float).tiny)[:, None]
    return np.asarray(flat + ASIDE * float(np.ptp(flat, axis=0).max()) * way)


def outline_feet(pattern: Pattern, name: str, centres: Array) -> tuple[Array, Flags]:
    """The feet (n, 2) of holes on the edges of this name of an outline, and which are corners.

    The nearest place; and where two sides of a corner are equally near, the corner.
    """
    edges = [edge for edge in pattern.outline if edge.name == name]
    seen = [looks(edge) for edge in edges]
    found = np.array([each(foot_on(each, centres))[0] for each in seen])
    away = np.linalg.norm(found - centres, axis=2)
    nearest_edge = away.argmin(axis=0)
    rows = np.arange(len(centres))
    flat, corner = found[nearest_edge, rows], np.zeros(len(centres), dtype=bool)
    for k, (before, after) in enumerate(pairwise(edges)):
        point = _corner_between(before, after)
        if point is None:
            continue
        even = np.abs(away[k] - away[k + 1]) <= EVEN
        even &= (nearest_edge == k) | (nearest_edge == k + 1)
        flat[even], corner[even] = point, True
    return flat, corner


def _corner_between(before: Edge, after: Edge) -> Array | None:
    """The point between two consecutive edges if they have a corner there."""
    ends = before.curve(before.u[-1:]), after.curve(after.u[:1])
    (point, one), (start, other) = ((p[0], slope[0]) for p, slope in ends)
    one, other = (
        one * np.sign(before.u[-1] - before.u[0]),
        other * np.sign(after.u[-1] - after.u[0]),
    )
    scale = float(np.hypot(*one) * np.hypot(*other))
    joined = np.hypot(*(start - point)) <= EVEN
    sine = float(one[0] * other[1] - one[1] * other[0])
    return point if joined and (abs(sine) > TURN * scale or float(one @ other) < 0.0) else None
