"""STEP of polynomial surfaces: the surface itself, no fit, as the text and a fresh kernel say."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Geom import Geom_BSplineCurve, Geom_BSplineSurface
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape
from scipy.interpolate import BSpline

import devcad
from devcad.geometry.taylor import Array

CUBIC = [[0, 0, 0], [300, 0, 110], [620, 90, 130], [900, 260, 60]]
KNOTS = [0, 0, 0, 0, 1, 2.5, 2.5, 4, 4, 4, 4]
POLES = [[0, 0, 0], [10, 0, 0], [20, 5, 0], [35, 10, 0], [50, 10, 0], [60, 20, 0], [70, 30, 0]]
UPPER = [[5, 2, 40], [10, 2, 40], [15, 4.5, 40], [22.5, 7, 40], [30, 7, 40], [35, 12, 40]]
UPPER += [[40, 17, 40]]


def bspline(poles: list[list[float]]) -> str:
    return f'{{ kind = "bspline", degree = 3, knots = {KNOTS}, control_points = {poles} }}'


def export(folder: Path, surface: str, head: str = "") -> tuple[Path, dict[str, Any], TopoDS_Shape]:
    """The STEP file of a job, its entry in the report, and the shape that a fresh reader finds."""
    job = folder / "case.toml"
    job.write_text(f'name = "case"\n{head}\n[surface]\n{surface}\n')
    part = devcad.build(job)
    devcad.export(part, folder / "out", formats=["step"])
    path = folder / "out" / "case" / "case.step"
    report = json.loads((path.parent / "report.json").read_text())
    (entry,) = [file for file in report["files"] if file["format"] == "step"]
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    shape = reader.OneShape()
    assert BRepCheck_Analyzer(shape, True).IsValid()
    return path, entry, shape


def walk(shape: TopoDS_Shape, kind: object) -> list[TopoDS_Shape]:
    explorer, out = TopExp_Explorer(shape, kind), []
    while explorer.More():
        out.append(explorer.Current())
        explorer.Next()
    return out


def splines(shape: TopoDS_Shape) -> list[Geom_BSplineSurface]:
    faces = [BRepAdaptor_Surface(TopoDS.Face(face)) for face in walk(shape, TopAbs_FACE)]
    return [f.BSpline() for f in faces if "BSpline" in str(f.GetType())]


def edge_curves(shape: TopoDS_Shape) -> list[Geom_BSplineCurve]:
    edges = [TopoDS.Edge(e) for e in walk(shape, TopAbs_EDGE)]
    curves = [BRep_Tool.Curve_s(e, 0.0, 1.0) for e in edges if not BRep_Tool.Degenerated_s(e)]
    return [c for c in curves if c.IsKind("Geom_BSplineCurve")]


def poles(surface: Geom_BSplineSurface) -> Array:
    """The poles (u, v, 3) of a surface."""
    grid = [
        [surface.Pole(u + 1, v + 1) for v in range(surface.NbVPoles())]
        for u in range(surface.NbUPoles())
    ]
    return np.array([[(p.X(), p.Y(), p.Z()) for p in row] for row in grid])


def knots(surface: Geom_BSplineSurface) -> list[float]:
    """The knots along the rails, each as often as its multiplicity."""
    out: list[float] = []
    for k in range(1, surface.NbVKnots() + 1):
        out += [surface.VKnot(k)] * surface.VMultiplicity(k)
    return out


def test_a_bezier_patch_is_cubic_by_linear_with_its_own_control_points(tmp_path: Path) -> None:
    second = [222, 189, 196]  # 0.8 of the first leg along, a tenth of the first ruling back
    path, _, shape = export(
        tmp_path,
        f'kind = "bezier"\nboundary = {CUBIC}\nopposite_start = [[-20, 210, 120], {second}]',
    )
    (surface,) = splines(shape)
    assert (surface.UDegree(), surface.VDegree()) == (1, 3)
    assert knots(surface) == [0.0] * 4 + [1.0] * 4
    found = poles(surface)
    np.testing.assert_allclose(found[0], CUBIC, atol=1e-12)
    np.testing.assert_allclose(found[1, :2], [[-20, 210, 120], second], atol=1e-12)
    text = path.read_text()
    assert re.search(r"B_SPLINE_SURFACE_WITH_KNOTS\(''\s*,1,3,", text)
    assert "CARTESIAN_POINT('',(620.,90.,\n    130.))" in text


def test_it_is_reported_exact_and_small(tmp_path: Path) -> None:
    path, entry, shape = export(
        tmp_path, f'kind = "bezier"\nboundary = {CUBIC}\nopposite_start = [-20, 210, 120]'
    )
    assert entry["max_deviation"] == 0.0
    assert path.stat().st_size < 8000
    (surface,) = splines(shape)
    rails = poles(surface)
    for curve in edge_curves(shape):  # the edges are the same curves, cubic with four poles
        assert (curve.Degree(), curve.NbPoles()) == (3, 4)
        end = np.array([curve.Pole(1).X(), curve.Pole(1).Y(), curve.Pole(1).Z()])
        assert np.abs(rails[:, [0, -1]] - end).max(axis=2).min() <= 1e-12
    assert len(edge_curves(shape)) == 2


CASES = {
    "a cylinder over a spline": (
        f'kind = "cylinder"\ndirectrix = {bspline(POLES)}\ndirection = [0, 0.6, 0.8]\nlength = 40',
        (3, KNOTS),
    ),
    "with a slanted end": (
        f'kind = "cylinder"\ndirectrix = {bspline(POLES)}\ndirection = [0, 0, 1]\n'
        'extent = [0, "20 + t**2"]',
        (3, KNOTS),
    ),
    "ruled between splines on equal knots": (
        f'kind = "ruled"\nrails = [{bspline(POLES)}, {bspline(UPPER)}]',
        (3, KNOTS),
    ),
    "a cone over a spline": (
        f'kind = "cone"\napex = [0, -10, 100]\ndirectrix = {bspline(POLES)}\nextent = [0.25, 1]',
        (3, KNOTS),
    ),
    "a cone down to its apex": (
        f'kind = "cone"\napex = [0, -10, 100]\ndirectrix = {bspline(POLES)}',
        (3, KNOTS),
    ),
    "a cylinder over a formula": (
        'kind = "cylinder"\ndirectrix = { kind = "expression", x = "10*t", y = "t**2 - t**7/100", '
        'z = "0", t = [0, 2] }\ndirection = [0, 0, 1]\nlength = 5',
        (7, [0] * 8 + [2] * 8),
    ),
    "a developable spline": (
        f'kind = "bezier"\nboundary = {bspline(POLES)}\nopposite_start = [0, 20, 40]',
        (3, KNOTS),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_polynomial_faces_have_the_degree_and_the_knots_of_their_curves(
    name: str, tmp_path: Path
) -> None:
    surface, (degree, expected) = CASES[name]
    _, entry, shape = export(tmp_path, surface)
    (face,) = splines(shape)
    assert (face.UDegree(), face.VDegree()) == (1, degree)
    assert knots(face) == expected
    assert entry["max_deviation"] == 0.0


def test_the_poles_are_those_of_the_rails(tmp_path: Path) -> None:
    _, _, shape = export(tmp_path, CASES["ruled between splines on equal knots"][0])
    (face,) = splines(shape)
    np.testing.assert_allclose(poles(face), [POLES, UPPER], atol=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
def test_the_recipes_degree_is_for_fits_only(degree: int, tmp_path: Path) -> None:
    surface = CASES["a cylinder over a formula"][0]
    _, _, shape = export(tmp_path, f"{surface}\n[recipe.step]\ndegree = {degree}")
    (face,) = splines(shape)
    assert face.VDegree() == 7


def test_a_closed_spline_is_still_in_quarters_and_exact(tmp_path: Path) -> None:
    points = [[50, 0], [40, 40], [0, 50], [-40, 35], [-50, 0], [-30, -40], [0, -45], [40, -40]]
    closed = [[x, y, 0] for x, y in points]
    _, entry, shape = export(
        tmp_path,
        f'kind = "cylinder"\ndirectrix = {{ kind = "points", closed = true, points = {closed} }}\n'
        "direction = [0, 0, 1]\nlength = 30",
    )
    faces = splines(shape)
    assert len(faces) == 4
    assert all(face.VDegree() == 5 for face in faces)
    assert all(set(np.unique(knots(f), return_counts=True)[1][1:-1]) <= {1} for f in faces)
    assert entry["max_deviation"] == 0.0


def test_a_plates_polynomial_edge_is_exact_and_so_is_its_wall(tmp_path: Path) -> None:
    _, entry, shape = export(
        tmp_path,
        'kind = "ruled"\ncurve = { kind = "line", from = [0, 0, 0], to = [100, 0, 0] }\n'
        'direction = [0, 1, 0]\nextent = [0, "30 + 20*t - 10*t**3"]',
        "thickness = 1",
    )
    (wall,) = splines(shape)
    assert (wall.UDegree(), wall.VDegree(), wall.NbVPoles()) == (1, 3, 4)
    assert entry["max_deviation"] == 0.0


def test_thick_skins_are_no_polynomials_and_are_fitted(tmp_path: Path) -> None:
    _, entry, shape = export(
        tmp_path,
        f'kind = "bezier"\nboundary = {CUBIC}\nopposite_start = [-20, 210, 120]',
        "thickness = 2",
    )
    assert {face.VDegree() for face in splines(shape)} == {5}
    assert 0.0 < entry["max_deviation"] <= 1e-4


def test_a_unit_and_a_place_keep_it_exact(tmp_path: Path) -> None:
    _, _, shape = export(
        tmp_path,
        CASES["a developable spline"][0] + "\n[place]\norigin = [1, 2, 3]\nz_axis = [1, 1, 1]",
        'units = "in"',
    )
    (face,) = splines(shape)
    assert knots(face) == KNOTS
    low = poles(face)[0]
    legs = np.linalg.norm(np.diff(low, axis=0), axis=1)
    expected = 25.4 * np.linalg.norm(np.diff(np.array(POLES, float), axis=0), axis=1)
    np.testing.assert_allclose(legs, expected, rtol=1e-13)


def test_speeds_that_jump_at_a_smooth_break_are_taken_up_by_the_parameter(tmp_path: Path) -> None:
    # a parabola in two parts of which the second is run at half the speed: C1 in s, exact
    t = [0, 0, 0, 1, 1, 3, 3, 3]
    control = [[0, 0, 0], [10, 0, 0], [20, 20, 0], [30, 40, 0], [40, 80, 0]]
    curve = f'{{ kind = "bspline", degree = 2, knots = {t}, control_points = {control} }}'
    _, _, shape = export(
        tmp_path, f'kind = "cylinder"\ndirectrix = {curve}\ndirection = [0, 0, 1]\nlength = 5'
    )
    (face,) = splines(shape)
    true = BSpline(np.array(t, float), np.array(control, float), 2)
    assert (face.VDegree(), face.NbVPoles()) == (2, 3)
    np.testing.assert_allclose(poles(face)[0], [[0, 0, 0], [20, 0, 0], [40, 80, 0]], atol=1e-12)
    np.testing.assert_allclose(true([0.0, 3.0]), poles(face)[0][[0, -1]], atol=1e-12)
