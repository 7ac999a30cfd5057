"""Envelopes of planes against the dual formulas of geometry.md, section 4, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from constructing import inside, patch, patches, refusal, regression
from hypothesis import given
from hypothesis import strategies as st

from devcad.errors import DevcadError, GeometryError, JobError
from devcad.geometry import elementary, taylor
from devcad.geometry.classify import classify
from devcad.geometry.constructions.turning import turning
from devcad.geometry.jets import parse

EXACT = 1e-12  # relative: rounding of a few hundred operations
HELIX = {"normal": ["cos(t)", "sin(t)", "1"], "offset": "t"}  # O18


def envelope(normal, offset, t, extent=(0, 1), **more):
    return patch(
        kind="envelope", normal=normal, offset=offset, t=list(t), extent=list(extent), **more
    )


def dual(normal, offset, t):
    """(n, d) and three derivatives at t, (4, n, 4), from the expressions alone."""
    series = np.stack([parse(text).at(t, 3) for text in (*normal, offset)], axis=-1)
    return series * np.array([1, 1, 2, 6])[:, None, None]


def det3(u):
    return np.linalg.det(np.moveaxis(u[:3, :, :3], 0, 1))


def det4(u):
    return np.linalg.det(np.moveaxis(u, 0, 1))


def edge(u):
    """(d n' x n'' + d' n'' x n + d'' n x n') / det3."""
    n, d = u[:3, :, :3], u[:3, :, 3]
    top = sum(d[i][:, None] * np.cross(n[j], n[k]) for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)))
    return top / det3(u)[:, None]


def test_the_ruling_of_o18_is_the_tangent_of_the_helix():
    strip = envelope(HELIX["normal"], HELIX["offset"], [0, 2], [2, 3])
    frame = strip.frame([1.0])
    ruling = [-0.38205142437008976, -0.5950098395293859, 0.7071067811865476]
    np.testing.assert_allclose(frame.e[0], ruling, rtol=EXACT)
    point = [-0.8414709848078965, 0.5403023058681398, 1.0]
    np.testing.assert_allclose(regression(frame)[0], point, rtol=EXACT)


TANGENT = (["1+t**2", "sin(t)", "exp(t/2)"], "t**3 + cos(t)")
CONE = (["1+t**2", "sin(t)", "exp(t/2)"], "2*(1+t**2) - sin(t) + 3*exp(t/2)")  # through (2, -1, 3)
CYLINDER = (["cos(t)*exp(t)", "2*sin(t)*exp(t)", "2*sin(t)*exp(t)"], "(3+t**2)*exp(t)")


@pytest.mark.parametrize(
    ("family", "kind"), [(TANGENT, "tangent"), (CONE, "cone"), (CYLINDER, "cylinder")]
)
def test_the_determinants_tell_the_type(family, kind):
    t = np.linspace(0.2, 1, 33)
    u = dual(*family, t)
    sizes = np.linalg.norm(u, axis=2).prod(axis=0)
    cylinder = np.abs(det3(u)).max() < 1e-12 * sizes.max()
    cone = np.abs(det4(u)).max() < 1e-12 * sizes.max()
    assert kind == ("cylinder" if cylinder else "cone" if cone else "tangent")
    strip = envelope(*family, [0.2, 1], [20, 21])
    assert classify(strip).type == kind
    if kind != "cylinder":
        np.testing.assert_allclose(regression(strip.frame(t)), edge(u), rtol=1e-10)


def test_the_foot_is_the_point_of_both_planes_nearest_the_origin():
    strip = envelope(*TANGENT, [0, 1])
    t = inside(strip)
    u, jet = dual(*TANGENT, t), strip.jet(t, 0)
    for k in (0, 1):
        on = np.einsum("ni,ni->n", u[k, :, :3], jet.c0[0]) - u[k, :, 3]
        np.testing.assert_allclose(on, 0.0, atol=1e-13)
    np.testing.assert_allclose(np.einsum("ni,ni->n", jet.c0[0], jet.e[0]), 0.0, atol=1e-13)
    w = np.cross(u[0, :, :3], u[1, :, :3])
    along = np.einsum("ni,ni->n", w, jet.e[0]) / np.linalg.norm(w, axis=1)
    np.testing.assert_allclose(along, 1.0, atol=1e-14)


