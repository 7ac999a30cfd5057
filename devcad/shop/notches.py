"""Notches and alignment marks: where two edges that are sewn together have to meet."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge, Pattern
from devcad.flatten.rings import self_crossing
from devcad.flatten.shapes import MARK, line
from devcad.geometry.taylor import Array
from devcad.shop.corners import place
from devcad.shop.polygons import fine_polygon
from devcad.shop.settings import EdgeFinish, EdgeName, Notches, NotchShape

NOTCH = "notch"
"""The name of the edges that a notch puts into an outline."""
NOTCH_MARK = "NOTCH_MARK"
"""The role of the short lines that begin at the notches' tips."""
OF_ALLOWANCE = 0.5
"""A notch may bite through so much of the allowance, and stops short of the seam."""
V_WIDTH = 2.0 / float(np.sqrt(3.0))
"""A V is so many depths wide: 60 degrees."""
SLIT, SLIT_SHARE = 0.3, 0.2
"""mm, and at most of its depth: the width of a slit, for cut files hold closed cuts alone."""
APART = 2.0
"""Widths of a notch from the middle of one to that of its twin."""
TICK, LEAST_TICK = 1.0, 0.02
"""mm, the length of the line behind a notch's tip; and of its depth, where a hole is near."""
STRAIGHT = np.radians(10.0)
"""An outline that turns by more has a corner, over which no notch reaches."""
LOOKS = 65
"""Places between two of an edge's u's between which crossings are looked for."""
ROUNDS = 10
"""Searches among so many places, each between two of the last: 64^10 is beyond rounding."""
FINE = 1e-5
"""Of the outline's size: the sagitta of the polygon that may not cross itself."""

Flags = NDArray[np.bool_]
Outline = tuple[Edge, ...]
Spot = tuple[int, float]
"""A place on an outline: the number of the edge, and its u."""


@dataclass(frozen=True, slots=True)
class Anchor:
    """A place on the seam line of an edge at which the mate has one too.

    ``point`` (2,) in the pattern and the unit ``normal`` (2,) out of the sheet; ``hole`` is how
    far outwards the middle of a stitch hole lies on the normal, mm, nan where there is none, and
    ``clear`` how far round it nothing is drawn.
    """

    edge: str
    point: Array
    normal: Array
    hole: float = float("nan")
    clear: float = 0.0


def notched(
    pattern: Pattern,
    anchors: Sequence[Anchor],
    notches: Notches,
    edges: Mapping[EdgeName, EdgeFinish],
) -> Pattern:
    """The pattern with its notches and alignment marks.

    Where an edge is raw or turned and has an allowance, its outline is bitten ``depth`` deep
    where the anchor's normal meets it: a V of 60 degrees, a slit (a closed cut 0.3 mm wide) or a T
    (a slit with a bar across its end). A short line of role NOTCH_MARK begins at the tip and runs
    inwards. Where edges are lapped, have tabs or no allowance, nothing is bitten: a line of role
    MARK, ``depth`` long, runs from the seam line out through the allowance, or into the sheet
    where there is none, and leaves the stitch hole out.

    Args:
        pattern: with allowances; its outline is what is cut.
        edges: the finishes of the panel's edges; one that is missing is raw without allowance.
    Raises:
        GeometryError: a notch deeper than half the allowance or up to a stitch hole, none of the
            outline's edges across the normal, a notch over a corner of the outline, or into
            another notch.
    """
    finishes: dict[str, EdgeFinish] = dict(edges.items())
    cuts, marks = [], []
    for anchor in anchors:
        finish = finishes.get(anchor.edge, EdgeFinish(0.0))
        if finish.allowance > 0.0 and finish.finish in ("raw", "turned"):
            _refuse_depth(notches.depth, anchor, finish.allowance)
            spot = _across(pattern.outline, anchor, finish.allowance)
            cuts.append(_bite(pattern.outline, anchor, spot, notches.shape, notches.depth))
        else:
            marks += _mark(anchor, notches.depth, finish.allowance)
    if not cuts:
        return replace(pattern, drawings=(*pattern.drawings, *marks)) if marks else pattern
    outline = _cut(pattern.outline, cuts)
    area = pattern.area - sum(_bitten(pattern.outline, bite) for bite in cuts)
    ticks = tuple(line(bite.tip, bite.end, NOTCH_MARK) for bite in cuts)
    drawings = (*pattern.drawings, *marks, *ticks)
    return replace(pattern, outline=outline, area=area, bbox=bounds(outline), drawings=drawings)


