"""Drawing: a line on the sheet, given on the surface, that the pattern shows and no cutter cuts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from devcad.geometry.taylor import Array

OnSurface = Callable[[Array], tuple[Array, Array, Array, Array]]
"""u (n,) -> t, v and their derivatives dt/du, dv/du, each (n,)."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """One smooth line on patch number ``patch`` of a chain, over ``u`` = (from, to).

    ``path`` gives its places (t, v); ``layer`` is the pattern's layer, such as ENGRAVE.
    """

    layer: str
    patch: int
    path: OnSurface
    u: tuple[float, float]

    def scaled(self, factor: float) -> Drawing:
        """The line on the surface scaled by ``factor``: t stays, v is a length."""

        def path(u: Array) -> tuple[Array, Array, Array, Array]:
            t, v, dt, dv = self.path(u)
            return t, factor * v, dt, factor * dv

        return replace(self, path=path)
