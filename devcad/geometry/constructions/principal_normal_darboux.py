"""Principal-normal Darboux developables: Darboux developables of the principal normal's image."""

from __future__ import annotations

from typing import Literal

from devcad.geometry.constructions.base import Built, Closable, Extent
from devcad.geometry.constructions.frenet_based import frenet_surface
from devcad.geometry.curves import CurveSpec, Positive
from devcad.geometry.indicatrices import indicatrices
from devcad.geometry.taylor import Array


class PrincipalNormalDarboux(Closable):
    """The Darboux developable of the curve that N runs through: c0 = scale B_N, e = Cc.

    Cc = (-k T + tau B)/W is that curve's tangent and B_N its binormal; v = length after scaling.
    The regression curve is v = scale psi. It is a cone over a clad helix (psi constant) and a
    plane fan about scale B_N over a slant helix (psi = 0).

    Source: geometry.md, section 2 (fourth row). The definition was reconstructed there (the
    N-indicatrix in place of the curve), not compared with the paper of Takahashi and Takeuchi:
    the sign of psi may differ.
    """

    kind: Literal["principal-normal-darboux"]
    curve: CurveSpec
    extent: Extent
    scale: Positive = 1.0

    def build(self) -> Built:
        """One patch, or several where the ruling's course is not smooth.

        Raises:
            GeometryError: the curve stands still, has a corner or an inflection, or its third or
                fourth derivative jumps so that the ruling does.
        """

        def rulings(_: Array, jet: Array) -> tuple[Array, Array]:
            normal = indicatrices(jet, 2)[1]
            return self.scale * normal.axis, normal.y

        return frenet_surface(self.kind, self.curve.curve(), rulings, self.extent, depth=4)
