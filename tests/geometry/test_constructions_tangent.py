"""Tangent and rectifying developables against the closed forms of Frenet theory."""

from __future__ import annotations

import numpy as np
import pytest
from constructing import area, inside, integral, patch, refusal, regression
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from devcad.errors import GeometryError, JobError

EXACT = 1e-12  # relative: rounding of a few hundred operations
HELIX = {"kind": "helix", "radius": 3, "pitch": 8 * np.pi, "turns": 1 / np.pi}  # (3, 4), s to 10
CUBIC = {"kind": "expression", "x": "t", "y": "t**2", "z": "t**3", "t": [0, 1]}


def test_tangent_surface_of_a_helix_is_a_flat_annulus():
    flight = patch(kind="tangent", curve=HELIX, extent=[1, 3])  # oracle O09
    frame = flight.frame(inside(flight))
    assert integral(flight, "p") == pytest.approx(10.0, rel=EXACT)
    assert integral(flight, "a") == pytest.approx(1.2, rel=EXACT)
    assert area(flight) == pytest.approx(4.8, rel=EXACT)
    np.testing.assert_allclose(np.abs(frame.p / frame.a), 8.333333333333334, rtol=EXACT)
    np.testing.assert_allclose(np.abs(frame.c / (frame.q + 2 * frame.a)), 2 / 3, rtol=EXACT)
    assert np.abs(frame.q).max() < 1e-14  # the curve is the regression curve


def test_tangent_surface_of_the_twisted_cubic():
    surface = patch(kind="tangent", curve=CUBIC, extent=[0, 1])  # oracle O35
    assert integral(surface, "p") == pytest.approx(1.8630229825122513, rel=1e-11)
    assert integral(surface, "a") == pytest.approx(1.4509108998640312, rel=1e-11)
    assert area(surface) == pytest.approx(0.7254554499320156, rel=1e-11)


def test_the_tangent_surface_of_the_twisted_cubic_is_its_quartic():
    surface = patch(kind="tangent", curve=CUBIC, extent=[-1, 1])
    t, v = (g.ravel() for g in np.meshgrid(inside(surface, 21), np.linspace(-1, 1, 7)))
    x, y, z = surface.point(t, v).T
    quartic = z**2 - 6 * x * y * z + 4 * y**3 + 4 * x**3 * z - 3 * x**2 * y**2
    np.testing.assert_allclose(quartic, 0.0, atol=1e-13)  # geometry.md, 9


def test_rectifying_developable_of_a_helix_is_its_cylinder():
    ribbon = patch(kind="rectifying", curve=HELIX, extent=[-1, 1])  # oracle O10
    frame = ribbon.frame(inside(ribbon))
    np.testing.assert_allclose(frame.e, np.tile([0.0, 0.0, 1.0], (101, 1)), atol=1e-15)
    np.testing.assert_allclose(frame.c / frame.q, 1 / 3, rtol=EXACT)  # of the helix's radius


def test_rectifying_developable_of_a_rectifying_curve_is_a_cone():
    curve = {"kind": "natural", "curvature": "1", "torsion": "t", "t": [0, 2]}
    cone = patch(kind="rectifying", curve=curve, extent=[-0.5, 0.5])  # oracle O11
    frame = cone.frame(inside(cone)[1:])
    apex = regression(frame)
    np.testing.assert_allclose(apex, np.tile([0.0, 0.0, -1.0], (100, 1)), atol=1e-11)
    np.testing.assert_allclose(np.abs(frame.q / frame.a)[0], np.hypot(1, 0.02), rtol=1e-11)


@given(
    st.tuples(*[st.floats(-0.3, 0.3)] * 4),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
)
def test_the_curve_is_a_geodesic_of_its_rectifying_developable(shape, turn):
    """Its acceleration is along the surface normal once the speed is one, however it is turned."""
    a, b, c, d = shape
    x, y, z = ("t", f"t**2 + {a}*t**3 + {b}*t**4", f"{c}*t**2 + (1 + {d})*t**3")
    rotation = Rotation.from_quat(turn).as_matrix()
    turned = [f"({r[0]})*({x}) + ({r[1]})*({y}) + ({r[2]})*({z})" for r in rotation]
    table = dict(zip("xyz", turned, strict=True))
    strip = patch(
        kind="rectifying",
        curve={"kind": "expression", **table, "t": [0.1, 0.9]},
        extent=[-0.01, 0.01],
    )
    t = inside(strip)
    frame, jet = strip.frame(t), strip.jet(t, 2)
    velocity, acceleration = jet.c0[1], 2 * jet.c0[2]
    along = np.cross(velocity, np.cross(velocity, acceleration))
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.abs(np.abs(np.einsum("ij,ij->i", along, frame.n)) - 1).max() < 1e-12
    assert np.abs(frame.residual_e).max() < 1e-12 * max(1, np.abs(frame.a).max())
    # unrolled it is straight: the angle from e to T changes by minus the turning of e
    heading = np.unwrap(np.arctan2(frame.q, frame.p))
    x, w = np.polynomial.legendre.leggauss(60)
    turned_by = 0.4 * w @ strip.frame(0.5 + 0.4 * x).a
    assert heading[-1] - heading[0] + turned_by == pytest.approx(0.0, abs=1e-11)


