"""The tables of a recipe that speak of the shop. Lengths are mm, angles degrees.

``shopsettings.py`` makes frozen values of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from devcad.errors import JobError
from devcad.job.invalid import did_you_mean
from devcad.shop.settings import ONE_PAGE, PAPERS, Hole, Mode, NotchShape, Standard

LARGEST_K = 0.5
MOST_BENDS = 10_000
"""Bend lines of one panel."""
SMALLEST_PAGE, LARGEST_PAGE = 100.0, 100_000.0
"""mm; a page holds its control squares, and a roll has an end."""
LARGEST_OVERLAP = 40.0
"""mm; less than half the smallest page."""


class Table(BaseModel):
    """A table of a recipe: no unknown keys; a key that is absent leaves the next source its say.

    ``choices`` are the groups of keys of which a table names one at most.
    """

    model_config = ConfigDict(
        defer_build=True,  # a recipe speaks of two or three of the many tables
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        validate_by_name=False,
    )
    choices: ClassVar[tuple[tuple[str, ...], ...]] = ()

    @model_validator(mode="after")
    def _one_of_a_choice(self) -> Table:
        for choice in self.choices:
            given = [key for key in choice if getattr(self, key) is not None]
            if len(given) > 1:
                raise JobError(
                    f"there are {', '.join(given[:-1])} and {given[-1]}",
                    value=", ".join(given),
                    limit=f"one of {', '.join(choice)}",
                    remedy=f"keep one of {', '.join(choice)}",
                )
        return self


Length = Annotated[float, Field(gt=0.0)]
Share = Annotated[float, Field(ge=0.0)]


def _k(value: float) -> float:
    """K of the ANSI kind: the fibre's place over the thickness."""
    if not 0.0 <= value <= LARGEST_K:
        raise JobError(
            f"must be from 0 to 0.5, is {value:g}",
            value=value,
            limit=LARGEST_K,
            remedy="k is ANSI, the fibre's place over the thickness; for DIN's, over half of it, "
            "write k_din"
            if value > LARGEST_K
            else "0 is the inside of the bend, 0.5 the middle of the sheet",
        )
    return value


def _k_din(value: float) -> float:
    """k of the DIN kind: the fibre's place over half the thickness."""
    if not 0.0 <= value <= 1.0:
        raise JobError(
            f"must be from 0 to 1, is {value:g}",
            value=value,
            limit=1.0,
            remedy="k_din is the fibre's place over half the thickness, 1 in the middle",
        )
    return value


def _k_table(rows: list[list[float]]) -> list[list[float]]:
    """Pairs of inside radius over thickness, increasing, and K."""
    for number, row in enumerate(rows):
        if len(row) != 2:
            raise JobError(
                f"row {number} (counted from 0) has {len(row)} numbers, must have 2",
                value=len(row),
                limit=2,
                remedy="write [inside radius over thickness, K]",
            )
        ratio, k = row
        if ratio < 0.0 or not 0.0 < k <= LARGEST_K:
            raise JobError(
                f"row {number} (counted from 0) is [{ratio:g}, {k:g}]",
                value=k if ratio >= 0.0 else ratio,
                limit=LARGEST_K if ratio >= 0.0 else 0.0,
                remedy="a radius over the thickness is at least 0, K above 0 and at most 0.5",
            )
    for number, (before, after) in enumerate(pairwise(rows)):
        if after[0] <= before[0]:
            raise JobError(
                f"the radius of row {number + 1} (counted from 0), {after[0]:g}, does not exceed "
                f"{before[0]:g} of the row before",
                value=after[0],
                limit=before[0],
                remedy="order the rows by radius over thickness, each once",
            )
    return rows


class NeutralTable(Table):
    """The neutral fibre of a sheet that is bent; without a key the material's."""

    choices = (("k", "k_din", "table", "standard"),)

    k: Annotated[
        float | None,
        AfterValidator(lambda k: None if k is None else _k(k)),
        Field(description="its place over the thickness from the inside, 0 to 0.5 (ANSI)"),
    ] = None
    k_din: Annotated[
        float | None,
        AfterValidator(lambda k: None if k is None else _k_din(k)),
        Field(description="its place over half the thickness, 0 to 1 (DIN)"),
    ] = None
    table: Annotated[
        list[list[float]] | None,
        AfterValidator(lambda rows: None if rows is None else _k_table(rows)),
        Field(min_length=1, max_length=1000, description="[[inside radius / thickness, k], ...]"),
    ] = None
    standard: Standard | None = Field(None, description="a rule that gives k from the radius")


