"""Contours of DXF files: drawn by another library, measured against closed forms; hostile files."""

from __future__ import annotations

import io
import math
import random
from collections.abc import Callable
from typing import Any

import ezdxf
import numpy as np
import pytest

from devcad.errors import DevcadError, FileError, JobError, LimitError
from devcad.flatten.pattern import Edge
from devcad.flatten.rings import Contour
from devcad.importers.dxf import MAX_ENTITIES, read_contours

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(32)
Draw = Callable[[Any], object]


def text(draw: Draw, *, version: str = "R2000", units: int = 4) -> bytes:
    """The bytes of a drawing in which ``draw(modelspace)`` has drawn."""
    document = ezdxf.new(version)
    document.header["$INSUNITS"] = units
    draw(document.modelspace())
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


def read(data: bytes, layer: str | None = None, mm: float = 1.0) -> tuple[Contour, ...]:
    return read_contours(data, layer=layer, mm_per_unit=mm, place="part.dxf")


def contours(draw: Draw, **options: Any) -> tuple[Contour, ...]:
    return read(text(draw), **options)


def area(contour: Contour) -> float:
    """Green's formula by Gauss quadrature on every piece."""
    return sum(_swept(edge) for edge in contour)


def _swept(edge: Edge) -> float:
    half = 0.5 * np.diff(edge.u)[:, None]
    u = 0.5 * (edge.u[:-1] + edge.u[1:])[:, None] + half * GAUSS
    points, slopes = edge.curve(u.ravel())
    turning = points[:, 0] * slopes[:, 1] - points[:, 1] * slopes[:, 0]
    return 0.5 * float((half * WEIGHTS).ravel() @ turning)


def gaps(contour: Contour) -> float:
    """The largest distance between the end of a piece and the start of the next."""
    starts = np.array([edge.curve(edge.u[:1])[0][0] for edge in contour])
    ends = np.array([edge.curve(edge.u[-1:])[0][0] for edge in contour])
    return float(np.abs(np.roll(starts, -1, axis=0) - ends).max())


def keyhole(space: Any, shift: float = 0.0) -> None:
    """A round head of radius 5, a neck of width 4 with a round end at y = 12; out of order."""
    rise = math.sqrt(21.0)
    angle = math.degrees(math.atan2(rise, 2.0))
    space.add_line((2 + shift, 12), (2, rise))
    space.add_arc((0, 0), 5, 180 - angle, angle)
    space.add_line((-2, 12), (-2, rise))
    space.add_arc((0, 12), 2, 0, 180)


KEYHOLE = (
    (math.pi - math.atan2(2, math.sqrt(21))) * 25
    + 2 * math.sqrt(21)  # the disc below its chord
    + 4 * (12 - math.sqrt(21))
    + 2 * math.pi
)


# --- what is read --------------------------------------------------------------------------


def test_a_circle_is_one_exact_edge_about_the_drawings_origin() -> None:
    ((edge,),) = contours(lambda space: space.add_circle((30, -20), 7))
    points, _ = edge.curve(np.linspace(edge.u[0], edge.u[-1], 50))
    assert np.hypot(*(points - [30, -20]).T) == pytest.approx(7, rel=1e-15)
    assert area((edge,)) == pytest.approx(49 * math.pi, rel=1e-14)


@pytest.mark.parametrize("version", ["R12", "R2000", "R2010", "R2018"])
def test_lines_and_arcs_in_any_order_and_direction_make_a_keyhole(version: str) -> None:
    (contour,) = read(text(keyhole, version=version))
    assert len(contour) == 4
    assert area(contour) == pytest.approx(KEYHOLE, rel=1e-13)
    assert gaps(contour) < 1e-9  # angles in degrees round in the 15th digit


@pytest.mark.parametrize("shift", [3e-5, -9e-5])
def test_ends_that_miss_each_other_by_less_than_the_snap_meet_half_way(shift: float) -> None:
    (contour,) = contours(lambda space: keyhole(space, shift))
    assert gaps(contour) < 1e-9
    assert area(contour) == pytest.approx(
        KEYHOLE, abs=abs(shift) * 8
    )  # a wedge as long as the neck


def test_a_side_shorter_than_the_snap_leaves_no_gap() -> None:
    """A corner drawn twice, 60 nm apart, in the middle of a polyline and where it closes."""
    corners = [(0, 0), (9, 0), (9, 6e-5), (9, 4), (0, 4), (6e-5, 0)]
    (contour,) = contours(lambda space: space.add_lwpolyline(corners, close=True))
    assert len(contour) == 4
    assert gaps(contour) < 1e-9
    assert area(contour) == pytest.approx(36, abs=1e-3)


