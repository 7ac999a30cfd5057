"""Equilibrium paths past limit points: forces that fall while the sheet moves on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.energy import Forces, State
from devcad.simulate.freedoms import Supports, held, require_balance
from devcad.simulate.model import Model
from devcad.simulate.newton import (
    Balance,
    Demand,
    Task,
    factorised,
    measured,
    unbalanced,
)
from devcad.simulate.path import Run, Stage, Step, begun, demanded, failure, first, made, padded

CORRECTIONS = 25
SHORTEST = 2.0**-12  # of the length asked for: shorter steps mean that the path is lost
EASY = 6  # corrections of a step of the right length
RATES = (0.5, 2.0)  # how much a step may shorten or lengthen the next


def trace(
    model: Model,
    target: Stage,
    *,
    length: float,
    supports: Supports | None = None,
    start: Array | None = None,
    rest: Array | None = None,
    farthest: float = np.inf,
    listener: Callable[[Step], None] | None = None,
) -> Run:
    """Equilibria along the path from the start, stable or not.

    Riks's method with a fixed normal plane: each step goes ``length`` (mm, root mean square over
    the nodes) along the tangent, then corrects square to it; the factor of ``target``'s rest
    angles, loads and displacements is an unknown, ``Step.fraction``, and may fall.

    Args:
        target: what the factor 1 means; at most ``target.steps`` steps are made.
        start, rest, supports: as in ``fold``.
        farthest: the path ends after the first step whose factor is larger than this in size.
    Raises:
        ConvergenceError: the path is lost, even in steps of ``length`` / 4096.
    Source:
        E. Riks (1979), M. A. Crisfield (1981).
    """
    chosen = supports if supports is not None else Supports.none()
    x = model.start if start is None else padded(model, start)
    before = first(model, x, rest)
    moved = chosen.displacements if target.displacements is None else target.displacements
    after = demanded(model, target, chosen, before, before.places, moved)
    form = energy.pattern(model)
    task = Task(model, form, held(x, chosen))
    require_balance(task.grip, after.loads)
    balance, method = begun(task, x, before)
    steps, demands = [made(task, balance, before, (0, 0.0), method)], [before]
    ray, factor, size, last = Ray(before, after), 0.0, length, np.zeros(3 * len(x))
    for _ in range(target.steps):
        task = Task(model, form, held(balance.at.x, chosen))
        arrived, reached, size = _divided(task, balance, ray, factor, (size, length), last)
        last = (arrived.at.x - balance.at.x).reshape(-1)
        balance, factor = arrived, reached
        demand = ray.demand(factor)
        steps.append(made(task, balance, demand, (0, factor), "arc-length"))
        demands.append(demand)
        if listener is not None:
            listener(steps[-1])
        if abs(factor) > farthest:
            break
        rate = float(np.clip(np.sqrt(EASY / balance.iterations), *RATES))
        size = min(length, size * rate)
    return Run(model, chosen, tuple(steps), tuple(demands))


@dataclass(frozen=True, slots=True)
class Ray:
    """Demands along a line: factor 0 is ``before``, 1 is ``after``."""

    before: Demand
    after: Demand

    def demand(self, factor: float) -> Demand:
        """The demand of a factor."""
        return self.before.toward(self.after, factor)

    def pull(self, task: Task, at: State) -> Array:
        """(3n,) how the forces out of balance fall as the factor grows, N."""
        turned = energy.moment_slope(task.model, at, self.after.rest - self.before.rest)
        return np.asarray((self.after.loads - self.before.loads + turned).reshape(-1))

    def moved(self, task: Task) -> Array:
        """(3n,) how the supports move as the factor grows, mm."""
        return np.where(task.grip.fixed, self.after.places - self.before.places, 0.0)


def _divided(
    task: Task,
    balance: Balance,
    ray: Ray,
    factor: float,
    sizes: tuple[float, float],
    last: Array,
) -> tuple[Balance, float, float]:
    """The next equilibrium, its factor, and the length that led to it: ``sizes`` are the length
    to begin with and the one asked for.

    Raises:
        ConvergenceError: even a length of SHORTEST leads nowhere.
    """
    size, length = sizes
    while size >= SHORTEST * length:
        found = _next(task, balance.at, ray, factor, size, last)
        if found is not None:
            return *found, size
        size /= 2
    raise failure(_lost(task, balance, ray.demand(factor)), (0, factor))


def _next(
    task: Task, start: State, ray: Ray, factor: float, size: float, last: Array
) -> tuple[Balance, float] | None:
    """The next equilibrium and its factor; None if it is not found from this step."""
    model, at = task.model, start
    demand = ray.demand(factor)
    foretold = Forces(at.stress, energy.moments(model, at, demand.rest))
    tangent = np.zeros(0)
    for count in range(CORRECTIONS + 1):
        matrix = energy.hessian(model, task.form, at, foretold)
        moved = ray.moved(task)
        push = np.stack([-unbalanced(task, at, demand), ray.pull(task, at) - matrix @ moved], 1)
        push[task.grip.still] = 0.0
        try:
            solve, negative = factorised(task, matrix, 0.0)
        except RuntimeError:
            return None
        back, along = solve(push).T
        along = along + moved
        if count == 0:
            reach = float(np.linalg.norm(along)) / np.sqrt(len(at.x))
            sense = float(np.sign(along @ last)) or 1.0
            gain, tangent = sense * size / reach, along / reach
        else:
            gain = -float(tangent @ back) / float(tangent @ along)
        step = ((back if count else 0.0) + gain * along).reshape(-1, 3)
        if not np.all(np.isfinite(step)) or np.max(np.abs(step)) > model.size:
            return None
        factor += gain
        demand = ray.demand(factor)
        foretold = energy.ahead(model, at, demand.rest, step)
        at = energy.state(model, at.x + step, at.angles)
        measure = measured(task, at, demand)
        if count and measure[0] <= measure[2]:
            return Balance(at, foretold, *measure, count, negative), factor
    return None


def _lost(task: Task, balance: Balance, demand: Demand) -> Balance:
    """The last balance, told as a failure: what a further step of any length left."""
    _, scale, limit = measured(task, balance.at, demand)
    return Balance(balance.at, balance.foretold, np.inf, scale, limit, CORRECTIONS, -1)
