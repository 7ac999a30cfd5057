"""Allowances against Steiner's formula, polygons by hand, mirror images and shapely."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import GeometryError
from devcad.flatten import shapes
from devcad.flatten.green import bounds, enclosed_area, perimeter
from devcad.flatten.pattern import Edge, Pattern, sample
from devcad.flatten.rings import backwards
from devcad.shop.allowance import allowed
from devcad.shop.polygons import fine_polygon
from devcad.shop.settings import EdgeFinish

NAMES = ("start", "top", "end", "base")
QUAD = [(0.0, 0.0), (100.0, 0.0), (130.0, 60.0), (20.0, 80.0)]
"""Corners of 76, 117, 107 and 60 degrees."""


def pattern(*edges: Edge, holes: tuple[tuple[Edge, ...], ...] = ()) -> Pattern:
    area = enclosed_area(edges) + sum(enclosed_area(hole) for hole in holes)
    return Pattern(edges, (), area, bounds(edges), holes)


def named(points: Sequence[Sequence[float]], names: Sequence[str] = NAMES) -> Pattern:
    """The polygon through the points, counterclockwise, its sides named in turn."""
    corners = np.array(points, dtype=float)
    sides = zip(corners, np.roll(corners, -1, axis=0), names, strict=True)
    return pattern(*(shapes.line(a, b, name) for a, b, name in sides))


def sector(inner: float, outer: float, sweep: float) -> Pattern:
    """A frustum's pattern: a piece of an annulus that begins on +x."""
    out = np.array([np.cos(sweep), np.sin(sweep)])
    zero, x = np.zeros(2), np.array([1.0, 0.0])
    top = shapes.arc(zero, outer, (0.0, sweep), "top")
    start = shapes.line(inner * x, outer * x, "start")
    end = shapes.line(outer * out, inner * out, "end")
    if inner == 0.0:
        return pattern(start, top, end, shapes.line(zero, zero, "base"))
    return pattern(start, top, end, shapes.arc(zero, inner, (sweep, 0.0), "base"))


def polygon(edges: tuple[Edge, ...]) -> shapely.Polygon:
    """The contour to 1e-4 mm."""
    return shapely.Polygon(fine_polygon(edges, 1e-4)[0])


def everywhere(
    distance: float, finish: str = "raw", corner: str = "mitre"
) -> dict[str, EdgeFinish]:
    return {name: EdgeFinish(distance, finish, corner) for name in NAMES}  # type: ignore[arg-type]


def corners(edges: tuple[Edge, ...]) -> list[tuple[float, float]]:
    """Where the edges begin, rounded and in order, the lowest of the leftmost first."""
    points = [tuple((edge.curve(edge.u[:1])[0][0] + 0.0).round(9).tolist()) for edge in edges]
    first = points.index(min(points))
    return [*points[first:], *points[:first]]


def assert_corners(made: Pattern, wanted: Sequence[tuple[float, float]]) -> None:
    found = corners(made.outline)  # to 1e-9 mm
    assert shapely.Polygon(found).symmetric_difference(shapely.Polygon(wanted)).area < 1e-6
    lines = [fine_polygon((edge,), 1e-6)[1] for edge in made.outline]
    assert max(lines) == 0.0


# --- allowances ----------------------------------------------------------------------------


def test_nothing_asked_leaves_the_pattern_itself() -> None:
    quad = named(QUAD)
    assert allowed(quad, {}).pattern is quad
    assert allowed(quad, everywhere(0.0)).pattern is quad


@pytest.mark.parametrize("shape", [named(QUAD), sector(0.0, 90.0, 1.2)])
def test_rounded_corners_follow_steiner(shape: Pattern) -> None:
    made = allowed(shape, everywhere(7.0, corner="round")).pattern
    length = perimeter(shape.outline)
    assert made.area == pytest.approx(shape.area + 7.0 * length + 49.0 * np.pi, rel=1e-13)
    assert perimeter(made.outline) == pytest.approx(length + 14.0 * np.pi, rel=1e-13)


