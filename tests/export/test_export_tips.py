"""All formats of sheets with tips and with rails that turn, read back by other programs' code."""

import numpy as np
import pytest
import trimesh
from OCP.BOPAlgo import BOPAlgo_ArgumentAnalyzer
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepTools import BRepTools
from OCP.collections import (
    IndexedDataMap_TopoDS_Shape_List_TopoDS_Shape_TopTools_ShapeMapHasher as AncestorMap,
)
from OCP.GeomAbs import GeomAbs_Cone, GeomAbs_Cylinder
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_VERTEX
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS
from patches import cosine_cylinder, frustum, gore, helix_tangent, lens, oloid, sphericon

from devcad.assemble import assemble
from devcad.errors import CheckFailed, GeometryError
from devcad.making import PanelSpec
from devcad.pipeline import build, export

TURNED = np.array(
    [[0.0, -1.0, 0.0, 10.0], [1.0, 0.0, 0.0, 20.0], [0.0, 0.0, 1.0, 30.0], [0, 0, 0, 1]]
)


def part_of(
    *patches,
    thickness=0.0,
    reference="middle",
    bend=1.0,
    place=None,
    unit=1.0,
    gap=0.0,
    cut=None,
):
    spec = PanelSpec("tip", "test", patches, len(patches) > 1, unit, cut, gap, place)
    return assemble(
        "tip", [spec], thickness=thickness, reference=reference, tolerance=0.05, bend=bend
    )


class Read:
    """What the kernel sees in a STEP file: counts of faces, edges, vertices; validity; measures."""

    def __init__(self, path):
        reader = STEPControl_Reader()
        reader.ReadFile(str(path))
        reader.TransferRoots()
        self.shape = reader.OneShape()
        self.uses = self._uses()
        self.faces = self._number(TopAbs_FACE)
        self.vertices = self._number(TopAbs_VERTEX)
        self.edges = len(self.uses)
        self.valid = BRepCheck_Analyzer(self.shape, True).IsValid()
        found = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.shape, found, 1e-7)
        self.area = found.Mass()

    @property
    def boolean(self):
        """Whether the kernel would take it for a boolean operation: a slow check."""
        check = BOPAlgo_ArgumentAnalyzer()
        check.SetShape1(self.shape)
        check.ArgumentTypeMode = True
        check.SelfInterMode = True
        check.SmallEdgeMode = True
        check.Perform()
        return not check.HasFaulty()

    def _map(self, kind):
        found = AncestorMap()
        TopExp.MapShapesAndAncestors_s(self.shape, kind, TopAbs_FACE, found)
        return found

    def _number(self, kind):
        return self._map(kind).Extent()

    def _uses(self):
        """How many faces stand on each edge that has a length."""
        found = self._map(TopAbs_EDGE)
        edges = [TopoDS.Edge(found.FindKey(k)) for k in range(1, found.Extent() + 1)]
        return [
            found.FindFromIndex(k).Size()
            for k, edge in enumerate(edges, start=1)
            if not BRep_Tool.Degenerated_s(edge)
        ]

    def points(self):
        """Points all over the faces' surfaces, (n, 3)."""
        found = self._map(TopAbs_FACE)
        out = []
        for k in range(1, found.Extent() + 1):
            face = TopoDS.Face(found.FindKey(k))
            u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
            surface = BRep_Tool.Surface_s(face)
            for u in np.linspace(u0, u1, 5):
                at = [surface.Value(float(u), float(v)) for v in np.linspace(v0, v1, 41)]
                out += [[p.X(), p.Y(), p.Z()] for p in at]
        return np.array(out)

    def kinds(self):
        found = self._map(TopAbs_FACE)
        faces = (TopoDS.Face(found.FindKey(k)) for k in range(1, found.Extent() + 1))
        return [BRepAdaptor_Surface(face).GetType() for face in faces]


