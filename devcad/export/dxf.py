"""DXF: the cut pattern of every panel, in mm, one file a panel.

The coordinates are the pattern's own. The outer contour is one closed LWPOLYLINE with bulges
(R12: POLYLINE), counterclockwise; a hole is a CIRCLE if it is one, else a closed LWPOLYLINE,
clockwise, whose arcs enclose the true area; reference lines are LINEs; a drawing on the sheet is
a LINE, an ARC or an open LWPOLYLINE. With ``curves = "spline"`` a contour is instead a chain of
SPLINE, LINE and ARC entities in the order of the run: the end of each LINE and SPLINE is the
start of the next to the last digit, an ARC meets its neighbours to rounding (its ends follow from
centre, radius and angles), and the last meets the first; so is a drawing, but for its ends.

Layers, colours, linetypes and what is left out are the profile's (``profile.py``); the file that
was written is read again and held against them (``dxfcheck.py``).
"""

from __future__ import annotations

import io
import logging
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import JobError
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.dxfcheck import profile_check
from devcad.export.dxfdrawings import add_drawings, drawings_deviation
from devcad.export.dxfpieces import add_points, add_words, block_name, minimal
from devcad.export.dxfshown import Shown, contour_layers, contour_roles, shown
from devcad.export.dxfsplines import add_chains, chain_deviation, circle_loop
from devcad.export.outline import Contours, contours, drawing_path, measured
from devcad.export.profile import BENDS, DASHED, OUTER, Style, style
from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.loops import Loop
from devcad.flatten.pattern import Line
from devcad.flatten.splines2d import spline_outline
from devcad.geometry.taylor import Array
from devcad.libraries import load_ezdxf
from devcad.part import Panel, Part

