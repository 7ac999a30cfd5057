"""Legs: the stretches of cuts in one strip that become edges, and the vertices between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from devcad.export._step_body import Cone, Cylinder, Ruled
from devcad.export._step_chart import heights
from devcad.export._step_draft import Draft
from devcad.export._step_places import Ground, place_across
from devcad.export._step_sides import place_on
from devcad.export._step_touches import BESIDE, drift, turns
from devcad.export._step_tracks import Indices, Tracks, breaks, corners
from devcad.geometry.cells import Run, Spot
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.cuts import Cut
from devcad.geometry.fit import FLOOR
from devcad.geometry.taylor import Array

TOUCH = 2e-7
"""mm: edges nearer than this are one to the kernels, so a cut as near to a ruling touches it."""
LENGTHS = np.linspace(0.0, 1.0, 9)
AHEAD = 1e-5
"""Of a leg: the step by which its direction at an end is measured."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A stretch of a track over ``u``; ``spots`` are the places on the strip's border at its
    ends, None inside. ``nearest``: whether it lies next to the true contour on a fitted face;
    ``drift`` (a, b): a + b t is added to t."""

    cut: int
    track: int
    u: tuple[float, float]
    spots: tuple[Spot | None, Spot | None]
    nearest: bool
    drift: tuple[float, float] = (0.0, 0.0)


def legs(ground: Ground, cuts: Sequence[Cut], run: Run) -> list[Leg]:
    """The legs of a run: its pieces, cut where a notch touches an end of the strip; a contour that
    is one piece in two, for an edge has two vertices.

    A run that ends on a long edge keeps to the shares of the rulings, as that edge does.
    """
    on_rail = any(s is not None and s.side in (1, 3) for s in (run.first, run.last))
    aside = drift(ground, cuts, run)
    out: list[Leg] = []
    for piece in run.pieces:
        a, b = piece.u
        series = cuts[piece.cut].tracks[piece.track].series
        inner = [u for u in corners(series, ground.skin.strip.patch) if a < u < b]
        if run.first is not None:
            inner = sorted({*inner, *turns(ground, series, a, b)})
        elif len(run.pieces) == 1 and not inner:
            inner = [0.5 * (a + b)]
        out += [
            Leg(piece.cut, piece.track, u, (None, None), not on_rail, aside)
            for u in pairwise([a, *inner, b])
        ]
    out[0] = replace(out[0], spots=(run.first, out[0].spots[1]))
    out[-1] = replace(out[-1], spots=(out[-1].spots[0], run.last))
    return out


@dataclass(frozen=True)
class Legs:
    """All legs of a strip side by side.

    ``places`` (legs, 2, 2) are t and v at their ends, ``own`` (legs, 2, layers, width) the rows
    there as the tracks have them, ``ends`` those of the vertices; what lies between is drawn to
    these. ``vertices`` are the legs' start and end, on every layer.
    """

    ground: Ground
    tracks: Tracks
    legs: list[Leg]
    breaks: list[tuple[float, ...]]
    places: Array
    own: Array
    ends: Array
    vertices: list[tuple[tuple[int, ...], tuple[int, ...]]]

    @cached_property
    def length(self) -> Array:
        """About how long each is, mm, (legs,)."""
        points = self.rows(np.arange(len(self.legs)), LENGTHS)[:, :, 0, :3]
        return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))

    def rows(self, which: Indices, shares: Array) -> Array:
        """Points and places at shares (m,) of some of the legs, (n, m, layers, width)."""
        places = self.tracks(which, shares)
        found = _rows(self.ground, self.legs, which, _moved(self.legs, which, places))
        return found + _drawn((self.ends - self.own)[which], shares)

    def truth(self, shares: Array) -> Array:
        """The true points at shares (m,) of all legs, (legs, m, layers, 3): the contours on the
        layers, beside a mitre led on to the layers' edges."""
        t, v = self.tracks(np.arange(len(self.legs)), shares).reshape(-1, 2).T
        points = self.ground.truth(np.clip(t, *self.ground.skin.strip.ends), v)
        points = points.reshape(len(self.legs), len(shares), -1, 3)
        if not self.ground.skin.lifts.any():
            return points
        return points + _drawn((self.ends - self.own)[..., :3], shares)


