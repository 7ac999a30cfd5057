"""The neutral fibre of a recipe: K as a number, as a table over the radius, or by DIN 6935."""

from __future__ import annotations

import numpy as np

from devcad.flatten.neutral import MIDDLE, Fibre, Law
from devcad.geometry import taylor
from devcad.geometry.taylor import Array
from devcad.shop.materials import Material
from devcad.shop.settings import Neutral, neutral_fibre

DIN_AT_ONE, DIN_PER_DECADE = 0.65, 0.5
"""DIN 6935: k = 0.65 + 0.5 log10(r / s), in halves of the thickness, and 1 above r / s = 5."""
DIN_INSIDE = 10.0 ** (-DIN_AT_ONE / DIN_PER_DECADE)
"""The ratio below which that formula leaves the sheet: 0.05."""
DIN_MIDDLE = 10.0 ** ((1.0 - DIN_AT_ONE) / DIN_PER_DECADE)
"""The ratio at which it comes to the middle: 5.012. The standard's own step at 5, from 0.4997 to
0.5, is not made: a pattern does not jump."""


def fibre(neutral: Neutral | None, material: Material | None, thickness: float) -> Fibre | None:
    """The neutral fibre of a sheet; None where the recipe is silent or there is no thickness."""
    if neutral is None or not thickness:
        return None
    chosen = neutral_fibre(neutral, material)
    return Fibre(thickness, law(chosen), chosen.words)


def law(neutral: Neutral) -> Law:
    """K over the inside radius, as the key says that spoke."""
    if neutral.standard is not None:
        return din6935()
    if neutral.table:
        return table(neutral.table)
    return constant(MIDDLE if neutral.k is None else neutral.k)


def constant(k: float) -> Law:
    """One K for every radius."""

    def series(ratio: Array) -> Array:
        return taylor.constant(k, len(ratio) - 1, ratio.shape[1])

    return Law(series, k)


def din6935() -> Law:
    """K = k / 2 of DIN 6935: 0.325 at r / s = 1, the middle from 5 on."""

    def series(ratio: Array) -> Array:
        out = np.zeros_like(ratio)
        out[0] = MIDDLE
        low, slope = ratio[0] <= DIN_INSIDE, ratio[0] < DIN_MIDDLE
        out[0, low] = 0.0
        bent = slope & ~low
        out[:, bent] = 0.5 * DIN_PER_DECADE / np.log(10.0) * taylor.log(ratio[:, bent])
        out[0, bent] += 0.5 * DIN_AT_ONE
        return out

    return Law(series, MIDDLE, (DIN_INSIDE, DIN_MIDDLE))


def table(rows: tuple[tuple[float, float], ...]) -> Law:
    """K between the rows (inside radius over thickness, K), straight; constant outside."""
    at, k = np.array(rows).T
    slope = np.concatenate([[0.0], np.diff(k) / np.diff(at), [0.0]])
    anchor = np.concatenate([[0], np.arange(len(at))])

    def series(ratio: Array) -> Array:
        piece = np.searchsorted(at, ratio[0], side="right")
        out = slope[piece] * ratio
        out[0] += k[anchor[piece]] - slope[piece] * at[anchor[piece]]
        return np.asarray(out)

    return Law(series, float(k[-1]), tuple(at.tolist()))
