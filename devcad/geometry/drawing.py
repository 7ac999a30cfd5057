"""Drawing: a line on the sheet, given on the surface, that the pattern shows and no cutter cuts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from devcad.geometry.chain import Chain
from devcad.geometry.taylor import Array

OnSurface = Callable[[Array], tuple[Array, Array, Array, Array]]
"""u (n,) -> t, v and their derivatives dt/du, dv/du, each (n,)."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """One smooth line on patch number ``patch`` of a chain, over ``u`` = (from, to), from < to.

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

    def on(self, patch: int, later: float) -> Drawing:
        """The line on another patch, whose parameter is ``later`` by so much."""

        def path(u: Array) -> tuple[Array, Array, Array, Array]:
            t, v, dt, dv = self.path(u)
            return t + later, v, dt, dv

        return replace(self, patch=patch, path=path)


def carried(
    drawings: tuple[Drawing, ...], tube: Chain, opened: Chain, t: float
) -> tuple[Drawing, ...]:
    """The drawings of a tube on the same tube opened at t (:func:`devcad.geometry.chain.cut_at`).

    What lay on the patch that was cut lies on both its halves, each of which shows its part.
    """
    if opened is tube:
        return drawings
    patches = tube.patches
    at = next(k for k, patch in enumerate(patches) if t <= patch.domain[1])
    ahead = list(range(at if t < patches[at].domain[1] else at + 1, len(patches)))
    behind = list(range(at + 1))
    merged = len(ahead) + len(behind) - len(opened.patches)  # 1 where the seam was smooth
    seam = patches[-1].domain[1] - patches[0].domain[0] if merged else 0.0
    homes = [(source, k, 0.0) for k, source in enumerate(ahead)]
    for k, source in enumerate(behind):
        homes.append((source, len(ahead) + k - merged, 0.0 if k else seam))
    return tuple(
        drawing.on(patch, later)
        for drawing in drawings
        for source, patch, later in homes
        if source == drawing.patch
    )
