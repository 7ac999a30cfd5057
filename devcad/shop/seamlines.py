"""Seam lines: two edges that meet, where holes lie along them, and where that is in the patterns.

Lengths along a seam are measured in space, on the face that the job describes; a place on it is
the same material point of the sheet in the pattern.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.flatten.blank import Blank
from devcad.geometry.chain import Chain
from devcad.geometry.classify import patch_box
from devcad.geometry.parallel import parallel_chain
from devcad.geometry.seams import Border, Match, Meeting, border, match, nearest
from devcad.geometry.taylor import Array, rows_dot
from devcad.part import Panel

CORNER = np.radians(10.0)
"""Where a seam turns by more at one point it has a corner, and a hole there."""
SIDE = 1e-8
"""Of a stretch: so far before and behind a corner its two directions are taken."""
INSIDE = (1e-7, 1e-5, 1e-3)
"""Of a stretch: where an edge stands still its direction is taken so far inside."""
POINT = 1e-12
"""Of an edge: a stretch that is no longer is a point."""
STILL = 1e-9
"""Of its usual speed: a slower edge stands still, and its slope is rounding."""
SNAP = 1e-6
"""Of a stretch: as near to a corner of the other edge lies its own one."""
BENT = 1e-3
"""rad; where the edge turns by more in the pattern a hole lies on the bisector."""
CLOSENESS, SHARE = 1e-6, 1e-9
"""Edges nearer than so many mm, or this share of the panels' size, are one edge."""
STEPS = 60
"""Newton's steps and halvings, at most, for a place at a length."""
FOUND = 1e-14
"""Of an edge: a place that a step moves by less is found."""
MITRE = 4.0
"""A hole at a corner lies at most so many times as far from it as from a straight edge."""
SETTLED = 1e-13
"""Of the distance: a hole at a corner that moves by less is in its place."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class SeamLine:
    """Two edges that are sewn together: ``sides`` are the panels and ``borders`` their edges on
    the face that the job describes; ``mate`` says where the second runs along the first, and
    ``gap`` (mm) how far apart the two are, 0 where they are one."""

    names: tuple[tuple[str, str], tuple[str, str]]
    sides: tuple[Panel, Panel]
    borders: tuple[Border, Border]
    mate: Match
    gap: float

    @property
    def place(self) -> str:
        """The seam, for people."""
        return f"seam {' and '.join('.'.join(name) for name in self.names)}"

    @property
    def length(self) -> float:
        """The length of the first edge in space, mm."""
        return self.borders[0].length


def face(panel: Panel, reference: str) -> Chain:
    """The face of a panel's sheet that the job describes, bent to the end."""
    middle = blank_of(panel).middle
    if not panel.thickness or reference == "middle":
        return middle
    half = 0.5 * panel.thickness
    return parallel_chain(middle, half if reference == "front" else -half)


def blank_of(panel: Panel) -> Blank:
    """What the panel's pattern was laid out from.

    Raises:
        GeometryError: the panel was not built from a job.
    """
    if panel.blank is None:
        raise GeometryError("the panel has no blank, so its seams cannot be found in its pattern")
    return panel.blank


def seam_line(meeting: Meeting, panels: dict[str, Panel], faces: dict[str, Chain]) -> SeamLine:
    """The two edges of a seam and how they run along each other.

    Raises:
        GeometryError: they do not.
    """
    closeness = _closeness([faces[name] for name, _ in meeting.edges])
    first, second = (_moving(border(faces[name], edge, closeness)) for name, edge in meeting.edges)
    mate = match(second, first, max(closeness, 1.01 * meeting.gap))
    names = " and ".join(".".join(edge) for edge in meeting.edges)
    if mate is None and first.loop != second.loop:
        raise GeometryError(
            "stitch: one of the edges goes all round, and the other is open",
            place=f"seam {names}",
            value=second.length,
            limit=first.length,
            remedy="give both surfaces the same gap, or none",
        )
    if mate is None:
        raise GeometryError(
            f"stitch: the edges do not run along each other: they are up to {meeting.gap:.4g} mm "
            "apart",
            place=f"seam {names}",
            value=meeting.gap,
            limit=closeness,
            remedy="give both edges one curve, or place the panels so that they meet",
        )
    sides = panels[meeting.edges[0][0]], panels[meeting.edges[1][0]]
    gap = meeting.gap if meeting.gap > closeness else 0.0
    return SeamLine(meeting.edges, sides, (first, second), mate, gap)


def _moving(edge: Border) -> Border:
    """An edge without the stretches that are a point: the tips of fans have no direction."""
    steps = (len(edge.x) - 1) // len(edge.stretches)
    kept = np.flatnonzero(np.diff(edge.s[::steps]) > POINT * edge.length)
    if len(kept) in (0, len(edge.stretches)):
        return edge
    rows = (kept[:, None] * steps + np.arange(steps)).ravel()
    rows = np.append(rows, (kept[-1] + 1) * steps)
    x = np.linspace(0.0, len(kept), len(rows))
    return replace(
        edge, stretches=edge.stretches[kept], x=x, points=edge.points[rows], s=edge.s[rows]
    )


