"""Sheets with holes and notches: closed bodies of the right genus, volume and distance."""

import manifold3d
import numpy as np
import pytest
import trimesh
from contours import ellipse, over_joint, polygon, track
from patches import frustum, helix_tangent, lens, prism, wall
from scipy.spatial import cKDTree

from devcad.flatten.development import develop_chain
from devcad.flatten.outline import surface_area
from devcad.geometry.chain import Chain, link
from devcad.geometry.cuts import Cut
from devcad.geometry.rulings import place
from devcad.mesh.build import build_mesh

TOLERANCE = 0.02
RADIUS, HEIGHT = 50.0, 100.0
SQUARE = np.array([[0, 0], [40, 0], [40, 30], [0, 30]], dtype=float)
PIPE = link((frustum(RADIUS, RADIUS, HEIGHT),), base_closed=True, tolerance=1.0)
DUCT = link(prism(SQUARE, 50.0), base_closed=True, tolerance=1.0)
GUTTER = link(prism(SQUARE, 50.0)[:3], base_closed=False, tolerance=1.0)
THIRDS = link(
    tuple(
        frustum(RADIUS, RADIUS, HEIGHT).restricted(a, b)
        for a, b in ((0, 2), (2, 5), (5, 2 * np.pi))
    ),
    base_closed=True,
    tolerance=1.0,
)


def mesh_of(chain, cuts, thickness=0.0, tolerance=TOLERANCE):
    layers = (-thickness / 2, thickness / 2) if thickness else (0.0,)
    developments = develop_chain(chain)
    placed = [place(p, layers, tolerance) for p in chain.patches]
    return build_mesh(
        chain,
        tuple(p.t for p in placed),
        layers,
        lambda k, t, v: developments[k].points(t, v),
        max(p.deviation for p in placed),
        tuple(cuts),
        tolerance,
    )


def welded(mesh):
    points = np.zeros((mesh.weld.max() + 1, 3))
    points[mesh.weld] = mesh.vertices
    np.testing.assert_array_equal(points[mesh.weld], mesh.vertices)  # equal to the bit
    return points, mesh.weld[mesh.triangles]


def facing(points, triangles):
    corner = points[triangles]
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def edges_of(triangles):
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(ends, axis=1), axis=0, return_counts=True)


def assert_solid(mesh, genus, volume, area):
    """A closed body without folds, its points apart in float32, its volume within tolerance."""
    points, triangles = welded(mesh)
    solid = manifold3d.Manifold(manifold3d.Mesh64(points, triangles.astype(np.uint64)))
    assert solid.status() == manifold3d.Error.NoError
    assert solid.genus() == genus
    assert solid.volume() == pytest.approx(volume, abs=area * TOLERANCE)
    assert trimesh.Trimesh(points, triangles, process=False).is_volume
    assert len(np.unique(points.astype(np.float32), axis=0)) == len(points)
    normals = facing(points, triangles)
    assert np.linalg.norm(normals, axis=1).min() > 0.0
    assert (np.einsum("ij,ikj->ik", normals, mesh.normals[mesh.triangles]) > 0.0).all()
    assert mesh.deviation <= TOLERANCE


CONE = frustum(80.0, 30.0, HEIGHT)
SLANT = float(np.hypot(50.0, HEIGHT))
SINGLE = {
    "pipe": (PIPE, [(0.3 + t, v, 6 / RADIUS, 6.0) for t in range(6) for v in (10.0, 52.0, 93.0)]),
    "cone": (
        link((CONE,), base_closed=True, tolerance=1.0),
        [(t, v, 0.2, 15.0) for t in (1.0, 3.0, 5.5) for v in (20.0, 70.0)],
    ),
    "sector": (Chain((frustum(80.0, 0.0, HEIGHT, 2.0),)), [(0.5, 60.0, 0.3, 40.0)]),
    "helix": (
        Chain((helix_tangent(30.0, 15.0, 200.0, (25.0, 80.0)),)),
        [(100.0, 50.0, 40.0, 20.0)],
    ),
    "lens": (Chain((lens(frustum(), (3.0, 60.0), (1.0, 40.0)),)), [(1.6, 61.0, 0.2, 10.0)]),
    "plate": (
        Chain((wall(np.zeros(3), np.array([100.0, 0.0, 0.0]), 80.0),)),
        [(0.1 + 0.2 * i, 10.0 + 20.0 * j, 0.05, 5.0) for i in range(5) for j in range(4)],
    ),
}


