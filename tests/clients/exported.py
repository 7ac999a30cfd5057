"""A sample as it was exported: what the client tests compare the clients' findings with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Look = Callable[[Path], dict[str, Any]]
"""A file's path -> what a client saw in it."""


@dataclass(frozen=True)
class Exported:
    """A job's folder under out/, its report, and what it was built with (mm, sRGB).

    ``solids`` are the areas (mm2) of the middle surfaces of what becomes a solid each: of the
    panels, and of the flanks that grooves part in a thick folded one.
    """

    folder: Path
    report: dict[str, Any]
    thickness: float
    tolerance: float
    colour: tuple[float, float, float]
    solids: tuple[float, ...]

    @property
    def name(self) -> str:
        return str(self.report["job"])

    @property
    def panels(self) -> list[dict[str, Any]]:
        return list(self.report["panels"])

    @property
    def solid(self) -> bool:
        return self.thickness > 0.0

    @property
    def step_formats(self) -> list[str]:
        """The STEP files that differ: a sheet without thickness is its own mid-surface."""
        return ["step", "step-flat", "step-sheet"] if self.solid else ["step", "step-flat"]

    def total(self, key: str) -> float:
        """The sum over the panels of an entry of the report."""
        return sum(float(panel[key]) for panel in self.panels)

    def files(self, format: str) -> list[Path]:
        """The files of one format, per-panel files in the panels' order."""
        return [self.folder / f["path"] for f in self.report["files"] if f["format"] == format]

    def deviation(self, format: str) -> float:
        """The largest deviation in mm that the report states for a format."""
        found = [f["max_deviation"] for f in self.report["files"] if f["format"] == format]
        return float(max(found))
