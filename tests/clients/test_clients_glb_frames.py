"""glTF of simulations: the validator has nothing to say, and three.js folds the sheet."""

from __future__ import annotations

import csv
from pathlib import Path

import clients
import numpy as np
import pytest

from devcad.folding import fold_job
from devcad.job.load import load

pytestmark = pytest.mark.clients

TABLE = "\n[simulate]\nthickness = 0.3\nyoungs = 3000\npoisson = 0.3\nsteps = 6\nmodes = 0\n"
PULLED = (
    'supports = [{ edge = "start", clamp = true }]\n'
    'loads = [{ edge = "end", force = [0, 0, 0.05] }]\n'
)
JOBS = {"folded-annulus": TABLE, "lens-packet": TABLE, "nameplate": TABLE + PULLED}


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, clients.Facts]]:
    """What the clients see of the animations, by sample."""
    out = tmp_path_factory.mktemp("frames")
    paths = {}
    for name, table in JOBS.items():
        job = out / f"{name}.toml"
        sample = (clients.REPOSITORY / "samples" / f"{name}.toml").read_text()
        job.write_text(sample.split("\n[simulate]")[0] + table)
        fold_job(load(job), out)
        paths[name] = out / name / f"{name}-fold.glb"
    seen = clients.node(list(paths.values()), out / "answer.json")
    return {name: (path, seen[str(path)]) for name, path in paths.items()}


@pytest.mark.parametrize("name", JOBS)
def test_the_khronos_validator_finds_nothing(
    name: str, found: dict[str, tuple[Path, clients.Facts]]
) -> None:
    _, seen = found[name]
    assert "error" not in seen, seen.get("error")
    assert seen["issues"] == {"errors": 0, "warnings": 0, "hints": 0}, seen["messages"]


@pytest.mark.parametrize("name", JOBS)
def test_three_shows_the_first_step_first(
    name: str, found: dict[str, tuple[Path, clients.Facts]]
) -> None:
    """At 0 s every node of the table is where the first step has it, and the file rests as the
    last step."""
    path, seen = found[name]
    with path.with_name(f"{name}-fold-nodes.csv").open(newline="") as stream:
        rows = [[float(row[key]) for key in ("step", *"xyz")] for row in csv.DictReader(stream)]
    table = np.array(rows)
    (mesh,) = seen["meshes"]
    pose = seen["poses"][0]["meshes"][mesh["name"]]
    for shown, step in ((pose, 0.0), (mesh["position"], table[:, 0].max())):
        points = 1e3 * np.array(shown).reshape(-1, 3)[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
        nodes = table[table[:, 0] == step, 1:]
        near = np.linalg.norm(points[:, None] - nodes, axis=2).min(axis=1)
        assert near.max() < 1e-6 * np.abs(nodes).max() + 1e-6
