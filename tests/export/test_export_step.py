"""STEP files as a fresh kernel reads them: shapes, areas, volumes, orientation, names, bytes."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import parts
import pytest
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp, BRepGProp_Face
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt, gp_Vec
from OCP.GProp import GProp_GProps
from OCP.Quantity import Quantity_Color
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeContents, ShapeAnalysis_ShapeTolerance
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.STEPControl import STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_ChildIterator, TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool
from parts import TURN

from devcad.errors import CheckFailed, DevcadError, FileError, GeometryError, JobError
from devcad.export import Options, Written
from devcad.export._step_file import read_step
from devcad.export.step import write
from devcad.geometry.chain import Joint
from devcad.geometry.classify import Shape
from devcad.geometry.taylor import Array
from devcad.part import Panel

Make = Callable[[float], Panel]  # thickness -> panel

CASES: dict[str, tuple[Make, dict[str, int], dict[str, int]]] = {
    # name: (panel, faces of the sheet, faces of the solid)
    "frustum": (lambda t: parts.frustum(thickness=t), {"Cone": 2}, {"Cone": 8}),
    "frustum, open": (
        lambda t: parts.frustum(sweep=4.0, thickness=t),
        {"Cone": 1},
        {"Cone": 4, "Plane": 2},
    ),
    "frustum, wide end up": (
        lambda t: parts.frustum(50.0, 90.0, thickness=t),
        {"Cone": 2},
        {"Cone": 8},
    ),
    "pipe": (
        lambda t: parts.frustum(60.0, 60.0, thickness=t),
        {"Cylinder": 2},
        {"Cylinder": 4, "Plane": 4},
    ),
    "pipe, open": (
        lambda t: parts.frustum(60.0, 60.0, sweep=5.0, thickness=t),
        {"Cylinder": 1},
        {"Cylinder": 2, "Plane": 4},
    ),
    "cone": (lambda t: parts.frustum(top=0.0, thickness=t), {"Cone": 2}, {"Cone": 6}),
    "cone, open": (
        lambda t: parts.frustum(top=0.0, sweep=2.0, thickness=t),
        {"Cone": 1},
        {"Cone": 3, "Plane": 2},
    ),
    "mitred pipe": (
        lambda t: parts.mitred_pipe(thickness=t),
        {"Cylinder": 2},
        {"Cylinder": 4, "Plane": 2, "BSplineSurface": 2},
    ),
    "mitred pipe, open": (
        lambda t: parts.mitred_pipe(sweep=4.0, thickness=t),
        {"Cylinder": 1},
        {"Cylinder": 2, "Plane": 3, "BSplineSurface": 1},
    ),
    "elliptic pipe": (
        lambda t: parts.elliptic_cylinder(thickness=t),
        {"BSplineSurface": 4},
        {"BSplineSurface": 8, "Plane": 8},
    ),
    "elliptic cone": (
        lambda t: parts.elliptic_cone(thickness=t),
        {"BSplineSurface": 4},
        {"BSplineSurface": 16},
    ),
    "elliptic cone, open": (
        lambda t: parts.elliptic_cone(domain=(0.0, 4.0), thickness=t),
        {"BSplineSurface": 3},
        {"BSplineSurface": 4, "Plane": 2},
    ),
    "helix": (
        lambda t: parts.helix_strip(thickness=t),
        {"BSplineSurface": 1},
        {"BSplineSurface": 4, "Plane": 2},
    ),
    "helix, three turns": (
        lambda t: parts.helix_strip(turns=3.0, thickness=t),
        {"BSplineSurface": 1},
        {"BSplineSurface": 4, "Plane": 2},
    ),
    "pyramid": (lambda t: parts.hopper(thickness=t), {"Plane": 4}, {"Plane": 16}),
    "pyramid, open": (
        lambda t: parts.hopper(thickness=t, sides=3, closed=False),
        {"Plane": 3},
        {"Plane": 10, "BSplineSurface": 4},  # end sides: mitred at one end only, so not flat
    ),
    "ring": (lambda t: parts.plate(thickness=t), {"Plane": 2}, {"Plane": 4, "Cylinder": 4}),
    "ring, open": (
        lambda t: parts.plate(sweep=4.0, thickness=t),
        {"Plane": 1},
        {"Plane": 4, "Cylinder": 2},
    ),
    "disc": (
        lambda t: parts.plate((0.0, 80.0), thickness=t),
        {"Plane": 2},
        {"Plane": 4, "Cylinder": 2},
    ),
    "rounded box": (
        lambda t: parts.rounded_box(thickness=t),
        {"Plane": 4, "Cylinder": 4},
        {"Plane": 24, "Cylinder": 8},
    ),
}
SHEETS_ONLY: dict[str, tuple[Make, dict[str, int]]] = {
    "elliptic cone to its apex": (
        lambda t: parts.elliptic_cone(fractions=(0.0, 1.0)),
        {"BSplineSurface": 4},
    ),
    "elliptic sector to its apex": (
        lambda t: parts.elliptic_cone(fractions=(0.0, 1.0), domain=(0.2, 2.0)),
        {"BSplineSurface": 2},
    ),
    "from the regression curve": (
        lambda t: parts.helix_strip(extent=(0.0, 60.0)),
        {"BSplineSurface": 1},
    ),
}
FITTED = {"elliptic pipe", "elliptic cone", "elliptic cone, open", "helix", "helix, three turns"}


def kinds(shape: TopoDS_Shape) -> Counter[str]:
    return Counter(
        str(BRepAdaptor_Surface(TopoDS.Face(f)).GetType()).split("_")[-1]
        for f in walk(shape, TopAbs_FACE)
    )


def exact(name: str, shape: TopoDS_Shape) -> bool:
    """Whether a sheet's file is the surface itself: planes and round faces, or arcs of conics."""
    return "BSplineSurface" not in kinds(shape) or name.startswith("elliptic")


