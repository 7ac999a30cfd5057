"""Labels: strokes inside the outline, clear of holes, lines, drawings and each other. Everything is
measured by shapely on the curves as they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely

from devcad.flatten.lettering import lettering
from devcad.flatten.pattern import Edge, Line, Pattern, sample
from devcad.flatten.shapes import arc, line
from devcad.geometry.seams import Meeting
from devcad.part import Panel, Part
from devcad.shop.labels import LEAST, Texts, label_texts, labelled
from devcad.shop.placing import moved_edge

TWO_PI = 2.0 * np.pi
TEXTS = Texts(
    ("P-17 rev C", "left"),
    ("qty 4  DC01  2 mm",),
    (("top", ("2 > right.top", "2")), ("base", ("1 > lid.base", "1"))),
)
NAMES = ("start", "top", "end", "base")


def shape(edges: Sequence[Edge], steps: int = 400) -> shapely.Polygon:
    return shapely.Polygon(np.concatenate([sample(e, steps)[:-1] for e in edges]))


def made(outline: Sequence[Edge], holes: Sequence[tuple[Edge, ...]] = ()) -> Pattern:
    whole = shape(outline)
    area = whole.area - sum(abs(shape(hole).area) for hole in holes)
    return Pattern(tuple(outline), (), float(area), whole.bounds, tuple(holes))


def corners(points: Sequence[tuple[float, float]], names: Sequence[str] = NAMES) -> list[Edge]:
    after = [*points[1:], points[0]]
    return [line(np.array(a), np.array(b), n) for a, b, n in zip(points, after, names, strict=True)]


def plate(width: float, height: float, holes: Sequence[tuple[float, float, float]] = ()) -> Pattern:
    """A rectangle from the origin with round holes x, y, diameter."""
    outline = corners([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
    return made(outline, [(hole(x, y, 0.5 * d),) for x, y, d in holes])


def hole(x: float, y: float, radius: float) -> Edge:
    return arc(np.array([x, y]), radius, (TWO_PI, 0.0))


def ring(inner: float, outer: float, sweep: float) -> Pattern:
    """A sector of an annulus about the origin from the angle 0 on."""
    end = np.array([np.cos(sweep), np.sin(sweep)])
    return made(
        [
            line(np.array([inner, 0.0]), np.array([outer, 0.0]), "start"),
            arc(np.zeros(2), outer, (0.0, sweep), "top"),
            line(outer * end, inner * end, "end"),
            arc(np.zeros(2), inner, (sweep, 0.0), "base"),
        ]
    )


def crescent() -> Pattern:
    """Between two circular arcs through (-100, 0) and (100, 0), 40 mm wide in the middle, with
    two tips."""
    outer, inner = (np.arctan2(100.0, d) for d in (20.0, 115.0))
    big = arc(np.array([0.0, -20.0]), np.hypot(100, 20), (np.pi / 2 - outer, np.pi / 2 + outer))
    small = arc(np.array([0.0, -115.0]), np.hypot(100, 115), (np.pi / 2 + inner, np.pi / 2 - inner))
    return made([replace(big, name="top"), replace(small, name="base")])


def strokes(pattern: Pattern, role: str = "LABEL") -> shapely.MultiLineString:
    return shapely.MultiLineString([sample(e, 64) for e in pattern.drawings if e.name == role])


def assert_clear(pattern: Pattern, done: Pattern, height: float, notes: Sequence[str]) -> None:
    """Every stroke lies on the sheet, 0.5 mm or 0.4 of the least height in the notes from its
    border and what was drawn on it before."""
    drawn = strokes(replace(done, drawings=done.drawings[len(pattern.drawings) :]))
    sheet = shape(pattern.outline) - shapely.union_all([shape(h) for h in pattern.holes])
    assert sheet.contains(drawn)
    # letters may have become smaller: the margin with them, never below 0.5 mm
    away = shapely.distance(drawn, sheet.boundary)
    assert away >= (0.5 if notes else max(0.5, 0.4 * height)) - 1e-3
    before = [shapely.LineString(sample(e, 64)) for e in pattern.drawings]
    if before:
        assert shapely.distance(drawn, shapely.union_all(before)) >= 0.5 - 1e-3
    assert done.drawings[: len(pattern.drawings)] == pattern.drawings
    assert (done.outline, done.holes, done.area) == (pattern.outline, pattern.holes, pattern.area)


SHAPES = {
    "plate": plate(300, 200),
    "with a hole in the middle": plate(200, 120, [(100, 60, 80)]),
    "with rows of holes": plate(200, 90, [(8 + 23 * i, y, 12) for i in range(9) for y in (25, 65)]),
    "strip": plate(400, 12),
    "upright strip": plate(12, 400),
    "sector": ring(130, 260, 2.4166),
    "narrow ring": ring(190, 200, 4.5),
    "crescent": crescent(),
    "triangle": made(corners([(0, 0), (150, 20), (10, 90)], ("start", "top", "base"))),
    "hook": made(
        corners(
            [(0, 0), (200, 0), (200, 200), (185, 200), (185, 15), (0, 15)],
            ("start", "top", "end", "base", "base", "base"),
        )
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "height"), [*((name, 8.0) for name in SHAPES), ("hook", 20.0), ("crescent", 20.0)]
)
def test_every_letter_lies_on_the_sheet_clear_of_its_border(name: str, height: float) -> None:
    pattern = SHAPES[name]
    done, notes = labelled(pattern, TEXTS, height)
    assert {e.name for e in done.drawings} <= {"LABEL"}
    assert done.drawings
    assert_clear(pattern, done, height, notes)


def test_labels_do_not_lie_on_each_other() -> None:
    """One label after the other onto what is there: each keeps off all before it."""
    first, _ = labelled(plate(160, 90), TEXTS, 8.0)
    second, notes = labelled(first, Texts(("SECOND",)), 8.0)
    assert notes == ()
    assert_clear(first, second, 8.0, notes)


def test_letters_have_the_height_that_is_asked_for() -> None:
    done, notes = labelled(plate(300, 200), Texts(("HHH",)), 8.0)
    _, low, _, high = strokes(done).bounds
    assert high - low == pytest.approx(8.0, rel=1e-9)
    assert notes == ()
    left, _, right, _ = strokes(done).bounds  # in the middle of a plain plate
    assert (0.5 * (left + right), 0.5 * (low + high)) == pytest.approx((150.0, 100.0), abs=1e-6)


def test_a_label_on_a_strip_is_as_large_as_the_strip_allows() -> None:
    """A capital of height h asks for h + 2 max(0.4 h, 0.5): 1.8 h in a strip of 12 mm."""
    done, (note,) = labelled(plate(400, 12), Texts(("HHH",)), 20.0)
    _, low, _, high = strokes(done).bounds
    assert 0.75 * 12.0 / 1.8 < high - low < 12.0 / 1.8
    assert "mm high, not 20" in note


@pytest.mark.parametrize("size", [(3.0, 3.0), (1e-3, 1e-3), (500.0, 2.0)])
def test_what_has_no_room_at_2_mm_is_left_out_and_told(size: tuple[float, float]) -> None:
    pattern = plate(*size)
    done, notes = labelled(pattern, TEXTS, 8.0)
    assert done.drawings == ()
    assert notes == (
        "the label '2 > right.top' has no room along top",
        "the label '1 > lid.base' has no room along base",
        "the label 'P-17 rev C   left' has no room",
    )


def test_no_letter_is_smaller_than_2_mm_unless_asked_for() -> None:
    low, high = (
        strokes(labelled(plate(60, 4.0), Texts(("HHH",)), 8.0)[0]).bounds[k] for k in (1, 3)
    )
    assert LEAST <= high - low < 2.7
    small, notes = labelled(plate(60, 40), Texts(("HHH",)), 1.5)
    assert strokes(small).bounds[3] - strokes(small).bounds[1] == pytest.approx(1.5)
    assert notes == ()


def test_letters_stay_inside_the_seam_line() -> None:
    net = tuple(corners([(20.0, 20.0), (180.0, 20.0), (180.0, 60.0), (20.0, 60.0)]))
    done, _ = labelled(plate(200, 80), TEXTS, 8.0, net=net)
    assert shape(net).buffer(-0.5 + 1e-3).contains(strokes(done))


def test_glue_areas_and_bend_lines_stay_free_while_there_is_room() -> None:
    pattern = replace(
        plate(300, 100),
        lines=tuple(
            Line("BEND_UP", np.array([x, 0.0]), np.array([x, 100.0]), 0.1) for x in (60.0, 140, 150)
        ),
    )
    glue = [line(np.array([20.0, y]), np.array([300.0, y]), "GLUE") for y in (45.0, 55.0)]
    done, notes = labelled(pattern, Texts(("P-17", "left")), 8.0, obstacles=glue)
    assert notes == ()
    lines = [shapely.LineString([a.start, a.end]) for a in pattern.lines]
    lines += [shapely.LineString(sample(e, 2)) for e in glue]
    assert shapely.distance(strokes(done), shapely.union_all(lines)) >= 3.2 - 1e-3


def test_bend_lines_are_crossed_before_letters_get_very_small() -> None:
    pattern = replace(
        plate(100, 40),
        lines=tuple(
            Line("BEND_UP", np.array([x, 0.0]), np.array([x, 40.0]), 0.1) for x in range(2, 100, 3)
        ),
    )
    done, notes = labelled(pattern, Texts(("HHH",)), 8.0)
    _, low, _, high = strokes(done).bounds
    assert high - low == pytest.approx(8.0)
    assert notes == ()


def test_a_mates_label_runs_along_its_edge_and_stands_beside_it() -> None:
    texts = Texts(("X",), mates=(("top", ("7 > lid.base", "7")),))
    done, notes = labelled(ring(130, 260, 2.4166), texts, 8.0)
    assert notes == ()
    letters = [e for e in done.drawings if e.name == "LABEL"]
    count = len(lettering("7 > lid.base", 8.0))
    radii = np.hypot(*np.concatenate([sample(e, 16) for e in letters[:count]]).T)
    assert radii.max() < 260.0 - 3.0
    assert radii.min() > 260.0 - 25.0


@pytest.mark.parametrize("angle", [0.3, 1.5, np.pi / 2, 2.0, 4.0, 6.0])
def test_turning_the_pattern_never_turns_letters_on_their_head(angle: float) -> None:
    """The foot of an L runs to the right, or upwards where the line stands upright."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    outline = tuple(moved_edge(e, turn, np.zeros(2)) for e in plate(400, 12).outline)
    texts = Texts(("L",), mates=(("start", ("L",)),))
    done, _ = labelled(made(outline), texts, 5.0)
    feet = [np.subtract(*sample(e, 2)[[-1, 0]]) for e in done.drawings[1::2]]
    assert len(feet) == 2
    assert all(x > -1e-9 and (x > 1e-9 or y > 0.0) for x, y in feet)


