"""The ``safenav`` command, but it waits one second for a cluster, where nothing can answer."""

from unittest.mock import patch


def main() -> None:
    from safenav import cli

    with patch("safenav.batch.pool._CONNECT_SECONDS", 1):
        cli.main()
