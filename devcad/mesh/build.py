"""Triangles along the rulings: an open sheet, or the watertight body between its layers."""

from __future__ import annotations

import numpy as np

from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array, rows_cross
from devcad.mesh.mesh import Mesh
from devcad.mesh.stations import Flat, Stations, share
from devcad.mesh.strips import faces, joined


def build_mesh(
    chain: Chain,
    rulings: tuple[Array, ...],
    layers: tuple[float, ...],
    flat: Flat,
    deviation: float,
    cuts: tuple[Cut, ...] = (),
    tolerance: float = 0.05,
) -> Mesh:
    """The mesh of a chain on its certified rulings, without what is cut out of it.

    Args:
        rulings: per patch, the increasing parameters (n_k,) of its rulings.
        layers: (0,) for an open sheet facing +n; (-T/2, +T/2) for the solid between the two.
        flat: where a surface point lies in the pattern; a skin's vertex has its middle's place.
        deviation: the certified distance to the true surface, carried on; with cuts the largest
            of it and of what is measured there.
        cuts: the holes and notches, on the middle surface.
        tolerance: the largest distance in mm of a cut's chords from the cut, on every layer.
    Raises:
        GeometryError: the cuts cross each other, or leave a sheet that hangs on a point.
    """
    if cuts:
        from devcad.mesh.perforated import perforated  # most sheets have no holes

        return perforated(chain, rulings, layers, flat, deviation, cuts, tolerance)
    stations = [
        Stations(k, patch, t, layers, flat, chain)
        for k, (patch, t) in enumerate(zip(chain.patches, rulings, strict=True))
    ]
    share(stations, chain)
    if len(layers) == 1:
        strips = [s.skin(0, front=True) for s in stations]
    else:
        strips = [s.skin(1, front=True) for s in stations]
        strips += [s.skin(0, front=False) for s in stations]
        strips += [s.rim(end) for s in stations for end in (0, 1) if not s.collapsed(end)]
        if not chain.closed:
            strips += [stations[0].wall(last=False), stations[-1].wall(last=True)]
    parts = [faces(strip) for strip in strips]
    return joined(parts, watertight=len(layers) > 1, deviation=deviation)


def volume(mesh: Mesh) -> float:
    """The signed volume inside a closed mesh, mm3, by the divergence theorem."""
    corner = mesh.vertices[mesh.triangles] - mesh.vertices.mean(axis=0)
    return float(
        np.einsum("ij,ij->i", corner[:, 0], rows_cross(corner[:, 1], corner[:, 2])).sum() / 6.0
    )
