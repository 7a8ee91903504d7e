"""Changes by an operator and by the scenario's list, as events at the beginning of a tick.

The team encounters a closed region, an opened one or another truth like any part of the scenario;
it immediately knows a new objective, an order and a robot's service. An impossible change is
refused at the call; one that becomes impossible later is dropped, and recorded.
"""

from collections.abc import Iterable, Iterator
from typing import Protocol

from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.runtime.control.answers import Answers
from safenav.runtime.control.coordinate import Control
from safenav.runtime.control.ends import GIVEN_UP, End, Stopped
from safenav.runtime.interventions import Intervention
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.lockstep import Lockstep
from safenav.runtime.worlds.simulation import SimulatedWorld
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import Objective
from safenav.scenario.reachability import Reachability
from safenav.team import state as now
from safenav.team.acts import is_reserved, number, stands_for
from safenav.team.state import Is
from safenav.team.team import Team
from safenav.trace import records
from safenav.trace.vocabulary import OperatorIntervention
from safenav.trace.words import obstacle_words
from safenav.world.map import Region
from safenav.world.poses import Mobility, Pose

USER, SCENARIO, INPUT = "user", "scenario", "input"


class Running(Protocol):
    """The present state of the run to which events are reported."""

    @property
    def team(self) -> Team: ...
    @property
    def state(self) -> now.State: ...
    @property
    def control(self) -> Control: ...
    @property
    def answers(self) -> Answers: ...
    def waits(self) -> bool: ...
    def until(self) -> float | None: ...
    def given_up(self) -> End: ...


