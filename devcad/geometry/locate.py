"""The map between points and places (t, v) on a chain: from its pattern, along lines, by feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.chain import Chain
from devcad.geometry.lines import Index, Lines, lines_over
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array, rows_cross, rows_dot

ROUNDING = 1e-11
"""Of the patch's size: a point as near to its first or last ruling lies on it."""


class Unrolled(Protocol):
    """A patch laid out in a plane, its rulings straight and evenly divided."""

    def axes(self, t: Array) -> tuple[Array, Array, Array]:
        """The images of c0(t), e(t) and m(t), each (n, 2)."""


@dataclass(frozen=True, slots=True)
class Places:
    """Where n points lie on a chain: ``patch`` (n,), -1 where no ruling runs through the point,
    and ``t`` and ``v`` (n,), nan there. ``beyond`` (n,) is how far in mm along the ruling a point
    lies outside the extent: 0 inside, inf where there is no ruling."""

    patch: Index
    t: Array
    v: Array
    beyond: Array

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each point lies on the sheet, its edges included."""
        return np.asarray(self.beyond == 0.0)


@dataclass(frozen=True, slots=True)
class Hits:
    """Where lines meet a chain, in the order of the lines: ``line`` (n,) says which, ``along``
    (n,) how far from its point in units of its direction; patch, t, v and beyond as in Places."""

    line: Index
    patch: Index
    t: Array
    v: Array
    beyond: Array
    along: Array


def plane_lines(patch: Patch, unrolled: Unrolled) -> Lines:
    """The rulings of a patch in its plane as lines (e, e x X), with the places X and e."""

    def family(t: Array) -> tuple[Array, Array]:
        origin, e, _ = unrolled.axes(t)
        moment = e[:, 0] * origin[:, 1] - e[:, 1] * origin[:, 0]
        return np.column_stack([e, moment]), np.column_stack([origin, e])

    origin, _, _ = unrolled.axes(patch.segments)
    reach = float(np.abs(origin).max()) + _reach(patch, np.zeros(3))
    return lines_over(family, patch.segments, 2, reach)


def plane_rows(points: Array) -> Array:
    """The rows (n, 3) of points (n, 2) for :func:`plane_lines`: f is the distance from the ruling
    towards m."""
    return np.column_stack([points[:, 1], -points[:, 0], -np.ones(len(points))])


def space_lines(patch: Patch, centre: Array) -> Lines:
    """The rulings of a patch in space as lines (e, e x (c0 - centre)), with the places
    c0 - centre and e."""

    def family(t: Array) -> tuple[Array, Array]:
        jet = patch.jet(t, 0)
        c0, e = jet.c0[0] - centre, jet.e[0]
        return np.column_stack([e, rows_cross(e, c0)]), np.column_stack([c0, e])

    return lines_over(family, patch.segments, 3, _reach(patch, centre))


def space_rows(points: Array, directions: Array, centre: Array) -> Array:
    """The rows (n, 6) of lines in space for :func:`space_lines`: f = <D, e x (Q - c0)>."""
    q = points - centre
    return np.column_stack([rows_cross(q, directions), -directions])


def on_plane(patches: Sequence[Patch], unrolled: Sequence[Unrolled], points: Array) -> Places:
    """The places of points (n, 2) of the pattern plane on patches laid out there.

    A point outside the extent is given on the ruling that runs through it, if one does on the
    side of the regression curve where the sheet is; one before the first ruling or behind the
    last has none. Where patches overlap in the plane, the place inside, or nearest to it, counts.
    """
    best = _nowhere(len(points))
    for number, (patch, plane) in enumerate(zip(patches, unrolled, strict=True)):
        lines = plane_lines(patch, plane)
        found = lines.roots(plane_rows(points), ROUNDING * lines.reach)
        kept = found.slope < 0.0  # q + v a > 0
        row, t = found.row[kept], found.t[kept]
        place = lines.places(t)
        v = _along(points[row] - place[:, :2], place[:, 2:])
        _keep_nearest(best, row, number, t, v, _beyond(patch, t, v))
    return best


def along_lines(chain: Chain, points: Array, directions: Array) -> Hits:
    """Where straight lines through ``points`` (n, 3) along ``directions`` (n, 3) meet the surface.

    Every patch's rulings are looked at beyond their extent too: ``beyond`` tells. A line that
    touches the surface meets it twice or not at all.
    """
    parts = []
    for number, patch in enumerate(chain.patches):
        centre = _centre(patch)
        lines = space_lines(patch, centre)
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        found = lines.roots(space_rows(points, unit, centre), ROUNDING * lines.reach)
        place = lines.places(found.t)
        c0, e = place[:, :3] + centre, place[:, 3:]
        v, along = closest(points[found.row] - c0, directions[found.row], e)
        met = np.isfinite(v + along)  # a ruling along the line is not met in a point
        row, t, v, along = found.row[met], found.t[met], v[met], along[met]
        parts.append((row, np.full(len(v), number), t, v, _beyond(patch, t, v), along))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.lexsort([columns[5], columns[0]])
    return Hits(*(column[order] for column in columns))


def closest(away: Array, direction: Array, e: Array) -> tuple[Array, Array]:
    """Where the lines c0 + v e and c0 + away + s direction come closest: v and s, each
    (n,), nan where the two are parallel."""
    dd, de = rows_dot(direction, direction), rows_dot(direction, e)
    ee, ad, ae = rows_dot(e, e), rows_dot(away, direction), rows_dot(away, e)
    across = dd * ee - de * de
    with np.errstate(invalid="ignore", divide="ignore"):
        s = np.where(across > 1e-24 * dd * ee, (de * ae - ee * ad) / across, np.nan)
    return np.asarray((ae + s * de) / ee), np.asarray(s)


def nearest(chain: Chain, points: Array) -> tuple[Places, Array]:
    """The places on the sheet nearest to points (n, 3) of space, and their distances (n,).

    All feet of perpendiculars on the surface, on its rails and on its outer rulings are compared.
    """
    best = _nowhere(len(points))
    for number, patch in enumerate(chain.patches):
        centre = _centre(patch)
        q = points - centre
        for lines in _feet(patch, centre):
            rows = np.column_stack([q, -np.ones(len(q))])
            found = lines.roots(rows, ROUNDING * lines.reach)
            _keep_foot(best, patch, number, points, found.row, found.t)
        every = np.arange(len(points))
        for t in patch.segments:
            _keep_foot(best, patch, number, points, every, np.full(len(points), t))
    distance = best.beyond.copy()
    best.beyond[:] = 0.0
    return best, distance


def _feet(patch: Patch, centre: Array) -> list[Lines]:
    """The families whose roots are feet on the surface and on both rails."""

    def surface(t: Array) -> tuple[Array, Array]:
        frame = patch.frame(t)
        m = np.nan_to_num(frame.m)
        return np.column_stack([m, rows_dot(m, frame.c0 - centre)]), np.zeros((len(t), 0))

    def rail(name: str, t: Array) -> tuple[Array, Array]:
        jet = patch.jet(t, 1)
        curve = jet.rail(getattr(jet, name))
        return (
            np.column_stack([curve[1], rows_dot(curve[1], curve[0] - centre)]),
            np.zeros((len(t), 0)),
        )

    reach = _reach(patch, centre)
    out = [lines_over(surface, patch.segments, 3, reach)]
    low, high = patch.domain
    for name in ("v_from", "v_to"):
        speed = np.linalg.norm(rail(name, np.linspace(low, high, 33))[0][:, :3], axis=1).max()
        if speed * (high - low) > ROUNDING * reach:  # an apex is seen from any of its rulings
            out.append(lines_over(partial(rail, name), patch.segments, 3, reach))
    return out


def _keep_foot(
    best: Places, patch: Patch, number: int, points: Array, row: Index, t: Array
) -> None:
    """Keep the nearest point of the ruling t wherever it is nearer than what is known."""
    jet = patch.jet(t, 0)
    v = rows_dot(points[row] - jet.c0[0], jet.e[0])
    v = np.clip(v, jet.v_from[0], jet.v_to[0])
    at = jet.c0[0] + v[:, None] * jet.e[0]
    _keep_nearest(best, row, number, t, v, np.linalg.norm(points[row] - at, axis=1))


def _nowhere(n: int) -> Places:
    return Places(np.full(n, -1), np.full(n, np.nan), np.full(n, np.nan), np.full(n, np.inf))


def _keep_nearest(best: Places, row: Index, number: int, t: Array, v: Array, away: Array) -> None:
    """Write the candidates that are less far ``away`` than what is known for their rows."""
    order = np.lexsort([away, row])
    first = order[np.unique(row[order], return_index=True)[1]]
    first = first[away[first] < best.beyond[row[first]]]
    into = row[first]
    best.patch[into] = number
    best.t[into], best.v[into], best.beyond[into] = t[first], v[first], away[first]


def _beyond(patch: Patch, t: Array, v: Array) -> Array:
    """How far v lies outside the extent at t, 0 inside."""
    jet = patch.jet(t, 0)
    return np.asarray(np.maximum(np.maximum(jet.v_from[0] - v, v - jet.v_to[0]), 0.0))


def _along(away: Array, e: Array) -> Array:
    return np.asarray((away * e).sum(axis=1) / (e * e).sum(axis=1))


def _centre(patch: Patch) -> Array:
    jet = patch.jet([0.5 * (patch.domain[0] + patch.domain[1])], 0)
    return np.asarray(jet.c0[0, 0] + 0.5 * (jet.v_from[0, 0] + jet.v_to[0, 0]) * jet.e[0, 0])


def _reach(patch: Patch, centre: Array) -> float:
    """The largest distance of the patch from a point, and at least its largest v, mm, about."""
    jet = patch.jet(np.linspace(*patch.domain, 17), 0)
    v = np.maximum(np.abs(jet.v_from[0]), np.abs(jet.v_to[0]))
    away = np.linalg.norm(jet.c0[0] - centre, axis=1)
    return float((away + v).max())
