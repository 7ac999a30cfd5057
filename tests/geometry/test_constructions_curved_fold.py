"""Sheets folded along curved creases: cones and cylinders known in closed form, and reflections."""

from __future__ import annotations

import re

import numpy as np
import pytest
from constructing import build, refusal
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.spatial.transform import Rotation
from strategies import scales

from devcad.errors import DevcadError
from devcad.flatten.development import develop

ARC = {"kind": "circle", "radius": 100, "sweep": 180}
WAVE = {"kind": "expression", "x": "100*t", "y": "20*sin(3*t)", "z": 0, "t": [0, 4]}
HELIX = {"kind": "helix", "radius": 60, "pitch": 90, "turns": 0.6}
BENT = {  # an arc of 60 degrees, then straight
    "kind": "polyline",
    "points": [[0, 0, 0], [60, 0, 0], [60, 60, 0]],
    "corner_radius": 30,
}


def sheet(**table):
    """The chains of patches of a folded sheet."""
    (panel,) = build(kind="curved-fold", **table).panels
    return [panel.patches, *(flank.patches for flank in panel.flanks)]


def one(chain, t):
    """The jet and the frame of a chain of one patch."""
    (patch,) = chain
    return patch.jet(t, 2), patch.frame(t)


def along(jet):
    """T, and the acceleration per length with its tangential part, of the curve v = 0."""
    speed = np.linalg.norm(jet.c0[1], axis=1)[:, None]
    return jet.c0[1] / speed, 2.0 * jet.c0[2] / speed**2


def dot(x, y):
    return np.einsum("ij,ij->i", x, y)


SHEETS = {
    "annulus": {"flat_crease": ARC, "fold": 60, "extent": [-20, 20]},
    "mountain": {"flat_crease": ARC, "fold": "-60 - 5*t", "extent": [-20, 20]},
    "backwards": {"flat_crease": ARC | {"sweep": -180}, "fold": 60, "extent": [-20, 20]},
    "almost flat": {"flat_crease": ARC, "fold": 1e-3, "extent": [-20, 20]},
    "almost shut": {"flat_crease": ARC, "fold": "176 + 2*sin(t)", "extent": [-5, 5]},
    "screw": {"crease": HELIX, "angle": "35 + 5*sin(t)", "extent": [-15, 15]},
    "ring": {"crease": {"kind": "circle", "radius": 100}, "angle": 30, "extent": [-20, 20]},
    "twisted": {"flat_crease": ARC, "fold": 60, "torsion": 0.001, "extent": [-20, 20]},
    "leaning": {"flat_crease": ARC, "fold": "60 + 3*t", "ruling": "80 + 5*t", "extent": [-20, 20]},
    "inflections": {"flat_crease": WAVE, "fold": 70, "extent": [-4, 4]},
    "inflections, varying": {
        "flat_crease": WAVE,
        "fold": "70 + 5*sin(3*t)**2",
        "torsion": "1e-4*sin(3*t)",
        "extent": [-4, 4],
    },
    "inflections, leaning": {
        "flat_crease": WAVE,
        "fold": 70,
        "ruling": "80 + 4*cos(3*t)",
        "extent": [-4, 4],
    },
    "tiny": {"flat_crease": ARC | {"radius": 0.1}, "fold": "60 + 3*t", "extent": [-0.02, 0.02]},
    "huge": {"flat_crease": ARC | {"radius": 1e4}, "fold": "60 + 3*t", "extent": [-200, 200]},
}


@pytest.mark.parametrize("name", SHEETS)
def test_a_crease_folds_two_developables_by_twice_alpha_and_bends_them_alike(name):
    table = SHEETS[name]
    right, left = sheet(**table)
    (patch,) = right
    t = np.linspace(*patch.domain, 401)
    (jet_r, r), (jet_l, f) = one(right, t), one(left, t)
    for frame in (r, f):
        scale = np.abs(frame.a).max() + np.abs(frame.c).max()
        assert np.abs(frame.residual_e).max() <= 1e-15 * scale + 1e-18
        assert np.abs(frame.residual_c0).max() <= 1e-15 * frame.q.max()
        assert (frame.q > 0).all()
    np.testing.assert_array_equal(jet_r.c0, jet_l.c0)
    tangent, turning = along(jet_r)
    geodesic = [dot(turning, np.cross(frame.n, tangent)) for frame in (r, f)]
    np.testing.assert_allclose(*geodesic, rtol=0, atol=1e-13 * np.abs(geodesic[0]).max())
    normal = [dot(turning, frame.n) for frame in (r, f)]
    np.testing.assert_allclose(normal[0], -normal[1], rtol=0, atol=1e-12 * np.abs(normal[0]).max())
    fold = np.arctan2(dot(np.cross(f.n, r.n), -tangent), dot(f.n, r.n))
    key, share = ("fold", 1.0) if "fold" in table else ("angle", 2.0)
    asked = share * np.radians(eval_(table[key], t))
    np.testing.assert_allclose(fold, asked, atol=1e-14)


