"""A folded sheet on its way from the flat pattern to the part: meshes with the same triangles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from devcad.flatten.blank import Blank
from devcad.flatten.flanks import Hanging
from devcad.flatten.foldings import family, posed
from devcad.geometry.chain import Chain
from devcad.geometry.creasing import Side, grooved
from devcad.geometry.locate import on_plane
from devcad.geometry.taylor import rows_dot
from devcad.mesh.build import build_mesh
from devcad.mesh.flanked import Rail, Tie, nearest_vertices, rail_vertices, side_by_side
from devcad.mesh.mesh import Mesh
from devcad.part import Panel


def poses(panel: Panel, bends: Sequence[float]) -> tuple[Mesh, ...]:
    """The mesh of a folded sheet at each of ``bends``, from 0 (flat) to 1 (as it is described),
    with the vertices, triangles and places in the pattern of its own mesh.

    The rulings stay where they are in the sheet: an exact isometry at every value. The first
    ruling of the first flank stays where it is in space. With several creases such a motion need
    not exist.

    Raises:
        GeometryError: it does not.
    """
    blanks = [_blank(flank) for flank in panel.flanks]
    hangings = tuple((fold.parent, fold.child, fold.side) for fold in panel.folds)
    return tuple(_pose(panel, blanks, hangings, bend) for bend in bends)


def standing(blanks: Sequence[Blank], hangings: Sequence[Hanging], bend: float) -> list[Chain]:
    """The flanks up to their creases, folded to ``bend``, 0 to 1, with their rulings fixed.

    Raises:
        GeometryError: there is no such motion.
    """
    middles = [blank.middle for blank in blanks]
    bends, mus = family(middles, hangings, bend)
    return middles if bend == 1.0 else posed(middles, blanks, hangings, bends, mus)


def without_grooves(
    chains: Sequence[Chain], hangings: Sequence[Hanging], width: float
) -> list[Chain]:
    """The flanks without half of the ``width`` (mm) beside each of their creases."""
    out = list(chains)
    for parent, child, side in hangings:
        out[parent] = _without(out[parent], side, width)
        out[child] = _without(out[child], across(side), width)
    return out


def ties(flanks: Sequence[Panel], hangings: Sequence[Hanging]) -> list[Tie]:
    """Which vertices of the flanks' meshes are one, as :func:`side_by_side` takes them: those on
    both sides of every crease, of sheets without thickness."""
    return [
        (parent, _rail(flanks[parent], side), child, _rail(flanks[child], across(side)))
        for parent, child, side in hangings
    ]


def _rail(flank: Panel, side: Side) -> Rail:
    """The vertices at that edge of a flank's mesh, one a ruling on each patch."""
    end = 0 if side == "base" else 1
    if not flank.cuts:
        return rail_vertices(flank.rulings, end)
    points = []
    for patch, t in zip(flank.chain.patches, flank.rulings, strict=True):
        jet = patch.jet(t, 0)
        points.append(patch.point(t, (jet.v_to if end else jet.v_from)[0]))
    return nearest_vertices(flank.mesh, np.concatenate(points))


def across(side: Side) -> Side:
    """The side of the child where the parent's is ``side``."""
    return "top" if side == "base" else "base"


def _pose(panel: Panel, blanks: Sequence[Blank], hangings: Sequence[Hanging], bend: float) -> Mesh:
    half = 0.5 * panel.thickness
    chains = standing(blanks, hangings, bend)
    if half:
        chains = without_grooves(chains, hangings, panel.facts["figures"]["groove"])
    layers = (-half, half) if half else (0.0,)
    meshes = [
        _moved(flank, chain)
        if flank.cuts
        else build_mesh(chain, flank.rulings, layers, flank.places, flank.mesh.deviation)
        for chain, flank in zip(chains, panel.flanks, strict=True)
    ]
    one = side_by_side(meshes, () if half else ties(panel.flanks, hangings))
    return replace(one, triangles=panel.mesh.triangles, weld=panel.mesh.weld)


def _moved(flank: Panel, chain: Chain) -> Mesh:
    """The mesh of a flank with cutouts carried to the same flank folded otherwise."""
    blank, mesh = _blank(flank), flank.mesh
    found = on_plane(blank.chain.patches, blank.developments, mesh.flat)
    vertices, normals = mesh.vertices.copy(), mesh.normals.copy()
    for number, (patch, other) in enumerate(zip(flank.chain.patches, chain.patches, strict=True)):
        here = np.flatnonzero(found.patch == number)
        low, high = patch.domain
        t = np.clip(found.t[here], np.nextafter(low, high), np.nextafter(high, low))
        before, after = patch.frame(t), other.frame(t)
        away = mesh.vertices[here] - before.c0
        local = np.stack([rows_dot(away, x) for x in (before.e, before.m, before.n)], axis=1)
        turned = [rows_dot(normals[here], x) for x in (before.e, before.m, before.n)]
        axes = np.stack([after.e, after.m, after.n], axis=1)
        vertices[here] = after.c0 + np.einsum("nk,nkj->nj", local, axes)
        normals[here] = np.einsum("kn,nkj->nj", np.array(turned), axes)
    return replace(mesh, vertices=vertices, normals=normals)


def _without(chain: Chain, side: Side, width: float) -> Chain:
    return replace(chain, patches=tuple(grooved(patch, side, width) for patch in chain.patches))


def _blank(flank: Panel) -> Blank:
    assert flank.blank is not None
    return flank.blank
