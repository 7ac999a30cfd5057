"""devcad fold: what it writes, that it keeps what an export wrote, and what it refuses."""

from __future__ import annotations

import csv
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from devcad.cli import run
from devcad.folding import fold_job
from devcad.job.load import load

STRIP = """\
name = "strip"
{top}
[surface]
kind = "plane"
width = 20
height = 100
[simulate]
cells = 10
across = 2
load_steps = 2
modes = 1
{simulate}
"""
HELD = 'supports = [{ edge = "start", clamp = true }]\n'
PULLED = HELD + 'loads = [{ edge = "end", force = [0, 0, 0.01] }]\n'
STEEL = 'thickness = 0.5\nmaterial = "dc01"'
FOLDED = """\
name = "annulus"
thickness = 0.3
[surface]
kind = "curved-fold"
fold = 60
extent = [-20, 20]
[surface.flat_crease]
kind = "circle"
radius = 100
sweep = 90
[simulate]
cells = 16
steps = 4
modes = 2
youngs = 3000
poisson = 0.3
{simulate}
"""

Captured = pytest.CaptureFixture[str]


def write(folder: Path, text: str, **keys: str) -> str:
    path = folder / "job.toml"
    path.write_text(text.format(**{"top": "", "simulate": "", **keys}))
    return str(path)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def folded(folder: Path, *options: str, **keys: str) -> dict[str, object]:
    """The report of the folded annulus."""
    job = write(folder, FOLDED, **keys)
    assert run(["fold", job, "-o", str(folder / "out"), *options]) == 0
    told: dict[str, object] = json.loads((folder / "out/annulus/annulus-fold.json").read_text())
    return told


