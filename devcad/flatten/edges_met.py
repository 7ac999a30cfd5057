"""Where contours meet the edges of the sheet, and by how much they leave it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from devcad.flatten.contours import Contours
from devcad.flatten.cover import Cover, Index
from devcad.flatten.stretches import Copies, Stretches
from devcad.geometry.chebyshev import clenshaw
from devcad.geometry.cuts import Track
from devcad.geometry.resolving import unit_nodes
from devcad.geometry.taylor import Array

SIDES = ("start", "top", "end", "base")
"""The sheet's edges: the first ruling, v = to, the last ruling, v = from."""
LOOKS = 65
"""Places of a stretch at which it is seen to leave the sheet."""
ROOMS = 33
"""Places of a track's panel at which its room is looked at."""
ZOOMS = 6
"""How often the place of least room is looked at more closely, eight times each."""
HALVINGS = 60
"""A step halved so often is below the rounding of the parameter."""
ALONG = 257
"""Points of a patch's edge from which the distance is measured."""


@dataclass(frozen=True, slots=True)
class Rooms:
    """The least distance of each track from the sheet's edges, (n,), from which of SIDES, and at
    which u."""

    room: Array
    side: Index
    u: Array


def rooms(tracks: Sequence[Track], cover: Cover) -> Rooms:
    """How near tracks come to the sheet's edges: to rails along the ruling, negative beyond; to
    the first and last ruling of an open sheet at right angles."""
    counts = [len(track.series.coefficients) for track in tracks]
    owner = np.repeat(np.arange(len(tracks)), counts)
    width = max(track.series.coefficients.shape[1] for track in tracks)
    table = np.zeros((len(owner), width, 2))
    row = 0
    for track in tracks:
        part = track.series.coefficients
        table[row : row + len(part), : part.shape[1]] = part
        row += len(part)
    low = np.concatenate([track.series.knots[:-1] for track in tracks])
    high = np.concatenate([track.series.knots[1:] for track in tracks])
    patch = np.array([track.patch for track in tracks])[owner]

    def look(panel: Index, u: Array) -> Array:
        """The rooms of all sides, (n, 4)."""
        a, b = low[panel], high[panel]
        places = clenshaw(table[panel], ((u - a) - (b - u)) / (b - a))
        return _rooms(cover, patch[panel], places[:, 0], places[:, 1])

    share = np.linspace(0.0, 1.0, ROOMS)
    u = low[:, None] + (high - low)[:, None] * share
    panel = np.repeat(np.arange(len(low)), ROOMS)
    found = look(panel, u.ravel()).reshape(len(low), ROOMS, 4)
    least, at = _zoomed(look, u, found)
    return _least(owner, len(tracks), least, at)


def _zoomed(look: Callable[[Index, Array], Array], u: Array, found: Array) -> tuple[Array, Array]:
    """The least room of each panel (p, 4) and u there, looked for between the looks as well."""
    j = found.argmin(axis=1)  # (p, 4)
    p, side = np.meshgrid(np.arange(len(u)), np.arange(4), indexing="ij")
    least, at = found[p, j, side], u[p, j]
    low, high = u[p, np.maximum(j - 1, 0)], u[p, np.minimum(j + 1, ROOMS - 1)]
    with np.errstate(invalid="ignore"):
        rough = np.nan_to_num(np.abs(np.diff(found, axis=1)).max(axis=1))
    close = np.isfinite(least) & (least <= rough)
    row, column = np.nonzero(close)
    a, b = low[close], high[close]
    best, where = least[close], at[close]
    share = np.linspace(0.0, 1.0, 17)
    for _ in range(ZOOMS if len(row) else 0):
        grid = a[:, None] + (b - a)[:, None] * share
        rows = np.repeat(row, 17)
        seen = look(rows, grid.ravel())[np.arange(len(rows)), np.repeat(column, 17)]
        seen = seen.reshape(-1, 17)
        k = seen.argmin(axis=1)
        number = np.arange(len(k))
        better = seen[number, k] < best
        best = np.where(better, seen[number, k], best)
        where = np.where(better, grid[number, k], where)
        a, b = grid[number, np.maximum(k - 1, 0)], grid[number, np.minimum(k + 1, 16)]
    least[close], at[close] = best, where
    return least, at


def _least(owner: Index, number: int, least: Array, at: Array) -> Rooms:
    """The least of each track over its panels and sides."""
    side = least.argmin(axis=1)
    panel = np.arange(len(owner))
    room, u = least[panel, side], at[panel, side]
    order = np.lexsort([room, owner])
    first = order[np.searchsorted(owner[order], np.arange(number))]
    return Rooms(room[first], side[first], u[first])


