"""Sheets folded along curved creases in STEP, against closed forms, read by OpenCASCADE."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import solids
from folds import ALPHA, HOLE, RADIUS, REACH, SWEEP, folded
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Curve2d, BRepAdaptor_Surface
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.collections import (
    IndexedDataMap_TopoDS_Shape_List_TopoDS_Shape_TopTools_ShapeMapHasher as AncestorMap,
)
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import (
    TopAbs_EDGE,
    TopAbs_FACE,
    TopAbs_REVERSED,
    TopAbs_SHELL,
    TopAbs_SOLID,
    TopAbs_VERTEX,
    TopAbs_WIRE,
)
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shape

from devcad.errors import CheckFailed
from devcad.export import Options, step, stepsheet
from devcad.export._step_body import Arc, Body

EXACT = 1e-13  # relative: rounding of closed forms
FITTED = 1e-4  # mm: how closely faces are fitted unless the recipe says otherwise
TWIST = math.radians(0.01)  # how far a fitted face's tangent plane may turn along a ruling


def written(name: str, folder: Path, thickness: float = 0.0) -> TopoDS_Shape:
    (made,) = step.write(folded(name, thickness), folder, Options())
    return solids.read(made.path)


def sector(inner: float, outer: float) -> float:
    """The area of the annulus' sector in the pattern."""
    return 0.5 * math.radians(SWEEP) * (outer**2 - inner**2)


def faces_of_edges(shape: TopoDS_Shape) -> list[tuple[TopoDS_Edge, int]]:
    """Every edge, each once, and how many faces run along it."""
    found = AncestorMap()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_EDGE, TopAbs_FACE, found)
    return [
        (TopoDS.Edge(found.FindKey(k)), found.FindFromIndex(k).Size())
        for k in range(1, found.Extent() + 1)
    ]


def creases(shape: TopoDS_Shape) -> list[TopoDS_Edge]:
    """The curved edges with a face on both sides."""
    edges = [edge for edge, faces in faces_of_edges(shape) if faces == 2]
    return [edge for edge in edges if BRepAdaptor_Curve(edge).GetType() != GeomAbs_Line]


def sides(shape: TopoDS_Shape, edge: TopoDS_Edge) -> list[tuple[TopoDS_Face, TopoDS_Edge]]:
    """The faces along an edge, and the edge as each of them runs along it."""
    return [
        (TopoDS.Face(face), TopoDS.Edge(own))
        for face in solids.walk(shape, TopAbs_FACE)
        for own in solids.walk(face, TopAbs_EDGE)
        if own.IsSame(edge)
    ]


def front(face: TopoDS_Face, edge: TopoDS_Edge, s: float) -> np.ndarray:
    """The unit normal on a face's front beside its edge at the parameter s, (3,)."""
    place = BRepAdaptor_Curve2d(edge, face).Value(s)
    point, u, v = gp_Pnt(), gp_Vec(), gp_Vec()
    BRepAdaptor_Surface(face).D1(place.X(), place.Y(), point, u, v)
    normal = u.Crossed(v)
    n = np.array([normal.X(), normal.Y(), normal.Z()]) / normal.Magnitude()
    return -n if face.Orientation() == TopAbs_REVERSED else n


def fold_angles(shape: TopoDS_Shape, edge: TopoDS_Edge) -> list[tuple[np.ndarray, float]]:
    """Points (3,) of a crease and the angle in radians between both faces' normals there."""
    curve = BRepAdaptor_Curve(edge)
    (one, first), (other, second) = sides(shape, edge)
    out = []
    for s in np.linspace(curve.FirstParameter(), curve.LastParameter(), 11)[1:-1].tolist():
        a, b = front(one, first, s), front(other, second, s)
        p = curve.Value(s)
        turned = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
        out.append((np.array([p.X(), p.Y(), p.Z()]), turned))
    return out


