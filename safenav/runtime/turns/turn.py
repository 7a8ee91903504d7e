"""One robot's turn: look, propose, characterize, back up, move, act.

The order of these steps is the order of trace lines (docs/trace.md).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping

from safenav.runtime.coordination import events
from safenav.runtime.coordination.events import Event
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.navigation import Proposal
from safenav.runtime.team import DecidedStep, RobotState, Role, TeamState
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.actions import Actions
from safenav.runtime.turns.idling import Idling
from safenav.runtime.turns.monitor import Monitors
from safenav.runtime.turns.move_recorder import MoveRecorder
from safenav.runtime.turns.moves import Moves
from safenav.runtime.turns.relocation import Relocation
from safenav.runtime.turns.step_choice import StepChoice
from safenav.runtime.turns.while_waiting import may_act, may_continue
from safenav.runtime.worlds.commands import Commands
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl
from safenav.trace.vocabulary import ChangeCause, HoldReason, MovedBy, PlanEndReason


class Turns:
    """Carries out turns on a team's state in a world."""

    def __init__(
        self, state: TeamState, world: Commands, strategies: Strategies, traffic: Traffic
    ) -> None:
        self.state = state
        self.world = world
        self.strategies = strategies
        self.traffic = traffic
        self.monitors = Monitors(state)
        self.recorder = recorder = MoveRecorder(state)
        self.relocation = relocation = Relocation(state, strategies, traffic)
        self.actions = Actions(state, world, recorder, traffic, relocation, self._stand_still)
        self.moves = Moves(state, world, recorder, relocation, self.actions)
        self.choice = StepChoice(state, world, recorder, traffic)
        self.idling = Idling(state, self.choice, traffic, world.simulated)

    def step(self, robot: RobotState) -> Iterator[Event]:
        """One turn: its events as they happen, each to be settled before the turn continues."""
        if robot.transit is not None:
            yield from self.moves.travel(robot, robot.transit)
        elif self._may_act(robot) and (yield from self.actions.acts(robot)):
            return
        elif not robot.active:
            yield from self.moves.close_vacated(robot)
            yield from self._stand_still(robot, robot.held or HoldReason.SERVICE)
        elif self.state.waiting is not None and not may_continue(self.state, robot):
            yield from self._stand_still(robot, HoldReason.OPERATOR)
        elif robot.held is not None or self.state.has_had_turn(robot):
            yield from self._stand_still(robot, robot.held or HoldReason.HELD)
        elif robot.too_flat and not self._charges(robot):
            yield from self._stand_still(robot, HoldReason.HELD)  # brought back with no charge
        elif not self.state.live and self.actions.acts_first(robot):
            yield from self._stand_still(robot, HoldReason.ACTING)
        elif self._is_shut_in(robot):
            yield from self._go_back(robot)
        elif self.traffic.plan.active and not self._released(robot):
            yield from self._follow_plan(robot)
        elif self.state.live and self._awaits_action(robot.name):
            yield from self._stand_still(robot, HoldReason.HELD)
        else:
            yield from self._follow_strategy(robot)

    def _may_act(self, robot: RobotState) -> bool:
        """Live: whether a robot may act where it stands. It does not while the team waits for an
        operator, who may be there."""
        state = self.state
        may = robot.acting is not None or not state.waits_for_operator
        return state.live and (may or may_act(self.state, robot))

    def _stand_still(self, robot: RobotState, why: HoldReason) -> Iterator[Event]:
        """The turn of a robot that decides nothing: it looks around, and stays. Its strategy is
        updated with the look."""
        planner = robot.planner
        self.choice.look_around(robot)
        yield from self._stay(robot, why)
        if planner.node is None or robot.planner is not planner:
            return
        if planner.task.tracking is not Tracking.NEARBY:
            planner.behind = True
            self.strategies.catch_up(robot)

    def _released(self, robot: RobotState) -> bool:
        """Live: whether a robot has completed its part of the joint plan, and continues with its
        strategy (``_may_move`` keeps it out of the others' paths)."""
        planner = robot.planner
        if not self.state.live or not self.traffic.plan.released(robot.name):
            return False
        if self.traffic.plan.follows(robot.name):
            return False
        off = "off its strategy", planner, robot.pose
        if planner.node is None and robot.stays_for != off and not self.strategies.relocate(robot):
            robot.stays_for = off  # it has no node there
        return planner.node is not None

    def _is_shut_in(self, robot: RobotState) -> bool:
        """Whether a robot has walked into an obstacle on which it no longer acts."""
        around = self.state.knowledge.around(robot.pose.region, robot.robot)
        left = around is not None and self.state.knowledge.is_left(around, robot.robot)
        return left and robot.came is not None

    def _go_back(self, robot: RobotState) -> Iterator[Event]:
        """Let a robot return from an obstacle to where it came from, unless another robot is
        there. Its strategy may lead it on through the obstacle."""
        graph, came = self.state.graph(robot), robot.came
        assert came is not None
        steps = map(graph.pose, graph.steps(graph.number(robot.pose)))
        back = next((pose for pose in steps if pose.region == came.region), None)
        free = came.region not in self.state.had_by_others(robot.robot)
        if back is None or not free or self.choice.violation(robot, back) is not None:
            yield from self._stand_still(robot, HoldReason.HELD)
            if back is None and self.state.knowledge.is_waited_for(robot.pose.region):
                why = "it cannot turn back from an obstacle that it has failed to resolve"
                self.state.failures.out[robot.name] = why
                yield from self.relocation.serve(robot, active=False, cause=ChangeCause.WORLD)
            return
        yield from self.relocation.leave_plan(settling=False)
        self.choice.look_around(robot)
        robot.planner.node = None
        yield from self.moves.begin(robot, DecidedStep(back, MovedBy.BACKTRACK))
        if robot.transit is None and not self.traffic.plan.active:
            yield from self.relocation.go_on(robot)

    def _charges(self, robot: RobotState) -> bool:
        """Whether it stands on a charger, and has no other one to go to."""
        here, stop = robot.pose.region, robot.stop
        put_there = self.state.live and stop is None
        away = put_there or (stop is not None and stop.region != here)
        return here in self.state.scenario.chargers and not away

    def _awaits_action(self, name: str) -> bool:
        """Live: whether a robot has followed a helper that is in position to act."""
        return self.traffic.plan.follows(name) and any(
            other.assignment.role is Role.HELPS
            and other.transit is None
            and other.assignment.goal >> self.state.graph(other).number(other.pose) & 1
            for other in self.state.robots.values()
        )

    def _stay(
        self, robot: RobotState, why: HoldReason, by: MovedBy = MovedBy.STAY
    ) -> Iterator[Event]:
        yield from self.moves.begin(robot, DecidedStep(robot.pose, by, why=why))

    def _follow_strategy(self, robot: RobotState) -> Iterator[Event]:
        """Take the strategy's successor for the observation, unless world or team forbid it."""
        planner, choice = robot.planner, self.choice
        seen = choice.observation(robot) if self.state.live else None
        if seen is not None and seen == robot.stays_for:
            before = planner.values() if isinstance(robot.progress.objective, Ltl) else {}
            stay = DecidedStep(robot.pose, MovedBy.STRATEGY, before, robot.shown)
            yield from self.moves.begin(robot, stay)
            return
        observed = choice.look(robot)
        broken = self.monitors.broken_assumptions(robot, observed)
        answer = planner.propose(observed)
        lost, proposal = answer is None, answer or Proposal(robot.pose, None)
        if self.traffic.holds(robot.name):  # a plan is about to begin, so no other step does
            lost, proposal = False, planner.held_back(robot.pose, observed)
        silent = lost and planner.node is not None and not (broken or planner.behind)
        violation = choice.violation(robot, proposal.pose)
        if violation is not None and self.state.waiting is not None:
            yield from self._stay(robot, HoldReason.OPERATOR)
            return
        if violation is None:
            proposal = choice.allowed(robot, observed, proposal)
            by = MovedBy.STRATEGY if proposal.answers else MovedBy.STAY
        else:
            proposal = choice.back_up(robot, observed, proposal, violation)
            by = MovedBy.BACKTRACK
        if by is MovedBy.STRATEGY or proposal.node != planner.node:
            self.monitors.check_guarantees(robot, observed, proposal)
        before, regular = planner.values(), not (answer is None or broken or violation)
        self._note_decision(robot, observed, proposal, seen if regular else None)
        planner.follow(proposal)
        if violation is not None:
            yield events.ObstacleEncountered(violation)
        yield from self.moves.begin(robot, DecidedStep(proposal.pose, by, before, proposal.shown))
        if robot.planner is planner and planner.behind:
            self.strategies.catch_up(robot)
        self.monitors.record(robot, broken)
        if silent:
            self.recorder.no_answer(robot, observed)
        if violation is not None:
            yield events.HelpRequested(violation)
        elif lost and robot.transit is None:
            yield from self.relocation.find_a_way_back(robot, broken)

    def _note_decision(
        self, robot: RobotState, observed: Mapping[str, int], proposal: Proposal, seen: Hashable
    ) -> None:
        """Live: note a robot's decision, and that its strategy stays for the observation ``seen``.
        Repeating a decision in the same pose changes nothing."""
        planner = robot.planner
        stays = (proposal.pose, proposal.node) == (robot.pose, planner.node)
        # With regions shown, whether it could return depends on all other robots.
        lasts = not (proposal.shown and self.state.graph(robot).one_way)
        robot.stays_for = seen if stays and proposal.answers and lasts else None
        robot.shown = proposal.shown
        if self.state.live and proposal.node != planner.node:
            moment = planner.node, self.state.rounds_counted(robot), *observed.values()
            self.state.changes += moment not in robot.stood
            robot.stood.add(moment)

    def _follow_plan(self, robot: RobotState) -> Iterator[Event]:
        """Take the next step of the joint plan, checked like any other move. The robot looks around
        as in any other turn, so that its beliefs stay true."""
        self.choice.look_around(robot)
        pose = self.traffic.plan.next_pose(robot.name)
        closed = self.state.had_by_others(robot.robot) if self.state.live else ()
        if pose is not None and (pose.region in closed or robot.too_flat):
            pose = None
        if pose is not None and not self.monitors.allows_planned(robot, pose):
            yield from self.relocation.leave_plan(settling=False)
            pose = None
        violation = None if pose is None else self.choice.violation(robot, pose)
        if violation is not None:
            self.recorder.encounter(robot, violation)
            yield events.ObstacleEncountered(violation)
        if pose is None or violation is not None:
            if robot.planner.task.tracking is not Tracking.NEARBY:
                robot.planner.node = None  # it remembers the others' former regions
            why = HoldReason.PLAN if self.traffic.plan.active else HoldReason.HELD
            by = MovedBy.STAY if violation is None else MovedBy.BACKTRACK
            yield from self._stay(robot, why, by)
        else:
            assert pose.region not in self.state.had_by_others(robot.robot), (
                "plans keep robots apart"
            )
            robot.planner.node = None
            yield from self.moves.begin(robot, DecidedStep(pose, MovedBy.PLAN))
        if violation is not None:
            yield from self.relocation.leave_plan(PlanEndReason.VIOLATION)
            yield events.HelpRequested(violation)
