"""Strips between two B-splines: their rulings, also where the rails meet."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devcad.geometry.splinestrip import spline_strip
from devcad.geometry.taylor import Array

KNOTS = np.array([0.0, 0.0, 0.0, 0.4, 1.0, 1.0, 1.0])


def homogeneous(points: list[list[float]], weights: list[float]) -> Array:
    w = np.array(weights)[:, None]
    return np.concatenate([np.array(points) * w, w], axis=1)


LOW = homogeneous([[0, 0, 0], [3, 4, 0], [8, 4, 1], [12, 0, 0]], [1.0, 0.8, 1.3, 1.0])


def de_boor(poles: Array, t: float) -> Array:
    """The point of the spline at t, by blossoming: another way than ours."""
    k = 2 if t < 0.4 else 3
    d = [poles[j + k - 2].copy() for j in range(3)]
    for r in (1, 2):
        for j in range(2, r - 1, -1):
            i = j + k - 2
            share = (t - KNOTS[i]) / (KNOTS[i + 3 - r] - KNOTS[i])
            d[j] = (1.0 - share) * d[j - 1] + share * d[j]
    return np.asarray(d[2][:3] / d[2][3])


def test_the_rails_are_the_splines() -> None:
    high = LOW + homogeneous([[0, 1, 9]] * 4, [1.0] * 4) * [1.0, 1.0, 1.0, 0.0]
    patch = spline_strip(2, KNOTS, LOW, high)
    assert patch.domain == (0.0, 1.0) and patch.breaks == (0.4,)
    for t in (0.0, 0.1, 0.4, 0.77, 1.0):
        jet = patch.jet([t], 0)
        assert jet.c0[0, 0] == pytest.approx(de_boor(LOW, t), abs=1e-14)
        assert jet.rail(jet.v_to)[0, 0] == pytest.approx(de_boor(high, t), abs=1e-13)


@pytest.mark.parametrize("end", [0, -1], ids=["start", "end"])
def test_at_a_tip_the_ruling_is_its_limit(end: int) -> None:
    """Near the end the way between the rails runs towards the difference of the next poles."""
    high = LOW + homogeneous([[0, 1, 9]] * 4, [1.0] * 4) * [1.0, 1.0, 1.0, 0.0]
    high[end] = LOW[end]
    patch = spline_strip(2, KNOTS, LOW, high)
    tip = patch.domain[end]
    inward = 1.0 if end == 0 else -1.0
    t = tip + inward * np.array([0.0, 1e-12, 1e-6, 1e-3])
    e = patch.jet(t, 0).e[0]
    next_to = 1 if end == 0 else -2
    way = (high - LOW)[next_to, :3]
    assert e[0] == pytest.approx(way / np.linalg.norm(way), abs=1e-14)
    assert patch.jet(t[:1], 0).v_to[0, 0] == pytest.approx(0.0, abs=1e-14)
    # analytic up to the tip: what one step changes is of the step's order
    assert np.linalg.norm(e[1:] - e[0], axis=1) == pytest.approx(0.0, abs=0.1)
    slope = patch.jet(t[:1], 1).e[1, 0] * inward * 1e-6
    assert e[2] - e[0] == pytest.approx(slope, abs=1e-11)  # the square of the step


def test_a_tip_of_second_order_is_one_too() -> None:
    """Rails that touch: their way vanishes with t squared."""
    high = LOW.copy()
    high[2:, 2] += 5.0
    patch = spline_strip(2, KNOTS, LOW, high)
    e = patch.jet([0.0, 1e-9, 0.1], 0).e[0]
    assert e == pytest.approx(np.array([[0.0, 0.0, 1.0]] * 3), abs=1e-12)


def test_a_circle_in_rational_form_keeps_its_curvature() -> None:
    """A quarter of a cylinder of radius 5: |c / q| = 1/5 all along."""
    h = math.sqrt(0.5)
    knots = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    low = homogeneous([[5, 0, 0], [5, 5, 0], [0, 5, 0]], [1.0, h, 1.0])
    high = homogeneous([[5, 0, 7], [5, 5, 7], [0, 5, 7]], [1.0, h, 1.0])
    frame = spline_strip(2, knots, low, high).frame(np.linspace(0.0, 1.0, 9))
    assert np.abs(frame.c / frame.q) == pytest.approx(0.2, rel=1e-12)
    assert frame.a == pytest.approx(0.0, abs=1e-14)
