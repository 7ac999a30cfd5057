"""Strips of plane quads against the geometry of plane quadrilaterals."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from constructing import area, build, inside, patches, refusal
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import GeometryError, JobError, LimitError
from devcad.geometry.chain import link
from devcad.geometry.classify import classify
from devcad.geometry.constructions.planar import corners, flattened, planarity
from devcad.geometry.regularity import twist

EXACT = 1e-12  # relative: rounding of a few hundred operations


def curve(x, y, z, low, high):
    return {"kind": "expression", "x": x, "y": y, "z": z, "t": [low, high]}


PARABOLA = curve("t", "0", "t**2", 0, 2)
CUBIC = curve("0", "t", "t**3", 0, 2)


def strips(**table):
    """The panels of a surface, each its patches."""
    return [panel.patches for panel in build(**table).panels]


def rulings(chain):
    """The ends of all rulings between and around the patches, (n + 1, 2, 3)."""
    places = [(patch, patch.domain[0]) for patch in chain] + [(chain[-1], chain[-1].domain[1])]
    jets = [patch.jet([t], 0) for patch, t in places]
    return np.array([[jet.rail(jet.v_from)[0, 0], jet.rail(jet.v_to)[0, 0]] for jet in jets])


def projective(net):
    """The net moved by a projective map, which keeps planes plane and lets nothing be parallel."""
    weight = 1 + net @ [0.12, 0.06, -0.1]
    return net / weight[..., None]


def bowl(m=3, n=5):
    """A net (m + 1, n + 1, 3) of plane quads, none of them with parallel sides."""
    u, v = np.linspace(-1.2, 1.2, m + 1)[:, None], np.linspace(-1.5, 1.5, n + 1)[None, :]
    return projective(np.stack(np.broadcast_arrays(v, u, -0.18 * v**2 - 0.12 * u**2), axis=-1))


# --- translational -------------------------------------------------------------------------


def test_o42_every_quad_of_a_translational_surface_is_a_plane_parallelogram():
    built = build(kind="translational", curves=[PARABOLA, CUBIC], count=2)
    assert len(built.panels) == 2
    for i, panel in enumerate(built.panels):
        assert panel.figures["planarity_defect"].value == 0.0
        ends = rulings(panel.patches)
        np.testing.assert_array_equal(ends[:, 0], [[i, j, i**2 + j**3] for j in range(3)])
        upper = [[i + 1, j, (i + 1) ** 2 + j**3] for j in range(3)]
        np.testing.assert_allclose(ends[:, 1], upper, rtol=1e-15)
        assert [patch.domain for patch in panel.patches] == [(0, 1), (1, 2)]
        for patch in panel.patches:
            assert classify(patch).type == "plane"
            assert np.abs(patch.frame(inside(patch)).a).max() == 0.0


def test_a_scaled_one_has_trapezoids_whose_rulings_meet_where_the_scale_vanishes():
    # S = (0, 0, t) + (1 - t/10) path: the cone with apex (0, 0, 10)
    table = {
        "kind": "translational",
        "curves": [curve("0", "0", "t", 0, 5), {"kind": "circle", "radius": 3}],
        "scale": "1 - t/10",
        "count": [2, 6],
    }
    for i, chain in enumerate(strips(**table)):
        low, high = (3 * (1 - 2.5 * k / 10) for k in (i, i + 1))
        middle = np.cos(np.pi / 6)  # of a hexagon's side
        slant = np.hypot(2.5, (low - high) * middle)
        assert sum(area(patch) for patch in chain) == pytest.approx(
            6 * slant * (low + high) / 2, rel=EXACT
        )
        whole = link(chain, base_closed=True, tolerance=1e-9)
        assert whole.closed
        for patch in chain:
            frame = patch.frame([np.mean(patch.domain)])
            edge = frame.c0 - (frame.q / frame.a)[:, None] * frame.e
            np.testing.assert_allclose(edge, [[0, 0, 10]], atol=1e-12)


def test_one_count_serves_both_directions():
    one = build(kind="translational", curves=[PARABOLA, CUBIC], count=3)
    both = build(kind="translational", curves=[PARABOLA, CUBIC], count=[3, 3])
    assert [len(panel.patches) for panel in one.panels] == [3, 3, 3]
    for a, b in zip(one.panels, both.panels, strict=True):
        np.testing.assert_array_equal(rulings(a.patches), rulings(b.patches))


def test_a_scale_that_vanishes_at_the_start_begins_with_a_fan():
    (chain,) = strips(
        kind="translational",
        curves=[curve("t", "0", "0", 0, 2), {"kind": "circle", "radius": 1, "normal": [1, 0, 0]}],
        scale="t/2",
        count=[1, 4],
    )
    # a pyramid over a square with the diagonal 2, 2 high: four triangles
    height = np.hypot(2, np.sqrt(0.5))
    assert sum(area(patch) for patch in chain) == pytest.approx(
        4 * np.sqrt(2) * height / 2, rel=EXACT
    )


# --- pq-strip ------------------------------------------------------------------------------


def test_neighbouring_strips_share_their_polyline_and_quads_their_rulings():
    net = bowl()
    chains = strips(kind="pq-strip", polylines=net.tolist())
    for i, chain in enumerate(chains):
        ends = rulings(chain)
        np.testing.assert_allclose(ends, np.stack([net[i], net[i + 1]], axis=1), atol=1e-15)
        for here, following in pairwise(chain):
            last, first = here.jet([here.domain[1]], 0), following.jet([following.domain[0]], 0)
            np.testing.assert_allclose(last.e[0], first.e[0], atol=1e-15)
        for patch in chain:
            assert classify(patch).type == "plane"
            assert twist(patch).value < 1e-13


def test_a_quad_has_the_area_of_its_triangles():
    net = bowl()
    for i, chain in enumerate(strips(kind="pq-strip", polylines=net.tolist())):
        a, b, c, d = corners(net[i : i + 2])
        halves = np.linalg.norm(np.cross(b - a, c - a), axis=1) + np.linalg.norm(
            np.cross(c - a, d - a), axis=1
        )
        np.testing.assert_allclose([area(patch) for patch in chain], halves / 2, rtol=EXACT)


def test_the_planarity_defect_is_the_distance_of_the_diagonals():
    # two crossing bars, one 3 above the other: whatever their directions
    quads = np.array([[[-1, 0, 0], [0, -2, 3], [1, 0, 0], [1, 5, 3]]], dtype=float).swapaxes(0, 1)
    assert planarity(quads) == pytest.approx([3.0], rel=EXACT)
    given_as = quads[:, 0]
    built = build(kind="pq-strip", polylines=[given_as[:2].tolist(), given_as[:1:-1].tolist()])
    assert built.panels[0].figures["planarity_defect"].value == pytest.approx(3.0, rel=EXACT)
    assert twist(built.panels[0].patches[0]).value > 1.0  # radians: the check refuses it
    assert not built.panels[0].notes


@pytest.mark.parametrize("digits", [3, 6, 9])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e6])
def test_points_rounded_to_decimals_are_made_plane_and_hardly_moved(digits, scale):
    rounded = np.round(100 * bowl(), digits) * scale
    built = build(kind="pq-strip", polylines=rounded.tolist())
    half_a_digit = 0.5 * 10.0**-digits * scale
    for i, panel in enumerate(built.panels):
        defect = panel.figures["planarity_defect"].value
        moved = panel.figures["points_moved_by"].value
        # four corners, each off by half a digit in three directions, decide about a quad
        assert 0 < defect < 4 * np.sqrt(3) * half_a_digit
        assert 0 < moved < 4 * np.sqrt(3) * half_a_digit
        assert len(panel.notes) == 1
        off = np.linalg.norm(
            rulings(panel.patches) - np.stack([rounded[i], rounded[i + 1]], axis=1), axis=2
        )
        assert off.max() <= moved * (1 + 1e-6) + 1e-13 * scale
        for patch in panel.patches:
            assert classify(patch).type == "plane"


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1), st.floats(-9, -5))
def test_noise_is_taken_out_of_a_net_by_moves_no_larger_than_it(seed, exponent):
    noise = 10.0**exponent
    net = bowl(4, 6) + noise * np.random.default_rng(seed).uniform(-1, 1, (5, 7, 3))
    flat, moved = flattened(net)
    assert planarity(corners(flat)).max() < 1e-11
    # the plane net without the noise is a solution, so the nearest one is nearer on the whole
    assert np.linalg.norm(flat - net) <= np.linalg.norm(net - bowl(4, 6)) * (1 + 1e-3)
    assert moved == pytest.approx(np.linalg.norm(flat - net, axis=2).max(), rel=1e-6)


def test_a_net_that_is_plane_or_plainly_not_stays_as_it_is():
    for net in (bowl(), bowl() + np.random.default_rng(1).uniform(-0.1, 0.1, (4, 6, 3))):
        flat, moved = flattened(net)
        assert flat is net
        assert moved == 0.0


# a hipped roof: two trapezoids and two triangles about the ends of its ridge, closed
EAVES = [[0, 0, 0], [6, 0, 0], [6, 4, 0], [0, 4, 0], [0, 0, 0]]
RIDGE = [[2, 2, 2], [4, 2, 2], [4, 2, 2], [2, 2, 2], [2, 2, 2]]


def test_a_hipped_roof_is_a_closed_strip_with_two_fans():
    (panel,) = build(kind="pq-strip", polylines=[EAVES, RIDGE]).panels
    assert link(panel.patches, base_closed=panel.base_closed, tolerance=1e-9).closed
    slope = np.sqrt(8)  # up to the ridge on all four sides
    expected = [(6 + 2) / 2 * slope, 4 / 2 * slope, (6 + 2) / 2 * slope, 4 / 2 * slope]
    np.testing.assert_allclose([area(patch) for patch in panel.patches], expected, rtol=EXACT)


def test_triangles_and_closed_strips_stay_so_when_points_are_moved():
    lower, upper = np.array(EAVES, dtype=float), np.array(RIDGE, dtype=float)
    lower[1] += [1e-5, 2e-5, 3e-5]
    flat, moved = flattened(np.stack([lower, upper]))
    assert 0 < moved < 1e-4
    np.testing.assert_array_equal(flat[:, 0], flat[:, -1])
    np.testing.assert_array_equal(flat[1, 1], flat[1, 2])
    np.testing.assert_array_equal(flat[1, 3], flat[1, 4])
    assert planarity(corners(flat)).max() < 1e-11


FLAT = [[0, 0, 0], [0, 50, 0], [0, 100, 0]]
TRIANGLES = {
    "a tip at the start": [FLAT, [[0, 0, 0], [60, 50, 10], [60, 100, 10]]],
    "a tip at the end": [FLAT, [[60, 0, 10], [60, 50, 10], [0, 100, 0]]],
    "a fan about the lower polyline": [
        [[0, 0, 0], [0, 50, 0], [0, 50, 0]],
        [[60, 0, 10], [60, 50, 10], [60, 70, 0]],
    ],
    "a fan about the upper polyline": [
        [[60, 0, 10], [60, 50, 10], [60, 70, 0]][::-1],
        [[0, 0, 0], [0, 50, 0], [0, 50, 0]][::-1],
    ],
}


@pytest.mark.parametrize("name", TRIANGLES)
def test_a_quad_may_be_a_triangle(name):
    lines = np.array(TRIANGLES[name], dtype=float)
    chain = patches(kind="pq-strip", polylines=lines.tolist())
    a, b, c, d = corners(lines)
    expected = np.linalg.norm(np.cross(c - a, d - b), axis=1) / 2  # half of the diagonals' product
    np.testing.assert_allclose([area(patch) for patch in chain], expected, rtol=EXACT)
    link(chain, base_closed=False, tolerance=1e-9)  # they share their rulings
    for patch in chain:
        frame = patch.frame(inside(patch))
        assert np.isfinite(frame.n).all()
        assert np.ptp(frame.n, axis=0).max() < 1e-14


SQUARE = [[0, 0, 0], [0, 50, 0]]
REFUSED = {
    "rulings that cross": [SQUARE, [[60, 50, 0], [60, 0, 0]]],
    "sides that cross": [SQUARE, [[60, 0, 0], [-60, 50, 0]]],
    "a dart": [[[0, 0, 0], [30, 20, 0]], [[60, 0, 0], [25, 5, 0]]],
    "three corners on a line": [SQUARE, [[0, -50, 0], [60, 50, 0]]],
    "all corners on a line": [SQUARE, [[0, 100, 0], [0, 150, 0]]],
    "no width": [SQUARE, SQUARE],
    "no length": [[[0, 0, 0], [0, 0, 0]], [[60, 0, 0], [60, 0, 0]]],
    "a fan that is a tip": [[[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [60, 0, 0]]],
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e6])
def test_what_is_no_convex_quad_is_refused_at_its_place(name, scale):
    first, second = REFUSED[name]
    before = [[x, y - 100, z] for x, y, z in (SQUARE[0], [60, 0, 0])]
    lines = scale * np.array([[before[0], *first], [before[1], *second]], dtype=float)
    error = refusal(kind="pq-strip", polylines=lines.tolist())
    assert isinstance(error, GeometryError)
    assert error.what.startswith("strip 1, quad ")
    assert error.remedy


def test_polylines_that_meet_in_the_middle_are_two_strips():
    lines = [FLAT, [[60, 0, 0], [0, 50, 0], [60, 100, 0]]]
    error = refusal(kind="pq-strip", polylines=lines)
    assert isinstance(error, GeometryError)
    assert "t = 1" in error.what


def test_a_strip_between_two_tips_in_one_point_is_refused():
    ring = [[0, 0, 0], [10, 5, 0], [10, -5, 0], [0, 0, 0]]
    error = refusal(
        kind="pq-strip", polylines=[ring, [[0, 0, 0], [9, 7, 5], [9, -7, 5], [0, 0, 0]]]
    )
    assert isinstance(error, GeometryError)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"polylines": [SQUARE, [*SQUARE, [0, 60, 0]]]}, "polyline 1"),
        ({"polylines": [SQUARE[:1], SQUARE[:1]]}, "at least 2"),
    ],
)
def test_polylines_must_be_equally_long(table, words):
    error = refusal(kind="pq-strip", **table)
    assert isinstance(error, JobError)
    assert words in error.what


def test_too_many_quads_are_a_limit():
    error = refusal(kind="translational", curves=[PARABOLA, CUBIC], count=[1000, 1000])
    assert isinstance(error, LimitError)


def test_a_scale_must_have_a_value():
    error = refusal(kind="translational", curves=[PARABOLA, CUBIC], count=2, scale="1/t")
    assert isinstance(error, JobError)
    assert "t = 0" in error.what
