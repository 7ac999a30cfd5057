"""The net of a sheet: nodes on its own rulings, in the pattern and in the built part alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.geometry.chain import Chain
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.simulate.settings import MOST_NODES, EdgeName, Simulation

Numbers = NDArray[np.intp]

LEAST_CELLS = 16
"""Along the sheet where the job says nothing: a folded annulus is right to 0.1 % with as many."""
MOST_ACROSS = 8
"""Cells along a strip's rulings where the job says nothing."""
FINE = 64
"""Samples of a patch between which a length is measured."""
ONE = 1e-9
"""Nodes nearer than this share of the sheet's size are one."""
THIN = 1e-2
"""Of the usual room between two rulings: with less of it, one of the two is left out."""
SHARP = 1e-6
"""Radians: a ruling between two patches that turns by more is a crease."""


@dataclass(frozen=True, slots=True)
class Net:
    """Nodes of a sheet and the cells between them.

    ``flat`` (n, 2) are the nodes in the pattern, ``built`` (n, 3) the same material points of the
    built part, mm. ``quads`` (m, 4) and ``triangles`` (k, 3) run counterclockwise in the pattern;
    ``strips`` (m + k,) tells the flank of each, quads first, from the left. ``creases`` (c, 2) are
    pairs of nodes on curved creases and on straight ones. ``edges`` are the nodes along each
    border in order, ``inner`` those of the row beside it. ``frame`` (4, 3) is where the pattern
    lies before it folds: its origin, X, Y and front. ``address`` (n, 4) tells flank, patch, t and v
    of every node.
    """

    flat: Array
    built: Array
    quads: Numbers
    triangles: Numbers
    strips: Numbers
    creases: Numbers
    edges: Mapping[EdgeName, Numbers]
    inner: Mapping[EdgeName, Numbers]
    frame: Array
    address: Array

    def on(self, chains: Sequence[Chain]) -> Array:
        """The same material points (n, 3) on other shapes of the flanks."""
        out = np.empty_like(self.built)
        numbers = self.address[:, :2].astype(int)
        for flank, patch in np.unique(numbers, axis=0).tolist():
            here = (numbers == (flank, patch)).all(axis=1)
            t, v = self.address[here, 2:].T
            out[here] = chains[flank].patches[patch].point(t, v)
        return out

    @property
    def laid(self) -> Array:
        """The nodes (n, 3) of the flat sheet in the tangent plane at the part's start."""
        return np.asarray(self.frame[0] + self.flat @ self.frame[1:3])

    @property
    def faces(self) -> Numbers:
        """The cells as triangles (f, 3), and ``face_strips`` has their flanks."""
        a, b, c, d = self.quads.T
        halves = np.stack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)], 1).reshape(-1, 3)
        return np.concatenate([halves, self.triangles])

    @property
    def face_strips(self) -> Numbers:
        """The flank (f,) of each of ``faces``."""
        m = len(self.quads)
        return np.concatenate([np.repeat(self.strips[:m], 2), self.strips[m:]])


def net_of(panel: Panel, how: Simulation) -> Net:
    """The net of a panel: rows of nodes on its rulings, evenly divided on every strip.

    The rows are the panel's certified rulings, halved until there are 16 cells, or ``how.cells``
    cells of equal length along the crease or the middle; every break between patches is a row.
    Where the job says nothing, cells of a folded sheet reach from crease to crease, so that its
    rulings stay straight, and those of another panel are about square. A closed sheet stays open
    along the cut of its pattern. Cutouts are not in the net.

    Raises:
        GeometryError: more nodes than ``MOST_NODES``.
    """
    flanks = _left_to_right(panel)
    rows = _rows(panel, flanks, how)
    counts = [how.across or (1 if panel.folds else _across(panel, rows)) for _ in flanks]
    total = (sum(len(t) - 1 for t in rows) + 1) * (sum(counts) + 1)
    if total > MOST_NODES:
        raise GeometryError(
            f"the simulation would have {total} nodes, limit {MOST_NODES}",
            value=float(total),
            limit=float(MOST_NODES),
            place="simulate.cells",
            remedy="give fewer cells and across in [simulate]",
        )
    columns: list[Array] = []
    for place, (k, count) in enumerate(zip(flanks, counts, strict=True)):
        columns += _columns(panel, k, count, rows)[min(place, 1) :]
    return _knit(panel, np.stack(columns, axis=1), counts, rows)  # (rows, columns, 9)


def _left_to_right(panel: Panel) -> list[int]:
    """The numbers of the flanks in their order across the sheet."""
    order = [0]
    for fold in panel.folds:
        at = order.index(fold.parent)
        order.insert(at if fold.side == "base" else at + 1, fold.child)
    return order


