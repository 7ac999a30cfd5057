"""A PDF of ours read back from its bytes alone: pages, their sizes, and what is drawn on them.

It knows what our files contain and no more: a plain cross-reference table, direct lengths,
streams that are deflated or bare, one form. Anything else is a ValueError.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

Operator = tuple[str, list[float]]
"""The name of an operator with the numbers before it."""
Matrix = tuple[float, float, float, float, float, float]

IDENTITY: Matrix = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)
PATHS = frozenset({"m", "l", "c", "h", "S", "re"})
WORDS = re.compile(rb"\((?:\\.|[^\\()])*\)|/[^\s/\[\]()<>]+|[\[\]]|[^\s/\[\]()<>]+", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Drawn:
    """What one layer shows, in order: path operators, each with the matrix to points that holds
    for it; and the matrices under which the form is shown."""

    operators: list[tuple[Operator, Matrix]] = field(default_factory=list)
    forms: list[Matrix] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class ReadPage:
    """A page: width and height in points, and its layers; "" is what lies on none."""

    width: float
    height: float
    layers: dict[str, Drawn]


@dataclass(frozen=True, slots=True)
class ReadFile:
    """The pages of a file, the layers of its form, the names of its optional content groups, and
    whether it asks not to be scaled in print."""

    pages: tuple[ReadPage, ...]
    form: dict[str, Drawn]
    groups: tuple[str, ...]
    unscaled: bool


def read(data: bytes) -> ReadFile:
    """The file that these bytes hold.

    Raises:
        ValueError, KeyError, IndexError, zlib.error: they are torn, or not what we write.
    """
    objects = _objects(data)
    (root,) = re.findall(rb"/Root (\d+) 0 R", data[data.rindex(b"trailer") :])
    catalog = objects[int(root)]
    pages = tuple(_page(objects, k) for k in _kids(objects, _reference(catalog, b"Pages")))
    groups = tuple(
        re.findall(rb"/Name \((\w+)\)", body)[0].decode()
        for body in objects.values()
        if b"/Type /OCG" in body
    )
    forms = [body for body in objects.values() if b"/Subtype /Form" in body]
    form = _layers(_content(forms[0])) if forms else {}
    wish = objects[_reference(catalog, b"ViewerPreferences")]
    return ReadFile(pages, form, groups, b"/PrintScaling /None" in wish)


def _objects(data: bytes) -> dict[int, bytes]:
    """Every object by its number, found by the cross-reference table."""
    if not data.startswith(b"%PDF-1.") or not data.rstrip().endswith(b"%%EOF"):
        raise ValueError("no PDF, or only its beginning")
    start = int(data[data.rindex(b"startxref") + 9 :].split()[0])
    head, *_ = data[start:].split(b"trailer", 1)
    words = head.split()
    if words[0] != b"xref" or int(words[1]) != 0:
        raise ValueError("no cross-reference table where one is announced")
    count, rows = int(words[2]), words[3:]
    out: dict[int, bytes] = {}
    for k in range(1, count):
        at = int(rows[3 * k])
        mark = b"%d 0 obj" % k
        if not data.startswith(mark, at):
            raise ValueError(f"object {k} is not where the table says")
        out[k] = _body(data, at + len(mark))
    return out


def _body(data: bytes, at: int) -> bytes:
    """An object's dictionary and, behind the word stream, the bytes of its stream."""
    end = data.index(b"endobj", at)
    stream = data.find(b"stream\n", at)
    if stream < 0 or stream > end:
        return data[at:end]
    (length,) = re.findall(rb"/Length (\d+)", data[at:stream])
    begin = stream + 7
    if not data.startswith(b"endstream", begin + int(length)):
        raise ValueError("a stream is not as long as it says")
    return data[at : begin + int(length)]


def _reference(body: bytes, key: bytes) -> int:
    """The number of the object that a key of a dictionary points to."""
    return int(re.findall(rb"/" + key + rb" (\d+) 0 R", body)[0])


def _kids(objects: dict[int, bytes], pages: int) -> list[int]:
    """The numbers of the pages in their order."""
    body = objects[pages]
    (listed,) = re.findall(rb"/Kids \[([^\]]*)\]", body)
    (count,) = re.findall(rb"/Count (\d+)", body)
    kids = [int(k) for k in re.findall(rb"(\d+) 0 R", listed)]
    if len(kids) != int(count):
        raise ValueError(f"{len(kids)} pages where {int(count)} are announced")
    return kids


def _page(objects: dict[int, bytes], k: int) -> ReadPage:
    (box,) = re.findall(rb"/MediaBox \[([^\]]*)\]", objects[k])
    left, bottom, right, top = (float(x) for x in box.split())
    layers = _layers(_content(objects[_reference(objects[k], b"Contents")]))
    return ReadPage(right - left, top - bottom, layers)


def _content(body: bytes) -> bytes:
    """The operators in a stream."""
    head, stream = body.split(b"stream\n", 1)
    return zlib.decompress(stream) if b"/FlateDecode" in head else stream


def _operators(content: bytes) -> Iterator[tuple[str, list[float], str]]:
    """Every operator with its numbers and the last name before it."""
    numbers: list[float] = []
    name = ""
    for word in WORDS.findall(content):
        if word[:1] in b"([]":
            continue
        if word[:1] == b"/":
            name = word[1:].decode()
            continue
        try:
            numbers.append(float(word))
        except ValueError:
            yield word.decode(), numbers, name
            numbers, name = [], ""


def _layers(content: bytes) -> dict[str, Drawn]:
    """What is drawn on each layer, under the matrices that hold there."""
    out: dict[str, Drawn] = {}
    matrix, kept = IDENTITY, [IDENTITY]
    layer = ""
    for name, numbers, word in _operators(content):
        if name == "q":
            kept.append(matrix)
        elif name == "Q":
            matrix = kept.pop()
        elif name == "cm":
            a, b, c, d, e, f = numbers
            matrix = _product((a, b, c, d, e, f), matrix)
        elif name == "BDC":
            layer = word
        elif name == "EMC":
            layer = ""
        elif name == "Do":
            out.setdefault(layer, Drawn()).forms.append(matrix)
        elif name in PATHS:
            out.setdefault(layer, Drawn()).operators.append(((name, numbers), matrix))
    if len(kept) != 1:
        raise ValueError("the graphics states do not close")
    return out


def _product(one: Matrix, other: Matrix) -> Matrix:
    """First one, then the other: PDF's row vectors."""
    a, b, c, d, e, f = one
    p, q, r, s, t, u = other
    return (
        a * p + b * r,
        a * q + b * s,
        c * p + d * r,
        c * q + d * s,
        e * p + f * r + t,
        e * q + f * s + u,
    )
