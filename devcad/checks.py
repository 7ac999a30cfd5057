"""A check: one proven statement about a part, with its value, its limit and its place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from devcad.errors import CheckFailed


@dataclass(frozen=True, slots=True)
class Where:
    """The place where a check takes its worst value; what does not apply is None."""

    t: float | None = None
    v: float | None = None
    point: tuple[float, float, float] | None = None
    flat: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Check:
    """``value`` against ``limit`` in ``unit``; ``passed`` says whether the statement holds.

    ``says`` is the statement of a failure, its value and place included; ``remedy`` what to do.
    """

    name: str
    panel: str
    value: float
    limit: float
    unit: str
    passed: bool
    where: Where = Where()
    says: str = ""
    remedy: str = ""

    def failure(self) -> CheckFailed:
        """The error that a failed check raises."""
        what = self.says or f"{self.value:.6g} {self.unit}"
        return CheckFailed(
            f"{self.name}: {what}, limit {self.limit:.6g} {self.unit}".rstrip(),
            panel=self.panel,
            value=self.value,
            limit=self.limit,
            remedy=self.remedy,
            check=self.name,
            t=self.where.t,
        )


def require(checks: Iterable[Check], allow: frozenset[str]) -> None:
    """Raise the first check that failed and is not in ``allow``, nor follows from one that is.

    Raises:
        CheckFailed: with the check's panel, value, limit and remedy.
    """
    allowed = allow.union(*(FOLLOWS.get(name, ()) for name in allow))
    for check in checks:
        if not check.passed and check.name not in allowed:
            raise check.failure()


def at_most(
    name: str,
    panel: str,
    value: float,
    limit: float,
    unit: str,
    *,
    where: Where | None = None,
    says: str = "",
    remedy: str = "",
) -> Check:
    """A check that holds when ``value`` does not exceed ``limit`` (and is a number)."""
    return Check(
        name, panel, value, limit, unit, bool(value <= limit), where or Where(), says, remedy
    )


FOLLOWS = {"twist": ("isometry", "fold-back", "step-twist", "volume", "area")}
"""A surface that twists is not isometric to any pattern: who allows that allows what follows."""

LOWER = ("regular", "bend-radius", "flange", "hole-near-bend", "hole-size")
"""The checks of a value that must not be less than its limit."""


def worst(every: Iterable[Iterable[Check]]) -> list[Check]:
    """Of each check by its name the one that is nearest to failing, in the order of the names."""
    out: dict[str, Check] = {}
    for check in (check for checks in every for check in checks):
        known = out.get(check.name)
        if known is None or _pressing(check) > _pressing(known):
            out[check.name] = check
    return list(out.values())


def _pressing(check: Check) -> tuple[bool, float]:
    """Whether a check failed, and how near it is to that: larger is worse."""
    return not check.passed, -check.value if check.name in LOWER else check.value


NAMES = (
    "twist",
    "crease",
    "regular",
    "isometry",
    "mesh-deviation",
    "fold-back",
    "overlap",
    "score",
    "chord",
    "seam",
    "stitch",
    "bend-radius",
    "outer-strain",
    "springback",
    "flange",
    "hole-near-bend",
    "hole-size",
    "step-deviation",
    "step-twist",
    "step-valid",
    "step-seam",
    "dxf-deviation",
    "dxf-readback",
    "dxf-profile",
    "nest-gap",
    "svg-deviation",
    "svg-readback",
    "pdf-deviation",
    "pdf-readback",
    "csv-readback",
    "stl-readback",
    "glb-readback",
    "3mf-readback",
    "volume",
    "area",
)
"""Every check there is: what --allow accepts."""
