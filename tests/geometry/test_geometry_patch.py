"""The six functions of a patch against closed forms."""

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, helix_tangent

from devcad.geometry import taylor

HELIX = helix_tangent()
CONE = frustum()


def test_tangent_surface_of_a_helix_has_curvature_and_torsion_as_a_and_c():
    frame = HELIX.frame(np.linspace(0.0, 10.0, 7))
    np.testing.assert_allclose(frame.a, 3 / 25, rtol=1e-13)
    np.testing.assert_allclose(frame.c, 4 / 25, rtol=1e-13)
    np.testing.assert_allclose(frame.p, 1.0, rtol=1e-14)
    np.testing.assert_allclose(frame.q, 0.0, atol=1e-15)


def test_principal_curvature_of_the_helix_tangent_surface_at_distance_two():
    frame = HELIX.frame([1.0])
    kappa = frame.c / (frame.q + 2.0 * frame.a)
    assert kappa[0] == pytest.approx(2 / 3, rel=1e-12)  # oracle O09: tau / (k u)


@pytest.mark.parametrize("patch", [CONE, HELIX, ellipse_cylinder()])
def test_front_is_where_e_times_tangent_points_and_frame_is_orthonormal(patch):
    f = patch.frame(np.linspace(*patch.domain, 33)[1:-1])
    middle = 0.5 * (f.v_from + f.v_to)
    assert (f.q + middle * f.a > 0.0).all()
    basis = np.stack([f.e, f.m, f.n], axis=1)
    np.testing.assert_allclose(np.linalg.det(basis), 1.0, rtol=1e-14)
    np.testing.assert_allclose(np.einsum("nij,nkj->nik", basis, basis)[:, 0, 1], 0.0, atol=1e-15)


@pytest.mark.parametrize("patch", [CONE, HELIX, ellipse_cylinder()])
def test_the_frame_equations_hold(patch):
    t = np.linspace(*patch.domain, 9)[1:-1]
    jet, f = patch.frame_jet(t, 1), patch.frame(t)
    prime = lambda x: taylor.derivative(x)[0]  # noqa: E731
    col = lambda x: x[:, None]  # noqa: E731
    size = np.abs(f.c).max() + np.abs(f.a).max()
    np.testing.assert_allclose(prime(jet.ruling.e), col(f.a) * f.m, atol=1e-13 * size)
    np.testing.assert_allclose(prime(jet.m), -col(f.a) * f.e + col(f.c) * f.n, atol=1e-13 * size)
    np.testing.assert_allclose(prime(jet.n), -col(f.c) * f.m, atol=1e-13 * size)
    scale = np.abs(f.p).max() + np.abs(f.q).max()
    np.testing.assert_allclose(
        prime(jet.ruling.c0), col(f.p) * f.e + col(f.q) * f.m, atol=1e-13 * scale
    )
    for series, values in ((jet.a, f.a), (jet.c, f.c), (jet.p, f.p), (jet.q, f.q)):
        np.testing.assert_allclose(series[0], values, atol=1e-12 * (size + scale))


def test_parallel_surface_moves_q_by_the_bending():
    t = np.linspace(0.5, 9.5, 5)
    f, g = HELIX.frame(t), HELIX.parallel(0.25).frame(t)
    np.testing.assert_allclose(g.q, f.q - 0.25 * f.c, atol=1e-15)
    for name in ("a", "c", "p"):
        np.testing.assert_allclose(getattr(g, name), getattr(f, name), rtol=1e-12)


def test_curvature_of_an_offset_follows_the_law_k_over_one_minus_d_k():
    # oracle O51, as a function: kappa_n / (sin^2 phi (1 - t / t*)) and k / (1 - d k)
    kn, phi, kg, slope, at, d = 0.2, np.pi / 3, 0.1, 0.05, 1.0, 0.5
    q, a = np.sin(phi), -(slope + kg)  # a turns the ruling towards m = -sin(phi) T + cos(phi) V
    c = kn / np.sin(phi)
    assert -q / a == pytest.approx(5.773502691896257, rel=1e-12)
    assert c / q == pytest.approx(0.26666666666666666, rel=1e-12)
    kappa = c / (q + at * a)
    assert kappa == pytest.approx(0.3225306063936461, rel=1e-12)
    assert c / (q - d * c + at * a) == pytest.approx(0.3845442517436873, rel=1e-12)


def test_moving_and_scaling_change_only_lengths():
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, [4.0, -5.0, 6.0]
    t = np.linspace(0.5, 9.5, 5)
    f, g = HELIX.frame(t), HELIX.transformed(matrix, 7.0).frame(t)
    np.testing.assert_allclose(g.n, f.n @ turn.T, atol=1e-14)
    np.testing.assert_allclose(g.q, 7.0 * f.q, atol=1e-14)
    np.testing.assert_allclose(g.a, f.a, rtol=1e-12)
    np.testing.assert_allclose(g.c, f.c, rtol=1e-12)


def test_consecutive_generators_of_the_twisted_cubic_are_cubically_close():
    # oracle O53: distance / dt^3 of neighbouring tangent lines at t = 0.4
    def line(t):
        return np.array([t, t**2, t**3]), np.array([1.0, 2 * t, 3 * t**2])

    h = 1e-3  # truncation O(h^2), rounding 1e-16 / h^3 = 1e-7
    (p, u), (r, w) = line(0.4 - h / 2), line(0.4 + h / 2)
    across = np.cross(u, w)
    distance = abs((r - p) @ across) / np.linalg.norm(across)
    assert distance / h**3 == pytest.approx(0.3059721122800404, rel=1e-5)


def test_twisted_cubic_lies_on_its_quartic_and_so_does_its_tangent_developable():
    # oracle O36
    def quartic(x, y, z):
        return z**2 - 6 * x * y * z + 4 * y**3 + 4 * x**3 * z - 3 * x**2 * y**2

    assert quartic(2, 1, 3) == 61
    assert quartic(1.5, 2.0, 2.5) == 0.0
    assert quartic(0.5, 0.25, 0.125) == 0.0
