"""The tables of a job file, as pydantic models; the surfaces' own models stand with them."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from devcad.errors import JobError
from devcad.geometry.curves import Count, Direction, Model, Number, Positive, Vector
from devcad.job.recipe import RecipeTable
from devcad.shop.materials import material

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


class PanelTable(Model):
    """One panel of a part of several."""

    name: Name
    surface: dict[str, Any]
    place: PlaceTable | None = None


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
        if self.panel is not None and self.place is not None:
            raise JobError(
                "[place] stands beside [[panel]] tables",
                value="place",
                limit="[surface] jobs only",
                remedy="write [panel.place] below the panel it belongs to",
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
