"""From a job to a folder: all files at once or none, the same bytes for the same job."""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import devcad
from devcad import pipeline
from devcad.checks import NAMES, at_most
from devcad.errors import CheckFailed, FileError, JobError
from devcad.export import Options, Written
from devcad.export import folder as folder_module
from devcad.export.folder import published
from devcad.job.recipe import RecipeTable, recipe_names, resolve
from devcad.part import Part

REPOSITORY = Path(__file__).parents[1]

JOB = """\
name = "lamp"
[surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
"""
PANELS = """\
name = "box"
[[panel]]
name = "left"
[panel.surface]
kind = "plane"
width = 20
height = 10
[[panel]]
name = "right"
[panel.surface]
kind = "plane"
width = 10
height = 10
"""
LIGHT = ("stl", "svg")  # formats that load no large library


def job(folder: Path, text: str = JOB) -> Path:
    path = folder / "job.toml"
    path.write_text(text)
    return path


@pytest.fixture
def lamp(tmp_path: Path) -> Part:
    return devcad.build(job(tmp_path))


SVG_ALONE = {"lamp/lamp.svg", "lamp/report.json", "lamp/index.html"}
"""What an export of SVG alone leaves."""


def snapshot(folder: Path) -> dict[str, bytes]:
    """Every file below a folder with its bytes, hidden ones included."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


# --- the report ----------------------------------------------------------------------------


def test_the_report_describes_the_files_beside_it(lamp: Part, tmp_path: Path) -> None:
    report = devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    written = tmp_path / "out" / "lamp"
    assert json.loads((written / "report.json").read_bytes()) == report
    listed = {entry["path"]: entry for entry in report["files"]}
    assert set(listed) == {path.name for path in written.iterdir()} - {"report.json", "index.html"}
    for name, entry in listed.items():
        data = (written / name).read_bytes()
        assert entry["bytes"] == len(data)
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()


def test_the_report_has_the_keys_of_the_contract_in_order(lamp: Part, tmp_path: Path) -> None:
    report = devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    top = "devcad job job_sha256 units panels seams checks files svg_origin"
    panel = (
        "name kind type causal closed closes closing_angle_deg orientable watertight apex area "
        "flat_area flat_bbox min_radius max_twist_deg max_crease_deg relaxed_mm k_neutral "
        "k_source clearance singularities regression ruling_count cut_length pierces mass_g "
        "lorentz_area figures notes allowed"
    )
    check = "name panel value limit unit passed where"
    assert list(report) == top.split()
    assert list(report["panels"][0]) == panel.split()
    assert list(report["checks"][0]) == check.split()
    assert list(report["checks"][0]["where"]) == ["t", "v", "point", "flat"]
    assert list(report["files"][0]) == ["path", "format", "sha256", "bytes", "max_deviation"]


def test_the_report_speaks_of_the_job_file_and_of_no_folder(lamp: Part, tmp_path: Path) -> None:
    devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    text = (tmp_path / "out" / "lamp" / "report.json").read_text()
    assert hashlib.sha256(job(tmp_path).read_bytes()).hexdigest() in text
    assert str(tmp_path) not in text
    assert "NaN" not in text
    assert "Infinity" not in text


def test_the_mass_is_density_times_area_times_thickness(tmp_path: Path) -> None:
    """A frustum's side has the area pi (r1 + r2) s with s^2 = 50^2 + 120^2 = 130^2."""
    steel = 'thickness = 2\nmaterial = "DC01"\nreference = "middle"\n[surface]'
    part = devcad.build(job(tmp_path, JOB.replace("[surface]", steel)))
    volume = math.pi * 150 * 130 * 2  # mm3
    assert part.panels[0].facts["mass_g"] == pytest.approx(volume * 7.85e-3, rel=1e-12)
    assert devcad.build(job(tmp_path)).panels[0].facts["mass_g"] is None


def test_a_sheet_is_not_bent_tighter_than_its_material_bears(tmp_path: Path) -> None:
    """Plywood of 2 mm wants 120 mm; the lamp's smallest radius is 50 mm and some."""
    plywood = 'thickness = 2\nmaterial = "birch-plywood"\n[surface]'
    with pytest.raises(CheckFailed, match="bend-radius"):
        devcad.build(job(tmp_path, JOB.replace("[surface]", plywood)))


