"""Where a seam begins for its holes: far enough from the neighbouring edge that is cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.flatten.pattern import Edge, Pattern
from devcad.geometry.chebyshev import Piecewise, resolve
from devcad.geometry.taylor import Array, rows_dot
from devcad.shop.seamlines import INSIDE, STILL, SeamLine, at_length, feet
from devcad.shop.settings import EdgeFinish, EdgeName, Stitch

Edges = Mapping[str, Mapping[EdgeName, EdgeFinish]]
"""What is done with the edges of panels, by the panel's name."""
GRID = 65
"""Places of a seam at which its first hole is looked for, closer to each other near its end."""
LOOKS = 65
"""Places of a panel of an edge's series from which the nearest one is looked for."""
STEPS = 60
"""Steps of a search, at most."""
SHORT = 1e-15
"""Of a place: where it is known so well it is found."""
FOUND, ROUGH = 1e-14, 1e-8
"""Of an edge: a step of Newton's so short is the last, where the place or where only the distance
is asked for, which is then known to the square of it."""
NEAR_END = 1e-12
"""Of a loop: so far before its end its last place is taken, which else is its first."""
CLOSED = 1e-9
"""Of its size: an edge whose ends are no farther apart is a loop."""
STRAIGHT = 1e-6
"""The sine by which a corner of a sheet has to be less than 180 degrees to be one."""
BLOCK = 2_000_000
"""Pairs of a point and a sample that are compared at a time."""


def allowance_of(edges: Edges, panel: str, edge: str) -> float:
    """How far beyond the seam line an edge is cut, mm."""
    return next((f.allowance for name, f in edges.get(panel, {}).items() if name == edge), 0.0)


def cut_open(line: SeamLine, side: int) -> bool:
    """Whether the sheet is cut from the seam on: a flat disc is not."""
    names = {edge.name for edge in line.sides[side].pattern.outline}
    return not names <= {line.borders[side].name}


def kept_free(line: SeamLine, side: int, at_end: bool, edges: Edges, stitch: Stitch) -> float:
    """How much of a seam has no hole at an end of its first (0) or second (1) edge, mm.

    Beyond it every hole of that side keeps ``inset`` from the neighbouring edge that is cut.
    0 where the sheet goes round the end of the seam, the seam's length where no hole keeps it.
    """
    panel, edge = line.sides[side], line.borders[side]
    neighbours, begins = _neighbours(panel.pattern, edge.name, at_end)
    if not neighbours:
        return 0.0
    offset = allowance_of(edges, panel.name, edge.name) - stitch.inset
    needed = stitch.inset - allowance_of(edges, panel.name, neighbours[0].name)
    last = len(edge.stretches) * (1.0 - (NEAR_END if edge.loop else 0.0))
    first, final = (last, 0.0) if at_end else (0.0, last)
    common = _common(neighbours, begins)
    if feet(panel, edge, np.array([first])).normals[0] @ common[1] >= -STRAIGHT:
        return 0.0  # the sheet has no corner of less than 180 degrees there
    near = [looks(neighbour) for neighbour in neighbours]

    def room(x: Array) -> Array:
        at = feet(panel, edge, x)
        return _inwards(near, begins, common, at.points + offset * at.normals) - needed

    s = edge.length * np.linspace(0.0, 1.0, GRID) ** 2
    grid = at_length(edge, edge.length - s if at_end else s)
    grid[[0, -1]] = first, final
    rooms = room(grid)
    slack = NEAR_END * edge.length
    k = int(np.argmax(rooms >= -slack))
    if k == 0:
        return 0.0 if rooms[0] >= -slack else edge.length
    x = _zero(room, grid[k - 1 : k + 1].tolist(), rooms[k - 1 : k + 1].tolist(), 0.1 * slack)
    along = float(edge.arc(np.array([x]))[0])
    return edge.length - along if at_end else along


def _zero(
    room: Callable[[Array], Array], ends: Sequence[float], rooms: Sequence[float], slack: float
) -> float:
    """Where between two places the room is 0, by the Illinois rule: it is below 0 at the first."""
    (low, high), (below, above) = ends, rooms
    for _ in range(STEPS):
        x = high - above * (high - low) / (above - below)
        value = float(room(np.array([x]))[0])
        if value >= 0.0:
            high, above, below = x, value, 0.5 * below
        else:
            low, below, above = x, value, 0.5 * above
        if abs(value) <= slack or abs(high - low) <= SHORT * abs(high):
            return x
    return high


def _neighbours(pattern: Pattern, name: str, at_end: bool) -> tuple[list[Edge], bool]:
    """The edges of an outline next to an end of one of its sides, the nearest first, and whether
    they begin there; none where the side is not there, or all there is."""
    outline, count = pattern.outline, len(pattern.outline)
    own = [k for k, edge in enumerate(outline) if edge.name == name]
    if not own or len(own) == count:
        return [], False
    begins = at_end == (name in ("start", "top"))  # those run as x grows, the others against it
    step = 1 if begins else -1
    k = own[-1 if begins else 0] + step
    run: list[Edge] = []
    other = outline[k % count].name
    while outline[k % count].name == other and len(run) < count:
        run.append(outline[k % count])
        k += step
    return run, begins


