"""Patterns with holes and notches, against closed forms and Green's formula in the plane."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from handcuts import (
    TURN,
    Inverse,
    Piece,
    arc,
    circle,
    cut,
    line,
    on_cone,
    on_cylinder,
    on_wall,
    over_seam,
    polygon,
    slot,
    track,
)
from patches import frustum, prism, wall
from scipy.integrate import quad

from devcad.checks import Check, at_most
from devcad.errors import GeometryError
from devcad.facts import panel_facts
from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.development import Development, develop_chain
from devcad.flatten.green import enclosed_area, perimeter
from devcad.flatten.outline import lay_out, sheet_area
from devcad.flatten.pattern import CUTOUT, Edge, Pattern
from devcad.flatten.verify import fold_back, overlap_area
from devcad.geometry.chain import Chain, link
from devcad.geometry.classify import classify
from devcad.geometry.cuts import Cut
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh
from devcad.part import Panel

RADIUS = 30.0
PIPE = frustum(RADIUS, RADIUS, 100.0)
HALF = PIPE.restricted(0.0, 3.0)
ON_PIPE = on_cylinder(RADIUS)
CONE = frustum(100.0, 50.0, 120.0)
ON_CONE = on_cone(100.0, 50.0, 120.0)
PLATE = wall(np.zeros(3), np.array([90.0, 0.0, 0.0]), 100.0)
ON_PLATE = on_wall(90.0)
SHEETS = {"plane": (PLATE, ON_PLATE), "cylinder": (HALF, ON_PIPE), "cone": (CONE, ON_CONE)}
QUAD = [(40.0, 20.0), (45.0, 50.0), (70.0, 45.0), (66.0, 22.0)]
SHAPES: dict[str, tuple[list[Piece], float, float]] = {
    "circle": ([arc((60.0, 35.0), 8.0, 0.3, TURN)], 64.0 * np.pi, 16.0 * np.pi),
    "slot": (slot((55.0, 40.0), 40.0, 10.0, 0.4), 300.0 + 25.0 * np.pi, 60.0 + 10.0 * np.pi),
    "rectangle": (polygon((30.0, 20.0), (30.0, 50.0), (70.0, 50.0), (70.0, 20.0)), 1200.0, 140.0),
    "polygon": (
        polygon(*QUAD),
        682.5,
        sum(float(np.hypot(*np.subtract(QUAD[k], QUAD[k - 1]))) for k in range(4)),
    ),
}


def laid(
    patches: tuple[Patch, ...],
    cuts: tuple[Cut, ...],
    drawings: tuple[Drawing, ...] = (),
    *,
    closed: bool = False,
) -> tuple[Chain, tuple[Development, ...], Pattern]:
    chain = link(patches, base_closed=closed, tolerance=1e-3)
    developments = develop_chain(chain)
    rulings = tuple(np.linspace(*patch.domain, 25) for patch in patches)
    return chain, developments, lay_out(chain, developments, rulings, drawings, cuts)


def whole_area(patch: Patch) -> float:
    return sheet_area(link((patch,), base_closed=False, tolerance=1e-3), ())


def flat_area(pattern: Pattern) -> float:
    return sum(enclosed_area(contour) for contour in (pattern.outline, *pattern.holes))


def gaps(contour: tuple[Edge, ...]) -> float:
    """How far the ends of neighbouring edges are apart."""
    ends = np.array([edge.curve(edge.u[[0, -1]])[0] for edge in contour])
    return float(np.abs(ends[:, 1] - np.roll(ends[:, 0], -1, axis=0)).max())


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("sheet", SHEETS)
def test_a_hole_takes_its_area_and_adds_its_length(sheet, shape):
    patch, inverse = SHEETS[sheet]
    pieces, area, length = SHAPES[shape]
    _, _, pattern = laid((patch,), (cut(inverse, pieces),))
    (hole,) = pattern.holes
    whole = whole_area(patch)
    # 1e-12 of the sheet: rounding of two integrals over it
    assert whole - pattern.area == pytest.approx(area, abs=1e-12 * whole)
    assert flat_area(pattern) == pytest.approx(pattern.area, abs=1e-12 * whole)
    assert enclosed_area(hole) == pytest.approx(-area, rel=1e-11)  # clockwise
    assert perimeter(hole) == pytest.approx(length, rel=1e-12)
    assert {edge.name for edge in hole} == {CUTOUT}
    assert gaps(hole) < 1e-11
    assert gaps(pattern.outline) < 1e-11


def test_a_hole_leaves_the_outline_as_it_is():
    _, _, plain = laid((CONE,), (), closed=True)
    _, _, cut_open = laid((CONE,), (circle(ON_CONE, (60.0, 40.0), 8.0),), closed=True)
    for edge, other in zip(plain.outline, cut_open.outline, strict=True):
        assert edge.name == other.name
        u = np.linspace(edge.u[0], edge.u[-1], 33)
        assert np.array_equal(edge.u, other.u)
        assert np.array_equal(edge.curve(u)[0], other.curve(u)[0])
    assert plain.bbox == cut_open.bbox


@pytest.mark.parametrize(
    ("patch", "inverse"), [(PIPE, ON_PIPE), (CONE, ON_CONE)], ids=["cylinder", "cone"]
)
def test_a_hole_on_the_seam_of_a_tube_becomes_two_notches(patch, inverse):
    hole = cut(inverse, over_seam(55.0, 9.0), period=TURN)
    _, _, pattern = laid((patch,), (hole,), closed=True)
    area = whole_area(patch) - 81.0 * np.pi
    names = ["start", CUTOUT, "start", "top", "end", CUTOUT, "end", "base"]
    assert [edge.name for edge in pattern.outline] == names
    assert pattern.holes == ()
    assert pattern.area == pytest.approx(area, rel=1e-13)
    assert enclosed_area(pattern.outline) == pytest.approx(area, rel=1e-13)
    assert gaps(pattern.outline) < 1e-10
    # half circles over the cut are exact arcs
    loop = fit_outline(pattern.outline, 0.01)
    assert loop.exact
    assert loops.area(loop) == pytest.approx(area, rel=1e-13)
    assert loops.perimeter(loop) == pytest.approx(perimeter(pattern.outline), rel=1e-12)


NOTCHES: dict[str, tuple[list[Piece], float, list[str]]] = {
    "in the top": (
        [
            line((100.0, 20.0), (90.0, 20.0)),
            line((90.0, 20.0), (90.0, 40.0)),
            line((90.0, 40.0), (100.0, 40.0)),
        ],
        200.0,
        ["start", "top", CUTOUT, CUTOUT, CUTOUT, "top", "end", "base"],
    ),
    "off a corner": (
        [line((90.0, 0.0), (90.0, 15.0)), line((90.0, 15.0), (100.0, 15.0))],
        150.0,
        ["start", CUTOUT, CUTOUT, "top", "end", "base"],
    ),
    "round a corner": (
        [arc((100.0, 0.0), 12.0, np.pi, 0.5 * np.pi)],
        36.0 * np.pi,
        ["start", CUTOUT, "top", "end", "base"],
    ),
    "in the base": (
        [arc((0.0, 45.0), 7.0, 0.5 * np.pi, np.pi)],
        24.5 * np.pi,
        ["start", "top", "end", "base", CUTOUT, "base"],
    ),
}


@pytest.mark.parametrize("place", NOTCHES)
def test_a_notch_changes_the_outline(place):
    pieces, area, names = NOTCHES[place]
    _, _, pattern = laid((HALF,), (cut(ON_PIPE, pieces, closed=False),))
    assert [edge.name for edge in pattern.outline] == names
    assert pattern.area == pytest.approx(9000.0 - area, rel=1e-13)
    assert enclosed_area(pattern.outline) == pytest.approx(9000.0 - area, rel=1e-13)
    assert gaps(pattern.outline) < 1e-11
    assert overlap_area(pattern) == 0.0


def test_cutouts_that_part_the_panel_are_refused():
    apart = (
        cut(ON_PIPE, [line((100.0, 40.0), (0.0, 40.0))], closed=False),
        cut(ON_PIPE, [line((0.0, 50.0), (100.0, 50.0))], closed=False),
    )
    with pytest.raises(GeometryError, match="part the panel") as caught:
        laid((HALF,), apart)
    assert caught.value.remedy


def bends() -> tuple[Patch, ...]:
    """Three walls with bends at y = 60 and 100 of the pattern."""
    corners = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [0.0, 40.0]])
    return prism(corners, 50.0)[:3]


def on_bends(number: int) -> Inverse:
    return on_wall((60.0, 40.0, 60.0)[number], (0.0, 60.0, 100.0)[number])


def lines_at(pattern: Pattern, y: float) -> list[tuple[float, float]]:
    return [
        (float(a.start[0]), float(a.end[0])) for a in pattern.lines if abs(a.start[1] - y) < 1e-9
    ]


def test_a_bend_line_through_a_hole_is_two_lines():
    over = Cut(
        "over",
        (
            track(on_bends(1), arc((25.0, 60.0), 8.0, np.pi, np.pi), 1),
            track(on_bends(0), arc((25.0, 60.0), 8.0, 0.0, np.pi), 0),
        ),
        True,
    )
    chain, developments, pattern = laid(bends(), (over,))
    assert lines_at(pattern, 60.0) == [
        pytest.approx((0.0, 17.0), abs=1e-12),
        pytest.approx((33.0, 50.0), abs=1e-12),
    ]
    assert lines_at(pattern, 100.0) == [pytest.approx((0.0, 50.0), abs=1e-12)]
    assert [a.layer for a in pattern.lines] == ["BEND_UP"] * 3
    assert [a.angle for a in pattern.lines] == [pytest.approx(0.5 * np.pi)] * 3
    assert pattern.area == pytest.approx(8000.0 - 64.0 * np.pi, rel=1e-13)
    # over the crease the hole is one circle in the pattern, folded up it lies on the surface
    assert loops.circle(fit_outline(pattern.holes[0], 0.01)) is not None
    assert fold_back(chain, developments, pattern)[0].value < 1e-11


def test_a_bend_line_ends_at_the_hole_beside_it():
    beside = cut(on_bends(1), polygon((10.0, 100.0), (30.0, 100.0), (30.0, 80.0), (10.0, 80.0)))
    beside = replace(beside, tracks=tuple(replace(a, patch=1) for a in beside.tracks))
    touching = replace(circle(on_bends(2), (40.0, 105.0), 5.0))
    touching = replace(touching, tracks=tuple(replace(a, patch=2) for a in touching.tracks))
    _, _, pattern = laid(bends(), (beside, touching))
    # a line that runs along a cut is the cut's; one that a circle only touches goes on
    assert lines_at(pattern, 100.0) == [
        pytest.approx((0.0, 10.0), abs=1e-12),
        pytest.approx((30.0, 50.0), abs=1e-12),
    ]


def test_marks_end_at_holes_and_notches():
    drawings = (
        track(ON_PIPE, line((20.0, 45.0), (90.0, 45.0))).drawn("MARK"),  # over both
        track(ON_PIPE, line((45.0, 40.0), (52.0, 47.0))).drawn("MARK"),  # inside the hole
        track(ON_PIPE, line((10.0, 70.0), (95.0, 71.0))).drawn("MARK"),  # beside it
    )
    cuts = (
        circle(ON_PIPE, (50.0, 45.0), 10.0),
        cut(ON_PIPE, [arc((100.0, 45.0), 15.0, -0.5 * np.pi, np.pi)], closed=False),
    )
    _, _, pattern = laid((HALF,), cuts, drawings)
    ends = [edge.curve(edge.u[[0, -1]])[0][:, 0] for edge in pattern.drawings]
    assert np.array(ends) == pytest.approx(
        np.array([[20.0, 40.0], [60.0, 85.0], [10.0, 95.0]]), abs=1e-11
    )


def test_marks_away_from_every_cut_are_the_same_objects():
    mark = track(ON_PIPE, line((10.0, 70.0), (95.0, 71.0))).drawn("MARK")
    _, _, plain = laid((HALF,), (), (mark,))
    _, _, cut_open = laid((HALF,), (circle(ON_PIPE, (50.0, 45.0), 10.0),), (mark,))
    u = np.linspace(0.0, 1.0, 9)
    (one,), (other,) = plain.drawings, cut_open.drawings
    assert np.array_equal(one.u, other.u)
    assert np.array_equal(one.curve(u)[0], other.curve(u)[0])


@pytest.mark.parametrize("shape", SHAPES)
def test_holes_folded_up_lie_on_the_surface(shape):
    chain, developments, pattern = laid((CONE,), (cut(ON_CONE, SHAPES[shape][0]),))
    worst, size = fold_back(chain, developments, pattern)
    assert worst.value < 1e-14 * 100.0 * size
    (hole,) = pattern.holes
    astray = tuple(
        replace(edge, curve=replace(edge.curve, series=_shifted(edge.curve.series, 1e-3)))
        for edge in hole
    )
    moved, _ = fold_back(chain, developments, replace(pattern, holes=(astray,)))
    assert moved.value == pytest.approx(1e-3, rel=1e-3)  # the tangent plane is isometric


def _shifted(series, x):
    table = series.coefficients.copy()
    table[:, 0, 0] += x
    return replace(series, coefficients=table)


def _placed(hole: tuple[Edge, ...], dx: float) -> tuple[Edge, ...]:
    def curve(edge):
        return lambda u: (edge.curve(u)[0] + [dx, 0.0], edge.curve(u)[1])

    return tuple(replace(edge, curve=curve(edge)) for edge in hole)


@pytest.mark.parametrize(
    ("dx", "doubled"),
    [
        (0.0, 0.0),
        (39.9, 0.0),
        (45.0, 100.0 * np.arccos(0.5) - 5.0 * np.sqrt(75.0)),  # a segment hangs over the edge
        (200.0, 100.0 * np.pi),  # outside
    ],
)
def test_overlap_sees_a_hole_off_the_sheet(dx, doubled):
    _, _, pattern = laid((HALF,), (circle(ON_PIPE, (50.0, 45.0), 10.0),))
    moved = replace(pattern, holes=(_placed(pattern.holes[0], dx),))
    assert overlap_area(moved) == pytest.approx(doubled, rel=1e-3)  # polygons of 128 sides


@pytest.mark.parametrize(
    ("dx", "shared"),
    [
        (15.0, 200.0 * np.arccos(0.75) - 7.5 * np.sqrt(400.0 - 225.0)),
        (20.1, 0.0),
        (0.0, 100.0 * np.pi),
    ],
)
def test_overlap_sees_a_hole_in_a_hole(dx, shared):
    _, _, pattern = laid((HALF,), (circle(ON_PIPE, (50.0, 45.0), 10.0),))
    (hole,) = pattern.holes
    both = replace(pattern, holes=(hole, _placed(hole, dx)))
    assert overlap_area(both) == pytest.approx(shared, rel=1e-3)


def drilled_pipe(y: float, r: float) -> Piece:
    """Where a drill of radius r square to the axis meets the pipe, in its pattern."""
    return (
        lambda u: (50.0 + r * np.cos(u), y - RADIUS * np.arcsin(r * np.sin(u) / RADIUS)),
        0.3,
        0.3 + TURN,
    )


def drilled_pipe_area(r: float) -> float:
    def width(s: Array) -> float:
        return float(2.0 * RADIUS * np.arcsin(np.sqrt(r * r * np.cos(s) ** 2) / RADIUS))

    # x = r sin s makes the ends smooth
    value, _ = quad(lambda s: width(s) * r * np.cos(s), -0.5 * np.pi, 0.5 * np.pi, epsabs=1e-12)
    return float(value)


def drilled_cone(r: float, z: float = 50.0) -> Cut:
    """A drill along x through (0, 0, z) of the cone."""
    slant = np.hypot(120.0, 50.0)

    def places(u: Array) -> tuple[Array, Array]:
        height, y = z + r * np.cos(u), -r * np.sin(u)
        rho = 100.0 - 50.0 * height / 120.0
        return np.arcsin(y / rho), height / 120.0 * slant

    hole = track(lambda t, v: (t, v), (places, 0.0, TURN))
    # the start of the sheet is at t = 0: the drill is turned by a radian
    series = replace(hole.series, coefficients=hole.series.coefficients + _turn(hole.series, 1.0))
    return Cut("drill", (replace(hole, series=series),), True)


def _turn(series, angle):
    out = np.zeros_like(series.coefficients)
    out[:, 0, 0] = angle
    return out


def drilled_cone_area(r: float, z: float = 50.0) -> float:
    """The area element over the disc of the drill, in polar coordinates, by Gauss."""
    x, w = np.polynomial.legendre.leggauss(40)
    s, ws = 0.5 * r * (x + 1.0), 0.5 * r * w
    angle = TURN * np.arange(200) / 200
    height, y = z + np.outer(s, np.cos(angle)), np.outer(s, np.sin(angle))
    rho, slope = 100.0 - 50.0 * height / 120.0, -50.0 / 120.0
    element = rho * np.sqrt(1.0 + slope**2) / np.sqrt(rho**2 - y**2)
    return float((element * (s * ws)[:, None]).sum() * TURN / 200)


@pytest.mark.parametrize("tolerance", [0.05, 0.005, 0.0005])
@pytest.mark.parametrize("surface", ["cylinder", "cone"])
def test_arcs_of_a_drilled_hole_enclose_its_area(surface, tolerance):
    pipe = surface == "cylinder"
    hole = cut(ON_PIPE, [drilled_pipe(45.0, 8.0)]) if pipe else drilled_cone(20.0)
    area = drilled_pipe_area(8.0) if pipe else drilled_cone_area(20.0)
    _, _, pattern = laid((HALF if pipe else CONE,), (hole,))
    assert enclosed_area(pattern.holes[0]) == pytest.approx(-area, rel=1e-12)
    loop = fit_outline(pattern.holes[0], tolerance)
    assert not loop.exact
    assert loop.deviation <= tolerance
    assert loops.area(loop) == pytest.approx(area, rel=1e-11)
    _assert_smooth(loop)


def _assert_smooth(loop: loops.Loop) -> None:
    """Neighbouring arcs share their tangent."""
    half = loops.half_sweeps(loop.bulges)
    chord = np.arctan2(*(loop.ends - loop.points).T[::-1])
    corner = loops.wrap(np.roll(chord - half, -1) - (chord + half))
    assert np.abs(corner).max() < 1e-9


def test_half_a_drilled_hole_in_the_outline_keeps_the_sheets_area():
    plane, low, high = drilled_pipe(0.0, 8.0)
    pieces: list[Piece] = [(plane, -np.pi, 0.0), (plane, 0.0, np.pi)]
    _, _, pattern = laid((PIPE,), (cut(ON_PIPE, pieces, period=TURN),), closed=True)
    loop = fit_outline(pattern.outline, 0.005)
    assert not loop.exact
    area = whole_area(PIPE) - drilled_pipe_area(8.0)
    assert loops.area(loop) == pytest.approx(area, abs=1e-10 * drilled_pipe_area(8.0))
    assert high - low == TURN


def slot_over_joint(over: float) -> tuple[tuple[Patch, ...], Cut]:
    """A slot along y whose round end reaches over the joint t = 1 by ``over`` mm."""
    length, r, joint = 20.0, 4.0, RADIUS
    upper, right, lower, left = slot(
        (50.0, joint + over - 0.5 * length), length, 2.0 * r, np.pi / 2
    )
    half = float(np.arccos((r - over) / r))
    round_end = right[0]
    pieces = [
        (upper, 0),
        ((round_end, 0.0, 0.5 * np.pi - half), 0),
        ((round_end, 0.5 * np.pi - half, 0.5 * np.pi + half), 1),
        ((round_end, 0.5 * np.pi + half, np.pi), 0),
        (lower, 0),
        (left, 0),
    ]
    tracks = tuple(track(ON_PIPE, piece, number) for piece, number in pieces)
    return (PIPE.restricted(0.0, 1.0), PIPE.restricted(1.0, 3.0)), Cut("slot", tracks, True)


@pytest.mark.parametrize("over", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
def test_a_slot_that_just_reaches_over_a_joint_stays_two_lines_and_two_arcs(over):
    patches, hole = slot_over_joint(over)
    _, _, pattern = laid(patches, (hole,))
    loop = fit_outline(pattern.holes[0], 0.005)
    assert loop.exact
    assert len(loop.bulges) == 4
    assert np.sort(np.abs(loop.bulges)) == pytest.approx([0.0, 0.0, 1.0, 1.0], abs=1e-9)
    assert loops.area(loop) == pytest.approx(96.0 + 16.0 * np.pi, rel=1e-11)
    at_joint = lines_at(pattern, RADIUS)
    assert sum(b - a for a, b in at_joint) == pytest.approx(
        100.0 - 2.0 * np.sqrt(over * (8.0 - over)), abs=0.01
    )


@pytest.mark.parametrize("over", [1e-2, 1e-4, 1e-6, 1e-9])
def test_a_hole_that_just_reaches_over_the_seam_leaves_no_segment_too_short(over):
    half = float(np.arccos((8.0 - over) / 8.0))
    turn, _, _ = arc((50.0, over - 8.0), 8.0, 0.5 * np.pi + half, TURN)
    tracks = (
        track(ON_PIPE, (turn, 0.0, 2.0 * half)),
        track(ON_PIPE, (turn, 2.0 * half, TURN), 0, TURN),
    )
    _, _, pattern = laid((PIPE,), (Cut("circle", tracks, True),), closed=True)
    loop = fit_outline(pattern.outline, 0.005)
    assert loops.lengths(loop.points, loop.ends, loop.bulges).min() > loops.SHORTEST
    area = whole_area(PIPE) - 64.0 * np.pi
    assert loops.area(loop) == pytest.approx(area, abs=1e-8 * 64.0 * np.pi)


@pytest.mark.parametrize("scale", [1e-2, 1e2])
def test_holes_of_any_size(scale):
    pipe = frustum(30.0 * scale, 30.0 * scale, 100.0 * scale).restricted(0.0, 3.0)
    inverse = on_cylinder(30.0 * scale)
    _, _, pattern = laid((pipe,), (circle(inverse, (50.0 * scale, 45.0 * scale), 8.0 * scale),))
    assert pattern.area == pytest.approx((9000.0 - 64.0 * np.pi) * scale**2, rel=1e-13)
    found = loops.circle(fit_outline(pattern.holes[0], 0.005))
    assert found is not None
    assert found[1] == pytest.approx(8.0 * scale, rel=1e-12)


def test_a_small_hole_in_a_large_sheet_is_exact():
    pipe = frustum(3000.0, 3000.0, 12000.0).restricted(0.0, 3.0)
    inverse = on_cylinder(3000.0)
    _, _, pattern = laid((pipe,), (circle(inverse, (11000.0, 8000.0), 0.5),))
    found = loops.circle(fit_outline(pattern.holes[0], 0.005))
    assert found is not None
    # the pattern's coordinates carry 1e-12 of 12 m
    assert found[1] == pytest.approx(0.5, rel=1e-10)


def test_the_report_tells_net_numbers():
    pieces, area, length = SHAPES["slot"]
    holes = (cut(ON_PIPE, pieces), circle(ON_PIPE, (20.0, 75.0), 5.0))
    chain, _, pattern = laid((HALF,), holes)
    shapes = tuple(classify(patch) for patch in chain.patches)
    facts = panel_facts(_panel(chain, pattern, holes), chain, shapes, _checks(), False, [])
    net = 9000.0 - area - 25.0 * np.pi
    assert facts["area"] == pytest.approx(net, rel=1e-13)
    assert facts["flat_area"] == pytest.approx(net, rel=1e-13)
    assert facts["cut_length"] == pytest.approx(380.0 + length + 10.0 * np.pi, rel=1e-13)
    assert facts["pierces"] == 3


def _panel(chain: Chain, pattern: Pattern, cuts: tuple[Cut, ...]) -> Panel:
    none = np.zeros((0, 3))
    whole = none.astype(np.int32)
    mesh = Mesh(none, none, none[:, :2], whole, whole[:, 0], False, 0.0)
    shapes = tuple(classify(patch) for patch in chain.patches)
    rulings = tuple(np.linspace(*patch.domain, 3) for patch in chain.patches)
    return Panel("one", "cylinder", chain, shapes, 0.0, rulings, mesh, pattern, cuts=cuts)


def _checks() -> list[Check]:
    return [at_most(name, "one", 0.0, 1.0, "", says="", remedy="") for name in ("twist", "regular")]


def perforated(count: int) -> tuple[Cut, ...]:
    side = round(np.sqrt(count))
    places = np.linspace(5.0, 85.0, side)
    return tuple(circle(ON_PIPE, (x, y), 1.2) for x in places for y in places)


@pytest.mark.bench
def test_the_pattern_of_a_perforated_sheet_takes_time_in_proportion_to_its_holes():
    def seconds(cuts: tuple[Cut, ...]) -> float:
        best = np.inf
        for _ in range(2):
            start = time.process_time()
            _, _, pattern = laid((HALF,), cuts)
            overlap_area(pattern)
            for hole in pattern.holes:
                fit_outline(hole, 0.005)
            best = min(best, time.process_time() - start)
        return best

    few, many = perforated(100), perforated(400)
    assert seconds(many) < 1.5 * 4.0 * seconds(few)
