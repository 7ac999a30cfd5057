"""The tangent surface of the twisted cubic (t, t^2, t^3) is a quartic (O36): what its files hold
satisfies f = 0, as far as the file's numbers go."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from OCP.BRep import BRep_Tool
from OCP.BRepTools import BRepTools
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

import devcad

JOB = """
name = "cubic"
tolerance = 0.01
[surface]
kind = "tangent"
extent = [10, 60]
[surface.curve]
kind = "expression"
x = "100*t"
y = "100*t**2"
z = "100*t**3"
t = [-1, 1]
"""
SIZE = 100.0


def quartic(points):
    """f and |grad f| at points (n, 3) in units of SIZE."""
    x, y, z = np.asarray(points).T / SIZE
    f = z**2 - 6 * x * y * z + 4 * y**3 + 4 * x**3 * z - 3 * x**2 * y**2
    gradient = [
        -6 * y * z + 12 * x**2 * z - 6 * x * y**2,
        -6 * x * z + 12 * y**2 - 6 * x**2 * y,
        2 * z - 6 * x * y + 4 * x**3,
    ]
    return f, np.linalg.norm(gradient, axis=0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    where = tmp_path_factory.mktemp("cubic")
    (where / "job.toml").write_text(JOB)
    devcad.export(devcad.build(where / "job.toml"), where / "out", formats=["step", "stl"])
    return where / "out" / "cubic"


def test_o36_the_form_itself():
    f, slope = quartic(SIZE * np.array([[2, 1, 3], [1.5, 2, 2.5], [0.5, 0.25, 0.125]]))
    np.testing.assert_allclose(f, [61, 0, 0], atol=1e-13)
    assert slope[2] == 0.0  # singular on the cubic


def test_the_vertices_of_the_mesh_lie_on_the_quartic(folder: Path):
    vertices = trimesh.load_mesh(folder / "cubic.stl", process=False).vertices
    f, slope = quartic(vertices)
    # float32 moves a point by at most 6e-8 of its largest coordinate, in each coordinate
    rounding = 2.0**-24 * np.sqrt(3) * np.abs(vertices).max() / SIZE
    assert np.abs(f).max() < 1e-5
    assert (np.abs(f) <= 1.01 * slope * rounding + 20 * rounding**2).all()


def test_the_faces_of_the_step_file_lie_on_the_quartic(folder: Path):
    reader = STEPControl_Reader()
    reader.ReadFile(str(folder / "cubic.step"))
    reader.TransferRoots()
    points = []
    faces = TopExp_Explorer(reader.OneShape(), TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face(faces.Current())
        u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
        surface = BRep_Tool.Surface_s(face)
        for u in np.linspace(u0, u1, 41):
            at = [surface.Value(float(u), float(v)) for v in np.linspace(v0, v1, 5)]
            points += [[p.X(), p.Y(), p.Z()] for p in at]
        faces.Next()
    f, slope = quartic(np.array(points))
    assert len(points) >= 205
    step = 1e-4 / SIZE  # the recipe's STEP tolerance
    assert (np.abs(f) <= slope * step + 20 * step**2).all()
