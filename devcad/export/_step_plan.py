"""From a panel to a body: which vertices, edges and faces there are, and how they share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import (
    Arc,
    Body,
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
    Surface,
    Trace,
    Use,
)
from devcad.export._step_rails import (
    EDGE_TOLERANCE,
    Chart,
    Piece,
    analytic_pieces,
    chart,
    fitted_rails,
    heights,
)
from devcad.export._step_strips import Strip, panel_size, strips
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.part import Panel

AREA_SIZE = 100.0  # mm: below it the tolerance shrinks with the part, for areas are relative
PLANAR = 1e-8  # mm: a wall flatter than this is a plane to every kernel


@dataclass(frozen=True, slots=True)
class _Skin:
    """What the faces of one strip stand on: a surface for each layer and its two long edges."""

    strip: Strip
    surfaces: tuple[Surface, ...]
    sides: tuple[list[Piece], list[Piece]]
    frame: Chart | None = None
    places: Array = field(default_factory=lambda: np.zeros(0))
    true: Array = field(default_factory=lambda: np.zeros((0, 2, 1, 3)))


def body(panel: Panel, tolerance: float, degree: int) -> Body:
    """The body of a panel: a solid with thickness, else a shell.

    Fitted faces lie within max(tolerance, 1e-9 of the size) of the true surface and twist by at
    most 0.01 degree.
    Raises:
        GeometryError: the fit is not reached, or patches and layers do not meet.
    """
    parts, count = strips(panel)
    size = panel_size(panel)
    corners, lifts = _corners(parts, count, size)
    draft = _Draft(panel, parts, count, corners, size)
    skins = [_skin(s, draft, lifts[k], tolerance, degree) for k, s in enumerate(parts)]
    for skin in skins:
        draft.add_strip(skin)
    if panel.thickness and count > len(parts):
        draft.add_end(parts[0], skins[0], 0)
        draft.add_end(parts[-1], skins[-1], 1)
    return Body(
        panel.name,
        np.array(draft.points),
        tuple(draft.edges),
        tuple(draft.faces),
        panel.thickness > 0.0,
        _volume(panel, parts),
    )


def _skin(strip: Strip, draft: _Draft, lifts: Array, tolerance: float, degree: int) -> _Skin:
    """Surfaces and long edges of one strip."""
    corners = draft.corner_points(strip)
    fine = max(tolerance * min(1.0, draft.size / AREA_SIZE), FLOOR * draft.size)
    if strip.ruled:
        result, probe, true = fitted_rails(strip, corners, fine, degree)
        layers = len(strip.layers)
        rails = [
            [result.spline.part(slice(3 * (layers * s + k), 3 * (layers * s + k) + 3)) for k in range(layers)]
            for s in (0, 1)
        ]
        surfaces = tuple(
            Ruled(rails[0][k], rails[1][k]) if k == layers - 1 else Ruled(rails[1][k], rails[0][k])
            for k in range(layers)
        )
        sides = tuple([_rail_piece(strip, s, rails[s], corners, probe, true)] for s in (0, 1))
        return _Skin(strip, surfaces, (sides[0], sides[1]), None, probe, true)
    if lifts.any() and strip.shape.type != "plane":
        raise GeometryError(
            "a crease beside a rolled patch has no mitre with thickness",
            remedy="give corner_radius, or thickness 0",
        )
    frame = None if strip.shape.type == "plane" else chart(strip)
    reach = strip.rails(np.linspace(*strip.ends, 33))
    charts = None
    if frame is not None:
        charts = [
            frame.surface(k, reach[:, :, k].reshape(-1, 3)) for k in range(len(strip.layers))
        ]
    edge = min(tolerance, max(EDGE_TOLERANCE, 1e-11 * draft.size))
    pieces = [
        analytic_pieces(strip, s, corners[:, s], lifts, charts, frame, draft.size, edge, degree)
        for s in (0, 1)
    ]
    flat = [Plane(corners[0, 0, k], n) for k, n in enumerate(_outward(strip))]
    found: Sequence[Surface] = flat if charts is None else charts
    return _Skin(strip, tuple(found), (pieces[0], pieces[1]), frame, true=reach)


def _rail_piece(
    strip: Strip, side: int, rails: list[Spline], corners: Array, probe: Array, true: Array
) -> Piece:
    """A long edge of a fitted strip; the front's surface has the from side at u = 0."""
    s = strip.course.s
    layers = len(rails)
    tip = strip.tips[side] and layers == 1
    traces = []
    for k in range(layers):
        u = float(side) if k == layers - 1 else float(1 - side)
        traces.append(Straight(np.array([u, 0.0]), np.array([0.0, 1.0])))
    return Piece(
        (float(strip.ends[0]), float(strip.ends[1])),
        corners[:, side],
        (Point(),) * layers if tip else tuple(rails),
        ((float(s[0]), float(s[-1])),) * layers,
        tuple(traces),
        (probe, true[:, side]),
    )


