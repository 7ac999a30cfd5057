"""DXF files of every profile as shops' programs see them: a lint, a quoting tool's parser, FreeCAD,
and LibreCAD's printer."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import clients
import ezdxf
import ezdxf.path
import numpy as np
import pytest
from exported import Look

import devcad
from devcad.export import Options
from devcad.export import dxf as exporter
from devcad.export.profile import PROFILES, profile

pytestmark = pytest.mark.clients

SAMPLES = ("drilled-reducer", "square-duct", "three-piece-elbow")  # holes, bends, several panels
VERSIONS = ("R12", "R2000", "R2010")
SQUARE = """
name = "square"
[meta]
grain = 90
[recipe.labels]
height = 8
[surface]
kind = "plane"
height = 100
width = 100
"""
POUCH = """
name = "pouch"
thickness = 1.5
material = "veg-tan-leather"
pipeline = "leather"

[meta]
part_number = "P-3"
revision = "B"
quantity = 2
grain = 90

[recipe.stitch]
pitch = 4
inset = 10
hole = "round"
diameter = 1

[recipe.notches]
every = 5
shape = "V"
depth = 3

[recipe.labels]
height = 5

[[panel]]
name = "front"
[panel.surface]
kind = "plane"
width = 140
height = 90
[[panel.cutout]]
shape = "circle"
diameter = 20
at = [45, 45]
[panel.edges.top]
allowance = 10
[panel.edges.base]
finish = "turned"
[panel.edges.start]
finish = "tab"

[[panel]]
name = "back"
[panel.surface]
kind = "plane"
width = 140
height = 90
[panel.place]
origin = [140, 0, 0]
[panel.edges.base]
allowance = 10
[panel.edges.top]
finish = "lap"

[[seam]]
edges = ["front.top", "back.base"]
"""
"""Two pieces with everything that sewing, gluing and matching draws."""
SIDE = 100.0  # mm
DPI = 600


@pytest.fixture(scope="session")
def drawings(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], list[Path]]:
    """The files of three samples by profile and version."""
    home = tmp_path_factory.mktemp("profiles")
    (home / "pouch.toml").write_text(POUCH)
    jobs = [clients.REPOSITORY / "samples" / f"{name}.toml" for name in SAMPLES]
    parts = [devcad.build(job) for job in (*jobs, home / "pouch.toml")]
    found: dict[tuple[str, str], list[Path]] = {}
    for name in PROFILES:
        for version in VERSIONS:
            folder = home / f"{name}-{version}"
            folder.mkdir()
            options = Options(dxf_profile=name, dxf_version=version)
            files = [done for part in parts for done in exporter.write(part, folder, options)]
            found[name, version] = [done.path for done in files]
    return found


def _looker(answer: dict[str, Any]) -> Look:
    return lambda path: dict(answer[str(path)])


@pytest.fixture(scope="session")
def freecad_sees(
    drawings: dict[tuple[str, str], list[Path]], tmp_path_factory: pytest.TempPathFactory
) -> Look:
    files = [path for paths in drawings.values() for path in paths]
    return _looker(clients.freecad(files, tmp_path_factory.mktemp("freecad") / "answers"))


@pytest.fixture(scope="session")
def parser_sees(
    drawings: dict[tuple[str, str], list[Path]], tmp_path_factory: pytest.TempPathFactory
) -> Look:
    files = [path for paths in drawings.values() for path in paths]
    return _looker(clients.node(files, tmp_path_factory.mktemp("node") / "answer.json"))


def _entities(path: Path) -> list[Any]:
    """What a file draws, that of its blocks too."""
    document = ezdxf.readfile(path)
    assert not document.audit().has_errors
    space = list(document.modelspace())
    placed = [document.blocks.get(e.dxf.name) for e in space if e.dxftype() == "INSERT"]
    return [*space, *(entity for block in placed for entity in block)]


def _points(entity: Any) -> list[Any]:
    return list(ezdxf.path.make_path(entity, segments=64).flattening(1e-4))


def _closed(entity: Any) -> bool:
    if entity.dxftype() == "LWPOLYLINE":
        return bool(entity.closed)
    return entity.dxftype() == "CIRCLE" or bool(entity.is_closed)


def _length(entity: Any) -> float:
    if entity.dxftype() in ("TEXT", "POINT", "INSERT"):
        return 0.0
    return float(sum((b - a).magnitude for a, b in pairwise(_points(entity))))


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", PROFILES)
def test_a_lint_finds_closed_simple_cuts_and_nothing_else_on_their_layers(
    drawings: dict[tuple[str, str], list[Path]], name: str, version: str
) -> None:
    from shapely import Polygon

    for path in drawings[name, version]:
        cuts = [e for e in _entities(path) if e.dxf.layer in profile(name).cut_layers]
        cuts = [e for e in cuts if e.dxftype() not in ("TEXT", "INSERT") or name != "astm"]
        assert {e.dxftype() for e in cuts} <= {"LWPOLYLINE", "POLYLINE", "CIRCLE"}
        assert all(_closed(e) for e in cuts)
        rings = [Polygon([(p.x, p.y) for p in _points(e)]) for e in cuts]
        assert all(ring.is_valid for ring in rings)
        outer = max(rings, key=lambda ring: ring.area)
        assert all(outer.contains_properly(ring) for ring in rings if ring is not outer)
        boxes = Counter(tuple(round(x, 4) for x in ring.bounds) for ring in rings)
        assert max(boxes.values()) == 1  # nothing is cut twice


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", PROFILES)
def test_a_quoting_tools_parser_counts_the_same_entities_on_the_same_layers(
    drawings: dict[tuple[str, str], list[Path]], parser_sees: Look, name: str, version: str
) -> None:
    for path in drawings[name, version]:
        seen = parser_sees(path)
        assert "error" not in seen, seen["error"]
        found = Counter((e["type"], e["layer"]) for e in seen["entities"])
        assert found == Counter((e.dxftype(), e.dxf.layer) for e in _entities(path))


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", PROFILES)
def test_freecad_imports_every_line_at_its_length(
    drawings: dict[tuple[str, str], list[Path]], freecad_sees: Look, name: str, version: str
) -> None:
    for path in drawings[name, version]:
        seen = freecad_sees(path)
        assert "error" not in seen, seen["error"]
        found = sum(layer["length"] for layer in seen["layers"].values())
        assert found == pytest.approx(sum(map(_length, _entities(path))), rel=1e-5)


def _pouch(drawings: dict[tuple[str, str], list[Path]], name: str) -> list[Path]:
    """The drawings of its two pieces, front and back, in the profile's old version."""
    return [path for path in drawings[name, "R12"] if path.name.startswith("pouch")]


