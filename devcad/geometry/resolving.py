"""Many functions represented by Chebyshev series at once, to rounding.

What :func:`devcad.geometry.chebyshev.resolve` does for one function, for all of them together:
every round samples all panels that are not yet resolved in a single call.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.geometry import chebyshev
from devcad.geometry.chebyshev import DROWNED, NOISE, SIZES, Piecewise
from devcad.geometry.taylor import Array

Index = NDArray[np.intp]
Flags = NDArray[np.bool_]

DEPTH = 12
"""How often a panel may be halved; after that it is taken as it is."""

Sample = Callable[[Index, Array], Array]
"""Which function (n,) and where u (n,) -> values (n, d)."""


@dataclass(frozen=True, slots=True)
class Panels:
    """Chebyshev series side by side: ``owner`` (m,) is whose panel it is, over ``low`` to
    ``high`` (m,), with ``coefficients`` (m, N, d); sorted by owner and place."""

    owner: Index
    low: Array
    high: Array
    coefficients: Array

    def series(self, number: int) -> list[Piecewise]:
        """One piecewise series for each of the ``number`` functions."""
        first = np.searchsorted(self.owner, np.arange(number + 1)).tolist()
        out = []
        for a, b in itertools.pairwise(first):
            table = self.coefficients[a:b]
            used = np.flatnonzero(np.abs(table).max(axis=(0, 2)))
            kept = table[:, : int(used[-1]) + 1 if len(used) else 1]
            out.append(Piecewise(np.append(self.low[a:b], self.high[b - 1]), kept))
        return out


def unit_nodes(number: int) -> Array:
    """The Chebyshev extrema on [0, 1], increasing, both ends exact."""
    return np.asarray(np.sin(np.arange(number) * (0.5 * np.pi / (number - 1))) ** 2)


def resolve_many(
    sample: Sample,
    low: Array,
    high: Array,
    *,
    scale: Array,
    sizes: tuple[int, ...] = SIZES,
    owner: Index | None = None,
) -> Panels:
    """Series that equal the functions to rounding, function k over low[k] to high[k].

    Args:
        sample: looked at on the closed intervals, once at each node.
        low, high: (k,); with ``owner`` (k,) several panels of one function, in order.
        scale: the size below which a component counts as zero, (k, d), one row a panel.
        sizes: the numbers of nodes tried before a panel is halved, each one less than twice
            the one before.
    """
    owner = np.arange(len(low)) if owner is None else owner
    done: list[_Table] = []
    todo: _Table = (owner, low, high, scale)
    for depth in range(DEPTH + 1):
        good, halved = _round(sample, todo, sizes, last=depth == DEPTH)
        done += good
        todo = _halves(halved)
        if not len(todo[0]):
            break
    return _sorted(done)


_Table = tuple[Index, Array, Array, Array]
"""Panels: owner, low, high and, one row each, their sizes or their coefficients."""


def _round(
    sample: Sample, todo: _Table, sizes: tuple[int, ...], *, last: bool
) -> tuple[list[_Table], list[_Table]]:
    """The panels that are resolved with one of the numbers of nodes, with their coefficients, and
    those that are to be halved, with their sizes; none of these in the last round."""
    owners, a, b, size = todo
    values = np.zeros((len(owners), 0, 0))
    done: list[_Table] = []
    halved: list[_Table] = []
    for number in sizes:
        if not len(owners):
            break
        values = _grown(sample, owners, a, b, number, values)
        size = np.maximum(size, np.abs(values).max(axis=1))
        coefficients = np.einsum("ij,mjd->mid", chebyshev.transform(number), values)
        good, more = _verdicts(coefficients, size)
        final = number == sizes[-1]
        good |= last and final
        padded = np.zeros((int(good.sum()), sizes[-1], values.shape[2]))
        padded[:, :number] = _ending_exactly(coefficients[good], values[good])
        done.append((owners[good], a[good], b[good], padded))
        split = ~good & (final | ~more) & (not last)
        halved.append((owners[split], a[split], b[split], size[split]))
        keep = ~good & ~split
        owners, a, b, size, values = owners[keep], a[keep], b[keep], size[keep], values[keep]
    return done, halved


def _grown(
    sample: Sample, owner: Index, low: Array, high: Array, number: int, values: Array
) -> Array:
    """Samples at the extrema of all panels, (m, number, d), those already taken kept."""
    share = unit_nodes(number)
    fresh = slice(1, None, 2) if values.shape[1] else slice(None)
    s = share[fresh]
    u = low[:, None] * (1.0 - s) + high[:, None] * s
    if not values.shape[1]:
        u[:, 0], u[:, -1] = low, high
    new = sample(np.repeat(owner, len(s)), u.ravel()).reshape(len(owner), len(s), -1)
    if not values.shape[1]:
        return new
    out = np.empty((len(owner), number, new.shape[2]))
    out[:, ::2], out[:, 1::2] = values, new
    return out


def _ending_exactly(coefficients: Array, values: Array) -> Array:
    """The series (m, N, d) with what rounding left at their ends taken off."""
    even, odd = coefficients[:, ::2].sum(axis=1), coefficients[:, 1::2].sum(axis=1)
    start, end = values[:, 0] - (even - odd), values[:, -1] - (even + odd)
    out = coefficients.copy()
    out[:, 0] += 0.5 * (start + end)
    out[:, 1] += 0.5 * (end - start)
    return out


def _verdicts(coefficients: Array, size: Array) -> tuple[Flags, Flags]:
    """Which panels are resolved, and which of the others are worth doubling; as chebyshev.py."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.abs(coefficients) / size[:, None, :]
    share = np.where(size[:, None, :] > 0.0, share, 0.0).max(axis=2)
    n = share.shape[1]
    head, middle = share[:, : n // 2], share[:, n // 2 : 7 * n // 8]
    last = share[:, 7 * n // 8 :].max(axis=1)
    before = middle[:, middle.shape[1] // 2 :].max(axis=1)
    still = (last <= NOISE) & (last >= 0.125 * before)
    good = ~np.isfinite(last) | (last <= DROWNED) | still
    with np.errstate(invalid="ignore", divide="ignore"):
        falls = np.log(last / np.maximum(head.max(axis=1), last))
        needed = np.where(falls < 0.0, n * np.log(DROWNED) / falls, np.inf)
    return good, needed <= 1.2 * SIZES[-1]


def _halves(panels: list[_Table]) -> _Table:
    if not panels:
        return np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0), np.zeros((0, 0))
    owner, low, high, size = (np.concatenate(x) for x in zip(*panels, strict=True))
    middle = 0.5 * (low + high)
    return (
        np.concatenate([owner, owner]),
        np.concatenate([low, middle]),
        np.concatenate([middle, high]),
        np.concatenate([size, size]),
    )


def _sorted(panels: list[_Table]) -> Panels:
    owner, low, high, table = (np.concatenate(x) for x in zip(*panels, strict=True))
    order = np.lexsort([low, owner])
    used = np.flatnonzero(np.abs(table).max(axis=(0, 2), initial=0.0))
    width = int(used[-1]) + 1 if len(used) else 1
    return Panels(owner[order], low[order], high[order], table[order][:, :width])
