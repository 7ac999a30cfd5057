"""A sheet that folds and is loaded: from its net to states in equilibrium, step by step.

First the creases fold, without supports; then the folded sheet is laid onto the built part, held
where the job says, and loaded. A panel without curved creases is formed already: its rulings keep
the angles that it was rolled or bent to, and only loads move it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from devcad.errors import CheckFailed, GeometryError, JobError
from devcad.geometry.taylor import Array
from devcad.simulate.held import Held, forces, held, node_areas, spread
from devcad.simulate.net import Net
from devcad.simulate.outcome import KINDS, Loaded, Outcome, State
from devcad.simulate.settings import Simulation

if TYPE_CHECKING:
    from devcad.simulate.clamps import Grip
    from devcad.simulate.model import Material, Model
    from devcad.simulate.modes import Modes
    from devcad.simulate.path import Run, Step

TURNED = 3.0
"""Radians: no ruling of a net turns by more, but the edge of a triangle that lies upside down."""

Shapes = Callable[[float], Array]
"""The exact shape (n, 3) of a net's nodes when a share from 0 to 1 of the fold is done."""
Listener = Callable[[str], None]
"""Told what was reached."""

KG_PER_M3 = 1e6
"""Of 1 g/mm3."""


def simulate(
    net: Net,
    how: Simulation,
    material: Material,
    *,
    formed: bool,
    density: float | None = None,
    shapes: Shapes | None = None,
    listener: Listener = lambda _: None,
) -> Outcome:
    """Fold and load a sheet; every state is in equilibrium.

    Args:
        formed: whether the built shape is free of stress; else the flat sheet is, and its creases
            drive it.
        density: in g/mm3, for the sheet's weight and for frequencies; None if it is not known.
        shapes: the exact shapes between flat and built, where there are any.
    Raises:
        CheckFailed: no equilibrium is found at a step. GeometryError: supports or loads that do
        not meet the sheet, cells that have no model.
    """
    from devcad.simulate.clamps import gripped
    from devcad.simulate.freedoms import Supports
    from devcad.simulate.hinges import angles
    from devcad.simulate.model import Sheet, build

    fixed = held(net, how.supports)
    masses = None if density is None else density * material.thickness * node_areas(net)
    applied = forces(net, how, masses)
    try:
        model = build(
            Sheet(net.flat, net.quads, net.triangles, net.creases),
            material,
            length_scale=how.length_scale,
            coefficients=how.coefficients,
        )
    except (GeometryError, JobError) as error:
        raise error.at(place="simulate") from None
    built = angles(_whole(model, net.built), model.hinges)
    _refuse_turned(model, built)
    wanted = model.folds(built)
    rest = built if formed else model.rest(wanted)
    states = _folded(net, model, rest, how, formed, shapes, listener)
    supports = Supports(fixed.nodes, fixed.axes, np.zeros(len(fixed.nodes)))
    grip = gripped(model, states[-1].positions, supports, fixed.clamped, how.coefficients)
    rest = grip.rest(rest)
    if how.supports:
        states += _loaded(net, grip, rest, how, applied, states[-1].positions, listener)
    last = states[-1]
    reached = model.folds(angles(_whole(model, last.positions), model.hinges))
    modes = _modes(model, grip, last.positions, rest, how.modes, density)
    reactions, turning = _reactions(last, fixed, len(how.supports))
    return Outcome(
        net=net,
        states=tuple(states),
        reactions=reactions,
        turning=turning,
        applied=applied.sum(axis=0),
        loads=_loads(net, grip, rest, how, fixed, states),
        modes=tuple(modes.values.tolist()) if modes and density is None else (),
        frequencies=tuple(modes.frequencies.tolist()) if modes and density is not None else (),
        mode_shapes=modes.shapes[:, : len(net.flat)] if modes else np.zeros((0, len(net.flat), 3)),
        angles=(wanted, reached),
        moments=_moments(net, model, wanted - reached),
        bars=len(model.bars),
        hinges=len(model.hinges),
    )