def test_a_sewn_piece_tells_its_holes_notches_grain_and_labels(
    drawings: dict[tuple[str, str], list[Path]], parser_sees: Look
) -> None:
    """As D6673 numbers them: drill holes 13, notches 4, grain 7, sew lines 14, cutout 11, and on 8
    what is drawn; 70 mm of the seam of 90 are sewn with 18 holes, and every fifth has a notch."""
    front, back = _pouch(drawings, "astm")
    for path, cutouts in ((front, 1), (back, 0)):
        found = Counter((e["type"], e["layer"]) for e in parser_sees(path)["entities"])
        assert found["POINT", "13"] == 18
        assert found["POINT", "4"] == 4
        assert found["LINE", "7"] == 1
        assert found["POLYLINE", "11"] == cutouts
        assert found["LINE", "14"] >= 1
        assert found["POLYLINE", "8"] > 10
        assert {e["layer"] for e in parser_sees(path)["entities"]} <= set(profile("astm").layers)


def test_notches_lie_on_the_boundary_and_holes_and_labels_inside_it(
    drawings: dict[tuple[str, str], list[Path]],
) -> None:
    from shapely import LineString, Point, Polygon

    for path in _pouch(drawings, "astm"):
        found: dict[tuple[str, str], list[Any]] = {}
        for entity in _entities(path):
            found.setdefault((entity.dxftype(), entity.dxf.layer), []).append(entity)
        (boundary,) = found["POLYLINE", "1"]
        piece = Polygon([(p.x, p.y) for p in _points(boundary)])
        places = {layer: found["POINT", layer] for layer in ("4", "13")}
        points = {
            layer: [Point(tuple(e.dxf.location)[:2]) for e in some]
            for layer, some in places.items()
        }
        assert max(piece.exterior.distance(point) for point in points["4"]) < 1e-9
        assert all(piece.contains(point) for point in points["13"])
        drawn = [e for kind in ("LINE", "POLYLINE") for e in found[kind, "8"]]
        lines = [LineString([(p.x, p.y) for p in _points(e)]) for e in drawn]
        assert all(piece.buffer(1e-6).contains(line) for line in lines)


@pytest.mark.parametrize("name", ["sendcutsend", "lightburn"])
def test_a_service_cuts_outline_and_holes_and_engraves_the_labels(
    drawings: dict[tuple[str, str], list[Path]], parser_sees: Look, name: str
) -> None:
    for path, holes in zip(_pouch(drawings, name), (19, 18), strict=True):
        seen = parser_sees(path)["entities"]
        assert Counter(e["layer"] for e in seen)["CUT"] == 1 + holes
        assert Counter(e["layer"] for e in seen)["ENGRAVE"] > 20


@pytest.mark.parametrize("name", PROFILES)
def test_librecad_prints_a_square_of_100_mm(tmp_path: Path, name: str) -> None:
    job = tmp_path / "square.toml"
    job.write_text(SQUARE)
    part = devcad.build(job)
    (done,) = exporter.write(part, tmp_path, Options(dxf_profile=name))
    printed = clients.librecad(done.path)
    width, height = _printed_size(printed)
    assert width == pytest.approx(SIDE, abs=0.1)
    assert height == pytest.approx(SIDE, abs=0.1)


def _printed_size(pdf: Path) -> tuple[float, float]:
    """Width and height in mm between the middles of the outermost long lines of a page."""
    stem = pdf.with_suffix("")
    clients.run([clients.program("pdftoppm"), "-r", str(DPI), "-gray", "-singlefile", pdf, stem])
    data = stem.with_suffix(".pgm").read_bytes()
    _, size, _, pixels = data.split(b"\n", 3)
    columns, rows = map(int, size.split())
    dark = np.frombuffer(pixels, dtype=np.uint8).reshape(rows, columns) < 128
    return _between(dark.sum(axis=0)), _between(dark.sum(axis=1))


def _between(dark: Any) -> float:
    """mm between the middles of the first and the last long line, by dark dots across."""
    long = np.flatnonzero(dark > 0.9 * SIDE / 25.4 * DPI)
    groups = np.split(long, np.flatnonzero(np.diff(long) > 2) + 1)
    return float((groups[-1].mean() - groups[0].mean()) * 25.4 / DPI)
