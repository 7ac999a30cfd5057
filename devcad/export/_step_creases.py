"""Sheets folded along curved creases: faces on both sides of a crease stand on one edge of it.

The strips of all flanks are cut at the same rulings. Where the strips on both sides of a crease
are exact and have the same lines, circles or ellipses there, these are the edge; otherwise all
that the crease joins is fitted side by side on one knot vector, the crease once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_body import Arc, Curve, Ellipse, Line, Ruled, Trace
from devcad.export._step_chart import heights
from devcad.export._step_conics import round_points
from devcad.export._step_draft import Draft, Skin
from devcad.export._step_folds import Folds, Side
from devcad.export._step_rails import Piece, end_slopes, probe_places, twist_limit
from devcad.export._step_rims import edge_tolerance
from devcad.export._step_skins import exact_skin, face_tolerance, ruled_skin
from devcad.export._step_strips import Strip, smooth_courses, strips
from devcad.geometry.conic import arcs
from devcad.geometry.fit import FLOOR, Course, Demand, Ends, Spline, fit
from devcad.geometry.polynomial import polynomial
from devcad.geometry.taylor import Array
from devcad.part import Fold, Panel

SAME = 1e-9
"""Of a patch's domain: cuts as near are one."""
SHARES = np.linspace(0.0, 1.0, 33)
SIDES = {"base": 0, "top": 1}
EXACT = (Line, Arc, Ellipse)


@dataclass(frozen=True, slots=True)
class Sheet:
    """The strips of a folded sheet, flank after flank, with stations counted through.

    ``flanks`` has the numbers of each flank's strips, ``joins`` the long edges of strips beyond a
    crease and those before it that they are, run alike.
    """

    parts: list[Strip]
    stations: int
    flanks: list[list[int]]
    joins: Folds


def alongside(panel: Panel, size: float) -> Sheet:
    """The strips of a sheet without thickness that is folded along creases, cut at equal rulings.

    Raises:
        GeometryError: flanks do not meet along their crease.
    """
    first = [strips(flank) for flank in panel.flanks]
    rows = _rows([parts for parts, _ in first], [not flank.cuts for flank in panel.flanks])
    parts: list[Strip] = []
    flanks: list[list[int]] = []
    stations = 0
    for (own, count), row in zip(first, rows, strict=True):
        last = len(row) if count == len(own) else len(row) + 1
        flanks.append(list(range(len(parts), len(parts) + len(row))))
        for k, strip in enumerate(row):
            ends = stations + k, stations + (k + 1) % last
            parts.append(replace(strip, first=ends[0], last=ends[1]))
        stations += last
    joins: Folds = {}
    for fold in panel.folds:
        joins |= _joined(parts, flanks, fold, size)
    return Sheet(parts, stations, flanks, joins)


def joined_skins(draft: Draft, sheet: Sheet, tolerance: float, degree: int) -> list[Skin]:
    """The skins of a folded sheet's strips; those that share a long edge have the same curve there.

    Raises:
        GeometryError: a fit is out of reach.
    """
    edge = edge_tolerance(draft.size, tolerance)
    skins: dict[int, Skin] = {}
    for k, strip in enumerate(sheet.parts):
        if not strip.ruled:
            skins[k] = exact_skin(strip, draft, np.zeros((2, 3)), edge, degree)
    near = 1e-2 * max(1e-7, FLOOR * draft.size)
    free = {
        (k, side): source
        for (k, side), source in sheet.joins.items()
        if not _alike(skins.get(k), side, skins.get(source[0]), source[1], near)
    }
    for group in _groups(len(sheet.parts), free):
        rounded = [k for k in group if k in skins]
        if len(rounded) == len(group) == 1:
            continue
        fine = edge if rounded else face_tolerance(draft.size, tolerance)
        skins |= _Beside(draft, sheet.parts, group, free, skins).fitted(fine, degree)
    return [skins[k] for k in range(len(sheet.parts))]


# where strips are cut


def _rows(flanks: list[list[Strip]], plain: list[bool]) -> list[list[Strip]]:
    """The strips of each flank cut wherever another one's are; ``plain`` ones have no cutouts."""
    rows: list[list[Strip]] = [[] for _ in flanks]
    for number in sorted({strip.number for parts in flanks for strip in parts}):
        own = [[strip for strip in parts if strip.number == number] for parts in flanks]
        if not all(own) or len({strips[0].patch.domain for strips in own}) > 1:
            raise _apart("have patches of their own", np.inf, 0.0)
        cuts = _cuts(own, plain)
        breaks = own[0][0].patch.segments

        def slopes(t: Array, own: list[list[Strip]] = own) -> Array:
            return np.concatenate([s[0].slopes(t).reshape(len(t), -1) for s in own], axis=1)

        for course in smooth_courses(slopes, breaks, cuts):
            middle = 0.5 * (course.t[0] + course.t[-1])
            for row, strips_of in zip(rows, own, strict=True):
                here = next(s for s in strips_of if middle <= s.ends[1])
                row.append(replace(here, course=course))
    return rows