def walk(shape: TopoDS_Shape, kind: object) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def area(shape: TopoDS_Shape) -> float:
    total = 0.0
    for face in walk(shape, TopAbs_FACE):
        found = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, found, 1e-10)
        total += found.Mass()
    return total


def plain_area(shape: TopoDS_Shape) -> float:
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, found)
    return float(found.Mass())


def volume(shape: TopoDS_Shape) -> float:
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found, 1e-9, True, True)
    return float(found.Mass())


def plain_volume(shape: TopoDS_Shape) -> float:
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return float(found.Mass())


def read(path: Path) -> TopoDS_Shape:
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def export(panel: Panel, folder: Path, **keys: object) -> Written:
    (made,) = write(parts.part(panel), folder, Options(**keys))  # type: ignore[arg-type]
    return made


def distance(shape: TopoDS_Shape, point: Array) -> float:
    vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex()
    return float(BRepExtrema_DistShapeShape(vertex, shape).Value())


def normals(shape: TopoDS_Shape) -> list[tuple[Array, Array]]:
    """A point in the middle of every face and the face's own normal there."""
    out = []
    for face in map(TopoDS.Face, walk(shape, TopAbs_FACE)):
        box = BRepTools.UVBounds_s(face)
        point, normal = gp_Pnt(), gp_Vec()
        u, v = 0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3])
        BRepGProp_Face(face).Normal(u, v, point, normal)
        normal.Normalize()
        out.append(
            (
                np.array([point.X(), point.Y(), point.Z()]),
                np.array([normal.X(), normal.Y(), normal.Z()]),
            )
        )
    return out


@pytest.mark.parametrize("name", [*CASES, *SHEETS_ONLY])
def test_a_sheet_is_one_valid_shell_of_the_exact_area(name: str, tmp_path: Path) -> None:
    make, faces = (CASES | SHEETS_ONLY)[name][:2]
    panel = make(0.0)
    made = export(panel, tmp_path)
    shape = read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert len(list(walk(shape, TopAbs_SHELL))) == 1
    assert not list(walk(shape, TopAbs_SOLID))
    assert kinds(shape) == faces
    # mitred: the image of its ellipse on the cylinder is fitted, to 1e-8 mm
    rel = 2e-6 if not exact(name, shape) else 1e-11 if name.startswith("mitred") else 1e-12
    assert area(shape) == pytest.approx(panel.pattern.area, rel=rel)
    assert all(c.passed for c in made.checks)


