"""glTF of a sheet that folds along curved creases: a joint for every ruling of every flank.

The joints are the bodies of creased.py. Those of the first flank hang on one another from the one
in the middle outwards, those of every other flank on their parent's at the same ruling, with their
origin on the crease: so creases stay closed and rulings keep their lengths at every time, between
keys too. What else the sheet keeps, the lengths along its flanks, it keeps as well as cubic splines
between keys follow the exact motion: there are as many keys as that needs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.export.creased import Creased, creased, inverse, step_motion, weights
from devcad.export.glbmotion import (
    FLOAT,
    KEYS,
    UP,
    Channel,
    Joint,
    Tail,
    inverse_binds,
    metres,
    resting,
)
from devcad.export.glbread import Json
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers, turning
from devcad.mesh.lodged import Lodging, share_of
from devcad.part import Panel
from devcad.units import METRES_PER_MM

KEPT = 0.01
"""Of the tolerance, by how much a length may be another between two keys."""
FEWEST, FINEST = 2, 2.0**-10
"""Pieces of the way between the part and its pattern, and the shortest of them."""
BETWEEN = (0.25, 0.5, 0.75)
"""Where in a piece the spline is compared with the motion."""
STEP = 1e-4
"""Of f, in which slopes are taken."""
ON = 1e-6
"""Points nearer to a ruling than this share of their cell lie on it."""


@dataclass(frozen=True, slots=True)
class Rig:
    """How a panel with flanks folds: its bodies, where its pattern lies flat, which two bodies
    carry each point of its mesh and how much each does, and at which f the animation has keys,
    0 first and 1 last. Body number j r + k is that of ruling k of flank j;
    ``stretch`` is by how much, in mm, a length may be another between keys."""

    panel: Panel
    fold: Creased
    shift: tuple[float, float]
    bodies: Numbers
    weights: Array
    keys: tuple[float, ...]
    stretch: float

    @property
    def root(self) -> int:
        """The number of the joint that has no parent."""
        return self.fold.anchor

    @property
    def between(self) -> tuple[tuple[float, float], ...]:
        """Seconds and f half way between keys, where the spline is farthest from the motion."""
        (begin, flat), (end, built) = KEYS[:2]
        half = [0.5 * (a + b) for a, b in pairwise(self.keys)]
        return tuple((begin + (end - begin) * (f - flat) / (built - flat), f) for f in half)

    def carried(self, f: float) -> Array:
        """The motions (b, 3, 4) of the bodies from the pattern at f: 0 as built, 1 flat."""
        return self.fold.motions(f, self.shift).reshape(-1, 3, 4)

    def nodes(self, first: int) -> list[Json]:
        """The joints as nodes that rest as built, numbered from ``first``."""
        turns, places = _hung(self.fold, 0.0)
        start = self.carried(0.0)[self.root]
        origins = _origins(self.fold)
        turns[self.root] = turning(start[:, :3])
        places[self.root] = start @ np.array([*origins[self.root], 0.0, 1.0])
        joints = [
            Joint(parent, metres(place), UP @ turn)
            for parent, place, turn in zip(_parents(self.fold), places, turns, strict=True)
        ]
        flanks, rulings = self.fold.built.shape[:2]
        names = [
            f"{self.panel.name} flank {j + 1} ruling {k + 1}"
            for j in range(flanks)
            for k in range(rulings)
        ]
        return resting(joints, first, names)

    def binds(self) -> Array:
        """What brings points as built into the frames of the joints, (b, 16), column by column."""
        return inverse_binds(self.carried(0.0), _origins(self.fold))

    def played(self, tail: Tail) -> Iterator[Channel]:
        """The samplers of the joints: the number of a joint, its path, and the sampler."""
        origin = np.array([*_origins(self.fold)[self.root], 0.0, 1.0])
        path = np.array([metres(self.carried(f)[self.root] @ origin) for _, f in KEYS])
        yield self.root, "translation", tail.sampler(tail.times(), path, "VEC3")
        yield self.root, "rotation", tail.turning(UP @ turning(self.carried(0.0)[self.root, :, :3]))
        keys = _keys(self.keys)
        seconds = np.array([time for time, *_ in keys])
        times = tail.add(seconds, FLOAT, "SCALAR")
        tail.document["accessors"][times] |= {"min": [seconds[0]], "max": [seconds[-1]]}
        turns, places = _played(self.fold, keys)
        hung = self.fold.built.shape[1]
        for k in range(turns.shape[1]):
            if k == self.root:
                continue
            yield k, "rotation", _spline(tail, times, turns[:, k], "VEC4")
            if k < hung:  # any other's origin stays on its parent
                yield k, "translation", _spline(tail, times, places[:, k], "VEC3")


def rig_of(panel: Panel, shift: tuple[float, float], tolerance: float) -> Rig | None:
    """How a panel with flanks folds; None where its creases let no motion be."""
    fold = creased(panel)
    if not fold.moves:
        return None
    bodies, carried = _carriers(fold, panel)
    stretch = KEPT * tolerance
    return Rig(panel, fold, shift, bodies, carried, _key_states(fold, panel, stretch), stretch)


def _carriers(fold: Creased, panel: Panel) -> tuple[Numbers, Array]:
    """The bodies (n, 2) that carry the points of a panel's mesh, and how much each does (n, 2): the
    rulings on both sides of a point, each as much as it is near."""
    rulings, start = fold.built.shape[1], 0
    bodies, shares = [], []
    for number, (strip, flank) in enumerate(zip(fold.strips, panel.flanks, strict=True)):
        count = len(flank.mesh.vertices)
        flat, space = (
            array[start : start + count] for array in (panel.mesh.flat, panel.mesh.vertices)
        )
        lodging = Lodging(strip)
        cell = lodging.cells[lodging.found(flat, space)].astype(np.int32)
        share = share_of(strip, cell, flat)
        share = np.where(share < ON, 0.0, np.where(share > 1.0 - ON, 1.0, share))
        pair = np.stack([cell, cell + 1], axis=1) + number * rulings
        weight = np.stack([1.0 - share, share], axis=1)
        late = weight[:, 0] == 0.0
        pair[late], weight[late] = pair[late][:, ::-1], [1.0, 0.0]
        pair[weight[:, 1] == 0.0, 1] = 0
        bodies.append(pair)
        shares.append(weight)
        start += count
    return np.concatenate(bodies).astype(np.int32), np.concatenate(shares)


# --- the joints -----------------------------------------------------------------------------


def _parents(fold: Creased) -> list[int | None]:
    """The number of every body's parent."""
    rulings, anchor = fold.built.shape[1], fold.anchor
    first = [None if k == anchor else k - 1 if k > anchor else k + 1 for k in range(rulings)]
    return first + [score.parent * rulings + k for score in fold.scores for k in range(rulings)]