def test_an_annulus_sector_grows_by_concentric_arcs_and_two_rectangles() -> None:
    finishes = {
        "start": EdgeFinish(10.0),
        "end": EdgeFinish(10.0),
        "base": EdgeFinish(4.0),
        "top": EdgeFinish(6.0, "lap"),
    }
    made = allowed(sector(80.0, 200.0, 1.3), finishes)  # type: ignore[arg-type]
    arcs = 0.5 * 1.3 * (206.0**2 - 76.0**2)
    assert made.pattern.area == pytest.approx(arcs + 2.0 * 10.0 * (206.0 - 76.0), rel=1e-13)
    radii = {"top": 206.0, "base": 76.0}
    for edge in made.pattern.outline:
        if edge.name in radii:
            points = edge.curve(np.linspace(edge.u[0], edge.u[-1], 21))[0]
            np.testing.assert_allclose(np.hypot(*points.T), radii[edge.name], rtol=1e-13)
    assert [edge.name for edge in made.pattern.drawings] == ["SEW", "MARK", "SEW", "SEW"]
    assert {flap.name: flap.distance for flap in made.flaps} == {
        name: each.allowance for name, each in finishes.items()
    }


def test_drawings_are_the_edges_that_moved_and_holes_stay() -> None:
    hole = backwards(shapes.circle(10.0))
    body = named([(-50, -40), (50, -40), (50, 40), (-50, 40)]).outline
    sheet = pattern(*body, holes=(hole,))
    made = allowed(sheet, {"start": EdgeFinish(12.0)}).pattern
    assert made.holes == sheet.holes
    assert made.area == pytest.approx(sheet.area + 1200.0, rel=1e-14)
    assert made.bbox == pytest.approx((-50.0, -52.0, 50.0, 40.0), abs=1e-12)
    (seam,) = made.drawings
    assert seam.name == "SEW"
    np.testing.assert_array_equal(seam.curve(seam.u)[0], [[-50, -40], [50, -40]])


# --- corners, by hand ----------------------------------------------------------------------

ROOF = [(0.0, 0.0), (120.0, 0.0), (80.0, 40.0), (40.0, 40.0)]
"""A trapezium: 45 degrees below, 135 above."""
S2 = float(np.sqrt(2.0))


def test_beside_a_bare_edge_an_end_follows_that_edge() -> None:
    made = allowed(named(ROOF), {"start": EdgeFinish(10.0), "end": EdgeFinish(10.0)}).pattern
    assert_corners(made, [(-10, -10), (130, -10), (70, 50), (50, 50)])


def test_a_square_end_stands_on_the_neighbours_cut() -> None:
    """Below the tips of 45 degrees are cut off, above the ends stand out."""
    square = EdgeFinish(10.0, corner="square")
    made = allowed(named(ROOF), {"start": square}).pattern
    assert_corners(made, [(0, 0), (0, -10), (120, -10), (120, 0), (80, 40), (40, 40)])
    others = {"top": EdgeFinish(6.0), "base": EdgeFinish(6.0), "end": square}
    made = allowed(named(ROOF), others).pattern  # type: ignore[arg-type]
    out = 6.0 * S2
    foot = [(40.0 - out, 40.0), (80.0 + out, 40.0)]
    assert_corners(
        made,
        [(-out, 0.0), foot[0], (foot[0][0], 50.0), (foot[1][0], 50.0), foot[1], (120.0 + out, 0.0)],
    )


def test_of_two_square_corners_the_ruling_has_it() -> None:
    square = everywhere(10.0, corner="square")
    only = {**everywhere(10.0), "start": square["start"], "end": square["end"]}
    made, other = (allowed(named(ROOF), each).pattern for each in (square, only))  # type: ignore[arg-type]
    assert corners(made.outline) == corners(other.outline)


def test_of_different_corners_square_goes_before_round_and_round_before_mitre() -> None:
    box = named([(0, 0), (50, 0), (50, 30), (0, 30)])
    asked = {**everywhere(5.0), "top": EdgeFinish(5.0, corner="round")}
    made = allowed(box, asked).pattern  # type: ignore[arg-type]
    assert made.area == pytest.approx(60.0 * 40.0 - 2.0 * 25.0 * (1.0 - np.pi / 4.0), rel=1e-13)
    asked["end"] = EdgeFinish(5.0, corner="square")  # one of the two round corners
    made = allowed(box, asked).pattern  # type: ignore[arg-type]
    assert made.area == pytest.approx(60.0 * 40.0 - 25.0 * (1.0 - np.pi / 4.0), rel=1e-13)


def test_a_needle_is_cut_off_four_allowances_from_its_tip() -> None:
    needle = named([(0, 1), (0, -1), (100, 0)], ("base", "start", "top"))
    made = allowed(needle, everywhere(2.0)).pattern  # type: ignore[arg-type]
    assert made.bbox[2] == pytest.approx(108.0, rel=1e-13)


HOLLOW = [(0, 0), (80, 0), (80, 60), (50, 60), (50, 30), (30, 30), (30, 60), (0, 60)]
HOLLOW_NAMES = ("base", "end", "end", "end", "top", "start", "start", "start")