def _outward(strip: Strip) -> list[Array]:
    """The outward normals of a strip's layers at its first ruling."""
    n = strip.patch.frame(strip.ends[:1]).n[0]
    return [n] if len(strip.layers) == 1 else [-n, n]


def _corners(parts: list[Strip], count: int, size: float) -> tuple[Array, Array]:
    """The corners (stations, 2 sides, layers, 3), and for each strip and end what a mitre adds to
    the skin's offset for a unit of thickness, (strips, 2, 3).

    At a crease a layer lies at c + d (n1 + n2) / (1 + n1.n2) (design.md, section 7).
    """
    lifts = np.zeros((len(parts), 2, 3))
    rails = [s.rails(s.ends) for s in parts]  # (2 ends, 2 sides, layers, 3) each
    if parts[0].layers != (0.0,):
        normals = [s.patch.frame(s.ends).n for s in parts]
        for k in range(len(parts)):
            after = (k + 1) % len(parts)
            if parts[k].last != parts[after].first:
                continue
            n1, n2 = normals[k][1], normals[after][0]
            if np.linalg.norm(np.cross(n1, n2)) <= 1e-9:
                continue
            mitre = (n1 + n2) / (1.0 + n1 @ n2)
            lifts[k, 1], lifts[after, 0] = mitre - n1, mitre - n2
    corners = np.full((count, *rails[0].shape[1:]), np.nan)
    for k, s in enumerate(parts):
        d = np.array(s.layers)[:, None]
        for end, station in ((0, s.first), (1, s.last)):
            here = rails[k][end] + d * lifts[k, end]
            if np.isnan(corners[station]).any():
                corners[station] = here
            elif (gap := float(np.abs(corners[station] - here).max())) > FLOOR * size:
                raise GeometryError(
                    f"neighbouring patches miss each other by {gap:.3g} mm at their ruling",
                    value=gap,
                    limit=FLOOR * size,
                    remedy="with thickness, end the extent before the apex",
                )
    return corners, lifts


