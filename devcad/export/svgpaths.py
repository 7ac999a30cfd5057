"""Path data of SVG: straight lines and circular arcs, absolute, in a drawing whose y points down.

The drawing's (0, 0) is the pattern point ``origin``, and y is flipped: x = X - X0, y = Y0 - Y.
"""

from __future__ import annotations

import numpy as np

from devcad.flatten import loops
from devcad.flatten.loops import Loop, Path
from devcad.geometry.taylor import Array

NAMESPACE = "http://www.w3.org/2000/svg"
STRAIGHT = 2e-10  # mm, twice the rise of an arc that no digit of the file can tell from its chord
QUARTER = 0.5 * np.pi  # rad; an SVG arc is centred by its radius, ill-conditioned near a half turn


def open_path(path: Path, origin: Array) -> str:
    """The data of an open path: M, then L or A for every segment."""
    return " ".join(_run(path.points, path.bulges, origin))


def closed_path(loop: Loop, origin: Array) -> str:
    """The data of a contour: M, then L or A for every segment, Z."""
    around = np.concatenate([loop.points, loop.points[:1]])
    return " ".join([*_run(around, loop.bulges, origin), "Z"])


def straight_path(start: Array, end: Array, origin: Array) -> str:
    """The data of a straight line."""
    return f"M{_point(start, origin)} L{_point(end, origin)}"


def _run(points: Array, bulges: Array, origin: Array) -> list[str]:
    out = [f"M{_point(points[0], origin)}"]
    for start, end, bulge in zip(points[:-1], points[1:], bulges.tolist(), strict=True):
        if abs(bulge) * float(np.hypot(*(end - start))) <= STRAIGHT:
            out.append(f"L{_point(end, origin)}")
            continue
        half = 2.0 * np.arctan(bulge)
        parts = max(1, int(np.ceil(2.0 * abs(half) / QUARTER - 1e-9)))
        inner, part_bulge = loops.split(start, bulge, end, parts)
        stops = np.concatenate([start[None], inner, end[None]])
        sine = abs(np.sin(2.0 * np.arctan(part_bulge)))
        radius = float(np.hypot(*(stops[1] - stops[0])) / (2.0 * sine))
        flag = int(bulge < 0.0)  # y points down: counterclockwise is the negative sense
        out += [f"A{radius!r} {radius!r} 0 0 {flag} {_point(p, origin)}" for p in stops[1:]]
    return out


def _point(point: Array, origin: Array) -> str:
    """A pattern point in the drawing's coordinates."""
    return f"{number(point[0] - origin[0])} {number(origin[1] - point[1])}"


def number(x: float) -> str:
    """mm to 1e-10, without an exponent (which some readers do not know)."""
    text = f"{x:.10f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def read_closed(data: str, origin: tuple[float, float], *, exact: bool) -> Loop:
    """The contour that path data describe, back in pattern coordinates.

    Raises:
        ValueError, IndexError: the data are not those of a contour.
    """
    if data.split()[-1] != "Z":
        raise ValueError("a contour is open")
    points, bulges = _read(data, origin)
    if np.any(points[-1] != points[0]):
        raise ValueError("a contour does not end where it starts")
    return Loop(points[:-1], bulges, exact)


def read_open(data: str, origin: tuple[float, float]) -> Path:
    """The open path that path data describe, back in pattern coordinates.

    Raises:
        ValueError, IndexError: the data are not those of an open path.
    """
    if data.split()[-1] == "Z":
        raise ValueError("a drawing is closed")
    points, bulges = _read(data, origin)
    return Path(points, bulges, False, 0.0)


def _read(data: str, origin: tuple[float, float]) -> tuple[Array, Array]:
    """Points (k + 1, 2) in pattern coordinates and bulges (k,)."""
    words = data.removesuffix("Z").split()
    points, bulges = [[float(words[0][1:]), float(words[1])]], []
    k = 2
    while k < len(words):
        step = 7 if words[k][0] == "A" else 2
        end = [float(words[k + step - 2].lstrip("L")), float(words[k + step - 1])]
        bulges.append(0.0)
        if step == 7:
            chord = np.hypot(end[0] - points[-1][0], end[1] - points[-1][1])
            half = np.arcsin(min(1.0, chord / (2.0 * float(words[k][1:]))))
            bulges[-1] = float(np.tan(0.5 * half)) * (1.0 if words[k + 4] == "0" else -1.0)
        points.append(end)
        k += step
    xy = np.array(points)
    return np.stack([origin[0] + xy[:, 0], origin[1] - xy[:, 1]], axis=1), np.array(bulges)
