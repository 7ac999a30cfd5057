"""From panels as they were constructed to a Part: all of them made, and joined at their seams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from devcad.checks import Check, require
from devcad.errors import DevcadError, JobError
from devcad.features import Seam
from devcad.flatten.blank import Blank
from devcad.flatten.neutral import Fibre
from devcad.making import Making, PanelSpec, panel_of
from devcad.part import Panel, Part

if TYPE_CHECKING:  # what most jobs do not ask for is loaded where one does
    from devcad.geometry.seams import Meeting
    from devcad.shop.limits import Bounds
    from devcad.shop.settings import Bends


def assemble(
    name: str,
    specs: Sequence[PanelSpec],
    *,
    thickness: float,
    reference: str,
    tolerance: float,
    bend: float,
    fibre: Fibre | None = None,
    limits: Bounds | None = None,
    seams: Sequence[Seam] = (),
    allow: frozenset[str] = frozenset(),
    inside_radius: float | None = None,
    bends: Bends | None = None,
) -> Part:
    """The part made of these panels, with every geometric check it passed.

    Args:
        thickness, reference, tolerance, bend, fibre, limits, allow, inside_radius, bends: as in
            :class:`Making`. The pattern is the same for every bend.
        seams: the edges of the panels that are to meet.
    Raises:
        GeometryError, CheckFailed: with the panel's name.
    """
    how = Making(thickness, reference, tolerance, bend, fibre, limits, allow, inside_radius, bends)
    made: list[Panel] = []
    blanks: list[Blank] = []
    checks: list[Check] = []
    for spec in specs:
        try:
            panel, blank, proven = _made(spec, how)
        except DevcadError as error:
            if len(specs) > 1:
                error.panel = error.panel or spec.name
            raise
        made.append(panel)
        blanks.append(blank)
        checks += proven
    panels: tuple[Panel, ...] = tuple(made)
    meetings: tuple[Meeting, ...] = ()
    if seams:
        from devcad.seams import joined

        _refuse_folded(panels, seams)

        panels, meetings, met = joined(
            made,
            [blank.middle for blank in blanks],
            [blank.developments for blank in blanks],
            seams,
            reference=reference,
            tolerance=tolerance,
        )
        require(met, allow)
        checks += met
    if len(panels) == 1:  # a job of one panel need not be told which
        checks = [replace(check, panel=panels[0].name) for check in checks]
    return Part(name, panels, thickness, tolerance, tuple(checks), seams=meetings)


def _refuse_folded(panels: Sequence[Panel], seams: Sequence[Seam]) -> None:
    """Raise a JobError for a seam of a sheet with curved creases, whose edges are several."""
    folded = {panel.name for panel in panels if panel.flanks}
    for seam in seams:
        for name, _ in (seam.first, seam.second):
            if name in folded:
                raise JobError(
                    f"panel {name} has curved creases, and such sheets are not sewn",
                    place=seam.place,
                    value=name,
                    remedy="leave the seam out; the edges of the pattern can have allowances",
                )


def _made(spec: PanelSpec, how: Making) -> tuple[Panel, Blank, list[Check]]:
    if not spec.flanks:
        return panel_of(spec, how)
    from devcad.folded import folded

    return folded(spec, how)
