"""Ruled surfaces from a curve and a direction, or between two rails: the general door."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import model_validator

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    constant_extent,
    one_panel,
    require_apart,
    sound,
    square,
    strip,
)
from devcad.geometry.constructions.sampling import grid, require_finite
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, VectorExpression, vector_jet
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

SAME_FRACTION = 1e-12
"""Two fractions of a rail that differ by less are one corner or break."""


class Ruled(Closable):
    """Rulings along ``direction`` from a ``curve``, or between two ``rails``.

    The rails are joined at equal fractions of their parameters. Whether the rulings make a
    developable is for the checks to say.

    c0 = curve or rails[0], e = the direction or towards rails[1]; the extent is a length, or
    with rails a fraction of the way (default [0, 1]); t is the parameter of c0.

    Source: geometry.md, section 12.
    """

    kind: Literal["ruled"]
    curve: CurveSpec | None = None
    direction: VectorExpression | None = None
    rails: tuple[CurveSpec, CurveSpec] | None = None
    extent: Extent | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Ruled:
        if (self.curve is None) == (self.rails is None):
            raise JobError(
                "a ruled surface has either a curve or rails",
                remedy="give curve and direction, or rails = [curve, curve]",
            )
        if (self.curve is None) != (self.direction is None):
            raise JobError(
                "curve and direction belong together", remedy="with rails there is no direction"
            )
        if self.curve is not None and self.extent is None:
            raise JobError("extent is missing", remedy="give extent = [from, to], lengths")
        return self

    def build(self) -> Built:
        """One patch for each piece between the corners of the curve or of either rail.

        Raises:
            GeometryError: the direction vanishes, or the rails meet.
        """
        if self.rails is not None:
            return _between(self.rails[0].curve(), self.rails[1].curve(), self.extent)
        assert self.curve is not None and self.direction is not None and self.extent is not None
        curve = self.curve.curve()
        patches = (_along(piece, self.direction, self.extent) for piece in sound(curve, "curve"))
        return one_panel(patches, curve.closed)


def _along(piece: Curve, direction: VectorExpression, extent: Extent) -> Patch:
    """The rulings on one smooth piece of the curve."""
    t = grid(piece)
    require_finite(vector_jet(direction, t, 2), t, "direction")
    require_apart(
        piece,
        lambda t, k: square(vector_jet(direction, t, k)),
        "the direction vanishes",
        "end the curve before that point, or change the direction",
    )

    def rays(t: Array, order: int) -> tuple[Array, Array, None]:
        return piece.jet(t, order), taylor.unit(vector_jet(direction, t, order)), None

    return strip(piece, rays, extent)


def _between(first: Curve, second: Curve, extent: Extent | None) -> Built:
    """The chain between two rails."""
    sound(first, "rails[0]")
    sound(second, "rails[1]")
    patches = ladder(first, second, extent or constant_extent(0.0, 1.0))
    return one_panel(patches, first.closed and second.closed)


def ladder(first: Curve, second: Curve, extent: Extent) -> tuple[Patch, ...]:
    """The rulings between two sound rails at equal fractions, a patch for each smooth piece.

    Raises:
        GeometryError: the rails meet.
    """
    first, second = joined(first, second)
    pieces = zip(first.pieces(), second.pieces(), strict=True)
    return tuple(_rungs(a, b, extent) for a, b in pieces)


def _rungs(first: Curve, second: Curve, extent: Extent) -> Patch:
    """The rulings between two smooth pieces."""

    def way(t: Array, order: int) -> Array:
        return second.jet(t, order) - first.jet(t, order)

    def rays(t: Array, order: int) -> tuple[Array, Array, Array]:
        ray = way(t, order)
        return first.jet(t, order), taylor.unit(ray), taylor.norm(ray)

    require_apart(
        first,
        lambda t, k: square(way(t, k)),
        "the rails meet",
        "end the rails before that point; a common end point of all rulings is a cone's apex",
    )
    return strip(first, rays, extent)


def joined(first: Curve, second: Curve) -> tuple[Curve, Curve]:
    """Both rails over the parameter of the first, equal fractions together, each with the
    corners and the breaks of both.

    The second is carried over knot by knot, so that its knots keep their sides to the last bit.
    """
    groups: list[list[_Knot]] = []
    for knot in sorted(_knots(first, 0) + _knots(second, 1), key=lambda knot: knot.fraction):
        if groups and knot.fraction - groups[-1][0].fraction <= SAME_FRACTION:
            groups[-1].append(knot)
        else:
            groups.append([knot])
    here = np.array([_parameter(group, 0, first.domain) for group in groups])
    there = np.array([_parameter(group, 1, second.domain) for group in groups])
    marks = [
        (float(t), any(knot.corner for knot in group))
        for t, group in zip(here[1:-1], groups[1:-1], strict=True)
    ]
    corners = tuple(t for t, corner in marks if corner)
    breaks = tuple(t for t, corner in marks if not corner)
    return (
        replace(first, corners=corners, breaks=breaks),
        Curve(_carried(second, here, there), first.domain, breaks, corners, second.closed),
    )


@dataclass(frozen=True, slots=True)
class _Knot:
    """An end, a break or a corner of a rail: its fraction and its parameter."""

    fraction: float
    t: float
    rail: int
    corner: bool = False


def _knots(curve: Curve, rail: int) -> list[_Knot]:
    """All of them, the ends included."""
    low, high = curve.domain
    ends = [_Knot(0.0, low, rail), _Knot(1.0, high, rail)]
    inner = [(t, False) for t in curve.breaks] + [(t, True) for t in curve.corners]
    return ends + [_Knot((t - low) / (high - low), t, rail, corner) for t, corner in inner]


def _parameter(group: list[_Knot], rail: int, domain: tuple[float, float]) -> float:
    """A rail's own knot in a group of equal fractions, or else the parameter at that fraction."""
    own = [knot.t for knot in group if knot.rail == rail]
    return own[0] if own else domain[0] + group[0].fraction * (domain[1] - domain[0])


def _carried(curve: Curve, here: Array, there: Array) -> Callable[[Array, int], Array]:
    """The jet of a curve whose parameters ``there`` are reached at ``here``, linear between."""
    slopes = np.diff(there) / np.diff(here)
    tops = np.append(np.nextafter(there[1:-1], -np.inf), there[-1])

    def jet(t: Array, order: int) -> Array:
        i = np.clip(np.searchsorted(here, t, side="right") - 1, 0, len(slopes) - 1)
        u = np.clip(there[i] + (t - here[i]) * slopes[i], there[i], tops[i])
        powers = slopes[i] ** np.arange(order + 1)[:, None]
        return np.asarray(powers[:, :, None] * curve.jet(u, order))

    return jet
