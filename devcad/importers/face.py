"""A face of the CAD kernel as a sheet: its patch, and its border on it.

Read are planes, circular cylinders and cones, extrusions, lines that are turned about an axis,
B-spline and Bezier surfaces whose lines along one parameter are straight, and parallels of these.
Curves on the surface are the face's own (its pcurves), so that the sheet is the face exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as ShapeMap
from OCP.Geom import Geom_Surface
from OCP.ShapeFix import ShapeFix_Face
from OCP.TopAbs import TopAbs_FACE, TopAbs_FORWARD, TopAbs_REVERSED
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from devcad.errors import GeometryError, JobError
from devcad.flatten.sheets import Sheet, Side
from devcad.geometry import chebyshev
from devcad.geometry.cuts import Track
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.regularity import largest, warp
from devcad.geometry.taylor import Array, rows_cross, rows_dot
from devcad.importers._face_area import face_area
from devcad.importers._face_planes import flat_ground, plane_area
from devcad.importers._face_surfaces import Ground, basis, ground, normals
from devcad.importers._face_wires import Course, Loop, box, courses

TWIST_LIMIT = np.radians(0.01)
"""A ruling along which the tangent plane turns by more is none of a developable."""
CROSSED = 1e-7
"""A border place this share of the largest width beyond the regression curve lies beyond it."""
INSIDE = (0.2137, 0.4871, 0.8319)
"""Where on an edge the front is looked at, as shares of it: on no crease in its middle."""
SAMPLES = 64
"""Steps on one polynomial between which a border is seen to cross a break."""
HALVINGS = 60
"""A step halved so often is below the rounding of the parameter."""


def sheets(shape: TopoDS_Shape | Sequence[TopoDS_Shape]) -> tuple[Sheet, ...]:
    """The faces of a shape, or of several, in their order, as sheets.

    Edges that faces share have one key.

    Raises:
        GeometryError: there is no face, or one that cannot be unrolled; see ``read_face``.
        JobError: something else than a shape.
    """
    shapes = list(shape) if isinstance(shape, (list, tuple)) else [shape]
    for each in shapes:
        if not isinstance(each, TopoDS_Shape) or each.IsNull():
            raise JobError(
                f"a face to unroll is a build123d object or a TopoDS_Shape, not {each!r}",
                value=type(each).__name__,
                remedy="give a Face, a Shell or a list of faces",
            )
    faces = [face for each in shapes for face in _faces(each)]
    if not faces:
        raise GeometryError("there is no face to unroll", value=0, limit=1)
    keys = ShapeMap()
    found = []
    for number, face in enumerate(faces):
        try:
            found.append(read_face(face, keys))
        except GeometryError as error:
            raise (error.at(place=f"face {number}") if len(faces) > 1 else error) from None
    return tuple(found)


def read_face(face: TopoDS_Face, keys: ShapeMap | None = None) -> Sheet:
    """A face as a sheet, its front where the face looks to.

    The patch covers the face: v runs from 0 over all of it, t is the angle of a cylinder or cone,
    the parameter of an extruded curve or of a spline, a length on a plane.

    Raises:
        GeometryError: the surface has no straight lines along a parameter, twists by more than
            0.01 degree along one, or is crossed by its regression curve.
    """
    keys = ShapeMap() if keys is None else keys
    plain = TopoDS.Face(face.Oriented(TopAbs_FORWARD))
    surface = BRep_Tool.Surface_s(plain)
    loops = courses(plain, surface)
    if loops is None:
        plain = _seamed(plain)
        loops = courses(plain, surface)
        if loops is None:
            raise GeometryError(
                "the face runs round a closed surface without a seam",
                remedy="split it along one of its straight lines",
            )
    kind = basis(surface)
    found = ground(kind, box(loops[0]))
    found = flat_ground(surface, loops[0]) if found is None else found
    worst = _twist(found.patch)
    sides = [[_side(course, found, keys) for course in loop] for loop in loops]
    sign = -1.0 if face.Orientation() == TopAbs_REVERSED else 1.0
    turned = _turned_over(surface, sign, loops, sides, found.patch)
    patch = _reversed(found.patch) if turned else found.patch
    if turned:
        sides = [[_mirrored(side, found.patch) for side in loop] for loop in sides]
    if found.across is None:
        outer, *holes = (plane_area(loop) for loop in sides)
        area = outer - sum(holes)
    else:
        knots = [[side.track.series.knots for side in loop] for loop in sides]
        area = face_area(kind, loops, knots, found.across)
    return Sheet(patch, tuple(map(tuple, sides)), area, worst)


def _faces(shape: TopoDS_Shape) -> Iterator[TopoDS_Face]:
    explorer = TopExp_Explorer(shape, TopAbs_FACE)
    while explorer.More():
        yield TopoDS.Face(explorer.Current())
        explorer.Next()


def _seamed(face: TopoDS_Face) -> TopoDS_Face:
    """The face with a seam, where it runs round a closed surface."""
    fix = ShapeFix_Face(face)
    fix.FixMissingSeam()
    found = next(_faces(fix.Result()), face)
    return TopoDS.Face(found.Oriented(TopAbs_FORWARD))


def _scale(patch: Patch) -> Array:
    """The sizes of t and of v on a patch, (2,)."""
    t = np.linspace(*patch.domain, 9)
    return np.array([t[-1] - t[0], np.abs(patch.jet(t, 0).v_to[0]).max()])


def _side(course: Course, found: Ground, keys: ShapeMap) -> Side:
    """An edge of the border on the patch; knots where it crosses the patch's breaks."""
    patch, series = found.patch, course.series
    knots, breaks, across = series.knots, np.array(patch.breaks), found.across
    if across is not None and breaks.size:
        knots = _with_crossings(lambda s: series(s)[:, across], knots, breaks)
    on_patch = chebyshev.resolve(lambda s: found.place(series(s)), knots, scale=_scale(patch))
    return Side(Track(0, on_patch), course.forward, keys.Add(course.edge))


