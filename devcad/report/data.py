"""The numbers of the page: how each panel folds, as tables that its script reads."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.export.folding import pattern_shifts
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, Numbers, turning
from devcad.mesh.lodged import Sheet, edges
from devcad.part import Panel, Part
from devcad.report.pieces import Piece

SHARE = 0.95
"""Of the sheet, that the range of the colours holds: beside an apex curvature has no end."""
AWAY = 1.5
"""Points of the regression curve further from the sheet than this share of it are not shown."""
MOST_SHORT = 2**16
FRACTIONS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])

Table = dict[str, Any]


def part_data(part: Part, pieces: Sequence[Piece | None]) -> Table:
    """What the script of the page needs, as JSON that is the same for the same part; ``pieces`` are
    what of the panels is shown, None where a panel is known by its pattern alone.

    Numbers are little-endian arrays, one after the other in ``data`` (base64), each named with
    its type, its place and its count. Lengths are mm. A panel's ``shift`` is where its pattern
    lies beside the others': the flat state of the page.
    """
    blob = _Blob()
    every = zip(part.panels, pieces, pattern_shifts(part), strict=True)
    panels = [_panel(panel, piece, shift, blob) for panel, piece, shift in every if piece]
    return {
        "colour": [float(f"{x:.4f}") for x in part.colour],
        "curvature": _curvature_range(
            [strip for piece in pieces if piece for strip in piece.strips]
        ),
        "panels": panels,
        "data": base64.b64encode(bytes(blob.data)).decode("ascii"),
    }


class _Blob:
    """Arrays one after the other, each at a multiple of eight bytes."""

    def __init__(self) -> None:
        self.data = bytearray()

    def add(self, values: Any, kind: str) -> list[Any]:
        """Type, offset in bytes and count of an array that is added."""
        array = np.ascontiguousarray(values, kind).ravel()
        self.data += bytes(-len(self.data) % 8)
        place = [kind[1:], len(self.data), array.size]
        self.data += array.tobytes()
        return place


def _panel(panel: Panel, piece: Piece, shift: tuple[float, float], blob: _Blob) -> Table:
    flanks = list(_flanks(panel, piece))
    joined = {key: np.concatenate([flank[key] for flank in flanks]) for key in flanks[0]}
    ends, pattern, beside, creased = (
        np.concatenate(each, axis=-2 if each[0].ndim == 3 else -1)
        for each in zip(*(_rulings(piece, k) for k in range(len(piece.strips))), strict=True)
    )
    points, rulings = len(joined["cell"]), ends.shape[1]
    index, number = _unsigned(points), _unsigned(2 * rulings)
    return {
        "name": panel.name,
        "thickness": panel.thickness,
        "rulings": rulings,
        "flanks": len(flanks),
        "shift": list(shift),
        **(_hinges(piece.strips[0], blob) if piece.fold is None else _scores(piece, blob)),
        **{
            key: blob.add(joined[key], "<f4")
            for key in ("flat", "share", "bending", "height", "radii", "curve")
        },
        "ends": blob.add(ends, "<f4"),
        "pattern": blob.add(pattern, "<f4"),
        **{key: blob.add(joined[key], number) for key in ("body", "cell", "curveBody")},
        "beside": blob.add(beside, number),
        "creased": blob.add(creased, "<u2"),
        **{key: blob.add(joined[key], index) for key in ("triangles", "lines", "border")},
        **_between(piece, blob, number),
    }


def _hinges(strip: Hinged, blob: _Blob) -> Table:
    """How a strip turns about its hinges."""
    pivot = np.append(strip.pivot, 0.0)
    return {
        "bodies": len(strip.angles) + 1,
        "anchor": strip.anchor,
        "turn": turning(strip.built[:, :3]).tolist(),
        "pivot": strip.pivot.tolist(),
        "place": (strip.built[:, :3] @ pivot + strip.built[:, 3]).tolist(),
        "hinges": blob.add(strip.hinges, "<f8"),
        "angles": blob.add(strip.angles, "<f8"),
    }


def _scores(piece: Piece, blob: _Blob) -> Table:
    """How the bodies of a sheet fold along its creases, as creased.py has it; or where they are, if
    they stand still."""
    fold = piece.fold
    assert fold is not None
    bodies = fold.built.shape[0] * fold.built.shape[1]
    told = {
        "bodies": bodies,
        "parents": [score.parent for score in fold.scores],
        "scores": blob.add([score.points for score in fold.scores], "<f8"),
        "sines": blob.add([score.sines for score in fold.scores], "<f4"),
    }
    if not fold.moves:
        return told | {"still": blob.add(fold.built, "<f8")}
    start, pivot = fold.built[0, fold.anchor], fold.scores[0].points[fold.anchor]
    return told | {
        "anchor": fold.anchor,
        "turn": turning(start[:, :3]).tolist(),
        "pivot": pivot.tolist(),
        "place": (start[:, :2] @ pivot + start[:, 3]).tolist(),
        "poses": blob.add(fold.poses, "<f8"),
        "steps": blob.add(fold.steps, "<f4"),
        "along": blob.add([score.along for score in fold.scores], "<f4"),
        "mus": blob.add([score.mus for score in fold.scores], "<f8"),
    }


def _flanks(panel: Panel, piece: Piece) -> Iterator[dict[str, NDArray[Any]]]:
    """Of each flank what is shown of it, row by row, with numbers that count on from the flanks
    before it."""
    points = 0
    for k, (strip, sheet) in enumerate(zip(piece.strips, piece.sheets, strict=True)):
        body, first = piece.bodies(k), k * strip.rulings
        lines, border = edges(strip, sheet)
        bending, height = _bending(strip, sheet)
        flank = panel.chains[k]
        flat = strip.flat if piece.fold is None else strip.pattern
        curve, carried = _regression(flank, strip, flat, piece.beside(k))
        yield {
            "flat": sheet.flat if piece.fold is None else flat.reshape(-1, 2)[sheet.corners[:, 0]],
            "share": sheet.share,
            "bending": bending,
            "height": height,
            "radii": _radii(strip),
            "curve": curve,
            "curveBody": carried,
            "body": body,
            "cell": sheet.cell + first,
            "triangles": sheet.triangles + points,
            "lines": lines + points,
            "border": border + points,
        }
        points += len(sheet.cell)


def _rulings(piece: Piece, k: int) -> tuple[NDArray[Any], ...]:
    """A flank's rulings in the plane that its bodies carry, and in the pattern, (2, r, 2); the
    bodies beside them (2, r), and which are creases (r,)."""
    strip = piece.strips[k]
    ends = strip.flat if piece.fold is None else strip.pattern
    return ends, strip.pattern, piece.beside(k), strip.creased


def _between(piece: Piece, blob: _Blob, number: str) -> Table:
    """Where points lie between rulings of a sheet with creases and holes: three rows of ``ends`` a
    point, and how much each counts."""
    if piece.fold is None or not any((sheet.weights[:, 0] < 1.0).any() for sheet in piece.sheets):
        return {}
    flanks = len(piece.strips)
    rows = []
    for k, (strip, sheet) in enumerate(zip(piece.strips, piece.sheets, strict=True)):
        end, row = np.divmod(sheet.corners, strip.rulings)
        rows.append((end * flanks + k) * strip.rulings + row)
    return {
        "corners": blob.add(np.concatenate(rows), number),
        "weights": blob.add(np.concatenate([sheet.weights for sheet in piece.sheets]), "<f4"),
    }


def _unsigned(count: int) -> str:
    """The shortest type of numbers below a count."""
    return "<u2" if count <= MOST_SHORT else "<u4"


def _bending(strip: Hinged, sheet: Sheet) -> tuple[Array, Array]:
    """c and q + v a at the points of a sheet, both linear along rulings, so that their quotient,
    the curvature, is right between points too. Scaled to heights of 1 at most: a cell's own."""
    n = strip.rulings
    row = np.where(sheet.corners >= n, sheet.corners - n, sheet.corners)
    end = (sheet.corners >= n).astype(int)
    cell = sheet.cell[:, None]
    side = (row > cell).astype(int)
    largest = np.maximum(np.abs(strip.height).max(axis=(0, 1)), 1e-300)
    height = strip.height[side, end, cell] / largest[cell]
    bending = strip.c[side, cell] / largest[cell]
    return (bending * sheet.weights).sum(axis=1), (height * sheet.weights).sum(axis=1)


