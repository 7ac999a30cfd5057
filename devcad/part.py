"""Panel and Part: what a build gives and what the exporters receive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from devcad.checks import Check
from devcad.flatten.blank import Blank
from devcad.flatten.lorentz import Spacetime
from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import Chain
from devcad.geometry.classify import Shape
from devcad.geometry.cuts import Cut
from devcad.geometry.seams import Meeting
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh

if TYPE_CHECKING:  # most panels are not pressed
    from devcad.flatten.bending import BendLine
    from devcad.geometry.linkage import Linkage
    from devcad.geometry.patch import Patch


@dataclass(frozen=True, slots=True)
class Fold:
    """A curved crease of a sheet: it is the base curve (v = 0) of flank number ``child`` and the
    ``side`` edge of flank number ``parent``. ``table`` tells the fold angle along it."""

    parent: int
    child: int
    side: Literal["base", "top"]
    table: tuple[Mapping[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Panel:
    """One piece cut from one sheet.

    ``chain`` is the middle surface as it stands in space (partly bent, if the job says so);
    ``shapes[k]`` says what its patch k is: an analytic surface with its numbers, or none.
    ``thickness`` is 0 for a surface. ``rulings[k]`` are the certified parameters of patch k.
    ``facts`` are the panel's entries for the report. ``spacetime`` is the middle surface, not
    bent, in Minkowski space, where it was constructed there. ``blank`` is what the pattern was
    laid out from, with the middle surface bent to the end; ``surface_area`` the area in mm2 of
    ``chain`` without what is cut out, None where the pattern has the same. ``bends`` are the
    bend lines of a panel that a press brake bends, and ``facets`` the patterns of its patches,
    plane patches too, which are more than those of the blank.

    A sheet folded along curved creases, ``folds``, is several chains: ``flanks`` are they, each a
    panel with its share of the pattern and with rulings at the same parameters. Its ``blank`` is
    the flank up to the crease, its ``chain`` what the groove of a thick sheet leaves of it. The
    sheet itself has the mesh and the pattern of all, and the chain of the first.
    """

    name: str
    kind: str
    chain: Chain
    shapes: tuple[Shape, ...]
    thickness: float
    rulings: tuple[Array, ...]
    mesh: Mesh
    pattern: Pattern
    facts: dict[str, Any] = field(default_factory=dict)
    spacetime: Spacetime | None = None
    cuts: tuple[Cut, ...] = ()
    blank: Blank | None = None
    surface_area: float | None = None
    bends: tuple[BendLine, ...] = ()
    facets: tuple[Patch, ...] = ()
    flanks: tuple[Panel, ...] = ()
    folds: tuple[Fold, ...] = ()

    @property
    def chains(self) -> tuple[Panel, ...]:
        """The flanks of a folded sheet, else the panel itself: one chain each."""
        return self.flanks or (self,)

    def places(self, number: int, t: Array, v: Array) -> Array:
        """The places (n, 2) in the pattern of points (t, v), each (n,), of a patch of the chain.

        Raises:
            ValueError: a panel that is known by its pattern alone.
        """
        if self.facets:
            return self.facets[number].point(t, v)[:, :2]
        if self.blank is None:
            raise ValueError(f"panel {self.name} has no blank")
        return self.blank.points(number, t, v)

    @property
    def area(self) -> float:
        """The area of the middle surface as it stands in space, without the cutouts, mm2."""
        return self.pattern.area if self.surface_area is None else self.surface_area


@dataclass(frozen=True, slots=True)
class Part:
    """One or more panels, with the tolerance they were built to and the checks they passed.

    ``material`` is the library's id of it, "" where the job names none. ``grain`` is in radians
    from +x in the pattern. ``quantity`` is how many of each panel the job asks for.
    ``linkages`` are its mechanisms.
    """

    name: str
    panels: tuple[Panel, ...]
    thickness: float
    tolerance: float
    checks: tuple[Check, ...]
    job_sha256: str = ""
    part_number: str = ""
    description: str = ""
    colour: tuple[float, float, float] = (0.62, 0.66, 0.70)
    seams: tuple[Meeting, ...] = ()
    material: str = ""
    revision: str = ""
    quantity: int = 1
    grain: float | None = None
    finish: str | None = None
    linkages: tuple[Linkage, ...] = ()
