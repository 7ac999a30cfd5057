"""A batch: what lies in its folder afterwards, and what a second one leaves alone."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import faulty
import pytest

from devcad.batch.orders import Order
from devcad.batch.places import Folder
from devcad.batch.planning import Shard
from devcad.batch.prints import Words
from devcad.batch.run import Batch, Settings, run
from devcad.batch.workers import Walls
from devcad.cli import run as devcad
from devcad.errors import FileError, JobError

LAMP = 'name = "{name}"\nthickness = 1.0\n[surface]\nkind = "frustum"\nradius = {radius}\n'
LAMP += "top_radius = 50\nheight = 120\n"
WORDS = Words(formats=("dxf",))


def jobs(folder: Path, *names: str) -> list[Order]:
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        (folder / f"{name}.toml").write_text(LAMP.format(name=name, radius=100 + k))
    return [Order(str(folder / f"{name}.toml")) for name in names]


def quick(orders: list[Order], out: Path, **options: Any) -> Batch:
    """A batch of parts without geometry."""
    settings = Settings(out, WORDS, workers=2, work=faulty.work, **options)
    return run(orders, settings, lambda tally: None)


def made(out: Path) -> list[str]:
    """The names of the parts in the order in which they were begun, in all runs."""
    log = out / ".batch" / "log"
    return log.read_text().split() if log.exists() else []


def states(batch: Batch) -> dict[str, str]:
    return {part["job"]: part["state"] for part in batch.manifest["parts"]}


# --- one batch -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, Path]]:
    """The folders of two single exports and of a batch of the same jobs."""
    folder = tmp_path_factory.mktemp("both")
    words = [order.path for order in jobs(folder, "a", "b")]
    (folder / "b.toml").write_text(
        'name = "b"\nthickness = 2.0\nmaterial = "dc01"\n[meta]\nquantity = 3\nrevision = "7"\n'
        'grain = 45\n[[panel]]\nname = "one"\n[panel.surface]\nkind = "plane"\nwidth = 30\n'
        'height = 20\n[[panel]]\nname = "two"\n[panel.surface]\nkind = "plane"\nwidth = 10\n'
        "height = 20\n"
    )
    single, batch = folder / "single", folder / "batch"
    to = ["--to", "dxf,svg,cutlist"]
    assert devcad(["export", *words, *to, "-o", str(single)]) == 0
    assert devcad(["batch", *words, *to, "-o", str(batch), "--quiet"]) == 0
    yield single, batch


def test_the_files_are_those_of_single_exports_byte_for_byte(both: tuple[Path, Path]) -> None:
    single, batch = both
    ours = faulty.contents(batch)
    lists = {name: ours.pop(name) for name in ("manifest.json", "cutlist.csv", "index.html")}
    assert ours == faulty.contents(single)
    parts = json.loads(lists["manifest.json"])["parts"]
    assert [(part["job"], part["state"], part["exit"]) for part in parts] == [
        ("a", "done", 0),
        ("b", "done", 0),
    ]
    assert {file["path"] for part in parts for file in part["files"]} == set(ours)


def test_the_cut_list_has_the_rows_of_the_parts_by_material(both: tuple[Path, Path]) -> None:
    single, batch = both

    def rows(path: Path) -> list[dict[str, str]]:
        return list(csv.DictReader(io.StringIO(path.read_text())))

    found = rows(batch / "cutlist.csv")
    assert [(row["material"], row["part"], row["panel"]) for row in found] == [
        ("", "a", "a"),
        ("dc01", "b", "one"),
        ("dc01", "b", "two"),
    ]
    wanted = rows(single / "a" / "a-cutlist.csv") + rows(single / "b" / "b-cutlist.csv")
    for row, other in zip(found, wanted, strict=True):
        other["file"] = f"{row['part']}/{other['file']}"
        assert {**other, "due": ""} == row


def test_a_list_changes_keys_and_names_the_row_of_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jobs(tmp_path, "lamp")
    (tmp_path / "parts.csv").write_text(
        "job,name,surface.radius,quantity,due\n"
        "lamp.toml,wide,120.5,2,\nlamp.toml,none,-1,1,\nlamp.toml,slim,60,4,2026-01-02\n"
    )
    words = ["batch", str(tmp_path / "parts.csv"), "--to", "dxf", "-o", str(tmp_path / "out")]
    assert devcad([*words, "--json"]) == 2
    told = capsys.readouterr()
    parts = json.loads(told.out)["parts"]
    assert [(part["job"], part["state"]) for part in parts] == [
        ("wide", "done"),
        ("none", "failed"),
        ("slim", "done"),
    ]
    assert parts[1]["files"] == [] and not (tmp_path / "out" / "none").exists()
    assert f"{tmp_path}/parts.csv > row 3, column surface.radius" in told.err
    assert len(told.err.splitlines()) == 1
    why = json.loads((tmp_path / "out" / ".failed" / "none.json").read_bytes())
    assert why["message"] == parts[1]["message"] and why["exit"] == 2
    box = {
        name: json.loads((tmp_path / "out" / name / "report.json").read_bytes())["panels"][0]
        for name in ("wide", "slim")
    }
    # the lateral area of a frustum of a cone of radii R, 50 and height 120
    for name, radius in (("wide", 120.5), ("slim", 60.0)):
        slant = ((radius - 50) ** 2 + 120**2) ** 0.5
        assert box[name]["area"] == pytest.approx(3.141592653589793 * (radius + 50) * slant)


def test_two_parts_of_one_name_are_refused_before_anything_is_done(tmp_path: Path) -> None:
    orders = jobs(tmp_path, "a", "b")
    (tmp_path / "b.toml").write_text(LAMP.format(name="A", radius=3))
    with pytest.raises(JobError, match='the name "A" is taken by'):
        quick(orders, tmp_path / "out")
    for name in ("Manifest.json", "cutlist-1-of-3.csv", "index.html"):
        (tmp_path / "b.toml").write_text(LAMP.format(name=name, radius=3))
        with pytest.raises(JobError, match="the batch's own lists"):
            quick(orders, tmp_path / "out")
    assert made(tmp_path / "out") == []


def test_parts_that_are_due_come_first(tmp_path: Path) -> None:
    orders = [
        Order(order.path, due=due)
        for order, due in zip(
            jobs(tmp_path, "a", "b", "c"), ("", "2026-12-24", "2026-01-31"), strict=True
        )
    ]
    settings = Settings(tmp_path / "out", WORDS, workers=1, work=faulty.work)
    run(orders, settings, lambda tally: None)
    assert made(tmp_path / "out") == ["c", "b", "a"]


# --- again ---------------------------------------------------------------------------------


def test_only_what_is_missing_or_changed_is_made_again(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a", "b", "c", "d", "refused"), tmp_path / "out"
    quick(orders, out)
    before = faulty.contents(out)
    assert sorted(made(out)) == ["a", "b", "c", "d", "refused"]

    def again() -> list[str]:
        known = len(made(out))
        quick(orders, out)
        assert faulty.contents(out).keys() == before.keys()
        return sorted(made(out)[known:])

    assert again() == []
    (tmp_path / "a.toml").write_text(LAMP.format(name="a", radius=7))  # a job changed
    (out / "b" / "b.dxf").write_text("torn")  # a file was spoilt
    (out / "c" / "c.dxf").unlink()  # a file was lost
    assert again() == ["a", "b", "c"]
    (out / ".batch" / "ledger.sqlite").write_bytes(b"no ledger" * 1000)
    assert again() == []
    for path in (out / ".batch").glob("ledger*"):
        path.unlink()
    os.utime(out / "d" / "d.dxf", ns=(1, 1))  # as in a copy of the folder
    assert again() == []


def test_other_formats_and_recipes_are_other_parts(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    for words in (
        Words(formats=("dxf",)),
        Words(formats=("svg",)),
        Words(formats=("svg",), allow=("overlap",)),
        Words(pipeline="paper", formats=("svg",)),
    ):
        for _ in range(2):
            run(orders, Settings(out, words, 1, work=faulty.work), lambda tally: None)
    assert made(out) == ["a"] * 4


def test_a_file_that_a_job_names_counts(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    with (tmp_path / "a.toml").open("a") as job:
        job.write('[surface.curve]\nkind = "points"\nfile = "rail.csv"\n')
    for text in ("0,0,0\n", "0,0,0\n", "0,0,1\n"):
        (tmp_path / "rail.csv").write_text(text)
        quick(orders, out)
    assert made(out) == ["a"] * 2


def test_a_part_that_fails_now_leaves_no_older_folder_behind(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    quick(orders, out)
    assert (out / "a" / "a.dxf").is_file()
    (tmp_path / "a.toml").write_text(LAMP.format(name="a", radius=-1))
    assert quick(orders, out).code == 2
    assert not (out / "a").exists()
    assert (out / ".failed" / "a" / "a.dxf").is_file()
    (tmp_path / "a.toml").write_text(LAMP.format(name="a", radius=90))
    assert quick(orders, out).code == 0
    assert not (out / ".failed").exists()


def test_what_others_put_into_a_part_stays_where_they_put_it(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    quick(orders, out)
    notes = out / "a" / "notes.txt"
    notes.write_text("mine")
    (tmp_path / "a.toml").write_text(LAMP.format(name="a", radius=90))
    for _ in range(2):  # refused as long as it is there
        assert quick(orders, out).code == FileError.code
        assert [path.name for path in (out / "a").iterdir()] == ["notes.txt"]
    assert (out / ".failed" / "a" / "a.dxf").is_file()
    notes.rename(tmp_path / "notes.txt")
    assert quick(orders, out).code == 0
    assert not (out / ".failed").exists()


def test_what_killed_batches_left_is_removed(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    quick(orders, out)
    hexes = "0123456789abcdef"
    names = (".index.html", ".manifest-1-of-3.json", ".cutlist.csv")
    litter = [out / f"{name}-{hexes}.part" for name in names]
    litter.append(out / ".batch" / "worker-1-0.txt")
    for path in [*litter, out / f".mine.txt-{hexes}.part"]:
        path.write_text("torn")
    quick(orders, out)
    assert not any(path.exists() for path in litter)
    assert (out / f".mine.txt-{hexes}.part").exists()  # no name of ours


def test_shards_share_a_folder_and_make_every_part_once(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, *(f"p{k}" for k in range(7))), tmp_path / "out"
    for number in (3, 1, 2):
        quick(orders, out, shard=Shard(number, 3))
    assert sorted(made(out)) == [f"p{k}" for k in range(7)]
    told = json.loads((out / "manifest-2-of-3.json").read_bytes())["parts"]
    assert [part["job"] for part in told] == ["p1", "p4"]  # 1 + k mod 3 = 2
    batch = quick(orders, out)
    assert len(made(out)) == 7 and set(states(batch).values()) == {"done"}
    assert (out / "manifest.json").is_file()


# --- what stands in the way ------------------------------------------------------------------


def test_a_second_batch_on_one_folder_is_told_who_is_at_work(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    with Folder(out).claimed(), pytest.raises(FileError, match=rf"process {os.getpid()}"):
        quick(orders, out)
    with Folder(out).claimed("1-of-2"), pytest.raises(FileError, match="at work"):
        quick(orders, out)
    with Folder(out).claimed("1-of-2"):
        quick(orders, out, shard=Shard(2, 2))
    assert quick(orders, out).code == 0


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError) as caught:
        quick(jobs(tmp_path, "a"), tmp_path / "file" / "out")
    assert caught.value.code == 5 and str(tmp_path / "file") in str(caught.value)


def test_a_job_that_cannot_be_read_fails_alone(tmp_path: Path) -> None:
    orders = [*jobs(tmp_path, "a"), Order(str(tmp_path / "missing.toml"))]
    (tmp_path / "broken.toml").write_text("name = ")
    (tmp_path / "a b.toml").write_text('name = "../../x"\n')
    orders += [Order(str(tmp_path / "broken.toml")), Order(str(tmp_path / "a b.toml"))]
    batch = run(orders, Settings(tmp_path / "out", WORDS, 2), lambda tally: None)
    ends = [(part["job"], part["exit"]) for part in batch.manifest["parts"]]
    assert ends == [("a", 0), ("missing", 5), ("broken", 2), ("a-b", 2)]
    assert batch.code == 5


def test_starting_a_batch_that_has_nothing_to_do_loads_no_geometry(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "a"), tmp_path / "out"
    quick(orders, out)
    code = (
        "import sys\nfrom pathlib import Path\nfrom devcad.batch.orders import orders_of\n"
        "import devcad.cli\n"
        "light = {'sqlite3', 'multiprocessing', 'dask', 'distributed', 'fsspec'}\n"
        "assert not light & set(sys.modules), light & set(sys.modules)\n"
        "from devcad.batch.run import Settings, run\nfrom devcad.batch.prints import Words\n"
        f"b = run(orders_of([{str(orders[0].path)!r}]), "
        f"Settings(Path({str(out)!r}), Words(formats=('dxf',))), lambda t: None)\n"
        "assert b.tally.unchanged == 1\n"
        "assert not {'scipy', 'OCP', 'pydantic', 'ezdxf'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_clock_on_the_wall_does_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A clock that jumps by a year each time it is read ends no part and begins none anew."""
    jumps = iter(range(10**9))
    monkeypatch.setattr(time, "time", lambda: 3e7 * next(jumps))
    batch = quick(jobs(tmp_path, "a", "b"), tmp_path / "out", walls=Walls(seconds=60.0))
    assert set(states(batch).values()) == {"done"}
    assert batch.tally.seconds < 60.0


def test_the_manifest_is_gone_while_parts_are_made(tmp_path: Path) -> None:
    orders, out = jobs(tmp_path, "slow-1", "slow-2"), tmp_path / "out"
    quick(orders[:1], out)
    seen: list[bool] = []
    settings = Settings(out, WORDS, 1, work=faulty.work)
    run(orders, settings, lambda tally: seen.append((out / "manifest.json").exists()))
    assert seen[0] and not any(seen[1:])
    assert (out / "manifest.json").exists()
