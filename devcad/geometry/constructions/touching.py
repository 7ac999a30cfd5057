"""Curves on a freeform surface, and how strips along them lie to it and to one another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.curve import Curve, ends_meet
from devcad.geometry.freeform import Freeform, Mask, feet
from devcad.geometry.jets import Expression
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

CROSSINGS = 2049
"""Parameters between which a curve crosses a knot line at most once."""
EDGE = 257
"""Points looked at on an edge."""
ACROSS = 9
"""Heights looked at on a ruling."""
ALONG = 65
"""Rulings looked at on a smooth part of a strip."""
SETTLED = 1e-12
"""A step, as a share of the domain, that ends Newton's method: its square is below rounding."""
OUTSIDE = 1e-12
"""Rounding by which a curve may leave the domain of a surface, as a share of the domain."""


@dataclass(frozen=True, slots=True)
class Track:
    """A curve (u(t), v(t)) on a surface; its breaks are where it crosses a knot line.

    Between two breaks it lies next to ``places`` (2, number of breaks + 1), which say on which
    side of every knot line it is: rounding shall not.
    """

    surface: Freeform
    u: Expression
    v: Expression
    domain: tuple[float, float]
    breaks: tuple[float, ...]
    places: Array

    @property
    def base(self) -> Curve:
        """The curve in space."""
        curve = Curve(lambda t, k: self.points(taylor.variable(t, k)), self.domain, self.breaks)
        return replace(curve, closed=ends_meet(curve))

    def points(self, t: Array) -> Array:
        """The series of the points at the series of t, (K + 1, n, 3)."""
        return self.surface.sheet(*self._parameters(t), self._place(t))

    def partials(self, t: Array) -> tuple[Array, Array]:
        """The series of S_u and S_v at the series of t, (K + 1, n, 3)."""
        return self.surface.partials(*self._parameters(t), self._place(t))

    def planes(self, t: Array) -> Array:
        """The series of the tangent planes (n, d) at the series of t, (K + 1, n, 4)."""
        n = taylor.cross(*self.partials(t))
        return np.concatenate([n, taylor.dot(n, self.points(t))[..., None]], axis=-1)

    def start(self, t: Array) -> Array:
        """The parameters (2, n) at t."""
        return np.concatenate(self._parameters(t[None]))

    def _parameters(self, t: Array) -> tuple[Array, Array]:
        return self.u.series(t=t), self.v.series(t=t)

    def _place(self, t: Array) -> Array:
        return self.places[:, np.searchsorted(self.breaks, t[0], side="right")]


def track(
    surface: Freeform,
    parameters: tuple[Expression, Expression],
    domain: tuple[float, float],
    name: str,
) -> Track:
    """The curve on the surface, with the places where it crosses a knot line found.

    Raises:
        JobError: u or v is not a number, or the curve leaves the surface's domain.
    """
    t = np.linspace(*domain, CROSSINGS)
    seen = np.stack([part.at(t, 0)[0] for part in parameters])
    if not np.isfinite(seen).all():
        at = t[int(np.argmin(np.isfinite(seen).all(axis=0)))]
        raise JobError(
            f"{name}: u or v is not a finite number at t = {at:.6g}",
            value=float(at),
            remedy="keep t inside the range where the expressions have values",
        )
    if surface.box is not None:
        _require_inside(surface.box, t, seen, name)
    found = [
        _crossing(part, knot, (t[k], t[k + 1]))
        for part, row, knots in zip(parameters, seen, surface.knots, strict=True)
        for knot in knots
        for k in np.flatnonzero((row[:-1] < knot) != (row[1:] < knot))
    ]
    width = 1e-12 * (domain[1] - domain[0])
    inner = sorted({x for x in found if domain[0] + width < x < domain[1] - width})
    breaks = [x for x, before in zip(inner, [-np.inf, *inner], strict=False) if x - before > width]
    ends = np.array([domain[0], *breaks, domain[1]])
    middles = 0.5 * (ends[1:] + ends[:-1])
    places = np.stack([part.at(middles, 0)[0] for part in parameters])
    return Track(surface, *parameters, domain, tuple(breaks), places)


def _require_inside(
    box: tuple[tuple[float, float], tuple[float, float]], t: Array, seen: Array, name: str
) -> None:
    for letter, row, (low, high) in zip("uv", seen, box, strict=True):
        out = np.maximum(low - row, row - high)
        worst = int(np.argmax(out))
        if out[worst] > OUTSIDE * (high - low):
            raise JobError(
                f"{name}: {letter} = {row[worst]:.6g} at t = {t[worst]:.6g} is outside the "
                f"surface, which has {letter} from {low:.6g} to {high:.6g}",
                value=float(row[worst]),
                limit=low if row[worst] < low else high,
                remedy="keep the curve on the surface",
            )


def _crossing(part: Expression, knot: float, bracket: tuple[float, float]) -> float:
    """Where an expression in t passes a knot, to rounding."""
    low, high = bracket
    side = part.at([low], 0)[0, 0] < knot
    while low < (middle := 0.5 * (low + high)) < high:
        if (part.at([middle], 0)[0, 0] < knot) == side:
            low = middle
        else:
            high = middle
    return float(high)


