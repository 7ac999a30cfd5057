"""Lorentzian unrolling of every Minkowski surface as an SVG, a figure that nobody should cut.

True scale, one user unit = 1 mm of Lorentz length, as in the cut pattern's SVG; but no layer of a
cutter, colours that none of them knows, and a text that says so. It may overlap itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import numpy as np

from devcad.checks import at_most
from devcad.errors import DevcadError, JobError
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.outline import EXACT, FITS, ROUNDING, drawing_path, longer_side
from devcad.export.svgpaths import NAMESPACE, closed_path, number, read_closed, straight_path
from devcad.flatten import loops
from devcad.flatten.loops import Loop
from devcad.flatten.lorentz import Spacetime, lorentz_pattern
from devcad.flatten.measure import loop_deviation
from devcad.flatten.pattern import Pattern
from devcad.part import Panel, Part

MARK = "-lorentz-not-for-cutting"
SAYS = "Lorentzian unrolling - not for cutting"
OUTLINE, RULING, TEXT = "LORENTZ_OUTLINE", "LORENTZ_RULING", "LORENTZ_TEXT"
COLOURS = {RULING: "#C9A0DC", OUTLINE: "#7B2D8B", TEXT: "#7B2D8B"}
READBACK = "svg-readback"
SHARE = 0.1  # of the part's tolerance goes into the drawing
STROKE, MARGIN, LETTERS = 0.003, 0.04, 0.03  # of the figure's longer side; the last: text height
LINE = 1.5  # heights of a line of text
WIDEST = 0.6  # a letter's width over its height, more than any font's mean


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One SVG for each Minkowski panel, written, read back and measured against the true curves.

    Raises:
        JobError: no panel is a Minkowski surface.
        GeometryError: a panel has no unrolling (lightlike rulings or tangent planes).
        CheckFailed: svg-deviation or svg-readback.
        FileError: the file cannot be written.
    """
    surfaces = [(panel, panel.spacetime) for panel in part.panels if panel.spacetime is not None]
    if not surfaces:
        raise JobError(
            "lorentz-svg draws surfaces of Minkowski space, and this part has none",
            value="lorentz-svg",
            remedy='leave lorentz-svg out of the formats, or construct with metric = "minkowski"',
        )
    return [_write_panel(part, panel, surface, folder, options) for panel, surface in surfaces]


def _write_panel(
    part: Part, panel: Panel, surface: Spacetime, folder: Path, options: Options
) -> Written:
    path = drawing_path(part, panel, folder, "svg", MARK)
    limit = SHARE * part.tolerance
    try:
        figure = lorentz_pattern(surface, panel.rulings)
    except DevcadError as error:
        raise error.at(panel=panel.name if len(part.panels) > 1 else "") from None
    fit = FITS["polyline" if options.dxf_curves == "polyline" else "arcs"]
    border = fit(figure.outline, limit)
    name = part.name if len(part.panels) == 1 else f"{part.name} {panel.name}"
    timelike = surface.chain.patches[0].causal == "timelike"
    text = "\n".join(_document(name, figure, border, timelike=timelike))
    with opened(path, "wb") as stream:
        stream.write(f"{text}\n".encode("ascii"))
    found = _measured(_read(path, panel, figure, border.exact), panel, figure, limit, path)
    check = at_most(
        "svg-deviation",
        panel.name,
        found,
        limit,
        "mm",
        says="the Lorentzian figure as read back leaves the true one",
        remedy="use a larger tolerance",
    )
    return Written(path, "lorentz-svg", found, demanded([check], path))


def _origin(figure: Pattern) -> tuple[float, float]:
    """The figure's point (mm) at the upper left corner of the drawing."""
    margin = MARGIN * longer_side(figure)
    return figure.bbox[0] - margin, figure.bbox[3] + margin


def _document(name: str, figure: Pattern, border: Loop, *, timelike: bool) -> Iterator[str]:
    """The lines of the file."""
    xmin, ymin, xmax, ymax = figure.bbox
    size = longer_side(figure)
    margin, height = MARGIN * size, LETTERS * size
    plane = "dx^2 - dw^2, w upwards" if timelike else "dx^2 + dy^2"
    told = [SAYS, f"area {figure.area:.6g} mm2, metric {plane}, 1 unit = 1 mm"]
    widest = WIDEST * height * max(len(line) for line in told)
    width = number(max(xmax - xmin, widest) + 2.0 * margin)
    below = ymax - ymin + 2.0 * margin
    tall = number(below + LINE * height * len(told))
    origin = np.array(_origin(figure))
    title = escape(name.encode("ascii", "backslashreplace").decode("ascii"))
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<svg xmlns="{NAMESPACE}" version="1.1" width="{width}mm" height="{tall}mm"'
        f' viewBox="0 0 {width} {tall}">'
    )
    yield f"<title>{title}: {SAYS}</title>"
    lines = [straight_path(line.start, line.end, origin) for line in figure.lines]
    for layer, paths in ((RULING, lines), (OUTLINE, [closed_path(border, origin)])):
        if paths:
            stroke = f'stroke="{COLOURS[layer]}" stroke-width="{number(STROKE * size)}"'
            yield f'<g id="{layer}" fill="none" {stroke}>'
            yield from (f'<path d="{data}"/>' for data in paths)
            yield "</g>"
    letters = f'font-family="sans-serif" font-size="{number(height)}"'
    yield f'<g id="{TEXT}" fill="{COLOURS[TEXT]}" stroke="none" {letters}>'
    for k, line in enumerate(told, start=1):
        y = number(below + (LINE * k - 0.5) * height)
        yield f'<text x="{number(margin)}" y="{y}">{escape(line)}</text>'
    yield "</g>"
    yield "</svg>"


def _read(path: Path, panel: Panel, figure: Pattern, exact: bool) -> Loop:
    """The outline of a file as it was read, back in the figure's coordinates.

    Raises:
        CheckFailed: it is not the drawing that was written.
    """
    try:
        with opened(path, "rb") as stream:
            root = ElementTree.fromstring(stream.read())
        groups = {group.get("id"): list(group) for group in root.iter(f"{{{NAMESPACE}}}g")}
        (border,) = groups[OUTLINE]
        if SAYS not in [text.text for text in groups[TEXT]]:
            raise ValueError("it does not say that it is not for cutting")
        return read_closed(border.get("d", ""), _origin(figure), exact=exact)
    except (ElementTree.ParseError, KeyError, ValueError, IndexError) as error:
        raise torn(READBACK, path, f"not readable: {error}", panel=panel.name) from error


def _measured(read: Loop, panel: Panel, figure: Pattern, limit: float, path: Path) -> float:
    """The largest distance in mm between the outline as read and the true one, 0 where exact.

    A figure that overlaps itself counts its area as often as it covers it.

    Raises:
        CheckFailed: svg-readback, when it encloses another area than the surface has.
    """
    found = loop_deviation(read, figure.outline, limit / 5.0)
    size = longer_side(figure)
    slack = (found + ROUNDING * size) * loops.perimeter(read) + EXACT * figure.area
    area = loops.area(read)
    if abs(area - figure.area) > slack:
        what = f"an area of {area:.12g} mm2 was read, the surface has {figure.area:.12g}"
        raise torn(READBACK, path, what, panel=panel.name)
    return 0.0 if read.exact and found <= EXACT * size else found
