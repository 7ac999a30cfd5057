"""A curve from its curvature and torsion: the frame equations, solved to rounding.

T' = k N, N' = -k T + tau B, B' = -tau N, r' = T, the parameter being the arc length. On each
panel the equations are solved in integral form by collocation at Chebyshev extrema (one linear
system, well conditioned), and panels are halved until the last coefficients drown in rounding.
Derivatives come from the equations themselves, so that |r'| = 1 and the curvature of the result
is k whatever the panels.

Source: Trefethen, Approximation Theory and Approximation Practice, chapters 3 and 19; the
integral form: Greengard, SIAM J. Numer. Anal. 28 (1991), 1071-1080.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import JobError, LimitError
from devcad.geometry.chebyshev import Piecewise, integration_of_values, nodes, transform
from devcad.geometry.curve import Curve, ends_meet
from devcad.geometry.taylor import Array, constant

Scalar = Callable[[Array, int], Array]
"""Parameters t (n,) and an order K to a Taylor series (K + 1, n)."""

NODES = 24
DROWNED = 4e-15  # tail of the coefficients of a unit vector that is rounding
MAX_PANELS = 2_000  # about as many turns
FINEST = 2.0**-40  # of the domain: a kink of k or tau inside moves nothing by 1e-24 of it


def natural(
    curvature: Scalar, torsion: Scalar, domain: tuple[float, float], origin: Array, frame: Array
) -> Curve:
    """The curve with this curvature and torsion that starts at ``origin`` with ``frame``.

    The rows of ``frame`` (3, 3) are T, N, B, orthonormal and right-handed. The curvature may
    change its sign or vanish: N is then the frame that continues smoothly.

    Raises:
        JobError: curvature or torsion is not finite somewhere.
        LimitError: the frame turns too often to be followed.
    """

    def rates(t: Array, order: int) -> tuple[Array, Array, Array]:
        return constant(1.0, order, t.size), curvature(t, order), torsion(t, order)

    framed = framed_curve(rates, domain, origin, frame)
    curve = Curve(lambda t, order: framed(t, order)[0], domain)
    return replace(curve, closed=ends_meet(curve))


Rates = Callable[[Array, int], tuple[Array, Array, Array]]
"""Parameters t (n,) and an order K to the series (K + 1, n) of ds/dt, k ds/dt and tau ds/dt."""


@dataclass(frozen=True, slots=True)
class Framed:
    """A curve with the frame that its rates move: what ``framed_curve`` gives."""

    path: Piecewise
    rates: Rates

    def __call__(self, t: Array, order: int) -> tuple[Array, Array, Array, Array]:
        """The series of the point, T, N and B at t (n,), each (order + 1, n, 3)."""
        return _series(self.path(t), self.rates(t, order), order)


def framed_curve(
    rates: Rates,
    domain: tuple[float, float],
    origin: Array,
    frame: Array,
    breaks: tuple[float, ...] = (),
) -> Framed:
    """The curve of any parameter whose frame moves at these rates, and that frame.

    As ``natural``: T' = k N, N' = -k T + tau B, B' = -tau N and r' = T, each times the speed
    ds/dt > 0. ``breaks`` are interior parameters where the rates may jump.

    Raises:
        JobError: a rate is not finite somewhere; LimitError: the frame turns too often.
    """
    return Framed(_integrate(rates, (domain[0], *breaks, domain[1]), origin, frame), rates)


def _integrate(rates: Rates, knots: tuple[float, ...], origin: Array, frame: Array) -> Piecewise:
    """The frame and the position, a row (T, N, B, r) of 12 numbers, over the domain."""
    done: list[tuple[float, Array]] = []
    domain = knots[0], knots[-1]
    stack = list(pairwise(knots))[::-1]
    start, place = frame, origin
    while stack:
        low, high = stack.pop()
        t = nodes(low, high, NODES)
        speed, k, tau = (rate[0] for rate in rates(t, 0))
        _check_finite(t, k, "curvature")
        _check_finite(t, tau, "torsion")
        half = 0.5 * (high - low)
        turning = half * max(np.abs(k).max(), np.abs(tau).max())
        values = _turned(half * k, half * tau) @ start if turning < NODES else None
        coefficients = None if values is None else _resolved(values, speed)
        if coefficients is None and high - low > FINEST * (domain[1] - domain[0]):
            middle = 0.5 * (low + high)
            stack += [(middle, high), (low, middle)]
            if len(done) + len(stack) > MAX_PANELS:
                raise _too_long(low)
            continue
        if values is None:
            raise _too_fast(low, turning / half)
        along = speed[:, None] * values[:, 0]
        position = place + half * (integration_of_values(NODES) @ along)
        rows = np.concatenate([values.reshape(NODES, 9), position], axis=1)
        done.append((low, transform(NODES) @ rows))
        start, place = _orthonormal(values[-1]), position[-1]
    lows = np.array([low for low, _ in done] + [domain[1]])
    return Piecewise(lows, np.stack([table for _, table in done]))


def _turned(k: Array, tau: Array) -> Array:
    """The rotations (NODES, 3, 3) from the frame at the start of [-1, 1] to that at its nodes.

    Solves P = 1 + integral of A P, A the matrix of the frame equations with k and tau (NODES,).
    """
    equations = np.zeros((NODES, 3, 3))
    equations[:, 0, 1], equations[:, 1, 0] = k, -k
    equations[:, 1, 2], equations[:, 2, 1] = tau, -tau
    kernel = np.einsum("ij,jab->iajb", integration_of_values(NODES), equations)
    size = 3 * NODES
    system = np.eye(size) - kernel.reshape(size, size)
    return np.asarray(np.linalg.solve(system, np.tile(np.eye(3), (NODES, 1)))).reshape(-1, 3, 3)


def _resolved(values: Array, speed: Array) -> Array | None:
    """The Chebyshev coefficients of the frame on a panel, None if its tail has not drowned, or
    that of the velocity."""
    along = (speed / speed.max())[:, None] * values[:, 0]
    coefficients = transform(NODES) @ np.concatenate([values.reshape(NODES, 9), along], axis=1)
    return coefficients if np.abs(coefficients[-3:]).max() <= DROWNED else None


def _series(
    rows: Array, rates: tuple[Array, Array, Array], order: int
) -> tuple[Array, Array, Array, Array]:
    """The Taylor coefficients of the position and the frame, from the frame equations, one order
    at a time."""
    speed, k, tau = rates
    n = len(rows)
    frame = _orthonormal(rows[:, :9].reshape(n, 3, 3))
    t, nn, b = (np.zeros((order + 1, n, 3)) for _ in range(3))
    t[0], nn[0], b[0] = frame[:, 0], frame[:, 1], frame[:, 2]
    r = np.zeros((order + 1, n, 3))
    r[0] = rows[:, 9:]
    for j in range(order):
        r[j + 1] = _product(speed, t, j) / (j + 1)
        kn, kt = _product(k, nn, j), _product(k, t, j)
        tb, tn = _product(tau, b, j), _product(tau, nn, j)
        t[j + 1], nn[j + 1], b[j + 1] = kn / (j + 1), (tb - kt) / (j + 1), -tn / (j + 1)
    return r, t, nn, b


def _product(x: Array, y: Array, j: int) -> Array:
    """Coefficient j of the product of a scalar and a vector series."""
    return np.asarray(np.einsum("in,ina->na", x[: j + 1], y[j::-1]))


def _orthonormal(frame: Array) -> Array:
    """The orthonormal frame next to one that is so up to rounding, (..., 3, 3).

    One step of Newton's iteration for the polar factor squares an error of 1e-14.
    """
    return np.asarray(1.5 * frame - 0.5 * frame @ np.swapaxes(frame, -1, -2) @ frame)


def _check_finite(t: Array, values: Array, name: str) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        raise JobError(
            f"the {name} is not a finite number at t = {t[bad][0]:.9g}",
            value=float(t[bad][0]),
            remedy="change the expression or shorten the interval t",
        )


def _too_fast(t: float, rate: float) -> JobError:
    return JobError(
        f"the curvature or the torsion reaches {rate:.3g} near t = {t:.9g}",
        value=rate,
        remedy="change the expression: no part of the curve could be followed there",
    )


def _too_long(t: float) -> LimitError:
    return LimitError(
        f"the curve turns too often: {MAX_PANELS} panels do not reach beyond t = {t:.9g}",
        value=t,
        limit=MAX_PANELS,
        remedy="shorten the interval t, or give smaller curvature and torsion",
    )
