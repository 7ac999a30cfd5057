"""RailFit: how well a surface between given rails could be made, as its construction found it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RailFit:
    """``max_twist`` is the twist in degrees that the job accepts, None for the usual limit.

    ``crease`` is the largest crease in degrees that no corner of a rail asks for,
    ``largest_crease`` the largest of all. ``relaxed`` is how far a rail was moved, in the job's
    units, None where none was. ``advice`` says, where no developable was found, what came nearest
    and what may help.
    """

    crease: float
    largest_crease: float
    max_twist: float | None = None
    relaxed: float | None = None
    advice: str = ""