READBACK = "dxf-readback"
DASHES = [15.0, 10.0, -5.0]  # mm: period, dash, gap
MILLIMETRES = 4  # $INSUNITS
SHARE = 0.1  # of the part's tolerance goes into the drawing
FINER = (1.0, 0.1, 0.01)  # of that: where fitted curves cross, at a tip without an angle
APPLICATION = "DEVCAD"
"""Whose extended data the bend lines carry."""


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One DXF for each panel, written, read back by a fresh parse, measured against the pattern's
    true curves and held against its profile; where asked for another one of all panels.

    Raises:
        JobError: unknown version, profile or curves, or such as the profile or R12 cannot have.
        CheckFailed: dxf-deviation or dxf-readback.
        FileError: the file cannot be written.
    """
    how = style(options)
    written = [_write_panel(part, panel, folder, how) for panel in part.panels]
    if options.dxf_together and len(part.panels) > 1:
        from devcad.export.dxftogether import write_together

        written.append(write_together(part, folder, options))
    return written


def _write_panel(part: Part, panel: Panel, folder: Path, how: Style) -> Written:
    path = drawing_path(part, panel, folder, "dxf", how.mark)
    limit = min(SHARE * part.tolerance, how.profile.chord or math.inf)
    for share in FINER:
        written = _write_drawing(part, panel, path, how, (limit, share * limit))
        if written.checks[-1].passed:
            break
    return written


def _write_drawing(
    part: Part, panel: Panel, path: Path, how: Style, limits: tuple[float, float]
) -> Written:
    """One file, its curves fitted within the second limit and measured against the first (mm);
    the last of its checks is dxf-profile."""
    limit, fit = limits
    seen = shown(panel, how, fit)
    block = block_name(part, panel) if how.profile.blocks else ""
    with _library_at_rest() as ezdxf:
        document = _document(ezdxf, how)
        space = document.blocks.new(block) if block else document.modelspace()
        exact = _add_sheet(space, seen, how, fit)
        if block:
            add_words(document, space, part, panel, how.profile)
        data = minimal(document) if block and how.version == "R12" else _encoded(document)
    with opened(path, "wb") as stream:
        stream.write(data)
    read = _read(path, panel, how.version)
    drawn = read.blocks.get(block) if block else read.modelspace()
    found = _deviation(drawn, seen, how, fit, path, exact)
    checks = demanded([_deviation_check(panel, found, limit)], path)
    accepted, words = profile_check(read, path, panel, how.profile, seen.left_out)
    return Written(path, "dxf", found, (*checks, accepted), words)


def write_sheet(
    path: Path, panels: Sequence[tuple[Panel, float]], how: Style
) -> tuple[float, tuple[Check, ...]]:
    """Several panels in one drawing, each where its own pattern lies, as :func:`write` does it;
    with each the tolerance in mm that it was built to.

    Returns:
        How far the drawing as read back leaves the true patterns, mm, and the checks.
    Raises:
        JobError: the profile draws one piece a block; CheckFailed, FileError: as ``write``.
    """
    if how.profile.blocks:
        raise JobError(
            f"the DXF profile {how.profile.name} knows no sheets",
            value=how.profile.name,
            remedy="write the panels with devcad export, or nest with another dxf.profile",
        )
    drawn = []
    with _library_at_rest() as ezdxf:
        document = _document(ezdxf, how)
        space = document.modelspace()
        for panel, tolerance in panels:
            limit = min(SHARE * tolerance, how.profile.chord or math.inf)
            seen, first = shown(panel, how, limit), len(space)
            exact = _add_sheet(space, seen, how, limit)
            drawn.append((seen, limit, exact, first, len(space)))
        data = _encoded(document)
    with opened(path, "wb") as stream:
        stream.write(data)
    read = list(_read(path, panels[0][0], how.version).modelspace())
    if len(read) != drawn[-1][-1]:
        raise torn(READBACK, path, f"{len(read)} curves were read, {drawn[-1][-1]} written")
    worst, checks = 0.0, []
    for seen, limit, exact, first, last in drawn:
        found = _deviation(read[first:last], seen, how, limit, path, exact)
        worst = max(worst, found)
        checks.append(_deviation_check(seen.panel, found, limit))
    return worst, tuple(demanded(checks, path))


def _add_sheet(space: Any, seen: Shown, how: Style, limit: float) -> bool:
    """Write all that is shown; whether every contour is the true one."""
    panel, curves = seen.panel, how.curves
    _add_lines(space, seen, how)
    add_drawings(space, panel, limit, how)
    for role, place in seen.points:
        space.add_point(place.tolist(), dxfattribs=how.attributes(role))
    if curves == "spline":
        _add_splines(space, panel, how, limit)
        return False
    cuts = contours(panel.pattern, limit, curves)
    _add_contours(space, cuts, panel, how)
    if how.profile.blocks:
        add_points(space, cuts, panel.pattern, limit, how)
    return cuts.exact


def _deviation(space: Any, seen: Shown, how: Style, limit: float, path: Path, exact: bool) -> float:
    """How far what was read lies from the true pattern, mm."""
    panel, curves = seen.panel, how.curves
    if curves == "spline":
        found = chain_deviation(
            space, panel, contour_layers(panel.pattern, how.profile), limit, path
        )
    else:
        found = measured(_contours(space, panel, how, path, exact), panel, limit, path, READBACK)
    drawn = drawings_deviation(space, panel, limit, path, how)
    return max(found, drawn, _places_deviation(space, seen, how, path))


def _places_deviation(space: Any, seen: Shown, how: Style, path: Path) -> float:
    """How far the points and straight lines that stand for others lie from their places, mm."""
    roles, worst = how.profile.roles, 0.0
    wanted = [(role, "POINT", place[None]) for role, place in seen.points]
    wanted += [(role, "LINE", np.stack([a, b])) for role, a, b in seen.lines]
    left: dict[tuple[str, str], Iterator[Any]] = {}
    for role, kind, places in wanted:
        layer = roles[role].layer
        found = left.setdefault(
            (layer, kind), iter([e for e in space if e.dxf.layer == layer and e.dxftype() == kind])
        )
        entity = next(found, None)
        if entity is None:
            raise torn(READBACK, path, f"a {kind} on {layer} is missing", panel=seen.panel.name)
        names = ("location",) if kind == "POINT" else ("start", "end")
        read = np.array([tuple(entity.dxf.get(name))[:2] for name in names])
        worst = max(worst, float(np.hypot(*(read - places).T).max()))
    return worst


def _deviation_check(panel: Panel, value: float, limit: float) -> Check:
    return at_most(
        "dxf-deviation",
        panel.name,
        value,
        limit,
        "mm",
        says="the drawing as read back leaves the true pattern",
        remedy="use a larger tolerance",
    )


@contextmanager
def _library_at_rest() -> Iterator[Any]:
    """The drawing library, told to write no date and no random identifier meanwhile, and not to
    warn that R12 cannot say its unit."""
    ezdxf = load_ezdxf()
    log = logging.getLogger("ezdxf")
    before, level = ezdxf.options.write_fixed_meta_data_for_testing, log.level
    ezdxf.options.write_fixed_meta_data_for_testing = True
    log.setLevel(logging.ERROR)
    try:
        yield ezdxf
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
        log.setLevel(level)


def _document(ezdxf: Any, how: Style) -> Any:
    """An empty drawing in mm with all layers."""
    document = ezdxf.new(how.version, setup=False, units=MILLIMETRES)
    if how.version != "R12":
        document.header["$INSUNITS"] = MILLIMETRES
        document.header["$MEASUREMENT"] = 1  # metric
    layers = how.profile.layers
    if any(role.linetype == DASHED for roles in layers.values() for role in roles):
        document.linetypes.add(DASHED, DASHES, description="Dashed __ __ __")
    for name, (role, *_) in layers.items():
        document.layers.add(name, color=role.colour, linetype=role.linetype)
    return document


def _add_lines(space: Any, seen: Shown, how: Style) -> None:
    """Reference lines and those that stand for a drawing; bends with their numbers."""
    for line in seen.panel.pattern.lines:
        entity = _add_line(space, line.start, line.end, how.attributes(line.layer))
        if how.profile.bend_data and line.layer in BENDS:
            if APPLICATION not in space.doc.appids:
                space.doc.appids.add(APPLICATION)
            entity.set_xdata(APPLICATION, _bend_data(line))
    for role, start, end in seen.lines:
        _add_line(space, start, end, how.attributes(role))


def _bend_data(line: Line) -> list[tuple[int, Any]]:
    """What a bend line tells as extended data, name before value: its angle in degrees and, where
    it has them, the inside radii in mm at its ends and its place in the order of bending."""
    data: list[tuple[int, Any]] = [(1000, "angle_deg"), (1040, math.degrees(line.angle))]
    if line.radius is not None:
        first, last = line.radius
        data += [(1000, "radius_0"), (1040, first), (1000, "radius_1"), (1040, last)]
    return data if line.order is None else [*data, (1000, "order"), (1070, line.order)]


def _add_line(space: Any, start: Array, end: Array, attributes: dict[str, Any]) -> Any:
    a, b = (tuple(float(x) for x in point) for point in (start, end))
    return space.add_line(a, b, dxfattribs=attributes)


def _add_contours(space: Any, cuts: Contours, panel: Panel, how: Style) -> None:
    """Holes first, as they are cut first, then the outer contour."""
    roles = contour_roles(panel.pattern, how.profile)
    for loop, role in zip((*cuts.holes, cuts.outer), roles, strict=True):
        attributes = how.attributes(role)
        round_hole = None if role == OUTER else loops.circle(loop)
        if round_hole is not None:
            _add_circle(space, *round_hole, attributes)
            continue
        rows = np.zeros((len(loop.points), 5))  # x, y, start width, end width, bulge
        rows[:, :2], rows[:, 4] = loop.points, loop.bulges
        if how.old_polylines:
            space.add_polyline2d(
                rows[:, [0, 1, 4]].tolist(), format="xyb", close=True, dxfattribs=attributes
            )
        else:
            line = space.add_lwpolyline([], close=True, dxfattribs=attributes)
            line.lwpoints.extend(rows)  # point by point would take the square of their number


def _add_splines(space: Any, panel: Panel, how: Style, limit: float) -> None:
    """Contours as chains of splines, lines and arcs; round holes stay circles."""
    pattern = panel.pattern
    roles = contour_roles(pattern, how.profile)
    for contour, role in zip((*pattern.holes, pattern.outline), roles, strict=True):
        round_hole = None if role == OUTER else loops.circle(fit_outline(contour, limit))
        if round_hole is not None:
            _add_circle(space, *round_hole, how.attributes(role))
        else:
            add_chains(space, spline_outline(contour, limit), how.attributes(role))


def _add_circle(space: Any, centre: Array, radius: float, attributes: dict[str, Any]) -> None:
    space.add_circle((float(centre[0]), float(centre[1])), radius, dxfattribs=attributes)


def _encoded(document: Any) -> bytes:
    """The drawing's bytes, the same for the same drawing."""
    if document.dxfversion > "AC1009":
        # Otherwise written in the order of a set, which differs from one run to the next.
        document.classes.add_required_classes(document.dxfversion)
        ordered = sorted(document.classes.classes.items())
        document.classes.classes.clear()
        document.classes.classes.update(ordered)
    stream = io.StringIO()
    document.write(stream)
    return bytes(document.encode(stream.getvalue()))


