"""Nesting: blanks on as few sheets as can be found, and the proof that they lie there."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from devcad.errors import GeometryError, LimitError
from devcad.geometry.taylor import Array
from devcad.shop.blanks import Blank
from devcad.shop.placing import turn
from devcad.shop.settings import Sheet
from devcad.shop.shelves import fits, shelve

MOST = 2000
"""Copies in one nest; more belong into several."""
REPORTS, FAILURES = 200, 1
"""How many of the solver's reports are heard, and how many widths it may try in vain."""
SOLVER_MARGIN = 2e-6
"""Of the sheet's longer side: the solver's numbers have 24 bits."""
COARSE = 5e-4
"""Of a blank's size: what its polygon for the solver may stand out, for fewer vertices."""
FULLER = 2.0
"""The solver is given blanks of so many times the sheet's area at most, the largest first."""
SLACK = 1e-6
"""mm; the gap is kept but for this."""
NEAR = 1.0
"""mm beyond the gap within which the distance of two blanks is measured."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A copy of a blank on a sheet (from 0): turned counterclockwise by ``angle`` degrees about
    its origin, then shifted by (x, y) mm; the sheet's lower left corner is (0, 0)."""

    blank: int
    copy: int
    sheet: int
    x: float
    y: float
    angle: float


@dataclass(frozen=True, slots=True)
class Nest:
    """``placed`` in the order of sheets, blanks and copies; ``sheets`` is their number, ``clear``
    the smallest distance between two blanks or to a sheet's edge in mm, as far as it is below
    the gap + 1 mm."""

    placed: tuple[Placed, ...]
    sheets: int
    clear: float


def room(sheet: Sheet) -> tuple[float, float]:
    """Width and height that a blank may have: the sheet within its margins, mm."""
    return sheet.size[0] - 2.0 * sheet.gap, sheet.size[1] - 2.0 * sheet.gap


def nest(blanks: Sequence[Blank], sheet: Sheet, *, seed: int = 0, seconds: int = 60) -> Nest:
    """All copies of the blanks on sheets of one size, ``sheet.gap`` apart and from the edges.

    One sheet after the other is filled from a strip that a solver packs, or from shelves where
    they hold more; the solver runs in a child process for at most ``seconds`` each time. The same
    blanks, sheet and seed give the same nest unless that time runs out.

    Raises:
        GeometryError: a blank is larger than the sheet; LimitError: too many copies.
    """
    _refuse_large(blanks, sheet)
    left = [k for k, one in enumerate(blanks) for _ in range(one.quantity)]
    left.sort(key=lambda k: (-blanks[k].area, k))
    if len(left) > MOST:
        raise LimitError(
            f"{len(left)} blanks are more than one nest holds",
            value=len(left),
            limit=MOST,
            remedy="nest them in several runs",
        )
    simple = _shelved(blanks, left, sheet)
    sheets: list[list[Placed]] = []
    while left:
        filled = _one_sheet(blanks, left, sheet, seed, seconds)
        sheets.append(filled)
        for one in filled:
            left.remove(one.blank)
    placed = _numbered(sheets if len(sheets) <= len(simple) else simple)
    return Nest(placed, min(len(sheets), len(simple)), clearance(blanks, placed, sheet))


def _refuse_large(blanks: Sequence[Blank], sheet: Sheet) -> None:
    """GeometryError where a blank fits on the sheet at none of its angles."""
    width, height = room(sheet)
    for one in blanks:
        sizes = one.sizes()
        if any(fits((float(w), float(h)), (width, height)) for w, h in sizes):
            continue
        w, h = sizes[int(np.max(sizes / np.maximum((width, height), 1e-9), axis=1).argmin())]
        raise GeometryError(
            f"a blank of {w:.6g} x {h:.6g} mm is larger than the sheet of {sheet.size[0]:.6g} x "
            f"{sheet.size[1]:.6g} mm with a margin of {sheet.gap:.6g} mm",
            place=one.name,
            value=f"{w:.6g} x {h:.6g}",
            limit=f"{width:.6g} x {height:.6g}",
            remedy="use a larger sheet, or split the panel",
        )


def _numbered(sheets: list[list[Placed]]) -> tuple[Placed, ...]:
    """The placements with their sheets and copies numbered."""
    copies: dict[int, int] = {}
    out = []
    for number, filled in enumerate(sheets):
        for one in sorted(filled, key=lambda p: (p.blank, p.x, p.y)):
            copies[one.blank] = copies.get(one.blank, 0) + 1
            out.append(Placed(one.blank, copies[one.blank], number, one.x, one.y, one.angle))
    return tuple(out)


def _one_sheet(
    blanks: Sequence[Blank], left: list[int], sheet: Sheet, seed: int, seconds: int
) -> list[Placed]:
    """What lies on the next sheet: of the solver's and the shelves' the larger area."""
    shelves = _shelved(blanks, left, sheet)[0]
    given: list[int] = []
    area = 0.0
    for k in left:
        area += blanks[k].area
        if given and area > FULLER * sheet.size[0] * sheet.size[1]:
            break
        given.append(k)
    strip = [
        one for one in _solved(blanks, given, sheet, seed, seconds) if _inside(blanks, one, sheet)
    ]
    if strip and clearance(blanks, strip, sheet) < sheet.gap - SLACK:
        return shelves
    return max(strip, shelves, key=lambda found: _filled(blanks, found))


def _filled(blanks: Sequence[Blank], placed: Sequence[Placed]) -> tuple[float, float]:
    """How good a sheet is: the area on it, then what is left of it on the right."""
    area = sum(blanks[one.blank].area for one in placed)
    return round(area, 6), -max((float(_box(blanks, one)[2]) for one in placed), default=0.0)


