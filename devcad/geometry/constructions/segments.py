"""Patches of rulings that run from one moving point to another."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

Ends = Callable[[Array, int], tuple[Array, Array]]
"""t (n,) and an order K to the series of both ends of the rulings, each (K + 1, n, 3)."""


def rods(ends: Ends, length: float, domain: tuple[float, float]) -> Patch:
    """The patch of rulings of one length: c0 = the first end, v from 0 to ``length``."""

    def field(t: Array, order: int) -> RulingJet:
        c0, c1 = ends(t, order)
        return RulingJet(
            c0,
            taylor.unit(c1 - c0),
            taylor.constant(0.0, order, len(t)),
            taylor.constant(length, order, len(t)),
        )

    return Patch(field, domain)


def reversed_(patch: Patch, pivot: float) -> Patch:
    """The same rulings with t -> pivot - t: the front is turned to the other side."""

    def field(t: Array, order: int) -> RulingJet:
        jet = patch.field(np.clip(pivot - t, *patch.domain), order)
        sign = np.where(np.arange(order + 1) % 2, -1.0, 1.0)
        rows, points = sign[:, None], sign[:, None, None]
        return RulingJet(points * jet.c0, points * jet.e, rows * jet.v_from, rows * jet.v_to)

    low, high = patch.domain
    breaks = tuple(pivot - x for x in patch.breaks[::-1])
    return Patch(field, (pivot - high, pivot - low), breaks, patch.causal)
