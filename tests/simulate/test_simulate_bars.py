"""A flat sheet of bars against plane stress."""

from __future__ import annotations

import numpy as np
import pytest
from hinged import PAPER, grid
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array
from devcad.simulate.bars import crossed, natural, panel_areas
from devcad.simulate.material import Material
from devcad.simulate.model import build
from devcad.simulate.modes import tangent
from devcad.simulate.stiffnesses import crease_folding, panel_bending
from devcad.simulate.topology import Sheet

EXACT = 1e-12  # relative: sums of some hundred products


def stored(sheet: Sheet, material: Material, strain: Array, coefficients: str = "exact") -> float:
    """Twice the energy of a uniform plane strain (xx, yy, engineering shear), to second order."""
    model = build(sheet, material, coefficients=coefficients)
    xx, yy, shear = strain
    moved = model.flat @ np.array([[xx, shear / 2], [shear / 2, yy]])
    u = np.column_stack([moved, np.zeros(len(moved))]).reshape(-1)
    return float(u @ tangent(model, model.start, model.rest(0.0)) @ u)


def exact(area: float, material: Material, strain: Array) -> float:
    """The same of plane stress, Hooke's law written out."""
    xx, yy, shear = strain
    e, nu, t = material.youngs, material.poisson, material.thickness
    normal = e / (1 - nu**2) * (xx**2 + yy**2 + 2 * nu * xx * yy)
    return area * t * (normal + e / (2 * (1 + nu)) * shear**2)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-0.5, 0.5),
    st.floats(0.1, 20.0),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda e: np.linalg.norm(e) > 0.1),
)
def test_a_rectangle_has_the_stiffness_of_plane_stress_for_any_nu(
    nu: float, long: float, strain: tuple[float, float, float]
) -> None:
    material = Material(1000.0, nu, 0.1)
    flat, quads, _ = grid(np.linspace(0, long, 4), np.array([0.0, 0.3, 0.4, 1.0]))
    got = stored(Sheet(flat, quads), material, np.array(strain))
    assert got == pytest.approx(exact(long, material, np.array(strain)), rel=EXACT)


def test_any_cells_have_the_stiffness_of_plane_stress() -> None:
    """The patch test: a distorted mesh, a triangle among its cells."""
    flat, quads, number = grid(np.arange(4.0), np.arange(4.0))
    flat = flat + 0.2 * np.sin(7 * np.arange(32.0)).reshape(16, 2)
    flat[[0, 3, 12, 15]] = [[0, 0], [0, 3], [3, 0], [3, 3]]
    tip = np.array([[number[3, 0], 16, number[3, 1]]])
    flat = np.append(flat, [[4.5, 0.3]], axis=0)
    ring = [*number[:, 0], 16, *number[3, 1:], *number[2::-1, 3], *number[0, 2:0:-1]]
    x, y = flat[ring].T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    strain = np.array([0.3, -0.7, 0.9])
    got = stored(Sheet(flat, quads, tip), PAPER, strain)
    assert got == pytest.approx(exact(area, PAPER, strain), rel=EXACT)


@pytest.mark.parametrize("h", [0.2, 1.0, 3.0])
def test_the_diagonal_of_the_natural_triangle_is_the_exact_shear_coefficient(h: float) -> None:
    """c = (H/W + W/H)^2 / (2 (1 + nu)) of geometry.md, 8, W = 1."""
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, h]])
    form = natural(flat, np.array([[0, 1, 2]]), PAPER)[0]
    c = (h + 1 / h) ** 2 / (2 * (1 + PAPER.poisson))
    assert form[1, 1] == pytest.approx(PAPER.youngs * PAPER.thickness * h / 2 * c, rel=EXACT)


@pytest.mark.parametrize("nu", [0.2, 1 / 3, 0.45])
def test_crossed_panels_are_exact_along_their_sides_and_soft_or_stiff_in_shear(nu: float) -> None:
    """Filipov 2017: shear is 2 nu / (1 - nu) of plane stress, right for nu = 1/3 only."""
    material = Material(1000.0, nu, 0.1)
    flat, quads, _ = grid(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.9, 1.8]))
    for strain, ratio in (
        ([1.0, 0.0, 0.0], 1.0),
        ([0.4, -0.7, 0.0], 1.0),
        ([0.0, 0.0, 1.0], 2 * nu / (1 - nu)),
    ):
        got = stored(Sheet(flat, quads), material, np.array(strain), "filipov-2017")
        assert got == pytest.approx(ratio * exact(3.6, material, np.array(strain)), rel=EXACT)


def test_the_exact_shear_diagonal_alone_is_exact_in_shear() -> None:
    flat, quads, _ = grid(np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.4, 0.8]))
    strain = np.array([0.0, 0.0, 1.0])
    got = stored(Sheet(flat, quads), PAPER, strain, "exact-shear")
    assert got == pytest.approx(exact(1.6, PAPER, strain), rel=EXACT)


def test_the_areas_of_a_crossed_panel_are_the_published_ones_below_zero_too() -> None:
    """O31: 20 x 10, nu = 1/3, t = 0.5; a model of such panels is refused, the formula is not."""
    got = panel_areas(np.array(20.0), np.array(10.0), Material(1.0, 1 / 3, 0.5))
    assert np.array(got) == pytest.approx([-0.9375, 5.15625, 5.2407843222651325], rel=EXACT)


def test_the_stiffness_of_creases_and_panels_is_the_published_one() -> None:
    """O32: E = 4000, nu = 0.3, t = 0.1; L_F = 50, L* = 30, D_s = 40, sum(alpha) = pi / 2."""
    assert PAPER.plate == pytest.approx(0.3663003663003663, rel=EXACT)
    fold = crease_folding(np.array(50.0), np.array(30.0), PAPER)
    assert fold == pytest.approx(0.6105006105006106, rel=EXACT)
    bend = panel_bending(np.array(40.0), np.array(np.pi / 2), PAPER)
    assert bend == pytest.approx(0.9176342194415615, rel=EXACT)


def test_long_crossed_panels_are_refused_and_not_clipped() -> None:
    flat, quads, _ = grid(np.array([0.0, 2.0]), np.array([0.0, 1.0]))
    with pytest.raises(GeometryError, match="not positive"):
        crossed(flat, quads, PAPER)
