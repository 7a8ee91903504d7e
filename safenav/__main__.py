"""Entry point of the command, also of ``python -m safenav``. Ctrl-C ends it even while modules
load."""

from __future__ import annotations

import atexit
import gc
import sys


def main() -> None:
    """Run the command line."""
    # Modules, strategies and searches are millions of objects with hardly a cycle: collect
    # rarely, from the first import on, and not again at exit.
    gc.set_threshold(200_000, 20, 100)
    atexit.register(gc.freeze)
    try:
        from safenav.cli import main as command
    except KeyboardInterrupt:
        from safenav.errors import ExitCode

        print("error: interrupted", file=sys.stderr)
        sys.exit(ExitCode.INTERRUPTED)
    command()


if __name__ == "__main__":
    main()
