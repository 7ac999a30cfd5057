"""The figure of a motion: poses in the cross-section, and what the links do over the input's turn.

Plain SVG in ASCII, one user unit a millimetre of paper, the same bytes for the same motion.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator

import numpy as np

from devcad.export.motionplots import COLOURS, FAINT, INK, RING, ascii_only, plots, text
from devcad.export.svgpaths import NAMESPACE
from devcad.geometry.taylor import Array
from devcad.simulate.bodies import Arc, Complex
from devcad.simulate.drives import FourBarDrive, RingDrive
from devcad.simulate.fourbar import grashof
from devcad.simulate.motion import Motion, Track, track

WIDTH, HEIGHT = 260.0, 206.0  # mm
BOX = (8.0, 26.0, 122.0, 138.0)  # left, top, right, bottom of the cross-section
WORDS = 146.0  # top of the words under the cross-section
SAMPLES = 361
LARGER = 3.0
"""A cylinder whose radius is more than that many times as large as its links is not all shown."""


def figure(found: Motion, title: str) -> str:
    """The text of the SVG file of a motion of one degree of freedom."""
    low, high = found.stretch()
    turn = np.linspace(low, high, SAMPLES) if high > low else np.zeros(2)
    seen = track(found, turn)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="{NAMESPACE}" version="1.1" width="{WIDTH:g}mm" height="{HEIGHT:g}mm"'
        f' viewBox="0 0 {WIDTH:g} {HEIGHT:g}" font-family="Helvetica, Arial, sans-serif"'
        ' font-size="3.2">',
        f"<title>{ascii_only(title)}: motion</title>",
        f'<rect width="{WIDTH:g}" height="{HEIGHT:g}" fill="#fff"/>',
        text(8, 9, title, size=5.2, weight="bold"),
        text(8, 15, _subtitle(found), fill=FAINT),
        *_section(found),
        *_words(found),
    ]
    return "\n".join([*lines, *plots(found, seen), "</svg>", ""])


def _subtitle(found: Motion) -> str:
    radius = f"cylinder of radius {found.linkage.radius:.6g} mm"
    if isinstance(found.drive, FourBarDrive):
        lengths = " / ".join(f"{length:.5g}" for length in found.drive.bar.lengths)
        kind = grashof(found.drive.bar).kind
        return f"{kind}, {radius}; ground / input / coupler / output {lengths} mm"
    return f"ring of {len(found.arcs)} links, {radius}, symmetric motion"


# --- the cross-section ----------------------------------------------------------------------


def _section(found: Motion) -> Iterator[str]:
    """The reference cylinder and the links in some poses; the conformal one is drawn strong."""
    turns, shown = _shown(found)
    poses = track(found, turns)
    middle, scale = _scale(found, poses)
    left, top, right, bottom = BOX
    centre = (0.5 * (left + right), 0.5 * (top + bottom))

    def place(point: complex) -> tuple[float, float]:
        away = (point - middle) * scale
        return centre[0] + away.real, centre[1] - away.imag

    yield text(left, top - 2, "cross-section, seen from the tip of the axis", weight="bold")
    yield from _cylinder(*place(0.0), found.linkage.radius * scale)
    order = sorted(range(len(turns)), key=lambda k: shown[k] == 1.0)
    for k in order:
        yield f'<g fill="none" stroke-opacity="{shown[k]:g}" fill-opacity="{shown[k]:g}">'
        for number, arc, width in _layered(found):
            turn, shift = float(poses.turns[k, number]), complex(poses.shifts[k, number])
            (x0, y0), (x1, y1) = (place(end) for end in _ends(arc, turn, shift))
            radius, flag = arc.radius * scale, int(arc.sweep < 0.0)  # y points down
            yield (
                f'<path d="M{x0:.3f} {y0:.3f}A{radius:.3f} {radius:.3f} 0 0 {flag} {x1:.3f}'
                f' {y1:.3f}" stroke="{_colour(found, number)}" stroke-linecap="round"'
                f' stroke-width="{width if shown[k] == 1.0 else 0.7:g}"/>'
            )
        for joint in poses.joints[k].tolist():
            x, y = place(joint)
            yield (
                f'<circle cx="{x:.3f}" cy="{y:.3f}" r="0.9" fill="#fff" stroke="{INK}"'
                ' stroke-width="0.25"/>'
            )
        yield "</g>"
    yield from _bar(scale)


def _cylinder(x: float, y: float, radius: float) -> Iterator[str]:
    """The reference cylinder, cut off at the box where it is larger."""
    left, top, right, bottom = BOX
    cut = ""
    if 2.0 * radius > right - left:
        box = f'x="{left:g}" y="{top:g}" width="{right - left:g}" height="{bottom - top - 6.0:g}"'
        yield f'<clipPath id="section"><rect {box}/></clipPath>'
        cut = ' clip-path="url(#section)"'
    yield (
        f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{radius:.3f}" fill="none"'
        f' stroke="{FAINT}" stroke-width="0.2" stroke-dasharray="2 1.2"{cut}/>'
    )


def _shown(found: Motion) -> tuple[Array, list[float]]:
    """The turns whose poses are drawn, and how strong: the conformal pose last."""
    low, high = found.stretch()
    if isinstance(found.drive, RingDrive):  # turned back, it is the same with its joints exchanged
        turns = np.array([x for x in (0.5 * high, high) if abs(x) > 1e-9])
    elif found.whole:
        turns = np.linspace(0.0, 2.0 * math.pi, 6, endpoint=False)[1:]
    else:
        turns = np.array([x for x in (low, 0.5 * low, 0.5 * high, high) if abs(x) > 1e-9])
    strength = [0.45 if x in (low, high) else 0.25 for x in turns.tolist()]
    return np.append(turns, 0.0), [*strength, 1.0]


def _scale(found: Motion, poses: Track) -> tuple[complex, float]:
    """The middle of what is drawn, and mm of paper a mm. Of a cylinder much larger than its links
    only the part near to them."""
    points: list[Complex] = []
    for k, arc in enumerate(found.arcs):
        along = arc.start + arc.sweep * np.linspace(0.0, 1.0, 13)
        turned = np.exp(1j * (poses.turns[:, k, None] + along))
        points.append((poses.shifts[:, k, None] + arc.radius * turned).ravel())
    low, high = _box(points)
    if max((high - low).real, (high - low).imag) * LARGER > found.linkage.radius:
        round_it = found.linkage.radius * np.exp(0.5j * np.pi * np.arange(4))
        low, high = _box([*points, round_it])
    size = high - low
    left, top, right, bottom = BOX
    return 0.5 * (low + high), min(
        (right - left - 4.0) / size.real, (bottom - top - 12.0) / size.imag
    )


def _box(points: list[Complex]) -> tuple[complex, complex]:
    """The corners of the box about points."""
    every = np.concatenate(points)
    return (
        complex(every.real.min(), every.imag.min()),
        complex(every.real.max(), every.imag.max()),
    )


def _layered(found: Motion) -> list[tuple[int, Arc, float]]:
    """The links in the order of drawing with the widths of their strokes: where links cover one
    another the ground comes first and is the widest, so that all are seen."""
    numbered = list(enumerate(found.arcs))
    if found.linkage.branch != "crossed":
        return [(k, arc, 1.1) for k, arc in numbered]
    last = len(numbered) - 1
    return [(k, arc, 0.8 + 0.6 * k) for k, arc in sorted(numbered, key=lambda pair: last - pair[0])]


def _ends(arc: Arc, turn: float, shift: complex) -> tuple[complex, complex]:
    """Where a link's arc begins and ends in a pose."""
    start, end = (
        shift + arc.radius * cmath.exp(1j * (arc.start + part * arc.sweep + turn))
        for part in (0.0, 1.0)
    )
    return start, end


