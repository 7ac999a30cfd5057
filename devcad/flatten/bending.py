"""Where a press brake bends: a smooth part's bending gathered on few rulings.

A stretch is a part of the sheet that bends one way without a flat in it; a cell is what lies
between two of its rulings. All the bending of a cell is done at once, on the ruling at the middle
of its bending, so that the turning of the part is kept. The cells of a stretch bend alike, or are
as wide as one another where it is their length that counts. They are told by their borders: shares
of the stretch's bending, increasing from 0 to 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.development import Development
from devcad.flatten.pattern import Line
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

FLAT = 1e-9
"""Of the largest bending rate of a panel: less is none."""
LOOKS = 129
"""Places of a panel of the series among which a change of sign is seen."""
HALVINGS = 54
ON_JOINT = 1e-9
"""Of a patch's parameters: a bend as near to a joint lies on it."""

Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Piece:
    """The part of patch number ``patch`` from ``low`` to ``high``, and its bending in radians."""

    patch: int
    low: float
    high: float
    angle: float


@dataclass(frozen=True, slots=True)
class Stretch:
    """Pieces one after the other that bend one way, without a flat or a crease between them."""

    pieces: tuple[Piece, ...]

    @property
    def angle(self) -> float:
        """The whole bending in radians, positive towards the front."""
        return sum(piece.angle for piece in self.pieces)

    @property
    def start(self) -> tuple[int, float]:
        """The patch and the parameter of the first ruling."""
        return self.pieces[0].patch, self.pieces[0].low

    @property
    def end(self) -> tuple[int, float]:
        """The patch and the parameter of the last ruling."""
        return self.pieces[-1].patch, self.pieces[-1].high


@dataclass(frozen=True, slots=True)
class Bend:
    """A sharp bend by ``angle`` (radians, positive towards the front) on the ruling ``t`` of patch
    number ``patch``."""

    patch: int
    t: float
    angle: float


@dataclass(frozen=True, slots=True)
class BendLine:
    """A bend: its ``line`` from base to top, not yet trimmed by cutouts; ``datum``, how far from
    the panel's start it meets the base and the top of the pattern, in mm along them; ``loaded``,
    the angle under the tool in radians, before the sheet springs back."""

    line: Line
    datum: tuple[float, float]
    loaded: float


@dataclass(frozen=True, slots=True)
class Rulings:
    """Rulings of a chain in order: the patch and the parameter of each, (n,)."""

    patch: Index
    t: Array

    def of(self, value: Callable[[int, Array], Array]) -> Array:
        """value(patch number, t (m,)) of all of them, in their order."""
        parts = {k: value(k, self.t[self.patch == k]) for k in np.unique(self.patch).tolist()}
        first = next(iter(parts.values()))
        out = np.zeros((len(self.t), *first.shape[1:]))
        for k, part in parts.items():
            out[self.patch == k] = part
        return out


@dataclass(frozen=True, slots=True)
class Sheet:
    """The smooth part as bending sees it: ``middle`` in space, ``flat`` its pattern as plane
    patches, ``turned`` the bending up to t on each patch and ``lengths`` those of both rails."""

    middle: Chain
    flat: Chain
    turned: tuple[Piecewise, ...]
    lengths: tuple[Piecewise, ...]
    before: Array
    """The lengths of both rails before each patch, (patches, 2)."""

    def along(self, rulings: Rulings) -> Array:
        """The lengths along base and top from the panel's start, (n, 2)."""
        return rulings.of(lambda k, t: self.before[k] + self.lengths[k](t))

    def places(self, stretch: Stretch, shares: Array) -> Rulings:
        """The rulings before which these shares (n,) of a stretch's bending lie, increasing."""
        sign = np.sign(stretch.angle)
        ends = np.cumsum([0.0, *(abs(piece.angle) for piece in stretch.pieces)])
        return _where(stretch, shares, ends, lambda k, t: sign * self._turned(k, t))

    def even(self, stretch: Stretch, count: int) -> Array:
        """The shares of a stretch's bending before the borders of ``count`` cells of one length,
        that of both edges together, (count + 1,)."""

        def length(number: int, t: Array) -> Array:
            return np.asarray(self.lengths[number](t).sum(axis=1))

        pieces = stretch.pieces
        spans = [length(p.patch, np.array([p.low, p.high])) for p in pieces]
        ends = np.cumsum([0.0, *(float(span[1] - span[0]) for span in spans)])
        at = _where(stretch, np.linspace(0.0, 1.0, count + 1), ends, length)
        angles = [piece.angle for piece in pieces]
        before = dict(zip((p.patch for p in pieces), np.cumsum([0.0, *angles[:-1]]), strict=True))
        start = {p.patch: float(self._turned(p.patch, np.array([p.low]))[0]) for p in pieces}
        turned = at.of(lambda k, t: before[k] + self._turned(k, t) - start[k])
        out = np.asarray(turned / stretch.angle)
        out[[0, -1]] = 0.0, 1.0
        return out

    def _turned(self, number: int, t: Array) -> Array:
        return self.turned[number](t)[:, 0]


def _where(
    stretch: Stretch, shares: Array, ends: Array, value: Callable[[int, Array], Array]
) -> Rulings:
    """The rulings at these shares (n,) of what ``value`` grows by over a stretch; ``ends``
    (pieces + 1,) is how far it has grown before each of its pieces and after the last."""
    aim = shares * ends[-1]
    number = np.clip(np.searchsorted(ends, aim, side="right") - 1, 0, len(ends) - 2)
    patch = np.array([piece.patch for piece in stretch.pieces])[number]
    low = np.array([piece.low for piece in stretch.pieces])[number]
    high = np.array([piece.high for piece in stretch.pieces])[number]
    start, aim = Rulings(patch, low.copy()).of(value), aim - ends[number]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        short = Rulings(patch, middle).of(value) - start < aim
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    t = 0.5 * (low + high)
    t = np.where(shares == 0.0, stretch.start[1], np.where(shares == 1.0, stretch.end[1], t))
    return Rulings(patch, t)


