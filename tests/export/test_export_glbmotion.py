"""Animated glTF: posed by the specification's own words (section 3.7.3 and 3.11), not by ours."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from films import File
from jobs import JOBS, built

import devcad
from devcad.export import Options, glb
from devcad.export.folding import pattern_shifts
from devcad.job.load import load
from devcad.part import Part
from devcad.pipeline import plan

FOLDING = Options(glb_animate=True)


def folding(part: Part, folder: Path) -> File:
    (written,) = glb.write(part, folder, FOLDING)
    return File(written.path)


@pytest.mark.parametrize("name", [name for name in JOBS if name != "drilled"])
def test_a_sheet_keeps_its_lengths_at_every_time(name: str, tmp_path: Path) -> None:
    file = folding(built(name), tmp_path)
    points, index = file.posed(0, 2.0)

    def lengths(at: np.ndarray) -> np.ndarray:
        corner = at[index]
        return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)

    for time in (0.0, 0.37, 1.1, 3.9):
        found = lengths(file.posed(0, time)[0])
        # single precision; with holes triangles may lie over a diagonal, within the tolerance
        limit = 0.05 if name == "horn" else 1e-4
        assert np.abs(found - lengths(points)).max() < limit


@pytest.mark.parametrize(("name", "thickness"), [("cone", 0.0), ("duct", 1.5), ("drilled", 2.0)])
def test_it_goes_from_the_pattern_to_the_part_and_back(
    name: str, thickness: float, tmp_path: Path
) -> None:
    part = built(name, thickness)
    (panel,) = part.panels
    file = folding(part, tmp_path)
    for time in (2.0, 2.6, 3.0):
        assert np.abs(file.posed(0, time)[0] - panel.mesh.vertices).max() < 1e-3
    for time in (0.0, 5.0, 6.0):
        flat = file.posed(0, time)[0]
        # skins stand half the thickness off, less what half a facet's turn takes of it
        assert np.abs(np.abs(flat[:, 2]) - 0.5 * thickness).max() < 2 * part.tolerance
        apart = np.linalg.norm(flat[:, :2] - panel.mesh.flat, axis=1)
        # the duct closes on a crease: its skins' first and last ends are mitred, flat or not
        mitre = 0.5 * thickness if name == "duct" else 0.0
        assert apart.max() < 2 * part.tolerance + mitre


def test_a_facet_turns_evenly_in_time(tmp_path: Path) -> None:
    """Rail points of a cylinder lie on a regular polygon whose turn falls with time."""
    file = folding(built("arc"), tmp_path)
    n = built("arc").panels[0].facts["ruling_count"] - 1
    theta = np.radians(200.0) / n
    chord = 2.0 * 40.0 * np.sin(0.5 * theta)
    for time in (0.5, 1.5, 4.0):
        bent = time / 2.0 if time < 2.0 else 1.0 - (time - 3.0) / 2.0
        rail = file.posed(0, time)[0][: n + 1]
        turn = 0.5 * theta * bent
        found = np.linalg.norm(rail[n] - rail[0])
        assert found == pytest.approx(chord * np.sin(n * turn) / np.sin(turn), abs=1e-3)


def test_a_half_turn_has_a_key_in_the_middle(tmp_path: Path) -> None:
    """A strip folded back on itself, but for half a degree, as a mesh may be that was imported."""
    part = built("duct")
    from devcad.export import glbmotion

    (skeleton,) = glbmotion.skeletons(part)
    assert skeleton is not None
    angles = skeleton.strip.angles * (2.0 * np.radians(179.5) / np.pi)
    strip = replace(skeleton.strip, angles=angles)
    steep = replace(skeleton, strip=strip, joints=glbmotion._joints(strip))
    document: dict[str, Any] = {
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [{"attributes": {}}]}],
        "accessors": [],
        "bufferViews": [],
        "buffers": [{}],
    }
    glbmotion.animated(document, [steep], 0)
    (animation,) = document["animations"]
    counts = {document["accessors"][s["input"]]["count"] for s in animation["samplers"]}
    assert counts == {5, 7}


def test_the_nodes_rest_as_built(tmp_path: Path) -> None:
    """Who plays no animation sees the part: the rest pose is the one at 2 s."""
    file = folding(built("helix"), tmp_path)
    for index, node in enumerate(file.tree["nodes"]):
        if "rotation" in node:
            x, y, z, w = node["rotation"]
            assert abs(x * x + y * y + z * z + w * w - 1.0) < 1e-12
            rest = file.node(index, 2.0)
            assert np.abs(rest[:3, 3] - node["translation"]).max() < 1e-7


def test_several_panels_unroll_side_by_side(tmp_path: Path) -> None:
    part = built("arc")
    twins = replace(part, panels=(part.panels[0], replace(part.panels[0], name="other")))
    file = folding(twins, tmp_path)
    one, other = file.posed(0, 0.0)[0], file.posed(1, 0.0)[0]
    step = np.array([*pattern_shifts(twins)[1], 0.0])
    np.testing.assert_allclose(other - one, np.broadcast_to(step, one.shape), atol=1e-4)
    assert len(file.tree["animations"]) == 1


def test_the_static_numbers_are_those_of_the_static_file(tmp_path: Path) -> None:
    (tmp_path / "still").mkdir()
    (still,) = glb.write(built("drilled", 2.0), tmp_path / "still", Options())
    moving, rest = folding(built("drilled", 2.0), tmp_path), File(still.path)
    assert moving.data.startswith(rest.data)
    assert "animations" not in rest.tree
    assert moving.tree["materials"] == rest.tree["materials"]


def test_equal_parts_give_equal_bytes(tmp_path: Path) -> None:
    files = [glb.write(built("duct", 1.5), tmp_path, FOLDING)[0].path.read_bytes() for _ in "ab"]
    assert files[0] == files[1]


def test_the_recipe_asks_for_it(tmp_path: Path) -> None:
    job = tmp_path / "lamp.toml"
    job.write_text(f'name = "lamp"\n[surface]\n{JOBS["arc"]}\n[recipe.glb]\nanimate = true\n')
    recipe = plan(load(job))
    assert recipe.options.glb_animate
    report = devcad.export(devcad.build(job), tmp_path, formats=["glb"], options=recipe.options)
    assert [check["name"] for check in report["checks"]].count("glb-readback") == 2
    assert File(tmp_path / "lamp" / "lamp.glb").tree["animations"][0]["name"] == "fold"
