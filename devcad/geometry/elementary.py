"""Elementary functions of truncated Taylor series that ``taylor`` does not have.

Same convention: (K + 1, n), entry [k] the k-th derivative divided by k!. At points where a
function has no derivative (the square root at 0, abs at a simple zero) the value is right and
the coefficients from the first missing derivative on are nan or infinite; numpy's warnings are
the caller's to silence.

Source: Griewank and Walther, Evaluating Derivatives, chapter 13.
"""

from __future__ import annotations

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.taylor import Array

MAX_REPEATED = 64  # integer exponents up to here by multiplication: no division, good near 0


def tan(x: Array) -> Array:
    """The tangent: y' = (1 + y^2) x'."""
    return _riccati(x, np.tan(x[0]), 1.0)


def tanh(x: Array) -> Array:
    """The hyperbolic tangent: y' = (1 - y^2) x'."""
    return _riccati(x, np.tanh(x[0]), -1.0)


def _riccati(x: Array, value: Array, sign: float) -> Array:
    """The solution of y' = (1 + sign y^2) x' with the given value."""
    y, slope = np.zeros_like(x), np.zeros_like(x)
    y[0], slope[0] = value, 1.0 + sign * value * value
    for k in range(1, len(x)):
        y[k] = sum(j * x[j] * slope[k - j] for j in range(1, k + 1)) / k
        slope[k] = sign * sum(y[j] * y[k - j] for j in range(k + 1))
    return y


def asin(x: Array) -> Array:
    """The arc sine: y' = x' / sqrt((1 - x) (1 + x)), factored to stay exact near 1."""
    return _inverse(x, np.arcsin(x[0]), power(taylor.mul(_shift(-x, 1.0), _shift(x, 1.0)), -0.5))


def acos(x: Array) -> Array:
    """The arc cosine."""
    y = -asin(x)
    y[0] = np.arccos(x[0])
    return y


def atan(x: Array) -> Array:
    """The arc tangent: y' = x' / (1 + x^2)."""
    return _inverse(x, np.arctan(x[0]), taylor.reciprocal(_shift(taylor.mul(x, x), 1.0)))


def asinh(x: Array) -> Array:
    """The inverse hyperbolic sine: y' = x' / sqrt(1 + x^2)."""
    return _inverse(x, np.arcsinh(x[0]), taylor.power(_shift(taylor.mul(x, x), 1.0), -0.5))


def acosh(x: Array) -> Array:
    """The inverse hyperbolic cosine: y' = x' / sqrt((x - 1) (x + 1))."""
    return _inverse(x, np.arccosh(x[0]), power(taylor.mul(_shift(x, -1.0), _shift(x, 1.0)), -0.5))


def atanh(x: Array) -> Array:
    """The inverse hyperbolic tangent: y' = x' / ((1 - x) (1 + x))."""
    slope = taylor.reciprocal(taylor.mul(_shift(-x, 1.0), _shift(x, 1.0)))
    return _inverse(x, np.arctanh(x[0]), slope)


def _inverse(x: Array, value: Array, slope: Array) -> Array:
    """The series with the given value and the derivative slope x'."""
    if len(x) == 1:
        return value[None].copy()
    return taylor.integral(value, taylor.mul(slope[:-1], taylor.derivative(x)))


def _shift(x: Array, value: float) -> Array:
    """x + value."""
    out = x.copy()
    out[0] += value
    return out


def absolute(x: Array) -> Array:
    """|x|; at a zero of odd multiplicity m there are no derivatives from the m-th on."""
    first, multiplicity = _leading(x)
    out = np.sign(first) * x
    k = np.arange(len(x))[:, None]
    return np.where((multiplicity % 2 == 1) & (k >= multiplicity), np.nan, out)


def _leading(x: Array) -> tuple[Array, Array]:
    """The first coefficient that is not 0 and its index, (n,) each; 0 and 0 for the zero series."""
    index = np.argmax(x != 0.0, axis=0)
    return np.take_along_axis(x, index[None], axis=0)[0], index


def power(x: Array, exponent: float) -> Array:
    """x ** exponent for a constant exponent.

    Integer exponents take any base, 0 included when they are not negative; other exponents a
    positive one. At a zero of multiplicity m the coefficients below m exponent are 0 and the
    others nan.
    """
    if exponent == int(exponent) and abs(exponent) <= MAX_REPEATED:
        out = _repeated(x, abs(int(exponent)))
        out = taylor.reciprocal(out) if exponent < 0 else out
    else:
        out = taylor.power(x, exponent)
        zero = x[0] == 0.0
        if zero.any():
            out[:, zero] = _power_at_zero(x[:, zero], exponent)
    out[0] = np.power(x[0], exponent)
    return out


def _repeated(x: Array, exponent: int) -> Array:
    """x ** exponent by repeated squaring."""
    out = taylor.constant(1.0, len(x) - 1, x.shape[1])
    square, left = x, exponent
    while left:
        out = taylor.mul(out, square) if left & 1 else out
        left >>= 1
        square = taylor.mul(square, square) if left else square
    return out


def _power_at_zero(x: Array, exponent: float) -> Array:
    """x ** exponent where x[0] = 0."""
    multiplicity = np.where(x.any(axis=0), _leading(x)[1], len(x))
    k = np.arange(len(x))[:, None]
    return np.where(k < multiplicity * exponent, 0.0, np.nan)


def power_series(x: Array, exponent: Array) -> Array:
    """x ** exponent for two series: exp(exponent log x), base positive."""
    out = taylor.exp(taylor.mul(exponent, taylor.log(x)))
    out[0] = np.power(x[0], exponent[0])
    return out