@dataclass(frozen=True, slots=True)
class _Bite:
    """What a notch takes out of an outline: from one spot to another along the run, and the
    straight lines through ``points`` (k, 2) in place of it; and the line behind its tip, from
    ``tip`` to ``end`` (2,)."""

    first: Spot
    last: Spot
    points: Array
    tip: Array
    end: Array


def _refuse_depth(depth: float, anchor: Anchor, allowance: float) -> None:
    """GeometryError for a notch that bites through half the allowance, or near a stitch hole."""
    half = OF_ALLOWANCE * allowance
    hole = allowance - anchor.hole - anchor.clear if np.isfinite(anchor.hole) else np.inf
    limit, words, other = (
        (half, f"in an allowance of {allowance:.4g} mm, limit half of it", "a larger allowance")
        if half <= hole
        else (hole, f"before a stitch hole, limit {hole:.4g} mm", "a larger inset")
    )
    if depth > limit * (1.0 + 1e-12):
        raise GeometryError(
            f"notches: {depth:.4g} mm deep {words}",
            place=f"{anchor.edge} > {place(anchor.point)}",
            value=depth,
            limit=limit,
            remedy=f"give a depth of at most {limit:.4g} mm, or {other}"
            if limit > 0.0
            else f"leave the notches out, or give {other}",
        )


def beside(notches: Notches) -> float:
    """How far along a seam from its place the two notches of a pair stand, mm."""
    return 0.5 * APART * _width(notches.shape, notches.depth)


def _width(shape: NotchShape, depth: float) -> float:
    """How wide a notch is, mm: the bar of a T is as long as the notch is deep."""
    if shape == "slit":
        return min(SLIT, SLIT_SHARE * depth)
    return V_WIDTH * depth if shape == "V" else depth


def _bite(outline: Outline, anchor: Anchor, spot: Spot, shape: NotchShape, depth: float) -> _Bite:
    """A notch about a spot of the outline, along the outline's normal there."""
    width = _width(shape, depth)
    slit = min(SLIT, SLIT_SHARE * depth)
    mouth = width if shape == "V" else slit
    first, last = (_walk(outline, anchor, spot, 0.5 * way * mouth) for way in (-1, 1))
    middle, along = _at(outline, spot)
    inwards = np.array([-along[1], along[0]])  # the sheet is on the left
    tip = middle + depth * inwards
    a, b = _at(outline, first)[0], _at(outline, last)[0]
    half, bar = 0.5 * slit * along, 0.5 * width * along
    shoulder = tip - slit * inwards
    stem, end = (shoulder - half, shoulder + half), (tip - bar, tip + bar)
    inner = {
        "V": (tip,),
        "slit": (tip - half, tip + half),
        "T": (stem[0], shoulder - bar, *end, shoulder + bar, stem[1]),
    }[shape]
    tick = min(TICK, depth / 3.0)
    if np.isfinite(anchor.hole):  # and ends before the stitch hole
        free = float((tip - anchor.point) @ anchor.normal) - anchor.hole - anchor.clear
        tick = min(tick, max(0.5 * free, LEAST_TICK * depth))
    return _Bite(first, last, np.array([a, *inner, b]), tip, tip + tick * inwards)