def test_in_a_hollow_cuts_end_where_they_cross_and_bare_edges_are_spared() -> None:
    shape = named(HOLLOW, HOLLOW_NAMES)
    made = allowed(shape, everywhere(4.0)).pattern  # type: ignore[arg-type]
    other = polygon(shape.outline).buffer(4.0, join_style="mitre")
    assert made.area == pytest.approx(other.area, rel=1e-12)
    made = allowed(shape, {"top": EdgeFinish(4.0)}).pattern
    assert made.area == pytest.approx(shape.area + 20.0 * 4.0 - 16.0, rel=1e-13)  # 45 degrees


def test_the_sides_of_a_notch_go_on_straight_through_the_allowance() -> None:
    names = ("base", "end", "top", "cutout", "cutout", "cutout", "top", "start")
    points = [(0, 0), (80, 0), (80, 60), (50, 60), (45, 30), (30, 30), (30, 60), (0, 60)]
    shape = named(points, names)
    made = allowed(shape, {"top": EdgeFinish(6.0, corner="round")}).pattern
    mouth = 20.0 + 0.5 * 6.0 / 6.0  # one of its sides leans by 1 in 6
    assert made.area == pytest.approx(shape.area + 6.0 * (80.0 - mouth), rel=1e-13)


# --- turned edges --------------------------------------------------------------------------


def mirrored(shape: shapely.Polygon, edge: Edge) -> shapely.Polygon:
    """The mirror image about a straight edge."""
    a, b = edge.curve(edge.u[[0, -1]])[0]
    along = (b - a) / np.hypot(*(b - a))
    matrix = 2.0 * np.outer(along, along) - np.eye(2)
    return shapely.transform(shape, lambda p: a + (p - a) @ matrix)


@pytest.mark.parametrize("k", range(4))
def test_a_turned_flap_is_the_mirror_image_of_the_strip_that_it_covers(k: int) -> None:
    """Beside bare edges, and beside edges with an allowance the same with their strips."""
    shape, name = named(QUAD), NAMES[k]
    turned = {name: EdgeFinish(12.0, "turned")}
    for finishes in ({}, {n: e for n, e in everywhere(5.0).items() if n != name}):
        before = polygon(allowed(shape, {**finishes, name: EdgeFinish(1e-6)}).pattern.outline)  # type: ignore[arg-type,dict-item]
        made = polygon(allowed(shape, {**finishes, **turned}).pattern.outline)  # type: ignore[arg-type]
        flap = made.difference(before)
        folded = mirrored(flap, shape.outline[k])
        strip = before.intersection(
            shapely.LineString(sample(shape.outline[k], 1)).buffer(
                12.0, cap_style="square", join_style="mitre"
            )
        )
        assert folded.difference(before.buffer(1e-4)).area < 1e-9
        wanted = 12.0 * perimeter(shape.outline[k : k + 1])
        assert folded.area == pytest.approx(wanted, rel=0.2)
        assert strip.difference(folded.buffer(1e-4)).area < 1e-2 * wanted


@pytest.mark.parametrize("corner", ["mitre", "square"])
def test_two_turned_flaps_meet_on_the_bisector_or_overlap(corner: str) -> None:
    shape = named([(0, 0), (100, 0), (100, 60), (0, 60)])
    made = polygon(allowed(shape, everywhere(10.0, "turned", corner)).pattern.outline)  # type: ignore[arg-type]
    sheet = polygon(shape.outline)
    gone = 100.0 if corner == "mitre" else 0.0
    flaps = made.area - sheet.area
    assert flaps == pytest.approx(2.0 * (100.0 + 60.0) * 10.0 - 4.0 * gone, rel=1e-12)
    pieces = [piece for piece in made.difference(sheet).geoms if piece.area > 1e-6]
    folded = [mirrored(piece, min(shape.outline, key=lambda e: _far(e, piece))) for piece in pieces]
    assert len(folded) == 4
    assert all(piece.difference(sheet.buffer(1e-6)).area < 1e-9 for piece in folded)
    twice = sum(a.intersection(b).area for a, b in itertools.combinations(folded, 2))
    assert twice == pytest.approx(0.0 if corner == "mitre" else 400.0, abs=1e-9)


def _far(edge: Edge, piece: shapely.Polygon) -> float:
    return float(shapely.LineString(sample(edge, 1)).distance(piece.centroid))


