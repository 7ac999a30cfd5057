"""The command fold: a job's sheet, simulated, and what came of it written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devcad import words
from devcad.errors import GeometryError, JobError
from devcad.interrupts import Interrupts
from devcad.outcomes import work_through

if TYPE_CHECKING:
    from devcad.job.load import Job
    from devcad.part import Panel, Part
    from devcad.shop.materials import Material as Stuff
    from devcad.simulate.material import Material
    from devcad.simulate.net import Net
    from devcad.simulate.outcome import Outcome
    from devcad.simulate.settings import Simulation
    from devcad.simulate.sheet import Shapes

Progress = Callable[[str], None]
THIN = 1e-3
"""Of the pattern's longer side: how thick a sheet is of which the job does not say it."""
NEEDED = {
    "youngs": (
        "Young's modulus",
        'give material = "..." in the job (devcad list materials), or youngs in N/mm2 in '
        "[simulate]",
    ),
    "poisson": ("Poisson's ratio", "give poisson in [simulate], such as 0.3"),
    "thickness": (
        "thickness",
        "give thickness in the job, or in [simulate] where the part is to stay a surface",
    ),
}
"""What a sheet is simulated with: its name, and what helps where it is missing."""


def fold(
    jobs: Sequence[str],
    out: str,
    *,
    pipeline: str | None,
    allow: Sequence[str] | None,
    as_json: bool,
    interrupts: Interrupts,
) -> int:
    """Simulate the sheets of jobs one after the other; the exit code is the largest.

    Raises:
        JobError: an unknown check or recipe.
    """
    allowed = words.checks(allow)
    words.recipe(pipeline)

    def work(job: Job, progress: Progress) -> dict[str, Any]:
        return fold_job(job, out, pipeline=pipeline, allow=allowed, progress=progress)

    def lines(report: dict[str, Any]) -> Iterable[str]:
        from devcad.report.fold import fold_lines

        return fold_lines(report, out)

    return work_through(jobs, work, as_json, lines, interrupts)


def fold_job(
    job: Job,
    out: str | Path,
    *,
    pipeline: str | None = None,
    allow: Iterable[str] = (),
    progress: Progress = lambda _: None,
) -> dict[str, Any]:
    """Simulate the sheet of a job and write OUT/<job>/<job>-fold.* beside what an earlier export
    put there; returns what <job>-fold.json says.

    The files appear together, in place of those of an earlier simulation, or none does.

    Raises:
        JobError: no thickness, no material, nothing that folds or loads the sheet;
        GeometryError, CheckFailed: as ``build``, supports or loads off the sheet, no equilibrium;
        FileError: OUT cannot be written.
    """
    from devcad.pipeline import build
    from devcad.shop.materials import material
    from devcad.simulate.net import net_of
    from devcad.simulate.settings import Simulation
    from devcad.simulate.sheet import simulate

    how = job.simulate or Simulation()
    stuff = material(job.material) if job.material else None
    part = build(job, pipeline=pipeline, allow=allow, progress=progress)
    panel = _panel(part, job, how)
    if not panel.folds and not how.supports:
        raise JobError(
            "nothing folds the sheet and nothing loads it: it has no curved crease",
            place=f"{job.path} > simulate",
            value=panel.kind,
            limit="a curved fold, or supports and loads",
            remedy="give supports and loads in [simulate], or take kind = curved-fold",
        )
    sheet, nominal = _sheet(job, how, stuff, panel)
    progress(f"{job.name}: simulation")
    net = net_of(panel, how)
    shapes = _shapes(panel, net, job.bend) if panel.folds else None
    outcome = simulate(
        net,
        how,
        sheet,
        formed=not panel.folds,
        density=stuff.density if stuff else None,
        shapes=shapes,
        listener=lambda reached: progress(f"{job.name}: {reached}"),
    )
    progress(f"{job.name}: files")
    notes = [*nominal, *_notes(part, panel, stuff)]
    if panel.folds and shapes is None:
        notes.append(
            "between flat and built no exact shape with fixed rulings exists: steps in "
            "between have no distance from it"
        )
    return _written(part, panel, how, sheet, outcome, Path(out), notes)


