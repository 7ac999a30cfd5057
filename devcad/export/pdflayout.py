"""Where a pattern goes on paper: sheets, the grid of tiles, and which of them carry any of it.

Lengths are mm. A box is (left, bottom, right, top). A sheet of paper is a window, which shows a
piece of the pattern, and a band beside it with the two control squares and the words.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import JobError, LimitError
from devcad.geometry.taylor import Array
from devcad.shop.settings import Pdf
from devcad.units import MM_PER_INCH

Box = tuple[float, float, float, float]

MARGIN = 10.0  # printers leave 4 to 8 mm of a page white
GAP = 5.0  # between the squares, and around them
SQUARES = (50.0, 2.0 * MM_PER_INCH)
"""Sides of the two control squares."""
BAND = SQUARES[1] + GAP
WORDS = 16.0  # the least width of the words beside the squares
LEAST = 20.0  # of the pattern that a tile must add to its neighbour
PAD = 1.0  # around the pattern's box, so that strokes on its border are seen whole
TOUCH = 0.3  # a stroke beside a window may reach into it
LARGEST = 200.0 * MM_PER_INCH
"""The longest side of a page that every reader of PDF takes."""
SHIFTS = (0.5, 0.0, 1.0, 0.25, 0.75)
MOST_TILES = 200
MOST_CELLS = 40_000  # of a grid, printed or not


@dataclass(frozen=True, slots=True)
class Sheet:
    """A sheet of paper: its size, the window, the lower left corners of the two control squares,
    and the box of the words."""

    width: float
    height: float
    window: Box
    squares: tuple[tuple[float, float], tuple[float, float]]
    words: Box


@dataclass(frozen=True, slots=True)
class Tile:
    """A piece of the pattern: ``box`` is its window in pattern coordinates; row 0 is the top one.

    ``printed`` is False where nothing of the pattern lies on it.
    """

    row: int
    column: int
    box: Box
    printed: bool

    @property
    def label(self) -> str:
        """The row's letter and the column's number, A1 at the upper left."""
        letters, n = "", self.row
        while n >= 0:
            letters = chr(ord("A") + n % 26) + letters
            n = n // 26 - 1
        return f"{letters}{self.column + 1}"


@dataclass(frozen=True, slots=True)
class Plan:
    """The pages of a pattern: the paper and its name, and the tiles row by row from the upper
    left."""

    paper: str
    sheet: Sheet
    tiles: tuple[Tile, ...]
    overlap: float

    @property
    def printed(self) -> tuple[Tile, ...]:
        """The tiles that get a page."""
        return tuple(tile for tile in self.tiles if tile.printed)


def plan(contours: Sequence[Array], box: Box, pdf: Pdf) -> Plan:
    """The pages of a pattern with the given closed polygons, each (n, 2), in its bounding box.

    Upright or across, whichever takes fewer pages. A tile is printed if any of the sheet that is
    to be cut lies on it, lines or not.

    Raises:
        JobError: the paper is too small, or the overlap too large for it;
        LimitError: more than 200 tiles, or one page longer than PDF allows.
    """
    wide, high = box[2] - box[0] + 2.0 * PAD, box[3] - box[1] + 2.0 * PAD
    if pdf.size is None:
        return _tiled(contours, box, _one_sheet(wide, high), "one page", 0.0)
    short, long = sorted(pdf.size)
    sheets = [s for s in (_upright(short, long), _across(long, short)) if _fits(s, pdf.overlap)]
    if not sheets:
        raise JobError(
            f"the paper of {pdf.size[0]:g} x {pdf.size[1]:g} mm has no room for tiles that"
            f" overlap by {pdf.overlap:g} mm",
            value=f"{pdf.size[0]:g} x {pdf.size[1]:g}",
            limit="A5 with an overlap of 10 mm",
            remedy="choose a larger pdf.paper or a smaller pdf.overlap",
        )
    paper = pdf.paper or f"{pdf.size[0]:g} x {pdf.size[1]:g} mm"
    plans = [_tiled(contours, box, sheet, paper, pdf.overlap) for sheet in sheets]
    best = min(plans, key=lambda found: (len(found.printed), len(found.tiles)))
    if len(best.printed) > MOST_TILES:
        raise _too_many(len(best.printed))
    return best


def _too_many(count: int) -> LimitError:
    return LimitError(
        f"the pattern takes {count} tiles, at most {MOST_TILES}",
        value=float(count),
        limit=float(MOST_TILES),
        remedy='choose a larger pdf.paper, "A0" or "one" page',
    )


def _upright(width: float, height: float) -> Sheet:
    """The band below the window, the squares side by side."""
    low = MARGIN + BAND
    second = MARGIN + SQUARES[0] + GAP
    words = (second + SQUARES[1] + GAP, MARGIN, width - MARGIN, MARGIN + SQUARES[1])
    window = (MARGIN, low, width - MARGIN, height - MARGIN)
    return Sheet(width, height, window, ((MARGIN, MARGIN), (second, MARGIN)), words)


def _across(width: float, height: float) -> Sheet:
    """The band to the right of the window, one square above the other."""
    left = width - MARGIN - SQUARES[1]
    second = MARGIN + SQUARES[1] + GAP
    words = (left, second + SQUARES[0] + GAP, width - MARGIN, height - MARGIN)
    window = (MARGIN, MARGIN, width - MARGIN - BAND, height - MARGIN)
    return Sheet(width, height, window, ((left, second), (left, MARGIN)), words)


def _fits(sheet: Sheet, overlap: float) -> bool:
    """Whether words and window have room."""
    x0, y0, x1, y1 = sheet.window
    least = LEAST + overlap
    room = min(sheet.words[2] - sheet.words[0], sheet.words[3] - sheet.words[1])
    return bool(min(x1 - x0, y1 - y0) >= least and room >= WORDS and overlap >= 0.0)


def _one_sheet(wide: float, high: float) -> Sheet:
    """One page around the pattern, with the band below it."""
    width = max(wide, SQUARES[0] + SQUARES[1] + 2.0 * GAP + 5.0 * WORDS) + 2.0 * MARGIN
    height = high + BAND + 2.0 * MARGIN
    if max(width, height) > LARGEST:
        raise LimitError(
            f"one page would be {max(width, height):.0f} mm long, at most {LARGEST:.0f} mm",
            value=max(width, height),
            limit=LARGEST,
            remedy='choose tiles, such as pdf.paper = "A0"',
        )
    return _upright(width, height)


def _tiled(contours: Sequence[Array], box: Box, sheet: Sheet, paper: str, overlap: float) -> Plan:
    """The grid of tiles over the pattern, shifted so that many of them stay empty."""
    x0, y0, x1, y1 = sheet.window
    wide, high = x1 - x0, y1 - y0
    columns = _count(box[2] - box[0], wide, overlap)
    rows = _count(box[3] - box[1], high, overlap)
    if columns * rows > MOST_CELLS:
        raise _too_many(columns * rows)
    across = _cells(box[0], box[2], wide, overlap, columns)
    up = [bottoms[::-1] for bottoms in _cells(box[1], box[3], high, overlap, rows)]  # top first
    grids = [
        (lefts, bottoms, _occupied(contours, lefts, bottoms, (wide, high)))
        for lefts in across
        for bottoms in up
    ]
    lefts, bottoms, marked = min(grids, key=lambda grid: int(grid[2].sum()))  # the first of equals
    tiles = tuple(
        Tile(row, column, (left, low, left + wide, low + high), bool(marked[row, column]))
        for row, low in enumerate(bottoms.tolist())
        for column, left in enumerate(lefts.tolist())
    )
    return Plan(paper, sheet, tiles, overlap)


def _count(length: float, size: float, overlap: float) -> int:
    """The fewest windows of a size that cover a length with its pad."""
    return max(1, int(np.ceil((length + 2.0 * PAD - overlap) / (size - overlap) - 1e-9)))


def _cells(low: float, high: float, size: float, overlap: float, count: int) -> list[Array]:
    """Where so many windows begin that cover an interval with its pad: the grid about its middle
    first, then grids shifted by shares of what it has to spare."""
    step = size - overlap
    spare = max(0.0, count * step + overlap - (high - low + 2.0 * PAD))
    return [np.asarray(low - PAD - share * spare + step * np.arange(count)) for share in SHIFTS]


def _occupied(
    contours: Sequence[Array], lefts: Array, bottoms: Array, size: tuple[float, float]
) -> NDArray[np.bool_]:
    """Which windows carry a piece of the sheet, (rows, columns): a contour runs through them, or
    their middle lies inside."""
    starts = np.concatenate(list(contours))
    ends = np.concatenate([np.roll(c, -1, axis=0) for c in contours])
    middles = lefts + 0.5 * size[0]
    marked = np.zeros((len(bottoms), len(lefts)), dtype=bool)
    for row, low in enumerate(bottoms):
        a, b = _within(starts, ends, low - TOUCH, low + size[1] + TOUCH)
        left, right = np.minimum(a, b) - TOUCH, np.maximum(a, b) + TOUCH
        touched = (lefts[:, None] <= right) & (lefts[:, None] + size[0] >= left)
        inside = _crossings(starts, ends, low + 0.5 * size[1], middles) % 2 == 1
        marked[row] = touched.any(axis=1) | inside
    return marked


def _within(starts: Array, ends: Array, low: float, high: float) -> tuple[Array, Array]:
    """The x at both ends of what lies between two heights of each segment that does."""
    y0, y1 = starts[:, 1], ends[:, 1]
    kept = (np.maximum(y0, y1) >= low) & (np.minimum(y0, y1) <= high)
    p, q = starts[kept], ends[kept]
    rise = q[:, 1] - p[:, 1]
    safe = np.where(rise == 0.0, 1.0, rise)
    at = [
        np.where(rise == 0.0, whole, np.clip((edge - p[:, 1]) / safe, 0.0, 1.0))
        for edge, whole in ((low, 0.0), (high, 1.0))
    ]
    x = [p[:, 0] + s * (q[:, 0] - p[:, 0]) for s in at]
    return x[0], x[1]


def _crossings(starts: Array, ends: Array, height: float, x: Array) -> NDArray[np.intp]:
    """How many segments cross a height to the right of each x."""
    p, q = starts[:, 1] > height, ends[:, 1] > height
    a, b = starts[p != q], ends[p != q]
    share = (height - a[:, 1]) / (b[:, 1] - a[:, 1])
    at = a[:, 0] + share * (b[:, 0] - a[:, 0])
    return np.asarray(np.sum(at > x[:, None], axis=1))