def _rooms(cover: Cover, patch: Index, t: Array, v: Array) -> Array:
    """The rooms (n, 4) of places on patches (n,) towards all SIDES; inf where none is near."""
    out = np.full((len(t), 4), np.inf)
    for k in np.unique(patch).tolist():
        own = np.flatnonzero(patch == k)
        low, high = cover.chain.patches[k].domain
        at = np.clip(t[own], low, high)
        jet = cover.chain.patches[k].jet(at, 0)
        out[own, 1], out[own, 3] = jet.v_to[0] - v[own], v[own] - jet.v_from[0]
        out[own, ::2] = cover.to_ends(k, at, v[own])
    return out


def leaving(
    stretches: Stretches, lines: Contours, cover: Cover, copies: Copies
) -> tuple[Index, Array]:
    """Where contours cross the edges of the sheet, pieces and u (n,), by bisection.

    A stretch that lies on an edge within rounding is outside. What is inside for less than a
    64th of a stretch is not seen.
    """
    share = unit_nodes(LOOKS)
    number = len(stretches.low)
    u = stretches.low[:, None] * (1.0 - share) + stretches.high[:, None] * share
    which = np.repeat(np.arange(number), LOOKS)

    def room(k: Index, at: Array) -> Array:
        points = lines.points(stretches.piece[k], at)
        found = cover.find(points, stretches.owner[k], copies)
        out = np.full(len(at), -np.inf)
        np.maximum.at(out, found.row, found.room)
        return out

    seen = room(which, u.ravel()).reshape(number, LOOKS)
    inside = seen > cover.near
    k, step = np.nonzero(inside[:, 1:] != inside[:, :-1])
    into = inside[k, step + 1]
    a, b = u[k, np.where(into, step + 1, step)], u[k, np.where(into, step, step + 1)]
    outer = seen[k, np.where(into, step, step + 1)]
    at_end = np.where(into, step == 0, step == LOOKS - 2)
    real = ~((outer > 0.0) & at_end)
    # a look that happens to lie on the edge: the one behind it tells whether the edge is crossed
    behind = np.where(into, np.maximum(step - 1, 0), np.minimum(step + 2, LOOKS - 1))
    over = (outer > 0.0) & (seen[k, behind] <= 0.0)
    b, outer = np.where(over, u[k, behind], b), np.where(over, -1.0, outer)
    k, a, b, outer = k[real], a[real], b[real], outer[real]
    limit = np.where(outer > 0.0, cover.near, 0.0)
    for _ in range(HALVINGS if len(k) else 0):
        middle = 0.5 * (a + b)
        good = room(k, middle) > limit
        a, b = np.where(good, middle, a), np.where(good, b, middle)
    return stretches.piece[k], a


def excess(points: Array, cover: Cover) -> tuple[float, str, bool]:
    """How far the outermost of the points (n, 2) lies outside the pattern, mm, beyond which
    edge, and whether some of them lie inside."""
    everyone = np.zeros(len(points), dtype=np.intp)
    copies = [0] if cover.shift is None else [-1, 0, 1]
    found = cover.find(points, everyone, [(copy, everyone[:1]) for copy in copies])
    within = np.zeros(len(points), dtype=bool)
    within[found.row[found.room >= 0.0]] = True
    outside = points[~within]
    if not len(outside):
        return 0.0, "", True
    away, side = np.full(len(outside), np.inf), np.zeros(len(outside), dtype=np.intp)
    for name, rim in _rims(cover):
        for copy in copies:
            rotation, shift = cover.motion(copy)
            d = _distance(outside, rim @ rotation.T + shift)
            side = np.where(d < away, SIDES.index(name), side)
            away = np.minimum(away, d)
    worst = int(np.argmax(away))
    return float(away[worst]), SIDES[int(side[worst])], bool(within.any())


def _rims(cover: Cover) -> list[tuple[str, Array]]:
    """The sheet's edges as polylines with their names."""
    out = []
    for patch, development in zip(cover.chain.patches, cover.developments, strict=True):
        ends = zip(patch.ends[:-1], patch.ends[1:], strict=True)
        t = np.concatenate([np.linspace(a, b, ALONG) for a, b in ends])
        jet = patch.jet(t, 0)
        out.append(("base", development.points(t, jet.v_from[0])))
        out.append(("top", development.points(t, jet.v_to[0])))
    if cover.shift is None:
        r = cover.rulings
        for name, k in (("start", 0), ("end", -1)):
            v = np.array([r.v_from[k], r.v_to[k]])
            out.append((name, r.origin[k] + v[:, None] * r.e[k]))
    return out


def _distance(points: Array, polyline: Array) -> Array:
    """The distances (n,) of points from a polyline (k, 2)."""
    a, d = polyline[:-1], np.diff(polyline, axis=0)
    length = np.maximum((d * d).sum(axis=1), 1e-300)
    out = np.full(len(points), np.inf)
    for i in range(0, len(points), 1024):
        away = points[i : i + 1024, None] - a
        share = np.clip((away * d).sum(axis=2) / length, 0.0, 1.0)
        rest = away - share[..., None] * d
        out[i : i + 1024] = np.hypot(rest[..., 0], rest[..., 1]).min(axis=1)
    return out
