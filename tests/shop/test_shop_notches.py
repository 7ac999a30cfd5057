"""Notches: areas in closed form, outlines that stay closed and simple, and what is refused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely

from devcad.errors import GeometryError
from devcad.flatten import shapes
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge, Pattern
from devcad.shop.notches import NOTCH_MARK, Anchor, beside, notched
from devcad.shop.polygons import fine_polygon
from devcad.shop.settings import EdgeFinish, Notches

ROUNDING = 1e-9  # mm2, of areas up to 1e4 mm2
TEN = {"top": EdgeFinish(10.0)}
V60 = np.tan(np.radians(30.0))
"""Half the width of a V of 60 degrees, of its depth."""


def sheet(outline: tuple[Edge, ...]) -> Pattern:
    return Pattern(outline, (), enclosed_area(outline), bounds(outline))


def rectangle() -> Pattern:
    """100 x 60 mm, its upper side the cut edge of a top with an allowance of 10 mm."""
    return sheet(shapes.rectangle(100, 60))


def upper(x: float) -> Anchor:
    """An anchor on the seam line 10 mm below the rectangle's upper side."""
    return Anchor("top", np.array([x, 20.0]), np.array([0.0, 1.0]))


def prove_simple(pattern: Pattern) -> None:
    """The outline is closed to rounding, simple, counterclockwise, and has the pattern's area."""
    for edge, after in itertools.pairwise((*pattern.outline, pattern.outline[0])):
        gap = edge.curve(edge.u[-1:])[0] - after.curve(after.u[:1])[0]
        assert np.abs(gap).max() < 1e-12  # the edges share the bits of their ends, or nearly
    polygon = shapely.Polygon(fine_polygon(pattern.outline, 1e-4)[0])
    assert polygon.is_valid
    assert polygon.exterior.is_ccw
    assert enclosed_area(pattern.outline) == pytest.approx(pattern.area, abs=ROUNDING)


@pytest.mark.parametrize(
    ("shape", "area"),
    [("V", 9.0 * V60), ("slit", 0.3 * 3.0), ("T", 0.3 * 3.0 + 0.3 * (3.0 - 0.3))],
)
def test_a_notch_in_a_straight_edge_takes_its_closed_form(shape: str, area: float) -> None:
    plain = rectangle()
    made = notched(plain, [upper(-20.0), upper(10.0)], Notches(1, shape, 3.0), TEN)  # type: ignore[arg-type]
    prove_simple(made)
    assert plain.area - made.area == pytest.approx(2.0 * area, abs=ROUNDING)
    assert made.bbox == pytest.approx(plain.bbox)
    tips = [edge.curve(edge.u)[0] for edge in made.drawings if edge.name == NOTCH_MARK]
    assert np.array(tips)[:, 0] == pytest.approx(np.array([[-20.0, 27.0], [10.0, 27.0]]))
    boundary = shapely.LinearRing(fine_polygon(made.outline, 1e-6)[0])
    for start, end in tips:
        assert boundary.distance(shapely.Point(start)) < 1e-9  # ASTM's point lies on it
        assert shapely.Polygon(boundary).contains(shapely.Point(end))


def test_a_v_in_a_circle_takes_a_triangle_and_a_segment_of_the_circle() -> None:
    """One edge round it all; the mouth's ends lie a half width from the crossing, as chords."""
    radius, depth = 40.0, 3.0
    plain = sheet((shapes.arc(np.zeros(2), radius, (0.0, 2.0 * np.pi), "top"),))
    angles = np.radians([10.0, 130.0, 359.0])
    out = np.column_stack([np.cos(angles), np.sin(angles)])
    anchors = [Anchor("top", 30.0 * way, way) for way in out]
    made = notched(plain, anchors, Notches(1, "V", depth), TEN)
    prove_simple(made)
    half = 2.0 * np.arcsin(0.5 * depth * V60 / radius)  # the angle of a chord of half a width
    tip = radius - depth
    # the sector of the mouth without the two triangles between the centre, an end and the tip
    taken = radius**2 * half - radius * tip * np.sin(half)
    assert plain.area - made.area == pytest.approx(3.0 * taken, abs=ROUNDING)
    tips = [edge.curve(edge.u[:1])[0][0] for edge in made.drawings]
    for way in out:
        assert min(np.hypot(*(tip * way - each)) for each in tips) < 1e-9


