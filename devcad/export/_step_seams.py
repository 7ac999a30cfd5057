"""Seams in STEP: sheets that meet have equal vertices there, and equal curves where they can.

Nothing is fitted anew. An edge of a later sheet takes the curve of an earlier one where the two
run alike within half of what kernels tell apart, which lines and conics do; lines and circles are
divided at the other's vertices first. Edges that were fitted apart from each other stay as they
are, but are fitted so closely that a kernel sews them, and how far they are apart is measured.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.checks import Check, at_most
from devcad.export._step_body import (
    Arc,
    Body,
    Edge,
    Ellipse,
    Line,
    Point,
    Straight,
    Stretch,
    Trace,
    Use,
)
from devcad.export._step_conics import round_points
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.seams import Border, Ties, border, largest_gap, nearest
from devcad.geometry.taylor import Array
from devcad.part import Part
from devcad.seams import closeness_of

CHECK = "step-seam"
TIED = 5e-8
"""Half of what the kernels tell apart, mm: a vertex or a curve that moves so far stays in place."""
SEWN = 2e-7
"""How closely sheets are fitted that meet others, mm: kernels sew at 1e-6."""
SAMPLES = 33
"""Points of an edge that are compared."""
ZOOMS, ZOOM = 10, 33
"""The nearest point of an edge is looked for on finer and finer grids."""

Span = tuple[float, float]


class _Sheet:
    """A body while its edges are divided and replaced."""

    def __init__(self, body: Body) -> None:
        self.body = body
        self.vertices = list(body.vertices)
        self.edges = list(body.edges)
        self.loops = [[list(loop) for loop in (f.loop, *f.holes)] for f in body.faces]

    def points(self, edge: Edge, u: Array) -> Array:
        """The points of an edge at its parameters (n,), (n, 3)."""
        if isinstance(edge.curve, Line):
            start, end = self.vertices[edge.start], self.vertices[edge.end]
            return np.asarray(start + u[:, None] / edge.span[1] * (end - start))
        if isinstance(edge.curve, (Arc, Ellipse)):
            return round_points(edge.curve, u)
        assert isinstance(edge.curve, Spline)
        return edge.curve(u)

    def samples(self, edge: Edge, count: int = SAMPLES) -> Array:
        """Points of an edge from its start to its end, (count, 3)."""
        return self.points(edge, np.linspace(*edge.span, count))

    def made(self) -> Body:
        """The body as it is now."""
        faces = tuple(
            replace(face, loop=tuple(loops[0]), holes=tuple(tuple(loop) for loop in loops[1:]))
            for face, loops in zip(self.body.faces, self.loops, strict=True)
        )
        return replace(
            self.body, vertices=np.array(self.vertices), edges=tuple(self.edges), faces=faces
        )


@dataclass(frozen=True, slots=True)
class _Side:
    """An edge of a panel: its sheet, the curve, and how near its body keeps to it, mm."""

    number: int
    sheet: _Sheet
    border: Border
    reach: float

    def run(self) -> list[int]:
        """The numbers of the body's edges that lie on it."""
        sheet = self.sheet
        on = nearest(self.border, np.array(sheet.vertices))[1] <= self.reach
        found = []
        for k, edge in enumerate(sheet.edges):
            if not isinstance(edge.curve, Point) and on[edge.start] and on[edge.end]:
                inner = sheet.samples(edge, 9)[1:-1]
                if nearest(self.border, inner)[1].max() <= self.reach:
                    found.append(k)
        return found


@dataclass(frozen=True, slots=True)
class Shared:
    """An edge that two sheets share: what the seam is called, its two panels' numbers, the edge as
    each of them has it, and how near those two are, mm."""

    name: str
    panels: tuple[int, int]
    borders: tuple[Border, Border]
    closeness: float


def coinciding(part: Part) -> list[Shared]:
    """The seams of a part along which two sheets coincide as they stand; not that of a tube, which
    has no edge there."""
    numbers = {panel.name: k for k, panel in enumerate(part.panels)}
    out = []
    for meeting in part.seams:
        (one, edge), (other, opposite) = meeting.edges
        panels = numbers[one], numbers[other]
        chains = [part.panels[k].chain for k in panels]
        around = one == other and chains[0].closed and {edge, opposite} == {"start", "end"}
        if around or part.panels[panels[0]].thickness or part.panels[panels[1]].thickness:
            continue
        near = closeness_of(chains, part.tolerance)
        borders = border(chains[0], edge, near), border(chains[1], opposite, near)
        if largest_gap(*borders)[0] <= near:  # else it is partly bent, or apart
            out.append(Shared(f"{one}.{edge} and {other}.{opposite}", panels, borders, near))
    return out


