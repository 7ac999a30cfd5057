"""Hinges: the angle between two triangles, its gradient and its second derivatives, exact.

A hinge is a row (p0, p1, p2, p3): the edge p0 p1 and the wings, p3 on the left and p2 on the
right of the edge as the front of the sheet shows it. The angle is 0 when flat and > 0 when both
wings rise towards the front: a valley, seen from there.
"""

from __future__ import annotations

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices


def angles(positions: Array, hinges: Indices) -> Array:
    """(h,) angles in (-pi, pi], radians: atan2((n1 x n2) . e / l, n1 . n2)."""
    edge, first, second, length = _normals(positions[hinges])
    sine = np.einsum("hi,hi->h", np.cross(first, second), edge) / length
    return np.asarray(np.arctan2(sine, np.einsum("hi,hi->h", first, second)))


def unwound(angle: Array, near: Array) -> Array:
    """(h,) the same angles, whole turns added so that they lie next to ``near``."""
    return np.asarray(angle - 2 * np.pi * np.round((angle - near) / (2 * np.pi)))


def gradients(positions: Array, hinges: Indices) -> Array:
    """(h, 4, 3) derivatives of the angles by the four points, 1/mm.

    Source:
        geometry.md, 8; Bridson, Marino, Fedkiw (2003); Tamstorf and Grinspun (2013).
    """
    points = positions[hinges]
    edge, first, second, length = _normals(points)
    third = -(length / np.einsum("hi,hi->h", first, first))[:, None] * first
    fourth = -(length / np.einsum("hi,hi->h", second, second))[:, None] * second
    a, b = (foot[:, None] for foot in _feet(points, edge, length))
    return np.stack(
        [-(1 - a) * third - (1 - b) * fourth, -a * third - b * fourth, third, fourth], axis=1
    )


def hessians(positions: Array, hinges: Indices) -> Array:
    """(h, 4, 3, 4, 3) second derivatives of the angles, 1/mm^2, symmetric.

    With G = l n / |n|^2, n linear in the points (dn = sum s_i x dp_i, s_i the side opposite):
    dG = G dl/l + l / |n|^2 (1 - 2 u u^T) dn. The rows of the edge's ends follow from those of the
    wings by the lever rule, whose feet a and b are differentiated too.
    """
    points = positions[hinges]
    p0, p1, p2, p3 = np.moveaxis(points, 1, 0)
    edge, first, second, length = _normals(points)
    rows = np.zeros((len(hinges), 4, 3, 4, 3))
    rows[:, 2, :, [0, 1, 2], :] = _wing(first, edge, length, (p2 - p1, p0 - p2, edge))
    rows[:, 3, :, [0, 1, 3], :] = _wing(second, edge, length, (p1 - p3, p3 - p0, -edge))
    gradient = gradients(positions, hinges)
    squared = (length**2)[:, None]
    for wing, foot in zip((2, 3), _feet(points, edge, length), strict=True):
        toward = points[:, wing] - p0
        at_wing = edge / squared
        at_one = (toward - 2 * foot[:, None] * edge) / squared
        lever = np.stack([-(at_wing + at_one), at_one, at_wing], axis=1)  # by p0, p1, the wing
        turn = np.einsum("hi,hkj->hikj", gradient[:, wing], lever)
        rows[:, 1] -= foot[:, None, None, None] * rows[:, wing]
        rows[:, 0] -= (1 - foot)[:, None, None, None] * rows[:, wing]
        for k, at in enumerate((0, 1, wing)):
            rows[:, 1, :, at, :] -= turn[:, :, k]
            rows[:, 0, :, at, :] += turn[:, :, k]
    return rows


def chord_angle(alpha: Array, flat_curvature: Array, chord: Array) -> Array:
    """The fold angle (radians) of a polygon's edge whose corners lie on a curved crease.

    On the crease the sheet folds by 2 alpha; the planes through one chord of it (``chord`` mm in
    the pattern) and the rulings at its ends meet at 2 a with
    tan a = tan alpha / cos(delta / 2), delta the turn of the folded crease along the chord. Exact
    on the folded circle, where they are faces of pyramids in the two cones; elsewhere of second
    order in the change of curvature. With it as rest angle the corners lie on the crease itself,
    and not only near it: a ring's radius comes out right to the fourth order and not the second.
    """
    turn = 2 * np.arcsin(np.abs(flat_curvature) * chord / 2) / np.cos(alpha)
    return np.asarray(2 * np.arctan2(np.sin(alpha), np.cos(alpha) * np.cos(turn / 2)))


def _normals(points: Array) -> tuple[Array, Array, Array, Array]:
    """Edge vector, twice the area vectors of both triangles, edge length."""
    p0, p1, p2, p3 = np.moveaxis(points, 1, 0)
    edge = p1 - p0
    return edge, np.cross(p0 - p2, p1 - p2), np.cross(p1 - p3, p0 - p3), _norm(edge)


def _norm(vectors: Array) -> Array:
    """Lengths, also of complex vectors (for derivatives by complex steps)."""
    return np.asarray(np.sqrt(np.einsum("hi,hi->h", vectors, vectors)))


def _feet(points: Array, edge: Array, length: Array) -> tuple[Array, Array]:
    """Where the wings' feet lie on the edge: 0 at p0, 1 at p1."""
    squared = length**2
    return (
        np.asarray(np.einsum("hi,hi->h", points[:, 2] - points[:, 0], edge) / squared),
        np.asarray(np.einsum("hi,hi->h", points[:, 3] - points[:, 0], edge) / squared),
    )


def _wing(normal: Array, edge: Array, length: Array, opposite: tuple[Array, ...]) -> Array:
    """(3, h, 3, 3) derivative of a wing's gradient -l n / |n|^2 by p0, p1 and the wing itself."""
    squared = np.einsum("hi,hi->h", normal, normal)
    scale = (length / squared)[:, None, None]
    unit = normal / np.sqrt(squared)[:, None]
    mirror = np.eye(3) - 2 * np.einsum("hi,hj->hij", unit, unit)
    stretch = np.einsum("hi,hj->hij", normal, edge) / (length * squared)[:, None, None]
    turned = [-scale * (mirror @ _skew(side)) for side in opposite]
    return np.stack([turned[0] + stretch, turned[1] - stretch, turned[2]])


def _skew(vectors: Array) -> Array:
    """(h, 3, 3) matrices S with S x = v x x."""
    skew = np.zeros((len(vectors), 3, 3))
    x, y, z = np.moveaxis(vectors, 1, 0)
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = -z, y, -x
    skew[:, 1, 0], skew[:, 2, 0], skew[:, 2, 1] = z, -y, x
    return skew