def _refuse_turned(model: Model, built: Array) -> None:
    """GeometryError where a triangle of the net is turned over in the built part: where a ruling
    touches a border, chords of the border may leave no room for its thin end."""
    wrong = (np.abs(built) > TURNED) & (model.kinds != 0)
    if wrong.any():
        x, y = model.flat[model.hinges[int(np.argmax(wrong))][:2]].mean(axis=0)
        raise GeometryError(
            f"a ruling touches the border near ({x:.4g}, {y:.4g}) of the pattern: a cell there "
            "turns over, and the sheet cannot be simulated",
            place="simulate.cells",
            value=float(np.degrees(np.abs(built[wrong]).max())),
            limit=float(np.degrees(TURNED)),
            remedy="give other cells, or end the surface before such a tip",
        )


def _folded(
    net: Net,
    model: Model,
    rest: Array,
    how: Simulation,
    formed: bool,
    shapes: Shapes | None,
    listener: Listener,
) -> list[State]:
    """The states from flat to folded, each laid onto its exact shape; or the formed sheet."""
    from devcad.simulate.path import Stage, fold

    count = 0 if formed else how.steps
    exact = [net.built] if formed else _exact(net, count, shapes)
    stages: tuple[Stage, ...] = () if formed else (Stage(count, rest=rest),)
    if shapes is not None and not formed:
        stages = tuple(Stage(1, rest=_rest(model, shape)) for shape in exact[1:])
    run = _found(
        lambda told: fold(
            model, stages, start=exact[0], rest=rest if formed else None, listener=told
        ),
        "fold",
        count,
        listener,
    )
    out = []
    for number, (step, shape) in enumerate(zip(run.steps, exact, strict=True)):
        laid = onto(step.positions[: len(net.flat)], shape)
        state = _state("fold", 1.0 if formed else number / count, step, laid)
        known = shapes is not None or number in (0, count)
        out.append(_measured(state, shape) if known else state)
    return out


def _exact(net: Net, count: int, shapes: Shapes | None) -> list[Array]:
    """The shapes that the steps are laid onto: exact, or between flat and built."""
    shares = [number / count for number in range(1, count)]
    between = [
        (1.0 - share) * net.laid + share * net.built if shapes is None else shapes(share)
        for share in shares
    ]
    return [net.laid, *between, net.built]


def _rest(model: Model, shape: Array) -> Array:
    """The rest angles of a sheet whose creases are folded as those of a shape."""
    from devcad.simulate.hinges import angles

    return model.rest(model.folds(angles(_whole(model, shape), model.hinges)))


def _measured(state: State, shape: Array) -> State:
    """The state with its distances from a shape."""
    away = np.linalg.norm(state.positions - shape, axis=1)
    return replace(state, furthest=float(away.max()), rms=float(np.sqrt((away**2).mean())))


def _loaded(
    net: Net,
    grip: Grip,
    rest: Array,
    how: Simulation,
    applied: Array,
    start: Array,
    listener: Listener,
) -> list[State]:
    """The states while the loads come, the sheet held where it is."""
    if not how.loaded:
        return []
    from devcad.simulate.path import Stage, fold

    run = _found(
        lambda told: fold(
            grip.model,
            (Stage(how.load_steps, loads=grip.spread(applied)),),
            supports=grip.supports,
            start=grip.whole(start),
            rest=rest,
            listener=told,
        ),
        "load",
        how.load_steps,
        listener,
    )
    count = len(net.flat)
    states = []
    for step in run.steps[1:]:
        state = _state("load", step.fraction, step, step.positions[:count])
        reactions, moments = grip.borne(step.positions, step.reactions, count)
        states.append(_measured(replace(state, reactions=reactions, moments=moments), net.built))
    return states


def _found(
    run: Callable[[Callable[[Step], None]], Run],
    phase: Literal["fold", "load"],
    count: int,
    listener: Listener,
) -> Run:
    """What a run of ``count`` steps finds; that it finds no equilibrium is a check that failed."""
    from devcad.simulate.path import ConvergenceError

    done = [0]

    def told(_: Step) -> None:
        listener(f"{phase}, step {done[0]} of {count}")
        done[0] += 1

    try:
        return run(told)
    except ConvergenceError as error:
        key = "steps" if phase == "fold" else "load_steps"
        gentler = "a smaller fold angle" if phase == "fold" else "smaller loads, more supports"
        when = (
            f"step {done[0]} of {count}, while the sheet is {phase}ed" if done[0] else "the start"
        )
        raise CheckFailed(
            f"no equilibrium at {when}: forces of {error.value:.3g} N are out of balance, limit "
            f"{error.limit:.3g} N",
            place="simulate",
            value=error.value,
            limit=error.limit,
            remedy=f"give more {key} or cells, {gentler}",
            check="equilibrium",
        ) from None


