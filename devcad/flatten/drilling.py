"""Drills: where a straight cylinder of space meets the sheet, wall by wall, as stretches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.errors import GeometryError
from devcad.features import Drill
from devcad.flatten.contours import Flags
from devcad.flatten.cover import SLACK, Cover, Index
from devcad.flatten.stretches import Stretches
from devcad.flatten.tracks import Solve
from devcad.geometry.lines import Lines
from devcad.geometry.locate import closest, space_lines, space_rows
from devcad.geometry.taylor import Array

OUTWARDS = 16
"""Steps from the drill's axis to its rim."""
AROUND = 128
"""Steps round the rim."""
STEEPEST = 1e-4
"""Sine of the angle between drill and surface below which it grazes."""
STRAY = 0.5
"""Of a step's length: as much may the surface rise beyond its tangent planes before and after."""


@dataclass(frozen=True, slots=True)
class Hits:
    """Where lines of one direction meet the chain: ``row`` (n,) the line, patch, t and v (n,),
    the ``height`` along the direction, the ``normal`` (n, 3) of the surface there."""

    row: Index
    patch: Index
    t: Array
    v: Array
    height: Array
    normal: Array


UNEVEN = 0.6180339887
"""Radians: the rim is not followed from a direction in which parts are drawn, where the places
looked at would lie on seams and joints to the last digit."""


@dataclass(frozen=True, slots=True)
class Bore:
    """A drill's cylinder: ``point`` on its axis, unit ``axis`` and two directions across it."""

    point: Array
    axis: Array
    across: Array
    radius: float

    def lines(self, angle: Array, radius: float | None = None) -> Array:
        """Points (n, 3) of the cylinder's lines at angles from ``across[0]`` to ``across[1]``."""
        r = self.radius if radius is None else radius
        way = np.column_stack([np.cos(angle), np.sin(angle)]) @ self.across
        return np.asarray(self.point + r * way)


@dataclass(frozen=True, slots=True)
class Wall:
    """One wall that a drill goes through: its rim at equal angles (n + 1,) around the front's
    clockwise sense, by patch, t and the height along the axis."""

    bore: Bore
    front: float
    angle: Array
    patch: Index
    t: Array
    v: Array
    height: Array


@dataclass(frozen=True, slots=True)
class Space:
    """A chain's rulings as lines in space, each patch about its own centre (p, 3)."""

    sheet: Cover
    lines: tuple[Lines, ...]
    centres: Array

    def hits(self, points: Array, axis: Array) -> Hits:
        """Where the lines through points (n, 3) along a unit direction meet the patches, beyond
        their extents too."""
        parts = []
        for k, (patch, lines) in enumerate(zip(self.sheet.chain.patches, self.lines, strict=True)):
            directions = np.broadcast_to(axis, points.shape)
            rows = space_rows(points, directions, self.centres[k])
            found = lines.roots(rows, SLACK * self.sheet.near)
            v, height = self.height(k, points[found.row], axis, found.t)
            met = np.isfinite(height)  # a ruling along the drill is not met in a point
            row, t, v, height = found.row[met], found.t[met], v[met], height[met]
            frame = patch.frame(np.clip(t, *patch.domain)) if len(v) else None
            normal = np.zeros((0, 3)) if frame is None else frame.n
            regular = np.zeros(0, dtype=bool) if frame is None else frame.q + v * frame.a > 0.0
            number = np.full(len(v), k)
            parts.append(tuple(x[regular] for x in (row, number, t, v, height, normal)))
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        order = np.lexsort([columns[4], columns[0]])
        return Hits(*(column[order] for column in columns))

    def height(self, k: int, points: Array, axis: Array, t: Array) -> tuple[Array, Array]:
        """v on the rulings t of patch k where lines through points along the axis come closest to
        them, and how far that is along the lines."""
        place = self.lines[k].places(t)
        c0, e = place[:, :3] + self.centres[k], place[:, 3:]
        return closest(points - c0, np.broadcast_to(axis, points.shape), e)