class _Draft:
    """The body while it grows: vertices, edges by their names, faces."""

    def __init__(
        self, panel: Panel, parts: list[Strip], count: int, corners: Array, size: float
    ) -> None:
        self.size = size
        self.layers = corners.shape[2]
        self.corners = corners
        self.points: list[Array] = []
        self.edges: list[Edge] = []
        self.faces: list[Face] = []
        self._names: dict[tuple[object, ...], int] = {}
        self._vertex_of = self._number_corners(parts)

    def _number_corners(self, parts: list[Strip]) -> dict[tuple[int, int, int], int]:
        """One vertex for each corner; corners that a collapsed edge draws together share one."""
        keys = list(np.ndindex(self.corners.shape[:3]))
        root = {key: key for key in keys}

        def find(key: tuple[int, ...]) -> tuple[int, ...]:
            while root[key] != key:
                key = root[key]
            return key

        for s in parts:
            for side in (0, 1):
                if s.tips[side] and not (s.ruled and self.layers == 2):
                    for k in range(self.layers):
                        root[find((s.last, side, k))] = find((s.first, side, k))
        for i, _, k in keys:
            if np.abs(self.corners[i, 0, k] - self.corners[i, 1, k]).max() <= FLOOR * self.size:
                root[find((i, 1, k))] = find((i, 0, k))
        numbers: dict[tuple[int, ...], int] = {}
        for key in keys:
            top = find(key)
            if top not in numbers:
                numbers[top] = self.add_point(self.corners[top])
        return {(i, s, k): numbers[find((i, s, k))] for i, s, k in keys}

    def corner_points(self, strip: Strip) -> Array:
        """The strip's corners as the vertices have them, (2 ends, 2 sides, layers, 3)."""
        pick = [
            [
                [self.points[self._vertex_of[i, s, k]] for k in range(self.layers)]
                for s in (0, 1)
            ]
            for i in (strip.first, strip.last)
        ]
        return np.array(pick)

    def add_point(self, point: Array) -> int:
        """The number of a new vertex."""
        self.points.append(np.array(point))
        return len(self.points) - 1

    def edge(self, name: tuple[object, ...], make: Callable[[], Edge]) -> int:
        """The number of the edge of that name, made at its first use."""
        if name not in self._names:
            self._names[name] = len(self.edges)
            self.edges.append(make())
        return self._names[name]

    def line(self, start: int, end: int) -> int:
        """The straight edge between two vertices."""
        length = float(np.linalg.norm(self.points[end] - self.points[start]))
        return self.edge((start, end), lambda: Edge(start, end, Line(), (0.0, length)))

    def length(self, edge: int) -> float:
        """The end of an edge's span."""
        return self.edges[edge].span[1]

    # faces of a strip

    def add_strip(self, skin: _Skin) -> None:
        """The skins and the walls of one strip."""
        for layer in range(self.layers):
            self._add_skin(skin, layer)
        if self.layers == 2:
            for side in (0, 1):
                for piece in range(len(skin.sides[side])):
                    self._add_wall(skin, side, piece)

    def _ends(self, strip: Strip, side: int, piece: int, total: int, layer: int) -> tuple[int, int]:
        """The vertices of a piece of a long edge."""
        ends = []
        for k, (index, station) in enumerate(((0, strip.first), (total - 1, strip.last))):
            if piece == index:
                ends.append(self._vertex_of[station, side, layer])
            else:
                ends.append(self._names["kink", strip.first, side, piece + k, layer])
        return ends[0], ends[1]

    def _long_edge(self, skin: _Skin, side: int, index: int, layer: int) -> int:
        """The edge of a piece of a long side on a layer."""
        strip, pieces = skin.strip, skin.sides[side]
        piece = pieces[index]
        for k, corner in ((index, piece.corners[0]), (index + 1, piece.corners[1])):
            name = ("kink", strip.first, side, k, layer)
            if 0 < k < len(pieces) and name not in self._names:
                self._names[name] = self.add_point(corner[layer])
        start, end = self._ends(strip, side, index, len(pieces), layer)
        curve = piece.curves[layer]
        if isinstance(curve, Line):
            return self.line(start, end)
        probes = None
        if isinstance(curve, Spline):
            probes = (piece.probes[0], piece.probes[1][:, layer])
        return self.edge(
            ("long", strip.first, side, index, layer),
            lambda: Edge(start, end, curve, piece.spans[layer], probes),
        )

    def _add_skin(self, skin: _Skin, layer: int) -> None:
        """The front (last layer) or the back of a strip."""
        strip = skin.strip
        run = [self._ruling_use(skin, 0, layer)]
        for side, forward in ((1, True), (0, False)):
            pieces = skin.sides[side]
            order = range(len(pieces)) if forward else range(len(pieces) - 1, -1, -1)
            uses = [
                Use(self._long_edge(skin, side, i, layer), forward, pieces[i].traces[layer])
                for i in order
            ]
            run += [u for u in uses if self._drawn(u)]
            if forward:
                end = self._ruling_use(skin, 1, layer)
                run.append(None if end is None else Use(end.edge, False, end.trace))
        loop = [u for u in run if u is not None]
        front = layer == self.layers - 1
        surface = skin.surfaces[layer]
        flipped = not isinstance(surface, (Plane, Ruled)) and (
            (skin.frame is not None and skin.frame.side > 0.0) != front
        )
        places, points = _skin_probes(skin, layer)
        self.faces.append(
            Face(surface, tuple(loop if front else _turned(loop)), flipped, True, places, points)
        )

    def _drawn(self, use: Use) -> bool:
        """Whether the edge appears in a loop: a collapsed edge only where a surface needs it."""
        return not (isinstance(self.edges[use.edge].curve, Point) and use.trace is None)

    def _ruling_use(self, skin: _Skin, end: int, layer: int) -> Use | None:
        """The ruling at an end of the strip, from the from side to the to side."""
        strip = skin.strip
        station = (strip.first, strip.last)[end]
        low, high = (self._vertex_of[station, side, layer] for side in (0, 1))
        surface = skin.surfaces[layer]
        if low == high:
            if not isinstance(surface, Ruled):
                return None
            s = float(strip.course.s[-end])
            u = 0.0 if layer == self.layers - 1 else 1.0
            trace: Trace = Straight(np.array([u, s]), np.array([1.0 - 2.0 * u, 0.0]))
            name = ("tip", strip.first, end, layer)
            return Use(self.edge(name, lambda: Edge(low, low, Point(), (0.0, 1.0))), True, trace)
        edge = self.line(low, high)
        if isinstance(surface, Plane):
            return Use(edge, True)
        if isinstance(surface, Ruled):
            s = float(strip.course.s[-end])
            u = 0.0 if layer == self.layers - 1 else 1.0
            return Use(edge, True, Stretch(np.array([u, s]), np.array([1.0 - u, s])))
        assert skin.frame is not None
        u = float(skin.frame.angle(strip.ends[[-end]])[0])
        v0, v1 = heights(surface, np.array([self.points[low], self.points[high]]))
        return Use(edge, True, Straight(np.array([u, v0]), np.array([0.0, np.sign(v1 - v0)])))

    def _across(self, minus: int, plus: int, apex: int | None) -> list[int]:
        """The edges from the back's vertex to the front's, by way of the apex if there is one."""
        stops = [minus, plus] if apex is None else [minus, apex, plus]
        return [
            self.line(a, b) for a, b in zip(stops[:-1], stops[1:], strict=True)
        ]

    def _apex(self, strip: Strip, side: int) -> int | None:
        """The vertex where the layers' edges of a fitted thick cone cross, if this side has it."""
        if not (strip.ruled and strip.tips[side] and self.layers == 2):
            return None
        name = ("apex", side)
        if name not in self._names:
            point = strip.patch.jet(strip.ends[:1], 0).rail
            jet = strip.patch.jet(strip.ends[:1], 0)
            self._names[name] = self.add_point(point((jet.v_from, jet.v_to)[side])[0, 0])
        return self._names[name]

    def _add_wall(self, skin: _Skin, side: int, index: int) -> None:
        """The wall between the layers along a piece of a long side."""
        piece = skin.sides[side][index]
        if isinstance(piece.curves[0], Point):
            return
        rails = [self._long_edge(skin, side, index, layer) for layer in (0, 1)]
        apex = self._apex(skin.strip, side)
        if apex is not None:
            self._add_waist(skin, side, rails, apex)
            return
        posts = [
            self.line(*(self._vertex(rails[layer], end) for layer in (0, 1))) for end in (0, 1)
        ]
        loop = [(rails[1], True), (posts[1], False), (rails[0], False), (posts[0], True)]
        curves = [self.edges[e].curve for e in rails]
        ends = np.array([[self.points[self._vertex(e, k)] for k in (0, 1)] for e in rails])
        places = None
        points = piece.probes[1].reshape(-1, 3)
        flipped = False
        traces: list[Trace | None] = [None] * 4
        surface: Surface
        if isinstance(curves[0], Arc) and isinstance(curves[1], Arc):
            surface, flipped, traces = _arc_wall(side, (curves[0], curves[1]), ends, self.size, self.length(rails[0]))
        else:
            lower, upper = (
                c if isinstance(c, Spline) else _segment(x)
                for c, x in zip(curves, ends, strict=True)
            )
            flat = _flat_wall(side, lower, upper)
            if flat is not None:
                surface = flat
            else:
                surface = Ruled(lower, upper) if side == 0 else Ruled(upper, lower)
                traces = _wall_traces(side, surface, [isinstance(c, Spline) for c in curves])
                if isinstance(curves[0], Spline):
                    places, points = _wall_probes(side, piece.probes)
        uses = [Use(e, f, t) for (e, f), t in zip(loop, traces, strict=True)]
        self.faces.append(
            Face(surface, tuple(uses if side == 0 else _turned(uses)), flipped, False, places, points)
        )

    def _vertex(self, edge: int, end: int) -> int:
        return (self.edges[edge].start, self.edges[edge].end)[end]

    def _add_waist(self, skin: _Skin, side: int, rails: list[int], apex: int) -> None:
        """Two faces that meet in the apex of a thick cone that is not a right circular one."""
        for layer in (0, 1):
            rail = self.edges[rails[layer]]
            assert isinstance(rail.curve, Spline)
            tip = Spline(
                rail.curve.degree, rail.curve.knots, 0.0 * rail.curve.poles + self.points[apex]
            )
            curve, span, low = rail.curve, rail.span, (side == 0) != (layer == 1)
            surface = Ruled(curve, tip) if low else Ruled(tip, curve)
            u = 0.0 if low else 1.0
            pinch = self.edge(
                ("pinch", skin.strip.first, side, layer),
                lambda span=span: Edge(apex, apex, Point(), span),  # type: ignore[misc]
            )
            along = np.array([0.0, 1.0])
            run = [Use(rails[layer], layer == 1, Straight(np.array([u, 0.0]), along))]
            for end in (1, 0):
                s = span[end]
                vertex = self._vertex(rails[layer], end)
                stops = (apex, vertex) if layer == 1 else (vertex, apex)
                reach = (1.0 - u, u) if layer == 1 else (u, 1.0 - u)
                trace = Stretch(np.array([reach[0], s]), np.array([reach[1], s]))
                run.append(Use(self.line(*stops), end == 0, trace))
            closing = Use(pinch, layer == 0, Straight(np.array([1.0 - u, 0.0]), along))
            uses = [run[0], run[1], closing, run[2]] if layer == 1 else [run[0], run[2], closing, run[1]]
            self.faces.append(Face(surface, tuple(uses if side == 0 else _turned(uses))))

    def add_end(self, strip: Strip, skin: _Skin, end: int) -> None:
        """The plane wall at the first or the last ruling of an open solid."""
        station = (strip.first, strip.last)[end]
        if self._vertex_of[station, 0, 0] == self._vertex_of[station, 1, 0]:
            return  # the sheet ends in a point: its walls meet in one edge
        rulings = []
        for layer in (0, 1):
            low, high = (self._vertex_of[station, side, layer] for side in (0, 1))
            rulings.append(self.line(low, high))
        posts = []
        for side in (0, 1):
            minus, plus = (self._vertex_of[station, side, layer] for layer in (0, 1))
            posts.append(self._across(minus, plus, self._apex(strip, side)))
        run = [Use(rulings[1], False)]
        run += [Use(e, False) for e in reversed(posts[0])]
        run += [Use(rulings[0], True)]
        run += [Use(e, True) for e in posts[1]]
        m = strip.patch.frame(strip.ends[[-end]]).m[0]
        plane = Plane(self.corners[station, 1, 0], m if end else -m)
        points = self.corners[station].reshape(-1, 3)
        loop = run if end == 0 else _turned(run)
        self.faces.append(Face(plane, tuple(loop), points=points))


