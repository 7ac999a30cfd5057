"""The press brake: where it bends a sheet, in what order and how far, and what comes off it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import GeometryError
from devcad.flatten.alignment import misfit
from devcad.flatten.bend import bent, neutral
from devcad.flatten.bendcells import STEEPEST, alike, by_angle, by_chord, by_count, by_length
from devcad.flatten.bending import Bend, BendLine, Sheet, Stretch, bends, sheet, stretches
from devcad.flatten.blank import Blank, flat_chain
from devcad.flatten.brake import Zone, facets, folded, pattern_motion
from devcad.flatten.pattern import Line
from devcad.flatten.refolding import refolded
from devcad.flatten.zonecuts import carried
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.taylor import Array
from devcad.shop.bendlines import bend_lines
from devcad.shop.settings import DEFAULT_CHORD, Bends

TRIES = 8
"""How often bends are added for the sake of the chord."""
GAIN = 0.95
"""More bends that leave more than this of the distance do not help."""
NEAR = 4.0
"""Thicknesses: ends of a sheet that are further apart do not meet."""
ISOMETRY, FOLD_BACK = 1e-9, 1e-8
"""Limits of the facets' checks, shares of the part's size."""


@dataclass(frozen=True, slots=True)
class Pressed:
    """What comes off the brake: the ``chain`` as it stands and bent to the ``full``, its ``zones``
    on the blank, the bend lines, the checks and figures; ``smooth`` is the part that was asked."""

    chain: Chain
    full: Chain
    zones: tuple[Zone, ...]
    smooth: Sheet
    bends: tuple[BendLine, ...]
    checks: tuple[Check, ...]
    figures: dict[str, float]
    notes: tuple[str, ...] = ()

    @property
    def lines(self) -> tuple[Line, ...]:
        """The bend lines as lines of the pattern, in the order along the panel."""
        return tuple(bend.line for bend in self.bends)

    @property
    def exact(self) -> bool:
        """Whether the part has the area of its blank: all bends are sharp."""
        return all(zone.curl is None and not zone.kept for zone in self.zones)

    @property
    def limited(self) -> Chain:
        """The surface whose radii the tool makes: the part's where its bends have an inside radius,
        else the smooth one, which sharp bends stand for."""
        return self.smooth.middle if self.exact else self.full

    def proven(self, checks: Sequence[Check]) -> list[Check]:
        """The checks of the smooth part with those of the facets: of two of one name the worse."""
        own = {check.name: check for check in self.checks}
        out = [
            _worse(check, own.pop(check.name)) if check.name in own else check for check in checks
        ]
        return [*out, *own.values()]

    def places(self, number: int, t: Array, v: Array) -> Array:
        """The places (n, 2) in the pattern of points (t, v), each (n,), of a zone."""
        return self.zones[number].flat.point(t, v)[:, :2]

    def carried(self, cuts: Sequence[Cut]) -> tuple[Cut, ...]:
        """The cuts of the smooth part on the zones."""
        return carried(cuts, self.smooth.flat, self.zones)


def pressed(
    name: str,
    blank: Blank,
    how: Bends,
    *,
    thickness: float,
    bend: float,
    tolerance: float,
    flow: float | None,
) -> Pressed:
    """The blank bent on a press brake, laid as near to the smooth part as it gets.

    Args:
        name: the panel's, for its checks.
        bend: as in :class:`devcad.making.Making`; the first facet stays where it is.
        flow: sigma / (E T) of the material in 1/mm where bends are over-bent, else None.
    Raises:
        GeometryError: bends that are too few, too many, too steep, or without room.
    """
    flat = flat_chain(blank.middle, [d.series for d in blank.developments], blank.fibres)
    smooth = sheet(blank.middle, flat, blank.developments)
    parts = stretches(blank.middle, blank.developments)
    zones, full, chord, cells = _made(smooth, parts, blank, how, thickness, tolerance)
    made = bends(smooth, parts, cells)
    start = pattern_motion(zones[0].flat, full.patches[0])
    chain = full
    if bend != 1.0:
        part = bent(blank, bend)
        chain = folded(zones, part, start, bend, tolerance=tolerance)
    lines = bend_lines(smooth, made, thickness, how.inside_radius or None, flow)
    checks = _checks(name, full, smooth, zones, lines, how, chord)
    figures = {
        "bend_count": float(len(lines)),
        "largest_bend_deg": float(np.degrees(max((abs(x.line.angle) for x in lines), default=0.0))),
        "chord": chord,
    }
    if blank.middle.closed:
        figures["closing_gap"] = closing_gap(full)
    notes = _overlap(full, thickness)
    return Pressed(chain, full, tuple(zones), smooth, lines, checks, figures, notes)


def closing_gap(chain: Chain) -> float:
    """The largest distance in mm between the ends of the last ruling and of the first."""
    return float(np.linalg.norm(_closing(chain), axis=1).max())


def _closing(chain: Chain) -> Array:
    """The ways from the ends of the first ruling to those of the last, (2, 3)."""
    ends = []
    for patch, t in ((chain.patches[0], 0), (chain.patches[-1], 1)):
        jet = patch.jet([patch.domain[t]], 0)
        ends.append(jet.c0[0] + np.stack([jet.v_from[0], jet.v_to[0]]) * jet.e[0])
    return np.asarray(ends[1] - ends[0])


def _overlap(chain: Chain, thickness: float) -> tuple[str, ...]:
    """A note where the ends of a thick tube that does not quite close lie in one another."""
    way = _closing(chain)
    if chain.closed or not np.linalg.norm(way, axis=1).max() < NEAR * thickness:
        return ()
    low, high = chain.patches[0].domain
    frame = chain.patches[0].frame([np.nextafter(low, high)])
    beside = np.abs(way @ frame.n[0]) < thickness
    over = float(np.where(beside, way @ frame.m[0], 0.0).max())
    if over <= ISOMETRY * float(np.abs(way).max()):
        return ()
    return (f"off the brake the ends overlap by {over:.3g} mm: give the surface a larger gap",)


def _made(
    smooth: Sheet,
    parts: Sequence[Stretch],
    blank: Blank,
    how: Bends,
    thickness: float,
    tolerance: float,
) -> tuple[list[Zone], Chain, float, list[Array]]:
    """The zones, the part bent to the end in its place, its distance from the smooth one, and
    the cells of each stretch; for a chord as many more as it takes."""
    cells = _cells(smooth, parts, how)
    limit = _chord(how)
    before = np.inf
    for _ in range(TRIES):
        steep = [
            abs(part.angle) * float(np.diff(borders).max())
            for part, borders in zip(parts, cells, strict=True)
        ]
        if steep and max(steep) > STEEPEST * (1.0 + 1e-12):
            worst = float(np.degrees(max(steep)))
            raise GeometryError(
                f"bends: a bend of {worst:.4g} deg, limit 150 deg",
                value=worst,
                limit=150.0,
                remedy="allow more bends",
            )
        zones = _zones(smooth, bends(smooth, parts, cells), blank, how, thickness)
        full, chord = _placed(zones, smooth, blank, tolerance)
        if limit is None or chord <= limit or chord > GAIN * before or not parts:
            break
        before = chord
        more = min(float(np.sqrt(chord / limit)), 2.0)
        counts = [len(borders) - 1 for borders in cells]
        cells = alike([max(int(np.ceil(n * more)), n + 1) for n in counts])
    return zones, full, chord, cells


def _zones(
    smooth: Sheet, made: Sequence[Bend], blank: Blank, how: Bends, thickness: float
) -> list[Zone]:
    if not how.inside_radius:
        return facets(smooth, made)
    from devcad.flatten.strips import rounded  # most bends are sharp

    return rounded(smooth, made, blank.fibre, thickness, how.inside_radius)


def _chord(how: Bends) -> float | None:
    """The chord that was asked for, in mm; the default where nothing was."""
    if how.chord is None and how.angle is None and how.length is None and how.count is None:
        return DEFAULT_CHORD
    return how.chord


def _cells(smooth: Sheet, parts: Sequence[Stretch], how: Bends) -> list[Array]:
    """The borders of each stretch's cells."""
    chord = _chord(how)
    if not parts:
        return []
    if chord is not None:
        return alike(by_chord(smooth, parts, chord))
    if how.angle is not None:
        return alike(by_angle(parts, how.angle))
    if how.length is not None:
        return by_length(smooth, parts, how.length)
    assert how.count is not None
    return alike(by_count(parts, how.count))


