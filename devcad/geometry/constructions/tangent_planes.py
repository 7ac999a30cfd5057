"""Strips that touch a freeform surface along curves on it."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    WithJsonSchema,
    model_validator,
)

from devcad.errors import GeometryError, JobError
from devcad.geometry import freeform, taylor, values
from devcad.geometry.constructions.base import (
    Built,
    BuiltPanel,
    Closable,
    Extent,
    Figure,
    require_across,
    sound,
)
from devcad.geometry.constructions.sampling import VANISHES, grid, lowest, require_finite
from devcad.geometry.constructions.touching import Track, distance_to_base, gaps, track
from devcad.geometry.constructions.turning import strips, turning
from devcad.geometry.curve import Curve
from devcad.geometry.curves import (
    Interval,
    Model,
    Number,
    Points,
    Positive,
    ScalarExpression,
    SurfaceExpression,
)
from devcad.geometry.freeform import Freeform
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Degree = Annotated[int, Field(strict=True, ge=1, le=values.MAX_DEGREE)]
Knots = tuple[Number, ...]


def _pair(value: Any) -> Any:
    """One degree stands for both."""
    return (value, value) if isinstance(value, int) else value


def _listed(value: Any) -> Any:
    """One table stands for a list of one."""
    return [value] if isinstance(value, dict | Model) else value


class _OrOne:
    """In the JSON Schema: an array, or one entry of it."""

    def __get_pydantic_json_schema__(
        self, core: Any, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        array = handler(core)
        return {"anyOf": [array["items"], array]}


class FreeformBase(Model):
    """A surface S(u, v): ``x``, ``y``, ``z`` as formulas in u and v, or a B-spline."""

    x: SurfaceExpression | None = None
    y: SurfaceExpression | None = None
    z: SurfaceExpression | None = None
    degree: (
        Annotated[
            tuple[Degree, Degree],
            BeforeValidator(_pair),
            WithJsonSchema(
                {"anyOf": [{"type": "integer"}, {"type": "array", "items": {"type": "integer"}}]}
            ),
        ]
        | None
    ) = None
    knots: tuple[Knots, Knots] | None = None
    control_points: tuple[Points, ...] | None = None
    weights: tuple[tuple[Positive, ...], ...] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> FreeformBase:
        formulas = [self.x, self.y, self.z]
        spline = [self.degree, self.knots, self.control_points]
        by_formulas = all(part is not None for part in formulas)
        by_spline = all(part is not None for part in spline)
        others = [*spline, self.weights] if by_formulas else formulas
        if by_formulas == by_spline or any(part is not None for part in others):
            raise JobError(
                "a freeform surface has either x, y and z, or degree, knots and control_points",
                remedy='x = "..", y = "..", z = ".." in u and v, or the B-spline',
            )
        if by_spline:
            self._check_spline()
        return self

    def _check_spline(self) -> None:
        """Refuse a net that is no grid or does not fit its knots."""
        assert self.degree is not None
        assert self.knots is not None
        assert self.control_points is not None
        rows = self.control_points
        for name, net in (("control_points", rows), ("weights", self.weights or rows)):
            if len(net) != len(rows) or any(len(row) != len(rows[0]) for row in net):
                raise JobError(
                    f"{name} is no grid: {len(net)} rows of {sorted({len(row) for row in net})}",
                    value=len(net),
                    limit=len(rows),
                    remedy="a row for each u, an entry in it for each v, the same number in all",
                )
        counts = (len(rows), len(rows[0]) if rows else 0)
        for degree, knots, count in zip(self.degree, self.knots, counts, strict=True):
            values.check_bspline(degree, knots, count, None)

    def surface(self) -> Freeform:
        """The surface, in the job's units."""
        if self.x is not None and self.y is not None and self.z is not None:
            return freeform.of_expressions(self.x, self.y, self.z)
        assert self.degree is not None
        assert self.knots is not None
        return freeform.of_bspline(
            self.degree,
            (np.array(self.knots[0]), np.array(self.knots[1])),
            np.array(self.control_points),
            None if self.weights is None else np.array(self.weights),
        )


class SurfaceCurve(Model):
    """A curve in the parameters of a surface: ``u`` and ``v`` as formulas in t."""

    u: ScalarExpression
    v: ScalarExpression
    t: Interval


