"""Patterns with tips and with rails that turn, against closed forms."""

import numpy as np
import pytest
from patches import (
    cosine_cylinder,
    ellipse_cylinder,
    frustum,
    gore,
    helix_tangent,
    lens,
    oloid,
    sphericon,
    wall,
)
from scipy.integrate import quad
from scipy.special import ellipe

from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.bend import bent
from devcad.flatten.blank import lay_flat
from devcad.flatten.development import develop, develop_chain
from devcad.flatten.edges import closes_smoothly, smooth_edges
from devcad.flatten.green import enclosed_area, perimeter
from devcad.flatten.outline import lay_out, surface_area
from devcad.flatten.polylines import polyline_outline
from devcad.flatten.verify import fold_back, isometry, overlap_area
from devcad.geometry.chain import Chain, cut_at, link

LENSES = {
    "plane": lens(wall(np.zeros(3), np.array([100.0, 0.0, 0.0]), 50.0), (0.5, 20.0), (0.4, 10.0)),
    "cylinder": lens(frustum(80.0, 80.0, 100.0), (3.0, 60.0), (1.0, 40.0)),
    "ellipse": lens(ellipse_cylinder(60.0, 40.0, 50.0), (2.0, 25.0), (1.5, 20.0)),
    "cone": lens(frustum(), (3.0, 60.0), (1.0, 40.0)),
    "tangent": lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 30.0), (30.0, 15.0)),
    "parabola": cosine_cylinder().scaled(100.0),
    "cubic": cosine_cylinder((1, 2, 3), (0.0, 0.5 * np.pi)).scaled(100.0),
}


def pattern_of(chain):
    chain = chain if isinstance(chain, Chain) else Chain((chain,))
    ends = tuple(np.array(patch.domain) for patch in chain.patches)
    return lay_out(chain, develop_chain(chain), ends)


def oloid_chain(radius=100.0):
    return link(oloid(radius=radius), base_closed=True, tolerance=1e-6)


@pytest.mark.parametrize("number", [3, 4, 12, 36])
def test_a_gore_has_its_area_length_and_seams(number):
    radius, half = 100.0, np.pi / number
    patch = gore(radius, number)
    pattern = pattern_of(patch)
    assert pattern.area == pytest.approx(4.0 * radius**2 * np.tan(half), rel=1e-13)
    assert enclosed_area(pattern.outline) == pytest.approx(pattern.area, rel=1e-12)
    assert [edge.name for edge in pattern.outline] == ["top", "base"]
    # the seam is half an ellipse with semi-axes R and R / cos(pi / N)
    seam = 2.0 * radius / np.cos(half) * ellipe(np.sin(half) ** 2)
    for edge in pattern.outline:
        assert perimeter((edge,)) == pytest.approx(seam, rel=1e-12)
    assert np.ptp(pattern.bbox[1::2]) == pytest.approx(np.pi * radius, rel=1e-13)
    assert len(smooth_edges(pattern.outline)) == 2  # sharp at both tips
    loop = fit_outline(pattern.outline, 0.005)
    for tip in (0.0, np.pi * radius):
        assert np.abs(loop.points - [0.0, tip]).max(axis=1).min() <= 1e-10 * radius


@pytest.mark.parametrize("name", LENSES)
def test_a_round_tip_leaves_a_smooth_outline_of_one_run(name):
    pattern = pattern_of(LENSES[name])
    assert [edge.name for edge in pattern.outline] == ["top", "base"]
    edges = smooth_edges(pattern.outline)
    assert len(edges) == 1
    assert closes_smoothly(edges) == (name != "cubic")  # which is sharp where its chords cross
    loop = fit_outline(pattern.outline, 0.01)
    assert loop.deviation <= 0.01
    assert loops.turning(loop) == pytest.approx(1.0, abs=1e-6)
    assert loops.area(loop) == pytest.approx(pattern.area, abs=0.01 * loops.perimeter(loop))
    before, after = loop.bulges, np.roll(loop.bulges, -1)
    chord = np.roll(loop.points, -1, axis=0) - loop.points
    heading = np.arctan2(chord[:, 1], chord[:, 0])
    half = loops.half_sweeps(before)
    # every arc leaves in the direction in which the one before arrives
    corner = np.roll(heading, -1) - loops.half_sweeps(after) - heading - half
    smooth = corner[:-1] if name == "cubic" else corner
    np.testing.assert_allclose(np.sin(smooth), 0.0, atol=1e-9)
    assert polyline_outline(pattern.outline, 0.01).deviation <= 0.01


