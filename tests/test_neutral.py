"""Whole parts with a neutral fibre: the blank, the solid, the files and the report agree."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

import devcad
from devcad.mesh.build import volume

TUBE = '[surface]\nkind = "cylinder"\nradius = 10\nlength = 40\n'
NEUTRAL = "thickness = 2\n[recipe.neutral]\n"


def build(folder, text):
    job = folder / "job.toml"
    job.write_text(f'name = "job"\n{text}')
    return devcad.build(job)


def report(folder, text, *formats):
    part = build(folder, text)
    return devcad.export(part, folder, formats=list(formats))


@pytest.mark.parametrize(
    ("key", "k", "source"),
    [
        ("k = 0.4", 0.4, "k"),
        ("k_din = 0.8", 0.4, "k_din"),
        ("table = [[1, 0.3], [9, 0.5]]", 0.5, "table"),
        ("table = [[1, 0.3], [7.5, 0.5], [8.5, 0.4]]", 0.4, "table"),
        ('standard = "din6935"', 0.25 * (1.3 + np.log10(4.5)), "din6935"),
        ("", 0.5, "default: the middle surface"),
    ],
)
def test_the_blank_of_a_tube_is_as_long_as_its_neutral_fibre(tmp_path, key, k, source):
    # R = 10, T = 2: inside 9, ratio 4.5; the second table row is met beyond its first kink
    if "table" in key:
        rows = {"[9, 0.5]]": 0.3 + 0.2 * 3.5 / 8, "[8.5, 0.4]]": 0.3 + 0.2 * 3.5 / 6.5}
        k = next(value for end, value in rows.items() if key.endswith(end))
    (panel,) = build(tmp_path, f"{NEUTRAL}{key}\n{TUBE}").panels
    assert panel.facts["k_neutral"] == pytest.approx(k, rel=1e-12)
    assert panel.facts["k_source"] == source
    length = 2 * np.pi * (9 + k * 2)
    assert panel.facts["flat_area"] == pytest.approx(40 * length, rel=1e-12)
    assert panel.facts["flat_bbox"][3] == pytest.approx(length, rel=1e-12)
    assert panel.facts["area"] == pytest.approx(2 * np.pi * 10 * 40, rel=1e-12)
    assert panel.facts["figures"].get("neutral_rest", 0.0) == 0.0


def test_a_recipe_that_is_silent_leaves_the_report_as_it_was(tmp_path):
    (panel,) = build(tmp_path, f"thickness = 2\n{TUBE}").panels
    assert panel.facts["k_neutral"] is None
    assert panel.facts["k_source"] is None
    assert panel.blank.isometric
    assert panel.surface_area is None


def test_the_material_s_k_is_told_with_its_doubt_and_the_mass_is_the_solid_s(tmp_path):
    text = f'material = "dc01"\n{NEUTRAL}{TUBE}'
    (panel,) = build(tmp_path, text).panels
    assert panel.facts["k_neutral"] == 0.42
    assert panel.facts["k_source"] == "material dc01, not verified"
    solid = np.pi * (11**2 - 9**2) * 40
    assert panel.facts["mass_g"] == pytest.approx(solid * 7.85e-3, rel=1e-12)
    assert volume(panel.mesh) == pytest.approx(solid, abs=panel.facts["area"] * 0.05)


def test_half_the_thickness_gives_the_files_of_today_to_the_byte(tmp_path):
    files = {}
    for name, text in (("today", "thickness = 2\n"), ("half", f"{NEUTRAL}k = 0.5\n")):
        folder = tmp_path / name
        folder.mkdir()
        report(folder, text + TUBE, "svg", "dxf", "glb")
        files[name] = {p.name: p.read_bytes() for p in (folder / "job").iterdir()}
        files[name].pop("report.json")  # tells the hash of the job, and the page tells all of it
        files[name].pop("index.html")
    assert files["today"] == files["half"]


@pytest.mark.parametrize("key", ["k = 0", "k = 0.33"])
def test_the_texture_is_the_blank(tmp_path, key):
    text = f'{NEUTRAL}{key}\n[surface]\nkind = "frustum"\nradius = 30\ntop_radius = 0\nheight = 40'
    report(tmp_path, text, "glb")
    data = (tmp_path / "job" / "job.glb").read_bytes()
    size = struct.unpack("<I", data[12:16])[0]
    tree, buffer = json.loads(data[20 : 20 + size]), data[28 + size :]
    (mesh,) = tree["meshes"]
    accessor = tree["accessors"][mesh["primitives"][0]["attributes"]["TEXCOORD_0"]]
    view = tree["bufferViews"][accessor["bufferView"]]
    uv = np.frombuffer(buffer, np.float32, 2 * accessor["count"], view.get("byteOffset", 0))
    assert uv.min() >= 0.0
    assert uv.max() == pytest.approx(1.0, abs=1e-6)  # the longer side of the blank is 1


@pytest.mark.parametrize("bend", [0.0, 0.3])
def test_a_tube_opens_from_its_blank(tmp_path, bend):
    text = f"bend = {bend}\n{NEUTRAL}k = 0.3\n{TUBE}"
    (panel,) = build(tmp_path, text).panels
    flat, whole = 2 * np.pi * 9.6 * 40, 2 * np.pi * 10 * 40
    assert panel.pattern.area == pytest.approx(flat, rel=1e-12)
    assert panel.area == pytest.approx(flat + bend * (whole - flat), rel=1e-12)
    assert panel.facts["area"] == pytest.approx(whole, rel=1e-12)
    assert volume(panel.mesh) == pytest.approx(2 * panel.area, abs=panel.area * 0.05)


@pytest.mark.slow
def test_the_step_solid_is_the_middle_s_and_the_step_blank_the_pattern_s(tmp_path):
    # a bracket with a sloping edge, a bend of 5 mm and a hole over its beginning
    text = (
        f"{NEUTRAL}k = 0.3\n"
        '[[cutout]]\nshape = "circle"\ndiameter = 10\nat = [20, 34]\n'
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\n'
        'extent = ["0", "60 - 10*t"]\n[surface.directrix]\nkind = "polyline"\n'
        "corner_radius = 6\npoints = [[0, 0, 0], [40, 0, 0], [40, 40, 0]]\n"
    )
    found = report(tmp_path, text, "step", "step-flat", "dxf", "glb")
    checks = {(c["name"], c["passed"]) for c in found["checks"]}
    assert {("volume", True), ("step-deviation", True), ("isometry", True)} <= checks
    (panel,) = found["panels"]
    # two flats of 34 and a bend: 90 degrees of 6 on the middle, of 5 + 0.6 on the blank
    assert panel["area"] > panel["flat_area"]
    middle, blank = 68 + 3 * np.pi, 68 + 0.5 * np.pi * 5.6
    assert panel["flat_bbox"][3] == pytest.approx(blank, rel=1e-12)
    mean = 55.0  # of the width 60 .. 50 along the length; symmetric on the bend
    assert panel["area"] == pytest.approx(mean * middle - 25 * np.pi, rel=0.02)
    assert panel["flat_area"] == pytest.approx(mean * blank - 25 * np.pi, rel=1e-11)
