"""Contours in the pattern cut where they cross rulings: every stretch within one cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.flatten.contours import Contours, Flags
from devcad.flatten.cover import Cover, Found, Index
from devcad.geometry.lines import sign_changes
from devcad.geometry.resolving import unit_nodes
from devcad.geometry.taylor import Array

LOOKS = 17
"""Places of a stretch at which its cell is looked for."""
SHORTEST = 1e-13
"""Of its piece: a shorter stretch is none."""
NOWHERE = np.iinfo(np.int64).min
"""The cell of a stretch that is not, or not wholly, on the sheet."""
PAIRS = 1 << 20
"""Polynomials held at a time."""

Copies = Sequence[tuple[int, Index]]


@dataclass(frozen=True, slots=True)
class Stretches:
    """Stretches in the order of their contours: whose (n,), of which piece, over u from ``low``
    to ``high``, whether a ``corner`` or an end lies at the start, and in which ``cell``."""

    owner: Index
    piece: Index
    low: Array
    high: Array
    corner: Flags
    cell: Index

    def places(self, number: int) -> tuple[Index, Array]:
        """Chebyshev places on every stretch: the stretches (n * number,) and u."""
        share = unit_nodes(number)
        u = self.low[:, None] * (1.0 - share) + self.high[:, None] * share
        return np.repeat(np.arange(len(self.low)), number), u.ravel()


def joined(parts: Sequence[Stretches]) -> Stretches:
    """The stretches of several contours, neighbours of one piece that lie in one cell made one."""
    names = ("owner", "piece", "low", "high", "corner", "cell")
    columns = [np.concatenate([getattr(part, name) for part in parts]) for name in names]
    return merged(Stretches(*columns))


def boxes(lines: Contours) -> tuple[Array, Array]:
    """Boxes around the contours, (k, 2) each."""
    reach = np.abs(lines.coefficients[:, 1:]).sum(axis=1)
    low = np.full((len(lines.closed), 2), np.inf)
    high = -low
    np.minimum.at(low, lines.owner, lines.coefficients[:, 0] - reach)
    np.maximum.at(high, lines.owner, lines.coefficients[:, 0] + reach)
    return low, high


def crossings(lines: Contours, cover: Cover, copies: Copies) -> tuple[Index, Array]:
    """Where contours cross the cells' borders within the extent: pieces and u, each (n,).

    That a contour touches a ruling, runs along it or crosses it for less than a rounding and
    comes back counts as no crossing.
    """
    pieces, places = [], []
    for copy, owners in copies:
        own = np.flatnonzero(np.isin(lines.owner, owners))
        borders, _ = cover.borders(copy)
        step = max(1, PAIRS // (len(borders.v_from) * lines.coefficients.shape[1] + 1))
        for i in range(0, len(own), step):
            rows = own[i : i + step]
            table = lines.coefficients[rows]
            across = np.einsum("pnd,bd->pbn", table, borders.m)
            along = np.einsum("pnd,bd->pbn", table, borders.e)
            across[..., 0] -= (borders.origin * borders.m).sum(axis=1)
            along[..., 0] -= (borders.origin * borders.e).sum(axis=1)
            wide, long = (np.abs(x[..., 1:]).sum(axis=2) for x in (across, along))
            hit = np.abs(across[..., 0]) <= wide
            hit &= along[..., 0] + long >= borders.v_from - cover.near
            hit &= along[..., 0] - long <= borders.v_to + cover.near
            p, b = np.nonzero(hit)
            k, x = sign_changes(across[p, b], cover.near)
            v = np.polynomial.chebyshev.chebval(x, along[p, b][k].T, tensor=False)
            inside = (v >= borders.v_from[b[k]] - cover.near) & (
                v <= borders.v_to[b[k]] + cover.near
            )
            k, x = k[inside], x[inside]
            at = rows[p[k]]
            pieces.append(at)
            places.append(0.5 * ((1.0 - x) * lines.low[at] + (1.0 + x) * lines.high[at]))
    return np.concatenate(pieces), np.concatenate(places)


def split(lines: Contours, piece: Index, u: Array) -> Stretches:
    """The contours' pieces cut at u (n,) of the pieces (n,), in no known cell."""
    number = np.arange(len(lines.low))
    pieces = np.concatenate([number, piece])
    starts = np.concatenate([lines.low, u])
    order = np.lexsort([starts, pieces])
    pieces, starts = pieces[order], starts[order]
    first = np.diff(pieces, prepend=-1) > 0
    ends = np.append(starts[1:], 0.0)
    last = np.append(first[1:], True)
    ends[last] = lines.high[pieces[last]]
    kept = ends - starts > SHORTEST * (lines.high - lines.low)[pieces]
    # a stretch that is dropped leaves its start to the next one
    for k in np.flatnonzero(~kept).tolist():
        if not last[k]:
            starts[k + 1], first[k + 1] = starts[k], first[k] or first[k + 1]
        elif not first[k]:
            ends[k - 1] = ends[k]
    pieces, starts, ends, first = (x[kept] for x in (pieces, starts, ends, first))
    corner = first & lines.corner[pieces]
    cell = np.full(len(pieces), NOWHERE, dtype=np.intp)
    return Stretches(lines.owner[pieces], pieces, starts, ends, corner, cell)


