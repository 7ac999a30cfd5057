"""Places on circular cylinders and right circular cones: angle and height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.export._step_body import Cone, Cylinder
from devcad.export._step_strips import Strip
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Chart:
    """Angle about the axis and height along the ruling on a circular cylinder or cone.

    ``side`` is +1 where the front is outside. The angle counts from ``x`` so that it is never
    negative on the strip, ``turn`` = +-1 as it grows or falls with t.
    """

    strip: Strip
    axis: Array
    x: Array
    side: float
    turn: float
    t: Array
    u: Array

    def angle(self, t: Array) -> Array:
        """The angle u at t, (n,)."""
        radial = self.radial(t)
        raw = np.arctan2(radial @ np.cross(self.axis, self.x), radial @ self.x)
        near = np.interp(t, self.t, self.u)
        return np.asarray(raw + 2.0 * np.pi * np.round((near - raw) / (2.0 * np.pi)))

    def radial(self, t: Array) -> Array:
        """The unit direction away from the axis at t, (n, 3)."""
        return _radial(self.strip, self.axis, self.side, t)

    def surface(self, layer: int, reach: Array) -> Cylinder | Cone:
        """The skin of a layer; a cone's circle of reference goes through the widest of the points
        ``reach`` (k, 3) of that layer."""
        shape, d = self.strip.shape, self.strip.layers[layer]
        assert shape.point is not None
        if shape.radius is not None:
            return Cylinder(shape.point, self.axis, self.x, shape.radius + self.side * d)
        assert shape.half_angle is not None
        sine, cosine = np.sin(shape.half_angle), np.cos(shape.half_angle)
        apex = shape.point - self.side * d / sine * self.axis
        slant = float(np.linalg.norm(reach - apex, axis=1).max())
        return Cone(
            apex + slant * cosine * self.axis, self.axis, self.x, slant * sine, shape.half_angle
        )


def chart(strip: Strip) -> Chart:
    """The chart of a strip on a circular cylinder or cone."""
    shape = strip.shape
    assert shape.axis is not None and shape.point is not None
    axis = shape.axis / np.linalg.norm(shape.axis)
    t = np.linspace(strip.ends[0], strip.ends[1], 257)
    rails = strip.rails(t[128:129])[0].mean(axis=1)
    arm = rails.mean(axis=0) - shape.point
    normal = strip.patch.frame(t[128:129]).n[0]
    side = 1.0 if normal @ (arm - (arm @ axis) * axis) > 0.0 else -1.0
    radial = _radial(strip, axis, side, t)
    y = np.cross(axis, radial[0])
    u = np.unwrap(np.arctan2(radial @ y, radial @ radial[0]))
    if u[-1] > 0.0:
        return Chart(strip, axis, radial[0], side, 1.0, t, u)
    return Chart(strip, axis, radial[-1], side, -1.0, t, u - u[-1])


def heights(surface: Cylinder | Cone, points: Array) -> Array:
    """The coordinate v of points (n, 3) on the surface, (n,)."""
    if isinstance(surface, Cylinder):
        return np.asarray((points - surface.point) @ surface.axis)
    slant = surface.radius / np.sin(surface.half_angle)
    apex = surface.point - slant * np.cos(surface.half_angle) * surface.axis
    return np.asarray(np.linalg.norm(points - apex, axis=1) - slant)


def _radial(strip: Strip, axis: Array, side: float, t: Array) -> Array:
    n = side * strip.patch.frame(t).n
    out = n - (n @ axis)[:, None] * axis
    return np.asarray(out / np.linalg.norm(out, axis=1)[:, None])
