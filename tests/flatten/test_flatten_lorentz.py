"""The Lorentzian unrolling against closed forms and against the metric of Minkowski space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from patches import frustum, helix_tangent, wall

from devcad.errors import GeometryError
from devcad.flatten.green import enclosed_area
from devcad.flatten.lorentz import (
    Spacetime,
    lorentz_area,
    lorentz_pattern,
    unroll,
    unroll_chain,
)
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.constructions.line_of_curvature import LineOfCurvature
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

Z = np.array([0.0, 0.0, 1.0])
G = np.array([1.0, 1.0, -1.0])
NONE = (np.zeros(0),)


def made(curve: dict, angle: float, extent: list, causal: str = "spacelike") -> Patch:
    table = {"kind": "line-of-curvature", "metric": "minkowski", "causal": causal}
    surface = LineOfCurvature.model_validate(
        {**table, "curve": curve, "angle": angle, "extent": extent}
    )
    (patch,) = surface.build().panels[0].patches
    return patch


def formula(x: str, y: str, z: str, end: float) -> dict:
    return {"kind": "expression", "x": x, "y": y, "z": z, "t": [0, end]}


def figure(*patches: Patch, time: Array = Z):
    return lorentz_pattern(Spacetime(link(patches, base_closed=False, tolerance=1.0), time), NONE)


def area(patch: Patch, time: Array = Z) -> float:
    return lorentz_area(Spacetime(Chain((patch,)), time))


def test_the_spacelike_cone_unrolls_to_a_sector_of_more_than_a_full_turn():
    """O04: slant, angle and area; all but the closing ruling lie on one circle."""
    cone = made({"kind": "circle", "radius": 2}, 1.0, [0, 1.2961085473277707])
    plane = unroll(cone, Z)
    t = np.linspace(0.0, 2.0 * np.pi, 41)
    apex = plane.points(t[:1], cone.jet(t[:1], 0).v_to[0])[0]
    np.testing.assert_allclose(
        np.hypot(*(plane.axes(t)[0] - apex).T), 1.2961085473277707, rtol=1e-13
    )
    omega = plane.series(t)[:, 0]
    assert abs(omega[-1] - omega[0]) == pytest.approx(9.695461572464488, rel=1e-12)
    assert area(cone) == pytest.approx(8.143690181079727, rel=1e-12)
    assert enclosed_area(figure(cone).outline) == pytest.approx(8.143690181079727, rel=1e-12)


def test_the_spacelike_helix_has_the_area_and_the_turning_of_the_oracle():
    end = 1.5 / np.sqrt(3.0)
    strip = made(formula("2*cos(t)", "2*sin(t)", "t", end), 0.5, [0, 0.5])  # O05
    assert area(strip) == pytest.approx(0.6197261736265631, rel=1e-11)
    turned = unroll(strip, Z).series(np.array([0.0, end]))[:, 0]
    assert abs(np.ptp(turned)) == pytest.approx(1.0421906109874948, rel=1e-11)


# Curves of constant curvature k and torsion tau (geometry.md, Ex4, Ex5, Ex7, Ex8): formulas,
# speed, k, tau. Along them theta = theta0 - tau s, the strip is (1 + v mu k) ds dv, and M below is
# an antiderivative of mu k along s: so the area is S w + w^2/2 [M] and the turning is [M].
SPACELIKE = (("2*cos(t)", "2*sin(t)", "t"), 3.0**0.5, 2 / 3, 1 / 3)
HYPERBOLIC = (("2*t", "sinh(t)", "cosh(t)"), 5.0**0.5, 1 / 5, -2 / 5)
FALLING = (("2*t", "cosh(t)", "sinh(t)"), 3.0**0.5, 1 / 3, 2 / 3)
RISING = (("t", "2*cosh(t)", "2*sinh(t)"), 3.0**0.5, 2 / 3, 1 / 3)
TIMELIKE = (("cos(t)", "sin(t)", "2*t"), 3.0**0.5, 1 / 3, 2 / 3)
PRIMITIVE = {
    "TL": lambda k, tau, x: -k / tau * np.cos(x),
    "SB": lambda k, tau, x: k / tau * np.sinh(x),
    "SB'": lambda k, tau, x: k / tau * np.cosh(x),
    "SN": lambda k, tau, x: -k / tau * np.cosh(x),
    "SN'": lambda k, tau, x: -k / tau * np.sinh(x),
}
CASES = {
    "SB helix": ("SB", SPACELIKE),
    "SB hyperbolic": ("SB", FALLING),
    "SN hyperbolic": ("SN", HYPERBOLIC),
    "SB' helix": ("SB'", SPACELIKE),
    "SB' hyperbolic": ("SB'", FALLING),
    "SN' hyperbolic": ("SN'", HYPERBOLIC),
    "TL helix": ("TL", TIMELIKE),
    "TL hyperbolic": ("TL", RISING),
}


def case(name: str, width: float = 0.6, end: float = 0.8) -> Patch:
    row, (words, *_) = CASES[name]
    causal = "spacelike" if row in ("SB", "SN") else "timelike"
    return made(formula(*words, end), 0.4, [0, width], causal)


@pytest.mark.parametrize("name", CASES)
def test_area_and_turning_are_the_closed_forms_of_every_row(name):
    row, (_, speed, k, tau) = CASES[name]
    strip, width, end = case(name), 0.6, 0.8
    length = speed * end
    turned = PRIMITIVE[row](k, tau, 0.4 - tau * length) - PRIMITIVE[row](k, tau, 0.4)
    assert area(strip) == pytest.approx(length * width + 0.5 * width**2 * turned, rel=1e-12)
    assert enclosed_area(figure(strip).outline) == pytest.approx(area(strip), rel=1e-11)
    omega = unroll(strip, Z).series(np.array([0.0, end]))[:, 0]
    assert abs(omega[1] - omega[0]) == pytest.approx(abs(turned), rel=1e-11)


def test_the_hyperbolic_cylinder_unrolls_to_a_rectangle():
    """Ex6: Lorentz length a u, while the Euclidean one is elliptic."""
    sheet = made(formula("0", "3*sinh(t)", "3*cosh(t)", 1.3), 0.0, [0, 2])
    corners = np.array([edge.curve(edge.u[:1])[0][0] for edge in figure(sheet).outline])
    np.testing.assert_allclose(corners, [[0, 0], [2, 0], [2, 3.9], [0, 3.9]], atol=1e-12)


def plane_metric(patch: Patch, time: Array) -> Array:
    return np.array([1.0, -unroll(patch, time).sign])


PATCHES = {
    **{name: case(name) for name in CASES},
    "shallow frustum": frustum(100.0, 50.0, 20.0),  # spacelike
    "steep frustum": frustum(100.0, 50.0, 120.0),  # timelike rulings
    "flat helix": helix_tangent(4.0, 1.0),  # spacelike: its tangent planes rise by 14 degrees
}


@pytest.mark.parametrize("name", PATCHES)
def test_lorentz_lengths_on_the_surface_are_those_of_the_figure(name):
    """Along curves (t, v(t)) of three slopes, by differences of fourth order in both worlds."""
    patch = PATCHES[name]
    plane = unroll(patch, Z)
    low, high = patch.domain
    t, h = np.linspace(low, high, 41)[1:-1], 5e-4 * (high - low)
    f = patch.frame(t)
    for slope in (-0.3, 0.0, 0.7):
        middle = 0.5 * (f.v_from + f.v_to)
        near = [
            (t + k * h, middle + k * h * slope * (f.v_to - f.v_from) / (high - low))
            for k in (-2, -1, 1, 2)
        ]
        space, flat = (
            (p[0] - 8.0 * p[1] + 8.0 * p[2] - p[3]) / (12.0 * h)
            for p in ([patch.point(*at) for at in near], [plane.points(*at) for at in near])
        )
        metric = plane_metric(patch, Z)
        squares = (space**2 * G).sum(axis=1)
        size = np.abs(space**2).sum(axis=1).max()
        np.testing.assert_allclose((flat**2 * metric).sum(axis=1), squares, atol=1e-8 * size)


@pytest.mark.parametrize("name", PATCHES)
def test_the_edges_have_their_own_derivatives_and_close(name):
    for edge in figure(PATCHES[name]).outline:
        low, high = np.sort(edge.u[[0, -1]])
        u, h = np.linspace(low, high, 21)[1:-1], 1e-4 * (high - low)
        near = [edge.curve(u + k * h)[0] for k in (-2, -1, 1, 2)]
        quotient = (near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h)
        size = np.abs(quotient).max()
        np.testing.assert_allclose(edge.curve(u)[1], quotient, atol=1e-9 * size)
    ends = np.array([e.curve(e.u[[0, -1]])[0] for e in figure(PATCHES[name]).outline])
    np.testing.assert_allclose(ends[:, 1], np.roll(ends[:, 0], -1, axis=0), atol=1e-9)


@pytest.mark.parametrize("name", PATCHES)
def test_the_figure_starts_along_an_axis_and_shows_the_front(name):
    """A spacelike ruling along +x, a timelike one up, and t grows to the left of it."""
    patch = PATCHES[name]
    origin, e, m = (x[0] for x in unroll(patch, Z).axes(np.array(patch.domain[:1])))
    ruling = patch.frame(patch.domain[0]).e[0]
    length = np.sqrt(abs((ruling**2 * G).sum()))
    along = [1.0, 0.0] if (ruling**2 * G).sum() > 0.0 else [0.0, 1.0]
    np.testing.assert_allclose(origin, [0.0, 0.0], atol=1e-12)  # of some 100 mm
    np.testing.assert_allclose(e, length * np.array(along), atol=1e-14)
    assert e[0] * m[1] - e[1] * m[0] > 0.0


def test_a_cone_about_the_time_axis_turns_by_its_rim_over_its_lorentz_slant():
    for rise in (20.0, 120.0):
        cone = frustum(100.0, 50.0, rise)
        slant = 2.0 * np.sqrt(abs(50.0**2 - rise**2))
        omega = unroll(cone, Z).series(np.array([0.0, 2.0 * np.pi]))[:, 0]
        assert abs(omega[1] - omega[0]) == pytest.approx(2.0 * np.pi * 100.0 / slant, rel=1e-12)
        assert area(cone) == pytest.approx(0.75 * np.pi * 100.0 * slant, rel=1e-12)


def test_turning_the_part_turns_its_time_axis_and_nothing_else():
    strip = case("SN hyperbolic")
    turn = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-1.0, 1.0, 3.0], [0.3, 0.1, 1.0]]))[0]
    turn *= np.sign(np.linalg.det(turn))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [5.0, 6.0, 7.0]
    moved = strip.transformed(matrix)
    assert area(moved, turn @ Z) == pytest.approx(area(strip), rel=1e-13)
    t = np.linspace(*strip.domain, 9)
    for a, b in zip(unroll(moved, turn @ Z).axes(t), unroll(strip, Z).axes(t), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-13)


@pytest.mark.parametrize("name", ["SB helix", "TL helix", "SN' hyperbolic", "steep frustum"])
def test_a_chain_lies_in_the_plane_as_the_one_patch_it_was(name):
    """Cut in two, the second half's base curve moved along its rulings."""
    whole = PATCHES[name]
    low, high = whole.domain
    middle = 0.3 * low + 0.7 * high

    def moved(t: Array, order: int) -> RulingJet:
        jet = whole.field(t, order)
        by = taylor.constant(0.25, order, t.size)
        return RulingJet(jet.rail(by), jet.e, jet.v_from - by, jet.v_to - by)

    halves = whole.restricted(low, middle), replace(whole, field=moved).restricted(middle, high)
    chain = link(halves, base_closed=False, tolerance=1.0)
    second = unroll_chain(Spacetime(chain, Z))[1]
    t = np.linspace(middle, high, 9)
    v = np.linspace(*whole.frame(t[:1]).v_to * [0.1, 0.9], 9)
    expected = unroll(whole, Z).points(t, v)
    size = np.abs(expected).max()
    np.testing.assert_allclose(second.points(t, v - 0.25), expected, atol=1e-12 * size)
    assert lorentz_area(Spacetime(chain, Z)) == pytest.approx(area(whole), rel=1e-12)


