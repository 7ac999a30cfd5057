"""A job's features and seams: from their tables to values in mm and radians."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from devcad.errors import DevcadError, JobError, LimitError
from devcad.features import Cutout, Drill, Features, Mark, Placing, Seam, Trim
from devcad.flatten.rings import Contour
from devcad.geometry.edge import Edge
from devcad.geometry.values import unit
from devcad.job import featuretables as tables
from devcad.job.invalid import problems, unknown_kind

MAX_FEATURES = 10_000
"""Of one panel; every contour of a drawing is one."""
MAX_LINES = 50_000
"""Lines of the contours and marks of one panel."""

M = TypeVar("M", bound=BaseModel)
Tables = Sequence[dict[str, Any]] | None


@dataclass(slots=True)
class Reading:
    """One job's tables on their way to values: what was found wrong, and the drawings read.

    ``mm`` is the job's unit; what a panel may still have counts down.
    """

    mm: float
    found: list[DevcadError] = field(default_factory=list)
    drawings: dict[tuple[str, str | None], tuple[Contour, ...]] = field(default_factory=dict)
    features_left: int = MAX_FEATURES
    lines_left: int = MAX_LINES

    def features(self, cutouts: Tables, marks: Tables, trims: Tables, place: str) -> Features:
        """The features of a panel; ``place`` is the panel's, and that of its tables follows."""
        self.features_left, self.lines_left = MAX_FEATURES, MAX_LINES
        try:
            return Features(
                tuple(self._all(cutouts, f"{place} > cutout", self._cutouts)),
                tuple(self._all(marks, f"{place} > mark", self._marks)),
                tuple(self._all(trims, f"{place} > trim", self._trims)),
            )
        except LimitError as error:
            self.found.append(error.at(place=place))
            return Features()

    def seams(self, rows: Tables, place: str) -> tuple[Seam, ...]:
        """The seams of a part."""
        return tuple(self._all(rows, f"{place} > seam", self._seams))

    def _all(
        self, rows: Tables, place: str, make: Callable[[dict[str, Any], str], Iterator[Any]]
    ) -> Iterator[Any]:
        """What every table gives; its errors are kept, with its number."""
        for k, row in enumerate(rows or (), start=1):
            try:
                made = list(make(row, f"{place} {k}"))
            except DevcadError as error:
                self.found.append(error.at(place=f"{place} {k}"))
                continue
            for feature in made:
                self._count(feature)
            yield from made

    def _model(self, model: type[M], row: dict[str, Any], place: str) -> M | None:
        """The model of a table, or None and its problems kept."""
        try:
            return model.model_validate(row)
        except ValidationError as error:
            self.found += problems(error, row, model, place=place)
            return None

    def _shaped(self, models: Mapping[str, type[M]], row: dict[str, Any], place: str) -> M | None:
        """The model of a table by its key shape."""
        shape = row.get("shape")
        if shape is None:
            raise JobError(
                "the key is missing",
                place=f"{place} > shape",
                value="",
                limit=", ".join(models),
                remedy=f"add shape = ...; known: {', '.join(models)}",
            )
        if not isinstance(shape, str) or shape not in models:
            raise unknown_kind(str(shape), models, place=f"{place} > shape", noun="shape")
        return self._model(models[shape], row, place)

    def _cutouts(self, row: dict[str, Any], place: str) -> Iterator[Cutout | Drill]:
        table = self._shaped(tables.CUTOUTS, row, place)
        if isinstance(table, tables.Drill):
            point, direction = table.axis
            yield Drill(
                place,
                self.mm * np.array(point, dtype=float),
                unit(direction),
                self.mm * table.diameter,
                table.through,
                table.notch,
            )
        elif isinstance(table, tables.Dxf):
            contours = self._drawn(table, place)
            for k, contour in enumerate(contours, start=1):
                where = place if len(contours) == 1 else f"{place} > contour {k}"
                yield Cutout(where, contour, self._placing(table), table.notch)
        elif table is not None:
            yield Cutout(place, table.contour(self.mm), self._placing(table), table.notch)

    def _drawn(self, table: tables.Dxf, place: str) -> tuple[Contour, ...]:
        """The contours of a drawing, read once however often it is named."""
        key = table.file.name, table.layer
        if key not in self.drawings:
            from devcad.importers.dxf import read_contours

            self.drawings[key] = read_contours(
                table.file.data,
                layer=table.layer,
                mm_per_unit=self.mm,
                place=f"{place} > file > {table.file.name}",
            )
        return self.drawings[key]

    def _marks(self, row: dict[str, Any], place: str) -> Iterator[Mark]:
        table = self._shaped(tables.MARKS, row, place)
        if table is not None:
            yield Mark(place, table.lines(self.mm), self._placing(table))

    def _trims(self, row: dict[str, Any], place: str) -> Iterator[Trim]:
        table = self._model(tables.TrimTable, row, place)
        if table is not None:
            point, normal = table.plane
            yield Trim(place, self.mm * np.array(point, dtype=float), unit(normal))

    def _seams(self, row: dict[str, Any], place: str) -> Iterator[Seam]:
        table = self._model(tables.SeamTable, row, place)
        if table is not None:
            first, second = (_panel_and_edge(edge) for edge in table.edges)
            yield Seam(first, second, place)

    def _placing(self, table: tables.Placed) -> Placing:
        at = None if table.at is None else (self.mm * table.at[0], self.mm * table.at[1])
        return Placing(at, table.at_surface, getattr(table, "angle", 0.0))

    def _count(self, feature: Any) -> None:
        """LimitError where a panel has more than it can have."""
        lines: tuple[Edge, ...] = getattr(feature, "contour", getattr(feature, "lines", ()))
        self.features_left -= 1
        self.lines_left -= len(lines)
        for what, left, most in (
            ("features", self.features_left, MAX_FEATURES),
            ("lines of cutouts and marks", self.lines_left, MAX_LINES),
        ):
            if left < 0:
                raise LimitError(
                    f"the panel has more than {most} {what}",
                    value=f"over {most}",
                    limit=most,
                    remedy="make several panels",
                )


def _panel_and_edge(name: str) -> tuple[str, str]:
    panel, _, edge = name.rpartition(".")
    return panel, edge
