"""From patches to a panel of one chain: its checks, its pattern and its mesh.

One way, for every construction alike: link the patches, prove that they are developable and
regular, develop, bend, place rulings, mesh, and prove the result.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from devcad.checks import FOLLOWS, Check, require
from devcad.errors import GeometryError
from devcad.facts import neutral_figures, panel_facts, rail_facts, strain
from devcad.features import Features
from devcad.flatten.bend import bent
from devcad.flatten.blank import Blank, lay_flat
from devcad.flatten.lorentz import Spacetime
from devcad.flatten.neutral import Fibre
from devcad.flatten.outline import lay_out, sheet_area
from devcad.geometry.chain import SMOOTH, Chain, cut_at, link, with_gap
from devcad.geometry.classify import Shape, classify, patch_box
from devcad.geometry.cuts import Cut, opened
from devcad.geometry.drawing import Drawing, carried
from devcad.geometry.layers import at_apex, pull_of
from devcad.geometry.parallel import parallel_chain
from devcad.geometry.patch import Patch
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.rulings import place, strip_deviation
from devcad.geometry.taylor import Array
from devcad.mesh.build import build_mesh
from devcad.mesh.mesh import Mesh
from devcad.mesh.stations import Flat
from devcad.part import Panel
from devcad.proofs import prove_pattern, prove_surface, volume_error

if TYPE_CHECKING:  # what most jobs do not ask for is loaded where one does
    from devcad.geometry.constructions.base import Flank
    from devcad.geometry.fillets import Corner
    from devcad.shop.limits import Bounds
    from devcad.shop.pressbrake import Pressed
    from devcad.shop.settings import Bends

FLOAT32 = float(np.sqrt(3.0)) * 2.0**-24
"""Largest distance that rounding to float32 moves a point, per unit of its largest coordinate."""
ATTEMPTS = 4
"""How often the rulings are placed anew for the sake of a thick sheet's volume."""
NOTHING = 1e-9
"""A panel of which cutouts leave less than this share is gone."""


@dataclass(frozen=True, slots=True)
class PanelSpec:
    """A panel as its construction made it: patches in the job's units, and how to cut it.

    ``gap`` is in mm; ``place`` is a rigid motion (4, 4) applied last, or None. ``drawings`` are
    in the job's units too; ``figures`` (in mm) and ``notes`` go to the report as they are.
    ``flanks`` are further chains of the sheet, and ``groove`` (mm) is what parts them where the
    sheet is thick, None for as little as it takes.
    """

    name: str
    kind: str
    patches: tuple[Patch, ...]
    base_closed: bool
    mm_per_unit: float
    cut: float | None
    gap: float
    place: Array | None
    drawings: tuple[Drawing, ...] = ()
    figures: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    rail_fit: RailFit | None = None
    features: Features = field(default_factory=Features)
    flanks: tuple[Flank, ...] = ()
    groove: float | None = None


@dataclass(frozen=True, slots=True)
class Making:
    """How panels are made: ``thickness`` of the sheet in mm, 0 for a surface; the ``reference``
    face that the patches describe ("middle", "front" or "back"); the ``tolerance``, the largest
    distance in mm of anything exported from the true surface; ``bend``, 0 flat to 1 bent.

    ``fibre`` keeps its length when the sheet is bent: the pattern is its development, or the
    middle's where it is None. ``limits`` are the shop's. ``allow`` names checks that may fail.
    ``inside_radius`` (mm) is that of every crease, None where creases are sharp. ``bends`` say how
    a press brake bends the sheet, None where it is rolled.
    """

    thickness: float = 0.0
    reference: str = "middle"
    tolerance: float = 0.05
    bend: float = 1.0
    fibre: Fibre | None = None
    limits: Bounds | None = None
    allow: frozenset[str] = frozenset()
    inside_radius: float | None = None
    bends: Bends | None = None

    @property
    def layers(self) -> tuple[float, ...]:
        """The distances along n of what is meshed: both skins, or the surface."""
        return (-0.5 * self.thickness, 0.5 * self.thickness) if self.thickness else (0.0,)


