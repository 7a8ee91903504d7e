"""How a map file is divided into regions: the same options wherever a command takes one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from safenav.cli import options

_OPTIONS = (
    click.option("--rows", type=click.IntRange(min=1), help="Number of rows of a map file."),
    click.option("--cols", type=click.IntRange(min=1), help="Number of columns of a map file."),
    click.option(
        "--side",
        type=options.SECONDS,
        metavar="M",
        help="Side of a square region, in metres.",
    ),
    click.option(
        "--share",
        type=options.FiniteRange(0, 1),
        help="Share of a region that must be blocked to make it a wall; default: any.",
    ),
)


def division_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options ``--rows``, ``--cols``, ``--side`` (metres) and ``--share``."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
