"""Shapes to lay, the sheets to lay them on, and what the tests measure of the result."""

from __future__ import annotations

import numpy as np
from patches import prism

from devcad.features import Cutout, Drill, Features, Mark, Placing
from devcad.flatten.development import develop_chain
from devcad.flatten.laying import laid
from devcad.geometry.chain import Chain, link
from devcad.geometry.cuts import Cut
from devcad.geometry.edge import Edge
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array


def arc(centre: tuple[float, float], radius: float, start: float, sweep: float) -> Edge:
    """A circular arc, counterclockwise, by its angle."""

    def curve(u: Array) -> tuple[Array, Array]:
        way = np.column_stack([np.cos(u), np.sin(u)])
        return centre + radius * way, radius * np.column_stack([-way[:, 1], way[:, 0]])

    return Edge("CUT", curve, np.array([start, start + sweep]))


def segment(a: Array, b: Array) -> Edge:
    """The straight line from a to b, by its share."""

    def curve(u: Array) -> tuple[Array, Array]:
        return a + u[:, None] * (b - a), np.repeat((b - a)[None], len(u), axis=0)

    return Edge("CUT", curve, np.array([0.0, 1.0]))


def circle(radius: float) -> tuple[Edge, ...]:
    return (arc((0.0, 0.0), radius, 0.0, 2.0 * np.pi),)


def polygon(points: list[tuple[float, float]]) -> tuple[Edge, ...]:
    corners = np.array(points, dtype=float)
    return tuple(segment(a, b) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True))


def rectangle(width: float, height: float) -> tuple[Edge, ...]:
    x, y = 0.5 * width, 0.5 * height
    return polygon([(-x, -y), (x, -y), (x, y), (-x, y)])


def slot(length: float, width: float) -> tuple[Edge, ...]:
    x, r = 0.5 * (length - width), 0.5 * width
    return (
        segment(np.array([-x, -r]), np.array([x, -r])),
        arc((x, 0.0), r, -0.5 * np.pi, np.pi),
        segment(np.array([x, r]), np.array([-x, r])),
        arc((-x, 0.0), r, 0.5 * np.pi, np.pi),
    )


def slot_area(length: float, width: float) -> float:
    return (length - width) * width + 0.25 * np.pi * width**2


def duct(side: float = 100.0, height: float = 100.0) -> Chain:
    """A square prism without ends: four planes, folded by 90 degrees, e upwards."""
    corners = side * np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    return link(prism(corners, height), base_closed=True, tolerance=1e-3)


def tube(patch: Patch) -> Chain:
    return link((patch,), base_closed=True, tolerance=1e-3)


def cuts(chain: Chain, *features: Cutout | Drill) -> tuple[Cut, ...]:
    return laid(Features(cutouts=features), chain, develop_chain(chain))[0]


def drawings(chain: Chain, *marks: Mark):  # type: ignore[no-untyped-def]
    return laid(Features(marks=marks), chain, develop_chain(chain))[1]


def hole(contour: tuple[Edge, ...], x: float, y: float, angle: float = 0.0, **more: bool) -> Cutout:
    """A cutout at a place of the pattern."""
    return Cutout("hole", contour, Placing(at=(x, y), angle=angle), **more)


def on_surface(contour: tuple[Edge, ...], ft: float, fv: float, angle: float = 0.0) -> Cutout:
    return Cutout("hole", contour, Placing(at_surface=(ft, fv), angle=angle))


def unrolled(cut: Cut, chain: Chain, per_panel: int = 40) -> tuple[Array, Array, Array]:
    """Points of a cut in the pattern, unrolled over the seam of a tube, with dP/du and Gauss
    weights, in the order of its run; every point relative to the first one's place."""
    developments = develop_chain(chain)
    x, w = np.polynomial.legendre.leggauss(per_panel)
    points, slopes, weights = [], [], []
    turn, shift = np.eye(2), np.zeros(2)
    last: Array | None = None
    for track in cut.tracks:
        series = developments[track.patch].series
        rates = series.derivative()

        def image(u: Array, track=track, series=series):  # type: ignore[no-untyped-def]
            t, v, dt, dv = track(u)
            return t, v, dt, dv, series(t)

        _, v, _, _, at = image(np.array(track.u))
        ends = at[:, 1:3] + v[:, None] * np.column_stack([np.cos(at[:, 0]), np.sin(at[:, 0])])
        if last is not None and np.abs(turn @ ends[0] + shift - last).max() > 1e-6:
            options = [(turn @ r, turn @ s + shift) for r, s in _motions(chain)]
            far = [float(np.abs(r @ ends[0] + s - last).max()) for r, s in options]
            turn, shift = options[int(np.argmin(far))]
        last = turn @ ends[1] + shift
        for a, b in zip(track.series.knots[:-1], track.series.knots[1:], strict=True):
            t, v, dt, dv, at = image(0.5 * (a + b) + 0.5 * (b - a) * x)
            e = np.column_stack([np.cos(at[:, 0]), np.sin(at[:, 0])])
            m = np.column_stack([-e[:, 1], e[:, 0]])
            rate = rates(t)
            p = at[:, 1:3] + v[:, None] * e
            dp = dt[:, None] * (rate[:, 1:3] + (v * rate[:, 0])[:, None] * m) + dv[:, None] * e
            points.append(p @ turn.T + shift)
            slopes.append(dp @ turn.T)
            weights.append(0.5 * (b - a) * w)
    return np.concatenate(points), np.concatenate(slopes), np.concatenate(weights)


def _motions(chain: Chain) -> list[tuple[Array, Array]]:
    """The motion from a tube's pattern to the next turn of it, and the motion back."""
    developments = develop_chain(chain)
    start = developments[0].series(np.array([chain.patches[0].domain[0]]))[0]
    end = developments[-1].series(np.array([chain.patches[-1].domain[1]]))[0]
    assert chain.closing is not None
    angle = end[0] - start[0]
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    along = chain.closing.shift * np.array([np.cos(end[0]), np.sin(end[0])])
    shift = end[1:3] + along - rotation @ start[1:3]
    return [(rotation, shift), (rotation.T, -rotation.T @ shift)]


def area(cut: Cut, chain: Chain) -> float:
    """What a closed cut goes round clockwise in the pattern, by Green's theorem."""
    points, slopes, weights = unrolled(cut, chain)
    away = points - points[0]
    return -0.5 * float(weights @ (away[:, 0] * slopes[:, 1] - away[:, 1] * slopes[:, 0]))


def gaps(cut: Cut, chain: Chain) -> float:
    """The largest distance in space from the end of a track to the start of the next one."""
    ends = []
    for track in cut.tracks:
        places = track.series(np.array(track.u))
        ends.append(chain.patches[track.patch].point(places[:, 0], places[:, 1]))
    following = ends[1:] + (ends[:1] if cut.closed else [])
    return max(
        (float(np.linalg.norm(a[1] - b[0])) for a, b in zip(ends, following, strict=False)),
        default=0.0,
    )


def space_points(cut: Cut, chain: Chain, number: int = 101) -> Array:
    """Points of a cut in space, (n, 3), ``number`` on each track."""
    parts = []
    for track in cut.tracks:
        t, v, _, _ = track(np.linspace(*track.u, number))
        parts.append(chain.patches[track.patch].point(t, v))
    return np.concatenate(parts)
