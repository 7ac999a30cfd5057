"""Flat blanks as a fresh kernel reads them: faces, areas, volumes, where they lie, bytes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import drawings
import numpy as np
import parts
import pytest
from drawings import TURN, bow, straight
from OCP.Bnd import Bnd_Box
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp, BRepGProp_Face
from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Cylinder, GeomAbs_Line
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID, TopAbs_WIRE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

import devcad
from devcad.checks import Check
from devcad.errors import CheckFailed, GeometryError
from devcad.export import Options, Written
from devcad.export.stepflat import shifts, write
from devcad.flatten.pattern import Edge
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

THICK = 1.5
LENS_AREA = 0.5 * np.pi * 80.0 * 30.0


def part(*panels: Panel, thickness: float = THICK, name: str = "job") -> Part:
    thick = tuple(replace(panel, thickness=thickness) for panel in panels)
    return Part(name, thick, thickness, 0.05, ())


def export(*panels: Panel, folder: Path, thickness: float = THICK, **options: object) -> Written:
    (made,) = write(part(*panels, thickness=thickness), folder, Options(**options))  # type: ignore[arg-type]
    assert all(check.passed for check in made.checks)
    return made


def read(path: Path) -> TopoDS_Shape:
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    assert reader.TransferRoots() == 1
    shape = reader.OneShape()
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1) <= 1e-6
    return shape


def found(shape: TopoDS_Shape, kind: object) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)  # type: ignore[arg-type]
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def faces(shape: TopoDS_Shape) -> list[TopoDS_Face]:
    return [TopoDS.Face(face) for face in found(shape, TopAbs_FACE)]


def kinds(shape: TopoDS_Shape) -> dict[str, int]:
    names = [BRepAdaptor_Surface(face).GetType().name for face in faces(shape)]
    return dict(Counter(name.removeprefix("GeomAbs_") for name in names))


def area(shape: TopoDS_Shape) -> float:
    measured = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, measured, 1e-10)
    return float(measured.Mass())


def volume(shape: TopoDS_Shape) -> float:
    measured = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, measured, 1e-10, True, True)
    return float(measured.Mass())


def box(shape: TopoDS_Shape) -> list[float]:
    bounds = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, bounds, False, False)
    low, high = bounds.CornerMin(), bounds.CornerMax()
    return [low.X(), low.Y(), low.Z(), high.X(), high.Y(), high.Z()]


def normal(face: TopoDS_Face) -> Array:
    """The outward normal in the middle of a face's parameters."""
    surface = BRepGProp_Face(face)
    bounds = BRepAdaptor_Surface(face)
    point, vector = gp_Pnt(), gp_Vec()
    u = 0.5 * (bounds.FirstUParameter() + bounds.LastUParameter())
    v = 0.5 * (bounds.FirstVParameter() + bounds.LastVParameter())
    surface.Normal(u, v, point, vector)
    direction = np.array([vector.X(), vector.Y(), vector.Z()])
    return np.asarray(direction / np.linalg.norm(direction))


def level(shape: TopoDS_Shape, up: float) -> list[TopoDS_Face]:
    """The faces whose normal points along +z or -z."""
    return [face for face in faces(shape) if normal(face)[2] * up > 0.5]


def rectangle(width: float, height: float, *holes: tuple[Edge, ...], net: float = 0.0) -> Panel:
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    outline = tuple(straight("base", a, b) for a, b in pairwise([*corners, corners[0]]))
    return drawings.panel(outline, width * height - net, holes=holes)


def slot(x: float, y: float, length: float, radius: float) -> tuple[Edge, ...]:
    """A slot along x, clockwise."""
    half = 0.5 * length - radius
    return (
        bow("hole", (x + half, y), (radius, radius), 0.25 * TURN, -0.25 * TURN),
        straight("hole", (x + half, y - radius), (x - half, y - radius)),
        bow("hole", (x - half, y), (radius, radius), -0.25 * TURN, -0.75 * TURN),
        straight("hole", (x - half, y + radius), (x + half, y + radius)),
    )


def test_a_solid_stands_on_the_plane_with_its_front_up(tmp_path: Path) -> None:
    made = export(rectangle(90.0, 40.0), folder=tmp_path)
    assert made.path == tmp_path / "job-flat.step"
    assert (made.format, made.max_deviation) == ("step-flat", 0.0)
    shape = read(made.path)
    assert kinds(shape) == {"Plane": 6}
    assert len(list(found(shape, TopAbs_SOLID))) == 1
    assert volume(shape) == pytest.approx(90.0 * 40.0 * THICK, rel=1e-12)
    assert box(shape) == pytest.approx([0.0, 0.0, 0.0, 90.0, 40.0, THICK], abs=1e-6)
    (top,), (bottom,) = level(shape, 1.0), level(shape, -1.0)
    assert box(top)[2] == pytest.approx(THICK, abs=1e-6)
    assert box(bottom)[5] == pytest.approx(0.0, abs=1e-6)


