"""CSV: the cut list of a job, a row a panel, in the order of the job."""

from __future__ import annotations

import math
from pathlib import Path

from devcad.export import Options, Written
from devcad.export.csvfile import Cell, write_table
from devcad.export.outline import drawing_path
from devcad.export.profile import style
from devcad.part import Panel, Part

HEADER = (
    "part",
    "panel",
    "part_number",
    "revision",
    "quantity",
    "material",
    "thickness",
    "blank_width",
    "blank_height",
    "area",
    "cut_length",
    "pierces",
    "mass_g",
    "grain_deg",
    "finish",
    "file",
)
"""Lengths in mm and areas in mm2, as in the report; what does not exist is empty."""
DRAWINGS = ("dxf", "svg", "pdf")
"""The files to cut from, the best first."""


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """JOB-cutlist.csv, written and read back.

    Blank width and height are the sides of the pattern's box as it is drawn, ``area`` is what is
    cut out of the sheet, net of holes; ``mass_g`` is that of one piece, ``file`` the drawing that
    was exported beside it.

    Raises:
        CheckFailed: csv-readback; FileError: the file cannot be written.
    """
    rows = [_row(part, panel, folder, options) for panel in part.panels]
    return [write_table(folder / f"{part.name}-cutlist.csv", "cutlist", HEADER, rows)]


def _row(part: Part, panel: Panel, folder: Path, options: Options) -> list[Cell]:
    x0, y0, x1, y1 = (float(x) for x in panel.pattern.bbox)
    facts = panel.facts
    return [
        part.name,
        panel.name,
        part.part_number,
        part.revision,
        part.quantity,
        part.material,
        panel.thickness,
        x1 - x0,
        y1 - y0,
        facts.get("flat_area", panel.pattern.area),
        facts.get("cut_length"),
        1 + len(panel.pattern.holes),
        facts.get("mass_g"),
        None if part.grain is None else math.degrees(part.grain),
        part.finish,
        cutting_file(part, panel, folder, options),
    ]


def cutting_file(part: Part, panel: Panel, folder: Path, options: Options) -> str | None:
    """The name of the panel's drawing that stands in the folder, the best kind of those there."""
    mark = {"dxf": style(options).mark}
    paths = [drawing_path(part, panel, folder, kind, mark.get(kind, "")) for kind in DRAWINGS]
    return next((path.name for path in paths if path.is_file()), None)
