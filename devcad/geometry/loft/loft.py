"""The loft: a chain of patches between two rails, from their matching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.curve import Curve, samples
from devcad.geometry.loft.completion import SAME, completed
from devcad.geometry.loft.matching import Path, polished, search
from devcad.geometry.loft.pairing import Pairs, Strip, between, strip
from devcad.geometry.loft.pieces import Side, Stretch, stretches
from devcad.geometry.loft.rail import Rail, blown_up, rooted
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

SEEDS = 601
"""Rulings that the topology is read from: each piece is then solved for by itself."""
QUASI_DEGREE = 12
BISECTIONS = 60


@dataclass(frozen=True, slots=True)
class Lofted:
    """Patches from t = 0 to 1 (the share of the path), what each is, and the rails as matched."""

    patches: tuple[Patch, ...]
    parts: tuple[Stretch, ...]
    rails: tuple[Rail, Rail]
    path: Path
    closed: bool


def lofted(
    first: Curve,
    second: Curve,
    *,
    fans: bool = True,
    through: tuple[tuple[float, float], ...] = (),
    trim: bool = False,
) -> Lofted:
    """The loft between two curves: exact where a developable exists, else as near as it comes.

    ``through`` are rulings that it must contain, in order, by both parameters; ``trim`` leaves out
    the fans about the ends of open rails. The second of two closed rails is turned round where it
    runs against the first.
    """
    closed = first.closed and second.closed
    low, high = second.domain
    if closed and _opposed(first, second):
        second = reversed_curve(second)
        through = tuple((u, low + high - v) for u, v in through)
    a, b = blown_up(first), blown_up(second)
    kept = tuple(
        (a.coordinate(u, first.domain), b.coordinate(v, second.domain)) for u, v in through
    )
    rough = search(a, b, fans=fans, through=kept)
    if closed and len(b.spans) == 1 and not kept:
        start = b.spans[0].parameter(float(rough.v[0]) % 1.0)
        b = blown_up(rooted(second, start))
        rough = search(a, b, fans=fans)
    path = completed(a, b, polished(a, b, rough, SEEDS), rough, fans=fans)
    parts = stretches(a, b, path)
    if trim and not closed:
        parts = _trimmed(parts)
    ends = np.cumsum([0.0, *(part.share for part in parts)])
    ends = ends / ends[-1]
    patches = (_patch(p, *at) for p, at in zip(parts, pairwise(ends.tolist()), strict=True))
    return Lofted(tuple(patches), tuple(parts), (a, b), path, closed)


def _trimmed(parts: list[Stretch]) -> list[Stretch]:
    """The parts between the first and the last that is no fan; all, where all are fans."""
    solid = [k for k, part in enumerate(parts) if part.kind != "fan"]
    return parts[solid[0] : solid[-1] + 1] if solid else parts


def _opposed(first: Curve, second: Curve) -> bool:
    """Whether two closed curves go round in opposite senses."""
    return float(_area_vector(first) @ _area_vector(second)) < 0.0


def _area_vector(curve: Curve) -> Array:
    points = curve.point(samples(curve))
    points = points - points.mean(axis=0)
    return np.asarray(0.5 * np.cross(points[:-1], points[1:]).sum(axis=0))


def reversed_curve(curve: Curve) -> Curve:
    """The curve run from its end to its start."""
    low, high = curve.domain
    knots = np.array(sorted((low, *curve.breaks, *curve.corners, high)))
    turned = (low + high - knots)[::-1]
    tops = np.append(np.nextafter(knots[1:-1], -np.inf), knots[-1])

    def jet(t: Array, order: int) -> Array:
        # which piece answers is decided here: at a knot the one to the right, there to the left
        piece = np.searchsorted(turned[1:-1], t, side="right")
        own = len(knots) - 2 - piece
        s = np.clip(low + high - t, knots[own], tops[own])
        signs = (-1.0) ** np.arange(order + 1)[:, None, None]
        return np.asarray(signs * curve.jet(s, order))

    return Curve(
        jet,
        curve.domain,
        tuple(low + high - x for x in reversed(curve.breaks)),
        tuple(low + high - x for x in reversed(curve.corners)),
        curve.closed,
    )


def _patch(part: Stretch, low: float, high: float) -> Patch:
    """The patch of one stretch over low <= t <= high."""
    a, b = _curve(part.a), _curve(part.b)
    if part.kind in ("strip", "quasi"):
        rule = strip(a, b, (part.a.t0, part.b.t0), (part.a.t1, part.b.t1), part.seeds)
        rate = rule.length / (high - low)
        inner = _breaks(rule, a, b)
        pairs: Pairs = rule if part.kind == "strip" else _eased(rule)
        return between(
            a,
            b,
            _slowed(pairs, low, rate, rule.length),
            (low, high),
            tuple(low + x / rate for x in inner),
        )
    lines = [(side.t0, (side.t1 - side.t0) / (high - low)) for side in (part.a, part.b)]

    def linear(t: Array, order: int) -> tuple[Array, Array]:
        out = []
        for start, rate in lines:
            series = taylor.variable(t - low, order) * rate
            series[0] += start
            out.append(series)
        return out[0], out[1]

    inner = sorted(
        low + (x - side.t0) / rate
        for side, (_, rate) in zip((part.a, part.b), lines, strict=True)
        if side.curve is not None and not side.stands
        for x in side.curve.breaks
        if _inside(x, side.t0, side.t1)
    )
    return between(a, b, linear, (low, high), tuple(inner))


def _inside(x: float, start: float, end: float) -> bool:
    """Whether x lies between two parameters and is neither of them."""
    margin = SAME * abs(end - start)
    return min(start, end) + margin < x < max(start, end) - margin


def _curve(side: Side) -> Curve:
    """The moving curve, or the point at which a rail stands."""
    if side.curve is not None and not side.stands:
        return side.curve
    return Curve(lambda t, order: taylor.constant_vector(side.point, order, t.size), (0.0, 1.0))


def _slowed(pairs: Pairs, low: float, rate: float, length: float) -> Pairs:
    """The pairs against t = low + x / rate."""

    def of(t: Array, order: int) -> tuple[Array, Array]:
        s, r = pairs(np.clip((t - low) * rate, 0.0, length), order)
        powers = rate ** np.arange(order + 1)[:, None]
        return powers * s, powers * r

    return of


def _breaks(rule: Strip, a: Curve, b: Curve) -> list[float]:
    """The strip's parameters at which one of its curves passes a break, increasing."""
    out = []
    for k, curve in enumerate((a, b)):
        start, end = rule.starts[k], rule.ends[k]
        for x in curve.breaks:
            if not _inside(x, start, end):
                continue
            low, high = 0.0, rule.length
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                passed = (float(rule(np.array([middle]), 0)[k][0, 0]) - x) * (end - start) >= 0.0
                low, high = (low, middle) if passed else (middle, high)
            out.append(high)
    return sorted(out)


