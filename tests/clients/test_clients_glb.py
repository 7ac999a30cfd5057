"""GLB files: the Khronos validator has nothing to say, and three.js shows true size."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh
from exported import Exported, Look
from numpy.typing import NDArray

pytestmark = pytest.mark.clients


def test_the_khronos_validator_finds_nothing(exported: Exported, in_node: Look) -> None:
    """But for its information that texture coordinates without a texture may be unused."""
    for path in exported.files("glb"):
        seen = in_node(path)
        assert seen["issues"] == {"errors": 0, "warnings": 0, "hints": 0}, seen["messages"]


def test_three_shows_the_size_of_the_stl_in_metres_with_y_up(
    exported: Exported, in_node: Look
) -> None:
    (path,), (stl,) = exported.files("glb"), exported.files("stl")
    (x0, y0, z0), (x1, y1, z1) = trimesh.load_mesh(stl, process=False).bounds / 1000.0
    seen = in_node(path)
    # single precision in both files
    np.testing.assert_allclose(seen["min"], [x0, z0, -y1], rtol=2e-7, atol=1e-7)
    np.testing.assert_allclose(seen["max"], [x1, z1, -y0], rtol=2e-7, atol=1e-7)


def test_triangles_wind_the_way_their_normals_point(exported: Exported, in_node: Look) -> None:
    (path,) = exported.files("glb")
    for mesh in in_node(path)["meshes"]:
        corners = _array(mesh["position"], 3)[_array(mesh["index"], 3).astype(int)]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = _array(mesh["normal"], 3)[_array(mesh["index"], 3).astype(int)].sum(axis=1)
        area = np.linalg.norm(facing, axis=1)
        visible = area > 1e-6 * area.max()
        assert ((facing * normals).sum(axis=1)[visible] > 0.0).all()


def test_texture_coordinates_of_a_sheet_are_its_pattern(exported: Exported, in_node: Look) -> None:
    """Edges are as long in the pattern as in space, up to what chords of arcs differ by."""
    if exported.solid:
        return  # the skins of a thick sheet are longer and shorter than its middle
    (path,) = exported.files("glb")
    for mesh in in_node(path)["meshes"]:
        scale = mesh["extras"]["mm_per_uv"]
        index = _array(mesh["index"], 3).astype(int)
        space = _edges(1000.0 * _array(mesh["position"], 3), index)
        flat = _edges(scale * _array(mesh["uv"], 2), index)
        assert np.abs(space - flat).max() <= exported.tolerance
        # A chord c of an arc with sagitta s spans an arc longer by 8 s^2 / 3 c.
        allowed = 8.0 * exported.tolerance**2 / (3.0 * np.maximum(space, exported.tolerance))
        # Single precision: of both ends, in three directions in space and in two in the pattern.
        largest = max(1000.0 * np.abs(_array(mesh["position"], 3)).max(), scale)
        single = 2.0 * (np.sqrt(3.0) + np.sqrt(2.0)) * 2.0**-24 * largest + 1e-5
        assert (np.abs(space - flat) <= allowed + single).all()


def _array(values: list[float], width: int) -> NDArray[np.float64]:
    return np.asarray(values, dtype=float).reshape(-1, width)


def _edges(points: NDArray[np.float64], index: NDArray[Any]) -> NDArray[np.float64]:
    corners = points[index]
    return np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).ravel()
