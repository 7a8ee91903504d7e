"""The judge of traces alone, as a bundle has it: safenav's reader has not refused a line before."""

from collections.abc import Iterable

from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError


def believed(lines: Iterable[str | bytes]) -> bool:
    """Whether the judge accepts a trace with its end, and leaves nothing unjudged."""
    try:
        found = judge(lines)
    except NotATraceError:
        return False
    return found.ok and found.outcome is not None and not found.notes
