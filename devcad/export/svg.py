"""SVG: the cut pattern of every panel at true size, one file a panel.

One user unit is one millimetre (width and height in mm, viewBox from 0 0). The pattern is only
translated and flipped: x = X - X0, y = Y0 - Y with (X0, Y0) = ``svg_origin``. Paths are
absolute, straight lines and circular arcs, without transforms; groups are layers, told apart by
stroke colour as laser programs do, and inner cuts stand before the outer one.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path as FilePath
from xml.etree import ElementTree
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from devcad.checks import at_most
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.outline import (
    Contours,
    contours,
    drawing_path,
    fitted_strokes,
    hole_role,
    measured,
    plane_curves,
    strokes_deviation,
)
from devcad.export.profile import INNER, OUTER, STITCH
from devcad.export.svgpaths import (
    NAMESPACE,
    closed_path,
    number,
    open_path,
    read_closed,
    read_open,
    straight_path,
)
from devcad.flatten.edges import strokes
from devcad.flatten.loops import Path
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

Strokes = tuple[tuple[str, Path], ...]
"""Layers and paths of drawings."""
READBACK = "svg-readback"
MARGIN = 1.0  # mm around the pattern, so that strokes on its border are seen whole
STROKE = 0.1  # mm
SHARE = 0.1  # of the part's tolerance goes into the drawing
COLOURS = {  # in the order of the file; the guides' are those that laser programs do not run
    "RULING": "#F36926",
    "GRAIN": "#F36926",
    "GLUE": "#F36926",
    "SEW": "#0C96D9",
    "BEND_UP": "#00E000",
    "BEND_DOWN": "#00E000",
    "SCORE": "#00E000",
    "ENGRAVE": "#FF0000",
    "MARK": "#FF0000",
    "NOTCH_MARK": "#FF0000",
    "LABEL": "#FF0000",
    STITCH: "#0000FF",
    INNER: "#0000FF",
    OUTER: "#000000",
}
DASHES = {  # mm
    "RULING": "1 1",
    "BEND_UP": "4 2",
    "BEND_DOWN": "4 2",
    "GLUE": "0.5 1",
    "SEW": "3 1.5",
}


def svg_origin(panel: Panel) -> tuple[float, float]:
    """The pattern point (mm) at the upper left corner of the drawing, SVG's (0, 0): 1 mm left
    of the pattern's box and 1 mm above it."""
    xmin, _, _, ymax = panel.pattern.bbox
    return float(xmin) - MARGIN, float(ymax) + MARGIN


def write(part: Part, folder: FilePath, options: Options) -> list[Written]:
    """One SVG for each panel, written, read back and measured against the pattern's true
    curves.

    Contours and drawings are lines and arcs within a tenth of the part's tolerance, straight
    segments where ``options.dxf_curves`` says polyline (SVG has no B-splines: spline means arcs
    here).

    Raises:
        CheckFailed: svg-deviation or svg-readback.
        FileError: the file cannot be written.
    """
    return [_write_panel(part, panel, folder, options) for panel in part.panels]


def _write_panel(part: Part, panel: Panel, folder: FilePath, options: Options) -> Written:
    path = drawing_path(part, panel, folder, "svg")
    limit = SHARE * part.tolerance
    curves = plane_curves(options)
    cuts = contours(panel.pattern, limit, curves)
    drawn = fitted_strokes(panel.pattern, limit, curves)
    name = part.name if len(part.panels) == 1 else f"{part.name} {panel.name}"
    text = "\n".join(_document(name, panel, cuts, drawn))
    with opened(path, "wb") as stream:
        stream.write(f"{text}\n".encode("ascii"))
    read, strokes_read = _read(path, panel, cuts.exact)
    found = max(
        measured(read, panel, limit, path, READBACK),
        strokes_deviation(strokes_read, panel.pattern, limit),
    )
    check = at_most(
        "svg-deviation",
        panel.name,
        found,
        limit,
        "mm",
        says="the drawing as read back leaves the true pattern",
        remedy="use a larger tolerance",
    )
    return Written(path, "svg", found, demanded([check], path))


