"""Panels with many holes: linear time, small files, faces that kernels can still work with."""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import parts
import pytest
import solids
from handcuts import circle, on_cylinder
from OCP.BRepCheck import BRepCheck_Analyzer

from devcad.export._step_borders import clear, parted
from devcad.export._step_lean import lean
from devcad.export._step_sides import spline_part
from devcad.export._step_tracks import corners
from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.fit import Course, Spline
from devcad.part import Panel
from devcad.proofs import sheet_volume

PITCH, RADIUS = 15.0, 100.0


def perforated(across: int, along: int, thickness: float = 2.0) -> Panel:
    """A rolled sheet with round holes of diameter 10 in rows."""
    plain = parts.frustum(
        RADIUS, RADIUS, along * PITCH, sweep=across * PITCH / RADIUS, thickness=thickness
    )
    places = [((i + 0.5) * PITCH, (j + 0.5) * PITCH) for j in range(across) for i in range(along)]
    cuts = tuple(circle(on_cylinder(RADIUS), place, 5.0) for place in places)
    return solids.cut_out(plain, cuts, len(cuts) * np.pi * 25.0)


@pytest.mark.slow
def test_a_rolled_panel_with_a_hundred_holes_keeps_its_volume(tmp_path: Path) -> None:
    panel = perforated(10, 10)
    made = solids.export(panel, tmp_path)
    shape = solids.read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert solids.kinds(shape) == {"Cylinder": 2, "Plane": 4, "BSplineSurface": 200}
    assert solids.volume(shape) == pytest.approx(sheet_volume(panel), rel=1e-9)
    assert made.path.stat().st_size <= 20_000 * 100  # bytes


@pytest.mark.slow
def test_four_times_as_many_holes_take_at_most_six_times_as_long(tmp_path: Path) -> None:
    def seconds(panel: Panel) -> float:
        start = time.process_time()
        solids.export(panel, tmp_path)
        return time.process_time() - start

    solids.export(perforated(2, 2), tmp_path)  # imports
    few = min(seconds(perforated(10, 10)) for _ in range(2))
    assert seconds(perforated(20, 20)) <= 6.0 * few


@pytest.mark.slow
def test_a_face_has_no_more_than_about_two_hundred_holes(tmp_path: Path) -> None:
    shape = solids.read(solids.export(perforated(21, 20, 0.0), tmp_path).path)
    assert solids.kinds(shape) == {"Cylinder": 3}
    holes = 420.0 * np.pi * 25.0
    whole = 21.0 * 20.0 * PITCH**2
    assert solids.area(shape) == pytest.approx(whole - holes, rel=1e-9)


@pytest.mark.parametrize("thickness", [0.0, 2.0])
def test_a_body_with_a_few_holes_is_a_small_file(thickness: float, tmp_path: Path) -> None:
    panel = perforated(3, 1, thickness)
    made = solids.export(panel, tmp_path)
    assert made.path.stat().st_size <= 130_000


def test_equal_input_gives_equal_bytes(tmp_path: Path) -> None:
    files = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        files.append(solids.export(perforated(3, 2), tmp_path / name).path.read_bytes())
    assert files[0] == files[1]


def test_points_that_are_equal_stand_in_the_file_once() -> None:
    text = (
        b"#1 = CARTESIAN_POINT('',(1.,2.));\n#2 = CARTESIAN_POINT('',(1.,\n  2.));\n"
        b"#3 = PRODUCT('part #2',#2);\n#20 = LINE('',#1,#2,#20);\n"
    )
    assert lean(text) == (
        b"#1 = CARTESIAN_POINT('',(1.,2.));\n"
        b"#3 = PRODUCT('part #2',#1);\n#20 = LINE('',#1,#1,#20);\n"
    )


def test_a_border_of_ours_keeps_clear_of_holes_or_passes_through_their_middle() -> None:
    holes = np.array([[0.9, 1.1], [1.2, 1.4]])
    place = clear(1.0, holes, 0.5)
    assert ((place < holes[:, 0]) | (place > holes[:, 1])).all()
    assert clear(0.5, holes, 0.1) == 0.5
    wide = np.array([[0.5, 1.7]])
    assert clear(1.6, wide, 0.1) == pytest.approx(1.5)  # no way out: away from the tangent


def test_a_course_is_parted_by_the_number_of_its_holes() -> None:
    t = (np.arange(900) + 0.5) / 900.0
    holes = np.column_stack([t - 2e-4, t + 2e-4])
    pieces = parted(Course(np.array([0.0, 0.5, 1.0]), np.array([0.0, 2.0, 3.0])), holes)
    assert len(pieces) == 5
    assert pieces[0].t[0] == 0.0
    assert pieces[-1].s[-1] == 3.0
    for before, after in pairwise(pieces):
        assert (before.t[-1], before.s[-1]) == (after.t[0], after.s[0])
        assert np.abs(before.t[-1] - t).min() > 2e-4


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
@pytest.mark.parametrize("weighted", [False, True])
def test_a_part_of_a_spline_is_the_same_curve(degree: int, weighted: bool) -> None:
    rng = np.random.default_rng(degree)
    inner = [1.0] * max(degree - 1, 1) + [2.0, 2.5, 4.0]
    knots = np.array([0.0] * (degree + 1) + inner + [5.0] * (degree + 1))
    count = len(knots) - degree - 1
    weights = np.repeat(rng.uniform(0.5, 2.0, (count, 1)), 3, axis=1) if weighted else None
    whole = Spline(degree, knots, rng.normal(size=(count, 3)), weights=weights)
    for low, high in ((0.3, 0.7), (0.0, 1.0), (0.5, 1.0), (1.0, 2.0), (0.2, 4.7), (2.2, 2.4)):
        s = np.linspace(low, high, 50)
        np.testing.assert_allclose(spline_part(whole, low, high)(s), whole(s), atol=1e-13)


def test_a_track_has_a_corner_where_its_curvature_jumps_and_none_at_other_knots() -> None:
    """A line into an arc, and an arc cut in two where nothing happens."""
    patch = perforated(1, 1).chain.patches[0]
    line = chebyshev.resolve(lambda u: np.column_stack([u, 0.0 * u]), np.array([-1.0, 0.0]))
    arc = chebyshev.resolve(
        lambda u: np.column_stack([np.sin(u), 1.0 - np.cos(u)]), np.array([0.0, 0.5, 1.0])
    )
    tables = [*line.coefficients, *arc.coefficients]
    width = max(map(len, tables))
    padded = [np.pad(table, ((0, width - len(table)), (0, 0))) for table in tables]
    joined = Piecewise(np.array([-1.0, 0.0, 0.5, 1.0]), np.array(padded))
    assert corners(joined, patch) == [0.0]
    assert corners(joined, replace(patch, breaks=(0.0,))) == []
