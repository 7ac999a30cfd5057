"""Stiffnesses and modes: beams, and the published coefficients as numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hinged import grid, strip

from devcad.errors import JobError
from devcad.simulate.freedoms import Supports
from devcad.simulate.material import Material
from devcad.simulate.model import build
from devcad.simulate.modes import modes, node_masses
from devcad.simulate.stiffnesses import COEFFICIENTS, Coefficients, panel_bending
from devcad.simulate.topology import DIAGONAL, KINDS, RULING, Sheet

BAR = Material(youngs=70000.0, poisson=0.0, thickness=1.0)  # nu = 0: a plate strip is a beam
DENSITY = 2700.0
LONG = 100.0


def beam(root: float) -> float:
    """Hz of the mode root^2 sqrt(E I / m) / L^2, Euler and Bernoulli."""
    speed = np.sqrt(BAR.youngs * BAR.thickness**2 / 12 / (DENSITY * 1e-12))
    return float(root**2 * speed / (2 * np.pi * LONG**2))


def test_a_clamped_strip_sounds_like_a_beam() -> None:
    sheet, _, clamped = strip(40, LONG, 5.0)
    model = build(sheet, BAR, held=clamped)
    held = Supports.fixing(np.flatnonzero(clamped))
    got = modes(
        model,
        model.start,
        model.rest(0.0),
        count=2,
        supports=held,
        masses=node_masses(model, DENSITY),
    )
    assert got.frequencies == pytest.approx([beam(1.875104), beam(4.694091)], rel=4e-3)


@pytest.mark.parametrize("cells", [40, 80])  # found all at once, and by inverse iteration
def test_a_free_strip_sounds_like_a_free_beam_without_its_rigid_motions(cells: int) -> None:
    flat, quads, _ = grid(np.linspace(0, LONG, cells + 1), np.array([0.0, 5.0]))
    model = build(Sheet(flat, quads), BAR)
    mass = node_masses(model, DENSITY)
    got = modes(model, model.start, model.rest(0.0), count=1, masses=mass)
    assert got.frequencies == pytest.approx([beam(4.730041)], rel=4e-3)
    assert mass.sum() == pytest.approx(LONG * 5.0 * DENSITY * 1e-12)
    assert mass @ got.shapes[0] == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_twisted_plate_stores_what_plate_theory_says() -> None:
    """w = x y: D (1 - nu) per area, in the diagonals alone, whatever the cells' shape."""
    material = Material(1000.0, 0.3, 0.1)
    for across in (2, 9):
        flat, quads, _ = grid(np.linspace(0, 2, 4), np.linspace(0, 1, across))
        model = build(Sheet(flat, quads), material)
        lifted = np.column_stack([flat, 1e-6 * flat[:, 0] * flat[:, 1]])
        from devcad.simulate.hinges import angles

        turn = angles(lifted, model.hinges)
        stored = 0.5 * model.stiffness * turn**2
        wanted = material.plate * 0.7 * 1e-12 * 2.0
        assert stored[model.kinds == DIAGONAL].sum() == pytest.approx(wanted, rel=1e-6)


def test_the_published_numbers() -> None:
    """Oracle: E = 4000, nu = 0.3, t = 0.1; L_F = 50, L* = 30; D_s = 40, sum(alpha) = pi / 2."""
    material = Material(4000.0, 0.3, 0.1)
    assert material.plate == pytest.approx(0.3663003663003663, rel=1e-12)
    bent = panel_bending(np.array(40.0), np.array(np.pi / 2), material)
    assert float(bent) == pytest.approx(0.9176342194415615, rel=1e-12)
    flat, quads, number = grid(np.array([0.0, 10.0, 30.0]), np.array([0.0, 50.0]))
    crease = Sheet(flat, quads, creases=number[[1]])
    for name, plate in (("exact", material.plate), ("woodruff-filipov", 4.0 / 12)):
        model = build(crease, material, length_scale=30.0, coefficients=name)
        assert model.stiffness[model.creases].sum() == pytest.approx(50 / 30 * plate, rel=1e-12)


def test_ruling_hinges_by_name() -> None:
    """D L^2 / (A1 + A2) = D L / h between cells of mean width h; E t^3 L^2 / (6 (A1 + A2))."""
    material = Material(4000.0, 0.3, 0.1)
    flat, quads, _ = grid(np.array([0.0, 10.0, 30.0]), np.array([0.0, 50.0]))
    ours, hull = (
        build(Sheet(flat, quads), material, coefficients=name)
        for name in ("exact", "woodruff-filipov")
    )
    got = ours.stiffness[ours.kinds == RULING].sum()
    assert got == pytest.approx(material.plate * 50 / 15, rel=1e-12)
    got = hull.stiffness[hull.kinds == RULING].sum()
    assert got == pytest.approx(4000 * 1e-3 * 50**2 / (6 * 750), rel=1e-12)
    assert KINDS[RULING] == "ruling"


def test_names_that_do_not_exist_are_told_with_those_that_do() -> None:
    flat, quads, _ = grid(np.arange(2.0), np.arange(2.0))
    with pytest.raises(JobError, match=", ".join(COEFFICIENTS)):
        build(Sheet(flat, quads), BAR, coefficients="best")
    with pytest.raises(JobError, match="must be one of exact, woodruff-filipov"):
        Coefficients(rulings="best")
    model = build(Sheet(flat, quads), BAR)
    with pytest.raises(JobError, match="the sheet has 6"):
        modes(model, model.start, model.rest(0.0), count=7)
