"""Which flank of a folded sheet has which of its features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devcad.errors import GeometryError
from devcad.features import Cutout, Features, Mark, Placing
from devcad.flatten.blank import Blank
from devcad.flatten.border import border
from devcad.flatten.flanks import Hanging, from_left
from devcad.flatten.polygons import polygon, winding
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array, rows_dot

TRACED = 1e-4
"""Of a flank's size: how finely its outline is traced to see what lies on it."""


def shared_out(
    features: Features, blanks: Sequence[Blank], hangings: Sequence[Hanging]
) -> list[Features]:
    """Each flank's own cutouts and marks, their places told by the flank's own.

    A feature ``at`` a place of the pattern is on the flank that has it, or is nearest to it.
    ``at_surface`` = (ft, fv) counts fv from the left edge of the sheet to its right one, by the
    lengths of the rulings on the way.

    Raises:
        GeometryError: a drill or a trim; these are not done across curved creases.
    """
    for each in (*features.cutouts, *features.trims):
        if not isinstance(each, Cutout):
            raise GeometryError(
                "a sheet with curved creases is neither drilled nor trimmed",
                place=each.place,
                remedy="give a cutout in the pattern, or an extent that ends there",
            )
    contours = [_contour(blank) for blank in blanks] if features.cutouts or features.marks else []
    out: list[Features] = [Features() for _ in blanks]
    for cutout in features.cutouts:
        assert isinstance(cutout, Cutout)
        number, placing = _home(cutout.placing, blanks, hangings, contours)
        own = out[number]
        out[number] = replace(own, cutouts=(*own.cutouts, replace(cutout, placing=placing)))
    for mark in features.marks:
        number, placing = _home(mark.placing, blanks, hangings, contours)
        own = out[number]
        out[number] = replace(own, marks=(*own.marks, _moved(mark, placing)))
    return out


def _moved(mark: Mark, placing: Placing) -> Mark:
    return replace(mark, placing=placing)


def _contour(blank: Blank) -> Array:
    """The outline of a flank as a polygon, (k, 2)."""
    edges = border(list(zip(blank.chain.patches, blank.developments, strict=True)))
    corners = np.concatenate([edge.curve(edge.u)[0] for edge in edges])
    return polygon(edges, TRACED * float(np.hypot(*np.ptp(corners, axis=0))))


def _home(
    placing: Placing,
    blanks: Sequence[Blank],
    hangings: Sequence[Hanging],
    contours: Sequence[Array],
) -> tuple[int, Placing]:
    """The flank on which a place lies, and the place there."""
    if placing.at is not None:
        point = np.array(placing.at)
        on = [k for k, contour in enumerate(contours) if winding(contour, point)]
        away = [_away(contour, point) for contour in contours]
        return (on[0] if on else int(np.argmin(away))), placing
    assert placing.at_surface is not None
    share, across = placing.at_surface
    order = from_left(hangings)
    widths = [_width(blanks[k], share) for k in order]
    ends = np.cumsum([0.0, *widths])
    reach = across * ends[-1]
    at = int(np.clip(np.searchsorted(ends, reach, side="right") - 1, 0, len(order) - 1))
    return order[at], replace(placing, at_surface=(share, float((reach - ends[at]) / widths[at])))


def _away(contour: Array, point: Array) -> float:
    """How far a point (2,) is from the sides of a polygon (k, 2)."""
    start, side = contour - point, np.roll(contour, -1, axis=0) - contour
    square = np.maximum(rows_dot(side, side), np.finfo(float).tiny)
    share = np.clip(-rows_dot(start, side) / square, 0.0, 1.0)
    return float(np.hypot(*(start + share[:, None] * side).T).min())


def _width(blank: Blank, share: float) -> float:
    """The length of the ruling at a share of the chain's whole range of parameters."""
    patches = blank.chain.patches
    spans = np.array([patch.domain[1] - patch.domain[0] for patch in patches])
    before = np.concatenate([[0.0], np.cumsum(spans)])
    far = share * before[-1]
    k = int(np.clip(np.searchsorted(before, far, side="right") - 1, 0, len(patches) - 1))
    jet = patches[k].jet([patches[k].domain[0] + far - before[k]], 0)
    return float((jet.v_to - jet.v_from)[0, 0])


def refuse_in_groove(cuts: Sequence[Cut], whole: Chain, body: Chain, groove: float) -> None:
    """Raise a GeometryError where a cutout of a flank, ``whole`` up to its creases, reaches into
    the ``groove`` (mm) that leaves its ``body``."""
    for cut in cuts:
        for track in cut.tracks:
            t, v = track.series(np.linspace(track.u[0], track.u[-1], 65))[:, :2].T
            sheet, left = (chain.patches[track.patch].jet(t, 0) for chain in (whole, body))
            low = (left.v_from > sheet.v_from)[0] & (v < left.v_from[0])
            high = (left.v_to < sheet.v_to)[0] & (v > left.v_to[0])
            if (low | high).any():
                raise GeometryError(
                    f"cutout-crosses-edge: a cutout reaches into the groove of {groove:.4g} mm "
                    f"along a curved crease, at t = {t[np.argmax(low | high)]:.6g}",
                    value=groove,
                    remedy="move it away from the crease, or give the sheet no thickness",
                )
