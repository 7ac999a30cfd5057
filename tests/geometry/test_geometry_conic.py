"""Arcs of conics as Bezier curves of degree 2 with a weight."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from devcad.geometry.conic import Arcs, arc_borders, arcs
from devcad.geometry.fit import Course
from devcad.geometry.taylor import Array

Curve = Callable[[Array], Array]


def ellipse(a: float, b: float, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Curve:
    def points(t: Array) -> Array:
        return np.stack([a * np.cos(t), b * np.sin(t), 0.0 * t], axis=1) + centre

    return points


def beside(*curves: Curve) -> Curve:
    return lambda t: np.concatenate([c(t) for c in curves], axis=1)


def found(curve: Curve, start: float, end: float) -> Arcs | None:
    ends = np.array([start, end])
    first, last = curve(ends)
    return arcs(curve, Course(ends, ends), (first, last))


def assert_equal(curve: Curve, start: float, end: float) -> Arcs:
    arc = found(curve, start, end)
    assert arc is not None
    size = np.abs(curve(arc.t)).max()
    assert np.abs(arc.spline(arc.s) - curve(arc.t)).max() <= 5e-13 * size
    assert arc.spline.exact
    return arc


def test_a_quarter_circle_has_the_corner_of_its_square_and_the_weight_of_45_degrees() -> None:
    arc = assert_equal(ellipse(100.0, 100.0), 0.0, np.pi / 2)
    np.testing.assert_array_equal(arc.spline.poles[:2], [[100, 0, 0], [100, 100, 0]])
    assert arc.spline.weights is not None
    np.testing.assert_allclose(arc.spline.weights[:, 0], [1, np.sqrt(0.5), 1], rtol=1e-15)


@pytest.mark.parametrize("sweep", [1e-4, 0.01, 0.3, 1.5, 3.0, 5.0, 2 * np.pi])
def test_an_arc_is_cut_in_equal_parts_of_at_most_a_quarter(sweep: float) -> None:
    borders = arc_borders(ellipse(30.0, 20.0), 0.2, 0.2 + sweep)
    if sweep < 1e-3:  # a millionth as deep as long: a line to the eye
        assert borders is None
        return
    assert borders is not None
    parts = int(np.ceil(sweep / (np.pi / 2) - 1e-9))
    np.testing.assert_allclose(borders, np.linspace(0.2, 0.2 + sweep, parts + 1), atol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_affine_images_and_other_parameters_are_recognised_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)

    def turned(t: Array) -> Array:
        return np.asarray(ellipse(3.0, 2.0)(t + 0.1 * np.sin(t)) @ matrix + shift)

    borders = arc_borders(turned, 0.0, 4.0)
    assert borders is not None
    angles = borders + 0.1 * np.sin(borders)
    np.testing.assert_allclose(np.diff(angles), angles[-1] / 3.0, rtol=1e-9)
    arc = assert_equal(turned, borders[0], borders[1])
    assert arc.spline.weights is not None
    assert arc.spline.weights[1, 0] == pytest.approx(np.cos(angles[-1] / 6.0), rel=1e-10)


def test_a_hyperbola_has_a_weight_above_one_and_a_parabola_one() -> None:
    def hyperbola(t: Array) -> Array:
        return np.stack([30.0 * np.cosh(t), 20.0 * np.sinh(t), t * 0.0], axis=1)

    def parabola(t: Array) -> Array:
        x = np.exp(t)
        return np.stack([x, x**2, 0.0 * t], axis=1)

    for curve, weight in ((hyperbola, np.cosh(1.0)), (parabola, 1.0)):
        arc = assert_equal(curve, -0.5, 1.5)
        assert arc.spline.weights is not None
        assert arc.spline.weights[1, 0] == pytest.approx(weight, rel=1e-12)
    assert arc_borders(parabola, -0.5, 1.5) is None  # the polynomials may have longer spans


def test_a_point_and_a_projection_follow_the_arc_whichever_comes_first() -> None:
    lower, apex = ellipse(60.0, 40.0), np.array([10.0, 5.0, 100.0])

    def oblique(t: Array) -> Array:  # the section with the plane 0.3 x + 0.1 y + z = 50
        rays = lower(t) - apex
        level = np.array([0.3, 0.1, 1.0])
        return np.asarray(apex + ((50.0 - level @ apex) / (rays @ level))[:, None] * rays)

    def tip(t: Array) -> Array:
        return np.tile(apex, (len(t), 1))

    for pair in (beside(lower, tip), beside(tip, lower)):
        arc = assert_equal(pair, 0.0, 1.5)
        assert arc.spline.weights is not None
        np.testing.assert_array_equal(arc.spline.weights[:, 0], arc.spline.weights[:, 3])
    for pair in (beside(lower, oblique), beside(oblique, lower)):
        arc = assert_equal(pair, 0.0, 1.5)
        assert arc.spline.weights is not None
        ratio = arc.spline.weights[:, 3] / arc.spline.weights[:, 0]
        assert np.ptp(ratio) > 0.01  # a central projection changes the weights


NONE: dict[str, Curve] = {
    "a helix": lambda t: np.stack([np.cos(t), np.sin(t), 0.1 * t], axis=1),
    "a line": lambda t: np.stack([t, 2.0 * t, 3.0 * t], axis=1),
    "a point": lambda t: np.zeros((len(t), 3)),
    "a cubic": lambda t: np.stack([t, t**3, 0.0 * t], axis=1),
    "not numbers": lambda t: np.full((len(t), 3), np.nan),
    "an ellipse but for 1e-10": lambda t: (
        ellipse(3.0, 2.0)(t) + 1e-10 * np.stack([np.cos(7.0 * t), 0.0 * t, 0.0 * t], axis=1)
    ),
    "circles that do not run together": beside(
        ellipse(100.0, 100.0), lambda t: ellipse(60.0, 60.0)(t + 0.1 * np.sin(t))
    ),
    "an arc that turns back": lambda t: ellipse(3.0, 2.0)(np.sin(2.0 * t)),
}


@pytest.mark.parametrize("name", NONE)
def test_other_curves_are_left_to_a_fit(name: str) -> None:
    assert found(NONE[name], 0.0, 1.5) is None
    assert arc_borders(NONE[name], 0.0, 1.5) is None


def test_a_course_with_a_break_is_not_one_span() -> None:
    t = np.array([0.0, 0.5, 1.0])
    circle = ellipse(1.0, 1.0)
    first, _, last = circle(t)
    assert arcs(circle, Course(t, t), (first, last)) is None
