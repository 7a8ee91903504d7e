"""Options that several commands have in common."""

from __future__ import annotations

import click

SECONDS = click.FloatRange(min=0, min_open=True)
"""A duration, or a moment of a run."""

live = click.option(
    "--live", is_flag=True, help="Watch the run in a browser as it happens (extra: studio)."
)
operator = click.option(
    "--operator",
    metavar="FILE",
    help="Where a live run needs an operator, read interventions from this file (-: ask here).",
)
result_as_json = click.option(
    "--json", "as_json", is_flag=True, help="Print the result as JSON, not the events."
)
seed = click.option("--seed", type=click.IntRange(min=0), help="Override the scenario's seed.")
verify = click.option(
    "--verify/--no-verify", default=True, help="Check each strategy before it is used."
)