@pytest.mark.parametrize("name", LENSES)
def test_patches_with_round_tips_unroll_and_fold_back(name):
    patch = LENSES[name]
    chain = Chain((patch,))
    developments = develop_chain(chain)
    assert isometry(patch, developments[0]).value <= 1e-11  # differences of order 8
    worst, size = fold_back(chain, developments)
    assert worst.value <= 1e-13 * size
    half = bent(lay_flat(chain), 0.5)
    assert surface_area(half.patches[0]) == pytest.approx(surface_area(patch), rel=1e-12)
    assert overlap_area(pattern_of(patch)) == 0.0


def test_lenses_have_the_area_of_their_ellipses():
    assert pattern_of(LENSES["plane"]).area == pytest.approx(np.pi * 40.0 * 10.0, rel=1e-13)
    assert pattern_of(LENSES["cylinder"]).area == pytest.approx(np.pi * 80.0 * 40.0, rel=1e-13)
    # on the flat annulus of the helix dA = k v ds dv
    k = 30.0 / 2500.0
    expected = k * 30.0 * np.pi * 30.0 * 15.0
    assert pattern_of(LENSES["tangent"]).area == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(
    ("name", "width", "slope", "low"),
    [
        ("parabola", lambda x: 2.0 * np.sqrt(1.0 - x * x), lambda x: 4.0 * x, -1.0),
        # y = sin 2t = 2 x sqrt(1 - x^2)
        ("cubic", lambda x: 4.0 * x * np.sqrt(1.0 - x * x), lambda x: 12.0 * x * x - 3.0, 0.0),
    ],
)
def test_bitangent_cylinders_have_the_area_of_their_quadrature(name, width, slope, low):
    value, _ = quad(
        lambda x: width(x) * np.hypot(1.0, slope(x)), low, 1.0, epsabs=1e-13, epsrel=1e-13
    )
    assert pattern_of(LENSES[name]).area == pytest.approx(1e4 * value, rel=1e-10)


def oloid_development(t):
    """A and the direction of its circle on the unit oloid's pattern (geometry.md, section 6)."""
    w = np.sin(0.5 * t)
    root = np.sqrt(1.0 + 2.0 * np.cos(t))
    theta = 2.0 * np.arcsin(2.0 * w / np.sqrt(3.0)) - np.arctan2(w, root)
    x = 2.0 * w * root + np.arcsin(2.0 * w / np.sqrt(3.0)) + np.arctan2(w, root)
    y = (8.0 * w**2 - 2.0 * np.log(np.cos(0.5 * t))) / (3.0 * np.sqrt(3.0))
    a = np.column_stack([2.0 / (3.0 * np.sqrt(3.0)) * x, y])
    space = np.column_stack([np.sin(t), -0.5 - np.cos(t)])
    other = 0.5 - np.cos(t) / (1.0 + np.cos(t))  # B lies over the plane's y axis
    along = np.cos(t) * (0.0 - space[:, 0]) + np.sin(t) * (other - space[:, 1])
    angle = theta + np.arccos(along / np.sqrt(3.0))
    return a, a + np.sqrt(3.0) * np.column_stack([np.cos(angle), np.sin(angle)])


