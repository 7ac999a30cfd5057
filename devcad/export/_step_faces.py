"""The skins of a strip: for every region a face on each layer, its loops edge by edge."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from devcad.export._step_body import (
    Cone,
    Cylinder,
    Edge,
    Face,
    Line,
    Plane,
    Point,
    Ruled,
    Straight,
    Stretch,
    Trace,
    Use,
)
from devcad.export._step_chart import heights
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_folds import reversed_equal, reversed_trace
from devcad.export._step_places import place_across
from devcad.export._step_regions import Region
from devcad.export._step_rims import Rim
from devcad.export._step_sides import Part, part_of, parts
from devcad.export._step_walls import grid, turned
from devcad.geometry.cells import Run
from devcad.geometry.cells import Stretch as Border
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

Rims = dict[Run, tuple[Rim, ...]]


def add_skins(draft: Draft, skin: Skin, regions: tuple[Region, ...], rims: Rims) -> None:
    """The back and the front of one strip, a face for every region."""
    for layer in range(draft.layers):
        for region in regions:
            _add_skin(draft, skin, layer, region, rims)


def _add_skin(draft: Draft, skin: Skin, layer: int, region: Region, rims: Rims) -> None:
    front = layer == draft.layers - 1
    outer = [u for item in region.loop for u in _uses(draft, skin, layer, item, rims)]
    holes = [list(_uses(draft, skin, layer, run, rims)) for run in region.holes]
    loops = _merged([outer, *holes]) if draft.touches else [outer, *holes]
    ordered = [tuple(loop if front else turned(loop)) for loop in loops]
    surface = skin.surfaces[layer]
    flipped = not isinstance(surface, (Plane, Ruled)) and (
        (skin.frame is not None and skin.frame.side > 0.0) != front
    )
    places, points = _probes(skin, layer)
    draft.faces.append(Face(surface, ordered[0], flipped, True, places, points, tuple(ordered[1:])))


def _merged(loops: list[list[Use]]) -> list[list[Use]]:
    """The loops, those joined that run along one edge to and fro: a hole whose side lies on the
    strip's end opens into it."""
    for k, hole in enumerate(loops[1:], 1):
        for i, there in enumerate(hole):
            for j, here in enumerate(loops[0]):
                if here.edge == there.edge and here.forward != there.forward:
                    outer = loops[0][:j] + hole[i + 1 :] + hole[:i] + loops[0][j + 1 :]
                    return _merged([outer, *loops[1:k], *loops[k + 1 :]])
    return loops


def _uses(draft: Draft, skin: Skin, layer: int, item: Border | Run, rims: Rims) -> list[Use]:
    """An item of a loop as its edges."""
    if isinstance(item, Run):
        return [_rim_use(draft, rim, layer) for rim in rims[item]]
    if item.side in (0, 2):
        return _ruling_uses(draft, skin, layer, item)
    side = 1 if item.side == 1 else 0
    pieces = parts(skin.sides[side], item)
    found = [_long_use(draft, skin, side, part, layer) for part in pieces]
    uses = [u for u in found if _drawn(draft, u)]
    return uses if side == 1 else [Use(u.edge, not u.forward, u.trace) for u in reversed(uses)]


def _drawn(draft: Draft, use: Use) -> bool:
    """Whether the edge appears in a loop: a collapsed edge only where a surface needs it."""
    return not (isinstance(draft.edges[use.edge].curve, Point) and use.trace is None)


# edges of cuts


def rim_edge(draft: Draft, rim: Rim, layer: int) -> tuple[int, bool]:
    """The edge of a cut on a layer, and whether it runs in the cut's direction: a straight one
    may lie on a ruling that is there already."""
    start, end = rim.starts[layer], rim.ends[layer]
    curve = rim.curves[layer]
    if isinstance(curve, Line):
        return draft.line_use(start, end)
    probes = None
    if isinstance(curve, Spline):
        probes = (rim.probes[0], rim.probes[1][:, layer])
    name = ("rim", rim.leg.cut, rim.leg.track, rim.leg.u, layer)
    return draft.edge(name, lambda: Edge(start, end, curve, rim.spans[layer], probes)), True


