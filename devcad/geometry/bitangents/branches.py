"""Branches of bitangent pairs: traced, ended at the diagonal, split where a parameter turns.

A branch of one curve ends in a tip where it meets the diagonal s = t, and each pair is kept once
of its two orders. ``Path`` is a branch as a polyline of pairs that are right to a few digits, with
tangents and nodes, cut at its turning points; ``monotone`` makes smooth functions of the parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.nodes import Node
from devcad.geometry.bitangents.rails import Rail, complexity
from devcad.geometry.bitangents.zeroset import Branch, Grid, Unresolved
from devcad.geometry.taylor import Array

LINES = (120, 560)
"""The fewest and the most lines of the grid in one direction, before it is refined."""
CANCELS = 1e-11
"""A value below this share of its terms is zero; zero on 3 x 3 places: pairs fill an area."""
STILL = 1e-8
"""A share of the tangent below which a parameter stands still."""
SLOW = 0.3
"""A share of the tangent below which a parameter may come to turn back."""
CLOSER = 6
"""How often places are added, each time four times closer, to see that it does."""
SAME = 0.1
"""Distance, in cells of the grid, between a branch and its mirror image that are one."""
OFFSET = (0.381966, 0.236068)
"""Where between its ends a first cell begins: no line of the grid on a line of symmetry."""


class Filled(Exception):
    """Pairs fill an area around ``place`` (2,), or ``all`` of the rectangle."""

    def __init__(self, place: Array, whole: bool) -> None:
        super().__init__("pairs fill an area")
        self.place, self.whole = place, whole


@dataclass(frozen=True, slots=True)
class Path:
    """A branch: places (k, 2), unit tangents (k, 2), nodes by place, and where it is ``split``.

    ``splits`` are increasing indices, the first and the last place among them. On a ``closed``
    path the last place is the first one up to whole periods; on one curve it may be the first one
    with its two parameters exchanged (``flips``). ``meets`` tells which ends are no bitangent
    pair but a place where the curves meet: the ruling has no length there.
    """

    places: Array
    tangents: Array
    nodes: dict[int, Node]
    closed: bool
    flips: bool = False
    splits: tuple[int, ...] = ()
    meets: tuple[bool, bool] = (False, False)


def lines(rail: Rail, axis: int, refined: int) -> Array:
    """The lines of the grid for one rail: its breaks among them."""
    low, high = rail.curve.domain
    count = int(np.clip(2 * complexity(rail), *LINES)) * 2**refined
    inner = low + (high - low) * (np.arange(count) + OFFSET[axis]) / count
    if rail.period:
        marks = np.append(inner, rail.breaks)
        marks = np.unique(marks[marks < inner[0] + rail.period])
        below = marks < inner[0]
        marks = np.sort(np.concatenate([marks[~below], marks[below] + rail.period]))
        marks = np.append(marks, marks[0] + rail.period)
    else:
        marks = np.unique(np.concatenate([[low], inner, rail.breaks, [high]]))
    step = 1e-3 * (high - low) / count
    keep = np.append(True, np.diff(marks) > step)
    keep[-1] = True
    special = np.isin(marks, [low, high, *rail.breaks])
    return np.asarray(marks[keep | special])


def grid(pairs: Pairs, refined: int) -> Grid:
    """The signs to look at.

    Raises:
        Filled: the function vanishes on an area.
    """
    s, t = lines(pairs.first, 0, refined), lines(pairs.second, 1, refined)
    places = np.repeat(s, len(t)), np.tile(t, len(s))
    values = np.concatenate(
        [pairs.value(*part) for part in zip(*(np.array_split(x, 8) for x in places), strict=True)]
    )
    zero = (np.abs(values) <= CANCELS * pairs.size(*places)).reshape(len(s), len(t))
    block = zero
    for axis in (0, 1):
        length = block.shape[axis]
        block = np.logical_and.reduce(
            [block.take(range(k, length - 2 + k), axis) for k in range(3)]
        )
    if block.any():
        i, j = np.argwhere(block)[0] + 1
        raise Filled(np.array([s[i], t[j]]), bool(zero.mean() > 0.9))
    return Grid(s, t, values.reshape(len(s), len(t)), (pairs.first.period, pairs.second.period))


def path(pairs: Pairs, branch: Branch) -> Path:
    """A branch with its tangents, repeated places left out."""
    places = branch.places
    steps = np.linalg.norm(np.diff(places, axis=0) / spans(pairs), axis=1)
    is_node = np.isin(np.arange(len(places)), list(branch.nodes))
    keep = np.append(True, steps > 1e-9)
    for k in np.flatnonzero(~keep):
        if is_node[k] and not is_node[k - 1]:
            keep[k - 1], keep[k] = False, True
    number = np.cumsum(keep) - 1
    nodes = {int(number[k]): node for k, node in branch.nodes.items()}
    places = places[keep]
    if branch.closed and not keep[-1]:
        places[-1] = branch.places[-1]
    return with_tangents(pairs, Path(places, np.zeros_like(places), nodes, branch.closed))


def with_tangents(pairs: Pairs, old: Path) -> Path:
    """The tangents that belong to the places, pointing onwards."""
    places = old.places
    _, gradient = pairs.slopes(*places.T)
    tangents = np.column_stack([gradient[:, 1], -gradient[:, 0]])
    ahead = np.diff(places, axis=0)
    chords = np.concatenate([ahead[:1], ahead[1:] + ahead[:-1], ahead[-1:]])
    if old.closed and not old.flips:
        chords[[0, -1]] = ahead[0] + ahead[-1]
    scale = spans(pairs)
    for k, node in old.nodes.items():
        along = np.abs((node.directions / scale) @ (chords[k] / scale))
        lengths = np.linalg.norm(node.directions / scale, axis=1)
        tangents[k] = node.directions[int(np.argmax(along / lengths))]
    forward = np.sign(((tangents / scale) * (chords / scale)).sum(axis=1))
    tangents = tangents * np.where(forward == 0.0, 1.0, forward)[:, None]
    with np.errstate(invalid="ignore"):
        tangents = tangents / np.linalg.norm(tangents / scale, axis=1)[:, None]
    bad = ~np.isfinite(tangents).all(axis=1)
    if bad.any():
        raise Unresolved(places[int(np.argmax(bad))])
    return replace(old, tangents=tangents)


def spans(pairs: Pairs) -> Array:
    """The lengths of the two domains, (2,)."""
    return np.array([r.curve.domain[1] - r.curve.domain[0] for r in (pairs.first, pairs.second)])


Functional = Callable[[Array], tuple[float, Array]]
"""A place (2,) to a number and its gradient (2,)."""


def meet(pairs: Pairs, guess: Array, other: Functional) -> Array:
    """The place (2,) near ``guess`` where the pairs' function and another one vanish.

    Raises:
        Unresolved: Newton's method does not settle.
    """
    place, scale, step = guess.copy(), spans(pairs), np.full(2, np.inf)
    for _ in range(30):
        value, gradient = pairs.slopes(place[:1], place[1:])
        number, slope = other(place)
        matrix = np.stack([gradient[0], slope])
        sizes = np.abs(matrix * scale).max(axis=1)
        if not (sizes > 0.0).all():
            break
        right = np.array([value[0], number]) / sizes
        try:
            step = -np.linalg.solve(matrix / sizes[:, None], right)
        except np.linalg.LinAlgError:
            break
        step *= min(1.0, 0.02 / max(float(np.abs(step / scale).max()), 1e-300))
        place = place + step
        if np.abs(step / scale).max() <= 4e-16:
            return np.asarray(place)
    if not np.abs(step / scale).max() <= 1e-12 or np.abs((place - guess) / scale).max() > 0.05:
        raise Unresolved(guess)
    return np.asarray(place)


def linear(coefficients: tuple[float, float], value: float) -> Functional:
    """The functional coefficients . (s, t) - value."""
    row = np.array(coefficients)
    return lambda place: (float(row @ place) - value, row)


def turning(pairs: Pairs, axis: int) -> Functional:
    """The slope of the function along the other axis: a zero makes ``axis`` stand still."""

    def slope(place: Array) -> tuple[float, Array]:
        _, gradient, hessian = pairs.bends(place[:1], place[1:])
        return float(gradient[0, 1 - axis]), hessian[0, 1 - axis]

    return slope


def inserted(pairs: Pairs, old: Path, new: list[tuple[int, Array]]) -> tuple[Path, list[int]]:
    """The path with more places, each after the given index; and their new indices.

    A place next to one that is there takes its place.
    """
    places, nodes, at = [], {}, []
    extra: dict[int, list[Array]] = {}
    for index, place in new:
        extra.setdefault(index, []).append(place)
    scale = spans(pairs)
    there = old.places.copy()
    for k, here in enumerate(there):
        places.append(here)
        if k in old.nodes:
            nodes[len(places) - 1] = old.nodes[k]
        queue = extra.get(k, [])
        queue.sort(key=lambda place: float(np.linalg.norm((place - here) / scale)))
        for place in queue:
            if np.abs((place - places[-1]) / scale).max() <= 1e-9:
                if len(places) - 1 not in nodes:
                    places[-1] = place
            elif k + 1 < len(there) and (np.abs((place - there[k + 1]) / scale).max() <= 1e-9):
                if k + 1 not in old.nodes:
                    there[k + 1] = place
                at.append(len(places))
                continue
            else:
                places.append(place)
            at.append(len(places) - 1)
    moved = replace(old, places=np.array(places), nodes=nodes)
    return with_tangents(pairs, moved), at


def turns(pairs: Pairs, old: Path) -> Path:
    """The path split where s or t turns back."""
    for _ in range(CLOSER):
        between = [at for axis in (0, 1) for at in _slowest(pairs, old, axis)]
        if not between:
            break
        old, _ = inserted(pairs, old, between)
    new: list[tuple[int, Array]] = []
    for axis in (0, 1):
        part = old.tangents[:, axis] / spans(pairs)[axis]
        moving = np.flatnonzero(np.abs(part) > STILL)
        for a, b in pairwise(moving.tolist()):
            if part[a] * part[b] >= 0.0:
                continue
            if b == a + 1:
                share = part[a] / (part[a] - part[b])
                guess = (1.0 - share) * old.places[a] + share * old.places[b]
                new.append((int(a), meet(pairs, guess, turning(pairs, axis))))
            else:
                new.append((int(a), old.places[a + 1].copy()))
    split, at = inserted(pairs, old, new)
    last = len(split.places) - 1
    return replace(split, splits=tuple(sorted({0, last, *at})))


def _slowest(pairs: Pairs, old: Path, axis: int) -> list[tuple[int, Array]]:
    """More places of a path where a parameter may turn back twice between two of its places:
    beside those where it is slowest, if a parabola through three of them comes near zero."""
    scale = spans(pairs)
    part = old.tangents[:, axis] / scale[axis]
    before, here, after = np.abs(part[:-2]), np.abs(part[1:-1]), np.abs(part[2:])
    bend = before - 2.0 * here + after
    one_way = (part[:-2] * part[1:-1] > 0.0) & (part[1:-1] * part[2:] > 0.0)
    dip = one_way & (here <= before) & (here < after) & (here > STILL) & (here < SLOW)
    lowest = here - (after - before) ** 2 / np.where(dip, 8.0 * bend, 1.0)
    out = []
    for k in (1 + np.flatnonzero(dip & (lowest < 0.5 * here))).tolist():
        for first in (k - 1, k):
            if first in old.nodes or first + 1 in old.nodes:
                continue
            a, b = old.places[first], old.places[first + 1]
            row = (b - a) / scale**2
            for share in (0.25, 0.5, 0.75):
                guess = a + share * (b - a)
                along = linear((float(row[0]), float(row[1])), float(row @ guess))
                out.append((first, meet(pairs, guess, along)))
    return out


def rotated(pairs: Pairs, old: Path, start: int) -> Path:
    """A closed path begun at another of its places."""
    if start in (0, len(old.places) - 1):
        return old
    shift = old.places[-1] - old.places[0]
    places = np.concatenate([old.places[start:], old.places[1 : start + 1] + shift])
    count = len(old.places) - 1
    nodes = {}
    for k, node in old.nodes.items():
        new = (k - start) % count
        for at in (new, new + count):
            if at < len(places):
                nodes[at] = replace(node, place=places[at])
    return with_tangents(pairs, replace(old, places=places, nodes=nodes))


def reversed_(old: Path) -> Path:
    """The path the other way round."""
    last = len(old.places) - 1
    return replace(
        old,
        places=old.places[::-1].copy(),
        tangents=-old.tangents[::-1],
        nodes={last - k: node for k, node in old.nodes.items()},
        splits=tuple(last - k for k in old.splits)[::-1],
        meets=old.meets[::-1],
    )


def part(old: Path, first: int, last: int) -> Path:
    """The places from one index to another, both included, as an open path."""
    nodes = {k - first: node for k, node in old.nodes.items() if first <= k <= last}
    rows = slice(first, last + 1)
    return Path(old.places[rows], old.tangents[rows], nodes, False)
