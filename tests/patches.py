"""Patches written down by hand from closed forms: the tests' own geometry."""

from __future__ import annotations

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array


def frustum(
    lower: float = 100.0, upper: float = 50.0, height: float = 120.0, sweep: float = 2 * np.pi
) -> Patch:
    """Cone frustum about z; with lower == upper a cylinder, with upper == 0 a full cone."""
    slant = float(np.hypot(height, lower - upper))

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        zero = np.zeros_like(sin)
        rise = taylor.constant(height / slant, order, t.size)
        lean = (upper - lower) / slant
        return RulingJet(
            np.stack([lower * cos, lower * sin, zero], axis=-1),
            np.stack([lean * cos, lean * sin, rise], axis=-1),
            taylor.constant(0.0, order, t.size),
            taylor.constant(slant, order, t.size),
        )

    return Patch(field, (0.0, sweep))


def helix_tangent(
    radius: float = 3.0,
    rise: float = 4.0,
    length: float = 10.0,
    extent: tuple[float, float] = (1.0, 3.0),
) -> Patch:
    """Tangent surface of the helix (a cos, a sin, b .), by arc length: a flat annulus."""
    speed = float(np.hypot(radius, rise))

    def field(t: Array, order: int) -> RulingJet:
        angle = taylor.variable(t, order + 1) / speed
        sin, cos = taylor.sin_cos(angle)
        curve = np.stack([radius * cos, radius * sin, rise * angle], axis=-1)
        return RulingJet(
            curve[: order + 1],
            taylor.derivative(curve),
            taylor.constant(extent[0], order, t.size),
            taylor.constant(extent[1], order, t.size),
        )

    return Patch(field, (0.0, length))


def ellipse_cylinder(a: float = 3.0, b: float = 2.0, height: float = 1.0) -> Patch:
    """Upright cylinder over an ellipse, by the eccentric angle."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        return RulingJet(
            np.stack([a * cos, b * sin, np.zeros_like(sin)], axis=-1),
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(height, order, t.size),
        )

    return Patch(field, (0.0, 2 * np.pi))


def slanted_pipe(radius: float = 10.0) -> Patch:
    """Cylinder cut by the plane z = 20 + x: its pattern ends in z = 20 + 10 cos(s / 10)."""
    whole = frustum(radius, radius, 1.0)

    def field(t: Array, order: int) -> RulingJet:
        jet = whole.field(t, order)
        _, cos = taylor.sin_cos(taylor.variable(t, order))
        top = radius * cos
        top[0] += 2.0 * radius
        return RulingJet(jet.c0, jet.e, jet.v_from, top)

    return Patch(field, whole.domain)


def hyperboloid(reach: float = 1.0) -> Patch:
    """One family of rulings of x^2 + y^2 - z^2 = 1: ruled, not developable."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        zero = np.zeros_like(sin)
        return RulingJet(
            np.stack([cos, sin, zero], axis=-1),
            np.stack([-sin, cos, zero + taylor.constant(1.0, order, t.size)], axis=-1)
            / np.sqrt(2.0),
            taylor.constant(-reach, order, t.size),
            taylor.constant(reach, order, t.size),
        )

    return Patch(field, (0.0, 2 * np.pi))