def sheet(middle: Chain, flat: Chain, developments: Sequence[Development]) -> Sheet:
    """The smooth part of this middle surface and pattern."""
    turned = [Piecewise(d.series.knots, d.series.coefficients[..., 3:]) for d in developments]
    lengths = tuple(rail_lengths(patch) for patch in flat.patches)
    totals = [
        length(np.array(patch.domain[1:]))[0]
        for length, patch in zip(lengths, flat.patches, strict=True)
    ]
    before = np.concatenate([np.zeros((1, 2)), np.cumsum(totals, axis=0)])[:-1]
    return Sheet(middle, flat, tuple(t.antiderivative() for t in turned), lengths, before)


def rail_lengths(flat: Patch) -> Piecewise:
    """The lengths along the base and the top of a patch from its start, (n, 2)."""

    def speeds(t: Array) -> Array:
        jet = flat.jet(t, 1)
        rails = [jet.rail(v)[1] for v in (jet.v_from, jet.v_to)]
        return np.column_stack([np.linalg.norm(rail, axis=1) for rail in rails])

    fastest = float(speeds(np.linspace(*flat.domain, 17)[1:-1]).max())
    return chebyshev.resolve(speeds, flat.segments, scale=1e-3 * fastest).antiderivative()


def stretches(middle: Chain, developments: Sequence[Development]) -> list[Stretch]:
    """The stretches of a chain, in order.

    Patches that are a bend already (:attr:`devcad.geometry.patch.Patch.inside_radius`) are none
    of them. A piece that bends by less than 1e-9 of the panel's sharpest is flat.
    """
    made = [patch.inside_radius is not None for patch in middle.patches]
    spans = [np.diff(development.series.knots[[0, -1]])[0] for development in developments]
    tops = [
        float(np.abs(development.series(_looks(development.series.knots))[:, 3]).max()) * span
        for development, span in zip(developments, spans, strict=True)
    ]
    most = max(tops)
    out: list[list[Piece]] = []
    follows = False
    for number, development in enumerate(developments):
        if number and not middle.joints[number - 1].smooth:
            follows = False
        limit = FLAT * most / spans[number]
        for piece in [] if made[number] else _pieces(number, development.series, limit):
            if not piece.angle:
                follows = False
                continue
            if follows and out[-1][-1].angle * piece.angle > 0.0:
                out[-1].append(piece)
            else:
                out.append([piece])
            follows = True
        follows = follows and not made[number]
    return [Stretch(_merged(pieces)) for pieces in out]


def _looks(knots: Array) -> Array:
    share = np.linspace(0.0, 1.0, LOOKS)[1:-1]
    return np.asarray((knots[:-1, None] + np.diff(knots)[:, None] * share).ravel())


def _pieces(number: int, series: Piecewise, limit: float) -> list[Piece]:
    """The pieces of a patch between its knots and the changes of its bending's sign; those that
    are flat have the angle 0."""
    turned = Piecewise(series.knots, series.coefficients[..., 3:]).antiderivative()
    share = np.linspace(0.0, 1.0, LOOKS)[1:-1]
    out = []
    for low, high in pairwise(series.knots.tolist()):
        t = low + (high - low) * share
        values = series(t)[:, 3]
        told = np.flatnonzero(np.abs(values) > limit)
        if not told.size:
            out.append(Piece(number, low, high, 0.0))
            continue
        sign = np.sign(values[told])
        change = np.flatnonzero(sign[1:] != sign[:-1])
        a, b = t[told[change]], t[told[change + 1]]
        for _ in range(HALVINGS if change.size else 0):
            middle = 0.5 * (a + b)
            same = series(middle)[:, 3] * sign[change] > 0.0
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        ends = np.array([low, *(0.5 * (a + b)).tolist(), high])
        angles = np.diff(turned(ends)[:, 0])
        out += [
            Piece(number, start, end, angle)
            for (start, end), angle in zip(pairwise(ends.tolist()), angles.tolist(), strict=True)
        ]
    return out


def _merged(pieces: Sequence[Piece]) -> tuple[Piece, ...]:
    """Pieces of one patch made one."""
    out: list[Piece] = []
    for piece in pieces:
        if out and out[-1].patch == piece.patch:
            last = out.pop()
            piece = Piece(piece.patch, last.low, piece.high, last.angle + piece.angle)
        out.append(piece)
    return tuple(out)


def bends(smooth: Sheet, parts: Sequence[Stretch], cells: Sequence[Array]) -> list[Bend]:
    """One bend for each cell; ``cells[k]`` are the borders of those of ``parts[k]``."""
    out = []
    for part, borders in zip(parts, cells, strict=True):
        at = smooth.places(part, 0.5 * (borders[1:] + borders[:-1]))
        angles = part.angle * np.diff(borders)
        out += [
            Bend(*_on_joint(smooth.flat, k, t), angle)
            for k, t, angle in zip(at.patch.tolist(), at.t.tolist(), angles.tolist(), strict=True)
        ]
    return out


def _on_joint(chain: Chain, patch: int, t: float) -> tuple[int, float]:
    """The ruling itself, or the start of a patch where it is that within rounding."""
    low, high = chain.patches[patch].domain
    near = ON_JOINT * (high - low)
    if high - t <= near and patch + 1 < len(chain.patches):
        return patch + 1, chain.patches[patch + 1].domain[0]
    return patch, low if t - low <= near else t