def crease_radius(table: Path) -> float:
    """That of the circle nearest to the crease's nodes at the last step."""
    nodes = rows(table)
    count = sum(row["step"] == nodes[0]["step"] for row in nodes)
    flat = np.array([[float(row[f"pattern_{axis}"]) for axis in "xy"] for row in nodes[:count]])
    crease = np.abs(np.linalg.norm(flat - [-100.0, 0.0], axis=1) - 100.0) < 1e-6
    assert crease.sum() == 17
    last = np.array([[float(row[axis]) for axis in "xyz"] for row in nodes[-count:]])[crease]
    away = last - last.mean(axis=0)
    plane = away @ np.linalg.svd(away)[2][:2].T
    a = np.linalg.lstsq(np.c_[2 * plane, np.ones(17)], (plane**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(a[2] + a[0] ** 2 + a[1] ** 2))


@pytest.mark.slow
def test_a_folded_sheet_is_written_step_by_step_with_the_same_bytes_each_time(
    tmp_path: Path, capsys: Captured
) -> None:
    told = folded(tmp_path)
    folder = tmp_path / "out" / "annulus"
    said = capsys.readouterr()
    assert said.err == ""
    for path in sorted(folder.iterdir()):
        assert str(path) in said.out
    for file in told["files"]:  # type: ignore[attr-defined]
        assert hashlib.sha256((folder / file["path"]).read_bytes()).hexdigest() == file["sha256"]
    steps = rows(folder / "annulus-fold.csv")
    assert [row["phase"] for row in steps] == ["fold"] * 5
    energies = [float(row["energy_N_mm"]) for row in steps]
    assert energies == sorted(energies)
    assert all(float(row["rms_mm"]) < 0.5 for row in steps)  # the exact shape is known throughout
    radius = crease_radius(folder / "annulus-fold-nodes.csv")
    assert radius == pytest.approx(100.0 * np.sqrt(0.75), rel=1e-3)  # the limit, 16 cells
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    folded(tmp_path)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_what_an_export_wrote_stays_and_an_export_replaces_what_was_simulated(
    tmp_path: Path,
) -> None:
    job, out = write(tmp_path, STRIP, top=STEEL, simulate=PULLED), tmp_path / "out"
    export = ["export", job, "--to", "svg", "-o", str(out)]
    assert run(export) == 0
    before = {path.name: path.read_bytes() for path in (out / "strip").iterdir()}
    assert run(["fold", job, "-o", str(out)]) == 0
    after = {path.name: path.read_bytes() for path in (out / "strip").iterdir()}
    assert before.items() <= after.items()
    assert {"strip-fold.glb", "strip-fold.csv", "strip-fold.json"} <= after.keys()
    assert run(["fold", job, "-o", str(out)]) == 0  # its own files are no strangers
    assert run(export) == 0
    assert {path.name for path in (out / "strip").iterdir()} == before.keys()
    (out / "strip" / "mine.txt").write_text("keep me")
    assert run(["fold", job, "-o", str(out)]) == 5
    assert (out / "strip" / "mine.txt").exists()


def test_a_loaded_panel_tells_reactions_stiffness_and_modes(
    tmp_path: Path, capsys: Captured
) -> None:
    job = write(tmp_path, STRIP, top=STEEL, simulate=PULLED + "weight = [0, 0, -1]\n")
    assert run(["fold", job, "-o", str(tmp_path / "out"), "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    weight = 7.85e-6 * 20.0 * 100.0 * 0.5 * 9.80665
    assert told["applied"] == pytest.approx([0.0, 0.0, 0.01 - weight], abs=1e-12)
    assert told["reactions"][0]["force"] == pytest.approx([0, 0, weight - 0.01], abs=1e-9)
    assert told["loads"][0]["stiffness"] > 0.0
    assert told["modes"]["hertz"][0] > 0.0
    assert told["folds"] is None
    assert [step["phase"] for step in told["steps"]] == ["fold", "load", "load"]
    moment = told["reactions"][0]["moment"]  # about the origin: what pulls the end, and the weight
    assert moment[0] == pytest.approx(weight * 50.0 - 0.01 * 100.0, rel=1e-3)
    assert not any("strains" in note for note in told["notes"])


def test_a_crease_folds_without_a_word_on_the_material(tmp_path: Path) -> None:
    """Its shape hardly asks for one."""
    job = tmp_path / "job.toml"
    silent = FOLDED.replace("thickness = 0.3\n", "").replace("youngs = 3000\npoisson = 0.3\n", "")
    job.write_text(silent.format(top="", simulate=""))
    told = fold_job(load(job), tmp_path / "out")
    assert told["notes"][0].startswith("nominal")
    assert told["material"]["youngs"] == 1.0
    radius = crease_radius(tmp_path / "out/annulus/annulus-fold-nodes.csv")
    assert radius == pytest.approx(100.0 * np.sqrt(0.75), rel=1e-3)


def test_strains_that_no_sheet_bears_are_told(tmp_path: Path, capsys: Captured) -> None:
    torn = HELD + 'loads = [{ edge = "end", force = [0, 1e5, 0] }]\n'
    job = write(tmp_path, STRIP, top=STEEL, simulate=torn)
    assert run(["fold", job, "-o", str(tmp_path / "out")]) == 0
    assert "note: strains reach" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("top", "simulate", "code", "words"),
    [
        ("", PULLED, 2, "simulate.youngs: the simulation has no Young's modulus"),
        ('material = "dc01"', PULLED, 2, "simulate.thickness: the simulation has no thickness"),
        ("thickness = 1", PULLED + "youngs = 3000\n", 2, "no Poisson's ratio"),
        (STEEL, "", 2, "nothing folds the sheet and nothing loads it"),
        (STEEL, 'supports = [{ edge = "start", fix = ["z"] }]', 3, "free to move in 4 of 6 ways"),
        (STEEL, 'supports = [{ edge = "crease" }]', 3, "supports[0]: the sheet has no crease"),
        (
            STEEL,
            HELD + "loads = [{ at = [30, 10], force = [1, 0, 0] }]",
            3,
            "simulate.loads[0]: the place [30, 10] lies outside",
        ),
        (STEEL, HELD + "cells = 2000\nacross = 400", 2, "not TOML"),
        (STEEL, HELD + "poisson = -1.0\n", 2, "simulate.poisson: must be greater than -1"),
        (
            STEEL,
            HELD + "poisson = 0.0\ncoefficients = 'filipov-2017'\n",
            3,
            "> simulate: crossed panel 0 is",
        ),
        (STEEL, PULLED + 'panel = "other"\n', 2, 'simulate.panel: no panel "other"'),
        (
            "thickness = 1",
            PULLED + "youngs = 1\npoisson = 0.3\nweight = [0, 0, -1]\n",
            2,
            "simulate.weight: the sheet's weight is not known",
        ),
    ],
)
def test_what_cannot_be_simulated_is_told_in_one_line(
    tmp_path: Path, capsys: Captured, top: str, simulate: str, code: int, words: str
) -> None:
    job = write(tmp_path, STRIP, top=top, simulate=simulate)
    assert run(["fold", job, "-o", str(tmp_path / "out")]) == code
    said = capsys.readouterr()
    assert said.out == ""
    (line,) = said.err.splitlines()
    assert line.startswith(f"{job} > ")
    assert words in line
    assert not (tmp_path / "out").exists()
