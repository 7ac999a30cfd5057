"""``devcad view``: a page in a temporary folder, and a browser that is told of it."""

from __future__ import annotations

import shutil
import webbrowser
from pathlib import Path

import pytest
from jobs import JOBS

from devcad import cli


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The addresses that a browser was told."""
    told: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: bool(told.append(url)) or True)
    return told


def job(folder: Path, more: str = "") -> str:
    path = folder / "arc.toml"
    path.write_text(f'name = "arc"\n{more}[surface]\n{JOBS["arc"]}\n')
    return str(path)


def test_the_page_is_built_and_opened(
    tmp_path: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["view", job(tmp_path)]) == 0
    page = Path(capsys.readouterr().out.strip())
    try:
        assert opened == [page.as_uri()]
        assert b"<title>arc</title>" in page.read_bytes()
        assert tmp_path not in page.parents
    finally:
        shutil.rmtree(page.parents[1])


def test_no_browser_is_opened_where_none_is_asked_for(
    tmp_path: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["view", job(tmp_path), "--no-browser"]) == 0
    shutil.rmtree(Path(capsys.readouterr().out.strip()).parents[1])
    assert opened == []


def test_a_job_that_cannot_be_built_opens_nothing(
    tmp_path: Path, opened: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["view", job(tmp_path, "thickness = -1\n")]) == 2
    out, err = capsys.readouterr()
    assert (out, opened) == ("", [])
    assert "thickness" in err
