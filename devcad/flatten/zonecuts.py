"""Cuts carried from the smooth part to what the press brake makes of it: same on the blank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten.alignment import feet
from devcad.flatten.bending import Rulings
from devcad.flatten.brake import Zone
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.lines import sign_changes
from devcad.geometry.taylor import Array

NEAR = 1e-10
"""Of the pattern's size: a cut that passes a border by less does not cross it."""
SHORTEST = 1e-11
"""Of its track: a shorter piece is none."""
ASIDE = 1e-9
"""Of a patch's parameters: places as near to a border may lie on either side of it."""


@dataclass(frozen=True, slots=True)
class _Borders:
    """The lines between the zones: a point and the direction across each, (n, 2); the smooth
    rulings through its two ends, first and last, counted through all patches, (n,)."""

    point: Array
    across: Array
    low: Array
    high: Array


def carried(cuts: Sequence[Cut], flat: Chain, zones: Sequence[Zone]) -> tuple[Cut, ...]:
    """The cuts of the smooth part on the zones' patches, numbered as the zones are."""
    if not cuts:
        return ()
    spans = [patch.domain[1] - patch.domain[0] for patch in flat.patches]
    starts = np.concatenate([[0.0], np.cumsum(spans)[:-1]])
    size = max(float(np.abs(zone.flat.jet(zone.flat.domain, 0).c0).max()) for zone in zones)
    borders = _borders(flat, zones, starts)
    out = []
    for cut in cuts:
        pieces = [
            piece for track in cut.tracks for piece in _pieces(track, flat, starts, borders, size)
        ]
        number = [zone for _, _, zone in pieces]
        count = len(pieces)
        tracks = []
        for k, (track, ends, zone) in enumerate(pieces):
            sides = [_side(zone, number[(k + step) % count], len(zones)) for step in (-1, 1)]
            if not cut.closed:
                sides = [None if k == 0 else sides[0], None if k == count - 1 else sides[1]]
            tracks.append(_track(track, ends, zone, zones[zone], flat, sides))
        out.append(Cut(cut.name, tuple(tracks), cut.closed))
    return tuple(out)


def _side(zone: int, other: int, count: int) -> int | None:
    """Towards which end of its zone a piece runs when its neighbour lies in another: 0 or 1."""
    if zone == other:
        return None
    if abs(zone - other) == 1:
        return int(other > zone)
    return int(zone == count - 1)  # over the seam of a tube


def _borders(flat: Chain, zones: Sequence[Zone], starts: Array) -> _Borders:
    rows = []
    for zone in zones[1:]:
        jet = zone.flat.jet([zone.flat.domain[0]], 0)
        e = jet.e[0, 0, :2]
        ends = [jet.c0[0, 0, :2] + v[0, 0] * e for v in (jet.v_from, jet.v_to)]
        number, near, _ = zone.home
        homes = Rulings(np.full(2, number), np.full(2, near))
        lifted = np.column_stack([np.array(ends), np.zeros(2)])
        found = homes if zone.curl is None and zone.exact else feet(flat, lifted, homes)
        lows = np.array([flat.patches[k].domain[0] for k in found.patch.tolist()])
        at = starts[found.patch] + found.t - lows
        rows.append((*ends[0], -e[1], e[0], at.min(), at.max()))
    table = np.array(rows).reshape(-1, 6)
    return _Borders(table[:, :2], table[:, 2:4], table[:, 4], table[:, 5])


def _pieces(
    track: Track, flat: Chain, starts: Array, borders: _Borders, size: float
) -> list[tuple[Track, tuple[float, float], int]]:
    """The pieces of a track between the borders that it crosses, with the zones they lie in."""
    patch = flat.patches[track.patch]
    image = _image(track, flat)
    origin = starts[track.patch] - patch.domain[0]
    slack = ASIDE * (patch.domain[1] - patch.domain[0])
    seen = image(np.linspace(*track.u, 65))
    places = origin + track.series(np.linspace(*track.u, 65))[:, 0]
    wide = np.ptp(places) + slack
    near = (borders.low <= places.max() + wide) & (borders.high >= places.min() - wide)
    found: list[float] = []
    for b in np.flatnonzero(near).tolist():
        table = image.coefficients @ borders.across[b]
        table[:, 0] -= borders.point[b] @ borders.across[b]
        row, x = sign_changes(table, NEAR * max(size, float(np.abs(seen).max())))
        low, high = image.knots[row], image.knots[row + 1]
        crossed = 0.5 * ((1.0 - x) * low + (1.0 + x) * high)
        met = origin + track.series(crossed)[:, 0]
        on = (met >= borders.low[b] - slack) & (met <= borders.high[b] + slack)
        found += crossed[on].tolist()
        # a sign that changes from one knot's panel to the next
        knots = image.knots[1:-1]
        away = np.einsum("nd,d->n", image(knots) - borders.point[b], borders.across[b])
        found += [] if not knots.size else knots[np.abs(away) <= 2.0 * NEAR * size].tolist()
    least = SHORTEST * (track.u[1] - track.u[0])
    ends = [track.u[0]]
    for u in sorted(found):
        if u - ends[-1] > least and track.u[1] - u > least:
            ends.append(u)
    ends.append(track.u[1])
    out = []
    for first, last in pairwise(ends):
        middle = np.array([0.5 * (first + last)])
        at = origin + float(track.series(middle)[0, 0])
        beside = np.einsum("nd,nd->n", image(middle) - borders.point, borders.across) > 0.0
        passed = (at > borders.high) | ((at >= borders.low) & beside)
        out.append((track, (first, last), int(passed.sum())))
    return out


def _image(track: Track, flat: Chain) -> Piecewise:
    """The track in the pattern, x and y."""
    patch = flat.patches[track.patch]

    def points(u: Array) -> Array:
        t, v = track.series(u).T
        return patch.point(np.clip(t, *patch.domain), v)[:, :2]

    return chebyshev.resolve(points, track.series.knots)


def _track(
    track: Track,
    ends: tuple[float, float],
    number: int,
    zone: Zone,
    flat: Chain,
    sides: Sequence[int | None],
) -> Track:
    """A piece of a track on its zone; on the border exactly where it goes on beyond ``sides``."""
    low, high = ends
    inner = track.series.knots[(track.series.knots > low) & (track.series.knots < high)]
    patch = flat.patches[track.patch]

    def places(u: Array) -> Array:
        t, v = track.series(u).T
        if zone.exact:
            return np.column_stack([t, v])
        points = patch.point(np.clip(t, *patch.domain), v)
        near = np.full(len(t), 0.5 * (zone.flat.domain[0] + zone.flat.domain[1]))
        found = feet(Chain((zone.flat,)), points, Rulings(np.zeros(len(t), dtype=np.intp), near))
        jet = zone.flat.jet(found.t, 0)
        along = ((points - jet.c0[0]) * jet.e[0]).sum(axis=1)
        return np.column_stack([found.t, along])

    series = chebyshev.resolve(places, np.array([low, *inner, high]))
    table = series.coefficients.copy()
    for side, panel, sign in ((sides[0], 0, -1.0), (sides[1], -1, 1.0)):
        if side is None:
            continue
        basis = sign ** np.arange(table.shape[1])
        gap = zone.flat.domain[side] - float(basis @ table[panel, :, 0])
        # the panel is sheared by a rounding, so that its end lies on the border
        table[panel, 0, 0] += 0.5 * gap
        table[panel, 1, 0] += 0.5 * sign * gap
    return Track(number, Piecewise(series.knots, table))
