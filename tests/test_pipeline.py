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
    assert set(listed) == {path.name for path in written.iterdir()} - {"report.json"}
    for name, entry in listed.items():
        data = (written / name).read_bytes()
        assert entry["bytes"] == len(data)
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()


def test_the_report_has_the_keys_of_the_contract_in_order(lamp: Part, tmp_path: Path) -> None:
    report = devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    top = "devcad job job_sha256 units panels checks files svg_origin"
    panel = (
        "name kind type causal closed closes closing_angle_deg orientable watertight apex area "
        "flat_area flat_bbox min_radius max_twist_deg max_crease_deg relaxed_mm k_neutral "
        "k_source clearance singularities regression ruling_count cut_length pierces mass_g "
        "allowed"
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
        "json",
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
    assert set(snapshot(tmp_path / "out")) == {"lamp/lamp.svg", "lamp/report.json"}


def test_a_folder_that_devcad_never_wrote_is_left_alone(lamp: Part, tmp_path: Path) -> None:
    foreign = tmp_path / "out" / "lamp"
    foreign.mkdir(parents=True)
    (foreign / "thesis.txt").write_text("ten years of work")
    with pytest.raises(FileError, match=r'it is no export of devcad: it holds "thesis.txt"'):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert snapshot(tmp_path) == {
        "job.toml": JOB.encode(),
        "out/lamp/thesis.txt": b"ten years of work",
    }


def test_a_file_in_the_folders_place_is_left_alone(lamp: Part, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "lamp").write_text("mine")
    with pytest.raises(FileError, match="it is there already and is not a folder"):
        devcad.export(lamp, tmp_path / "out", formats=LIGHT)
    assert (tmp_path / "out" / "lamp").read_text() == "mine"


def test_an_out_folder_that_cannot_be_made_is_a_matter_of_files(lamp: Part, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(FileError, match="cannot write the folder"):
        devcad.export(lamp, tmp_path / "out" / "deeper", formats=LIGHT)


def test_where_folders_cannot_be_exchanged_two_renames_do_it(
    lamp: Part, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder_module, "_exchanged", lambda one, other: False)
    devcad.export(lamp, tmp_path / "out", formats=["stl"])
    devcad.export(lamp, tmp_path / "out", formats=["svg"])
    assert set(snapshot(tmp_path / "out")) == {"lamp/lamp.svg", "lamp/report.json"}
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
            for name in ("report.json", "lamp.a", "lamp.b"):
                (staging / name).write_text(word)


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
    assert len(set(snapshot(tmp_path).values())) == 1
    assert sorted(snapshot(tmp_path)) == ["lamp/lamp.a", "lamp/lamp.b", "lamp/report.json"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGTERM to catch")
def test_a_terminated_export_cleans_up(tmp_path: Path) -> None:
    """The signal comes while the files are being written."""
    path = job(tmp_path)
    out = tmp_path / "out"
    code = (
        "import sys, time; from devcad import pipeline, cli\n"
        "real = pipeline.writer\n"
        "def slow(name):\n"
        "    print('writing', flush=True); time.sleep(30)\n"
        "pipeline.writer = slow\n"
        f"sys.exit(cli.run(['export', {str(path)!r}, '-o', {str(out)!r}, '--to', 'stl']))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=REPOSITORY, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        assert any(entry.name.startswith(".lamp-") for entry in out.iterdir())
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=20) == 128 + signal.SIGTERM
    assert not out.exists()


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
    assert resolve("sheet-metal", table()).formats == ("dxf", "step")
    assert resolve("paper", table()).formats == ("svg", "dxf")
    assert resolve(None, table()).formats == ("step", "stl", "glb", "dxf", "svg")
    assert resolve(None, table()).options == Options()


@pytest.mark.parametrize("name", ["cad", "sheet-metal", "paper"])
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
@pytest.mark.parametrize("recipe", ["cad", "sheet-metal", "paper"])
@pytest.mark.parametrize(
    "sample", sorted((REPOSITORY / "samples").glob("*.toml")), ids=lambda p: p.stem
)
def test_every_sample_builds_with_every_recipe(sample: Path, recipe: str, tmp_path: Path) -> None:
    wanted = pipeline.plan(devcad.load(sample), pipeline=recipe)
    part = devcad.build(sample, pipeline=recipe)
    report = devcad.export(part, tmp_path, formats=wanted.formats, options=wanted.options)
    assert {entry["format"] for entry in report["files"]} == set(wanted.formats)
    assert all(check["passed"] for check in report["checks"])
