"""Outcomes of runs and verdicts of syntheses, in the words of traces and `expect`."""

from __future__ import annotations

from enum import StrEnum


class Outcome(StrEnum):
    """The end of a run. ``ERROR``: a defect; its trace is kept."""

    COMPLETED = "completed"
    OPERATOR_NEEDED = "operator_needed"
    UNREALIZABLE = "unrealizable"
    TICK_LIMIT = "tick_limit"
    TIME_LIMIT = "time_limit"
    SEARCH_LIMIT = "search_limit"
    ASSUMPTION_VIOLATED = "assumption_violated"
    LATE = "late"
    INTERRUPTED = "interrupted"
    ERROR = "error"


class Verdict(StrEnum):
    """The result of a synthesis. Only REALIZABLE and UNREALIZABLE are proven."""

    REALIZABLE = "realizable"
    UNREALIZABLE = "unrealizable"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"
    INTERRUPTED = "interrupted"