def hole_area(chain, cuts):
    """The integral of (q v + a v^2 / 2) dt around the holes: Green's formula for q + v a."""
    total = 0.0
    for item in (item for cut in cuts for item in cut.tracks):
        ends = np.linspace(*item.u, 2001)
        t, v, pace, _ = item(0.5 * (ends[1:] + ends[:-1]))
        frame = chain.patches[item.patch].frame(t)
        total += float(((frame.q * v + 0.5 * frame.a * v**2) * pace).sum() * (ends[1] - ends[0]))
    return abs(total)


@pytest.mark.parametrize("name", SINGLE)
def test_every_hole_is_a_handle_of_the_solid(name):
    chain, places = SINGLE[name]
    cuts = [ellipse(*each) for each in places]
    area = sum(surface_area(p) for p in chain.patches) - sum(hole_area(chain, [c]) for c in cuts)
    mesh = mesh_of(chain, cuts, 2.0)
    tip = 0.0
    if name == "sector":  # what the layers add at an apex (design.md, 7)
        frame = chain.patches[0].frame([1.0])
        tip = 2.0**3 / 24.0 * float(frame.c[0] ** 2 / abs(frame.a[0])) * 2.0
    assert_solid(mesh, len(cuts) + chain.closed, 2.0 * area + tip, area)


@pytest.mark.parametrize("name", SINGLE)
def test_every_hole_is_a_boundary_loop_of_the_sheet(name):
    chain, places = SINGLE[name]
    mesh = mesh_of(chain, [ellipse(*each) for each in places])
    _, triangles = welded(mesh)
    edges, count = edges_of(triangles)
    assert count.max() == 2
    vertices = len(np.unique(triangles))
    assert vertices - len(edges) + len(triangles) == 1 - chain.closed - len(places)
    border = edges[count == 1]
    loops = trimesh.graph.connected_components(border)
    assert len(loops) == len(places) + 1 + chain.closed
    assert len(np.unique(border)) == len(border)  # each a simple ring


JOINED = {
    "over the seam of a pipe": (PIPE, over_joint(0, 0, (2 * np.pi, 0.0), (0.2, 0.2), 50.0, 10.0)),
    "over the seam of three": (THIRDS, over_joint(2, 0, (2 * np.pi, 0.0), (0.2, 0.2), 50.0, 10.0)),
    "over a smooth joint": (THIRDS, over_joint(0, 1, (2.0, 2.0), (0.2, 0.2), 50.0, 10.0)),
    "over a crease": (DUCT, over_joint(0, 1, (1.0, 0.0), (0.25, 1.0 / 3.0), 25.0, 10.0)),
    "over a tube's last crease": (DUCT, over_joint(3, 0, (1.0, 0.0), (1 / 3, 0.25), 25.0, 10.0)),
    "over a gutter's crease": (GUTTER, over_joint(1, 2, (1.0, 0.0), (1 / 3, 0.25), 25.0, 10.0)),
    "round a whole patch": (DUCT, polygon(DUCT, (0.8, 5), (2.2, 5), (2.2, 40), (0.8, 40))),
    "a corner on a crease": (DUCT, polygon(DUCT, (1.0, 5), (1.5, 20), (1.0, 40), (0.5, 20))),
    "a side on a crease": (DUCT, polygon(DUCT, (1.0, 5), (1.5, 5), (1.5, 40), (1.0, 40))),
    "a side before a crease": (DUCT, polygon(DUCT, (0.5, 5), (1.0, 5), (1.0, 40), (0.5, 40))),
    "a point on a crease": (DUCT, ellipse(0.8, 25.0, 0.2, 8.0)),
    "a point on the seam": (PIPE, ellipse(0.2, 50.0, 0.2, 10.0)),
}


