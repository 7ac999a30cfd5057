"""The developables that every space curve carries: what each is, and where it is singular.

Each is built as the surface kind of its name is built, over an extent of the analysis's own; type
and singular points do not depend on it. What is singular and how follows from the six functions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.analysis.traces import Traces, knots
from devcad.geometry.classify import Shape, classify, sample_parameters
from devcad.geometry.constructions import SURFACES
from devcad.geometry.constructions.base import constant_extent
from devcad.geometry.constructions.focal import motion
from devcad.geometry.constructions.sampling import dips
from devcad.geometry.curve import Curve, samples, size
from devcad.geometry.patch import Patch
from devcad.geometry.regularity import singularities
from devcad.geometry.taylor import Array

KINDS = ("tangent", "rectifying", "darboux", "principal-normal-darboux", "focal")
"""In the order of geometry.md, section 2."""
OF_DIRECTIONS = ("darboux", "principal-normal-darboux")
"""The kinds whose base curve runs on the unit sphere: their size is not the curve's."""
REACH = 0.6180339887
"""Half the extent, as a share of the size: no simple ratio, which a regression curve would meet."""
ZERO = 1e-9
"""delta or c at an end of the curve below this share of its largest value is zero there."""
TINY = 1e-300
"""A coordinate below this is no number that a file should hold."""
NOTHING = 1e-14
"""A height below this share of the extent is rounding."""
ASIDE = 1e-6
"""Share of the curve's domain by which a focal developable keeps away from a still ruling."""
SLOPE = 1e-6
"""Its derivative times the length of the domain is not, above this share."""
MOST_PATCHES = 16
"""Beyond as many smooth patches a surface is not taken apart."""
MOST_PANELS = 512
"""A curve of more panels would take minutes."""
MOST_STRETCHES = 8
"""As many are named."""
ORDER = ("apex", "cuspidal-edge", "swallowtail", "cuspidal-crosscap")
"""In which the singular points are told."""


@dataclass(frozen=True, slots=True)
class SingularPoint:
    """A point of a regression curve: v = -q/a at the parameter t, and what the surface is there:
    cuspidal-edge, swallowtail, cuspidal-crosscap or apex."""

    t: float
    v: float
    point: Array
    type: str


@dataclass(frozen=True, slots=True)
class Attached:
    """A developable of the curve: its ``type`` (plane, cylinder, cone or tangent), or ``why`` it
    has none; an apex, or one point of the cuspidal edge with every swallowtail and crosscap.

    ``pieces`` smooth patches make it; ``note`` says why these are no strip, where they are none.
    """

    kind: str
    type: str | None
    why: str = ""
    note: str = ""
    pieces: int = 0
    singularities: tuple[SingularPoint, ...] = ()


@dataclass(frozen=True, slots=True)
class _Given:
    """A curve where a surface's table has one."""

    piece: Curve

    def curve(self) -> Curve:
        return self.piece


def developables(curve: Curve, traces: Traces) -> tuple[Attached, ...]:
    """All five, each over the bent parts of the curve between its corners.

    v is a length in the curve's unit; in the Darboux developables, which the curve's directions
    make, a number (their ``scale`` is 1).
    """
    parts = _bent_parts(curve, traces)
    if not parts:
        return tuple(Attached(kind, None, "the curve is straight") for kind in KINDS)
    if traces.panels > MOST_PANELS:
        why = f"the curve has {traces.panels} spans or waves: too many to take it apart"
        return tuple(Attached(kind, None, why) for kind in KINDS)
    return tuple(_attached(kind, curve, parts, traces) for kind in KINDS)