def _common(edges: list[Edge], begins: bool) -> tuple[Array, Array]:
    """The end that neighbouring edges share with the seam, and their unit direction from it."""
    edge = edges[0]
    near, far = (edge.u[0], edge.u[-1]) if begins else (edge.u[-1], edge.u[0])
    point = edge.curve(np.array([near]))[0][0]
    slopes = edge.curve(near + np.array([1e-9, *INSIDE, 0.5]) * (far - near))[1] * (far - near)
    speeds = np.hypot(*slopes.T)
    slope = slopes[int(np.argmax(speeds > STILL * speeds.max()))]  # a rail may begin at rest
    return point, slope / max(float(np.hypot(*slope)), np.finfo(float).tiny)


def _inwards(near: list[Looks], begins: bool, common: tuple[Array, Array], points: Array) -> Array:
    """How far points (n, 2) lie inside of neighbouring edges, which run on straight beyond the
    end that they share with the seam, (n,)."""
    best, inside = np.full(len(points), np.inf), np.zeros(len(points))
    start, onwards = common
    for number, seen in enumerate(near):
        at, slopes = seen(foot_on(seen, points, ROUGH))
        run = seen.way * slopes
        run /= np.maximum(np.hypot(*run.T), np.finfo(float).tiny)[:, None]
        away = points - at
        value = run[:, 0] * away[:, 1] - run[:, 1] * away[:, 0]  # the sheet is on the left
        far = np.hypot(*away.T)
        if number == 0:
            from_common = points - start
            before = from_common @ onwards < 0.0
            left = onwards[0] * from_common[:, 1] - onwards[1] * from_common[:, 0]
            value = np.where(before, left if begins else -left, value)
            far = np.where(before, np.abs(left), far)
        nearer = far < best
        best, inside = np.where(nearer, far, best), np.where(nearer, value, inside)
    return inside


@dataclass(frozen=True, slots=True)
class Looks:
    """An edge as a series of x, y and their derivatives, to rounding; samples of it, u (k,) and
    points (k, 2); and its ``way``, 1 where it runs with rising u, else -1."""

    series: Piecewise
    u: Array
    points: Array
    way: float

    def __call__(self, u: Array) -> tuple[Array, Array]:
        """The points at u (n,) and their derivatives, each (n, 2)."""
        both = self.series(u)
        return both[:, :2], both[:, 2:]


def looks(edge: Edge) -> Looks:
    """What is asked of an edge again and again."""
    knots = np.sort(edge.u)
    size = float(np.abs(edge.curve(knots)[0]).max())
    series = resolve(lambda u: edge.curve(u)[0], knots, scale=size)
    u = np.unique(np.linspace(series.knots[:-1], series.knots[1:], LOOKS))
    way = 1.0 if edge.u[-1] > edge.u[0] else -1.0
    both = np.concatenate([series.coefficients, series.derivative().coefficients], axis=2)
    return Looks(replace(series, coefficients=both), u, series(u), way)


def _round_the_end(edge: Looks, points: Array, k: Array) -> Array:
    """The nearest samples ``k`` (n,), and where that is the point at which a loop begins and ends,
    the one of its two ends on whose side the foot lies."""
    last = len(edge.u) - 1
    size = float(np.ptp(edge.points, axis=0).max())
    if np.hypot(*(edge.points[0] - edge.points[last])) > CLOSED * size:
        return k
    found, slopes = edge(edge.u[:1])
    ends = (k == 0) | (k == last)
    return np.where(ends, np.where((found - points) @ slopes[0] > 0.0, last, 0), k)


def foot_on(edge: Looks, points: Array, found_by: float = FOUND) -> Array:
    """The u (n,) at which an edge is nearest to points (n, 2)."""
    u, samples = edge.u, edge.points
    rows = max(1, BLOCK // len(u))
    blocks = np.split(points, range(rows, len(points), rows))
    k = np.concatenate([((b[:, None] - samples) ** 2).sum(axis=2).argmin(axis=1) for b in blocks])
    k = _round_the_end(edge, points, k)
    at, low, high = u[k], u[np.maximum(k - 1, 0)], u[np.minimum(k + 1, len(u) - 1)]
    reach = found_by * (u[-1] - u[0])
    for step in range(STEPS):
        found, slopes = edge(at)
        pull = rows_dot(found - points, slopes)
        low, high = np.where(pull <= 0.0, at, low), np.where(pull >= 0.0, at, high)
        square = rows_dot(slopes, slopes)
        stride = np.divide(pull, square, out=np.full_like(at, np.inf), where=square > 0.0)
        good = (at - stride >= low) & (at - stride <= high) & (step % 4 < 3)
        at = np.where(good, at - stride, 0.5 * (low + high))
        if ((good & (np.abs(stride) <= reach)) | (high - low <= reach)).all():
            break
    return np.asarray(at)
