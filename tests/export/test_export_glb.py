"""GLB: read with json and struct by the specification, and with trimesh."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from meshes import AREA, SIN_HALF_ANGLE, cone_sheet, cone_shell, moved, part

from devcad.errors import CheckFailed, FileError, LimitError
from devcad.export import Options, glb, glbfile
from devcad.mesh.mesh import Mesh

COMPONENTS = {5126: ("f", 4), 5123: ("H", 2), 5125: ("I", 4)}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def written(part, folder):
    (one,) = glb.write(part, folder, Options())
    return one


def parse(path):
    """The document and the binary chunk, by glTF 2.0 section 4.4."""
    content = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    size, kind = struct.unpack_from("<I4s", content, 12)
    rest, binary = struct.unpack_from("<I4s", content, 20 + size)
    assert (magic, version, kind, binary) == (b"glTF", 2, b"JSON", b"BIN\0")
    assert length == len(content) == 28 + size + rest
    assert size % 4 == rest % 4 == 0
    return json.loads(content[20 : 20 + size]), content[28 + size :]


def numbers(document, data, index):
    """The values of an accessor, (count, components)."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    letter, size = COMPONENTS[accessor["componentType"]]
    width = WIDTHS[accessor["type"]]
    assert view["byteOffset"] % 4 == 0
    assert view["byteLength"] == size * width * accessor["count"]
    values = struct.unpack_from(f"<{width * accessor['count']}{letter}", data, view["byteOffset"])
    return np.array(values).reshape(-1, width)


def arrays(path, panel=0):
    """Positions, normals, texture places and triangles of a panel."""
    document, data = parse(path)
    mesh = document["meshes"][document["nodes"][panel]["mesh"]]
    (primitive,) = mesh["primitives"]
    names = ("POSITION", "NORMAL", "TEXCOORD_0")
    vertex = [numbers(document, data, primitive["attributes"][name]) for name in names]
    return *vertex, numbers(document, data, primitive["indices"]).reshape(-1, 3)


def test_positions_are_metres_with_y_up(tmp_path):
    mesh = cone_shell()
    position, _, _, triangles = arrays(written(part(mesh), tmp_path).path)
    x, y, z = mesh.vertices.T
    # float32 of 0.1 m: half a step is 3.7e-9
    assert np.abs(position - np.stack([x, z, -y], axis=-1) / 1000).max() < 4e-9
    assert np.array_equal(triangles, mesh.triangles)


def test_bounds_are_those_of_the_numbers_in_the_file(tmp_path):
    path = written(part(cone_shell()), tmp_path).path
    document, data = parse(path)
    index = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    position = numbers(document, data, index)
    assert document["accessors"][index]["min"] == position.min(axis=0).tolist()
    assert document["accessors"][index]["max"] == position.max(axis=0).tolist()


def test_normals_are_unit_and_stand_on_the_triangles(tmp_path):
    position, normal, _, triangles = arrays(written(part(cone_sheet(161)), tmp_path).path)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0, abs=1e-7)  # float32
    a, b, c = position[triangles].transpose(1, 0, 2)
    facet = np.cross(b - a, c - a)
    facet /= np.linalg.norm(facet, axis=1)[:, None]
    # the front: counterclockwise; a strip of 260 / 160 degrees turns by half of that
    assert np.einsum("ij,ij->i", facet, normal[triangles[:, 0]]).min() > np.cos(np.radians(1.7))


def test_texture_is_the_flat_pattern_at_one_scale(tmp_path):
    mesh = cone_sheet(161)
    path = written(part(mesh), tmp_path).path
    position, _, place, _ = arrays(path)
    scale = parse(path)[0]["extras"]["mm_per_uv"]
    assert place.min() == 0.0 and place.max() == 1.0
    rulings = position.reshape(161, 3, 3) * 1000
    flat = place.reshape(161, 3, 2) * scale
    along = np.linalg.norm(np.diff(rulings, axis=1), axis=2)
    assert np.abs(np.linalg.norm(np.diff(flat, axis=1), axis=2) - along).max() < 5e-5  # float32
    # the chord between two rulings, in space and unrolled: the angle shrinks by sin(half angle)
    across = np.linalg.norm(np.diff(rulings, axis=0), axis=2)
    unrolled = np.linalg.norm(np.diff(flat, axis=0), axis=2)
    step = np.radians(260.0) / 160
    expected = across * np.sin(step * SIN_HALF_ANGLE / 2) / (np.sin(step / 2) * SIN_HALF_ANGLE)
    assert np.abs(unrolled - expected).max() < 5e-5


