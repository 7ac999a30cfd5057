from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planecurves import (
    TURN,
    apart,
    arc,
    drawn,
    edge,
    ellipse,
    frustum,
    line,
    loft_rim,
    moved,
    natural,
)
from scipy.interpolate import BSpline, make_interp_spline

from devcad.errors import CheckFailed
from devcad.flatten import loops
from devcad.flatten.arcs import fit_edge, fit_outline
from devcad.flatten.loops import Loop, Path
from devcad.flatten.measure import loop_deviation
from devcad.flatten.pattern import Edge
from devcad.flatten.polylines import polyline_outline
from devcad.flatten.splines2d import Spline, spline_outline
from devcad.geometry.taylor import Array

CURVES: dict[str, Edge] = {
    "parabola": edge(lambda u: (100 * u, 80 * u**2), -1, 1),
    "ellipse": ellipse(100, 30),
    "ellipse run backwards": ellipse(100, 30, TURN, 0),
    "inflections": edge(lambda u: (50 * u, 30 * np.sin(u)), 0, 20),
    "logarithmic spiral": edge(
        lambda u: (np.exp(0.1 * u) * np.cos(u), np.exp(0.1 * u) * np.sin(u)), 0, 40
    ),
    "spiral from its centre": edge(lambda u: (u * np.cos(u), u * np.sin(u)), 0, 40),
    "cusp at the start": edge(lambda u: (100 * u**2, 60 * u**3), 0, 1),
    "two cusps": edge(lambda u: (20 * (u - np.sin(u)), 20 * (1 - np.cos(u))), 0, TURN),
    "peak": edge(lambda u: (100 * u, 30 * np.exp(-300 * u**2)), -1, 0, 1),
    "loft rim": loft_rim(),
}
BIARCS = {0.1: 16, 0.01: 32, 0.001: 60}  # what tangent biarcs take for the loft rim


def kinks(path: Path) -> Array:
    """The angles between neighbouring segments."""
    chord = np.diff(path.points, axis=0)
    angle, half = np.arctan2(chord[:, 1], chord[:, 0]), 2.0 * np.arctan(path.bulges)
    return np.abs(loops.wrap((angle - half)[1:] - (angle + half)[:-1]))


def radii(points: Array, bulges: Array) -> Array:
    chord = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(chord / (2.0 * np.abs(np.sin(2.0 * np.arctan(bulges)))))


def distances(path: Path, true: Edge) -> tuple[float, float]:
    """From the curve to the path and back, by brute force; chords of 4e4 points leave 1e-7."""
    curve = true.curve(np.linspace(true.u[0], true.u[-1], 40001))[0]
    dense = drawn(path.points, path.bulges, 40000 // len(path.bulges))
    return apart(curve, dense), apart(dense, curve)


def test_a_frustum_is_two_lines_and_two_arcs_of_the_cone_distances():
    loop = fit_outline(frustum(100.0, 50.0, 120.0), 0.005)
    assert loop.exact
    assert list(loop.bulges == 0.0) == [True, False, True, False]
    closed = np.concatenate([loop.points, loop.points[:1]])
    np.testing.assert_allclose(radii(closed, loop.bulges + (loop.bulges == 0))[[1, 3]], [130, 260])
    sweeps = 4.0 * np.arctan(loop.bulges[[1, 3]])
    np.testing.assert_allclose(sweeps, [-2.4166097335306103, 2.4166097335306103], rtol=1e-12)
    assert loops.area(loop) == pytest.approx(np.pi * 150 * 130, rel=1e-13)  # pi (r1 + r2) slant


@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
def test_the_edge_of_a_helix_flight_is_arcs_of_radius_a2_plus_b2_over_a(scale):
    a, b = 30.0 * scale, 60.0 * scale / TURN
    radius = (a * a + b * b) / a
    sweep = TURN * np.hypot(a, b) / radius
    path = fit_edge(arc((0.0, radius), radius, -np.pi / 2, -np.pi / 2 + sweep), 0.005)
    assert path.exact
    np.testing.assert_allclose(radii(path.points, path.bulges), radius, rtol=1e-12)
    assert len(path.bulges) == 2  # more than half a turn
    np.testing.assert_allclose(4.0 * np.arctan(path.bulges).sum(), sweep, rtol=1e-12)


@pytest.mark.parametrize("start", [0.0, 1.234])
def test_a_full_circle_is_two_half_circles(start):
    loop = fit_outline((arc((3.0, -4.0), 12.0, start, start + TURN),), 0.005)
    np.testing.assert_allclose(loop.bulges, [1.0, 1.0], rtol=1e-9)
    found = loops.circle(loop)
    assert found is not None
    np.testing.assert_allclose([*found[0], found[1]], [3.0, -4.0, 12.0], rtol=1e-13)


def test_an_ellipse_is_no_circle():
    assert loops.circle(fit_outline((ellipse(12.0, 12.001),), 0.005)) is None


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.001])
def test_free_directions_take_fewer_arcs_than_tangent_biarcs(tolerance):
    """Theory: 1.45 times fewer, the cube root of 2/81 over the Bernoulli maximum sqrt(3)/216."""
    path = fit_edge(loft_rim(), tolerance)
    assert len(path.bulges) <= BIARCS[tolerance] / 1.4


