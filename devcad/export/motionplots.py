"""Plots of a motion: what links and joints do over the turn of the input, as SVG in mm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.drives import FourBarDrive
from devcad.simulate.motion import Motion, Track

LEFT, RIGHT = 142.0, 252.0  # of the plots
PLOTS = ((26.0, 72.0), (86.0, 132.0), (146.0, 192.0))  # top and bottom of each
INK, FAINT, GRID = "#2b333b", "#6b7680", "#dde2e6"
COLOURS = {"input": "#1f5fa8", "coupler": "#2e7d32", "output": "#b5461b", "ground": "#2b333b"}
RING = ("#1f5fa8", "#b5461b")
OUTSIDE, INSIDE = "#fbe3d6", "#dcebf7"


@dataclass(frozen=True, slots=True)
class Line:
    """A curve of a plot: its name, its colour, its values over the samples."""

    name: str
    colour: str
    values: Array


def plots(found: Motion, seen: Track) -> Iterator[str]:
    """The elements of three plots, one below the other: the turns of the links, the transmission
    angle (of a ring how far its joints are from the axis), and the radial distances from the
    cylinder. Shaded is where all moving links are outside of it, and where inside."""
    for rows, (label, curves, fixed) in zip(PLOTS, _curves(found, seen), strict=True):
        yield from _plot(found, seen.turn, rows, label, curves, fixed)
    bottom = PLOTS[-1][1] + 9
    yield text(RIGHT, bottom, "turn of the input, degrees", FAINT, anchor="end")
    sides = {colour for *_, colour in _sides(found)}
    for x, colour, words in ((LEFT, OUTSIDE, "all outside"), (LEFT + 26, INSIDE, "all inside")):
        if colour in sides:
            yield f'<rect x="{x:g}" y="{bottom - 2.6:g}" width="4" height="3" fill="{colour}"/>'
            yield text(x + 5.5, bottom, words, FAINT)


Curves = tuple[str, list[Line], tuple[float, float] | None]
"""The label of a plot, its curves and its range where that is fixed."""


def _curves(found: Motion, seen: Track) -> list[Curves]:
    radial: Curves = (
        "radial distance from the cylinder, mm",
        [
            Line("largest", COLOURS["output"], seen.high),
            Line("least", COLOURS["input"], seen.low),
        ],
        None,
    )
    if seen.angles is None or seen.transmission is None:
        size = np.abs(seen.joints)
        turns = np.degrees(seen.turns)
        return [
            (
                "turn of the links, degrees",
                [Line("1, 3, ...", RING[0], turns[:, 0]), Line("2, 4, ...", RING[1], turns[:, 1])],
                None,
            ),
            (
                "joints to the axis, mm",
                [
                    Line("joints 0, 2, ...", RING[0], size[:, 0]),
                    Line("joints 1, 3, ...", RING[1], size[:, 1]),
                ],
                None,
            ),
            radial,
        ]
    angles = np.degrees(seen.turns)
    _, _, second, third = _order(found)
    return [
        (
            "turn of output and coupler, degrees",
            [
                Line("output", COLOURS["output"], angles[:, third]),
                Line("coupler", COLOURS["coupler"], angles[:, second]),
            ],
            None,
        ),
        (
            "transmission angle, degrees",
            [Line("", INK, np.degrees(seen.transmission))],
            (0.0, 180.0),
        ),
        radial,
    ]


def _order(found: Motion) -> tuple[int, int, int, int]:
    assert isinstance(found.drive, FourBarDrive)
    return found.drive.order


def _plot(
    found: Motion,
    turn: Array,
    rows: tuple[float, float],
    label: str,
    curves: Sequence[Line],
    fixed: tuple[float, float] | None,
) -> Iterator[str]:
    """Curves over the turn of the input, with axes."""
    top, bottom = rows
    degrees = np.degrees(turn)
    first, last = float(degrees[0]), float(degrees[-1])
    if not last > first:
        first, last = -1.0, 1.0
    low, high = fixed or _range(curves)

    def right(values: Array) -> Array:
        return LEFT + (RIGHT - LEFT) * (values - first) / (last - first)

    def down(values: Array) -> Array:
        return bottom - (bottom - top) * (values - low) / (high - low)

    for a, b, colour in _sides(found):
        x0, x1 = (float(right(np.array(x))) for x in (a, b))
        yield (
            f'<rect x="{x0:.3f}" y="{top:g}" width="{x1 - x0:.3f}" height="{bottom - top:g}"'
            f' fill="{colour}"/>'
        )
    yield text(LEFT, top - 2, label, weight="bold")
    x = RIGHT
    for line in curves:
        yield text(x, top - 2, line.name, line.colour, anchor="end")
        x -= 4.0 + 1.7 * len(line.name)
    for tick in _ticks(low, high):
        at = float(down(np.array(tick)))
        stroke = FAINT if tick == 0.0 else GRID
        yield f'<path d="M{LEFT:g} {at:.3f}H{RIGHT:g}" stroke="{stroke}" stroke-width="0.2"/>'
        yield text(LEFT - 1.5, at + 1.1, f"{tick:g}", FAINT, anchor="end", size=2.8)
    for tick in _turn_ticks(first, last):
        at = float(right(np.array(tick)))
        stroke = FAINT if tick == 0.0 else GRID
        yield f'<path d="M{at:.3f} {top:g}V{bottom:g}" stroke="{stroke}" stroke-width="0.2"/>'
        yield text(at, bottom + 4, f"{tick:g}", FAINT, anchor="middle", size=2.8)
    yield (
        f'<rect x="{LEFT:g}" y="{top:g}" width="{RIGHT - LEFT:g}" height="{bottom - top:g}"'
        f' fill="none" stroke="{FAINT}" stroke-width="0.25"/>'
    )
    for line in curves:
        points = zip(right(degrees).tolist(), down(line.values).tolist(), strict=True)
        data = "L".join(f"{a:.3f} {b:.3f}" for a, b in points if b == b)
        yield (
            f'<path d="M{data}" fill="none" stroke="{line.colour}" stroke-width="0.5"'
            ' stroke-linejoin="round"/>'
        )


def _sides(found: Motion) -> Iterator[tuple[float, float, str]]:
    """Where all moving links are outside of the cylinder, and where inside: from and to in degrees
    of the input's turn, and a colour."""
    low, high = (math.degrees(x) for x in found.stretch())
    for way in found.directions:
        for angle, colour in ((way.outside, OUTSIDE), (way.inside, INSIDE)):
            end = min(max(way.sign * math.degrees(angle), low), high)
            if end:
                yield min(end, 0.0), max(end, 0.0), colour


