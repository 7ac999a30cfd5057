"""What the page shows of a panel: the strips and sheets of its flanks, and how they move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from devcad.export.folding import sheet_of, strip_of
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers, motions, moved
from devcad.mesh.lodged import Sheet
from devcad.part import Panel

if TYPE_CHECKING:  # few sheets have curved creases
    from devcad.export.creased import Creased


@dataclass(frozen=True, slots=True)
class Piece:
    """The ``strips`` and ``sheets`` of a panel's flanks, one each of an ordinary one. A strip's
    triangles turn about its hinges; with ``fold`` every ruling is a body of its own."""

    strips: tuple[Hinged, ...]
    sheets: tuple[Sheet, ...]
    fold: Creased | None = None

    @property
    def moves(self) -> bool:
        """Whether it can be unrolled."""
        return self.fold is None or self.fold.moves

    def beside(self, k: int) -> Numbers:
        """The bodies (2, r) before and after every ruling of a flank."""
        strip = self.strips[k]
        if self.fold is None:
            return strip.beside()
        own = np.arange(strip.rulings) + k * strip.rulings
        return np.stack([own, own]).astype(np.int32)

    def bodies(self, k: int) -> Numbers:
        """The bodies (n,) that carry the points of a flank's sheet, each on its own ruling."""
        strip, sheet = self.strips[k], self.sheets[k]
        if self.fold is None:
            return sheet.body
        return (sheet.corners[:, 0] % strip.rulings + k * strip.rulings).astype(np.int32)

    def points(self, f: float, shift: tuple[float, float]) -> list[Array]:
        """Where the points (n, 3) of each sheet are at f, from 0, as built, to 1, the pattern,
        which lies ``shift`` from its own place."""
        if self.fold is None:
            (strip,), (sheet,) = self.strips, self.sheets
            return [moved(motions(strip, f, shift)[sheet.body], sheet.flat)]
        out = []
        motion = self.fold.motions(f, shift)
        for own, strip, sheet in zip(motion, self.strips, self.sheets, strict=True):
            ends = np.concatenate([moved(own, flat) for flat in strip.pattern])
            out.append(np.einsum("nk,nkj->nj", sheet.weights, ends[sheet.corners]))
        return out


def piece_of(panel: Panel) -> Piece | None:
    """What is shown of a panel; None where it is known by its pattern alone."""
    if panel.flanks:
        from devcad.export.creased import creased

        fold = creased(panel)
        every = zip(panel.flanks, fold.strips, strict=True)
        return Piece(fold.strips, tuple(sheet_of(flank, strip) for flank, strip in every), fold)
    strip = strip_of(panel)
    return None if strip is None else Piece((strip,), (sheet_of(panel, strip),))
