"""Fold: the surface in space from its pattern and its bending alone.

While a sheet is bent about the rulings of its pattern, the motion R(t) that carries the plane
onto the tangent plane at ruling t obeys R' = R B(t), where B is the rotation at rate bend * c
about the ruling's line in the pattern. R (3 x 4) is found by collocation at Chebyshev points,
panel by panel: linear, hence without iteration, and accurate to rounding. With bend = 1 this
rebuilds the part; with less it is the part partly bent, an exact isometry at every value.

Source: geometry.md, 14; Hairer, Lubich and Wanner, Geometric Numerical Integration, II.1.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.flatten.development import Development
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.creasing import Bending
from devcad.geometry.patch import Frame
from devcad.geometry.taylor import Array

NODES = 17
ROUNDS = 9
"""How often panels that are not resolved are halved."""
RESOLVED = 1e-13
"""Share of the last coefficients below which a panel's motion is resolved."""
TURN = 1.5
"""Bending and turning of one panel to begin with, in radians: 17 nodes mostly do."""


@dataclass(frozen=True, slots=True)
class Folded:
    """The motion of one patch's pattern into space: ``motion(t)`` is R as 12 numbers."""

    development: Development
    motion: Piecewise

    def points(self, t: Array, v: Array) -> Array:
        """The points in space of the pattern's points (t, v), each (n,), shape (n, 3)."""
        return self.carried(t, self.development.points(t, v))

    def carried(self, t: Array, flat: Array) -> Array:
        """The points in space of points (n, 2) of the plane that lie on the rulings t (n,)."""
        motion = self.motion(t).reshape(-1, 3, 4)
        return np.asarray(np.einsum("nij,nj->ni", motion[:, :, :2], flat) + motion[:, :, 3])

    def frames(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """c0, e, m, n in space at t, each (n, 3)."""
        motion = self.motion(t).reshape(-1, 3, 4)
        direction = self.development.direction(t)
        turn = motion[:, :, :2]
        e = np.einsum("nij,nj->ni", turn, direction)
        n = motion[:, :, 2]
        c0 = np.einsum("nij,nj->ni", turn, self.development.origin(t)) + motion[:, :, 3]
        return c0, e, np.cross(n, e), n


def fold(development: Development, start: Array, bend: float | Bending) -> Folded:
    """Bend a development from the motion ``start`` (3, 4) at its first ruling.

    ``bend`` scales the bending c, everywhere alike or from ruling to ruling: 0 stays flat, 1 is the
    part. Reads the pattern and c only.
    """
    knots = _panels(development, bend)
    # rotations and lengths stand in one matrix: in units of the pattern's size both are about 1
    unit = float(np.abs(development.origin(knots)).max())
    unit = max(unit, float(np.abs(start[:, 3]).max())) or 1.0  # 0 at a cone's apex
    for _ in range(ROUNDS):
        flow = _flow(development, knots, bend, unit)
        coefficients = np.abs(np.einsum("kj,pjab->pkab", chebyshev.transform(NODES), flow))
        rough = coefficients[:, -2:].max(axis=(1, 2)) > RESOLVED * coefficients.max(axis=(1, 2))
        if not rough.any():
            break
        split = rough.any(axis=1)
        knots = np.sort(np.concatenate([knots, 0.5 * (knots[:-1] + knots[1:])[split]]))
    motions = np.empty((len(flow), NODES, 12))
    current = start / [1.0, 1.0, 1.0, unit]
    for panel, steps in enumerate(flow):
        motions[panel] = (current @ steps).reshape(NODES, 12)
        current = _orthonormal(motions[panel, -1].reshape(3, 4))
    motions[..., 3::4] *= unit
    table = np.einsum("kj,pjd->pkd", chebyshev.transform(NODES), motions)
    return Folded(development, Piecewise(knots, table))


def _flow(development: Development, knots: Array, bend: float | Bending, unit: float) -> Array:
    """Each panel's motion from its start to its nodes, (k, NODES, 4, 4), lengths in ``unit``."""
    low, high = knots[:-1], knots[1:]
    t = np.stack(
        [chebyshev.nodes(a, b, NODES) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    )
    generator = _generator(development, t.ravel(), bend, unit).reshape(len(low), NODES, 4, 4)
    weights = 0.5 * (high - low)[:, None, None] * chebyshev.integration_of_values(NODES)
    # row i of R at node k: r_k = r_0 + sum_j w_kj r_j B_j, the same matrix for the three rows
    system = -np.einsum("pkj,pjab->pkbja", weights, generator)
    system = system.reshape(len(low), 4 * NODES, 4 * NODES) + np.eye(4 * NODES)
    starts = np.tile(np.eye(4), (NODES, 1))  # r_0 = each unit row: the panel's propagator
    flow = np.linalg.solve(system, np.broadcast_to(starts, (len(low), 4 * NODES, 4)))
    return np.asarray(flow.reshape(len(low), NODES, 4, 4).swapaxes(2, 3))


def fold_chain(
    developments: tuple[Development, ...],
    chain: Chain,
    first: Frame,
    bend: float | Sequence[Bending],
) -> tuple[Folded, ...]:
    """Bend all patches of a chain; ``first`` is the frame at the start, which stays. ``bend`` is
    one number for all, or a function of every patch of a chain without creases."""
    motion = _motion(developments[0], first)
    out: list[Folded] = []
    for k, development in enumerate(developments):
        if k and isinstance(bend, (int, float)):
            motion = motion @ _crease(development, bend * chain.joints[k - 1].angle)
        folded = fold(development, motion, bend if isinstance(bend, (int, float)) else bend[k])
        motion = folded.motion(folded.motion.knots[-1:]).reshape(3, 4)
        out.append(folded)
    return tuple(out)


def _motion(development: Development, first: Frame) -> Array:
    """The motion (3, 4) that carries the first ruling of a development to where it is in space."""
    omega, x, y = development.series(development.series.knots[:1])[0, :3]
    cos, sin = np.cos(omega), np.sin(omega)
    right = cos * first.e[0] - sin * first.m[0]
    up = sin * first.e[0] + cos * first.m[0]
    return np.column_stack([right, up, first.n[0], first.c0[0] - x * right - y * up])


def _panels(development: Development, bend: float | Bending) -> Array:
    """The development's panels, divided so that none bends or turns by more than TURN."""
    knots = development.series.knots
    nodes = np.linspace(0.0, 1.0, 9)
    t = knots[:-1, None] + np.diff(knots)[:, None] * nodes[1:-1]
    values = development.series(t.ravel())
    rate = np.abs(values[:, 3] * _share(bend, t.ravel())).reshape(t.shape).max(axis=1)
    turn = np.abs(development.series.derivative()(t.ravel())[:, 0]).reshape(t.shape).max(axis=1)
    # a panel of d nodes resolves polynomials of degree d - 1; the pattern may be of higher degree
    degree = development.series.coefficients.shape[1] / NODES
    parts = np.ceil(np.maximum((rate + turn) * np.diff(knots) / TURN, degree)).astype(int)
    return np.concatenate(
        [
            *(
                a + (b - a) * np.arange(n) / n
                for a, b, n in zip(knots[:-1], knots[1:], np.maximum(parts, 1), strict=True)
            ),
            knots[-1:],
        ]
    )


def _share(bend: float | Bending, t: Array) -> Array:
    """What c is multiplied by at t (n,)."""
    return np.full(len(t), bend) if isinstance(bend, (int, float)) else bend(t, 0)[0]


def _generator(development: Development, t: Array, bend: float | Bending, unit: float) -> Array:
    """The rotation at rate bend * c about the ruling's line, as (n, 4, 4) matrices."""
    omega, x, y, c = development.series(t).T
    x, y = x / unit, y / unit
    rate = _share(bend, t) * c
    u, w = rate * np.cos(omega), rate * np.sin(omega)
    out = np.zeros((len(t), 4, 4))
    out[:, 2, 0], out[:, 0, 2] = -w, w
    out[:, 2, 1], out[:, 1, 2] = u, -u
    out[:, 2, 3] = w * x - u * y  # -(axis x point)
    return out


def _crease(development: Development, angle: float) -> Array:
    """The rotation by ``angle`` about the development's first ruling, (4, 4)."""
    at = development.series.knots[:1]
    axis = np.append(development.direction(at)[0], 0.0)
    point = np.append(development.origin(at)[0], 0.0)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = point - turn @ point
    return out


def _orthonormal(motion: Array) -> Array:
    """The motion with rounding removed from its rotation: one Newton step of the polar form."""
    turn = motion[:, :3]
    turn = 0.5 * turn @ (3.0 * np.eye(3) - turn.T @ turn)
    return np.column_stack([turn, motion[:, 3]])