def space(sheet: Cover) -> Space:
    """The rulings of a sheet's chain in space."""
    centres, lines = [], []
    for patch in sheet.chain.patches:
        jet = patch.jet([0.5 * (patch.domain[0] + patch.domain[1])], 0)
        middle = jet.c0[0, 0] + 0.5 * (jet.v_from[0, 0] + jet.v_to[0, 0]) * jet.e[0, 0]
        centres.append(middle)
        lines.append(space_lines(patch, middle))
    return Space(sheet, tuple(lines), np.array(centres))


def walls(drill: Drill, room: Space) -> list[Wall]:
    """The walls that a drill goes through: the first one from its point on, or with ``through``
    every one that its axis meets, along the axis.

    Raises:
        GeometryError: the axis meets nothing, or the drill grazes a wall or leaves the sheet.
    """
    axis = np.asarray(drill.direction, dtype=float)
    axis = axis / np.linalg.norm(axis)
    first = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    cos, sin = np.cos(UNEVEN), np.sin(UNEVEN)
    across = np.stack([cos * first + sin * second, cos * second - sin * first])
    bore = Bore(np.asarray(drill.point, dtype=float), axis, across, 0.5 * drill.diameter)
    found = room.hits(bore.point[None], axis)
    on = _within(found, room)
    met = _distinct(found, np.flatnonzero(on), room.sheet.near)
    if not drill.through:
        met = [k for k in met if found.height[k] >= -room.sheet.near][:1]
    if not met:
        raise GeometryError(
            f"{drill.place}: the drill's axis does not meet the sheet"
            + ("" if drill.through else " from its point on"),
            remedy="move the axis, turn its direction round, or give it through = true",
        )
    return [_wall(drill, bore, room, found, k) for k in met]


def _within(found: Hits, room: Space) -> Flags:
    """Which hits lie on the sheet, its edges included."""
    on = np.zeros(len(found.row), dtype=bool)
    for k, patch in enumerate(room.sheet.chain.patches):
        own = np.flatnonzero(found.patch == k)
        jet = patch.jet(np.clip(found.t[own], *patch.domain), 0)
        v, near = found.v[own], room.sheet.near
        on[own] = (v >= jet.v_from[0] - near) & (v <= jet.v_to[0] + near)
    return on


def _distinct(found: Hits, met: Index, near: float) -> list[int]:
    """The hits one by one, those on the ruling between two patches once."""
    out: list[int] = []
    for k in met.tolist():
        if not out or found.height[k] - found.height[out[-1]] > 1e3 * near:
            out.append(k)
    return out


def _wall(drill: Drill, bore: Bore, room: Space, found: Hits, k: int) -> Wall:
    """The rim of the wall that the axis meets at hit k, followed from the axis outwards and then
    round clockwise, as the front shows it."""
    front = float(np.sign(found.normal[k] @ bore.axis)) or 1.0
    out = np.linspace(0.0, 1.0, OUTWARDS + 1)[1:]
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND + 1)
    ray = bore.point + (out * bore.radius)[:, None] * bore.across[0]
    points = np.concatenate([ray, bore.lines(-front * angle)[1:]])
    hits = room.hits(points, bore.axis)
    first = np.searchsorted(hits.row, np.arange(len(points) + 1)).tolist()
    at = bore.point + found.height[k] * bore.axis
    normal = found.normal[k]
    chosen: list[int] = []
    for i, point in enumerate(points):
        step = point - (at - (at - point) @ bore.axis * bore.axis)
        slope = normal @ bore.axis
        here = np.arange(first[i], first[i + 1])
        here = here[front * (hits.normal[here] @ bore.axis) > 0.0]
        if abs(slope) < STEEPEST or not len(here):
            raise _lost(drill, room, chosen, hits)
        guess = (at - point) @ bore.axis - (normal @ step) / slope
        stray = np.abs(hits.height[here] - guess)
        nearest = int(np.argmin(stray))
        best = int(here[nearest])
        steep = _tangent(slope) + _tangent(float(hits.normal[best] @ bore.axis))
        if stray[nearest] > (steep + STRAY / slope**2) * np.linalg.norm(step) + room.sheet.near:
            raise _lost(drill, room, chosen, hits)
        at, normal = point + hits.height[best] * bore.axis, hits.normal[best]
        chosen.append(best)
    rim = np.array(chosen[OUTWARDS - 1 :])
    if abs(hits.height[rim[0]] - hits.height[rim[-1]]) > 1e3 * room.sheet.near:
        raise _lost(drill, room, chosen, hits)
    return Wall(bore, front, angle, hits.patch[rim], hits.t[rim], hits.v[rim], hits.height[rim])