def _moved(legs: list[Leg], which: Indices, places: Array) -> Array:
    """Places (n, m, 2) of some of the legs, kept off the strip's ends."""
    drifts = np.array([legs[k].drift for k in which])
    if drifts.any():
        places[:, :, 0] += drifts[:, :1] + drifts[:, 1:] * places[:, :, 0]
    return places


def _drawn(miss: Array, shares: Array) -> Array:
    """What is added at shares (m,) of legs that miss their ends by ``miss`` (n, 2, ...)."""
    back = shares.reshape(-1, *(1,) * (miss.ndim - 2))
    return np.asarray((1.0 - back) * miss[:, :1] + back * miss[:, 1:])


def _rows(ground: Ground, legs: list[Leg], which: Indices, places: Array) -> Array:
    """The rows of some of the legs as their tracks have them, (n, m, layers, width)."""
    nearest = np.repeat([legs[k].nearest for k in which], places.shape[1])
    t, v = places.reshape(-1, 2).T
    found = ground.rows(t, v, nearest)
    return np.asarray(found.reshape(*places.shape[:2], *found.shape[1:]))


def tied(draft: Draft, ground: Ground, cuts: Sequence[Cut], chains: list[list[Leg]]) -> Legs:
    """The legs of runs (those of one run in one list) with their vertices, which are added to the
    draft."""
    flat = [leg for chain in chains for leg in chain]
    series = [cuts[leg.cut].tracks[leg.track].series for leg in flat]
    tracks, every = Tracks(series, np.array([leg.u for leg in flat])), np.arange(len(flat))
    places = _moved(flat, every, tracks(every, np.array([0.0, 1.0])))
    own = _rows(ground, flat, every, places)
    table = Legs(
        ground,
        tracks,
        flat,
        [_breaks(ground, s, leg) for s, leg in zip(series, flat, strict=True)],
        places,
        own,
        own.copy(),
        [],
    )
    position = 0
    for chain in chains:
        starts = [_start(draft, table, k) for k in range(position, position + len(chain))]
        position += len(chain)
        last = chain[-1].spots[1]
        stop = starts[0] if last is None else _spot(draft, table, position - 1, 1)
        table.vertices.extend(zip(starts, [*starts[1:], stop], strict=True))
    for k, pair in enumerate(table.vertices):
        for end in (0, 1):
            points = np.array([draft.points[i] for i in pair[end]])
            table.ends[k, end] = _end_row(table, k, end, points)
    return table


def _breaks(ground: Ground, series: Piecewise, leg: Leg) -> tuple[float, ...]:
    """The shares of a leg, 0 and 1 with them, between which it is smooth."""
    low, high = leg.u
    inner = breaks(series, ground.skin.strip.patch, low, high)
    return (0.0, *((u - low) / (high - low) for u in inner), 1.0)


# vertices


def _start(draft: Draft, table: Legs, k: int) -> tuple[int, ...]:
    """The vertices at the start of leg number k."""
    if table.legs[k].spots[0] is not None:
        return _spot(draft, table, k, 0)
    t, v = table.places[k, 0]
    end = _touched(table.ground, t, v)
    if end is None:
        return tuple(draft.add_point(point) for point in table.own[k, 0, :, :3])
    strip = table.ground.skin.strip
    points = table.ground.truth(strip.ends[[end]], np.array([v]))[0]
    found = tuple(draft.add_point(point) for point in points)
    draft.touches.setdefault((strip.first, strip.last)[end], []).append(found)
    return found


