"""The curve kinds of a job file: what may be written, and the Curve that it means.

One pydantic model a kind, each with ``curve()``; ``CurveSpec`` is their union. Lengths are in
the job's units, whatever they are: nothing here depends on the scale except the gap allowed in
a chain, which reads ``mm_per_unit`` from the validation context (default 1). Angles are degrees
in the job and radians in the model. The annotated types serve the constructions too.

A refusal is a JobError or LimitError (both ValueErrors) raised during validation; pydantic
keeps it as ``error["ctx"]["error"]``.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace
from functools import partial
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    PrivateAttr,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)

from devcad.errors import JobError
from devcad.geometry import jets, linked, natural, paths, splines, taylor, values
from devcad.geometry.curve import Curve, ends_meet, samples
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array
from devcad.geometry.values import unit as unit

FULL_TURN = 2.0 * math.pi
MAX_GAP = 1e-6  # mm, between the curves of a chain


class Model(BaseModel):
    """What every table of a job file is: frozen, no unknown keys, no NaN, no infinity."""

    model_config = ConfigDict(
        defer_build=True,  # a job uses one or two of the many kinds
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        arbitrary_types_allowed=True,
        validate_by_name=True,
        validate_by_alias=True,
    )


# --- annotated types -----------------------------------------------------------------------


NUMBER_OR_TEXT = {"anyOf": [{"type": "number"}, {"type": "string"}]}

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number; integers are taken, texts and booleans are not."""
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
"""A finite number above 0."""
Count = Annotated[int, Field(strict=True, ge=1)]
"""A whole number from 1 on."""
Flag = Annotated[bool, Field(strict=True)]
"""true or false."""
Degrees = Annotated[Number, AfterValidator(math.radians), WithJsonSchema({"type": "number"})]
"""An angle: degrees in the job, radians in the model."""
Sweep = Annotated[
    Number,
    AfterValidator(values.sweep),
    WithJsonSchema({"type": "number", "minimum": -360, "maximum": 360}),
]
"""An angle of at most a full turn either way, not 0: degrees in the job, radians in the model."""
Vector = tuple[Number, Number, Number]
"""Three finite numbers."""
Points = tuple[Vector, ...]
"""Any number of points."""
Direction = Annotated[Vector, AfterValidator(values.nonzero)]
"""Three finite numbers, not all 0; any length."""
ScalarExpression = Annotated[
    Expression,
    PlainValidator(partial(values.expression, names=("t",))),
    WithJsonSchema(NUMBER_OR_TEXT),
]
"""A number, or a text with an expression in t."""
SurfaceExpression = Annotated[
    Expression,
    PlainValidator(partial(values.expression, names=("u", "v"))),
    WithJsonSchema(NUMBER_OR_TEXT),
]
"""A number, or a text with an expression in u and v."""
VectorExpression = tuple[ScalarExpression, ScalarExpression, ScalarExpression]
"""Three numbers or expressions in t."""
ConstantExpression = Annotated[
    float, PlainValidator(values.constant), WithJsonSchema(NUMBER_OR_TEXT)
]
"""A number, or a text with a constant expression such as "2*pi"."""
Interval = Annotated[
    tuple[ConstantExpression, ConstantExpression], AfterValidator(values.increasing)
]
"""[from, to] with from < to, numbers or constant expressions."""


def vector_jet(expressions: VectorExpression, t: Array, order: int) -> Array:
    """The Taylor series (order + 1, n, 3) of three expressions at t (n,)."""
    variable = taylor.variable(t, order)
    return np.stack([part.series(t=variable) for part in expressions], axis=-1)


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
    | NaturalCurve,
    Field(discriminator="kind"),
]
"""Any curve kind of a job file."""
