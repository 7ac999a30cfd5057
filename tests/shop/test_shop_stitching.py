"""Stitch holes against closed forms: equal lengths in space, insets on circles, and the proof."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import GeometryError
from devcad.flatten.green import enclosed_area
from devcad.geometry.taylor import Array
from devcad.job.load import load
from devcad.part import Panel, Part
from devcad.pipeline import build
from devcad.shop.polygons import fine_polygon
from devcad.shop.seamlines import face, seam_line
from devcad.shop.settings import EdgeFinish, Stitch
from devcad.shop.stitching import Stitched, pierced, refuse_clashes, stitched
from devcad.shop.stitchproof import outline_feet, prove

SAMPLES = Path(__file__).parents[2] / "samples"
FIT = 1e-9  # mm, on parts of 100 mm: quadratures and Newton's steps to rounding
TEN = EdgeFinish(10.0)

WALL = """
[[panel]]
name = "wall"
[panel.surface]
kind = "cylinder"
direction = [0, 0, 1]
length = 90
[panel.surface.directrix]
kind = "circle"
radius = 40
"""
FLOOR = """
[[panel]]
name = "floor"
[panel.surface]
kind = "cone"
apex = [0, 0, 0]
extent = [0, 1]
[panel.surface.directrix]
kind = "circle"
radius = 40
start = 100
"""
RIM = '[[seam]]\nedges = ["wall.base", "floor.top"]\n'
SIDE = '[[seam]]\nedges = ["wall.start", "wall.end"]\n'
SHADE = """
[surface]
kind = "frustum"
radius = 125
top_radius = 70
height = 150
[[seam]]
edges = ["shade.start", "shade.end"]
"""
SQUARE = "points = [[0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0], [-50, -50, 0]]"
BOX = (
    WALL.replace('"circle"', '"polyline"').replace("radius = 40", f"{SQUARE}\nclosed = true")
    + FLOOR.replace('"circle"', '"polyline"').replace(
        "radius = 40\nstart = 100", f"{SQUARE}\nclosed = true"
    )
    + RIM
)
TOTE = """
[[panel]]
name = "front"
[panel.surface]
kind = "cone"
apex = [0, 0, -1200]
extent = [0.72, 1]
[panel.surface.directrix]
kind = "circle"
radius = 300
center = [0, 240, 0]
start = -53.13010235415598
sweep = -73.73979529168804
[[panel]]
name = "back"
[panel.surface]
kind = "cone"
apex = [0, 0, -1200]
extent = [0.72, 1]
[panel.surface.directrix]
kind = "circle"
radius = 300
center = [0, -240, 0]
start = 126.86989764584402
sweep = -73.73979529168804
[[seam]]
edges = ["front.end", "back.start"]
"""


@cache
def made(text: str, folder: str) -> Part:
    path = Path(folder) / "job.toml"
    path.write_text(text)
    return build(load(path))


@pytest.fixture
def part(tmp_path_factory: pytest.TempPathFactory):  # type: ignore[no-untyped-def]
    folder = str(tmp_path_factory.getbasetemp())
    return lambda text, name="cup": made(f'name = "{name}"\n{text}', folder)


def centres(sewn: Stitched, panel: str) -> Array:
    """The middles of round holes: the mean of two opposite points."""
    rows = [hole[0].curve(np.array([0.0, np.pi]))[0] for hole in sewn.holes[panel]]
    return np.mean(rows, axis=1)


def proven(sewn: Stitched) -> bool:
    return all(check.passed and check.value < FIT for check in sewn.checks)


def corner(panel: Panel, name: str, end: int) -> Array:
    """Where the edges of this name begin (0) or end (-1) in the outline."""
    edge = [edge for edge in panel.pattern.outline if edge.name == name][end]
    return edge.curve(edge.u[[end]])[0][0]


def test_holes_along_a_straight_seam_keep_the_inset_and_meet(part) -> None:  # type: ignore[no-untyped-def]
    """The side seam of two oblique cones is a ruling of both: what meets has the same distance
    from the common apex, which is the point where a pattern's first and last ruling meet."""
    bag = part(TOTE)
    edges = {"front": {"end": TEN}, "back": {"start": TEN}}
    sewn = stitched(bag, edges, Stitch(inset=4.0))  # type: ignore[arg-type]
    assert proven(sewn)
    lengths = []
    for panel, name, way in zip(bag.panels, ("end", "start"), (-1, 1), strict=True):
        low, high = sorted(
            (corner(panel, name, 0), corner(panel, name, -1)), key=lambda p: float(np.hypot(*p))
        )
        along = (high - low) / np.hypot(*(high - low))
        square = np.array([along[1], -along[0]]) * way  # out of the sheet
        away = centres(sewn, panel.name) - low
        assert away @ square == pytest.approx(6.0, abs=FIT)  # in the allowance, 4 from its edge
        lengths.append(np.sort(away @ along))
    assert lengths[0] == pytest.approx(lengths[1], abs=FIT)
    steps = np.diff(lengths[0])
    assert steps == pytest.approx(steps[0], abs=FIT)
    assert abs(steps[0] / 3.85 - 1.0) < 0.08
    figures = sewn.seams[0]
    assert figures["count"] == len(steps) + 1
    assert figures["pitch_mm"] == pytest.approx(steps[0], abs=FIT)


