"""devcad nest: sheets that a cutter can read, a list that says where everything lies."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
from ezdxf import path as ezpath

from devcad.cli import run
from devcad.pipeline import build

REPOSITORY = Path(__file__).parents[1]
PLATE = """
name = "plate"
thickness = 1.5
material = "dc01"
[meta]
quantity = {quantity}
grain = 90
[surface]
kind = "plane"
width = 90
height = 60
[[cutout]]
shape = "circle"
diameter = 12
at = [20, 20]
[[cutout]]
shape = "slot"
length = 40
width = 10
angle = 30
at = [60, 30]
[[mark]]
shape = "arrow"
length = 20
at = [45, 50]
"""
CONE = """
name = "cone"
thickness = 1.5
material = "dc01"
[meta]
quantity = 2
[surface]
kind = "frustum"
radius = 40
top_radius = 25
height = 40
"""
DUCT = """
name = "duct"
[[panel]]
name = "left"
[panel.surface]
kind = "plane"
width = 70
height = 40
[[panel]]
name = "right"
[panel.surface]
kind = "frustum"
radius = 30
top_radius = 20
height = 30
sweep = 180
"""


@pytest.fixture
def jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with three jobs, which is also the working folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plate.toml").write_text(PLATE.format(quantity=2))
    (tmp_path / "cone.toml").write_text(CONE)
    (tmp_path / "duct.toml").write_text(DUCT)
    return tmp_path


def closed_contours(file: Path) -> tuple[list[shapely.Polygon], list[shapely.Polygon]]:
    """The outer contours and the holes of a drawing to 1e-3 mm; every one of them is closed."""
    outer, inner = [], []
    for entity in ezdxf.readfile(file).modelspace():
        if not entity.dxf.layer.startswith("CUT"):
            continue
        assert entity.dxftype() == "CIRCLE" or entity.closed
        points = [(p.x, p.y) for p in ezpath.make_path(entity).flattening(1e-3)]
        assert np.allclose(points[0], points[-1])
        (outer if entity.dxf.layer == "CUT_OUTER" else inner).append(shapely.Polygon(points))
    return outer, inner


def assert_sheet(folder: Path, told: dict[str, object], number: int) -> None:
    """Closed contours on the sheet, apart by the gap, with the patterns' areas."""
    sheet = told["sheets"][number]  # type: ignore[index]
    outer, inner = closed_contours(folder / sheet["file"])
    assert len(outer) == sheet["panels"]
    width, height = sheet["size"]
    room = shapely.box(0, 0, width, height).buffer(-sheet["gap"] + 1e-3, join_style="mitre")
    assert all(room.covers(shape) for shape in outer)
    for one, other in itertools.combinations(outer, 2):
        assert shapely.distance(one, other) >= sheet["gap"] - 2e-3  # of two flattened arcs
    cut = sum(shape.area for shape in outer) - sum(shape.area for shape in inner)
    assert cut == pytest.approx(sheet["utilisation"] * width * height, rel=1e-4)


def nested(folder: Path) -> dict[str, object]:
    told: dict[str, object] = json.loads((folder / "nest.json").read_text())
    return told


