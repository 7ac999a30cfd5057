"""Strips along curves on freeform surfaces against those whose tangent developables are known."""

from __future__ import annotations

import numpy as np
import pytest
from constructing import build, inside, refusal, regression
from scipy.interpolate import BSpline

from devcad.errors import GeometryError, JobError
from devcad.geometry import freeform, taylor
from devcad.geometry.chain import link
from devcad.geometry.classify import classify
from devcad.geometry.jets import parse

R = 10.0
SPHERE = {"x": "10*cos(u)*cos(v)", "y": "10*sin(u)*cos(v)", "z": "10*sin(v)"}
TORUS = {"x": "(30+10*cos(v))*cos(u)", "y": "(30+10*cos(v))*sin(u)", "z": "10*sin(v)"}
ROUND = [0, "2*pi"]


def strips(base, *curves, extent=(-1, 1), **more):
    """The panels along curves (u, v, t) on a surface."""
    tables = [dict(zip("uvt", curve, strict=True)) for curve in curves]
    curve = tables[0] if len(tables) == 1 else tables
    return build(kind="tangent-planes", base=base, curve=curve, extent=list(extent), **more).panels


def strip(*args, **more):
    (panel,) = strips(*args, **more)
    (patch,) = panel.patches
    return patch, {name: figure.value for name, figure in panel.figures.items()}


@pytest.mark.parametrize("latitude", [0.05, 0.6, 1.4, -0.6])
def test_a_parallel_of_a_sphere_gives_the_cone_with_its_apex_at_r_over_sine(latitude):
    patch, figures = strip(SPHERE, ("t", f"{latitude}", ROUND), extent=(-0.5, 1))
    apex = regression(patch.frame(inside(patch)[:-1]))
    np.testing.assert_allclose(apex[:, 2], R / np.sin(latitude), rtol=1e-13)
    np.testing.assert_allclose(apex[:, :2], 0.0, atol=1e-11)
    assert figures["distance_to_base"] == pytest.approx(np.hypot(R, 1) - R, rel=1e-11)


def test_an_equator_gives_the_cylinder_and_a_tilted_one_too():
    great = ("atan(sin(t)*cos(0.5)/cos(t))", "asin(sin(t)*sin(0.5))", [-1.5, 1.5])
    for curve in (("t", "0", ROUND), great):
        patch, figures = strip(SPHERE, curve, extent=(-2, 1))
        shape = classify(patch)
        assert (shape.type, shape.radius) == ("cylinder", pytest.approx(R, rel=1e-12))
        assert figures["distance_to_base"] == pytest.approx(np.hypot(R, 2) - R, rel=1e-11)


def test_the_rulings_of_a_torus_along_its_parallel_are_those_of_a_cone():
    patch, figures = strip(TORUS, ("t", "pi/3", ROUND), extent=(-2, 2))
    apex = regression(patch.frame(inside(patch)[:-1]))
    # the tube's tangent at 60 degrees from (35, 0, 5 sqrt(3)) meets the axis at 50/sqrt(3)
    np.testing.assert_allclose(apex, np.tile([0, 0, 50 / np.sqrt(3)], (100, 1)), atol=1e-11)
    assert figures["distance_to_base"] == pytest.approx(np.hypot(10, 2) - 10, rel=1e-11)


DEVELOPABLE = [
    ({"x": "10*cos(u)", "y": "10*sin(u)", "z": "v"}, ("t", "sin(t)", ROUND)),
    ({"x": "v*cos(u)", "y": "2*v*sin(u)", "z": "v + u*0"}, ("t", "8 + sin(t)", [0, 3])),
    ({"x": "u", "y": "v", "z": "u**4"}, ("t", "0.1*t", [-1, 1])),  # a moment of rest
    ({"x": "u", "y": "v", "z": "u**3"}, ("t", "0.1*t", [-1, 1])),  # planes turn back, all is well
    ({"x": "cos(u) - v*sin(u)", "y": "sin(u) + v*cos(u)", "z": "u + v"}, ("t", "2+t", [0, 1])),
]


@pytest.mark.parametrize(("base", "curve"), DEVELOPABLE)
def test_a_developable_touches_itself(base, curve):
    patch, figures = strip(base, curve)
    assert figures["distance_to_base"] < 1e-13 * 20
    frame = patch.frame(inside(patch, 400))
    assert np.abs(frame.residual_e).max() < 1e-12
    assert np.abs(np.einsum("ni,ni->n", frame.n[1:], frame.n[:-1]) - 1).max() < 0.1


