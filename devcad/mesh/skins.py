"""The skins of a sheet with cuts: strips between rulings, polygons where a cut crosses them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array
from devcad.mesh.nodes import Nodes
from devcad.mesh.rings import Ring, Rings
from devcad.mesh.strips import Faces, divided
from devcad.mesh.triangles import areas, delaunay, triangulated

Numbers = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Skin:
    """One patch at one layer: its faces, and those of their triangles that are no halves of
    strips. Chords that cross each other fold triangles over: the nodes of these, and their cells.
    """

    faces: Faces
    cut: Numbers
    folded: Numbers
    cells: Numbers


def skin(nodes: Nodes, rings: Rings, layer: int, least: float, *, front: bool) -> Skin:
    """The surface of one patch at a layer, facing +n or -n.

    ``least`` is the width in mm from which a triangle that is turned over counts.
    """
    n = len(nodes.stations.t)
    near = np.array(rings.plain, dtype=np.intp)
    strip = nodes.stations.skin(layer, front=front)
    plain = divided(replace(strip, near=near, far=near + 1))
    cut, folded, cells = _polygons(nodes, rings.polygons, layer, least)
    if not front:  # the strip's rows begin with the other rail, and it is seen from behind
        plain, cut = np.where(plain < n, plain + n, plain - n), cut[:, ::-1]
    faces = Faces(
        nodes.points[layer],
        nodes.normals if front else -nodes.normals,
        nodes.flats,
        nodes.ids[layer].astype(np.int32),
        np.concatenate([plain, cut]),
    )
    return Skin(faces, cut, folded, cells)


def _polygons(
    nodes: Nodes, polygons: list[tuple[int, list[Ring]]], layer: int, least: float
) -> tuple[Numbers, Numbers, Numbers]:
    """The triangles of the polygons, each in the plane of its strip, counterclockwise in front;
    the nodes of folded ones, and their cells."""
    if not polygons:
        none = np.zeros(0, dtype=np.intp)
        return np.zeros((0, 3), dtype=np.intp), none, none
    t = nodes.stations.t
    cell = np.array([index for index, _ in polygons])
    frame = nodes.stations.patch.frame(0.5 * (t[cell] + t[cell + 1]))
    corners: list[int] = []
    places, triangles, owners = [], [], []
    for k, (index, rings) in enumerate(polygons):
        flat = [node for ring in rings for node in ring]
        away = nodes.points[layer, flat] - nodes.points[layer, flat[0]]
        plane = np.stack([away @ frame.e[k], away @ frame.m[k]], axis=1)
        ends = np.cumsum([len(ring) for ring in rings])[:-1]
        triangles.append(triangulated(np.split(plane, ends)) + len(corners))
        places.append(plane)
        owners.append(np.full(len(flat), index))
        corners += flat
    points = np.concatenate(places)
    found = delaunay(points, np.concatenate(triangles))
    folded = found[_folded(points, found, least)]
    named = np.array(corners, dtype=np.intp)
    return named[found], named[folded].ravel(), np.concatenate(owners)[folded[:, 0]]


def _folded(points: Array, triangles: Numbers, least: float) -> Numbers:
    """The rows of triangles that are turned over and wider than ``least``."""
    corner = points[triangles]
    longest = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).max(axis=1)
    return np.flatnonzero(2.0 * areas(points, triangles) < -least * longest)