CASES = {
    "gore": (gore(), 1.0),
    "parabola": (cosine_cylinder(), 100.0),
    "cubic": (cosine_cylinder((1, 2, 3), (0.0, 0.5 * np.pi)), 100.0),
    "cylinder": (lens(frustum(80.0, 80.0, 100.0), (3.0, 60.0), (1.0, 40.0)), 1.0),
    "cone": (lens(frustum(), (3.0, 60.0), (1.0, 40.0)), 1.0),
    "tangent": (lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 30.0), (30.0, 15.0)), 1.0),
}


HOWS = {
    "thin": {},
    "thick": {"thickness": 1.0},
    "placed": {"thickness": 2.0, "reference": "front", "place": TURNED},
    "back": {"thickness": 2.0, "reference": "back"},
    "half": {"thickness": 1.0, "bend": 0.5},
    "flat": {"bend": 0.0},
}
PAIRS = [(name, how) for name in CASES for how in ("thin", "thick")]
PAIRS += [(name, how) for name in ("gore", "parabola") for how in list(HOWS)[2:]]


@pytest.mark.parametrize(("name", "how"), PAIRS)
def test_every_format_takes_a_sheet_with_tips(name, how, tmp_path):
    patch, unit = CASES[name]
    report = export(part_of(patch, unit=unit, **HOWS[how]), tmp_path)
    assert all(check["passed"] for check in report["checks"])
    seen = Read(tmp_path / "tip" / "tip.step")
    assert seen.valid
    assert seen.boolean
    thick = "thickness" in HOWS[how]
    # thick: front, back and two walls that meet in a post at each tip; thin: one face of two edges
    assert (seen.faces, seen.edges, seen.vertices) == ((4, 6, 4) if thick else (1, 2, 2))
    assert set(seen.uses) == ({2} if thick else {1})


def test_a_gore_is_a_piece_of_an_exact_cylinder(tmp_path):
    export(part_of(gore()), tmp_path, formats=["step"])
    seen = Read(tmp_path / "tip" / "tip.step")
    assert seen.kinds() == [GeomAbs_Cylinder]
    assert seen.area == pytest.approx(4.0 * 1e4 * np.tan(np.pi / 12.0), rel=1e-8)


def test_the_oloid_is_one_closed_shell_of_four_faces(tmp_path):
    report = export(part_of(*oloid(), unit=100.0), tmp_path)
    checks = {check["name"]: check for check in report["checks"]}
    assert checks["step-twist"]["value"] <= 0.01
    seen = Read(tmp_path / "tip" / "tip.step")
    assert seen.valid
    assert seen.boolean
    # each circle's arc borders the sheet on both sides: it is one edge, and nothing is open
    assert (seen.faces, seen.edges, seen.vertices) == (4, 8, 6)
    assert set(seen.uses) == {2}
    assert seen.area == pytest.approx(4.0 * np.pi * 1e4, rel=1e-7)


def test_the_sphericon_is_one_closed_shell_of_four_cones(tmp_path):
    export(part_of(*sphericon(), unit=100.0), tmp_path)
    seen = Read(tmp_path / "tip" / "tip.step")
    assert seen.valid
    assert seen.boolean
    assert seen.kinds() == [GeomAbs_Cone] * 4
    assert (seen.faces, seen.edges, seen.vertices) == (4, 6, 4)
    assert set(seen.uses) == {2}
    assert seen.area == pytest.approx(2.0 * np.sqrt(2.0) * np.pi * 1e4, rel=1e-9)


