"""Files that join a job's folder: what an export put there stays, and all appear at once."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from devcad.export.folder import PAGE, REPORT, listed, published


@contextmanager
def published_beside(out: Path, name: str, listing: str) -> Iterator[Path]:
    """A staging folder whose files come into OUT/name by one rename when the block ends well.

    What a report.json there lists comes along, byte for byte; what an earlier ``listing`` names
    goes. ``listing`` is one of the new files, JSON whose "files" name the others. Where the block
    does not end well, OUT/name stays as it was.

    Raises:
        FileError: as ``published``.
    """
    target = out / name
    with published(out, name) as staging:
        yield staging
        kept = listed(target / REPORT, REPORT)
        for file in sorted(kept | ({PAGE} if kept else set())):
            source = target / file
            if Path(file).name == file and source.is_file() and not (staging / file).exists():
                shutil.copy2(source, staging / file)
