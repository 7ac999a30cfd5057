"""Tips and turning rails: frames, classification, clearance and chains against closed forms."""

import numpy as np
import pytest
from patches import cosine_cylinder, frustum, gore, helix_tangent, lens, oloid, sphericon, wall

from devcad.errors import GeometryError, JobError
from devcad.geometry import jets, taylor
from devcad.geometry.chain import cut_at, link, with_gap
from devcad.geometry.classify import classify
from devcad.geometry.constructions.base import strip
from devcad.geometry.curve import Curve
from devcad.geometry.deflation import vanishing
from devcad.geometry.layers import layer_gaps
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.regularity import clearance, singularities, smallest_radius, twist

DISTANCES = 10.0 ** np.arange(-12.0, 0.0)  # from a tip, as shares of the domain
ROUNDING = 1e-15  # frames of unit size, beside and beyond the place where the series takes over


def near_both_ends(patch):
    low, high = patch.domain
    step = DISTANCES * (high - low)
    return np.concatenate([[low], low + step, (high - step)[::-1], [high]])


def test_the_frame_of_a_parabolic_cylinder_goes_on_into_its_round_tips():
    patch = cosine_cylinder()
    t = near_both_ends(patch)
    frame = patch.frame(t)
    x, speed = np.cos(t), np.sin(t)
    slope = np.sqrt(1.0 + 16.0 * x**2)  # z = 2 x^2 - 1, run towards -x
    zero = np.zeros_like(x)
    normal = np.stack([4.0 * x, zero, -np.ones_like(x)], axis=1) / slope[:, None]
    np.testing.assert_allclose(frame.n, normal, rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(frame.q, speed * slope, rtol=0.0, atol=2 * ROUNDING)
    np.testing.assert_allclose(frame.p, -np.cos(t), rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(frame.a, 0.0, atol=ROUNDING)
    np.testing.assert_allclose(frame.c, -4.0 * speed / slope**2, rtol=0.0, atol=ROUNDING)
    # what vanishes keeps its leading digits, so that the curvature can be read
    near = (DISTANCES.size, DISTANCES.size - 1)
    np.testing.assert_allclose(
        frame.c[1 : near[0]] / frame.q[1 : near[0]], (-4.0 / slope**3)[1 : near[0]], rtol=1e-13
    )


def test_the_series_of_the_frame_go_on_into_a_round_tip():
    t = np.array([0.0, 1e-9, 1e-3, 0.05, 0.3])
    jet = cosine_cylinder().frame_jet(t, 6)
    x = taylor.variable(t, 6)
    sin, cos = taylor.sin_cos(x)
    square = 16.0 * taylor.mul(cos, cos)
    square[0] += 1.0
    expected = -4.0 * taylor.div(sin, square)
    # the seventh derivative of the normal beside the tip: seven powers of an eighth at 0.3
    np.testing.assert_allclose(jet.c, expected, rtol=0.0, atol=2e-9)
    np.testing.assert_allclose(jet.c[:3], expected[:3], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("distance", DISTANCES)
def test_a_lens_of_a_tangent_surface_has_the_frame_of_the_whole(distance):
    whole = helix_tangent(3.0, 4.0, 10.0)
    cut = lens(whole, (5.0, 2.0), (3.0, 0.5))
    t = np.array([np.pi * distance, np.pi * (1.0 - distance)])
    frame, true = cut.frame(t), whole.frame(5.0 - 3.0 * np.cos(t))
    pace = 3.0 * np.sin(t)
    np.testing.assert_allclose(frame.n, true.n, rtol=0.0, atol=4 * ROUNDING)
    for name in ("a", "c", "p", "q"):
        found, expected = getattr(frame, name), pace * getattr(true, name)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=4 * ROUNDING)


def test_a_round_tip_is_found_and_nothing_else():
    assert vanishing(cosine_cylinder().field, 0.0, np.pi) == (True, True)
    assert vanishing(cosine_cylinder().field, 0.0, 2.0) == (True, False)
    for patch in (gore(), frustum(), helix_tangent(), *oloid(), *sphericon()):
        assert vanishing(patch.field, *patch.domain) == (False, False)


def test_a_round_tip_is_met_even_where_high_derivatives_are_noise():
    exact = cosine_cylinder()

    def field(t, order):  # as of a piecewise polynomial: nothing left from the fifth on
        jet = exact.field(t, order)
        noise = np.zeros_like(jet.c0)
        noise[5:] = 50.0 ** np.arange(order - 4)[: max(order - 4, 0), None, None]
        return RulingJet(jet.c0 + noise, jet.e, jet.v_from, jet.v_to)

    patch = Patch(field, exact.domain)
    t = near_both_ends(patch)
    found, true = patch.frame(t), exact.frame(t)
    # values at least 6e-4 of the domain from the end, divided by that distance
    np.testing.assert_allclose(found.n, true.n, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(found.c, true.c, rtol=0.0, atol=1e-8)


def test_the_parallel_of_a_round_tip_has_the_same_normals():
    patch = cosine_cylinder()
    t = near_both_ends(patch)
    np.testing.assert_allclose(
        patch.parallel(0.1).frame(t).n, patch.frame(t).n, rtol=0.0, atol=1e-14
    )


@pytest.mark.parametrize(
    ("patch", "kind", "radius", "half_angle"),
    [
        (gore(), "cylinder", 100.0, None),
        (lens(frustum(80.0, 80.0, 100.0), (3.0, 60.0), (1.0, 40.0)), "cylinder", 80.0, None),
        (lens(frustum(), (3.0, 60.0), (1.0, 40.0)), "cone", None, np.arctan2(50.0, 120.0)),
        (cosine_cylinder(), "cylinder", None, None),
        (lens(helix_tangent(), (5.0, 2.0), (3.0, 0.5)), "tangent", None, None),
        (
            lens(wall(np.zeros(3), np.array([9.0, 0, 0]), 5.0), (0.5, 2.0), (0.3, 1.0)),
            "plane",
            *2 * [None],
        ),
    ],
)
def test_a_tip_does_not_hide_what_the_surface_is(patch, kind, radius, half_angle):
    shape = classify(patch)
    assert shape.type == kind
    assert shape.radius == (None if radius is None else pytest.approx(radius, rel=1e-9))
    assert shape.half_angle == (None if half_angle is None else pytest.approx(half_angle, rel=1e-9))
    assert np.degrees(twist(patch).value) <= 1e-6  # rounding over the smallest width read


def test_clearance_at_a_round_tip_is_the_distance_to_the_regression_curve():
    assert clearance(cosine_cylinder(), (0.0,)).value == np.inf
    cut = lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 30.0), (30.0, 15.0))
    assert clearance(cut, (0.0,)).value == pytest.approx(15.0, rel=1e-9)
    # v from the edge: the layer at d is singular at v = d tau / k = 4 d / 3
    assert clearance(cut, (-0.5, 0.5)).value == pytest.approx(15.0 - 0.5 * 4.0 / 3.0, rel=1e-6)
    assert smallest_radius(cosine_cylinder()).value == pytest.approx(0.25, rel=1e-9)  # z'' = 4


def test_a_turning_rail_touches_the_regression_curve_and_crosses_nothing():
    for patch in oloid():  # of every quarter, A turns at one end and B at the other
        found = clearance(patch, (0.0,))
        assert found.value == 0.0
        assert found.touches
        assert found.t in patch.domain
        assert clearance(patch, (-0.01, 0.01)).value < 0.0


def test_a_lens_over_the_regression_curve_is_refused():
    crossing = lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 10.0), (30.0, 15.0))
    found = clearance(crossing, (0.0,))
    assert found.value == pytest.approx(-5.0, rel=1e-6)
    assert not found.touches


