"""Parts made by a cluster, and parts published to a storage."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import faulty
import pytest
from test_batch_run import WORDS, jobs, states

from devcad.batch.run import Settings, Tally, run
from devcad.batch.workers import Walls
from devcad.cli import run as devcad
from devcad.errors import FileError

CLUSTER = "dask.distributed is an extra of devcad"
STORAGE = "fsspec is an extra of devcad"


class Machines:
    """A scheduler and its workers, processes of this machine."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        self._log = (folder / "log").open("w")
        self.processes = [self._started("scheduler", "--port", "0", "--no-dashboard")]
        end = time.monotonic() + 60.0
        while not self._file.exists():
            assert time.monotonic() < end and self.processes[0].poll() is None
            time.sleep(0.05)
        self.address = str(json.loads(self._file.read_text())["address"])
        for _ in range(2):
            self.processes.append(
                self._started(
                    "worker", "--nthreads", "1", "--no-dashboard", "--death-timeout", "60"
                )
            )

    def _started(self, what: str, *words: str) -> subprocess.Popen[bytes]:
        path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *words]
        return subprocess.Popen(
            [*command, "--scheduler-file", str(self._file)],
            env={**os.environ, "PYTHONPATH": path},
            stdout=self._log,
            stderr=self._log,
            start_new_session=True,
        )

    def kill(self, number: int) -> None:
        os.killpg(self.processes[number].pid, signal.SIGKILL)
        self.processes[number].wait()

    def close(self) -> None:
        for number, process in enumerate(self.processes):
            if process.poll() is None:
                self.kill(number)
        self._log.close()


@pytest.fixture
def machines(tmp_path: Path) -> Iterator[Machines]:
    pytest.importorskip("distributed", reason=CLUSTER)
    made = Machines(tmp_path)
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # dask's own threads and sockets
def test_two_machines_one_of_them_killed_and_a_part_that_kills_its_process(
    tmp_path: Path, machines: Machines
) -> None:
    """Every part is made; the one that crashes fails alone, and no machine with it."""
    names = [f"slow-{k:02}" for k in range(60)]
    orders, out = jobs(tmp_path / "jobs", *names, "segfault", "hang"), tmp_path / "out"
    settings = Settings(
        out, WORDS, walls=Walls(seconds=5.0), work=faulty.work, scheduler=machines.address
    )
    killed: list[int] = []

    def show(tally: Tally) -> None:
        if tally.done > 10 and not killed:
            killed.append(tally.done)
            machines.kill(1)

    batch = run(orders, settings, show)
    assert killed
    told = states(batch)
    assert {told[name] for name in names} == {"done"}
    causes = {record.name: record.result.cause for record in batch.records}
    assert causes["segfault"] == "crashed: signal 11"
    assert causes["hang"] == "timed out after 5 s"
    clean = tmp_path / "clean"
    run(orders[:60], Settings(clean, WORDS, 2, work=faulty.work), lambda tally: None)
    ours, alone = faulty.contents(out), faulty.contents(clean)
    told_of_all = {"manifest.json": b"", "index.html": b""}  # the two that fail stand in them
    assert ours | told_of_all == alone | told_of_all
    again = run(orders[:60], settings, lambda tally: None)
    assert again.tally.unchanged == 60


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_the_command_line_on_a_cluster_gives_the_files_of_a_single_export(
    tmp_path: Path, machines: Machines
) -> None:
    words = [order.path for order in jobs(tmp_path, "a", "b")]
    batch = ["batch", *words, "--to", "dxf", "-o", str(tmp_path / "out")]
    assert devcad([*batch, "--scheduler", machines.address]) == 0
    assert devcad(["export", *words, "--to", "dxf", "-o", str(tmp_path / "single")]) == 0
    ours = faulty.contents(tmp_path / "out")
    lists = {"manifest.json", "cutlist.csv", "index.html"}
    assert ours.keys() - lists == {n for n in ours if "/" in n}
    assert {n: ours[n] for n in ours if "/" in n} == faulty.contents(tmp_path / "single")


def test_an_extra_that_is_missing_is_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (order,) = jobs(tmp_path, "a")
    for module in ("distributed", "fsspec", "fsspec.core"):
        monkeypatch.setitem(sys.modules, module, None)
    to = ["--to", "dxf", "-o", str(tmp_path / "out")]
    assert devcad(["batch", order.path, *to, "--scheduler", "tcp://127.0.0.1:1"]) == 5
    assert devcad(["batch", order.path, "-o", "s3://bucket/parts"]) == 5
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and all("pip install 'devcad[cluster]'" in line for line in lines)


@pytest.mark.slow
def test_a_storage_holds_the_files_of_a_single_export(tmp_path: Path) -> None:
    pytest.importorskip("fsspec", reason=STORAGE)
    words = [order.path for order in jobs(tmp_path, "a", "b")]
    (tmp_path / "b.toml").write_text('name = "b"\n')
    bucket = tmp_path / "bucket"
    batch = ["batch", *words, "--to", "dxf", "-o", f"file://{bucket}/parts", "-q"]
    assert devcad(batch) == 2
    assert devcad(["export", words[0], "--to", "dxf", "-o", str(tmp_path / "single")]) == 0
    ours = faulty.contents(bucket / "parts")
    single = faulty.contents(tmp_path / "single")
    assert {name: data for name, data in ours.items() if "/" in name} == single
    assert (bucket / "parts" / ".failed" / "b.json").is_file()
    before = {path: path.stat().st_mtime_ns for path in (bucket / "parts" / "a").iterdir()}
    assert devcad(batch) == 2  # nothing is made again
    assert before == {path: path.stat().st_mtime_ns for path in before}
    (bucket / "parts" / "a" / "report.json").unlink()
    assert devcad(batch) == 2
    assert faulty.contents(bucket / "parts") == ours


def test_a_storage_that_refuses_is_named(tmp_path: Path) -> None:
    pytest.importorskip("fsspec", reason=STORAGE)
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="the storage refused"):
        run(
            jobs(tmp_path, "a"),
            Settings(f"file://{tmp_path}/file/parts", WORDS, 1),
            lambda tally: None,
        )
