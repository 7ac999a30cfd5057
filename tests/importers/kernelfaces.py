"""Faces made with the kernel alone, for tests that read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_NurbsConvert,
    BRepBuilderAPI_Sewing,
    BRepBuilderAPI_Transform,
)
from OCP.BRepLib import BRepLib
from OCP.BRepLProp import BRepLProp_SLProps
from OCP.BRepTools import BRepTools
from OCP.collections import Array1_double, Array1_gp_Pnt, Array1_int, Array2_gp_Pnt
from OCP.GCPnts import GCPnts_AbscissaPoint
from OCP.Geom import (
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_ConicalSurface,
    Geom_Curve,
    Geom_CylindricalSurface,
    Geom_Line,
    Geom_Plane,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
)
from OCP.Geom2d import Geom2d_Circle, Geom2d_Line
from OCP.GeomAPI import GeomAPI_PointsToBSpline
from OCP.GeomFill import GeomFill
from OCP.gp import gp_Ax2, gp_Ax2d, gp_Ax3, gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d, gp_Trsf
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Vertex, TopoDS_Wire

from devcad.geometry.taylor import Array

PLACE = gp_Ax3(gp_Pnt(3.0, -2.0, 5.0), gp_Dir(1.0, 2.0, 3.0), gp_Dir(3.0, 0.0, -1.0))
"""Somewhere, askew."""


def over(surface: Geom_Surface, *box: float) -> TopoDS_Face:
    """The face of a surface over u0, u1, w0, w1."""
    return BRepBuilderAPI_MakeFace(surface, *box, 1e-9).Face()


def cylinder(radius: float) -> Geom_CylindricalSurface:
    return Geom_CylindricalSurface(PLACE, radius)


def cone(half_angle: float, radius: float) -> Geom_ConicalSurface:
    return Geom_ConicalSurface(PLACE, half_angle, radius)


def upright(curve: Geom_Curve) -> Geom_SurfaceOfLinearExtrusion:
    """A curve of the plane x, y extruded along z."""
    return Geom_SurfaceOfLinearExtrusion(curve, gp_Dir(0.0, 0.0, 1.0))


FLAT = gp_Ax2(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0), gp_Dir(1.0, 0.0, 0.0))
"""The plane x, y."""


def polyline(points: Sequence[tuple[float, float]]) -> Geom_BSplineCurve:
    """A spline of degree 1 in the plane x, y."""
    poles = Array1_gp_Pnt(1, len(points))
    knots, times = Array1_double(1, len(points)), Array1_int(1, len(points))
    for k, point in enumerate(points, 1):
        poles.SetValue(k, gp_Pnt(*point, 0.0))
        knots.SetValue(k, float(k))
        times.SetValue(k, 2 if k in (1, len(points)) else 1)
    return Geom_BSplineCurve(poles, knots, times, 1)


def quad(corners: Sequence[Sequence[float]]) -> Geom_BSplineSurface:
    """The bilinear surface over four corners, given round it."""
    a, b, c, d = (gp_Pnt(*corner) for corner in corners)
    poles = Array2_gp_Pnt(1, 2, 1, 2)
    for row, column, point in ((1, 1, a), (2, 1, b), (2, 2, c), (1, 2, d)):
        poles.SetValue(row, column, point)
    knots, times = Array1_double(1, 2), Array1_int(1, 2)
    for k in (1, 2):
        knots.SetValue(k, float(k - 1))
        times.SetValue(k, 2)
    return Geom_BSplineSurface(poles, knots, knots, times, times, 1, 1)


def cone_over(rays: Array, low: float, high: float) -> TopoDS_Face:
    """The cone from the origin through the spline of unit vectors (n, 3), between two lengths."""
    points = Array1_gp_Pnt(1, len(rays))
    for k, ray in enumerate(rays.tolist(), 1):
        points.SetValue(k, gp_Pnt(*ray))
    curve = GeomAPI_PointsToBSpline(points).Curve()
    rails = [curve.Scaled(gp_Pnt(0, 0, 0), x) for x in (low, high)]
    return over(GeomFill.Surface_s(*rails), 0.0, 1.0, 0.0, 1.0)


def plate(
    outline: Sequence[tuple[float, float]], holes: Sequence[tuple[float, float, float]]
) -> TopoDS_Face:
    """A plane face with a polygon as outline and round holes (x, y, radius), in ``PLACE``."""
    plane = Geom_Plane(PLACE)
    corners = [plane.Value(*point) for point in outline]
    wire = BRepBuilderAPI_MakeWire()
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        wire.Add(BRepBuilderAPI_MakeEdge(start, end).Edge())
    face = BRepBuilderAPI_MakeFace(plane, wire.Wire(), True)
    for x, y, radius in holes:
        frame = gp_Ax2d(gp_Pnt2d(x, y), gp_Dir2d(1.0, 0.0))
        face.Add(ring(Geom2d_Circle(frame, radius), plane, 2.0 * math.pi, forward=False))
    return face.Face()


def ring(curve: object, surface: Geom_Surface, length: float, *, forward: bool) -> TopoDS_Wire:
    """The wire of one closed curve in the parameters of a surface."""
    edge = BRepBuilderAPI_MakeEdge(curve, surface, 0.0, length).Edge()
    BRepLib.BuildCurves3d_s(edge)
    wire = BRepBuilderAPI_MakeWire(edge).Wire()
    return wire if forward else TopoDS.Wire(wire.Reversed())


def drilled(face: TopoDS_Face, u: float, w: float, radius: float) -> TopoDS_Face:
    """The face with a hole that is a circle in the surface's parameters."""
    surface = BRep_Tool.Surface_s(face)
    frame = gp_Ax2d(gp_Pnt2d(u, w), gp_Dir2d(1.0, 0.0))
    hole = ring(Geom2d_Circle(frame, radius), surface, 2.0 * math.pi, forward=False)
    out = BRepBuilderAPI_MakeFace(face)
    out.Add(hole)
    return out.Face()


