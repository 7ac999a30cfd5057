"""Loads and supports: beams, buckling, snapping, and what the solver says when it cannot."""

from __future__ import annotations

import numpy as np
import pytest
from hinged import PAPER, annulus, grid, strip, truss

from devcad.errors import GeometryError, JobError
from devcad.simulate import newton, relaxation
from devcad.simulate.arclength import trace
from devcad.simulate.freedoms import Supports, laid_on
from devcad.simulate.model import build
from devcad.simulate.modes import stiffness
from devcad.simulate.path import ConvergenceError, Stage, fold
from devcad.simulate.topology import Sheet

LONG, WIDE = 10.0, 2.0


def cantilever(cells: int, across: int = 1) -> float:
    """Error of the stiffness 3 D W / L^3 of a clamped strip."""
    sheet, number, clamped = strip(cells, LONG, WIDE, across)
    model = build(sheet, PAPER, held=clamped)
    loads = np.zeros((len(sheet.flat), 3))
    share = np.ones(across + 1)
    share[[0, -1]] = 0.5
    loads[number[-1], 2] = share / across
    held = Supports.fixing(np.flatnonzero(clamped))
    got = stiffness(model, model.start, model.rest(0.0), loads, supports=held)
    return got / (3 * PAPER.plate * WIDE / LONG**3) - 1


@pytest.mark.parametrize("across", [1, 3])
def test_a_clamped_strip_bends_like_a_plate_to_a_cylinder(across: int) -> None:
    errors = [abs(cantilever(n, across)) for n in (8, 16, 32)]
    assert errors[0] < 0.01  # the limit
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2, 2], abs=0.02)


@pytest.mark.parametrize(
    ("pull", "rise", "way"), [(1.0, 0.30172, 0.05643), (10.0, 0.81061, 0.55500)]
)
def test_a_strip_bends_to_the_elastica(pull: float, rise: float, way: float) -> None:
    """P L^2 / (E I) of 1 and 10: Bisshopp and Drucker (1945), elliptic integrals."""
    sheet, number, clamped = strip(48, LONG, WIDE)
    model = build(sheet, PAPER, held=clamped)
    loads = np.zeros((len(sheet.flat), 3))
    loads[number[-1], 2] = pull * PAPER.plate / LONG**2  # on each of two nodes; D W = 2 D
    run = fold(model, (Stage(4, loads=loads),), supports=Supports.fixing(np.flatnonzero(clamped)))
    last = run.steps[-1]
    tip = last.positions[number[-1]].mean(axis=0)
    assert tip[2] / LONG == pytest.approx(rise, abs=3e-4)  # h^2 of 48 cells
    assert 1 - tip[0] / LONG == pytest.approx(way, abs=3e-4)
    assert last.reactions.sum(axis=0) == pytest.approx(-loads.sum(axis=0), abs=1e-9)


def test_a_pinned_strip_buckles_from_flat_at_eulers_load() -> None:
    flat, quads, number = grid(np.linspace(0, LONG, 33), np.array([0.0, 1.0]))
    model = build(Sheet(flat, quads), PAPER)
    first, last = number[0], number[-1]
    nodes = np.array([*first, *first, first[0], *last, *last])
    axes = np.array([0, 0, 2, 2, 1, 0, 0, 2, 2])
    pushed = np.where((axes == 0) & (nodes >= last[0]), -0.02, 0.0)
    run = fold(model, (Stage(4),), supports=Supports(nodes, axes, pushed))
    end = run.steps[-1]
    euler = np.pi**2 * PAPER.plate / LONG**2
    rise = end.positions[:, 2].max()
    assert end.stable and end.method in ("newton", "relaxation")
    # 1 + (pi w / L)^2 / 8: the first term of the elastica; 32 cells: pi^2 / (12 32^2)
    post = 1 + (np.pi * rise / LONG) ** 2 / 8
    assert -end.reactions[last, 0].sum() == pytest.approx(euler * post, rel=2e-3)
    short = 0.02 - euler * LONG / (PAPER.youngs * PAPER.thickness)  # the rest is compression
    assert rise == pytest.approx(2 / np.pi * np.sqrt(short * LONG), rel=2e-3)


def test_arc_length_follows_a_truss_past_its_limit_points() -> None:
    """Von Mises: P = 2 E A z (h^2 - z^2) / (2 L^3), Green strains."""
    rise, stiff = 0.2, 100.0
    model, start = truss(rise, stiff)
    loads = np.array([[0.0, 0, 0], [0.0, 0, -1.0], [0.0, 0, 0]])
    held = Supports(
        np.array([0, 0, 0, 2, 2, 2, 1, 1]), np.array([0, 1, 2, 0, 1, 2, 0, 1]), np.zeros(8)
    )
    run = trace(
        model, Stage(90, loads=loads), length=0.005, supports=held, start=start, farthest=0.4
    )
    z = np.array([step.positions[1, 2] for step in run.steps])
    force = np.array([step.fraction for step in run.steps])
    exact = stiff * z * (rise**2 - z**2) / np.hypot(1.0, rise) ** 3
    assert force == pytest.approx(exact, abs=1e-9)
    assert z.min() < -rise  # through both limit points
    stable = np.array([step.stable for step in run.steps])
    steep = np.abs(z) > rise / np.sqrt(3)
    assert np.array_equal(stable[1:-1], steep[1:-1]) or np.sum(stable != steep) <= 2