@pytest.mark.parametrize("name", ["parabola", "ellipse", "loft rim"])
def test_the_number_of_arcs_grows_with_the_cube_root_of_the_accuracy(name):
    tolerances = np.geomspace(1e-2, 1e-5, 4)
    counts = [len(fit_edge(CURVES[name], float(t)).bulges) for t in tolerances]
    order = np.polyfit(np.log(tolerances), np.log(counts), 1)[0]
    assert order == pytest.approx(-1 / 3, abs=0.02)  # whole numbers from 10 on


@pytest.mark.parametrize("tolerance", [0.05, 0.005])
@pytest.mark.parametrize("scale", [0.1, 1.0, 50.0])
@pytest.mark.parametrize("name", CURVES)
def test_the_certificate_holds_both_ways_and_is_tight(name, scale, tolerance):
    true = moved(CURVES[name], scale, 0.4, False)
    path = fit_edge(true, tolerance)
    forth, back = distances(path, true)
    rounding = 1e-5 * scale  # sagitta of the brute force's chords, 2 mm on a radius of 4000
    assert max(forth, back) <= path.deviation + rounding
    assert path.deviation <= tolerance
    assert path.deviation <= 1.01 * max(forth, back) + rounding
    assert kinks(path).max(initial=0.0) < 1e-12
    assert np.abs(path.bulges).max() <= 1.0 + 1e-6  # half a turn at most
    sizes = loops.lengths(path.points[:-1], path.points[1:], path.bulges)
    assert sizes.min() >= 0.01


@pytest.mark.slow
@settings(max_examples=20)
@given(
    angle=st.floats(-3.0, 3.0),
    scale=st.floats(-2.0, 2.0).map(lambda x: 10.0**x),
    mirrored=st.booleans(),
)
def test_moving_scaling_and_mirroring_an_edge_moves_its_arcs(angle, scale, mirrored):
    original = CURVES["loft rim"]
    first = fit_edge(original, 0.02)
    true = moved(original, scale, angle, mirrored)
    path = fit_edge(true, 0.02 * scale)
    assert abs(len(path.bulges) - len(first.bulges)) <= 1
    assert path.deviation <= 0.02 * scale
    assert max(distances(path, true)) <= path.deviation + 1e-6 * scale


def test_corners_are_vertices():
    rim = CURVES["loft rim"]
    start, end = rim.curve(rim.u)[0]
    outline = (rim, line(tuple(end), (0.0, 250.0)), line((0.0, 250.0), tuple(start)))
    loop = fit_outline(outline, 0.01)
    for corner in (start, end, np.array([0.0, 250.0])):
        assert np.linalg.norm(loop.points - corner, axis=1).min() < 1e-12  # sums in another order


