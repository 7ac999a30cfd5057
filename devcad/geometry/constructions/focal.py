"""Focal (polar) developables: the envelope of a curve's normal planes."""

from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import frames, taylor
from devcad.geometry.constructions.base import Built, Closable, Extent
from devcad.geometry.constructions.frenet_based import frenet_surface
from devcad.geometry.constructions.sampling import VANISHES, grid, lowest
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec
from devcad.geometry.indicatrices import by_arc_length
from devcad.geometry.taylor import Array


class Focal(Closable):
    """The envelope of the normal planes of ``curve``: c0 = r + N/k, e = B, v = length.

    c0 are the centres of curvature, and every point of a ruling is the same distance from three
    consecutive points of the curve. The regression curve are the centres of the osculating
    spheres: over a spherical curve the surface is a cone whose apex is the sphere's centre, over
    a plane curve a cylinder on its evolute.

    Source: geometry.md, section 2 (last row).
    """

    kind: Literal["focal"]
    curve: CurveSpec
    extent: Extent

    def build(self) -> Built:
        """One patch, or several where the ruling's course is not smooth.

        Raises:
            GeometryError: the curve stands still, has a corner or an inflection, its second
                derivative jumps so that the ruling does, or the ruling stands still.
        """
        return frenet_surface(
            self.kind,
            self.curve.curve(),
            _rulings,
            self.extent,
            depth=3,
            require=_require_moving,
        )


def _rulings(_: Array, jet: Array) -> tuple[Array, Array]:
    frame = frames.frenet(jet)
    centre = taylor.div(frame.N, frame.curvature)
    return jet[: len(centre)] + centre, frame.B


def _require_moving(curve: Curve) -> None:
    """Raise a GeometryError where the ruling stands still: d(1/k)/ds = 0 and tau = 0.

    c0' = (1/k)' N + (tau/k) B and e' = -tau N: nothing crosses the ruling there, and the surface,
    a cylinder on a cusp of the evolute to first order, is bent without limit.
    """
    at, least = lowest(partial(motion, curve), curve)
    if least > VANISHES**2:
        return
    throughout = bool(motion(curve, grid(curve), 0)[0].max() <= VANISHES**2)
    raise GeometryError(
        "focal: "
        + (
            "the curve is made of circular arcs, whose normal planes meet in one line"
            if throughout
            else f"the ruling stands still at t = {at:.6g} (a vertex of the curve without "
            "torsion): the surface ends or folds back in an edge there"
        ),
        value=float(np.sqrt(max(least, 0.0))),
        limit=VANISHES,
        remedy="no surface comes of a circle; give another curve"
        if throughout
        else "keep the curve away from that point",
    )


def motion(curve: Curve, t: Array, order: int) -> Array:
    """The series of (d(1/k)/ds)^2 + (tau/k)^2, which vanishes where the ruling stands still."""
    frame = frames.frenet(curve.jet(t, order + 4))
    radius = taylor.reciprocal(frame.curvature)
    lean = taylor.mul(frame.torsion, radius)[: order + 1]
    growth = by_arc_length(radius, frame.speed)
    return taylor.mul(growth, growth) + taylor.mul(lean, lean)
