"""Pseudo-antipodal curves against closed forms on quadrics and the incidences on other shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy.optimize import brentq

from devcad.errors import DevcadError, GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.curves import CurveSpec

ADAPTER = TypeAdapter(CurveSpec)
ELLIPSE = {"kind": "ellipse", "radii": [3, 2]}
ELLIPSOID = "x**2/9 + y**2/4 + z**2 - 1"
FORM = np.array([1 / 9, 1 / 4, 1.0])
ROUND = np.linspace(0, 2 * np.pi, 333)


def locus(on, point, s, **more):
    table = {"kind": "pseudo-antipodal", "on": on, "point": list(point), "s": s, **more}
    return ADAPTER.validate_python(table).curve()


def refusal(on, point, s=0.5, **more):
    try:
        locus(on, point, s, **more)
    except DevcadError as error:
        return error
    except ValidationError as errors:
        inner = errors.errors()[0].get("ctx", {}).get("error")
        assert isinstance(inner, DevcadError), errors
        return inner
    raise AssertionError("it was built")


def closed_form(t, order, point):
    """D = C - 2 B(C, W)/Q(W) W with W = A - C on the ellipse 3, 2, as a series."""
    sine, cosine = taylor.sin_cos(taylor.variable(t, order))
    c = np.stack([3 * cosine, 2 * sine, 0 * sine], axis=-1)
    w = -c
    w[0] += point
    lam = -2 * taylor.div(taylor.dot(FORM * c, w), taylor.dot(FORM * w, w))
    return c + taylor.mul(lam, w)


BY_CURVE = (ELLIPSE, {})
BY_SURFACE = (ELLIPSOID, {"curve": ELLIPSE})


@pytest.mark.parametrize(("on", "more"), [BY_CURVE, BY_SURFACE])
def test_o20_on_an_ellipse(on, more):
    expected = {
        (1, "C"): [2.0901201280414963, 1.4347121817990456],
        (0, "C"): [-1.5705022265938948, -1.7040504369509486],
        (0.5, "C"): [0.25980895072380067, -0.1346691275759516],
        (2, "C"): [5.750742482676888, 4.5734748005490395],
        # the other convention counts s from D
        (1, "D"): [-1.5705022265938948, -1.7040504369509486],
        (-1, "D"): [5.750742482676888, 4.5734748005490395],
    }
    for (s, start), point in expected.items():
        curve = locus(on, (1, 0.5, 0), s, **more, **{"from": start})
        np.testing.assert_allclose(curve.point(0.8)[0], [*point, 0], rtol=1e-12, atol=1e-15)
        assert curve.closed


@pytest.mark.parametrize(("on", "more"), [BY_CURVE, BY_SURFACE])
@pytest.mark.parametrize("point", [(1, 0.5, 0), (0, 0, 0), (2.9, 0.1, 0), (2.999999, 0, 0)])
def test_the_series_are_those_of_the_closed_form(on, more, point):
    found = locus(on, point, 0, **more).jet(ROUND, 5)
    exact = closed_form(ROUND, 5, np.array(point, dtype=float))
    sizes = np.abs(exact).max(axis=(1, 2))
    # near the boundary D runs past fast: lengths of the order of the gap enter to the fifth power
    for k in range(6):
        np.testing.assert_allclose(found[k], exact[k], atol=1e-9 * max(sizes[k], 1))
    np.testing.assert_allclose(found[0], exact[0], atol=1e-9)


@pytest.mark.parametrize(("on", "more"), [BY_CURVE, BY_SURFACE])
@pytest.mark.parametrize("point", [(4, 1, 0), (3, 1, 0)])  # the second: a tangent at the seam t = 0
def test_from_outside_d_passes_through_c_where_the_line_is_a_tangent(on, more, point):
    a = np.array(point, dtype=float)

    def touches(t):
        return a[0] * np.cos(t) / 3 + a[1] * np.sin(t) / 2 - 1

    at = brentq(touches, 0.3, 2.5, xtol=1e-15)
    steps = 10.0 ** np.arange(-12, -0.5, 0.5)
    t = np.concatenate([at - steps, [at], at + steps, ROUND])
    found = locus(on, point, 0, **more).jet(t, 4)
    exact = closed_form(t, 4, a)
    for k in range(5):  # a digit or so for each derivative
        np.testing.assert_allclose(found[k], exact[k], atol=1e-14 * 30.0 ** (k + 1))
    c = np.array([3 * np.cos(at), 2 * np.sin(at), 0])
    np.testing.assert_allclose(found[0, len(steps)], c, atol=1e-13)


@pytest.mark.slow
@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_midpoints_on_a_quadric_lie_on_a_homothetic_one(x, y, z):
    """Q(E) = B(E, A)."""
    spiral = {
        "kind": "expression",
        "x": "3*cos(t)*cos(t/3)",
        "y": "2*sin(t)*cos(t/3)",
        "z": "sin(t/3)",
        "t": [-2, 2],
    }
    a = np.array([x, y, z])
    e = locus(ELLIPSOID, a.tolist(), 0.5, curve=spiral).point(np.linspace(-2, 2, 41))
    np.testing.assert_allclose((e * e) @ FORM, (e * a) @ FORM, atol=1e-14)


def test_from_the_centre_s_scales_the_curve():
    curve = locus(ELLIPSOID, (0, 0, 0), "t/4", curve=ELLIPSE)
    c = np.stack([3 * np.cos(ROUND), 2 * np.sin(ROUND), 0 * ROUND], axis=1)
    np.testing.assert_allclose(curve.point(ROUND), (ROUND / 2 - 1)[:, None] * c, atol=1e-14)


STAR = {
    "kind": "expression",
    "x": "(1 + 0.3*cos(3*t))*cos(t)",
    "y": "(1 + 0.3*cos(3*t))*sin(t)",
    "z": "0",
    "t": [0, "2*pi"],
}


def test_on_a_star_shape_d_is_on_the_other_side():
    found = locus(STAR, (0, 0, 0), 0)
    r = 1 + 0.3 * np.cos(3 * (ROUND + np.pi))
    exact = -r[:, None] * np.stack([np.cos(ROUND), np.sin(ROUND), 0 * ROUND], axis=1)
    np.testing.assert_allclose(found.point(ROUND), exact, atol=1e-14)


def test_a_space_curve_symmetric_about_a():
    table = STAR | {"x": "cos(t)", "y": "sin(t)", "z": "0.3*cos(3*t)"}
    d = locus(table, (0, 0, 0), 0).point(ROUND)
    c = np.stack([np.cos(ROUND), np.sin(ROUND), 0.3 * np.cos(3 * ROUND)], axis=1)
    np.testing.assert_allclose(d, -c, atol=1e-14)


OVAL = [
    [3 * np.cos(a), 2 * np.sin(a) + 0.2 * np.cos(3 * a), 0]
    for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)
]


@pytest.mark.parametrize("point", [(0.4, 0.3, 0), (5, 0.3, 0)])
def test_on_a_spline_d_is_on_it_and_breaks_where_it_passes_a_knot(point):
    spline = {"kind": "points", "points": OVAL, "closed": True}
    curve = ADAPTER.validate_python(spline).curve()
    found = locus(spline, point, 0)
    assert found.closed
    assert not found.corners
    assert len(found.breaks) == 23 + 23
    a = np.array(point)
    t = np.linspace(0.003, 0.997, 101)
    c, d = curve.point(t), found.point(t)
    np.testing.assert_allclose(np.cross(d - c, a - c), 0.0, atol=1e-13)
    dense = curve.point(np.linspace(0, 1, 20001))
    away = np.linalg.norm(d[:, None] - dense[None], axis=2).min(axis=1)
    assert away.max() < 1e-3  # the step of the samples
    # between two breaks it is one analytic function: its series reaches across
    ends = np.array([0.0, *found.breaks, 1.0])
    wide = np.diff(ends) > 1e-3
    middle, step = 0.5 * (ends[1:] + ends[:-1])[wide], 0.1 * np.diff(ends)[wide]
    series = np.einsum("kn,kni->ni", step ** np.arange(9)[:, None], found.jet(middle, 8))
    np.testing.assert_allclose(series, found.point(middle + step), atol=1e-12)
    # the line back from D meets C
    back = found.point(
        np.array(
            [
                brentq(lambda s: np.cross(curve.point(s)[0] - a, d[7] - a)[2], *b)
                for b in _brackets(curve, a, d[7])
            ]
        )
    )
    assert np.linalg.norm(back - c[7], axis=1).min() < 1e-12


def _brackets(curve, a, d):
    s = np.linspace(0, 1, 400)
    sides = np.cross(curve.point(s) - a, d - a)[:, 2] > 0
    return [(s[k], s[k + 1]) for k in np.flatnonzero(sides[1:] != sides[:-1])]


def test_on_a_square_d_turns_the_corners():
    square = {
        "kind": "polyline",
        "points": [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]],
        "closed": True,
    }
    found = locus(square, (0.3, 0.2, 0), 0)
    # the line from the corner (1, -1) through A arrives at (x, 1), t from 0 to 1/4 being the side
    corners = [t for t in found.corners if t < 0.25]
    x = 0.3 - 0.7 * 0.8 / 1.2
    np.testing.assert_allclose(corners, [(1 - x) / 8], rtol=1e-13)
    assert len(found.corners) == 4
    t = np.linspace(0, 1, 401)
    assert np.abs(np.abs(found.point(t)).max(axis=1) - 1).max() < 1e-14
    for piece in found.pieces():
        velocity = piece.jet(np.linspace(*piece.domain, 9), 1)[1]
        heading = velocity / np.linalg.norm(velocity, axis=1)[:, None]
        np.testing.assert_allclose(heading, heading[:1].repeat(9, axis=0), atol=1e-12)
        low, high = piece.domain  # also at its very ends it is the piece's own series
        at = piece.jet(np.array([low, low + 1e-9, high - 1e-9, high]), 1)[1]
        np.testing.assert_allclose(at[[0, 3]], at[[1, 2]], rtol=1e-6, atol=1e-12)


def test_on_a_torus_the_first_point_beyond_a():
    winding = {
        "kind": "expression",
        "x": "(3 + cos(t))*cos(t/3)",
        "y": "(3 + cos(t))*sin(t/3)",
        "z": "sin(t)",
        "t": [0, 2],
    }
    a = np.array([3, 0.1, 0.1])
    torus = "(sqrt(x**2 + y**2) - 3)**2 + z**2 - 1"
    t = np.linspace(0, 2, 101)
    c = ADAPTER.validate_python(winding).curve().point(t)
    d = locus(torus, a.tolist(), 0, curve=winding).point(t)
    x, y, z = d.T
    np.testing.assert_allclose((np.hypot(x, y) - 3) ** 2 + z**2, 1.0, atol=1e-14)
    np.testing.assert_allclose(np.cross(d - c, a - c), 0.0, atol=1e-13)
    assert (np.einsum("ni,ni->n", d - a, c - a) < 0).all()


@pytest.mark.parametrize("scale", [1e-4, 1e4, 1e6])
def test_the_size_does_not_matter(scale):
    circle = {"kind": "circle", "radius": scale}
    sphere = f"x**2 + y**2 + z**2 - {scale!r}**2"
    for on, more in ((circle, {}), (sphere, {"curve": circle})):
        d = locus(on, (0.3 * scale, 0, 0), 0, **more).point(ROUND)
        np.testing.assert_allclose(np.linalg.norm(d, axis=1), scale, rtol=1e-13)


CIRCLE = {"kind": "circle", "radius": 1}
SPHERE = "x**2 + y**2 + z**2 - 1"
INSIDE = (0, 0, 0.1)
PARABOLA = {"kind": "expression", "x": "t", "y": "0", "z": "t**2", "t": [-1, 1]}


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        ({"on": CIRCLE, "point": (1, 0, 0)}, GeometryError, "lies on the curve"),
        ({"on": CIRCLE, "point": (0.6, 0.8, 0)}, GeometryError, "lies on the curve"),
        ({"on": SPHERE, "curve": CIRCLE, "point": (0, 0, 1)}, GeometryError, "on the surface"),
        (
            {"on": SPHERE, "curve": {**CIRCLE, "radius": 1.001}, "point": INSIDE},
            GeometryError,
            "0.001 away from the surface",
        ),
        ({"on": CIRCLE, "point": INSIDE}, GeometryError, "t = 0 through A meets the curve in no"),
        (
            {"on": {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]}, "point": (0, 1, 0)},
            GeometryError,
            "no second point",
        ),
        (
            {"on": {"kind": "helix", "radius": 1, "pitch": 1, "turns": 1}, "point": INSIDE},
            GeometryError,
            "no second point",
        ),
        ({"on": {**CIRCLE, "sweep": 90}, "point": (0, 0, 0)}, GeometryError, "no second point"),
        (
            {"on": "z - x**2 - y**2", "curve": PARABOLA, "point": (0.5, 0, 2)},
            GeometryError,  # the line along the axis, at t = 0.5, meets it only once
            "no second point",
        ),
        ({"on": "z", "curve": CIRCLE, "point": (0, 0, 1)}, GeometryError, "no second point"),
        ({"on": f"({SPHERE})**2", "curve": CIRCLE, "point": INSIDE}, JobError, "no gradient"),
        ({"on": "log(x)", "curve": CIRCLE, "point": INSIDE}, JobError, "no value"),
        ({"on": "1", "curve": CIRCLE, "point": INSIDE}, JobError, "no gradient"),
        ({"on": CIRCLE, "point": (0, 0, 0), "s": "log(t - 1)"}, JobError, "no finite value"),
        ({"on": SPHERE, "point": INSIDE}, JobError, "with a curve on that"),
        ({"on": CIRCLE, "curve": CIRCLE, "point": INSIDE}, JobError, "with a curve on that"),
        ({"on": "x**2 + q", "curve": CIRCLE, "point": INSIDE}, JobError, "'q' is not known"),
    ],
)
def test_what_has_no_second_intersection_is_refused_in_one_line(table, error, words):
    told = refusal(**table)
    assert type(told) is error
    assert words in str(told)
    assert told.remedy
