"""What cuts leave of cells: areas, shared places, touching contours, notches and parted sheets."""

import numpy as np
import pytest
from patches import frustum, prism

from devcad.geometry import chebyshev
from devcad.geometry.cells import Run, Stretch, cells, whole
from devcad.geometry.chain import link
from devcad.geometry.cuts import Cut, Track

HEIGHT = 30.0
WHOLE = 2.0 * np.pi * HEIGHT


def pipe():
    """A circular pipe, t from 0 to 2 pi, v from 0 to 30: a rectangle in the plane (v, t)."""
    return link((frustum(10.0, 10.0, HEIGHT),), base_closed=True, tolerance=0.05)


def track(path, start, end, patch=0):
    return Track(
        patch, chebyshev.resolve(lambda u: np.column_stack(path(u)), np.array([start, end]))
    )


def ellipse(t, v, rt, rv):
    """Clockwise on the front: in the plane (v, t) the ruling is +x and t grows upwards."""
    path = track(lambda u: (t + rt * np.cos(u), v + rv * np.sin(u)), 0.0, 2.0 * np.pi)
    return Cut("ellipse", (path,), True)


def polygon(*corners, closed=True, patches=None):
    """Straight lines between places (t, v); the last leads back to the first where closed."""
    at = np.array(corners, dtype=float)
    ends = np.roll(at, -1, axis=0) if closed else at[1:]
    numbers = patches or [0] * len(ends)
    lines = tuple(
        track(lambda u, a=a, b=b: (a[0] + u * (b - a)[0], a[1] + u * (b - a)[1]), 0.0, 1.0, k)
        for a, b, k in zip(at, ends, numbers, strict=False)
    )
    return Cut("polygon", lines, closed)


def area(loop, cuts, borders):
    """The area in the plane (v, t) inside a loop, by the trapezium rule on many places."""
    places = []
    for item in loop:
        if isinstance(item, Run):
            for piece in item.pieces:
                line = cuts[piece.cut].tracks[piece.track].series
                places.append(line(np.linspace(*piece.u, 400))[:, ::-1])
        elif item.side in (0, 2):
            t = borders[0] if item.side == 0 else borders[1]
            places.append(np.array([[item.start, t], [item.end, t]]))
        else:
            v = HEIGHT if item.side == 1 else 0.0
            places.append(np.array([[v, item.start], [v, item.end]]))
    x, y = np.concatenate(places).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def left(cuts, chain, borders, number=0):
    found = cells(cuts, chain, number, borders)
    return sum(
        area(loop, cuts, borders[k : k + 2])
        for k, cell in enumerate(found)
        for loop in (*cell.loops, *((hole,) for hole in cell.holes))
    )


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_the_cells_together_are_the_sheet_without_its_holes(count):
    chain, rng = pipe(), np.random.default_rng(count)
    sizes = [(i, j, *rng.uniform(0.1, 0.45, 2)) for i in range(5) for j in range(4)]
    cuts = [ellipse(1.0 + i, 4.0 + 7.0 * j, rt, 7.0 * rv) for i, j, rt, rv in sizes]
    holes = sum(np.pi * rt * 7.0 * rv for _, _, rt, rv in sizes)
    borders = np.linspace(0.0, 2.0 * np.pi, count + 1)
    # chords of 400 steps miss 4e-5 of an ellipse
    assert left(cuts, chain, borders) == pytest.approx(WHOLE - holes, abs=1e-4 * holes)


