"""Stations for the rolls: how far along both edges of the blank, and how tight there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.flatten.neutral import end_radii
from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.shop.springback import loaded_radius

HALVINGS = 60
"""A step halved so often is below the rounding of the parameter."""
SAME = 1e-9
"""Relative: radii on both sides of a ruling that differ by less are one."""


@dataclass(frozen=True, slots=True)
class Station:
    """A ruling at which the rolls are set, mm.

    ``base`` and ``top`` are the lengths along the blank's edges from its start. ``radii`` are the
    inside radii at both ends of the ruling, ``loaded`` those under the rolls before the sheet
    springs back, ``template`` the inside radius half way; None where it is flat, and where the
    material is unknown. ``turn`` is +1 where it bends towards the front, -1 to the back, 0 flat.
    """

    t: float
    base: float
    top: float
    turn: int
    radii: tuple[float | None, float | None]
    loaded: tuple[float | None, float | None]
    template: float | None


def stations(panel: Panel, every: float, flow: float | None) -> tuple[Station, ...]:
    """The stations of a panel, at most ``every`` mm apart along the longer edge of its blank.

    Where the bending jumps there are two, before and after. () where nothing bends smoothly, and of
    a sheet with curved creases, which no roller bends.

    Args:
        flow: the material's sigma / (E T) in 1/mm, None where it is unknown.
    """
    if panel.blank is None or panel.bends or panel.flanks:  # bent on a press brake, or by hand
        return ()
    out: list[Station] = []
    start = np.zeros(2)
    for middle, flat in zip(panel.blank.middle.patches, panel.blank.chain.patches, strict=True):
        along = _lengths(flat)
        total = along(np.array(flat.domain[1:]))[0]
        if middle.inside_radius is not None:  # made at once, between flats or rolled parts
            start = start + total
            continue
        longer = int(np.argmax(total))
        for low, high in pairwise(middle.segments.tolist()):
            t = _spaced(along, longer, low, high, every)
            rows = _stations(middle, t, start + along(t), panel.thickness, flow)
            out += rows[1:] if out and _continue(out[-1], rows[0]) else rows
        start = start + total
    return tuple(out) if any(station.turn for station in out) else ()


def _lengths(flat: Patch) -> Piecewise:
    """The lengths along the base and the top of a patch of the pattern, (n, 2)."""

    def speeds(t: Array) -> Array:
        jet = flat.jet(t, 1)
        rails = [jet.rail(v)[1] for v in (jet.v_from, jet.v_to)]
        return np.column_stack([np.linalg.norm(rail, axis=1) for rail in rails])

    fastest = float(speeds(np.linspace(*flat.domain, 17)[1:-1]).max())
    return chebyshev.resolve(speeds, flat.segments, scale=1e-3 * fastest).antiderivative()


def _spaced(along: Piecewise, edge: int, low: float, high: float, every: float) -> Array:
    """Parameters from low to high, evenly spaced along an edge, (n,)."""
    ends = along(np.array([low, high]))[:, edge]
    count = max(int(np.ceil((ends[1] - ends[0]) / every - SAME)), 1)
    aim = ends[0] + (ends[1] - ends[0]) * np.arange(1, count) / count
    a, b = np.full(len(aim), low), np.full(len(aim), high)
    for _ in range(HALVINGS if count > 1 else 0):
        middle = 0.5 * (a + b)
        before = along(middle)[:, edge] < aim
        a, b = np.where(before, middle, a), np.where(before, b, middle)
    return np.concatenate([[low], 0.5 * (a + b), [high]])


def _stations(
    patch: Patch, t: Array, lengths: Array, thickness: float, flow: float | None
) -> list[Station]:
    """The stations at increasing t, asked just inside their ends."""
    inside = np.clip(t, np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0]))
    frame = patch.frame(inside)
    ends = end_radii(frame)
    radii = np.stack([*ends, 0.5 * (ends[0] + ends[1])])  # of the middle: linear in v
    bent = radii[2] * SAME < np.max([np.ptp(lengths), thickness])
    loaded = loaded_radius(radii, flow) if flow is not None else np.full(radii.shape, np.nan)
    turn = np.where(bent, np.sign(frame.c), 0.0).astype(int)
    tables = [
        np.where(bent, np.maximum(table - 0.5 * thickness, 0.0), np.nan)
        for table in (radii, loaded)
    ]
    return [
        Station(
            float(t[k]),
            float(lengths[k, 0]),
            float(lengths[k, 1]),
            int(turn[k]),
            (_known(tables[0][0, k]), _known(tables[0][1, k])),
            (_known(tables[1][0, k]), _known(tables[1][1, k])),
            _known(tables[0][2, k]),
        )
        for k in range(len(t))
    ]


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _continue(last: Station, first: Station) -> bool:
    """Whether two stations on one ruling are one: the sheet is bent alike on both sides."""
    if last.turn != first.turn:
        return False
    pairs = zip(last.radii, first.radii, strict=True)
    return all(a == b or (a and b and abs(a - b) <= SAME * a) for a, b in pairs)