def _eased(rule: Strip) -> Callable[[Array, int], tuple[Array, Array]]:
    """Smooth pairs along a path on which no developable exists: a polynomial through its course."""
    x = 2.0 * rule.x / rule.length - 1.0
    ends = np.interp(x, [-1.0, 1.0], rule.d[[0, -1]])
    degree = min(QUASI_DEGREE, max(len(x) // 4, 1))
    basis = np.polynomial.chebyshev.chebvander(x, degree) * (1.0 - x**2)[:, None]
    weights = np.linalg.lstsq(basis, rule.d - ends, rcond=None)[0]
    bump = np.polynomial.chebyshev.chebmul(weights, [0.5, 0.0, -0.5])
    line = [0.5 * (rule.d[0] + rule.d[-1]), 0.5 * (rule.d[-1] - rule.d[0])]
    whole = np.polynomial.chebyshev.chebadd(line, bump)

    def of(s: Array, order: int) -> tuple[Array, Array]:
        d = np.zeros((order + 1, len(s)))
        here, series = 2.0 * s / rule.length - 1.0, whole
        for k in range(order + 1):
            d[k] = np.polynomial.chebyshev.chebval(here, series)
            series = np.polynomial.chebyshev.chebder(series) * (2.0 / rule.length / (k + 1))
        return rule.parameters(s, d)

    return of


@dataclass(frozen=True, slots=True)
class Fold:
    """A crease between two patches: its angle in degrees, its t, and whether a corner of a rail
    lies on its ruling and asks for it."""

    angle: float
    t: float
    asked: bool


def creases(made: Lofted) -> list[Fold]:
    """The joints between the patches at which the tangent plane turns."""
    count = len(made.parts)
    pairs = [(k, k + 1) for k in range(count - 1)]
    if made.closed:
        pairs.append((count - 1, 0))
    out = []
    for k, after in pairs:
        turn = float(after == 0) if made.closed else 0.0
        before, then = made.parts[k], made.parts[after]
        asked = _cornered(made.rails[0], before.u[1], then.u[0] + turn)
        asked = asked or _cornered(made.rails[1], before.v[1], then.v[0] + turn)
        out.append(
            Fold(_turn(made.patches[k], made.patches[after]), made.patches[after].domain[0], asked)
        )
    return out


def _cornered(rail: Rail, low: float, high: float) -> bool:
    """Whether a corner of the rail lies at or between two coordinates."""
    turns = np.arange(np.floor(low) - 1.0, np.floor(high) + 2.0) if rail.closed else np.zeros(1)
    return any(
        bool(((turns + span.x0 <= high + SAME) & (turns + span.x1 >= low - SAME)).any())
        for span in rail.spans
        if span.piece is None
    )


def _turn(before: Patch, after: Patch) -> float:
    """The angle in degrees between the tangent planes on either side of a joint."""
    n0 = before.frame([np.nextafter(before.domain[1], before.domain[0])]).n[0]
    n1 = after.frame([np.nextafter(after.domain[0], after.domain[1])]).n[0]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(n0, n1)), n0 @ n1)))
