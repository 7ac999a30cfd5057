"""The energy of bars and hinges, its gradient and its second derivatives, all vectorised.

U = sum of e C e / 2 over the Green strains e = (l^2 / L^2 - 1) / 2 of bars, and of
K (theta - theta0)^2 / 2 over hinges. The hull code of Woodruff and Filipov's group has Ogden's
hyperelastic bars and a penalty that keeps hinges from passing half a turn; here bars are linear
in the Green strain, and contact is not modelled.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices
from devcad.simulate.hinges import angles, gradients, hessians, unwound
from devcad.simulate.model import KINDS, Model

Matrix = Any  # scipy.sparse.csc_matrix: scipy is imported where it is used
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True)
class State:
    """What the positions x (n, 3) are to bars and hinges.

    ``across`` (b, 3) the bars' vectors over their squared lengths, 1/mm; ``strains`` (b,) Green;
    ``stress`` (b,) dU/de, N mm; ``angles`` (h,), ``slopes`` (h, 4, 3) their gradients.
    """

    x: Array
    across: Array
    strains: Array
    stress: Array
    angles: Array
    slopes: Array


@dataclass(frozen=True, slots=True)
class Forces:
    """What multiplies the second derivatives: ``stress`` (b,) of bars, ``moments`` (h,), N mm."""

    stress: Array
    moments: Array


@dataclass(frozen=True, slots=True)
class Pattern:
    """Where the entries of the sparse Hessian go: ``slot`` (entries,) into the data of a matrix
    in compressed columns with ``indices`` and ``indptr``; ``diagonal`` (3n,) the slots of the
    diagonal, ``column`` (nnz,) the column of each slot."""

    slot: Indices
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    diagonal: Indices
    column: Indices


def pattern(model: Model) -> Pattern:
    """The sparsity of a model's Hessian: once a model."""
    size = 3 * len(model.flat)
    blocks = (_freedoms(nodes) for nodes in (model.bars, _corners(model), model.hinges))
    keys = [(block[:, None, :] * size + block[:, :, None]).reshape(-1) for block in blocks]
    every = np.concatenate([*keys, np.arange(size) * (size + 1)])
    unique, slot = np.unique(every, return_inverse=True)
    column, row = np.divmod(unique, size)
    indptr = np.searchsorted(column, np.arange(size + 1)).astype(np.int32)
    return Pattern(
        slot=slot[: len(every) - size],
        indices=row.astype(np.int32),
        indptr=indptr,
        diagonal=slot[len(every) - size :],
        column=column,
    )


def state(model: Model, x: Array, near: Array) -> State:
    """Strains, angles and their derivatives; angles next to ``near`` (h,), whole turns apart."""
    edge = x[model.bars[:, 1]] - x[model.bars[:, 0]]
    squared = model.length**2
    strains = 0.5 * (np.einsum("bi,bi->b", edge, edge) / squared - 1)
    return State(
        x=x,
        across=edge / squared[:, None],
        strains=strains,
        stress=stressed(model, strains),
        angles=unwound(angles(x, model.hinges), near),
        slopes=gradients(x, model.hinges),
    )


def stressed(model: Model, strains: Array) -> Array:
    """(b,) dU/de of the bars, N mm."""
    stress = model.own * strains
    if len(model.members):
        part = np.einsum("mij,mj->mi", model.forms, strains[model.members])
        stress = stress + np.bincount(
            model.members.reshape(-1), part.reshape(-1), minlength=len(strains)
        )
    return np.asarray(stress)


def moments(model: Model, at: State, rest: Array) -> Array:
    """(h,) K (theta - theta0), N mm."""
    return np.asarray(model.stiffness * (at.angles - rest))


def energies(model: Model, at: State, rest: Array) -> dict[str, float]:
    """N mm by kind: stretch, fold, ruling, diagonal."""
    hinge = 0.5 * model.stiffness * (at.angles - rest) ** 2
    by_kind = {name: float(hinge[model.kinds == number].sum()) for number, name in enumerate(KINDS)}
    return {"stretch": 0.5 * float(at.strains @ at.stress), **by_kind}


def gradient(model: Model, at: State, rest: Array) -> Array:
    """(n, 3) dU/dx, N."""
    pull = at.stress[:, None] * at.across
    turn = moments(model, at, rest)[:, None, None] * at.slopes
    return _summed(
        len(at.x),
        np.concatenate([model.bars.T.reshape(-1), model.hinges.reshape(-1)]),
        np.concatenate([-pull, pull, turn.reshape(-1, 3)]),
    )


def moment_slope(model: Model, at: State, turned: Array) -> Array:
    """(n, 3) the forces by which hinges answer to rest angles that grow by ``turned``, N."""
    turn = (model.stiffness * turned)[:, None, None] * at.slopes
    return _summed(len(at.x), model.hinges.reshape(-1), turn.reshape(-1, 3))