def test_neighbouring_cells_share_their_places_to_the_bit():
    chain = pipe()
    cuts = [ellipse(3.0, 15.0, 1.1, 9.0), polygon((1.0, 3.0), (1.5, 9.0), (0.2, 7.0))]
    found = cells(cuts, chain, 0, np.linspace(0.0, 2.0 * np.pi, 12))
    spots = {2: [], 0: []}
    for k, cell in enumerate(found):
        for item in (x for loop in cell.loops for x in loop if isinstance(x, Stretch)):
            for spot in (item.first, item.last):
                if spot is not None:
                    spots[spot.side].append((k + spot.side // 2, spot.at, spot.key))
    assert len(spots[0]) > 8
    assert sorted(spots[0]) == sorted(spots[2])


def test_a_contour_that_touches_a_ruling_stays_on_its_side():
    chain = pipe()
    borders = np.array([0.0, 2.0, 4.0, 2.0 * np.pi])
    before, between, after = cells([ellipse(3.0, 15.0, 1.0, 5.0)], chain, 0, borders)
    assert len(between.holes) == 1
    assert [len(before.loops[0]), len(between.loops[0]), len(after.loops[0])] == [4, 4, 4]


@pytest.mark.parametrize("touch", [(2.0, 2.5), (3.5, 4.0)])
def test_a_corner_on_a_ruling_is_a_touch_too(touch):
    chain = pipe()
    borders = np.array([0.0, 2.0, 4.0, 2.0 * np.pi])
    a, b = touch
    diamond = polygon((b, 10.0), (0.5 * (a + b), 15.0), (a, 10.0), (0.5 * (a + b), 5.0))
    found = cells([diamond], chain, 0, borders)
    assert [len(cell.holes) for cell in found] == [0, 1, 0]


@pytest.mark.parametrize("side", [(2.0, 3.0), (1.0, 2.0)])
def test_a_side_along_a_ruling_leaves_the_right_area(side):
    chain = pipe()
    borders = np.array([0.0, 2.0, 4.0, 2.0 * np.pi])
    a, b = side
    cut = polygon((b, 5.0), (b, 15.0), (a, 15.0), (a, 5.0))
    assert left([cut], chain, borders) == pytest.approx(WHOLE - (b - a) * 10.0, rel=1e-12)


def test_a_corner_of_a_contour_on_a_ruling_that_it_crosses():
    chain = pipe()
    borders = np.array([0.0, 2.0, 4.0, 2.0 * np.pi])
    cut = polygon((2.0, 5.0), (3.0, 10.0), (2.0, 15.0), (1.0, 10.0))
    before, between, _ = cells([cut], chain, 0, borders)
    assert len(before.loops[0]) == len(between.loops[0]) == 6
    assert left([cut], chain, borders) == pytest.approx(WHOLE - 10.0, rel=1e-12)


def test_a_hole_over_the_seam_of_a_tube_opens_both_ends_of_its_pattern():
    chain = pipe()
    early = track(lambda u: (np.sin(u), 15.0 - 5.0 * np.cos(u)), 0.0, np.pi)
    late = track(lambda u: (2.0 * np.pi - np.sin(u), 15.0 + 5.0 * np.cos(u)), 0.0, np.pi)
    cut = Cut("round", (early, late), True)
    (loop,) = whole([cut], chain).loops
    assert [item.side for item in loop if isinstance(item, Stretch)].count(0) == 2
    assert area(loop, [cut], (0.0, 2.0 * np.pi)) == pytest.approx(WHOLE - 5.0 * np.pi, abs=1e-3)
    assert left([cut], chain, np.array([0.0, 2.0, 2.0 * np.pi])) == pytest.approx(
        WHOLE - 5.0 * np.pi, abs=1e-3
    )


def test_a_notch_takes_a_piece_of_a_rail_and_of_two_cells():
    chain = pipe()
    cut = polygon((1.0, 30.0), (1.0, 20.0), (3.0, 20.0), (3.0, 30.0), closed=False)
    borders = np.array([0.0, 2.0, 2.0 * np.pi])
    assert left([cut], chain, borders) == pytest.approx(WHOLE - 20.0, rel=1e-12)


def test_a_notch_that_takes_the_end_of_the_sheet_leaves_no_cells_there():
    chain = link((frustum(10.0, 10.0, HEIGHT, 2.0),), base_closed=False, tolerance=0.05)
    cut = polygon((1.5, 30.0), (1.5, 0.0), closed=False)
    found = cells([cut], chain, 0, np.array([0.0, 1.0, 1.7, 2.0]))
    assert [len(cell.loops) for cell in found] == [1, 1, 0]
    away = polygon((0.5, 0.0), (0.5, 30.0), closed=False)
    found = cells([away], chain, 0, np.array([0.0, 0.3, 1.0, 2.0]))
    assert [len(cell.loops) for cell in found] == [0, 1, 1]


def test_a_slot_across_a_narrow_cell_parts_it():
    chain = pipe()
    cut = polygon((3.0, 5.0), (3.0, 20.0), (1.0, 20.0), (1.0, 5.0))
    found = cells([cut], chain, 0, np.array([0.0, 1.5, 2.5, 2.0 * np.pi]))
    assert [len(cell.loops) for cell in found] == [1, 2, 1]


def test_a_hole_over_a_crease_lies_on_both_walls():
    corners = np.array([[0, 0], [40, 0], [40, 30], [0, 30]], dtype=float)
    chain = link(prism(corners, HEIGHT), base_closed=True, tolerance=0.05)
    left_wall = (
        track(lambda u: (1.0 - 0.2 * u, 15.0 + 0.0 * u), 0.0, 1.0, 0),
        track(lambda u: (0.8 + 0.0 * u, 15.0 - 10.0 * u), 0.0, 1.0, 0),
        track(lambda u: (0.8 + 0.2 * u, 5.0 + 0.0 * u), 0.0, 1.0, 0),
    )
    right_wall = (
        track(lambda u: (0.3 * u, 5.0 + 0.0 * u), 0.0, 1.0, 1),
        track(lambda u: (0.3 + 0.0 * u, 5.0 + 10.0 * u), 0.0, 1.0, 1),
        track(lambda u: (0.3 - 0.3 * u, 15.0 + 0.0 * u), 0.0, 1.0, 1),
    )
    both = Cut("window", (*left_wall, *right_wall), True)
    (first,) = cells([both], chain, 0, np.array([0.0, 1.0]))
    (second,) = cells([both], chain, 1, np.array([0.0, 1.0]))
    assert area(first.loops[0], [both], (0.0, 1.0)) == pytest.approx(HEIGHT - 2.0, rel=1e-12)
    assert area(second.loops[0], [both], (0.0, 1.0)) == pytest.approx(HEIGHT - 3.0, rel=1e-12)
    assert len(whole([both], chain).holes) == 1
