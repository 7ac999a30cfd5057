"""Cutouts, drills and marks on the surface: areas in the pattern, closed forms in space."""

import time
from dataclasses import replace

import numpy as np
import pytest
from laying import (
    area,
    circle,
    cuts,
    drawings,
    duct,
    gaps,
    hole,
    on_surface,
    polygon,
    rectangle,
    segment,
    slot,
    slot_area,
    space_points,
    tube,
    unrolled,
)
from patches import ellipse_cylinder, frustum, helix_tangent

import devcad
from devcad.errors import GeometryError
from devcad.features import Cutout, Drill, Features, Mark, Placing
from devcad.flatten.development import develop_chain
from devcad.flatten.laying import laid
from devcad.geometry.chain import Chain, cut_at, link
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

EXACT = 1e-12
"""Relative error of a hole's area: some roundings of its coordinates, themselves some hundred
times larger than the hole."""


def half_pipe(radius: float = 50.0, height: float = 100.0) -> Chain:
    """Half a cylinder: the pattern is the rectangle from (0, 0) to (height, pi radius)."""
    return link((frustum(radius, radius, height, np.pi),), base_closed=False, tolerance=1e-3)


def sample(name: str) -> Chain:
    return devcad.build(f"samples/{name}.toml").panels[0].chain


SHEETS = {
    "half pipe": half_pipe,
    "pipe": lambda: tube(frustum(50.0, 50.0, 100.0)),
    "frustum": lambda: tube(frustum()),
    "full cone": lambda: tube(frustum(100.0, 0.0, 120.0)),
    "ellipse cylinder": lambda: tube(ellipse_cylinder(60.0, 40.0, 100.0)),
    "tangent surface": lambda: tube(helix_tangent(50.0, 30.0, 200.0, (5.0, 60.0))),
    "duct": duct,
}
SHAPES = {
    "circle": (circle(6.0), np.pi * 36.0),
    "slot": (slot(16.0, 7.0), slot_area(16.0, 7.0)),
    "rectangle": (rectangle(13.0, 8.0), 104.0),
    "triangle": (polygon([(-5.0, -4.0), (7.0, -3.0), (0.0, 6.0)]), 57.5),
    "arrow": (polygon([(0.0, -5.0), (5.0, 5.0), (0.0, 0.0), (-5.0, 5.0)]), 25.0),
}


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_hole_keeps_its_area_wherever_it_is_laid(sheet: str, shape: str) -> None:
    chain = SHEETS[sheet]()
    contour, true = SHAPES[shape]
    for ft in (0.21, 0.5, 0.77):
        (cut,) = cuts(chain, on_surface(contour, ft, 0.6, angle=0.4))
        assert cut.closed
        assert area(cut, chain) == pytest.approx(true, rel=EXACT)
        assert gaps(cut, chain) < 1e-11


@pytest.mark.parametrize(
    "name",
    [
        "oblique-reducer",
        "hopper",
        "strake",
        "auger-flight",
        pytest.param("rounded-square-to-round", marks=pytest.mark.slow),
        pytest.param("square-to-round", marks=pytest.mark.slow),
        pytest.param("rolling-oloid", marks=pytest.mark.slow),
    ],
)
def test_a_hole_keeps_its_area_on_every_kind_of_panel(name: str) -> None:
    """Several patches, breaks, creases, seams: a hole on each joint and some beside it."""
    chain = sample(name)
    widths = np.array([patch.domain[1] - patch.domain[0] for patch in chain.patches])
    joints = np.cumsum(widths)[:-1] / widths.sum()
    breaks = [
        (b - patch.domain[0] + before) / widths.sum()
        for patch, before in zip(chain.patches, np.cumsum(widths) - widths, strict=True)
        for b in patch.breaks
    ]
    t = [np.linspace(*patch.domain, 9) for patch in chain.patches]
    rails = [
        patch.point(u, patch.jet(u, 0).v_to[0]) for patch, u in zip(chain.patches, t, strict=True)
    ]
    reach = float(np.ptp(np.concatenate(rails), axis=0).max())
    radius = 0.01 * reach
    for ft in [*joints, *breaks[:3], 0.13, 0.62, *([0.0, 1.0] if chain.closed else [])]:
        (cut,) = cuts(chain, on_surface(circle(radius), float(ft), 0.55))
        assert area(cut, chain) == pytest.approx(np.pi * radius**2, rel=3.0 * EXACT)
        assert gaps(cut, chain) < 1e-9


