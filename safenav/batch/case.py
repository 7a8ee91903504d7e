"""Cases of a batch and their results as data, which processes exchange as JSON; and the comparison
of a run with its scenario's expectations."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from msgspec import Struct, field

import safenav
from safenav.errors import Outcome
from safenav.scenario.model import Expect
from safenav.scenario.objective import Word, number_word
from safenav.scenario.yaml.document import Place
from safenav.trace import records
from safenav.trace.words import obstacle_words

Settings = Mapping[str, Any]
"""The values that replace present ones, by dotted paths into the scenario (``limits.ticks``)."""
_HALF = 60
"""Number of remaining characters at each end of a long name."""


class CaseVerdict(StrEnum):
    """The status of a case."""

    PASSED = "passed"
    DIFFERENT = "different"
    """The run ended, but not as expected."""
    INVALID = "invalid"
    """The scenario does not load."""
    LIMIT = "limit"
    """A synthesis reached its time or memory limit."""
    ERROR = "error"
    """The synthesizer failed, or safenav has a defect."""
    CRASHED = "crashed"
    """Its process died."""
    HUNG = "hung"
    """It did not end within the wall-clock limit."""


class Case(Struct, frozen=True):
    """A run of a batch: a scenario with some replaced settings.

    ``name`` is unique within a batch and the same in the next batch. ``text`` is the scenario (None
    if the file could not be read, which the run reports). ``references`` is a digest of the files
    that it names; ``places``: the settings' lines and columns in their matrix file.
    """

    name: str
    file: str
    text: str | None = None
    settings: Settings = field(default_factory=dict)
    references: str = ""
    places: Mapping[str, Place] = field(default_factory=dict)

    @property
    def fingerprint(self) -> str:
        """A hash of the case and safenav's version: a result with an equal hash is still valid."""
        version, settings = safenav.__version__, dict(self.settings)
        made_of = [version, self.name, self.file, self.text, settings, self.references]
        return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()[:16]

    def result(self, verdict: CaseVerdict, reasons: list[str], detail: str = "") -> Result:
        """Return a result of this case without data of a run."""
        settings = dict(self.settings)
        return Result(self.name, self.file, settings, self.fingerprint, verdict, reasons, detail)


def file_name(name: str, digest: str) -> str:
    """Return a file name for a case: its name, shortened in the middle if it is long, and a digest,
    which distinguishes cases with equal shortened names."""
    fit = re.sub(r"[^A-Za-z0-9._=-]+", "_", name).strip("._")
    if len(fit) > 2 * _HALF:
        fit = f"{fit[:_HALF]}...{fit[-_HALF:]}"
    return f"{fit}-{digest[:8]}"


class Conditions(Struct, frozen=True):
    """Settings for each case's run. ``seconds``: wall-clock limit of a case. ``certify``: the
    folder for the bundles of the runs (docs/certify.md), or None. ``directory``: the folder to
    which paths in scenarios are relative."""

    seconds: float = 600.0
    certify: str | None = None
    directory: str = field(default_factory=lambda: str(Path.cwd()))


class Result(Struct, frozen=True):
    """The result of a case. ``reasons``: differences or errors, one sentence each; ``detail``: a
    traceback or the last output of the process; ``requirements``: by name, verdict and robustness
    on the motion of the run; ``makespan``: seconds of a live run on its own clock; ``seconds``:
    duration of the run; ``wall_seconds``: seconds from the process's receipt of the case to its
    result."""

    name: str
    file: str
    settings: dict[str, Any]
    fingerprint: str
    verdict: CaseVerdict
    reasons: list[str] = field(default_factory=list)
    detail: str = ""
    scenario: str | None = None
    outcome: str | None = None
    cause: str | None = None
    explanation: str | None = None
    ticks: int | None = None
    makespan: float | None = None
    rounds: dict[str, int] | None = None
    resolved: list[str] | None = None
    blocked: list[str] | None = None
    late: list[str] | None = None
    helpers: dict[str, str] | None = None
    requirements: dict[str, dict[str, Any]] | None = None
    syntheses: int | None = None
    synthesis_seconds: float | None = None
    seconds: float | None = None
    wall_seconds: float = 0.0
    artifacts: list[str] = field(default_factory=list)

    @property
    def passed(self) -> bool:
        return self.verdict is CaseVerdict.PASSED

    @property
    def duration(self) -> float:
        """Duration of the run in seconds, or of the attempt if the run did not end."""
        return self.wall_seconds if self.seconds is None else self.seconds


