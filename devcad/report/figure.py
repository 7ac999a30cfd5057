"""The figure of an analysis: curvature and torsion over the length, and the spherical images.

Plain SVG in ASCII, the same bytes for the same analysis.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import escape

import numpy as np

from devcad.geometry.analysis.analysis import Analysis
from devcad.geometry.analysis.helices import Ratio
from devcad.geometry.analysis.traces import RATIOS
from devcad.geometry.taylor import Array

WIDTH, HEIGHT = 960.0, 800.0  # px
LEFT, RIGHT = 86.0, 936.0  # of the plots
PLOTS = ((92.0, 252.0), (312.0, 472.0))  # top and bottom of each
SPHERES = ((171.0, "T"), (491.0, "N"), (811.0, "B"))  # centre and name of each
BALL, ROW = 112.0, 648.0  # radius of the spheres, and their centres' height

INK, FAINT, GRID = "#2b333b", "#6b7680", "#dde2e6"
CURVATURE, TORSION, AXIS = "#1f5fa8", "#b5461b", "#c2185b"
COLOURS = {"T": "#1f5fa8", "N": "#2e7d32", "B": "#b5461b"}
WORDS = {"T": "tangents", "N": "principal normals", "B": "binormals"}

AZIMUTH, ELEVATION = np.radians(38.0), np.radians(24.0)  # where the spheres are seen from
LEGEND = "directions on the unit sphere; full dot: start, open dot: end, dashed: behind"
TICKS = 5
OUTLIER = 6.0
"""A plot shows up to this times what 19 of 20 samples reach."""
NOTHING = 1e-9
"""Torsion below this share of the curvature is drawn as 0."""


def figure(analysis: Analysis, title: str, subtitle: str) -> str:
    """The text of the SVG file."""
    traces = analysis.traces
    arc, bend, turn = traces.arc, traces.curvature, traces.torsion
    small = NOTHING * np.nanmax(np.abs(bend), initial=0.0)
    turn = np.where(np.abs(turn) <= small, 0.0, turn)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" version="1.1" width="{WIDTH:.0f}"'
        f' height="{HEIGHT:.0f}" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}"'
        ' font-family="Helvetica, Arial, sans-serif" font-size="13">',
        f"<title>{_ascii(title)}</title>",
        f'<rect width="{WIDTH:.0f}" height="{HEIGHT:.0f}" fill="#fff"/>',
        _text(24, 34, title, size=19, weight="bold"),
        _text(24, 57, subtitle, fill=FAINT),
        *_plot(arc, bend, PLOTS[0], "curvature k, 1/mm", CURVATURE),
        *_plot(arc, turn, PLOTS[1], "torsion tau, 1/mm", TORSION),
        _text(RIGHT, PLOTS[1][1] + 34, "length from the start, mm", fill=FAINT, anchor="end"),
        _text(24, PLOTS[1][1] + 34, LEGEND, fill=FAINT),
    ]
    axis = _axis(analysis.ratios)
    for x, name in SPHERES:
        lines += _sphere(x, name, getattr(traces, name), traces.t, axis)
    return "\n".join([*lines, "</svg>", ""])


def _axis(ratios: dict[str, Ratio]) -> Array | None:
    """The axis of the narrowest helix that the curve is."""
    return next((ratios[name].axis for name in RATIOS if ratios[name].constant), None)


# --- plots ---------------------------------------------------------------------------------


def _plot(
    arc: Array, values: Array, rows: tuple[float, float], label: str, colour: str
) -> Iterator[str]:
    """Values over the length, with axes."""
    top, bottom = rows
    low, high, cut = _range(values)
    total = float(arc[-1]) if arc[-1] > 0.0 else 1.0
    x = LEFT + (RIGHT - LEFT) * arc / total
    y = bottom - (bottom - top) * (values - low) / (high - low)
    yield _text(LEFT, top - 10, label, fill=colour, weight="bold")
    if cut:
        yield _text(RIGHT, top - 10, "peaks are cut off", fill=FAINT, anchor="end")
    for tick in _ticks(low, high):
        at = bottom - (bottom - top) * (tick - low) / (high - low)
        stroke = FAINT if tick == 0.0 else GRID
        yield f'<path d="M{LEFT:.1f} {at:.1f}H{RIGHT:.1f}" stroke="{stroke}"/>'
        yield _text(LEFT - 8, at + 4.5, _number(tick), fill=FAINT, anchor="end")
    for tick in _ticks(0.0, total):
        at = LEFT + (RIGHT - LEFT) * tick / total
        yield f'<path d="M{at:.1f} {top:.1f}V{bottom:.1f}" stroke="{GRID}"/>'
        yield _text(at, bottom + 17, _number(tick), fill=FAINT, anchor="middle")
    box = f"M{LEFT:.1f} {top:.1f}H{RIGHT:.1f}V{bottom:.1f}H{LEFT:.1f}Z"
    yield f'<path d="{box}" fill="none" stroke="{FAINT}"/>'
    inside = np.isfinite(y) & (y >= top - 0.5) & (y <= bottom + 0.5)
    joined = np.append(np.diff(arc) > 1e-12 * total, False)
    data = _path(x, np.where(inside, y, np.nan), joined)
    if data:
        yield f'<path d="{data}" fill="none" stroke="{colour}" stroke-width="1.8"/>'
    else:
        middle = 0.5 * (top + bottom)
        yield _text(0.5 * (LEFT + RIGHT), middle, "does not exist", fill=FAINT, anchor="middle")


def _range(values: Array) -> tuple[float, float, bool]:
    """What a plot shows, 0 included, and whether peaks are beyond it."""
    known = values[np.isfinite(values)]
    if not known.any():
        return -1.0, 1.0, False
    size = np.sort(np.abs(known))
    usual = float(size[int(0.95 * (len(size) - 1))])
    limit = OUTLIER * usual if 0.0 < OUTLIER * usual < size[-1] else float(size[-1])
    low, high = max(float(known.min()), -limit), min(float(known.max()), limit)
    margin = 0.06 * (max(high, 0.0) - min(low, 0.0))
    low, high = min(low - margin, 0.0), max(high + margin, 0.0)
    return (low if low < -margin else 0.0), (high if high > margin else 0.0), limit < size[-1]


def _ticks(low: float, high: float) -> list[float]:
    """About five round numbers from low to high."""
    raw = (high - low) / TICKS
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(m for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * (1.0 - 1e-9))
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return [float(k * step) + 0.0 for k in np.arange(first, last + 0.5)]


def _path(x: Array, y: Array, joined: Array) -> str:
    """Path data through the points that are finite, broken where ``joined`` says no."""
    words = []
    pen = False
    for a, b, on in zip(x.tolist(), y.tolist(), joined.tolist(), strict=True):
        if b != b or a != a:
            pen = False
            continue
        words.append(f"{'L' if pen else 'M'}{a + 0.0:.2f} {b + 0.0:.2f}")
        pen = on
    return "".join(words)


# --- spheres -------------------------------------------------------------------------------


def _sphere(x: float, name: str, directions: Array, t: Array, axis: Array | None) -> Iterator[str]:
    """The unit sphere with the curve of directions (n, 3) on it, seen from a fixed place."""
    yield f'<circle cx="{x:.1f}" cy="{ROW:.1f}" r="{BALL:.1f}" fill="#f7f9fa" stroke="{FAINT}"/>'
    yield f'<path d="{_graticule(x)}" fill="none" stroke="{GRID}"/>'
    yield from _axes(x)
    seen = _seen(directions)
    right, up = x + BALL * seen[:, 0], ROW - BALL * seen[:, 1]
    near = np.append(np.linalg.norm(np.diff(directions, axis=0), axis=1) < 0.5, False)
    front = np.where(seen[:, 2] >= 0.0, up, np.nan)
    back = np.where(seen[:, 2] <= 0.0, up, np.nan)
    colour = COLOURS[name]
    if data := _path(right, back, near):
        yield (
            f'<path d="{data}" fill="none" stroke="{colour}" stroke-width="1.2"'
            ' stroke-opacity="0.45" stroke-dasharray="3 3"/>'
        )
    if data := _path(right, front, near):
        yield f'<path d="{data}" fill="none" stroke="{colour}" stroke-width="2"/>'
    known = np.flatnonzero(np.isfinite(up))
    for k, fill in ((known[-1:], "#fff"), (known[:1], colour)):
        yield from (
            f'<circle cx="{right[i]:.2f}" cy="{up[i]:.2f}" r="4" fill="{fill}" stroke="{colour}"'
            ' stroke-width="1.5"/>'
            for i in k
        )
    if axis is not None:
        yield from _cross(x, axis)
    title = f"{name}: {WORDS[name]}" if len(known) else f"{name} does not exist"
    yield _text(x, ROW + BALL + 28, title, fill=colour, weight="bold", anchor="middle")


def _axes(x: float) -> Iterator[str]:
    """Where the axes leave the sphere, and their letters."""
    for letter, end in zip("xyz", np.eye(3), strict=True):
        right, up, _ = (float(place) for place in BALL * _seen(end))
        line = f"M{x + right:.1f} {ROW - up:.1f}L{x + 1.14 * right:.1f} {ROW - 1.14 * up:.1f}"
        yield f'<path d="{line}" stroke="{FAINT}"/>'
        at = x + 1.26 * right, ROW - 1.22 * up + 4.0
        yield _text(*at, letter, fill=FAINT, anchor="middle")


def _seen(directions: Array) -> Array:
    """Right, up and towards the viewer of vectors (..., 3)."""
    sin_a, cos_a = np.sin(AZIMUTH), np.cos(AZIMUTH)
    sin_e, cos_e = np.sin(ELEVATION), np.cos(ELEVATION)
    camera = np.array(
        [
            [-sin_a, cos_a, 0.0],
            [-sin_e * cos_a, -sin_e * sin_a, cos_e],
            [cos_e * cos_a, cos_e * sin_a, sin_e],
        ]
    )
    return np.asarray(directions @ camera.T)


def _graticule(x: float) -> str:
    """Parallels and meridians every 30 degrees, the front of them."""
    turn = np.radians(np.arange(0.0, 361.0, 5.0))
    rings = []
    for angle in np.radians(np.arange(-60.0, 61.0, 30.0)):
        height = np.full(len(turn), np.sin(angle))
        ring = np.cos(angle) * np.array([np.cos(turn), np.sin(turn)])
        rings.append(np.column_stack([*ring, height]))
    for angle in np.radians(np.arange(0.0, 180.0, 30.0)):
        rings.append(
            np.column_stack(
                [np.cos(turn) * np.cos(angle), np.cos(turn) * np.sin(angle), np.sin(turn)]
            )
        )
    words = []
    for ring in rings:
        seen = _seen(ring)
        up = np.where(seen[:, 2] >= 0.0, ROW - BALL * seen[:, 1], np.nan)
        words.append(_path(x + BALL * seen[:, 0], up, np.ones(len(ring), dtype=bool)))
    return "".join(words)


def _cross(x: float, axis: Array) -> Iterator[str]:
    """The axis of a helix, on the side that is seen."""
    seen = _seen(axis)
    seen = seen if seen[2] >= 0.0 else -seen
    right, up = x + BALL * float(seen[0]), ROW - BALL * float(seen[1])
    yield (
        f'<path d="M{right - 5:.2f} {up:.2f}h10M{right:.2f} {up - 5:.2f}v10" stroke="{AXIS}"'
        ' stroke-width="2"/>'
    )
    yield _text(right + 8, up - 6, "axis", fill=AXIS)


# --- words ---------------------------------------------------------------------------------


def _text(
    x: float,
    y: float,
    words: str,
    *,
    fill: str = INK,
    size: int = 13,
    weight: str = "normal",
    anchor: str = "start",
) -> str:
    style = "" if weight == "normal" else f' font-weight="{weight}"'
    style += "" if size == 13 else f' font-size="{size}"'
    style += "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{fill}"{style}>{_ascii(words)}</text>'


def _number(value: float) -> str:
    return f"{value:.6g}"


def _ascii(words: str) -> str:
    return escape(words.encode("ascii", "backslashreplace").decode("ascii"))