def _closeness(chains: list[Chain]) -> float:
    """How near edges of these chains are one edge, mm."""
    boxes = np.concatenate([patch_box(patch) for chain in chains for patch in chain.patches])
    return max(CLOSENESS, SHARE * float(np.linalg.norm(np.ptp(boxes, axis=0))))


def at_length(edge: Border, s: Array) -> Array:
    """The x (n,) of an edge at the lengths s (n,) from its start, mm."""
    k = np.clip(np.searchsorted(edge.s, s, side="right") - 1, 0, len(edge.s) - 2)
    low, high = edge.x[k].copy(), edge.x[k + 1].copy()
    step = np.maximum(edge.s[k + 1] - edge.s[k], np.finfo(float).tiny)
    x = low + np.clip((s - edge.s[k]) / step, 0.0, 1.0) * (high - low)
    end = x >= float(len(edge.stretches))  # where a loop would answer for its start
    for turn in range(STEPS):
        beyond = edge.arc(x) - s
        low, high = np.where(beyond <= 0.0, x, low), np.where(beyond >= 0.0, x, high)
        speed = np.linalg.norm(edge(x)[1], axis=1)
        stride = np.divide(beyond, speed, out=np.full_like(x, np.inf), where=speed > 0.0)
        done = (np.abs(stride) <= FOUND * len(edge.stretches)) | (beyond == 0.0) | end
        if done.all():
            break
        good = (x - stride > low) & (x - stride < high) & (turn % 8 < 7)
        x = np.where(done, x, np.where(good, x - stride, 0.5 * (low + high)))
    return x


def corners(edge: Border) -> Array:
    """The x of an edge's corners in space, increasing; that of a loop's own start among them."""
    count = len(edge.stretches)
    x = np.arange(0 if edge.loop else 1, count, dtype=float)
    if not x.size:
        return x
    before, after = _heading(edge, x, -1.0), _heading(edge, x, 1.0)
    sine = np.linalg.norm(np.cross(before, after), axis=1)
    return np.asarray(x[np.arctan2(sine, rows_dot(before, after)) > CORNER])


def _heading(edge: Border, x: Array, way: float) -> Array:
    """Directions (n, 3) of an edge in space right before or behind x (n,)."""
    usual = float(edge.s[-1]) / len(edge.stretches)
    slopes = edge(x + way * SIDE)[1]
    for inside in INSIDE:
        still = ~(np.linalg.norm(slopes, axis=1) > STILL * usual)
        if not still.any():
            break
        slopes[still] = edge(x[still] + way * inside)[1]
    return slopes


def mates(line: SeamLine, x: Array, corner: Flags) -> Array:
    """The x of the second edge beside x (n,) of the first, both (n,).

    The nearest place: where the edges are one that is the same length along either. A corner's
    is the second edge's own corner.
    """
    there = line.mate.carried(x)[0]
    round_ = np.round(there)
    snap = corner & (np.abs(there - round_) <= SNAP)
    return np.where(snap, round_, there)


def second_cut(line: SeamLine) -> float:
    """How far along the first of two loops the second one begins, mm."""
    first, second = line.borders
    x = nearest(first, second.points[:1])[0]
    return float(first.arc(x)[0])


@dataclass(frozen=True, slots=True)
class Feet:
    """Places of an edge in its pattern: ``points`` (n, 2), unit ``tangents`` the way x grows and
    ``normals`` out of the sheet, each (n, 2)."""

    points: Array
    tangents: Array
    normals: Array


def feet(panel: Panel, edge: Border, x: Array) -> Feet:
    """Where x (n,) of an edge lie in the pattern, by the sheet's own parameters."""
    blank = blank_of(panel)
    number, t, v = edge.places(x)
    points, slopes = np.empty((len(x), 2)), np.empty((len(x), 2))
    sides = np.empty((len(x), 2))
    for k in np.unique(number).astype(int):
        here = number == k
        points[here], slopes[here], sides[here] = _flat(blank, edge.name, k, t[here], v[here])
    size = np.hypot(*slopes.T)
    tangents = slopes / np.where(size > 0.0, size, 1.0)[:, None]
    normals = np.column_stack([tangents[:, 1], -tangents[:, 0]])
    out = np.where(rows_dot(normals, sides) >= 0.0, 1.0, -1.0)[:, None]
    return Feet(points, tangents, out * normals)


