"""Exporters: one file a format, and one table. They convert, re-read and report; they decide
no geometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from devcad.checks import Check
from devcad.errors import FileError
from devcad.shop.settings import Pdf

if TYPE_CHECKING:  # the table of formats must not cost the import of numpy
    from devcad.part import Part


@dataclass(frozen=True, slots=True)
class Options:
    """The recipe's keys that exporters read, in mm; defaults as in design.md section 5.

    ``step_tolerance`` None means min(tolerance / 10, 1e-4 mm). ``dxf_version``, ``dxf_curves``
    and ``dxf_bend_ticks`` (mm at both ends of a bend line, 0 for the whole line) None mean
    what the profile has. With ``dxf_together`` there is a drawing of all panels too; with
    ``glb_animate`` glTF files unroll and fold, mechanisms move; where it is None those do that have
    a motion of their own: curved creases and mechanisms. ``kerf`` (mm) moves the contours
    of cut patterns before they are written, never the pattern of the part.
    """

    step_tolerance: float | None = None
    step_degree: int = 5
    step_schema: str = "AP214"
    dxf_version: str | None = None
    dxf_profile: str = "generic"
    dxf_curves: str | None = None
    dxf_bend_ticks: float | None = None
    dxf_together: bool = False
    pdf: Pdf = field(default_factory=Pdf)
    glb_animate: bool | None = None
    kerf: float = 0.0


@dataclass(frozen=True, slots=True)
class Written:
    """A file that was written and read back: its largest deviation from the true shape in mm
    (0 where exact), the checks made on what was read, and what else the report says of it."""

    path: Path
    format: str
    max_deviation: float
    checks: tuple[Check, ...] = ()
    note: str = ""


Writer = Callable[["Part", Path, Options], list[Written]]

FORMATS: dict[str, tuple[str, str]] = {
    "step": ("devcad.export.step", "exact boundary representation, AP214, mm"),
    "step-flat": ("devcad.export.stepflat", "the flat blanks as STEP bodies in z = 0, mm"),
    "step-sheet": ("devcad.export.stepsheet", "the mid-surface as STEP sheet bodies, mm"),
    "stl": ("devcad.export.stl", "binary triangles, mm"),
    "3mf": ("devcad.export.threemf", "solids for slicers, with unit, names and colour, mm"),
    "glb": ("devcad.export.glb", "glTF 2.0 binary, metres, Y up, UV0 = the flat pattern"),
    "dxf": ("devcad.export.dxf", "cut pattern, lines and arcs, mm"),
    "svg": ("devcad.export.svg", "cut pattern at true size"),
    "pdf": ("devcad.export.pdf", "cut pattern 1:1 for printers, on tiles or on one page"),
    "traveller": ("devcad.export.traveller", "PDF, a page a panel that goes through the shop"),
    "cutlist": ("devcad.export.cutlist", "CSV, a row a panel: blank, material, quantity, lengths"),
    "rolling": ("devcad.export.rolling", "CSV, the rolls' settings along a panel that is rolled"),
    "bends": ("devcad.export.bends", "CSV, a row a bend line: place, angle, radii, order"),
    "motion": ("devcad.export.motion", "SVG figure and CSV table of how a mechanism moves"),
    "lorentz-svg": (
        "devcad.export.lorentz",
        "Lorentzian unrolling of a Minkowski surface, a figure that is not for cutting",
    ),
}

DEFAULT_FORMATS = ("step", "stl", "glb", "dxf", "svg")
"""What is written where neither the caller nor the recipe says what."""

LAST = ("cutlist", "traveller")
"""Formats that speak of the files beside them: written when those are there."""


def writer(name: str) -> Writer:
    """The ``write`` function of a format; its libraries load now and not before.

    Raises:
        FileError: a library of that format cannot be loaded on this machine.
    """
    try:
        write: Writer = import_module(FORMATS[name][0]).write
    except ImportError as error:
        raise FileError(
            f"the format {name} cannot be written here: {error}",
            value=name,
            remedy="install the missing library (on Debian: libgl1 libx11-6), or leave the format "
            "out with --to",
        ) from None
    return write


def panel_path(part: Part, panel_name: str, folder: Path, suffix: str) -> Path:
    """The path of a per-panel file: JOB.suffix for one panel, JOB-PANEL.suffix for several."""
    stem = part.name if len(part.panels) == 1 else f"{part.name}-{panel_name}"
    return folder / f"{stem}.{suffix}"
