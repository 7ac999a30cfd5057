"""The walls of a solid: along its long edges and cuts, and at its two ends."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from devcad.export._step_body import (
    Arc,
    Edge,
    Face,
    Plane,
    Point,
    Ruled,
    Straight,
    Stretch,
    Surface,
    Trace,
    Use,
)
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_faces import Rims, long_edge, rim_edge, ruling_stops
from devcad.export._step_regions import Region
from devcad.export._step_sides import parts
from devcad.export._step_strips import Strip
from devcad.export._step_walls import (
    arc_wall,
    flat_wall,
    segment,
    turned,
    wall_probes,
    wall_traces,
)
from devcad.geometry.cells import Run
from devcad.geometry.cells import Stretch as Border
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

Rail = tuple[int, bool]
"""An edge and whether it runs in the direction of the wall."""


def add_walls(draft: Draft, skin: Skin, regions: tuple[Region, ...], rims: Rims) -> None:
    """The walls of one strip: along its long sides, then along its cuts."""
    items = [item for region in regions for item in (*region.loop, *region.holes)]
    for side in (0, 1):
        borders = [x for x in items if isinstance(x, Border) and x.side == (3, 1)[side]]
        for border in sorted(borders, key=lambda b: min(b.start, b.end)):
            for part in parts(skin.sides[side], border):
                piece = skin.sides[side][part.index]
                if isinstance(piece.curves[0], Point):
                    continue
                rails = [(long_edge(draft, skin, side, part, k), True) for k in (0, 1)]
                apex = _apex(draft, skin.strip, side)
                if apex is None:
                    _add_wall(draft, side, rails, piece.probes)
                else:
                    _add_waist(draft, skin, side, [edge for edge, _ in rails], apex)
    for run in (x for x in items if isinstance(x, Run)):
        for rim in rims[run]:
            _add_wall(draft, 1, [rim_edge(draft, rim, k) for k in (0, 1)], rim.probes)


def _add_wall(draft: Draft, side: int, rails: list[Rail], probes: tuple[Array, Array]) -> None:
    """The wall between the back's edge and the front's, which run alike."""
    edges = [edge for edge, _ in rails]
    stops = [[draft.end_vertex(e, k if f else 1 - k) for k in (0, 1)] for e, f in rails]
    posts = [draft.line(stops[0][end], stops[1][end]) for end in (0, 1)]
    curves = [draft.edges[e].curve for e in edges]
    ends = np.array([[draft.points[k] for k in pair] for pair in stops])
    points = probes[1].reshape(-1, 3)
    places, flipped = None, False
    traces: list[Trace | None] = [None] * 4
    surface: Surface
    if isinstance(curves[0], Arc) and isinstance(curves[1], Arc):
        arcs = curves[0], curves[1]
        surface, flipped, traces = arc_wall(side, arcs, ends, draft.size, draft.length(edges[0]))
    else:
        lower, upper = (
            c if isinstance(c, Spline) else segment(x) for c, x in zip(curves, ends, strict=True)
        )
        flat = flat_wall(side, lower, upper)
        if flat is not None:
            surface = flat
        else:
            surface = Ruled(lower, upper) if side == 0 else Ruled(upper, lower)
            traces = wall_traces(side, surface, [isinstance(c, Spline) for c in curves])
            if isinstance(curves[0], Spline):
                probes = _within(probes, lower)
                places, points = wall_probes(side, probes)
    loop = (
        (rails[1], True),
        ((posts[1], True), False),
        (rails[0], False),
        ((posts[0], True), True),
    )
    uses = [
        Use(edge, forward == along, trace)
        for ((edge, along), forward), trace in zip(loop, traces, strict=True)
    ]
    ordered = tuple(uses if side == 0 else turned(uses))
    draft.faces.append(Face(surface, ordered, flipped, False, places, points))


def _within(probes: tuple[Array, Array], curve: Spline) -> tuple[Array, Array]:
    """The probes that lie on a part of a curve."""
    inside = (probes[0] >= curve.knots[0]) & (probes[0] <= curve.knots[-1])
    return probes[0][inside], probes[1][inside]


# the waists of thick cones


def _across(draft: Draft, minus: int, plus: int, apex: int | None) -> list[int]:
    """The edges from the back's vertex to the front's, by way of the apex if there is one."""
    stops = [minus, plus] if apex is None else [minus, apex, plus]
    return [draft.line(a, b) for a, b in pairwise(stops)]


def _apex(draft: Draft, strip: Strip, side: int) -> int | None:
    """The vertex where the layers' edges of a fitted thick cone cross, if this side has it."""
    if not (strip.ruled and strip.tips[side] and draft.layers == 2):
        return None
    name = ("apex", side)
    if name not in draft.names:
        jet = strip.patch.jet(strip.ends[:1], 0)
        draft.names[name] = draft.add_point(jet.rail((jet.v_from, jet.v_to)[side])[0, 0])
    return draft.names[name]


