"""Check of a trace: reads it (safenav.trace) and applies every rule to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from safenav.audit.judging import RULES, findings
from safenav.audit.rules.rule import Finding
from safenav.audit.run.situation import Situation
from safenav.trace.fields import plain
from safenav.trace.reading import Trace, read_lines, read_trace
from safenav.trace.records import Arrive, Move, Push


@dataclass(frozen=True)
class Audit:
    """Result of a check. ``complete``: the trace has its outcome; otherwise it was cut off, for
    example by a crash, and the result covers only the part that exists. ``statistics``: counts of
    its lines. ``notes``: parts that were not judged, because they exceed the limits of this
    check."""

    source: str
    outcome: str | None
    complete: bool
    findings: tuple[Finding, ...]
    statistics: Mapping[str, int]
    notes: tuple[Finding, ...] = ()

    @property
    def ok(self) -> bool:
        """Return whether no rule is broken up to the end of the trace."""
        return not self.findings


def check_trace(trace: str | Path | Iterable[str]) -> Audit:
    """Check a trace, given as a path or as its lines. Raises InputError if it is not a trace."""
    if isinstance(trace, str | Path):
        return audit(read_trace(trace))
    return audit(read_lines(trace))


def audit(trace: Trace) -> Audit:
    """Check a trace that has been read. The findings are in the order of the lines they concern."""
    rank = {rule.name: position for position, rule in enumerate(RULES, start=1)}
    records = [_plain_proof(record) for record in trace.records]
    now = Situation(trace.header, records)
    found = [*findings(now, records, [rule() for rule in RULES])]
    found.sort(key=lambda f: (f.line, rank.get(f.rule, 0)))
    outcome = trace.outcome
    return Audit(
        trace.source,
        outcome.outcome.value if outcome else None,
        outcome is not None and not trace.cut_off,
        tuple(one for one in found if not one.note),
        statistics(trace),
        tuple(one for one in found if one.note),
    )


def _plain_proof(record: Any) -> Any:
    """Return the record with its proof, if any, in the form that the file has."""
    proof = getattr(record, "proof", None)
    return record if proof is None else record.__replace__(proof=plain(proof))


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
