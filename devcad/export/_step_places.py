"""Places of a strip, (t, v), on its layers: points in space and where the faces have them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from devcad.export._step_body import Cone, Cylinder, Plane, Ruled, Surface
from devcad.export._step_chart import heights
from devcad.export._step_draft import Skin
from devcad.geometry.chain import Chain
from devcad.geometry.fit import Spline
from devcad.geometry.layers import layer_points
from devcad.geometry.taylor import Array, rows_dot

Mask = NDArray[np.bool_]

INVERSIONS = 6
"""Newton steps to the rational parameter of a conic, from a table of 33."""


@dataclass(frozen=True)
class Ground:
    """What a strip's cuts lie on: its layers as the faces have them; contours that are tangent to
    its ends stay off them by a ``hair``, mm."""

    chain: Chain
    skin: Skin
    hair: float

    @cached_property
    def width(self) -> int:
        """Columns a layer: the point and, but on planes, the place on the surface in mm."""
        return 3 if isinstance(self.skin.surfaces[0], Plane) else 5

    @cached_property
    def fitted(self) -> bool:
        """Whether the faces are fits, and no exact surfaces."""
        surface = self.skin.surfaces[0]
        return isinstance(surface, Ruled) and not surface.low.exact

    @cached_property
    def scale(self) -> Array:
        """mm for a unit of the place on the surface, (2,), at most."""
        surfaces = self.skin.surfaces
        if isinstance(surfaces[0], (Cylinder, Cone)):
            return np.array([max(_radius(s) for s in surfaces), 1.0])
        if not isinstance(surfaces[0], Ruled):
            return np.ones(2)
        low, high = surfaces[0].low.knots[[0, -1]].tolist()
        s = np.linspace(low, high, 65)
        rails = [x for surface in surfaces if isinstance(surface, Ruled) for x in _rails(surface)]
        across = max(
            float(np.linalg.norm(a(s) - b(s), axis=1).max())
            for a, b in zip(rails[::2], rails[1::2], strict=True)
        )
        length = max(float(np.linalg.norm(np.diff(x(s), axis=0), axis=1).max()) for x in rails)
        return np.array([across, length / (s[1] - s[0])])

    def truth(self, t: Array, v: Array) -> Array:
        """The true points on every layer, (n, layers, 3)."""
        strip = self.skin.strip
        points = [layer_points(self.chain, strip.number, t, v, d) for d in strip.layers]
        return np.stack(points, axis=1)

    def rows(self, t: Array, v: Array, nearest: Mask) -> Array:
        """Points and places on the faces, (n, layers, width).

        On fitted faces those at the same share of the fitted ruling or, where ``nearest`` (n,),
        those next to the true points.
        """
        t = np.clip(t, *self.skin.strip.ends)
        if isinstance(self.skin.surfaces[0], Ruled):
            return self._fitted_rows(t, v, nearest if self.fitted else np.zeros_like(nearest))
        points = self.truth(t, v)
        if self.width == 3:
            return points
        assert self.skin.frame is not None
        u = self.scale[0] * self.skin.frame.angle(t)
        places = [
            np.stack([u, _heights(surface, points[:, k])], axis=1)
            for k, surface in enumerate(self.skin.surfaces)
        ]
        return np.concatenate([points, np.stack(places, axis=1)], axis=2)

    def along(self, t: Array) -> Array:
        """The parameter s of a fitted strip's rulings at t, (n,)."""
        surface, strip = self.skin.surfaces[0], self.skin.strip
        assert isinstance(surface, Ruled)
        if surface.low.weights is None:
            return np.interp(t, strip.course.t, strip.course.s)
        ends = strip.ends
        s = np.interp(t, np.linspace(ends[0], ends[1], len(self.skin.places)), self.skin.places)
        true = strip.rails(t)[:, :, 0]
        for _ in range(INVERSIONS):
            step, size = np.zeros_like(s), np.zeros_like(s)
            for side, rail in enumerate((surface.low, surface.high)):
                point, slope = _rational(rail, s)
                step += rows_dot(slope, true[:, side] - point)
                size += rows_dot(slope, slope)
            s = np.clip(s + step / size, *rail.knots[[0, -1]])
        s = np.where(t == ends[0], rail.knots[0], s)
        return np.asarray(np.where(t == ends[1], rail.knots[-1], s))

    def shares(self, t: Array, v: Array) -> Array:
        """The share of the ruling, from the from side, on every layer, (n, layers)."""
        strip = self.skin.strip
        if any(strip.tips) and len(strip.layers) > 1:
            f = strip.patch.frame(t)
            tip = (f.c / np.where(f.a == 0.0, 1.0, f.a))[:, None] * np.array(strip.layers)
            low, high = (
                x[:, None] + (tip if at_tip else 0.0)
                for x, at_tip in zip((f.v_from, f.v_to), strip.tips, strict=True)
            )
        else:
            jet = strip.patch.jet(t, 0)
            low, high = jet.v_from[0][:, None], jet.v_to[0][:, None]
        out = (v[:, None] - low) / (high - low)
        return np.asarray(np.broadcast_to(out, (len(t), len(strip.layers))))

    def _fitted_rows(self, t: Array, v: Array, nearest: Mask) -> Array:
        shares, s = self.shares(t, v), self.along(t)
        goal = self.truth(t[nearest], v[nearest]) if nearest.any() else None
        columns = []
        for k, surface in enumerate(self.skin.surfaces):
            assert isinstance(surface, Ruled)
            share = shares[:, k] if k == len(self.skin.surfaces) - 1 else 1.0 - shares[:, k]
            place = np.stack([place_across(surface, share, s), s], axis=1)
            if goal is not None:
                place[nearest] = _nearest(surface, place[nearest], goal[:, k])
            columns.append(np.concatenate([on_ruled(surface, place), place * self.scale], axis=1))
        return np.stack(columns, axis=1)


