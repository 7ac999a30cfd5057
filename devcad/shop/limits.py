"""What a shop can do with a sheet, as checks: bend radii, strain, springback, flanges, holes.

A limit comes from the recipe's ``[limits]``, else from the material; where neither knows it there
is no check. Bends are the smooth bending of the surface and the sharp bend lines of the pattern.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.checks import Check, Where
from devcad.flatten.neutral import MIDDLE, Fibre, end_radii
from devcad.geometry.chain import Chain
from devcad.geometry.classify import sample_parameters
from devcad.geometry.patch import Patch
from devcad.geometry.regularity import Extreme, smallest_radius
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.shop.flats import flanges, holes, holes_beside_bends
from devcad.shop.materials import Material
from devcad.shop.settings import Bends, Limits
from devcad.shop.springback import ELASTIC, stiffness_ratio

CARRIED = 0.99
"""The share of all bending that has to take a set: a sheet is nearly flat beside an inflection,
and what little is bent there may spring back."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The limits that apply to a sheet, in mm; None where nothing is known or asked.

    ``bend_radius`` the smallest inside radius; ``strain`` the largest of the outer fibre;
    ``springback`` sigma / (E T) in 1/mm; ``flange`` from a bend line to the sheet's end,
    ``hole_to_bend`` from a hole to a bend line, ``hole`` the narrowest hole. ``inside_radius`` is
    that of sharp bends, where they have one.
    """

    bend_radius: float | None = None
    strain: float | None = None
    springback: float | None = None
    flange: float | None = None
    hole_to_bend: float | None = None
    hole: float | None = None
    inside_radius: float | None = None


def bounds(limits: Limits, bends: Bends, material: Material | None, thickness: float) -> Bounds:
    """The limits of a sheet of a ``thickness`` in mm: the recipe's, else the material's.

    Springback is looked at where the recipe asks for it and the material is known.
    """

    def mm(share: float | None) -> float | None:
        return None if share is None else share * thickness

    radius = mm(limits.bend_ratio)
    if radius is None and material is not None:
        radius = material.smallest_bend(thickness)
    flow = None
    if material is not None and bends.springback:
        flow = stiffness_ratio(material.yield_strength, material.youngs_modulus, thickness)
    return Bounds(
        bend_radius=radius,
        strain=limits.strain,
        springback=flow,
        flange=mm(limits.min_flange),
        hole_to_bend=mm(limits.hole_to_bend),
        hole=mm(limits.hole_to_thickness),
        inside_radius=bends.inside_radius,
    )


def limit_checks(panel: Panel, surface: Chain, fibre: Fibre | None, limits: Bounds) -> list[Check]:
    """The checks bend-radius, outer-strain, springback, flange, hole-near-bend and hole-size of a
    panel, as far as there is a limit and something that it limits.

    ``surface`` is the middle surface bent to the end: where it is smooth it is rolled, and its
    creases are sharp bends.
    """
    tightest = _tightest(panel, surface, limits.inside_radius)
    checks: list[Check | None] = [
        _bend_radius(panel, tightest, limits.bend_radius),
        _outer_strain(panel, tightest, fibre, limits.strain),
        _springback(panel, surface, limits.springback),
        _near("flange", flanges(panel), panel, limits.flange, "the flange is {:.4g} mm"),
        _near(
            "hole-near-bend",
            holes_beside_bends(panel),
            panel,
            limits.hole_to_bend,
            "a hole is {:.4g} mm from a bend line",
        ),
        _near("hole-size", holes(panel), panel, limits.hole, "a hole is {:.4g} mm wide"),
    ]
    return [check for check in checks if check is not None]


_REMEDY = {
    "flange": "move the bend away from the sheet's end, or use a thinner sheet",
    "hole-near-bend": "move the hole away from the bend, or cut it after bending",
    "hole-size": "make the hole larger, drill it, or use a thinner sheet",
}


def _near(
    name: str, found: tuple[float, Where] | None, panel: Panel, limit: float | None, says: str
) -> Check | None:
    """A length that must not be less than its limit; None where there is none of the two."""
    if found is None or limit is None:
        return None
    value, where = found
    passed = value >= limit * (1.0 - 1e-9)  # a length as long as its limit is long enough
    words = says.format(value) + _at(where)
    return Check(name, panel.name, value, limit, "mm", passed, where, words, _REMEDY[name])


def _at(where: Where) -> str:
    """A place of the pattern in words."""
    if where.flat is None:
        return ""
    x, y = where.flat
    return f" at ({x:.6g}, {y:.6g}) in the pattern"


@dataclass(frozen=True, slots=True)
class _Tightest:
    """The tightest bend: the ``radius`` of its inside in mm, where, and its place in words."""

    radius: float
    where: Where
    at: str


def _tightest(panel: Panel, surface: Chain, sharp: float | None) -> _Tightest:
    """The tightest bend of a sheet, rolled or sharp."""
    number, place = min(
        enumerate(smallest_radius(patch) for patch in surface.patches), key=lambda p: p[1].value
    )
    radius = place.value - 0.5 * panel.thickness
    lines = [line for line in panel.pattern.lines if line.angle]
    if sharp is not None and lines and sharp < radius:
        middle = 0.5 * (lines[0].start + lines[0].end)
        place_on_line = Where(flat=(float(middle[0]), float(middle[1])))
        return _Tightest(sharp, place_on_line, f"the bend line{_at(place_on_line)}")
    return _Tightest(radius, _where(panel, surface, number, place), f"t = {place.t:.6g}")


def _bend_radius(panel: Panel, tightest: _Tightest, limit: float | None) -> Check | None:
    if limit is None:
        return None
    return Check(
        "bend-radius",
        panel.name,
        tightest.radius,
        limit,
        "mm",
        tightest.radius >= limit * (1.0 - 1e-9),  # a radius as small as its limit will do
        tightest.where,
        f"the inside radius is {tightest.radius:.4g} mm at {tightest.at}",
        "use a thinner or softer sheet, or a larger radius",
    )


def outer_strain(inside: Array, thickness: float, fibre: Fibre | None) -> Array:
    """The strain of the outer fibre of bends with these inside radii (n,) in mm, inf where flat.

    (1 - K) T / (Ri + K T): what lies outside of the neutral fibre over the radius of that; half
    the thickness over the middle's radius where the middle is neutral.
    """
    k = np.full(len(inside), MIDDLE) if fibre is None else fibre.law(inside / thickness)
    return np.asarray((1.0 - k) * thickness / (inside + k * thickness))


def _outer_strain(
    panel: Panel, tightest: _Tightest, fibre: Fibre | None, limit: float | None
) -> Check | None:
    if limit is None:
        return None
    inside = np.array([max(tightest.radius, 0.0)])
    value = float(outer_strain(inside, panel.thickness, fibre)[0])
    return Check(
        "outer-strain",
        panel.name,
        value,
        limit,
        "",
        value <= limit,
        tightest.where,
        f"the outer fibre is stretched by {100.0 * value:.4g} % at {tightest.at}",
        "use a thinner sheet, or a larger radius",
    )


def _springback(panel: Panel, surface: Chain, flow: float | None) -> Check | None:
    """That a tool of the part's own radius would leave a set wherever the sheet is bent."""
    found = None if flow is None else _gentlest(surface)
    if flow is None or found is None:
        return None
    number, place = found
    x = place.value * flow
    return Check(
        "springback",
        panel.name,
        x,
        ELASTIC,
        "",
        x <= ELASTIC,
        _where(panel, surface, number, place),
        f"a radius of {place.value:.4g} mm cannot be set in one pass: X = {x:.3g} "
        f"at t = {place.t:.6g}",
        "form it in several passes or on a tighter tool, or use a softer or thicker sheet",
    )


