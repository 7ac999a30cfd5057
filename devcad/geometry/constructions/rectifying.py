"""Rectifying developables: the curve is a geodesic, it unrolls straight."""

from __future__ import annotations

from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    one_panel,
    smooth,
    square,
    strip,
    velocity,
)
from devcad.geometry.constructions.sampling import VANISHES, grid, lowest
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec
from devcad.geometry.taylor import Array

SAME_RULING = 1e-9
"""Two unit rulings on the two sides of a break that differ by less are one."""


class Rectifying(Closable):
    """The developable on which ``curve`` is a geodesic: c0 = curve, e = unit(tau T + k B).

    Source: geometry.md, section 2 (second row).
    """

    kind: Literal["rectifying"]
    curve: CurveSpec
    extent: Extent

    def build(self) -> Built:
        """One patch.

        Raises:
            GeometryError: the curve stands still, has a corner or an inflection, or its third
                derivative jumps so that the ruling does.
        """
        curve = self.curve.curve()
        piece = smooth(curve, "curve", order=3)
        _require_bent(piece)
        _require_one_ruling(piece)

        def rays(t: Array, order: int) -> tuple[Array, Array, None]:
            jet = piece.jet(t, order + 3)
            return jet[: order + 1], _ruling(jet), None

        return one_panel((strip(piece, rays, self.extent),), curve.closed)


def _ruling(jet: Array) -> Array:
    """The series of e (K + 1, n, 3) from that of the curve (K + 4, n, 3).

    With w = r' x r'': tau T + k B = (det(r', r'', r''') |r'|^2 r' + |w|^2 w) / (|w|^2 |r'|^3).
    """
    first = taylor.derivative(jet)
    second = taylor.derivative(first)
    third = taylor.derivative(second)
    order = len(third)
    first, w = first[:order], taylor.cross(first[:order], second[:order])
    along = taylor.mul(taylor.dot(w, third), square(first))
    return taylor.unit(taylor.mul(taylor.div(along, square(w)), first) + w)


def _require_bent(piece: Curve) -> None:
    """Raise a GeometryError where the curvature vanishes: N and B change sides there."""

    def bending(t: Array, order: int) -> Array:
        """k^2 by the series of r' and r''."""
        first = velocity(piece, t, order + 1)
        second = taylor.derivative(first)
        first = first[: order + 1]
        return taylor.div(square(taylor.cross(first, second)), taylor.power(square(first), 3.0))

    largest = float(bending(grid(piece), 0)[0].max())
    at, least = lowest(bending, piece)
    t = grid(piece)
    extent = float(np.ptp(piece.jet(t, 0)[0], axis=0).max())
    if least > VANISHES**2 * max(largest, extent**-2):
        return
    raise GeometryError(
        f"rectifying: the curve has an inflection (curvature 0) at t = {at:.6g}",
        value=float(np.sqrt(max(least, 0.0))),
        limit=VANISHES * float(np.sqrt(max(largest, extent**-2))),
        remedy="split the curve there, or use line-of-curvature, which works through inflections",
    )


def _require_one_ruling(piece: Curve) -> None:
    """Raise a GeometryError at a break where the ruling jumps with the third derivative."""
    if not piece.breaks:
        return
    after = np.array(piece.breaks)
    before = np.nextafter(after, piece.domain[0])
    jump = np.linalg.norm(
        _ruling(piece.jet(after, 3))[0] - _ruling(piece.jet(before, 3))[0], axis=1
    )
    worst = int(np.argmax(jump))
    if jump[worst] <= SAME_RULING:
        return
    raise GeometryError(
        f"rectifying: the torsion jumps at t = {after[worst]:.6g}, "
        f"so the ruling turns there by {np.degrees(jump[worst]):.3g} deg",
        value=float(jump[worst]),
        limit=SAME_RULING,
        remedy="give the curve a continuous third derivative: degree = 5 for points",
    )
