"""Envelopes: the surface that a family of planes touches."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry import splines, taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    one_panel,
    require_apart,
)
from devcad.geometry.constructions.sampling import VANISHES, grid, require_finite
from devcad.geometry.constructions.standstill import Planes
from devcad.geometry.constructions.turning import Turning, strips, turning
from devcad.geometry.curve import COINCIDENT, Curve
from devcad.geometry.curves import Interval, Number, ScalarExpression, VectorExpression
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Plane = tuple[Number, Number, Number, Number]
"""[nx, ny, nz, d]: the plane n.x = d."""


class Envelope(Closable):
    """The envelope of the planes n(t).x = d(t): each ruling is where neighbouring planes meet.

    c0 = the ruling's point nearest the origin, e = unit(n x n'), the extent is a length. n may
    have any length. The planes come as ``normal``, ``offset`` and ``t``, or as a list of
    ``planes``: then a quintic spline in R^4 passes through them, over its chord length there,
    t from 0 to 1. Where the planes stand still for a moment e is continued.

    Source: geometry.md, section 4 (Bodduluri and Ravani).
    """

    kind: Literal["envelope"]
    normal: VectorExpression | None = None
    offset: ScalarExpression | None = None
    t: Interval | None = None
    planes: Annotated[tuple[Plane, ...], Field(min_length=3)] | None = None
    extent: Extent

    @model_validator(mode="after")
    def _one_form(self) -> Envelope:
        formulas = [self.normal is not None, self.offset is not None, self.t is not None]
        if self.planes is not None and not any(formulas):
            _distinct(self.planes)
        elif self.planes is not None or not all(formulas):
            raise JobError(
                "an envelope has either normal, offset and t, or planes",
                remedy='normal = ["..", "..", ".."], offset = "..", t = [from, to], '
                "or planes = [[nx, ny, nz, d], ...]",
            )
        return self

    def build(self) -> Built:
        """One patch; several where a spline's knot gives an edge a corner.

        Raises:
            JobError: a value or derivative is not a number; GeometryError: n vanishes, the plane
            stands still for more than a moment or turns back, neighbouring planes are parallel,
            or all planes pass through one line.
        """
        planes, family = self._family()
        t = grid(family)
        require_finite(planes(taylor.variable(t, 3)), t, "planes" if self.planes else "normal")
        require_apart(
            family,
            lambda s, k: _square_of_normal(planes, s, k),
            f"{self._key}: n vanishes",
            "divide n and the offset by their common factor, or end the family before that point",
        )
        found = turning(
            planes, np.array([family.domain[0], *family.breaks, family.domain[1]]), self._key
        )
        self._require_onward(found)

        def rays(t: Array, order: int) -> tuple[Array, Array, None]:
            c0, e = found.rays(t, order)
            return c0, e, None

        base = Curve(lambda s, k: found.rays(s, k)[0], family.domain, family.breaks)
        require_finite(base.jet(t, 0), t, f"{self._key}: the ruling")
        patches = strips(found, base, rays, self.extent)
        self._require_spread(patches, found.stops)
        return one_panel(patches, _closed(patches))

    @property
    def _key(self) -> str:
        return "normal" if self.planes is None else "planes"

    def _family(self) -> tuple[Planes, Curve]:
        """The planes, and a curve that has their domain and breaks."""
        if self.planes is not None:
            spline = splines.interpolating(np.array(self.planes), 5)
            return partial(_along, spline), spline
        assert self.normal is not None
        assert self.offset is not None
        assert self.t is not None
        parts = (*self.normal, self.offset)

        def planes(t: Array) -> Array:
            return np.stack([part.series(t=t) for part in parts], axis=-1)

        return planes, Curve(lambda t, k: planes(taylor.variable(t, k))[..., :3], self.t)

    def _require_onward(self, found: Turning) -> None:
        """Raise a GeometryError where n x n' changes its sign."""
        if not found.backward:
            return
        at = found.backward[0]
        raise GeometryError(
            f"{self._key}: the planes turn back at t = {at:.6g}: n x n' changes its sign there",
            value=at,
            limit=0.0,
            remedy="make two envelopes, one ending and one beginning there",
        )

    def _require_spread(self, patches: tuple[Patch, ...], zeros: list[float]) -> None:
        """Raise a GeometryError where all planes pass through one line, or at a zero of n x n'
        where the rulings stand still too."""
        moves = [_moves(patch, np.linspace(*patch.domain, 65)) for patch in patches]
        largest = max(float(move.max()) for move in moves)
        if not largest > VANISHES:
            raise GeometryError(
                f"{self._key}: all planes pass through one line, so they envelop no surface",
                value=largest,
                limit=VANISHES,
                remedy="let the offset vary in another way",
            )
        for at in zeros:
            patch = next(p for p in patches if at <= p.domain[1])
            least = float(_moves(patch, np.array([at]))[0])
            if not least > VANISHES * largest:
                raise GeometryError(
                    f"{self._key}: the rulings stand still at t = {at:.6g}",
                    value=least,
                    limit=VANISHES * largest,
                    remedy="give the family another parameter, which does not slow down there",
                )


def _moves(patch: Patch, t: Array) -> Array:
    """How fast the rulings move across themselves over the domain, against the patch's size."""
    jet = patch.jet(t, 1)
    along = np.einsum("ni,ni->n", jet.c0[1], jet.e[0])[:, None] * jet.e[0]
    reach = np.maximum(np.abs(jet.v_from[0]), np.abs(jet.v_to[0]))
    move = np.linalg.norm(jet.c0[1] - along, axis=1) + reach * np.linalg.norm(jet.e[1], axis=1)
    size = (np.linalg.norm(jet.c0[0], axis=1) + reach).max()
    return np.asarray(move * np.ptp(patch.domain) / size)


def _along(spline: Curve, t: Array) -> Array:
    """The series of a spline of planes at the series of t."""
    return np.asarray(taylor.compose(spline.jet(t[0], len(t) - 1), t))


def _square_of_normal(planes: Planes, t: Array, order: int) -> Array:
    n = planes(taylor.variable(t, order))[..., :3]
    return taylor.dot(n, n)


def _distinct(planes: tuple[Plane, ...]) -> None:
    """Refuse two neighbouring planes with the same four numbers."""
    rows = np.array(planes)
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    if steps.min() <= COINCIDENT * np.linalg.norm(np.ptp(rows, axis=0)):
        first = int(np.argmin(steps))
        raise JobError(
            f"planes {first} and {first + 1} (counted from 0) are the same",
            value=float(steps[first]),
            remedy="remove one of them",
        )


def _closed(patches: tuple[Patch, ...]) -> bool:
    """Whether the base curve returns to its start."""
    ends = [patches[0].jet([patches[0].domain[0]], 0), patches[-1].jet([patches[-1].domain[1]], 0)]
    size = max(float(np.abs(x).max()) for jet in ends for x in (jet.c0, jet.v_from, jet.v_to))
    return bool(np.linalg.norm(ends[1].c0[0, 0] - ends[0].c0[0, 0]) <= COINCIDENT * size)