def _range(curves: Sequence[Line]) -> tuple[float, float]:
    values = np.concatenate([line.values for line in curves])
    values = np.append(values[np.isfinite(values)], 0.0)
    low, high = float(values.min()), float(values.max())
    margin = 0.06 * (high - low)
    if not margin:
        return -1.0, 1.0
    return (low - margin if low < 0.0 else 0.0), (high + margin if high > 0.0 else 0.0)


def _ticks(low: float, high: float) -> list[float]:
    """About five round numbers from low to high."""
    raw = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * (1.0 - 1e-9))
    return _multiples(low, high, step)


def _turn_ticks(low: float, high: float) -> list[float]:
    """Round angles from low to high."""
    raw = (high - low) / 7.0
    steps = [m * 10.0**k for k in range(-8, 0) for m in (1.0, 2.0, 5.0)]
    steps += [1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0]
    return _multiples(low, high, next(step for step in steps if step >= raw * (1.0 - 1e-9)))


def _multiples(low: float, high: float, step: float) -> list[float]:
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [float(f"{k * step:.12g}") + 0.0 for k in range(first, last + 1)]


def text(
    x: float,
    y: float,
    words: str,
    fill: str = INK,
    *,
    size: float = 3.2,
    weight: str = "normal",
    anchor: str = "start",
) -> str:
    """A line of words."""
    style = "" if weight == "normal" else f' font-weight="{weight}"'
    style += "" if size == 3.2 else f' font-size="{size:g}"'
    style += "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{x:.2f}" y="{y:.2f}" fill="{fill}"{style}>{ascii_only(words)}</text>'


def ascii_only(words: str) -> str:
    """The words in ASCII, as XML has them."""
    return escape(words.encode("ascii", "backslashreplace").decode("ascii"))