def _touched(ground: Ground, t: float, v: float) -> int | None:
    """The end of the strip (0, 1) that a place lies on."""
    strip = ground.skin.strip
    for end in (0, 1):
        away = abs(t - strip.ends[end])
        if away <= BESIDE * (strip.ends[1] - strip.ends[0]):
            f = strip.patch.frame(strip.ends[[end]])
            if away * abs(float(f.q[0] + v * f.a[0])) <= TOUCH:
                return end
    return None


def _spot(draft: Draft, table: Legs, k: int, end: int) -> tuple[int, ...]:
    """The vertices of the spot at the start (0) or the end (1) of leg number k: corners of the
    strip where it lies on these."""
    spot, ground = table.legs[k].spots[end], table.ground
    assert spot is not None
    if ("spot", spot.key, 0) in draft.names:
        return draft.spot(spot)
    strip = ground.skin.strip
    if spot.side in (0, 2):
        points = ground.truth(strip.ends[[spot.side // 2]], np.array([spot.at]))[0]
    else:
        t = np.array([spot.at])
        s = float(ground.along(t)[0]) if isinstance(ground.skin.surfaces[0], Ruled) else 0.0
        side = 1 if spot.side == 1 else 0
        found = place_on(ground.skin, side, s, spot.at, *_ways(table, k, end))
        draft.shares[spot.key], points = found
    corners = draft.corner_points(strip)
    near = np.abs(corners - points).max(axis=(2, 3)) <= FLOOR * draft.size
    for layer, point in enumerate(points):
        name = ("spot", spot.key, layer)
        if near.any():
            i, side = np.argwhere(near)[0].tolist()
            draft.names[name] = draft.corner((strip.first, strip.last)[i], side, layer)
        else:
            draft.names[name] = draft.add_point(point)
    return draft.spot(spot)


def _ways(table: Legs, k: int, end: int) -> tuple[Array, Array]:
    """The end of leg number k on every layer and its direction there, (layers, 3) each."""
    shares = np.array([end, end + AHEAD * (1 - 2 * end)])
    t, v = table.tracks(np.array([k]), shares)[0].T
    here, inside = table.ground.truth(np.clip(t, *table.ground.skin.strip.ends), v)
    way = inside - here
    return here, way / np.linalg.norm(way, axis=1)[:, None]


def _end_row(table: Legs, k: int, end: int, points: Array) -> Array:
    """The row of the end of leg number k at its vertices, ``points`` (layers, 3)."""
    ground = table.ground
    row: Array = table.own[k, end].copy()
    row[:, :3] = points
    if ground.width == 3:
        return row
    spot, strip = table.legs[k].spots[end], ground.skin.strip
    if spot is not None and spot.side in (1, 3):
        t = np.array([spot.at])
    elif spot is not None:
        t = strip.ends[[spot.side // 2]]
    else:
        touched = _touched(ground, *table.places[k, end])
        if touched is None:
            return row
        t = strip.ends[[touched]]
    if isinstance(ground.skin.surfaces[0], Ruled):
        row[:, 3:] = _on_fitted(ground, t, points, spot)
        return row
    assert ground.skin.frame is not None
    row[:, 3] = ground.scale[0] * ground.skin.frame.angle(t)[0]
    for layer, surface in enumerate(ground.skin.surfaces):
        assert isinstance(surface, (Cylinder, Cone))
        row[layer, 4] = heights(surface, points[layer : layer + 1])[0]
    return row


def _on_fitted(ground: Ground, t: Array, points: Array, spot: Spot | None) -> Array:
    """The places in mm, (layers, 2), of points on the ruling at t (1,) of fitted faces."""
    s, out = ground.along(t), []
    for surface, point in zip(ground.skin.surfaces, points, strict=True):
        assert isinstance(surface, Ruled)
        low, high = surface.low(s)[0], surface.high(s)[0]
        share = float((point - low) @ (high - low) / ((high - low) @ (high - low)))
        if spot is not None and spot.side in (1, 3):
            share = float(round(share))
        across = place_across(surface, np.array([share]), s)
        out.append(ground.scale * np.array([across[0], s[0]]))
    return np.array(out)
