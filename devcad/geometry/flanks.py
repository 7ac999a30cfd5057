"""The tangent planes and rulings on the two sides of a curved crease.

Along a crease with Frenet frame T, N, B (B the front, N to the left) the sheet's tangent planes are
the osculating plane turned about T by alpha, upwards on either side for alpha > 0. With V the unit
vector of the tangent plane square to T and to the left, n = T x V its front,

    left:  V = cos alpha N + sin alpha B      right:  V = cos alpha N - sin alpha B
    cot beta = (tau + alpha') / (k sin alpha)      cot beta = (tau - alpha') / (k sin alpha)

beta the angle from T to the ruling on its own side. A crease on a known flank, the flank beyond it
wanted: the new tangent plane is the known one reflected in the osculating plane. By the crease's
geodesic and normal curvature in the known flank, kg = k cos alpha and kn = -k sin alpha on the
left, +k sin alpha on the right:

    tan alpha = -+ kn/kg      cot beta (new) = cot beta (known) + 2 alpha'/kn.

No formula divides by the curvature alone: k may change its sign where the quotients have limits.

Source: geometry.md, section 8 (Fuchs and Tabachnikov; Kilian and others); the second pair follows
from the first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.geometry import elementary, taylor
from devcad.geometry.quotient import Quotient
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class FlankJet:
    """Series (K + 1, n, 3) along the rulings of one side of a crease: base point, unit ruling to
    the right, front."""

    c0: Array
    e: Array
    n: Array


Flanking = Callable[[Array, int], FlankJet]
"""Parameters t (n,) and an order K to the flank's series."""


@dataclass(frozen=True, slots=True)
class CreaseJet:
    """Series (K + 1, n[, 3]) along a crease: point, frame, and per parameter (not per length) how
    fast T turns in the osculating plane (``bend`` = k ds/dt, of either sign) and the plane about
    T (``wind`` = tau ds/dt)."""

    point: Array
    T: Array
    N: Array
    B: Array
    bend: Array
    wind: Array


def side(crease: CreaseJet, alpha: Array, cot: Array, right: float) -> FlankJet:
    """One side of a crease: ``right`` is 1 or -1, ``cot`` that of beta (K + 1, n)."""
    sine, cosine = taylor.sin_cos(alpha)
    along, up = taylor.mul(cosine, crease.N), taylor.mul(sine, crease.B)
    front = taylor.mul(cosine, crease.B) + right * taylor.mul(sine, crease.N)
    e = taylor.unit(right * taylor.mul(cot, crease.T) - (along - right * up))
    return FlankJet(crease.point, e, front)


def slopes(crease: CreaseJet, alpha: Array, right: float) -> tuple[Array, Array]:
    """Numerator and denominator of cot beta on one side, to the order of the crease; alpha is of
    one order more."""
    sine, _ = taylor.sin_cos(alpha[:-1])
    return crease.wind - right * taylor.derivative(alpha), taylor.mul(crease.bend, sine)


@dataclass(frozen=True, slots=True)
class Seen:
    """A crease at v = s(t) as its known flank sees it: T, V, n, point (K + 1, n, 3), cot of beta
    on the known side, and kg and kn times ds/dt (K, n)."""

    point: Array
    T: Array
    V: Array
    n: Array
    cot: Array
    turn: Array
    bend: Array


def seen(flank: FlankJet, s: Array, right: float) -> Seen:
    """The crease at the distance s (K + 2, n) along a flank's rulings, the flank to order K + 1.

    ``right`` is 1 where the crease lies to the right of the flank, -1 to its left.
    """
    point = flank.c0 + taylor.mul(s, flank.e)
    unit_tangent = taylor.unit(taylor.derivative(point))
    order = len(unit_tangent)
    e, n = flank.e[:order], flank.n[:order]
    across = taylor.cross(n, unit_tangent)
    turning = taylor.derivative(unit_tangent)
    less = order - 1
    cot = right * taylor.div(taylor.dot(e, unit_tangent), taylor.dot(e, across))
    return Seen(
        point[:order],
        unit_tangent,
        across,
        n,
        cot,
        taylor.dot(turning, across[:less]),
        taylor.dot(turning, n[:less]),
    )


def beyond(here: Seen, alpha: Array, twice: Array, right: float) -> FlankJet:
    """The flank beyond a crease; ``twice`` is 2 alpha'/kn (K + 1, n), alpha of that order at
    least."""
    order = len(twice)
    point, along, across, n = (x[:order] for x in (here.point, here.T, here.V, here.n))
    sine, cosine = taylor.sin_cos(2.0 * alpha[:order])
    new = taylor.mul(cosine, across) - right * taylor.mul(sine, n)
    front = right * taylor.mul(sine, across) + taylor.mul(cosine, n)
    e = taylor.unit(right * taylor.mul(here.cot[:order] + twice, along) - new)
    return FlankJet(point, e, front)


def fold_at(here: Seen, t: Array, ratio: Quotient, right: float) -> Array:
    """The series of alpha along a crease on a known flank, to the order of ``here.turn``."""
    with np.errstate(all="ignore"):
        return elementary.atan(ratio.of(t, -right * here.bend, here.turn))
