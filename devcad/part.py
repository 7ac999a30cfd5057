"""Panel and Part: what a build gives and what the exporters receive."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from devcad.checks import Check
from devcad.flatten.lorentz import Spacetime
from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import Chain
from devcad.geometry.classify import Shape
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh


@dataclass(frozen=True, slots=True)
class Panel:
    """One piece cut from one sheet.

    ``chain`` is the middle surface as it stands in space (partly bent, if the job says so);
    ``shapes[k]`` says what its patch k is: an analytic surface with its numbers, or none.
    ``thickness`` is 0 for a surface. ``rulings[k]`` are the certified parameters of patch k.
    ``facts`` are the panel's entries for the report. ``spacetime`` is the middle surface, not
    bent, in Minkowski space, where it was constructed there.
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


@dataclass(frozen=True, slots=True)
class Part:
    """One or more panels, with the tolerance they were built to and the checks they passed."""

    name: str
    panels: tuple[Panel, ...]
    thickness: float
    tolerance: float
    checks: tuple[Check, ...]
    job_sha256: str = ""
    part_number: str = ""
    description: str = ""
    colour: tuple[float, float, float] = (0.62, 0.66, 0.70)
