"""How a sheet with curved creases folds, as rigid bodies: every ruling of every flank is one.

While the sheet folds its rulings stay where they are in the pattern, so that what lies on one of
them moves as a rigid body. The bodies of the first flank hang on one another, each by a small
motion that depends smoothly on how far the sheet is unrolled: a polynomial through exact poses.
Those of any other flank turn about the crease's tangent in the pattern, at the ruling that they
share with their parent's, by the fold angle. So every crease is closed and every ruling keeps its
length, whatever is done with these numbers; what is exact at the poses alone is how the rulings of
a flank lie to one another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.blank import Blank
from devcad.flatten.flanks import Hanging
from devcad.flatten.fold import fold_chain
from devcad.flatten.foldings import creases, family, largest_sine
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import transform
from devcad.geometry.creasing import heading
from devcad.geometry.patch import Frame
from devcad.geometry.taylor import Array
from devcad.mesh.hinged import Hinged, hinged, rotation, turning
from devcad.part import Panel

FEWEST, MOST = 5, 65
"""Poses between the part and its pattern that the polynomials go through."""
RESOLVED = 1e-6
"""Radians, and share of the sheet's size: the sum of what the last terms of all polynomials say."""

Motions = Array
"""(flanks, rulings, 3, 4): what carries each ruling of each flank from the pattern into space."""


@dataclass(frozen=True, slots=True)
class Score:
    """A crease on its r rulings: ``points`` (r, 2) and the unit tangents ``along`` (r, 2) in the
    pattern. Its flank is turned against its ``parent`` about ``along``, as the right hand shows, by
    twice the angle whose sine is mu times ``sines`` (r,); ``mus`` are the mu at the poses."""

    parent: int
    points: Array
    along: Array
    sines: Array
    mus: Array


@dataclass(frozen=True, slots=True)
class Creased:
    """The bodies of a sheet and their motion while f goes from 0, as built, to 1, the pattern.

    ``strips`` are the flanks as built. Flank k + 1 hangs on ``scores[k]``. ``poses`` (p,) are the f
    of the poses, ``steps`` (p, r - 1, 6) the motions of the first flank's body k + 1 against body k
    there: the vector of its turn, and by how much its point of the first score is moved. The body
    ``anchor`` of the first flank turns evenly, and its point of that score goes straight.
    ``built`` are all motions as built. Where the sheet has no such motion ``poses`` is empty, and
    ``why`` says so.
    """

    strips: tuple[Hinged, ...]
    scores: tuple[Score, ...]
    poses: Array
    steps: Array
    anchor: int
    built: Motions
    why: str = ""

    @property
    def moves(self) -> bool:
        """Whether the sheet can fold."""
        return bool(len(self.poses))

    def motions(self, f: float, shift: tuple[float, float] = (0.0, 0.0)) -> Motions:
        """The motions at f; at 1 the pattern lies ``shift`` from its own place, in z = 0."""
        if not self.moves:
            return self.built
        out = np.empty_like(self.built)
        share = weights(self.poses, f)
        steps = np.einsum("p,pkj->kj", share, self.steps)
        first, point = self.scores[0], np.append(self.scores[0].points[self.anchor], 0.0)
        start = self.built[0, self.anchor]
        turn = rotation(turning(start[:, :3]) * (1.0 - f))
        place = (1.0 - f) * (start[:, :3] @ point + start[:, 3]) + f * (point + np.append(shift, 0))
        out[0, self.anchor] = np.column_stack([turn, place - turn @ point])
        r = self.built.shape[1]
        for k in range(self.anchor, r - 1):
            out[0, k + 1] = _composed(out[0, k], step_motion(steps[k], first.points[k + 1]))
        for k in range(self.anchor - 1, -1, -1):
            back = inverse(step_motion(steps[k], first.points[k + 1]))
            out[0, k] = _composed(out[0, k + 1], back)
        for number, score in enumerate(self.scores, start=1):
            about = turned_about(score, float(share @ score.mus))
            turns, rest = about[:, :, :3], about[:, :, 3:]
            before = out[score.parent]
            out[number, :, :, :3] = before[:, :, :3] @ turns
            out[number, :, :, 3:] = before[:, :, :3] @ rest + before[:, :, 3:]
        return out