def shared(
    bodies: Sequence[Body], seams: Sequence[Shared], tolerance: float
) -> tuple[list[Body], list[Check]]:
    """The bodies with equal vertices and curves along the seams, and for each the check
    ``step-seam``: how far the edges in the file are apart.

    ``tolerance`` is how closely edges were fitted at least, mm.
    """
    if not seams:
        return list(bodies), []
    sheets = [_Sheet(body) for body in bodies]
    pairs = []
    for seam in seams:
        reach = 2.0 * tolerance + seam.closeness
        first, second = (
            _Side(k, sheets[k], edge, reach)
            for k, edge in zip(seam.panels, seam.borders, strict=True)
        )
        pairs.append((seam.name, first, second))
    ties, curves = Ties(), Ties()
    for _, first, second in pairs:
        for one, other in ((first, second), (second, first)):
            _divide(one.sheet, one.run(), _ends(other))
    for _, first, second in pairs:
        _tie_vertices(first, second, ties)
    for number, point in ties.keys:
        sheet, index = ties.root((number, point))
        sheets[number].vertices[point] = sheets[sheet].vertices[index]
    for _, first, second in pairs:
        _tie_edges(first, second, ties, curves)
    for number, edge in curves.keys:
        source, index = curves.root((number, edge))
        if (source, index) != (number, edge):
            forward = ties.root((number, sheets[number].edges[edge].start)) == ties.root(
                (source, sheets[source].edges[index].start)
            )
            _take(sheets[number], edge, sheets[source].edges[index], forward=forward)
    checks = [_gap(name, first, second) for name, first, second in pairs]
    return [sheet.made() for sheet in sheets], checks


def _ends(side: _Side) -> list[Array]:
    """The vertices along a side."""
    edges = [side.sheet.edges[k] for k in side.run()]
    return [
        side.sheet.vertices[k] for k in dict.fromkeys(v for e in edges for v in (e.start, e.end))
    ]


def _divide(sheet: _Sheet, run: list[int], points: list[Array]) -> None:
    """Divide the lines and circles of a run at points on them that are no vertices yet."""
    for point in points:
        ends = {v for k in run for v in (sheet.edges[k].start, sheet.edges[k].end)}
        if min(float(np.linalg.norm(sheet.vertices[v] - point)) for v in ends) <= TIED:
            continue
        for k in run:
            u = _place(sheet, sheet.edges[k], point)
            if u is not None:
                run = [*run, _divided(sheet, k, u, point)]
                break


def _place(sheet: _Sheet, edge: Edge, point: Array) -> float | None:
    """The parameter of a point inside an edge, if it is a line or a circle and the point on it."""
    low, high = edge.span
    if isinstance(edge.curve, Line):
        start, end = sheet.vertices[edge.start], sheet.vertices[edge.end]
        u = float((point - start) @ (end - start)) / high
    elif isinstance(edge.curve, Arc):
        arm = point - edge.curve.centre
        y = np.cross(edge.curve.axis, edge.curve.x)
        u = low + float(np.arctan2(arm @ y, arm @ edge.curve.x) - low) % (2.0 * np.pi)
    else:
        return None
    if not low < u < high:
        return None
    on = sheet.points(edge, np.array([u]))[0]
    return u if float(np.linalg.norm(on - point)) <= TIED else None


def _divided(sheet: _Sheet, number: int, u: float, point: Array) -> int:
    """Divide an edge at u in a new vertex; the number of its second half."""
    edge, vertex, second = sheet.edges[number], len(sheet.vertices), len(sheet.edges)
    low, high = edge.span
    sheet.vertices.append(np.array(point))
    begin, rest = (low, u), (u, high)
    spans = (begin, (0.0, high - u)) if isinstance(edge.curve, Line) else (begin, rest)
    sheet.edges[number] = replace(edge, end=vertex, span=spans[0])
    sheet.edges.append(replace(edge, start=vertex, span=spans[1]))
    for loops in sheet.loops:
        for loop in loops:
            for k, use in reversed(list(enumerate(loop))):
                if use.edge == number:
                    halves = [
                        Use(number, use.forward, _cut(use.trace, edge.span, begin, spans[0])),
                        Use(second, use.forward, _cut(use.trace, edge.span, rest, spans[1])),
                    ]
                    loop[k : k + 1] = halves if use.forward else halves[::-1]
    return second


def _cut(trace: Trace | None, whole: Span, part: Span, span: Span) -> Trace | None:
    """A trace over the ``part`` of the ``whole`` span of its edge, whose own span it becomes."""
    if isinstance(trace, Straight):
        return replace(trace, origin=trace.origin + (part[0] - span[0]) * trace.direction)
    if isinstance(trace, Stretch):
        ends = [
            trace.start + (x - whole[0]) / (whole[1] - whole[0]) * (trace.end - trace.start)
            for x in part
        ]
        return Stretch(ends[0], ends[1])
    return trace


def _tie_vertices(first: _Side, second: _Side, ties: Ties) -> None:
    """Tie the vertices of two sides that are one point."""
    ours, theirs = (
        sorted({v for k in side.run() for e in [side.sheet.edges[k]] for v in (e.start, e.end)})
        for side in (first, second)
    )
    for v in theirs:
        away = [
            float(np.linalg.norm(first.sheet.vertices[w] - second.sheet.vertices[v])) for w in ours
        ]
        if away and min(away) <= TIED:
            ties.tie((first.number, ours[int(np.argmin(away))]), (second.number, v))


