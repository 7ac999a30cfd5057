"""A matching taken apart: fans, planes, strips and what is none of them, with exact ends.

Source: algorithms.md, section 1 (classification).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry.curve import Curve
from devcad.geometry.loft.completion import SAME
from devcad.geometry.loft.matching import GRID, LOOKS, ZERO, Path, nearest_root, warp_at
from devcad.geometry.loft.rail import Rail, Span
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Side:
    """What one rail does in a stretch: ``curve`` from ``t0`` to ``t1``, or stand at ``point``."""

    curve: Curve | None
    t0: float
    t1: float
    point: Array
    straight: bool

    @property
    def stands(self) -> bool:
        """Whether the rail does not move."""
        return self.curve is None or self.t0 == self.t1


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of the matching; ``kind`` is fan, plane, strip or quasi.

    ``seeds`` (2, k): parameters of both rails at rulings between the ends, for a strip or quasi.
    ``u`` and ``v`` are the coordinates of its ends. ``share`` is its part of the whole path.
    """

    kind: str
    a: Side
    b: Side
    seeds: Array
    u: tuple[float, float]
    v: tuple[float, float]
    share: float


def stretches(a: Rail, b: Rail, path: Path) -> list[Stretch]:
    """The parts of a completed path, in order, cut where a rail comes to the end of a span."""
    nodes = _nodes(a, b, path)
    total = nodes[-1][0] + nodes[-1][1] - nodes[0][0] - nodes[0][1]
    out = []
    for (u0, v0, _), (u1, v1, _) in pairwise(nodes):
        if u1 - u0 <= SAME and v1 - v0 <= SAME:
            continue
        part = _stretch(a, b, path, (u0, u1), (v0, v1), (u1 - u0 + v1 - v0) / total)
        if part is not None:
            out.append(part)
    return out


def _nodes(a: Rail, b: Rail, path: Path) -> list[tuple[float, float, bool]]:
    """The path's ends and its crossings of the ends of spans, in order."""
    found = [(u, v, True) for u, v in path.marks if not _coplanar(a, b, u, v)]
    cells = np.stack([a.index(path.u), b.index(path.v)])
    for k in np.flatnonzero((np.diff(cells, axis=1) != 0).any(axis=0)):
        box = np.concatenate([path.u[k : k + 2], path.v[k : k + 2]])
        both = bool(path.solved[k] and path.solved[k + 1])
        steps = a.between(*box[:2].tolist()), b.between(*box[2:].tolist())
        found += [_crossing(a, b, float(x), None, box, both) for x in steps[0]]
        found += [_crossing(a, b, None, float(y), box, both) for y in steps[1]]
    out = [(float(path.u[0]), float(path.v[0]), True)]
    for u, v, exact in sorted(found, key=lambda node: node[0] + node[1]):
        if u + v - out[-1][0] - out[-1][1] > SAME:
            out.append((max(u, out[-1][0]), max(v, out[-1][1]), exact))
    end = (float(path.u[-1]), float(path.v[-1]), True)
    if end[0] + end[1] - out[-1][0] - out[-1][1] <= SAME:
        out.pop()
    return [*out, end]


def _coplanar(a: Rail, b: Rail, u: float, v: float) -> bool:
    """Whether both rails are straight about (u, v) and lie in one plane: nothing warps there."""
    (first, turn), (second, other) = (
        rail.span(int(rail.index(np.array([x]))[0])) for rail, x in ((a, u), (b, v))
    )
    if not (first.straight and second.straight):
        return False
    shares = np.array([0.1, 0.5, 0.9])
    x, y = (
        span.x0 + moved + shares * (span.x1 - span.x0)
        for span, moved in ((first, turn), (second, other))
    )
    return bool((np.abs(warp_at(a, b, x, y[::-1])) <= ZERO).all())


def _crossing(
    a: Rail, b: Rail, x: float | None, y: float | None, box: Array, solved: bool
) -> tuple[float, float, bool]:
    """Where the path passes u = x, or v = y, between two samples (u0, u1, v0, v1)."""
    u0, u1, v0, v1 = (float(value) for value in box)
    along_u = x is None
    fixed = float(x) if x is not None else float(y or 0.0)
    low, high, start, end = (u0, u1, v0, v1) if along_u else (v0, v1, u0, u1)
    ends = a if along_u else b
    near = low + (fixed - start) / max(end - start, 1e-300) * (high - low)
    reach = u1 - u0 + v1 - v0

    def of(s: Array) -> Array:
        still = np.full_like(s, fixed)
        return warp_at(a, b, *((s, still) if along_u else (still, s)))

    def placed(value: float, exact: bool) -> tuple[float, float, bool]:
        return (value, fixed, exact) if along_u else (fixed, value, exact)

    wide = max(reach, 2.0 / GRID)  # the search knows no better where a corner meets a corner
    for corner in ends.between(low - wide, high + wide):
        if abs(float(of(np.array([corner]))[0])) <= ZERO:
            return placed(float(corner), True)
    if not solved:
        return placed(near, False)
    looks = np.linspace(low - reach, high + reach, 4 * LOOKS)
    if not ends.closed:
        looks = np.clip(looks, 0.0, 1.0)
    hit, root = nearest_root(lambda _: of, np.array([0]), looks[None], np.array([near]))
    if hit[0]:
        return placed(float(root[0]), True)
    return placed(near, abs(float(of(np.array([near]))[0])) <= ZERO)


def _stretch(
    a: Rail, b: Rail, path: Path, u: tuple[float, float], v: tuple[float, float], share: float
) -> Stretch | None:
    """The part between two nodes; None where neither rail moves (a crease between two corners)."""
    inner = (path.u + path.v > u[0] + v[0] + SAME) & (path.u + path.v < u[1] + v[1] - SAME)
    solved = bool(path.solved[inner].all())
    (span_a, turn_a), (span_b, turn_b) = (
        rail.span(int(rail.index(np.array([0.5 * (x[0] + x[1])]))[0]))
        for rail, x in ((a, u), (b, v))
    )
    still_a = span_a.piece is None or u[1] - u[0] <= SAME
    still_b = span_b.piece is None or v[1] - v[0] <= SAME
    if still_a and still_b:
        return None
    side_a = _side(span_a, u, turn_a, still_a)
    side_b = _side(span_b, v, turn_b, still_b)
    none = np.zeros((2, 0))
    if still_a or still_b:
        return Stretch("fan", side_a, side_b, none, u, v, share)
    if span_a.straight and span_b.straight:
        plane = _coplanar(a, b, 0.5 * (u[0] + u[1]), 0.5 * (v[0] + v[1]))
        return Stretch("plane" if plane else "quasi", side_a, side_b, none, u, v, share)
    seeds = np.stack(
        [
            np.interp(path.u[inner] - turn_a, span_a.x, span_a.t),
            np.interp(path.v[inner] - turn_b, span_b.x, span_b.t),
        ]
    )
    return Stretch("strip" if solved else "quasi", side_a, side_b, seeds, u, v, share)


def _side(span: Span, x: tuple[float, float], turn: float, still: bool) -> Side:
    t0, t1 = (span.parameter(value - turn) for value in x)
    if span.piece is None:
        return Side(None, 0.0, 0.0, span.point, False)
    t1 = t0 = 0.5 * (t0 + t1) if still else t0
    if not still:
        t1 = span.parameter(x[1] - turn)
    point = span.piece.jet(np.array([t0]), 0)[0, 0]
    return Side(span.piece, t0, t1, point, span.straight)
