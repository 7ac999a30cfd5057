"""Where panels meet: every seam measured and checked, and the sheets' meshes joined there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from devcad.checks import Check, Where, at_most
from devcad.errors import JobError
from devcad.features import Seam
from devcad.flatten.development import Development
from devcad.geometry.chain import Chain
from devcad.geometry.classify import patch_box
from devcad.geometry.parallel import parallel_chain
from devcad.geometry.seams import EDGES, Border, Meeting, border, largest_gap
from devcad.geometry.taylor import Array
from devcad.mesh.seam import Flat, Side, sewn
from devcad.part import Panel

CHECK = "seam"
CLOSENESS, SHARE = 1e-6, 1e-9
"""Edges nearer than so many mm, or this share of the panels' size, are one edge."""
OF_TOLERANCE = 1e-3
"""But points move by no more than this share of the tolerance."""


def joined(
    panels: Sequence[Panel],
    middles: Sequence[Chain],
    developments: Sequence[Sequence[Development]],
    seams: Sequence[Seam],
    *,
    reference: str,
    tolerance: float,
) -> tuple[tuple[Panel, ...], tuple[Meeting, ...], list[Check]]:
    """The panels with meshes that share their points along the seams; what became of each seam;
    and its check ``seam``.

    The edges are measured on the face that the job describes, bent to the end, and match where
    they are nowhere further apart than the tolerance. Sheets without thickness whose edges are
    one (to 1e-6 mm, or 1e-9 of their size, but a thousandth of the tolerance at most) have equal
    points there, to the bit; on a thick sheet the edges of the skins do not meet.

    Args:
        middles, developments: of each panel, not partly bent.
        reference: the face of a thick sheet that the job describes.
    Raises:
        JobError: a seam names a panel or an edge that there is not.
    """
    named = {panel.name: k for k, panel in enumerate(panels)}
    faces: dict[int, Chain] = {}
    meetings, checks, pairs = [], [], []
    for seam in seams:
        _known(seam, named)
        numbers = [named[panel] for panel, _ in (seam.first, seam.second)]
        for k in numbers:
            faces.setdefault(k, _face(middles[k], panels[k].thickness, reference))
        closeness = closeness_of([faces[k] for k in numbers], tolerance)
        first, second = (
            border(faces[k], name, closeness)
            for k, (_, name) in zip(numbers, (seam.first, seam.second), strict=True)
        )
        check, meeting = _met(seam, first, second, tolerance)
        checks.append(check)
        meetings.append(meeting)
        if _is_closed(seam, middles[numbers[0]]):
            meetings[-1] = replace(meeting, joined=True)
        elif meeting.gap <= closeness and all(_thin(panels[k], middles[k]) for k in numbers):
            pairs.append((len(meetings) - 1, Side(numbers[0], first), Side(numbers[1], second)))
    if not pairs:
        return tuple(panels), tuple(meetings), checks
    closeness = max(closeness_of([s.border.chain for s in pair[1:]], tolerance) for pair in pairs)
    meshes, done = sewn(
        [panel.mesh for panel in panels],
        [_places(each) for each in developments],
        [(first, second) for _, first, second in pairs],
        closeness,
    )
    for (number, _, _), success in zip(pairs, done, strict=True):
        meetings[number] = replace(meetings[number], joined=success)
    changed = [replace(panel, mesh=mesh) for panel, mesh in zip(panels, meshes, strict=True)]
    return tuple(changed), tuple(meetings), checks


def _known(seam: Seam, named: dict[str, int]) -> None:
    for panel, edge in (seam.first, seam.second):
        for word, words, what in ((panel, list(named), "panel"), (edge, list(EDGES), "edge")):
            if word not in words:
                near = get_close_matches(word, words, 1) or words
                raise JobError(
                    f"no {what} is named {word!r}",
                    place=seam.place,
                    value=word,
                    limit=", ".join(words),
                    remedy=f"did you mean {near[0]!r}?",
                )
    if seam.first == seam.second:
        raise JobError(
            f"{_name(seam.first)} is joined to itself",
            place=seam.place,
            remedy="name two edges",
        )


def _name(edge: tuple[str, str]) -> str:
    return ".".join(edge)


def _face(middle: Chain, thickness: float, reference: str) -> Chain:
    """The face that the job describes, of a sheet with this middle."""
    if not thickness or reference == "middle":
        return middle
    return parallel_chain(middle, 0.5 * thickness if reference == "front" else -0.5 * thickness)


def closeness_of(chains: Sequence[Chain], tolerance: float) -> float:
    """How near edges of these chains are one edge, mm."""
    boxes = np.concatenate([patch_box(patch) for chain in chains for patch in chain.patches])
    size = float(np.linalg.norm(np.ptp(boxes, axis=0)))
    return min(max(CLOSENESS, SHARE * size), OF_TOLERANCE * tolerance)


def _met(seam: Seam, first: Border, second: Border, tolerance: float) -> tuple[Check, Meeting]:
    gap, point = largest_gap(first, second)
    length = first.length, second.length
    names = f"{_name(seam.first)} and {_name(seam.second)}"
    x, y, z = point.tolist()
    check = at_most(
        CHECK,
        seam.first[0],
        gap,
        tolerance,
        "mm",
        where=Where(point=(x, y, z)),
        says=f"{names} are up to {gap:.4g} mm apart, their lengths {length[0]:.6g} and "
        f"{length[1]:.6g} mm",
        remedy="give both edges one curve, or place the panels so that they meet",
    )
    meeting = Meeting((seam.first, seam.second), gap, length, check.passed, False)
    return check, meeting


def _is_closed(seam: Seam, middle: Chain) -> bool:
    """Whether the seam is that of a tube, whose mesh has no edge there."""
    (panel, edge), (other, opposite) = seam.first, seam.second
    return middle.closed and panel == other and {edge, opposite} == {"start", "end"}


def _thin(panel: Panel, middle: Chain) -> bool:
    """Whether the panel is a sheet without thickness, bent to the end."""
    return not panel.thickness and panel.chain is middle


def _places(developments: Sequence[Development]) -> Flat:
    def places(number: int, t: Array, v: Array) -> Array:
        return developments[number].points(t, v)

    return places
