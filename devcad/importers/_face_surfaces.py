"""The kernel's surfaces as patches, where rulings run along one of their parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from OCP.Geom import (
    Geom_BezierSurface,
    Geom_BSplineCurve,
    Geom_BSplineSurface,
    Geom_ConicalSurface,
    Geom_CylindricalSurface,
    Geom_ElementarySurface,
    Geom_Line,
    Geom_OffsetSurface,
    Geom_Plane,
    Geom_RectangularTrimmedSurface,
    Geom_Surface,
    Geom_SurfaceOfLinearExtrusion,
    Geom_SurfaceOfRevolution,
    Geom_SweptSurface,
    Geom_TrimmedCurve,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Pnt, gp_Vec

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.splinestrip import spline_strip
from devcad.geometry.taylor import Array
from devcad.importers._face_curves import curve_of, repeated, spline_data, xyz

STRAIGHT = 1e-9
"""A line of the surface is straight that leaves its chord by less than this share of the size."""
PER_SPAN = 4
"""Places on every span of a spline at which its lines are looked at."""
MOST_PLACES = 400
"""Rows or columns looked at, at most."""

Box = tuple[float, float, float, float]
"""Least and largest u, least and largest w."""


@dataclass(frozen=True, slots=True)
class Ground:
    """The patch that a surface is over a box of its parameters (u, w), v = 0 at the box's edge.

    ``place`` gives the patch's (t, v) at the surface's (u, w), (n, 2) -> (n, 2). ``across`` is 0
    where t is u and the rulings run along w, 1 where t is w; None on a plane.
    """

    patch: Patch
    place: Callable[[Array], Array]
    across: int | None


def basis(surface: Geom_Surface) -> Geom_Surface:
    """The same surface without trimming; an offset of a plane, a cylinder or a cone as what it is;
    a Bezier surface as a B-spline. The parameters stay."""
    if isinstance(surface, Geom_RectangularTrimmedSurface):
        return basis(surface.BasisSurface())
    if isinstance(surface, Geom_BezierSurface):
        return GeomConvert.SurfaceToBSplineSurface_s(surface)
    if isinstance(surface, Geom_OffsetSurface):
        plain = surface.Surface()
        return surface if plain is None else basis(plain)
    return surface


def ground(surface: Geom_Surface, box: Box) -> Ground | None:
    """The patch that a surface is over a box of (u, w); None where it is a plane there.

    Raises:
        GeometryError: neither its lines of constant u nor those of constant w are straight.
    """
    if isinstance(surface, Geom_Plane):
        return None
    if isinstance(surface, (Geom_CylindricalSurface, Geom_ConicalSurface)):
        return _round(surface, box)
    if isinstance(surface, Geom_OffsetSurface):
        return _offset(surface, box)
    points = _net(surface, box)
    if _plane(points):
        return None
    if isinstance(surface, Geom_SurfaceOfLinearExtrusion):
        return _extruded(surface, box)
    if _straight(points, axis=1) and isinstance(surface, Geom_SurfaceOfRevolution):
        return _turned(surface, box)
    if isinstance(surface, Geom_BSplineSurface):
        for across in (1, 0):  # t is w where the lines along u are straight
            if _straight(points, axis=1 - across):
                return _ruled(surface, box, across)
    name = type(surface).__name__.removeprefix("Geom_")
    raise GeometryError(
        f"a face on a {name} near {_told(points[len(points) // 2, points.shape[1] // 2])} has no "
        "straight lines along its parameters, so it cannot be unrolled",
        value=name,
        remedy="use faces on planes, cylinders, cones, extrusions or ruled splines",
    )


def normals(surface: Geom_Surface, uw: Array) -> Array:
    """The surface's own normals S_u x S_w at (n, 2), not unit, (n, 3)."""
    point, du, dw = gp_Pnt(), gp_Vec(), gp_Vec()
    out = np.empty((len(uw), 3))
    for k, (u, w) in enumerate(uw.tolist()):
        surface.D1(u, w, point, du, dw)
        n = du.Crossed(dw)
        out[k] = n.X(), n.Y(), n.Z()
    return out


def points(surface: Geom_Surface, uw: Array) -> Array:
    """The surface's points at (n, 2), (n, 3)."""
    found = (surface.Value(u, w) for u, w in uw.tolist())
    return np.array([(p.X(), p.Y(), p.Z()) for p in found]).reshape(-1, 3)


def _told(point: Array) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*point)


