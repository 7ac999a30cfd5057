"""The rigid motion that lays one surface best on another, and how far the two are apart then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.flatten.bending import Index, Rulings
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array, rows_dot

LOOKS = 5
"""Rulings of a patch whose distance from the other surface is measured."""
ALIGNMENTS, STILL = 20, 1e-9
"""Steps to the best motion, and the share of the squares below which a gain ends them."""
ASIDE, WEAK = 1e-9, 1e-5
"""Of the size: a foot lies beside its point by more; of the strongest: a motion that hardly changes
any distance."""
SHARPENINGS = 8
"""Steps from the least squares to the least of the largest distances."""
STEPS = 12
"""Newton's steps to the foot of a perpendicular."""
SAME = 1e-12
"""Relative: distances that differ by less are one, as on both sides of a joint."""
SHORTER = 0.125
"""Of a step that led farther away the next one."""


def misfit(
    smooth: Chain, patches: Sequence[Patch], homes: Sequence[tuple[int, float, float]]
) -> tuple[float, Array]:
    """The largest distance in mm of ``patches`` from the smooth surface, and the rigid motion
    (4, 4) of theirs with which it is measured.

    The motion makes the largest distance least, as seen along the smooth surface's normals: from
    the least squares on by linear programs. A motion of that surface along itself, as of a
    cylinder about its axis, is not made.

    Args:
        homes: of each patch the number of the smooth patch and the parameters near to which its
            first and last rulings lie.
    """
    points, start = _samples(smooth, patches, homes)
    centre = points.mean(axis=0)
    size = float(np.abs(points - centre).max())
    motion, best = np.eye(4), _apart(smooth, points, start)
    for solve, rounds in ((_least_squares, ALIGNMENTS), (_least_largest, SHARPENINGS)):
        sharp, reach = solve is _least_largest, 2.0
        for _ in range(rounds):
            arm, way = (best.points - centre) / size, best.ways(ASIDE * size)
            rows = np.concatenate([np.cross(arm, way), way], axis=1)
            step = solve(rows, rows_dot(way, best.gap), reach)
            tried = _small(step[:3] / size, step[3:], centre) @ motion
            found = _apart(smooth, _moved(tried, points), best.rulings)
            gained = found.largest if sharp else found.squares
            had = best.largest if sharp else best.squares
            if gained < had:
                motion, best = tried, found
            elif sharp:
                reach *= 0.25  # too far for what is straight only nearby
                continue
            if gained >= (1.0 - STILL) * had:
                break
    return best.largest, motion


@dataclass(frozen=True, slots=True)
class _Apart:
    """Points (n, 3), the rulings of their feet, the normals there, and the ways to their feet."""

    points: Array
    rulings: Rulings
    n: Array
    gap: Array

    def ways(self, aside: float) -> Array:
        """The directions in which the distances are measured: the normals, and straight to the foot
        where that is an edge's, by more than ``aside`` in mm not below the point."""
        beyond = np.linalg.norm(np.cross(self.gap, self.n), axis=1) > aside
        out = self.n.copy()
        out[beyond] = self.gap[beyond] / np.linalg.norm(self.gap[beyond], axis=1)[:, None]
        return out

    @property
    def squares(self) -> float:
        return float((self.gap**2).sum())

    @property
    def largest(self) -> float:
        return float(np.linalg.norm(self.gap, axis=1).max())


def _apart(smooth: Chain, points: Array, near: Rulings) -> _Apart:
    rulings = feet(smooth, points, near)
    frame = _frames(smooth, rulings)
    v = np.clip(rows_dot(points - frame.c0, frame.e), frame.v_from, frame.v_to)
    gap = frame.c0 + v[:, None] * frame.e - points
    return _Apart(points, rulings, frame.n, gap)


def _least_squares(rows: Array, away: Array, _reach: float) -> Array:
    step, *_ = np.linalg.lstsq(rows, away, rcond=WEAK)
    return np.asarray(step)


def _least_largest(rows: Array, away: Array, reach: float) -> Array:
    """The step (6,) after which the largest of the distances |away - rows @ step| is least, of
    those no longer than ``reach`` times the largest."""
    from scipy.optimize import linprog

    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    felt = directions[sizes > WEAK * sizes[0]]
    table, most = rows @ felt.T, float(np.abs(away).max())
    if most == 0.0:
        return np.zeros(6)
    column = -np.ones((len(away), 1))
    found = linprog(
        np.append(np.zeros(len(felt)), 1.0),
        np.block([[table, column], [-table, column]]),
        np.concatenate([away, -away]) / most,
        bounds=[(-reach, reach)] * len(felt) + [(0.0, None)],
    )
    return np.zeros(6) if found.x is None else np.asarray(most * (found.x[:-1] @ felt))


