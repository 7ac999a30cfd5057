"""Where the two ends of a ruling coincide: the curve meets itself there, or the curves meet.

Only that one ruling has no length. A branch is parted there into arcs that end in a tip; beyond
it the ruling's direction is the opposite one, so that no sheet goes through.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.bitangents import branches
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.branches import Path
from devcad.geometry.bitangents.nodes import Node, node_at
from devcad.geometry.bitangents.zeroset import Unresolved
from devcad.geometry.taylor import Array

COINCIDE = 1e-9
"""A ruling below this share of the curves' size has no length."""
SHORT = 0.2
"""A shortest ruling below this share of the size is looked at."""
NEAR = 0.02
"""How far from the branch, as a share of the domains, its meeting may turn out to be."""
PARALLEL = 1e-6
"""The sine of the angle of tangents that count as parallel."""
BESIDE = 1e-6
"""Places of a branch nearer to a meeting than this share of the domains are left out."""
CELL = 0.01
"""Share of the domains in which the function's forms at a meeting are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class _Meeting:
    """A place (2,) on a path, after the place ``index``, its last one at most."""

    index: int
    place: Array


def parted(pairs: Pairs, path: Path) -> list[Path]:
    """The arcs of a path between the places where the curves meet; itself if there is none.

    Raises:
        GeometryError: the curves touch there, with one tangent.
        Unresolved: the branch's direction there is not found.
    """
    found = _meetings(pairs, path)
    if not found:
        return [path]
    if path.closed:
        path, count = _twice(path), len(path.places) - 1
        found = [one for one in _meetings(pairs, path) if one.index > 0]
        found = [one for one in found if one.index <= found[0].index + count + 1]
        ends = found
    else:
        last = len(path.places) - 1
        first_end, last_end = _Meeting(0, path.places[0]), _Meeting(last, path.places[-1])
        ends = [first_end, *found, last_end]
    arcs = [_arc(pairs, path, a, b, (a in found, b in found)) for a, b in pairwise(ends)]
    return [arc for arc in arcs if arc is not None]


def ending(pairs: Pairs, place: Array) -> Node | None:
    """The node where curves meet at the end of one of them, near the end (2,) of a branch."""
    met = _met(pairs, place)
    if met is None or np.abs((met - place) / branches.spans(pairs)).max() > BESIDE:
        return None
    sides = np.array([rail.curve.domain for rail in (pairs.first, pairs.second)])
    open_ = np.array([not rail.period for rail in (pairs.first, pairs.second)])
    met = np.where(open_, np.clip(met, *sides.T), met)
    _require_angle(pairs, met)
    return _node(pairs, Path(met[None], met[None], {}, False), met)


def _meetings(pairs: Pairs, path: Path) -> list[_Meeting]:
    """Where the two ends of a ruling coincide, in the order of the path; tips are not meant."""
    s, t = path.places.T
    scale = branches.spans(pairs)
    size = _size(pairs)
    away = np.linalg.norm(pairs.second.jet(t, 0)[0] - pairs.first.jet(s, 0)[0], axis=1)
    if pairs.same:  # a tip is no meeting: its ruling has a direction
        away = away * (scale[0] / np.maximum(np.abs(pairs.first.wrapped(s, t)), 1e-300))
    before, after = np.insert(away[:-1], 0, np.inf), np.append(away[1:], np.inf)
    out: list[_Meeting] = []
    for k in np.flatnonzero((away <= before) & (away <= after) & (away < SHORT * size)):
        place = _met(pairs, path.places[k])
        if place is None:
            continue
        gaps = np.abs((path.places - place) / scale).max(axis=1)
        if gaps.min() > NEAR or (out and np.abs((out[-1].place - place) / scale).max() < BESIDE):
            continue
        _require_angle(pairs, place)
        out.append(_Meeting(_segment(path.places / scale, place / scale), place))
    return out


def _met(pairs: Pairs, guess: Array) -> Array | None:
    """The meeting near a place, by the method of Gauss and Newton; None where there is none."""
    place = guess
    for _ in range(30):
        a, b = pairs.first.jet(place[:1], 1), pairs.second.jet(place[1:], 1)
        matrix = np.column_stack([a[1, 0], -b[1, 0]])
        step = np.linalg.lstsq(matrix, a[0, 0] - b[0, 0], rcond=None)[0]
        place = place - step
        if np.abs(step / branches.spans(pairs)).max() <= 1e-16:
            break
    span = branches.spans(pairs)[0]
    if pairs.same and abs(float(pairs.first.wrapped(*place))) <= 1e-3 * span:
        return None
    gap = pairs.first.jet(place[:1], 0) - pairs.second.jet(place[1:], 0)
    return place if np.linalg.norm(gap) <= COINCIDE * _size(pairs) else None


def _size(pairs: Pairs) -> float:
    return float(np.ptp(pairs.first.curve.point(pairs.first.places), axis=0).max())


def _require_angle(pairs: Pairs, place: Array) -> None:
    """Raise a GeometryError where the curves touch."""
    a, b = pairs.first.jet(place[:1], 1)[1, 0], pairs.second.jet(place[1:], 1)[1, 0]
    sine = float(np.linalg.norm(np.cross(a, b)) / (np.linalg.norm(a) * np.linalg.norm(b)))
    if sine <= PARALLEL:
        raise GeometryError(
            ("curves: the curve touches itself" if pairs.same else "curves: the curves touch")
            + f" at the parameters {place[0]:.6g} and {place[1]:.6g}: no ruling is defined there",
            value=sine,
            limit=PARALLEL,
            remedy="move them apart, let them cross, or end a curve before that point",
        )


def _segment(places: Array, place: Array) -> int:
    """The index of the place of a polyline after which another one comes."""
    a, way = places[:-1], np.diff(places, axis=0)
    share = ((place - a) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-300)
    foot = a + np.clip(share, 0.0, 1.0)[:, None] * way
    return int(np.argmin(np.linalg.norm(foot - place, axis=1)))


def _twice(path: Path) -> Path:
    """A closed path run through twice, as an open one."""
    image = path.places[:, ::-1] if path.flips else path.places
    shift = path.places[-1] - image[0]
    places = np.concatenate([path.places, image[1:] + shift])
    nodes = dict(path.nodes)
    for k, node in path.nodes.items():
        at = k + len(path.places) - 1
        ways = node.directions[:, ::-1].copy() if path.flips else node.directions
        nodes[at] = replace(node, place=places[at], directions=ways)
    return Path(places, np.zeros_like(places), nodes, False)


def _arc(
    pairs: Pairs, path: Path, start: _Meeting, end: _Meeting, meets: tuple[bool, bool]
) -> Path | None:
    """The part of a path between two of its places, None if they are one."""
    scale = branches.spans(pairs)
    index = np.arange(start.index + 1, end.index + 1)
    ends = np.array([start.place, end.place])
    gaps = np.abs((path.places[index, None] - ends) / scale).max(axis=2).min(axis=1)
    index = index[gaps > BESIDE]
    if not len(index) and np.abs((ends[1] - ends[0]) / scale).max() <= BESIDE:
        return None
    places = np.concatenate([ends[:1], path.places[index], ends[1:]])
    nodes = {k + 1: path.nodes[i] for k, i in enumerate(index.tolist()) if i in path.nodes}
    for k, place, met in ((0, ends[0], meets[0]), (len(places) - 1, ends[1], meets[1])):
        node = _node(pairs, path, place) if met else _near(pairs, path, place)
        if node is not None:
            nodes[k] = node
    plain = Path(places, np.zeros_like(places), nodes, False, meets=meets)
    return branches.with_tangents(pairs, plain)


def _near(pairs: Pairs, path: Path, place: Array) -> Node | None:
    """The path's own node at a place, put there exactly."""
    for node in path.nodes.values():
        if np.abs((node.place - place) / branches.spans(pairs)).max() <= BESIDE:
            return replace(node, place=place)
    return None


def _node(pairs: Pairs, path: Path, place: Array) -> Node:
    """The node at a meeting, where the function always vanishes with its gradient."""
    node = _near(pairs, path, place) or node_at(pairs, place, CELL * branches.spans(pairs))
    if node is None:
        raise Unresolved(place)
    return node