def _gentlest(surface: Chain) -> tuple[int, Extreme] | None:
    """The largest radius of the middle among the rulings that carry :data:`CARRIED` of all bending,
    the tightest first; None where nothing bends."""
    rows: list[tuple[float, float, int, float, float]] = []
    for number, patch in enumerate(surface.patches):
        if not np.isfinite(smallest_radius(patch).value):
            continue
        t = sample_parameters(patch, 65)
        frame = patch.frame(t)
        radii = end_radii(frame)
        end = np.argmax(radii, axis=0)
        v = np.where(end == 1, frame.v_to, frame.v_from)
        bending = np.abs(frame.c) * np.gradient(t)
        rows += zip(
            radii.max(axis=0).tolist(),
            bending.tolist(),
            [number] * len(t),
            t.tolist(),
            v.tolist(),
            strict=True,
        )
    if not rows:
        return None
    rows.sort()
    carried = np.cumsum([bending for _, bending, *_ in rows])
    last = int(np.searchsorted(carried, CARRIED * carried[-1]))
    radius, _, number, at, height = rows[last]
    return number, Extreme(radius, at, height)


def _where(panel: Panel, surface: Chain, number: int, place: Extreme) -> Where:
    """A place on the surface, in space and in the pattern."""
    patch: Patch = surface.patches[number]
    t, v = np.array([place.t]), np.array([place.v])
    x, y, z = patch.point(t, v)[0].tolist()
    flat = None
    if panel.blank is not None and panel.blank.middle is surface:
        across, up = panel.blank.points(number, t, v)[0].tolist()
        flat = across, up
    return Where(place.t, place.v, (x, y, z), flat)
