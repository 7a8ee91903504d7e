"""Deadlines of rounds and of the whole mission, checked by simulating the team.

With steps of fixed duration and no hidden obstacle a team in lockstep is deterministic, so the tick
of its completion is exact. If its state repeats before that, the behaviour repeats, and deadlines
met until then are met forever. The state is that of each robot and of the traffic, except round
counts. No search may have occurred in between, since searches depend on rounds and earlier
searches.

Where steps vary, faster ones can end later for robots that wait for each other (Graham, Bounds on
multiprocessing timing anomalies, 1969), and nothing is guaranteed. The path of a robot that shares
its floor with no other does not depend on durations, so its slowest steps are the worst case.
"""

from __future__ import annotations

from collections.abc import Hashable

from msgspec import Struct
from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.mission import Mission
from safenav.scenario.model import Robot, Scenario, Timing
from safenav.scenario.settings import LatePolicy
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause, DeadlineVerdict

TICKS, WORK = 2_000, 20_000
"""Most ticks, and most work in turns of a robot: about a second. Counted, not timed, so that a busy
machine finds the same."""
SYNTHESIS, PLAN, SPENT = 300, 500, 5_000
"""The work of a synthesis, of a joint plan, and of a search that exhausts its budget."""


class TeamSimulation(Struct, frozen=True):
    """A run with orders, without hidden obstacles. ``late``: the tick in which each missed deadline
    became late (robots, ``mission``); ``completed``: the tick of completion, if it was reached;
    ``repeats``: two ticks with the same state; ``slowest``: steps vary, and took their longest;
    ``flat``: the tick in which each empty battery took its robot out of service; ``why``: the
    reason why nothing can be guaranteed (then all else is empty)."""

    late: dict[str, int]
    completed: int | None = None
    repeats: tuple[int, int] | None = None
    slowest: bool = False
    flat: dict[str, int] = {}
    why: str = ""


def simulate_team(scenario: Scenario, synthesizer: Synthesizer) -> TeamSimulation | None:
    """Simulate the team. None without deadlines of rounds or the mission, and without a battery
    whose charge may not suffice because of other robots."""
    timed = scenario.until.by is not None or any(r.within is not None for r in scenario.robots)
    if not timed and not any(_may_run_flat(robot, scenario) for robot in scenario.robots):
        return None
    varying = [r for r in scenario.robots if r.model.timing.least != r.model.timing.most]
    for robot in varying:
        if any(scenario.interfere(robot, o) for o in scenario.robots if o is not robot):
            timing = robot.model.timing
            why = f"a step of {robot.name} takes {timing.least} to {timing.most} ticks"
            why += ", and it shares its floor: faster steps can end later"
            return TeamSimulation({}, why=why)
    if scenario.inputs:
        return TeamSimulation({}, why="the inputs of the environment are not known before the run")
    alone = replace(
        scenario,
        obstacles=tuple(obstacle for obstacle in scenario.obstacles if obstacle.ordered),
        suspects=None,
        late=LatePolicy.GO_ON,
        robots=tuple(_slowest(robot) for robot in scenario.robots),
    )
    return replace(_run(alone, synthesizer), slowest=bool(varying))


def _may_run_flat(robot: Robot, scenario: Scenario) -> bool:
    """Whether a robot's charge may not suffice: it shares its floor, and no robot would bring a
    battery."""
    if robot.model.battery is None or scenario.flat is not None:
        return False
    return any(scenario.interfere(robot, other) for other in scenario.robots if other is not robot)


def _slowest(robot: Robot) -> Robot:
    most = robot.model.timing.most
    return replace(robot, model=replace(robot.model, timing=Timing(most, most)))


def _run(scenario: Scenario, synthesizer: Synthesizer) -> TeamSimulation:
    late, flat = dict[str, int](), dict[str, int]()
    changes, last = [change.at for change in scenario.changes], 0
    changes += [order.appears or 0 for order in scenario.obstacles]
    work = 0

    def heard(record: records.Record) -> None:
        nonlocal last, work
        if isinstance(record, records.Deadline) and record.verdict is DeadlineVerdict.LATE:
            late.setdefault(record.of, record.tick)
        elif isinstance(record, records.Service) and record.cause is ChangeCause.BATTERY:
            flat.setdefault(record.robot, record.tick)
        elif isinstance(record, records.Plan | records.Synthesis):
            last = record.tick
            work += PLAN if isinstance(record, records.Plan) else SYNTHESIS

    mission = Mission(scenario, synthesizer, listeners=[heard])
    mission.start()
    seen: dict[Hashable, int] = {}
    repeats: tuple[int, int] | None = None
    while mission.result is None and mission.state.tick < TICKS:
        if work + SPENT * mission.spent_searches >= WORK:
            break
        mission.step()
        work += len(scenario.robots)
        tick = mission.state.tick
        busy = tick <= max(changes, default=0) or tuple(mission.state.requests)
        key = None if busy else mission.state_key()
        before = None if key is None else seen.setdefault(key, tick)
        if repeats is None and before is not None and last < before < tick:
            repeats = before, tick
            if scenario.until.by is None:
                break
    result = mission.result or mission.give_up()
    if result.outcome is Outcome.UNREALIZABLE:
        return TeamSimulation({}, why=result.explanation)
    completed = result.ticks if result.outcome is Outcome.COMPLETED else None
    return TeamSimulation(late, completed, repeats, flat=flat)