def place_across(surface: Ruled, share: Array, s: Array) -> Array:
    """The parameter u of places at a share of the ruling at s, (n,)."""
    if surface.low.weights is None:
        return share
    w0, w1 = surface.low.denominator(s), surface.high.denominator(s)
    return np.asarray(share * w0 / ((1.0 - share) * w1 + share * w0))


def on_ruled(surface: Ruled, place: Array) -> Array:
    """The points of a ruled face at places (n, 2), (n, 3)."""
    u, s = place.T
    if surface.low.weights is None:
        rails = side_by_side(surface)(s)
        return np.asarray((1.0 - u)[:, None] * rails[:, :3] + u[:, None] * rails[:, 3:])
    low, high = (1.0 - u) * surface.low.denominator(s), u * surface.high.denominator(s)
    shares = low / (low + high), high / (low + high)
    return np.asarray(shares[0][:, None] * surface.low(s) + shares[1][:, None] * surface.high(s))


def side_by_side(surface: Ruled) -> Spline:
    """Both edges of a face without weights as one spline of six columns."""
    low = surface.low
    return Spline(low.degree, low.knots, np.concatenate([low.poles, surface.high.poles], axis=1))


def _nearest(surface: Ruled, place: Array, goal: Array) -> Array:
    """The places (n, 2) of a face without weights that are next to the points ``goal`` (n, 3).

    One Newton step: from 1e-4 mm away it leaves some 1e-9.
    """
    u, s = place.T
    both = side_by_side(surface)
    rails, slopes = both(s), both.derivative(s)
    low, across = rails[:, :3], rails[:, 3:] - rails[:, :3]
    along = (1.0 - u)[:, None] * slopes[:, :3] + u[:, None] * slopes[:, 3:]
    miss = goal - low - u[:, None] * across
    a, b, c = rows_dot(across, across), rows_dot(across, along), rows_dot(along, along)
    x, y = rows_dot(across, miss), rows_dot(along, miss)
    det = a * c - b * b
    return np.stack([u + (c * x - b * y) / det, s + (a * y - b * x) / det], axis=1)


def _rational(rail: Spline, s: Array) -> tuple[Array, Array]:
    """The points of a weighted spline and d/ds of them, (n, 3) each."""
    assert rail.weights is not None
    over = Spline(rail.degree, rail.knots, rail.weights * rail.poles)
    under = Spline(rail.degree, rail.knots, rail.weights[:, :1])
    points = rail(s)
    return points, (over.derivative(s) - points * under.derivative(s)) / under(s)


def _rails(surface: Ruled) -> tuple[Spline, Spline]:
    return surface.low, surface.high


def _radius(surface: Surface) -> float:
    assert isinstance(surface, (Cylinder, Cone))
    return surface.radius


def _heights(surface: Surface, points: Array) -> Array:
    assert isinstance(surface, (Cylinder, Cone))
    return heights(surface, points)
