"""What the drawing formats share: which curves to write, under which name, and the proof that
what was read back is the pattern."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from devcad.errors import JobError
from devcad.export import panel_path
from devcad.export.binary import torn
from devcad.flatten import loops
from devcad.flatten.arcs import fit_outline
from devcad.flatten.loops import Loop
from devcad.flatten.measure import loop_deviation
from devcad.flatten.pattern import Pattern
from devcad.flatten.polylines import polyline_outline
from devcad.part import Panel, Part

EXACT = 1e-9  # of the pattern's size: below it a recognised line or arc counts as exact
ROUNDING = 1e-11  # of the pattern's size: the accuracy of its outline, 1e-9 mm per 100 mm

FITS = {"arcs": fit_outline, "polyline": polyline_outline}


@dataclass(frozen=True, slots=True)
class Contours:
    """A pattern's cuts: the outer loop counterclockwise, the holes clockwise."""

    outer: Loop
    holes: tuple[Loop, ...]

    @property
    def exact(self) -> bool:
        """Whether every segment is the true curve."""
        return self.outer.exact and all(hole.exact for hole in self.holes)


def contours(pattern: Pattern, tolerance: float, curves: str) -> Contours:
    """The cuts of a pattern as lines and arcs ("arcs") or straight segments ("polyline"),
    within ``tolerance`` (mm) of the true curves.

    Raises:
        JobError: another kind of curves.
    """
    if curves not in FITS:
        raise JobError(
            f"unknown curves {curves!r}",
            value=curves,
            limit=", ".join(FITS),
            remedy=f"use one of {', '.join(FITS)}",
        )
    fit = FITS[curves]
    holes = tuple(loops.reverse(fit(hole, tolerance)) for hole in pattern.holes)
    return Contours(fit(pattern.outline, tolerance), holes)


def drawing_path(part: Part, panel: Panel, folder: Path, suffix: str, mark: str = "") -> Path:
    """The path of a panel's drawing: -approximate where the twist check was allowed to fail,
    then ``mark``, then the suffix."""
    path = panel_path(part, panel.name, folder, suffix)
    twisted = any(
        check.name == "twist" and not check.passed and check.panel in ("", panel.name)
        for check in part.checks
    )
    stem = path.name.removesuffix(f".{suffix}")
    return path.with_name(f"{stem}{'-approximate' if twisted else ''}{mark}.{suffix}")


def measured(read: Contours, panel: Panel, limit: float, path: Path, name: str) -> float:
    """The largest distance in mm between the cuts that were read and the true pattern, 0 where
    every segment is recognised as exact (``read.exact`` is the claim; it is tested here).

    Raises:
        CheckFailed: ``name``, when a loop is missing, runs the wrong way, touches a point twice
            in a row, turns round more than once, or encloses another area than the pattern.
    """
    pattern = panel.pattern
    if len(read.holes) != len(pattern.holes):
        what = f"{len(read.holes)} holes were read, {len(pattern.holes)} written"
        raise torn(name, path, what, panel=panel.name)
    pairs = [(read.outer, pattern.outline), *zip(read.holes, pattern.holes, strict=True)]
    found = max(loop_deviation(loop, edges, limit / 5.0) for loop, edges in pairs)
    for number, (loop, _) in enumerate(pairs):
        fault = _fault(loop, outer=number == 0)
        if fault:
            raise torn(name, path, fault, panel=panel.name)
    area = sum(loops.area(loop) for loop, _ in pairs)
    border = sum(loops.perimeter(loop) for loop, _ in pairs)
    x0, y0, x1, y1 = pattern.bbox
    size = max(x1 - x0, y1 - y0)
    slack = (found + ROUNDING * size) * border + EXACT * pattern.area
    if abs(area - pattern.area) > slack:
        what = f"an area of {area:.12g} mm2 was read, the pattern has {pattern.area:.12g}"
        raise torn(name, path, what, panel=panel.name)
    return 0.0 if read.exact and found <= EXACT * size else found


def _fault(loop: Loop, *, outer: bool) -> str:
    """What is wrong with a loop's form, or nothing."""
    if (loops.area(loop) > 0.0) != outer:
        return "a contour runs the wrong way round"
    if not loops.lengths(loop.points, loop.ends, loop.bulges).min() > 0.0:
        return "a contour has a segment without length"
    turns = loops.turning(loop)
    if abs(turns - (1.0 if outer else -1.0)) > 1e-6:  # nan, at a spike: nothing to be said
        return f"a contour crosses itself: it turns round {turns:.3g} times"
    return ""
