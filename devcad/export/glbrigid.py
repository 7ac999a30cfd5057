"""glTF of a mechanism that moves: every link is a node, turned and shifted as a rigid body.

The static file stays what it is; an animation "motion" comes behind, of 8 s, that begins and ends
in the conformal pose. A mechanism whose input goes all the way round goes round once; another
swings to the one stop and to the other, as a cosine, so that at a toggle, where links would have no
bound to their speed, they turn back at a finite one; the stops are keys. Turns are exact at every
time where a link turns evenly, and between keys all points are within a tenth of the part's
tolerance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np

from devcad.checks import Check, at_most
from devcad.export.binary import FLOAT32_STEP, demanded, opened
from devcad.export.glbread import CHECK, Json, accessor, parse
from devcad.geometry.linkage import TURN, Linkage
from devcad.geometry.taylor import Array
from devcad.part import Part
from devcad.simulate.bodies import Complex
from devcad.simulate.motion import Motion, Track, motion, track
from devcad.units import METRES_PER_MM

FLOAT = 5126
SECONDS = 8.0
FEWEST, MOST = 32, 4096
"""Keys of an animation, but one to three."""
SHORT = 1e-3
"""Seconds: a stop that is nearer to the beginning is there."""
SHARE = 0.1
"""Of the part's tolerance, that points may leave their paths between two keys."""
UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # (x, y, z) -> (x, z, -y)


@dataclass(frozen=True, slots=True)
class Swing:
    """A mechanism in motion: the seconds (m,) of its keys, the samples there, and the node of each
    link that moves, by number of the link."""

    motion: Motion
    seconds: Array
    track: Track
    nodes: dict[int, int]


def swings(part: Part) -> list[Swing]:
    """The motions of a part's mechanisms. Of one sheet with living hinges, whose links are no
    bodies of their own, there is none, nor of one that has no motion of one degree of freedom."""
    numbers = {panel.name: k for k, panel in enumerate(part.panels)}
    out = []
    for linkage in part.linkages:
        found = motion(linkage)
        nodes = _nodes(linkage, found, numbers)
        if not nodes:
            continue
        low, high = found.stretch()
        if high - low > 1e-9:
            out.append(_swing(found, nodes, SHARE * part.tolerance))
    return out


def _nodes(linkage: Linkage, found: Motion, numbers: dict[str, int]) -> dict[int, int]:
    """The node of each link that moves."""
    if found.drive is None or len(set(linkage.panels)) < len(linkage.links):
        return {}
    return {k: numbers[linkage.panels[k]] for k in found.drive.moving}


def _swing(found: Motion, nodes: dict[int, int], limit: float) -> Swing:
    """As many keys as keep points within the limit of their paths."""
    count = FEWEST
    while True:
        seconds = _seconds(found, count)
        seen = track(found, _input(found, seconds))
        if count >= MOST or _bulge(found, seen) <= limit:
            return Swing(found, seconds[::2], _every_second(seen), nodes)
        count *= 2


def _seconds(found: Motion, count: int) -> Array:
    """The times of about ``count`` keys, and between each two the middle. The stops are keys: at a
    toggle the other links turn back at full speed."""
    stops = [0.0, SECONDS]
    if not found.whole:
        first = (0.25 + _lead(found) / TURN) * SECONDS
        stops[1:1] = [s for s in (first, first + 0.5 * SECONDS) if SHORT < s < SECONDS - SHORT]
    pieces = [
        np.linspace(a, b, 2 * math.ceil(count * (b - a) / SECONDS) + 1)[:-1]
        for a, b in pairwise(stops)
    ]
    return np.concatenate([*pieces, [SECONDS]])


def _input(found: Motion, seconds: Array) -> Array:
    """The input's turn at times: 0 first and last."""
    low, high = found.stretch()
    phase = seconds / SECONDS * TURN
    if found.whole:
        return phase
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return np.clip(middle + half * np.sin(phase - _lead(found)), low, high)


def _lead(found: Motion) -> float:
    """The phase at which a swing, begun in the conformal pose, is in its middle."""
    low, high = found.stretch()
    return math.asin(min(max((low + high) / (high - low), -1.0), 1.0))


def _every_second(seen: Track) -> Track:
    return Track(
        seen.turn[::2],
        seen.turns[::2],
        seen.shifts[::2],
        seen.joints[::2],
        seen.low[::2],
        seen.high[::2],
    )


def _bulge(found: Motion, seen: Track) -> float:
    """How far points of the links are, half way between two keys, from where they should be."""
    reach = max(arc.radius + arc.half for arc in found.arcs)
    turn = 0.5 * (seen.turns[:-2:2] + seen.turns[2::2]) - seen.turns[1::2]
    shift = 0.5 * (seen.shifts[:-2:2] + seen.shifts[2::2]) - seen.shifts[1::2]
    return float((np.abs(shift) + reach * np.abs(turn)).max())


# --- the file -------------------------------------------------------------------------------


