"""The pattern of a chain: outline, reference lines, exact area and box."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.drawings import draw, not_repeated
from devcad.flatten.edges import DROPPED
from devcad.flatten.pattern import Edge, Line, Pattern, PlaneCurve, Unrolled
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

Pairs = Sequence[tuple[Patch, Unrolled]]
"""The patches of a chain in order, each with its place in the plane."""
PlaneDensity = Callable[[Array, Array], Array]
"""Points (n, 2) and derivatives (n, 2) -> densities (n,)."""
COLLAPSED = 1e-12
"""An edge shorter than this share of the pattern is a point: an apex."""
KINK = 1e-6
"""An edge that turns by more than this at one point, in radians, has a corner there."""
LINE_EVERY = np.radians(15.0)
"""A reference ruling is drawn after this much bending: none on a plane."""
TURN_STEPS = 8
"""Steps of the Illinois rule, order 1.44: from 1/64 of an edge to below 1e-12 of it."""


def lay_out(
    chain: Chain,
    developments: Sequence[Unrolled],
    rulings: tuple[Array, ...],
    drawings: tuple[Drawing, ...] = (),
) -> Pattern:
    """The pattern of a chain, its front towards the viewer, counterclockwise.

    The area is the surface's own (quadrature of q + v a), the box is found to rounding.
    Reference lines: joints (rulings where smooth, bends where creased) and certified rulings
    about every 15 degrees of bending. Drawings are those on the sheet, without what is a point.
    """
    pairs = list(zip(chain.patches, developments, strict=True))
    outline = border(pairs)
    box = bounds(outline)
    least = DROPPED * float(np.hypot(box[2] - box[0], box[3] - box[1]))
    drawn = [edge for each in drawings for edge in draw(each, *pairs[each.patch])]
    kept = tuple(edge for edge in drawn if _length_bound(edge) > least)
    lines = not_repeated(reference_lines(chain, pairs, rulings), kept, least)
    area = sum(surface_area(patch) for patch in chain.patches)
    return Pattern(outline, lines, area, box, drawings=kept)


def border(pairs: Pairs) -> tuple[Edge, ...]:
    """The outline of a chain in the plane: along the first ruling, up the top edges, back along
    the last ruling and down the base edges. Edges that are a point are left out."""
    first, last = pairs[0], pairs[-1]
    edges = [
        _ruling_edge("start", *first, first[0].domain[0], upwards=True),
        *(edge for pair in pairs for edge in _rail_edges("top", *pair)),
        _ruling_edge("end", *last, last[0].domain[1], upwards=False),
        *(edge for pair in reversed(pairs) for edge in _rail_edges("base", *pair)),
    ]
    corners = np.concatenate([e.curve(e.u)[0] for e in edges])
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    return tuple(e for e in edges if _length_bound(e) > COLLAPSED * size)


def reference_lines(chain: Chain, pairs: Pairs, rulings: tuple[Array, ...]) -> tuple[Line, ...]:
    """Joints (rulings where smooth, bends where creased), and of the certified ``rulings`` about
    one for every 15 degrees of bending."""
    return (*_joints(chain, pairs), *_references(pairs, rulings))


def surface_area(patch: Patch) -> float:
    """The area of a patch in mm2: the integral of q (v1 - v0) + a (v1^2 - v0^2) / 2."""
    return integral(patch, _area_density)


def integral(patch: Patch, density: Callable[[Frame], Array], *, scale: float = 0.0) -> float:
    """The integral over t of a density (n,) made from the frame, to rounding.

    A total below ``scale`` is nothing: a density that is only rounding has no shape to resolve.
    """
    series = chebyshev.resolve(
        lambda t: density(patch.frame(t))[:, None],
        patch.segments,
        scale=scale / (patch.domain[1] - patch.domain[0]),
    )
    return float(series.antiderivative()(np.array(patch.domain))[1, 0])


def _area_density(f: Frame) -> Array:
    return np.asarray(f.q * (f.v_to - f.v_from) + 0.5 * f.a * (f.v_to**2 - f.v_from**2))


def perimeter(outline: tuple[Edge, ...]) -> float:
    """The length of an outline in mm."""
    return float(sum(abs(_integral(e, _speed)) for e in outline))


def enclosed_area(outline: tuple[Edge, ...]) -> float:
    """The area inside an outline by Green's formula, mm2, positive counterclockwise."""
    return float(sum(_integral(e, _moment) for e in outline))


def _speed(_point: Array, slope: Array) -> Array:
    return np.asarray(np.hypot(slope[:, 0], slope[:, 1]))


def _moment(point: Array, slope: Array) -> Array:
    return np.asarray(0.5 * (point[:, 0] * slope[:, 1] - point[:, 1] * slope[:, 0]))


def _integral(edge: Edge, density: PlaneDensity) -> float:
    """The integral of a density along an edge in the direction of its run."""
    knots = np.sort(edge.u)
    points, slopes = edge.curve(np.linspace(knots[0], knots[-1], 9))
    # the moment of a line through the origin is rounding: it is nothing beside these sizes
    scale = float(np.abs(slopes).max() * max(np.abs(points).max(), 1.0 if slopes.any() else 0.0))
    series = chebyshev.resolve(
        lambda u: density(*edge.curve(u))[:, None], knots, scale=1e-3 * scale
    )
    value = float(series.antiderivative()(knots[-1:])[0, 0])
    return value if edge.u[-1] > edge.u[0] else -value


