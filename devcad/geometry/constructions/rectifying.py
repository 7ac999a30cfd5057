"""Rectifying developables: the curve is a geodesic, it unrolls straight."""

from __future__ import annotations

from typing import Literal

from devcad.geometry.constructions.base import Built, Closable, Extent
from devcad.geometry.constructions.frenet_based import THROUGH_INFLECTIONS, frenet_surface
from devcad.geometry.curves import CurveSpec
from devcad.geometry.indicatrices import indicatrices
from devcad.geometry.taylor import Array


class Rectifying(Closable):
    """The developable on which ``curve`` is a geodesic: c0 = curve, e = unit(tau T + k B).

    Source: geometry.md, section 2 (second row).
    """

    kind: Literal["rectifying"]
    curve: CurveSpec
    extent: Extent

    def build(self) -> Built:
        """One patch, or several where the ruling's course is not smooth.

        Raises:
            GeometryError: the curve stands still, has a corner or an inflection, or its third
                derivative jumps so that the ruling does.
        """
        return frenet_surface(
            self.kind,
            self.curve.curve(),
            _rulings,
            self.extent,
            depth=3,
            instead=THROUGH_INFLECTIONS,
        )


def _rulings(_: Array, jet: Array) -> tuple[Array, Array]:
    """e is the unit Darboux vector, the third side of the frame of N."""
    (frenet,) = indicatrices(jet, 1)
    return jet, frenet.axis
