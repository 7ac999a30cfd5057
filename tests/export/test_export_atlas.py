"""The texture of several panels: read from the file, laid out with shapely."""

from __future__ import annotations

import json
import struct
import subprocess
import sys

import numpy as np
import pytest
import shapely

import devcad
from devcad.export import Options, atlas, glb
from devcad.flatten.pattern import Edge, Pattern

TURN = 2.0 * np.pi


def arc(radius, start, end):
    def curve(u):
        c, s = np.cos(u), np.sin(u)
        return radius * np.stack([c, s], axis=1), radius * np.stack([-s, c], axis=1)

    return Edge("top", curve, np.array([start, end]))


def straight(a, b):
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return Edge(
        "start",
        lambda u: (a + u[:, None] * (b - a), np.broadcast_to(b - a, (len(u), 2))),
        np.array([0.0, 1.0]),
    )


def at(radius, angle):
    return radius * np.array([np.cos(angle), np.sin(angle)])


def sector(inner, outer, sweep):
    """The sector of a ring, from the angle 0 on, and its polygon."""
    outline = (
        straight(at(inner, 0.0), at(outer, 0.0)),
        arc(outer, 0.0, sweep),
        straight(at(outer, sweep), at(inner, sweep)),
        arc(inner, sweep, 0.0),
    )
    u = np.union1d(np.linspace(0.0, sweep, 2001), [min(sweep, 0.25 * TURN)])
    ring = np.concatenate([arc(outer, 0, 1).curve(u)[0], arc(inner, 0, 1).curve(u[::-1])[0]])
    area = 0.5 * sweep * (outer**2 - inner**2)
    box = (*ring.min(axis=0).tolist(), *ring.max(axis=0).tolist())
    return Pattern(outline, (), area, box), ring


def laid_out(rings, patterns, placed):
    return [
        shapely.Polygon(ring - pattern.bbox[:2] + offset)
        for ring, pattern, offset in zip(rings, patterns, placed.offsets, strict=True)
    ]


def read(path):
    """The document of a GLB file and its binary chunk."""
    content = path.read_bytes()
    (size,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + size]), content[28 + size :]


def uv_triangles(document, data, panel):
    (primitive,) = document["meshes"][document["nodes"][panel]["mesh"]]["primitives"]
    out = []
    for index, width in ((primitive["attributes"]["TEXCOORD_0"], 2), (primitive["indices"], 1)):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        count = accessor["count"] * width
        out.append(np.frombuffer(data, kind, count, view["byteOffset"]).reshape(-1, width))
    return out[0][out[1].reshape(-1, 3)].astype(float)


CONES = "".join(
    f"""
[[panel]]
name = "ring-{k}"
[panel.surface]
kind = "frustum"
radius = {60 + 20 * k}
top_radius = {40 + 20 * k}
height = {10 + 5 * k}
sweep = {150 + 30 * k}
"""
    for k in range(1, 5)
)
GLOBE = '[surface]\nkind = "gore"\nradius = 100\ncount = 12\npanels = "all"\n'
JOBS = {"cones": CONES, "globe": GLOBE, "thick": "thickness = 3\n" + CONES}


@pytest.fixture(scope="module", params=JOBS)
def exported(request, tmp_path_factory):
    """A part of several panels and its file."""
    folder = tmp_path_factory.mktemp(request.param)
    job = folder / "job.toml"
    job.write_text(f'name = "{request.param}"\n{JOBS[request.param]}')
    part = devcad.build(job)
    (written,) = glb.write(part, folder, Options())
    return part, written.path


def test_the_patterns_stand_in_the_texture_at_one_scale_and_the_offset_told(exported):
    part, path = exported
    document, data = read(path)
    side = document["extras"]["mm_per_uv"]
    corners = []
    for k, panel in enumerate(part.panels):
        facts = document["nodes"][k]["extras"]
        assert facts["mm_per_uv"] == side
        assert facts == document["meshes"][k]["extras"]
        uv = uv_triangles(document, data, k).reshape(-1, 2)
        assert uv.min() >= 0.0 and uv.max() <= 1.0
        back = np.stack([uv[:, 0], 1.0 - uv[:, 1]], axis=1) * side
        back += np.array(panel.pattern.bbox[:2]) - facts["uv_offset_mm"]
        true = panel.mesh.flat[panel.mesh.triangles].reshape(-1, 2)
        assert np.abs(back - true).max() < 1.2e-7 * side  # float32
        corners.append(np.array(panel.pattern.bbox[2:]) - panel.pattern.bbox[:2])
        corners[-1] += facts["uv_offset_mm"]
    assert np.max(corners) == pytest.approx(side, rel=1e-15)  # no larger than it must be


def test_no_two_panels_share_a_place_in_the_texture(exported):
    part, path = exported
    document, data = read(path)
    charts = []
    for k in range(len(part.panels)):
        corners = uv_triangles(document, data, k)
        u, w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        real = np.abs(u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) > 1e-12  # walls have no area
        charts.append(shapely.union_all(shapely.polygons(corners[real])))
    gaps = [a.distance(b) for k, a in enumerate(charts) for b in charts[:k]]
    assert min(gaps) > 1.0 / 1024  # a pixel of a texture of that size