def test_bulges_are_arcs_counterclockwise_where_positive() -> None:
    def slot(space: Any) -> None:
        space.add_lwpolyline(
            [(-10, -3, 0), (10, -3, 1), (10, 3, 0), (-10, 3, 1)], format="xyb", close=True
        )

    def lens(space: Any) -> None:
        space.add_lwpolyline([(0, 0, 0.25), (0, 10, 0.25)], format="xyb", close=True)

    assert area(contours(slot)[0]) == pytest.approx(120 + 9 * math.pi, rel=1e-14)
    sweep = 4 * math.atan(0.25)
    radius = 5 / math.sin(sweep / 2)
    lune = radius**2 * (sweep - math.sin(sweep))
    assert area(contours(lens)[0]) == pytest.approx(lune, rel=1e-13)


def test_a_clockwise_contour_is_turned_round() -> None:
    (contour,) = contours(
        lambda space: space.add_lwpolyline([(0, 0), (0, 4), (6, 4), (6, 0)], close=True)
    )
    assert area(contour) == pytest.approx(24, rel=1e-15)


def test_an_r12_polyline_and_a_3d_polyline_in_one_height_are_read() -> None:
    square = [(0, 0, 3), (4, 0, 3), (4, 4, 3), (0, 4, 3)]
    flat = read(text(lambda space: space.add_polyline2d(square, close=True), version="R12"))
    high = contours(lambda space: space.add_polyline3d(square, close=True))
    assert area(flat[0]) == area(high[0]) == pytest.approx(16, rel=1e-15)


def test_ellipses_and_their_parts_are_exact() -> None:
    (whole,) = contours(lambda space: space.add_ellipse((5, 5), (8, 6), ratio=0.3))
    assert area(whole) == pytest.approx(math.pi * 100 * 0.3, rel=1e-14)

    def half(space: Any) -> None:
        space.add_ellipse((0, 0), (10, 0), 0.4, 0, math.pi)
        space.add_line((-10, 0), (10, 0))

    assert area(contours(half)[0]) == pytest.approx(math.pi * 40 / 2, rel=1e-13)


def test_a_rational_spline_is_the_circle_that_it_is() -> None:
    """Nine control points of degree 2 with weights 1 and 1 / sqrt 2: a circle exactly."""
    around = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    weights = [1 if k % 2 == 0 else math.sqrt(0.5) for k in range(9)]

    def draw(space: Any) -> None:
        space.add_rational_spline([(5 * x, 5 * y) for x, y in around], weights, 2, knots)

    (contour,) = contours(draw)
    points = np.concatenate([e.curve(np.linspace(e.u[0], e.u[-1], 33))[0] for e in contour])
    assert np.hypot(*points.T) == pytest.approx(5, rel=1e-14)


def test_a_cubic_spline_and_a_line_close_to_the_area_of_the_bezier() -> None:
    """The cubic (0, 0), (0, 3), (6, 3), (6, 0): area 3/20 of sums of cross products = 10.8."""

    def draw(space: Any) -> None:
        space.add_open_spline([(0, 0), (0, 3), (6, 3), (6, 0)], degree=3)
        space.add_line((0, 0), (6, 0))

    assert area(contours(draw)[0]) == pytest.approx(10.8, rel=1e-13)


def closed_spline(space: Any, x: float) -> None:
    """A periodic cubic, its knots uniform beyond both ends of what is drawn."""
    control = [(x, 0), (x + 10, 0), (x + 10, 9), (x, 9)]
    tool = ezdxf.math.closed_uniform_bspline(control, order=4)
    space.add_spline().apply_construction_tool(tool)


def test_a_periodic_spline_closes_upon_itself() -> None:
    """The area of the uniform closed cubic of a rectangle is 61 / 90 of it."""
    (contour,) = contours(lambda space: closed_spline(space, 0.0))
    assert gaps(contour) < 1e-12
    assert area(contour) == pytest.approx(61, rel=1e-12)


def test_a_spline_through_fit_points_goes_through_them() -> None:
    through = [(0, 0), (4, 3), (9, 1), (7, -4), (2, -5)]

    def draw(space: Any) -> None:
        space.add_spline(through)
        space.add_line(through[-1], through[0])

    (contour,) = contours(draw)
    fine = np.concatenate([e.curve(np.linspace(e.u[0], e.u[-1], 20001))[0] for e in contour])
    for point in through:
        assert np.hypot(*(fine - point).T).min() < 1e-3  # the sampling's own step