def feet(chain: Chain, points: Array, near: Rulings) -> Rulings:
    """The rulings on which the feet of points (n, 3) on a chain lie, each looked for from the
    ruling ``near`` to it (n,) and held at the chain's ends. A step that leads farther away, as
    beside a regression curve, is made shorter."""
    best, distance, step = near, np.full(len(points), np.inf), np.zeros(len(points))
    tried = near
    for _ in range(STEPS):
        frame = _frames(chain, tried)
        away = points - frame.c0
        along, height = rows_dot(away, frame.e), rows_dot(away, frame.n)
        v = np.clip(along, frame.v_from, frame.v_to)
        ahead = rows_dot(away, frame.m)
        found = np.sqrt((along - v) ** 2 + ahead**2 + height**2)
        closer = found <= distance * (1.0 + SAME)
        width = frame.q + frame.a * v - frame.c * height
        with np.errstate(all="ignore"):  # where nothing bends a step may have no bound
            newton = np.nan_to_num(np.where(width > 0.0, ahead / width, 0.0))
        distance = np.where(closer, found, distance)
        step = np.where(closer, newton, SHORTER * step)
        best = Rulings(np.where(closer, tried.patch, best.patch), np.where(closer, tried.t, best.t))
        tried, step = _advanced(chain, best, step)
    return best


def _advanced(chain: Chain, at: Rulings, step: Array) -> tuple[Rulings, Array]:
    """The rulings a step (n,) further, at most to the next joint, over it from there on; and the
    steps, at most a quarter of a patch."""
    domains = np.array([p.domain for p in chain.patches])
    low, high = domains[at.patch].T
    step = np.clip(step, -0.25 * (high - low), 0.25 * (high - low))
    aim = at.t + step
    over, under = (aim > high) & (at.t == high), (aim < low) & (at.t == low)
    t = np.clip(aim, low, high)
    on, back = over & (at.patch < len(domains) - 1), under & (at.patch > 0)
    patch = at.patch + on - back
    return Rulings(
        patch, np.where(on, domains[patch, 0], np.where(back, domains[patch, 1], t))
    ), step


def _samples(
    smooth: Chain, patches: Sequence[Patch], homes: Sequence[tuple[int, float, float]]
) -> tuple[Array, Rulings]:
    """Points on both edges of the patches and between them, and the rulings to begin with."""
    points: list[Array] = []
    number: list[Index] = []
    start: list[Array] = []
    for patch, (home, low, high) in zip(patches, homes, strict=True):
        t = np.linspace(*patch.domain, LOOKS)
        t[0], t[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
        jet = patch.jet(t, 0)
        ends = [jet.c0[0] + v[:, None] * jet.e[0] for v in (jet.v_from[0], jet.v_to[0])]
        points += [ends[0], 0.5 * (ends[0] + ends[1]), ends[1]]
        number.append(np.full(3 * LOOKS, home))
        start.append(
            np.tile(np.clip(np.linspace(low, high, LOOKS), *smooth.patches[home].domain), 3)
        )
    return np.concatenate(points), Rulings(np.concatenate(number), np.concatenate(start))


def _frames(chain: Chain, rulings: Rulings) -> Frame:
    """The frames of rulings, asked just inside the patches."""

    def table(number: int, t: Array) -> Array:
        patch = chain.patches[number]
        low, high = patch.domain
        f = patch.frame(np.clip(t, np.nextafter(low, high), np.nextafter(high, low)))
        columns = (f.a, f.c, f.p, f.q, f.v_from, f.v_to)
        return np.column_stack([f.c0, f.e, f.m, f.n, *columns])

    x = rulings.of(table)
    c0, e, m, n = (x[:, 3 * k : 3 * k + 3] for k in range(4))
    a, c, p, q, v_from, v_to = x[:, 12:].T
    zero = np.zeros(len(x))
    return Frame(rulings.t, c0, e, m, n, a, c, p, q, v_from, v_to, zero, zero)


def _moved(motion: Array, points: Array) -> Array:
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def _small(turn: Array, shift: Array, centre: Array) -> Array:
    """The rotation by the vector ``turn`` about a centre, then the shift, (4, 4)."""
    angle = float(np.linalg.norm(turn))
    out = np.eye(4)
    if angle > 0.0:
        x, y, z = turn / angle
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        out[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    out[:3, 3] = centre - out[:3, :3] @ centre + shift
    return out
