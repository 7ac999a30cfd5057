"""The frustum between two circles about the z axis."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import model_validator

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    NonNegative,
    Turn,
    circle,
    closes,
    one_panel,
)
from devcad.geometry.curves import FULL_TURN, Positive
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array


class Frustum(Closable):
    """From a circle in z = 0 to one in z = height: a right circular cone or cylinder.

    A radius of 0 is the cone's apex. c0 = the lower circle, t the angle in radians, e towards
    the upper circle, v from 0 to the slant height; the front is the inside.
    """

    kind: Literal["frustum"]
    radius: NonNegative
    top_radius: NonNegative
    height: Positive
    sweep: Turn = FULL_TURN

    @model_validator(mode="after")
    def _has_a_circle(self) -> Frustum:
        if self.radius == self.top_radius == 0.0:
            raise JobError(
                "radius and top_radius are both 0",
                value=0.0,
                limit=0.0,
                remedy="one of them must be positive",
            )
        return self

    def build(self) -> Built:
        """One patch; it closes when sweep is 360 degrees."""
        slant = float(np.hypot(self.top_radius - self.radius, self.height))
        lower = circle(self.radius, self.sweep)
        across = circle((self.top_radius - self.radius) / slant, self.sweep)

        def field(t: Array, order: int) -> RulingJet:
            e = across.jet(t, order)
            e[0, :, 2] = self.height / slant
            return RulingJet(
                lower.jet(t, order),
                e,
                taylor.constant(0.0, order, t.size),
                taylor.constant(slant, order, t.size),
            )

        return one_panel((Patch(field, (0.0, self.sweep)),), closes(self.sweep))
