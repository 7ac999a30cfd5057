"""The tables of recipes to the frozen settings that they come to, in mm and radians.

Keys of one choice, such as k, k_din, table and standard, replace each other as a whole: a later
source that names one of them silences all of an earlier source.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from devcad.job.shoptables import SHOP, BendsTable, Table
from devcad.shop.settings import (
    DEFAULT_CHORD,
    PAPERS,
    Bends,
    Labels,
    Limits,
    Mode,
    Neutral,
    Notches,
    Pdf,
    Sheet,
    ShopSettings,
    Stitch,
)
from devcad.units import MM_PER_INCH

Keys = dict[str, Any]


def settings(sources: Sequence[Mapping[str, Keys | None]]) -> ShopSettings:
    """The settings of recipes' tables, later sources over earlier ones, key by key.

    A source maps a table's name to the keys that it gives; None or no entry: no such table.
    """
    told = {name: merged(model, [one.get(name) for one in sources]) for name, model in SHOP.items()}
    limits, sheet = told["limits"] or {}, told["sheet"] or {}
    if "size" in sheet:
        sheet = {**sheet, "size": tuple(sheet["size"])}
    return ShopSettings(
        neutral=_neutral(told["neutral"]),
        bends=_bends(told["bends"] or {}),
        stitch=_stitch(told["stitch"]),
        notches=None if told["notches"] is None else Notches(**told["notches"]),
        sheet=Sheet(**sheet),
        pdf=_pdf(told["pdf"] or {}),
        limits=Limits(**limits),
        labels=_labels(told["labels"]),
    )


def merged(model: type[Table], sources: Iterable[Keys | None]) -> Keys | None:
    """The keys of a table, later sources over earlier ones; None where no source has it."""
    out: Keys | None = None
    for keys in sources:
        if keys is None:
            continue
        silenced = {key for choice in model.choices if keys.keys() & set(choice) for key in choice}
        if model is BendsTable and silenced:
            silenced.add("mode")  # who spaces bends means the press brake
        kept = {key: value for key, value in (out or {}).items() if key not in silenced}
        out = kept | keys
    return out


def _neutral(keys: Keys | None) -> Neutral | None:
    """The neutral fibre of the one key that is left."""
    if keys is None:
        return None
    if "k" in keys:
        return Neutral("k", k=keys["k"], words="k")
    if "k_din" in keys:
        return Neutral("k_din", k=0.5 * keys["k_din"], words="k_din")
    if "table" in keys:
        rows = tuple((ratio, k) for ratio, k in keys["table"])
        return Neutral("table", table=rows, words="table")
    if "standard" in keys:
        return Neutral("standard", standard=keys["standard"], words=keys["standard"])
    return Neutral("material")


def _bends(keys: Keys) -> Bends:
    """The bends, with the chord of :data:`DEFAULT_CHORD` where a press brake is told no other."""
    spacing = {key: keys[key] for key in BendsTable.choices[0] if key in keys}
    mode: Mode = keys.get("mode") or ("press-brake" if spacing else "rolled")
    if mode == "rolled":
        spacing = {}
    elif not spacing:
        spacing = {"chord": DEFAULT_CHORD}
    elif "angle" in spacing:
        spacing = {"angle": math.radians(spacing["angle"])}
    return Bends(
        mode=mode,
        inside_radius=keys.get("inside_radius") or None,
        springback=keys.get("springback", False),
        **spacing,
    )


def _stitch(keys: Keys | None) -> Stitch | None:
    """The stitches, their pitch in mm."""
    if keys is None:
        return None
    given = {key: value for key, value in keys.items() if key != "spi"}
    if "spi" in keys:
        given["pitch"] = MM_PER_INCH / keys["spi"]
    return Stitch(**given)


def _pdf(keys: Keys) -> Pdf:
    """The pages, the paper's name as its size."""
    given = dict(keys)
    paper = given.get("paper")
    if isinstance(paper, str):
        given["size"] = PAPERS.get(paper)
    elif paper is not None:
        given |= {"paper": "", "size": tuple(paper)}
    return Pdf(**given)


def _labels(keys: Keys | None) -> Labels | None:
    """The labels, None where they are off."""
    if keys is None or not keys.get("on", True):
        return None
    return Labels(**{key: value for key, value in keys.items() if key != "on"})
