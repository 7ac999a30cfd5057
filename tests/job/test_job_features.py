"""Feature tables of a job: what becomes of them in mm and radians, and where wrong ones are."""

from __future__ import annotations

import hashlib
import json
import math
import time
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from devcad.errors import DevcadError, JobError, LimitError
from devcad.features import Cutout, Drill, Features, Placing
from devcad.flatten.rings import polygon_of
from devcad.job.features import MAX_FEATURES, MAX_LINES, Reading
from devcad.job.load import Job, load
from devcad.job.schema import job_schema

PLATE = """\
name = "plate"
units = "{units}"
{top}
[surface]
kind = "plane"
width = 10
height = 6
{more}
"""


def plate(folder: Path, more: str, *, units: str = "mm", top: str = "") -> Job:
    path = folder / "job.toml"
    path.write_text(PLATE.format(units=units, top=top, more=more), encoding="utf-8")
    return load(path)


def features(folder: Path, more: str, *, units: str = "mm") -> Features:
    (panel,) = plate(folder, more, units=units).panels
    return panel.features


def cutout(folder: Path, more: str, *, units: str = "mm") -> Cutout:
    (made,) = features(folder, f"[[cutout]]\n{more}", units=units).cutouts
    assert isinstance(made, Cutout)
    return made


def drawing(folder: Path, name: str, circles: int, units: int = 4) -> bytes:
    """A drawing of ``circles`` holes of diameter 4 in a row, 10 apart."""
    document = ezdxf.new("R2000")
    document.header["$INSUNITS"] = units
    for k in range(circles):
        document.modelspace().add_circle((10 * k, 0), 2, dxfattribs={"layer": "HOLES"})
    document.saveas(folder / name)
    return (folder / name).read_bytes()


# --- to mm and radians ---------------------------------------------------------------------


@pytest.mark.parametrize(("units", "mm"), [("mm", 1.0), ("cm", 10.0), ("m", 1e3), ("in", 25.4)])
@pytest.mark.parametrize(
    ("shape", "width", "height"),
    [
        ('shape = "circle"\ndiameter = 4', 4, 4),
        ('shape = "slot"\nlength = 5\nwidth = 2', 5, 2),
        ('shape = "rectangle"\nwidth = 3\nheight = 2\ncorner_radius = 0.5', 3, 2),
        ('shape = "polygon"\npoints = [[-1, -2], [4, -2], [4, 1], [-1, 1]]', 5, 3),
    ],
)
def test_lengths_become_mm(
    tmp_path: Path, units: str, mm: float, shape: str, width: float, height: float
) -> None:
    made = cutout(tmp_path, f"{shape}\nat = [3, 1.5]", units=units)
    size = np.ptp(polygon_of(made.contour), axis=0)
    assert size == pytest.approx([mm * width, mm * height], rel=1e-2 if "slot" in shape else 1e-12)
    assert made.placing.at == (3 * mm, 1.5 * mm)
    assert not made.notch


def test_angles_become_radians_and_stay_out_of_the_contour(tmp_path: Path) -> None:
    made = cutout(tmp_path, 'shape = "slot"\nlength = 5\nwidth = 2\nangle = 90\nat = [5, 3]')
    assert made.placing.angle == pytest.approx(math.pi / 2, rel=1e-15)
    assert np.ptp(polygon_of(made.contour), axis=0)[0] == pytest.approx(5, rel=1e-2)


def test_a_place_on_the_surface_is_a_pair_of_shares_in_every_unit(tmp_path: Path) -> None:
    made = cutout(
        tmp_path,
        'shape = "circle"\ndiameter = 1\nat_surface = [0, 1.0]\nnotch = true',
        units="in",
    )
    assert made.placing == Placing(None, (0.0, 1.0), 0.0)
    assert made.notch


def test_a_polygons_repeated_end_is_dropped(tmp_path: Path) -> None:
    made = cutout(
        tmp_path, 'shape = "polygon"\npoints = [[0, 0], [2, 0], [0, 2], [0, 0]]\nat = [3, 3]'
    )
    assert len(made.contour) == 3


