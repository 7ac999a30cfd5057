"""STL files in mesh programs: solids are manifold for all of them, sheets have the sheet's area."""

from __future__ import annotations

from pathlib import Path

import clients
import numpy as np
import pytest
import trimesh
from exported import Exported, Look

pytestmark = pytest.mark.clients

FEWEST = 4  # facets; admesh, and PrusaSlicer with its code, take a smaller file for an empty one
FLOAT32 = 2e-7  # relative; binary STL stores single precision


def test_prusaslicer_calls_solids_manifold(exported: Exported) -> None:
    (path,) = exported.files("stl")
    mesh = _load(path)
    if len(mesh.faces) < FEWEST:
        return
    (seen,) = clients.prusa_slicer(path)
    assert int(seen["number_of_facets"]) == len(mesh.faces)
    if exported.solid:  # an open sheet it turns to the side where its volume is positive
        assert seen["manifold"] == "yes"
        assert "open_edges" not in seen
        assert "facets_reversed" not in seen
        # it sums in single precision, which costs thin parts four digits
        assert float(seen["volume"]) == pytest.approx(mesh.volume, rel=1e-3)


def test_admesh_repairs_nothing(exported: Exported) -> None:
    (path,) = exported.files("stl")
    facets = len(_load(path).faces)
    if facets < FEWEST:
        return
    seen = clients.admesh(path)
    assert seen["Number of facets"] == facets
    assert seen["Degenerate facets"] == 0
    if exported.solid:
        assert seen["Facets reversed"] == 0
        assert seen["Total disconnected facets"] == 0


def test_trimesh_and_manifold3d_accept_the_winding(exported: Exported) -> None:
    import manifold3d

    (path,) = exported.files("stl")
    mesh = _load(path)
    if not exported.solid:
        assert mesh.is_winding_consistent
        return
    bodies = _bodies(mesh)
    assert len(bodies) == len(exported.solids)
    for each in bodies:
        assert each.is_volume  # watertight, one winding, outward
        assert each.volume > 0.0
        body = manifold3d.Manifold(
            manifold3d.Mesh64(each.vertices, np.asarray(each.faces, np.uint64))
        )
        assert body.status() == manifold3d.Error.NoError
        assert body.volume() == pytest.approx(each.volume, rel=1e-9)


def _bodies(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """The closed bodies of a file, one after the other: each ends when every edge has been run
    both ways. Where two lie wall on wall their points are one, and edges have four faces."""
    found, begin = [], 0
    open_edges: set[tuple[int, int]] = set()
    for k, (a, b, c) in enumerate(mesh.faces.tolist(), start=1):
        for edge in ((a, b), (b, c), (c, a)):
            if edge[::-1] in open_edges:
                open_edges.remove(edge[::-1])
            else:
                open_edges.add(edge)
        if not open_edges:
            faces = mesh.faces[begin:k]
            found.append(trimesh.Trimesh(mesh.vertices, faces, process=False))
            found[-1].remove_unreferenced_vertices()
            begin = k
    return found


def test_triangles_have_the_surface_within_the_tolerance(exported: Exported) -> None:
    """A mesh within the tolerance of a body has its volume to area x tolerance."""
    (path,) = exported.files("stl")
    mesh = _load(path)
    area = sum(exported.solids) if exported.solid else exported.total("area")
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


def test_the_clients_notice_a_missing_triangle(tmp_path: Path) -> None:
    """So that their consent above means something."""
    box = trimesh.creation.box((10, 20, 30))
    box.update_faces(np.arange(len(box.faces)) > 0)
    path = tmp_path / "open.stl"
    box.export(path)
    assert clients.prusa_slicer(path)[0]["manifold"] == "no"
    assert clients.admesh(path)["Total disconnected facets"] > 0
    assert not _load(path).is_volume


def _load(path: object) -> trimesh.Trimesh:
    mesh = trimesh.load_mesh(str(path), process=False)
    mesh.merge_vertices()
    return mesh
