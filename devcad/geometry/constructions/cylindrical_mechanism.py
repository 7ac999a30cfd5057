"""Cylindrical developable mechanisms: links that are pieces of one cylinder."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    BuiltPanel,
    Hole,
    NonNegative,
    Surface,
)
from devcad.geometry.constructions.hinges import (
    Hinge,
    axis_line,
    knuckle_notches,
    living_holes,
    pin_holes,
)
from devcad.geometry.curves import Degrees, Number, Positive
from devcad.geometry.drawing import Drawing
from devcad.geometry.linkage import (
    ROLES,
    TURN,
    Link,
    Linkage,
    branch_of,
    chord,
    conformal,
    joints_of,
    sweeps_of,
)
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.staggering import (
    Span,
    banded,
    conflicts,
    ordered,
    passed,
    pinned_through,
    stacked,
)
from devcad.geometry.taylor import Array

FEWEST, MOST = 4, 64
"""Links of a mechanism; three are a frame."""
SAME = 1e-9
"""Joints nearer than this angle in radians are one; turns that differ by less are whole ones."""
WIDTH, PIN, CLEARANCE = 0.5, 0.05, 0.01
"""Where the job does not say: shares of the radius, or of the longest link where that is less."""
KNUCKLES = 5
SHORTEST, ROOM = 8.0, 1.25
"""The shortest link in diameters of such a pin; and a knuckle's width with its clearance."""
EAR, CURL = 1.5, math.pi
"""How far a link reaches beyond a joint, in diameters of the pin: about a hole, or round it."""
OF_HINGE = {
    "pin": ("hole", "tab"),
    "reach": ("hole", "tab"),
    "knuckles": ("tab",),
    "perforation": ("living",),
    "bands": ("hole", "tab"),
    "layers": ("hole", "tab"),
}
"""Keys that only some hinges have."""