def test_the_sheet_is_on_the_left_of_a_hole() -> None:
    """Whichever way round the contour is given."""
    square = rectangle(10.0, 8.0)
    backwards = tuple(replace(edge, u=edge.u[::-1]) for edge in square[::-1])
    for contour in (square, backwards):
        (cut,) = cuts(half_pipe(), hole(contour, 50.0, 80.0))
        assert area(cut, half_pipe()) == pytest.approx(80.0, rel=EXACT)


def test_a_circle_on_a_cylinder_is_a_circle_of_arc_lengths() -> None:
    (cut,) = cuts(half_pipe(), hole(circle(7.0), 40.0, 60.0))
    (track,) = cut.tracks
    assert track.u == (0.0, 2.0 * np.pi)
    t, v, dt, dv = track(np.linspace(*track.u, 200))
    assert np.hypot(v - 40.0, 50.0 * t - 60.0) == pytest.approx(np.full(200, 7.0), abs=1e-12)
    # clockwise: dv, dt turn the other way than v, t
    assert ((v - 40.0) * 50.0 * dt - (50.0 * t - 60.0) * dv < 0.0).all()


def test_the_pattern_of_a_tube_repeats() -> None:
    """A hole over the seam may be placed at either end, and is the same."""
    chain = tube(frustum(50.0, 50.0, 100.0))
    around = 2.0 * np.pi * 50.0
    first, second = (
        cuts(chain, hole(slot(30.0, 8.0), 45.0, y, 0.9))[0] for y in (3.0, around + 3.0)
    )
    for cut in (first, second):
        assert {track.patch for track in cut.tracks} == {0}
        assert area(cut, chain) == pytest.approx(slot_area(30.0, 8.0), rel=EXACT)
        assert gaps(cut, chain) < 1e-11
    assert np.abs(space_points(first, chain) - space_points(second, chain)).max() < 1e-10


def test_a_slot_across_the_cut_of_a_full_cone_is_two_pieces_that_match() -> None:
    chain = tube(frustum(100.0, 0.0, 120.0))
    (cut,) = cuts(chain, on_surface(slot(40.0, 10.0), 0.0, 0.5, angle=0.5 * np.pi))
    seam = [
        track for track in cut.tracks for t in track.series(np.array(track.u))[:, 0]
        if min(t, 2.0 * np.pi - t) < 1e-14
    ]  # fmt: skip
    assert len(seam) == 4  # two ends on either side
    assert gaps(cut, chain) < 1e-12
    assert area(cut, chain) == pytest.approx(slot_area(40.0, 10.0), rel=EXACT)


def test_a_helical_slot_winds_round_a_tube() -> None:
    """Three times round; its neighbours' distance is more than its width."""
    chain = tube(frustum(50.0, 50.0, 400.0))
    around = 2.0 * np.pi * 50.0
    contour = polygon([(-150.0, -1.5 * around), (-144.0, -1.5 * around), (150.0, 1.5 * around),
                       (144.0, 1.5 * around)])  # fmt: skip
    (cut,) = cuts(chain, hole(contour, 200.0, 0.5 * around))
    assert area(cut, chain) == pytest.approx(6.0 * 3.0 * around, rel=EXACT)
    assert len(cut.tracks) >= 6
    assert gaps(cut, chain) < 1e-11