FACTORS = ["2 + sin(3*t)", "-1 - t**2", "exp(5*t)", "1e-6", "1e6*(1 + t)", "-cosh(t)"]


@given(st.sampled_from(FACTORS), st.floats(-3, 3), st.sampled_from([1e-4, 1.0, 1e4]))
def test_a_factor_on_the_planes_and_the_scale_of_t_change_nothing(factor, shift, scale):
    """(n, d) -> (lambda n, lambda d) and t -> scale t leave the points where they are."""
    normal, offset = TANGENT
    there = envelope(normal, offset, [0, 1], [1, 2])
    s = f"(t/{scale!r} - ({shift!r}))"
    moved = [
        f"({f})*({g})".replace("t", "@").replace("@an", "tan") for g in normal for f in [factor]
    ]
    moved = [text.replace("sin", "SIN").replace("@", s).replace("SIN", "sin") for text in moved]
    d = f"({factor})*({offset})".replace("t", s)
    same = envelope(moved, d, [scale * shift, scale * (1 + shift)], [1, 2])
    t = np.linspace(0, 1, 17)
    one, two = there.jet(t, 0), same.jet(np.clip(scale * (t + shift), *same.domain), 0)
    # a shift of t by rounding moves the point by as much
    np.testing.assert_allclose(two.e, one.e, atol=1e-13)
    np.testing.assert_allclose(two.c0, one.c0, atol=1e-12)


def test_time_reversed_reverses_the_ruling():
    there = envelope(HELIX["normal"], "t", [0, 1])
    back = envelope(["cos(t)", "-sin(t)", "1"], "-t", [-1, 0])
    t = np.linspace(0, 1, 9)
    np.testing.assert_allclose(back.jet(-t, 0).e, -there.jet(t, 0).e, atol=1e-15)
    np.testing.assert_allclose(back.jet(-t, 0).c0, there.jet(t, 0).c0, atol=1e-15)


DISTANCES = np.concatenate([[0.0], 10.0 ** np.arange(-12, 0, 0.25)])


@pytest.mark.parametrize("factor", ["1", "(2 + sin(t))"])
@pytest.mark.parametrize("place", [0.0, 0.3, 1 / 3])
@pytest.mark.parametrize("power", [3, 5, 7])
def test_a_moment_of_rest_costs_no_digits(power, place, factor):
    """The helix's planes at s = (t - t0)^power: n' has a zero of order power - 1 at t0, and yet
    ruling and foot and four derivatives are those of s, composed, 1e-12 to 1 away from t0."""
    s = f"((t - {place!r})**{power})"
    parts = [parse(f"{factor}*{g}") for g in (f"cos{s}", f"sin{s}", "1", f"(5 + {s})")]

    def planes(t):
        return np.stack([part.series(t=t) for part in parts], axis=-1)

    found = turning(planes, np.array([-1.0, 1.0]), "planes")
    assert found.backward == ()
    assert found.stops == pytest.approx([place], abs=1e-14)
    t = place + np.concatenate([-DISTANCES[::-1], DISTANCES])
    t = t[np.abs(t) <= 1]
    foot, e = found.rays(t, 4)
    step = taylor.variable(t, 4)
    step[0] -= place
    inner = elementary.power(step, float(power))
    cosine, sine = np.cos(inner[0]), np.sin(inner[0])
    root = np.sqrt(0.5)
    sines = [sine, cosine, -sine, -cosine, sine]
    cosines = [cosine, -sine, -cosine, sine, cosine]
    factorial = np.array([1, 1, 2, 6, 24])
    zero = np.zeros_like(t)
    ruling = [
        np.stack([-c * root, -x * root, zero + root * (k == 0)], axis=-1) / factorial[k]
        for k, (c, x) in enumerate(zip(cosines, sines, strict=True))
    ]
    outer = np.array(ruling)
    np.testing.assert_allclose(e, taylor.compose(outer, inner), atol=1e-11)
    # the helix lowered to d = s + 5: (-sin s, cos s, s + 5), less its part along e
    helix = [np.stack([-x, c, zero], axis=-1) for c, x in zip(cosines, sines, strict=True)]
    series = np.array(helix) / factorial[:, None, None]
    series[0, :, 2], series[1, :, 2] = inner[0] + 5, 1.0
    lean = taylor.mul(taylor.dot(series, outer), outer)
    np.testing.assert_allclose(foot, taylor.compose(series - lean, inner), atol=1e-10)
    np.testing.assert_allclose(e[:2], taylor.compose(outer, inner)[:2], atol=1e-13)
    np.testing.assert_allclose(foot[:2], taylor.compose(series - lean, inner)[:2], atol=1e-12)


