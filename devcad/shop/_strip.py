"""A child process that packs shapes into a strip: JSON on stdin, JSON on stdout.

The solver goes on until its time is over and may end the whole process where it fails, so it runs
on its own. Which of its solutions is taken does not depend on the time: the last feasible one
among a number of reports, whose sequence follows from the seed. Run as a script; devcad itself is
not imported.

In: height, width (mm), separation, seed, reports, failures, seconds, and items = [{shape, demand,
angles}]. Out: [[item, angle, x, y], ...], as narrow a strip as was found, or null. Twice as many
reports are heard while the strip is little wider than ``width``.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from typing import Any

NEARLY = 1.1
"""A strip that is wider by no more may yet become as narrow as the sheet."""
PAUSE = 0.01  # s between two looks at the solver


def main() -> None:
    """Answer the task on stdin."""
    json.dump(_packed(json.load(sys.stdin)), sys.stdout)
    sys.stdout.flush()
    os._exit(0)  # the solver does not stop when asked


def _packed(task: dict[str, Any]) -> list[list[float]] | None:
    import spyrrow

    items = [
        spyrrow.Item(str(k), [tuple(p) for p in item["shape"]], item["demand"], item["angles"])
        for k, item in enumerate(task["items"])
    ]
    instance = spyrrow.StripPackingInstance("", task["height"], items)
    config = spyrrow.StripPackingConfig(
        seed=task["seed"],
        num_workers=1,
        min_items_separation=task["separation"],
        total_computation_time=task["seconds"],
    )
    queue = spyrrow.ProgressQueue()
    solver = threading.Thread(target=instance.solve, args=(config, queue), daemon=True)
    solver.start()
    found, seen, failed = None, 0, 0
    while True:
        alive = solver.is_alive()
        for kind, solution in queue.drain():
            seen += 1
            failed += kind == spyrrow.ReportType.ExplInfeas
            if kind == spyrrow.ReportType.ExplFeas:
                found = solution
            exploring = kind.phase_name() == "exploring"
            if seen >= _patience(found, task) or failed >= task["failures"] or not exploring:
                return _told(found)
        if not alive:
            return _told(found)
        time.sleep(PAUSE)


def _patience(found: Any, task: dict[str, Any]) -> int:
    """How many reports to hear: more where a sheet may be saved."""
    near = found is not None and 1.0 < found.width / task["width"] <= NEARLY
    return int(task["reports"]) * (2 if near else 1)


def _told(solution: Any) -> list[list[float]] | None:
    if solution is None:
        return None
    return [[int(p.id), p.rotation, *p.translation] for p in solution.placed_items]


if __name__ == "__main__":
    main()
