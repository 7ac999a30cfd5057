"""The map projections that a cone or a cylinder carries, as functions of the latitude.

Angles are radians, lengths in units of the globe's radius. A conic projection puts the parallel
of latitude phi at the signed distance rho(phi) from the apex: positive below an apex in the north,
negative above one in the south, growing southwards in both. A difference of longitude makes n
times its angle at the apex, so that the map is the development of a cone whose half-aperture is
asin |n|.

Source: geometry.md, section 10; Snyder, Map Projections: A Working Manual (USGS Professional
Paper 1395), chapters 10, 14, 15 and 16. The forms here hold for one standard parallel as for two,
and keep their digits in between.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

POLE = 0.5 * math.pi
BISECTIONS = 60

OfLatitude = Callable[[float], float]


@dataclass(frozen=True, slots=True)
class Projection:
    """``along`` is rho of a cone, or the negative height on a cylinder (``n`` = 0): what grows
    southwards along a ruling. ``meridian`` is the scale h along the meridian, ``parallel`` the
    scale k along the parallel, infinite at a pole that is drawn as a line. ``narrowest`` is the
    latitude where k is smallest."""

    n: float
    along: OfLatitude
    meridian: OfLatitude
    parallel: OfLatitude
    narrowest: float


def cylindrical_equal_area(standard: float) -> Projection:
    """The cylinder of radius cos(standard) with heights sin phi / cos(standard)."""
    width = cosine(standard)

    def parallel(latitude: float) -> float:
        return _ratio(width, cosine(latitude))

    return Projection(
        0.0,
        lambda latitude: -math.sin(latitude) / width,
        lambda latitude: cosine(latitude) / width,
        parallel,
        0.0,
    )


def conic(kind: str, first: float, second: float) -> Projection:
    """The conic projection of a kind with its standard parallels, first <= second.

    They must not lie symmetrically about the equator, nor at a pole when conformal.
    """
    if first + second > 0.0:
        return NORTHERN[kind](first, second)
    north = NORTHERN[kind](-second, -first)
    return Projection(
        -north.n,
        lambda latitude: -north.along(-latitude),
        lambda latitude: north.meridian(-latitude),
        lambda latitude: north.parallel(-latitude),
        -north.narrowest,
    )


def cosine(latitude: float) -> float:
    """The cosine, exactly 0 at a pole."""
    return math.sin(POLE - abs(latitude))


def _equidistant(first: float, second: float) -> Projection:
    """True lengths along the meridians: rho = G - phi."""
    half = 0.5 * (second - first)
    n = math.sin(0.5 * (first + second)) * _ratio(math.sin(half), half, at_zero=1.0)

    def rho(latitude: float) -> float:
        return cosine(second) / n + (second - latitude)

    return _complete(n, (first, second), rho, lambda _: 1.0, n)


def _lambert(first: float, second: float) -> Projection:
    """Conformal: rho falls with exp(-n psi), psi the isometric latitude."""
    low, high = _isometric(first), _isometric(second)
    half = 0.5 * (high - low)
    if half > 1.0:
        n = 0.5 * math.log(cosine(first) / cosine(second)) / half
    else:
        turned = math.tanh(0.5 * (low + high)) * math.tanh(half)
        n = _ratio(math.atanh(turned), half, at_zero=math.sin(first))

    def rho(latitude: float) -> float:
        return cosine(first) / n * math.exp(n * (low - _isometric(latitude)))

    def meridian(latitude: float) -> float:
        return _ratio(n * rho(latitude), cosine(latitude))

    return _complete(n, (first, second), rho, meridian, math.inf)


def _albers(first: float, second: float) -> Projection:
    """Equal areas: n^2 rho^2 = C - 2 n sin phi, summed up from what is never negative."""
    n = math.sin(0.5 * (first + second)) * math.cos(0.5 * (second - first))
    beyond = 4.0 * (math.sin(0.5 * (POLE - first)) * math.sin(0.5 * (POLE - second))) ** 2

    def rho(latitude: float) -> float:
        return math.sqrt(beyond + 4.0 * n * math.sin(0.5 * (POLE - latitude)) ** 2) / n

    def meridian(latitude: float) -> float:
        return _ratio(cosine(latitude), n * rho(latitude), at_zero=n**-0.5)

    return _complete(n, (first, second), rho, meridian, math.sqrt(n))


NORTHERN = {"equidistant": _equidistant, "lambert": _lambert, "albers": _albers}
"""The conic projections with their apex in the north."""


def _complete(
    n: float, standard: tuple[float, float], rho: OfLatitude, meridian: OfLatitude, polar: float
) -> Projection:
    """The projection with k = n rho / cos phi; ``polar`` is its limit at a pole in the apex."""

    def parallel(latitude: float) -> float:
        return _ratio(n * rho(latitude), cosine(latitude), at_zero=polar)

    low, high = standard
    for _ in range(BISECTIONS):  # between the standard parallels k falls, then rises
        middle = 0.5 * (low + high)
        # (ln k)' = tan phi - h / rho
        rises = math.sin(middle) * rho(middle) > cosine(middle) * meridian(middle)
        low, high = (low, middle) if rises else (middle, high)
    return Projection(n, rho, meridian, parallel, 0.5 * (low + high))


def _isometric(latitude: float) -> float:
    """ln tan(pi/4 + phi/2), infinite at the poles."""
    if abs(latitude) >= POLE:
        return math.copysign(math.inf, latitude)
    return math.asinh(math.tan(latitude))


def _ratio(x: float, y: float, *, at_zero: float = math.inf) -> float:
    """x / y for y >= 0; where both vanish ``at_zero``, where only y does infinity."""
    if y > 0.0:
        return x / y
    return at_zero if x == 0.0 else math.inf
