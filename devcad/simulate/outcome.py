"""What the simulation of a sheet gives: states in equilibrium, and what the last one tells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from devcad.geometry.taylor import Array
from devcad.simulate.net import Net

KINDS = ("stretch", "ruling", "diagonal", "fold")
"""What energy is stored in, as the report names it."""


@dataclass(frozen=True, slots=True)
class State:
    """The sheet in equilibrium. ``share`` of the phase is done, positions (n, 3) and distances in
    mm, energies in N mm by kind, reactions (n, 3) in N; ``residual`` is the largest force in N that
    is not in balance, ``scale`` the largest that one bar, hinge or load exerts.

    While it folds, the sheet is laid onto the exact shape with the least sum of squares and
    ``furthest`` and ``rms`` are the distances of its material points from there; under loads it
    stays where it is held, and they are those from the built part. None: no exact shape is known.
    ``moments`` (n, 3) in N mm are what clamps exert beside the reactions. ``strain`` is the largest
    of a bar. A state that is not ``stable`` is left at the least push.
    """

    phase: Literal["fold", "load"]
    share: float
    positions: Array
    energies: dict[str, float]
    residual: float
    scale: float
    iterations: int
    method: str
    stable: bool
    strain: float
    reactions: Array
    moments: Array
    furthest: float | None
    rms: float | None


@dataclass(frozen=True, slots=True)
class Loaded:
    """A load and what it does: the ``displacement`` (mm) of the nodes that bear it along its force
    in the end, and the tangent ``stiffness`` (N/mm) against it before and after, None where
    nothing resists."""

    key: str
    force: float
    displacement: float
    stiffness: tuple[float | None, float | None]


@dataclass(frozen=True, slots=True)
class Outcome:
    """A simulation: its states in order, the first the flat (or the built) sheet, and what the
    last one tells.

    ``reactions`` are the sums over each support of the job, N, ``turning`` their moments about the
    part's origin, N mm; ``applied`` the sum of the loads.
    ``modes`` are the smallest eigenvalues of the tangent stiffness in N/mm, or where masses are
    known there are ``frequencies`` in Hz; ``mode_shapes`` (k, n, 3). ``angles`` are the fold angles
    of the crease edges in radians, wanted and reached, ``moments`` what each bears, N mm per mm.
    """

    net: Net
    states: tuple[State, ...]
    reactions: tuple[Array, ...]
    turning: tuple[Array, ...]
    applied: Array
    loads: tuple[Loaded, ...]
    modes: tuple[float, ...]
    frequencies: tuple[float, ...]
    mode_shapes: Array
    angles: tuple[Array, Array]
    moments: Array
    bars: int
    hinges: int
