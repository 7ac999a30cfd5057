"""What the report says of a panel (design.md, section 6): plain numbers and words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from devcad.checks import Check
from devcad.flatten.blank import Blank
from devcad.flatten.green import enclosed_area, perimeter
from devcad.flatten.lorentz import lorentz_area
from devcad.flatten.neutral import least_k, left_over
from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import Chain
from devcad.geometry.classify import EXACT, Shape, sample_parameters
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.regularity import regression_curve, singularities, smallest_radius
from devcad.part import Panel


def panel_facts(
    panel: Panel,
    middle: Chain,
    shapes: tuple[Shape, ...],
    checks: list[Check],
    apex: bool,
    allowed: list[str],
) -> dict[str, Any]:
    """The panel's entry in report.json, in its order; what does not exist is None."""
    by_name = {check.name: check for check in checks}
    fibre = panel.blank.fibre if panel.blank else None
    radius = min(smallest_radius(patch).value for patch in middle.patches)
    angle = middle.closing_angle
    flat = pattern_facts(panel.pattern)
    return {
        "name": panel.name,
        "kind": panel.kind,
        "type": _type(middle, shapes),
        "causal": middle.patches[0].causal,
        "closed": middle.closed,
        "closes": middle.closes,
        "closing_angle_deg": None if angle is None else float(np.degrees(angle)),
        "orientable": middle.orientable,
        "watertight": panel.mesh.watertight,
        "apex": apex,
        "area": panel.area,
        "flat_area": flat["flat_area"],
        "flat_bbox": flat["flat_bbox"],
        "min_radius": _finite(radius),
        "max_twist_deg": _finite(by_name["twist"].value),
        "max_crease_deg": None,
        "relaxed_mm": None,
        "k_neutral": None if fibre is None else least_k(fibre, middle.patches),
        "k_source": None if fibre is None else fibre.words,
        "clearance": _finite(by_name["regular"].value),
        "singularities": [
            {"t": s.t, "point": s.point.tolist(), "type": s.type}
            for patch, shape in zip(middle.patches, shapes, strict=True)
            for s in singularities(patch, shape)
        ],
        "regression": _regression(middle, shapes),
        "ruling_count": sum(len(t) - 1 for t in panel.rulings) + 1,
        "cut_length": flat["cut_length"],
        "pierces": flat["pierces"],
        "mass_g": None,
        "lorentz_area": None if panel.spacetime is None else lorentz_area(panel.spacetime),
        "allowed": allowed,
    }


def sheet_facts(
    panel: Panel, checks: list[Check], figures: Mapping[str, float], notes: tuple[str, ...]
) -> dict[str, Any]:
    """The entry of a sheet folded along curved creases, from those of its flanks; and ``folds``,
    for every crease its way, its length in mm and its fold angle along it."""
    every = [flank.facts for flank in panel.flanks]
    types = {facts["type"] for facts in every}
    curves = [facts["regression"] for facts in every if facts["regression"]]
    least = {
        key: min((facts[key] for facts in every if facts[key] is not None), default=None)
        for key in ("min_radius", "clearance")
    }
    return {
        **every[0],
        "name": panel.name,
        "type": types.pop() if len(types) == 1 else "mixed",
        "watertight": panel.mesh.watertight,
        "apex": any(facts["apex"] for facts in every),
        "area": sum(facts["area"] for facts in every),
        **pattern_facts(panel.pattern),
        **least,
        "max_twist_deg": max(facts["max_twist_deg"] for facts in every),
        "singularities": [point for facts in every for point in facts["singularities"]],
        "regression": {
            key: [value for curve in curves for value in curve[key]] for key in ("t", "points")
        }
        if curves
        else None,
        "ruling_count": sum(facts["ruling_count"] for facts in every),
        "allowed": sorted({check.name for check in checks if not check.passed}),
        "figures": dict(figures),
        "notes": list(notes),
        "folds": [
            {
                "way": "valley" if fold.table[0]["fold_deg"] > 0.0 else "mountain",
                "length": fold.table[-1]["s"],
                "table": [dict(row) for row in fold.table],
            }
            for fold in panel.folds
        ],
    }


def pattern_facts(pattern: Pattern) -> dict[str, Any]:
    """What the report says of a pattern as it is cut: area, box, length and number of the cuts."""
    contours = (pattern.outline, *pattern.holes)
    return {
        "flat_area": sum(enclosed_area(contour) for contour in contours),
        "flat_bbox": list(pattern.bbox),
        "cut_length": sum(perimeter(contour) for contour in contours),
        "pierces": len(contours),
    }


def neutral_figures(blank: Blank) -> dict[str, float]:
    """What is left where K depends on the radius: ``neutral_rest``, by how much mm at most the
    sheet is longer or shorter than its pattern because K is one number along each ruling."""
    if blank.fibre is None or not blank.fibre.law.kinks:
        return {}
    fibre = blank.fibre
    return {"neutral_rest": sum(left_over(fibre, patch) for patch in blank.middle.patches)}


def rail_facts(fit: RailFit, mm_per_unit: float) -> dict[str, Any]:
    """What the report says more of a panel that was looked for between rails: its creases, and how
    far a rail was moved."""
    return {
        "max_crease_deg": fit.largest_crease,
        "relaxed_mm": None if fit.relaxed is None else fit.relaxed * mm_per_unit,
    }


def strain(checks: list[Check]) -> dict[str, float]:
    """The largest strain of a sheet that is bent to a surface although it twists; nothing where the
    pattern is isometric. The first fundamental form differs by twice the strain."""
    isometry = next(check for check in checks if check.name == "isometry")
    return {} if isometry.passed else {"strain": 0.5 * isometry.value}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _regression(chain: Chain, shapes: tuple[Shape, ...]) -> dict[str, Any] | None:
    """The regression curve of the patches that have one, sampled."""
    curves = [
        regression_curve(patch)
        for patch, shape in zip(chain.patches, shapes, strict=True)
        if shape.type in ("cone", "tangent")
    ]
    found = [curve for curve in curves if curve is not None]
    if not found:
        return None
    return {
        "t": np.concatenate([t for t, _ in found]).tolist(),
        "points": np.concatenate([points for _, points in found]).tolist(),
    }


def _type(chain: Chain, shapes: tuple[Shape, ...]) -> str:
    """The type of the whole: of its one patch, or a prism, or a pyramid, or mixed."""
    if len(shapes) == 1:
        return shapes[0].type
    frames = [patch.frame(sample_parameters(patch, 9)) for patch in chain.patches]
    if all(shape.type == "plane" for shape in shapes) and all(j.smooth for j in chain.joints):
        return "plane"
    if all(shape.type == "tangent" for shape in shapes) and all(j.smooth for j in chain.joints):
        return "tangent"
    e = np.concatenate([frame.e for frame in frames])
    c0 = np.concatenate([frame.c0 for frame in frames])
    if np.linalg.norm(e - e[0], axis=1).max() <= EXACT:
        return "cylinder"
    across = np.eye(3) - e[:, :, None] * e[:, None, :]
    apex = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, c0))
    missed = np.linalg.norm(np.einsum("nij,nj->ni", across, apex - c0), axis=1).max()
    size = float(np.linalg.norm(np.ptp(c0, axis=0))) + float(np.linalg.norm(apex - c0[0]))
    return "cone" if missed <= EXACT * size else "mixed"
