"""How stiff a folded sheet is, and in what shapes it gives way first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.errors import JobError
from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.bars import areas
from devcad.simulate.energy import Forces, Matrix
from devcad.simulate.freedoms import Supports, held, require_balance
from devcad.simulate.model import Model
from devcad.simulate.newton import Task, factorised
from devcad.simulate.path import loaded
from devcad.simulate.topology import crossed, divided

TONNES_PER_MM3 = 1e-12  # of 1 kg/m^3: with N and mm the unit of mass is the tonne
DENSE = 300  # coordinates up to which all eigenvalues are found at once
LOWER = 8.0
BELOW = 1e-6  # of the mean stiffness: how far below zero the search begins, at least


@dataclass(frozen=True, slots=True)
class Modes:
    """``values`` (k,) rising, N/mm where masses are 1 and (rad/s)^2 where they are tonnes;
    ``shapes`` (k, n, 3), x^T M x = 1. A negative value is a direction in which the energy falls."""

    values: Array
    shapes: Array

    @property
    def frequencies(self) -> Array:
        """(k,) Hz, of modes with masses in tonnes; negative where the sheet is not stable."""
        return np.asarray(np.sign(self.values) * np.sqrt(np.abs(self.values)) / (2 * np.pi))


def tangent(model: Model, positions: Array, rest: Array) -> Matrix:
    """Sparse (3n, 3n) second derivatives of the energy, N/mm: the tangent stiffness."""
    at = energy.state(model, positions, np.zeros(len(model.hinges)))
    forces = Forces(at.stress, energy.moments(model, at, rest))
    return energy.hessian(model, energy.pattern(model), at, forces)


def node_masses(model: Model, density: float) -> Array:
    """(n,) tonnes: a third of every triangle's mass on each of its corners.

    Args:
        density: kg/m^3.
    """
    faces = (
        crossed(model.sheet) if len(model.flat) > len(model.sheet.flat) else divided(model.sheet)
    )
    share = areas(faces.flat, faces.triangles) * model.material.thickness / 3
    mass = np.bincount(faces.triangles.reshape(-1), np.repeat(share, 3), minlength=len(model.flat))
    return np.asarray(mass * density * TONNES_PER_MM3)


def modes(
    model: Model,
    positions: Array,
    rest: Array,
    *,
    count: int,
    supports: Supports | None = None,
    masses: Array | None = None,
) -> Modes:
    """The lowest eigenvalues and shapes of K x = value M x at an equilibrium, rigid motions left
    out.

    The stiffness is searched by inverse iteration; a free sheet's shapes have no resultant and no
    moment (they are orthogonal, in M, to its rigid motions).

    Args:
        masses: (n,) of the nodes, tonnes; None for 1 each, the eigenvalues of the stiffness.
    Raises:
        JobError: more modes asked for than there are.
    """
    chosen = supports if supports is not None else Supports.none()
    grip = held(positions, chosen)
    weight = np.repeat(np.ones(len(positions)) if masses is None else masses, 3)
    free = np.flatnonzero(~grip.fixed)
    rigid = grip.rigid.shape[1]
    if not 1 <= count <= len(free) - rigid:
        raise JobError(
            f"{count} modes are asked for, the sheet has {len(free) - rigid}",
            value=count,
            limit=len(free) - rigid,
        )
    matrix = tangent(model, positions, rest)[free][:, free]
    root = np.sqrt(weight[free])
    values, vectors = _lowest(matrix, root, grip.rigid[free], count)
    shapes = np.zeros((count, 3 * len(positions)))
    shapes[:, free] = (vectors / root[:, None]).T
    return Modes(values, shapes.reshape(count, -1, 3))


def stiffness(
    model: Model,
    positions: Array,
    rest: Array,
    loads: Array,
    *,
    supports: Supports | None = None,
) -> float:
    """N/mm: the load F over the way of its points along it, F^2 / (P.u) with K u = P.

    F is the size of the loads' resultant, or half the sum of their sizes if that is more: of a
    pair that pulls a sheet apart, one of the two, and the way is how far it grows.

    Raises:
        JobError: no loads, or loads that the supports do not balance.
    """
    pull = loaded(model, loads)
    grip = held(positions, supports if supports is not None else Supports.none())
    require_balance(grip, pull)
    if not np.any(pull):
        raise JobError("the stiffness against no load has no meaning", remedy="give loads")
    form = energy.pattern(model)
    at = energy.state(model, positions, np.zeros(len(model.hinges)))
    forces = Forces(at.stress, energy.moments(model, at, rest))
    solve, _ = factorised(Task(model, form, grip), energy.hessian(model, form, at, forces), 0.0)
    push = pull.reshape(-1).copy()
    push[grip.still] = 0.0
    move = solve(push)
    size = max(
        float(np.linalg.norm(pull.sum(axis=0))), float(np.linalg.norm(pull, axis=1).sum()) / 2
    )
    return size**2 / float(push @ move)


def _lowest(matrix: Matrix, root: Array, rigid: Array, count: int) -> tuple[Array, Array]:
    """Lowest eigenpairs of R^-1 K R^-1 in the complement of the rigid motions R ``rigid``."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    scaled = (diags_array(1 / root) @ matrix @ diags_array(1 / root)).tocsc()
    basis = np.linalg.qr(root[:, None] * rigid)[0]
    stiff = float(np.mean(np.abs(scaled.diagonal())))

    def cleared(vector: Array) -> Array:
        return np.asarray(vector - basis @ (basis.T @ vector))

    if len(root) <= DENSE:
        dense = scaled.toarray() + 1e3 * len(root) * stiff * (basis @ basis.T)
        values, vectors = np.linalg.eigh(dense)
        return values[:count], vectors[:, :count]
    shift = -BELOW * stiff
    while True:
        factors = splu(
            (scaled - shift * diags_array(np.ones(len(root)))).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        if np.all(factors.U.diagonal() > 0):  # no eigenvalue lies below the shift (Sylvester)
            break
        shift *= LOWER
    inverse = LinearOperator(
        scaled.shape, matvec=lambda v: cleared(factors.solve(cleared(np.ravel(v)))), dtype=float
    )
    values, vectors = eigsh(
        inverse, k=count, which="LA", v0=cleared(np.cos(1.0 + np.arange(len(root))))
    )
    order = np.argsort(-values)
    return 1 / values[order] + shift, vectors[:, order]