def test_block_references_are_scaled_turned_mirrored_and_repeated() -> None:
    def draw(space: Any) -> None:
        block = space.doc.blocks.new("HOLE")
        block.add_circle((1, 0), 2)
        block.add_text("not cut")
        space.add_blockref("HOLE", (0, 0), {"xscale": 3, "yscale": 1.5, "rotation": 30})
        space.add_blockref("HOLE", (100, 0), {"xscale": -1})
        space.add_blockref(
            "HOLE",
            (0, 100),
            {"row_count": 2, "column_count": 3, "row_spacing": 10, "column_spacing": 20},
        )

    found = contours(draw)
    assert len(found) == 8
    areas = [area(contour) for contour in found]
    assert areas[0] == pytest.approx(math.pi * 6 * 3, rel=1e-12)
    assert areas[1:] == pytest.approx([math.pi * 4] * 7, rel=1e-12)


def test_what_is_drawn_from_below_is_mirrored() -> None:
    """Extrusion -z: the entity's own x runs the other way."""

    def draw(space: Any) -> None:
        attributes = {"extrusion": (0, 0, -1)}
        space.add_circle((30, 5), 2, dxfattribs=attributes)
        space.add_lwpolyline(
            [(50, 0, 1), (54, 0, 0)], format="xyb", close=True, dxfattribs=attributes
        )

    circle, half = contours(draw)
    assert circle[0].curve(np.array([0.0, math.pi]))[0].mean(axis=0) == pytest.approx([-30, 5])
    assert area(half) == pytest.approx(2 * math.pi, rel=1e-13)
    low = np.concatenate([e.curve(np.linspace(e.u[0], e.u[-1], 9))[0] for e in half])
    assert low[:, 0] == pytest.approx(np.clip(low[:, 0], -54, -50))
    assert low[:, 1].min() == pytest.approx(-2)  # counterclockwise from below is clockwise


@pytest.mark.parametrize(
    ("code", "mm"), [(0, 10.0), (1, 25.4), (2, 304.8), (4, 1.0), (5, 10.0), (6, 1000.0), (13, 1e-3)]
)
def test_the_drawings_unit_counts_and_else_the_jobs(code: int, mm: float) -> None:
    radius = 2.0 / mm
    (contour,) = read(text(lambda space: space.add_circle((0, 0), radius), units=code), mm=10.0)
    assert area(contour) == pytest.approx(4 * math.pi, rel=1e-13)


def test_only_the_layer_asked_for_is_read_whatever_its_case() -> None:
    def draw(space: Any) -> None:
        space.add_circle((0, 0), 5, dxfattribs={"layer": "Cut"})
        space.add_line((0, 0), (9, 9), dxfattribs={"layer": "Help"})
        block = space.doc.blocks.new("HOLE")
        block.add_circle((0, 0), 1)  # layer 0: where the reference stands
        space.add_blockref("HOLE", (20, 0), {"layer": "CUT"})

    assert len(contours(draw, layer="cut")) == 2
    with pytest.raises(JobError, match=r'no contour on the layer "holes".*Cut, Help'):
        contours(draw, layer="holes")


def test_hidden_layers_and_annotations_are_left_out() -> None:
    def draw(space: Any) -> None:
        space.doc.layers.add("GONE").off()
        space.add_line((0, 0), (1, 1), dxfattribs={"layer": "GONE"})
        space.add_text("M 1:1")
        space.add_mtext("note")
        space.add_point((3, 3))
        space.add_linear_dim(base=(0, 20), p1=(-5, 0), p2=(5, 0)).render()
        space.add_circle((0, 0), 5)

    assert len(contours(draw)) == 1


# --- what is refused -----------------------------------------------------------------------


def square(space: Any, x: float = 0.0, size: float = 10.0) -> None:
    half = 0.5 * size
    corners = [(x - half, -half), (x + half, -half), (x + half, half), (x - half, half)]
    space.add_lwpolyline(corners, close=True)


def island(space: Any) -> None:
    square(space)
    space.add_circle((0, 0), 2)


def twice(space: Any) -> None:
    for _ in range(2):
        for a, b in (((0, 0), (5, 0)), ((5, 0), (0, 5)), ((0, 5), (0, 0))):
            space.add_line(a, b)


def leaning(space: Any) -> None:
    space.add_circle((0, 0), 2, dxfattribs={"extrusion": (0, 1, 1)})


def climbing(space: Any) -> None:
    space.add_line((0, 0, 0), (5, 0, 4))


