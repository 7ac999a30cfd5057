"""Lines of curvature, Euclidean and Minkowskian, against closed forms and an ODE solver."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from constructing import area, inside, integral, patch, patches, refusal, regression
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.classify import classify

EXACT = 1e-12  # relative: rounding of a few hundred operations
G = np.diag([1.0, 1.0, -1.0])
TURN = 2 * np.pi


def helix(a, b, length):
    """(a cos t, a sin t, b t)."""
    return {"kind": "helix", "radius": a, "pitch": TURN * b, "turns": length / TURN}


def expression(x, y, z, low, high):
    return {"kind": "expression", "x": x, "y": y, "z": z, "t": [low, high]}


def euclid(**table):
    return patch(kind="line-of-curvature", **table)


def minkowski(**table):
    return patch(kind="line-of-curvature", metric="minkowski", **table)


def lorentz(x, y):
    return np.einsum("...i,...i->...", x @ G, y)


def b_of(surface, t):
    """b, Lorentz-unit: the extent [.., 1] ends at |b| e."""
    jet = surface.jet(t, 0)
    return jet.v_to[0][:, None] * jet.e[0]


# --- Euclid --------------------------------------------------------------------------------


def test_helix_in_euclid():
    """Example 1 and oracle O01: 3 cos, 3 sin, 4 t; theta0 = 0.3; 2 of length, 5 of ruling."""
    surface = euclid(curve=helix(3, 4, 0.4), angle=np.degrees(0.3), extent=[0, 5])
    t = inside(surface)
    frame = surface.frame(t)
    theta = 0.3 - 0.16 * 5 * t
    n = np.stack([-np.cos(t), -np.sin(t), 0 * t], axis=1)
    b = np.stack([4 * np.sin(t), -4 * np.cos(t), 3 + 0 * t], axis=1) / 5
    exact = -np.sin(theta)[:, None] * n + np.cos(theta)[:, None] * b
    np.testing.assert_allclose(frame.e, exact, atol=1e-15)
    expected = [0.2955202066613396, -0.7642691913004849, 0.5732018934753637]
    np.testing.assert_allclose(frame.e[0], expected, rtol=EXACT)
    star = -frame.q / frame.a
    assert star[0] == pytest.approx(-28.198861348534354, rel=EXACT)
    edge = [-5.333333333333333, 21.55152095843885, -16.16364071882914]
    np.testing.assert_allclose(regression(frame)[0], edge, rtol=EXACT)
    assert area(surface) == pytest.approx(10.41684547694661, rel=EXACT)
    assert abs(integral(surface, "a")) == pytest.approx(0.03334763815572882, rel=EXACT)
    assert classify(surface).type == "tangent"


@given(st.floats(5, 175), st.sampled_from([0.1, 2.0, 1e4]))
def test_circle_in_euclid_is_a_cone(angle, radius):
    """Example 2: apex (0, 0, -R cot theta), slant R / sin theta, sector 2 pi sin theta."""
    theta = np.radians(angle)
    cone = euclid(
        curve={"kind": "circle", "radius": radius}, angle=angle, extent=[-0.1 * radius, 0]
    )
    frame = cone.frame(inside(cone))
    apex = np.array([0, 0, -radius / np.tan(theta)])
    slant = radius / np.sin(theta)
    np.testing.assert_allclose(regression(frame), np.tile(apex, (101, 1)), atol=1e-12 * slant)
    np.testing.assert_allclose(np.abs(frame.q / frame.a), slant, rtol=1e-12)
    assert abs(integral(cone, "a")) == pytest.approx(TURN * np.sin(theta), rel=1e-12)


def test_circle_in_euclid_to_its_apex():
    cone = euclid(  # oracle O02
        curve={"kind": "circle", "radius": 2}, angle=60, extent=[-2.309401076758503 * 0.5, 0]
    )
    assert abs(integral(cone, "a")) == pytest.approx(5.441398092702654, rel=EXACT)
    assert classify(cone).type == "cone"


def test_plane_curve_at_angle_zero_is_a_cylinder():
    ellipse = {"kind": "ellipse", "radii": [3, 2]}
    cylinder = euclid(curve=ellipse, angle=0, extent=[0, 1])  # oracle O03
    np.testing.assert_allclose(
        cylinder.frame(inside(cylinder)).e, np.tile([0.0, 0.0, 1.0], (101, 1)), atol=1e-15
    )
    assert area(cylinder) == pytest.approx(15.86543958929059, rel=EXACT)
    assert classify(cylinder).type == "cylinder"


@pytest.mark.parametrize("lean", [0.0, 0.4, -1.2])
def test_a_plane_curve_may_have_an_inflection(lean):
    """Along y = x^3 the ruling keeps its angles with the plane's normal and the curve's left."""
    surface = euclid(
        curve=expression("t", "t**3", "0", -1, 1),
        ruling=[-3 * np.sin(lean), np.sin(lean), np.sqrt(10) * np.cos(lean)],
        extent=[-0.01, 0.01],
    )
    t = inside(surface)
    left = np.stack([-3 * t**2, 1 + 0 * t, 0 * t], axis=1) / np.sqrt(1 + 9 * t**4)[:, None]
    exact = np.sin(lean) * left + np.cos(lean) * np.array([0, 0, 1])
    np.testing.assert_allclose(surface.frame(t).e, exact, atol=1e-14)


def test_a_start_at_an_inflection_asks_for_a_ruling():
    told = refusal(
        kind="line-of-curvature",
        curve=expression("t", "t**3", "0", 0, 1),
        angle=30,
        extent=[0, 1],
    )
    assert type(told) is GeometryError
    assert "straight at its start t = 0" in str(told) and "ruling = [x, y, z]" in str(told)


def test_a_prism_follows_a_polygon():
    sides = patches(
        kind="line-of-curvature",
        curve={"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [3, 2, 0]]},
        ruling=[0.2, 0, 1],
        extent=[0, 1],
    )
    assert len(sides) == 3
    for here, following in pairwise(sides):
        np.testing.assert_allclose(here.frame(here.domain[1]).e, [[0, 0, 1]], atol=1e-15)
        np.testing.assert_allclose(following.frame(following.domain[0]).e, [[0, 0, 1]], atol=1e-15)


# --- Minkowski: the closed forms of geometry.md, section 1 -----------------------------------


def circular_frame(a, b, t, sign):
    """N and B of (a cos t, a sin t, b t); ``sign`` is that of <r', r'>."""
    v = np.sqrt(abs(a * a - b * b))
    normal = np.stack([-np.cos(t), -np.sin(t), 0 * t], axis=1)
    # det(T, N, B) = +1: B = -G (T x N) for the spacelike helix, +G (T x N) for the timelike one
    tangent = np.stack([-a * np.sin(t), a * np.cos(t), b + 0 * t], axis=1) / v
    return normal, -sign * np.cross(tangent, normal) @ G


def hyperbolic_frame(a, b, t):
    """N and B of (b t, a sinh t, a cosh t)."""
    v = np.hypot(a, b)
    normal = np.stack([0 * t, np.sinh(t), np.cosh(t)], axis=1)
    binormal = np.stack([a + 0 * t, -b * np.cosh(t), -b * np.sinh(t)], axis=1) / v
    return normal, binormal


def boost_frame(a, b, t):
    """N and B of (b t, a cosh t, a sinh t), by det(T, N, B) = +1."""
    v = np.sqrt(abs(b * b - a * a))
    normal = np.stack([0 * t, np.cosh(t), np.sinh(t)], axis=1)
    tangent = np.stack([b + 0 * t, a * np.sinh(t), a * np.cosh(t)], axis=1) / v
    return normal, -np.sign(b - a) * np.cross(tangent, normal) @ G


HYPERBOLIC = ("2*t", "3*sinh(t)", "3*cosh(t)")
EXAMPLES = {
    # name: curve, causal, theta0, (tau, v), frame at t, coefficients of N and B in b
    "4, spacelike helix": (
        helix(2, 1, 5), "spacelike", 0.5, (1 / 3, np.sqrt(3)),
        lambda t: circular_frame(2, 1, t, 1), (np.cosh, np.sinh),
    ),
    "4, on a timelike surface": (
        helix(2, 1, 5), "timelike", 0.5, (1 / 3, np.sqrt(3)),
        lambda t: circular_frame(2, 1, t, 1), (np.sinh, np.cosh),
    ),
    "5, hyperbolic helix": (
        expression(*HYPERBOLIC, -1, 2), "spacelike", -0.3, (-2 / 13, np.sqrt(13)),
        lambda t: hyperbolic_frame(3, 2, t), (np.sinh, np.cosh),
    ),
    "5, on a timelike surface": (
        expression(*HYPERBOLIC, -1, 2), "timelike", -0.3, (-2 / 13, np.sqrt(13)),
        lambda t: hyperbolic_frame(3, 2, t), (np.cosh, np.sinh),
    ),
    "7, spacelike": (
        expression("3*t", "2*cosh(t)", "2*sinh(t)", -1, 2), "spacelike", 0.4,
        (3 / 5, np.sqrt(5)), lambda t: boost_frame(2, 3, t), (np.cosh, np.sinh),
    ),
    "7, timelike": (
        expression("2*t", "3*cosh(t)", "3*sinh(t)", -1, 2), "timelike", 0.4,
        (2 / 5, np.sqrt(5)), lambda t: boost_frame(3, 2, t),
        (lambda x: -np.sin(x), np.cos),
    ),
    "8, timelike helix": (
        helix(1, 2, 5), "timelike", 0.2, (2 / 3, np.sqrt(3)),
        lambda t: circular_frame(1, 2, t, -1), (lambda x: -np.sin(x), np.cos),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_of_section_1(name):
    curve, causal, theta0, (tau, v), frame_of, (along_n, along_b) = EXAMPLES[name]
    surface = minkowski(curve=curve, causal=causal, angle=theta0, extent=[0, 1])
    t = inside(surface)
    theta = (theta0 - tau * v * (t - t[0]))[:, None]
    normal, binormal = frame_of(t)
    exact = along_n(theta) * normal + along_b(theta) * binormal
    b = b_of(surface, t)
    np.testing.assert_allclose(b, exact, rtol=1e-13, atol=1e-14 * np.abs(exact).max())
    # b' = mu k T is along the curve and <b, b> stays
    sign = 1.0 if surface.causal == "spacelike" or name.startswith(("7, t", "8")) else -1.0
    scale = np.square(exact).sum(axis=1).max()
    np.testing.assert_allclose(lorentz(b, b), sign, atol=1e-13 * scale)
    frame = surface.frame(t)
    assert surface.causal == causal
    slope = np.abs(frame.n[:, 2]) - np.hypot(frame.n[:, 0], frame.n[:, 1])
    assert (slope > 0).all() if causal == "spacelike" else (slope < 0).all()
    assert np.abs(frame.residual_e).max() < 1e-13
    assert classify(surface).type == "tangent"


def test_spacelike_cone_through_a_circle():
    """Example 3 and oracle O04."""
    slant = 1.2961085473277707  # R / cosh theta, Lorentz length
    cone = minkowski(curve={"kind": "circle", "radius": 2}, angle=1, extent=[0, slant])
    t = inside(cone)
    frame = cone.frame(t)
    apex = np.tile([0, 0, 1.5231883119115297], (101, 1))
    np.testing.assert_allclose(regression(frame), apex, atol=1e-12)
    np.testing.assert_allclose(frame.v_to, 2.5139814306282964, rtol=EXACT)
    assert abs(integral(cone, "a")) == pytest.approx(4.998593251827868, rel=EXACT)
    assert area(cone) == pytest.approx(15.795811187446029, rel=EXACT)
    assert classify(cone).type == "cone"
    # the Lorentz sector angle: the curve's Lorentz length over the Lorentz slant
    assert TURN * 2 / slant == pytest.approx(9.695461572464488, rel=EXACT)


def test_spacelike_helix_in_numbers():
    v = np.sqrt(3)
    strip = minkowski(curve=helix(2, 1, 1.5 / v), angle=0.5, extent=[0, 0.5])  # oracle O05
    t = inside(strip)
    jet, frame = strip.jet(t, 0), strip.frame(t)
    b0 = [-1.1276259652063807, 0.3008545149002653, 0.6017090298005306]
    np.testing.assert_allclose(2 * b_of(strip, t)[0], b0, rtol=1e-12)
    star = -frame.q / frame.a / (2 * jet.v_to[0])  # in Lorentz length
    assert star[0] == pytest.approx(1.3302283259551109, rel=1e-12)
    assert area(strip) == pytest.approx(0.8526275397575662, rel=1e-11)


def test_timelike_helix_in_numbers():
    strip = minkowski(curve=helix(1, 2, 1), causal="timelike", angle=0.2, extent=[0, 1])  # O08
    frame = strip.frame([0.0])
    star = -frame.q / frame.a / frame.v_to
    assert star[0] == pytest.approx(15.100468643017033, rel=EXACT)


def test_hyperbola_is_a_line_of_curvature_of_the_hyperbolic_cylinder():
    """Example 6: theta = 0 has the rulings (1, 0, 0)."""
    strip = minkowski(
        curve=expression("0", "2*sinh(t)", "2*cosh(t)", -1, 1), angle=0, extent=[0, 1]
    )
    frame = strip.frame(inside(strip))
    np.testing.assert_allclose(frame.e, np.tile([1.0, 0.0, 0.0], (101, 1)), atol=1e-15)
    np.testing.assert_allclose(frame.v_to, 1.0, rtol=EXACT)
    from scipy.integrate import quad

    length = quad(lambda u: 2 * np.sqrt(np.cosh(2 * u)), -1, 1, epsabs=1e-14)[0]
    assert area(strip) == pytest.approx(length, rel=EXACT)
    assert classify(strip).type == "cylinder"


def test_null_curve_of_accelerations_has_polynomial_rulings():
    """r = (t, t^2/2, t^2/2): T' is lightlike everywhere, N and B do not exist.

    T = (1, t, t), T' = (0, 1, 1) =: L constant with <T, L> = 0, so <b, L> = c stays and
    b = b0 - c (t, t^2/2, t^2/2).
    """
    curve = expression("t", "t**2/2", "t**2/2", 0, 3)
    b0 = np.array([0.0, 1.25, 0.75])  # <b0, T> = 0, <b0, b0> = 1
    strip = minkowski(curve=curve, ruling=list(3 * b0), extent=[0, 1])
    t = inside(strip)
    exact = b0 - 0.5 * np.stack([t, t**2 / 2, t**2 / 2], axis=1)
    np.testing.assert_allclose(b_of(strip, t), exact, atol=1e-14)
    told = refusal(
        kind="line-of-curvature", metric="minkowski", curve=curve, angle=0, extent=[0, 1]
    )
    assert "T' is lightlike" in str(told) and "ruling = [x, y, z]" in str(told)


# --- against an ODE solver -------------------------------------------------------------------


def solved(tangent, metric, b0, t):
    """(1.3) by an explicit Runge-Kutta method of order 8."""

    def slope(u, b):
        direction, turning = tangent(u)
        eps = np.sign(direction @ metric @ direction)
        return -eps * (b @ metric @ turning) * direction

    return solve_ivp(slope, (t[0], t[-1]), b0, "DOP853", t, rtol=1e-13, atol=1e-14).y.T


def unit_tangent(first, second, metric):
    """T and dT/dt from r' and r''."""

    def tangent(u):
        x, y = first(u), second(u)
        square = x @ metric @ x
        speed = np.sqrt(abs(square))
        return x / speed, y / speed - x * (x @ metric @ y) / (square * speed)

    return tangent


