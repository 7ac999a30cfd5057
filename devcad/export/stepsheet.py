"""The mid-surface as STEP: a sheet body for every panel, as if the sheet had no thickness."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from devcad.export import Options, Written
from devcad.export.step import written
from devcad.part import Part


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """Write ``part``-sheet.step into the folder and prove it on what reads back.

    A sheet body a panel whose front is +n, in the structure and with the names and the colour of
    the part's own STEP file; the same bodies where the part has no thickness. The checks are
    step-deviation, step-twist and area. Errors as in ``step``.
    """
    panels = tuple(replace(panel, thickness=0.0) for panel in part.panels)
    sheet = replace(part, panels=panels, thickness=0.0)
    return [written(sheet, folder / f"{part.name}-sheet.step", "step-sheet", options)]
