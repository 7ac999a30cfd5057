"""Sheets folded along curved creases: one pattern, one mesh, and the way from flat to folded."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from devcad import build, export
from devcad.errors import DevcadError, GeometryError, JobError
from devcad.flatten.foldings import creases
from devcad.flatten.green import enclosed_area
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.poses import poses, standing

RHO, ALPHA, PSI = 100.0, np.radians(30.0), np.pi
"""The annulus sector: the crease's radius and angle in the pattern, half its fold angle."""
ANNULUS = """\
name = "fold"
{head}
[surface]
kind = "curved-fold"
flat_crease = {{ kind = "circle", radius = 100, sweep = 180 }}
fold = {fold}
extent = [-20, 20]
{more}
"""
WAVE = """\
name = "fold"
[surface]
kind = "curved-fold"
flat_crease = { kind = "expression", x = "24*sin(t)", y = "60*t", z = "0", t = [-1.2, 1.2] }
fold = "70 + 10*cos(t)"
extent = [-14, 14]
"""


@cache
def folded(text: str) -> Panel:
    """The sheet of a job; built once, as it cannot change."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "fold.toml")
        path.write_text(text)
        (panel,) = build(path).panels
    return panel


def annulus(head: str = "", fold: object = 60, more: str = "") -> Panel:
    return folded(ANNULUS.format(head=head, fold=fold, more=more))


def crease(panel: Panel, count: int = 101) -> Array:
    """Points of the first crease in space, (n, 3)."""
    patch = panel.flanks[0].chain.patches[0]
    t = np.linspace(*patch.domain, count)
    return patch.point(t, 0.0 * t)


def radius(points: Array) -> float:
    """That of the circle through the first, the middle and the last point."""
    a, b, c = points[0], points[len(points) // 2], points[-1]
    sides = [float(np.linalg.norm(x)) for x in (b - a, c - b, a - c)]
    doubled = float(np.linalg.norm(np.cross(b - a, c - a)))
    return sides[0] * sides[1] * sides[2] / (2.0 * doubled)


def test_an_annulus_sector_folds_to_two_cones_on_one_circle() -> None:
    """rho = rho0 cos(alpha), apices at +-rho0 sin(alpha) on the axis (geometry.md, 8)."""
    panel = annulus()
    right, left = (flank.chain.patches[0] for flank in panel.flanks)
    t = np.linspace(right.domain[0], right.domain[1], 40)
    axis = np.array([0.0, 0.0, 1.0])
    for patch in (right, left):
        frame = patch.frame(t)
        apex = frame.c0 - (frame.q / frame.a)[:, None] * frame.e
        assert np.ptp(apex, axis=0).max() < 1e-11
        assert abs(abs((apex[0] - frame.c0[0]) @ axis) - RHO * np.sin(ALPHA)) < 1e-11
    assert radius(crease(panel)) == pytest.approx(RHO * np.cos(ALPHA), rel=1e-13)
    fold = panel.facts["folds"][0]
    assert fold["way"] == "valley"
    assert fold["length"] == pytest.approx(RHO * PSI, rel=1e-13)
    rows = fold["table"]
    assert [row["fold_deg"] for row in rows] == pytest.approx([60.0] * len(rows), rel=1e-12)
    assert [row["left_ruling_deg"] for row in rows] == pytest.approx([90.0] * len(rows), rel=1e-12)
    steps = np.hypot(*(np.array([[r["x"], r["y"]] for r in rows]) - [-RHO, 0.0]).T)
    assert steps == pytest.approx([RHO] * len(rows), rel=1e-13)  # a circle in the pattern


def test_the_report_tells_the_folds_of_a_sheet_that_has_some(tmp_path: Path) -> None:
    path = tmp_path / "fold.toml"
    path.write_text(ANNULUS.format(head="", fold=60, more=""))
    report = export(build(path), tmp_path, formats=["dxf"])
    (fold,) = report["panels"][0]["folds"]
    assert fold["way"] == "valley"
    assert fold["table"][0]["fold_deg"] == pytest.approx(60.0)
    assert {check["name"] for check in report["checks"]} >= {"score", "isometry", "twist"}


def test_the_pattern_of_an_annulus_sector_is_the_sector() -> None:
    panel = annulus()
    area = 0.5 * PSI * (120.0**2 - 80.0**2)
    assert panel.pattern.area == pytest.approx(area, rel=1e-13)
    assert enclosed_area(panel.pattern.outline) == pytest.approx(area, rel=1e-13)
    assert panel.pattern.bbox == pytest.approx((-220.0, 0.0, 20.0, 120.0), abs=1e-11)
    assert [e.name for e in panel.pattern.outline] == [
        "start",
        "start",
        "top",
        "end",
        "end",
        "base",
    ]
    (score,) = (e for e in panel.pattern.drawings if e.name == "SCORE")
    away = score.curve(np.linspace(score.u[0], score.u[-1], 50))[0] - [-RHO, 0.0]
    assert np.hypot(*away.T) == pytest.approx([RHO] * 50, rel=1e-13)


def test_the_mesh_is_one_sheet_that_is_welded_along_its_crease() -> None:
    mesh = annulus().mesh
    points = np.zeros((mesh.weld.max() + 1, 3))
    points[mesh.weld] = mesh.vertices
    assert np.array_equal(points[mesh.weld], mesh.vertices)  # equal numbers, equal bits
    sheet = trimesh.Trimesh(points, mesh.weld[mesh.triangles], process=False)
    assert sheet.euler_number == 1  # a disc
    assert sheet.is_winding_consistent
    assert sheet.body_count == 1
    assert (mesh.normals[:, 2] > 0.5).all()  # the front is up: both sides rise by 30 degrees


def test_negative_folds_are_mountains() -> None:
    valley, mountain = annulus(), annulus(fold=-60)
    assert mountain.facts["folds"][0]["way"] == "mountain"
    assert mountain.pattern.bbox == pytest.approx(valley.pattern.bbox, abs=1e-11)
    mirrored = mountain.mesh.vertices * [1.0, 1.0, -1.0]
    assert mirrored == pytest.approx(valley.mesh.vertices, abs=1e-11)


@pytest.mark.parametrize("bend", [0.0, 0.25, 0.5, 0.9])
def test_partly_folded_the_crease_of_an_annulus_is_a_circle_of_its_own(bend: float) -> None:
    """alpha -> bend alpha, and rho = rho0 cos(bend alpha) all the way from flat."""
    panel = annulus(head=f"bend = {bend}")
    points = crease(panel)
    assert radius(points) == pytest.approx(RHO * np.cos(bend * ALPHA), rel=1e-12)
    assert panel.pattern.area == pytest.approx(0.5 * PSI * (120.0**2 - 80.0**2), rel=1e-13)


@pytest.mark.parametrize("bend", [0.0, 0.3, 0.7, 0.99])
def test_a_crease_stays_closed_on_the_way_where_its_sines_keep_their_proportions(
    bend: float,
) -> None:
    """Also with a fold angle that varies and where the crease turns the other way: both sides are
    folded each by itself, from their own rulings, and meet in one curve."""
    panel = folded(WAVE)
    blanks = [flank.blank for flank in panel.flanks]
    assert all(blanks)
    hangings = [(fold.parent, fold.child, fold.side) for fold in panel.folds]
    chains = standing([b for b in blanks if b], hangings, bend)
    t = np.linspace(-1.2, 1.2, 101)
    (whole,) = creases([flank.chain for flank in panel.flanks], hangings[0])
    (partly,) = creases(chains, hangings[0])
    assert partly.mismatch(t).max() < 1e-11  # of 150 mm, folded through 80 degrees
    sines = np.sin(0.5 * partly.fold_angle(t[1:-1])) / np.sin(0.5 * whole.fold_angle(t[1:-1]))
    assert np.ptp(sines) < 1e-11
    assert np.abs(partly.fold_angle(t)).max() == pytest.approx(bend * np.radians(80), abs=1e-9)


def test_poses_begin_flat_and_end_as_built_with_the_same_triangles() -> None:
    panel = folded(WAVE)
    flat, _, last = poses(panel, [0.0, 0.5, 1.0])
    assert np.array_equal(last.vertices, panel.mesh.vertices)
    assert np.linalg.svd(flat.vertices - flat.vertices.mean(axis=0))[1][2] < 1e-10
    distance = np.linalg.norm(np.diff(flat.vertices[:40], axis=0), axis=1)
    assert distance == pytest.approx(
        np.linalg.norm(np.diff(flat.flat[:40], axis=0), axis=1), abs=1e-11
    )  # flat, it is its pattern


SEVERAL = "left_creases = [-12]\nright_creases = [15]"


def test_several_creases_of_constant_angle_fold_together() -> None:
    """Concentric circles: the second crease has the angle of the first, the other way."""
    panel = annulus(head="bend = 0.5", more=SEVERAL)
    assert [fold["way"] for fold in panel.facts["folds"]] == ["valley", "mountain", "mountain"]
    for fold in panel.facts["folds"]:
        angles = [abs(row["fold_deg"]) for row in fold["table"]]
        assert angles == pytest.approx([60.0] * len(angles), rel=1e-11)
    area = 0.5 * PSI * ((RHO + 35.0) ** 2 - (RHO - 32.0) ** 2)
    assert panel.pattern.area == pytest.approx(area, rel=1e-12)
    assert panel.facts["notes"] == []


def test_several_creases_of_varying_angle_have_no_such_motion_and_say_so() -> None:
    panel = annulus(fold='"60 + 10*sin(t)"', more="right_creases = [12]")
    (note,) = panel.facts["notes"]
    assert note.startswith("no rigid-ruling motion")
    with pytest.raises(GeometryError, match="bend differently"):
        poses(panel, [0.5])
    with pytest.raises(GeometryError, match="bend differently"):
        annulus("bend = 0.5", '"60 + 10*sin(t)"', "right_creases = [12]")


def test_a_thick_sheet_is_two_bodies_apart() -> None:
    """Each is a sector of a cone's layer: net area times thickness; they do not touch."""
    import manifold3d

    panel = annulus(head="thickness = 2")
    groove = panel.facts["figures"]["groove"]
    assert groove == pytest.approx(1.1 * 2.0 * np.tan(ALPHA), rel=1e-12)
    outer = 0.5 * PSI * (120.0**2 - (RHO + 0.5 * groove) ** 2)
    inner = 0.5 * PSI * ((RHO - 0.5 * groove) ** 2 - 80.0**2)
    assert [f.area for f in panel.flanks] == pytest.approx([outer, inner], rel=1e-12)
    assert panel.facts["area"] == pytest.approx(0.5 * PSI * (120.0**2 - 80.0**2), rel=1e-12)
    bodies = []
    for flank in panel.flanks:
        points = np.zeros((flank.mesh.weld.max() + 1, 3))
        points[flank.mesh.weld] = flank.mesh.vertices
        triangles = flank.mesh.weld[flank.mesh.triangles].astype(np.uint32)
        body = manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))
        assert body.volume() == pytest.approx(2.0 * flank.area, rel=1e-3)  # chords
        bodies.append(body)
    assert (bodies[0] ^ bodies[1]).volume() == 0.0
    assert trimesh.Trimesh(panel.mesh.vertices, panel.mesh.triangles, process=True).body_count == 2


