"""Arcs that enclose the area of the curve that they stand for.

An arc fitted within a tolerance leaves a hole's area wrong by some millionths. A chain of tangent
continuous arcs has more freedom than its ends need: the chain nearest to the fitted one that
sweeps the true area is found, tangent continuous as before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.flatten import loops
from devcad.geometry.taylor import Array

STEPS = 6
"""Newton steps at most: the correction is some millionths of the chain, two are enough."""
REACHED = 1e-13
"""Of the chain's size (for the area, of its square): the correction is done."""
LARGEST = 0.5 * np.pi * (1.0 + 1e-9)
"""Half sweep of half a turn: no arc sweeps more."""
STIFF = 1e-8
"""Weight of the unknowns beside what they move, for chains that have too many of them."""


@dataclass(frozen=True, slots=True)
class Chain:
    """Arcs from the origin: the direction in which the first one starts, the chords (k,) and half
    the sweeps (k,)."""

    first: float
    chord: Array
    half: Array

    @property
    def headings(self) -> Array:
        """The directions of the chords, (k,)."""
        return self.first + 2.0 * np.cumsum(self.half) - self.half

    @property
    def last(self) -> float:
        """The direction in which the last arc ends."""
        return self.first + 2.0 * float(self.half.sum())

    @property
    def joints(self) -> Array:
        """Where the arcs begin and end, (k + 1, 2)."""
        steps = self.chord[:, None] * loops.direction(self.headings)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def area(self) -> float:
        """What the chain sweeps over its chord, mm2."""
        at = self.joints
        segments = self.chord**2 * loops.segment_factor(2.0 * self.half)
        return float(0.5 * loops.cross(at[:-1], at[1:]).sum() + segments.sum())

    def moved(self, step: Array) -> Chain:
        """The chain with changes of the first direction, the chords and the half sweeps."""
        count = len(self.chord)
        return Chain(
            self.first + float(step[0]),
            self.chord + step[1 : count + 1],
            self.half + step[count + 1 :],
        )


def with_area(
    points: Array, bulges: Array, area: float, keep: tuple[bool, bool]
) -> tuple[Array, Array] | None:
    """The chain of arcs with the same ends, and the same end directions where ``keep`` says so,
    that sweeps ``area`` (mm2) and whose joints move least; None when there is none nearby.

    points (k + 1, 2), bulges (k,), tangent continuous. The area is that between the chain and
    its chord, counterclockwise along the chain.
    """
    half = loops.half_sweeps(bulges)
    ways = np.diff(points, axis=0)
    chain = Chain(float(np.arctan2(ways[0, 1], ways[0, 0]) - half[0]), np.hypot(*ways.T), half)
    end, last, size = points[-1] - points[0], chain.last, float(chain.chord.sum())
    scale = np.array([size, size, size**2, 1.0])
    for _ in range(STEPS):
        at = chain.joints
        miss = np.append(end - at[-1], [area - chain.area(), last - chain.last])
        if np.all(np.abs(miss[:3]) <= REACHED * scale[:3]):
            at = points[0] + at
            at[-1] = points[-1]
            return at, np.tan(0.5 * chain.half)
        chain = chain.moved(_step(chain, miss, keep))
        if not (chain.chord.min() > 0.0 and np.abs(chain.half).max() <= LARGEST):
            return None
    return None


def _step(chain: Chain, miss: Array, keep: tuple[bool, bool]) -> Array:
    """The change of a chain that moves its end, its area and its last direction by ``miss`` (4,)
    and its joints least: first direction, chords, half sweeps (n,); nan where there is none."""
    count = len(chain.chord)
    moves = _moves(chain)
    rates = np.concatenate([moves[-1], _area_rate(chain, moves)[None], _last_rate(count)[None]])
    bows = np.zeros((count, 2 * count + 1))  # how far an arc bulges over its chord
    bows[:, count + 1 :] = np.diag(0.25 * chain.chord)
    unit = np.concatenate(
        [[1.0 / chain.chord.sum()], np.ones(count), np.full(count, 1.0 / chain.chord.mean())]
    )
    free = slice(1 if keep[0] else 0, None)
    moved = (np.concatenate([*moves[1:-1], bows]) * unit)[:, free]
    rows = 4 if keep[1] else 3
    wanted = (rates[:rows] * unit)[:, free]
    scale = np.abs(wanted).max(axis=1)
    wanted, right = wanted / scale[:, None], miss[:rows] / scale
    weight = moved.T @ moved
    weight += STIFF * np.trace(weight) / len(weight) * np.eye(len(weight))
    system = np.block([[weight, wanted.T], [wanted, np.zeros((rows, rows))]])
    step = np.full(2 * count + 1, np.nan)
    try:
        solved = np.linalg.solve(system, np.concatenate([np.zeros(len(weight)), right]))
    except np.linalg.LinAlgError:
        return step
    step[:] = 0.0
    step[free] = solved[: len(weight)]
    return np.asarray(step * unit)


def _moves(chain: Chain) -> Array:
    """How the joints move with every unknown, (k + 1, 2, n)."""
    count = len(chain.chord)
    turns = np.zeros((count, 2 * count + 1))
    turns[:, 0] = 1.0
    turns[:, count + 1 :] = 2.0 * np.tri(count) - np.eye(count)
    along = loops.direction(chain.headings)
    across = np.column_stack([-along[:, 1], along[:, 0]])
    steps = (chain.chord[:, None] * across)[:, :, None] * turns[:, None, :]
    steps[np.arange(count), :, np.arange(1, count + 1)] += along
    return np.concatenate([np.zeros((1, 2, 2 * count + 1)), np.cumsum(steps, axis=0)])


def _area_rate(chain: Chain, moves: Array) -> Array:
    """How the area changes with every unknown, (n,)."""
    at, count = chain.joints, len(chain.chord)
    moves = np.moveaxis(moves, 1, 2)  # (k + 1, n, 2)
    rate = loops.cross(moves[:-1], at[1:, None]) + loops.cross(at[:-1, None], moves[1:])
    out = 0.5 * rate.sum(axis=0)
    sweep = 2.0 * chain.half
    out[1 : count + 1] += 2.0 * chain.chord * loops.segment_factor(sweep)
    out[count + 1 :] += 2.0 * chain.chord**2 * _segment_rate(sweep)
    return np.asarray(out)


def _segment_rate(x: Array) -> Array:
    """The derivative of :func:`devcad.flatten.loops.segment_factor`."""
    small = np.abs(x) < 0.05
    y = np.where(small, 1.0, x)
    large = 0.25 - (y - np.sin(y)) * np.sin(y) / (4.0 * (1.0 - np.cos(y)) ** 2)
    return np.where(small, 1.0 / 12.0 + x**2 / 120.0, large)


def _last_rate(count: int) -> Array:
    """How the last direction changes with every unknown, (n,)."""
    return np.concatenate([[1.0], np.zeros(count), np.full(count, 2.0)])
