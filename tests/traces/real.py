"""Traces of shipped scenarios, each run once for all tests."""

from once import trace_of_shipped

NAMES = ("case_study_1_beliefs", "case_study_2", "case_study_3", "corridor_swap", "two_digits")


def real_trace(name: str) -> str:
    """The trace of a run of ``scenarios/NAME.yaml``."""
    return trace_of_shipped(name).read_text()