@pytest.mark.parametrize(
    ("contour", "y", "angle", "crosses"),
    [
        (circle(5.0), 100.0, 0.0, True),  # its parameter begins on the joint
        (circle(5.0), 100.0, 0.3, True),
        (circle(5.0), 95.0, 0.0, False),  # touches the joint
        (circle(5.0), 105.0, 0.0, False),
        (circle(5.0), 95.0 + 1e-9, 0.0, False),  # within 1e-10 of the pattern
        (circle(5.0), 95.0 + 1e-5, 0.0, True),
        (slot(40.0, 10.0), 95.0, 0.0, False),  # a side along the joint
        (slot(40.0, 10.0), 105.0, 0.0, False),
        (slot(40.0, 10.0), 100.0, 0.5 * np.pi, True),
        (rectangle(10.0, 10.0), 95.0, 0.0, False),
        (rectangle(10.0, 10.0), 100.0, 0.25 * np.pi, True),  # corners on the joint
        (rectangle(10.0, 10.0), 100.0 - 5.0 * np.sqrt(2.0), 0.25 * np.pi, False),
    ],
)
def test_a_hole_at_a_joint_crosses_it_or_touches_it(
    contour: tuple, y: float, angle: float, crosses: bool
) -> None:
    chain = duct()
    (cut,) = cuts(chain, hole(contour, 50.0, y, angle))
    assert (len({track.patch for track in cut.tracks}) > 1) == crosses
    assert gaps(cut, chain) < 1e-11
    true = {1: 25.0 * np.pi, 4: 100.0}[len(contour)]
    if len(contour) == 4 and contour[1].u[0] < 0.0:
        true = slot_area(40.0, 10.0)
    # what is not told from touching moves the contour by 1e-9 mm
    assert area(cut, chain) == pytest.approx(true, rel=1e-9)


def test_tracks_end_on_the_joint_to_rounding() -> None:
    chain = duct()
    (cut,) = cuts(chain, hole(circle(8.0), 50.0, 103.0))
    for track in cut.tracks:
        ends = track.series(np.array(track.u))[:, 0]
        low, high = chain.patches[track.patch].domain
        assert np.minimum(np.abs(ends - low), np.abs(ends - high)).max() <= 1e-15


def radial_drill(diameter: float, *, through: bool = False) -> Drill:
    """Across a pipe about z, through z = 50, away from the seam at x > 0."""
    return Drill("drill", np.array([0.0, 0.0, 50.0]), np.array([0.0, 3.0, 0.0]), diameter, through)


@pytest.mark.parametrize("radius", [1e-3, 7.0, 30.0, 49.0])
def test_a_drilled_pipe_unrolls_to_the_arc_sine(radius: float) -> None:
    """y = R asin(r sin(th) / R), z = r cos(th)."""
    chain = tube(frustum(50.0, 50.0, 100.0))
    (cut,) = cuts(chain, radial_drill(2.0 * radius))
    points, _, _ = unrolled(cut, chain)
    x, y = points[:, 0] - 50.0, points[:, 1] - 50.0 * 0.5 * np.pi
    miss = 50.0 * np.sin(y / 50.0)
    assert np.hypot(x, miss) == pytest.approx(np.full(len(x), radius), abs=1e-12)


def test_a_drill_goes_through_the_first_wall_or_all() -> None:
    chain = tube(frustum(50.0, 50.0, 100.0))
    (first,) = cuts(chain, radial_drill(8.0))
    assert (space_points(first, chain)[:, 1] > 0.0).all()
    both = cuts(chain, radial_drill(8.0, through=True))
    assert [cut.name for cut in both] == ["drill", "drill-2"]
    sides = [float(np.sign(space_points(cut, chain)[:, 1]).mean()) for cut in both]
    assert sides == [-1.0, 1.0]
    assert area(both[0], chain) == pytest.approx(area(both[1], chain), rel=EXACT)


