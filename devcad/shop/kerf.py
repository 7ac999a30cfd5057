"""Kerf: the cut file of a pattern, for a tool that removes a width of its own."""

from __future__ import annotations

from dataclasses import replace

from devcad.errors import DevcadError, GeometryError
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge, Pattern
from devcad.part import Part
from devcad.shop.corners import place
from devcad.shop.offset import offset_contour
from devcad.shop.polygons import fine_polygon

FINE = 1e-5  # of the pattern's size: the sagitta of polygons that may not cross


def kerfed(part: Part, kerf: float) -> Part:
    """The part with the patterns that its cut files show: as :func:`with_kerf` for every panel.

    Raises:
        GeometryError: as :func:`with_kerf`, with the panel.
    """
    panels = []
    for panel in part.panels:
        try:
            pattern = with_kerf(panel.pattern, kerf)
        except DevcadError as error:
            raise error.at(panel=panel.name) from None
        panels.append(replace(panel, pattern=pattern))
    return replace(part, panels=tuple(panels))


def with_kerf(pattern: Pattern, kerf: float) -> Pattern:
    """The pattern whose contours a tool of width ``kerf`` (mm) follows with its middle.

    The outline moves outwards by half of it and the holes inwards, corners kept sharp (mitred);
    a negative kerf moves them the other way. What is only drawn stays where it is.

    Raises:
        GeometryError: a hole, a hollow or a neck is narrower than the kerf, or contours meet.
    """
    if kerf == 0.0:
        return pattern
    outline = _moved(pattern.outline, kerf)
    holes = tuple(_moved(hole, kerf) for hole in pattern.holes)
    if kerf < 0.0:  # what is cut away grows
        _refuse_meeting(outline, holes, kerf)
    area = enclosed_area(outline) + sum(enclosed_area(hole) for hole in holes)
    return replace(pattern, outline=outline, holes=holes, area=area, bbox=bounds(outline))


def _moved(contour: tuple[Edge, ...], kerf: float) -> tuple[Edge, ...]:
    """A contour moved by half a kerf away from the sheet that is kept."""
    try:
        return offset_contour(contour, [0.5 * kerf] * len(contour))
    except GeometryError as error:
        error.what = f"with a kerf of {kerf:.4g} mm {error.what}"
        raise


def _refuse_meeting(
    outline: tuple[Edge, ...], holes: tuple[tuple[Edge, ...], ...], kerf: float
) -> None:
    """GeometryError where two contours of a pattern meet."""
    if not holes:
        return
    import shapely

    sides = bounds(outline)
    fine = FINE * max(sides[2] - sides[0], sides[3] - sides[1])
    rings = [shapely.LinearRing(fine_polygon(edges, fine)[0]) for edges in (outline, *holes)]
    one, other = shapely.STRtree(rings).query(rings, predicate="intersects")
    for i, j in zip(one.tolist(), other.tolist(), strict=True):
        if i < j:
            raise GeometryError(
                f"with a kerf of {kerf:.4g} mm two cuts meet",
                place=place(holes[j - 1][0].curve(holes[j - 1][0].u[:1])[0][0]),
                value=abs(kerf),
                remedy="use a smaller kerf, or move the holes apart",
            )
