"""Keys of a job that a list of jobs gives in place of those in the file."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

from devcad.errors import DevcadError, JobError
from devcad.importers.toml import parse_toml
from devcad.job.invalid import below

Change = tuple[str, str]
"""A dotted key of the job, and what it shall be, as text."""

TEXTS = {
    "name",
    "units",
    "reference",
    "material",
    "pipeline",
    "meta.part_number",
    "meta.revision",
    "meta.description",
    "meta.finish",
}
"""Keys that are texts whatever they look like: revision 3, part number 0012."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
LONGEST = 300
"""Digits of a number: longer ones are texts, which no key of a number takes."""


def put(tree: dict[str, Any], changes: Sequence[Change], place: str) -> None:
    """Set the keys in the tree of a job file; tables that are not there yet are made.

    A word of a key names a table, a panel by its ``name``, or a row of an array, from 1. A text
    stays one where the file has one; elsewhere it is read as TOML would read it.

    Raises:
        JobError: a key leads through something that is no table, or to a row that is not there.
    """
    for key, text in changes:
        where = below(place, key)
        *words, last = key.split(".")
        node: Any = tree
        for word in words:
            node = _inner(node, word, where)
        if not isinstance(node, dict):
            raise _nowhere(last, where)
        node[last] = value(text, key, node.get(last), where)


def told(changes: Sequence[Change]) -> bytes:
    """The changes as bytes that differ where they differ, for a hash; none for none."""
    return json.dumps(sorted(changes)).encode() if changes else b""


def value(text: str, key: str, before: Any, place: str) -> Any:
    """What a text says: a number, true or false, an array or a table in brackets, or itself."""
    if key in TEXTS or isinstance(before, str):
        return text
    if _WHOLE.fullmatch(text) and len(text) < LONGEST:
        return int(text)
    if _NUMBER.fullmatch(text) and len(text) < LONGEST:
        return float(text)
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if text.startswith(("[", "{", '"')):
        try:
            return parse_toml(f"x = {text}", place=place)["x"]
        except DevcadError as error:
            raise JobError(
                f"not a value: {error.what}",
                place=place,
                value=text[:60],
                limit="a value as in a job file",
                remedy="write it as in a job file, brackets closed",
            ) from None
    return text


def _inner(node: Any, word: str, place: str) -> Any:
    """What a word of a key leads to."""
    if isinstance(node, dict):
        return node.setdefault(word, {})
    if isinstance(node, list):
        for row in node:
            if isinstance(row, dict) and row.get("name") == word:
                return row
        if _WHOLE.fullmatch(word) and 1 <= int(word) <= len(node):
            return node[int(word) - 1]
    raise _nowhere(word, place)


def _nowhere(word: str, place: str) -> JobError:
    return JobError(
        f'the key leads to no "{word[:60]}" in the job file',
        place=place,
        value=word[:60],
        limit="tables, panels by name, rows by number from 1",
        remedy="see the job file",
    )
