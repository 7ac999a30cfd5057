"""STEP text in which equal points are one: a file of holes says most of its points twice."""

from __future__ import annotations

import re

_LEAF = re.compile(
    rb"#(\d+) = ((?:CARTESIAN_POINT|DIRECTION)\('',\([^)]*\)\s*\)"
    rb"|\(\s*GEOMETRIC_REPRESENTATION_CONTEXT\(2\)[^;']*'2D SPACE',''\s*\)\s*\));\n"
)
_SPACE = re.compile(rb"\s+")
_WORD = re.compile(rb"'[^']*'|#(\d+)")
"""A string, in which # is only a letter, or a reference."""


def lean(text: bytes) -> bytes:
    """The text of a STEP file with every point, direction and plane of parameters written once
    and named by all that share it: edges and the walls between them have the same poles. Saves
    two fifths and more."""
    first: dict[bytes, bytes] = {}
    others: dict[bytes, bytes] = {}

    def once(found: re.Match[bytes]) -> bytes:
        number = found[1]
        kept = first.setdefault(_SPACE.sub(b"", found[2]), number)
        if kept is number:
            return found[0]
        others[number] = b"#" + kept
        return b""

    text = _LEAF.sub(once, text)
    return _WORD.sub(lambda m: others.get(m[1], m[0]), text)
