"""Writing and reading back 2e6 triangles, as a ratio to a raw write of the same bytes."""

from __future__ import annotations

import time

import numpy as np
import pytest

from devcad.export import Options, glb, stl
from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import Chain
from devcad.mesh.mesh import Mesh
from devcad.part import Panel, Part

pytestmark = pytest.mark.bench

STEPS = 1000  # a grid of 1000 x 1000 quads: 2e6 triangles, 1e6 vertices
RADIUS, HEIGHT = 100.0, 80.0
REPEATS = 15
clock = time.process_time  # user and kernel: neither waits, and a busy machine does not count


@pytest.fixture(scope="module")
def part():
    t, v = np.meshgrid(
        np.linspace(0.0, 6.0, STEPS + 1), np.linspace(0.0, HEIGHT, STEPS + 1), indexing="ij"
    )
    t, v = t.ravel(), v.ravel()
    normals = np.stack([-np.cos(t), -np.sin(t), np.zeros_like(t)], axis=-1)
    vertices = np.stack([RADIUS * np.cos(t), RADIUS * np.sin(t), v], axis=-1)
    i = np.arange((STEPS + 1) ** 2).reshape(STEPS + 1, -1)[:-1, :-1].ravel()
    j = i + STEPS + 1
    triangles = np.stack([i, i + 1, j + 1, i, j + 1, j], axis=-1).reshape(-1, 3).astype(np.int32)
    weld = np.arange(len(t), dtype=np.int32)
    mesh = Mesh(vertices, normals, np.stack([v, RADIUS * t], axis=-1), triangles, weld, False, 0.0)
    pattern = Pattern((), (), 6.0 * RADIUS * HEIGHT, (0.0, 0.0, HEIGHT, 6.0 * RADIUS))
    panel = Panel("big", "cylinder", Chain((), ()), (), 0.0, (), mesh, pattern)
    return Part("big", (panel,), 0.0, 0.05, ())


def ratio(write, part, folder):
    """Best time of ``write`` (its read-back included) over the best time of writing its bytes."""
    (written,) = write(part, folder, Options())
    content = written.path.read_bytes()
    (folder / "raw").write_bytes(content)  # from here on both replace a file that is there
    raw, ours = [], []
    for _ in range(REPEATS):  # in turn: what slows the machine slows both
        start = clock()
        (folder / "raw").write_bytes(content)
        raw.append(clock() - start)
        start = clock()
        write(part, folder, Options())
        ours.append(clock() - start)
    return min(ours) / min(raw), content


def test_stl_of_two_million_triangles_takes_at_most_eight_raw_writes(part, tmp_path):
    mesh = part.panels[0].mesh
    factor, content = ratio(stl.write, part, tmp_path)
    assert len(content) == 84 + 50 * len(mesh.triangles) == 84 + 50 * 2 * STEPS**2
    some = np.linspace(0, len(mesh.triangles) - 1, 997).astype(int)
    corners = np.frombuffer(content, stl.RECORD, offset=84)["corners"][some]
    assert np.array_equal(corners, mesh.vertices.astype(np.float32)[mesh.triangles[some]])
    assert factor <= 8.0


def test_glb_of_two_million_triangles_takes_at_most_five_raw_writes(part, tmp_path):
    mesh = part.panels[0].mesh
    factor, content = ratio(glb.write, part, tmp_path)
    indices = np.frombuffer(content[-mesh.triangles.nbytes :], "<u4")  # the last buffer view
    assert np.array_equal(indices, mesh.triangles.ravel())
    assert factor <= 5.0
