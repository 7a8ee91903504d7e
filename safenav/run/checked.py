"""The check of a trace by the judge (docs/judge.md), for the commands and the library."""

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.files import json_line, read_input
from safenav.judge.engine import Finding, judge
from safenav.judge.lines import NotATraceError
from safenav.trace.file import Trace, as_data, read_bytes


class CheckedTrace(Struct, frozen=True):
    """The result of the check of a trace. ``complete``: whether the trace has its outcome;
    otherwise a crash, for example, cut it off, and the result covers the existing part. ``notes``:
    parts that were not judged; ``strays``: the number of steps that did not end as commanded;
    ``hands``: the number of changes by a user, an operator or the world."""

    source: str
    outcome: str | None
    complete: bool
    findings: tuple[Finding, ...]
    notes: tuple[Finding, ...]
    strays: int
    hands: int

    @property
    def ok(self) -> bool:
        """Whether no line of the trace breaks a rule."""
        return not self.findings


def check_trace(trace: str | Path | Trace | Iterable[str]) -> CheckedTrace:
    """Check a trace, given as a path, lines or read content. Raises InputError if it is not a
    trace."""
    if isinstance(trace, Trace):
        records = (trace.header, *trace.records)
        return checked("".join(json_line(as_data(r)) for r in records).encode(), trace)
    if isinstance(trace, str | Path):
        content, source = read_input(trace), str(trace)
    else:
        lines = (each if each.endswith("\n") else f"{each}\n" for each in trace)
        content, source = "".join(lines).encode(), "<trace>"
    return checked(content, read_bytes(content, source))


def checked(content: bytes, trace: Trace) -> CheckedTrace:
    """Return the result of the check of a read trace."""
    source = trace.source
    try:
        found = judge(BytesIO(content))
    except NotATraceError as error:
        raise InputError([Diagnostic(source, 0, 0, str(error))]) from error
    complete = found.outcome is not None and not trace.cut_off
    parts = tuple(found.findings), tuple(found.notes), found.strays, found.hands
    return CheckedTrace(source, found.outcome, complete, *parts)