def test_a_groove_that_is_too_narrow_is_refused_with_the_width_it_takes() -> None:
    with pytest.raises(GeometryError) as caught:
        annulus(head="thickness = 2", more="groove = 1")
    assert caught.value.limit == pytest.approx(2.0 * np.tan(ALPHA), rel=1e-12)


def test_cutouts_and_marks_belong_to_the_flank_they_lie_on() -> None:
    hole = '[[cutout]]\nshape = "circle"\ndiameter = 6\n'
    mark = '[[mark]]\nshape = "line"\nlength = 5\nangle = 0\nat = [-10, 12]\n'
    more = hole + "at = [10, 10]\n" + hole + "at_surface = [0.5, 0.25]\n" + mark
    panel = annulus(more=more)
    assert [len(flank.cuts) for flank in panel.flanks] == [1, 1]
    area = 0.5 * PSI * (120.0**2 - 80.0**2) - 2.0 * np.pi * 9.0
    assert panel.pattern.area == pytest.approx(area, rel=1e-12)
    assert len(panel.pattern.holes) == 2
    inner, outer = (
        np.hypot(*(edge.curve(edge.u)[0] - [-RHO, 0.0]).T)
        for hole in panel.pattern.holes
        for edge in hole[:1]
    )
    assert np.abs(inner - 90.0).max() <= 3.0 + 1e-9  # the middle of the left flank
    assert np.abs(outer - np.hypot(110.0, 10.0)).max() <= 3.0 + 1e-9
    sheet = trimesh.Trimesh(*_welded(panel), process=False)
    assert sheet.euler_number == -1  # a disc with two holes
    flat, _, last = poses(panel, [0.0, 0.5, 1.0])
    assert last.vertices == pytest.approx(panel.mesh.vertices, abs=1e-11)
    assert np.linalg.svd(flat.vertices - flat.vertices.mean(axis=0))[1][2] < 1e-9


