"""The kernel's curves as curves with exact derivatives of every order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from OCP.Geom import (
    Geom_BezierCurve,
    Geom_BSplineCurve,
    Geom_Circle,
    Geom_Conic,
    Geom_Curve,
    Geom_Ellipse,
    Geom_Hyperbola,
    Geom_Line,
    Geom_OffsetCurve,
    Geom_Parabola,
    Geom_TrimmedCurve,
)
from OCP.GeomConvert import GeomConvert
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.curve import Curve, CurveJet
from devcad.geometry.splines import bspline
from devcad.geometry.taylor import Array

Span = tuple[float, float]
T = TypeVar("T")


def curve_of(curve: Geom_Curve, span: Span) -> Curve:
    """The curve over ``span`` of its own parameter, breaks where it is less smooth than elsewhere.

    Raises:
        GeometryError: a kind of curve that has no closed form here.
    """
    return replace(_whole(curve, span), domain=span)


def _whole(curve: Geom_Curve, span: Span) -> Curve:
    if isinstance(curve, Geom_TrimmedCurve):
        return _whole(curve.BasisCurve(), span)
    if isinstance(curve, Geom_Line):
        place = curve.Position()
        return Curve(_line(xyz(place.Location()), xyz(place.Direction())), span)
    if isinstance(curve, Geom_Conic):
        return Curve(_conic(curve), span)
    if isinstance(curve, Geom_BezierCurve):
        return _spline(GeomConvert.CurveToBSplineCurve_s(curve), span)
    if isinstance(curve, Geom_BSplineCurve):
        return _spline(curve, span)
    if isinstance(curve, Geom_OffsetCurve):
        return _offset(curve, span)
    raise GeometryError(
        f"a curve of the type {type(curve).__name__} has no closed form",
        value=type(curve).__name__,
        remedy="convert it to a B-spline first",
    )


def _line(point: Array, direction: Array) -> CurveJet:
    def jet(t: Array, order: int) -> Array:
        return point_series(point, order, t.size) + taylor.mul(
            taylor.variable(t, order), taylor.constant_vector(direction, order, t.size)
        )

    return jet


def point_series(point: Array, order: int, count: int) -> Array:
    """The series of a fixed point, (order + 1, count, 3)."""
    return taylor.constant_vector(point, order, count)


def _conic(curve: Geom_Conic) -> CurveJet:
    """Centre + f(t) x + g(t) y, with f and g of the conic's kind."""
    centre, x, y = axes(curve.Position())
    pair: Callable[[Array], tuple[Array, Array]]
    if isinstance(curve, (Geom_Circle, Geom_Ellipse)):
        circle = isinstance(curve, Geom_Circle)
        a = curve.Radius() if circle else curve.MajorRadius()
        b = curve.Radius() if circle else curve.MinorRadius()

        def pair(t: Array) -> tuple[Array, Array]:
            sine, cosine = taylor.sin_cos(t)
            return a * cosine, b * sine

    elif isinstance(curve, Geom_Hyperbola):
        major, minor = curve.MajorRadius(), curve.MinorRadius()

        def pair(t: Array) -> tuple[Array, Array]:
            sine, cosine = taylor.sinh_cosh(t)
            return major * cosine, minor * sine

    else:
        assert isinstance(curve, Geom_Parabola)
        focal = curve.Focal()

        def pair(t: Array) -> tuple[Array, Array]:
            return taylor.mul(t, t) / (4.0 * focal), t

    def jet(t: Array, order: int) -> Array:
        f, g = pair(taylor.variable(t, order))
        return (
            point_series(centre, order, t.size)
            + taylor.mul(f, taylor.constant_vector(x, order, t.size))
            + taylor.mul(g, taylor.constant_vector(y, order, t.size))
        )

    return jet


def _spline(curve: Geom_BSplineCurve, span: Span) -> Curve:
    degree, knots, poles = spline_data(curve)
    weights = poles[:, 3]
    plain = bool(np.ptp(weights) == 0.0)
    points = poles[:, :3] / weights[:, None]
    whole = bspline(degree, knots, points, None if plain else weights)
    breaks = tuple(sorted({*whole.breaks, *whole.corners}))
    jet, breaks = repeated(whole.jet, whole.domain, breaks, span)
    return Curve(jet, span, breaks)


def spline_data(curve: Geom_BSplineCurve) -> tuple[int, Array, Array]:
    """Degree, full knot vector and homogeneous control points (n, 4) of a spline, clamped where
    it was periodic."""
    if curve.IsPeriodic():
        curve = curve.Copy()
        curve.SetNotPeriodic()
    poles = np.ones((curve.NbPoles(), 4))
    for k in range(curve.NbPoles()):
        weight = curve.Weight(k + 1)
        poles[k] = [*(weight * xyz(curve.Pole(k + 1))), weight]
    knots = [
        curve.Knot(k) for k in range(1, curve.NbKnots() + 1) for _ in range(curve.Multiplicity(k))
    ]
    return curve.Degree(), np.array(knots), poles


def repeated(
    jet: Callable[[Array, int], T], domain: Span, breaks: tuple[float, ...], span: Span
) -> tuple[Callable[[Array, int], T], tuple[float, ...]]:
    """A jet and its breaks over ``span``, which may reach over the ends of ``domain``, the period
    of a closed curve; where it stays within, both are as they were."""
    low, high = domain
    period = high - low
    slack = 1e-9 * period
    first = int(np.floor((span[0] - low + slack) / period))
    last = int(np.ceil((span[1] - low - slack) / period)) - 1
    inside = [b + k * period for k in range(first, last + 1) for b in (low, *breaks)]
    kept = tuple(b for b in inside if span[0] + slack < b < span[1] - slack)
    if first == last == 0:
        return jet, kept

    def turned(t: Array, order: int) -> T:
        turn = np.clip(np.floor((t - low) / period), first, last)
        return jet(t - turn * period, order)

    return turned, kept


def _offset(curve: Geom_OffsetCurve, span: Span) -> Curve:
    """C + d unit(C' x V), as the kernel defines it."""
    basis = _whole(curve.BasisCurve(), span)
    reference, distance = xyz(curve.Direction()), float(curve.Offset())

    def jet(t: Array, order: int) -> Array:
        along = basis.jet(t, order + 1)
        side = taylor.cross(
            taylor.derivative(along), taylor.constant_vector(reference, order, t.size)
        )
        return np.asarray(along[: order + 1] + distance * taylor.unit(side))

    return replace(basis, jet=jet)


def axes(place: gp_Ax2) -> tuple[Array, Array, Array]:
    """Origin, x and y of a placement."""
    return xyz(place.Location()), xyz(place.XDirection()), xyz(place.YDirection())


def xyz(value: gp_Pnt | gp_Dir) -> Array:
    """A point or a direction as an array (3,)."""
    return np.array([value.X(), value.Y(), value.Z()])
