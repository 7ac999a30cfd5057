"""How many bends a press brake makes of each stretch, and where their cells part.

By the most that a bend turns, their number, the longest flat, or how far the smooth part rises
over a facet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.bending import Sheet, Stretch
from devcad.geometry.taylor import Array

MOST_BENDS = 500
"""Bends of a panel: more are not pressed, it is rolled."""
STEEPEST = np.radians(150.0)
"""The most that one bend may turn."""
MOST_HALVES = 16
"""Into so many parts a cell beside a change of sign is divided at most."""
QUARTERS = 4
"""Steps from bend to bend, and through a cell, at which the smooth sheet is looked at."""


def alike(counts: Sequence[int]) -> list[Array]:
    """The borders of ``counts[k]`` cells that bend alike, for each stretch.

    Raises:
        GeometryError: more bends than are pressed.
    """
    _bounded(sum(counts))
    return [np.linspace(0.0, 1.0, count + 1) for count in counts]


def _bounded(count: int) -> None:
    """Refuse more than :data:`MOST_BENDS`."""
    if count > MOST_BENDS:
        raise GeometryError(
            f"bends: {count} bend lines would be needed, limit {MOST_BENDS}",
            value=count,
            limit=MOST_BENDS,
            remedy="ask for fewer bends or longer flats, allow a larger angle or chord, or roll "
            "the part",
        )


def by_angle(parts: Sequence[Stretch], most: float) -> list[int]:
    """The fewest bends that turn by at most ``most`` radians each."""
    return [max(int(np.ceil(abs(part.angle) / most * (1.0 - 1e-12))), 1) for part in parts]


def by_count(parts: Sequence[Stretch], count: int) -> list[int]:
    """``count`` bends, each where the bends of a stretch turn the most.

    Raises:
        GeometryError: fewer bends than stretches, or bends that would turn too far.
    """
    least = by_angle(parts, STEEPEST)
    if count < sum(least):
        raise GeometryError(
            f"bends: {count} bend lines are too few: none turns by more than 150 deg, or to both "
            "sides",
            value=count,
            limit=sum(least),
            remedy=f"give count = {sum(least)} or more",
        )
    _bounded(count)
    out, angles = np.array(least), np.array([abs(part.angle) for part in parts])
    for _ in range(count - sum(least)):
        out[np.argmax(angles / out)] += 1
    return [int(n) for n in out]


def by_length(smooth: Sheet, parts: Sequence[Stretch], longest: float) -> list[Array]:
    """The borders of the fewest cells of one length for each stretch such that no cell, and no
    flat between two bends, is longer than ``longest`` mm on the longer edge of the pattern; the
    cells on both sides of where two stretches meet are halved for that as often as it takes.

    Raises:
        GeometryError: more bends than are pressed.
    """
    counts = [
        _fewest(part, lambda n, part=part: _longest(smooth, part, n, longest), 1.0)  # type: ignore[misc]
        for part in parts
    ]
    _bounded(sum(counts))
    cells = [smooth.even(part, count) for part, count in zip(parts, counts, strict=True)]
    for k, (one, other) in enumerate(pairwise(parts)):
        halves = 1
        while _meet(smooth, one, other) and halves < MOST_HALVES:
            last, first = 0.5 * float(cells[k][-2] + 1.0), 0.5 * float(cells[k + 1][1])
            ends = [
                smooth.along(smooth.places(part, np.array([share])))[0]
                for part, share in ((one, last), (other, first))
            ]
            if (ends[1] - ends[0]).max() <= longest * (1.0 + 1e-9):
                break
            halves *= 2
            before = smooth.even(one, counts[k] * halves)[-2]
            after = smooth.even(other, counts[k + 1] * halves)[1]
            cells[k] = np.insert(cells[k], -1, before)
            cells[k + 1] = np.insert(cells[k + 1], 1, after)
    return cells


def _meet(smooth: Sheet, one: Stretch, other: Stretch) -> bool:
    """Whether a stretch ends where the next begins, without a crease."""
    if one.end == other.start:
        return True
    patches, number = smooth.flat.patches, one.end[0]
    return (
        number + 1 == other.start[0]
        and one.end[1] == patches[number].domain[1]
        and other.start[1] == patches[number + 1].domain[0]
        and smooth.middle.joints[number].smooth
    )


def by_chord(smooth: Sheet, parts: Sequence[Stretch], chord: float) -> list[int]:
    """The fewest bends such that the smooth part rises by at most ``chord`` mm over any facet that
    spans one bend's angle: on a cylinder ceil(angle / (2 acos(1 - chord / R)))."""
    return [
        _fewest(part, lambda n, part=part: _sagitta(smooth, part, n) / chord, 0.5)  # type: ignore[misc]
        for part in parts
    ]


def _fewest(part: Stretch, excess: Callable[[int], float], power: float) -> int:
    """The least n for which excess(n), falling about like n^(-1 / power), is at most 1."""
    (n,) = by_angle([part], STEEPEST)
    low, value = n - 1, excess(n)
    while value > 1.0 + 1e-9:
        low, n = n, max(n + 1, int(np.ceil(n * value**power * (1.0 - 1e-9))))
        _bounded(n)
        value = excess(n)
    while n - low > 1:
        middle = (low + n) // 2
        low, n = (low, middle) if excess(middle) <= 1.0 + 1e-9 else (middle, n)
    return n


def _longest(smooth: Sheet, part: Stretch, count: int, limit: float) -> float:
    """The longest of so many cells of one length, and of the flats between their bends, on the
    longer edge, as a share of ``limit`` in mm; 2 where a bend would turn too far."""
    borders = smooth.even(part, count)
    if np.diff(borders).max() * abs(part.angle) > STEEPEST:
        return 2.0
    every = np.sort(np.concatenate([borders, 0.5 * (borders[1:] + borders[:-1])]))
    along = smooth.along(smooth.places(part, every))
    return float((along[2:] - along[:-2]).max()) / limit


def _sagitta(smooth: Sheet, part: Stretch, count: int) -> float:
    """The most that the smooth part rises over the chord of a cell, or from one bend to the next,
    at right angles to the facet, mm."""
    at = smooth.places(part, np.arange(QUARTERS * count + 1) / (QUARTERS * count))

    def table(number: int, t: Array) -> Array:
        patch = smooth.middle.patches[number]
        low, high = patch.domain
        frame = patch.frame(np.clip(t, np.nextafter(low, high), np.nextafter(high, low)))
        rails = [frame.c0 + v[:, None] * frame.e for v in (frame.v_from, frame.v_to)]
        return np.stack([*rails, frame.n], axis=1)

    rows = at.of(table)  # (n, 3, 3): both rails and the normal
    first = np.arange(0, len(rows) - QUARTERS, QUARTERS // 2)
    window = rows[first[:, None] + np.arange(QUARTERS + 1)]  # (cells, looks, 3, 3)
    normal = window[:, 0, 2] + window[:, -1, 2]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    rails = window[:, :, :2] - window[:, :1, :2]
    height = np.einsum("cjrx,cx->cjr", rails, normal)
    chord = rails[:, -1]
    square = np.maximum((chord**2).sum(axis=2), 1e-300)
    share = np.einsum("cjrx,crx->cjr", rails, chord) / square[:, None]
    return float(np.abs(height - share * height[:, -1:]).max())