def _tangent(sine: float) -> float:
    """How fast a surface rises along the drill, that meets it at an angle of this sine."""
    return float(np.sqrt(max(1.0 - sine**2, 0.0)) / max(abs(sine), STEEPEST))


def _lost(drill: Drill, room: Space, chosen: list[int], hits: Hits) -> GeometryError:
    """The error of a drill whose rim cannot be followed any further: over an edge of the sheet,
    or along the surface."""
    side = _left_over(room, chosen, hits)
    if side:
        what, remedy = f"leaves the sheet over its edge {side}", "move it or make it smaller"
    else:
        what = "grazes the sheet: a line of the drill touches the surface or passes it by"
        remedy = "move the drill's axis, turn it towards the normal or make the drill smaller"
    return GeometryError(f"cutout-crosses-edge: {drill.place} {what}", remedy=remedy)


def _left_over(room: Space, chosen: list[int], hits: Hits) -> str:
    """The edge over which a path of hits has left the sheet, or is about to."""
    patches = room.sheet.chain.patches
    for k in chosen:
        jet = patches[int(hits.patch[k])].jet([hits.t[k]], 0)
        if hits.v[k] > jet.v_to[0, 0]:
            return "top"
        if hits.v[k] < jet.v_from[0, 0]:
            return "base"
    if not chosen or room.sheet.shift is not None:
        return ""
    k = chosen[-1]
    before = chosen[-2] if len(chosen) > 1 else k
    for side, patch, border in (("start", 0, 0), ("end", len(patches) - 1, 1)):
        away = abs(hits.t[k] - patches[patch].domain[border])
        if hits.patch[k] == patch and away <= 2.0 * abs(hits.t[k] - hits.t[before]):
            return side
    return ""


def stretches_of(wall: Wall, number: int, room: Space) -> Stretches:
    """A wall's rim cut where it crosses the rulings between cells."""
    sheet = room.sheet
    events: list[float] = []
    for cell in range(sheet.count):
        k, t = int(sheet.patch[cell]), float(sheet.low[cell])
        events += _passes(wall, k, t, room)
    inner = sorted(e for e in events if 1e-12 < e < 2.0 * np.pi - 1e-12)
    cuts = np.array([0.0, *inner, 2.0 * np.pi])
    low, high = cuts[:-1], cuts[1:]
    return Stretches(
        np.full(len(low), number),
        np.zeros(len(low), dtype=np.intp),
        low,
        high,
        np.zeros(len(low), dtype=bool),
        _cells(wall, low, high, room),
    )


