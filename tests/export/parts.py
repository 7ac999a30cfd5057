"""Panels made by hand from closed forms, for the exporters' tests.

Pattern and mesh are empty but for the exact area, which is all that STEP reads of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from devcad.flatten.pattern import Pattern
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, Joint, link
from devcad.geometry.classify import Shape
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array
from devcad.mesh.mesh import Mesh
from devcad.part import Panel, Part

Series = Callable[[Array], Array]  # a Taylor series (K + 1, n) -> (K + 1, n, 3) or (K + 1, n)

TURN = 2.0 * np.pi
CLOSED = Joint(0.0, 0.0)


def vector(*components: Array) -> Array:
    return np.stack(components, axis=-1)


def patch(
    base: Series,
    ruling: Series,
    v_from: float | Series,
    v_to: float | Series,
    domain: tuple[float, float],
    breaks: tuple[float, ...] = (),
) -> Patch:
    """A patch from series functions of t; ``ruling`` need not be unit."""

    def field(t: Array, order: int) -> RulingJet:
        x = taylor.variable(t, order)
        heights = [
            v(x) if callable(v) else taylor.constant(v, order, t.size) for v in (v_from, v_to)
        ]
        return RulingJet(base(x), taylor.unit(ruling(x)), heights[0], heights[1])

    return Patch(field, domain, breaks)


def constant(x: Array, value: float | Array) -> Array:
    order, n = len(x) - 1, x.shape[1]
    if np.ndim(value):
        return taylor.constant_vector(np.asarray(value), order, n)
    return taylor.constant(float(value), order, n)


def panel(
    *patches: Patch,
    shapes: tuple[Shape, ...],
    area: float,
    thickness: float = 0.0,
    joints: tuple[Joint, ...] = (),
    closing: Joint | None = None,
    name: str = "body",
    orientable: bool = True,
) -> Panel:
    empty = np.zeros((0, 3))
    none = np.zeros((0, 3), dtype=np.int32)
    mesh = Mesh(empty, empty, empty[:, :2], none, none[:, 0], False, 0.0)
    return Panel(
        name,
        "test",
        Chain(patches, joints, closing, orientable=orientable),
        shapes,
        thickness,
        (),
        mesh,
        Pattern((), (), area, (0.0, 0.0, 0.0, 0.0)),
    )


def part(*panels: Panel, name: str = "job", tolerance: float = 0.05) -> Part:
    return Part(name, panels, panels[0].thickness, tolerance, ())


def frustum(
    radius: float = 100.0,
    top: float = 50.0,
    height: float = 120.0,
    sweep: float = TURN,
    thickness: float = 0.0,
) -> Panel:
    """Front outside; with top = 0 the cone up to its apex, with top = radius a cylinder."""
    slant = float(np.hypot(radius - top, height))

    def base(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(radius * c, radius * s, constant(x, 0.0))

    def ruling(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector((top - radius) * c, (top - radius) * s, constant(x, height))

    axis = np.array([0.0, 0.0, 1.0])
    if top == radius:
        shape = Shape("cylinder", np.zeros(3), axis, radius=radius)
    else:
        rise = radius * height / (radius - top)
        angle = float(np.arctan2(abs(radius - top), height))
        down = -axis if top < radius else axis
        shape = Shape("cone", rise * axis, down, half_angle=angle)
    area = 0.5 * sweep * (radius + top) * slant
    return panel(
        patch(base, ruling, 0.0, slant, (0.0, sweep)),
        shapes=(shape,),
        area=area,
        thickness=thickness,
        closing=CLOSED if sweep == TURN else None,
    )


def mitred_pipe(
    radius: float = 40.0,
    length: float = 150.0,
    slope: float = 0.7,
    sweep: float = TURN,
    thickness: float = 0.0,
) -> Panel:
    """A pipe whose upper end is cut by a plane: v_to = length + slope x."""

    def base(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(radius * c, radius * s, constant(x, 0.0))

    def top(x: Array) -> Array:
        return constant(x, length) + slope * radius * taylor.sin_cos(x)[1]

    axis = np.array([0.0, 0.0, 1.0])
    area = radius * (length * sweep + slope * radius * np.sin(sweep))
    return panel(
        patch(base, lambda x: constant(x, axis), 0.0, top, (0.0, sweep)),
        shapes=(Shape("cylinder", np.zeros(3), axis, radius=radius),),
        area=area,
        thickness=thickness,
        closing=CLOSED if sweep == TURN else None,
    )


def elliptic_cylinder(
    a: float = 60.0,
    b: float = 35.0,
    height: float = 80.0,
    sweep: float = TURN,
    thickness: float = 0.0,
) -> Panel:
    def base(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(a * c, b * s, constant(x, 0.0))

    axis = np.array([0.0, 0.0, 1.0])
    nodes, weights = np.polynomial.legendre.leggauss(200)
    t = 0.5 * sweep * (1.0 + nodes)
    arc = 0.5 * sweep * weights @ np.hypot(a * np.sin(t), b * np.cos(t))
    return panel(
        patch(base, lambda x: constant(x, axis), 0.0, height, (0.0, sweep)),
        shapes=(Shape("cylinder", axis=axis),),
        area=float(arc * height),
        thickness=thickness,
        closing=CLOSED if sweep == TURN else None,
    )


def elliptic_cone(
    a: float = 60.0,
    b: float = 35.0,
    rise: float = 90.0,
    fractions: tuple[float, float] = (0.3, 1.0),
    domain: tuple[float, float] = (0.0, TURN),
    thickness: float = 0.0,
) -> Panel:
    """The cone over an ellipse in z = 0 with its apex at (10, 5, rise); the extent runs over
    fractions of the way from the apex to the ellipse."""
    apex = np.array([10.0, 5.0, rise]) if rise > 0 else np.array([0.0, 0.0, -rise])

    def arm(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(a * c, -b * s, constant(x, 0.0)) - constant(x, apex)

    def height(f: float) -> Series:
        if f == 0.0:
            return lambda x: constant(x, 0.0)
        return lambda x: f * taylor.norm(arm(x))

    nodes, weights = np.polynomial.legendre.leggauss(400)
    t = domain[0] + 0.5 * (domain[1] - domain[0]) * (1.0 + nodes)
    jet = arm(taylor.variable(t, 1))
    sector = 0.5 * np.linalg.norm(np.cross(jet[0], jet[1]), axis=1)
    whole = 0.5 * (domain[1] - domain[0]) * weights @ sector
    return panel(
        patch(lambda x: constant(x, apex), arm, height(fractions[0]), height(fractions[1]), domain),
        shapes=(Shape("cone", apex),),
        area=float(whole * (fractions[1] ** 2 - fractions[0] ** 2)),
        thickness=thickness,
        closing=CLOSED if domain[1] - domain[0] == TURN else None,
    )


def helix_strip(
    radius: float = 30.0,
    rise: float = 12.0,
    extent: tuple[float, float] = (20.0, 60.0),
    turns: float = 1.0,
    thickness: float = 0.0,
) -> Panel:
    """The tangent surface of a helix; ``rise`` per radian."""

    def base(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(radius * c, radius * s, rise * x)

    def tangent(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(-radius * s, radius * c, constant(x, rise))

    speed = np.hypot(radius, rise)
    area = 0.5 * (extent[1] ** 2 - extent[0] ** 2) * (radius / speed) * TURN * turns
    return panel(
        patch(base, tangent, *extent, (0.0, TURN * turns)),
        shapes=(Shape("tangent"),),
        area=float(area),
        thickness=thickness,
    )


def quad(corners: Array) -> tuple[Patch, Shape, float]:
    """The plane patch over a quadrilateral: rails corners 0 -> 1 (from) and 3 -> 2 (to)."""
    p0, p1, p2, p3 = corners

    def low(x: Array) -> Array:
        return constant(x, p0) + x[..., None] * (p1 - p0)

    def arm(x: Array) -> Array:
        return constant(x, p3) + x[..., None] * (p2 - p3) - low(x)

    one = patch(low, arm, 0.0, lambda x: taylor.norm(arm(x)), (0.0, 1.0))
    area = 0.5 * np.linalg.norm(np.cross(p2 - p0, p3 - p1))
    return one, Shape("plane", p0, one.frame(0.5).n[0]), float(area)


def hopper(
    base: float = 100.0,
    top: float = 60.0,
    height: float = 80.0,
    thickness: float = 0.0,
    sides: int = 4,
    closed: bool = True,
) -> Panel:
    """The sides of a truncated square pyramid: planes around a square, creases between."""
    angle = TURN * (np.arange(5) + 0.5) / 4.0
    ring = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1) / np.sqrt(2.0)
    low, high = base * ring, top * ring + [0.0, 0.0, height]
    made = [quad(np.array([low[k], low[k + 1], high[k + 1], high[k]])) for k in range(sides)]
    fold = float(np.pi / 2.0)
    return panel(
        *(m[0] for m in made),
        shapes=tuple(m[1] for m in made),
        area=sum(m[2] for m in made),
        thickness=thickness,
        joints=(Joint(-fold, 0.0),) * (sides - 1),
        closing=Joint(-fold, 0.0) if closed else None,
    )


def plate(
    radii: tuple[float, float] = (30.0, 80.0), sweep: float = TURN, thickness: float = 0.0
) -> Panel:
    """A plane ring, or the sector of one."""

    def ruling(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(c, s, constant(x, 0.0))

    area = 0.5 * sweep * (radii[1] ** 2 - radii[0] ** 2)
    return panel(
        patch(lambda x: constant(x, np.zeros(3)), ruling, *radii, (0.0, sweep)),
        shapes=(Shape("plane", np.zeros(3), np.array([0.0, 0.0, 1.0])),),
        area=area,
        thickness=thickness,
        closing=CLOSED if sweep == TURN else None,
    )


def rounded_box(
    a: float = 50.0,
    b: float = 30.0,
    corner: float = 10.0,
    height: float = 40.0,
    thickness: float = 0.0,
) -> Panel:
    """The walls of an upright box with round corners as one patch, by arc length; it starts at
    a corner's end, so that no side is cut in two. Counterclockwise from above, front outside."""
    quarter = 0.5 * np.pi * corner
    sides = [2.0 * (a - corner), 2.0 * (b - corner)] * 2
    pieces: list[tuple[float, Array, float, float]] = []  # start, point, direction, curvature
    at, point, along = 0.0, np.array([corner - a, -b]), 0.0
    for side in sides:
        ahead = np.array([np.cos(along), np.sin(along)])
        left = np.array([-ahead[1], ahead[0]])
        pieces += [(at, point, along, 0.0), (at + side, point + side * ahead, along, 1.0 / corner)]
        point = point + (side + corner) * ahead + corner * left
        at, along = at + side + quarter, along + 0.5 * np.pi
    borders = np.array([p[0] for p in pieces])

    def base(x: Array) -> Array:
        out = np.zeros((*x.shape, 3))
        which = np.searchsorted(borders[1:], x[0], side="right")
        for k, (begin, origin, angle, bend) in enumerate(pieces):
            s = x[:, which == k].copy()
            s[0] -= begin
            turned = bend * s
            turned[0] += angle
            sine, cosine = taylor.sin_cos(turned)
            if bend:
                run = vector(sine / bend, -cosine / bend, 0.0 * s)
                run[0, :, :2] += np.array([-np.sin(angle), np.cos(angle)]) / bend
            else:
                run = vector(s * np.cos(angle), s * np.sin(angle), 0.0 * s)
            run[0, :, :2] += origin
            out[:, which == k] = run
        return out

    axis = np.array([0.0, 0.0, 1.0])
    girth = sum(sides) + 4.0 * quarter
    return panel(
        patch(base, lambda x: constant(x, axis), 0.0, height, (0.0, girth), tuple(borders[1:])),
        shapes=(Shape("cylinder", axis=axis),),
        area=girth * height,
        thickness=thickness,
        closing=CLOSED,
    )