def _origins(fold: Creased) -> Array:
    """Where the joints are in the pattern, (b, 2): on the crease between a flank and its parent, of
    the first flank on its first one."""
    return np.concatenate([fold.scores[0].points, *(score.points for score in fold.scores)])


def _hung(fold: Creased, f: float) -> tuple[Array, Array]:
    """The turns (b, 3) and places (b, 3) of the joints in their parents at f, mm; of the root
    nothing."""
    rulings, anchor = fold.built.shape[1], fold.anchor
    points, share = fold.scores[0].points, weights(fold.poses, f)
    steps = np.einsum("p,pkj->kj", share, fold.steps)
    origins = _origins(fold)
    turns, places = np.zeros((2, len(origins), 3))
    for k in range(anchor + 1, rulings):
        turns[k], places[k] = steps[k - 1, :3], steps[k - 1, 3:]
        places[k, :2] += points[k] - points[k - 1]
    for k in range(anchor):
        back = inverse(step_motion(steps[k], points[k + 1]))
        turns[k], places[k] = -steps[k, :3], back @ np.array([*points[k], 0.0, 1.0])
        places[k, :2] -= points[k + 1]
    for number, score in enumerate(fold.scores, start=1):
        own = slice(number * rulings, (number + 1) * rulings)
        above = slice(score.parent * rulings, (score.parent + 1) * rulings)
        angle = 2.0 * np.arcsin(np.clip(float(share @ score.mus) * score.sines, -1.0, 1.0))
        turns[own, :2] = angle[:, None] * score.along
        places[own, :2] = origins[own] - origins[above]
    return turns, places


def _local(fold: Creased, f: float) -> tuple[Array, Array]:
    """The joints in their parents at f as the file has them: quaternions (b, 4), metres (b, 3)."""
    turns, places = _hung(fold, f)
    angle = np.linalg.norm(turns, axis=1, keepdims=True)
    sine = np.divide(np.sin(0.5 * angle), angle, out=np.full_like(angle, 0.5), where=angle > 0.0)
    return (
        np.concatenate([turns @ UP.T * sine, np.cos(0.5 * angle)], axis=1),
        places @ UP.T * METRES_PER_MM,
    )


# --- the keys -------------------------------------------------------------------------------


