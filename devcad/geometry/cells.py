"""Cells: what cuts leave of the stretches of a panel between its rulings, edge by edge.

A cell is bordered by two rulings and the two rails between them; counterclockwise, as the front
shows it: side 0 the first ruling, 1 the rail at v_to, 2 the last ruling, 3 the rail at v_from.
The mesh takes the strips between its rulings, STEP its faces, the pattern the whole panel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.chain import Chain
from devcad.geometry.crossings import SNAP, Passage, Place, passages
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Key = tuple[int, int, float]
"""Cut, track and u of a place on a cut; the end of a track counts as the next one's start."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a run meets a cell's border: on which side, of which patch, ``at`` = v on a ruling
    and t on a rail. ``key`` is the same to the bit for both cells that share the place."""

    side: int
    patch: int
    at: float
    key: Key


@dataclass(frozen=True, slots=True)
class Piece:
    """The stretch of cuts[cut].tracks[track] over ``u`` = (from, to), from < to."""

    cut: int
    track: int
    u: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Run:
    """Pieces one after the other inside a cell, from border to border; closed without spots."""

    pieces: tuple[Piece, ...]
    first: Spot | None = None
    last: Spot | None = None


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of the border, run counterclockwise from ``start`` to ``end`` (v on the sides 0
    and 2, t on 1 and 3); ``first`` and ``last`` are the spots there, None at a corner."""

    side: int
    patch: int
    start: float
    end: float
    first: Spot | None = None
    last: Spot | None = None


Loop = tuple[Stretch | Run, ...]


@dataclass(frozen=True, slots=True)
class Cell:
    """``loops`` bound what is left of the cell, counterclockwise, none where nothing is;
    ``holes`` are the closed runs inside, clockwise."""

    loops: tuple[Loop, ...]
    holes: tuple[Run, ...]


def cells(cuts: Sequence[Cut], chain: Chain, number: int, borders: Array) -> tuple[Cell, ...]:
    """The cells of patch ``number`` between consecutive rulings t = ``borders`` (k + 1,).

    The first and the last of the borders are the ends of the patch. A cut that only touches a
    border stays on its side; one that runs along a border counts to the cell after it.
    Raises:
        GeometryError: the cuts cross each other.
    """
    patch = chain.patches[number]
    runs = _runs(passages(cuts, chain, number, borders))
    frames = [_border(number, patch, a, b) for a, b in pairwise(borders)]
    if not any(run.first is not None for cell in runs.values() for run in cell):
        kept = [_kept(cuts, chain, number)] * len(frames)
    else:
        kept = _states(frames, runs)
    return tuple(
        _cell(frame, runs.get(k, []), keep)
        for k, (frame, keep) in enumerate(zip(frames, kept, strict=True))
    )


def whole(cuts: Sequence[Cut], chain: Chain) -> Cell:
    """The panel as one cell, from its first ruling to its last.

    Raises:
        GeometryError: the cuts cross each other.
    """
    fronts = [_border(k, patch, *patch.domain) for k, patch in enumerate(chain.patches)]
    frame = [
        fronts[0][0],
        *(front[1] for front in fronts),
        fronts[-1][2],
        *(front[3] for front in reversed(fronts)),
    ]
    passed = [p for k in range(len(fronts)) for p in passages(cuts, chain, k, None)]
    passed = _over_joints(sorted(passed, key=lambda p: (p.cut, p.track, p.u[0])), chain)
    runs = _runs(_off_seam(passed, cuts, chain) if chain.closed else passed)
    return _cell(frame, runs.get(0, []), True)


def _border(number: int, patch: Patch, a: float, b: float) -> list[Stretch]:
    """The four sides of the cell between the rulings a and b."""
    jet = patch.jet([a, b], 0)
    (low, high), (low_end, high_end) = np.stack([jet.v_from[0], jet.v_to[0]], axis=1).tolist()
    a, b = float(a), float(b)
    return [
        Stretch(0, number, low, high),
        Stretch(1, number, a, b),
        Stretch(2, number, high_end, low_end),
        Stretch(3, number, b, a),
    ]


