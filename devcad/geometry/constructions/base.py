"""What every construction shares: the model's base, strips of rulings, the checks on its curves."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field

from devcad.errors import GeometryError, JobError
from devcad.geometry import jets, taylor
from devcad.geometry.constructions.sampling import (
    VANISHES,
    Scalar,
    grid,
    lowest,
    require_finite,
)
from devcad.geometry.curve import Curve
from devcad.geometry.curves import FULL_TURN, ConstantExpression, Model, ScalarExpression, Sweep
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Built:
    """The panels of a surface, in order."""

    panels: tuple[BuiltPanel, ...]


@dataclass(frozen=True, slots=True)
class BuiltPanel:
    """A chain of patches, the next joined to the previous along a ruling.

    ``base_closed`` says that the base curve returns to its start point. ``drawings`` are lines
    on the sheet, ``figures`` numbers by name that the report repeats in mm, ``notes`` sentences
    that it repeats: what a user must know of this construction. ``rail_fit`` is given by surfaces
    that are looked for between rails. ``flanks`` are further chains of the same sheet, each folded
    along a curved crease. ``holes`` are cut out of it. The sheet lies ``layer`` of its thicknesses
    behind the patches.
    """

    patches: tuple[Patch, ...]
    base_closed: bool = False
    drawings: tuple[Drawing, ...] = ()
    figures: Mapping[str, Figure] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    rail_fit: RailFit | None = None
    flanks: tuple[Flank, ...] = ()
    holes: tuple[Hole, ...] = ()
    layer: float = 0.0


@dataclass(frozen=True, slots=True)
class Hole:
    """A cutout that belongs to the construction, about ``at`` = shares of t and of the extent: a
    slot with round ends, or with ``square`` a rectangle, ``length`` along e and ``width`` across
    it. ``notch`` lets it cross the panel's edges."""

    at: tuple[float, float]
    length: float
    width: float
    square: bool = False
    notch: bool = False


@dataclass(frozen=True, slots=True)
class Flank:
    """A chain of a sheet that hangs on an earlier one along a curved crease.

    The crease is its own base curve c0 (v = 0) and the ``side`` edge of the chain number
    ``parent``: 0 is the panel's ``patches``, k its k-th flank. Patch j lies beside the parent's
    patch j, over the same domain with the same breaks; its rulings point the same way.
    """

    patches: tuple[Patch, ...]
    parent: int
    side: Literal["base", "top"]


@dataclass(frozen=True, slots=True)
class Figure:
    """A number in the job's units to the power ``length``: 1 a length, 2 an area, 0 a ratio."""

    value: float
    length: int = 1


def one_panel(
    patches: Iterable[Patch],
    base_closed: bool = False,
    *,
    drawings: tuple[Drawing, ...] = (),
    figures: Mapping[str, Figure] | None = None,
    notes: tuple[str, ...] = (),
    rail_fit: RailFit | None = None,
) -> Built:
    """A surface of one panel."""
    panel = BuiltPanel(tuple(patches), base_closed, drawings, figures or {}, notes, rail_fit)
    return Built((panel,))


def _counterclockwise(value: float) -> float:
    if value < 0.0:
        raise JobError(
            f"the sweep is {np.degrees(value):.9g} degrees, allowed are 0 to 360 without 0",
            value=float(np.degrees(value)),
            limit=0.0,
            remedy="the surface goes round counterclockwise; place it to turn it",
        )
    return value


TIP = 1e-12
"""A first or last ruling shorter than this share of the widest is a tip."""
NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)]
"""A finite number, 0 or above."""
Turn = Annotated[Sweep, AfterValidator(_counterclockwise)]
"""An angle above 0, at most a full turn: degrees in the job, radians in the model."""


class Surface(Model):
    """A surface of the job file; ``build`` makes its patches, in the job's own units."""

    @abstractmethod
    def build(self) -> Built:
        """The patches.

        Raises:
            JobError: a value is outside its domain; GeometryError: no such developable.
        """


class Closable(Surface):
    """A surface that may close upon itself: where its pattern opens (t), and the gap there."""

    cut: ConstantExpression | None = None
    gap: NonNegative = 0.0


Extent = tuple[ScalarExpression, ScalarExpression]
"""[from, to], numbers or expressions in t."""


def constant_extent(low: float, high: float) -> Extent:
    """The extent [low, high]."""
    return jets.parse(repr(low)), jets.parse(repr(high))


Rays = Callable[[Array, int], tuple[Array, Array, Array | None]]
"""t (n,) and an order K to the series of c0 and e (K + 1, n, 3) and of the length along e that
is one unit of the extent (K + 1, n), None where the extent is a length already."""


