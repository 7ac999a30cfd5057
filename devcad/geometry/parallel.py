"""Parallel chains: the same sheet at another height, with its creases and its apex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.chain import SMOOTH, Chain, Joint, link
from devcad.geometry.layers import at_apex, mitre, straight_sided
from devcad.geometry.patch import Frame, Patch, RulingJet
from devcad.geometry.taylor import Array


def parallel_chain(chain: Chain, distance: float) -> Chain:
    """The parallel surface of a chain: every patch moved by ``distance`` (mm) along its normal.

    At a crease the neighbours' parallel planes meet on the mitre, so both are lengthened or
    shortened to it. Where the extent ends at an apex it ends at the parallel surface's own.

    Raises:
        GeometryError: a crease beside a patch that is not a plane with straight edges.
    """
    around = [chain.closing, *chain.joints, chain.closing]
    moved = []
    for k, patch in enumerate(chain.patches):
        joints = (around[k], around[k + 1])
        creased = any(joint is not None and not joint.smooth for joint in joints)
        moved.append(_mitred(patch, distance, joints) if creased else _to_apex(patch, distance))
    again = link(tuple(moved), base_closed=chain.closes is not None, tolerance=np.inf)
    return again if chain.closed else replace(chain, patches=again.patches, joints=again.joints)


def _to_apex(patch: Patch, distance: float) -> Patch:
    """The parallel patch, an end of its extent at an apex moved to the parallel's own apex."""
    frame = _inside(patch)
    parallel = patch.parallel(distance)
    ends = at_apex(frame, frame.v_from), at_apex(frame, frame.v_to)
    if not any(ends):
        return parallel

    def field(t: Array, order: int) -> RulingJet:
        jet, frame = parallel.field(t, order), patch.frame_jet(t, order)
        apex = distance * taylor.div(frame.c, frame.a)  # q + v a = distance c, q + v_end a = 0
        return replace(
            jet,
            v_from=jet.v_from + apex if ends[0] else jet.v_from,
            v_to=jet.v_to + apex if ends[1] else jet.v_to,
        )

    return replace(parallel, field=field)


def _mitred(patch: Patch, distance: float, joints: tuple[Joint | None, Joint | None]) -> Patch:
    """A straight-sided plane moved along n, its ends moved to the mitres with its neighbours."""
    frame = _inside(patch)
    if np.abs(frame.c).max() * (patch.domain[1] - patch.domain[0]) > SMOOTH or not straight_sided(
        patch
    ):
        raise GeometryError(
            "the thickness cannot be laid on one side of a crease beside a face that is not plane "
            "with straight edges",
            remedy='describe the middle surface: reference = "middle"',
        )
    low, high = patch.domain
    ends = patch.jet(np.array([low, high]), 0)
    at_ends = patch.frame(np.array([np.nextafter(low, high), np.nextafter(high, low)]))
    lift = distance * np.stack([mitre(at_ends, row, joints[row]) for row in (0, 1)])
    bottom, top = ends.rail(ends.v_from)[0] + lift, ends.rail(ends.v_to)[0] + lift

    def field(t: Array, order: int) -> RulingJet:
        jet = patch.field(t, order)
        share = taylor.variable(t, order) / (high - low)
        share[0] -= low / (high - low)
        lower, upper = _between(bottom, share), _between(top, share)
        length = taylor.norm(upper - lower)
        e = taylor.div(upper - lower, length)
        c0 = lower - taylor.mul(jet.v_from, e)
        return RulingJet(c0, e, jet.v_from, jet.v_from + length)

    return replace(patch, field=field)


def _between(ends: Array, share: Array) -> Array:
    """The series of the straight line between two points (2, 3) at a series of shares."""
    line = share[..., None] * (ends[1] - ends[0])
    line[0] += ends[0]
    return np.asarray(line)


def _inside(patch: Patch) -> Frame:
    return patch.frame(np.linspace(*patch.domain, 11)[1:-1])
