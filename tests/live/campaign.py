"""A campaign from the shell: ``python -m live.campaign --seeds 0:2000 --faults`` (in tests/).

Plays the missions of the seeds in time, some of them with faults and some through a world in
another process, and judges each by the world's log; its trace is checked. ``--both`` compares those
without faults with lockstep.
"""

import argparse
import json
import sys
from collections.abc import Mapping
from contextlib import closing, nullcontext
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import yaml
from msgspec.structs import replace

from campaigns.seeds import Judged, SlowError, campaign, chances, crash_of, limited
from live.floor import Floor
from live.judge import Walk, verdict
from live.missions import timed
from live.wire import Wired
from live.worlds import HangError, Live, Serial
from safenav import Mission
from safenav.checked_trace import check_trace
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.trace.writing import as_data

MOST = {
    **{"abort": 0.08, "elsewhere": 0.02, "lost": 0.004, "motor": 0.004, "act": 0.4},
    **{"stale": 0.2, "ghost": 0.004, "late": 0.4, "told_late": 0.1, "told_twice": 0.2},
}
"""The greatest chance of each fault."""


@dataclass(frozen=True)
class Played:
    """``found``: the finding, empty if there is none, ``?`` if the search was too large; ``trace``:
    its lines, without values that depend on the machine."""

    outcome: str
    found: str
    walk: Walk
    injected: Mapping[str, int]
    trace: tuple[str, ...] = ()


MACHINE = ("seconds", "synthesis_seconds", "cached", "verified")
"""The fields of a trace that depend on the machine; ``seconds`` of ``depart`` on the world."""


def faults_of(seed: int) -> dict[str, float]:
    """Some kinds of faults, each with a chance of its own."""
    return chances(seed, MOST)


def scenario_of(data: Mapping[str, Any], clock: Clock) -> Scenario:
    text = yaml.safe_dump(dict(data), sort_keys=False)
    return replace(load_scenario_text(text), clock=clock)


def in_time(text: str) -> Scenario:
    return replace(load_scenario_text(text), clock=Clock.LIVE)


def play(seed: int, *, faults: bool = False, wired: bool = False, patience: float = 120) -> Played:
    """One live run, judged. ``wired``: its world is behind a socket; ``patience``: limit in seconds
    of CPU time."""
    data, lines = timed(seed), list[str]()
    about: dict[str, Any] = {"seed": seed, "faults": faults_of(seed) if faults else {}}
    place = closing(Wired(data, **about)) if wired else nullcontext(Floor(data, **about))
    outcome, found = "no outcome", ""

    def hear(record: Any) -> None:
        lines.append(json.dumps(as_data(record)))

    with place as floor:
        try:
            scenario = scenario_of(data, Clock.LIVE)
            mission = Mission(scenario, world=Live(scenario, floor), listeners=[hear])
            with limited(patience):
                result = mission.run()
            outcome = result.outcome.value
            said = {"outcome": outcome, "explanation": result.explanation}
        except HangError:
            found = "hang: it waits, and nothing is under way"
        except SlowError:
            found = f"slow: no end after {patience} s"
        except Exception as error:
            found = f"crash: {crash_of(error)}"
        cut = wired and found.startswith("slow")  # in a call
        log, injected = ([], {}) if cut else (floor.log, dict(floor.injected))
    walk = Walk(Floor(data).mission, log)
    if found and walk.defects:
        found = f"{walk.defects[0]}; {found}"
    found = found or verdict(data, log, said)
    if found in ("", "?") and (findings := check_trace(lines).findings):
        found = f"audit: {findings[0]}"
    told = tuple(json.dumps(same(json.loads(line))) for line in lines)
    return Played(outcome, found, walk, injected, told)


def same(record: dict[str, Any]) -> dict[str, Any]:
    """A record of a trace, as it is whenever and wherever a run is repeated."""
    return {key: value for key, value in record.items() if key not in MACHINE}


def repeated(seed: int, first: Played, *, faults: bool, wired: bool) -> str:
    """Play a run again, over a socket if it was not before and the other way round; the first
    difference of the traces, empty if there is none."""
    again = play(seed, faults=faults, wired=not wired)
    lines = zip_longest(first.trace, again.trace)
    parted = next((pair for pair in lines if pair[0] != pair[1]), None)
    return "" if parted is None else f"another run when repeated: {parted[0]} / {parted[1]}"


def serially(seed: int) -> Played:
    """The same mission and durations with blocking calls, one robot after the other."""
    data = timed(seed)
    scenario, floor = scenario_of(data, Clock.LOCKSTEP), Floor(data, seed)
    result = Mission(scenario, world=Serial(scenario, floor)).run()
    said = {"outcome": result.outcome.value, "explanation": result.explanation}
    walk = Walk(floor.mission, floor.log)
    return Played(said["outcome"], verdict(data, floor.log, said), walk, {})


def judged(seed: int, options: argparse.Namespace) -> Judged:
    """Judge the run of one seed: every fourth with faults, if faults are wanted."""
    faults = options.faults and seed % 4 == 3
    one = play(seed, faults=faults, wired=seed % 10 == 7, patience=options.patience)
    counts = {one.outcome: 1, "with faults": faults, "undecided": one.found == "?"}
    counts |= {"moves": one.walk.moves, "stopped": one.walk.stopped, **one.injected}
    problem = one.found if one.found != "?" else ""
    if options.both and not faults and not problem:
        other = serially(seed)
        counts["ends alike"] = other.outcome == one.outcome
        if other.outcome != one.outcome:
            problem = f"ends as {one.outcome}, in lockstep as {other.outcome}"
    return Judged([f"{problem}{' (with faults)' * faults}"] if problem else [], counts)


def main() -> int:
    return campaign(judged, __doc__, "faults both")


if __name__ == "__main__":
    sys.exit(main())
