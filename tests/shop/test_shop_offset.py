"""Offsets of contours against Steiner's formula, closed forms, distances and shapely's buffer."""

from __future__ import annotations

import itertools
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

from devcad.errors import GeometryError
from devcad.flatten import shapes
from devcad.flatten.green import bounds, enclosed_area, perimeter
from devcad.flatten.pattern import Edge
from devcad.flatten.rings import backwards
from devcad.pipeline import build
from devcad.shop.offset import offset_contour, offset_edge
from devcad.shop.polygons import fine_polygon

SAMPLES = Path(__file__).parents[2] / "samples"
ROUNDING = 1e-9  # mm2, of areas up to 1e5 mm2

NOTCHED = shapes.polygon(
    [(0, 0), (100, 0), (100, 60), (60, 60), (60, 30), (40, 30), (40, 60), (0, 60)]
)
STEPPED = shapes.polygon([(0, 0), (100, 0), (100, 60), (60, 60), (60, 100), (0, 100)])
TRIANGLE = shapes.polygon([(0, 0), (100, 0), (30, 40)])
MOUTH = [(26, 20), (26, 18), (40, 18), (40, 5), (20, 5), (20, 18), (24, 18), (24, 20)]
KEYHOLE = shapes.polygon([(0, 0), (50, 0), (50, 20), *MOUTH, (0, 20)])
"""Its slot is 2 mm wide and leads to a room of 20 x 13 mm."""


def lens(radius: float = 100.0, half: float = 60.0) -> tuple[Edge, ...]:
    """Two arcs over a chord of twice ``half``."""
    high, angle = np.sqrt(radius**2 - half**2), np.arcsin(half / radius)
    low = shapes.arc(np.array([0, high]), radius, (-np.pi / 2 - angle, -np.pi / 2 + angle))
    top = shapes.arc(np.array([0, -high]), radius, (np.pi / 2 - angle, np.pi / 2 + angle))
    return low, top


def ellipse(a: float = 50.0, b: float = 20.0) -> tuple[Edge, ...]:
    zero = np.zeros(2)
    return (shapes.conic_arc(zero, np.array([a, 0.0]), np.array([0.0, b]), (0.0, 2.0 * np.pi)),)


CONVEX = {
    "triangle": TRIANGLE,
    "rectangle": shapes.rectangle(100, 50),
    "rounded": shapes.rectangle(100, 50, 10),
    "stadium": shapes.slot(80, 20),
    "circle": shapes.circle(60),
    "ellipse": ellipse(),
    "lens": lens(),
}


def polygon(contour: tuple[Edge, ...]) -> shapely.Polygon:
    """The contour to 1e-4 mm."""
    return shapely.Polygon(fine_polygon(contour, 1e-4)[0])


def gaps(contour: tuple[Edge, ...]) -> float:
    """The largest distance of an edge's end from the next one's start."""
    pairs = itertools.pairwise([*contour, contour[0]])
    return max(
        float(np.hypot(*(a.curve(a.u[-1:])[0][0] - b.curve(b.u[:1])[0][0]))) for a, b in pairs
    )


@pytest.mark.parametrize("distance", [1e-3, 0.1, 5.0, 300.0])
@pytest.mark.parametrize("name", CONVEX)
def test_steiner_gives_area_and_length_of_the_round_offset(name: str, distance: float) -> None:
    contour = CONVEX[name]
    made = offset_contour(contour, [distance] * len(contour), "round")
    area, length = enclosed_area(contour), perimeter(contour)
    grown = area + length * distance + np.pi * distance**2
    assert enclosed_area(made) == pytest.approx(grown, rel=1e-13)
    assert perimeter(made) == pytest.approx(length + 2.0 * np.pi * distance, rel=1e-13)
    assert gaps(made) < 1e-12 * (length + distance)


