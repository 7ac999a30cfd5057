"""How a panel folds, for the files that show it: its hinged strip, its sheet, its flat place."""

from __future__ import annotations

from devcad.mesh.hinged import Hinged, hinged
from devcad.mesh.lodged import Sheet, perforated, whole
from devcad.part import Panel, Part

SIDE_BY_SIDE = 10.0
"""mm between the patterns of several panels, as in STEP files of flat blanks."""


def strip_of(panel: Panel) -> Hinged | None:
    """The panel as a hinged strip; None where it is known by its pattern alone, or is several."""
    if panel.blank is None or not panel.chain.patches or panel.flanks:
        return None
    return hinged(panel.chain, panel.rulings, panel.places)


def sheet_of(panel: Panel, strip: Hinged) -> Sheet:
    """The panel's sheet, without what is cut out of it."""
    return perforated(strip, panel.mesh) if panel.cuts else whole(strip)


def pattern_shifts(part: Part) -> list[tuple[float, float]]:
    """How far each panel's pattern is moved so that they lie side by side: the first lies in its
    own coordinates, each next one 10 mm to the right of the box before, their lower edges level."""
    boxes = [panel.pattern.bbox for panel in part.panels]
    out, right = [(0.0, 0.0)], boxes[0][2]
    for x0, y0, x1, _ in boxes[1:]:
        out.append((right + SIDE_BY_SIDE - x0, boxes[0][1] - y0))
        right += SIDE_BY_SIDE + x1 - x0
    return out