def test_the_oloid_unrolls_to_its_closed_form():
    patch = oloid(0, 2)[1]  # chi from pi / 2, where A is half way: t = 0 of the closed form
    development = develop(patch)
    chi = np.linspace(0.5 * np.pi, np.pi, 33)[:-1]
    jet = patch.jet(chi, 0)
    t = np.abs(np.arctan2(jet.c0[0, :, 0], -0.5 - jet.c0[0, :, 1]))
    a, b = oloid_development(t)
    true = np.concatenate([a, b])
    found = np.concatenate([development.origin(chi), development.points(chi, jet.v_to[0])])
    apart = np.linalg.norm(true[:, None] - true, axis=2)
    np.testing.assert_allclose(
        np.linalg.norm(found[:, None] - found, axis=2), apart, rtol=0.0, atol=1e-12
    )
    end = development.origin(np.array([np.pi]))[0] - found[0]
    closed = np.hypot(
        2.0 * np.pi / (3.0 * np.sqrt(3.0)), (6.0 + np.log(4.0)) / (3.0 * np.sqrt(3.0))
    )
    assert np.linalg.norm(end) == pytest.approx(closed, abs=1e-12)


def test_the_oloids_pattern_breaks_where_a_rail_turns():
    chain = oloid_chain()
    pattern = pattern_of(chain)
    assert pattern.area == pytest.approx(4.0 * np.pi * 1e4, rel=1e-13)
    assert overlap_area(pattern) == 0.0
    # the start, the end, the base with one cusp and the top with two
    assert len(smooth_edges(pattern.outline)) == 7
    loop = fit_outline(pattern.outline, 0.005)
    assert abs(loops.area(loop) - pattern.area) <= 0.005 * loops.perimeter(loop)
    developments = develop_chain(chain)
    for number, side in ((2, 0), (1, 1), (3, 1)):  # patches that begin where a rail turns
        at = np.array(chain.patches[number].domain[:1])
        cusp = developments[number].points(at, np.array([side * 100.0 * np.sqrt(3.0)]))
        assert np.linalg.norm(loop.points - cusp, axis=1).min() <= 1e-10


@pytest.mark.parametrize("cut", [None, 0.4, 0.5 * np.pi, 3.0])
def test_an_oloid_opens_at_any_ruling(cut):
    chain = oloid_chain() if cut is None else cut_at(oloid_chain(), cut)
    developments = develop_chain(chain)
    pattern = pattern_of(chain)
    assert pattern.area == pytest.approx(4.0 * np.pi * 1e4, rel=1e-12)
    assert overlap_area(pattern) == 0.0
    worst, size = fold_back(chain, developments)
    assert worst.value <= 1e-12 * size
    assert (
        max(isometry(p, d).value for p, d in zip(chain.patches, developments, strict=True)) < 1e-11
    )


def test_a_sphericon_unrolls_to_four_sectors():
    chain = link(sphericon(50.0), base_closed=True, tolerance=1e-6)
    pattern = pattern_of(chain)
    assert pattern.area == pytest.approx(2.0 * np.sqrt(2.0) * np.pi * 2500.0, rel=1e-13)
    assert [edge.name for edge in pattern.outline] == ["start", "top", "top", "end", "base", "base"]
    assert overlap_area(pattern) == 0.0
    for development in develop_chain(chain):
        knots = development.series.knots
        turned = abs(np.diff(development.series(knots[[0, -1]])[:, 0])[0])
        assert turned == pytest.approx(np.pi / np.sqrt(2.0), rel=1e-12)
    loop = fit_outline(pattern.outline, 0.005)
    assert loop.exact
    assert loops.area(loop) == pytest.approx(pattern.area, rel=1e-9)


@pytest.mark.parametrize("factor", [1e-4, 1.0, 1e6])
@pytest.mark.parametrize("patch", [gore(), helix_tangent(30.0, 40.0, 100.0), LENSES["cone"]])
def test_folding_back_does_not_feel_the_unit_of_length(patch, factor):
    chain = Chain((patch.scaled(factor),))
    worst, size = fold_back(chain, develop_chain(chain))
    assert worst.value <= 1e-14 * size
