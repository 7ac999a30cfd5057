"""Large libraries, loaded when they are needed and so that they leave nothing behind."""

from __future__ import annotations

import json
import logging
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any


def load_ezdxf() -> Any:
    """ezdxf, imported so that it leaves no file behind.

    On its first import it looks at every font of the system and keeps a list in the user's
    cache folder. Nothing here needs a font: where there is no such list yet, it is shown an
    empty one in a folder that is gone afterwards.
    """
    if "ezdxf" in sys.modules:
        return sys.modules["ezdxf"]
    before = os.environ.get("XDG_CACHE_HOME")
    cache = Path(before).expanduser() if before else Path("~/.cache").expanduser()
    listed = Path("ezdxf") / "font_manager_cache.json"
    if (cache / listed).exists():
        return import_module("ezdxf")
    with tempfile.TemporaryDirectory() as folder:
        empty = Path(folder) / listed
        empty.parent.mkdir()
        empty.write_text(json.dumps({"version": 0, "font-faces": []}), encoding="ascii")
        os.environ["XDG_CACHE_HOME"] = folder
        try:
            return import_module("ezdxf")
        finally:
            if before is None:
                del os.environ["XDG_CACHE_HOME"]
            else:
                os.environ["XDG_CACHE_HOME"] = before


@contextmanager
def silent(name: str) -> Iterator[None]:
    """A library told to log nothing meanwhile: what is wrong comes as an exception."""
    log = logging.getLogger(name)
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(level)
