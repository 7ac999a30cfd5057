"""What a line of curvature's developable is, and which do not exist."""

from __future__ import annotations

import numpy as np
import pytest
from constructing import inside, patch, refusal, regression
from pydantic import TypeAdapter

from devcad.errors import GeometryError, JobError
from devcad.geometry.classify import classify
from devcad.geometry.curves import CurveSpec
from devcad.geometry.frames import line_of_curvature_type


def helix(a, b, length):
    """(a cos t, a sin t, b t)."""
    return {
        "kind": "helix",
        "radius": a,
        "pitch": 2 * np.pi * b,
        "turns": length / (2 * np.pi),
    }


def expression(x, y, z, low, high):
    return {"kind": "expression", "x": x, "y": y, "z": z, "t": [low, high]}


def euclid(**table):
    return patch(kind="line-of-curvature", **table)


def minkowski(**table):
    return patch(kind="line-of-curvature", metric="minkowski", **table)


# --- what it is, by the necessary and sufficient conditions ------------------------------------


TYPES = [
    ({"kind": "circle", "radius": 2}, 1.0, "E", None, "cone"),
    ({"kind": "ellipse", "radii": [3, 2]}, 0.0, "E", None, "cylinder"),
    ({"kind": "ellipse", "radii": [3, 2]}, 1.0, "E", None, "tangent"),
    (helix(3, 4, 2), 0.3, "E", None, "tangent"),
    ({"kind": "circle", "radius": 2}, 0.3, "SB", "spacelike", "cone"),
    ({"kind": "circle", "radius": 2}, 0.0, "SB'", "timelike", "cylinder"),
    ({"kind": "circle", "radius": 2}, 0.7, "SB'", "timelike", "cone"),
    (helix(2, 1, 2), 0.0, "SB", "spacelike", "tangent"),
    (expression("0", "2*sinh(t)", "2*cosh(t)", -1, 1), 0.0, "SN", "spacelike", "cylinder"),
    (expression("0", "2*sinh(t)", "2*cosh(t)", -1, 1), 0.5, "SN", "spacelike", "cone"),
    (expression("0", "2*sinh(t)", "2*cosh(t)", -1, 1), 0.5, "SN'", "timelike", "cone"),
    (expression("2*t", "3*sinh(t)", "3*cosh(t)", -1, 1), 0.5, "SN", "spacelike", "tangent"),
    (helix(1, 2, 2), 0.2, "TL", "timelike", "tangent"),
    (expression("0", "2*cosh(t)", "2*sinh(t)", -1, 1), 0.0, "TL", "timelike", "cylinder"),
    (expression("0", "2*cosh(t)", "2*sinh(t)", -1, 1), 0.9, "TL", "timelike", "cone"),
]


@pytest.mark.parametrize(("curve", "theta", "row", "causal", "expected"), TYPES)
def test_mu_k_tells_what_the_frame_tells(curve, theta, row, causal, expected):
    model = TypeAdapter(CurveSpec).validate_python(curve)
    assert line_of_curvature_type(model.curve(), theta, row) == expected
    if causal is None:
        surface = euclid(curve=curve, angle=np.degrees(theta), extent=[0, 0.1])
    else:
        surface = minkowski(curve=curve, angle=theta, causal=causal, extent=[0, 0.1])
    assert classify(surface).type == expected


def test_a_curve_on_a_sphere_gives_a_cone():
    """With b towards the centre k' sin theta = k tau cos theta holds all along."""
    curve = expression(
        "cos(t)*cos(0.4*sin(2*t))", "sin(t)*cos(0.4*sin(2*t))", "sin(0.4*sin(2*t))", 0, 3
    )
    cone = euclid(curve=curve, ruling=[-1, 0, 0], extent=[0, 0.5])
    assert classify(cone).type == "cone"
    np.testing.assert_allclose(regression(cone.frame(inside(cone))), 0.0, atol=1e-13)


def test_a_curve_on_de_sitter_space_gives_a_spacelike_cone():
    """x^2 + y^2 - z^2 = 1: b towards the centre is spacelike, so is the cone's every plane."""
    curve = expression(
        "cos(t)*cosh(0.2*sin(t))", "sin(t)*cosh(0.2*sin(t))", "sinh(0.2*sin(t))", 0, 3
    )
    cone = minkowski(curve=curve, ruling=[-1, 0, 0], extent=[0, 0.5])
    assert classify(cone).type == "cone"
    np.testing.assert_allclose(regression(cone.frame(inside(cone))), 0.0, atol=1e-13)


# --- refusals ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        ({"causal": "spacelike"}, JobError, 'metric = "minkowski"'),
        ({"ruling": [0, 0, 1]}, JobError, "either angle or ruling"),
        ({"angle": None}, JobError, "either angle or ruling"),
        (
            {"metric": "minkowski", "curve": helix(1, 2, 3)},
            GeometryError,
            'causal = "timelike"',
        ),
        (
            {"metric": "minkowski", "curve": expression("t", "t**2/2", "0.9*t**2", -0.5, 2)},
            GeometryError,
            "spacelike before t = 0.668153 and timelike after it",
        ),
        (
            {"metric": "minkowski", "curve": expression("t**3/3 + t", "0", "t", -1, 1)},
            GeometryError,
            "tangent is lightlike at t = 0",
        ),
        (
            {"metric": "minkowski", "curve": expression("cos(t)", "sin(t)", "t", 0, 1)},
            GeometryError,
            "tangent is lightlike",
        ),
        (
            {"curve": expression("t", "t**3", "0", 0, 1)},
            GeometryError,
            "ruling = [x, y, z]",
        ),
        (
            {"curve": {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]}},
            GeometryError,
            "ruling = [x, y, z]",
        ),
        (
            {"angle": None, "ruling": [0, 2, 0]},
            GeometryError,
            "parallel to the curve's tangent",
        ),
        (
            {"metric": "minkowski", "angle": None, "ruling": [0.1, 0, 1]},
            GeometryError,
            "not spacelike",
        ),
        (
            {"metric": "minkowski", "causal": "timelike", "angle": None, "ruling": [1, 0, 0.3]},
            GeometryError,
            "not timelike",
        ),
        (
            {"metric": "minkowski", "angle": None, "ruling": [1, 0, 1]},
            GeometryError,
            "not spacelike",
        ),
        ({"metric": "minkowski", "angle": 800}, GeometryError, "not spacelike at t"),
        (
            {
                "curve": {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]},
                "angle": None,
                "ruling": [0, 1, 1],
            },
            GeometryError,
            "corner t = 0.5",
        ),
        ({"extent": [1, 0]}, JobError, "from = 1"),
    ],
)
def test_an_impossible_line_of_curvature_ends_in_one_line(table, error, words):
    plain = {"curve": {"kind": "circle", "radius": 2}, "angle": 1, "extent": [0, 0.1]}
    told = refusal(kind="line-of-curvature", **{**plain, **table})
    assert type(told) is error, told
    assert words in str(told)
    assert told.remedy
