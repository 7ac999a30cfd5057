"""What a space curve is: length, curvature and torsion, helix class, its developables, degrees."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.analysis.attached import Attached, developables
from devcad.geometry.analysis.degrees import (
    degree_of_edge_surface,
    degree_of_tangent_developable,
    is_plane,
    rational_degree,
)
from devcad.geometry.analysis.helices import Ratio, helix_class, ratios
from devcad.geometry.analysis.traces import LIGHT, RATIOS, Traces, trace
from devcad.geometry.constructions.sampling import dips
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveModel
from devcad.geometry.frames import LORENTZ
from devcad.geometry.taylor import Array

SPACE = 3
"""The lowest degree of a curve that leaves the plane."""
JUMP = 1e-6
"""Of the usual size: two values on the two sides of a break that differ by more jump."""
TOLD = 6
"""As many parameters are named in a note."""


@dataclass(frozen=True, slots=True)
class Degrees:
    """Of a rational curve, and of two developables of a space curve; None on a plane one."""

    curve: int
    tangent_developable: int | None
    edge_surface: int | None


@dataclass(frozen=True, slots=True)
class Analysis:
    """What ``analyze`` finds, in the curve's own unit; ``ratios`` by the names of ``RATIOS``,
    ``helix`` by those of ``helices.KINDS``, ``notes`` sentences for the reader."""

    closed: bool
    causal: str
    traces: Traces
    ratios: dict[str, Ratio]
    helix: dict[str, bool]
    developables: tuple[Attached, ...]
    degrees: Degrees | None
    notes: tuple[str, ...]

    @property
    def length(self) -> float:
        """The curve's length."""
        return self.traces.length


def analyze(curve: Curve, spec: CurveModel | None = None) -> Analysis:
    """Everything that ``devcad analyze`` tells of a curve.

    Args:
        spec: the curve's table in the job, if it has one: it knows some degrees exactly.
    Raises:
        JobError: a value or a first derivative is not a finite number.
    """
    with np.errstate(all="ignore"):
        traces = trace(curve)
        found = ratios(traces)
        return Analysis(
            closed=curve.closed,
            causal=causal_type(curve, traces),
            traces=traces,
            ratios=found,
            helix=helix_class(found),
            developables=developables(curve, traces),
            degrees=_degrees(curve, spec, traces),
            notes=tuple(_notes(curve, traces)),
        )


def causal_type(curve: Curve, traces: Traces) -> str:
    """spacelike, timelike, lightlike or mixed: the sign of <r', r'> in x^2 + y^2 - z^2, z time.

    Looked at where the traces are and where it comes nearest to 0; one lightlike point on a
    spacelike or timelike curve makes it mixed, and within 1e-9 of |r'|^2 counts as lightlike.
    """
    slopes = np.concatenate([_slope(curve, traces.t, 0)[0], *_extreme_slopes(curve)])
    slopes = slopes[np.isfinite(slopes)]
    if np.all(slopes > LIGHT):
        return "spacelike"
    if np.all(slopes < -LIGHT):
        return "timelike"
    return "lightlike" if np.all(np.abs(slopes) <= LIGHT) else "mixed"


def _slope(curve: Curve, t: Array, order: int) -> Array:
    """The series of <r', r'>/|r'|^2 (order + 1, n)."""
    velocity = taylor.derivative(curve.jet(t, order + 1))
    length = taylor.dot(velocity, velocity)
    return taylor.div(taylor.dot(LORENTZ * velocity, velocity), length)


def _extreme_slopes(curve: Curve) -> list[Array]:
    """The smallest and the largest slopes inside each piece."""

    def signed(piece: Curve, sign: float) -> Callable[[Array, int], Array]:
        return lambda t, order: sign * _slope(piece, t, order)

    return [
        _slope(piece, dips(signed(piece, sign), piece), 0)[0]
        for piece in curve.pieces()
        for sign in (1.0, -1.0)
    ]


def _degrees(curve: Curve, spec: CurveModel | None, traces: Traces) -> Degrees | None:
    degree = rational_degree(curve, spec)
    if degree is None:
        return None
    if degree < SPACE or is_plane(curve.point(traces.t)):
        return Degrees(degree, None, None)
    return Degrees(degree, degree_of_tangent_developable(degree), degree_of_edge_surface(degree))


# --- what a reader should know -------------------------------------------------------------


def _notes(curve: Curve, traces: Traces) -> list[str]:
    """Sentences on what the numbers alone do not say."""
    found = []
    if not traces.bent.any():
        found.append("the curve is straight: no torsion, no helix class")
    elif is_plane(curve.point(traces.t)):
        found.append("the curve is plane, which makes it a cylindrical helix without slope")
    if traces.inflections:
        where = _places(traces.inflections)
        found.append(f"the curvature is 0 {where}: N and B are continued through, ratios with them")
    if traces.stops:
        found.append(f"the curve stands still {_places(traces.stops)}: it has no frame there")
    if curve.corners:
        found.append(f"the tangent jumps {_places(curve.corners)}: taken piece by piece")
    jumps = _jumps(curve, traces)
    if jumps:
        found.append(jumps)
    return found


def _places(t: tuple[float, ...]) -> str:
    """Parameters in words."""
    more = f", ... ({len(t)} places)" if len(t) > TOLD else ""
    return f"at t = {', '.join(f'{x + 0.0:.6g}' for x in t[:TOLD])}{more}"


def _jumps(curve: Curve, traces: Traces) -> str:
    """What jumps at the breaks, in words; nothing where nothing does."""
    seen = np.intersect1d(curve.breaks, traces.t)  # of very many some were passed over
    after = np.searchsorted(traces.t, seen[seen > np.nextafter(traces.t[0], np.inf)])
    after = after[traces.t[after - 1] == np.nextafter(traces.t[after], -np.inf)]
    if not len(after):
        return ""
    named = {"curvature": traces.curvature, "torsion": traces.torsion}
    named |= dict(zip(RATIOS[1:], np.abs(traces.ratios[1:]), strict=True))
    jumping = []
    for name, values in named.items():
        usual = float(np.nanmedian(np.abs(values))) if np.isfinite(values).any() else 0.0
        if name in RATIOS:
            usual += 1.0
        jump = np.abs(values[after] - values[after - 1])
        gone = np.isfinite(values[after]) != np.isfinite(values[after - 1])
        if np.any(gone | (jump > JUMP * usual)):
            jumping.append(name)
    if not jumping:
        return ""
    number = len(curve.breaks)
    return (
        f"{', '.join(jumping)} may jump at the {number} {'break' if number == 1 else 'breaks'}"
        " of the curve (spline knots, line to arc)"
    )
