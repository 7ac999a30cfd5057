"""SVG: the cut pattern of every panel at true size, one file a panel.

One user unit is one millimetre (width and height in mm, viewBox from 0 0). The pattern is only
translated and flipped: x = X - X0, y = Y0 - Y with (X0, Y0) = ``svg_origin``. Paths are
absolute, straight lines and circular arcs, without transforms; groups are layers, told apart by
stroke colour as laser programs do, and inner cuts stand before the outer one.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from devcad.checks import at_most
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.outline import Contours, contours, drawing_path, measured
from devcad.flatten import loops
from devcad.flatten.loops import Loop
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

READBACK = "svg-readback"
NAMESPACE = "http://www.w3.org/2000/svg"
MARGIN = 1.0  # mm around the pattern, so that strokes on its border are seen whole
STROKE = 0.1  # mm
QUARTER = 0.5 * np.pi  # rad; an SVG arc is centred by its radius, ill-conditioned near a half turn
SHARE = 0.1  # of the part's tolerance goes into the drawing
OUTER, INNER = "CUT_OUTER", "CUT_INNER"
COLOURS = {  # in the order of the file
    "RULING": "#F36926",
    "BEND_UP": "#00E000",
    "BEND_DOWN": "#00E000",
    "SCORE": "#00E000",
    "ENGRAVE": "#FF0000",
    "MARK": "#FF0000",
    INNER: "#0000FF",
    OUTER: "#000000",
}
DASHES = {"RULING": "1 1", "BEND_UP": "4 2", "BEND_DOWN": "4 2"}  # mm


def svg_origin(panel: Panel) -> tuple[float, float]:
    """The pattern point (mm) at the upper left corner of the drawing, SVG's (0, 0): 1 mm left
    of the pattern's box and 1 mm above it."""
    xmin, _, _, ymax = panel.pattern.bbox
    return float(xmin) - MARGIN, float(ymax) + MARGIN


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One SVG for each panel, written, read back and measured against the pattern's true
    curves.

    Contours are lines and arcs within a tenth of the part's tolerance, straight segments where
    ``options.dxf_curves`` says polyline (SVG has no B-splines: spline means arcs here).

    Raises:
        CheckFailed: svg-deviation or svg-readback.
        FileError: the file cannot be written.
    """
    return [_write_panel(part, panel, folder, options) for panel in part.panels]


def _write_panel(part: Part, panel: Panel, folder: Path, options: Options) -> Written:
    path = drawing_path(part, panel, folder, "svg")
    limit = SHARE * part.tolerance
    curves = "arcs" if options.dxf_curves == "spline" else options.dxf_curves
    cuts = contours(panel.pattern, limit, curves)
    name = part.name if len(part.panels) == 1 else f"{part.name} {panel.name}"
    text = "\n".join(_document(name, panel, cuts))
    with opened(path, "wb") as stream:
        stream.write(f"{text}\n".encode("ascii"))
    found = measured(_read(path, panel, cuts.exact), panel, limit, path, READBACK)
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


def _document(name: str, panel: Panel, cuts: Contours) -> Iterator[str]:
    """The lines of the file."""
    xmin, ymin, xmax, ymax = panel.pattern.bbox
    width = _number(xmax - xmin + 2.0 * MARGIN)
    height = _number(ymax - ymin + 2.0 * MARGIN)
    origin = np.array(svg_origin(panel))
    title = escape(name.encode("ascii", "backslashreplace").decode("ascii"))
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<svg xmlns="{NAMESPACE}" version="1.1" width="{width}mm" height="{height}mm"'
        f' viewBox="0 0 {width} {height}">'
    )
    yield f"<title>{title}</title>"
    for layer, colour in COLOURS.items():
        paths = _paths(panel, cuts, origin, layer)
        if paths:
            dashes = f' stroke-dasharray="{DASHES[layer]}"' if layer in DASHES else ""
            yield (
                f'<g id={quoteattr(layer)} fill="none" stroke="{colour}"'
                f' stroke-width="{STROKE}"{dashes}>'
            )
            yield from (f'<path d="{data}"/>' for data in paths)
            yield "</g>"
    yield "</svg>"


def _paths(panel: Panel, cuts: Contours, origin: Array, layer: str) -> list[str]:
    """The path data of a layer."""
    if layer == OUTER:
        return [_contour(cuts.outer, origin)]
    if layer == INNER:
        return [_contour(hole, origin) for hole in cuts.holes]
    return [
        f"M{_point(line.start, origin)} L{_point(line.end, origin)}"
        for line in panel.pattern.lines
        if line.layer == layer
    ]


def _contour(loop: Loop, origin: Array) -> str:
    """A closed contour: M, then L or A for every segment, Z."""
    out = [f"M{_point(loop.points[0], origin)}"]
    for start, end, bulge in zip(loop.points, loop.ends, loop.bulges.tolist(), strict=True):
        if bulge == 0.0:
            out.append(f"L{_point(end, origin)}")
            continue
        half = 2.0 * np.arctan(bulge)
        parts = int(np.ceil(2.0 * abs(half) / QUARTER - 1e-9))
        inner, part_bulge = loops.split(start, bulge, end, parts)
        stops = np.concatenate([start[None], inner, end[None]])
        sine = abs(np.sin(2.0 * np.arctan(part_bulge)))
        radius = float(np.hypot(*(stops[1] - stops[0])) / (2.0 * sine))
        flag = int(bulge < 0.0)  # y points down: counterclockwise is the negative sense
        out += [f"A{radius!r} {radius!r} 0 0 {flag} {_point(p, origin)}" for p in stops[1:]]
    return " ".join([*out, "Z"])


def _point(point: Array, origin: Array) -> str:
    """A pattern point in the drawing's coordinates."""
    return f"{_number(point[0] - origin[0])} {_number(origin[1] - point[1])}"


