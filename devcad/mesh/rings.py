"""What cuts leave of the strips between rulings: polygons of nodes, and the edges on borders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from devcad.geometry.cells import Cell, Run, Stretch
from devcad.mesh.nodes import CORNERS, Nodes, Rows

Ring = list[int]


@dataclass(frozen=True, slots=True)
class Rings:
    """What is left of one patch.

    ``plain`` are the cells that no cut touches. Of the others ``polygons`` has the rings, outer
    ones counterclockwise, holes clockwise: (cell, rings). ``edges[side]`` are the stretches of
    cells' borders that are left, node after node counterclockwise: (cell, nodes).
    """

    plain: list[int] = field(default_factory=list)
    polygons: list[tuple[int, list[Ring]]] = field(default_factory=list)
    edges: dict[int, list[tuple[int, Ring]]] = field(
        default_factory=lambda: {side: [] for side in CORNERS}
    )


def rings_of(found: Sequence[Cell], nodes: Nodes, rows: Rows) -> Rings:
    """The rings of all cells of a patch."""
    out = Rings()
    ids = nodes.ids[0].tolist()
    for index, cell in enumerate(found):
        if _plain(cell) and not nodes.borders[index] and not nodes.borders[index + 1]:
            out.plain.append(index)
            for side, (start, end) in CORNERS.items():
                ring = [nodes.corner(index, start), nodes.corner(index, end)]
                out.edges[side].append((index, ring))
            continue
        rings = [_loop(loop, index, nodes, rows, out) for loop in cell.loops]
        rings += [_run(hole, nodes, rows) for hole in cell.holes]
        rings = _spliced([ring for r in rings if (ring := cleaned(r, ids))], ids)
        if rings:
            out.polygons.append((index, rings))
    return out


def _plain(cell: Cell) -> bool:
    if len(cell.loops) != 1 or cell.holes:
        return False
    return not any(isinstance(item, Run) for item in cell.loops[0])


def _loop(
    loop: tuple[Stretch | Run, ...], index: int, nodes: Nodes, rows: Rows, out: Rings
) -> Ring:
    """The ring of a loop, corners twice; its stretches are told to ``out``."""
    chains = [_run(item, nodes, rows) if isinstance(item, Run) else [] for item in loop]
    for k, item in enumerate(loop):
        if isinstance(item, Run):
            continue
        start, end = (nodes.corner(index, place) for place in CORNERS[item.side])
        first = start if item.first is None else chains[k - 1][-1]
        last = end if item.last is None else chains[(k + 1) % len(loop)][0]
        chains[k] = [first, *_between(item, index, nodes), last]
        out.edges[item.side].append((index, chains[k]))
    return [node for chain in chains for node in chain]


def _run(run: Run, nodes: Nodes, rows: Rows) -> Ring:
    return [int(k) for piece in run.pieces for k in nodes.node[rows.of(piece)]]


def _between(item: Stretch, index: int, nodes: Nodes) -> Ring:
    """The nodes on a stretch of a ruling, without its ends."""
    if item.side in (1, 3):
        return []
    border = nodes.borders[index + item.side // 2]
    low, high = min(item.start, item.end), max(item.start, item.end)
    inside = [k for k in border if low < nodes.v[k] < high]
    return inside if item.side == 0 else inside[::-1]


def cleaned(ring: Ring, ids: list[int]) -> Ring:
    """A ring without repeated points and without spikes a b a; empty where nothing is inside."""
    out: Ring = []
    for node in ring:
        if out and ids[node] == ids[out[-1]]:
            continue
        if len(out) > 1 and ids[node] == ids[out[-2]]:
            out.pop()
            continue
        out.append(node)
    while len(out) > 2:
        if ids[out[0]] == ids[out[-1]]:
            out.pop()
        elif ids[out[0]] == ids[out[-2]]:
            del out[-2:]
        elif ids[out[1]] == ids[out[-1]]:
            del out[0], out[-1]
        else:
            return out
    return []


def _spliced(rings: list[Ring], ids: list[int]) -> list[Ring]:
    """The rings, those that share a point made one: a hole that touches a border, or another."""
    owner: dict[int, int] = {}
    out: list[Ring] = []
    for ring in rings:
        touched = next((ids[node] for node in ring if ids[node] in owner), None)
        if touched is None:
            out.append(ring)
            owner |= {ids[node]: len(out) - 1 for node in ring}
            continue
        k = owner[touched]
        i = next(j for j, node in enumerate(out[k]) if ids[node] == touched)
        j = next(j for j, node in enumerate(ring) if ids[node] == touched)
        merged = [*out[k][: i + 1], *ring[j + 1 :], *ring[: j + 1], *out[k][i + 1 :]]
        out[k] = cleaned(merged, ids)
        owner = {ids[node]: n for n, whole in enumerate(out) for node in whole}
    return [ring for ring in out if ring]
