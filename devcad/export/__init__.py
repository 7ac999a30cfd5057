"""Exporters: one file a format, and one table. They convert, re-read and report; they decide
no geometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from devcad.checks import Check
from devcad.errors import FileError

if TYPE_CHECKING:  # the table of formats must not cost the import of numpy
    from devcad.part import Part


@dataclass(frozen=True, slots=True)
class Options:
    """The recipe's keys that exporters read, in mm; defaults as in design.md section 5.

    ``step_tolerance`` None means min(tolerance / 10, 1e-4 mm).
    """

    step_tolerance: float | None = None
    step_degree: int = 5
    step_schema: str = "AP214"
    dxf_version: str = "R2000"
    dxf_profile: str = "generic"
    dxf_curves: str = "arcs"


@dataclass(frozen=True, slots=True)
class Written:
    """A file that was written and read back: its largest deviation from the true shape in mm
    (0 where exact) and the checks made on what was read."""

    path: Path
    format: str
    max_deviation: float
    checks: tuple[Check, ...] = ()


Writer = Callable[["Part", Path, Options], list[Written]]

FORMATS: dict[str, tuple[str, str]] = {
    "step": ("devcad.export.step", "exact boundary representation, AP214, mm"),
    "stl": ("devcad.export.stl", "binary triangles, mm"),
    "glb": ("devcad.export.glb", "glTF 2.0 binary, metres, Y up, UV0 = the flat pattern"),
    "dxf": ("devcad.export.dxf", "cut pattern, lines and arcs, mm"),
    "svg": ("devcad.export.svg", "cut pattern at true size"),
    "lorentz-svg": (
        "devcad.export.lorentz",
        "Lorentzian unrolling of a Minkowski surface, a figure that is not for cutting",
    ),
}

DEFAULT_FORMATS = ("step", "stl", "glb", "dxf", "svg")
"""What is written where neither the caller nor the recipe says what."""


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