def in_cells(
    stretches: Stretches, lines: Contours, cover: Cover, copies: Copies, least: Array
) -> Stretches:
    """The stretches with their cells, NOWHERE for those that are not wholly on the sheet: at least
    ``least`` (k,) mm inside its edges.

    Every contour is followed from cell to cell, from its first place on the pattern itself, or
    else on the copy next to it.
    """
    which, u = stretches.places(LOOKS)
    points = lines.points(stretches.piece[which], u)
    found = cover.find(points, stretches.owner[which], copies)
    inside = found.room >= least[stretches.owner[which[found.row]]]
    cells, of_stretch = _common(found, inside)
    cell = np.full(len(stretches.low), NOWHERE, dtype=np.intp)
    number = np.bincount(of_stretch, minlength=len(cell))
    once = number[of_stretch] == 1
    cell[of_stretch[once]] = cells[once]
    several = np.unique(stretches.owner[np.flatnonzero(number > 1)])
    for owner in several.tolist():
        own = np.flatnonzero(stretches.owner == owner)
        sets = [cells[of_stretch == k] for k in own.tolist()]
        cell[own] = _followed(sets, cover.count)
    return replace(stretches, cell=cell)


def merged(stretches: Stretches) -> Stretches:
    """The stretches, neighbours of one piece that lie in one cell made one."""
    s = stretches
    again = np.zeros(len(s.low), dtype=bool)
    again[1:] = (s.piece[1:] == s.piece[:-1]) & (s.cell[1:] == s.cell[:-1])
    again[1:] &= s.owner[1:] == s.owner[:-1]
    again &= s.cell != NOWHERE
    last = np.append(~again[1:], True)
    first = ~again
    return Stretches(
        s.owner[first], s.piece[first], s.low[first], s.high[last], s.corner[first], s.cell[first]
    )


def followers(stretches: Stretches, closed: Flags) -> Index:
    """The stretch that follows each one on its contour, -1 at an open end."""
    number = np.arange(len(stretches.owner))
    last = np.append(stretches.owner[1:] != stretches.owner[:-1], True)
    first = np.searchsorted(stretches.owner, stretches.owner)
    around = np.where(closed[stretches.owner], first, -1)
    return np.where(last, around, number + 1)


def off_borders(stretches: Stretches, lines: Contours, cover: Cover) -> Index:
    """The contours that go over from one cell to another elsewhere than on the border between
    the two: in the plane they are closed, but on a cone they run round its tip."""
    after = followers(stretches, lines.closed)
    cell = stretches.cell
    on = (after >= 0) & (cell != NOWHERE) & (cell[after] != NOWHERE) & (cell[after] != cell)
    k = np.flatnonzero(on)
    points = lines.points(stretches.piece[k], stretches.high[k])
    copy, border = np.divmod(np.maximum(cell[k], cell[after[k]]), cover.count)
    away = np.full(len(k), np.inf)
    for c in np.unique(copy).tolist():
        own = copy == c
        rulings, _ = cover.borders(c)
        b = border[own]
        step = points[own] - rulings.origin[b]
        v = (step * rulings.e[b]).sum(axis=1)
        beyond = np.maximum(rulings.v_from[b] - v, v - rulings.v_to[b])
        away[own] = np.maximum(np.abs((step * rulings.m[b]).sum(axis=1)), beyond)
    lost = (away > 10.0 * cover.near) | (np.abs(cell[after[k]] - cell[k]) > 1)
    return np.unique(stretches.owner[k[lost]])


def _common(found: Found, inside: Flags) -> tuple[Index, Index]:
    """The cells that all inner looks at a stretch have in common, and the stretches, (n,) each."""
    inner = inside & (found.row % LOOKS != 0) & (found.row % LOOKS != LOOKS - 1)
    if not inner.any():
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    row, cell = found.row[inner], found.cell[inner]
    first = cell.min()
    wide = int(cell.max() - first) + 1
    seen = np.unique(row * wide + (cell - first))
    row, cell = np.divmod(seen, wide)
    key, count = np.unique((row // LOOKS) * wide + cell, return_counts=True)
    of_stretch, cell = np.divmod(key[count == LOOKS - 2], wide)
    return cell + first, of_stretch


def _followed(sets: Sequence[Index], count: int) -> list[int]:
    """One cell of each stretch's own, the next to the neighbours', beginning near copy 0."""
    known = [k for k, cells in enumerate(sets) if len(cells)]

    def home(k: int) -> tuple[int, int]:
        return int(np.abs(np.floor_divide(sets[k], count)).min()), len(sets[k])

    anchor = min(known, key=home)
    out = [NOWHERE] * len(sets)
    cells = sets[anchor]
    out[anchor] = int(cells[np.argmin(np.abs(np.floor_divide(cells, count)))])
    for way in (range(anchor + 1, len(sets)), range(anchor - 1, -1, -1)):
        last = out[anchor]
        for k in way:
            if len(sets[k]):
                last = int(sets[k][np.argmin(np.abs(sets[k] - last))])
                out[k] = last
    return out
