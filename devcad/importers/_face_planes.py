"""Faces on planes, however the kernel describes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from OCP.Geom import Geom_Surface

from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.sheets import Side
from devcad.geometry import chebyshev, taylor
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array
from devcad.importers._face_surfaces import Ground, normals, points
from devcad.importers._face_wires import Loop, box, drawn


def flat_ground(surface: Geom_Surface, outer: Loop) -> Ground:
    """The ground of a face that lies on a plane: e along the surface's u in its middle."""
    u0, u1, w0, w1 = box(outer)
    middle = np.array([[0.5 * (u0 + u1), 0.5 * (w0 + w1)]])
    origin = points(surface, middle)[0]
    n = normals(surface, middle)[0]
    n /= np.linalg.norm(n)
    aside = np.array([[0.25 * u0 + 0.75 * u1, middle[0, 1]]])
    ahead = points(surface, aside)[0] - origin
    x = ahead - (ahead @ n) * n
    x /= np.linalg.norm(x)
    y = np.cross(n, x)

    def place(uw: Array) -> Array:
        away = points(surface, uw) - origin
        return np.column_stack([away @ y, away @ x])

    size = float(np.abs(place(np.concatenate([course.ends() for course in outer]))).max())
    lines = [_placed(course.series, place, 1e-3 * size) for course in outer]
    t0, v0, t1, v1 = bounds(tuple(drawn(line, forward=True) for line in lines))
    corner = origin + v0 * x

    def field(t: Array, order: int) -> RulingJet:
        c0 = taylor.constant_vector(corner, order, t.size)
        c0 += taylor.variable(t, order)[..., None] * y
        return RulingJet(
            c0,
            taylor.constant_vector(x, order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(v1 - v0, order, t.size),
        )

    return Ground(Patch(field, (t0, t1)), lambda uw: place(uw) - [0.0, v0], None)


def _placed(series: Piecewise, place: Callable[[Array], Array], scale: float) -> Piecewise:
    """A series of (u, w) as one of (t, v); what is below ``scale`` needs no digits of its own."""
    return chebyshev.resolve(lambda s: place(series(s)), series.knots, scale=scale)


def plane_area(loop: Sequence[Side]) -> float:
    """The area inside a border in mm2 where (t, v) are lengths in a plane."""
    return abs(
        enclosed_area(tuple(drawn(side.track.series, forward=side.forward) for side in loop))
    )