@dataclass(frozen=True, slots=True)
class Stuff:
    """The middle surface of a panel, proven: what its patches are and which reach an apex, what is
    drawn on it, its features, the checks that it passed, and where its bends want relief."""

    middle: Chain
    shapes: tuple[Shape, ...]
    apex: tuple[bool, ...]
    drawings: tuple[Drawing, ...]
    features: Features
    checks: list[Check]
    corners: tuple[Corner, ...] = ()


def panel_of(spec: PanelSpec, how: Making) -> tuple[Panel, Blank, list[Check]]:
    """A panel of one chain, its blank, and the checks that it passed.

    Raises:
        GeometryError, CheckFailed: it cannot be made as it is described.
    """
    how = lenient(spec, how)
    stuff = stuff_of(spec, how)
    return made(spec, how, stuff, lay_flat(stuff.middle, how.fibre))


def lenient(spec: PanelSpec, how: Making) -> Making:
    """How to make a panel of which a twist is accepted: with what follows from it."""
    if spec.rail_fit is None or spec.rail_fit.max_twist is None:
        return how
    return replace(how, allow=how.allow | set(FOLLOWS["twist"]))


def made(
    spec: PanelSpec,
    how: Making,
    stuff: Stuff,
    blank: Blank,
    standing: Chain | None = None,
    rulings: tuple[Array, ...] | None = None,
) -> tuple[Panel, Blank, list[Check]]:
    """The panel of a proven middle surface and its blank; and its checks.

    ``standing`` is the surface as it stands in space where that is known already, ``rulings`` are
    its own.
    """
    middle = stuff.middle
    cuts: tuple[Cut, ...] = ()
    marks: tuple[Drawing, ...] = ()
    features = stuff.features
    reliefs: tuple[str, ...] = ()
    if stuff.corners and how.inside_radius:
        from devcad.flatten.relief import relieved

        features, reliefs = relieved(
            features, stuff.corners, blank, how.thickness, how.inside_radius
        )
    if features.cutouts or features.marks:
        from devcad.flatten.laying import laid

        cuts, marks = laid(features, blank.divided, blank.developments, blank.jumps)
    brake = None if how.bends is None else _pressed(spec.name, blank, how, how.bends)
    chain = standing or middle
    if brake:
        chain = brake.chain
    elif standing is None and how.bend != 1.0:
        chain = bent(blank, how.bend)
    # what ran over the seam of a tube ends at the edges of the open sheet that it becomes
    holes = opened(cuts, middle.patches) if middle.closed and not chain.closed else cuts
    shapes = shapes3d = stuff.shapes
    if chain is not middle:
        shapes3d = tuple(classify(patch) for patch in chain.patches)
    if brake:
        holes = brake.carried(holes)
        if how.thickness:
            from devcad.geometry.thickness import refuse_creases

            refuse_creases(chain, shapes3d, how.layers[-1])
    mesh, rulings = meshed(chain, how, brake.places if brake else blank.points, holes, rulings)
    pattern = lay_out(
        blank.chain,
        blank.developments,
        rulings,
        (*stuff.drawings, *marks),
        cuts,
        bending=middle.patches,
        bends=brake.lines if brake else None,
    )
    panel = Panel(spec.name, spec.kind, chain, shapes3d, how.thickness, rulings, mesh, pattern)
    panel = replace(panel, spacetime=_spacetime(spec, middle), cuts=holes, blank=blank)
    if brake:
        panel = replace(panel, bends=brake.bends, facets=tuple(z.flat for z in brake.zones))
    if not blank.isometric if brake is None else not brake.exact:
        panel = replace(panel, surface_area=sheet_area(chain, holes))
    checks = stuff.checks + prove_pattern(panel, blank, tolerance=how.tolerance)
    if brake:
        checks = brake.proven(checks)
    if how.limits is not None:
        from devcad.shop.limits import limit_checks

        bent_to = brake.limited if brake else middle
        checks += limit_checks(panel, bent_to, how.fibre, how.limits)
    require(checks, how.allow)
    failed = sorted({check.name for check in checks if not check.passed})
    facts: dict[str, Any] = panel_facts(panel, middle, shapes, checks, any(stuff.apex), failed)
    if brake and not brake.exact:
        facts["area"] = sheet_area(brake.full, holes)
    elif not blank.isometric and not brake:
        facts["area"] = sheet_area(middle, cuts)  # bent to the end, whatever ``bend`` is
    figures = {**spec.figures, **strain(checks), **neutral_figures(blank)}
    figures |= brake.figures if brake else {}
    told = brake.notes if brake else ()
    facts |= {"figures": figures, "notes": [*spec.notes, *reliefs, *told]}
    if spec.rail_fit is not None:
        facts |= rail_facts(spec.rail_fit, spec.mm_per_unit)
    return replace(panel, facts=facts), blank, checks


