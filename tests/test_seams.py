"""Seams: closed forms for gaps and lengths, and the union of the meshes as trimesh sees it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import devcad
from devcad.errors import CheckFailed, JobError
from devcad.features import Seam
from devcad.flatten.development import develop_chain
from devcad.geometry.seams import border, largest_gap, match, nearest
from devcad.part import Panel, Part
from devcad.seams import joined

HALF = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "cylinder"
directrix = {{ kind = "circle", radius = 50, start = {start}, sweep = {sweep} }}
direction = [0, 0, 1]
extent = [0, {length}]
"""
HALVES = HALF.format(name="left", start=0, sweep=180, length=80) + HALF.format(
    name="right", start=180, sweep=180, length=80
)
TUBE = """
[[panel]]
name = "tube"
[panel.surface]
kind = "cylinder"
radius = 50
length = 80
cut = 1.0
"""
CONE = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "cone"
apex = [0, 0, {apex}]
extent = [{least}, 1]
[panel.surface.directrix]
kind = "circle"
radius = 50
center = [0, 0, {z}]
start = {start}
sweep = {sweep}
"""
CAN = (
    TUBE
    + CONE.format(name="roof", apex=140, z=80, start=77, sweep=-360, least=0)
    + CONE.format(name="floor", apex=-30, z=0, start=0, sweep=360, least=0)
)
PLANE = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "plane"
width = {width}
height = {height}
[panel.place]
origin = {origin}
z_axis = {z}
x_axis = {x}
"""
TOP = PLANE.format(name="a", width=100, height=60, origin=[0, 0, 0], z=[0, 0, 1], x=[1, 0, 0])
SIDE = PLANE.format(name="b", width=60, height=40, origin=[100, 60, 0], z=[-1, 0, 0], x=[0, -1, 0])


def build(tmp_path: Path, panels: str, seams=(), head: str = "", allow=()) -> Part:
    tables = "".join(f'[[seam]]\nedges = ["{a}", "{b}"]\n' for a, b in seams)
    job = tmp_path / "job.toml"
    job.write_text(f'name = "job"\n{head}\n{panels}\n{tables}')
    return devcad.build(job, allow=allow)


def union(panels: tuple[Panel, ...]) -> trimesh.Trimesh:
    """One mesh of all panels, points merged where they are equal to the bit."""
    start = np.cumsum([0, *(len(p.mesh.vertices) for p in panels)])
    faces = np.concatenate([p.mesh.triangles + k for p, k in zip(panels, start, strict=False)])
    every = np.concatenate([p.mesh.vertices for p in panels])
    points, number = np.unique(every, axis=0, return_inverse=True)
    return trimesh.Trimesh(points, number.ravel()[faces], process=False)


def free_edges(mesh: trimesh.Trimesh) -> int:
    edges = np.sort(mesh.edges, axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] == 1).sum())


def edge(panel: Panel, name: str):
    return border(panel.chain, name, 1e-6)


def test_two_halves_of_a_cylinder_are_a_cylinder(tmp_path: Path) -> None:
    part = build(tmp_path, HALVES, [("left.end", "right.start"), ("right.end", "left.start")])
    for seam in part.seams:
        assert seam.gap < 1e-13 * 50  # rounding
        assert seam.length == pytest.approx((80.0, 80.0), rel=1e-14)
        assert seam.matched and seam.joined
    both = union(part.panels)
    assert both.euler_number == 0 and both.body_count == 1 and both.is_winding_consistent
    loops = both.outline().entities
    assert len(loops) == 2  # the two rims, and no edge along the seams


def test_a_tube_and_two_cones_close_whatever_their_starts_and_directions(tmp_path: Path) -> None:
    part = build(tmp_path, CAN, [("tube.top", "roof.top"), ("floor.top", "tube.base")])
    assert [len(p.rulings[0]) for p in part.panels]
    girth = 2.0 * np.pi * 50.0
    for seam in part.seams:
        assert seam.length == pytest.approx((girth, girth), rel=1e-13)
        assert seam.gap < 1e-11
    can = union(part.panels)
    assert can.is_watertight and can.is_winding_consistent and can.euler_number == 2
    true = np.pi * 50.0**2 * (80.0 + 60.0 / 3.0 + 30.0 / 3.0)
    assert abs(abs(can.volume) - true) < 0.05 * can.area  # tolerance x area


