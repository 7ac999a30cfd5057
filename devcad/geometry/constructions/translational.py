"""Translational and scale-translational surfaces as strips of plane quads."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema

from devcad.geometry import jets
from devcad.geometry.constructions.base import Built, Closable
from devcad.geometry.constructions.quads import Strip, panels, require_few
from devcad.geometry.constructions.sampling import require_finite
from devcad.geometry.curve import Curve
from devcad.geometry.curves import Count, CurveSpec, ScalarExpression
from devcad.geometry.taylor import Array


def _both(value: Any) -> Any:
    return (value, value) if isinstance(value, int) else value


Counts = Annotated[
    tuple[Count, Count],
    BeforeValidator(_both),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "integer", "minimum": 1},
                {
                    "type": "array",
                    "items": {"type": "integer", "minimum": 1},
                    "minItems": 2,
                    "maxItems": 2,
                },
            ]
        }
    ),
]
"""[m, n]; one number is both."""


class Translational(Closable):
    """The points S(u, v) = profile(u) + scale(u) path(v) as ``count`` strips of plane quads.

    ``curves`` = [profile, path], ``scale`` an expression in the profile's parameter, ``count``
    = [m, n] equal steps of the profile's and of the path's parameter; one number is both. Strip
    i is a panel, joined along the rulings S(u_i, v_j) to S(u_i+1, v_j): parallelograms, or
    trapezoids where the scale changes.

    c0 = the polyline of u_i, t the path's parameter, e towards u_i+1, v from 0 to the ruling's
    length. Source: geometry.md, section 11.
    """

    kind: Literal["translational"]
    curves: tuple[CurveSpec, CurveSpec]
    scale: ScalarExpression = Field(default_factory=lambda: jets.parse("1"))
    count: Counts

    def build(self) -> Built:
        """A panel for each of the m strips, n patches each.

        Raises:
            GeometryError: a quad has no area, or its rulings cross; LimitError: too many quads.
        """
        m, n = self.count
        require_few(m * n)
        (u, profile), (v, path) = (
            _samples(spec.curve(), number, name)
            for spec, number, name in zip(self.curves, (m, n), ("profile", "path"), strict=True)
        )
        scale = self.scale.at(u, 0)
        require_finite(scale, u, "scale")
        # the rulings from the differences themselves: parallel ones are so to the last bit
        growth = np.diff(scale[0])[:, None, None] * path  # (m, n + 1, 3)
        ways = np.diff(profile, axis=0)[:, None] + growth
        lower = profile[:, None] + scale[0][:, None, None] * path
        return panels([Strip(lower[i], ways[i], v) for i in range(m)])


def _samples(curve: Curve, number: int, name: str) -> tuple[Array, Array]:
    """``number`` + 1 equal steps of the parameter and the points there, (number + 1, 3)."""
    t = np.linspace(*curve.domain, number + 1)
    jet = curve.jet(t, 0)
    require_finite(jet, t, f"curves: {name}")
    points = np.array(jet[0])
    if curve.closed:
        points[-1] = points[0]
    return t, points
