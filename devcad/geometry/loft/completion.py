"""From the searched path to one of exact places: roots that a monotone path joins, followed to the
border of the square, where fans are exact.

Source: algorithms.md, section 1 (stage 2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.loft.matching import LOOKS, Path, Value, nearest_root, warp_at
from devcad.geometry.loft.rail import Rail
from devcad.geometry.taylor import Array

STEEPEST = 1.0 + 1e-7
"""|d(u - v)| beyond this times d(u + v) is no step of one monotone path."""
CREASE = np.radians(0.1)
"""A crease below this is none (design.md, section 7)."""
BISECTIONS = 40
STENCIL = 1e-5
SAME = 1e-9
"""Two coordinates that differ by less are one."""


def completed(a: Rail, b: Rail, path: Path, rough: Path, *, fans: bool) -> Path:
    """The path with roots given up that no monotone path joins: there it is the ``rough`` one.
    With ``fans``, on open rails, its longest solved run is carried on to the border of the square,
    from where a fan is exact."""
    sums, x = path.u + path.v, path.u - path.v
    steady = np.abs(np.diff(x)) <= STEEPEST * np.diff(sums) + 1e-12
    runs = _compatible(_runs(path.solved[1:] & path.solved[:-1] & steady), sums, x)
    kept = np.zeros(len(x), dtype=bool)
    for low, high in runs:
        kept[low : high + 1] = True
    x = np.where(kept, x, np.interp(sums, rough.u + rough.v, rough.u - rough.v))
    if not runs or not fans or (a.closed and b.closed):
        return _rebuilt(a, b, sums, x, kept, fans=fans)
    low, high = max(runs, key=lambda run: run[1] - run[0])
    ends = []
    for start, step in ((low, -1), (high, +1)):
        while low < start < high or (start == (low if step < 0 else high) and high > low):
            if _forward(a, b, float(sums[start]), float(x[start])):
                break
            kept[start] = False
            start -= step
        rows, places, end = _carried_on(a, b, sums, x, start, step)
        x[rows], kept[rows] = places, True
        ends.append((start + step * len(rows), end))
    return _bordered(a, b, sums, x, kept, ends)


def _rebuilt(
    a: Rail, b: Rail, sums: Array, x: Array, kept: NDArray[np.bool_], *, fans: bool
) -> Path:
    """The path of these places, what is not solved kept monotone between what is."""
    x = _monotone(sums, x, kept)
    u, v = 0.5 * (sums + x), 0.5 * (sums - x)
    marks = _turns(u, v, kept)
    if fans and not (a.closed and b.closed):  # along the border there are fans, solved or not
        for edge in (u <= SAME, v <= SAME, u >= 1.0 - SAME, v >= 1.0 - SAME):
            marks += _turns(u, v, edge)
    return Path(u, v, kept, warp_at(a, b, u, v), marks)


def _compatible(runs: list[tuple[int, int]], sums: Array, x: Array) -> list[tuple[int, int]]:
    """What one monotone path can join of the runs: the longest whole, others without the samples
    that it cannot reach."""
    out: list[tuple[int, int]] = []
    for low, high in sorted(runs, key=lambda run: run[0] - run[1]):
        rows = np.arange(low, high + 1)
        for i, j in out:
            near = j if j < low else i
            rows = rows[np.abs(x[rows] - x[near]) <= STEEPEST * np.abs(sums[rows] - sums[near])]
        if len(rows) > 1 and len(rows) == rows[-1] - rows[0] + 1:
            out.append((int(rows[0]), int(rows[-1])))
    return sorted(out)


def _monotone(sums: Array, x: Array, kept: NDArray[np.bool_]) -> Array:
    """x with the places that are not kept drawn into what a monotone path can reach."""
    fixed = np.flatnonzero(kept)
    if not fixed.size or fixed.size == len(x):
        return x
    rows = np.arange(len(x))
    i = np.searchsorted(fixed, rows, side="right") - 1
    low, high = np.full(len(x), -np.inf), np.full(len(x), np.inf)
    for k, ok in (
        (np.maximum(i, 0), i >= 0),
        (np.minimum(i + 1, fixed.size - 1), i + 1 < fixed.size),
    ):
        gap = np.abs(sums - sums[fixed[k]])
        low = np.where(ok, np.maximum(low, x[fixed[k]] - gap), low)
        high = np.where(ok, np.minimum(high, x[fixed[k]] + gap), high)
    return np.where(kept, x, np.clip(x, low, np.maximum(low, high)))


def _runs(joined: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last sample of every run of joined samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], joined, [False]]).astype(int)))
    return [(int(low), int(high)) for low, high in zip(edges[::2], edges[1::2], strict=True)]


def _carried_on(
    a: Rail, b: Rail, sums: Array, x: Array, start: int, step: int
) -> tuple[NDArray[np.intp], Array, tuple[float, float]]:
    """The root followed from one anti-diagonal to the next until it meets the border or turns
    back: the samples it comes to, their places, and (u, v) of its end."""
    rows, found = [], []
    at, slope, k = float(x[start]), 0.0, start
    while 0 <= k + step < len(sums):
        root = _followed(a, b, float(sums[k]), at, float(sums[k + step]), slope)
        if root is None:
            break
        slope, at, k = root - at, root, k + step
        rows.append(k)
        found.append(at)
    low, high = float(sums[k]), float(sums[min(max(k + step, 0), len(sums) - 1)])
    place, t = at, low
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        root = _followed(a, b, float(sums[k]), at, middle, slope * (middle - float(sums[k])))
        low, high = (low, middle) if root is None else (middle, high)
        place, t = (place, t) if root is None else (root, middle)
    return np.array(rows, dtype=int), np.array(found), (0.5 * (t + place), 0.5 * (t - place))


def _followed(a: Rail, b: Rail, t: float, at: float, then: float, slope: float) -> float | None:
    """The root on the anti-diagonal ``then`` that follows the one at (t, at); None where there is
    none, or where the roots turn back: a path along them would not be monotone."""
    reach = abs(then - t)
    low, high = max(at - reach, -then, then - 2.0), min(at + reach, then, 2.0 - then)
    if high - low <= 1e-3 * reach:
        return None

    def value(s: Array) -> Array:
        return warp_at(a, b, 0.5 * (then + s), 0.5 * (then - s))

    looks = np.linspace(low, high, LOOKS)[None]
    hit, root = nearest_root(lambda _: value, np.array([0]), looks, np.array([at + slope]))
    if not hit[0]:
        return None
    place = float(root[0])
    return place if _forward(a, b, then, place) else None


def _forward(a: Rail, b: Rail, t: float, x: float) -> bool:
    """Whether the roots go on with both u and v not decreasing at (t, x)."""
    u, v = 0.5 * (t + x), 0.5 * (t - x)
    du, dv = STENCIL * np.array([1.0, -1.0]), STENCIL * np.array([1.0, -1.0])
    along_u = warp_at(a, b, np.clip(u + du, 0.0, 1.0), np.full(2, v))
    along_v = warp_at(a, b, np.full(2, u), np.clip(v + dv, 0.0, 1.0))
    return bool((along_u[0] - along_u[1]) * (along_v[0] - along_v[1]) <= 0.0)


def _bordered(
    a: Rail,
    b: Rail,
    sums: Array,
    x: Array,
    kept: NDArray[np.bool_],
    ends: list[tuple[int, tuple[float, float]]],
) -> Path:
    """The run between its ``ends`` (the last sample on either side, and the place beyond it)
    with what follows: fans to the corners of the square, else the path as it was."""
    x = _monotone(sums, x, kept)
    u, v = 0.5 * (sums + x), 0.5 * (sums - x)
    reach = 2.0 * float(sums[1] - sums[0])
    (first, start), (last, end) = ends
    head, tail = (_exit(a, b, *place, reach, edge) for place, edge in ((start, 0.0), (end, 1.0)))
    low, high = (first if head else 0), (last + 1 if tail else len(u))
    ways = [_run([(0.0, 0.0), *reversed(head)] if head else [])]
    ways.append((u[low:high], v[low:high], kept[low:high]))
    ways.append(_run([*tail, (1.0, 1.0)] if tail else []))
    u, v, kept = (np.concatenate(part) for part in zip(*ways, strict=True))
    return Path(u, v, kept, warp_at(a, b, u, v), (*head, *tail, *_turns(u, v, kept)))


def _run(places: list[tuple[float, float]]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Exact places of a path: u, v and that they are solved."""
    both = np.array(places).reshape(-1, 2)
    return both[:, 0], both[:, 1], np.ones(len(both), dtype=bool)


