"""Piecewise Chebyshev series against closed forms."""

import numpy as np
import pytest

from devcad.geometry.chebyshev import resolve


def test_series_integral_and_derivative_of_closed_forms_reach_rounding():
    t = np.linspace(-1.0, 1.0, 1001)
    series = resolve(
        lambda t: np.column_stack([np.cos(3 * t), np.exp(t), 1 / (1 + 25 * t**2)]),
        np.array([-1.0, 1.0]),
    )
    exact = np.column_stack([np.cos(3 * t), np.exp(t), 1 / (1 + 25 * t**2)])
    np.testing.assert_allclose(series(t), exact, atol=3e-14)  # coefficients dropped below 1e-14
    integral = np.column_stack(
        [
            (np.sin(3 * t) + np.sin(3)) / 3,
            np.exp(t) - np.exp(-1),
            (np.arctan(5 * t) + np.arctan(5)) / 5,
        ]
    )
    np.testing.assert_allclose(series.antiderivative()(t), integral, atol=3e-14)
    slope = np.column_stack([-3 * np.sin(3 * t), np.exp(t)])
    # differentiating n coefficients multiplies their rounding by n^2
    np.testing.assert_allclose(series.derivative()(t)[:, :2], slope, atol=1e-10)


def test_a_kink_at_a_knot_costs_nothing():
    series = resolve(lambda t: np.abs(t)[:, None], np.array([-1.0, 0.0, 2.0]))
    assert len(series.knots) == 3
    assert series.antiderivative()(np.array([2.0]))[0, 0] == pytest.approx(2.5, rel=1e-15)


def test_a_function_that_is_rounding_only_ends_at_once():
    noise = lambda t: 1e-17 * np.cos(1e9 * t)[:, None]  # noqa: E731
    assert len(resolve(noise, np.array([0.0, 1.0]), scale=1.0).knots) == 2


def test_a_jump_without_a_knot_ends_by_depth():
    series = resolve(lambda t: np.sign(t - 0.3)[:, None], np.array([0.0, 1.0]))
    assert series.samples < 10_000
    assert series.antiderivative()(np.array([1.0]))[0, 0] == pytest.approx(0.4, abs=1e-4)


def test_samples_are_counted_rejected_ones_included():
    seen: list[float] = []

    def function(t):
        seen.extend(t.tolist())
        return np.sqrt(9 * np.sin(t) ** 2 + 4 * np.cos(t) ** 2)[:, None]

    series = resolve(function, np.array([0.0, 2 * np.pi]))
    assert len(set(seen)) == len(seen) == series.samples
    assert series.samples <= 200
