"""The long edges of a strip: lines and circles where they are ones, else fitted splines."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.export._step_body import Arc, Cone, Curve, Cylinder, Line, Point, Straight, Trace
from devcad.export._step_chart import Chart, heights
from devcad.export._step_conics import ellipse_edge
from devcad.export._step_strips import Strip, smooth_courses
from devcad.geometry.conic import arcs
from devcad.geometry.fit import (
    FLOOR,
    TWIST_LIMIT,
    Course,
    Demand,
    Ends,
    Spline,
    fit,
    ruled_twist,
)
from devcad.geometry.polynomial import polynomial
from devcad.geometry.taylor import Array

EDGE_TOLERANCE = 3e-8  # mm: an edge on an exact face, twice (space and place) below 1e-7
THICKNESS_SHARE = 2e-5  # of the thickness; its mean, and so the volume, is ten times closer
PER_SPAN = (np.arange(5) + 0.5) / 5.0  # places in a span where the written file is measured


@dataclass(frozen=True, slots=True)
class Piece:
    """A smooth piece of one long edge of a strip, on every layer.

    ``t`` = its two parameters, ``corners`` (2, layers, 3) its ends; for each layer a curve, its
    span and its trace on the skin; ``probes``: parameters (k,), true points (k, layers, 3) and
    whether the curve is fitted.
    """

    t: tuple[float, float]
    corners: Array
    curves: tuple[Curve, ...]
    spans: tuple[tuple[float, float], ...]
    traces: tuple[Trace | None, ...]
    probes: tuple[Array, Array]


def fitted_rails(
    strip: Strip, corners: Array, tolerance: float, degree: int, start: Array | None = None
) -> tuple[Spline, Array, Array]:
    """All edges of a general strip side by side, as they are or as one fit; ``corners`` (2 ends,
    2 sides, layers, 3); ``start`` = distinct knots to be tried first.

    Returns the spline, its probe parameters (k,) and the true points there (k, 2, layers, 3).
    """

    def rails(t: Array) -> Array:
        return strip.rails(t).reshape(len(t), -1)

    ends = corners[0].ravel(), corners[1].ravel()
    spline = polynomial(rails, strip.course, ends)
    if spline is None and len(strip.layers) == 1:
        found = arcs(rails, strip.course, ends)
        if found is not None:  # its parameter is not the patch's: each point at its own place
            return found.spline, found.s, strip.rails(found.t)
    if spline is None:
        held = Ends(ends, end_slopes(strip))
        demand = _demand(strip, tolerance, degree)
        spline = fit(rails, strip.course, held, demand, start).spline
    probe = probe_places(spline)
    return spline, probe, strip.rails(strip.course(probe))


def end_slopes(strip: Strip) -> tuple[Array, Array] | None:
    """d/ds of all edges at both ends, where they are finite."""
    t, s = strip.course.t, strip.course.s
    speeds = np.diff(t)[[0, -1]] / np.diff(s)[[0, -1]]
    slopes = strip.end_slopes().reshape(2, -1) * speeds[:, None]
    layers = len(strip.layers)
    for side in np.flatnonzero(np.array(strip.tips)):
        if layers == 1:
            slopes[:, 3 * side : 3 * side + 3] = 0.0
    return (slopes[0], slopes[1]) if np.isfinite(slopes).all() else None


def _demand(strip: Strip, tolerance: float, degree: int) -> Demand:
    """What a fit of the strip's edges must reach."""
    layers = len(strip.layers)
    blocks = tuple(slice(3 * k, 3 * k + 3) for k in range(2 * layers))
    faces = tuple((blocks[k], blocks[layers + k]) for k in range(layers))
    return Demand(degree, tolerance, blocks, faces, *_thickness(strip, blocks), twist_limit(strip))


def twist_limit(strip: Strip) -> float:
    """0.01 degree, more only where the surface itself twists and that was allowed."""
    t = strip.course.t
    t = np.unique(np.concatenate([np.linspace(a, b, 19)[1:-1] for a, b in pairwise(t)]))
    rails, slopes = strip.rails(t), strip.slopes(t)
    own = max(
        float(ruled_twist(rails[:, 0, k], slopes[:, 0, k], rails[:, 1, k], slopes[:, 1, k]).max())
        for k in range(len(strip.layers))
    )
    return TWIST_LIMIT if own <= TWIST_LIMIT else 1.1 * own


