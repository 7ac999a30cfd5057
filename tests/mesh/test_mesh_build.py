"""Meshes against manifold3d, closed-form volumes and areas."""

import manifold3d
import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent, prism, slanted_pipe

from devcad.flatten.development import develop_chain
from devcad.flatten.outline import surface_area
from devcad.geometry.chain import Chain, link
from devcad.geometry.rulings import place
from devcad.mesh.build import build_mesh, volume

TOLERANCE = 0.01


def mesh_of(chain, thickness=0.0, tolerance=TOLERANCE):
    layers = (-thickness / 2, thickness / 2) if thickness else (0.0,)
    developments = develop_chain(chain)
    placed = [place(p, layers, tolerance) for p in chain.patches]
    return build_mesh(
        chain,
        tuple(p.t for p in placed),
        layers,
        lambda k, t, v: developments[k].points(t, v),
        max(p.deviation for p in placed),
    )


def body(mesh):
    triangles = mesh.weld[mesh.triangles]
    points = np.zeros((mesh.weld.max() + 1, 3))
    points[mesh.weld] = mesh.vertices
    np.testing.assert_array_equal(points[mesh.weld], mesh.vertices)  # equal to the bit
    return manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))


SQUARE = np.array([[0, 0], [40, 0], [40, 30], [0, 30]], dtype=float)
SOLIDS = {
    "closed frustum": (link((frustum(),), base_closed=True, tolerance=1.0), 1),
    "open frustum": (Chain((frustum(sweep=3.0),)), 0),
    "pointed cone": (link((frustum(100.0, 0.0),), base_closed=True, tolerance=1.0), 0),
    "cone sector": (Chain((frustum(100.0, 0.0, sweep=2.0),)), 0),
    "helix": (Chain((helix_tangent(30.0, 15.0, 200.0, (25.0, 80.0)),)), 0),
    "pipe": (link((slanted_pipe(40.0),), base_closed=True, tolerance=1.0), 1),
    "ellipse": (link((ellipse_cylinder(90, 60, 30),), base_closed=True, tolerance=1.0), 1),
    "square duct": (link(prism(SQUARE, 50.0), base_closed=True, tolerance=1.0), 1),
    "open duct": (link(prism(SQUARE, 50.0)[:3], base_closed=False, tolerance=1.0), 0),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_manifold_of_the_right_genus_and_volume(name):
    chain, genus = SOLIDS[name]
    mesh = mesh_of(chain, thickness=2.0)
    solid = body(mesh)
    assert solid.status() == manifold3d.Error.NoError
    assert solid.genus() == genus
    area = sum(surface_area(p) for p in chain.patches)
    assert abs(solid.volume() - 2.0 * area) <= area * TOLERANCE + tip_volume(name)
    assert volume(mesh) == pytest.approx(solid.volume(), rel=1e-12)


def tip_volume(name):
    """(T^3 / 24) * integral of c^2 / |a|: what the layers add at an apex (design.md, 7)."""
    if name not in ("pointed cone", "cone sector"):
        return 0.0
    f = SOLIDS[name][0].patches[0]
    t = f.frame([1.0])
    return float(2.0**3 / 24 * t.c[0] ** 2 / abs(t.a[0]) * (f.domain[1] - f.domain[0]))


def test_volume_of_a_frustum_shell_converges_to_area_times_thickness():
    # second order in the chord: the error falls with the tolerance
    chain = SOLIDS["closed frustum"][0]
    area = surface_area(chain.patches[0])
    errors = [
        volume(mesh_of(chain, 2.0, tolerance)) - 2.0 * area for tolerance in (0.1, 0.01, 0.001)
    ]
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(10.0, rel=0.1)


@pytest.mark.parametrize("name", ["closed frustum", "helix", "square duct", "pipe"])
def test_sheets_face_the_front_and_cover_the_area(name):
    chain, _ = SOLIDS[name]
    mesh = mesh_of(chain)
    assert not mesh.watertight
    corner = mesh.vertices[mesh.triangles]
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert (np.einsum("ij,ij->i", facing, mesh.normals[mesh.triangles[:, 0]]) > 0.0).all()
    area = 0.5 * np.linalg.norm(facing, axis=1).sum()
    exact = sum(surface_area(p) for p in chain.patches)
    assert area == pytest.approx(exact, rel=2e-3)  # chords of 0.01 mm


@pytest.mark.parametrize("name", ["closed frustum", "helix", "pipe"])
def test_ruling_edges_have_the_same_length_in_space_and_in_the_pattern(name):
    chain, _ = SOLIDS[name]
    mesh = mesh_of(chain)
    half = len(mesh.vertices) // 2
    rails = mesh.vertices[:half] - mesh.vertices[half:]
    flat = mesh.flat[:half] - mesh.flat[half:]
    np.testing.assert_allclose(
        np.linalg.norm(flat, axis=1), np.linalg.norm(rails, axis=1), rtol=1e-12
    )


def test_normals_of_a_solid_point_out_of_the_body():
    mesh = mesh_of(SOLIDS["open frustum"][0], thickness=2.0)
    corner = mesh.vertices[mesh.triangles]
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    along = np.einsum("ij,ikj->ik", facing, mesh.normals[mesh.triangles])
    assert (along > 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, rtol=1e-12)
