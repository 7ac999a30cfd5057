"""The frame equations in any parameter, against curves known in closed form."""

from __future__ import annotations

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.frames import frenet
from devcad.geometry.jets import parse
from devcad.geometry.natural import framed_curve


def test_a_helix_in_another_parameter_is_that_helix_with_its_frame():
    """Radius 3, pitch 2 pi 4, arc length s = 5 (t + t^2): k = 3/25, tau = 4/25."""

    def rates(t, order):
        speed = parse("5 + 10*t").at(t, order)
        return speed, 0.12 * speed, 0.16 * speed

    frame = np.array([[0, 0.6, 0.8], [-1, 0, 0], [0, -0.8, 0.6]])
    framed = framed_curve(rates, (0.0, 2.0), np.array([3.0, 0, 0]), frame)
    t = np.linspace(0, 2, 41)
    angle = parse("t + t**2").at(t, 7)
    sine, cosine = taylor.sin_cos(angle)
    helix = np.stack([3 * cosine, 3 * sine, 4 * angle], axis=-1)
    found = framed(t, 4)
    np.testing.assert_allclose(found[0], helix[:5], rtol=0, atol=1e-12)
    known = frenet(helix)
    for side, expected in zip(found[1:], (known.T, known.N, known.B), strict=True):
        np.testing.assert_allclose(side, expected[:5], rtol=0, atol=1e-11)


def test_rates_may_jump_at_breaks():
    """A quarter of a circle, a straight stretch, a quarter the other way: back to the direction."""

    def rates(t, order):
        one = taylor.constant(1.0, order, t.size)
        turn = taylor.constant(0.0, order, t.size)
        turn[0] = np.where(t < 1.0, 0.5 * np.pi, np.where(t < 2.0, 0.0, -0.5 * np.pi))
        return one, turn, taylor.constant(0.0, order, t.size)

    framed = framed_curve(rates, (0.0, 3.0), np.zeros(3), np.eye(3), (1.0, 2.0))
    ends = framed(np.array([1.0, 2.0, 3.0]), 0)
    r = 2 / np.pi
    expected = [[r, r, 0], [r, r + 1, 0], [2 * r, 2 * r + 1, 0]]
    np.testing.assert_allclose(ends[0][0], expected, atol=1e-14)
    np.testing.assert_allclose(ends[1][0], [[0, 1, 0], [0, 1, 0], [1, 0, 0]], atol=1e-14)
