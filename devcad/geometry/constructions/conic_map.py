"""Maps on a cone or a cylinder: the conic and the cylindrical equal-area projections."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from devcad.errors import GeometryError, JobError, LimitError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Figure,
    NonNegative,
    closes,
    one_panel,
)
from devcad.geometry.constructions.projections import (
    POLE,
    Projection,
    conic,
    cosine,
    cylindrical_equal_area,
)
from devcad.geometry.curves import Number, Positive
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Field as RulingField
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

SLIMMEST = 1e-3
"""The sine of the smallest half-aperture: slimmer cones have their apex thousands of radii away,
too far for lengths on the map to keep ten digits."""
MAX_LINES = 2_000
"""Lines of a graticule at most."""
ON_THE_EDGE = 1e-9
"""A multiple of the step that is nearer to the panel's edge than this share of it lies there."""
Latitude = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-90.0, le=90.0)]
"""Degrees, north positive."""
LATITUDE = {"type": "number", "minimum": -90, "maximum": 90}


def _listed(value: Any) -> Any:
    return (value,) if isinstance(value, int | float) else value


Parallels = Annotated[
    tuple[Latitude, ...],
    Field(min_length=1, max_length=2),
    BeforeValidator(_listed),
    WithJsonSchema(
        {"anyOf": [LATITUDE, {"type": "array", "items": LATITUDE, "minItems": 1, "maxItems": 2}]}
    ),
]
"""One or two latitudes in degrees; one may stand without brackets."""


class ConicMap(Closable):
    """The cone, or the cylinder, that carries a map of the globe of ``radius``, north up.

    ``parallels`` = [p1, p2] are the standard parallels, true to scale; one number, or the same
    twice, is a cone that touches the globe. ``latitudes`` and ``longitudes`` = [from, to] bound
    the panel, all in degrees; the lines of the graticule lie at the multiples of ``graticule``
    (0: none) strictly inside it, on layer ENGRAVE.

    The axis is z, t the longitude eastwards in radians, e southwards: the front is the outside.
    Cone: half-aperture asin |n|, c0 = the apex, in the north (v > 0) or in the south (v < 0), at
    the height where the standard parallels lie on the mean at their heights on the globe.
    Cylinder: radius R cos p0, c0 = the northern edge, v the length southwards from it, the equator
    in z = 0. Source: geometry.md, section 10.
    """

    kind: Literal["conic-map"]
    projection: Literal["equidistant", "lambert", "albers", "cylindrical-equal-area"]
    radius: Positive
    parallels: Parallels
    latitudes: tuple[Latitude, Latitude]
    longitudes: tuple[Number, Number]
    graticule: NonNegative = 10.0

    @model_validator(mode="after")
    def _in_order(self) -> ConicMap:
        for name, (low, high) in (("latitudes", self.latitudes), ("longitudes", self.longitudes)):
            if not low < high:
                raise JobError(
                    f"{name}: from = {low:.9g} is not below to = {high:.9g}",
                    value=low,
                    limit=high,
                    remedy="give [from, to], east and north positive",
                )
        width = self.longitudes[1] - self.longitudes[0]
        if width > 360.0:
            raise JobError(
                f"longitudes: the map is {width:.9g} degrees wide, limit 360",
                value=width,
                limit=360.0,
                remedy="the globe has 360 degrees",
            )
        return self

    def build(self) -> Built:
        """One panel of one patch with its graticule.

        Raises:
            GeometryError: the standard parallels lie about the equator or at a pole where the
                projection has no cone, or a pole is infinitely far away; LimitError: too many
                lines.
        """
        south, north = (math.radians(x) for x in self.latitudes)
        west, east = (math.radians(x) for x in self.longitudes)
        projection, standard = self._projection(), self._standard()
        reach = [self.radius * projection.along(latitude) for latitude in (north, south)]
        if projection.n:
            base, extent = 0.0, (reach[0], reach[1])
            field = _cone(projection.n, self.radius * _apex_height(projection, standard), extent)
        else:
            base, extent = reach[0], (0.0, reach[1] - reach[0])
            field = _cylinder(self.radius * cosine(standard[0]), -base, extent[1])
        meridians = [math.radians(x) for x in _multiples(self.graticule, self.longitudes)]
        parallels = [math.radians(x) for x in _multiples(self.graticule, self.latitudes)]
        heights = [self.radius * projection.along(latitude) - base for latitude in parallels]
        return one_panel(
            (Patch(field, (west, east)),),
            closes(east - west),
            drawings=tuple(_lines(meridians, heights, (west, east), extent)),
            figures=_figures(projection, south, north),
            notes=_notes(projection, south, north),
        )

    def _standard(self) -> tuple[float, float]:
        """The standard parallels in radians, the southern first."""
        return math.radians(min(self.parallels)), math.radians(max(self.parallels))

    def _projection(self) -> Projection:
        """The projection; GeometryError where the parallels or the latitudes allow none."""
        first, second = self._standard()
        if self.projection == "cylindrical-equal-area":
            self._require_cylinder(first, second)
            return cylindrical_equal_area(second)
        if self.projection == "lambert" and max(abs(first), abs(second)) >= POLE:
            raise GeometryError(
                "parallels: a conformal cone with a standard parallel at the pole is a plane",
                value=90.0,
                limit=90.0,
                remedy="choose standard parallels between the poles",
            )
        n = 0.0 if first == -second else conic(self.projection, first, second).n
        if abs(n) < SLIMMEST:
            raise GeometryError(
                f"parallels: {math.degrees(first):.6g} and {math.degrees(second):.6g} lie about as "
                f"far from the equator, so that the cone is a cylinder: its n is {n:.3g}",
                value=n,
                limit=SLIMMEST,
                remedy='use projection = "cylindrical-equal-area", or move one of them',
            )
        far = self.latitudes[0 if n > 0.0 else 1]
        if self.projection == "lambert" and abs(far) >= 90.0 and far * n < 0.0:
            raise GeometryError(
                f"latitudes: in a conformal map the pole at {far:.6g} lies infinitely far from "
                "the apex",
                value=far,
                limit=far,
                remedy="end the map before that pole, or use equidistant or albers",
            )
        return conic(self.projection, first, second)

    @staticmethod
    def _require_cylinder(first: float, second: float) -> None:
        """Raise where the two parallels are not of one cylinder."""
        if abs(first) != abs(second):
            raise GeometryError(
                "parallels: a cylinder has one standard parallel, north and south of the equator",
                value=math.degrees(first),
                limit=math.degrees(second),
                remedy="give one number",
            )
        if abs(second) >= POLE:
            raise GeometryError(
                "parallels: a cylinder that is true to scale at the pole has no width",
                value=90.0,
                limit=90.0,
                remedy="give a standard parallel between the poles",
            )


