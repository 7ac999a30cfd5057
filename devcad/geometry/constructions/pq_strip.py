"""Strips of plane quads between given polylines."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import JobError
from devcad.geometry.constructions.base import Built, Closable
from devcad.geometry.constructions.planar import flattened
from devcad.geometry.constructions.quads import Strip, panels, require_few
from devcad.geometry.curves import Points
from devcad.geometry.taylor import Array


class PqStrip(Closable):
    """Plane quads between ``polylines`` of equally many points: each pair of neighbours makes a
    strip, which is a panel.

    A quad may be a triangle: two neighbours on one polyline coincide, or the polylines meet at an
    end of the strip. A polyline whose last point is its first makes a closed strip. Quads that are
    plane but for rounding are made exactly plane (figures planarity_defect, points_moved_by);
    others twist, which the checks tell.

    c0 = the lower polyline, t = the number of the ruling from 0, e towards the upper one, v from
    0 to the ruling's length. Source: geometry.md, section 11.
    """

    kind: Literal["pq-strip"]
    polylines: Annotated[tuple[Points, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _equally_many(self) -> PqStrip:
        first = len(self.polylines[0])
        for number, polyline in enumerate(self.polylines):
            if len(polyline) < 2:
                raise JobError(
                    f"polyline {number} (counted from 0) has {len(polyline)} points, at least 2 "
                    "are needed",
                    value=len(polyline),
                    limit=2,
                    remedy="give more points",
                )
            if len(polyline) != first:
                raise JobError(
                    f"polyline {number} (counted from 0) has {len(polyline)} points, polyline 0 "
                    f"has {first}",
                    value=len(polyline),
                    limit=first,
                    remedy="every ruling joins one point of each; repeat a point to make a "
                    "triangle",
                )
        return self

    def build(self) -> Built:
        """A panel for each pair of neighbouring polylines, one patch a quad.

        Raises:
            GeometryError: a quad has no area, or its rulings cross; LimitError: too many quads.
        """
        given = np.array(self.polylines)  # (m + 1, n + 1, 3)
        require_few((len(given) - 1) * (given.shape[1] - 1))
        net, moved = flattened(given)
        return panels(_strips(net), _strips(given), moved)


def _strips(net: Array) -> list[Strip]:
    """The strips between neighbouring rows of a net."""
    t = np.arange(float(net.shape[1]))
    return [Strip(lower, upper - lower, t) for lower, upper in pairwise(net)]