def _document(name: str, panel: Panel, cuts: Contours, drawn: Strokes) -> Iterator[str]:
    """The lines of the file."""
    xmin, ymin, xmax, ymax = panel.pattern.bbox
    width = number(xmax - xmin + 2.0 * MARGIN)
    height = number(ymax - ymin + 2.0 * MARGIN)
    origin = np.array(svg_origin(panel))
    title = escape(name.encode("ascii", "backslashreplace").decode("ascii"))
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<svg xmlns="{NAMESPACE}" version="1.1" width="{width}mm" height="{height}mm"'
        f' viewBox="0 0 {width} {height}">'
    )
    yield f"<title>{title}</title>"
    for layer, colour in COLOURS.items():
        paths = _paths(panel, cuts, drawn, origin, layer)
        if paths:
            dashes = f' stroke-dasharray="{DASHES[layer]}"' if layer in DASHES else ""
            yield (
                f'<g id={quoteattr(layer)} fill="none" stroke="{colour}"'
                f' stroke-width="{STROKE}"{dashes}>'
            )
            yield from (f'<path d="{data}"/>' for data in paths)
            yield "</g>"
    yield "</svg>"


def _paths(panel: Panel, cuts: Contours, drawn: Strokes, origin: Array, layer: str) -> list[str]:
    """The path data of a layer: contours, or its reference lines and behind them its drawings."""
    if layer == OUTER:
        return [closed_path(cuts.outer, origin)]
    pattern = panel.pattern
    if layer in (INNER, STITCH):
        roles = map(hole_role, pattern.holes)
        holes = zip(cuts.holes, roles, strict=True)
        return [closed_path(hole, origin) for hole, role in holes if role == layer]
    lines = [straight_path(a.start, a.end, origin) for a in pattern.lines if a.layer == layer]
    return [*lines, *(open_path(path, origin) for name, path in drawn if name == layer)]


def _read(path: FilePath, panel: Panel, exact: bool) -> tuple[Contours, list[Path]]:
    """The contours and the drawings of a file as it was read, back in pattern coordinates.

    Raises:
        CheckFailed: it is not the drawing that was written.
    """
    try:
        with opened(path, "rb") as stream:
            root = ElementTree.fromstring(stream.read())
        found = {
            group.get("id", ""): [p.get("d", "") for p in group]
            for group in root.iter(f"{{{NAMESPACE}}}g")
        }
        origin = svg_origin(panel)
        (outer,) = [read_closed(data, origin, exact=exact) for data in found[OUTER]]
        holes = [read_closed(data, origin, exact=exact) for data in _holes(found, panel)]
        drawn = [read_open(data, origin) for data in _drawings(found, panel)]
    except (ElementTree.ParseError, KeyError, ValueError, IndexError) as error:
        raise torn(READBACK, path, f"not readable: {error}", panel=panel.name) from error
    return Contours(outer, tuple(holes)), drawn


def _holes(found: dict[str, list[str]], panel: Panel) -> list[str]:
    """The path data of the holes, in the pattern's order; those that are left come last."""
    left = {role: list(found.get(role, ())) for role in (STITCH, INNER)}
    roles = [hole_role(hole) for hole in panel.pattern.holes]
    inner = [left[role].pop(0) for role in roles if left[role]]
    return [*inner, *left[STITCH], *left[INNER]]


def _drawings(found: dict[str, list[str]], panel: Panel) -> list[str]:
    """The path data of the pattern's drawings, in its order.

    Raises:
        ValueError: there are more or fewer than it has.
    """
    pattern = panel.pattern
    left = {
        layer: iter(data[sum(line.layer == layer for line in pattern.lines) :])
        for layer, data in found.items()
        if layer not in (OUTER, INNER, STITCH)
    }
    layers = [stroke[0].name for stroke in strokes(pattern.drawings)]
    drawn = [next(left.get(layer, iter(())), "") for layer in layers]
    if not all(drawn) or any(next(rest, "") for rest in left.values()):
        raise ValueError("drawings are missing, or there are too many")
    return drawn
