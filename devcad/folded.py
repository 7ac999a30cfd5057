"""From the flanks of a sheet folded along curved creases to one panel.

Every flank is a chain like any other and proves what any chain proves; together they prove that
they are one sheet: the crease that both sides develop is one curve, in the pattern as in space.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from devcad.checks import Check, Where, at_most, require, worst
from devcad.errors import GeometryError, JobError
from devcad.facts import sheet_facts
from devcad.features import Features
from devcad.flatten.blank import Blank, lay_flat
from devcad.flatten.flanks import Hanging, apart, beside, one_sheet
from devcad.flatten.foldings import creases, groove_width
from devcad.flatten.outline import sheet_area
from devcad.flatten.scores import fine, told
from devcad.flatten.sharing import refuse_in_groove, shared_out
from devcad.geometry.chain import JOINED, Chain
from devcad.geometry.classify import classify, patch_box
from devcad.geometry.creasing import Crease
from devcad.geometry.rulings import place_together
from devcad.geometry.taylor import Array
from devcad.making import (
    ATTEMPTS,
    Making,
    PanelSpec,
    Stuff,
    aim_of,
    lenient,
    made,
    meshed,
    reaches_apex,
    stuff_of,
)
from devcad.mesh.flanked import side_by_side
from devcad.part import Fold, Panel
from devcad.poses import across, standing, ties, without_grooves
from devcad.proofs import overlap, prove_surface, volume_error

SCORE_LIMIT, SCORE_SHARE = 1e-10, 1e-12
"""mm, and share of the sheet's size: how far apart both sides may develop their crease."""
WHOLE = 1e-9
"""An edge of which less than this share is missing is whole."""
MIDDLE = (
    "the pattern is the development of the middle of the sheet: any other neutral fibre would make "
    "the crease longer on one side than on the other"
)
THIN = "without thickness there is no groove: both sides of a crease share it"


@dataclass(frozen=True, slots=True)
class _Sheet:
    """Flanks as surfaces: what they are, how they lie in the pattern, how they hang together."""

    stuffs: tuple[Stuff, ...]
    blanks: tuple[Blank, ...]
    hangings: tuple[Hanging, ...]

    @property
    def middles(self) -> list[Chain]:
        return [stuff.middle for stuff in self.stuffs]

    def creases(self, hanging: Hanging) -> list[Crease]:
        """The crease of a flank, patch by patch."""
        return creases(self.middles, hanging)


def folded(spec: PanelSpec, how: Making) -> tuple[Panel, Blank, list[Check]]:
    """A panel of several flanks, the blank of the first, and the checks that it passed.

    Raises:
        JobError: what is asked for is not done with curved creases.
        GeometryError, CheckFailed: it cannot be made as it is described.
    """
    _refuse(spec, how)
    words = (*((MIDDLE,) if how.fibre else ()), *((THIN,) if _grooveless(spec, how) else ()))
    how = lenient(spec, replace(how, fibre=None))
    specs = [
        replace(spec, patches=patches, flanks=(), figures={}, notes=(), features=Features())
        for patches in (spec.patches, *(flank.patches for flank in spec.flanks))
    ]
    sheet = _laid_out(spec, specs, replace(how, thickness=0.0, bend=1.0))
    chains, notes = _standing(sheet, how.bend)
    along = [crease for hanging in sheet.hangings for crease in sheet.creases(hanging)]
    groove = groove_width(along, spec.groove, how.thickness)
    bodies = _bodies(sheet, chains, groove) if how.thickness else chains
    rulings = _rulings(bodies, how)
    flanks: list[Panel] = []
    every: list[list[Check]] = []
    surface = replace(how, thickness=0.0, bend=1.0)
    own = shared_out(spec.features, sheet.blanks, sheet.hangings)
    for number, chain in enumerate(chains):
        blank, stuff = sheet.blanks[number], replace(sheet.stuffs[number], features=own[number])
        with _told_of_creases(number, sheet.hangings):
            panel, _, proven = made(specs[number], surface, stuff, blank, chain, rulings)
        if how.thickness:
            panel, thick = _thickened(panel, bodies[number], how, groove, rulings)
            proven = worst([thick, proven])
        flanks.append(panel)
        every.append(proven)
    _require_whole(flanks, sheet.hangings)
    panel = _joined(spec, sheet, flanks, how)
    checks = worst([*every, [_score(spec.name, sheet), overlap(panel)]])
    require(checks, how.allow)
    figures = {**spec.figures, **({"groove": groove} if how.thickness else {})}
    facts = sheet_facts(panel, checks, figures, (*spec.notes, *notes, *words))
    return replace(panel, facts=facts), sheet.blanks[0], checks


