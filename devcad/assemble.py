"""From patches to a Part: chains, checks, patterns and meshes of every panel.

One way, for every construction alike: link the patches, prove that they are developable and
regular, develop, bend, place rulings, mesh, and prove the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from devcad.checks import Check, require
from devcad.errors import DevcadError, GeometryError
from devcad.facts import panel_facts
from devcad.flatten.bend import bent
from devcad.flatten.development import Development, develop_chain
from devcad.flatten.outline import lay_out
from devcad.geometry.chain import Chain, cut_at, link, parallel_chain, with_gap
from devcad.geometry.classify import Shape, classify
from devcad.geometry.layers import at_apex
from devcad.geometry.patch import Patch
from devcad.geometry.rulings import place
from devcad.geometry.taylor import Array
from devcad.mesh.build import build_mesh
from devcad.part import Panel, Part
from devcad.proofs import prove_pattern, prove_surface

STEEPEST_MITRE = np.radians(150.0)
"""A crease of a thick sheet beyond this has no sensible mitre (design.md, section 7)."""


@dataclass(frozen=True, slots=True)
class PanelSpec:
    """A panel as its construction made it: patches in the job's units, and how to cut it.

    ``gap`` is in mm; ``place`` is a rigid motion (4, 4) applied last, or None.
    """

    name: str
    kind: str
    patches: tuple[Patch, ...]
    base_closed: bool
    mm_per_unit: float
    cut: float | None
    gap: float
    place: Array | None


def assemble(
    name: str,
    specs: Sequence[PanelSpec],
    *,
    thickness: float,
    reference: str,
    tolerance: float,
    bend: float,
    smallest_bend: float | None = None,
    allow: frozenset[str] = frozenset(),
) -> Part:
    """The part made of these panels, with every geometric check it passed.

    Args:
        thickness: of the sheet in mm, 0 for a surface.
        reference: which face the patches describe: "middle", "front" or "back".
        tolerance: the largest distance in mm of anything exported from the true surface.
        bend: 0 flat to 1 bent; the pattern is the same for all.
        smallest_bend: the material's smallest inside radius in mm, where one is known.
        allow: names of checks that may fail.
    Raises:
        GeometryError, CheckFailed: with the panel's name.
    """
    panels, checks = [], []
    for spec in specs:
        try:
            panel, proven = _panel(
                spec,
                thickness=thickness,
                reference=reference,
                tolerance=tolerance,
                bend=bend,
                smallest_bend=smallest_bend,
                allow=allow,
            )
        except DevcadError as error:
            if len(specs) > 1:
                error.panel = error.panel or spec.name
            raise
        panels.append(panel)
        checks += proven
    if len(panels) == 1:  # a job of one panel need not be told which
        checks = [replace(check, panel=panels[0].name) for check in checks]
    return Part(name, tuple(panels), thickness, tolerance, tuple(checks))


def _panel(
    spec: PanelSpec,
    *,
    thickness: float,
    reference: str,
    tolerance: float,
    bend: float,
    smallest_bend: float | None,
    allow: frozenset[str],
) -> tuple[Panel, list[Check]]:
    layers = (-0.5 * thickness, 0.5 * thickness) if thickness else (0.0,)
    described = _described(spec, tolerance)
    checks = prove_surface(spec.name, described, (0.0,), reaches_apex=False)
    require(checks, allow)
    middle = _middle(described, thickness, reference)
    if spec.gap:
        middle = with_gap(middle, spec.gap)
    elif thickness and not middle.orientable:
        raise GeometryError(
            "a Moebius band closed without a gap has no inside for its thickness",
            remedy="open it with gap, or give it no thickness",
        )
    shapes = tuple(classify(patch) for patch in middle.patches)
    apex = _reaches_apex(middle, shapes)
    if thickness:
        _refuse_creases(middle, shapes)
        _refuse_thick_apex(shapes, apex)
        checks = prove_surface(spec.name, middle, layers, reaches_apex=any(apex))
        require(checks, allow)
    developments = develop_chain(middle)
    chain = middle if bend == 1.0 else bent(middle, developments, bend)
    placements = [place(patch, layers, tolerance) for patch in chain.patches]
    rulings = tuple(p.t for p in placements)
    pattern = lay_out(middle, developments, rulings)
    deviation = max(p.deviation for p in placements)
    flat = _flat(developments)
    mesh = build_mesh(chain, rulings, layers, flat, deviation)
    shapes3d = shapes if bend == 1.0 else tuple(classify(patch) for patch in chain.patches)
    panel = Panel(spec.name, spec.kind, chain, shapes3d, thickness, rulings, mesh, pattern)
    checks += prove_pattern(
        panel, middle, developments, tolerance=tolerance, smallest_bend=smallest_bend
    )
    require(checks, allow)
    failed = sorted({check.name for check in checks if not check.passed})
    facts: dict[str, Any] = panel_facts(panel, middle, shapes, checks, any(apex), failed)
    return replace(panel, facts=facts), checks


def _described(spec: PanelSpec, tolerance: float) -> Chain:
    """The surface that the job describes, in mm, in its place, opened at its cut."""
    matrix = np.eye(4) if spec.place is None else spec.place
    patches = tuple(patch.transformed(matrix, spec.mm_per_unit) for patch in spec.patches)
    chain = link(patches, base_closed=spec.base_closed, tolerance=tolerance)
    return chain if spec.cut is None else cut_at(chain, spec.cut)


def _middle(chain: Chain, thickness: float, reference: str) -> Chain:
    """The middle surface of a sheet whose ``reference`` face the chain is."""
    if not thickness or reference == "middle":
        return chain
    return parallel_chain(chain, -0.5 * thickness if reference == "front" else 0.5 * thickness)


def _flat(developments: tuple[Development, ...]) -> Any:
    def places(number: int, t: Array, v: Array) -> Array:
        return developments[number].points(t, v)

    return places


def _reaches_apex(chain: Chain, shapes: tuple[Shape, ...]) -> tuple[bool, ...]:
    """Per patch, whether its extent ends at a point where all its rulings meet."""
    out = []
    for patch, shape in zip(chain.patches, shapes, strict=True):
        frame = patch.frame(np.linspace(*patch.domain, 17)[1:-1])
        singular = at_apex(frame, frame.v_from) or at_apex(frame, frame.v_to)
        out.append(singular and shape.type in ("cone", "plane"))
    return tuple(out)


def _refuse_creases(chain: Chain, shapes: tuple[Shape, ...]) -> None:
    """Thick creases are mitred between straight-sided planes up to 150 degrees, else refused."""
    around = list(chain.joints) + ([chain.closing] if chain.closing else [])
    for k, joint in enumerate(around):
        if joint.smooth:
            continue
        after = (k + 1) % len(shapes)
        t = float(chain.patches[after].domain[0])
        angle = float(np.degrees(abs(joint.angle)))
        planes = shapes[k].type == "plane" and shapes[after].type == "plane"
        if not planes or not _straight(chain.patches[k]) or not _straight(chain.patches[after]):
            raise GeometryError(
                f"a crease of {angle:.4g} deg at t = {t:.6g} in a sheet with thickness, between "
                "faces that are not plane with straight edges",
                value=angle,
                remedy="round it with corner_radius, or give the part no thickness",
            )
        if abs(joint.angle) > STEEPEST_MITRE:
            raise GeometryError(
                f"a crease of {angle:.4g} deg at t = {t:.6g} in a sheet with thickness, "
                "limit 150 deg",
                value=angle,
                limit=150.0,
                remedy="round it with corner_radius",
            )


def _refuse_thick_apex(shapes: tuple[Shape, ...], apex: tuple[bool, ...]) -> None:
    for shape, reached in zip(shapes, apex, strict=True):
        if reached and shape.half_angle is None:
            raise GeometryError(
                "regular: the layers of a thick sheet end apart from one another at the apex of "
                "a cone that is not a right circular one",
                remedy="begin the extent a little above the apex, or give the part no thickness",
            )


def _straight(patch: Patch) -> bool:
    """Whether both rails are straight lines within 1e-9 of their length."""
    jet = patch.jet(np.linspace(*patch.domain, 9), 0)
    for rail in (jet.rail(jet.v_from)[0], jet.rail(jet.v_to)[0]):
        chord = rail[-1] - rail[0]
        away = np.linalg.norm(np.cross(rail - rail[0], chord), axis=1)
        if away.max() > 1e-9 * float(chord @ chord):
            return False
    return True