def test_every_panel_lies_on_a_sheet_of_its_material(
    jobs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["nest", "plate.toml", "cone.toml", "duct.toml", "--sheet", "400x300", "-o", "out"]
    assert run(words) == 0
    told = nested(jobs / "out")
    names = ["sheet-dc01-1.5-1", "sheet-unknown-0-1"]
    assert [sheet["sheet"] for sheet in told["sheets"]] == names
    assert sorted(p.name for p in (jobs / "out").iterdir()) == [
        "nest.json",
        *(f"{n}.dxf" for n in names),
    ]
    placed = [(p["sheet"], p["job"], p["panel"], p["copy"]) for p in told["placements"]]
    assert placed == [
        (names[0], "plate", "plate", 1),
        (names[0], "plate", "plate", 2),
        (names[0], "cone", "cone", 1),
        (names[0], "cone", "cone", 2),
        (names[1], "duct", "left", 1),
        (names[1], "duct", "right", 1),
    ]
    for number in (0, 1):
        assert_sheet(jobs / "out", told, number)
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "sheet-dc01-1.5-1.dxf" in shown.out


def test_a_placement_turns_and_moves_the_pattern_and_mirrors_none(jobs: Path) -> None:
    """Every contour of the panel's pattern is where nest.json says, its grain along x."""
    assert run(["nest", "plate.toml", "--sheet", "400x300", "-o", "out"]) == 0
    told = nested(jobs / "out")
    pattern = build("plate.toml").panels[0].pattern
    outer, inner = closed_contours(jobs / "out" / told["sheets"][0]["file"])
    for one in told["placements"]:
        assert one["angle_deg"] in (90.0, 270.0)
        cos, sin = (round(f(np.radians(one["angle_deg"]))) for f in (np.cos, np.sin))
        for contour, found in [
            (pattern.outline, outer),
            *((hole, inner) for hole in pattern.holes),
        ]:
            points = np.concatenate([e.curve(np.linspace(e.u[0], e.u[-1], 33))[0] for e in contour])
            there = points @ np.array([[cos, sin], [-sin, cos]]) + (one["x"], one["y"])
            borders = shapely.union_all([shape.exterior for shape in found])
            assert (
                shapely.distance(borders, shapely.points(there)).max() < 2e-3
            )  # of flattened arcs


def test_bends_and_marks_move_with_their_panel(jobs: Path) -> None:
    assert run(["nest", "plate.toml", "--sheet", "400x300", "-o", "out"]) == 0
    told = nested(jobs / "out")
    space = ezdxf.readfile(jobs / "out" / "sheet-dc01-1.5-1.dxf").modelspace()
    outer, _ = closed_contours(jobs / "out" / "sheet-dc01-1.5-1.dxf")
    marks = [entity for entity in space if entity.dxf.layer == "MARK"]
    assert marks
    for mark in marks:
        points = shapely.points([(p.x, p.y) for p in ezpath.make_path(mark).flattening(0.1)])
        assert any(shape.covers(points).all() for shape in outer)
    assert len(marks) % len(told["placements"]) == 0


def test_json_prints_what_the_file_says(jobs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["nest", "cone.toml", "--sheet", "400x300", "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    assert told == nested(jobs / "out")
    assert told["units"] == "mm"
    assert all(check["passed"] for check in told["checks"])
    assert {check["name"] for check in told["checks"]} == {"dxf-deviation", "nest-gap"}


@pytest.mark.slow
def test_the_same_jobs_give_the_same_bytes_in_two_processes(jobs: Path) -> None:
    words = [sys.executable, "-m", "devcad", "nest", "cone.toml", "plate.toml"]
    words += ["--sheet", "330x300", "--seed", "7", "-o"]
    for folder, hashing in (("one", "1"), ("two", "2")):
        environment = {**os.environ, "PYTHONHASHSEED": hashing, "PYTHONPATH": str(REPOSITORY)}
        subprocess.run([*words, folder], check=True, env=environment, capture_output=True)
    files = sorted(path.name for path in (jobs / "one").iterdir())
    assert files == sorted(path.name for path in (jobs / "two").iterdir())
    for name in files:
        assert (jobs / "one" / name).read_bytes() == (jobs / "two" / name).read_bytes()


@pytest.mark.slow
def test_twelve_parts_of_three_jobs_share_sheets(jobs: Path) -> None:
    (jobs / "plate.toml").write_text(PLATE.format(quantity=8))
    (jobs / "duct.toml").write_text(
        DUCT.replace('name = "duct"', 'name = "duct"\nthickness = 1.5\nmaterial = "dc01"', 1)
    )
    words = ["nest", "plate.toml", "cone.toml", "duct.toml", "--sheet", "400x330", "--gap", "3"]
    assert run([*words, "-o", "out"]) == 0
    told = nested(jobs / "out")
    assert len(told["placements"]) == 12
    for number in range(len(told["sheets"])):
        assert_sheet(jobs / "out", told, number)
    assert told["sheets"][0]["gap"] == 3.0


def test_the_recipe_says_sheet_gap_and_kerf(jobs: Path) -> None:
    table = "[recipe.sheet]\nsize = [300, 200]\ngap = 7\nkerf = 0.4\n"
    (jobs / "plate.toml").write_text(PLATE.format(quantity=1) + table)
    assert run(["nest", "plate.toml", "-o", "out"]) == 0
    sheet = nested(jobs / "out")["sheets"][0]
    assert (sheet["size"], sheet["gap"], sheet["kerf"]) == ([300.0, 200.0], 7.0, 0.4)
    outer, inner = closed_contours(jobs / "out" / sheet["file"])
    assert outer[0].area == pytest.approx(90.4 * 60.4, rel=1e-12)
    assert min(shape.area for shape in inner) == pytest.approx(np.pi * 5.8**2, rel=1e-3)
    pattern = 90.0 * 60.0 - 36.0 * np.pi - 300.0 - 25.0 * np.pi
    assert sheet["utilisation"] == pytest.approx(pattern / 60000.0, rel=1e-9)


def test_a_new_nest_takes_the_place_of_the_old_one_and_of_nothing_else(jobs: Path) -> None:
    out = jobs / "out"
    (jobs / "plate.toml").write_text(PLATE.format(quantity=3))
    assert run(["nest", "plate.toml", "--sheet", "110x80", "-o", "out"]) == 3  # across the grain
    assert not out.exists()
    assert run(["nest", "plate.toml", "--sheet", "80x110", "-o", "out"]) == 0
    assert len(list(out.glob("sheet-*.dxf"))) == 3
    (out / "notes.txt").write_text("mine")
    assert run(["nest", "plate.toml", "--sheet", "400x300", "-o", "out"]) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        "nest.json",
        "notes.txt",
        "sheet-dc01-1.5-1.dxf",
    ]


def test_a_file_of_somebody_else_is_not_replaced(
    jobs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = jobs / "out"
    out.mkdir()
    (out / "sheet-unknown-0-1.dxf").write_text("mine")
    assert run(["nest", "duct.toml", "-o", "out"]) == 5
    assert [path.name for path in out.iterdir()] == ["sheet-unknown-0-1.dxf"]
    assert (out / "sheet-unknown-0-1.dxf").read_text() == "mine"
    assert "sheet-unknown-0-1.dxf" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--sheet", "100x40"], 3, "larger than the sheet of 100 x 40 mm"),
        (["--sheet", "100"], 2, "--sheet"),
        (["--sheet", "100x-40"], 2, "--sheet"),
        (["--gap", "-1"], 2, "--gap"),
        (["--pipeline", "none"], 2, "--pipeline"),
        (["missing.toml"], 5, "missing.toml"),
        (["duct.toml"], 2, "given twice"),
    ],
)
def test_what_cannot_be_nested_writes_nothing(
    words: list[str], code: int, said: str, jobs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["nest", "duct.toml", *words, "-o", "out", "--json"]) == code
    assert not (jobs / "out").exists()
    shown = capsys.readouterr()
    assert said in shown.err
    assert len(shown.err.splitlines()) == 1
    assert json.loads(shown.out)[0]["error"]["code"] == code


def test_a_panel_that_is_too_large_is_named(jobs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["nest", "plate.toml", "duct.toml", "--sheet", "120x75", "--json"]) == 3
    (told,) = json.loads(capsys.readouterr().out)
    assert told["job"] == "plate.toml"
    assert run(["nest", "duct.toml", "--sheet", "82x52", "--json"]) == 3
    (told,) = json.loads(capsys.readouterr().out)
    assert told["job"] == "duct.toml"
    assert told["error"]["place"] == "duct.toml > panel right"


def test_jobs_that_share_a_sheet_must_agree_on_it(
    jobs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (jobs / "cone.toml").write_text(f"{CONE}\n[recipe.sheet]\ngap = 9\n")
    assert run(["nest", "plate.toml", "cone.toml", "--sheet", "400x300"]) == 2
    assert "another [recipe.sheet]" in capsys.readouterr().err
