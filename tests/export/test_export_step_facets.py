"""Thick facets with curved edges in STEP: area x thickness, walls square to the sheet, no gaps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from facets import bumped_cone, plates
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.ShapeAnalysis import ShapeAnalysis_ShapeTolerance
from OCP.TopoDS import TopoDS_Shape
from solids import cut_out, export, kinds, plain_volume, read, taken, volume

from devcad.geometry import chebyshev
from devcad.geometry.cuts import Cut, Track
from devcad.part import Panel

STRONG = plates([70.0, 90.0, 60.0], [np.radians(149.0), np.radians(-80.0)], thickness=1.5)
CASES: dict[str, tuple[Panel, dict[str, int]]] = {
    # name: (panel, faces): two skins a facet, and of every edge one wall, three beside strong
    # creases: two that lean to the mitres, between them one square to the sheet
    "three sides": (bumped_cone(3), {"Plane": 6, "BSplineSurface": 12, "Cylinder": 6}),
    "a thick row": (
        bumped_cone(8, turn=0.8, thickness=12.0),
        {"Plane": 18, "BSplineSurface": 16},
    ),
    "sharp folds": (STRONG, {"Plane": 8, "BSplineSurface": 14}),
}


def measured(panel: Panel, folder: Path) -> tuple[Path, TopoDS_Shape]:
    """The file and its shape, which is sound and holds area x thickness."""
    made = export(panel, folder)
    shape = read(made.path)
    assert BRepCheck_Analyzer(shape, True).IsValid()
    assert ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1) <= 1e-6
    expected = panel.area * panel.thickness
    assert volume(shape) == pytest.approx(expected, rel=1e-9)  # edges are fitted to 3e-8 mm
    assert plain_volume(shape) == pytest.approx(expected, rel=1e-7)
    return made.path, shape


@pytest.mark.parametrize("name", CASES)
def test_its_volume_is_area_times_thickness(name: str, tmp_path: Path) -> None:
    panel, faces = CASES[name]
    _, shape = measured(panel, tmp_path)
    assert kinds(shape) == faces


@pytest.mark.slow
def test_a_cone_of_sixty_facets_costs_no_more_than_straight_ones(tmp_path: Path) -> None:
    path, shape = measured(bumped_cone(60), tmp_path)
    assert kinds(shape) == {"Plane": 120, "BSplineSurface": 120}
    assert path.stat().st_size < 60 * 12e3  # a straight facet's four planes take 12 kB


def ellipse(patch: int, t: float, v: float, reach: tuple[float, float], turn: float) -> Track:
    """Half of an ellipse about (t, v), clockwise from the angle ``turn`` on."""

    def places(u: np.ndarray) -> np.ndarray:
        return np.column_stack([t + reach[0] * np.sin(turn - u), v + reach[1] * np.cos(turn - u)])

    return Track(patch, chebyshev.resolve(places, np.array([0.0, np.pi])))


def over_crease(panel: Panel, v: float) -> Cut:
    """A round hole of 16 mm about the first crease of plates."""
    t = panel.chain.patches[0].domain[1]
    tracks = (ellipse(0, t, v, (8.0, 8.0), 0.0), ellipse(1, t, v, (8.0, 8.0), np.pi))
    return Cut("over", tracks, True)


def notch(panel: Panel, patch: int, t: float, half: float, depth: float) -> tuple[Cut, float]:
    """A pointed notch in the outer edge of plates about t, and the area that it takes."""
    ends = np.array([t - half, t + half])
    high = panel.chain.patches[patch].jet(ends, 0).v_to[0]
    points = np.array([[ends[0], high[0]], [t, 70.0 - depth], [ends[1], high[1]]])

    def line(k: int) -> Track:
        a, b = points[k], points[k + 1]
        return Track(
            patch, chebyshev.resolve(lambda u: a + u[:, None] * (b - a), np.array([0.0, 1.0]))
        )

    above = 160.0 * half + float(np.diff(6.0 * np.sin(0.05 * ends))[0]) / 0.05
    below = 0.5 * float(np.diff(points[:, 0]) @ (points[1:, 1] + points[:-1, 1]))
    return Cut("notch", (line(0), line(1)), False), above - below


def test_holes_over_creases_and_notches_beside_them_keep_area_times_thickness(
    tmp_path: Path,
) -> None:
    cuts = [over_crease(STRONG, 40.0)]
    removed = taken(STRONG, (cuts[0],))
    assert removed == pytest.approx(64.0 * np.pi, rel=1e-12)
    # within the reach of the first crease's pull, 21.6 mm, and at its very edge
    for t, half in ((66.0, 3.5), (74.0, 3.0), (91.6, 5.0)):
        cut, area = notch(STRONG, int(t > 70.0), t, half, 6.0)
        cuts.append(cut)
        removed += area
    panel = cut_out(STRONG, tuple(cuts), removed)
    measured(panel, tmp_path)