class BendsTable(Table):
    """How the sheet gets its shape; a key that spaces bends asks for the press brake."""

    choices = (("chord", "angle", "length", "count"),)

    mode: Mode | None = Field(None, description="rolled (default), or press-brake: plane facets")
    chord: Length | None = Field(None, description="mm, largest distance from the smooth part")
    angle: Annotated[float, Field(gt=0.0, lt=180.0)] | None = Field(
        None, description="degrees, the most that one bend turns; bends are equal"
    )
    length: Length | None = Field(None, description="mm, the longest flat between two bend lines")
    count: Annotated[int, Field(ge=1, le=MOST_BENDS)] | None = Field(
        None, description="number of bend lines"
    )
    inside_radius: Share | None = Field(None, description="mm, of every bend; 0: sharp")
    springback: bool | None = Field(None, description="whether bends are over-bent")

    @model_validator(mode="after")
    def _no_facets_when_rolled(self) -> BendsTable:
        given = [key for key in self.choices[0] if getattr(self, key) is not None]
        if self.mode == "rolled" and given:
            raise JobError(
                f"{given[0]} spaces the bends of a press brake, and the mode is rolled",
                place=given[0],
                value="rolled",
                limit="press-brake",
                remedy=f'write mode = "press-brake", or leave {given[0]} out',
            )
        return self


class StitchTable(Table):
    """Stitch holes along seams."""

    choices = (("pitch", "spi"),)

    pitch: Length | None = Field(None, description="mm from hole to hole, spread evenly")
    spi: Length | None = Field(None, description="stitches per inch")
    inset: Length | None = Field(None, description="mm from the edge that is cut")
    hole: Hole | None = None
    diameter: Length | None = Field(None, description="mm; of a slit its length")


class NotchesTable(Table):
    """Notches along seams."""

    every: Annotated[int, Field(ge=1)] | None = Field(None, description="at every n-th hole")
    shape: NotchShape | None = None
    depth: Length | None = Field(None, description="mm into the sheet")


class SheetTable(Table):
    """The stock that parts are cut from."""

    size: Annotated[list[Length], Field(min_length=2, max_length=2)] | None = Field(
        None, description="mm, [width, height]"
    )
    gap: Share | None = Field(None, description="mm between parts and to the sheet's edge")
    kerf: float | None = Field(
        None, description="mm that the tool removes; parts grow by half of it, shrink below 0"
    )


def _paper(value: str | list[float]) -> str | list[float]:
    """The name of a paper as it is spelt, or the sides of one."""
    if isinstance(value, str):
        known = [*PAPERS, ONE_PAGE]
        for name in known:
            if name.lower() == value.lower():
                return name
        raise JobError(
            f'this version knows no paper "{value[:60]}"',
            value=value[:60],
            limit=", ".join(known),
            remedy=did_you_mean(value, [*known, "[width, height] in mm"]),
        )
    if len(value) != 2 or not all(SMALLEST_PAGE <= side <= LARGEST_PAGE for side in value):
        raise JobError(
            "must be a name, or two sides from 100 mm to 100 m",
            value=", ".join(f"{side:g}" for side in value[:4]),
            limit=", ".join([*PAPERS, ONE_PAGE]),
            remedy="give [width, height] in mm; a smaller page cannot hold its control squares",
        )
    return value


class PdfTable(Table):
    """The pages of a pattern at true size."""

    paper: Annotated[str | list[float], AfterValidator(_paper)] | None = Field(
        None,
        description=f"{', '.join(PAPERS)}; [width, height] in mm; or {ONE_PAGE}: a single page",
    )
    overlap: Annotated[float, Field(ge=0.0, le=LARGEST_OVERLAP)] | None = Field(
        None, description="mm that neighbouring pages share"
    )


class LimitsTable(Table):
    """What the shop can do, in thicknesses; without a key the material's limit, if it has one."""

    min_flange: Share | None = Field(None, description="from a bend line to the edge / thickness")
    hole_to_bend: Share | None = Field(
        None, description="from a hole's edge to a bend line / thickness"
    )
    hole_to_thickness: Share | None = Field(None, description="smallest hole / thickness")
    bend_ratio: Share | None = Field(None, description="smallest inside radius / thickness")
    strain: Annotated[float, Field(gt=0.0, le=1.0)] | None = Field(
        None, description="largest strain of the outer fibre, 0.2 = 20 %"
    )


class LabelsTable(Table):
    """Single-stroke labels on the pattern."""

    on: bool | None = Field(None, description="default true where the table stands")
    height: Length | None = Field(None, description="mm, of a capital letter")


class GlbTable(Table):
    """How glTF files are written."""

    animate: bool | None = Field(
        None, description="whether they unroll and fold; default: curved creases and mechanisms"
    )


SHOP: Mapping[str, type[Table]] = {
    "neutral": NeutralTable,
    "bends": BendsTable,
    "stitch": StitchTable,
    "notches": NotchesTable,
    "sheet": SheetTable,
    "pdf": PdfTable,
    "limits": LimitsTable,
    "labels": LabelsTable,
}
"""The tables of the shop by their names."""
