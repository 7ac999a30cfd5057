"""CSV: the table for the plate rolls, a row a ruling."""

from __future__ import annotations

from pathlib import Path

from devcad.export import Options, Written, panel_path
from devcad.export.csvfile import Cell, write_table
from devcad.part import Panel, Part
from devcad.shop.materials import material
from devcad.shop.rolling import Station, stations
from devcad.shop.springback import stiffness_ratio

HEADER = (
    "number",
    "t",
    "base",
    "top",
    "bend",
    "radius_0",
    "radius_1",
    "loaded_0",
    "loaded_1",
    "template",
)
"""``base`` and ``top``: mm along the blank's edges; radii: inside, at base (0) and top (1)."""
EVERY = 25.0
"""mm between two stations along the longer edge, at most."""
LEAST = 8
"""Stations of a small panel, about."""
TURNS = {1: "up", -1: "down", 0: ""}


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """JOB-rolling.csv, or JOB-PANEL-rolling.csv for several panels, written and read back.

    A table without rows belongs to a panel that is not rolled: plane, or folded along lines. The
    loaded radii need a material of the library.

    Raises:
        CheckFailed: csv-readback; FileError: the file cannot be written.
    """
    return [_table(part, panel, folder) for panel in part.panels]


def _table(part: Part, panel: Panel, folder: Path) -> Written:
    sheet = material(part.material) if part.material and panel.thickness else None
    flow = None
    if sheet is not None:
        flow = stiffness_ratio(sheet.yield_strength, sheet.youngs_modulus, panel.thickness)
    x0, y0, x1, y1 = panel.pattern.bbox
    every = min(EVERY, max(x1 - x0, y1 - y0) / LEAST)
    rows = [_row(k, one) for k, one in enumerate(stations(panel, every, flow), start=1)]
    path = panel_path(part, panel.name, folder, "csv")
    return write_table(path.with_stem(f"{path.stem}-rolling"), "rolling", HEADER, rows)


def _row(number: int, station: Station) -> list[Cell]:
    return [
        number,
        station.t,
        station.base,
        station.top,
        TURNS[station.turn],
        *station.radii,
        *station.loaded,
        station.template,
    ]
