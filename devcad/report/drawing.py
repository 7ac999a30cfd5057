"""The patterns of a part side by side, as SVG that a page shows: layers, rulings, dimensions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape

import numpy as np

from devcad.export.folding import pattern_shifts
from devcad.export.outline import hole_role
from devcad.export.profile import INNER, OUTER
from devcad.flatten.pattern import Edge, Pattern
from devcad.geometry.taylor import Array
from devcad.part import Part
from devcad.report.pieces import Piece

FINEST = 1 / 5000
"""How far a drawn line may be from its curve, as a share of the drawing: less than a pixel."""
COARSE, MOST = 8, 256  # steps of a piece of a curve: to look at it, and to draw it
TEXT = 0.022  # the height of a dimension, of the drawing's diagonal
RULINGS = "rulings"
DIMENSIONS = "dimensions"
HIDDEN = {RULINGS: ' hidden=""'}
"""Layers that are not shown at first."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a pattern on its layer, as points (n, 2) in mm; a contour is ``closed``."""

    layer: str
    points: Array
    closed: bool = False


def lines_of(part: Part) -> list[list[Line]]:
    """Of each panel the lines of its pattern in its own coordinates, as polygons within a fifth of
    a thousandth of the drawing: to be looked at, not to be cut."""
    box = np.array([panel.pattern.bbox for panel in part.panels])
    size = float(np.hypot(*(box[:, 2:] - box[:, :2]).max(axis=0))) or 1.0
    return [list(_lines(panel.pattern, FINEST * size)) for panel in part.panels]


def drawing(
    part: Part, pieces: list[Piece | None], lines: list[list[Line]]
) -> tuple[str, list[str]]:
    """The SVG element with all patterns, and its layers in their order.

    One user unit is 1 mm, y points down: the pattern's point (X, Y) lies at (X + dx, -(Y + dy))
    with the panel's ``pattern_shifts``. Layers are groups with ``data-layer``; lines have the
    class of their layer. ``lines`` are those of :func:`lines_of`.
    """
    shifts = [np.array(shift) for shift in pattern_shifts(part)]
    boxes = [
        np.array(panel.pattern.bbox).reshape(2, 2) + shift
        for panel, shift in zip(part.panels, shifts, strict=True)
    ]
    low = np.min([box[0] for box in boxes], axis=0)
    high = np.max([box[1] for box in boxes], axis=0)
    size = float(np.hypot(*(high - low))) or 1.0
    layers: dict[str, list[str]] = {RULINGS: []}
    for piece, shift, drawn in zip(pieces, shifts, lines, strict=True):
        for strip in piece.strips if piece else ():
            ends = (strip.pattern + shift).swapaxes(0, 1)
            layers[RULINGS].append("".join(map(_polygon, ends)))
        for line in drawn:
            data = _polygon(line.points + shift) + ("Z" if line.closed else "")
            layers.setdefault(line.layer, []).append(data)
    text = TEXT * size
    room = 3.2 * text
    x, y = low[0] - room, -high[1] - 0.6 * text
    width, height = high[0] - low[0] + room + 0.6 * text, high[1] - low[1] + room + 0.6 * text
    names = _ordered(layers)
    out = [
        f'<svg id="drawing" xmlns="http://www.w3.org/2000/svg" role="img" tabindex="0" viewBox="'
        f'{_number(x)} {_number(y)} {_number(width)} {_number(height)}">',
        f"<title>{escape(f'Flat pattern of {part.name}')}</title>",
        *(
            f'<g data-layer="{escape(name)}"{HIDDEN.get(name, "")}>'
            f'<path class="line {escape(name)}" '
            f'd="{"".join(layers[name])}"/></g>'
            for name in names
        ),
        f'<g data-layer="{DIMENSIONS}" class="dimension" font-size="{_number(text)}">',
        *_dimensions(low, high, text),
    ]
    if len(part.panels) > 1:
        for panel, box in zip(part.panels, boxes, strict=True):
            at = box.mean(axis=0)
            out.append(_label(panel.name, float(at[0]), -float(at[1])))
    out += ["</g>", '<line id="ruling" class="chosen" hidden=""/>', "</svg>"]
    return "\n".join(out), [*names, DIMENSIONS]


