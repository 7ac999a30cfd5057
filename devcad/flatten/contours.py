"""Contours of features in the pattern plane: analytic pieces, placed, many at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import clenshaw
from devcad.geometry.edge import Edge
from devcad.geometry.resolving import resolve_many
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]

JUMP = 1e-6
"""Of the largest speed on a contour, or of that over its length: a smaller jump is none."""
DROPPED = 1e-9
"""Of the contour's size: a shorter piece is a corner."""


@dataclass(frozen=True, slots=True)
class Contours:
    """Lines in a plane as polynomial pieces, in the order of their runs.

    Piece i of ``owner[i]`` runs over u from ``low[i]`` to ``high[i]`` with Chebyshev
    ``coefficients[i]`` (N, 2); ``corner[i]`` says that the line has a corner or begins
    at the piece's start. ``closed`` (k,) tells of each line whether it comes back to its start.
    """

    owner: Index
    low: Array
    high: Array
    coefficients: Array
    corner: Flags
    closed: Flags

    def points(self, piece: Index, u: Array) -> Array:
        """The points at u (n,) of the pieces (n,), (n, 2)."""
        low, high = self.low[piece], self.high[piece]
        return clenshaw(self.coefficients[piece], ((u - low) - (high - u)) / (high - low))

    def period(self, line: int) -> float:
        """The length of a line's parameter."""
        own = np.flatnonzero(self.owner == line)
        return float(self.high[own[-1]] - self.low[own[0]])

    def reversed(self, which: Flags) -> Contours:
        """The same with the lines ``which`` (k,) run backwards, over the same parameters."""
        turn = which[self.owner]
        first = np.searchsorted(self.owner, np.arange(len(which)))
        last = np.searchsorted(self.owner, np.arange(len(which)), side="right") - 1
        total = (self.low[first] + self.high[last])[self.owner]
        place = np.where(
            turn, (first + last)[self.owner] - np.arange(len(turn)), np.arange(len(turn))
        )
        sign = np.where(np.arange(self.coefficients.shape[1]) % 2, -1.0, 1.0)[:, None]
        table = np.where(turn[:, None, None], sign * self.coefficients, self.coefficients)
        low = np.where(turn, total - self.high, self.low)
        high = np.where(turn, total - self.low, self.high)
        # the corner at a piece's start is then the one at its end: that of the piece after it
        after = np.where(
            np.isin(np.arange(len(turn)), last), first[self.owner], np.arange(len(turn)) + 1
        )
        corner = np.where(turn, self.corner[after], self.corner)
        return Contours(
            self.owner, low[place], high[place], table[place], corner[place], self.closed
        )

    def areas(self) -> Array:
        """The areas that the lines go round counterclockwise, (k,), to rounding."""
        n = self.coefficients.shape[1]
        slopes = np.einsum("ij,pjd->pid", chebyshev.differentiation(n), self.coefficients)
        x, weights = np.polynomial.legendre.leggauss(n)
        at = np.polynomial.chebyshev.chebvander(x, n - 1)
        points, moved = (np.einsum("xi,pid->pxd", at, c) for c in (self.coefficients, slopes))
        start = points[np.searchsorted(self.owner, self.owner), :1]
        away = points - start
        swept = 0.5 * (away[..., 0] * moved[..., 1] - away[..., 1] * moved[..., 0]) @ weights
        return np.asarray(np.bincount(self.owner, swept, len(self.closed)), dtype=float)


