"""A part beside the flat sheet that it is bent from, as one SVG without a script."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np

from devcad.export.folding import pattern_shifts
from devcad.flatten.flanks import SCORE
from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.hinged import Hinged
from devcad.mesh.lodged import Sheet, edges
from devcad.part import Part
from devcad.report.drawing import Line
from devcad.report.pieces import Piece

SUN = np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])  # right, up, viewer
FRONT, BACK = np.array([236, 179, 101]), np.array([122, 150, 176])  # the sheet's two faces
SHADE = 0.62  # the light that a face turned away from the sun has
WIDTH, TALLEST, GAP, MARGIN = 720.0, 520.0, 30.0, 14.0  # px
SCORED = ' stroke="#2e9e4f" stroke-dasharray="9 4"'
AZIMUTH, ELEVATION = -65.0, 24.0
NEARER = 0.03  # of the part: what puts a ruling before the faces beside it
MOST = 6000
"""Triangles that a picture shows: of a part with more, only the patterns."""
FRAMES, SECONDS = 16, 4.0
"""Pictures of a moving one, and how long it takes there and back."""

_Seen = tuple[Array, list[str], Array]
"""Triangles (m, 3, 3) as the camera sees them, their colours, rulings (k, 2, 3)."""


def part_picture(
    part: Part, pieces: list[Piece | None], lines: list[list[Line]], f: float = 0.0
) -> str:
    """The SVG text: on the left the part unrolled by f (0 as built, 1 flat), on the right its
    patterns, at one scale. ``pieces`` are what is shown of the panels, ``lines`` those of their
    patterns. Farther faces are drawn first, which is right wherever faces do not reach through one
    another."""
    shifts = pattern_shifts(part)
    seen = _stages(part, pieces, [f])[0]
    outlines = [
        [line.points + shift for line in drawn if line.closed]
        for drawn, shift in zip(lines, shifts, strict=True)
    ]
    scores = [
        line.points + shift
        for drawn, shift in zip(lines, shifts, strict=True)
        for line in drawn
        if line.layer == SCORE
    ]
    part_box = _box([points for points, *_ in seen])
    flat_box = _box([loop for loops in outlines for loop in loops])
    wide, tall = part_box[1][0] + flat_box[1][0], max(part_box[1][1], flat_box[1][1])
    scale = min((WIDTH - 2 * MARGIN - GAP) / wide, (TALLEST - 2 * MARGIN) / tall)
    height = 2 * MARGIN + scale * tall
    flat = _Place(flat_box, scale, MARGIN + scale * part_box[1][0] + GAP, height)
    outline = ["".join(f"{flat(loop)}Z" for loop in loops) for loops in outlines]
    return _document(
        f"{part.name} and its flat pattern",
        height,
        [
            *_faces(seen, _Place(part_box, scale, MARGIN, height)),
            "</g>",
            f'<g fill="{_colour(FRONT)}" fill-rule="evenodd" stroke="#2b333b" stroke-width="1.2">',
            *(f'<path d="{data}"/>' for data in outline),
            *(f'<path d="{flat(line)}" fill="none"{SCORED}/>' for line in scores),
        ],
    )


def moving_picture(part: Part, pieces: list[Piece | None]) -> str:
    """The SVG text of the part that unrolls and closes again, without a script: ``FRAMES`` pictures
    of it, each shown in its time."""
    turns = np.pi * np.arange(FRAMES) / (FRAMES - 1)
    stages = _stages(part, pieces, (0.5 - 0.5 * np.cos(turns)).tolist())
    box = _box([points for seen in stages for points, *_ in seen])
    scale = min((WIDTH - 2 * MARGIN) / box[1][0], (TALLEST - 2 * MARGIN) / box[1][1])
    height = 2 * MARGIN + scale * box[1][1]
    place = _Place(box, scale, 0.5 * (WIDTH - scale * box[1][0]), height)
    body: list[str] = []
    for k, seen in enumerate(stages):
        body += [
            f'<g display="{"none" if k else "inline"}">{_shown(k)}',
            *_faces(seen, place),
            "</g>",
        ]
    return _document(f"{part.name} unrolls", height, body)


def _shown(k: int) -> str:
    """The animation of picture k, shown in step k and, on the way back, 2 FRAMES - 1 - k."""
    steps, values = (
        [0, k, k + 1, 2 * FRAMES - 1 - k, 2 * FRAMES - k],
        "none;inline;none;inline;none",
    )
    if k == 0:
        steps, values = steps[1:-1], "inline;none;inline"
    times = ";".join(f"{step / (2 * FRAMES):.6g}" for step in steps)
    return (
        f'<animate attributeName="display" dur="{SECONDS:g}s" repeatCount="indefinite"'
        f' calcMode="discrete" values="{values}" keyTimes="{times}"/>'
    )


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a drawing of a ``box`` stands: px per mm, its left side, the picture's height."""

    box: tuple[Array, Array]
    scale: float
    left: float
    height: float

    def __call__(self, points: Array) -> str:
        """The path of points (k, 2), the drawing in the middle of the height."""
        low, extent = self.box
        x = self.left + self.scale * (points[:, 0] - low[0])
        y = self.height / 2 + self.scale * (extent[1] / 2 - (points[:, 1] - low[1]))
        pairs = zip(x.tolist(), y.tolist(), strict=True)
        return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in pairs)


