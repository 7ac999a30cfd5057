"""The grain's arrow, skiving lines and the longer outer layer, measured by shapely and by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely
from patches import cosine_cylinder, frustum, prism

from devcad.flatten.pattern import Edge, Pattern, sample
from devcad.flatten.shapes import arc, line
from devcad.geometry.chain import Chain, link
from devcad.geometry.patch import Patch
from devcad.part import Panel
from devcad.shop.allowance import allowed
from devcad.shop.grain import grained, layer_figures, outer_layer, skived
from devcad.shop.settings import EdgeFinish, EdgeName

TWO_PI = 2.0 * np.pi


def shape(edges: Sequence[Edge]) -> shapely.Polygon:
    return shapely.Polygon(np.concatenate([sample(e, 400)[:-1] for e in edges]))


def plate(width: float, height: float, holes: Sequence[tuple[float, float, float]] = ()) -> Pattern:
    """A rectangle from the origin; its edge "top" is the one at x = width."""
    points = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    names = ("start", "top", "end", "base")
    sides = zip(points, [*points[1:], points[0]], names, strict=True)
    round_holes = tuple((arc(np.array([x, y]), d / 2, (TWO_PI, 0.0)),) for x, y, d in holes)
    area = width * height - sum(np.pi * d**2 / 4 for _, _, d in holes)
    outline = tuple(line(np.array(a), np.array(b), n) for a, b, n in sides)
    return Pattern(outline, (), area, (0.0, 0.0, width, height), round_holes)


def sector(inner: float, outer: float, sweep: float) -> Pattern:
    end = np.array([np.cos(sweep), np.sin(sweep)])
    outline = (
        line(np.array([inner, 0.0]), np.array([outer, 0.0]), "start"),
        arc(np.zeros(2), outer, (0.0, sweep), "top"),
        line(outer * end, inner * end, "end"),
        arc(np.zeros(2), inner, (sweep, 0.0), "base"),
    )
    whole = shape(outline)
    return Pattern(outline, (), 0.5 * sweep * (outer**2 - inner**2), whole.bounds)


def ends(edges: Sequence[Edge]) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """The ends of straight lines, rounded."""
    return [
        tuple(tuple(round(float(x), 9) for x in p) for p in sample(e, 1)[[0, -1]]) for e in edges
    ]


@pytest.mark.parametrize("grain", [0.0, 0.4, np.pi / 2, -2.0])
def test_the_arrow_lies_along_the_grain_inside_and_clear(grain: float) -> None:
    base = plate(300, 120, [(150, 60, 60), (40, 60, 30)])
    written = line(np.array([200.0, 60.0]), np.array([290.0, 60.0]), "LABEL")
    pattern = replace(base, drawings=(written,))
    done, notes = grained(pattern, grain)
    shaft, *heads = done.drawings[1:]
    assert notes == ()
    assert {e.name for e in done.drawings[1:]} == {"GRAIN"}
    (tail, tip) = sample(shaft, 1)
    way = (tip - tail) / np.hypot(*(tip - tail))
    np.testing.assert_allclose(way, [np.cos(grain), np.sin(grain)], atol=1e-12)
    lengths = [np.hypot(*np.subtract(*sample(e, 1))) for e in (shaft, *heads)]
    assert lengths[0] >= 10.0
    assert max(lengths[1:]) < 0.2 * lengths[0]
    drawn = shapely.MultiLineString([sample(e, 1) for e in (shaft, *heads)])
    sheet = shape(base.outline) - shapely.union_all([shape(h) for h in base.holes])
    assert sheet.buffer(-1.0 + 1e-6).contains(drawn)
    assert shapely.distance(drawn, shapely.LineString(sample(written, 1))) >= 1.0 - 1e-6
    # two heads, a tip each: the piece may lie either way round
    touching = [
        p
        for e in heads
        for p in sample(e, 1)
        if min(np.hypot(*(p - q)) for q in (tail, tip)) < 1e-9
    ]
    assert len(touching) == 4


def test_on_a_plain_plate_the_arrow_is_half_as_long_as_the_plate_and_in_its_middle() -> None:
    done, _ = grained(plate(200, 100), 0.0)
    np.testing.assert_allclose(sample(done.drawings[0], 1), [[50, 50], [150, 50]], atol=1e-9)


def test_an_arrow_without_room_is_left_out_and_told() -> None:
    pattern = plate(200, 8.0)
    done, notes = grained(pattern, np.pi / 2)
    assert done is pattern
    assert notes == ("the grain's arrow (90 degrees) has no room",)


TURNED = EdgeFinish(10.0, "turned")


def test_a_turned_edge_is_skived_from_one_thickness_inside_the_fold() -> None:
    net = plate(100, 60)
    made = allowed(net, {"top": TURNED}).pattern
    done, (note,) = skived(made, net.outline, {"top": TURNED}, 1.2)
    new = [e for e in done.drawings if e.name == "MARK"]
    assert sorted(y for a, b in ends(new) for _, y in (a, b))[:: len(new) * 2 - 1] == [0.0, 60.0]
    assert {x for a, b in ends(new) for x, _ in (a, b)} == {98.8}
    assert sum(np.hypot(*np.subtract(*sample(e, 1))) for e in new) == pytest.approx(60.0)
    assert "skive" in note


def test_skiving_lines_reach_the_cut_edges_of_turned_neighbours() -> None:
    net = plate(100, 60)
    finishes = {"top": TURNED, "end": TURNED}
    made = allowed(net, finishes).pattern
    done, _ = skived(made, net.outline, finishes, 2.0)
    drawn = shapely.MultiLineString([sample(e, 1) for e in done.drawings if e.name == "MARK"])
    along = [p for e in done.drawings for p in sample(e, 1) if abs(p[0] - 98.0) < 1e-9]
    # the flaps meet on the corner's bisector, mirrored: there x + y = 160 is cut
    assert (min(p[1] for p in along), max(p[1] for p in along)) == pytest.approx((0.0, 62.0))
    assert shape(made.outline).buffer(1e-6).contains(drawn)


def test_a_skiving_line_is_parallel_to_a_curved_fold_and_ends_at_holes() -> None:
    net = sector(130.0, 260.0, 1.5)
    middle = 259.0 * np.array([np.cos(0.75), np.sin(0.75)])
    pierced = (arc(middle, 2.0, (TWO_PI, 0.0), "stitch"),)
    made = replace(allowed(net, {"top": TURNED}).pattern, holes=(pierced,))
    done, _ = skived(made, net.outline, {"top": TURNED}, 1.5)
    arcs = [sample(e, 64) for e in done.drawings if e.name == "MARK"]
    curved = [p for p in arcs if np.abs(np.hypot(*p.T) - 258.5).max() < 1e-9]
    assert len(curved) == 2
    away = min(float(np.hypot(*(p - middle).T).min()) for p in curved)
    assert away == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("thickness", [0.0, 1.5])
def test_nothing_is_skived_but_turned_edges_of_a_thick_sheet(thickness: float) -> None:
    net = plate(100, 60)
    finishes = {"top": EdgeFinish(8.0, "lap") if thickness else TURNED}
    assert skived(net, net.outline, finishes, thickness) == (net, ())


def chain(*patches: Patch) -> Chain:
    return link(patches, base_closed=False, tolerance=1e-9)


def test_the_outer_layer_is_longer_by_its_turning_times_the_thickness() -> None:
    """A cylinder and a cone: the circles of their parallel surfaces."""
    cylinder = frustum(50.0, 50.0, 80.0, 1.5 * np.pi)
    assert outer_layer(chain(cylinder), 2.0) == pytest.approx(3.0 * np.pi, rel=1e-12)
    lean = 120.0 / np.hypot(120.0, 50.0)  # of the cone's normal outwards
    longer = TWO_PI * ((100.0 + 1.5 * lean) - 100.0)
    assert outer_layer(chain(frustum(100.0, 50.0, 120.0)), 1.5) == pytest.approx(longer, rel=1e-12)


def test_corners_and_bends_both_ways_count_in_the_outer_layer() -> None:
    """Four corners of a square; and z = 4 x^3 - 3 x from crest to foot: its slope's angles."""
    square = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])
    assert outer_layer(chain(*prism(square, 30.0)), 1.0) == pytest.approx(TWO_PI, rel=1e-9)
    wave = cosine_cylinder((1, 2, 3), (0.1, np.pi - 0.1))
    steepest = np.arctan(12.0 * np.cos(0.1) ** 2 - 3.0)
    turning = 2.0 * (steepest + np.arctan(3.0))
    # the absolute value has a kink, where the quadrature is of second order
    assert outer_layer(chain(wave), 1.0) == pytest.approx(turning, rel=1e-4)


@pytest.mark.parametrize(
    ("finishes", "thickness", "told"),
    [
        ({"top": EdgeFinish(7.0, "lap")}, 2.0, 2.0),
        ({"base": TURNED, "end": EdgeFinish(5.0)}, 1.2, 1.2),
        ({"start": EdgeFinish(7.0, "lap")}, 2.0, None),  # a ruling is straight
        ({"top": EdgeFinish(10.0)}, 2.0, None),
        ({"top": TURNED}, 0.0, None),
    ],
)
def test_the_report_tells_the_outer_layer_of_bent_laps_and_turned_rims(
    finishes: dict[EdgeName, EdgeFinish], thickness: float, told: float | None
) -> None:
    """A half cylinder turns by pi."""
    middle = chain(frustum(50.0, 50.0, 80.0, np.pi))
    flat = plate(1.0, 1.0)
    panel = Panel("p", "cylinder", middle, (), thickness, (), None, flat)  # type: ignore[arg-type]
    wanted = {} if told is None else {"outer_layer": pytest.approx(np.pi * told, rel=1e-12)}
    assert layer_figures(panel, finishes) == wanted
