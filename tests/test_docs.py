"""What the documents promise is what the program has."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import get_args

import pytest
import test_architecture
import typer

import devcad
from devcad import cli, errors

REPOSITORY = Path(__file__).parents[1]
README = (REPOSITORY / "README.md").read_text()
CONTRIBUTING = (REPOSITORY / "CONTRIBUTING.md").read_text()
DOCUMENTS = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]


def blocks(text: str, language: str) -> list[str]:
    """The fenced code blocks of one language, in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def table_words(text: str, heading: str) -> set[str]:
    """The words in backticks in the first column of the first table under a heading."""
    section = text.split(f"\n{heading}\n", 1)[1].split("\n#", 1)[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("|")]
    return {word for cell in cells for word in re.findall(r"`([^`]+)`", cell)}


def test_the_first_two_commands_set_up_and_run_each_in_one_line() -> None:
    """CI takes them from here, by these words."""
    export, tests = blocks(README, "sh")[:2]
    setup = "python3.11 -m venv .venv && .venv/bin/pip install -q"
    assert export == f"{setup} . && .venv/bin/devcad export samples/lampshade.toml\n"
    assert tests == f"{setup} -e '.[test]' && .venv/bin/python -m pytest -n auto\n"


def test_the_readme_lists_every_surface_kind() -> None:
    from devcad.geometry.constructions import SURFACES

    assert table_words(README, "### Surface kinds") == set(SURFACES)


def test_the_readme_lists_every_curve_kind() -> None:
    from devcad.geometry.curves import CurveSpec

    union, *_ = get_args(CurveSpec)
    kinds = {get_args(model.model_fields["kind"].annotation)[0] for model in get_args(union)}
    assert table_words(README, "### Curves") == kinds


def test_the_readme_lists_every_format() -> None:
    from devcad.export import FORMATS

    files = table_words(README, "## What comes out")
    other = {
        "lorentz-svg": "spacelike-cone-lorentz-not-for-cutting.svg",
        "step-flat": "lampshade-flat.step",
        "step-sheet": "lampshade-sheet.step",
        "traveller": "lampshade-traveller.pdf",
        "cutlist": "lampshade-cutlist.csv",
        "bends": "lampshade-bends.csv",
        "rolling": "lampshade-rolling.csv",
        "motion": "tube-fourbar-motion.svg",
    }
    formats = {name for name in FORMATS if name not in other}
    named = {f"lampshade.{name}" for name in formats} | set(other.values())
    assert files == named | {"report.json", "index.html"}


def test_the_readme_lists_every_check() -> None:
    from devcad.checks import NAMES

    assert table_words(README, "## Checks") == set(NAMES)


def test_the_readme_shows_every_command() -> None:
    commands = typer.main.get_command(cli.app).commands  # type: ignore[attr-defined]
    assert [name for name in commands if f"devcad {name}" not in README] == []


def test_the_readme_lists_every_exit_code() -> None:
    section = README.split("## Exit codes", 1)[1].split("\n## ", 1)[0]
    listed = {int(code) for code in re.findall(r"^\| (\d+) \|", section, re.MULTILINE)}
    kinds = [errors.DevcadError, *errors.DevcadError.__subclasses__()]
    assert listed == {0} | {kind.code for kind in kinds}


def test_the_readme_lists_every_recipe() -> None:
    recipes = {path.stem for path in (REPOSITORY / "pipelines").glob("*.toml")}
    section = README.split("## Recipes", 1)[1]
    assert recipes <= set(re.findall(r"`([a-z-]+)`", section))


def test_the_readme_explains_the_sample_that_it_runs() -> None:
    explained = tomllib.loads(blocks(README, "toml")[0])
    sample = tomllib.loads((REPOSITORY / "samples" / "lampshade.toml").read_text())
    defaults = {"units": "mm", "tolerance": 0.05, "reference": "middle"}
    assert explained == defaults | sample


@pytest.mark.slow
def test_the_readme_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = blocks(README, "python")
    (tmp_path / "samples").symlink_to(REPOSITORY / "samples")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out.endswith(" mm2\n")
    assert (tmp_path / "out" / "lampshade" / "lampshade.dxf").is_file()


def test_the_pictures_are_what_their_script_draws() -> None:
    from devcad.report.page import pictures

    samples = REPOSITORY / "samples"
    drawn = pictures(devcad.build(samples / "lampshade.toml"))
    shown = [(samples / name).read_text() for name in ("lampshade.svg", "lampshade-unrolls.svg")]
    assert [f"{each}\n" for each in drawn] == shown, "draw them again: python samples/picture.py"


def test_contributing_shows_the_layers_that_the_tests_hold() -> None:
    rows = re.findall(r"^\| \d+ \| (.*?) \|", CONTRIBUTING, re.MULTILINE)
    shown = [set(re.findall(r"`(\w+?)(?:\.py|/)`", row)) for row in rows]
    assert shown == test_architecture.LAYERS


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_to_files(document: str) -> None:
    targets = re.findall(r"\]\(([^)#]+)\)", (REPOSITORY / document).read_text())
    local = [target for target in targets if not target.startswith("https://")]
    assert [target for target in local if not (REPOSITORY / target).exists()] == []


@pytest.mark.parametrize("document", DOCUMENTS)
def test_lines_fit_a_screen(document: str) -> None:
    lines = (REPOSITORY / document).read_text().splitlines()
    prose = [line for line in lines if not line.startswith("|")]
    assert max(map(len, prose)) <= 120  # the export command is the longest