def _listed(value: Any) -> Any:
    """A number as the list of it alone."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


Widths = Annotated[
    Annotated[tuple[Positive, ...], Field(min_length=1)],
    BeforeValidator(_listed),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0},
                {"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}},
            ]
        }
    ),
]
"""A number above 0, or a list of them."""
Several = Field(min_length=FEWEST, max_length=MOST)


class CylindricalMechanism(Surface):
    """Links that lie in one cylinder about z and turn about its rulings.

    They are hinged at the angles ``joints`` on the cylinder of ``radius``, or have the lengths
    ``links`` and lie on the cylinder on which their joints come to be. Link k reaches from joint k
    to joint k + 1, the shorter way round, the last one (the ground) back to joint 0. c0 = the
    circle in z = 0, t the angle from +x, e = +z: the front is the inside. All joint axes are at
    ``radius``; a link in layer j lies j thicknesses further out. Links are kept apart along z, in
    bands one above the other; those that cannot touch share one.
    Source: geometry.md, section 7.
    """

    kind: Literal["cylindrical-mechanism"]
    radius: Positive | None = None
    joints: Annotated[tuple[Degrees, ...], Several] | None = None
    links: Annotated[tuple[Positive, ...], Several] | None = None
    conformal: Literal["open", "crossed"] | None = None
    widths: Widths | None = None
    hinge: Literal["hole", "tab", "living"] = "hole"
    pin: Positive | None = None
    reach: Positive | None = None
    clearance: NonNegative | None = None
    knuckles: Annotated[int, Field(strict=True, ge=2, le=99)] | None = None
    perforation: tuple[Positive, Positive, Positive] | None = None
    bands: tuple[Annotated[int, Field(strict=True, ge=0, lt=MOST)], ...] | None = None
    layers: tuple[Number, ...] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> CylindricalMechanism:
        if (self.links is None) == (self.joints is None):
            raise JobError(
                "a mechanism has either links or a radius with joints",
                remedy="give radius and joints = [degrees, ...], or links = [input, coupler, "
                "output, ground]",
            )
        if (self.radius is None) != (self.joints is None):
            raise JobError(
                "radius and joints belong together",
                remedy="links of given lengths have a radius of their own",
            )
        if self.conformal is not None and self.links is None:
            raise JobError(
                "conformal belongs to links", remedy="the order of the joints says it already"
            )
        if self.conformal == "crossed" and len(self.links or ()) != FEWEST:
            raise JobError(
                f"{len(self.links or ())} links have no one crossed pose on a circle",
                place="conformal",
                value=len(self.links or ()),
                limit=FEWEST,
                remedy="give radius and joints",
            )
        for key, hinges in OF_HINGE.items():
            if getattr(self, key) is not None and self.hinge not in hinges:
                raise JobError(
                    f'{key} does not belong to hinge = "{self.hinge}"',
                    place=key,
                    value=self.hinge,
                    limit=", ".join(hinges),
                    remedy="leave it out",
                )
        for key in ("widths", "bands", "layers"):
            self._require_each(key)
        return self

    def _require_each(self, key: str) -> None:
        """JobError where a list has not one number for each link."""
        given, count = getattr(self, key), len(self.links or self.joints or ())
        if given is not None and len(given) not in ({1, count} if key == "widths" else {count}):
            raise JobError(
                f"there are {len(given)} {key} for {count} links",
                place=key,
                value=len(given),
                limit=count,
                remedy="give one for each link",
            )

    def linkage(self) -> Linkage:
        """The links with their bands, in the job's units; of sheets without thickness.

        Raises:
            GeometryError: links that do not close, or whose crossed pose lies on no circle.
            JobError: hinges for which there is no room.
        """
        radius, joints, sweeps = self._pose()
        names = ROLES if len(joints) == FEWEST else [str(k + 1) for k in range(len(joints))]
        hinge, widths = self._hinge(radius, sweeps), self._widths(_size(radius, sweeps))
        ear = hinge.reach / radius
        spans = [Span(start, sweep, ear) for start, sweep in zip(joints, sweeps, strict=True)]
        layers = self.layers or (0.0,) * len(joints)
        bands = self._bands(spans, hinge, radius, layers)
        intervals = stacked(bands, widths, hinge.clearance)
        links = [
            Link(
                names[k], k, (k + 1) % len(joints), sweeps[k], (ear, ear), (intervals[k],), radius,
                layers[k],
            )
            for k in range(len(joints))
        ]  # fmt: skip
        hinge.require_room(radius, links)
        return Linkage(radius, joints, tuple(links), branch_of(joints), self.hinge)

    def build(self) -> Built:
        """A panel for each link, or one for all where living hinges keep them one sheet."""
        linkage = self.linkage()
        hinge = self._hinge(linkage.radius, tuple(link.sweep for link in linkage.links))
        if self.hinge == "living":
            return Built((_one_sheet(linkage, hinge),))
        return Built(tuple(_link(linkage, k, hinge) for k in range(len(linkage.links))))

    def _pose(self) -> tuple[float, tuple[float, ...], tuple[float, ...]]:
        """The radius, the angles of the joints and those of the links."""
        if self.links is not None:
            radius, sweeps = conformal(self.links, self.conformal or "open")
            return radius, joints_of(sweeps), sweeps
        joints = self.joints or ()
        sweeps = sweeps_of(joints)
        for k, sweep in enumerate(sweeps):
            if abs(sweep) <= SAME:
                raise JobError(
                    f"joints: {k} and {(k + 1) % len(joints)} (counted from 0) are the same",
                    value=math.degrees(joints[k]),
                    remedy="give each joint an angle of its own",
                )
        return self.radius or 0.0, joints, sweeps

    def _hinge(self, radius: float, sweeps: tuple[float, ...]) -> Hinge:
        """The hinges in the job's units; what it does not say is made to fit the links."""
        size, arc = _size(radius, sweeps), radius * min(abs(sweep) for sweep in sweeps)
        knuckles = self.knuckles or KNUCKLES
        narrowest = min(self._widths(size)) / (ROOM * max(knuckles, KNUCKLES))
        pin = self.pin or min(PIN * size, arc / SHORTEST, narrowest, self.reach or math.inf)
        clearance = min(CLEARANCE * size, (ROOM - 1.0) * pin)
        clearance = clearance if self.clearance is None else self.clearance
        reach = 0.0
        if self.hinge != "living":
            reach = self.reach or (EAR if self.hinge == "hole" else CURL) * pin
        return Hinge(self.hinge, pin, reach, clearance, knuckles, self.perforation)

    def _widths(self, size: float) -> tuple[float, ...]:
        count = len(self.links or self.joints or ())
        widths = self.widths or (WIDTH * size,)
        return widths * count if len(widths) == 1 else widths

    def _bands(
        self, spans: list[Span], hinge: Hinge, radius: float, layers: tuple[float, ...]
    ) -> tuple[int, ...]:
        """The band of each link: the job's own, which must keep them apart, or as few as do."""
        clashes = conflicts(spans, hinge.kind != "hole", hinge.clearance / radius)
        if hinge.kind == "living":
            _require_one_sheet(spans, self._widths(1.0))
            return (0,) * len(spans)
        if self.bands is None:
            found = banded(len(spans), clashes)
            return ordered(spans, found, 0.5 * hinge.pin / radius)
        for a, b in sorted(clashes):
            if self.bands[a] == self.bands[b] and abs(layers[a] - layers[b]) < 1.0:
                raise JobError(
                    f"bands: links {a + 1} and {b + 1} lie in one another",
                    value=self.bands[a],
                    remedy="put them in different bands, or in layers a thickness apart",
                )
        return self.bands


def _size(radius: float, sweeps: tuple[float, ...]) -> float:
    """What a mechanism's details go by: its radius, or its longest link where that is less."""
    return min(radius, max(chord(radius, sweep) for sweep in sweeps))


