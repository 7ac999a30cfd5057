"""glTF that folds: a skeleton a panel, whose joints turn about the rulings, and one animation.

The static file stays what it is; nodes, skins and an animation come behind. Every rigid facet of
the panel's strip is a joint, the next one its child, from the one in the middle outwards. A joint
turns about a line that does not move in its parent, by an angle that grows evenly: so LINEAR
interpolation is exact at every time, and every pose is isometric. The nodes rest as built. The
animation "fold" takes 6 s: flat, built after 2 s, at rest until 3 s, flat again at 5 s and to the
end. Flat, the panels lie side by side in their pattern's coordinates, X to the right and Y away
from the viewer who looks along the ground.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import BinaryIO

import numpy as np

from devcad.checks import Check, at_most
from devcad.export.binary import FLOAT32_STEP
from devcad.export.folding import pattern_shifts, strip_of
from devcad.export.glbread import CHECK, Json, accessor
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers, motions, rotation, turning
from devcad.mesh.lodged import carriers
from devcad.part import Panel, Part
from devcad.units import METRES_PER_MM

VERTEX_TARGET = 34962
FLOAT, SHORT = 5126, 5123
KEYS = ((0.0, 1.0), (2.0, 0.0), (3.0, 0.0), (5.0, 1.0), (6.0, 1.0))
"""Seconds and how far the part is unrolled then."""
STEEP = 3.0
"""Radians: from there on a turn has keys in the middle, for half a turn could go either way."""
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # (x, y, z) -> (x, z, -y)


@dataclass(frozen=True, slots=True)
class Joint:
    """A body of a strip as a joint: its parent's number (None for the root), its place in the
    parent and the turn against it as built, in glTF's metres and axes."""

    parent: int | None
    place: Array
    turn: Array


@dataclass(frozen=True, slots=True)
class Skeleton:
    """How a panel folds: its strip, where its pattern lies flat, its joints, and which two of them
    carry each point of its mesh and how much."""

    panel: Panel
    strip: Hinged
    shift: tuple[float, float]
    joints: tuple[Joint, ...]
    bodies: Numbers
    weights: Array


def skeletons(part: Part) -> list[Skeleton | None]:
    """Of every panel its skeleton; None where it is known by its pattern alone: it stands still."""
    out: list[Skeleton | None] = []
    for panel, shift in zip(part.panels, pattern_shifts(part), strict=True):
        strip = strip_of(panel)
        if strip is None:
            out.append(None)
            continue
        bodies, weights = carriers(strip, panel.mesh)
        out.append(Skeleton(panel, strip, shift, _joints(strip), bodies, weights))
    return out


def animated(document: Json, bones: list[Skeleton | None], size: int) -> bytes:
    """Add skeletons, skins and the animation to the document of a static file whose first nodes
    and meshes are the panels; the bytes that come behind the ``size`` bytes there are."""
    tail = _Tail(document, size)
    nodes = document["nodes"]
    skins: list[Json] = []
    channels: list[Json] = []
    samplers: list[Json] = []
    for number, skeleton in enumerate(bones):
        if skeleton is None:
            continue
        strip, first = skeleton.strip, len(nodes)
        nodes += _nodes(skeleton.joints, first, skeleton.panel.name)
        root = first + strip.anchor
        document["scenes"][0]["nodes"].append(root)
        attributes = document["meshes"][number]["primitives"][0]["attributes"]
        four = np.zeros((2, len(skeleton.bodies), 4))
        four[:, :, :2] = skeleton.bodies, skeleton.weights
        attributes["JOINTS_0"] = tail.add(four[0], SHORT, "VEC4", VERTEX_TARGET)
        attributes["WEIGHTS_0"] = tail.add(four[1], FLOAT, "VEC4", VERTEX_TARGET)
        nodes[number]["skin"] = len(skins)
        skins.append(
            {
                "inverseBindMatrices": tail.add(_inverse_binds(strip), FLOAT, "MAT4"),
                "skeleton": root,
                "joints": list(range(first, first + len(skeleton.joints))),
            }
        )
        path = np.array([_path(strip, skeleton.shift, f) for _, f in KEYS])
        samplers.append(tail.sampler(tail.times(), path, "VEC3"))
        channels.append(_channel(samplers, root, "translation"))
        for k, joint in enumerate(skeleton.joints):
            steep = float(np.linalg.norm(joint.turn)) > STEEP
            turns = np.array([_quaternion(joint.turn * (1.0 - f)) for _, f in _keys(steep)])
            samplers.append(tail.sampler(tail.times(steep=steep), turns, "VEC4"))
            channels.append(_channel(samplers, first + k, "rotation"))
    if skins:
        document["skins"] = skins
        document["animations"] = [{"name": "fold", "channels": channels, "samplers": samplers}]
        document["buffers"][0]["byteLength"] = size + len(tail.data)
    return bytes(tail.data)