def _shapes(panel: Panel, net: Net, bend: float) -> Shapes | None:
    """The exact shapes of the net's nodes between flat and built; None where there are none."""
    from devcad.poses import standing

    blanks = [flank.blank for flank in panel.flanks if flank.blank is not None]
    hangings = [(fold.parent, fold.child, fold.side) for fold in panel.folds]
    try:
        standing(blanks, hangings, 0.5 * bend)
    except GeometryError:
        return None
    return lambda share: net.on(standing(blanks, hangings, share * bend))


def _sheet(
    job: Job, how: Simulation, stuff: Stuff | None, panel: Panel
) -> tuple[Material, tuple[str, ...]]:
    """What the simulated sheet is made of: the keys of [simulate], then the job's material; and a
    note where neither says it and nothing but its creases moves the sheet, whose shape hardly
    asks: then it is a nominal one.

    Raises:
        JobError: a number that neither gives.
    """
    from devcad.simulate.material import Material

    given = {
        "youngs": how.youngs or (stuff.youngs_modulus if stuff else None),
        "poisson": stuff.poisson if how.poisson is None and stuff else how.poisson,
        "thickness": how.thickness or job.thickness or None,
    }
    missing = [key for key, value in given.items() if value is None]
    if missing and (how.loaded or not panel.folds):
        name, remedy = NEEDED[missing[0]]
        raise JobError(
            f"the simulation has no {name} of the sheet",
            place=f"{job.path} > simulate.{missing[0]}",
            value="",
            limit="above 0",
            remedy=remedy,
        )
    if how.weight is not None and stuff is None:
        raise JobError(
            "the sheet's weight is not known without a material",
            place=f"{job.path} > simulate.weight",
            value="",
            limit="a material of the library",
            remedy='give material = "..." in the job; devcad list materials names them',
        )
    left, below, right, above = panel.pattern.bbox
    thin = THIN * max(right - left, above - below)
    nominal = {"youngs": 1.0, "poisson": 0.3, "thickness": thin}
    taken = {key: nominal[key] for key in missing}
    numbers = {key: float(value) for key, value in given.items() if value is not None}
    told = ", ".join(f"{key} = {value:.4g}" for key, value in taken.items())
    notes = (f"nominal, for the job does not say: {told}; forces and energies follow it",)
    return Material(**numbers, **taken), notes if taken else ()


def _panel(part: Part, job: Job, how: Simulation) -> Panel:
    """The panel that is simulated."""
    names = [panel.name for panel in part.panels]
    if how.panel is None and len(names) == 1:
        return part.panels[0]
    if how.panel in names:
        return part.panels[names.index(how.panel)]
    what = "the job has several panels" if how.panel is None else f'no panel "{how.panel}"'
    raise JobError(
        what,
        place=f"{job.path} > simulate.panel",
        value=how.panel or "",
        limit=", ".join(names),
        remedy="name one of them, such as panel = " + f'"{names[0]}"',
    )


def _notes(part: Part, panel: Panel, stuff: Stuff | None) -> list[str]:
    """What the model leaves out, in sentences."""
    out = []
    if len(part.panels) > 1:
        out.append(f"panel {panel.name} is simulated alone, its seams are free")
    if any(flank.cuts for flank in panel.chains):
        out.append("the cutouts are not in the model: the sheet is simulated without holes")
    if panel.chain.closed or panel.chain.closes:
        out.append("the sheet stays open along the cut of its pattern")
    if stuff is not None and stuff.doubt:
        out.append(stuff.doubt)
    return out


def _written(
    part: Part,
    panel: Panel,
    how: Simulation,
    sheet: Material,
    outcome: Outcome,
    out: Path,
    notes: list[str],
) -> dict[str, Any]:
    """Write the files; what their list says."""
    from devcad.export.beside import published_beside
    from devcad.export.foldfiles import write_fold
    from devcad.report import to_bytes
    from devcad.report.fold import fold_report

    listing = f"{part.name}-fold.json"
    with published_beside(out, part.name, listing) as folder:
        files = write_fold(outcome, part.name, folder, part.colour)
        told = fold_report(part, panel, how, sheet, outcome, files=files, notes=notes)
        (folder / listing).write_bytes(to_bytes(told))
    return told
