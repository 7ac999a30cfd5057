"""The degree of a rational curve, and those of two developables that belong to it."""

from __future__ import annotations

import re

import numpy as np

from devcad.geometry.chebyshev import nodes
from devcad.geometry.classify import EXACT
from devcad.geometry.curve import Curve
from devcad.geometry.curves import (
    BsplineCurve,
    CircleCurve,
    CurveModel,
    EllipseCurve,
    ExpressionCurve,
    PointsCurve,
)
from devcad.geometry.taylor import Array

MOST = 40
"""The highest degree that is looked for."""
WAVES = 512
"""Samples of a period; orders up to half of them are seen apart."""
DROWNED = 1e-13
"""A coefficient below this share of the largest is rounding."""
HIGH = 40
"""The derivative on which a trigonometric polynomial is proved: it magnifies hidden waves."""
AGREES = 0.1
"""Share to which that derivative must be the one expected; rounding moves it by less."""

_WORDS = re.compile(r"[A-Za-z_]+(?![A-Za-z_0-9.])|(?<![0-9.])[A-Za-z_]\w*")
_POWERS = re.compile(r"\*\*(?!\s*\+?\s*\d+\s*(?:[-+*/)]|$))")


def degree_of_tangent_developable(degree: int, genus: int = 0) -> int:
    """2 (d + g - 1): the degree of the surface of a space curve's tangents.

    Holds for smooth general curves in space of that degree and genus; where the curve has cusps
    or stationary osculating planes of higher kind the surface may be simpler.

    Source: geometry.md, section 6 (rational cases counted by resultants).
    """
    return 2 * (degree + genus - 1)


def degree_of_edge_surface(degree: int, genus: int = 0) -> int:
    """2 (d - 3) (d + g - 1): the degree of the surface of a space curve's bitangent planes.

    Holds for smooth general curves in space of that degree and genus; 0 says that no plane
    touches the curve twice, as for the twisted cubic.

    Source: geometry.md, section 6 (rational cases counted by resultants).
    """
    return 2 * (degree - 3) * (degree + genus - 1)


def rational_degree(curve: Curve, spec: CurveModel | None = None) -> int | None:
    """The degree of a curve that is known to be rational as a whole, else None.

    Rational are polynomials, quotients of them, B-splines of one span, circles and ellipses, and
    trigonometric polynomials over whole periods, whose degree is twice their order. That a curve
    is polynomial or trigonometric shows in its exact derivatives: those of a high order vanish,
    or are what the Fourier coefficients say. That its parametrisation covers it once is assumed,
    apart from a trigonometric one's.

    Args:
        spec: the curve's table in the job, where there is one: what the kind says is exact.
    """
    if curve.breaks or curve.corners:
        return None
    if isinstance(spec, CircleCurve | EllipseCurve):
        return 2
    degree = _polynomial_degree(curve)
    if degree is None and _is_quotient(spec):
        degree = _quotient_degree(curve)
    if degree is None and curve.closed:
        degree = _wave_degree(curve)
    return degree


def is_plane(points: Array) -> bool:
    """Whether points (n, 3) lie in a plane, within 1e-9 of their size."""
    across = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(across[-1] <= EXACT * across[0])


def _polynomial_degree(curve: Curve) -> int | None:
    """The degree of a curve whose higher derivatives are exactly zero, else None."""
    low, high = curve.domain
    t = low + (high - low) * np.array([0.0, 0.381966, 0.723607])
    series = np.abs(curve.jet(t, MOST + 2)).max(axis=1)  # (order, 3)
    if not np.isfinite(series).all() or series[MOST + 1 :].any():
        return None
    reach = max(abs(low), abs(high), 0.5 * (high - low))
    with np.errstate(over="ignore"):
        size = series * reach ** np.arange(MOST + 3)[:, None]
    told = size > DROWNED * size.max(axis=0)
    found = np.flatnonzero(told[1:].any(axis=1))
    return int(found[-1]) + 1 if len(found) else None


def _is_quotient(spec: CurveModel | None) -> bool:
    """Whether the curve's table alone says that its coordinates are quotients of polynomials."""
    if isinstance(spec, ExpressionCurve):
        return all(_is_algebra(part.text) for part in (spec.x, spec.y, spec.z))
    return isinstance(spec, BsplineCurve | PointsCurve)  # of one span: there are no breaks


def _is_algebra(text: str) -> bool:
    """Whether a formula has only t, numbers, + - * / and whole powers."""
    return set(_WORDS.findall(text)) <= {"t", "pi", "e"} and not _POWERS.search(text)


def _quotient_degree(curve: Curve) -> int | None:
    """The smallest d for which (x, y, z) = (X, Y, Z)/W with polynomials of degree d.

    Their coefficients are the null vector of X - x W = Y - y W = Z - z W = 0 at many points;
    common factors drop out by themselves. Each coordinate is brought to [-1, 1] first, which
    changes no degree.
    """
    t = nodes(*curve.domain, 2 * MOST + 7)
    points = curve.point(t)
    middle, half = 0.5 * (points.max(axis=0) + points.min(axis=0)), 0.5 * np.ptp(points, axis=0)
    x = (points - middle) / np.where(half > 0.0, half, 1.0)
    s = (2.0 * t - sum(curve.domain)) / (curve.domain[1] - curve.domain[0])
    powers = np.polynomial.chebyshev.chebvander(np.clip(s, -1.0, 1.0), MOST)
    for degree in range(1, MOST + 1):
        basis = powers[:, : degree + 1]
        blank = np.zeros_like(basis)
        rows = [
            np.hstack([*(basis if j == k else blank for j in range(3)), -x[:, k : k + 1] * basis])
            for k in range(3)
        ]
        singular = np.linalg.svd(np.vstack(rows), compute_uv=False)
        if singular[-1] <= DROWNED * singular[0]:
            return degree
    return None


def _wave_degree(curve: Curve) -> int | None:
    """Twice the order of a trigonometric polynomial over whole periods, else None.

    The waves are read off by Fourier's transform and proved on a high derivative, which a rest
    that had drowned in rounding would dominate. Waves that are all multiples of one cover the
    curve several times.
    """
    low, high = curve.domain
    t = low + (high - low) * np.arange(WAVES) / WAVES
    points = curve.point(t)
    amplitudes = np.fft.rfft(points - points.mean(axis=0), axis=0) / WAVES
    size = np.abs(amplitudes).max()
    level = DROWNED * size + np.finfo(float).eps * np.abs(points).max()
    waves = np.flatnonzero(np.abs(amplitudes).max(axis=1) > level)
    if not len(waves) or waves[-1] > MOST:
        return None
    known = np.where(np.abs(amplitudes[waves]) > level, amplitudes[waves], 0.0)
    probe = t[:: WAVES // 8] + 0.1 * (high - low) / WAVES
    actual = curve.jet(probe, HIGH)[HIGH]
    rate = 2j * np.pi / (high - low) * waves
    factor = np.cumprod(np.outer(1.0 / np.arange(1, HIGH + 1), rate), axis=0)[-1]
    expected = 2.0 * np.real((np.exp(np.outer(probe - low, rate)) * factor) @ known)
    missed, told = np.abs(actual - expected).max(axis=0), np.abs(expected).max(axis=0)
    if not np.all(missed <= AGREES * np.where(told > 0.0, told, told.max())):
        return None
    return 2 * int(waves[-1]) // int(np.gcd.reduce(waves))