def _turned(loop: list[Use]) -> list[Use]:
    """The same loop the other way round."""
    return [Use(u.edge, not u.forward, u.trace) for u in reversed(loop)]


def _segment(ends: Array) -> Spline:
    """The straight line between two points as a spline over [0, 1]."""
    return Spline(1, np.array([0.0, 0.0, 1.0, 1.0]), ends)


def _flat_wall(side: int, lower: Spline, upper: Spline) -> Plane | None:
    """The plane of a wall between two splines, outward, if it is one."""
    points = np.concatenate([lower.poles, upper.poles])
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre)[2][2]
    if np.abs((points - centre) @ normal).max() > PLANAR:
        return None
    chords = np.diff(0.5 * (lower.poles + upper.poles), axis=0)
    post = upper.poles[:-1] - lower.poles[:-1]
    outward = np.cross(chords, -post if side == 0 else post).sum(axis=0)
    return Plane(centre, normal if normal @ outward > 0.0 else -normal)


def _wall_traces(side: int, surface: Ruled, fitted: list[bool]) -> list[Trace | None]:
    """The traces of a wall's edges in the order plus, post at the end, minus, post at the start."""
    knots = surface.low.knots
    s0, s1 = float(knots[0]), float(knots[-1])
    plus = 1.0 if side == 0 else 0.0

    def rail(u: float, spline: bool) -> Trace:
        if spline:
            return Straight(np.array([u, 0.0]), np.array([0.0, 1.0]))
        return Stretch(np.array([u, s0]), np.array([u, s1]))

    def post(s: float) -> Trace:
        return Stretch(np.array([1.0 - plus, s]), np.array([plus, s]))

    return [rail(plus, fitted[1]), post(s1), rail(1.0 - plus, fitted[0]), post(s0)]


