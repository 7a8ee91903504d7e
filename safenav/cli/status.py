"""The exit status of commands that play a run."""

from __future__ import annotations

from safenav.errors import ExitCode
from safenav.outcome import Outcome

_EXIT_CODES = {
    Outcome.COMPLETED: ExitCode.OK,
    Outcome.TICK_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.TIME_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.SEARCH_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.INTERRUPTED: ExitCode.INTERRUPTED,
    Outcome.ERROR: ExitCode.INTERNAL,
}


def exit_code_of(outcome: Outcome) -> ExitCode:
    """Return the exit code of a run that ends so, if nothing else was expected."""
    return _EXIT_CODES.get(outcome, ExitCode.NEGATIVE)
