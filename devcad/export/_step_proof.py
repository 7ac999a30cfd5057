"""What a written file holds, measured on the shapes of a fresh reader."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.collections import (
    IndexedDataMap_TopoDS_Shape_List_TopoDS_Shape_TopTools_ShapeMapHasher as AncestorMap,
)
from OCP.Geom import Geom_Surface
from OCP.GeomAbs import (
    GeomAbs_BSplineCurve,
    GeomAbs_BSplineSurface,
    GeomAbs_Cone,
    GeomAbs_Cylinder,
    GeomAbs_Plane,
)
from OCP.gp import gp_Ax1, gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_ShapeEnum, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from devcad.errors import CheckFailed
from devcad.export._step_body import Body, Cone, Cylinder, Face, Plane, Point, Ruled
from devcad.geometry.fit import FLOOR, Spline, ruled_twist
from devcad.geometry.taylor import Array

LOOSEST = 1e-6  # mm: edges and vertices must hold closer than this
LARGE, LARGE_GAP = 1e5, 1e-7  # mm, of the size: beyond it the reader fits images of its own
SKEW: Array = np.array([0.30151, 0.57177, 0.76301])
GAP_PLACES, PLACES = 2, 8  # a knot of an edge, or on a line: where its image is compared with it
VOLUME_EPS = AREA_EPS = 1e-9  # relative, asked of the kernel's adaptive quadrature

_KINDS = {
    Plane: GeomAbs_Plane,
    Cylinder: GeomAbs_Cylinder,
    Cone: GeomAbs_Cone,
    Ruled: GeomAbs_BSplineSurface,
}


@dataclass(frozen=True, slots=True)
class Proof:
    """Measured on one body: largest distance from the true surface in mm (0 where exact), largest
    twist of a skin in radians, a solid's volume in mm3 or a sheet's area in mm2, the other 0."""

    deviation: float
    twist: float
    volume: float
    area: float


def prove(bodies: list[Body], shape: TopoDS_Shape, size: float) -> list[Proof]:
    """The proofs of the bodies in a shape that was read back, in their order.

    Raises:
        CheckFailed: not one solid or shell a panel, a shape that is not valid, other faces or
            free edges than were written (a solid has none), tolerances above 1e-6 mm (1e-9 of the
            size), or edges as far off their faces.
    """
    kind = TopAbs_SOLID if bodies[0].solid else TopAbs_SHELL
    found = list(_shapes(shape, kind))
    if len(found) != len(bodies):
        raise _wrong(f"{len(found)} bodies read back, {len(bodies)} written")
    return [_prove(b, s, size) for b, s in zip(bodies, found, strict=True)]


def _prove(body: Body, shape: TopoDS_Shape, size: float) -> Proof:
    """The proof of one body."""
    if not BRepCheck_Analyzer(shape, True).IsValid():
        raise _wrong("the shape read back is not valid", body.name)
    faces = [TopoDS.Face(f) for f in _shapes(shape, TopAbs_FACE)]
    kinds = [BRepAdaptor_Surface(f).GetType() for f in faces]
    if kinds != [_KINDS[type(f.surface)] for f in body.faces]:
        raise _wrong("other faces read back than were written", body.name)
    free, planned = _free_edges(shape), _planned_free(body)
    if free != planned:
        raise _wrong(f"{free} free edges read back, {planned} written", body.name)
    loose = ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1)
    if loose > max(LOOSEST, FLOOR * size):
        raise _wrong(f"edges and vertices hold only to {loose:.3g} mm", body.name)
    gap = max(_gap(face) for face in faces)
    if gap > (max(LOOSEST, FLOOR * size) if size < LARGE else LARGE_GAP * size):
        raise _wrong(f"edges lie {gap:.3g} mm off their faces", body.name)
    measured = [_face(f, s) for f, s in zip(body.faces, faces, strict=True)]
    deviation = max([body.moved, _edges(body, shape), *(d for d, _ in measured)])
    fitted = any(isinstance(e.curve, Spline) and not e.curve.exact for e in body.edges)
    return Proof(
        deviation if fitted or deviation > FLOOR * size else 0.0,
        max(w for _, w in measured),
        _volume(shape) if body.solid else 0.0,
        0.0 if body.solid else _area(shape),
    )


def _face(face: Face, found: TopoDS_Face) -> tuple[float, float]:
    """The largest distance of the true points from a face, and its twist if it is a skin."""
    if face.points is None or not len(face.points):
        return 0.0, 0.0
    if not isinstance(face.surface, Ruled):
        return float(_distances(BRepAdaptor_Surface(found), face.points).max()), 0.0
    surface = BRep_Tool.Surface_s(found)
    deviation = 0.0
    if face.places is not None:
        gap = _values(surface, face.places) - face.points
        deviation = float(np.linalg.norm(gap, axis=1).max())
    return deviation, _twist(surface, face.places) if face.skin else 0.0


def _values(surface: Geom_Surface, places: Array) -> Array:
    """Points of the kernel's surface at places (n, 2), (n, 3)."""
    points = (surface.Value(u, v) for u, v in places.tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in points])


