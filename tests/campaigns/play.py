"""One run of a mission, with faults of its world, an operator and a resumption if wanted, judged.

Without faults the outcome is judged from the moves of the trace, with faults from the log of the
world. ``safenav``'s own audit must accept each trace, and the checker of bundles some of them.
"""

import json
import signal
import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from campaigns.judge.log import Walk, verdict
from campaigns.judge.mission import NotJudgedError, judged_mission
from campaigns.judge.replay import Replay, judge_outcome, told_by_signals
from campaigns.operator import Operator
from campaigns.world import FaultyWorld
from runtime.worlds import Driven
from safenav import Mission
from safenav.certify import bundle as writing
from safenav.errors import InputError, ResourceLimitError, SafenavError, UsageError
from safenav.files import json_line
from safenav.run.checked import check_trace
from safenav.runtime.run.checkpoint import resumption
from safenav.runtime.run.mission import default_synthesizer
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.cache import Cache
from safenav.trace.file import as_data, read_bytes

MOST_PASSES = 20_000
LIMITS = ("tick_limit", "time_limit", "search_limit")
Words = Sequence[tuple[int, str]]


@dataclass
class Played:
    """``found``: findings; ``given``: interventions, each with its pass; ``walk``: the log of a
    faulty world, followed; ``undecided``: the judge of outcomes could not decide."""

    outcome: str = "no outcome"
    found: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    given: list[tuple[int, str]] = field(default_factory=list)
    injected: Mapping[str, int] = field(default_factory=dict)
    passes: int = 0
    walk: Walk | None = None
    undecided: bool = False

    @property
    def kept_away(self) -> bool:
        """Whether the operator has turned an input on, perhaps never off again: its robot then
        pursues another objective until a limit."""
        return any(word.startswith("input") and " on" in word for _, word in self.given)


