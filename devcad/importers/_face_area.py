"""The area of a face from the kernel's surface alone: what its pattern must have.

The kernel's own quadrature is off by up to a hundredth on trimmed splines; here Green's formula
is integrated along the wires to rounding: the area is the integral of Phi dt round the face, Phi
the integral of |S_u x S_w| along a straight line of the surface.
"""

from __future__ import annotations

import numpy as np
from OCP.Geom import Geom_Surface

from devcad.geometry import chebyshev
from devcad.geometry.taylor import Array
from devcad.importers._face_surfaces import knots_along, normals
from devcad.importers._face_wires import Course, Loop, box

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
"""Exact to degree 23: |S_u x S_w| is linear along a line, or a rational function of it."""

ASIDE = 1e-9
"""Of a piece, by which samples keep off its ends, where they weigh a hundredth: 1e-11 is left."""


def face_area(
    surface: Geom_Surface, loops: tuple[Loop, ...], knots: list[list[Array]], across: int
) -> float:
    """The area inside the loops in mm2, the lines of constant parameter ``across`` being straight.

    ``knots`` are the edges' parameters, loop by loop, between which they cross no break.
    """
    u0, u1, w0, w1 = box(loops[0])
    low, high = (u0, u1) if across else (w0, w1)
    inner = [k for k in knots_along(surface, 1 - across) if low < k < high]
    lines = np.array([low, *inner])
    span = (w0, w1) if across else (u0, u1)
    far = np.full((3, 2), high)
    far[:, across] = np.linspace(*span, 5)[1:-1]
    size = float(np.abs(_along(surface, far, lines, across)).max()) * (span[1] - span[0])
    total = 0.0
    for number, (loop, ends) in enumerate(zip(loops, knots, strict=True)):
        parts = [
            _swept(surface, course, lines, across, at, size)
            for course, at in zip(loop, ends, strict=True)
        ]
        total += abs(sum(parts)) if number == 0 else -abs(sum(parts))
    return total


def _swept(
    surface: Geom_Surface, course: Course, lines: Array, across: int, knots: Array, size: float
) -> float:
    """The integral of Phi dt along an edge, in the direction of its run; ``size`` is about the
    area of the face."""
    slopes = course.series.derivative()

    def density(s: Array) -> Array:
        s = _off(s, knots)
        uw = course.series(s)
        return (_along(surface, uw, lines, across) * slopes(s)[:, across])[:, None]

    series = chebyshev.resolve(density, knots, scale=size / (knots[-1] - knots[0]))
    value = float(series.antiderivative()(knots[-1:])[0, 0])
    return value if course.forward else -value


def _off(s: Array, knots: Array) -> Array:
    """Parameters s (n,), those at a knot moved off it: there the kernel's derivatives may jump."""
    piece = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(knots) - 2)
    low, high = knots[piece], knots[piece + 1]
    aside = ASIDE * (high - low)
    return np.clip(s, low + aside, high - aside)


def _along(surface: Geom_Surface, uw: Array, lines: Array, across: int) -> Array:
    """Phi at (n, 2): the integral along the straight line from the first of ``lines`` to there."""
    end = uw[:, 1 - across]
    total = np.zeros(len(uw))
    for k, start in enumerate(lines.tolist()):
        stop = np.minimum(end, lines[k + 1]) if k + 1 < len(lines) else end
        width = stop - start if k == 0 else np.maximum(stop - start, 0.0)
        places = start + width[:, None] * (0.5 * (NODES + 1.0))  # (n, nodes)
        grid = np.empty((len(uw), len(NODES), 2))
        grid[..., across] = uw[:, across, None]
        grid[..., 1 - across] = places
        sizes = np.linalg.norm(normals(surface, grid.reshape(-1, 2)), axis=1)
        total += 0.5 * width * (sizes.reshape(len(uw), -1) @ WEIGHTS)
    return total
