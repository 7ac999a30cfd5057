"""Where the layers of thick facets between sharp creases end: planes intersected, areas kept."""

from itertools import pairwise

import numpy as np
import pytest
from patches import wall

from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.layers import layer_ends, layer_points, layer_width, pull_of
from devcad.geometry.patch import Patch, RulingJet


def plate(start, heading, width, reach=(0.0, 60.0)):
    """From ``start`` along ``heading`` (3,), rulings along z from 3 sin y/9 to a slanted or waved
    edge."""

    def field(t, order):
        y = taylor.variable(t, order)
        c0 = taylor.constant_vector(np.asarray(start), order, t.size)
        c0 = c0 + y[..., None] * np.asarray(heading)
        low = reach[0] + 3.0 * taylor.sin_cos(y / 9.0)[0]
        high = taylor.constant(reach[1], order, t.size) + 0.2 * y
        return RulingJet(c0, taylor.constant_vector([0.0, 0.0, 1.0], order, t.size), low, high)

    return Patch(field, (0.0, width))


def folded(width, *angles):
    """Plates one after another, each ``width`` wide, turned by these angles."""
    start, heading, out = np.zeros(3), 0.0, []
    for k in range(len(angles) + 1):
        way = np.array([np.cos(heading), np.sin(heading), 0.0])
        out.append(plate(start, way, width, (0.0, 60.0 + 0.2 * width * k)))
        start, heading = start + width * way, heading + (angles[k] if k < len(angles) else 0.0)
    return out


WIDTH = 18.0 * np.pi  # a whole wave, so that neighbours share their rulings
GENTLE = link(tuple(folded(WIDTH, 0.2, 0.25)), base_closed=False, tolerance=0.05)
STRONG = link(tuple(folded(WIDTH, 2.4, -1.2)), base_closed=False, tolerance=0.05)


@pytest.mark.parametrize("chain", [GENTLE, STRONG])
@pytest.mark.parametrize("distance", [-0.8, 0.8])
def test_layers_of_neighbours_meet_where_their_planes_and_the_rulings_plane_do(chain, distance):
    for k in (0, 1):
        ends = []
        for number, row in ((k, -1), (k + 1, 0)):
            patch = chain.patches[number]
            frame = patch.frame(np.linspace(*patch.domain, 7))
            ends.append([rail[row] for rail in layer_ends(chain, number, frame, distance)])
        before, after = (chain.patches[k].frame(WIDTH), chain.patches[k + 1].frame(0.0))
        for side, v in enumerate((after.v_from, after.v_to)):
            point = after.c0[0] + v[0] * after.e[0]
            planes = np.stack([before.n[0], after.n[0], after.e[0]])
            expected = point + np.linalg.solve(planes, [distance, distance, 0.0])
            np.testing.assert_allclose(ends[0][side], expected, atol=1e-12)
            np.testing.assert_allclose(ends[1][side], expected, atol=1e-12)


def enclosed(points, normal):
    """The area of a closed polygon (n, 3)."""
    return 0.5 * float(np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0) @ normal)


@pytest.mark.parametrize("chain", [GENTLE, STRONG])
def test_what_one_layer_has_more_the_other_has_less(chain):
    # so the prismatoid between them is area x thickness; polygons of equal points keep that law
    patch = chain.patches[1]
    t = np.linspace(*patch.domain, 301)
    t[0], t[-1] = np.nextafter(t[0], 1.0), np.nextafter(t[-1], 0.0)
    frame = patch.frame(t)
    areas = []
    for distance in (-2.0, 0.0, 2.0):
        low, high = layer_ends(chain, 1, frame, distance)
        areas.append(enclosed(np.concatenate([high, low[::-1]]), -frame.n[0]))
    assert areas[0] != pytest.approx(areas[1], rel=1e-4)
    assert 0.5 * (areas[0] + areas[2]) == pytest.approx(areas[1], rel=1e-13)


@pytest.mark.parametrize("chain", [GENTLE, STRONG])
def test_a_hole_keeps_its_area_on_average_too(chain):
    u = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    t, v = 8.0 + 7.9 * np.sin(u), 30.0 + 12.0 * np.cos(u)  # almost to the crease
    normal = chain.patches[1].frame(1.0).n[0]
    areas = [enclosed(layer_points(chain, 1, t, v, d), normal) for d in (-2.0, 0.0, 2.0)]
    assert 0.5 * (areas[0] + areas[2]) == pytest.approx(areas[1], rel=1e-13)


def test_the_walls_beyond_the_reach_of_a_strong_crease_stand_square():
    patch = STRONG.patches[0]
    t = np.linspace(0.0, WIDTH, 101)[1:-1]
    away = layer_points(STRONG, 0, t, np.full(99, 30.0), 0.8) - patch.point(t, np.full(99, 30.0))
    leaning = np.linalg.norm(away - 0.8 * patch.frame(t).n, axis=1)
    reach = 8.0 * 0.8 * np.tan(1.2)
    assert (leaning[t < WIDTH - 1.01 * reach] == 0.0).all()
    assert (np.diff(leaning[t > WIDTH - reach]) > 0.0).all()


def test_a_straight_edge_between_gentle_creases_stays_straight():
    patch = GENTLE.patches[1]
    frame = patch.frame(np.linspace(0.01, WIDTH - 0.01, 41))
    _, high = layer_ends(GENTLE, 1, frame, 0.8)
    inner = high[1:-1]
    chord = (inner[-1] - inner[0]) / np.linalg.norm(inner[-1] - inner[0])
    off = np.linalg.norm(np.cross(inner - inner[0], chord), axis=1)
    assert off.max() < 1e-12 and np.ptp(inner @ chord) > 50.0


def test_straight_sided_plates_need_no_pull_and_say_what_their_mitres_take():
    # a U of width w between two creases of angle x: the inner skin is T tan(x / 2) narrower
    width, angle = 5.0, 1.3
    headings = angle * np.arange(3)
    steps = np.array([40.0, width, 40.0])[:, None] * np.stack(
        [np.cos(headings), np.sin(headings), np.zeros(3)], axis=1
    )
    corners = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    walls = [wall(a, b, 30.0) for a, b in pairwise(corners)]
    chain = link(tuple(walls), base_closed=False, tolerance=0.05)
    assert pull_of(chain, 1, 0.8) is None
    found, taken, _ = layer_width(chain, 1, 0.8)
    assert found == pytest.approx(width, rel=1e-12)
    assert taken == pytest.approx(1.6 * np.tan(angle / 2), rel=1e-12)
    assert layer_width(Chain(chain.patches[:1]), 0, 0.8)[1] == 0.0
