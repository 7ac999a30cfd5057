"""The mesh of a sheet with holes and notches: polygons between rulings, walls along the cuts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.geometry.cells import Cell, Run, cells
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array
from devcad.mesh.contours import Contours, Lines, sample
from devcad.mesh.distance import skin_deviation
from devcad.mesh.mesh import Mesh
from devcad.mesh.nodes import Nodes, meetings, nodes_of, rows_of, welded
from devcad.mesh.rings import Rings, rings_of
from devcad.mesh.skins import Skin, skin
from devcad.mesh.stations import Flat, Stations, share
from devcad.mesh.strips import Faces, Strip, faces, joined

Numbers = NDArray[np.intp]
Rulings = tuple[Array, ...]
NEAR = 4.0 * 2.0**-23
"""Points nearer than this share of the largest coordinate are one: four steps of float32."""
MANY, FEW = 1000, 400
"""A strip of more cuts than MANY is divided by rulings of its own until FEW are left in each:
the time for one polygon grows with the square of its holes."""
ATTEMPTS, FINER = 4, 0.25
"""Where chords cross each other they are laid anew so often, this much nearer to their cuts."""


@dataclass(frozen=True, slots=True)
class _Sheet:
    """The points of all cuts and what they leave of each patch: ``skins[patch][layer]``."""

    rulings: Rulings
    contours: Contours
    points: Array
    ids: NDArray[np.int64]
    nodes: list[Nodes]
    rings: list[Rings]
    skins: list[list[Skin]]

    @property
    def folded(self) -> bool:
        """Whether chords cross each other."""
        return any(len(each.cells) for pair in self.skins for each in pair)


def perforated(
    chain: Chain,
    rulings: Rulings,
    layers: tuple[float, ...],
    flat: Flat,
    deviation: float,
    cuts: Sequence[Cut],
    tolerance: float,
) -> Mesh:
    """The mesh of a chain on its certified rulings without what is cut out of it.

    As :func:`devcad.mesh.build.build_mesh`; the skins are triangulated per strip in the plane of
    the strip, the walls of a cut join its points on both skins. Where a web is so thin that the
    chords of its two sides would cross, chords and rulings are laid closer.
    """
    rulings = _denser(rulings, cuts)
    lines = Lines(cuts, chain, layers)
    chords = np.full(len(lines.cut), tolerance)
    sheet = _sheet(lines, rulings, cuts, flat, chords)
    for _ in range(ATTEMPTS):
        if not sheet.folded:
            break
        rulings, chords = _closer(sheet, chords)
        sheet = _sheet(lines, rulings, cuts, flat, chords)
    parts = [pair[-1].faces for pair in sheet.skins]
    if len(layers) > 1:
        parts += [pair[0].faces for pair in sheet.skins]
        parts += _rims(sheet) + _ends(sheet, chain)
        parts.append(faces(_walls(sheet, lines, flat)))
    measured = [
        skin_deviation(own.stations.patch, own.t, own.v, own.points[k], each.cut, distance)
        for own, pair in zip(sheet.nodes, sheet.skins, strict=True)
        for k, (each, distance) in enumerate(zip(pair, layers, strict=True))
    ]
    worst = max(deviation, sheet.contours.deviation, *measured)
    return _whole(joined(parts, watertight=len(layers) > 1, deviation=worst))


def _denser(rulings: Rulings, cuts: Sequence[Cut]) -> Rulings:
    """The rulings, and more of them in strips of very many cuts."""
    if len(cuts) <= MANY:
        return rulings
    out = []
    for number, t in enumerate(rulings):
        tracks = [cut.tracks[0] for cut in cuts if cut.tracks[0].patch == number]
        middles = [0.5 * float(track.series(np.array(track.u))[:, 0].sum()) for track in tracks]
        count = np.histogram(middles, t)[0]
        parts = np.where(count > MANY, -(-count // FEW), 1)
        steps = zip(t[:-1], t[1:], parts, strict=True)
        inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in steps]
        out.append(np.concatenate([*inner, t[-1:]]))
    return tuple(out)


def _sheet(
    lines: Lines, rulings: Rulings, cuts: Sequence[Cut], flat: Flat, chords: Array
) -> _Sheet:
    """The skins between these rulings, the chords of line k within chords[k] of their cut."""
    chain, layers = lines.chain, lines.layers
    stations = [
        Stations(k, patch, t, layers, flat, chain)
        for k, (patch, t) in enumerate(zip(chain.patches, rulings, strict=True))
    ]
    share(stations, chain)
    least = NEAR * max(float(np.abs(rails).max()) for s in stations for rails in s.points[-1])
    parts = [cells(cuts, chain, k, t) for k, t in enumerate(rulings)]
    contours = sample(lines, _passed(lines, cuts, parts), chords, least)
    rows = rows_of(contours, lines.numbers(cuts))
    met = meetings(parts, rows)
    points, ids = welded(contours, stations, met, least)
    nodes = nodes_of(chain, stations, contours, points, ids, met, flat, least)
    rings = [rings_of(found, own, rows) for found, own in zip(parts, nodes, strict=True)]
    last = len(layers) - 1
    skins = [
        [skin(own, left, k, least, front=k == last) for k in range(len(layers))]
        for own, left in zip(nodes, rings, strict=True)
    ]
    return _Sheet(rulings, contours, points, ids, nodes, rings, skins)


def _passed(lines: Lines, cuts: Sequence[Cut], parts: Sequence[Sequence[Cell]]) -> list[Array]:
    """Per line the places that must be points: its ends, and where its pieces end."""
    numbers = lines.numbers(cuts)
    found = [set(ends) for ends in lines.u.tolist()]
    for cell in (cell for part in parts for cell in part):
        runs = [item for loop in cell.loops for item in loop if isinstance(item, Run)]
        for piece in (piece for run in (*runs, *cell.holes) for piece in run.pieces):
            found[numbers[piece.cut, piece.track]].update(piece.u)
    return [np.array(sorted(us)) for us in found]


def _closer(sheet: _Sheet, chords: Array) -> tuple[Rulings, Array]:
    """The rulings and chords of a sheet closer where triangles are folded over."""
    rulings, chords = list(sheet.rulings), chords.copy()
    for k, (nodes, pair) in enumerate(zip(sheet.nodes, sheet.skins, strict=True)):
        folded = np.concatenate([each.folded for each in pair])
        rows = np.flatnonzero(np.isin(nodes.node, folded))
        lines = np.flatnonzero(np.bincount(sheet.contours.line[rows], minlength=len(chords)))
        chords[lines] *= FINER
        split = np.unique(np.concatenate([each.cells for each in pair]))
        t = rulings[k]
        rulings[k] = np.sort(np.concatenate([t, 0.5 * (t[split] + t[split + 1])]))
    return tuple(rulings), chords


def _rims(sheet: _Sheet) -> list[Faces]:
    """The walls at both ends of the extent, facing out."""
    out = []
    for own, left in zip(sheet.nodes, sheet.rings, strict=True):
        for end, side in ((0, 3), (1, 1)):
            if own.stations.collapsed(end):
                continue
            pairs = [chain[::-1] if side == 3 else chain for _, chain in left.edges[side]]
            layers = (1, 0) if end else (0, 1)
            normals = own.stations.rim_normals(end, own.t)
            out.append(faces(_border(own, pairs, normals, layers)))
    return out


def _ends(sheet: _Sheet, chain: Chain) -> list[Faces]:
    """The walls on the first and the last ruling of an open chain."""
    if chain.closed:
        return []
    out = []
    for row, side, layers in ((0, 0, (1, 0)), (-1, 2, (0, 1))):
        own, left = sheet.nodes[row], sheet.rings[row]
        cell = 0 if row == 0 else len(own.stations.t) - 2
        chains = [c[::-1] if side == 2 else c for index, c in left.edges[side] if index == cell]
        pairs = [list(pair) for c in chains for pair in pairwise(c)]
        m = own.stations.frame.m[row]
        normals = np.broadcast_to(m if row else -m, own.normals.shape)
        out.append(faces(_border(own, pairs, normals, layers)))
    return out


def _border(nodes: Nodes, pairs: list[list[int]], normals: Array, layers: tuple[int, int]) -> Strip:
    """The wall between two layers over stretches of a border, each from node to node."""
    used, numbered = np.unique(np.array(pairs, dtype=np.intp).reshape(-1, 2), return_inverse=True)
    near, far = numbered.reshape(-1, 2).T
    left, right = layers
    return Strip(
        nodes.points[left][used],
        nodes.points[right][used],
        normals[used],
        normals[used],
        nodes.flats[used],
        nodes.flats[used],
        nodes.ids[left][used].astype(np.int32),
        nodes.ids[right][used].astype(np.int32),
        near,
        far,
    )


def _walls(sheet: _Sheet, lines: Lines, flat: Flat) -> Strip:
    """The walls of all cuts, facing away from the sheet on their left."""
    contours, (back, front) = sheet.contours, sheet.points
    near = np.flatnonzero(contours.line[1:] == contours.line[:-1])
    normals, flats = np.empty_like(front), np.empty((len(front), 2))
    dt, dv = _headings(lines, contours)
    for k, patch in enumerate(lines.chain.patches):
        here = np.flatnonzero(contours.patch == k)
        if not len(here):
            continue
        t, v = contours.t[here], contours.v[here]
        frame = patch.frame(t)
        along = dv[here] + frame.p * dt[here]
        across = (frame.q + v * frame.a) * dt[here]
        size = np.hypot(along, across)
        normals[here] = (across / size)[:, None] * frame.e - (along / size)[:, None] * frame.m
        flats[here] = flat(k, t, v)
    id_back, id_front = sheet.ids.astype(np.int32)
    return Strip(front, back, normals, normals, flats, flats, id_front, id_back, near, near + 1)


def _headings(lines: Lines, contours: Contours) -> tuple[Array, Array]:
    """The directions (dt, dv) of the cuts in their rows; a chord's where a cut stands still."""
    dt, dv = lines.slopes(contours.line, contours.u)
    still = np.flatnonzero((dt == 0.0) & (dv == 0.0))
    after = np.minimum(still + 1, len(dt) - 1)
    ahead = np.where(contours.line[after] == contours.line[still], after, still)
    behind = np.where(ahead > still, still, still - 1)
    dt[still] = contours.t[ahead] - contours.t[behind]
    dv[still] = contours.v[ahead] - contours.v[behind]
    return dt, dv


