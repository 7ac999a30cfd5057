"""A panel as a strip of rigid triangles, hinged along its rulings: it folds and keeps its lengths.

The triangles between neighbouring rulings turn about the edges they share: the rulings, and the
diagonals between them. With every angle multiplied by 1 - f the strip is the part at f = 0 and
plane at f = 1, and no length within a triangle changes on the way: an isometry at every f.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.chain import Chain
from devcad.geometry.layers import layer_ends
from devcad.geometry.taylor import Array, rows_cross, rows_dot
from devcad.mesh.stations import COLLAPSED, Flat
from devcad.mesh.strips import Strip, divided

Numbers = NDArray[np.int32]
PLANE = 1e-9
"""Radians: a hinge that bends by less is none, for it moves no point by 1e-9 of the part."""


@dataclass(frozen=True, slots=True)
class Hinged:
    """The strip of one panel on its r rulings; lengths in mm.

    ``space`` (2, r, 3) are the rulings' ends at v_from and v_to as built, ``pattern`` (2, r, 2)
    their places in the pattern, and ``flat`` (2, r, 2) where they lie when the strip is plane, as
    near to the pattern as a rigid motion brings them: chords are shorter than arcs, and a neutral
    fibre makes the pattern another than the middle's. ``normal`` (2, r, 3) is the surface's before
    and after a ruling. ``c`` (2, r - 1) is c at the first and last ruling of every cell, the strip
    between two rulings, and ``height`` (2, 2, r - 1) q + v a there at v_from and v_to: the
    curvature is c / height.

    ``triangles`` (m, 3) are rows of ``space`` as (2 r, 3), counterclockwise in front; ``cell``
    (m,) rises. ``body`` (m,) numbers what is rigid. Hinge k from ``hinges[k, 0]`` to
    ``hinges[k, 1]`` in the flat strip joins body k to body k + 1, which ``angles[k]`` turns about
    it, right-handed. ``built`` (3, 4) carries the flat strip onto the body ``anchor``, one in the
    middle, as built; ``pivot`` (2,) is a point of that body. ``creased`` (r,) tells the rulings at
    which two faces meet at an angle.
    """

    space: Array
    pattern: Array
    flat: Array
    normal: Array
    c: Array
    height: Array
    creased: NDArray[np.bool_]
    triangles: Numbers
    cell: Numbers
    body: Numbers
    hinges: Array
    angles: Array
    anchor: int
    built: Array
    pivot: Array

    @property
    def rulings(self) -> int:
        """How many rulings there are."""
        return int(self.space.shape[1])

    def beside(self) -> Numbers:
        """The bodies (2, r) before and after every ruling; at both ends the one there is."""
        cells = np.arange(self.rulings - 1)
        first = self.body[np.searchsorted(self.cell, cells).clip(max=len(self.cell) - 1)]
        last = self.body[(np.searchsorted(self.cell, cells, side="right") - 1).clip(min=0)]
        return np.stack([np.append(first[:1], last), np.append(first, last[-1:])])


def hinged(chain: Chain, rulings: tuple[Array, ...], places: Flat) -> Hinged:
    """The strip of a chain's middle surface on its certified rulings.

    Args:
        rulings: per patch, the increasing parameters (n_k,) of its rulings.
        places: where a surface point lies in the pattern.
    """
    rows = _rows(chain, rulings, places)
    points = rows.space.reshape(-1, 3)
    one = _ones(rows.space)
    triangles, cell = _triangles(rows, one)
    corner = points[triangles]  # (m, 3, 3)
    normal = rows_cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shared = _shared(triangles)
    ends = np.take_along_axis(triangles[:-1], shared[..., 0], axis=1)  # (m - 1, 2)
    along = points[ends[:, 1]] - points[ends[:, 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    turned = rows_dot(rows_cross(normal[:-1], normal[1:]), along)
    angles = np.arctan2(turned, rows_dot(normal[:-1], normal[1:]))
    flat = _laid(corner, normal, triangles, shared, rows.pattern.reshape(-1, 2))[one]
    bends = np.abs(angles) > PLANE
    body = np.append(0, np.cumsum(bends)).astype(np.int32)
    middle = len(triangles) // 2
    built, pivot = _carried(flat[triangles[middle]], corner[middle], normal[middle])
    return Hinged(
        rows.space,
        rows.pattern,
        flat.reshape(2, -1, 2),
        rows.normal,
        rows.c,
        rows.height,
        rows.creased,
        triangles,
        cell,
        body,
        flat[ends[bends]],
        angles[bends],
        int(body[middle]),
        built,
        pivot,
    )


def motions(strip: Hinged, f: float, shift: tuple[float, float] = (0.0, 0.0)) -> Array:
    """The motions (b, 3, 4) that carry the bodies from the flat strip to their places at f.

    0 is the part as built, 1 the strip in the plane z = 0, moved by ``shift`` from the pattern's
    place; between them the anchor turns evenly from one to the other and its pivot goes straight.
    """
    turn = rotation(turning(strip.built[:, :3]) * (1.0 - f))
    pivot = np.append(strip.pivot, 0.0)
    start = strip.built[:, :3] @ pivot + strip.built[:, 3]
    place = (1.0 - f) * start + f * (pivot + np.append(shift, 0.0))
    out = np.empty((len(strip.angles) + 1, 3, 4))
    out[strip.anchor] = np.column_stack([turn, place - turn @ pivot])
    along = np.diff(strip.hinges, axis=1)[:, 0]
    axes = np.zeros((len(along), 3))
    axes[:, :2] = along / np.linalg.norm(along, axis=1, keepdims=True)
    for k in [*range(strip.anchor, len(axes)), *range(strip.anchor - 1, -1, -1)]:
        source, target, sign = (k, k + 1, 1.0) if k >= strip.anchor else (k + 1, k, -1.0)
        turn = rotation(axes[k] * (sign * (1.0 - f) * strip.angles[k]))
        point = np.append(strip.hinges[k, 0], 0.0)
        before = out[source]
        out[target, :, :3] = before[:, :3] @ turn
        out[target, :, 3] = before[:, 3] + before[:, :3] @ (point - turn @ point)
    return out


def moved(motion: Array, flat: Array) -> Array:
    """Points (n, 3) in space of points (n, 2) of the flat strip, each with its motion (n, 3, 4)."""
    return np.asarray(np.einsum("nij,nj->ni", motion[:, :, :2], flat) + motion[:, :, 3])


def rotation(turn: Array) -> Array:
    """The rotation (3, 3) about a vector by its length in radians, right-handed."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross
    )