# --- the skeleton --------------------------------------------------------------------------


def _joints(strip: Hinged) -> tuple[Joint, ...]:
    """A joint for every body, in their order; its frame is the flat strip's, moved to the start of
    the hinge to its parent, so that its turn is about the origin."""
    along = strip.hinges[:, 1] - strip.hinges[:, 0]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    out = []
    for k in range(len(strip.angles) + 1):
        if k == strip.anchor:
            start = motions(strip, 0.0)[k] @ np.array([*strip.pivot, 0.0, 1.0])
            out.append(Joint(None, _metres(start), UP @ turning(strip.built[:, :3])))
            continue
        parent, hinge, sign = (k - 1, k - 1, 1.0) if k > strip.anchor else (k + 1, k, -1.0)
        step = _origin(strip, k) - _origin(strip, parent)
        turn = np.append(along[hinge], 0.0) * (sign * strip.angles[hinge])
        out.append(Joint(parent, _metres(np.append(step, 0.0)), UP @ turn))
    return tuple(out)


def _origin(strip: Hinged, k: int) -> Array:
    """Where a body's joint is in the flat strip, (2,)."""
    if k == strip.anchor:
        return strip.pivot
    return np.asarray(strip.hinges[k - 1 if k > strip.anchor else k, 0])


def _nodes(joints: Sequence[Joint], first: int, name: str) -> list[Json]:
    """The joints as nodes that rest as built."""
    nodes: list[Json] = [
        {
            "name": f"{name} facet {k + 1}",
            "translation": joint.place.tolist(),
            "rotation": _quaternion(joint.turn),
        }
        for k, joint in enumerate(joints)
    ]
    for k, joint in enumerate(joints):
        if joint.parent is not None:
            nodes[joint.parent].setdefault("children", []).append(first + k)
    return nodes


def _inverse_binds(strip: Hinged) -> Array:
    """What brings points as built into the frames of the joints, (b, 16), column by column."""
    built = motions(strip, 0.0)
    origins = np.array([_origin(strip, k) for k in range(len(built))])
    places = np.einsum("bij,bj->bi", built[:, :, :2], origins) + built[:, :, 3]
    turns = UP @ built[:, :, :3] @ UP.T
    out = np.zeros((len(built), 4, 4))
    out[:, :3, :3] = turns.swapaxes(1, 2)
    out[:, :3, 3] = -np.einsum("bji,bj->bi", turns, places @ UP.T * METRES_PER_MM)
    out[:, 3, 3] = 1.0
    return out.swapaxes(1, 2).reshape(-1, 16)


def _path(strip: Hinged, shift: tuple[float, float], f: float) -> Array:
    """Where the root is at f."""
    motion = motions(strip, f, shift)[strip.anchor]
    return _metres(motion @ np.array([*strip.pivot, 0.0, 1.0]))


def _metres(point: Array) -> Array:
    """A point or a step in mm as glTF has it; no zero is negative."""
    return UP @ point * METRES_PER_MM + 0.0


def _quaternion(turn: Array) -> list[float]:
    """A turn about a vector by its length as x, y, z, w."""
    angle = math.sqrt(float(turn @ turn))
    share = math.sin(0.5 * angle) / angle if angle else 0.5
    return [*(turn * share + 0.0).tolist(), math.cos(0.5 * angle)]


# --- the animation -------------------------------------------------------------------------


