"""Plane curves from closed forms as pattern edges, and distances found by brute force."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev
from scipy.spatial import cKDTree

from devcad.flatten.pattern import Edge
from devcad.geometry.taylor import Array

TURN = 2.0 * np.pi
Form = Callable[[Array], tuple[Array, Array]]


def edge(form: Form, *u: float, name: str = "base") -> Edge:
    """The curve (x(u), y(u)); its derivative by a complex step, exact to rounding."""

    def curve(at: Array) -> tuple[Array, Array]:
        at = np.asarray(at, dtype=float)
        values = np.stack(form(at + 1e-30j), axis=1)
        return values.real, values.imag / 1e-30

    return Edge(name, curve, np.array(u, dtype=float))


def line(start: tuple[float, float], end: tuple[float, float], name: str = "start") -> Edge:
    a, b = np.array(start), np.array(end)
    return edge(lambda u: (a[0] + u * (b - a)[0], a[1] + u * (b - a)[1]), 0.0, 1.0, name=name)


def arc(
    centre: tuple[float, float], radius: float, start: float, end: float, name: str = "base"
) -> Edge:
    x, y = centre
    return edge(lambda u: (x + radius * np.cos(u), y + radius * np.sin(u)), start, end, name=name)


def ellipse(a: float, b: float, start: float = 0.0, end: float = TURN) -> Edge:
    return edge(lambda u: (a * np.cos(u), b * np.sin(u)), start, end)


def moved(original: Edge, scale: float, angle: float, mirrored: bool) -> Edge:
    matrix = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    matrix = matrix @ np.diag([1.0, -1.0 if mirrored else 1.0])

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = original.curve(u)
        return points @ matrix.T + 17.0 * scale, slopes @ matrix.T

    return Edge(original.name, curve, original.u)


def frustum(radius: float, top: float, height: float) -> tuple[Edge, ...]:
    """The sector of a cone frustum: an annulus piece with its first ruling along +x."""
    slant = float(np.hypot(radius - top, height))
    outer, inner = slant * radius / (radius - top), slant * top / (radius - top)
    sweep = TURN * radius / outer
    last = np.array([np.cos(np.pi - sweep), np.sin(np.pi - sweep)])
    centre = np.array([outer, 0.0])
    ends = tuple(centre + inner * last), tuple(centre + outer * last)
    return (
        line((0.0, 0.0), (slant, 0.0)),
        arc((outer, 0.0), inner, np.pi, np.pi - sweep, "top"),
        line(ends[0], ends[1], "end"),
        arc((outer, 0.0), outer, np.pi - sweep, np.pi),
    )


def loft_rim() -> Edge:
    """The developed lower rim of the loft between the ellipses 100 x 60 and 50 x 80, turned by
    35 degrees and offset, in parallel planes 120 apart (algorithms: L = 510 mm).

    Rulings join points with parallel tangents, so the geodesic curvature of the rim has a closed
    form; the plane curve of that curvature is integrated with Chebyshev series.
    """
    a, b, c, d, turn, height = 100.0, 60.0, 50.0, 80.0, np.radians(35.0), 120.0

    def speed(t: Array) -> Array:
        return np.hypot(a * np.sin(t), b * np.cos(t))

    def geodesic(t: Array) -> Array:
        normal = np.arctan2(a * np.sin(t), b * np.cos(t))
        nx, ny = np.cos(normal - turn), np.sin(normal - turn)
        g = np.hypot(c * nx, d * ny)
        x, y = c * c * nx / g, d * d * ny / g
        top = np.cos(turn) * x - np.sin(turn) * y + 15, np.sin(turn) * x + np.cos(turn) * y + 10
        away = np.cos(normal) * (top[0] - a * np.cos(t)) + np.sin(normal) * (top[1] - b * np.sin(t))
        return a * b / speed(t) ** 3 * np.sin(np.arctan2(-away, height))

    return natural(geodesic, speed, 0.0, TURN)


def natural(
    curvature: Callable[[Array], Array],
    speed: Callable[[Array], Array],
    start: float,
    end: float,
    panels: int = 40,
) -> Edge:
    """The plane curve of given curvature and speed, from the origin along +x."""
    breaks = np.linspace(start, end, panels + 1)
    half = 0.5 * (breaks[1] - breaks[0])
    heading, place, series = 0.0, np.zeros(2), []
    for a in breaks[:-1]:

        def at(x: Array, a: float = float(a)) -> Array:
            return a + half * (x + 1.0)

        turned = _integral(lambda x, at=at: curvature(at(x)) * speed(at(x)) * half, heading)
        parts = [
            _integral(
                lambda x, at=at, turned=turned, wave=wave: (
                    wave(chebyshev.chebval(x, turned)) * speed(at(x)) * half
                ),
                place[k],
            )
            for k, wave in enumerate((np.cos, np.sin))
        ]
        series.append(parts)
        heading = chebyshev.chebval(1.0, turned)
        place = np.array([chebyshev.chebval(1.0, part) for part in parts])
    table = np.array(series)  # (panels, 2, degree + 1)

    def curve(u: Array) -> tuple[Array, Array]:
        u = np.asarray(u, dtype=float)
        k = np.clip(np.searchsorted(breaks, u, side="right") - 1, 0, panels - 1)
        basis = chebyshev.chebvander((u - breaks[k]) / half - 1.0, table.shape[2] - 1)
        slopes = chebyshev.chebder(np.moveaxis(table[k], 2, 0))
        return (
            np.einsum("nk,nik->ni", basis, table[k]),
            np.einsum("nk,kni->ni", basis[:, : len(slopes)], slopes) / half,
        )

    return Edge("base", curve, np.array([start, end]))


def _integral(f: Callable[[Array], Array], start: float) -> Array:
    out = chebyshev.chebint(chebyshev.chebinterpolate(f, 24))
    out[0] += start - chebyshev.chebval(-1.0, out)
    return np.asarray(out)


def drawn(points: Array, bulges: Array, per_segment: int = 400) -> Array:
    """Dense points on a path of lines and arcs, by centre, radius and angle (complex numbers)."""
    z = points[:, 0] + 1j * points[:, 1]
    out = []
    for a, b, bulge in zip(z[:-1], z[1:], bulges, strict=True):
        s = np.arange(per_segment) / per_segment
        if bulge == 0.0:
            out.append(a + s * (b - a))
        else:
            sweep = 4.0 * np.arctan(bulge)
            centre = 0.5 * (a + b) + 0.5j * (b - a) / np.tan(0.5 * sweep)
            out.append(centre + (a - centre) * np.exp(1j * sweep * s))
    path = np.append(np.concatenate(out), z[-1])
    return np.stack([path.real, path.imag], axis=1)


def apart(points: Array, others: Array) -> float:
    """The largest distance from ``points`` to the polyline through ``others``, both dense."""
    _, near = cKDTree(others).query(points)
    best = np.full(len(points), np.inf)
    for shift in (-1, 0):
        a = others[np.clip(near + shift, 0, len(others) - 2)]
        b = others[np.clip(near + shift, 0, len(others) - 2) + 1]
        length2 = np.maximum(np.sum((b - a) ** 2, axis=1), 1e-300)
        share = np.clip(np.sum((points - a) * (b - a), axis=1) / length2, 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return float(best.max())
