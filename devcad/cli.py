"""The command line: arguments, exit codes, printing. No geometry.

Only typer and the error tree are imported here; each command loads what it needs, so that help
and usage errors answer at once.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from devcad import __version__, clibatch, console, words
from devcad.arguments import Allow, AsJson, Jobs, Out, Pipeline
from devcad.errors import DevcadError, JobError
from devcad.interrupts import Interrupts
from devcad.outcomes import work_through, work_together

if TYPE_CHECKING:
    from devcad.batch.nest import Lot
    from devcad.geometry.analysis.analysis import Analysis
    from devcad.job.load import Job
    from devcad.pipeline import Progress

LISTED = ("surfaces", "curves", "formats", "pipelines", "materials")
INTERRUPTED = 130  # 128 + SIGINT, as shells have it

app = typer.Typer(
    name="devcad",
    help="From a job file that describes a developable surface to STEP, STL, glTF, DXF and SVG.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="""\b
Examples:
  devcad new frustum > lamp.toml
  devcad check lamp.toml
  devcad export lamp.toml
  devcad export *.toml --pipeline sheet-metal -o parts
  devcad analyze curve.toml
\b
Exit codes: 0 done, 2 job file or usage, 3 geometry or a failed check,
4 limits, 5 files, 70 a bug of ours.""",
)


@app.callback(invoke_without_command=True)
def _devcad(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        console.say(f"devcad {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        raise JobError("there is no command", remedy="devcad --help names them")


@app.command(
    epilog="""\b
Examples:
  devcad export samples/lampshade.toml
  devcad export samples/hopper.toml --to step,dxf -o parts
  devcad export *.toml --pipeline sheet-metal --json"""
)
def export(
    context: typer.Context,
    jobs: Jobs,
    pipeline: Pipeline = None,
    to: Annotated[
        str | None,
        typer.Option(metavar="FORMATS", help="step,stl,glb,dxf,svg instead of the recipe's."),
    ] = None,
    out: Out = "out",
    allow: Allow = None,
    as_json: AsJson = False,
) -> int:
    """Write OUT/<job>/ with the files of the recipe and report.json."""
    formats, allowed = words.formats(to), words.checks(allow)
    words.recipe(pipeline)

    def work(job: Job, progress: Progress) -> dict[str, Any]:
        from devcad import pipeline as spine

        recipe = spine.plan(job, pipeline=pipeline, formats=formats, allow=allowed)
        part = spine.build(job, pipeline=pipeline, allow=allowed, progress=progress)
        return spine.export(
            part,
            out,
            formats=recipe.formats,
            options=recipe.options,
            allow=recipe.allow,
            progress=progress,
        )

    def lines(report: dict[str, Any]) -> Iterable[str]:
        from devcad.report.text import file_lines

        return file_lines(report, out)

    return work_through(jobs, work, as_json, lines, context.obj)


@app.command(
    epilog="""\b
Examples:
  devcad check samples/lampshade.toml
  devcad check *.toml --json"""
)
def check(
    context: typer.Context,
    jobs: Jobs,
    pipeline: Pipeline = None,
    allow: Allow = None,
    as_json: AsJson = False,
) -> int:
    """Build and check the geometry; write nothing."""
    allowed = words.checks(allow)
    words.recipe(pipeline)

    def work(job: Job, progress: Progress) -> dict[str, Any]:
        from devcad.pipeline import build
        from devcad.report import make_report

        part = build(job, pipeline=pipeline, allow=allowed, progress=progress)
        return make_report(part, checks=part.checks)

    def lines(report: dict[str, Any]) -> Iterable[str]:
        from devcad.report.text import check_lines

        return check_lines(report)

    return work_through(jobs, work, as_json, lines, context.obj)


@app.command()
def view(
    context: typer.Context,
    job: Annotated[str, typer.Argument(metavar="JOB", help="A job file.")],
    pipeline: Pipeline = None,
    allow: Allow = None,
    browser: Annotated[bool, typer.Option(help="Open the page, or only print its path.")] = True,
) -> int:
    """Build a job and open its page: the part, how it folds, its pattern, its checks."""
    allowed = words.checks(allow)
    words.recipe(pipeline)

    def work(job: Job, progress: Progress) -> dict[str, Any]:
        from devcad.showing import show

        return {"page": show(job, progress, pipeline=pipeline, allow=allowed, browser=browser)}

    return work_through([job], work, False, lambda told: [told["page"]], context.obj)


@app.command(
    epilog="""\b
