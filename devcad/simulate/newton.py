"""Equilibrium by Newton's method, and whether it is stable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.energy import Forces, Matrix, Pattern, State
from devcad.simulate.freedoms import Held, turned_to_balance
from devcad.simulate.model import Model

TOLERANCE = 1e-9
"""Residual over the largest force that one bar, hinge or load exerts on a node."""
ROUNDING = 64.0  # ... and how many roundings of the largest term are allowed besides
ITERATIONS = 25
TURN = 1.0  # radians: a hinge's largest turn in one step, the range of its linear model
REACH = 0.25  # of the sheet's size: a node's largest way in one step


@dataclass(frozen=True, slots=True)
class Demand:
    """What is asked for at one moment: rest angles (h,), loads (n, 3) N, and the positions of
    supported components, ``places`` (3n,) of which those in ``Held.fixed`` count."""

    rest: Array
    loads: Array
    places: Array

    def toward(self, other: Demand, share: float) -> Demand:
        """Linear between two demands: 0 this one, 1 the other."""
        keep = 1 - share
        return Demand(
            keep * self.rest + share * other.rest,
            keep * self.loads + share * other.loads,
            keep * self.places + share * other.places,
        )


@dataclass(frozen=True, slots=True)
class Balance:
    """An equilibrium, or how far the search for one came.

    ``negative`` counts the directions in which the energy falls: 0 is a stable equilibrium.
    ``foretold`` are the stresses and moments of the last tangent, for the next search.
    """

    at: State
    foretold: Forces
    residual: float
    scale: float
    limit: float
    iterations: int
    negative: int

    @property
    def reached(self) -> bool:
        """The residual is within its limit."""
        return self.residual <= self.limit


@dataclass(frozen=True, slots=True)
class Task:
    """A model with its sparsity and with what is held of it."""

    model: Model
    form: Pattern
    grip: Held


def factorised(task: Task, matrix: Matrix, shift: float) -> tuple[Callable[[Array], Array], int]:
    """A matrix with held coordinates taken out, shifted on its diagonal.

    Returns:
        what solves with it, and how many of its eigenvalues are negative: -1 where the order of
        elimination had to be changed.

    No pivots are exchanged, so that the factors are L D L^T and the signs of D those of the
    eigenvalues (Sylvester).

    Raises:
        RuntimeError: the matrix is singular.
    """
    from scipy.sparse.linalg import splu

    still = task.grip.still
    matrix = matrix.copy()
    matrix.data[still[task.form.column] | still[task.form.indices]] = 0.0
    diagonal = matrix.data[task.form.diagonal]
    typical = float(np.mean(np.abs(diagonal))) or 1.0
    matrix.data[task.form.diagonal] = np.where(still, typical, diagonal + shift)
    factors = splu(
        matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    in_order = np.array_equal(factors.perm_r, factors.perm_c)
    return factors.solve, int(np.sum(factors.U.diagonal() < 0)) if in_order else -1


def unbalanced(task: Task, at: State, demand: Demand) -> Array:
    """(3n,) internal forces less loads, N; at supports their reactions."""
    return np.asarray((energy.gradient(task.model, at, demand.rest) - demand.loads).reshape(-1))


def measured(
    task: Task, at: State, demand: Demand, dragged: Array | float = 0.0
) -> tuple[float, float, float]:
    """Residual, the force that it is measured against, and its limit, N."""
    force = unbalanced(task, at, demand) + np.reshape(dragged, -1)
    force[task.grip.fixed] = 0.0
    scale = max(
        energy.largest(task.model, at, demand.rest),
        float(np.max(np.abs(demand.loads), initial=0.0)),
    )
    limit = TOLERANCE * scale + ROUNDING * energy.rounding(task.model, at)
    return float(np.max(np.abs(force), initial=0.0)), scale, limit


def newton(
    task: Task,
    start: State,
    foretold: Forces,
    demand: Demand,
    *,
    iterations: int = ITERATIONS,
    drag: float = 0.0,
    downhill: bool = False,
) -> Balance:
    """The equilibrium next to ``start``, or the best state that was looked at.

    Each step solves K du = -r with second derivatives weighted by the stresses and moments that
    the last tangent foretold (``energy.ahead``), those of the last equilibrium at first.

    Args:
        drag: N/mm of springs from every coordinate to where it starts: a step of backward Euler
            down the energy, whose ``negative`` counts with them.
        downhill: give up at once where the energy, springs included, is not convex at the start.
    Returns:
        a Balance, which is not ``reached`` where the search failed.
    """
    if drag > 0:  # springs hold the rigid motions: a gauge would bear their forces
        task = replace(task, grip=replace(task.grip, gauge=task.grip.gauge[:0]))
    model, grip = task.model, task.grip
    at, measure = start, measured(task, start, demand)
    best = (measure[0], start)
    for count in range(iterations):
        matrix = energy.hessian(model, task.form, at, foretold)
        jump = np.zeros(3 * len(at.x))
        jump[grip.fixed] = (demand.places - at.x.reshape(-1))[grip.fixed]
        push = -unbalanced(task, at, demand) - matrix @ jump - drag * (at.x - start.x).reshape(-1)
        push[grip.still] = 0.0
        try:
            solve, negative = factorised(task, matrix, drag)
        except RuntimeError:
            break
        if downhill and count == 0 and negative != 0:
            return Balance(at, foretold, np.inf, *measure[1:], 1, negative)
        step = (solve(push) + jump).reshape(-1, 3)
        if not np.all(np.isfinite(step)):
            break
        step *= _damping(task, at, step)
        foretold = energy.ahead(model, at, demand.rest, step)
        at = energy.state(model, _balanced(task, at.x + step, demand), at.angles)
        measure = measured(task, at, demand, drag * (at.x - start.x))
        gap = float(np.max(np.abs(jump), initial=0.0))
        if measure[0] <= measure[2] and gap <= 1e-12 * model.size:
            return Balance(at, foretold, *measure, count + 1, _falls(task, at, demand, drag))
        best = min(best, (measure[0], at), key=lambda pair: pair[0])
    missed = max(best[0], 2 * measure[2])  # in balance, but supports not at their places
    return Balance(best[1], foretold, missed, measure[1], measure[2], iterations, -1)


def _falls(task: Task, at: State, demand: Demand, drag: float) -> int:
    """In how many directions the energy falls: from its true second derivatives at the state."""
    true = Forces(at.stress, energy.moments(task.model, at, demand.rest))
    try:
        return factorised(task, energy.hessian(task.model, task.form, at, true), drag)[1]
    except RuntimeError:
        return -1


def _balanced(task: Task, x: Array, demand: Demand) -> Array:
    """The nodes; those of a free sheet under loads turned so that the loads are in balance."""
    free = task.grip.rigid.shape[1] == 6 and bool(np.any(demand.loads))
    return turned_to_balance(x, demand.loads) if free else x


def _damping(task: Task, at: State, step: Array) -> float:
    """At most 1: what keeps hinges and nodes within the range of the linear model."""
    turn = np.einsum("hki,hki->h", at.slopes, step[task.model.hinges])
    way = float(np.max(np.abs(step), initial=0.0)) / (REACH * task.model.size)
    return 1 / max(1.0, float(np.max(np.abs(turn), initial=0.0)) / TURN, way)
