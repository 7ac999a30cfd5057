"""Lines drawn on the sheet, against closed forms in the pattern."""

from __future__ import annotations

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent, slanted_pipe

from devcad.flatten.development import develop, develop_chain
from devcad.flatten.drawings import draw
from devcad.flatten.green import perimeter
from devcad.flatten.outline import lay_out
from devcad.geometry.chain import Chain
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch

FRUSTUM = frustum()
SINE, SLANT = 50.0 / 130.0, 260.0  # of the half angle, and from the apex down to c0
APEX = np.array([260.0, 0.0])


def parallel(v: float, start: float = 0.0, end: float = 2.0 * np.pi) -> Drawing:
    one = np.ones_like
    return Drawing("ENGRAVE", 0, lambda u: (u, v * one(u), one(u), 0.0 * u), (start, end))


def meridian(t: float, start: float = 0.0, end: float = 130.0) -> Drawing:
    one = np.ones_like
    return Drawing("MARK", 0, lambda u: (t * one(u), u, 0.0 * u, one(u)), (start, end))


def sloped(rise: float, v: float, start: float = 0.0, end: float = 2.0 * np.pi) -> Drawing:
    """v grows evenly with t."""
    one = np.ones_like
    path = lambda u: (u, v + rise * u, one(u), rise * one(u))  # noqa: E731
    return Drawing("ENGRAVE", 0, path, (start, end))


def drawn(drawing: Drawing, patch: Patch):
    return draw(drawing, patch, develop(patch))


@pytest.mark.parametrize("v", [1e-3, 31.0, 129.0])
def test_a_parallel_of_a_cone_is_an_arc_about_the_apex(v):
    (edge,) = drawn(parallel(v), FRUSTUM)
    points, slopes = edge.curve(np.linspace(edge.u[0], edge.u[-1], 33))
    np.testing.assert_allclose(np.hypot(*(points - APEX).T), SLANT - v, rtol=1e-13)
    np.testing.assert_allclose(np.hypot(*slopes.T), (SLANT - v) * SINE, rtol=1e-12)
    assert perimeter((edge,)) == pytest.approx(2.0 * np.pi * SINE * (SLANT - v), rel=1e-12)


def test_a_meridian_of_a_cone_is_a_straight_line_towards_the_apex():
    (edge,) = drawn(meridian(2.0), FRUSTUM)
    points, slopes = edge.curve(np.array([0.0, 130.0]))
    away = APEX - points
    np.testing.assert_allclose(np.hypot(*away.T), [260.0, 130.0], rtol=1e-13)
    turn = np.arctan2(*away[0][::-1])
    assert abs(turn) == pytest.approx(2.0 * SINE, rel=1e-12)
    np.testing.assert_allclose(slopes, [away[0] / 260.0] * 2, rtol=1e-12)


@pytest.mark.parametrize(
    "patch",
    [FRUSTUM, helix_tangent(), ellipse_cylinder(), slanted_pipe()],
    ids=["cone", "helix", "ellipse", "pipe"],
)
def test_a_drawing_keeps_its_length_and_its_derivative(patch):
    """Its length in space is that of a fine polygon, extrapolated; the derivative is the
    difference quotient's limit."""
    low, high = patch.domain
    f = patch.frame(np.linspace(low, high, 9))
    v, rise = 0.6 * f.v_from.max() + 0.4 * f.v_to.min(), 0.1 / (high - low)
    (edge,) = drawn(sloped(rise, v - rise * low, low, high), patch)
    polygons = []
    for count in (2000, 4000):
        t, height, _, _ = sloped(rise, v - rise * low).path(np.linspace(low, high, count + 1))
        steps = np.diff(patch.point(t, height), axis=0)
        polygons.append(np.linalg.norm(steps, axis=1).sum())
    length = polygons[1] + (polygons[1] - polygons[0]) / 3.0  # error h^2
    assert perimeter((edge,)) == pytest.approx(length, rel=1e-11)
    u, h = np.linspace(low, high, 23)[1:-1], 1e-4 * (high - low)
    near = [edge.curve(u + k * h)[0] for k in (-2, -1, 1, 2)]
    quotient = (near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h)  # error h^4
    np.testing.assert_allclose(edge.curve(u)[1], quotient, atol=1e-9 * np.abs(quotient).max())