def _placed(
    zones: Sequence[Zone], smooth: Sheet, blank: Blank, tolerance: float
) -> tuple[Chain, float]:
    """The part bent to the end, where it lies nearest to the smooth one, and its distance from it;
    sharp facets, which are no longer than their blank, are measured from its neutral surface."""
    middle = blank.middle
    start = pattern_motion(smooth.flat.patches[0], middle.patches[0])
    walked = folded(zones, middle, start, 1.0, tolerance=tolerance)
    homes = [zone.home for zone in zones]
    distance, motion = misfit(middle, walked.patches, homes)
    if not blank.isometric and not any(zone.curl or zone.kept for zone in zones):
        distance, _ = misfit(neutral(blank), walked.patches, homes)
    return folded(zones, middle, motion @ start, 1.0, tolerance=tolerance), distance


def _checks(
    name: str,
    full: Chain,
    smooth: Sheet,
    zones: Sequence[Zone],
    lines: Sequence[BendLine],
    how: Bends,
    chord: float,
) -> tuple[Check, ...]:
    stretched, missed, size = refolded(full, zones, smooth, lines)
    checks = [
        at_most(
            "isometry",
            name,
            stretched,
            ISOMETRY,
            "",
            says=f"a facet differs by {stretched:.3g} of its size from the pattern",
            remedy="use fewer bends",
        ),
        at_most(
            "fold-back",
            name,
            missed,
            FOLD_BACK * size,
            "mm",
            says=f"the pattern folded along its bend lines misses the part by {missed:.3g} mm",
            remedy="use fewer bends",
        ),
    ]
    limit = _chord(how)
    if limit is not None:
        checks.append(
            at_most(
                "chord",
                name,
                chord,
                limit,
                "mm",
                says=f"the facets are {chord:.4g} mm from the smooth part, however many there are",
                remedy="allow a larger chord, or give the neutral fibre that bends of this inside "
                "radius have",
            )
        )
    return tuple(checks)


def _worse(one: Check, other: Check) -> Check:
    return other if other.value / other.limit > one.value / one.limit else one
