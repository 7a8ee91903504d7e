"""Options that several commands have in common."""

from __future__ import annotations

import math
from typing import Any

import click


class FiniteRange(click.FloatRange):
    """A finite number in a range."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number", param, ctx)
        return number


SECONDS = FiniteRange(min=0, min_open=True, max=1e9)
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