def creased(panel: Panel) -> Creased:
    """The bodies of a panel with flanks."""
    blanks = [flank.blank for flank in panel.flanks if flank.blank is not None]
    hangings: list[Hanging] = [(fold.parent, fold.child, fold.side) for fold in panel.folds]
    stations = _stations(panel)
    strips = tuple(hinged(flank.chain, flank.rulings, flank.places) for flank in panel.flanks)
    built = np.array(
        [
            np.concatenate(
                [
                    carried(flank.chain.patches[k].frame(t), blank, k, t)
                    for k, t in enumerate(stations)
                ]
            )
            for flank, blank in zip(panel.flanks, blanks, strict=True)
        ]
    )
    anchor = built.shape[1] // 2
    chains = [flank.chain for flank in panel.flanks]
    why = ""
    try:
        poses, steps, mus = _posed(blanks, hangings, chains, stations)
    except GeometryError as error:
        poses, steps, mus = np.zeros(0), np.zeros((0, 0, 6)), np.zeros((0, len(hangings)))
        why = error.what
    scores = tuple(
        _score(blanks, chains, hanging, stations, mu)
        for hanging, mu in zip(hangings, mus.T, strict=True)
    )
    return Creased(strips, scores, poses, steps, anchor, built, why)


def carried(frame: Frame, blank: Blank, number: int, t: Array) -> Array:
    """The motions (n, 3, 4) from the pattern to a patch's ``frame`` at t (n,)."""
    e, zero = blank.developments[number].direction(t), np.zeros(len(t))
    flat = np.stack(
        [
            np.column_stack([e, zero]),
            np.column_stack([-e[:, 1], e[:, 0], zero]),
            np.column_stack([zero, zero, zero + 1.0]),
        ],
        axis=1,
    )
    turn = np.einsum("nki,nkj->nij", np.stack([frame.e, frame.m, frame.n], axis=1), flat)
    origin = np.column_stack([blank.developments[number].origin(t), zero])
    place = frame.c0 - np.einsum("nij,nj->ni", turn, origin)
    return np.concatenate([turn, place[:, :, None]], axis=2)


def turned_about(score: Score, mu: float) -> Array:
    """The motions (r, 3, 4) of a flank's bodies against their parents', in the pattern."""
    turns = 2.0 * np.arcsin(np.clip(mu * score.sines, -1.0, 1.0))
    out = np.empty((len(turns), 3, 4))
    for k, turn in enumerate(turns.tolist()):
        point = np.append(score.points[k], 0.0)
        out[k, :, :3] = rotation(np.append(score.along[k], 0.0) * turn)
        out[k, :, 3] = point - out[k, :, :3] @ point
    return out


def step_motion(step: Array, point: Array) -> Array:
    """The motion (3, 4) that turns by a vector, and moves a ``point`` (2,) of the pattern."""
    turn, point = rotation(step[:3]), np.append(point, 0.0)
    return np.column_stack([turn, point + step[3:] - turn @ point])


def weights(poses: Array, f: float) -> Array:
    """What the values at the Chebyshev extrema ``poses`` count at f: the sum is the polynomial.

    Source: Berrut and Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004) 501.
    """
    away = f - poses
    if (away == 0.0).any():
        return np.asarray(away == 0.0, dtype=float)
    signs = (-1.0) ** np.arange(len(poses))
    signs[[0, -1]] *= 0.5
    out = signs / away
    return np.asarray(out / out.sum())


def inverse(motion: Array) -> Array:
    """The motion (3, 4) back."""
    turn = motion[:, :3].T
    return np.column_stack([turn, -turn @ motion[:, 3]])


def _composed(first: Array, then: Array) -> Array:
    """The motion ``first`` after ``then``, which acts in the moved place."""
    return np.column_stack([first[:, :3] @ then[:, :3], first[:, :3] @ then[:, 3] + first[:, 3]])


# --- the poses ------------------------------------------------------------------------------


