"""What a batch tells while it works and when it is through."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest
from test_batch_run import LAMP

from devcad.cli import run as devcad
from devcad.report.progress import BatchBar, batch_words


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_line_tells_counts_rate_and_time_left() -> None:
    told = batch_words(parts=1000, done=240, failed=10, running=["a", "b"], made=200, seconds=100.0)
    # 750 left at 2 a second
    assert told == "240 done, 10 failed, 2 running of 1000, 2/s, 6:15 left, a, b"


def test_progress_goes_to_terminals_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr(sys, "stderr", stream)
        with BatchBar() as bar:
            bar.show(parts=2, done=1, failed=0, running=["[red]x"], made=1, seconds=1.0)
        assert ("1 done" in stream.getvalue()) == stream.isatty()
        assert ("[red]x" in stream.getvalue()) == stream.isatty()


def test_quiet_says_nothing_and_the_summary_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, radius in (("a", 100), ("b", -1)):
        (tmp_path / f"{name}.toml").write_text(LAMP.format(name=name, radius=radius))
    words = ["batch", str(tmp_path), "--to", "dxf", "-o", str(tmp_path / "out")]
    assert devcad([*words, "--quiet"]) == 2
    told = capsys.readouterr()
    assert told.out == "" and len(told.err.splitlines()) == 1
    assert devcad(words) == 2
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:-1] for line in lines[:2]] == [["done"], ["unchanged"]]
    assert [line.split()[-1] for line in lines[:3]] == ["1"] * 3
    assert lines[3].split()[:2] == ["parts", "2"]
    page = (tmp_path / "out" / "index.html").read_text()
    assert 'href="a/index.html"' in page and 'href="b/' not in page
    assert page.count("</svg>") == 1 and "1 done, 1 failed" in page


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--shard", "0/3"], '--shard: "0/3" is no shard'),
        (["--shard", "4/3"], '--shard: "4/3" is no shard'),
        (["--timeout", "0"], "--timeout: 0 is too little"),
        (["--memory", "nan"], "--memory: nan is too little"),
        (["--to", "dfx"], "--to: "),
        (["--pipeline", "cardboard"], "--pipeline: "),
    ],
)
def test_wrong_words_are_told_before_anything_is_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    out = tmp_path / "out"
    assert devcad(["batch", str(tmp_path), "-o", str(out), *words, "--json"]) == 2
    told = capsys.readouterr()
    assert told.err.startswith(says) and not out.exists()
    assert json.loads(told.out)[0]["error"]["code"] == 2
