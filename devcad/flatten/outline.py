"""The pattern of a chain: outline, holes, reference lines, exact area and box."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from devcad.flatten.border import Pairs, border, cut_border, healed
from devcad.flatten.clipping import sheet
from devcad.flatten.drawings import draw, not_repeated
from devcad.flatten.edges import DROPPED
from devcad.flatten.green import bounds
from devcad.flatten.images import swept_area
from devcad.flatten.pattern import Line, Pattern, Unrolled, length_bound
from devcad.geometry import chebyshev
from devcad.geometry.cells import Run, whole
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

LINE_EVERY = np.radians(15.0)
"""A reference ruling is drawn after this much bending: none on a plane."""


def lay_out(
    chain: Chain,
    developments: Sequence[Unrolled],
    rulings: tuple[Array, ...],
    drawings: tuple[Drawing, ...] = (),
    cuts: tuple[Cut, ...] = (),
    bending: Sequence[Patch] = (),
    bends: Sequence[Line] | None = None,
) -> Pattern:
    """The pattern of a chain, its front towards the viewer, counterclockwise.

    The area is the surface's own (quadrature of q + v a) without what is cut out, the box is
    found to rounding. Reference lines: joints (rulings where smooth, bends where creased) and
    certified rulings about every 15 degrees of bending. Drawings are those on the sheet, without
    what is a point. Both end where a cut begins. A chain that is the pattern itself, of plane
    patches, does not bend: the patches to which it will be tell by their ``bending``. With
    ``bends`` of a press brake these are the bend lines, in their order, and no ruling is one.

    Raises:
        GeometryError: the cuts part the panel, or cross each other.
    """
    pairs = list(zip(chain.patches, developments, strict=True))
    outline, holes = healed(*(cut_border(chain, pairs, cuts) if cuts else (border(pairs), ())))
    box = bounds(outline)
    least = DROPPED * float(np.hypot(box[2] - box[0], box[3] - box[1]))
    drawn = [edge for each in drawings for edge in draw(each, *pairs[each.patch])]
    kept = tuple(edge for edge in drawn if length_bound(edge) > least)
    if bends is None:
        lines = reference_lines(chain, pairs, rulings, bending)
    else:
        joints = _joints(chain, pairs, bending or chain.patches)
        lines = (*(line for line in joints if not line.angle), *bends)
    lines = not_repeated(lines, kept, least)
    if cuts:
        left = sheet(outline, holes)
        lines = tuple(part for line in lines for part in left.line(line))
        kept = tuple(part for edge in kept for part in left.edge(edge))
    return Pattern(outline, lines, sheet_area(chain, cuts), box, holes, kept)


def reference_lines(
    chain: Chain, pairs: Pairs, rulings: tuple[Array, ...], bending: Sequence[Patch] = ()
) -> tuple[Line, ...]:
    """Joints (rulings where smooth, bends where creased), and of the certified ``rulings`` about
    one for every 15 degrees of ``bending``, that of the chain's own patches by default. A patch
    that is one bend has the line in its middle and no rulings."""
    bent = bending or chain.patches
    return (*_joints(chain, pairs, bent), *_references(pairs, rulings, bent))


def sheet_area(chain: Chain, cuts: tuple[Cut, ...]) -> float:
    """The area of a chain's surface without what ``cuts`` take away, mm2.

    By Green's formula on the surface: along a contour, the integral in dt of the area between
    v_from and it. The pattern is not asked.
    """
    if all(cut.closed for cut in cuts):
        lengths = [(track, track.u) for cut in cuts for track in cut.tracks]
        total = sum(surface_area(patch) for patch in chain.patches)
    else:
        cell = whole(cuts, chain)
        parts = (*itertools.chain(*cell.loops), *cell.holes)
        pieces = [piece for part in parts if isinstance(part, Run) for piece in part.pieces]
        lengths = [(cuts[p.cut].tracks[p.track], p.u) for p in pieces]
        tops = [part for part in parts if not isinstance(part, Run) and part.side == 1]
        total = sum(
            surface_area(chain.patches[top.patch].restricted(top.start, top.end)) for top in tops
        )
    return total + swept_area(lengths, chain.patches, _area_between) if cuts else total


def surface_area(patch: Patch) -> float:
    """The area of a patch in mm2: the integral of q (v1 - v0) + a (v1^2 - v0^2) / 2."""
    return integral(patch, _area_density)


def integral(patch: Patch, density: Callable[[Frame], Array], *, scale: float = 0.0) -> float:
    """The integral over t of a density (n,) made from the frame, to rounding.

    A total below ``scale`` is nothing: a density that is only rounding has no shape to resolve.
    """
    series = chebyshev.resolve(
        lambda t: density(patch.frame(t))[:, None],
        patch.segments,
        scale=scale / (patch.domain[1] - patch.domain[0]),
    )
    return float(series.antiderivative()(np.array(patch.domain))[1, 0])


def _area_density(f: Frame) -> Array:
    return _area_between(f, f.v_from, f.v_to)


def _area_between(f: Frame, low: Array, high: Array) -> Array:
    """The area of the rulings between two heights, per t."""
    return np.asarray(f.q * (high - low) + 0.5 * f.a * (high**2 - low**2))


def _ruling_lines(
    layer: str, patch: Patch, unrolled: Unrolled, t: Array, angle: float
) -> list[Line]:
    """The images of the rulings at t (n,)."""
    jet = patch.jet(t, 0)
    starts = unrolled.points(t, jet.v_from[0])
    ends = unrolled.points(t, jet.v_to[0])
    return [Line(layer, start, end, angle) for start, end in zip(starts, ends, strict=True)]


def _joints(chain: Chain, pairs: Pairs, bent: Sequence[Patch]) -> list[Line]:
    """The joints between patches and the patches that are one bend as lines, in their order:
    rulings where smooth, bends up or down where creased or bent."""
    out = []
    for k, ((patch, unrolled), turning) in enumerate(zip(pairs, bent, strict=True)):
        radius = turning.inside_radius
        if k and radius is None and bent[k - 1].inside_radius is None:
            joint = chain.joints[k - 1]
            layer, angle = ("RULING", 0.0) if joint.smooth else (_way(joint.angle), joint.angle)
            out += _ruling_lines(layer, patch, unrolled, np.array(patch.domain[:1]), angle)
        if radius is not None:
            angle, middle = _turned(turning), np.array([0.5 * (patch.domain[0] + patch.domain[1])])
            lines = _ruling_lines(_way(angle), patch, unrolled, middle, angle)
            out += [replace(line, radius=(radius, radius)) for line in lines]
    return out


def _way(angle: float) -> str:
    return "BEND_UP" if angle > 0.0 else "BEND_DOWN"


def _turned(patch: Patch) -> float:
    """By what angle in radians a patch that is one bend turns the normal, to the front positive."""
    low, high = patch.domain
    frame = patch.frame([np.nextafter(low, high), np.nextafter(high, low)])
    return float(np.arctan2(np.cross(frame.n[0], frame.n[1]) @ frame.e[0], frame.n[0] @ frame.n[1]))


def _references(pairs: Pairs, rulings: tuple[Array, ...], bent: Sequence[Patch]) -> list[Line]:
    """Certified rulings to bend along, one for every 15 degrees of bending."""
    out = []
    for (patch, unrolled), t, turning in zip(pairs, rulings, bent, strict=True):
        if len(t) < 3 or turning.inside_radius is not None:
            continue
        rate = np.abs(turning.frame(0.5 * (t[1:] + t[:-1])).c)
        step = np.floor(np.cumsum(rate * np.diff(t))[:-1] / LINE_EVERY + 1e-9)
        picked = np.flatnonzero(np.diff(step, prepend=0.0) > 0.0)
        out += _ruling_lines("RULING", patch, unrolled, t[picked + 1], 0.0)
    return out