def _rows(panel: Panel, flanks: list[int], how: Simulation) -> list[Array]:
    """The parameters of the rows, patch by patch, ends included."""
    first = panel.chains[0]
    if how.cells is None:
        rows = [_spread(first, k, np.asarray(t)) for k, t in enumerate(first.rulings)]
        while sum(len(t) - 1 for t in rows) < LEAST_CELLS:
            rows = [np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])])) for t in rows]
        return rows
    along = []
    for k, patch in enumerate(first.chain.patches):
        t = np.linspace(*patch.domain, FINE + 1)
        ends = [_ends(panel, number, k, t) for number in flanks]
        low, high = ends[flanks.index(0)]
        middle = low if panel.folds else 0.5 * (low + high)
        places = first.places(k, t, middle)
        along.append((t, np.append(0.0, np.linalg.norm(np.diff(places, axis=0), axis=1).cumsum())))
    lengths = np.array([s[-1] for _, s in along])
    shares = _shared(how.cells, lengths)
    return [
        np.interp(np.linspace(0.0, s[-1], n + 1), s, t)
        if s[-1] > 0.0
        else np.linspace(t[0], t[-1], n + 1)
        for (t, s), n in zip(along, shares, strict=True)
    ]


def _spread(flank: Panel, patch: int, t: Array) -> Array:
    """The rulings of a patch without those that leave hardly any room between them, at one end at
    least, as near a tip: a sliver's stiffness is rounding."""
    jet = flank.chain.patches[patch].jet(t, 0)
    low, high = (flank.places(patch, t, v) for v in (jet.v_from[0], jet.v_to[0]))

    def room(i: int, j: int) -> float:
        """The smallest triangle between two rulings, those of no width left out."""
        corners = np.array([low[i], high[i], high[j], low[j]])
        before, after = (
            np.roll(corners, 1, axis=0) - corners,
            np.roll(corners, -1, axis=0) - corners,
        )
        twice = np.abs(after[:, 0] * before[:, 1] - after[:, 1] * before[:, 0])
        wide = (np.linalg.norm(before, axis=1) > 0.0) & (np.linalg.norm(after, axis=1) > 0.0)
        return 0.5 * float(twice[wide].min(initial=np.inf))

    rooms = np.array([room(i, i + 1) for i in range(len(t) - 1)])
    least = THIN * float(np.median(rooms))
    kept = [0]
    for j in range(1, len(t) - 1):
        if room(kept[-1], j) > least:
            kept.append(j)
    while len(kept) > 1 and room(kept[-1], len(t) - 1) <= least:
        kept.pop()
    return t[[*kept, len(t) - 1]]


def _shared(count: int, lengths: Array) -> list[int]:
    """Whole numbers in proportion to lengths, at least 1 each, that sum up to ``count`` or more."""
    wanted = lengths / max(float(lengths.sum()), 1e-300) * count
    out = np.maximum(np.floor(wanted), 1).astype(int)
    for k in np.argsort(out - wanted, kind="stable")[: max(count - int(out.sum()), 0)]:
        out[k] += 1
    return [int(n) for n in out]


def _ends(panel: Panel, number: int, patch: int, t: Array) -> tuple[Array, Array]:
    """Where the rulings of a flank begin and end, (n,) each: at its creases, whatever the groove
    leaves, and at its borders."""
    flank = panel.chains[number]
    whole = flank.blank.middle if panel.folds and flank.blank is not None else flank.chain
    jet = whole.patches[patch].jet(t, 0)
    low, high = jet.v_from[0].copy(), jet.v_to[0].copy()
    for fold in panel.folds:
        if fold.child == number:  # its crease is its base curve
            (high if fold.side == "base" else low)[:] = 0.0
        elif fold.parent == number:
            child = panel.chains[fold.child].chain.patches[patch].jet(t, 0)
            own = flank.chain.patches[patch].jet(t, 0)
            v = np.einsum("ni,ni->n", child.c0[0] - own.c0[0], own.e[0])
            (low if fold.side == "base" else high)[:] = v
    return low, high


def _across(flank: Panel, rows: list[Array]) -> int:
    """How many cells along the rulings make them about square."""
    widths, lengths = [], []
    for k, t in enumerate(rows):
        jet = flank.chain.patches[k].jet(t, 0)
        width = jet.v_to[0] - jet.v_from[0]
        middle = flank.places(k, t, jet.v_from[0] + 0.5 * width)
        widths.append(0.5 * (width[1:] + width[:-1]))
        lengths.append(np.linalg.norm(np.diff(middle, axis=0), axis=1))
    width, length = float(np.concatenate(widths).mean()), float(np.concatenate(lengths).mean())
    return int(np.clip(round(width / length) if length > 0.0 else 1, 1, MOST_ACROSS))


def _columns(panel: Panel, number: int, count: int, rows: list[Array]) -> list[Array]:
    """The columns of nodes of a flank, from left to right: (rows, 9) places in the pattern, in
    space, and addresses."""
    flank = panel.chains[number]
    out: list[list[Array]] = [[] for _ in range(count + 1)]
    for k, t in enumerate(rows):
        kept = t if k == len(rows) - 1 else t[:-1]  # a joint belongs to the patch after it
        low, high = _ends(panel, number, k, kept)
        patch = flank.chain.patches[k]
        for j in range(count + 1):
            v = low + (high - low) * (j / count)
            flat, built = flank.places(k, kept, v), patch.point(kept, v)
            own = np.broadcast_to(np.array([number, k], dtype=float), (len(kept), 2))
            out[j].append(np.column_stack([flat, built, own, kept, v]))
    return [np.concatenate(column) for column in out]


