"""The spine: a job becomes a part, a part becomes files in a folder that appears at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from devcad.assemble import assemble
from devcad.checks import FOLLOWS, Check, at_most, require
from devcad.errors import DevcadError, FileError
from devcad.export import DEFAULT_FORMATS, LAST, Options, Written, writer
from devcad.export.folder import PAGE, REPORT, published, unwritable
from devcad.job.load import Job, JobPanel, load
from devcad.job.recipe import Recipe, known_checks, known_formats, resolve
from devcad.making import PanelSpec
from devcad.part import Panel, Part
from devcad.proofs import mesh_volume
from devcad.report import SvgOrigin, make_report, to_bytes
from devcad.shop.fibre import fibre
from devcad.shop.materials import Material, material
from devcad.shop.settings import Limits

if TYPE_CHECKING:
    from devcad.features import Features
    from devcad.finishing import Edges
    from devcad.geometry.constructions.base import BuiltPanel
    from devcad.geometry.linkage import Linkage
    from devcad.geometry.patch import Patch
    from devcad.shop.limits import Bounds

Progress = Callable[[str], None]
"""Told what begins now."""

MESHES = {"stl", "glb", "3mf"}
"""The formats that carry a panel's triangles."""
CUT_FILES = {"dxf", "svg", "pdf"}
"""The formats that a tool with a kerf follows."""
CUTTING = ("gap", "cut", "groove")
"""The keys of a surface that only the assembly can judge; its errors begin with their names."""


def _silent(_: str) -> None:
    """No progress is shown."""


def plan(
    job: Job,
    *,
    pipeline: str | None = None,
    formats: Iterable[str] = (),
    allow: Iterable[str] = (),
) -> Recipe:
    """The recipe that applies to a job: the caller's words, then the job's, then the recipe's. A
    recipe that draws has the motion of a mechanism drawn too.

    Raises:
        JobError: no such recipe, format or check.
    """
    chosen, allowed = known_formats(list(formats)), known_checks(list(allow))
    try:
        recipe = resolve(pipeline or job.pipeline, job.recipe, formats=chosen, allow=allowed)
    except DevcadError as error:
        raise error.at(place="" if pipeline else f"{job.path} > pipeline") from None
    if chosen or "svg" not in recipe.formats or not _moves(job):
        return recipe
    return replace(recipe, formats=tuple(dict.fromkeys([*recipe.formats, "motion"])))


def _moves(job: Job) -> bool:
    """Whether the job has a mechanism whose motion is known."""
    mechanisms = _mechanisms(job)
    if not mechanisms:
        return False
    from devcad.simulate.motion import motion

    with suppress(DevcadError):  # what is wrong with it is told when it is built
        return any(motion(_linkage(panel)).drive is not None for panel in mechanisms)
    return False


def _linkage(panel: JobPanel) -> Linkage:
    """The links of a panel that is a mechanism, in the job's unit."""
    found: Linkage = getattr(panel.surface, "linkage")()  # noqa: B009
    return found


def _mechanisms(job: Job) -> list[JobPanel]:
    """The panels that are mechanisms; partly bent links lie in no tube, and are none."""
    return [p for p in job.panels if hasattr(p.surface, "linkage") and job.bend == 1.0]


def build(
    job: Job | str | Path,
    *,
    pipeline: str | None = None,
    allow: Iterable[str] = (),
    progress: Progress = _silent,
) -> Part:
    """The part that a job, or a job file, describes: surfaces, meshes, patterns and checks.

    ``allow`` names checks that may fail, beside those that the recipe allows.

    Raises:
        JobError, LimitError, FileError: as ``load``; GeometryError: no such developable;
        CheckFailed: a check fails that is not allowed.
    """
    job = job if isinstance(job, Job) else load(job)
    recipe = plan(job, pipeline=pipeline, allow=allow)
    sheet = material(job.material) if job.material else None
    progress(f"{job.name}: geometry")
    try:
        made = [(panel, spec) for panel in job.panels for spec in _specs(panel, job)]
        edges = {spec.name: panel.edges for panel, spec in made}
        part = assemble(
            job.name,
            [spec for _, spec in made],
            thickness=job.thickness,
            reference=job.reference,
            tolerance=job.tolerance,
            bend=job.bend,
            fibre=fibre(recipe.shop.neutral, sheet, job.thickness),
            limits=_bounds(recipe, sheet, job.thickness),
            seams=job.seams,
            allow=recipe.allow,
            inside_radius=recipe.shop.bends.inside_radius,
            bends=recipe.shop.bends if recipe.shop.bends.mode == "press-brake" else None,
        )
        part = _finished(_named(part, job, sheet), job, recipe, edges)
        mechanisms = _mechanisms(job)
        return _linked(part, job, mechanisms, made) if mechanisms else part
    except DevcadError as error:
        raise _placed(error, job) from None