def _pressed(name: str, blank: Blank, how: Making, bends: Bends) -> Pressed:
    from devcad.shop.pressbrake import pressed

    return pressed(
        name,
        blank,
        bends,
        thickness=how.thickness,
        bend=how.bend,
        tolerance=how.tolerance,
        flow=how.limits.springback if how.limits else None,
    )


def stuff_of(spec: PanelSpec, how: Making) -> Stuff:
    """The middle surface of a panel in space, proven and with its gap."""
    thickness, layers = how.thickness, how.layers
    described, drawings, features = _described(spec, how.tolerance)
    checks = prove_surface(spec.name, described, (0.0,), reaches_apex=False, fit=spec.rail_fit)
    require(checks, how.allow)
    gap = spec.gap
    corners: tuple[Corner, ...] = ()
    if how.inside_radius and described.creased:
        from devcad.geometry.fillets import bends_made

        described, corners = bends_made(
            described, how.inside_radius, thickness, how.reference, gap=gap, drawings=drawings
        )
        gap = 0.0
    middle = _middle(described, thickness, how.reference)
    if gap:
        middle = with_gap(middle, gap)
    elif thickness and middle.closes is False and (middle.closing_angle or 0.0) <= SMOOTH:
        raise GeometryError(
            "the extent does not return to its start although the ruling does: the walls at both "
            "ends of a sheet with thickness would lie in one another",
            remedy="make the extent the same at both ends, or give the part no thickness",
        )
    elif thickness and not middle.orientable:
        raise GeometryError(
            "a Moebius band closed without a gap has no inside for its thickness",
            remedy="open it with gap, or give it no thickness",
        )
    shapes = tuple(classify(patch) for patch in middle.patches)
    apex = reaches_apex(middle, shapes)
    if thickness:
        from devcad.geometry.thickness import (
            refuse_creases,
            refuse_layers_apart,
            refuse_thick_apex,
        )

        if how.bends is None:  # off the brake faces are plane
            refuse_creases(middle, shapes, layers[-1])
        refuse_thick_apex(shapes, apex)
        refuse_layers_apart(middle, layers)
        checks = prove_surface(spec.name, middle, layers, reaches_apex=any(apex), fit=spec.rail_fit)
        require(checks, how.allow)
    return Stuff(middle, shapes, apex, drawings, features, checks, corners)


