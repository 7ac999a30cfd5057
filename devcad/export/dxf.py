"""DXF: the cut pattern of every panel, in mm, one file a panel.

The coordinates are the pattern's own. The outer contour is one closed LWPOLYLINE with bulges
(R12: POLYLINE), counterclockwise; a hole is a CIRCLE if it is one, else a closed LWPOLYLINE,
clockwise; reference lines are LINEs; a drawing on the sheet is a LINE, an ARC or an open
LWPOLYLINE. With ``curves = "spline"`` a contour is instead a chain of SPLINE, LINE and ARC
entities in the order of the run: the end of each LINE and SPLINE is the start of the next to the
last digit, an ARC meets its neighbours to rounding (its ends follow from centre, radius and
angles), and the last meets the first; so is a drawing, but for its ends.
"""

from __future__ import annotations

import io
import json
import logging
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import JobError
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.dxfdrawings import add_drawings, drawings_deviation
from devcad.export.dxfsplines import add_chains, chain_deviation, circle_loop
from devcad.export.outline import Contours, contours, drawing_path, measured
from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.loops import Loop
from devcad.flatten.splines2d import spline_outline
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

READBACK = "dxf-readback"
OUTER, INNER = "CUT_OUTER", "CUT_INNER"
LAYERS = {
    OUTER: 7,
    INNER: 1,
    "BEND_UP": 3,
    "BEND_DOWN": 5,
    "RULING": 9,
    "ENGRAVE": 6,
    "MARK": 2,
    "SCORE": 4,
}
DASHED = ("BEND_UP", "BEND_DOWN")
DASHES = [15.0, 10.0, -5.0]  # mm: period, dash, gap
VERSIONS = ("R12", "R2000", "R2010")
MILLIMETRES = 4  # $INSUNITS
SHARE = 0.1  # of the part's tolerance goes into the drawing


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """One DXF for each panel, written, read back by a fresh parse and measured against the
    pattern's true curves.

    Raises:
        JobError: unknown version, profile or curves, or splines in R12, which has none.
        CheckFailed: dxf-deviation or dxf-readback.
        FileError: the file cannot be written.
    """
    _refuse(options)
    return [_write_panel(part, panel, folder, options) for panel in part.panels]


def _refuse(options: Options) -> None:
    """Raise for options that no file can have."""
    known = {
        "dxf.version": (options.dxf_version, VERSIONS),
        "dxf.profile": (options.dxf_profile, ("generic",)),
        "dxf.curves": (options.dxf_curves, ("arcs", "polyline", "spline")),
    }
    for key, (value, allowed) in known.items():
        if value not in allowed:
            raise JobError(
                f"{key} is {value!r}",
                value=value,
                limit=", ".join(allowed),
                remedy=f"use one of {', '.join(allowed)}",
            )
    if options.dxf_version == "R12" and options.dxf_curves == "spline":
        raise JobError(
            "DXF R12 has no splines",
            value="spline",
            limit="arcs, polyline",
            remedy='use dxf.curves = "arcs" or dxf.version = "R2000"',
        )


def _write_panel(part: Part, panel: Panel, folder: Path, options: Options) -> Written:
    mark = "-mm" if options.dxf_version == "R12" else ""  # R12 cannot say its unit
    path = drawing_path(part, panel, folder, "dxf", mark)
    limit = SHARE * part.tolerance
    with _library_at_rest() as ezdxf:
        document = _document(ezdxf, options.dxf_version)
        space = document.modelspace()
        _add_lines(space, panel)
        add_drawings(space, panel, limit, options.dxf_curves, _style)
        spline = options.dxf_curves == "spline"
        if spline:
            _add_splines(space, panel, limit)
            exact = False
        else:
            cuts = contours(panel.pattern, limit, options.dxf_curves)
            _add_contours(space, cuts, options.dxf_version)
            exact = cuts.exact
        data = _encoded(document)
    with opened(path, "wb") as stream:
        stream.write(data)
    read = _read(path, panel, options.dxf_version)
    if spline:
        found = chain_deviation(read.modelspace(), panel, (OUTER, INNER), limit, path)
    else:
        found = measured(_contours(read, panel, path, exact), panel, limit, path, READBACK)
    drawn = drawings_deviation(read.modelspace(), panel, limit, path, splines=spline)
    found = max(found, drawn)
    checks = demanded([_deviation_check(panel, found, limit)], path)
    return Written(path, "dxf", found, checks)


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
    ezdxf = _library()
    log = logging.getLogger("ezdxf")
    before, level = ezdxf.options.write_fixed_meta_data_for_testing, log.level
    ezdxf.options.write_fixed_meta_data_for_testing = True
    log.setLevel(logging.ERROR)
    try:
        yield ezdxf
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
        log.setLevel(level)


