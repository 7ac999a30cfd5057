"""Rails blown up: one coordinate in which a rail's point and its tangent are continuous.

A corner is an interval in which the point stands and the tangent turns from one side to the
other; then cones about a corner, triangles and creases are ordinary parts of a matching.

Source: algorithms.md, section 1 (corner blow-up).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.geometry.curve import Curve, angles
from devcad.geometry.taylor import Array, rows_cross

PER_PIECE = 257
"""Samples between two breaks, for lengths and turnings: the coordinate need not be exact."""
CORNER = 1e-9
"""A tangent that turns by less, in radians, does not turn."""
STRAIGHT = 1e-12
"""A piece that leaves its chord by less than this share of it is straight."""
SAME_JET = 1e-8
"""A seam where the series agree within this share of their size is none."""
SEAM_ORDER = 6


@dataclass(frozen=True, slots=True)
class Span:
    """A smooth piece of a rail, or a corner (``piece`` None), over x0 <= x <= x1.

    Piece: ``x`` and ``t`` (k,) tabulate the coordinate against the piece's own parameter.
    Corner: the tangent turns from ``before`` to ``after`` (3,) at ``point`` (3,).
    """

    x: Array
    t: Array
    piece: Curve | None
    point: Array
    before: Array
    after: Array
    straight: bool = False

    @property
    def x0(self) -> float:
        """Where it begins."""
        return float(self.x[0])

    @property
    def x1(self) -> float:
        """Where it ends."""
        return float(self.x[-1])

    def parameter(self, x: float) -> float:
        """The piece's parameter at x: exact at the ends."""
        return float(np.interp(x, self.x, self.t))

    def at(self, x: Array) -> tuple[Array, Array]:
        """Points and unit tangents (n, 3) at x (n,)."""
        if self.piece is None:
            angle = float(angles(self.before[None], self.after[None])[0])
            share = ((x - self.x0) / (self.x1 - self.x0))[:, None]
            turned = (
                np.sin((1.0 - share) * angle) * self.before + np.sin(share * angle) * self.after
            )
            return np.broadcast_to(self.point, turned.shape), turned / np.sin(angle)
        points, slopes = self.piece.jet(np.interp(x, self.x, self.t), 1)
        return points, slopes / np.linalg.norm(slopes, axis=1)[:, None]