def test_smooth_runs_of_edges_become_one():
    """A stadium cut into eleven edges is two lines and two half circles."""
    x = np.array([0.0, 10.0, 35.0, 60.0])
    right = [arc((60, 20), 20, -np.pi / 2 + a, -np.pi / 2 + b) for a, b in ((0, 0.5), (0.5, np.pi))]
    left = [
        arc((0, 20), 20, np.pi / 2 + a, np.pi / 2 + b)
        for a, b in ((0, 1.0), (1.0, 2.0), (2.0, np.pi))
    ]
    bottom = [line((float(a), 0.0), (float(b), 0.0)) for a, b in itertools.pairwise(x)]
    top = [line((float(b), 40.0), (float(a), 40.0)) for a, b in itertools.pairwise(x)]
    loop = fit_outline((*bottom, *right, *top[::-1], *left), 0.005)
    assert loop.exact
    np.testing.assert_allclose(np.sort(loop.bulges), [0.0, 0.0, 1.0, 1.0], atol=1e-12)
    assert loops.area(loop) == pytest.approx(60 * 40 + np.pi * 400, rel=1e-13)


def test_a_line_that_turns_into_a_spiral_stays_a_line_and_tangent():
    """A straight run of 50 and a clothoid; the joint is a knot, the curvature continues."""

    def curvature(s: Array) -> Array:
        return 0.002 * np.maximum(s - 50.0, 0.0)

    plain = natural(curvature, np.ones_like, 0.0, 100.0, panels=2)
    path = fit_edge(Edge("base", plain.curve, np.array([0.0, 50.0, 100.0])), 0.005)
    assert path.bulges[0] == 0.0
    np.testing.assert_allclose(path.points[1], [50.0, 0.0], atol=1e-12)
    assert np.count_nonzero(path.bulges == 0.0) == 1
    assert kinks(path).max() < 1e-9  # the recognised line is the curve to 1e-9 of its length


def test_a_closed_smooth_edge_has_no_kink_at_its_seam():
    loop = fit_outline((ellipse(50.0, 20.0, 0.3, 0.3 + TURN),), 0.005)
    closed = Path(
        np.concatenate([loop.points, loop.points[:2]]),
        np.append(loop.bulges, loop.bulges[0]),
        False,
        0.0,
    )
    assert kinks(closed).max() < 1e-12


def test_edges_of_no_length_are_corners_and_clockwise_outlines_are_turned():
    square = [(0.0, 0.0), (0.0, 10.0), (10.0, 10.0), (10.0, 1e-9), (10.0, 0.0)]
    outline = tuple(line(a, b) for a, b in zip(square, [*square[1:], square[0]], strict=True))
    loop = fit_outline(outline, 0.005)
    assert len(loop.points) == 4
    assert loops.area(loop) == pytest.approx(100.0, rel=1e-9)
    assert loop.deviation <= 1.1e-9


@pytest.mark.parametrize("tolerance", [0.1, 0.001])
def test_the_area_is_the_ellipses_within_deviation_times_perimeter(tolerance):
    loop = fit_outline((ellipse(80.0, 30.0),), tolerance)
    assert abs(loops.area(loop) - np.pi * 80 * 30) < loop.deviation * loops.perimeter(loop)


@given(half=st.floats(1e-6, np.pi / 2))
def test_a_circular_segment_has_the_area_of_school(half):
    """R^2 (x - sin x) / 2 with x = 2 half; small ones keep their digits (x^3 / 12)."""
    chord = 2.0 * np.sin(half)
    loop = Loop(np.array([[0.0, 0.0], [chord, 0.0]]), np.array([np.tan(0.5 * half), 0.0]))
    x = 2.0 * half
    exact = 0.5 * (x - np.sin(x)) if x > 0.1 else x**3 / 12 * (1 - x**2 / 20 + x**4 / 840)
    assert loops.area(loop) == pytest.approx(exact, rel=1e-9)


def test_the_tangent_turns_once_along_a_simple_loop_and_not_along_an_eight():
    loop = fit_outline(frustum(100.0, 50.0, 120.0), 0.005)
    assert loops.turning(loop) == pytest.approx(1.0, abs=1e-12)
    eight = Loop(np.array([[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0]]), np.zeros(4))
    assert loops.turning(eight) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("shift", [1e-4, 1e-2, 1.0])
def test_a_moved_vertex_is_measured(shift):
    outline = frustum(100.0, 50.0, 120.0)
    loop = polyline_outline(outline, 1e-5)
    points = loop.points.copy()
    middle = len(points) // 2  # on the outer arc, about the apex (260, 0)
    points[middle] += shift * (points[middle] - [260.0, 0.0]) / 260.0
    found = loop_deviation(Loop(points, loop.bulges), outline, 1e-6)
    assert found == pytest.approx(shift, rel=3e-3, abs=2e-5)  # the certificate's margin