def _over_joints(passed: list[Passage], chain: Chain) -> list[Passage]:
    """The passages of a whole panel: only the seam of a tube and the sheet's edges end one."""
    last = len(chain.patches) - 1

    def outer(place: Place | None) -> Place | None:
        if place is None or place.side in (1, 3):
            return place
        at_edge = place.patch == last if place.side == 2 else place.patch == 0
        return place if at_edge else None

    return [Passage(p.cut, p.track, p.u, 0, outer(p.enters), outer(p.leaves)) for p in passed]


def _off_seam(passed: list[Passage], cuts: Sequence[Cut], chain: Chain) -> list[Passage]:
    """The passages of a tube without those that lie along its seam: there the pattern's edge is
    cut already, and the contour is open."""
    ring = list(passed)
    for k in range(len(ring) - 1, -1, -1):
        p = ring[k]
        side = _lies_along(cuts[p.cut].tracks[p.track], p.u, chain)
        mates = [i for i, q in enumerate(ring) if q.cut == p.cut]
        if side is None or len(mates) < 2:
            continue
        at = mates.index(k)
        before, after = mates[at - 1], mates[(at + 1) % len(mates)]
        track = cuts[p.cut].tracks[p.track]
        v, end = track.series(np.array(p.u))[:, 1].tolist()
        if p.enters is None:
            place = Place(side, track.patch, v, (p.cut, p.track, p.u[0]))
            ring[before] = replace(ring[before], leaves=place)
        if p.leaves is None:
            place = Place(side, track.patch, end, (p.cut, p.track, p.u[1]))
            ring[after] = replace(ring[after], enters=place)
        del ring[k]
    return ring


def _lies_along(track: Track, u: tuple[float, float], chain: Chain) -> int | None:
    """The side, 0 or 2, of the seam along which a stretch lies, if it does."""
    low, high = chain.patches[track.patch].domain
    t = track.series(np.linspace(*u, 5))[:, 0]
    if track.patch == 0 and np.abs(t - low).max() <= SNAP * (high - low):
        return 0
    if track.patch == len(chain.patches) - 1 and np.abs(t - high).max() <= SNAP * (high - low):
        return 2
    return None


def _runs(passed: list[Passage]) -> dict[int, list[Run]]:
    """The passages of each cell joined to runs."""
    out: dict[int, list[Run]] = {}
    groups: dict[int, list[Passage]] = {}
    for passage in passed:
        groups.setdefault(passage.cut, []).append(passage)
    for group in groups.values():
        starts = [k for k, p in enumerate(group) if p.enters is not None]
        if not starts:
            pieces = tuple(Piece(p.cut, p.track, p.u) for p in group)
            out.setdefault(group[0].cell, []).append(Run(pieces))
            continue
        order = group[starts[0] :] + group[: starts[0]]
        pieces_: list[Piece] = []
        first: Spot | None = None
        for p in order:
            if p.enters is not None:
                first, pieces_ = _spot(p.enters), []
            pieces_.append(Piece(p.cut, p.track, p.u))
            if p.leaves is not None:
                out.setdefault(p.cell, []).append(Run(tuple(pieces_), first, _spot(p.leaves)))
    return out


def _spot(place: Place) -> Spot:
    return Spot(place.side, place.patch, place.at, place.key)


def _kept(cuts: Sequence[Cut], chain: Chain, number: int) -> bool:
    """Whether a patch that no open run crosses is there: a notch may take the end of a sheet."""
    if all(cut.closed for cut in cuts):
        return True
    ends = range(len(chain.patches))
    for other, row in [
        *((k, 1) for k in reversed(ends[:number])),
        *((k, 0) for k in ends[number:]),
    ]:
        patch = chain.patches[other]
        runs = _runs(passages(cuts, chain, other, np.array(patch.domain))).get(0, [])
        if any(run.first is not None for run in runs):
            return _corners_kept(_border(other, patch, *patch.domain), runs)[row]
    return True


def _states(frames: list[list[Stretch]], runs: dict[int, list[Run]]) -> list[bool]:
    """Per cell, whether it is there if no run crosses it: as the nearest cell that one crosses."""
    known: list[tuple[bool, bool] | None] = [
        _corners_kept(frame, runs[k]) if any(r.first for r in runs.get(k, [])) else None
        for k, frame in enumerate(frames)
    ]
    states: list[bool] = []
    for k, own in enumerate(known):
        before = next((x[1] for x in known[:k][::-1] if x is not None), None)
        after = next((x[0] for x in known[k:] if x is not None), True)
        states.append(True if own is not None else after if before is None else before)
    return states


