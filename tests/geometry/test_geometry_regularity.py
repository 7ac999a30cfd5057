"""Twist, clearance, singular points and types against closed forms."""

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent, hyperboloid

from devcad.geometry import taylor
from devcad.geometry.classify import classify
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.regularity import clearance, singularities, smallest_radius, twist

MIDDLE = (0.0,)


def tangent_surface(curve, domain, extent):
    """The tangent surface of a polynomial curve given as coefficients per coordinate."""

    def field(t, order):
        x = np.stack(
            [sum(c * power(t, order + 1, k) for k, c in enumerate(row)) for row in curve], axis=-1
        )
        e = taylor.unit(taylor.derivative(x))
        n = t.size
        return RulingJet(
            x[: order + 1],
            e,
            taylor.constant(extent[0], order, n),
            taylor.constant(extent[1], order, n),
        )

    return Patch(field, domain)


def power(t, order, k):
    out = taylor.constant(1.0, order, t.size)
    for _ in range(k):
        out = taylor.mul(out, taylor.variable(t, order))
    return out


def test_hyperboloid_twists_by_the_arctangents_of_its_distribution_parameter():
    # tan(angle from the striction line) = v / p with p = -1 for the ruling (-sin, cos, 1) / sqrt 2
    reach = 0.5
    expected = 2 * np.arctan(reach)  # p of the unit ruling: det / |e'|^2 = -1
    assert twist(hyperboloid(reach)).value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("patch", [frustum(), helix_tangent(), ellipse_cylinder(), frustum(9, 0)])
def test_developables_do_not_twist(patch):
    assert twist(patch).value < 1e-11


def test_crossing_the_regression_curve_is_no_twist_but_a_negative_clearance():
    patch = helix_tangent(extent=(-1.0, 3.0))
    assert twist(patch).value < 1e-12
    found = clearance(patch, MIDDLE)
    assert found.value == pytest.approx(-1.0, rel=1e-12)
    assert not found.touches


def test_touching_is_told_from_crossing_and_from_keeping_clear():
    assert clearance(helix_tangent(extent=(0.0, 3.0)), MIDDLE).touches
    clear = clearance(helix_tangent(extent=(1.0, 3.0)), MIDDLE)
    assert clear.value == pytest.approx(1.0, rel=1e-12)


def test_the_skins_of_a_helicoid_sheet_are_singular_at_q_plus_v_a_equal_d_c():
    # d c / a = 0.5 * 0.16 / 0.12: the inner skin's edge lies that far out
    found = clearance(helix_tangent(), (-0.5, 0.5))
    assert found.value == pytest.approx(1.0 - 0.5 * 0.16 / 0.12, rel=1e-12)


def test_an_inflection_of_the_curve_turns_the_front_over():
    planar = tangent_surface(([0, 1], [0, 0, 0, 1], [0, 0, 0, 0, 1]), (-1.0, 1.0), (0.5, 1.0))
    found = clearance(planar, MIDDLE)
    assert found.value == 0.0
    assert not found.touches
    assert abs(found.t) < 0.1


def test_smallest_radius_of_a_frustum_lies_at_its_narrow_end():
    # r / cos(half angle), half angle with tan = 50 / 120
    assert smallest_radius(frustum()).value == pytest.approx(50 * 130 / 120, rel=1e-12)
    assert smallest_radius(ellipse_cylinder()).value == pytest.approx(4 / 3, rel=1e-9)


def test_a_flat_triangle_has_no_radius_even_at_the_corner_where_its_rulings_meet():
    """Between (0, 100, 0), (-125, 100, 0) and the corner (0, 80, 220): a plane, whatever rounding
    makes of c there."""
    apex = np.array([0.0, 80.0, 220.0])
    start, along = np.array([0.0, 100.0, 0.0]), np.array([-125.0, 0.0, 0.0])

    def field(t, order):
        side = np.zeros((order + 1, t.size, 3))
        side[0] = start + t[:, None] * along - apex
        if order:
            side[1] = along
        length = taylor.norm(side)
        return RulingJet(
            taylor.constant_vector(apex, order, t.size),
            taylor.unit(side),
            taylor.constant(0.0, order, t.size),
            length,
        )

    assert smallest_radius(Patch(field, (0.0, 1.0))).value == np.inf


def test_types_and_numbers_of_the_classical_surfaces():
    cone = classify(frustum())
    assert (cone.type, cone.analytic) == ("cone", True)
    np.testing.assert_allclose(cone.point, [0, 0, 240], atol=1e-11)
    assert cone.half_angle == pytest.approx(np.arctan(50 / 120), rel=1e-13)
    np.testing.assert_allclose(cone.axis, [0, 0, -1], atol=1e-14)
    pipe = classify(frustum(40, 40))
    assert pipe.radius == pytest.approx(40.0, rel=1e-14)
    assert classify(frustum(40, 20, 1e-9)).type == "plane"
    assert classify(ellipse_cylinder()).type == "cylinder"
    assert not classify(ellipse_cylinder()).analytic
    assert classify(helix_tangent()).type == "tangent"


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e5])
def test_types_do_not_depend_on_scale(size):
    assert classify(frustum().scaled(size)).type == "cone"
    assert classify(helix_tangent().scaled(size)).type == "tangent"


def test_cuspidal_crosscap_where_the_torsion_vanishes():
    # torsion of (t, t^2, t^4) is proportional to t: a crosscap at t = 0 with delta = 1
    patch = tangent_surface(([0, 1], [0, 0, 1], [0, 0, 0, 0, 1]), (-0.5, 0.6), (0.0, 1.0))
    kinds = {s.type: s for s in singularities(patch, classify(patch))}
    assert set(kinds) == {"cuspidal-edge", "cuspidal-crosscap"}
    assert kinds["cuspidal-crosscap"].t == pytest.approx(0.0, abs=1e-9)


def test_apex_is_the_only_singular_point_of_a_cone():
    patch = frustum()
    (apex,) = singularities(patch, classify(patch))
    assert apex.type == "apex"
    np.testing.assert_allclose(apex.point, [0, 0, 240], atol=1e-10)
