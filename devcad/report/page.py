"""index.html: the page of a job, one file that needs nothing else and asks nobody.

The part folds in three dimensions beside its pattern; below stand its checks and its files with
their hashes. The policy in its head lets run and style only what was written here, by hash, and
lets nothing be loaded. Everything that a job, a file or a person named is text.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib import resources
from typing import Any

from devcad import __version__
from devcad.part import Part
from devcad.report import sections
from devcad.report.data import part_data
from devcad.report.drawing import drawing, lines_of
from devcad.report.picture import moving_picture, part_picture
from devcad.report.pieces import piece_of

SCRIPTS = ("fold.js", "shape.js", "camera.js", "paint.js", "page.js")
SHADERS = ("surface.vert", "surface.frag", "line.vert", "line.frag")
STYLE = "page.css"
PICTURE = ("<!--picture-->", "<!--/picture-->")
IN_SCRIPT = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}


def job_page(part: Part, report: dict[str, Any]) -> bytes:
    """The page of a part and its report, UTF-8; the same bytes for the same two.

    ``report`` is the tree of report.json: the page shows its checks and files and holds all of it.
    What unrolls are the facets between the certified rulings, exactly; the pattern beside is what
    is cut, which differs from their flat state by less than the mesh's deviation a facet, and by
    the neutral fibre's allowance where there is one.
    """
    pieces = [piece_of(panel) for panel in part.panels]
    lines = lines_of(part)
    pattern, layers = drawing(part, pieces, lines)
    picture = part_picture(part, pieces, lines)
    body = [
        sections.header(part, report),
        '<main><div class="columns">',
        sections.viewer("".join([PICTURE[0], picture, PICTURE[1]]), part, pieces),
        sections.pattern(pattern, layers, len(part.panels) > 1),
        "</div>",
        sections.panels(report),
        sections.folds(part),
        sections.motions(report),
        sections.checks(report),
        sections.files(report),
        "</main>",
        sections.footer(report),
        *_shaders(),
        _data("part", part_data(part, pieces)),
        _data("report", report),
        f"<script>{_script()}</script>",
    ]
    return _document(part.name, body, script=_script())


def pictures(part: Part) -> tuple[str, str]:
    """Two SVG texts: the part beside its patterns, and the part that unrolls and closes again."""
    pieces = [piece_of(panel) for panel in part.panels]
    return part_picture(part, pieces, lines_of(part)), moving_picture(part, pieces)


@dataclass(frozen=True, slots=True)
class Row:
    """A job of a batch: its name, its state ("done", "failed", ...), a word on it, the address of
    its page, and its picture as SVG ("" where there is none), which must be ``picture_in``'s."""

    job: str
    state: str
    message: str = ""
    link: str = ""
    picture: str = ""


def overview_page(title: str, rows: Iterable[Row]) -> bytes:
    """The page of a batch: every job with its state, its picture and a link to its own page."""
    rows = list(rows)
    counts = {state: sum(row.state == state for row in rows) for state in (r.state for r in rows)}
    told = ", ".join(f"{count} {escape(state)}" for state, count in counts.items()) or "no jobs"
    items = "\n".join(
        f'<li class="card" data-state="{escape(row.state)}">{row.picture}'
        f"<div>{_link(row)} <span class="
        f'"{"ok" if row.state == "done" else "failed"}">{escape(row.state)}</span></div>'
        f'<p class="note"><bdi>{escape(row.message)}</bdi></p></li>'
        for row in rows
    )
    body = [
        f"<header><h1><bdi>{escape(title)}</bdi></h1><p>{told}</p></header>",
        f'<main><ul class="jobs">\n{items}\n</ul></main>',
        f"<footer><p>devcad {escape(__version__)}</p></footer>",
    ]
    return _document(title, body)


def picture_in(page: bytes) -> str:
    """The picture of a part out of its page, "" where the page has none: for an overview."""
    text = page.decode("utf-8", "replace")  # a disk may have spoiled it
    start, end = (text.find(mark) for mark in PICTURE)
    return text[start + len(PICTURE[0]) : end] if 0 <= start < end else ""


def _link(row: Row) -> str:
    name = f"<bdi>{escape(row.job)}</bdi>"
    # an address with a scheme could be anything: only files beside the page are linked
    if not row.link or re.match(r"[a-zA-Z][a-zA-Z0-9+.-]*:|//", row.link.strip()):
        return f"<strong>{name}</strong>"
    return f'<a href="{escape(row.link)}">{name}</a>'


def _document(title: str, body: Sequence[str], script: str = "") -> bytes:
    """A whole page whose policy knows the hashes of its one style and of its one script."""
    style = _asset(STYLE)
    policy = "; ".join(
        [
            "default-src 'none'",
            f"script-src {_hash(script)}" if script else "script-src 'none'",
            f"style-src {_hash(style)}",
            "connect-src 'none'",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    lines = [
        "<!DOCTYPE html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="devcad {escape(__version__)}">',
        '<meta name="referrer" content="no-referrer">',
        f"<title>{escape(title)}</title>",
        f"<style>{style}</style>",
        "</head>",
        "<body>",
        *body,
        "</body>",
        "</html>",
        "",
    ]
    return "\n".join(lines).encode("utf-8")


def _hash(text: str) -> str:
    """A source as a policy names it."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@cache
def _asset(name: str) -> str:
    """The text of a file beside this module."""
    folder = resources.files("devcad.report").joinpath("assets")
    return folder.joinpath(name).read_text(encoding="utf-8")


@cache
def _script() -> str:
    """The page's script: its files one after the other, closed in so that no name is global."""
    inner = "\n".join(_asset(name) for name in SCRIPTS)
    return f'(() => {{\n"use strict";\n{inner}}})();\n'


def _data(name: str, tree: Any) -> str:
    """A tree that a script reads: JSON in which nothing can end the element."""
    text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return f'<script type="application/json" id="{name}">{text.translate(IN_SCRIPT)}</script>'


def _shaders() -> list[str]:
    return [f'<script type="text/plain" id="{name}">{_asset(name)}</script>' for name in SHADERS]
