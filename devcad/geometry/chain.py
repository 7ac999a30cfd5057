"""Chain: patches joined along rulings, one after the other, as they lie in one sheet."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError, JobError
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

SMOOTH = 1e-9
"""Largest angle in radians between two tangent planes that count as one."""
STILL = 1e-9
"""A rail slower than this share of its largest speed stands still."""
TIP = 1e-12
"""A ruling shorter than this share of the chain's size is a point."""
JOINED = 1e-8
"""Largest gap between neighbouring rulings, as a share of the chain's size."""


@dataclass(frozen=True, slots=True)
class Joint:
    """The ruling between two patches of a chain.

    ``angle`` turns the normal before into the normal after, about the ruling, in radians:
    positive folds towards the front. ``shift`` is the distance along the ruling from the base
    curve before to the base curve after: c0_after = c0_before + shift e.
    """

    angle: float
    shift: float

    @property
    def smooth(self) -> bool:
        """Whether the tangent plane continues; 1e-9 rad moves no point by 1e-9 of the part."""
        return abs(self.angle) <= SMOOTH


@dataclass(frozen=True, slots=True)
class Chain:
    """Patches in order; ``joints[k]`` lies between patch k and patch k + 1.

    ``closing`` is the joint from the last patch to the first where the last ruling is the first
    one, else None: a tube. ``closes`` is False where a closed base curve came back with another
    ruling, and ``closing_angle`` is then the angle between the two in radians. ``orientable`` is
    False on a Moebius band.
    """

    patches: tuple[Patch, ...]
    joints: tuple[Joint, ...] = ()
    closing: Joint | None = None
    closes: bool | None = None
    closing_angle: float | None = None
    orientable: bool = True

    @property
    def closed(self) -> bool:
        """Whether the chain is a tube without a gap."""
        return self.closing is not None

    @property
    def around(self) -> tuple[Joint, ...]:
        """The joints after the patches in order, last that from the last patch to the first."""
        return self.joints if self.closing is None else (*self.joints, self.closing)

    @property
    def creased(self) -> bool:
        """Whether a joint is a crease."""
        return not all(joint.smooth for joint in self.around)


def link(patches: tuple[Patch, ...], *, base_closed: bool, tolerance: float) -> Chain:
    """The chain of patches that follow one another, closed where the last meets the first.

    Args:
        base_closed: whether the base curve returns to its start, as the construction knows it.
        tolerance: rulings that coincide within a hundredth of it (mm) close the chain.
    Raises:
        GeometryError: two neighbours do not share a ruling.
    """
    size = float(np.linalg.norm(np.ptp(np.concatenate([_corners(p) for p in patches]), axis=0)))
    joints = []
    for k, (before, after) in enumerate(itertools.pairwise(patches)):
        gap = float(np.linalg.norm(_end(before, 1) - _end(after, 0), axis=1).max())
        if gap > JOINED * size:
            raise GeometryError(
                f"patches {k + 1} and {k + 2} do not share a ruling at t = {after.domain[0]:.6g}: "
                f"they are {gap:.3g} mm apart, limit {JOINED * size:.3g} mm",
                value=gap,
                limit=JOINED * size,
                remedy="make the curve and the extent continuous at its corners",
            )
        if _point_like(before, 1, size):
            raise GeometryError(
                f"patches {k + 1} and {k + 2} meet in a point, not along a ruling, at "
                f"t = {after.domain[0]:.6g}",
                remedy="keep from < to at the corners of the curve, or make two panels",
            )
        joints.append(_joint(before, after))
    chain = Chain(patches, tuple(joints))
    if _point_like(patches[0], 0, size):
        return chain  # a sheet that begins with a tip has no ruling to close along
    first, last = _end(patches[0], 0), _end(patches[-1], 1)
    if np.linalg.norm(first - last, axis=1).max() <= 0.01 * tolerance:
        return replace(chain, closing=_joint(patches[-1], patches[0]), closes=True)
    if base_closed and np.linalg.norm(first[::-1] - last, axis=1).max() <= 0.01 * tolerance:
        return replace(chain, closes=True, orientable=False)
    if not base_closed:
        return chain
    e0, e1 = _ruling(patches[0], 0), _ruling(patches[-1], 1)
    angle = float(np.arctan2(np.linalg.norm(np.cross(e0, e1)), e0 @ e1))
    return replace(chain, closes=False, closing_angle=angle)


def cut_at(chain: Chain, t: float) -> Chain:
    """The same tube, opened at the ruling t instead of at its start.

    Raises:
        JobError: the chain is not closed, or no patch has t in its domain.
    """
    low, high = chain.patches[0].domain[0], chain.patches[-1].domain[1]
    if chain.closing is None:
        raise JobError(
            "cut: the surface is not closed, so there is no seam to place",
            value=t,
            remedy="remove the key cut",
        )
    if not low <= t <= high:
        raise JobError(
            f"cut: no ruling at t = {t:.6g}, the parameter runs from {low:.6g} to {high:.6g}",
            value=t,
            limit=high,
            remedy="choose t between the two",
        )
    if t in (low, high):
        return chain
    k = next(i for i, p in enumerate(chain.patches) if t <= p.domain[1])
    before, at, after = chain.patches[:k], chain.patches[k], chain.patches[k + 1 :]
    head = [at.restricted(t, at.domain[1])] if t < at.domain[1] else []
    tail = [at.restricted(at.domain[0], t)]
    ahead, behind = [*head, *after], [*before, *tail]
    plain = chain.closing.smooth and abs(chain.closing.shift) <= 1e-12
    if plain and ahead and _one_run(ahead[-1], behind[0]):
        ahead[-1:], behind = [_merged(ahead[-1], behind[0])], behind[1:]
    return link(tuple(ahead + behind), base_closed=True, tolerance=np.inf)


