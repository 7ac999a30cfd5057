"""The pages of a pattern: the tiles at 1:1, before them the map that says how they go together.

Every page has two control squares and a block of words in a band beside its window. A tile is cut
along the left and the lower side of its window, where another one follows, and laid on the dashed
line of that neighbour; the half diamonds on both then close.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from devcad.export.pdfcanvas import FORM, Form, Page, Text, fitted, layer
from devcad.export.pdflayout import PAD, SQUARES, Box, Plan, Sheet, Tile
from devcad.export.pdfpaths import line, numbers, rectangle

Item = str | Text
Groups = dict[str, list[str]]
"""Layer -> the path operators of everything on it."""

CONTROL, TILES = "CONTROL", "TILES"
"""The layers of squares and words, and of what helps to join the tiles."""
PEN = 0.2  # mm, of the pattern
FINE = 0.12  # of squares and frames
DIAMOND = 3.0  # mm from its middle to its corners
QUARTERS = (0.25, 0.75)  # of a joint, where its diamonds stand
GLUED = 4.0  # mm, the least overlap that has room for words
MARK = 5.0  # mm, of a mark outside a window's corner
SOFT = 0.45  # the grey of what helps to join
PALE = 0.8  # and of the rest of the frame
SIZE = 3.1  # mm, of the words in the band
LEGEND = 4.2  # mm from one line of the legend to the next
SAMPLE = 12.0  # mm of a line in the legend
BELOW = 34.0  # mm for the words below the map
STYLES = {  # colour and dashes, in the order in which they are drawn
    "GLUE": ("0.6 0.6 0.6", (0.5, 1)),
    "RULING": ("0.95 0.41 0.14", (1, 1)),
    "BEND_UP": ("0 0.6 0", (4, 2)),
    "BEND_DOWN": ("0 0.6 0", (5, 1.5, 0.6, 1.5)),
    "SCORE": ("0 0.6 0", ()),
    "SEW": ("0.8 0 0.6", (3, 1.5)),
    "GRAIN": ("0.3 0.3 0.3", ()),
    "ENGRAVE": ("0.85 0 0", ()),
    "LABEL": ("0.85 0 0", ()),
    "MARK": ("0.85 0 0", ()),
    "NOTCH_MARK": ("0.85 0 0", ()),
    "STITCH": ("0 0 1", ()),
    "CUT_INNER": ("0 0 1", ()),
    "CUT_OUTER": ("0 0 0", ()),
}
OTHER = ("0.5 0.5 0.5", (2, 1))
MEANINGS = {
    "GLUE": "glue here",
    "RULING": "ruling, for reference",
    "BEND_UP": "fold up, towards you",
    "BEND_DOWN": "fold down, away from you",
    "SCORE": "score",
    "SEW": "sew",
    "GRAIN": "grain",
    "ENGRAVE": "engrave or draw",
    "LABEL": "label",
    "MARK": "mark",
    "NOTCH_MARK": "match with the neighbour",
    "STITCH": "stitch holes",
    "CUT_INNER": "cut out first",
    "CUT_OUTER": "cut",
}
ADVICE = (
    "Print at 100 %, not fitted to the page, and measure the squares.",
    "Cut each sheet along the left and the lower side of its frame wherever a neighbour follows"
    " there, lay that side on the dashed line of the neighbour and glue: the diamonds close, and"
    " the pattern runs on.",
)


def ordered(layers: Sequence[str]) -> list[str]:
    """The layers in the order in which they are drawn, those that have no style first."""
    known = list(STYLES)
    return sorted(set(layers), key=lambda name: (known.index(name) if name in known else -1, name))


def pattern_form(groups: Groups, box: Box, enlarged: float = 1.0) -> Form:
    """The pattern in its own coordinates, each layer in its colour and with its dashes, which are
    so many times longer where the pattern will be shown so many times smaller."""
    out: list[Item] = ["1 J 1 j"]
    for name in ordered(list(groups)):
        with layer(out, name):
            colour, dashes = STYLES.get(name, OTHER)
            out += [f"{colour} RG {_dash(dashes, enlarged)}", *groups[name]]
    wide = (box[0] - PAD, box[1] - PAD, box[2] + PAD, box[3] + PAD)
    return Form(wide, "\n".join(str(item) for item in out))


def _dash(dashes: Sequence[float], enlarged: float) -> str:
    """The operator that sets the dashes."""
    return f"[{numbers(*(enlarged * dash for dash in dashes))}] 0 d"


def pages(plan: Plan, box: Box, layers: Sequence[str], title: Sequence[str]) -> tuple[Page, ...]:
    """All pages: the tiles alone where there is one, else the map first. ``title``: the name of
    what is printed, and lines about it."""
    printed = plan.printed
    total = len(printed) + (len(printed) > 1)
    out = []
    if total > 1:
        words = _words("assembly map", 1, total, title, not_to_scale=True)
        out.append(_page(plan.sheet, _map(plan, box, layers), words, plan.sheet.words))
    for number, tile in enumerate(printed, start=total - len(printed) + 1):
        place = f"tile {tile.label}" if total > 1 else ""
        words = _words(place, number, total, title, not_to_scale=False)
        items, (x0, y0, x1, y1) = _tile(plan, tile), plan.sheet.words
        if total == 1:
            top = y0 + min(LEGEND * len(layers), 0.5 * (y1 - y0))
            items += _legend(layers, (x0, y0, x1, top))
            y0 = top
        out.append(_page(plan.sheet, items, words, (x0, y0, x1, y1)))
    return tuple(out)


def _words(
    place: str, number: int, total: int, title: Sequence[str], *, not_to_scale: bool
) -> list[tuple[str, float, bool]]:
    """The block of words: lines, their relative sizes, bold or not."""
    scale = "the map is not to scale, the squares are" if not_to_scale else "1:1, front side up"
    return [
        *([(place, 2.0, True)] if place else []),
        (title[0], 1.4, True),
        *((text, 1.0, False) for text in title[1:]),
        (f"page {number} of {total}", 1.0, False),
        (scale, 1.0, False),
    ]


def _page(sheet: Sheet, items: list[Item], words: list[tuple[str, float, bool]], box: Box) -> Page:
    """A page with its control squares, and its words in a box."""
    out = list(items)
    with layer(out, CONTROL):
        out.append(f"{FINE} w 0 G")
        for (x, y), side, name in zip(sheet.squares, SQUARES, ("50 mm", "2 in"), strict=True):
            out.append(rectangle(x, y, side, side))
            middle = x + 0.5 * side
            out.append(Text(middle, y + 0.5 * side, name, 5.0, bold=True, anchor="middle"))
            out.append(Text(middle, y + 0.5 * side - 5.0, "control square", 2.5, anchor="middle"))
        texts, _ = fitted(words, box, SIZE)
        out += texts
    return Page(sheet.width, sheet.height, tuple(out))


# --- a tile --------------------------------------------------------------------------------


def _tile(plan: Plan, tile: Tile) -> list[Item]:
    """The window of a tile: its piece of the pattern, and the marks that join it."""
    x0, y0, x1, y1 = plan.sheet.window
    move = f"1 0 0 1 {numbers(x0 - tile.box[0], y0 - tile.box[1])} cm"
    clip = rectangle(x0, y0, x1 - x0, y1 - y0, "W n")
    out: list[Item] = [f"q {clip} {move} {PEN} w /{FORM} Do Q"]
    if len(plan.printed) > 1:
        with layer(out, TILES):
            out.append(f"{FINE} w {PALE} G {rectangle(x0, y0, x1 - x0, y1 - y0)} {SOFT} G")
            out += _corners(plan.sheet.window)
            out += _cuts(plan, tile)
            out.append(f"q {clip}")
            out += _joints(plan, tile)
            out.append("Q")
            corner = Text(x1 - 2.0, y1 - 6.0, tile.label, 5.0, True, "end", SOFT)
            out.append(corner)
    return out


def _corners(window: Box) -> Iterator[str]:
    """Marks in the margin that carry the sides of the window on, for a ruler."""
    x0, y0, x1, y1 = window
    for x in (x0, x1):
        yield line(x, y0 - MARK, x, y0 - 1.0)
        yield line(x, y1 + 1.0, x, y1 + MARK)
    for y in (y0, y1):
        yield line(x0 - MARK, y, x0 - 1.0, y)
        yield line(x1 + 1.0, y, x1 + MARK, y)


def _cuts(plan: Plan, tile: Tile) -> Iterator[Item]:
    """The sides of the window along which the sheet is cut, with the words in the margin."""
    x0, y0, x1, y1 = plan.sheet.window
    there = {(other.row, other.column) for other in plan.printed}
    words = "cut along this side"
    if (tile.row, tile.column - 1) in there:
        yield line(x0, y0, x0, y1)
        yield Text(x0 - 1.5, 0.5 * (y0 + y1), words, 2.3, False, "middle", SOFT, False)
    if (tile.row + 1, tile.column) in there:
        yield line(x0, y0, x1, y0)
        yield Text(0.5 * (x0 + x1), y0 - 3.0, words, 2.3, False, "middle", SOFT)


def _joints(plan: Plan, tile: Tile) -> Iterator[Item]:
    """Where the neighbours meet this tile: dashed lines to lay them on at its right and upper
    side, and diamonds on all four joints."""
    x0, y0, x1, y1 = plan.sheet.window
    there = {(other.row, other.column): other.label for other in plan.printed}
    right = there.get((tile.row, tile.column + 1))
    above = there.get((tile.row - 1, tile.column))
    if right:
        x = x1 - plan.overlap
        yield f"[3 2] 0 d {line(x, y0, x, y1)} [] 0 d"
        yield from _glue(plan, right, x + 3.0, 0.5 * (y0 + y1), upright=False)
    if above:
        y = y1 - plan.overlap
        yield f"[3 2] 0 d {line(x0, y, x1, y)} [] 0 d"
        yield from _glue(plan, above, 0.5 * (x0 + x1), y + 1.5, upright=True)
    joints_x = [x1 - plan.overlap] * bool(right) + [x0] * ((tile.row, tile.column - 1) in there)
    joints_y = [y1 - plan.overlap] * bool(above) + [y0] * ((tile.row + 1, tile.column) in there)
    yield from (_diamond(x, y0 + s * (y1 - y0)) for x in joints_x for s in QUARTERS)
    yield from (_diamond(x0 + s * (x1 - x0), y) for y in joints_y for s in QUARTERS)


def _glue(plan: Plan, label: str, x: float, y: float, *, upright: bool) -> Iterator[Item]:
    """Words in the strip that the neighbour will cover, where they fit into it."""
    if plan.overlap >= GLUED:
        yield Text(x, y, f"glue: {label} from here on", 2.3, False, "middle", SOFT, upright)


def _diamond(x: float, y: float) -> str:
    """A square on its corner around a point of a joint; half of it is on either tile."""
    r = DIAMOND
    return (
        f"{numbers(x - r, y)} m {numbers(x, y - r)} l {numbers(x + r, y)} l"
        f" {numbers(x, y + r)} l h S"
    )


# --- the map -------------------------------------------------------------------------------


def _map(plan: Plan, box: Box, layers: Sequence[str]) -> list[Item]:
    """The pattern small, the tiles over it with their names, and what to do with them."""
    x0, y0, x1, y1 = plan.sheet.window
    y0 += BELOW
    left, _, _, high = plan.tiles[0].box
    _, low, right, _ = plan.tiles[-1].box
    scale = min((x1 - x0) / (right - left), (y1 - y0) / (high - low))
    dx = 0.5 * (x0 + x1) - 0.5 * scale * (left + right)
    dy = y1 - scale * high
    out: list[Item] = []
    with layer(out, TILES):
        out.append(f"{FINE} w")
        for tile in plan.tiles:
            x, y, wide, tall = _core(plan, tile, scale, dx, dy)
            paint = f"{SOFT} G {rectangle(x, y, wide, tall)}"
            out.append(paint if tile.printed else f"0.88 g {rectangle(x, y, wide, tall, 'f')}")
    out.append(f"q {numbers(scale)} 0 0 {numbers(scale)} {numbers(dx, dy)} cm")
    out.append(f"{numbers(FINE / scale)} w /{FORM} Do Q")
    with layer(out, TILES):
        for tile in plan.tiles:
            x, y, wide, tall = _core(plan, tile, scale, dx, dy)
            size = min(7.0, 0.5 * tall, 0.3 * wide)
            middle, base = x + 0.5 * wide, y + 0.5 * tall - 0.35 * size
            if tile.printed:
                out.append(Text(middle, base, tile.label, size, True, "middle", 0.25))
            else:
                blank = min(2.2, 0.22 * wide)
                out.append(Text(middle, base, "left out", blank, False, "middle", 0.35))
    return [*out, *_advice(plan, box, layers, (x0, y0 - BELOW, x1, y0 - 2.0))]


def _core(
    plan: Plan, tile: Tile, scale: float, dx: float, dy: float
) -> tuple[float, float, float, float]:
    """What of a tile is seen when all are joined, on the map: x, y, width, height.

    It covers the strip of the tile to its left and of the tile below it.
    """
    last = max(other.column for other in plan.tiles)
    x0, y0, x1, y1 = tile.box
    x1 -= plan.overlap * (tile.column < last)
    y1 -= plan.overlap * (tile.row > 0)
    return dx + scale * x0, dy + scale * y0, scale * (x1 - x0), scale * (y1 - y0)


def _advice(plan: Plan, box: Box, layers: Sequence[str], room: Box) -> list[Item]:
    """The pattern's size and how to join the tiles on the left, the legend on the right."""
    middle = 0.5 * (room[0] + room[2])
    lines = [
        (f"pattern {box[2] - box[0]:.2f} x {box[3] - box[1]:.2f} mm", 1.1, True),
        (
            f"{len(plan.printed)} tiles, paper {plan.paper}, overlap {plan.overlap:g} mm",
            1.0,
            False,
        ),
        *((text, 1.0, False) for text in ADVICE),
    ]
    out: list[Item] = []
    with layer(out, CONTROL):
        texts, _ = fitted(lines, (room[0], room[1], middle + 15.0, room[3]), 2.7)
        out += texts
    return [*out, *_legend(layers, (middle + 22.0, room[1], room[2], room[3]))]


def _legend(layers: Sequence[str], room: Box) -> list[Item]:
    """What the lines of the pattern mean, from the top of a box down as far as it reaches."""
    out: list[Item] = []
    x0, y0, _, y1 = room
    step = min(LEGEND, (y1 - y0) / max(1, len(layers)))
    with layer(out, CONTROL):
        out.append("0.25 w")
        for k, name in enumerate(reversed(ordered(layers)), start=1):
            colour, dashes = STYLES.get(name, OTHER)
            y = y1 - k * step
            out.append(f"{colour} RG {_dash(dashes, 1.0)} {line(x0, y, x0 + SAMPLE, y)}")
            words = MEANINGS.get(name, name.lower().replace("_", " "))
            out.append(Text(x0 + SAMPLE + 2.0, y - 0.9, words, 0.62 * step))
    return out
