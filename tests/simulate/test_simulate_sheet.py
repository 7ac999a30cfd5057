"""Folding and loading: strips against beam theory, the folded annulus against its closed form."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from annuli import RADIUS, WIDTH, annulus, radius_of, strip
from jobs import built

from devcad.errors import CheckFailed
from devcad.simulate.material import Material
from devcad.simulate.net import net_of
from devcad.simulate.outcome import Outcome
from devcad.simulate.settings import Load, Simulation, Support, Where
from devcad.simulate.sheet import onto, simulate

ALPHA = math.radians(30.0)
STEEL = Material(youngs=210e3, poisson=1e-9, thickness=0.5)  # no Poisson effect: a beam's
DENSITY = 7.85e-3  # g/mm3
CLAMPED = Support(Where("start", None, "supports[0]"), ("x", "y", "z"), clamp=True)
CELLS, LONG, WIDE = 24, 120.0, 20.0
BENDING = STEEL.youngs * WIDE * STEEL.thickness**3 / 12.0  # E I


def pulled(
    force: tuple[float, float, float],
    steps: int = 4,
    listener: Callable[[str], None] = lambda _: None,
) -> Outcome:
    """The strip clamped at its start, pulled at its end."""
    how = Simulation(
        cells=CELLS,
        across=2,
        load_steps=steps,
        modes=3,
        supports=(CLAMPED,),
        loads=(Load(Where("end", None, "loads[0]"), force),),
    )
    net = net_of(strip(), how)
    return simulate(net, how, STEEL, formed=True, density=DENSITY, listener=listener)


def test_a_clamped_strip_is_as_stiff_as_a_beam_and_sounds_like_one() -> None:
    outcome = pulled((0.0, 0.0, 0.01))
    (load,) = outcome.loads
    stiff = 3.0 * BENDING / LONG**3  # free from the clamped border on
    assert load.stiffness[0] == pytest.approx(stiff, rel=0.01)  # the limit
    assert load.displacement == pytest.approx(0.01 / stiff, rel=0.01)
    inertia = DENSITY * 1e-6 * WIDE * STEEL.thickness  # tonnes/mm
    first = 1.87510407**2 / (2.0 * math.pi * LONG**2) * math.sqrt(BENDING / inertia)
    assert outcome.frequencies[0] == pytest.approx(first, rel=0.01)


def test_what_supports_hold_is_what_loads_pull() -> None:
    """Forces in balance, to what the solver leaves; the moment about the start too, in space."""
    force = (0.1, -0.2, 3.0)  # bends the strip by a quarter of its length
    outcome = pulled(force, steps=8)
    last = outcome.states[-1]
    assert last.positions[:, 2].max() > 0.2 * LONG
    assert outcome.applied == pytest.approx(force, rel=1e-12)
    (held,) = outcome.reactions
    assert held == pytest.approx(np.negative(force), abs=1e-6)
    weights = np.array([0.25, 0.5, 0.25])  # corners bear half of what the middle bears
    end = weights @ last.positions[outcome.net.edges["end"]]
    turned = np.cross(last.positions, last.reactions).sum(axis=0) + last.moments.sum(axis=0)
    assert turned + np.cross(end, force) == pytest.approx(0.0, abs=1e-5 * LONG)
    assert outcome.turning[0] == pytest.approx(turned, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "nu"), [("exact", 0.0), ("exact", -0.3), ("exact-shear", 0.3), ("kept-rulings", 0.45)]
)
def test_a_clamped_plate_bends_to_a_cylinder_from_its_border_on(name: str, nu: float) -> None:
    """3 D W / L^3 of plate theory, the whole sheet's length being L."""
    sheet = Material(youngs=2000.0, poisson=nu, thickness=0.4)
    how = Simulation(
        cells=24,
        across=4,
        load_steps=1,
        modes=0,
        coefficients=name,
        supports=(CLAMPED,),
        loads=(Load(Where("end", None, "loads[0]"), (0.0, 0.0, 1e-6)),),
    )
    outcome = simulate(net_of(strip(), how), how, sheet, formed=True)
    plate = 3.0 * sheet.plate * WIDE / LONG**3
    assert outcome.loads[0].stiffness[0] == pytest.approx(plate, rel=0.001)  # h^2 / (2 L^2)


def test_a_border_clamped_in_one_direction_slides_in_its_plane() -> None:
    """Only what stands square to the plate is held, and the border does not turn: bending as of a
    clamp, and a pull along the plate goes to the one node that is held there."""
    slide = Support(Where("start", None, "supports[0]"), ("z",), clamp=True)
    pin = Support(Where(None, (0.0, 0.0), "supports[1]"), ("x", "y"), clamp=False)
    other = Support(Where(None, (WIDE, 0.0), "supports[2]"), ("y",), clamp=False)
    how = Simulation(
        cells=CELLS,
        across=2,
        load_steps=1,
        modes=0,
        supports=(slide, pin, other),
        loads=(Load(Where("end", None, "loads[0]"), (0.0, 1e-3, 1e-3)),),
    )
    outcome = simulate(net_of(strip(), how), how, STEEL, formed=True)
    rise = outcome.states[-1].positions[outcome.net.edges["end"], 2].mean()
    assert rise == pytest.approx(1e-3 * LONG**3 / (3.0 * BENDING), rel=0.01)
    assert outcome.reactions[0] == pytest.approx([0.0, 0.0, -1e-3], abs=1e-8)
    assert outcome.reactions[1][1] + outcome.reactions[2][1] == pytest.approx(-1e-3, rel=1e-6)
    assert outcome.turning[0][0] == pytest.approx(-1e-3 * LONG, rel=1e-3)  # the clamp's moment


