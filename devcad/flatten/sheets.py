"""Sheets with borders of any form, such as faces of a CAD system, laid out in the plane."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.development import Development, develop
from devcad.flatten.drawings import image
from devcad.flatten.green import enclosed_area, perimeter
from devcad.flatten.pattern import Edge
from devcad.geometry.cuts import Track
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

AREA_LIMIT = 1e-9
"""Relative: how far the pattern's area may be off the sheet's, where the sheet does not twist."""
COLLAPSED = 1e-12
"""An edge shorter than this share of the pattern is a point: an apex."""
LEVEL = 1e-9
"""An edge whose t changes by less than this share of the domain runs along a ruling."""


@dataclass(frozen=True, slots=True)
class Side:
    """An edge of a sheet's border: ``track`` runs along it, ``forward`` with it or backwards.

    ``key`` names the edge: two sides of one key are one edge that joins them.
    """

    track: Track
    forward: bool
    key: int


@dataclass(frozen=True, slots=True)
class Sheet:
    """A patch and where it ends: closed ``loops`` of sides, the outer one first, then the holes.

    ``area`` is the sheet's in mm2 as measured elsewhere, ``twist`` the largest turn of its
    tangent plane along a ruling in radians.
    """

    patch: Patch
    loops: tuple[tuple[Side, ...], ...]
    area: float
    twist: float


@dataclass(frozen=True, slots=True)
class Laid:
    """A sheet in the plane: its development and the images of its sides, loop by loop, each loop
    with the sheet on its left."""

    sheet: Sheet
    development: Development
    edges: tuple[tuple[Edge, ...], ...]
    sides: tuple[tuple[Side, ...], ...]

    def moved(self, turn: float, step: Array) -> Laid:
        """The same, turned about the origin and then moved."""
        edges = tuple(tuple(moved(edge, turn, step) for edge in loop) for loop in self.edges)
        return replace(self, development=self.development.placed(turn, step), edges=edges)


def lay(sheet: Sheet, tolerance: float) -> Laid:
    """One sheet in the plane, its borders closed and its area proven.

    ``tolerance``: the largest gap in mm between neighbouring edges that is closed.

    Raises:
        GeometryError: a border is open, or the area is not the sheet's.
    """
    development = develop(sheet.patch)
    edges, sides, area, open_ = [], [], 0.0, 0.0
    for number, loop in enumerate(sheet.loops):
        ring = _with_length([(_image(side, sheet.patch, development), side) for side in loop])
        inside = enclosed_area(tuple(edge for edge, _ in ring))
        if (inside > 0.0) != (number == 0):
            ring = [(replace(e, u=e.u[::-1].copy()), side) for e, side in reversed(ring)]
        named = tuple(replace(e, name=_name(e, side.track, sheet.patch)) for e, side in ring)
        closed, gap = _closed(named, tolerance)
        edges.append(closed)
        sides.append(tuple(side for _, side in ring))
        area += abs(inside) if number == 0 else -abs(inside)
        open_ += gap * perimeter(closed) if gap else 0.0
    _prove_area(area, sheet, open_)
    return Laid(sheet, development, tuple(edges), tuple(sides))


def _with_length(ring: list[tuple[Edge, Side]]) -> list[tuple[Edge, Side]]:
    """The edges that are no point: an apex is one, and its slopes are rounding."""
    samples = [edge.curve(np.linspace(edge.u[0], edge.u[-1], 9))[0] for edge, _ in ring]
    size = float(np.abs(np.concatenate(samples)).max())
    lengths = [float(np.hypot(*np.diff(points, axis=0).T).sum()) for points in samples]
    return [each for each, length in zip(ring, lengths, strict=True) if length > COLLAPSED * size]


def _image(side: Side, patch: Patch, development: Development) -> Edge:
    """The image of a side, in the direction of its run."""
    series = side.track.series
    knots, slopes = series.knots, series.derivative().coefficients
    both = replace(series, coefficients=np.concatenate([series.coefficients, slopes], axis=2))
    breaks = np.array([-np.inf, *patch.breaks, np.inf])
    cell = np.searchsorted(breaks, series(0.5 * (knots[1:] + knots[:-1]))[:, 0]) - 1
    low, high = np.nextafter(breaks[cell], np.inf), np.nextafter(breaks[cell + 1], -np.inf)

    def path(u: Array) -> tuple[Array, Array, Array, Array]:
        t, v, dt, dv = both(u).T
        piece = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(cell) - 1)
        return np.clip(t, low[piece], high[piece]), v, dt, dv  # at a break, from within

    curve = image(path, patch, development)
    return Edge("", curve, knots if side.forward else knots[::-1].copy())


def _name(edge: Edge, track: Track, patch: Patch) -> str:
    """Which side of a strip an edge is like, run with the sheet on its left."""
    t, v, _, _ = track(np.linspace(edge.u[0], edge.u[-1], 17))
    if np.ptp(t) <= LEVEL * (patch.domain[1] - patch.domain[0]):
        return "start" if v[-1] > v[0] else "end"
    return "top" if t[-1] > t[0] else "base"


def ends_of(edge: Edge) -> Array:
    """The first and the last point of an edge's run, (2, 2)."""
    return edge.curve(edge.u[[0, -1]])[0]