def _ordered(layers: dict[str, list[str]]) -> list[str]:
    """The layers that hold something: rulings first, so that they lie below, cuts last."""
    last = [name for name in (INNER, OUTER) if name in layers]
    return [name for name in layers if layers[name] and name not in last] + last


def _lines(pattern: Pattern, finest: float) -> Iterator[Line]:
    yield Line(OUTER, _loop(pattern.outline, finest), closed=True)
    for hole in pattern.holes:
        yield Line(hole_role(hole), _loop(hole, finest), closed=True)
    for line in pattern.lines:
        yield Line(line.layer, np.stack([line.start, line.end]))
    for edge in pattern.drawings:
        yield Line(edge.name, traced(edge, finest))


def _loop(edges: tuple[Edge, ...], finest: float) -> Array:
    return np.concatenate([traced(edge, finest)[:-1] for edge in edges])


def traced(edge: Edge, finest: float) -> Array:
    """Points along an edge whose chords keep to it within ``finest`` mm, about."""
    share = np.linspace(0.0, 1.0, COARSE + 1)
    u = edge.u[:-1, None] + np.diff(edge.u)[:, None] * share
    points = edge.curve(u.ravel())[0].reshape(len(u), COARSE + 1, 2)
    chord = points[:, -1:] - points[:, :1]
    away = points - points[:, :1]
    square = np.maximum((chord**2).sum(axis=2), 1e-30)
    foot = ((away * chord).sum(axis=2) / square).clip(0.0, 1.0)
    rise = np.hypot(*np.moveaxis(away - foot[..., None] * chord, 2, 0))  # a closed piece has too
    # the rise of a chord falls with the square of its length
    steps = np.sqrt(rise.max(axis=1) / finest).clip(1, MOST)
    steps = 2 ** np.ceil(np.log2(steps)).astype(int)
    parts = []
    for k, n in enumerate(steps.tolist()):  # most pieces need no more points than there are
        if n <= COARSE:
            parts.append(points[k, : -1 : COARSE // n])
        else:
            u_k = np.linspace(edge.u[k], edge.u[k + 1], n, endpoint=False)
            parts.append(edge.curve(u_k)[0])
    return np.concatenate([*parts, points[-1, -1:]])


def _dimensions(low: Array, high: Array, text: float) -> Iterator[str]:
    """The width below the patterns, the height to the left of them."""
    x0, x1, y0, y1 = low[0], high[0], -low[1], -high[1]
    below, left = y0 + 1.4 * text, x0 - 1.4 * text
    tick = 0.4 * text
    yield (
        f'<path class="line" d="{_run([(x0, below), (x1, below)])}'
        f"{_run([(x0, below - tick), (x0, below + tick)])}"
        f"{_run([(x1, below - tick), (x1, below + tick)])}"
        f"{_run([(left, y0), (left, y1)])}"
        f"{_run([(left - tick, y0), (left + tick, y0)])}"
        f'{_run([(left - tick, y1), (left + tick, y1)])}"/>'
    )
    yield _label(f"{high[0] - low[0]:.2f} mm", 0.5 * (x0 + x1), below + 1.2 * text)
    x, y = left - 0.5 * text, 0.5 * (y0 + y1)
    turned = f' transform="rotate(-90 {_number(x)} {_number(y)})"'
    yield _label(f"{high[1] - low[1]:.2f} mm", x, y, turned)


def _label(words: str, x: float, y: float, turned: str = "") -> str:
    """Words, their middle at a place of the drawing."""
    place = f'x="{_number(x)}" y="{_number(y)}"'
    return f'<text {place} text-anchor="middle"{turned}>{escape(words)}</text>'


def _polygon(points: Array) -> str:
    """An open run through points of the pattern."""
    return _run([(x, -y) for x, y in points.tolist()])


def _run(points: list[tuple[float, float]]) -> str:
    """Path data through points of the drawing."""
    return "M" + "L".join(f"{_number(x)} {_number(y)}" for x, y in points)


def _number(x: float) -> str:
    """mm to a hundredth, as short as it can be written."""
    text = f"{x:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