def test_a_sheet_has_no_more_modes_than_it_can_move() -> None:
    every = tuple(
        Support(Where(edge, None, f"supports[{k}]"), ("x", "y", "z"), clamp=False)
        for k, edge in enumerate(("start", "end", "base", "top"))
    )
    how = Simulation(cells=2, across=2, supports=every)
    outcome = simulate(net_of(strip(), how), how, STEEL, formed=True)
    assert len(outcome.modes) == 3  # of the one node inside
    how = Simulation(cells=2, across=1, supports=every)
    assert simulate(net_of(strip(), how), how, STEEL, formed=True).modes == ()


def test_a_rolled_panel_keeps_its_shape_without_loads() -> None:
    """What was formed is free of stress: nothing moves, whatever its supports."""
    how = Simulation(cells=24, across=2, modes=0, supports=(CLAMPED,))
    net = net_of(built("arc").panels[0], how)
    outcome = simulate(net, how, STEEL, formed=True)
    assert len(outcome.states) == 1
    chord = math.radians(200.0) / 24 * 40.0  # lengths are the pattern's, the chords' are shorter
    assert outcome.states[0].furthest == pytest.approx(0.0, abs=chord**2 / 40.0)


def test_the_folded_annulus_has_the_radius_of_its_closed_form_at_16_cells() -> None:
    """rho0 cos(alpha) to 0.1 %; what is left falls with the cells, the sheet being thin."""
    misses = []
    for cells in (8, 16):
        how = Simulation(cells=cells, steps=6, modes=0)
        net = net_of(annulus(ALPHA), how)
        outcome = simulate(net, how, Material(3000.0, 0.3, 0.1), formed=False)
        crease = outcome.states[-1].positions[net.edges["crease"]]
        misses.append(abs(radius_of(crease) / (RADIUS * math.cos(ALPHA)) - 1.0))
        wanted, reached = outcome.angles
        assert reached == pytest.approx(wanted, rel=1e-4)
        assert np.degrees(wanted) == pytest.approx(60.0, rel=0.01)
        # the screw and the curl of free ends: small against the sheet
        assert outcome.states[-1].furthest < 0.01 * WIDTH * 5.0
    assert misses[1] < 1e-3
    assert misses[0] < 2e-3


def test_a_soft_crease_opens_again_and_says_what_moment_it_bears() -> None:
    """Per length a crease bears D (wanted - reached) / L*."""
    paper = Material(3000.0, 0.3, 0.3)
    how = Simulation(cells=12, steps=4, modes=0, length_scale=30.0)
    outcome = simulate(net_of(annulus(ALPHA), how), how, paper, formed=False)
    wanted, reached = outcome.angles
    assert (reached < 0.98 * wanted).all()
    assert outcome.moments == pytest.approx(paper.plate * (wanted - reached) / 30.0, rel=1e-9)


@pytest.mark.parametrize("name", ["exact-shear", "woodruff-filipov", "filipov-2017"])
def test_published_coefficients_fold_the_sheet_too(name: str) -> None:
    how = Simulation(cells=12, across=2, steps=4, modes=2, coefficients=name)
    net = net_of(annulus(ALPHA), how)
    outcome = simulate(net, how, Material(3000.0, 0.3, 0.3), formed=False)
    crease = outcome.states[-1].positions[net.edges["crease"]]
    assert radius_of(crease) == pytest.approx(RADIUS * math.cos(ALPHA), rel=0.01)
    assert outcome.mode_shapes.shape == (2, len(net.flat), 3)


def test_no_equilibrium_is_a_failed_check_that_says_where(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the third step on, more is asked for than rounding allows."""

    def told(reached: str) -> None:
        if reached == "load, step 2 of 4":
            monkeypatch.setattr("devcad.simulate.newton.TOLERANCE", 0.0)
            monkeypatch.setattr("devcad.simulate.newton.ROUNDING", 0.0)
            monkeypatch.setattr("devcad.simulate.relaxation.STEPS", 1)

    with pytest.raises(CheckFailed, match="no equilibrium at step 3 of 4") as error:
        pulled((0.1, -0.2, 3.0), listener=told)
    assert (error.value.code, error.value.check) == (3, "equilibrium")
    assert isinstance(error.value.value, float)
    assert isinstance(error.value.limit, float)
    assert error.value.value > error.value.limit
    assert "load_steps" in error.value.remedy


def test_points_are_laid_onto_their_places_by_the_best_motion() -> None:
    """A motion is found again exactly, and a mirror image is not taken for one."""
    rng = np.random.default_rng(8)
    points = rng.normal(size=(20, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    places = points @ turn.T + [3.0, -1.0, 2.0]
    assert onto(points, places) == pytest.approx(places, abs=1e-12)
    mirrored = onto(points, points * [1.0, 1.0, -1.0])
    triple = [np.linalg.det(x[1:4] - x[0]) for x in (points, mirrored)]
    assert triple[0] == pytest.approx(triple[1])
