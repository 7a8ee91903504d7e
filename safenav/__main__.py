"""Entry point of the command, also as ``python -m safenav``; Ctrl-C ends its imports, too."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line."""
    try:
        from safenav.cli import main as command
    except KeyboardInterrupt:
        from safenav.errors import ExitCode

        print("error: interrupted", file=sys.stderr)
        sys.exit(ExitCode.INTERRUPTED)
    command()


if __name__ == "__main__":
    main()
