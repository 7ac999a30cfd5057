"""Meshes made by hand from the closed form of a right circular cone, for the mesh exporters.

A frustum from radius 100 at z = 0 to radius 60 at z = 80, opened by 100 degrees of its turn.
It develops to an annulus sector; front (+n) is the inside. Nothing here calls devcad's geometry.
"""

from __future__ import annotations

import numpy as np

from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import Chain
from devcad.mesh.mesh import Mesh
from devcad.part import Panel, Part

LOWER, UPPER, HEIGHT = 100.0, 60.0, 80.0
SWEEP = np.radians(260.0)
SLANT = float(np.hypot(LOWER - UPPER, HEIGHT))
TO_APEX = SLANT * LOWER / (LOWER - UPPER)
SIN_HALF_ANGLE = (LOWER - UPPER) / SLANT
AREA = 0.5 * SWEEP * (LOWER + UPPER) * SLANT


def grid(rulings, rows):
    """t and v of a grid, each (rulings, rows)."""
    return np.meshgrid(
        np.linspace(0.0, SWEEP, rulings), np.linspace(0.0, SLANT, rows), indexing="ij"
    )


def surface(t, v):
    """Points, front normals and pattern places of the cone."""
    radius = LOWER - v * SIN_HALF_ANGLE
    cos_half = HEIGHT / SLANT
    points = np.stack([radius * np.cos(t), radius * np.sin(t), v * cos_half], axis=-1)
    normals = np.stack(
        [-cos_half * np.cos(t), -cos_half * np.sin(t), np.full_like(t, -SIN_HALF_ANGLE)], axis=-1
    )
    angle, rest = t * SIN_HALF_ANGLE, TO_APEX - v
    flat = np.stack([TO_APEX - rest * np.cos(angle), rest * np.sin(angle)], axis=-1)
    return points.reshape(-1, 3), normals.reshape(-1, 3), flat.reshape(-1, 2)


def quads(first, second):
    """Triangles between two rows of indices, counterclockwise from first to second."""
    a, b, c, d = first[:-1], first[1:], second[1:], second[:-1]
    return np.stack([a, d, c, a, c, b], axis=-1).reshape(-1, 3)


def front(rulings, rows):
    """Triangles of the grid facing +n = e x P_t."""
    index = np.arange(rulings * rows).reshape(rulings, rows)
    return np.concatenate([quads(index[:, k], index[:, k + 1]) for k in range(rows - 1)])


def sagitta(rulings):
    return LOWER * (1.0 - np.cos(0.5 * SWEEP / (rulings - 1)))


def cone_sheet(rulings=41, rows=3):
    """The middle surface as an open sheet."""
    points, normals, flat = surface(*grid(rulings, rows))
    return Mesh(
        points,
        normals,
        flat,
        front(rulings, rows).astype(np.int32),
        np.arange(len(points), dtype=np.int32),
        False,
        sagitta(rulings),
    )


def cone_shell(rulings=41, rows=3, thickness=2.0):
    """The sheet with thickness: two skins and four walls, vertices repeated along the rims."""
    points, normals, flat = surface(*grid(rulings, rows))
    n = len(points)
    skins = np.concatenate([points + 0.5 * thickness * normals, points - 0.5 * thickness * normals])
    faces = front(rulings, rows)
    index = np.arange(n).reshape(rulings, rows)
    rim = np.concatenate([index[:, 0], index[-1, 1:], index[-2::-1, -1], index[0, -2::-1]])
    # the rim runs base, end, top, start: clockwise about +n, so that walls face outwards
    walls = quads(rim + n, rim)
    used = [skins, skins[walls].reshape(-1, 3)]
    side = np.cross(
        skins[walls[:, 1]] - skins[walls[:, 0]], skins[walls[:, 2]] - skins[walls[:, 0]]
    )
    side /= np.linalg.norm(side, axis=1)[:, None]
    triangles = [faces, faces[:, ::-1] + n, np.arange(walls.size).reshape(-1, 3) + 2 * n]
    return Mesh(
        np.concatenate(used),
        np.concatenate([normals, -normals, np.repeat(side, 3, axis=0)]),
        np.concatenate([flat, flat, flat[walls.ravel() % n]]),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate([np.arange(2 * n), walls.ravel()]).astype(np.int32),
        True,
        sagitta(rulings),
    )


def moved(mesh, shift):
    """The mesh translated in space."""
    return Mesh(
        mesh.vertices + np.asarray(shift, dtype=float),
        mesh.normals,
        mesh.flat,
        mesh.triangles,
        mesh.weld,
        mesh.watertight,
        mesh.deviation,
    )


def pattern(mesh):
    """A pattern with the cone's exact area and the box of the mesh's own places."""
    low, high = mesh.flat.min(axis=0), mesh.flat.max(axis=0)
    return Pattern((), (), AREA, (low[0], low[1], high[0], high[1]))


def part(*meshes, name="cone", thickness=0.0, **more):
    """A part of one panel for each mesh: cone, or cone-1, cone-2, ..."""
    names = [name] if len(meshes) == 1 else [f"{name}-{k + 1}" for k in range(len(meshes))]
    panels = tuple(
        Panel(own, "frustum", Chain((), ()), (), thickness, (), mesh, pattern(mesh))
        for own, mesh in zip(names, meshes, strict=True)
    )
    return Part(name, panels, thickness, 0.05, (), **more)


def volume(corners):
    """The volume of closed facets (m, 3, 3) by the divergence theorem."""
    return float(np.linalg.det(corners.astype(float)).sum() / 6.0)