def _bent_parts(curve: Curve, traces: Traces) -> list[Curve]:
    """The parts of the curve between corners and straight stretches."""
    ends = knots(curve)
    where = np.clip(np.searchsorted(ends, traces.t, side="right") - 1, 0, len(ends) - 2)
    bent = np.bincount(where, weights=traces.bent, minlength=len(ends) - 1) > 0.0
    split = {float(b) for b, (x, y) in zip(ends[1:-1], pairwise(bent), strict=True) if x != y}
    parts = _split(curve, split).pieces()
    middles = [0.5 * (part.domain[0] + (*part.breaks, part.domain[1])[0]) for part in parts]
    return [
        part
        for part, t in zip(parts, middles, strict=True)
        if bent[np.searchsorted(ends, t, side="right") - 1]
    ]


def _split(curve: Curve, at: set[float]) -> Curve:
    """The curve with further corners."""
    return replace(
        curve,
        corners=tuple(sorted({*curve.corners, *at})),
        breaks=tuple(b for b in curve.breaks if b not in at),
    )


def _attached(kind: str, curve: Curve, parts: list[Curve], traces: Traces) -> Attached:
    """One developable over all parts of the curve."""
    patches: list[Patch] = []
    note = ""
    try:
        for part in parts:
            found, refusal = _patches(kind, part, traces)
            patches += found
            note = note or refusal
    except (GeometryError, JobError) as error:
        return Attached(kind, None, _told(kind, error))
    if len(patches) > MOST_PATCHES:
        return Attached(kind, None, f"it is smooth only piece by piece, {len(patches)} of them")
    shapes = [classify(patch) for patch in patches]
    points = [
        point
        for patch, shape in zip(patches, shapes, strict=True)
        for point in _singular_points(patch, shape, curve)
    ]
    types = [shape.type for shape in shapes]
    why = "" if len(set(types)) == 1 else f"it changes: {_stretches(patches, types)}"
    told = _once(points, size(curve.point(samples(curve))))
    return Attached(kind, None if why else types[0], why, note, len(patches), told)


def _patches(kind: str, part: Curve, traces: Traces) -> tuple[list[Patch], str]:
    """The patches of a surface kind over one part of the curve; and why it is no strip as a whole,
    where only pieces of it are.

    On the tangent of an inflection the whole ruling is singular: there the surface is cut.
    """
    low, high = part.domain
    if kind == "tangent":
        inner = {t for t in traces.inflections if low < t < high and t not in part.breaks}
        part = _split(part, inner)
    try:
        return [patch for piece in part.pieces() for patch in _built(kind, piece)], ""
    except GeometryError as error:
        pieces = _between_still_rulings(part) if kind == "focal" else []
        if not pieces and 0 < len(part.breaks) < MOST_PATCHES:
            pieces = list(_split(part, set(part.breaks)).pieces())
        if not pieces:
            raise
        return [patch for piece in pieces for patch in _built(kind, piece)], _told(kind, error)


def _between_still_rulings(part: Curve) -> list[Curve]:
    """The stretches on which the ruling of the focal developable moves; none where it always
    does, or never."""
    still = partial(motion, part)
    with np.errstate(all="ignore"):  # nothing is known where the curve is straight
        ends = np.array([*part.domain, *dips(still, part)])
        at = np.unique(ends[still(ends, 0)[0] <= ZERO**2])
    if not 0 < len(at) < MOST_PATCHES:
        return []
    low, high = part.domain
    aside = ASIDE * (high - low)
    starts = [low, *(at + aside).tolist()]
    stops = [*(at - aside).tolist(), high]
    return [
        replace(
            part, domain=(a, b), breaks=tuple(t for t in part.breaks if a < t < b), closed=False
        )
        for a, b in zip(starts, stops, strict=True)
        if b - a > aside
    ]


def _built(kind: str, piece: Curve) -> list[Patch]:
    """The patches of a surface kind over a smooth piece of the curve."""
    reach = REACH * (1.0 if kind in OF_DIRECTIONS else size(piece.point(samples(piece))))
    extent = constant_extent(-reach, reach)
    keys: dict[str, Any] = {"kind": kind, "curve": _Given(piece), "extent": extent}
    surface = SURFACES[kind].model_construct(**keys)
    return [patch for panel in surface.build().panels for patch in panel.patches]


