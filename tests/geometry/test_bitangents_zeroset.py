"""The zero set of a function of two parameters, against curves known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from devcad.geometry import taylor
from devcad.geometry.bitangents.zeroset import Grid, Unresolved, branches


class Polynomial:
    """f(s, t) by Taylor series: what the tracer asks of a function."""

    def __init__(self, f):
        self.f = f

    def towards(self, s, t, ds, dt, order):
        x = taylor.variable(s, order), taylor.variable(t, order)
        if order:
            x[0][1], x[1][1] = ds, dt
        return self.f(*x)

    def value(self, s, t):
        return self.towards(s, t, 1.0, 0.0, 0)[0]

    def slopes(self, s, t):
        one, two = self.towards(s, t, 1.0, 0.0, 1), self.towards(s, t, 0.0, 1.0, 1)
        return one[0], np.column_stack([one[1], two[1]])

    def bends(self, s, t):
        one, two = self.towards(s, t, 1.0, 0.0, 2), self.towards(s, t, 0.0, 1.0, 2)
        mixed = self.towards(s, t, 1.0, 1.0, 2)[2] - one[2] - two[2]
        hessian = np.moveaxis(np.array([[2 * one[2], mixed], [mixed, 2 * two[2]]]), 2, 0)
        return one[0], np.column_stack([one[1], two[1]]), hessian


def traced(f, lines=41, period=0.0, low=-1.02, high=1.0):
    height = Polynomial(f)
    s, t = np.linspace(low, high, lines), np.linspace(low, high + 0.013, lines + 2)
    if period:
        s, t = (low + period * np.linspace(0, 1, n) for n in (lines, lines + 2))
    values = height.value(np.repeat(s, len(t)), np.tile(t, len(s))).reshape(len(s), len(t))
    return branches(height, Grid(s, t, values, (period, period)))


def product(*factors):
    out = factors[0]
    for factor in factors[1:]:
        out = taylor.mul(out, factor)
    return out


def minus(x, value):
    out = x.copy()
    out[0] -= value
    return out


def test_a_circle_is_one_closed_branch():
    (branch,) = traced(lambda s, t: minus(product(s, s) + product(t, t), 0.49))
    assert branch.closed
    np.testing.assert_allclose(np.hypot(*branch.places.T), 0.7, atol=1e-6)


def test_branches_end_at_the_sides():
    (branch,) = traced(lambda s, t: minus(product(s, s), 0.1) - t)
    assert not branch.closed
    s, t = branch.places.T
    np.testing.assert_allclose(t, s * s - 0.1, atol=1e-6)
    np.testing.assert_allclose(np.sort([s[0], s[-1]]), [-1.02, 1.0], atol=1e-6)


def test_two_circles_that_cross_stay_two_circles():
    # centres 0.6 apart: two nodes, where both go straight on
    def f(s, t):
        one = minus(product(minus(s, -0.3), minus(s, -0.3)) + product(t, t), 0.25)
        other = minus(product(minus(s, 0.3), minus(s, 0.3)) + product(t, t), 0.25)
        return product(one, other)

    found = traced(f)
    assert [branch.closed for branch in found] == [True, True]
    centres = []
    for branch in found:
        assert len(branch.nodes) == 2
        for node in branch.nodes.values():
            np.testing.assert_allclose(np.abs(node.place), [0.0, 0.4], atol=1e-9)
        centres.append(0.5 * (branch.places[:, 0].min() + branch.places[:, 0].max()))
        np.testing.assert_allclose(
            np.hypot(branch.places[:, 0] - round(centres[-1], 1), branch.places[:, 1]),
            0.5,
            atol=1e-6,
        )
    np.testing.assert_allclose(sorted(centres), [-0.3, 0.3], atol=0.01)


def test_three_lines_through_a_point_stay_lines():
    found = traced(lambda s, t: product(s, s - 2.0 * t, s + 2.0 * t))
    slopes = sorted(float(np.median(b.places[:, 0] / b.places[:, 1])) for b in found)
    np.testing.assert_allclose(slopes, [-2.0, 0.0, 2.0], atol=1e-6)
    assert all(len(b.nodes) == 1 and b.nodes.popitem()[1].directions.shape == (3, 2) for b in found)


def test_arcs_that_nearly_meet_keep_apart():
    # s t = 1e-6: two branches of a hyperbola, closer than a cell
    found = traced(lambda s, t: minus(product(s, t), 1e-6))
    assert len(found) == 2
    for branch in found:
        assert (np.sign(branch.places) == np.sign(branch.places[0])).all()


def test_a_branch_round_a_torus_is_closed():
    # sin(s - 2 t) = 0: two windings, each twice round in s and once in t
    def f(s, t):
        return taylor.sin_cos(s - 2.0 * t)[0]

    found = traced(f, lines=60, period=2 * np.pi, low=0.1)
    assert [branch.closed for branch in found] == [True, True]
    for branch in found:
        around = np.abs(branch.places[-1] - branch.places[0])
        np.testing.assert_allclose(around, [4 * np.pi, 2 * np.pi], atol=1e-5)


def test_nodes_closer_than_the_grid_ask_for_a_finer_one():
    def f(s, t):
        return product(s, minus(product(t, t), 1e-4))

    with pytest.raises(Unresolved):
        traced(f)
    assert len(traced(f, lines=801)) == 3