def fan(start: float, end: float) -> Patch:
    """Rulings from the origin in the plane y = 0, at the angle t from x towards the time axis."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        e = np.stack([cos, 0.0 * sin, sin], axis=-1)
        zero, one = (taylor.constant(x, order, t.size) for x in (0.0, 1.0))
        return RulingJet(0.0 * e, e, zero, one)

    return Patch(field, (start, end))


LYING = np.eye(4)[[2, 1, 0, 3]]  # x and z exchanged: rulings along x
STEP = tuple(
    wall(np.array(a), np.array(b), 1.0).transformed(LYING)
    for a, b in (([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]), ([0.0, 1.0, 0.0], [1.0, 1.0, 0.0]))
)
"""A tread and a riser: spacelike, then timelike."""


def test_a_timelike_plane_is_its_own_figure():
    plane = unroll(fan(-0.5, 0.5), Z)
    t, v = np.linspace(-0.5, 0.5, 11), np.linspace(0.1, 1.0, 11)
    at = plane.points(t, v)
    x, w = v * np.cos(t), v * np.sin(t)
    np.testing.assert_allclose(at[:, 0] ** 2 - at[:, 1] ** 2, x**2 - w**2, atol=1e-13)
    assert area(fan(-0.5, 0.5)) == pytest.approx(0.5, rel=1e-13)


@pytest.mark.parametrize(
    ("patches", "words"),
    [
        ((frustum(50.0, 50.0, 20.0).transformed(LYING),), "tangent plane"),
        ((fan(0.0, 1.0),), "the ruling is lightlike or changes its type at t = 0.78"),
        ((frustum(100.0, 50.0, 50.0),), "tangent plane is lightlike"),
        ((frustum(100.0, 0.0, 100.02),), "boosts its rulings by the rapidity 31"),
        (STEP, "it is another one from one patch to the next at t = 0"),
    ],
    ids=["cylinder lying down", "lightlike ruling", "light cone", "almost a light cone", "step"],
)
def test_what_has_no_unrolling_is_refused_in_one_line(patches, words):
    with pytest.raises(GeometryError, match=words) as caught:
        figure(*patches)
    assert caught.value.remedy
    assert "\n" not in str(caught.value)