def _library() -> Any:
    """ezdxf, imported so that it leaves no file behind.

    On its first import it looks at every font of the system and keeps a list in the user's
    cache folder. Nothing here needs a font: where there is no such list yet, it is shown an
    empty one in a folder that is gone afterwards.
    """
    if "ezdxf" in sys.modules:
        return sys.modules["ezdxf"]
    before = os.environ.get("XDG_CACHE_HOME")
    cache = Path(before).expanduser() if before else Path("~/.cache").expanduser()
    listed = Path("ezdxf") / "font_manager_cache.json"
    if (cache / listed).exists():
        return import_module("ezdxf")
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / listed
        empty.parent.mkdir()
        empty.write_text(json.dumps({"version": 0, "font-faces": []}), encoding="ascii")
        os.environ["XDG_CACHE_HOME"] = folder
        try:
            return import_module("ezdxf")
        finally:
            if before is None:
                del os.environ["XDG_CACHE_HOME"]
            else:
                os.environ["XDG_CACHE_HOME"] = before


def _document(ezdxf: Any, version: str) -> Any:
    """An empty drawing in mm with all layers."""
    document = ezdxf.new(version, setup=False, units=MILLIMETRES)
    if version != "R12":
        document.header["$INSUNITS"] = MILLIMETRES
        document.header["$MEASUREMENT"] = 1  # metric
    document.linetypes.add("DASHED", DASHES, description="Dashed __ __ __")
    for name, colour in LAYERS.items():
        linetype = "DASHED" if name in DASHED else "Continuous"
        document.layers.add(name, color=colour, linetype=linetype)
    return document


def _style(layer: str) -> dict[str, Any]:
    """An entity's layer and its colour, said again for readers that ignore layers."""
    style: dict[str, Any] = {"layer": layer, "color": LAYERS[layer]}
    if layer in DASHED:
        style["linetype"] = "DASHED"
    return style


def _add_lines(space: Any, panel: Panel) -> None:
    for line in panel.pattern.lines:
        start, end = (tuple(float(x) for x in point) for point in (line.start, line.end))
        space.add_line(start, end, dxfattribs=_style(line.layer))


def _add_contours(space: Any, cuts: Contours, version: str) -> None:
    """Holes first, as they are cut first, then the outer contour."""
    for loop, layer in [*((hole, INNER) for hole in cuts.holes), (cuts.outer, OUTER)]:
        round_hole = loops.circle(loop) if layer == INNER else None
        if round_hole is not None:
            _add_circle(space, *round_hole)
            continue
        rows = np.zeros((len(loop.points), 5))  # x, y, start width, end width, bulge
        rows[:, :2], rows[:, 4] = loop.points, loop.bulges
        if version == "R12":
            space.add_polyline2d(
                rows[:, [0, 1, 4]].tolist(), format="xyb", close=True, dxfattribs=_style(layer)
            )
        else:
            line = space.add_lwpolyline([], close=True, dxfattribs=_style(layer))
            line.lwpoints.extend(rows)  # point by point would take the square of their number


def _add_splines(space: Any, panel: Panel, limit: float) -> None:
    """Contours as chains of splines, lines and arcs; round holes stay circles."""
    for hole in panel.pattern.holes:
        round_hole = loops.circle(fit_outline(hole, limit))
        if round_hole is not None:
            _add_circle(space, *round_hole)
        else:
            add_chains(space, spline_outline(hole, limit), _style(INNER))
    add_chains(space, spline_outline(panel.pattern.outline, limit), _style(OUTER))


def _add_circle(space: Any, centre: Array, radius: float) -> None:
    space.add_circle((float(centre[0]), float(centre[1])), radius, dxfattribs=_style(INNER))


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
    ezdxf = _library()
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


def _contours(document: Any, panel: Panel, path: Path, exact: bool) -> Contours:
    """The cuts of a drawing as it was read."""
    space = document.modelspace()
    outer = [entity for entity in space if entity.dxf.layer == OUTER]
    inner = [entity for entity in space if entity.dxf.layer == INNER]
    if len(outer) != 1:
        raise torn(READBACK, path, f"{len(outer)} outer contours were read", panel=panel.name)
    starts = [edges[0].curve(edges[0].u[:1])[0][0] for edges in panel.pattern.holes]
    holes = [_loop(e, s, panel, path, exact) for e, s in zip(inner, starts, strict=False)]
    return Contours(_loop(outer[0], None, panel, path, exact), tuple(holes))


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