def _with_crossings(t: Callable[[Array], Array], knots: Array, breaks: Array) -> Array:
    """The knots and, between them, where t crosses a break."""
    shares = np.arange(SAMPLES) / SAMPLES
    s = np.append((knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1])
    value = t(s)
    after = value[:, None] > breaks
    step, which = np.nonzero(after[1:] != after[:-1])
    low, high, before = s[step], s[step + 1], after[step, which]
    for _ in range(HALVINGS if step.size else 0):
        middle = 0.5 * (low + high)
        same = (t(middle) > breaks[which]) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    every = np.sort(np.concatenate([knots, high]))
    apart = 1e-9 * (every[-1] - every[0])
    inner = [b for a, b in pairwise(every.tolist()) if b - a > apart and every[-1] - b > apart]
    return np.array([every[0], *inner, every[-1]])


def _turned_over(
    surface: Geom_Surface,
    sign: float,
    loops: tuple[Loop, ...],
    sides: list[list[Side]],
    patch: Patch,
) -> bool:
    """Whether the patch shows its back where the face shows its front, told along the border.

    Raises:
        GeometryError: some of the border lies beyond the regression curve.
    """
    shows, widths, places = [], [], []
    for loop, tracks in zip(loops, sides, strict=True):
        for course, side in zip(loop, tracks, strict=True):
            knots = course.series.knots
            s = knots[0] + (knots[-1] - knots[0]) * np.array(INSIDE)
            t, v, _, _ = side.track(s)
            frame = patch.frame(np.clip(t, *patch.domain))
            shows.append(sign * rows_dot(normals(surface, course.series(s)), frame.n))
            widths.append(frame.q + v * frame.a)
            places.append(patch.point(frame.t, v))
    show, width, place = (np.concatenate(x) for x in (shows, widths, places))
    told = np.abs(width) > CROSSED * np.nanmax(np.abs(width))  # an apex shows no side,
    told &= np.abs(show) > CROSSED * np.nanmax(np.abs(show))  # nor does a tip
    ahead, front = (np.unique(np.sign(x[told])) for x in (width, show))
    if ahead.size != 1 or front.size != 1:
        near = ", ".join(f"{x:.6g}" for x in place[int(np.nanargmin(width))])
        raise GeometryError(
            f"the face is crossed by its regression curve near ({near}): neighbouring straight "
            "lines cross there",
            remedy="trim the face before that curve",
        )
    return bool(front[0] < 0.0)


def _reversed(patch: Patch) -> Patch:
    """The same strip seen from its other side: every ruling run backwards, from its far end."""

    def field(t: Array, order: int) -> RulingJet:
        jet = patch.field(t, order)
        return RulingJet(jet.rail(jet.v_to), -jet.e, jet.v_from, jet.v_to - jet.v_from)

    return replace(patch, field=field)


def _mirrored(side: Side, patch: Patch) -> Side:
    """A border edge on the reversed patch: v counted from the other end."""
    old = side.track.series

    def place(s: Array) -> Array:
        t, v = old(s).T
        return np.column_stack([t, patch.jet(np.clip(t, *patch.domain), 0).v_to[0] - v])

    series = chebyshev.resolve(place, old.knots, scale=_scale(patch))
    return replace(side, track=Track(0, series))


def _twist(patch: Patch) -> float:
    """The largest turn of the tangent plane along a ruling, radians, weighed by how much slower
    the ruling's slower end moves: where a fitted edge turns back its direction is noise.

    Raises:
        GeometryError: it is above 0.01 degree.
    """

    def turn(t: Array) -> Array:
        jet = patch.jet(t, 1)
        still, moving = rows_cross(jet.e[0], jet.c0[1]), rows_cross(jet.e[0], jet.e[1])
        low, high = still, still + jet.v_to[0][:, None] * moving
        fastest = np.maximum(rows_dot(low, low), rows_dot(high, high))
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.abs(rows_dot(jet.e[0], rows_cross(low, high))) / fastest
        return np.where(fastest == 0.0, 0.0, share)

    worst, t = largest(patch, turn)
    if not worst <= TWIST_LIMIT:
        degrees = float(np.degrees(abs(warp(patch, np.array([t]))[0])))
        place = ", ".join(f"{x:.6g}" for x in patch.point([t], patch.jet([t], 0).v_to[0])[0])
        raise GeometryError(
            f"not developable: the tangent plane turns {degrees:.4g} deg along the straight line "
            f"that ends at ({place}), limit 0.01 deg",
            value=degrees,
            limit=0.01,
            remedy="only planes, cylinders, cones and tangent surfaces can be unrolled",
        )
    return worst
