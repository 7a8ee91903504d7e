"""Judgements of traces, motions and bundles in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from safenav.report.terminal.layout import table
from safenav.trace.words import counted

if TYPE_CHECKING:
    from safenav.judge.bundle.check import Judged
    from safenav.run.checked import CheckedTrace

SHOWN = 5
"""Maximum number of findings printed for a file."""
EARLY = ("assumption_violated", "search_limit", "time_limit", "interrupted", "error")
"""Outcomes of runs that ended for a reason that the judge does not decide."""


def trace_lines(found: CheckedTrace) -> Iterator[str]:
    """Yield the first broken rules of a trace, and the limits of its judgement."""
    yield from broken(found.source, found.findings)
    yield from broken(found.source, found.notes, "more not judged")
    if not found.complete:
        yield "The trace ends before its outcome; checked as far as it goes."
    if found.outcome in EARLY:
        yield f"Not judged: why the run ended early ({found.outcome})."
    if not found.findings:
        yield f"{found.source}: no rule broken (outcome {found.outcome or 'unknown'})."
    if found.strays or found.hands:
        yield (
            f"{counted(found.strays, 'step')} ended elsewhere than commanded, "
            f"{counted(found.hands, 'change')} by a user or the world."
        )


def broken(source: object, found: Sequence[object], rest: str = "more") -> Iterator[str]:
    """Yield the first findings about a source. ``rest``: noun for those left out."""
    yield from (f"{source}: {each}" for each in found[:SHOWN])
    if len(found) > SHOWN:
        yield f"and {len(found) - SHOWN} {rest} (--json prints them)"


def bundle_lines(source: str, found: Judged) -> Iterator[str]:
    """Yield the claims that a checked bundle establishes, and the verdict on it."""
    if found.claims:
        rows = [(claim["id"], claim["text"]) for claim in found.claims]
        yield from table(("claim", "established"), rows)
    yield from (f"not compared: {what}" for what in found.not_compared)
    verdict = click.style(found.verdict, fg="green" if found.accepted else "red")
    yield f"{source}: {verdict}" + (f": {found.reason}" if found.reason else "")
