"""Stroke text: letters of single lines, as a pen, a laser or an engraver draws them.

The letters are Hershey's simplex Roman, from the package Hershey-Fonts: strokes through points
of a coarse grid. Between true corners they are drawn as smooth curves through these points, and
straight where a stroke is: a round letter is round at any height.

Source: the Hershey Fonts were created by Dr. A. V. Hershey while working at the U. S. National
Bureau of Standards; the format of the data was created by James Hurt, Cognition, Inc.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from devcad.errors import JobError
from devcad.flatten.pattern import Edge
from devcad.flatten.shapes import MARK, line
from devcad.geometry.splines import Spans
from devcad.geometry.taylor import Array

FONT = "rowmans"
CAP, BASE, BOTTOM = 21.0, 9.0, -7.0
"""The letters' grid: cap height, the baseline's place in the data (y down), the descenders."""
CORNER = np.cos(np.radians(50.0))
"""A stroke that turns further at a point has a corner there; round ones turn by 45 degrees."""
SLIGHT, LONG = np.cos(np.radians(25.0)), 6.0
"""Between two sides as long as this a slighter turn is a corner too, as in a Y."""
STRAIGHT = 2.0
"""A side so many times longer than its neighbour is straight up to their common point."""
DEGREE_SIGN = "\x7f"  # where the font has it

STAND_INS = {
    **dict.fromkeys("‐‑‒–—−", "-"),
    **dict.fromkeys("‘’‚", "'"),
    **dict.fromkeys("“”„", '"'),
    "ß": "ss",
    "æ": "ae",
    "Æ": "AE",
    "œ": "oe",
    "Œ": "OE",
    "×": "x",
    "⌀": "Ø",
    "\N{GREEK SMALL LETTER MU}": "u",
    "\N{FRACTION SLASH}": "/",
    "°": DEGREE_SIGN,
}
"""Characters that others may stand for, after Unicode's own compatibility decomposition."""
BUILT = {
    "Ø": ("O", [[(-7, -2), (7, 23)]]),
    "ø": ("o", [[(-6, -1), (6, 15)]]),
    "±": ("+", [[(-9, -3), (9, -3)]]),
}
"""Characters made of another and further strokes, x from its middle, y from the baseline."""
ACCENTS = {
    "\N{COMBINING GRAVE ACCENT}": [[(1, 2), (-3, 6)]],
    "\N{COMBINING ACUTE ACCENT}": [[(-1, 2), (3, 6)]],
    "\N{COMBINING CIRCUMFLEX ACCENT}": [[(-4, 2), (0, 6), (4, 2)]],
    "\N{COMBINING TILDE}": [[(-5, 3), (-3, 5), (-1, 5), (1, 3), (3, 3), (5, 5)]],
    "\N{COMBINING DIAERESIS}": [[(-4, 3), (-4, 5)], [(4, 3), (4, 5)]],
    "\N{COMBINING RING ABOVE}": [
        [(2, 4), (1, 6), (-1, 6), (-2, 4), (-1, 2), (1, 2), (2, 4)],
    ],
    "\N{COMBINING CARON}": [[(-4, 6), (0, 2), (4, 6)]],
    "\N{COMBINING MACRON}": [[(-4, 4), (4, 4)]],
    "\N{COMBINING DOT ABOVE}": [[(0, 3), (0, 5)]],
    "\N{COMBINING DOUBLE ACUTE ACCENT}": [[(-4, 2), (-1, 6)], [(1, 2), (4, 6)]],
}
"""Strokes above a letter, x from its middle, y from its top."""
CEDILLA = "\N{COMBINING CEDILLA}"
BELOW = {CEDILLA: [[(0, 0), (1, -2), (0, -4), (-2, -4)]]}
"""Strokes below a letter, y from the baseline."""

Stroke = Array
"""Points (k, 2) in the letters' grid, y up from the baseline."""


@dataclass(frozen=True, slots=True)
class Glyph:
    """A letter: its strokes, x from its own left side, and how far the next one is."""

    strokes: tuple[Stroke, ...]
    width: float


def lettering(text: str, height: float) -> tuple[Edge, ...]:
    """A line of text along x as smooth lines in mm; the baseline starts at the origin.

    ``height`` is that of a capital. Letters with accents are put together; typographic quotes and
    dashes become plain ones.

    Raises:
        JobError: a character that has no strokes, named; or a text without any letter.
    """
    require_letters(text)
    scale = height / CAP
    edges: list[Edge] = []
    x = 0.0
    for glyph in _glyphs(text):
        for stroke in glyph.strokes:
            edges += _smooth(scale * (stroke + np.array([x, 0.0])), scale)
        x += glyph.width
    return tuple(edges)


def require_letters(text: str) -> None:
    """JobError where a character has no strokes, or none is a letter."""
    if not any(glyph.strokes for glyph in list(_glyphs(text))):
        raise JobError("the text has no letters", value=text[:40], remedy="write one, or remove it")


def text_box(text: str, height: float) -> tuple[float, float, float, float]:
    """The room of a line of text in mm: (0, the descenders' depth, its width, the cap height)."""
    scale = height / CAP
    return 0.0, scale * BOTTOM, scale * sum(glyph.width for glyph in _glyphs(text)), height


def _glyphs(text: str) -> Iterator[Glyph]:
    """The glyphs of a text, accents on the letters that they follow."""
    waiting: Glyph | None = None
    for character in _characters(text):
        accent = ACCENTS.get(character) or BELOW.get(character)
        if accent is not None and waiting is not None:
            waiting = _accented(waiting, accent, above=character in ACCENTS)
            continue
        if waiting is not None:
            yield waiting
        waiting = _glyph(character)
    if waiting is not None:
        yield waiting


