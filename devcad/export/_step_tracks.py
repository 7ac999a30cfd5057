"""Tracks of many cuts, worked on together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Indices = NDArray[np.intp]


JUMP = 1e-6
"""Of a panel's reach in t and v: how far a jump of the second derivative has to lead the line
away within it, so that the panels are two curves."""
AT_BREAK = 1e-9
"""Of the domain: a knot as near to a break of the patch lies on it."""


def corners(series: Piecewise, patch: Patch) -> list[float]:
    """The inner knots at which a track is two curves that share a tangent, as a line and an arc.

    Not those where it crosses a break of the patch: there one curve lies on two surfaces.
    """
    inner = series.knots[1:-1]
    if not len(inner):
        return []
    return [
        u
        for u, at in zip(inner.tolist(), _jumps(series), strict=True)
        if at and not (_at_break(series, patch, u))
    ]


def breaks(series: Piecewise, patch: Patch, low: float, high: float) -> list[float]:
    """The knots strictly between two parameters where a track crosses a break of the patch."""
    inner = series.knots[(series.knots > low) & (series.knots < high)].tolist()
    return [u for u in inner if _at_break(series, patch, u)]


def _at_break(series: Piecewise, patch: Patch, u: float) -> bool:
    if not patch.breaks:
        return False
    away = np.abs(series(np.array([u]))[0, 0] - np.array(patch.breaks)).min()
    return bool(away <= AT_BREAK * (patch.domain[1] - patch.domain[0]))


def _jumps(series: Piecewise) -> NDArray[np.bool_]:
    """Whether the second derivative jumps at each inner knot."""
    table, half = series.coefficients, 0.5 * np.diff(series.knots)[:, None]
    matrix = chebyshev.differentiation(table.shape[1])
    bent = np.einsum("ij,pjd->pid", matrix @ matrix, table) / half[:, :, None] ** 2
    signs = (-1.0) ** np.arange(table.shape[1])
    jump = np.abs(np.einsum("i,pid->pd", signs, bent[1:]) - bent[:-1].sum(axis=1))
    reach = np.abs(table[:, 1:]).sum(axis=1).max(axis=0)
    short = np.minimum(half[:-1], half[1:])
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray((jump * short**2 > JUMP * reach).any(axis=1))


class Tracks:
    """Stretches of piecewise series, each from ``u`` (n, 2) to another."""

    def __init__(self, series: Sequence[Piecewise], u: Array) -> None:
        self._series, self._u = series, u
        counts = np.array([len(s.coefficients) for s in series])
        self._several = counts > 1
        self._first = np.cumsum(counts) - counts
        width = max(s.coefficients.shape[1] for s in series)
        table = np.zeros((width, int(counts.sum()), 2))
        for s, start in zip(series, self._first.tolist(), strict=True):
            part = s.coefficients.swapaxes(0, 1)
            table[: len(part), start : start + part.shape[1]] = part
        self._table = table
        self._low = np.concatenate([s.knots[:-1] for s in series])
        self._high = np.concatenate([s.knots[1:] for s in series])

    def __call__(self, which: Indices, shares: Array) -> Array:
        """The places (t, v) at shares (m,) of some of the stretches, (n, m, 2)."""
        start, end = self._u[which].T
        u = (1.0 - shares) * start[:, None] + shares * end[:, None]
        row = np.repeat(self._first[which][:, None], len(shares), axis=1)
        for i in np.flatnonzero(self._several[which]).tolist():
            inner = self._series[which[i]].knots[1:-1]
            row[i] += np.searchsorted(inner, u[i], side="right")
        low, high = self._low[row], self._high[row]
        x = (((u - low) - (high - u)) / (high - low))[..., None]
        after = np.zeros((*u.shape, 2))
        last = after
        for k in range(len(self._table) - 1, 0, -1):
            after, last = self._table[k][row] + 2.0 * x * after - last, after
        return np.asarray(self._table[0][row] + x * after - last)