def test_several_panels_have_an_origin_each(tmp_path: Path) -> None:
    part = devcad.build(job(tmp_path, PANELS))
    report = devcad.export(part, tmp_path / "out", formats=["svg"])
    assert set(report["svg_origin"]) == {"left", "right"}
    assert [entry["path"] for entry in report["files"]] == ["box-left.svg", "box-right.svg"]
    assert devcad.export(part, tmp_path / "out", formats=["stl"])["svg_origin"] is None


def test_every_check_of_an_export_can_be_allowed_by_name(lamp: Part, tmp_path: Path) -> None:
    report = devcad.export(lamp, tmp_path / "out")
    assert {check["name"] for check in report["checks"]} <= set(NAMES)


# --- the same bytes ------------------------------------------------------------------------


@pytest.mark.slow
def test_equal_jobs_give_equal_bytes(tmp_path: Path) -> None:
    """In two fresh interpreters with other hash seeds, in folders of other names."""
    path = job(tmp_path)
    seen = []
    for seed in ("1", "2"):
        out = tmp_path / f"out{seed}"
        command = [sys.executable, "-m", "devcad", "export", str(path), "-o", str(out)]
        env = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run(command, check=True, cwd=REPOSITORY, env=env, stdout=subprocess.DEVNULL)
        seen.append(snapshot(out))
        time.sleep(1.1)  # a clock in any file would show: the coarsest ones count seconds
    assert seen[0] == seen[1]
    assert {name.rsplit(".", 1)[1] for name in seen[0]} == {
        *("step", "stl", "glb", "dxf", "svg"),
        *("json", "html"),
    }


# --- publication ---------------------------------------------------------------------------


def fails(error: BaseException) -> Callable[[str], Any]:
    """A table of writers whose last one writes half a file and stops."""

    def writer(name: str) -> Any:
        def write(part: Part, folder: Path, options: Options) -> list[Written]:
            path = folder / f"{part.name}.{name}"
            path.write_bytes(b"half")
            if name == "svg":
                raise error
            return [Written(path, name, 0.0)]

        return write

    return writer


FAILURES: list[tuple[BaseException, type[BaseException]]] = [
    (RuntimeError("a bug"), RuntimeError),
    (OSError(28, "No space left on device"), FileError),
    (CheckFailed("no"), CheckFailed),
    (KeyboardInterrupt(), KeyboardInterrupt),
    (SystemExit(143), SystemExit),
    (MemoryError(), MemoryError),
]