@pytest.mark.parametrize(
    "name",
    [
        "oblique-reducer",
        "hopper",
        pytest.param("rounded-square-to-round", marks=pytest.mark.slow),
        pytest.param("rolling-oloid", marks=pytest.mark.slow),
        pytest.param("faceted-vase", marks=pytest.mark.slow),
    ],
)
def test_a_drilled_hole_is_as_far_from_the_axis_as_the_drill(name: str) -> None:
    chain = sample(name)
    middles = np.concatenate(
        [
            patch.point(t, 0.5 * (jet.v_from[0] + jet.v_to[0]))
            for patch in chain.patches
            for t in [np.linspace(*patch.domain, 7)]
            for jet in [patch.jet(t, 0)]
        ]
    )
    centre, size = middles.mean(axis=0), float(np.ptp(middles, axis=0).max())
    for at in middles[::5]:
        axis = (at - centre) / np.linalg.norm(at - centre)
        radius = 0.03 * size
        found = cuts(chain, Drill("drill", centre, axis, 2.0 * radius))
        for cut in found:
            away = space_points(cut, chain) - centre
            distance = np.linalg.norm(away - (away @ axis)[:, None] * axis, axis=1)
            assert np.abs(distance - radius).max() < 1e-13 * size
            assert (away @ axis > 0.0).all()
            assert gaps(cut, chain) < 1e-12 * size


def test_a_drill_along_a_folded_edge_cuts_both_faces() -> None:
    """Along the diagonal of a duct, over its edge: two half ellipses, sqrt(2) times as long."""
    chain = duct()
    drill = Drill("drill", np.array([50.0, 50.0, 50.0]), np.array([1.0, 1.0, 0.0]), 20.0)
    (cut,) = cuts(chain, drill)
    assert sorted(track.patch for track in cut.tracks) == [1, 2] or len(cut.tracks) == 2
    assert area(cut, chain) == pytest.approx(np.sqrt(2.0) * np.pi * 100.0, rel=EXACT)


@pytest.mark.parametrize(
    ("point", "axis", "diameter", "words"),
    [
        ((0.0, 0.0, 50.0), (0.0, 0.0, 1.0), 4.0, "does not meet"),
        ((0.0, 0.0, 500.0), (1.0, 0.0, 0.0), 4.0, "does not meet"),
        ((0.0, 90.0, 50.0), (0.0, 1.0, 0.0), 4.0, "from its point on"),
        ((0.0, 48.0, 50.0), (1.0, 0.0, 0.0), 8.0, "grazes"),
        ((0.0, 0.0, 50.0), (1.0, 0.0, 0.0), 110.0, "grazes|leaves the sheet"),
        ((0.0, 0.0, 3.0), (1.0, 0.0, 0.0), 8.0, "base by 1 mm"),
        ((0.0, 0.0, 96.0), (1.0, 0.0, 0.0), 8.0, "touches the sheet's edge top"),
    ],
)
def test_a_drill_that_misses_grazes_or_leaves_is_refused(
    point: tuple, axis: tuple, diameter: float, words: str
) -> None:
    chain = tube(frustum(50.0, 50.0, 100.0))
    drill = Drill("cutout 3", np.array(point), np.array(axis), diameter)
    with pytest.raises(GeometryError, match=words) as caught:
        cuts(chain, drill)
    assert "cutout 3" in str(caught.value)


@pytest.mark.parametrize(
    ("x", "y", "side", "by"),
    [(3.0, 80.0, "base", 2.0), (98.0, 80.0, "top", 3.0), (50.0, 1.0, "start", 4.0),
     (50.0, 50.0 * np.pi - 4.999, "end", 1e-3), (-20.0, 80.0, "base", 25.0)],
)  # fmt: skip
def test_a_hole_over_an_edge_is_refused_with_the_distance(
    x: float, y: float, side: str, by: float
) -> None:
    with pytest.raises(GeometryError, match=r"^cutout-crosses-edge: hole ") as caught:
        cuts(half_pipe(), hole(circle(5.0), x, y))
    assert f"edge {side}" in caught.value.what
    assert caught.value.value == pytest.approx(by, rel=1e-3)
    assert caught.value.code == 3


