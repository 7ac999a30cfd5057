"""The shop's limits on whole parts: radii, strain, springback, flanges and holes, with places."""

from __future__ import annotations

import numpy as np
import pytest

import devcad
from devcad.errors import CheckFailed

CYLINDER = """
[surface]
kind = "cylinder"
radius = {radius}
length = 40
sweep = 120
"""
CHANNEL = """
[surface]
kind = "cylinder"
direction = [0, 0, 1]
extent = [0, 100]
[surface.directrix]
kind = "polyline"
points = [[0, 0, 0], [{first}, 0, 0], [{first}, 40, 0], [{second}, 40, 0]]
"""


def checks(folder, text, **keys):
    job = folder / "job.toml"
    job.write_text(f'name = "job"\n{text}')
    part = devcad.build(job, **keys)
    return {check.name: check for check in part.checks}


def test_without_limits_or_material_there_is_no_check_of_the_shop(tmp_path):
    names = set(checks(tmp_path, "thickness = 2\n" + CYLINDER.format(radius=2.5)))
    assert not names & {"bend-radius", "outer-strain", "springback", "flange", "hole-size"}


@pytest.mark.parametrize("pipeline", ["cad", "sheet-metal"])
def test_the_material_bounds_the_inside_radius_under_every_recipe(tmp_path, pipeline):
    # 304: 2 T; inside 9 = 10 - T / 2
    text = 'thickness = 2\nmaterial = "304"\n' + CYLINDER.format(radius=10)
    check = checks(tmp_path, text, pipeline=pipeline)["bend-radius"]
    assert check.value == pytest.approx(9.0, rel=1e-12)
    assert check.limit == pytest.approx(4.0)
    assert check.where.flat is not None


def test_the_recipe_s_ratio_comes_before_the_material_s(tmp_path):
    text = 'thickness = 2\nmaterial = "304"\n[recipe.limits]\nbend_ratio = 5.0\n'
    with pytest.raises(CheckFailed, match="bend-radius") as caught:
        checks(tmp_path, text + CYLINDER.format(radius=10))
    assert caught.value.value == pytest.approx(9.0)
    assert caught.value.limit == pytest.approx(10.0)


def test_the_outer_fibre_s_strain_is_half_the_thickness_over_the_radius(tmp_path):
    text = "thickness = 2\n[recipe.limits]\nstrain = 0.2\n" + CYLINDER.format(radius=10)
    check = checks(tmp_path, text)["outer-strain"]
    assert check.value == pytest.approx(2 / (2 * 10), rel=1e-12)
    assert check.passed


def test_the_outer_fibre_of_a_shifted_neutral_fibre_is_stretched_more(tmp_path):
    # (1 - K) T / (Ri + K T)
    text = "thickness = 2\n[recipe.limits]\nstrain = 0.1\n[recipe.neutral]\nk = 0.4\n"
    with pytest.raises(CheckFailed, match=r"outer-strain.* 12\.\d+ %") as caught:
        checks(tmp_path, text + CYLINDER.format(radius=10))
    assert caught.value.value == pytest.approx(0.6 * 2 / (9 + 0.4 * 2), rel=1e-12)


def test_a_radius_that_takes_no_set_is_refused(tmp_path):
    # 6061-T6 of 1 mm: elastic above 0.5 E T / sigma = 125 mm
    text = 'thickness = 1\nmaterial = "6061-t6"\n[recipe.bends]\nspringback = true\n'
    passed = checks(tmp_path, text + CYLINDER.format(radius=100))["springback"]
    assert passed.value == pytest.approx(100 * 276 / 68900, rel=1e-12)
    with pytest.raises(CheckFailed, match="cannot be set in one pass") as caught:
        checks(tmp_path, text + CYLINDER.format(radius=200))
    assert caught.value.value == pytest.approx(200 * 276 / 68900, rel=1e-12)
    assert caught.value.limit == 0.5
    quiet = 'thickness = 1\nmaterial = "6061-t6"\n' + CYLINDER.format(radius=200)
    assert "springback" not in checks(tmp_path, quiet)


def test_the_gentle_end_of_a_cone_is_the_one_that_takes_no_set(tmp_path):
    text = 'thickness = 1\nmaterial = "5052-h32"\n[recipe.bends]\nspringback = true\n'
    cone = '[surface]\nkind = "frustum"\nradius = 150\ntop_radius = 50\nheight = 100\n'
    check = checks(tmp_path, text + cone, allow=["springback"])["springback"]
    gentle = 150 * np.sqrt(2.0)  # rho = r / cos of the slope
    assert check.value == pytest.approx(gentle * 193 / 70300, rel=1e-9)
    assert not check.passed  # 212 mm at the wide end, 71 mm at the other