def _flat(blank: Blank, name: str, k: int, t: Array, v: Array) -> tuple[Array, Array, Array]:
    """Points of an edge in the pattern, its slopes there and a direction out of the sheet."""
    patch, unrolled = blank.chain.patches[k], blank.developments[k]
    origin, e, m = unrolled.axes(t)
    if name in ("start", "end"):
        jet = patch.jet(t, 0)
        v = np.clip(v, jet.v_from[0], jet.v_to[0])
        return origin + v[:, None] * e, e, m if name == "end" else -m
    middle = 0.5 * (patch.domain[0] + patch.domain[1])
    points, slopes = _rail(blank, name, k, np.append(t, middle))
    usual = float(np.hypot(*slopes.T).max())
    points, slopes = points[:-1], slopes[:-1]
    for inside in INSIDE:
        still = ~(np.hypot(*slopes.T) > STILL * usual)
        if not still.any():
            break
        slopes[still] = _rail(blank, name, k, t[still] + inside * (middle - t[still]))[1]
    return points, slopes, e if name == "top" else -e


def _rail(blank: Blank, name: str, k: int, t: Array) -> tuple[Array, Array]:
    """Points of a rail in the pattern and their derivatives, each (n, 2)."""
    patch = blank.chain.patches[k]
    origin, e, m = blank.developments[k].axes(t)
    frame, jet = patch.frame(t), patch.jet(t, 1)
    v, slope = (jet.v_to if name == "top" else jet.v_from)[:2]
    slopes = (frame.p + slope)[:, None] * e + (frame.q + v * frame.a)[:, None] * m
    return origin + v[:, None] * e, slopes


@dataclass(frozen=True, slots=True)
class Holes:
    """Holes of one side of a seam in its pattern: ``centres`` (n, 2), and their ``feet`` on the
    seam line."""

    centres: Array
    feet: Feet


def hole_centres(panel: Panel, edge: Border, x: Array, offset: float, corner: Flags) -> Holes:
    """Holes at ``offset`` mm outwards of the places x (n,) of an edge, square to it.

    At a corner, on its bisector: at the offset from both its sides.
    """
    found = feet(panel, edge, x)
    points, tangents, normals = found.points, found.tangents.copy(), found.normals.copy()
    centres = points + offset * normals
    for k in np.flatnonzero(corner).tolist():
        two = _both_sides(panel, edge, x[k])
        if float(two.normals[0] @ two.normals[1]) < np.cos(BENT):
            tangents[k] = _unit(two.tangents.sum(axis=0), tangents[k])
            normals[k] = _unit(two.normals.sum(axis=0), normals[k])
            centres[k] = _in_corner(panel, edge, x[k], offset)[0]
    return Holes(centres, Feet(points, tangents, normals))


def reach(panel: Panel, edge: Border, x: float, offset: float) -> tuple[float, float]:
    """How far before and behind a corner the feet of its hole lie on the edge, mm in space.

    Both are 0 where the hole lies beyond the edge's ends. Between them there is no other hole.
    """
    at = _in_corner(panel, edge, x, offset)[1]
    if at is None:
        return 0.0, 0.0
    length, (before, after) = edge.length, edge.arc(at) - edge.arc(np.array([x]))
    around = (np.mod(-before, length), np.mod(after, length)) if edge.loop else (-before, after)
    return float(around[0]), float(around[1])


def _both_sides(panel: Panel, edge: Border, x: float) -> Feet:
    """The two sides of a corner, right before and behind it."""
    return feet(panel, edge, x + np.array([-SIDE, SIDE]))


def _unit(direction: Array, otherwise: Array) -> Array:
    size = float(np.hypot(*direction))
    return direction / size if size > 0.0 else otherwise


def _in_corner(panel: Panel, edge: Border, x: float, offset: float) -> tuple[Array, Array | None]:
    """The point at ``offset`` from both sides of a corner, and the x (2,) of its feet on them:
    where it lies beside both; else from their tangents prolonged, and None."""
    point, two = feet(panel, edge, np.array([x])).points[0], _both_sides(panel, edge, x)
    first, second = two.normals
    step = offset * (first + second) / max(1.0 + float(first @ second), 2.0 / MITRE**2)
    centre, ahead = point + step, two.tangents @ step
    if not (ahead[0] < 0.0 < ahead[1]):
        return centre, None
    at = x + np.array([-SIDE, SIDE])
    speed = _speeds(panel, edge, at)
    for _ in range(STEPS):
        there = feet(panel, edge, at)
        away = centre - there.points
        ahead, off = rows_dot(away, there.tangents), rows_dot(away, there.normals) - offset
        at = np.array([min(at[0] + ahead[0] / speed[0], x), max(at[1] + ahead[1] / speed[1], x)])
        move = np.linalg.solve(there.normals, off)
        centre = centre - move
        if max(float(np.abs(move).max()), float(np.abs(ahead).max())) <= SETTLED * abs(offset):
            break
    return centre, at


def _speeds(panel: Panel, edge: Border, x: Array) -> Array:
    """mm of the pattern for each unit of x there, (n,)."""
    step = 0.5 * SIDE
    ends = [feet(panel, edge, x + side).points for side in (-step, step)]
    return np.asarray(np.hypot(*(ends[1] - ends[0]).T) / SIDE)
