"""What the drawing formats share: which curves to write, under which name, and the proof that
what was read back is the pattern."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np

from devcad.errors import JobError
from devcad.export import Options, panel_path, profile
from devcad.export.binary import torn
from devcad.flatten import loops
from devcad.flatten.arcs import fit_edge, fit_outline
from devcad.flatten.edges import strokes
from devcad.flatten.loops import Loop, Path
from devcad.flatten.measure import deviation, loop_deviation
from devcad.flatten.pattern import STITCH, Edge, Pattern
from devcad.flatten.polylines import polyline_edge, polyline_outline
from devcad.flatten.trace import trace
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

EXACT = 1e-9  # of the pattern's size: below it a recognised line or arc counts as exact
ROUNDING = 1e-11  # of the pattern's size: the accuracy of its outline, 1e-9 mm per 100 mm

FITS = {"arcs": fit_outline, "polyline": polyline_outline}
EDGE_FITS: dict[str, Callable[[Edge, float], Path]] = {"arcs": fit_edge, "polyline": polyline_edge}


def plane_curves(options: Options) -> str:
    """The curves of a drawing that is no DXF, by the word for DXF: arcs for splines and where
    nothing is said."""
    return "arcs" if options.dxf_curves in (None, "spline") else str(options.dxf_curves)


def hole_role(hole: tuple[Edge, ...]) -> str:
    """What a hole is for, by the name of its edges."""
    return profile.STITCH if hole[0].name == STITCH else profile.INNER


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


def fitted_strokes(pattern: Pattern, tolerance: float, curves: str) -> tuple[tuple[str, Path], ...]:
    """The drawings of a pattern, stroke by stroke, as layers and open paths of lines and arcs, or
    of straight segments, within ``tolerance`` (mm), in order; ``curves`` as in :func:`contours`."""
    fit = EDGE_FITS[curves]
    return tuple(
        (stroke[0].name, _end_to_end([fit(edge, tolerance) for edge in stroke]))
        for stroke in strokes(pattern.drawings)
    )


def _end_to_end(paths: list[Path]) -> Path:
    """Paths that follow one another as one."""
    if len(paths) == 1:
        return paths[0]
    return Path(
        np.concatenate([*(path.points[:-1] for path in paths), paths[-1].points[-1:]]),
        np.concatenate([path.bulges for path in paths]),
        all(path.exact for path in paths),
        max(path.deviation for path in paths),
    )


def drawing_path(
    part: Part, panel: Panel, folder: FilePath, suffix: str, mark: str = ""
) -> FilePath:
    """The path of a panel's drawing: -approximate where the surface twists and the pattern is no
    isometric one, then ``mark``, then the suffix."""
    path = panel_path(part, panel.name, folder, suffix)
    stem = path.name.removesuffix(f".{suffix}")
    about = "-approximate" if approximate(part, panel) else ""
    return path.with_name(f"{stem}{about}{mark}.{suffix}")


def approximate(part: Part, panel: Panel) -> bool:
    """Whether the panel's surface twists, so that its pattern is no isometric one."""
    return any(
        check.name in ("twist", "isometry") and not check.passed and check.panel in ("", panel.name)
        for check in part.checks
    )


def strokes_deviation(read: Sequence[Path], pattern: Pattern, limit: float) -> float:
    """The largest distance in mm between the strokes that were read, each in the direction of
    its curve, and the true ones; what is below 1e-9 of the pattern's size counts as 0."""
    size = longer_side(pattern)
    worst = 0.0
    for path, stroke in zip(read, strokes(pattern.drawings), strict=True):
        traces = [trace(edge, limit / 5.0) for edge in stroke]
        at = _corners(path, [traced.points[-1] for traced in traces[:-1]])
        for traced, i, j in zip(traces, at[:-1], at[1:], strict=True):
            found = deviation(traced, path.points[i : j + 1], path.bulges[i:j])
            worst = max(worst, 0.0 if found <= EXACT * size else found)
    return worst


def _corners(path: Path, corners: list[Array]) -> list[int]:
    """The vertices of a path at its start, at the corners (2,) in their order, and at its end."""
    found = [0]
    for left, corner in zip(range(len(corners), 0, -1), corners, strict=True):
        ahead = path.points[found[-1] + 1 : len(path.points) - left]
        found.append(found[-1] + 1 + int(np.argmin(np.hypot(*(ahead - corner).T))))
    return [*found, len(path.bulges)]


def measured(read: Contours, panel: Panel, limit: float, path: FilePath, name: str) -> float:
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
    size = longer_side(pattern)
    slack = (found + ROUNDING * size) * border + EXACT * pattern.area
    if abs(area - pattern.area) > slack:
        what = f"an area of {area:.12g} mm2 was read, the pattern has {pattern.area:.12g}"
        raise torn(name, path, what, panel=panel.name)
    return 0.0 if read.exact and found <= EXACT * size else found


def longer_side(pattern: Pattern) -> float:
    """The longer side of the pattern's box, mm."""
    x0, y0, x1, y1 = pattern.bbox
    return max(x1 - x0, y1 - y0)


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
