"""Bitangent pairs: points of two curves (or of one) that share a tangent plane.

At parameters (s, t) the points a(s), b(t) have a common tangent plane through their line where
G(s, t) = det(a'(s), b'(t), a(s) - b(t)) = 0. On one curve (b = a) G has a fourfold zero on the
diagonal; there H = G / (t - s)^4 = det(E, F, V) of the means between s and t (``rails``).

Source: geometry.md, section 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.bitangents.rails import Rail
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Pairs:
    """The function whose zeros are the pairs of two rails, or of one with itself.

    All its methods take parameters as they come, beyond their periods too.
    """

    first: Rail
    second: Rail
    same: bool

    def series(self, s: Array, t: Array) -> Array:
        """G, or H on one curve, as a series along the series s and t, each (K + 1, n)."""
        if self.same:
            return self._deflated(s, t)
        a, da = self.first.along(s, 1)
        b, db = self.second.along(t, 1)
        return _det(da, db, a - b)

    def value(self, s: Array, t: Array) -> Array:
        """G or H at n places."""
        return np.asarray(self.series(s[None], t[None])[0])

    def slopes(self, s: Array, t: Array) -> tuple[Array, Array]:
        """The value and the gradient, (n,) and (n, 2)."""
        one = self.towards(s, t, 1.0, 0.0, 1)
        two = self.towards(s, t, 0.0, 1.0, 1)
        return one[0], np.column_stack([one[1], two[1]])

    def bends(self, s: Array, t: Array) -> tuple[Array, Array, Array]:
        """The value, the gradient and the Hessian, (n,), (n, 2) and (n, 2, 2)."""
        one, two = self.towards(s, t, 1.0, 0.0, 2), self.towards(s, t, 0.0, 1.0, 2)
        mixed = self.towards(s, t, 1.0, 1.0, 2)[2] - one[2] - two[2]
        hessian = np.array([[2.0 * one[2], mixed], [mixed, 2.0 * two[2]]])
        return one[0], np.column_stack([one[1], two[1]]), np.moveaxis(hessian, 2, 0)

    def towards(self, s: Array, t: Array, ds: float, dt: float, order: int) -> Array:
        """The series along a straight line through each place."""
        path = np.zeros((2, order + 1, len(s)))
        path[0, 0], path[1, 0], path[0, 1], path[1, 1] = s, t, ds, dt
        return self.series(path[0], path[1])

    def size(self, s: Array, t: Array) -> Array:
        """How large the value would be if nothing cancelled, (n,)."""
        a, b = self.first.jet(s, 3), self.second.jet(t, 3)
        one, two = np.linalg.norm(a, axis=2), np.linalg.norm(b, axis=2)
        apart = np.linalg.norm(a[0] - b[0], axis=1)
        if not self.same:
            return np.asarray(one[1] * two[1] * apart)
        h = 0.5 * np.abs(self.first.wrapped(s, t))
        span = self.first.curve.domain[1] - self.first.curve.domain[0]
        speed = np.maximum(one[1], two[1])
        far = speed**2 * apart / np.maximum(2.0 * h, 1e-9 * span) ** 4
        bend = np.maximum(one[2] + two[2], 0.01 * speed / span)
        wind = np.maximum(one[3] + two[3], 0.01 * speed / span**2)
        return np.asarray(
            np.where(h < np.interp(*self.first.middle(s, t)), speed * bend * wind, far)
        )

    def ruling(self, s: Array, t: Array) -> tuple[Array, Array, Array]:
        """The series of a(s), of the unit direction to b(t) and of the distance, along series.

        On one curve s <= t <= s + period: at a tip, where both are the same, the direction is
        that of the rulings before it.
        """
        c0 = self.first.along(s)[0]
        if not self.same:
            way = self.second.along(t)[0] - c0
            return c0, taylor.unit(way), taylor.norm(way)
        # by the nearer way round, told by s < t < s + period: at a tip s = t to rounding only
        back = 2.0 * (t[0] - s[0]) > self.first.period
        back &= bool(self.first.period)
        low, high = np.where(back, t, s), np.where(back, s, t)
        away = self.first.wrapped(low[0], high[0])
        low[0] = self.first.inside(low[0])
        high[0] = low[0] + away
        mean = self.first.means(low, high, 1)[0]
        e = taylor.unit(mean) * np.where(back, -1.0, 1.0)[None, :, None]
        length = taylor.mul(taylor.norm(mean), high - low)
        length[0] = np.maximum(length[0], 0.0)
        return c0, e, length

    def leaving(self, place: Array, x: Array, rates: Array) -> tuple[Array, Array]:
        """Beside a place (2,) where the curves meet, with (s, t) = place + x rates, x (K + 1, n)
        and rates (K + 1, n, 2) series: the series of -G / x^2 and of W = (b(t) - a(s)) / x.

        Nothing cancels: with the chords A, B and A', B' from the place (``Rail.chord``), a' = A +
        ds A', W = beta B - alpha A, and det(a', b', W) loses all terms without x by itself.
        """
        alpha, beta = rates[..., 0], rates[..., 1]
        ds, dt = taylor.mul(x, alpha), taylor.mul(x, beta)
        a, a_turn = self.first.chord(float(place[0]), ds)
        b, b_turn = self.second.chord(float(place[1]), dt)
        both = taylor.cross(a_turn, b_turn)
        one = _det(a, b_turn, b) + taylor.mul(ds, taylor.dot(both, b))
        two = _det(a_turn, b, a) + taylor.mul(dt, taylor.dot(both, a))
        beta_beta, alpha_alpha = taylor.mul(beta, beta), taylor.mul(alpha, alpha)
        value = taylor.mul(beta_beta, one) - taylor.mul(alpha_alpha, two)
        return value, taylor.mul(beta, b) - taylor.mul(alpha, a)

    def _deflated(self, s: Array, t: Array) -> Array:
        """H on one curve: the same for (s, t), (t, s) and both moved by periods."""
        away = self.first.wrapped(s[0], t[0])
        low, high = np.where(away < 0.0, t, s), np.where(away < 0.0, s, t)
        low[0] = self.first.inside(low[0])
        high[0] = low[0] + np.abs(away)
        return _det(*self.first.means(low, high, 3))


def _det(x: Array, y: Array, z: Array) -> Array:
    """The determinant of three vector series."""
    return taylor.dot(x, taylor.cross(y, z))