def hessian(model: Model, form: Pattern, at: State, forces: Forces) -> Matrix:
    """Sparse (3n, 3n) d2U/dx2 in N/mm, exact when ``forces`` are those of the state."""
    from scipy.sparse import csc_matrix

    size = 3 * len(at.x)
    entries = [_bar_blocks(model, at, forces.stress).reshape(-1)]
    if len(model.members):
        entries.append(_triangle_blocks(model, at).reshape(-1))
    if len(model.hinges):
        entries.append(_hinge_blocks(model, at, forces.moments).reshape(-1))
    data = np.bincount(form.slot, np.concatenate(entries), minlength=len(form.indices))
    return csc_matrix((data, form.indices, form.indptr), shape=(size, size))


def ahead(model: Model, at: State, rest: Array, step: Array) -> Forces:
    """Stresses and moments that the tangent foretells for a ``step`` (n, 3).

    Newton's method with them in place of the true ones converges as fast near the solution and
    from much further away (mixed integration points: Magisano, Leonetti, Garcea, 2017), because a
    turning step's false strains do not stiffen the next one.
    """
    bars, rows = model.bars, model.hinges
    strains = at.strains + np.einsum("bi,bi->b", at.across, step[bars[:, 1]] - step[bars[:, 0]])
    turn = np.einsum("hki,hki->h", at.slopes, step[rows])
    return Forces(stressed(model, strains), np.asarray(model.stiffness * (at.angles + turn - rest)))


def rounding(model: Model, at: State) -> float:
    """N: the nodal force that rounding alone leaves in the largest term."""
    stiff = model.own.copy()
    if len(model.members):
        own = model.forms[:, range(3), range(3)].reshape(-1)
        stiff = stiff + np.bincount(model.members.reshape(-1), own, minlength=len(stiff))
    reach = float(np.max(np.abs(at.x))) if len(at.x) else 0.0
    bars = float(np.max(stiff / model.length**2)) * reach
    slope = np.abs(at.slopes).max(axis=(1, 2), initial=0.0)
    hinges = float(np.max(model.stiffness * slope * (1 + slope * reach), initial=0.0))
    return EPS * (bars + hinges)


def largest(model: Model, at: State, rest: Array) -> float:
    """N: the largest force that one bar or one hinge exerts on a node."""
    pull = np.abs(at.stress)[:, None] * np.abs(at.across)
    turn = np.abs(moments(model, at, rest)) * np.abs(at.slopes).max(axis=(1, 2), initial=0.0)
    return float(max(np.max(pull, initial=0.0), np.max(turn, initial=0.0)))


def _corners(model: Model) -> Indices:
    """(m, 3) corners of coupled triangles: where their sides begin in order 0-1, 1-2, 2-0."""
    side = model.bars[model.members]  # (m, 3, 2)
    after = np.roll(side, -1, axis=1)
    shared = np.any(side[:, :, :1] == after, axis=2)  # the first end is also on the next side
    following = np.where(shared, side[:, :, 0], side[:, :, 1])
    return np.asarray(np.roll(following, 1, axis=1))


def _freedoms(nodes: Indices) -> Indices:
    """(m, 3k) numbers of the coordinates of (m, k) nodes."""
    return np.asarray(
        (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1])
    )


def _summed(count: int, nodes: Indices, values: Array) -> Array:
    """(count, 3) sums of (m, 3) values by node."""
    return np.stack(
        [np.bincount(nodes, values[:, axis], minlength=count) for axis in range(3)], axis=1
    )


def _bar_blocks(model: Model, at: State, stress: Array) -> Array:
    """(b, 6, 6): stress times the strain's second derivative, and the bar's own stiffness."""
    block = np.einsum("b,bi,bj->bij", model.own, at.across, at.across)
    block[:, range(3), range(3)] += (stress / model.length**2)[:, None]
    row = np.concatenate([block, -block], axis=2)
    return np.concatenate([row, -row], axis=1)


def _triangle_blocks(model: Model, at: State) -> Array:
    """(m, 9, 9): B^T C B of coupled triangles, corners in the order of ``_corners``."""
    corners = _corners(model)
    side = model.bars[model.members]
    sign = np.where(side[:, :, 0] == corners, 1.0, -1.0)
    across = at.across[model.members] * sign[:, :, None]  # (m, 3, 3) from corner k to k + 1
    slope = np.zeros((len(corners), 3, 3, 3))
    slope[:, range(3), range(3)] = -across
    slope[:, range(3), [1, 2, 0]] = across
    rows = slope.reshape(-1, 3, 9)
    return np.asarray(np.swapaxes(rows, 1, 2) @ (model.forms @ rows))


def _hinge_blocks(model: Model, at: State, moment: Array) -> Array:
    """(h, 12, 12): K grad grad^T + moment times the angle's second derivative."""
    slope = at.slopes.reshape(-1, 12)
    curved = hessians(at.x, model.hinges).reshape(-1, 12, 12)
    curved *= moment[:, None, None]
    curved += (model.stiffness[:, None] * slope)[:, :, None] * slope[:, None, :]
    return curved
