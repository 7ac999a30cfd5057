"""Developable polynomial patches: the papers' conditions, what is chosen, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from constructing import build, inside, patch, patches, refusal, regression
from scipy.interpolate import BSpline

from devcad.errors import DevcadError, GeometryError, JobError
from devcad.geometry import nets
from devcad.geometry.classify import classify
from devcad.geometry.fit import Spline
from devcad.geometry.nets import Freedom
from devcad.geometry.regularity import clearance, twist
from devcad.geometry.taylor import Array

CUBIC = [[0, 0, 0], [60, 0, 40], [120, 20, 40], [180, 80, 0]]
QUADRATIC = CUBIC[:3]
START = [0, 80, 20]
METHODS = ("aumann", "chu-sequin")
SPLINE = {
    "kind": "bspline",
    "degree": 3,
    "knots": [0, 0, 0, 0, 1, 2.5, 2.5, 4, 4, 4, 4],
    "control_points": [
        [0, 0, 0],
        [10, 0, 5],
        [20, 5, 5],
        [35, 10, 0],
        [50, 10, -5],
        [60, 20, 0],
        [70, 30, 5],
    ],
}
RING = {
    "kind": "bspline",
    "degree": 3,
    "knots": list(range(13)),
    "control_points": [
        [60, 0, 0],
        [30, 50, 0],
        [-30, 50, 0],
        [-60, 0, 0],
        [-30, -50, 0],
        [30, -50, 0],
        [60, 0, 0],
        [30, 50, 0],
        [-30, 50, 0],
    ],
}


def bezier(**table: Any) -> Any:
    return patch(kind="bezier", **table)


def edges(table: dict[str, Any], t: Array) -> tuple[Array, Array]:
    jet = bezier(**table).jet(t, 0)
    return jet.c0[0], jet.rail(jet.v_to)[0]


def control_points(table: dict[str, Any], degree: int) -> Array:
    """Of the opposite edge, by interpolation with SciPy."""
    t = np.linspace(0.0, 1.0, degree + 1)
    bernstein = np.stack(
        [
            BSpline(np.repeat([0.0, 1.0], degree + 1), unit, degree)(t)
            for unit in np.eye(degree + 1)
        ],
        axis=1,
    )
    return np.asarray(np.linalg.solve(bernstein, edges(table, t)[1]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("degree", range(1, 10))
def test_any_degree_is_developable_to_rounding_and_regular_by_itself(
    degree: int, method: str
) -> None:
    x = np.linspace(0.0, 3.0, degree + 1)
    points = np.stack([60.0 * x, 15.0 * x**2, 20.0 * np.sin(x)], axis=1)
    made = bezier(boundary=points.tolist(), opposite_start=[-10, 70, 30], method=method)
    assert twist(made).value <= 1e-12
    frame = made.frame(inside(made))
    assert np.abs(frame.residual_e).max() <= 1e-13
    # a quarter of the shortest ruling at least lies before the regression curve
    assert clearance(made, (0.0,)).value >= 0.25 * frame.v_to.min() * (1.0 - 1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("points", [QUADRATIC, CUBIC])
def test_the_four_corners_of_every_cell_lie_in_one_plane(
    points: list[list[float]], method: str
) -> None:
    # Chu and Sequin: in the quadratic case the condition itself, in all others a consequence
    table = {"boundary": points, "opposite_start": START, "method": method}
    b, c = np.array(points, dtype=float), control_points(table, len(points) - 1)
    for i in range(len(b) - 1):
        sides = np.stack([b[i + 1] - b[i], c[i] - b[i], c[i + 1] - b[i]])
        assert abs(np.linalg.det(sides)) <= 1e-13 * np.prod(np.linalg.norm(sides, axis=1)) * 10


@pytest.mark.parametrize("freedom", [Freedom(1.3, -0.4), Freedom(0.7, 0.5), Freedom(1.0, 0.2)])
def test_the_polar_forms_meet(freedom: Freedom) -> None:
    knots, poles = np.array(SPLINE["knots"], dtype=float), np.array(SPLINE["control_points"], float)
    made = nets.opposite(Spline(3, knots, poles), np.array([0.0, 40.0, 3.0]), freedom)
    b, c = BSpline(knots, poles, 3), BSpline(knots, made.poles, 3)
    t = np.linspace(0.0, 4.0, 41)
    # g = 1 - t/L on [0, 1] and w = 1 - M/L: X(t) = c + (L - t) c'/n = b + (M - t) b'/n, over L
    u, n = (t / 4.0)[:, None], 3.0
    inverse, ratio = 1.0 - freedom.spread, 1.0 - freedom.pull
    on_c = inverse * c(t) + (1.0 - inverse * u) * 4.0 * c(t, 1) / n
    on_b = inverse * b(t) + (ratio - inverse * u) * 4.0 * b(t, 1) / n
    np.testing.assert_allclose(on_c, on_b, atol=1e-12)


def test_the_regression_curve_crosses_the_rulings_at_shares_that_vary_linearly() -> None:
    made = bezier(boundary=CUBIC, opposite_start=START, singular=[-2, -3])
    frame = made.frame(inside(made, 21)[1:-1])
    share = -frame.q / frame.a / frame.v_to
    np.testing.assert_allclose(share, -2.0 - frame.t, rtol=1e-11)


def test_equal_shares_make_a_cone_and_none_a_cylinder() -> None:
    cone = bezier(boundary=CUBIC, opposite_start=START, singular=[3, 3])
    shape = classify(cone)
    assert shape.type == "cone"
    np.testing.assert_allclose(shape.point, 3.0 * np.array(START), atol=1e-11)
    second = (np.array(START) + np.array(CUBIC[1])).tolist()
    assert classify(bezier(boundary=CUBIC, opposite_start=[START, second])).type == "cylinder"


def test_the_second_point_is_the_second_control_point() -> None:
    second = [48, 72, 50]  # 0.8 of the first leg, 0.1 of the ruling back
    points = control_points({"boundary": CUBIC, "opposite_start": [START, second]}, 3)
    np.testing.assert_allclose(points[:2], [START, second], atol=1e-12)


def test_the_end_of_a_patch_of_the_family_is_met_again() -> None:
    given = {"boundary": CUBIC, "opposite_start": START, "singular": [-2, -3]}
    end = control_points(given, 3)[-1].tolist()
    table = {"boundary": CUBIC, "opposite_start": START, "opposite_end": end}
    (panel,) = build(kind="bezier", **table).panels
    assert panel.figures["missed_end"].value <= 1e-9
    t = np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(edges(table, t)[1], edges(given, t)[1], atol=1e-8)


def test_an_end_out_of_reach_is_missed_by_the_reported_distance() -> None:
    table = {"boundary": CUBIC, "opposite_start": START, "opposite_end": [150, 130, 0]}
    (panel,) = build(kind="bezier", **table).panels
    missed = np.linalg.norm(control_points(table, 3)[-1] - [150, 130, 0])
    assert panel.figures["missed_end"].value == pytest.approx(missed, rel=1e-9)
    assert panel.figures["missed_end"].length == 1
    assert 0.0 < missed < 20.0


def test_a_plane_boundary_with_a_square_ruling_keeps_it() -> None:
    points = [[0, 0, 0], [30, 40, 0], [60, -40, 0], [90, 40, 0]]
    for method in METHODS:
        made = bezier(boundary=points, opposite_start=[0, 0, 40], method=method)
        e = made.frame(inside(made)).e
        np.testing.assert_allclose(e, np.tile([0.0, 0.0, 1.0], (len(e), 1)), atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_in_the_boundarys_own_plane_the_patch_is_plane(method: str) -> None:
    for points in ([[0, 0, 0], [30, 40, 0], [60, 40, 0], [90, 0, 0]], [[0, 0, 0], [90, 0, 0]]):
        made = bezier(boundary=points, opposite_start=[-10, 10, 0], method=method)
        assert classify(made).type == "plane"
        assert clearance(made, (0.0,)).value > 0.0


def test_where_the_boundary_closes_the_patch_closes() -> None:
    for start in ([50, 10, 60], [20, 5, 60]):
        (panel,) = build(kind="bezier", boundary=RING, opposite_start=start).panels
        assert panel.base_closed
        (only,) = panel.patches
        ends = only.jet(np.array(only.domain), 0)
        np.testing.assert_allclose(ends.e[0, 0], ends.e[0, 1], atol=1e-12)
        assert classify(only).type in ("cone", "cylinder")


def test_a_boundary_without_clamped_ends_is_the_same_curve() -> None:
    knots, poles = np.array(RING["knots"], float), np.array(RING["control_points"], float)
    clamped = nets.clamped(3, knots, poles)
    t = np.linspace(3.0, 9.0, 50)
    np.testing.assert_allclose(clamped(t), BSpline(knots, poles, 3)(t), atol=1e-12)
    assert np.array_equal(clamped.knots, [3, 3, 3, 3, 4, 5, 6, 7, 8, 9, 9, 9, 9])


def test_curves_that_are_polynomials_may_be_boundaries() -> None:
    formulas = {"kind": "expression", "x": "180*t", "y": "60*t**2", "z": "120*t*(1-t)", "t": [0, 1]}
    points = [[0, 0, 0], [90, 0, 60], [180, 60, 0]]
    t = np.linspace(0.0, 1.0, 7)
    one = edges({"boundary": formulas, "opposite_start": START}, t)
    other = edges({"boundary": points, "opposite_start": START}, t)
    np.testing.assert_allclose(one, other, atol=1e-11)
    through = {"kind": "points", "points": [[0, 0, 0], [40, 5, 12], [60, 10, 12], [95, 40, 0]]}
    assert twist(bezier(boundary=through, opposite_start=[0, 40, 0])).value <= 1e-12


def test_a_corner_of_the_boundary_is_a_crease() -> None:
    corner = SPLINE | {
        "knots": [0, 0, 0, 0, 2, 2, 2, 4, 4, 4, 4],
        "control_points": [*SPLINE["control_points"][:4], [50, 20, -5], [60, 20, 0], [70, 30, 5]],
    }
    made = patches(kind="bezier", boundary=corner, opposite_start=[0, 40, 3])
    assert len(made) == 2
    assert all(twist(one).value <= 1e-12 for one in made)
    first, second = made[0].jet([2.0], 0), made[1].jet([2.0], 0)
    np.testing.assert_allclose(first.e[0], second.e[0], atol=1e-14)


@pytest.mark.parametrize("scale", [1e-4, 1e6])
def test_the_size_changes_nothing(scale: float) -> None:
    def scaled(x: Any) -> Any:
        return (scale * np.array(x, dtype=float)).tolist()

    plain = bezier(boundary=CUBIC, opposite_start=START).frame([0.3])
    made = bezier(boundary=scaled(CUBIC), opposite_start=scaled(START)).frame([0.3])
    np.testing.assert_allclose(made.e, plain.e, atol=1e-9)
    np.testing.assert_allclose(regression(made), scale * regression(plain), rtol=1e-7)


FLAT = [[0, 0, 0], [1, 0, 0], [2, 1, 0]]
REFUSALS: dict[str, tuple[dict[str, Any], type[DevcadError], str]] = {
    "on the boundary": (
        {"boundary": FLAT, "opposite_start": [0, 0, 0]},
        GeometryError,
        "the boundary's first point",
    ),
    "on the first tangent": (
        {"boundary": FLAT, "opposite_start": [5, 0, 0]},
        GeometryError,
        "first tangent",
    ),
    "beside the cell's plane": (
        {"boundary": FLAT, "opposite_start": [[0, 0, 1], [1, 0.25, 1]]},
        GeometryError,
        "it lies 0.25 beside it",
    ),
    "regression curve on the patch": (
        {"boundary": FLAT, "opposite_start": [[0, 0, 1], [-1, 0, 1]]},
        GeometryError,
        "the regression curve would lie on the patch",
    ),
    "rulings that vanish": (
        {"boundary": FLAT, "opposite_start": [[0, 0, 1], [1, 0, -1]]},
        GeometryError,
        "shrink to nothing",
    ),
    "standing still": (
        {"boundary": [[0, 0, 0], [0, 0, 0], [1, 1, 0]], "opposite_start": [0, 0, 1]},
        GeometryError,
        "stands still at t = 0",
    ),
    "turning back": (
        {"boundary": [[0, 0, 0], [1, 1, 0], [0, 0, 0]], "opposite_start": [0, 0, 1]},
        GeometryError,
        "stands still at t = 0.5",
    ),
    "a circle": (
        {"boundary": {"kind": "circle", "radius": 3}, "opposite_start": [0, 0, 9]},
        JobError,
        "no polynomial of degree 9",
    ),
    "a rational curve": (
        {"boundary": RING | {"weights": [1.0] * 8 + [2.0]}, "opposite_start": [0, 0, 9]},
        JobError,
        "weights differ",
    ),
    "eleven points": (
        {"boundary": [[i, i * i, 0] for i in range(11)], "opposite_start": [0, 0, 1]},
        JobError,
        "11 control points",
    ),
    "across the patch": (
        {"boundary": FLAT, "opposite_start": [0, 0, 1], "singular": [-1, 2]},
        JobError,
        "would cross the patch",
    ),
    "two choices": (
        {
            "boundary": FLAT,
            "opposite_start": [0, 0, 1],
            "singular": [3, 2],
            "opposite_end": [0, 1, 0],
        },
        JobError,
        "opposite_end and singular each say",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refused_with_a_remedy(name: str) -> None:
    table, kind, words = REFUSALS[name]
    error = refusal(kind="bezier", **table)
    assert type(error) is kind
    assert words in error.what
    assert error.remedy
    assert "\n" not in str(error)


def test_equal_weights_are_no_weights() -> None:
    t = np.linspace(3.0, 9.0, 7)
    weighted = {"boundary": RING | {"weights": [2.0] * 9}, "opposite_start": [20, 5, 60]}
    plain = {"boundary": RING, "opposite_start": [20, 5, 60]}
    np.testing.assert_array_equal(edges(weighted, t), edges(plain, t))


@pytest.mark.slow
def test_hostile_boundaries_are_developable_or_refused() -> None:
    rng = np.random.default_rng(3)
    regular = 0
    for _ in range(25):
        points = np.cumsum(rng.normal([1.5, 0, 0], size=(rng.integers(2, 11), 3)), axis=0)
        scale = 10.0 ** rng.uniform(-3, 5)
        start = points[0] + rng.normal(size=3)
        for method in METHODS:
            made = bezier(
                boundary=(scale * points).tolist(),
                opposite_start=(scale * start).tolist(),
                method=method,
            )
            assert twist(made).value <= 1e-10
            regular += clearance(made, (0.0,)).value > 0.0
    assert regular >= 48  # a ruling along the boundary is an accident in a curve of this kind