def test_a_notch_may_reach_over_a_smooth_joint_of_two_edges() -> None:
    right, high, *rest = shapes.rectangle(100, 60)
    start, end = high.curve(high.u)[0]
    middle = 0.5 * (start + end) + [0.4, 0.0]
    halves = (shapes.line(start, middle, "top"), shapes.line(middle, end, "top"))
    made = notched(sheet((right, *halves, *rest)), [upper(0.0)], Notches(1, "V", 3.0), TEN)
    prove_simple(made)
    assert 6000.0 - made.area == pytest.approx(9.0 * V60, abs=ROUNDING)


@pytest.mark.parametrize(
    ("notches", "half"),
    [
        (Notches(1, "V", 3.0), 6.0 * V60),
        (Notches(1, "slit", 3.0), 0.3),
        (Notches(1, "slit", 1.0), 0.2),
        (Notches(1, "T", 2.0), 2.0),
    ],
)
def test_between_the_two_of_a_pair_there_is_room_for_a_third(notches: Notches, half: float) -> None:
    assert beside(notches) == pytest.approx(half)
    pair = [upper(5.0 + side * half) for side in (-1.0, 1.0)]
    prove_simple(notched(rectangle(), pair, notches, TEN))


@pytest.mark.parametrize("finish", ["lap", "tab", "raw"])
def test_an_edge_that_is_not_bitten_has_a_mark_instead(finish: str) -> None:
    """Through the allowance, or inwards where there is none; the stitch hole stays free."""
    allowance = 0.0 if finish == "raw" else 10.0
    plain = rectangle()
    anchor = Anchor("top", np.array([0.0, 20.0]), np.array([0.0, 1.0]), 1.0, 0.75)
    finishes = {"top": EdgeFinish(allowance, finish)}  # type: ignore[arg-type]
    made = notched(plain, [anchor], Notches(1, "V", 3.0), finishes)  # type: ignore[arg-type]
    assert made.outline == plain.outline
    ends = np.sort([edge.curve(edge.u)[0][:, 1] for edge in made.drawings], axis=1)
    expected = [[17.0, 20.0]] if finish == "raw" else [[20.0, 20.25], [21.75, 23.0]]
    assert ends == pytest.approx(np.array(expected))
    assert {edge.name for edge in made.drawings} == {"MARK"}


def test_a_notch_deeper_than_half_the_allowance_is_refused() -> None:
    with pytest.raises(GeometryError, match=r"5\.5 mm deep in an allowance of 10 mm") as caught:
        notched(rectangle(), [upper(0.0)], Notches(1, "V", 5.5), TEN)
    assert (caught.value.value, caught.value.limit) == (5.5, 5.0)


def test_a_notch_stops_before_the_stitch_hole() -> None:
    """A hole of 1 mm at 3.5 mm from the cut: 0.75 mm round its middle stay free."""
    anchor = Anchor("top", np.array([0.0, 20.0]), np.array([0.0, 1.0]), 6.5, 0.75)
    notched(rectangle(), [anchor], Notches(1, "V", 2.75), TEN)
    with pytest.raises(GeometryError, match="before a stitch hole") as caught:
        notched(rectangle(), [anchor], Notches(1, "V", 3.0), TEN)
    assert (caught.value.value, caught.value.limit) == (3.0, 2.75)


@pytest.mark.parametrize(
    ("places", "words"), [((49.0,), "over a corner"), ((0.0, 1.0), "runs into another")]
)
def test_notches_that_do_not_fit_are_refused(places: tuple[float, ...], words: str) -> None:
    anchors = [upper(x) for x in places]
    with pytest.raises(GeometryError, match=words):
        notched(rectangle(), anchors, Notches(1, "V", 3.0), TEN)


def test_the_order_of_the_anchors_does_not_matter() -> None:
    anchors = [upper(x) for x in (-30.0, 0.0, 25.0)]
    made = [
        notched(rectangle(), order, Notches(1, "T", 2.0), TEN)
        for order in itertools.permutations(anchors)
    ]
    points = [np.array([edge.curve(edge.u[:1])[0][0] for edge in each.outline]) for each in made]
    assert all(np.array_equal(points[0], each) for each in points[1:])