def _arc_wall(
    side: int, arcs: tuple[Arc, Arc], ends: Array, size: float, sweep: float
) -> tuple[Surface, bool, list[Trace | None]]:
    """The wall between two arcs about one axis: plane, cylinder or cone, whether its normal points
    inward, and the traces of its edges."""
    minus, plus = arcs
    axis, x = minus.axis, minus.x
    rise = float((plus.centre - minus.centre) @ axis)
    widening = plus.radius - minus.radius
    post = rise * axis + widening * x
    outward = np.cross(np.cross(axis, x), -post if side == 0 else post)
    if abs(rise) <= FLOOR * size:
        return Plane(minus.centre, outward / np.linalg.norm(outward)), False, [None] * 4
    turn = 1.0
    wide = plus if widening > 0.0 else minus
    surface: Cylinder | Cone
    if abs(widening) <= FLOOR * size:
        surface = Cylinder(minus.centre, axis, x, minus.radius)
    else:
        if rise * widening < 0.0:  # a cone's axis points to where it is wide
            x = np.cos(sweep) * x + np.sin(sweep) * np.cross(axis, x)
            axis, turn = -axis, -1.0
        angle = float(np.arctan2(abs(widening), abs(rise)))
        surface = Cone(wide.centre, axis, x, wide.radius, angle)
    v = heights(surface, ends[:, 0])  # of the minus and the plus arc
    start = 0.0 if turn > 0.0 else sweep
    along = np.array([turn, 0.0])
    up = np.array([0.0, np.sign(v[1] - v[0])])
    traces: list[Trace | None] = [
        Straight(np.array([start, v[1]]), along),
        Straight(np.array([sweep - start, v[0]]), up),
        Straight(np.array([start, v[0]]), along),
        Straight(np.array([start, v[0]]), up),
    ]
    return surface, bool(minus.x @ outward < 0.0), traces