def test_a_mitre_adds_the_square_of_the_distance_times_the_tangent_of_half_the_turn() -> None:
    corners = np.array([edge.curve(edge.u[:1])[0][0] for edge in TRIANGLE])
    sides = np.roll(corners, -1, axis=0) - corners
    turns = np.angle(np.exp(1j * np.diff(np.arctan2(sides[:, 1], sides[:, 0]), append=np.nan)))
    turns[-1] = 2.0 * np.pi - turns[:-1].sum()
    sharp = turns > 2.0 * np.arccos(1.0 / 4.0)  # cut off at four distances from the corner
    assert not sharp.any()
    made = offset_contour(TRIANGLE, [3.0] * 3)
    wanted = enclosed_area(TRIANGLE) + 3.0 * perimeter(TRIANGLE) + 9.0 * np.tan(turns / 2).sum()
    assert enclosed_area(made) == pytest.approx(wanted, rel=1e-13)


def test_a_needle_is_cut_off_four_distances_from_its_tip() -> None:
    needle = shapes.polygon([(0, 0), (0, -1), (100, 0), (0, 1)])
    made = offset_contour(needle, [2.0] * 4)
    assert bounds(made)[2] == pytest.approx(100.0 + 4.0 * 2.0, rel=1e-13)


def test_a_square_corner_keeps_one_distance_from_its_corner() -> None:
    made = offset_contour(shapes.rectangle(10, 10), [2.0] * 4, "square")
    tip = np.max(polygon(made).exterior.coords @ np.array([[1.0], [1.0]]) / np.sqrt(2.0))
    assert tip == pytest.approx(5.0 * np.sqrt(2.0) + 2.0, rel=1e-13)


@pytest.mark.parametrize("distance", [-29.0, -3.0, 4.0])
def test_circles_stay_circles(distance: float) -> None:
    (made,) = offset_contour(shapes.circle(60), [distance])
    points = made.curve(np.linspace(0.0, 2.0 * np.pi, 101))[0]
    np.testing.assert_allclose(np.hypot(*points.T), 30.0 + distance, rtol=1e-14)


@pytest.mark.parametrize("distance", [-4.0, 7.0])
@pytest.mark.parametrize("edge", [ellipse()[0], backwards(ellipse())[0], lens()[0]])
def test_the_derivative_is_that_of_the_points(edge: Edge, distance: float) -> None:
    made = offset_edge(edge, distance)
    step = 1e-5
    u = np.linspace(*np.sort(edge.u[[0, -1]]), 41)[1:-1]
    ahead, back = (made.curve(u + h)[0] for h in (step, -step))
    # the error of the difference is third derivative x step^2 / 6, about 1e-8
    np.testing.assert_allclose(made.curve(u)[1], (ahead - back) / (2.0 * step), atol=1e-6)


def test_offset_there_and_back_gives_the_contour_back() -> None:
    for contour in CONVEX.values():
        out = offset_contour(contour, [5.0] * len(contour), "round")
        back = offset_contour(out, [-5.0] * len(out))
        assert enclosed_area(back) == pytest.approx(enclosed_area(contour), rel=1e-11)
        assert len(back) == len(contour)


@pytest.mark.parametrize("distance", [-3.0, 4.0])
@pytest.mark.parametrize("contour", [NOTCHED, STEPPED, lens(), TRIANGLE])
def test_round_offsets_keep_the_distance_everywhere(
    contour: tuple[Edge, ...], distance: float
) -> None:
    """Of a notched outline too: hollow corners end where the sides cross."""
    made = offset_contour(contour, [distance] * len(contour), "round")
    border = polygon(contour).exterior
    points = shapely.points(fine_polygon(made, 1e-2)[0])
    np.testing.assert_allclose(
        shapely.distance(border, points),
        abs(distance),
        atol=2e-4,  # of the polygon that stands for the border
    )


@pytest.mark.parametrize("distance", [-8.0, -3.0, 4.0, 9.0])
@pytest.mark.parametrize("contour", [NOTCHED, STEPPED])
def test_offsets_have_the_area_of_another_program(
    contour: tuple[Edge, ...], distance: float
) -> None:
    for kind, style in (("round", "round"), ("mitre", "mitre")):
        made = enclosed_area(offset_contour(contour, [distance] * len(contour), kind))
        other = polygon(contour).buffer(distance, quad_segs=512, join_style=style, mitre_limit=4.0)
        # its arcs are polygons of 2048 sides: pi d^2 x 1.6e-6
        assert made == pytest.approx(other.area, abs=1e-3)