def test_the_first_and_last_hole_keep_the_inset_from_the_rims(part) -> None:  # type: ignore[no-untyped-def]
    """The rims of a frustum's pattern are circles about the apex; the seam's holes lie on a
    parallel of its rulings, the outermost ones on the circles smaller and larger by the inset."""
    shade = part(SHADE, "shade")
    sewn = stitched(shade, {}, Stitch(inset=3.5))
    assert proven(sewn)
    slant = np.hypot(150.0, 55.0)
    large, small = slant * 125.0 / 55.0, slant * 70.0 / 55.0
    panel = shade.panels[0]
    inwards = corner(panel, "start", -1) - corner(panel, "start", 0)
    inwards = inwards / np.hypot(*inwards)
    apex = corner(panel, "start", 0) + large * inwards
    away = np.hypot(*(centres(sewn, "shade") - apex).T)
    assert away.max() == pytest.approx(large - 3.5, abs=FIT)
    # the hole of the inner circle lies beside the ruling, nearer to the rim by the curl
    assert away.min() == pytest.approx(small + 3.5, abs=FIT)
    assert len(away) == 2 * sewn.seams[0]["count"]


def test_a_round_floor_has_its_holes_on_a_circle_over_those_of_the_wall(part) -> None:  # type: ignore[no-untyped-def]
    """Wall: x is the height, y the arc. Floor: a disc that begins at 100 deg. Angles in space
    agree, and the inset curve of a circle is the concentric one."""
    cup = part(WALL + FLOOR + RIM)
    sewn = stitched(cup, {}, Stitch(inset=3.5))
    assert proven(sewn)
    wall, floor = centres(sewn, "wall"), centres(sewn, "floor")
    assert wall[:, 0] == pytest.approx(3.5, abs=FIT)
    assert np.hypot(*floor.T) == pytest.approx(36.5, abs=FIT)
    around = np.mod(np.arctan2(floor[:, 1], floor[:, 0]) + np.radians(100.0), 2.0 * np.pi)
    assert around == pytest.approx(wall[:, 1] / 40.0, abs=1e-11)
    # the wall's cut is not touched, and the disc has none: one pitch all round but there
    assert wall[:, 1].min() == pytest.approx(3.5, abs=FIT)
    assert wall[:, 1].max() == pytest.approx(80.0 * np.pi - 3.5, abs=FIT)
    assert np.ptp(np.diff(wall[:, 1])) < FIT
    (panel,) = [panel for panel in cup.panels if panel.name == "floor"]
    assert {edge.name for edge in panel.pattern.outline} == {"top"}