@pytest.mark.parametrize(
    ("patches", "how", "faces", "area"),
    [
        # a cut ruling meets its three mirror images: all rails of the oloid run back on another
        pytest.param(oloid(), {"cut": 2.5}, 8, 4 * np.pi, id="oloid"),
        pytest.param(oloid(), {"gap": 5.0}, 7, None, id="oloid-gap"),
        pytest.param(oloid(), {"cut": 0.3, "gap": 0.7}, 11, None, id="oloid-both"),
        pytest.param(sphericon(), {"cut": 2.5}, 6, np.sqrt(8) * np.pi, id="sphericon"),
        pytest.param(sphericon(), {"gap": 5.0}, 5, None, id="sphericon-gap"),
        pytest.param(sphericon(), {"cut": 5.9, "gap": 0.7}, 7, None, id="sphericon-both"),
    ],
)
def test_wherever_they_are_cut_rails_that_run_back_share_their_edges(
    patches, how, faces, area, tmp_path
):
    export(part_of(*patches, unit=100.0, **how), tmp_path, formats=["step"])
    seen = Read(tmp_path / "tip" / "tip.step")
    assert seen.valid  # FreeCAD's boolean check is asked in tests/clients
    assert seen.faces == faces
    # open along the gap: its two rulings and the rails opposite to it
    assert set(seen.uses) == ({2} if area else {1, 2})
    assert seen.uses.count(1) <= 4
    if area:
        assert seen.area == pytest.approx(area * 1e4, rel=1e-7)


@pytest.mark.slow
def test_the_points_of_two_exported_panels_lie_on_the_cubic_cylinder(tmp_path):
    curve = 'kind = "expression", x = "50*cos(t)", y = "50*sin(2*t)", z = "50*cos(3*t)"'
    for number in (1, 5):
        job = tmp_path / f"cubic{number}.toml"
        job.write_text(
            f'name = "c{number}"\ntolerance = 0.05\n[surface]\nkind = "edge-surface"\n'
            f'component = {number}\ncurves = [{{{curve}, t = [0, "2*pi"]}}]\n'
        )
        report = export(build(job), tmp_path)
        assert all(check["passed"] for check in report["checks"])
        where = tmp_path / f"c{number}" / f"c{number}"
        seen = Read(where.with_suffix(".step"))
        assert seen.valid
        assert seen.boolean
        mesh = trimesh.load_mesh(where.with_suffix(".stl"), process=False)
        # float32 moves a point by 6e-8 of 50, a face by the STEP tolerance; the slope is 9 at most
        for points, near in ((mesh.vertices, 3e-5), (seen.points(), 1e-3)):
            x, _, z = points.T / 50.0
            assert np.abs(50.0 * (4 * x**3 - 3 * x - z)).max() <= near


def test_a_branch_that_cannot_be_made_is_named_and_leaves_the_others_alone(tmp_path):
    curve = 'kind = "expression", x = "50*cos(t)", y = "50*sin(2*t)", z = "50*cos(3*t)"'
    job = tmp_path / "all.toml"
    job.write_text(
        'name = "all"\n[surface]\nkind = "edge-surface"\n'
        + f'curves = [{{{curve}, t = [0, "2*pi"]}}]\n'
    )
    with pytest.raises(CheckFailed, match="panel 2: regular: "):
        build(job)


@pytest.mark.slow
@pytest.mark.parametrize("patches", [oloid(), sphericon()], ids=["oloid", "sphericon"])
@pytest.mark.parametrize("how", [{"gap": 5.0}, {"bend": 0.5}, {"bend": 0.0}])
def test_opened_or_partly_bent_they_are_valid_sheets(patches, how, tmp_path):
    report = export(part_of(*patches, unit=100.0, **how), tmp_path)
    assert all(check["passed"] for check in report["checks"])
    assert Read(tmp_path / "tip" / "tip.step").valid


@pytest.mark.parametrize(
    ("patches", "error", "words"),
    [
        (oloid(), CheckFailed, "a skin of the sheet crosses the regression curve"),
        (sphericon(), GeometryError, "an apex in the middle of the sheet"),
    ],
)
def test_with_thickness_they_are_refused_in_one_line(patches, error, words):
    with pytest.raises(error, match=words) as caught:
        part_of(*patches, unit=100.0, thickness=1.0)
    assert "\n" not in str(caught.value)
