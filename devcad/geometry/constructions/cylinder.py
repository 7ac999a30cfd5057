"""General cylinders: parallel rulings along any directrix."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    Turn,
    circle,
    constant_extent,
    one_panel,
    require_across,
    sound,
    strip,
)
from devcad.geometry.curve import Curve
from devcad.geometry.curves import FULL_TURN, CurveSpec, Direction, Positive
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.geometry.values import unit


class Cylinder(Closable):
    """Parallel rulings along ``directrix``, or along a circle about z.

    c0 = directrix, e = direction, v the length from the directrix; an extent that is an expression
    gives slanted ends.
    """

    kind: Literal["cylinder"]
    directrix: CurveSpec | None = None
    direction: Direction | None = None
    radius: Positive | None = None
    sweep: Turn | None = None
    extent: Extent | None = None
    length: Positive | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Cylinder:
        if (self.directrix is None) == (self.radius is None):
            raise JobError(
                "a cylinder has either a directrix or a radius",
                remedy="give directrix and direction, or radius",
            )
        if (self.directrix is None) != (self.direction is None):
            raise JobError(
                "directrix and direction belong together",
                remedy="with radius the direction is +z",
            )
        if self.sweep is not None and self.radius is None:
            raise JobError("sweep belongs to radius", remedy="end the directrix where you want")
        if (self.extent is None) == (self.length is None):
            raise JobError(
                "a cylinder has either extent or length",
                remedy="give extent = [from, to], or length for [0, length]",
            )
        return self

    def build(self) -> Built:
        """One patch for each smooth piece of the directrix.

        Raises:
            GeometryError: the directrix runs along the direction somewhere.
        """
        curve = self._curve()
        direction = unit(self.direction or (0.0, 0.0, 1.0))
        extent = self.extent or constant_extent(0.0, self.length or 0.0)
        patches = (_patch(piece, direction, extent) for piece in sound(curve, "directrix"))
        return one_panel(patches, curve.closed)

    def _curve(self) -> Curve:
        if self.directrix is not None:
            return self.directrix.curve()
        return circle(self.radius or 0.0, FULL_TURN if self.sweep is None else self.sweep)


def _patch(piece: Curve, direction: Array, extent: Extent) -> Patch:
    """The rulings on one smooth piece of the directrix."""

    def rays(t: Array, order: int) -> tuple[Array, Array, None]:
        return piece.jet(t, order), taylor.constant_vector(direction, order, t.size), None

    require_across(piece, rays, "the directrix runs along the direction")
    return strip(piece, rays, extent)
