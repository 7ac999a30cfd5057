"""Plane, cylinder, cone, frustum and ruled surfaces against elementary geometry."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from constructing import area, build, inside, integral, patch, patches, refusal, regression
from hypothesis import given
from hypothesis import strategies as st

from devcad.errors import GeometryError, JobError
from devcad.geometry.constructions.ruled import joined
from devcad.geometry.regularity import twist

EXACT = 1e-12  # relative: rounding of a few hundred operations
CIRCLE = {"kind": "circle", "radius": 2}
SQUARE = {
    "kind": "polyline",
    "points": [[1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]],
    "closed": True,
}


def test_plane_is_a_rectangle_facing_up():
    plane = patch(kind="plane", width=3, height=2)
    frame = plane.frame(inside(plane))
    assert plane.domain == (0.0, 2.0)
    np.testing.assert_array_equal(frame.n, np.tile([0.0, 0.0, 1.0], (101, 1)))
    np.testing.assert_array_equal(frame.e, np.tile([1.0, 0.0, 0.0], (101, 1)))
    np.testing.assert_array_equal(plane.point([0.5], [3.0]), [[3.0, 0.5, 0.0]])
    assert area(plane) == pytest.approx(6.0, rel=EXACT)


def test_cylinder_by_radius_starts_at_x_goes_round_counterclockwise_and_rules_upwards():
    tube = patch(kind="cylinder", radius=2, length=3)
    frame = tube.frame(inside(tube))
    assert tube.domain == (0.0, 2 * np.pi)
    np.testing.assert_allclose(
        tube.point([0, np.pi / 2], [0, 3]), [[2, 0, 0], [0, 2, 3]], atol=1e-15
    )
    np.testing.assert_allclose(frame.c, 1.0, rtol=EXACT)  # the normal turns with t
    np.testing.assert_allclose(frame.n[:, :2], -frame.c0[:, :2] / 2, atol=1e-15)  # front inside
    assert area(tube) == pytest.approx(2 * np.pi * 2 * 3, rel=EXACT)


@pytest.mark.parametrize(("sweep", "closed"), [(360, True), (359.9, False), (90, False)])
def test_a_full_sweep_closes_the_base_curve(sweep, closed):
    for table in (
        {"kind": "cylinder", "length": 1},
        {"kind": "frustum", "top_radius": 1, "height": 1},
    ):
        built = build(**table, radius=2, sweep=sweep)
        (panel,) = built.panels
        assert panel.base_closed is closed
        assert panel.patches[0].domain[1] == pytest.approx(np.radians(sweep), rel=1e-15)


def test_mitred_pipe_has_the_area_of_a_tube_of_its_mean_length():
    pipe = patch(kind="cylinder", radius=10, extent=[0, "20 + 10*cos(t)"])  # oracle O48
    assert area(pipe) == pytest.approx(1256.6370614359173, rel=EXACT)
    t = inside(pipe)
    cut = pipe.point(t, pipe.jet(t, 0).v_to[0])
    np.testing.assert_allclose(cut[:, 2], 20 + cut[:, 0], atol=1e-13)  # the mitre plane


def test_oblique_cylinder_is_its_right_section_times_its_length():
    # the right section of a circular tube cut obliquely: an ellipse with axes r and r cos 30 deg
    tilt = np.radians(30)
    oblique = patch(
        kind="cylinder",
        directrix=CIRCLE,
        direction=[np.sin(tilt) * 7, 0, np.cos(tilt) * 7],
        length=5,
    )
    from scipy.special import ellipe

    perimeter = 4 * 2 * ellipe(np.sin(tilt) ** 2)
    assert integral(oblique, "q") == pytest.approx(perimeter, rel=EXACT)
    assert np.abs(oblique.frame(inside(oblique)).a).max() == 0.0


def test_polyline_directrix_gives_a_chain_of_planes_that_share_rulings():
    for table in (
        {"kind": "cylinder", "direction": [0, 0, 1], "length": 2},
        {"kind": "cone", "apex": [0, 0, 3], "extent": [0.25, 1]},
    ):
        chain = patches(**table, directrix=SQUARE)
        assert len(chain) == 4
        for here, following in pairwise(chain):
            a, b = here.jet([here.domain[1]], 0), following.jet([following.domain[0]], 0)
            np.testing.assert_allclose(a.c0[0], b.c0[0], atol=1e-15)
            np.testing.assert_allclose(a.e[0], b.e[0], atol=1e-15)
        for side in chain:
            frame = side.frame(inside(side))
            assert np.abs(frame.c).max() < 1e-15
            assert np.ptp(frame.n, axis=0).max() < 1e-15  # one plane


def test_cone_reaches_from_its_apex_to_its_directrix_in_fractions_of_the_way():
    cone = patch(
        kind="cone",
        apex=[1, 2, 6],
        directrix={**CIRCLE, "center": [0.5, 1.8, 0]},
        extent=["t/20", 1],
    )
    t = inside(cone)
    jet = cone.jet(t, 0)
    rim = np.stack([0.5 + 2 * np.cos(t), 1.8 + 2 * np.sin(t), 0 * t], axis=1)
    np.testing.assert_allclose(cone.point(t, jet.v_to[0]), rim, atol=1e-14)
    way = np.linalg.norm(rim - [1, 2, 6], axis=1)
    np.testing.assert_allclose(jet.v_from[0], t / 20 * way, atol=1e-14)
    assert np.abs(cone.frame(t).q).max() < 1e-14  # the apex is the regression curve


def test_frustum_49_unrolls_to_an_annular_sector():
    frustum = patch(kind="frustum", radius=100, top_radius=50, height=120)
    frame = frustum.frame(inside(frustum))
    np.testing.assert_allclose(frame.v_to, 130, rtol=EXACT)  # slant
    np.testing.assert_allclose(-frame.q / frame.a, 260, rtol=EXACT)  # outer radius
    assert abs(integral(frustum, "a")) == pytest.approx(2.4166097335306103, rel=EXACT)
    assert area(frustum) == pytest.approx(61261.05674500097, rel=EXACT)


@pytest.mark.parametrize(
    ("lower", "upper", "apex"), [(3, 0, [0, 0, 4]), (0, 3, [0, 0, 0]), (1, 3, [0, 0, -2])]
)
def test_frustum_may_taper_to_an_apex_or_widen(lower, upper, apex):
    cone = patch(kind="frustum", radius=lower, top_radius=upper, height=4)
    frame = cone.frame(inside(cone)[1:-1])
    np.testing.assert_allclose(regression(frame), np.tile(apex, (99, 1)), atol=1e-14)
    slant = np.hypot(upper - lower, 4)
    assert area(cone) == pytest.approx(np.pi * (lower + upper) * slant, rel=EXACT)


def test_frustum_of_equal_radii_is_a_cylinder():
    frame = patch(kind="frustum", radius=2, top_radius=2, height=5).frame([0.0, 1.0])
    np.testing.assert_array_equal(frame.a, 0.0)
    np.testing.assert_array_equal(frame.e, [[0, 0, 1], [0, 0, 1]])


def test_parallel_circles_make_an_oblique_cone():
    upper = {"kind": "circle", "radius": 1, "center": [1, 0, 3]}  # oracle O44
    reducer = patch(kind="ruled", rails=[CIRCLE, upper])
    t = inside(reducer)
    frame = reducer.frame(t)
    np.testing.assert_allclose(regression(frame), np.tile([2.0, 0.0, 6.0], (101, 1)), atol=1e-12)
    np.testing.assert_allclose(frame.v_to[[0, 50]], [3, 3.605551275463989], rtol=EXACT)
    assert abs(integral(reducer, "a")) == pytest.approx(1.8618912892246622, rel=EXACT)
    assert area(reducer) == pytest.approx(30.467984200264393, rel=EXACT)
    assert twist(reducer).value < 1e-14
    same = patch(kind="cone", apex=[2, 0, 6], directrix=CIRCLE, extent=[0.5, 1])
    assert area(same) == pytest.approx(30.467984200264393, rel=EXACT)


def test_ruled_finds_the_striction_point_of_a_cone():
    cone = patch(  # oracle O47
        kind="ruled",
        curve={"kind": "expression", "x": "1+cos(t)", "y": "2+sin(t)", "z": "4", "t": [0, "2*pi"]},
        direction=["cos(t)", "sin(t)", 1],
        extent=[0, 2],
    )
    frame = cone.frame(inside(cone))
    np.testing.assert_allclose(regression(frame), np.tile([1.0, 2.0, 3.0], (101, 1)), atol=1e-14)
    np.testing.assert_allclose(-frame.q / frame.a, -np.sqrt(2), rtol=EXACT)  # b is sqrt 2 long


def test_the_hyperboloid_is_told_by_its_distribution_parameter():
    waist = {"kind": "expression", "x": "cos(t)", "y": "sin(t)", "z": "0", "t": [0, "2*pi"]}
    surface = patch(  # oracle O45
        kind="ruled", curve=waist, direction=["-sin(t)", "cos(t)", 1], extent=[-1, 1]
    )
    jet = surface.jet(inside(surface), 1)
    turn = np.linalg.det(np.stack([jet.c0[1], jet.e[0], jet.e[1]], axis=1))
    np.testing.assert_allclose(turn / np.square(jet.e[1]).sum(axis=1), -1.0, rtol=EXACT)
    # tan of the angle between the tangent planes at +-sqrt 2 from the striction curve: 2 atan(t/p)
    ends = patch(kind="ruled", curve=waist, direction=["-sin(t)", "cos(t)", 1], extent=[-0.1, 0.1])
    assert twist(ends).value == pytest.approx(2 * np.arctan(0.1), rel=1e-12)


def test_rails_share_the_corners_of_both_at_equal_fractions():
    upper = {**SQUARE, "points": [[0.5, -0.5, 1], [0.5, 0.5, 1], [-0.5, 0.5, 1], [-0.5, -0.5, 1]]}
    pyramid = patches(kind="ruled", rails=[SQUARE, upper])
    assert len(pyramid) == 4
    assert sum(area(side) for side in pyramid) == pytest.approx(
        4 * 1.5 * np.hypot(1, 0.5), rel=EXACT
    )
    # a rail with other corners, over another parameter: corners of either split the chain
    bent = {
        "kind": "chain",
        "curves": [
            {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]},
            {"kind": "line", "from": [1, 0, 0], "to": [4, 0, 0]},
        ],
    }
    kinked = {"kind": "polyline", "points": [[0, 1, 0], [2, 1, 0], [4, 1.5, 0]]}
    chain = patches(kind="ruled", rails=[kinked, bent])
    assert len(chain) == 2
    assert chain[0].domain[1] == chain[1].domain[0]
    frame = chain[1].frame(chain[1].domain)
    assert np.abs(frame.n[:, 2]).min() == pytest.approx(1.0)


def test_knots_of_two_rails_within_rounding_are_one():
    third = 1 / 3
    first = patch_curve({"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [3, 1, 0]]})
    second = patch_curve({"kind": "polyline", "points": [[0, 0, 1], [1, 0, 1], [3, 1, 1 + 1e-13]]})
    a, b = joined(first, second)
    assert len(a.corners) == 1 and a.corners == b.corners and a.corners != (third,)
    left, right = b.pieces()
    corner = np.array([a.corners[0]])
    np.testing.assert_allclose(left.jet(corner, 1)[1, 0, 1], 0.0, atol=1e-15)  # its own side
    assert right.jet(corner, 1)[1, 0, 1] > 0.5


def patch_curve(table):
    from pydantic import TypeAdapter

    from devcad.geometry.curves import CurveSpec

    return TypeAdapter(CurveSpec).validate_python(table).curve()


@given(
    apex=st.tuples(*[st.floats(-3, 3)] * 2),
    scale=st.sampled_from([0.1, 1.0, 1e4]),
    height=st.floats(1, 9),
)
def test_every_cone_over_a_circle_faces_one_way_and_is_developable(apex, scale, height):
    cone = patch(
        kind="cone",
        apex=[apex[0] * scale, apex[1] * scale, height * scale],
        directrix={"kind": "circle", "radius": 4 * scale},
        extent=[0.2, 1],
    )
    frame = cone.frame(inside(cone))
    assert (frame.q + frame.v_from * frame.a).min() > 0
    assert np.abs(frame.residual_e).max() < 1e-14
    assert np.abs(np.linalg.norm(frame.e, axis=1) - 1).max() < 1e-15


LINE = {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]}


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        ({"kind": "cylinder", "radius": 1}, JobError, "either extent or length"),
        (
            {"kind": "cylinder", "radius": 1, "length": 1, "extent": [0, 1]},
            JobError,
            "either extent",
        ),
        ({"kind": "cylinder", "length": 1}, JobError, "either a directrix or a radius"),
        ({"kind": "cylinder", "directrix": LINE, "length": 1}, JobError, "belong together"),
        (
            {
                "kind": "cylinder",
                "directrix": LINE,
                "direction": [0, 0, 1],
                "length": 1,
                "sweep": 9,
            },
            JobError,
            "sweep belongs to radius",
        ),
        ({"kind": "cylinder", "radius": 1, "length": 1, "sweep": -90}, JobError, "-90 degrees"),
        ({"kind": "cylinder", "radius": 1, "length": 1, "sweep": 361}, JobError, "361"),
        (
            {"kind": "cylinder", "directrix": LINE, "direction": [2, 0, 0], "length": 1},
            GeometryError,
            "runs along the direction at t = 0",
        ),
        (
            {"kind": "cylinder", "radius": 1, "extent": ["cos(t)", 0.5]},
            JobError,
            "from = 1 is not below to = 0.5 at t = 0",
        ),
        (
            {"kind": "cylinder", "radius": 1, "extent": [0, "sqrt(3 - t)"]},
            JobError,
            "extent: to has no finite value at t = 3.0",
        ),
        (
            {"kind": "cone", "apex": [2, 0, 0], "directrix": CIRCLE},
            GeometryError,
            "passes through the apex at t = 0",
        ),
        (
            {"kind": "cone", "apex": [4, 0, 0], "directrix": CIRCLE},
            GeometryError,
            "heads for the apex at t = 1.0472",
        ),
        ({"kind": "frustum", "radius": 0, "top_radius": 0, "height": 1}, JobError, "both 0"),
        ({"kind": "ruled", "curve": LINE, "direction": [0, 1, 0]}, JobError, "extent is missing"),
        ({"kind": "ruled", "extent": [0, 1]}, JobError, "either a curve or rails"),
        ({"kind": "ruled", "curve": LINE, "extent": [0, 1]}, JobError, "belong together"),
        (
            {"kind": "ruled", "curve": LINE, "direction": [0, "t - 0.3", 0], "extent": [0, 1]},
            GeometryError,
            "direction vanishes at t = 0.3",
        ),
        (
            {"kind": "ruled", "curve": LINE, "direction": [0, "1/(t - 0.5)", 0], "extent": [0, 1]},
            JobError,
            "direction has no finite value at t = 0.5",
        ),
        (
            {"kind": "ruled", "rails": [LINE, {**LINE, "from": [0, 1, 0], "to": [1, -2, 0]}]},
            GeometryError,
            "rails meet at t = 0.333333",
        ),
    ],
)
def test_impossible_tables_end_in_one_line(table, error, words):
    told = refusal(**table)
    assert type(told) is error
    assert words in str(told)
    assert told.remedy
