"""A batch whose parts crash, hang and eat memory, and one that is killed."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import faulty
import pytest
from test_batch_run import jobs, made, quick, states

from devcad.batch.workers import Walls
from devcad.errors import FileError

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")


def causes(batch: Any) -> dict[str, tuple[str, int, int]]:
    return {
        record.name: (record.result.cause, record.result.exit, record.attempts)
        for record in batch.records
    }


@linux
@pytest.mark.slow
def test_each_fault_fails_its_part_alone_with_its_class(tmp_path: Path) -> None:
    """Crashes, hangs and memory are tried twice, errors of the job once."""
    names = [
        "a",
        "segfault",
        "once",
        "hang",
        "eat",
        "swell",
        "abort",
        "leave",
        "refused",
        "full",
        "z",
    ]
    orders, out = jobs(tmp_path, *names), tmp_path / "out"
    batch = quick(orders, out, walls=Walls(seconds=4.0, memory=200 * faulty.MEGABYTE))
    assert causes(batch) == {
        "a": ("", 0, 1),
        "segfault": ("crashed: signal 11", 70, 2),
        "once": ("", 0, 2),
        "hang": ("timed out after 4 s", 4, 2),
        "eat": ("out of memory", 4, 2),
        "swell": ("out of memory", 4, 2),
        "abort": ("out of memory", 4, 2),
        "leave": ("crashed: exit code 3", 70, 2),
        "refused": ("", 2, 1),
        "full": ("", 5, 1),
        "z": ("", 0, 1),
    }
    done = {"a", "once", "z"}
    assert {name for name, state in states(batch).items() if state == "done"} == done
    assert {path.stem for path in (out / ".failed").iterdir()} == set(names) - done
    assert (
        "No space left on device" in json.loads((out / ".failed/full.json").read_text())["message"]
    )
    assert {path.name for path in out.iterdir() if path.is_dir()} == {*done, ".batch", ".failed"}
    assert batch.code == 70
    known = len(made(out))
    quick(orders, out, walls=Walls(seconds=4.0, memory=200 * faulty.MEGABYTE))
    assert "refused" not in made(out)[known:]  # it would be refused again


SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import faulty
from pathlib import Path
from devcad.batch.orders import orders_of
from devcad.batch.prints import Words
from devcad.batch.run import Settings, run
print("begin", flush=True)
run(orders_of([{jobs!r}]), Settings(Path({out!r}), Words(), 2, work=faulty.work), lambda t: None)
"""


def started(folder: Path, out: Path) -> subprocess.Popen[str]:
    tests = str(Path(__file__).parent)
    code = SCRIPT.format(tests=tests, jobs=str(folder), out=str(out))
    return subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, start_new_session=True
    )


def finish(process: subprocess.Popen[str]) -> None:
    process.communicate()
    assert process.returncode == 0


@linux
@pytest.mark.slow
def test_a_batch_killed_twenty_times_makes_every_part_once(tmp_path: Path) -> None:
    """kill -9 of the coordinator at random moments; in the end no part is missing, torn, doubled
    or left in a staging folder, and few were begun more than once."""
    count, kills, chance = 150, 20, random.Random(7)
    folder, out = tmp_path / "jobs", tmp_path / "out"
    jobs(folder, *(f"slow-{k:03}" for k in range(count)))
    for _ in range(kills):
        process = started(folder, out)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(chance.uniform(0.05, 0.6))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        for path in out.glob("slow-*"):  # whatever is there is whole
            report = json.loads((path / "report.json").read_bytes())
            assert (path / report["files"][0]["path"]).read_text() == path.name * 100
    finish(started(folder, out))
    clean = tmp_path / "clean"
    finish(started(folder, clean))
    assert faulty.contents(out) == faulty.contents(clean)
    assert not list(out.glob(".slow*"))
    begun = made(out)
    assert len(set(begun)) == count
    assert len(begun) <= count + 2 * kills  # two were under way when each kill came


@linux
@pytest.mark.slow
def test_killed_workers_and_a_killed_fork_server_cost_no_part(tmp_path: Path) -> None:
    folder, out = tmp_path / "jobs", tmp_path / "out"
    jobs(folder, *(f"slow-{k:03}" for k in range(120)))
    process, chance = started(folder, out), random.Random(3)
    killed = 0
    while process.poll() is None:
        time.sleep(0.25)
        below = descendants(process.pid)
        if below and killed < 8:
            os.kill(chance.choice(below), signal.SIGKILL)
            killed += 1
    finish(process)
    assert killed
    parts = json.loads((out / "manifest.json").read_bytes())["parts"]
    assert len(parts) == 120
    failed = [part for part in parts if part["state"] != "done"]
    assert all("crashed: " in part["message"] for part in failed)
    assert len(failed) <= 1  # a part is killed twice only by great misfortune
    finish(started(folder, out))
    parts = json.loads((out / "manifest.json").read_bytes())["parts"]
    assert all(part["state"] == "done" for part in parts)


def descendants(parent: int) -> list[int]:
    """The processes below one, but for the resource tracker of multiprocessing."""
    table = subprocess.run(
        ["ps", "-eo", "pid=,ppid=,args="], capture_output=True, text=True, check=True
    ).stdout
    rows = [line.split(None, 2) for line in table.splitlines()]
    out: list[int] = []
    wanted = {parent}
    while wanted:
        found = [row for row in rows if int(row[1]) in wanted and "resource_tracker" not in row[2]]
        wanted = {int(row[0]) for row in found}
        out += sorted(wanted)
    return out


@linux
@pytest.mark.slow
def test_a_full_disk_is_named_and_nothing_is_torn(tmp_path: Path) -> None:
    """On a file system of one megabyte, where the user may mount one."""
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", str(small)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        orders = jobs(tmp_path / "jobs", *(f"p{k:03}" for k in range(80)))
        try:
            batch = quick(orders, small / "out")
            failed = [part for part in batch.manifest["parts"] if part["state"] == "failed"]
            assert failed and {part["exit"] for part in failed} == {5}
            assert all("No space left on device" in part["message"] for part in failed)
        except FileError as error:  # not even the lists found room
            assert "No space left on device" in str(error)
        whole = list((small / "out").glob("p*"))
        assert whole
        for path in whole:
            assert (path / f"{path.name}.dxf").read_text() == path.name * 100
        assert not list((small / "out").glob(".p*"))
    finally:
        subprocess.run(["umount", str(small)], check=True)


@linux
@pytest.mark.slow
def test_a_folder_that_is_read_only_is_named(tmp_path: Path) -> None:
    """Root may write everywhere but on a file system that is mounted so."""
    small = tmp_path / "small"
    (small / "out").mkdir(parents=True)
    bind = ["mount", "--bind", str(small), str(small)]
    if shutil.which("mount") is None or subprocess.run(bind, capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", str(small)], check=True)
        with pytest.raises(FileError, match="Read-only file system") as caught:
            quick(jobs(tmp_path / "jobs", "a"), small / "out")
        assert caught.value.code == 5
    finally:
        subprocess.run(["umount", str(small)], check=True)