def test_arcs_are_laid_into_each_others_hollows():
    patterns, rings = zip(*[sector(r, r + 12.0, 2.6) for r in (30, 50, 70, 90)], strict=True)
    placed = atlas.atlas(patterns, [0.0] * 4)
    boxes = np.array([pattern.bbox for pattern in patterns])
    sizes = boxes[:, 2:] - boxes[:, :2]
    assert (placed.offsets + sizes <= sizes[-1] + 1e-9).all()  # all in the largest one's box
    shapes = laid_out(rings, patterns, placed)
    cell = placed.side / atlas.CELLS
    assert min(a.distance(b) for k, a in enumerate(shapes) for b in shapes[:k]) > cell


def test_one_panel_fills_the_texture_as_ever(tmp_path):
    job = tmp_path / "one.toml"
    job.write_text(
        'name = "one"\n[surface]\nkind = "frustum"\nradius = 100\ntop_radius = 50\nheight = 120\n'
    )
    part = devcad.build(job)
    (written,) = glb.write(part, tmp_path, Options())
    document, data = read(written.path)
    xmin, ymin, xmax, ymax = part.panels[0].pattern.bbox
    side = max(xmax - xmin, ymax - ymin)
    assert document["extras"]["mm_per_uv"] == side
    assert "uv_offset_mm" not in document["nodes"][0]["extras"]
    flat = part.panels[0].mesh.flat[part.panels[0].mesh.triangles]
    expected = np.stack([(flat[..., 0] - xmin) / side, 1.0 - (flat[..., 1] - ymin) / side], axis=-1)
    assert np.array_equal(uv_triangles(document, data, 0), np.float32(expected).clip(0.0, 1.0))


def test_moving_a_pattern_in_its_own_plane_moves_nothing_in_the_texture():
    patterns, _ = zip(*[sector(r, r + 9.0, 0.25 * TURN) for r in (20, 30, 45)], strict=True)
    moved = [
        Pattern(
            tuple(
                Edge(e.name, lambda u, e=e: (e.curve(u)[0] + [64.0, -32.0], e.curve(u)[1]), e.u)
                for e in p.outline
            ),
            (),
            p.area,
            (p.bbox[0] + 64.0, p.bbox[1] - 32.0, p.bbox[2] + 64.0, p.bbox[3] - 32.0),
        )
        for p in patterns
    ]
    one, other = (atlas.atlas(each, [0.01] * 3) for each in (patterns, moved))
    assert np.abs(one.offsets - other.offsets).max() < 1e-12


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e7])
def test_patterns_of_any_size_are_placed_apart(scale):
    made = [sector(r * scale, (r + 12) * scale, 2.0) for r in (30, 50, 70)]
    patterns, rings = zip(*made, strict=True)
    placed = atlas.atlas(patterns, [1e-3 * scale] * 3)
    shapes = (
        laid_out(np.array(rings) / scale, patterns, placed)
        if scale == 1.0
        else [
            shapely.Polygon((ring - p.bbox[:2] + offset) / scale)
            for ring, p, offset in zip(rings, patterns, placed.offsets, strict=True)
        ]
    )
    assert min(a.distance(b) for k, a in enumerate(shapes) for b in shapes[:k]) > 0.1


def test_boxes_stand_on_shelves_where_the_packer_lays_charts_over_one_another(monkeypatch):
    patterns, rings = zip(*[sector(r, r + 12.0, 2.6) for r in (30, 50, 70, 90)], strict=True)
    monkeypatch.setattr(atlas, "_filled", lambda given, cells: np.zeros((len(given), 2)))
    placed = atlas.atlas(patterns, [0.0] * 4)
    boxes = [shapely.box(*shape.bounds) for shape in laid_out(rings, patterns, placed)]
    assert min(a.distance(b) for k, a in enumerate(boxes) for b in boxes[:k]) > 0.5


def test_a_chart_that_is_turned_or_stretched_is_not_taken():
    square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 4.0], [0.0, 4.0]], np.float32)
    fan = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    assert atlas._filled([(square, fan)] * 2, 64) is not None
    assert atlas._filled([(square, fan)] * 40, 32) is None  # more than one texture
    assert atlas._filled([(10.0 * square, fan)] * 2, 64) is None  # shrunk to fit
    assert atlas._filled([(square, None)] * 2, 64) is None


RING = np.array([[0, 0], [30, 0], [30, 30], [20, 30], [20, 10], [10, 10], [10, 30], [0, 30]])
BLOCK = np.array([[0, 0], [6, 0], [6, 8], [0, 8]])


@pytest.mark.parametrize(
    ("offset", "free"),
    [
        ((12, 15), True),  # in the hollow
        ((12, 10.005), False),  # too near
        ((8, 15), False),  # across a side
        ((1, 1), False),  # inside
        ((31, 0), True),
    ],
)
def test_charts_may_lie_in_a_hollow_but_not_in_one_another(offset, free):
    charts = [
        atlas._Chart(shape.astype(float), np.ptp(shape, axis=0).astype(float), 0.01)
        for shape in (RING, BLOCK)
    ]
    assert atlas.disjoint(charts, np.array([[0.0, 0.0], offset])) is free


@pytest.mark.slow
def test_two_processes_write_the_same_bytes(tmp_path):
    """xatlas runs threads; the places may not depend on which is first."""
    job = tmp_path / "job.toml"
    job.write_text(f'name = "globe"\n{GLOBE}')
    code = (
        "import sys, devcad; devcad.export(devcad.build(sys.argv[1]), sys.argv[2], formats=['glb'])"
    )
    files = []
    for k in "12":
        subprocess.run([sys.executable, "-c", code, str(job), str(tmp_path / k)], check=True)
        files.append((tmp_path / k / "globe" / "globe.glb").read_bytes())
    assert files[0] == files[1]