def test_a_hole_that_touches_an_edge_is_refused_and_one_beside_it_is_not() -> None:
    for x, y in ((5.0, 80.0), (95.0, 80.0), (50.0, 5.0), (50.0, 50.0 * np.pi - 5.0)):
        with pytest.raises(GeometryError, match="touches the sheet's edge"):
            cuts(half_pipe(), hole(circle(5.0), x, y))
    assert len(cuts(half_pipe(), hole(circle(5.0), 5.0 + 1e-6, 80.0))) == 1


def segment_area(radius: float, height: float) -> float:
    """The area of a circle's segment of that height."""
    half = np.arccos(1.0 - height / radius)
    return float(radius**2 * (half - np.sin(half) * np.cos(half)))


def open_area(cut: object, chain: Chain) -> float:
    """The area between an open cut and the straight line from its end to its start."""
    points, slopes, weights = unrolled(cut, chain)  # type: ignore[arg-type]
    places = [cut.tracks[k].series(np.array([cut.tracks[k].u[k]]))[0] for k in (0, -1)]  # type: ignore[attr-defined]
    development = develop_chain(chain)[0]
    start, end = (development.points(p[:1], p[1:])[0] for p in places)
    away, closing = points - start, end - start
    swept = -0.5 * float(weights @ (away[:, 0] * slopes[:, 1] - away[:, 1] * slopes[:, 0]))
    del closing  # the way back is straight through the start: it sweeps nothing
    return swept


@pytest.mark.parametrize(
    ("x", "y", "height"),
    [(0.0, 80.0, 5.0), (2.0, 80.0, 7.0), (-3.0, 80.0, 2.0), (4.999, 80.0, 9.999),
     (50.0, 0.0, 5.0), (100.0, 80.0, 5.0), (50.0, 50.0 * np.pi + 1.0, 4.0)],
)  # fmt: skip
def test_a_notch_is_the_part_of_its_contour_on_the_sheet(x: float, y: float, height: float) -> None:
    chain = half_pipe()
    (cut,) = cuts(chain, hole(circle(5.0), x, y, notch=True))
    assert not cut.closed
    ends = np.array(
        [cut.tracks[0](np.array(cut.tracks[0].u))[k][0] for k in (0, 1)]
        + [cut.tracks[-1](np.array(cut.tracks[-1].u))[k][1] for k in (0, 1)]
    ).reshape(2, 2)  # (t, v) of start and end
    t, v = ends.T
    away = np.abs(np.stack([50.0 * t, 50.0 * (np.pi - t), v, 100.0 - v]))
    assert away.min(axis=0).max() < 1e-12
    assert open_area(cut, chain) == pytest.approx(segment_area(5.0, height), rel=1e-11)


def test_notches_flush_with_an_edge_have_three_sides() -> None:
    for x, y in ((5.0, 80.0), (50.0, 5.0), (95.0, 80.0)):
        (cut,) = cuts(half_pipe(), hole(rectangle(10.0, 10.0), x, y, notch=True))
        assert len(cut.tracks) == 3
        assert not cut.closed


def test_a_notch_in_the_rail_of_a_tube_runs_over_its_seam() -> None:
    chain = tube(frustum())
    (cut,) = cuts(chain, replace(on_surface(circle(5.0), 0.0, 1.0), notch=True))
    assert not cut.closed
    assert gaps(cut, chain) < 1e-11
    assert len(cut.tracks) == 2


def lens(distance: float, radius: float) -> float:
    """The area that two circles of one radius share."""
    half = 0.5 * distance
    return float(
        2.0 * radius**2 * np.arccos(half / radius) - distance * np.sqrt(radius**2 - half**2)
    )


def two(first: tuple, second: tuple, shift: tuple[float, float]) -> list[Cutout]:
    return [
        Cutout("one", first, Placing(at=(50.0, 80.0))),
        Cutout("two", second, Placing(at=(50.0 + shift[0], 80.0 + shift[1])), notch=True),
    ]


