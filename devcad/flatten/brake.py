"""The press brake: a smooth bend as a row of sharp ones, and the part that comes off the machine.

A cell is a stretch of the sheet between two rulings; all its bending is done at once, on the
ruling at the middle of the cell's bending, so that the turning of the part is kept. The blank is
the smooth part's pattern; folded along these lines it is a row of plane facets, isometric to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten.development import Development
from devcad.geometry.chain import Chain, link
from devcad.geometry.locate import Places, nearest
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

PER_FACET = 5
"""Places on each edge of a facet where its distance from the smooth part is measured."""
ALIGNMENTS, STILL = 12, 1e-9
"""Steps to the best motion, and the share of a step that ends them."""


@dataclass(frozen=True, slots=True)
class Bend:
    """A sharp bend by ``angle`` (radians, positive towards the front) on the ruling ``t`` of patch
    number ``patch``; ``cell`` are the rulings between which the smooth part bends as much."""

    patch: int
    t: float
    angle: float
    cell: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of a patch that bends one way: its bending from ``low`` to ``high``, in radians."""

    patch: int
    low: float
    high: float
    angle: float


def stretches(developments: Sequence[Development], reversals: Sequence[Array]) -> list[Stretch]:
    """The parts of a chain between its ends, joints and ``reversals`` (per patch, the increasing
    parameters where the bending changes its sign); those that do not bend are left out."""
    found = []
    for number, (development, inner) in enumerate(zip(developments, reversals, strict=True)):
        knots = development.series.knots
        turned = development.series.antiderivative()
        ends = np.unique(np.concatenate([knots[[0, -1]], inner]))
        angles = np.diff(turned(ends)[:, 3])
        found += [
            Stretch(number, low, high, angle)
            for (low, high), angle in zip(pairwise(ends.tolist()), angles.tolist(), strict=True)
        ]
    most = max((abs(s.angle) for s in found), default=0.0)
    return [s for s in found if abs(s.angle) > 1e-9 * max(most, 1e-3)]


def bends(
    developments: Sequence[Development], parts: Sequence[Stretch], counts: Sequence[int]
) -> list[Bend]:
    """``counts[k]`` equal bends in place of the bending of ``parts[k]``."""
    out = []
    for part, count in zip(parts, counts, strict=True):
        shares = np.arange(2 * count + 1) / (2 * count)
        t = _at_shares(developments[part.patch], part, shares)
        for k in range(count):
            cell = float(t[2 * k]), float(t[2 * k + 2])
            out.append(Bend(part.patch, float(t[2 * k + 1]), part.angle / count, cell))
    return out


def _at_shares(development: Development, part: Stretch, shares: Array) -> Array:
    """The rulings before which these shares of a part's bending lie, increasing, (n,)."""
    turned = development.series.antiderivative()
    start = turned(np.array([part.low]))[0, 3]
    aim = start + shares * part.angle
    low = np.full(len(shares), part.low)
    high = np.full(len(shares), part.high)
    sign = np.sign(part.angle)
    for _ in range(54):
        middle = 0.5 * (low + high)
        before = sign * (turned(middle)[:, 3] - aim) < 0.0
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    t = 0.5 * (low + high)
    t[shares == 0.0], t[shares == 1.0] = part.low, part.high
    return np.asarray(t)


def folded(
    flat: Chain, made: Sequence[Bend], first: Frame, *, base_closed: bool, tolerance: float
) -> Chain:
    """The blank folded along its bends: plane facets in space.

    ``flat`` is the pattern as a chain of plane patches (:func:`devcad.flatten.blank.flat_chain`)
    whose joints say what is folded between patches anyway; ``first`` is the frame of the first
    ruling, which stays where it is.
    """
    motion = np.eye(4)
    motion[:3] = np.column_stack([first.e[0], first.m[0], first.n[0], first.c0[0]])
    facets: list[Patch] = []
    for number, patch in enumerate(flat.patches):
        if number and flat.joints[number - 1].angle:
            motion = motion @ _turn(patch, patch.domain[0], flat.joints[number - 1].angle)
        here = [bend for bend in made if bend.patch == number]
        ends = [patch.domain[0], *(bend.t for bend in here), patch.domain[1]]
        for k, (low, high) in enumerate(pairwise(ends)):
            facets.append(patch.restricted(low, high).transformed(motion))
            if k < len(here):
                motion = motion @ _turn(patch, here[k].t, here[k].angle)
    return link(tuple(facets), base_closed=base_closed, tolerance=tolerance)


def _turn(patch: Patch, t: float, angle: float) -> Array:
    """The rotation by ``angle`` about the ruling t of a plane patch, (4, 4)."""
    jet = patch.jet([t], 0)
    axis, point = jet.e[0, 0], jet.c0[0, 0]
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    # to the front of what comes after: m turns towards n
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = point - turn @ point
    return out


def misfit(smooth: Chain, facets: Chain) -> tuple[float, Array]:
    """The largest distance in mm of the facets from the smooth part, and the rigid motion (4, 4)
    of the facets with which it is measured.

    The motion makes the squares of the distances at the facets' edges least: steps of Gauss and
    Newton with the distances along the smooth part's normals.
    """
    points = np.concatenate([_samples(patch) for patch in facets.patches])
    centre = points.mean(axis=0)
    motion = np.eye(4)
    for _ in range(ALIGNMENTS):
        places, _ = nearest(smooth, _moved(motion, points))
        normal, foot = _feet(smooth, places)
        arm = _moved(motion, points) - centre
        rows = np.concatenate([np.cross(arm, normal), normal], axis=1)
        away = np.einsum("ij,ij->i", normal, foot - centre - arm)
        # a motion along the surface itself, as of a cylinder about its axis, stays undone
        step, *_ = np.linalg.lstsq(rows, away, rcond=1e-8)
        motion = _small(step, centre) @ motion
        if np.abs(step).max() <= STILL * max(1.0, float(np.abs(away).max())):
            break
    _, distances = nearest(smooth, _moved(motion, points))
    return float(distances.max()), motion


def _samples(patch: Patch) -> Array:
    """Points of a facet on both its edges and between them, (n, 3)."""
    t = np.linspace(*patch.domain, PER_FACET)
    t[0], t[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
    jet = patch.jet(t, 0)
    ends = [jet.c0[0] + v[:, None] * jet.e[0] for v in (jet.v_from[0], jet.v_to[0])]
    return np.concatenate([ends[0], 0.5 * (ends[0] + ends[1]), ends[1]])


def _feet(chain: Chain, places: Places) -> tuple[Array, Array]:
    """The normals and the points of a chain at places on it, each (n, 3)."""
    normals, points = np.zeros((len(places.t), 3)), np.zeros((len(places.t), 3))
    for number, patch in enumerate(chain.patches):
        here = places.patch == number
        if here.any():
            frame = patch.frame(places.t[here])
            normals[here] = frame.n
            points[here] = frame.c0 + places.v[here, None] * frame.e
    return normals, points


def _moved(motion: Array, points: Array) -> Array:
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def _small(step: Array, centre: Array) -> Array:
    """The rotation by the vector step[:3] about a centre, then the shift step[3:], (4, 4)."""
    angle = float(np.linalg.norm(step[:3]))
    out = np.eye(4)
    if angle > 0.0:
        x, y, z = step[:3] / angle
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        out[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    out[:3, 3] = centre - out[:3, :3] @ centre + step[3:]
    return out
