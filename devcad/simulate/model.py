"""A flat sheet as bars and hinges: nodes, cells and creases in, stiffnesses out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import JobError
from devcad.geometry.taylor import Array
from devcad.simulate import bars, stiffnesses
from devcad.simulate.bars import Indices
from devcad.simulate.material import Material
from devcad.simulate.stiffnesses import COEFFICIENTS, Coefficients, Lines
from devcad.simulate.topology import (
    DIAGONAL,
    KINDS,
    RULING,
    Faces,
    Hinges,
    Sheet,
    crossed,
    divided,
    joined,
    paired,
)

__all__ = ["COEFFICIENTS", "KINDS", "Coefficients", "Material", "Model", "Sheet", "build"]


@dataclass(frozen=True, slots=True)
class Model:
    """Bars and hinges of a sheet.

    ``flat`` (n, 2) mm: the sheet's nodes, then the centres of crossed panels, if any.
    ``bars`` (b, 2) with their lengths ``length`` (b,) mm; ``own`` (b,) N mm is E A L of bars by
    themselves; ``members`` (m, 3) the bars of triangles that couple them, ``forms`` (m, 3, 3)
    N mm. ``hinges`` (h, 4) as in ``hinges``, ``stiffness`` (h,) N mm, ``kinds`` (h,) numbers into
    KINDS, ``creases`` (c, k) the hinges of every row of ``sheet.creases``.
    """

    sheet: Sheet
    material: Material
    flat: Array
    bars: Indices
    length: Array
    own: Array
    members: Indices
    forms: Array
    hinges: Indices
    kinds: NDArray[np.int64]
    stiffness: Array
    creases: Indices

    @property
    def start(self) -> Array:
        """(n, 3) the sheet as it lies in its pattern, at z = 0."""
        return np.column_stack([self.flat, np.zeros(len(self.flat))])

    @property
    def size(self) -> float:
        """The diagonal of the pattern's box, mm."""
        return float(np.linalg.norm(np.ptp(self.flat, axis=0)))

    def rest(self, fold: Array | float) -> Array:
        """(h,) rest angles, radians: ``fold`` at the creases (one number or one each), else 0."""
        rest = np.zeros(len(self.hinges))
        rest[self.creases] = np.broadcast_to(np.reshape(fold, (-1, 1)), self.creases.shape)
        return rest

    def folds(self, angles: Array) -> Array:
        """(c,) fold angles of the creases, from (h,) angles of all hinges, radians."""
        return np.asarray(angles[self.creases].mean(axis=1))


def build(
    sheet: Sheet,
    material: Material,
    *,
    length_scale: Array | float | None = None,
    coefficients: str | Coefficients = "exact",
    held: NDArray[np.bool_] | None = None,
) -> Model:
    """The bar-and-hinge model of a flat sheet.

    Args:
        length_scale: L* in mm of the creases, K_F = L_F D / L*, one number or one for each row of
            ``sheet.creases``; None for creases that keep their fold angle, which those shorter
            than a millionth of their edge do as well.
        coefficients: a name of COEFFICIENTS, or one name for each kind.
        held: (n,) nodes that a clamp holds. A cell all of whose nodes are held does not bend, so
            that the clamp acts at the last held ruling and not half a cell further on.
    Raises:
        GeometryError: faces that overlap, turn over or are not joined edge to edge; a crease that
            is not an edge between two faces; crossed panels that are too long.
        JobError: an unknown name, a length scale that is not positive.
    Source:
        geometry.md, 8; each coefficient's own is told in ``bars`` and ``stiffnesses``.
    """
    names = _named(coefficients)
    faces = crossed(sheet) if names.bars == "filipov-2017" else divided(sheet)
    published = names.bars == "filipov-2017" or names.rulings == "woodruff-filipov"
    rows = joined(faces, sheet.creases) if published else paired(sheet, faces)
    lines = _lines(faces, rows, held)
    edges, length, own, members, forms = _stretching(faces, sheet, material, names.bars)
    return Model(
        sheet=sheet,
        material=material,
        flat=faces.flat,
        bars=edges,
        length=length,
        own=own,
        members=members,
        forms=forms,
        hinges=rows.hinges,
        kinds=rows.kinds,
        stiffness=_bending(lines, rows.kinds, rows.creases, material, names, length_scale),
        creases=rows.creases,
    )


