"""Meshes on hinged strips: what is cut out stays out, and every triangle lies on one facet."""

from __future__ import annotations

import numpy as np
import pytest
from jobs import built

from devcad.export.folding import sheet_of, strip_of
from devcad.mesh.hinged import motions, moved
from devcad.mesh.lodged import Sheet, carriers, edges

CUT = [("drilled", 0.0), ("drilled", 2.0), ("horn", 0.0), ("horn", 1.0)]


def lodged(name: str, thickness: float):
    (panel,) = built(name, thickness).panels
    strip = strip_of(panel)
    assert strip is not None
    return panel, strip, sheet_of(panel, strip)


def areas(points: np.ndarray) -> np.ndarray:
    """The signed areas of plane triangles (m, 3, 2)."""
    (ax, ay), (bx, by) = (points[:, 1] - points[:, 0]).T, (points[:, 2] - points[:, 0]).T
    return 0.5 * (ax * by - ay * bx)


def enclosed(sheet: Sheet, border: np.ndarray) -> float:
    """The area inside a border by Green's theorem."""
    (ax, ay), (bx, by) = sheet.flat[border[:, 0]].T, sheet.flat[border[:, 1]].T
    return 0.5 * float((ax * by - ay * bx).sum())


@pytest.mark.parametrize(("name", "thickness"), CUT)
def test_a_perforated_sheet_covers_what_the_cuts_leave(name: str, thickness: float) -> None:
    panel, strip, sheet = lodged(name, thickness)
    found = areas(sheet.flat[sheet.triangles])
    assert found.min() > 0.0  # front up, nothing folded over
    _, border = edges(strip, sheet)
    # 1e-7 of the strip decides whether a point is on a ruling
    assert found.sum() == pytest.approx(enclosed(sheet, border), rel=1e-7)
    # chords of rails and holes leave the curves by the tolerance at most
    length = sum(np.linalg.norm(np.diff(sheet.flat[border], axis=1)[:, 0], axis=1))
    assert found.sum() == pytest.approx(panel.pattern.area, abs=length * 0.05)


@pytest.mark.parametrize(("name", "thickness"), CUT)
def test_triangles_are_rigid_at_every_position(name: str, thickness: float) -> None:
    _, strip, sheet = lodged(name, thickness)

    def lengths(f: float) -> np.ndarray:
        corner = moved(motions(strip, f)[sheet.body], sheet.flat)[sheet.triangles]
        return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)

    size = np.abs(strip.flat).max()
    for f in (0.3, 0.7, 1.0):
        assert np.abs(lengths(f) - lengths(0.0)).max() < 1e-9 * size


@pytest.mark.parametrize("thickness", [0.0, 2.0])
def test_the_sheet_as_built_lies_on_its_cone(thickness: float) -> None:
    """r = 60 - 0.6 z: the distance is the radial one times the cosine of the half angle."""
    _, strip, sheet = lodged("drilled", thickness)
    x, y, z = moved(motions(strip, 0.0)[sheet.body], sheet.flat).T
    away = np.abs(np.hypot(x, y) - (60.0 - 0.6 * z)) / np.hypot(1.0, 0.6)
    assert away.max() < 0.05  # the tolerance


@pytest.mark.parametrize("name", ["drilled", "horn"])
def test_every_point_of_the_mesh_is_on_the_sheet(name: str) -> None:
    panel, strip, sheet = lodged(name, 0.0)
    middle = moved(motions(strip, 0.0)[sheet.body], sheet.flat)
    apart = np.linalg.norm(panel.mesh.vertices[:, None] - middle[None], axis=2).min(axis=1)
    used = np.unique(panel.mesh.triangles)
    assert apart[used].max() < 0.05


@pytest.mark.parametrize("name", ["arc", "cone", "helix", "duct"])
def test_the_border_of_a_whole_sheet_is_both_rails_and_both_ends(name: str) -> None:
    _, strip, sheet = lodged(name, 0.0)
    lines, border = edges(strip, sheet)
    assert len(lines) == strip.rulings
    rails = 1 if name == "cone" else 2  # the other is its apex
    assert len(border) == rails * (strip.rulings - 1) + 2


@pytest.mark.parametrize(("name", "thickness"), [*CUT, ("duct", 1.5), ("cone", 1.0)])
def test_carriers_leave_the_mesh_as_built_and_lay_it_flat(name: str, thickness: float) -> None:
    panel, strip, _ = lodged(name, thickness)
    bodies, weights = carriers(strip, panel.mesh)
    assert np.abs(weights.sum(axis=1) - 1.0).max() == 0.0
    as_built, flat = motions(strip, 0.0), motions(strip, 1.0)
    heights = np.zeros(len(bodies))
    for column in range(2):
        turn, place = as_built[bodies[:, column], :, :3], as_built[bodies[:, column], :, 3]
        own = np.einsum("nji,nj->ni", turn, panel.mesh.vertices - place)
        heights += weights[:, column] * (flat[0, 2, 3] + own[:, 2])
    # a skin's point turned by half a facet's angle is lower by T/2 (1 - cos), and rails bulge
    assert np.abs(np.abs(heights) - 0.5 * thickness).max() < 2 * 0.05