def eval_(expression, t):
    """The numbers of one of the texts above."""
    value = eval(str(expression), {"sin": np.sin, "cos": np.cos}, {"t": t})  # our own text
    return np.broadcast_to(value, t.shape)


def test_o34_a_folded_circle_is_two_cones():
    """rho = rho0 cos(alpha), apices at +-rho0 sin(alpha), the sector's angle over cos(alpha)."""
    (right,), (left,) = sheet(flat_crease=ARC, fold=60, extent=[-20, 20])
    t = np.linspace(0, np.pi, 101)
    middle = np.array([100 - 86.60254037844386, 0, 0])
    for patch, height in ((right, -50.0), (left, 50.0)):
        f = patch.frame(t)
        radius = f.c0 - middle
        np.testing.assert_allclose(np.linalg.norm(radius, axis=1), 86.60254037844386, rtol=1e-13)
        np.testing.assert_allclose(f.c0[:, 2], 0, atol=1e-12)
        apex = f.c0 - (f.q / f.a)[:, None] * f.e
        np.testing.assert_allclose(apex, middle + [0, 0, height] + 0 * apex, atol=1e-11)
        np.testing.assert_allclose(np.abs(f.c / f.q), 0.005773502691896258, rtol=1e-12)
    turn = np.unwrap(np.arctan2(radius[:, 1], radius[:, 0]))
    assert turn[-1] == pytest.approx(3.6275987284684357, rel=1e-13)


def test_both_sides_develop_to_the_flat_crease_as_it_was_drawn():
    """Distances between its points, which are those of the drawing on either side."""
    chains = sheet(flat_crease=WAVE, fold="70 + 5*sin(3*t)**2", extent=[-4, 4])
    t = np.linspace(0, 4, 41)
    drawn = np.stack([100 * t, 20 * np.sin(3 * t)], axis=1)
    for (patch,) in chains:
        flat = develop(patch).points(t, np.zeros_like(t))
        for k in (1, 7, 23):
            np.testing.assert_allclose(
                np.linalg.norm(flat[k:] - flat[:-k], axis=1),
                np.linalg.norm(drawn[k:] - drawn[:-k], axis=1),
                rtol=1e-11,
            )


@pytest.mark.parametrize("name", ["screw", "twisted", "leaning", "mountain"])
def test_rulings_leave_the_crease_by_fuchs_and_tabachnikov(name):
    """cot(beta) = (tau +- alpha')/(k sin(alpha)), from the crease's own k and tau."""
    table = SHEETS[name]
    right, left = sheet(**table)
    (patch,) = right
    t = np.linspace(*patch.domain, 51)
    jet = patch.jet(t, 3)
    d1, d2, d3 = jet.c0[1], 2 * jet.c0[2], 6 * jet.c0[3]
    across, speed = np.cross(d1, d2), np.linalg.norm(d1, axis=1)
    curvature = np.linalg.norm(across, axis=1) / speed**3
    torsion = dot(across, d3) / dot(across, across)
    key, share = ("fold", 0.5) if "fold" in table else ("angle", 1.0)
    alpha = share * np.radians(eval_(table[key], t))
    h = 1e-5
    slope = (
        share * np.radians(eval_(table[key], t + h) - eval_(table[key], t - h)) / (2 * h * speed)
    )
    for chain, side in ((right, 1.0), (left, -1.0)):
        f = chain[0].frame(t)
        cosine = side * dot(f.e, d1) / speed
        cot = cosine / np.sqrt(1 - cosine**2)
        expected = (torsion - side * slope) / (curvature * np.sin(alpha))
        np.testing.assert_allclose(cot, expected, rtol=1e-8, atol=1e-9)  # the slope's differences


def test_a_plane_crease_reflects_the_sheet():
    """Whatever the angle does, the left flank is the right one continued, in the crease's plane."""
    right, left = sheet(flat_crease=WAVE, fold="70 + 5*sin(3*t)**2", extent=[-4, 4])
    t = np.linspace(0, 4, 101)
    (_, r), (_, f) = one(right, t), one(left, t)
    np.testing.assert_allclose(r.c0[:, 2], 0, atol=1e-11)
    np.testing.assert_allclose(f.e, r.e * [1, 1, -1], atol=1e-13)


