"""Gores: the globe of N tangent cylinders, exactly developable and exactly closed."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, BuiltPanel, Figure, Surface
from devcad.geometry.curves import Positive
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

POLE = 0.5 * math.pi
MOST = 720
"""Gores of a globe at most: half a degree each."""
SAMPLES = 256
"""Points of the trapezoidal rule for a seam, whose speed is periodic: beyond rounding from 64."""


class Gore(Surface):
    """The globe of ``count`` cylinders that touch the sphere of ``radius`` along a meridian each,
    cut off where they meet: one gore, or with ``panels = "all"`` all of them.

    Gore k has its meridian at longitude 360 k / count. c0 = the meridian from the south pole to
    the north, t the latitude in radians, e eastward, v = -+ radius tan(pi / count) cos t; the
    front is the outside. The width vanishes at both poles. Source: geometry.md, section 10.
    """

    kind: Literal["gore"]
    radius: Positive
    count: Annotated[int, Field(strict=True, ge=3, le=MOST)]
    panels: Literal["one", "all"] = "one"

    def build(self) -> Built:
        """A panel of one patch for each gore asked for."""
        return Built(tuple(self._gore(k) for k in range(self.count if self.panels == "all" else 1)))

    def _gore(self, k: int) -> BuiltPanel:
        patch = _patch(self.radius, self.count, 2.0 * math.pi * k / self.count)
        west, east = _seams(patch)
        figures = {
            "count": Figure(float(self.count), 0),
            "radial_error": Figure(_beyond(self.radius, self.count)),
            "seam_west": Figure(west),
            "seam_east": Figure(east),
        }
        note = (
            f"{self.count} gores of this pattern make the globe; it touches the sphere along their "
            "middles and stands off by the figure radial_error at the seams on the equator"
        )
        return BuiltPanel((patch,), figures=figures, notes=(note,))


def _patch(radius: float, count: int, longitude: float) -> Patch:
    """The gore whose meridian has the given longitude in radians."""
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    outward = np.array([math.cos(longitude), math.sin(longitude), 0.0])
    north = np.array([0.0, 0.0, 1.0])
    half = radius * math.tan(math.pi / count)

    def field(t: Array, order: int) -> RulingJet:
        sine, cosine = taylor.sin_cos(taylor.variable(t, order))
        cosine[0][np.abs(t) >= POLE] = 0.0  # the cosine of the float next to pi/2 is 6e-17
        return RulingJet(
            radius * (cosine[..., None] * outward + sine[..., None] * north),
            taylor.constant_vector(east, order, t.size),
            -half * cosine,
            half * cosine,
        )

    return Patch(field, (-POLE, POLE))


def _seams(patch: Patch) -> tuple[float, float]:
    """The lengths of the western and of the eastern edge."""
    t = (np.arange(SAMPLES) + 0.5) * (2.0 * POLE / SAMPLES) - POLE
    jet = patch.jet(t, 1)
    west, east = (
        float(np.linalg.norm(jet.rail(v)[1], axis=1).mean() * 2.0 * POLE)
        for v in (jet.v_from, jet.v_to)
    )
    return west, east


def _beyond(radius: float, count: int) -> float:
    """R (sec x - 1) = R tan x tan(x/2), x = pi / count: how far the seams are outside."""
    return radius * math.tan(math.pi / count) * math.tan(0.5 * math.pi / count)
