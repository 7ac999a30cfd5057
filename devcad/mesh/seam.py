"""Meshes of several sheets joined along their seams: the same points on both sides, to the bit.

Each sheet keeps its triangles. Where another side of a seam has a point and this one has none,
the triangle at the edge is divided there: the new point lies on the true edge, within the strip
between two certified rulings, so that the distance to the surface stays certified. Then points
that are one are made equal: those of later panels to the first one's.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.seams import EDGES, Border, Key, Ties, closest, match, nearest
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh

Flat = Callable[[int, Array, Array], Array]
"""patch number, t (n,), v (n,) -> the places in the pattern (n, 2)."""
Index = NDArray[np.intp]
TAKEN_OVER = 2e-8
"""Of the sheet: a mesh takes the ruling between two patches from one of them, which may differ
from the other's by half of this."""
BULGE = 1.5
"""The middle of a chord is nearer to its edge than the mesh's deviation; this is safe."""
WHOLE = 1e-6
"""Chords whose stretches of an edge add up to more than its length by this share are not one run
along it."""


@dataclass(frozen=True, slots=True)
class Side:
    """An edge of a sheet: the sheet's number and the edge as a curve."""

    sheet: int
    border: Border

    @property
    def key(self) -> Key:
        """What tells it from other edges."""
        return self.sheet, EDGES.index(self.border.name)


@dataclass(frozen=True, slots=True)
class _Rim:
    """The chords along an edge: from corner ``corner`` of triangle ``row`` to the next one, its
    ends the points ``ids`` (n, 2). They lie at ``x`` (n,) and x + ``step`` along the edge."""

    row: Index
    corner: Index
    ids: Index
    x: Array
    step: Array


@dataclass(slots=True)
class _Work:
    """A sheet's mesh, and the points that are to divide its chords: ``put[row]`` lists corners of
    the triangle and the new vertices that follow each."""

    mesh: Mesh
    flat: Flat
    put: dict[int, list[tuple[int, list[int]]]] = field(default_factory=dict)
    points: list[Array] = field(default_factory=list)
    normals: list[Array] = field(default_factory=list)
    flats: list[Array] = field(default_factory=list)
    added: int = 0

    @property
    def near(self) -> float:
        """How near a point of the mesh lies to the edge it was taken from, mm."""
        return TAKEN_OVER * float(np.linalg.norm(np.ptp(self.mesh.vertices, axis=0)))


def sewn(
    meshes: Sequence[Mesh],
    flats: Sequence[Flat],
    seams: Sequence[tuple[Side, Side]],
    closeness: float,
) -> tuple[tuple[Mesh, ...], tuple[bool, ...]]:
    """The meshes of open sheets with equal points along every seam, and which seams are so.

    Args:
        flats: where the points of each sheet lie in its pattern.
        seams: pairs of edges that coincide within ``closeness`` (mm). Edges that several seams
            join are one bundle; it stays as it is if the mesh of one does not follow its edge
            in one run (the edge touches itself).
    Returns:
        the same objects where nothing changed. A mesh's deviation grows by what its points
        moved, which is the gap.
    """
    work = [_Work(mesh, flat) for mesh, flat in zip(meshes, flats, strict=True)]
    ties, done = Ties(), set[Key]()
    for bundle in _bundles(seams):
        if _tied(bundle, work, ties, closeness):
            done.update(side.key for side in bundle)
    tied: dict[int, dict[int, Key]] = defaultdict(dict)
    for sheet, point in ties.keys:
        tied[sheet][point] = ties.root((sheet, point))
    divided = [_divided(item) if k in tied else item.mesh for k, item in enumerate(work)]
    tables = {sheet: _table(divided[sheet]) for sheet in tied}
    places = {key: tables[key[0]][key[1]] for roots in tied.values() for key in roots.values()}
    made = [_moved(mesh, tied[k], places) if k in tied else mesh for k, mesh in enumerate(divided)]
    return tuple(made), tuple(a.key in done and b.key in done for a, b in seams)


def _bundles(seams: Sequence[tuple[Side, Side]]) -> list[list[Side]]:
    """The edges that seams join, directly or by way of others, in the order of the seams."""
    ties, sides = Ties(), dict[Key, Side]()
    for first, second in seams:
        sides.setdefault(first.key, first)
        sides.setdefault(second.key, second)
        ties.tie(first.key, second.key)
    bundles: dict[Key, list[Side]] = defaultdict(list)
    for key, side in sides.items():
        bundles[ties.root(key)].append(side)
    return list(bundles.values())