def strip(
    piece: Curve,
    rays: Rays,
    extent: Extent,
    *,
    causal: str | None = None,
    tips: bool = False,
) -> Patch:
    """The patch over the domain of a piece of curve.

    ``tips`` lets the first and the last ruling have no length: the extent's ends may coincide
    there, to rounding against the widest ruling.

    Raises:
        JobError: the extent is not finite and increasing on a dense sample.
    """

    def rulings(t: Array, order: int) -> RulingJet:
        c0, e, unit = rays(t, order)
        low, high = (edge.at(t, order) for edge in extent)
        if unit is None:
            return RulingJet(c0, e, low, high)
        return RulingJet(c0, e, taylor.mul(unit, low), taylor.mul(unit, high))

    t = grid(piece)
    edges = [edge.at(t, 2) for edge in extent]
    for name, edge in zip(("from", "to"), edges, strict=True):
        require_finite(edge, t, f"extent: {name}")
    width = edges[1][0] - edges[0][0]
    widest = max(float(width.max()), 0.0)
    if tips:
        ends = (t == piece.domain[0]) | (t == piece.domain[1])
        width = np.where(ends & (np.abs(width) <= TIP * widest), widest, width)
    worst = int(np.argmin(width))
    if not width[worst] > TIP * widest:
        low, high = (float(edge[0, worst]) for edge in edges)
        raise JobError(
            f"extent: from = {low:.6g} is not below to = {high:.6g} at t = {t[worst]:.6g}",
            value=low,
            limit=high,
            remedy="give from < to for every t",
        )
    return Patch(rulings, piece.domain, piece.breaks, causal)


def sound(curve: Curve, name: str, *, order: int = 2) -> tuple[Curve, ...]:
    """The curve's smooth pieces, each finite with its derivatives up to ``order`` and nowhere
    standing still.

    Raises:
        JobError: a value or derivative is not a number; GeometryError: the speed vanishes.
    """
    pieces = curve.pieces()
    for piece in pieces:
        t = grid(piece)
        require_finite(piece.jet(t, order), t, name)
        require_apart(
            piece,
            partial(_squared_speed, piece),
            f"{name}: the curve stands still",
            "end the curve before that point, or give it another parameter",
        )
    return pieces


def smooth(curve: Curve, name: str, *, order: int = 2) -> Curve:
    """The curve itself, which must be one sound piece: its tangent is needed everywhere.

    Raises:
        GeometryError: the curve has a corner; and as ``sound``.
    """
    if curve.corners:
        at = curve.corners[0]
        raise GeometryError(
            f"{name}: the tangent jumps at the corner t = {at:.6g}",
            value=at,
            remedy="round the corner (corner_radius), or make one panel of each side",
        )
    return sound(curve, name, order=order)[0]


def require_apart(piece: Curve, squared: Scalar, what: str, remedy: str) -> None:
    """Raise a GeometryError where a squared length vanishes against its largest value."""
    largest = float(squared(grid(piece), 0)[0].max())
    at, least = lowest(squared, piece)
    if not least > VANISHES**2 * largest:
        raise GeometryError(
            f"{what} at t = {at:.6g}",
            value=float(np.sqrt(max(least, 0.0))),
            limit=VANISHES * float(np.sqrt(largest)),
            remedy=remedy,
        )


def require_across(
    piece: Curve,
    rays: Rays,
    what: str,
    remedy: str = "the surface has no tangent plane there; end the curve before that point",
) -> None:
    """Raise a GeometryError where the curve runs along the rulings."""

    def squared_sine(t: Array, order: int) -> Array:
        e, along = rays(t, order)[1], velocity(piece, t, order)
        return taylor.div(square(taylor.cross(e, along)), square(along))

    at, least = lowest(squared_sine, piece)
    if not least > VANISHES**2:
        raise GeometryError(
            f"{what} at t = {at:.6g}",
            value=float(np.sqrt(max(least, 0.0))),
            limit=VANISHES,
            remedy=remedy,
        )


def velocity(curve: Curve, t: Array, order: int) -> Array:
    """The series of r' (order + 1, n, 3)."""
    return taylor.derivative(curve.jet(t, order + 1))


def _squared_speed(curve: Curve, t: Array, order: int) -> Array:
    return square(velocity(curve, t, order))


def square(x: Array) -> Array:
    """The series of |x|^2."""
    return taylor.dot(x, x)


def circle(radius: float, sweep: float) -> Curve:
    """The circle about z from (radius, 0, 0), counterclockwise through ``sweep`` radians."""

    def jet(t: Array, order: int) -> Array:
        sine, cosine = taylor.sin_cos(taylor.variable(t, order))
        return radius * np.stack([cosine, sine, np.zeros_like(sine)], axis=-1)

    return Curve(jet, (0.0, sweep), closed=closes(sweep))


def closes(sweep: float) -> bool:
    """Whether a sweep is a whole turn, to rounding."""
    return sweep >= FULL_TURN * (1.0 - 1e-12)