def _twist(surface: Geom_Surface, places: Array | None) -> float:
    """The largest turn of the tangent plane along the rulings of a 1 x p surface."""
    if places is None:
        return 0.0
    rows = [[], []]  # type: list[list[tuple[float, ...]]]
    point, across, along = gp_Pnt(), gp_Vec(), gp_Vec()
    for v in np.unique(places[:, 1]).tolist():
        for u in (0, 1):
            surface.D1(float(u), v, point, across, along)
            rows[u].append((point.X(), point.Y(), point.Z(), along.X(), along.Y(), along.Z()))
    low, high = np.array(rows[0]), np.array(rows[1])
    return float(ruled_twist(low[:, :3], low[:, 3:], high[:, :3], high[:, 3:]).max())


def _distances(surface: BRepAdaptor_Surface, points: Array) -> Array:
    """The distances of points (n, 3) from an unbounded plane, cylinder or cone, (n,)."""
    if surface.GetType() == GeomAbs_Plane:
        origin, normal = _axis(surface.Plane().Axis())
        return np.asarray(np.abs((points - origin) @ normal))
    cone = surface.GetType() == GeomAbs_Cone
    form = surface.Cone() if cone else surface.Cylinder()
    origin, axis = _axis(form.Axis())
    height = (points - origin) @ axis
    reach = np.linalg.norm(points - origin - height[:, None] * axis, axis=1)
    if not cone:
        return np.asarray(np.abs(reach - form.Radius()))
    angle = form.SemiAngle()
    return np.asarray(np.abs((reach - form.RefRadius()) * np.cos(angle) - height * np.sin(angle)))


def _axis(axis: gp_Ax1) -> tuple[Array, Array]:
    p, d = axis.Location(), axis.Direction()
    return np.array([p.X(), p.Y(), p.Z()]), np.array([d.X(), d.Y(), d.Z()])


def _gap(face: TopoDS_Face) -> float:
    """How far the edges of a face are from their images on it at equal parameters, mm; a plane
    has images of no edge."""
    if BRepAdaptor_Surface(face).GetType() == GeomAbs_Plane:
        return 0.0
    worst = 0.0
    for edge in (TopoDS.Edge(e) for e in _shapes(face, TopAbs_EDGE)):
        if BRep_Tool.Degenerated_s(edge):
            continue
        space, image = BRepAdaptor_Curve(edge), BRepAdaptor_Curve(edge, face)
        start, end = space.FirstParameter(), space.LastParameter()
        spline = space.GetType() == GeomAbs_BSplineCurve
        count = GAP_PLACES * space.NbKnots() if spline else PLACES
        for k in range(count):
            s = start + (end - start) * (k + 0.5) / count
            worst = max(worst, space.Value(s).Distance(image.Value(s)))
    return worst


