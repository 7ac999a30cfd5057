"""The quotient of two functions of t that may vanish together, with all its derivatives.

Where the denominator has a zero of order m at t0, both are divided by (t - t0)^m in their Taylor
series about t0, whose quotient stands in near t0. Along a stretch where the denominator is 0
throughout, the quotient goes linearly from its value before to its value behind, where both
vanish: whatever it divides is then free to be so.

Source: l'Hopital's rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.taylor import Array

Pair = Callable[[Array, int], tuple[Array, Array]]
"""Parameters t (n,) and an order K to the series (K + 1, n) of numerator and denominator."""

BISECTIONS = 12
"""Halvings of a bracket before Newton's method takes over."""
STEPS = 5
"""Steps of Newton's method for den/den', whose zeros are simple: from 1e-7 of a stretch two do."""
SAMPLES = 1025
"""Parameters looked at in all, at least 33 between two breaks."""
FLAT = 1e-12
"""A denominator below this share of its largest value all along a stretch is 0 there."""
STILL = 1e-11
"""So is one whose integral over the domain is below this, and a numerator vanishes beside it: both
are angles per parameter, and a straight spline turns by so much from rounding."""
VANISHES = 1e-9
"""A coefficient that counts as 0 at a zero, against the largest value over the whole domain."""
PRESENT = 1e-6
"""The first one that does not must exceed this: a zero of higher order is placed less well."""
NEAR = 1e-4
"""A dip of the denominator below this share of its largest value may be a zero."""
TERMS = 32
"""Order of the series about a zero."""
SHARE = 0.2
"""Share of the radius of convergence in which they are used: 0.2^30 drowns in rounding."""
MOST = 6
"""Highest order of a zero that is passed."""


@dataclass(frozen=True, slots=True)
class Pole:
    """Where the denominator vanishes and the numerator does not; ``stretch`` ends at another t
    where the denominator is 0 in between."""

    t: float
    stretch: float | None = None


@dataclass(frozen=True, slots=True)
class Quotient:
    """The quotient's own Taylor polynomials: ``places`` (z, 4) are the zero and the interval
    [low, high) around it where its row of ``tables`` (z, M) stands in."""

    places: Array
    tables: Array

    def of(self, t: Array, numerator: Array, denominator: Array) -> Array:
        """The series of the quotient at t (n,) from those of both, (K + 1, n)."""
        if not len(self.places):
            return taylor.div(numerator, denominator)
        safe = denominator.copy()
        inside = [(low <= t) & (t < high) for _, low, high in self.places]
        safe[0, np.any(inside, axis=0)] = 1.0
        out = taylor.div(numerator, safe)
        for (at, _, _), table, there in zip(self.places, self.tables, inside, strict=True):
            if there.any():
                out[:, there] = _shifted(table, t[there] - at, len(out) - 1)
        return out


ZERO = Quotient(np.zeros((0, 3)), np.zeros((0, TERMS + 1)))


