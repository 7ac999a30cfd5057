"""Path operators of PDF: straight lines and cubic Beziers, in mm; and back to lines and arcs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten import loops
from devcad.flatten.loops import Loop, Path
from devcad.geometry.taylor import Array

FINEST = 5e-5  # mm, how far a Bezier may leave its arc at most
STRAIGHT = 1e-7  # mm, twice the rise of an arc that no printer can tell from its chord
QUARTER = 0.5 * np.pi
SAMPLES = np.linspace(0.0, 1.0, 33)[1:-1, None]  # on a Bezier, for measuring it


@dataclass(frozen=True, slots=True)
class Run:
    """A path as it was read: lines and arcs, whether it was closed, and how far its Beziers lie
    from these arcs at most, mm."""

    points: Array
    bulges: Array
    closed: bool
    off: float

    def loop(self, *, exact: bool) -> Loop:
        """The closed path; ValueError where it is open."""
        if not self.closed:
            raise ValueError("a contour is open")
        return Loop(self.points[:-1], self.bulges, exact)

    def path(self) -> Path:
        """The open path; ValueError where it is closed."""
        if self.closed:
            raise ValueError("a drawing is closed")
        return Path(self.points, self.bulges, False, 0.0)


def number(x: float) -> str:
    """mm to 1e-8 without an exponent, which PDF does not know."""
    text = f"{x:.8f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def numbers(*values: float) -> str:
    """Several numbers, as the operands of one operator."""
    return " ".join(number(float(value)) for value in values)


def closed_path(loop: Loop, finest: float) -> str:
    """The operators that stroke a contour, its arcs as Beziers within ``finest`` mm of them."""
    around = np.concatenate([loop.points, loop.points[:1]])
    steps = list(_steps(around, loop.bulges, finest))
    if steps[-1].endswith("l"):
        steps.pop()  # h draws it
    return "\n".join([f"{numbers(*around[0])} m", *steps, "h S"])


def open_path(path: Path, finest: float) -> str:
    """The operators that stroke an open path."""
    steps = _steps(path.points, path.bulges, finest)
    return "\n".join([f"{numbers(*path.points[0])} m", *steps, "S"])


def line(x0: float, y0: float, x1: float, y1: float) -> str:
    """The operators that stroke a straight line."""
    return f"{numbers(x0, y0)} m {numbers(x1, y1)} l S"


def rectangle(x: float, y: float, width: float, height: float, paint: str = "S") -> str:
    """The operators of a rectangle: stroked (S), filled (f) or a clip (W n)."""
    return f"{numbers(x, y, width, height)} re {paint}"


def _steps(points: Array, bulges: Array, finest: float) -> Iterator[str]:
    """A line to, or curves to, for each segment."""
    for start, end, bulge in zip(points[:-1], points[1:], bulges.tolist(), strict=True):
        chord = float(np.hypot(*(end - start)))
        if abs(bulge) * chord <= STRAIGHT:
            yield f"{numbers(*end)} l"
            continue
        parts = _parts(chord, bulge, finest)
        inner, part = loops.split(start, bulge, end, parts)
        stops = np.concatenate([start[None], inner, end[None]])
        for a, b in pairwise(stops):
            yield f"{numbers(*_arms(a, b, part), *b)} c"


def _parts(chord: float, bulge: float, finest: float) -> int:
    """How many Beziers an arc takes.

    With the arms 4/3 tan(w/4) r the curve leaves a circle of radius r over the angle w by
    4/27 r sin(w/4)^6 / cos(w/4)^2 at most (Goldapp 1991).
    """
    sweep = 4.0 * abs(float(np.arctan(bulge)))
    radius = chord / (2.0 * float(np.sin(0.5 * sweep)))
    parts = max(1, int(np.ceil(sweep / QUARTER - 1e-9)))
    while _leaves(radius, sweep / parts) > finest:
        parts += 1
    return parts


def _leaves(radius: float, sweep: float) -> float:
    """How far the Bezier for an arc leaves it, mm."""
    share = 0.25 * sweep
    return float(4.0 / 27.0 * radius * np.sin(share) ** 6 / np.cos(share) ** 2)


def _arms(a: Array, b: Array, bulge: float) -> Array:
    """The inner control points, (4,), of the Bezier for an arc from a to b."""
    chord = b - a
    half = 2.0 * np.arctan(bulge)
    across = np.array([-chord[1], chord[0]])
    # an arm is 4/3 tan(w/4) r long, the chord 2 r sin(w/2), and w/2 = half
    length = 2.0 * np.tan(0.5 * half) / (3.0 * np.sin(half))
    along, aside = length * np.cos(half), length * np.sin(half)
    return np.concatenate([a + along * chord - aside * across, b - along * chord - aside * across])


def runs(operators: Iterable[tuple[str, list[float]]]) -> list[Run]:
    """The paths that are stroked by a sequence of operators with their operands.

    Raises:
        ValueError, IndexError: an operator of another kind stands among them.
    """
    out: list[Run] = []
    points: list[list[float]] = []
    bulges: list[float] = []
    off, closed = 0.0, False
    for name, operands in operators:
        if name == "m":
            points, bulges, off, closed = [operands], [], 0.0, False
        elif name == "l":
            bulges.append(0.0)
            points.append(operands)
        elif name == "c":
            bulge, away = _arc(np.array([*points[-1], *operands]).reshape(4, 2))
            bulges.append(bulge)
            points.append(operands[4:])
            off = max(off, away)
        elif name == "h":
            closed = True
            if points[-1] != points[0]:
                bulges.append(0.0)
                points.append(points[0])
        elif name == "S":
            out.append(Run(np.array(points), np.array(bulges), closed, off))
        else:
            raise ValueError(f"the operator {name} in a path")
    return out


def _arc(p: Array) -> tuple[float, float]:
    """The bulge of the arc that a Bezier (4, 2) stands for, and its distance from it in mm."""
    chord, arm = p[3] - p[0], p[1] - p[0]
    half = float(np.arctan2(loops.cross(arm, chord), loops.dot(arm, chord)))
    bulge = float(np.tan(0.5 * half))
    s = SAMPLES
    curve = (
        (1.0 - s) ** 3 * p[0]
        + 3.0 * s * (1.0 - s) ** 2 * p[1]
        + 3.0 * s**2 * (1.0 - s) * p[2]
        + s**3 * p[3]
    )
    ones = np.ones((len(s), 1))
    away = loops.segment_distance(ones * p[0], ones * p[3], bulge * ones[:, 0], curve)
    return bulge, float(away.max())
