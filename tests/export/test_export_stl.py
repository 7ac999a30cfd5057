"""Binary STL: read with struct and trimesh, which know nothing of our writer."""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from meshes import AREA, cone_sheet, cone_shell, moved, part, volume

from devcad.errors import CheckFailed, FileError
from devcad.export import Options, stl

THICKNESS = 2.0


def written(part, folder):
    (one,) = stl.write(part, folder, Options())
    return one


def facets(path):
    """Normals (n, 3) and corners (n, 3, 3) by the format's own words, one facet at a time."""
    content = path.read_bytes()
    (count,) = struct.unpack_from("<I", content, 80)
    rows = [struct.unpack_from("<12fH", content, 84 + 50 * k) for k in range(count)]
    assert len(content) == 84 + 50 * count
    assert all(row[12] == 0 for row in rows)
    numbers = np.array([row[:12] for row in rows]).reshape(-1, 4, 3)
    return numbers[:, 0], numbers[:, 1:]


def test_file_is_84_bytes_and_50_a_facet_and_starts_unlike_the_text_form(tmp_path):
    path = written(part(cone_shell()), tmp_path).path
    assert path == tmp_path / "cone.stl"
    content = path.read_bytes()
    assert content[:80] == b"devcad cone mm".ljust(80)
    assert len(content) == 84 + 50 * len(cone_shell().triangles)


def test_longest_name_fits_the_header_and_a_part_named_solid_is_no_text_file(tmp_path):
    assert len(stl.header("x" * 64)) == 80
    assert not stl.header("solid").startswith(b"solid")


def test_corners_are_the_meshs_points_to_float32(tmp_path):
    mesh = cone_shell()
    _, corners = facets(written(part(mesh), tmp_path).path)
    assert np.array_equal(corners, mesh.vertices.astype(np.float32)[mesh.triangles])


def test_normals_are_unit_and_turn_with_the_corners(tmp_path):
    normals, corners = facets(written(part(cone_shell()), tmp_path).path)
    a, b, c = corners.transpose(1, 0, 2)
    right_hand = np.cross(b - a, c - a)
    right_hand /= np.linalg.norm(right_hand, axis=1)[:, None]
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-7)  # float32
    # the corners are rounded by 4e-6 mm, the shortest height of a facet is 2 mm
    assert np.abs(normals - right_hand).max() < 1e-5


def test_open_sheet_faces_its_front(tmp_path):
    normals, corners = facets(written(part(cone_sheet()), tmp_path).path)
    middle = corners.mean(axis=1)
    inwards = -middle[:, :2] / np.linalg.norm(middle[:, :2], axis=1)[:, None]
    assert np.all(np.einsum("ij,ij->i", normals[:, :2], inwards) > 0.8)  # cos of the half angle


def test_solid_is_a_volume_of_area_times_thickness(tmp_path):
    body = trimesh.load(written(part(cone_shell(161)), tmp_path).path)
    assert body.is_volume
    # 160 chords a turn lie inside the arcs: 1 - sin(x) / x with x = sweep / 160, 1.3e-4
    assert body.volume == pytest.approx(AREA * THICKNESS, rel=3e-4)


def test_panels_stand_in_one_file_side_by_side(tmp_path):
    shell = cone_shell()
    one = written(part(shell, name="one"), tmp_path)
    two = written(part(shell, moved(shell, (300, 0, 0)), name="two"), tmp_path)
    assert trimesh.load(two.path).body_count == 2
    assert volume(facets(two.path)[1]) == pytest.approx(2 * volume(facets(one.path)[1]), rel=1e-5)
    assert [check.panel for check in two.checks] == ["two-1", "two-2"]


def test_vertices_welded_in_the_mesh_are_equal_bits_in_the_file(tmp_path):
    mesh = cone_shell()
    rng = np.random.default_rng(7)
    noise = rng.uniform(-1e-9, 1e-9, mesh.vertices.shape)  # two ways to compute one point
    noisy = replace(mesh, vertices=mesh.vertices + noise)
    assert trimesh.load(written(part(noisy), tmp_path).path).is_volume


def test_minus_zero_is_written_as_zero(tmp_path):
    mesh = cone_sheet()
    vertices = np.where(np.abs(mesh.vertices) < 1e-9, -0.0, mesh.vertices)
    _, corners = facets(written(part(replace(mesh, vertices=vertices)), tmp_path).path)
    assert not np.signbit(corners[corners == 0.0]).any()