@dataclass(frozen=True, slots=True)
class Rail:
    """A curve over x in [0, 1]: half its length and half its turning, corners included.

    A closed rail goes on beyond: x + 1 is the same place. Its curve starts at ``start``.
    """

    spans: tuple[Span, ...]
    closed: bool
    start: float
    size: float

    @property
    def knots(self) -> Array:
        """The ends of the spans, (k + 1,)."""
        return np.array([*(span.x0 for span in self.spans), self.spans[-1].x1])

    def index(self, x: Array) -> Array:
        """The numbers of the spans at x (n,), counted on from turn to turn of a closed rail."""
        turn = np.floor(x) if self.closed else np.zeros_like(x)
        inner = np.searchsorted(self.knots, x - turn, side="right") - 1
        inner = np.clip(inner, 0, len(self.spans) - 1)
        return np.asarray(inner + len(self.spans) * turn, dtype=int)

    def span(self, index: int) -> tuple[Span, float]:
        """The span of a number, and the whole turns to take off x for it."""
        turn, inner = divmod(index, len(self.spans))
        return self.spans[inner], float(turn)

    def between(self, low: float, high: float) -> Array:
        """The ends of spans in (low, high], on every turn."""
        turns = np.arange(np.floor(low), np.floor(high) + 1.0) if self.closed else np.zeros(1)
        knots = self.knots if not self.closed else self.knots[:-1]
        every = (turns[:, None] + knots).ravel()
        return np.asarray(every[(every > low) & (every <= high)])

    def coordinate(self, t: float, domain: tuple[float, float]) -> float:
        """The coordinate of the parameter t of the curve, whose domain is given; at a corner that
        of its far side."""
        for value in (t, t + domain[1] - domain[0]):
            for span in self.spans:
                if span.piece is not None and span.t[0] <= value < span.t[-1]:
                    return float(np.interp(value, span.t, span.x))
        return 0.0 if self.closed else 1.0

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Points and unit tangents (n, 3) at x (n,)."""
        points, tangents = np.empty((len(x), 3)), np.empty((len(x), 3))
        number = self.index(x)
        for k in np.unique(number):
            here = number == k
            span, turn = self.span(int(k))
            points[here], tangents[here] = span.at(x[here] - turn)
        return points, tangents


def blown_up(curve: Curve) -> Rail:
    """The rail of a curve.

    A closed curve with corners is taken from corner to corner, so that no piece ends at its seam.
    """
    pieces = _pieces(curve)
    looked = [_measured(piece) for piece in pieces]
    length = sum(float(steps.sum()) for _, steps, _, _, _ in looked)
    x, spans = 0.0, []
    for k, (t, steps, turns, points, tangents) in enumerate(looked):
        shares = 0.5 * steps / length + 0.25 * turns / np.pi
        grown = x + np.concatenate([[0.0], np.cumsum(shares)])
        x = float(grown[-1])
        none = np.zeros(3)
        spans.append(Span(grown, t, pieces[k], none, none, none, _straight(points)))
        if k == len(looked) - 1 and not curve.closed:
            continue
        after = looked[(k + 1) % len(looked)][4][0]
        angle = float(angles(tangents[-1:], after[None])[0])
        if angle > CORNER:
            corner = np.array([x, x + 0.25 * angle / np.pi])
            spans.append(Span(corner, corner, None, points[-1], tangents[-1], after))
            x = float(corner[-1])
    everything = np.concatenate([points for _, _, _, points, _ in looked])
    size = float(np.linalg.norm(np.ptp(everything, axis=0)))
    whole = tuple(replace(span, x=span.x / x) for span in spans)
    rail = Rail(whole, curve.closed, 0.0, size)
    return replace(rail, start=rail.coordinate(curve.domain[0], curve.domain))


def _pieces(curve: Curve) -> tuple[Curve, ...]:
    """The pieces between corners and jumps of the curvature; on a closed curve the last and the
    first are one unless there is such a place between them."""
    pieces = [part for piece in curve.pieces() for part in _parts(piece)]
    if not curve.closed or len(pieces) == 1 or not _smooth_seam(pieces[-1], pieces[0], 2):
        return tuple(pieces)
    return (*pieces[1:-1], _followed(pieces[-1], pieces[0]))


def _parts(piece: Curve) -> list[Curve]:
    """A piece cut where its curvature jumps: there a matching has a kink."""
    cuts = [t for t in piece.breaks if _curvature_jumps(piece, t)]
    ends = [piece.domain[0], *cuts, piece.domain[1]]
    return [_part(piece, low, high) for low, high in pairwise(ends)]


def _part(piece: Curve, low: float, high: float) -> Curve:
    """The piece over [low, high], answering at its ends for this side."""
    top = high if high == piece.domain[1] else float(np.nextafter(high, low))

    def jet(t: Array, order: int) -> Array:
        return piece.jet(np.clip(t, low, top), order)

    breaks = tuple(t for t in piece.breaks if low < t < high)
    whole = (low, high) == piece.domain
    return Curve(jet, (low, high), breaks, (), piece.closed and whole)


def _curvature_jumps(piece: Curve, t: float) -> bool:
    before, after = (
        piece.jet(np.array([s]), 2)[:, 0] for s in (np.nextafter(t, piece.domain[0]), t)
    )
    bent, then = (
        np.cross(jet[1], jet[2]) / float(np.linalg.norm(jet[1])) ** 3 for jet in (before, after)
    )
    size = max(float(np.linalg.norm(bent)), float(np.linalg.norm(then)))
    return bool(np.linalg.norm(bent - then) > SAME_JET * size)


def _followed(last: Curve, first: Curve) -> Curve:
    """The last piece of a closed curve and the first one behind it, as one."""
    seam = last.domain[1]
    move = seam - first.domain[0]

    def jet(t: Array, order: int) -> Array:
        late = t >= seam
        out = np.empty((order + 1, len(t), 3))
        out[:, ~late] = last.jet(t[~late], order)
        out[:, late] = first.jet(t[late] - move, order)
        return out

    breaks = (*last.breaks, seam, *(b + move for b in first.breaks))
    return Curve(jet, (last.domain[0], first.domain[1] + move), breaks)


def rooted(curve: Curve, t: float) -> Curve:
    """A closed smooth curve that starts at t instead; its seam is a break unless it is smooth."""
    low, high = curve.domain
    period = high - low
    if not low < t < high:
        return curve

    def jet(s: Array, order: int) -> Array:
        return curve.jet(np.where(s >= high, s - period, s), order)

    inner = [b for b in curve.breaks if b > t]
    again = [b + period for b in curve.breaks if b < t]
    seam = [] if _smooth_seam(curve, curve, SEAM_ORDER) else [high]
    return Curve(jet, (t, t + period), (*inner, *seam, *again), (), True)


def _smooth_seam(last: Curve, first: Curve, order: int) -> bool:
    """Whether the series at the end of one curve and the start of another are the same."""
    start, end = (
        first.jet(np.array(first.domain[:1]), order),
        last.jet(np.array(last.domain[1:]), order),
    )
    scale = (last.domain[1] - last.domain[0]) ** np.arange(order + 1)[:, None, None]
    size = np.maximum(np.abs(scale * start).max(axis=(1, 2)), np.abs(scale[1] * start[1]).max())
    return bool((np.abs(scale * (start - end)).max(axis=(1, 2)) <= SAME_JET * size).all())


def _measured(piece: Curve) -> tuple[Array, Array, Array, Array, Array]:
    """Parameters, steps of length, turnings, points and unit tangents along a piece."""
    knots = np.array([piece.domain[0], *piece.breaks, piece.domain[1]])
    runs = [np.linspace(a, b, PER_PIECE)[:-1] for a, b in pairwise(knots)]
    t = np.append(np.concatenate(runs), knots[-1])
    points, slopes = piece.jet(t, 1)
    tangents = slopes / np.linalg.norm(slopes, axis=1)[:, None]
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return t, steps, angles(tangents[:-1], tangents[1:]), points, tangents


def _straight(points: Array) -> bool:
    chord = points[-1] - points[0]
    away = np.linalg.norm(
        rows_cross(points - points[0], np.broadcast_to(chord, points.shape)), axis=1
    )
    return bool(away.max() <= STRAIGHT * float(chord @ chord))