def _described(spec: PanelSpec, tolerance: float) -> tuple[Chain, tuple[Drawing, ...], Features]:
    """The surface that the job describes, in mm, in its place, trimmed and opened at its cut;
    what is drawn on it; and the features, in its place too."""
    matrix = np.eye(4) if spec.place is None else spec.place
    patches = tuple(patch.transformed(matrix, spec.mm_per_unit) for patch in spec.patches)
    drawings = tuple(drawing.scaled(spec.mm_per_unit) for drawing in spec.drawings)
    features, base_closed = spec.features.moved(matrix), spec.base_closed
    for trim in features.trims:
        from devcad.geometry.trimming import trimmed

        try:
            left = trimmed(patches, trim.point, trim.normal, base_closed=base_closed)
        except GeometryError as error:
            raise error.at(place=trim.place) from None
        patches, base_closed, drawings = left.patches, left.base_closed, left.carried(drawings)
    chain = link(patches, base_closed=base_closed, tolerance=tolerance)
    if spec.cut is None:
        return chain, drawings, features
    opened = cut_at(chain, spec.cut)
    return opened, carried(drawings, chain, opened, spec.cut), features


def _spacetime(spec: PanelSpec, middle: Chain) -> Spacetime | None:
    """The middle surface with the time axis, which its place turns, if it has one."""
    if middle.patches[0].causal is None:
        return None
    return Spacetime(middle, np.eye(3)[2] if spec.place is None else spec.place[:3, 2])


def _middle(chain: Chain, thickness: float, reference: str) -> Chain:
    """The middle surface of a sheet whose ``reference`` face the chain is."""
    if not thickness or reference == "middle":
        return chain
    return parallel_chain(chain, -0.5 * thickness if reference == "front" else 0.5 * thickness)


def meshed(
    chain: Chain,
    how: Making,
    places: Flat,
    cuts: tuple[Cut, ...],
    given: tuple[Array, ...] | None = None,
) -> tuple[Mesh, tuple[Array, ...]]:
    """The mesh within the tolerance, what float32 will round off taken away, and its rulings: the
    fewest, or those that are ``given``.

    A very thick sheet's volume needs more rulings than the distance does: then as many as keep
    it within area x tolerance. So do triangles between the edges of holes, now and then.
    """
    layers, tolerance = how.layers, how.tolerance
    limit = aim = aim_of([chain], how)
    area = sheet_area(chain, cuts)
    if area <= NOTHING * sheet_area(chain, ()):
        raise GeometryError("the cutouts leave nothing of the panel", remedy="make them smaller")
    pulls = [pull_of(chain, number, layers[-1]) for number in range(len(chain.patches))]
    if given is not None:
        deviation = max(
            float(strip_deviation(patch, layers, t, pull).max())
            for patch, t, pull in zip(chain.patches, given, pulls, strict=True)
        )
        return build_mesh(chain, given, layers, places, deviation, cuts, aim), given
    for _ in range(ATTEMPTS):
        every = zip(chain.patches, pulls, strict=True)
        placements = [place(patch, layers, aim, pull) for patch, pull in every]
        rulings = tuple(placement.t for placement in placements)
        deviation = max(placement.deviation for placement in placements)
        mesh = build_mesh(chain, rulings, layers, places, deviation, cuts, aim)
        excess = volume_error(mesh, chain, area, how.thickness) / tolerance
        excess = max(excess, mesh.deviation / limit)
        if excess <= 1.0:
            break
        aim *= 0.95 / excess
    return mesh, rulings


def aim_of(chains: Sequence[Chain], how: Making) -> float:
    """The tolerance of meshes in mm, without what float32 will round off."""
    boxes = (patch_box(patch) for chain in chains for patch in chain.patches)
    reach = max(float(np.abs(box).max()) for box in boxes)
    rounding = FLOAT32 * (reach + abs(how.layers[0]))
    return max(how.tolerance - rounding, 0.5 * how.tolerance)


def reaches_apex(chain: Chain, shapes: tuple[Shape, ...]) -> tuple[bool, ...]:
    """Per patch, whether its extent ends at a point where all its rulings meet."""
    out = []
    for patch, shape in zip(chain.patches, shapes, strict=True):
        frame = patch.frame(np.linspace(*patch.domain, 17)[1:-1])
        singular = at_apex(frame, frame.v_from) or at_apex(frame, frame.v_to)
        out.append(singular and shape.type in ("cone", "plane"))
    return tuple(out)
