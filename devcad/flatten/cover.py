"""The pattern of a chain as cells between rulings, repeated round a tube, and who lies where.

A cell is the strip of a patch between two neighbouring rulings of its domain's ends and breaks.
On a tube the pattern goes on behind its last ruling with a copy of itself, moved by the rigid
motion that carries the first ruling's image onto the last one's. Cells and rulings are numbered
through all copies: cell k lies between the rulings k and k + 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.development import Development
from devcad.geometry.chain import Chain
from devcad.geometry.lines import Lines
from devcad.geometry.locate import plane_lines, plane_rows
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]

ON_LINE = 1e-10
"""Of the pattern's size: a contour that passes a ruling or an edge by less does not cross it."""
SLACK = 2.0
"""Times that: so far beyond its border a cell is still looked in."""
RIM = 65
"""Points of a patch's edge that are looked at for its box."""
FACING = 0.1
"""Cosine of the angle between a ruling and the first one, above which that is in sight."""
COPIES = 16
"""Turns round a tube that a contour may reach to either side."""


@dataclass(frozen=True, slots=True)
class Found:
    """Where points lie, one entry for each cell that a point is found in: ``row`` (n,) the
    point, ``cell`` its number, t, v, and ``room`` (n,) the distance to the sheet's nearest edge,
    along the ruling to the ends of the extent, negative outside."""

    row: Index
    cell: Index
    t: Array
    v: Array
    room: Array


@dataclass(frozen=True, slots=True)
class Rulings:
    """The borders of the cells, (n,) and (n, 2): images of c0, e and m, and the extent."""

    origin: Array
    e: Array
    m: Array
    v_from: Array
    v_to: Array