@pytest.mark.parametrize("metric", ["euclidean", "minkowski"])
def test_a_space_curve_with_an_inflection_where_the_acceleration_is_lightlike_too(metric):
    """r = (t, t^3, t^4/2): straight at 0; <T', T'> changes its sign elsewhere."""
    form = np.eye(3) if metric == "euclidean" else G
    tangent = unit_tangent(
        lambda u: np.array([1, 3 * u**2, 2 * u**3]),
        lambda u: np.array([0, 6 * u, 6 * u**2]),
        form,
    )
    surface = patch(
        kind="line-of-curvature",
        metric=metric,
        curve=expression("t", "t**3", "t**4/2", -0.9, 1.2),
        ruling=[1, 0, 0],
        extent=[0, 0.01],
    )
    t = inside(surface)
    jet = surface.jet(t, 0)
    b = jet.e[0] * (jet.v_to[0] / 0.01)[:, None]
    start = tangent(t[0])[0]
    assert abs(b[0] @ form @ start) < 1e-14
    assert b[0] @ form @ b[0] == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(b, solved(tangent, form, b[0], t), atol=1e-11)


def test_a_sign_change_of_the_accelerations_square_is_crossed():
    """r = (t, t^2/2, t^2/2 + t^3/6): <T', T'> = 0 at t = 0, spacelike before, timelike after."""
    tangent = unit_tangent(
        lambda u: np.array([1, u, u + u**2 / 2]), lambda u: np.array([0, 1, 1 + u]), G
    )
    for causal, ruling in (("spacelike", [0, 1, 0.1]), ("timelike", [0, 0.1, 1])):
        strip = minkowski(
            curve=expression("t", "t**2/2", "t**2/2 + t**3/6", -1, 0.5),
            causal=causal,
            ruling=ruling,
            extent=[0, 1],
        )
        t = inside(strip)
        b = b_of(strip, t)
        np.testing.assert_allclose(b, solved(tangent, G, b[0], t), atol=1e-11)