def test_rulings_across_a_lens_make_it_a_cylinder():
    """sin(alpha) sin(beta) constant along plane creases: one direction of rulings, both flaps
    images of the lens in the planes of the creases."""
    chains = sheet(
        flat_crease=WAVE
        | {"x": "-150*(cos(t) - cos(0.7))", "y": "150*sin(t)", "t": ["-0.6", "0.6"]},
        fold="-2*asin(sin(0.6)/cos(t))*180/pi",
        ruling="90 - t*180/pi",
        right_creases=["300*(cos(t) - cos(0.7))"],
        extent=[-10, 10],
    )
    t = np.linspace(-0.6, 0.6, 61)
    for k, chain in enumerate(chains):
        f = one(chain, t)[1]
        np.testing.assert_allclose(f.e, f.e[:1] + 0 * f.e, atol=1e-13)
        points = f.c0 - f.c0.mean(axis=0)
        off_plane = np.linalg.svd(points)[1][2] / len(t)
        assert off_plane <= 1e-12, k
    lens, _, beyond = (one(chain, t)[1] for chain in chains)
    assert np.arccos(lens.e[0] @ beyond.e[0]) == pytest.approx(2 * 0.6, rel=1e-12)
    turned = np.arccos(np.clip(dot(lens.n, beyond.n), -1, 1))  # the other crease folds alike
    np.testing.assert_allclose(turned, 2 * np.arcsin(np.sin(0.6) / np.cos(t)), rtol=1e-12)


def test_circles_side_by_side_fold_to_a_zigzag_of_cones():
    """At flat radius rho each crease is a circle of rho cos(alpha), up and down by turns."""
    chains = sheet(
        crease={"kind": "circle", "radius": 100 * np.cos(0.5)},
        angle=float(np.degrees(0.5)),
        right_creases=[20, 15],
        left_creases=[-30],
        extent=[-25, 10],
    )
    t = np.linspace(0, 2 * np.pi, 41)
    rims = {0: (100, 0), 2: (120, 20), 3: (135, 20 - 15), 4: (70, 30)}
    for number, (radius, height) in rims.items():
        c0 = one(chains[number], t)[1].c0
        np.testing.assert_allclose(np.hypot(*c0[:, :2].T), radius * np.cos(0.5), rtol=1e-13)
        np.testing.assert_allclose(c0[:, 2], height * np.sin(0.5), atol=1e-12)
    for number, slope in {0: 1, 1: -1, 2: -1, 3: 1, 4: 1}.items():
        e = one(chains[number], t)[1].e
        np.testing.assert_allclose(e[:, 2], slope * np.sin(0.5), rtol=1e-12)


FURTHER = {
    "screw": SHEETS["screw"] | {"extent": [-5, 5]},
    "inflections": SHEETS["inflections"] | {"flat_crease": WAVE | {"t": [0.8, 1.3]}},
}


@pytest.mark.parametrize("table", FURTHER.values(), ids=FURTHER)
def test_a_further_crease_is_a_crease(table):
    """The two flanks beside it see one curve bent alike within the sheet and against one another
    across it, as the first crease's do."""
    step = 4
    chains = sheet(**table, right_creases=[step, "3 + 0*t"], left_creases=[-step])
    pairs = ((0, 2, step), (2, 3, 3), (1, 4, -step))
    t = np.linspace(*chains[0][0].domain, 201)
    for parent, child, s in pairs:
        (jet, f), (new, g) = one(chains[parent], t), one(chains[child], t)
        np.testing.assert_allclose(new.c0[0], jet.c0[0] + s * jet.e[0], atol=1e-12)
        tangent, turning = along(new)
        geodesic = [dot(turning, np.cross(frame.n, tangent)) for frame in (f, g)]
        np.testing.assert_allclose(*geodesic, rtol=0, atol=1e-12 * np.abs(geodesic[0]).max())
        normal = [dot(turning, frame.n) for frame in (f, g)]
        size = np.abs(normal[0]).max()
        np.testing.assert_allclose(normal[0], -normal[1], rtol=0, atol=1e-12 * size)
        assert np.abs(g.residual_e).max() <= 1e-14 * np.abs(g.c).max()