@dataclass(frozen=True, slots=True)
class Cover:
    """``patch``, ``low`` and ``high`` (k,) tell of the cells of one copy on which patch and over
    which t they lie. ``turn`` and ``shift`` are the motion from one copy to the next, None on an
    open sheet. ``rulings`` are the borders of one copy's cells, on an open sheet the last one
    too. ``boxes`` (p, 2, 2) hold the patches' images and ``box`` (2, 2) all of them. ``corners``
    (k,) tell where a smooth line of the pattern has a corner in space, at the start of a cell.
    ``only`` (owners, 2), if given, are the first and the last cell in which each owner's points
    are looked for."""

    chain: Chain
    developments: tuple[Development, ...]
    lines: tuple[Lines, ...]
    patch: Index
    low: Array
    high: Array
    turn: float
    shift: Array | None
    rulings: Rulings
    boxes: Array
    box: Array
    corners: NDArray[np.bool_]
    only: Index | None = None

    @property
    def size(self) -> float:
        """The diagonal of the pattern, mm."""
        return float(np.hypot(*(self.box[1] - self.box[0])))

    @property
    def near(self) -> float:
        """Distances in mm below this are none."""
        return ON_LINE * self.size

    @property
    def count(self) -> int:
        """The number of cells in one copy."""
        return len(self.low)

    def motion(self, copy: int) -> tuple[Array, Array]:
        """The rotation (2, 2) and shift (2,) that carry the pattern to a copy."""
        rotation, shift = np.eye(2), np.zeros(2)
        if self.shift is None or not copy:
            return rotation, shift
        cos, sin = np.cos(self.turn), np.sin(self.turn)
        once = np.array([[cos, -sin], [sin, cos]])
        for _ in range(abs(copy)):
            shift = once @ shift + self.shift
            rotation = once @ rotation
        return (rotation, shift) if copy > 0 else (rotation.T, -rotation.T @ shift)

    def copies(self, low: Array, high: Array, turns: int) -> list[tuple[int, Index]]:
        """The copies up to ``turns`` to either side that boxes low, high (k, 2) may reach, each
        with the numbers of those."""
        every = np.arange(len(low))
        if self.shift is None:
            return [(0, every)]
        out = []
        corners = np.array([[x, y] for x in self.box[:, 0] for y in self.box[:, 1]])
        for copy in range(-turns, turns + 1):
            rotation, shift = self.motion(copy)
            moved = corners @ rotation.T + shift
            hit = np.all((low <= moved.max(axis=0)) & (high >= moved.min(axis=0)), axis=1)
            if hit.any():
                out.append((copy, every[hit]))
        return out

    def restricted(self, patches: Sequence[tuple[int, int] | None]) -> Cover:
        """The cover in which each owner's points lie on its ``patches`` only, from the first to the
        last; None leaves all."""
        if not any(patches):
            return self
        most = np.iinfo(np.intp).max
        only = np.array([(-most, most)] * len(patches))
        for owner, pair in enumerate(patches):
            for end, number in enumerate(pair or ()):
                copy, patch = divmod(number, len(self.lines))
                own = np.flatnonzero(self.patch == patch)
                only[owner, end] = copy * self.count + own[-1 if end else 0]
        return replace(self, only=only)

    def borders(self, copy: int) -> tuple[Rulings, Index]:
        """The borders of a copy's cells with their numbers."""
        rotation, shift = self.motion(copy)
        r = self.rulings
        moved = Rulings(
            r.origin @ rotation.T + shift, r.e @ rotation.T, r.m @ rotation.T, r.v_from, r.v_to
        )
        return moved, copy * self.count + np.arange(len(r.v_from))

    def find(self, points: Array, owner: Index, copies: Sequence[tuple[int, Index]]) -> Found:
        """The cells in which points (n, 2) lie, ``owner`` (n,) saying whose they are: looked for
        in the ``copies`` of their owners. Points on a border are found on both sides of it."""
        parts: list[tuple[Index, Index, Array, Array, Array]] = []
        for copy, owners in copies:
            rows = np.flatnonzero(np.isin(owner, owners))
            rotation, shift = self.motion(copy)
            here = (points[rows] - shift) @ rotation
            for number in range(len(self.lines)):
                low, high = self.boxes[number]
                near = np.all((here >= low) & (here <= high), axis=1)
                close = np.flatnonzero(near & self._allowed(owner[rows], copy, number))
                if not len(close) and parts:
                    continue
                row, cell, t, v, room = self._on_patch(number, here[close])
                parts.append((rows[close][row], cell + copy * self.count, t, v, room))
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        if self.only is not None:
            first, last = self.only[owner[columns[0]]].T
            kept = (columns[1] >= first) & (columns[1] <= last)
            columns = [column[kept] for column in columns]
        order = np.argsort(columns[0], kind="stable")
        return Found(*(column[order] for column in columns))

    def _allowed(self, owner: Index, copy: int, number: int) -> NDArray[np.bool_]:
        """Whether owners (n,) have cells on a patch of a copy to be looked for, (n,)."""
        if self.only is None:
            return np.ones(len(owner), dtype=bool)
        own = copy * self.count + np.flatnonzero(self.patch == number)
        first, last = self.only[owner].T
        return np.asarray((first <= own[-1]) & (last >= own[0]))

    def solve(self, points: Array, cell: Index, fixed: Array) -> tuple[Array, Array]:
        """t and v (n,) of points (n, 2) in known cells (n,); t is ``fixed`` where that is a
        number, and no further than the cell. nan where no ruling of the cell comes near."""
        copy, number = np.divmod(cell, self.count)
        here = np.empty_like(points)
        for c in np.unique(copy).tolist():
            rotation, shift = self.motion(c)
            own = copy == c
            here[own] = (points[own] - shift) @ rotation
        t, v = np.full(len(points), np.nan), np.full(len(points), np.nan)
        for k in np.unique(self.patch[number]).tolist():
            own = np.flatnonzero(self.patch[number] == k)
            at = self._within(k, here[own], number[own])
            at = np.where(np.isnan(fixed[own]), at, fixed[own])
            t[own], v[own] = at, self._height(k, here[own], at)
        return t, v

    def _within(self, k: int, points: Array, number: Index) -> Array:
        """t of points in known cells of patch k, where v is nearest to the extent."""
        found = self.lines[k].roots(plane_rows(points), SLACK * self.near)
        row, t = found.row, found.t
        low, high = self.low[number[row]], self.high[number[row]]
        snap = 1e-9 * (self.high[number[row]] - low)
        kept = (found.slope < 0.0) & (t >= low - snap) & (t <= high + snap)
        row, t = row[kept], np.clip(t, low, high)[kept]
        room = _room(self.chain.patches[k], t, self._height(k, points[row], t))
        order = np.lexsort([-room, row])
        first = order[np.unique(row[order], return_index=True)[1]]
        out = np.full(len(points), np.nan)
        out[row[first]] = t[first]
        # a point beyond the cell by rounding only has no root within it
        lost = np.flatnonzero(np.isnan(out))
        if len(lost):
            out[lost] = self._nearest_border(k, points[lost], number[lost])
        return out

    def _nearest_border(self, k: int, points: Array, number: Index) -> Array:
        """The end of its cell that each point is within rounding of, else nan."""
        out = np.full(len(points), np.nan)
        for t in (self.low[number], self.high[number]):
            place = self.lines[k].places(t)
            away = points - place[:, :2]
            f = place[:, 2] * away[:, 1] - place[:, 3] * away[:, 0]
            out = np.where(np.isnan(out) & (np.abs(f) <= SLACK * self.near), t, out)
        return out

    def _height(self, k: int, points: Array, t: Array) -> Array:
        """v of points (n, 2) on the rulings t of patch k."""
        place = self.lines[k].places(np.where(np.isnan(t), self.lines[k].knots[0], t))
        v = ((points - place[:, :2]) * place[:, 2:]).sum(axis=1)
        return np.asarray(np.where(np.isnan(t), np.nan, v))

    def _on_patch(self, k: int, points: Array) -> tuple[Index, Index, Array, Array, Array]:
        """Rows, cells, t, v and room of points (n, 2) that lie on patch k or near its rails."""
        found = self.lines[k].roots(plane_rows(points), SLACK * self.near)
        kept = found.slope < 0.0
        row, t = found.row[kept], found.t[kept]
        v = self._height(k, points[row], t)
        room = _room(self.chain.patches[k], t, v)
        own = np.flatnonzero(self.patch == k)
        cell = own[np.clip(np.searchsorted(self.low[own], t, side="right") - 1, 0, len(own) - 1)]
        parts = [(row, cell, t, v, room)]
        for step, border in ((-1, cell), (1, cell + 1)):
            other = cell + step
            inside = (other >= own[0]) & (other <= own[-1])
            line = np.clip(border, 0, len(self.rulings.m) - 1)
            away = ((points[row] - self.rulings.origin[line]) * self.rulings.m[line]).sum(axis=1)
            on = inside & (np.abs(away) <= SLACK * self.near)
            parts.append((row[on], other[on], t[on], v[on], room[on]))
        row, cell, t, v, room = (np.concatenate(column) for column in zip(*parts, strict=True))
        return row, cell, t, v, np.minimum(room, self.to_ends(k, t, v).min(axis=1))

    def to_ends(self, k: int, t: Array, v: Array) -> Array:
        """How far places on patch k are from the first and the last ruling of an open sheet, at
        right angles, (n, 2); inf where that is out of sight."""
        out = np.full((len(t), 2), np.inf)
        last = len(self.lines) - 1
        if self.shift is not None or k not in (0, last) or not len(t):
            return out
        place = self.lines[k].places(t)
        points, e = place[:, :2] + v[:, None] * place[:, 2:], place[:, 2:]
        r = self.rulings
        for column, (border, own, sign) in enumerate(((0, 0, 1.0), (-1, last, -1.0))):
            if k == own:
                away = points - r.origin[border]
                foot, across = away @ r.e[border], sign * away @ r.m[border]
                # a place on the patch lies behind its end by a rounding, or not near it at all
                facing = (e @ r.e[border] > FACING) & (across >= -8.0 * self.near)
                facing &= foot >= r.v_from[border] - self.near
                facing &= foot <= r.v_to[border] + self.near
                out[:, column] = np.where(facing, across, np.inf)
        return out


