"""CSV: the bend table, a row a bend line, as the operator of a press brake sets them."""

from __future__ import annotations

import math
from pathlib import Path

from devcad.export import Options, Written, panel_path
from devcad.export.csvfile import Cell, write_table
from devcad.flatten.bending import BendLine
from devcad.part import Panel, Part

HEADER = (
    "number",
    "x0",
    "y0",
    "x1",
    "y1",
    "datum_left",
    "datum_right",
    "angle_deg",
    "cumulative_deg",
    "radius_0",
    "radius_1",
    "loaded_deg",
    "order",
)
"""x, y: the bend line in the pattern, from base (0) to top (1); datum: mm along the pattern's base
(left) and top (right) from the panel's first edge; angle: up positive; radius: inside, at base and
top, mm; loaded: under the tool, before the sheet springs back; order: of bending, from 1."""


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """JOB-bends.csv, or JOB-PANEL-bends.csv for several panels, written and read back.

    A table without rows belongs to a panel that is not bent along lines.

    Raises:
        CheckFailed: csv-readback; FileError: the file cannot be written.
    """
    return [_table(part, panel, folder) for panel in part.panels]


def _table(part: Part, panel: Panel, folder: Path) -> Written:
    rows: list[list[Cell]] = []
    turned = 0.0
    for number, bend in enumerate(_bends(panel), start=1):
        turned += bend.line.angle
        rows.append(_row(number, bend, turned))
    path = panel_path(part, panel.name, folder, "csv")
    return write_table(path.with_stem(f"{path.stem}-bends"), "bends", HEADER, rows)


def _bends(panel: Panel) -> tuple[BendLine, ...]:
    """The bends of a press brake, or the creases of a panel that is rolled."""
    if panel.bends or panel.blank is None:
        return panel.bends
    from devcad.shop.bendlines import folds

    return folds(panel.blank, panel.thickness)


def _row(number: int, bend: BendLine, turned: float) -> list[Cell]:
    line = bend.line
    radii = line.radius or (None, None)
    return [
        number,
        float(line.start[0]),
        float(line.start[1]),
        float(line.end[0]),
        float(line.end[1]),
        *bend.datum,
        math.degrees(line.angle),
        math.degrees(turned),
        *radii,
        math.degrees(bend.loaded),
        line.order,
    ]