def _linked(
    part: Part,
    job: Job,
    mechanisms: Sequence[JobPanel],
    made: Sequence[tuple[JobPanel, PanelSpec]],
) -> Part:
    """The part with its mechanisms, each knowing its panels."""
    from devcad.mechanisms import linked, standing

    linkages = [
        standing(
            _linkage(panel).scaled(job.mm_per_unit),
            [spec.name for own, spec in made if own is panel],
            panel.place,
            job.thickness,
            job.reference,
        )
        for panel in mechanisms
    ]
    return linked(part, linkages)


def _named(part: Part, job: Job, sheet: Material | None) -> Part:
    """The part with what the job says of it beside its shape."""
    return replace(
        part,
        panels=tuple(_weighed(panel, sheet) for panel in part.panels),
        job_sha256=job.sha256,
        part_number=job.meta.part_number,
        description=job.meta.description,
        colour=sheet.colour if sheet else part.colour,
        material=job.material or "",
        revision=job.meta.revision,
        quantity=job.meta.quantity,
        grain=job.meta.grain,
        finish=job.meta.finish,
    )


def _finished(part: Part, job: Job, recipe: Recipe, edges: Edges) -> Part:
    """The part with what the shop adds to its patterns, if anything is asked for."""
    shop = recipe.shop
    sewn = bool(job.seams) and (shop.stitch is not None or shop.notches is not None)
    if not (sewn or any(edges.values()) or shop.labels is not None or part.grain is not None):
        return part
    from devcad.finishing import finished

    return finished(part, shop, edges, reference=job.reference, allow=recipe.allow)


def export(
    part: Part,
    out: str | Path,
    *,
    formats: Sequence[str] = DEFAULT_FORMATS,
    options: Options | None = None,
    allow: Iterable[str] = (),
    progress: Progress = _silent,
) -> dict[str, Any]:
    """Write OUT/<part>/ with the given formats, report.json and its page; returns the report.

    All files appear together, in place of those of an earlier export, or none does. ``allow`` is
    for the checks on what was written; what the build allowed stays allowed.

    Raises:
        JobError: an unknown format or check; CheckFailed: a check fails that is not allowed;
        FileError: the folder cannot be written.
    """
    chosen = known_formats(list(formats))
    was_allowed = {check.name for check in part.checks if not check.passed}
    if "isometry" in was_allowed:
        was_allowed.update(FOLLOWS["twist"])
    allowed = frozenset(was_allowed.union(known_checks(list(allow))))
    target = Path(out, part.name)
    how = options or Options()
    cut = part
    if how.kerf and CUT_FILES.intersection(chosen):
        from devcad.shop.kerf import kerfed

        cut = kerfed(part, how.kerf)
    with published(Path(out), part.name) as folder:
        written: list[Written] = []
        for name in sorted(chosen, key=LAST.__contains__):
            progress(f"{part.name}: {name}")
            write = writer(name)
            with _naming(target, f"{part.name}.{name}"):
                if name in CUT_FILES:
                    written += kerf_noted(write(cut, folder, how), how.kerf)
                else:
                    written += write(part, folder, how)
        checks = [*part.checks, *(check for file in written for check in file.checks)]
        if MESHES.intersection(chosen):
            solids = (panel for panel in part.panels if panel.mesh.watertight)
            checks += [mesh_volume(panel, part.tolerance) for panel in solids]
        meshes = (_near_enough(file, part) for file in written if file.format in MESHES)
        checks += [check for check in meshes if not check.passed]  # else the surface's own says it
        require(checks, allowed)
        origin = _svg_origin(cut) if "svg" in chosen else None
        report = make_report(part, checks=checks, files=written, svg_origin=origin)
        with _naming(target, REPORT):
            (folder / REPORT).write_bytes(to_bytes(report))
        with _naming(target, PAGE):
            (folder / PAGE).write_bytes(_page(part, report))
    return report


def _page(part: Part, report: dict[str, Any]) -> bytes:
    """The page of what was exported; a check alone does without its modules."""
    from devcad.report.page import job_page

    return job_page(part, report)


def _bounds(recipe: Recipe, sheet: Material | None, thickness: float) -> Bounds | None:
    """The limits of a sheet with thickness, None where neither recipe nor material knows one."""
    if not thickness or (sheet is None and recipe.shop.limits == Limits()):
        return None
    from devcad.shop.limits import bounds

    return bounds(recipe.shop.limits, recipe.shop.bends, sheet, thickness)