def _told(kind: str, error: GeometryError | JobError) -> str:
    """What a construction has said, without its own name."""
    return error.what.removeprefix(f"{kind}: ").removeprefix("curve: ")


def _stretches(patches: list[Patch], types: list[str]) -> str:
    """The types over stretches of the curve, in words."""
    words = []
    for name, run in groupby(zip(types, patches, strict=True), key=lambda pair: pair[0]):
        first, *_, last = [patch for _, patch in run] * 2
        words.append(f"{name} from t = {first.domain[0]:.6g} to {last.domain[1]:.6g}")
    return ", ".join(words[:MOST_STRETCHES]) + (", ..." if len(words) > MOST_STRETCHES else "")


def _singular_points(patch: Patch, shape: Shape, curve: Curve) -> list[SingularPoint]:
    """The singular points of a patch, those at the very ends of the curve included."""
    ends = curve.domain[:1] if curve.closed else curve.domain
    special = {
        t: kind
        for t in ends
        if shape.type == "tangent" and t in patch.domain and (kind := _special(patch, t))
    }
    found = [(t, _edge(patch, t), kind) for t, kind in special.items()]
    for each in singularities(patch, shape):
        if each.type == "cuspidal-edge" and each.t in special:
            middle = 0.5 * sum(patch.domain)
            found.append((middle, _edge(patch, middle), each.type))
        else:
            found.append((each.t, each.point, each.type))
    return [
        SingularPoint(t, _height(patch, t, point), np.where(np.abs(point) < TINY, 0.0, point), kind)
        for t, point, kind in found
    ]


def _special(patch: Patch, t: float) -> str:
    """swallowtail or cuspidal-crosscap where the patch has one at this end, else nothing.

    Source: geometry.md (0.3); between the ends a change of sign tells, here only the value.
    """
    at = np.array([t, *sample_parameters(patch, 9)])
    jet = patch.frame_jet(at, 2)
    with np.errstate(all="ignore"):
        delta = jet.p[:2] - taylor.derivative(taylor.div(jet.q, jet.a))
    span = patch.domain[1] - patch.domain[0]
    zero, turning = {}, {}
    for name, series in (("delta", delta), ("c", jet.c)):
        usual = np.nanmedian(np.abs(series[0, 1:]))
        zero[name] = abs(series[0, 0]) <= ZERO * usual
        turning[name] = abs(series[1, 0]) * span > SLOPE * usual
    if zero["delta"] and turning["delta"] and not zero["c"]:
        return "swallowtail"
    return "cuspidal-crosscap" if zero["c"] and turning["c"] and not zero["delta"] else ""


def _edge(patch: Patch, t: float) -> Array:
    """The point of the regression curve at t."""
    frame = patch.frame([t])
    return np.asarray(frame.c0[0] - (frame.q[0] / frame.a[0]) * frame.e[0])


def _height(patch: Patch, t: float, point: Array) -> float:
    """The v of a point on the ruling at t; what is rounding on this extent is 0."""
    jet = patch.jet(t, 0)
    v = float((point - jet.c0[0, 0]) @ jet.e[0, 0])
    return v if abs(v) > NOTHING * float(jet.v_to[0, 0]) else 0.0


def _once(points: list[SingularPoint], scale: float) -> tuple[SingularPoint, ...]:
    """The points in the order of their types and parameters: one of the cuspidal edges, every
    apex once."""
    ordered = sorted(points, key=lambda point: (ORDER.index(point.type), point.t))
    apexes: list[SingularPoint] = []
    for point in ordered:
        if point.type == "apex" and not any(
            np.linalg.norm(other.point - point.point) <= ZERO * scale for other in apexes
        ):
            apexes.append(point)
    edges = [point for point in ordered if point.type == "cuspidal-edge"]
    special = [point for point in ordered if point.type not in ("apex", "cuspidal-edge")]
    return (*apexes, *edges[:1], *special)
