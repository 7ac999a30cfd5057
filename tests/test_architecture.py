"""The house: who may import whom, which library lives where, and that starting up is light."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
PACKAGE = REPOSITORY / "devcad"

LAYERS: list[set[str]] = [
    {"errors", "units", "libraries"},
    {"checks"},
    {"geometry"},
    {"features"},
    {"mesh", "flatten"},
    {"part"},
    {"shop", "simulate"},
    {"facts", "mechanisms", "proofs", "seams", "poses"},
    {"making"},
    {"folded"},
    {"assemble", "finishing"},
    {"export", "importers"},
    {"job"},
    {"report"},
    {"pipeline"},
    {"console", "interrupts"},
    {"batch", "interop", "showing"},
    {"outcomes", "words"},
    {"batching", "folding", "arguments"},
    {"clibatch"},
    {"cli"},
    {"__main__"},
]
"""Rooms of devcad/ from the ground up: imports go to lower layers or stay in the room."""

LIBRARIES: dict[str, list[str]] = {
    "numpy": [""],
    "scipy": ["geometry/", "mesh/", "flatten/", "simulate/", "importers/"],
    "OCP": ["export/step", "export/_step", "importers/step", "importers/face", "importers/_face"],
    "ezdxf": ["export/dxf", "export/_dxf", "importers/dxf"],
    "shapely": ["flatten/", "shop/"],
    "HersheyFonts": ["flatten/lettering"],
    "lib3mf": ["export/threemf"],
    "reportlab": ["export/pdfcanvas.py"],
    "spyrrow": ["shop/_strip.py"],
    "pydantic": ["job", "geometry/curves", "geometry/constructions/"],
    "trimesh": ["mesh/", "importers/mesh"],
    "manifold3d": ["mesh/"],
    "xatlas": ["export/atlas.py"],
    "typer": ["cli.py", "clibatch.py", "arguments.py"],
    "click": ["cli.py"],
    "rich": ["report/progress.py"],
    "build123d": ["interop.py"],
    "distributed": ["batch/cluster.py"],
    "fsspec": ["batch/remote.py"],
}
"""Library -> the beginnings of the paths under devcad/ that may import it."""

LAZY = {
    "scipy",
    "shapely",
    "manifold3d",
    "trimesh",
    "build123d",
    "HersheyFonts",
    "xatlas",
    "spyrrow",
    "distributed",
    "fsspec",
}
"""Libraries imported inside functions only: most jobs do without them."""

MOST_LINES = 400  # style: a module of 300 asks whether it holds two ideas

SOURCES = sorted(PACKAGE.rglob("*.py"))
IDS = [str(path.relative_to(PACKAGE)) for path in SOURCES]


def room(module: str) -> str:
    """devcad.geometry.patch -> geometry; the package itself is the room ''."""
    words = module.split(".")
    return words[1] if len(words) > 1 else ""


def layer(name: str) -> int:
    """The floor of a room; devcad/__init__ is the roof: it may name anything."""
    return next((k for k, rooms in enumerate(LAYERS) if name in rooms), len(LAYERS))


def imports(path: Path) -> Iterator[tuple[str, int, bool]]:
    """Every import of a file: module, line, whether it stands inside a function."""
    tree = ast.parse(path.read_text())
    inside = {
        id(node)
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        for node in ast.walk(function)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno, id(node) in inside
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno} imports relatively"
            if node.module == "devcad":
                rooms = [alias.name for alias in node.names if alias.name != "__version__"]
                for name in rooms:
                    yield f"devcad.{name}", node.lineno, id(node) in inside
            else:
                yield str(node.module), node.lineno, id(node) in inside


@pytest.mark.parametrize("path", SOURCES, ids=IDS)
def test_every_file_has_a_room(path: Path) -> None:
    name = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    assert name == "__init__" or any(name in rooms for rooms in LAYERS)


@pytest.mark.parametrize("path", SOURCES, ids=IDS)
def test_imports_go_strictly_down(path: Path) -> None:
    own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    upward = [
        f"line {line}: {module}"
        for module, line, _ in imports(path)
        if module.split(".")[0] == "devcad"
        and room(module) != own
        and layer(room(module)) >= layer(own)
    ]
    assert not upward


@pytest.mark.parametrize("path", SOURCES, ids=IDS)
def test_libraries_stay_at_home(path: Path) -> None:
    own = path.relative_to(PACKAGE).as_posix()
    strays = [
        f"line {line}: {module}"
        for module, line, in_function in imports(path)
        if (top := module.split(".")[0]) not in sys.stdlib_module_names | {"devcad"}
        and not (own.startswith(tuple(LIBRARIES.get(top, []))) and (in_function or top not in LAZY))
    ]
    assert not strays


def test_every_library_that_is_imported_is_declared() -> None:
    """What pip installs with devcad is what devcad imports, by the names pip knows."""
    distribution = {
        "OCP": "cadquery-ocp-novtk",
        "click": "typer",
        "HersheyFonts": "Hershey-Fonts",
    }
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    lines = [*project["dependencies"], *project["optional-dependencies"]["cluster"]]
    declared = {line.split(">")[0] for line in lines}
    used = {
        distribution.get(top, top)
        for path in SOURCES
        for module, _, _ in imports(path)
        if (top := module.split(".")[0]) not in sys.stdlib_module_names | {"devcad"}
    }
    assert used <= declared


@pytest.mark.parametrize("path", SOURCES, ids=IDS)
def test_modules_are_small(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= MOST_LINES


HEAVY = (
    "OCP",
    "build123d",
    "trimesh",
    "scipy",
    "ezdxf",
    "numpy",
    "shapely",
    "manifold3d",
    "xatlas",
    "reportlab",
    "spyrrow",
    "distributed",
    "fsspec",
    "dask",
    "sqlite3",
    "multiprocessing",
)


@pytest.mark.parametrize(
    "words",
    ["import devcad.cli", "import devcad", "from devcad.__main__ import main"],
)
def test_starting_up_loads_nothing_heavy(words: str) -> None:
    """In a fresh interpreter; the test's own imports must not answer for it."""
    code = f"import sys; {words}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=REPOSITORY
    )
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & set(HEAVY)


def test_every_construction_has_an_oracle_and_a_sample() -> None:
    import oracles

    from devcad.geometry.constructions import SURFACES

    kinds = set(SURFACES)
    assert kinds <= set(oracles.KINDS)
    assert kinds <= set(_sample_kinds())


def _sample_kinds() -> Iterator[str]:
    for path in (REPOSITORY / "samples").glob("*.toml"):
        job = tomllib.loads(path.read_text())
        surfaces = [job["surface"]] if "surface" in job else []
        surfaces += [panel["surface"] for panel in job.get("panel", [])]
        yield from (surface["kind"] for surface in surfaces)


TEXT = {".py", ".toml", ".md", ".csv", ".cjs", ".json", ".svg", ""}
PRIVATE = (*(f"/{folder}/" for folder in ("home", "root", "Users", "tmp", "work")), "C:\\Users")


def test_no_file_names_a_place_of_one_machine() -> None:
    folders = ("devcad", "pipelines", "tests", "samples", ".ci")
    files = [path for folder in folders for path in (REPOSITORY / folder).rglob("*")]
    files += [path for path in REPOSITORY.iterdir() if path.suffix in {".md", ".toml"}]
    found = [
        f"{path.relative_to(REPOSITORY)}: {place}"
        for path in files
        if path.is_file() and path.suffix in TEXT and path != Path(__file__)
        for place in PRIVATE
        if place in path.read_text(errors="replace")
    ]
    assert not found
