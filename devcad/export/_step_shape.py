"""A body as a shape of the kernel, topology given vertex by vertex: nothing is sewn or healed."""

from __future__ import annotations

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_gp_Pnt2d,
    Array1_int,
    Array2_double,
    Array2_gp_Pnt,
)
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_Circle,
    Geom_ConicalSurface,
    Geom_Curve,
    Geom_CylindricalSurface,
    Geom_Ellipse,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
)
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Curve, Geom2d_Line
from OCP.gp import gp_Ax2, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d
from OCP.TopAbs import TopAbs_REVERSED
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import (
    TopoDS_Edge,
    TopoDS_Face,
    TopoDS_Shape,
    TopoDS_Shell,
    TopoDS_Solid,
    TopoDS_Vertex,
    TopoDS_Wire,
)

from devcad.export._step_body import (
    Arc,
    Body,
    Cone,
    Curve,
    Cylinder,
    Edge,
    Ellipse,
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
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

TOLERANCE = 1e-7  # mm: the kernel's own confusion distance
EVEN = 1e-14  # weights as near to one another are equal

_BUILDER = BRep_Builder()


def shape_of(body: Body) -> TopoDS_Shape:
    """The body as a solid, or as a shell whose faces show the front."""
    vertices = [_vertex(p) for p in body.vertices]
    edges = [_edge(e, vertices, body.vertices) for e in body.edges]
    shell = TopoDS_Shell()
    _BUILDER.MakeShell(shell)
    for face in body.faces:
        _BUILDER.Add(shell, _face(face, body.edges, edges))
    if not body.solid:
        return shell
    shell.Closed(True)
    solid = TopoDS_Solid()
    _BUILDER.MakeSolid(solid)
    _BUILDER.Add(solid, shell)
    return solid


def _vertex(point: Array) -> TopoDS_Vertex:
    vertex = TopoDS_Vertex()
    _BUILDER.MakeVertex(vertex, _pnt(point), TOLERANCE)
    return vertex


def _edge(edge: Edge, vertices: list[TopoDS_Vertex], points: Array) -> TopoDS_Edge:
    out = TopoDS_Edge()
    curve = _curve(edge.curve, points[edge.start], points[edge.end])
    if curve is None:
        _BUILDER.MakeEdge(out)
        _BUILDER.Degenerated(out, True)
    else:
        _BUILDER.MakeEdge(out, curve, TOLERANCE)
        _BUILDER.Range(out, *edge.span)
    _BUILDER.Add(out, vertices[edge.start])
    _BUILDER.Add(out, vertices[edge.end].Oriented(TopAbs_REVERSED))
    return out


def _face(face: Face, plans: tuple[Edge, ...], edges: list[TopoDS_Edge]) -> TopoDS_Shape:
    out = TopoDS_Face()
    surface = surface_of(face.surface)
    _BUILDER.MakeFace(out, surface, TOLERANCE)
    for loop in (face.loop, *face.holes):
        _BUILDER.Add(out, _wire(loop, face, surface, plans, edges))
    return out.Reversed() if face.flipped else out


def _wire(
    loop: tuple[Use, ...],
    face: Face,
    surface: Geom_Surface,
    plans: tuple[Edge, ...],
    edges: list[TopoDS_Edge],
) -> TopoDS_Wire:
    """A loop of a face; the edges learn their images on its surface."""
    wire = TopoDS_Wire()
    _BUILDER.MakeWire(wire)
    for use in reversed(loop) if face.flipped else loop:
        edge, plan = edges[use.edge], plans[use.edge]
        if use.trace is not None:
            image = _curve2d(_evened(use.trace, face.surface, plan.span), plan.span)
            _BUILDER.UpdateEdge(edge, image, surface, TopLoc_Location(), TOLERANCE)
            _BUILDER.Range(edge, surface, TopLoc_Location(), *plan.span)
        oriented = edge if use.forward != face.flipped else edge.Reversed()
        _BUILDER.Add(wire, oriented)
    wire.Closed(True)
    return wire


def surface_of(surface: Surface) -> Geom_Surface:
    """The kernel's surface; fitted ones 1 x degree."""
    if isinstance(surface, Plane):
        return Geom_Plane(_pnt(surface.point), _dir(surface.normal))
    if isinstance(surface, (Cylinder, Cone)):
        place = gp_Ax3(_pnt(surface.point), _dir(surface.axis), _dir(surface.x))
        if isinstance(surface, Cylinder):
            return Geom_CylindricalSurface(place, surface.radius)
        return Geom_ConicalSurface(place, surface.half_angle, surface.radius)
    low, high = surface.low, surface.high
    poles = Array2_gp_Pnt(1, 2, 1, len(low.poles))
    weights = Array2_double(1, 2, 1, len(low.poles))
    for row, spline in ((1, low), (2, high)):
        for k, pole in enumerate(spline.poles.tolist()):
            poles.SetValue(row, k + 1, gp_Pnt(*pole))
        for k, weight in enumerate(_weights(spline)):
            weights.SetValue(row, k + 1, weight)
    knots, times = _knots(low)
    return Geom_BSplineSurface(
        poles, weights, _reals([0.0, 1.0]), knots, _ints([2, 2]), times, 1, low.degree
    )


def _curve(curve: Curve, start: Array, end: Array) -> Geom_Curve | None:
    if isinstance(curve, Point):
        return None
    if isinstance(curve, Line):
        return Geom_Line(_pnt(start), _dir(end - start))
    if isinstance(curve, Arc):
        return Geom_Circle(
            gp_Ax2(_pnt(curve.centre), _dir(curve.axis), _dir(curve.x)), curve.radius
        )
    if isinstance(curve, Ellipse):
        place = gp_Ax2(_pnt(curve.centre), _dir(curve.axis), _dir(curve.x))
        return Geom_Ellipse(place, curve.major, curve.minor)
    poles = Array1_gp_Pnt(1, len(curve.poles))
    for k, pole in enumerate(curve.poles.tolist()):
        poles.SetValue(k + 1, gp_Pnt(*pole))
    return Geom_BSplineCurve(poles, _reals(_weights(curve)), *_knots(curve), curve.degree)


def _evened(trace: Trace, surface: Surface, span: tuple[float, float]) -> Trace:
    """The trace of a ruling on a rational face whose edges weigh differently there: u is then no
    even share of the ruling, but the quotient that gives each of its points its own place."""
    if not isinstance(trace, Stretch) or not isinstance(surface, Ruled):
        return trace
    if trace.start[1] != trace.end[1] or (surface.low.weights is surface.high.weights is None):
        return trace
    low, high = (float(x.denominator(trace.start[1:])[0]) for x in (surface.low, surface.high))
    start, end = ((1.0 - u) * low + u * high for u in (float(trace.start[0]), float(trace.end[0])))
    if abs(start - end) <= EVEN * abs(start + end):
        return trace
    weights = np.array([[end, end], [start, start]])
    return Spline(
        1, np.repeat(np.array(span), 2), np.array([trace.start, trace.end]), weights=weights
    )


def _curve2d(trace: Trace, span: tuple[float, float]) -> Geom2d_Curve:
    if isinstance(trace, Straight):
        return Geom2d_Line(gp_Pnt2d(*trace.origin.tolist()), gp_Dir2d(*trace.direction.tolist()))
    if not isinstance(trace, Spline):
        ends = np.array([trace.start, trace.end])
        trace = Spline(1, np.repeat(np.array(span), 2), ends)
    poles = Array1_gp_Pnt2d(1, len(trace.poles))
    for k, pole in enumerate(trace.poles.tolist()):
        poles.SetValue(k + 1, gp_Pnt2d(*pole))
    if trace.weights is None:
        return Geom2d_BSplineCurve(poles, *_knots(trace), trace.degree)
    return Geom2d_BSplineCurve(poles, _reals(_weights(trace)), *_knots(trace), trace.degree)


def _knots(spline: Spline) -> tuple[Array1_double, Array1_int]:
    """Distinct knots and their multiplicities."""
    values, times = np.unique(spline.knots, return_counts=True)
    return _reals(values.tolist()), _ints(times.tolist())


def _weights(spline: Spline) -> list[float]:
    """The weights of a spline's poles; the kernel drops those that are all 1."""
    if spline.weights is None:
        return [1.0] * len(spline.poles)
    return [float(w) for w in spline.weights[:, 0]]


def _reals(values: list[float]) -> Array1_double:
    out = Array1_double(1, len(values))
    for k, value in enumerate(values):
        out.SetValue(k + 1, value)
    return out


def _ints(values: list[int]) -> Array1_int:
    out = Array1_int(1, len(values))
    for k, value in enumerate(values):
        out.SetValue(k + 1, value)
    return out


def _pnt(point: Array) -> gp_Pnt:
    return gp_Pnt(*point.tolist())


def _dir(direction: Array) -> gp_Dir:
    return gp_Dir(*direction.tolist())
