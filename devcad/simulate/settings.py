"""What a job asks of a simulation, as plain values in mm, N and N/mm2."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

EdgeName = Literal["start", "end", "base", "top", "crease"]
"""A border of the sheet's pattern, or its creases."""
Axis = Literal["x", "y", "z"]
"""A direction in space, of the part as it is built."""

MOST_NODES = 20_000
"""Of a simulated sheet: what fits into the memory of one machine."""


@dataclass(frozen=True, slots=True)
class Where:
    """Nodes of the sheet: those on an ``edge``, or what lies at a place ``at`` of the pattern.

    ``key`` is where the job speaks of them, such as simulate.loads[0].
    """

    edge: EdgeName | None
    at: tuple[float, float] | None
    key: str


@dataclass(frozen=True, slots=True)
class Support:
    """Nodes that keep some of their coordinates when loads come; with ``clamp`` the sheet cannot
    turn about the edge either."""

    where: Where
    fix: tuple[Axis, ...]
    clamp: bool


@dataclass(frozen=True, slots=True)
class Load:
    """A force in N, the whole of it, shared by the nodes it acts on as an even load would be."""

    where: Where
    force: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Simulation:
    """How a sheet is simulated. Lengths in mm, ``youngs`` in N/mm2, ``weight`` a direction.

    ``steps`` fold the creases, ``load_steps`` bring the loads. ``cells`` are those along the
    rulings' parameter, ``across`` those along the rulings of each strip; None leaves them to the
    panel's own rulings and to the cells' shape. ``length_scale`` is that of the creases (L*), None
    for creases that keep their fold angle. ``youngs``, ``poisson`` and ``thickness`` None are the
    material's and the job's.
    """

    steps: int = 20
    load_steps: int = 10
    cells: int | None = None
    across: int | None = None
    coefficients: str = "exact"
    length_scale: float | None = None
    youngs: float | None = None
    poisson: float | None = None
    thickness: float | None = None
    modes: int = 6
    panel: str | None = None
    weight: tuple[float, float, float] | None = None
    supports: tuple[Support, ...] = field(default=())
    loads: tuple[Load, ...] = field(default=())

    @property
    def loaded(self) -> bool:
        """Whether anything pulls at the sheet."""
        return bool(self.loads) or self.weight is not None
