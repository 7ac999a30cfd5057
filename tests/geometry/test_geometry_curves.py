"""Curve kinds against closed forms, and what each kind refuses."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import ellipeinc, fresnel

from devcad.errors import JobError, LimitError
from devcad.geometry import taylor
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, Model, Positive

SPEC = TypeAdapter(CurveSpec)


def make(**table) -> Curve:
    return SPEC.validate_python(table).curve()


def refusal(**table) -> Exception:
    """The error with which a kind refuses a table, at validation."""
    with pytest.raises(ValidationError) as caught:
        SPEC.validate_python(table)
    return caught.value.errors()[0].get("ctx", {}).get("error", caught.value)


def curvature_and_torsion(curve, t):
    """From the first three derivatives, (n,) each (do Carmo, section 1-5, exercise 12)."""
    jet = curve.jet(np.asarray(t, dtype=float), 3)
    d1, d2, d3 = jet[1], 2 * jet[2], 6 * jet[3]
    b = np.cross(d1, d2)
    width = np.linalg.norm(b, axis=1)
    return width / np.linalg.norm(d1, axis=1) ** 3, np.einsum("ij,ij->i", b, d3) / width**2


def speed(curve, t):
    return np.linalg.norm(curve.jet(np.asarray(t, dtype=float), 1)[1], axis=1)


def inside(curve, n=97):
    """Parameters over the domain, away from its ends, breaks and corners."""
    lo, hi = curve.domain
    t = lo + (hi - lo) * (np.arange(n) + 0.437) / n
    return t[np.abs(t[:, None] - np.array([lo, *curve.breaks, *curve.corners])).min(axis=1) > 1e-9]


SQUARE = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
SPACE = [
    [0, 0, 0],
    [1, 2, 0.5],
    [3, 2.5, 1],
    [4, 1, 2],
    [6, 0.5, 2],
    [7, 2, 1],
    [8, 4, 0],
    [9, 4, 2],
]
KINDS = {
    "expression": {"x": "cos(t)", "y": "sin(2*t)", "z": "t**3", "t": [-1, "pi"]},
    "points": {"points": SPACE},
    "points-cubic": {"points": SPACE, "degree": 3},
    "points-closed": {"points": SPACE, "closed": True},
    "bspline": {
        "degree": 3,
        "knots": [0, 0, 0, 0, 1, 2, 2, 4, 5, 5, 5, 5],
        "control_points": SPACE,
    },
    "bspline-rational": {
        "degree": 2,
        "knots": [0, 0, 0, 1, 2, 3, 4, 5, 6, 6, 6],
        "control_points": SPACE,
        "weights": [1, 2, 0.5, 1, 3, 1, 1, 2],
    },
    "polyline": {"points": SPACE},
    "polyline-rounded": {"points": SPACE, "corner_radius": 0.25},
    "polyline-closed": {"points": SQUARE, "closed": True, "corner_radius": 1},
    "line": {"from": [1, 2, 3], "to": [-1, 5, 2]},
    "chain": {
        "curves": [
            {"kind": "line", "from": [-2, 0, 0], "to": [0, 0, 0]},
            {"kind": "expression", "x": "t", "y": "t**2", "z": "t**4", "t": [0, 1]},
            {"kind": "polyline", "points": [[1, 1, 1], [2, 1, 1], [2, 2, 1]]},
        ]
    },
    "circle": {"radius": 2.5, "center": [1, 2, 3], "normal": [1, 1, 0], "start": 30, "sweep": -90},
    "ellipse": {"radii": [3, 1], "normal": [0, 0, -2]},
    "helix": {"radius": 2, "pitch": -3, "turns": 1.5},
    "natural": {"curvature": "1 + t/2", "torsion": "sin(t)", "t": [0, 5]},
    "pseudo-antipodal": {
        "on": {"kind": "points", "points": SQUARE, "closed": True},
        "point": [1.5, 2.5, 0],
        "s": "0.3 + t/5",
    },
    "pseudo-antipodal-surface": {
        "on": "x**2/9 + y**2/4 + z**4 - 1",
        "curve": {"kind": "ellipse", "radii": [3, 2], "start": 20, "sweep": 200},
        "point": [0.5, 1, 0.25],
        "s": 0.25,
    },
}


def kind_of(name):
    """The kind of a row: what stands before the hyphen, unless the kind has one itself."""
    return "pseudo-antipodal" if name.startswith("pseudo") else name.split("-")[0]


def kind(name):
    return make(kind=kind_of(name), **KINDS[name])


@pytest.mark.parametrize("name", KINDS)
def test_every_coefficient_is_the_derivative_of_the_one_before(name):
    curve = kind(name)
    t, h = inside(curve), 1e-4 * (curve.domain[1] - curve.domain[0])
    ends = np.array([curve.domain[0], *curve.breaks, *curve.corners, curve.domain[1]])
    t = t[np.abs(t[:, None] - ends).min(axis=1) > 2.5 * h]
    jet = curve.jet(t, 6)
    for k in range(6):
        f = [curve.jet(t + s * h, k)[k] for s in (-2, -1, 1, 2)]
        difference = (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h)  # error h^4 f^(5)/30
        size = np.abs(jet).max(axis=(1, 2))
        limit = 1e-12 * (1 + size[k]) / h + 1e-6 * (k + 1) * size[k + 1]  # rounding / h, h^4
        assert np.abs(difference - (k + 1) * jet[k + 1]).max() <= limit


@pytest.mark.parametrize("name", KINDS)
def test_the_result_does_not_depend_on_how_the_points_are_split(name):
    curve = kind(name)
    t = np.concatenate([inside(curve, 41), curve.breaks, curve.corners, curve.domain])
    whole = curve.jet(t, 4)
    single = np.concatenate([curve.jet(t[i : i + 1], 4) for i in range(len(t))], axis=1)
    np.testing.assert_array_equal(whole, single)


@pytest.mark.parametrize("name", KINDS)
def test_pieces_join_up_and_have_a_tangent_everywhere(name):
    curve = kind(name)
    pieces = curve.pieces()
    assert len(pieces) == len(curve.corners) + 1
    assert (pieces[0].domain[0], pieces[-1].domain[1]) == curve.domain
    for before, after in pairwise(pieces):
        assert before.domain[1] == after.domain[0]
        gap = before.point(before.domain[1]) - after.point(after.domain[0])
        assert np.abs(gap).max() < 1e-12  # one rounding of the parameter
    for piece in pieces:
        assert not piece.corners
        t = np.array(piece.breaks)
        if t.size:  # the tangent is continuous across a break
            left, right = curve.jet(np.nextafter(t, -np.inf), 1)[1], curve.jet(t, 1)[1]
            np.testing.assert_allclose(left, right, atol=1e-11 * np.abs(right).max())


@pytest.mark.parametrize("name", ["polyline", "polyline-rounded", "line", "chain", "natural"])
def test_the_parameter_is_proportional_to_length(name):
    curve = kind(name)
    v = speed(curve, inside(curve))
    np.testing.assert_allclose(v, v[0], rtol=1e-13)


@pytest.mark.parametrize("name", ["expression", "points", "bspline-rational", "helix", "natural"])
def test_curvature_and_torsion_do_not_change_under_motions(name):
    curve = kind(name)
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    moved = Curve(lambda t, order: curve.jet(t, order) @ q.T, curve.domain)
    t = inside(curve)
    for ours, theirs in zip(
        curvature_and_torsion(curve, t), curvature_and_torsion(moved, t), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-11)


def test_curvature_and_torsion_do_not_change_under_reparametrisation():
    one = make(kind="expression", x="t", y="t**2", z="t**3", t=[0, 1])
    two = make(
        kind="expression", x="sinh(t)", y="sinh(t)**2", z="sinh(t)**3", t=[0, "log(1 + sqrt(2))"]
    )
    s = np.linspace(0, 0.88, 23)
    for ours, theirs in zip(
        curvature_and_torsion(one, np.sinh(s)), curvature_and_torsion(two, s), strict=True
    ):
        np.testing.assert_allclose(ours, theirs, rtol=1e-13)


# --- circle, ellipse, helix, line ------------------------------------------------------------


def test_circle_starts_on_its_x_axis_and_turns_about_its_normal():
    curve = make(kind="circle", radius=2)
    assert curve.domain == (0.0, 2 * math.pi) and curve.closed
    t = np.array([0, math.pi / 2, math.pi])
    np.testing.assert_allclose(curve.point(t), [[2, 0, 0], [0, 2, 0], [-2, 0, 0]], atol=1e-15)
    tilted = make(kind="circle", radius=2, normal=[0, 3, 0], center=[1, 1, 1])
    np.testing.assert_allclose(tilted.point(t[:2]), [[3, 1, 1], [1, 1, -1]], atol=1e-15)
    along_x = make(kind="circle", radius=2, normal=[1, 0, 0])
    np.testing.assert_allclose(along_x.point(t[:2]), [[0, 2, 0], [0, 0, 2]], atol=1e-15)


def test_a_negative_sweep_goes_clockwise_from_the_same_start():
    curve = make(kind="circle", radius=1, start=90, sweep=-90)
    assert not curve.closed
    points = curve.point(np.array(curve.domain))
    np.testing.assert_allclose(points, [[0, 1, 0], [1, 0, 0]], atol=1e-15)


def test_curvature_of_circle_ellipse_and_helix_are_the_closed_forms():
    t = np.linspace(0.1, 1.4, 7)
    k, tau = curvature_and_torsion(make(kind="circle", radius=2.5, normal=[1, 2, 3]), t)
    np.testing.assert_allclose(k, 0.4, rtol=1e-14)
    np.testing.assert_allclose(tau, 0.0, atol=1e-14)
    k, _ = curvature_and_torsion(make(kind="ellipse", radii=[3, 2]), t)
    np.testing.assert_allclose(k, 6 / (9 * np.sin(t) ** 2 + 4 * np.cos(t) ** 2) ** 1.5, rtol=1e-14)
    for pitch in (3.0, -3.0):
        k, tau = curvature_and_torsion(make(kind="helix", radius=2, pitch=pitch, turns=3), t)
        c = pitch / (2 * math.pi)
        np.testing.assert_allclose(k, 2 / (4 + c * c), rtol=1e-14)
        np.testing.assert_allclose(tau, c / (4 + c * c), rtol=1e-13)  # right-handed: positive


def test_helix_starts_on_the_x_axis_and_climbs_by_its_pitch():
    curve = make(kind="helix", radius=2, pitch=3, turns=2)
    points = curve.point(np.array([0.0, math.pi / 2, 4 * math.pi]))
    np.testing.assert_allclose(points, [[2, 0, 0], [0, 2, 0.75], [2, 0, 6]], atol=1e-14)


def test_line_is_exact():
    curve = make(kind="line", **{"from": [1, 2, 3], "to": [3, 0, 4]})
    np.testing.assert_array_equal(curve.point([0, 0.5, 1]), [[1, 2, 3], [2, 1, 3.5], [3, 0, 4]])
    assert not curve.closed and curve.breaks == curve.corners == ()


# --- splines ---------------------------------------------------------------------------------


def through(f, u, **keys):
    return make(kind="points", points=[list(map(float, f(x))) for x in u], **keys)


def test_a_spline_reproduces_a_quintic():
    def quintic(t):  # next to a circle, so that equal chord / parameter ratios exist
        t = np.asarray(t)
        x, y = t - t**3 / 6 + t**5 / 120, 1 - t**2 / 2 + t**4 / 24
        return np.stack([x, y, t**5 / 100], axis=-1)

    def stretch(low, high):
        return np.linalg.norm(quintic(high) - quintic(low)) / (high - low) - 0.9983

    t = [-0.7]
    for _ in range(8):  # knots where the chord length is proportional to the parameter
        t.append(brentq(lambda high: stretch(t[-1], high), t[-1] + 0.05, t[-1] + 0.4, xtol=1e-15))
    curve = make(kind="points", points=quintic(t).tolist())
    u, length = np.linspace(0, 1, 101), t[-1] - t[0]
    s = t[0] + u * length
    assert len(curve.breaks) == 3 and not curve.closed
    np.testing.assert_allclose(curve.point(u), quintic(s), atol=1e-14)
    fifth = np.array([1 / 120, 0, 1 / 100]) * length**5
    np.testing.assert_allclose(curve.jet(u, 5)[5], np.tile(fifth, (101, 1)), atol=1e-10)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 6, 7, 25])
def test_few_points_lower_the_degree(degree, n):
    points = np.random.default_rng(degree + n).normal(size=(n, 3)).cumsum(axis=0)
    curve = make(kind="points", points=points.tolist(), degree=degree)
    k = min(degree, n - 1)
    assert len(curve.breaks) == max(0, n - k - 1)  # not-a-knot: (k - 1)/2 knots less at each end
    jet = curve.jet(inside(curve), k + 2)
    assert not jet[k + 1 :].any() and np.abs(jet[k]).max() > 0


def test_a_straight_line_keeps_its_parameter_whatever_the_spacing():
    # on a straight line the chord length is the coordinate itself: x = L u, whatever the spacing
    x = np.sort(np.random.default_rng(0).uniform(0, 10, 40))
    curve = make(kind="points", points=[[v, 2 * v, 0] for v in x])
    t = np.linspace(0, 1, 301)
    np.testing.assert_allclose(curve.point(t)[:, 0], x[0] + t * (x[-1] - x[0]), atol=2e-12)


def test_quintic_interpolation_is_of_sixth_order():
    errors = []
    for n in (20, 40, 80):
        s = np.linspace(0, 2, n)
        curve = through(lambda v: (np.cos(v), np.sin(v), 0), s)  # equal chords: u = s / 2
        t = np.linspace(0, 1, 1003)
        exact = np.stack([np.cos(2 * t), np.sin(2 * t), 0 * t], axis=1)
        errors.append(np.abs(curve.point(t) - exact).max())
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert order.min() > 5.7  # 6, the ends settle slowly


def test_cubic_interpolation_is_scipys_not_a_knot_spline():
    points = np.array(SPACE, dtype=float)
    u = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    theirs = CubicSpline(u / u[-1], points)
    curve = make(kind="points", points=SPACE, degree=3)
    t = np.linspace(0, 1, 201)
    np.testing.assert_allclose(curve.point(t), theirs(t), atol=1e-13)
    np.testing.assert_allclose(2 * curve.jet(t, 2)[2], theirs(t, 2), atol=1e-9)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("n", [3, 4, 5, 6, 8])
def test_a_closed_spline_closes_with_all_its_derivatives(n, degree):
    curve = make(kind="points", points=SPACE[:n], closed=True, degree=degree)
    assert curve.closed
    k = min(degree, n - 1)
    ends = curve.jet(np.array([0.0, 1.0]), k - 1)
    scale = np.abs(curve.jet(np.linspace(0, 1, 99), k - 1)).max(axis=(1, 2))
    assert (np.abs(ends[:, 0] - ends[:, 1]).max(axis=1) <= 1e-12 * scale).all()
    again = make(kind="points", points=[*SPACE[:n], SPACE[0]], closed=True, degree=degree)
    t = np.linspace(0, 1, 50)
    np.testing.assert_array_equal(curve.jet(t, 3), again.jet(t, 3))


def test_a_spline_is_four_times_differentiable_at_its_knots():
    curve = make(kind="points", points=SPACE)
    t = np.array(curve.breaks)
    left, right = curve.jet(np.nextafter(t, -np.inf), 5), curve.jet(t, 5)
    for k in range(5):
        np.testing.assert_allclose(left[k], right[k], atol=1e-10 * np.abs(right[k]).max())
    assert np.abs(left[5] - right[5]).max() > 1e-3 * np.abs(right[5]).max()


def test_a_rational_quadratic_is_a_circle():
    h = math.sqrt(0.5)
    corner = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]]
    curve = make(
        kind="bspline",
        degree=2,
        knots=[0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
        control_points=[[x, y, 5] for x, y in corner],
        weights=[1, h] * 4 + [1],
    )
    assert curve.closed and curve.breaks == (1.0, 2.0, 3.0) and curve.corners == ()
    t = np.linspace(0, 4, 77)
    np.testing.assert_allclose(np.linalg.norm(curve.point(t)[:, :2], axis=1), 1.0, rtol=1e-15)
    k, _ = curvature_and_torsion(curve, t)
    np.testing.assert_allclose(k, 1.0, rtol=1e-13)


def test_a_knot_of_full_multiplicity_is_a_corner_only_where_the_tangent_jumps():
    table = {"kind": "bspline", "degree": 2, "knots": [0, 0, 0, 1, 1, 3, 3, 3]}
    bent = make(**table, control_points=[[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [3, 3, 0]])
    assert bent.corners == (1.0,) and bent.breaks == () and len(bent.pieces()) == 2
    straight = make(**table, control_points=[[0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0], [5, 1, 0]])
    assert straight.corners == () and straight.breaks == (1.0,)


def test_an_unclamped_bspline_lives_between_its_inner_knots():
    curve = make(
        kind="bspline",
        degree=3,
        knots=list(range(12)),
        control_points=[[i, 0, 0] for i in range(8)],
    )
    assert curve.domain == (3.0, 8.0)
    t = np.linspace(3, 8, 11)
    np.testing.assert_allclose(curve.point(t)[:, 0], t - 2, atol=1e-14)  # linear precision


# --- polylines and chains --------------------------------------------------------------------


def test_polyline_corners_stand_at_fractions_of_the_length():
    curve = make(kind="polyline", points=[[0, 0, 0], [3, 0, 0], [3, 1, 0], [3, 4, 0]])
    assert curve.corners == (3 / 7,) and curve.breaks == ()  # the third point is on the line
    first, second = curve.pieces()
    np.testing.assert_array_equal(first.jet(np.array([3 / 7]), 1)[1], [[7, 0, 0]])
    np.testing.assert_array_equal(second.jet(np.array([3 / 7]), 1)[1], [[0, 7, 0]])


def test_fillets_touch_both_sides_and_have_the_radius():
    r, points = 0.5, np.array(SPACE, dtype=float)
    curve = make(kind="polyline", points=SPACE, corner_radius=r)
    assert curve.corners == () and len(curve.breaks) == 2 * (len(points) - 2)
    ends = np.array(curve.breaks).reshape(-1, 2)
    edges = np.diff(points, axis=0)
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    middle = ends.mean(axis=1)
    k, _ = curvature_and_torsion(curve, middle)
    np.testing.assert_allclose(k, 1 / r, rtol=1e-12)
    for i, (start, end) in enumerate(ends):
        for t, d, vertex in ((start, along[i], points[i + 1]), (end, along[i + 1], points[i + 1])):
            jet = curve.jet(np.array([t]), 1)[:, 0]
            assert np.linalg.norm(np.cross(jet[0] - vertex, d)) < 1e-14  # on the side's line
            np.testing.assert_allclose(jet[1] / np.linalg.norm(jet[1]), d, atol=1e-13)


def test_a_rounded_square_has_the_length_of_its_sides_and_one_circle():
    curve = make(kind="polyline", points=SQUARE, closed=True, corner_radius=1)
    assert curve.closed and len(curve.breaks) == 7
    np.testing.assert_allclose(speed(curve, [0.1, 0.6]), 4 * 2 + 2 * math.pi, rtol=1e-15)
    np.testing.assert_allclose(curve.point(0.0), [[1, 0, 0]], atol=1e-15)
    full = make(kind="polyline", points=SQUARE, closed=True, corner_radius=2)  # the sides vanish
    r = np.linalg.norm(full.point(np.linspace(0, 1, 33)) - [2, 2, 0], axis=1)
    np.testing.assert_allclose(r, 2.0, rtol=1e-14)


def test_a_closed_polyline_keeps_its_corners_and_its_start():
    curve = make(kind="polyline", points=[*SQUARE, SQUARE[0]], closed=True)
    assert curve.closed and curve.corners == (0.25, 0.5, 0.75)
    np.testing.assert_array_equal(curve.point([0.0, 1.0]), [[0, 0, 0], [0, 0, 0]])


def test_the_refusal_of_a_radius_gives_the_largest_that_fits():
    table = {"kind": "polyline", "points": [[0, 0, 0], [2, 0, 0], [2, 2, 0]]}
    error = refusal(**table, corner_radius=2.1)
    assert isinstance(error, JobError) and error.limit == pytest.approx(2.0) and error.value == 2.1
    make(**table, corner_radius=error.limit)
    assert "straight back" in str(
        refusal(kind="polyline", points=[[0, 0, 0], [2, 0, 0], [1, 0, 0]], corner_radius=0.1)
    )


def test_a_chain_of_line_and_arc_stays_exact():
    curve = make(
        kind="chain",
        curves=[
            {"kind": "line", "from": [-3, -1, 0], "to": [0, -1, 0]},
            {"kind": "circle", "radius": 1, "start": -90, "sweep": 180},
            {"kind": "line", "from": [0, 1, 0], "to": [-3, 1, 0]},
            {"kind": "line", "from": [-3, 1, 0], "to": [-3, -1, 0]},
        ],
        closed=True,
    )
    total = 8 + math.pi
    assert curve.closed
    np.testing.assert_allclose(curve.breaks, [3 / total, (3 + math.pi) / total], rtol=1e-15)
    np.testing.assert_allclose(curve.corners, [(6 + math.pi) / total], rtol=1e-15)
    t = (3 + np.linspace(0.01, 3.1, 20)) / total
    np.testing.assert_allclose(np.linalg.norm(curve.point(t), axis=1), 1.0, rtol=1e-15)
    k, _ = curvature_and_torsion(curve, t)
    np.testing.assert_allclose(k, 1.0, rtol=1e-13)


def test_a_chain_measures_an_ellipse_like_the_elliptic_integral():
    a, b = 3.0, 1.0
    curve = make(kind="chain", curves=[{"kind": "ellipse", "radii": [a, b]}])
    # arc length from the x axis: b E(phi | 1 - a^2/b^2)
    angle = np.linspace(0, 2 * np.pi, 41)
    length = b * ellipeinc(angle, 1 - a * a / b**2)
    points = curve.point(length / length[-1])
    exact = np.stack([a * np.cos(angle), b * np.sin(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(points, exact, atol=1e-13 * a)  # 1e-14 of the length, 13.4
    np.testing.assert_allclose(speed(curve, np.linspace(0, 1, 301)), length[-1], rtol=1e-13)
    assert curve.closed


def test_the_speed_series_of_a_chain_is_constant_to_all_orders():
    curve = make(
        kind="chain",
        curves=[{"kind": "expression", "x": "t", "y": "t**2", "z": "t**3", "t": [0, 2]}],
    )
    jet = curve.jet(np.linspace(0, 1, 29), 6)
    series = taylor.norm(taylor.derivative(jet))
    np.testing.assert_allclose(series[1:] / series[0], 0.0, atol=1e-9 * np.abs(jet).max() / 1e3)


def test_a_chain_keeps_the_corners_and_breaks_of_its_curves():
    curve = make(
        kind="chain",
        curves=[
            {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]},
            {"kind": "polyline", "points": [[1, 1, 0], [1, 3, 0], [3, 3, 0]], "corner_radius": 1},
        ],
    )
    total = 1 + 1 + 1 + math.pi / 2 + 1
    np.testing.assert_allclose(curve.corners, [1 / total], rtol=1e-15)
    np.testing.assert_allclose(
        np.multiply(curve.breaks, total), [2, 3, 3 + math.pi / 2], rtol=1e-15
    )


def test_a_chain_must_meet_within_a_nanometre_in_any_unit():
    def table(gap):
        return {
            "kind": "chain",
            "curves": [
                {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]},
                {"kind": "line", "from": [1, gap, 0], "to": [1, 1, 0]},
            ],
        }

    curve = SPEC.validate_python(table(9e-7)).curve()
    join = np.array([np.nextafter(curve.corners[0], 0), curve.corners[0]])
    assert np.ptp(curve.point(join), axis=0).max() < 1e-15  # the second is moved to meet the first
    with pytest.raises(JobError, match=r"curve 1 .* starts .* from the end of curve 0"):
        SPEC.validate_python(table(2e-6)).curve()
    with pytest.raises(JobError, match="limit 1e-09"):
        SPEC.validate_python(table(9e-7), context={"mm_per_unit": 1000.0}).curve()
    with pytest.raises(JobError, match=r"curve 0 .* starts .* from the end of curve 1"):
        SPEC.validate_python({**table(0), "closed": True}).curve()


# --- natural ---------------------------------------------------------------------------------


@pytest.mark.parametrize("turns", [1, 30])
def test_constant_curvature_and_torsion_give_the_helix(turns):
    radius, climb = 2.0, 0.5
    w = math.hypot(radius, climb)
    curve = make(
        kind="natural",
        curvature=radius / w**2,
        torsion=climb / w**2,
        t=[0, 2 * math.pi * w * turns],
        origin=[radius, 0, 0],
        frame=[[0, radius / w, climb / w], [-1, 0, 0], [0, -climb / w, radius / w]],
    )
    s = np.linspace(*curve.domain, 501)
    u = s / w
    helix = np.stack([radius * np.cos(u), radius * np.sin(u), climb * u], axis=1)
    np.testing.assert_allclose(curve.point(s), helix, atol=1e-12)
    third = np.stack([np.sin(u), -np.cos(u), 0 * u], axis=1) * radius / w**3 / 6
    np.testing.assert_allclose(curve.jet(s, 3)[3], third, atol=1e-13)


def test_linear_curvature_gives_the_clothoid():
    curve = make(kind="natural", curvature="pi*t", torsion=0, t=[0, 8])
    s = np.linspace(0, 8, 201)
    y, x = fresnel(s)
    np.testing.assert_allclose(curve.point(s), np.stack([x, y, 0 * s], axis=1), atol=1e-13)


@pytest.mark.parametrize("t", [[0, 10], [-20, 20]])
def test_a_natural_curve_has_its_curvature_its_torsion_and_unit_speed(t):
    curve = make(kind="natural", curvature="1", torsion="t", t=t)
    s = np.linspace(*t, 313)
    k, tau = curvature_and_torsion(curve, s)
    np.testing.assert_allclose(k, 1.0, rtol=1e-13)
    np.testing.assert_allclose(tau, s, atol=1e-12)
    np.testing.assert_allclose(speed(curve, s), 1.0, rtol=2e-15)


def test_a_natural_curve_starts_with_its_frame():
    curve = make(
        kind="natural",
        curvature="2 + t",
        torsion=1,
        t=[1, 2],
        origin=[1, 2, 3],
        frame=[[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    )
    jet = curve.jet(np.array([1.0]), 2)[:, 0]
    np.testing.assert_allclose(jet, [[1, 2, 3], [0, 1, 0], [0, 0, 1.5]], atol=1e-15)


def test_curvature_may_vanish_and_kink():
    for curvature in ("sin(t)", "abs(t - 1)", "0"):
        curve = make(kind="natural", curvature=curvature, torsion=0, t=[0, 7])
        s = np.linspace(0.003, 6.997, 99)
        theta = {
            "sin(t)": 1 - np.cos(s),
            "abs(t - 1)": 0.5 + np.sign(s - 1) * (s - 1) ** 2 / 2,
            "0": 0 * s,
        }[curvature]
        tangent = np.stack([np.cos(theta), np.sin(theta), 0 * s], axis=1)
        np.testing.assert_allclose(curve.jet(s, 1)[1], tangent, atol=1e-12)


def test_natural_refuses_what_it_cannot_follow():
    with pytest.raises(JobError, match="torsion is not a finite number at t = -1"):
        make(kind="natural", curvature=1, torsion="sqrt(t)", t=[-1, 2])
    with pytest.raises(JobError, match=r"curvature or the torsion reaches 1e\+20 near t = 0 "):
        make(kind="natural", curvature="1e20", torsion=0, t=[0, 2])
    with pytest.raises(LimitError, match="turns too often"):  # it winds round a point for ever
        make(kind="natural", curvature="1/(t - 1)", torsion=0, t=[0, 2])
    with pytest.raises(LimitError, match="turns too often"):
        make(kind="natural", curvature="1e9*t", torsion=0, t=[0, 2])


# --- what is refused -------------------------------------------------------------------------

REFUSED = [
    ({"kind": "circle", "radius": 0}, "greater than 0"),
    ({"kind": "circle", "radius": -1}, "greater than 0"),
    ({"kind": "circle", "radius": True}, "valid number"),
    ({"kind": "circle", "radius": "3"}, "valid number"),
    ({"kind": "circle", "radius": math.nan}, "finite"),
    ({"kind": "circle", "radius": math.inf}, "finite"),
    ({"kind": "circle", "radius": 1, "sweep": 361}, "sweep is 361"),
    ({"kind": "circle", "radius": 1, "sweep": 0}, "sweep is 0"),
    ({"kind": "circle", "radius": 1, "normal": [0, 0, 0]}, "no length"),
    ({"kind": "circle", "radius": 1, "x_axis": [0, 0, -2]}, "along the normal"),
    ({"kind": "circle", "radius": 1, "diameter": 2}, "Extra"),
    ({"kind": "circle", "radius": 1, "center": [1, 2]}, "[Ff]ield required|center"),
    ({"kind": "ellipse", "radii": [1, 0]}, "greater than 0"),
    ({"kind": "helix", "radius": 1, "pitch": 0, "turns": 1}, "pitch"),
    ({"kind": "helix", "radius": 1, "pitch": 1, "turns": -1}, "greater than 0"),
    ({"kind": "line", "from": [0, 0, 0], "to": [0, 0, 0]}, "the same|different"),
    ({"kind": "points", "points": [[0, 0, 0]]}, "1 points are too few"),
    ({"kind": "points", "points": [[0, 0, 0], [1, 0, 0]], "closed": True}, "at least 3"),
    ({"kind": "points", "points": [[0, 0, 0], [1, 0, 0], [1, 0, 0]]}, "points 1 and 2"),
    ({"kind": "points", "points": [[0, 0, 0], [1, 0, 0]], "degree": 4}, "3 or 5"),
    ({"kind": "points", "points": [[0, 0, 0], [1, 0, 0]], "closed": 1}, "boolean"),
    ({"kind": "points"}, "points or a file"),
    ({"kind": "points", "points": SQUARE, "file": "a.csv"}, "one of the two"),
    ({"kind": "expression", "x": "t", "y": "t", "z": 0, "t": [1, 1]}, "starts at 1"),
    ({"kind": "expression", "x": "t", "y": "t", "z": 0, "t": ["t", 1]}, "'t' is not known"),
    ({"kind": "expression", "x": "u", "y": "t", "z": 0, "t": [0, 1]}, "'u' is not known"),
    ({"kind": "expression", "x": True, "y": "t", "z": 0, "t": [0, 1]}, "neither a number"),
    ({"kind": "expression", "x": math.nan, "y": "t", "z": 0, "t": [0, 1]}, "not a finite"),
    ({"kind": "bspline", "degree": 3, "knots": [0, 1], "control_points": SQUARE}, "need 8"),
    ({"kind": "bspline", "degree": 4, "knots": [0] * 9, "control_points": SQUARE}, "at least 5"),
    (
        {"kind": "bspline", "degree": 1, "knots": [0, 0, 1, 0.5, 2, 2], "control_points": SQUARE},
        "less than the one before",
    ),
    (
        {"kind": "bspline", "degree": 1, "knots": [0, 0, 1, 1, 2, 2], "control_points": SQUARE},
        "occurs 2 times, limit 1",
    ),
    (
        {"kind": "bspline", "degree": 1, "knots": [0, 0, 0, 0, 0, 0], "control_points": SQUARE},
        "occurs 6 times",
    ),
    (
        {
            "kind": "bspline",
            "degree": 1,
            "knots": [0, 0, 1, 2, 3, 3],
            "control_points": SQUARE,
            "weights": [1, 1, 1, -1],
        },
        "greater than 0",
    ),
    ({"kind": "chain", "curves": []}, "at least 1"),
    (
        {"kind": "natural", "curvature": 1, "torsion": 0, "t": [0, 1], "frame": [[1, 0, 0]] * 3},
        "frame",
    ),
    ({"kind": "pretzel"}, "pretzel"),
    ({"radius": 1}, "kind"),
]


@pytest.mark.parametrize(("table", "message"), REFUSED, ids=lambda v: str(v)[:60])
def test_values_outside_their_domain_are_refused(table, message):
    with pytest.raises(ValidationError, match=message):
        SPEC.validate_python(table)


def test_a_coordinate_that_is_no_number_is_refused_with_its_place():
    with pytest.raises(JobError, match=r"y = 'sqrt\(t\)' is not a finite number at t = -1"):
        make(kind="expression", x="t", y="sqrt(t)", z=0, t=[-1, 1])


def test_points_of_a_file_must_have_been_read():
    with pytest.raises(JobError, match="were not read"):
        make(kind="points", file="rail.csv")


def test_the_cause_of_a_refusal_is_kept_for_its_exit_code():
    error = refusal(kind="expression", x="9**9**9**9", y="t", z=0, t=[0, 1])
    assert isinstance(error, LimitError) and error.code == 4


def test_the_schema_lists_every_kind_and_allows_text_for_expressions():
    schema = SPEC.json_schema()
    kinds = set(schema["discriminator"]["mapping"])
    assert kinds == {kind_of(name) for name in KINDS}
    assert json.dumps(schema)
    x = schema["$defs"]["ExpressionCurve"]["properties"]["x"]
    assert {option["type"] for option in x["anyOf"]} == {"number", "string"}


def test_models_are_frozen():
    class Box(Model):
        width: Positive

    box = Box(width=2)
    assert box.width == 2.0
    with pytest.raises(ValidationError):
        box.width = 3.0


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-20, 20)] * 3), min_size=3, max_size=12, unique=True),
    st.booleans(),
)
def test_splines_go_through_any_distinct_points(points, closed):
    curve = make(kind="points", points=[list(map(float, p)) for p in points], closed=closed)
    array = np.array([*points, points[0]] if closed else points, dtype=float)
    u = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(array, axis=0), axis=1))])
    # spacings of 1 : 50 make the quintic's equations ill-conditioned
    np.testing.assert_allclose(curve.point(u / u[-1]), array, atol=1e-8)