def _cuts(own: list[list[Strip]], plain: list[bool]) -> Array:
    """The parameters at which a patch of all flanks is cut, its ends included; where we cut a
    ``plain`` flank for the reader's sake alone, cuts of an earlier flank do as well."""
    start, end = own[0][0].patch.domain
    breaks = own[0][0].patch.segments
    near = SAME * (end - start)
    known = np.array([start, end])
    for parts, bare in zip(own, plain, strict=True):
        wanted = np.array([strip.ends[1] for strip in parts[:-1]])
        wanted = wanted[_away(wanted, known, near)]
        ours = _away(wanted, breaks, near)  # cut by us, not by the surface
        if bare and ours.sum() <= _away(known, breaks, near).sum():
            wanted = wanted[np.logical_not(ours)]
        known = np.sort(np.concatenate([known, wanted]))
    return known


def _away(places: Array, others: Array, near: float) -> Array:
    """Which of the places (n,) are none of the others, (n,) of bool."""
    return np.asarray(np.abs(places[:, None] - others).min(axis=1, initial=np.inf) > near)


def _joined(parts: list[Strip], flanks: list[list[int]], fold: Fold, size: float) -> Folds:
    """The long edges along a crease: the child's strip by strip, and the parent's."""
    other = SIDES[fold.side]
    joins: Folds = {}
    for k, i in zip(flanks[fold.child], flanks[fold.parent], strict=True):
        t = parts[i].course(_spread(parts[i].course))
        gap = parts[k].rails(t)[:, 1 - other] - parts[i].rails(t)[:, other]
        if (most := float(np.abs(gap).max())) > FLOOR * size:
            raise _apart(f"are {most:.3g} mm apart", most, FLOOR * size)
        joins[k, 1 - other] = i, other
    return joins


def _spread(course: Course) -> Array:
    return np.asarray(course.s[0] + (course.s[-1] - course.s[0]) * SHARES)


def _apart(how: str, value: float, limit: float) -> GeometryError:
    return GeometryError(
        f"the two sides of a curved crease {how}",
        value=value,
        limit=limit,
        remedy="with thickness, ask for the solids instead of the sheet",
    )


# what the strips stand on


def _alike(own: Skin | None, side: int, other: Skin | None, across: int, near: float) -> bool:
    """Whether two exact strips have the same lines, circles and ellipses along their crease."""
    if own is None or other is None:
        return False
    pieces = own.sides[side], other.sides[across]
    if len(pieces[0]) != len(pieces[1]):
        return False
    for mine, its in zip(*pieces, strict=True):
        curve, known = mine.curves[0], its.curves[0]
        if type(curve) is not type(known) or not isinstance(curve, EXACT):
            return False
        if np.abs(_samples(curve, mine) - _samples(known, its)).max() > near:
            return False
    return True


def _samples(curve: Curve, piece: Piece) -> Array:
    """Points of an exact edge at equal shares of its span, (n, 3)."""
    low, high = piece.spans[0]
    if isinstance(curve, (Arc, Ellipse)):
        return round_points(curve, low + (high - low) * SHARES)
    return piece.corners[:, 0]


def _groups(count: int, joins: Folds) -> list[list[int]]:
    """The strips that hang together by the joins, each group in increasing order."""
    group = list(range(count))
    for (k, _), (i, _) in joins.items():
        old, new = group[k], group[i]
        group = [new if g == old else g for g in group]
    return [[k for k in range(count) if group[k] == g] for g in dict.fromkeys(group)]