UNDULATING = (["15*t**4", "-10*t**3", "1"], "6*t**5")  # osculating planes of (t, t^2, t^5)


@pytest.mark.parametrize("domain", [(-1, 1), (0, 1), (-1, 0), (1e-9, 1), (1e-3, 1), (-0.7, 1)])
def test_the_osculating_planes_of_a_curve_with_a_flat_point_envelop_its_tangents(domain):
    strip = envelope(*UNDULATING, domain, [5, 6])
    t = inside(strip, 401)
    jet = strip.jet(t, 1)
    velocity = np.stack([np.ones_like(t), 2 * t, 5 * t**4], axis=1)
    e = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    np.testing.assert_allclose(jet.e[0], e, atol=1e-14)
    point = np.stack([t, t**2, t**5], axis=1)
    foot = point - np.einsum("ni,ni->n", point, e)[:, None] * e
    np.testing.assert_allclose(jet.c0[0], foot, atol=1e-14)
    frame = strip.frame(t)
    assert np.abs(frame.residual_e).max() < 1e-12
    assert np.abs(frame.residual_c0).max() < 1e-12


def test_an_inflected_cylinder_may_end_where_its_planes_turn_back():
    """z = x^3 from its inflection on: the planes' n' vanishes at the end, to the first order."""
    for domain, sign in (((0, 1), 1.0), ((-1, 0), -1.0)):
        strip = envelope(["-3*t**2", "0", "1"], "-2*t**3", domain)
        t = inside(strip)
        jet = strip.jet(t, 0)
        np.testing.assert_allclose(jet.e[0], np.tile([0, -sign, 0], (len(t), 1)), atol=1e-15)
        np.testing.assert_allclose(jet.c0[0], np.stack([t, 0 * t, t**3], axis=1), atol=1e-15)


def test_planes_through_a_spline_give_the_family_back():
    """Of 12 planes of O18 a quintic misses the family by its sixth order only."""
    errors = []
    for number in (12, 24, 48):
        a = np.linspace(0, 2, number)
        rows = np.stack([np.cos(a), np.sin(a), np.ones_like(a), a], axis=1)
        (strip,) = patches(kind="envelope", planes=rows.tolist(), extent=[2, 3])
        assert strip.domain == (0.0, 1.0)
        t = np.linspace(0.3, 0.7, 41)
        frame = strip.frame(t)
        x, y, _ = regression(frame).T
        errors.append(np.abs(np.hypot(x, y) - 1).max())
    assert errors[0] < 1e-3
    # the edge takes two derivatives of a spline of degree five: order 4
    assert np.log2(errors[1] / errors[2]) > 3.5


def test_the_two_forms_agree_on_a_polynomial_family():
    """Six planes of a family of degree five in the spline's own parameter."""
    rows = np.array([[1, 0, 1, 0], [0.8, 0.5, 1, 1.0], [0.3, 0.9, 1, 2.0]])
    (strip,) = patches(kind="envelope", planes=rows.tolist(), extent=[1, 2])
    chords = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    u = float(chords[0] / chords.sum())
    weights = [
        f"(t - {u!r})*(t - 1)/{u!r}",
        f"t*(t - 1)/({u!r}*({u!r} - 1))",
        f"t*(t - {u!r})/(1 - {u!r})",
    ]
    columns = [
        " + ".join(f"({row[k]!r})*{w}" for row, w in zip(rows.tolist(), weights, strict=True))
        for k in range(4)
    ]
    other = envelope(columns[:3], columns[3], [0, 1], [1, 2])
    t = np.linspace(0, 1, 33)
    np.testing.assert_allclose(strip.jet(t, 1).e, other.jet(t, 1).e, atol=1e-12)
    np.testing.assert_allclose(strip.jet(t, 1).c0, other.jet(t, 1).c0, atol=1e-12)
    assert classify(strip).type == "cone"  # n''' = 0 and d''' = 0: det4 = 0


