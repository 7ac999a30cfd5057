"""Developables through a curve with prescribed tangent planes."""

from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import frames, taylor
from devcad.geometry.constructions.base import Built, Closable, Extent
from devcad.geometry.constructions.frenet_based import THROUGH_INFLECTIONS, frenet_surface
from devcad.geometry.constructions.sampling import VANISHES, grid, lowest, require_finite
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, ScalarExpression
from devcad.geometry.indicatrices import by_arc_length
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array


class Oriented(Closable):
    """The developable through ``curve`` whose tangent plane there is turned about the tangent.

    ``angle`` (alpha, a number or an expression in t, in degrees) is measured from the osculating
    plane towards B: V = cos(alpha) N + sin(alpha) B lies in the tangent plane. c0 = curve,
    e = unit(tau_g T + k sin(alpha) V), tau_g = tau + d alpha/ds; v = length. 90 makes the curve a
    geodesic; where alpha falls as the torsion turns (tau_g = 0) it is a line of curvature.

    Source: geometry.md, section 3, (3.1).
    """

    kind: Literal["oriented"]
    curve: CurveSpec
    angle: ScalarExpression
    extent: Extent

    def build(self) -> Built:
        """One patch, or several where the ruling's course is not smooth.

        Raises:
            JobError: the angle is not finite.
            GeometryError: the curve stands still, has a corner or an inflection; the tangent
                plane is the osculating plane somewhere; or the ruling jumps at a break.
        """

        def rulings(t: Array, jet: Array) -> tuple[Array, Array]:
            frame = frames.frenet(jet)
            return jet, _ruling(frame, _radians(self.angle, t, len(frame.T)))

        return frenet_surface(
            self.kind,
            self.curve.curve(),
            rulings,
            self.extent,
            depth=3,
            instead=THROUGH_INFLECTIONS,
            require=partial(_require_off_osculating, self.angle),
        )


def _radians(angle: Expression, t: Array, order: int) -> Array:
    """The series of the angle, (order + 1, n)."""
    return np.radians(angle.at(t, order))


def _ruling(frame: frames.Frenet, alpha: Array) -> Array:
    """The series of e (K + 1, n, 3) from the Frenet data to order K and alpha to order K + 1."""
    sine, cosine = taylor.sin_cos(alpha[:-1])
    side = taylor.mul(cosine, frame.N) + taylor.mul(sine, frame.B)
    along = taylor.mul(_geodesic_torsion(frame, alpha), frame.T)
    return taylor.unit(along + taylor.mul(taylor.mul(frame.curvature, sine), side))


def _geodesic_torsion(frame: frames.Frenet, alpha: Array) -> Array:
    """tau_g = tau + d alpha/ds."""
    return frame.torsion + by_arc_length(alpha, frame.speed)


def _require_off_osculating(angle: Expression, curve: Curve) -> None:
    """Raise a GeometryError where the tangent plane is the osculating plane: sin(alpha) = 0.

    The ruling there is the tangent, and the curve runs into its own regression curve; or, when
    tau_g vanishes too, the tangent plane stands still and the formula has no ruling.
    """
    t = grid(curve)
    require_finite(angle.at(t, 3), t, "angle")

    def squared_sine(t: Array, order: int) -> Array:
        sine, _ = taylor.sin_cos(_radians(angle, t, order))
        return taylor.mul(sine, sine)

    at, least = lowest(squared_sine, curve)
    if least > VANISHES**2:
        return
    throughout = bool(squared_sine(t, 0)[0].max() <= VANISHES**2)
    here = np.array([at])
    frame, alpha = frames.frenet(curve.jet(here, 3)), _radians(angle, here, 1)
    still = abs(_geodesic_torsion(frame, alpha)[0, 0]) <= VANISHES * frame.curvature[0, 0]
    raise GeometryError(
        f"oriented: the tangent plane is the osculating plane (angle {np.degrees(alpha[0, 0]):.6g} "
        + f"deg) {'throughout' if throughout else f'at t = {at:.6g}'}: "
        + ("it stands still there and has no ruling" if still else ASYMPTOTIC),
        value=float(np.sqrt(max(least, 0.0))),
        limit=VANISHES,
        remedy=INSTEAD_OF_ASYMPTOTIC if throughout and not still else KEEP_OFF,
    )


ASYMPTOTIC = "the ruling is the curve's tangent, the curve its own regression curve"
INSTEAD_OF_ASYMPTOTIC = 'kind = "tangent" gives that surface, with an extent beside the curve'
KEEP_OFF = (
    "keep the angle between 0 and 180 degrees; with line-of-curvature the tangent plane may pass "
    "through the osculating plane"
)
