"""From flat to folded and loaded, in steps: each an equilibrium, or an error that says where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from devcad.errors import CheckFailed, JobError
from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.energy import Forces
from devcad.simulate.freedoms import Supports, held, laid_on, require_balance
from devcad.simulate.model import Model
from devcad.simulate.newton import Balance, Demand, Task, newton, unbalanced
from devcad.simulate.relaxation import branched, relaxed

__all__ = ["ConvergenceError", "Run", "Stage", "Step", "Supports", "fold"]

HALVINGS = 5  # a step is divided into at most 2^5 before the sheet is let go
UNSTABLE_HALVINGS = 2  # ... and into 2^2 where what is found is not stable: a bifurcation


@dataclass(eq=False)
class ConvergenceError(CheckFailed):
    """No equilibrium was found: ``value`` is the residual, ``limit`` its limit, N."""

    check: str = "equilibrium"


@dataclass(frozen=True, slots=True)
class Stage:
    """Where the next ``steps`` lead: rest angles (h,), loads (n, 3) N and displacements (s,) mm of
    the supports at the end, linear from what was before; None keeps it."""

    steps: int
    rest: Array | None = None
    loads: Array | None = None
    displacements: Array | None = None


@dataclass(frozen=True, slots=True)
class Step:
    """An equilibrium.

    ``fraction`` of stage number ``stage``, 0..1; of a traced path the factor of its target.
    ``positions`` (n, 3) mm; ``energies`` N mm by kind; ``residual`` the largest nodal force out of
    balance, N, ``scale`` the largest force of one bar, hinge or load; ``reactions`` (n, 3) N, what
    the supports exert; ``angles`` (h,) radians; ``strain`` the largest |Green strain| of a bar;
    ``method`` newton, relaxation or arc-length: after relaxation the sheet may have snapped.
    """

    stage: int
    fraction: float
    positions: Array
    energies: dict[str, float]
    residual: float
    scale: float
    iterations: int
    reactions: Array
    angles: Array
    strain: float
    method: str
    stable: bool


@dataclass(frozen=True, slots=True)
class Run:
    """The steps of a simulation, the first the start, and what was asked for at each."""

    model: Model
    supports: Supports
    steps: tuple[Step, ...]
    demands: tuple[Demand, ...] = field(repr=False)


def fold(
    model: Model,
    stages: tuple[Stage, ...],
    *,
    supports: Supports | None = None,
    start: Array | None = None,
    rest: Array | None = None,
    listener: Callable[[Step], None] | None = None,
) -> Run:
    """The sheet led through ``stages``, every step a stable equilibrium.

    A free sheet keeps its place by least squares from step to step. Where Newton's method does
    not arrive, or arrives at a state that is not stable, the step is halved, and at last the
    sheet is let go to sink to the next stable state (``relaxation``), as a real one snaps.
    Sheets may pass through themselves: there is no contact.

    Args:
        start: (n, 3) the first shape, by default flat at z = 0; it is brought to equilibrium.
        rest: (h,) its rest angles, by default 0.
        listener: told of every step.
    Raises:
        ConvergenceError: no equilibrium, with the stage, step, residual and limit.
        JobError: loads that the supports do not balance, arrays of wrong lengths.
    """
    chosen = supports if supports is not None else Supports.none()
    form = energy.pattern(model)
    x = model.start if start is None else padded(model, start)
    balance, demand = None, first(model, x, rest)
    steps, demands = [], []
    for number, fraction, wanted in _wanted(model, stages, chosen, demand):
        grip = held(x if balance is None else balance.at.x, chosen)
        require_balance(grip, wanted.loads)
        task = Task(model, form, grip)
        if balance is None:
            balance, method = begun(task, x, demand)
        else:
            balance, method = _led(task, balance, demand, wanted, (number, fraction))
            demand = wanted
        balance = _replaced(task, balance, demand, x)
        x = balance.at.x
        steps.append(made(task, balance, demand, (number, fraction), method))
        demands.append(demand)
        if listener is not None:
            listener(steps[-1])
    return Run(model, chosen, tuple(steps), tuple(demands))


def made(
    task: Task, balance: Balance, demand: Demand, when: tuple[int, float], method: str
) -> Step:
    """The step of a balance that was reached."""
    at = balance.at
    force = unbalanced(task, at, demand)
    force[~task.grip.fixed] = 0.0
    return Step(
        stage=when[0],
        fraction=when[1],
        positions=at.x,
        energies=energy.energies(task.model, at, demand.rest),
        residual=balance.residual,
        scale=balance.scale,
        iterations=balance.iterations,
        reactions=force.reshape(-1, 3),
        angles=at.angles,
        strain=float(np.max(np.abs(at.strains))),
        method=method,
        stable=balance.negative == 0,
    )


def first(model: Model, x: Array, rest: Array | None) -> Demand:
    """What is asked for at the start: no loads, supports where they are."""
    asked = np.zeros(len(model.hinges)) if rest is None else _of_hinges(model, rest)
    return Demand(asked, np.zeros_like(x), x.reshape(-1).copy())


def padded(model: Model, values: Array) -> Array:
    """(n, 3) values of all nodes from those of the sheet's: centres of crossed panels lie in the
    middle of their corners, and loads are not put on them.

    Raises:
        JobError: neither as many rows as the sheet has nodes nor as the model has.
    """
    given = np.asarray(values, dtype=float)
    if given.shape == (len(model.flat), 3):
        return given
    if given.shape != (len(model.sheet.flat), 3):
        raise JobError(
            f"values of nodes have shape {given.shape}, must be ({len(model.sheet.flat)}, 3)"
        )
    return np.concatenate([given, given[model.sheet.quads].mean(axis=1)])


def loaded(model: Model, loads: Array) -> Array:
    """(n, 3) loads of all nodes, N: none on the centres of crossed panels."""
    full = padded(model, loads).copy()
    if len(loads) < len(full):
        full[len(loads) :] = 0.0
    return full


def begun(task: Task, x: Array, demand: Demand) -> tuple[Balance, str]:
    """The equilibrium at the start.

    Raises:
        ConvergenceError: there is none near.
    """
    at = energy.state(task.model, x, np.zeros(len(task.model.hinges)))
    foretold = Forces(at.stress, energy.moments(task.model, at, demand.rest))
    balance = newton(task, at, foretold, demand)
    if balance.reached and balance.negative == 0:
        return balance, "newton"
    search, at = (branched, balance.at) if balance.reached else (relaxed, at)
    balance = search(task, at, demand)
    if not balance.reached:
        raise failure(balance, (0, 0.0))
    return balance, "relaxation"


def failure(balance: Balance, when: tuple[int, float]) -> ConvergenceError:
    """The error of a step that found no equilibrium."""
    return ConvergenceError(
        f"no equilibrium at fraction {when[1]:.4g} of stage {when[0] + 1}: after"
        f" {balance.iterations} iterations forces of {balance.residual:.3g} N are out of balance,"
        f" limit {balance.limit:.3g} N",
        value=balance.residual,
        limit=balance.limit,
        remedy="more steps, smaller loads or fold angles, more supports, or finer cells",
    )


def _led(
    task: Task, balance: Balance, before: Demand, wanted: Demand, when: tuple[int, float]
) -> tuple[Balance, str]:
    """From one demand's equilibrium to the next one's, divided as far as is needed."""
    done, size, method, spent = 0.0, 1.0, "newton", 0
    while done < 1:
        share = min(1.0, done + size)
        asked = before.toward(wanted, share)
        tried = newton(task, balance.at, balance.foretold, asked)
        spent += tried.iterations
        if not (tried.reached and tried.negative == 0):
            unstable = tried.reached and tried.negative > 0
            if size > (2.0**-UNSTABLE_HALVINGS if unstable else 2.0**-HALVINGS):
                size /= 2
                continue
            search, begin = (branched, tried.at) if unstable else (relaxed, balance.at)
            tried, method = search(task, begin, asked), "relaxation"
            spent += tried.iterations
            if not tried.reached:
                raise failure(tried, when)
        balance, done, size = tried, share, 2 * size
    return replace(balance, iterations=spent), method


def _wanted(
    model: Model, stages: tuple[Stage, ...], supports: Supports, begin: Demand
) -> Iterator[tuple[int, float, Demand]]:
    """Every step's stage, fraction and demand, the start first."""
    yield 0, 0.0, begin
    moved, demand = np.zeros(len(supports.nodes)), begin
    for number, stage in enumerate(stages):
        if stage.steps < 1:
            raise JobError(f"a stage has {stage.steps} steps, must be at least 1", limit=1)
        given = supports.displacements if number == 0 else moved
        moved = given if stage.displacements is None else stage.displacements
        last = demanded(model, stage, supports, demand, begin.places, moved)
        for k in range(1, stage.steps + 1):
            yield number, k / stage.steps, demand.toward(last, k / stage.steps)
        demand = last


