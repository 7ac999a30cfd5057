"""Hinged strips: lengths are kept at every position; the ends are the part and its pattern."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from jobs import JOBS, built

import devcad
from devcad.export.folding import strip_of
from devcad.mesh.hinged import Hinged, motions, moved, rotation, turning

SAMPLES = sorted((Path(__file__).parents[2] / "samples").glob("*.toml"))


def corners(strip: Hinged, f: float) -> np.ndarray:
    """The corners (m, 3, 3) of the triangles, each carried by its own body."""
    flat = strip.flat.reshape(-1, 2)[strip.triangles]
    motion = np.repeat(motions(strip, f)[strip.body], 3, axis=0)
    return moved(motion, flat.reshape(-1, 2)).reshape(-1, 3, 3)


def lengths(corner: np.ndarray) -> np.ndarray:
    return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)


def holds(strip: Hinged) -> None:
    """What is true of every strip; 1e-9 of the size is a thousand bodies' rounding, and more than
    hinges below 1e-9 rad that were taken for none."""
    built_corners = strip.space.reshape(-1, 3)[strip.triangles]
    size = np.linalg.norm(np.ptp(strip.space.reshape(-1, 3), axis=0))
    assert np.abs(corners(strip, 0.0) - built_corners).max() < 1e-9 * size
    for f in (0.3, 0.7, 1.0):
        found = corners(strip, f)
        assert np.abs(lengths(found) - lengths(built_corners)).max() < 1e-12 * size
        place = strip.triangles.ravel()
        order = np.argsort(place, kind="stable")
        same = np.diff(place[order]) == 0  # one point of two bodies is in one place
        apart = np.abs(np.diff(found.reshape(-1, 3)[order], axis=0))[same]
        assert apart.max(initial=0.0) < 1e-9 * size
    assert np.abs(corners(strip, 1.0)[..., 2]).max() < 1e-12 * size


@pytest.mark.parametrize("name", JOBS)
def test_lengths_are_kept_from_the_part_to_its_pattern(name: str) -> None:
    (panel,) = built(name).panels
    strip = strip_of(panel)
    assert strip is not None
    holds(strip)
    # chords are shorter than arcs: by less than the tolerance over all of such a strip
    assert np.abs(strip.flat - strip.pattern).max() < built(name).tolerance


@pytest.mark.slow
@pytest.mark.parametrize("path", SAMPLES, ids=[path.stem for path in SAMPLES])
def test_every_sample_folds_and_keeps_its_lengths(path: Path) -> None:
    part = devcad.build(path)
    for panel in (flank for sheet in part.panels for flank in sheet.chains):
        strip = strip_of(panel)
        assert strip is not None
        holds(strip)
        if panel.facts["k_neutral"] is None:  # a neutral fibre makes the pattern another
            assert np.abs(strip.flat - strip.pattern).max() < 2.0 * part.tolerance


@pytest.mark.parametrize("name", ["arc", "cone", "helix", "duct"])
def test_the_strip_is_the_mesh_of_a_sheet_without_thickness(name: str) -> None:
    (panel,) = built(name).panels
    strip = strip_of(panel)
    assert strip is not None
    mine = np.sort(strip.space.reshape(-1, 3)[strip.triangles].reshape(-1, 9), axis=0)
    theirs = np.sort(panel.mesh.vertices[panel.mesh.triangles].reshape(-1, 9), axis=0)
    assert mine.shape == theirs.shape
    np.testing.assert_allclose(
        mine, theirs, rtol=0.0, atol=1e-10
    )  # mm; the mesh shares seam points


@pytest.mark.parametrize("f", [0.0, 0.25, 0.6, 0.95])
def test_facets_of_a_cylinder_stay_a_regular_polygon(f: float) -> None:
    """Chords c at equal turns theta: rail points k apart are c sin(k theta/2) / sin(theta/2)."""
    (panel,) = built("arc").panels
    strip = strip_of(panel)
    assert strip is not None
    n = strip.rulings - 1
    theta = np.radians(200.0) / n
    chord = 2.0 * 40.0 * np.sin(0.5 * theta)
    motion = motions(strip, f)
    rail = moved(motion[strip.beside()[1]], strip.flat[0])
    turn = 0.5 * theta * (1.0 - f)
    for k in (1, n // 3, n):
        found = np.linalg.norm(rail[k:] - rail[:-k], axis=1)
        np.testing.assert_allclose(found, chord * np.sin(k * turn) / np.sin(turn), rtol=1e-12)


def test_creases_are_told_and_turn_by_their_angle() -> None:
    (panel,) = built("duct").panels
    strip = strip_of(panel)
    assert strip is not None
    assert strip.creased.tolist() == [False, True, True, True, False]
    assert len(strip.angles) == 3  # planes between them: nothing else bends
    np.testing.assert_allclose(np.abs(strip.angles), 0.5 * np.pi, rtol=1e-12)


def test_panels_side_by_side_do_not_meet() -> None:
    strip = strip_of(built("cone").panels[0])
    assert strip is not None
    near = motions(strip, 1.0)[0]
    far = motions(strip, 1.0, (100.0, -7.0))[0]
    np.testing.assert_allclose(far[:, 3] - near[:, 3], [100.0, -7.0, 0.0], atol=1e-10)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1.0, 3.0, np.pi - 1e-8, np.pi])
@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 0, -1], [0.6, -0.8, 0], [-0.36, 0.48, 0.8]])
def test_a_turn_is_found_again_in_its_matrix(axis: list[float], angle: float) -> None:
    turn = angle * np.array(axis, dtype=float)
    found = turning(rotation(turn))
    # half a turn has two axes: the matrix tells it all
    np.testing.assert_allclose(rotation(found), rotation(turn), atol=1e-15 + 1e-14)
    assert np.linalg.norm(found) == pytest.approx(angle, abs=2e-8)