@pytest.mark.parametrize("distance", [-19.0, -4.0])
def test_a_lens_shrinks_to_the_lens_of_smaller_arcs(distance: float) -> None:
    made = offset_contour(lens(), [distance] * 2)
    radius, high = 100.0 + distance, 80.0
    half = np.sqrt(radius**2 - high**2)
    segment = radius**2 * np.arctan2(half, high) - half * high
    assert enclosed_area(made) == pytest.approx(2.0 * segment, abs=ROUNDING)


@pytest.mark.parametrize("kind", ["mitre", "round", "square"])
def test_each_side_of_a_rectangle_moves_by_its_own_distance(kind: str) -> None:
    contour = shapes.rectangle(100, 50)
    box = bounds(offset_contour(contour, [1.0, 2.0, 3.0, 4.0], kind))
    ends = [edge.curve(edge.u)[0] for edge in contour]
    wide = [abs(e[0, 0]) if e[0, 0] == e[1, 0] else abs(e[0, 1]) for e in ends]
    grown = sorted(np.abs(box))
    assert sorted(np.add(wide, [1.0, 2.0, 3.0, 4.0])) == pytest.approx(grown, rel=1e-14)


@pytest.mark.parametrize("turn", [1e-5, 1e-3, 0.03])
@pytest.mark.parametrize("distance", [1.0, 20.0])
def test_a_line_and_an_arc_with_hardly_a_corner_between_them(turn: float, distance: float) -> None:
    """The chords of both cross nowhere near the corner."""
    start, angle = np.array([0.0, -100.0]), -0.5 * np.pi - turn
    center = start - 100.0 * np.array([np.cos(angle), np.sin(angle)])
    bend = shapes.arc(center, 100.0, (angle, 0.5 * np.pi))
    end = bend.curve(bend.u[1:])[0][0]
    corners = [end, [-80.0, end[1]], [-80.0, -100.0], start]
    contour = (bend, *(shapes.line(a, b) for a, b in itertools.pairwise(corners)))
    made = offset_contour(contour, [distance] * len(contour), "round")
    area, length = enclosed_area(contour), perimeter(contour)
    # the round corners turn by 2 pi and the hollow's turn more; its strips share a kite
    grown = area + length * distance + 0.5 * (2.0 * np.pi + turn) * distance**2
    kite = distance**2 * np.tan(0.5 * turn)
    assert enclosed_area(made) == pytest.approx(grown - kite, rel=1e-7)  # of straight sides


def test_an_allowance_on_one_side_is_a_rectangle_more() -> None:
    contour = shapes.rectangle(100, 50)
    side = perimeter(contour[:1])
    made = offset_contour(contour, [7.0, 0.0, 0.0, 0.0])
    assert enclosed_area(made) == pytest.approx(5000.0 + 7.0 * side, rel=1e-14)


def test_a_step_joins_tangent_sides_with_different_distances() -> None:
    contour = shapes.slot(80, 20)
    made = offset_contour(contour, [3.0, 1.0, 3.0, 1.0])
    straight = 2.0 * 60.0 * 3.0
    half_rounds = np.pi * (11.0**2 - 10.0**2)
    wanted = enclosed_area(contour) + straight + half_rounds
    assert enclosed_area(made) == pytest.approx(wanted, rel=1e-13)
    assert gaps(made) < 1e-12


def test_sides_keep_their_names_and_parameters() -> None:
    contour = tuple(
        Edge(name, edge.curve, edge.u)
        for name, edge in zip(("start", "top", "end", "base", "base", "base"), STEPPED, strict=True)
    )
    made = offset_contour(contour, [-2.0] * 6, "round")
    kept = [edge for edge in made if edge.name != "corner"]
    assert [edge.name for edge in kept] == [edge.name for edge in contour]
    for edge, source in zip(kept, contour, strict=True):
        away = edge.curve(edge.u)[0] - source.curve(edge.u)[0]
        np.testing.assert_allclose(np.hypot(*away.T), 2.0, rtol=1e-13)


def test_a_hole_run_clockwise_grows_material_into_its_void() -> None:
    hole = backwards(shapes.circle(20))
    assert enclosed_area(offset_contour(hole, [1.0])) == pytest.approx(-81.0 * np.pi, rel=1e-14)