def _named(coefficients: str | Coefficients) -> Coefficients:
    """The set of a name, or the set itself."""
    if isinstance(coefficients, Coefficients):
        return coefficients
    if coefficients not in COEFFICIENTS:
        known = ", ".join(COEFFICIENTS)
        raise JobError(
            f"coefficients are {coefficients!r}, must be one of {known}",
            value=coefficients,
            limit=known,
        )
    return COEFFICIENTS[coefficients]


def _stretching(
    faces: Faces, sheet: Sheet, material: Material, name: str
) -> tuple[Indices, Array, Array, Indices, Array]:
    """Bars, their lengths, their own stiffness, and the triangles that couple them."""
    flat, triangles = faces.flat, faces.triangles
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)  # (m, 3, 2)
    edges, member = np.unique(np.sort(pairs, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    members = member.reshape(-1, 3).astype(np.int64)
    length = np.linalg.norm(np.diff(flat[edges], axis=1)[:, 0], axis=1)
    own = np.zeros(len(edges))
    none = np.zeros((0, 3), dtype=np.int64), np.zeros((0, 3, 3))
    if name == "exact":
        return edges, length, own, members, bars.natural(flat, triangles, material)
    if name == "filipov-2017":
        long, high, cross = bars.crossed(sheet.flat, sheet.quads, material)
        around = members.reshape(-1, 4, 3)  # four triangles of a panel: side, spoke, spoke
        area = np.stack([long, high, long, high], axis=1)
        np.add.at(own, around[:, :, 0], area)
        np.add.at(own, around[:, :, 1], cross[:, None])
        return edges, length, material.youngs * own * length, *none
    made = bars.exact_shear if name == "exact-shear" else bars.hull_fit
    forms = made(flat, triangles, material)
    np.add.at(own, members, forms[:, range(3), range(3)])
    return edges, length, own, *none


def _lines(faces: Faces, rows: Hinges, held: NDArray[np.bool_] | None) -> Lines:
    """What the stiffness of a hinge line depends on."""
    hinges, cells = rows.hinges, rows.cells
    ends = faces.flat[hinges[:, :2]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    within = cells[:, 0] == cells[:, 1]
    free = faces.areas
    if held is not None and len(held) > 0:
        padded = np.append(np.asarray(held, dtype=bool), np.ones(len(faces.flat) - len(held), bool))
        still = np.ones(len(faces.areas), dtype=bool)
        np.logical_and.at(still, faces.cells, padded[faces.triangles].all(axis=1))
        free = np.where(still, 0.0, faces.areas)
    beside = free[cells].sum(axis=1) / 2
    beside = np.where(beside > 0, beside, faces.areas[cells].sum(axis=1) / 2)
    cell = cells[:, 0]
    diagonal, corners = faces.spans(hinges, cell)
    return Lines(
        length=length,
        area=np.asarray(beside),
        diagonal=np.where(within, diagonal, 0.0),
        panel=np.where(within, faces.areas[cell], 0.0),
        corners=np.where(within, corners, 0.0),
        share=rows.share,
    )


def _bending(
    lines: Lines,
    kinds: NDArray[np.int64],
    creases: Indices,
    material: Material,
    names: Coefficients,
    length_scale: Array | float | None,
) -> Array:
    """(h,) stiffness of every hinge, N mm."""
    stiffness = np.empty(len(kinds))
    for kind, table, name in (
        (RULING, stiffnesses.BENDING, names.rulings),
        (DIAGONAL, stiffnesses.DIAGONALS, names.diagonals),
    ):
        chosen = np.flatnonzero(kinds == kind)
        stiffness[chosen] = table[name](lines.of(chosen), material)
    at = lines.of(creases[:, 0])
    kept = stiffnesses.KEPT * at.length
    scale = kept if length_scale is None else np.asarray(length_scale)
    if not np.all(np.isfinite(scale) & (scale > 0)):
        raise JobError(
            "the length scale of a crease must be > 0 mm",
            value=float(np.min(scale)),
            limit=0.0,
        )
    whole = stiffnesses.CREASES[names.creases](at, material) / np.maximum(scale, kept)
    stiffness[creases] = (whole * at.share)[:, None]
    return stiffness