def _grooveless(spec: PanelSpec, how: Making) -> bool:
    """Whether a groove is asked for that a sheet without thickness does not have."""
    return spec.groove is not None and not how.thickness


def _refuse(spec: PanelSpec, how: Making) -> None:
    """Raise a JobError for what is not done with curved creases."""
    asked = {
        "a press brake": how.bends is not None,
        'reference = "front" or "back"': bool(how.thickness) and how.reference != "middle",
        "a gap": spec.gap > 0.0,
    }
    for what, given in asked.items():
        if given:
            raise JobError(
                f"a sheet with curved creases takes no such thing: {what}",
                value=what,
                remedy="leave it out" if "reference" not in what else 'use reference = "middle"',
            )


def _laid_out(spec: PanelSpec, specs: Sequence[PanelSpec], how: Making) -> _Sheet:
    """The flanks as proven surfaces in space and in one pattern."""
    hangings = tuple((flank.parent, k, flank.side) for k, flank in enumerate(spec.flanks, start=1))
    stuffs = tuple(stuff_of(each, how) for each in specs)
    middles = [stuff.middle for stuff in stuffs]
    blanks = [lay_flat(middles[0])]
    for hanging in hangings:
        here = creases(middles, hanging)
        _require_met(here, hanging)
        start = beside(here[0], blanks[hanging[0]].developments[0])
        blanks.append(lay_flat(middles[hanging[1]], start=start))
    return _Sheet(stuffs, tuple(blanks), hangings)


def _require_met(along: Sequence[Crease], hanging: Hanging) -> None:
    """Raise a GeometryError where a flank does not begin on its parent's edge."""
    boxes = np.concatenate([patch_box(crease.parent) for crease in along])
    limit = JOINED * float(np.linalg.norm(np.ptp(boxes, axis=0)))
    for crease in along:
        t = np.linspace(*crease.parent.domain, 33)
        gap = crease.mismatch(t)
        k = int(np.argmax(gap))
        if not gap[k] <= limit:
            raise GeometryError(
                f"flank {hanging[1] + 1} leaves the crease by {gap[k]:.3g} mm at t = {t[k]:.6g}",
                value=float(gap[k]),
                limit=limit,
                remedy="let both sides have the crease as their edge",
            )


def _standing(sheet: _Sheet, bend: float) -> tuple[list[Chain], tuple[str, ...]]:
    """The flanks as they stand: bent to the end, or folded less with the rulings where they are;
    and a word where they cannot fold so.

    Raises:
        GeometryError: they are to be folded less, and several creases let no such motion be.
    """
    try:
        return standing(sheet.blanks, sheet.hangings, bend), ()
    except GeometryError as error:
        if bend != 1.0:
            raise
        return sheet.middles, (f"no rigid-ruling motion: {error.what}",)


def _bodies(sheet: _Sheet, chains: Sequence[Chain], width: float) -> list[Chain]:
    """The flanks of a thick sheet, each without its share of the grooves.

    Raises:
        GeometryError: a groove leaves nothing of a flank.
    """
    bodies = without_grooves(chains, sheet.hangings, width)
    for number, chain in enumerate(bodies):
        for patch in chain.patches:
            t = np.linspace(*patch.domain, 129)
            jet = patch.jet(t, 0)
            left = (jet.v_to - jet.v_from)[0]
            k = int(np.argmin(left))
            if left[k] <= 0.0:
                raise GeometryError(
                    f"groove: {width:.6g} mm leaves nothing of flank {number + 1} at "
                    f"t = {t[k]:.6g}",
                    value=width,
                    remedy="make the extent wider there, or the sheet thinner",
                )
    return bodies


@contextmanager
def _told_of_creases(number: int, hangings: Sequence[Hanging]) -> Iterator[None]:
    """What leaves a flank over an edge that is a crease, told so."""
    try:
        yield
    except GeometryError as error:
        sides = [side for parent, _, side in hangings if parent == number]
        sides += [across(side) for _, child, side in hangings if child == number]
        before = error.what
        for side in sides:
            error.what = error.what.replace(
                f"leaves the sheet over its edge {side}", "runs over a curved crease"
            ).replace(f"touches the sheet's edge {side}", "touches a curved crease")
        if error.what != before:
            error.remedy = "move it to one side of the crease"
        raise


