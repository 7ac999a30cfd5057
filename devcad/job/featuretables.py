"""The tables of a panel's features: cutouts, marks, trims; and of the seams between panels.

One model for each shape, in the job's units and degrees as written; ``features.py`` of the package
holds what becomes of them, in mm and radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema, model_validator

from devcad.errors import JobError
from devcad.flatten import shapes
from devcad.flatten.rings import Contour, self_crossing
from devcad.geometry.curves import Degrees, Direction, Flag, Model, Number, Positive, Vector

MAX_CHARACTERS = 200
FLAT = 1e-9
"""A polygon narrower than this share of its length encloses nothing."""
EDGES = ("start", "end", "base", "top")

Point = tuple[Number, Number]
"""Two finite numbers."""
Share = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=1.0)]
"""A number from 0 to 1."""
NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0)]
"""A finite number, 0 or above."""
Angle = Annotated[Degrees, Field(description="degrees, counterclockwise")]


@dataclass(frozen=True, slots=True)
class DrawingFile:
    """A file that a table names, with its bytes; ``name`` as the job gives it."""

    name: str
    data: bytes


def _drawing(value: Any) -> DrawingFile:
    """The file, read before the tables are checked."""
    if isinstance(value, DrawingFile):
        return value
    raise JobError(
        "must be the name of a file in quotes",
        value=str(value)[:40],
        limit="a text in quotes",
        remedy='give a name relative to the job, such as "holes.dxf"',
    )


def _letters(value: str) -> str:
    """A text whose characters all have strokes."""
    from devcad.flatten.lettering import require_letters

    require_letters(value)
    return value


def _simple(value: tuple[Point, ...]) -> tuple[Point, ...]:
    """The corners of a polygon that encloses something and does not cross itself."""
    corners = value[:-1] if len(value) > 3 and value[0] == value[-1] else value
    for k, corner in enumerate(corners):
        if corner == corners[k - 1]:
            raise JobError(
                f"points {(k - 1) % len(corners)} and {k} (counted from 0) are the same",
                value=k,
                remedy="remove one of them",
            )
    away = np.array(corners) - np.mean(corners, axis=0)
    longest, across = np.linalg.svd(away, compute_uv=False)
    if across <= FLAT * longest:
        raise JobError(
            "the corners lie on one line",
            value=0.0,
            remedy="give corners that enclose an area",
        )
    crossing = self_crossing(np.array(corners))
    if crossing is not None:
        x, y = crossing
        raise JobError(
            f"the polygon crosses or touches itself at ({x:.6g}, {y:.6g})",
            value="self-crossing",
            remedy="give the corners in their order round the hole",
        )
    return corners


class Placed(Model):
    """A feature with an origin of its own, in the pattern or on the surface."""

    at: Point | None = Field(None, description="where its origin lies in the pattern, [x, y]")
    at_surface: tuple[Share, Share] | None = Field(
        None, description="or on the surface: shares of t and of the extent, from 0 to 1"
    )

    @model_validator(mode="after")
    def _one_place(self) -> Placed:
        if (self.at is None) == (self.at_surface is None):
            given = "neither at nor at_surface" if self.at is None else "both at and at_surface"
            raise JobError(
                f"there {'is' if self.at is None else 'are'} {given}",
                value=given,
                limit="one of the two",
                remedy="give at = [x, y] in the pattern, or at_surface = [ft, fv], shares from 0 "
                "to 1",
            )
        return self


class Cut(Placed):
    """A contour that is cut out."""

    notch: Flag = Field(False, description="whether it may cross edges and other cutouts")


class Circle(Cut):
    """A round hole about its centre."""

    shape: Literal["circle"]
    diameter: Positive

    def contour(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.circle(mm * self.diameter)


class Slot(Cut):
    """A slot with round ends about its centre, along the angle."""

    shape: Literal["slot"]
    length: Positive = Field(description="overall")
    width: Positive
    angle: Angle = 0.0

    @model_validator(mode="after")
    def _long_enough(self) -> Slot:
        if self.length < self.width:
            raise JobError(
                f"the slot is {self.length:g} long overall and {self.width:g} wide",
                place="length",
                value=self.length,
                limit=self.width,
                remedy="the length includes the round ends: give at least the width",
            )
        return self

    def contour(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.slot(mm * self.length, mm * self.width)


class Rectangle(Cut):
    """A rectangle about its centre, its width along the angle."""

    shape: Literal["rectangle"]
    width: Positive
    height: Positive
    corner_radius: NonNegative = 0.0
    angle: Angle = 0.0

    @model_validator(mode="after")
    def _round_enough(self) -> Rectangle:
        half = 0.5 * min(self.width, self.height)
        if self.corner_radius > half:
            raise JobError(
                f"must be at most half the shorter side, {half:g}, is {self.corner_radius:g}",
                place="corner_radius",
                value=self.corner_radius,
                limit=half,
                remedy="give a smaller radius, or a slot",
            )
        return self

    def contour(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.rectangle(mm * self.width, mm * self.height, mm * self.corner_radius)


class Polygon(Cut):
    """Straight sides between points relative to its origin, either way round."""

    shape: Literal["polygon"]
    points: Annotated[tuple[Point, ...], Field(min_length=3), AfterValidator(_simple)]
    angle: Angle = 0.0

    def contour(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.polygon([(mm * x, mm * y) for x, y in self.points])


class Dxf(Cut):
    """The closed contours of a drawing, whose origin comes to lie where the feature is placed."""

    shape: Literal["dxf"]
    file: Annotated[DrawingFile, PlainValidator(_drawing), WithJsonSchema({"type": "string"})]
    layer: Annotated[str, Field(strict=True, min_length=1, max_length=255)] | None = None
    angle: Angle = 0.0


class Drill(Model):
    """A straight hole in 3D: where a drill along the axis meets the sheet as it stands."""

    shape: Literal["drill"]
    axis: tuple[Vector, Direction] = Field(description="[[point], [direction]]")
    diameter: Positive
    through: Flag = Field(False, description="all walls on both sides, not only the first ahead")
    notch: Flag = Field(False, description="whether it may cross edges and other cutouts")


class LineMark(Placed):
    """A line from where it is placed, along the angle."""

    shape: Literal["line"]
    length: Positive
    angle: Angle = 0.0

    def lines(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.line_mark(mm * self.length)


class ArrowMark(Placed):
    """An arrow from where it is placed, along the angle."""

    shape: Literal["arrow"]
    length: Positive
    angle: Angle = 0.0

    def lines(self, mm: float) -> Contour:
        """Its edges in mm."""
        return shapes.arrow_mark(mm * self.length)


class TextMark(Placed):
    """A line of text; its baseline begins where it is placed and runs along the angle."""

    shape: Literal["text"]
    text: Annotated[
        str, Field(strict=True, min_length=1, max_length=MAX_CHARACTERS), AfterValidator(_letters)
    ]
    height: Positive = Field(description="of a capital letter")
    angle: Angle = 0.0

    def lines(self, mm: float) -> Contour:
        """Its edges in mm."""
        from devcad.flatten.lettering import lettering

        return lettering(self.text, mm * self.height)


class TrimTable(Model):
    """A plane; what its normal points to is cut off."""

    plane: tuple[Vector, Direction] = Field(description="[[point], [normal]]")


def _edge(value: str) -> str:
    """The name of a panel's edge, panel.edge."""
    panel, dot, edge = value.rpartition(".")
    if not dot or not panel or edge not in EDGES:
        raise JobError(
            f'"{value[:70]}" is no edge of a panel',
            value=value[:70],
            limit=", ".join(f"<panel>.{edge}" for edge in EDGES),
            remedy='name a panel and its edge, such as "left.top"',
        )
    return value


