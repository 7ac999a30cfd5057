"""The figures of a motion, as the report tells them: degrees and mm."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from devcad.simulate.drives import FourBarDrive, RingDrive
from devcad.simulate.fourbar import (
    grashof,
    output_toggles,
    toggles,
    transmission,
    transmission_extremes,
    wrapped,
)
from devcad.simulate.motion import Motion, track

Figures = dict[str, Any]

SAMPLES = 721


def figures(motion: Motion) -> Figures:
    """The report's entry of a mechanism: angles in degrees, lengths in mm.

    Pairs of ranges are clockwise, counterclockwise, both as turns >= 0 of the input from the
    conformal pose.
    """
    linkage = motion.linkage
    out: Figures = {
        "panels": list(linkage.panels),
        "links": [link.name for link in linkage.links],
        "degrees_of_freedom": motion.freedom,
    }
    if isinstance(motion.drive, FourBarDrive):
        out |= _four_bar(motion, motion.drive)
    else:
        out |= {"class": None if motion.drive is None else "ring"}
    if isinstance(motion.drive, RingDrive):
        out["joints_to_axis"] = _radii(motion)
    if motion.directions:
        out |= _range(motion)
        out["departures"] = _departures(motion)
    return out | {"notes": list(motion.notes)}


def _four_bar(motion: Motion, drive: FourBarDrive) -> Figures:
    bar = drive.bar
    kind = grashof(bar)
    low, high = motion.stretch()
    start = drive.start[0]
    least, most = transmission_extremes(bar, start + low, start + high)
    (opened,) = transmission(bar, np.array([start])).tolist()
    return {
        "class": kind.kind,
        "grashof_excess": kind.excess,
        "shortest": kind.shortest,
        "input_turns": kind.input_turns,
        "output_turns": kind.output_turns,
        "lengths": dict(zip(("ground", "input", "coupler", "output"), bar.lengths, strict=True)),
        "conformal": {
            "branch": drive.branch,
            **{
                f"{name}_deg": math.degrees(angle)
                for name, angle in zip(("input", "coupler", "output"), drive.start, strict=True)
            },
        },
        "toggles": [
            {
                "input_deg": math.degrees(toggle.angle),
                "turn_deg": math.degrees(float(wrapped(np.array(toggle.angle - start)))),
                "coupler_and_output": toggle.shape,
            }
            for toggle in toggles(bar)
        ],
        "output_extremes": [
            {"output_deg": math.degrees(toggle.angle), "input_and_coupler": toggle.shape}
            for toggle in output_toggles(bar)
        ],
        "transmission_deg": {
            "conformal": math.degrees(opened),
            "least": math.degrees(least),
            "largest": math.degrees(most),
        },
    }


def _radii(motion: Motion) -> list[list[float]]:
    """The least and the largest distance from the axis of joints 0, 2, ... and of the others, over
    the range between stops, in mm: a ring of equal links folds to one and opens to the other."""
    size = np.abs(track(motion, np.linspace(*motion.stretch(), SAMPLES)).joints[:, :2])
    return [[float(size[:, k].min()), float(size[:, k].max())] for k in (0, 1)]


def _range(motion: Motion) -> Figures:
    names = [link.name for link in motion.linkage.links]
    return {
        "range_deg": [math.degrees(way.reach) for way in motion.directions],
        "range_ends": [way.end for way in motion.directions],
        "mobility": motion.mobility,
        "mobility_first_order": motion.first_order,
        "outside_deg": [math.degrees(way.outside) for way in motion.directions],
        "inside_deg": [math.degrees(way.inside) for way in motion.directions],
        "interference": [
            None
            if way.clash is None
            else {
                "links": [names[k] for k in way.clash.links],
                "turn_deg": math.degrees(way.clash.angle),
            }
            for way in motion.directions
        ],
        "overlaps": [[names[i], names[j]] for i, j in motion.overlaps],
    }


def _departures(motion: Motion) -> list[Figures]:
    """Of each link: to which side it goes when the input turns counterclockwise, its radial speeds
    in mm a degree, and its instant centre in the cross-section."""
    return [
        {
            "link": link.name,
            "side": found.side,
            "radial_mm_per_deg": [math.radians(found.least), math.radians(found.largest)],
            "instant_centre": None
            if found.centre is None
            else [found.centre.real, found.centre.imag],
        }
        for link, found in zip(motion.linkage.links, motion.departures, strict=True)
    ]
