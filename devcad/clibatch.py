"""The commands batch, watch and fold: arguments and options; what they do stands in batching.py
and folding.py."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from devcad import batching, folding
from devcad.arguments import Allow, AsJson, Jobs, Out, Pipeline

To = Annotated[
    str | None,
    typer.Option(metavar="FORMATS", help="step,stl,glb,dxf,svg instead of the recipe's."),
]
Workers = Annotated[
    int, typer.Option(min=0, max=512, metavar="N", help="Processes; 0: one a processor.")
]
Timeout = Annotated[float, typer.Option(metavar="S", help="Seconds that a part may take.")]
Memory = Annotated[float, typer.Option(metavar="GB", help="Memory that a part may take.")]
Renew = Annotated[
    int, typer.Option(min=1, metavar="N", help="Parts that a process makes before the next one.")
]


def batch(
    context: typer.Context,
    jobs: Annotated[
        list[str], typer.Argument(metavar="LIST|JOB|FOLDER", help="Lists, job files, folders.")
    ],
    pipeline: Pipeline = None,
    to: To = None,
    out: Out = "out",
    allow: Allow = None,
    workers: Workers = 0,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Make the i-th of n shares only.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a dask.distributed cluster.")
    ] = None,
    timeout: Timeout = 600.0,
    memory: Memory = 4.0,
    renew: Renew = 16,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="No summary.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the manifest.")] = False,
) -> int:
    """Make what is missing or changed of many parts; OUT/manifest.json and OUT/cutlist.csv."""
    asked = batching.Asked(pipeline, to, allow, workers, timeout, memory, renew)
    return batching.batch(
        jobs,
        out,
        asked,
        shard=shard,
        scheduler=scheduler,
        quiet=quiet,
        as_json=as_json,
        interrupts=context.obj,
    )


def watch(
    context: typer.Context,
    inbox: Annotated[str, typer.Argument(metavar="IN", help="The folder to look at.")],
    pipeline: Pipeline = None,
    to: To = None,
    out: Out = "out",
    allow: Allow = None,
    workers: Workers = 0,
    timeout: Timeout = 600.0,
    memory: Memory = 4.0,
    renew: Renew = 16,
    every: Annotated[float, typer.Option(metavar="S", help="Seconds between two looks.")] = 1.0,
    once: Annotated[bool, typer.Option("--once", help="Leave when IN is empty.")] = False,
) -> int:
    """Make every job file that appears in IN; it moves to IN/done or IN/failed with <name>.json."""
    asked = batching.Asked(pipeline, to, allow, workers, timeout, memory, renew)
    return batching.watch(inbox, out, asked, every=every, once=once, interrupts=context.obj)


def fold(
    context: typer.Context,
    jobs: Jobs,
    pipeline: Pipeline = None,
    out: Out = "out",
    allow: Allow = None,
    as_json: AsJson = False,
) -> int:
    """Simulate how a sheet folds and bears loads; OUT/<job>/<job>-fold.glb, .csv and .json."""
    return folding.fold(
        jobs, out, pipeline=pipeline, allow=allow, as_json=as_json, interrupts=context.obj
    )


COMMANDS: dict[Callable[..., int], str] = {
    batch: """\b
LIST is a CSV file: columns job, quantity, material, thickness, pipeline,
outputs (formats, semicolons between), revision, due, and keys of the job such
as surface.radius. FOLDER stands for its *.toml files.
\b
Examples:
  devcad batch parts.csv -o parts
  devcad batch jobs/ --to dxf,step -o parts --workers 4
  devcad batch parts.csv --shard 2/8 -o parts""",
    watch: """\b
Examples:
  devcad watch hot -o parts --to dxf
  devcad watch hot -o parts --once""",
    fold: """\b
A curved fold is folded from its flat sheet; then, as any other panel, it is
held and loaded as [simulate] in the job says: steps, supports, loads.
\b
Examples:
  devcad fold samples/folded-annulus.toml
  devcad fold lamp.toml -o simulated --json""",
}
"""The commands, each with its examples."""
