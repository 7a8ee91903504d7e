"""The best and the worst times of resolutions, and the simulated deadlines of rounds and of the
mission: for people and as data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from safenav.runtime.analysis.team_simulation import TeamSimulation
from safenav.runtime.deadlines.worst import Times, Worst
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Word
from safenav.trace.words import counted, obstacle_words

MOST_SHOWN = 3
"""Maximum number of possible helpers that a line names."""


def worst_lines(cases: Sequence[Worst], word: Word) -> Iterator[str]:
    """``door@47: at best 2, at worst 9 ticks after its request (digit at 28 needs 9 ticks)``."""
    for case in cases:
        name, alone, around = obstacle_words(case.obstacle.name, word), case.alone, case.surrounded
        yield f"{name}: {_times(alone)} ({_moment(alone, word)})"
        if around is not None and _tells_more(around, alone):
            at = _moment(around, word)
            yield f"    with the other obstacles present: {_worst(around)} ({at})"
        if case.limit is not None:
            late = [t for t in (alone, around) if t and (t.worst is None or t.worst > case.limit)]
            if late:
                at = _moment(late[0], word)
                yield f"    resolve_within {case.limit}: not with {at}"


def _tells_more(around: Times, alone: Times) -> bool:
    """Whether the worst time beside other obstacles is news: a search that was cut short gives a
    lower bound only, which must exceed the time without them."""
    if around.worst is None or alone.worst is None or (around.whole and around.nearest):
        return around.worst != alone.worst
    return around.worst > alone.worst


def worst_data(case: Worst) -> dict[str, Any]:
    return {
        "obstacle": case.obstacle.name,
        "resolve_within": case.limit,
        "alone": _data(case.alone),
        "with_others": None if case.surrounded is None else _data(case.surrounded),
    }


def _data(times: Times) -> dict[str, Any]:
    at = {name: pose.place for name, pose in times.moment.items()}
    data = {"best": times.best, "worst": times.worst, "moment": at, "bids": dict(times.bids)}
    return {**data, "all_moments": times.whole, "nearest": times.nearest}


def _times(times: Times) -> str:
    if times.best is None:
        return "never resolved" if times.whole else _worst(times)
    least = "" if times.whole or not times.best else " or fewer"
    return f"at best {times.best}{least}, {_worst(times)}"


def _worst(times: Times) -> str:
    if times.worst is None:
        return "at worst never"
    ticks = counted(times.worst, "tick")
    exact = times.whole and times.nearest
    most = ticks if exact else f"{times.worst} or more ticks"
    return f"at worst {most} after its request"


def _moment(times: Times, word: Word) -> str:
    """Return the regions of the robots in the worst case, and the distances of the nearest robots
    with the action."""
    bids = times.bids
    helpers = [name for name in times.moment if name in bids]
    helpers.sort(key=lambda name: (bids[name] is None, bids[name] or 0))
    parts = []
    for name in (*(n for n in times.moment if n not in bids), *helpers[:MOST_SHOWN]):
        pose = times.moment[name]
        facing = "" if pose.heading is None else f" facing {pose.heading.label}"
        parts.append(f"{name} at {word(pose.region)}{facing}")
        if name in bids:
            bid = bids[name]
            distance = "cannot reach it" if bid is None else f"needs {counted(bid, 'tick')}"
            parts[-1] += f" {distance}"
    far = len(helpers[MOST_SHOWN:])
    return ", ".join((*parts, f"{counted(far, 'robot')} farther away") if far else parts)


MISSION = "mission"


def deadline_lines(scenario: Scenario, ahead: TeamSimulation | None) -> Iterator[str]:
    """``within 12 of digit: kept, as simulated until the mission is completed in tick 30``."""
    for of, most in _promised(scenario) if ahead is not None else ():
        assert ahead is not None
        what = f"by {most}" if of == MISSION else f"within {most} of {of}"
        yield f"{what}: {_verdict(of, most, ahead, _steps(scenario, ahead))}"


def battery_lines(scenario: Scenario, ahead: TeamSimulation | None) -> Iterator[str]:
    """``the battery of cart is empty in tick 48, as simulated without obstacles``."""
    if ahead is None or scenario.flat is not None:
        return
    for robot, tick in ahead.flat.items():
        found = f"the battery of {robot} is empty in tick {tick}, as simulated"
        yield found + _steps(scenario, ahead)


def deadline_data(scenario: Scenario, ahead: TeamSimulation | None) -> list[dict[str, Any]]:
    """Return the deadlines as data: ``verdict`` is kept, late or none."""
    if ahead is None:
        return []
    found = []
    for of, most in _promised(scenario):
        verdict = "late" if _late(of, most, ahead) is not None else "kept"
        decided = ahead.completed is not None or (ahead.repeats is not None and of != MISSION)
        verdict = verdict if verdict == "late" or decided else "none"
        more = {"completed": ahead.completed, "repeats": ahead.repeats, "why": ahead.why or None}
        found.append({"of": of, "most": most, "verdict": verdict, **more})
    return found


def _promised(scenario: Scenario) -> Iterator[tuple[str, int]]:
    for robot in scenario.robots:
        if robot.within is not None:
            yield robot.name, robot.within
    if scenario.until.by is not None:
        yield MISSION, scenario.until.by


def _late(of: str, most: int, ahead: TeamSimulation) -> int | None:
    """Return the first tick after a missed deadline; None if it is not missed."""
    if of == MISSION and ahead.completed is not None and ahead.completed > most:
        return most + 1
    return ahead.late.get(of)


def _steps(scenario: Scenario, ahead: TeamSimulation) -> str:
    """Return, in words, that the simulation leaves out obstacles or takes the slowest steps."""
    hidden = any(not obstacle.ordered for obstacle in scenario.obstacles)
    unseen = " without obstacles" if hidden else ""
    return unseen + (", with the slowest steps" if ahead.slowest else "")


def _verdict(of: str, most: int, ahead: TeamSimulation, steps: str) -> str:
    late = _late(of, most, ahead)
    if ahead.why:
        return f"no guarantee: {ahead.why}"
    if late is not None:
        done = f", completed in tick {ahead.completed}" if ahead.completed is not None else ""
        worst = " at worst" if ahead.slowest else ""
        return f"late in tick {late}{worst}, as simulated{steps}{done if of == MISSION else ''}"
    if ahead.repeats is not None and of != MISSION:
        first, again = ahead.repeats
        return f"kept forever, as simulated{steps}: tick {again} repeats tick {first}"
    if ahead.completed is not None:
        return f"kept, as simulated{steps}: the mission is completed in tick {ahead.completed}"
    return "no guarantee: the simulation neither ended nor repeated a state"
