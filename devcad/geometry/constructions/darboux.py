"""Darboux developables: the tangents' directions as rulings, along the binormal image."""

from __future__ import annotations

from typing import Literal

from devcad.geometry.constructions.base import Built, Closable, Extent
from devcad.geometry.constructions.frenet_based import frenet_surface
from devcad.geometry.curves import CurveSpec, Positive
from devcad.geometry.indicatrices import indicatrices
from devcad.geometry.taylor import Array


class Darboux(Closable):
    """The Darboux developable of ``curve``: c0 = scale B, e = T, v = length after scaling.

    Its regression curve, v = scale tau/k, is the modified Darboux vector (tau/k) T + B, times
    ``scale`` (lengths per unit). It is a cone over a cylindrical helix (tau/k constant) and a plane
    fan about scale B over a plane curve.

    Source: geometry.md, section 2 (third row).
    """

    kind: Literal["darboux"]
    curve: CurveSpec
    extent: Extent
    scale: Positive = 1.0

    def build(self) -> Built:
        """One patch, or several where the ruling's course is not smooth.

        Raises:
            GeometryError: the curve stands still, has a corner or an inflection, or its second
                derivative jumps so that the ruling does.
        """

        def rulings(_: Array, jet: Array) -> tuple[Array, Array]:
            (frenet,) = indicatrices(jet, 1)
            return self.scale * frenet.z, frenet.x

        return frenet_surface(self.kind, self.curve.curve(), rulings, self.extent, depth=3)
