"""The table [simulate] of a job: how ``devcad fold`` simulates its sheet, what holds it and what
loads it. In the job's units, as written; ``simulation.py`` says what becomes of it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from devcad.errors import JobError
from devcad.geometry.curves import Direction, Flag, Model, Number, Positive, Vector

Point = tuple[Number, Number]
Steps = Annotated[int, Field(strict=True, ge=1, le=1000)]
Poisson = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=-1.0, lt=0.5)]
Axes = Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1, max_length=3)]
EDGES = ("start", "end", "base", "top", "crease")


class _Somewhere(Model):
    """On an edge of the sheet, or at a place of its pattern."""

    edge: Literal["start", "end", "base", "top", "crease"] | None = Field(
        None, description="a border of the whole pattern, or all its curved creases"
    )
    at: Point | None = Field(None, description="or a place in the pattern, [x, y]")

    @model_validator(mode="after")
    def _one_place(self) -> _Somewhere:
        if (self.edge is None) == (self.at is None):
            given = "neither edge nor at" if self.at is None else "both edge and at"
            raise JobError(
                f"there {'is' if self.at is None else 'are'} {given}",
                value=given,
                limit="one of the two",
                remedy=f"give edge = one of {', '.join(EDGES)}, or at = [x, y] in the pattern",
            )
        return self


class SupportTable(_Somewhere):
    """Points that stay where the folded sheet has them while it is loaded."""

    fix: Axes = Field(
        ("x", "y", "z"), description="directions of the built part that are held; default all"
    )
    clamp: Flag = Field(
        False, description="hold the sheet's tangent too, so that it cannot turn about the edge"
    )

    @model_validator(mode="after")
    def _fit(self) -> SupportTable:
        if len(set(self.fix)) != len(self.fix):
            raise JobError(
                "a direction stands twice",
                place="fix",
                value=", ".join(self.fix),
                limit="each once",
                remedy="remove one of them",
            )
        if self.clamp and self.edge in (None, "crease"):
            raise JobError(
                "only a border can be clamped",
                place="clamp",
                value=self.edge or "at",
                limit="start, end, base, top",
                remedy="give edge = one of these, or leave clamp out",
            )
        return self


class LoadTable(_Somewhere):
    """A force on the folded sheet; along an edge it is spread evenly."""

    force: Vector = Field(description="the whole force in N, in the axes of the built part")

    @model_validator(mode="after")
    def _something(self) -> LoadTable:
        if not any(self.force):
            raise JobError(
                "there is no force",
                place="force",
                value=0.0,
                limit="not all 0",
                remedy="give [fx, fy, fz] in N, or remove the load",
            )
        return self


class SimulateTable(Model):
    """How ``devcad fold`` simulates the sheet: bars and hinges on its rulings."""

    steps: Steps = Field(20, description="in which the creases are folded")
    load_steps: Steps = Field(10, description="in which the loads come, on the folded sheet")
    cells: Annotated[int, Field(strict=True, ge=2, le=2000)] | None = Field(
        None, description="along the sheet; default: its certified rulings, at least 16"
    )
    across: Annotated[int, Field(strict=True, ge=1, le=500)] | None = Field(
        None,
        description="along the rulings of each strip; default: 1 in a folded sheet, whose rulings "
        "then stay straight, else cells about square, at most 8",
    )
    coefficients: Literal[
        "exact", "kept-rulings", "exact-shear", "woodruff-filipov", "filipov-2017"
    ] = Field(
        "exact", description="stiffness of bars and hinges: published or consistent with a plate"
    )
    length_scale: Positive | None = Field(
        None, description="L* of the creases; default: creases that keep their fold angle"
    )
    youngs: Positive | None = Field(None, description="N/mm2; default: the material's")
    poisson: Poisson | None = Field(None, description="default: the material's")
    thickness: Positive | None = Field(None, description="default: the job's")
    modes: Annotated[int, Field(strict=True, ge=0, le=50)] = Field(
        6, description="how many of the softest deformations are told"
    )
    panel: Annotated[str, Field(strict=True, max_length=64)] | None = Field(
        None, description="which panel, in a job of several"
    )
    weight: Direction | None = Field(
        None, description="direction in which the sheet's own weight pulls; wants a material"
    )
    supports: tuple[SupportTable, ...] = Field(
        (), max_length=1000, description="what holds the folded sheet while it is loaded"
    )
    loads: tuple[LoadTable, ...] = Field(
        (), max_length=1000, description="the forces on the folded sheet"
    )

    @model_validator(mode="after")
    def _held(self) -> SimulateTable:
        if (self.loads or self.weight) and not self.supports:
            raise JobError(
                "there are loads, and nothing holds the sheet",
                place="supports",
                value=0,
                limit="at least one",
                remedy='add supports = [{ edge = "start", fix = ["x", "y", "z"], clamp = true }]',
            )
        return self
