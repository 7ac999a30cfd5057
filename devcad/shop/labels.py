"""Labels: what a piece is, and which edge of which other piece comes to each of its edges, in
letters of single strokes on its pattern."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from devcad.errors import JobError
from devcad.flatten.lettering import lettering
from devcad.flatten.pattern import Edge, Pattern, sample
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part
from devcad.shop.placing import moved_edge
from devcad.shop.room import Box, Room, free_room, upright

LABEL = "LABEL"
"""The role of letters."""
LEAST = 2.0
"""mm; smaller letters are left out."""
SMALLER = 0.75
"""From one height that is tried to the next."""
HALF = 0.5
"""Of the height wished for: letters cross rulings and bend lines before they get smaller."""
MARGIN, LEAST_MARGIN = 0.4, 0.5
"""Between letters and whatever else: a share of their height, and mm at least."""
SPACING = 1.7
"""From one line of a block to the next, in heights."""
FINE = 0.02
"""mm; what the polygons of a pattern may leave its curves by."""
SHARES = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.12, 0.88)
"""Where along an edge a label is tried, as shares of its length."""
RISES = (0.0, 0.35, 0.8, 1.4, 2.2)
"""How much further inside than need be, in heights of the label, where the edge is curved."""
PER_PIECE = 32
"""Steps on an edge between two of its u's."""
APART = "   "
"""Between lines that are written as one."""
UNKNOWN = "?"
"""For a character that has no strokes."""


@dataclass(frozen=True, slots=True)
class Texts:
    """What is written on a piece: the lines of ``title``, those of ``more`` where there is room,
    and along edges, by their name, the first of some texts that finds room."""

    title: tuple[str, ...]
    more: tuple[str, ...] = ()
    mates: tuple[tuple[str, tuple[str, ...]], ...] = ()


def label_texts(part: Part, panel: Panel) -> Texts:
    """What is written on a panel: the part's number, or its name, and its revision; the panel, if
    there are several; quantity, material and thickness, and how the nest may turn it. Edges have
    the numbers of their seams, from 1 in the order of the job, and the names of their mates."""
    name = part.part_number or part.name
    title = [f"{name} rev {part.revision}" if part.revision else name]
    if len(part.panels) > 1:
        title.append(panel.name)
    sheet = f"{panel.thickness:g} mm" if panel.thickness else ""
    quantity = f"qty {part.quantity}" if part.quantity > 1 else ""
    words = (quantity, part.material.upper(), sheet)
    more = ["  ".join(word for word in words if word)] if any(words) else []
    if part.grain is not None:
        more.append("turn by 180 only")
    return Texts(tuple(title), tuple(more), _mates(part, panel.name))


def _mates(part: Part, name: str) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """For every edge of a panel that has a seam: the seam's number and the mate, or the number."""
    found = []
    for number, seam in enumerate(part.seams, start=1):
        for (panel, edge), mate in zip(seam.edges, seam.edges[::-1], strict=True):
            if panel == name:
                other = mate[1] if mate[0] == name else ".".join(mate)
                found.append((edge, (f"{number} > {other}", f"{number}")))
    return tuple(found)


def labelled(
    pattern: Pattern,
    texts: Texts,
    height: float,
    *,
    net: tuple[Edge, ...] = (),
    obstacles: Sequence[Edge] = (),
) -> tuple[Pattern, tuple[str, ...]]:
    """The pattern with its labels, drawings of the role LABEL, and notes on what has no room.

    Letters are ``height`` mm high, or less where there is no room, 2 mm at least; they lie inside
    the outline and inside ``net`` (the seam line as a closed contour, if it is another), 0.4
    heights and 0.5 mm at least from these, from holes, drawings, ``obstacles`` and each other,
    and on bend lines and rulings only where they would have to be half as high otherwise.
    """
    plain, notes = _writable(texts)
    room = free_room(pattern, FINE, net=net, obstacles=obstacles)
    strokes: list[Edge] = []
    for name, choices in plain.mates:
        side = _side(net or pattern.outline, name)
        made = _beside(room, side, choices, height) if room else None
        if made is None:
            notes.append(f"the label {choices[0]!r} has no room along {name}")
        else:
            room, lines, note = made
            strokes += lines
            notes += note
    if not any(words.strip() for words in plain.title):
        return replace(pattern, drawings=(*pattern.drawings, *strokes)), tuple(notes)
    block = _block(room, plain, height) if room else None
    if block is None:
        notes.append(f"the label {APART.join(plain.title)!r} has no room")
    else:
        strokes += block[0]
        notes += block[1]
    return replace(pattern, drawings=(*pattern.drawings, *strokes)), tuple(notes)


def _writable(texts: Texts) -> tuple[Texts, list[str]]:
    """The texts with a question mark for each character that has no strokes, and a note."""
    unknown: list[str] = []

    def line(words: str) -> str:
        out = ""
        for character in words:
            try:
                lettering(f"i{character}", LEAST)
            except JobError:
                unknown.append(character)
                out += UNKNOWN
            else:
                out += character
        return out

    made = Texts(
        tuple(map(line, texts.title)),
        tuple(map(line, texts.more)),
        tuple((edge, tuple(map(line, choices))) for edge, choices in texts.mates),
    )
    missing = "".join(dict.fromkeys(unknown))
    return made, [f"the label's characters {missing!r} have no strokes"] if missing else []