def _add_waist(draft: Draft, skin: Skin, side: int, rails: list[int], apex: int) -> None:
    """Two faces that meet in the apex of a thick cone that is not a right circular one."""
    for layer in (0, 1):
        rail = draft.edges[rails[layer]]
        assert isinstance(rail.curve, Spline)
        tip = Spline(
            rail.curve.degree, rail.curve.knots, 0.0 * rail.curve.poles + draft.points[apex]
        )
        curve, span, low = rail.curve, rail.span, (side == 0) != (layer == 1)
        surface = Ruled(curve, tip) if low else Ruled(tip, curve)
        u = 0.0 if low else 1.0
        pinch = draft.edge(
            ("pinch", rails[layer]),
            lambda span=span: Edge(apex, apex, Point(), span),  # type: ignore[misc]
        )
        along = np.array([0.0, 1.0])
        run = [Use(rails[layer], layer == 1, Straight(np.array([u, 0.0]), along))]
        for end in (1, 0):
            s = span[end]
            vertex = draft.end_vertex(rails[layer], end)
            stops = (apex, vertex) if layer == 1 else (vertex, apex)
            reach = (1.0 - u, u) if layer == 1 else (u, 1.0 - u)
            trace = Stretch(np.array([reach[0], s]), np.array([reach[1], s]))
            run.append(Use(draft.line(*stops), end == 0, trace))
        closing = Use(pinch, layer == 0, Straight(np.array([1.0 - u, 0.0]), along))
        uses = (
            [run[0], run[1], closing, run[2]] if layer == 1 else [run[0], run[2], closing, run[1]]
        )
        draft.faces.append(Face(surface, tuple(uses if side == 0 else turned(uses))))


# the ends


def add_end(draft: Draft, skin: Skin, end: int, regions: tuple[Region, ...]) -> None:
    """The plane walls at the first or the last ruling of an open solid."""
    strip = skin.strip
    station = (strip.first, strip.last)[end]
    if draft.corner(station, 0, 0) == draft.corner(station, 1, 0):
        return  # the sheet ends in a point: its walls meet in one edge
    m = strip.patch.frame(strip.ends[[-end]]).m[0]
    plane = Plane(draft.corners[station, 1, 0], m if end else -m)
    points = draft.corners[station].reshape(-1, 3)
    for region in regions:
        for border in region.loop:
            if isinstance(border, Border) and border.side == 2 * end:
                loop = _end_loop(draft, skin, border)
                draft.faces.append(
                    Face(plane, tuple(loop if end == 0 else turned(loop)), points=points)
                )


def _end_loop(draft: Draft, skin: Skin, border: Border) -> list[Use]:
    """The wall on a stretch of the first ruling, seen from outside."""
    stops = [ruling_stops(draft, skin, layer, border) for layer in (0, 1)]
    rulings = [[draft.line(a, b) for a, b in pairwise(along)] for along in stops]
    low, high = (border.first, border.last) if border.side == 0 else (border.last, border.first)
    posts = []
    for side, spot in enumerate((low, high)):
        minus, plus = (along[-side] for along in stops)
        apex = _apex(draft, skin.strip, side) if spot is None else None
        posts.append(_across(draft, minus, plus, apex))
    run = [Use(e, False) for e in reversed(rulings[1])]
    run += [Use(e, False) for e in reversed(posts[0])]
    run += [Use(e, True) for e in rulings[0]]
    run += [Use(e, True) for e in posts[1]]
    return run