def _exit(
    a: Rail, b: Rail, u: float, v: float, reach: float, edge: float
) -> list[tuple[float, float]]:
    """How a run that ends at (u, v) goes on to the border u = edge or v = edge: over the root
    there; or, where it turned back before, over a fan about its end point, with a crease that
    counts for nothing; or not at all."""
    place = _border(a, b, u, v, reach, edge)
    if place is not None:
        return [place]
    turns = [(u, edge), (edge, v)]
    creases = np.abs(warp_at(a, b, *np.array(turns).T))
    k = int(np.argmin(creases))
    return [(u, v), turns[k]] if creases[k] <= CREASE else []


def _turns(u: Array, v: Array, kept: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """The last and first solved places before and after what is not solved."""
    change = np.flatnonzero(kept[1:] != kept[:-1])
    rows = np.where(kept[change], change, change + 1)
    return tuple((float(u[k]), float(v[k])) for k in rows)


def _border(
    a: Rail, b: Rail, u: float, v: float, reach: float, edge: float
) -> tuple[float, float] | None:
    """The root on the border u = edge or v = edge next to (u, v); None where there is none."""
    options = []
    for along in (0, 1):
        away = abs((u, v)[along] - edge)
        if away > reach:
            continue
        near = (v, u)[along]
        looks = np.linspace(max(near - 2.0 * reach, 0.0), min(near + 2.0 * reach, 1.0), 4 * LOOKS)[
            None
        ]

        def of(_: NDArray[np.intp], along: int = along) -> Value:
            def value(s: Array) -> Array:
                still = np.full_like(s, edge)
                return warp_at(a, b, *((still, s) if along == 0 else (s, still)))

            return value

        hit, root = nearest_root(of, np.array([0]), looks, np.array([near]))
        if hit[0]:
            place = (edge, float(root[0])) if along == 0 else (float(root[0]), edge)
            options.append((away, place))
        elif away <= SAME:
            options.append((away, (edge, near) if along == 0 else (near, edge)))
    return min(options)[1] if options else None