def test_a_singular_ruling_of_some_length_is_no_tip():
    patch = cosine_cylinder()

    def longer(t, order):
        jet = patch.field(t, order)
        return RulingJet(jet.c0, jet.e, jet.v_from, jet.v_to + taylor.constant(0.5, order, t.size))

    found = clearance(Patch(longer, patch.domain), (0.0,))
    assert not found.value > 0.0
    assert not found.touches


def test_the_oloid_has_four_patches_of_one_tube():
    chain = link(oloid(), base_closed=True, tolerance=1e-6)
    assert chain.closed
    assert all(joint.smooth for joint in (*chain.joints, chain.closing))
    for patch in chain.patches:
        jet = patch.jet(np.linspace(*patch.domain, 33), 1)
        np.testing.assert_allclose(jet.v_to[0] - jet.v_from[0], np.sqrt(3.0), rtol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(jet.e[0], axis=1), 1.0, rtol=1e-12)
        assert np.degrees(twist(patch).value) < 1e-8
        assert len(singularities(patch, classify(patch))) == 1


def test_a_cut_does_not_merge_patches_where_a_rail_turns():
    whole = link(oloid(), base_closed=True, tolerance=1e-6)
    assert len(cut_at(whole, 0.8).patches) == 5
    ball = link(sphericon(), base_closed=True, tolerance=1e-6)
    assert len(cut_at(ball, 0.8).patches) == 5
    plain = link((frustum(),), base_closed=True, tolerance=1e-6)
    assert len(cut_at(plain, 0.8).patches) == 1
    for chain in (whole, ball):
        assert cut_at(chain, 0.8).closed
        assert not with_gap(chain, 0.1).closed


def test_layers_of_a_sphericon_do_not_meet_and_those_of_a_cone_do():
    ball = link(sphericon(), base_closed=True, tolerance=1e-6)
    # the apex cone's layer ends d off the axis, the other's d along n: sqrt(2) d cos 45 apart
    assert min(layer_gaps(ball, (-0.1, 0.1))) == pytest.approx(0.1, rel=1e-6)
    cone = link((frustum(100.0, 0.0),), base_closed=True, tolerance=1e-6)
    assert max(layer_gaps(cone, (-1.0, 1.0))) <= 1e-10


def test_patches_that_meet_in_a_point_are_no_chain():
    halves = (
        cosine_cylinder((1, 2, 3), (0.0, 0.5 * np.pi)),
        cosine_cylinder((1, 2, 3), (0.5 * np.pi, np.pi)),
    )
    with pytest.raises(GeometryError, match="meet in a point"):
        link(halves, base_closed=False, tolerance=0.05)


def test_strips_have_tips_where_they_may():
    def line(t, order):
        x = taylor.variable(t, order)
        return np.stack([x, 0.0 * x, 0.0 * x], axis=-1)

    def rays(t, order):
        return line(t, order), taylor.constant_vector([0.0, 1.0, 0.0], order, t.size), None

    piece = Curve(line, (0.0, np.pi))
    lune = (jets.parse("-sin(t)"), jets.parse("sin(t)"))
    assert strip(piece, rays, lune, tips=True).domain == (0.0, np.pi)
    with pytest.raises(JobError, match="not below"):
        strip(piece, rays, lune)
    with pytest.raises(JobError, match="not below"):
        strip(piece, rays, (jets.parse("-sin(2*t)"), jets.parse("sin(2*t)")), tips=True)
    with pytest.raises(JobError, match="not below"):  # a waist without width is no tip
        strip(piece, rays, (jets.parse("0"), jets.parse("cos(t)**2")), tips=True)