@pytest.mark.parametrize(("error", "raised"), FAILURES, ids=[str(e[1].__name__) for e in FAILURES])
def test_a_failure_while_writing_leaves_the_earlier_export_and_nothing_else(
    error: BaseException,
    raised: type[BaseException],
    lamp: Part,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "out"
    devcad.export(lamp, out, formats=LIGHT)
    before = snapshot(out)
    monkeypatch.setattr(pipeline, "writer", fails(error))
    with pytest.raises(raised):
        devcad.export(lamp, out, formats=LIGHT)
    assert snapshot(out) == before
    assert [path.name for path in out.iterdir()] == ["lamp"]


def test_a_failure_in_a_fresh_place_leaves_no_folder(
    lamp: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "writer", fails(RuntimeError("a bug")))
    with pytest.raises(RuntimeError):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert not (tmp_path / "out").exists()


def test_files_of_an_earlier_export_vanish(lamp: Part, tmp_path: Path) -> None:
    devcad.export(lamp, tmp_path / "out", formats=["stl", "svg"])
    devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert set(snapshot(tmp_path / "out")) == SVG_ALONE


def test_a_folder_that_devcad_never_wrote_is_left_alone(lamp: Part, tmp_path: Path) -> None:
    foreign = tmp_path / "out" / "lamp"
    foreign.mkdir(parents=True)
    (foreign / "thesis.txt").write_text("ten years of work")
    with pytest.raises(FileError, match=r'it holds "thesis.txt", which no export put there'):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert snapshot(tmp_path) == {
        "job.toml": JOB.encode(),
        "out/lamp/thesis.txt": b"ten years of work",
    }


@pytest.mark.parametrize("name", ["notes.txt", "lamp.notes", "sub/notes.txt"])
def test_a_file_that_the_report_does_not_list_is_never_lost(
    name: str, lamp: Part, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    devcad.export(lamp, out, formats=LIGHT)
    (out / "lamp" / name).parent.mkdir(exist_ok=True)
    (out / "lamp" / name).write_text("hi")
    before = snapshot(tmp_path)
    with pytest.raises(FileError, match=f'it holds "{name.split("/")[0]}"') as caught:
        devcad.export(lamp, out, formats=LIGHT)
    assert "move it elsewhere" in caught.value.remedy
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize("report", ["", "{", "[]", '{"files": 1}', '{"files": [{}]}'])
def test_a_report_that_is_none_of_ours_lists_nothing(
    report: str, lamp: Part, tmp_path: Path
) -> None:
    foreign = tmp_path / "out" / "lamp"
    foreign.mkdir(parents=True)
    (foreign / "report.json").write_text(report)
    with pytest.raises(FileError, match=r'it holds "report\.json"'):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert (foreign / "report.json").read_text() == report


def test_a_page_without_a_report_is_somebody_elses(lamp: Part, tmp_path: Path) -> None:
    foreign = tmp_path / "out" / "lamp"
    foreign.mkdir(parents=True)
    (foreign / "index.html").write_text("my homepage")
    with pytest.raises(FileError, match=r'it holds "index\.html"'):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert (foreign / "index.html").read_text() == "my homepage"


def test_what_a_file_manager_drops_into_a_folder_hinders_no_export(
    lamp: Part, tmp_path: Path
) -> None:
    devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    (tmp_path / "out" / "lamp" / ".DS_Store").write_bytes(b"icons")
    devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert set(snapshot(tmp_path / "out")) == SVG_ALONE


def test_an_empty_folder_may_stand_where_the_export_goes(lamp: Part, tmp_path: Path) -> None:
    (tmp_path / "out" / "lamp").mkdir(parents=True)
    devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert set(snapshot(tmp_path / "out")) == SVG_ALONE


def test_a_file_in_the_folders_place_is_left_alone(lamp: Part, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "lamp").write_text("mine")
    with pytest.raises(FileError, match="it is there already and is not a folder"):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert (tmp_path / "out" / "lamp").read_text() == "mine"


def test_an_out_folder_that_cannot_be_made_is_a_matter_of_files(lamp: Part, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(FileError, match="out is a file, not a folder"):
        devcad.export(lamp, tmp_path / "out" / "deeper", formats=LIGHT)


def test_where_folders_cannot_be_exchanged_two_renames_do_it(
    lamp: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder_module, "_exchanged", lambda one, other: False)
    devcad.export(lamp, tmp_path / "out", formats=["stl"])
    devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert set(snapshot(tmp_path / "out")) == SVG_ALONE
    before = snapshot(tmp_path / "out")
    rename = Path.rename

    def refuse(self: Path, target: Path) -> Path:
        if self.suffix == ".part":
            raise PermissionError(13, "Permission denied")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(FileError, match="Permission denied"):
        devcad.export(lamp, tmp_path / "out", formats=["stl"])
    assert snapshot(tmp_path / "out") == before


def _publish_many(out: Path, word: str, count: int) -> None:
    for _ in range(count):
        with published(out, "lamp") as staging:
            for name in ("lamp.a", "lamp.b"):
                (staging / name).write_text(word)
            files = [{"path": f"lamp.{k}", "word": word} for k in "ab"]
            (staging / "report.json").write_text(json.dumps({"files": files}))


def test_two_processes_never_mix_their_files(tmp_path: Path) -> None:
    """Both publish one folder over and over; a reader sees the one's files or the other's."""
    context = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    workers = [
        context.Process(target=_publish_many, args=(tmp_path, word, 40)) for word in ("one", "two")
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert [worker.exitcode for worker in workers] == [0, 0]
    written = snapshot(tmp_path / "lamp")
    assert written["lamp.a"] == written["lamp.b"]
    assert b'"word": "%s"' % written["lamp.a"] in written["report.json"]
    assert sorted(snapshot(tmp_path)) == ["lamp/lamp.a", "lamp/lamp.b", "lamp/report.json"]


posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals and locks")
WAITING = """\
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may ignore it
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from devcad import pipeline, cli
def slow(name):
    print('writing', flush=True)
    try:
        time.sleep(30)
    except BaseException as error:
        if {hidden}:
            raise ImportError('initialization failed') from None
        raise
pipeline.writer = slow
sys.exit(cli.run(['export', {path!r}, '-o', {out!r}, '--to', 'stl']))
"""


def waiting(path: Path, out: Path, hidden: bool = False) -> subprocess.Popen[str]:
    """An export in its own process that has begun to write and stays there."""
    code = WAITING.format(path=str(path), out=str(out), hidden=hidden)
    command = [sys.executable, "-c", code]
    process = subprocess.Popen(
        command, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def staged(out: Path) -> list[str]:
    return [entry.name for entry in out.iterdir() if entry.name.startswith(".lamp-")]


@posix
@pytest.mark.parametrize("hidden", [False, True], ids=["plain", "as-import-error"])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_an_export_quietly_and_leaves_no_files(
    name: str, hidden: bool, tmp_path: Path
) -> None:
    """The signal comes while the files are being written; a compiled library that is being
    imported then turns what it raises into its own ImportError."""
    number = getattr(signal, name)
    out = tmp_path / "out"
    with waiting(job(tmp_path), out, hidden) as process:
        assert len(staged(out)) == 1
        process.send_signal(number)
        assert process.communicate(timeout=20) == ("", "")
    assert process.returncode == 128 + number
    assert not out.exists()


@posix
def test_an_ignored_hangup_stays_ignored(tmp_path: Path) -> None:
    """As under nohup."""
    words = ["export", str(job(tmp_path)), "-o", str(tmp_path), "--to", "svg"]
    code = (
        "import os, signal, sys; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from devcad import pipeline, cli; real = pipeline.writer\n"
        "def writer(name):\n"
        "    os.kill(os.getpid(), signal.SIGHUP); return real(name)\n"
        "pipeline.writer = writer\n"
        f"sys.exit(cli.run({words!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "lamp" / "lamp.svg").is_file()


@posix
def test_an_export_sweeps_what_a_killed_one_left_but_not_what_another_is_writing(
    lamp: Part, tmp_path: Path
) -> None:
    path, out = job(tmp_path), tmp_path / "out"
    with waiting(path, out) as killed:
        killed.kill()
    (left,) = staged(out)
    foreign = out / ".lamp-2-0123456789abcdef.part"  # another job's
    foreign.mkdir()
    with waiting(path, out) as living:
        (live,) = (name for name in staged(out) if name != foreign.name)
        assert live != left
        devcad.export(lamp, out, formats=["svg"])
        assert set(staged(out)) == {live, foreign.name}
        assert (out / "lamp" / "lamp.svg").is_file()
        living.terminate()
    assert staged(out) == [foreign.name]


# --- checks and recipes --------------------------------------------------------------------


def too_large(part: Part, folder: Path, options: Options) -> list[Written]:
    path = folder / f"{part.name}.svg"
    path.write_text("<svg/>")
    check = at_most("svg-deviation", "lamp", 2.0, 1.0, "mm", says="2 mm away", remedy="none")
    return [Written(path, "svg", 2.0, (check,))]


def test_a_failed_check_of_a_writer_publishes_nothing_unless_it_is_allowed(
    lamp: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pipeline, "writer", lambda name: too_large)
    monkeypatch.setattr(pipeline, "_svg_origin", lambda part: {"lamp": (0.0, 0.0)})
    with pytest.raises(CheckFailed, match="svg-deviation"):
        devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert not (tmp_path / "out").exists()
    report = devcad.export(lamp, tmp_path / "out", formats=["svg"], allow=["svg-deviation"])
    assert report["panels"][0]["allowed"] == ["svg-deviation"]
    assert [check["passed"] for check in report["checks"] if check["name"] == "svg-deviation"] == [
        False
    ]


def test_what_the_build_allowed_stays_allowed(tmp_path: Path) -> None:
    twisted = """\
name = "lamp"
[recipe]
allow = ["twist", "isometry", "fold-back", "overlap", "mesh-deviation", "regular"]
[surface]
kind = "ruled"
extent = [0, 1e-2]
direction = ["-sin(t)", "cos(t)", "1"]
[surface.curve]
kind = "circle"
radius = 10
sweep = 90
"""
    part = devcad.build(job(tmp_path, twisted))
    failed = {check.name for check in part.checks if not check.passed}
    assert "twist" in failed
    with pytest.raises(CheckFailed, match="twist"):
        devcad.build(job(tmp_path, twisted.replace('"twist", ', "")))


def table(**keys: Any) -> RecipeTable:
    return RecipeTable.model_validate(keys)


def test_the_nearer_word_wins() -> None:
    """Command line, job, recipe, default; key by key."""
    job_keys = table(formats=["svg"], step={"degree": 3}, allow=["twist"])
    near = resolve("sheet-metal", job_keys, formats=["glb"], allow=["overlap"])
    assert near.formats == ("glb",)
    assert near.allow == {"twist", "overlap"}
    assert near.options == replace(Options(), step_degree=3)
    assert resolve("sheet-metal", job_keys).formats == ("svg",)
    assert resolve("sheet-metal", table()).formats == ("dxf", "step", "traveller", "cutlist")
    assert resolve("paper", table()).formats == ("svg", "dxf", "pdf")
    assert resolve(None, table()).formats == ("step", "stl", "glb", "dxf", "svg")
    assert resolve(None, table()).options == Options()


def test_a_recipe_may_ask_for_the_oldest_dxf(tmp_path: Path) -> None:
    """R12 has no units: the name says them."""
    path = job(tmp_path, JOB.replace("[surface]", '[recipe.dxf]\nversion = "R12"\n[surface]'))
    recipe = pipeline.plan(devcad.load(path), formats=["dxf"])
    report = devcad.export(devcad.build(path), tmp_path, formats=["dxf"], options=recipe.options)
    assert [entry["path"] for entry in report["files"]] == ["lamp-mm.dxf"]
    assert "AC1009" in (tmp_path / "lamp" / "lamp-mm.dxf").read_text()  # the version's own name


@pytest.mark.parametrize("name", ["cad", "sheet-metal", "leather", "paper"])
def test_a_recipe_says_what_it_is_for(name: str) -> None:
    assert len(recipe_names()[name]) > 10


def test_an_unknown_recipe_is_told_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(JobError, match=r'did you mean "sheet-metal"'):
        devcad.build(job(tmp_path), pipeline="sheetmetal")


def test_the_wheel_finds_its_recipes_inside_the_package() -> None:
    """The folder is the same, whichever of the two layouts."""
    import tomllib

    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included["pipelines"] == "devcad/_recipes"
    assert project["project"]["version"] == devcad.__version__


def test_the_public_names_are_all_there() -> None:
    assert sorted(devcad.__all__) == devcad.__all__
    assert all(getattr(devcad, name) is not None for name in devcad.__all__)
    with pytest.raises(AttributeError):
        _ = devcad.nonsense  # type: ignore[attr-defined]


@pytest.mark.slow
@pytest.mark.parametrize("recipe", ["cad", "sheet-metal", "leather", "paper"])
@pytest.mark.parametrize(
    "sample", sorted((REPOSITORY / "samples").glob("*.toml")), ids=lambda p: p.stem
)
def test_every_sample_builds_with_every_recipe(sample: Path, recipe: str, tmp_path: Path) -> None:
    wanted = pipeline.plan(devcad.load(sample), pipeline=recipe)
    part = devcad.build(sample, pipeline=recipe)
    report = devcad.export(part, tmp_path, formats=wanted.formats, options=wanted.options)
    assert {entry["format"] for entry in report["files"]} == set(wanted.formats)
    assert all(check["passed"] for check in report["checks"])