def _across(outline: Outline, anchor: Anchor, allowance: float) -> Spot:
    """Where an anchor's normal meets the outline: the crossing nearest to the allowance."""
    best: tuple[float, Spot] | None = None
    across = np.array([-anchor.normal[1], anchor.normal[0]])
    for number, edge in enumerate(outline):
        knots = zip(edge.u[:-1], edge.u[1:], strict=True)
        u = np.concatenate([np.linspace(a, b, LOOKS) for a, b in knots])
        away = edge.curve(u)[0] - anchor.point
        side, along = away @ across, away @ anchor.normal
        for k in np.flatnonzero((side[:-1] <= 0.0) != (side[1:] <= 0.0)).tolist():
            step = float(np.hypot(*(away[k + 1] - away[k])))
            if abs(along[k] - allowance) > allowance + step:
                continue
            at = _zero(edge, anchor.point, across, float(u[k]), float(u[k + 1]))
            far = float((edge.curve(np.array([at]))[0][0] - anchor.point) @ anchor.normal)
            off = abs(far - allowance)
            if far >= 0.0 and off <= allowance and (best is None or off < best[0]):
                best = off, (number, at)
    if best is None:
        raise GeometryError(
            "notches: nothing of the outline lies across the seam line",
            place=f"{anchor.edge} > {place(anchor.point)}",
            value=allowance,
            remedy="leave the notches out, or move what cuts the edge away",
        )
    return best[1]


def _zero(edge: Edge, origin: Array, across: Array, low: float, high: float) -> float:
    """The u between two at which an edge crosses the line through ``origin`` square to
    ``across``."""
    sign = float((edge.curve(np.array([low]))[0][0] - origin) @ across) <= 0.0
    return _first(lambda u: ((edge.curve(u)[0] - origin) @ across <= 0.0) != sign, low, high)


def _first(beyond: Callable[[Array], Flags], low: float, high: float) -> float:
    """The u between two from which on a place is ``beyond`` something, to rounding."""
    for _ in range(ROUNDS):
        looks = np.linspace(low, high, LOOKS)
        there = beyond(looks[1:])
        k = int(np.argmax(there)) if there.any() else LOOKS - 2
        if looks[k] == low and looks[k + 1] == high:
            break
        low, high = float(looks[k]), float(looks[k + 1])
    return 0.5 * (low + high)


def _at(outline: Outline, spot: Spot) -> tuple[Array, Array]:
    """The point at a spot and the unit direction of the run there."""
    edge = outline[spot[0]]
    points, slopes = edge.curve(np.array([spot[1]]))
    run = slopes[0] * np.sign(edge.u[-1] - edge.u[0])
    return points[0], run / max(float(np.hypot(*run)), np.finfo(float).tiny)


def _walk(outline: Outline, anchor: Anchor, spot: Spot, distance: float) -> Spot:
    """The spot at a distance in a straight line from another, along the run or (below 0) against.

    Raises:
        GeometryError: a corner is nearer.
    """
    number, u = spot
    centre, heading = _at(outline, spot)
    way, reach = (1, distance) if distance > 0.0 else (-1, -distance)
    for _ in range(len(outline) + 1):
        edge = outline[number]
        end = float(edge.u[-1] if way > 0 else edge.u[0])
        looks = np.linspace(u, end, LOOKS)
        far = np.hypot(*(edge.curve(looks)[0] - centre).T) >= reach
        if far.any():
            k = int(np.argmax(far))
            low = float(looks[max(k - 1, 0)])
            return number, _away(edge, centre, reach, low, float(looks[k]))
        before = _at(outline, (number, end))[1]
        number = (number + way) % len(outline)
        u = float(outline[number].u[0] if way > 0 else outline[number].u[-1])
        after = _at(outline, (number, u))[1]
        if min(float(before @ after), float(heading @ after)) < np.cos(STRAIGHT):
            break
    raise GeometryError(
        "notches: a notch reaches over a corner of the outline",
        place=f"{anchor.edge} > {place(anchor.point)}",
        value=reach,
        remedy="give another number for every, or smaller notches",
    )


def _away(edge: Edge, centre: Array, reach: float, low: float, high: float) -> float:
    """The u between two at which an edge is so far from a point."""
    return _first(lambda u: np.hypot(*(edge.curve(u)[0] - centre).T) >= reach, low, high)


def _order(outline: Outline, spot: Spot) -> tuple[int, float]:
    """What orders spots along the run."""
    edge = outline[spot[0]]
    return spot[0], abs(spot[1] - float(edge.u[0]))


