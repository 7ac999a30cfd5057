"""PDF: the cut pattern of every panel at 1:1, one file a panel, on tiles or on one page.

The pattern stands once in the file, in its own coordinates in mm, as straight lines and cubic
Beziers; every page shows a window of it. Layers are optional content groups of the pattern's
names, told apart by colour and dashes too.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from pathlib import Path as FilePath

import numpy as np

from devcad import __version__
from devcad.checks import at_most
from devcad.export import Options, Written
from devcad.export.binary import demanded, opened, torn
from devcad.export.outline import (
    Contours,
    contours,
    drawing_path,
    fitted_strokes,
    measured,
    plane_curves,
    strokes_deviation,
)
from devcad.export.pdfcanvas import POINT, date, written
from devcad.export.pdflayout import SQUARES, Box, Plan, plan
from devcad.export.pdfpages import (
    CONTROL,
    TILES,
    Groups,
    ordered,
    pages,
    pattern_form,
)
from devcad.export.pdfpaths import FINEST, Run, closed_path, line, open_path, runs
from devcad.export.pdfread import IDENTITY, Drawn, Matrix, ReadFile, ReadPage, read
from devcad.flatten import loops
from devcad.flatten.edges import strokes
from devcad.flatten.loops import Loop, Path
from devcad.flatten.pattern import STITCH, Edge
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

Strokes = tuple[tuple[str, Path], ...]
READBACK = "pdf-readback"
OUTER, INNER = "CUT_OUTER", "CUT_INNER"
SHARE = 0.1  # of the part's tolerance goes into the drawing
ARCS = 0.2  # of that share, at most, goes into the Beziers for its arcs
COARSE = 0.1  # mm, of the polygons that tell which tiles are empty
EXACT = 1e-6  # mm on paper: control squares and windows as read back


def write(part: Part, folder: FilePath, options: Options) -> list[Written]:
    """One PDF for each panel on ``options.pdf``'s paper, written, read back and measured against
    the pattern's true curves.

    Raises:
        JobError: the paper is too small; LimitError: more than 200 tiles, or too long a page;
        CheckFailed: pdf-deviation or pdf-readback; FileError: the file cannot be written.
    """
    return [_write_panel(part, panel, folder, options) for panel in part.panels]


def _write_panel(part: Part, panel: Panel, folder: FilePath, options: Options) -> Written:
    path = drawing_path(part, panel, folder, "pdf")
    limit = SHARE * part.tolerance
    finest = min(FINEST, ARCS * limit)
    curves = plane_curves(options)
    cuts = contours(panel.pattern, limit - finest, curves)
    drawn = fitted_strokes(panel.pattern, limit - finest, curves)
    groups = pattern_groups(panel, cuts, drawn, finest)
    layers = ordered(list(groups))
    laid = plan([_polygon(loop) for loop in (cuts.outer, *cuts.holes)], _box(panel), options.pdf)
    made = pages(laid, _box(panel), layers, title(part, panel))
    data = written(
        title(part, panel)[0], made, [*layers, TILES, CONTROL], pattern_form(groups, _box(panel))
    )
    with opened(path, "wb") as stream:
        stream.write(data)
    found = _deviation(path, panel, laid, limit, cuts.exact)
    check = at_most(
        "pdf-deviation",
        panel.name,
        found,
        limit,
        "mm",
        says="the drawing as read back leaves the true pattern",
        remedy="use a larger tolerance",
    )
    return Written(path, "pdf", found, demanded([check], path))


def pattern_groups(panel: Panel, cuts: Contours, drawn: Strokes, finest: float) -> Groups:
    """The path operators of a panel's pattern, layer by layer: reference lines, behind them the
    drawings, and the contours. Arcs become Beziers within ``finest`` mm of them."""
    groups: Groups = {}
    for one in panel.pattern.lines:
        ends = (float(x) for x in (*one.start, *one.end))
        groups.setdefault(one.layer, []).append(line(*ends))
    for name, path in drawn:
        groups.setdefault(name, []).append(open_path(path, finest))
    for edges, hole in zip(panel.pattern.holes, cuts.holes, strict=True):
        groups.setdefault(_role(edges), []).append(closed_path(hole, finest))
    groups[OUTER] = [closed_path(cuts.outer, finest)]
    return groups


def _role(hole: tuple[Edge, ...]) -> str:
    """The layer of a hole."""
    return "STITCH" if hole[0].name == STITCH else INNER


def title(part: Part, panel: Panel) -> list[str]:
    """What is printed: its name, and lines about it."""
    name = part.name if len(part.panels) == 1 else f"{part.name} {panel.name}"
    said = {
        "part": part.part_number,
        "revision": part.revision,
        "quantity": f"{part.quantity}" if part.quantity > 1 else "",
        "material": part.material,
        "thickness": f"{panel.thickness:g} mm" if panel.thickness else "",
        "sha256": part.job_sha256[:12],
        "date": date(),
    }
    lines = [f"{key} {value}" for key, value in said.items() if value]
    return [name, *lines, f"devcad {__version__}"]


def _box(panel: Panel) -> Box:
    x0, y0, x1, y1 = panel.pattern.bbox
    return float(x0), float(y0), float(x1), float(y1)


def _polygon(loop: Loop) -> Array:
    """A coarse polygon of a loop, its arcs within 0.1 mm."""
    out = []
    for start, end, bulge in zip(loop.points, loop.ends, loop.bulges.tolist(), strict=True):
        rise = 0.5 * abs(bulge) * float(np.hypot(*(end - start)))
        parts = 1 + int(np.ceil(np.sqrt(rise / COARSE)))
        inner, _ = loops.split(start, bulge, end, parts)
        out += [start[None], inner]
    return np.concatenate(out)


# --- reading back --------------------------------------------------------------------------


def _deviation(path: FilePath, panel: Panel, laid: Plan, limit: float, exact: bool) -> float:
    """How far the file as it was read leaves the pattern, mm.

    Raises:
        CheckFailed: it is not the file that was written.
    """
    try:
        with opened(path, "rb") as stream:
            found = read(stream.read())
        _check_pages(found, laid)
        cuts, drawn, off = _pattern(found, panel, exact)
    except (ValueError, KeyError, IndexError, StopIteration, zlib.error) as error:
        raise torn(READBACK, path, f"not readable: {error}", panel=panel.name) from error
    lines = max(
        measured(cuts, panel, limit, path, READBACK),
        strokes_deviation(drawn, panel.pattern, limit),
    )
    return lines + off


def _pattern(found: ReadFile, panel: Panel, exact: bool) -> tuple[Contours, list[Path], float]:
    """The contours and drawings in the form as lines and arcs, and how far its Beziers are off
    these arcs.

    Raises:
        ValueError: there are more or fewer than the pattern has.
    """
    read_runs = {layer: _runs(drawn) for layer, drawn in found.form.items()}
    off = max(run.off for group in read_runs.values() for run in group)
    pattern = panel.pattern
    left = {
        layer: iter(group[sum(a.layer == layer for a in pattern.lines) :])
        for layer, group in read_runs.items()
    }
    outer = next(left[OUTER]).loop(exact=exact)
    holes = tuple(next(left[_role(edges)]).loop(exact=exact) for edges in pattern.holes)
    drawn = [next(left[stroke[0].name]).path() for stroke in strokes(pattern.drawings)]
    if any(next(rest, None) is not None for rest in left.values()):
        raise ValueError("there are more lines than the pattern has")
    return Contours(outer, holes), drawn, off


def _runs(drawn: Drawn) -> list[Run]:
    """The paths of one layer of the form, which no matrix may move."""
    if any(matrix != IDENTITY for _, matrix in drawn.operators):
        raise ValueError("the pattern is moved within its own form")
    return runs(operator for operator, _ in drawn.operators)


def _check_pages(found: ReadFile, laid: Plan) -> None:
    """ValueError unless the pages are those of the plan: their number and size, on each both
    squares of the right size, and the pattern at true size in its place."""
    tiles: list[Sequence[float]] = [tile.box for tile in laid.printed]
    maps = len(tiles) > 1
    if len(found.pages) != len(tiles) + maps:
        raise ValueError(f"{len(found.pages)} pages, not {len(tiles) + maps}")
    if not found.unscaled:
        raise ValueError("printers may scale it")
    sheet = laid.sheet
    for page in found.pages:
        if not _near([page.width, page.height], [sheet.width * POINT, sheet.height * POINT]):
            raise ValueError(f"a page of {page.width:g} x {page.height:g} points")
        _check_squares(page)
    for page, box in zip(found.pages[maps:], tiles, strict=True):
        x, y = sheet.window[0] - box[0], sheet.window[1] - box[1]
        if not _near(_shown(page), [POINT, 0.0, 0.0, POINT, x * POINT, y * POINT]):
            raise ValueError("a tile shows another piece of the pattern, or not at true size")


def _shown(page: ReadPage) -> Matrix:
    """The matrix under which a page shows the form."""
    (matrix,) = [matrix for drawn in page.layers.values() for matrix in drawn.forms]
    return matrix


def _check_squares(page: ReadPage) -> None:
    """ValueError unless the page has the two control squares at true size."""
    sides = [
        (numbers[2] * matrix[0], numbers[3] * matrix[3])
        for (name, numbers), matrix in page.layers[CONTROL].operators
        if name == "re"
    ]
    wanted = [(side * POINT, side * POINT) for side in SQUARES]
    if len(sides) != len(wanted) or not _near(np.ravel(sides), np.ravel(wanted)):
        raise ValueError("the control squares are not of their size")


def _near(found: Sequence[float] | Array, wanted: Sequence[float] | Array) -> bool:
    """Whether points (1/72 inch) agree on paper."""
    return bool(np.allclose(found, wanted, rtol=1e-9, atol=EXACT * POINT))