@pytest.mark.parametrize("name", ["screw", "inflections, varying", "inflections, leaning"])
def test_derivatives_of_high_order_continue_the_surface(name):
    """The Taylor polynomial meets the surface a hundredth of the domain on."""
    further = {"right_creases": [3]} if name == "screw" else {}
    for (patch,) in sheet(**SHEETS[name] | {"extent": [-4, 4]}, **further):
        low, high = patch.domain
        h = 0.01 * (high - low)
        t = np.linspace(low, high - h, 41)
        here, there = patch.jet(t, 12), patch.jet(t + h, 0)
        powers = h ** np.arange(13)
        for series, value in ((here.c0, there.c0[0]), (here.e, there.e[0])):
            reached = np.einsum("k,kni->ni", powers, series)
            np.testing.assert_allclose(reached, value, atol=1e-13 * np.abs(value).max())


def test_straight_stretches_fold_where_the_angle_stands_still():
    """Arc and line by turns: planes beside the lines, the rulings square to the crease."""
    chains = sheet(flat_crease=BENT, fold=60, extent=[-10, 10], right_creases=[8])
    for chain in chains:
        assert len(chain) == 3  # line, arc, line
        for patch, bends in zip(chain, (False, True, False), strict=True):
            f = patch.frame(np.linspace(*patch.domain, 11))
            assert (np.abs(f.c).max() > 0.1) == bends
            along_crease = f.p / np.hypot(f.p, f.q)
            np.testing.assert_allclose(along_crease, 0, atol=1e-14)
    for chain in sheet(flat_crease=BENT, fold=60, ruling=75, extent=[-10, 10]):
        for patch in chain:
            f = patch.frame(np.linspace(*patch.domain, 11))
            lean = np.cos(np.radians(75))
            np.testing.assert_allclose(np.abs(f.p) / np.hypot(f.p, f.q), lean, rtol=1e-12)


QUINTIC = {
    "kind": "bspline",
    "degree": 5,
    "knots": [0] * 6 + [1] * 6,
    "control_points": [
        [0, 0, 0],
        [20, 0, 0],
        [40, 12, 0],
        [58, 36, 12],
        [68, 66, 44],
        [66, 96, 90],
    ],
}


def points(chains, t, turned=False):
    """Places on all flanks at the rulings t, a third in from the outer ends: the same points of
    the sheet, whichever way its rulings run."""
    rows = []
    for chain in chains:
        jet = one(chain, t)[0]
        rows += [jet.c0[0] + v[0][:, None] * jet.e[0] for v in (jet.v_from, jet.v_to)]
    rows = np.stack(rows)  # right: crease, edge; left: edge, crease
    return rows[[3, 2, 1, 0]] if turned else rows


MOVES = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@settings(max_examples=8)
@given(turn=MOVES, size=scales(1e-3, 1e3), level=st.floats(15, 75), sway=st.floats(-10, 10))
def test_moving_and_scaling_the_crease_moves_and_scales_the_sheet(turn, size, level, sway):
    t = np.linspace(0, 1, 7)
    matrix = Rotation.from_quat(turn).as_matrix()
    angle = f"{level!r} + {sway!r}*t"
    there = QUINTIC | {
        "control_points": (size * np.array(QUINTIC["control_points"]) @ matrix.T).tolist()
    }
    try:
        here = sheet(crease=QUINTIC, angle=angle, extent=[-1, 1])
    except DevcadError:
        assume(False)
    moved = sheet(crease=there, angle=angle, extent=[-size, size])
    np.testing.assert_allclose(
        points(moved, t), size * points(here, t) @ matrix.T, atol=1e-10 * 150 * size
    )


@settings(max_examples=8)
@given(level=st.floats(15, 75), sway=st.floats(-10, 10), mirrored=st.booleans())
def test_backwards_or_in_a_mirror_the_sheet_is_the_same_with_its_other_side_in_front(
    level, sway, mirrored
):
    """B turns round both times: a valley is a mountain there, and the fold angle changes sign.
    N, and with it left, stays."""
    t = np.linspace(0, 1, 7)
    controls = np.array(QUINTIC["control_points"], dtype=float)
    if mirrored:
        changed, angle, places = controls * [1, 1, -1], f"-({level!r} + {sway!r}*t)", t
    else:
        changed, angle, places = controls[::-1], f"-({level!r} + {sway!r}*(1 - t))", 1 - t
    try:
        here = sheet(crease=QUINTIC, angle=f"{level!r} + {sway!r}*t", extent=[-1, 1])
    except DevcadError:
        assume(False)
    other = sheet(
        crease=QUINTIC | {"control_points": changed.tolist()}, angle=angle, extent=[-1, 1]
    )
    expected = points(here, t) * ([1, 1, -1] if mirrored else 1)
    np.testing.assert_allclose(points(other, places), expected, atol=1e-10 * 150)