def demanded(
    model: Model, stage: Stage, supports: Supports, before: Demand, home: Array, moved: Array
) -> Demand:
    """What a stage leads to: supports ``moved`` (s,) mm from ``home`` (3n,), and what the stage
    says nothing of as it was before."""
    if np.shape(moved) != (len(supports.nodes),):
        raise JobError(
            f"displacements have shape {np.shape(moved)}, must be ({len(supports.nodes)},)",
            remedy="one for each row of the supports",
        )
    places = home.copy()
    places[supports.freedoms] += moved
    return Demand(
        before.rest if stage.rest is None else _of_hinges(model, stage.rest),
        before.loads if stage.loads is None else loaded(model, stage.loads),
        places,
    )


def _of_hinges(model: Model, rest: Array) -> Array:
    """Rest angles, one for each hinge."""
    if np.shape(rest) != (len(model.hinges),):
        raise JobError(
            f"rest angles have shape {np.shape(rest)}, must be ({len(model.hinges)},)",
            remedy="Model.rest makes them from the creases' fold angles",
        )
    return np.asarray(rest, dtype=float)


def _replaced(task: Task, balance: Balance, demand: Demand, before: Array) -> Balance:
    """A free sheet without loads, moved rigidly onto where it was."""
    if np.any(task.grip.fixed) or np.any(demand.loads):
        return balance
    x = laid_on(balance.at.x, before)
    return replace(balance, at=energy.state(task.model, x, balance.at.angles))