def _attempts(room: Room, height: float) -> Iterator[tuple[float, int]]:
    """Heights, the largest first, each with what may be crossed (see :meth:`Room.fit`): rulings
    at first, bend lines too where half the height would cross them."""
    steps = takewhile(lambda one: one > 1.05 * LEAST, (height * SMALLER**k for k in range(64)))
    heights = [*steps, min(height, LEAST)]
    clear = [level for level in room.levels if level < 2]
    for one in heights:
        if one >= HALF * height:
            yield from ((one, level) for level in clear)
    yield from ((one, max(room.levels)) for one in heights)


def _margin(height: float) -> float:
    return max(MARGIN * height, LEAST_MARGIN)


@dataclass(frozen=True, slots=True)
class _Words:
    """Lines of letters 1 mm high and the box around them."""

    edges: tuple[Edge, ...]
    centre: Array
    size: Array

    def placed(self, box: Box, height: float) -> tuple[Edge, ...]:
        """The letters in the middle of a box, along it."""
        cos, sin = height * np.cos(box.angle), height * np.sin(box.angle)
        turn = np.array([[cos, -sin], [sin, cos]])
        shift = box.centre - turn @ self.centre
        return tuple(moved_edge(edge, turn, shift) for edge in self.edges)


def _words(lines: Sequence[str]) -> _Words:
    """Lines one below the other, as LABEL; blank ones are left out."""
    edges: list[Edge] = []
    for k, words in enumerate(line for line in lines if line.strip()):
        down = np.array([0.0, -SPACING * k])
        edges += [
            replace(moved_edge(edge, np.eye(2), down), name=LABEL) for edge in lettering(words, 1.0)
        ]
    points = np.concatenate([sample(edge, 8) for edge in edges])
    low, high = points.min(axis=0), points.max(axis=0)
    return _Words(tuple(edges), 0.5 * (low + high), high - low)


# --- the block -----------------------------------------------------------------------------


def _block(room: Room, texts: Texts, height: float) -> tuple[tuple[Edge, ...], list[str]] | None:
    """The block of a piece and notes on it; None where there is no room at all."""
    title, whole = texts.title, (*texts.title, *texts.more)
    forms = dict.fromkeys([whole, (APART.join(whole),), title, (APART.join(title),)])
    written = [_words(lines) for lines in forms]
    for one, cross in _attempts(room, height):
        for words in written:
            made = _fitted(room, words, one, cross)
            if made is not None:
                return made, _smaller(APART.join(title), one, height)
    return None


def _fitted(room: Room, words: _Words, height: float, cross: int) -> tuple[Edge, ...] | None:
    """The words where they fit best."""
    margin = _margin(height) + room.bound
    box = room.best(*(height * words.size + 2.0 * margin).tolist(), cross=cross)
    if box is None:
        return None
    placed = words.placed(box, height)
    return placed if _inside(room, placed, height) else None


def _inside(room: Room, edges: Sequence[Edge], height: float) -> bool:
    """Whether letters as they are drawn keep their margin from the border."""
    points = np.concatenate([sample(edge, 8) for edge in edges])
    return room.holds(points, (1.0 - 1e-6) * _margin(height))


def _smaller(words: str, height: float, wished: float) -> list[str]:
    if height >= wished:
        return []
    return [f"the label {words!r} is {height:.3g} mm high, not {wished:g}, for want of room"]


# --- along edges ---------------------------------------------------------------------------


def _side(contour: tuple[Edge, ...], name: str) -> Array:
    """The points of a contour's edges of one name, in the order of the run, (n, 2)."""
    points = [sample(edge, PER_PIECE) for edge in contour if edge.name == name]
    return np.concatenate([np.zeros((0, 2)), *points])


def _beside(
    room: Room, side: Array, choices: Sequence[str], height: float
) -> tuple[Room, tuple[Edge, ...], list[str]] | None:
    """The first of some texts along a side, inside of it, what room is left, and notes."""
    written = [(text, _words([text])) for text in choices]
    for one, cross in _attempts(room, height):
        margin = _margin(one) + room.bound
        for text, words in written:
            wide, high = (one * words.size + 2.0 * margin).tolist()
            for box in room.fit(_boxes(side, wide, high), cross=cross):
                placed = words.placed(box, one)
                if _inside(room, placed, one):
                    return room.without(box), placed, _smaller(text, one, height)
    return None


def _boxes(side: Array, width: float, height: float) -> list[Box]:
    """Boxes along a side, on the left of its run, where the sheet is."""
    steps = np.diff(side, axis=0)
    lengths = np.hypot(*steps.T)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    if not len(steps) or at[-1] < width:
        return []
    out = []
    for rise in RISES:
        for share in SHARES:
            k = min(int(np.searchsorted(at, share * at[-1], side="right")) - 1, len(steps) - 1)
            if lengths[k] <= 0.0:
                continue
            way = steps[k] / lengths[k]
            inward = np.array([-way[1], way[0]])
            foot = side[k] + (share * at[-1] - at[k]) * way
            angle = float(upright(np.arctan2(way[1:2], way[:1]))[0])
            centre = foot + ((0.5 + rise) * height + 1e-6) * inward
            out.append(Box(centre, angle, width, height))
    return out
