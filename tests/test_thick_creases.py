"""Sharp creases of thick sheets from the job file on: curved edges, holes, and what is refused."""

import manifold3d
import numpy as np
import pytest

import devcad
from devcad.errors import GeometryError

DUCT = """
name = "duct"
thickness = {thickness}
[surface]
kind = "cylinder"
direction = [0, 0, 1]
extent = ["-5 - 4*cos(2*pi*t)", "120 + 20*sin(2*pi*t)**2"]
[surface.directrix]
kind = "polyline"
points = [[0, -60, 0], [60, -60, 0], [60, 60, 0], [-60, 60, 0], [-60, -60, 0]]
closed = true
"""
CUTS = """
[[cutout]]
shape = "circle"
diameter = 24
at = [60, 60]
[[cutout]]
shape = "circle"
diameter = 20
at = [85, 180]
[[cutout]]
shape = "rectangle"
width = 20
height = 6
at = [-2, 186]
notch = true
"""


def built(folder, text):
    job = folder / "job.toml"
    job.write_text(text)
    return devcad.build(job)


@pytest.mark.parametrize("cuts", [pytest.param("", marks=pytest.mark.slow), CUTS])
def test_a_duct_with_waved_ends_is_one_body_of_area_times_thickness(tmp_path, cuts):
    part = built(tmp_path, DUCT.format(thickness=3) + cuts)
    (panel,) = part.panels
    points = np.zeros((panel.mesh.weld.max() + 1, 3))
    points[panel.mesh.weld] = panel.mesh.vertices
    np.testing.assert_array_equal(points[panel.mesh.weld], panel.mesh.vertices)
    triangles = panel.mesh.weld[panel.mesh.triangles].astype(np.uint64)
    solid = manifold3d.Manifold(manifold3d.Mesh64(points, triangles))
    assert solid.status() == manifold3d.Error.NoError
    assert solid.genus() == (3 if cuts else 1)
    assert panel.mesh.deviation <= part.tolerance
    assert solid.volume() == pytest.approx(3 * panel.area, abs=panel.area * part.tolerance)
    if not cuts:  # each edge's waves are square to the directrix, 480 mm round
        assert panel.area == pytest.approx(480 * (125 + 10), rel=1e-9)


@pytest.mark.parametrize("edges", ["length = 50", 'extent = ["4*sin(9*t)", 50]'])
def test_a_plane_narrower_than_what_its_mitres_take_is_refused(tmp_path, edges):
    # a U of 4 mm between two right angles: its inner skin is T wide less
    text = (
        'name = "u"\nthickness = {}\n[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\n'
        f"{edges}\n[surface.directrix]\n"
        'kind = "polyline"\npoints = [[0, 0, 0], [40, 0, 0], [40, 4, 0], [0, 4, 0]]\n'
    )
    built(tmp_path, text.format(3.9))
    with pytest.raises(GeometryError, match="inside out") as refused:
        built(tmp_path, text.format(4.1))
    assert refused.value.value == pytest.approx(4.1, rel=1e-9)
    assert refused.value.limit == pytest.approx(4.0, rel=1e-9)
    assert "thinner" in refused.value.remedy


def test_a_thick_pyramid_is_refused_at_its_tip(tmp_path):
    with pytest.raises(GeometryError, match="inside out") as refused:
        built(
            tmp_path,
            'name = "tip"\nthickness = 2\n[surface]\nkind = "cone"\napex = [0, 0, 100]\n'
            'extent = [0, 1]\n[surface.directrix]\nkind = "polyline"\nclosed = true\n'
            "points = [[0, -50, 0], [50, -50, 0], [50, 50, 0], [-50, 50, 0], [-50, -50, 0]]\n",
        )
    assert refused.value.limit == 0.0
    assert "extent" in refused.value.remedy