def test_a_folded_annulus_is_two_cones_that_share_one_circle(tmp_path: Path) -> None:
    """Both are known in closed form: the circle has the radius rho cos(alpha), and the apices of
    the cones stand rho sin(alpha) above and below its centre (geometry.md, section 8)."""
    shape = written("annulus", tmp_path)
    assert solids.kinds(shape) == {"Cone": 2}
    assert solids.area(shape) == pytest.approx(
        sector(RADIUS - REACH[0], RADIUS + REACH[1]), rel=EXACT
    )
    (crease,) = creases(shape)
    curve = BRepAdaptor_Curve(crease)
    assert curve.GetType() == GeomAbs_Circle
    alpha = math.radians(ALPHA)
    assert curve.Circle().Radius() == pytest.approx(RADIUS * math.cos(alpha), rel=EXACT)
    turn = curve.LastParameter() - curve.FirstParameter()
    assert turn == pytest.approx(math.radians(SWEEP) / math.cos(alpha), rel=EXACT)
    centre, axis = curve.Circle().Location(), curve.Circle().Axis().Direction()
    heights = [
        gp_Vec(centre, BRepAdaptor_Surface(face).Cone().Apex()).Dot(gp_Vec(axis))
        for face, _ in sides(shape, crease)
    ]
    rise = RADIUS * math.sin(alpha)
    np.testing.assert_allclose(sorted(heights), [-rise, rise], rtol=EXACT)


@pytest.mark.parametrize(
    ("name", "faces", "shared", "free"),
    [
        ("annulus", {"Cone": 2}, {"Circle": 1}, 6),
        ("wave", {"BSplineSurface": 2}, {"BSplineCurve": 1}, 6),
        ("label", {"BSplineSurface": 1, "Cylinder": 1}, {"BSplineCurve": 1}, 6),
        pytest.param("ring", {"Cone": 4}, {"Circle": 2, "Line": 4}, 4, marks=pytest.mark.slow),
        pytest.param(
            "wreath",
            {"BSplineSurface": 8},
            {"BSplineCurve": 4, "Line": 8},
            8,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "pleats", {"BSplineSurface": 4}, {"BSplineCurve": 3}, 10, marks=pytest.mark.slow
        ),
        pytest.param(
            "vault", {"BSplineSurface": 4}, {"Ellipse": 2, "Line": 2}, 8, marks=pytest.mark.slow
        ),
        pytest.param("bends", {"Cone": 4}, {"Circle": 2, "Line": 2}, 8, marks=pytest.mark.slow),
    ],
)
def test_faces_on_both_sides_run_opposite_ways_along_one_edge(
    name: str, faces: dict[str, int], shared: dict[str, int], free: int, tmp_path: Path
) -> None:
    """One shell: a crease is one edge of it, between two vertices, that two faces use. By Euler's
    formula a strip has one vertex more than edges less faces, and a ring as many."""
    shape = written(name, tmp_path)
    assert solids.kinds(shape) == faces
    assert len(list(solids.walk(shape, TopAbs_SHELL))) == 1
    edges = faces_of_edges(shape)
    assert [count for _, count in edges].count(1) == free
    both = [edge for edge, count in edges if count == 2]
    kinds = [str(BRepAdaptor_Curve(edge).GetType()).split("_")[-1] for edge in both]
    assert Counter(kinds) == shared
    for edge in both:
        uses = [own.Orientation() for _, own in sides(shape, edge)]
        assert len(set(uses)) == 2, "both fronts are on one side of the sheet"
    vertices = AncestorMap()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_VERTEX, TopAbs_EDGE, vertices)
    closed = name in ("ring", "wreath")
    assert vertices.Extent() - len(edges) + sum(faces.values()) == (0 if closed else 1)
    assert solids.image_gap(shape) <= 1e-7, "the edge lies on both faces"  # mm, the kernel's own


def test_holes_on_both_sides_of_a_crease_are_in_their_own_faces(tmp_path: Path) -> None:
    shape = written("drilled", tmp_path)
    left = sector(RADIUS - REACH[0], RADIUS + REACH[1]) - 2.0 * math.pi * (0.5 * HOLE) ** 2
    assert solids.area(shape) == pytest.approx(left, rel=1e-10)  # edges fitted to 1e-9 of them
    loops = [len(list(solids.walk(f, TopAbs_WIRE))) for f in solids.walk(shape, TopAbs_FACE)]
    assert loops == [2, 2]
    assert len(creases(shape)) == 1


def test_exact_faces_meet_at_the_fold_angle(tmp_path: Path) -> None:
    shape = written("annulus", tmp_path)
    for _, angle in fold_angles(shape, creases(shape)[0]):
        assert angle == pytest.approx(math.radians(2.0 * ALPHA), abs=1e-12)  # rounding