def _net(surface: Geom_Surface, box: Box) -> Array:
    """Points of the surface over the box, (rows in u, columns in w, 3)."""
    u, w = _places(surface, box[:2], 0), _places(surface, box[2:], 1)
    grid = np.stack(np.meshgrid(u, w, indexing="ij"), axis=-1)
    return points(surface, grid.reshape(-1, 2)).reshape(len(u), len(w), 3)


def _places(surface: Geom_Surface, span: tuple[float, float], axis: int) -> Array:
    """Parameters over a span, several between any two knots."""
    knots = np.unique([*span, *(k for k in knots_along(surface, axis) if span[0] < k < span[1])])
    steps = max(PER_SPAN, 16 // max(len(knots) - 1, 1))
    even = np.arange(steps) / steps
    inside = (knots[:-1, None] + np.diff(knots)[:, None] * even).ravel()
    every_place = np.append(inside, knots[-1])
    step = -(-len(every_place) // MOST_PLACES)
    return np.append(every_place[:-1:step], every_place[-1])


def knots_along(surface: Geom_Surface, axis: int) -> list[float]:
    """The knots of a spline surface, or of the curve that a surface is swept from."""
    if isinstance(surface, Geom_BSplineSurface):
        count = surface.NbVKnots() if axis else surface.NbUKnots()
        return [surface.VKnot(k) if axis else surface.UKnot(k) for k in range(1, count + 1)]
    if isinstance(surface, Geom_SweptSurface):
        swept = isinstance(surface, Geom_SurfaceOfRevolution) == bool(axis)
        curve = surface.BasisCurve()
        while isinstance(curve, Geom_TrimmedCurve):
            curve = curve.BasisCurve()
        if swept and isinstance(curve, Geom_BSplineCurve):
            return [curve.Knot(k) for k in range(1, curve.NbKnots() + 1)]
    return []


def _plane(net: Array) -> bool:
    flat = net.reshape(-1, 3)
    centred = flat - flat.mean(axis=0)
    normal = np.linalg.svd(centred.T @ centred)[0][:, 2]
    return bool(np.abs(centred @ normal).max() <= STRAIGHT * np.linalg.norm(np.ptp(flat, axis=0)))


def _straight(net: Array, axis: int) -> bool:
    """Whether the lines of a net along an axis are straight, and none turns back on itself."""
    net = np.moveaxis(net, axis, 0)  # (along, lines, 3)
    size = np.linalg.norm(np.ptp(net.reshape(-1, 3), axis=0))
    way = net[-1] - net[0]
    length = np.linalg.norm(way, axis=-1)
    unit = way / np.where(length > 0.0, length, 1.0)[:, None]
    away = net - net[0]
    along = np.einsum("ijk,jk->ij", away, unit)
    off = np.linalg.norm(away - along[..., None] * unit, axis=-1).max()
    back = -np.diff(along, axis=0).min()
    return bool(max(off, back) <= STRAIGHT * size)


def _strip(
    c0: Callable[[Array, int], Array],
    e: Callable[[Array, int], Array],
    length: float,
    domain: tuple[float, float],
    breaks: tuple[float, ...] = (),
) -> Patch:
    """The patch of rulings of one length."""

    def field(t: Array, order: int) -> RulingJet:
        zero = taylor.constant(0.0, order, t.size)
        return RulingJet(c0(t, order), e(t, order), zero, taylor.constant(length, order, t.size))

    return Patch(field, domain, breaks)


def _upright(patch: Patch, low: float) -> Ground:
    """The ground whose rulings are the lines along w, at unit speed; v = 0 at w = ``low``."""
    return Ground(patch, lambda uw: np.column_stack([uw[:, 0], uw[:, 1] - low]), 0)


def _circling(still: Array, x: Array, y: Array) -> Callable[[Array, int], Array]:
    """The jet of still + cos t x + sin t y."""

    def jet(t: Array, order: int) -> Array:
        sine, cosine = taylor.sin_cos(taylor.variable(t, order))
        parts = ((taylor.constant(1.0, order, t.size), still), (cosine, x), (sine, y))
        return np.asarray(sum(f[..., None] * vector for f, vector in parts))

    return jet


def _round(surface: Geom_ElementarySurface, box: Box) -> Ground:
    """A circular cylinder or cone: t the angle, rulings along w."""
    place = surface.Position()
    centre, axis = xyz(place.Location()), xyz(place.Direction())
    x, y = xyz(place.XDirection()), xyz(place.YDirection())
    angle, radius = 0.0, 0.0
    if isinstance(surface, Geom_ConicalSurface):
        angle, radius = surface.SemiAngle(), surface.RefRadius()
    elif isinstance(surface, Geom_CylindricalSurface):
        radius = surface.Radius()
    sine, cosine = np.sin(angle), np.cos(angle)
    u0, u1, low, high = box
    reach = radius + low * sine
    if abs(reach) <= 1e-12 * max(radius, abs((high - low) * sine)):
        reach = 0.0  # the apex
    c0 = _circling(centre + low * cosine * axis, reach * x, reach * y)
    e = _circling(cosine * axis, sine * x, sine * y)
    return _upright(_strip(c0, e, high - low, (u0, u1)), low)


def _extruded(surface: Geom_SurfaceOfLinearExtrusion, box: Box) -> Ground:
    """Rulings along the direction of extrusion; t the parameter of the curve."""
    u0, u1, low, high = box
    curve = curve_of(surface.BasisCurve(), (u0, u1))
    direction = xyz(surface.Direction())

    def c0(t: Array, order: int) -> Array:
        out = curve.jet(t, order).copy()
        out[0] += low * direction
        return out

    def e(t: Array, order: int) -> Array:
        return taylor.constant_vector(direction, order, t.size)

    return _upright(_strip(c0, e, high - low, (u0, u1), curve.breaks), low)


def _turned(surface: Geom_SurfaceOfRevolution, box: Box) -> Ground:
    """A straight line turned about an axis: a cylinder, a cone or a hyperboloid, which twists."""
    u0, u1, low, high = box
    place = surface.Axis()
    centre, axis = xyz(place.Location()), xyz(place.Direction())
    meridian = surface.BasisCurve()
    ends = [xyz(meridian.Value(w)) - centre for w in (low, high)]
    length = float(np.linalg.norm(ends[1] - ends[0]))
    direction = (ends[1] - ends[0]) / length

    def spun(vector: Array, origin: Array) -> Callable[[Array, int], Array]:
        along = (vector @ axis) * axis
        return _circling(origin + along, vector - along, np.cross(axis, vector))

    patch = _strip(spun(ends[0], centre), spun(direction, np.zeros(3)), length, (u0, u1))
    while isinstance(meridian, Geom_TrimmedCurve):
        meridian = meridian.BasisCurve()
    if isinstance(meridian, Geom_Line):
        return _upright(patch, low)
    return Ground(patch, _measured(surface, patch, 0), 0)


def _measured(surface: Geom_Surface, patch: Patch, across: int) -> Callable[[Array], Array]:
    """(t, v) by the point: t the parameter number ``across``, v how far along the ruling."""

    def place(uw: Array) -> Array:
        t = uw[:, across]
        jet = patch.jet(t, 0)
        v = np.einsum("ij,ij->i", points(surface, uw) - jet.c0[0], jet.e[0])
        return np.column_stack([t, v])

    return place


def _ruled(surface: Geom_BSplineSurface, box: Box, across: int) -> Ground:
    """Rulings between the two edges of the box; t the parameter number ``across``."""
    lines, span = (box[:2], box[2:]) if across else (box[2:], box[:2])
    isos = [(surface.UIso if across else surface.VIso)(at, False) for at in lines]
    (degree, knots, low), (_, _, high) = (spline_data(iso) for iso in isos)
    whole = spline_strip(degree, knots, low, high)
    field, breaks = repeated(whole.field, whole.domain, whole.breaks, span)
    top = span[1] if span[1] >= whole.domain[1] else float(np.nextafter(span[1], span[0]))

    def kept(t: Array, order: int) -> RulingJet:
        return field(np.clip(t, span[0], top), order)  # at a knot, from within

    patch = Patch(kept, span, breaks)
    return Ground(patch, _measured(surface, patch, across), across)


def _offset(surface: Geom_OffsetSurface, box: Box) -> Ground | None:
    """The parallel surface of a patch: the same rulings."""
    found = ground(basis(surface.BasisSurface()), box)
    if found is None:
        return None
    patch, middle = found.patch, np.array([[0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3])]])
    front = patch.frame(found.place(middle)[:, 0]).n[0]
    side = np.sign(normals(surface.BasisSurface(), middle)[0] @ front)
    return replace(found, patch=patch.parallel(float(side) * surface.Offset()))
