"""The row of spherical images of a curve's frame: sigma, psi, chi, axes, the vector D~."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from devcad.geometry import jets, taylor
from devcad.geometry.curve import Curve
from devcad.geometry.indicatrices import Indicatrix, indicatrices
from devcad.geometry.natural import natural

S = np.linspace(-0.6, 0.6, 25)


def curve(x: str, y: str, z: str, order: int, t: np.ndarray) -> np.ndarray:
    """The series of a curve given by expressions."""
    return np.stack([jets.parse(text).at(t, order) for text in (x, y, z)], axis=-1)


def of_pitch(p: str) -> Curve:
    """The curve with k = cos(p(s)), tau = sin(p(s)): W = 1 and f = tan p."""
    k, tau = jets.parse(f"cos({p})"), jets.parse(f"sin({p})")
    return natural(k.at, tau.at, (-0.7, 0.7), np.zeros(3), np.eye(3))


def row(p: str, count: int) -> tuple[Indicatrix, ...]:
    return indicatrices(of_pitch(p).jet(S, 3 + count), count)


def test_modified_darboux_vector_of_a_helix_is_constant_along_its_axis():
    jet = curve("3*cos(t)", "3*sin(t)", "4*t", 3, np.linspace(0, 6, 13))  # oracle O10
    (frenet,) = indicatrices(jet, 1)
    expected = np.tile([0.0, 0.0, 1.6666666666666667], (13, 1))
    np.testing.assert_allclose(frenet.darboux[0], expected, atol=1e-15)
    np.testing.assert_allclose(frenet.axis[0], expected * 0.6, atol=1e-15)


def test_the_first_ratios_of_a_curve_with_unit_w():
    """With W = 1 and k = cos p: f = tan p, sigma = p', psi the curvature of the graph of p, and chi
    its derivative by arc length over (1 + psi^2)^(3/2): the polynomials know them all."""
    p = Polynomial([0.2, 0.5, -0.3, 0.4])
    d1, d2, d3 = (p.deriv(k)(S) for k in (1, 2, 3))
    stretch = 1 + d1**2
    psi = d2 / stretch**1.5
    slope = d3 / stretch**1.5 - 3 * d1 * d2**2 / stretch**2.5
    chi = slope / (np.sqrt(stretch) * (1 + psi**2) ** 1.5)
    found = row("0.2 + 0.5*t - 0.3*t**2 + 0.4*t**3", 4)
    for level, expected in zip(found, (np.tan(p(S)), d1, psi, chi), strict=True):
        np.testing.assert_allclose(level.ratio[0], expected, atol=1e-12)


@pytest.mark.parametrize("level", range(4))
def test_every_frame_turns_as_a_frenet_frame(level):
    """x' = rate y and so on, the derivatives of the sides taken from their values alone."""
    h = 1e-3
    expressions = ("cos(t) + 0.1*t", "sin(t)", "t + 0.3*t**2 + 0.1*t**3")

    def at(t: np.ndarray) -> Indicatrix:
        return indicatrices(curve(*expressions, 7, t), 4)[level]

    here = at(S)
    around = [at(S + k * h) for k in (-2, -1, 1, 2)]
    weights = np.array([1, -8, 8, -1]) / (12 * h)  # exact to h^4
    x, y, z = (
        sum(w * getattr(a, side)[0] for w, a in zip(weights, around, strict=True)) for side in "xyz"
    )
    rate, ratio = (here.rate[0] * here.speed[0])[:, None], here.ratio[0][:, None]
    np.testing.assert_allclose(x, rate * here.y[0], atol=1e-8)
    np.testing.assert_allclose(y, rate * (ratio * here.z[0] - here.x[0]), atol=1e-8)
    np.testing.assert_allclose(z, -rate * ratio * here.y[0], atol=1e-8)
    sides = np.stack([here.x[0], here.y[0], here.z[0]], axis=1)
    np.testing.assert_allclose(np.linalg.det(sides), 1.0, rtol=1e-13)


@pytest.mark.parametrize(
    ("p", "level", "value"),
    [("0.3", 0, np.tan(0.3)), ("0.1 + t", 1, 1.0), ("-sqrt(1 - t**2)", 2, 1.0)],
    ids=["cylindrical", "slant", "clad"],
)
def test_a_helix_of_each_class_has_a_constant_ratio_and_a_fixed_axis(p, level, value):
    *_, last = row(p, level + 1)
    np.testing.assert_allclose(last.ratio[0], value, atol=1e-12)
    np.testing.assert_allclose(last.axis[0], np.tile(last.axis[0, 0], (len(S), 1)), atol=1e-12)
    after = row(p, level + 2)[-1]
    np.testing.assert_allclose(after.ratio[0], 0.0, atol=1e-11)  # the next ratio vanishes


def test_the_series_are_those_of_the_values():
    """The Taylor polynomials meet the sides and the ratio 0.01 away, to rounding."""
    t, step, order = np.linspace(-0.5, 0.5, 7), 0.01, 14

    def at(s: np.ndarray) -> Indicatrix:
        return indicatrices(curve("cos(t)", "sin(t)", "t + 0.3*t**2", order, s), 3)[2]

    here, there = at(t), at(t + step)
    for name in ("x", "y", "z", "rate", "ratio"):
        series = getattr(here, name)
        powers = step ** np.arange(len(series))
        reached = np.tensordot(powers, series, axes=1)
        np.testing.assert_allclose(reached, getattr(there, name)[0], atol=1e-12)


def test_orders_are_as_promised():
    for level, frame in enumerate(row("0.2 + t**2", 4)):
        assert len(frame.ratio) == 5 - level
        assert (
            len(frame.x) == len(frame.rate) == len(frame.speed) == (5 if not level else 6 - level)
        )
        assert taylor.norm(frame.z)[0] == pytest.approx(1.0, rel=1e-15)
