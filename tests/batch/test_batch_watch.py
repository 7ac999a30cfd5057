"""The hot folder: what is dropped is made and moved, and nothing is lost on the way."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import faulty
import pytest
from test_batch_run import LAMP, WORDS

from devcad.batch.places import claim
from devcad.batch.run import Settings
from devcad.batch.tasks import Record
from devcad.batch.watch import watch
from devcad.cli import run as devcad
from devcad.errors import FileError


def drop(inbox: Path, name: str, radius: float = 100.0, file: str = "") -> None:
    inbox.mkdir(exist_ok=True)
    (inbox / f"{file or name}.toml").write_text(LAMP.format(name=name, radius=radius))


def watched(inbox: Path, out: Path) -> list[Record]:
    told: list[Record] = []
    settings = Settings(out, WORDS, 2, work=faulty.work)
    watch(inbox, settings, told.append, every=0.05, once=True)
    return told


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.startswith(".")}


def test_what_is_dropped_ends_in_done_or_failed_with_its_result(tmp_path: Path) -> None:
    inbox, out = tmp_path / "in", tmp_path / "out"
    for name in ("a", "b", "refused", "segfault"):
        drop(inbox, name)
    drop(inbox, "a", file="twin")  # two files of one name: one after the other
    drop(inbox, "manifest.json", file="rude")
    (inbox / "broken.toml").write_text("name = ")
    (inbox / "notes.txt").write_text("not a job")
    watched(inbox, out)
    done, failed = {"a", "b", "twin"}, {"refused", "segfault", "rude", "broken"}
    assert names(inbox / "done") == {f"{x}{end}" for x in done for end in (".toml", ".json")}
    assert names(inbox / "failed") == {f"{x}{end}" for x in failed for end in (".toml", ".json")}
    assert names(inbox) == {"notes.txt", "work", "done", "failed"}
    assert names(inbox / "work") == set()
    told = {path.stem: json.loads(path.read_bytes()) for path in inbox.glob("*/*.json")}
    assert told["a"]["files"][0]["path"] == "a/a.dxf" and told["a"]["state"] == "done"
    assert [told[x]["exit"] for x in sorted(failed)] == [2, 2, 2, 70]
    assert {"a", "b"} <= names(out)


def test_a_file_that_is_still_being_written_is_not_taken(tmp_path: Path) -> None:
    inbox, out = tmp_path / "in", tmp_path / "out"
    drop(inbox, "slow")
    end = time.monotonic() + 0.6
    changed: list[float] = []

    def write() -> None:
        while time.monotonic() < end:
            with (inbox / "slow.toml").open("a") as stream:
                stream.write("# more to come\n")
            changed.append(time.monotonic())
            time.sleep(0.01)

    writer = threading.Thread(target=write)
    writer.start()
    (record,) = watched(inbox, out)
    writer.join()
    assert record.result.state == "done"
    assert not (inbox / "slow.toml").exists()  # no write came after it was taken
    assert "# more to come" in (inbox / "done" / "slow.toml").read_text()


def test_files_that_a_job_names_stay_in_the_hot_folder(tmp_path: Path) -> None:
    inbox, out = tmp_path / "in", tmp_path / "out"
    inbox.mkdir()
    (inbox / "rail.csv").write_text("0,0,0\n20,0,0\n40,5,0\n60,20,0\n")
    (inbox / "strip.toml").write_text(
        'name = "strip"\n[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nlength = 30\n'
        '[surface.directrix]\nkind = "points"\nfile = "rail.csv"\n'
    )
    words = ["watch", str(inbox), "-o", str(out), "--to", "dxf", "--every", "0.05", "--once"]
    assert devcad(words) == 0
    assert (out / "strip" / "strip.dxf").is_file() and (inbox / "rail.csv").is_file()


def test_what_was_being_made_when_a_watch_was_killed_is_made_by_the_next(tmp_path: Path) -> None:
    inbox, out = tmp_path / "in", tmp_path / "out"
    inbox.mkdir()
    drop(inbox / "work", "a")
    assert [record.name for record in watched(inbox, out)] == ["a"]
    assert names(inbox / "done") == {"a.toml", "a.json"}


def test_one_watch_a_folder(tmp_path: Path) -> None:
    inbox = tmp_path / "in"
    (inbox / "work").mkdir(parents=True)
    handle = claim(inbox / "work" / ".lock", inbox, shared=False)
    with pytest.raises(FileError, match="at work in this folder"):
        watched(inbox, tmp_path / "out")
    os.close(handle)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_watch_and_gives_back_what_was_not_made(
    tmp_path: Path, number: signal.Signals
) -> None:
    inbox, out = tmp_path / "in", tmp_path / "out"
    drop(inbox, "a")
    process = subprocess.Popen(
        [sys.executable, "-m", "devcad", "watch", str(inbox), "-o", str(out), "--every", "0.1"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # whoever runs the tests in the background may have it ignored, and children inherit that
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "done  a\n"
    for k in range(40):
        drop(inbox, f"p{k}", 100 + k)
    while not any((inbox / "work").glob("*.toml")):
        time.sleep(0.02)
    process.send_signal(number)
    out_text, errors = process.communicate(timeout=20)
    assert process.returncode == 128 + number and errors == ""
    made = {line.split()[1] for line in out_text.splitlines()}
    assert names(inbox / "work") == set()
    assert len(list(inbox.glob("*.toml"))) == 40 - len(made)
    assert not list(out.glob(".p*"))