def kerf_noted(files: list[Written], kerf: float) -> list[Written]:
    """The files of a cut pattern, each with a word on its kerf where there is one."""
    if kerf == 0.0:
        return files
    words = f"contours moved for a kerf of {kerf:.6g} mm"
    return [
        replace(file, note="; ".join(part for part in (file.note, words) if part)) for file in files
    ]


def _near_enough(file: Written, part: Part) -> Check:
    """That a mesh keeps the tolerance in its file too, whose numbers are single precision."""
    return at_most(
        "mesh-deviation",
        "",
        file.max_deviation,
        part.tolerance,
        "mm",
        says=f"{file.path.name} is {file.max_deviation:.3g} mm off: its numbers have 24 bits",
        remedy="place the part nearer to the origin, or raise the tolerance",
    )


@contextmanager
def _naming(target: Path, file: str) -> Iterator[None]:
    """Tell what cannot be written with its file and the folder where it was to appear."""
    try:
        yield
    except FileError as error:
        error.place = str(target)
        raise
    except DevcadError:
        raise
    except OSError as error:
        raise unwritable(target, error, "" if error.filename else file) from error


def _placed(error: DevcadError, job: Job) -> DevcadError:
    """The error of an assembly, at the key of the surface that it speaks of, else at the job,
    whose path and panel stand once."""
    for known in (f"{job.path} > ", f"panel {error.panel} > "):
        error.what = error.what.replace(known, "")
    if f" > panel {error.panel}" in error.place:
        error.panel = ""
    key, colon, rest = error.what.partition(": ")
    if error.place or not colon or key not in CUTTING:
        return error.at(place=job.path)
    where = job.path
    if not job.single:
        where = f"{job.path} > panel {error.panel or job.panels[0].name}"
        error.panel = ""
    error.what = rest
    return error.at(place=f"{where} > surface.{key}")


def _specs(panel: JobPanel, job: Job) -> list[PanelSpec]:
    """The panels of a surface: one of the job's name for it, or several, numbered from 1."""
    where = f"{job.path} > " if job.single else f"{job.path} > panel {panel.name} > "
    try:
        built = panel.surface.build()
    except DevcadError as error:
        raise error.at(place=f"{where}surface") from None
    several = len(built.panels) > 1
    stem = "" if job.single else f"{panel.name}-"
    return [
        PanelSpec(
            name=f"{stem}{k}" if several else panel.name,
            kind=panel.kind,
            patches=_layered(made, job.thickness / job.mm_per_unit),
            base_closed=made.base_closed,
            drawings=made.drawings,
            figures={
                name: figure.value * job.mm_per_unit**figure.length
                for name, figure in made.figures.items()
            },
            notes=made.notes,
            rail_fit=made.rail_fit,
            mm_per_unit=job.mm_per_unit,
            cut=getattr(panel.surface, "cut", None),
            gap=getattr(panel.surface, "gap", 0.0) * job.mm_per_unit,
            place=panel.place,
            features=_features(panel, made, job.mm_per_unit),
            flanks=made.flanks,
            groove=_groove(panel, job),
        )
        for k, made in enumerate(built.panels, start=1)
    ]


def _layered(made: BuiltPanel, thickness: float) -> tuple[Patch, ...]:
    """The patches where the panel's layer of the sheet lies."""
    away = -made.layer * thickness
    return tuple(patch.parallel(away) for patch in made.patches) if away else made.patches


def _features(panel: JobPanel, made: BuiltPanel, mm_per_unit: float) -> Features:
    """The features of a panel, with the holes that its construction gives it."""
    if not made.holes:
        return panel.features
    from devcad.mechanisms import with_holes

    return with_holes(panel.features, made.holes, mm_per_unit)


def _groove(panel: JobPanel, job: Job) -> float | None:
    """The width of the grooves along a sheet's curved creases, mm, None where none is given."""
    width = getattr(panel.surface, "groove", None)
    return None if width is None else float(width) * job.mm_per_unit


def _weighed(panel: Panel, sheet: Material | None) -> Panel:
    """The panel with its mass among its facts, where the material is known."""
    if sheet is None or not panel.thickness:
        return panel
    mass = sheet.mass(panel.facts["area"], panel.thickness)
    return replace(panel, facts={**panel.facts, "mass_g": mass})


def _svg_origin(part: Part) -> SvgOrigin:
    from devcad.export.svg import svg_origin

    return {panel.name: svg_origin(panel) for panel in part.panels}
