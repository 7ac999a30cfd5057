"""What a fork server loads before it forks: importing this makes a small part of each kind.

The first part of a process costs three times the next ones: tables are filled, models are built,
libraries read their files. A process forked after that begins where the others are.
"""

from __future__ import annotations

import gc
import os
import tempfile
from contextlib import suppress
from pathlib import Path

RARE = 1_000_000  # allocations between garbage collections, as in __main__.py
JOB = """\
name = "warm"
thickness = 1.0
[surface]
kind = "frustum"
radius = 30
top_radius = 20
height = 20
"""


def warm(formats: list[str]) -> None:
    """Make a part in a folder that is gone afterwards, then freeze what is there: no garbage
    collection of a forked process touches it."""
    from devcad import pipeline
    from devcad.job.load import load

    gc.set_threshold(RARE)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "warm.toml")
        path.write_text(JOB, encoding="ascii")
        job = load(path)
        recipe = pipeline.plan(job, formats=formats)
        part = pipeline.build(job)
        pipeline.export(part, folder, formats=recipe.formats, options=recipe.options)
    gc.collect()
    gc.freeze()


if "DEVCAD_WARM" in os.environ:
    with suppress(Exception):  # a server that is cold serves all the same
        warm([name for name in os.environ["DEVCAD_WARM"].split(",") if name])
