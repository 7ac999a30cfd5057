"""3MF: read with zipfile and an XML parser, which know nothing of our writer, and with lib3mf."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

import lib3mf
import meshes
import numpy as np
import pytest
from meshes import AREA, cone_sheet, cone_shell, moved, part, volume

from devcad import __version__
from devcad.errors import CheckFailed, FileError, GeometryError
from devcad.export import Options, threemf

THICKNESS = 2.0
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"


def written(one, folder):
    (made,) = threemf.write(one, folder, Options())
    return made


def model(path):
    """The root of the model that the package's own relation leads to."""
    with ZipFile(path) as package:
        assert package.testzip() is None
        relations = ElementTree.fromstring(package.read("_rels/.rels"))
        (relation,) = relations
        assert relation.get("Type").endswith("/2013/01/3dmodel")
        return ElementTree.fromstring(package.read(relation.get("Target").removeprefix("/")))


def objects(path):
    return list(model(path).iter(f"{CORE}object"))


def numbers(thing, tag, *names):
    return np.array([[row.get(n) for n in names] for row in thing.iter(CORE + tag)])


def corners(thing):
    """The corners of an object's facets, (m, 3, 3), as double precision reads them."""
    points = numbers(thing, "vertex", "x", "y", "z").astype(float)
    return points[numbers(thing, "triangle", "v1", "v2", "v3").astype(int)]


def test_unit_metadata_names_and_one_item_a_panel(tmp_path):
    shell = cone_shell()
    two = replace(
        part(shell, moved(shell, (300, 0, 0)), name="two"),
        description='a "shade" & <frame>',
        part_number="D-7",
    )
    made = written(two, tmp_path)
    assert (made.path, made.format) == (tmp_path / "two.3mf", "3mf")
    root = model(made.path)
    assert root.tag == f"{CORE}model"
    assert root.get("unit") == "millimeter"
    told = {m.get("name"): m.text for m in root.iter(f"{CORE}metadata")}
    assert told == {
        "Title": "two",
        "Application": f"devcad {__version__}",
        "Description": 'a "shade" & <frame>',
    }
    things = objects(made.path)
    assert [(o.get("name"), o.get("type")) for o in things] == [
        ("two-1", "model"),
        ("two-2", "model"),
    ]
    assert {o.get("partnumber") for o in things} == {"D-7"}
    items = [(i.get("objectid"), i.get("transform")) for i in root.iter(f"{CORE}item")]
    assert items == [(o.get("id"), None) for o in things]


def test_vertices_are_the_meshs_points_to_float32_and_facets_its_own(tmp_path):
    mesh = cone_shell()
    (thing,) = objects(written(part(mesh), tmp_path).path)
    welded = np.zeros((mesh.weld.max() + 1, 3), np.float32)
    welded[mesh.weld] = mesh.vertices
    points = numbers(thing, "vertex", "x", "y", "z").astype(np.float32)
    assert np.array_equal(points, welded)
    indices = numbers(thing, "triangle", "v1", "v2", "v3").astype(int)
    assert np.array_equal(indices, mesh.weld[mesh.triangles])
    assert "-0" not in set(numbers(thing, "vertex", "x", "y", "z").ravel())


def test_solid_has_area_times_thickness_outward(tmp_path):
    (thing,) = objects(written(part(cone_shell(161)), tmp_path).path)
    # 160 chords a turn lie inside the arcs: 1 - sin(x) / x with x = sweep / 160, 1.3e-4
    assert volume(corners(thing)) == pytest.approx(AREA * THICKNESS, rel=3e-4)


def test_every_edge_has_two_facets_that_run_it_both_ways(tmp_path):
    (thing,) = objects(written(part(cone_shell()), tmp_path).path)
    a = numbers(thing, "triangle", "v1", "v2", "v3").astype(int)
    edges = {(int(i), int(j)) for row in a for i, j in zip(row, np.roll(row, -1), strict=True)}
    assert len(edges) == a.size
    assert edges == {(j, i) for i, j in edges}


def test_colour_is_the_parts_srgb(tmp_path):
    one = replace(part(cone_shell()), colour=(201 / 255, 168 / 255, 76 / 255))
    root = model(written(one, tmp_path).path)
    (base,) = root.iter(f"{CORE}base")
    assert base.get("displaycolor") == "#C9A84C"
    (group,) = root.iter(f"{CORE}basematerials")
    (thing,) = root.iter(f"{CORE}object")
    assert (thing.get("pid"), thing.get("pindex")) == (group.get("id"), "0")


def test_lib3mf_reads_strictly_without_a_warning_and_calls_it_manifold(tmp_path):
    path = written(part(cone_shell()), tmp_path).path
    read = lib3mf.get_wrapper().CreateModel()
    reader = read.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    found = read.GetMeshObjects()
    assert found.MoveNext()
    thing = found.GetCurrentMeshObject()
    assert thing.IsManifoldAndOriented()
    assert thing.GetName() == "cone"
    assert not found.MoveNext()


@pytest.mark.parametrize("scale", [0.1, 1.0, 1e4])
def test_rounding_is_measured_and_added_to_the_meshs_deviation(tmp_path, scale):
    mesh = cone_shell()
    mesh = replace(mesh, vertices=scale * mesh.vertices, deviation=0.001 * scale)
    one = written(part(mesh), tmp_path)
    (check,) = one.checks
    (thing,) = objects(one.path)
    off = np.linalg.norm(corners(thing) - mesh.vertices[mesh.triangles], axis=2).max()
    # nine digits move a number by 5e-9 of it beside the 6e-8 of single precision
    assert check.value <= 1.8 * off and off <= 1.1 * check.value
    assert (check.name, check.passed) == ("3mf-readback", True)
    assert one.max_deviation == pytest.approx(mesh.deviation + check.value, rel=1e-12)