def test_holes_round_a_loop_with_allowances_are_evenly_spread(part) -> None:  # type: ignore[no-untyped-def]
    """Where the cut's allowance keeps the inset the holes go round at one pitch, half of it
    before and half behind the cut."""
    turned = FLOOR.replace("start = 100", "")
    edges = {"wall": {"start": TEN, "end": TEN}, "floor": {"start": TEN, "end": TEN}}
    sewn = stitched(part(WALL + turned + RIM), edges, Stitch())  # type: ignore[arg-type]
    count = round(80.0 * np.pi / 3.85)
    places = (np.arange(count) + 0.5) * 80.0 * np.pi / count
    assert centres(sewn, "wall")[:, 1] == pytest.approx(places, abs=FIT)


def test_two_discs_are_sewn_evenly_all_round(part) -> None:  # type: ignore[no-untyped-def]
    """A round cushion: neither sheet is cut open, so that every step is the same, once round."""
    lid = FLOOR.replace('"floor"', '"lid"').replace("start = 100", "start = 30")
    seam = '[[seam]]\nedges = ["lid.top", "floor.top"]\n'
    sewn = stitched(part(FLOOR + lid + seam), {}, Stitch())
    assert proven(sewn)
    holes = centres(sewn, "floor")
    count = round(80.0 * np.pi / 3.85)
    chord = 2.0 * 36.5 * np.sin(np.pi / count)
    steps = np.hypot(*(holes - np.roll(holes, 1, axis=0)).T)
    assert steps == pytest.approx(np.full(count, chord), abs=FIT)


def test_a_rim_and_a_disc_with_a_gap_are_no_seam(part) -> None:  # type: ignore[no-untyped-def]
    slit = FLOOR.replace("extent", "gap = 0.05\nextent")
    with pytest.raises(GeometryError, match="goes all round, and the other is open") as caught:
        stitched(part(WALL + slit + RIM), {}, Stitch())
    assert caught.value.remedy == "give both surfaces the same gap, or none"


def test_an_edge_is_sewn_once(part) -> None:  # type: ignore[no-untyped-def]
    again = RIM.replace('"wall.base", "floor.top"', '"floor.top", "wall.base"')
    with pytest.raises(GeometryError, match=r"the edge floor\.top is in seam 1 already") as caught:
        stitched(part(WALL + FLOOR + RIM + again), {}, Stitch())
    assert caught.value.place == "seam 2"


@pytest.mark.parametrize("sweep", [360, -360])
def test_edges_that_run_against_each_other_are_sewn_as_well(part, sweep: int) -> None:  # type: ignore[no-untyped-def]
    turned = FLOOR.replace("start = 100", f"start = 0\nsweep = {sweep}")
    sewn = stitched(part(WALL + turned + RIM), {}, Stitch(pitch=10.0))
    wall, floor = centres(sewn, "wall"), centres(sewn, "floor")
    angle = np.mod(np.sign(sweep) * np.arctan2(floor[:, 1], floor[:, 0]), 2.0 * np.pi)
    assert angle == pytest.approx(wall[:, 1] / 40.0, abs=1e-11)
    assert proven(sewn)


def test_a_corner_has_a_hole_on_its_bisector_and_none_crowds_round_it(part) -> None:  # type: ignore[no-untyped-def]
    """The floor of a box of 100 x 100: the inset line is a square of 93 mm with a hole on each of
    its corners, evenly divided between them; the wall has the mates on its bends."""
    sewn = stitched(part(BOX), {}, Stitch())
    assert proven(sewn)
    floor, wall = centres(sewn, "floor"), centres(sewn, "wall")
    reach = np.abs(floor).max(axis=1)
    assert reach == pytest.approx(46.5, abs=FIT)
    at_corner = np.isclose(np.abs(floor).min(axis=1), 46.5)
    assert at_corner.sum() == 4
    away = np.hypot(*(floor[:, None] - floor[None]).T)
    nearest = np.where(away > 1e-6, away, np.inf).min()
    assert abs(nearest / 3.85 - 1.0) < 0.08
    bends = wall[at_corner, 1]
    assert bends == pytest.approx([50.0, 150.0, 250.0, 350.0], abs=FIT)


