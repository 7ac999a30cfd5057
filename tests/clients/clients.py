"""Real programs that open our files: how each is found, run and read.

Their exit codes say little (FreeCAD, admesh and PrusaSlicer return 0 on broken files), so every
helper demands an answer in words or JSON and fails without one. A program that is not installed
skips its tests; with DEVCAD_REQUIRE_CLIENTS=1 it fails them instead.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import pytest

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[1]
SECONDS = 300  # one run opens every sample; a hung client must not hang the suite

Facts = dict[str, Any]


def missing(name: str) -> NoReturn:
    """Skip the test that needs this program, or fail it where all programs are required."""
    if os.environ.get("DEVCAD_REQUIRE_CLIENTS") == "1":
        pytest.fail(f"{name} is not installed, and DEVCAD_REQUIRE_CLIENTS=1", pytrace=False)
    pytest.skip(f"{name} is not installed")


def program(name: str) -> str:
    """The path of a program on the PATH."""
    found = shutil.which(name)
    return found if found else missing(name)


def node_packages() -> Path:
    """The folder with the npm clients: DEVCAD_NPM, else .clients in the repository."""
    folder = Path(os.environ.get("DEVCAD_NPM", REPOSITORY / ".clients"))
    wanted = ("gltf-validator", "three", "dxf-parser", "occt-import-js")
    absent = [name for name in wanted if not (folder / "node_modules" / name).is_dir()]
    return folder if not absent else missing(f"npm package {absent[0]}")


def run(command: Sequence[str | Path], **environment: str) -> str:
    """What a program prints on both streams together; it gets no stdin and no display."""
    done = subprocess.run(
        [str(word) for word in command],
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=SECONDS,
        check=False,
    )
    return done.stdout.decode(errors="replace")


def freecad(files: Sequence[Path], out: Path) -> Facts:
    """FreeCAD's view of STEP, DXF and SVG files by path, all in one start of the program.

    A file that crashes it has an entry "error", and another start reads the files after it.
    """
    words = (program("freecadcmd"), HERE / "freecad_macro.py")
    listing, facts = out.with_suffix(".list"), Facts()
    while rest := [str(file) for file in files if str(file) not in facts]:
        listing.write_text("\n".join(rest))
        out.write_text("")
        printed = run(words, DEVCAD_FILES=str(listing), DEVCAD_ANSWER=str(out))
        facts |= dict(json.loads(line) for line in out.read_text().splitlines())
        for file in [file for file in rest if file not in facts][:1]:
            facts[file] = {"error": f"FreeCAD crashed:\n{printed[-2000:]}"}
    return facts


def node(files: Sequence[Path], out: Path) -> Facts:
    """What the npm clients say about STEP, DXF, STL and GLB files, by path."""
    words = (program("node"), HERE / "node_clients.cjs", node_packages(), out)
    printed = run([*words, *files])
    assert out.is_file(), f"the clients wrote no answer:\n{printed[-2000:]}"
    facts: Facts = json.loads(out.read_text())
    return facts


def librecad(file: Path) -> Path:
    """The PDF, beside the file, that LibreCAD prints of a DXF at scale 1:1."""
    printed = run([program("librecad"), "dxf2pdf", "-s", "1", "-c", file])
    out = file.with_suffix(".pdf")
    assert out.is_file() and out.stat().st_size, f"LibreCAD printed nothing:\n{printed[-2000:]}"
    return out


def prusa_slicer(file: Path) -> list[dict[str, str]]:
    """PrusaSlicer's ``key = value`` lines about each object of a mesh file."""
    printed = run([program("prusa-slicer"), "--info", file])
    pairs = re.compile(r"^(\w+) = (.*?)\s*$", re.MULTILINE)
    objects = [dict(pairs.findall(text)) for text in printed.split(f"[{file.name}]")[1:]]
    assert objects and all(objects), f"PrusaSlicer said nothing:\n{printed[-2000:]}"
    return objects


def admesh(file: Path) -> dict[str, float]:
    """admesh's statistics, the first number of each line: the file as it is, before repairs."""
    printed = run([program("admesh"), file])
    found = re.findall(r"([A-Z][a-z0-9 ]+?) *: +(-?[\d.]+)", printed)
    facts = {name: float(number) for name, number in found}
    assert facts, f"admesh said nothing:\n{printed[-2000:]}"
    return facts