def turning(matrix: Array) -> Array:
    """The vector about which, and by whose length, a rotation turns; at most pi long.

    Source: Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978) 223.
    """
    square = np.append(np.diag(matrix), np.trace(matrix))
    k = int(np.argmax(square))
    odd = matrix - matrix.T
    skew = np.array([odd[2, 1], odd[0, 2], odd[1, 0]])
    if k == 3:
        w, v = 1.0 + square[3], skew
    else:
        v = matrix[k] + matrix[:, k]
        v[k] = 1.0 + 2.0 * square[k] - square[3]
        w = skew[k]
    if w < 0.0:
        w, v = -w, -v
    length = float(np.linalg.norm(v))
    return np.asarray(v * (2.0 * np.arctan2(length, w) / length)) if length else np.zeros(3)


# --- from rulings to triangles -------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Rows:
    """What is known at the rulings, as in :class:`Hinged`."""

    space: Array
    pattern: Array
    normal: Array
    c: Array
    height: Array
    creased: NDArray[np.bool_]


def _rows(chain: Chain, rulings: tuple[Array, ...], places: Flat) -> _Rows:
    """The rows of all patches; neighbours share the ruling at their joint."""
    space, pattern, before, after, c, height = ([] for _ in range(6))
    for number, (patch, t) in enumerate(zip(chain.patches, rulings, strict=True)):
        inside = t.copy()
        inside[0], inside[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
        frame = patch.frame(inside)
        late = 1 if number else 0
        rails = np.stack(layer_ends(chain, number, frame, 0.0))
        extent = np.stack([frame.v_from, frame.v_to])
        space.append(rails[:, late:])
        pattern.append(np.stack([places(number, inside, v) for v in extent])[:, late:])
        before.append(frame.n[late:])
        after.append(frame.n[:-1])
        c.append(np.stack([frame.c[:-1], frame.c[1:]]))
        heights = frame.q + extent * frame.a
        height.append(np.stack([heights[:, :-1], heights[:, 1:]]))
        last = frame.n[-1:]
    joints = np.cumsum([len(t) - 1 for t in rulings[:-1]], dtype=int)
    creased = np.zeros(sum(len(t) - 1 for t in rulings) + 1, dtype=bool)
    creased[joints] = [not joint.smooth for joint in chain.joints]
    return _Rows(
        np.concatenate(space, axis=1),
        np.concatenate(pattern, axis=1),
        np.stack([np.concatenate(before), np.concatenate([*after, last])]),
        np.concatenate(c, axis=1),
        np.concatenate(height, axis=2),
        creased,
    )


def _ones(space: Array) -> NDArray[np.intp]:
    """For each row of ``space`` as (2 r, 3) the first that is the same point: a rail that stands
    still, or a ruling without length at an end."""
    n = space.shape[1]
    least = COLLAPSED * float(np.linalg.norm(np.ptp(space.reshape(-1, 3), axis=0)))
    steps = np.linalg.norm(np.diff(space, axis=1), axis=2) > least
    first = np.zeros((2, n), dtype=np.intp)
    first[:, 1:] = np.maximum.accumulate(np.where(steps, np.arange(1, n), 0), axis=1)
    first[1] += n
    for row in (0, n - 1):
        if np.linalg.norm(space[1, row] - space[0, row]) <= least:
            first[1][first[1] == first[1, row]] = first[0, row]
    return first.ravel()


def _triangles(rows: _Rows, one: NDArray[np.intp]) -> tuple[Numbers, Numbers]:
    """Two triangles of every cell, without those that are none, and their cells."""
    number = one.astype(np.int32).reshape(2, -1)
    (low, high), normal = rows.space, rows.normal[1]
    strip = Strip(low, high, normal, normal, *rows.pattern, *number)
    triangles = one[divided(strip)]
    a, b, c = triangles.T
    kept = (a != b) & (b != c) & (c != a)
    cell = np.arange(len(triangles)) // 2
    return triangles[kept].astype(np.int32), cell[kept].astype(np.int32)


def _shared(triangles: Numbers) -> NDArray[np.intp]:
    """Which corners each triangle has in common with the next, (m - 1, 2, 2): of the two common
    points, their places in the one and in the other."""
    same = triangles[:-1, :, None] == triangles[1:, None, :]
    return np.argwhere(same)[:, 1:].reshape(-1, 2, 2)


def _laid(
    corner: Array, normal: Array, triangles: Numbers, shared: NDArray[np.intp], pattern: Array
) -> Array:
    """The points (2 r, 2) of the strip laid flat, brought onto the pattern (2 r, 2)."""
    x = corner[:, 1] - corner[:, 0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = rows_cross(normal, x)
    away = corner - corner[:, :1]
    own = np.einsum("mkj,mj->mk", away, x) + 1j * np.einsum("mkj,mj->mk", away, y)
    here = np.take_along_axis(own[:-1], shared[..., 0], axis=1)
    there = np.take_along_axis(own[1:], shared[..., 1], axis=1)
    step = np.angle((here[:, 1] - here[:, 0]) * np.conj(there[:, 1] - there[:, 0]))
    turn = np.exp(1j * np.append(0.0, np.cumsum(step)))
    origin = np.append(0.0, np.cumsum(turn[:-1] * here[:, 0] - turn[1:] * there[:, 0]))
    plane = np.zeros(len(pattern), dtype=complex)
    plane[triangles[::-1]] = (turn[:, None] * own + origin[:, None])[::-1]
    used = np.unique(triangles)
    target = pattern[:, 0] + 1j * pattern[:, 1]
    middle, aim = plane[used].mean(), target[used].mean()
    turned = np.exp(1j * np.angle(np.vdot(plane[used] - middle, target[used] - aim)))
    placed = aim + turned * (plane - middle)
    return np.stack([placed.real, placed.imag], axis=1)


def _carried(flat: Array, space: Array, normal: Array) -> tuple[Array, Array]:
    """The motion (3, 4) of the plane that carries a triangle of it (3, 2) to one in space (3, 3)
    with that normal, and the triangle's middle in the plane."""
    edges = np.roll(space, -1, axis=0) - space
    k = int(np.argmax((edges**2).sum(axis=1)))
    x = edges[k] / np.linalg.norm(edges[k])
    u = np.roll(flat, -1, axis=0)[k] - flat[k]
    u = u / np.linalg.norm(u)
    y = np.cross(normal, x)
    turn = np.stack([x * u[0] - y * u[1], x * u[1] + y * u[0], normal], axis=1)
    pivot = flat.mean(axis=0)
    place = space.mean(axis=0) - turn @ np.append(pivot, 0.0)
    return np.column_stack([turn, place]), pivot
