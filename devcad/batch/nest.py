"""Nesting jobs: all their panels on sheets, as drawings to cut and a list of where each lies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from devcad import __version__
from devcad.checks import Check
from devcad.errors import CheckFailed, DevcadError, JobError
from devcad.export import Options, Written
from devcad.export.folder import published_files
from devcad.job.load import Job
from devcad.part import Panel, Part
from devcad.pipeline import Progress, build, kerf_noted, plan
from devcad.report import check_entry, file_entry, plain, to_bytes
from devcad.shop.settings import Sheet

LISTING = "nest.json"
UNKNOWN = "unknown"
"""The material of sheets for jobs that name none."""
SECONDS = 60
"""The most that one look for a denser nest may take."""


def _silent(_: str) -> None:
    """No progress is shown."""


@dataclass(frozen=True, slots=True)
class Lot:
    """A part to be nested ``part.quantity`` times, from the job file at ``path``, on which sheets,
    and how drawings are written."""

    part: Part
    path: str
    sheet: Sheet
    options: Options


@dataclass(frozen=True, slots=True)
class _Piece:
    """A panel of a lot: as it is, and as it is cut (moved for the kerf)."""

    lot: Lot
    panel: Panel
    cut: Panel


def lot(
    job: Job,
    *,
    pipeline: str | None = None,
    allow: Sequence[str] = (),
    sheet: Mapping[str, Any] | None = None,
    progress: Progress = _silent,
) -> Lot:
    """A job built, and the sheets that it wants: its recipe's, with ``sheet`` (keys of a Sheet)
    on top.

    Raises:
        JobError, GeometryError, CheckFailed: as ``build``.
    """
    recipe = plan(job, pipeline=pipeline, allow=allow)
    part = build(job, pipeline=pipeline, allow=allow, progress=progress)
    return Lot(part, job.path, replace(recipe.shop.sheet, **(sheet or {})), recipe.options)


def nest_lots(
    lots: Sequence[Lot],
    out: Path,
    *,
    seed: int = 0,
    seconds: int = SECONDS,
    progress: Progress = _silent,
) -> dict[str, Any]:
    """Write OUT/sheet-<material>-<thickness>-<n>.dxf and OUT/nest.json; returns what the latter
    says, with lengths in mm.

    Panels of one material and thickness share sheets. A placement turns a pattern by
    ``angle_deg`` counterclockwise about its origin and then shifts it by (x, y); the sheet's
    lower left corner is (0, 0). All files appear together, or none does.

    Raises:
        JobError: jobs that share sheets disagree on them; GeometryError: a panel is larger than
        the sheet; LimitError: too many panels; CheckFailed: a drawing does not hold what it
        should, or panels are too near; FileError: OUT cannot be written.
    """
    groups = _grouped(lots)
    with published_files(out, LISTING) as folder:
        made = [
            _group(pieces, name, folder, seed, seconds, progress) for name, pieces in groups.items()
        ]
        rows: dict[str, list[Any]] = {
            key: [row for one in made for row in one[key]]
            for key in ("sheets", "placements", "checks", "files")
        }
        told: dict[str, Any] = plain(
            {
                "devcad": __version__,
                "units": "mm",
                "seed": seed,
                "jobs": [{"job": x.part.name, "job_sha256": x.part.job_sha256} for x in lots],
                **rows,
            }
        )
        (folder / LISTING).write_bytes(to_bytes(told))
    return told


def _grouped(lots: Sequence[Lot]) -> dict[str, list[_Piece]]:
    """The panels by material and thickness, as sheets of them are called."""
    from devcad.shop.kerf import kerfed

    groups: dict[str, list[_Piece]] = {}
    for lot in lots:
        name = f"sheet-{lot.part.material or UNKNOWN}-{lot.part.thickness:.6g}"
        group = groups.setdefault(name, [])
        _refuse_other_sheet(lot, group)
        try:
            cut = kerfed(lot.part, lot.sheet.kerf)
        except DevcadError as error:
            raise error.at(place=lot.path) from None
        group += [_Piece(lot, *pair) for pair in zip(lot.part.panels, cut.panels, strict=True)]
    return groups


def _refuse_other_sheet(lot: Lot, group: list[_Piece]) -> None:
    """JobError where a lot wants another sheet than those that share it, or another drawing."""
    if not group:
        return
    first = group[0].lot
    pairs = {
        "sheet": (lot.sheet, first.sheet),
        "dxf": (_drawn(lot.options), _drawn(first.options)),
    }
    for key, (wanted, other) in pairs.items():
        if wanted != other:
            raise JobError(
                f"{first.path} wants another [recipe.{key}] for the same material and thickness",
                place=f"{lot.path} > recipe.{key}",
                value=str(wanted),
                limit=str(other),
                remedy="give both the same, or nest them one by one; --sheet and --gap go before",
            )


def _drawn(options: Options) -> tuple[object, ...]:
    """What of the options a drawing depends on."""
    return (
        options.dxf_profile,
        options.dxf_version,
        options.dxf_curves,
        options.dxf_bend_ticks,
    )


def _group(
    pieces: Sequence[_Piece],
    name: str,
    folder: Path,
    seed: int,
    seconds: int,
    progress: Progress,
) -> dict[str, list[Any]]:
    """The sheets of one material and thickness: written, and told row by row."""
    from devcad.shop.nesting import nest

    sheet = pieces[0].lot.sheet
    progress(f"{name}: nesting")
    blanks = [_blank(piece, sheet) for piece in pieces]
    found = nest(blanks, sheet, seed=seed, seconds=seconds)
    out: dict[str, list[Any]] = {"sheets": [], "placements": [], "checks": [], "files": []}
    for number in range(found.sheets):
        here = [one for one in found.placed if one.sheet == number]
        stem = f"{name}-{number + 1}"
        progress(f"{stem}: dxf")
        file, checks = _written([(pieces[p.blank], p.x, p.y, p.angle) for p in here], stem, folder)
        area = sum(pieces[p.blank].panel.pattern.area for p in here)
        lot = pieces[0].lot
        out["sheets"].append(
            {
                "sheet": stem,
                "file": file.path.name,
                "material": lot.part.material or UNKNOWN,
                "thickness": lot.part.thickness,
                "size": list(sheet.size),
                "gap": sheet.gap,
                "kerf": sheet.kerf,
                "panels": len(here),
                "utilisation": area / (sheet.size[0] * sheet.size[1]),
            }
        )
        out["placements"] += [
            {
                "sheet": stem,
                "job": pieces[p.blank].lot.part.name,
                "panel": pieces[p.blank].panel.name,
                "copy": p.copy,
                "x": p.x,
                "y": p.y,
                "angle_deg": p.angle,
            }
            for p in here
        ]
        out["checks"] += [check_entry(check) for check in checks]
        out["files"].append(file_entry(file))
    gap = _gap_check(found.clear, sheet)
    if not gap.passed:
        raise gap.failure().at(place=name)
    out["checks"].append(check_entry(gap))
    return out


def _blank(piece: _Piece, sheet: Sheet) -> Any:
    """What of a panel is nested."""
    from devcad.shop.blanks import blank
    from devcad.shop.nesting import room

    lot = piece.lot
    single = len(lot.part.panels) == 1
    return blank(
        lot.path if single else f"{lot.path} > panel {piece.panel.name}",
        piece.cut.pattern.outline,
        quantity=lot.part.quantity,
        grain=lot.part.grain,
        room=room(sheet),
        area=piece.panel.pattern.area,
    )


def _gap_check(clear: float, sheet: Sheet) -> Check:
    from devcad.shop.nesting import SLACK

    return Check(
        "nest-gap",
        "",
        clear,
        sheet.gap,
        "mm",
        clear >= sheet.gap - SLACK,
        says=f"panels are {clear:.6g} mm apart",
        remedy="please report it with the job files",
    )


def _written(
    placed: Sequence[tuple[_Piece, float, float, float]], stem: str, folder: Path
) -> tuple[Written, list[Check]]:
    """One sheet's drawing, and what its read-back proved."""
    import numpy as np

    from devcad.export.dxf import write_sheet
    from devcad.export.dxfcheck import check_profile
    from devcad.export.outline import approximate
    from devcad.export.profile import style
    from devcad.shop.placing import moved_pattern

    panels = []
    for piece, x, y, angle in placed:
        pattern = moved_pattern(piece.cut.pattern, angle, np.array([x, y]))
        panels.append((replace(piece.cut, pattern=pattern), piece.lot.part.tolerance))
    lot = placed[0][0].lot
    how = style(lot.options)
    twisted = any(approximate(piece.lot.part, piece.panel) for piece, *_ in placed)
    path = folder / f"{stem}{'-approximate' if twisted else ''}{how.mark}.dxf"
    found, checks = write_sheet(path, panels, how)
    faults = check_profile(path, how.profile.name, several=True)
    if faults:
        raise CheckFailed(
            f"dxf-profile: {'; '.join(faults)}",
            place=path.name,
            value=float(len(faults)),
            limit=0.0,
            remedy="mend the patterns where it is said, or write for another dxf.profile",
            check="dxf-profile",
        )
    file = Written(path, "dxf", found, checks, f"accepted by profile {how.profile.name}")
    return kerf_noted([file], lot.sheet.kerf)[0], list(checks)
