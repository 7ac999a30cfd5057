"""Sheets with curved creases in animated glTF, against a ring whose folding is known: cones of any
steepness beside one another, along a circle of radius 100 cos(half the fold angle)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from films import File
from jobs import CREASED, built

import devcad
from devcad.export import Options, glb
from devcad.export.creased import Creased, creased
from devcad.export.folding import pattern_shifts
from devcad.export.glbcrease import _key_states, rig_of
from devcad.mesh.hinged import moved
from devcad.part import Panel, Part
from devcad.poses import poses

FOLDING = Options(glb_animate=True)


def folding(part: Part, folder: Path) -> File:
    (written,) = glb.write(part, folder, FOLDING)
    return File(written.path)


def scored(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """The vertices on the crease of the ring, and the arc lengths up to there."""
    edge = panel.pattern.drawings[0]
    a, b, c = edge.curve(np.linspace(edge.u[0], edge.u[-1], 3))[0]
    middle = np.linalg.solve(2.0 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
    x, y = (panel.mesh.flat - middle).T
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    on = np.flatnonzero(np.abs(radius - 100.0) < 1e-6)
    turn = np.exp(1j * (angle[on] - angle[on[0]]))
    return on, 100.0 * np.abs(np.angle(turn))


def chords(s: np.ndarray, half: float) -> np.ndarray:
    """Straight distances along the crease when it is folded by twice ``half`` (radians)."""
    radius = 100.0 * np.cos(half)
    return 2.0 * radius * np.sin(0.5 * s / radius)


def ends(fold: Creased, f: float) -> np.ndarray:
    """The ends of all rulings at f, in the order of a mesh without thickness: (4 r, 3)."""
    every = zip(fold.motions(f), fold.strips, strict=True)
    return np.concatenate([moved(own, flat) for own, strip in every for flat in strip.pattern])


def lengths(points: np.ndarray, index: np.ndarray) -> np.ndarray:
    corner = points[index]
    return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)


@pytest.mark.parametrize("bend", [1.0, 0.4])
def test_the_crease_of_a_ring_is_the_circle_that_its_fold_angle_asks_for(bend: float) -> None:
    (panel,) = built("annulus", head=f"bend = {bend:g}\n").panels
    fold = creased(panel)
    on, s = scored(panel)
    for f in (0.0, 0.21, 0.5, 0.83, 1.0):
        space = ends(fold, f)
        assert len(space) == len(panel.mesh.vertices)
        found = np.linalg.norm(space[on] - space[on[0]], axis=1)
        # the polynomials through 9 poses are off by 2e-7 mm
        np.testing.assert_allclose(found, chords(s, np.radians(30.0 * bend * (1 - f))), atol=2e-6)


@pytest.mark.slow
def test_two_creases_fold_as_the_poses_do() -> None:
    """Rulings of a packet, whose creases fold more towards its ends, against its exact poses."""
    (panel,) = built("packet").panels
    fold = creased(panel)
    assert len(fold.strips) == 3
    exact = poses(panel, [0.7])[0].vertices
    a, b = (points[::7] for points in (ends(fold, 0.3), exact))
    apart = np.linalg.norm(a[:, None] - a, axis=2) - np.linalg.norm(b[:, None] - b, axis=2)
    assert np.abs(apart).max() < 1e-5


@pytest.mark.parametrize(
    ("name", "thickness"),
    [
        ("annulus", 0.0),
        pytest.param("packet", 0.0, marks=pytest.mark.slow),
        pytest.param("packet", 0.4, marks=pytest.mark.slow),
    ],
)
def test_a_folding_sheet_stays_whole_and_keeps_its_lengths(
    name: str, thickness: float, tmp_path: Path
) -> None:
    part = built(name, thickness)
    (panel,) = part.panels
    file = folding(part, tmp_path)
    mesh = panel.mesh
    _, first = np.unique(mesh.weld, return_index=True)
    for time in (0.0, 0.37, 1.1, 2.0, 3.9, 5.4):
        points, index = file.posed(0, time)
        size = float(np.abs(points).max())
        # what is one vertex of the sheet is so at every time, on both sides of a crease too
        assert np.abs(points - points[first][mesh.weld]).max() < 1e-6 * size
        if not thickness:  # skins stretch where a sheet bends
            change = np.abs(lengths(points, index) - lengths(mesh.vertices, index)).max()
            assert change < part.tolerance / 50  # chords of arcs, and the splines between keys
        if time == 2.0:
            assert np.abs(points - mesh.vertices).max() < 1e-6 * size
        if time in (0.0, 5.4):
            assert np.abs(points[:, :2] - mesh.flat).max() < 1e-6 * size
            assert np.abs(np.abs(points[:, 2]) - 0.5 * thickness).max() < 1e-6 * size


def test_half_way_the_ring_is_folded_by_half_its_angle(tmp_path: Path) -> None:
    part = built("annulus")
    on, s = scored(part.panels[0])
    at = folding(part, tmp_path).posed(0, 1.0)[0][on]
    found = np.linalg.norm(at - at[0], axis=1)
    np.testing.assert_allclose(found, chords(s, np.radians(15.0)), atol=1e-4)


def test_a_sheet_that_is_folded_less_goes_that_far(tmp_path: Path) -> None:
    part = built("annulus", head="bend = 0.4\n")
    on, s = scored(part.panels[0])
    file = folding(part, tmp_path)
    for time, degrees in ((0.0, 0.0), (2.0, 12.0)):
        at = file.posed(0, time)[0][on]
        found = np.linalg.norm(at - at[0], axis=1)
        np.testing.assert_allclose(found, chords(s, np.radians(degrees)), atol=1e-4)


@pytest.mark.slow
def test_a_hole_beside_a_crease_lies_in_the_sheet_all_the_way(tmp_path: Path) -> None:
    hole = '[[cutout]]\nshape = "circle"\ndiameter = 8\nat_surface = [0.5, 0.75]\n'
    job = tmp_path / "holed.toml"
    job.write_text(f'name = "holed"\nthickness = 1\n[surface]\n{CREASED["annulus"]}\n{hole}')
    part = devcad.build(job)
    (panel,) = part.panels
    flat = folding(part, tmp_path).posed(0, 0.0)[0]
    # between rulings a point hangs on both, as much as it is near: up to twice a facet's deviation
    assert np.abs(flat[:, :2] - panel.mesh.flat).max() < 2 * part.tolerance
    assert np.abs(np.abs(flat[:, 2]) - 0.5).max() < 2 * part.tolerance


def test_several_sheets_unroll_side_by_side(tmp_path: Path) -> None:
    part = built("annulus")
    twins = replace(part, panels=(part.panels[0], replace(part.panels[0], name="other")))
    file = folding(twins, tmp_path)
    one, other = file.posed(0, 0.0)[0], file.posed(1, 0.0)[0]
    step = np.array([*pattern_shifts(twins)[1], 0.0])
    np.testing.assert_allclose(other - one, np.broadcast_to(step, one.shape), atol=1e-4)
    assert len(file.tree["animations"]) == 1


def test_a_sheet_without_a_motion_stands_still(tmp_path: Path) -> None:
    part = built("stuck")
    assert any("no rigid-ruling motion" in note for note in part.panels[0].facts["notes"])
    assert "animations" not in folding(part, tmp_path).tree
    fold = creased(part.panels[0])
    assert not fold.moves
    assert "bend differently" in fold.why
    np.testing.assert_array_equal(fold.motions(0.7), fold.motions(0.0))


def test_more_keys_where_lengths_are_to_be_kept_better() -> None:
    """The splines are off by the fourth power of the step between keys."""
    (panel,) = built("annulus").panels
    rig = rig_of(panel, (0.0, 0.0), 0.05)
    assert rig is not None
    assert 3 <= len(rig.keys) <= 9
    few, many = (len(_key_states(rig.fold, panel, x)) - 1 for x in (1e-5, 1e-5 / 16**2))
    assert 3 * few <= many <= 5 * few


def test_a_motion_that_nobody_asked_for_gives_way_to_the_tolerance(tmp_path: Path) -> None:
    """Joints of 24 bits put points off by 1e-5 mm, which a tolerance of 1e-6 mm cannot bear."""
    part = built("annulus")
    (moving,) = glb.write(part, tmp_path, Options())
    assert "animations" in File(moving.path).tree and not moving.note
    (still,) = glb.write(replace(part, tolerance=moving.max_deviation), tmp_path, Options())
    assert "animations" in File(still.path).tree
    (still,) = glb.write(
        replace(part, tolerance=part.panels[0].mesh.deviation), tmp_path, Options()
    )
    assert "animations" not in File(still.path).tree
    assert still.note.startswith("stands still")
