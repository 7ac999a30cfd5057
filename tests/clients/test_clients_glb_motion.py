"""Animated glTF: the validator has nothing to say, and three.js keeps every length."""

from __future__ import annotations

import clients
import numpy as np
import pytest

import devcad
from devcad.export import Options
from devcad.export.glb import write
from devcad.part import Part

pytestmark = pytest.mark.clients

SAMPLES = (
    "lampshade",
    "vent-cowl",
    "hull-strips",
    "square-duct",
    "rolling-oloid",
    "nameplate",
    "folded-annulus",
    "lens-packet",
    "crease-lamp",
)

Found = dict[str, tuple[Part, clients.Facts]]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """What the clients see of the animated files, by sample."""
    out = tmp_path_factory.mktemp("motion")
    parts = {
        name: devcad.build(clients.REPOSITORY / "samples" / f"{name}.toml") for name in SAMPLES
    }
    paths = {
        name: write(part, out, Options(glb_animate=True))[0].path for name, part in parts.items()
    }
    seen = clients.node(list(paths.values()), out / "answer.json")
    return {name: (parts[name], seen[str(path)]) for name, path in paths.items()}


@pytest.mark.parametrize("name", SAMPLES)
def test_the_khronos_validator_finds_nothing(name: str, found: Found) -> None:
    _, seen = found[name]
    assert "error" not in seen, seen.get("error")
    assert seen["issues"] == {"errors": 0, "warnings": 0, "hints": 0}, seen["messages"]


@pytest.mark.parametrize("name", SAMPLES)
def test_three_bends_the_part_at_true_lengths(name: str, found: Found) -> None:
    part, seen = found[name]
    assert seen["poses"][0]["time"] == 0
    for mesh, panel in zip(seen["meshes"], part.panels, strict=True):
        index = np.array(mesh["index"]).reshape(-1, 3)
        built = 1e3 * np.array(mesh["position"]).reshape(-1, 3)

        def lengths(points: np.ndarray, index: np.ndarray = index) -> np.ndarray:
            corner = points[index]
            return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)

        size = float(np.abs(built).max())
        # the skins of a thick sheet stretch where it bends: by half the thickness at each turn
        stretch = part.thickness + part.tolerance if part.thickness else 1e-6 * size
        if panel.flanks and not part.thickness:
            stretch = part.tolerance / 50  # chords of arcs, and the splines between keys
        for pose in seen["poses"]:
            points = 1e3 * np.array(pose["meshes"][mesh["name"]]).reshape(-1, 3)
            assert np.abs(lengths(points) - lengths(built)).max() < stretch
            if 2.0 <= pose["time"] <= 3.0:
                assert np.abs(points - built).max() < 1e-6 * size
            if pose["time"] == 0.0:
                assert abs(np.ptp(points[:, 1]) - part.thickness) < 2e-6 * size + part.tolerance
                flat = np.sort(panel.mesh.flat, axis=0)
                moved = np.sort(points[:, [0, 2]] * [1.0, -1.0], axis=0)
                shift = (moved - flat).mean(axis=0)
                assert np.abs(moved - flat - shift).max() < part.thickness + 2 * part.tolerance