@pytest.mark.parametrize("name", CASES)
def test_a_solid_is_valid_closed_and_has_area_times_thickness(name: str, tmp_path: Path) -> None:
    make, _, faces = CASES[name]
    panel = make(2.0)
    made = export(panel, tmp_path)
    shape = read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert len(list(walk(shape, TopAbs_SOLID))) == 1
    assert kinds(shape) == faces
    assert ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1) <= 1e-6
    contents = ShapeAnalysis_ShapeContents()
    contents.Perform(shape)
    assert contents.NbFreeEdges() == contents.NbC0Surfaces() == contents.NbOffsetSurf() == 0
    expected = panel.pattern.area * 2.0
    if name.startswith("cone"):  # layers end in apices of their own: T^3/24 integral c^2/|a|
        sine = 100.0 / np.hypot(100.0, 120.0)
        expected += 8.0 / 24.0 * (1.0 - sine**2) / sine * panel.chain.patches[0].domain[1]
    fitted = "BSplineSurface" in faces and name in FITTED
    assert volume(shape) == pytest.approx(expected, rel=1e-6 if fitted else 1e-9)
    # what FreeCAD and most others compute: plain quadrature, no adaptation
    assert plain_volume(shape) == pytest.approx(expected, rel=2e-6 if fitted else 1e-9)
    assert {c.name for c in made.checks} == {"step-deviation", "step-twist", "volume"}
    assert all(c.passed for c in made.checks)


def test_skins_of_a_thick_frustum_are_the_coaxial_cones_at_half_the_thickness(
    tmp_path: Path,
) -> None:
    shape = read(export(parts.frustum(thickness=2.0), tmp_path).path)
    # a cone's area between two rulings' ends grows by sweep * sin * slant per unit of normal shift
    slant, flat = np.hypot(50.0, 120.0), np.pi * 150.0 * np.hypot(50.0, 120.0)
    shift = TURN * 120.0 / slant * slant
    # rims: cones of complementary angle, 2 mm wide, radii about 100 and 50
    rims = TURN * (100.0 + 50.0) * 2.0
    assert area(shape) == pytest.approx((flat + shift) + (flat - shift) + rims, rel=1e-12)


@pytest.mark.parametrize("name", [*CASES, *SHEETS_ONLY])
def test_the_front_of_a_sheet_looks_along_n(name: str, tmp_path: Path) -> None:
    panel = (CASES | SHEETS_ONLY)[name][0](0.0)
    frames = [p.frame(np.linspace(*p.domain, 400)[1:-1]) for p in panel.chain.patches]
    shape = read(export(panel, tmp_path).path)
    rulings = np.concatenate([f.c0 for f in frames]), np.concatenate([f.e for f in frames])
    front = np.concatenate([f.n for f in frames])
    for point, normal in normals(shape):
        arm = point - rulings[0]
        across = arm - np.sum(arm * rulings[1], axis=1)[:, None] * rulings[1]
        near = int(np.argmin(np.linalg.norm(across, axis=1)))
        assert normal @ front[near] > 0.99


@pytest.mark.parametrize("name", [*CASES, *SHEETS_ONLY])
def test_true_points_lie_on_the_file_within_the_stated_deviation(name: str, tmp_path: Path) -> None:
    panel = (CASES | SHEETS_ONLY)[name][0](0.0)
    made = export(panel, tmp_path)
    shape = read(made.path)
    rng = np.random.default_rng(5)
    for patch in panel.chain.patches[:2]:
        t = rng.uniform(*patch.domain, 12)
        frame = patch.frame(t)
        share = np.append(rng.uniform(0.0, 1.0, 10), [0.0, 1.0])
        v = frame.v_from + share * (frame.v_to - frame.v_from)
        for point in patch.point(t, v):
            # the kernel measures distances to about its confusion, 1e-7
            assert distance(shape, point) <= made.max_deviation + 2e-7
    assert made.max_deviation <= 1e-4
    assert (made.max_deviation == 0.0) == exact(name, shape)


