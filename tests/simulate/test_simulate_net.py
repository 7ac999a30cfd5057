"""The net of a sheet: the same material points in the pattern and in space, and who is whose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from annuli import RADIUS, WIDTH, annulus
from jobs import built

from devcad.errors import GeometryError
from devcad.simulate.held import forces, held, node_areas, spread
from devcad.simulate.net import Net, net_of
from devcad.simulate.settings import Load, Simulation, Support, Where

ALPHA = math.radians(30.0)


def areas(net: Net) -> np.ndarray:
    """Signed areas of the cells in the pattern, shoelace."""
    x, y = net.flat[net.faces].transpose(2, 0, 1)
    return 0.5 * ((x * np.roll(y, -1, axis=1)).sum(axis=1) - (np.roll(x, -1, axis=1) * y).sum(1))


@pytest.mark.parametrize("how", [Simulation(), Simulation(cells=16), Simulation(cells=9, across=3)])
def test_a_folded_sheet_shares_the_nodes_of_its_crease(how: Simulation) -> None:
    net = net_of(annulus(ALPHA), how)
    crease = net.edges["crease"]
    # the pattern's origin is on the crease, +x away from the annulus's centre
    flat = np.linalg.norm(net.flat - [-RADIUS, 0.0], axis=1)
    assert flat[crease] == pytest.approx(RADIUS, rel=1e-12)
    assert flat[net.edges["top"]] == pytest.approx(RADIUS + WIDTH, rel=1e-12)
    assert flat[net.edges["base"]] == pytest.approx(RADIUS - WIDTH, rel=1e-12)
    height = net.built[:, 2]
    assert height[crease] == pytest.approx(0.0, abs=1e-12)
    assert height[net.edges["top"]] == pytest.approx(WIDTH * math.sin(ALPHA), rel=1e-12)
    assert height[net.edges["base"]] == pytest.approx(WIDTH * math.sin(ALPHA), rel=1e-12)
    round_ = np.linalg.norm(net.built[crease, :2], axis=1)
    assert round_ == pytest.approx(RADIUS * math.cos(ALPHA), rel=1e-12)
    assert (areas(net) > 0.0).all()
    sides = (how.across or 1) * 2
    assert len(net.quads) == sides * (len(crease) - 1)


def test_rulings_keep_their_length_and_the_flat_sheet_lies_at_the_start() -> None:
    net = net_of(annulus(ALPHA), Simulation(cells=16))
    for edge in ("start", "end"):
        nodes = net.edges[edge]
        flat = np.linalg.norm(np.diff(net.flat[nodes], axis=0), axis=1)
        assert np.linalg.norm(np.diff(net.built[nodes], axis=0), axis=1) == pytest.approx(flat)
    laid, right = net.laid, net.edges["start"][1:]
    assert laid[right] == pytest.approx(
        net.built[right], abs=1e-10
    )  # the right flank's start stays
    spans = np.linalg.norm(laid[net.quads[:, 0]] - laid[net.quads[:, 2]], axis=1)
    flat = np.linalg.norm(net.flat[net.quads[:, 0]] - net.flat[net.quads[:, 2]], axis=1)
    assert spans == pytest.approx(flat, rel=1e-12)


def test_rulings_that_meet_in_an_apex_meet_in_one_node() -> None:
    """A cone to its apex is a fan of triangles; its area converges to the sector's."""
    panel = built("cone")
    net = net_of(panel.panels[0], Simulation(cells=64, across=1))
    assert len(net.triangles) == 64
    assert len(net.quads) == 0
    assert len(net.edges["base"]) == 1
    assert areas(net).sum() == pytest.approx(panel.panels[0].pattern.area, rel=1e-3)


def test_straight_creases_are_creases() -> None:
    net = net_of(built("duct").panels[0], Simulation(cells=16, across=2))
    flat = net.flat[net.creases]  # three of the four: the sheet is cut open along the last
    lengths = np.linalg.norm(flat[:, 1] - flat[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(3 * 50.0)


def test_too_many_nodes_are_refused_with_a_remedy() -> None:
    with pytest.raises(GeometryError, match=r"18\d+ nodes|2\d{4} nodes") as error:
        net_of(built("arc").panels[0], Simulation(cells=2000, across=10))
    assert "cells" in error.value.remedy


# --- supports and loads ---------------------------------------------------------------------


def test_a_force_on_an_edge_is_as_an_even_load_whatever_the_cells() -> None:
    """The sum is the force, and its centre the middle of the edge's length."""
    net = net_of(annulus(ALPHA), Simulation(cells=7))
    nodes, shares = spread(net, Load(Where("top", None, "loads[0]"), (0.0, 0.0, 1.0)))
    assert shares.sum() == pytest.approx(1.0, rel=1e-14)
    corners = net.flat[net.edges["top"]]
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    middle = (0.5 * (corners[1:] + corners[:-1]) * steps[:, None]).sum(axis=0) / steps.sum()
    assert shares @ net.flat[nodes] == pytest.approx(middle, rel=1e-12)


def test_a_force_at_a_place_keeps_its_moment_in_the_pattern() -> None:
    net = net_of(annulus(ALPHA), Simulation(cells=16, across=3))
    at = (7.3, 12.1)
    nodes, shares = spread(net, Load(Where(None, at, "loads[0]"), (0.0, 0.0, 1.0)))
    assert shares.sum() == pytest.approx(1.0, rel=1e-14)
    assert shares @ net.flat[nodes] == pytest.approx(at, rel=1e-12)


def test_the_weight_is_that_of_the_whole_sheet() -> None:
    net = net_of(annulus(ALPHA), Simulation(cells=64))
    masses = 7.85e-3 * 0.5 * node_areas(net)  # g, of 0.5 mm of steel
    pull = forces(net, Simulation(weight=(0.0, 0.0, -2.0)), masses)
    sector = math.radians(90.0) * RADIUS * 2.0 * WIDTH
    assert pull.sum(axis=0) == pytest.approx(
        [0.0, 0.0, -7.85e-6 * 0.5 * sector * 9.80665],
        rel=2e-4,  # the polygon for the sector
    )


@pytest.mark.parametrize("at", [(-50.0, 0.0), (0.0, -1.0), (25.0, 5.0)])
def test_a_place_off_the_sheet_is_told_with_its_key(at: tuple[float, float]) -> None:
    net = net_of(annulus(ALPHA), Simulation(cells=16))
    with pytest.raises(GeometryError, match="outside") as error:
        spread(net, Load(Where(None, at, "simulate.loads[2]"), (1.0, 0.0, 0.0)))
    assert error.value.place == "simulate.loads[2]"


@pytest.mark.parametrize(
    ("supports", "free"),
    [
        ([Support(Where("start", None, ""), ("x", "y", "z"), False)], None),
        ([Support(Where(None, (0.0, 0.0), ""), ("x", "y", "z"), False)], 3),
        ([Support(Where("start", None, ""), ("z",), True)], 3),
        ([Support(Where("start", None, ""), ("x", "y", "z"), True)], None),
    ],
)
def test_supports_that_leave_the_sheet_free_are_refused(
    supports: list[Support], free: int | None
) -> None:
    net = net_of(annulus(ALPHA), Simulation(cells=16))
    if free is None:
        assert len(held(net, supports).nodes)
        return
    with pytest.raises(GeometryError, match=f"free to move in {free} of 6"):
        held(net, supports)