def test_where_two_seams_meet_in_a_corner_there_is_one_hole(part) -> None:  # type: ignore[no-untyped-def]
    """The wall's corner at its cut belongs to the seam that the job names first."""
    cup = part(WALL + FLOOR + RIM + SIDE)
    sewn = stitched(cup, {}, Stitch())
    alone = stitched(part(WALL + SIDE), {}, Stitch())
    assert proven(sewn)
    assert sewn.seams[1]["count"] == alone.seams[0]["count"] - 1
    holes = centres(sewn, "wall")
    away = np.hypot(*(holes[:, None] - holes[None]).T) + 1e3 * np.eye(len(holes))
    assert away.min() > 2.0
    for panel in cup.panels:
        refuse_clashes(pierced(panel.pattern, sewn.holes[panel.name]))


@pytest.mark.parametrize("reference", ["front", pytest.param("back", marks=pytest.mark.slow)])
def test_a_thick_sheet_is_sewn_at_equal_lengths_of_the_face_described(part, reference: str) -> None:  # type: ignore[no-untyped-def]
    """A tube of 3 mm whose other fibre keeps its length: the pattern's arcs are those of the
    neutral radius; the pitch is that of the face, whatever the pattern's is."""
    text = f'thickness = 3\nreference = "{reference}"\n[recipe.neutral]\nk = 0.3\n' + WALL
    top = WALL.replace('"wall"', '"cap"').replace("length = 90", "extent = [90, 120]")
    pipe = part(text + top + '[[seam]]\nedges = ["wall.top", "cap.base"]\n')
    sewn = stitched(pipe, {}, Stitch(inset=4.0), reference=reference)
    assert proven(sewn)
    inside = 40.0 if reference == "front" else 37.0  # the front of this tube is its inside
    neutral = inside + 0.3 * 3.0
    y = centres(sewn, "wall")[:, 1]
    assert np.ptp([edge.curve(edge.u)[0][:, 1] for edge in pipe.panels[0].pattern.outline]) == (
        pytest.approx(2.0 * np.pi * neutral, abs=1e-7)
    )
    assert np.diff(y) * 40.0 / neutral == pytest.approx(sewn.seams[0]["pitch_mm"], abs=1e-8)


def test_edges_that_are_a_little_apart_are_sewn_across_the_gap(part) -> None:  # type: ignore[no-untyped-def]
    wide = WALL.replace('"wall"', '"cap"').replace("radius = 40", "radius = 40.03")
    wide = wide.replace("length = 90", "extent = [90, 120]")
    pipe = part(WALL + wide + '[[seam]]\nedges = ["wall.top", "cap.base"]\n')
    sewn = stitched(pipe, {}, Stitch())
    assert proven(sewn)
    assert sewn.seams[0]["largest_gap_mm"] == pytest.approx(0.03, abs=FIT)


def test_a_seam_shorter_than_a_pitch_has_two_holes_or_one_in_its_middle(part) -> None:  # type: ignore[no-untyped-def]
    tube = WALL.replace("length = 90", "length = 10") + SIDE
    two = centres(stitched(part(tube), {}, Stitch(pitch=4.0)), "wall")
    assert np.sort(two[:, 0]) == pytest.approx([3.5, 3.5, 6.5, 6.5], abs=FIT)
    one = stitched(part(tube), {}, Stitch(pitch=7.0))
    assert centres(one, "wall")[:, 0] == pytest.approx(5.0, abs=FIT)
    assert one.seams[0]["pitch_mm"] is None
    with pytest.raises(GeometryError, match="no room for a hole") as caught:
        stitched(part(tube), {}, Stitch(inset=6.0))
    assert caught.value.limit == pytest.approx(12.0)


def test_the_proof_fails_where_a_hole_is_not_in_its_place(part) -> None:  # type: ignore[no-untyped-def]
    """It sees the holes' middles alone: a hole moved along the seam, two that changed places, one
    that is not over the edge."""
    cup = part(WALL + FLOOR + RIM)
    sewn = stitched(cup, {}, Stitch(pitch=10.0))
    panels = {panel.name: panel for panel in cup.panels}
    line = seam_line(
        cup.seams[0], panels, {name: face(panel, "middle") for name, panel in panels.items()}
    )
    wall, floor = centres(sewn, "wall"), centres(sewn, "floor")
    assert prove(line, (wall, floor)).check.passed
    shifted = wall.copy()
    shifted[5, 1] += 2e-5
    check = prove(line, (shifted, floor)).check
    assert not check.passed
    assert check.value == pytest.approx(2e-5, rel=1e-3)
    swapped = floor[[1, 0, *range(2, len(floor))]]
    assert prove(line, (wall, swapped)).check.value > 9.0
    # square to the edge a hole may lie anywhere: its foot stays
    assert prove(line, (wall + np.array([1.0, 0.0]), floor)).check.passed


