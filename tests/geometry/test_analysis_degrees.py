"""The degree of a curve: what its formulas say, and what intersections with a plane count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter

from devcad.geometry.analysis.degrees import (
    degree_of_edge_surface,
    degree_of_tangent_developable,
    is_plane,
    rational_degree,
)
from devcad.geometry.curves import CurveSpec

ADAPTER: TypeAdapter[Any] = TypeAdapter(CurveSpec)
TURN = [0, "2*pi"]


def degree(**table: Any) -> int | None:
    spec = ADAPTER.validate_python(table)
    return rational_degree(spec.curve(), spec)


def formula(x: str, y: str, z: str, t: list[Any]) -> int | None:
    return degree(kind="expression", x=x, y=y, z=z, t=t)


def bezier(control: list[list[float]], weights: list[float] | None = None) -> int | None:
    n = len(control)
    knots = [0.0] * n + [1.0] * n
    return degree(
        kind="bspline", degree=n - 1, knots=knots, control_points=control, weights=weights
    )


@pytest.mark.parametrize(
    ("d", "g", "tangents", "edges"),
    [(3, 0, 4, 0), (4, 0, 6, 6), (4, 1, 8, 8), (5, 0, 8, 16), (6, 4, 18, 54)],
)
def test_the_degrees_of_the_surfaces_are_those_counted_by_resultants(
    d: int, g: int, tangents: int, edges: int
) -> None:
    """O25: rational cases counted modulo primes, (4, 1) classical."""
    assert degree_of_tangent_developable(d, g) == tangents
    assert degree_of_edge_surface(d, g) == edges


def test_a_polynomial_has_the_degree_of_its_highest_power() -> None:
    assert formula("t", "t**2", "t**3", [0, 1]) == 3
    assert formula("t", "t**2", "t**3", [100, 100.01]) == 3  # nearly straight, still a cubic
    assert formula("t", "(t - 1)**4 - t**4", "t**3", [0, 1]) == 3  # the fourth powers cancel
    assert formula("2*t", "3*t + 1", "t", [0, 1]) == 1


def test_a_quotient_has_the_degree_of_its_common_denominator() -> None:
    assert formula("(1 - t**2)/(1 + t**2)", "2*t/(1 + t**2)", "0", [-1, 1]) == 2
    assert formula("1/(1 + t**2)", "t/(1 + t**2)", "t**3/(1 + t**2)", [-1, 1]) == 3
    assert formula("(t**2 - 1)/(t + 2)", "t", "t**3", [0, 1]) == 4


def test_waves_over_whole_periods_count_twice() -> None:
    """cos t and sin t are quadratic quotients of tan(t/2)."""
    assert formula("cos(t)", "sin(t)", "cos(2*t)", TURN) == 4
    assert formula("cos(t)**3", "sin(t)**3", "0", TURN) == 6  # the astroid, a sextic
    assert formula("cos(2*t)", "sin(2*t)", "cos(4*t)", TURN) == 4  # the first one, run twice
    assert formula("1e5 + cos(t)", "sin(t)", "1e-3*cos(3*t)", TURN) == 6


def test_what_only_looks_like_a_polynomial_or_a_wave_is_not_rational() -> None:
    assert formula("t", "exp(t)", "t**3", [0, 0.01]) is None
    assert formula("exp(0.01*cos(t))", "sin(t)", "cos(2*t)", TURN) is None
    assert formula("sqrt(4 + cos(t))", "sin(t)", "cos(2*t)", TURN) is None
    assert formula("t**0.5", "t", "t**3", [1, 2]) is None
    assert formula("cos(t)", "sin(t)", "0", [0, 1]) is None  # no whole period
    assert degree(kind="helix", radius=1.0, pitch=2.0, turns=3.0) is None


def test_a_kind_knows_its_degree() -> None:
    assert degree(kind="circle", radius=3.0, sweep=90.0) == 2
    assert degree(kind="ellipse", radii=[3.0, 4.0]) == 2
    assert degree(kind="line", **{"from": [0, 0, 0], "to": [1, 1, 1]}) == 1
    assert degree(kind="natural", curvature="1", torsion="0", t=TURN) == 2
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]]
    assert degree(kind="points", points=corners) == 3
    assert degree(kind="polyline", points=corners) is None


@pytest.mark.parametrize("n", [3, 5, 8, 11])
def test_a_rational_bezier_curve_meets_a_plane_in_as_many_points(n: int) -> None:
    """Counted as the roots of the plane's polynomial, no leading one of which vanishes."""
    random = np.random.default_rng(n)
    control, weights = random.normal(size=(n + 1, 3)), random.uniform(0.5, 2.0, n + 1)
    assert bezier(control.tolist(), weights.tolist()) == n


def test_raising_the_degree_does_not_raise_the_degree() -> None:
    """A quarter circle as a cubic with weights: a common factor would count as one more."""
    w = np.sqrt(0.5)
    quarter = np.array([[1.0, 0, 0, 1], [w, w, 0, w], [0, 1, 0, 1]])
    first, middle, last = quarter
    raised = np.array([first, (first + 2 * middle) / 3, (2 * middle + last) / 3, last])
    points = (raised[:, :3] / raised[:, 3:]).tolist()
    assert bezier(points, raised[:, 3].tolist()) == 2
    straight = [[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]
    assert bezier(straight) == 1


def test_a_spline_with_knots_inside_is_no_rational_curve_as_a_whole() -> None:
    table: dict[str, Any] = {
        "kind": "bspline",
        "degree": 2,
        "knots": [0, 0, 0, 1, 2, 2, 2],
        "control_points": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 1, 1]],
    }
    assert degree(**table) is None


def test_a_plane_is_seen_whatever_way_it_lies() -> None:
    t = np.linspace(0.0, 1.0, 50)
    flat = np.column_stack([t, t**2, 3.0 * t - 2.0 * t**2]) + 1e3
    assert is_plane(flat)
    assert not is_plane(flat + np.outer(1e-6 * t**3, [1.0, 1.0, -1.0]))
