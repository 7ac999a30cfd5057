"""Job files: what is wrong is told in exact words, what is right arrives in mm and radians."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devcad.cli import run
from devcad.errors import DevcadError, FileError, JobError, LimitError
from devcad.geometry.constructions import SURFACES
from devcad.job.load import Job, load
from devcad.job.schema import job_schema
from devcad.job.templates import template, template_kinds

BROKEN = sorted((Path(__file__).parent / "broken").glob("*.toml"))

LAMP = """\
name = "lamp"
{top}
[surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
{more}
"""


def write(folder: Path, text: str, name: str = "job.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def lamp(folder: Path, top: str = "", more: str = "") -> Job:
    return load(write(folder, LAMP.format(top=top, more=more)))


# --- broken files --------------------------------------------------------------------------


def expectation(path: Path) -> tuple[int, list[str]]:
    """The exit code and the error lines that a broken file's first comments promise."""
    said = [line[3:] for line in path.read_text().splitlines() if line.startswith("#! ")]
    return int(said[0].removeprefix("exit ")), said[1:]


def as_pattern(line: str, file: str) -> str:
    """An error line as a regular expression: <n> is any number, KINDS all surface kinds."""
    kinds = ", ".join(sorted(SURFACES))
    escaped = re.escape(line.replace("FILE", file, 1).replace("KINDS", kinds))
    return escaped.replace("<n>", r"-?[\d.]+(e[-+]?\d+)?")


def test_there_are_at_least_forty_broken_files() -> None:
    assert len(BROKEN) >= 40


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_a_broken_file_says_exactly_what_is_wrong_and_leaves_no_files(
    path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    code, lines = expectation(path)
    monkeypatch.chdir(path.parent)
    before = sorted(path.parent.iterdir())
    assert run(["export", path.name, "--to", "stl", "-o", str(tmp_path / "out")]) == code
    told = capsys.readouterr()
    assert told.out == ""
    got = told.err.splitlines()
    assert len(got) == len(lines)
    for line, expected in zip(got, lines, strict=True):
        assert re.fullmatch(as_pattern(expected, path.name), line), line
    assert list(tmp_path.iterdir()) == []
    assert sorted(path.parent.iterdir()) == before


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_a_broken_file_is_told_to_programs_too(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _ = expectation(path)
    assert run(["check", str(path), "--json"]) == code
    (entry,) = json.loads(capsys.readouterr().out)
    assert set(entry) == {"job", "error"}
    keys = ["code", "place", "value", "limit", "remedy", "message", "check", "t"]
    assert list(entry["error"]) == keys
    assert entry["job"] == str(path)
    assert entry["error"]["message"].startswith(f"{entry['error']['place']}: ")
    assert entry["error"]["code"] == code
    assert entry["error"]["place"].startswith(str(path))


# --- limits --------------------------------------------------------------------------------

BOMBS = {
    "dots in a key": "a" + ".a" * 20_000 + " = 1",
    "quoted dots": "a" + '."a"' * 20_000 + " = 1",
    "dots in a header": "[" + "a." * 30_000 + "a]",
    "arrays": "a = " + "[" * 100_000,
    "inline tables": "a = " + "{a=" * 1000 + "1" + "}" * 1000,
    "dots inside inline tables": "a = " + "{a.a.a.a.a.a=" * 31 + "1" + "}" * 31,
    "dots behind a string": 'b = "[[[["\na' + ".a" * 20_000 + " = 1",
    "size": "#" * 256_001,
}


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS.keys())
def test_a_bomb_is_refused_before_it_costs_anything(text: str, tmp_path: Path) -> None:
    path = write(tmp_path, text)
    start = time.perf_counter()
    with pytest.raises(LimitError):
        load(path)
    assert time.perf_counter() - start < 0.5  # the parser alone took 6.5 s for 40 kB of dots


SLOW = {
    "backslashes": 'a = "' + '\\"' * 120_000,
    "open quotes": '"""' * 80_000,
    "tables": "[[a]]\n" * 40_000,
    "nested tables": "[[a]]\n" + "[[a.b]]\n" * 30_000,
    "digits": "a = " + "1" * 200_000,
    "hexadecimal digits": "height = 0x" + "f" * 200_000,
    "lines": "\n" * 250_000,
    "one word": "a" * 250_000,
    "equals": "=" * 250_000,
}


@pytest.mark.parametrize("text", SLOW.values(), ids=SLOW.keys())
def test_large_rubbish_is_refused_in_linear_time(text: str, tmp_path: Path) -> None:
    path = write(tmp_path, text)
    start = time.perf_counter()
    with pytest.raises(JobError):
        load(path)
    assert time.perf_counter() - start < 5.0  # quadratic time would be minutes


@given(st.text(max_size=200))
def test_no_text_whatsoever_escapes_the_error_tree(text: str) -> None:
    from devcad.importers.toml import parse_toml

    try:
        parse_toml(text, place="job.toml")
    except DevcadError as error:
        assert "\n" not in str(error)


# --- files ---------------------------------------------------------------------------------


def test_a_missing_job_is_a_matter_of_files(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=re.escape("job.toml: cannot read the file")):
        load(tmp_path / "job.toml")


def test_a_folder_is_no_job(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot read the file"):
        load(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
def test_a_pipe_is_no_job_and_no_table_and_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match="it is no regular file"):
        load(tmp_path / "pipe")
    with pytest.raises(FileError, match="it is no regular file"):
        load(write(tmp_path, RAIL.format(rail='file = "pipe"')))
    with pytest.raises(FileError, match="it is no regular file"):
        load(os.devnull)


def test_a_job_that_is_not_utf8_is_named_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_bytes(b'name = "lamp"\ndescription = "\xe4"\n')
    with pytest.raises(FileError, match="byte 0xe4 in line 2"):
        load(tmp_path / "job.toml")


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    path.write_bytes(b"\xef\xbb\xbf" + LAMP.format(top="", more="").encode())
    assert load(path).name == "lamp"


RAIL = """\
name = "strip"
[surface]
kind = "tangent"
extent = [1, 2]
[surface.curve]
kind = "points"
{rail}
"""
POINTS = [(math.cos(k / 3), math.sin(k / 3), k / 3) for k in range(8)]
ROWS = [f"{x!r}{{s}}{y!r}{{s}}{z!r}" for x, y, z in POINTS]


@pytest.mark.parametrize("separator", [",", ";", " ; "])
@pytest.mark.parametrize("header", ["", "x{s}y{s}z\n", "x1{s}-{s}z [mm]\n"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\n\n"])
def test_a_csv_file_gives_the_same_surface_as_its_points(
    separator: str, header: str, end: str, tmp_path: Path
) -> None:
    text = (header + end.join(ROWS)).replace("{s}", separator)
    (tmp_path / "rail.csv").write_bytes(text.encode())
    named = load(write(tmp_path, RAIL.format(rail='file = "rail.csv"')))
    points = [list(point) for point in POINTS]
    inline = load(write(tmp_path, RAIL.format(rail=f"points = {points}"), "inline.toml"))
    assert named.panels[0].surface == inline.panels[0].surface


def test_the_checksum_is_that_of_the_job_and_the_files_it_names(tmp_path: Path) -> None:
    (tmp_path / "rail.csv").write_text("\n".join(ROWS).replace("{s}", ","))
    path = write(tmp_path, RAIL.format(rail='file = "rail.csv"'))
    both = path.read_bytes() + (tmp_path / "rail.csv").read_bytes()
    assert load(path).sha256 == hashlib.sha256(both).hexdigest()


def test_a_link_does_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "rail.csv").write_text("\n".join(ROWS).replace("{s}", ","))
    (inner / "rail.csv").symlink_to(tmp_path / "rail.csv")
    (inner / "up").symlink_to(tmp_path)
    for name in ("rail.csv", "up/rail.csv"):
        with pytest.raises(JobError, match="not under the folder of the job"):
            load(write(inner, RAIL.format(rail=f'file = "{name}"')))


def test_a_csv_file_beyond_its_limit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "rail.csv").write_text("0,0,0\n" * 700_000)
    with pytest.raises(LimitError, match="larger than 4000 kB"):
        load(write(tmp_path, RAIL.format(rail='file = "rail.csv"')))


# --- values --------------------------------------------------------------------------------


@pytest.mark.parametrize(("unit", "mm"), [("mm", 1), ("cm", 10), ("m", 1000), ("in", 25.4)])
def test_lengths_arrive_in_mm(unit: str, mm: float, tmp_path: Path) -> None:
    top = f'units = "{unit}"\ntolerance = 0.5\nthickness = 2\n[place]\norigin = [1, 2, 3]\n'
    job = lamp(tmp_path, top)
    assert (job.mm_per_unit, job.tolerance, job.thickness) == (mm, 0.5 * mm, 2 * mm)
    place = job.panels[0].place
    assert place is not None
    assert place[:3, 3].tolist() == [1 * mm, 2 * mm, 3 * mm]


@pytest.mark.parametrize("unit", ["mm", "m", "in"])
def test_the_default_tolerance_is_a_twentieth_of_a_millimetre_in_every_unit(
    unit: str, tmp_path: Path
) -> None:
    assert lamp(tmp_path, f'units = "{unit}"').tolerance == 0.05


def test_the_grain_arrives_in_radians(tmp_path: Path) -> None:
    assert lamp(tmp_path, "[meta]\ngrain = 90\n").meta.grain == math.pi / 2


@given(
    z=st.tuples(*[st.floats(-10, 10)] * 3).filter(lambda z: np.linalg.norm(z) > 1e-3),
    x=st.tuples(*[st.floats(-10, 10)] * 3).filter(lambda x: np.linalg.norm(x) > 1e-3),
)
def test_a_place_is_a_rotation_that_turns_z_onto_the_axis(
    z: tuple[float, float, float], x: tuple[float, float, float]
) -> None:
    from devcad.job.load import _matrix
    from devcad.job.tables import PlaceTable

    table = PlaceTable(z_axis=z, x_axis=x)
    try:
        matrix = _matrix(table, 1.0, "job.toml")
    except JobError:
        assert np.linalg.norm(np.cross(z, x)) < 1e-8 * np.linalg.norm(z) * np.linalg.norm(x)
        return
    assert matrix is not None
    turn = matrix[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-6)  # 1e-9 / the least sine
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(turn[:, 2] * np.linalg.norm(z), z, atol=1e-12)
    assert turn[:, 0] @ x > 0.0


def test_a_place_without_x_axis_keeps_x_as_far_as_it_can(tmp_path: Path) -> None:
    tilted = lamp(tmp_path, "[place]\nz_axis = [1, 0, 1]\n").panels[0].place
    along_x = lamp(tmp_path, "[place]\nz_axis = [1, 0, 0]\n").panels[0].place
    assert tilted is not None
    assert along_x is not None
    half = math.sqrt(0.5)
    np.testing.assert_allclose(tilted[:3, 0], [half, 0, -half], atol=1e-15)
    np.testing.assert_allclose(along_x[:3, 0], [0, 1, 0], atol=1e-15)


def test_panels_keep_their_order_and_names(tmp_path: Path) -> None:
    text = 'name = "box"\n' + "".join(
        f'[[panel]]\nname = "{name}"\n[panel.surface]\nkind = "plane"\nwidth = 2\nheight = 1\n'
        for name in ("right", "left", "Lid.2")
    )
    job = load(write(tmp_path, text))
    assert [panel.name for panel in job.panels] == ["right", "left", "Lid.2"]
    assert not job.single


NAMES = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", fullmatch=True)


@given(NAMES)
def test_every_name_that_is_taken_is_a_good_file_name(name: str) -> None:
    from devcad.job.tables import _file_name

    devices = {"con", "prn", "aux", "nul"} | {f"{d}{k}" for d in ("com", "lpt") for k in range(10)}
    bad = name.endswith(".") or name.lower().split(".")[0] in devices
    if bad:
        with pytest.raises(JobError):
            _file_name(name)
    else:
        assert _file_name(name) == name


# --- templates and schema ------------------------------------------------------------------


def test_every_surface_kind_has_a_template() -> None:
    assert set(template_kinds()) == set(SURFACES)


@pytest.mark.parametrize("kind", template_kinds())
def test_a_template_loads_and_builds_as_it_stands(kind: str, tmp_path: Path) -> None:
    job = load(write(tmp_path, template(kind)))
    assert job.panels[0].kind == kind
    assert job.panels[0].surface.build().panels


def test_the_schema_knows_every_key_and_kind() -> None:
    schema = job_schema()
    assert json.dumps(schema)
    assert set(schema["required"]) == {"name"}
    assert {"units", "tolerance", "surface", "panel", "recipe"} <= set(schema["properties"])
    mapping = schema["properties"]["surface"]["anyOf"][0]["discriminator"]["mapping"]
    assert set(mapping) == set(SURFACES)
    assert schema["additionalProperties"] is False