CONTROL = st.lists(st.tuples(*[st.floats(-0.3, 0.3)] * 3), min_size=6, max_size=6)


def wavy(offsets):
    """Control points near a line along x, so that the curve is spacelike."""
    return np.array([[float(i), 0.0, 0.0] for i in range(6)]) + np.array(offsets)


def spline(points):
    knots = [0] * 5 + [0.5] + [1] * 5
    return {"kind": "bspline", "degree": 4, "knots": knots, "control_points": points.tolist()}


@settings(max_examples=30)
@given(CONTROL, st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_rigid_motions_move_the_rulings(offsets, turn):
    points, motion = wavy(offsets), Rotation.from_quat(turn).as_matrix()
    ruling = np.array([0.1, 0.8, 0.6])
    still = euclid(curve=spline(points), ruling=ruling.tolist(), extent=[0, 1])
    moved = euclid(
        curve=spline(points @ motion.T + [5, -3, 2]),
        ruling=(motion @ ruling).tolist(),
        extent=[0, 1],
    )
    t = inside(still)
    np.testing.assert_allclose(moved.jet(t, 2).e, still.jet(t, 2).e @ motion.T, atol=1e-10)


def boost(rapidity, heading, turn):
    """A Lorentz transformation: a rotation about z, then a boost along a heading."""
    x, y = np.cos(heading), np.sin(heading)
    c, s = np.cosh(rapidity), np.sinh(rapidity)
    push = np.array(
        [
            [1 + (c - 1) * x * x, (c - 1) * x * y, s * x],
            [(c - 1) * x * y, 1 + (c - 1) * y * y, s * y],
            [s * x, s * y, c],
        ]
    )
    return push @ Rotation.from_euler("z", turn).as_matrix()


@settings(max_examples=30)
@given(CONTROL, st.floats(-1.2, 1.2), st.floats(0, TURN), st.floats(0, TURN), st.booleans())
def test_lorentz_boosts_carry_the_rulings_along(offsets, rapidity, heading, turn, spacelike):
    """b and its derivatives are Lorentz vectors."""
    points, motion = wavy(offsets), boost(rapidity, heading, turn)
    np.testing.assert_allclose(motion.T @ G @ motion, G, atol=1e-12)
    ruling = np.array([0.1, 0.9, 0.1] if spacelike else [0.1, 0.1, 0.9])
    causal = "spacelike" if spacelike else "timelike"
    still = minkowski(curve=spline(points), causal=causal, ruling=ruling.tolist(), extent=[0.5, 1])
    moved = minkowski(
        curve=spline(points @ motion.T),
        causal=causal,
        ruling=(motion @ ruling).tolist(),
        extent=[0.5, 1],
    )
    t = inside(still)
    there, here = (taylor.mul(jet.v_to, jet.e) for jet in (moved.jet(t, 2), still.jet(t, 2)))
    size = np.abs(there).max() + np.abs(here).max()
    np.testing.assert_allclose(there, here @ motion.T, atol=1e-12 * size**2)


@settings(max_examples=30)
@given(CONTROL)
def test_backwards_the_field_is_the_same(offsets):
    points = wavy(offsets)
    for metric in ("euclidean", "minkowski"):
        ways = {"kind": "line-of-curvature", "metric": metric, "extent": [0, 1]}
        there = patch(**ways, curve=spline(points), ruling=[0, 1, 0.1])
        arrived = there.jet([1.0], 0).e[0, 0]
        back = patch(**ways, curve=spline(points[::-1]), ruling=arrived.tolist())
        t = inside(there)
        np.testing.assert_allclose(back.jet(1 - t, 0).e, there.jet(t, 0).e, atol=1e-11)


def test_the_parameter_does_not_matter():
    curves = [
        expression("t", "t**2/4", "t**3/9", -1, 1),
        expression("sinh(t)", "sinh(t)**2/4", "sinh(t)**3/9", "-asinh(1)", "asinh(1)"),
    ]
    for metric, angle in (("euclidean", 40), ("minkowski", 0.3)):
        plain, other = (
            patch(kind="line-of-curvature", metric=metric, curve=c, angle=angle, extent=[0, 1])
            for c in curves
        )
        t = inside(plain)[1:-1]
        np.testing.assert_allclose(
            other.jet(np.arcsinh(t), 0).e, plain.jet(t, 0).e, rtol=0, atol=1e-13
        )


def test_derivatives_of_the_ruling_are_those_of_its_values():
    """The Taylor polynomial of order 8 meets the ruling 0.01 away, to rounding."""
    strip = minkowski(
        curve=expression("t", "t**2/4", "t**3/9", -1, 1), angle=0.3, extent=["t/5", 1]
    )
    t, step = np.linspace(-0.9, 0.9, 13), 0.01
    jet, there = strip.jet(t, 8), strip.jet(t + step, 0)
    powers = step ** np.arange(9)
    np.testing.assert_allclose(np.einsum("k,kni->ni", powers, jet.e), there.e[0], atol=1e-13)
    np.testing.assert_allclose(powers @ jet.v_from, there.v_from[0], atol=1e-13)
