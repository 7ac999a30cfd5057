"""A PDF as its bytes say it, without the reader that ships: objects by regular expressions."""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass

import numpy as np

from devcad.geometry.taylor import Array

POINT = 72.0 / 25.4  # points in a mm


@dataclass(frozen=True)
class Paper:
    """A page: its size in mm, and its operators with every text taken out."""

    width: float
    height: float
    content: str


def streams(data: bytes) -> list[tuple[bytes, str]]:
    """Every stream's dictionary and what it holds."""
    found = re.finditer(rb"obj\s*<<((?:(?!endobj).)*?)>>\s*stream\n", data, re.DOTALL)
    out = []
    for match in found:
        size = int(re.findall(rb"/Length (\d+)", match[1])[0])
        out.append((match[1], zlib.decompress(data[match.end() : match.end() + size]).decode()))
    return out


def pages(data: bytes) -> list[Paper]:
    """The pages, in the order of the file."""
    boxes = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", data)
    content = [text for head, text in streams(data) if b"/Form" not in head]
    sizes = [(float(w) / POINT, float(h) / POINT) for w, h in boxes]
    return [
        Paper(w, h, re.sub(r"\((?:\\.|[^\\()])*\)", "", text))
        for (w, h), text in zip(sizes, content, strict=True)
    ]


def form(data: bytes) -> str:
    """The operators of the one form."""
    (text,) = [text for head, text in streams(data) if b"/Form" in head]
    return text


def layers(operators: str) -> dict[str, str]:
    """The operators on each layer."""
    found = re.findall(r"/OC /(\w+) BDC q\n(.*?)Q EMC", operators, re.DOTALL)
    out: dict[str, str] = {}
    for name, text in found:
        out[name] = out.get(name, "") + text
    return out


def squares(page: Paper) -> list[tuple[float, float]]:
    """Width and height in mm of the rectangles on the layer of the control squares."""
    unit = re.findall(r"^([\d.]+) 0 0 ([\d.]+) 0 0 cm$", page.content, re.MULTILINE)
    (sx, sy), *_ = unit
    found = re.findall(r"([\d.]+) ([\d.]+) re S", layers(page.content)["CONTROL"])
    return [(float(w) * float(sx) / POINT, float(h) * float(sy) / POINT) for w, h in found]


def paths(operators: str, per_curve: int = 200) -> list[Array]:
    """Dense points on every stroked path, straight sides by their ends."""
    out, words = [], []
    points: list[Array] = []
    for word in operators.split():
        if re.fullmatch(r"-?[\d.]+", word):
            words.append(float(word))
            continue
        numbers, words = words, []
        if word == "m":
            points = [np.array([numbers])]
        elif word == "l":
            points.append(np.array([numbers]))
        elif word == "c":
            a = points[-1][-1]
            b, c, d = np.array(numbers).reshape(3, 2)
            s = np.linspace(0.0, 1.0, per_curve)[1:, None]
            r = 1.0 - s
            points.append(r**3 * a + 3 * r * r * s * b + 3 * r * s * s * c + s**3 * d)
        elif word == "h":
            points.append(points[0])
        elif word == "S":
            out.append(np.concatenate(points))
    return out