def test_a_drill_and_a_trim_have_points_in_mm_and_directions_of_length_one(tmp_path: Path) -> None:
    made = features(
        tmp_path,
        '[[cutout]]\nshape = "drill"\ndiameter = 0.5\nthrough = true\n'
        "axis = [[1, 2, 3], [0, 3, 4]]\n"
        "[[trim]]\nplane = [[1, 0, 0], [1e-9, 0, 0]]",
        units="cm",
    )
    (drill,), (trim,) = made.cutouts, made.trims
    assert isinstance(drill, Drill)
    assert drill.point.tolist() == [10, 20, 30]
    assert drill.direction == pytest.approx([0, 0.6, 0.8])
    assert (drill.diameter, drill.through, drill.notch) == (5.0, True, False)
    assert trim.point.tolist() == [10, 0, 0]
    assert trim.normal.tolist() == [1, 0, 0]


def test_marks_are_lines_from_their_origin(tmp_path: Path) -> None:
    made = features(
        tmp_path,
        '[[mark]]\nshape = "line"\nlength = 2\nangle = 45\nat = [1, 1]\n'
        '[[mark]]\nshape = "text"\ntext = "No. 7"\nheight = 0.5\nat = [1, 2]\n'
        '[[mark]]\nshape = "arrow"\nlength = 3\nat_surface = [0.5, 0.5]',
        units="cm",
    )
    line, text, arrow = made.marks
    (edge,) = line.lines
    assert edge.curve(edge.u)[0].tolist() == [[0, 0], [20, 0]]
    assert line.placing.angle == pytest.approx(math.pi / 4)
    assert polygon_of(text.lines)[:, 1].max() == pytest.approx(5.0, rel=0.01)
    assert polygon_of(arrow.lines)[:, 0].max() == pytest.approx(30.0)


def test_everything_keeps_its_order_and_its_place_in_the_file(tmp_path: Path) -> None:
    job = plate(
        tmp_path,
        '[[cutout]]\nshape = "circle"\ndiameter = 1\nat = [1, 1]\n'
        '[[cutout]]\nshape = "drill"\naxis = [[1, 2, 3], [0, 0, 1]]\ndiameter = 0.5\n'
        '[[mark]]\nshape = "line"\nlength = 2\nat = [1, 1]\n'
        "[[trim]]\nplane = [[0, 0, 0], [1, 0, 0]]",
    )
    (made,) = (panel.features for panel in job.panels)
    places = [f.place for f in (*made.cutouts, *made.marks, *made.trims)]
    names = ["cutout 1", "cutout 2", "mark 1", "trim 1"]
    assert places == [f"{job.path} > {name}" for name in names]


def test_each_panel_has_its_own_features_and_the_part_its_seams(tmp_path: Path) -> None:
    path = tmp_path / "box.toml"
    path.write_text(
        """
name = "box"
[[panel]]
name = "v1.left"
[panel.surface]
kind = "plane"
width = 10
height = 6
[[panel.cutout]]
shape = "circle"
diameter = 1
at = [5, 3]
[[panel]]
name = "right"
[panel.surface]
kind = "plane"
width = 10
height = 6
[[panel.trim]]
plane = [[5, 0, 0], [1, 0, 0]]
[[seam]]
edges = ["v1.left.top", "right.base"]
"""
    )
    job = load(path)
    left, right = job.panels
    assert left.features.cutouts[0].place == f"{path} > panel v1.left > cutout 1"
    assert right.features.trims[0].place == f"{path} > panel right > trim 1"
    (seam,) = job.seams
    assert (seam.first, seam.second) == (("v1.left", "top"), ("right", "base"))
    assert seam.place == f"{path} > seam 1"


# --- drawings ------------------------------------------------------------------------------