class Ledger(Struct):
    """A listener that keeps the data for the check of expectations. ``orders``: open orders;
    ``live``: whether ticks count passes of a live run; ``end``: the last line, if the run ended."""

    orders: list[str] = field(default_factory=list)
    resolved: list[str] = field(default_factory=list)
    blocked: list[str] = field(default_factory=list)
    helpers: dict[str, str] = field(default_factory=dict)
    live: bool = False
    end: records.End | None = None

    def __call__(self, event: records.Record) -> None:
        match event:
            case records.Header():
                self.live = event.live
            case records.Ordered():
                self.orders.append(event.obstacle)
            case records.Resolved():
                self.resolved.append(event.obstacle)
                self._over(event.obstacle)
            case records.Gone():  # for example, an operator has delivered the order
                self._over(event.obstacle)
            case records.KnownObstacle():
                self.blocked.append(event.obstacle)
            case records.Request(helpers=(helper, *_)):
                self.helpers[event.obstacle] = helper
            case records.End():
                self.end = event

    def _over(self, obstacle: str) -> None:
        self.orders = [order for order in self.orders if order != obstacle]

    def measured(self, name: str) -> dict[str, Any]:
        """Return the result of the case ``name`` as data, from the lines of its run."""
        end = self.end
        assert end is not None
        return {
            "scenario": name,
            "outcome": end.outcome.value,
            "explanation": end.explanation,
            "cause": end.cause,
            "resolved": self.resolved,
            "blocked": self.blocked,
            "late": list(end.late or ()),
            "helpers": self.helpers,
            "rounds": dict(end.rounds),
            "ticks": end.ticks,
            "seconds": end.seconds,
            "makespan": None if end.makespan is None else round(end.makespan, 6),
            "syntheses": end.syntheses,
            "synthesis_seconds": end.synthesis_seconds,
        }


def differences(expect: Expect, ledger: Ledger, word: Word = number_word) -> list[str]:
    """Return the differences between the run and ``expect``, one sentence each. ``word`` returns
    the name of a region."""
    end = ledger.end
    assert end is not None
    found = []
    if expect.outcome is not None and end.outcome is not expect.outcome:
        found.append(f"outcome: expected {expect.outcome.value}, got {end.outcome.value}")
    for kind, wanted, got in (
        ("resolved", expect.resolved, ledger.resolved),
        ("blocked", expect.blocked, ledger.blocked),
        ("late", expect.late or frozenset(), end.late or ()),
    ):
        if wanted is not None and set(got) != wanted:
            found.append(f"{kind}: expected {_names(wanted, word)}, got {_names(got, word)}")
    left = ledger.orders if expect.resolved is expect.blocked is None else []
    if left and end.outcome is Outcome.COMPLETED:
        found.append(f"orders: expected none to stay open, got {_names(left, word)}")
    for obstacle, robot in (expect.helpers or {}).items():
        helper = ledger.helpers.get(obstacle)
        if helper != robot:
            asked = f"{helper} was" if helper else "no robot was"
            what = obstacle_words(obstacle, word)
            found.append(f"helpers: expected {robot} to be requested for {what}, but {asked}")
    if expect.ticks is not None and end.ticks > expect.ticks and not ledger.live:
        found.append(f"ticks: expected at most {expect.ticks}, got {end.ticks}")
    for robot, rounds in end.rounds.items():
        if expect.rounds is not None and rounds < expect.rounds:
            found.append(f"rounds: expected at least {expect.rounds} of {robot}, got {rounds}")
    return found


def _names(obstacles: Iterable[str], word: Word) -> str:
    return "[" + ", ".join(obstacle_words(obstacle, word) for obstacle in sorted(obstacles)) + "]"
