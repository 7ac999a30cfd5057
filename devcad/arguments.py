"""Arguments and options that several commands have."""

from __future__ import annotations

from typing import Annotated

import typer

Jobs = Annotated[list[str], typer.Argument(metavar="JOB", help="Job files.")]
Pipeline = Annotated[
    str | None, typer.Option(metavar="NAME", help="Recipe; devcad list pipelines names them.")
]
Allow = Annotated[
    list[str] | None,
    typer.Option(metavar="CHECK", help="Let a failed check pass; the report says so."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one array of reports.")]
Out = Annotated[str, typer.Option("-o", "--out", metavar="OUT", help="Folder.")]
