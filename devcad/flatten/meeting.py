"""Where plane curves meet: all crossings and touches of pairs of them, by subdivision.

Two curves are halved until their pieces are apart, or cross at an angle that is larger than the
pieces' own turning: then they cross once at most, and Newton steps find it. Pieces that are
straight within rounding and still no further apart touch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import clenshaw
from devcad.geometry.resolving import resolve_many
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]

PARTS = 8
"""Parts of a curve's panel to begin with: a full circle turns by 45 degrees on each."""
LOOKS = 5
"""Places of a part at which its bulge and its turning are looked at."""
SAFE = 1.5
"""Times what is seen there: as much may be between them."""
FLAT = 0.01
"""Of its length: a part that bulges less is crossed where its chord is, or not at all."""
LEVELS = 60
"""Halvings at most."""
NEWTON = 6
"""Steps to a crossing."""
MANY = 1024
"""Parts for each panel that are close to the other curve: as many follow it all the way."""
SAME = 1e-9
"""Of a curve's parameter: crossings as near are one."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """Two curves meet at u of the first and w of the second; they touch where they do not cross
    at an angle."""

    first: int
    second: int
    u: float
    w: float
    crossing: bool


@dataclass(frozen=True, slots=True)
class Curves:
    """Plane curves as polynomial panels: the ``owner`` of each, over ``low`` to ``high`` (m,),
    with Chebyshev ``table`` (m, N, 2) and that of the slopes by the panel's x."""

    owner: Index
    low: Array
    high: Array
    table: Array
    slopes: Array

    def parameter(self, panel: Index, x: Array) -> Array:
        """The curves' own parameters at x of the panels."""
        return np.asarray(0.5 * ((1.0 - x) * self.low[panel] + (1.0 + x) * self.high[panel]))


@dataclass(frozen=True, slots=True)
class Parts:
    """Parts of panels, from x = ``low`` to ``high``."""

    panel: Index
    low: Array
    high: Array

    def chosen(self, k: Index) -> Parts:
        """Some of them."""
        return Parts(self.panel[k], self.low[k], self.high[k])

    def halves(self) -> Parts:
        """All first halves, then all second ones."""
        middle = 0.5 * (self.low + self.high)
        return Parts(
            np.tile(self.panel, 2),
            np.concatenate([self.low, middle]),
            np.concatenate([middle, self.high]),
        )


@dataclass(frozen=True, slots=True)
class Shapes:
    """What is seen of parts: ``start`` and ``chord`` (n, 2), how far they ``bulge`` from the
    chord, and by how much they ``turn`` from it."""

    start: Array
    chord: Array
    bulge: Array
    turn: Array


def curves(image: Callable[[Index, Array], Array], knots: Sequence[Array], scale: float) -> Curves:
    """Curves as polynomials: ``image`` gives the points (n, 2) of curves (n,) at parameters (n,),
    each smooth between its ``knots``; ``scale`` is their size."""
    owner = np.repeat(np.arange(len(knots)), [len(k) - 1 for k in knots])
    low = np.concatenate([k[:-1] for k in knots])
    high = np.concatenate([k[1:] for k in knots])
    size = np.full((len(owner), 2), scale)
    panels = resolve_many(image, low, high, scale=size, owner=owner)
    number = panels.coefficients.shape[1]
    slopes = np.einsum("ij,mjd->mid", chebyshev.differentiation(number), panels.coefficients)
    return Curves(panels.owner, panels.low, panels.high, panels.coefficients, slopes)


def meetings(found: Curves, pairs: Sequence[tuple[int, int]], near: float) -> list[Meeting]:
    """Where the curves of each pair come as near as ``near`` to one another, once each.

    Curves that run along one another touch somewhere there.
    """
    if not pairs:
        return []
    a, b = _first_parts(found, pairs)
    out: list[Meeting] = []
    for _ in range(LEVELS):
        if not len(a.panel):
            break
        one, other = _shapes(found, a), _shapes(found, b)
        reach = one.bulge + other.bulge + near
        close = np.flatnonzero(_distance(one, other) <= reach)
        a, b, one, other = a.chosen(close), b.chosen(close), _some(one, close), _some(other, close)
        along = _along(found, a, b)
        if along.any():
            pair = found.owner[a.panel] * len(found.owner) + found.owner[b.panel]
            _, first = np.unique(np.where(along, pair, -1), return_index=True)
            out += _touches(found, a, b, first[along[first]])
            k = np.flatnonzero(~along)
            a, b, one, other = a.chosen(k), b.chosen(k), _some(one, k), _some(other, k)
        crossing = _angle(one.chord, other.chord) > one.turn + other.turn + SAME
        straight = ~crossing & (one.bulge + other.bulge <= 0.5 * near)
        k = np.flatnonzero(crossing)
        met, sure = _crossings(found, a.chosen(k), b.chosen(k), near)
        out += met
        out += _touches(found, a, b, np.flatnonzero(straight))
        flat = (one.bulge <= FLAT * _length(one)) & (other.bulge <= FLAT * _length(other))
        crossing[k[~sure]] &= flat[k[~sure]]  # Newton steps may have led to another crossing
        k = np.flatnonzero(~crossing & ~straight)
        a, b = _divided(a.chosen(k), b.chosen(k), _some(one, k), _some(other, k))
    return _once(out, found)


