"""A campaign from the shell: ``python -m fuzz.blend --seeds 0:99 --faults --operator`` (in tests/).

Plays live scenarios with many keys, in a world with faults, with an operator who intervenes at
random; each run is judged by the world's log, and its trace is checked and certified.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import pytest

from campaigns.seeds import Judged, SlowError, campaign, crash_of, limited
from certify.making import checked
from drawn import tried
from fuzz.mixed import Data, formula_mission, mixed_mission
from fuzz.troubles import Troubled, faults_of
from fuzz.watch import Watch
from safenav import Mission
from safenav.certify import bundle as writing
from safenav.certify.record import syntheses_of
from safenav.certify.run import Kept
from safenav.checked_trace import check_trace
from safenav.errors import InputError, SafenavError, UsageError
from safenav.lines import json_line
from safenav.runtime.intervention.reading import read_intervention
from safenav.runtime.run.mission import default_synthesizer
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.cache import Cache
from safenav.trace.writing import as_data
from safenav.world.moves import Mobility

MOST_PASSES = 20_000
LIMITS = ("tick_limit", "time_limit", "search_limit")


@dataclass
class Played:
    """``found``: the finding, if any; ``given``: interventions, each with its pass."""

    outcome: str = "no outcome"
    found: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    injected: Mapping[str, int] = field(default_factory=dict)
    given: list[tuple[int, str]] = field(default_factory=list)

    @property
    def kept_away(self) -> bool:
        """Whether the operator has turned an input on, perhaps never off again: its robot then
        pursues another objective until a limit."""
        return any(word.startswith("input") and " on" in word for _, word in self.given)


def play(
    data: Mapping[str, Any],
    seed: int,
    *,
    faults: Mapping[str, float] | None = None,
    operator: bool = False,
    certified: bool = True,
    patience: float = 60,
    words: list[tuple[int, str]] | None = None,
) -> Played:
    """One run, judged. Raises InputError for a scenario that is refused."""
    scenario = load_scenario_text(json.dumps(data))
    live = data.get("clock") == "live"
    played = Played()
    world = Troubled(scenario, seed, faults) if live and faults is not None else None
    with tempfile.TemporaryDirectory() as folder:
        cache = Cache(Path(folder) / "cache")
        synthesizer, kept = default_synthesizer(scenario, cache=cache), Kept()
        hand = Hand(scenario, data, seed) if operator or words is not None else None
        mission = Mission(
            scenario,
            synthesizer,
            world=world,
            listeners=[lambda record: played.lines.append(json_line(as_data(record)))],
            progress=kept,
            attended=hand is not None and live and hand.attends,
        )
        try:
            with limited(patience):
                _run(mission, hand, played, words)
            assert mission.result is not None
            played.outcome = mission.result.outcome.value
        except SlowError:
            played.found.append(f"slow: no end after {patience} s")
        except UsageError as error:
            if not played.lines:
                raise InputError(()) from error  # not for runs in time
            played.found.append(f"refused: {error}")
        except Exception as error:
            played.found.append(f"crash: {crash_of(error)}")
        if world is not None:
            played.injected = dict(world.injected)
            changed = {c["robot"] for c in data.get("changes", ())}
            changed |= {n for n, r in data["robots"].items() if "when" in r}
            changed |= {word.split()[1] for _, word in played.given if word.startswith("objective")}
            back = {word.split()[1] for _, word in played.given if word.startswith("service")}
            back |= {c["robot"] for c in data.get("changes", ()) if c.get("service") == "back"}
            watch = Watch(data, world.log, changed, back)
            played.found += [f"world: {defect}" for defect in watch.defects[:3]]
        if played.found:
            return played
        try:
            if findings := check_trace(played.lines).findings:
                played.found.append(f"audit: {findings[0]}")
        except Exception as error:
            played.found.append(f"audit: crash: {type(error).__name__}: {error}")
        if played.outcome in LIMITS and not played.kept_away:
            played.found.append(f"{played.outcome}: {json.loads(played.lines[-1])['explanation']}")
        if certified and not played.found and played.outcome != "interrupted":
            trace = "".join(played.lines).encode()
            try:
                with limited(patience), pytest.MonkeyPatch.context() as patch:
                    patch.setattr(writing, "check_bundle", checked)
                    kept.complete(syntheses_of(trace, "run"), cache, synthesizer)
                    writing.make_bundle(Path(folder) / "bundle", trace, {}, kept, synthesizer)
            except SlowError:
                played.found.append("certify: slow")
            except SafenavError as error:
                played.found.append(f"certify: {str(error)[-300:]}")
    return played


def _run(
    mission: Mission,
    hand: Hand | None,
    played: Played,
    words: list[tuple[int, str]] | None,
) -> None:
    mission.start()
    passes = 0
    left = list(words or ())
    while mission.result is None:
        passes += 1
        if passes > MOST_PASSES:
            mission.give_up()
            played.found += [] if played.kept_away else [f"no end after {passes} passes"]
            return
        if words is not None:
            said = [word for when, word in left if when == passes]
        else:
            said = hand.words(mission) if hand is not None else []
        for word in said:
            try:
                mission.intervene(read_intervention(word, mission.scenario))
            except UsageError:
                continue
            played.given.append((passes, word))
        mission.step()


class Hand:
    """An operator who intervenes at random. ``attends``: whether the run waits for the operator."""

    def __init__(self, scenario: Scenario, data: Mapping[str, Any], seed: int) -> None:
        self.random = Random(f"operator of {seed}")
        self.data = data
        self.attends = self.random.random() < 0.6
        self.often = self.random.choice([0.02, 0.05, 0.15])
        self.left = self.random.randint(1, 6)
        self.free = [*scenario.map.free]
        self.orders = [t for t in data["catalogue"]["obstacles"] if t.startswith("p")]

    def words(self, mission: Mission) -> list[str]:
        """Return the interventions before a pass."""
        waits = mission.waiting is not None
        if not (waits or (self.left and self.random.random() < self.often)):
            return []
        if waits and not self.left:
            return ["give_up"]
        self.left -= 1
        count = self.random.choice([1, 1, 2, 3])
        return [w for w in (self._word(mission) for _ in range(count)) if w is not None]

    def _word(self, mission: Mission) -> str | None:
        random, run = self.random, mission._run
        turning = {m.name: m.robot.model.mobility is Mobility.HEADING for m in run.team.members}
        robot = random.choice([*turning])
        pairs = zip(run.team.obstacles, run.state.obstacles, strict=True)
        met = [one.name for one, now in pairs if now.known]
        known = [name for name in met if not name.startswith("lost_")]
        there = [name for name in known if not name.startswith("p")]
        other = random.choice(self.free)
        match random.randrange(12):
            case 0 | 1 | 2 if known:
                return f"resolved {random.choice(known)}"
            case 3 if there:  # a carried load is never declared permanent
                return f"permanent {random.choice(there)}"
            case 4 | 5:
                heading = random.choice(["north", "east", "south", "west"])
                return f"put_back {robot} {other}" + (f" {heading}" if turning[robot] else "")
            case 6:
                return f"service {robot} out"
            case 7 | 8:
                return f"service {robot} back"
            case 9:
                kind = random.choice(["visit", "cover", "once", "patrol"])
                return f"objective {robot} {{{kind}: {random.sample(self.free, 2)}}}"
            case 10 if self.orders:
                return f"order {random.choice(self.orders)} {other}"
            case 11 if self.data.get("inputs"):
                return f"input alarm {random.choice(['on', 'off'])}"
        return None


def judged(seed: int, options: argparse.Namespace) -> Judged:
    """The run of one seed."""
    made = formula_mission if options.formulas else mixed_mission
    faults = faults_of(seed) if options.faults else None
    about: Any = {"faults": faults, "operator": options.operator, "patience": options.patience}

    def attempt(drawn: int) -> tuple[Data, Played]:
        data = made(drawn, live=not options.lockstep)
        return data, play(data, seed, **about)

    (data, one), refused = tried(attempt, seed)
    counts = {
        "accepted": 1,
        "refused": refused,
        one.outcome: 1,
        "interventions": len(one.given),
    }
    counts |= one.injected
    files = {"yaml": json.dumps(data), "jsonl": "".join(one.lines), "words": json.dumps(one.given)}
    return Judged(one.found, counts, files)


if __name__ == "__main__":
    sys.exit(campaign(judged, __doc__, "lockstep faults operator formulas"))