def _rail_edges(name: str, patch: Patch, unrolled: Unrolled) -> list[Edge]:
    """The image of the extent's end: t increases along the top and decreases along the base.

    In pieces where it has a corner: the edge of a thick sheet's middle, which stands square to
    a skin that was cut aslant, has one wherever the bending jumps.
    """
    top = name == "top"

    def curve(t: Array) -> tuple[Array, Array]:
        f = patch.frame(t)
        jet = patch.jet(t, 1)
        v, slope = (jet.v_to if top else jet.v_from)[:2]
        origin, e, m = unrolled.axes(t)
        tangent = (f.p + slope)[:, None] * e + (f.q + v * f.a)[:, None] * m
        return origin + v[:, None] * e, tangent

    knots = patch.segments
    inner = knots[1:-1]
    reach = 1e-9 * (knots[-1] - knots[0])  # a smooth edge turns by as little over this
    before, after = (_heading(curve(inner + side * reach)[1]) for side in (-1.0, 1.0))
    kinks = np.flatnonzero(np.abs(np.angle(after / before)) > KINK) + 1
    pieces = np.split(knots, kinks)
    runs = [
        np.append(piece, following[:1])
        for piece, following in itertools.zip_longest(pieces, pieces[1:], fillvalue=knots[:0])
    ]
    edges = [Edge(name, _kept_inside(curve, run), run if top else run[::-1].copy()) for run in runs]
    return edges if top else edges[::-1]


def _heading(slopes: Array) -> NDArray[np.complex128]:
    """Plane directions as unit complex numbers; 1 where there is none."""
    z = slopes[:, 0] + 1j * slopes[:, 1]
    size = np.abs(z)
    return np.divide(z, size, out=np.ones_like(z), where=size > 0.0)


def _kept_inside(curve: PlaneCurve, run: Array) -> PlaneCurve:
    """The curve, asked just inside the ends of a run: there it answers for this side."""
    low, high = np.nextafter(run[0], run[-1]), np.nextafter(run[-1], run[0])
    return lambda t: curve(np.clip(t, low, high))


def _ruling_edge(name: str, patch: Patch, unrolled: Unrolled, t: float, *, upwards: bool) -> Edge:
    """The image of one ruling, u = v."""
    at = np.array([t])
    jet = patch.jet(at, 0)
    origin, direction = (image[0] for image in unrolled.axes(at)[:2])
    ends = np.array([jet.v_from[0, 0], jet.v_to[0, 0]])

    def curve(v: Array) -> tuple[Array, Array]:
        return origin + v[:, None] * direction, np.broadcast_to(direction, (len(v), 2))

    return Edge(name, curve, ends if upwards else ends[::-1].copy())


def _length_bound(edge: Edge) -> float:
    """The length of a coarse polygon on an edge: zero where the edge is a point."""
    u = np.linspace(edge.u[0], edge.u[-1], 9)
    return float(np.linalg.norm(np.diff(edge.curve(u)[0], axis=0), axis=1).sum())


def _ruling_lines(
    layer: str, patch: Patch, unrolled: Unrolled, t: Array, angle: float
) -> list[Line]:
    """The images of the rulings at t (n,)."""
    jet = patch.jet(t, 0)
    starts = unrolled.points(t, jet.v_from[0])
    ends = unrolled.points(t, jet.v_to[0])
    return [Line(layer, start, end, angle) for start, end in zip(starts, ends, strict=True)]


def _joints(chain: Chain, pairs: Pairs) -> list[Line]:
    """The joints between patches as lines: rulings where smooth, else bends up or down."""
    out = []
    for (patch, unrolled), joint in zip(pairs[1:], chain.joints, strict=True):
        bend = "BEND_UP" if joint.angle > 0.0 else "BEND_DOWN"
        layer, angle = ("RULING", 0.0) if joint.smooth else (bend, joint.angle)
        at = np.array(patch.domain[:1])
        out += _ruling_lines(layer, patch, unrolled, at, angle)
    return out


def _references(pairs: Pairs, rulings: tuple[Array, ...]) -> list[Line]:
    """Certified rulings to bend along, one for every 15 degrees of bending."""
    out = []
    for (patch, unrolled), t in zip(pairs, rulings, strict=True):
        if len(t) < 3:
            continue
        bending = np.cumsum(np.abs(patch.frame(0.5 * (t[1:] + t[:-1])).c) * np.diff(t))[:-1]
        step = np.floor(bending / LINE_EVERY + 1e-9)
        picked = np.flatnonzero(np.diff(step, prepend=0.0) > 0.0)
        out += _ruling_lines("RULING", patch, unrolled, t[picked + 1], 0.0)
    return out


def bounds(outline: tuple[Edge, ...]) -> tuple[float, float, float, float]:
    """The exact bounding box: the extremes of every edge."""
    points = np.concatenate([_extremes(edge) for edge in outline])
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _extremes(edge: Edge) -> Array:
    """Points of an edge, among them all where it turns back in x or in y, (n, 2).

    A turn between two samples is a zero of the slope, found by the Illinois rule; an error of
    1e-7 in the parameter is one of 1e-14 in the coordinate.
    """
    knots = np.sort(edge.u)
    starts = [np.linspace(a, b, 64, endpoint=False) for a, b in itertools.pairwise(knots)]
    u = np.concatenate([*starts, knots[-1:]])
    points, slopes = edge.curve(u)
    at, axis = np.nonzero(slopes[:-1] * slopes[1:] < 0.0)
    low, high = u[at], u[at + 1]
    below, above = slopes[at, axis], slopes[at + 1, axis]
    found = [points]
    for _ in range(TURN_STEPS if at.size else 0):
        rise = above - below
        part = np.divide(above, rise, out=np.zeros_like(rise), where=rise != 0.0)
        middle = high - part * (high - low)
        turn, slope = edge.curve(middle)
        found.append(turn)
        value = slope[np.arange(at.size), axis]
        passed = value * above <= 0.0
        low, below = np.where(passed, high, low), np.where(passed, above, 0.5 * below)
        high, above = middle, value
    return np.concatenate(found)
