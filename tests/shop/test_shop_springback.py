"""Springback against the table of K_s = Ri / Rf and against the formula solved forwards."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.shop.materials import material
from devcad.shop.springback import ELASTIC, kept_share, loaded_radius, stiffness_ratio

LOADED = np.array([10.0, 50.0, 100.0, 200.0])
KEPT = {  # of 1 mm: steel DC01 200 MPa, 304 230 MPa, aluminium 5052-H32, 6061-T6
    (210e3, 200.0): [0.971, 0.858, 0.718, 0.456],
    (193e3, 230.0): [0.964, 0.822, 0.649, 0.339],
    (70.3e3, 193.0): [0.918, 0.599, 0.259, np.nan],
    (68.9e3, 276.0): [0.880, 0.431, 0.055, np.nan],
}


@pytest.mark.parametrize("metal", KEPT)
def test_the_share_that_is_kept_is_the_table_s(metal):
    a = stiffness_ratio(metal[1], metal[0], 1.0)
    x = a * LOADED
    set_ = x <= ELASTIC
    np.testing.assert_allclose(kept_share(x[set_]), np.array(KEPT[metal])[set_], atol=6e-4)
    assert np.array_equal(set_, np.isfinite(KEPT[metal]))  # beyond: it stays elastic


@pytest.mark.parametrize("radius", [0.5, 10.0, 100.0, 1e4, 1e9, np.inf])
@pytest.mark.parametrize("a", [1e-6, 9.5e-4, 4e-3])
def test_the_loaded_radius_springs_back_to_the_part_s(radius, a):
    loaded = loaded_radius(np.array([radius]), a)
    assert loaded[0] <= 0.5 / a * (1 + 1e-12)  # where a sheet begins to yield
    curvature = kept_share(a * loaded) / loaded
    assert curvature[0] == pytest.approx(1.0 / radius, rel=1e-9, abs=1e-12 * a)


def test_no_strength_no_springback():
    np.testing.assert_allclose(loaded_radius(np.array([3.0, 70.0]), 0.0), [3.0, 70.0], rtol=1e-15)


def test_the_library_s_steel_is_the_table_s():
    dc01 = material("dc01")
    a = stiffness_ratio(dc01.yield_strength, dc01.youngs_modulus, 1.0)
    assert kept_share(np.array([50.0 * a]))[0] == pytest.approx(0.858, abs=6e-4)
