"""The development against closed forms, to 1e-12 with at most 200 parameters."""

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent, prism, slanted_pipe

from devcad.flatten.bend import bent
from devcad.flatten.blank import lay_flat
from devcad.flatten.development import develop, develop_chain
from devcad.flatten.fold import fold, fold_chain
from devcad.flatten.green import enclosed_area, perimeter
from devcad.flatten.outline import lay_out, surface_area
from devcad.flatten.verify import fold_back, isometry, overlap_area
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.patch import Patch, RulingJet

PARTS = {
    "frustum": frustum(),
    "cone": frustum(100.0, 0.0),
    "helix": helix_tangent(),
    "ellipse": ellipse_cylinder(),
    "pipe": slanted_pipe(),
}


def pattern_of(patch):
    chain = Chain((patch,))
    return lay_out(chain, develop_chain(chain), (np.array(patch.domain),))


def test_helix_tangent_surface_is_an_annulus_of_radius_a2_plus_b2_over_a():
    d = develop(helix_tangent())
    assert d.series.samples <= 200
    end = d.points(np.array([10.0]), np.array([0.0]))[0]
    # oracle O09 starts with its tangent along +x, as does the pattern
    np.testing.assert_allclose(end, [7.766992383060219, 5.313685379361053], rtol=1e-12)
    t = np.linspace(0, 10, 41)
    radius = np.linalg.norm(d.points(t, np.full(41, 2.0)) - [0.0, 25 / 3], axis=1)
    np.testing.assert_allclose(radius, np.hypot(25 / 3, 2.0), rtol=1e-13)


def test_frustum_is_a_sector_of_radii_130_and_260():
    d = develop(frustum())
    assert d.series.samples <= 200
    turning = abs(d.series(np.array([2 * np.pi]))[0, 0])
    assert turning == pytest.approx(2.4166097335306103, rel=1e-13)  # O49
    t = np.linspace(0, 2 * np.pi, 33)
    apex = np.array([260.0, 0.0])
    np.testing.assert_allclose(np.linalg.norm(d.origin(t) - apex, axis=1), 260.0, rtol=1e-13)
    assert surface_area(frustum()) == pytest.approx(61261.05674500097, rel=1e-13)


def test_ellipse_unrolls_to_its_perimeter():
    d = develop(ellipse_cylinder())
    assert d.series.samples <= 200
    np.testing.assert_allclose(
        d.origin(np.array([2 * np.pi]))[0], [0.0, 15.86543958929059], rtol=1e-12, atol=1e-12
    )  # O03


def test_mitred_pipe_ends_in_a_cosine_of_known_length():
    pattern = pattern_of(slanted_pipe())
    assert pattern.area == pytest.approx(1256.6370614359173, rel=1e-12)  # O48
    (top,) = [edge for edge in pattern.outline if edge.name == "top"]
    s = top.curve(np.linspace(0, 2 * np.pi, 51))[0]
    np.testing.assert_allclose(s[:, 0], 20 + 10 * np.cos(s[:, 1] / 10), atol=1e-12)
    assert perimeter((top,)) == pytest.approx(76.40395578055424, rel=1e-12)


@pytest.mark.parametrize("name", PARTS)
def test_green_area_of_the_pattern_is_the_area_of_the_surface(name):
    pattern = pattern_of(PARTS[name])
    assert enclosed_area(pattern.outline) == pytest.approx(pattern.area, rel=1e-12)


@pytest.mark.parametrize("name", PARTS)
def test_the_outline_is_one_closed_run(name):
    outline = pattern_of(PARTS[name]).outline
    ends = np.array([edge.curve(edge.u[[0, -1]])[0] for edge in outline])
    np.testing.assert_allclose(ends[:, 1], np.roll(ends[:, 0], -1, axis=0), atol=1e-11)


@pytest.mark.parametrize("name", PARTS)
def test_metric_and_fold_back_hold_to_rounding(name):
    patch = PARTS[name]
    chain = Chain((patch,))
    developments = develop_chain(chain)
    assert isometry(patch, developments[0]).value < 1e-10
    worst, size = fold_back(chain, developments)
    assert worst.value < 1e-12 * size


def test_isometry_sees_a_pattern_that_is_off_by_one_in_a_million():
    patch = helix_tangent()
    wrong = develop(patch.scaled(1.0 + 1e-6))
    assert isometry(patch, wrong).value == pytest.approx(2e-6, rel=0.2)


def test_fold_back_sees_bending_of_the_wrong_sign():
    patch = helix_tangent()
    (right,) = develop_chain(Chain((patch,)))
    (wrong,) = develop_chain(Chain((helix_tangent(rise=-4.0),)))
    frame = patch.frame([0.0])
    t = np.array([10.0])
    v = np.array([2.0])
    for development, distance in ((right, 1e-12), (wrong, None)):
        (folded,) = fold_chain((development,), Chain((patch,)), frame, 1.0)
        away = np.linalg.norm(folded.points(t, v) - patch.point(t, v))
        assert away < distance if distance else away > 0.1


