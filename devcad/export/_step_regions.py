"""Regions: what cuts leave of a panel's strips, each the loops of one face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.export._step_strips import Strip
from devcad.geometry.cells import Cell, Loop, Run, Stretch, cells
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array
from devcad.part import Panel

PLACES = np.linspace(0.0, 1.0, 33)
"""Shares of a run at which it counts when loops are told apart."""


@dataclass(frozen=True, slots=True)
class Region:
    """One face of a strip: its loop, counterclockwise as the front shows it, and its holes."""

    loop: Loop
    holes: tuple[Run, ...] = ()


def regions(panel: Panel, strips: list[Strip]) -> list[tuple[Region, ...]]:
    """For every strip of a panel what is left of it, the whole strip without cuts."""
    if not panel.cuts:
        return [(Region(_whole(strip)),) for strip in strips]
    out: list[tuple[Region, ...]] = []
    for number in range(len(panel.chain.patches)):
        own = [strip for strip in strips if strip.number == number]
        borders = np.array([own[0].ends[0], *(strip.ends[1] for strip in own)])
        found = cells(panel.cuts, panel.chain, number, borders)
        out += [_apart(panel.cuts, s, cell) for s, cell in zip(own, found, strict=True)]
    return out


def _whole(strip: Strip) -> Loop:
    """The four sides of a strip; a ruling without length counts as one."""
    jet = strip.patch.jet(strip.ends, 0)
    (low, low_end), (high, high_end) = jet.v_from[0].tolist(), jet.v_to[0].tolist()
    a, b = strip.ends.tolist()
    return (
        Stretch(0, strip.number, low, high),
        Stretch(1, strip.number, a, b),
        Stretch(2, strip.number, high_end, low_end),
        Stretch(3, strip.number, b, a),
    )


def _apart(cuts: tuple[Cut, ...], strip: Strip, cell: Cell) -> tuple[Region, ...]:
    """The loops of a cell, each with the holes inside it."""
    loops = [_with_tips(loop, strip) for loop in cell.loops]
    if len(loops) < 2:
        return tuple(Region(loop, cell.holes) for loop in loops)
    inside: list[list[Run]] = [[] for _ in loops]
    bounds = [_polygon(cuts, strip, loop) for loop in loops]
    for hole in cell.holes:
        piece = hole.pieces[0]
        place = cuts[piece.cut].tracks[piece.track].series(np.array([piece.u[0]]))[0]
        inside[max(range(len(loops)), key=lambda k: _winding(bounds[k], place))].append(hole)
    return tuple(Region(loop, tuple(h)) for loop, h in zip(loops, inside, strict=True))


def _with_tips(loop: Loop, strip: Strip) -> Loop:
    """The loop with the rulings that have no length, which fitted faces need as edges."""
    out: list[Stretch | Run] = []
    for k, item in enumerate(loop):
        before = loop[k - 1]
        if isinstance(item, Stretch) and isinstance(before, Stretch):
            missing = {(1, 3): _whole(strip)[2], (3, 1): _whole(strip)[0]}
            corner = missing.get((before.side, item.side))
            if corner is not None and before.last is None and item.first is None:
                out.append(corner)
        out.append(item)
    return tuple(out)


def _polygon(cuts: tuple[Cut, ...], strip: Strip, loop: Loop) -> Array:
    """Places (t, v) around a loop, (n, 2)."""
    places = []
    for item in loop:
        if isinstance(item, Run):
            for piece in item.pieces:
                u = piece.u[0] + (piece.u[1] - piece.u[0]) * PLACES
                places.append(cuts[piece.cut].tracks[piece.track].series(u))
            continue
        along = item.start + (item.end - item.start) * PLACES
        if item.side in (0, 2):
            t = np.full_like(along, strip.ends[item.side // 2])
            places.append(np.stack([t, along], axis=1))
        else:
            jet = strip.patch.jet(along, 0)
            v = jet.v_to[0] if item.side == 1 else jet.v_from[0]
            places.append(np.stack([along, v], axis=1))
    return np.concatenate(places)


def _winding(polygon: Array, place: Array) -> float:
    """How often a polygon runs round a place: near 1 inside, near 0 outside."""
    arms = polygon - place
    arms = arms / np.abs(arms).max(axis=0)  # t and v have no common unit
    turned = np.roll(arms, -1, axis=0)
    cross = arms[:, 0] * turned[:, 1] - arms[:, 1] * turned[:, 0]
    return abs(float(np.arctan2(cross, (arms * turned).sum(axis=1)).sum())) / (2.0 * np.pi)
