"""The curve kinds of a job file: what may be written, and the Curve that it means.

One pydantic model a kind, each with ``curve()``; ``CurveSpec`` is their union. Lengths are in
the job's units, whatever they are: nothing here depends on the scale except the gap allowed in
a chain, which reads ``mm_per_unit`` from the validation context (default 1). Angles are degrees
in the job and radians in the model. ``curves_fields`` holds the annotated types.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    Field,
    GetJsonSchemaHandler,
    PrivateAttr,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from devcad.errors import JobError
from devcad.geometry import jets, linked, locus, natural, paths, splines, values
from devcad.geometry.curve import Curve, ends_meet, samples
from devcad.geometry.curves_fields import ConstantExpression as ConstantExpression
from devcad.geometry.curves_fields import Count as Count
from devcad.geometry.curves_fields import Degrees as Degrees
from devcad.geometry.curves_fields import Direction as Direction
from devcad.geometry.curves_fields import Flag as Flag
from devcad.geometry.curves_fields import Interval as Interval
from devcad.geometry.curves_fields import Model as Model
from devcad.geometry.curves_fields import Number as Number
from devcad.geometry.curves_fields import Points as Points
from devcad.geometry.curves_fields import Positive as Positive
from devcad.geometry.curves_fields import ScalarExpression as ScalarExpression
from devcad.geometry.curves_fields import SurfaceExpression as SurfaceExpression
from devcad.geometry.curves_fields import Sweep as Sweep
from devcad.geometry.curves_fields import Vector as Vector
from devcad.geometry.curves_fields import VectorExpression as VectorExpression
from devcad.geometry.curves_fields import vector_jet as vector_jet
from devcad.geometry.jets import Expression
from devcad.geometry.values import unit as unit

FULL_TURN = 2.0 * math.pi
MAX_GAP = 1e-6  # mm, between the curves of a chain


# --- the kinds -----------------------------------------------------------------------------


class CurveModel(Model):
    """A curve kind; ``uniform`` says that its parameter is proportional to its length."""

    uniform: ClassVar[bool] = False

    @abstractmethod
    def curve(self) -> Curve:
        """The curve, in the job's units."""


class ExpressionCurve(CurveModel):
    """x, y and z as expressions in t."""

    kind: Literal["expression"]
    x: ScalarExpression
    y: ScalarExpression
    z: ScalarExpression
    t: Interval

    def curve(self) -> Curve:
        """The curve; JobError where a coordinate is not a finite number."""
        parts = (self.x, self.y, self.z)
        curve = Curve(partial(vector_jet, parts), self.t)
        t = samples(curve)
        coordinates = curve.point(t)
        bad = np.argwhere(~np.isfinite(coordinates))
        if len(bad):
            row, axis = bad[0]
            raise JobError(
                f"{'xyz'[axis]} = {jets.shown(parts[axis].text)} is not a finite number at"
                f" t = {t[row]:.9g}",
                value=float(t[row]),
                remedy="change the expression or the interval t",
            )
        return replace(curve, closed=ends_meet(curve))


class PointsCurve(CurveModel):
    """A spline through points: C4 by default, not-a-knot ends, periodic when closed."""

    kind: Literal["points"]
    points: Points | None = None
    file: str | None = None
    closed: Flag = False
    degree: Literal[3, 5] = 5

    @model_validator(mode="after")
    def _check(self) -> PointsCurve:
        if (self.points is None) == (self.file is None):
            raise JobError(
                "a points curve needs points or a file, one of the two",
                remedy='write points = [[x, y, z], ...] or file = "rail.csv"',
            )
        if self.points is not None:
            values.distinct(self.points, self.closed, 3 if self.closed else 2)
        return self

    def curve(self) -> Curve:
        """The curve; the points of a file must have been put in place of its name."""
        if self.points is None:
            raise JobError(f"the points of {self.file!r:.200} were not read", value=self.file)
        points = values.distinct(self.points, self.closed, 3 if self.closed else 2)
        if self.closed:
            return splines.interpolating_closed(points, self.degree)
        return splines.interpolating(points, self.degree)