@dataclass(frozen=True, slots=True)
class _Beside:
    """Strips side by side that share long edges, to be fitted together. Those in ``skins`` are
    exact: of them the shared edges alone are fitted, with their places on the exact faces."""

    draft: Draft
    parts: list[Strip]
    group: list[int]
    joins: Folds
    skins: dict[int, Skin]

    def fitted(self, tolerance: float, degree: int) -> dict[int, Skin]:
        """The skins of the strips, within ``tolerance`` (mm) of the surfaces."""
        course = self.parts[self.group[0]].course
        slots = self._slots()
        places = [side for side in self._exact() if self.skins[side[0]].frame is not None]
        width = 3 * (max(slots.values()) + 1)
        spline, probe, t = self._spline(course, slots, places, tolerance, degree)
        points = self._points(t, slots)

        def rail(side: Side) -> Spline:
            return spline.part(_columns(slots[side]))

        out: dict[int, Skin] = {}
        for k in self.group:
            strip = self.parts[k]
            corners = self.draft.corner_points(strip)
            if k not in self.skins:
                true = np.stack([points[:, _columns(slots[k, s])] for s in (0, 1)], axis=1)
                rails = [rail((k, 0))], [rail((k, 1))]
                true = true[:, :, None]
                out[k] = ruled_skin(strip, corners, np.zeros((2, 3)), rails, probe, true)
        for k, side in self._exact():
            skin = out.get(k, self.skins[k])
            image = None
            if (k, side) in places:
                at = width + 2 * places.index((k, side))
                image = spline.part(slice(at, at + 2))
                image = replace(image, poles=image.poles / [_scale(skin), 1.0])
            true = points[:, _columns(slots[k, side])][:, None]
            out[k] = _with_edge(skin, side, rail((k, side)), image, (probe, true))
        return out

    def _slots(self) -> dict[Side, int]:
        """Of every long edge its number among the curves: edges that are one have one."""
        slots: dict[Side, int] = {}
        across = set(self.joins.values())
        for k in self.group:
            for side in (0, 1):
                shared = (k, side) in self.joins or (k, side) in across
                if k not in self.skins or shared:
                    source = self.joins.get((k, side))
                    slots[k, side] = len(set(slots.values())) if source is None else slots[source]
        return slots

    def _exact(self) -> list[Side]:
        """The shared edges of exact strips; on round ones their place on the face is fitted too."""
        shared = {*self.joins, *self.joins.values()}
        sides = [(k, side) for k in self.group if k in self.skins for side in (0, 1)]
        return [side for side in sides if side in shared]

    def _points(self, t: Array, slots: dict[Side, int]) -> Array:
        """All curves side by side at t (n,), (n, 3 times their number)."""
        out = np.zeros((len(t), 3 * (max(slots.values()) + 1)))
        rails = {k: self.parts[k].rails(t)[:, :, 0] for k, _ in slots}
        for (k, side), slot in reversed(slots.items()):  # the earliest strip's holds
            out[:, _columns(slot)] = rails[k][:, side]
        return out

    def _images(self, t: Array, points: Array, slots: dict[Side, int], places: list[Side]) -> Array:
        """The curves' points with their places on exact faces (u in mm of arc), side by side."""
        columns = [points]
        for k, side in places:
            skin = self.skins[k]
            surface, frame = skin.surfaces[0], skin.frame
            assert frame is not None and not isinstance(surface, Ruled)
            v = heights(surface, points[:, _columns(slots[k, side])])  # type: ignore[arg-type]
            columns.append(np.stack([_scale(skin) * frame.angle(t), v], axis=1))
        return np.concatenate(columns, axis=1)

    def _spline(
        self,
        course: Course,
        slots: dict[Side, int],
        places: list[Side],
        tolerance: float,
        degree: int,
    ) -> tuple[Spline, Array, Array]:
        """All curves on one knot vector, and places s and t (n,) where they are compared."""

        def curves(t: Array) -> Array:
            return self._images(t, self._points(t, slots), slots, places)

        corners = np.zeros((2, 3 * (max(slots.values()) + 1)))
        for (k, side), slot in slots.items():
            corners[:, _columns(slot)] = self.draft.corner_points(self.parts[k])[:, side, 0]
        rows = self._images(course.t[[0, -1]], corners, slots, places)
        ends = rows[0], rows[1]
        spline = polynomial(curves, course, ends)
        if spline is None and not places:
            found = arcs(curves, course, ends)
            if found is not None:  # its parameter is not the patch's: each point at its own place
                return found.spline, found.s, found.t
        if spline is None:
            ruled = [k for k in self.group if k not in self.skins]
            blocks = [_columns(slot) for slot in sorted(set(slots.values()))]
            blocks += [slice(a, a + 2) for a in range(corners.shape[1], rows.shape[1], 2)]
            faces = tuple((_columns(slots[k, 0]), _columns(slots[k, 1])) for k in ruled)
            twist = max([twist_limit(self.parts[k]) for k in ruled], default=np.inf)
            demand = Demand(degree, tolerance, tuple(blocks), faces, twist=twist)
            held = Ends(ends, None if len(ruled) < len(self.group) else self._slopes(slots))
            spline = fit(curves, course, held, demand).spline
        probe = probe_places(spline)
        return spline, probe, course(probe)

    def _slopes(self, slots: dict[Side, int]) -> tuple[Array, Array] | None:
        """d/ds of all curves at both ends, where they are finite; all strips are fitted."""
        out = np.zeros((2, 3 * (max(slots.values()) + 1)))
        for k in reversed(self.group):
            found = end_slopes(self.parts[k])
            if found is None:
                return None
            for side in (0, 1):
                out[:, _columns(slots[k, side])] = np.array(found)[:, _columns(side)]
        return out[0], out[1]


def _with_edge(
    skin: Skin, side: int, curve: Spline, image: Trace | None, probes: tuple[Array, Array]
) -> Skin:
    """An exact strip with another curve for one of its long edges."""
    ends = skin.sides[side][0], skin.sides[side][-1]
    corners = np.stack([ends[0].corners[0], ends[1].corners[1]])
    span = float(curve.knots[0]), float(curve.knots[-1])
    t = ends[0].t[0], ends[1].t[1]
    piece = Piece(t, corners, (curve,), (span,), (image,), probes)
    sides = ([piece], skin.sides[1]) if side == 0 else (skin.sides[0], [piece])
    return replace(skin, sides=sides)


def _scale(skin: Skin) -> float:
    """mm of arc for a radian on the face of a round strip."""
    return float(skin.surfaces[0].radius)  # type: ignore[union-attr]


def _columns(slot: int) -> slice:
    return slice(3 * slot, 3 * slot + 3)
