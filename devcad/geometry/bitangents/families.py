"""Families of bitangent pairs, each an own surface: ended at tips, each pair once, in order.

Tips are where a branch of one curve meets the diagonal, and where curves meet (``meetings``).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from devcad.geometry.bitangents import branches, zeroset
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.branches import Path, linear, meet
from devcad.geometry.bitangents.meetings import ending, parted
from devcad.geometry.bitangents.zeroset import Grid
from devcad.geometry.taylor import Array


def families(pairs: Pairs, refined: int = 0) -> list[Path]:
    """All families, in the order of the smallest parameter s of each.

    ``refined`` doublings of the grid. A family begins where s is smallest; of one curve the first
    parameter s is the one of the two that becomes smaller.

    Raises:
        Unresolved: the grid is too coarse; Filled: the pairs are no curves.
    """
    grid = branches.grid(pairs, refined)
    paths = [branches.path(pairs, branch) for branch in zeroset.branches(pairs, grid)]
    paths = [_grounded(pairs, one) for one in paths if len(one.places) > 1]
    if pairs.same:
        paths = _once(pairs, grid, [arc for one in paths for arc in _off_diagonal(pairs, one)])
        paths = [_first_smaller(pairs, one) for one in paths]
    paths = [branches.turns(pairs, arc) for one in paths for arc in parted(pairs, one)]
    paths = [_begun(pairs, one) for one in paths]
    return sorted(paths, key=lambda one: _rank(pairs, one))


def _grounded(pairs: Pairs, old: Path) -> Path:
    """An open path with its ends exactly on the sides of the rectangle."""
    if old.closed:
        return old
    places = old.places.copy()
    sides = np.array([rail.curve.domain for rail in (pairs.first, pairs.second)])
    open_ = np.array([not rail.period for rail in (pairs.first, pairs.second)])
    nodes = dict(old.nodes)
    for k, index in ((0, 0), (-1, len(places) - 1)):
        node = ending(pairs, places[k])
        if node is not None:
            places[k], nodes[index] = node.place, node
            continue
        gaps = np.abs(places[k][:, None] - sides) / branches.spans(pairs)[:, None]
        gaps[~open_] = np.inf
        axis, side = divmod(int(np.argmin(gaps)), 2)
        row = (1.0, 0.0) if axis == 0 else (0.0, 1.0)
        places[k] = meet(pairs, places[k], linear(row, float(sides[axis, side])))
        places[k][axis] = sides[axis, side]
    return branches.with_tangents(pairs, replace(old, places=places, nodes=nodes))


def _off_diagonal(pairs: Pairs, old: Path) -> list[Path]:
    """The parts of a path of one curve between its places on the diagonal; s < t on all of them."""
    period = pairs.first.period
    away = old.places[:, 1] - old.places[:, 0]
    sheet = np.floor(away / period) if period else np.where(away < 0.0, -1.0, 0.0)
    tips, middle = [], old.places.copy()
    for k, node in old.nodes.items():  # a node on the diagonal is the tip itself
        level = float(period * np.round(away[k] / period)) if period else 0.0
        if abs(away[k] - level) <= 1e-9 * branches.spans(pairs)[0] and 0 < k < len(sheet) - 1:
            if sheet[k - 1] != sheet[k + 1]:
                place = np.full(2, node.place.mean()) + 0.5 * np.array([-level, level])
                tips.append((k, place))
                middle[k] = place
            sheet[k] = np.nan
    for k in np.flatnonzero(np.diff(sheet)).tolist():
        if np.isnan(sheet[k : k + 2]).any():
            continue
        level = float(max(sheet[k], sheet[k + 1])) * period
        share = (level - away[k]) / (away[k + 1] - away[k])
        guess = (1.0 - share) * old.places[k] + share * old.places[k + 1]
        tip = meet(pairs, guess, linear((-1.0, 1.0), level))
        tips.append((k, np.array([tip[0], tip[0] + level])))
    if not tips:
        return [_sheeted(pairs, old)]
    old = replace(old, places=middle)
    cut, at = branches.inserted(pairs, old, sorted(tips, key=lambda tip: tip[0]))
    if old.closed:
        cut = branches.rotated(pairs, cut, at[0])
        count = len(cut.places) - 1
        at = sorted({(k - at[0]) % count for k in at} | {count})
    else:
        at = sorted({0, *at, len(cut.places) - 1})
    arcs = [branches.part(cut, a, b) for a, b in pairwise(at) if b - a > 1]
    return [_sheeted(pairs, arc) for arc in arcs]


def _sheeted(pairs: Pairs, old: Path) -> Path:
    """The path with t moved by periods, or exchanged with s, so that s < t < s + period."""
    period = pairs.first.period
    middle = old.places[len(old.places) // 2]
    if not period:
        return old if middle[0] < middle[1] else _exchanged(old, 0.0)
    level = period * np.floor((middle[1] - middle[0]) / period)
    return _moved(old, 0.0, -level)


def _moved(old: Path, ds: float, dt: float) -> Path:
    nodes = {
        k: replace(node, place=node.place + np.array([ds, dt])) for k, node in old.nodes.items()
    }
    return replace(old, places=old.places + np.array([ds, dt]), nodes=nodes)


def _exchanged(old: Path, period: float) -> Path:
    """The same pairs in the other order: (s, t) -> (t, s + period)."""
    nodes = {
        k: replace(n, place=n.place[::-1].copy(), directions=n.directions[:, ::-1].copy())
        for k, n in old.nodes.items()
    }
    turned = replace(
        old, places=old.places[:, ::-1].copy(), tangents=old.tangents[:, ::-1].copy(), nodes=nodes
    )
    return _moved(turned, 0.0, period)


def _once(pairs: Pairs, grid: Grid, paths: list[Path]) -> list[Path]:
    """The paths of one curve without mirror images of one another, or of themselves."""
    period = pairs.first.period
    cell = max(np.diff(grid.first).max(), np.diff(grid.second).max())
    kept: list[Path] = []
    for one in paths:
        mirrored = _exchanged(one, period).places
        some = mirrored[[len(mirrored) // 4, len(mirrored) // 2, (3 * len(mirrored)) // 4]]
        if not period:
            some = some[:, ::-1]  # already in one order
        if any((_away(other, some, period) < branches.SAME * cell).all() for other in kept):
            continue
        if period and one.closed and (_away(one, some, period) < branches.SAME * cell).all():
            one = _half(pairs, one, mirrored[0])
        kept.append(one)
    return kept


def _away(one: Path, places: Array, period: float) -> Array:
    """The distances of places from a path, up to common periods of both parameters, (n,)."""
    a, b = one.places[:-1], one.places[1:]
    out = np.full(len(places), np.inf)
    reach = range(-3, 4) if period else range(1)
    for turn in reach:
        for k, place in enumerate(places + turn * period):
            way = b - a
            share = ((place - a) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-300)
            foot = a + np.clip(share, 0.0, 1.0)[:, None] * way
            out[k] = min(out[k], float(np.linalg.norm(foot - place, axis=1).min()))
    return out


def _half(pairs: Pairs, old: Path, image: Array) -> Path:
    """The first half of a path that is its own mirror image: it ends at the image of its start."""
    period = pairs.first.period
    rows = old.places[1:]
    turns = period * np.round((rows - image).mean(axis=1, keepdims=True) / period)
    last = 1 + int(np.argmin(np.linalg.norm(rows - image - turns, axis=1)))
    places = old.places[: last + 1].copy()
    places[-1] = image + turns[last - 1]
    nodes = {k: node for k, node in old.nodes.items() if k < last}
    half = Path(places, np.zeros_like(places), nodes, closed=True, flips=True)
    return branches.with_tangents(pairs, half)


def _first_smaller(pairs: Pairs, old: Path) -> Path:
    """The order of the pairs in which the first parameter comes to be the smaller one."""
    other = _exchanged(old, pairs.first.period)
    return min((old, other), key=lambda one: _smallest(pairs, one, inner=True))


def _smallest(pairs: Pairs, one: Path, inner: bool = False) -> float:
    """The smallest first parameter, within the domain; its ends left out if ``inner``."""
    s = one.places[1:-1, 0] if inner and len(one.places) > 2 else one.places[:, 0]
    low, period = pairs.first.curve.domain[0], pairs.first.period
    if not period:
        return float(s.min())
    turns = np.floor((s - low) / period + 1e-12)
    if turns.min() != turns.max():
        return low
    return float(max((s - turns * period).min(), low))


def _rank(pairs: Pairs, one: Path) -> tuple[float, float]:
    """What families are ordered by: the smallest s to nine digits, then t there."""
    low, high = pairs.second.curve.domain
    t = pairs.second.inside(one.places[:1, 1])[0]
    span = pairs.first.curve.domain[1] - pairs.first.curve.domain[0]
    return round(_smallest(pairs, one) / span, 9), round((t - low) / (high - low), 9)


def _begun(pairs: Pairs, old: Path) -> Path:
    """The path from its smallest s on, s (or else t) growing, begun within the domains."""
    if old.closed and not old.flips:
        old = _closed_from(pairs, old)
    else:
        first, last = old.places[0], old.places[-1]
        if (last[0], last[1]) < (first[0], first[1]):
            old = branches.reversed_(old)
    start = old.places[0]
    ds, dt = (r.inside(start[k : k + 1])[0] for k, r in enumerate((pairs.first, pairs.second)))
    if pairs.same:  # keep s < t < s + period
        return _moved(old, ds - start[0], ds - start[0]) if pairs.first.period else old
    return _moved(
        old,
        ds - start[0] if pairs.first.period else 0.0,
        dt - start[1] if pairs.second.period else 0.0,
    )


def _closed_from(pairs: Pairs, old: Path) -> Path:
    """A closed path, from the right place on and the right way round."""
    around = old.places[-1] - old.places[0]
    period, low = pairs.first.period, pairs.first.curve.domain[0]
    if period and abs(around[0]) > 0.5 * period:
        if around[0] < 0.0:
            old = branches.reversed_(old)
        turns = np.floor((old.places[:, 0] - low) / period)
        k = int(np.flatnonzero(np.diff(turns))[0])
        level = low + period * max(turns[k], turns[k + 1])
        s = old.places[k : k + 2, 0]
        share = (level - s[0]) / (s[1] - s[0])
        guess = (1.0 - share) * old.places[k] + share * old.places[k + 1]
        begin = meet(pairs, guess, linear((1.0, 0.0), level))
        old, (at,) = branches.inserted(pairs, replace(old, splits=()), [(k, begin)])
        return branches.turns(pairs, branches.rotated(pairs, old, at))
    k = int(np.argmin(old.places[:-1, 0]))
    old = branches.rotated(pairs, replace(old, splits=()), k)
    onward = old.places[min(3, len(old.places) - 1)] - old.places[0]
    if abs(around[1]) > 0.5 * pairs.second.period > 0.0:
        backward = around[1] < 0.0
    else:
        backward = onward[1] < 0.0
    if backward:
        old = branches.reversed_(old)
    return branches.turns(pairs, old)
