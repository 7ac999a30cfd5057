"""Nesting: blanks lie on their sheets, apart, unmirrored and along the grain."""

from __future__ import annotations

import subprocess
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import GeometryError, LimitError
from devcad.flatten import shapes
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge
from devcad.shop import nesting
from devcad.shop.blanks import Blank, blank, boxes
from devcad.shop.nesting import Nest, nest, room
from devcad.shop.placing import moved_edge, turn
from devcad.shop.polygons import fine_polygon
from devcad.shop.settings import Sheet
from devcad.shop.shelves import shelve

SHEET = Sheet((400.0, 300.0), 5.0)
ELL = shapes.polygon([(0, 0), (80, 0), (80, 25), (25, 25), (25, 60), (0, 60)])
Contour = tuple[Edge, ...]


def sector(inner: float, outer: float, sweep: float) -> Contour:
    """A cone's blank."""
    ends = np.array([[np.cos(a), np.sin(a)] for a in (0.0, sweep)])
    back = shapes.arc(np.zeros(2), inner, (sweep, 0.0))
    return (
        shapes.line(inner * ends[0], outer * ends[0]),
        shapes.arc(np.zeros(2), outer, (0.0, sweep)),
        shapes.line(outer * ends[1], inner * ends[1]),
        back,
    )


def made(
    contour: Contour, quantity: int = 1, grain: float | None = None, sheet: Sheet = SHEET
) -> Blank:
    return blank(
        "part",
        contour,
        quantity=quantity,
        grain=grain,
        room=room(sheet),
        area=enclosed_area(contour),
    )


def assert_nested(found: Nest, contours: list[Contour], sheet: Sheet) -> None:
    """Exact boxes inside the margins, no two nearer than the gap; by shapely on dense polygons."""
    sagitta = 1e-4
    for number in range(found.sheets):
        placed = []
        for one in (p for p in found.placed if p.sheet == number):
            edges = tuple(
                moved_edge(edge, turn(one.angle), np.array([one.x, one.y]))
                for edge in contours[one.blank]
            )
            xmin, ymin, xmax, ymax = bounds(edges)
            low, high = sheet.gap - 1e-6, np.array(sheet.size) - sheet.gap + 1e-6
            assert min(xmin, ymin) >= low
            assert xmax <= high[0]
            assert ymax <= high[1]
            placed.append(shapely.Polygon(fine_polygon(edges, sagitta)[0]))
        for k, shape in enumerate(placed):
            others = shapely.distance(shape, placed[:k])
            assert np.min(others, initial=np.inf) >= sheet.gap - 1e-6 - 2.0 * sagitta
    counts = [sum(p.blank == k for p in found.placed) for k in range(len(contours))]
    assert all(counts)
    assert found.clear >= sheet.gap - 1e-6


# --- blanks --------------------------------------------------------------------------------


@given(st.floats(-720.0, 720.0))
@settings(deadline=None, max_examples=40)
def test_the_box_of_a_turned_ellipse_is_its_closed_form(angle: float) -> None:
    ellipse = shapes.conic_arc(
        np.zeros(2), np.array([50.0, 0]), np.array([0, 20.0]), (0, 2 * np.pi)
    )
    (box,) = boxes((ellipse,), [angle])
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    reach = np.hypot([50.0 * cos, 50.0 * sin], [20.0 * sin, 20.0 * cos])
    np.testing.assert_allclose(box, [*-reach, *reach], rtol=1e-13)


def test_quarter_turns_are_exact() -> None:
    for angle in (-90.0, 0.0, 90.0, 180.0, 270.0, 360.0):
        assert set(np.abs(turn(angle)).ravel()) == {0.0, 1.0}


@pytest.mark.parametrize("grain", [0.0, 0.5, np.pi / 2, 3.0, -1.0])
def test_the_grain_lies_along_the_sheet(grain: float) -> None:
    one = made(ELL, grain=grain)
    assert len(one.angles) == 2
    along = [turn(angle) @ [np.cos(grain), np.sin(grain)] for angle in one.angles]
    # angles are rounded to 1e-9 degrees
    np.testing.assert_allclose(sorted(along, key=tuple), [[-1.0, 0.0], [1.0, 0.0]], atol=1e-10)


def test_a_tilted_rectangle_may_be_laid_square() -> None:
    tilted = tuple(moved_edge(e, turn(33.0), np.zeros(2)) for e in shapes.rectangle(80, 30))
    widths = made(tilted).sizes().min(axis=0)
    np.testing.assert_allclose(widths, [30.0, 30.0], atol=1e-8)  # of an angle to 1e-9 degrees


def test_what_fits_only_askew_is_laid_askew() -> None:
    """A strip longer than the sheet and shorter than its diagonal."""
    long = shapes.rectangle(460, 4)
    found = nest([made(long)], SHEET)
    assert found.sheets == 1
    assert_nested(found, [long], SHEET)