class TangentPlanes(Closable):
    """The strip that touches the surface ``base`` along ``curve``; several curves, several strips.

    c0 = the curve on the surface, e = unit(n x n') with n = S_u x S_v along it: the direction
    conjugate to the curve, continued where n' vanishes for a moment. The extent is a length.

    Each panel's ``distance_to_base`` is the largest distance of its points from the surface: foot
    points by Newton from the curve, on 65 rulings x 9 heights of every smooth part, those beyond
    the edge of a B-spline left out. ``gap_to_next`` is the largest distance, either way, between
    its edge and the facing edge of the next strip: of their bases and tops the two that are
    nearest to one another on average, at 257 points of each, those beyond the other's ends left
    out.

    Source: geometry.md, sections 3 and 11.
    """

    kind: Literal["tangent-planes"]
    base: FreeformBase
    curve: Annotated[
        tuple[SurfaceCurve, ...], Field(min_length=1), BeforeValidator(_listed), _OrOne()
    ]
    extent: Extent

    def build(self) -> Built:
        """One panel for each curve.

        Raises:
            JobError: a value or derivative is not a number, or the curve leaves the domain of the
            B-spline; GeometryError: the curve stands still or has a corner, the surface has no
            tangent plane, the tangent plane does not turn along the curve, the curve runs in an
            asymptotic direction, or the ruling jumps.
        """
        surface = self.base.surface()
        made = []
        for k, curve in enumerate(self.curve, start=1):
            name = f"curve {k}" if len(self.curve) > 1 else "curve"
            path = track(surface, (curve.u, curve.v), curve.t, name)
            made.append((path, _strip(path, name, self.extent)))
        return Built(_with_figures(surface, made))


def _strip(path: Track, name: str, extent: Extent) -> tuple[Patch, ...]:
    """The patches along one curve."""
    base = path.base
    (piece,) = sound(base, name, order=3)
    t = grid(piece)
    variable = taylor.variable(t, 2)
    require_finite(path.planes(variable)[..., :3], t, f"{name}: the normal of the surface")
    _require_plane(path, base, name)
    knots = np.array([base.domain[0], *base.breaks, base.domain[1]])
    found = turning(path.planes, knots, name)

    def rays(s: Array, order: int) -> tuple[Array, Array, None]:
        return base.jet(s, order), found.rays(s, order)[1], None

    require_across(
        piece,
        rays,
        f"{name}: the ruling runs along the curve, in an asymptotic direction of the surface,",
        "lead the curve across the asymptotic directions, where the surface bends along it",
    )
    return strips(found, base, rays, extent)


def _require_plane(path: Track, base: Curve, name: str) -> None:
    """Raise a GeometryError where S_u and S_v are parallel along the curve."""

    def squared_sine(t: Array, order: int) -> Array:
        u, v = path.partials(taylor.variable(t, order))
        area = taylor.cross(u, v)
        whole = taylor.mul(taylor.dot(u, u), taylor.dot(v, v))
        with np.errstate(all="ignore"):
            return np.nan_to_num(taylor.div(taylor.dot(area, area), whole), nan=0.0)

    at, least = lowest(squared_sine, base)
    if not least > VANISHES**2:
        raise GeometryError(
            f"{name}: the surface has no tangent plane at t = {at:.6g}: "
            "S_u and S_v are parallel there",
            value=float(np.sqrt(max(least, 0.0))),
            limit=VANISHES,
            remedy="keep the curve away from poles, or give the surface other parameters",
        )


def _with_figures(
    surface: Freeform, made: list[tuple[Track, tuple[Patch, ...]]]
) -> tuple[BuiltPanel, ...]:
    """The panels with what they leave open to the surface and to one another."""
    to_base = [distance_to_base(surface, path, patches) for path, patches in made]
    to_next = [gaps(a[1], b[1]) for a, b in pairwise(made)]
    panels = []
    for k, (path, patches) in enumerate(made):
        figures = {"distance_to_base": Figure(to_base[k])}
        if k < len(to_next):
            figures["gap_to_next"] = Figure(to_next[k])
        panels.append(BuiltPanel(patches, path.base.closed, figures=figures))
    return tuple(panels)