def _whole(mesh: Mesh) -> Mesh:
    """The mesh without the points that no triangle uses.

    Raises:
        GeometryError: an edge has not exactly one partner, of a sheet more than one; or all of the
            sheet is so narrow that its points are one.
    """
    if not len(mesh.triangles):
        raise GeometryError(
            "the sheet is too narrow for its place in space: its points cannot be told apart",
            remedy="place it nearer to the origin, or make it larger",
        )
    used, numbered = np.unique(mesh.triangles, return_inverse=True)
    _, weld = np.unique(mesh.weld[used], return_inverse=True)
    triangles = numbered.reshape(-1, 3).astype(np.int32)
    corners = weld[triangles].astype(np.int64)
    ends, count = np.roll(corners, -1, axis=1), int(weld.max()) + 1
    edges = np.sort((corners * count + ends).ravel())
    lone = int(np.count_nonzero(edges[1:] == edges[:-1]))
    if mesh.watertight:
        lone += int(np.count_nonzero(edges != np.sort((ends * count + corners).ravel())))
    if lone:
        raise GeometryError(
            f"cutout-crosses-edge: {lone} edges of the mesh have not exactly one partner: cutouts "
            "touch one another, or an edge",
            value=float(lone),
            limit=0.0,
            remedy="move them apart",
        )
    return Mesh(
        mesh.vertices[used],
        mesh.normals[used],
        mesh.flat[used],
        triangles,
        weld.astype(np.int32),
        mesh.watertight,
        mesh.deviation,
    )
