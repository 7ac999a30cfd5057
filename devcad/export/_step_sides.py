"""Long edges that notches cross: where on them a place is, and the parts between two places."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import (
    Arc,
    Curve,
    Ellipse,
    Line,
    Point,
    Ruled,
    Straight,
    Stretch,
    Trace,
)
from devcad.export._step_conics import round_points
from devcad.export._step_draft import Skin
from devcad.export._step_rails import Piece
from devcad.geometry.cells import Spot
from devcad.geometry.cells import Stretch as Border
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

ROUNDS = 8
"""Newton steps towards a place on an edge; three are enough from one of 65 samples."""
SHARES = np.linspace(0.0, 1.0, 65)
SLIVER = 1e-11
"""A shorter part of a strip is none."""


@dataclass(frozen=True, slots=True)
class Part:
    """The part of piece ``index`` of a long edge between two spots, None at the piece's ends."""

    index: int
    low: Spot | None = None
    high: Spot | None = None


def parts(pieces: list[Piece], border: Border) -> list[Part]:
    """What a stretch of the border takes of the pieces of a long edge, in the order of t."""
    low, high = (border.first, border.last) if border.side == 1 else (border.last, border.first)
    start = -np.inf if low is None else low.at
    end = np.inf if high is None else high.at
    least = SLIVER * (pieces[-1].t[1] - pieces[0].t[0])
    out = []
    for k, piece in enumerate(pieces):
        a, b = piece.t
        if min(b, end) - max(a, start) > least:
            out.append(Part(k, low if start > a else None, high if end < b else None))
    return out


def place_on(
    skin: Skin, side: int, s: float, t: float, points: Array, ways: Array
) -> tuple[tuple[float, ...], Array]:
    """Where a cut ends on a long edge: the parameter on every layer and the points (layers, 3).

    ``points`` (layers, 3) are the ends of the cut on the layers and ``ways`` its directions there:
    where the layer ends elsewhere, beside a mitre, the cut goes straight on to its edge. On
    fitted faces the place is that of the strip's own parameter ``s``.
    """
    pieces = skin.sides[side]
    piece = next((p for p in pieces if t <= p.t[1]), pieces[-1])
    found = []
    for layer, surface in enumerate(skin.surfaces):
        curve = piece.curves[layer]
        if isinstance(curve, Point):
            raise GeometryError(
                "a cutout ends in the apex", remedy="end the cutout before the apex"
            )
        if isinstance(surface, Ruled):
            front = layer == len(skin.surfaces) - 1
            rail = surface.low if (side == 0) == front else surface.high
            point = rail(np.array([s]))[0]
            found.append((s if isinstance(curve, Spline) else _angle(piece, layer, point), point))
        else:
            found.append(_met(piece, layer, points[layer], ways[layer]))
    return tuple(w for w, _ in found), np.array([p for _, p in found])


def _met(piece: Piece, layer: int, point: Array, way: Array) -> tuple[float, Array]:
    """Where the line through a point along ``way`` comes nearest to an edge."""
    low, high = piece.spans[layer]
    w = low + (high - low) * SHARES
    near = np.linalg.norm(_at(piece, layer, w)[0] - point, axis=1).argmin()
    place = w[near : near + 1]
    for _ in range(ROUNDS):
        here, slope = _at(piece, layer, place)
        sides = np.stack([slope[0], -way], axis=1)
        step = float(np.linalg.lstsq(sides, point - here[0], rcond=None)[0][0])
        place = np.clip(place + step, low, high)
        if abs(step) <= 1e-15 * (high - low):
            break
    return float(place[0]), _at(piece, layer, place)[0][0]


def _at(piece: Piece, layer: int, w: Array) -> tuple[Array, Array]:
    """Points and slopes of an edge at its parameters w (n,), (n, 3) each."""
    curve = piece.curves[layer]
    if isinstance(curve, Spline):
        return curve(w), curve.derivative(w)
    if isinstance(curve, (Arc, Ellipse)):
        return round_points(curve, w), round_points(
            replace(curve, centre=np.zeros(3)), w + 0.5 * np.pi
        )
    start, end = piece.corners[:, layer]
    way = (end - start) / np.linalg.norm(end - start)
    return start + w[:, None] * way, np.repeat(way[None], len(w), axis=0)


