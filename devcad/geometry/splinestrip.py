"""The strip of rulings between two B-splines on one knot vector, rational or not."""

from __future__ import annotations

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.deflation import Deflated
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.splines import Spans, piecewise
from devcad.geometry.taylor import Array

VANISHES = 1e-9
"""A Taylor coefficient of the rulings at an end counts as zero below this share of the largest."""


def spline_strip(degree: int, knots: Array, low: Array, high: Array) -> Patch:
    """The patch between two rails: c0 = the low one, e towards the high one, v from 0 to it.

    ``low`` and ``high`` (n, 4) are homogeneous control points (x w, y w, z w, w) on the full knot
    vector ``knots`` (n + degree + 1,). Breaks are the inner knots; t is the knot parameter. Where
    the rails meet at an end of the domain, a tip, the ruling there is its limit. That the rails do
    not meet elsewhere is not checked.
    """
    rails = piecewise(knots, low, degree), piecewise(knots, high, degree)
    tips = _tips(rails, degree)

    def field(t: Array, order: int) -> RulingJet:
        start, end = (rail.jet(t, order) for rail in rails)
        way = _way(start, end)
        for tip in tips:
            near = tip.near(t)
            series = tip.series(t[near], order)
            way[: len(series), near], way[len(series) :, near] = series, 0.0
        c0, c1 = (taylor.div(rail[..., :3], rail[..., 3]) for rail in (start, end))
        e = taylor.unit(way)
        return RulingJet(c0, e, taylor.constant(0.0, order, t.size), taylor.dot(c1 - c0, e))

    distinct = rails[0].knots
    ends = float(distinct[0]), float(distinct[-1])
    return Patch(field, ends, tuple(distinct[1:-1].tolist()))


def _way(start: Array, end: Array) -> Array:
    """The series of a vector from rail to rail, scaled by both weights: a polynomial."""
    return taylor.mul(start[..., 3], end[..., :3]) - taylor.mul(end[..., 3], start[..., :3])


def _tips(rails: tuple[Spans, Spans], degree: int) -> tuple[Deflated, ...]:
    """The ends at which the rails meet, each with the way between them divided by the power of
    t - end with which it vanishes: on the first half of a span, where the way is a polynomial."""
    knots = rails[0].knots
    found = []
    for t, span, inward in (
        (knots[0], knots[1] - knots[0], 1.0),
        (knots[-1], knots[-1] - knots[-2], -1.0),
    ):
        at = np.array([t])
        way = _way(*(rail.jet(at, 2 * degree) for rail in rails))[:, 0]
        size = np.linalg.norm(way, axis=1) * span ** np.arange(len(way))
        power = int(np.argmax(size > VANISHES * size.max()))
        if power:
            found.append(Deflated(float(t), inward**power * way[power:], 0.5 * float(span)))
    return tuple(found)
