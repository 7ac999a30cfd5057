"""How stitch holes are spread along a seam: between its ends, its cuts and its corners."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array
from devcad.shop.seamends import Edges, allowance_of, cut_open, kept_free
from devcad.shop.seamlines import Flags, SeamLine, corners, mates, reach, second_cut
from devcad.shop.settings import Stitch

CLOSE = 1e-9
"""Of a seam: lengths that differ by no more are one."""
LEAST = 0.5
"""Of the pitch: a stretch with less room has one hole, and corners keep so far from its ends."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Lengths ``s`` (n,) along the first edge of a seam, increasing, one for each hole.

    ``corner`` (n,) says which lie on corners of the seam, ``end`` (n,) which are the first or the
    last of a stretch, ``stretch`` (n,) numbers them: a loop has one between two cuts. ``step``
    (n,) is the pitch from the hole before, 0 of the first of a stretch; beside a corner the hole
    on it is as far off as its reach tells, beyond the step.
    """

    s: Array
    corner: Flags
    end: Flags
    stretch: Array
    step: Array

    def without(self, dropped: Flags) -> Spread:
        """The spread without some of its holes."""
        kept = ~dropped
        return replace(
            self,
            s=self.s[kept],
            corner=self.corner[kept],
            end=self.end[kept],
            stretch=self.stretch[kept],
            step=self.step[kept],
        )


def spread(line: SeamLine, edges: Edges, stitch: Stitch) -> Spread:
    """Where along a seam its holes lie, the same for both sides.

    At an open end the first hole keeps ``inset`` from the neighbouring edge that is cut, on
    either side. Round a loop the holes keep clear of where either sheet is cut open: by as much,
    and by half a pitch. Between those places and the corners of the seam, which have a hole, they
    are spread evenly, round(length / pitch) stitches from one to the next and at least one. The
    hole of a corner stands in for all that would crowd round it on its inner side. Where there
    is room for less than half a pitch there is one hole, in the middle.

    Raises:
        GeometryError: no room for a hole.
    """
    turns = _turns(line, edges, stitch)
    parts = [
        _stretch(line, low, high, turns, stitch.pitch, number)
        for number, (low, high) in enumerate(_stretches(line, edges, stitch))
    ]
    columns = [np.concatenate([getattr(part, name) for part in parts]) for name in Spread.__slots__]
    return Spread(*columns)


def _turns(line: SeamLine, edges: Edges, stitch: Stitch) -> Array:
    """The corners of a seam as rows (n, 3): how far along it they lie, and the stretches before
    and behind them over which their holes reach, on the side where they reach farther, mm."""
    x = corners(line.borders[0])
    if not x.size:
        return np.empty((0, 3))
    rows = []
    for side, at in enumerate((x, mates(line, x, np.ones(len(x), dtype=bool)))):
        panel, edge = line.sides[side], line.borders[side]
        offset = allowance_of(edges, panel.name, edge.name) - stitch.inset
        found = np.array([reach(panel, edge, float(one), offset) for one in at])
        rows.append(found if not side or line.mate.forward else found[:, ::-1])
    return np.column_stack([line.borders[0].arc(x), np.maximum(*rows)])


def _stretch(
    line: SeamLine, low: float, high: float, turns: Array, pitch: float, number: int
) -> Spread:
    """The holes between two places, with one on each corner between."""
    if high < low - CLOSE * line.length:
        raise GeometryError(
            "stitch: the seam has no room for a hole that keeps the inset from both its ends",
            place=line.place,
            value=line.length,
            limit=line.length + low - high,
            remedy="use a smaller inset, or a larger allowance on the edges beside the seam",
        )
    least = LEAST * pitch
    inner = turns[(turns[:, 0] > low) & (turns[:, 0] < high)]
    if not len(inner) and high - low < least:
        return _holes([0.5 * (low + high)], [0.0], inner, number)
    start, s, steps = low, [low], [0.0]
    for at, before, behind in inner.tolist():
        if len(s) == 1 and at - before < low + least:
            s = [at]  # in place of the first hole
        else:
            _run(s, steps, start, at - before, pitch)
            s[-1] = at
        start = at + behind
    if not len(inner) or high >= start + least:
        _run(s, steps, start, high, pitch)
    return _holes(s, steps, inner[:, 0], number)


def _run(s: list[float], steps: list[float], low: float, high: float, pitch: float) -> None:
    """Put the holes of one run behind those that are there."""
    count = max(1, round((high - low) / pitch))
    step = (high - low) / count
    s += [*(low + step * np.arange(1, count)).tolist(), high]
    steps += [step] * count


def _holes(s: list[float], steps: list[float], corner: Array, number: int) -> Spread:
    end = np.zeros(len(s), dtype=bool)
    end[[0, -1]] = True
    places = np.array(s)
    return Spread(places, np.isin(places, corner), end, np.full(len(s), number), np.array(steps))


def _stretches(line: SeamLine, edges: Edges, stitch: Stitch) -> list[tuple[float, float]]:
    """From where to where along the first edge there may be holes."""
    if line.borders[0].loop:
        return _between_cuts(line, edges, stitch)
    free = [[kept_free(line, side, end, edges, stitch) for end in (False, True)] for side in (0, 1)]
    if not line.mate.forward:
        free[1].reverse()
    before, after = (max(pair) for pair in zip(*free, strict=True))
    return [(before, line.length - after)]


def _between_cuts(line: SeamLine, edges: Edges, stitch: Stitch) -> list[tuple[float, float]]:
    """The stretches of a loop between the places where either sheet is cut open."""
    length = line.length
    half = 0.5 * length / max(1, round(length / stitch.pitch))
    cuts: dict[float, list[float]] = {}
    places = [(0, 0.0), (1, second_cut(line))]
    for side, at in [place for place in places if cut_open(line, place[0])] or places[:1]:
        same = [s for s in cuts if min(abs(at - s), length - abs(at - s)) <= CLOSE * length]
        free = cuts.setdefault(same[0] if same else at, [0.0, 0.0])
        sides = [kept_free(line, side, end, edges, stitch) for end in (True, False)]
        if side and not line.mate.forward:
            sides.reverse()
        free[:] = [max(pair) for pair in zip(free, sides, strict=True)]
    rows = sorted((s, *free) for s, free in cuts.items())
    gaps = [b[0] - a[0] for a, b in pairwise([*rows, (length + rows[0][0],)])]
    out = []
    for k, gap in enumerate(gaps):  # behind cut k
        least = min(half, 0.25 * gap)  # two cuts may be nearer than a pitch
        ahead = [s - length * (i > k) + behind for i, (s, _, behind) in enumerate(rows)]
        back = [s + length * (i <= k) - before for i, (s, before, _) in enumerate(rows)]
        low, high = rows[k][0] + least, rows[k][0] + gap - least
        out.append((max(low, *ahead), min(high, *back)))
    kept = [(low, high) for low, high in out if low <= high]  # near cuts have nothing between
    return kept or out[:1]