def animated(document: Json, found: list[Swing], size: int) -> bytes:
    """Add the animation to the document of a static file whose first nodes are the panels; the
    bytes that come behind the ``size`` bytes there are."""
    data = bytearray()
    channels: list[Json] = []
    samplers: list[Json] = []

    def add(values: Array, shape: str) -> int:
        raw = np.ascontiguousarray(values, "<f4").tobytes()
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": size + len(data), "byteLength": len(raw)}
        )
        data.extend(raw)
        table: Json = {
            "bufferView": len(document["bufferViews"]) - 1,
            "componentType": FLOAT,
            "count": len(values),
            "type": shape,
        }
        if shape == "SCALAR":
            table |= {"min": [float(np.float32(values[0]))], "max": [float(np.float32(values[-1]))]}
        document["accessors"].append(table)
        return len(document["accessors"]) - 1

    for swing in found:
        times = add(swing.seconds, "SCALAR")
        for link, node in swing.nodes.items():
            turns, shifts = _placed(swing, link)
            for path, values, shape in (
                ("translation", shifts, "VEC3"),
                ("rotation", turns, "VEC4"),
            ):
                samplers.append(
                    {"input": times, "interpolation": "LINEAR", "output": add(values, shape)}
                )
                channels.append(
                    {"sampler": len(samplers) - 1, "target": {"node": node, "path": path}}
                )
    if channels:
        document["animations"] = [{"name": "motion", "channels": channels, "samplers": samplers}]
        document["buffers"][0]["byteLength"] = size + len(data)
    return bytes(data)


def _placed(swing: Swing, link: int) -> tuple[Array, Array]:
    """A link's turns as quaternions (m, 4) and its shifts (m, 3) in metres, Y up: its motion about
    the cylinder's own axis, carried to where the mechanism stands."""
    place = np.array(swing.motion.linkage.place)
    turned, origin = place[:, :3], place[:, 3]
    angle, shift = swing.track.turns[:, link], swing.track.shifts[:, link]
    axis = UP @ turned[:, 2]
    quaternions = np.empty((len(angle), 4))
    quaternions[:, :3] = np.sin(0.5 * angle)[:, None] * axis
    quaternions[:, 3] = np.cos(0.5 * angle)
    steps = _moved(turned, origin, angle, shift, np.zeros((1, 3)))[:, 0]
    return quaternions + 0.0, steps @ UP.T * METRES_PER_MM + 0.0


def _moved(turned: Array, origin: Array, angle: Array, shift: Complex, points: Array) -> Array:
    """Points (k, 3) as a link carries them: (m, k, 3), mm."""
    local = (points - origin) @ turned
    x, y = local[:, 0], local[:, 1]
    plane = np.exp(1j * angle)[:, None] * (x + 1j * y) + shift[:, None]
    z = np.broadcast_to(local[:, 2], plane.shape)
    return np.asarray(np.stack([plane.real, plane.imag, z], axis=2) @ turned.T + origin)


# --- what was written -----------------------------------------------------------------------


def proven(path: Path, part: Part, total: int, found: list[Swing]) -> tuple[Check, ...]:
    """For every link that moves how far the corners of its box are, in mm, from where they should
    be at the keys of the animation that is read from the file.

    Raises:
        CheckFailed: glb-readback.
    """
    with opened(path, "rb") as stream:
        document, start = parse(stream, path, total)
        return demanded(_moves(stream, start, document, part, found), path)


def _moves(
    stream: BinaryIO, start: int, document: Json, part: Part, found: list[Swing]
) -> list[Check]:

    def read(index: int) -> Array:
        stored = accessor(stream, start, document, index)
        return stored.rows(slice(0, stored.count)).astype(float)

    (animation,) = document["animations"]
    checks = []
    for swing in found:
        place = np.array(swing.motion.linkage.place)
        for link, node in swing.nodes.items():
            told = {
                channel["target"]["path"]: read(animation["samplers"][channel["sampler"]]["output"])
                for channel in animation["channels"]
                if channel["target"]["node"] == node
            }
            vertices = part.panels[node].mesh.vertices
            corners = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
            angle, shift = swing.track.turns[:, link], swing.track.shifts[:, link]
            true = _moved(place[:, :3], place[:, 3], angle, shift, corners)
            seen = _turned(told["rotation"], corners @ UP.T)
            seen += told["translation"][:, None] / METRES_PER_MM
            worst = float(np.linalg.norm(seen - true @ UP.T, axis=2).max())
            size = float(np.abs(corners).max() + np.abs(told["translation"]).max() / METRES_PER_MM)
            checks.append(
                at_most(
                    CHECK,
                    part.panels[node].name,
                    worst,
                    8.0 * FLOAT32_STEP * size,
                    "mm",
                    says=f"the animation leaves points up to {worst:.3g} mm from their places",
                )
            )
    return checks


def _turned(quaternions: Array, points: Array) -> Array:
    """Points (k, 3) turned by each quaternion (m, 4): (m, k, 3)."""
    vector, w = quaternions[:, None, :3], quaternions[:, None, 3:]
    first = 2.0 * np.cross(vector, points[None])
    return np.asarray(points[None] + w * first + np.cross(vector, first))
