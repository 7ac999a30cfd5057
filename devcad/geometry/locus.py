"""Pseudo-antipodal points: where the line from a point C through a fixed A meets a shape again.

Source: geometry.md, section 5 (Yang; the meaning of s is reconstructed, both are offered).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.curve import COINCIDENT, SAME_DIRECTION, Curve, ends_meet, samples, size, turns
from devcad.geometry.jets import Expression, shown
from devcad.geometry.secants import Secant, SurfaceSecant, curve_secant, slope, value
from devcad.geometry.taylor import Array

TRACKED = 256
"""Parameters along the curve at which the second intersection is found from nothing."""
BISECTIONS = 60
"""Halvings of a bracket: more than the 53 bits of its ends."""
NEWTON = 60
"""Newton's iterations; from the neighbouring places a handful does."""
SETTLED = 4e-16
"""A step, against the root, that is rounding."""


@dataclass(frozen=True, slots=True)
class _Root:
    """The root u(t), continuous: known at ``t`` (n,) as ``u``, found between by Newton."""

    secant: Secant
    t: Array
    u: Array

    def at(self, t: Array) -> Array:
        """u at t (n,)."""
        u, moving = np.interp(t, self.t, self.u), np.arange(len(t))
        for _ in range(NEWTON):  # each point for itself: no other's company changes it
            where, place = t[moving], u[moving]
            with np.errstate(all="ignore"):
                step = self.secant.residual(where, place[None])[0] / self.secant.slope(where, place)
            step = np.where(np.isfinite(step), step, 0.0)
            u[moving] = place - step
            moving = moving[np.abs(step) > SETTLED * (1.0 + np.abs(place))]
            if not moving.size:
                break
        return u

    def series(self, t: Array, order: int, start: Array | None = None) -> Array:
        """The series (order + 1, n) of u, one coefficient after the other; ``start`` are its
        values where they are known."""
        u = np.zeros((order + 1, len(t)))
        u[0] = self.at(t) if start is None else start
        rate = self.secant.slope(t, u[0])
        for k in range(1, order + 1):
            with np.errstate(all="ignore"):
                u[k] = -self.secant.residual(t, u[: k + 1])[k] / rate
        return u


def on_surface(f: Expression, curve: Curve, point: Array) -> Curve:
    """The second intersections D(t) of the lines from C(t) = curve through A with f = 0.

    Of several the first beyond A, or else the nearest to C; from there on the continuous one.

    Raises:
        JobError: f has no value on the curve; GeometryError: the curve is not on the surface, A
        is on it, or a line meets it in no second point.
    """
    t = samples(curve, TRACKED)
    extent = _size(curve, point)
    _require_on(f, curve, t, extent)
    if _off(f, point[None])[0] <= COINCIDENT * extent:
        raise _on_it("the surface")
    root = _tracked(SurfaceSecant(f, curve, point), curve, point, extent, "the surface")

    def jet(s: Array, order: int) -> Array:
        return root.secant.point(s, root.series(s, order))

    return replace(curve, jet=jet)


def on_curve(curve: Curve, point: Array) -> Curve:
    """The second intersections D(t) of the lines from C(t) through A with the curve itself.

    Breaks and corners are its own and where D passes one.

    Raises:
        GeometryError: A is on the curve, or a line meets it in no second point.
    """
    extent = _size(curve, point)
    secant = curve_secant(curve, point, extent)
    root = _tracked(secant, curve, point, extent, "the curve")
    low, high = curve.domain
    inner = sorted({*curve.breaks, *curve.corners, *_passes(root, secant.period, secant.marks)})
    ends = np.array([low, *inner, high])
    middles = secant.inside(root.at(0.5 * (ends[1:] + ends[:-1])))

    def jet(t: Array, order: int) -> Array:
        stretch = np.searchsorted(inner, t, side="right")
        place = secant.beside(root.at(t), middles[stretch])
        return secant.point(t, root.series(t, order, place))

    return Curve(jet, curve.domain, breaks=tuple(inner))


def blended(curve: Curve, other: Curve, share: Expression) -> Curve:
    """The points share C + (1 - share) D of two curves over one domain."""

    def jet(t: Array, order: int) -> Array:
        c, d = curve.jet(t, order), other.jet(t, order)
        return d + taylor.mul(share.at(t, order), c - d)

    low, high = curve.domain
    marks = np.array(sorted({*curve.breaks, *curve.corners, *other.breaks, *other.corners}))
    made = Curve(jet, curve.domain)
    turned = turns(made, marks) > SAME_DIRECTION if marks.size else np.zeros(0, dtype=bool)
    made = replace(
        made, breaks=tuple(marks[~turned].tolist()), corners=tuple(marks[turned].tolist())
    )
    points = made.point(samples(made))
    if not np.isfinite(points).all():
        raise JobError(
            f"s = {shown(share.text)} has no finite value everywhere between t = {low:.6g} "
            f"and {high:.6g}",
            remedy="change the expression or the interval t",
        )
    return replace(made, closed=ends_meet(made))


def _size(curve: Curve, point: Array) -> float:
    return size(np.concatenate([curve.point(samples(curve)), point[None]]))


def _off(f: Expression, points: Array) -> Array:
    """The distances (n,) of points (n, 3) from f = 0, to first order."""
    x = points[None]
    axes = [np.broadcast_to(axis, x.shape) for axis in np.eye(3)]
    gradient = np.stack([slope(f, x, axis)[0] for axis in axes], axis=1)
    with np.errstate(all="ignore"):
        return np.asarray(np.abs(value(f, x)[0]) / np.linalg.norm(gradient, axis=1))


