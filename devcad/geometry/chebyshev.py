"""Piecewise Chebyshev series: adaptive sampling, integration and differentiation to rounding.

Quadrature in devcad is spectral: a function is sampled at Chebyshev extrema on panels that end
at its breaks, doubled (17 to 129 nodes; nested, so that no sample is lost) or halved until its
last coefficients drown in rounding, and integrated term by term.

Source: Trefethen, Approximation Theory and Approximation Practice, chapters 3, 8 and 19.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from devcad.geometry.taylor import Array

SIZES = (17, 33, 65, 129)
"""Nodes tried on one panel before it is halved."""
DROWNED = 1e-14
"""A tail of coefficients below this share of the function's size is rounding."""
NOISE = 1e-9
"""A tail that has stopped falling below this share is the function's own noise."""
DEPTH = 14
"""How often a panel may be halved; after that it is taken as it is."""

Function = Callable[[Array], Array]
"""t (n,) -> values (n, d)."""


@dataclass(frozen=True, slots=True)
class Piecewise:
    """A piecewise polynomial in Chebyshev form: ``knots`` (k + 1,), ``coefficients`` (k, N, d).

    Panel i covers knots[i] to knots[i + 1]; at a knot the panel on its right answers.
    ``samples`` is the number of distinct parameters that its construction looked at.
    """

    knots: Array
    coefficients: Array
    samples: int = 0

    def __call__(self, t: Array) -> Array:
        """The values at t (n,), shape (n, d), by Clenshaw's recurrence."""
        t = np.asarray(t, dtype=float)
        panel = np.clip(
            np.searchsorted(self.knots, t, side="right") - 1, 0, len(self.coefficients) - 1
        )
        low, high = self.knots[panel], self.knots[panel + 1]
        x = ((t - low) - (high - t)) / (high - low)
        if len(self.coefficients) == 1:
            return _clenshaw_one(self.coefficients[0], x)
        return clenshaw(self.coefficients[panel], x)

    def antiderivative(self) -> Piecewise:
        """The integral from the first knot, continuous, one degree higher."""
        half = 0.5 * np.diff(self.knots)[:, None, None]
        local = half * np.einsum(
            "ij,pjd->pid", integration(self.coefficients.shape[1]), self.coefficients
        )
        ends = np.cumsum(local.sum(axis=1), axis=0)  # T_k(1) = 1
        local[1:, 0] += ends[:-1]
        return Piecewise(self.knots, local, self.samples)

    def derivative(self) -> Piecewise:
        """The derivative on each panel, one degree lower."""
        half = 0.5 * np.diff(self.knots)[:, None, None]
        matrix = differentiation(self.coefficients.shape[1])
        return Piecewise(
            self.knots, np.einsum("ij,pjd->pid", matrix, self.coefficients) / half, self.samples
        )


def resolve(function: Function, knots: Array, *, scale: Array | float | None = None) -> Piecewise:
    """A piecewise Chebyshev series that equals ``function`` to rounding between the knots.

    Args:
        function: t (n,) -> (n, d), smooth between consecutive knots; looked at strictly inside.
        knots: (k + 1,) increasing.
        scale: the size below which a component counts as zero, (d,) or one number for all;
            default: the largest value of the component that was seen.
    """
    floor = 0.0 if scale is None else scale
    return resolve_by(
        lambda t, _low, _high: function(t),
        lambda v, _half: v,
        knots,
        scale=lambda raw: np.broadcast_to(np.asarray(floor, dtype=float), raw.shape[1:]),
    )


def resolve_by(
    sample: Callable[[Array, float, float], Array],
    lift: Callable[[Array, float], Array],
    knots: Array,
    *,
    scale: Callable[[Array], Array],
) -> Piecewise:
    """As ``resolve``, for a function that is made on each panel from the samples on it.

    Args:
        sample: (t, low, high) -> (n, d0) the samples taken.
        lift: (samples (n, d0), half width) -> (n, d) the values to be represented, which must
            be resolved; integrals over the panel may enter.
        scale: the first panel's first samples -> the size below which a component counts as
            zero, (d,).
    """
    done: list[tuple[float, float, Array]] = []
    size = np.zeros(0)
    count = 0
    stack = [(a, b, 0) for a, b in zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True)][::-1]
    while stack:
        low, high, depth = stack.pop()
        raw = np.zeros((0, 0))
        for nodes in SIZES:
            raw, fresh = _grow(sample, low, high, nodes, raw)
            size = size if count else scale(raw)
            count += fresh
            values = lift(raw, 0.5 * (high - low))
            coefficients = transform(nodes) @ values
            size = np.maximum(size, np.abs(values).max(axis=0, initial=0.0))
            verdict = _verdict(coefficients, size)
            if verdict != "double":
                break
        if verdict == "done" or depth >= DEPTH:
            done.append((low, high, coefficients))
            continue
        middle = 0.5 * (low + high)
        stack += [(middle, high, depth + 1), (low, middle, depth + 1)]
    width = max(len(c) for _, _, c in done)
    table = np.zeros((len(done), width, done[0][2].shape[1]))
    for row, (_, _, c) in zip(table, done, strict=True):
        row[: len(c)] = c
    ends = np.array([low for low, _, _ in done] + [done[-1][1]])
    return Piecewise(ends, table, count)