def _require_one_sheet(spans: list[Span], widths: tuple[float, ...]) -> None:
    """JobError where links side by side do not make one sheet round the cylinder."""
    turned = abs(sum(span.sweep for span in spans))
    same_way = len({span.sweep > 0.0 for span in spans}) == 1
    if not same_way or abs(turned - TURN) > SAME:
        raise JobError(
            "hinge: living hinges keep the links one sheet, but these do not lie side by side "
            "round the cylinder: some cover one another",
            value=math.degrees(turned),
            limit=360.0,
            remedy='give hinge = "hole" or "tab"',
        )
    if len(set(widths)) > 1:
        raise JobError(
            "widths: living hinges join links of one width",
            value=max(widths),
            limit=min(widths),
            remedy="give one number",
        )


def _link(linkage: Linkage, k: int, hinge: Hinge) -> BuiltPanel:
    """The panel of link k: its arc with an ear beyond both joints, and what its hinges cut."""
    link = linkage.links[k]
    # from -pi on: short links at large radii keep their digits beside 0
    start = math.remainder(linkage.joints[k] + 0.5 * link.sweep, TURN) - 0.5 * link.sweep
    ends = (start, start + link.sweep)
    low, high = min(ends) - link.overhang[0], max(ends) + link.overhang[1]
    band = link.band[0]
    patch = _patch(linkage.radius, (low, high), band)
    if hinge.kind == "hole":
        holes, lines = pin_holes(hinge, ends, (low, high), band)
    else:
        holes, lines = [], []
        for number, (end, other) in enumerate(zip(ends, (k - 1, k + 1), strict=True)):
            neighbour = linkage.links[other % len(linkage.links)]
            outward = math.copysign(1.0 / linkage.radius, end - ends[1 - number])
            cut, drawn = knuckle_notches(
                hinge, end, outward, (low, high), band, neighbour, first=number == 1
            )
            holes += cut
            lines += drawn
    notes = _notes(linkage, k, hinge)
    return BuiltPanel(
        (patch,), drawings=tuple(lines), notes=notes, holes=tuple(holes), layer=link.layer
    )


def _notes(linkage: Linkage, k: int, hinge: Hinge) -> tuple[str, ...]:
    """How link k is put together with the others."""
    n = len(linkage.links)
    how = "thread a pin through the two holes of each joint, in by one and out by the other"
    if hinge.kind == "tab":
        how = "curl each knuckle round its pin, so that the pin lies on the joint"
    notes = [f"link {k + 1} turns on links {(k - 1) % n + 1} and {(k + 1) % n + 1}: {how}"]
    lows = sorted({link.band[0][0] for link in linkage.links})
    bands = [lows.index(link.band[0][0]) for link in linkage.links]
    spans = [
        Span(linkage.joints[link.first], link.sweep, link.overhang[0]) for link in linkage.links
    ]
    met = pinned_through(spans, bands, 0.5 * hinge.pin / linkage.radius)
    for joint in (k, (k + 1) % n):
        others = " and ".join(f"link {other + 1}" for other in passed(bands, joint))
        if joint in met:
            notes.append(
                f"the pin of joint {joint} passes {others}, of which one covers the joint: lead "
                "the pin inside or outside of it, or give other bands"
            )
        elif others:
            notes.append(
                f"the pin of joint {joint} passes {others}: where they move on it, they stop"
            )
    return tuple(notes)


def _one_sheet(linkage: Linkage, hinge: Hinge) -> BuiltPanel:
    """The sheet of all links, from the middle of the ground round to it, its ends clear."""
    ground = abs(linkage.links[-1].sweep)
    way = math.copysign(1.0, linkage.links[-1].sweep)
    first = linkage.joints[0] - 0.5 * way * ground
    ends = sorted((first, first + way * TURN))
    half = 0.5 * hinge.clearance / linkage.radius
    domain = (ends[0] + half, ends[1] - half)
    band = linkage.links[0].band[0]
    swept = np.concatenate([[0.0], np.cumsum([link.sweep for link in linkage.links[:-1]])])
    joints = (linkage.joints[0] + swept).tolist()
    holes: list[Hole] = []
    lines: list[Drawing] = []
    for joint in joints:
        if hinge.perforation is None:
            lines.append(axis_line("SCORE", joint, *band))
        else:
            holes += living_holes(hinge.perforation, (joint - domain[0]) / np.ptp(domain), band)
    note = (
        "the sheet is open in the middle of the ground link: join its ends there, by "
        "tape or by a strip behind them"
    )
    patch = _patch(linkage.radius, domain, band)
    return BuiltPanel((patch,), drawings=tuple(lines), holes=tuple(holes), notes=(note,))


def _patch(radius: float, domain: tuple[float, float], band: tuple[float, float]) -> Patch:
    """The piece of the cylinder between two angles and two heights."""

    def field(t: Array, order: int) -> RulingJet:
        sine, cosine = taylor.sin_cos(taylor.variable(t, order))
        return RulingJet(
            radius * np.stack([cosine, sine, np.zeros_like(sine)], axis=-1),
            taylor.constant_vector(np.array([0.0, 0.0, 1.0]), order, t.size),
            taylor.constant(band[0], order, t.size),
            taylor.constant(band[1], order, t.size),
        )

    return Patch(field, domain)