def test_without_thickness_it_is_one_face_that_shows_its_front(tmp_path: Path) -> None:
    made = export(drawings.lampshade(), folder=tmp_path, thickness=0.0)
    shape = read(made.path)
    assert not list(found(shape, TopAbs_SOLID))
    assert len(list(found(shape, TopAbs_SHELL))) == 1
    (face,) = faces(shape)
    np.testing.assert_allclose(normal(face), [0.0, 0.0, 1.0], atol=1e-15)
    assert len(list(found(face, TopAbs_WIRE))) == 3
    assert area(shape) == pytest.approx(drawings.lampshade().pattern.area, rel=1e-9)
    assert box(shape)[2::3] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_arcs_are_cylinders_and_circles_two_halves_without_a_seam(tmp_path: Path) -> None:
    hole = (bow("hole", (50.0, 20.0), (6.0, 6.0), 0.3, 0.3 + TURN),)
    panel = rectangle(
        100.0, 40.0, hole, slot(20.0, 20.0, 24.0, 5.0), net=np.pi * 36 + np.pi * 25 + 140
    )
    shape = read(export(panel, folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 2 + 4 + 2, "Cylinder": 4}
    assert volume(shape) == pytest.approx(panel.pattern.area * THICK, rel=1e-13)
    curves = [BRepAdaptor_Curve(TopoDS.Edge(edge)) for edge in found(shape, TopAbs_EDGE)]
    assert {curve.GetType() for curve in curves} == {GeomAbs_Line, GeomAbs_Circle}
    radii = sorted(
        BRepAdaptor_Surface(face).Cylinder().Radius()
        for face in faces(shape)
        if BRepAdaptor_Surface(face).GetType() == GeomAbs_Cylinder
    )
    assert radii == [5.0, 5.0, 6.0, 6.0]  # short decimals come back as what they are


def test_walls_of_holes_face_into_the_hole(tmp_path: Path) -> None:
    hole = (bow("hole", (50.0, 20.0), (6.0, 6.0), 0.0, TURN),)
    shape = read(export(rectangle(100.0, 40.0, hole), folder=tmp_path).path)
    for face in faces(shape):
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() == GeomAbs_Cylinder:
            u = 0.5 * (surface.FirstUParameter() + surface.LastUParameter())
            at = surface.Value(u, 0.5 * (surface.FirstVParameter() + surface.LastVParameter()))
            inward = np.array([50.0 - at.X(), 20.0 - at.Y(), 0.0]) / 6.0
            np.testing.assert_allclose(normal(face), inward, atol=1e-12)


def test_other_edges_are_ruled_splines_within_the_tolerance(tmp_path: Path) -> None:
    made = export(drawings.lens(), folder=tmp_path)
    shape = read(made.path)
    assert kinds(shape) == {"Plane": 3, "BSplineSurface": 1}
    assert volume(shape) == pytest.approx(LENS_AREA * THICK, rel=2e-6)
    assert 0.0 < made.max_deviation <= 1e-4
    curves = [BRepAdaptor_Curve(TopoDS.Edge(edge)) for edge in found(shape, TopAbs_EDGE)]
    fitted = [curve for curve in curves if curve.GetType().name == "GeomAbs_BSplineCurve"]
    for curve in fitted:
        assert curve.Degree() == 5
        places = np.linspace(curve.FirstParameter(), curve.LastParameter(), 2001)
        points = [curve.Value(x) for x in places.tolist()]
        plane = np.array([[p.X(), p.Y()] for p in points])
        off = drawings.off_ellipse(plane, 80.0, 30.0)
        assert off.max() <= made.max_deviation * 1.2  # it was measured at five places a span
        slopes = [curve.DN(x, 1) for x in places[[0, -1]].tolist()]
        for slope in slopes:  # the ellipse's own tangent where it meets the axis
            assert abs(slope.X()) <= 1e-6 * abs(slope.Y())


def test_a_finer_tolerance_is_kept(tmp_path: Path) -> None:
    made = export(drawings.lens(), folder=tmp_path, step_tolerance=1e-6)
    assert 0.0 < made.max_deviation <= 1e-6
    assert volume(read(made.path)) == pytest.approx(LENS_AREA * THICK, rel=1e-8)


def test_polynomial_edges_are_themselves(tmp_path: Path) -> None:
    """A parabola over its chord: area 2/3 of the box, an exact quadratic wall."""
    crown = drawings.edge("top", lambda u: (u, 9.0 - u**2, 1.0 + 0.0 * u, -2.0 * u), 3.0, -3.0)
    panel = drawings.panel((straight("start", (-3.0, 0.0), (3.0, 0.0)), crown), 36.0)
    made = export(panel, folder=tmp_path)
    assert made.max_deviation == 0.0
    shape = read(made.path)
    assert volume(shape) == pytest.approx(36.0 * THICK, rel=1e-12)
    walls = [BRepAdaptor_Surface(f) for f in faces(shape)]
    (wall,) = (w for w in walls if w.GetType().name == "GeomAbs_BSplineSurface")
    assert (wall.UDegree(), wall.VDegree()) == (1, 2)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 30.0])
