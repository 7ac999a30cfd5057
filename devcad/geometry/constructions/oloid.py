"""The oloid: the developable around two circles that pass through each other's centre."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import Literal

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, Closable, one_panel
from devcad.geometry.constructions.segments import rods
from devcad.geometry.curves import FULL_TURN, Positive
from devcad.geometry.taylor import Array


class Oloid(Closable):
    """The bitangent developable of two circles of ``radius`` in planes square to each other.

    Circle A lies in z = 0 about (0, -radius/2, 0), circle B in x = 0 about (0, radius/2, 0). One
    closed panel that begins and ends with the ruling at alpha = -120 degrees, the angle on circle
    A from (0, -3/2 radius, 0) towards +x; the pattern is two mirrored halves (z < 0, z > 0)
    joined along the ruling alpha = 120 degrees. The front is the outside.

    c0 = the point on circle A, e towards circle B, v from 0 to sqrt(3) radius; t from 0 to 2 pi,
    a multiple of pi/2 where one of the two points turns back.

    Source: geometry.md, section 6; Dirnboeck and Stachel, The Development of the Oloid (1997).
    With X = sin(alpha/2), Y = sin(beta/2) the pairs are (1 - X^2)(1 - Y^2) = 1/4, in polar
    coordinates X = R cos t', R^2 = 3/2 / (1 + sqrt(1 - 3/4 sin^2 2t')): analytic all round.
    """

    kind: Literal["oloid"]
    radius: Positive

    def build(self) -> Built:
        """One closed panel of four patches."""
        ends = partial(_ends, self.radius)
        length = float(np.sqrt(3.0)) * self.radius
        corners = np.linspace(0.0, FULL_TURN, 5).tolist()
        return one_panel((rods(ends, length, quarter) for quarter in pairwise(corners)), True)


def _ends(radius: float, t: Array, order: int) -> tuple[Array, Array]:
    """The series of the points on circle A and on circle B."""
    # t' = pi + t: alpha rises from -120 degrees while beta < 0
    double = 2.0 * taylor.variable(t, order)
    wave = taylor.sin_cos(double)[0]
    under = -0.75 * taylor.mul(wave, wave)
    under[0] += 1.0
    below = taylor.sqrt(under)
    below[0] += 1.0
    reach = taylor.sqrt(1.5 * taylor.reciprocal(below))
    sine, cosine = taylor.sin_cos(taylor.variable(t, order))
    x, y = -taylor.mul(reach, cosine), -taylor.mul(reach, sine)
    (sine_a, cosine_a), (sine_b, cosine_b) = _doubled(x), _doubled(y)
    half = taylor.constant(0.5, order, len(t))
    nothing = np.zeros_like(half)
    first = np.stack([sine_a, -half - cosine_a, nothing], axis=-1)
    second = np.stack([nothing, half + cosine_b, sine_b], axis=-1)
    return radius * first, radius * second


def _doubled(x: Array) -> tuple[Array, Array]:
    """Sine and cosine of the angle whose half has the sine x, |x| < 1."""
    square = taylor.mul(x, x)
    rest = -square
    rest[0] += 1.0
    cosine = -2.0 * square
    cosine[0] += 1.0
    return 2.0 * taylor.mul(x, taylor.sqrt(rest)), cosine
