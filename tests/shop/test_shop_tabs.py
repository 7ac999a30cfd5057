"""Tabs: trapezia and rows of teeth against areas by hand, their roots and shapely."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely

from devcad.errors import GeometryError
from devcad.flatten import shapes
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge, Pattern
from devcad.geometry.taylor import Array
from devcad.shop.allowance import allowed
from devcad.shop.polygons import fine_polygon
from devcad.shop.settings import EdgeFinish
from devcad.shop.tabs import NARROWEST, ROUGH, SAGITTA, Tab, tabs

NAMES = ("start", "top", "end", "base")
FREE = (0.25 * np.pi, 0.25 * np.pi)


def polygon(edges: tuple[Edge, ...]) -> shapely.Polygon:
    """The contour to 1e-4 mm."""
    return shapely.Polygon(fine_polygon(edges, 1e-4)[0])


def pattern(*edges: Edge) -> Pattern:
    return Pattern(edges, (), enclosed_area(edges), bounds(edges))


def named(points: list[tuple[float, float]]) -> Pattern:
    corners = np.array(points, dtype=float)
    sides = zip(corners, np.roll(corners, -1, axis=0), NAMES, strict=True)
    return pattern(*(shapes.line(a, b, name) for a, b, name in sides))


def arc(radius: float, sweep: float, *, hollow: bool) -> Edge:
    """An arc at the right of whose run lies the outside: of a disc, or of a hole if ``hollow``."""
    angles = (sweep, 0.0) if hollow else (0.0, sweep)
    return shapes.arc(np.zeros(2), radius, angles, "top")


def rooted(outline: tuple[Edge, ...], radius: float) -> Array:
    """The places of an outline on a circle about the origin, (n, 2)."""
    ends = np.array([edge.curve(edge.u[:1])[0][0] for edge in outline])
    last = outline[-1].curve(outline[-1].u[-1:])[0]
    points = np.concatenate([ends, last])
    return points[np.abs(np.hypot(*points.T) - radius) < 1e-9 * radius]


def glued(areas: tuple[Edge, ...]) -> list[shapely.Polygon]:
    starts = [edge.curve(edge.u[:1])[0][0] for edge in areas]
    return [shapely.Polygon(starts[k : k + 4]) for k in range(0, len(starts), 4)]


def test_a_straight_edge_has_one_trapezium_with_ends_at_45_degrees() -> None:
    box = named([(0, 0), (100, 0), (100, 50), (0, 50)])
    made = allowed(box, {"start": EdgeFinish(8.0, "tab"), "top": EdgeFinish(12.0, "tab")}).pattern
    assert made.area == pytest.approx(5000.0 + 8.0 * 92.0 + 12.0 * 38.0, rel=1e-14)
    assert [e.name for e in made.outline] == ["corner"] * 6 + ["end", "base"]
    folds = [e for e in made.drawings if e.name == "SCORE"]
    np.testing.assert_array_equal(folds[0].curve(folds[0].u)[0], [[0, 0], [100, 0]])
    assert len(folds) == 2
    areas = glued(tuple(e for e in made.drawings if e.name == "GLUE"))
    inset = 8.0 - 2.0, 100.0 - 2.0 - 2.0 * np.sqrt(2.0)  # height and the longer side
    assert areas[0].area == pytest.approx(inset[0] * (inset[1] - inset[0]), rel=1e-12)
    flap = polygon(made.outline).difference(polygon(box.outline))
    assert all(flap.buffer(-0.999).buffer(1e-3, join_style="mitre").contains(a) for a in areas)


def cut_over(row: tuple[Tab, ...]) -> tuple[Edge, ...]:
    return tuple(edge for tab in row for edge in tab.outline())


def test_a_short_edge_has_a_lower_tab_with_a_quarter_of_its_root_outside() -> None:
    made = tabs(shapes.line(np.zeros(2), np.array([10.0, 0.0])), 20.0, FREE)
    tab = np.array([edge.curve(edge.u[:1])[0][0] for edge in cut_over(made)])
    np.testing.assert_allclose(tab, [[0, 0], [3.75, -3.75], [6.25, -3.75]], atol=1e-12)


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize(("radius", "height"), [(360.0, 8.0), (60.0, 8.0), (20.0, 8.0), (9.0, 8.0)])
def test_the_teeth_of_an_arc_stand_on_it_on_short_roots_and_apart(
    radius: float, height: float, hollow: bool
) -> None:
    sweep = 2.0
    made = tabs(arc(radius, sweep, hollow=hollow), height, (None, None))
    roots = rooted(cut_over(made), radius)
    steps = np.hypot(*np.diff(roots, axis=0).T)
    assert len(steps) == len(made)
    sagitta = radius - np.sqrt(radius**2 - 0.25 * steps**2)
    fine = sagitta <= ROUGH * SAGITTA * height
    assert np.all(fine | (steps <= 1.001 * NARROWEST * height))
    np.testing.assert_allclose(steps, steps[0], rtol=0.02)
    widest = np.sqrt(8.0 * SAGITTA * height * radius)
    assert steps[0] > 0.5 * min(widest, NARROWEST * height)  # not more teeth than there must be
    teeth = [shapely.Polygon(tab.corners()) for tab in made]
    for one, other in pairwise(teeth):
        assert one.intersection(other).area < 1e-9
    far = max(np.hypot(*np.array(tooth.exterior.coords).T).max() for tooth in teeth)
    assert far <= (radius + 1e-9 if hollow else radius + 1.02 * height)
    for tab, tooth in zip(made, teeth, strict=True):
        assert tooth.contains(glued(tab.glue())[0])


def lampshade(angle: float = 2.2) -> Pattern:
    zero, x = np.zeros(2), np.array([1.0, 0.0])
    out = np.array([np.cos(angle), np.sin(angle)])
    return pattern(
        shapes.line(200.0 * x, 360.0 * x, "start"),
        shapes.arc(zero, 360.0, (0.0, angle), "top"),
        shapes.line(360.0 * out, 200.0 * out, "end"),
        shapes.arc(zero, 200.0, (angle, 0.0), "base"),
    )


def test_a_lampshade_with_tabs_all_round_keeps_its_sheet_and_has_no_crossing() -> None:
    shape = lampshade()
    finishes = {"end": EdgeFinish(12.0, "tab")} | {
        name: EdgeFinish(8.0, "tab") for name in ("base", "top")
    }
    made = allowed(shape, finishes).pattern  # type: ignore[arg-type]
    new, old = polygon(made.outline), polygon(shape.outline)
    assert new.is_valid
    assert new.buffer(1e-3).contains(old)
    assert new.area == pytest.approx(made.area, rel=1e-7)
    # between a third of the strips and all of them
    strips = 12.0 * 160.0 + 8.0 * 2.2 * (360.0 + 200.0)
    assert strips / 3.0 < made.area - shape.area < strips
    glue = glued(tuple(edge for edge in made.drawings if edge.name == "GLUE"))
    assert all(new.contains(area) and area.intersection(old).area < 1e-9 for area in glue)


@pytest.mark.parametrize("beside", ["raw", "turned", "lap", "tab"])
@pytest.mark.parametrize("corner", ["mitre", "square", "round"])
def test_tabs_in_a_hollow_and_beside_other_finishes_do_not_touch(beside: str, corner: str) -> None:
    """An arrowhead: its corners have 27, 37 and, at the hollow, 243 degrees."""
    shape = named([(0, 0), (50, 30), (100, 0), (50, 100)])
    other = EdgeFinish(9.0, beside, corner)  # type: ignore[arg-type]
    tab = EdgeFinish(9.0, "tab")
    made = allowed(shape, {"start": tab, "top": other, "end": tab, "base": other}).pattern
    assert polygon(made.outline).is_valid
    assert made.area > shape.area + 4.0 * 9.0 * 15.0


def test_an_edge_with_a_corner_has_a_tab_on_either_side_of_it() -> None:
    points = [np.array(p, dtype=float) for p in ((0, 0), (60, 0), (100, 40), (0, 40))]
    names = ("base", "base", "end", "start")
    sides = zip(points, [*points[1:], points[0]], names, strict=True)
    shape = pattern(*(shapes.line(a, b, name) for a, b, name in sides))
    made = allowed(shape, {"base": EdgeFinish(6.0, "tab")})
    slant = 40.0 * np.sqrt(2.0)
    assert made.pattern.area == pytest.approx(shape.area + 6.0 * (54.0 + slant - 6.0), rel=1e-13)
    (flap,) = made.flaps
    assert [edge.name for edge in flap.seam] == ["base", "base"]


def test_tabs_that_run_into_another_edge_are_refused() -> None:
    with pytest.raises(GeometryError, match=r"the allowance of edge (start|end)") as caught:
        allowed(lampshade(6.24), {"start": EdgeFinish(30.0, "tab"), "end": EdgeFinish(30.0, "tab")})
    assert caught.value.place == ""
    assert caught.value.remedy


def test_teeth_give_way_in_a_narrow_hollow() -> None:
    """Two half discs side by side: the void between them ends in a cusp."""
    left, right, low = np.array([-40.0, 0.0]), np.array([40.0, 0.0]), np.array([0.0, 30.0])
    shape = pattern(
        shapes.line(2.0 * left - low, 2.0 * right - low, "start"),
        shapes.line(2.0 * right - low, 2.0 * right, "end"),
        shapes.arc(right, 40.0, (0.0, np.pi), "top"),
        shapes.arc(left, 40.0, (0.0, np.pi), "top"),
        shapes.line(2.0 * left, 2.0 * left - low, "base"),
    )
    made = allowed(shape, {"top": EdgeFinish(5.0, "tab")}).pattern
    new = polygon(made.outline)
    assert new.is_valid
    assert new.buffer(1e-3).contains(polygon(shape.outline))
    assert new.bounds[3] == pytest.approx(45.0, rel=0.01)
    assert made.area > shape.area + 0.4 * 5.0 * 80.0 * np.pi
