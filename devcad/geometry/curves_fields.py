"""What a key of a job file may hold: numbers, vectors, angles, expressions, as annotated types.

A refusal is a JobError or LimitError (both ValueErrors) raised during validation; pydantic
keeps it as ``error["ctx"]["error"]``.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Annotated

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    WithJsonSchema,
)

from devcad.geometry import taylor, values
from devcad.geometry.jets import Expression
from devcad.geometry.taylor import Array


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
