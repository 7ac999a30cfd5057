"""Whether a receiver of drawings accepts a DXF: the file is read again, by whomever it was
written, and held against a profile."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from devcad.checks import Check
from devcad.export.dxfshapes import Shape, contour_loops, shape
from devcad.export.profile import CONTINUOUS, INNER, OUTER, Profile, profile
from devcad.flatten.loops import Loop
from devcad.flatten.tangle import Segments, crossings, depths, polygon, shared_runs
from devcad.geometry.taylor import Array
from devcad.libraries import load_ezdxf, silent
from devcad.part import Panel

VERSIONS = {"AC1009": "R12", "AC1015": "R2000", "AC1024": "R2010"}
MILLIMETRES, METRIC = 4, 1  # $INSUNITS, $MEASUREMENT
UNIT_IN_NAME = re.compile(r"(?<![A-Za-z])mm(?![A-Za-z])", re.IGNORECASE)
NEAR, NARROW = 1e-3, 1e-5
"""mm, and of a drawing's size where that is less: segments as near lie on each other."""
OVERLAP = 10.0
"""Times as wide an overlap is where contours cross. At a tip whose sides run into each other
fitted arcs cross by less, which the kerf of any cutter takes away."""
SMALL = 1e-4
"""Of a drawing's size: a part of a millimetre has shorter segments than a cutter likes."""
LEANING = 1e-9
"""Sine of the angle by which an entity's plane may lean."""
WORDS = ("TEXT", "MTEXT", "ATTRIB", "ATTDEF")
MOST = 8
"""Faults that are told of one kind."""
Place = tuple[float, float]


def check_profile(path: Path, name: str = "generic", *, several: bool = False) -> list[str]:
    """What is wrong with a drawing for the receiver of that profile, nothing where it is accepted:
    unit, version, layers, colours, linetypes and kinds of entities; words and open, doubled,
    overlapping, crossing or misplaced contours on the layers of cuts, and too short segments.

    ``several`` parts in one drawing are a fault unless allowed (a nested sheet).

    What cannot be read is a fault too.

    Raises:
        JobError: no such profile.
    """
    wanted = profile(name)
    ezdxf = load_ezdxf()
    try:
        with silent("ezdxf"):
            document = ezdxf.readfile(str(path))
            errors = [error.message for error in document.audit().errors]
    except Exception as error:  # a torn file ends the parser anywhere, also by StopIteration
        return [f"not readable: {str(error) or type(error).__name__}"]
    return [*errors, *_faults(document, path, wanted, several=several)]


def profile_check(
    document: Any, path: Path, panel: Panel, wanted: Profile, left_out: Sequence[str]
) -> tuple[Check, str]:
    """The check ``dxf-profile`` of a panel's file as it was read, its value the number of faults,
    and in words who accepts it, or what is wrong."""
    faults = _faults(document, path, wanted, several=False)
    words = f"accepted by profile {wanted.name}"
    if left_out:
        words += f", left out: {', '.join(left_out)}"
    if faults:
        words = f"not accepted by profile {wanted.name}: {'; '.join(faults)}"
    check = Check(
        "dxf-profile",
        panel.name,
        float(len(faults)),
        0.0,
        "",
        not faults,
        says=words,
        remedy="mend the pattern where it is said (a smaller tolerance draws tips more closely), "
        "or write for another dxf.profile",
    )
    return check, words


def _faults(document: Any, path: Path, wanted: Profile, *, several: bool) -> list[str]:
    """What is wrong with a drawing as it was read."""
    faults = list(_header(document, path, wanted))
    if wanted.blocks:
        spaces, wrong = _pieces(document, path, wanted)
        faults += wrong
    else:
        spaces = [("", document.modelspace())]
    for block, space in spaces:
        about = f"block {block}: " if block else ""
        found = [*_entities(document, space, wanted), *_cuts(space, wanted, several=several)]
        faults += [about + fault for fault in found]
    return faults


# --- the file ------------------------------------------------------------------------------


def _header(document: Any, path: Path, wanted: Profile) -> Iterator[str]:
    """What is wrong with version and unit."""
    version = VERSIONS.get(document.dxfversion)
    if version is None:
        yield f"version {document.dxfversion} is none of {', '.join(VERSIONS.values())}"
    unit = document.header.get("$INSUNITS")
    if version == "R12":
        if unit not in (None, 0, MILLIMETRES):
            yield f"the unit is {unit}, not {MILLIMETRES} (mm)"
        elif not UNIT_IN_NAME.search(path.stem):
            yield "R12 has no unit, and the file's name does not tell mm"
        return
    if unit != MILLIMETRES:
        yield f"the unit is {unit or 0}, not {MILLIMETRES} (mm)"
    if document.header.get("$MEASUREMENT") != METRIC:
        yield "the measurement is not metric"