def test_the_union_of_two_holes_is_cut_where_one_is_a_notch() -> None:
    chain = half_pipe()
    (cut,) = cuts(chain, *two(circle(5.0), circle(5.0), (6.0, 0.0)))
    assert cut.closed
    assert area(cut, chain) == pytest.approx(50.0 * np.pi - lens(6.0, 5.0), rel=1e-11)
    (cross,) = cuts(chain, *two(rectangle(30.0, 4.0), rectangle(4.0, 30.0), (0.0, 0.0)))
    assert area(cross, chain) == pytest.approx(224.0, rel=1e-11)
    assert len(cross.tracks) == 12
    (inner,) = cuts(chain, *two(circle(9.0), circle(2.0), (3.0, 3.0)))
    assert inner.name == "one"
    assert area(inner, chain) == pytest.approx(81.0 * np.pi, rel=EXACT)
    (outer,) = cuts(chain, *two(circle(2.0), circle(9.0), (3.0, 3.0)))
    assert area(outer, chain) == pytest.approx(81.0 * np.pi, rel=EXACT)


def test_a_union_over_the_seam_of_a_cone() -> None:
    chain = tube(frustum())
    one = on_surface(circle(6.0), 0.0, 0.5)
    other = replace(on_surface(rectangle(30.0, 3.0), 0.0, 0.5, angle=0.5 * np.pi), notch=True)
    (cut,) = cuts(chain, one, other)
    half = np.arcsin(1.5 / 6.0)
    strip = 2.0 * (36.0 * half + 1.5 * 6.0 * np.cos(half))  # of the circle, 3 mm wide
    assert area(cut, chain) == pytest.approx(36.0 * np.pi + 90.0 - strip, rel=1e-11)


@pytest.mark.parametrize("shift", [(6.0, 0.0), (10.0, 0.0), (10.0 - 1e-9, 0.0), (1.0, 1.0)])
def test_cutouts_that_meet_are_refused_with_both_names(shift: tuple[float, float]) -> None:
    pair = [replace(cutout, notch=False) for cutout in two(circle(5.0), circle(5.0), shift)]
    with pytest.raises(GeometryError, match=r"^cutout-crosses-edge: ") as caught:
        cuts(half_pipe(), *pair)
    assert "one" in caught.value.what
    assert "two" in caught.value.what


def test_cutouts_that_nearly_touch_are_two_holes() -> None:
    pair = [replace(c, notch=False) for c in two(circle(5.0), circle(5.0), (10.0 + 1e-6, 0.0))]
    assert len(cuts(half_pipe(), *pair)) == 2


def test_a_hole_in_another_is_refused() -> None:
    pair = [replace(c, notch=False) for c in two(circle(5.0), circle(1.0), (1.0, 1.0))]
    with pytest.raises(GeometryError, match="two lies in one"):
        cuts(half_pipe(), *pair)


BRACKET = polygon(
    [(-20, -20), (20, -20), (20, -15), (-15, -15), (-15, 15), (20, 15), (20, 20), (-20, 20)]
)


@pytest.mark.parametrize(
    "features",
    [
        [hole(rectangle(120.0, 10.0), 50.0, 80.0, notch=True)],  # right across
        two(BRACKET, rectangle(4.0, 50.0), (15.0, 0.0)),  # closes the bracket
    ],
)
def test_what_would_part_the_panel_is_refused(features: list) -> None:
    with pytest.raises(GeometryError, match="would part the panel in two"):
        cuts(half_pipe(), *features)


def test_a_tube_is_cut_open_by_one_notch_and_parted_by_two() -> None:
    chain = tube(frustum(50.0, 50.0, 100.0))
    across = [hole(rectangle(120.0, 10.0), 50.0, y, notch=True) for y in (80.0, 200.0)]
    assert [cut.closed for cut in cuts(chain, across[0])] == [False, False]
    with pytest.raises(GeometryError, match="would part the panel in two"):
        cuts(chain, *across)


