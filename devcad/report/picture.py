"""A part beside the flat sheet that it is bent from, as one SVG without a script."""

from __future__ import annotations

from html import escape

import numpy as np

from devcad.export.folding import pattern_shifts
from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.hinged import Hinged, motions, moved
from devcad.mesh.lodged import Sheet, edges
from devcad.part import Part
from devcad.report.data import Piece
from devcad.report.drawing import Line

SUN = np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])  # right, up, viewer
FRONT, BACK = np.array([236, 179, 101]), np.array([122, 150, 176])  # the sheet's two faces
SHADE = 0.62  # the light that a face turned away from the sun has
WIDTH, TALLEST, GAP, MARGIN = 720.0, 520.0, 30.0, 14.0  # px
AZIMUTH, ELEVATION = -65.0, 24.0
NEARER = 0.004  # of the part: what puts a ruling before the faces beside it
MOST = 6000
"""Triangles that a picture shows: of a part with more, only the patterns."""


def part_picture(
    part: Part, pieces: list[Piece | None], lines: list[list[Line]], f: float = 0.0
) -> str:
    """The SVG text: on the left the part unrolled by f (0 as built, 1 flat), on the right its
    patterns, at one scale. ``pieces`` are the panels' strips and sheets, ``lines`` those of their
    patterns. Farther faces are drawn first, which is right wherever faces do not reach through one
    another."""
    shifts = pattern_shifts(part)
    there = [(*piece, shift) for piece, shift in zip(pieces, shifts, strict=True) if piece]
    camera = _axes(AZIMUTH, ELEVATION)
    small = sum(len(sheet.triangles) for _, sheet, _ in there) <= MOST
    seen = [_seen(*each, f, camera) for each in there] if small else []
    corners = [points.reshape(-1, 3)[:, :2] for points, *_ in seen]
    outlines = [
        [line.points + shift for line in drawn if line.closed]
        for drawn, shift in zip(lines, shifts, strict=True)
    ]
    part_box = _box(np.concatenate(corners)) if corners else (np.zeros(2), np.zeros(2))
    flat_box = _box(np.concatenate([loop for loops in outlines for loop in loops]))
    wide, tall = part_box[1][0] + flat_box[1][0], max(part_box[1][1], flat_box[1][1])
    scale = min((WIDTH - 2 * MARGIN - GAP) / wide, (TALLEST - 2 * MARGIN) / tall)
    height = 2 * MARGIN + scale * tall

    def placed(points: Array, box: tuple[Array, Array], left: float) -> str:
        """SVG coordinates of points (k, 2) of a drawing that stands at ``left``, centred."""
        low, extent = box
        x = left + scale * (points[:, 0] - low[0])
        y = height / 2 + scale * (extent[1] / 2 - (points[:, 1] - low[1]))
        pairs = zip(x.tolist(), y.tolist(), strict=True)
        return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in pairs)

    items: list[tuple[float, str]] = []
    for points, fills, rulings in seen:
        depth = points[..., 2].mean(axis=1)
        near = rulings[..., 2].mean(axis=1) + NEARER * float(np.abs(part_box[1]).max())
        for z, face, fill in zip(depth.tolist(), points[..., :2], fills, strict=True):
            data = placed(face, part_box, MARGIN)
            items.append((z, f'<path d="{data}Z" fill="{fill}" stroke="{fill}"/>'))
        for z, line in zip(near.tolist(), rulings[..., :2], strict=True):
            items.append((z, f'<path d="{placed(line, part_box, MARGIN)}"/>'))
    # rounded, so that ties fall the same way on every machine
    items.sort(key=lambda item: round(item[0], 6))
    right = MARGIN + scale * part_box[1][0] + GAP
    flat = ["".join(f"{placed(loop, flat_box, right)}Z" for loop in loops) for loops in outlines]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}"'
            f' width="{WIDTH:.0f}" height="{height:.0f}" role="img">',
            f"<title>{escape(part.name)} and its flat pattern</title>",
            f'<rect width="{WIDTH:.0f}" height="{height:.0f}" rx="8" fill="#fff"/>',
            '<g stroke-width="0.4" stroke-linejoin="round" fill="none" stroke="#44505c">',
            *(text for _, text in items),
            "</g>",
            f'<g fill="{_colour(FRONT)}" fill-rule="evenodd" stroke="#2b333b" stroke-width="1.2">',
            *(f'<path d="{data}"/>' for data in flat),
            "</g>",
            "</svg>",
        ]
    )


def _seen(
    strip: Hinged, sheet: Sheet, shift: tuple[float, float], f: float, camera: Array
) -> tuple[Array, list[str], Array]:
    """The triangles (m, 3, 3) of a panel as the camera sees them, their colours, and its rulings
    (k, 2, 3)."""
    points = moved(motions(strip, f, shift)[sheet.body], sheet.flat) @ camera.T
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


def _box(points: Array) -> tuple[Array, Array]:
    """The lower left corner and the size of points (k, 2)."""
    low = points.min(axis=0)
    return low, points.max(axis=0) - low


def _colour(rgb: Array) -> str:
    """#rrggbb."""
    return "#" + "".join(f"{round(c):02x}" for c in rgb.tolist())
