"""The neutral fibre against closed forms: bend allowance, parallel surfaces, flat annuli."""

from __future__ import annotations

import numpy as np
import pytest
from laying import circle
from patches import ellipse_cylinder, frustum, helix_tangent, slanted_pipe

from devcad.features import Cutout, Features, Placing
from devcad.flatten.bend import bent
from devcad.flatten.blank import lay_flat
from devcad.flatten.green import enclosed_area
from devcad.flatten.laying import laid
from devcad.flatten.neutral import Fibre, least_k, left_over
from devcad.flatten.outline import lay_out, sheet_area, surface_area
from devcad.flatten.verify import fold_back, isometry
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.layers import layer_points
from devcad.geometry.patch import Patch, RulingJet
from devcad.shop.fibre import constant, din6935, table

LAWS = {
    "k": constant(0.33),
    "din": din6935(),
    "table": table(((0.5, 0.3), (2.0, 0.4), (4.0, 0.45), (10.0, 0.5))),
}


def pattern_of(patch, law, thickness):
    blank = lay_flat(Chain((patch,)), Fibre(thickness, law))
    ends = (np.array(patch.domain),)
    return lay_out(blank.chain, blank.developments, ends, bending=(patch,))


def wave(height=4.0, oblique=0.0):
    """Cylinder over y = height sin x, x from -2 pi to 2 pi: it bends both ways by turns."""

    def field(t, order):
        x = taylor.variable(t, order)
        sin, _ = taylor.sin_cos(x)
        lift = oblique * x
        return RulingJet(
            np.stack([x, height * sin, lift], axis=-1),
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(10.0, order, t.size),
        )

    return Patch(field, (-2.0 * np.pi, 2.0 * np.pi))


def flat_then_bent(radius=10.0, oblique=0.3):
    """10 mm of plane, then a quarter of a cylinder, one patch; its edges slope by ``oblique``."""

    def field(t, order):
        s = taylor.variable(t, order)
        sin, cos = taylor.sin_cos(s / radius)
        arc = np.stack([radius * sin, -radius * cos], axis=-1)
        arc[0, :, 1] += radius
        line = np.stack([s, np.zeros_like(s)], axis=-1)
        plane = np.where((t > 0.0)[None, :, None], arc, line)
        return RulingJet(
            np.concatenate([plane, (oblique * s)[..., None]], axis=-1),
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(30.0, order, t.size),
        )

    return Patch(field, (-10.0, 0.5 * np.pi * radius), (0.0,))


@pytest.mark.parametrize("k", [0.0, 0.25, 0.33, 0.45])
@pytest.mark.parametrize("inside", [0.5, 3.0, 40.0])
def test_the_blank_of_a_bend_is_its_allowance_wide(k, inside):
    # BA = A (Ri + K T), every bend allowance table
    patch = frustum(inside + 1.0, inside + 1.0, 25.0, sweep=1.2)
    pattern = pattern_of(patch, constant(k), 2.0)
    assert pattern.area == pytest.approx(25.0 * 1.2 * (inside + k * 2.0), rel=1e-13)
    assert pattern.bbox[3] == pytest.approx(1.2 * (inside + k * 2.0), rel=1e-13)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(
    ("patch", "thickness"),
    [
        (frustum(30.0, 12.0, 20.0, 4.0), 2.0),
        (helix_tangent(), 0.15),
        (ellipse_cylinder(), 0.4),
        (slanted_pipe(), 2.0),
        (wave(), 0.3),
        (flat_then_bent(), 2.0),
    ],
    ids=["frustum", "helix", "ellipse", "pipe", "wave", "line-arc"],
)
def test_every_pattern_is_isometric_to_its_neutral_surface_and_folds_back(patch, thickness, law):
    chain = Chain((patch,))
    fibre = Fibre(thickness, LAWS[law])
    blank = lay_flat(chain, fibre)
    # two ways to the shift: the frame's bending here, the turning of the normal there
    pairs = zip(chain.patches, blank.developments, blank.fibres, strict=True)
    assert max(isometry(p, d, f).value for p, d, f in pairs) < 1e-11
    pattern = lay_out(blank.chain, blank.developments, (np.array(patch.domain),))
    worst, size = fold_back(chain, blank.developments, pattern, blank.fibres)
    assert worst.value < 1e-12 * size
    # the quadrature of the pattern's own q + v a against Green's formula along its edges
    assert enclosed_area(pattern.outline) == pytest.approx(pattern.area, rel=1e-12)