@pytest.mark.parametrize(
    ("contour", "words"),
    [
        (polygon([(-5.0, -5.0), (5.0, 5.0), (5.0, -5.0), (-5.0, 5.0)]), "goes round no area"),
        (polygon([(-5.0, -9.0), (5.0, 5.0), (5.0, -5.0), (-5.0, 5.0)]), "crosses itself"),
        (polygon([(-2.0, -200.0), (2.0, -200.0), (2.0, 200.0), (-2.0, 200.0)]), "crosses itself"),
    ],
)
def test_contours_that_cross_themselves_are_refused(contour: tuple, words: str) -> None:
    """In the plane, or only round a pipe of 314 mm circumference."""
    with pytest.raises(GeometryError, match=words):
        cuts(tube(frustum(50.0, 50.0, 100.0)), hole(contour, 50.0, 150.0))


@pytest.mark.parametrize("away", [0.0, 4.0])
def test_a_hole_round_the_tip_of_a_cone_is_refused(away: float) -> None:
    chain = tube(frustum(100.0, 0.0, 120.0))
    slant = float(np.hypot(100.0, 120.0))
    for notch in (False, True):
        with pytest.raises(GeometryError, match="runs round a tip"):
            cuts(chain, hole(circle(5.0), slant - away, 0.0, notch=notch))


def test_marks_are_drawn_on_every_patch_that_they_lie_on() -> None:
    """A line along the pattern over three joints of a duct: its length is kept."""
    chain = duct()
    line = segment(np.array([-10.0, -130.0]), np.array([10.0, 130.0]))
    found = drawings(chain, Mark("mark", (line,), Placing(at=(50.0, 200.0))))
    assert {drawing.layer for drawing in found} == {"MARK"}
    assert [drawing.patch for drawing in found] == [0, 1, 2, 3]
    developments = develop_chain(chain)
    points = []
    for drawing in found:
        t, v, _, _ = drawing.path(np.linspace(*drawing.u, 5))
        points.append(developments[drawing.patch].points(t, v))
    run = np.concatenate(points)
    assert run[0] == pytest.approx([40.0, 70.0], abs=1e-12)
    assert run[-1] == pytest.approx([60.0, 330.0], abs=1e-12)
    length = np.hypot(*np.diff(run, axis=0).T).sum()
    assert length == pytest.approx(np.hypot(20.0, 260.0), rel=1e-14)


def test_a_mark_that_leaves_the_sheet_is_refused_and_one_on_its_edge_is_not() -> None:
    line = segment(np.array([0.0, -10.0]), np.array([0.0, 10.0]))
    with pytest.raises(GeometryError, match=r"^mark-leaves-sheet: mark .* edge start by 3 mm"):
        drawings(half_pipe(), Mark("mark", (line,), Placing(at=(50.0, 7.0))))
    assert len(drawings(half_pipe(), Mark("mark", (line,), Placing(at=(50.0, 10.0))))) == 1


def rigid() -> Array:
    """A rotation about a skew axis with a shift, (4, 4)."""
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    out = np.eye(4)
    out[:3, :3] = q * np.sign(np.linalg.det(q))
    out[:3, 3] = (30.0, -70.0, 210.0)
    return out


def test_moving_and_scaling_a_sheet_moves_and_scales_its_holes() -> None:
    plain = tube(frustum())
    matrix = rigid()
    moved = tube(frustum().transformed(matrix, 0.01))
    drill = Drill("drill", np.array([0.0, 0.0, 50.0]), np.array([0.3, 1.0, 0.2]), 14.0)
    there = replace(
        drill,
        point=0.01 * matrix[:3, :3] @ drill.point + matrix[:3, 3],
        direction=matrix[:3, :3] @ drill.direction,
        diameter=0.14,
    )
    pairs = [
        (on_surface(circle(9.0), 0.0, 0.6), on_surface(circle(0.09), 0.0, 0.6)),
        (drill, there),
    ]
    for one, other in pairs:
        (first,), (second,) = cuts(plain, one), cuts(moved, other)
        assert area(second, moved) == pytest.approx(1e-4 * area(first, plain), rel=1e-11)
        if isinstance(one, Cutout):
            points = 0.01 * space_points(first, plain) @ matrix[:3, :3].T + matrix[:3, 3]
            assert np.abs(points - space_points(second, moved)).max() < 1e-12


