"""Draws a part beside the flat sheet that it is bent from, and the part as it unrolls.

usage: python samples/picture.py [JOB.toml]   writes JOB.svg and JOB-unrolls.svg beside the job
"""

from __future__ import annotations

import sys
from pathlib import Path

import devcad
from devcad.report.page import pictures


def main() -> None:
    job = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_name("lampshade.toml")
    still, moving = pictures(devcad.build(job))
    job.with_suffix(".svg").write_text(still + "\n", encoding="utf-8")
    job.with_name(f"{job.stem}-unrolls.svg").write_text(moving + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
