"""What ``devcad analyze`` tells: as data for programs, as a table for people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from devcad.geometry.analysis.analysis import Analysis
from devcad.geometry.analysis.attached import Attached
from devcad.geometry.analysis.helices import KINDS, Ratio
from devcad.geometry.analysis.traces import RATIOS
from devcad.geometry.taylor import Array

MOST_POINTS = 6
"""Singular points of one developable that the table shows."""
ROUNDING = 1e-14
"""The table shows 0 for what is below this share of its neighbours."""
NAMES = {kind: kind.replace("_", "-") for kind in KINDS}
SYMBOLS = {"f": "f = tau/k"}

Named = tuple[str, Analysis]
"""A curve's key in its file, and what was found."""


def analysis_report(file: str, found: Sequence[Named], figure: str) -> dict[str, Any]:
    """The analysis as a tree of plain values: lengths in mm, None for what does not exist.

    The first curve's keys stand at the top, those of further curves under ``others``. ``sigma``,
    ``psi`` and ``chi`` are continued through inflections, the curvature is never negative.
    """
    (name, first), *others = found
    return {
        **_curve(first),
        "file": file,
        "curve": name,
        "units": "mm",
        "others": [{"curve": name, **_curve(analysis)} for name, analysis in others],
        "figure": figure,
    }


def _curve(analysis: Analysis) -> dict[str, Any]:
    """What one curve's entry says."""
    traces, degrees = analysis.traces, analysis.degrees
    samples = {"t": traces.t, "curvature": traces.curvature, "torsion": traces.torsion}
    samples |= dict(zip(RATIOS[1:], traces.ratios[1:], strict=True))
    return {
        "length": analysis.length,
        "closed": analysis.closed,
        "causal": analysis.causal,
        "samples": {key: _numbers(values) for key, values in samples.items()},
        "helix": dict(analysis.helix),
        "developables": [_developable(each) for each in analysis.developables],
        "degrees": None
        if degrees is None
        else {
            "curve": degrees.curve,
            "tangent_developable": degrees.tangent_developable,
            "edge_surface": degrees.edge_surface,
            "note": "of a smooth general curve of this degree and genus 0",
        },
        "arc_length": _numbers(traces.arc),
        "lorentz": {
            "curvature": _numbers(traces.lorentz[0]),
            "torsion": _numbers(traces.lorentz[1]),
        },
        "helix_numbers": {name: _ratio(analysis.ratios[name]) for name in RATIOS},
        "notes": list(analysis.notes),
    }


def _ratio(ratio: Ratio) -> dict[str, Any]:
    return {
        "mean": _number(ratio.mean),
        "spread": _number(ratio.spread),
        "limit": _number(ratio.limit),
        "constant": ratio.constant,
        "axis": None if ratio.axis is None else _numbers(ratio.axis),
    }


def _developable(each: Attached) -> dict[str, Any]:
    return {
        "kind": each.kind,
        "type": each.type,
        "singularities": [
            {
                "t": _number(point.t),
                "v": _number(point.v),
                "point": _numbers(point.point),
                "type": point.type,
            }
            for point in each.singularities
        ],
        "why": each.why or None,
        "note": each.note or None,
        "pieces": each.pieces,
    }


def _numbers(values: Array) -> list[float | None]:
    return [_number(value) for value in values.tolist()]


def _number(value: float) -> float | None:
    """The number, 0 without a sign; None for what is none."""
    return value + 0.0 if math.isfinite(value) else None


# --- for people ----------------------------------------------------------------------------


def analysis_lines(found: Sequence[Named], figure: str) -> Iterator[str]:
    """The table: what each curve is, its developables with their singular points, the figure."""
    for name, analysis in found:
        yield name
        for key, text in _rows(analysis):
            yield f"  {key:<12}{text}"
        for each in analysis.developables:
            yield from _developable_lines(each)
        for note in analysis.notes:
            yield f"  note: {note}"
    yield figure


def figure_subtitle(name: str, analysis: Analysis) -> str:
    """A line on the curve for its figure."""
    ends = "closed" if analysis.closed else "open"
    told = [name, f"length {analysis.length:.9g} mm", ends, analysis.causal, _helices(analysis)]
    return ", ".join(told)


def _rows(analysis: Analysis) -> Iterator[tuple[str, str]]:
    traces, degrees = analysis.traces, analysis.degrees
    yield "length", f"{analysis.length:.12g} mm"
    yield "closed", "yes" if analysis.closed else "no"
    yield "curvature", _span(traces.curvature)
    yield "torsion", _span(traces.torsion)
    yield "causal", f"{analysis.causal} (x^2 + y^2 - z^2, z is time)"
    yield "", f"curvature {_span(traces.lorentz[0])}, torsion {_span(traces.lorentz[1])}"
    yield "helix", _helices(analysis)
    for kind, name in zip(NAMES.values(), RATIOS, strict=True):
        yield "", f"{kind:<12} {_told(name, analysis.ratios[name])}"
    if degrees is not None:
        text = f"{degrees.curve}"
        if degrees.tangent_developable is not None:
            text += (
                f", of its tangent developable {degrees.tangent_developable}"
                f", of its edge surface {degrees.edge_surface} (if smooth and general)"
            )
        yield "degree", text


def _span(values: Array) -> str:
    """The smallest and the largest of the numbers there are."""
    known = values[np.isfinite(values)]
    if not len(known):
        return "-"
    low, high = f"{known.min() + 0.0:.6g}", f"{known.max() + 0.0:.6g}"
    return f"{low} /mm" if low == high else f"{low} to {high} /mm"


def _helices(analysis: Analysis) -> str:
    """The kinds of helix that the curve is, in words."""
    kinds = [NAMES[kind] for kind, is_one in analysis.helix.items() if is_one]
    return f"{', '.join(kinds)} helix" if kinds else "no helix"


def _told(name: str, ratio: Ratio) -> str:
    """A ratio with the numbers that decide."""
    head = f"{SYMBOLS.get(name, name):<10}"
    if not math.isfinite(ratio.mean):
        return f"{head}not known"
    word = "constant" if ratio.constant else "not constant"
    return (
        f"{head}mean {_shown(ratio.mean, 1.0)}, spread {ratio.spread:.2g}"
        f" (limit {ratio.limit:.2g}): {word}"
    )


def _shown(value: float, size: float) -> str:
    """Six digits of a number; 0 for what is rounding beside the size."""
    return f"{value:.6g}" if abs(value) > ROUNDING * size else "0"


def _developable_lines(each: Attached) -> Iterator[str]:
    """A developable and its singular points, the first ones of many."""
    kind = each.type or f"none: {each.why}"
    yield f"  {each.kind} developable: {kind}"
    if each.note:
        yield f"    in {each.pieces} pieces: {each.note}"
    for point in each.singularities[:MOST_POINTS]:
        size = float(np.abs(point.point).max()) + abs(point.v)
        place = ", ".join(_shown(value, size) for value in point.point.tolist())
        t, v = _shown(point.t, 1.0), _shown(point.v, size)
        yield f"    {point.type:<18} t = {t:<12} v = {v:<12} ({place})"
    rest = len(each.singularities) - MOST_POINTS
    if rest > 0:
        yield f"    ... {rest} more"
