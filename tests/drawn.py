"""Random scenarios that the loader accepts, and the count of what random tests really played."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, TypeVar

import pytest

from safenav import InputError, Scenario, load_scenario_text

MOST = 60
"""Draws until one is accepted."""
APART = 12_000_000
"""Between the seeds of these draws: more than campaigns have seeds, and a multiple of the small
numbers by which generators tell seeds apart."""
LEAST = 0.8
"""Share of a random test's cases that must have played something."""
PLAYED = "played"

T = TypeVar("T")
D = TypeVar("D", str, dict[str, Any])


def tried(attempt: Callable[[int], T], seed: int) -> T:
    """Return what an attempt with a seed gives: one that raises InputError is repeated with another
    seed, which follows from this one. Fails if 60 in a row are refused."""
    errors = list[str]()
    for again in range(MOST):
        try:
            return attempt(seed + again * APART)
        except InputError as error:
            errors.append(str(error).partition("\n")[0])
    raise AssertionError(f"seed {seed}: {MOST} draws refused, the last for: {errors[-1]}")


def loads(draw: Callable[[int], D], seed: int) -> tuple[D, Scenario]:
    """Return a seed's scenario, as it was drawn and as loaded: the first that is accepted."""

    def attempt(number: int) -> tuple[D, Scenario]:
        made = draw(number)
        return made, load_scenario_text(made if isinstance(made, str) else json.dumps(made))

    return tried(attempt, seed)


class Plays:
    """Cases of each random test that ran, and those of them that played, from the reports of all
    processes of a test run."""

    def __init__(self) -> None:
        self._cases: dict[str, list[bool]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        marks = [value for name, value in report.user_properties if name == PLAYED]
        if marks and report.when == "teardown":
            self._cases.setdefault(report.nodeid.partition("[")[0], []).append(bool(marks[-1]))

    @property
    def idle(self) -> list[str]:
        """A line for each random test of which too few cases played."""
        return [
            f"{name}: {sum(cases)} of {len(cases)} cases played"
            for name, cases in sorted(self._cases.items())
            if len(cases) >= 5 and sum(cases) < LEAST * len(cases)
        ]

    @pytest.hookimpl(wrapper=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> object:
        if self.idle and not hasattr(session.config, "workerinput"):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED
        return (yield)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self._cases:
            terminalreporter.section("random tests: cases that played something")
            for name, cases in sorted(self._cases.items()):
                terminalreporter.line(f"{name}: {sum(cases)} of {len(cases)}")
        for line in self.idle:
            terminalreporter.line(f"ERROR {line}, fewer than {LEAST:.0%}", red=True)