def test_the_ruling_is_conjugate_to_the_curve():
    """II(c', e) = 0 with the surface's own second fundamental form."""
    # z = f(u, v): II ~ (fuu, fuv; fuv, fvv) on (du, dv)
    base = {"x": "u", "y": "v", "z": "u**2 + 0.5*u*v + 2*v**2 + 0.3*u**3"}
    patch, _ = strip(base, ("t", "0.4*t**2", [0.1, 1]))
    t = inside(patch)
    jet = patch.jet(t, 1)
    du, dv = jet.c0[1, :, 0], jet.c0[1, :, 1]
    a, b = jet.e[0, :, 0], jet.e[0, :, 1]
    second = (2 + 1.8 * t) * du * a + 0.5 * (du * b + dv * a) + 4 * dv * b
    np.testing.assert_allclose(second, 0.0, atol=1e-13)


SHEET = {"x": "u", "y": "v", "z": "u**2 + v**2/2"}
BEZIER = {
    "degree": 2,
    "knots": [[-1, -1, -1, 1, 1, 1]] * 2,
    # poles of u^2 + v^2 / 2 on [-1, 1]^2: a square has the poles 1, -1, 1
    "control_points": [
        [[x, y, p + q / 2] for y, q in zip((-1, 0, 1), (1, -1, 1), strict=True)]
        for x, p in zip((-1, 0, 1), (1, -1, 1), strict=True)
    ],
}


def test_a_spline_that_is_a_paraboloid_gives_the_strip_of_the_formula():
    curve = ("0.5*cos(t)", "0.6*sin(t)", ROUND)
    one, figures = strip(SHEET, curve, extent=(-0.1, 0.1))
    other, same = strip(BEZIER, curve, extent=(-0.1, 0.1))
    t = inside(one)
    for a, b in ((one.jet(t, 5).c0, other.jet(t, 5).c0), (one.jet(t, 5).e, other.jet(t, 5).e)):
        np.testing.assert_allclose(a, b, atol=1e-13)
    assert figures == pytest.approx(same, rel=1e-10)


def cubic(seed=1, n=7):
    """A bumpy bicubic spline: u and v from 0 to 4, knots at 1, 2, 3."""
    rng = np.random.default_rng(seed)
    knots = [0, 0, 0, 0, *range(1, n - 3), n - 3, n - 3, n - 3, n - 3]
    grid = np.linspace(0, n - 3, n)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    z = -0.1 * (x - 2) ** 2 - 0.12 * (y - 2) ** 2 + 0.05 * rng.random((n, n))
    return {
        "degree": 3,
        "knots": [knots, knots],
        "control_points": np.stack([x, y, z], -1).tolist(),
    }


def test_the_points_and_derivatives_of_a_spline_are_those_of_scipy():
    table = cubic()
    knots, net = np.array(table["knots"][0], float), np.array(table["control_points"])
    surface = freeform.of_bspline((3, 3), (knots, knots), net)
    rng = np.random.default_rng(2)
    u, v = rng.uniform(0, 4, (2, 50))

    def scipy(du, dv):
        rows = BSpline(knots, net, 3)(u, nu=du)  # (n, nv, 3)
        return np.array([BSpline(knots, row, 3)(y, nu=dv) for row, y in zip(rows, v, strict=True)])

    at = np.stack([u, v])
    np.testing.assert_allclose(surface.sheet(u[None], v[None], at)[0], scipy(0, 0), atol=1e-13)
    su, sv = surface.partials(u[None], v[None], at)
    np.testing.assert_allclose(su[0], scipy(1, 0), atol=1e-12)
    np.testing.assert_allclose(sv[0], scipy(0, 1), atol=1e-12)


def test_kronecker_gives_the_partial_derivatives_along_a_curve():
    x = parse("exp(u*v) + u**3*sin(v)", ("u", "v"))
    zero = parse("0", ("u", "v"))
    surface = freeform.of_expressions(x, zero, zero)
    t = taylor.variable(np.linspace(-1, 1, 9), 7)
    u, v = parse("t**2").series(t=t), parse("sin(t)").series(t=t)
    su, sv = surface.partials(u, v, np.stack([u[0], v[0]]))
    by_u = parse("sin(t)*exp(t**2*sin(t)) + 3*t**4*sin(sin(t))").series(t=t)
    by_v = parse("t**2*exp(t**2*sin(t)) + t**6*cos(sin(t))").series(t=t)
    np.testing.assert_allclose(su[..., 0], by_u, atol=1e-11)
    np.testing.assert_allclose(sv[..., 0], by_v, atol=1e-11)