def _state(phase: Literal["fold", "load"], share: float, step: Step, points: Array) -> State:
    """A step of the path as a state."""
    return State(
        phase=phase,
        share=share,
        positions=points,
        energies={kind: float(step.energies.get(kind, 0.0)) for kind in KINDS},
        residual=float(step.residual),
        scale=float(step.scale),
        iterations=int(step.iterations),
        method=step.method,
        stable=bool(step.stable),
        strain=float(step.strain),
        reactions=step.reactions[: len(points)],
        moments=np.zeros_like(points),
        furthest=None,
        rms=None,
    )


def onto(points: Array, places: Array) -> Array:
    """The points (n, 3) moved rigidly so that the sum of squared distances from their places is
    least.

    Source: Kabsch, Acta Cryst. A32 (1976) 922.
    """
    middle, there = points.mean(axis=0), places.mean(axis=0)
    u, _, v = np.linalg.svd((points - middle).T @ (places - there))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    return np.asarray((points - middle) @ (u * sign) @ v + there)


def _whole(model: Model, points: Array) -> Array:
    """The places of all nodes of the model: crossed panels have one more each."""
    from devcad.simulate.path import padded

    return padded(model, points)


def _modes(
    model: Model, grip: Grip, points: Array, rest: Array, count: int, density: float | None
) -> Modes | None:
    """The softest deformations of a state, as many as it has; None where none was asked for."""
    from devcad.simulate.freedoms import held
    from devcad.simulate.modes import modes, node_masses

    x = grip.whole(points)
    hold = held(x, grip.supports)
    most = int(np.sum(~hold.fixed)) - hold.rigid.shape[1]
    if min(count, most) < 1:
        return None
    masses = None if density is None else node_masses(model, density * KG_PER_M3)
    if masses is not None:  # the wall's points do not move
        masses = np.concatenate([masses, np.zeros(len(grip.wall))])
    return modes(grip.model, x, rest, count=min(count, most), supports=grip.supports, masses=masses)


def _moments(net: Net, model: Model, left: Array) -> Array:
    """The moments (c,) that creases bear where their angles miss the wanted ones by ``left``."""
    edges = net.flat[net.creases[:, 1]] - net.flat[net.creases[:, 0]]
    springs = model.stiffness[model.creases].sum(axis=1)
    return np.asarray(springs * left / np.linalg.norm(edges, axis=1))


def _reactions(last: State, fixed: Held, count: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The sum of the reactions of each support, (3,) in N, and its moment about the part's origin,
    (3,) in N mm."""
    sums, turning = [], []
    for number in range(count):
        own = np.where(fixed.bearing == number, last.reactions, 0.0)
        mine = (fixed.bearing == number).any(axis=1)
        sums.append(own.sum(axis=0))
        turning.append(np.cross(last.positions, own).sum(axis=0) + last.moments[mine].sum(axis=0))
    return tuple(sums), tuple(turning)


def _loads(
    net: Net, grip: Grip, rest: Array, how: Simulation, fixed: Held, states: list[State]
) -> tuple[Loaded, ...]:
    """What each load does in the end."""
    if not how.loads:
        return ()
    from devcad.simulate.modes import stiffness

    folded = next(state for state in reversed(states) if state.phase == "fold")
    moved = states[-1].positions - folded.positions
    out = []
    for load in how.loads:
        nodes, shares = spread(net, load)
        force = np.array(load.force)
        size = float(np.linalg.norm(force))
        pattern = np.zeros((len(net.flat), 3))
        np.add.at(pattern, nodes, shares[:, None] * force)
        pattern[fixed.nodes, fixed.axes] = 0.0  # what lies on a support is borne at once
        both = [
            stiffness(
                grip.model,
                grip.whole(state.positions),
                rest,
                grip.spread(pattern),
                supports=grip.supports,
            )
            if pattern.any()
            else None
            for state in (folded, states[-1])
        ]
        along = float(shares @ (moved[nodes] @ force)) / size
        out.append(Loaded(load.where.key, size, along, (both[0], both[1])))
    return tuple(out)