class BsplineCurve(CurveModel):
    """A B-spline, rational with weights."""

    kind: Literal["bspline"]
    degree: Annotated[int, Field(strict=True, ge=1, le=values.MAX_DEGREE)]
    knots: tuple[Number, ...]
    control_points: Points
    weights: tuple[Positive, ...] | None = None

    @model_validator(mode="after")
    def _check(self) -> BsplineCurve:
        values.check_bspline(self.degree, self.knots, len(self.control_points), self.weights)
        return self

    def curve(self) -> Curve:
        """The curve."""
        weights = None if self.weights is None else np.array(self.weights)
        return splines.bspline(
            self.degree, np.array(self.knots), np.array(self.control_points), weights
        )


class PolylineCurve(CurveModel):
    """Straight sides between points, the corners kept or rounded by arcs."""

    uniform: ClassVar[bool] = True
    kind: Literal["polyline"]
    points: Points
    closed: Flag = False
    corner_radius: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)] = 0.0

    @model_validator(mode="after")
    def _check(self) -> PolylineCurve:
        self.curve()
        return self

    def curve(self) -> Curve:
        """The curve."""
        points = values.distinct(self.points, self.closed, 3 if self.closed else 2)
        return paths.polyline(points, closed=self.closed, radius=self.corner_radius)


class LineCurve(CurveModel):
    """A straight line."""

    uniform: ClassVar[bool] = True
    kind: Literal["line"]
    start: Vector = Field(alias="from")
    end: Vector = Field(alias="to")

    @model_validator(mode="after")
    def _check(self) -> LineCurve:
        values.distinct((self.start, self.end), False, 2)
        return self

    def curve(self) -> Curve:
        """The curve."""
        return paths.line(self.start, self.end)


class ChainCurve(CurveModel):
    """Curves end to end."""

    uniform: ClassVar[bool] = True
    kind: Literal["chain"]
    curves: Annotated[tuple[CurveSpec, ...], Field(min_length=1)]
    closed: Flag = False
    _gap: float = PrivateAttr(default=MAX_GAP)

    @model_validator(mode="after")
    def _read_unit(self, info: ValidationInfo) -> ChainCurve:
        self._gap = MAX_GAP / float((info.context or {}).get("mm_per_unit", 1.0))
        return self

    def curve(self) -> Curve:
        """The curve; JobError where two curves do not meet within 1e-6 mm."""
        return linked.chain(
            [part.curve() for part in self.curves],
            [part.uniform for part in self.curves],
            gap=self._gap,
            closed=self.closed,
        )


class _Round(CurveModel):
    """What circle and ellipse share."""

    center: Vector = paths.ORIGIN
    normal: Direction = (0.0, 0.0, 1.0)
    x_axis: Direction | None = None
    start: Degrees = 0.0
    sweep: Sweep = FULL_TURN

    @model_validator(mode="after")
    def _check(self) -> Self:
        values.plane_axes(self.normal, self.x_axis)
        return self

    def _arc(self, a: float, b: float) -> Curve:
        """P = center + a cos X + b sin Y of the angle that starts at ``start``.

        t grows from start by the angle swept, also clockwise: there the angle is 2 start - t.
        """
        x, y = values.plane_axes(self.normal, self.x_axis)
        turn = math.copysign(1.0, self.sweep)
        part = paths.Screw(self.center, u=a * x, v=b * y, omega=turn, phase=self.start)
        return paths.screw(part, (self.start, self.start + abs(self.sweep)))


class CircleCurve(_Round):
    """A circle or an arc of one."""

    uniform: ClassVar[bool] = True
    kind: Literal["circle"]
    radius: Positive

    def curve(self) -> Curve:
        """The curve."""
        return self._arc(self.radius, self.radius)


class EllipseCurve(_Round):
    """An ellipse or an arc of one; its parameter is the eccentric angle."""

    kind: Literal["ellipse"]
    radii: tuple[Positive, Positive]

    def curve(self) -> Curve:
        """The curve."""
        return self._arc(*self.radii)