def test_bending_a_helix_surface_half_gives_the_helix_of_half_the_torsion():
    patch = helix_tangent()
    chain = Chain((patch,))
    (half,) = bent(lay_flat(chain), 0.5).patches
    t = np.linspace(0.5, 9.5, 7)
    f = half.frame(t)
    np.testing.assert_allclose(f.a, 0.12, rtol=1e-11)  # O54: curvature stays
    np.testing.assert_allclose(f.c, 0.08, rtol=1e-11)  # torsion halves
    radius, rise = 0.12 / (0.12**2 + 0.08**2), 0.08 / (0.12**2 + 0.08**2)
    assert radius == pytest.approx(5.769230769230769, rel=1e-12)
    angle = t / np.hypot(radius, rise)
    helix = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rise * angle])
    # congruent: equal distances between all pairs of points
    between = lambda x: np.linalg.norm(x[:, None] - x[None], axis=-1)  # noqa: E731
    np.testing.assert_allclose(between(f.c0), between(helix), atol=1e-11)
    assert surface_area(half) == pytest.approx(4.8, rel=1e-12)


def test_no_bending_leaves_a_plane_and_full_bending_the_part():
    patch = helix_tangent()
    chain = Chain((patch,))
    (flat,) = bent(lay_flat(chain), 0.0).patches
    t = np.linspace(0.5, 9.5, 5)
    np.testing.assert_allclose(flat.frame(t).n, np.tile(flat.frame(t).n[0], (5, 1)), atol=1e-13)
    (whole,) = bent(lay_flat(chain), 1.0).patches
    v = np.full(5, 2.0)
    np.testing.assert_allclose(whole.point(t, v), patch.point(t, v), atol=1e-12)
    order = 2
    np.testing.assert_allclose(whole.jet(t, order).e, patch.jet(t, order).e, atol=1e-12)


def test_a_square_duct_unrolls_to_four_rectangles_with_three_bends():
    corners = np.array([[0, 0], [40, 0], [40, 30], [0, 30]], dtype=float)
    chain = link(prism(corners, 50.0), base_closed=True, tolerance=0.05)
    assert [round(float(np.degrees(j.angle))) for j in chain.joints] == [90, 90, 90]
    assert chain.closed
    developments = develop_chain(chain)
    pattern = lay_out(chain, developments, tuple(np.array([0.0, 1.0]) for _ in range(4)))
    np.testing.assert_allclose(pattern.bbox, (0, 0, 50, 140), atol=1e-12)
    assert [line.layer for line in pattern.lines] == ["BEND_UP"] * 3
    np.testing.assert_allclose([line.start[1] for line in pattern.lines], [40, 70, 110], atol=1e-12)
    worst, _ = fold_back(chain, developments)
    assert worst.value < 1e-12


def test_collocation_is_exact_for_many_turns():
    patch = frustum(10.0, 10.0, 5.0, sweep=200.0)
    (d,) = develop_chain(Chain((patch,)))
    f = patch.frame([0.0])
    folded = fold(d, np.column_stack([f.e[0], f.m[0], f.n[0], f.c0[0]]), 1.0)
    t = np.linspace(0, 200, 501)
    assert (
        np.abs(folded.points(t, 0 * t) - patch.point(t, 0 * t)).max() < 2e-9
    )  # 1e-12 of the pattern's 2 m


@pytest.mark.slow
def test_overlap_of_a_flat_spiral_is_measured_and_a_simple_sector_has_none():
    # a developed cone sector of 3 pi: the part beyond 2 pi lies on the part before
    wide = frustum(100.0, 50.0, 1e-4, sweep=3 * np.pi)
    area = overlap_area(pattern_of(wide))
    assert area == pytest.approx(np.pi / 2 * (100**2 - 50**2), rel=2e-3)  # polygon of 96 steps
    assert overlap_area(pattern_of(frustum())) == 0.0
    assert overlap_area(pattern_of(frustum(100.0, 50.0, 1e-4))) == 0.0  # 2 pi: edges touch


def test_fold_back_holds_where_the_bending_jumps():
    # a plane that becomes a cylinder at t = 1: c jumps from 0 to 1 / r at a break
    def field(t, order):
        late = t > 1.0
        angle = taylor.variable(np.where(late, t - 1.0, 0.0) / 2.0, order)
        angle[1:] *= 0.5
        sin, cos = taylor.sin_cos(angle)
        straight = taylor.variable(t, order)
        straight[0] -= 1.0
        x = np.where(late, 2.0 * sin, straight)
        y = np.where(late, -2.0 * cos, 0.0 * straight)
        y[0] += np.where(late, 2.0, 0.0)
        return RulingJet(
            np.stack([x, y, 0.0 * x], axis=-1),
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(1.0, order, t.size),
        )

    chain = Chain((Patch(field, (0.0, 3.0), (1.0,)),))
    worst, _ = fold_back(chain, develop_chain(chain))
    assert worst.value < 1e-13


def test_a_base_curve_that_is_only_rounding_costs_nothing():
    # the apex of a flat cone moved along a constant normal: p and q are rounding, not a function
    cone = frustum(100.0, 0.0, 1e-12).parallel(0.7).restricted(0.0, 2.0)
    assert develop(cone).series.samples <= 200
