"""The spherical images of a curve's frame, one after the other, and their invariants.

Every orthonormal frame (x, y, z) along a curve that moves by (primes are d/ds, s the arc length)

    x' = rate y        y' = rate (-x + ratio z)        z' = -rate ratio y

has a next one: (y, unit y', y x unit y'), which moves in the same way with

    rate -> rate sqrt(1 + ratio^2)        ratio -> ratio' / (rate (1 + ratio^2)^(3/2))

The first is the Frenet frame (T, N, B), rate k and ratio f = tau/k. The next is (N, Cc, Dbar) with
rate W and ratio sigma, then (Cc, N_N, B_N) with rate W k_N and ratio psi, then the one with ratio
chi. A ratio is constant exactly on the cylindrical (f), slant (sigma), clad (psi) and g-clad
helices (chi); then ratio x + z, the frame's modified Darboux vector, keeps its direction.

Source: geometry.md, section 2 (psi and chi: reconstructed there from the N-indicatrix, not
compared with the papers of Takahashi and Takeuchi).
"""

from __future__ import annotations

from dataclasses import dataclass

from devcad.geometry import frames, taylor
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Indicatrix:
    """One frame of the row, as series: x, y, z (K + 1, n, 3), rate per arc length, and speed =
    ds/dt (K + 1, n). ``ratio`` (L + 1, n) is of order L = K on the Frenet frame, K - 1 on others.
    """

    x: Array
    y: Array
    z: Array
    rate: Array
    ratio: Array
    speed: Array

    @property
    def darboux(self) -> Array:
        """The modified Darboux vector ratio x + z, to the order of the ratio: D~ = (tau/k) T + B
        on the Frenet frame. It points along the axis about which the frame turns."""
        order = len(self.ratio)
        return taylor.mul(self.ratio, self.x[:order]) + self.z[:order]

    @property
    def axis(self) -> Array:
        """The modified Darboux vector of length one: (tau T + k B)/W on the Frenet frame."""
        return taylor.unit(self.darboux)

    def next(self) -> Indicatrix:
        """The frame of y, to the order of the ratio; its ratio is of one order less."""
        order = len(self.ratio)
        x, y, z = (side[:order] for side in (self.x, self.y, self.z))
        rate, speed = self.rate[:order], self.speed[:order]
        stretch = taylor.mul(self.ratio, self.ratio)
        stretch[0] += 1.0
        shrink = taylor.power(stretch, -0.5)
        slope = by_arc_length(self.ratio, speed)
        less = len(slope)
        bending = taylor.mul(rate[:less], taylor.power(stretch[:less], 1.5))
        return Indicatrix(
            y,
            taylor.mul(shrink, taylor.mul(self.ratio, z) - x),
            self.axis,
            taylor.mul(rate, taylor.sqrt(stretch)),
            taylor.div(slope, bending),
            speed,
        )


def indicatrices(jet: Array, count: int) -> tuple[Indicatrix, ...]:
    """The first ``count`` >= 1 frames of a curve's row, from its series (K + 1, n, 3).

    Frame number j (0 is the Frenet frame) has its ratio to order K - 3 - j, and its sides to
    that order or one more: f, sigma, psi, chi themselves need K = 3, 4, 5, 6. Where the curvature
    vanishes nothing is finite.
    """
    frenet = frames.frenet(jet)
    ratio = taylor.div(frenet.torsion, frenet.curvature)
    row = [Indicatrix(frenet.T, frenet.N, frenet.B, frenet.curvature, ratio, frenet.speed)]
    while len(row) < count:
        row.append(row[-1].next())
    return tuple(row)


def by_arc_length(x: Array, speed: Array) -> Array:
    """The series of dx/ds, of one order less than x; the speed's may be of any order from there."""
    slope = taylor.derivative(x)
    return taylor.div(slope, speed[: len(slope)])