def contours(lines: Sequence[Sequence[Edge]], *, closed: bool) -> Contours:
    """The pieces of lines about their own origins, each a run of edges one after the other.

    The parameter is the first edge's own and goes on along the others. Edges without length are
    left out; where edges follow one another within 1e-6 rad the line is smooth.
    """
    edges = [edge for line in lines for edge in line]
    owner = np.repeat(np.arange(len(lines)), [len(line) for line in lines])
    # one panel for each stretch of an edge between its knots, run with a rising parameter
    spans = [np.abs(edge.u - edge.u[0]) for edge in edges]
    of_edge = np.repeat(np.arange(len(edges)), [len(s) - 1 for s in spans])
    low = np.concatenate([s[:-1] for s in spans])
    high = np.concatenate([s[1:] for s in spans])

    def sample(panel: Index, w: Array) -> Array:
        out = np.empty((len(w), 2))
        starts = np.flatnonzero(np.diff(panel, prepend=-1))
        for a, b in zip(starts.tolist(), [*starts[1:].tolist(), len(w)], strict=True):
            edge = edges[of_edge[panel[a]]]
            way = 1.0 if edge.u[-1] >= edge.u[0] else -1.0
            u = np.clip(
                edge.u[0] + way * w[a:b], min(edge.u[0], edge.u[-1]), max(edge.u[0], edge.u[-1])
            )
            out[a:b] = edge.curve(u)[0]
        return out

    ends = sample(np.arange(len(low)), low), sample(np.arange(len(low)), high)
    size = np.maximum(np.abs(ends[0]), np.abs(ends[1])).max(axis=1)
    scale = np.zeros(len(lines))
    np.maximum.at(scale, owner[of_edge], size)
    scales = np.repeat(scale[owner[of_edge]][:, None], 2, axis=1)
    panels = resolve_many(sample, low, high, scale=scales)
    shift = _offsets(edges, owner)[of_edge[panels.owner]]
    found = Contours(
        owner[of_edge[panels.owner]],
        panels.low + shift,
        panels.high + shift,
        panels.coefficients,
        np.ones(len(panels.low), dtype=bool),
        np.full(len(lines), closed),
    )
    return _with_corners(_without_points(found))


def _offsets(edges: Sequence[Edge], owner: Index) -> Array:
    """What is added to each edge's parameter from 0 for the parameter of its line, (n,)."""
    widths = np.array([abs(float(edge.u[-1] - edge.u[0])) for edge in edges])
    before = np.cumsum(widths) - widths
    first = np.searchsorted(owner, owner)
    start = np.array([min(float(edge.u[0]), float(edge.u[-1])) for edge in edges])
    return np.asarray(before - before[first] + start[first])


def _without_points(found: Contours) -> Contours:
    """The contours without their pieces that are points; the parameter closes up over them."""
    spread = np.abs(found.coefficients[:, 1:]).sum(axis=(1, 2))
    size = np.zeros(len(found.closed))
    np.maximum.at(size, found.owner, spread)
    kept = spread > DROPPED * size[found.owner]
    kept |= size[found.owner] == 0.0
    if kept.all():
        return found
    width = np.where(kept, 0.0, found.high - found.low)
    lost = np.cumsum(width)
    first = np.searchsorted(found.owner, found.owner)
    lost -= lost[first] - width[first]
    return replace(
        found,
        owner=found.owner[kept],
        low=(found.low - lost)[kept],
        high=(found.high - lost)[kept],
        coefficients=found.coefficients[kept],
        corner=found.corner[kept],
    )


def _with_corners(found: Contours) -> Contours:
    """The contours with their corners: where the direction, the speed or its change jumps.

    A line that runs smoothly into an arc ends there too: CAD systems know lines and arcs, and a
    spline over both would need many spans.
    """
    n = found.coefficients.shape[1]
    matrix = chebyshev.differentiation(n)
    half = 0.5 * (found.high - found.low)[:, None, None]
    slopes = np.einsum("ij,pjd->pid", matrix, found.coefficients) / half
    second = np.einsum("ij,pjd->pid", matrix, slopes) / half
    sign = np.where(np.arange(n) % 2, -1.0, 1.0)
    first = np.searchsorted(found.owner, found.owner)
    last = np.searchsorted(found.owner, found.owner, side="right") - 1
    number = np.arange(len(first))
    before = np.where(number == first, last, number - 1)
    corner = (number == first) & ~found.closed[found.owner]
    scale = np.zeros(len(found.closed))
    for rates in (slopes, second):
        start, end = np.einsum("i,pid->pd", sign, rates), rates.sum(axis=1)[before]
        np.maximum.at(scale, found.owner, np.linalg.norm(start, axis=1))
        corner |= np.linalg.norm(start - end, axis=1) > JUMP * scale[found.owner]
        scale /= np.bincount(found.owner, found.high - found.low, len(scale))
    return replace(found, corner=corner)


def placed(found: Contours, origin: Array, angle: Array) -> Contours:
    """Every line turned by its angle (k,) about its own origin, and that moved to (k, 2)."""
    cos, sin = np.cos(angle)[found.owner, None], np.sin(angle)[found.owner, None]
    x, y = found.coefficients[..., 0], found.coefficients[..., 1]
    table = np.stack([cos * x - sin * y, sin * x + cos * y], axis=2)
    table[:, 0] += origin[found.owner]
    return replace(found, coefficients=table)