def _tied(bundle: list[Side], work: list[_Work], ties: Ties, closeness: float) -> bool:
    """Whether the edges of a bundle run along one another; then their points are tied."""
    first = bundle[0].border
    if all(side.border.length <= closeness for side in bundle):
        _tie_apexes(bundle, work, ties, closeness)
        return True
    rims, along = [], []
    for side in bundle:
        rim = _rim(work[side.sheet], side.border)
        if rim is None:
            return False
        x = np.stack([rim.x, rim.x + rim.step])
        if side is not bundle[0]:
            run = match(first, side.border, closeness)
            if run is None:
                return False
            x = run.carried(x.ravel())[0].reshape(2, -1)
        rims.append(rim)
        along.append(first.arc(x.ravel()).reshape(2, -1))
    groups = _groups([s.ravel() for s in along], closeness, first)
    count = 1 + max(int(group.max()) for group in groups)
    stations: list[list[Key]] = [[] for _ in range(count)]
    for side, rim, group in zip(bundle, rims, groups, strict=True):
        for number, point in zip(group.tolist(), rim.ids.T.ravel().tolist(), strict=True):
            stations[number].append((side.sheet, point))
    sources = [min(keys) for keys in stations]
    tables = {side.sheet: _table(work[side.sheet].mesh) for side in bundle}
    where = np.array([tables[sheet][point] for sheet, point in sources])
    for side, rim, group, s in zip(bundle, rims, groups, along, strict=True):
        begins, ends = group.reshape(2, -1)
        forward = _forward(s, first)
        for number, key in _divide(work[side.sheet], side, rim, begins, ends, where, forward):
            stations[number].append(key)
    for keys in stations:
        for one, other in pairwise(keys):
            ties.tie(one, other)
    return True


def _tie_apexes(bundle: list[Side], work: list[_Work], ties: Ties, closeness: float) -> None:
    """Tie the points that are the bundle's one point."""
    keys = []
    for side in bundle:
        item = work[side.sheet]
        away = np.linalg.norm(item.mesh.vertices - side.border.points[0], axis=1)
        found = np.unique(item.mesh.weld[away <= max(closeness, item.near)])
        keys += [(side.sheet, int(point)) for point in found]
    for one, other in pairwise(keys):
        ties.tie(one, other)


def _rim(item: _Work, edge: Border) -> _Rim | None:
    """The chords of a mesh along an edge; None if they are not one run along it, or none."""
    mesh = item.mesh
    corners = mesh.weld[mesh.triangles].astype(np.int64)
    onwards = np.roll(corners, -1, axis=1)
    size = int(mesh.weld.max()) + 1
    lone = ~np.isin(corners * size + onwards, onwards * size + corners)
    row, corner = np.nonzero(lone)
    ids = np.stack([corners[row, corner], onwards[row, corner]], axis=1)
    points, inverse = np.unique(ids, return_inverse=True)
    table = _table(mesh)
    x, away = nearest(edge, table[points])
    x, on = x[inverse.reshape(ids.shape)], (away <= item.near)[inverse.reshape(ids.shape)]
    kept = on.all(axis=1)
    row, corner, ids, x = row[kept], corner[kept], ids[kept], x[kept]
    step = x[:, 1] - x[:, 0]
    count = float(len(edge.stretches))
    if edge.loop:
        step = step - count * np.round(step / count)
    middle = 0.5 * (table[ids[:, 0]] + table[ids[:, 1]])
    off = closest(edge, middle, x[:, 0] + 0.5 * step, 0.5 * np.abs(step))[1]
    kept = (off <= BULGE * mesh.deviation + item.near) & (step != 0.0)
    rim = _Rim(row[kept], corner[kept], ids[kept], x[kept, 0], step[kept])
    ends = np.stack([rim.x, rim.x + rim.step])
    low, high = edge.arc(ends.ravel()).reshape(2, -1)
    run = np.where(rim.step > 0.0, high - low, low - high)
    run = np.where(run < 0.0, run + edge.length, run).sum()
    one_way = len({*np.sign(rim.step).tolist()}) == 1
    return rim if one_way and run <= (1.0 + WHOLE) * edge.length else None


def _groups(along: list[Array], closeness: float, first: Border) -> list[Index]:
    """For each side's points the number of its station along the first edge, counted from the
    start; points within ``closeness`` of each other share one."""
    every = np.concatenate(along)
    order = np.argsort(every, kind="stable")
    gaps = np.diff(every[order])
    number = np.concatenate([[0], np.cumsum(gaps > closeness)])
    around = every[order[0]] + first.length - every[order[-1]]
    if first.loop and around <= closeness:
        number[number == number[-1]] = 0
    group = np.empty(len(every), dtype=np.intp)
    group[order] = number
    return np.split(group, np.cumsum([len(s) for s in along])[:-1])


def _forward(s: Array, first: Border) -> bool:
    """Whether chords from s[0] to s[1] run towards larger lengths along the first edge."""
    step = s[1] - s[0]
    if first.loop:
        step = step - first.length * np.round(step / first.length)
    return bool(step.sum() > 0.0)