# --- shelves -------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(1.0, 100.0), st.floats(1.0, 100.0)), min_size=1, max_size=30),
    st.floats(0.0, 10.0),
)
@settings(deadline=None, max_examples=60)
def test_shelves_keep_boxes_apart_and_on_their_sheets(
    sides: list[tuple[float, float]], gap: float
) -> None:
    size = (150.0, 120.0)
    found = shelve([[box, box[::-1]] for box in sides], size, gap)
    rows = [
        (one.sheet, one.left, one.bottom, *(box if one.form == 0 else box[::-1]))
        for one, box in zip(found, sides, strict=True)
    ]
    for k, (sheet, x, y, w, h) in enumerate(rows):
        assert min(x, y) >= 0.0
        assert x + w <= size[0] + 1e-6
        assert y + h <= size[1] + 1e-6
        for other, x1, y1, w1, h1 in rows[:k]:
            apart = max(x1 - x - w, x - x1 - w1, y1 - y - h, y - y1 - h1)
            assert other != sheet or apart >= gap - 1e-6


# --- nests ---------------------------------------------------------------------------------


def test_a_blank_as_large_as_the_room_fits() -> None:
    for contour in (shapes.rectangle(390, 290), shapes.slot(390, 290)):
        found = nest([made(contour)], SHEET)
        assert_nested(found, [contour], SHEET)
        assert found.clear == pytest.approx(5.0, abs=1e-9)


def test_rectangles_that_fill_the_sheet_to_rounding_fill_it() -> None:
    sheet = Sheet((100.0, 60.0), 0.0)
    tiles = shapes.rectangle(25, 20)
    found = nest([made(tiles, 12, sheet=sheet)], sheet)
    assert found.sheets == 1
    assert_nested(found, [tiles], sheet)


@pytest.mark.slow
def test_twelve_parts_share_a_sheet_and_the_same_seed_gives_the_same_nest() -> None:
    contours = [sector(30, 80, 1.5), ELL, shapes.circle(45)]
    blanks = [made(contour, 4) for contour in contours]
    found = nest(blanks, SHEET, seed=3)
    assert found.sheets == 1
    assert_nested(found, contours, SHEET)
    assert [(p.blank, p.copy) for p in found.placed] == [
        (b, c) for b in range(3) for c in (1, 2, 3, 4)
    ]
    assert nest(blanks, SHEET, seed=3) == found


@pytest.mark.slow
def test_hollows_are_used_where_boxes_would_need_another_sheet() -> None:
    """Two L of 100 x 100 with legs 30 wide, one within the other's elbow."""
    ell = shapes.polygon([(0, 0), (100, 0), (100, 30), (30, 30), (30, 100), (0, 100)])
    sheet = Sheet((155.0, 145.0), 4.0)
    blanks = [made(ell, 2, sheet=sheet)]
    boxes_alone = nesting._shelved(blanks, [0, 0], sheet)
    assert len(boxes_alone) == 2
    found = nest(blanks, sheet)
    assert found.sheets == 1
    assert_nested(found, [ell], sheet)


@pytest.mark.slow
def test_more_than_one_sheet_holds_come_on_several() -> None:
    contours = [sector(30, 110, 2.0), ELL]
    blanks = [made(contours[0], 7), made(contours[1], 9, grain=0.7)]
    found = nest(blanks, SHEET)
    assert found.sheets > 1
    assert_nested(found, contours, SHEET)
    assert len(found.placed) == 16
    areas = [
        sum(enclosed_area(contours[p.blank]) for p in found.placed if p.sheet == k)
        for k in range(found.sheets)
    ]
    assert min(areas) > 0.0
    shelves = nesting._shelved(blanks, [*[0] * 7, *[1] * 9], SHEET)
    assert areas[0] > sum(enclosed_area(contours[p.blank]) for p in shelves[0])


def failing(*_: object, **__: object) -> object:
    raise subprocess.TimeoutExpired("solver", 1)


def test_without_the_solver_the_shelves_hold_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "run", failing)
    contours = [sector(30, 80, 1.5), ELL, shapes.circle(45)]
    found = nest([made(contour, 4) for contour in contours], SHEET)
    assert_nested(found, contours, SHEET)
    assert len(found.placed) == 12


def test_a_nest_that_breaks_the_gap_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the solver says: here, all on one heap."""

    def heap(task: dict[str, list[object]], _: int) -> list[list[float]]:
        return [[0, 0.0, 100.0, 100.0]] * 4

    monkeypatch.setattr(nesting, "_asked", heap)
    found = nest([made(ELL, 4)], SHEET)
    assert_nested(found, [ELL], SHEET)


@pytest.mark.parametrize("grain", [None, np.pi / 4])
def test_a_blank_larger_than_the_sheet_is_refused(grain: float | None) -> None:
    large = shapes.rectangle(395, 100)
    with pytest.raises(GeometryError, match="larger than the sheet") as caught:
        nest([made(ELL), made(large, grain=0.0 if grain is None else grain)], SHEET)
    assert caught.value.place == "part"
    assert caught.value.limit == "390 x 290"
    assert caught.value.remedy


def test_too_many_copies_are_refused() -> None:
    with pytest.raises(LimitError):
        nest([replace(made(ELL), quantity=nesting.MOST + 1)], SHEET)
