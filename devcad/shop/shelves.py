"""Rectangles on sheets, shelf upon shelf: the packing that always succeeds.

First fit, decreasing height: Lodi, Martello, Monaci, Two-dimensional packing problems, 2002.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Box = tuple[float, float]
"""Width and height, mm."""
ROUNDING = 1e-9
"""mm; a box that is larger by as much still fits."""


@dataclass(frozen=True, slots=True)
class Shelved:
    """Where a box stands: its sheet from 0, which of its forms, its lower left corner in mm."""

    sheet: int
    form: int
    left: float
    bottom: float


@dataclass
class _Shelf:
    """A row of boxes; ``used`` is where the next one begins."""

    sheet: int
    bottom: float
    height: float
    used: float = 0.0


def fits(box: Box, size: Box) -> bool:
    """Whether a box fits into a rectangle as it stands."""
    return box[0] <= size[0] + ROUNDING and box[1] <= size[1] + ROUNDING


def shelve(boxes: Sequence[Sequence[Box | None]], size: Box, gap: float) -> list[Shelved]:
    """Boxes on sheets of ``size`` (mm), ``gap`` apart, in the order in which they were given.

    Each box may stand in one of several forms, None where that is forbidden; one of them must fit
    on a sheet. The lower left corner of a sheet is (0, 0).
    """
    usable = [
        [k for k, form in enumerate(forms) if form is not None and fits(form, size)]
        for forms in boxes
    ]
    lowest = [min(((boxes[i][k] or size)[1], k) for k in forms) for i, forms in enumerate(usable)]
    order = sorted(range(len(boxes)), key=lambda i: (-lowest[i][0], i))
    shelves: list[_Shelf] = []
    tops: list[float] = []  # of each sheet
    out: dict[int, Shelved] = {}
    for i in order:
        forms = [(k, boxes[i][k] or size) for k in usable[i]]
        found = _room(forms, shelves, size)
        if found is None:
            k, box = lowest[i][1], boxes[i][lowest[i][1]] or size
            sheet = next(
                (s for s, top in enumerate(tops) if top + box[1] <= size[1] + ROUNDING), len(tops)
            )
            if sheet == len(tops):
                tops.append(0.0)
            found = _Shelf(sheet, tops[sheet], box[1]), k, box
            shelves.append(found[0])
            tops[sheet] += box[1] + gap
        shelf, k, box = found
        out[i] = Shelved(shelf.sheet, k, shelf.used, shelf.bottom)
        shelf.used += box[0] + gap
    return [out[i] for i in range(len(boxes))]


def _room(
    forms: list[tuple[int, Box]], shelves: list[_Shelf], size: Box
) -> tuple[_Shelf, int, Box] | None:
    """The first shelf with room for one of the forms, and the narrowest that it has room for."""
    for shelf in shelves:
        room = (size[0] - shelf.used, shelf.height)
        able = [(box[0], k, box) for k, box in forms if fits(box, room)]
        if able:
            _, k, box = min(able)
            return shelf, k, box
    return None