def test_every_contour_of_a_drawing_is_a_cutout_with_a_number(tmp_path: Path) -> None:
    drawing(tmp_path, "holes.dxf", 3)
    made = features(
        tmp_path, '[[cutout]]\nshape = "dxf"\nfile = "holes.dxf"\nat = [1, 2]\nangle = 30'
    )
    places = [cut.place.rpartition(" > cutout 1 > ")[2] for cut in made.cutouts]
    assert places == ["contour 1", "contour 2", "contour 3"]
    centers = [polygon_of(cut.contour).mean(axis=0) for cut in made.cutouts]  # type: ignore[union-attr]
    assert np.array(centers) == pytest.approx(np.array([[0, 0], [10, 0], [20, 0]]), abs=1e-12)
    assert {cut.placing for cut in made.cutouts} == {  # type: ignore[union-attr]
        Placing((1.0, 2.0), None, math.radians(30))
    }


@pytest.mark.parametrize(("drawn", "diameter"), [(0, 101.6), (1, 101.6), (4, 4.0)])
def test_a_drawing_without_a_unit_is_in_the_jobs(
    tmp_path: Path, drawn: int, diameter: float
) -> None:
    drawing(tmp_path, "holes.dxf", 1, units=drawn)
    made = cutout(tmp_path, 'shape = "dxf"\nfile = "holes.dxf"\nat = [1, 2]', units="in")
    assert np.ptp(polygon_of(made.contour), axis=0) == pytest.approx([diameter, diameter])


def test_the_jobs_hash_is_that_of_its_bytes_and_the_drawings_each_once(tmp_path: Path) -> None:
    one, two = drawing(tmp_path, "one.dxf", 1), drawing(tmp_path, "two.dxf", 2)
    table = '[[cutout]]\nshape = "dxf"\nfile = "{}"\nat = [1, 2]\n'
    job = plate(tmp_path, "".join(table.format(f"{name}.dxf") for name in ("two", "one", "two")))
    whole = (tmp_path / "job.toml").read_bytes() + two + one
    assert job.sha256 == hashlib.sha256(whole).hexdigest()


def test_a_drawing_is_read_once_however_often_it_is_placed(tmp_path: Path) -> None:
    drawing(tmp_path, "holes.dxf", 20)
    table = '[[cutout]]\nshape = "dxf"\nfile = "holes.dxf"\nat = [1, 2]\n'
    plate(tmp_path, table)  # the library is loaded
    start = time.perf_counter()
    plate(tmp_path, table)
    once = time.perf_counter() - start
    start = time.perf_counter()
    made = features(tmp_path, table * 100)
    assert len(made.cutouts) == 2000
    assert time.perf_counter() - start < 30 * once + 1.0


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../holes.dxf", "C:\\\\holes.dxf", "a/../../b", ""]
)
def test_a_drawing_outside_the_jobs_folder_is_not_opened(tmp_path: Path, name: str) -> None:
    with pytest.raises(JobError, match="not under the folder") as error:
        features(tmp_path, f'[[cutout]]\nshape = "dxf"\nfile = "{name}"\nat = [1, 2]')
    assert error.value.place.endswith("> cutout 1 > file")


def test_a_drawing_over_four_megabytes_is_refused_unread(tmp_path: Path) -> None:
    (tmp_path / "huge.dxf").write_bytes(b"0\n" * 2_100_000)
    with pytest.raises(LimitError):
        features(tmp_path, '[[cutout]]\nshape = "dxf"\nfile = "huge.dxf"\nat = [1, 2]')


# --- what is wrong -------------------------------------------------------------------------


def test_all_that_is_wrong_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(JobError) as error:
        features(
            tmp_path,
            '[[cutout]]\nshape = "circle"\ndiameter = 0\nat = [1, 1]\n'
            '[[cutout]]\nshape = "square"\nat = [1, 1]\n'
            '[[mark]]\nshape = "text"\ntext = "☃"\nheight = 1\nat = [1, 1]\n'
            "[[trim]]\nplane = [[0, 0, 0], [0, 0, 0]]",
        )
    others: tuple[DevcadError, ...] = getattr(error.value, "others", ())
    told = [problem.place.split(".toml > ")[1] for problem in (error.value, *others)]
    assert told == ["cutout 1 > diameter", "cutout 2 > shape", "mark 1 > text", "trim 1 > plane[1]"]


