"""How far triangles between points of a surface are from it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

BLOCK = 65536
"""Places that are looked at at a time."""


def skin_deviation(
    patch: Patch, t: Array, v: Array, points: Array, triangles: NDArray[np.intp], distance: float
) -> float:
    """The largest distance in mm of triangles (m, 3) from the layer at ``distance`` along n.

    Their corners ``points`` (n, 3) lie on it at (t, v), each (n,). Looked at in the middles of
    the triangles and of their edges, along the normal there; that the same (t, v) is not the
    nearest point is put right to second order.
    """
    if not len(triangles):
        return 0.0
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    codes = np.sort(ends.min(axis=1).astype(np.int64) * len(t) + ends.max(axis=1))
    codes = codes[np.diff(codes, prepend=-1) > 0]
    edges = np.stack([codes // len(t), codes % len(t)], axis=1)
    worst = 0.0
    for corners in (edges, triangles):
        for start in range(0, len(corners), BLOCK):
            some = corners[start : start + BLOCK]
            away = _away(patch, t[some].mean(axis=1), v[some], t[some], points[some], distance)
            worst = max(worst, float(away.max()))
    return worst


def _away(
    patch: Patch, middle: Array, v: Array, t: Array, corners: Array, distance: float
) -> Array:
    """The distances of the means of ``corners`` (n, k, 3) from the surface, (n,)."""
    frame = patch.frame(middle)
    height = v.mean(axis=1)
    true = frame.c0 + height[:, None] * frame.e + distance * frame.n
    miss = corners.mean(axis=1) - true
    across = (miss * frame.m).sum(axis=1)
    width = frame.q + height * frame.a - distance * frame.c
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = np.where(width > 0.0, frame.c / width, 0.0)
    away = np.abs((miss * frame.n).sum(axis=1) - 0.5 * bend * across**2)
    return np.where(np.ptp(t, axis=1) > 0.0, away, 0.0)