@pytest.mark.parametrize("thickness", [0.0, 2.0])
@pytest.mark.parametrize("name", JOINED)
def test_holes_cross_and_touch_joints(name, thickness):
    chain, cut = JOINED[name]
    area = sum(surface_area(p) for p in chain.patches) - hole_area(chain, [cut])
    mesh = mesh_of(chain, [cut], thickness)
    if thickness:
        assert_solid(mesh, 1 + chain.closed, thickness * area, area)
        return
    points, triangles = welded(mesh)
    edges, count = edges_of(triangles)
    assert count.max() == 2
    assert len(np.unique(triangles)) - len(edges) + len(triangles) == -int(chain.closed)
    covered = 0.5 * np.linalg.norm(facing(points, triangles), axis=1).sum()
    assert covered == pytest.approx(area, rel=2e-3)  # chords of 0.02 mm
    assert mesh.deviation <= TOLERANCE


def notch(chain, *corners):
    return polygon(chain, *corners, closed=False)


ROUND = 2.0 * np.pi * RADIUS
NOTCHES = {
    # trapezes: 0.12 and 0.08 of the circumference wide, between 20 and 30 mm deep
    "top": (
        PIPE,
        notch(PIPE, (0.4, HEIGHT), (0.42, 70.0), (0.5, 80.0), (0.52, HEIGHT)),
        ROUND * (0.02 * 15.0 + 0.08 * 25.0 + 0.02 * 10.0),
    ),
    "bottom": (
        PIPE,
        notch(PIPE, (0.52, 0.0), (0.5, 30.0), (0.42, 20.0), (0.4, 0.0)),
        ROUND * (0.02 * 15.0 + 0.08 * 25.0 + 0.02 * 10.0),
    ),
    "over the seam": (
        DUCT,
        notch(DUCT, (3.5, 50.0), (3.5, 20.0), (4.5, 20.0), (4.5, 50.0)),
        30.0 * (15.0 + 20.0),
    ),
    "between creases": (
        DUCT,
        notch(DUCT, (1.0, 50.0), (1.0, 20.0), (2.0, 20.0), (2.0, 50.0)),
        30.0 * 30.0,
    ),
    "from crease to crease": (DUCT, notch(DUCT, (2.0, 0.0), (1.5, 20.0), (1.0, 0.0)), 300.0),
    "first corner": (GUTTER, notch(GUTTER, (0.0, 30.0), (0.5, 30.0), (0.5, 50.0)), 400.0),
    "last corner": (GUTTER, notch(GUTTER, (3.0, 20.0), (2.5, 20.0), (2.5, 0.0)), 400.0),
    "into the first end": (
        GUTTER,
        notch(GUTTER, (0.0, 10.0), (0.5, 10.0), (0.5, 40.0), (0.0, 40.0)),
        20.0 * 30.0,
    ),
    # x = 0.5 lies 20 mm from the end, x = 1 and 1.25 lie 40 mm and 47.5 mm from it
    "all of the first end": (
        GUTTER,
        notch(GUTTER, (1.25, 0.0), (0.5, 20.0), (1.25, 50.0)),
        43.75 * (20.0 + 30.0) / 3.0 + 30.0 * (20.0 + 30.0) * 2.0 / 3.0,
    ),
}


@pytest.mark.parametrize("name", NOTCHES)
def test_notches_leave_a_closed_body(name):
    chain, cut, gone = NOTCHES[name]
    area = sum(surface_area(p) for p in chain.patches) - gone
    mesh = mesh_of(chain, [cut], 2.0)
    assert_solid(mesh, int(chain.closed), 2.0 * area, area)