def _along(found: Curves, a: Parts, b: Parts) -> NDArray[np.bool_]:
    """Which pairs of parts, (n,), belong to curves that stay close to one another for long."""
    count = len(found.owner)
    _, pair = np.unique(found.owner[a.panel] * count + found.owner[b.panel], return_inverse=True)
    panels = np.bincount(found.owner)
    most = MANY * (panels[found.owner[a.panel]] + panels[found.owner[b.panel]])
    return np.asarray(np.bincount(pair)[pair] > most)


def _first_parts(found: Curves, pairs: Sequence[tuple[int, int]]) -> tuple[Parts, Parts]:
    """All parts of the first curve of each pair with all parts of its second one."""
    of_curve = [np.flatnonzero(found.owner == k) for k in range(int(found.owner.max()) + 1)]
    first, second = [], []
    for i, j in pairs:
        a, b = of_curve[i] * PARTS, of_curve[j] * PARTS
        a, b = ((x[:, None] + np.arange(PARTS)).ravel() for x in (a, b))
        first.append(np.repeat(a, len(b)))
        second.append(np.tile(b, len(a)))
    out = []
    for part in (np.concatenate(first), np.concatenate(second)):
        panel, number = np.divmod(part, PARTS)
        low = np.asarray(2.0 * number / PARTS - 1.0, dtype=float)
        out.append(Parts(panel, low, low + 2.0 / PARTS))
    return out[0], out[1]


def _shapes(found: Curves, parts: Parts) -> Shapes:
    share = np.linspace(0.0, 1.0, LOOKS)
    x = parts.low[:, None] * (1.0 - share) + parts.high[:, None] * share
    panel = np.repeat(parts.panel, LOOKS)
    points = clenshaw(found.table[panel], x.ravel()).reshape(-1, LOOKS, 2)
    chord = points[:, -1] - points[:, 0]
    length = np.maximum(np.hypot(*chord.T), 1e-300)
    away = points - points[:, :1]
    beside = _cross(chord[:, None], away) / length[:, None]
    steps = np.diff(points, axis=1)
    size = np.maximum(np.hypot(steps[..., 0], steps[..., 1]), 1e-300)
    sine = np.abs(_cross(chord[:, None], steps)) / (length[:, None] * size)
    back = (steps * chord[:, None]).sum(axis=2) <= 0.0
    turn = np.where(back, np.pi, np.arcsin(np.minimum(sine, 1.0))).max(axis=1)
    bulge = np.abs(beside).max(axis=1) + np.where(back.any(axis=1), size.sum(axis=1), 0.0)
    # half of the turning between two looks is not seen
    return Shapes(points[:, 0], chord, SAFE * bulge, SAFE * turn)


def _some(shapes: Shapes, k: Index) -> Shapes:
    return Shapes(shapes.start[k], shapes.chord[k], shapes.bulge[k], shapes.turn[k])


def _length(shapes: Shapes) -> Array:
    return np.asarray(np.hypot(*shapes.chord.T))


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _angle(a: Array, b: Array) -> Array:
    """The angles between lines, from 0 to pi/2."""
    return np.asarray(np.arctan2(np.abs(_cross(a, b)), np.abs((a * b).sum(axis=1))))


def _distance(one: Shapes, other: Shapes) -> Array:
    """The distances of the chords from one another, 0 where they cross."""
    a0, a1 = one.start, one.start + one.chord
    b0, b1 = other.start, other.start + other.chord
    ends = [_to_segment(p, b0, b1 - b0) for p in (a0, a1)]
    ends += [_to_segment(p, a0, a1 - a0) for p in (b0, b1)]
    left = _cross(one.chord, b0 - a0), _cross(one.chord, b1 - a0)
    right = _cross(other.chord, a0 - b0), _cross(other.chord, a1 - b0)
    crossed = (left[0] * left[1] < 0.0) & (right[0] * right[1] < 0.0)
    return np.asarray(np.where(crossed, 0.0, np.min(ends, axis=0)))


def _to_segment(p: Array, start: Array, chord: Array) -> Array:
    length = np.maximum((chord * chord).sum(axis=1), 1e-300)
    share = np.clip(((p - start) * chord).sum(axis=1) / length, 0.0, 1.0)
    return np.asarray(np.hypot(*(p - start - share[:, None] * chord).T))


