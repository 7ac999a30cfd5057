"""Draws a part beside the flat sheet that it is bent from, at one scale: samples/lampshade.svg.

usage: python samples/picture.py [JOB.toml]   writes JOB.svg beside the job
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import devcad
from devcad.flatten.pattern import sample
from devcad.geometry.taylor import Array
from devcad.part import Panel

SUN = np.array([-0.45, 0.55, 0.70]) / np.linalg.norm([-0.45, 0.55, 0.70])  # right, up, viewer
FRONT, BACK = (236, 179, 101), (122, 150, 176)  # the sheet's two faces
WIDTH, GAP, MARGIN = 720.0, 30.0, 14.0  # px


def picture(job: Path) -> str:
    """The SVG text: the first panel in space on the left, its pattern on the right."""
    (panel, *_) = devcad.build(job).panels
    quads, normals = facets(panel)
    camera = axes(azimuth=-65.0, elevation=24.0)
    space = quads @ camera.T  # (k, 4, 3): right, up, towards the viewer
    outline = np.concatenate([sample(edge, 64)[:-1] for edge in panel.pattern.outline])
    part_box, flat_box = box(space[..., :2].reshape(-1, 2)), box(outline)
    scale = (WIDTH - 2 * MARGIN - GAP) / (part_box[1][0] + flat_box[1][0])
    height = 2 * MARGIN + scale * max(part_box[1][1], flat_box[1][1])

    def place(points: Array, of: tuple[Array, Array], left: float) -> str:
        """SVG coordinates of points (k, 2) of a drawing that stands at ``left``, centred."""
        low, size = of
        x = left + scale * (points[:, 0] - low[0])
        y = height / 2 + scale * (size[1] / 2 - (points[:, 1] - low[1]))
        return " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(x, y, strict=True))

    right = MARGIN + scale * part_box[1][0] + GAP
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}"'
        f' width="{WIDTH:.0f}" height="{height:.0f}" stroke-linejoin="round">',
        f'<rect width="{WIDTH:.0f}" height="{height:.0f}" rx="8" fill="#fff"/>',
        '<g stroke="#44505c" stroke-width="0.4">',
    ]
    # Farthest first; rounded, so that ties fall the same way on every machine.
    for k in np.lexsort((np.arange(len(space)), np.round(space[..., 2].mean(axis=1), 6))):
        fill = shade(camera @ normals[k])
        lines.append(f'<path d="M{place(space[k, :, :2], part_box, MARGIN)}Z" fill="{fill}"/>')
    lines += [
        "</g>",
        f'<path d="M{place(outline, flat_box, right)}Z" fill="{colour(FRONT)}"'
        ' stroke="#2b333b" stroke-width="1.2"/>',
        '<g stroke="#44505c" stroke-width="0.4">',
        *(
            f'<path d="M{place(np.array([line.start, line.end]), flat_box, right)}"/>'
            for line in panel.pattern.lines
        ),
        "</g>",
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def facets(panel: Panel) -> tuple[Array, Array]:
    """The strips between neighbouring rulings, (k, 4, 3), and the normals n of each, (k, 3)."""
    quads, normals = [], []
    for patch, t in zip(panel.chain.patches, panel.rulings, strict=True):
        frame = patch.frame(t)
        low = frame.c0 + frame.v_from[:, None] * frame.e
        high = frame.c0 + frame.v_to[:, None] * frame.e
        quads.append(np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1))
        normals.append(frame.n[:-1] + frame.n[1:])
    n = np.concatenate(normals)
    return np.concatenate(quads), n / np.linalg.norm(n, axis=1, keepdims=True)


def axes(*, azimuth: float, elevation: float) -> Array:
    """Rows: right, up, towards the viewer; degrees, the azimuth from +x."""
    a, b = np.radians([azimuth, elevation])
    viewer = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(viewer, right), viewer])


def box(points: Array) -> tuple[Array, Array]:
    """The lower left corner and the size of points (k, 2)."""
    low = points.min(axis=0)
    return low, points.max(axis=0) - low


def shade(normal: Array) -> str:
    """The colour of a facet with this normal in the viewer's axes: front or back, lit."""
    seen = normal if normal[2] > 0.0 else -normal
    light = 0.62 + 0.38 * max(float(seen @ SUN), 0.0)
    return colour(tuple(light * c for c in (FRONT if normal[2] > 0.0 else BACK)))


def colour(rgb: tuple[float, ...]) -> str:
    """#rrggbb."""
    return "#" + "".join(f"{round(c):02x}" for c in rgb)


if __name__ == "__main__":
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "lampshade.toml"
    path.with_suffix(".svg").write_text(picture(path))