def _skin_probes(skin: _Skin, layer: int) -> tuple[Array | None, Array]:
    """Places on a skin and the true points there: on both edges and half way."""
    low, high = skin.true[:, 0, layer], skin.true[:, 1, layer]
    points = np.concatenate([low, 0.5 * (low + high), high])
    if not skin.strip.ruled:
        return None, points
    u = 0.0 if layer == len(skin.strip.layers) - 1 else 1.0
    return _grid(skin.places, (u, 0.5, 1.0 - u)), points


def _wall_probes(side: int, probes: tuple[Array, Array]) -> tuple[Array, Array]:
    """Places on a fitted wall and the true points there."""
    s, true = probes
    minus, plus = true[:, 0], true[:, 1]
    u = 0.0 if side == 0 else 1.0
    points = np.concatenate([minus, 0.5 * (minus + plus), plus])
    return _grid(s, (u, 0.5, 1.0 - u)), points


def _grid(s: Array, across: tuple[float, ...]) -> Array:
    return np.concatenate([np.stack([np.full_like(s, u), s], axis=1) for u in across])


def _volume(panel: Panel, parts: list[Strip]) -> float:
    """The exact volume of a solid: area x thickness, and at an apex what the layers' own ends
    add, (T^3 / 24) integral of c^2 / |a| (design.md, section 7)."""
    extra = sum(_apex_integral(s.patch, s.course.t) for s in parts if any(s.tips))
    thickness = panel.thickness
    return panel.pattern.area * thickness + thickness**3 / 24.0 * extra


def _apex_integral(patch: Patch, borders: Array) -> float:
    """The integral of c^2 / |a| between the borders, Gauss with 32 nodes in each stretch."""
    nodes, weights = np.polynomial.legendre.leggauss(32)
    total = 0.0
    for a, b in zip(borders[:-1], borders[1:], strict=True):
        f = patch.frame(0.5 * (a + b) + 0.5 * (b - a) * nodes)
        total += 0.5 * (b - a) * float(weights @ (f.c**2 / np.abs(f.a)))
    return total
