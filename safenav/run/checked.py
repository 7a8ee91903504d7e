"""Check of a trace by the judge (docs/judge.md), for the commands and the library."""

from collections import Counter
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.files import json_line, read_input
from safenav.judge.engine import Finding, judge
from safenav.judge.lines import NotATraceError
from safenav.trace.file import Trace, as_data, read_bytes
from safenav.trace.records import Arrive, Move, Push


class CheckedTrace(Struct, frozen=True):
    """Result of a check. ``complete``: the trace has its outcome; otherwise it was cut off, for
    example by a crash, and the result covers the existing part. ``statistics``: counts of its
    lines; ``notes``: the parts that were not judged; ``strays``: steps that ended elsewhere than
    commanded; ``hands``: changes by a user, an operator or the world."""

    source: str
    outcome: str | None
    complete: bool
    findings: tuple[Finding, ...]
    statistics: Mapping[str, int]
    notes: tuple[Finding, ...]
    strays: int
    hands: int

    @property
    def ok(self) -> bool:
        """Whether no rule is broken up to the end of the trace."""
        return not self.findings


def check_trace(trace: str | Path | Trace | Iterable[str]) -> CheckedTrace:
    """Check a trace, given as a path, as lines, or as read. Raises InputError if it is not a
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
    """Check the content of a trace that has been read."""
    source = trace.source
    try:
        found = judge(BytesIO(content))
    except NotATraceError as error:
        raise InputError([Diagnostic(source, 0, 0, str(error))]) from error
    complete = found.outcome is not None and not trace.cut_off
    counts = statistics(trace), tuple(found.notes), found.strays, found.hands
    return CheckedTrace(source, found.outcome, complete, tuple(found.findings), *counts)


def statistics(trace: Trace) -> dict[str, int]:
    """Return counts of the lines of a trace. ``steps``: moves to another region."""
    count = Counter(record.type for record in trace.records)
    moves = [record for record in trace.records if isinstance(record, Move | Arrive)]
    kinds = {"goals": "goal", "violations": "violation", "requests": "request"}
    kinds |= {"resolved": "resolved", "blocked": "blocked", "syntheses": "synthesis"}
    return {
        "robots": len(trace.header.scenario.robots),
        "ticks": max((move.tick for move in moves), default=0),
        "moves": len(moves),
        "steps": sum(not isinstance(one, Move) or one.from_ != one.to for one in moves),
        **{name: count[kind] for name, kind in kinds.items()},
        "deepest_stack": max((r.depth for r in trace.records if isinstance(r, Push)), default=0),
        "ignored_lines": trace.ignored,
    }