def moebius(radius: float = 50.0, width: float = 10.0) -> Panel:
    """A band whose ruling comes back reversed (it twists: no developable, but a good shape)."""

    def base(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        return vector(radius * c, radius * s, constant(x, 0.0))

    def ruling(x: Array) -> Array:
        s, c = taylor.sin_cos(x)
        half_s, half_c = taylor.sin_cos(0.5 * x)
        return vector(taylor.mul(half_c, c), taylor.mul(half_c, s), half_s)

    return panel(
        patch(base, ruling, -width, width, (0.0, TURN)),
        shapes=(Shape("tangent"),),
        area=1.0,
        closing=CLOSED,
        orientable=False,
    )


def scaled(made: Panel, factor: float) -> Panel:
    """The panel, its shapes, thickness and area scaled about the origin."""
    shapes = tuple(
        replace(
            s,
            point=None if s.point is None else factor * s.point,
            radius=None if s.radius is None else factor * s.radius,
        )
        for s in made.shapes
    )
    chain = replace(made.chain, patches=tuple(p.scaled(factor) for p in made.chain.patches))
    pattern = replace(made.pattern, area=made.pattern.area * factor**2)
    return replace(
        made, chain=chain, shapes=shapes, thickness=made.thickness * factor, pattern=pattern
    )


def chained(
    quads: list[tuple[Patch, Shape, float]], *, closed: bool, thickness: float = 0.0
) -> Panel:
    """Plane patches one after the other, the creases between them measured."""
    patches = tuple(patch for patch, _, _ in quads)
    made = panel(
        *patches,
        shapes=tuple(shape for _, shape, _ in quads),
        area=sum(area for _, _, area in quads),
        thickness=thickness,
    )
    return replace(made, chain=link(patches, base_closed=closed, tolerance=0.05))