def _colour(found: Motion, number: int) -> str:
    return COLOURS.get(found.linkage.links[number].name, RING[number % 2])


def _bar(scale: float) -> Iterator[str]:
    """A bar with its length in the mechanism's mm."""
    length = _round(24.0 / scale)
    left, bottom = BOX[0], BOX[3]
    yield (
        f'<path d="M{left:.2f} {bottom - 1.2:.2f}v1.2h{length * scale:.3f}v-1.2" fill="none"'
        f' stroke="{FAINT}" stroke-width="0.3"/>'
    )
    yield text(left + length * scale + 2, bottom, f"{length:g} mm", FAINT)


def _round(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(m for m in (1.0, 2.0, 5.0) if m * power <= value * (1 + 1e-9)) * power:g}")


# --- words ----------------------------------------------------------------------------------


def _words(found: Motion) -> Iterator[str]:
    """The legend of the links, and what is found."""
    x = BOX[0]
    names = [link.name for link in found.linkage.links]
    legend = (
        [(name, COLOURS[name]) for name in names]
        if isinstance(found.drive, FourBarDrive)
        else [("links 1, 3, ...", RING[0]), ("links 2, 4, ...", RING[1])]
    )
    for name, colour in legend:
        yield f'<path d="M{x:.2f} {WORDS:.2f}h5" stroke="{colour}" stroke-width="1.1"/>'
        yield text(x + 6.5, WORDS + 1.1, name)
        x += 13.0 + 1.75 * len(name)
    for k, words in enumerate(_told(found)):
        yield text(BOX[0], WORDS + 8.0 + 5.0 * k, words)


def _told(found: Motion) -> list[str]:
    """Lines of words; the last ones are the notes."""
    names = [link.name for link in found.linkage.links]
    out = [f"mobility: {found.mobility} (first order: {found.first_order})"]
    for way in found.directions:
        word = "clockwise" if way.sign < 0 else "counterclockwise"
        ends = f"{math.degrees(way.reach):.2f} deg ({way.end})"
        if way.clash is not None:
            i, j = way.clash.links
            ends = f"{math.degrees(way.clash.angle):.2f} deg ({names[i]} meets {names[j]})"
        sides = [
            f"{side} to {math.degrees(angle):.2f} deg"
            for side, angle in (("outside", way.outside), ("inside", way.inside))
            if angle > 0.0
        ]
        out.append(f"{word}: {', '.join([ends, *sides])}")
    for note in found.notes:
        out += _broken(note, 78)
    return out


def _broken(words: str, most: int) -> list[str]:
    """A text in lines of at most that many letters."""
    out = [""]
    for word in words.split():
        if out[-1] and len(out[-1]) + 1 + len(word) > most:
            out.append("")
        out[-1] = f"{out[-1]} {word}".strip()
    return out