def _rim_use(draft: Draft, rim: Rim, layer: int) -> Use:
    edge, forward = rim_edge(draft, rim, layer)
    trace = rim.traces[layer]
    if isinstance(trace, Stretch) and not forward:
        trace = Stretch(trace.end, trace.start)
    elif not forward:
        trace = reversed_trace(trace, rim.spans[layer], draft.edges[edge].span)
    return Use(edge, forward, trace)


# long edges


def long_edge(draft: Draft, skin: Skin, side: int, part: Part, layer: int) -> int:
    """The edge of a part of a long side on a layer."""
    strip, pieces = skin.strip, skin.sides[side]
    piece = pieces[part.index]
    for k, corner in ((part.index, piece.corners[0]), (part.index + 1, piece.corners[1])):
        name = ("kink", *draft.home(strip, side), k, layer)
        if 0 < k < len(pieces) and name not in draft.names:
            draft.names[name] = draft.add_point(corner[layer])
    start, end = _part_ends(draft, skin, side, part, layer)
    curve, span = piece.curves[layer], piece.spans[layer]
    if isinstance(curve, Line):
        return draft.line(start, end)
    inside = np.ones(len(piece.probes[0]), dtype=bool)
    name = ("long", *draft.home(strip, side), part.index, layer)
    if part.low is not None or part.high is not None:
        ends = np.array([draft.points[start], draft.points[end]])
        reach = _reach(draft, skin, side, part, layer)
        curve, span, _ = part_of(piece, layer, *reach, ends)
        inside = (piece.probes[0] > reach[0]) & (piece.probes[0] < reach[1])
        name = (*name, part)  # type: ignore[assignment]
    probes = None
    if isinstance(curve, Spline):
        probes = (piece.probes[0][inside], piece.probes[1][inside, layer])
    return draft.edge(name, lambda: Edge(start, end, curve, span, probes))


def _part_ends(draft: Draft, skin: Skin, side: int, part: Part, layer: int) -> tuple[int, int]:
    """The vertices of a part of a long edge."""
    strip, last = skin.strip, len(skin.sides[side]) - 1
    ends = []
    stops = ((part.low, 0, strip.first, 0), (part.high, last, strip.last, 1))
    for spot, outermost, station, k in stops:
        if spot is not None:
            ends.append(draft.spot(spot)[layer])
        elif part.index == outermost:
            ends.append(draft.corner(station, side, layer))
        else:
            ends.append(draft.names["kink", *draft.home(strip, side), part.index + k, layer])
    return ends[0], ends[1]


def _reach(draft: Draft, skin: Skin, side: int, part: Part, layer: int) -> tuple[float, float]:
    """The parameters of a piece between which a part of it lies."""
    low, high = skin.sides[side][part.index].spans[layer]
    return (
        low if part.low is None else draft.shares[part.low.key][layer],
        high if part.high is None else draft.shares[part.high.key][layer],
    )


def _long_use(draft: Draft, skin: Skin, side: int, part: Part, layer: int) -> Use:
    """A part of a long edge as its skin runs along it in the direction of t: the earlier strip's
    own edge, run backwards, where the two lie on one another."""
    piece = skin.sides[side][part.index]
    whole = part.low is None and part.high is None
    source = draft.folds.get((skin.strip.first, side)) if whole else None
    shared = draft.names.get(("long", *source, 0, layer)) if source else None
    if shared is not None and len(skin.sides[side]) == 1:
        known = draft.edges[shared]
        trace = reversed_trace(piece.traces[layer], piece.spans[layer], known.span)
        if trace is not None and reversed_equal(piece.curves[layer], known.curve, draft.size):
            return Use(shared, False, trace)
    trace = piece.traces[layer]
    edge = long_edge(draft, skin, side, part, layer)
    if not whole:
        ends = draft.ends(edge)
        trace = part_of(piece, layer, *_reach(draft, skin, side, part, layer), ends)[2]
    return Use(edge, True, trace)


# rulings