def test_pattern_is_seen_from_the_front_in_the_texture(tmp_path):
    # v counts downwards, so a triangle that is counterclockwise in the pattern is clockwise here
    _, _, place, triangles = arrays(written(part(cone_sheet()), tmp_path).path)
    a, b, c = place[triangles].transpose(1, 0, 2)
    u, w = b - a, c - a
    assert np.all(u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0] < 0.0)


def test_panels_share_one_scale_and_stay_inside_the_texture(tmp_path):
    sheet = cone_sheet()
    small = Mesh(
        sheet.vertices * 0.5,
        sheet.normals,
        sheet.flat * 0.5 + [-70.0, 30.0],
        sheet.triangles,
        sheet.weld,
        False,
        0.5 * sheet.deviation,
    )
    path = written(part(sheet, small), tmp_path).path
    document, _ = parse(path)
    assert [node["name"] for node in document["nodes"]] == ["cone-1", "cone-2"]
    assert [mesh["name"] for mesh in document["meshes"]] == ["cone-1", "cone-2"]
    first, second = arrays(path, 0)[2], arrays(path, 1)[2]
    assert np.ptp(first, axis=0) == pytest.approx(2 * np.ptp(second, axis=0), abs=2e-7)
    for place in (first, second):
        assert place.min() >= 0.0 and place.max() <= 1.0
    scale = document["extras"]["mm_per_uv"]
    for node, place in zip(document["nodes"], (first, second), strict=True):
        corner = np.array([place[:, 0].min(), 1.0 - place[:, 1].max()])
        assert corner * scale == pytest.approx(node["extras"]["uv_offset_mm"], abs=2e-5)


def test_extras_tell_scale_thickness_area_and_part_number(tmp_path):
    one = part(cone_shell(), thickness=2.0, part_number="A-17/b")
    document, _ = parse(written(one, tmp_path).path)
    side = max(np.ptp(cone_shell().flat, axis=0))
    expected = {"mm_per_uv": pytest.approx(side), "units": "mm", "part_number": "A-17/b"}
    assert document["extras"] == expected
    facts = expected | {"thickness": 2.0, "area": pytest.approx(AREA)}
    assert document["meshes"][0]["extras"] == facts
    assert document["nodes"][0]["extras"] == facts
    plain, _ = parse(written(part(cone_shell(), name="plain"), tmp_path).path)
    assert "part_number" not in plain["extras"]


def test_material_is_a_two_sided_sheet_of_linear_colour(tmp_path):
    document, _ = parse(written(part(cone_sheet(), colour=(0.0, 0.5, 1.0)), tmp_path).path)
    (material,) = document["materials"]
    surface = material["pbrMetallicRoughness"]
    assert material["doubleSided"] is True
    assert surface["metallicFactor"] <= 0.3
    # sRGB 0.5 is 21.4 percent of white (IEC 61966-2-1)
    assert surface["baseColorFactor"] == pytest.approx([0.0, 0.2140411, 1.0, 1.0], abs=1e-7)
    assert document["asset"]["version"] == "2.0"
    assert document["asset"]["generator"].startswith("devcad ")