def test_the_foot_of_a_hole_in_a_corner_is_the_corner(part) -> None:  # type: ignore[no-untyped-def]
    box = part(BOX)
    floor = box.panels[1].pattern
    middles = np.array([[46.5, 46.5], [-46.5, 46.5], [46.5, 20.0]])
    feet, at_corner = outline_feet(floor, "top", middles)
    assert feet == pytest.approx(np.array([[50.0, 50.0], [-50.0, 50.0], [50.0, 20.0]]), abs=FIT)
    assert at_corner.tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("stitch", "area"),
    [
        (Stitch(diameter=1.2), np.pi * 0.36),
        (Stitch(hole="slit", diameter=3.0), 0.3 * 2.7 + np.pi * 0.0225),
    ],
)
def test_the_area_is_without_the_holes(part, stitch: Stitch, area: float) -> None:  # type: ignore[no-untyped-def]
    shade = part(SHADE, "shade")
    sewn = stitched(shade, {}, stitch)
    plain = shade.panels[0].pattern
    holes = sewn.holes["shade"]
    with_holes = pierced(plain, holes)
    assert plain.area - with_holes.area == pytest.approx(area * len(holes), rel=1e-9)
    turns = [enclosed_area(hole) for hole in holes[::10]]
    assert turns == pytest.approx([-area] * len(turns), rel=1e-6)  # clockwise, far away
    assert {edge.name for hole in holes for edge in hole} == {"stitch"}


def test_holes_that_run_into_something_are_refused(part) -> None:  # type: ignore[no-untyped-def]
    cutout = '[[panel.cutout]]\nshape = "circle"\ndiameter = 4\nat = [4, 60]\n'
    tube = part(WALL + cutout + FLOOR + RIM)
    pattern = tube.panels[0].pattern
    holes = stitched(tube, {}, Stitch()).holes["wall"]
    with pytest.raises(GeometryError, match="runs into a cutout"):
        refuse_clashes(pierced(pattern, holes))
    bare = replace(pattern, holes=())
    refuse_clashes(pierced(bare, holes))
    with pytest.raises(GeometryError, match="runs into another stitch hole"):
        refuse_clashes(pierced(bare, (*holes, holes[3])))
    near = stitched(tube, {}, Stitch(inset=0.4)).holes["wall"]
    with pytest.raises(GeometryError, match="runs into the edge that is cut"):
        refuse_clashes(pierced(bare, near))


def test_anchors_of_mates_are_the_same_places(part) -> None:  # type: ignore[no-untyped-def]
    """Every tenth hole, without the first, the last and the corners; in place of the first of
    them two, 3 mm along the rim to either side."""
    single = stitched(part(BOX), {}, Stitch(), every=10, pierced=False).anchors["wall"]
    sewn = stitched(part(BOX), {}, Stitch(), every=10, pair=3.0, pierced=False)
    assert not sewn.holes
    wall, floor = sewn.anchors["wall"], sewn.anchors["floor"]
    assert len(wall) == len(floor) == len(single) + 1 == 10
    places = sorted(a.point[1] for a in wall)
    first, *others = sorted(a.point[1] for a in single)
    assert places == pytest.approx(sorted([first - 3.0, first + 3.0, *others]), abs=FIT)
    on_rim = np.array([a.point[1] for a in wall])  # along the wall's base from its cut
    x, y = np.array([a.point for a in floor]).T
    sides = [
        (x, 50.0, y + 0.0, 0.0),
        (y, 50.0, -x, 100.0),
        (x, -50.0, -y, 200.0),
        (y, -50.0, x, 300.0),
    ]
    around = np.full(len(x), np.nan)
    for on, value, along, start in sides:
        here = np.isclose(on, value)
        around[here] = np.mod(start + along[here], 400.0)
    assert around == pytest.approx(on_rim, abs=FIT)
    assert all(abs(np.hypot(*a.normal) - 1.0) < 1e-12 for a in (*wall, *floor))