def _document(title: str, height: float, body: list[str]) -> str:
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}"'
            f' width="{WIDTH:.0f}" height="{height:.0f}" role="img">',
            f"<title>{escape(title)}</title>",
            f'<rect width="{WIDTH:.0f}" height="{height:.0f}" rx="8" fill="#fff"/>',
            # faces have strokes of their colour, or what lies behind would shine through the joints
            '<g stroke-width="0.9" stroke-linejoin="round" fill="none" stroke="#44505c">',
            *body,
            "</g>",
            "</svg>",
        ]
    )


def _stages(part: Part, pieces: list[Piece | None], stages: list[float]) -> list[list[_Seen]]:
    """What the camera sees of each panel, unrolled by each of ``stages``."""
    shifts = pattern_shifts(part)
    there = [(piece, shift) for piece, shift in zip(pieces, shifts, strict=True) if piece]
    small = sum(len(sheet.triangles) for piece, _ in there for sheet in piece.sheets) <= MOST
    camera = _axes(AZIMUTH, ELEVATION)
    return [
        [
            _seen(strip, sheet, points @ camera.T)
            for piece, shift in there
            for strip, sheet, points in zip(
                piece.strips, piece.sheets, piece.points(f, shift), strict=True
            )
        ]
        if small
        else []
        for f in stages
    ]


def _faces(panels: list[_Seen], place: _Place) -> list[str]:
    """The paths of faces and rulings, the farthest first."""
    size = float(np.abs(place.box[1]).max())
    items: list[tuple[float, str]] = []
    for points, fills, rulings in panels:
        depth = points[..., 2].mean(axis=1)
        near = rulings[..., 2].mean(axis=1) + NEARER * size
        for z, face, fill in zip(depth.tolist(), points[..., :2], fills, strict=True):
            items.append((z, f'<path d="{place(face)}Z" fill="{fill}" stroke="{fill}"/>'))
        for z, line in zip(near.tolist(), rulings[..., :2], strict=True):
            items.append((z, f'<path d="{place(line)}" stroke-width=".4"/>'))
    # rounded, so that ties fall the same way on every machine
    return [text for _, text in sorted(items, key=lambda item: round(item[0], 6))]


def _seen(strip: Hinged, sheet: Sheet, points: Array) -> _Seen:
    """A sheet whose points (n, 3) are there, as the camera sees them."""
    corner = points[sheet.triangles]
    normal = rows_cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    front = normal[:, 2:] > 0.0
    light = SHADE + (1.0 - SHADE) * np.maximum(np.where(front, normal, -normal) @ SUN, 0.0)
    fills = np.where(front, FRONT, BACK) * light[:, None]
    return corner, [_colour(fill) for fill in fills], points[edges(strip, sheet)[0]]


def _axes(azimuth: float, elevation: float) -> Array:
    """Rows: right, up, towards the viewer; degrees, the azimuth from +x."""
    a, b = np.radians([azimuth, elevation])
    viewer = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(viewer, right), viewer])


def _box(groups: list[Array]) -> tuple[Array, Array]:
    """The lower left corner and the size of points (..., 2 or more); nothing has none."""
    points = np.concatenate(
        [np.zeros((0, 2)), *(g.reshape(-1, g.shape[-1])[:, :2] for g in groups)]
    )
    if not len(points):
        return np.zeros(2), np.zeros(2)
    low = points.min(axis=0)
    return low, points.max(axis=0) - low


def _colour(rgb: Array) -> str:
    """#rrggbb."""
    return "#" + "".join(f"{round(c):02x}" for c in rgb.tolist())