@pytest.mark.parametrize(("vertices", "kind"), [(65535, 5123), (65538, 5125)])
def test_indices_are_short_as_long_as_no_index_is_65535(tmp_path, vertices, kind):
    document, _ = parse(written(part(cone_sheet(vertices // 3)), tmp_path).path)
    indices = document["meshes"][0]["primitives"][0]["indices"]
    assert document["accessors"][indices]["componentType"] == kind


def test_odd_count_of_short_indices_keeps_the_next_panel_aligned(tmp_path):
    sheet = cone_sheet()
    odd = replace(sheet, triangles=sheet.triangles[:-1])  # 3 x 159 indices of 2 bytes
    path = written(part(odd, sheet), tmp_path).path
    assert np.array_equal(arrays(path, 0)[3], odd.triangles)
    assert np.array_equal(arrays(path, 1)[3], sheet.triangles)


def test_views_tell_what_they_hold_and_fill_the_buffer(tmp_path):
    document, data = parse(written(part(cone_shell()), tmp_path).path)
    assert [view["target"] for view in document["bufferViews"]] == [34962] * 3 + [34963]
    last = document["bufferViews"][-1]
    assert last["byteOffset"] + last["byteLength"] <= len(data)
    assert document["buffers"] == [{"byteLength": len(data)}]


def test_triangle_that_uses_a_vertex_twice_is_left_out(tmp_path):
    sheet = cone_sheet()
    extra = np.array([[4, 4, 9]], dtype=np.int32)
    folded = replace(sheet, triangles=np.concatenate([extra, sheet.triangles]))
    assert np.array_equal(arrays(written(part(folded), tmp_path).path)[3], sheet.triangles)


@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_rounding_is_measured_and_added_to_the_meshs_deviation(tmp_path, shift):
    mesh = moved(cone_shell(), (shift, shift, shift))
    one = written(part(mesh), tmp_path)
    x, y, z = arrays(one.path)[0].T * 1000
    away = np.linalg.norm(np.stack([x, -z, y], axis=-1) - mesh.vertices, axis=1).max()
    (check,) = one.checks
    assert away * (1 - 1e-9) <= check.value <= np.sqrt(3.0) * away
    assert one.max_deviation == pytest.approx(mesh.deviation + check.value, rel=1e-12)


def test_trimesh_reads_names_and_size(tmp_path):
    mesh = cone_shell()
    path = written(part(mesh, moved(mesh, (300, 0, 0))), tmp_path).path
    scene = trimesh.load(path)
    assert sorted(scene.geometry) == ["cone-1", "cone-2"]
    (x0, y0, z0), (x1, y1, z1) = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    expected = np.array([[x0, z0, -y1], [x1 + 300, z1, -y0]]) / 1000
    assert scene.bounds == pytest.approx(expected, abs=2e-8)  # float32 of 0.4 m


def test_equal_parts_give_equal_ascii_bytes(tmp_path):
    first = written(part(cone_shell()), tmp_path).path.read_bytes()
    assert written(part(cone_shell()), tmp_path).path.read_bytes() == first
    (size,) = struct.unpack_from("<I", first, 12)
    assert first[20 : 20 + size].isascii()


def test_normal_of_no_length_is_refused(tmp_path):
    sheet = cone_sheet()
    normals = sheet.normals.copy()
    normals[5] = 0.0
    with pytest.raises(CheckFailed, match="not unit"):
        glb.write(part(replace(sheet, normals=normals)), tmp_path, Options())


@pytest.mark.parametrize("offset", [4, 14, 30, -20001, -9001, -5001, -2001, -1])
def test_damaged_file_is_noticed(tmp_path, monkeypatch, offset):
    # version, length and text of the JSON; the exponent of a position, a normal, a texture
    # place; indices
    path = tmp_path / "cone.glb"
    read_back = glb._read_back

    def spoil_first(*args):
        content = bytearray(path.read_bytes())
        content[offset] ^= 0x40
        path.write_bytes(content)
        return read_back(*args)

    monkeypatch.setattr(glb, "_read_back", spoil_first)
    with pytest.raises(CheckFailed, match="glb-readback"):
        glb.write(part(cone_shell()), tmp_path, Options())


def test_torn_file_is_noticed(tmp_path, monkeypatch):
    path = tmp_path / "cone.glb"
    read_back = glb._read_back

    def tear_first(*args):
        path.write_bytes(path.read_bytes()[:-4])
        return read_back(*args)

    monkeypatch.setattr(glb, "_read_back", tear_first)
    with pytest.raises(CheckFailed, match="bytes, not"):
        glb.write(part(cone_shell()), tmp_path, Options())


def test_file_longer_than_its_own_length_can_say_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(glbfile, "MOST_BYTES", 1000)
    with pytest.raises(LimitError, match="limit 1000"):
        glb.write(part(cone_shell()), tmp_path, Options())


def test_folder_that_is_missing_is_one_clear_line(tmp_path):
    with pytest.raises(FileError, match=r"cannot write cone\.glb: No such file"):
        glb.write(part(cone_sheet()), tmp_path / "none", Options())


def test_full_disk_is_a_file_error(tmp_path):
    (tmp_path / "cone.glb").symlink_to("/dev/full")
    with pytest.raises(FileError, match="No space left"):
        glb.write(part(cone_sheet()), tmp_path, Options())