def test_areas_keep_their_digits_at_every_scale(scale: float, tmp_path: Path) -> None:
    thickness = 0.02 * scale
    made = export(drawings.lens(scale), folder=tmp_path, thickness=thickness)
    expected = LENS_AREA * scale**2 * thickness
    assert volume(read(made.path)) == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_fitted_holes_have_their_area_to_1e_7(turn: float, tmp_path: Path) -> None:
    """Whichever way round they are given."""
    hole = (bow("hole", (50.0, 20.0), (9.0, 4.0), 0.4, 0.4 + turn * TURN),)
    panel = rectangle(100.0, 40.0, hole, net=np.pi * 36.0)
    shape = read(export(panel, folder=tmp_path, thickness=0.0).path)
    assert 4000.0 - area(shape) == pytest.approx(np.pi * 36.0, rel=1e-7)
    shape = read(export(panel, folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 6, "BSplineSurface": 4}  # the closed curve in quarters


def test_an_edge_is_cut_where_its_curvature_runs_but_its_speed_jumps(tmp_path: Path) -> None:
    """A break with one tangent: the fit on both sides meets there, at any speed."""

    def form(u: Array) -> tuple[Array, ...]:
        t = np.where(u < 1.0, u, 1.0 + 3.0 * (u - 1.0))
        speed = np.where(u < 1.0, 1.0, 3.0)
        return (
            80.0 * np.cos(t),
            30.0 * np.sin(t),
            -80.0 * np.sin(t) * speed,
            30.0 * np.cos(t) * speed,
        )

    end = 1.0 + (np.pi - 1.0) / 3.0
    top = drawings.edge("top", form, 0.0, 1.0, end)
    panel = drawings.panel((straight("start", (-80.0, 0.0), (80.0, 0.0)), top), LENS_AREA)
    made = export(panel, folder=tmp_path)
    assert volume(read(made.path)) == pytest.approx(LENS_AREA * THICK, rel=2e-6)


def test_a_slit_without_width_is_no_edge(tmp_path: Path) -> None:
    """A flat ring that was cut open has an outline and a hole, a disc only an outline."""
    ring = (
        straight("start", (10.0, 0.0), (30.0, 0.0)),
        bow("top", (0.0, 0.0), (30.0, 30.0), 0.0, TURN),
        straight("end", (30.0, 0.0), (10.0, 0.0)),
        bow("base", (0.0, 0.0), (10.0, 10.0), TURN, 0.0),
    )
    panel = drawings.panel(ring, np.pi * 800.0)
    shape = read(export(panel, folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 2, "Cylinder": 4}
    assert volume(shape) == pytest.approx(np.pi * 800.0 * THICK, rel=1e-13)
    disc = (
        straight("start", (0.0, 0.0), (30.0, 0.0)),
        bow("top", (0.0, 0.0), (30.0, 30.0), 0.0, TURN),
        straight("end", (30.0, 0.0), (0.0, 0.0)),
    )
    shape = read(export(drawings.panel(disc, np.pi * 900.0), folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 2, "Cylinder": 2}
    oval = (
        straight("start", (15.0, 0.0), (30.0, 0.0)),
        bow("top", (0.0, 0.0), (30.0, 20.0), 0.0, TURN),
        straight("end", (30.0, 0.0), (15.0, 0.0)),
        bow("base", (0.0, 0.0), (15.0, 10.0), TURN, 0.0),
    )
    shape = read(export(drawings.panel(oval, np.pi * 450.0), folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 2, "BSplineSurface": 8}
    assert volume(shape) == pytest.approx(np.pi * 450.0 * THICK, rel=1e-6)


def test_blanks_of_a_part_stand_ten_millimetres_apart_in_a_row(tmp_path: Path) -> None:
    panels = [
        replace(drawings.lampshade(), name="one"),
        replace(drawings.lens(), name="two"),
        replace(rectangle(40.0, 60.0), name="three"),
    ]
    together = part(*panels)
    assert shifts(together)[0] == 0.0
    made = export(*panels, folder=tmp_path)
    boxes = [box(solid) for solid in found(read(made.path), TopAbs_SOLID)]
    first = panels[0].pattern.bbox
    assert boxes[0][:2] == pytest.approx(first[:2], abs=1e-4)
    for left, right in pairwise(boxes):
        assert right[0] - left[3] == pytest.approx(10.0, abs=2e-4)  # of fitted edges
    for seen, panel in zip(boxes, panels, strict=True):
        assert seen[1] == pytest.approx(panel.pattern.bbox[1], abs=1e-4)
    names = Counter(check.panel for check in made.checks)
    assert names == {"one": 2, "two": 2, "three": 2}
    assert {check.name for check in made.checks} == {"step-deviation", "volume"}


def test_a_pattern_that_is_not_isometric_says_so_in_the_name(tmp_path: Path) -> None:
    twisted = replace(
        part(rectangle(10.0, 10.0)), checks=(Check("twist", "body", 1.0, 0.01, "deg", False),)
    )
    (made,) = write(twisted, tmp_path, Options())
    assert made.path.name == "job-approximate-flat.step"


def test_without_a_pattern_there_is_no_blank(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="panel body: the panel has no pattern"):
        write(parts.part(parts.frustum(thickness=1.0)), tmp_path, Options())


def test_another_shape_that_reads_back_is_a_failed_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = read(export(rectangle(10.0, 10.0), folder=tmp_path).path)
    monkeypatch.setattr(sys.modules[write.__module__], "read_step", lambda path: other)
    with pytest.raises(CheckFailed, match=r"panel body: step-valid: other faces"):
        export(drawings.lens(), folder=tmp_path)


@pytest.mark.slow
def test_equal_input_gives_equal_bytes_in_one_process_and_in_two(tmp_path: Path) -> None:
    panels = replace(drawings.lampshade(), name="left"), replace(drawings.lens(), name="right")
    first = export(*panels, folder=tmp_path).path.read_bytes()
    for _ in range(3):
        export(rectangle(10.0, 20.0), folder=tmp_path)
        assert export(*panels, folder=tmp_path).path.read_bytes() == first
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from dataclasses import replace; from pathlib import Path; import drawings\n"
        "from devcad.export import Options; from devcad.export.stepflat import write\n"
        "from devcad.part import Part\n"
        "a = replace(drawings.lampshade(), name='left', thickness=1.5)\n"
        "b = replace(drawings.lens(), name='right', thickness=1.5)\n"
        "write(Part('job', (a, b), 1.5, 0.05, ()), Path(sys.argv[2]), Options())\n"
    )
    other = tmp_path / "other"
    other.mkdir()
    here = Path(drawings.__file__).parent
    ran = subprocess.run(
        [sys.executable, "-c", code, str(here), str(other)],
        env=os.environ | {"PYTHONHASHSEED": "77"},
        cwd=here.parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert (ran.stdout, ran.stderr) == ("", "")
    assert (other / "job-flat.step").read_bytes() == first


@pytest.mark.slow
def test_four_hundred_holes_take_seconds(tmp_path: Path) -> None:
    """400 circles: 800 cylinders, and the area to the last digits."""
    holes = tuple(
        (bow("hole", (10.0 + 10.0 * i, 10.0 + 10.0 * j), (3.0, 3.0), 0.0, -TURN),)
        for i in range(20)
        for j in range(20)
    )
    panel = rectangle(210.0, 210.0, *holes, net=400.0 * np.pi * 9.0)
    shape = read(export(panel, folder=tmp_path).path)
    assert kinds(shape) == {"Plane": 6, "Cylinder": 800}
    assert volume(shape) == pytest.approx(panel.pattern.area * THICK, rel=1e-12)


PERFORATED = """
name = "perforated"
thickness = {thickness}
[surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
{holes}
"""
HOLES = """
[[cutout]]
shape = "circle"
diameter = 20
at_surface = [0.5, 0.3]
[[cutout]]
shape = "slot"
length = 40
width = 8
angle = 30
at_surface = [0.0, 0.5]
"""
CUT_OUT = np.pi * 10.0**2 + np.pi * 4.0**2 + 32.0 * 8.0


@pytest.mark.parametrize("thickness", [0.0, THICK])
def test_a_jobs_holes_are_holes_and_notches_of_its_blank(thickness: float, tmp_path: Path) -> None:
    """A circle, and a slot that the cut of the tube parts: two notches in the outline."""
    measured = []
    for holes in ("", HOLES):
        job = tmp_path / "perforated.toml"
        job.write_text(PERFORATED.format(thickness=thickness, holes=holes))
        (made,) = write(devcad.build(job), tmp_path, Options())
        assert made.max_deviation == 0.0
        shape = read(made.path)
        measured.append(volume(shape) / thickness if thickness else area(shape))
    assert measured[0] - measured[1] == pytest.approx(CUT_OUT, rel=1e-9)
    (top,) = level(shape, 1.0)
    assert len(list(found(top, TopAbs_WIRE))) == 2
    assert kinds(shape).keys() == ({"Plane", "Cylinder"} if thickness else {"Plane"})