class HelixCurve(CurveModel):
    """A helix about +z from (radius, 0, 0); negative pitch: left-handed."""

    uniform: ClassVar[bool] = True
    kind: Literal["helix"]
    radius: Positive
    pitch: Number
    turns: Positive

    @model_validator(mode="after")
    def _check(self) -> HelixCurve:
        if self.pitch == 0.0:
            raise JobError("the pitch of the helix is 0", value=0.0, remedy="use a circle")
        return self

    def curve(self) -> Curve:
        """The curve."""
        part = paths.Screw(
            paths.ORIGIN,
            slope=(0.0, 0.0, self.pitch / FULL_TURN),
            u=(self.radius, 0.0, 0.0),
            v=(0.0, self.radius, 0.0),
            omega=1.0,
        )
        return paths.screw(part, (0.0, FULL_TURN * self.turns))


class NaturalCurve(CurveModel):
    """The curve with given curvature and torsion; its parameter is the arc length."""

    uniform: ClassVar[bool] = True
    kind: Literal["natural"]
    curvature: ScalarExpression
    torsion: ScalarExpression
    t: Interval
    origin: Vector = paths.ORIGIN
    frame: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @model_validator(mode="after")
    def _check(self) -> NaturalCurve:
        values.orthonormal(self.frame)
        return self

    def curve(self) -> Curve:
        """The curve."""
        frame = values.orthonormal(self.frame)
        return natural.natural(
            self.curvature.at, self.torsion.at, self.t, np.array(self.origin), frame
        )


class _OrFormula:
    """In the JSON Schema: the same, or a text."""

    def __get_pydantic_json_schema__(
        self, core: Any, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler(core)]}


def _or_formula(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """A text is an expression in x, y and z, anything else a curve."""
    if isinstance(value, str | Expression):
        return values.expression(value, ("x", "y", "z"))
    return handler(value)


class PseudoAntipodalCurve(CurveModel):
    """Points s C + (1 - s) D: the line from C through a fixed point meets the shape again in D.

    C runs along the curve ``on``, or along ``curve`` on the surface on = 0; ``point`` is A.
    With ``from`` = "D" the points are s D + (1 - s) C. s may be an expression in t.

    Source: geometry.md, section 5 (Yang); which end s counts from is reconstructed.
    """

    kind: Literal["pseudo-antipodal"]
    on: Annotated[CurveSpec, WrapValidator(_or_formula), _OrFormula()]
    curve_on: CurveSpec | None = Field(default=None, alias="curve")
    point: Vector
    s: ScalarExpression
    start: Literal["C", "D"] = Field(default="C", alias="from")

    @model_validator(mode="after")
    def _one_form(self) -> PseudoAntipodalCurve:
        if (self._formula is None) == (self.curve_on is None):
            return self
        raise JobError(
            "a pseudo-antipodal curve is on a curve, or on a surface with a curve on that",
            remedy='on = curve, or on = "f(x, y, z)" and curve = C(t), which lies on f = 0',
        )

    @property
    def _formula(self) -> Expression | None:
        """The surface's expression."""
        on: Any = self.on
        return on if isinstance(on, Expression) else None

    def curve(self) -> Curve:
        """The curve."""
        point, formula = np.array(self.point), self._formula
        if formula is None or self.curve_on is None:
            curve = self.on.curve()
            other = locus.on_curve(curve, point)
        else:
            curve = self.curve_on.curve()
            other = locus.on_surface(formula, curve, point)
        pair = (curve, other) if self.start == "C" else (other, curve)
        return locus.blended(*pair, self.s)


CurveSpec = Annotated[
    ExpressionCurve
    | PointsCurve
    | BsplineCurve
    | PolylineCurve
    | LineCurve
    | ChainCurve
    | CircleCurve
    | EllipseCurve
    | HelixCurve
    | NaturalCurve
    | PseudoAntipodalCurve,
    Field(discriminator="kind"),
]
"""Any curve kind of a job file."""