NOTCH = '[[cutout]]\nshape = "circle"\ndiameter = 8\nnotch = true\nat = '


def test_notches_bite_into_the_outline_of_the_whole_sheet() -> None:
    """Half discs out of the first and the last ruling, which are straight: the sheet's area less
    theirs."""
    panel = annulus(more=f"{NOTCH}[10, 0]\n{NOTCH}[-210, 0]")
    assert panel.facts["flat_area"] == pytest.approx(4000 * np.pi - 16 * np.pi, rel=1e-12)
    assert panel.facts["area"] == pytest.approx(4000 * np.pi - 16 * np.pi, rel=1e-12)
    assert [edge.name for edge in panel.pattern.outline] == [
        *("start", "start", "cutout", "start", "top"),
        *("end", "cutout", "end", "end", "base"),
    ]


def test_a_hole_runs_on_over_the_cut_of_a_closed_sheet() -> None:
    """A ring of 80 mm radius, folded by 80 degrees: a sector of 80 / cos(40) mm radius."""
    ring = folded(
        'name = "ring"\n[surface]\nkind = "curved-fold"\nangle = 40\nextent = [-20, 25]\n'
        'crease = { kind = "circle", radius = 80 }\n'
        '[[cutout]]\nshape = "circle"\ndiameter = 5\nat_surface = [0, 0.8]'
    )
    flat, turn = 80 / np.cos(np.radians(40)), 2 * np.pi * np.cos(np.radians(40))
    sector = 0.5 * turn * ((flat + 25) ** 2 - (flat - 20) ** 2)
    assert ring.facts["flat_area"] == pytest.approx(sector - 6.25 * np.pi, rel=1e-12)