def _curvatures(strip: Hinged) -> Array:
    """The curvature (k, 2, cells) at shares of the first and the last ruling of every cell."""
    low, high = strip.height[:, 0], strip.height[:, 1]
    height = low + FRACTIONS[:, None, None] * (high - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(strip.c / height, nan=0.0))


def _curvature_range(strips: list[Hinged]) -> float:
    """The curvature in 1/mm at which the colours end, 0 where nothing is bent: more than that has
    only a small share of the sheet, such as what is near an apex."""
    values, shares = [], []
    for strip in strips:
        corner = strip.flat.reshape(-1, 2)[strip.triangles]
        (ax, ay), (bx, by) = (corner[:, 1] - corner[:, 0]).T, (corner[:, 2] - corner[:, 0]).T
        area = np.zeros(strip.rulings - 1)
        np.add.at(area, strip.cell, np.abs(ax * by - ay * bx))
        found = np.abs(_curvatures(strip))
        values.append(found.ravel())
        shares.append(np.broadcast_to(area, found.shape).ravel())
    if not values:
        return 0.0
    every, weight = np.concatenate(values), np.concatenate(shares)
    order = np.argsort(every, kind="stable")
    below = np.cumsum(weight[order])
    return float(every[order][np.searchsorted(below, SHARE * below[-1]).clip(max=len(every) - 1)])