class _Tail:
    """Accessors added to a document, and their bytes."""

    def __init__(self, document: Json, size: int) -> None:
        self.document, self.size, self.data = document, size, bytearray()
        self._times: dict[bool, int] = {}

    def add(self, values: Array, kind: int, shape: str, target: int | None = None) -> int:
        """The number of a new accessor that holds the values, one row an element."""
        raw = np.ascontiguousarray(values, "<f4" if kind == FLOAT else "<u2").tobytes()
        view: Json = {
            "buffer": 0,
            "byteOffset": self.size + len(self.data),
            "byteLength": len(raw),
        }
        if target is not None:
            view["target"] = target
        self.data += raw + bytes(-len(raw) % 4)
        views, tables = self.document["bufferViews"], self.document["accessors"]
        views.append(view)
        table: Json = {
            "bufferView": len(views) - 1,
            "componentType": kind,
            "count": len(values),
            "type": shape,
        }
        tables.append(table)
        return len(tables) - 1

    def times(self, *, steep: bool = False) -> int:
        """The accessor of the key times; there are more of them for steep turns."""
        if steep not in self._times:
            times = np.array([time for time, _ in _keys(steep)])
            number = self.add(times, FLOAT, "SCALAR")
            ends = {"min": [float(times[0])], "max": [float(times[-1])]}
            self.document["accessors"][number] |= ends
            self._times[steep] = number
        return self._times[steep]

    def sampler(self, times: int, values: Array, shape: str) -> Json:
        """A sampler between these values."""
        return {"input": times, "interpolation": "LINEAR", "output": self.add(values, FLOAT, shape)}


def _keys(steep: bool) -> list[tuple[float, float]]:
    """Seconds and states; for steep turns one more half way between two that differ."""
    out = [KEYS[0]]
    for before, after in pairwise(KEYS):
        if steep and before[1] != after[1]:
            out.append((0.5 * (before[0] + after[0]), 0.5))
        out.append(after)
    return out


def _channel(samplers: list[Json], node: int, path: str) -> Json:
    return {"sampler": len(samplers) - 1, "target": {"node": node, "path": path}}


# --- what was written ----------------------------------------------------------------------


def folds(stream: BinaryIO, start: int, document: Json, number: int, skeleton: Skeleton) -> Check:
    """How far a panel's points are, in mm, from where they should be, flat and as built, when the
    animation that was read moves the joints that were read."""
    skin = document["skins"][document["nodes"][number]["skin"]]
    attributes = document["meshes"][number]["primitives"][0]["attributes"]

    def read(index: int) -> Array:
        found = accessor(stream, start, document, index)
        return found.rows(slice(0, found.count)).astype(float)

    points = read(attributes["POSITION"])
    bodies = read(attributes["JOINTS_0"]).astype(int)
    weights = read(attributes["WEIGHTS_0"])
    binds = read(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
    built = motions(skeleton.strip, 0.0)
    worst = 0.0
    for time, f in KEYS[:2]:
        joints = _posed(document, skin, read, time) @ binds
        seen = np.zeros_like(points)
        true = np.zeros_like(points)
        exact = motions(skeleton.strip, f, skeleton.shift)
        for column in range(2):
            body, weight = bodies[:, column], weights[:, column, None]
            seen += weight * _applied(joints[body], points)
            flat = np.einsum(
                "nji,nj->ni", built[body, :, :3], skeleton.panel.mesh.vertices - built[body, :, 3]
            )
            true += skeleton.weights[:, column, None] * _applied(exact[body], flat)
        worst = max(worst, float(np.linalg.norm(seen - true @ UP.T * METRES_PER_MM, axis=1).max()))
    size = float(np.abs(points).max()) + float(np.abs(skeleton.strip.flat).max()) * METRES_PER_MM
    return at_most(
        CHECK,
        skeleton.panel.name,
        worst / METRES_PER_MM,
        FLOAT32_STEP * size / METRES_PER_MM * len(binds),
        "mm",
        says=f"the animation leaves points up to {worst / METRES_PER_MM:.3g} mm from their places",
    )


def _posed(document: Json, skin: Json, read: Callable[[int], Array], time: float) -> Array:
    """The joints (b, 4, 4) at a key of the animation."""
    nodes, (animation,) = document["nodes"], document["animations"]
    local = {node: dict(nodes[node]) for node in skin["joints"]}
    for channel in animation["channels"]:
        node, path = channel["target"]["node"], channel["target"]["path"]
        if node in local:
            sampler = animation["samplers"][channel["sampler"]]
            key = int(np.argmin(np.abs(read(sampler["input"])[:, 0] - time)))
            local[node][path] = read(sampler["output"])[key].tolist()
    out: dict[int, Array] = {}
    left = [(skin["skeleton"], np.eye(4))]
    while left:
        node, parent = left.pop()
        out[node] = parent @ _matrix(local[node]["rotation"], local[node]["translation"])
        left += [(child, out[node]) for child in nodes[node].get("children", ())]
    return np.array([out[node] for node in skin["joints"]])


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
