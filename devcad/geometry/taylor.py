"""Truncated Taylor series in one variable, many points at once.

A series of order K at n points is an array of shape (K + 1, n) (a scalar function) or
(K + 1, n, 3) (a vector function): entry [k] is the k-th derivative divided by k!. All
functions take and give such arrays, all of one order, and check nothing.

Source: Griewank and Walther, Evaluating Derivatives, chapter 13 (the recurrences).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def constant(value: float, order: int, n: int) -> Array:
    """The series of a constant, shape (order + 1, n)."""
    out = np.zeros((order + 1, n))
    out[0] = value
    return out


def constant_vector(value: npt.ArrayLike, order: int, n: int) -> Array:
    """The series of a constant vector, shape (order + 1, n, 3)."""
    out = np.zeros((order + 1, n, 3))
    out[0] = value
    return out


def variable(t: Array, order: int) -> Array:
    """The series of the independent variable itself at the points t (n,)."""
    out = np.zeros((order + 1, t.size))
    out[0] = t
    if order:
        out[1] = 1.0
    return out


def derivative(x: Array) -> Array:
    """The series of x', of one order less."""
    k = np.arange(1, len(x), dtype=float).reshape((-1,) + (1,) * (x.ndim - 1))
    return k * x[1:]


def mul(x: Array, y: Array) -> Array:
    """The product; a scalar series times a vector series is a vector series."""
    if x.ndim < y.ndim:
        x = x[..., None]
    elif y.ndim < x.ndim:
        y = y[..., None]
    order = len(x)
    if order == 1:
        return np.asarray(x * y)
    out = x[:1] * y
    for j in range(1, order):
        out[j:] += x[j] * y[: order - j]
    return out


def dot(x: Array, y: Array) -> Array:
    """The scalar product of two vector series, a scalar series."""
    return np.asarray(mul(x, y).sum(axis=-1))


def cross(x: Array, y: Array) -> Array:
    """The vector product of two vector series."""
    a, b = x[..., [1, 2, 0]], y[..., [2, 0, 1]]
    c, d = x[..., [2, 0, 1]], y[..., [1, 2, 0]]
    return mul(a, b) - mul(c, d)


def rows_cross(x: Array, y: Array) -> Array:
    """The vector products of rows, (n, 3): what numpy.cross gives, at a third of its cost."""
    return np.stack(
        [
            x[:, 1] * y[:, 2] - x[:, 2] * y[:, 1],
            x[:, 2] * y[:, 0] - x[:, 0] * y[:, 2],
            x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0],
        ],
        axis=1,
    )


def rows_dot(x: Array, y: Array) -> Array:
    """The scalar products of rows, (n, 3) -> (n,)."""
    return np.asarray(np.einsum("ij,ij->i", x, y))


def reciprocal(x: Array) -> Array:
    """1 / x."""
    return power(x, -1.0)


def div(x: Array, y: Array) -> Array:
    """x / y, y a scalar series."""
    return mul(x, reciprocal(y))


def power(x: Array, exponent: float) -> Array:
    """x ** exponent for a constant exponent; x[0] must not vanish (and is positive unless the
    exponent is an integer): y' x = exponent y x'."""
    out = np.zeros_like(x)
    out[0] = x[0] ** exponent
    for k in range(1, len(x)):
        total = np.zeros_like(x[0])
        for j in range(1, k + 1):
            total += (exponent * j - (k - j)) * x[j] * out[k - j]
        out[k] = total / (k * x[0])
    return out


def sqrt(x: Array) -> Array:
    """The square root; x[0] > 0."""
    return power(x, 0.5)


def norm(x: Array) -> Array:
    """The Euclidean length of a vector series."""
    return sqrt(dot(x, x))


def unit(x: Array) -> Array:
    """x / |x|; x[0] must not vanish. Scaled first: tiny and huge vectors have a length too."""
    scale = np.abs(x[0]).max(axis=-1)
    x = x / np.where(scale > 0.0, scale, 1.0)[None, :, None]
    return mul(power(dot(x, x), -0.5), x)


def exp(x: Array) -> Array:
    """The exponential: y' = y x'."""
    out = np.zeros_like(x)
    out[0] = np.exp(x[0])
    for k in range(1, len(x)):
        out[k] = sum(j * x[j] * out[k - j] for j in range(1, k + 1)) / k
    return out


def log(x: Array) -> Array:
    """The natural logarithm; x[0] > 0."""
    return integral(np.log(x[0]), div(derivative(x), x[:-1])) if len(x) > 1 else np.log(x)


def integral(value: Array, slope: Array) -> Array:
    """The series with the given value and the given derivative series."""
    k = np.arange(1, len(slope) + 1, dtype=float).reshape((-1,) + (1,) * (slope.ndim - 1))
    return np.concatenate([value[None], slope / k])


def sin_cos(x: Array) -> tuple[Array, Array]:
    """Sine and cosine together: s' = c x', c' = -s x'."""
    s, c = np.zeros_like(x), np.zeros_like(x)
    s[0], c[0] = np.sin(x[0]), np.cos(x[0])
    for k in range(1, len(x)):
        s[k] = sum(j * x[j] * c[k - j] for j in range(1, k + 1)) / k
        c[k] = -sum(j * x[j] * s[k - j] for j in range(1, k + 1)) / k
    return s, c


def sinh_cosh(x: Array) -> tuple[Array, Array]:
    """Hyperbolic sine and cosine together."""
    s, c = np.zeros_like(x), np.zeros_like(x)
    s[0], c[0] = np.sinh(x[0]), np.cosh(x[0])
    for k in range(1, len(x)):
        s[k] = sum(j * x[j] * c[k - j] for j in range(1, k + 1)) / k
        c[k] = sum(j * x[j] * s[k - j] for j in range(1, k + 1)) / k
    return s, c


def compose(outer: Array, inner: Array) -> Array:
    """outer(inner(s)): ``outer`` (K + 1, n[, 3]) expanded at inner[0], ``inner`` (K + 1, n)."""
    step = inner.copy()
    step[0] = 0.0
    out = np.zeros_like(outer)
    out[0] = outer[-1]
    for k in range(len(outer) - 2, -1, -1):  # Horner
        out = mul(step, out)
        out[0] += outer[k]
    return out


def invert(x: Array) -> Array:
    """The inverse function's series: for x(t) with x[1] != 0, t(x) minus t at the point.

    Returns (K + 1, n) with [0] = 0: the step in t as a series in the step in x.
    """
    out = np.zeros_like(x)
    if len(x) > 1:
        out[1] = 1.0 / x[1]
    shifted = x.copy()
    shifted[0] = 0.0
    for k in range(2, len(x)):  # solve x(out) = identity, one coefficient at a time
        residual = compose(shifted[: k + 1], out[: k + 1])[k]
        out[k] = -residual / x[1]
    return out
