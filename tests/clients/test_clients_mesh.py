"""STL files in mesh programs: solids are manifold for all of them, sheets have the sheet's area."""

from __future__ import annotations

import clients
import numpy as np
import pytest
import trimesh
from exported import Exported, Look

pytestmark = pytest.mark.clients

FLOAT32 = 2e-7  # relative; binary STL stores single precision


def test_prusaslicer_calls_solids_manifold(exported: Exported) -> None:
    (path,) = exported.files("stl")
    seen = clients.prusa_slicer(path)
    mesh = _load(path)
    assert int(seen["number_of_facets"]) == len(mesh.faces)
    if exported.solid:  # an open sheet it turns to the side where its volume is positive
        assert seen["manifold"] == "yes"
        assert "open_edges" not in seen
        assert "facets_reversed" not in seen
        # it sums in single precision, which costs thin parts four digits
        assert float(seen["volume"]) == pytest.approx(mesh.volume, rel=1e-3)


def test_admesh_repairs_nothing(exported: Exported) -> None:
    (path,) = exported.files("stl")
    seen = clients.admesh(path)
    assert seen["Number of facets"] == len(_load(path).faces)
    assert seen["Degenerate facets"] == 0
    if exported.solid:
        assert seen["Facets reversed"] == 0
        assert seen["Total disconnected facets"] == 0


def test_trimesh_and_manifold3d_accept_the_winding(exported: Exported) -> None:
    import manifold3d

    (path,) = exported.files("stl")
    mesh = _load(path)
    if exported.solid:
        assert mesh.is_volume  # watertight, one winding, outward
        body = manifold3d.Manifold(
            manifold3d.Mesh64(mesh.vertices, np.asarray(mesh.faces, np.uint64))
        )
        assert body.status() == manifold3d.Error.NoError
        assert body.volume() == pytest.approx(mesh.volume, rel=1e-9)
        assert mesh.volume > 0.0
    else:
        assert mesh.is_winding_consistent


def test_triangles_have_the_surface_within_the_tolerance(exported: Exported) -> None:
    """A mesh within the tolerance of a body has its volume to area x tolerance."""
    (path,) = exported.files("stl")
    mesh = _load(path)
    area = exported.total("area")
    if exported.solid:
        expected = area * exported.thickness
        skins = 2.0 * area + expected  # generous: two skins and the walls
        assert mesh.volume == pytest.approx(expected, abs=skins * exported.tolerance)
    else:
        # Inscribed chords shorten a developable by less than a ruling strip's sagitta does.
        assert mesh.area == pytest.approx(area, rel=0.02)
        assert mesh.area <= area * (1.0 + 1e-3)


def test_three_reads_the_same_box(exported: Exported, in_node: Look) -> None:
    (path,) = exported.files("stl")
    mesh, seen = _load(path), in_node(path)
    assert seen["triangles"] == len(mesh.faces)
    np.testing.assert_allclose([seen["min"], seen["max"]], mesh.bounds, rtol=FLOAT32, atol=1e-4)


def _load(path: object) -> trimesh.Trimesh:
    mesh = trimesh.load_mesh(str(path), process=False)
    mesh.merge_vertices()
    return mesh
