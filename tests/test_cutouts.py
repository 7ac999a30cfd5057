"""Cutouts from the job file to the part: what touches the cut of a tube, what leaves nothing."""

import math
from pathlib import Path

import numpy as np
import pytest

import devcad
from devcad.errors import GeometryError

TUBE = 'name = "tube"\n[surface]\nkind = "cylinder"\nradius = 50\nlength = 120\n'
RECTANGLE = '[[cutout]]\nshape = "rectangle"\nwidth = 20\nheight = 20\nat = [60, {}]\n'
CIRCLE = '[[cutout]]\nshape = "circle"\ndiameter = 20\nat = [60, {}]\n'


def built(folder: Path, text: str):
    path = folder / "job.toml"
    path.write_text(text)
    return devcad.build(path)


@pytest.mark.parametrize("y", [10.0, -10.0, 100.0 * math.pi - 10.0, 0.0, 4.0])
def test_a_rectangle_at_the_cut_of_a_tube_opens_the_pattern(tmp_path, y):
    part = built(tmp_path, TUBE + RECTANGLE.format(y))
    pattern = part.panels[0].pattern
    assert pattern.area == pytest.approx(120.0 * 100.0 * math.pi - 400.0, rel=1e-12)
    assert not pattern.holes  # a side on the cut is no line to cut twice
    low, high = pattern.bbox[1], pattern.bbox[3]
    assert (low, high) == pytest.approx((0.0, 100.0 * math.pi), abs=1e-9)


@pytest.mark.parametrize("bend", [1.0, 0.5, 0.0])
def test_a_partly_bent_tube_has_half_a_hole_in_either_end(tmp_path, bend):
    text = f"bend = {bend}\nthickness = 2\n" + TUBE + CIRCLE.format(0.0)
    (panel,) = built(tmp_path, text).panels
    area = 120.0 * 100.0 * math.pi - 100.0 * math.pi
    assert panel.pattern.area == pytest.approx(area, rel=1e-12)
    assert panel.mesh.watertight
    assert [cut.closed for cut in panel.cuts] == ([True] if bend == 1.0 else [False, False])


def test_a_notch_over_the_whole_panel_leaves_nothing(tmp_path):
    plate = 'name = "plate"\n[surface]\nkind = "plane"\nwidth = 100\nheight = 60\n'
    notch = (
        '[[cutout]]\nshape = "rectangle"\nwidth = 100\nheight = 60\nat = [50, 30]\nnotch = true\n'
    )
    with pytest.raises(GeometryError, match="leave nothing"):
        built(tmp_path, plate + notch)


def test_the_same_hole_twice_is_refused_at_once(tmp_path):
    with pytest.raises(GeometryError, match="cutout-crosses-edge: cutout 1 lies in cutout 2"):
        built(tmp_path, TUBE + CIRCLE.format(100.0) + CIRCLE.format(100.0))


def test_a_hole_next_to_a_curved_edge_is_no_overlap(tmp_path):
    cone = (
        'name = "cone"\n[surface]\nkind = "frustum"\nradius = 80\ntop_radius = 40\nheight = 120\n'
    )
    # the base's image is an arc of radius 80 / sin(half angle) about the apex
    slant = math.hypot(120.0, 40.0)
    apex, turn = 80.0 * slant / 40.0, 1.0
    reach = apex - 10.0 - 1e-6
    x, y = apex - reach * math.cos(turn), reach * math.sin(turn)
    hole = f'[[cutout]]\nshape = "circle"\ndiameter = 20\nat = [{x!r}, {y!r}]\n'
    (panel,) = built(tmp_path, cone + hole).panels
    assert len(panel.pattern.holes) == 1


@pytest.mark.slow
@pytest.mark.parametrize("y", [10.0, 10.0 + 1e-9, 10.0 - 1e-9])
def test_the_flat_blank_of_a_hole_that_touches_the_cut_is_a_solid(tmp_path, y):
    part = built(tmp_path, "thickness = 2\n" + TUBE + CIRCLE.format(y))
    report = devcad.export(part, tmp_path / "out", formats=["step-flat", "step"])
    assert all(check["passed"] for check in report["checks"])


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.5 * math.pi, math.pi])
def test_a_drill_through_the_cut_of_a_tube_takes_what_it_takes_elsewhere(tmp_path, turn):
    axis = [[0, 0, 60], [math.cos(turn), math.sin(turn), 0]]
    drill = f'[[cutout]]\nshape = "drill"\naxis = {axis}\ndiameter = 10\n'
    pattern = built(tmp_path, TUBE + drill).panels[0].pattern
    # 4 R times the integral of asin(r cos(a) / R) r cos(a) da over a quarter
    steps = (math.pi / 2) * (2 * np.arange(2000) + 1) / 4000
    hole = (math.pi / 4000) * np.sum(4 * 50 * np.arcsin(np.cos(steps) / 10) * 5 * np.cos(steps))
    assert pattern.area == pytest.approx(120.0 * 100.0 * math.pi - hole, abs=1e-7 * hole)


@pytest.mark.parametrize(
    "surface", [TUBE, TUBE.replace('"cylinder"', '"oloid"').split("length")[0]]
)
def test_a_feature_far_from_the_sheet_is_told_so(tmp_path, surface):
    with pytest.raises(GeometryError, match="leaves the sheet"):
        built(tmp_path, surface + '[[cutout]]\nshape = "circle"\ndiameter = 5\nat = [1000, 50]\n')


@pytest.mark.parametrize("normal", [[0, 1, 2], [-1, 1, -3], [0.3, 0, 1]])
def test_an_oblique_cone_trimmed_aslant_is_exact_in_step(tmp_path, normal):
    """Its edges are conics whose weights differ along a ruling: its images are quotients."""
    cone = 'name = "cone"\n[surface]\nkind = "cone"\napex = [20, 0, 200]\nextent = [0.3, 1]\n'
    cone += 'directrix = { kind = "circle", radius = 100 }\n'
    trim = f"[[trim]]\nplane = [[0, 0, 60], {normal}]\n"
    report = devcad.export(built(tmp_path, cone + trim), tmp_path / "out", formats=["step"])
    assert report["files"][0]["max_deviation"] == 0.0