def boundary_chords(mesh):
    """The ends of a sheet's border edges that are not on z = 0 or z = HEIGHT, (n, 2, 3)."""
    points, triangles = welded(mesh)
    edges, count = edges_of(triangles)
    chords = points[edges[count == 1]]
    inner = (chords[:, :, 2] > 1e-9) & (chords[:, :, 2] < HEIGHT - 1e-9)
    return chords[inner.all(axis=1)]


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.001])
def test_no_point_of_the_mesh_is_further_away_than_it_says(tolerance):
    cuts = [ellipse(0.3 + t, v, 0.3, 15.0) for t in range(6) for v in (20.0, 60.0)]
    mesh = mesh_of(PIPE, cuts, 0.0, tolerance)
    assert mesh.deviation <= tolerance
    corner = mesh.vertices[mesh.triangles]
    weight = np.random.default_rng(1).dirichlet(np.ones(3), 200)
    inside = np.einsum("wk,mkj->mwj", weight, corner)
    away = np.abs(np.hypot(inside[..., 0], inside[..., 1]) - RADIUS)
    assert away.max() <= mesh.deviation * (1.0 + 1e-9)
    u = np.linspace(0.0, 2.0 * np.pi, 20001)
    lines = []
    for cut in cuts:
        t, v, _, _ = cut.tracks[0](u)
        lines.append(np.column_stack([RADIUS * np.cos(t), RADIUS * np.sin(t), v]))
    chords = boundary_chords(mesh)
    share = np.linspace(0.0, 1.0, 21)[:, None, None]
    between = (1.0 - share) * chords[:, 0] + share * chords[:, 1]
    distance = distance_to(lines, between.reshape(-1, 3))
    steps = 2.5e-7  # steps of 5 um on a curve of 15 mm radius are 2e-7 mm away from it
    assert distance.max() <= mesh.deviation + steps
    assert distance_to(lines, chords.reshape(-1, 3)).max() <= steps  # their ends lie on it


def distance_to(lines, points):
    """The distances of points from closed polygons of many corners."""
    start = np.concatenate(lines)
    step = np.concatenate([np.roll(line, -1, axis=0) - line for line in lines])
    square = np.maximum((step**2).sum(axis=1), 1e-300)
    nearest = cKDTree(start).query(points, k=3)[1]
    away = points[:, None] - start[nearest]
    along = np.clip((away * step[nearest]).sum(axis=2) / square[nearest], 0.0, 1.0)
    return np.linalg.norm(away - along[..., None] * step[nearest], axis=2).min(axis=1)


def test_area_and_volume_converge_with_the_second_power_of_the_chords():
    # the distance of chords falls with their length squared, and so do what they miss
    cuts = [ellipse(1.0 + 2.0 * k, 50.0, 0.3, 20.0) for k in range(3)]
    area = 2.0 * np.pi * RADIUS * HEIGHT - 3.0 * np.pi * 0.3 * RADIUS * 20.0
    tolerances = np.array([0.05, 0.005, 0.0005])
    misses = []
    for tolerance in tolerances:
        sheet = facing(*welded(mesh_of(PIPE, cuts, 0.0, tolerance)))
        points, triangles = welded(mesh_of(PIPE, cuts, 4.0, tolerance))
        solid = trimesh.Trimesh(points, triangles, process=False)
        misses.append(
            [abs(0.5 * np.linalg.norm(sheet, axis=1).sum() - area), abs(solid.volume - 4.0 * area)]
        )
    orders = np.polyfit(np.log(tolerances), np.log(misses), 1)[0]
    # chords are whole numbers, and what skins lose holes win
    np.testing.assert_allclose(orders, 1.0, atol=0.15)


def test_strips_without_cuts_keep_their_triangles():
    cut = ellipse(2.0, 50.0, 0.2, 10.0)

    def triangles(mesh):
        return {row.tobytes() for row in mesh.vertices[mesh.triangles].reshape(-1, 9)}

    before, after = triangles(mesh_of(PIPE, [], 2.0)), triangles(mesh_of(PIPE, [cut], 2.0))
    gone = np.array([np.frombuffer(row) for row in before - after]).reshape(-1, 3, 3)
    strip = 2.0 * np.pi / (len(before) / 8)  # 2 triangles on 2 skins and 2 rims
    crossed = np.ceil(2.2 / strip) - np.floor(1.8 / strip)
    assert len(gone) == 4 * crossed  # on the skins alone
    angle = np.arctan2(gone[..., 1], gone[..., 0])
    assert np.abs(angle - 2.0).max() <= 0.2 + strip


