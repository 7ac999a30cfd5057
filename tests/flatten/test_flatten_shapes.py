"""Contours of holes: areas and lengths against closed forms, closedness, direction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devcad.flatten.rings import (
    Contour,
    backwards,
    counterclockwise,
    meeting,
    polygon_of,
    self_crossing,
    twice_area,
)
from devcad.flatten.shapes import (
    arc,
    arrow_mark,
    circle,
    conic_arc,
    line,
    line_mark,
    polygon,
    rectangle,
    slot,
)

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(24)
SIZES = st.floats(1e-3, 1e4)


def measured(contour: Contour) -> tuple[float, float]:
    """Area and length by Gauss quadrature of the edges' own derivatives."""
    area = length = 0.0
    for edge in contour:
        half = 0.5 * (edge.u[-1] - edge.u[0])
        points, slopes = edge.curve(0.5 * (edge.u[-1] + edge.u[0]) + half * GAUSS)
        turning = points[:, 0] * slopes[:, 1] - points[:, 1] * slopes[:, 0]
        area += 0.5 * half * float(WEIGHTS @ turning)
        length += abs(half) * float(WEIGHTS @ np.hypot(*slopes.T))
    return area, length


def gap(contour: Contour) -> float:
    starts = np.array([edge.curve(edge.u[:1])[0][0] for edge in contour])
    ends = np.array([edge.curve(edge.u[-1:])[0][0] for edge in contour])
    return float(np.abs(np.roll(starts, -1, axis=0) - ends).max())


@given(diameter=SIZES)
def test_a_circle_is_one_edge_of_its_area(diameter: float) -> None:
    contour = circle(diameter)
    assert len(contour) == 1
    assert contour[0].u.tolist() == [0.0, 2 * math.pi]
    assert measured(contour) == pytest.approx(
        (math.pi * diameter**2 / 4, math.pi * diameter), rel=1e-13
    )


@given(width=SIZES, longer=st.floats(0.0, 50.0))
def test_a_slot_is_a_rectangle_and_a_circle(width: float, longer: float) -> None:
    straight = longer * width
    contour = slot(width + straight, width)
    area, length = measured(contour)
    assert area == pytest.approx(straight * width + math.pi * width**2 / 4, rel=1e-12)
    assert length == pytest.approx(2 * straight + math.pi * width, rel=1e-12)
    assert gap(contour) <= 1e-15 * (width + straight)
    assert np.abs(polygon_of(contour)[:, 0]).max() == pytest.approx((width + straight) / 2)


@given(width=SIZES, height=SIZES, share=st.floats(0.0, 1.0))
def test_a_rounded_rectangle_lacks_its_corners(width: float, height: float, share: float) -> None:
    radius = share * min(width, height) / 2
    contour = rectangle(width, height, radius)
    area, length = measured(contour)
    assert area == pytest.approx(width * height - (4 - math.pi) * radius**2, rel=1e-12)
    assert length == pytest.approx(2 * (width + height) - (8 - 2 * math.pi) * radius, rel=1e-12)
    assert gap(contour) <= 1e-15 * (width + height)
    assert polygon_of(contour).max(axis=0) == pytest.approx([width / 2, height / 2])


def test_corners_rounded_to_the_full_leave_no_edge_without_length() -> None:
    assert len(rectangle(10, 4, 2)) == 6
    assert len(rectangle(4, 4, 2)) == 4
    assert len(rectangle(10, 4, 0)) == 4
    assert len(slot(4, 4)) == 1


@pytest.mark.parametrize("turn", [1, -1])
def test_a_polygon_runs_counterclockwise_either_way_it_is_given(turn: int) -> None:
    contour = polygon([(0, 0), (6, 0), (6, 2), (2, 2), (2, 5), (0, 5)][::turn])
    assert measured(contour)[0] == pytest.approx(6 * 2 + 2 * 3, rel=1e-15)
    assert gap(contour) == 0.0


def test_arcs_of_ellipses_are_their_conjugate_diameters() -> None:
    whole = conic_arc(np.array([7.0, 1.0]), np.array([3.0, 1.0]), np.array([-1.0, 2.0]), (0, 7.0))
    points, slopes = whole.curve(np.array([0.0, math.pi / 2, math.pi]))
    assert points == pytest.approx(np.array([[10, 2], [6, 3], [4, 0]]), abs=1e-15)
    assert slopes[0] == pytest.approx([-1, 2], abs=1e-15)


def test_marks_begin_at_their_origin_and_an_arrow_ends_in_its_tip() -> None:
    (stroke,) = line_mark(30.0)
    assert stroke.curve(stroke.u)[0].tolist() == [[0, 0], [30, 0]]
    shaft, left, right = arrow_mark(30.0)
    tips = [shaft.curve(shaft.u)[0][-1], left.curve(left.u)[0][-1], right.curve(right.u)[0][0]]
    assert tips == pytest.approx(np.array([[30.0, 0.0]] * 3))
    ends = left.curve(left.u)[0][0], right.curve(right.u)[0][-1]
    assert ends[0] == pytest.approx(ends[1] * [1, -1])
    assert all(edge.name == "MARK" for edge in (stroke, shaft, left, right))


# --- what contours do ----------------------------------------------------------------------


def test_backwards_is_the_same_line_the_other_way() -> None:
    contour = rectangle(10, 4, 1)
    other = backwards(contour)
    assert measured(other)[0] == pytest.approx(-measured(contour)[0], rel=1e-15)
    assert gap(other) == gap(contour)
    assert measured(counterclockwise(other))[0] > 0.0


def test_a_bow_tie_crosses_itself_where_its_sides_do() -> None:
    assert self_crossing(np.array([(0, 0), (4, 4), (4, 0), (0, 4)])) == pytest.approx((2.0, 2.0))
    assert self_crossing(polygon_of(rectangle(4, 4, 1))) is None


def test_curved_sides_cross_too() -> None:
    """A lens's two arcs, one of them bulging beyond the other's chord."""
    lower = arc(np.array([0.0, 4.0]), 5.0, (-math.atan2(4, 3), -math.pi + math.atan2(4, 3)))
    across = line(np.array([-3.0, 0.0]), np.array([0.0, -2.0]))
    back = line(np.array([0.0, -2.0]), np.array([3.0, 0.0]))
    assert self_crossing(polygon_of((lower, across, back))) is not None


@pytest.mark.parametrize(
    ("shift", "pair"), [(20.0, None), (6.0, (0, 1)), (0.0, (0, 1)), (7.0, (0, 1))]
)
def test_contours_meet_that_cross_touch_or_hold_one_another(
    shift: float, pair: tuple[int, int] | None
) -> None:
    small = np.array([(x + shift, y) for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2))])
    assert meeting([polygon_of(rectangle(10, 10)), small]) == pair


def test_twice_the_area_has_a_sign() -> None:
    square = np.array([[5.0, 5], [6, 5], [6, 6], [5, 6]])
    assert twice_area(square) == 2.0
    assert twice_area(square[::-1]) == -2.0
