"""The rectangle [0, width] x [0, height] in z = 0."""

from __future__ import annotations

from typing import Literal

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, Surface, one_panel
from devcad.geometry.curves import Positive
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array


class Plane(Surface):
    """A flat rectangle: c0 = (0, t, 0), e = +x, front up."""

    kind: Literal["plane"]
    width: Positive
    height: Positive

    def build(self) -> Built:
        """One patch, t from 0 to height, v from 0 to width."""

        def field(t: Array, order: int) -> RulingJet:
            zero = taylor.constant(0.0, order, t.size)
            return RulingJet(
                np.stack([zero, taylor.variable(t, order), zero], axis=-1),
                taylor.constant_vector((1.0, 0.0, 0.0), order, t.size),
                zero,
                taylor.constant(self.width, order, t.size),
            )

        return one_panel((Patch(field, (0.0, self.height)),))
