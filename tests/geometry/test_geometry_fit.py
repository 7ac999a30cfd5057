"""Fitted splines: within their tolerance where nobody sampled, exact at their ends, few poles."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.errors import GeometryError
from devcad.geometry.fit import (
    TWIST_LIMIT,
    Course,
    Curves,
    Demand,
    Ends,
    Fit,
    Spline,
    fit,
    ruled_twist,
)
from devcad.geometry.taylor import Array

POINT = (slice(0, 3),)
PAIR = (slice(0, 3), slice(3, 6))
TURN = 2.0 * np.pi


def ellipse(t: Array) -> Array:
    return np.stack([100.0 * np.cos(t), 60.0 * np.sin(t), 0.0 * t], axis=1)


def ellipse_slope(t: Array) -> Array:
    return np.stack([-100.0 * np.sin(t), 60.0 * np.cos(t), 0.0 * t], axis=1)


def helix_strip(t: Array) -> Array:
    """Both edges of the tangent surface of a helix, v from 20 to 60."""
    point = np.stack([30.0 * np.cos(t), 30.0 * np.sin(t), 12.0 * t], axis=1)
    tangent = np.stack([-30.0 * np.sin(t), 30.0 * np.cos(t), 0.0 * t + 12.0], axis=1)
    tangent /= np.hypot(30.0, 12.0)
    return np.concatenate([point + 20.0 * tangent, point + 60.0 * tangent], axis=1)


def whole(t0: float, t1: float) -> Course:
    return Course(np.array([t0, t1]), np.array([t0, t1]))


def ends(curves: Curves, course: Course) -> Ends:
    first, last = curves(course.t[[0, -1]])
    return Ends((first, last))


def worst(made: Fit, curves: Curves, columns: slice) -> float:
    """The largest distance at random parameters: places that no fit of ours samples."""
    s = np.random.default_rng(7).uniform(*made.course.s[[0, -1]], 4000)
    off = made.spline(s) - curves(made.course(s))
    return float(np.linalg.norm(off[:, columns], axis=1).max())


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_the_certificate_bounds_the_error_at_unseen_places(degree: int, tolerance: float) -> None:
    course = whole(0.0, TURN)
    made = fit(ellipse, course, ends(ellipse, course), Demand(degree, tolerance, POINT))
    measured = worst(made, ellipse, slice(0, 3))
    assert measured <= tolerance
    assert measured <= 1.02 * made.error  # 33 places a span miss little of its largest error


def test_error_falls_with_the_power_degree_plus_one() -> None:
    # uniform spans: error ~ span^(degree + 1), so poles ~ tolerance^(-1/6) for quintics
    course = whole(0.0, TURN)
    spans = []
    for tolerance in (1e-3, 1e-9):
        made = fit(ellipse, course, ends(ellipse, course), Demand(5, tolerance, POINT))
        spans.append(len(made.spline.poles) - 5)
    order = np.log(1e6) / np.log(spans[1] / spans[0])
    assert order == pytest.approx(6.0, abs=0.7)  # whole spans: +-1 of about 9


def test_a_closed_smooth_loft_needs_at_most_60_quintic_poles() -> None:
    course = whole(0.0, TURN)
    made = fit(ellipse, course, ends(ellipse, course), Demand(5, 1e-4, POINT))
    assert len(made.spline.poles) <= 60


def test_ends_are_met_bitwise_and_slopes_exactly() -> None:
    course = whole(0.3, 2.9)
    points, slopes = ellipse(course.t), ellipse_slope(course.t)
    wanted = Ends((points[0], points[1]), (slopes[0], slopes[1]))
    made = fit(ellipse, course, wanted, Demand(5, 1e-4, POINT))
    assert np.array_equal(made.spline.poles[[0, -1]], points)
    np.testing.assert_allclose(made.spline(course.s), points, atol=1e-13)
    np.testing.assert_allclose(made.spline.derivative(course.s), slopes, rtol=1e-12, atol=1e-9)


def test_polynomials_up_to_the_degree_are_their_own_fit() -> None:
    def quintic(t: Array) -> Array:
        return np.stack([t, 3.0 * t**2 - t**5, t**4], axis=1)

    course = whole(-1.0, 2.0)
    made = fit(quintic, course, ends(quintic, course), Demand(5, 1e-9, POINT))
    assert made.error < 1e-12  # rounding of numbers about 30
    assert len(made.spline.poles) <= 9


def test_derivative_agrees_with_scipy() -> None:
    from scipy.interpolate import BSpline

    rng = np.random.default_rng(3)
    knots = np.array([0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 3.5, 4, 4, 4, 4, 4, 4], dtype=float)
    spline = Spline(5, knots, rng.normal(size=(12, 2)))
    s = np.linspace(0.0, 4.0, 101)
    other = BSpline(knots, spline.poles, 5)
    np.testing.assert_allclose(spline(s), other(s), atol=1e-13)
    np.testing.assert_allclose(spline.derivative(s), other.derivative()(s), atol=1e-12)


def test_twist_is_bounded_between_the_fitted_edges() -> None:
    course = whole(0.0, TURN)
    demand = Demand(5, 1e-4, PAIR, (PAIR,))
    made = fit(helix_strip, course, ends(helix_strip, course), demand)
    s = np.random.default_rng(1).uniform(0.0, TURN, 2000)
    value, slope = made.spline(s), made.spline.derivative(s)
    turn = ruled_twist(value[:, :3], slope[:, :3], value[:, 3:], slope[:, 3:])
    assert turn.max() <= TWIST_LIMIT
    assert turn.max() <= 1.05 * made.twist


def test_twist_of_a_hyperboloid_is_the_turn_of_its_normals() -> None:
    # x^2 + y^2 - z^2 = 1: at height +-1 the normals (x, y, -z) of one ruling enclose acos(-1/3)
    u = np.linspace(0.0, 6.0, 20)
    waist = np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=1)
    slope = np.stack([-np.sin(u), np.cos(u), 0.0 * u], axis=1)
    ruling = slope + np.array([0.0, 0.0, 1.0])
    turned = np.stack([-np.cos(u), -np.sin(u), 0.0 * u], axis=1)
    turn = ruled_twist(waist - ruling, slope - turned, waist + ruling, slope + turned)
    np.testing.assert_allclose(turn, np.arccos(-1.0 / 3.0), rtol=1e-12)


def test_twist_sees_a_regression_curve_between_the_edges() -> None:
    apex = np.zeros((1, 3))
    ring, slope = np.array([[1.0, 0.0, 1.0]]), np.array([[0.0, 1.0, 0.0]])
    assert ruled_twist(-ring, -slope, ring, slope) == pytest.approx(np.pi)
    assert ruled_twist(apex, 0.0 * slope, ring, slope) == 0.0  # the apex itself: 1e-3 inside


def test_a_break_gets_a_knot_and_costs_no_accuracy() -> None:
    def kinked_curvature(t: Array) -> Array:  # a line, then a circle: C1 and no more
        bend = np.maximum(t, 0.0)
        return np.stack([np.minimum(t, 0.0) + np.sin(bend), 1.0 - np.cos(bend), 0.0 * t], axis=1)

    t = np.array([-1.0, 0.0, 1.0])
    course = Course(t, t)
    made = fit(kinked_curvature, course, ends(kinked_curvature, course), Demand(5, 1e-8, POINT))
    assert np.count_nonzero(made.spline.knots == 0.0) == 4  # degree - 1: C1
    assert worst(made, kinked_curvature, slice(0, 3)) <= 1e-8
    assert len(made.spline.poles) < 25


def test_a_course_makes_a_jump_of_speed_smooth() -> None:
    def two_speeds(t: Array) -> Array:  # a circle run twice as fast after t = 1
        angle = np.where(t < 1.0, t, 2.0 * t - 1.0)
        return np.stack([np.cos(angle), np.sin(angle), 0.0 * t], axis=1)

    course = Course(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0]))
    made = fit(two_speeds, course, ends(two_speeds, course), Demand(5, 1e-8, POINT))
    assert worst(made, two_speeds, slice(0, 3)) <= 1e-8
    assert len(made.spline.poles) < 40


def test_too_many_waves_are_refused_with_numbers() -> None:
    def waves(t: Array) -> Array:  # 4000 waves, each in need of several spans
        return np.stack([100.0 * t, np.sin(4000.0 * TURN * t), 0.0 * t], axis=1)

    course = whole(0.0, 1.0)
    with pytest.raises(GeometryError, match="no spline of 4000 spans reaches 1e-05 mm") as found:
        fit(waves, course, ends(waves, course), Demand(5, 1e-5, POINT))
    assert isinstance(found.value.value, float)
    assert found.value.value > 1.0


def test_numbers_that_are_none_are_refused() -> None:
    course = whole(0.0, 1.0)
    wanted = Ends((np.zeros(3), np.ones(3)))
    with pytest.raises(GeometryError, match="not finite"):
        fit(lambda t: np.full((t.size, 3), np.nan), course, wanted, Demand(5, 1e-4, POINT))
