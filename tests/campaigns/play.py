"""One run of a mission, with faults of its world, an operator and a resumption if wanted, judged.

Without faults the outcome is judged from the moves of the trace, with faults from the log of the
world. safenav's own judge must accept each trace, and the checker of bundles some of them.
"""

import json
import signal
import tempfile
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from campaigns.judge.log import Walk, judge_log
from campaigns.judge.mission import NotJudgedError, judged_mission
from campaigns.judge.trace import broken_promises, judge_trace, told_by_signals
from campaigns.world import FaultyWorld
from runtime.played import Run
from runtime.worlds import Driven
from safenav import (
    InputError,
    Mission,
    ResourceLimitError,
    Scenario,
    Synthesizer,
    UsageError,
    check_trace,
    first_failure,
    load_scenario_text,
    make_bundle,
    read_trace,
    resumption,
)

MOST_PASSES = 20_000
LIMITS = ("tick_limit", "time_limit", "search_limit")
Words = Sequence[tuple[int, str]]
"""Interventions, each with its pass."""


@dataclass
class Played:
    """``found``: findings; ``walk``: the log of a faulty world, followed; ``undecided``: the judge
    of outcomes could not decide."""

    outcome: str = "no outcome"
    found: list[str] = field(default_factory=list)
    run: Run = field(default_factory=Run)
    given: list[tuple[int, str]] = field(default_factory=list)
    injected: Mapping[str, int] = field(default_factory=dict)
    passes: int = 0
    walk: Walk | None = None
    undecided: bool = False
    attended: bool = False

    @property
    def kept_away(self) -> bool:
        """Whether the operator has turned an input on, perhaps never off again: its robot then
        pursues another objective until a limit."""
        return any(word.startswith("input") and " on" in word for _, word in self.given)

    @contextmanager
    def watched(self, what: str, seconds: float) -> Iterator[None]:
        """Make errors, and more than this many seconds of CPU time or six times as many of wall
        time, findings."""

        def over(*_: object) -> None:
            raise SlowError(f"no end after {seconds} s")

        timers = {signal.ITIMER_PROF: (signal.SIGPROF, seconds)}
        timers[signal.ITIMER_REAL] = signal.SIGALRM, 6 * seconds
        former = {kind: signal.signal(kind, over) for kind, _ in timers.values()}
        try:
            for timer, (_, limit) in timers.items():
                signal.setitimer(timer, limit)
            yield
        except ResourceLimitError:
            raise
        except Exception as error:
            if isinstance(error, UsageError) and not self.passes:
                raise InputError(()) from error  # not for runs in time
            where = traceback.extract_tb(error.__traceback__)[-3:]
            way = " < ".join(f"{w.filename.split('/')[-1]}:{w.lineno}" for w in where[::-1])
            how = "slow" if isinstance(error, SlowError) else what
            self.found.append(f"{how}: {type(error).__name__} {str(error)[-300:]} ({way})")
        finally:
            for timer in timers:
                signal.setitimer(timer, 0)
            for kind, handler in former.items():
                signal.signal(kind, handler)


class SlowError(Exception):
    pass


def play(
    data: Mapping[str, Any],
    seed: int = 0,
    *,
    faults: Mapping[str, float] | None = None,
    operator: bool | Words = False,
    attended: bool = False,
    kill: int | None = None,
    blocking: bool = False,
    certified: bool = False,
    patience: float = 60,
) -> Played:
    """One run, judged. ``seed``: of the faults and the operator; ``operator``: at random, or the
    words before each pass; ``kill``: the pass before which the run is cut off and resumed;
    ``blocking``: the world is behind calls, and the run does not know its state. Raises InputError
    for a scenario that is refused."""
    scenario = load_scenario_text(json.dumps(dict(data)))
    played, live = Played(), data.get("clock") == "live"
    faulty = FaultyWorld(scenario, seed, faults) if live and faults is not None else None
    hand = Operator(scenario, data, seed, played) if operator is True else None
    words = operator if isinstance(operator, Sequence) else ()
    played.attended = live and (attended or (hand is not None and hand.attends))
    mission = Mission(
        scenario,
        world=Driven(scenario) if blocking else faulty,
        listeners=[lambda record: played.run(record)],
        attended=played.attended,
        checkpoints=kill is not None,
    )
    said = hand.words if hand else lambda _: [w for k, w in words if k == played.passes]
    try:
        with played.watched("crash", patience):
            _run(mission, said, played, kill)
    except ResourceLimitError:
        played.undecided = True
        return played
    _judge(data, played, faulty)
    if certified and not played.found and played.outcome != "interrupted":
        trace, synthesizer = "".join(played.run.lines).encode(), Synthesizer(verifier=first_failure)
        with (
            tempfile.TemporaryDirectory() as folder,
            suppress(ResourceLimitError),  # no verdict
            played.watched("certify", patience),
        ):
            make_bundle(Path(folder) / "bundle", trace, {}, synthesizer)
    return played