def test_a_finer_step_tolerance_gives_a_finer_area(tmp_path: Path) -> None:
    for name in FITTED:
        panel = CASES[name][0](0.0)
        made = export(panel, tmp_path, step_tolerance=1e-5)
        assert made.max_deviation <= 1e-5
        assert area(read(made.path)) == pytest.approx(panel.pattern.area, rel=1e-7)


def test_plain_quadrature_is_right_even_on_long_single_faces(tmp_path: Path) -> None:
    panel = parts.helix_strip(turns=3.0)
    shape = read(export(panel, tmp_path).path)
    assert plain_area(shape) == pytest.approx(area(shape), rel=1e-6)


@pytest.mark.parametrize("scale", [1e-3, 100.0])
@pytest.mark.parametrize("name", ["frustum", "cone", "mitred pipe", "helix", "elliptic cone"])
def test_the_same_holds_from_a_tenth_of_a_millimetre_to_ten_metres(
    name: str, scale: float, tmp_path: Path
) -> None:
    small, thick = CASES[name][0](0.0), CASES[name][0](2.0)
    made = export(parts.scaled(small, scale), tmp_path)
    shape = read(made.path)
    rel = 1e-12 if exact(name, shape) else 2e-6
    assert area(shape) == pytest.approx(small.pattern.area * scale**2, rel=rel)
    made = export(parts.scaled(thick, scale), tmp_path)
    assert BRepCheck_Analyzer(read(made.path), True).IsValid()
    assert all(c.passed for c in made.checks)


@pytest.mark.parametrize("degree", [3, 5])
def test_fitted_faces_have_the_degree_asked_for_and_are_straight_along_rulings(
    degree: int, tmp_path: Path
) -> None:
    made = export(parts.helix_strip(), tmp_path, step_degree=degree, step_tolerance=1e-3)
    for face in walk(read(made.path), TopAbs_FACE):
        spline = BRepAdaptor_Surface(TopoDS.Face(face)).BSpline()
        assert sorted([spline.UDegree(), spline.VDegree()]) == [1, degree]
        assert not spline.IsURational() and not spline.IsVRational()


def test_poles_and_bytes_stay_few(tmp_path: Path) -> None:
    made = export(parts.elliptic_cone(), tmp_path, step_tolerance=1e-4)
    faces = [BRepAdaptor_Surface(TopoDS.Face(f)) for f in walk(read(made.path), TopAbs_FACE)]
    assert sum(f.BSpline().NbVPoles() for f in faces) <= 60
    thick = export(parts.elliptic_cone(thickness=2.0), tmp_path)
    assert thick.path.stat().st_size <= 130_000


def test_edges_of_exact_faces_are_lines_and_circles(tmp_path: Path) -> None:
    shape = read(export(parts.frustum(thickness=2.0, sweep=4.0), tmp_path).path)
    curves = {
        type(BRep_Tool.Curve_s(TopoDS.Edge(e), 0.0, 1.0)).__name__ for e in walk(shape, TopAbs_EDGE)
    }
    assert curves == {"Geom_Line", "Geom_Circle"}


def test_a_thick_general_cone_may_end_in_its_apex(tmp_path: Path) -> None:
    panel = parts.elliptic_cone(fractions=(0.0, 1.0), domain=(0.2, 1.4), rise=-90.0, thickness=2.0)
    made = export(panel, tmp_path)
    shape = read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    frame = panel.chain.patches[0].frame(np.linspace(0.2, 1.4, 20001))
    extra = np.trapezoid(frame.c**2 / np.abs(frame.a), frame.t) * 8.0 / 24.0
    assert volume(shape) == pytest.approx(2.0 * panel.pattern.area + extra, rel=1e-6)


def test_a_moebius_band_is_a_valid_sheet_and_a_twisted_one_fails_its_check(tmp_path: Path) -> None:
    made = export(parts.moebius(), tmp_path)
    shape = read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert kinds(shape) == {"BSplineSurface": 1}
    passed = {c.name: c.passed for c in made.checks}
    assert passed["step-deviation"] and not passed["step-twist"]


