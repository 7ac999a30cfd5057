"""What a job and its recipe say about the shop, as frozen values in mm and radians.

Exporters and the finishing of patterns read these values; the tables they come from stand in
``devcad/job``. A part of a setting that is None was not asked for: nothing is then done.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, get_args

from devcad.shop.materials import Material
from devcad.units import MM_PER_INCH

NeutralSource = Literal["k", "k_din", "table", "standard", "material", "default"]
Standard = Literal["din6935"]
Mode = Literal["rolled", "press-brake"]
Hole = Literal["round", "slit"]
NotchShape = Literal["V", "slit", "T"]
Finish = Literal["raw", "turned", "lap", "tab"]
Corner = Literal["mitre", "square", "round"]
Profile = Literal["generic", "inventor", "sendcutsend", "lightburn", "astm"]
EdgeName = Literal["start", "end", "base", "top"]

EDGES: tuple[EdgeName, ...] = get_args(EdgeName)
"""First and last ruling, from side and to side of a panel."""
MIDDLE = 0.5
"""K of a sheet whose middle keeps its length: the neutral fibre where nothing else is known."""
DEFAULT_CHORD = 0.1
"""mm; how far a press-brake part may lie from the smooth one where nothing is said."""
ALLOWANCES: Mapping[Finish, float] = MappingProxyType(
    {"raw": 0.0, "turned": 10.0, "lap": 7.0, "tab": 8.0}
)
"""mm beyond the seam line, by the finish of the edge, where a job names none. Trade practice
without a source: turned 8 to 12, lapped 6 to 8."""
PAPERS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "A0": (841.0, 1189.0),
        "A1": (594.0, 841.0),
        "A2": (420.0, 594.0),
        "A3": (297.0, 420.0),
        "A4": (210.0, 297.0),
        "A5": (148.0, 210.0),
        "Letter": (8.5 * MM_PER_INCH, 11.0 * MM_PER_INCH),
        "Legal": (8.5 * MM_PER_INCH, 14.0 * MM_PER_INCH),
        "Tabloid": (11.0 * MM_PER_INCH, 17.0 * MM_PER_INCH),
    }
)
"""Width and height in mm, upright; ISO 216 and ANSI sizes."""
ONE_PAGE = "one"
"""The paper that is as large as the pattern."""


@dataclass(frozen=True, slots=True)
class Neutral:
    """The place of the neutral fibre over the thickness, ANSI: 0 inside, 0.5 the middle.

    ``source`` says which key spoke: ``k`` holds its number (already halved for ``k_din``; the
    material's for "material" once :func:`neutral_fibre` has seen it), ``table`` the pairs of
    inside radius over thickness, increasing, and K, linear between and constant outside;
    ``standard`` its name. ``words`` is what the report says of it.
    """

    source: NeutralSource
    k: float | None = None
    table: tuple[tuple[float, float], ...] = ()
    standard: Standard | None = None
    words: str = ""


def neutral_fibre(neutral: Neutral | None, material: Material | None) -> Neutral:
    """The neutral fibre that applies, with its ``words`` and, unless table or standard, its ``k``.

    A recipe without a word about it leaves the middle. One that only opens the table asks for the
    material's K, and for the middle where no material is named.
    """
    if neutral is None or (neutral.source == "material" and material is None):
        return Neutral("default", k=MIDDLE, words="default: the middle surface")
    if neutral.source == "material" and material is not None:
        doubt = "" if material.verified else ", not verified"
        words = f"material {material.id}{doubt}"
        return Neutral("material", k=material.k_neutral, words=words)
    return neutral


@dataclass(frozen=True, slots=True)
class Bends:
    """How the sheet gets its shape.

    At most one of: ``chord``, the largest distance in mm of the facets from the smooth part;
    ``angle``, the most that one bend turns, radians; ``length``, the longest flat between two
    bend lines in mm; ``count``, the number of bend lines. ``inside_radius`` in mm of every
    bend, None where bends are sharp. ``springback`` says whether bends are over-bent.
    """

    mode: Mode = "rolled"
    chord: float | None = None
    angle: float | None = None
    length: float | None = None
    count: int | None = None
    inside_radius: float | None = None
    springback: bool = False


@dataclass(frozen=True, slots=True)
class Stitch:
    """Stitch holes along a seam, mm.

    ``pitch`` is the wish: the holes are spread evenly. ``inset`` is the distance of the holes
    from the edge that is cut, ``diameter`` that of a round hole or the length of a slit.
    """

    pitch: float = 3.85
    inset: float = 3.5
    hole: Hole = "round"
    diameter: float = 1.0


@dataclass(frozen=True, slots=True)
class Notches:
    """Notches at every ``every``-th stitch hole of a seam, ``depth`` mm into the sheet."""

    every: int = 10
    shape: NotchShape = "V"
    depth: float = 2.5


@dataclass(frozen=True, slots=True)
class Sheet:
    """The stock, mm: ``size`` width and height, ``gap`` between parts and to the sheet's edge.

    ``kerf`` is the width that the tool removes: contours move by half of it, outer ones outwards
    and holes inwards; negative the other way; 0 leaves it to the shop.
    """

    size: tuple[float, float] = (2000.0, 1000.0)
    gap: float = 5.0
    kerf: float = 0.0


@dataclass(frozen=True, slots=True)
class Pdf:
    """The pages at true size, mm: ``size`` width and height of a page, None for one page as large
    as the pattern; ``paper`` is its name, "" for a size of the user's own."""

    paper: str = "A4"
    size: tuple[float, float] | None = PAPERS["A4"]
    overlap: float = 10.0


@dataclass(frozen=True, slots=True)
class Limits:
    """What the shop can do; None leaves it to the material, or unchecked.

    All are shares of the thickness except ``strain``: ``min_flange`` from a bend line to the
    edge, ``hole_to_bend`` from a hole's edge to a bend line, ``hole_to_thickness`` the smallest
    hole's width, ``bend_ratio`` the smallest inside radius. ``strain`` is the largest strain
    of the outer fibre, 0.2 for 20 %.
    """

    min_flange: float | None = None
    hole_to_bend: float | None = None
    hole_to_thickness: float | None = None
    bend_ratio: float | None = None
    strain: float | None = None


@dataclass(frozen=True, slots=True)
class Labels:
    """Single-stroke labels on the pattern; ``height`` of a capital letter in mm."""

    height: float = 5.0


@dataclass(frozen=True, slots=True)
class EdgeFinish:
    """What is done with an edge of a panel: ``allowance`` mm beyond the seam line, how it is
    finished, and the corner that it makes with its neighbours."""

    allowance: float
    finish: Finish = "raw"
    corner: Corner = "mitre"


@dataclass(frozen=True, slots=True)
class ShopSettings:
    """All that a recipe says about the shop; the default asks for nothing."""

    neutral: Neutral | None = None
    bends: Bends = Bends()
    stitch: Stitch | None = None
    notches: Notches | None = None
    sheet: Sheet = Sheet()
    pdf: Pdf = Pdf()
    limits: Limits = Limits()
    labels: Labels | None = None