def quotient(pair: Pair, ends: tuple[float, ...], size: float) -> Quotient | Pole:
    """The quotient over a domain, or the first place where it is infinite.

    Args:
        pair: both functions, in radians per unit of t; analytic between two consecutive ``ends``,
            of the right one at an end, of the last at the last.
        ends: the domain's ends and the breaks between them, increasing.
        size: what the numerator's values are measured against, besides the denominator's own.
    """
    each = max(33, SAMPLES // (len(ends) - 1))
    runs = [np.linspace(a, np.nextafter(b, a), each) for a, b in pairwise(ends)]
    values = [pair(run, 1) for run in runs]
    scale = max(float(np.abs(den[0]).max()) for _, den in values)
    scales = max(scale, size), scale
    still = STILL / (ends[-1] - ends[0])
    rows: list[tuple[Array, Array]] = []
    plane: list[int] = []
    for k, (run, (num, den)) in enumerate(zip(runs, values, strict=True)):
        if np.abs(den[0]).max() <= max(FLAT * scale, still):
            if np.abs(num[0]).max() > max(VANISHES * scales[0], still):
                return Pole(float(run[0]), float(ends[k + 1]))
            plane.append(k)
            continue
        zeros = _zeros(pair, run, den, scale)
        if not len(zeros):
            continue
        length = ends[k + 1] - ends[k]
        both = [side * length ** np.arange(TERMS + 1)[:, None] for side in pair(zeros, TERMS)]
        for at, *tables in zip(zeros.tolist(), *(table.T for table in both), strict=True):
            found = _about(at, (tables[0], tables[1]), (ends[k], ends[k + 1]), scales)
            if found is None:
                return Pole(at)
            rows.append(found)
    whole = _of(rows, ends)
    return _of(rows + _bridges(pair, whole, ends, plane), ends) if plane else whole


def _of(rows: list[tuple[Array, Array]], ends: tuple[float, ...]) -> Quotient:
    """The rows as one value; what reaches to the last end holds there too."""
    if not rows:
        return ZERO
    places = np.stack([place for place, _ in rows])
    places[places[:, 2] >= ends[-1], 2] = np.inf
    return Quotient(places, np.stack([table for _, table in rows]))


def _zeros(pair: Pair, t: Array, den: Array, scale: float) -> Array:
    """The zeros of the denominator on a stretch sampled at t (n,), den (2, n), increasing."""
    slope = den[0] * den[1]  # half that of the square
    reached = np.abs(den[0]) <= 2.0 * np.abs(den[1]) * (t[1] - t[0])  # a zero of any order is
    near = reached[:-1] | reached[1:]
    falling = np.flatnonzero((slope[:-1] < 0.0) & (slope[1:] > 0.0) & near)
    low, high = t[falling], t[falling + 1]
    for _ in range(BISECTIONS if len(falling) else 0):
        middle = 0.5 * (low + high)
        series = pair(middle, 1)[1]
        falls = series[0] * series[1] < 0.0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    places = 0.5 * (low + high)
    for _ in range(STEPS if len(falling) else 0):
        value, first, second = pair(places, 2)[1]
        with np.errstate(all="ignore"):
            step = value * first / (first * first - 2.0 * value * second)
        step = np.where(np.isfinite(step), step, 0.0)
        places = np.clip(places - step, t[falling], t[falling + 1])
    sampled = t[np.abs(den[0]) <= VANISHES * scale]  # the ends among them
    bottoms = np.concatenate([places, sampled])
    small = np.abs(pair(bottoms, 0)[1][0]) <= NEAR * scale if len(bottoms) else []
    found: list[float] = []
    for at in np.sort(bottoms[small]):
        if not found or at - found[-1] > 1e-7 * (t[-1] - t[0]):
            found.append(float(at))
    return np.array(found)


def _about(
    at: float, tables: tuple[Array, Array], run: tuple[float, float], scales: tuple[float, float]
) -> tuple[Array, Array] | None:
    """The quotient's polynomial about a zero of the denominator and where it stands in.

    ``tables`` are numerator and denominator in powers of (t - at) per length of the run. None
    where the numerator is too large there for a quotient.
    """
    length = run[1] - run[0]
    numerator, denominator = tables
    present = np.flatnonzero(np.abs(denominator[: MOST + 1]) > PRESENT * scales[1])
    if not len(present):
        return None
    m = int(present[0])
    if m:  # the zero of the derivative of order m - 1 is simple: one step of Newton
        step = -float(denominator[m - 1] / (m * denominator[m]))
        step = min(max(step, (run[0] - at) / length), (run[1] - at) / length)
        numerator, denominator = (
            _shifted(table, np.array([step]), TERMS)[:, 0] for table in tables
        )
        at += length * step
    small = VANISHES * scales[1], VANISHES * scales[0]
    if m and np.abs(denominator[:m]).max() > small[0]:
        m = 0  # a dip that is no zero
    if np.abs(numerator[:m]).max(initial=0.0) > small[1]:
        return None
    table = taylor.div(numerator[m:, None], denominator[m:, None])[:, 0]
    k = np.arange(1, len(table))
    with np.errstate(divide="ignore"):
        radius = float((((1.0 + abs(table[0])) / np.abs(table[1:])) ** (1.0 / k)).min())
    reach = SHARE * min(radius, 1.0) * length
    padded = np.zeros(TERMS + 1)
    padded[: len(table)] = table / length ** np.arange(len(table))
    return np.array([at, max(at - reach, run[0]), min(at + reach, run[1])]), padded


def _bridges(
    pair: Pair, whole: Quotient, ends: tuple[float, ...], plane: list[int]
) -> list[tuple[Array, Array]]:
    """The straight lines across the stretches (numbers of ``ends``) without a quotient."""

    def value(t: float) -> float:
        at = np.array([t])
        return float(whole.of(at, *pair(at, 0))[0, 0])

    rows = []
    last = len(ends) - 2
    for k in plane:
        first, end = k, k
        while first - 1 in plane:
            first -= 1
        while end + 1 in plane:
            end += 1
        low, high = ends[first], ends[end + 1]
        before = value(float(np.nextafter(low, ends[0]))) if first > 0 else None
        behind = value(high) if end < last else before
        before = behind if before is None else before
        table = np.zeros(TERMS + 1)
        if before is not None and behind is not None:
            table[:2] = before, (behind - before) / (high - low)
        rows.append((np.array([low, ends[k], ends[k + 1]]), table))
    return rows


def _shifted(table: Array, step: Array, order: int) -> Array:
    """The series (order + 1, n), at steps (n,) away, of one polynomial (M,)."""
    out = np.zeros((max(order + 1, len(table)), len(step)))
    out[: len(table)] = table[:, None]
    for k in range(order + 1):  # Horner's rule again and again: the Taylor shift
        for j in range(len(table) - 2, k - 1, -1):
            out[j] += step * out[j + 1]
    return out[: order + 1]