def test_a_strip_breaks_where_its_curve_crosses_a_knot_and_keeps_its_tangent_plane():
    panels = strips(cubic(), ("0.3 + 3*t", "0.5 + 2*t + 0.5*sin(t)", [0, 1]), extent=(-0.3, 0.3))
    patches = panels[0].patches
    seams = np.array([p.domain[0] for p in patches[1:]])
    # u = 1, 2, 3 and v = 1, 2
    np.testing.assert_allclose(seams[[1, 2, 4]], [0.7 / 3, 1.7 / 3, 0.9], rtol=1e-15)
    np.testing.assert_allclose(
        0.5 + 2 * seams[[0, 3]] + 0.5 * np.sin(seams[[0, 3]]), [1, 2], rtol=1e-15
    )
    chain = link(patches, base_closed=False, tolerance=0.05)
    assert all(joint.smooth for joint in chain.joints)
    for patch in patches:
        frame = patch.frame(inside(patch))
        assert np.abs(frame.residual_e).max() < 1e-12
        # on each patch one polynomial surface: the series goes on to the ends
        low, high = patch.domain
        middle, half = 0.5 * (low + high), 0.02 * (high - low)
        jet, there = patch.jet([middle], 8), patch.jet([middle + half], 0)
        np.testing.assert_allclose((half ** np.arange(9)) @ jet.e[:, 0], there.e[0, 0], atol=1e-13)


def test_weights_make_an_exact_quarter_of_a_cylinder():
    w = float(np.sqrt(0.5))
    base = {
        "degree": [2, 1],
        "knots": [[0, 0, 0, 1, 1, 1], [0, 0, 1, 1]],
        "control_points": [
            [[10, 0, 0], [10, 0, 20]],
            [[10, 10, 0], [10, 10, 20]],
            [[0, 10, 0], [0, 10, 20]],
        ],
        "weights": [[1, 1], [w, w], [1, 1]],
    }
    patch, figures = strip(base, ("t", "0.5 + 0.2*t", [0, 1]), extent=(-4, 4))
    assert classify(patch).radius == pytest.approx(10, rel=1e-12)
    assert figures["distance_to_base"] < 1e-13


def point(latitude, v):
    """The point of a sphere's tangent cone at v along it, northwards, in its meridian's plane."""
    return R * np.array([np.cos(latitude), np.sin(latitude)]) + v * np.array(
        [-np.sin(latitude), np.cos(latitude)]
    )


def test_gaps_between_cones_around_a_sphere():
    panels = strips(SPHERE, *[("t", f"{x}", ROUND) for x in (0.2, 0.6, 1.0)], extent=(-1, 1))
    gap = float(np.linalg.norm(point(0.2, 1) - point(0.6, -1)))
    assert [p.figures["gap_to_next"].value for p in panels[:2]] == pytest.approx([gap, gap])
    assert "gap_to_next" not in panels[2].figures
    assert all(panel.base_closed for panel in panels)


def test_cones_that_meet_half_way_leave_no_gap():
    half = R * np.tan(0.2)
    panels = strips(SPHERE, *[("t", f"{x}", ROUND) for x in (0.2, 0.6)], extent=(-half, half))
    assert panels[0].figures["gap_to_next"].value < 1e-13 * R
    assert panels[1].figures["distance_to_base"].value == pytest.approx(
        R / np.cos(0.2) - R, rel=1e-11
    )


def test_cylinders_on_a_paraboloid_meet_half_way():
    """z = -(x^2 + y^2)/100: along y = const the ruling is (0, 1, -y/50), the same all along."""
    base = {"x": "u", "y": "v", "z": "-(u**2 + v**2)/100"}
    curves = [("t", f"{y}", [-20, 20]) for y in (0, 10)]
    panels = strips(base, *curves, extent=("-5", "5"))
    up, down = panels[0].patches[0], panels[1].patches[0]
    assert classify(up).type == classify(down).type == "cylinder"
    # edges y = 5 at z = 0 and y = 10 - 5 cos b at z = -1 + 5 sin b, tan b = 1/5
    b = np.arctan(0.2)
    gap = np.hypot(5 * (1 - np.cos(b)), 5 * np.sin(b) - 1)
    assert panels[0].figures["gap_to_next"].value == pytest.approx(gap, rel=1e-6)


