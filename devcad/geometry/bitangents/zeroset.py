"""The zero set of a function of two parameters on a rectangle: all its branches, as polylines.

Signs on a grid tell where branches cross the grid's lines; the crossings are refined and linked
cell by cell. Where two branches cross one another (a node: value and gradient vanish, the
Hessian is indefinite), or three (where it vanishes too), the links of the cells around are
replaced by straight passages. No closed branch larger than a cell of the grid is missed.

Source: marching squares; Allgower and Georg, Numerical Continuation Methods, chapter 15.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry.bitangents.nodes import Height, Node, nodes, solved
from devcad.geometry.taylor import Array

HALVINGS = 24
"""Halvings of an edge of the grid: crossings are only guesses to start Newton's method from."""
WIDEST = 4
"""Cells around a node within which its four arms must come apart."""


class Unresolved(Exception):
    """The grid is too coarse for what happens near ``place`` (2,)."""

    def __init__(self, place: Array) -> None:
        super().__init__("the grid is too coarse")
        self.place = place


@dataclass(frozen=True, slots=True)
class Branch:
    """Places (k, 2) along one branch, in order; parameters continue beyond their periods.

    ``closed``: the last place is the first one, up to whole periods. ``nodes`` gives the node at
    those places that are one.
    """

    places: Array
    closed: bool
    nodes: dict[int, Node]


@dataclass(frozen=True, slots=True)
class Grid:
    """Lines s = ``first`` (k + 1,) and t = ``second`` (m + 1,), and the ``values`` (k + 1, m + 1).

    A period (0 where there is none) is the distance of the last line from the first.
    """

    first: Array
    second: Array
    values: Array
    periods: tuple[float, float]


def branches(height: Height, grid: Grid) -> list[Branch]:
    """All branches of height = 0, with nodes passed straight through.

    Raises:
        Unresolved: around a node the grid does not see as many arms as it has.
    """
    marks = _Marks(grid)
    places = _refined(height, grid, marks.edges)
    cells = _cells(grid, marks)
    crossings = _by_cell(height, grid, cells)
    return _walked(grid, places, _links(height, grid, places, cells, crossings))


class _Marks:
    """The edges on which the sign changes: ``edges`` (n, 3) = (direction, i, j), numbered."""

    def __init__(self, grid: Grid) -> None:
        positive = grid.values > 0.0
        if grid.periods[0]:
            positive[-1] = positive[0]
        if grid.periods[1]:
            positive[:, -1] = positive[:, 0]
        self.positive = positive
        along_s = np.argwhere(positive[1:] != positive[:-1])
        along_t = np.argwhere(positive[:, 1:] != positive[:, :-1])
        if grid.periods[1]:
            along_s = along_s[along_s[:, 1] < len(grid.second) - 1]
        if grid.periods[0]:
            along_t = along_t[along_t[:, 0] < len(grid.first) - 1]
        zero, one = np.zeros((len(along_s), 1), int), np.ones((len(along_t), 1), int)
        self.edges = np.concatenate([np.hstack([zero, along_s]), np.hstack([one, along_t])])
        self.number = {tuple(edge): k for k, edge in enumerate(self.edges.tolist())}


def _refined(height: Height, grid: Grid, edges: Array) -> Array:
    """Where the function vanishes on each edge, (n, 2), by bisection."""
    direction, i, j = edges.T
    low = np.column_stack([grid.first[i], grid.second[j]])
    high = np.column_stack([grid.first[i + (direction == 0)], grid.second[j + (direction == 1)]])
    start = grid.values[i, j] > 0.0
    for _ in range(HALVINGS if len(edges) else 0):
        middle = 0.5 * (low + high)
        same = ((height.value(*middle.T) > 0.0) == start)[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(0.5 * (low + high))


@dataclass(frozen=True, slots=True)
class _Cell:
    """The edges crossed by their numbers: below, right, above, left; None where not."""

    sides: tuple[int | None, ...]
    corner: bool  # whether the function is positive at the lower left corner


def _cells(grid: Grid, marks: _Marks) -> dict[tuple[int, int], _Cell]:
    """The cells with crossed edges."""
    k, m = len(grid.first) - 1, len(grid.second) - 1

    def edge(direction: int, i: int, j: int) -> int | None:
        i = 0 if grid.periods[0] and i == k else i
        j = 0 if grid.periods[1] and j == m else j
        return marks.number.get((direction, i, j))

    p = marks.positive
    corners = np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]])
    mixed = corners.any(axis=0) & ~corners.all(axis=0)
    out = {}
    for i, j in np.argwhere(mixed).tolist():
        sides = (edge(0, i, j), edge(1, i + 1, j), edge(0, i, j + 1), edge(1, i, j))
        out[i, j] = _Cell(sides, bool(p[i, j]))
    return out


def _by_cell(
    height: Height, grid: Grid, cells: dict[tuple[int, int], _Cell]
) -> dict[tuple[int, int], Node]:
    """The nodes near crossed cells, by the cell that they lie in."""
    out: dict[tuple[int, int], Node] = {}
    if not cells:
        return out
    index = np.array(list(cells))
    size = np.column_stack([np.diff(grid.first)[index[:, 0]], np.diff(grid.second)[index[:, 1]]])
    corner = np.column_stack([grid.first[index[:, 0]], grid.second[index[:, 1]]])
    for node in nodes(height, corner + 0.5 * size, size):
        cell = _cell_of(grid, node.place)
        if cell is not None:
            out.setdefault(cell, node)
    return out