def _run(
    mission: Mission, said: Callable[[Mission], list[str]], played: Played, kill: int | None
) -> None:
    """Play a mission to its end, or cut it off and play the one that resumes it."""
    mission.start()
    while mission.result is None:
        played.passes += 1
        if played.passes > MOST_PASSES:
            mission.give_up()
            played.found += [] if played.kept_away else [f"no end after {MOST_PASSES} passes"]
            break
        for word in said(mission):
            try:
                mission.intervene(word)
            except UsageError:
                continue
            played.given.append((played.passes, word))
        mission.step()
        if played.passes == kill and mission.result is None:
            mission = _resumed(mission, played)
            mission.start()
    assert mission.result is not None
    played.outcome = mission.result.outcome.value


def _resumed(mission: Mission, played: Played) -> Mission:
    """The mission that plays the last pass again from the trace, of which it tells all lines."""
    mission.give_up()
    with tempfile.TemporaryDirectory() as folder:
        (trace := Path(folder) / "t.jsonl").write_text("".join(played.run.lines))
        begun = resumption(read_trace(trace), mission.scenario)
    played.run = Run()
    return Mission(mission.scenario, begun=begun, listeners=[played.run])


def _judge(data: Mapping[str, Any], played: Played, world: FaultyWorld | None) -> None:
    walk = None
    if world is not None:
        played.injected = dict(world.injected)
        walk = played.walk = Walk(data, world.log, [word for _, word in played.given])
        played.found += [f"world: {defect}" for defect in walk.defects[:3]]
    if played.found:
        return
    with played.watched("judge: crash", 600):
        played.found += [f"judge: {one}" for one in check_trace(played.run.lines).findings[:1]]
    if played.found:
        return
    lines = played.run.records
    outcome, explanation = lines[-1]["outcome"], lines[-1].get("explanation")
    switched = walk and "has another objective while" in str(explanation)  # no time is told
    if outcome in LIMITS and not (played.kept_away or switched or (walk and walk.unreliable())):
        played.found.append(f"{outcome}: {explanation}")
    if walk is None and not played.given:
        played.found += broken_promises(lines)
    if walk is None and any(line["type"] == "assumption" for line in lines):
        played.found.append("a simulated robot breaks an assumption of another one")
    try:
        mission = judged_mission(data)
    except NotJudgedError:
        played.undecided = True
        return
    if data.get("coordination") == "assignable" and not played.given:
        played.found += told_by_signals(lines)
    if played.given or any("tracks" in robot for robot in data["robots"].values()):
        said = "?"
    else:
        said = judge_log(walk, outcome) if walk is not None else judge_trace(mission, lines)
    played.undecided = said == "?"
    played.found += [said] if said not in ("", "?") else []


class Operator:
    """An operator who intervenes at random. ``attends``: whether the run waits for the operator."""

    def __init__(self, scenario: Scenario, data: Any, seed: int, played: Played) -> None:
        self.random, self.data, self.played = Random(f"operator of {seed}"), data, played
        self.attends = self.random.random() < 0.6
        self.often = self.random.choice([0.02, 0.05, 0.15])
        self.left = self.random.randint(1, 6)
        self.free = [*scenario.map.free]
        types = (data.get("catalogue") or {}).get("obstacles") or {}
        self.orders = [name for name, it in types.items() if it.get("blocks") == []]

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
        random = self.random
        turning = {one.name: one.start.heading is not None for one in mission.scenario.robots}
        robot = random.choice([*turning])
        named = [line.get("obstacle") for line in self.played.run.records]
        met = dict.fromkeys(name for name in named if isinstance(name, str))
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