def test_planes_with_sharp_creases_meet_in_mitres(tmp_path: Path) -> None:
    shape = read(export(parts.hopper(100.0, 100.0, 80.0, thickness=3.0), tmp_path).path)
    assert volume(shape) == pytest.approx((103.0**2 - 97.0**2) * 80.0, rel=1e-12)


def test_a_thick_crease_beside_a_rolled_patch_is_refused(tmp_path: Path) -> None:
    first = parts.frustum(60.0, 60.0, 80.0, sweep=1.0, thickness=2.0)
    one, shape, _ = parts.quad(
        np.array(
            [
                [60.0 * np.cos(1.0), 60.0 * np.sin(1.0), 0.0],
                [0.0, 150.0, 0.0],
                [0.0, 150.0, 80.0],
                [60.0 * np.cos(1.0), 60.0 * np.sin(1.0), 80.0],
            ]
        )
    )
    chain = replace(
        first.chain, patches=(*first.chain.patches, one), joints=(Joint(0.5, 0.0),), closing=None
    )
    panel = replace(first, chain=chain, shapes=(*first.shapes, shape))
    with pytest.raises(GeometryError, match=r"panel body: .*crease beside a rolled patch"):
        export(panel, tmp_path)


@pytest.mark.slow
def test_equal_input_gives_equal_bytes_in_one_process_and_in_two(tmp_path: Path) -> None:
    both = parts.part(
        replace(parts.helix_strip(thickness=1.0), name="left"),
        replace(parts.frustum(thickness=1.0), name="right"),
    )
    first = write(both, tmp_path, Options())[0].path.read_bytes()
    for _ in range(8):  # the kernel orders colours by addresses, which differ from run to run
        export(parts.hopper(), tmp_path)  # others in between must leave no trace
        assert write(both, tmp_path, Options())[0].path.read_bytes() == first
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import parts; from dataclasses import replace; from pathlib import Path\n"
        "from devcad.export import Options; from devcad.export.step import write\n"
        "a = replace(parts.helix_strip(thickness=1.0), name='left')\n"
        "b = replace(parts.frustum(thickness=1.0), name='right')\n"
        "write(parts.part(a, b), Path(sys.argv[2]), Options())\n"
    )
    other = tmp_path / "other"
    other.mkdir()
    folders = [str(Path(parts.__file__).parent), str(other)]
    environment = os.environ | {"PYTHONHASHSEED": "77"}
    root = Path(parts.__file__).parents[2]
    ran = subprocess.run(
        [sys.executable, "-c", code, *folders],
        env=environment,
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    )
    assert (ran.stdout, ran.stderr) == ("", "")
    assert (other / "job.step").read_bytes() == first


def test_nothing_is_printed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    export(parts.elliptic_cone(thickness=2.0), tmp_path)
    assert capfd.readouterr() == ("", "")


def test_header_and_body_name_one_schema(tmp_path: Path) -> None:
    text = export(parts.frustum(), tmp_path).path.read_text("ascii")
    assert "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'))" in text
    assert "'automotive_design'" in text
    assert re.search(r"FILE_NAME\('job','1970-01-01T00:00:00',\('devcad'\),\('devcad'\)", text)
    assert "'devcad 0" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    text = export(parts.frustum(), tmp_path, step_schema="AP242").path.read_text("ascii")
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF" in text
    assert "'ap242_managed_model_based_3d_engineering'" in text
    text = export(parts.frustum(), tmp_path).path.read_text("ascii")
    assert "AUTOMOTIVE_DESIGN" in text  # the kernel's process-wide setting was put back
    with pytest.raises(JobError, match="no STEP schema 'AP203'"):
        export(parts.frustum(), tmp_path, step_schema="AP203")


def test_source_date_epoch_dates_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    text = export(parts.frustum(), tmp_path).path.read_text("ascii")
    assert "'2023-11-14T22:13:20'" in text


