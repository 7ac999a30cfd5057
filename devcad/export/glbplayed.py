"""Animated GLB files played back: where the joints that were read carry the points, and when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from devcad.checks import Check, at_most
from devcad.export.binary import FLOAT32_STEP
from devcad.export.glbmotion import KEYS, UP, Skeleton
from devcad.export.glbread import CHECK, Json, accessor
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import rotation
from devcad.units import METRES_PER_MM

if TYPE_CHECKING:
    from devcad.export.glbcrease import Rig

BETWEEN = 8.0
"""Roundings to float32 that the two ends of a line may have together."""


class Film:
    """The skin of a panel and what its joints do, as the file has it."""

    def __init__(self, stream: BinaryIO, start: int, document: Json, number: int) -> None:
        def read(index: int) -> Array:
            found = accessor(stream, start, document, index)
            return found.rows(slice(0, found.count)).astype(float)

        self.nodes = document["nodes"]
        self.skin = document["skins"][self.nodes[number]["skin"]]
        attributes = document["meshes"][number]["primitives"][0]["attributes"]
        self.points = read(attributes["POSITION"])
        self.bodies = read(attributes["JOINTS_0"]).astype(int)
        self.weights = read(attributes["WEIGHTS_0"])
        self.binds = read(self.skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        (animation,) = document["animations"]
        own = set(self.skin["joints"])
        self.channels = []
        for channel in animation["channels"]:
            node, path = channel["target"]["node"], channel["target"]["path"]
            if node in own:
                sampler = animation["samplers"][channel["sampler"]]
                values = read(sampler["output"])
                if sampler["interpolation"] == "CUBICSPLINE":
                    values = values.reshape(-1, 3, values.shape[1])
                self.channels.append((node, path, read(sampler["input"])[:, 0], values))

    def seen(self, time: float) -> Array:
        """The panel's points (n, 3), in metres, at a time in seconds."""
        joints = self._posed(time) @ self.binds
        out = np.zeros_like(self.points)
        for column in range(2):
            matrix = joints[self.bodies[:, column]]
            out += self.weights[:, column, None] * _applied(matrix, self.points)
        return out

    def _posed(self, time: float) -> Array:
        """The joints (b, 4, 4) at a time."""
        local = {node: dict(self.nodes[node]) for node in self.skin["joints"]}
        for node, path, times, values in self.channels:
            local[node][path] = _sampled(times, values, time, path).tolist()
        out: dict[int, Array] = {}
        left = [(self.skin["skeleton"], np.eye(4))]
        while left:
            node, parent = left.pop()
            out[node] = parent @ _matrix(local[node]["rotation"], local[node]["translation"])
            left += [(child, out[node]) for child in self.nodes[node].get("children", ())]
        return np.array([out[node] for node in self.skin["joints"]])


def folds(
    stream: BinaryIO, start: int, document: Json, number: int, skeleton: Skeleton | Rig
) -> list[Check]:
    """How far a panel's points are, in mm, from where they should be, flat and as built, when the
    animation that was read moves the joints that were read; and, where poses are exact at keys
    alone, by how much its lengths are others half way between two of them."""
    film = Film(stream, start, document, number)
    size = float(np.abs(film.points).max() / METRES_PER_MM)
    size += float(np.abs(skeleton.panel.mesh.flat).max())
    worst = max(
        float(np.linalg.norm(film.seen(time) / METRES_PER_MM - _true(skeleton, f), axis=1).max())
        for time, f in KEYS[:2]
    )
    checks = [
        at_most(
            CHECK,
            skeleton.panel.name,
            worst,
            FLOAT32_STEP * size * len(film.binds),
            "mm",
            says=f"the animation leaves points up to {worst:.3g} mm from their places",
        )
    ]
    if skeleton.between:
        worst = max(
            float(np.abs(_lengths(skeleton, film.seen(time)) - _lengths(skeleton, true)).max())
            / METRES_PER_MM
            for time, true in (
                (time, _true(skeleton, f) * METRES_PER_MM) for time, f in skeleton.between
            )
        )
        checks.append(
            at_most(
                CHECK,
                skeleton.panel.name,
                worst,
                skeleton.stretch + BETWEEN * FLOAT32_STEP * size,
                "mm",
                says=f"between its keys the animation changes lengths by up to {worst:.3g} mm",
            )
        )
    return checks


def _true(skeleton: Skeleton | Rig, f: float) -> Array:
    """Where the points should be at f, (n, 3) in mm, Y up."""
    built, exact = skeleton.carried(0.0), skeleton.carried(f)
    vertices = skeleton.panel.mesh.vertices
    out = np.zeros_like(vertices)
    for body, weight in zip(skeleton.bodies.T, skeleton.weights.T, strict=True):
        flat = np.einsum("nji,nj->ni", built[body, :, :3], vertices - built[body, :, 3])
        out += weight[:, None] * _applied(exact[body], flat)
    return np.asarray(out @ UP.T)


def _lengths(skeleton: Skeleton | Rig, points: Array) -> Array:
    """The lengths of the sides of a panel's triangles."""
    corner = points[skeleton.panel.mesh.triangles]
    return np.asarray(np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2))


def _sampled(times: Array, values: Array, time: float, path: str) -> Array:
    """A joint's place or turn at a time: of cubic splines (k, 3, d), else between values (k, d).

    Source: Khronos, glTF 2.0 Specification, appendix C.
    """
    k = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    step = float(times[k + 1] - times[k])
    s = min(max((time - float(times[k])) / step, 0.0), 1.0)
    if values.ndim == 2:
        one, other = values[k], values[k + 1]
        return _slerp(one, other, s) if path == "rotation" else one + s * (other - one)
    hermite = (
        (2.0 * s**3 - 3.0 * s**2 + 1.0) * values[k, 1]
        + step * (s**3 - 2.0 * s**2 + s) * values[k, 2]
        + (3.0 * s**2 - 2.0 * s**3) * values[k + 1, 1]
        + step * (s**3 - s**2) * values[k + 1, 0]
    )
    return np.asarray(hermite / np.linalg.norm(hermite) if path == "rotation" else hermite)


def _slerp(one: Array, other: Array, s: float) -> Array:
    dot = float(one @ other)
    other, angle = np.copysign(1.0, dot) * other, math.acos(min(abs(dot), 1.0))
    if angle < 1e-9:
        return one + s * (other - one)
    return np.asarray(
        (math.sin((1.0 - s) * angle) * one + math.sin(s * angle) * other) / math.sin(angle)
    )


def _matrix(quaternion: Sequence[float], place: Sequence[float]) -> Array:
    """A node's matrix (4, 4)."""
    vector, w = np.array(quaternion[:3]), quaternion[3]
    length = float(np.linalg.norm(vector))
    out = np.eye(4)
    out[:3, :3] = rotation(vector * (2.0 * math.atan2(length, w) / length if length else 0.0))
    out[:3, 3] = place
    return out


def _applied(motion: Array, points: Array) -> Array:
    """Points (n, 3), each moved by its own motion (n, 3 or 4, 4)."""
    return np.asarray(np.einsum("nij,nj->ni", motion[:, :3, :3], points) + motion[:, :3, 3])
