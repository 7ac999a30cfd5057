"""How a sheet folds along its curved creases while its rulings stay where they are.

One crease always folds so: sin(alpha) keeps its proportions along it, and both sides bend by one
and the same share of what they are bent in the end (geometry/creasing.py). Of two creases beside
one strip each says how the strip is to bend; where they differ there is no such motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.bend import unevenly_bent
from devcad.flatten.blank import Blank
from devcad.flatten.flanks import Hanging
from devcad.geometry.chain import Chain
from devcad.geometry.creasing import Bending, Crease
from devcad.geometry.patch import Frame

ROOMY = 1.1
"""A groove is so much wider than what lets two thick flanks touch, unless its width is given."""
HALF = 0.5
"""Where on the way it is seen whether a sheet folds with its rulings fixed."""
RIGID = 1e-9
"""Largest difference between what two creases make of c on the flank between them."""


def creases(chains: Sequence[Chain], hanging: Hanging) -> list[Crease]:
    """The crease along which a flank hangs on its parent, patch by patch."""
    parent, child, side = hanging
    pairs = zip(chains[parent].patches, chains[child].patches, strict=True)
    return [Crease(one, other, side) for one, other in pairs]


def family(
    middles: Sequence[Chain], hangings: Sequence[Hanging], bend: float
) -> tuple[list[list[Bending]], list[float]]:
    """What c of every flank is multiplied by, patch by patch, and sin(alpha) of every crease, when
    the largest fold angle of the first crease is ``bend`` times what it is, 0 to 1. A flank that
    lies between two creases takes the bending of the one that is nearer to the first.

    Raises:
        GeometryError: two creases of a flank ask for different bendings of it: there is no motion
        with rulings that stay in the sheet.
    """
    bends: list[list[Bending]] = [[] for _ in middles]
    mus: list[float] = []
    for hanging in hangings:
        parent, child, _ = hanging
        along = creases(middles, hanging)
        if not bends[parent]:
            sine = max(largest_sine(crease) for crease in along)
            mu = float(np.sin(bend * np.arcsin(sine)) / sine)
        else:
            start = np.array([along[0].parent.domain[0]])
            known = float(bends[parent][0](start, 0)[0, 0])
            mu = along[0].proportion(known, float(start[0]))
        bends[child] = [crease.bending(mu) for crease in along]
        if not bends[parent]:
            bends[parent] = bends[child]
        mus.append(mu)
    _require_rigid(middles, hangings, bends, bend)
    return bends, mus


def largest_sine(crease: Crease) -> float:
    """The largest sin(alpha) along a crease, on a dense sample."""
    t = np.linspace(*crease.parent.domain, 129)
    return float(np.sqrt(crease.squared_sine(t, 0)[0].max()))


def _require_rigid(
    middles: Sequence[Chain], hangings: Sequence[Hanging], bends: list[list[Bending]], bend: float
) -> None:
    if bend == 1.0:  # at the end all agree; what lies before tells
        family(middles, hangings, HALF)
        return
    for parent, child, _ in hangings:
        for patch, one, other in zip(
            middles[parent].patches, bends[parent], bends[child], strict=True
        ):
            t = np.linspace(*patch.domain, 33)
            off = np.abs(one(t, 0)[0] - other(t, 0)[0])
            k = int(np.argmax(off))
            if off[k] > RIGID:
                raise GeometryError(
                    f"the creases of one strip ask it to bend differently at t = {t[k]:.6g}, by "
                    f"{off[k]:.3g} of its bending, when the sheet is folded to {bend:.3g}",
                    value=float(off[k]),
                    limit=RIGID,
                    remedy="use bend = 1, or give every crease one fold angle along its length",
                )


def posed(
    middles: Sequence[Chain],
    blanks: Sequence[Blank],
    hangings: Sequence[Hanging],
    bends: Sequence[Sequence[Bending]],
    mus: Sequence[float],
) -> list[Chain]:
    """The flanks folded less: the first ruling of the first flank and its frame stay."""
    first = middles[0].patches[0]
    starts: list[Frame | None] = [first.frame([first.domain[0]]), *([None] * len(hangings))]
    chains: list[Chain] = []
    for number in range(len(middles)):
        if number:
            hanging, mu = hangings[number - 1], mus[number - 1]
            crease = creases(middles, hanging)[0]
            parent = chains[hanging[0]].patches[0]
            t = np.array([parent.domain[0]])
            whole = float(crease.fold_angle(t)[0])
            angle = 2.0 * float(np.arcsin(mu * np.sin(0.5 * whole)))
            jet = parent.jet(t, 1)
            slope = (jet.v_from if hanging[2] == "base" else jet.v_to)[1]
            starts[number] = crease.started(parent.frame(t), slope, angle)
        start = starts[number]
        assert start is not None
        chains.append(unevenly_bent(blanks[number], start, bends[number]))
    return chains


def groove_width(along: Sequence[Crease], given: float | None, thickness: float) -> float:
    """The width of the grooves in mm: the least at which both sides of every crease stand free, and
    a tenth more, or what is given.

    Raises:
        GeometryError: what is given is less than that.
    """
    sine = max(largest_sine(crease) for crease in along)
    least = thickness * sine / float(np.sqrt(1.0 - sine**2))
    if given is None:
        return ROOMY * least
    if given < least:
        raise GeometryError(
            f"groove: {given:.6g} mm lets both sides of the crease stand in one another",
            value=given,
            limit=least,
            remedy=f"make it {least:.4g} mm wide or more (thickness x tan(half the fold angle))",
        )
    return given
