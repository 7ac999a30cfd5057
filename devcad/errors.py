"""What can go wrong, as a tree: one class a cause, one exit code a class.

    DevcadError                     code 70, a bug of ours when it is nothing below
    +- JobError (ValueError)        2   job file or usage, a value outside its domain
    +- GeometryError (ValueError)   3   no such developable
    +- CheckFailed (ValueError)     3   the part exists, but a check does not hold
    +- LimitError (ValueError)      4   too large, too deep, too costly
    +- FileError (OSError)          5   missing, unreadable, unwritable

Every message reads: place > panel, what, value, limit, remedy.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(eq=False)
class DevcadError(Exception):
    """A failure with its place, what is wrong, the value, the limit and the remedy.

    ``value`` and ``limit`` are the numbers (or words) that ``what`` speaks of, for programs;
    ``what`` is the whole statement for people, numbers included.
    """

    what: str
    place: str = ""
    panel: str = ""
    value: float | str | None = None
    limit: float | str | None = None
    remedy: str = ""

    code = 70

    def __str__(self) -> str:
        """One line: place > panel: what (remedy)."""
        where = " > ".join(
            part for part in (self.place, f"panel {self.panel}" if self.panel else "") if part
        )
        line = f"{where}: {self.what}" if where else self.what
        line = f"{line} ({self.remedy})" if self.remedy else line
        return " ".join(line.split())

    def at(self, *, place: str = "", panel: str = "") -> DevcadError:
        """The same failure, told where it happened; what is already known stays."""
        self.place = self.place or place
        self.panel = self.panel or panel
        return self


class JobError(DevcadError, ValueError):
    """The job file or the command line is wrong."""

    code = 2


class GeometryError(DevcadError, ValueError):
    """The surface asked for does not exist as a developable."""

    code = 3


@dataclass(eq=False)
class CheckFailed(DevcadError, ValueError):
    """The part was built, but one of its checks does not hold; ``t`` is where, if known."""

    check: str = ""
    t: float | None = None

    code = 3


class LimitError(DevcadError, ValueError):
    """An input is larger, deeper or costlier than allowed."""

    code = 4


class FileError(DevcadError, OSError):
    """A file is missing, unreadable or unwritable, or its format is not what it says."""

    code = 5