def test_what_leaves_the_sheet_is_left_out():
    edges = drawn(parallel(25.0, -1.0, 9.0), slanted_pipe())  # the pipe ends in 20 + 10 cos t
    assert [edge.name for edge in edges] == ["ENGRAVE", "ENGRAVE"]
    ends = [edge.u[[0, -1]] for edge in edges]
    np.testing.assert_allclose(
        ends, [[0.0, np.pi / 3.0], [5.0 * np.pi / 3.0, 2.0 * np.pi]], atol=1e-8
    )
    assert drawn(parallel(31.0), slanted_pipe()) == ()
    assert drawn(parallel(5.0, 7.0, 9.0), slanted_pipe()) == ()


@pytest.mark.parametrize(
    "line", [parallel(0.0), parallel(130.0), meridian(0.0), meridian(2.0 * np.pi)]
)
def test_a_line_along_the_border_is_the_cutters_own(line):
    assert drawn(line, FRUSTUM) == ()


def test_a_line_that_only_touches_the_border_is_drawn_whole():
    """v = 20 + 10 cos t is the pipe's edge; the parallel at 10 meets it where t = pi."""
    (edge,) = drawn(parallel(10.0), slanted_pipe())
    np.testing.assert_array_equal(edge.u[[0, -1]], [0.0, 2.0 * np.pi])


def test_a_drawing_is_smooth_between_the_breaks_of_its_patch():
    pipe = slanted_pipe()
    broken = Patch(pipe.field, pipe.domain, (1.0, 4.0))
    (edge,) = drawn(sloped(1.0, 2.0), broken)
    np.testing.assert_allclose(edge.u, [0.0, 1.0, 4.0, 2.0 * np.pi], atol=1e-14)


def test_a_line_that_shrinks_to_a_point_is_not_drawn():
    """The parallel at a cone's apex."""
    chain = Chain((frustum(100.0, 0.0),))
    slant = float(np.hypot(100.0, 120.0))
    pattern = lay_out(
        chain, develop_chain(chain), (np.zeros(0),), (parallel(slant), parallel(0.5 * slant))
    )
    assert len(pattern.drawings) == 1


def test_a_ruling_that_is_drawn_is_not_drawn_again_as_a_reference():
    chain, t = Chain((FRUSTUM,)), np.linspace(0.0, 2.0 * np.pi, 37)
    plain = lay_out(chain, develop_chain(chain), (t,))
    lines = tuple(meridian(float(x)) for x in t[1:-1:2])
    pattern = lay_out(chain, develop_chain(chain), (t,), lines)
    assert len(pattern.drawings) == 18
    ends = {tuple(np.round(line.end, 6)) for line in pattern.lines}
    drawn_ends = {
        tuple(np.round(point, 6))
        for edge in pattern.drawings
        for point in edge.curve(edge.u[[0, -1]])[0]
    }
    assert not ends & drawn_ends
    assert 0 < len(pattern.lines) < len(plain.lines)
    half = lay_out(chain, develop_chain(chain), (t,), (meridian(float(t[1]), 0.0, 65.0),))
    assert len(half.lines) == len(plain.lines)


def test_a_scaled_drawing_is_drawn_on_the_scaled_patch():
    (edge,) = drawn(sloped(3.0, 10.0).scaled(25.4), FRUSTUM.scaled(25.4))
    (small,) = drawn(sloped(3.0, 10.0), FRUSTUM)
    u = np.linspace(0.0, 2.0 * np.pi, 9)
    for big, little in zip(edge.curve(u), small.curve(u), strict=True):
        np.testing.assert_allclose(big, 25.4 * little, rtol=1e-11, atol=1e-9)
