"""Sewn-product drawings (ASTM D6673): a block for each piece with its words, corner and curve
points, and a style's words beside it. Text is 7-bit ASCII."""

from __future__ import annotations

import io
import re
import unicodedata
from typing import Any

import numpy as np

from devcad import __version__
from devcad.export.outline import Contours, fitted_strokes
from devcad.export.profile import ANNOTATION, CURVE, OUTER, SEW, TURN, Profile, Role, Style
from devcad.flatten.edges import closes_smoothly, smooth_edges, strokes
from devcad.flatten.pattern import Pattern
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

HEIGHT, SPACING = 5.0, 1.5
"""mm, the height of words, and from one line to the next in heights."""
LONGEST_NAME = 31
"""Characters in the name of a block in R12."""
SAME = 1e-9
"""Of the pattern's size: a vertex as near to a corner of the true contour is that corner."""
ASTM = "ASTM/D13PROPOSAL 1 VERSION: D 6673-10"


def ascii_words(text: str) -> str:
    """The text in 7-bit ASCII, accents dropped, other characters as question marks."""
    plain = unicodedata.normalize("NFKD", text)
    kept = "".join(c for c in plain if not unicodedata.combining(c))
    return re.sub(r"[^ -~]", "?", kept)


def block_name(part: Part, panel: Panel) -> str:
    """The name of a panel's block: letters, digits, - and _, as R12 has them."""
    name = part.name if len(part.panels) == 1 else panel.name
    return re.sub(r"[^A-Za-z0-9_-]", "_", ascii_words(name))[:LONGEST_NAME] or "PIECE"


def add_words(document: Any, block: Any, part: Part, panel: Panel, profile: Profile) -> None:
    """Write what describes the style into the model space and what describes the piece into its
    block, and place the block."""
    x0, y0, x1, y1 = panel.pattern.bbox
    height = min(HEIGHT, 0.02 * max(x1 - x0, y1 - y0))
    style = [
        f"STYLE NAME: {part.name}",
        f"AUTHOR: devcad {__version__}",
        "SAMPLE SIZE: ONE",
        "GRADE RULE TABLE: NONE",
        "UNITS: METRIC",
        f"CURVE TOLERANCE: {profile.chord}",
        "BOUNDARY: CUT LINE",
        ASTM,
    ]
    piece = [
        f"PIECE NAME: {panel.name}",
        "SIZE: ONE",
        f"QUANTITY: {part.quantity}",
        f"MATERIAL: {part.material or 'NONE'}",
    ]
    known = (part.part_number, part.revision and f"REV {part.revision}")
    note = " ".join(word for word in (part.name, panel.name, *known) if word)
    layer = profile.roles[OUTER]
    below = np.array([x0, y0 - SPACING * height])
    _add_lines_of_text(document.modelspace(), style, below, height, layer)
    middle = np.array([0.5 * (x0 + x1), 0.5 * (y0 + y1)])
    _add_lines_of_text(block, piece, middle, height, layer)
    after = middle - [0.0, len(piece) * SPACING * height]
    _add_lines_of_text(block, [note], after, height, profile.roles[ANNOTATION])
    placed = {"layer": layer.layer, "color": layer.colour}
    document.modelspace().add_blockref(block.name, (0.0, 0.0), dxfattribs=placed)


def _add_lines_of_text(space: Any, lines: list[str], at: Array, height: float, role: Role) -> None:
    style = {"layer": role.layer, "color": role.colour}
    for k, words in enumerate(lines):
        text = space.add_text(ascii_words(words), height=height, dxfattribs=style)
        text.dxf.insert = (float(at[0]), float(at[1] - k * SPACING * height), 0.0)


def add_points(space: Any, cuts: Contours, pattern: Pattern, limit: float, how: Style) -> None:
    """A POINT at every vertex of contours and sew lines: turn points at their corners and ends,
    curve points between."""
    for loop, contour in zip(
        (*cuts.holes, cuts.outer), (*pattern.holes, pattern.outline), strict=True
    ):
        edges = smooth_edges(contour)
        starts = [edge.curve(edge.u[:1])[0][0] for edge in edges]
        corners = np.zeros((0, 2)) if closes_smoothly(edges) else np.array(starts)
        _add_points(space, loop.points, corners, how.profile)
    runs = strokes(pattern.drawings)
    for (role, path), stroke in zip(fitted_strokes(pattern, limit, how.curves), runs, strict=True):
        if role == SEW:
            starts = [edge.curve(edge.u[:1])[0][0] for edge in stroke]
            ends = stroke[-1].curve(stroke[-1].u[-1:])[0]
            _add_points(space, path.points, np.concatenate([np.array(starts), ends]), how.profile)


def _add_points(space: Any, points: Array, corners: Array, profile: Profile) -> None:
    size = max(float(np.ptp(points, axis=0).max()), 1e-300)
    away = np.hypot(*(points[:, None] - corners[None]).transpose(2, 0, 1))
    turns = away.min(axis=1, initial=np.inf) <= SAME * size
    for point, turn in zip(points.tolist(), turns.tolist(), strict=True):
        role = profile.roles[TURN if turn else CURVE]
        space.add_point(point, dxfattribs={"layer": role.layer, "color": role.colour})


def minimal(document: Any) -> bytes:
    """The bytes of an R12 drawing with nothing but blocks and entities: readers of this format
    stumble over the blocks of a layout, and over much of a header."""
    from ezdxf.addons import gerber_D6673

    stream = io.StringIO()
    gerber_D6673.export_stream(document, stream)
    return stream.getvalue().encode("ascii")
