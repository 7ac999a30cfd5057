"""Quotients of functions with common zeros, against the functions that they are made of."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.geometry import taylor
from devcad.geometry.jets import parse
from devcad.geometry.quotient import Pole, Quotient, quotient

T = np.linspace(-1, 1, 2001)


def series(text):
    return parse(text).at


def both(value, divisor):
    """value * divisor and divisor, as numerator and denominator."""

    def pair(t, order):
        den = series(divisor)(t, order)
        return taylor.mul(series(value)(t, order), den), den

    return pair


@pytest.mark.parametrize(
    "divisor",
    [
        "2 + t",
        "t",
        "sin(3*t)",
        "(t - 0.3)**2",
        "(t + 0.123456)**3",
        "t*(t - 1)*(t + 1)",
        "t - 1e-9",
    ],
)
def test_a_quotient_has_all_its_derivatives_where_both_vanish(divisor):
    pair = both("exp(t)*cos(2*t)", divisor)
    found = quotient(pair, (-1.0, 1.0), 1.0)
    assert isinstance(found, Quotient)
    out = found.of(T, *pair(T, 6))
    expected = series("exp(t)*cos(2*t)")(T, 6)
    # beside the reach a share of 0.1 is left of the divisor, of its cube 1e-3
    np.testing.assert_allclose(out[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(out, expected, atol=1e-7)


@pytest.mark.parametrize(("divisor", "at"), [("t - 0.25", 0.25), ("t + 1", -1.0), ("t - 1", 1.0)])
def test_a_pole_is_told_with_its_place(divisor, at):
    def pair(t, order):
        return series("cos(t)")(t, order), series(divisor)(t, order)

    found = quotient(pair, (-1.0, 1.0), 1.0)
    assert isinstance(found, Pole)
    assert found.t == pytest.approx(at, abs=1e-12)
    assert found.stretch is None


def pieces(rows):
    """Functions of t by expressions on [-1, 0), [0, 1], as (numerator, denominator) each."""

    def pair(t, order):
        at = [(series(a)(t, order), series(b)(t, order)) for a, b in rows]
        return tuple(np.where(t < 0.0, at[0][k], at[1][k]) for k in (0, 1))

    return pair


def test_where_there_is_no_divisor_the_quotient_goes_on_as_it_was():
    pair = pieces([("3*t + 6", "t + 2"), ("0", "0")])
    found = quotient(pair, (-1.0, 0.0, 1.0), 1.0)
    np.testing.assert_allclose(found.of(T, *pair(T, 2))[0], 3.0, rtol=1e-14)
    pair = pieces([("0", "0"), ("(1 + t)*(t + 2)", "t + 2")])
    out = quotient(pair, (-1.0, 0.0, 1.0), 1.0).of(T, *pair(T, 2))
    np.testing.assert_allclose(out[0], np.maximum(1.0, 1.0 + T), rtol=1e-14)


def test_a_stretch_that_only_the_divisor_leaves_is_a_pole():
    found = quotient(pieces([("1", "1"), ("1", "0")]), (-1.0, 0.0, 1.0), 1.0)
    assert (found.t, found.stretch) == (0.0, 1.0)
