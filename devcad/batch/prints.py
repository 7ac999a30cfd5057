"""Fingerprints: what a part is made from, as one hash, read without building anything.

Two orders with one fingerprint give equal files, so that what is there need not be made again.
Nothing here loads numpy: ten thousand orders are told apart in a second.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from devcad import __version__
from devcad.batch.orders import Order
from devcad.errors import DevcadError
from devcad.importers.files import decode, inside, read_bytes
from devcad.importers.toml import parse_toml

MAX_JOB_BYTES = 256_000  # as job/load.py has it
MAX_INPUT_BYTES = 64_000_000


@dataclass(frozen=True, slots=True)
class Facts:
    """What a job file says before it is checked: its name, None where it has none, and the files
    that it names."""

    name: str | None
    inputs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Words:
    """What the command line says of every part: formats and pipeline before those of the job, and
    the checks that may fail."""

    pipeline: str | None = None
    formats: tuple[str, ...] = ()
    allow: tuple[str, ...] = ()


@dataclass
class Reader:
    """Reads every job file and every file that one names once."""

    facts: dict[str, Facts] = field(default_factory=dict)
    """By the hash of a job file's bytes; may come from an earlier batch."""
    _files: dict[Path, str] = field(default_factory=dict)
    _jobs: dict[str, str] = field(default_factory=dict)

    def facts_of(self, order: Order) -> Facts:
        """The facts of the order's job file; a file that cannot be read has none."""
        sha = self._job(order.path)
        return self.facts.get(sha, Facts(None, ()))

    def print_of(self, order: Order, words: Words) -> str:
        """The fingerprint of an order, hexadecimal."""
        inputs = {*self.facts_of(order).inputs, *_named(order.changes)}
        folder = Path(order.folder) if order.folder else Path(order.path).parent
        told: list[Any] = [
            __version__,
            _data(),
            os.environ.get("SOURCE_DATE_EPOCH", ""),
            self._job(order.path),
            [(name, self._input(folder, name)) for name in sorted(inputs)],
            sorted(order.changes),
            words.pipeline,
            words.formats or order.formats,
            sorted(words.allow),
        ]
        return hashlib.sha256(json.dumps(told).encode()).hexdigest()

    def _job(self, path: str) -> str:
        """The hash of a job file; its facts are known from then on. "" for none."""
        if path in self._jobs:
            return self._jobs[path]
        try:
            data = read_bytes(Path(path), limit=MAX_JOB_BYTES, place=path)
        except DevcadError:
            sha = ""
        else:
            sha = hashlib.sha256(data).hexdigest()
            if sha not in self.facts:
                self.facts[sha] = _facts(data)
        self._jobs[path] = sha
        return sha

    def _input(self, folder: Path, name: str) -> str:
        """The hash of a file that a job names; "" where it cannot be read, or must not be."""
        try:
            path = inside(folder, name, place="")
            if path not in self._files:
                data = read_bytes(path, limit=MAX_INPUT_BYTES, place=name)
                self._files[path] = hashlib.sha256(data).hexdigest()
            return self._files[path]
        except (DevcadError, OSError):
            return ""


def _facts(data: bytes) -> Facts:
    try:
        tree = parse_toml(decode(data, place=""), place="")
    except DevcadError:
        return Facts(None, ())
    name = tree.get("name")
    return Facts(name if isinstance(name, str) else None, tuple(sorted(set(_files(tree)))))


def _files(node: Any) -> Iterator[str]:
    """The texts under keys named file, wherever they stand."""
    if isinstance(node, dict):
        if isinstance(node.get("file"), str):
            yield node["file"]
        for inner in node.values():
            yield from _files(inner)
    elif isinstance(node, list):
        for inner in node:
            if isinstance(inner, dict | list):
                yield from _files(inner)


def _named(changes: Sequence[tuple[str, str]]) -> list[str]:
    """The files that a list names in place of those in the job file."""
    return [text for key, text in changes if key.split(".")[-1] == "file"]


@cache
def _data() -> str:
    """The hash of the recipes and materials, which a checkout may change within a version."""
    package = Path(__file__).parents[1]
    recipes = package / "_recipes"
    folder = recipes if recipes.is_dir() else package.parent / "pipelines"
    digest = hashlib.sha256()
    for path in [*sorted(folder.glob("*.toml")), package / "shop" / "materials.toml"]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
