"""Polynomials are recognised from their values, with the fewest knots, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from devcad.geometry.fit import Course, Curves
from devcad.geometry.polynomial import MOST_SPANS, polynomial
from devcad.geometry.taylor import Array

BREAKS = np.array([0.0, 0.1, 0.35, 0.5, 1.0, 3.0])


def random_spline(degree: int, times: int, size: float = 100.0) -> BSpline:
    """Two space curves side by side, each inner break a knot of that multiplicity."""
    inner = np.repeat(BREAKS[1:-1], times)
    knots = np.concatenate([[0.0] * (degree + 1), inner, [3.0] * (degree + 1)])
    poles = np.random.default_rng(degree).normal(size=(len(knots) - degree - 1, 6))
    return BSpline(knots, size * poles, degree)


def ends(curves: Curves, course: Course) -> tuple[Array, Array]:
    first, last = curves(course.t[[0, -1]])
    return first, last


@pytest.mark.parametrize("degree", range(1, 10))
def test_a_bezier_curve_comes_back_with_its_control_points(degree: int) -> None:
    poles = np.random.default_rng(degree).normal(size=(degree + 1, 6)) * 100.0
    curve = BSpline(np.repeat([0.0, 1.0], degree + 1), poles, degree)
    found = polynomial(
        curve, Course(np.array([0.0, 1.0]), np.array([0.0, 1.0])), (poles[0], poles[-1])
    )
    assert found is not None and found.exact
    assert found.degree == degree
    assert np.array_equal(found.knots, curve.t)
    # rounding grows with the condition of the Bernstein basis, about 2^degree
    np.testing.assert_allclose(found.poles, poles, atol=3e-14 * 100.0 * 2.0**degree / 8.0)


@pytest.mark.parametrize("times", [1, 2])
@pytest.mark.parametrize("degree", [3, 4, 5, 7])
def test_a_spline_comes_back_with_its_knots_and_their_multiplicities(
    degree: int, times: int
) -> None:
    curve = random_spline(degree, times)
    course = Course(BREAKS, BREAKS)
    found = polynomial(curve, course, ends(curve, course))
    assert found is not None
    assert np.array_equal(found.knots, curve.t)
    np.testing.assert_allclose(found.poles, curve.c, atol=1e-11)  # of numbers about 100


def test_a_break_that_is_none_gets_no_knot() -> None:
    def cubic(t: Array) -> Array:
        return np.stack([t, t**2 - 4.0 * t**3, 7.0 + 0.0 * t], axis=1)

    course = Course(BREAKS, BREAKS)
    found = polynomial(cubic, course, ends(cubic, course))
    assert found is not None
    assert np.array_equal(found.knots, [0.0] * 4 + [3.0] * 4)


def test_short_decimals_stay_short() -> None:
    poles = np.array([[0, 0, 0], [300, -0.1, 110], [620, 90.125, 130], [900, 260, 60]], dtype=float)
    curve = BSpline(np.repeat([0.0, 1.0], 4), poles, 3)
    found = polynomial(
        curve, Course(np.array([0.0, 1.0]), np.array([0.0, 1.0])), (poles[0], poles[-1])
    )
    assert found is not None
    assert np.array_equal(found.poles, poles)


def test_a_course_is_followed_where_the_speed_jumps() -> None:
    def two_speeds(t: Array) -> Array:  # a parabola run twice as fast after t = 1
        x = np.where(t < 1.0, t, 2.0 * t - 1.0)
        return np.stack([x, x**2, 0.0 * x], axis=1)

    plain = Course(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]))
    assert polynomial(two_speeds, plain, ends(two_speeds, plain)) is None  # not C1 in t
    course = Course(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 3.0]))
    found = polynomial(two_speeds, course, ends(two_speeds, course))
    assert found is not None
    np.testing.assert_allclose(found.poles, [[0, 0, 0], [1.5, 0, 0], [3, 9, 0]], atol=1e-14)


NO_POLYNOMIALS = {
    "a circle": lambda t: np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1),
    "degree ten": lambda t: np.stack([t, t**10, 0.0 * t], axis=1),
    "a square root": lambda t: np.stack([t, np.sqrt(1.0 + t * t), 0.0 * t], axis=1),
    "one column of six": lambda t: np.stack([t, t, t, t, t, 0.1 * np.sin(5.0 * t)], axis=1),
    "no numbers": lambda t: np.stack([t, t, np.full_like(t, np.nan)], axis=1),
    "no finite numbers": lambda t: np.stack([t, t, np.where(t > 0.5, np.inf, t)], axis=1),
}


@pytest.mark.parametrize("name", NO_POLYNOMIALS)
def test_what_is_no_polynomial_is_left_to_the_fit(name: str) -> None:
    curves = NO_POLYNOMIALS[name]
    course = Course(np.array([0.0, 0.01, 1.0]), np.array([0.0, 0.01, 1.0]))
    assert polynomial(curves, course, ends(curves, course)) is None


def test_too_many_spans_are_left_to_the_fit() -> None:
    t = np.linspace(0.0, 1.0, MOST_SPANS + 2)

    def line(t: Array) -> Array:
        return np.stack([t, t, t], axis=1)

    assert polynomial(line, Course(t, t), ends(line, Course(t, t))) is None


@pytest.mark.parametrize("scale", [1e-4, 1e6])
def test_the_size_does_not_matter(scale: float) -> None:
    curve = random_spline(3, 1, scale)
    course = Course(BREAKS, BREAKS)
    found = polynomial(curve, course, ends(curve, course))
    assert found is not None
    assert np.array_equal(found.knots, curve.t)
    np.testing.assert_allclose(found.poles, curve.c, atol=1e-13 * scale)


def test_a_series_that_fades_out_is_no_polynomial_of_high_degree() -> None:
    def arc(t: Array) -> Array:  # on these spans nine Chebyshev coefficients give it to 1e-15
        return np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)

    t = np.linspace(0.0, 3.0, 16)
    course = Course(t, t)
    assert polynomial(arc, course, ends(arc, course)) is None