def _number(x: float) -> str:
    """mm to 1e-10, without an exponent (which some readers do not know)."""
    text = f"{x:.10f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _read(path: Path, panel: Panel, exact: bool) -> Contours:
    """The contours of a file as it was read, back in pattern coordinates.

    Raises:
        CheckFailed: it is not the drawing that was written.
    """
    try:
        with opened(path, "rb") as stream:
            root = ElementTree.fromstring(stream.read())
        found = {
            group.get("id"): [_loop(p.get("d", ""), panel, exact) for p in group]
            for group in root.iter(f"{{{NAMESPACE}}}g")
            if group.get("id") in (OUTER, INNER)
        }
        (outer,) = found[OUTER]
    except (ElementTree.ParseError, KeyError, ValueError, IndexError) as error:
        raise torn(READBACK, path, f"not readable: {error}", panel=panel.name) from error
    return Contours(outer, tuple(found.get(INNER, [])))


def _loop(data: str, panel: Panel, exact: bool) -> Loop:
    """Closed path data as a loop in pattern coordinates."""
    words = data.split()
    if words[-1] != "Z":
        raise ValueError("a contour is open")
    points, bulges = [[float(words[0][1:]), float(words[1])]], []
    k = 2
    while words[k] != "Z":
        step = 7 if words[k][0] == "A" else 2
        end = [float(words[k + step - 2].lstrip("L")), float(words[k + step - 1])]
        bulges.append(0.0)
        if step == 7:
            chord = np.hypot(end[0] - points[-1][0], end[1] - points[-1][1])
            half = np.arcsin(min(1.0, chord / (2.0 * float(words[k][1:]))))
            bulges[-1] = float(np.tan(0.5 * half)) * (1.0 if words[k + 4] == "0" else -1.0)
        points.append(end)
        k += step
    if points[-1] != points[0]:
        raise ValueError("a contour does not end where it starts")
    x0, y0 = svg_origin(panel)
    xy = np.array(points[:-1])
    return Loop(np.stack([x0 + xy[:, 0], y0 - xy[:, 1]], axis=1), np.array(bulges), exact)