def test_the_middle_is_no_neutral_surface_of_another_k():
    patch = frustum(10.0, 10.0, 20.0, 1.5)
    blank = lay_flat(Chain((patch,)), Fibre(2.0, constant(0.33)))
    # width 10 against 9.66: the metric by 1 - 0.966^2
    assert isometry(patch, blank.developments[0]).value == pytest.approx(1 - 0.966**2, rel=1e-9)
    assert fold_back(Chain((patch,)), blank.developments)[0].value > 0.1


@pytest.mark.parametrize("reference", [1.0, -1.0])
def test_a_cone_with_one_k_has_the_pattern_of_its_parallel_cone(reference):
    # the neutral fibre is the parallel surface at (1/2 - K) T on the inner side
    patch = frustum(30.0, 12.0, 20.0, 4.0)
    if reference < 0.0:  # seen from the other side: c changes its sign, the inner side stays
        patch = patch.transformed(np.diag([1.0, -1.0, 1.0, 1.0]))
    k, thickness = 0.4, 3.0
    inwards = float(np.sign(patch.frame([1.0]).c[0]))
    other = patch.parallel(inwards * (0.5 - k) * thickness)
    found = pattern_of(patch, constant(k), thickness)
    assert found.area == pytest.approx(surface_area(other), rel=1e-13)
    parallel = pattern_of(other, constant(0.5), thickness)
    np.testing.assert_allclose(found.bbox, parallel.bbox, atol=1e-11)


def test_a_tangent_developable_keeps_its_rulings_and_narrows_across_them():
    # helix a = 3, b = 4: q + v a = v k and c = tau with arc length, k = 0.12, tau = 0.16;
    # strips v from 1 to 3, length 10: area 10 (k (9 - 1) / 2 - (1/2 - K) T tau 2)
    k, thickness = 0.3, 0.1
    found = pattern_of(helix_tangent(), constant(k), thickness)
    expected = 10.0 * (0.12 * 4.0 - (0.5 - k) * thickness * 0.16 * 2.0)
    assert found.area == pytest.approx(expected, rel=1e-12)


def test_half_the_thickness_is_the_pattern_of_today():
    patch = helix_tangent()
    chain, ends = Chain((patch,)), (np.array(patch.domain),)
    plain = lay_flat(chain)
    today = lay_out(chain, plain.developments, ends)
    # a hair beside one half goes the whole way round by the neutral fibre
    blank = lay_flat(chain, Fibre(0.1, constant(0.5 - 1e-15)))
    assert not blank.isometric
    assert lay_flat(chain, Fibre(0.1, constant(0.5))).isometric
    found = lay_out(blank.chain, blank.developments, ends, bending=chain.patches)
    assert found.area == pytest.approx(today.area, rel=1e-13)
    np.testing.assert_allclose(found.bbox, today.bbox, atol=1e-13)
    for one, other in zip(found.outline, today.outline, strict=True):
        u = np.linspace(other.u[0], other.u[-1], 9)
        np.testing.assert_allclose(one.curve(u)[0], other.curve(u)[0], atol=1e-13)
        np.testing.assert_allclose(one.curve(u)[1], other.curve(u)[1], atol=1e-13)


