"""What the shop adds to a part's patterns: stitch holes, allowances, notches, arrows, labels.

Only the patterns change, and what the report says of them; the panels in space stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from devcad.checks import require
from devcad.errors import DevcadError
from devcad.facts import pattern_facts
from devcad.flatten.pattern import Pattern
from devcad.part import Panel, Part
from devcad.proofs import overlap
from devcad.shop.settings import EdgeFinish, EdgeName, ShopSettings, Stitch
from devcad.shop.stitching import Stitched, pierced, refuse_clashes, stitched

Edges = Mapping[str, Mapping[EdgeName, EdgeFinish]]


def finished(
    part: Part,
    shop: ShopSettings,
    edges: Edges,
    *,
    reference: str = "middle",
    allow: frozenset[str] = frozenset(),
) -> Part:
    """The part with its patterns as the shop wants them.

    In this order, for each needs the one before: stitch holes from the seam lines; allowances and
    tabs; notches in the new outline; skiving lines, the grain's arrow and labels where there is
    room left. The pattern's area and the panel's ``flat_area``, ``cut_length`` and ``pierces`` are
    those of what is cut now, ``mass_g`` too; ``area`` stays that of the surface in space. The
    check ``overlap`` is made once more; ``stitch`` proves every sewn seam.

    Args:
        edges: by the panel's name, what is done with its edges.
        reference: the face of a thick sheet that the job describes: seams are measured on it.
    Raises:
        GeometryError: with the panel: no room for a hole, an allowance that folds over itself.
        CheckFailed: a check fails that is not in ``allow``.
    """
    sewn = _sewn(part, shop, edges, reference)
    panels = []
    for panel in part.panels:
        try:
            panels.append(_finished(panel, part, shop, edges.get(panel.name, {}), sewn))
        except DevcadError as error:
            raise (error.at(panel=panel.name) if len(part.panels) > 1 else error) from None
    kept = [check for check in part.checks if check.name != "overlap"]
    again = [replace(overlap(panel), panel=panel.name) for panel in panels]
    require([*again, *sewn.checks], allow)
    seams = part.seams
    if sewn.seams:
        pairs = zip(part.seams, sewn.seams, strict=True)
        seams = tuple(replace(meeting, stitches=figures) for meeting, figures in pairs)
    checks = (*kept, *again, *sewn.checks)
    return replace(part, panels=tuple(panels), checks=checks, seams=seams)


def _sewn(part: Part, shop: ShopSettings, edges: Edges, reference: str) -> Stitched:
    """The stitch holes of all seams, and the places of their notches."""
    if not part.seams or (shop.stitch is None and shop.notches is None):
        return Stitched()
    every, pair = 0, 0.0
    if shop.notches is not None:
        from devcad.shop.notches import beside

        every, pair = shop.notches.every, beside(shop.notches)
    return stitched(
        part,
        edges,
        shop.stitch or Stitch(),
        reference=reference,
        every=every,
        pair=pair,
        pierced=shop.stitch is not None,
    )


def _finished(
    panel: Panel,
    part: Part,
    shop: ShopSettings,
    finishes: Mapping[EdgeName, EdgeFinish],
    sewn: Stitched,
) -> Panel:
    before = panel.pattern
    pattern = before
    facts: dict[str, Any] = {}
    if finishes:
        from devcad.shop.allowance import allowed

        pattern = allowed(pattern, finishes).pattern
        facts["edges"] = {
            name: {"finish": each.finish, "allowance": each.allowance, "corner": each.corner}
            for name, each in finishes.items()
        }
        from devcad.shop.grain import layer_figures

        facts["figures"] = panel.facts.get("figures", {}) | layer_figures(panel, finishes)
    holes = sewn.holes.get(panel.name, ())
    if holes:
        pattern = pierced(pattern, holes)
        facts["stitches"] = sewn.facts[panel.name]
    anchors = sewn.anchors.get(panel.name, ())
    if shop.notches is not None and anchors:
        from devcad.shop.notches import notched

        pattern = notched(pattern, anchors, shop.notches, finishes)
    if holes:
        refuse_clashes(pattern)
    pattern, notes = _drawn(pattern, panel, part, shop, finishes)
    done = replace(panel, pattern=pattern, surface_area=panel.area)
    mass = panel.facts.get("mass_g")
    facts |= {
        **pattern_facts(pattern),
        "mass_g": None if mass is None else mass * pattern.area / before.area,
        "notes": [*panel.facts.get("notes", ()), *notes],
    }
    return replace(done, facts={**panel.facts, **facts})


def _drawn(
    pattern: Pattern,
    panel: Panel,
    part: Part,
    shop: ShopSettings,
    finishes: Mapping[EdgeName, EdgeFinish],
) -> tuple[Pattern, tuple[str, ...]]:
    """The pattern with the lines and labels that need free room, and notes on what had none."""
    net = panel.pattern.outline
    notes: tuple[str, ...] = ()
    if finishes:
        from devcad.shop.grain import skived

        pattern, notes = skived(pattern, net, finishes, part.thickness)
    if part.grain is not None:
        from devcad.shop.grain import grained

        pattern, told = grained(pattern, part.grain, net=net)
        notes += told
    if shop.labels is not None:
        from devcad.shop.labels import label_texts, labelled

        texts = label_texts(part, panel)
        pattern, told = labelled(pattern, texts, shop.labels.height, net=net)
        notes += told
    return pattern, notes
