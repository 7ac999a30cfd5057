"""python -m devcad."""

import gc
import os
import sys

# pydantic would search every installed package for plugins before its first model, for 10 ms
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

from devcad.cli import run  # noqa: E402

RARE = 1_000_000  # allocations between garbage collections; the default costs a check a tenth


def main() -> None:
    """The command line; leaves with its exit code.

    The process ends at once: taking the loaded libraries apart would cost a short command a
    fifth of its time.
    """
    gc.set_threshold(RARE)
    code = run(sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