def _closed(loop: tuple[Edge, ...], tolerance: float) -> tuple[tuple[Edge, ...], float]:
    """The loop without its gaps, for edges that miss each other meet half way; and the widest gap
    in mm, 0 where it is rounding.

    Raises:
        GeometryError: a gap is wider than the tolerance.
    """
    ends = np.array([ends_of(edge) for edge in loop])
    before = np.roll(ends[:, 1], 1, axis=0)
    gap = float(np.linalg.norm(ends[:, 0] - before, axis=1).max())
    if not gap <= tolerance:
        raise GeometryError(
            f"the face's border is open by {gap:.3g} mm, limit {tolerance:.3g} mm",
            value=gap,
            limit=tolerance,
            remedy="mend the face, or allow a larger tolerance",
        )
    if gap <= COLLAPSED * float(np.abs(ends).max()):
        return loop, 0.0
    corners = 0.5 * (ends[:, 0] + before)
    after = np.roll(corners, -1, axis=0)
    steps = zip(loop, corners - ends[:, 0], after - ends[:, 1], strict=True)
    return tuple(_pulled(edge, first, last) for edge, first, last in steps), gap


def _pulled(edge: Edge, first: Array, last: Array) -> Edge:
    """An edge with its ends moved by so much, and what lies between in proportion."""
    start, span = edge.u[0], edge.u[-1] - edge.u[0]

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        share = ((u - start) / span)[:, None]
        return points + (1.0 - share) * first + share * last, slopes + (last - first) / span

    return replace(edge, curve=curve)


def moved(edge: Edge, turn: float, step: Array) -> Edge:
    """An edge turned about the origin by ``turn`` and moved by ``step``."""
    cos, sin = np.cos(turn), np.sin(turn)
    matrix = np.array([[cos, sin], [-sin, cos]])  # for rows

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        return points @ matrix + step, slopes @ matrix

    return replace(edge, curve=curve)


def _prove_area(area: float, sheet: Sheet, open_: float) -> None:
    """The pattern's area is the sheet's own, but for what its twist and its gaps leave open.

    Raises:
        GeometryError: it is not.
    """
    # the metric of a strip that twists by w differs from the pattern's by at most w^2 / 2
    limit = (AREA_LIMIT + 0.5 * sheet.twist**2) * sheet.area + open_
    if not abs(area - sheet.area) <= limit:
        raise GeometryError(
            f"the pattern has {area:.12g} mm2, the face {sheet.area:.12g} mm2",
            value=abs(area - sheet.area),
            limit=limit,
            remedy="mend the face: its border is no simple closed line on its surface",
        )