def _corners_kept(frame: list[Stretch], runs: list[Run]) -> tuple[bool, bool]:
    """Whether the first and the last ruling are left, where no run crosses them: told by their
    middles, as a notch may end in a corner."""
    events = _events(frame, [run for run in runs if run.first is not None])

    def kept(position: float) -> bool:
        following = next((e for e in events if e[0] >= position), events[0])
        return following[1]

    return kept(0.5), kept(2.5)


def _cell(frame: list[Stretch], runs: list[Run], kept: bool) -> Cell:
    holes = tuple(run for run in runs if run.first is None)
    crossing = [run for run in runs if run.first is not None]
    if crossing:
        return Cell(_traced(frame, crossing), holes)
    drawn = tuple(side for side in frame if side.start != side.end)
    return Cell((drawn,) if kept else (), holes)


def _position(frame: list[Stretch], spot: Spot) -> float:
    """The number of the border's stretch that a spot is on, and its share of it."""
    k = next(i for i, s in enumerate(frame) if (s.side, s.patch) == (spot.side, spot.patch))
    start, end = frame[k].start, frame[k].end
    share = (spot.at - start) / (end - start) if end != start else 0.0
    return k + min(max(share, 0.0), 1.0)


def _events(frame: list[Stretch], runs: list[Run]) -> list[tuple[float, bool, int]]:
    """Where runs start (True) and end along the border, in order; of those at one place, the one
    that keeps starts and ends taking turns comes first."""
    events = []
    for k, run in enumerate(runs):
        assert run.first is not None and run.last is not None
        events += [(_position(frame, run.first), True, k), (_position(frame, run.last), False, k)]
    events.sort(key=lambda e: e[0])
    if len(events) > 2:
        for k in range(len(events)):
            i, j = k - 1, (k + 1) % len(events)
            if events[i][1] == events[k][1] and events[k][0] == events[j][0] and j > k:
                events[k], events[j] = events[j], events[k]
    if any(a[1] == b[1] for a, b in zip(events, events[1:] + events[:1], strict=True)):
        raise GeometryError(
            "cutout-crosses-edge: the contours of cutouts cross each other",
            remedy="move them apart, or give one of them notch = true",
        )
    return events


def _traced(frame: list[Stretch], runs: list[Run]) -> tuple[Loop, ...]:
    """The loops that runs and the border between them make."""
    events = _events(frame, runs)
    following = {
        end[2]: (end, start)
        for end, start in zip(events, events[1:] + events[:1], strict=True)
        if not end[1]
    }
    left = set(range(len(runs)))
    loops: list[Loop] = []
    while left:
        k = first = min(left)
        loop: list[Stretch | Run] = []
        while True:
            left.discard(k)
            loop.append(runs[k])
            end, start = following[k]
            loop += _along(frame, end[0], start[0], runs[k].last, runs[start[2]].first)
            k = start[2]
            if k == first:
                break
        loops.append(tuple(loop))
    return tuple(loops)


def _along(
    frame: list[Stretch], start: float, end: float, first: Spot | None, last: Spot | None
) -> list[Stretch]:
    """The border from one spot on to another, counterclockwise."""
    size = len(frame)
    k = _number(frame, first)
    stop = _number(frame, last)
    out: list[Stretch] = []
    assert first is not None and last is not None
    if k == stop and end >= start:
        return [_cut(frame[k], first, last)] if first.at != last.at else []
    if first.at != frame[k].end:
        out.append(_cut(frame[k], first, None))
    for i in range(k + 1, stop + (size if stop <= k else 0)):
        side = frame[i % size]
        if side.start != side.end:
            out.append(side)
    if last.at != frame[stop].start:
        out.append(_cut(frame[stop], None, last))
    return out


def _number(frame: list[Stretch], spot: Spot | None) -> int:
    assert spot is not None
    return next(i for i, s in enumerate(frame) if (s.side, s.patch) == (spot.side, spot.patch))


def _cut(side: Stretch, first: Spot | None, last: Spot | None) -> Stretch:
    """The stretch of a side between two spots."""
    return Stretch(
        side.side,
        side.patch,
        side.start if first is None else first.at,
        side.end if last is None else last.at,
        first,
        last,
    )