def _stations(panel: Panel) -> list[Array]:
    """The parameters of the rulings patch by patch, within the patch; neighbours share the ruling
    at their joint, as in a hinged strip."""
    out = []
    for number, t in enumerate(panel.rulings):
        inside = t.copy()
        inside[0], inside[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
        out.append(inside[1 if number else 0 :])
    return out


def _posed(
    blanks: Sequence[Blank],
    hangings: Sequence[Hanging],
    chains: Sequence[Chain],
    stations: Sequence[Array],
) -> tuple[Array, Array, Array]:
    """The f of the poses, the steps there, and the mus of all creases against those as built.

    Raises:
        GeometryError: several creases let no motion be.
    """
    middles = [blank.middle for blank in blanks]
    goal = _bend(middles, hangings, chains)
    whole = np.array(family(middles, hangings, goal if goal else 1.0)[1])
    points = _flat_score(blanks, hangings[0], stations)[0]
    size = float(np.ptp(points, axis=0).max())
    known: dict[float, tuple[Array, Array]] = {1.0: (np.zeros((len(points) - 1, 6)), 0.0 * whole)}

    def pose(f: float) -> tuple[Array, Array]:
        bends, sines = family(middles, hangings, goal * (1.0 - f))
        start = middles[0].patches[0].frame(stations[0][:1])
        folded = fold_chain(blanks[0].developments, middles[0], start, bends[0])
        every = zip(folded, stations, strict=True)
        motions = np.concatenate([each.motion(t).reshape(-1, 3, 4) for each, t in every])
        return _steps(motions, points), np.asarray(sines) / whole

    count = FEWEST
    while True:  # every other pose is one of those before
        poses = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / (count - 1))
        names = [round(f, 12) for f in poses.tolist()]
        known |= {name: pose(f) for name, f in zip(names, poses, strict=True) if name not in known}
        steps = np.array([known[name][0] for name in names])
        mus = np.array([known[name][1] for name in names])
        tail = np.einsum("mp,pkj->mkj", transform(count)[-2:], steps) / [1, 1, 1, size, size, size]
        if count >= MOST or float(np.abs(tail).sum()) <= RESOLVED:
            return poses, steps, mus
        count = 2 * count - 1


def _bend(middles: Sequence[Chain], hangings: Sequence[Hanging], chains: Sequence[Chain]) -> float:
    """How far the sheet is folded as built, 0 to 1: its largest fold angle along the first crease,
    as a share of what it is folded to the end."""
    whole, built = (
        np.arcsin(max(largest_sine(crease) for crease in creases(each, hangings[0])))
        for each in (middles, chains)
    )
    return min(float(built / whole), 1.0)


def _steps(motions: Array, points: Array) -> Array:
    """The motions of bodies (r, 3, 4) against the ones before, each by less than half a turn:
    (r - 1, 6)."""
    back = motions[:-1, :, :3].swapaxes(1, 2)
    turn = back @ motions[1:, :, :3]
    there = np.einsum("nij,nj->ni", motions[1:, :, :2], points[1:]) + motions[1:, :, 3]
    moved = np.einsum("nij,nj->ni", back, there - motions[:-1, :, 3])
    moved[:, :2] -= points[1:]
    skew = np.stack([turn[:, j, i] - turn[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, np.trace(turn, axis1=1, axis2=2) - 1.0)
    size = np.divide(angle, sine, out=np.full(len(sine), 0.5), where=sine > 0.0)
    return np.concatenate([skew * size[:, None], moved], axis=1)


def _score(
    blanks: Sequence[Blank],
    chains: Sequence[Chain],
    hanging: Hanging,
    stations: Sequence[Array],
    mus: Array,
) -> Score:
    points, along = _flat_score(blanks, hanging, stations)
    angles = np.concatenate(
        [c.fold_angle(t) for c, t in zip(creases(chains, hanging), stations, strict=True)]
    )
    turn = 1.0 if hanging[2] == "base" else -1.0
    return Score(hanging[0], points, along, turn * np.sin(0.5 * angles), mus)


def _flat_score(
    blanks: Sequence[Blank], hanging: Hanging, stations: Sequence[Array]
) -> tuple[Array, Array]:
    """The points and unit tangents (r, 2) of a crease in the pattern, as its child develops it."""
    blank = blanks[hanging[1]]
    points, along = [], []
    for patch, development, t in zip(
        blank.middle.patches, blank.developments, stations, strict=True
    ):
        theta = heading(patch.frame(t), np.zeros(len(t)))[:, None]
        e = development.direction(t)
        points.append(development.origin(t))
        along.append(np.cos(theta) * e + np.sin(theta) * np.column_stack([-e[:, 1], e[:, 0]]))
    return np.concatenate(points), np.concatenate(along)