def test_a_reversed_curve_reverses_the_rulings():
    """T and B turn round, the curvature and the torsion stay."""
    for kind in ("tangent", "rectifying"):
        there = patch(kind=kind, curve=CUBIC | {"t": [0.2, 1]}, extent=[-0.01, 0.02])
        back = patch(
            kind=kind,
            curve={"kind": "expression", "x": "-t", "y": "t**2", "z": "-t**3", "t": [-1, -0.2]},
            extent=[-0.01, 0.02],
        )
        t = np.linspace(0.2, 1, 50)
        np.testing.assert_allclose(back.jet(-t, 0).e, -there.jet(t, 0).e, atol=1e-14)


def test_the_parameter_does_not_matter():
    for kind in ("tangent", "rectifying"):
        slow = patch(kind=kind, curve=CUBIC | {"t": [0.1, 1]}, extent=[0.1, 0.2])
        fast = patch(
            kind=kind,
            curve={
                "kind": "expression",
                "x": "exp(t)",
                "y": "exp(t)**2",
                "z": "exp(t)**3",
                "t": ["log(0.1)", 0],
            },
            extent=[0.1, 0.2],
        )
        t = np.linspace(0.1, 1, 50)
        np.testing.assert_allclose(fast.jet(np.log(t), 0).e, slow.jet(t, 0).e, atol=1e-13)


def test_derivatives_of_the_ruling_are_those_of_its_values():
    """The Taylor polynomial of order 8 meets the ruling 0.01 away, to rounding."""
    for kind in ("tangent", "rectifying"):
        strip = patch(kind=kind, curve=CUBIC | {"t": [0.2, 1]}, extent=[0.1, "0.2 + t**2"])
        t, step = np.linspace(0.3, 0.9, 13), 0.01
        jet, there = strip.jet(t, 8), strip.jet(t + step, 0)
        powers = step ** np.arange(9)
        np.testing.assert_allclose(np.einsum("k,kni->ni", powers, jet.e), there.e[0], atol=1e-13)
        np.testing.assert_allclose(powers @ jet.v_to, there.v_to[0], atol=1e-15)


ZIGZAG = {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}
# a cubic spline's third derivative jumps at its knots; this one is no plane curve
CUBIC_SPLINE = {
    "kind": "points",
    "degree": 3,
    "points": [[0, 0, 0], [1, 1, 0], [2, 1.5, 1], [3, 1, 2], [4, 0, 2.5], [5, -2, 2.5], [6, -4, 1]],
}


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        (
            {"kind": "tangent", "curve": CUBIC | {"x": "t**2", "t": [-1, 1]}},
            GeometryError,
            "stands still at t = 0",
        ),
        ({"kind": "tangent", "curve": ZIGZAG}, GeometryError, "corner t = 0.5"),
        ({"kind": "rectifying", "curve": ZIGZAG}, GeometryError, "corner t = 0.5"),
        (
            {"kind": "tangent", "curve": CUBIC | {"x": "sqrt(t)"}},
            JobError,
            "curve has no finite derivative at t = 0",
        ),
        (
            {"kind": "rectifying", "curve": CUBIC | {"y": "(t - 0.3)**3", "z": "t"}},
            GeometryError,
            "inflection (curvature 0) at t = 0.3",
        ),
        (
            {"kind": "rectifying", "curve": {"kind": "line", "from": [0, 0, 0], "to": [1, 2, 3]}},
            GeometryError,
            "inflection",
        ),
        ({"kind": "rectifying", "curve": CUBIC_SPLINE}, GeometryError, "degree = 5"),
        ({"kind": "tangent", "curve": CUBIC, "extent": [1, 1]}, JobError, "from = 1"),
        ({"kind": "tangent", "curve": CUBIC, "extent": [0, "1 - 2*t"]}, JobError, "at t = 1"),
    ],
)
def test_impossible_tables_end_in_one_line(table, error, words):
    told = refusal(**{"extent": [0, 1], **table})
    assert type(told) is error
    assert words in str(told)
    assert told.remedy


def test_a_quintic_spline_through_the_same_points_is_taken():
    strip = patch(kind="rectifying", curve=CUBIC_SPLINE | {"degree": 5}, extent=[-0.01, 0.01])
    knots = np.array(strip.breaks)
    before = strip.jet(np.nextafter(knots, 0), 1)
    np.testing.assert_allclose(strip.jet(knots, 1).e, before.e, atol=1e-9)  # C4: e is C1
