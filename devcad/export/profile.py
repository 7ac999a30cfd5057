"""DXF profiles: whose layer names, colours and habits a drawing follows, one data file each.

A role is what a curve of the pattern is for: the contours CUT_OUTER, CUT_INNER and STITCH, the
bend lines and rulings, and the names of drawings on the sheet.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any, Literal

from devcad.errors import JobError
from devcad.export import Options

PROFILES = ("generic", "inventor", "sendcutsend", "lightburn", "astm")
VERSIONS = ("R12", "R2000", "R2010")
CURVES = ("arcs", "polyline", "spline")
OUTER, INNER, STITCH = "CUT_OUTER", "CUT_INNER", "STITCH"
BENDS = ("BEND_UP", "BEND_DOWN")
SEW = "SEW"
TURN, CURVE, ANNOTATION = "TURN", "CURVE", "ANNOTATION"
"""Roles of a profile with blocks: corners, other vertices, words."""
ROLES = (
    *(OUTER, INNER, STITCH),
    *BENDS,
    *("RULING", "ENGRAVE", "MARK", "SCORE", "SEW", "GRAIN", "LABEL", "GLUE", "NOTCH_MARK"),
)
"""Every role that a pattern may hold."""
CONTINUOUS, DASHED = "Continuous", "DASHED"


@dataclass(frozen=True, slots=True)
class Role:
    """Where a role is drawn: its layer, its AutoCAD colour index and linetype.

    ``shape`` "point" stands for a curve by one POINT, "line" by one straight LINE. A role that is
    not ``drawn`` has no layer.
    """

    layer: str = ""
    colour: int = 7
    linetype: str = CONTINUOUS
    drawn: bool = True
    shape: Literal["", "point", "line"] = ""


@dataclass(frozen=True, slots=True)
class Profile:
    """What a receiver of drawings wants; the values are those of its file.

    ``kinds`` are the entities it may hold, ``text`` the layers that may hold words, ``chord``
    the most in mm that a polyline may keep from its curve (None: the drawing's own limit).
    ``bend_data`` says whether bend lines carry extended data.
    """

    name: str
    version: str
    curves: str
    allowed_curves: tuple[str, ...]
    kinds: tuple[str, ...]
    text: tuple[str, ...]
    blocks: bool
    bend_ticks: float
    bend_data: bool
    shortest: float
    roles: Mapping[str, Role]
    chord: float | None = None

    @property
    def layers(self) -> dict[str, tuple[Role, ...]]:
        """Every layer with the roles that are drawn on it, in the order of the file."""
        out: dict[str, tuple[Role, ...]] = {}
        for role in self.roles.values():
            if role.drawn:
                out[role.layer] = (*out.get(role.layer, ()), role)
        return out

    @property
    def cut_layers(self) -> tuple[str, ...]:
        """The layers of contours, the outer one's first."""
        cuts = (self.roles[role] for role in (OUTER, INNER, STITCH))
        return tuple(dict.fromkeys(role.layer for role in cuts if not role.shape))


@dataclass(frozen=True, slots=True)
class Style:
    """How a drawing is made: a profile, the version of DXF, the kind of curves, and the length in
    mm of the ticks that stand for a bend line, 0 for the whole line."""

    profile: Profile
    version: str
    curves: str
    bend_ticks: float

    @property
    def old_polylines(self) -> bool:
        """Whether contours are POLYLINEs: the version or the profile knows no LWPOLYLINE."""
        return self.version == "R12" or "LWPOLYLINE" not in self.profile.kinds

    def attributes(self, role: str) -> dict[str, Any]:
        """A role's layer and its colour, said again for readers that ignore layers, and its
        linetype where it is not continuous."""
        drawn = self.profile.roles[role]
        out: dict[str, Any] = {"layer": drawn.layer, "color": drawn.colour}
        if drawn.linetype != CONTINUOUS:
            out["linetype"] = drawn.linetype
        return out

    @property
    def mark(self) -> str:
        """What the file's name tells, because R12 cannot: the unit."""
        return "-mm" if self.version == "R12" else ""


@cache
def profile(name: str) -> Profile:
    """The profile of that name.

    Raises:
        JobError: there is none.
    """
    if name not in PROFILES:
        raise _refused("profile", name, PROFILES)
    data = resources.files("devcad.export").joinpath(f"profiles/{name}.toml").read_text("utf-8")
    return _profile(name, tomllib.loads(data))


def _profile(name: str, table: dict[str, Any]) -> Profile:
    roles = {role: Role(**row) for role, row in table.pop("roles").items()}
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in table.items()
    }
    return Profile(name, roles=MappingProxyType(roles), **values)


def style(options: Options) -> Style:
    """How the options ask a drawing to be made; what they leave open is the profile's.

    Raises:
        JobError: unknown profile, version or curves, or such as the profile or R12 cannot have.
    """
    chosen = profile(options.dxf_profile)
    version = options.dxf_version or chosen.version
    curves = options.dxf_curves or chosen.curves
    if version not in VERSIONS:
        raise _refused("version", version, VERSIONS)
    if curves not in CURVES:
        raise _refused("curves", curves, CURVES)
    if curves not in chosen.allowed_curves:
        allowed = ", ".join(chosen.allowed_curves)
        raise JobError(
            f"the DXF profile {chosen.name} has no curves {curves!r}",
            value=curves,
            limit=allowed,
            remedy=f"use dxf.curves = {allowed}, or leave it out",
        )
    if version == "R12" and curves == "spline":
        raise JobError(
            "DXF R12 has no splines",
            value="spline",
            limit="arcs, polyline",
            remedy='use dxf.curves = "arcs" or dxf.version = "R2000"',
        )
    ticks = chosen.bend_ticks if options.dxf_bend_ticks is None else options.dxf_bend_ticks
    return Style(chosen, version, curves, ticks)


def _refused(key: str, value: str, allowed: tuple[str, ...]) -> JobError:
    listed = ", ".join(allowed)
    return JobError(
        f"dxf.{key} is {value!r}", value=value, limit=listed, remedy=f"use one of {listed}"
    )
