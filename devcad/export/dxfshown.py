"""What of a panel a drawing shows: the lines, drawings and holes that its profile draws as
curves, and what it draws as a point or as one straight line instead."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.export.outline import hole_role
from devcad.export.profile import BENDS, INNER, OUTER, STITCH, Profile, Style
from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.edges import strokes
from devcad.flatten.pattern import Edge, Line, Pattern, sample
from devcad.geometry.taylor import Array
from devcad.part import Panel

PER_PIECE = 32
"""Steps between two of an edge's u's when the end of a mark next to the border is looked for."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A panel with only those lines, drawings and holes that are drawn as curves (its pattern's
    area is without these holes alone); ``points`` (2,) and ``lines`` (start, end) stand for
    the others, each with its role. ``left_out`` are the roles that the profile does not draw."""

    panel: Panel
    points: tuple[tuple[str, Array], ...]
    lines: tuple[tuple[str, Array, Array], ...]
    left_out: tuple[str, ...]


def shown(panel: Panel, style: Style, limit: float) -> Shown:
    """What a drawing of that style shows of a panel; ``limit`` (mm) says what is a round hole."""
    pattern, roles = panel.pattern, style.profile.roles
    kept, centres, area = _holes(pattern, style.profile, limit)
    points, lines = list(centres), []
    drawings = []
    for edge in pattern.drawings:
        if roles[edge.name].drawn and not roles[edge.name].shape:
            drawings.append(edge)
    for stroke in strokes(tuple(e for e in pattern.drawings if roles[e.name].shape == "point")):
        points.append((stroke[0].name, _end_at_border(stroke, pattern)))
    straight = [edge for edge in pattern.drawings if roles[edge.name].shape == "line"]
    if straight:
        longest = max(straight, key=lambda edge: float(np.hypot(*np.subtract(*_ends(edge)))))
        lines.append((longest.name, *_ends(longest)))
    reference = [line for line in pattern.lines if roles[line.layer].drawn]
    ticked = [tick for line in reference for tick in ticks(line, style.bend_ticks)]
    named = [line.layer for line in pattern.lines] + [edge.name for edge in pattern.drawings]
    left_out = tuple(name for name in dict.fromkeys(named) if not roles[name].drawn)
    seen = replace(
        pattern, lines=tuple(ticked), drawings=tuple(drawings), holes=kept, area=pattern.area + area
    )
    return Shown(replace(panel, pattern=seen), tuple(points), tuple(lines), left_out)


def ticks(line: Line, length: float) -> tuple[Line, ...]:
    """A bend line as two ticks of that length at its ends, itself where it is too short for
    them, is no bend, or ``length`` is 0."""
    way = line.end - line.start
    whole = float(np.hypot(*way))
    if line.layer not in BENDS or length <= 0.0 or whole <= 2.0 * length:
        return (line,)
    step = (length / whole) * way
    return replace(line, end=line.start + step), replace(line, start=line.end - step)


def contour_roles(pattern: Pattern, profile: Profile) -> list[str]:
    """The roles of the contours in the order of the file: holes first, they are cut first."""
    pointed = profile.roles[STITCH].shape  # then only those that are not round are contours
    holes = [INNER if pointed else hole_role(hole) for hole in pattern.holes]
    return [*holes, OUTER]


def contour_layers(pattern: Pattern, profile: Profile) -> list[str]:
    """The layers of the contours in the order of the file."""
    return [profile.roles[role].layer for role in contour_roles(pattern, profile)]


def _holes(
    pattern: Pattern, profile: Profile, limit: float
) -> tuple[tuple[tuple[Edge, ...], ...], list[tuple[str, Array]], float]:
    """The holes that are drawn as contours, those that are points, and the area of the latter."""
    kept, centres, area = [], [], 0.0
    for hole in pattern.holes:
        pointed = hole_role(hole) == STITCH and profile.roles[STITCH].shape == "point"
        circle = loops.circle(fit_outline(hole, limit)) if pointed else None
        if circle is None:
            kept.append(hole)
        else:
            centres.append((STITCH, circle[0]))
            area += np.pi * circle[1] ** 2
    return tuple(kept), centres, area


def _end_at_border(stroke: tuple[Edge, ...], pattern: Pattern) -> Array:
    """The end of a stroke that lies nearer to the outline, (2,)."""
    ends = np.stack([_ends(stroke[0])[0], _ends(stroke[-1])[1]])
    border = np.concatenate([sample(edge, PER_PIECE) for edge in pattern.outline])
    away = np.hypot(*(ends[:, None] - border[None]).transpose(2, 0, 1)).min(axis=1)
    return np.asarray(ends[int(np.argmin(away))])


def _ends(edge: Edge) -> tuple[Array, Array]:
    points = edge.curve(edge.u[[0, -1]])[0]
    return points[0], points[1]