def cover(
    chain: Chain,
    developments: tuple[Development, ...],
    jumps: Sequence[Sequence[float]] = (),
) -> Cover:
    """The cover of a chain's pattern; ``developments`` lay out its patches, and across the
    ``jumps`` of each, breaks of it, they turn smooth lines into others with a corner."""
    patches = chain.patches
    lines = tuple(plane_lines(p, d) for p, d in zip(patches, developments, strict=True))
    ends = [patch.segments for patch in patches]
    patch = np.repeat(np.arange(len(patches)), [len(e) - 1 for e in ends])
    low, high = np.concatenate([e[:-1] for e in ends]), np.concatenate([e[1:] for e in ends])
    borders = [(k, t) for k, t in zip(patch.tolist(), low.tolist(), strict=True)]
    corners = np.array([bool(jumps) and t in jumps[k] for k, t in borders])
    turn, shift = 0.0, None
    last = developments[-1].series(ends[-1][-1:])[0]
    if chain.closing is None:
        borders.append((len(patches) - 1, float(ends[-1][-1])))
    else:
        first = developments[0].series(ends[0][:1])[0]
        turn = float(last[0] - first[0])
        along = np.array([np.cos(last[0]), np.sin(last[0])])
        cos, sin = np.cos(turn), np.sin(turn)
        rotation = np.array([[cos, -sin], [sin, cos]])
        shift = last[1:3] + chain.closing.shift * along - rotation @ first[1:3]
    rims = [_rim(p, d) for p, d in zip(patches, developments, strict=True)]
    boxes = np.stack([_box(rim) for rim in rims])
    box = np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    return Cover(
        chain, developments, lines, patch, low, high, turn, shift,
        _rulings(patches, developments, borders), boxes, box, corners,
    )  # fmt: skip


def _rulings(
    patches: tuple[Patch, ...],
    developments: tuple[Development, ...],
    borders: Sequence[tuple[int, float]],
) -> Rulings:
    rows = []
    for k, t in borders:
        origin, e, m = developments[k].axes(np.array([t]))
        jet = patches[k].jet([t], 0)
        rows.append((origin[0], e[0], m[0], jet.v_from[0, 0], jet.v_to[0, 0]))
    return Rulings(*(np.array(column) for column in zip(*rows, strict=True)))


def _room(patch: Patch, t: Array, v: Array) -> Array:
    if not len(t):
        return np.zeros(0)
    jet = patch.jet(np.clip(t, *patch.domain), 0)
    return np.asarray(np.minimum(v - jet.v_from[0], jet.v_to[0] - v))


def _rim(patch: Patch, development: Development) -> Array:
    t = np.concatenate(
        [np.linspace(a, b, RIM) for a, b in zip(patch.ends[:-1], patch.ends[1:], strict=True)]
    )
    jet = patch.jet(t, 0)
    return np.concatenate([development.points(t, v) for v in (jet.v_from[0], jet.v_to[0])])


def _box(points: Array) -> Array:
    """The box of sampled points (2, 2), wider by what may lie between the samples."""
    low, high = points.min(axis=0), points.max(axis=0)
    wider = 0.02 * float(np.hypot(*(high - low)))
    return np.stack([low - wider, high + wider])