def test_open_sheet_is_refused_with_a_remedy(tmp_path):
    with pytest.raises(GeometryError, match="panel cone: 3MF holds solids") as failure:
        threemf.write(part(cone_sheet()), tmp_path, Options())
    assert failure.value.code == 3
    assert "thickness" in failure.value.remedy and "stl" in failure.value.remedy
    assert list(tmp_path.iterdir()) == []


def test_points_that_rounding_makes_one_leave_no_orphans_and_no_gap(tmp_path):
    # beside 100 mm float32 steps by 7.6e-6: rulings 4.5e-6 mm apart fall on one another
    mesh = cone_shell(3, 2)
    fine = np.isin(mesh.weld, [2, 3])  # the middle ruling, front
    start = mesh.vertices[mesh.weld.argsort(kind="stable")][:2]
    vertices = mesh.vertices.copy()
    vertices[fine] = start[mesh.weld[fine] - 2] + [0.0, 1e-7, 0.0]
    one = written(part(replace(mesh, vertices=vertices)), tmp_path)
    (thing,) = objects(one.path)
    used = numbers(thing, "triangle", "v1", "v2", "v3").astype(int)
    count = len(numbers(thing, "vertex", "x", "y", "z"))
    assert np.array_equal(np.unique(used), np.arange(count))
    assert count < mesh.weld.max() + 1
    assert {check.unit for check in one.checks} == {"mm", "points"}


def test_solid_thinner_than_a_step_of_float32_is_refused(tmp_path):
    # at 1e7 mm neighbouring float32 numbers lie 1 mm apart, the sheet is 0.01 mm thick
    far = moved(cone_shell(thickness=0.01), (1e7, 1e7, 1e7))
    with pytest.raises(CheckFailed, match="3mf-readback") as failure:
        threemf.write(part(far), tmp_path, Options())
    assert (failure.value.panel, failure.value.place) == ("cone", "cone.3mf")


def repacked(path, change):
    """The package with its model's text changed."""
    with ZipFile(path) as package:
        parts = {name: package.read(name) for name in package.namelist()}
    parts["3D/3dmodel.model"] = change(parts["3D/3dmodel.model"].decode()).encode()
    with ZipFile(path, "w") as package:
        for name, data in parts.items():
            package.writestr(name, data)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('x="100', 'x="101', "vertices read differ"),
        ('v1="0"', 'v1="3"', "triangles read differ"),
        ('name="cone"', 'name="come"', "name 'come' was read"),
        ('unit="millimeter"', 'unit="inch"', "another unit"),
        ('<item objectid="2"/>', '<item objectid="2"/>\n<item objectid="2"/>', "2 objects"),
        ('v1="0"', 'v1="9999"', "lib3mf refuses"),
        ("</model>", "", "damaged: no element found"),
    ],
)
def test_changed_file_is_noticed(tmp_path, monkeypatch, old, new, says):
    read_back = threemf._read_back

    def spoil_first(path, *args):
        repacked(path, lambda text: text.replace(old, new, 1))
        return read_back(path, *args)

    monkeypatch.setattr(threemf, "_read_back", spoil_first)
    with pytest.raises(CheckFailed, match=f"3mf-readback: .*{says}"):
        threemf.write(part(cone_shell()), tmp_path, Options())


@pytest.mark.parametrize("keep", [0, 100, -1])
def test_cut_file_is_noticed(tmp_path, monkeypatch, keep):
    read_back = threemf._read_back

    def cut_first(path, *args):
        path.write_bytes(path.read_bytes()[:keep])
        return read_back(path, *args)

    monkeypatch.setattr(threemf, "_read_back", cut_first)
    with pytest.raises(CheckFailed, match="3mf-readback"):
        threemf.write(part(cone_shell()), tmp_path, Options())


def test_equal_parts_give_equal_bytes_in_one_process_and_in_two(tmp_path, capfd):
    first = written(part(cone_shell()), tmp_path).path.read_bytes()
    assert written(part(cone_shell()), tmp_path).path.read_bytes() == first
    assert capfd.readouterr() == ("", "")
    other = tmp_path / "other"
    other.mkdir()
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path; from meshes import cone_shell, part\n"
        "from devcad.export import Options, threemf\n"
        "threemf.write(part(cone_shell()), Path(sys.argv[2]), Options())\n"
    )
    here = Path(meshes.__file__).parent
    ran = subprocess.run(
        [sys.executable, "-c", code, str(here), str(other)],
        env=os.environ | {"PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo"},
        cwd=here.parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert (ran.stdout, ran.stderr) == ("", "")
    assert (other / "cone.3mf").read_bytes() == first
    with ZipFile(tmp_path / "cone.3mf") as package:
        assert {entry.date_time for entry in package.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_folder_that_is_missing_is_one_clear_line(tmp_path):
    with pytest.raises(FileError, match=r"cannot write cone\.3mf: No such file") as failure:
        threemf.write(part(cone_shell()), tmp_path / "none", Options())
    assert failure.value.code == 5


def test_full_disk_is_a_file_error(tmp_path):
    (tmp_path / "cone.3mf").symlink_to("/dev/full")
    with pytest.raises(FileError, match="No space left"):
        threemf.write(part(cone_shell()), tmp_path, Options())