def _thickness(
    strip: Strip, blocks: tuple[slice, ...]
) -> tuple[tuple[tuple[slice, slice], ...], float]:
    """The pairs of skins to keep apart and how closely: volume follows thickness."""
    if len(strip.layers) == 1:
        return (), np.inf
    gap = THICKNESS_SHARE * (strip.layers[1] - strip.layers[0])
    return ((blocks[0], blocks[1]), (blocks[2], blocks[3])), gap


@dataclass(frozen=True, slots=True)
class LongEdge:
    """One long edge of a plane, cylinder or cone.

    ``corners`` (2 ends, layers, 3); ``lifts`` (2 ends, 3) is what a mitre adds to the skin's offset
    for a unit of thickness, 0 without a crease; ``skins`` and ``chart`` belong to cylinders and
    cones.
    """

    strip: Strip
    side: int
    corners: Array
    lifts: Array
    skins: list[Cylinder | Cone] | None
    chart: Chart | None
    size: float
    tolerance: float
    degree: int

    def pieces(self) -> list[Piece]:
        """The pieces in the order of t."""
        ends = self.strip.ends
        if self.strip.tips[self.side]:
            return [self._point(ends)]
        out: list[Piece] = []
        for kind, borders in self._runs():
            if kind == "line":
                out.append(self._line(borders[[0, -1]]))
            elif kind == "arc":
                out.append(self._arc(borders[[0, -1]]))
            else:
                courses = smooth_courses(self._slopes, borders, borders[[0, -1]])
                out += [self._free(course) for course in courses]
        return out

    def points(self, t: Array) -> Array:
        """The edge on every layer, (n, layers, 3)."""
        return np.asarray(self.strip.rails(t)[:, self.side])

    def _slopes(self, t: Array) -> Array:
        return self.strip.slopes(t)[:, self.side].reshape(len(t), -1)

    def _runs(self) -> list[tuple[str, Array]]:
        """Neighbouring stretches between breaks that are one line, one arc, or neither."""
        borders = self.strip.course.t
        # kernels' plain quadrature of a plane goes by its edges: those of a pull are short
        ends = () if self.strip.pull is None else self.strip.pull.breaks
        runs: list[tuple[str, Array]] = []
        for a, b in pairwise(borders):
            kind = self._kind(np.array([a, b]))
            if runs and runs[-1][0] == kind and (kind != "free" or a not in ends):
                joined = np.append(runs[-1][1], b)
                if kind == "free" or self._kind(joined) == kind:
                    runs[-1] = (kind, joined)
                    continue
            runs.append((kind, np.array([a, b])))
        return runs

    def _kind(self, borders: Array) -> str:
        """What the middle edge is between the first and last of the borders."""
        steps = np.linspace(0.0, 1.0, 13)
        t = np.unique(np.concatenate([a + (b - a) * steps for a, b in pairwise(borders)]))
        layers = self.points(t)
        if self.skins is not None:
            level = np.ptp(heights(self.skins[0], layers[:, 0]))
            return "arc" if level <= FLOOR * self.size else "free"
        if self.strip.pull is not None:
            return self._kind_drawn(layers)
        points = layers.mean(axis=1)
        chord = points[-1] - points[0]
        length = float(np.linalg.norm(chord))
        if length > 0.0:
            off = np.linalg.norm(np.cross(points - points[0], chord / length), axis=1)
            if off.max() <= FLOOR * self.size:
                return "line"
        ends = self.strip.ends
        bent = [
            (t[0] == ends[0]) and self.lifts[0].any(),
            (t[-1] == ends[1]) and self.lifts[1].any(),
        ]
        centre = None if any(bent) else circle_centre(points, self.size)
        return "free" if centre is None else "arc"

    def _kind_drawn(self, layers: Array) -> str:
        """What the edges of a plane facet are on layers (n, layers, 3) that are drawn to mitres."""
        chords = layers[-1] - layers[0]
        off = np.linalg.norm(np.cross(layers - layers[0], chords), axis=2).max(axis=0)
        if (off <= FLOOR * self.size * np.linalg.norm(chords, axis=1)).all():
            return "line"
        low, high = (circle_centre(x, self.size) for x in layers.swapaxes(0, 1))
        if low is None or high is None:
            return "free"
        n = self.strip.patch.frame(self.strip.ends[:1]).n[0]
        return "arc" if np.linalg.norm(np.cross(high - low, n)) <= FLOOR * self.size else "free"

    def _ends(self, t: Array) -> Array:
        """The corners of a piece over t (2,): the strip's own at its ends, (2, layers, 3)."""
        out = self.points(t)
        for k in (0, 1):
            if t[k] == self.strip.ends[k]:
                out[k] = self.corners[k]
        return out

    def _point(self, t: Array) -> Piece:
        """The edge drawn together in the apex."""
        layers = len(self.strip.layers)
        corners = self._ends(t)
        if self.chart is None or self.skins is None:
            none = (None,) * layers
            span = ((0.0, 0.0),) * layers
            return Piece(_two(t), corners, (Point(),) * layers, span, none, self._no_probes())
        u = self.chart.angle(t)
        traces = tuple(
            Straight(np.array([u[0], heights(skin, corners[:1, k])[0]]), _along(self.chart.turn))
            for k, skin in enumerate(self.skins)
        )
        span = ((0.0, float(abs(u[1] - u[0]))),) * layers
        return Piece(_two(t), corners, (Point(),) * layers, span, traces, self._no_probes())

    def _line(self, t: Array) -> Piece:
        corners = self._ends(t)
        spans = tuple((0.0, float(np.linalg.norm(x[1] - x[0]))) for x in corners.swapaxes(0, 1))
        none = (None,) * len(spans)
        return Piece(_two(t), corners, (Line(),) * len(spans), spans, none, self._no_probes())

    def _arc(self, t: Array) -> Piece:
        """A circular arc: about the axis of a cylinder or cone, or anywhere in a plane."""
        corners = self._ends(t)
        samples = np.linspace(t[0], t[1], 33)
        probes = (np.zeros(0), self.points(samples))
        if self.chart is None or self.skins is None:
            arcs = [plane_arc(x, self.size) for x in probes[1].swapaxes(0, 1)]
            spans = tuple(sweep(a, x) for a, x in zip(arcs, probes[1].swapaxes(0, 1), strict=True))
            return Piece(_two(t), corners, tuple(arcs), spans, (None,) * len(arcs), probes)
        u = self.chart.angle(t)
        start, turn = self.chart.radial(t[:1])[0], self.chart.turn
        curves, traces = [], []
        for k, skin in enumerate(self.skins):
            height = (probes[1][:, k] - skin.point) @ skin.axis
            arm = probes[1][:, k] - skin.point - height[:, None] * skin.axis
            centre = skin.point + height.mean() * skin.axis
            radius = float(np.linalg.norm(arm, axis=1).mean())
            curves.append(Arc(centre, turn * skin.axis, start, radius))
            v = heights(skin, (centre + radius * start)[None])[0]
            traces.append(Straight(np.array([u[0], v]), _along(turn)))
        spans = ((0.0, float(abs(u[1] - u[0]))),) * len(curves)
        return Piece(_two(t), corners, tuple(curves), spans, tuple(traces), probes)

    def _free(self, course: Course) -> Piece:
        """An ellipse, or a fitted edge: all layers and their traces on the skins in one fit."""
        t = course.t[[0, -1]]
        if len(self.strip.layers) == 1 and (found := self._ellipse(t)) is not None:
            return found
        corners = self._ends(t)
        scale = self.angle_scale()
        rows = self._rows(t, corners, scale)
        layers = len(self.strip.layers)
        width = 3 if self.skins is None else 5
        spaces = [slice(width * k, width * k + 3) for k in range(layers)]
        places = [slice(width * k + 3, width * k + 5) for k in range(layers) if width == 5]

        def edge(x: Array) -> Array:
            return self._rows(x, self._lifted(x, t), scale)

        spline = polynomial(edge, course, (rows[0], rows[1]))
        if spline is None:
            demand = Demand(self.degree, self.tolerance, (*spaces, *places))
            spline = fit(edge, course, Ends((rows[0], rows[1])), demand).spline
        traces = []
        for b in places:
            trace = spline.part(b)
            traces.append(replace(trace, poles=trace.poles / [scale, 1.0]))
        probe = probe_places(spline)
        x = course(probe)
        span = (float(course.s[0]), float(course.s[-1]))
        return Piece(
            _two(t),
            corners,
            tuple(spline.part(b) for b in spaces),
            (span,) * layers,
            tuple(traces) or (None,) * layers,
            (probe, self._lifted(x, t)),
        )

    def _ellipse(self, t: Array) -> Piece | None:
        """The edge of a sheet body over t (2,) as an ellipse, if it is one."""
        samples = np.linspace(t[0], t[1], 65)
        corners = self._ends(t)
        points = self.points(samples)[:, 0]
        points[[0, -1]] = corners[:, 0]
        skin = None if self.skins is None else self.skins[0]
        angles = samples if self.chart is None else self.chart.angle(samples)
        found = ellipse_edge(points, skin, angles)
        if found is None:
            return None
        (curve, span), trace = found
        return Piece(_two(t), corners, (curve,), (span,), (trace,), self._no_probes())

    def _lifted(self, t: Array, ends: Array) -> Array:
        """The edge on every layer, drawn to the mitred corners over the whole piece."""
        out = self.points(t)
        share = (t - ends[0]) / (ends[1] - ends[0])
        d = np.array(self.strip.layers)[:, None]
        if ends[0] == self.strip.ends[0]:
            out += (1.0 - share)[:, None, None] * d * self.lifts[0]
        if ends[1] == self.strip.ends[1]:
            out += share[:, None, None] * d * self.lifts[1]
        return out

    def _rows(self, t: Array, points: Array, scale: float) -> Array:
        """Points and, on cylinders and cones, places (u in mm of arc) side by side, (n, k)."""
        if self.chart is None or self.skins is None:
            return points.reshape(len(t), -1)
        u = scale * self.chart.angle(t)
        columns = []
        for k, skin in enumerate(self.skins):
            v = heights(skin, points[:, k])
            columns += [points[:, k], u[:, None], v[:, None]]
        return np.concatenate(columns, axis=1)

    def angle_scale(self) -> float:
        return 1.0 if self.skins is None else max(skin.radius for skin in self.skins)

    def _no_probes(self) -> tuple[Array, Array]:
        return np.zeros(0), np.zeros((0, len(self.strip.layers), 3))