def _pieces(document: Any, path: Path, wanted: Profile) -> tuple[list[tuple[str, Any]], list[str]]:
    """The blocks that are placed, and what is wrong with how they are placed and described."""
    faults, spaces = [], []
    if not path.read_bytes().isascii():
        faults.append("there is other text than 7-bit ASCII")
    words = []
    for entity in document.modelspace():
        kind = entity.dxftype()
        if kind == "INSERT":
            spaces.append((entity.dxf.name, document.blocks.get(entity.dxf.name)))
            placed = [entity.dxf.get(f"{a}scale", 1.0) for a in "xyz"] + [
                entity.dxf.get("rotation", 0.0)
            ]
            if placed != [1.0, 1.0, 1.0, 0.0]:
                faults.append(f"block {entity.dxf.name} is scaled or turned")
        elif kind == "TEXT":
            words.append(entity.dxf.text.upper())
        else:
            faults.append(f"a {kind} outside the blocks")
    if "UNITS: METRIC" not in words:
        faults.append("the words UNITS: METRIC are missing")
    if not any(line.startswith("STYLE NAME:") for line in words):
        faults.append("the words STYLE NAME: are missing")
    if not spaces:
        faults.append("no block is placed")
    for name, block in spaces:
        named = [
            e
            for e in block or ()
            if e.dxftype() == "TEXT" and e.dxf.text.upper().startswith("PIECE NAME:")
        ]
        if len(named) != 1:
            faults.append(f"block {name}: the words PIECE NAME: are there {len(named)} times")
    return [(name, block) for name, block in spaces if block is not None], faults


# --- its entities --------------------------------------------------------------------------


def _entities(document: Any, space: Any, wanted: Profile) -> Iterator[str]:
    """What is wrong with layers, kinds, colours, linetypes and sides."""
    layers = wanted.layers
    seen: dict[str, int] = {}
    for entity in space:
        for fault in _entity(document, entity, wanted, layers):
            seen[fault] = seen.get(fault, 0) + 1
    for fault, times in seen.items():
        yield fault if times == 1 else f"{fault} ({times} times)"


def _entity(document: Any, entity: Any, wanted: Profile, layers: Any) -> Iterator[str]:
    kind, layer = entity.dxftype(), entity.dxf.layer
    if layer not in layers:
        yield f"a {kind} on layer {layer}, which the profile does not have"
        return
    if kind in WORDS:
        if layer not in wanted.text:
            yield f"text on layer {layer}"
        elif kind not in wanted.kinds:
            yield f"a {kind} on layer {layer}"
        return
    if kind not in wanted.kinds:
        yield f"a {kind} on layer {layer}"
    table = document.layers.get(layer) if layer in document.layers else None
    colour = entity.dxf.color
    if colour == 256 and table is not None:
        colour = table.dxf.color
    if colour not in {role.colour for role in layers[layer]}:
        yield f"a {kind} on layer {layer} has colour {colour}"
    linetype = str(entity.dxf.linetype)
    if linetype.upper() == "BYLAYER":
        linetype = CONTINUOUS if table is None else str(table.dxf.linetype)
    if linetype.upper() not in {role.linetype.upper() for role in layers[layer]}:
        yield f"a {kind} on layer {layer} has linetype {linetype}"
    if _leans(entity):
        yield f"a {kind} on layer {layer} is not drawn from above"


def _leans(entity: Any) -> bool:
    """Whether an entity's own axes are not the drawing's: mirrored or tilted."""
    x, y, z = entity.dxf.get("extrusion", (0.0, 0.0, 1.0))
    return bool(np.hypot(x, y) > LEANING or z <= 0.0)


# --- its cuts ------------------------------------------------------------------------------


def _cuts(space: Any, wanted: Profile, *, several: bool) -> Iterator[str]:
    """What is wrong with the contours."""
    layers = wanted.cut_layers
    entities = [e for e in space if e.dxf.layer in layers and e.dxftype() not in WORDS]
    drawn = [(entity, _shape(entity)) for entity in entities]
    odd = sorted({entity.dxftype() for entity, found in drawn if found is None})
    if odd:
        yield f"{', '.join(odd)} on a layer of cuts: no line, or damaged"
    shapes = [found for _, found in drawn if found is not None]
    points = np.concatenate([np.zeros((0, 2)), *(s.path.points for s in shapes)])
    size = float(np.hypot(*np.ptp(points, axis=0))) if len(points) else 0.0
    if size == 0.0:
        yield f"nothing is cut: no contour on {', '.join(layers)}"
        return
    yield from _contours(shapes, wanted, size, several=several)


def _shape(entity: Any) -> Shape | None:
    """What an entity draws, None for what is no line or has numbers that are none."""
    try:
        found = shape(entity)
    except Exception:  # a damaged entity ends the library anywhere
        return None
    if found is None or not np.isfinite(found.path.points).all():
        return None
    return found if np.isfinite(found.path.bulges).all() else None