@pytest.mark.parametrize("scale", [0.1, 1.0, 1e4])
def test_rounding_is_measured_and_added_to_the_meshs_deviation(tmp_path, scale):
    mesh = cone_shell()
    mesh = replace(mesh, vertices=scale * mesh.vertices, deviation=0.001 * scale)
    one = written(part(mesh), tmp_path)
    (check,) = one.checks
    moved_by = np.linalg.norm(facets(one.path)[1] - mesh.vertices[mesh.triangles], axis=2).max()
    assert moved_by <= check.value <= np.sqrt(3.0) * moved_by
    assert check.passed
    assert one.max_deviation == pytest.approx(mesh.deviation + check.value, rel=1e-12)


def test_solid_stays_closed_where_float32_makes_neighbouring_points_one(tmp_path):
    # beside 100 mm float32 steps by 7.6e-6: rulings 4.5e-6 mm apart fall on one another
    mesh = cone_shell(3, 2)
    fine = np.zeros(len(mesh.vertices), dtype=bool)
    fine[np.flatnonzero(np.isin(mesh.weld, [2, 3]))] = True  # the middle ruling, front
    start = mesh.vertices[mesh.weld.argsort(kind="stable")][:2]
    vertices = mesh.vertices.copy()
    vertices[fine] = start[mesh.weld[fine] - 2] + [0.0, 1e-7, 0.0]
    one = written(part(replace(mesh, vertices=vertices)), tmp_path)
    body = trimesh.load(one.path)
    assert body.is_watertight and body.is_winding_consistent
    merged = {check.unit: check.value for check in one.checks}["points"]
    assert merged >= 1
    assert len(body.faces) == len(mesh.triangles) - 2 * merged  # two facets an edge that vanished


def test_solid_thinner_than_a_step_of_float32_is_refused(tmp_path):
    # at 1e7 mm neighbouring float32 numbers lie 1 mm apart, the sheet is 0.01 mm thick
    far = moved(cone_shell(thickness=0.01), (1e7, 1e7, 1e7))
    with pytest.raises(CheckFailed, match="stl-readback") as failure:
        stl.write(part(far), tmp_path, Options())
    assert failure.value.panel == "cone"
    assert failure.value.place == "cone.stl"
    assert "nearer to the origin" in str(failure.value)


def test_facet_of_no_area_stays_where_its_corners_differ(tmp_path):
    mesh = cone_sheet(3, 3)  # three points on each ruling are collinear
    extra = np.array([[0, 1, 2]], dtype=np.int32)
    flat = replace(mesh, triangles=np.concatenate([mesh.triangles, extra]))
    normals, corners = facets(written(part(flat), tmp_path).path)
    assert len(corners) == len(mesh.triangles) + 1
    assert np.isfinite(normals).all()


def test_facet_with_two_equal_corners_is_left_out(tmp_path):
    mesh = cone_sheet()
    extra = np.array([[0, 1, 1]], dtype=np.int32)
    folded = replace(mesh, triangles=np.concatenate([mesh.triangles, extra]))
    assert len(facets(written(part(folded), tmp_path).path)[1]) == len(mesh.triangles)


def test_solid_that_shrank_to_a_point_is_refused(tmp_path):
    mesh = cone_shell(3, 3)
    point = replace(mesh, vertices=1e-60 * mesh.vertices)  # float32 ends at 1e-45
    with pytest.raises(CheckFailed, match="stl-readback"):
        stl.write(part(point), tmp_path, Options())


def test_equal_parts_give_equal_bytes(tmp_path):
    first = written(part(cone_shell()), tmp_path).path.read_bytes()
    assert written(part(cone_shell()), tmp_path).path.read_bytes() == first


@pytest.mark.parametrize("damage", ["shorter", "longer", "corner", "count"])
def test_damaged_file_is_noticed(tmp_path, monkeypatch, damage):
    path = tmp_path / "cone.stl"
    read_back = stl._read_back

    def spoil_first(*args):
        content = bytearray(path.read_bytes())
        if damage == "shorter":
            del content[-1:]
        elif damage == "longer":
            content += b"\0"
        elif damage == "corner":
            content[84 + 50 * 17 + 14] ^= 1  # the lowest bits of a coordinate
        else:
            content[80] ^= 1
        path.write_bytes(content)
        return read_back(*args)

    monkeypatch.setattr(stl, "_read_back", spoil_first)
    with pytest.raises(CheckFailed, match="stl-readback"):
        stl.write(part(cone_shell()), tmp_path, Options())


def test_folder_that_is_missing_is_one_clear_line(tmp_path):
    with pytest.raises(FileError, match=r"cannot write cone\.stl: No such file") as failure:
        stl.write(part(cone_sheet()), tmp_path / "none", Options())
    assert failure.value.code == 5


def test_full_disk_is_a_file_error(tmp_path):
    (tmp_path / "cone.stl").symlink_to("/dev/full")
    with pytest.raises(FileError, match="No space left"):
        stl.write(part(cone_sheet()), tmp_path, Options())
