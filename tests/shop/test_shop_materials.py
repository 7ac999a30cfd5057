"""The material library against physics that its numbers have to obey."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from devcad.errors import JobError
from devcad.shop.materials import load, material

IDS = [
    "dc01",
    "s235jr",
    "304",
    "5052-h32",
    "6061-t6",
    "brass-cuzn37",
    "copper-c110",
    "birch-plywood",
    "veg-tan-leather",
    "paperboard",
]
METALS = IDS[:7]


def test_library_has_the_materials_of_the_shop():
    assert list(load()) == IDS
    assert all(load()[key].id == key for key in IDS)


@pytest.mark.parametrize("key", IDS)
def test_numbers_are_possible(key):
    one = material(key)
    assert 0.0 <= one.k_neutral <= 0.5  # the neutral fibre lies inside the middle
    assert one.bend_ratio >= 0.0
    assert 6e-4 < one.density < 1e-2  # between wood and lead, g/mm3
    assert 0.0 < one.yield_strength < one.youngs_modulus
    assert one.poisson is None or 0.0 < one.poisson < 0.5  # isotropic and stable
    assert one.source and one.title and one.note


@pytest.mark.parametrize("key", METALS)
def test_metals_let_sound_pass_at_the_speed_that_is_measured(key):
    # longitudinal waves in thin rods: 3.4 km/s in brass to 5.2 km/s in steel and aluminium
    one = material(key)
    speed = np.sqrt(one.youngs_modulus * 1e6 / (one.density * 1e6))  # m/s; g/mm3 = 1e6 kg/m3
    assert 3300.0 < speed < 5300.0


@pytest.mark.parametrize(
    ("key", "radius", "ratio"),
    [("dc01", 10, 0.971), ("dc01", 200, 0.456), ("304", 100, 0.649), ("5052-h32", 50, 0.599),
     ("6061-t6", 50, 0.431), ("6061-t6", 100, 0.055)],
)  # fmt: skip
def test_springback_of_a_millimetre_sheet_is_the_tabulated_one(key, radius, ratio):
    # Ri / Rf = 4 X^3 - 3 X + 1 with X = Ri sy / (E T), elastic and perfectly plastic
    one = material(key)
    x = radius * one.yield_strength / one.youngs_modulus
    assert 4 * x**3 - 3 * x + 1 == pytest.approx(ratio, abs=6e-4)  # three digits are tabulated


def test_a_square_metre_of_millimetre_steel_weighs_7850_grams():
    assert material("dc01").mass(1e6, 1.0) == pytest.approx(7850.0, rel=1e-12)
    assert material("6061-t6").smallest_bend(3.2) == pytest.approx(12.8)


def test_only_numbers_with_a_source_are_called_verified():
    assert [key for key in IDS if material(key).verified] == ["6061-t6"]


def test_case_does_not_matter_and_a_material_cannot_be_changed():
    assert material("DC01") is material("dc01")
    with pytest.raises(dataclasses.FrozenInstanceError):
        material("dc01").density = 1.0
    with pytest.raises(TypeError):
        load()["dc01"] = material("304")


def test_colours_tell_metals_from_what_grew():
    """sRGB: steel and aluminium are grey, brass is yellow, copper red, leather and wood brown."""
    colours = {key: material(key).colour for key in IDS}
    assert all(0.0 <= c <= 1.0 for colour in colours.values() for c in colour)
    assert len(set(colours.values())) == len(IDS)
    for key, (red, green, blue) in colours.items():
        if key in ("brass-cuzn37", "copper-c110", *IDS[7:]):
            assert red > green > blue
        else:
            assert max(red, green, blue) - min(red, green, blue) < 0.05
    brass, copper = colours["brass-cuzn37"], colours["copper-c110"]
    assert brass[1] / brass[0] > 0.8 > copper[1] / copper[0]
    assert colours["veg-tan-leather"] == (0xA5 / 255, 0x70 / 255, 0x3F / 255)


def test_unknown_material_is_told_what_exists():
    with pytest.raises(JobError, match='no material "unobtainium"') as failure:
        material("unobtainium")
    assert failure.value.code == 2
    assert failure.value.limit == ", ".join(IDS)
