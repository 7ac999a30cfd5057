"""Help for the tests of the constructions: job tables to patches, and integrals over patches."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from devcad.errors import DevcadError
from devcad.geometry.constructions import Built, surface_spec
from devcad.geometry.patch import Frame, Patch

ADAPTER = TypeAdapter(surface_spec())


def build(**table: Any) -> Built:
    """What a [surface] table gives."""
    return ADAPTER.validate_python(table).build()


def patches(**table: Any) -> tuple[Patch, ...]:
    """The patches of a one-panel surface."""
    (panel,) = build(**table).panels
    return panel.patches


def patch(**table: Any) -> Patch:
    """The patch of a surface that has one."""
    (only,) = patches(**table)
    return only


def refusal(**table: Any) -> DevcadError:
    """The error that a table ends in."""
    try:
        build(**table)
    except DevcadError as error:
        return error
    except ValidationError as errors:
        inner = errors.errors()[0].get("ctx", {}).get("error")
        assert isinstance(inner, DevcadError), errors
        return inner
    raise AssertionError("it was built")


def gauss(of: Patch, each: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and weights of a quadrature over the domain, 40 Gauss nodes a smooth segment
    cut in four: beyond rounding for the functions here."""
    x, w = np.polynomial.legendre.leggauss(each)
    cuts = np.concatenate(
        [np.linspace(a, b, 5)[:-1] for a, b in zip(of.segments, of.segments[1:], strict=False)]
        + [of.segments[-1:]]
    )
    half = 0.5 * np.diff(cuts)[:, None]
    t = (0.5 * (cuts[1:] + cuts[:-1]))[:, None] + half * x
    return t.ravel(), (half * w).ravel()


def area(of: Patch) -> float:
    """The integral of q + v a over the extent."""
    t, weight = gauss(of)
    f = of.frame(t)
    return float(weight @ (f.q * (f.v_to - f.v_from) + f.a * (f.v_to**2 - f.v_from**2) / 2))


def integral(of: Patch, name: str) -> float:
    """The integral of one of the six functions over the domain."""
    t, weight = gauss(of)
    return float(weight @ getattr(of.frame(t), name))


def regression(frame: Frame) -> np.ndarray:
    """The points c0 - (q/a) e, (n, 3)."""
    return frame.c0 - (frame.q / frame.a)[:, None] * frame.e


def inside(of: Patch, number: int = 101) -> np.ndarray:
    """Parameters over the closed domain."""
    return np.linspace(*of.domain, number)