def distance_to_base(surface: Freeform, path: Track, patches: tuple[Patch, ...]) -> float:
    """The largest distance of a strip from its surface, sampled.

    Points beyond the edge of the surface do not count, unless no others are left.
    """
    seen = []
    for patch in patches:
        for low, high in zip(patch.segments[:-1], patch.segments[1:], strict=True):
            t = np.linspace(low, high, ALONG)
            jet = patch.jet(t, 0)
            share = np.linspace(0.0, 1.0, ACROSS)[:, None]
            v = (1.0 - share) * jet.v_from[0] + share * jet.v_to[0]  # (heights, rulings)
            points = jet.c0[0] + v[..., None] * jet.e[0]
            seen.append(_away(surface, points, path.start(t)))
    distance, beyond = (np.concatenate(parts) for parts in zip(*seen, strict=True))
    return _largest(distance, beyond)


def _largest(distance: Array, beyond: Mask) -> float:
    """The largest distance of those that count."""
    return float((distance if beyond.all() else distance[~beyond]).max())


def _away(surface: Freeform, points: Array, start: Array) -> tuple[Array, Mask]:
    """The distances of points (heights, rulings, 3) from the surface, in one row, and whether
    they lie beyond its edge.

    Newton's method starts at the ruling's own point of the surface; where it ends in a saddle of
    the distance, as at a pole, once more from where the nearest other ruling arrived.
    """
    shape = points.shape[:2]
    first = feet(surface, points.reshape(-1, 3), np.tile(start, (1, shape[0])))
    least, where = first.least.reshape(shape), first.where.reshape(2, *shape)
    if least.all() or not least.any():
        return first.distance, first.beyond
    h, r = np.nonzero(~least)
    nearest = np.abs(np.arange(shape[1]) - r[:, None]) + np.where(least[h], 0, shape[1])
    again = feet(surface, points[h, r], where[:, h, np.argmin(nearest, axis=1)])
    distance = first.distance.reshape(shape)
    distance[h, r] = np.minimum(distance[h, r], again.distance)
    return distance.ravel(), first.beyond


def gaps(strip: tuple[Patch, ...], following: tuple[Patch, ...]) -> float:
    """The largest distance, either way, between the facing edges of two strips, sampled.

    Facing are the two edges, base or top of each, that are nearest to one another on average.
    Points beyond the ends of the other edge do not count, unless no others are left.
    """
    edges = [[_points(patches, edge) for edge in (0, 1)] for patches in (strip, following)]
    apart = [_least(x, y).mean() + _least(y, x).mean() for x in edges[0] for y in edges[1]]
    one, other = divmod(int(np.argmin(apart)), 2)
    there = _nearest(edges[0][one], following, other)
    back = _nearest(edges[1][other], strip, one)
    distance, beyond = (np.concatenate(pair) for pair in zip(there, back, strict=True))
    return _largest(distance, beyond)


def _points(patches: tuple[Patch, ...], edge: int) -> Array:
    """Points (n, 3) of an edge of a strip."""
    return np.concatenate([_edge(p, edge, _even(p), 0)[0] for p in patches])


def _least(points: Array, others: Array) -> Array:
    """The distance of each point from the nearest of the others."""
    return np.asarray(np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1))


def _even(patch: Patch) -> Array:
    return np.linspace(*patch.domain, EDGE)


def _edge(patch: Patch, edge: int, t: Array, order: int) -> Array:
    """The series of the edge v = v_from (0) or v_to (1)."""
    jet = patch.jet(t, order)
    return np.asarray(jet.rail(jet.v_to if edge else jet.v_from))


def _nearest(points: Array, patches: tuple[Patch, ...], edge: int) -> tuple[Array, Mask]:
    """The distances of points (n, 3) from an edge of a strip, and which lie beyond its ends."""
    found = [_nearest_on(points, patch, edge) for patch in patches]
    distance = np.min([least for least, _ in found], axis=0)
    first, last = found[0], found[-1]
    before = (first[0] == distance) & (first[1] < 0)
    after = (last[0] == distance) & (last[1] > 0)
    return distance, before | after


def _nearest_on(points: Array, patch: Patch, edge: int) -> tuple[Array, Array]:
    """The distances of points (n, 3) from an edge of one patch, and which lie before its start
    (-1) or after its end (1): the best of its samples, and from there Newton's method."""
    samples = _even(patch)
    away = np.linalg.norm(points[:, None] - _edge(patch, edge, samples, 0)[0], axis=2)
    t, least = samples[np.argmin(away, axis=1)], away.min(axis=1)
    for _ in range(8):
        jet = _edge(patch, edge, t, 2)
        apart = jet[0] - points
        least = np.minimum(least, np.linalg.norm(apart, axis=1))
        slope = taylor.rows_dot(apart, jet[1])
        bend = taylor.rows_dot(jet[1], jet[1]) + 2.0 * taylor.rows_dot(apart, jet[2])
        with np.errstate(all="ignore"):
            step = np.nan_to_num(np.where(bend > 0.0, -slope / bend, 0.0))
        low, high = patch.domain
        beyond = np.where((t <= low) & (slope > 0.0), -1.0, 0.0)
        beyond += np.where((t >= high) & (slope < 0.0), 1.0, 0.0)
        if not (np.abs(step) > SETTLED * (high - low)).any():
            break
        t = np.clip(t + step, low, high)
    return least, beyond
