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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from devcad.export.folding import pattern_shifts, strip_of
from devcad.export.glbread import Json
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers, motions, turning
from devcad.mesh.lodged import carriers
from devcad.part import Panel, Part
from devcad.units import METRES_PER_MM

if TYPE_CHECKING:  # few sheets have curved creases
    from devcad.export.glbcrease import Rig

VERTEX_TARGET = 34962
FLOAT, SHORT = 5126, 5123
KEYS = ((0.0, 1.0), (2.0, 0.0), (3.0, 0.0), (5.0, 1.0), (6.0, 1.0))
"""Seconds and how far the part is unrolled then."""
STEEP = 3.0
"""Radians: from there on a turn has keys in the middle, for half a turn could go either way."""
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # (x, y, z) -> (x, z, -y)


Channel = tuple[int, str, Json]
"""The number of a joint, what of it moves, and the sampler."""


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
    between: ClassVar[tuple[tuple[float, float], ...]] = ()
    stretch: ClassVar[float] = 0.0

    @property
    def root(self) -> int:
        """The number of the joint that has no parent."""
        return self.strip.anchor

    def nodes(self, first: int) -> list[Json]:
        """The joints as nodes that rest as built, numbered from ``first``."""
        names = [f"{self.panel.name} facet {k + 1}" for k in range(len(self.joints))]
        return resting(self.joints, first, names)

    def binds(self) -> Array:
        """What brings points as built into the frames of the joints, (b, 16), column by column."""
        built = motions(self.strip, 0.0)
        origins = np.array([_origin(self.strip, k) for k in range(len(built))])
        return inverse_binds(built, origins)

    def carried(self, f: float) -> Array:
        """The motions (b, 3, 4) of the bodies from the pattern at f: 0 as built, 1 flat."""
        return motions(self.strip, f, self.shift)

    def played(self, tail: Tail) -> Iterator[Channel]:
        """The samplers of the joints: the number of a joint, its path, and the sampler."""
        path = np.array([_path(self.strip, self.shift, f) for _, f in KEYS])
        yield self.root, "translation", tail.sampler(tail.times(), path, "VEC3")
        for k, joint in enumerate(self.joints):
            yield k, "rotation", tail.turning(joint.turn)


def skeletons(part: Part) -> list[Skeleton | Rig | None]:
    """Of every panel its skeleton; None where it is known by its pattern alone, or its creases let
    no motion be: it stands still."""
    out: list[Skeleton | Rig | None] = []
    for panel, shift in zip(part.panels, pattern_shifts(part), strict=True):
        if panel.flanks:
            from devcad.export.glbcrease import rig_of

            out.append(rig_of(panel, shift, part.tolerance))
            continue
        strip = strip_of(panel)
        if strip is None:
            out.append(None)
            continue
        bodies, weights = carriers(strip, panel.mesh)
        out.append(Skeleton(panel, strip, shift, _joints(strip), bodies, weights))
    return out


def animated(document: Json, bones: Sequence[Skeleton | Rig | None], size: int) -> bytes:
    """Add skeletons, skins and the animation to the document of a static file whose first nodes
    and meshes are the panels; the bytes that come behind the ``size`` bytes there are."""
    tail = Tail(document, size)
    nodes = document["nodes"]
    skins: list[Json] = []
    channels: list[Json] = []
    samplers: list[Json] = []
    for number, skeleton in enumerate(bones):
        if skeleton is None:
            continue
        first = len(nodes)
        nodes += skeleton.nodes(first)
        root = first + skeleton.root
        document["scenes"][0]["nodes"].append(root)
        attributes = document["meshes"][number]["primitives"][0]["attributes"]
        four = np.zeros((2, len(skeleton.bodies), 4))
        four[:, :, :2] = skeleton.bodies, skeleton.weights
        attributes["JOINTS_0"] = tail.add(four[0], SHORT, "VEC4", VERTEX_TARGET)
        attributes["WEIGHTS_0"] = tail.add(four[1], FLOAT, "VEC4", VERTEX_TARGET)
        nodes[number]["skin"] = len(skins)
        skins.append(
            {
                "inverseBindMatrices": tail.add(skeleton.binds(), FLOAT, "MAT4"),
                "skeleton": root,
                "joints": list(range(first, len(nodes))),
            }
        )
        for joint, path, sampler in skeleton.played(tail):
            samplers.append(sampler)
            target = {"node": first + joint, "path": path}
            channels.append({"sampler": len(samplers) - 1, "target": target})
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
            out.append(Joint(None, metres(start), UP @ turning(strip.built[:, :3])))
            continue
        parent, hinge, sign = (k - 1, k - 1, 1.0) if k > strip.anchor else (k + 1, k, -1.0)
        step = _origin(strip, k) - _origin(strip, parent)
        turn = np.append(along[hinge], 0.0) * (sign * strip.angles[hinge])
        out.append(Joint(parent, metres(np.append(step, 0.0)), UP @ turn))
    return tuple(out)


def _origin(strip: Hinged, k: int) -> Array:
    """Where a body's joint is in the flat strip, (2,)."""
    if k == strip.anchor:
        return strip.pivot
    return np.asarray(strip.hinges[k - 1 if k > strip.anchor else k, 0])


def resting(joints: Sequence[Joint], first: int, names: Sequence[str]) -> list[Json]:
    """Joints as nodes that rest as built."""
    nodes: list[Json] = [
        {
            "name": name,
            "translation": joint.place.tolist(),
            "rotation": quaternion(joint.turn),
        }
        for joint, name in zip(joints, names, strict=True)
    ]
    for k, joint in enumerate(joints):
        if joint.parent is not None:
            nodes[joint.parent].setdefault("children", []).append(first + k)
    return nodes


def inverse_binds(built: Array, origins: Array) -> Array:
    """What brings points as built into the frames of joints, (b, 16), column by column: ``built``
    (b, 3, 4) carries their bodies from the plane, in which ``origins`` (b, 2) are theirs."""
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
    return metres(motion @ np.array([*strip.pivot, 0.0, 1.0]))


def metres(point: Array) -> Array:
    """A point or a step in mm as glTF has it; no zero is negative."""
    return UP @ point * METRES_PER_MM + 0.0


def quaternion(turn: Array) -> list[float]:
    """A turn about a vector by its length as x, y, z, w."""
    angle = math.sqrt(float(turn @ turn))
    share = math.sin(0.5 * angle) / angle if angle else 0.5
    return [*(turn * share + 0.0).tolist(), math.cos(0.5 * angle)]


# --- the animation -------------------------------------------------------------------------


class Tail:
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

    def turning(self, turn: Array) -> Json:
        """A sampler of a turn that grows evenly from nothing, flat, to ``turn`` as built."""
        steep = float(np.linalg.norm(turn)) > STEEP
        turns = np.array([quaternion(turn * (1.0 - f)) for _, f in _keys(steep)])
        return self.sampler(self.times(steep=steep), turns, "VEC4")


def _keys(steep: bool) -> list[tuple[float, float]]:
    """Seconds and states; for steep turns one more half way between two that differ."""
    out = [KEYS[0]]
    for before, after in pairwise(KEYS):
        if steep and before[1] != after[1]:
            out.append((0.5 * (before[0] + after[0]), 0.5))
        out.append(after)
    return out
