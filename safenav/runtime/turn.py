"""One robot's turn: look, propose, characterize, back up, move, act.

The order of what happens here is the order of lines in a trace (docs/trace.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from safenav.dataclass import dataclass
from safenav.runtime.belief_recorder import BeliefRecorder
from safenav.runtime.characterization import Characterization, Violation
from safenav.runtime.checked_world import CheckedWorld
from safenav.runtime.coordination.assignable_goals import signal
from safenav.runtime.coordination.events import (
    Astray,
    Event,
    HelpRequested,
    ObstacleEncountered,
    ObstaclesResolved,
    Unsettled,
)
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.formulas import graph_of
from safenav.runtime.monitor import Monitors
from safenav.runtime.move_recorder import MoveRecorder
from safenav.runtime.navigation import Proposal
from safenav.runtime.team import RobotState, TeamState, Transit
from safenav.runtime.termination import Conclusion
from safenav.runtime.traffic.planning import Traffic
from safenav.scenario.guarantees import guarantees_of, values_of
from safenav.scenario.model import Outcome, Tracking
from safenav.scenario.objective import Ltl
from safenav.spec.forms import alternating
from safenav.spec.other_robots.tracking import Sightings, observe
from safenav.spec.specification import Constraint
from safenav.spec.task import Task
from safenav.trace import records, vocabulary
from safenav.world.map import Region
from safenav.world.moves import Pose


@dataclass
class Turns:
    """Carries out turns on a team's state in a world."""

    state: TeamState
    world: CheckedWorld
    strategies: Strategies
    traffic: Traffic

    def __post_init__(self) -> None:
        self.monitors = Monitors(self.state)
        self.characterization = Characterization(self.world, self.state)
        self.sightings = BeliefRecorder(self.state)
        self.tell = MoveRecorder(self.state, self.sightings)

    def step(self, robot: RobotState) -> Iterator[Event]:
        """One turn: its events as they happen, each to be settled before the turn continues."""
        if robot.transit is not None:
            yield from self._travel(robot, robot.transit)
        elif not robot.active:
            yield from self._stand_still(robot)
        elif self.traffic.active:
            yield from self._follow_plan(robot)
        else:
            yield from self._follow_strategy(robot)

    def _stand_still(self, robot: RobotState) -> Iterator[Event]:
        """The turn of a robot that is out of service: it looks around, and stays."""
        if robot.planner is not None:
            self._keep_track(robot, robot.planner.task, frozenset())
        yield from self._move(robot, robot.pose, {}, vocabulary.MovedBy.STAY)

    def back_in_service(self, robot: RobotState) -> None:
        """Continue the robot from where it is, whatever the others have done meanwhile. If it
        needs a new strategy, the decision right after this brings one."""
        if robot.planner is None or robot.transit is not None:
            return
        self.monitors.watch(robot.robot, robot.planner)
        robot.planner.node = None
        told = alternating(robot.progress.objective)
        if alternating(robot.planner.task.objective) == told:
            self.strategies.relocate(robot)  # else its assignment has changed meanwhile

    def _follow_strategy(self, robot: RobotState) -> Iterator[Event]:
        """Take the strategy's successor for the observation, unless world or team forbid it."""
        planner = robot.planner
        assert planner is not None
        observed = self._look(robot, frozenset())
        broken = self.monitors.broken_assumptions(robot.robot, planner, observed)
        answer = planner.propose(observed)
        lost, silent = answer is None, answer is None and planner.node is not None and not broken
        silent = silent and not planner.behind
        proposal = answer or Proposal(robot.pose, None)
        by = vocabulary.MovedBy.STRATEGY if answer is not None else vocabulary.MovedBy.STAY
        if self.traffic.wanted is not None:  # a plan is due: nobody begins another step
            lost, silent, proposal = False, False, planner.held_back(robot.pose, observed)
            by = vocabulary.MovedBy.STRATEGY if proposal.answers else vocabulary.MovedBy.STAY
        violation = self.characterization.check(robot.robot, robot.pose, proposal.pose.region)
        if violation is not None:
            proposal = self._back_up(robot, observed, proposal, violation)
            by = vocabulary.MovedBy.BACKTRACK
        elif not self._may_move(robot, proposal.pose):
            proposal = self._another(robot, observed, proposal)
            by = vocabulary.MovedBy.STRATEGY if proposal.answers else vocabulary.MovedBy.STAY
        if by is vocabulary.MovedBy.STRATEGY or proposal.node != planner.node:
            self.monitors.check_guarantees(robot.robot, planner, observed, proposal)
        before = planner.values()
        planner.follow(proposal)
        if violation is not None:
            yield ObstacleEncountered(violation)
        yield from self._move(robot, proposal.pose, before, by, proposal.shown)
        if robot.planner is planner and planner.behind:
            self.strategies.catch_up(robot)
        self.monitors.tell(robot.robot, broken)
        if silent:
            self.tell.no_answer(robot, observed)
        if violation is not None:
            yield HelpRequested(violation)
        elif lost and robot.transit is None:
            yield from self._find_a_way_back(robot, broken)

    def _follow_plan(self, robot: RobotState) -> Iterator[Event]:
        """The next step of the joint plan, checked like any other move; the robot looks around as
        in any other turn, so that what it knows of others stays true."""
        if robot.planner is not None:
            self._keep_track(robot, robot.planner.task, frozenset())
        pose = self.traffic.next_pose(robot.name)
        if pose is not None and not self.monitors.allows_planned(robot, pose):
            yield from self.leave_plan(vocabulary.PlanEndReason.CHANGED)
            pose = None
        violation = None
        if pose is not None:
            violation = self.characterization.check(robot.robot, robot.pose, pose.region)
            if violation is not None:
                self.tell.violation(robot, violation)
                self.state.emit(records.Backtrack(self.state.tick, robot.name, robot.pose.region))
        if violation is not None:
            yield ObstacleEncountered(violation)
        if pose is None or violation is not None:
            by = vocabulary.MovedBy.STAY if violation is None else vocabulary.MovedBy.BACKTRACK
            if robot.planner is not None and robot.planner.task.tracking is not Tracking.NEARBY:
                robot.planner.node = None  # it remembers where others were, and they move on
            yield from self._move(robot, robot.pose, {}, by)
        else:
            assert pose.region not in self.state.taken(robot.robot), "plans keep robots apart"
            if robot.planner is not None:
                self.monitors.watch(robot.robot, robot.planner)
                robot.planner.node = None
            yield from self._move(robot, pose, {}, vocabulary.MovedBy.PLAN)
        if violation is not None:
            yield from self.leave_plan(vocabulary.PlanEndReason.VIOLATION, settling=True)
            yield HelpRequested(violation)

    def leave_plan(
        self, reason: vocabulary.PlanEndReason, *, settling: bool = False
    ) -> Iterator[Event]:
        """End the joint plan: every robot continues with a strategy that knows where it is.
        ``settling``: new strategies come with the decision right after this."""
        if not self.traffic.active:
            return
        for robot in self._off_their_strategies():
            self.strategies.relocate(robot)
        nodes = {
            name: robot.planner.node if robot.planner is not None else None
            for name, robot in self.state.robots.items()
        }
        self.traffic.end(reason, nodes)
        for robot in () if settling else self._off_their_strategies():
            yield Astray(robot.name, vocabulary.Reason.PLAN)

    def _off_their_strategies(self) -> list[RobotState]:
        """The robots that can decide something and are in no node of their strategy."""
        return [
            robot
            for robot in self.state.robots.values()
            if robot.transit is None and robot.planner is not None and robot.planner.node is None
        ]

    def _travel(self, robot: RobotState, transit: Transit) -> Iterator[Event]:
        """A tick of a step that takes several."""
        if self.state.tick < transit.arrives:
            self.tell.move(robot, robot.pose.region, None)
            yield from self._act(robot)
            return
        robot.transit = None
        by = vocabulary.MovedBy.PLAN if transit.planned else None
        yield from self._arrive(robot, transit.pose, transit.before, by, transit.planned)
        if not self.traffic.active:
            yield from self._go_on(robot)

    def _move(
        self,
        robot: RobotState,
        pose: Pose,
        before: Mapping[str, int],
        by: vocabulary.MovedBy,
        shown: frozenset[Region] = frozenset(),
    ) -> Iterator[Event]:
        """Begin a step; one that takes a single tick ends immediately."""
        ticks = self._duration(robot, pose)
        planned = by is vocabulary.MovedBy.PLAN
        if ticks > 1:
            robot.transit = Transit(pose, self.state.tick + ticks - 1, planned, before)
            self.tell.move(robot, robot.pose.region, by, shown)
            yield from self._act(robot)
        else:
            yield from self._arrive(robot, pose, before, by, planned, shown)

    def _arrive(
        self,
        robot: RobotState,
        pose: Pose,
        before: Mapping[str, int],
        by: vocabulary.MovedBy | None,
        planned: bool,
        shown: frozenset[Region] = frozenset(),
    ) -> Iterator[Event]:
        """Bring the robot to ``pose``, let it act there, and count its progress."""
        start = robot.pose
        robot.pose = self.world.move(robot.robot, pose)
        strayed = robot.pose != pose
        self.tell.move(robot, start.region, by, shown)
        if planned and not strayed:
            self.traffic.arrived(robot.name)
        progress, planner = robot.progress, robot.planner
        after = planner.values() if planner is not None else {}
        if isinstance(progress.objective, Ltl):
            if not (before and after):
                before, after = self._step_off(robot, start)
            progress.remember(after)
        robot.arriving = planned
        yield from self._act(robot)
        robot.arriving = False
        if not robot.begun:
            self.strategies.begin(robot)
        elif robot.progress is progress and robot.pose == pose:
            met = progress.arrive(robot.pose.region, before, after)
            for goal, rounds in progress.counted(met):
                self.state.emit(
                    records.Goal(self.state.tick, robot.name, goal, robot.pose.region, rounds)
                )
        if strayed:
            yield from self._go_on_from_elsewhere(robot)
        elif planned and not self.traffic.active:
            yield from self._go_on(robot)

    def _go_on_from_elsewhere(self, robot: RobotState) -> Iterator[Event]:
        """Continue from the pose that the world reports if it is not the commanded one."""
        if robot.planner is not None:
            robot.planner.node = None
        if self.traffic.active:
            yield from self.leave_plan(vocabulary.PlanEndReason.CHANGED)
        else:
            yield from self._go_on(robot)

    def _go_on(self, robot: RobotState) -> Iterator[Event]:
        """Continue a robot off its strategy from where it is: in it, if that knows the pose."""
        if robot.planner is None or robot.planner.node is not None:
            return
        if not self.strategies.relocate(robot):
            yield Astray(robot.name, vocabulary.Reason.PLAN)

    def _look(self, robot: RobotState, shown: frozenset[Region]) -> dict[str, int]:
        planner = robot.planner
        assert planner is not None
        sightings = self._keep_track(robot, planner.task, shown)
        observed = observe(planner.task, self.state.scenario.map, sightings)
        if planner.switch is not None:
            observed |= signal(self.state, robot)
        return observed

    def _keep_track(self, robot: RobotState, task: Task, shown: frozenset[Region]) -> Sightings:
        """Look around; once per turn, since a look lets beliefs grow by a step of the others."""
        sightings = self.state.sightings(robot, task, shown)
        self.sightings.looked(task, sightings.known)
        return sightings

    def _back_up(
        self,
        robot: RobotState,
        observed: Mapping[str, int],
        refused: Proposal,
        violation: Violation,
    ) -> Proposal:
        """Go back to the state before and take what is safe (paper, Section V-B)."""
        self.tell.violation(robot, violation)
        planner = robot.planner
        assert planner is not None
        options = planner.alternatives(robot.pose, observed, refused)
        if robot.robot.model.timing.most > 1:
            # Help is asked for at the end of this turn, and not by a robot on its way elsewhere.
            options = [option for option in options if option.pose == robot.pose]
        safe = next(
            option
            for option in options
            if self.characterization.check(robot.robot, robot.pose, option.pose.region) is None
            and self._may_move(robot, option.pose)
        )
        node = safe.node if safe.pose != robot.pose else None
        self.state.emit(records.Backtrack(self.state.tick, robot.name, safe.pose.region, node))
        return safe

    def _another(
        self, robot: RobotState, observed: Mapping[str, int], refused: Proposal
    ) -> Proposal:
        """Take another successor, with the refused region shown as occupied; else stay."""
        planner = robot.planner
        assert planner is not None
        if planner.switch is None and planner.task.tracking is Tracking.NEARBY:
            shown = frozenset({refused.pose.region})
            answer = planner.propose(self._look(robot, shown))
            if (
                answer is not None
                and answer.pose.region != refused.pose.region
                and answer.pose.region not in self.state.taken(robot.robot)
                and self.characterization.check(robot.robot, robot.pose, answer.pose.region) is None
                and self._may_move(robot, answer.pose)
            ):
                return replace(answer, shown=shown)
        if planner.switch is not None:
            planner.switch.refused = robot.pose
        return planner.held_back(robot.pose, observed)

    def _may_move(self, robot: RobotState, pose: Pose) -> bool:
        """Whether a move loses nothing: the team can continue from there, alone and together."""
        if pose == robot.pose:
            return True
        graph = graph_of(robot.robot, self.state.scenario.map)
        kept = robot.assignment.kept
        if graph.one_way and kept is not None and not kept >> graph.number(pose) & 1:
            return False
        return self.traffic.certified(robot.name, pose)

    def _find_a_way_back(self, robot: RobotState, broken: Sequence[Constraint]) -> Iterator[Event]:
        """Find another node of the robot's strategy, or a new one, as it has no successor."""
        if self.strategies.relocate(robot):
            return
        rules = "; ".join(dict.fromkeys(constraint.origin.rule for constraint in broken))
        end = Conclusion(
            Outcome.ASSUMPTION_VIOLATED,
            f"the other robots violated an assumption of {robot.name}"
            f"{f' ({rules})' if rules else ''}, which has no strategy from here",
        )
        yield Astray(robot.name, vocabulary.Reason.BLOCKED, end)

    def _duration(self, robot: RobotState, target: Pose) -> int:
        """Ticks of a step: drawn from the seed if the model leaves it open; staying takes 1."""
        if target.region == robot.pose.region:
            return 1
        timing = robot.robot.model.timing
        return robot.clock.randint(timing.least, timing.most)

    def _act(self, robot: RobotState) -> Iterator[Event]:
        """Let the robot perform its actions where it stands; changes are decided immediately."""
        state, knowledge = self.state, self.state.knowledge
        further, met = knowledge.perform(robot.robot, state.regions())
        resolved = self.world.act(robot.robot)
        for obstacle, _ in resolved:
            state.introduce(obstacle)
        gone = {obstacle.name for obstacle, _ in resolved}
        for one in met:
            if not one.last or one.obstacle.name in gone:  # else the world has it that it failed
                self.tell.met(robot, one)
        if resolved:
            yield from self.leave_plan(vocabulary.PlanEndReason.CHANGED, settling=True)
            yield ObstaclesResolved(robot.robot, tuple(resolved))
        elif further:
            yield from self.leave_plan(vocabulary.PlanEndReason.CHANGED, settling=True)
            yield Unsettled(vocabulary.Reason.REQUEST)

    def _step_off(self, robot: RobotState, start: Pose) -> tuple[dict[str, int], dict[str, int]]:
        """The variables of formulas around a step that was not their strategy's: poses, and what
        is remembered, which changes as the formulas have it if they allow the step."""
        objective, memory = robot.robot.objective, robot.memory.values
        later = memory
        if isinstance(objective, Ltl) and robot.pose != start:
            later = guarantees_of(objective).remembered(memory, start, robot.pose) or memory
        return {**values_of(start), **memory}, {**values_of(robot.pose), **later}
