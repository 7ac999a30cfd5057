"""Meshes with tips and with rails that turn: tight, watertight, on certified rulings."""

import manifold3d
import numpy as np
import pytest
from patches import cosine_cylinder, frustum, gore, helix_tangent, lens, oloid, sphericon

from devcad.flatten.development import develop_chain
from devcad.flatten.outline import surface_area
from devcad.geometry.chain import Chain, link
from devcad.geometry.rulings import place
from devcad.mesh.build import build_mesh, volume

TIPPED = {
    "gore": gore(),
    "parabola": cosine_cylinder().scaled(100.0),
    "cubic": cosine_cylinder((1, 2, 3), (0.0, 0.5 * np.pi)).scaled(100.0),
    "cylinder": lens(frustum(80.0, 80.0, 100.0), (3.0, 60.0), (1.0, 40.0)),
    "cone": lens(frustum(), (3.0, 60.0), (1.0, 40.0)),
    "tangent": lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 30.0), (30.0, 15.0)),
    "half": lens(helix_tangent(30.0, 40.0, 100.0), (50.0, 30.0), (30.0, 15.0)).restricted(0.0, 1.5),
}
SOLID = (-0.5, 0.5)


def meshed(chain, layers, tolerance):
    developments = develop_chain(chain)
    placements = [place(patch, layers, tolerance) for patch in chain.patches]
    deviation = max(placement.deviation for placement in placements)
    rulings = tuple(placement.t for placement in placements)
    return build_mesh(
        chain, rulings, layers, lambda k, t, v: developments[k].points(t, v), deviation
    )


def edge_counts(mesh):
    corners = mesh.weld[mesh.triangles]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]))
    return np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)[1]


@pytest.mark.parametrize("tolerance", [0.05, 0.001])
@pytest.mark.parametrize("name", TIPPED)
def test_a_thick_sheet_with_tips_is_a_watertight_body(name, tolerance):
    patch = TIPPED[name]
    mesh = meshed(Chain((patch,)), SOLID, tolerance)
    assert mesh.watertight
    assert (edge_counts(mesh) == 2).all()
    points = np.zeros((mesh.weld.max() + 1, 3))
    points[mesh.weld] = mesh.vertices
    assert len(np.unique(points, axis=0)) == len(points)
    faces = mesh.weld[mesh.triangles]
    body = manifold3d.Manifold(manifold3d.Mesh64(points, np.asarray(faces, np.uint64)))
    assert body.status() == manifold3d.Error.NoError
    assert body.genus() == 0  # V - E + F = 2: no point is left where a wall had no width
    corners = points[faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert areas.min() > 0.0
    area = surface_area(patch)
    assert volume(mesh) == pytest.approx(area, abs=area * tolerance)


@pytest.mark.parametrize("layers", [(0.0,), SOLID])
@pytest.mark.parametrize("name", TIPPED)
def test_rulings_towards_a_tip_spend_the_tolerance(name, layers):
    for tolerance in (0.01, 0.0005):
        placed = place(TIPPED[name], layers, tolerance)
        assert 0.85 * tolerance <= placed.deviation <= tolerance
        assert len(placed.t) < 2000


def test_rulings_where_a_rail_turns_spend_the_tolerance():
    for patch in oloid(radius=100.0):
        placed = place(patch, (0.0,), 0.05)
        assert 0.85 * 0.05 <= placed.deviation <= 0.05
        assert len(placed.t) <= 60  # 34 hold the 120 degrees of one circle alone


@pytest.mark.parametrize("name", TIPPED)
def test_a_sheet_with_tips_has_one_point_at_each(name):
    mesh = meshed(Chain((TIPPED[name],)), (0.0,), 0.05)
    corners = mesh.weld[mesh.triangles]
    vertices = len(np.unique(corners))
    assert vertices - len(edge_counts(mesh)) + len(corners) == 1  # a disc
    assert (edge_counts(mesh) <= 2).all()


@pytest.mark.parametrize("patches", [oloid(radius=100.0), sphericon(100.0)])
def test_a_tube_of_turning_rails_is_one_ring(patches):
    chain = link(patches, base_closed=True, tolerance=1e-6)
    mesh = meshed(chain, (0.0,), 0.05)
    corners = mesh.weld[mesh.triangles]
    vertices = len(np.unique(corners))
    assert vertices - len(edge_counts(mesh)) + len(corners) == 0
    points = mesh.vertices[mesh.triangles]
    area = (
        0.5
        * np.linalg.norm(
            np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]), axis=1
        ).sum()
    )
    true = sum(surface_area(patch) for patch in patches)
    assert area == pytest.approx(true, rel=1e-3)  # chords of 0.05 mm on a radius of 100 mm
    assert area < true