def _cell_of(grid: Grid, place: Array) -> tuple[int, int] | None:
    """The cell that holds a place, None outside an open side; wraps the place's parameters."""
    index = []
    for axis, lines in enumerate((grid.first, grid.second)):
        if grid.periods[axis]:
            place[axis] = lines[0] + (place[axis] - lines[0]) % grid.periods[axis]
        at = int(np.searchsorted(lines, place[axis], side="right")) - 1
        if not 0 <= at < len(lines) - 1:
            return None
        index.append(at)
    return index[0], index[1]


_Link = tuple[int, int, Node | None]


def _links(
    height: Height,
    grid: Grid,
    places: Array,
    cells: dict[tuple[int, int], _Cell],
    nodes: dict[tuple[int, int], Node],
) -> list[_Link]:
    """Which crossings follow one another: two in a cell, a node's arms straight through."""
    taken: set[tuple[int, int]] = set()
    out: list[_Link] = []
    for cell, node in nodes.items():
        block, arms = _arms(grid, places, cells, cell, nodes)
        if block & taken:
            raise Unresolved(node.place)
        taken |= block
        out += arms
    for (i, j), cell_at in cells.items():
        if (i, j) in taken:
            continue
        crossed = [side for side in cell_at.sides if side is not None]
        if len(crossed) == 2:
            out.append((crossed[0], crossed[1], None))
            continue
        below, right, above, left = crossed
        inside = _saddle(height, grid, i, j) > 0.0
        if inside == cell_at.corner:
            out += [(below, right, None), (above, left, None)]
        else:
            out += [(below, left, None), (above, right, None)]
    return out


def _saddle(height: Height, grid: Grid, i: int, j: int) -> float:
    """The critical value in a cell with four crossed edges; the value in its middle if none."""
    low = np.array([grid.first[i], grid.second[j]])
    size = np.array([grid.first[i + 1], grid.second[j + 1]]) - low
    place = middle = low + 0.5 * size
    for _ in range(8):
        _, gradient, hessian = height.bends(place[:1], place[1:])
        place = place + solved(hessian, -gradient)[0]
        if not (np.abs(place - middle) <= size).all():
            place = middle
            break
    return float(height.value(place[:1], place[1:])[0])


def _arms(
    grid: Grid,
    places: Array,
    cells: dict[tuple[int, int], _Cell],
    centre: tuple[int, int],
    nodes: dict[tuple[int, int], Node],
) -> tuple[set[tuple[int, int]], list[_Link]]:
    """The block of cells around a node in which it is passed, and its passages."""
    node = nodes[centre]
    shape = len(grid.first) - 1, len(grid.second) - 1
    for reach in range(1, WIDEST + 1):
        block = set()
        steps = range(-reach, reach + 1)
        for di, dj in itertools.product(steps, steps):
            i, j = centre[0] + di, centre[1] + dj
            i = i % shape[0] if grid.periods[0] else i
            j = j % shape[1] if grid.periods[1] else j
            block.add((i, j))
        if block & (set(nodes) - {centre}):
            break
        seen: dict[int, int] = {}
        for cell in block & set(cells):
            for side in cells[cell].sides:
                if side is not None:
                    seen[side] = seen.get(side, 0) + 1
        ends = [side for side, times in seen.items() if times == 1]
        if len(ends) == 2 * len(node.directions):
            return block, [(a, b, node) for a, b in _opposite(grid, places, node, ends)]
    raise Unresolved(node.place)


def _walked(grid: Grid, places: Array, links: list[_Link]) -> list[Branch]:
    """The branches: crossings followed from link to link, first those that end at a side."""
    following: dict[int, list[tuple[int, Node | None]]] = {k: [] for k in range(len(places))}
    for a, b, node in links:
        following[a].append((b, node))
        following[b].append((a, node))
    done: set[int] = set()
    out = []
    for start in sorted(following, key=lambda k: len(following[k])):
        if start not in done and following[start]:
            out.append(_one(grid, places, following, start, done))
    return out


def _opposite(grid: Grid, places: Array, node: Node, ends: list[int]) -> list[tuple[int, int]]:
    """The arms of a node in pairs, opposite ones together."""
    away = np.array([_nearest(grid, node.place, places[k]) - node.place for k in ends])
    scale = np.abs(away).max(axis=0)
    order = np.argsort(np.arctan2(away[:, 1] / scale[1], away[:, 0] / scale[0]))
    half = len(ends) // 2
    return [(ends[a], ends[b]) for a, b in zip(order[:half], order[half:], strict=True)]


def _nearest(grid: Grid, here: Array, there: Array) -> Array:
    """``there``, moved by whole periods to be next to ``here``."""
    out = there.copy()
    for axis, period in enumerate(grid.periods):
        if period:
            out[axis] -= period * np.round((there[axis] - here[axis]) / period)
    return out


def _one(
    grid: Grid,
    places: Array,
    following: dict[int, list[tuple[int, Node | None]]],
    start: int,
    done: set[int],
) -> Branch:
    """The branch through one crossing, from it on."""
    path, nodes, at = [places[start]], {}, start
    done.add(start)
    came: tuple[int, Node | None] | None = None
    closed = False
    while True:
        ways = list(following[at])
        if came is not None:
            ways.remove(came)
        if not ways:
            break
        onward, node = ways[0]
        if node is not None:
            place = _nearest(grid, path[-1], node.place)
            nodes[len(path)] = replace(node, place=place)
            path.append(place)
        path.append(_nearest(grid, path[-1], places[onward]))
        came, at = (at, node), onward
        if onward == start:
            closed = True
            break
        done.add(onward)
    return Branch(np.array(path), closed, nodes)