class SlowError(Exception):
    pass


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise SlowError after this many seconds of CPU time, or six times as many of wall time."""

    def over(*_: object) -> None:
        raise SlowError

    former = {kind: signal.signal(kind, over) for kind in (signal.SIGALRM, signal.SIGPROF)}
    timers = {signal.ITIMER_REAL: 6 * seconds, signal.ITIMER_PROF: seconds}
    for timer, limit in timers.items():
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for timer in timers:
            signal.setitimer(timer, 0)
        for kind, handler in former.items():
            signal.signal(kind, handler)


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
    played = Played()
    live = data.get("clock") == "live"
    world: Any = FaultyWorld(scenario, seed, faults) if live and faults is not None else None
    hand = Operator(scenario, data, seed) if operator is True else None
    words = operator if isinstance(operator, Sequence) else ()
    with tempfile.TemporaryDirectory() as folder:
        cache = Cache(Path(folder) / "cache")
        synthesizer = default_synthesizer(scenario, cache=cache)
        mission = Mission(
            scenario,
            synthesizer,
            world=Driven(scenario) if blocking else world,
            listeners=[_listener(played.lines)],
            attended=live and (attended or (hand is not None and hand.attends)),
        )
        try:
            with limited(patience):
                mission = _run(mission, hand or words, played, kill)
            assert mission.result is not None
            played.outcome = mission.result.outcome.value
        except SlowError:
            played.found.append(f"slow: no end after {patience} s")
        except UsageError as error:
            if not played.lines:
                raise InputError(()) from error  # not for runs in time
            played.found.append(f"refused: {error}")
        except ResourceLimitError:
            played.undecided = True
            return played
        except Exception as error:
            played.found.append(f"crash: {_crash(error)}")
        _judge(data, played, world)
        if certified and not played.found and played.outcome != "interrupted":
            trace = "".join(played.lines).encode()
            try:
                with limited(patience):
                    writing.make_bundle(Path(folder) / "bundle", trace, {}, synthesizer)
            except ResourceLimitError:
                pass  # no verdict
            except (SlowError, SafenavError) as error:
                played.found.append(f"certify: {type(error).__name__} {str(error)[-300:]}")
    return played


def _listener(lines: list[str]) -> Any:
    return lambda record: lines.append(json_line(as_data(record)))


def _run(mission: Mission, hand: Operator | Words, played: Played, kill: int | None) -> Mission:
    """Play a mission to its end; return it, or the one that has resumed it."""
    mission.start()
    while mission.result is None:
        played.passes += 1
        if played.passes > MOST_PASSES:
            mission.give_up()
            played.found += [] if played.kept_away else [f"no end after {MOST_PASSES} passes"]
            break
        if played.passes == kill:
            mission = _resumed(mission, played.lines)
            mission.start()
            continue
        random = isinstance(hand, Operator)
        said = hand.words(mission) if random else [w for k, w in hand if k == played.passes]
        for word in said:
            try:
                mission.intervene(word)
            except UsageError:
                continue
            played.given.append((played.passes, word))
        mission.step()
    return mission


def _resumed(mission: Mission, lines: list[str]) -> Mission:
    """The mission that continues one from its trace, to which ``lines`` now belong."""
    kept = mission._run.kept().checkpoint(len(lines), lines[0].strip().encode())
    trace = read_bytes("".join([*lines, json_line(as_data(kept))]).encode())
    lines.clear()  # the listeners of the other one receive all of them again
    begun = resumption(trace, mission.scenario)
    return Mission(mission.scenario, begun=begun, listeners=[_listener(lines)])


def _judge(data: Mapping[str, Any], played: Played, world: FaultyWorld | None) -> None:
    if world is not None:
        played.injected = dict(world.injected)
        played.walk = _walk(data, world.log, played.given)
        played.found += [f"world: {defect}" for defect in played.walk.defects[:3]]
    if played.found:
        return
    try:
        if findings := check_trace(played.lines).findings:
            played.found.append(f"audit: {findings[0]}")
            return
    except Exception as error:
        played.found.append(f"audit: crash: {_crash(error)}")
        return
    lines = [json.loads(line) for line in played.lines]
    outcome, explanation = lines[-1]["outcome"], lines[-1].get("explanation")
    if outcome in LIMITS and not played.kept_away and not (world and played.walk.unreliable()):
        played.found.append(f"{outcome}: {explanation}")
    if world is None and not played.given:
        played.found += _broken_promises(lines)
    if world is None and any(line["type"] == "assumption" for line in lines):
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
    elif played.walk is not None:
        said = verdict(data, mission, played.walk, outcome)
    else:
        said = judge_outcome(mission, Replay(mission, lines), lines[-1])
    played.undecided = said == "?"
    played.found += [said] if said not in ("", "?") else []


def _broken_promises(lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Plans that the robots have followed to their end, whereupon they need another one although
    nothing else has happened: a plan completes the mission, or all that it serves. Rounds that are
    due within a time continue after that."""
    if any("within" in robot for robot in lines[0]["scenario"]["robots"]):
        return []
    ended, found = False, list[str]()
    for line in lines:
        if line["type"] == "plan_end":
            ended = line["reason"] == "reached"
        elif line["type"] == "plan" and ended:
            found.append(f"plan: it ends in tick {line['tick']} without what it promises")
        elif line["type"] not in ("move", "depart", "arrive", "goal"):
            ended = ended and bool(line.get("note"))
    return found[:1]


def _walk(data: Mapping[str, Any], log: Any, given: Words) -> Walk:
    """The log, with the robots whose objectives users change, and those that they put back."""
    words = [word.split() for _, word in given]
    changes = data.get("changes", ())
    told = {change["robot"] for change in changes}
    told |= {name for name, robot in data["robots"].items() if "when" in robot}
    told |= {word[1] for word in words if word[0] == "objective"}
    back = {word[1] for word in words if word[0] == "service"}
    back |= {change["robot"] for change in changes if change.get("service") == "back"}
    return Walk(data, log, told, back)


def _crash(error: Exception) -> str:
    """A crash and its position in words."""
    where = traceback.extract_tb(error.__traceback__)[-3:]
    way = " < ".join(f"{w.filename.split('/')[-1]}:{w.lineno}" for w in where[::-1])
    return f"{type(error).__name__}: {error} ({way})"
