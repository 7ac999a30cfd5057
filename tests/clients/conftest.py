"""Every job exported once a session, and opened once by each client that reads many files."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import clients
import pytest
from exported import Exported, Look

import devcad
from devcad.export import DEFAULT_FORMATS
from devcad.job.load import load
from devcad.pipeline import plan

STEP = ("step", "step-flat", "step-sheet")
SAMPLES = clients.REPOSITORY / "samples"

PAIR = """
name = "pair"
thickness = 1.5
material = "brass-cuzn37"
[[panel]]
name = "lid"
[panel.surface]
kind = "frustum"
radius = 80
top_radius = 20
height = 45
[panel.place]
origin = [0, 0, 100]
z_axis = [0, 0, 1]
x_axis = [0, 1, 0]
[[panel]]
name = "wall"
[panel.surface]
kind = "cylinder"
radius = 80
sweep = 270
length = 90
"""

AP242 = """
[recipe.step]
schema = "AP242"
"""


OPENED = """
name = "opened-{kind}"
[surface]
kind = "{kind}"
radius = 40
cut = 2.5
gap = 0.7
"""


def _jobs() -> dict[str, str]:
    """Every sample, the thick ones as surfaces without thickness too, and a part of two panels in
    both of STEP's schemas."""
    jobs = {path.stem: path.read_text() for path in sorted(SAMPLES.glob("*.toml"))}
    sheets = {
        f"{name}-sheet": re.sub(r"^thickness *=.*$", "", text, flags=re.MULTILINE)
        for name, text in jobs.items()
        if "\nthickness" in text
    }
    opened = {f"opened-{kind}": OPENED.format(kind=kind) for kind in ("oloid", "sphericon")}
    return jobs | sheets | opened | {"pair": PAIR, "pair-ap242": PAIR + AP242}


JOBS = _jobs()


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "job" in metafunc.fixturenames:
        metafunc.parametrize("job", JOBS)


@pytest.fixture(scope="session")
def exports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Exported | Exception]:
    """All jobs by name; one that does not build fails its own tests only."""
    home = tmp_path_factory.mktemp("jobs")
    for beside in (*SAMPLES.glob("*.csv"), *SAMPLES.glob("*.dxf")):
        shutil.copy(beside, home)

    def export(name: str, text: str) -> Exported | Exception:
        job = home / f"{name}.toml"
        job.write_text(text)
        try:
            loaded = load(job)
            part = devcad.build(loaded)
            formats = [*DEFAULT_FORMATS, "step-flat"]
            formats += ["step-sheet", "3mf"] if part.thickness else []
            options = plan(loaded).options
            devcad.export(part, home / name, formats=formats, options=options)
        except Exception as problem:
            return problem
        folder = home / name / part.name
        report = json.loads((folder / "report.json").read_text())
        sheets = [
            each for panel in part.panels for each in (panel.chains if part.thickness else ())
        ]
        areas = tuple(sheet.area for sheet in sheets)
        return Exported(folder, report, part.thickness, part.tolerance, part.colour, areas)

    return {name: export(name, text) for name, text in JOBS.items()}


@pytest.fixture
def exported(job: str, exports: dict[str, Exported | Exception]) -> Exported:
    found = exports[job]
    if isinstance(found, Exception):
        raise found
    return found


def _every(exports: dict[str, Exported | Exception], *formats: str) -> list[Path]:
    good = [found for found in exports.values() if isinstance(found, Exported)]
    return [path for found in good for format in formats for path in found.files(format)]


def _looker(facts: clients.Facts) -> Look:
    def look(path: Path) -> clients.Facts:
        seen: clients.Facts = facts[str(path)]
        assert "error" not in seen, seen["error"]
        return seen

    return look


@pytest.fixture(scope="session")
def in_freecad(
    exports: dict[str, Exported | Exception], tmp_path_factory: pytest.TempPathFactory
) -> Look:
    """FreeCAD's view of a STEP, DXF or SVG file of any job."""
    answer = tmp_path_factory.mktemp("freecad") / "answers"
    return _looker(clients.freecad(_every(exports, *STEP, "dxf", "svg"), answer))


@pytest.fixture(scope="session")
def in_node(
    exports: dict[str, Exported | Exception], tmp_path_factory: pytest.TempPathFactory
) -> Look:
    """The view of the JavaScript clients of any file of any job."""
    answer = tmp_path_factory.mktemp("node") / "answer.json"
    return _looker(clients.node(_every(exports, *STEP, "dxf", "stl", "glb"), answer))