Examples:
  devcad nest samples/lampshade.toml -o nested
  devcad nest *.toml --sheet 2000x1000 --gap 5 -o nested"""
)
def nest(
    context: typer.Context,
    jobs: Jobs,
    pipeline: Pipeline = None,
    sheet: Annotated[
        str | None, typer.Option(metavar="WxH", help="The sheets' size in mm, such as 1000x500.")
    ] = None,
    gap: Annotated[
        float | None, typer.Option(metavar="MM", help="Between panels and to the sheet's edge.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**31, help="Of the search.")] = 0,
    time: Annotated[int, typer.Option(min=1, metavar="S", help="For each look.")] = 60,
    out: Out = "out",
    allow: Allow = None,
    as_json: AsJson = False,
) -> int:
    """Put all panels on sheets: OUT/sheet-<material>-<thickness>-<n>.dxf and OUT/nest.json."""
    allowed = words.checks(allow)
    words.recipe(pipeline)
    size = words.sheet(sheet, gap)

    def work(job: Job, progress: Progress) -> Lot:
        from devcad.batch.nest import lot

        return lot(job, pipeline=pipeline, allow=allowed, sheet=size, progress=progress)

    def finish(lots: list[Lot], progress: Progress) -> dict[str, Any]:
        from devcad.batch.nest import nest_lots

        return nest_lots(lots, Path(out), seed=seed, seconds=time, progress=progress)

    def lines(told: dict[str, Any]) -> Iterable[str]:
        from devcad.report.text import nest_lines

        return nest_lines(told, out)

    return work_together(jobs, work, finish, as_json, lines, context.obj)


@app.command(
    epilog="""\b
FILE is a job, or a file with a table [curve], such as
  [curve]
  kind = "helix"
  radius = 30
  pitch = 20
  turns = 2
\b
Examples:
  devcad analyze samples/auger-flight.toml
  devcad analyze curve.toml --json -o figures"""
)
def analyze(
    context: typer.Context,
    file: Annotated[str, typer.Argument(metavar="FILE", help="A job, or a file with [curve].")],
    out: Out = "out",
    as_json: Annotated[bool, typer.Option("--json", help="Print one object.")] = False,
) -> int:
    """Tell what a curve is, and its developables; write one figure, OUT/<name>-analysis.svg."""
    try:
        found, figure = _analysis(file, out)
    except Exception as error:
        context.obj.check()
        errors = console.failures(error, file)
        for each in errors:
            console.tell(each)
        if as_json:
            console.say_json(console.entry(errors[0], file))
        return max(each.code for each in errors)
    from devcad.report.analysis import analysis_lines, analysis_report

    if as_json:
        console.say_json(analysis_report(file, found, figure))
    else:
        for line in analysis_lines(found, figure):
            console.say(line)
    return 0


def _analysis(file: str, out: str) -> tuple[list[tuple[str, Analysis]], str]:
    """The curves of a file by their keys, what they are, and the path of the figure."""
    from devcad.export.folder import publish_file
    from devcad.geometry.analysis.analysis import analyze as analysed
    from devcad.job.analysis import load_curves
    from devcad.report.analysis import figure_subtitle
    from devcad.report.figure import figure
    from devcad.report.progress import ProgressLine

    with ProgressLine() as progress:
        curves = load_curves(file)
        found = []
        for named in curves.curves:
            progress.show(f"{curves.name}: {named.name}")
            try:
                found.append((named.name, analysed(named.curve, named.spec)))
            except DevcadError as error:
                raise error.at(place=named.name) from None
        drawn = figure(found[0][1], curves.name, figure_subtitle(*found[0]))
        path = publish_file(Path(out), f"{curves.name}-analysis.svg", drawn.encode("ascii"))
    return found, str(path)


@app.command(
    "list",
    epilog="""\b