def _cone(n: float, apex: float, extent: tuple[float, float]) -> RulingField:
    """The rulings of the cone with its apex at height ``apex``, t the longitude."""
    down = -math.sqrt((1.0 - n) * (1.0 + n))

    def field(t: Array, order: int) -> RulingJet:
        s, c = taylor.sin_cos(taylor.variable(t, order))
        return RulingJet(
            taylor.constant_vector((0.0, 0.0, apex), order, t.size),
            np.stack([n * c, n * s, taylor.constant(down, order, t.size)], axis=-1),
            taylor.constant(extent[0], order, t.size),
            taylor.constant(extent[1], order, t.size),
        )

    return field


def _cylinder(radius: float, top: float, length: float) -> RulingField:
    """The rulings down the cylinder from height ``top``, t the longitude."""

    def field(t: Array, order: int) -> RulingJet:
        s, c = taylor.sin_cos(taylor.variable(t, order))
        height = taylor.constant(top, order, t.size)
        return RulingJet(
            np.stack([radius * c, radius * s, height], axis=-1),
            taylor.constant_vector((0.0, 0.0, -1.0), order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(length, order, t.size),
        )

    return field


def _apex_height(projection: Projection, standard: tuple[float, float]) -> float:
    """The apex's height, in globe radii, that puts the standard parallels on the mean where the
    globe has them."""
    slope = math.sqrt((1.0 - projection.n) * (1.0 + projection.n))
    return math.fsum(math.sin(x) + slope * projection.along(x) for x in standard) / 2.0


def _multiples(step: float, bounds: tuple[float, float]) -> list[float]:
    """The multiples of a step strictly between two bounds; none for the step 0."""
    low, high = (bound / step if step else 0.0 for bound in bounds)
    if high - low > MAX_LINES:
        raise LimitError(
            f"graticule: a step of {step:.6g} degrees makes {high - low:.4g} lines, "
            f"limit {MAX_LINES}",
            value=step,
            limit=MAX_LINES,
            remedy="give a larger step, or 0 for no lines",
        )
    first, last = math.floor(low + ON_THE_EDGE) + 1, math.ceil(high - ON_THE_EDGE)
    return [step * k for k in range(first, last)]


def _lines(
    meridians: list[float],
    heights: list[float],
    longitudes: tuple[float, float],
    extent: tuple[float, float],
) -> Iterator[Drawing]:
    """The meridians, then the parallels, across the whole panel."""
    for longitude in meridians:
        yield Drawing("ENGRAVE", 0, partial(_ruling, longitude), extent)
    for height in heights:
        yield Drawing("ENGRAVE", 0, partial(_circle, height), longitudes)


def _ruling(longitude: float, u: Array) -> tuple[Array, Array, Array, Array]:
    """A meridian by v."""
    return np.full_like(u, longitude), u, np.zeros_like(u), np.ones_like(u)


def _circle(height: float, u: Array) -> tuple[Array, Array, Array, Array]:
    """A parallel by the longitude."""
    return u, np.full_like(u, height), np.ones_like(u), np.zeros_like(u)


def _figures(projection: Projection, south: float, north: float) -> dict[str, Figure]:
    """n, the half-aperture, and the scales h and k between two latitudes as far as finite."""
    places = [south, north]
    if south < projection.narrowest < north:
        places.append(projection.narrowest)
    values = {"n": projection.n, "half_aperture_deg": math.degrees(math.asin(abs(projection.n)))}
    for name, scale in (
        ("scale_along_meridians", projection.meridian),
        ("scale_along_parallels", projection.parallel),
    ):
        scales = [scale(latitude) for latitude in places]
        values |= {f"{name}_min": min(scales), f"{name}_max": max(scales)}
    return {name: Figure(x, 0) for name, x in values.items() if math.isfinite(x)}


def _notes(projection: Projection, south: float, north: float) -> tuple[str, ...]:
    """What the panel is isometric to, and where a scale is infinite."""
    sheet = "fan is isometric to the cone" if projection.n else "sheet is isometric to the cylinder"
    notes = [
        f"the {sheet}, not to the sphere: the globe's lengths change by the figures "
        "scale_along_meridians and scale_along_parallels, 1 being true to scale"
    ]
    if not all(math.isfinite(projection.parallel(latitude)) for latitude in (south, north)):
        notes.append("the map reaches a pole, where the scale along the parallels is infinite")
    return tuple(notes)