def wall(start: Array, end: Array, height: float) -> Patch:
    """An upright rectangle over the segment start -> end (3,), t in [0, 1]."""

    def field(t: Array, order: int) -> RulingJet:
        share = taylor.variable(t, order)
        c0 = taylor.mul(share, taylor.constant_vector(end - start, order, t.size))
        c0[0] += start
        return RulingJet(
            c0,
            taylor.constant_vector([0.0, 0.0, 1.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            taylor.constant(height, order, t.size),
        )

    return Patch(field, (0.0, 1.0))


def prism(corners: Array, height: float) -> tuple[Patch, ...]:
    """The upright walls around a closed polygon (n, 2)."""
    at = np.column_stack([corners, np.zeros(len(corners))])
    return tuple(wall(at[k], at[(k + 1) % len(at)], height) for k in range(len(at)))


def gore(radius: float = 100.0, number: int = 12) -> Patch:
    """A lune of the circular cylinder about y with a sharp tip at both ends; front outside."""
    half = float(np.tan(np.pi / number))

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        return RulingJet(
            np.stack([radius * cos, 0.0 * sin, radius * sin], axis=-1),
            taylor.constant_vector([0.0, -1.0, 0.0], order, t.size),
            -radius * half * cos,
            radius * half * cos,
        )

    return Patch(field, (-0.5 * np.pi, 0.5 * np.pi))


def cosine_cylinder(
    multiples: tuple[int, int, int] = (1, 1, 2), domain: tuple[float, float] = (0.0, np.pi)
) -> Patch:
    """The chords along y of the curve (cos i t, sin j t, cos k t), by t and its mirror -t.

    (1, 1, 2): the parabolic cylinder z = 2 x^2 - 1, a round tip at both ends.
    (1, 2, 3): the cubic cylinder z = 4 x^3 - 3 x; its chords vanish at pi / 2 too, crossing.
    """
    i, j, k = multiples

    def field(t: Array, order: int) -> RulingJet:
        x = taylor.variable(t, order)
        height = taylor.sin_cos(j * x)[0]
        along, across = taylor.sin_cos(i * x)[1], taylor.sin_cos(k * x)[1]
        return RulingJet(
            np.stack([along, height, across], axis=-1),
            taylor.constant_vector([0.0, -1.0, 0.0], order, t.size),
            taylor.constant(0.0, order, t.size),
            2.0 * height,
        )

    return Patch(field, domain)


def oloid(first: int = 0, quarters: int = 4, radius: float = 1.0) -> tuple[Patch, ...]:
    """The patches of the oloid's hull, chi in quarters of a turn: the rulings A B between the
    unit circles A = (sin a, -1/2 - cos a, 0) and B = (0, 1/2 + cos b, sin b).

    X = sin(a / 2) and Y = sin(b / 2) run round the closed curve 4 X^2 Y^2 = 4 (X^2 + Y^2) - 3 in
    the direction (cos chi, sin chi); A stands still where chi is 0 and pi, B half way between.
    """

    def field(t: Array, order: int) -> RulingJet:
        x = taylor.variable(t, order)
        sin, cos = taylor.sin_cos(x)
        double = taylor.sin_cos(2.0 * x)[0]
        root = -0.75 * taylor.mul(double, double)
        root[0] += 1.0
        root = taylor.sqrt(root)
        root[0] += 1.0
        reach = taylor.sqrt(1.5 * taylor.reciprocal(root))
        u, w = taylor.mul(reach, cos), taylor.mul(reach, sin)  # sines of half angles
        at_a, at_b = _doubled(u), _doubled(w)
        zero = np.zeros_like(x)
        a = np.stack([at_a[0], -at_a[1], zero], axis=-1)
        b = np.stack([zero, at_b[1], at_b[0]], axis=-1)
        a[0, :, 1] -= 0.5
        b[0, :, 1] += 0.5
        length = radius * np.sqrt(3.0)
        e = (b - a) / np.sqrt(3.0)
        return RulingJet(
            radius * a,
            e,
            taylor.constant(0.0, order, t.size),
            taylor.constant(length, order, t.size),
        )

    quarter = 0.5 * np.pi
    return tuple(
        Patch(field, (k * quarter, (k + 1) * quarter)) for k in range(first, first + quarters)
    )


def _doubled(sine: Array) -> tuple[Array, Array]:
    """Sine and cosine of the angle whose half has this sine and a positive cosine."""
    square = taylor.mul(sine, sine)
    rest = -square
    rest[0] += 1.0
    cosine = -2.0 * square
    cosine[0] += 1.0
    return 2.0 * taylor.mul(sine, taylor.sqrt(rest)), cosine


def sphericon(radius: float = 1.0) -> tuple[Patch, ...]:
    """Four half cones of half angle 45 degrees, their apex by turns at v = 0 and at v = v_to."""
    slant = float(np.sqrt(2.0)) * radius
    x, y, z = radius * np.eye(3)

    def half(apex: Array, start: Array, side: Array, number: int) -> Patch:
        first = number * np.pi

        def field(t: Array, order: int) -> RulingJet:
            angle = taylor.variable(t, order)
            angle[0] -= first
            sin, cos = taylor.sin_cos(angle)
            rim = cos[..., None] * start + sin[..., None] * side
            tip = taylor.constant_vector(apex, order, t.size)
            low, high = (tip, rim) if number % 2 == 0 else (rim, tip)
            return RulingJet(
                low,
                (high - low) / slant,
                taylor.constant(0.0, order, t.size),
                taylor.constant(slant, order, t.size),
            )

        return Patch(field, (first, first + np.pi))

    return half(z, x, y, 0), half(-x, z, -y, 1), half(-z, -x, y, 2), half(x, -z, -y, 3)


def lens(whole: Patch, middle: tuple[float, float], reach: tuple[float, float]) -> Patch:
    """The part of a patch inside an ellipse in (t, v): a round tip at both ends."""

    def field(t: Array, order: int) -> RulingJet:
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        inner = -reach[0] * cos
        inner[0] += middle[0]
        jet = whole.field(inner[0], order)
        half, height = reach[1] * sin, taylor.constant(middle[1], order, t.size)
        return RulingJet(
            taylor.compose(jet.c0, inner),
            taylor.compose(jet.e, inner),
            height - half,
            height + half,
        )

    return Patch(field, (0.0, np.pi))
