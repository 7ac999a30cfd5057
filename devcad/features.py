"""Features: what a job cuts out of a panel, trims off it and draws on it; lengths in mm."""

from __future__ import annotations

from dataclasses import dataclass, replace

from devcad.geometry.edge import Edge
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Placing:
    """Where a feature's own origin lies and how far it is turned, in radians.

    Either ``at`` (x, y), a place in the pattern, the angle from +x; or ``at_surface`` =
    (share of t, share of the extent), both from 0 to 1, the angle from e towards m.
    """

    at: tuple[float, float] | None = None
    at_surface: tuple[float, float] | None = None
    angle: float = 0.0


@dataclass(frozen=True, slots=True)
class Cutout:
    """A closed contour about its own origin, counterclockwise, cut out of the pattern.

    ``place`` is where the job file says so; ``notch`` lets it cross edges and other cutouts.
    ``patches`` are the first and the last patch of the chain that it touches, where the pattern
    may pass it again: beyond the seam of a tube the numbers go on. None: all that it lies on.
    """

    place: str
    contour: tuple[Edge, ...]
    placing: Placing
    notch: bool = False
    patches: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Drill:
    """A straight drill of ``diameter`` along ``direction`` (3,) through ``point`` (3,), in the
    panel's own coordinates: the first wall that it meets from the point on, or with ``through``
    all that its axis meets on both sides."""

    place: str
    point: Array
    direction: Array
    diameter: float
    through: bool = False
    notch: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """Lines about their own origin, drawn on the pattern's layer MARK."""

    place: str
    lines: tuple[Edge, ...]
    placing: Placing


@dataclass(frozen=True, slots=True)
class Trim:
    """The plane through ``point`` (3,) in the panel's own coordinates; what its ``normal`` (3,)
    points to is cut off."""

    place: str
    point: Array
    normal: Array


@dataclass(frozen=True, slots=True)
class Features:
    """All of a panel's, in the order of the job file."""

    cutouts: tuple[Cutout | Drill, ...] = ()
    marks: tuple[Mark, ...] = ()
    trims: tuple[Trim, ...] = ()

    def moved(self, matrix: Array) -> Features:
        """The features of the panel that a rigid motion (4, 4) has put in its place: what is
        given in space moves along."""
        turn, shift = matrix[:3, :3], matrix[:3, 3]
        cutouts = tuple(
            replace(each, point=turn @ each.point + shift, direction=turn @ each.direction)
            if isinstance(each, Drill)
            else each
            for each in self.cutouts
        )
        trims = tuple(
            replace(each, point=turn @ each.point + shift, normal=turn @ each.normal)
            for each in self.trims
        )
        return replace(self, cutouts=cutouts, trims=trims)


@dataclass(frozen=True, slots=True)
class Seam:
    """Two edges, each (panel, start | end | base | top), that are to meet in space."""

    first: tuple[str, str]
    second: tuple[str, str]
    place: str = ""
