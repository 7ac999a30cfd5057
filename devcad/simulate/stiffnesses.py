"""How stiff hinges are, and the published sets of coefficients by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.errors import JobError
from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices
from devcad.simulate.material import Material

FILIPOV_FIT = (0.55, 0.42, 1 / 3)
"""K_B = (0.55 - 0.42 sum(alpha) / pi) D (D_s / t)^(1/3): recalled with medium-high confidence."""
HULL_BENDING = 1 / 6  # K_b = E t^3 L^2 / (6 (A1 + A2)): not 1 - nu^2
KEPT = 1e-6
"""Length scale of a crease that keeps its fold angle, as a share of the crease's edge: a sheet
that bends by an angle per edge then moves the crease by a millionth of that angle."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Hinge lines in the pattern, each field (h,).

    ``length`` mm; ``area`` mm^2 = A1 + A2 of the triangles beside them, halves of the cells.
    Of diagonals, else 0: ``diagonal`` the whole diagonal in mm, ``panel`` the panel's area in
    mm^2, ``corners`` the sum of the two corner angles that the diagonal does not touch, radians.
    ``share`` is the part of the line's stiffness that one hinge has: 1/2 on diagonals that cross.
    """

    length: Array
    area: Array
    diagonal: Array
    panel: Array
    corners: Array
    share: Array

    def of(self, chosen: Indices) -> Lines:
        """Some of the lines."""
        return Lines(*(getattr(self, name)[chosen] for name in self.__slots__))


def energy_consistent(lines: Lines, material: Material) -> Array:
    """(h,) K = D L^2 / (A1 + A2) = D L / h for cells of width h, N mm: what the sheet between
    two rulings stores when it bends about them.

    Source:
        derived in geometry.md, 8, where the published coefficient was found twice too stiff on
        true rulings.
    """
    return np.asarray(material.plate * lines.share * lines.length**2 / lines.area)


def hull_bending(lines: Lines, material: Material) -> Array:
    """(h,) K = E t^3 L^2 / (6 (A1 + A2)), N mm: two hinges per quad share the bend.

    Source:
        the later hull code of the group of Woodruff and Filipov, not the paper of 2020.
    """
    factor = HULL_BENDING * material.youngs * material.thickness**3
    return np.asarray(factor * lines.share * lines.length**2 / lines.area)


def twisting(lines: Lines, material: Material) -> Array:
    """(h,) diagonals, K = 2 D (1 - nu) A / L^2, N mm: what a twisted W x H cell stores.

    w = kappa x y lifts a corner by kappa W H, the diagonal folds by kappa L, and the plate stores
    D (1 - nu) kappa^2 A.
    """
    unit = 2 * material.plate * (1 - material.poisson)
    return np.asarray(unit * lines.share * lines.panel / lines.diagonal**2)


def panel_bending(diagonal: Array, corners: Array, material: Material) -> Array:
    """K_B = (0.55 - 0.42 corners / pi) D (D_s / t)^(1/3), N mm, of a panel's short diagonal.

    ``corners`` is sum(alpha), radians; for a panel of the model ``filipov_bending`` makes it.

    Source:
        Filipov et al., IJSS 124 (2017); constants and exponent are recalled, not read
        (geometry.md, CONFIDENCE 5).
    """
    a, b, power = FILIPOV_FIT
    fit = a - b * corners / np.pi
    return np.asarray(fit * material.plate * (diagonal / material.thickness) ** power)


def filipov_bending(lines: Lines, material: Material) -> Array:
    """(h,) diagonals: ``panel_bending``, sum(alpha) being the panel's two corner angles that the
    diagonal does not touch: pi for a rectangle, where the factor is 0.13, less for a rhombus along
    its short diagonal.

    This reading is ours, a reconstruction: the formula was at hand, the paper's figure of alpha was
    not. Another reading only changes how stiffly panels resist twisting.

    Raises:
        JobError: a panel whose K_B would not be positive.
    """
    value = panel_bending(lines.diagonal, lines.corners, material)
    if np.any(value <= 0):
        raise JobError(
            "a panel's corners are too blunt for the bending stiffness of Filipov 2017",
            value=float(np.max(lines.corners)),
            limit=float(np.pi * FILIPOV_FIT[0] / FILIPOV_FIT[1]),
            remedy='cells that are nearly square, or coefficients = "exact"',
        )
    return np.asarray(lines.share * value)


def crease_folding(length: Array, scale: Array, material: Material) -> Array:
    """K_F = (L_F / L*) D, N mm, of creases ``length`` L_F mm long, of length scale L* = ``scale``.

    Source:
        Filipov et al., IJSS 124 (2017), as geometry.md, 8 has it.
    """
    return np.asarray(material.plate * length / scale)


def crease_plate(lines: Lines, material: Material) -> Array:
    """(h,) K_F L* = L_F D, N mm^2."""
    return crease_folding(lines.length, np.ones(1), material)


def crease_hull(lines: Lines, material: Material) -> Array:
    """(h,) K_F L* = L_F E t^3 / 12, N mm^2: the hull code's, without 1 - nu^2."""
    return np.asarray(material.youngs * material.thickness**3 / 12 * lines.length)


BARS = ("exact", "exact-shear", "woodruff-filipov", "filipov-2017")
BENDING: dict[str, Callable[[Lines, Material], Array]] = {
    "exact": energy_consistent,
    "woodruff-filipov": hull_bending,
}
DIAGONALS: dict[str, Callable[[Lines, Material], Array]] = {
    "exact": twisting,
    "hinge": energy_consistent,
    "woodruff-filipov": hull_bending,
    "filipov-2017": filipov_bending,
}
CREASES: dict[str, Callable[[Lines, Material], Array]] = {
    "exact": crease_plate,
    "woodruff-filipov": crease_hull,
}


@dataclass(frozen=True, slots=True)
class Coefficients:
    """Which formula is used for what, by the names of BARS, BENDING, DIAGONALS and CREASES.

    Raises:
        JobError: a name that does not exist.
    """

    bars: str = "exact"
    rulings: str = "exact"
    diagonals: str = "exact"
    creases: str = "exact"

    def __post_init__(self) -> None:
        known = {
            "bars": BARS,
            "rulings": tuple(BENDING),
            "diagonals": tuple(DIAGONALS),
            "creases": tuple(CREASES),
        }
        for field, names in known.items():
            name = getattr(self, field)
            if name not in names:
                raise JobError(
                    f"coefficients of {field} are {name!r}, must be one of {', '.join(names)}",
                    value=name,
                    limit=", ".join(names),
                )


COEFFICIENTS: dict[str, Coefficients] = {
    "exact": Coefficients(),
    "kept-rulings": Coefficients(diagonals="hinge"),
    "exact-shear": Coefficients(bars="exact-shear"),
    "woodruff-filipov": Coefficients(*["woodruff-filipov"] * 4),
    "filipov-2017": Coefficients(bars="filipov-2017", diagonals="filipov-2017"),
}
"""The sets that a job may name; the first is the default. A real sheet's rulings turn a little near
its free ends, and ``exact`` lets them; ``kept-rulings`` resists that, which stays closer to the
exact surface."""