def test_an_inflection_does_not_make_a_wave_unbendable(tmp_path):
    # y = 10 sin(x / 20): infinite radius where it turns, 40 mm where it carries its bending
    text = (
        'thickness = 2\nmaterial = "dc01"\n[recipe.bends]\nspringback = true\n'
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nextent = [0, 50]\n'
        '[surface.directrix]\nkind = "expression"\nt = ["-40*pi", "40*pi"]\n'
        'x = "t"\ny = "10*sin(t/20)"\nz = "0"\n'
    )
    check = checks(tmp_path, text)["springback"]
    assert check.passed
    assert 40 * 200 / (210e3 * 2) < check.value < 0.5


@pytest.mark.parametrize(("first", "short"), [(20, 20.0), (60, 25.0)])
def test_a_flange_is_the_distance_of_the_bend_from_the_sheet_s_end(tmp_path, first, short):
    text = "thickness = 2\n[recipe.limits]\nmin_flange = 4.0\n"
    text += CHANNEL.format(first=first, second=first - 25)
    check = checks(tmp_path, text)["flange"]
    assert check.value == pytest.approx(short, rel=1e-12)
    assert check.limit == pytest.approx(8.0)
    assert check.where.flat is not None


def test_a_flange_that_is_too_short_is_refused_with_its_place(tmp_path):
    text = "thickness = 2\n[recipe.limits]\nmin_flange = 4.0\n"
    with pytest.raises(CheckFailed, match=r"flange: the flange is 7 mm at \(0, 7\) in the pattern"):
        checks(tmp_path, text + CHANNEL.format(first=7, second=-40))


def test_holes_are_held_against_bends_and_thickness(tmp_path):
    # the blank: y from 0, bends at y = 60 and 100; x along the channel. A slot of 12 x 5 whose
    # edge is 60 - 48.5 - 2.5 = 9 mm from the bend, a circle of 6
    text = (
        "thickness = 2\n[recipe.limits]\nhole_to_bend = 2.0\nhole_to_thickness = 1.0\n"
        '[[cutout]]\nshape = "slot"\nlength = 12\nwidth = 5\nangle = 0\nat = [30, 48.5]\n'
        '[[cutout]]\nshape = "circle"\ndiameter = 6\nat = [70, 30]\n'
    )
    found = checks(tmp_path, text + CHANNEL.format(first=60, second=0))
    assert found["hole-near-bend"].value == pytest.approx(9.0, rel=1e-9)
    assert found["hole-near-bend"].where.flat[1] == pytest.approx(51.0, rel=1e-9)
    assert found["hole-size"].value == pytest.approx(5.0, rel=1e-9)
    assert found["hole-size"].limit == pytest.approx(2.0)
    assert found["hole-size"].where.t is not None


@pytest.mark.parametrize("angle", [0, 17, 45.7, 90])
@pytest.mark.parametrize("shape", ["slot", "rectangle", "polygon"])
def test_the_width_of_a_hole_is_that_of_its_narrowest_box(tmp_path, shape, angle):
    sizes = {
        "slot": "length = 20\nwidth = 3",
        "rectangle": "width = 20\nheight = 3\ncorner_radius = 0.5",
        "polygon": "points = [[0, 0], [20, 0], [23, 3], [3, 3]]",  # a slanted strip
    }[shape]
    text = (
        "thickness = 4\n[recipe.limits]\nhole_to_thickness = 0.5\n"
        f'[[cutout]]\nshape = "{shape}"\n{sizes}\nangle = {angle}\nat = [60, 60]\n'
        '[surface]\nkind = "plane"\nwidth = 150\nheight = 150\n'
    )
    check = checks(tmp_path, text)["hole-size"]
    assert check.value == pytest.approx(3.0, rel=1e-6)
    assert check.limit == pytest.approx(2.0)


def test_a_hole_as_wide_as_its_limit_is_wide_enough(tmp_path):
    text = (
        "thickness = 3\n[recipe.limits]\nhole_to_thickness = 1.0\n"
        '[[cutout]]\nshape = "circle"\ndiameter = 3\nat = [20, 20]\n'
    )
    found = checks(tmp_path, text + CYLINDER.format(radius=30))
    assert found["hole-size"].value == pytest.approx(3.0, rel=1e-12)
    assert found["hole-size"].passed
