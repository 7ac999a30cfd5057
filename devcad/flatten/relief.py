"""Relief: round notches where the bends of creases that fan out from a corner part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.features import Cutout, Features, Placing
from devcad.flatten.blank import Blank
from devcad.flatten.shapes import circle
from devcad.geometry.fillets import Corner
from devcad.geometry.taylor import Array

BEYOND, AT_LEAST = 0.5, 0.1
"""Of the thickness, and of the inside radius where that is more: how far a relief reaches beyond
the place where bends part."""


def relieved(
    features: Features, corners: Sequence[Corner], blank: Blank, thickness: float, inside: float
) -> tuple[Features, tuple[str, ...]]:
    """The features with a round notch at every corner from which creases fan out, and a note that
    tells of them.

    Its centre is where the bend lines' creases meet in the pattern, the mean of what the flats
    around say. Its radius is thickness + inside radius at least, the depth that design guides ask
    of a bend relief, and so large that it takes in all places where the sheet ends beside its
    bends, and half of the thickness more (a tenth of the inside radius at least): what is left of
    the edge is smooth.

    Raises:
        GeometryError: two of them run into one another.
    """
    beyond = max(BEYOND * thickness, AT_LEAST * inside)
    made = []
    rounds: list[tuple[Array, float]] = []
    for number, corner in enumerate(corners, start=1):
        tips, ends = _images(corner, blank)
        centre = tips.mean(axis=0)
        reach = float(np.hypot(*(ends - centre).T).max()) + beyond
        reach = max(reach, thickness + inside)
        rounds.append((centre, reach))
        made.append(
            Cutout(
                f"relief {number}",
                circle(2.0 * reach),
                Placing(at=(float(centre[0]), float(centre[1]))),
                notch=True,
                patches=_from_to(corner, len(blank.middle.patches)),
            )
        )
    _refuse_overlaps(rounds, blank)
    sizes = sorted({f"{2.0 * reach:.4g}" for _, reach in rounds}, key=float)
    note = (
        f"{len(made)} round relief notches of diameter {', '.join(sizes)} mm are cut where creases "
        "run out in a corner"
    )
    return replace(features, cutouts=(*features.cutouts, *made)), (note,)


def _refuse_overlaps(rounds: Sequence[tuple[Array, float]], blank: Blank) -> None:
    """Refuse reliefs, each a centre and a radius, between which no sheet is left."""
    turn, shift = _once_round(blank)
    for (one, radius), (other, reach) in combinations(rounds, 2):
        ways = (other, turn @ other + shift, (other - shift) @ turn)
        apart = min(float(np.hypot(*(one - way))) for way in ways)
        if apart <= radius + reach:
            raise GeometryError(
                f"the round reliefs at ({one[0]:.4g}, {one[1]:.4g}) and ({other[0]:.4g}, "
                f"{other[1]:.4g}) of the pattern, where creases run together, need "
                f"{radius + reach:.4g} mm and are {apart:.4g} mm apart",
                value=apart,
                limit=radius + reach,
                remedy="give a smaller inside_radius, a thinner sheet or wider faces",
            )


def _from_to(corner: Corner, count: int) -> tuple[int, int]:
    """The first and the last of the ``count`` patches of a chain around a corner, counted on beyond
    the seam of a tube."""
    numbers = [number for number, _, _ in corner.ends]
    turns = sum(after < before for before, after in pairwise(numbers))
    return numbers[0], numbers[-1] + turns * count


def _images(corner: Corner, blank: Blank) -> tuple[Array, Array]:
    """The corner's tips and ends in the pattern, (k, 2) each; beyond a tube's seam as if the
    pattern went on there."""
    tips, ends = [], []
    for number, along, across in corner.tips:
        first = np.array(blank.middle.patches[number].domain[:1])
        origin, e, m = blank.developments[number].axes(first)
        tips.append(origin[0] + along * e[0] + across * m[0])
    for number, t, v in corner.ends:
        ends.append(blank.points(number, np.array([t]), np.array([v]))[0])
    turn, shift = _once_round(blank)
    out = []
    for numbers, points in (
        ([tip[0] for tip in corner.tips], tips),
        ([end[0] for end in corner.ends], ends),
    ):
        later = np.cumsum([0, *(after < before for before, after in pairwise(numbers))]) > 0
        if corner.ends[0][0] > numbers[0]:  # the first flat seen lies beyond the seam already
            later[:] = True
        places = np.array(points)
        out.append(np.where(later[:, None], places @ turn.T + shift, places))
    return out[0], out[1]


def _once_round(blank: Blank) -> tuple[Array, Array]:
    """The rotation (2, 2) and the shift that carry the pattern of a tube on beyond its seam."""
    chain = blank.middle
    if chain.closing is None:
        return np.eye(2), np.zeros(2)
    one, other = blank.developments[0], blank.developments[-1]
    start, way, _ = one.axes(np.array(chain.patches[0].domain[:1]))
    stop, last, _ = other.axes(np.array(chain.patches[-1].domain[1:]))
    cos = float(way[0] @ last[0])
    sin = float(way[0, 0] * last[0, 1] - way[0, 1] * last[0, 0])
    turn = np.array([[cos, -sin], [sin, cos]])
    return turn, stop[0] + chain.closing.shift * last[0] - turn @ start[0]