def _require_whole(flanks: Sequence[Panel], hangings: Sequence[Hanging]) -> None:
    """Raise a GeometryError where a notch bites into a crease."""
    for parent, child, side in hangings:
        for number, edge in ((parent, side), (child, across(side))):
            flank = flanks[number]
            spans = [abs(e.u[-1] - e.u[0]) for e in flank.pattern.outline if e.name == edge]
            whole = sum(patch.domain[1] - patch.domain[0] for patch in flank.chain.patches)
            if flank.cuts and sum(spans) < (1.0 - WHOLE) * whole:
                raise GeometryError(
                    "cutout-crosses-edge: a notch runs over a curved crease",
                    remedy="give one notch on each side of the crease, or move it",
                )


def _thickened(
    panel: Panel, body: Chain, how: Making, groove: float, rulings: tuple[Array, ...]
) -> tuple[Panel, list[Check]]:
    """A flank as the solid that the grooves leave of it, and what that proves."""
    refuse_in_groove(panel.cuts, panel.chain, body, groove)
    from devcad.geometry.thickness import refuse_layers_apart, refuse_thick_apex

    shapes = tuple(classify(patch) for patch in body.patches)
    apex = reaches_apex(body, shapes)
    refuse_thick_apex(shapes, apex)
    refuse_layers_apart(body, how.layers)
    checks = prove_surface(panel.name, body, how.layers, reaches_apex=any(apex))
    require(checks, how.allow)
    mesh, _ = meshed(body, how, panel.places, panel.cuts, rulings)
    thick = replace(
        panel,
        chain=body,
        shapes=shapes,
        thickness=how.thickness,
        mesh=mesh,
        surface_area=sheet_area(body, panel.cuts),
    )
    if how.limits is not None:
        from devcad.shop.limits import limit_checks

        assert panel.blank is not None
        checks += limit_checks(thick, panel.blank.middle, None, how.limits)
    return thick, checks


def _rulings(chains: Sequence[Chain], how: Making) -> tuple[Array, ...]:
    """Rulings at parameters that serve all flanks: those of the flank that needs most of them, and
    more where another one does."""
    aim = aim_of(chains, how)
    for _ in range(ATTEMPTS):
        rulings = tuple(
            place_together(patches, how.layers, aim)
            for patches in zip(*(chain.patches for chain in chains), strict=True)
        )
        excess = 0.0
        for chain in chains if how.thickness else ():
            mesh, _ = meshed(chain, how, _nowhere, (), rulings)
            area = sheet_area(chain, ())
            excess = max(excess, volume_error(mesh, chain, area, how.thickness) / how.tolerance)
        if excess <= 1.0:
            break
        aim *= 0.95 / excess
    return rulings


def _nowhere(_: int, t: Array, _v: Array) -> Array:
    """No place in any pattern: while rulings are looked for nobody asks."""
    return np.zeros((len(t), 2))


def _joined(spec: PanelSpec, sheet: _Sheet, flanks: Sequence[Panel], how: Making) -> Panel:
    """The sheet as one panel: all meshes, and one pattern."""
    meshes = [flank.mesh for flank in flanks]
    tied = () if how.thickness else ties(flanks, sheet.hangings)
    first = flanks[0]
    return replace(
        first,
        name=spec.name,
        kind=spec.kind,
        mesh=side_by_side(meshes, tied),
        pattern=one_sheet([flank.pattern for flank in flanks], sheet.hangings),
        surface_area=sum(flank.area for flank in flanks) if how.thickness else None,
        flanks=tuple(flanks),
        folds=tuple(
            Fold(*hanging, told(sheet.creases(hanging), sheet.blanks[hanging[1]].developments))
            for hanging in sheet.hangings
        ),
    )


def _score(name: str, sheet: _Sheet) -> Check:
    """The check ``score``: that both sides develop their crease as one curve of the pattern."""
    most, at, size = 0.0, None, 0.0
    for hanging in sheet.hangings:
        developments = (sheet.blanks[k].developments for k in hanging[:2])
        for crease, one, other in zip(sheet.creases(hanging), *developments, strict=True):
            t = fine(crease.child)
            off = apart(crease, (one, other), t)
            size = max(size, float(np.abs(one.origin(t)).max()))
            k = int(np.argmax(off))
            if not off[k] <= most:
                most, at = float(off[k]), float(t[k])
    return at_most(
        "score",
        name,
        most,
        max(SCORE_LIMIT, SCORE_SHARE * size),
        "mm",
        where=Where(t=at),
        says=f"both sides of the crease develop it {most:.3g} mm apart",
        remedy="the crease may be rougher than its pieces say; give it as points or a chain",
    )
