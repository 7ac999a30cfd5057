"""Nets of quads that are plane but for rounding, made exactly plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from devcad.geometry.taylor import Array, rows_cross, rows_dot

ROUNDING = np.radians(0.0099)
"""The turn of the tangent plane along a side that counts as rounding of the points: just within
what the check on twist allows (0.01 deg), so that a quad is either made plane or fails it."""
PLANE = 1e-12
"""A defect, as a share of the quad's size, that leaves a plane to everything downstream."""
STEPS = 12
"""Newton steps at most: from so small a defect two or three do."""
EXACTLY = 1e-13
"""How closely the linear equations of a step are solved."""


def corners(net: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The corners (4, m n, ...) of the quads of a net (m + 1, n + 1, ...), round each."""
    round_each = (net[:-1, :-1], net[:-1, 1:], net[1:, 1:], net[1:, :-1])
    return np.stack([side.reshape(-1, *net.shape[2:]) for side in round_each])


def planarity(quads: Array) -> Array:
    """How far each quad (4, n, 3) is from being plane, (n,): the distance of its diagonals.

    A triangle is plane. Source: geometry.md, section 11.
    """
    volume, area, _ = _volumes(quads)
    return np.divide(np.abs(volume), area, out=np.zeros_like(area), where=area > 0.0)


def flattened(net: Array) -> tuple[Array, float]:
    """The net (m + 1, n + 1, 3) with every quad plane to rounding, and the largest move.

    The points move as little as possible: Newton's method for the planarity of all quads, each
    step the shortest one. Points that were equal stay equal. A net with a quad that turns by more
    than rounding comes back as it is, with a move of 0, and so does one that is plane.
    """
    quads = corners(net)
    if not _unevenness(quads) > PLANE or not _turn(quads) <= ROUNDING:
        return net, 0.0
    start, index = np.unique(net.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(net.shape[:2])
    corner = corners(index)
    corner = corner[:, (np.diff(np.sort(corner, axis=0), axis=0) > 0).all(axis=0)]  # no triangles
    points = start
    for _ in range(STEPS):
        points = points + _shortest_step(points, corner)
        if _unevenness(points[corner]) <= PLANE:
            break
    if not _unevenness(points[corner]) <= 1e3 * PLANE:
        return net, 0.0
    return points[index], float(np.linalg.norm(points - start, axis=1).max())


def _unevenness(quads: Array) -> float:
    """The largest planarity defect of the quads (4, n, 3) as a share of their size."""
    size = np.linalg.norm(np.ptp(quads, axis=0), axis=1)
    defect = planarity(quads)
    return float(np.divide(defect, size, out=np.zeros_like(size), where=size > 0.0).max(initial=0))


def _turn(quads: Array) -> float:
    """The largest angle in radians between the tangent planes at the two ends of a ruling."""
    lower, end, upper, start = np.roll(quads, -1, axis=0) - quads
    turn = np.zeros(quads.shape[1])
    for ruling in (start, end):
        below, above = np.cross(lower, ruling), np.cross(-upper, ruling)
        sine = np.linalg.norm(np.cross(below, above), axis=1)
        turn = np.maximum(turn, np.arctan2(sine, np.abs(rows_dot(below, above))))
    return float(turn.max(initial=0.0))


def _volumes(quads: Array) -> tuple[Array, Array, Array]:
    """Of each quad: the volume of its three edges from corner 0, the area that its diagonals
    span, both (n,), and the volume's slopes (4, n, 3) by the corners."""
    one, two, three = quads[1] - quads[0], quads[2] - quads[0], quads[3] - quads[0]
    slopes = [rows_cross(two, three), rows_cross(three, one), rows_cross(one, two)]
    area = np.linalg.norm(rows_cross(two, three - one), axis=1)
    return rows_dot(one, slopes[0]), area, np.stack([-(slopes[0] + slopes[1] + slopes[2]), *slopes])


def _shortest_step(points: Array, corner: npt.NDArray[Any]) -> Array:
    """The shortest move of the points (k, 3) after which, to first order, all quads are plane."""
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import lsqr

    volume, area, slopes = _volumes(points[corner])
    rows = np.broadcast_to(np.arange(len(area))[None, :, None], slopes.shape).ravel()
    columns = (3 * corner[:, :, None] + np.arange(3)).ravel()
    values: Array = (slopes / area[:, None]).ravel()
    matrix = csr_array((values, (rows, columns)), shape=(len(area), points.size))
    step = lsqr(matrix, -volume / area, atol=EXACTLY, btol=EXACTLY, iter_lim=20 * len(area))[0]
    return np.asarray(step.reshape(points.shape))