def _shelved(blanks: Sequence[Blank], left: list[int], sheet: Sheet) -> list[list[Placed]]:
    """All that is left on shelves, sheet by sheet."""
    sizes = [[(float(w), float(h)) for w, h in blanks[k].sizes()] for k in left]
    found = shelve(sizes, room(sheet), sheet.gap)
    out: list[list[Placed]] = [[] for _ in range(max(one.sheet for one in found) + 1)]
    for k, one in zip(left, found, strict=True):
        low = blanks[k].boxes[one.form, :2]
        x, y = (float(at) + sheet.gap for at in (one.left - low[0], one.bottom - low[1]))
        out[one.sheet].append(Placed(k, 0, one.sheet, x, y, blanks[k].angles[one.form]))
    return out


# --- the solver ----------------------------------------------------------------------------


def _solved(
    blanks: Sequence[Blank], given: list[int], sheet: Sheet, seed: int, seconds: int
) -> list[Placed]:
    """The blanks on a strip as high as the sheet and as long as it takes; () where there is no
    answer. Its beginning is a filled sheet."""
    kinds = list(dict.fromkeys(given))
    margin = SOLVER_MARGIN * max(
        *sheet.size, *(float(np.abs(blanks[k].boxes).max()) for k in kinds)
    )
    task = {
        "height": sheet.size[1],
        "width": sheet.size[0],
        "separation": sheet.gap + 2.0 * margin,
        "seed": seed,
        "reports": REPORTS,
        "failures": FAILURES,
        "seconds": seconds,
        "items": [
            {
                "shape": _coarse(blanks[k]).tolist(),
                "demand": given.count(k),
                "angles": list(blanks[k].angles),
            }
            for k in kinds
        ],
    }
    answer = _asked(task, seconds)
    return [
        Placed(kinds[int(k)], 0, 0, float(x), float(y), _nearest(blanks[kinds[int(k)]], angle))
        for k, angle, x, y in answer or ()
    ]


def _asked(task: dict[str, Any], seconds: int) -> list[list[float]] | None:
    """The child's answer; None where it gives none in time."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", str(Path(__file__).with_name("_strip.py"))],
            input=json.dumps(task),
            capture_output=True,
            text=True,
            timeout=seconds,
            check=True,
        )
        answer: list[list[float]] | None = json.loads(done.stdout)
        return answer
    except (subprocess.SubprocessError, OSError, ValueError):
        return None


def _nearest(one: Blank, angle: float) -> float:
    """The allowed angle that the solver means by its rounded one."""
    return min(one.angles, key=lambda own: abs((own - angle + 180.0) % 360.0 - 180.0))


def _coarse(one: Blank) -> Array:
    """A polygon with few vertices that encloses a blank, (n, 2)."""
    import shapely

    shape = shapely.Polygon(one.polygon)
    out = COARSE * float(one.sizes().max()) if one.bound > 0.0 else 0.0
    if out:
        shape = shapely.simplify(shape, out - one.bound, preserve_topology=True)
        shape = shapely.buffer(shape, out, join_style="mitre", mitre_limit=2.0)
    return np.asarray(shapely.get_coordinates(shape.exterior))[:-1]


# --- the proof -----------------------------------------------------------------------------


def _inside(blanks: Sequence[Blank], one: Placed, sheet: Sheet) -> bool:
    """Whether a placed blank keeps the margins of the first sheet."""
    return _margin(blanks, one, sheet) >= sheet.gap - SLACK


def _box(blanks: Sequence[Blank], one: Placed) -> Array:
    """The exact box of a placed blank, (4,)."""
    k = blanks[one.blank].angles.index(one.angle)
    return np.asarray(blanks[one.blank].boxes[k] + np.array([one.x, one.y, one.x, one.y]))


def _margin(blanks: Sequence[Blank], one: Placed, sheet: Sheet) -> float:
    """The smallest distance of a placed blank from its sheet's edges, negative outside, mm."""
    xmin, ymin, xmax, ymax = _box(blanks, one)
    return float(min(xmin, ymin, sheet.size[0] - xmax, sheet.size[1] - ymax))


def clearance(blanks: Sequence[Blank], placed: Sequence[Placed], sheet: Sheet) -> float:
    """The smallest distance in mm between two blanks of a sheet or to its edge, negative outside;
    never more than the true one, and the gap + 1 mm where all are farther apart.

    Between two blanks it is the distance of their exact boxes, or of the polygons that enclose
    them, whichever is more.
    """
    import shapely

    least = min(sheet.gap + NEAR, *(_margin(blanks, one, sheet) for one in placed))
    for number in sorted({one.sheet for one in placed}):
        here = [one for one in placed if one.sheet == number]
        shapes = [
            shapely.Polygon(blanks[p.blank].polygon @ turn(p.angle).T + (p.x, p.y)) for p in here
        ]
        bounds = [blanks[p.blank].bound for p in here]
        reach = sheet.gap + NEAR + 2.0 * max(bounds)
        one, other = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=reach)
        for i, j in zip(one.tolist(), other.tolist(), strict=True):
            if i < j:
                apart = float(shapely.distance(shapes[i], shapes[j])) - bounds[i] - bounds[j]
                boxes = _apart(_box(blanks, here[i]), _box(blanks, here[j]))
                least = min(least, max(apart, boxes))
    return least


def _apart(a: Array, b: Array) -> float:
    """The distance of two boxes (4,), 0 where they touch or overlap."""
    gaps = np.maximum(np.maximum(a[:2] - b[2:], b[:2] - a[2:]), 0.0)
    return float(np.hypot(*gaps))
