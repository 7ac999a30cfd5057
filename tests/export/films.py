"""GLB files that pose themselves by the specification's own words, not by ours."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class File:
    """A GLB file that poses itself."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        size = int.from_bytes(content[12:16], "little")
        self.tree = json.loads(content[20 : 20 + size])
        self.data = content[28 + size :]

    def numbers(self, index: int) -> np.ndarray:
        table = self.tree["accessors"][index]
        view = self.tree["bufferViews"][table["bufferView"]]
        width = WIDTHS[table["type"]]
        kind = TYPES[table["componentType"]]
        found = np.frombuffer(self.data, kind, width * table["count"], view["byteOffset"])
        return found.reshape(-1, width).astype(float)

    def node(self, index: int, time: float) -> np.ndarray:
        """The local matrix of a node while the animation plays."""
        node = dict(self.tree["nodes"][index])
        (animation,) = self.tree["animations"]
        for channel in animation["channels"]:
            if channel["target"]["node"] == index:
                sampler = animation["samplers"][channel["sampler"]]
                path = channel["target"]["path"]
                times = self.numbers(sampler["input"])[:, 0]
                values = self.numbers(sampler["output"])
                k = int(np.clip(np.searchsorted(times, time) - 1, 0, len(times) - 2))
                span = times[k + 1] - times[k]
                share = (time - times[k]) / span
                if sampler["interpolation"] == "CUBICSPLINE":
                    node[path] = hermite(values.reshape(len(times), 3, -1), k, share, span)
                    if path == "rotation":
                        node[path] /= np.linalg.norm(node[path])
                    continue
                assert sampler["interpolation"] == "LINEAR"
                mix = slerp if path == "rotation" else line
                node[path] = mix(values[k], values[k + 1], share)
        x, y, z, w = node["rotation"]
        out = np.eye(4)
        out[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        out[:3, 3] = node["translation"]
        return out

    def posed(self, panel: int, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Points in mm (x, y, z as in the job) and triangles of a panel."""
        node = self.tree["nodes"][panel]
        (primitive,) = self.tree["meshes"][node["mesh"]]["primitives"]
        names = ("POSITION", "JOINTS_0", "WEIGHTS_0")
        points, joints, weights = (self.numbers(primitive["attributes"][name]) for name in names)
        skin = self.tree["skins"][node["skin"]]
        places = {skin["skeleton"]: self.node(skin["skeleton"], time)}
        left = [skin["skeleton"]]
        while left:
            parent = left.pop()
            for child in self.tree["nodes"][parent].get("children", []):
                places[child] = places[parent] @ self.node(child, time)
                left.append(child)
        binds = self.numbers(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        matrices = np.array([places[joint] for joint in skin["joints"]]) @ binds
        matrix = np.einsum("nk,nkij->nij", weights, matrices[joints.astype(int)])
        x, y, z = (np.einsum("nij,nj->ni", matrix[:, :3, :3], points) + matrix[:, :3, 3]).T * 1e3
        index = self.numbers(primitive["indices"])[:, 0].astype(int).reshape(-1, 3)
        return np.stack([x, -z, y], axis=1), index


def hermite(values: np.ndarray, k: int, t: float, span: float) -> np.ndarray:
    """Section C.5 of the specification: rows of in-tangent, value and out-tangent."""
    basis = np.array([[2, -3, 0, 1], [1, -2, 1, 0], [-2, 3, 0, 0], [1, -1, 0, 0]])
    one, out, other, into = basis @ [t**3, t**2, t, 1]
    return (
        one * values[k, 1]
        + span * out * values[k, 2]
        + other * values[k + 1, 1]
        + span * into * values[k + 1, 0]
    )


def line(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    return a + share * (b - a)


def slerp(a: np.ndarray, b: np.ndarray, share: float) -> np.ndarray:
    """Section C.4 of the specification."""
    dot = float(a @ b)
    angle = np.arccos(min(abs(dot), 1.0))
    if angle < 1e-9:
        return a + share * (np.sign(dot) * b - a)
    first = np.sin(angle * (1 - share)) / np.sin(angle)
    return first * a + np.sign(dot) * np.sin(angle * share) / np.sin(angle) * b
