"""The words of the command line, checked before any job is read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NoReturn

from devcad.errors import JobError

SIDES = 2


def formats(text: str | None) -> list[str]:
    """The formats of --to, none where it is not given."""
    from devcad.export import FORMATS

    names = [] if text is None else [name.strip() for name in text.split(",")]
    for name in names:
        if name not in FORMATS:
            usage(f'this version knows no format "{name}"', name, FORMATS, "--to")
    return names


def checks(allow: Sequence[str] | None) -> list[str]:
    """The checks of --allow, given one by one or with commas."""
    from devcad.checks import NAMES

    names = [name.strip() for text in allow or () for name in text.split(",")]
    for name in names:
        if name not in NAMES:
            usage(f'this version knows no check "{name}"', name, NAMES, "--allow")
    return names


def recipe(name: str | None) -> None:
    """Refuse a --pipeline that there is not, before any job is read."""
    if name is None:
        return
    from devcad.job.recipe import recipe_names

    known = recipe_names()
    if name not in known:
        usage(f'there is no pipeline "{name}"', name, known, "--pipeline")


def sheet(text: str | None, gap: float | None) -> dict[str, Any]:
    """What --sheet and --gap say of sheets, in mm, by the names of their keys.

    Raises:
        JobError: no two lengths, or a negative gap.
    """
    out: dict[str, Any] = {}
    if text is not None:
        sides = [_length(side) for side in text.lower().removesuffix("mm").split("x")]
        if len(sides) != SIDES or not all(0.0 < side < float("inf") for side in sides):
            raise JobError(
                f'"{text[:60]}" is no size of a sheet',
                place="--sheet",
                value=text[:60],
                limit="width x height in mm, above 0",
                remedy="such as --sheet 1000x500",
            )
        out["size"] = tuple(sides)
    if gap is not None:
        if not 0.0 <= gap < float("inf"):
            raise JobError(
                f"a gap of {gap:g} mm",
                place="--gap",
                value=str(gap),
                limit="0 mm or more",
                remedy="give the distance between panels in mm",
            )
        out["gap"] = gap
    return out


def _length(text: str) -> float:
    """The number that a word says; NaN where it says none."""
    try:
        return float(text)
    except ValueError:
        return float("nan")


def usage(what: str, word: str, known: Iterable[str], option: str = "") -> NoReturn:
    """The error of a word on the command line that is not among the known ones."""
    from devcad.job.invalid import did_you_mean

    names = list(known)
    limit, remedy = ", ".join(names), did_you_mean(word, names)
    raise JobError(what, place=option, value=word, limit=limit, remedy=remedy)