def _knit(panel: Panel, nodes: Array, counts: list[int], rows: list[Array]) -> Net:
    """The net of a grid of nodes (rows, columns, 9), those that coincide made one."""
    height, width = nodes.shape[:2]
    numbers = _merged(nodes[..., :2])
    _, first = np.unique(numbers, return_index=True)
    grid = numbers.reshape(height, width)
    strip = np.repeat(np.arange(len(counts)), counts)
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1)
    quads, triangles, strips = _cells(corners.reshape(-1, 4), np.tile(strip, height - 1))
    columns = np.cumsum(counts)[:-1]
    ends = np.cumsum([len(t) - 1 for t in rows])[:-1]
    pairs = _creases(panel, grid, columns, ends)
    kept = nodes.reshape(-1, nodes.shape[2])[first]
    return Net(
        flat=kept[:, :2],
        built=kept[:, 2:5],
        quads=quads,
        triangles=triangles,
        strips=strips,
        creases=pairs,
        edges={**_borders(grid, 0), "crease": np.unique(pairs)},
        inner=_borders(grid, 1),
        frame=_frame(panel.chains[0], float(rows[0][0])),
        address=kept[:, 5:],
    )


def _creases(panel: Panel, grid: Numbers, columns: Numbers, ends: Numbers) -> Numbers:
    """The pairs (c, 2) of nodes on creases: columns between two strips, and rulings between two
    patches that meet at an angle."""
    pairs = [np.stack([grid[:-1, j], grid[1:, j]], axis=1) for j in columns]
    bounds = [0, *columns, grid.shape[1] - 1]
    for place, k in enumerate(_left_to_right(panel)):
        row = grid[:, bounds[place] : bounds[place + 1] + 1]
        for i, joint in zip(ends, panel.chains[k].chain.joints, strict=True):
            if abs(joint.angle) > SHARP:
                pairs.append(np.stack([row[i, :-1], row[i, 1:]], axis=1))
    out = np.concatenate([np.zeros((0, 2), np.intp), *pairs])
    return np.asarray(out[out[:, 0] != out[:, 1]], dtype=np.intp)


def _borders(grid: Numbers, row: int) -> dict[EdgeName, Numbers]:
    """The nodes along each border of the grid, or of the row beside it."""
    sides: dict[EdgeName, Numbers] = {
        "start": grid[row],
        "end": grid[-1 - row],
        "base": grid[:, row],
        "top": grid[:, -1 - row],
    }
    return {name: _once(nodes) for name, nodes in sides.items()}


def _frame(first: Panel, start: float) -> Array:
    """Where the pattern's origin, X, Y and front are in the part, (4, 3): the start ruling and its
    tangent plane stay where they are built."""
    patch = first.chain.patches[0]
    frame = patch.frame([start])
    ends = first.places(0, np.array([start, start]), np.array([0.0, 1.0]))
    x = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    e, m, n = frame.e[0], frame.m[0], frame.n[0]
    across, along = x[0] * e - x[1] * m, x[1] * e + x[0] * m  # the pattern's X and Y
    origin = patch.point([start], [0.0])[0] - ends[0, 0] * across - ends[0, 1] * along
    return np.stack([origin, across, along, n])


def _merged(flat: Array) -> Numbers:
    """A number for each node of the grid from 0 on, the same for neighbours at one place."""
    height, width = flat.shape[:2]
    near = ONE * float(np.ptp(flat.reshape(-1, 2), axis=0).max())
    numbers = np.arange(height * width).reshape(height, width)
    across = np.linalg.norm(np.diff(flat, axis=1), axis=2) <= near
    along = np.linalg.norm(np.diff(flat, axis=0), axis=2) <= near
    if not (across.any() or along.any()):
        return numbers.ravel()
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    one = np.concatenate([numbers[:, :-1][across], numbers[:-1][along]])
    other = np.concatenate([numbers[:, 1:][across], numbers[1:][along]])
    graph = coo_array((np.ones(len(one)), (one, other)), shape=(numbers.size, numbers.size))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.intp)


def _cells(corners: Numbers, strip: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Quads, triangles where two corners are one, and the flank of each; cells without an area
    are left out."""
    same = corners == np.roll(corners, -1, axis=1)
    whole = ~same.any(axis=1)
    three = same.sum(axis=1) == 1
    rows = corners[three]
    drop = same[three].argmax(axis=1)
    order = (drop[:, None] + np.arange(1, 4)) % 4
    triangles = np.take_along_axis(rows, order, axis=1)
    return corners[whole], triangles, np.concatenate([strip[whole], strip[three]])


def _once(nodes: Numbers) -> Numbers:
    """The nodes in their order, each once."""
    first = np.unique(nodes, return_index=True)[1]
    return np.asarray(nodes[np.sort(first)], dtype=np.intp)