def _divided(a: Parts, b: Parts, one: Shapes, other: Shapes) -> tuple[Parts, Parts]:
    """The pairs with the part that bulges more, or else is longer, halved."""
    measure = [np.hypot(*s.chord.T) + 1e3 * s.bulge for s in (one, other)]
    first = measure[0] >= measure[1]
    k, m = np.flatnonzero(first), np.flatnonzero(~first)
    left, right = a.chosen(k).halves(), b.chosen(m).halves()
    still_b, still_a = b.chosen(np.tile(k, 2)), a.chosen(np.tile(m, 2))
    return _joined(left, still_a), _joined(still_b, right)


def _joined(first: Parts, second: Parts) -> Parts:
    return Parts(
        np.concatenate([first.panel, second.panel]),
        np.concatenate([first.low, second.low]),
        np.concatenate([first.high, second.high]),
    )


def _crossings(
    found: Curves, a: Parts, b: Parts, near: float
) -> tuple[list[Meeting], NDArray[np.bool_]]:
    """The crossings of parts that cross at most once, and for which parts one was found."""
    x, y = 0.5 * (a.low + a.high), 0.5 * (b.low + b.high)
    miss = np.zeros((len(x), 2))
    for step in range(NEWTON + 1):
        miss = clenshaw(found.table[a.panel], x) - clenshaw(found.table[b.panel], y)
        if step == NEWTON:
            break
        p, q = clenshaw(found.slopes[a.panel], x), clenshaw(found.slopes[b.panel], y)
        with np.errstate(invalid="ignore", divide="ignore"):
            x = x - _cross(miss, q) / _cross(p, q)
            y = y - _cross(miss, p) / _cross(p, q)
        # a step beyond the parts' neighbours leads nowhere
        x = np.clip(np.nan_to_num(x, nan=9.0), 2.0 * a.low - a.high, 2.0 * a.high - a.low)
        y = np.clip(np.nan_to_num(y, nan=9.0), 2.0 * b.low - b.high, 2.0 * b.high - b.low)
    inside = np.hypot(*miss.T) <= near
    for z, part, speed in ((x, a, found.slopes), (y, b, found.slopes)):
        slack = SAME * (part.high - part.low)
        rate = np.hypot(*clenshaw(speed[part.panel], np.clip(z, -1.0, 1.0)).T)
        slack = slack + near / np.maximum(rate, 1e-300)
        inside &= (z >= part.low - slack) & (z <= part.high + slack)
    k = np.flatnonzero(inside)
    return _listed(found, a.panel[k], x[k], b.panel[k], y[k], crossing=True), inside


def _touches(found: Curves, a: Parts, b: Parts, k: Index) -> list[Meeting]:
    """The middles of straight parts that touch, one for each pair of curves."""
    if not len(k):
        return []
    pair = np.stack([found.owner[a.panel[k]], found.owner[b.panel[k]]])
    k = k[np.unique(pair, axis=1, return_index=True)[1]]
    x, y = 0.5 * (a.low[k] + a.high[k]), 0.5 * (b.low[k] + b.high[k])
    return _listed(found, a.panel[k], x, b.panel[k], y, crossing=False)


def _listed(
    found: Curves, p: Index, x: Array, q: Index, y: Array, *, crossing: bool
) -> list[Meeting]:
    u = found.parameter(p, np.clip(x, -1.0, 1.0)).tolist()
    w = found.parameter(q, np.clip(y, -1.0, 1.0)).tolist()
    owners = zip(found.owner[p].tolist(), found.owner[q].tolist(), u, w, strict=True)
    return [Meeting(i, j, s, t, crossing) for i, j, s, t in owners]


def _once(met: list[Meeting], found: Curves) -> list[Meeting]:
    """The meetings without repetitions."""
    number = int(found.owner.max()) + 1
    width = np.zeros(number)
    np.maximum.at(width, found.owner, np.maximum(np.abs(found.low), np.abs(found.high)))
    width = np.maximum(width, 1e-300)
    out: list[Meeting] = []
    for m in sorted(met, key=lambda m: (m.first, m.second, not m.crossing, m.u)):
        known = (
            k.first == m.first
            and k.second == m.second
            and abs(k.u - m.u) <= SAME * width[m.first] * 10.0
            and abs(k.w - m.w) <= SAME * width[m.second] * 10.0
            for k in out[-4:]
        )
        if not any(known):
            out.append(m)
    return out


def renumbered(met: Sequence[Meeting], number: Index) -> list[Meeting]:
    """The meetings with the curves' own numbers."""
    return [replace(m, first=int(number[m.first]), second=int(number[m.second])) for m in met]