def test_the_flap_of_an_arc_ends_along_the_mirrored_rulings() -> None:
    """A ring's rulings stand square to its rims: the flap is a piece of the next ring."""
    made = allowed(sector(80.0, 200.0, 1.3), {"top": EdgeFinish(12.0, "turned")}).pattern
    assert made.area == pytest.approx(0.5 * 1.3 * (212.0**2 - 80.0**2), rel=1e-13)


def test_a_flap_beside_a_curved_edge_ends_along_its_mirror_image() -> None:
    half = pattern(
        shapes.line(np.array([-40.0, 0.0]), np.array([40.0, 0.0]), "start"),
        shapes.arc(np.zeros(2), 40.0, (0.0, np.pi), "top"),
    )
    made = allowed(half, {"start": EdgeFinish(15.0, "turned")}).pattern
    strip = 40.0**2 * np.arcsin(15.0 / 40.0) + 15.0 * np.sqrt(40.0**2 - 15.0**2)
    assert made.area == pytest.approx(half.area + strip, rel=1e-12)


# --- tips, moves, refusals -----------------------------------------------------------------


@pytest.mark.parametrize("sweep", [0.4, 3.0, 5.0])
def test_a_cone_with_its_apex_has_no_base_and_meets_itself_at_the_tip(sweep: float) -> None:
    shape = sector(0.0, 200.0, sweep)
    made = allowed(shape, everywhere(5.0, corner="mitre")).pattern  # type: ignore[arg-type]
    other = polygon(shape.outline).buffer(5.0, quad_segs=512, join_style="mitre", mitre_limit=4.0)
    # the rim's arc ends in straight pieces here, in a mitre there: at 90 degrees the same
    assert made.area == pytest.approx(other.area, rel=1e-6)


@pytest.mark.slow
@given(
    seed=st.integers(0, 10**6),
    turn=st.floats(-3.0, 3.0),
    scale=st.sampled_from([1e-3, 0.7, 1e4]),
    mirror=st.booleans(),
)
@settings(max_examples=30, deadline=None)
def test_allowances_move_turn_scale_and_mirror_with_their_pattern(
    seed: int, turn: float, scale: float, mirror: bool
) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(4, 9))
    angles = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
    points = rng.uniform(50.0, 90.0, count)[:, None] * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    names = [NAMES[4 * k // count] for k in range(count)]
    asked = {
        name: (
            float(rng.uniform(1.0, 6.0)),
            str(rng.choice(["raw", "turned", "lap", "tab"])),
            str(rng.choice(["mitre", "square", "round"])),
        )
        for name in NAMES
        if rng.random() < 0.8
    }
    first = allowed(named(points, names), {n: EdgeFinish(*each) for n, each in asked.items()})  # type: ignore[arg-type,misc]
    matrix = scale * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    moved = points @ matrix + scale * np.array([300.0, -70.0])
    if mirror:
        moved = (moved * [-1.0, 1.0])[::-1]
        names = [*names[-2::-1], names[-1]]
    finishes = {n: EdgeFinish(scale * far, *rest) for n, (far, *rest) in asked.items()}  # type: ignore[arg-type]
    second = allowed(named(moved, names), finishes)  # type: ignore[arg-type]
    assert second.pattern.area == pytest.approx(scale**2 * first.pattern.area, rel=1e-9)
    made = polygon(first.pattern.outline)
    assert made.is_valid
    assert made.buffer(1e-4).contains(shapely.Polygon(points))
    assert made.area == pytest.approx(first.pattern.area, rel=1e-6)


@pytest.mark.parametrize(
    ("shape", "finishes", "edge"),
    [
        (
            sector(80.0, 200.0, 6.2),
            {"start": EdgeFinish(20.0), "end": EdgeFinish(20.0)},
            "(start|end)",
        ),
        (sector(8.0, 200.0, 1.0), {"base": EdgeFinish(9.0)}, "base"),
        (
            named(HOLLOW, HOLLOW_NAMES),
            {"start": EdgeFinish(10.1), "end": EdgeFinish(10.1)},
            "(start|end)",
        ),
        (sector(0.0, 90.0, 2.0 * np.pi), {"start": EdgeFinish(5.0)}, "start"),
    ],
)
def test_allowances_without_room_are_refused(
    shape: Pattern, finishes: dict[str, EdgeFinish], edge: str
) -> None:
    with pytest.raises(GeometryError, match=rf"the allowance of edge {edge}") as caught:
        allowed(shape, finishes)  # type: ignore[arg-type]
    assert caught.value.place == ""
    assert caught.value.remedy
    assert "pattern (" in caught.value.what
    assert caught.value.value is not None
