"""STEP of sheets between arcs of conics: rational faces and true circles and ellipses, no fit.

All is read by a fresh kernel and compared with projections from apices, with elliptic integrals,
and with plain quadrature of closed forms.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_BSplineSurface
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeContents, ShapeAnalysis_ShapeTolerance
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape
from scipy.integrate import quad
from scipy.special import ellipe

import devcad
from devcad.export._step_body import Ellipse
from devcad.export._step_folds import reversed_equal, reversed_trace
from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

TURN = 2.0 * np.pi
HALF = np.sqrt(0.5)  # the weight of a quarter turn: the cosine of half its angle


def export(folder: Path, surface: str, head: str = "") -> tuple[Path, dict[str, Any], TopoDS_Shape]:
    """The STEP file of a job, its entry in the report, and the shape that a fresh reader finds."""
    job = folder / "case.toml"
    job.write_text(f'name = "case"\n{head}\n[surface]\n{surface}\n')
    devcad.export(devcad.build(job), folder / "out", formats=["step"])
    path = folder / "out" / "case" / "case.step"
    report = json.loads((path.parent / "report.json").read_text())
    (entry,) = [file for file in report["files"] if file["format"] == "step"]
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return path, entry, reader.OneShape()


def walk(shape: TopoDS_Shape, kind: object) -> list[TopoDS_Shape]:
    explorer, out = TopExp_Explorer(shape, kind), []
    while explorer.More():
        out.append(explorer.Current())
        explorer.Next()
    return out


def splines(shape: TopoDS_Shape) -> list[Geom_BSplineSurface]:
    faces = [BRepAdaptor_Surface(TopoDS.Face(face)) for face in walk(shape, TopAbs_FACE)]
    return [f.BSpline() for f in faces if "BSpline" in str(f.GetType())]


def weights(surface: Geom_BSplineSurface) -> Array:
    """The weights (2, poles along the rail), the first of each rail 1."""
    rows = [
        [surface.Weight(u, v) for v in range(1, surface.NbVPoles() + 1)]
        for u in range(1, surface.NbUPoles() + 1)
    ]
    return np.array(rows) / np.array(rows)[:, :1]


def points(shape: TopoDS_Shape) -> Array:
    """Points all over the spline faces, (n, 3)."""
    out = []
    for surface in splines(shape):
        low, high = surface.VKnot(1), surface.VKnot(surface.NbVKnots())
        for u in np.linspace(0.0, 1.0, 5):
            for v in np.linspace(low, high, 9):
                p = surface.Value(float(u), float(v))
                out.append((p.X(), p.Y(), p.Z()))
    return np.array(out)


def area(shape: TopoDS_Shape) -> float:
    """By adaptive quadrature, face by face."""
    total = 0.0
    for face in walk(shape, TopAbs_FACE):
        found = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, found, 1e-13)
        total += found.Mass()
    return total


def round_edges(shape: TopoDS_Shape) -> list[str]:
    """The kinds of all curved edges, face by face."""
    edges = [TopoDS.Edge(e) for e in walk(shape, TopAbs_EDGE)]
    curves = [BRepAdaptor_Curve(e) for e in edges if not BRep_Tool.Degenerated_s(e)]
    names = [str(c.GetType()).split("_")[-1] for c in curves]
    return sorted(n for n in names if n != "Line")


def cone_area(apex: list[float], radii: tuple[float, float], span: tuple[float, float]) -> float:
    """The area between an apex and an arc of an ellipse about the origin in z = 0."""

    def swept(t: float) -> float:
        arm = np.array([radii[0] * np.cos(t), radii[1] * np.sin(t), 0.0]) - apex
        along = np.array([-radii[0] * np.sin(t), radii[1] * np.cos(t), 0.0])
        return 0.5 * float(np.linalg.norm(np.cross(arm, along)))

    quarters = np.linspace(*span, 9)
    return sum(quad(swept, a, b, epsrel=1e-13)[0] for a, b in pairwise(quarters))


OBLIQUE = 'kind = "cone"\napex = [30, 10, 120]\ndirectrix = { kind = "circle", radius = 50 }\n'
SHARP = (
    'kind = "cone"\napex = [30, 10, 120]\n'
    'directrix = { kind = "ellipse", radii = [60, 40], sweep = 150 }\n'
)
PIPE = 'kind = "cylinder"\ndirectrix = { kind = "ellipse", radii = [60, 40] }\nlength = 50\n'
O44 = (
    'kind = "ruled"\nrails = [{ kind = "circle", radius = 2 }, '
    '{ kind = "circle", radius = 1, center = [1, 0, 3] }]'
)
WHOLE = cone_area([30, 10, 120], (50, 50), (0, TURN))
PART = cone_area([30, 10, 120], (60, 40), (0, TURN * 150 / 360))
CASES: dict[str, tuple[str, float, list[float]]] = {
    # name: (surface, its area, the weights of its middle poles face by face)
    "oblique cone": (OBLIQUE + "extent = [0.4, 1]", (1.0 - 0.4**2) * WHOLE, [HALF] * 4),
    "oblique cone to its apex": (OBLIQUE, WHOLE, [HALF] * 4),
    "oblique transition": (O44, 30.467984200264393, [HALF] * 4),
    "elliptic pipe": (PIPE + "direction = [0, 0, 1]", 50 * 240 * ellipe(1 - 4 / 9), [HALF] * 4),
    "fan from a corner to an arc": (SHARP, PART, [np.cos(np.radians(37.5))] * 2),
}


@pytest.mark.parametrize("name", CASES)
def test_arcs_give_rational_faces_of_degree_two_and_the_true_area(
    name: str, tmp_path: Path
) -> None:
    surface, expected, middle = CASES[name]
    path, entry, shape = export(tmp_path, surface)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1) <= 1e-7
    contents = ShapeAnalysis_ShapeContents()
    contents.Perform(shape)
    assert contents.NbC0Surfaces() == 0
    faces = splines(shape)
    assert [(f.UDegree(), f.VDegree(), f.NbVPoles()) for f in faces] == [(1, 2, 3)] * len(middle)
    for face, weight in zip(faces, middle, strict=True):
        np.testing.assert_allclose(weights(face), [[1, weight, 1]] * 2, rtol=1e-13)
    assert path.read_text().count("RATIONAL_B_SPLINE_SURFACE") == len(middle)
    assert entry["max_deviation"] == 0.0
    assert area(shape) == pytest.approx(expected, rel=1e-12)


def on_the_oblique_cone(p: Array) -> Array:
    apex = np.array([30.0, 10.0, 120.0])
    foot = apex + (p - apex) * (120.0 / (120.0 - p[:, 2]))[:, None]
    return np.asarray(np.hypot(foot[:, 0], foot[:, 1]) - 50.0)


def on_the_transition(p: Array) -> Array:
    return np.asarray(np.hypot(p[:, 0] - p[:, 2] / 3.0, p[:, 1]) - (2.0 - p[:, 2] / 3.0))


def on_the_pipe(p: Array) -> Array:
    return np.asarray(np.hypot(p[:, 0] / 60.0, p[:, 1] / 40.0) - 1.0)


@pytest.mark.parametrize(
    ("name", "level"),
    [
        ("oblique cone", on_the_oblique_cone),
        ("oblique transition", on_the_transition),
        ("elliptic pipe", on_the_pipe),
    ],
)
def test_every_point_of_the_faces_lies_on_the_cone_or_cylinder(
    name: str, level: Callable[[Array], Array], tmp_path: Path
) -> None:
    _, _, shape = export(tmp_path, CASES[name][0])
    found = points(shape)
    size = np.abs(found).max()
    assert np.abs(level(found)).max() <= 1e-12 * size


def test_an_oblique_pipe_is_exact_too(tmp_path: Path) -> None:
    _, entry, shape = export(tmp_path, PIPE + "direction = [0, 0.6, 0.8]")
    p = points(shape)
    foot = p[:, 1] - 0.75 * p[:, 2]
    assert np.abs(np.hypot(p[:, 0] / 60.0, foot / 40.0) - 1.0).max() <= 1e-13
    assert entry["max_deviation"] == 0.0


EDGES = {
    "oblique transition": ["Circle"] * 8,
    "oblique cone to its apex": ["Circle"] * 4,
    "elliptic pipe": ["Ellipse"] * 8,
    "fan from a corner to an arc": ["Ellipse"] * 2,
}


@pytest.mark.parametrize("name", EDGES)
def test_the_edges_are_true_circles_and_ellipses(name: str, tmp_path: Path) -> None:
    path, _, shape = export(tmp_path, CASES[name][0])
    assert round_edges(shape) == EDGES[name]
    if name == "oblique transition":
        assert sorted(re.findall(r"= CIRCLE\('',#\d+,(.*?)\)", path.read_text())) == (
            ["1."] * 4 + ["2."] * 4
        )


def test_a_slanted_end_of_a_round_pipe_is_an_ellipse_with_the_known_radii(tmp_path: Path) -> None:
    path, entry, shape = export(
        tmp_path,
        'kind = "cylinder"\ndirectrix = { kind = "circle", radius = 30 }\n'
        'direction = [0, 0, 1]\nextent = ["0", "50 + 40*cos(t)"]',
    )
    assert round_edges(shape) == ["Circle"] * 2 + ["Ellipse"] * 2
    assert re.findall(r"= ELLIPSE\('',#\d+,(.*?),(.*?)\)", path.read_text()) == [("50.", "30.")] * 2
    assert entry["max_deviation"] == 0.0
    # the image of the ellipse on the cylinder is fitted, to 1e-8 mm
    assert area(shape) == pytest.approx(TURN * 30 * 50, rel=1e-10)


def test_a_plane_cuts_an_elliptic_cone_in_an_ellipse_with_weights_of_its_own(
    tmp_path: Path,
) -> None:
    _, entry, shape = export(
        tmp_path,
        'kind = "cone"\napex = [10, 5, 100]\n'
        'directrix = { kind = "ellipse", radii = [60, 40] }\n'
        'extent = ["1 / (1.5 + 0.2*cos(t))", "1"]',
    )
    low = np.array([weights(face) for face in splines(shape)])
    assert np.abs(low[:, 0] - low[:, 1]).max() > 0.02
    assert round_edges(shape) == ["Ellipse"] * 8
    assert entry["max_deviation"] == 0.0
    p = points(shape)
    foot = p[:, :2] + (p[:, :2] - [10, 5]) * (p[:, 2] / (100.0 - p[:, 2]))[:, None]
    assert np.abs(np.hypot(foot[:, 0] / 60.0, foot[:, 1] / 40.0) - 1.0).max() <= 1e-12


def test_a_hyperbola_between_point_and_arc_is_exact_with_a_weight_above_one(tmp_path: Path) -> None:
    _, entry, shape = export(
        tmp_path,
        'kind = "cone"\napex = [0, 0, 90]\ndirectrix = { kind = "expression", '
        'x = "30*cosh(t)", y = "20*sinh(t)", z = "0", t = [-0.5, 1.5] }',
    )
    (face,) = splines(shape)
    assert weights(face)[0, 1] == pytest.approx(np.cosh(1.0), rel=1e-12)
    assert entry["max_deviation"] == 0.0


def test_the_edges_own_parameter_does_not_matter(tmp_path: Path) -> None:
    _, entry, shape = export(
        tmp_path,
        'kind = "cone"\napex = [30, 10, 120]\ndirectrix = { kind = "expression", '
        'x = "50*cos(t + 0.1*t**2)", y = "50*sin(t + 0.1*t**2)", z = "0", t = [0, 2] }',
    )
    angle = (2 + 0.4) / 2
    np.testing.assert_allclose(
        [weights(f)[0, 1] for f in splines(shape)], [np.cos(0.5 * angle)] * 2, rtol=1e-12
    )
    assert entry["max_deviation"] == 0.0
    assert area(shape) == pytest.approx(cone_area([30, 10, 120], (50, 50), (0, 2.4)), rel=1e-12)


FITTED = {
    "no conic": (
        'kind = "cone"\napex = [0, 0, 90]\ndirectrix = { kind = "expression", '
        'x = "30*cos(t)", y = "20*sin(t) + 1e-6*sin(5*t)", z = "0", t = [0, 2] }'
    ),
    "an end that is none": (
        PIPE.replace("length = 50", 'extent = ["0", "50 + 3*sin(2*t)"]') + "direction = [0, 0, 1]"
    ),
}


@pytest.mark.parametrize("name", FITTED)
def test_what_is_no_conic_by_a_hundredth_of_the_tolerance_is_a_fit(
    name: str, tmp_path: Path
) -> None:
    _, entry, shape = export(tmp_path, FITTED[name])
    assert {face.VDegree() for face in splines(shape)} == {5}
    assert not any(face.IsVRational() for face in splines(shape))
    assert 0.0 < entry["max_deviation"] <= 1e-4


def test_thick_skins_are_no_conics_and_are_fitted(tmp_path: Path) -> None:
    _, entry, shape = export(tmp_path, O44.replace("radius = 2", "radius = 2.5"), "thickness = 0.1")
    assert not any(face.IsVRational() for face in splines(shape))
    assert entry["max_deviation"] > 0.0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_and_place_keep_it_exact(scale: float, tmp_path: Path) -> None:
    surface = (
        f'kind = "cone"\napex = [{30 * scale}, {10 * scale}, {120 * scale}]\n'
        f'directrix = {{ kind = "circle", radius = {50 * scale} }}\nextent = [0.4, 1]\n'
        f"[place]\norigin = [{scale}, {2 * scale}, {3 * scale}]\nz_axis = [1, 1, 1]"
    )
    _, entry, shape = export(tmp_path, surface, 'units = "in"')
    assert len(splines(shape)) == 4
    assert round_edges(shape) == ["Circle"] * 8
    assert entry["max_deviation"] == 0.0
    expected = (1.0 - 0.4**2) * WHOLE * (25.4 * scale) ** 2
    assert area(shape) == pytest.approx(expected, rel=1e-12)


def test_an_ellipse_run_backwards_is_the_same_edge_with_its_image_turned_round() -> None:
    centre, axis, x = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    there, back = Ellipse(centre, axis, x, 3.0, 2.0), Ellipse(centre, -axis, -x, 3.0, 2.0)
    assert reversed_equal(back, there, 5.0)
    assert not reversed_equal(Ellipse(centre, axis, x, 3.0, 2.1), there, 5.0)
    image = Spline(2, np.array([1.0, 1.0, 1.0, 3.0, 3.0, 3.0]), np.array([[0.0], [1.0], [4.0]]))
    turned = reversed_trace(image, (1.0, 3.0), (5.0, 6.0))
    assert isinstance(turned, Spline)
    share = np.linspace(0.0, 1.0, 5)
    np.testing.assert_allclose(turned(5.0 + share), image(3.0 - 2.0 * share), atol=1e-15)
