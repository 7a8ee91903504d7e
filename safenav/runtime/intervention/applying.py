"""Changes to the world between two ticks, by a user who watches a run or by the scenario.

The team encounters a closed region, an opened one or another truth like any part of the scenario.
A new objective is assigned to its robot; every robot knows which robots are out of service.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.runtime.coordination import events
from safenav.runtime.coordination.assignment import holding
from safenav.runtime.failures import stands_for
from safenav.runtime.intervention import kinds
from safenav.runtime.intervention.inputs import EnvironmentInputs
from safenav.runtime.intervention.wrong import wrong_objective, wrong_type
from safenav.runtime.knowledge import UNTRAVERSABLE
from safenav.runtime.progress import Progress
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.turns.turn import Turns
from safenav.runtime.worlds.world import Change, SimulatedWorld
from safenav.scenario.model import Obstacle, ObstacleType
from safenav.scenario.objective import Objective
from safenav.scenario.reachability import Reachability
from safenav.trace import records, vocabulary
from safenav.trace.told_objective import objective_in_trace
from safenav.trace.vocabulary import OperatorIntervention
from safenav.trace.words import obstacle_words
from safenav.world.map import Region
from safenav.world.moves import Mobility, Pose

_USER = vocabulary.ChangeCause.USER
_SCENARIO = vocabulary.ChangeCause.SCENARIO
_INPUT = vocabulary.ChangeCause.INPUT

_AWAY = (kinds.MarkResolved, kinds.RemoveObstacle)


class Interventions(Struct):
    """Interventions: requested at any time, applied at the beginning of the next tick."""

    state: TeamState
    world: SimulatedWorld | None
    turns: Turns
    inputs: EnvironmentInputs
    _asked: list[kinds.Intervention] = field(default_factory=list)
    _ordered: set[str] = field(default_factory=set)
    _made: int = 0
    took_effect: bool = False
    """Whether a requested intervention has changed anything, or is recorded as a change."""
    ends_wait: bool = False
    """Whether a change of the scenario or of an input ends the wait of the team."""

    @property
    def asked(self) -> bool:
        """Whether a requested intervention has not been applied yet."""
        return bool(self._asked)

    def ask(self, wanted: kinds.Intervention, *, late: bool = False) -> None:
        """Request an intervention. Raises UsageError, with the reason, for an impossible one; with
        ``late`` that is dropped and recorded instead."""
        if (found := kinds.misfit(wanted)) is not None:
            raise UsageError(found)
        if not late:
            self._check(wanted)
        self._asked.append(wanted)

    def _check(self, wanted: kinds.Intervention) -> None:
        match wanted:
            case kinds.AddObstacle():
                self._may_close(wanted)
            case kinds.PlaceOrder():
                self._may_order(wanted)
            case kinds.RemoveObstacle(name):
                self._there(name)
            case kinds.SetTruth(name):
                if not self._there(name).type.has_truth:
                    raise UsageError(f"{name} has no truth to reveal")
            case kinds.AssignObjective():
                self._may_give(wanted)
            case kinds.SetService(name, active):
                lost = self._is_lost(self._robot(name).name)
                if active and lost and not self._comes_back(name):
                    raise UsageError(f"{name} is lost: give its position (put_back {name} REGION)")
            case kinds.SetInput(name):
                if name not in self.state.inputs:
                    raise UsageError(f"there is no input '{name}'")
            case kinds.MarkResolved(name):
                self._met(name)
            case kinds.MarkPermanent(name):
                self._live("obstacles become permanent")
                self._met(name)
                if name not in self.state.knowledge.pending | self.state.knowledge.given_up():
                    raise UsageError(f"{name} is already permanent")
            case kinds.PutBack():
                self._may_put(wanted)

    def apply(self) -> Iterator[events.Event]:
        """Apply the scenario's changes of this tick and every requested one: yield the events that
        follow, each to be settled before the next. If one of them ended in a wait, the next call
        continues with the next one."""
        changes = self.state.scenario.changes
        while self._made < len(changes) and changes[self._made].at <= self.state.time:
            change = changes[self._made]
            self._made += 1
            self._note_change()
            robot = self._robot(change.robot)
            if change.objective is not None:
                yield from self._give(robot, change.objective, _SCENARIO, change.within)
            if change.active and self._is_lost(robot.name):
                reason = f"{robot.name} is lost: only an operator can bring it back"
                self.turns.recorder.late("service", reason, robot.name, None, self.state.time)
            elif change.active is not None:
                yield from self.turns.relocation.serve(robot, active=change.active, cause=_SCENARIO)
        if self.world is None:
            yield from self._orders()
        while self._asked:
            wanted = self._asked.pop(0)
            try:
                self._check(wanted)
            except UsageError as error:  # it has become impossible meanwhile
                now = self.state.time if self.state.live else None
                self.turns.recorder.late("intervention", str(error), None, None, now)
                continue
            self.took_effect |= self._has_effect(wanted)
            yield from self._bring_about(wanted)
        yield from self._inputs()

    def _note_change(self) -> None:
        """Record a change by the scenario or an input: it may help the team."""
        self.ends_wait |= self.state.waiting is not None

    def _has_effect(self, wanted: kinds.Intervention) -> bool:
        match wanted:
            case kinds.SetService(name, active):
                return self.state.live or self._robot(name).active is not active
            case kinds.SetInput(name, on):
                return self.state.inputs[name] is not on
        return not isinstance(wanted, kinds.GiveUp)

    @property
    def more_changes(self) -> bool:
        """Whether changes of this moment, of the scenario or an operator, are still to be
        applied."""
        if any(not isinstance(wanted, kinds.GiveUp) for wanted in self._asked):
            return True
        left = self.state.scenario.changes[self._made :]
        return any(change.at <= self.state.time for change in left)

    @property
    def finds_lost(self) -> bool:
        """Whether an operator puts a lost robot back, which opens all regions where it may have
        been."""
        back = (wanted for wanted in self._asked if isinstance(wanted, kinds.PutBack))
        return any(self._is_lost(wanted.robot) for wanted in back)

    def _comes_back(self, name: str) -> bool:
        """Whether an operator has requested to put the robot back, even if that is not applied
        yet."""
        return any(isinstance(w, kinds.PutBack) and w.robot == name for w in self._asked)

    def _orders(self) -> Iterator[events.Event]:
        """Announce the scenario's due orders to the team, in a world without orders."""
        for obstacle in self.state.scenario.obstacles:
            due = obstacle.ordered and (obstacle.appears or 0) <= self.state.time
            if due and obstacle.name not in self._ordered:
                self._ordered.add(obstacle.name)
                self._note_change()
                yield from self._placed(Change(obstacle, appeared=True))

    def _placed(self, order: Change) -> Iterator[events.Event]:
        """Announce an order to the team; duties change with it."""
        yield from self.turns.relocation.leave_plan()
        yield events.ObstacleChanged(order)

    def _inputs(self) -> Iterator[events.Event]:
        """Read the inputs of this tick, and assign the objectives that they select."""
        if not self.state.inputs:
            return
        if self.inputs.changed:
            self._note_change()
        self.inputs.read()
        for robot, objective, within, progress in self.inputs.selected():
            yield from self._give(robot, objective, _INPUT, within, progress)

    @property
    def given_up(self) -> bool:
        """Whether an operator wants the run to end."""
        return any(isinstance(wanted, kinds.GiveUp) for wanted in self._asked)

    def _tell(
        self,
        what: OperatorIntervention,
        robot: str | None = None,
        obstacle: str | None = None,
        pose: Pose | None = None,
        objective: Objective | None = None,
    ) -> None:
        """Record an operator's intervention in a live run."""
        if self.state.live:
            at: tuple[Region | None, str | None] = (None, None) if pose is None else pose.place
            traced = None if objective is None else objective_in_trace(objective)
            self.state.emit(records.Operator(self.state.tick, what, robot, obstacle, *at, traced))

    def _bring_about(self, wanted: kinds.Intervention) -> Iterator[events.Event]:
        state = self.state
        match wanted:
            case kinds.AddObstacle(kind, region, truth):
                new = Obstacle(kind, region, truth, appears=int(self.state.time))
                self._simulation().bring(new, truth)
                if truth is not None and new.name in state.named:  # it comes back, perhaps changed
                    state.emit(records.Truth(state.tick, new.name, truth, _USER))
            case kinds.PlaceOrder(kind, region):
                new = Obstacle(kind, region, appears=int(self.state.time), ordered=True)
                while new.name in state.named | self._ordered:
                    new = replace(new, number=new.number + 1)
                self._ordered.add(new.name)
                if isinstance(self.world, SimulatedWorld):
                    self.world.bring(new, None)
                else:
                    state.introduce(new)
                    yield from self._placed(Change(new, appeared=True, by_user=True))
            case kinds.RemoveObstacle(name):
                self._tell(OperatorIntervention.RESOLVED, obstacle=name)
                self._simulation().take_away(name)
            case kinds.SetTruth(name, truth):
                obstacle = self._there(name)
                self._simulation().truths[name] = truth
                state.introduce(obstacle, truth)
                state.emit(records.Truth(state.tick, name, truth, _USER))
            case kinds.AssignObjective(name, objective):
                self._tell(OperatorIntervention.OBJECTIVE, name, objective=objective)
                yield from self._give(self._robot(name), objective, _USER)
            case kinds.SetService(name, active):
                what = OperatorIntervention.ADDED if active else OperatorIntervention.OUT_OF_SERVICE
                self._tell(what, name)
                robot = self._robot(name)
                yield from self.turns.relocation.serve(robot, active=active, cause=_USER)
            case kinds.SetInput(name, on):
                self.inputs.set(name, on)
            case kinds.MarkResolved(name):
                self._tell(OperatorIntervention.RESOLVED, obstacle=name)
                obstacle = self._met(name)
                there = self.world is not None and self.world.remove(name)
                if not there:
                    self.turns.world.cleared(obstacle)
                yield from self.turns.actions.gone(obstacle, by_user=there)
            case kinds.MarkPermanent(name):
                self._tell(OperatorIntervention.PERMANENT, obstacle=name)
                yield from self.turns.relocation.leave_plan()
                yield events.ObstacleDeclaredPermanent(self._met(name))
            case kinds.PutBack(name, pose):
                self._tell(OperatorIntervention.PUT_BACK, name, pose=pose)
                yield from self._put_back(self._robot(name), pose)
            case kinds.GiveUp():
                self._tell(OperatorIntervention.GIVE_UP)

    def _put_back(self, robot: RobotState, pose: Pose) -> Iterator[events.Event]:
        """Let a robot continue from another pose, no longer lost."""
        robot.pose, robot.came = pose, None
        robot.asked = False  # it acts there like a robot that arrives
        self.turns.world.placed(robot.robot, pose)
        self.turns.relocation.is_placed(robot)
        yield from self.turns.relocation.leave_plan()
        robot.planner.node = None
        self.state.failures.back(robot.name)
        robot.claims = {}
        for obstacle in self.state.knowledge.obstacles.values():
            if stands_for(obstacle, robot.name):
                yield from self.turns.actions.gone(obstacle)
        if robot.active:
            yield events.Unsettled(vocabulary.Reason.SERVICE)
        yield from self.turns.relocation.serve(robot, active=True, cause=_USER)

    def _give(
        self,
        robot: RobotState,
        objective: Objective,
        cause: vocabulary.ChangeCause,
        within: int | None = None,
        own_progress: Progress | None = None,
    ) -> Iterator[events.Event]:
        state = self.state
        traced = objective_in_trace(objective)
        own = robot.assignment.role is Role.OWN and not _holds_at_stop(robot)
        state.emit(records.NewObjective(state.tick, robot.name, traced, own, cause, within))
        yield from self.turns.relocation.leave_plan()
        hope = state.waiting is None  # it may resolve obstacles that it avoided before
        yield events.ObjectiveGiven(robot.name, objective, within, own_progress, hope)

    def _may_close(self, wanted: kinds.AddObstacle) -> None:
        world = self.state.scenario.map
        self._may_be(wanted.type)
        if not world.is_free(wanted.region):
            raise UsageError(f"{self._closed(wanted.region)}: choose a free region to close")
        standing = self._simulation().standing().get(wanted.region)
        if standing is not None:
            raise UsageError(f"{standing.name} already exists there: remove it first")
        for known in self.state.knowledge.permanent.values():
            if known.obstacle.region == wanted.region and known.reason == UNTRAVERSABLE:
                raise UsageError(f"{known.obstacle.name} is permanent: no robot can pass")
        if any(isinstance(o, kinds.AddObstacle) and o.region == wanted.region for o in self._asked):
            raise UsageError(f"region {wanted.region} will be closed at the next tick")
        if wanted.type.has_truth and wanted.truth is None:
            raise UsageError(f"state whether {wanted.type.name} is traversable")
        if wanted.truth is not None and not wanted.type.has_truth:
            raise UsageError(f"a {wanted.type.name} has no truth: leave it out")

    def _may_be(self, kind: ObstacleType) -> None:
        if (found := wrong_type(kind, self.state.scenario)) is not None:
            raise UsageError(found)

    def _may_order(self, wanted: kinds.PlaceOrder) -> None:
        self._may_be(wanted.type)
        if wanted.type.has_truth:
            raise UsageError(f"a {wanted.type.name} has a truth, which orders do not reveal")
        if not self.state.scenario.map.is_free(wanted.region):
            raise UsageError(f"{self._closed(wanted.region)}: place the order in a free region")
        if wanted.type.blocks != frozenset():
            raise UsageError(f"a {wanted.type.name} stops robots: an order needs 'blocks: []'")

    def _may_give(self, wanted: kinds.AssignObjective) -> None:
        robot = self._robot(wanted.robot)
        if robot.robot.when:
            raise UsageError(
                f"the inputs determine the objective of {wanted.robot}: see its 'when'"
            )
        if (found := wrong_objective(wanted.objective, self.state.scenario)) is not None:
            raise UsageError(found)
        world = self.state.scenario.map
        avoid = wanted.objective.avoid
        if robot.next_pose.region in avoid:
            raise UsageError(f"{wanted.robot} must avoid its own region {robot.next_pose.region}")
        reach = Reachability(robot.robot.model.mobility, robot.next_pose, world, avoid)
        for target in wanted.objective.targets:
            if not reach.reaches(target):
                where = ", ".join(map(str, sorted(target)))
                raise UsageError(f"{wanted.robot} cannot reach {where} from its region")

    def _met(self, name: str) -> Obstacle:
        """Return the known obstacle of that name. Raises UsageError if there is none."""
        known = self.state.knowledge.obstacles
        if name not in known:
            word = self.state.scenario.map.word
            listed = ", ".join(obstacle_words(each, word) for each in known) or "none"
            missing = obstacle_words(name, word)
            raise UsageError(f"the team knows of no obstacle '{missing}'; known: {listed}")
        return known[name]

    def _closed(self, region: Region) -> str:
        return f"region {region} is {self.state.scenario.map.closed_words(region)}"

    def _is_lost(self, name: str) -> bool:
        known = self.state.knowledge.obstacles.values()
        return any(stands_for(obstacle, name) for obstacle in known)

    def _live(self, what: str) -> None:
        if not self.state.live:
            raise UsageError(f"{what} only in live runs: use 'clock: live'")

    def _may_put(self, wanted: kinds.PutBack) -> None:
        self._live("robots are put back")
        robot, world = self._robot(wanted.robot), self.state.scenario.map
        region, heading = wanted.pose.region, wanted.pose.heading
        if robot.transit is not None or robot.acting is not None:
            raise UsageError(f"{robot.name} executes a command: wait until it has ended")
        if not world.is_free(region):
            raise UsageError(f"{self._closed(region)}: put {robot.name} into a free one")
        if (robot.robot.model.mobility is Mobility.HEADING) is (heading is None):
            reason = "needs a heading" if heading is None else "has no heading"
            raise UsageError(f"{robot.name} {reason}")
        if region in self.state.had_by_others(robot.robot):
            raise UsageError(f"another robot is in region {region}")
        for there in self._standing_at(region):
            own = stands_for(there, robot.name)  # it is no longer lost
            if not own and self.state.knowledge.closed_to(there, robot.robot):
                raise UsageError(f"{there.name} is in region {region}: resolve it first")

    def _standing_at(self, region: Region) -> list[Obstacle]:
        """The obstacles in a region, except those that an operator removes first."""
        away = {asked.obstacle for asked in self._asked if isinstance(asked, _AWAY)}
        known = [*self.state.knowledge.obstacles.values()]
        known += [] if self.world is None else [*self.world.standing().values()]
        return [o for o in known if o.region == region and o.name not in away]

    def _there(self, name: str) -> Obstacle:
        for obstacle in self._simulation().standing().values():
            if obstacle.name == name:
                return obstacle
        raise UsageError(f"no unresolved obstacle {name}")

    def _robot(self, name: str) -> RobotState:
        if name not in self.state.robots:
            raise UsageError(f"no robot {name}")
        return self.state.robots[name]

    def _simulation(self) -> SimulatedWorld:
        if self.world is None:
            raise UsageError("only simulated worlds can be changed")
        return self.world


def _holds_at_stop(robot: RobotState) -> bool:
    """Whether a robot's own objective makes it stay at its stop: then it keeps its strategy while
    it charges."""
    own, stop = robot.robot.objective, robot.stop
    return stop is not None and holding(own, stop.region).relaxed() == own.relaxed()
