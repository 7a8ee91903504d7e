"""Runs in memory: play a scenario, query its trace, and judge it."""

import json
import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from safenav import Mission, Scenario, TraceWriter, check_trace, load_scenario_text

Line = dict[str, Any]


class Run:
    """The records of one run's trace; a listener of missions."""

    def __init__(self, records: Iterable[Line] = ()) -> None:
        self._records, self._heard = [*records], list[Any]()
        self._lines = [json.dumps(line, separators=(",", ":")) + "\n" for line in self._records]

    def __call__(self, record: Any) -> None:
        self._heard.append(record)

    @property
    def records(self) -> list[Line]:
        """The lines as a trace file has them, so far."""
        if self._heard:
            with TemporaryDirectory() as folder:
                with TraceWriter(file := Path(folder) / "t.jsonl") as writer:
                    for record in self._heard:
                        writer(record)
                written = file.read_text().splitlines(keepends=True)
            self._lines += written
            self._records += map(json.loads, written)
            self._heard.clear()
        return self._records

    def all(self, kind: str, **fields: object) -> list[Line]:
        """The records of a type whose fields have these values."""
        return [
            r
            for r in self.records
            if r["type"] == kind and all(r.get(k) == v for k, v in fields.items())
        ]

    def one(self, kind: str, **fields: object) -> Line:
        """The only such record."""
        found = self.all(kind, **fields)
        assert len(found) == 1, f"{len(found)} records {kind} {fields}"
        return found[0]

    @property
    def outcome(self) -> Line:
        return self.one("outcome")

    @property
    def still_open(self) -> list[str]:
        """The orders that the outcome names as still open, without their reasons."""
        told = self.outcome["explanation"].partition("still open: ")[2]
        while "(" in told:
            told = re.sub(r" \([^()]*\)", "", told)
        return told.split(", ") if told else []

    @property
    def tally(self) -> str:
        """The outcome, when the run ended, and how many lines of each type the trace has, moves by
        what they followed, checkpoints and syntheses apart."""
        end = self.outcome
        kinds = Counter(
            " ".join(filter(None, (one["type"], one.get("by")))) for one in self.records
        )
        apart = ("header", "outcome", "checkpoint", "synthesis")
        told = ", ".join(f"{kinds[kind]} {kind}" for kind in sorted(kinds) if kind not in apart)
        return f"{end['outcome']} at {round(end.get('makespan', end['tick']), 3)}; {told}"

    @property
    def lines(self) -> list[str]:
        """The trace as its file has it."""
        return self._lines if self.records else []

    @property
    def findings(self) -> str:
        """Return the judge's findings in the present records, one row each."""
        return "\n".join(map(str, check_trace(self.lines).findings))


def whole(text: str) -> str:
    """Return the full text of a YAML scenario that may be indented and omit the format version."""
    return ("" if "safenav" in text else "safenav: 1\n") + textwrap.dedent(text)


def loaded(text: str) -> Scenario:
    """The scenario in such a text."""
    return load_scenario_text(whole(text), "scenario.yaml")


Written = str | Mapping[str, Any] | Scenario
"""A scenario, perhaps as YAML text or as data."""


def _mission(scenario: Written, world: Any, attended: bool = False) -> tuple[Mission, Run]:
    if isinstance(scenario, Mapping):
        scenario = json.dumps(scenario)
    if isinstance(scenario, str):
        scenario = loaded(scenario)
    world, run = world(scenario) if callable(world) else world, Run()
    return Mission(scenario, world=world, listeners=[run], attended=attended), run


def begin(scenario: Written, *, world: Any = None, attended: bool = False) -> tuple[Mission, Run]:
    """Return a mission after its start, to be stepped, and its records so far."""
    mission, run = _mission(scenario, world, attended)
    mission.start()
    return mission, run


def play(scenario: Written, *, world: Any = None, lies: bool = False) -> Run:
    """Run a scenario; its trace must pass the judge, unless its world ``lies``. ``world``: a world,
    or a function that makes one from the scenario."""
    mission, run = _mission(scenario, world)
    mission.run()
    assert lies or not run.findings, run.findings
    return run


def completed(scenario: Written, *, world: Any = None) -> Run:
    """Play a run, which must complete its mission."""
    run = play(scenario, world=world)
    assert run.outcome["outcome"] == "completed", run.outcome["explanation"]
    return run