def test_characters_without_strokes_become_question_marks_and_are_told() -> None:
    done, notes = labelled(plate(300, 100), Texts(("Sack 漢漢 7",)), 8.0)
    same, _ = labelled(plate(300, 100), Texts(("Sack ?? 7",)), 8.0)
    assert notes == ("the label's characters '漢' have no strokes",)
    for one, other in zip(done.drawings, same.drawings, strict=True):
        np.testing.assert_array_equal(sample(one, 4), sample(other, 4))


def test_letters_find_room_between_400_holes() -> None:
    pattern = plate(400, 400, [(20 * i + 10, 20 * j + 10, 5) for i in range(20) for j in range(20)])
    done, notes = labelled(pattern, TEXTS, 6.0)
    assert notes == ()
    assert_clear(pattern, done, 6.0, notes)


def test_the_same_letters_each_time() -> None:
    pattern = SHAPES["with rows of holes"]
    once, again = (labelled(pattern, TEXTS, 8.0)[0] for _ in range(2))
    for one, other in zip(once.drawings, again.drawings, strict=True):
        np.testing.assert_array_equal(sample(one, 4), sample(other, 4))


def part(**changes: object) -> Part:
    meetings = (
        Meeting((("left", "top"), ("right", "top")), 0.0, (1.0, 1.0), True, False),
        Meeting((("left", "start"), ("left", "end")), 0.0, (1.0, 1.0), True, False),
    )
    pair = tuple(Panel(n, "plane", None, (), 1.5, (), None, None) for n in ("left", "right"))  # type: ignore[arg-type]
    return replace(Part("bag", pair, 1.5, 0.05, (), seams=meetings), **changes)  # type: ignore[arg-type]


def test_equal_numbers_meet() -> None:
    whole = part()
    left, right = (label_texts(whole, panel) for panel in whole.panels)
    assert left.mates == (
        ("top", ("1 > right.top", "1")),
        ("start", ("2 > end", "2")),
        ("end", ("2 > start", "2")),
    )
    assert right.mates == (("top", ("1 > left.top", "1")),)


def test_a_label_says_what_the_piece_is() -> None:
    whole = part(part_number="B-7", revision="C", quantity=3, material="dc01", grain=0.0)
    texts = label_texts(whole, whole.panels[0])
    assert texts.title == ("B-7 rev C", "left")
    assert texts.more == ("qty 3  DC01  1.5 mm", "turn by 180 only")
    one = replace(whole, panels=whole.panels[:1], part_number="", revision="", grain=None)
    assert label_texts(one, one.panels[0]).title == ("bag",)