def test_the_same_loop_run_backwards_deviates_as_much():
    outline = (ellipse(80.0, 30.0, 0.0, 2.0), line(ellipse_at(2.0), (80.0, 0.0)))
    loop = fit_outline(outline, 0.01)
    assert loop_deviation(loops.reverse(loop), outline, 1e-3) == pytest.approx(
        loop.deviation, rel=1e-3
    )


def ellipse_at(u: float) -> tuple[float, float]:
    return 80.0 * float(np.cos(u)), 30.0 * float(np.sin(u))


def test_what_rounding_forbids_is_refused():
    with pytest.raises(CheckFailed, match="use a larger tolerance"):
        fit_edge(CURVES["ellipse"], 1e-16)


@pytest.mark.parametrize("name", ["parabola", "ellipse", "loft rim"])
def test_a_polyline_follows_within_its_chord_error(name):
    true = CURVES[name]
    start, end = true.curve(true.u[[0, -1]])[0]
    outline = (true,) if np.allclose(start, end) else (true, line(tuple(end), tuple(start)))
    counts = []
    tolerances = [0.02, 0.002, 0.0002]
    for tolerance in tolerances:
        loop = polyline_outline(outline, tolerance)
        assert loop.deviation <= tolerance
        assert not loop.bulges.any()
        corners = np.concatenate([loop.points, loop.points[:1]])
        curve = true.curve(np.linspace(true.u[0], true.u[-1], 20001))[0]
        assert apart(curve, drawn(corners, np.zeros(len(loop.points)), 100)) <= loop.deviation
        counts.append(len(loop.points))
    order = np.polyfit(np.log(tolerances), np.log(counts), 1)[0]
    assert order == pytest.approx(-0.5, abs=0.03)


def test_a_polyline_never_leaves_its_curve_by_more_than_two_hundredths():
    assert polyline_outline((ellipse(80.0, 30.0),), 1.0).deviation <= 0.02


def test_splines_follow_with_few_control_points_and_meet_bitwise():
    rim = CURVES["loft rim"]
    start, end = rim.curve(rim.u)[0]
    outline = (rim, line(tuple(end), (0.0, 250.0)), line((0.0, 250.0), tuple(start)))
    chains = spline_outline(outline, 0.01)
    assert [type(item) for chain in chains for item in chain] == [Spline, Path, Path]
    spline = chains[0][0]
    assert isinstance(spline, Spline)
    assert len(spline.control) <= 25
    first, second = chains[1][0], chains[2][0]
    assert isinstance(first, Path)
    assert isinstance(second, Path)
    for before, after in (
        (spline.control, first.points),
        (first.points, second.points),
        (second.points, spline.control),
    ):
        assert np.all(before[-1] == after[0])
    x = np.linspace(spline.knots[0], spline.knots[-1], 20001)
    drawn_spline = BSpline(spline.knots, spline.control, spline.degree)(x)
    curve = rim.curve(np.linspace(0.0, TURN, 20001))[0]
    worst = max(apart(curve, drawn_spline), apart(drawn_spline, curve))
    assert worst <= spline.deviation + 1e-6 <= 0.01 + 1e-6
    assert spline.deviation <= 1.01 * worst


def test_splines_of_lines_and_arcs_are_the_lines_and_arcs():
    chains = spline_outline(frustum(100.0, 50.0, 120.0), 0.005)
    assert all(isinstance(item, Path) and item.exact for chain in chains for item in chain)


def test_a_spline_edge_with_many_knots_is_followed_across_them():
    """Interpolated points: pieces only C2 at 30 knots, far more than it takes arcs."""
    t = np.linspace(0.0, 3.0, 30)
    spline = make_interp_spline(t, np.stack([200 * t, 60 * np.sin(t)], axis=1), k=3)
    slope = spline.derivative()
    true = Edge("top", lambda u: (spline(u), slope(u)), t)
    path = fit_edge(true, 0.005)
    assert len(path.bulges) < 29
    assert max(distances(path, true)) <= path.deviation + 1e-6 <= 0.005 + 1e-6