def _divide(
    item: _Work, side: Side, rim: _Rim, begins: Index, ends: Index, where: Array, forward: bool
) -> list[tuple[int, Key]]:
    """Plan the new points of a sheet along an edge; the station of each, and its key."""
    count, unit = len(where), 1 if forward else -1
    between = np.maximum((unit * (ends - begins)) % count - 1, 0)
    chord = np.repeat(np.arange(len(between)), between)
    if not len(chord):
        return []
    place = np.arange(len(chord)) - np.repeat(np.cumsum(between) - between, between)
    station = (begins[chord] + unit * (1 + place)) % count
    reach = 0.5 * np.abs(rim.step[chord])
    x = closest(side.border, where[station], rim.x[chord] + 0.5 * rim.step[chord], reach)[0]
    points, normals, flats = _on_edge(side.border, x, item.flat)
    start = len(item.mesh.vertices) + item.added
    weld = int(item.mesh.weld.max()) + 1 + item.added
    for k, c in enumerate(chord.tolist()):
        corners = item.put.setdefault(int(rim.row[c]), [])
        if not corners or corners[-1][0] != int(rim.corner[c]):
            corners.append((int(rim.corner[c]), []))
        corners[-1][1].append(start + k)
    item.points.append(points)
    item.normals.append(normals)
    item.flats.append(flats)
    item.added += len(chord)
    return [(number, (side.sheet, weld + k)) for k, number in enumerate(station.tolist())]


def _on_edge(edge: Border, x: Array, flat: Flat) -> tuple[Array, Array, Array]:
    """Points of an edge at x (n,), their normals and their places in the pattern."""
    number, t, v = edge.places(x)
    normals, flats = np.empty((len(x), 3)), np.empty((len(x), 2))
    for k in np.unique(number).astype(int).tolist():
        here = number == k
        patch = edge.chain.patches[k]
        low, high = patch.domain
        inside = np.clip(t[here], np.nextafter(low, high), np.nextafter(high, low))
        normals[here], flats[here] = patch.frame(inside).n, flat(k, t[here], v[here])
    return edge(x)[0], normals, flats


def _divided(item: _Work) -> Mesh:
    """The mesh with its new points."""
    mesh = item.mesh
    if not item.added:
        return mesh
    fresh = np.arange(item.added) + int(mesh.weld.max()) + 1
    triangles = np.delete(mesh.triangles, sorted(item.put), axis=0)
    fans = [
        fan
        for row in sorted(item.put)
        for fan in _fans(mesh.triangles[row].tolist(), item.put[row])
    ]
    return replace(
        mesh,
        vertices=np.concatenate([mesh.vertices, *item.points]),
        normals=np.concatenate([mesh.normals, *item.normals]),
        flat=np.concatenate([mesh.flat, *item.flats]),
        triangles=np.concatenate([triangles, np.array(fans, dtype=np.int32)]),
        weld=np.concatenate([mesh.weld, fresh]).astype(np.int32),
    )


def _fans(triangle: list[int], put: list[tuple[int, list[int]]]) -> list[tuple[int, int, int]]:
    """A triangle divided at points on its sides: each side's from the corner opposite to it."""
    a, b, c = triangle
    made = [(a, b, c)]
    for corner, points in put:
        begin, end = triangle[corner], triangle[(corner + 1) % 3]
        for k, (p, q, r) in enumerate(made):
            turns = ((p, q, r), (q, r, p), (r, p, q))
            top = next((z for x, y, z in turns if (x, y) == (begin, end)), None)
            if top is not None:
                run = [begin, *points, end]
                made[k : k + 1] = [(x, y, top) for x, y in pairwise(run)]
                break
    return made


def _table(mesh: Mesh) -> Array:
    """The distinct points of a mesh by their numbers, (n, 3)."""
    table = np.empty((int(mesh.weld.max()) + 1, 3))
    table[mesh.weld[::-1]] = mesh.vertices[::-1]
    return table


def _moved(mesh: Mesh, roots: dict[int, Key], places: dict[Key, Array]) -> Mesh:
    """The mesh with tied points where their roots are; those with one root become one."""
    target = _table(mesh)
    number = np.arange(len(target))
    firsts: dict[Key, int] = {}
    for point in sorted(roots):
        target[point] = places[roots[point]]
        number[point] = firsts.setdefault(roots[point], point)
    vertices = target[mesh.weld]
    changed = np.zeros(len(target), dtype=bool)
    changed[list(roots)] = True
    vertices = np.where(changed[mesh.weld, None], vertices, mesh.vertices)
    moved = float(np.linalg.norm(vertices - mesh.vertices, axis=1).max())
    _, weld = np.unique(number[mesh.weld], return_inverse=True)
    return replace(
        mesh, vertices=vertices, weld=weld.astype(np.int32), deviation=mesh.deviation + moved
    )
