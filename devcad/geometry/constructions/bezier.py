"""Developable Bezier and B-spline patches: polynomials, developable without any residue."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Discriminator, Tag, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry import nets, splines
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Figure,
    constant_extent,
    one_panel,
    smooth,
    sound,
)
from devcad.geometry.constructions.ruled import ladder
from devcad.geometry.constructions.sampling import VANISHES
from devcad.geometry.curve import Curve, size
from devcad.geometry.curves import BsplineCurve, CurveSpec, Number, Points, Vector
from devcad.geometry.fit import Course, Spline
from devcad.geometry.nets import Aim, Freedom
from devcad.geometry.polynomial import MAX_DEGREE, polynomial
from devcad.geometry.taylor import Array

ROOM = 0.25
"""Lengths of a ruling that a freely chosen patch keeps from its regression curve."""
LEAST_ROOM = 0.01
"""The same where an aim was given: how near it may take the regression curve."""
SLANT = 0.1
"""A freely chosen patch's rulings lie across the boundary by this share of the first one's."""
SAMPLES = 129

HOW_TO_CHOOSE = "leave the choice to the method, or give opposite_end or singular"


def _as_bspline(value: Any) -> Any:
    """An array of control points as the table of a B-spline without inner knots."""
    if not isinstance(value, list | tuple):
        return value
    if not 2 <= len(value) <= MAX_DEGREE + 1:
        raise JobError(
            f"{len(value)} control points make no Bezier curve of degree 1 to {MAX_DEGREE}",
            value=len(value),
            limit=2 if len(value) < 2 else MAX_DEGREE + 1,
            remedy=f"give 2 to {MAX_DEGREE + 1} points, or a curve of kind bspline",
        )
    knots = [0.0] * len(value) + [1.0] * len(value)
    return {
        "kind": "bspline",
        "degree": len(value) - 1,
        "knots": knots,
        "control_points": value,
    }


def _number_of_points(value: Any) -> str:
    """Whether an array is one point or several."""
    several = isinstance(value, list | tuple) and value and isinstance(value[0], list | tuple)
    return "points" if several else "point"


Boundary = Annotated[
    CurveSpec, BeforeValidator(_as_bspline, json_schema_input_type=Points | CurveSpec)
]
"""Control points of a Bezier curve, or a curve that is piecewise polynomial."""
Start = Annotated[
    Annotated[Vector, Tag("point")] | Annotated[tuple[Vector, Vector], Tag("points")],
    Discriminator(_number_of_points),
]
"""One point, or two."""


class Bezier(Closable):
    """The developable between a polynomial ``boundary`` and an opposite edge of its degree.

    The opposite edge begins at ``opposite_start``. Two numbers are then free; they are given by
    a second point there (the opposite edge's second control point, in the plane of its first and
    the boundary's first two), by ``opposite_end`` (a point: the edge ends as near to it as a
    regular patch can; ``missed_end`` in the report), by ``singular`` (where the regression curve
    crosses the first and the last ruling: 0 on the boundary, 1 on the opposite edge; both below 0
    or both above 1), or by the method. "aumann": the strip whose rulings come nearest to the
    first one carried along the boundary without turning about it. "chu-sequin": the strip whose
    last ruling comes nearest to that. Both then keep the regression curve at least a quarter of
    a ruling away; where the boundary closes they take a cone or a cylinder, which closes too.

    c0 = boundary, e towards the opposite edge, v the length, from 0 to the opposite edge; t is
    the boundary's parameter, [0, 1] for control points.

    Source: Aumann (2003), Chu and Sequin (2002), see ``nets``; both papers describe the same
    surfaces. Reconstructed: what the papers leave to the designer, that is how the two numbers
    are chosen.
    """

    kind: Literal["bezier"]
    boundary: Boundary
    opposite_start: Start
    method: Literal["aumann", "chu-sequin"] = "aumann"
    opposite_end: Vector | None = None
    singular: tuple[Number, Number] | None = None

    @model_validator(mode="after")
    def _one_choice(self) -> Bezier:
        given = {
            "a second point in opposite_start": isinstance(self.opposite_start[0], tuple),
            "opposite_end": self.opposite_end is not None,
            "singular": self.singular is not None,
        }
        names = [name for name, there in given.items() if there]
        if len(names) > 1:
            raise JobError(
                f"{' and '.join(names)} each say all that the boundary leaves free",
                value=len(names),
                limit=1,
                remedy="give one of them",
            )
        if self.singular is not None and not _outside(*self.singular):
            raise JobError(
                f"singular: the regression curve would cross the patch, from {self.singular[0]:g} "
                f"to {self.singular[1]:g} of the rulings' length",
                value=self.singular[0],
                limit=0.0,
                remedy="give two numbers below 0 (beyond the boundary) or two above 1",
            )
        if isinstance(self.boundary, BsplineCurve):
            _require_polynomial(self.boundary)
        return self

    def build(self) -> Built:
        """One patch for each smooth piece of the boundary.

        Raises:
            JobError: the boundary is no polynomial. GeometryError: the first ruling is none or
                runs along the boundary, the second point lies out of its plane, or the patch
                that was asked for is singular.
        """
        boundary = self._boundary()
        first = _curve(boundary)
        sound(first, "boundary")
        start = self.opposite_start
        second = start[1] if isinstance(start[0], tuple) else None
        ruling = np.array(start[0] if isinstance(start[0], tuple) else start) - boundary.poles[0]
        _require_ruling(boundary, ruling)
        freedom = self._freedom(boundary, first.closed, ruling, second)
        edge = nets.opposite(boundary, ruling, freedom)
        patches = ladder(first, _curve(edge), constant_extent(0.0, 1.0))
        return one_panel(patches, first.closed, figures=self._figures(edge, freedom))

    def _boundary(self) -> Spline:
        """The boundary as a clamped spline."""
        if isinstance(self.boundary, BsplineCurve):
            given = self.boundary
            return nets.clamped(given.degree, np.array(given.knots), np.array(given.control_points))
        curve = smooth(self.boundary.curve(), "boundary")
        t = np.array([curve.domain[0], *curve.breaks, curve.domain[1]])
        ends = curve.point(t[[0, -1]])
        spline = polynomial(curve.point, Course(t, t), (ends[0], ends[1]))
        if spline is None:
            raise JobError(
                f"boundary: a curve of kind {self.boundary.kind} that is no polynomial of degree "
                f"{MAX_DEGREE} or less between its breaks",
                value=self.boundary.kind,
                limit=MAX_DEGREE,
                remedy="give control points, or a curve of kind bspline or points",
            )
        return spline

    def _freedom(
        self, boundary: Spline, closed: bool, ruling: Array, second: Vector | None
    ) -> Freedom:
        """The two numbers, however they are given."""
        if second is not None:
            return _by_second(boundary, ruling, np.array(second))
        if self.singular is not None:
            return Freedom(self.singular[1] / self.singular[0], 1.0 / self.singular[0])
        end = boundary.knots[-1:]
        if self.opposite_end is not None:
            wanted = np.array([self.opposite_end]) - boundary.poles[-1]
            return nets.nearest(boundary, ruling, Aim(end, wanted, LEAST_ROOM))
        t = np.linspace(boundary.knots[0], boundary.knots[-1], SAMPLES)
        carried = nets.carried(boundary, ruling, t)
        whole = Aim(t, carried, ROOM, closed)
        last = Aim(end, carried[-1:], ROOM)
        aim = last if self.method == "chu-sequin" and not closed else whole
        freedom = nets.nearest(boundary, ruling, aim)
        sine = nets.least_sine(boundary, ruling, freedom, t[:1])
        if nets.least_sine(boundary, ruling, freedom, t) < SLANT * sine and not closed:
            return nets.steepest(boundary, ruling, whole)
        return freedom

    def _figures(self, edge: Spline, freedom: Freedom) -> dict[str, Figure]:
        """What the report says of the choice."""
        figures = {}
        if self.opposite_end is not None:
            missed = float(np.linalg.norm(edge.poles[-1] - np.array(self.opposite_end)))
            figures["missed_end"] = Figure(missed)
        if abs(freedom.pull) > VANISHES:
            figures["singular_start"] = Figure(1.0 / freedom.pull, 0)
            figures["singular_end"] = Figure(freedom.spread / freedom.pull, 0)
        return figures


def _outside(start: float, end: float) -> bool:
    """Whether both fractions lie on one side of the ruling."""
    return max(start, end) < 0.0 or min(start, end) > 1.0


def _require_polynomial(curve: BsplineCurve) -> None:
    """JobError unless the B-spline is a polynomial of degree 9 or less."""
    weights = curve.weights or (1.0,)
    if max(weights) != min(weights):
        raise JobError(
            "boundary: its weights differ, so it is rational and no polynomial",
            value=max(weights),
            limit=min(weights),
            remedy="leave the weights out",
        )
    if curve.degree > MAX_DEGREE:
        raise JobError(
            f"boundary: degree {curve.degree}, at most {MAX_DEGREE}",
            value=curve.degree,
            limit=MAX_DEGREE,
            remedy="give a boundary of a lower degree",
        )


def _curve(spline: Spline) -> Curve:
    return splines.bspline(spline.degree, spline.knots, spline.poles, None)


def _require_ruling(boundary: Spline, ruling: Array) -> None:
    """Raise a GeometryError unless the first ruling has a length and leaves the boundary."""
    length, extent = float(np.linalg.norm(ruling)), size(boundary.poles)
    if not length > VANISHES * extent:
        raise GeometryError(
            "opposite_start: it is the boundary's first point",
            value=length,
            limit=VANISHES * extent,
            remedy="give a point beside the boundary",
        )
    leg = boundary.poles[1] - boundary.poles[0]
    sine = float(np.linalg.norm(np.cross(leg, ruling)) / (np.linalg.norm(leg) * length))
    if not sine > VANISHES:
        raise GeometryError(
            "opposite_start: it lies on the boundary's first tangent, so that the first ruling "
            "has no tangent plane",
            value=sine,
            limit=VANISHES,
            remedy="move it off the line through the boundary's first two control points",
        )


def _by_second(boundary: Spline, ruling: Array, second: Array) -> Freedom:
    """The freedom by the opposite edge's second control point.

    Raises:
        GeometryError: it lies out of its plane, or makes the patch singular.
    """
    freedom, missed = nets.by_second(boundary, ruling, second)
    limit = VANISHES * size(np.stack([*boundary.poles[:2], boundary.poles[0] + ruling, second]))
    if missed > limit:
        edge = nets.opposite(boundary, ruling, freedom).poles[1]
        raise GeometryError(
            "opposite_start: its second point is not in the plane of its first and the boundary's "
            f"first two control points: it lies {missed:.6g} beside it",
            value=missed,
            limit=limit,
            remedy=f"take the nearest point in it, [{edge[0]:.15g}, {edge[1]:.15g}, "
            f"{edge[2]:.15g}], or {HOW_TO_CHOOSE}",
        )
    if freedom.spread <= 0.0:
        raise GeometryError(
            "opposite_start: with its second point the rulings would shrink to nothing within the "
            f"patch: at each step their length changes {freedom.spread:.6g}-fold",
            value=freedom.spread,
            limit=0.0,
            remedy=f"move it away from the boundary; or {HOW_TO_CHOOSE}",
        )
    if not freedom.regular:
        along, least = 1.0 - freedom.pull, max(0.0, 1.0 - freedom.spread)
        raise GeometryError(
            "opposite_start: with its second point the regression curve would lie on the patch: it "
            f"follows the boundary's first leg by {along:.6g} of its length, more than {least:.6g} "
            "are needed",
            value=along,
            limit=least,
            remedy=f"move it along the boundary's first leg; or {HOW_TO_CHOOSE}",
        )
    return freedom