def _tie_edges(first: _Side, second: _Side, ties: Ties, curves: Ties) -> None:
    """Tie the edges of two sides that run alike, with one parameter but for its direction."""
    ours = first.run()
    for k in second.run():
        edge = second.sheet.edges[k]
        ends = [ties.root((second.number, v)) for v in (edge.start, edge.end)]
        points = second.sheet.samples(edge)
        for j in ours:
            known = first.sheet.edges[j]
            there = [ties.root((first.number, v)) for v in (known.start, known.end)]
            if type(known.curve) is not type(edge.curve) or sorted(there) != sorted(ends):
                continue
            run = first.sheet.samples(known)
            run = run if there == ends else run[::-1]
            if np.linalg.norm(run - points, axis=1).max() <= TIED:
                curves.tie((first.number, j), (second.number, k))
                break


def _take(sheet: _Sheet, number: int, known: Edge, *, forward: bool) -> None:
    """Give an edge the curve of another one, forward or run backwards."""
    edge = sheet.edges[number]
    start, end = (edge.start, edge.end) if forward else (edge.end, edge.start)
    probes = edge.probes
    if probes is not None:
        share = (probes[0] - edge.span[0]) / (edge.span[1] - edge.span[0])
        share = share if forward else 1.0 - share
        probes = known.span[0] + share * (known.span[1] - known.span[0]), probes[1]
    sheet.edges[number] = Edge(start, end, known.curve, known.span, probes)
    for loops in sheet.loops:
        for loop in loops:
            for k, use in enumerate(loop):
                if use.edge == number:
                    trace = _retimed(use.trace, edge.span, known.span, forward=forward)
                    loop[k] = Use(number, use.forward == forward, trace)


def _retimed(trace: Trace | None, span: Span, other: Span, *, forward: bool) -> Trace | None:
    """A trace of an edge over ``span`` as one over the ``other`` span, or run backwards."""
    if isinstance(trace, Spline):
        if forward:
            share, poles = (trace.knots - span[0]) / (span[1] - span[0]), trace.poles
        else:
            share, poles = (span[1] - trace.knots[::-1]) / (span[1] - span[0]), trace.poles[::-1]
        return replace(trace, knots=other[0] + share * (other[1] - other[0]), poles=poles)
    if isinstance(trace, Straight):
        ends = [trace.origin + x * trace.direction for x in span]
        if abs((span[1] - span[0]) - (other[1] - other[0])) <= FLOOR * (other[1] - other[0]):
            sign = 1.0 if forward else -1.0
            begin = ends[0] if forward else ends[1]
            return Straight(begin - sign * other[0] * trace.direction, sign * trace.direction)
        trace = Stretch(ends[0], ends[1])
    if isinstance(trace, Stretch) and not forward:
        return Stretch(trace.end, trace.start)
    return trace


def _gap(name: str, first: _Side, second: _Side) -> Check:
    """The check ``step-seam`` of a seam: the largest distance between the edges as written."""
    gap = max(_apart(first, second), _apart(second, first))
    return at_most(
        CHECK,
        first.sheet.body.name,
        gap,
        first.reach,
        "mm",
        says=f"in STEP {name} are up to {gap:.3g} mm apart",
        remedy="lower step.tolerance",
    )


def _apart(one: _Side, other: _Side) -> float:
    """How far the edges of one side lie from those of the other, except where a notch has taken
    the other's away."""
    mine = [one.sheet.samples(one.sheet.edges[k]) for k in one.run()]
    theirs = [other.sheet.edges[k] for k in other.run()]
    if not mine or not theirs:
        return 0.0  # an apex
    points = np.concatenate(mine)
    off = np.min([_from_edge(other.sheet, edge, points) for edge in theirs], axis=0)
    if _notched(other, theirs):
        off = off[off <= other.reach]
    return float(off.max(initial=0.0))


def _notched(side: _Side, run: list[Edge]) -> bool:
    """Whether a run of edges stops before its side does."""
    ends = Counter(v for edge in run for v in (edge.start, edge.end))
    stops = [side.sheet.vertices[v] for v, times in ends.items() if times == 1]
    corners = side.border.points[[0, -1]]
    return any(np.linalg.norm(corners - stop, axis=1).min() > side.reach for stop in stops)


def _from_edge(sheet: _Sheet, edge: Edge, points: Array) -> Array:
    """The distances of points (n, 3) from an edge, (n,)."""
    low, high = (np.full(len(points), end) for end in edge.span)
    share = np.linspace(0.0, 1.0, ZOOM)
    for _ in range(ZOOMS):
        u = low[:, None] + share * (high - low)[:, None]
        away = sheet.points(edge, u.ravel()).reshape(*u.shape, 3) - points[:, None]
        distance = np.linalg.norm(away, axis=2)
        best = np.argmin(distance, axis=1)
        rows = np.arange(len(points))
        low = u[rows, np.maximum(best - 1, 0)]
        high = u[rows, np.minimum(best + 1, ZOOM - 1)]
    return np.asarray(distance.min(axis=1))