def with_gap(chain: Chain, gap: float) -> Chain:
    """The tube with a strip left out before its seam, ``gap`` mm wide at its wider end.

    Raises:
        JobError: the chain is not closed, or the gap is wider than the last patch.
    """
    if chain.closes is not True:
        raise JobError(
            "gap: the surface is not closed, so there is no seam to open",
            value=gap,
            remedy="remove the key gap",
        )
    seam = _end(chain.patches[-1], 1)
    last = chain.patches[-1]

    def width(t: float) -> float:
        jet = last.jet([t], 0)
        ends = jet.c0[0] + np.stack([jet.v_from[0], jet.v_to[0]]) * jet.e[0]
        return float(np.linalg.norm(ends - seam, axis=1).max())

    low, high = last.domain
    grid = np.linspace(low, high, 257)
    widths = [width(float(s)) for s in grid]
    wide = [s for s, w in zip(grid[::-1], widths[::-1], strict=True) if w >= gap]
    if not wide:
        raise JobError(
            f"gap: {gap:.6g} mm is wider than the last patch reaches, {max(widths):.6g} mm",
            value=gap,
            limit=max(widths),
            remedy="choose a narrower gap, or begin the curve elsewhere",
        )
    low = float(wide[0])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if width(middle) >= gap else (low, middle)
    kept = last.restricted(last.domain[0], low)
    return replace(chain, patches=(*chain.patches[:-1], kept), closing=None)


def _one_run(before: Patch, after: Patch) -> bool:
    """Whether both rails run on from one patch to the next: none turns at their joint, and none
    is a point on one side only."""
    paces = [_paces(before, -1), _paces(after, 0)]
    points, turns = (np.array([pace[k] for pace in paces]) for k in (0, 1))
    return bool((points[0] == points[1]).all() and not turns.any())


def _paces(patch: Patch, row: int) -> tuple[list[bool], list[bool]]:
    """Of both rails, whether it is a point, and whether it moves but stands still at the patch's
    first (0) or last (-1) ruling."""
    jet = patch.jet(np.linspace(*patch.domain, 9), 1)
    speeds = [np.linalg.norm(jet.rail(v)[1], axis=1) for v in (jet.v_from, jet.v_to)]
    fastest = max(float(speed.max()) for speed in speeds)
    points = [float(speed.max()) <= STILL * fastest for speed in speeds]
    turns = [
        not point and float(speed[row]) <= STILL * float(speed.max())
        for point, speed in zip(points, speeds, strict=True)
    ]
    return points, turns


def _merged(first: Patch, second: Patch) -> Patch:
    """Two patches with a smooth joint as one; the second's parameters are moved behind."""
    seam = first.domain[1]
    move = seam - second.domain[0]

    def field(t: Array, order: int) -> RulingJet:
        late = t >= seam
        parts = [first.field(t[~late], order), second.field(t[late] - move, order)]
        names = ("c0", "e", "v_from", "v_to")
        out = {}
        for name in names:
            one, other = (getattr(part, name) for part in parts)
            whole = np.empty((order + 1, len(t), *one.shape[2:]))
            whole[:, ~late], whole[:, late] = one, other
            out[name] = whole
        return RulingJet(**out)

    return Patch(
        field,
        (first.domain[0], second.domain[1] + move),
        (*first.breaks, seam, *(b + move for b in second.breaks)),
        first.causal,
    )


def _joint(before: Patch, after: Patch) -> Joint:
    end, start = before.frame([_near(before, 1)]), after.frame([_near(after, 0)])
    n0, n1, e = end.n[0], start.n[0], start.e[0]
    angle = float(np.arctan2(np.cross(n0, n1) @ e, n0 @ n1))
    at_end = before.jet([before.domain[1]], 0).c0[0, 0]
    at_start = after.jet([after.domain[0]], 0).c0[0, 0]
    return Joint(angle, float((at_start - at_end) @ e))


def _near(patch: Patch, end: int) -> float:
    """The domain's start (0) or end (1), a rounding inside."""
    low, high = patch.domain
    return float(np.nextafter(high, low) if end else np.nextafter(low, high))


def _end(patch: Patch, end: int) -> Array:
    """The two end points of the first (0) or last (1) ruling, (2, 3)."""
    jet = patch.jet([patch.domain[end]], 0)
    return np.asarray(jet.c0[0] + np.stack([jet.v_from[0], jet.v_to[0]]) * jet.e[0])


def _point_like(patch: Patch, end: int, size: float) -> bool:
    """Whether the first (0) or last (1) ruling is the point of a tip."""
    low, high = _end(patch, end)
    return float(np.linalg.norm(high - low)) <= TIP * size


def _ruling(patch: Patch, end: int) -> Array:
    return np.asarray(patch.jet([patch.domain[end]], 0).e[0, 0])


def _corners(patch: Patch) -> Array:
    jet = patch.jet(np.linspace(*patch.domain, 17), 0)
    return np.concatenate([jet.rail(jet.v_from)[0], jet.rail(jet.v_to)[0]])
