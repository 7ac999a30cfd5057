"""A body as plain numbers: vertices, edges on curves, faces on surfaces, and what to prove.

Everything that STEP needs is decided here and in the modules that fill these values; the kernel
only copies them. Points are (3,), places on a surface (2,), lengths mm, angles radians.
"""

from __future__ import annotations

from dataclasses import dataclass

from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Line:
    """The straight line between the edge's vertices; its parameter runs from 0 to the length."""


@dataclass(frozen=True, slots=True)
class Arc:
    """A circular arc: ``x`` points from the centre to its start, the parameter is the angle about
    ``axis`` from there."""

    centre: Array
    axis: Array
    x: Array
    radius: float


@dataclass(frozen=True, slots=True)
class Ellipse:
    """An arc of an ellipse: ``x`` points along the major radius, the parameter is the eccentric
    angle about ``axis`` from there."""

    centre: Array
    axis: Array
    x: Array
    major: float
    minor: float


@dataclass(frozen=True, slots=True)
class Point:
    """No curve at all: the edge of a face that is drawn together in one vertex."""


Curve = Line | Arc | Ellipse | Point | Spline


@dataclass(frozen=True, slots=True)
class Edge:
    """From vertex ``start`` to vertex ``end`` along ``curve``, parameter over ``span``.

    ``probes``: parameters (k,) and the true points (k, 3) there, where the curve is fitted.
    """

    start: int
    end: int
    curve: Curve
    span: tuple[float, float]
    probes: tuple[Array, Array] | None = None


@dataclass(frozen=True, slots=True)
class Straight:
    """An edge on a surface: ``origin`` + parameter of the edge x ``direction``."""

    origin: Array
    direction: Array


@dataclass(frozen=True, slots=True)
class Stretch:
    """An edge on a surface: from ``start`` to ``end``, evenly over the edge's span."""

    start: Array
    end: Array


Trace = Straight | Stretch | Spline


@dataclass(frozen=True, slots=True)
class Plane:
    """The plane through ``point`` with the normal ``normal``."""

    point: Array
    normal: Array


@dataclass(frozen=True, slots=True)
class Cylinder:
    """u = angle about ``axis`` from ``x``, v = height over ``point``."""

    point: Array
    axis: Array
    x: Array
    radius: float


@dataclass(frozen=True, slots=True)
class Cone:
    """u = angle about ``axis`` from ``x``, v = distance along the ruling from the circle of
    ``radius`` about ``point``, away from the apex; ``axis`` points away from the apex."""

    point: Array
    axis: Array
    x: Array
    radius: float
    half_angle: float


@dataclass(frozen=True, slots=True)
class Ruled:
    """The straight connection of two splines on one knot vector: ``low`` at u = 0, ``high`` at
    u = 1; v = their parameter.

    With u along the ruling, the kernels' plain quadrature (exact across u, knot by knot in v)
    gives area and volume to 1e-8; the other way round it is wrong by 5e-4 on long faces.
    """

    low: Spline
    high: Spline


Surface = Plane | Cylinder | Cone | Ruled


@dataclass(frozen=True, slots=True)
class Use:
    """An edge as a face runs along it; ``trace`` is its image on the surface (planes need none)."""

    edge: int
    forward: bool
    trace: Trace | None = None


@dataclass(frozen=True, slots=True)
class Face:
    """``loop`` runs counterclockwise seen from outside, ``holes`` clockwise; ``flipped`` says that
    the surface's own normal points inward.

    ``probes``: places (k, 2) and the true points (k, 3) there; for planes, cylinders and cones
    only the points, ``skin`` whether twist counts here (a front or back, not a wall).
    """

    surface: Surface
    loop: tuple[Use, ...]
    flipped: bool = False
    skin: bool = False
    places: Array | None = None
    points: Array | None = None
    holes: tuple[tuple[Use, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Body:
    """One panel: a solid, or a shell whose front is outside. ``volume`` is the exact volume that
    the solid must have, mm3; ``moved`` how far an exact edge was moved on purpose, mm."""

    name: str
    vertices: Array
    edges: tuple[Edge, ...]
    faces: tuple[Face, ...]
    solid: bool
    volume: float
    moved: float = 0.0