def _edges(body: Body, shape: TopoDS_Shape) -> float:
    """The largest distance of the fitted edges of exact faces from the true ones.

    A reader may turn or renumber edges, so each is found by where its middle lies.
    """
    planned = [
        (e.curve, e.probes)
        for e in body.edges
        if isinstance(e.curve, Spline) and e.probes is not None and len(e.probes[0])
    ]
    if not planned:
        return 0.0
    curves = _spline_edges(shape)
    found = [
        _curve_values(c, np.array([0.5 * (c.FirstParameter() + c.LastParameter())])) for c in curves
    ]
    if not found:
        raise _wrong("edges that were written do not read back", body.name)
    wanted = [c(np.array([0.5 * (c.knots[0] + c.knots[-1])])) for c, _ in planned]
    nearest = _nearest(np.concatenate(found), np.concatenate(wanted))
    worst = 0.0
    for k, (_, (places, points)) in zip(nearest, planned, strict=True):
        gap = _curve_values(curves[k], places) - points
        worst = max(worst, float(np.linalg.norm(gap, axis=1).max()))
    return worst


def _nearest(found: Array, wanted: Array) -> list[int]:
    """Which of the points ``found`` (n, 3) is nearest to each of ``wanted`` (m, 3).

    Looked for along one line first, on which the rows of a pattern fall apart: two points are no
    farther apart in space than on it.
    """
    along, goals = found @ SKEW, wanted @ SKEW
    order = np.argsort(along)
    near = 1e-9 * (float(np.abs(found).max()) + 1.0)
    low, high = np.searchsorted(along[order], [goals - near, goals + near])
    out = []
    for point, a, b in zip(wanted, low.tolist(), high.tolist(), strict=True):
        some = order[a:b] if a < b else order
        out.append(int(some[np.linalg.norm(found[some] - point, axis=1).argmin()]))
    return out


def _spline_edges(shape: TopoDS_Shape) -> list[BRepAdaptor_Curve]:
    """The curves of all edges that are splines, each once."""
    found = AncestorMap()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, found)
    edges = [TopoDS.Edge(found.FindKey(k)) for k in range(1, found.Extent() + 1)]
    curves = [BRepAdaptor_Curve(e) for e in edges if not BRep_Tool.Degenerated_s(e)]
    return [c for c in curves if c.GetType() == GeomAbs_BSplineCurve]


def _curve_values(curve: BRepAdaptor_Curve, places: Array) -> Array:
    points = (curve.Value(s) for s in places.tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in points])


def _free_edges(shape: TopoDS_Shape) -> int:
    """The number of edges with a face on one side only."""
    found = AncestorMap()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, found)
    return sum(
        found.FindFromIndex(k).Size() < 2
        and not BRep_Tool.Degenerated_s(TopoDS.Edge(found.FindKey(k)))
        for k in range(1, found.Extent() + 1)
    )


def _planned_free(body: Body) -> int:
    """The number of edges that one face alone runs along, as they were written: none of a solid."""
    uses = Counter(u.edge for face in body.faces for loop in (face.loop, *face.holes) for u in loop)
    drawn = [k for k in uses if not isinstance(body.edges[k].curve, Point)]
    return sum(uses[k] == 1 for k in drawn)


def _volume(shape: TopoDS_Shape) -> float:
    """The volume by adaptive quadrature; negative where the shape is inside out."""
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found, VOLUME_EPS, True, True)
    return float(found.Mass())


def _area(shape: TopoDS_Shape) -> float:
    """The area of all faces by adaptive quadrature."""
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, found, AREA_EPS)
    return float(found.Mass())


def _shapes(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _wrong(what: str, panel: str = "") -> CheckFailed:
    return CheckFailed(f"step-valid: {what}", panel=panel)