@pytest.mark.parametrize(
    "more",
    [
        "cutout = 3",
        "cutout = [3]",
        "cutout = [[]]",
        '[[cutout]]\nshape = ["circle"]\nat = [1, 1]',
        '[[cutout]]\nshape = "circle"\ndiameter = nan\nat = [1, 1]',
        '[[cutout]]\nshape = "circle"\ndiameter = 1e300\nat = [1, 1]',
        '[[cutout]]\nshape = "circle"\ndiameter = 1\nat = [inf, 1]',
        '[[cutout]]\nshape = "circle"\ndiameter = 1\nat = [1, 1, 1]',
        '[[cutout]]\nshape = "circle"\ndiameter = 1\nat = "here"',
        '[[cutout]]\nshape = "circle"\ndiameter = true\nat = [1, 1]',
        '[[cutout]]\nshape = "polygon"\npoints = []\nat = [1, 1]',
        '[[cutout]]\nshape = "polygon"\npoints = [[0], [1, 1], [2, 0]]\nat = [1, 1]',
        '[[cutout]]\nshape = "dxf"\nat = [1, 1]',
        '[[cutout]]\nshape = "dxf"\nfile = { shape = "dxf", file = "x" }\nat = [1, 1]',
        '[[cutout]]\nshape = "drill"\naxis = [[0, 0], [1, 1]]\ndiameter = 1',
        f'[[mark]]\nshape = "text"\ntext = "{"x" * 201}"\nheight = 1\nat = [1, 1]',
        '[[mark]]\nshape = "text"\ntext = "x"\nheight = -1\nat = [1, 1]',
        "[[trim]]\nplane = []",
        "[[trim]]",
        "[[seam]]\nedges = [1, 2]",
        '[[seam]]\nedges = [".top", "plate.base"]',
        '[[seam]]\nedges = ["top", "plate.base"]',
    ],
)
def test_hostile_tables_are_refused_in_one_line_with_a_remedy(tmp_path: Path, more: str) -> None:
    with pytest.raises(DevcadError) as error:
        features(tmp_path, more) if not more.startswith("cutout") else plate(tmp_path, "", top=more)
    assert error.value.code == 2
    assert error.value.remedy
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("limit", "length"),
    [(MAX_FEATURES, 1), pytest.param(MAX_LINES, MAX_LINES // 20, marks=pytest.mark.slow)],
)
def test_more_features_or_lines_than_a_panel_can_have_are_a_limit(limit: int, length: int) -> None:
    """Told as soon as they are too many, whatever follows."""
    turn = np.linspace(0.0, 2.0 * np.pi, length, endpoint=False)
    hole = {"shape": "circle", "diameter": 1.0, "at": [0.0, 0.0]}
    star = {"shape": "polygon", "points": np.column_stack([np.cos(turn), np.sin(turn)]).tolist()}
    row = hole if length == 1 else {**star, "at": [0.0, 0.0]}
    reading = Reading(1.0)
    assert reading.features([row] * (limit // length), None, None, "job.toml").cutouts
    assert reading.found == []
    reading.features([row] * (limit // length + 1), None, None, "job.toml")
    (error,) = reading.found
    assert isinstance(error, LimitError)
    assert (error.place, error.limit) == ("job.toml", limit)


# --- the schema ----------------------------------------------------------------------------


def test_the_schema_knows_every_shape_and_its_keys() -> None:
    schema = job_schema()
    json.dumps(schema)
    known = schema["$defs"]
    for name, keys in {
        "Circle": {"shape", "diameter", "at", "at_surface", "notch"},
        "Slot": {"shape", "length", "width", "angle", "at", "at_surface", "notch"},
        "Dxf": {"shape", "file", "layer", "angle", "at", "at_surface", "notch"},
        "Drill": {"shape", "axis", "diameter", "through", "notch"},
        "TextMark": {"shape", "text", "height", "angle", "at", "at_surface"},
    }.items():
        assert set(known[name]["properties"]) == keys
        assert known[name]["additionalProperties"] is False
    for owner in (schema, known["PanelTable"]):
        assert {"cutout", "mark", "trim"} <= set(owner["properties"])
    assert "seam" in schema["properties"]
    shapes = json.dumps(schema["properties"]["cutout"])
    assert all(f'"{shape}"' in shapes for shape in ("circle", "slot", "drill", "dxf"))
