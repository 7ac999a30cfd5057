"""Frames in glTF: posed by the words of the specification (3.7.2.2 and 3.11), not by ours."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from devcad.errors import CheckFailed
from devcad.export import glbframes
from devcad.export.glbframes import Moving, write_frames

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
KEYS = [(0.0, 0), (1.0, 1), (2.5, 2), (3.5, 2)]


def arch(height: float) -> np.ndarray:
    """A strip of 5 x 2 points, 40 mm long and far from the origin, bent into a parabola."""
    x = np.repeat(np.linspace(0.0, 40.0, 5), 2)
    y = np.tile([0.0, 10.0], 5)
    return np.stack([x + 300.0, y - 70.0, height * x * (40.0 - x) / 400.0], axis=1)


def strip() -> Moving:
    rows = np.arange(0, 8, 2)[:, None]
    triangles = np.concatenate([rows + np.array([0, 2, 3]), rows + np.array([0, 3, 1])])
    frames = np.stack([arch(height) for height in (0.0, 3.0, -8.0)])
    return Moving("strip", frames, triangles, frames[0, :, :2], {"thickness": 0.5})


def posed(path: Path, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions in mm and normals of the first mesh at a time, Z up again."""
    content = path.read_bytes()
    size = int.from_bytes(content[12:16], "little")
    tree, data = json.loads(content[20 : 20 + size]), content[28 + size :]

    def numbers(index: int) -> np.ndarray:
        table = tree["accessors"][index]
        start = tree["bufferViews"][table["bufferView"]]["byteOffset"]
        count = WIDTHS[table["type"]] * table["count"]
        found = np.frombuffer(data, TYPES[table["componentType"]], count, start)
        return found.reshape(table["count"], -1).astype(float)

    (channel,), (sampler,) = (tree["animations"][0][key] for key in ("channels", "samplers"))
    assert channel["target"] == {"node": 0, "path": "weights"}
    assert sampler["interpolation"] == "LINEAR"
    (primitive,) = tree["meshes"][0]["primitives"]
    times = numbers(sampler["input"])[:, 0]
    weights = numbers(sampler["output"]).reshape(len(times), -1)
    now = [np.interp(time, times, column) for column in weights.T]
    out = []
    for name in ("POSITION", "NORMAL"):
        moves = [numbers(target[name]) for target in primitive["targets"]]
        base = numbers(primitive["attributes"][name])
        out.append(base + sum(w * move for w, move in zip(now, moves, strict=True)))
    back = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # (x, z, -y) -> x, y, z
    return 1e3 * out[0] @ back.T, out[1] @ back.T


def test_every_key_shows_its_frame_and_between_them_points_go_straight(tmp_path: Path) -> None:
    mesh = strip()
    written = write_frames(tmp_path / "a.glb", [mesh], KEYS, rest=2, colour=(0.5, 0.5, 0.5))
    near = 300.0 * 2.0**-22  # float32, a position and a difference
    for time, frame in KEYS:
        seen, normals = posed(written.path, time)
        assert seen == pytest.approx(mesh.frames[frame], abs=near)
        assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-6)
        slopes = -np.gradient(mesh.frames[frame][::2, 2], 10.0)[1:-1]
        # of the three triangles at a point two lie on one side of it: a sixth of the bend there
        assert normals[2:-2:2, 0] / normals[2:-2:2, 2] == pytest.approx(slopes, abs=0.4 / 5.0)
    half, _ = posed(written.path, 1.75)
    assert half == pytest.approx(0.5 * (mesh.frames[1] + mesh.frames[2]), abs=near)
    assert written.max_deviation < near


def test_the_file_rests_as_the_frame_that_was_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    write_frames(path, [strip()], KEYS, rest=1, colour=(0.5, 0.5, 0.5))
    content = path.read_bytes()
    tree = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    place = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    low, high = np.array(place["min"]), np.array(place["max"])
    assert 1e3 * (high - low)[[0, 1, 2]] == pytest.approx([40.0, 3.0, 10.0], abs=1e-3)
    assert tree["meshes"][0]["weights"] == [0.0, 0.0]
    assert tree["nodes"][0]["extras"]["thickness"] == 0.5
    assert tree["extras"]["mm_per_uv"] == 40.0


def test_equal_frames_are_equal_bytes(tmp_path: Path) -> None:
    files = [
        write_frames(tmp_path / name, [strip()], KEYS, rest=0, colour=(0.1, 0.2, 0.3)).path
        for name in ("a.glb", "b.glb")
    ]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_file_that_holds_other_frames_is_found_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = glbframes._placed
    calls: list[int] = []

    def bent(frames: np.ndarray) -> np.ndarray:
        calls.append(1)
        return true(frames + (1e-3 if len(calls) == 1 else 0.0))

    monkeypatch.setattr(glbframes, "_placed", bent)
    with pytest.raises(CheckFailed, match="glb-readback"):
        write_frames(tmp_path / "a.glb", [strip()], KEYS, rest=0, colour=(0.5, 0.5, 0.5))