def _contours(shapes: list[Shape], wanted: Profile, size: float, *, several: bool) -> Iterator[str]:
    width = min(NEAR, NARROW * size)
    yield from _short(shapes, min(wanted.shortest, SMALL * size))
    contours, loose = contour_loops(shapes, size)
    yield from _told([f"an open contour ends at {_at(place)}" for place in loose])
    yield from _unmarked(shapes, contours)
    runs = _runs(shapes, contours, wanted, width)
    yield from _told(runs)
    loops = [(shapes[k[0]].entity.dxf.layer, loop) for k, loop in contours]
    polygons = [polygon(loop, width) for _, loop in loops]
    crossed = _crossings(loops, polygons, OVERLAP * width)
    yield from _told(crossed)
    if not runs and not crossed:  # else what lies in what says nothing
        yield from _told(list(_nesting(loops, polygons, wanted, several=several)))


def _told(faults: list[str]) -> list[str]:
    """The first few of many faults of one kind, and how many more there are."""
    if len(faults) <= MOST:
        return faults
    return [*faults[:MOST], f"and {len(faults) - MOST} more like the last"]


def _at(place: Sequence[float]) -> str:
    return f"({place[0]:.6g}, {place[1]:.6g})"


def _short(shapes: list[Shape], limit: float) -> Iterator[str]:
    lengths = [float(s.lengths.min()) for s in shapes]
    k = int(np.argmin(lengths))
    if lengths[k] < limit * (1.0 - 1e-6):
        entity, place = shapes[k].entity, shapes[k].path.points[int(np.argmin(shapes[k].lengths))]
        yield (
            f"a segment of {lengths[k]:.3g} mm at {_at(place)} in a {entity.dxftype()} on layer "
            f"{entity.dxf.layer}, the shortest is {limit:.3g} mm"
        )


def _unmarked(shapes: list[Shape], contours: list[tuple[list[int], Loop]]) -> Iterator[str]:
    for numbers, loop in contours:
        one = shapes[numbers[0]]
        if len(numbers) == 1 and not one.closed and one.entity.dxftype().endswith("POLYLINE"):
            yield f"a contour at {_at(loop.points[0])} is not marked as closed"


def _runs(
    shapes: list[Shape],
    contours: list[tuple[list[int], Loop]],
    wanted: Profile,
    near: float,
) -> list[str]:
    """Lines that are drawn twice or lie on one another."""
    paths = [s.path for s in shapes]
    number = np.arange(len(paths))
    for numbers, _ in contours:
        number[numbers] = numbers[0]
    segments = Segments(
        np.concatenate([p.points[:-1] for p in paths]),
        np.concatenate([p.points[1:] for p in paths]),
        np.concatenate([p.bulges for p in paths]),
        *(np.repeat(x, [len(p.bulges) for p in paths]) for x in (np.arange(len(paths)), number)),
    )
    out = []
    for run in shared_runs(segments, near, max(wanted.shortest, 10.0 * near)):
        layer = shapes[run.one].entity.dxf.layer
        if run.one == run.other:
            out.append(f"a contour on layer {layer} runs back on itself at {_at(run.place)}")
        elif run.whole:
            out.append(f"a line on layer {layer} is drawn twice at {_at(run.place)}")
        else:
            out.append(f"two lines on layer {layer} run on each other at {_at(run.place)}")
    return out


def _crossings(drawn: list[tuple[str, Loop]], polygons: list[Array], width: float) -> list[str]:
    """Contours that cross themselves or each other."""
    return [
        f"a contour on layer {drawn[i][0]} crosses itself near {_at(place)}"
        if i == j
        else f"contours on layers {drawn[i][0]} and {drawn[j][0]} cross near {_at(place)}"
        for i, j, place in crossings(polygons, width)
    ]


def _nesting(
    drawn: list[tuple[str, Loop]], polygons: list[Array], wanted: Profile, *, several: bool
) -> Iterator[str]:
    """Contours that lie in a hole or in another part, and holes of nothing."""
    outer, inner = wanted.roles[OUTER].layer, wanted.roles[INNER].layer
    parts = 0
    for (layer, loop), around in zip(drawn, depths(polygons), strict=True):
        parts += around == 0 and layer == outer
        if around > 1 or (around == 1 and layer == outer != inner):
            yield f"a contour on layer {layer} at {_at(loop.points[0])} lies where nothing is left"
        elif around == 0 and layer != outer:
            yield f"a hole at {_at(loop.points[0])} lies outside the outer contour"
    if parts > 1 and not several:
        yield f"{parts} parts in one drawing"
    if not parts:
        yield f"no outer contour on layer {outer}"
