"""Frenet data and parallel fields in both metrics, against closed forms of geometry.md 1."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from devcad.geometry.curves import CurveSpec
from devcad.geometry.frames import EUCLID, LORENTZ, frenet, parallel_normal

EXACT = 1e-12  # relative: rounding of a few hundred operations


def curve(x, y, z, low=-1, high=2):
    table = {"kind": "expression", "x": x, "y": y, "z": z, "t": [low, high]}
    return TypeAdapter(CurveSpec).validate_python(table).curve()


CASES = {
    # curve, metric, curvature, torsion, signs of T, N, B
    "E helix": (curve("3*cos(t)", "3*sin(t)", "4*t"), EUCLID, 0.12, 0.16, (1, 1, 1)),
    "4": (curve("2*cos(t)", "2*sin(t)", "t"), LORENTZ, 2 / 3, 1 / 3, (1, 1, -1)),
    "5": (curve("2*t", "3*sinh(t)", "3*cosh(t)"), LORENTZ, 3 / 13, -2 / 13, (1, -1, 1)),
    "7 SB": (curve("3*t", "2*cosh(t)", "2*sinh(t)"), LORENTZ, 2 / 5, 3 / 5, (1, 1, -1)),
    "7 TL": (curve("2*t", "3*cosh(t)", "3*sinh(t)"), LORENTZ, 3 / 5, 2 / 5, (-1, 1, 1)),
    "8": (curve("cos(t)", "sin(t)", "2*t"), LORENTZ, 1 / 3, 2 / 3, (-1, 1, 1)),
    # any parameter: example 4 again with t = sinh(u)
    "4, other speed": (
        curve("2*cos(sinh(t))", "2*sin(sinh(t))", "sinh(t)"), LORENTZ, 2 / 3, 1 / 3, (1, 1, -1),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_curvature_and_torsion_of_the_examples(name):
    of, metric, curvature, torsion, signs = CASES[name]
    data = frenet(of.jet(np.linspace(-1, 2, 31), 3), metric)
    np.testing.assert_allclose(data.curvature[0], curvature, rtol=EXACT)
    np.testing.assert_allclose(data.torsion[0], torsion, rtol=EXACT)
    for sign, expected in zip(data.signs, signs, strict=True):
        np.testing.assert_array_equal(sign, expected)


@pytest.mark.parametrize("metric", [EUCLID, LORENTZ], ids=["Euclid", "Minkowski"])
def test_frenet_equations_hold_along_any_curve(metric):
    """With signs e1, e2, e3: T' = k N, N' = -e1 e2 k T + tau B, B' = -e2 e3 tau N (per length)."""
    of = curve("3*t + sin(t)", "cos(t) + t**2/5", "t**3/20 + t/2")
    data = frenet(of.jet(np.linspace(-1, 2, 31), 4), metric)
    frame = np.stack([data.T[0], data.N[0], data.B[0]], axis=1)  # (n, 3, 3)
    e1, e2, e3 = data.signs
    gram = np.einsum("nai,i,nbi->nab", frame, metric, frame)
    np.testing.assert_allclose(
        gram, np.stack([np.diag(s) for s in zip(e1, e2, e3, strict=True)]), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, rtol=1e-12)
    k, tau, speed = (x[0][:, None] for x in (data.curvature, data.torsion, data.speed))
    np.testing.assert_allclose(data.T[1] / speed, k * data.N[0], atol=1e-12)
    turned = -(e1 * e2)[:, None] * k * data.T[0] + tau * data.B[0]
    np.testing.assert_allclose(data.N[1] / speed, turned, atol=1e-12)
    np.testing.assert_allclose(data.B[1] / speed, -(e2 * e3)[:, None] * tau * data.N[0], atol=1e-12)


def test_a_parallel_field_turns_against_the_torsion_around_a_closed_curve():
    """Its angle after one round is minus the total torsion; without torsion it closes."""
    for height in (0.0, 0.3):
        table = {
            "kind": "expression",
            "x": "cos(t)",
            "y": "sin(t)",
            "z": f"{height}*sin(2*t)",
            "t": [0, "2*pi"],
        }
        closed = TypeAdapter(CurveSpec).validate_python(table).curve()
        ends = np.array(closed.domain)
        data = frenet(closed.jet(ends[:1], 3))
        field = parallel_normal(closed, data.N[0, 0])
        there = field.series(ends, closed.jet(ends, 1))[0, 1]
        turn = np.arctan2(there @ data.B[0, 0], there @ data.N[0, 0])
        x, w = np.polynomial.legendre.leggauss(200)
        inner = frenet(closed.jet(np.pi * (1 + x), 3))
        total = np.pi * w @ (inner.torsion[0] * inner.speed[0])
        assert np.remainder(turn + total + np.pi, 2 * np.pi) - np.pi == pytest.approx(0, abs=1e-12)


def test_a_field_is_carried_over_breaks_of_a_spline():
    """Where the third derivative jumps the field keeps its length and stays normal."""
    points = [[0, 0, 0], [1, 1, 0], [2, 1.5, 1], [3, 1, 2], [4, 0, 2.5], [5, -2, 2.5], [6, -4, 1]]
    table = {"kind": "points", "degree": 3, "points": points}
    spline = TypeAdapter(CurveSpec).validate_python(table).curve()
    start = np.array([spline.domain[0]])
    data = frenet(spline.jet(start, 3))
    field = parallel_normal(spline, data.N[0, 0])
    t = np.linspace(*spline.domain, 301)
    jet = spline.jet(t, 2)
    b = field.series(t, jet)
    tangent = jet[1] / np.linalg.norm(jet[1], axis=1)[:, None]
    np.testing.assert_allclose(np.linalg.norm(b[0], axis=1), 1.0, atol=1e-14)
    assert np.abs(np.einsum("ij,ij->i", b[0], tangent)).max() < 1e-14
    assert np.abs(np.cross(b[1], tangent)).max() < 1e-12 * np.abs(b[1]).max()  # b' along T
    # and b is the integral of its derivative, across the knots
    x, w = np.polynomial.legendre.leggauss(40)
    cuts = np.array([spline.domain[0], *spline.breaks, spline.domain[1]])
    half = 0.5 * np.diff(cuts)[:, None]
    u = (half * x + 0.5 * (cuts[1:] + cuts[:-1])[:, None]).ravel()
    slope = field.series(u, spline.jet(u, 2))[1]
    moved = (half * w).ravel() @ slope
    np.testing.assert_allclose(b[0, -1] - b[0, 0], moved, atol=1e-12)