Examples:
  devcad list surfaces
  devcad list pipelines""",
)
def list_(
    what: Annotated[str, typer.Argument(metavar="|".join(LISTED), help="Which.")],
) -> int:
    """Name the kinds, formats, recipes and materials there are."""
    if what not in LISTED:
        words.usage(f'there is no list "{what}"', what, LISTED)
    from devcad.report.lists import LISTS

    rows = LISTS[what]()
    width = max((len(name) for name in rows), default=0)
    for name, text in rows.items():
        console.say(f"{name:{width}}  {text}".rstrip())
    return 0


@app.command(
    epilog="""\b
Example:
  devcad schema > devcad.schema.json"""
)
def schema() -> int:
    """Print the JSON Schema of the job file, for editors."""
    from devcad.job.schema import job_schema

    console.say(json.dumps(job_schema(), indent=2))
    return 0


@app.command(
    epilog="""\b
Example:
  devcad new frustum > lamp.toml"""
)
def new(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="A kind of surface.")],
) -> int:
    """Print a commented job file to start from."""
    from devcad.job.templates import template, template_kinds

    kinds = template_kinds()
    if kind not in kinds:
        words.usage(f'there is no surface kind "{kind}"', kind, kinds)
    console.say(template(kind).rstrip("\n"))
    return 0


for _command, _examples in clibatch.COMMANDS.items():
    app.command(epilog=_examples)(_command)


def run(arguments: Sequence[str]) -> int:
    """Run the command line and return its exit code; nothing is raised but SystemExit."""
    console.settle()
    interrupts = Interrupts()
    try:
        with interrupts.watched():
            code = _guarded(arguments, interrupts)
    except (KeyboardInterrupt, SystemExit):
        if not interrupts.code:
            raise
        code = interrupts.code
    return interrupts.code or code


def _guarded(arguments: Sequence[str], interrupts: Interrupts) -> int:
    """The exit code of a command, every error told in its one line."""
    try:
        code = _commanded(arguments, interrupts)
        console.flush()
        return code
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED
    except Exception as error:
        interrupts.check()
        format_message = getattr(error, "format_message", None)  # one of typer's usage errors
        if format_message is not None:
            error = JobError(_one_sentence(format_message()), remedy="see devcad --help")
        failure = console.failure(error)
        return max(failure.code, _told(failure, arguments))


def _told(failure: DevcadError, arguments: Sequence[str]) -> int:
    """Tell a failure of no one job, to programs too; the code of what then goes wrong, or 0."""
    options = arguments[: arguments.index("--")] if "--" in arguments else arguments
    try:
        console.tell(failure)
        if "--json" in options:
            console.say_json([console.entry(failure, None)])
            console.flush()
    except DevcadError as error:
        console.tell(error)
        return error.code
    return 0


def _commanded(arguments: Sequence[str], interrupts: Interrupts) -> int:
    """The exit code of a command that fails by raising."""
    try:
        with warnings.catch_warnings():
            if not console.debugging():  # a failure's stderr holds its error lines and nothing else
                warnings.simplefilter("ignore")
            result = typer.main.get_command(app).main(
                list(arguments), prog_name="devcad", standalone_mode=False, obj=interrupts
            )
        return result if isinstance(result, int) else 0
    except SystemExit as leave:
        if leave.code == 1:  # typer's way to say that the reader of the help has gone
            return 0
        raise


def _one_sentence(message: str) -> str:
    """A usage message as what our error lines begin with."""
    message = message.strip().removesuffix(".")
    return f"usage: {message[:1].lower()}{message[1:]}"