def _read(path: Path, panel: Panel, version: str) -> Any:
    """The drawing as a fresh parse of the file sees it.

    Raises:
        CheckFailed: it cannot be parsed, its structure has errors, or its unit is not mm.
    """
    ezdxf = load_ezdxf()
    try:
        document = ezdxf.readfile(str(path))
    except Exception as error:  # a torn file ends the parser anywhere, also by StopIteration
        what = f"not readable: {str(error) or type(error).__name__}"
        raise torn(READBACK, path, what, panel=panel.name) from error
    errors = document.audit().errors
    if errors:
        raise torn(READBACK, path, errors[0].message, panel=panel.name)
    if version != "R12" and document.header.get("$INSUNITS") != MILLIMETRES:
        raise torn(READBACK, path, "the unit is not the millimetre", panel=panel.name)
    return document


def _contours(space: Any, panel: Panel, how: Style, path: Path, exact: bool) -> Contours:
    """The cuts of a drawing as it was read, each taken from the front of its layer."""
    pattern = panel.pattern
    layers = contour_layers(pattern, how.profile)
    words = ("TEXT", "INSERT")
    left = {
        layer: [e for e in space if e.dxf.layer == layer and e.dxftype() not in words]
        for layer in dict.fromkeys(layers)
    }
    outer = left[layers[-1]]
    holes = len(pattern.holes) if layers[-1] in layers[:-1] else 0
    if len(outer) - holes != 1:
        what = f"{len(outer)} contours were read on {layers[-1]}, {holes + 1} written"
        raise torn(READBACK, path, what, panel=panel.name)
    read = []
    starts = [edges[0].curve(edges[0].u[:1])[0][0] for edges in pattern.holes]
    for layer, start in zip(layers[:-1], starts, strict=True):
        if left[layer]:
            read.append(_loop(left[layer].pop(0), start, panel, path, exact))
    cuts = Contours(_loop(outer.pop(0), None, panel, path, exact), tuple(read))
    if any(left.values()):
        raise torn(READBACK, path, "more contours were read than written", panel=panel.name)
    return cuts


def _loop(entity: Any, start: Any, panel: Panel, path: Path, exact: bool) -> Loop:
    """A closed entity as a loop; a circle begins towards ``start`` and runs clockwise."""
    kind = entity.dxftype()
    if kind == "CIRCLE":
        return replace(circle_loop(entity, start), exact=exact)
    if not (entity.closed if kind == "LWPOLYLINE" else entity.is_closed):
        raise torn(READBACK, path, "a contour is open", panel=panel.name)
    if kind == "LWPOLYLINE":
        rows = np.array(entity.get_points("xyb"), dtype=float)
    else:
        rows = np.array([[*list(v.dxf.location)[:2], v.dxf.bulge] for v in entity.vertices])
    return Loop(rows[:, :2], rows[:, 2], exact)