def ruling_stops(draft: Draft, skin: Skin, layer: int, border: Border) -> list[int]:
    """The vertices along a stretch of a ruling in the order of v: its ends, and where cuts touch
    it."""
    end = border.side // 2
    station = (skin.strip.first, skin.strip.last)[end]
    low, high = (border.first, border.last) if end == 0 else (border.last, border.first)
    ends = [
        draft.corner(station, side, layer) if spot is None else draft.spot(spot)[layer]
        for side, spot in enumerate((low, high))
    ]
    points = np.array([draft.points[k] for k in ends])
    way = points[1] - points[0]
    between = []
    for touch in draft.touches.get(station, []):
        share = float((draft.points[touch[layer]] - points[0]) @ way / max(way @ way, 1e-300))
        if 0.0 < share < 1.0:
            between.append((share, touch[layer]))
    return [ends[0], *(k for _, k in sorted(between)), ends[1]]


def _ruling_uses(draft: Draft, skin: Skin, layer: int, border: Border) -> list[Use]:
    """A stretch of the ruling at an end of the strip."""
    end = border.side // 2
    stops = ruling_stops(draft, skin, layer, border)
    if stops[0] == stops[-1]:
        tip = _tip_use(draft, skin, layer, end, stops[0])
        return [] if tip is None else [tip if end == 0 else Use(tip.edge, False, tip.trace)]
    uses = []
    for low, high in pairwise(stops):
        edge, forward = draft.line_use(low, high)
        a, b = (low, high) if forward else (high, low)
        uses.append(Use(edge, forward, _ruling_trace(draft, skin, layer, end, a, b)))
    return uses if end == 0 else [Use(u.edge, not u.forward, u.trace) for u in reversed(uses)]


def _tip_use(draft: Draft, skin: Skin, layer: int, end: int, vertex: int) -> Use | None:
    """A ruling without length, where a surface needs it."""
    if not isinstance(skin.surfaces[layer], Ruled):
        return None
    s = float(skin.strip.course.s[-end])
    u = 0.0 if layer == draft.layers - 1 else 1.0
    trace = Straight(np.array([u, s]), np.array([1.0 - 2.0 * u, 0.0]))
    name = ("tip", skin.strip.first, end, layer)
    return Use(draft.edge(name, lambda: Edge(vertex, vertex, Point(), (0.0, 1.0))), True, trace)


def _ruling_trace(
    draft: Draft, skin: Skin, layer: int, end: int, start: int, stop: int
) -> Trace | None:
    """The image of the line between two vertices on the ruling at an end of the strip."""
    surface, strip = skin.surfaces[layer], skin.strip
    if isinstance(surface, Plane):
        return None
    points = np.array([draft.points[k] for k in (start, stop)])
    if isinstance(surface, (Cylinder, Cone)):
        assert skin.frame is not None
        u = float(skin.frame.angle(strip.ends[[-end]])[0])
        v0, v1 = heights(surface, points)
        return Straight(np.array([u, v0]), np.array([0.0, np.sign(v1 - v0)]))
    s = float(strip.course.s[-end])
    station = (strip.first, strip.last)[end]
    corners = [draft.corner(station, side, layer) for side in (0, 1)]
    front = layer == draft.layers - 1
    places = []
    for vertex, point in zip((start, stop), points, strict=True):
        low, high = (draft.points[k] for k in (corners if front else corners[::-1]))
        if vertex in corners:
            share = float((vertex == corners[1]) == front)
        else:
            share = float((point - low) @ (high - low) / ((high - low) @ (high - low)))
        u = place_across(surface, np.array([share]), np.array([s]))[0]
        places.append(np.array([u, s]))
    return Stretch(places[0], places[1])


def _probes(skin: Skin, layer: int) -> tuple[Array | None, Array]:
    """Places on a skin and the true points there: on both edges and half way."""
    low, high = skin.true[:, 0, layer], skin.true[:, 1, layer]
    points = np.concatenate([low, 0.5 * (low + high), high])
    surface = skin.surfaces[layer]
    if not isinstance(surface, Ruled):
        return None, points
    u = 0.0 if layer == len(skin.strip.layers) - 1 else 1.0
    places = grid(skin.places, (u, 0.5, 1.0 - u))
    weights = [x.denominator(skin.places) for x in (surface.low, surface.high)]
    places[len(low) : -len(low), 0] = weights[0] / (weights[0] + weights[1])
    return places, points