class _Splines:
    """The joints at f with their slopes, each found once: (b, 7), quaternions and metres."""

    def __init__(self, fold: Creased) -> None:
        self.fold = fold
        self._known: dict[float, tuple[Array, Array]] = {}

    def at(self, f: float) -> Array:
        """The joints at f."""
        return np.concatenate(_local(self.fold, f), axis=1)

    def key(self, f: float) -> tuple[Array, Array]:
        """The joints at f, and their derivatives by f."""
        if f not in self._known:
            slope = (self.at(f + STEP) - self.at(f - STEP)) / (2.0 * STEP)
            self._known[f] = self.at(f), slope
        return self._known[f]

    def off(self, low: float, high: float) -> Array:
        """How far the cubic splines between two keys are from the joints: (3, flanks, r, 7)."""
        (one, out), (other, into), step = self.key(low), self.key(high), high - low
        found = []
        for s in BETWEEN:
            spline = (
                (2.0 * s**3 - 3.0 * s**2 + 1.0) * one
                + step * (s**3 - 2.0 * s**2 + s) * out
                + (3.0 * s**2 - 2.0 * s**3) * other
                + step * (s**3 - s**2) * into
            )
            spline[:, :4] /= np.linalg.norm(spline[:, :4], axis=1, keepdims=True)
            found.append(spline - self.at(low + s * step))
        return np.array(found).reshape(-1, *self.fold.built.shape[:2], 7)


def _key_states(fold: Creased, panel: Panel, stretch: float) -> tuple[float, ...]:
    """The f of the keys, so that no length within a strip between two rulings differs by more than
    ``stretch`` mm between them.

    A joint is turned wrong by twice what its quaternion is off. Two neighbouring rulings of a flank
    lie to one another as those of its parent do but for the difference of their own turns: what
    that moves at the reach of all flanks is the bound. Pieces of the way that miss it are halved.
    """
    splines = _Splines(fold)
    reach = panel.thickness + sum(
        float(np.linalg.norm(strip.pattern[1] - strip.pattern[0], axis=1).max())
        for strip in fold.strips
    )
    # at an apex every ruling lies beside every other
    worst = np.sum if any(_reaches_apex(strip) for strip in fold.strips) else np.max

    def bound(low: float, high: float) -> float:
        off = splines.off(low, high)
        own = worst(np.linalg.norm(off[:, 0, :, :4], axis=2), axis=1)  # of the root nothing
        others = np.diff(off[:, 1:, :, :4], axis=2)
        own = own + worst(np.linalg.norm(others, axis=3), axis=2).sum(axis=1)
        places = np.linalg.norm(off[..., 4:], axis=3).max(axis=(1, 2)) / METRES_PER_MM
        return float((2.0 * own * reach + places).max())

    keys, left = [0.0], [(k / FEWEST, (k + 1) / FEWEST) for k in reversed(range(FEWEST))]
    while left:
        low, high = left.pop()
        if high - low > FINEST and bound(low, high) > stretch:
            middle = 0.5 * (low + high)
            left += [(middle, high), (low, middle)]
        else:
            keys.append(high)
    return tuple(keys)


def _reaches_apex(strip: Hinged) -> bool:
    """Whether all rulings of a strip end, or begin, at one point."""
    size = float(np.ptp(strip.pattern.reshape(-1, 2), axis=0).max())
    return bool((np.ptp(strip.pattern, axis=1).max(axis=1) < ON * size).any())


def _keys(states: Sequence[float]) -> list[tuple[float, float, float, float]]:
    """Seconds, f there, and df/dt before and after."""
    out = [(KEYS[0][0], KEYS[0][1], 0.0, 0.0)]
    for (begin, f), (end, goal) in pairwise(KEYS):
        slope = (goal - f) / (end - begin)
        out[-1] = (*out[-1][:3], slope)
        if not slope:
            out.append((end, goal, 0.0, 0.0))
            continue
        for state in (states if goal > f else states[::-1])[1:]:
            out.append((begin + (state - f) / slope, state, slope, slope))
    out[-1] = (*out[-1][:3], 0.0)
    return out


def _played(fold: Creased, keys: list[tuple[float, float, float, float]]) -> tuple[Array, Array]:
    """The turns (k, b, 3, 4) and places (k, b, 3, 3) of the joints at the keys: slope before,
    value, slope after."""
    splines = _Splines(fold)
    rows = []
    for _, f, before, after in keys:
        value, slope = splines.key(f)
        rows.append(np.stack([before * slope, value, after * slope], axis=1))
    every = np.array(rows)
    return every[..., :4], every[..., 4:]


def _spline(tail: Tail, times: int, values: Array, shape: str) -> Json:
    """A sampler of a cubic spline (k, 3, d)."""
    rows = values.reshape(-1, values.shape[2]) + 0.0
    return {
        "input": times,
        "interpolation": "CUBICSPLINE",
        "output": tail.add(rows, FLOAT, shape),
    }
