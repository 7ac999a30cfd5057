"""What can move: supports, and the rigid motions that they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import JobError
from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices

STILL = 1e-9
"""A rigid motion whose largest displacement at the supports is below this share of its largest
anywhere is left by them."""
EPS = float(np.finfo(float).eps)
TURNS = 10  # Newton steps of a rotation
BALANCED = 1e-9  # of the loads' sum of sizes: what a resultant's rounding may be


@dataclass(frozen=True, slots=True)
class Supports:
    """Fixed components: node numbers ``nodes`` (s,), ``axes`` (s,) 0, 1 or 2, and how far each
    is moved by the end, ``displacements`` (s,) mm.

    Raises:
        JobError: lengths that differ, an axis that is none, a component fixed twice.
    """

    nodes: Indices
    axes: Indices
    displacements: Array

    def __post_init__(self) -> None:
        if not len(self.nodes) == len(self.axes) == len(self.displacements):
            raise JobError(
                f"supports have {len(self.nodes)} nodes, {len(self.axes)} axes and"
                f" {len(self.displacements)} displacements, must be as many of each"
            )
        if np.any((self.axes < 0) | (self.axes > 2)) or np.any(self.nodes < 0):
            raise JobError("a support's axis must be 0, 1 or 2 and its node not negative")
        if len(np.unique(self.freedoms)) < len(self.nodes):
            raise JobError(
                "a component of a node is supported twice", remedy="one row for each component"
            )

    @classmethod
    def none(cls) -> Supports:
        """No supports: a free sheet."""
        nothing = np.zeros(0, dtype=np.int64)
        return cls(nothing, nothing, np.zeros(0))

    @classmethod
    def fixing(cls, nodes: Indices, axes: Indices | None = None) -> Supports:
        """Every one of ``axes`` (all three, if None) of every one of ``nodes``, not moved."""
        chosen = np.arange(3) if axes is None else np.asarray(axes, dtype=np.int64)
        every = np.asarray(nodes, dtype=np.int64)
        count = len(every) * len(chosen)
        return cls(np.repeat(every, len(chosen)), np.tile(chosen, len(every)), np.zeros(count))

    @property
    def freedoms(self) -> Indices:
        """(s,) numbers of the fixed coordinates."""
        return np.asarray(3 * self.nodes + self.axes)


@dataclass(frozen=True, slots=True)
class Held:
    """Coordinates that do not take part: ``fixed`` (3n,) bool by supports, ``gauge`` (k,) numbers
    of those that stand for the k rigid motions the supports leave, ``rigid`` (3n, k) those."""

    fixed: NDArray[np.bool_]
    gauge: Indices
    rigid: Array

    @property
    def still(self) -> NDArray[np.bool_]:
        """(3n,) fixed or gauge."""
        still = self.fixed.copy()
        still[self.gauge] = True
        return still


def rigid_motions(x: Array) -> Array:
    """(3n, 6) orthonormal velocities of the rigid motions of nodes (n, 3).

    Of nodes that lie in a line only five are independent; the sixth is then noise of their
    rounding, and sheets never are lines.
    """
    arm = x - x.mean(axis=0)
    reach = float(np.max(np.abs(arm))) or 1.0
    motions = np.zeros((len(x), 3, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arm / reach)
    return np.asarray(np.linalg.qr(motions.reshape(-1, 6))[0])


def held(x: Array, supports: Supports) -> Held:
    """Supports, and a gauge for each rigid motion that they leave.

    The internal forces have no resultant in any position, so that holding as many components as
    there are free rigid motions, well apart (by QR with pivoting), only picks one of the equal
    solutions: the held components carry no force.
    """
    from scipy.linalg import qr

    fixed = np.zeros(3 * len(x), dtype=bool)
    fixed[supports.freedoms] = True
    motions = rigid_motions(x)
    _, size, turns = np.linalg.svd(
        np.concatenate([motions[fixed], np.zeros((6, 6))]), full_matrices=False
    )
    reach = float(np.sqrt(1 / max(len(x), 1)))
    left = motions @ turns.T[:, size <= STILL * reach]
    if left.shape[1] == 0:
        return Held(fixed, np.zeros(0, dtype=np.int64), left)
    free = np.flatnonzero(~fixed)
    _, _, pivots = qr(left[free].T, mode="economic", pivoting=True)
    return Held(fixed, free[pivots[: left.shape[1]]], left)


def require_balance(grip: Held, loads: Array) -> None:
    """Loads do no work in a rigid motion that the supports leave.

    Raises:
        JobError: they do; the sheet would fly off or swing.
    """
    total = float(np.abs(loads).sum())
    work = grip.rigid.T @ loads.reshape(-1)
    share = float(np.max(np.abs(work), initial=0.0)) / total if total else 0.0
    if share > BALANCED:
        raise JobError(
            f"the supports leave {grip.rigid.shape[1]} rigid motions, and the loads are not in"
            " balance in them",
            value=share,
            limit=BALANCED,
            remedy="fix more components: three nodes that are not in a line hold a sheet",
        )


def turned_to_balance(x: Array, loads: Array) -> Array:
    """(n, 3) a free sheet turned rigidly until its loads have no moment, whatever it is made of.

    Newton's method on the rotation; about the line of the loads, where any angle will do, it does
    not turn. The nearest position is found, be it a stable one (pull) or not (push).
    """
    middle = x.mean(axis=0)
    for _ in range(TURNS):
        arm = x - middle
        moment = np.cross(arm, loads).sum(axis=0)
        if np.max(np.abs(moment)) <= EPS * float(np.sum(np.abs(arm)) * np.max(np.abs(loads))):
            break
        outer = arm.T @ loads
        slope = (outer + outer.T) / 2 - np.trace(outer) * np.eye(3)
        spin = np.linalg.pinv(slope, rcond=1e-6, hermitian=True) @ -moment
        x = middle + arm @ _rotation(spin * min(1.0, 0.5 / (np.linalg.norm(spin) + EPS))).T
    return x


def _rotation(spin: Array) -> Array:
    """The rotation by a vector (Rodrigues)."""
    angle = float(np.linalg.norm(spin))
    cross = np.cross(np.eye(3), spin)
    half = np.sinc(angle / 2 / np.pi)
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * cross + half**2 / 2 * cross @ cross)


def laid_on(x: Array, target: Array) -> Array:
    """(n, 3) the nodes moved rigidly onto ``target`` by least squares (Kabsch)."""
    here, there = x.mean(axis=0), target.mean(axis=0)
    u, _, vt = np.linalg.svd((x - here).T @ (target - there))
    flip = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))])
    return np.asarray((x - here) @ (u @ flip @ vt) + there)