EdgeName = Annotated[str, Field(strict=True, max_length=200), AfterValidator(_edge)]
"""panel.start, panel.end, panel.base or panel.top."""


class SeamTable(Model):
    """Two edges that meet in space."""

    edges: tuple[EdgeName, EdgeName]

    @model_validator(mode="after")
    def _two(self) -> SeamTable:
        if self.edges[0].lower() == self.edges[1].lower():
            raise JobError(
                f'the edge "{self.edges[0]}" is to meet itself',
                place="edges",
                value=self.edges[0],
                limit="two edges",
                remedy="name the edge that it is joined to",
            )
        return self


CUTOUTS: Mapping[str, type[Circle | Slot | Rectangle | Polygon | Dxf | Drill]] = {
    "circle": Circle,
    "slot": Slot,
    "rectangle": Rectangle,
    "polygon": Polygon,
    "dxf": Dxf,
    "drill": Drill,
}
"""Each shape of a cutout and its model."""
MARKS: Mapping[str, type[LineMark | TextMark | ArrowMark]] = {
    "line": LineMark,
    "text": TextMark,
    "arrow": ArrowMark,
}
"""Each shape of a mark and its model."""


def cutout_spec() -> Any:
    """The type of any cutout, told apart by its key ``shape``, for the JSON Schema."""
    return Annotated[reduce(or_, CUTOUTS.values()), Field(discriminator="shape")]


def mark_spec() -> Any:
    """The type of any mark, told apart by its key ``shape``, for the JSON Schema."""
    return Annotated[reduce(or_, MARKS.values()), Field(discriminator="shape")]