def _angle(piece: Piece, layer: int, point: Array) -> float:
    """The parameter of a point on a circle or an ellipse, within the edge's span."""
    curve, span = piece.curves[layer], piece.spans[layer]
    assert isinstance(curve, (Arc, Ellipse))
    major, minor = (1.0, 1.0) if isinstance(curve, Arc) else (curve.major, curve.minor)
    arm = point - curve.centre
    raw = np.arctan2(arm @ np.cross(curve.axis, curve.x) / minor, arm @ curve.x / major)
    middle = 0.5 * (span[0] + span[1])
    return float(raw + 2.0 * np.pi * np.round((middle - raw) / (2.0 * np.pi)))


def part_of(
    piece: Piece, layer: int, low: float, high: float, ends: Array
) -> tuple[Curve, tuple[float, float], Trace | None]:
    """The curve of a piece between two of its parameters, its span and its trace; ``ends`` (2, 3)
    are the vertices there."""
    curve, trace = piece.curves[layer], piece.traces[layer]
    if isinstance(curve, Line):
        return curve, (0.0, float(np.linalg.norm(ends[1] - ends[0]))), trace
    if isinstance(curve, Spline):
        cut = spline_part(curve, low, high)
        cut.poles[[0, -1]] = ends
        return cut, (low, high), _part_of_trace(trace, piece.spans[layer], low, high)
    if isinstance(curve, Arc) and not isinstance(trace, Spline):
        x = np.cos(low) * curve.x + np.sin(low) * np.cross(curve.axis, curve.x)
        if isinstance(trace, Straight):
            trace = Straight(trace.origin + low * trace.direction, trace.direction)
        return replace(curve, x=x), (0.0, high - low), trace
    return curve, (low, high), _part_of_trace(trace, piece.spans[layer], low, high)


def _part_of_trace(
    trace: Trace | None, span: tuple[float, float], low: float, high: float
) -> Trace | None:
    if isinstance(trace, Spline):
        return spline_part(trace, low, high)
    if isinstance(trace, Stretch):
        way = (trace.end - trace.start) / (span[1] - span[0])
        return Stretch(trace.start + (low - span[0]) * way, trace.start + (high - span[0]) * way)
    return trace


def spline_part(spline: Spline, low: float, high: float) -> Spline:
    """The part of a spline between two parameters, on its own knots there: the same curve.

    Source: Ramshaw, Blossoming (the poles are the blossom's values at consecutive knots).
    """
    p, knots = spline.degree, spline.knots
    inner = knots[(knots > low) & (knots < high)]
    own = np.concatenate([[low] * (p + 1), inner, [high] * (p + 1)])
    poles = spline.poles
    if spline.weights is not None:
        poles = np.concatenate([spline.weights * poles, spline.weights], axis=1)
    found = []
    for k in range(len(own) - p - 1):
        widest = k + int(np.argmax(np.diff(own[k : k + p + 2])))
        inside = 0.5 * (own[widest] + own[widest + 1])
        span = int(np.searchsorted(knots[p + 1 : -p - 1], inside, side="right")) + p
        found.append(_blossom(knots, poles, p, span, own[k + 1 : k + p + 1]))
    out = np.array(found)
    if spline.weights is None:
        return replace(spline, knots=own, poles=out)
    columns = spline.poles.shape[1]
    weights = out[:, columns:]
    return replace(spline, knots=own, poles=out[:, :columns] / weights, weights=weights)


def _blossom(knots: Array, poles: Array, p: int, span: int, places: Array) -> Array:
    """The blossom of the polynomial on a knot span at p places."""
    d = poles[span - p : span + 1].copy()
    for r, x in enumerate(places.tolist(), 1):
        for j in range(p, r - 1, -1):
            low, high = knots[span - p + j], knots[span + 1 + j - r]
            share = (x - low) / (high - low)
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    return np.asarray(d[p])