def products(path: Path) -> tuple[list[str], dict[str, list[str]], dict[str, tuple[float, ...]]]:
    """Free shapes, the components of each assembly, and the colours of the simple shapes."""
    document = TDocStd_Document(TCollection_ExtendedString("test"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    assert reader.ReadFile(str(path)) and reader.Transfer(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    free, members, paints = [], {}, {}
    top = TDF_ChildIterator(shapes.Label())
    while top.More():
        label = top.Value()
        name = label_name(label)
        if XCAFDoc_ShapeTool.IsFree_s(label):
            free.append(name)
        if XCAFDoc_ShapeTool.IsAssembly_s(label):
            inner = TDF_ChildIterator(label)
            members[name] = []
            while inner.More():
                members[name].append(label_name(inner.Value()))
                inner.Next()
        paint = Quantity_Color()
        if not XCAFDoc_ShapeTool.IsAssembly_s(label) and colours.GetColor(
            XCAFDoc_ShapeTool.GetShape_s(label), XCAFDoc_ColorSurf, paint
        ):
            paints[name] = (paint.Red(), paint.Green(), paint.Blue())  # linear
        top.Next()
    return free, members, paints


def label_name(label: TDF_Label) -> str:
    name = TDataStd_Name()
    assert label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return str(name.Get().ToExtString())


def test_one_panel_is_the_product_of_the_job_and_several_one_assembly(tmp_path: Path) -> None:
    single = write(parts.part(parts.frustum(thickness=1.0), name="lampshade"), tmp_path, Options())
    free, members, paints = products(single[0].path)
    assert (free, members) == (["lampshade"], {})
    linear = tuple(((x + 0.055) / 1.055) ** 2.4 for x in (0.62, 0.66, 0.70))  # sRGB, IEC 61966
    assert paints["lampshade"] == pytest.approx(linear, abs=1e-6)
    both = parts.part(
        replace(parts.frustum(), name="left"), replace(parts.hopper(), name="right"), name="pair"
    )
    free, members, paints = products(write(both, tmp_path, Options())[0].path)
    assert (free, members) == (["pair"], {"pair": ["left", "right"]})
    assert set(paints) == {"left", "right"}


def test_checks_are_told_for_every_panel(tmp_path: Path) -> None:
    both = parts.part(
        replace(parts.helix_strip(thickness=1.0), name="left"),
        replace(parts.hopper(thickness=1.0), name="right"),
    )
    (made,) = write(both, tmp_path, Options())
    assert Counter(c.panel for c in made.checks) == {"left": 3, "right": 3}
    assert {c.limit for c in made.checks if c.name == "step-deviation"} == {1e-4}


@pytest.mark.parametrize("damage", ["half", "other", "empty"])
def test_a_file_that_does_not_read_back_is_a_failed_check(damage: str, tmp_path: Path) -> None:
    path = export(parts.helix_strip(), tmp_path).path
    text = path.read_text()
    broken = {"half": text[: len(text) // 2], "other": "no STEP file at all", "empty": ""}
    path.write_text(broken[damage])
    with pytest.raises(CheckFailed, match="step-valid"):
        read_step(path)


def test_a_changed_shape_is_a_failed_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = export(parts.frustum(), tmp_path)
    shape = read_step(other.path)
    monkeypatch.setattr(sys.modules[write.__module__], "read_step", lambda path: shape)
    with pytest.raises(CheckFailed, match=r"panel body: step-valid: other faces"):
        export(parts.hopper(), tmp_path)


def test_an_unwritable_folder_is_a_file_error(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"cannot write job\.step") as found:
        export(parts.frustum(), tmp_path / "missing")
    assert isinstance(found.value, DevcadError)


def test_shapes_need_not_be_analytic_to_close(tmp_path: Path) -> None:
    # a cylinder that was not recognised as circular is fitted, and agrees with the exact one
    exact = parts.frustum(60.0, 60.0, 80.0)
    axis = np.array([0.0, 0.0, 1.0])
    fitted = replace(exact, shapes=(Shape("cylinder", axis=axis),))
    shape = read(export(fitted, tmp_path).path)
    assert kinds(shape) == {"BSplineSurface": 4}
    assert area(shape) == pytest.approx(exact.pattern.area, rel=2e-6)