def _characters(text: str) -> Iterator[str]:
    """The characters to be drawn, one that stands for another in its place."""
    for character in unicodedata.normalize("NFC", text):
        known = STAND_INS.get(character, character)
        if known in BUILT:
            yield known
            continue
        for part in known if known != character else unicodedata.normalize("NFKD", character):
            yield from STAND_INS.get(part, part)


def _accented(glyph: Glyph, accent: list[list[tuple[int, int]]], *, above: bool) -> Glyph:
    """A letter with strokes over its middle and its top, or below."""
    points = np.concatenate([*glyph.strokes, [[0.5 * glyph.width, 0.0]]])
    top = points[:, 1].max() if above else 0.0
    at = np.array([0.5 * glyph.width, top])
    return Glyph((*glyph.strokes, *(at + np.array(s, dtype=float) for s in accent)), glyph.width)


def _glyph(character: str) -> Glyph:
    """One glyph of the font, or one built upon it."""
    if character in BUILT:
        base, strokes = BUILT[character]
        return _accented(_font()[base], strokes, above=False)
    glyph = _font().get(character)
    if glyph is None:
        name = unicodedata.name(character, "a control character").lower()
        raise JobError(
            f'the character "{character}" (U+{ord(character):04X}, {name}) has no strokes'
            if character.isprintable()
            else f"the character U+{ord(character):04X} ({name}) has no strokes",
            value=f"U+{ord(character):04X}",
            limit="ASCII and accented Latin letters",
            remedy="write it in other letters, one line of text a mark",
        )
    return glyph


@lru_cache(maxsize=1)
def _font() -> dict[str, Glyph]:
    """The letters by their characters."""
    from HersheyFonts import HersheyFonts

    font = HersheyFonts()
    font.load_default_font(FONT)
    out = {}
    for character, glyph in font.all_glyphs.items():
        strokes = (np.array(stroke, dtype=float) for stroke in glyph.strokes if len(stroke) > 1)
        out[character] = Glyph(
            tuple(np.column_stack([s[:, 0] - glyph.left_offset, BASE - s[:, 1]]) for s in strokes),
            float(glyph.char_width),
        )
    return out


def _smooth(points: Array, scale: float) -> list[Edge]:
    """A stroke as smooth lines from corner to corner, straight ones as such."""
    steps = np.diff(points, axis=0)
    points = np.concatenate([points[:1], points[1:][np.abs(steps).max(axis=1) > 0.0]])
    sides = np.diff(points, axis=0)
    if not len(sides):
        return []
    units = sides / np.hypot(*sides.T)[:, None]
    cosines = (units[1:] * units[:-1]).sum(axis=1)
    lengths = np.hypot(*sides.T) / scale
    limits = np.where(np.minimum(lengths[1:], lengths[:-1]) >= LONG, SLIGHT, CORNER)
    corners = np.flatnonzero(cosines < limits) + 1
    closed = bool((points[0] == points[-1]).all()) and units[-1] @ units[0] >= CORNER
    if closed and len(corners):  # begin at a corner
        points = np.concatenate([points[corners[0] :], points[1 : corners[0] + 1]])
        return _smooth(points, scale)
    ends = [0, *corners.tolist(), len(points) - 1]
    return [_run(points[i : j + 1], closed=closed) for i, j in pairwise(ends)]


def _run(points: Array, *, closed: bool) -> Edge:
    """The smooth line through points (k, 2) without corners: cubics along tangents."""
    if len(points) == 2:
        return line(points[0], points[1], MARK)
    sides = np.diff(points, axis=0)
    lengths = np.hypot(*sides.T)
    units = sides / lengths[:, None]
    before, after = (units[:-1], units[1:]) if not closed else (np.roll(units, 1, axis=0), units)
    long, short = (lengths[:-1], lengths[1:]) if not closed else (np.roll(lengths, 1), lengths)
    # the circle through three points; along the longer side where that is a straight one
    tangents = before * short[:, None] + after * long[:, None]
    tangents = np.where((long > STRAIGHT * short)[:, None], before, tangents)
    tangents = np.where((short > STRAIGHT * long)[:, None], after, tangents)
    tangents = tangents / np.hypot(*tangents.T)[:, None]
    if closed:
        tangents = np.concatenate([tangents, tangents[:1]])
    else:  # arcs at the ends: the tangent at one end mirrors that at the other
        first = 2.0 * (units[0] @ tangents[0]) * units[0] - tangents[0]
        last = 2.0 * (units[-1] @ tangents[-1]) * units[-1] - tangents[-1]
        tangents = np.concatenate([[first], tangents, [last]])
    return _hermite(points, tangents, lengths)


def _hermite(points: Array, tangents: Array, lengths: Array) -> Edge:
    """Cubics through points (k, 2) along unit tangents, their parameter the chords' length."""
    half = 0.5 * lengths[:, None]
    middle, chord = 0.5 * (points[1:] + points[:-1]), points[1:] - points[:-1]
    total, turn = tangents[1:] + tangents[:-1], tangents[1:] - tangents[:-1]
    spans = Spans(
        np.concatenate([[0.0], np.cumsum(lengths)]),
        np.stack(
            [
                middle - 0.25 * half * turn,
                0.75 * chord / half - 0.25 * total,
                0.25 * turn / half,
                0.25 * (total - chord / half) / half**2,
            ]
        ),
    )

    def curve(u: Array) -> tuple[Array, Array]:
        at = spans.jet(np.asarray(u, dtype=float), 1)
        return at[0], at[1]

    return Edge(MARK, curve, spans.knots)
