"""What ``devcad fold`` says: the JSON of a simulation, and its lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from devcad import __version__
from devcad.export import Written
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part
from devcad.report import file_entry, plain
from devcad.simulate.material import Material
from devcad.simulate.outcome import Outcome, State
from devcad.simulate.settings import Simulation

ELASTIC = 0.02
"""A strain that metals, board and stiff plastics do not come back from."""


def fold_report(
    part: Part,
    panel: Panel,
    how: Simulation,
    material: Material,
    outcome: Outcome,
    *,
    files: Sequence[Written],
    notes: Sequence[str],
) -> dict[str, Any]:
    """The report of a simulation as a tree of plain values: mm, N, N mm, N/mm2, degrees; None for
    what does not exist. ``files`` must exist."""
    net, last = outcome.net, outcome.states[-1]
    below = sum(value < 0.0 for value in (*outcome.modes, *outcome.frequencies))
    if below:
        notes = [*notes, f"{below} modes lie below 0: there the model gives way by itself"]
    strain = max(state.strain for state in outcome.states)
    if strain > ELASTIC:
        notes = [*notes, f"strains reach {100 * strain:.3g} %: few sheets are elastic so far"]
    report = {
        "devcad": __version__,
        "job": part.name,
        "job_sha256": part.job_sha256 or None,
        "units": {"length": "mm", "force": "N", "energy": "N mm", "stiffness": "N/mm"},
        "panel": panel.name,
        "kind": panel.kind,
        "model": {
            "coefficients": how.coefficients,
            "length_scale": how.length_scale,
            "nodes": len(net.flat),
            "cells": len(net.strips),
            "bars": outcome.bars,
            "hinges": outcome.hinges,
            "creases": len(net.creases),
        },
        "material": {"name": part.material or None, **asdict(material)},
        "steps": [_state(number, state) for number, state in enumerate(outcome.states)],
        "energies": last.energies,
        "distance": {"furthest": last.furthest, "rms": last.rms},
        "folds": _folds(outcome),
        "applied": outcome.applied,
        "reactions": [
            {"support": support.where.key, "force": force, "moment": moment}
            for support, force, moment in zip(
                how.supports, outcome.reactions, outcome.turning, strict=True
            )
        ],
        "loads": [
            {
                "load": load.key,
                "force": load.force,
                "displacement": load.displacement,
                "stiffness_before": load.stiffness[0],
                "stiffness": load.stiffness[1],
            }
            for load in outcome.loads
        ],
        "modes": {"stiffness": outcome.modes or None, "hertz": outcome.frequencies or None},
        "notes": list(notes),
        "files": [file_entry(written) for written in files],
    }
    told: dict[str, Any] = plain(report)
    return told


def _state(number: int, state: State) -> dict[str, Any]:
    return {
        "step": number,
        "phase": state.phase,
        "share": state.share,
        "energies": state.energies,
        "residual": state.residual,
        "scale": state.scale,
        "iterations": state.iterations,
        "method": state.method,
        "stable": state.stable,
        "largest_strain": state.strain,
        "distance": {"furthest": state.furthest, "rms": state.rms},
    }


def _folds(outcome: Outcome) -> dict[str, Any] | None:
    """The fold angles along the creases, wanted and reached, and the moment that they bear."""
    wanted, reached = outcome.angles
    if not len(wanted):
        return None
    return {
        "wanted_deg": _spread(np.degrees(wanted)),
        "reached_deg": _spread(np.degrees(reached)),
        "moment_N_mm_per_mm": _spread(outcome.moments),
    }


def _spread(values: Array) -> dict[str, float]:
    return {
        "least": float(values.min()),
        "mean": float(values.mean()),
        "most": float(values.max()),
    }


def fold_lines(report: dict[str, Any], out: str) -> Iterable[str]:
    """What a person reads: the files, and what the simulation came to."""
    for file in [*report["files"], {"path": f"{report['job']}-fold.json"}]:
        yield str(Path(out, report["job"], file["path"]))
    model, last = report["model"], report["steps"][-1]
    yield (
        f"{model['nodes']} nodes, {model['bars']} bars, {model['hinges']} hinges; "
        f"{len(report['steps']) - 1} steps, residual {last['residual']:.2g} N"
    )
    energies = report["energies"]
    parts = ", ".join(f"{kind} {value:.4g}" for kind, value in energies.items())
    yield f"energy {sum(energies.values()):.4g} N mm: {parts}"
    if report["folds"]:
        wanted, reached = report["folds"]["wanted_deg"], report["folds"]["reached_deg"]
        yield f"folds reach {reached['mean']:.4g} of {wanted['mean']:.4g} deg"
    if report["distance"]["furthest"] is not None:
        away = report["distance"]
        yield f"{away['furthest']:.4g} mm from the built shape, rms {away['rms']:.4g} mm"
    for row in report["reactions"]:
        x, y, z = row["force"]
        yield f"{row['support']} holds [{x:.4g}, {y:.4g}, {z:.4g}] N"
    for load in report["loads"]:
        stiff = load["stiffness"]
        shown = "none" if stiff is None else f"{stiff:.4g} N/mm"
        moved = load["displacement"]
        yield f"{load['load']} moves {moved:.4g} mm along its force, stiffness {shown}"
    modes = report["modes"]
    if modes["hertz"]:
        yield f"lowest modes {', '.join(f'{value:.4g}' for value in modes['hertz'])} Hz"
    elif modes["stiffness"]:
        shown = ", ".join(f"{value:.3g}" for value in modes["stiffness"])
        yield f"lowest modes {shown} N/mm"
    for note in report["notes"]:
        yield f"note: {note}"
