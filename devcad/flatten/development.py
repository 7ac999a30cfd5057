"""Development: the isometric image of a patch in the plane, by quadrature to rounding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.flatten.neutral import Fibre
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Development:
    """A patch in the plane: the point of c0(t), the angle of e(t), and how it bends there.

    ``series`` has the components omega, X, Y and c: the surface point (t, v) lies at
    (X, Y) + v (cos omega, sin omega), and c dt is the bending about that ruling, in radians,
    positive towards the front.
    """

    series: Piecewise

    def origin(self, t: Array) -> Array:
        """The images of c0(t), (n, 2) in mm."""
        return self.series(t)[:, 1:3]

    def direction(self, t: Array) -> Array:
        """The images of e(t), (n, 2), unit."""
        return _direction(self.series(t)[:, 0])

    def rulings(self, t: Array) -> tuple[Array, Array]:
        """The images of c0(t) and of e(t), each (n, 2), at the cost of one."""
        at = self.series(t)
        return at[:, 1:3], _direction(at[:, 0])

    def axes(self, t: Array) -> tuple[Array, Array, Array]:
        """The images of c0(t), e(t) and m(t), each (n, 2)."""
        origin, e = self.rulings(t)
        return origin, e, np.column_stack([-e[:, 1], e[:, 0]])

    def points(self, t: Array, v: Array) -> Array:
        """The images of the surface points (t, v), each (n,), shape (n, 2)."""
        origin, direction = self.rulings(t)
        return np.asarray(origin + v[:, None] * direction)

    def grid(self, t: Array, fractions: Array, v_from: Array, v_to: Array) -> Array:
        """The images of k points on each of n rulings, at equal fractions of the extent.

        Returns (k, n, 2): [j, i] lies at fractions[j] of ruling i. fractions (k,), v_from and
        v_to (n,).
        """
        at = self.series(t)
        direction = _direction(at[:, 0])
        # rows as long as the memory allows: all rulings at once, x and y side by side
        first = (at[:, 1:3] + v_from[:, None] * direction).ravel()
        step = ((v_to - v_from)[:, None] * direction).ravel()
        out = np.multiply.outer(fractions, step)
        out += first
        return np.asarray(out.reshape(len(fractions), len(t), 2))

    def placed(self, omega: float, origin: Array) -> Development:
        """The development turned and moved so that it starts with this angle at this point."""
        first = self.series(self.series.knots[:1])[0]
        turn = omega - first[0]
        cos, sin = np.cos(turn), np.sin(turn)
        table = self.series.coefficients.copy()
        x, y = table[..., 1].copy(), table[..., 2].copy()
        table[..., 1] = cos * x - sin * y
        table[..., 2] = sin * x + cos * y
        table[:, 0, 0] += turn
        moved = np.array([[cos, -sin], [sin, cos]]) @ first[1:3]
        table[:, 0, 1:3] += origin - moved
        return Development(replace(self.series, coefficients=table))


def develop(patch: Patch, fibre: Fibre | None = None) -> Development:
    """Unroll a patch isometrically: the plane image of c0(t) and of the ruling e(t).

    Integrates omega' = a, X' = p cos(omega) - q sin(omega), Y' = p sin(omega) + q cos(omega)
    between the patch's breaks, to rounding. The bending c does not enter the shape; it is kept
    beside it. At the start c0 is the origin, e is +x and t grows towards +y. With a ``fibre`` it
    is the pattern of that neutral fibre (neutral.py), else of the surface itself.

    Not checked here: that the patch is developable and regular (see regularity.py).
    Source: geometry.md, 13; do Carmo, Differential Geometry of Curves and Surfaces, 4-4.
    """
    knots = patch.segments
    if fibre is not None:
        knots = np.array([knots[0], *fibre.breaks(patch), knots[-1]])
    span = knots[-1] - knots[0]

    def sample(t: Array, _low: float, _high: float) -> Array:
        frame = patch.frame(t)
        reach = np.maximum(np.abs(frame.v_from), np.abs(frame.v_to))
        q = frame.q if fibre is None else frame.q - fibre.shift(frame)
        return np.column_stack([frame.a, frame.p, q, frame.c, reach * frame.a])

    def lift(raw: Array, half: float) -> Array:
        a, p, q, c, _ = raw.T
        omega = half * (chebyshev.integration_of_values(len(a)) @ a)
        cos, sin = np.cos(omega), np.sin(omega)
        return np.column_stack([a, p * cos - q * sin, p * sin + q * cos, c])

    def scale(raw: Array) -> Array:
        # an angle is zero below rounding of a radian, a length below rounding of the strip's own;
        # the bending is no part of the shape and folds back within 1e-8: 1e-12 is enough for it
        seen = np.abs(raw).max(axis=0)
        length = max(seen[1], seen[2], seen[4])
        return np.array([1.0 / span, length, length, 100.0 * max(seen[3], 1.0 / span)])

    rates = chebyshev.resolve_by(sample, lift, knots, scale=scale)
    return Development(_assemble(rates))


def develop_chain(
    chain: Chain, fibres: Sequence[Fibre | None] = (), start: tuple[float, Array] | None = None
) -> tuple[Development, ...]:
    """The developments of a chain's patches, each laid on along the ruling it shares; of their
    neutral ``fibres``, where a patch has one. ``start`` is the angle of the first ruling and the
    place (2,) of c0 there, 0 and the origin where it is None."""
    out: list[Development] = []
    omega, origin = start or (0.0, np.zeros(2))
    for k, patch in enumerate(chain.patches):
        if k:
            origin = origin + chain.joints[k - 1].shift * _direction(np.array([omega]))[0]
        development = develop(patch, fibres[k] if fibres else None).placed(omega, origin)
        end = development.series(np.array([patch.domain[1]]))[0]
        omega, origin = float(end[0]), end[1:3]
        out.append(development)
    return tuple(out)


def _assemble(rates: Piecewise) -> Piecewise:
    """Panels' own turning and path, each from its own start, joined into one."""
    half = 0.5 * np.diff(rates.knots)
    size = rates.coefficients.shape[1]
    table = np.zeros((len(half), size + 1, 4))
    integration = chebyshev.integration(size)
    table[..., :3] = half[:, None, None] * np.einsum(
        "ij,pjd->pid", integration, rates.coefficients[..., :3]
    )
    table[:, :size, 3] = rates.coefficients[..., 3]
    ends = table[..., :3].sum(axis=1)  # T_k(1) = 1: turning and displacement of each panel
    omega = np.concatenate([[0.0], np.cumsum(ends[:-1, 0])])
    cos, sin = np.cos(omega), np.sin(omega)
    steps = np.column_stack(
        [cos * ends[:, 1] - sin * ends[:, 2], sin * ends[:, 1] + cos * ends[:, 2]]
    )
    starts = np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
    x, y = table[..., 1].copy(), table[..., 2].copy()
    table[..., 1] = cos[:, None] * x - sin[:, None] * y
    table[..., 2] = sin[:, None] * x + cos[:, None] * y
    table[:, 0, 0] += omega
    table[:, 0, 1:3] += starts
    return Piecewise(rates.knots, table, rates.samples)


def _direction(omega: Array) -> Array:
    return np.column_stack([np.cos(omega), np.sin(omega)])