@pytest.mark.parametrize("beyond", [1e-13, 1e-10, 1e-7, 1e-5])
def test_a_hole_that_barely_crosses_a_ruling_leaves_a_closed_body(beyond):
    t = place(PIPE.patches[0], (-1.0, 1.0), TOLERANCE).t
    reach = 0.7 * (t[8] - t[5])
    cut = ellipse(t[8] - reach + beyond, 50.0, reach, 20.0)
    area = 2.0 * np.pi * RADIUS * HEIGHT - np.pi * reach * RADIUS * 20.0
    assert_solid(mesh_of(PIPE, [cut], 2.0), 2, 2.0 * area, area)


def test_a_contour_may_begin_right_before_it_turns_back_over_a_ruling():
    t = place(PIPE.patches[0], (-1.0, 1.0), TOLERANCE).t
    reach = 0.7 * (t[8] - t[5])
    middle = t[8] - reach * (1.0 - 1e-4)  # it is beyond the ruling for -0.014 < u < 0.014

    def path(u):
        return middle + reach * np.cos(u), 50.0 + 20.0 * np.sin(u)

    cut = Cut("hole", (track(path, -0.03, 2.0 * np.pi - 0.03),), True)
    area = 2.0 * np.pi * RADIUS * HEIGHT - np.pi * reach * RADIUS * 20.0
    assert_solid(mesh_of(PIPE, [cut], 2.0), 2, 2.0 * area, area)


@pytest.mark.parametrize("gap", [0.2, 0.02, 0.002])
def test_webs_thinner_than_the_tolerance_do_not_fold(gap):
    chain = link((frustum(80.0, 30.0, HEIGHT),), base_closed=True, tolerance=1.0)
    # the rail bulges over its chords: a straight line in (t, v) beside it
    cut = polygon(chain, (0.3, gap), (0.3, 30.0), (0.2, 30.0), (0.2, gap))
    clockwise = Cut(
        "hole", polygon(chain, (0.2, gap), (0.3, gap), (0.3, 30.0), (0.2, 30.0)).tracks, True
    )
    area = surface_area(chain.patches[0]) - hole_area(chain, [cut])
    assert_solid(mesh_of(chain, [clockwise], 2.0), 2, 2.0 * area, area)


def random_star(rng, chain, x, v, rx, rv, grid):
    number = int(rng.integers(3, 8))
    angle = -np.linspace(0.0, 2.0 * np.pi, number, endpoint=False) + rng.uniform(0.0, 6.0)
    size = rng.uniform(0.5, 1.0, number)
    corners = np.stack([x + rx * size * np.sin(angle), v + rv * size * np.cos(angle)], axis=1)
    if grid:
        corners[:, 0] = np.round(corners[:, 0] * grid) / grid
    return [tuple(corner) for corner in corners]


SEEDS = [*range(12), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(12, 100))]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_stars_leave_the_right_volume(seed):
    """Also with corners and sides on rulings, joints and seams."""
    shapely = pytest.importorskip("shapely")
    rng = np.random.default_rng(seed)
    chain, height = [(PIPE, HEIGHT), (THIRDS, HEIGHT), (DUCT, 50.0), (GUTTER, 50.0)][seed % 4]
    patches = len(chain.patches)
    count, grid = int(rng.integers(1, 2 * patches + 3)), [0, 0, 4, 8][int(rng.integers(4))]
    start = rng.uniform(0.0, 1.0) if chain.closed else 0.0
    shapes, cuts = [], []
    for k in range(2 * count):
        x, v = start + (k // 2 + 0.5) * patches / count, height * (0.25 + 0.5 * (k % 2))
        corners = random_star(rng, chain, x, v, 0.4 * patches / count, 0.2 * height, grid)
        shape = shapely.Polygon(corners)
        moved = [shapely.affinity.translate(s, d) for s in shapes for d in (-patches, 0, patches)]
        inside = chain.closed or (shape.bounds[0] > 0.01 and shape.bounds[2] < patches - 0.01)
        if (
            inside
            and shape.is_valid
            and shape.area > 0.0
            and all(shape.distance(s) > 1e-3 for s in moved)
        ):
            shapes.append(shape)
            cuts.append(polygon(chain, *corners))
    area = sum(surface_area(p) for p in chain.patches) - sum(hole_area(chain, [c]) for c in cuts)
    mesh = mesh_of(chain, cuts, 1.0)
    assert_solid(mesh, len(cuts) + chain.closed, area, area)
