"""Twist, regression curve, clearance, singular points and curvature of a patch.

All of it follows from the six functions: a patch is singular where v = -q/a, its sheet at
distance d along the normal where q + v a - d c = 0, and its curvature is c / (q + v a).
Source: geometry.md, 0 and 12; algorithms.md, 1 (the signed warp).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.classify import ASIDE, EXACT, Shape, kept_aside, sample_parameters
from devcad.geometry.deflation import vanishing
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array, rows_cross, rows_dot

INSIDE = 1e-3
"""Where P_t x e vanishes at an end, the twist is read at this share of the extent inside."""
STRAIGHT = 1e-14
"""A ruling that turns by less than this share of the width across it does not turn."""
JUMP = 1e-3
"""A sign that changes while the value stays above this share of those around it jumps."""
SIDE = 1e-9
"""Share of the domain beside a jump of n at which its two sides are looked at."""
CROSSED = 1e-6
"""An end this share of the width beyond the regression curve is so by more than rounding."""
PER_PANEL = 65
"""Samples of a panel in the search for a worst place."""


@dataclass(frozen=True, slots=True)
class Extreme:
    """The worst ``value`` of a quantity over a patch and where it is."""

    value: float
    t: float
    v: float


@dataclass(frozen=True, slots=True)
class Singularity:
    """A singular point at parameter t: cuspidal-edge, swallowtail, cuspidal-crosscap or apex."""

    t: float
    point: Array
    type: str


@dataclass(frozen=True, slots=True)
class Clearance:
    """How a sheet stands to its regression curve.

    ``value`` is the smallest distance in mm along a ruling from the sheet (all its layers) to
    where that layer becomes singular (on a cylinder: along the normal, to its centre of
    curvature, when that is crossed): negative when it is crossed, 0 when touched, inf when
    there is no regression curve. ``t``, ``v`` say where; ``touches`` that an end of the extent
    lies on the regression curve of the reference surface, and nothing is crossed. A value of 0
    that does not touch is a ruling that is singular all along, or where the front turns over.
    """

    value: float
    t: float
    v: float
    touches: bool


def warp(patch: Patch, t: Array) -> Array:
    """The angle in radians, (n,), by which the tangent plane turns along each ruling.

    From c0 and e alone, between the ends of the extent. On a developable it is 0, or +-pi where
    the extent crosses the regression curve; the half turn is taken off here (``clearance`` tells
    it), so that only the failure to be developable is left.
    """
    jet = patch.jet(t, 1)
    still, moving = rows_cross(jet.e[0], jet.c0[1]), rows_cross(jet.e[0], jet.e[1])
    v_from, v_to = jet.v_from[0], jet.v_to[0]
    inset = INSIDE * (v_to - v_from)
    normals = []
    scale = np.linalg.norm(still + (0.5 * (v_from + v_to))[:, None] * moving, axis=1)
    for v, inner in ((v_from, v_from + inset), (v_to, v_to - inset)):
        at = still + v[:, None] * moving
        vanishes = np.linalg.norm(at, axis=1) <= EXACT * scale
        normals.append(np.where(vanishes[:, None], still + inner[:, None] * moving, at))
    # at a tip the whole ruling has no tangent plane: what is read there is rounding
    size = np.linalg.norm(jet.c0[1], axis=1) + (np.abs(v_from) + np.abs(v_to)) * np.linalg.norm(
        jet.e[1], axis=1
    )
    normals[0] = np.where((scale <= EXACT * size)[:, None], normals[1], normals[0])
    turn = np.arctan2(rows_dot(jet.e[0], rows_cross(*normals)), rows_dot(normals[0], normals[1]))
    return np.where(np.abs(turn) > 0.5 * np.pi, turn - np.copysign(np.pi, turn), turn)


def twist(patch: Patch) -> Extreme:
    """The largest turn of the tangent plane along a ruling, in radians, and its place."""
    value, t = largest(patch, lambda s: np.abs(warp(patch, s)))
    return Extreme(value, t, float(patch.jet([t], 0).v_to[0][0]))


def clearance(patch: Patch, layers: tuple[float, ...], *, to_apex: bool = False) -> Clearance:
    """How far the patch's layers at the given distances along n stay from being singular.

    With ``to_apex`` the extent begins or ends at an apex: each layer ends by itself where it
    becomes singular, so only the other end counts.
    """
    singular = _singular_ruling(patch)
    if singular is not None:
        v = float(patch.jet([singular], 0).v_from[0][0])
        return Clearance(-np.inf, singular, v, touches=False)
    turned = _turnover(patch)
    if turned is not None:
        return Clearance(0.0, turned, float(patch.jet([turned], 0).v_from[0][0]), touches=False)

    def badness(t: Array) -> Array:
        frame = patch.frame(t)
        ends = np.stack([frame.v_from, frame.v_to])  # (2, n)
        width = frame.q + ends * frame.a
        scale = np.abs(frame.q) + np.abs(ends * frame.a).max(axis=0)
        width = np.where(np.abs(width) <= EXACT * scale, 0.0, width)
        if to_apex:
            width = width.max(axis=0, keepdims=True)
        layered = np.stack([width - d * frame.c for d in layers])  # (layers, ends, n)
        low = layered.min(axis=(0, 1))
        low = np.where(np.abs(low) <= EXACT * scale, 0.0, low)
        # a ruling whose direction does not turn has its regression point at infinity
        turns = np.abs(ends * frame.a).max(axis=0) > STRAIGHT * scale
        # where the ruling does not turn, only the bending can make a layer singular: then the
        # distance is how far the layer's centre of curvature is from it
        with np.errstate(all="ignore"):
            bends = np.where(low > 0.0, np.inf, low / np.abs(frame.c))
            distance = np.where(turns, low / np.abs(frame.a), bends)
        distance = np.where(low == 0.0, 0.0, distance)
        distance = np.where(np.isnan(low), -np.inf, distance)
        return np.asarray(-np.clip(distance, -1e300, 1e300))

    value, t = largest(patch, badness)
    distance = -value if abs(value) < 1e300 else -np.sign(value) * np.inf
    frame = patch.frame(kept_aside(patch, np.array([t])))
    v = float(frame.v_from[0])
    other = float(frame.q[0] + max(frame.v_from[0] * frame.a[0], frame.v_to[0] * frame.a[0]))
    return Clearance(float(distance), t, v, touches=distance == 0.0 and other > 0.0)


def _singular_ruling(patch: Patch) -> float | None:
    """An end of the domain whose ruling is singular all along and not the point of a tip."""
    low, high = patch.domain
    for t, singular in zip((low, high), vanishing(patch.field, low, high), strict=True):
        jet = patch.jet([t, *np.linspace(low, high, 9)[1:-1]], 0)
        length = jet.v_to[0] - jet.v_from[0]
        if singular and length[0] > EXACT * length.max():
            return t
    return None


def _turnover(patch: Patch) -> float | None:
    """A parameter where the normal turns faster than the patch bends: the front turns over.

    Not where the regression curve only passes the place in the extent at which n is read: there
    an end of the extent lies clearly beyond it.
    """
    t = sample_parameters(patch, PER_PANEL)
    frame = patch.frame(t)
    step = np.diff(t)
    bending = 0.5 * (np.abs(frame.c[1:]) + np.abs(frame.c[:-1])) * step
    cosine = np.clip(rows_dot(frame.n[1:], frame.n[:-1]), -1.0, 1.0)
    jump = np.flatnonzero(np.arccos(cosine) > 1.0 + 2.0 * bending)
    if not len(jump):
        return None
    low, high, before = float(t[jump[0]]), float(t[jump[0] + 1]), frame.n[jump[0]]
    for _ in range(40):
        middle = 0.5 * (low + high)
        same = bool(patch.frame([middle]).n[0] @ before > 0.0)
        low, high = (middle, high) if same else (low, middle)
    aside = SIDE * (patch.domain[1] - patch.domain[0])
    beside = patch.frame(np.clip([low - aside, high + aside], *patch.domain))
    ends = np.stack([beside.v_from, beside.v_to]) * beside.a
    crossed = (beside.q + ends < -CROSSED * (np.abs(beside.q) + np.abs(ends).max(axis=0))).any()
    return None if crossed else 0.5 * (low + high)


def smallest_radius(patch: Patch) -> Extreme:
    """The smallest radius of curvature of the middle surface in mm; inf on a plane, which is also
    what turns by less than a billionth: where its rulings meet, rounding alone would bend it."""
    low, high = patch.domain
    turn = np.abs(patch.frame(sample_parameters(patch, PER_PANEL)).c).max() * (high - low)
    if turn <= EXACT:
        middle = 0.5 * (low + high)
        return Extreme(float("inf"), middle, float(patch.frame([middle]).v_from[0]))

    def tightness(t: Array) -> Array:
        frame = patch.frame(t)
        width = np.minimum(frame.q + frame.v_from * frame.a, frame.q + frame.v_to * frame.a)
        with np.errstate(divide="ignore", invalid="ignore"):
            tight = np.abs(frame.c) / np.maximum(width, 0.0)
        return np.nan_to_num(tight, nan=0.0, posinf=1e300)

    value, t = largest(patch, tightness)
    frame = patch.frame([t])
    at_from = float(frame.q[0] + frame.v_from[0] * frame.a[0])
    at_to = float(frame.q[0] + frame.v_to[0] * frame.a[0])
    v = float(frame.v_from[0] if at_from <= at_to else frame.v_to[0])
    if value >= 1e300:
        return Extreme(0.0, t, v)
    size = abs(at_from) + abs(at_to)
    return Extreme(1.0 / value if value * size > 1e-12 else float("inf"), t, v)


def regression_curve(patch: Patch, number: int = 65) -> tuple[Array, Array] | None:
    """Parameters and points (k, 3) of the curve v = -q/a; None where a vanishes throughout."""
    t = np.linspace(*patch.domain, number)
    t[0], t[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
    frame = patch.frame(kept_aside(patch, t))
    reach = np.abs(frame.v_from) + np.abs(frame.v_to)
    there = np.abs(frame.a) * reach > 1e-6 * (np.abs(frame.q) + np.abs(frame.a) * reach)
    if not there.any():
        return None
    v = -frame.q[there] / frame.a[there]
    t[0], t[-1] = patch.domain
    return t[there], frame.c0[there] + v[:, None] * frame.e[there]


def singularities(patch: Patch, shape: Shape) -> tuple[Singularity, ...]:
    """The singular points by type: an apex, or the cuspidal edge with its special points.

    A tangent surface gives one cuspidal-edge entry, where the regression curve comes nearest,
    then every swallowtail (delta = 0) and cuspidal crosscap (c = 0). Source: geometry.md, 0.3.
    """
    if shape.type == "cone" and shape.point is not None:
        return (Singularity(patch.domain[0], shape.point, "apex"),)
    if shape.type != "tangent":
        return ()
    t = sample_parameters(patch, PER_PANEL)
    found = [_nearest_edge_point(patch, t)]
    for kind, function in (("swallowtail", _swallow), ("cuspidal-crosscap", _crosscap)):
        for root in _roots(patch, t, function):
            point = _edge_point(patch, root)
            if point is not None:
                found.append(Singularity(root, point, kind))
    return tuple(s for s in found if s is not None)


def largest(patch: Patch, function: Callable[[Array], Array]) -> tuple[float, float]:
    """The largest value of a function of t over the patch, and where.

    Sampled at 65 points of every panel, then refined around the best one: the true maximum of
    anything that has no finer structure than the rails.
    """
    t = sample_parameters(patch, PER_PANEL)
    values = function(t)
    value, place = -np.inf, float(t[0])
    for _ in range(6):
        best = int(np.argmax(values))
        if not values[best] > value:
            break
        value, place = float(values[best]), float(t[best])
        low, high = t[max(best - 1, 0)], t[min(best + 1, len(t) - 1)]
        t = np.linspace(low, high, 17)
        values = function(t)
    return value, _snapped(patch, place)


def _snapped(patch: Patch, t: float) -> float:
    """The domain's end where t is as near to it as samples come."""
    low, high = patch.domain
    width = 1.001 * ASIDE * (high - low)
    return low if t - low < width else high if high - t < width else t


