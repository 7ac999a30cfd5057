"""Tangent surfaces: the rulings are a space curve's tangents."""

from __future__ import annotations

from typing import Literal

from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, Closable, Extent, one_panel, smooth, strip
from devcad.geometry.curves import CurveSpec
from devcad.geometry.taylor import Array


class Tangent(Closable):
    """The tangents of ``curve``, which is the surface's regression curve.

    c0 = curve, e = T, v = length from it.

    Source: geometry.md, section 2 (first row).
    """

    kind: Literal["tangent"]
    curve: CurveSpec
    extent: Extent

    def build(self) -> Built:
        """One patch.

        Raises:
            GeometryError: the curve stands still or has a corner.
        """
        curve = self.curve.curve()
        piece = smooth(curve, "curve", order=3)

        def rays(t: Array, order: int) -> tuple[Array, Array, None]:
            jet = piece.jet(t, order + 1)
            return jet[:-1], taylor.unit(taylor.derivative(jet)), None

        return one_panel((strip(piece, rays, self.extent),), curve.closed)
