"""Mechanisms as animated glTF: the validator has nothing to say, and three.js moves rigid links."""

from __future__ import annotations

import clients
import numpy as np
import pytest

import devcad
from devcad.export import Options
from devcad.export.glb import write
from devcad.part import Part

pytestmark = pytest.mark.clients

SAMPLES = ("tube-fourbar", "gripper", "eight-link-ring")

Found = dict[str, tuple[Part, clients.Facts]]


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    """What the clients see of the animated files, by sample."""
    out = tmp_path_factory.mktemp("mechanism")
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
def test_three_moves_rigid_links_about_their_axes(name: str, found: Found) -> None:
    part, seen = found[name]
    (linkage,) = part.linkages
    moved = 0.0
    for pose in seen["poses"]:
        carried = []
        for mesh in seen["meshes"]:
            rest = 1e3 * np.array(mesh["position"]).reshape(-1, 3)
            here = 1e3 * np.array(pose["meshes"][mesh["name"]]).reshape(-1, 3)
            a, b = rest.mean(axis=0), here.mean(axis=0)
            u, _, v = np.linalg.svd((rest - a).T @ (here - b))
            turn = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v).T
            assert np.abs((rest - a) @ turn.T + b - here).max() < 1e-4
            moved = max(moved, float(np.abs(here - rest).max()))
            carried.append((turn, a, b))
        for k, angle in enumerate(linkage.joints):  # y up: (x, y, z) -> (x, z, -y)
            x, y = linkage.radius * np.cos(angle), linkage.radius * np.sin(angle)
            ends = [
                (np.array([x, 0.0, -y]) - a) @ turn.T + b
                for turn, a, b in (carried[k], carried[k - 1])
            ]
            assert np.linalg.norm(ends[1] - ends[0]) < part.tolerance
    assert moved > 0.5 * linkage.radius