def family(n, d, t=(-1, 1)):
    return {"normal": n, "offset": d, "t": list(t)}


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        (family(["-3*t**2", "1", "0"], "-2*t**3"), GeometryError, "turn back at t = 0"),
        (family(["1", "0", "0"], "5"), GeometryError, "stands still throughout"),
        (family(["1+t*t", "0", "0"], "5+5*t*t"), GeometryError, "stands still throughout"),
        (family(["1", "0", "0"], "t"), GeometryError, "parallel throughout"),
        (family(["cos(t**3)", "sin(t**3)", "1"], "t"), GeometryError, "parallel at t = 0"),
        (family(["cos(t**3)", "sin(t**3)", "1"], "t**2"), GeometryError, "parallel at t = 0"),
        (family(["cos(t**3)", "sin(t**3)", "1"], "t**3"), GeometryError, "rulings stand still"),
        (family(["t", "t*t", "t"], "t"), GeometryError, "n vanishes at t = 0"),
        (family(["cos(t)", "sin(t)", "0"], "0"), GeometryError, "through one line"),
        (family(["cos(t)", "sin(t)", "0"], "3*cos(t)+2*sin(t)"), GeometryError, "one line"),
        (family(["cos(t**3+1e-8*t)", "sin(t**3+1e-8*t)", "1"], "0"), GeometryError, "all but"),
        (family(["cos(t**11)", "sin(t**11)", "1"], "0"), GeometryError, "stands still"),
        (family(["cos(t)", "sin(t)", "log(t)"], "0"), JobError, "no finite value at t = -1"),
        (family(["cos(t+abs(t))", "sin(t+abs(t))", "1"], "t"), JobError, "derivative at t = 0"),
        ({"planes": [[1, 0, 0, 1], [1, 0, 0, 1], [0, 0, 1, 1]]}, JobError, "planes 0 and 1"),
        ({"planes": [[0, 0, 1, 1], [0, 0, 2, 3], [0, 0, 1, 3]]}, GeometryError, "parallel"),
        ({"planes": [[1, 0, 0, 1], [0, 0, 0, 1], [0, 1, 0, 1]]}, GeometryError, "n vanishes"),
        ({"planes": [[1, 0, 0, 1]] * 3, "offset": "1"}, JobError, "either"),
        ({"normal": ["1", "0", "t"]}, JobError, "either"),
        ({}, JobError, "either"),
    ],
)
def test_impossible_families_end_in_one_line(table, error, words):
    told = refusal(kind="envelope", extent=[1, 2], **table)
    assert type(told) is error
    assert words in str(told)
    assert told.remedy


@pytest.mark.slow
@given(st.floats(-12, -1), st.sampled_from([-1.0, 1.0]))
def test_a_near_moment_of_rest_is_exact_or_refused(exponent, sign):
    """n' = 3 t^2 + eps: eps > 0 never stands still, eps < 0 turns back twice; whatever is built
    is the cone through the origin, whose rulings are known."""
    s = f"(t**3 + ({sign * 10**exponent!r})*t)"
    table = family([f"cos{s}", f"sin{s}", "1"], "0")
    try:
        cone = patch(kind="envelope", extent=[1, 2], **table)
    except DevcadError as refused:
        assert refused.code == 3
        return
    t = inside(cone)
    a = t**3 + sign * 10**exponent * t
    e = np.stack([-np.cos(a), -np.sin(a), np.ones_like(a)], axis=1) * np.sqrt(0.5)
    np.testing.assert_allclose(cone.jet(t, 0).e[0], e, atol=1e-8)


@pytest.mark.parametrize("power", [4, 6, 8])
def test_a_cylinder_with_a_flat_line_is_no_circular_one(power):
    """y = x^p: flat at x = 0, where the centre of curvature is at infinity, or nearly."""
    strip = envelope([f"-{power}*t**{power - 1}", "0", "1"], f"-{power - 1}*t**{power}", (-1, 1))
    shape = classify(strip)
    assert (shape.type, shape.radius) == ("cylinder", None)
    jet = strip.jet(inside(strip), 0)
    np.testing.assert_allclose(jet.c0[0, :, 2], jet.c0[0, :, 0] ** power, atol=1e-15)
