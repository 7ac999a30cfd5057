"""The union of cutouts that cross one another: one contour around all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.clashes import Region, Sampled, regions, within
from devcad.flatten.meeting import Meeting
from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise, clenshaw
from devcad.geometry.cuts import Track
from devcad.geometry.resolving import unit_nodes
from devcad.geometry.taylor import Array

SNAP = 1e-9
"""Of a track's parameter: a crossing as near to its end is one at its end."""
Run = tuple[Track, ...]


@dataclass(frozen=True, slots=True)
class Part:
    """A stretch of contour ``owner`` from node to node (-1 at an edge of the sheet), as tracks."""

    owner: int
    tracks: tuple[Track, ...]
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Contour:
    """A contour of a union: its number, its run of tracks and the places of these among the
    sampled ones."""

    owner: int
    run: Run
    numbers: tuple[int, ...]
    closed: bool


def union(
    contours: Sequence[Contour], found: Sampled, met: Sequence[Meeting], names: Sequence[str]
) -> list[tuple[int, Run, bool]]:
    """The runs around contours that meet at ``met``: what of every contour lies in none of the
    others; with the number of a contour that each is of, and whether it is closed.

    Raises:
        GeometryError: two contours touch without crossing, or run along one another.
    """
    nodes = _nodes(found, met, names)
    parts = [part for contour in contours for part in _parts(contour, nodes)]
    borders = regions(found)
    group = {contour.owner: borders[contour.owner] for contour in contours}
    kept = [part for part in parts if not _swallowed(part, group, found)]
    after: dict[int, Part] = {}
    for part in kept:
        if part.start >= 0:
            if part.start in after:
                raise _touch(names[part.owner], names[after[part.start].owner])
            after[part.start] = part
    out: list[tuple[int, Run, bool]] = []
    used: set[int] = set()
    opening = [part for part in kept if part.start < 0]
    for first in [*opening, *kept]:
        if id(first) in used:
            continue
        loop, part = [], first
        while id(part) not in used:
            used.add(id(part))
            loop.append(part)
            if part.end < 0:
                break
            if part.end not in after:
                raise _touch(names[part.owner], names[first.owner])
            part = after[part.end]
        closed = loop[-1].end >= 0 or loop[0].start == -2
        run = tuple(track for piece in loop for track in piece.tracks)
        out.append((min(piece.owner for piece in loop), run, closed))
    return out


def restricted(series: Piecewise, low: float, high: float) -> Piecewise:
    """The series between two parameters inside its own."""
    inner = series.knots[(series.knots > low) & (series.knots < high)]
    knots = np.concatenate([[low], inner, [high]])
    number = series.coefficients.shape[1]
    share = unit_nodes(max(number, 2))
    tables = []
    for a, b in zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True):
        k = int(np.searchsorted(series.knots, 0.5 * (a + b), side="right")) - 1
        start, end = series.knots[k], series.knots[k + 1]
        u = a * (1.0 - share) + b * share
        x = ((u - start) - (end - u)) / (end - start)
        same = np.repeat(series.coefficients[k : k + 1], len(u), axis=0)
        values = clenshaw(same, x)
        tables.append(chebyshev.transform(len(share)) @ values)
    return Piecewise(knots, np.stack(tables))


def _nodes(
    found: Sampled, met: Sequence[Meeting], names: Sequence[str]
) -> dict[int, list[tuple[float, int]]]:
    """For each track the places u of its meetings with the numbers of their nodes: meetings at
    one point are one node."""
    out: dict[int, list[tuple[float, int]]] = {}
    points: list[Array] = []
    for meeting in met:
        at = found.image(meeting.first, np.array([meeting.u]))[0]
        far = [float(np.hypot(*(at - p))) for p in points]
        node = int(np.argmin(far)) if far and min(far) <= 100.0 * found.cover.near else len(points)
        if node == len(points):
            points.append(at)
        for k, u in ((meeting.first, meeting.u), (meeting.second, meeting.w)):
            out.setdefault(k, []).append((u, node))
    _refuse_along(found, met, names)
    return out


def _refuse_along(found: Sampled, met: Sequence[Meeting], names: Sequence[str]) -> None:
    """Refuse contours that touch without crossing at an angle."""
    for meeting in met:
        if not meeting.crossing:
            first, second = (int(found.owner[k]) for k in (meeting.first, meeting.second))
            raise _touch(names[first], names[second])


def _parts(contour: Contour, nodes: dict[int, list[tuple[float, int]]]) -> list[Part]:
    """A contour cut at its nodes."""
    pieces: list[tuple[Track, int]] = []  # each with the node at its start, or -1
    pending = -1
    for track, number in zip(contour.run, contour.numbers, strict=True):
        low, high = track.u
        snap = SNAP * (high - low)
        inner: list[tuple[float, int]] = []
        last = -1
        for u, node in sorted(nodes.get(number, [])):
            if u - low <= snap:
                pending = node
            elif high - u <= snap:
                last = node
            elif not inner or u - inner[-1][0] > snap:
                inner.append((u, node))
        cuts = [(low, pending), *inner, (high, last)]
        for (a, node), (b, _) in pairwise(cuts):
            whole = len(cuts) == 2
            series = track.series if whole else restricted(track.series, a, b)
            pieces.append((Track(track.patch, series), node))
        pending = last
    if contour.closed and pending >= 0 and pieces[0][1] < 0:
        pieces[0] = (pieces[0][0], pending)
    starts = [i for i, (_, node) in enumerate(pieces) if node >= 0]
    if not starts:
        ends = -2 if contour.closed else -1  # closed, but without any node
        return [Part(contour.owner, contour.run, ends, -1)]
    groups: list[Part] = []
    order = pieces[starts[0] :] + (pieces[: starts[0]] if contour.closed else [])
    if not contour.closed and starts[0] > 0:
        head = tuple(track for track, _ in pieces[: starts[0]])
        groups.append(Part(contour.owner, head, -1, pieces[starts[0]][1]))
    marks = [i for i, (_, node) in enumerate(order) if node >= 0] + [len(order)]
    final = order[0][1] if contour.closed else pending
    for a, b in pairwise(marks):
        tracks = tuple(track for track, _ in order[a:b])
        end = order[b][1] if b < len(order) else final
        groups.append(Part(contour.owner, tracks, order[a][1], end))
    return groups


def _swallowed(part: Part, group: dict[int, Region], found: Sampled) -> bool:
    """Whether a part lies in another contour, judged by the middle of its longest track."""
    lengths = []
    for track in part.tracks:
        places = track.series(np.linspace(*track.u, 9))
        development = found.cover.developments[track.patch]
        points = development.points(places[:, 0], places[:, 1])
        lengths.append(float(np.hypot(*np.diff(points, axis=0).T).sum()))
    track = part.tracks[int(np.argmax(lengths))]
    place = track.series(np.array([0.43 * track.u[0] + 0.57 * track.u[1]]))[0]
    return any(
        within(place, track.patch, region, found)
        for owner, region in group.items()
        if owner != part.owner
    )


def _touch(first: str, second: str) -> GeometryError:
    return GeometryError(
        f"cutout-crosses-edge: {first} and {second} touch without crossing",
        remedy="let them overlap by more, or move them apart",
    )