def test_the_joined_mesh_keeps_its_certified_distance(tmp_path: Path) -> None:
    part = build(tmp_path, CAN, [("tube.top", "roof.top"), ("floor.top", "tube.base")])
    tube = part.panels[0].mesh
    assert len(tube.vertices) > len(build(tmp_path, CAN).panels[0].mesh.vertices)
    radius = np.hypot(*tube.vertices[:, :2].T)
    assert np.abs(radius - 50.0).max() < 1e-12  # new points lie on the true edge
    corners = tube.vertices[tube.triangles]
    weights = np.random.default_rng(1).dirichlet(np.ones(3), 200)
    inside = np.einsum("ki,tij->tkj", weights, corners)
    assert np.abs(np.hypot(inside[..., 0], inside[..., 1]) - 50.0).max() <= tube.deviation
    assert tube.deviation <= part.tolerance
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normal, corners.mean(axis=1) * [-1.0, -1.0, 0.0])
    assert inward.min() > 0.0  # none folded over: the front is e x P_t, inside


def test_new_points_have_their_place_in_the_pattern_and_the_normal_there(tmp_path: Path) -> None:
    """A circular edge of a cylinder unrolls to a straight line of the same length."""
    part = build(tmp_path, CAN, [("tube.top", "roof.top")])
    tube = part.panels[0].mesh
    rim = np.abs(tube.vertices[:, 2] - 80.0) < 1e-12
    flat = np.unique(tube.flat[rim].round(9), axis=0)
    assert len(flat) > len(part.panels[0].rulings[0])
    assert np.ptp(flat[:, 0]) < 1e-9 and np.ptp(flat[:, 1]) == pytest.approx(100.0 * np.pi)
    angle = np.arctan2(*tube.vertices[rim, 1::-1].T)
    inwards = -np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert np.abs(tube.normals[rim] - inwards).max() < 1e-12
    unrolled = np.mod(tube.flat[rim, 1] / 50.0 + 1.0, 2.0 * np.pi)  # from the cut on
    apart = np.mod(unrolled - angle + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(apart).max() < 1e-9


def test_two_planes_share_a_line_run_the_other_way(tmp_path: Path) -> None:
    part = build(tmp_path, TOP + SIDE, [("a.top", "b.start")])
    (seam,) = part.seams
    assert seam.gap < 1e-13 and seam.length == pytest.approx((60.0, 60.0)) and seam.joined
    assert free_edges(union(part.panels)) == 6
    first, second = edge(part.panels[0], "top"), edge(part.panels[1], "start")
    assert not match(first, second, 1e-6).forward


@pytest.mark.parametrize("count", [3, 6])
def test_the_gores_of_a_globe_close(tmp_path: Path, count: int) -> None:
    """At each height the cross-section is the regular polygon about the circle, so the volume is
    n tan(pi / n) 4 R^3 / 3."""
    globe = f'[surface]\nkind = "gore"\nradius = 100\ncount = {count}\npanels = "all"\n'
    ring = [(f"{k + 1}.top", f"{(k + 1) % count + 1}.base") for k in range(count)]
    part = build(tmp_path, globe, ring)
    ball = union(part.panels)
    assert ball.is_watertight and ball.euler_number == 2 and ball.is_winding_consistent
    true = count * np.tan(np.pi / count) * 4.0 / 3.0 * 100.0**3
    assert abs(ball.volume - true) < 0.05 * ball.area
    assert max(seam.gap for seam in part.seams) < 1e-11
    written = tmp_path / "out"
    devcad.export(part, written, formats=["stl"])
    read = trimesh.load(written / "job" / "job.stl")  # merges equal points
    assert read.is_watertight and read.euler_number == 2


def test_a_rim_with_corners_meets_itself_from_another_corner(tmp_path: Path) -> None:
    square = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "{kind}"
directrix = {{ kind = "polyline", points = {points}, closed = true }}
{rest}
"""
    corners = [[50, -30, 0], [50, 30, 0], [-50, 30, 0], [-50, -30, 0]]
    duct = square.format(
        name="duct", kind="cylinder", points=corners, rest="direction = [0, 0, 1]\nlength = 40"
    )
    hood = square.format(
        name="hood",
        kind="cone",
        points=corners[2::-1] + corners[3:],
        rest="apex = [0, 0, -90]\nextent = [0.3, 1]",
    )
    part = build(tmp_path, duct + hood, [("duct.base", "hood.top")])
    (seam,) = part.seams
    assert seam.gap < 1e-12 and seam.joined
    assert seam.length == pytest.approx((320.0, 320.0), rel=1e-14)
    both = union(part.panels)
    assert both.body_count == 1 and len(both.outline().entities) == 2  # the two other rims


def test_a_gap_beyond_the_tolerance_is_refused_with_its_value(tmp_path: Path) -> None:
    lower = CONE.format(name="cone", apex=140, z=80.2, start=0, sweep=360, least=0)
    with pytest.raises(
        CheckFailed, match=r"tube\.top and cone\.top are up to 0\.2 mm apart"
    ) as found:
        build(tmp_path, TUBE + lower, [("tube.top", "cone.top")])
    assert found.value.check == "seam"
    assert found.value.value == pytest.approx(0.2, abs=1e-12)
    part = build(tmp_path, TUBE + lower, [("tube.top", "cone.top")], allow=["seam"])
    (seam,) = part.seams
    assert not seam.matched and not seam.joined
    wide = build(tmp_path, TUBE + lower, [("tube.top", "cone.top")], head="tolerance = 0.3")
    assert wide.seams[0].matched and not wide.seams[0].joined


def test_edges_of_unequal_length_do_not_match(tmp_path: Path) -> None:
    """The end that has no partner is as far from the short edge as it is longer."""
    short = SIDE.replace("width = 60", "width = 25")
    part = build(tmp_path, TOP + short, [("a.top", "b.start")], allow=["seam"])
    (seam,) = part.seams
    assert seam.gap == pytest.approx(35.0, rel=1e-12) and not seam.matched
    assert seam.length == pytest.approx((60.0, 25.0))


def test_the_seam_of_a_closed_tube_is_closed_and_a_gap_is_as_wide_as_told(tmp_path: Path) -> None:
    seam = [("tube.start", "tube.end")]
    closed = build(tmp_path, TUBE, seam).seams[0]
    assert closed.gap < 1e-12 and closed.joined
    open_ = build(tmp_path, TUBE + "gap = 0.04\n", seam).seams[0]
    assert open_.gap == pytest.approx(0.04, rel=1e-9) and open_.matched and not open_.joined
    with pytest.raises(CheckFailed, match="seam"):
        build(tmp_path, TUBE + "gap = 0.2\n", seam)


def test_three_sheets_share_one_edge(tmp_path: Path) -> None:
    lower = HALF.format(name="lower", start=180, sweep=-180, length=0).replace(
        "extent = [0, 0]", "extent = [-60, 0]"
    )
    cone = CONE.format(name="cone", apex=40, z=0, start=0, sweep=180, least=0.3)
    upper = HALF.format(name="upper", start=0, sweep=180, length=80)
    part = build(
        tmp_path, upper + lower + cone, [("upper.base", "cone.top"), ("lower.top", "cone.top")]
    )
    fin = union(part.panels)
    edges = np.unique(np.sort(fin.edges, axis=1), axis=0, return_counts=True)
    thrice = edges[0][edges[1] == 3]
    assert np.abs(fin.vertices[np.unique(thrice), 2]).max() < 1e-12
    length = np.linalg.norm(np.diff(fin.vertices[thrice], axis=1), axis=2).sum()
    assert length == pytest.approx(50.0 * np.pi, rel=1e-3)  # all of the half circle, in chords
    assert edges[1].max() == 3


@pytest.mark.parametrize("head", ["thickness = 1.5", "bend = 0.5"])
def test_thick_or_partly_bent_sheets_are_measured_and_left(tmp_path: Path, head: str) -> None:
    pairs = [("left.end", "right.start")]
    part = build(tmp_path, HALVES, pairs, head=head)
    (seam,) = part.seams
    assert seam.matched and not seam.joined and seam.gap < 1e-12
    plain = build(tmp_path, HALVES, head=head)
    for panel, other in zip(part.panels, plain.panels, strict=True):
        assert np.array_equal(panel.mesh.vertices, other.mesh.vertices)


@pytest.mark.parametrize("reference", ["front", "back"])
def test_a_thick_sheet_is_measured_on_the_face_that_the_job_describes(
    tmp_path: Path, reference: str
) -> None:
    """The middles of a tube and a cone on one circle are apart, the faces described are not."""
    pairs = [("tube.top", "roof.top")]
    head = f'thickness = 2\nreference = "{reference}"'
    cone = CONE.format(name="roof", apex=140, z=80, start=0, sweep=360, least=0.2)
    (seam,) = build(tmp_path, TUBE + cone, pairs, head=head).seams
    assert seam.gap < 1e-11
    with pytest.raises(CheckFailed):
        build(tmp_path, TUBE + cone.replace("radius = 50", "radius = 51"), pairs, head=head)


@pytest.mark.parametrize(
    ("first", "second", "match_"),
    [
        (("tub", "top"), ("roof", "top"), "no panel is named 'tub'.*did you mean 'tube'"),
        (("tube", "tops"), ("roof", "top"), "no edge is named 'tops'.*did you mean 'top'"),
        (("tube", "top"), ("tube", "top"), "joined to itself"),
    ],
)
def test_a_seam_names_panels_and_edges_that_there_are(tmp_path, first, second, match_) -> None:
    part = build(tmp_path, CAN)
    chains = [panel.chain for panel in part.panels]
    with pytest.raises(JobError, match=match_):
        joined(
            part.panels,
            chains,
            [develop_chain(chain) for chain in chains],
            [Seam(first, second, "job.toml > seam 1")],
            reference="middle",
            tolerance=0.05,
        )


def test_the_report_tells_every_seam(tmp_path: Path) -> None:
    part = build(tmp_path, HALVES, [("left.end", "right.start")])
    report = devcad.export(part, tmp_path / "out", formats=["stl"])
    (seam,) = report["seams"]
    assert list(seam) == ["edges", "gap", "matched", "joined", "length"]
    assert seam["edges"] == ["left.end", "right.start"] and seam["matched"] is True
    (check,) = [c for c in report["checks"] if c["name"] == "seam"]
    assert check["value"] == seam["gap"] and check["limit"] == 0.05
    assert devcad.export(build(tmp_path, HALVES), tmp_path / "o", formats=["stl"])["seams"] == []


@pytest.fixture(scope="module")
def offset_rims(tmp_path_factory) -> tuple[Panel, Panel]:
    """A tube's rim and a circle about it, 0.013 mm larger and as much higher."""
    cone = CONE.format(name="cone", apex=140, z=80.013, start=40, sweep=-360, least=0)
    folder = tmp_path_factory.mktemp("rims")
    part = build(folder, TUBE + cone.replace("radius = 50", "radius = 50.013"))
    return part.panels[0], part.panels[1]


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.dot(q, q) > 0.1),
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
)
def test_moving_the_whole_leaves_the_gap(offset_rims, quaternion, shift) -> None:
    matrix = trimesh.transformations.quaternion_matrix(quaternion)
    matrix[:3, 3] = shift
    edges = []
    for panel, name in zip(offset_rims, ("top", "top"), strict=True):
        moved = tuple(patch.transformed(matrix) for patch in panel.chain.patches)
        edges.append(border(replace(panel.chain, patches=moved), name, 1e-6))
    gap, point = largest_gap(*edges)
    assert gap == pytest.approx(0.013 * np.sqrt(2.0), abs=1e-11)
    assert min(nearest(each, point[None])[1][0] for each in edges) < 1e-9  # on one of the two


def test_points_keep_their_branch_where_an_edge_crosses_itself(tmp_path: Path) -> None:
    """Two cylinders over one figure of eight: the crossing is two points of the edge."""
    eight = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "cylinder"
directrix = {{ kind = "expression", x = "60*sin(t)", y = "30*sin(2*t)", z = "0", t = {t} }}
direction = [0, 0, {up}]
length = 30
"""
    part = build(
        tmp_path,
        eight.format(name="up", up=1, t='[0.3, "0.3+2*pi"]')
        + eight.format(name="down", up=-1, t='[1, "1+2*pi"]'),
    )
    first, second = (edge(panel, "base") for panel in part.panels)
    run = match(first, second, 1e-6)
    x = second.x[::7]
    place, off = run.carried(x)
    assert off.max() < 1e-9
    apart = np.diff(np.unwrap(first.arc(place), period=first.length))
    steps = np.diff(second.arc(x[:-1]))
    assert np.abs(np.abs(apart[: len(steps)]) - steps).max() < 1e-6
