"""Certified placement: never above the tolerance, never far below, by independent distances."""

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent, slanted_pipe

import devcad
from devcad.geometry.rulings import place

PARTS = {
    "frustum": frustum(),
    "helix": helix_tangent(30.0, 15.0, 200.0, (25.0, 80.0)),
    "ellipse": ellipse_cylinder(100.0, 60.0, 50.0),
    "pipe": slanted_pipe(40.0),
}


def distance_to_triangles(points, patch, t):
    """Brute force: distances of points (n, 3) to the strip's triangles, by projection."""
    f = patch.frame(t)
    a, b = f.c0 + f.v_from[:, None] * f.e, f.c0 + f.v_to[:, None] * f.e
    triangles = np.concatenate(
        [np.stack([a[:-1], b[:-1], b[1:]], axis=1), np.stack([a[:-1], b[1:], a[1:]], axis=1)]
    )
    return np.array([point_triangles(p, triangles) for p in points])


def point_triangles(p, tri):
    """The distance from one point to the nearest of many triangles (Ericson, 5.1.5)."""
    origin, u, w = tri[:, 0], tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0]
    n = np.cross(u, w)
    n2 = (n**2).sum(axis=1)
    x = p - origin
    s = np.einsum("ij,ij->i", np.cross(x, w), n) / n2
    r = np.einsum("ij,ij->i", np.cross(u, x), n) / n2
    inside = (s >= 0) & (r >= 0) & (s + r <= 1)
    best = np.abs(np.einsum("ij,ij->i", x, n))[inside] / np.sqrt(n2[inside])
    nearest = best.min() if len(best) else np.inf
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, along = tri[:, i], tri[:, j] - tri[:, i]
        share = np.clip(((p - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
        nearest = min(nearest, np.linalg.norm(p - start - share[:, None] * along, axis=1).min())
    return nearest


@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("tolerance", [0.05, 0.01])
def test_measured_distance_stays_below_the_tolerance_and_uses_most_of_it(name, tolerance):
    patch = PARTS[name]
    placed = place(patch, (0.0,), tolerance)
    assert placed.deviation <= tolerance
    rng = np.random.default_rng(11)
    strip = rng.integers(0, len(placed.t) - 1, 300)
    # the sagitta is largest near the middle of a strip; both boundaries and the inside
    share = np.concatenate([np.full(150, 0.5), rng.random(150)])
    t = placed.t[strip] + share * np.diff(placed.t)[strip]
    f = patch.frame(t)
    measured = 0.0
    for height in (0.0, 1.0, 0.37):
        points = patch.point(t, f.v_from + height * (f.v_to - f.v_from))
        measured = max(measured, distance_to_triangles(points, patch, placed.t).max())
    assert measured <= tolerance
    if len(placed.t) > 16:
        assert measured >= 0.85 * tolerance


@pytest.mark.parametrize("name", PARTS)
def test_one_ruling_fewer_would_break_the_tolerance(name):
    patch, tolerance = PARTS[name], 0.02
    few = place(patch, (0.0,), tolerance)
    fewer = place(patch, (0.0,), tolerance * (len(few.t) / (len(few.t) - 2.2)) ** 2)
    assert len(fewer.t) < len(few.t)
    assert fewer.deviation > 0.95 * tolerance


def test_a_strip_never_turns_by_more_than_thirty_degrees():
    placed = place(frustum(), (0.0,), 50.0)
    assert len(placed.t) - 1 == 12  # 360 degrees of ruling and normal together
    f = frustum().frame(placed.t)
    turns = np.degrees(np.arccos((f.n[1:] * f.n[:-1]).sum(axis=1)))
    assert turns.max() <= 30.0 + 1e-9


def test_the_number_of_strips_grows_as_one_over_the_root_of_the_tolerance():
    count = [len(place(PARTS["ellipse"], (0.0,), tol).t) - 1 for tol in (0.1, 0.001)]
    assert count[1] / count[0] == pytest.approx(10.0, rel=0.03)


def test_thick_sheets_are_as_close_on_both_skins():
    patch, tolerance = frustum(), 0.05
    placed = place(patch, (-5.0, 5.0), tolerance)
    for d in (-5.0, 5.0):
        skin = patch.parallel(d)
        t = 0.5 * (placed.t[1:] + placed.t[:-1])[:40]
        points = skin.point(t, skin.frame(t).v_from)
        assert distance_to_triangles(points, skin, placed.t).max() <= tolerance


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_scaling_part_and_tolerance_together_changes_no_parameter(scale):
    one = place(frustum(), (0.0,), 0.05)
    other = place(frustum().scaled(scale), (0.0,), 0.05 * scale)
    np.testing.assert_allclose(other.t, one.t, atol=1e-9)


def test_breaks_do_not_leave_a_patch_of_many_strips_below_its_tolerance(tmp_path):
    # three fillets that would each need a fraction more than a whole number of strips
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "job"\ntolerance = 0.2\n[surface]\nkind = "cylinder"\nlength = 50\n'
        'direction = [0, 0, 1]\n[surface.directrix]\nkind = "polyline"\nclosed = true\n'
        "corner_radius = 40\npoints = [[0, 0, 0], [400, 0, 0], [200, 300, 0]]\n"
    )
    (panel,) = devcad.build(job).panels
    (t,) = panel.rulings
    assert len(t) - 1 >= 16
    assert 0.85 * 0.2 <= panel.mesh.deviation <= 0.2


@pytest.mark.slow
def test_an_edge_that_waves_three_hundred_times_is_seen(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "job"\ntolerance = 0.1\n[surface]\nkind = "cylinder"\nradius = 300\n'
        'extent = [0, "60 + 4*sin(300*t)"]\n'
    )
    (panel,) = devcad.build(job).panels
    (t,) = panel.rulings
    patch = panel.chain.patches[0]
    assert len(t) > 6 * 300  # no wave without its strips
    # sagitta of every chord on the wavy edge, at places of their own
    middle = t[:-1] + 0.37 * np.diff(t)
    ends, points = (patch.point(x, patch.frame(x).v_to) for x in (t, middle))
    away = points - (ends[:-1] + 0.37 * np.diff(ends, axis=0))
    chord = np.diff(ends, axis=0)
    chord /= np.linalg.norm(chord, axis=1)[:, None]
    across = np.linalg.norm(away - (away * chord).sum(axis=1)[:, None] * chord, axis=1)
    assert across.max() <= 0.1
