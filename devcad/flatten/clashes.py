"""Where cutouts meet one another: which cross or touch, and which lie in which."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten import meeting
from devcad.flatten.cover import Cover, Index
from devcad.flatten.meeting import Meeting
from devcad.flatten.polygons import winding
from devcad.geometry.cuts import Track
from devcad.geometry.lines import sign_changes
from devcad.geometry.taylor import Array

SAMPLES = 33
"""Places of a track's panel by which its box is known."""


@dataclass(frozen=True, slots=True)
class Sampled:
    """Tracks side by side with their samples: ``owner`` (n,) the contour of each track, ``points``
    in the pattern and ``places`` (t, v) on the patch, one array (m, 2) each, at ``u``. Of
    contours that the sheet's edge cuts off, ``polygons`` are the whole in the pattern."""

    tracks: Sequence[Track]
    owner: Index
    u: list[Array]
    points: list[Array]
    places: list[Array]
    polygons: dict[int, tuple[Array, ...]]
    cover: Cover

    def image(self, k: int, u: Array) -> Array:
        """The points of track k in the pattern, (n, 2)."""
        places = self.tracks[k].series(u)
        development = self.cover.developments[self.tracks[k].patch]
        return development.points(places[:, 0], places[:, 1])


@dataclass(frozen=True, slots=True)
class Region:
    """What one contour cuts out: to the right of its tracks, and in its ``polygons``."""

    tracks: tuple[Track, ...]
    polygons: tuple[Array, ...]


def sampled(
    tracks: Sequence[Track],
    owner: Sequence[int],
    polygons: dict[int, tuple[Array, ...]],
    cover: Cover,
) -> Sampled:
    """Tracks with their samples, all tracks of a patch evaluated together."""
    share = np.linspace(0.0, 1.0, SAMPLES)
    us, places = [], []
    for track in tracks:
        knots = track.series.knots
        inner = knots[:-1, None] + np.diff(knots)[:, None] * share[:-1]
        us.append(np.append(inner.ravel(), knots[-1]))
        places.append(track.series(us[-1]))
    points: list[Array] = [np.zeros(0)] * len(tracks)
    for k in {track.patch for track in tracks}:
        own = [i for i, track in enumerate(tracks) if track.patch == k]
        both = np.concatenate([places[i] for i in own])
        flat = cover.developments[k].points(both[:, 0], both[:, 1])
        ends = np.cumsum([len(us[i]) for i in own])[:-1]
        for i, part in zip(own, np.split(flat, ends), strict=True):
            points[i] = part
    return Sampled(tracks, np.array(owner, dtype=np.intp), us, points, places, polygons, cover)


def meetings(found: Sampled, pairs: Sequence[tuple[int, int]]) -> list[Meeting]:
    """Where the tracks of each pair cross or touch in the pattern."""
    if not pairs:
        return []
    used = np.unique(np.array(pairs))
    rank = {int(k): i for i, k in enumerate(used.tolist())}

    def image(which: Index, u: Array) -> Array:
        out = np.empty((len(u), 2))
        starts = np.flatnonzero(np.diff(which, prepend=-1))
        for a, b in pairwise([*starts.tolist(), len(u)]):
            out[a:b] = found.image(int(used[which[a]]), u[a:b])
        return out

    knots = [found.tracks[k].series.knots for k in used.tolist()]
    lines = meeting.curves(image, knots, found.cover.size)
    ranks = [(rank[i], rank[j]) for i, j in pairs]
    return meeting.renumbered(meeting.meetings(lines, ranks, found.cover.near), used)


def close_pairs(found: Sampled) -> list[tuple[int, int]]:
    """Pairs of tracks of different contours, on one patch or on neighbouring ones, whose boxes
    overlap."""
    low = np.array([p.min(axis=0) for p in found.points])
    high = np.array([p.max(axis=0) for p in found.points])
    wider = 0.05 * (high - low).max(axis=1, keepdims=True) + found.cover.near
    low, high = low - wider, high + wider
    patch = np.array([track.patch for track in found.tracks])
    order = np.argsort(low[:, 0])
    until = np.searchsorted(low[order, 0], high[order, 0], side="right")
    count = until - np.arange(len(order)) - 1
    a = np.repeat(np.arange(len(order)), count)
    b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count)
    i, j = order[a], order[b]
    close = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    close &= (found.owner[i] != found.owner[j]) & (np.abs(patch[i] - patch[j]) <= 1)
    return list(zip(i[close].tolist(), j[close].tolist(), strict=True))


def regions(found: Sampled) -> dict[int, Region]:
    """What every contour cuts out, by its number."""
    out: dict[int, list[Track]] = {}
    for owner, track in zip(found.owner.tolist(), found.tracks, strict=True):
        out.setdefault(owner, []).append(track)
    return {
        owner: Region(tuple(tracks), found.polygons.get(owner, ())) for owner, tracks in out.items()
    }


def inside(found: Sampled) -> list[tuple[int, int]]:
    """Pairs of contours (inner, outer) of which the first begins in the second."""
    first = {int(o): k for k, o in reversed(list(enumerate(found.owner)))}
    inner = np.array(sorted(first))
    track = [first[int(o)] for o in inner]
    at = np.array([found.places[k][len(found.places[k]) // 2] for k in track])
    home = np.array([found.tracks[k].patch for k in track])
    number: dict[tuple[int, int], list[int]] = {}
    for k, (o, t) in enumerate(zip(found.owner.tolist(), found.tracks, strict=True)):
        number.setdefault((o, t.patch), []).append(k)
    out = []
    for outer, region in regions(found).items():
        for patch in range(len(found.cover.chain.patches)):
            hit = (home == patch) & (inner != outer)
            if not region.polygons:  # all of its border is here
                own = number.get((outer, patch))
                if own is None:
                    continue
                places = np.concatenate([found.places[k] for k in own])
                low, high = places.min(axis=0), places.max(axis=0)
                hit &= np.all((at >= low) & (at <= high), axis=1)
            rows = np.flatnonzero(hit).tolist()
            out += [(int(inner[r]), outer) for r in rows if within(at[r], patch, region, found)]
    return sorted(out)


def within(place: Array, patch: int, region: Region, found: Sampled) -> bool:
    """Whether a place (t, v) of a patch lies in what one contour cuts out.

    The nearest of its tracks on the ruling through the place tells: the sheet is on its left.
    Where there is none, the contour in the pattern does.
    """
    nearest, rising = np.inf, True
    for track in region.tracks:
        if track.patch == patch:
            for v, up in _passes(track, float(place[0])):
                if abs(v - place[1]) < abs(nearest):
                    nearest, rising = v - float(place[1]), up
    if np.isfinite(nearest):
        return (nearest > 0.0) != rising
    if not region.polygons:
        return False
    point = found.cover.developments[patch].points(place[:1], place[1:])[0]
    return any(winding(polygon, point) != 0 for polygon in region.polygons)


def _passes(track: Track, t: float) -> list[tuple[float, bool]]:
    """Where a track passes a ruling: v, and whether t rises."""
    table = track.series.coefficients.copy()
    table[:, 0, 0] -= t
    row, x = sign_changes(table[..., 0], 0.0)
    out = []
    for k, at in zip(row.tolist(), x.tolist(), strict=True):
        rise = np.polynomial.chebyshev.chebder(table[k, :, 0])
        up = bool(np.polynomial.chebyshev.chebval(at, rise) > 0.0)
        out.append((float(np.polynomial.chebyshev.chebval(at, table[k, :, 1])), up))
    return out
