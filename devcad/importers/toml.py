"""TOML text to a plain tree, refused before parsing where it could cost time or memory.

The parser of Python's library is quadratic in the parts of a dotted key and recursive in
brackets: a key of 40 kB of dots took 6.5 s and 1.6 GB.
"""

from __future__ import annotations

import re
import tomllib
from typing import Any

from devcad.errors import JobError, LimitError

MAX_KEY_DOTS = 16  # the deepest key of a job, panel.surface.on.curves, has 3
MAX_DEPTH = 32  # chains of chains of curves reach 8

# Strings and comments; an unclosed one runs to its natural end, so that the scan is linear.
_QUOTED = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    r'|"(?:[^"\\\n]|\\[^\n])*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+",
    re.DOTALL,
)
_NOT_IN_KEY = re.compile(r"""[^\w\-. \t"]+""")
_POSITION = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def parse_toml(text: str, *, place: str) -> dict[str, Any]:
    """The tree of a TOML document: dicts, lists, strings, numbers, booleans, dates.

    Raises:
        JobError at a syntax error, with line and column; LimitError where brackets or dotted
        keys nest deeper than ``MAX_DEPTH`` or ``MAX_KEY_DOTS``.
    """
    _refuse_deep(text, place)
    try:
        tree = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or a number of more than 4300 digits
        raise _syntax_error(str(error), text, place) from None
    _refuse_deep_tree(tree, place)
    return tree


def _refuse_deep(text: str, place: str) -> None:
    """LimitError where the text, strings and comments left out, nests too deep."""
    bare = _QUOTED.sub(lambda match: '""' + "\n" * match.group().count("\n"), text)
    depth = 0
    for number, line in enumerate(bare.split("\n"), start=1):
        for bracket in re.findall(r"[\[\]{}]", line):
            depth += 1 if bracket in "[{" else -1
            if depth > MAX_DEPTH:
                raise _too_deep("brackets nested", MAX_DEPTH, f"{place} > line {number}")
        dots = max(token.count(".") for token in _NOT_IN_KEY.split(line))
        if dots > MAX_KEY_DOTS:
            raise _too_deep(f"a key of {dots} dots", MAX_KEY_DOTS, f"{place} > line {number}")


def _refuse_deep_tree(tree: dict[str, Any], place: str) -> None:
    """LimitError where dotted keys inside brackets together nest too deep."""
    level: list[Any] = [tree]
    for _ in range(MAX_DEPTH):
        level = [child for node in level for child in _children(node)]
        if not level:
            return
    raise _too_deep("tables nested", MAX_DEPTH, place)


def _children(node: Any) -> list[Any]:
    """The tables and arrays directly inside a table or array."""
    values = node.values() if isinstance(node, dict) else node
    return [value for value in values if isinstance(value, dict | list)]


def _too_deep(what: str, limit: int, place: str) -> LimitError:
    return LimitError(
        f"{what}, more than {limit} deep",
        place=place,
        value=what,
        limit=limit,
        remedy="write the tables one below the other",
    )


def _syntax_error(message: str, text: str, place: str) -> JobError:
    """The error of the parser, told with its line and column."""
    found = _POSITION.search(message)
    what = message[: found.start()] if found else message.split(";")[0]
    line, column = (found.group(1), found.group(2)) if found else (None, None)
    if line is None:
        lines = text.split("\n")
        line, column = str(len(lines)), str(len(lines[-1]) + 1)
    return JobError(
        f"not TOML: {what[:1].lower()}{what[1:]}",
        place=f"{place} > line {line}, column {column}",
        value=what,
        limit="TOML 1.0",
        remedy="correct this line or the one before it",
    )