def test_fitted_faces_meet_at_the_fold_angle_that_varies_along_the_crease(tmp_path: Path) -> None:
    """On the circle the angle is given in t, and t is where a point stands."""
    shape = written("wave", tmp_path)
    for point, angle in fold_angles(shape, creases(shape)[0]):
        t = math.atan2(point[1], point[0])
        assert math.hypot(point[0], point[1]) == pytest.approx(50.0, abs=FITTED)
        assert angle == pytest.approx(math.radians(60.0 + 20.0 * math.sin(t)), abs=2.0 * TWIST)


def test_between_a_cylinder_and_a_fitted_face_the_edge_lies_on_the_cylinder(tmp_path: Path) -> None:
    shape = written("label", tmp_path)
    (crease,) = creases(shape)
    for point, _ in fold_angles(shape, crease):
        t = math.atan2(point[1], point[0])
        true = np.array([50.0 * math.cos(t), 50.0 * math.sin(t), 60.0 * t**2])
        assert math.hypot(point[0], point[1]) == pytest.approx(50.0, abs=1e-7)  # what kernels tell
        np.testing.assert_allclose(point, true, atol=1e-6)  # 3e-8 mm asked, steep against t


@pytest.mark.slow
def test_the_parallel_of_a_crease_of_constant_angle_folds_by_that_angle(tmp_path: Path) -> None:
    """The rulings between the two are square to both; the third crease is no parallel."""
    shape = written("pleats", tmp_path)
    folds = [[angle for _, angle in fold_angles(shape, edge)] for edge in creases(shape)]
    even = [f for f in folds if np.ptp(f) <= 2.0 * TWIST]
    assert len(even) == 2
    np.testing.assert_allclose(even, math.radians(50.0), atol=2.0 * TWIST)


def test_a_thick_sheet_is_a_solid_on_either_side_of_its_groove(tmp_path: Path) -> None:
    """The groove takes 1 mm off both sides; area x thickness is the volume of what is left, as the
    middle surface halves both layers of a cone."""
    part = folded("annulus", 1.0)
    (made,) = step.write(part, tmp_path, Options())
    one, other = solids.walk(solids.read(made.path), TopAbs_SOLID)
    volumes = sorted([solids.volume(one), solids.volume(other)])
    inner = sector(RADIUS - REACH[0], RADIUS - 1.0)
    outer = sector(RADIUS + 1.0, RADIUS + REACH[1])
    np.testing.assert_allclose(volumes, [inner, outer], rtol=EXACT)
    assert BRepExtrema_DistShapeShape(one, other).Value() > 0.0
    products = re.findall(r"PRODUCT\('([^']*)'", made.path.read_text())
    assert sorted(products) == ["annulus", "annulus-1", "annulus-2"]
    assert {check.panel for check in made.checks} == {"annulus"}
    assert made.max_deviation == 0.0


def test_the_middle_of_a_thick_sheet_has_no_groove(tmp_path: Path) -> None:
    (made,) = stepsheet.write(folded("annulus", 1.0), tmp_path, Options())
    shape = solids.read(made.path)
    assert len(creases(shape)) == 1
    assert solids.area(shape) == pytest.approx(
        sector(RADIUS - REACH[0], RADIUS + REACH[1]), rel=EXACT
    )


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("annulus", "2 bodies read back, 1 written"),
        pytest.param("bends", "10 free edges read back, 8 written", marks=pytest.mark.slow),
    ],
)
def test_faces_that_do_not_share_their_crease_in_the_file_are_refused(
    name: str, fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two edges in one place pass for valid, but the sheet has come apart there."""
    whole = step.shape_of
    monkeypatch.setattr(step, "shape_of", lambda body: whole(torn(body)))
    with pytest.raises(CheckFailed, match=fault):
        step.write(folded(name), tmp_path, Options())


def torn(body: Body) -> Body:
    """The body with an edge of its own for the last face at one of the creases."""
    *others, last = body.faces
    known = {use.edge for face in others for use in face.loop}
    curved = [use for use in last.loop if isinstance(body.edges[use.edge].curve, Arc)]
    (at,) = [k for k in (use.edge for use in curved) if k in known]
    loop = tuple(replace(u, edge=len(body.edges)) if u.edge == at else u for u in last.loop)
    edges = (*body.edges, body.edges[at])
    return replace(body, edges=edges, faces=(*others, replace(last, loop=loop)))