def test_the_traced_path_and_the_steps_of_folding_meet() -> None:
    """The same fold angle, reached along the arc and in increments: one equilibrium."""
    sheet, _ = annulus(8)
    model = build(sheet, PAPER, length_scale=0.02)
    path = trace(model, Stage(60, rest=model.rest(1.0)), length=0.02, farthest=0.8)
    end = path.steps[-1]
    folded = fold(model, (Stage(5, rest=model.rest(end.fraction)),)).steps[-1]
    assert end.fraction > 0.8 and end.stable
    assert laid_on(end.positions, folded.positions) == pytest.approx(folded.positions, abs=1e-7)


def test_a_dead_load_beyond_the_limit_snaps_through() -> None:
    rise, stiff = 0.2, 100.0
    model, start = truss(rise, stiff)
    peak = stiff * 2 / (3 * np.sqrt(3)) * rise**3 / np.hypot(1.0, rise) ** 3
    loads = np.array([[0.0, 0, 0], [0.0, 0, -1.2 * peak], [0.0, 0, 0]])
    held = Supports(
        np.array([0, 0, 0, 2, 2, 2, 1, 1]), np.array([0, 1, 2, 0, 1, 2, 0, 1]), np.zeros(8)
    )
    run = fold(model, (Stage(6, loads=loads),), supports=held, start=start)
    methods = [step.method for step in run.steps]
    assert methods[:6] == ["newton"] * 6  # 1.0 of the peak is the limit point, reached from below
    z = run.steps[-1].positions[1, 2]
    assert z < -rise
    assert stiff * z * (rise**2 - z**2) / np.hypot(1.0, rise) ** 3 == pytest.approx(1.2 * peak)


def test_loads_taken_off_leave_the_folded_sheet_as_it_was() -> None:
    sheet, crease = annulus(12, radius=100.0, wide=20.0, across=2)
    model = build(sheet, PAPER, length_scale=30.0)
    along = np.arctan2(sheet.flat[:, 1], sheet.flat[:, 0])
    held = Supports.fixing(np.flatnonzero(along < 1.5 * np.pi / 24))  # two rulings
    loads = np.zeros((len(sheet.flat), 3))
    loads[crease[-1], 2] = 1e-4
    stages = (Stage(4, rest=model.rest(1.0)), Stage(3, loads=loads), Stage(3, loads=0 * loads))
    run = fold(model, stages, supports=held)
    folded, loaded, again = run.steps[4], run.steps[7], run.steps[10]
    assert loaded.positions[crease[-1], 2] > folded.positions[crease[-1], 2] + 0.1
    assert again.positions == pytest.approx(folded.positions, abs=1e-6)
    assert loaded.reactions.sum(axis=0) == pytest.approx([0, 0, -1e-4], abs=1e-10)
    assert folded.reactions.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-10)
    arm = np.cross(loaded.positions, loaded.reactions + loads).sum(axis=0)
    assert arm == pytest.approx([0, 0, 0], abs=1e-8)


def test_a_free_sheet_is_pulled_apart_by_forces_in_balance() -> None:
    """Six rigid motions are left, the loads turn with nothing: Hooke's law, Poisson's too."""
    flat, quads, number = grid(np.linspace(0, 3, 4), np.linspace(0, 2, 5))
    model = build(Sheet(flat, quads), PAPER)
    loads, share = np.zeros((len(flat), 3)), np.array([1, 2, 2, 2, 1]) / 8
    loads[number[-1], 0], loads[number[0], 0] = 1e-3 * share, -1e-3 * share
    last = fold(model, (Stage(1, loads=loads),)).steps[-1]
    strain = 1e-3 / (PAPER.youngs * PAPER.thickness * 2)
    long, wide = np.ptp(last.positions[:, 0]) / 3 - 1, np.ptp(last.positions[:, 1]) / 2 - 1
    assert long == pytest.approx(strain, rel=1e-5)  # Green: 3 / 2 of the strain
    assert wide == pytest.approx(-PAPER.poisson * strain, rel=1e-5)
    assert not np.any(last.reactions)
    got = stiffness(model, model.start, model.rest(0.0), loads)
    assert got == pytest.approx(PAPER.youngs * PAPER.thickness * 2 / 3, rel=1e-9)


def test_loads_that_nothing_holds_are_refused() -> None:
    sheet, _ = annulus(4)
    model = build(sheet, PAPER)
    loads = np.ones((len(sheet.flat), 3))
    with pytest.raises(JobError, match="6 rigid motions"):
        fold(model, (Stage(1, loads=loads),))
    with pytest.raises(JobError, match="leave 3 rigid motions"):
        fold(model, (Stage(1, loads=loads),), supports=Supports.fixing(np.array([0])))


def test_no_state_is_returned_that_is_not_in_balance(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(newton, "TOLERANCE", -1.0)  # no force is small enough
    monkeypatch.setattr(relaxation, "STEPS", 3)
    sheet, _ = annulus(8)
    model = build(sheet, PAPER, length_scale=0.1)
    with pytest.raises(ConvergenceError, match="of stage 1: after") as caught:
        fold(model, (Stage(1, rest=model.rest(2.5)),))
    assert float(caught.value.value or 0) > float(caught.value.limit or 0)
    assert "steps" in caught.value.remedy
    assert (caught.value.code, caught.value.check) == (3, "equilibrium")


def test_cells_that_turn_over_and_creases_off_the_edges_are_told() -> None:
    flat, quads, number = grid(np.arange(3.0), np.arange(3.0))
    with pytest.raises(GeometryError, match="turns over"):
        build(Sheet(flat, quads[:, ::-1]), PAPER)
    with pytest.raises(GeometryError, match="overlap"):
        build(Sheet(flat, np.concatenate([quads, quads[:1]])), PAPER)
    with pytest.raises(GeometryError, match="not an edge between two cells"):
        build(Sheet(flat, quads, creases=number[[0], :2]), PAPER)
