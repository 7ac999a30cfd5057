"""Mechanisms of a part: their links found on its panels, and what the report says of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from devcad.features import Cutout, Features, Placing
from devcad.flatten import shapes
from devcad.geometry.constructions.base import Hole
from devcad.geometry.linkage import Linkage, chord
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

OUTWARD = {"middle": 0.0, "front": 0.5, "back": -0.5}
"""Thicknesses from the face that a job describes to the middle, outwards: the front is inside."""


def with_holes(features: Features, holes: Sequence[Hole], mm_per_unit: float) -> Features:
    """The features with a construction's own holes before them."""
    own = [_cutout(hole, k, mm_per_unit) for k, hole in enumerate(holes, start=1)]
    return replace(features, cutouts=(*own, *features.cutouts))


def _cutout(hole: Hole, number: int, mm: float) -> Cutout:
    shape = shapes.rectangle if hole.square else shapes.slot
    contour = shape(mm * hole.length, mm * hole.width)
    return Cutout(f"hinge cut {number}", contour, Placing(at_surface=hole.at), hole.notch)


def standing(
    linkage: Linkage,
    panels: Sequence[str],
    place: Array | None,
    thickness: float,
    reference: str,
) -> Linkage:
    """A linkage (mm) where its ``panels`` are: links at the middles of their sheets, in place."""
    matrix = np.eye(4) if place is None else place
    a, b, c = (tuple(float(x) for x in row) for row in matrix[:3])
    links = tuple(
        replace(link, radius=link.radius + (link.layer + OUTWARD[reference]) * thickness)
        for link in linkage.links
    )
    names = tuple(panels) if len(panels) == len(links) else (panels[0],) * len(links)
    return replace(
        linkage, links=links, thickness=thickness, place=(a, b, c), panels=names  # type: ignore[arg-type]
    )  # fmt: skip


def linked(part: Part, linkages: Sequence[Linkage]) -> Part:
    """The part with its mechanisms, and with what is to be told of each link among its panel's
    figures: lengths in mm, angles in degrees; ``grashof`` is 1 or 0."""
    told: dict[str, dict[str, float]] = {}
    panels = {panel.name: panel for panel in part.panels}
    for linkage in linkages:
        one_sheet = len(set(linkage.panels)) < len(linkage.links)
        for name in linkage.panels:
            told.setdefault(name, _of_mechanism(linkage))
        for k, row in enumerate(link_rows(panels, linkage)):
            prefix = f"link_{k + 1}_" if one_sheet else ""
            numbers = {key: value for key, value in row.items() if isinstance(value, float)}
            told[linkage.panels[k]] |= {f"{prefix}{key}": value for key, value in numbers.items()}
    made = tuple(_told(panel, told.get(panel.name, {})) for panel in part.panels)
    return replace(part, panels=made, linkages=tuple(linkages))


def mechanism_rows(part: Part) -> list[dict[str, Any]]:
    """Each mechanism of a part for the report, its links in order."""
    panels = {panel.name: panel for panel in part.panels}
    return [
        {
            "radius": linkage.radius,
            "conformal": linkage.branch,
            "grashof": linkage.grashof,
            "hinge": linkage.hinge,
            "joints_deg": [math.degrees(joint) for joint in linkage.joints],
            "link_lengths": list(linkage.lengths),
            "links": link_rows(panels, linkage),
        }
        for linkage in part.linkages
    ]


def link_rows(panels: dict[str, Panel], linkage: Linkage) -> list[dict[str, Any]]:
    """What is to be told of each link: ``length`` between its joint axes, ``arc_length`` along
    the circle of the axes, ``flat_spacing`` of its joints in its pattern, and where it lies."""
    rows = []
    for link, name in zip(linkage.links, linkage.panels, strict=True):
        start = linkage.joints[link.first]
        rows.append(
            {
                "name": link.name,
                "panel": name,
                "link_length": chord(linkage.radius, link.sweep),
                "arc_length": linkage.radius * abs(link.sweep),
                "flat_spacing": flat_per_radian(panels[name]) * abs(link.sweep),
                "first_joint_deg": math.degrees(start),
                "last_joint_deg": math.degrees(start + link.sweep),
                "sweep_deg": math.degrees(link.sweep),
                "middle_radius": link.radius,
                "neutral_radius": flat_per_radian(panels[name]),
                "band_from": link.band[0][0],
                "band_to": link.band[0][1],
            }
        )
    return rows


def flat_per_radian(panel: Panel) -> float:
    """The length in the pattern of a link's panel, of a turn by one radian: the radius of the
    fibre that keeps its length. Measured in the pattern."""
    flat = panel.facets or (panel.blank or panel).chain.patches
    start, end = flat[0].domain[0], flat[-1].domain[1]
    first = panel.places(0, np.array([start]), np.zeros(1))
    last = panel.places(len(flat) - 1, np.array([end]), np.zeros(1))
    return float(np.linalg.norm(last - first) / (end - start))


def _of_mechanism(linkage: Linkage) -> dict[str, float]:
    figures = {"conformal_radius": linkage.radius}
    if linkage.grashof is not None:
        figures["grashof"] = float(linkage.grashof)
    return figures


def _told(panel: Panel, figures: dict[str, float]) -> Panel:
    if not figures:
        return panel
    return replace(panel, facts={**panel.facts, "figures": {**panel.facts["figures"], **figures}})
