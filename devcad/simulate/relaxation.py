"""The stable equilibrium downhill: what is done where Newton's method does not arrive.

Implicit dynamic relaxation of an overdamped sheet: springs of stiffness s hold every node where it
is, the sheet finds its balance with them by Newton's method, and there they take hold anew. Each
is a step of backward Euler, of length 1 / s, down the energy: unconditionally stable, so that
stiff bars cost no small steps as they do in explicit relaxation, and nearly inextensible sheets go
far along their curved valleys. s falls as long as balances are found. This passes snaps: what it
finds is the next stable state downhill, not the path there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.energy import Forces, State
from devcad.simulate.newton import Balance, Demand, Task, factorised, measured, newton

STEPS = 300  # balances with springs
POLISH = 15  # Newton steps of one balance
FIRST, LEAST = 1e-3, 1e-12  # of the mean stiffness: the first springs and the softest
SEED = 1e-4
"""Of the sheet's size: how far a state that is not stable is pushed down its steepest fall. Its
energy there is a maximum: any push will do that rounding cannot undo."""
PUSHES = (0.01, 0.05, 0.2)  # of the sheet's size: buckles of steps that are not tiny
ITERATED = 30  # inverse iterations: a direction downhill is wanted, not digits of it
GROW, SHRINK = 6.0, 0.2
ACCEPTED = 1e-12  # relative rise of the energy that is rounding


def potential(task: Task, at: State, demand: Demand) -> float:
    """Energy less the work of the loads, N mm."""
    stored = sum(energy.energies(task.model, at, demand.rest).values())
    return stored - float(np.sum(demand.loads * at.x))


def relaxed(task: Task, start: State, demand: Demand) -> Balance:
    """The stable equilibrium that the sheet sinks to from ``start``, supports at their places.

    Returns:
        a Balance, not ``reached`` if STEPS did not suffice.
    """
    at = _placed(task, start, demand)
    level, true = potential(task, at, demand), _true(task, at, demand)
    matrix = energy.hessian(task.model, task.form, at, true)
    mean = float(np.mean(np.abs(matrix.data[task.form.diagonal])))
    drag, spent = FIRST * mean, 0
    for _ in range(STEPS):
        held = newton(task, at, true, demand, iterations=POLISH, drag=drag, downhill=True)
        spent += held.iterations
        height = potential(task, held.at, demand)
        if not (held.reached and held.negative == 0 and height <= _above(level)):
            drag *= GROW
            continue
        at, level, drag = held.at, height, max(drag * SHRINK, LEAST * mean)
        free = newton(task, at, held.foretold, demand, iterations=POLISH, downhill=True)
        spent += free.iterations
        if (
            free.reached
            and free.negative == 0
            and potential(task, free.at, demand) <= _above(level)
        ):
            return replace(free, iterations=spent)
        residual, _, limit = measured(task, at, demand)
        if residual <= limit and free.negative > 0:
            at = pushed(task, at, demand)
            level, drag = potential(task, at, demand), FIRST * mean
        true = _true(task, at, demand)
    return Balance(at, true, *measured(task, at, demand), spent, -1)


def _above(level: float) -> float:
    """What rounding may add to an energy."""
    return level + ACCEPTED * abs(level)


def pushed(task: Task, at: State, demand: Demand, far: float = SEED) -> State:
    """The state, moved by ``far`` (of the sheet's size) to where its energy falls most steeply.

    The sense is chosen so that the largest out-of-plane motion, or else the largest motion, is
    positive: the same sheet always buckles to the same side.
    """
    shape = falling(task, at, demand)
    main = shape[:, 2] if np.max(np.abs(shape[:, 2])) > 1e-3 * np.max(np.abs(shape)) else shape
    main = main.reshape(-1)
    sense = float(np.sign(main[int(np.argmax(np.abs(main)))])) or 1.0
    step = sense * far * task.model.size * shape / float(np.max(np.abs(shape)))
    return energy.state(task.model, at.x + step, at.angles)


def branched(task: Task, at: State, demand: Demand) -> Balance:
    """The stable equilibrium beside one that is not: Newton's method from where pushes of growing
    size lead, then relaxation.

    Returns:
        a Balance, not ``reached`` if relaxation did not arrive.
    """
    top, spent = potential(task, at, demand), 0
    for far in PUSHES:
        begin = pushed(task, at, demand, far)
        found = newton(task, begin, _true(task, begin, demand), demand)
        spent += found.iterations
        same = float(np.sum((found.at.x - at.x) * (begin.x - at.x))) > 0
        stable = found.reached and found.negative == 0
        if stable and same and potential(task, found.at, demand) < top:
            return replace(found, iterations=spent)
    found = relaxed(task, pushed(task, at, demand), demand)
    return replace(found, iterations=spent + found.iterations)


def falling(task: Task, at: State, demand: Demand) -> Array:
    """(n, 3) the eigenvector of the lowest eigenvalue, by inverse iteration from below it."""
    matrix = energy.hessian(task.model, task.form, at, _true(task, at, demand))
    shift = 1e-9 * float(np.mean(np.abs(matrix.data[task.form.diagonal])))
    while True:
        solve, negative = factorised(task, matrix, shift)
        if negative == 0:
            break
        shift *= GROW
    shape = np.cos(1.0 + np.arange(3 * len(at.x)))  # no symmetry that a mode could have
    shape[task.grip.still] = 0.0
    for _ in range(ITERATED):
        shape = solve(shape)
        shape /= np.linalg.norm(shape)
    return np.asarray(shape.reshape(-1, 3))


def _placed(task: Task, start: State, demand: Demand) -> State:
    """The state with its supported components where they are asked to be."""
    x = start.x.reshape(-1).copy()
    x[task.grip.fixed] = demand.places[task.grip.fixed]
    return energy.state(task.model, x.reshape(-1, 3), start.angles)


def _true(task: Task, at: State, demand: Demand) -> Forces:
    """The stresses and moments of the state itself."""
    return Forces(at.stress, energy.moments(task.model, at, demand.rest))
