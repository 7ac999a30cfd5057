"""DXF of all panels in one drawing, their patterns side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from devcad.checks import Check
from devcad.errors import JobError
from devcad.export import Options, Written
from devcad.export.dxf import write_sheet
from devcad.export.dxfcheck import check_profile
from devcad.export.folding import pattern_shifts
from devcad.export.outline import approximate
from devcad.export.profile import style
from devcad.part import Part
from devcad.shop.placing import moved_pattern

NAME = "together"


def write_together(part: Part, folder: Path, options: Options) -> Written:
    """One drawing with every panel, the first in its own coordinates, each next one 10 mm to its
    right, lower edges level; read back and measured like each panel's own, and held against the
    profile.

    Raises:
        JobError: the profile draws one piece a block, or a panel has the drawing's name;
        CheckFailed, FileError: as :func:`devcad.export.dxf.write`.
    """
    how = style(options)
    if any(panel.name.lower() == NAME for panel in part.panels):
        raise JobError(
            f'a panel is named "{NAME}", as the drawing of all of them would be',
            value=NAME,
            remedy="give the panel another name, or leave dxf.together out",
        )
    panels = [
        replace(panel, pattern=moved_pattern(panel.pattern, 0.0, np.array(shift)))
        for panel, shift in zip(part.panels, pattern_shifts(part), strict=True)
    ]
    about = "-approximate" if any(approximate(part, panel) for panel in part.panels) else ""
    path = folder / f"{part.name}-{NAME}{about}{how.mark}.dxf"
    found, checks = write_sheet(path, [(panel, part.tolerance) for panel in panels], how)
    faults = check_profile(path, how.profile.name, several=True)
    held = Check(
        "dxf-profile", "", float(len(faults)), 0.0, "", not faults, says="; ".join(faults),
        remedy="mend the patterns where it is said, or write for another dxf.profile",
    )  # fmt: skip
    words = f"all panels in one drawing, accepted by profile {how.profile.name}"
    return Written(path, "dxf", found, (*checks, held), words)
