"""A face's wires as closed loops of curves in the parameters (u, w) of its surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve2d
from OCP.BRepTools import BRepTools_WireExplorer
from OCP.collections import Array1_double
from OCP.Geom import Geom_Surface
from OCP.GeomAbs import GeomAbs_CN, GeomAbs_CurveType
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_EXTERNAL,
    TopAbs_INTERNAL,
    TopAbs_REVERSED,
    TopAbs_ShapeEnum,
    TopAbs_WIRE,
)
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Wire

from devcad.errors import GeometryError
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.polygons import winding
from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.edge import Edge
from devcad.geometry.taylor import Array

PER_KNOT = 16
"""Points for each knot of an edge where it is looked at as a polygon."""


@dataclass(frozen=True, slots=True)
class Course:
    """One edge of a wire: ``series`` gives (u, w) over the edge's own parameter, run ``forward``
    or backwards. ``edge`` is the kernel's."""

    series: Piecewise
    forward: bool
    edge: TopoDS_Edge

    def ends(self) -> Array:
        """(u, w) at the start and at the end of the run, (2, 2)."""
        ends = self.series(self.series.knots[[0, -1]])
        return ends if self.forward else ends[::-1]

    def moved(self, step: Array) -> Course:
        """The same edge further by ``step`` (2,): a number of periods."""
        if not step.any():
            return self
        table = self.series.coefficients.copy()
        table[:, 0] += step
        return replace(self, series=replace(self.series, coefficients=table))

    def drawn(self) -> Edge:
        """The edge as a plane curve in (u, w)."""
        return drawn(self.series, forward=self.forward)


Loop = tuple[Course, ...]


def courses(face: TopoDS_Face, surface: Geom_Surface) -> tuple[Loop, ...] | None:
    """The face's wires in one piece of the parameters, the outer one first; the holes of a
    periodic surface lie within it. None where a wire runs round such a surface and no seam
    closes it.

    ``face`` must be oriented forward.

    Raises:
        GeometryError: the face has no wire, or one that is not one closed run of edges.
    """
    periods = np.array(
        [
            surface.UPeriod() if surface.IsUPeriodic() else np.inf,
            surface.VPeriod() if surface.IsVPeriodic() else np.inf,
        ]
    )
    loops = [_unwound(_wire(TopoDS.Wire(w), face), periods) for w in _shapes(face, TopAbs_WIRE)]
    if not loops:
        raise GeometryError(
            "the face has no border", remedy="unroll a face that its wires bound on all sides"
        )
    if any((np.abs(_gap(loop)) > 0.5 * periods).any() for loop in loops):
        return None
    areas = [abs(enclosed_area(tuple(course.drawn() for course in loop))) for loop in loops]
    outer = loops.pop(int(np.argmax(areas)))
    return outer, *(_within(loop, outer, periods) for loop in loops)


def drawn(series: Piecewise, *, forward: bool) -> Edge:
    """A series of two components as a plane curve."""
    slopes, knots = series.derivative(), series.knots
    return Edge("", lambda s: (series(s), slopes(s)), knots if forward else knots[::-1].copy())


def box(loop: Loop) -> tuple[float, float, float, float]:
    """Least and largest u, least and largest w of a loop, exact."""
    u0, w0, u1, w1 = bounds(tuple(course.drawn() for course in loop))
    return u0, u1, w0, w1


def _wire(wire: TopoDS_Wire, face: TopoDS_Face) -> Loop:
    """The edges of a wire in the order of the run."""
    explorer = BRepTools_WireExplorer(wire, face)
    found = []
    while explorer.More():
        edge = explorer.Current()
        found.append(_course(edge, face))
        explorer.Next()
    loose = (TopAbs_INTERNAL, TopAbs_EXTERNAL)
    count = sum(e.Orientation() not in loose for e in _shapes(wire, TopAbs_EDGE))
    if len(found) != count or not found:
        raise GeometryError(
            f"a wire of the face is no single run: {len(found)} of {count} edges follow each other",
            value=len(found),
            limit=count,
            remedy="mend the face first (build123d: face.fix())",
        )
    return tuple(found)


def _course(edge: TopoDS_Edge, face: TopoDS_Face) -> Course:
    """One edge in (u, w), as a series that equals it to rounding.

    Raises:
        GeometryError: the edge has no curve in the parameters of the surface.
    """
    if BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0) is None:
        raise GeometryError(
            "an edge of the face has no curve on its surface",
            remedy="mend the face first (build123d: face.fix())",
        )
    curve = BRepAdaptor_Curve2d(edge, face)
    forward = edge.Orientation() != TopAbs_REVERSED
    if curve.GetType() == GeomAbs_CurveType.GeomAbs_Line:
        ends = np.array([curve.FirstParameter(), curve.LastParameter()])
        first, last = _places(curve, ends)
        table = np.array([[0.5 * (first + last), 0.5 * (last - first)]])
        return Course(Piecewise(ends, table), forward, edge)
    knots = Array1_double(1, curve.NbIntervals(GeomAbs_CN) + 1)
    curve.Intervals(knots, GeomAbs_CN)
    ends = np.array([knots.Value(k) for k in range(1, knots.Length() + 1)])
    size = np.ptp(_places(curve, np.linspace(ends[0], ends[-1], 9)), axis=0)
    series = chebyshev.resolve(
        lambda s: _places(curve, s), ends, scale=np.maximum(size, 1e-3 * size.max())
    )
    return Course(series, forward, edge)


def _places(curve: BRepAdaptor_Curve2d, s: Array) -> Array:
    found = (curve.Value(x) for x in s.tolist())
    return np.array([(p.X(), p.Y()) for p in found]).reshape(-1, 2)


def _unwound(loop: Loop, periods: Array) -> Loop:
    """The same loop, each edge by whole periods to where the one before ends."""
    if np.isinf(periods).all():
        return loop
    out = [loop[0]]
    for course in loop[1:]:
        turns = np.round((out[-1].ends()[1] - course.ends()[0]) / periods)
        out.append(course.moved(_steps(turns, periods)))
    return tuple(out)


def _steps(turns: Array, periods: Array) -> Array:
    return np.where(np.isinf(periods), 0.0, turns * np.where(np.isinf(periods), 1.0, periods))


def _gap(loop: Loop) -> Array:
    """How far the loop's end lies from its start, (2,)."""
    return np.asarray(loop[-1].ends()[1] - loop[0].ends()[0])


def _within(loop: Loop, outer: Loop, periods: Array) -> Loop:
    """A hole by whole periods to where the outer loop surrounds it."""
    if np.isinf(periods).all():
        return loop
    (u0, u1, w0, w1), (a0, a1, b0, b1) = box(outer), box(loop)
    turns = np.round(np.array([u0 + u1 - a0 - a1, w0 + w1 - b0 - b1]) / (2.0 * periods))
    polygon = np.concatenate([_polygon(course) for course in outer])
    place = loop[0].ends()[0]
    tries = [turns + np.array([i, j]) for i in (0, 1, -1) for j in (0, 1, -1)]
    for turn in tries:
        if winding(polygon, place + _steps(turn, periods)):
            return tuple(course.moved(_steps(turn, periods)) for course in loop)
    return tuple(course.moved(_steps(turns, periods)) for course in loop)


def _polygon(course: Course) -> Array:
    """Points on an edge in the order of its run, without the last."""
    knots = course.series.knots
    points = course.series(np.linspace(knots[0], knots[-1], PER_KNOT * len(knots)))
    return (points if course.forward else points[::-1])[:-1]


def _shapes(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()
