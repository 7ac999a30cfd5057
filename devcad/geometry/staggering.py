"""Links of a cylinder kept apart along its axis: bands, and fingers where two share a hinge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

from devcad.geometry.linkage import TURN

MOST_ORDERS = 5
"""More bands than this are left in the order in which they were found."""


@dataclass(frozen=True, slots=True)
class Span:
    """What a link covers of the circle: from the angle ``start`` through the signed ``sweep``,
    and ``ear`` beyond both joints."""

    start: float
    sweep: float
    ear: float

    @property
    def reach(self) -> tuple[float, float]:
        """The angles between which it lies, ears and all, increasing."""
        low, high = sorted((self.start, self.start + self.sweep))
        return low - self.ear, high + self.ear


def overlapping(one: Span, other: Span, slack: float) -> bool:
    """Whether two links come nearer than the angle ``slack`` to one another."""
    (a, b), (c, d) = one.reach, other.reach
    apart = abs(math.remainder(0.5 * (a + b) - 0.5 * (c + d), TURN))
    return apart < 0.5 * (b - a) + 0.5 * (d - c) + slack


def hinged(one: Span, other: Span, slack: float) -> bool:
    """Whether two links that share a joint lie on its two sides, and meet nowhere else."""
    around = abs(one.sweep) + abs(other.sweep) + one.ear + other.ear + slack
    return one.sweep * other.sweep > 0.0 and around < TURN


def conflicts(spans: Sequence[Span], interleaved: bool, slack: float) -> set[tuple[int, int]]:
    """The pairs of links, the smaller number first, that cannot lie in one band.

    Links that share a joint may where their hinges are ``interleaved`` and they lie on its two
    sides; others where nothing of them overlaps.
    """
    n = len(spans)
    found = set()
    for a in range(n):
        for b in range(a + 1, n):
            if b - a in (1, n - 1):
                clash = not (interleaved and hinged(spans[a], spans[b], slack))
            else:
                clash = overlapping(spans[a], spans[b], slack)
            if clash:
                found.add((a, b))
    return found


def banded(count: int, clashes: set[tuple[int, int]]) -> tuple[int, ...]:
    """The band of each link, from 0: the lowest that no earlier link forbids."""
    bands: list[int] = []
    for b in range(count):
        taken = {bands[a] for a in range(b) if (a, b) in clashes}
        bands.append(next(band for band in range(count) if band not in taken))
    return tuple(bands)


def passed(bands: Sequence[int], joint: int) -> list[int]:
    """The links that the pin of a joint passes, on its way from its one link's band to the other's;
    joint k belongs to links k - 1 and k."""
    low, high = sorted((bands[joint - 1], bands[joint]))
    return [k for k, band in enumerate(bands) if low < band < high]


def pinned_through(spans: Sequence[Span], bands: Sequence[int], slack: float) -> list[int]:
    """The joints whose pin, on its way, meets a third link."""
    pins = [Span(span.start, 0.0, 0.0) for span in spans]
    return [
        joint
        for joint, pin in enumerate(pins)
        if any(overlapping(spans[k], pin, slack) for k in passed(bands, joint))
    ]


def ordered(spans: Sequence[Span], bands: Sequence[int], slack: float) -> tuple[int, ...]:
    """The same bands in the order in which the fewest pins meet third links."""
    count = max(bands) + 1
    if count > MOST_ORDERS:
        return tuple(bands)
    every = (tuple(order[band] for band in bands) for order in permutations(range(count)))
    return min(every, key=lambda bands: len(pinned_through(spans, bands, slack)))


def stacked(
    bands: Sequence[int], widths: Sequence[float], gap: float
) -> tuple[tuple[float, float], ...]:
    """The interval of each link along the axis: bands one above the other from 0, ``gap`` apart,
    each as wide as its widest link, all its links from its lower edge."""
    low: dict[int, float] = {}
    height = 0.0
    for band in sorted(set(bands)):
        low[band] = height
        height += gap + max(w for own, w in zip(bands, widths, strict=True) if own == band)
    return tuple((low[b], low[b] + w) for b, w in zip(bands, widths, strict=True))


def fingers(low: float, high: float, count: int) -> tuple[tuple[float, float], ...]:
    """The equal intervals into which two links divide their common part of a joint."""
    step = (high - low) / count
    return tuple((low + k * step, low + (k + 1) * step) for k in range(count))