def _swallow(patch: Patch, t: Array) -> Array:
    """delta a^2 = p a^2 - (q' a - q a'), whose sign changes at swallowtails."""
    jet = patch.frame_jet(t, 1)
    slope_q, slope_a = taylor.derivative(jet.q)[0], taylor.derivative(jet.a)[0]
    return np.asarray(jet.p[0] * jet.a[0] ** 2 - slope_q * jet.a[0] + jet.q[0] * slope_a)


def _crosscap(patch: Patch, t: Array) -> Array:
    """c, whose sign changes at cuspidal crosscaps."""
    return patch.frame(t).c


def _roots(patch: Patch, t: Array, function: Callable[[Patch, Array], Array]) -> list[float]:
    """The zeros at which a function changes its sign between samples, each by bisection.

    Where a break lets it jump from one sign to the other there is no zero.
    """
    values = function(patch, t)
    noise = 1e-11 * np.nanmax(np.abs(values), initial=0.0)
    sign = np.where(np.abs(values) <= noise, 0.0, np.sign(values))
    kept = np.flatnonzero(sign)
    change = np.flatnonzero(sign[kept[:-1]] * sign[kept[1:]] < 0.0)
    low, high = t[kept[change]], t[kept[change + 1]]
    low_sign = sign[kept[change]]
    for _ in range(52):
        middle = 0.5 * (low + high)
        if not len(middle):
            break
        same = np.sign(function(patch, middle)) == low_sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    root = 0.5 * (low + high)
    if not len(root):
        return []
    around = np.minimum(np.abs(values[kept[change]]), np.abs(values[kept[change + 1]]))
    vanishes = np.abs(function(patch, root)) <= JUMP * around
    return [float(x) for x in root[vanishes]]


def _edge_point(patch: Patch, t: float) -> Array | None:
    """The point of the regression curve at t, None where it lies at infinity."""
    frame = patch.frame([t])
    a, q = float(frame.a[0]), float(frame.q[0])
    reach = abs(float(frame.v_from[0])) + abs(float(frame.v_to[0]))
    if abs(a) * reach <= 1e-9 * abs(q):
        return None
    return np.asarray(frame.c0[0] - (q / a) * frame.e[0])


def _nearest_edge_point(patch: Patch, t: Array) -> Singularity | None:
    """The cuspidal edge where it comes nearest to the extent."""
    frame = patch.frame(t)
    with np.errstate(all="ignore"):
        v = -frame.q / frame.a
        gap = np.maximum(np.maximum(frame.v_from - v, v - frame.v_to), 0.0)
    best = int(np.nanargmin(np.where(np.isfinite(gap), gap, np.inf)))
    point = _edge_point(patch, float(t[best]))
    if point is None:
        return None
    return Singularity(_snapped(patch, float(t[best])), point, "cuspidal-edge")
