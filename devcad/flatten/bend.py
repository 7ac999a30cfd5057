"""Partly bent chains: the same pattern, bent less, as patches like any other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devcad.flatten.blank import Blank, reaches_tips
from devcad.flatten.development import develop_chain
from devcad.flatten.fold import Folded, fold_chain
from devcad.flatten.neutral import Fibre
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.creasing import Bending
from devcad.geometry.patch import Frame, Patch, RulingJet
from devcad.geometry.taylor import Array

STILL_CLOSED = 1e-6
"""A hundredth of this, in mm, is how near the ends of a bent tube must be to be one ruling."""


def bent(blank: Blank, bend: float) -> Chain:
    """The middle surface with c -> bend * c and every crease to bend * its angle.

    What keeps its lengths throughout is the neutral fibre: the middle is that of the part at
    bend = 1, the blank itself at 0, and between them as much longer as it is bent. The first
    ruling and its frame stay where they are. A tube opens, unless it is flat.
    Source: geometry.md, 14.
    """
    chain = blank.middle
    rest = [fibre and replace(fibre, share=1.0 - bend) for fibre in blank.fibres]
    developments = blank.developments if blank.isometric else develop_chain(chain, rest)
    first = chain.patches[0].frame([chain.patches[0].domain[0]])
    folded = fold_chain(developments, chain, first, bend)
    much = _evenly(bend)
    patches = tuple(_bent(*each, much) for each in zip(chain.patches, folded, rest, strict=True))
    joined = link(patches, base_closed=False, tolerance=STILL_CLOSED)
    return replace(
        chain,
        patches=patches,
        joints=joined.joints,
        closing=joined.closing if chain.closed else None,
    )


def neutral(blank: Blank) -> Chain:
    """The smooth surface that is isometric to the blank: bent as the part, and nowhere longer."""
    chain = blank.middle
    first = chain.patches[0].frame([chain.patches[0].domain[0]])
    whole = fold_chain(blank.developments, chain, first, 1.0)
    every = zip(chain.patches, whole, blank.fibres, strict=True)
    return replace(chain, patches=tuple(_bent(*each, _evenly(1.0)) for each in every))


def unevenly_bent(blank: Blank, first: Frame, bends: Sequence[Bending]) -> Chain:
    """The middle surface with c -> bend(t) c, each patch by its own of ``bends``, from the frame
    ``first`` of its first ruling on: an isometry, whatever the bends are.

    For smooth chains that keep their middle's length. Source: geometry.md, 14.
    """
    chain = blank.middle
    folded = fold_chain(blank.developments, chain, first, bends)
    every = zip(chain.patches, folded, bends, strict=True)
    patches = tuple(_bent(patch, each, None, bend) for patch, each, bend in every)
    joined = link(patches, base_closed=False, tolerance=STILL_CLOSED)
    return replace(
        chain,
        patches=patches,
        joints=joined.joints,
        closing=joined.closing if chain.closed else None,
    )


def _evenly(bend: float) -> Bending:
    """One number for all rulings."""
    return lambda t, order: taylor.constant(bend, order, len(t))


def _bent(patch: Patch, folded: Folded, rest: Fibre | None, bend: Bending) -> Patch:
    """The patch whose frame starts from the folded one and obeys the frame's own equations; by
    ``rest`` it is shorter than the patch was."""
    tips = reaches_tips(patch) if rest else (False, False)

    def field(t: Array, order: int) -> RulingJet:
        c0, e, m, n = (np.zeros((order + 1, len(t), 3)) for _ in range(4))
        c0[0], e[0], m[0], n[0] = folded.frames(t)
        jet = patch.frame_jet(t, max(order - 1, 0))
        a, c, p, q = jet.a, taylor.mul(bend(t, max(order - 1, 0)), jet.c), jet.p, jet.q
        extent = patch.field(t, order)
        v_from, v_to = extent.v_from, extent.v_to
        if rest is not None:
            q, v_from, v_to = rest.pattern(patch.frame_jet(t, order), tips)
        for k in range(order):  # one more coefficient of the frame from the equations
            so_far = slice(k + 1)
            e[k + 1] = taylor.mul(a[so_far], m[so_far])[k] / (k + 1)
            m[k + 1] = taylor.mul(c[so_far], n[so_far])[k] / (k + 1)
            m[k + 1] -= taylor.mul(a[so_far], e[so_far])[k] / (k + 1)
            n[k + 1] = -taylor.mul(c[so_far], m[so_far])[k] / (k + 1)
            c0[k + 1] = taylor.mul(p[so_far], e[so_far])[k] / (k + 1)
            c0[k + 1] += taylor.mul(q[so_far], m[so_far])[k] / (k + 1)
        return RulingJet(c0, e, v_from, v_to)

    return replace(patch, field=field, breaks=rest.breaks(patch) if rest else patch.breaks)
