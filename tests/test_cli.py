"""The command line: what it prints where, its exit codes, and how little it loads."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
import warnings
from pathlib import Path
from typing import Any

import pytest

from devcad import pipeline
from devcad.cli import run
from devcad.errors import FileError
from devcad.export import FORMATS
from devcad.geometry.constructions import SURFACES
from devcad.job.recipe import recipe_names

REPOSITORY = Path(__file__).parents[1]

LAMP = """\
name = "{name}"
[surface]
kind = "frustum"
radius = {radius}
top_radius = 50
height = 120
"""
HYPERBOLOID = """\
name = "hyperboloid"
[surface]
kind = "ruled"
extent = [0, 10]
direction = ["-sin(t)", "cos(t)", "1"]
[surface.curve]
kind = "circle"
radius = 10
"""

Captured = pytest.CaptureFixture[str]


def lamp(folder: Path, name: str = "lamp", radius: float = 100, file: str = "") -> str:
    path = folder / f"{file or name}.toml"
    path.write_text(LAMP.format(name=name, radius=radius))
    return str(path)


def started(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """devcad in a process of its own."""
    command = [sys.executable, "-m", "devcad", *arguments]
    return subprocess.run(command, cwd=REPOSITORY, text=True, capture_output=True, **options)


# --- lightness -----------------------------------------------------------------------------

USAGE = {
    ("--help",): 0,
    ("-h",): 0,
    ("--version",): 0,
    (): 2,
    ("export", "--help"): 0,
    ("export",): 2,
    ("exprot", "lamp.toml"): 2,
    ("export", "lamp.toml", "--fast"): 2,
    ("export", "lamp.toml", "--to", "step,stp"): 2,
    ("export", "lamp.toml", "--to", ""): 2,
    ("export", "lamp.toml", "--pipeline", "papr"): 2,
    ("export", "lamp.toml", "--allow", "twits"): 2,
    ("check", "lamp.toml", "--allow", "twist,regulr"): 2,
    ("list",): 2,
    ("list", "surface"): 2,
    ("new", "frustrum"): 2,
    ("analyze", "--help"): 0,
    ("analyze",): 2,
    ("analyze", "one.toml", "two.toml"): 2,
}


@pytest.mark.parametrize("arguments", USAGE, ids=lambda words: " ".join(words) or "nothing")
def test_help_and_usage_errors_load_no_large_library(arguments: tuple[str, ...]) -> None:
    code = (
        "import sys; from devcad.cli import run\n"
        f"code = run({list(arguments)!r})\n"
        "large = {'numpy', 'OCP', 'scipy', 'ezdxf', 'rich'} & set(sys.modules)\n"
        "sys.exit(f'loads {large}' if large else code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True
    )
    assert done.returncode == USAGE[arguments], done.stderr
    if done.returncode:
        assert done.stdout == ""
        assert len(done.stderr.splitlines()) == 1
    else:
        assert done.stderr == ""


@pytest.mark.parametrize("library", ["scipy", "OCP", "ezdxf", "rich", "shapely", "manifold3d"])
def test_checking_an_analytic_part_does_without(library: str, tmp_path: Path) -> None:
    code = (
        "import sys; from devcad.cli import run\n"
        f"assert run(['check', {lamp(tmp_path)!r}]) == 0\n"
        f"sys.exit({library!r} in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True)
    assert done.returncode == 0, done.stderr


# --- what it prints ------------------------------------------------------------------------


def test_help_shows_examples_and_exit_codes() -> None:
    done = started("--help")
    assert "devcad export lamp.toml" in done.stdout
    assert "0 done, 2 job file or usage, 3 geometry" in done.stdout
    for command in ("export", "check", "analyze", "list", "schema", "new"):
        assert "devcad " + command in started(command, "--help").stdout


def test_check_prints_its_table_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    path = lamp(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(["check", path]) == 0
    told = capsys.readouterr()
    assert told.err == ""
    rows = [line.split() for line in told.out.splitlines()]
    assert rows[0] == ["panel", "check", "value", "limit", "unit"]
    assert ["lamp", "twist"] in [row[:2] for row in rows]
    assert {row[-1] for row in rows[1:]} == {"ok"}
    assert [entry.name for entry in tmp_path.iterdir()] == ["lamp.toml"]


def test_export_prints_the_files_it_wrote(tmp_path: Path, capsys: Captured) -> None:
    assert run(["export", lamp(tmp_path), "--to", "stl,svg", "-o", str(tmp_path / "out")]) == 0
    told = capsys.readouterr()
    assert told.err == ""
    files = [Path(line.split()[0]) for line in told.out.splitlines()]
    assert [file.name for file in files] == ["lamp.stl", "lamp.svg"]
    assert all(file.is_file() for file in files)


def test_json_is_one_array_of_the_written_reports(tmp_path: Path, capsys: Captured) -> None:
    paths = [lamp(tmp_path, "one"), lamp(tmp_path, "two")]
    assert run(["export", *paths, "--json", "--to", "stl", "-o", str(tmp_path / "out")]) == 0
    reports = json.loads(capsys.readouterr().out)
    for name, report in zip(("one", "two"), reports, strict=True):
        assert json.loads((tmp_path / "out" / name / "report.json").read_bytes()) == report


def test_a_failure_is_told_once_for_people_and_once_for_programs(
    tmp_path: Path, capsys: Captured
) -> None:
    path = tmp_path / "h.toml"
    path.write_text(HYPERBOLOID)
    assert run(["check", str(path), "--json"]) == 3
    told = capsys.readouterr()
    (entry,) = json.loads(told.out)
    assert entry["job"] == str(path)
    assert entry["error"]["check"] == "twist"
    assert 0.0 <= entry["error"]["t"] <= 6.2832
    assert entry["error"]["message"].startswith(f"{entry['error']['place']}: twist: ")
    assert entry["error"]["code"] == 3
    assert entry["error"]["value"] == pytest.approx(45.0, abs=1e-6)  # 1/10 over a width of 10
    assert entry["error"]["limit"] == 0.01
    assert told.err == entry["error"]["message"] + "\n"


def test_every_job_is_tried_and_the_largest_code_wins(tmp_path: Path, capsys: Captured) -> None:
    broken = lamp(tmp_path, "broken", radius=-1)
    good = lamp(tmp_path, "good")
    missing = str(tmp_path / "missing.toml")
    out = tmp_path / "out"
    assert run(["export", broken, missing, good, "--to", "stl", "-o", str(out)]) == 5
    told = capsys.readouterr()
    assert [line.split(":")[0] for line in told.err.splitlines()] == [
        f"{broken} > surface.radius",
        missing,
    ]
    assert [entry.name for entry in out.iterdir()] == ["good"]


@pytest.mark.parametrize("second", ["lamp", "LAMP"])
def test_two_jobs_of_one_name_stop_everything_before_anything_is_written(
    second: str, tmp_path: Path, capsys: Captured
) -> None:
    paths = [lamp(tmp_path), lamp(tmp_path, "other"), lamp(tmp_path, second, file="second")]
    assert run(["export", *paths, "--to", "stl", "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err == (
        f'{paths[2]} > name: the name "{second}" is taken by {paths[0]}; nothing was done '
        "(rename one of the two, or run them one by one)\n"
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("what", ["surfaces", "curves", "formats", "pipelines", "materials"])
def test_every_list_has_a_line_on_each(what: str, capsys: Captured) -> None:
    assert run(["list", what]) == 0
    rows = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert rows
    assert all(len(row) == 2 for row in rows)
    known = {"surfaces": SURFACES, "formats": FORMATS, "pipelines": recipe_names()}
    if what in known:
        assert {row[0] for row in rows} == set(known[what])


@pytest.mark.parametrize("kind", SURFACES)
def test_what_new_prints_passes_its_checks(kind: str, tmp_path: Path, capsys: Captured) -> None:
    assert run(["new", kind]) == 0
    path = tmp_path / "new.toml"
    path.write_text(capsys.readouterr().out)
    assert run(["check", str(path)]) == 0
    assert capsys.readouterr().err == ""


def test_the_schema_is_json(capsys: Captured) -> None:
    assert run(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["$schema"].startswith("https://json-schema.org/")


def test_a_job_file_given_twice_is_told_as_that(tmp_path: Path, capsys: Captured) -> None:
    path = lamp(tmp_path)
    assert run(["check", path, f"{tmp_path}/./lamp.toml"]) == 2
    assert "the job file is given twice; nothing was done" in capsys.readouterr().err


def test_an_export_tells_of_the_failed_checks_it_allowed(tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "h.toml"
    path.write_text(HYPERBOLOID.replace("[0, 10]", "[0, 1e-2]"))
    assert run(["export", str(path), "--allow", "twist", "--to", "stl", "-o", str(tmp_path)]) == 0
    told = capsys.readouterr().out.splitlines()
    allowed = re.compile(r"allowed: panel hyperboloid: twist .* deg, limit 0.01 deg")
    assert any(allowed.fullmatch(line) for line in told)


def test_docstring_marks_do_not_show_in_lists(capsys: Captured) -> None:
    assert run(["list", "surfaces"]) == 0
    assert run(["list", "curves"]) == 0
    assert "`" not in capsys.readouterr().out


UNATTRIBUTED: dict[tuple[str, ...], str] = {
    ("export", "a.toml", "--to", "stp"): "--to",
    ("export", "a.toml", "--to", ""): "--to",
    ("check", "a.toml", "--allow", "twits"): "--allow",
    ("check", "a.toml", "--pipeline", "papr"): "--pipeline",
    ("check", "a.toml", "--fast"): "",
    ("export",): "",
}


@pytest.mark.parametrize("arguments", UNATTRIBUTED, ids=lambda words: " ".join(words))
def test_a_usage_failure_is_an_array_for_programs(
    arguments: tuple[str, ...], capsys: Captured
) -> None:
    assert run([*arguments, "--json"]) == 2
    told = capsys.readouterr()
    (entry,) = json.loads(told.out)
    assert entry["job"] is None
    assert entry["error"]["code"] == 2
    assert entry["error"]["place"] == UNATTRIBUTED[arguments]
    assert told.err == entry["error"]["message"] + "\n"
    assert run([*arguments]) == 2
    assert capsys.readouterr().out == ""


def test_an_unknown_format_of_three_letters_lists_the_formats(capsys: Captured) -> None:
    assert run(["export", "a.toml", "--to", "iso"]) == 2
    known = ", ".join(sorted(FORMATS))
    told = f'--to: this version knows no format "iso" (known: {known})\n'
    assert capsys.readouterr().err == told


def test_the_place_for_programs_has_the_panel_and_the_job_file(
    tmp_path: Path, capsys: Captured
) -> None:
    surface = HYPERBOLOID.partition("[surface]\n")[2].replace("[surface.", "[panel.surface.")
    path = tmp_path / "allow.toml"
    path.write_text(
        'name = "allow"\n[[panel]]\nname = "hyp"\n[panel.surface]\n'
        + surface
        + '[[panel]]\nname = "lid"\n[panel.surface]\nkind = "plane"\nwidth = 2\nheight = 1\n'
    )
    assert run(["check", str(path), "--json"]) == 3
    (entry,) = json.loads(capsys.readouterr().out)
    assert entry["error"]["place"] == f"{path} > panel hyp"
    assert entry["error"]["message"].startswith(f"{path} > panel hyp: twist: ")


FULL = OSError(28, "No space left on device")
FULL_TOLD = FileError(f"cannot write lamp.svg: {FULL.strerror}", place="lamp.svg", remedy="none")


@pytest.mark.parametrize(
    ("error", "remedy"), [(FULL, "choose another folder with -o"), (FULL_TOLD, "none")]
)
def test_every_failure_of_an_export_names_the_job_file_and_the_folder(
    error: OSError,
    remedy: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Captured,
) -> None:
    def full(part: Any, folder: Path, options: Any) -> Any:
        raise error

    path, out = lamp(tmp_path), tmp_path / "out"
    monkeypatch.setattr(pipeline, "writer", lambda name: full)
    assert run(["export", path, "--to", "svg", "-o", str(out)]) == 5
    assert capsys.readouterr().err == (
        f"{path} > {out / 'lamp'}: cannot write lamp.svg: No space left on device ({remedy})\n"
    )


def test_an_out_that_is_a_file_is_told_as_that(tmp_path: Path, capsys: Captured) -> None:
    path = lamp(tmp_path)
    assert run(["export", path, "--to", "svg", "-o", path]) == 5
    assert capsys.readouterr().err == (
        f"{path}: {path} is a file, not a folder (choose another folder with -o)\n"
    )


# --- streams that are closed or full -------------------------------------------------------

needs_shell = pytest.mark.skipif(os.name != "posix", reason="closing streams takes a POSIX shell")


def shell(words: str, *values: str) -> subprocess.CompletedProcess[str]:
    """A command of the shell in which $0 is Python and $1 ... are the values."""
    command = ["sh", "-c", words, sys.executable, *values]
    return subprocess.run(command, cwd=REPOSITORY, text=True, capture_output=True)


@needs_shell
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-", "2>/dev/full"])
def test_a_closed_stream_changes_no_exit_code(closed: str, tmp_path: Path) -> None:
    good = shell(
        f'"$0" -m devcad export "$1" --to svg -o "$2" {closed}', lamp(tmp_path), str(tmp_path)
    )
    assert (good.returncode, good.stderr) == (0, "")
    assert (tmp_path / "lamp" / "lamp.svg").read_text().startswith("<?xml")
    bad = shell(f'"$0" -m devcad check "$1" {closed}', str(tmp_path / "missing.toml"))
    assert bad.returncode == 5
    assert len(bad.stderr.splitlines()) == (closed == ">&-")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize("words", ['check "$1"', 'check "$1" --json', "schema", "--help"])
def test_a_full_stdout_is_one_line_about_files(words: str, tmp_path: Path) -> None:
    done = shell(f'"$0" -m devcad {words} >/dev/full', lamp(tmp_path))
    assert done.returncode == 5
    assert len(done.stderr.splitlines()) == 1
    assert "No space left on device" in done.stderr


@needs_shell
def test_a_name_that_is_no_text_is_shown_with_its_bytes(tmp_path: Path) -> None:
    name = os.fsdecode(b"lamp\xff.toml")
    try:
        (tmp_path / name).write_text(LAMP.format(name="lamp", radius=-1))
    except OSError:
        pytest.skip("this file system takes no such name")
    done = shell('"$0" -m devcad check "$1" --json', str(tmp_path / name))
    assert done.returncode == 2
    assert "lamp\\udcff.toml > surface.radius" in done.stderr
    assert json.loads(done.stdout)[0]["job"] == str(tmp_path / name)


# --- what must not reach a user ------------------------------------------------------------


def boom(*_: Any, **__: Any) -> Any:
    warnings.warn("a library mutters", RuntimeWarning, stacklevel=1)
    raise ZeroDivisionError("division by zero")


def test_a_bug_of_ours_is_one_line_and_no_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    path = lamp(tmp_path)
    monkeypatch.setattr(pipeline, "assemble", boom)
    assert run(["check", path]) == 70
    told = capsys.readouterr()
    assert told.err == (
        f"{path}: internal error: ZeroDivisionError: division by zero "
        "(please report it with the job file; DEVCAD_DEBUG=1 shows the details)\n"
    )


def test_debugging_shows_the_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    path = lamp(tmp_path)
    monkeypatch.setattr(pipeline, "assemble", lambda *_, **__: 1 / 0)
    monkeypatch.setenv("DEVCAD_DEBUG", "1")
    assert run(["check", path]) == 70
    assert "Traceback" in capsys.readouterr().err


def test_a_lack_of_memory_is_a_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    def starve(*_: Any, **__: Any) -> Any:
        raise MemoryError

    path = lamp(tmp_path)
    monkeypatch.setattr(pipeline, "assemble", starve)
    assert run(["check", path]) == 4
    assert "not enough memory" in capsys.readouterr().err


def test_an_interrupt_is_silent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    def interrupt(*_: Any, **__: Any) -> Any:
        raise KeyboardInterrupt

    path = lamp(tmp_path)
    monkeypatch.setattr(pipeline, "assemble", interrupt)
    assert run(["check", path]) == 130
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", [["schema"], ["list", "surfaces"], ["--help"]])
def test_a_reader_who_leaves_is_no_error(command: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "devcad", *command],
            cwd=REPOSITORY,
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
        )
    finally:
        os.close(writing)
    assert done.stderr == ""
    assert done.returncode == 0


def test_a_reader_who_leaves_stops_no_job(tmp_path: Path) -> None:
    paths = [lamp(tmp_path, name) for name in ("one", "two")]
    reading, writing = os.pipe()
    os.close(reading)
    command = ["export", *paths, str(tmp_path / "missing"), "--to", "svg", "-o", str(tmp_path)]
    try:
        code = subprocess.call(
            [sys.executable, "-m", "devcad", *command],
            cwd=REPOSITORY,
            stdout=writing,
            stderr=subprocess.DEVNULL,
        )
    finally:
        os.close(writing)
    assert code == 5
    assert (tmp_path / "one" / "one.svg").is_file()
    assert (tmp_path / "two" / "two.svg").is_file()


def test_no_control_character_reaches_the_terminal(tmp_path: Path, capsys: Captured) -> None:
    path = tmp_path / "job.toml"
    path.write_text('name = "\\u001b[31mred"\n[surface]\nkind = "plane"\nwidth = 1\nheight = 1\n')
    assert run(["check", str(path)]) == 2
    assert '"\\x1b[31mred" cannot be a file name' in capsys.readouterr().err


def test_names_beyond_ascii_print_on_any_terminal(tmp_path: Path) -> None:
    path = tmp_path / "Trichter-größe.toml"
    path.write_text("name = 1\n")
    done = started("check", str(path), env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 2
    assert "Trichter-gr\\xf6\\xdfe.toml > name: must be a text in quotes, is 1" in done.stderr


# --- progress ------------------------------------------------------------------------------


class Terminal:
    """A stderr that says it is a terminal."""

    encoding = "utf-8"

    def __init__(self) -> None:
        self.text = ""

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None: ...

    def isatty(self) -> bool:
        return True


class AtOnce(threading.Timer):
    """A timer whose time is over as soon as it starts."""

    def start(self) -> None:
        self.function()


class Never(threading.Timer):
    """A timer whose time does not come."""

    def start(self) -> None: ...


@pytest.mark.parametrize(("timer", "shown"), [(Never, False), (AtOnce, True)])
def test_progress_shows_on_a_terminal_once_the_work_takes_long(
    timer: type[threading.Timer], shown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from devcad.report import progress

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with progress.ProgressLine(timer) as line:
        line.show("lamp: geometry")
        line.show("lamp: step")
    assert ("lamp: step" in terminal.text) == shown


def test_no_progress_where_stderr_is_a_file(tmp_path: Path) -> None:
    done = started("export", lamp(tmp_path), "-o", str(tmp_path / "out"))
    assert done.returncode == 0
    assert done.stderr == ""