@pytest.mark.parametrize(
    ("draw", "what"),
    [
        (lambda space: None, "the drawing has no contour"),
        (lambda space: space.add_line((1, 2), (5, 2)), r"open: the LINE ends alone at \(1, 2\)"),
        (lambda space: keyhole(space, 2e-3), r"alone at \(2\.002, 12\), 0\.002 mm from the next"),
        (twice, r"4 lines meet at \(0, 0\)"),
        (island, "two contours meet, or one holds the other"),
        (lambda space: (square(space), square(space, 8.0)), "two contours meet"),
        (
            lambda space: space.add_lwpolyline([(0, 0), (4, 4), (4, 0), (0, 4)], close=True),
            r"crosses or touches itself at \(2, 2\)",
        ),
        (leaning, "CIRCLE does not lie flat"),
        (climbing, "LINE does not lie flat in the xy plane: 4 mm high"),
        (lambda space: space.add_solid([(0, 0), (1, 0), (0, 1), (1, 1)]), "SOLID bounds no plane"),
        (lambda space: space.add_3dface([(0, 0), (1, 0), (0, 1)]), "3DFACE bounds no plane"),
    ],
)
def test_what_is_no_hole_is_refused_by_its_place(draw: Draw, what: str) -> None:
    with pytest.raises(JobError, match=what) as error:
        contours(draw)
    assert error.value.place == "part.dxf"
    assert error.value.remedy


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(JobError, match="INSUNITS 20"):  # parsecs
        read(text(square, units=20))


def bomb(space: Any) -> None:
    for depth in range(12):
        block = space.doc.blocks.new(f"B{depth}")
        for k in range(10):
            if depth:
                block.add_blockref(f"B{depth - 1}", (k, 0))
    space.add_blockref("B11", (0, 0))


def deep(space: Any) -> None:
    space.doc.blocks.new("B0").add_circle((0, 0), 1)
    for depth in range(1, 30):
        space.doc.blocks.new(f"B{depth}").add_blockref(f"B{depth - 1}", (0, 0))
    space.add_blockref("B29", (0, 0))


def array(space: Any) -> None:
    space.doc.blocks.new("B").add_circle((0, 0), 1)
    grid = dict.fromkeys(("row_count", "column_count"), 30_000)
    space.add_blockref("B", (0, 0), {**grid, "row_spacing": 3, "column_spacing": 3})


def long(space: Any) -> None:
    points = [(np.cos(t), np.sin(t)) for t in np.linspace(0, 6.2, MAX_ENTITIES + 1)]
    line = space.add_lwpolyline([], close=True)
    line.lwpoints.extend([[x, y, 0.0, 0.0, 0.0] for x, y in points])


@pytest.mark.parametrize("draw", [bomb, deep, array, long])
def test_what_multiplies_is_refused_before_it_costs_time(draw: Draw) -> None:
    with pytest.raises(LimitError) as error:
        contours(draw)
    assert error.value.code == 4


def test_a_block_that_draws_itself_is_refused() -> None:
    def draw(space: Any) -> None:
        space.doc.blocks.new("A").add_blockref("A", (0, 0))
        space.add_blockref("A", (0, 0))

    with pytest.raises(DevcadError):
        contours(draw)


# --- files that are none -------------------------------------------------------------------

GOOD = text(keyhole, version="R12")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"EOF",
        b"hello\nEOF\n",
        b"\x00" * 100,
        b"AutoCAD Binary DXF\r\n\x1a\x00",
        b"PK\x03\x04 a zip file",
        GOOD[: len(GOOD) // 2],
        GOOD.replace(b"SECTION", b"SELECTION"),
        GOOD.replace(b"12.0", b"twelve"),
        GOOD.replace(b"12.0", b"nan"),
        GOOD.replace(b"12.0", b"1e300"),
    ],
)
def test_a_damaged_file_is_a_file_error(data: bytes) -> None:
    with pytest.raises(FileError) as error:
        read(data)
    assert error.value.code == 5
    assert error.value.place == "part.dxf"
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "seed", [*range(20), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(20, 200))]
)
def test_random_damage_gives_contours_or_a_plain_error(seed: int) -> None:
    """Bytes changed, cut out or doubled; what still can be read is read, nothing else escapes."""
    chance = random.Random(seed)

    def draw(space: Any) -> None:
        keyhole(space)
        space.add_lwpolyline([(50, 0, 0.5), (60, 0, 0), (60, 9, 0)], format="xyb", close=True)
        space.add_ellipse((90, 0), (5, 1), 0.5)
        closed_spline(space, 120)
        space.doc.blocks.new("B").add_circle((0, 0), 1)
        space.add_blockref("B", (150, 0))

    data = bytearray(text(draw))
    start = data.rfind(b"ENTITIES") if chance.random() < 0.7 else 0
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(start, len(data))
        how = chance.random()
        if how < 0.5:
            data[at] = chance.choice(b"0123456789.-eEABC \n\x00\xff")
        elif how < 0.75:
            del data[at : at + chance.randint(1, 60)]
        else:
            data[at:at] = data[at : at + chance.randint(1, 200)]
    try:
        found = read(bytes(data))
    except DevcadError as error:
        assert error.code in (2, 4, 5)
        assert len(str(error)) < 600
    else:
        assert all(math.isfinite(area(contour)) for contour in found)
