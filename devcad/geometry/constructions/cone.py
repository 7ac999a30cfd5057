"""General cones: rulings from an apex through any directrix."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    constant_extent,
    one_panel,
    require_across,
    require_apart,
    sound,
    square,
    strip,
)
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, Vector
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array


class Cone(Closable):
    """Rulings from ``apex`` through ``directrix``; the extent counts fractions of the way.

    c0 = apex, e towards the directrix, v = fraction x distance.
    """

    kind: Literal["cone"]
    apex: Vector
    directrix: CurveSpec
    extent: Extent = Field(default_factory=lambda: constant_extent(0.0, 1.0))

    def build(self) -> Built:
        """One patch for each smooth piece of the directrix; a straight piece gives a plane.

        Raises:
            GeometryError: the directrix passes through the apex, or heads for it.
        """
        curve = self.directrix.curve()
        apex = np.array(self.apex)
        patches = (_patch(piece, apex, self.extent) for piece in sound(curve, "directrix"))
        return one_panel(patches, curve.closed)


def _patch(piece: Curve, apex: Array, extent: Extent) -> Patch:
    """The rulings through one smooth piece of the directrix."""

    def way(t: Array, order: int) -> Array:
        out = piece.jet(t, order)
        out[0] = out[0] - apex
        return out

    def rays(t: Array, order: int) -> tuple[Array, Array, Array]:
        ray = way(t, order)
        return taylor.constant_vector(apex, order, t.size), taylor.unit(ray), taylor.norm(ray)

    require_apart(
        piece,
        lambda t, k: square(way(t, k)),
        "the directrix passes through the apex",
        "move the apex off the directrix",
    )
    require_across(piece, rays, "the directrix heads for the apex")
    return strip(piece, rays, extent)