def seamless(surface: Geom_CylindricalSurface, height: float) -> TopoDS_Face:
    """A whole cylinder between two circles, without the seam that the kernel wants."""
    face = TopoDS_Face()
    builder = BRep_Builder()
    builder.MakeFace(face, surface, 1e-7)
    for w, forward in ((0.0, True), (height, False)):
        line = Geom2d_Line(gp_Pnt2d(0.0, w), gp_Dir2d(1.0, 0.0))
        builder.Add(face, ring(line, surface, 2.0 * math.pi, forward=forward))
    return face


def sewn(parts: Sequence[TopoDS_Face]) -> TopoDS_Shape:
    """The faces with common edges."""
    sewing = BRepBuilderAPI_Sewing(1e-6)
    for part in parts:
        sewing.Add(part)
    sewing.Perform()
    return sewing.SewedShape()


def moved(shape: TopoDS_Shape, motion: gp_Trsf) -> TopoDS_Shape:
    """A copy with changed geometry: also for mirrors and scales."""
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()


def located(shape: TopoDS_Shape, motion: gp_Trsf) -> TopoDS_Shape:
    """The same geometry at another place."""
    return shape.Moved(TopLoc_Location(motion))


def as_spline(shape: TopoDS_Shape) -> TopoDS_Face:
    """The face with its surface and curves as rational B-splines."""
    return TopoDS.Face(BRepBuilderAPI_NurbsConvert(shape, True).Shape())


def faces(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    return [TopoDS.Face(found) for found in _found(shape, TopAbs_FACE)]


def _found(shape: TopoDS_Shape, kind: object) -> list[TopoDS_Shape]:
    explorer, out = TopExp_Explorer(shape, kind), []
    while explorer.More():
        out.append(explorer.Current())
        explorer.Next()
    return out


def border_length(face: TopoDS_Face) -> float:
    """The length of all edges round a face by the kernel, a seam counted twice, mm."""
    edges = [TopoDS.Edge(e) for e in _found(face, TopAbs_EDGE)]
    return sum(_length(e) for e in edges if not BRep_Tool.Degenerated_s(e))


def _length(edge: TopoDS_Edge) -> float:
    return GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(edge), 1e-12)


def outward(face: TopoDS_Face) -> tuple[Array, Array]:
    """A point in the middle of a face's parameters and its outward normal there."""
    u0, u1, w0, w1 = BRepTools.UVBounds_s(face)
    place = 0.45 * u0 + 0.55 * u1, 0.5 * (w0 + w1)
    found = BRepLProp_SLProps(BRepAdaptor_Surface(face), *place, 1, 1e-9)
    n, p = found.Normal(), found.Value()
    sign = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
    return np.array([p.X(), p.Y(), p.Z()]), sign * np.array([n.X(), n.Y(), n.Z()])


def gaping(gap: float) -> TopoDS_Face:
    """A rectangle 10 x 20 whose last edge starts a gap too far to the right, with vertices loose
    enough to cover it."""
    builder, face, wire = BRep_Builder(), TopoDS_Face(), TopoDS_Wire()
    builder.MakeFace(face, Geom_Plane(gp_Ax3(FLAT)), 1e-7)
    builder.MakeWire(wire)
    corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (0.0, 20.0)]
    vertices = []
    for x, y in corners:
        vertex = TopoDS_Vertex()
        builder.MakeVertex(vertex, gp_Pnt(x, y, 0.0), 2.0 * gap)
        vertices.append(vertex)
    for k in range(4):
        (x0, y0), (x1, y1) = corners[k], corners[(k + 1) % 4]
        aside = gap if k == 3 else 0.0
        length = math.hypot(x1 - x0, y1 - y0)
        line = Geom_Line(gp_Pnt(x0 + aside, y0, 0.0), gp_Dir(x1 - x0, y1 - y0, 0.0))
        edge = TopoDS_Edge()
        builder.MakeEdge(edge, line, 1e-7)
        builder.Range(edge, 0.0, length)
        builder.Add(edge, vertices[k])
        builder.Add(edge, TopoDS.Vertex(vertices[(k + 1) % 4].Reversed()))
        builder.Add(wire, edge)
    wire.Closed(True)
    builder.Add(face, wire)
    return face