def test_distances_are_those_to_the_nearest_point_across_a_pole():
    patch, figures = strip(SPHERE, ("1", "t", [0, "pi/2"]), extent=(-1, 1))
    assert figures["distance_to_base"] == pytest.approx(np.hypot(R, 1) - R, rel=1e-11)
    assert classify(patch).type == "cylinder"


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_figures_grow_with_the_surface(scale):
    base = {name: f"({text})*{scale!r}" for name, text in SPHERE.items()}
    _, figures = strip(base, ("t", "0.3*sin(t)", ROUND), extent=(-scale, scale))
    assert figures["distance_to_base"] == pytest.approx(scale * (np.hypot(R, 1) - R), rel=1e-9)


SADDLE = {"x": "u", "y": "v", "z": "u*v"}
CREASED = {
    "degree": 1,
    "knots": [[0, 0, 1, 2, 2], [0, 0, 1, 1]],
    "control_points": [[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0]], [[2, 0, 0], [2, 1, 3]]],
}
KINKED = {
    "degree": 2,
    "knots": [[0, 0, 0, 1, 2, 2, 2], [0, 0, 0, 1, 1, 1]],
    "control_points": [
        [[x, y, x * x * (3 - x) + y * y + 0.1 * x * y] for y in (0, 0.5, 1)]
        for x in (0, 0.5, 1.5, 2)
    ],
}


@pytest.mark.parametrize(
    ("base", "curve", "error", "words"),
    [
        (SADDLE, ("t", "0", [-1, 1]), GeometryError, "asymptotic"),
        (
            SADDLE,
            ("t", "t**2/2", [-1, 1]),
            GeometryError,
            "asymptotic direction of the surface, at t = 0",
        ),
        ({"x": "u", "y": "v", "z": "0"}, ("t", "t**2", [-1, 1]), GeometryError, "stands still"),
        (CREASED, ("2*t", "0.3 + 0.3*t", [0, 1]), GeometryError, "turns at once"),
        (KINKED, ("2*t", "0.5 + 0.1*t", [0, 1]), GeometryError, "turns at once by 15.9 deg"),
        (BEZIER, ("2*t", "0", [0, 1]), JobError, "u = 2 at t = 1 is outside"),
        (SPHERE, ("t**2", "0.5 + t**2", [-1, 1]), GeometryError, "stands still at t = 0"),
        (SPHERE, ("log(t)", "0.5", [-1, 1]), JobError, "not a finite number at t = -1"),
        (SPHERE, ("abs(t)", "0.5", [-1, 1]), JobError, "derivative at t = 0"),
        ({"x": "1", "y": "2", "z": "3"}, ("t", "t", [0, 1]), GeometryError, "stands still"),
        ({"x": "u**2", "y": "v", "z": "0"}, ("0.5 + t", "t", [-0.5, 1]), GeometryError, "plane"),
        (
            {"x": "u+v", "y": "u+v", "z": "u+v"},
            ("t", "t", [0, 1]),
            GeometryError,
            "no tangent plane",
        ),
        ({"x": "u", "y": "v"}, ("t", "t", [0, 1]), JobError, "either x, y and z"),
        ({**BEZIER, "x": "u"}, ("t", "t", [0, 1]), JobError, "either x, y and z"),
        ({**BEZIER, "control_points": [[[0, 0, 0]], []]}, ("t", "t", [0, 1]), JobError, "no grid"),
        ({**BEZIER, "weights": [[1, 1, 1]]}, ("t", "t", [0, 1]), JobError, "weights is no grid"),
        ({**BEZIER, "degree": 3}, ("t", "t", [0, 1]), JobError, "too few for degree 3"),
    ],
)
def test_impossible_strips_end_in_one_line(base, curve, error, words):
    told = refusal(
        kind="tangent-planes",
        base=base,
        curve=dict(zip("uvt", curve, strict=True)),
        extent=[-0.1, 0.1],
    )
    assert type(told) is error
    assert words in str(told)
    assert told.remedy


def test_the_second_curve_is_named_when_it_is_the_wrong_one():
    curves = [{"u": "t", "v": "t", "t": [0, 1]}, {"u": "t", "v": "0", "t": [0, 1]}]
    told = refusal(kind="tangent-planes", base=SADDLE, curve=curves, extent=[0, 1])
    assert str(told).startswith("curve 2: ")