def _cells(wall: Wall, low: Array, high: Array, room: Space) -> Index:
    """The cells of stretches one after the other, numbered on through the turns round a tube."""
    count, round_ = room.sheet.count, room.sheet.shift is not None
    out: list[int] = []
    before = 0.0
    for a, b in zip(low.tolist(), high.tolist(), strict=True):
        within = np.flatnonzero((wall.angle > a) & (wall.angle < b))
        if len(within):  # steps of the rim lie on the stretch
            first, middle, last = within[0], within[len(within) // 2], within[-1]
            places = [
                _cell_at(int(wall.patch[k]), float(wall.t[k]), room) for k in (first, middle, last)
            ]
        else:
            places = [_place(wall, 0.5 * (a + b), room)] * 3
        turns = round((before - sum(places[0])) / count) if out and round_ else 0
        before = sum(places[2]) + turns * count
        out.append(places[1][0] + turns * count)
    return np.array(out, dtype=np.intp)


def _passes(wall: Wall, k: int, t: float, room: Space) -> list[float]:
    """The angles at which a rim crosses the ruling t of patch k: there the ruling's image along
    the axis, a straight line, crosses a circle."""
    place = room.lines[k].places(np.array([t]))[0]
    c0, e = place[:3] + room.centres[k], place[3:]
    bore = wall.bore
    flat, away = bore.across @ e, bore.across @ (c0 - bore.point)
    length = float(np.hypot(*flat))
    if length < STEEPEST:
        return []
    normal = np.array([-flat[1], flat[0]]) / length
    distance = float(normal @ away)
    if abs(distance) > bore.radius - room.sheet.near:
        return []  # touching is no crossing
    middle, half = np.arctan2(normal[1], normal[0]), np.arccos(distance / bore.radius)
    out = []
    for phi in (middle - half, middle + half):
        u = float((-wall.front * phi) % (2.0 * np.pi))
        point = bore.lines(np.array([phi]))
        _, height = room.height(k, point, bore.axis, np.array([t]))
        if abs(float(height[0]) - _height(wall, u)) <= 0.02 * bore.radius + _ripple(wall):
            out.append(u)
    return out


def _height(wall: Wall, u: float) -> float:
    """The rim's height at u, between its steps."""
    return float(np.interp(u, wall.angle, wall.height))


def _ripple(wall: Wall) -> float:
    """The largest step of a rim's height."""
    return float(np.abs(np.diff(wall.height)).max())


def _place(wall: Wall, u: float, room: Space) -> tuple[int, float]:
    """The cell in which a rim lies at u, and the share of it that lies before."""
    hits = room.hits(wall.bore.lines(np.array([-wall.front * u])), wall.bore.axis)
    right = np.flatnonzero(wall.front * (hits.normal @ wall.bore.axis) > 0.0)
    best = right[np.argmin(np.abs(hits.height[right] - _height(wall, u)))]
    return _cell_at(int(hits.patch[best]), float(hits.t[best]), room)


def _cell_at(patch: int, t: float, room: Space) -> tuple[int, float]:
    """The cell of a patch in which t lies, and the share of it that lies before."""
    sheet = room.sheet
    own = np.flatnonzero(sheet.patch == patch)
    at = np.searchsorted(sheet.low[own], t, side="right") - 1
    cell = int(own[np.clip(at, 0, len(own) - 1)])
    return cell, float((t - sheet.low[cell]) / (sheet.high[cell] - sheet.low[cell]))


def along_walls(stretches: Stretches, rims: list[Wall], room: Space) -> Solve:
    """The places of the rims' points on the sheet."""

    def solve(which: Index, u: Array, fixed: Array) -> tuple[Array, Array]:
        t, v = np.full(len(u), np.nan), np.full(len(u), np.nan)
        owner = stretches.owner[which]
        for number in np.unique(owner).tolist():
            own = np.flatnonzero(owner == number)
            cells = stretches.cell[which[own]]
            t[own], v[own] = _on_wall(rims[number], u[own], cells, fixed[own], room)
        return t, v

    return solve


def _on_wall(wall: Wall, u: Array, cell: Index, fixed: Array, room: Space) -> tuple[Array, Array]:
    """t and v of the rim at u (n,) in known cells."""
    sheet = room.sheet
    angle = u % (2.0 * np.pi)
    points = wall.bore.lines(-wall.front * angle)
    guess = np.interp(angle, wall.angle, wall.height)
    t, v = np.full(len(u), np.nan), np.full(len(u), np.nan)
    number = cell % sheet.count
    for k in np.unique(sheet.patch[number]).tolist():
        own = np.flatnonzero(sheet.patch[number] == k)
        rows = space_rows(
            points[own], np.broadcast_to(wall.bore.axis, (len(own), 3)), room.centres[k]
        )
        found = room.lines[k].roots(rows, SLACK * sheet.near)
        row = found.row
        low, high = sheet.low[number[own]][row], sheet.high[number[own]][row]
        snap = 1e-9 * (high - low)
        kept = (found.t >= low - snap) & (found.t <= high + snap)
        row, at = row[kept], np.clip(found.t, low, high)[kept]
        _, height = room.height(k, points[own][row], wall.bore.axis, at)
        order = np.lexsort([np.abs(height - guess[own][row]), row])
        first = order[np.unique(row[order], return_index=True)[1]]
        t[own[row[first]]] = at[first]
        t[own] = np.where(np.isnan(fixed[own]), t[own], fixed[own])
        t[own] = np.where(np.isnan(t[own]), sheet.low[number[own]], t[own])
        v[own], _ = room.height(k, points[own], wall.bore.axis, t[own])
    return t, v
