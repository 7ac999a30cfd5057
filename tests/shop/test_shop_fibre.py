"""The laws of the neutral fibre: DIN 6935's own numbers, tables with corners, and their series."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.geometry import taylor
from devcad.shop.fibre import constant, din6935, fibre, table
from devcad.shop.materials import material
from devcad.shop.settings import Neutral

ROWS = ((0.5, 0.3), (2.0, 0.4), (4.0, 0.45), (10.0, 0.5))


def din_v(opening_deg, radius, thickness):
    """The standard's correction v of the outer lengths, from our K: L = a + b + v."""
    turned = np.radians(180.0 - opening_deg)
    k = float(din6935()(np.array([radius / thickness]))[0])
    allowance = turned * (radius + k * thickness)
    if opening_deg <= 90.0:
        return allowance - 2.0 * (radius + thickness)
    return allowance - 2.0 * (radius + thickness) * np.tan(0.5 * turned)


@pytest.mark.parametrize(
    ("ratio", "k"), [(0.5, 0.250), (1, 0.325), (2, 0.400), (3, 0.444), (5, 0.4997), (50, 0.5)]
)
def test_din_6935_gives_its_k(ratio, k):
    assert din6935()(np.array([ratio]))[0] == pytest.approx(k, abs=6e-4)  # three digits printed


def test_din_6935_gives_its_corrections():
    assert din_v(90.0, 1.0, 1.0) == pytest.approx(-1.919, abs=5e-4)
    assert din_v(135.0, 3.0, 2.0) == pytest.approx(-1.206, abs=5e-4)


def test_din_6935_is_continuous_and_stays_in_the_sheet():
    law = din6935()
    for kink in law.kinks:
        sides = law(kink * np.array([1 - 1e-12, 1 + 1e-12]))
        assert sides[1] - sides[0] == pytest.approx(0.0, abs=1e-11)
    every = law(np.array([0.0, 1e-9, 0.05, 0.1, 4.9, 5.1, 1e6, np.inf]))
    assert (every >= 0.0).all()
    assert (every <= 0.5).all()
    assert every[0] == 0.0
    assert (every[-2:] == 0.5).all()


def test_a_table_is_linear_between_its_rows_and_constant_outside():
    law = table(ROWS)
    at = np.array([0.0, 0.5, 1.25, 2.0, 3.0, 4.0, 7.0, 10.0, 1e3, np.inf])
    expected = [0.3, 0.3, 0.35, 0.4, 0.425, 0.45, 0.475, 0.5, 0.5, 0.5]
    np.testing.assert_allclose(law(at), expected, rtol=1e-14)
    assert law.kinks == (0.5, 2.0, 4.0, 10.0)
    single = table(((1.0, 0.4),))
    np.testing.assert_allclose(single(np.array([0.1, 1.0, 9.0])), 0.4)


@pytest.mark.parametrize("law", [constant(0.4), din6935(), table(ROWS)], ids=["k", "din", "table"])
def test_the_series_of_a_law_is_that_of_its_values(law):
    # along ratio = 2.7 + 0.5 t + 0.1 t^2, against differences of order 2 at a step of 1e-4
    def ratio(t):
        return 2.7 + 0.5 * t + 0.1 * t**2

    step = 1e-4
    below, at, above = law(ratio(np.array([-step, 0.0, step])))
    t = taylor.variable(np.zeros(1), 2)
    series = law.jet(0.5 * t + 0.1 * taylor.mul(t, t) + 2.7 * np.eye(3)[:, :1])
    assert series[0, 0] == at
    assert series[1, 0] == pytest.approx((above - below) / (2 * step), abs=1e-8)
    assert series[2, 0] == pytest.approx((above - 2 * at + below) / (2 * step**2), abs=1e-6)


def test_a_recipe_that_is_silent_has_no_fibre_and_a_surface_none_either():
    assert fibre(None, material("dc01"), 2.0) is None
    assert fibre(Neutral("k", k=0.4, words="k"), None, 0.0) is None


def test_the_source_is_told_with_its_doubt():
    known = fibre(Neutral("material"), material("dc01"), 2.0)
    assert known is not None
    assert known.words == "material dc01, not verified"
    assert known.law(np.array([3.0]))[0] == 0.42
    nothing = fibre(Neutral("material"), None, 2.0)
    assert nothing is not None
    assert nothing.words == "default: the middle surface"
    din = fibre(Neutral("standard", standard="din6935", words="din6935"), None, 2.0)
    assert din is not None
    assert din.law(np.array([1.0]))[0] == pytest.approx(0.325)