LINE = {"kind": "line", "from": [0, 0, 0], "to": [100, 0, 0]}
EXTENT = {"extent": [-5, 5]}
REFUSED = {
    "neither": ({}, 2, "needs crease and angle, or flat_crease and fold; given none"),
    "half": ({"crease": ARC}, 2, "given only crease"),
    "mixed": ({"flat_crease": ARC, "angle": 3}, 2, "not angle, flat_crease"),
    "own torsion": ({"crease": ARC, "angle": 3, "torsion": 1}, 2, "has its own torsion"),
    "two windings": (
        {"flat_crease": ARC, "fold": 3, "torsion": 1, "ruling": 80},
        2,
        "one of the two follows",
    ),
    "unfolded": ({"flat_crease": ARC, "fold": 0}, 2, "fold is 0 throughout"),
    "through 0": ({"flat_crease": ARC, "fold": "50*(t - 1)"}, 2, "fold is 0 at t = 1:"),
    "shut": ({"crease": ARC, "angle": "80 + 10*t"}, 2, "angle is 111.416 deg at t = 3.14159"),
    "no number": ({"flat_crease": ARC, "fold": "60 + log(t)"}, 2, "no finite value at t = 0"),
    "ruling": ({"flat_crease": ARC, "fold": 60, "ruling": "90 + 60*t"}, 2, "ruling is 278"),
    "in space": ({"flat_crease": HELIX, "fold": 60}, 2, "flat_crease: z = 54 at t = 3.76991"),
    "closed flat": ({"flat_crease": ARC | {"sweep": 360}, "fold": 60}, 3, "80.9038 apart"),
    "corner": (
        {"flat_crease": BENT | {"corner_radius": 0}, "fold": 60},
        3,
        "tangent jumps at the corner t = 0.5",
    ),
    "straight": ({"crease": LINE, "angle": 60}, 3, "the crease is straight"),
    "inflection": ({"crease": WAVE, "angle": 60}, 3, "inflection (curvature 0) at t = 0"),
    "straight, varying": (
        {"flat_crease": BENT, "fold": "60 + t"},
        3,
        "the right side run along the crease from t = 0 to 0.28005",
    ),
    "inflection, varying": (
        {"flat_crease": WAVE | {"t": [0.5, 1.5]}, "fold": "70 + t"},
        3,
        "the right side run along the crease at t = 1.0472",
    ),
    "ruling jumps": (
        {"flat_crease": BENT, "fold": 60, "ruling": 80, "right_creases": [6]},
        3,
        "the sheet beyond right_creases[0] turn by",
    ),
    "left edge": (
        {"flat_crease": ARC, "fold": "60 + t", "extent": [-120, 5]},
        3,
        "the left side meet at t =",
    ),
    "right edge": (
        {"flat_crease": ARC | {"sweep": -90}, "fold": 60, "extent": [-5, 120]},
        3,
        "100 from the crease, within the extent 120",
    ),
    "collision": (
        {"flat_crease": ARC, "fold": 60, "left_creases": [-30, "-68 - t"]},
        3,
        "the sheet beyond left_creases[0] meet at t = 3.14159, 70 from the crease, before "
        "left_creases[1] at 71.1416",
    ),
    "plane": (
        {"flat_crease": LINE, "fold": 60, "right_creases": [5]},
        3,
        "right_creases[0] does not fold at t = 0",
    ),
    "left sign": ({"flat_crease": ARC, "fold": 60, "extent": [5, 9]}, 2, "left is 5 at t = 0"),
    "right sign": (
        {"flat_crease": ARC, "fold": 60, "extent": [-5, "3 - t"]},
        2,
        "right is -0.141593 at t = 3.14159",
    ),
    "crease sign": (
        {"flat_crease": ARC, "fold": 60, "left_creases": [4]},
        2,
        "left_creases[0] is 4 at t = 0",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_fold_is_refused_with_its_place(name):
    table, code, words = REFUSED[name]
    told = refusal(**{"kind": "curved-fold"} | EXTENT | table)
    assert told.code == code
    assert re.sub(r"\s+", " ", words) in str(told)
    assert told.remedy


def test_no_more_creases_than_can_be_made_in_reasonable_time():
    with pytest.raises(ValidationError, match="at most 12"):
        sheet(flat_crease=ARC, fold=10, extent=[-5, 5], right_creases=[1] * 13)
