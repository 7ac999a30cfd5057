"""devcad: from a small text file that describes a developable surface to files for the workshop.

    part = devcad.build("samples/lampshade.toml")
    devcad.export(part, "out", formats=["step", "dxf"])
    part.panels[0].pattern.area

A face of build123d unrolls with ``devcad.unroll(face)``; parts become build123d objects in
``devcad.interop``.

Importing this package loads neither numpy nor any other large library.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import devcad.export  # noqa: F401 - before the function below, which keeps the name
from devcad.errors import (
    CheckFailed,
    DevcadError,
    FileError,
    GeometryError,
    JobError,
    LimitError,
)

if TYPE_CHECKING:
    from devcad.checks import Check as Check
    from devcad.export import Options as Options
    from devcad.interop import unroll as unroll
    from devcad.job.load import Job as Job
    from devcad.job.load import load as load
    from devcad.part import Panel as Panel
    from devcad.part import Part as Part

__version__ = "0.1.0"

__all__ = [
    "Check",
    "CheckFailed",
    "DevcadError",
    "FileError",
    "GeometryError",
    "Job",
    "JobError",
    "LimitError",
    "Options",
    "Panel",
    "Part",
    "build",
    "export",
    "load",
    "unroll",
]

_LATER = {
    "Check": "devcad.checks",
    "Job": "devcad.job.load",
    "Options": "devcad.export",
    "Panel": "devcad.part",
    "Part": "devcad.part",
    "load": "devcad.job.load",
    "unroll": "devcad.interop",
}


def build(job: Job | str | Path, *, pipeline: str | None = None, allow: Iterable[str] = ()) -> Part:
    """The part that a job, or a job file, describes, with every check it passed.

    ``pipeline`` names a recipe, ``allow`` the checks that may fail.

    Raises:
        DevcadError: one of its classes; the message says place, value, limit and remedy.
    """
    from devcad.pipeline import build

    return build(job, pipeline=pipeline, allow=allow)


def export(
    part: Part,
    out: str | Path,
    *,
    formats: Sequence[str] = ("step", "stl", "glb", "dxf", "svg"),
    options: Options | None = None,
    allow: Iterable[str] = (),
) -> dict[str, Any]:
    """Write the folder OUT/<part> with the given formats and report.json; returns the report.

    Raises:
        DevcadError: one of its classes; then OUT/<part> is as it was.
    """
    from devcad.pipeline import export

    return export(part, out, formats=formats, options=options, allow=allow)


def __getattr__(name: str) -> Any:
    """The names that need a large library, loaded when they are used."""
    if name == "interop":
        return import_module("devcad.interop")
    if name not in _LATER:
        raise AttributeError(f"module 'devcad' has no attribute '{name}'")
    return getattr(import_module(_LATER[name]), name)