def _cut(outline: Outline, bites: Sequence[_Bite]) -> Outline:
    """The outline with its notches.

    Raises:
        GeometryError: two notches, or a notch and the outline, run into each other.
    """
    ordered = sorted(bites, key=lambda bite: _order(outline, bite.first))
    for bite, after in pairwise(ordered):
        wraps = _order(outline, bite.last) < _order(outline, bite.first)
        if wraps or _order(outline, after.first) < _order(outline, bite.last):
            raise _too_near(after.points[0], bite)
    out: list[Edge] = []
    for bite, after in zip(ordered, [*ordered[1:], ordered[0]], strict=True):
        out += [line(a, b, NOTCH) for a, b in pairwise(bite.points)]
        out += _between(outline, bite.last, after.first)
    made = tuple(out)
    old, new = (fine_polygon(edges, _fine(outline))[0] for edges in (outline, made))
    at = self_crossing(new)
    if at is not None or len(new) < len(old) // 2:
        raise _too_near(np.array(at) if at is not None else ordered[0].tip, ordered[0])
    return _begun(made, outline)


def _too_near(point: Array, bite: _Bite) -> GeometryError:
    return GeometryError(
        "notches: a notch runs into another one, or through the sheet",
        place=place(point),
        value=float(np.hypot(*(bite.tip - bite.points[0]))),
        remedy="use smaller notches, or a larger number for every",
    )


def _fine(outline: Outline) -> float:
    left, low, right, high = bounds(outline)
    return FINE * max(right - left, high - low)


def _between(outline: Outline, start: Spot, stop: Spot) -> list[Edge]:
    """The edges of an outline from one spot on to another, round its end where that lies before."""
    number, u = start
    out = []
    for k in range(len(outline) + 1):
        edge = outline[number]
        ahead = _order(outline, stop) >= _order(outline, (number, u))
        if number == stop[0] and (k or ahead):
            out.append(_part(edge, u, stop[1]))
            break
        out.append(_part(edge, u, float(edge.u[-1])))
        number = (number + 1) % len(outline)
        u = float(outline[number].u[0])
    return [edge for edge in out if edge.u[0] != edge.u[-1]]


def _part(edge: Edge, first: float, last: float) -> Edge:
    """An edge from one of its u to another, in its run."""
    low, high = min(first, last), max(first, last)
    inner = [float(u) for u in edge.u if low < u < high]
    return replace(edge, u=np.array([first, *inner, last]))


def _begun(made: Outline, outline: Outline) -> Outline:
    """The new outline from where the old one began, if that is left."""
    begin = outline[0].curve(outline[0].u[:1])[0][0]
    starts = np.array([edge.curve(edge.u[:1])[0][0] for edge in made])
    k = int(np.argmin(np.hypot(*(starts - begin).T)))
    return (*made[k:], *made[:k])


def _bitten(outline: Outline, bite: _Bite) -> float:
    """The area in mm2 that a notch takes."""
    along = _between(outline, bite.first, bite.last)
    back = [line(a, b) for a, b in zip(bite.points[:0:-1], bite.points[-2::-1], strict=True)]
    origin = bite.points[0]
    return enclosed_area(tuple(_moved(edge, origin) for edge in (*along, *back)))


def _moved(edge: Edge, origin: Array) -> Edge:
    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        return points - origin, slopes

    return replace(edge, curve=curve)


def _mark(anchor: Anchor, depth: float, allowance: float) -> list[Edge]:
    """An alignment mark, in pieces where it would run through a stitch hole."""
    low, high = (0.0, min(depth, allowance)) if allowance > 0.0 else (-depth, 0.0)
    pieces = [(low, high)]
    if np.isfinite(anchor.hole):
        pieces = [
            (low, min(high, anchor.hole - anchor.clear)),
            (max(low, anchor.hole + anchor.clear), high),
        ]
    return [
        line(anchor.point + a * anchor.normal, anchor.point + b * anchor.normal, MARK)
        for a, b in pieces
        if b - a > LEAST_TICK * depth
    ]