def test_where_the_tube_is_cut_open_and_how_it_is_parted_leave_a_hole_as_it_is() -> None:
    """Hole and drill in space, with the seam elsewhere and a joint through the hole."""
    whole = frustum()
    drill = Drill("drill", np.array([0.0, 0.0, 50.0]), np.array([1.0, 0.2, 0.1]), 20.0)
    plain = tube(whole)
    middle = float(np.arctan2(0.2, 1.0))
    parted = link(
        (whole.restricted(0.0, middle), whole.restricted(middle, 2.0 * np.pi)),
        base_closed=True,
        tolerance=1e-3,
    )
    areas = []
    for chain in (plain, parted, cut_at(plain, middle), cut_at(plain, 3.0)):
        (cut,) = cuts(chain, drill)
        areas.append(area(cut, chain))
        assert gaps(cut, chain) < 1e-11
    assert areas == pytest.approx([areas[0]] * 4, rel=EXACT)


def test_a_hole_does_not_depend_on_the_direction_of_the_parameter() -> None:
    """t backwards, with e turned round: the same front, the same hole by its shares."""
    whole = frustum(sweep=2.0)

    def field(t: Array, order: int):  # type: ignore[no-untyped-def]
        jet = whole.field(2.0 - t, order)
        sign = np.where(np.arange(order + 1) % 2, -1.0, 1.0)
        return replace(
            jet,
            c0=sign[:, None, None] * jet.c0,
            e=-sign[:, None, None] * jet.e,
            v_from=-sign[:, None] * jet.v_to,
            v_to=-sign[:, None] * jet.v_from,
        )

    back = Patch(field, (0.0, 2.0))
    chains = [link((patch,), base_closed=False, tolerance=1e-3) for patch in (whole, back)]
    one = cuts(chains[0], on_surface(rectangle(12.0, 5.0), 0.3, 0.4, 0.2))[0]
    other = cuts(chains[1], on_surface(rectangle(12.0, 5.0), 0.7, 0.6, 0.2))[0]
    assert area(one, chains[0]) == pytest.approx(60.0, rel=EXACT)
    assert area(other, chains[1]) == pytest.approx(60.0, rel=EXACT)
    first, second = space_points(one, chains[0], 11), space_points(other, chains[1], 11)
    near = np.linalg.norm(first[:, None] - second, axis=2).min(axis=1)
    assert near.max() < 1e-10


def grid(columns: int, rows: int) -> Features:
    """Round holes side by side on three quarters of the surface."""
    return Features(
        cutouts=tuple(
            Cutout(f"hole {i}", circle(1.0), Placing(at_surface=(ft, fv)))
            for i, (ft, fv) in enumerate(
                (x, y) for x in np.linspace(0.1, 0.85, columns) for y in np.linspace(0.1, 0.9, rows)
            )
        )
    )


def test_four_hundred_holes_keep_their_areas() -> None:
    chain = tube(frustum())
    found, _ = laid(grid(40, 10), chain, develop_chain(chain))
    assert [cut.name for cut in found] == [f"hole {i}" for i in range(400)]
    areas = [area(cut, chain) for cut in found[::20]]
    assert areas == pytest.approx([np.pi] * 20, rel=3e-12)


@pytest.mark.bench
def test_the_time_is_linear_in_the_number_of_holes() -> None:
    chain = tube(frustum())
    developments = develop_chain(chain)
    times = []
    for columns in (20, 80):
        features = grid(columns, 10)
        start = time.process_time()
        laid(features, chain, developments)
        times.append(time.process_time() - start)
    assert times[1] < 6.0 * times[0]  # four times the holes, and one start-up
