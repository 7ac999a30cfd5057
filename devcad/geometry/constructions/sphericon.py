"""The sphericon: four half cones in a row around two semicircles."""

from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, Closable, one_panel
from devcad.geometry.constructions.segments import rods
from devcad.geometry.curves import Positive
from devcad.geometry.taylor import Array

HALF_TURN = float(np.pi)


class Sphericon(Closable):
    """The bitangent developable of two semicircles of ``radius`` about the origin.

    One lies in z = 0, x <= 0 and ends on the y axis, the other in y = 0, x >= 0 and ends on the
    z axis. One closed panel of four half cones: sectors of radius sqrt(2) radius and angle
    pi / sqrt(2), in a row, their apexes by turns on either side. The front is the outside.

    c0 = the point on the first semicircle, e towards the second, v from 0 to sqrt(2) radius; t
    from 0 to 4 pi: each semicircle is run through in pi while the other point stands still.

    Source: geometry.md, section 6.
    """

    kind: Literal["sphericon"]
    radius: Positive

    def build(self) -> Built:
        """One closed panel of four patches."""
        length = float(np.sqrt(2.0)) * self.radius
        return one_panel(
            (
                rods(
                    partial(_ends, self.radius, number),
                    length,
                    (number * HALF_TURN, (number + 1) * HALF_TURN),
                )
                for number in range(4)
            ),
            True,
        )


def _ends(radius: float, number: int, t: Array, order: int) -> tuple[Array, Array]:
    """The series of both points on half cone ``number``: by turns one stands at an end."""
    turned = taylor.variable(t - number * HALF_TURN, order)
    sine, cosine = taylor.sin_cos(turned)
    nothing = np.zeros_like(sine)
    still = taylor.constant(1.0, order, len(t))
    way = 1.0 if number < 2 else -1.0  # there, and back
    if number % 2 == 0:
        first = np.stack([-sine, -way * cosine, nothing], axis=-1)
        second = np.stack([nothing, nothing, way * still], axis=-1)
    else:
        first = np.stack([nothing, way * still, nothing], axis=-1)
        second = np.stack([sine, nothing, way * cosine], axis=-1)
    return radius * first, radius * second