def _require_on(f: Expression, curve: Curve, t: Array, extent: float) -> None:
    """Raise where the curve is not on the surface, or the surface has no tangent plane."""
    off = _off(f, curve.point(t))
    worst = int(np.argmax(np.nan_to_num(off, nan=np.inf)))
    at, value_there = float(t[worst]), float(off[worst])
    if not np.isfinite(value_there):
        raise JobError(
            f"on: {shown(f.text)} has no value or no gradient on the curve at t = {at:.6g}",
            value=at,
            remedy="write the surface as f = 0 with a gradient that does not vanish on it",
        )
    if value_there > COINCIDENT * extent:
        raise GeometryError(
            f"curve: at t = {at:.6g} it is {value_there:.3g} away from the surface f = 0",
            value=value_there,
            limit=COINCIDENT * extent,
            remedy="give a curve that lies on the surface",
        )


def _on_it(shape: str) -> GeometryError:
    return GeometryError(
        f"point: it lies on {shape}, so that every line meets it there",
        value=0.0,
        remedy=f"move the point off {shape}",
    )


def _tracked(secant: Secant, curve: Curve, point: Array, extent: float, shape: str) -> _Root:
    """The root along the whole curve.

    Raises:
        GeometryError: A is on the shape, or there is none at some t.
    """
    t = samples(curve, TRACKED)
    if np.linalg.norm(curve.point(t) - point, axis=1).min() <= COINCIDENT * extent:
        raise _on_it(shape)
    owner, found = _roots(secant, t)
    u = np.zeros(len(t))
    last: Array | None = None
    for k, at in enumerate(t):
        here = found[owner == k]
        way = secant.way(np.full(len(here), at), here)
        here, way = here[np.isfinite(way)], way[np.isfinite(way)]
        if not len(here):
            raise GeometryError(
                f"point: the line from the curve at t = {at:.6g} through A meets {shape} in no "
                "second point",
                value=float(at),
                remedy="move the point inside, or end the curve before that place",
            )
        places = secant.point(np.full(len(here), at), here[None])[0]
        if last is None:
            beyond = np.where(way > 1.0, way - np.abs(way).max() - 2.0, np.abs(way))
            chosen = int(np.argmin(beyond))
            if np.linalg.norm(places[chosen] - point) <= COINCIDENT * extent:
                raise _on_it(shape)
            u[k] = here[chosen]
        else:
            chosen = int(np.argmin(np.linalg.norm(places - last, axis=1)))
            u[k] = secant.nearest(here[chosen : chosen + 1], u[k - 1])[0]
        last = places[chosen]
    root = _Root(secant, t, u)
    _require_between(root, extent, shape)
    return root


def _roots(secant: Secant, t: Array) -> tuple[Array, Array]:
    """The roots at all t: which t they belong to, and their u, by signs and bisection."""
    looks = secant.looks(t)  # (m, n)
    everywhere = np.broadcast_to(t, looks.shape).ravel()
    values = secant.residual(everywhere, looks.reshape(1, -1))[0].reshape(looks.shape)
    below = values < 0.0
    known = np.isfinite(values)
    k, owner = np.nonzero((below[:-1] != below[1:]) & known[:-1] & known[1:])
    low, high, side = looks[k, owner], looks[k + 1, owner], below[k, owner]
    largest = np.maximum(np.abs(values[k, owner]), np.abs(values[k + 1, owner]))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        same = (secant.residual(t[owner], middle[None])[0] < 0.0) == side
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    at_root = np.abs(secant.residual(t[owner], low[None])[0])
    real = at_root <= largest  # and no pole
    return owner[real], low[real]


def _require_between(root: _Root, extent: float, shape: str) -> None:
    """Raise a GeometryError where the root is not continuous between the parameters known."""
    middle = 0.5 * (root.t[1:] + root.t[:-1])
    u = root.at(middle)
    here = root.secant.point(middle, u[None])[0]
    left, right = (
        root.secant.point(root.t, root.u[None])[0][k] for k in (slice(-1), slice(1, None))
    )
    room = np.linalg.norm(right - left, axis=1) + 1e-3 * extent
    away = np.linalg.norm(here - 0.5 * (left + right), axis=1)
    lost = ~((away <= room) & np.isfinite(root.secant.way(middle, u)))
    if lost.any():
        at = float(middle[int(np.argmax(lost))])
        raise GeometryError(
            f"point: the second intersection with {shape} is lost near t = {at:.6g}",
            value=at,
            remedy="move the point away from the boundary, or end the curve before that place",
        )


def _passes(root: _Root, period: float, marks: tuple[float, ...]) -> list[float]:
    """The parameters inside at which u passes a mark of the curve, by bisection."""
    every = list(marks)
    if period:
        rounds = np.arange(
            np.floor((root.u.min() - max(marks, default=0.0)) / period),
            np.ceil((root.u.max() - min(marks, default=0.0)) / period) + 1.0,
        )
        every = [mark + period * k for mark in marks for k in rounds]
    wanted = np.array(every)[:, None]
    side = root.u < wanted  # (marks, n)
    row, k = np.nonzero(side[:, :-1] != side[:, 1:])
    low, high, before, aim = root.t[k], root.t[k + 1], side[row, k], wanted[row, 0]
    for _ in range(BISECTIONS if len(k) else 0):
        middle = 0.5 * (low + high)
        same = (root.at(middle) < aim) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    width = 1e-12 * (root.t[-1] - root.t[0])
    return [float(t) for t in high if root.t[0] + width < t < root.t[-1] - width]