def _welded(panel: Panel) -> tuple[Array, NDArray[np.int32]]:
    mesh = panel.mesh
    points = np.zeros((mesh.weld.max() + 1, 3))
    points[mesh.weld] = mesh.vertices
    return points, mesh.weld[mesh.triangles]


@pytest.mark.parametrize(
    ("head", "more", "error", "what"),
    [
        ('thickness = 1\nreference = "front"', "", JobError, "reference"),
        ("", '[recipe.bends]\nmode = "press-brake"\nchord = 1', JobError, "press brake"),
        ("", "[[trim]]\nplane = [[0, 50, 0], [0, 1, 0]]", GeometryError, "trimmed"),
        (
            "",
            '[[cutout]]\nshape = "circle"\ndiameter = 8\nat = [1, 10]',
            GeometryError,
            "cutout 1 runs over a curved crease by 2.506 mm",
        ),
        (
            "",
            '[[mark]]\nshape = "line"\nlength = 20\nat = [-10, 10]',
            GeometryError,
            "mark 1 runs over a curved crease",
        ),
        (
            "",
            '[[cutout]]\nshape = "circle"\ndiameter = 8\nat = [1, 10]\nnotch = true',
            GeometryError,
            "over a curved crease",
        ),
        (
            "thickness = 2",
            '[[cutout]]\nshape = "circle"\ndiameter = 6\nat = [3, 10]',
            GeometryError,
            "groove",
        ),
    ],
)
def test_what_is_not_done_with_curved_creases_is_said(
    head: str, more: str, error: type[DevcadError], what: str
) -> None:
    with pytest.raises(error, match=what):
        annulus(head=head, more=more)
