"""The mid-surface as STEP: a sheet body for every panel, as if the sheet had no thickness."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from devcad.export import Options, Written
from devcad.export.step import written
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """Write ``part``-sheet.step into the folder and prove it on what reads back.

    A sheet body a panel whose front is +n, in the structure and with the names and the colour of
    the part's own STEP file; the same bodies where the part has no thickness. A sheet with curved
    creases is whole: without its grooves. The checks are step-deviation, step-twist and area.
    Errors as in ``step``.
    """
    panels = tuple(_middle(panel) for panel in part.panels)
    sheet = replace(part, panels=panels, thickness=0.0)
    return [written(sheet, folder / f"{part.name}-sheet.step", "step-sheet", options)]


def _middle(panel: Panel) -> Panel:
    """The panel without thickness."""
    if not (panel.folds and panel.thickness):
        return replace(panel, thickness=0.0)
    flanks = tuple(_whole(flank) for flank in panel.flanks)
    return replace(panel, thickness=0.0, flanks=flanks, surface_area=None)


def _whole(flank: Panel) -> Panel:
    """A flank without thickness, up to its creases."""
    assert flank.blank is not None
    pairs = zip(flank.chain.patches, flank.blank.middle.patches, strict=True)
    patches = tuple(_reaching(*pair) for pair in pairs)
    chain = replace(flank.chain, patches=patches)
    return replace(flank, thickness=0.0, chain=chain, surface_area=None)


def _reaching(patch: Patch, other: Patch) -> Patch:
    """The patch with the extent of another one."""

    def field(t: Array, order: int) -> RulingJet:
        jet, far = patch.field(t, order), other.field(t, order)
        return RulingJet(jet.c0, jet.e, far.v_from, far.v_to)

    return replace(patch, field=field)