def test_area_times_thickness_is_the_volume_between_the_skins_for_one_half():
    # Steiner: the skins at -+ T / 2 are larger and smaller by as much
    patch = frustum(30.0, 12.0, 20.0, 4.0)
    area = pattern_of(patch, constant(0.5), 2.0).area
    skins = [surface_area(patch.parallel(d)) for d in (-1.0, 1.0)]
    assert area == pytest.approx(0.5 * sum(skins), rel=1e-13)
    middle = surface_area(patch)
    simpson = 2.0 / 6.0 * (skins[0] + 4.0 * middle + skins[1])  # exact for a linear area
    assert area * 2.0 == pytest.approx(simpson, rel=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_a_wave_narrows_by_all_its_turning_whichever_way_it_bends(law):
    patch, thickness = wave(), 0.3
    found = pattern_of(patch, LAWS[law], thickness)
    if law == "k":  # the tangent turns by 2 atan 4 in every half period, four of them
        turning = 4 * 2 * np.arctan(4.0)
        missing = (0.5 - 0.33) * thickness * turning * 10.0
        assert surface_area(patch) - found.area == pytest.approx(missing, rel=1e-12)
    # point symmetric about its middle: width before and after are equal
    rail = next(edge for edge in found.outline if edge.name == "top")
    x = rail.curve(np.array([-2 * np.pi, 0.0, 2 * np.pi]))[0][:, 1]
    assert x[1] - x[0] == pytest.approx(x[2] - x[1], rel=1e-13)


def test_the_law_breaks_where_the_bending_turns_and_where_it_has_corners():
    fibre = Fibre(0.3, constant(0.4))
    np.testing.assert_allclose(fibre.breaks(wave()), np.arange(-1, 2) * np.pi, atol=1e-12)
    # 1 / kappa of the wave y = 4 sin x is (1 + 16 cos^2)^1.5 / (4 |sin|)
    kinked = Fibre(0.3, table(((2.0, 0.3), (3.0, 0.5))))
    t = np.array(kinked.breaks(wave()))
    inner = t[np.abs(np.sin(t)) > 1e-6]
    radius = (1 + 16 * np.cos(inner) ** 2) ** 1.5 / (4 * np.abs(np.sin(inner)))
    ratios = np.sort(radius / 0.3 - 0.5)
    assert len(ratios) == 16
    np.testing.assert_allclose(ratios, np.repeat([2.0, 3.0], 8), rtol=1e-11)


def test_din_takes_the_ruling_at_its_tightest_end_and_bounds_the_rest():
    # a frustum: rho = r / cos of the slope; K by DIN at the small end, theta T dK left over
    patch, thickness = frustum(30.0, 12.0, 20.0, 4.0), 6.0
    cosine = 20.0 / np.hypot(20.0, 18.0)
    ratios = np.array([12.0, 30.0]) / cosine / thickness - 0.5
    k = np.minimum(0.5, 0.5 * (0.65 + 0.5 * np.log10(ratios)))
    fibre = Fibre(thickness, din6935())
    assert least_k(fibre, (patch,)) == pytest.approx(k[0], rel=1e-12)
    turning = 4.0 * cosine
    assert left_over(fibre, patch) == pytest.approx(turning * thickness * (k[1] - k[0]), rel=1e-6)
    found = pattern_of(patch, din6935(), thickness)
    slant = np.hypot(20.0, 18.0)
    missing = (0.5 - k[0]) * thickness * turning * slant
    assert surface_area(patch) - found.area == pytest.approx(missing, rel=1e-11)


@pytest.mark.parametrize("bend", [0.0, 0.4, 1.0])
def test_partly_bent_the_neutral_fibre_keeps_its_length(bend):
    # at the share of bending, the middle is the pattern and as much of the shift
    patch, fibre = frustum(30.0, 12.0, 20.0, 4.0), Fibre(3.0, constant(0.4))
    blank = lay_flat(Chain((patch,)), fibre)
    (found,) = bent(blank, bend).patches
    flat = surface_area(blank.chain.patches[0])
    whole = surface_area(patch)
    assert surface_area(found) == pytest.approx(flat + bend * (whole - flat), rel=1e-12)
    frame, of = found.frame(np.linspace(0.3, 3.7, 5)), patch.frame(np.linspace(0.3, 3.7, 5))
    np.testing.assert_allclose(frame.c, bend * of.c, atol=1e-12)
    np.testing.assert_allclose(frame.residual_c0, 0.0, atol=1e-12)


def test_a_cone_to_its_apex_ends_at_the_apex_of_its_neutral_cone():
    # a congruent cone shifted along the axis: the sector of slant s - (1/2 - K) T / tan(half angle)
    patch, thickness, k = frustum(30.0, 0.0, 40.0, 4.0), 2.0, 0.3
    found = pattern_of(patch, constant(k), thickness)
    slant = 50.0 - (0.5 - k) * thickness * 0.8 / 0.6
    assert found.area == pytest.approx(0.5 * slant**2 * 4.0 * 0.6, rel=1e-12)
    assert enclosed_area(found.outline) == pytest.approx(found.area, rel=1e-12)


def test_a_sloping_edge_has_a_corner_in_the_blank_where_the_bend_begins():
    # dz/ds is 0.3 on the middle; on the blank of the bend the width shrinks by (Ri + K T) / R
    found = pattern_of(flat_then_bent(), constant(0.3), 2.0)
    tops = [edge for edge in found.outline if edge.name == "top"]
    assert len(tops) == 2
    slopes = []
    for edge in tops:
        _, way = edge.curve(np.array([0.5 * (edge.u[0] + edge.u[-1])]))
        slopes.append(way[0, 0] / way[0, 1])
    np.testing.assert_allclose(slopes, [0.3, 0.3 / 0.96], rtol=1e-12)


def test_a_round_hole_across_the_begin_of_a_bend_is_round_in_the_blank():
    patch, thickness = flat_then_bent(oblique=0.0), 2.0
    blank = lay_flat(Chain((patch,)), Fibre(thickness, constant(0.3)))
    hole = Cutout("hole", circle(4.0), Placing(at=(15.0, 10.5)), False)
    cuts, _ = laid(Features(cutouts=(hole,)), blank.divided, blank.developments, blank.jumps)
    (cut,) = cuts
    assert len(cut.tracks) == 2  # a corner in space where the bend begins, twice
    ends = (np.array(patch.domain),)
    pattern = lay_out(blank.chain, blank.developments, ends, (), cuts, bending=(patch,))
    (edges,) = pattern.holes
    for edge in edges:
        points = edge.curve(np.linspace(edge.u[0], edge.u[-1], 41))[0]
        away = np.hypot(*(points - [15.0, 10.5]).T)
        np.testing.assert_allclose(away, 4.0, rtol=1e-12)
    assert -enclosed_area(edges) == pytest.approx(np.pi * 16.0, rel=1e-12)
    plain = pattern_of(patch, constant(0.3), thickness)
    assert plain.area - pattern.area == pytest.approx(np.pi * 16.0, rel=1e-11)
    # in space the part beyond t = 0 (y = 10 in the blank) is wider by 10 / 9.6
    beyond = 16.0 * (np.arccos(-0.125) + 0.125 * np.sqrt(1 - 0.125**2))
    in_space = np.pi * 16.0 + beyond * (1 / 0.96 - 1)
    lost = surface_area(patch) - sheet_area(Chain((patch,)), cuts)
    assert lost == pytest.approx(in_space, rel=1e-11)
    # both skins are cut at the same rulings: the wall stands normal to the sheet
    t, v = cut.tracks[0].series(np.linspace(*cut.tracks[0].u, 5)).T
    skins = [layer_points(Chain((patch,)), 0, t, v, d) for d in (-1.0, 1.0)]
    np.testing.assert_allclose(np.linalg.norm(skins[1] - skins[0], axis=1), 2.0, rtol=1e-12)


def test_a_hole_over_the_seam_of_a_tube_lies_on_both_ends_of_the_blank():
    tube = frustum(10.0, 10.0, 40.0)
    chain = link((tube,), base_closed=True, tolerance=0.05)
    blank = lay_flat(chain, Fibre(2.0, constant(0.4)))
    length = 2 * np.pi * 9.8
    cuts = [
        laid(
            Features(cutouts=(Cutout("hole", circle(5.0), Placing(at=at), False),)),
            blank.divided,
            blank.developments,
            blank.jumps,
        )[0]
        for at in ((20.0, 2.0), (20.0, 2.0 + length))
    ]
    for (cut,) in cuts:
        t, v = cut.tracks[0].series(np.linspace(*cut.tracks[0].u, 9)).T
        flat = blank.points(0, t, v)
        y = (flat[:, 1] - 2.0 + 0.5 * length) % length - 0.5 * length
        np.testing.assert_allclose(np.hypot(flat[:, 0] - 20.0, y), 5.0, rtol=1e-12)