def test_two_cuts_nearer_than_the_inset_have_no_hole_between(part) -> None:  # type: ignore[no-untyped-def]
    """The floor is cut open 1 deg, 0.7 mm, behind the wall: both keep 3.5 mm from the holes."""
    turned = FLOOR.replace("start = 100", "start = 1").replace("[0, 0, 0]", "[0, 0, -30]")
    sewn = stitched(part(WALL + turned + RIM), {}, Stitch())
    arc = np.radians(1.0) * 40.0
    y = centres(sewn, "wall")[:, 1]
    beside = 50.0 * np.arcsin(3.5 / 46.5)  # on the cone's floor the inset is square to the slit
    assert y.min() == pytest.approx(arc + beside, abs=FIT)
    assert y.max() == pytest.approx(80.0 * np.pi - 3.5, abs=FIT)
    assert proven(sewn)


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(
    scale=st.sampled_from([1e-3, 1.0, 1e3]),
    turn=st.floats(0.0, 350.0),
    backwards=st.booleans(),
    axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
)
def test_motion_scale_and_direction_do_not_matter(
    tmp_path_factory: pytest.TempPathFactory,
    scale: float,
    turn: float,
    backwards: bool,
    axis: tuple[float, float, float],
) -> None:
    """The same cup anywhere and of any size: as many holes, in proportion the same."""
    place = f"[panel.place]\norigin = [{3 * scale}, 0, {scale}]\nz_axis = {list(axis)}\n"
    floor = FLOOR.replace("start = 100", f"start = {turn}\nsweep = {-360 if backwards else 360}")
    text = f'name = "cup"\ntolerance = {0.05 * scale}\n' + WALL + place + floor + place + RIM
    text = text.replace("radius = 40", f"radius = {40 * scale}")
    path = tmp_path_factory.mktemp("cup") / "job.toml"
    path.write_text(text.replace("length = 90", f"length = {90 * scale}"))
    stitch = Stitch(pitch=3.85 * scale, inset=3.5 * scale, diameter=scale)
    sewn = stitched(build(load(path)), {}, stitch)
    (check,) = sewn.checks
    assert check.passed
    assert check.value < 1e-11 * 100.0 * scale
    floor_holes = centres(sewn, "floor") / scale
    assert np.hypot(*floor_holes.T) == pytest.approx(36.5, abs=FIT)
    assert len(floor_holes) == len(sewn.holes["wall"])


@pytest.mark.slow
def test_a_seam_that_begins_in_the_tip_of_a_fan_keeps_its_insets(tmp_path: Path) -> None:
    """The chine of a boat: rails whose first stretch is a point, 214 holes on curved edges."""
    text = (SAMPLES / "dinghy-plates.toml").read_text()
    text = text.replace("trim = true", "trim = false").replace("thickness = 6", "")
    for name in ("keel", "chine", "sheer"):
        shutil.copy(SAMPLES / f"hull-{name}.csv", tmp_path)
    boat = made(text + '\n[[seam]]\nedges = ["bottom.top", "side.base"]\n', str(tmp_path))
    stitch = Stitch(pitch=20.0, inset=9.0, diameter=3.0)
    sewn = stitched(boat, {}, stitch)
    assert sewn.checks[0].value < 1e-9  # of 4 m: rounding
    for panel in boat.panels:
        pattern = pierced(panel.pattern, sewn.holes[panel.name])
        refuse_clashes(pattern)
        ring = shapely.LinearRing(fine_polygon(pattern.outline, 1e-5)[0])
        away = shapely.distance(ring, shapely.points(centres(sewn, panel.name)))
        assert away.min() > 9.0 - 1e-4
        assert np.median(away) == pytest.approx(9.0, abs=1e-4)