def test_a_cusp_into_the_sheet_closes_and_one_out_of_it_is_cut_off() -> None:
    """Two half circles inside each other's tangent: the area of the offset is shapely's."""
    big = shapes.arc(np.zeros(2), 40.0, (0.0, np.pi))
    base = shapes.line(np.array([-40.0, 0.0]), np.array([20.0, 0.0]))
    small = shapes.arc(np.array([30.0, 0.0]), 10.0, (np.pi, 0.0))  # ends along the big one's end
    contour = (big, base, small)
    for distance in (-2.0, 2.0):
        made = offset_contour(contour, [distance] * 3, "round")
        other = polygon(contour).buffer(distance, quad_segs=512).area
        assert enclosed_area(made) == pytest.approx(other, abs=0.02)  # of polygons at the cusp


# --- refusals ------------------------------------------------------------------------------


def test_a_keyhole_keeps_its_slot_until_the_sides_meet() -> None:
    made = offset_contour(KEYHOLE, [0.99] * len(KEYHOLE))
    other = polygon(KEYHOLE).buffer(0.99, join_style="mitre").area
    assert enclosed_area(made) == pytest.approx(other, rel=1e-12)
    with pytest.raises(GeometryError, match="crosses itself") as caught:
        offset_contour(KEYHOLE, [1.01] * len(KEYHOLE))
    assert caught.value.limit == pytest.approx(2.02)
    assert caught.value.value == pytest.approx(2.0, abs=0.1)
    x, y = (float(part) for part in caught.value.place[9:-1].split(","))
    assert 23.9 < x < 26.1
    assert 17.0 < y < 22.0
    assert caught.value.remedy


def test_a_hollow_of_a_smaller_radius_is_refused() -> None:
    hollow = backwards(shapes.rectangle(100, 50, 4.0))
    offset_contour(hollow, [3.9] * len(hollow))
    with pytest.raises(GeometryError, match="folds") as caught:
        offset_contour(hollow, [4.1] * len(hollow))
    assert caught.value.value == pytest.approx(4.0, rel=1e-12)
    assert caught.value.limit == 4.1


def test_an_ellipse_folds_at_its_smallest_radius() -> None:
    smallest = 20.0**2 / 50.0  # b^2 / a
    offset_contour(ellipse(), [-0.999 * smallest])
    with pytest.raises(GeometryError, match="folds") as caught:
        offset_contour(ellipse(), [-1.001 * smallest])
    assert caught.value.value == pytest.approx(smallest, rel=1e-6)


@pytest.mark.parametrize(
    ("contour", "distance"),
    [
        (shapes.rectangle(100, 10), -5.1),
        (shapes.circle(20), -10.0),
        (shapes.circle(20), -30.0),
        (TRIANGLE, -40.0),
        (STEPPED, -31.0),
        (lens(), -20.1),
    ],
)
def test_a_contour_that_vanishes_is_refused(contour: tuple[Edge, ...], distance: float) -> None:
    with pytest.raises(GeometryError) as caught:
        offset_contour(contour, [distance] * len(contour))
    assert caught.value.place.startswith("pattern (")
    assert caught.value.remedy


# --- patterns ------------------------------------------------------------------------------


@cache
def outline_of(sample: str) -> tuple[Edge, ...]:
    return build(SAMPLES / f"{sample}.toml").panels[0].pattern.outline


@pytest.mark.parametrize("distance", [-2.0, 5.0])
@pytest.mark.parametrize("sample", ["lampshade", "oblique-reducer"])
def test_patterns_of_samples_follow_steiner(sample: str, distance: float) -> None:
    """Convex corners and smooth hollows turn round once in all: A + L d + pi d^2 outwards."""
    outline = outline_of(sample)
    made = offset_contour(outline, [distance] * len(outline), "round")
    other = polygon(outline).buffer(distance, quad_segs=256).area
    assert enclosed_area(made) == pytest.approx(other, abs=1e-3 * perimeter(outline))
    if distance > 0.0:
        grown = enclosed_area(outline) + perimeter(outline) * distance + np.pi * distance**2
        assert enclosed_area(made) == pytest.approx(grown, rel=1e-12)
        back = offset_contour(made, [-distance] * len(made))
        assert enclosed_area(back) == pytest.approx(enclosed_area(outline), rel=1e-9)
    assert gaps(made) < 1e-10
