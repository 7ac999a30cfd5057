"""The blank: a middle surface laid out in the plane as it is cut, before it is bent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.flatten.development import Development, develop_chain
from devcad.flatten.neutral import Fibre
from devcad.geometry import taylor
from devcad.geometry.chain import Chain
from devcad.geometry.layers import at_apex
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

Fibres = tuple[Fibre | None, ...]
"""Of each patch of a chain its neutral fibre, None where the middle keeps its length."""


@dataclass(frozen=True, slots=True)
class Blank:
    """The sheet before it is bent to ``middle``, whose ``developments`` lay it out.

    ``fibre`` is what keeps its length, None where nothing was said of it; ``fibres`` where it
    makes the pattern another than the middle's. ``chain`` has the a, p, q and the extent of the
    pattern: plane patches, or the middle itself where the two are isometric.
    """

    middle: Chain
    developments: tuple[Development, ...]
    chain: Chain
    fibre: Fibre | None
    fibres: Fibres

    @property
    def isometric(self) -> bool:
        """Whether the middle surface keeps its lengths."""
        return self.chain is self.middle

    @property
    def divided(self) -> Chain:
        """The middle surface with the breaks of the pattern: between them both are smooth."""
        patches = tuple(
            patch if flat.breaks == patch.breaks else replace(patch, breaks=flat.breaks)
            for patch, flat in zip(self.middle.patches, self.chain.patches, strict=True)
        )
        return self.middle if self.isometric else replace(self.middle, patches=patches)

    @property
    def jumps(self) -> tuple[tuple[float, ...], ...]:
        """Of each patch the breaks at which a smooth line of the pattern has a corner in space."""
        pairs = zip(self.middle.patches, self.fibres, strict=True)
        return tuple(fibre.jumps(patch) if fibre else () for patch, fibre in pairs)

    def points(self, number: int, t: Array, v: Array) -> Array:
        """The places (n, 2) in the pattern of the points (t, v), each (n,), of a patch.

        Where a patch reaches its apex the pattern has one of its own, and ends there.
        """
        fibre = self.fibres[number]
        if fibre is not None and any(reaches_tips(self.middle.patches[number])):
            jet = self.chain.patches[number].jet(t, 0)
            v = np.clip(v, jet.v_from[0], jet.v_to[0])
        return self.developments[number].points(t, v)


def lay_flat(
    middle: Chain, fibre: Fibre | None = None, start: tuple[float, Array] | None = None
) -> Blank:
    """The blank of a middle surface (not bent), of its neutral fibre where one is given; its first
    ruling lies at ``start``, an angle and the place (2,) of c0, else along +x from the origin."""
    fibres = tuple(fibre if fibre and fibre.acts(patch) else None for patch in middle.patches)
    developments = develop_chain(middle, fibres, start)
    chain = middle
    if any(fibres):
        chain = flat_chain(middle, [each.series for each in developments], fibres)
    return Blank(middle, developments, chain, fibre, fibres)


def flat_chain(
    middle: Chain, series: Sequence[Callable[[Array], Array]], fibres: Fibres | None = None
) -> Chain:
    """The pattern of a chain as plane patches, one for each patch, with the same joints.

    ``series`` give omega, X and Y of the developments at t, (n, 3 or more).
    """
    every = zip(middle.patches, series, fibres or (None,) * len(series), strict=True)
    return replace(middle, patches=tuple(flat_patch(*each) for each in every))


def flat_patch(patch: Patch, series: Callable[[Array], Array], fibre: Fibre | None = None) -> Patch:
    """The pattern of a patch as a patch of the plane z = 0, its front up.

    ``series`` gives omega, X and Y of the development at t; their derivatives come from a, p and
    q of the patch itself, so that the jets are exact to any order. An extent that ends at an apex
    ends at the pattern's own.
    """
    tips = reaches_tips(patch) if fibre else (False, False)

    def field(t: Array, order: int) -> RulingJet:
        jet = patch.frame_jet(t, order)
        q, v_from, v_to = jet.q, jet.ruling.v_from, jet.ruling.v_to
        if fibre is not None:
            q, v_from, v_to = fibre.pattern(jet, tips)
        at = series(t)
        sin, cos = taylor.sin_cos(taylor.integral(at[:, 0], jet.a[:order]))
        x = taylor.integral(at[:, 1], (taylor.mul(jet.p, cos) - taylor.mul(q, sin))[:order])
        y = taylor.integral(at[:, 2], (taylor.mul(jet.p, sin) + taylor.mul(q, cos))[:order])
        zero = np.zeros_like(x)
        return RulingJet(
            np.stack([x, y, zero], axis=-1), np.stack([cos, sin, zero], axis=-1), v_from, v_to
        )

    return Patch(field, patch.domain, fibre.breaks(patch) if fibre else patch.breaks)


def reaches_tips(patch: Patch) -> tuple[bool, bool]:
    """Whether the extent begins, and whether it ends, at a point where all rulings meet."""
    frame = patch.frame(np.linspace(*patch.domain, 17)[1:-1])
    return at_apex(frame, frame.v_from), at_apex(frame, frame.v_to)