def circle_centre(points: Array, size: float) -> Array | None:
    """The centre of the circle through all points (n, 3), or None if there is none within
    1e-9 of the size."""
    n = len(points)
    a, b = points[n // 3] - points[0], points[2 * n // 3] - points[0]
    normal = np.cross(a, b)
    area = float(normal @ normal)
    if area <= (FLOOR * size) ** 2 * float(b @ b):
        return None
    centre = points[0] + np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * area)
    distance = np.linalg.norm(points - centre, axis=1)
    level = (points - centre) @ normal / np.sqrt(area)
    fits = np.ptp(distance) <= FLOOR * size and np.ptp(level) <= FLOOR * size
    return centre if fits else None


def plane_arc(points: Array, size: float) -> Arc:
    """The arc through points (n, 3) in their order."""
    centre = circle_centre(points, size)
    assert centre is not None
    arms = points - centre
    radius = float(np.linalg.norm(arms, axis=1).mean())
    axis = np.cross(arms[:-1], arms[1:]).sum(axis=0)
    x = arms[0] / np.linalg.norm(arms[0])
    axis -= (axis @ x) * x
    return Arc(centre, axis / np.linalg.norm(axis), x, radius)


def sweep(arc: Arc, points: Array) -> tuple[float, float]:
    """The span of an arc that runs through the points (n, 3)."""
    arms = points - arc.centre
    u = np.unwrap(np.arctan2(arms @ np.cross(arc.axis, arc.x), arms @ arc.x))
    return 0.0, float(u[-1] - u[0])


def probe_places(spline: Spline) -> Array:
    knots = np.unique(spline.knots)
    return np.asarray((knots[:-1, None] + np.diff(knots)[:, None] * PER_SPAN).ravel())


def _along(turn: float) -> Array:
    return np.array([turn, 0.0])


def _two(t: Array) -> tuple[float, float]:
    return float(t[0]), float(t[1])
