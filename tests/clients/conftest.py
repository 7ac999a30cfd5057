"""Every sample exported once a session, and opened once by each client that reads many files."""

from __future__ import annotations

import json
from pathlib import Path

import clients
import pytest
from exported import Exported, Look

import devcad

SAMPLES = sorted((clients.REPOSITORY / "samples").glob("*.toml"))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "sample" in metafunc.fixturenames:
        metafunc.parametrize("sample", [path.stem for path in SAMPLES])


@pytest.fixture(scope="session")
def exports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Exported | Exception]:
    """All samples by file name; a sample that does not build fails its own tests only."""
    out = tmp_path_factory.mktemp("out")

    def export(job: Path) -> Exported | Exception:
        try:
            part = devcad.build(job)
            devcad.export(part, out)
        except Exception as problem:
            return problem
        folder = out / part.name
        report = json.loads((folder / "report.json").read_text())
        return Exported(folder, report, part.thickness, part.tolerance)

    return {job.stem: export(job) for job in SAMPLES}


@pytest.fixture
def exported(sample: str, exports: dict[str, Exported | Exception]) -> Exported:
    found = exports[sample]
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
    """FreeCAD's view of a STEP or DXF file of any sample."""
    answer = tmp_path_factory.mktemp("freecad") / "answer.json"
    return _looker(clients.freecad(_every(exports, "step", "dxf"), answer)["files"])


@pytest.fixture(scope="session")
def in_node(
    exports: dict[str, Exported | Exception], tmp_path_factory: pytest.TempPathFactory
) -> Look:
    """The view of the JavaScript clients of any file of any sample."""
    answer = tmp_path_factory.mktemp("node") / "answer.json"
    return _looker(clients.node(_every(exports, "step", "dxf", "stl", "glb"), answer))
