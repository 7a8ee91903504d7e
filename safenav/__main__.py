"""The entry point of the command and of ``python -m safenav``."""

import atexit
import gc
import os
import sys
from contextlib import suppress


def main() -> None:
    """Run the command line."""
    # Modules, strategies and searches have millions of objects, few of them in cycles. So garbage
    # is collected rarely, from the first import on.
    gc.set_threshold(200_000, 20, 100)
    ended: list[int] = []
    atexit.register(_leave, ended)  # registered first, so called last
    try:
        from safenav.cli import main as command

        command()
    except KeyboardInterrupt:  # during the imports; the command reports later interrupts
        print("error: interrupted", file=sys.stderr)
        sys.exit(130)
    except SystemExit as end:
        if isinstance(end.code, int):
            ended.append(end.code)
        raise


def _leave(ended: list[int]) -> None:
    """End the process with its exit status after its threads and exit handlers have ended. The
    release of all modules would take 5 ms. If the output cannot be written, the interpreter ends
    the process and reports the error."""
    for status in ended:
        with suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)


if __name__ == "__main__":
    main()
