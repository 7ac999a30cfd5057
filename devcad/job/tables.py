"""The tables of a job file, as pydantic models; the surfaces' own models stand with them."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from devcad.errors import JobError
from devcad.geometry.curves import Count, Direction, Model, Number, Positive, Vector
from devcad.job.recipe import RecipeTable
from devcad.shop.materials import material
from devcad.shop.settings import ALLOWANCES, Corner, Finish

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
_DEVICES = re.compile(r"(?:con|prn|aux|nul|com[0-9]|lpt[0-9])(?:\..*)?", re.IGNORECASE)


def _file_name(value: str) -> str:
    """A name that every file system takes."""
    why = remedy = ""
    if _DEVICES.fullmatch(value):
        why, remedy = ": it is a device of Windows", "choose another name"
    elif value.endswith(".") and NAME.fullmatch(value):
        why, remedy = ": Windows drops the dot at its end", "remove the dot"
    elif not NAME.fullmatch(value):
        remedy = (
            "use up to 64 letters, digits, dots, dashes and underscores, a letter or digit first"
        )
    if remedy:
        raise JobError(
            f'"{value[:70]}" cannot be a file name everywhere{why}',
            value=value[:70],
            limit=f"{NAME.pattern}, no trailing dot, no Windows device name",
            remedy=remedy,
        )
    return value


def _material(value: str) -> str:
    """The name of a material in the library, in lower case."""
    material(value)
    return value.lower()


Text = Annotated[str, Field(strict=True, max_length=1000)]
"""A text of at most 1000 characters."""
Name = Annotated[str, Field(strict=True), AfterValidator(_file_name)]
"""The name of a job or a panel."""
NonNegative = Annotated[float, Field(strict=True, ge=0.0)]
"""A finite number, 0 allowed."""


class MetaTable(Model):
    """What the drawing and the cut list say about the part."""

    part_number: Text = ""
    revision: Text = ""
    description: Text = ""
    quantity: Count = 1
    grain: Number | None = Field(None, description="degrees from +x in the pattern")
    finish: Literal["front", "back"] | None = None


class PlaceTable(Model):
    """Where a panel stands: its own z becomes ``z_axis``, its own x turns towards ``x_axis``."""

    origin: Vector = (0.0, 0.0, 0.0)
    z_axis: Direction = (0.0, 0.0, 1.0)
    x_axis: Direction | None = None


def _in_double_brackets(value: Any) -> Any:
    """An array of tables; a single table is told how to become one."""
    if isinstance(value, dict):
        raise JobError(
            "is one table, must be an array of tables",
            value="a table",
            limit="an array of tables",
            remedy="write its name in double brackets",
        )
    return value


Tables = Annotated[list[dict[str, Any]], BeforeValidator(_in_double_brackets)] | None
"""Any number of tables, [[name]]; their own models check them."""


class EdgeTable(Model):
    """What is done with an edge of a panel."""

    allowance: NonNegative | None = Field(
        None,
        description="beyond the seam line; default 0 raw, and 10 turned, 7 lap, 8 tab in mm",
    )
    finish: Finish = Field(
        "raw", description="raw: as cut; turned: folded back; lap: under the other; tab: glued"
    )
    corner: Corner = Field("mitre", description="with the allowance of the edge beside it")

    @model_validator(mode="after")
    def _something_to_hold(self) -> EdgeTable:
        if self.finish != "raw" and self.allowance == 0.0:
            raise JobError(
                f"a {self.finish} edge has no allowance",
                place="allowance",
                value=0.0,
                limit="above 0",
                remedy=f"give a width, or leave the key out: {ALLOWANCES[self.finish]:g} mm",
            )
        return self


class EdgesTable(Model):
    """The edges of a panel: start and end are the first and last ruling."""

    start: EdgeTable | None = None
    end: EdgeTable | None = None
    base: EdgeTable | None = None
    top: EdgeTable | None = None


class PanelTable(Model):
    """One panel of a part of several."""

    name: Name
    surface: dict[str, Any]
    place: PlaceTable | None = None
    cutout: Tables = None
    mark: Tables = None
    trim: Tables = None
    edges: EdgesTable | None = None


class JobTable(Model):
    """A job file. Lengths are in ``units``, angles in degrees, expressions in radians."""

    name: Name
    units: Literal["mm", "cm", "m", "in"] = "mm"
    tolerance: Positive | None = Field(None, description="default 0.05 mm")
    thickness: NonNegative = 0.0
    reference: Literal["middle", "front", "back"] = "middle"
    material: Annotated[str, Field(strict=True), AfterValidator(_material)] | None = None
    pipeline: Text | None = None
    bend: Annotated[float, Field(strict=True, ge=0.0, le=1.0)] = 1.0
    meta: MetaTable = MetaTable()
    recipe: RecipeTable = RecipeTable()
    place: PlaceTable | None = None
    cutout: Tables = None
    mark: Tables = None
    trim: Tables = None
    edges: EdgesTable | None = None
    seam: Tables = None
    simulate: dict[str, Any] | None = None
    surface: dict[str, Any] | None = None
    panel: Annotated[list[PanelTable], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> JobTable:
        if (self.surface is None) == (self.panel is None):
            given = "neither [surface] nor [[panel]]"
            if self.panel is not None:
                given = "both [surface] and [[panel]]"
            raise JobError(
                f"the job has {given}",
                value=given,
                limit="one of the two",
                remedy="a part of one panel has [surface], a part of several [[panel]] tables",
            )
        for key in ("place", "edges", "cutout", "mark", "trim"):
            if self.panel is not None and getattr(self, key) is not None:
                one = key in ("place", "edges")
                table = f"[{key}]" if one else f"[[{key}]]"
                below = f"[panel.{key}]" if one else f"[[panel.{key}]]"
                raise JobError(
                    f"{table} stands beside [[panel]] tables",
                    value=key,
                    limit="[surface] jobs only",
                    remedy=f"write {below} below the panel it belongs to",
                )
        _refuse_twins([panel.name for panel in self.panel or ()])
        return self


def _refuse_twins(names: list[str]) -> None:
    """JobError where two panels have one name, case ignored."""
    seen: dict[str, str] = {}
    for name in names:
        if name.lower() in seen:
            raise JobError(
                f'two panels are named "{seen[name.lower()]}" and "{name}"',
                value=name,
                limit="names that differ, case ignored",
                remedy="rename one of them",
            )
        seen[name.lower()] = name
