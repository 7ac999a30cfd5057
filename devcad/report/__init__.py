"""The report: everything that an export proves about itself, as one JSON document."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from devcad import __version__
from devcad.checks import Check
from devcad.export import Written
from devcad.geometry.seams import Meeting
from devcad.part import Panel, Part

PANEL_FACTS = (
    "type",
    "causal",
    "closed",
    "closes",
    "closing_angle_deg",
    "orientable",
    "watertight",
    "apex",
    "area",
    "flat_area",
    "flat_bbox",
    "min_radius",
    "max_twist_deg",
    "max_crease_deg",
    "relaxed_mm",
    "k_neutral",
    "k_source",
    "clearance",
    "singularities",
    "regression",
    "ruling_count",
    "cut_length",
    "pierces",
    "mass_g",
    "lorentz_area",
    "figures",
    "notes",
)
"""The keys of a panel's facts that the report repeats, in its order; design.md section 6."""

SvgOrigin = dict[str, tuple[float, float]]
"""Panel name to the pattern's origin in its SVG file, mm."""


def make_report(
    part: Part,
    *,
    checks: Iterable[Check],
    files: Sequence[Written] = (),
    svg_origin: SvgOrigin | None = None,
) -> dict[str, Any]:
    """The report as a tree of plain values: lengths in mm, areas in mm2, None for what does not
    exist, no NaN, no infinity.

    ``files`` must exist, in one folder; they are named relative to it. A check that has failed
    here was allowed: its name stands in its panel's ``allowed``. One panel's origin in its SVG
    file is a pair, those of several a table by panel name.
    """
    every = list(checks)
    origin: Any = svg_origin
    if svg_origin is not None and len(part.panels) == 1:
        origin = svg_origin[part.panels[0].name]
    report = {
        "devcad": __version__,
        "job": part.name,
        "job_sha256": part.job_sha256 or None,
        "units": "mm",
        "panels": [_panel(panel, every) for panel in part.panels],
        "seams": [_seam(meeting) for meeting in part.seams],
        "checks": [check_entry(check) for check in every],
        "files": [file_entry(written) for written in files],
        "svg_origin": origin,
    }
    if part.linkages:
        from devcad.mechanisms import mechanism_rows

        report["mechanisms"] = mechanism_rows(part)
        from devcad.simulate.figures import figures
        from devcad.simulate.motion import motion

        report["motion"] = [figures(motion(linkage)) for linkage in part.linkages]
    told: dict[str, Any] = plain(report)
    return told


def to_bytes(report: Any) -> bytes:
    """The report as UTF-8 JSON, the same bytes for the same report."""
    text = json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False)
    return f"{text}\n".encode()


def _panel(panel: Panel, checks: Sequence[Check]) -> dict[str, Any]:
    allowed = {check.name for check in checks if not check.passed and check.panel == panel.name}
    return {
        "name": panel.name,
        "kind": panel.kind,
        **{key: panel.facts.get(key) for key in PANEL_FACTS},
        **({"folds": panel.facts["folds"]} if panel.folds else {}),
        "allowed": sorted(allowed),
    }


def _seam(meeting: Meeting) -> dict[str, Any]:
    return {
        "edges": [".".join(edge) for edge in meeting.edges],
        "gap": meeting.gap,
        "matched": meeting.matched,
        "joined": meeting.joined,
        "length": list(meeting.length),
        **({"stitches": meeting.stitches} if meeting.stitches else {}),
    }


def check_entry(check: Check) -> dict[str, Any]:
    """A check as the report has it."""
    return {
        "name": check.name,
        "panel": check.panel,
        "value": check.value,
        "limit": check.limit,
        "unit": check.unit,
        "passed": check.passed,
        "where": asdict(check.where),
    }


def file_entry(written: Written) -> dict[str, Any]:
    """A file as the report has it: named relative to its folder, with its hash."""
    data = written.path.read_bytes()
    return {
        "path": written.path.name,
        "format": written.format,
        "sha256": hashlib.sha256(data).hexdigest(),
        "bytes": len(data),
        "max_deviation": written.max_deviation,
        **({"note": written.note} if written.note else {}),
    }


def plain(value: Any) -> Any:
    """Numbers, texts, lists and tables that JSON has: numpy's own turned, NaN and infinity None."""
    if isinstance(value, dict):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