def nodes(low: float, high: float, number: int) -> Array:
    """The Chebyshev extrema of a panel, increasing, its ends moved inside by one rounding.

    At the very end a piecewise function would answer for the neighbour.
    """
    t = low + (high - low) * _unit_nodes(number)
    t[0], t[-1] = np.nextafter(low, high), np.nextafter(high, low)
    return t


@lru_cache(maxsize=16)
def transform(number: int) -> Array:
    """The matrix from values at the extrema to Chebyshev coefficients, (N, N)."""
    k = np.arange(number)
    last = number - 1
    # cos(pi j (last - k) / last), reduced by integers so that large arguments lose nothing
    angle = (np.outer(k, last - k) % (2 * last)) * (np.pi / last)
    matrix = np.cos(angle) * (2.0 / last)
    matrix[:, [0, -1]] *= 0.5
    matrix[[0, -1]] *= 0.5
    return np.asarray(matrix)


@lru_cache(maxsize=16)
def integration_of_values(number: int) -> Array:
    """The matrix from values at the extrema of [-1, 1] to integrals from -1, (N, N)."""
    coefficients = integration(number) @ transform(number)  # (N + 1, N)
    k = np.arange(number + 1)
    last = number - 1
    back = np.cos((np.outer(last - np.arange(number), k) % (2 * last)) * (np.pi / last))
    return np.asarray(back @ coefficients)


def _verdict(coefficients: Array, size: Array) -> str:
    """Whether a panel is resolved ("done"), worth doubling ("double") or to be halved."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(size > 0.0, np.abs(coefficients) / size, 0.0)
    n = len(share)
    head, middle, tail = share[: n // 2], share[n // 2 : 7 * n // 8], share[7 * n // 8 :]
    last = tail.max()
    if not np.isfinite(last):
        return "done"  # a function that is not a number is told apart where it is used
    if last <= DROWNED:
        return "done"
    if last <= NOISE and last >= 0.125 * middle[len(middle) // 2 :].max():
        return "done"  # no longer falling
    # the coefficients fall geometrically: this many nodes would drown the tail
    falls = np.log(last / max(head.max(), last))
    needed = n * np.log(DROWNED) / falls if falls < 0.0 else np.inf
    return "double" if needed <= 1.2 * SIZES[-1] else "halve"


def _grow(
    sample: Callable[[Array, float, float], Array], low: float, high: float, number: int, raw: Array
) -> tuple[Array, int]:
    """Samples at the extrema of a panel, those already taken kept; and how many are new."""
    t = nodes(low, high, number)
    if not raw.size:
        return sample(t, low, high), number
    new = sample(t[1::2], low, high)
    out = np.empty((number, raw.shape[1]))
    out[::2], out[1::2] = raw, new
    return out, len(new)


@lru_cache(maxsize=16)
def _unit_nodes(number: int) -> Array:
    """The Chebyshev extrema on [0, 1], increasing: sin^2, exact at both ends."""
    return np.asarray(np.sin(np.arange(number) * (0.5 * np.pi / (number - 1))) ** 2)


@lru_cache(maxsize=16)
def integration(number: int) -> Array:
    """The matrix from the coefficients of f to those of its integral from -1, (N + 1, N)."""
    matrix = np.zeros((number + 1, number))
    for k in range(number):
        if k == 0:
            matrix[1, 0] += 1.0
        elif k == 1:
            matrix[0, 1] += 0.25
            matrix[2, 1] += 0.25
        else:
            matrix[k + 1, k] += 0.5 / (k + 1)
            matrix[k - 1, k] -= 0.5 / (k - 1)
    signs = (-1.0) ** np.arange(number + 1)
    matrix[0] -= signs @ matrix  # the integral vanishes at -1
    return matrix


@lru_cache(maxsize=16)
def differentiation(number: int) -> Array:
    """The matrix from the coefficients of f to those of f', (N, N) with a zero last row."""
    matrix = np.zeros((number, number))
    for k in range(number):
        matrix[k, k + 1 :: 2] = 2.0 * np.arange(k + 1, number, 2)
    matrix[0] *= 0.5
    return matrix


def clenshaw(coefficients: Array, x: Array) -> Array:
    """Sum of c_k T_k(x) for each point's own coefficients (n, N, d) and x (n,)."""
    b1 = np.zeros((len(x), coefficients.shape[2]))
    b2 = b1
    twice = 2.0 * x[:, None]
    for k in range(coefficients.shape[1] - 1, 0, -1):
        b1, b2 = coefficients[:, k] + twice * b1 - b2, b1
    return np.asarray(coefficients[:, 0] + x[:, None] * b1 - b2)


def _clenshaw_one(coefficients: Array, x: Array) -> Array:
    """As ``clenshaw`` when all points share one panel's coefficients (N, d)."""
    last = np.abs(coefficients).max(axis=1)
    used = int(np.flatnonzero(last)[-1]) + 1 if last.any() else 1
    b1 = np.zeros((len(x), coefficients.shape[1]))
    b2 = b1
    twice = 2.0 * x[:, None]
    for k in range(used - 1, 0, -1):
        b1, b2 = coefficients[k] + twice * b1 - b2, b1
    return np.asarray(coefficients[0] + x[:, None] * b1 - b2)