def _radii(strip: Hinged) -> Array:
    """The signed bend radius in mm at both ends of every ruling, (r, 2); 0 where it is flat."""
    with np.errstate(divide="ignore", invalid="ignore"):
        after = strip.height[0] / strip.c[0]
        last = strip.height[1, :, -1:] / strip.c[1, -1:]
    radii = np.concatenate([after, last], axis=1).T
    return np.where(np.abs(radii) < 1e7, radii, 0.0)


def _regression(panel: Panel, strip: Hinged, flat: Array, beside: Numbers) -> tuple[Array, Array]:
    """Pieces of the regression curve in the flat strip, (k, 2, 2), and the bodies that carry their
    ends, (k, 2): where rulings of cones and tangent surfaces, prolonged, become singular. The ends
    of the rulings lie at ``flat`` (2, r, 2), with the bodies ``beside`` (2, r) them."""
    counts = [len(t) - 1 for t in panel.rulings]
    curved = np.repeat([shape.type in ("cone", "tangent") for shape in panel.shapes], counts)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = strip.height[:, 0] / (strip.height[:, 0] - strip.height[:, 1])  # (2, cells)
    share = np.where(np.isfinite(share), share, np.nan)  # where rulings run parallel
    size = float(np.linalg.norm(np.ptp(strip.space.reshape(-1, 3), axis=0)))
    cells = np.arange(strip.rulings - 1)
    points = []
    for side in (0, 1):
        low, high = flat[:, cells + side]
        length = np.hypot(*(high - low).T)
        beyond = np.maximum(share[side] - 1.0, -share[side]) * length
        curved = curved & (beyond <= AWAY * size)
        points.append(low + np.where(curved, share[side], 0.0)[:, None] * (high - low))
    carried = np.stack([beside[1][:-1], beside[0][1:]], axis=1)
    return np.stack(points, axis=1)[curved], carried[curved]
