"""Holes in faces that are splines: exact in exact ones, in fitted ones as good as the fit."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import parts
import pytest
import solids
from handcuts import TURN
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeContents, ShapeAnalysis_ShapeTolerance

from devcad.geometry import chebyshev
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.proofs import sheet_volume


def track(places: object, low: float, high: float) -> Track:
    return Track(0, chebyshev.resolve(places, np.array([low, high])))  # type: ignore[arg-type]


def ellipse(t: float, v: float, rt: float, rv: float, *, over_seam: bool = False) -> Cut:
    """An ellipse in the plane of t and v, clockwise on the front; over the seam in two halves."""

    def places(u: Array) -> Array:
        return np.column_stack([t - rt * np.sin(u), v + rv * np.cos(u)])

    def late(u: Array) -> Array:
        return places(u) + np.array([TURN, 0.0])

    if over_seam:
        return Cut("hole", (track(late, 0.0, np.pi), track(places, np.pi, TURN)), True)
    return Cut("hole", (track(places, 0.0, TURN),), True)


def half_way(panel: Panel, t: float) -> float:
    jet = panel.chain.patches[0].jet([t], 0)
    return 0.5 * float(jet.v_from[0][0] + jet.v_to[0][0])


def oblique(thickness: float) -> tuple[Panel, tuple[Cut, ...]]:
    """A cone over an ellipse, its apex aside: a quarter's end lies in a hole, and the seam."""
    panel = parts.elliptic_cone(thickness=thickness)
    places = ((1.0, 0.2, 10.0), (np.pi / 2.0, 0.1, 5.0), (3.3, 0.1, 5.0))
    holes = [ellipse(t, half_way(panel, t), rt, rv) for t, rt, rv in places]
    return panel, (*holes, ellipse(0.0, half_way(panel, 0.0), 0.2, 10.0, over_seam=True))


def pipe(thickness: float) -> tuple[Panel, tuple[Cut, ...]]:
    panel = parts.elliptic_cylinder(thickness=thickness)
    return panel, (ellipse(1.0, 40.0, 0.2, 10.0), ellipse(np.pi / 2.0 + 0.3, 40.0, 0.3, 15.0))


def helix(thickness: float) -> tuple[Panel, tuple[Cut, ...]]:
    panel = parts.helix_strip(thickness=thickness)
    return panel, (ellipse(1.0, 40.0, 0.1, 8.0), ellipse(3.0, 35.0, 0.2, 5.0))


def mitred(thickness: float) -> tuple[Panel, tuple[Cut, ...]]:
    """A cylinder with a slanted edge."""
    return parts.mitred_pipe(thickness=thickness), (ellipse(1.0, 40.0, 0.2, 10.0),)


CASES = {"oblique cone": oblique, "elliptic pipe": pipe, "helix": helix, "mitred pipe": mitred}


def prepared(name: str, thickness: float) -> tuple[Panel, Panel, float]:
    """The panel, the panel with its cuts, and the area that these take."""
    plain, cuts = CASES[name](thickness)
    removed = solids.taken(plain, cuts)
    return plain, solids.cut_out(plain, cuts, removed), removed


@pytest.mark.parametrize("name", CASES)
def test_holes_of_a_sheet_have_the_area_that_green_s_theorem_gives(
    name: str, tmp_path: Path
) -> None:
    plain, panel, removed = prepared(name, 0.0)
    before = solids.area(solids.read(solids.export(plain, tmp_path).path))
    made = solids.export(panel, tmp_path)
    shape = solids.read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1) <= 1e-6
    assert solids.image_gap(shape) <= 1e-7
    # one hole of the pipe is tangent to a quarter's end and stays off it by 2e-5 mm
    assert before - solids.area(shape) == pytest.approx(removed, rel=1e-7)
    assert all(check.passed for check in made.checks)
    if name != "helix":
        assert made.max_deviation <= (3e-5 if name == "elliptic pipe" else 3e-8)


@pytest.mark.parametrize("name", CASES)
def test_a_solid_with_holes_has_its_volume_within_the_fit(name: str, tmp_path: Path) -> None:
    _, panel, _ = prepared(name, 2.0)
    made = solids.export(panel, tmp_path)
    shape = solids.read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    contents = ShapeAnalysis_ShapeContents()
    contents.Perform(shape)
    assert contents.NbFreeEdges() == contents.NbC0Surfaces() == 0
    assert solids.image_gap(shape) <= 1e-7
    expected = sheet_volume(panel)
    assert solids.volume(shape) == pytest.approx(expected, rel=2e-6)
    assert solids.plain_volume(shape) == pytest.approx(expected, rel=1e-5)
    assert made.max_deviation <= 1e-4
    assert all(check.passed for check in made.checks)


@pytest.mark.parametrize("name", CASES)
def test_a_finer_tolerance_gives_a_finer_volume(name: str, tmp_path: Path) -> None:
    _, panel, _ = prepared(name, 2.0)
    shape = solids.read(solids.export(panel, tmp_path, step_tolerance=1e-5).path)
    assert solids.volume(shape) == pytest.approx(sheet_volume(panel), rel=1e-7)


@pytest.mark.parametrize("thickness", [0.0, 2.0])
def test_a_notch_in_a_fitted_edge_takes_a_part_of_it(thickness: float, tmp_path: Path) -> None:
    plain = parts.helix_strip(thickness=thickness)
    corners = [(1.0, 60.0), (1.0, 50.0), (1.1, 50.0), (1.1, 60.0)]
    lines = []
    for a, b in pairwise(corners):
        ends = np.array([a, b])

        def places(u: Array, ends: Array = ends) -> Array:
            return ends[0] + u[:, None] * (ends[1] - ends[0])

        lines.append(track(places, 0.0, 1.0))
    # the tangent surface's width is |a| v, and a is the helix's curvature times its speed
    rate = 30.0 / np.hypot(30.0, 12.0)
    removed = 0.5 * (60.0**2 - 50.0**2) * rate * 0.1
    panel = solids.cut_out(plain, (Cut("notch", tuple(lines), False),), removed)
    made = solids.export(panel, tmp_path)
    shape = solids.read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    expected = panel.pattern.area * (thickness or 1.0)
    found = solids.volume(shape) if thickness else solids.area(shape)
    assert found == pytest.approx(expected, rel=2e-6)
    assert all(check.passed for check in made.checks)


@pytest.mark.parametrize("scale", [1e-2, 1e2])
@pytest.mark.parametrize("thickness", [0.0, 2.0])
def test_holes_scale_with_the_part(scale: float, thickness: float, tmp_path: Path) -> None:
    plain = parts.scaled(parts.elliptic_cone(domain=(0.0, 4.0), thickness=thickness), scale)
    cuts = (ellipse(1.0, half_way(plain, 1.0), 0.2, 10.0 * scale),)
    panel = solids.cut_out(plain, cuts, solids.taken(plain, cuts))
    made = solids.export(panel, tmp_path)
    shape = solids.read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    found = solids.volume(shape) if thickness else solids.area(shape)
    expected = sheet_volume(panel) if thickness else panel.pattern.area
    assert found == pytest.approx(expected, rel=2e-6 if thickness else 1e-9)