class Operator:
    """``asked``: the changes that are not applied yet; ``inputs``: those that an operator has
    set; ``truth``: the simulated world (None: there is none)."""

    def __init__(
        self, scenario: Scenario, truth: SimulatedWorld | None, commands: Commands | Lockstep
    ) -> None:
        self.scenario, self.truth, self.commands = scenario, truth, commands
        self.asked: list[Intervention] = []
        self.inputs: dict[str, bool] = {}
        self._listed = [*scenario.changes]
        self._ordered: set[str] = set()

    def resume(self, time: float, lines: Iterable[records.Record]) -> None:
        """Continue after the changes until ``time``, with the inputs set in these lines."""
        self._listed = [change for change in self._listed if change.at > time]
        for line in lines:
            if isinstance(line, records.Inputs):
                self.inputs = {name: line.values[name] for name in line.user or ()}

    def ask(self, run: Running, wanted: Intervention) -> None:
        """Request a change. Raises UsageError, with the reason, for an impossible one."""
        self._check(run, wanted)
        self.asked.append(wanted)

    def events(self, run: Running) -> Iterator[now.Event]:
        """Yield the changes of this moment. Raises Stopped if the operator gives up."""
        while self._listed and self._listed[0].at <= run.state.time:
            change = self._listed.pop(0)
            i = self._robot(change.robot)
            if change.objective is not None:
                yield now.Assigned(i, change.objective, SCENARIO, change.within)
            if change.active and _is_lost(run, change.robot):
                reason = f"{change.robot} is lost: only an operator can bring it back"
                yield now.Late("service", reason, i)
            elif change.active is not None:
                yield from _serves(run, i, change.active, SCENARIO)
        if self.truth is None:
            for k, each in enumerate(run.team.obstacles):
                due = each.ordered and (each.source.appears or 0) <= run.state.time
                if due and run.state.obstacles[k].state is Is.AWAY:
                    yield now.Appeared(k)
        end, gives_up = run.given_up(), False
        while self.asked:
            wanted = self.asked.pop(0)
            try:
                self._check(run, wanted)
            except UsageError as error:  # it has become impossible meanwhile
                yield now.Late("intervention", str(error))
                continue
            if wanted.kind == "give_up":
                gives_up = True
            else:
                end = GIVEN_UP
            yield from self._brought_about(run, wanted)
        if gives_up:
            raise Stopped(end)

    def selected(self, run: Running) -> Iterator[now.Assigned]:
        """Yield the objectives of robots that follow from the inputs, if they differ from those
        before."""
        for i, (robot, member) in enumerate(zip(run.state.robots, run.team.members, strict=True)):
            given = dict(member.robot.when)
            mode = next((name for name in given if name in run.state.inputs), None)
            if mode == robot.mode:
                continue
            base = robot.base or (member.objective, member.robot.within, robot.own, robot.values)
            if mode is None:
                yield now.Assigned(i, base[0], INPUT, base[1], None, base)
            else:
                yield now.Assigned(i, given[mode], INPUT, None, mode, base)

    def _brought_about(self, run: Running, wanted: Intervention) -> Iterator[now.Event]:
        told, name, team = OperatorIntervention, wanted.name, run.team
        match wanted:
            case Intervention("close", obstacle=Obstacle() as closed):
                self._simulation().bring(replace(closed, appears=int(run.state.time)))
            case Intervention("order", obstacle=Obstacle() as ordered):
                new = replace(ordered, appears=int(run.state.time))
                while new.name in team.numbers or new.name in self._ordered:
                    new = replace(new, number=new.number + 1)
                self._ordered.add(new.name)
                if self.truth is not None:
                    self.truth.bring(new)
                else:
                    yield now.Introduced(new)
                    yield now.Appeared(run.team.numbers[new.name][-1], cause=USER)
            case Intervention("open"):
                source = self._there(name)
                yield now.Intervened(told.RESOLVED, obstacle=team.numbers[name][-1])
                self._simulation().remove(name)
                yield now.Gone(number(team, run.state, source), USER)
            case Intervention("objective", objective=objective) if objective is not None:
                i = self._robot(name)
                yield now.Intervened(told.OBJECTIVE, i, objective=objective)
                yield now.Assigned(i, objective, USER)
            case Intervention("service"):
                i = self._robot(name)
                yield now.Intervened(told.ADDED if wanted.on else told.OUT_OF_SERVICE, i)
                yield from _serves(run, i, wanted.on, USER)
            case Intervention("input"):
                self.inputs[name] = wanted.on
            case Intervention("resolved"):
                source = team.obstacles[k := _met(run, name)].source
                yield now.Intervened(told.RESOLVED, obstacle=k)
                yield self._gone(k, source)
            case Intervention("permanent"):
                k = _met(run, name)
                yield now.Intervened(told.PERMANENT, obstacle=k)
                yield now.Declared(k)
            case Intervention("put_back", pose=Pose() as pose):
                i = self._robot(name)
                yield now.Intervened(told.PUT_BACK, i, pose=pose)
                member, was = team.members[i], run.state.robots[i].active
                if isinstance(self.commands, Commands):
                    self.commands.placed(member.robot, pose)
                yield now.Placed(i, member.graph.moved(run.state.robots[i].pose, pose))
                for k in _known(run):
                    if stands_for(team.obstacles[k].source, name):
                        yield now.Gone(k, "world")
                if not was:
                    yield now.Served(i, True, USER)
                for k in _known(run):
                    if team.obstacles[k].battery_of == i:  # its empty battery is where it is
                        yield self._gone(k, team.obstacles[k].source)
            case Intervention("give_up"):
                yield now.Intervened(told.GIVE_UP)

    def _gone(self, k: int, source: Obstacle) -> now.Gone:
        there = self.truth is not None and self.truth.remove(source.name)
        if not there and isinstance(self.commands, Commands):
            self.commands.cleared(source)
        return now.Gone(k, "world" if self.truth is None else USER)

    # Checks of interventions.

    def _check(self, run: Running, wanted: Intervention) -> None:
        name = wanted.name
        match wanted:
            case Intervention("close", obstacle=Obstacle(region=region)):
                self._may_close(run, region)
            case Intervention("order", obstacle=Obstacle(type=kind)):
                if kind.has_truth:
                    raise UsageError(f"a {kind.name} has a truth, which orders do not reveal")
                if kind.blocks != frozenset():
                    raise UsageError(f"a {kind.name} stops robots: an order needs 'blocks: []'")
            case Intervention("open"):
                self._there(name)
            case Intervention("objective", objective=objective) if objective is not None:
                self._may_pursue(run, name, objective)
            case Intervention("service"):
                self._robot(name)
                back = any((each.kind, each.name) == ("put_back", name) for each in self.asked)
                if wanted.on and _is_lost(run, name) and not back:
                    raise UsageError(f"{name} is lost: give its position (put_back {name} REGION)")
            case Intervention("input"):
                if name not in {each.name for each in self.scenario.inputs}:
                    raise UsageError(f"there is no input '{name}'")
            case Intervention("resolved"):
                _met(run, name)
            case Intervention("permanent"):
                self._live("obstacles become permanent")
                if not run.state.obstacles[_met(run, name)].known:
                    raise UsageError(f"{name} is already permanent")
            case Intervention("put_back", pose=Pose() as pose):
                self._may_stand(run, name, pose)

    def _may_close(self, run: Running, region: Region) -> None:
        standing = self._simulation().standing().get(region)
        if standing is not None:
            raise UsageError(f"{standing.name} already exists there: remove it first")
        for obstacle, each in zip(run.team.obstacles, run.state.obstacles, strict=True):
            untraversable = each.state is Is.SEALED and not each.given_up
            if obstacle.region == region and untraversable:
                raise UsageError(f"{obstacle.name} is permanent: no robot can pass")
        coming = (each.obstacle for each in self.asked if each.kind == "close")
        if any(each is not None and each.region == region for each in coming):
            raise UsageError(f"region {region} will be closed at the next tick")

    def _may_pursue(self, run: Running, name: str, objective: Objective) -> None:
        member = run.team.members[i := self._robot(name)]
        pose, avoid = member.graph.pose(run.state.robots[i].next), objective.avoid
        if pose.region in avoid:
            raise UsageError(f"{name} must avoid its own region {pose.region}")
        reach = Reachability(member.robot.model.mobility, pose, self.scenario.map, avoid)
        for target in objective.targets:
            if not reach.reaches(target):
                where = ", ".join(map(str, sorted(target)))
                raise UsageError(f"{name} cannot reach {where} from its region")

    def _may_stand(self, run: Running, name: str, pose: Pose) -> None:
        self._live("robots are put back")
        member, region = run.team.members[i := self._robot(name)], pose.region
        if not run.state.robots[i].idle:
            raise UsageError(f"{name} executes a command: wait until it has ended")
        if (member.robot.model.mobility is Mobility.HEADING) is (pose.heading is None):
            reason = "needs a heading" if pose.heading is None else "has no heading"
            raise UsageError(f"{name} {reason}")
        if is_reserved(run.team, run.state, i, region):
            raise UsageError(
                f"another robot is in region {region}, or in a zone of 'never_together'"
            )
        away = {each.name for each in self.asked if each.kind in ("resolved", "open")}
        for k in _known(run):
            obstacle, state = run.team.obstacles[k], run.state.obstacles[k]
            own = stands_for(obstacle.source, name)  # it is no longer lost
            if own or obstacle.region != region or obstacle.name in away:
                continue
            if obstacle.closes(i, state):
                raise UsageError(f"{obstacle.name} is in region {region}: resolve it first")
        there = None if self.truth is None else self.truth.standing().get(region)
        if there is not None and there.name not in away and there.blocks(member.robot):
            raise UsageError(f"{there.name} is in region {region}: resolve it first")

    def _live(self, what: str) -> None:
        if not self.commands.live:
            raise UsageError(f"{what} only in live runs: use 'clock: live'")

    def _there(self, name: str) -> Obstacle:
        there = {obstacle.name: obstacle for obstacle in self._simulation().standing().values()}
        if name not in there:
            raise UsageError(f"no unresolved obstacle {name}")
        return there[name]

    def _robot(self, name: str) -> int:
        names = [robot.name for robot in self.scenario.robots]
        if name not in names:
            raise UsageError(f"no robot {name}")
        return names.index(name)

    def _simulation(self) -> SimulatedWorld:
        if self.truth is None:
            raise UsageError("only simulated worlds can be changed")
        return self.truth


def _serves(run: Running, i: int, active: bool, cause: str) -> Iterator[now.Event]:
    if run.state.robots[i].active is not active:
        yield now.Served(i, active, cause)


def _known(run: Running) -> list[int]:
    """Return the obstacles known to the team."""
    known = (Is.SEEN, Is.OPEN, Is.SEALED)
    return [k for k, each in enumerate(run.state.obstacles) if each.state in known]


def _met(run: Running, name: str) -> int:
    """Return the known obstacle of that name. Raises UsageError if there is none."""
    names = {run.team.obstacles[k].name: k for k in _known(run)}
    if name not in names:
        word = run.team.world.word
        listed = ", ".join(obstacle_words(each, word) for each in names) or "none"
        missing = obstacle_words(name, word)
        raise UsageError(f"the team knows no obstacle '{missing}'; known: {listed}")
    return names[name]


def _is_lost(run: Running, name: str) -> bool:
    return any(stands_for(run.team.obstacles[k].source, name) for k in _known(run))
