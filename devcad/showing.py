"""The page of a job, built to be looked at and not kept."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path

from devcad.export.folder import PAGE
from devcad.job.load import Job
from devcad.pipeline import Progress, build, export, plan


def show(
    job: Job, progress: Progress, *, pipeline: str | None, allow: Iterable[str], browser: bool
) -> str:
    """The path of the page, in a new temporary folder that stays; a ``browser`` opens it, if the
    system has one. The job's files are not written: the page shows the checks of its geometry.

    Raises:
        as ``build`` and ``export``.
    """
    allowed = list(allow)
    part = build(job, pipeline=pipeline, allow=allowed, progress=progress)
    options = plan(job, pipeline=pipeline, allow=allowed).options
    folder = Path(tempfile.mkdtemp(prefix="devcad-"))
    export(part, folder, formats=(), options=options, allow=allowed, progress=progress)
    page = folder / part.name / PAGE
    if browser:
        import webbrowser

        webbrowser.open(page.as_uri())
    return str(page)
