"""One robot's turn: look, propose, characterize, back up, move, act.

The order of what happens here is the order of lines in a trace (docs/trace.md).
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.actions import Actions
from safenav.runtime.characterization import ForbiddenMove, characterize
from safenav.runtime.coordination import events
from safenav.runtime.coordination.assignable_goals import signal
from safenav.runtime.coordination.events import Event
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.failures import Reaction, lost, unknown
from safenav.runtime.formulas import graph_of
from safenav.runtime.monitor import Monitors
from safenav.runtime.move_recorder import MoveRecorder
from safenav.runtime.navigation import Planner, Proposal
from safenav.runtime.progress import Progress
from safenav.runtime.team import RobotState, Role, TeamState, Transit
from safenav.runtime.termination import Conclusion
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import Arrived, Blocked, Elsewhere, Ended, Failed, Lost
from safenav.scenario.guarantees import guarantees_of, values_of
from safenav.scenario.model import Obstacle, Tracking
from safenav.scenario.objective import Ltl, relaxed
from safenav.spec.other_robots.tracking import Sightings, observe
from safenav.spec.specification import Constraint
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause, HoldReason, MovedBy, PlanEndReason, Reason
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import region_mask

Values = Mapping[str, int]
Around = tuple[Values, Values]
"""The values of a specification's variables before and after a step."""


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
        self.tell = MoveRecorder(state)
        self.actions = Actions(state, world, self.tell, traffic, self.leave_plan, self._stand_still)

    def step(self, robot: RobotState) -> Iterator[Event]:
        """One turn: its events as they happen, each to be settled before the turn continues."""
        if robot.transit is not None:
            yield from self._travel(robot, robot.transit)
        elif self._may_act(robot) and (yield from self.actions.acts(robot)):
            return
        elif not robot.active:
            yield from self._stand_still(robot, HoldReason.SERVICE)
        elif self.state.waiting is not None and not self.goes_on(robot):
            yield from self._stand_still(robot, HoldReason.OPERATOR)
        elif robot.held is not None or self.state.has_had_turn(robot):
            yield from self._stand_still(robot, robot.held or HoldReason.HELD)
        elif robot.too_flat and not self._charges(robot):
            yield from self._stand_still(robot, HoldReason.HELD)  # brought back with no charge
        elif not self.state.live and self.actions.acts_first(robot):
            yield from self._stand_still(robot, HoldReason.ACTING)
        elif self.traffic.active and not self._released(robot):
            yield from self._follow_plan(robot)
        elif self.state.live and (
            self.actions.waits_to_sweep(robot) or self._awaits_action(robot.name)
        ):
            yield from self._stand_still(robot, HoldReason.HELD)
        else:
            yield from self._follow_strategy(robot)

    def _violation(self, robot: RobotState, target: Region) -> ForbiddenMove | None:
        return characterize(self.world, self.state, robot.robot, robot.pose, target)

    def _may_act(self, robot: RobotState) -> bool:
        """Live: whether a robot may act where it stands; it does not while an operator is waited
        for, who may be there."""
        state = self.state
        may = robot.acting is not None or not state.waits_for_operator
        return state.live and (may or self.goes_on(robot))

    def goes_on(self, robot: RobotState) -> bool:
        """Whether a robot moves while the team waits: it can undo each of its moves alone. Either
        it waits for nothing, and has a strategy for its own objective, which none of those has that
        the wait is about; or it has one for its objective while it waits for a change of the
        scenario."""
        planner, waiting = robot.planner, self.state.waiting
        if planner.node is None or not robot.active or robot.held is not None:
            return False
        if isinstance(robot.robot.objective, Ltl):
            return False
        if self.meanwhile(robot) and robot.assignment.role is Role.WAITS:
            return relaxed(planner.task.objective) == relaxed(robot.assignment.objective)
        if robot.assignment.role is not Role.OWN:
            return False
        if relaxed(planner.task.objective) != relaxed(robot.own.objective):
            return False
        if waiting is not None and robot.name in (waiting.unrealizable or {}):
            return False
        return not self._asked(robot) and not self._turns(robot)

    def meanwhile(self, robot: RobotState) -> bool:
        """Whether a robot is to pursue its objective while it waits, as the team waits for a change
        of the scenario: nothing else would be possible then if it stayed."""
        if self.state.waits_until is None or robot.robot.while_waiting is None:
            return False
        return robot.active and self._asked(robot) and not self._turns(robot)

    def _asked(self, robot: RobotState) -> bool:
        """Whether a robot has requested something that is not resolved."""
        asked = (*self.state.requests, *self.state.requests.given_up)
        return any(robot.name in request.requesters for request in asked)

    def _turns(self, robot: RobotState) -> bool:
        return graph_of(robot.robot, self.state.scenario.map).one_way

    def _stand_still(self, robot: RobotState, why: HoldReason) -> Iterator[Event]:
        """The turn of a robot that makes no decisions: it looks around, and stays. Its strategy
        learns what it has seen."""
        planner = robot.planner
        self._look_around(robot)
        yield from self._move(robot, robot.pose, {}, MovedBy.STAY, why=why)
        if planner.node is None or robot.planner is not planner:
            return
        if planner.task.tracking is not Tracking.NEARBY:
            planner.behind = True
            self.strategies.catch_up(robot)

    def _released(self, robot: RobotState) -> bool:
        """Live: whether a robot has done its way of the joint plan, and continues by its strategy
        (``may_move`` keeps it out of the ways of the others)."""
        planner = robot.planner
        if not self.state.live or not self.traffic.released(robot.name):
            return False
        if self.traffic.follows(robot.name):
            return False
        off = "off its strategy", planner, robot.pose
        if planner.node is None and robot.stays_for != off and not self.strategies.relocate(robot):
            robot.stays_for = off  # it has no node there
        return planner.node is not None

    def _charges(self, robot: RobotState) -> bool:
        """Whether it stands on a charger, and is not to go to another one."""
        here, stop = robot.pose.region, robot.stop
        put_there = self.state.live and stop is None
        away = put_there or (stop is not None and stop.region != here)
        return here in self.state.scenario.chargers and not away

    def _awaits_action(self, name: str) -> bool:
        """Live: whether a robot has followed a helper that stands where it is to act."""
        return self.traffic.follows(name) and any(
            other.assignment.role is Role.HELPS
            and other.transit is None
            and other.assignment.goal
            >> graph_of(other.robot, self.state.scenario.map).number(other.pose)
            & 1
            for other in self.state.robots.values()
        )

    def put_in_service(self, robot: RobotState, *, active: bool) -> None:
        """A robot that is back continues from where it is, whatever the others have done meanwhile.
        If it needs a new strategy, the decision right after this brings one."""
        robot.active = active
        if active:
            self.state.failures.back(robot.name)
        if not active or robot.transit is not None:
            return
        robot.planner.node = None
        told = relaxed(robot.progress.objective)
        if relaxed(robot.planner.task.objective) == told:
            self.strategies.relocate(robot)  # else its assignment has changed meanwhile

    def _follow_strategy(self, robot: RobotState) -> Iterator[Event]:
        """Take the strategy's successor for the observation, unless world or team forbid it."""
        planner = robot.planner
        seen = self._same_again(robot, planner) if self.state.live else None
        if seen is not None and seen == robot.stays_for:
            formulas = isinstance(robot.progress.objective, Ltl)
            before = planner.values() if formulas else {}
            yield from self._move(robot, robot.pose, before, MovedBy.STRATEGY, robot.shown)
            return
        observed = self._look(robot, frozenset())
        broken = self.monitors.broken_assumptions(robot, observed)
        answer = planner.propose(observed)
        lost, silent = answer is None, answer is None and planner.node is not None and not broken
        silent = silent and not planner.behind
        proposal = answer or Proposal(robot.pose, None)
        by = MovedBy.STRATEGY if answer is not None else MovedBy.STAY
        if self.traffic.holds(robot.name):  # a plan is due: it begins no other step
            lost, silent, proposal = False, False, planner.held_back(robot.pose, observed)
            by = MovedBy.STRATEGY if proposal.answers else MovedBy.STAY
        violation = self._violation(robot, proposal.pose.region)
        if violation is not None and self.state.waiting is not None:
            if self.state.live:  # a request has to wait, but a sensor may miss it next time
                self.state.knowledge.sight(violation.obstacle)
            yield from self._move(robot, robot.pose, {}, MovedBy.STAY, why=HoldReason.OPERATOR)
            return
        if violation is not None:
            proposal = self._back_up(robot, observed, proposal, violation)
            by = MovedBy.BACKTRACK
        elif not self._may_move(robot, proposal.pose):
            proposal = self._another(robot, observed, proposal)
            by = MovedBy.STRATEGY if proposal.answers else MovedBy.STAY
        if by is MovedBy.STRATEGY or proposal.node != planner.node:
            self.monitors.check_guarantees(robot, observed, proposal)
        before = planner.values()
        stays = (proposal.pose, proposal.node) == (robot.pose, planner.node)
        told = answer is not None and not (broken or violation) and by is MovedBy.STRATEGY
        if proposal.shown and graph_of(robot.robot, self.state.scenario.map).one_way:
            told = False  # whether it could come back depends on all others
        robot.stays_for, robot.shown = seen if stays and told else None, proposal.shown
        if self.state.live and proposal.node != planner.node:
            # The same again at the same place leads to nothing new, however often it is decided.
            done = min(robot.own.rounds, self.state.scenario.until.rounds)
            moment = planner.node, done, *observed.values()
            self.state.changes += moment not in robot.stood
            robot.stood.add(moment)
        planner.follow(proposal)
        if violation is not None:
            yield events.ObstacleEncountered(violation)
        yield from self._move(robot, proposal.pose, before, by, proposal.shown)
        if robot.planner is planner and planner.behind:
            self.strategies.catch_up(robot)
        self.monitors.tell(robot, broken)
        if silent:
            self.tell.no_answer(robot, observed)
        if violation is not None:
            yield events.HelpRequested(violation)
        elif lost and robot.transit is None:
            yield from self._find_a_way_back(robot, broken)

    def _same_again(self, robot: RobotState, planner: Planner) -> Hashable:
        """Return all observations of a robot's strategy; None if it observes more than its
        sides."""
        if planner.switch is not None or planner.task.tracking is not Tracking.NEARBY:
            return None
        sides = self.state.scenario.map.neighbours(robot.pose.region)
        busy = self.state.had_by_others(robot.robot).intersection(sides)
        swept = self.state.swept(robot.robot).intersection(sides)
        ahead = self.traffic.ahead(robot.name)
        return (
            planner.strategy,
            planner.node,
            planner.behind,
            frozenset(busy),
            frozenset(swept),
            frozenset(side for side in sides if ahead >> side & 1),
            tuple(self.state.inputs.values()),
            self.traffic.holds(robot.name),
            self.state.owed,
        )

    def _follow_plan(self, robot: RobotState) -> Iterator[Event]:
        """The next step of the joint plan, checked like any other move; the robot looks around as
        in any other turn, so that what it knows of others stays true."""
        self._look_around(robot)
        pose = self.traffic.next_pose(robot.name)
        shut = self.state.taken if self.state.live else self.state.swept
        if pose is not None and (pose.region in shut(robot.robot) or robot.too_flat):
            pose = None
        if pose is not None and not self.monitors.allows_planned(robot, pose):
            yield from self.leave_plan(settling=False)
            pose = None
        violation = None if pose is None else self._violation(robot, pose.region)
        if violation is not None:
            self._encounter(robot, violation)
            yield events.ObstacleEncountered(violation)
        if pose is None or violation is not None:
            by = MovedBy.STAY if violation is None else MovedBy.BACKTRACK
            if robot.planner.task.tracking is not Tracking.NEARBY:
                robot.planner.node = None  # it remembers where others were, and they move on
            why = HoldReason.PLAN if self.traffic.active else HoldReason.HELD
            yield from self._move(robot, robot.pose, {}, by, why=why)
        else:
            assert pose.region not in self.state.taken(robot.robot), "plans keep robots apart"
            robot.planner.node = None
            yield from self._move(robot, pose, {}, MovedBy.PLAN)
        if violation is not None:
            yield from self.leave_plan(PlanEndReason.VIOLATION)
            yield events.HelpRequested(violation)

    def leave_plan(
        self, reason: PlanEndReason = PlanEndReason.CHANGED, *, settling: bool = True
    ) -> Iterator[Event]:
        """End the joint plan: every robot continues with a strategy that knows where it is.
        ``settling``: new strategies come with the decision right after this."""
        if not self.traffic.active:
            return
        for robot in self._off_their_strategies():
            self.strategies.relocate(robot)
        nodes = {name: robot.planner.node for name, robot in self.state.robots.items()}
        self.traffic.end(reason, nodes)
        for robot in () if settling else self._off_their_strategies():
            yield events.Astray(robot.name, Reason.PLAN)

    def _off_their_strategies(self) -> list[RobotState]:
        """The robots that can decide something and are in no node of their strategy."""
        return [
            robot
            for robot in self.state.robots.values()
            if robot.transit is None and robot.planner.node is None
        ]

    def _travel(self, robot: RobotState, transit: Transit) -> Iterator[Event]:
        """The turn of a robot on its way: the end of its step, if it has ended."""
        event = self.world.ended(robot.robot)
        if event is None:
            self.tell.begun(robot, None)
            if not self.state.live:
                yield from self.actions.act(robot)
            return
        by = MovedBy.PLAN if transit.planned else None
        yield from self._arrive(robot, transit, event, by)
        if not self.traffic.active:
            yield from self._go_on(robot)

    def _move(
        self,
        robot: RobotState,
        pose: Pose,
        before: Values,
        by: MovedBy,
        shown: frozenset[Region] = frozenset(),
        why: HoldReason | None = None,
    ) -> Iterator[Event]:
        """Begin a step; one that is over when the command returns ends immediately."""
        if self.state.live and pose == robot.pose:
            self.tell.stays(robot, by, why, shown)
            around = self._values_around(robot, pose, before)
            if not self._has_counted(robot, around):
                self._count(robot, robot.progress, around)
            return
        robot.transit = Transit(pose, by is MovedBy.PLAN, before)
        robot.stood.clear()
        self.traffic.set_out()
        event = self.world.start(robot.robot, robot.pose, pose)
        if event is not None and not self.state.live:
            yield from self._arrive(robot, robot.transit, event, by, shown)
            return
        number = self.world.number(robot.name) if event is None else event.command or 0
        self.state.changes += 1
        self.tell.begun(robot, by, shown, number, self.world.expected(robot.robot))
        if not self.state.live:
            yield from self.actions.act(robot)
        elif event is not None:
            yield from self._arrive(robot, robot.transit, event, by)

    def _arrive(
        self,
        robot: RobotState,
        transit: Transit,
        event: Ended,
        by: MovedBy | None,
        shown: frozenset[Region] = frozenset(),
    ) -> Iterator[Event]:
        """Take in the end of a step: let the robot act there, and count its progress."""
        start, pose, progress = robot.pose, transit.pose, robot.progress
        robot.transit = None
        self.state.changes += 1
        if isinstance(event, Arrived):
            robot.pose = pose
        elif not isinstance(event, Lost):
            robot.pose = event.pose
        strayed = robot.pose != pose
        reaction, violation = self._setback(robot, start, pose, event)
        self.tell.ended(robot, start.region, by, shown, event)
        if not strayed:
            self.state.failures.arrived(robot.name)
            if transit.planned:
                self.traffic.arrived(robot.name)
        around = self._values_around(robot, start, transit.before, strayed=strayed)
        robot.arriving, robot.asked = transit.planned, False
        if not self.state.live:
            yield from self.actions.act(robot)
        robot.arriving = False
        self._count(robot, progress, around, strayed=strayed)
        if reaction is not None:
            yield from self._react(robot, reaction, violation, event)
        elif strayed:
            yield from self._go_on_from_elsewhere(robot)
        elif transit.planned and not self.traffic.active:
            yield from self._go_on(robot)

    def _values_around(
        self, robot: RobotState, start: Pose, before: Values, *, strayed: bool = False
    ) -> Around:
        """The variables of formulas around a step that has just ended, and remember what they do
        (nothing else depends on them). Where it was not their strategy's step: poses, and what is
        remembered, which changes as the formulas have it if they allow the step."""
        own, progress = robot.robot.objective, robot.progress
        if not isinstance(progress.objective, Ltl):
            return before, {}
        after: Values = robot.planner.values()
        if strayed or not (before and after):
            memory = later = robot.memory.values
            if isinstance(own, Ltl) and not own.memory.keys() <= memory.keys():
                return {}, {}  # it has had no strategy yet, and counts nothing
            then, now = self.state.inputs_before, self.state.inputs
            if isinstance(own, Ltl) and robot.pose != start:
                found = guarantees_of(own).remembered(memory, start, robot.pose, (then, now))
                later = found or memory
            before = {**values_of(start), **memory, **then}
            after = {**values_of(robot.pose), **later, **now}
        progress.remember(after)
        return before, after

    def _count(
        self, robot: RobotState, progress: Progress, around: Around, *, strayed: bool = False
    ) -> None:
        """Count what the robot has met by its turn, unless its assignment has changed by it."""
        wanted = self.state.scenario.until.rounds
        done = min(robot.own.rounds, wanted)
        if not robot.begun:
            self.strategies.begin(robot)
        elif robot.progress is progress and not (strayed or self.state.has_had_turn(robot)):
            self.state.tell_goals(robot, progress.arrive(robot.pose.region, *around))
        self.state.changes += min(robot.own.rounds, wanted) != done

    def _has_counted(self, robot: RobotState, around: Around) -> bool:
        """Live: whether a robot that stays where it meets all its goals has met them as often as is
        wanted. A pass takes no time: counting each of them would fill the trace."""
        wanted = self.state.scenario.until.rounds if robot.progress is robot.own else 1
        enough = robot.begun and robot.progress.rounds >= wanted
        return enough and robot.progress.met_by_staying(robot.pose.region, *around)

    def _setback(
        self, robot: RobotState, start: Pose, pose: Pose, event: Ended
    ) -> tuple[Reaction | None, ForbiddenMove | None]:
        """Return the policy for a failed step (None: it did not fail), and the obstacle that counts
        as encountered."""
        region, obstacle = pose.region, None
        match event:
            case Elsewhere() if robot.pose.region in self.state.taken(robot.robot):
                return Reaction.OUT_OF_SERVICE, None  # it slid to where another robot is
            case Arrived() | Elsewhere():
                return None, None
            case Lost():
                return Reaction.OUT_OF_SERVICE, None
            case Blocked(obstacle=found) if found is None or self._stops(
                robot, found, self.world.at(event)
            ):
                reaction, obstacle = Reaction.OBSTACLE, found
            case _:
                fatal = isinstance(event, Failed) and event.fatal
                policy = self.state.scenario.failures
                reaction = self.state.failures.move_failed(policy, robot.name, region, fatal=fatal)
        if reaction is not Reaction.OBSTACLE or robot.pose.region != start.region:
            given_up = reaction is Reaction.OUT_OF_SERVICE
            return reaction if given_up else Reaction.RETRY, None
        violation = ForbiddenMove(
            robot.robot, start.region, region, obstacle or unknown(robot.robot, region)
        )
        self._encounter(robot, violation)
        return reaction, violation

    def _stops(self, robot: RobotState, obstacle: Obstacle, at: float) -> bool:
        """Whether an obstacle that a robot has met stops it, and was not opened after that."""
        if self.state.failures.is_late(obstacle.name, at):
            self.tell.late("blocked", "the obstacle was opened later", robot.name, obstacle, at)
            return False
        return self.state.knowledge.closed_to(obstacle, robot.robot)

    def _encounter(self, robot: RobotState, violation: ForbiddenMove) -> None:
        self.tell.violation(robot, violation)
        self.state.emit(records.Backtrack(self.state.tick, robot.name, robot.pose.region))

    def _react(
        self, robot: RobotState, reaction: Reaction, violation: ForbiddenMove | None, event: Ended
    ) -> Iterator[Event]:
        """Apply a failed step: the robot is off its strategy; the region that it could not
        enter is an obstacle, or the robot is out of service."""
        robot.planner.node = None
        if violation is not None:
            yield from self.leave_plan(PlanEndReason.VIOLATION)
            yield events.ObstacleEncountered(violation)
            yield events.HelpRequested(violation)
        elif reaction is Reaction.OUT_OF_SERVICE:
            if isinstance(event, Lost):
                yield from self._lost(robot, event)
            yield from self.serve(robot, active=False, cause=ChangeCause.WORLD)
        else:
            yield from self._go_on_from_elsewhere(robot)

    def _lost(self, robot: RobotState, event: Lost) -> Iterator[Event]:
        """Close all regions but one in which a lost robot may be: it blocks that one itself. Where
        it may be in a zone that it does not hold by that, close all of this to the others."""
        rivals = frozenset(other.name for other in self.state.rivals(robot.robot))
        yield from self.leave_plan(PlanEndReason.VIOLATION)
        here, at = robot.pose.region, {n: each.occupied for n, each in self.state.robots.items()}
        free = event.regions - {here} - self.state.taken(robot.robot)
        closed = dict.fromkeys(free, rivals)
        for zone in self.state.scenario.never_together:
            if robot.name not in zone.robots or here in zone.regions:
                continue
            others = zone.robots - {robot.name}
            standing = frozenset().union(*(at[name] for name in others))
            for region in zone.regions - standing if zone.regions & event.regions else ():
                closed[region] = closed.get(region, frozenset()) | others
        for region in sorted(closed):
            obstacle = lost(robot.robot, closed[region], region)
            violation = ForbiddenMove(robot.robot, robot.pose.region, region, obstacle)
            self._encounter(robot, violation)
            yield events.ObstacleEncountered(violation)

    def serve(self, robot: RobotState, *, active: bool, cause: ChangeCause) -> Iterator[Event]:
        """Put a robot in or out of service. While it is out, other robots take over its duties if
        they can, and its own objective waits."""
        if robot.active != active:
            yield from self.leave_plan()
            yield events.ServiceChanged(robot.name, active, cause)

    def _go_on_from_elsewhere(self, robot: RobotState) -> Iterator[Event]:
        """Continue from the pose that the world reports if it is not the commanded one."""
        robot.planner.node = None
        if self.traffic.active:
            yield from self.leave_plan(settling=False)
        else:
            yield from self._go_on(robot)

    def _go_on(self, robot: RobotState) -> Iterator[Event]:
        """Continue a robot off its strategy from where it is: in it, if that knows the pose."""
        if robot.planner.node is not None or not robot.active:
            return
        if not self.strategies.relocate(robot):
            yield events.Astray(robot.name, Reason.PLAN)

    def _look(self, robot: RobotState, shown: frozenset[Region]) -> dict[str, int]:
        planner = robot.planner
        observed = observe(planner.task, self.state.scenario.map, self._look_around(robot, shown))
        observed |= {
            each.name: int(self.state.inputs[each.name]) for each, _ in planner.task.inputs
        }
        if planner.switch is not None:
            observed |= signal(self.state, robot, observed)
        return observed

    def _look_around(self, robot: RobotState, shown: frozenset[Region] = frozenset()) -> Sightings:
        """Look around, once per turn: a look lets beliefs grow by a step of the others. What a
        strategy believes of others stays true by that, also where it decides nothing."""
        sightings = self.state.sightings(robot, shown)
        self.tell.looked(robot.planner.task, sightings.known)
        return sightings

    def _back_up(
        self,
        robot: RobotState,
        observed: Mapping[str, int],
        refused: Proposal,
        violation: ForbiddenMove,
    ) -> Proposal:
        """Go back to the state before and take what is safe (paper, Section V-B)."""
        self.tell.violation(robot, violation)
        planner = robot.planner
        if planner.switch is not None and self.state.knowledge.knows(violation.obstacle):
            planner.switch.stopped = robot.pose
        options = planner.alternatives(robot.pose, observed, refused)
        if self.state.live or robot.robot.model.timing.most > 1:
            # Help is asked for at the end of this turn, and not by a robot on its way elsewhere.
            options = [option for option in options if option.pose == robot.pose]
        safe = next(
            option
            for option in options
            if self._violation(robot, option.pose.region) is None
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
        if planner.switch is None and planner.task.tracking is Tracking.NEARBY:
            shown = frozenset({refused.pose.region})
            answer = planner.propose(self._look(robot, shown))
            if (
                answer is not None
                and answer.pose.region != refused.pose.region
                and answer.pose.region not in self.state.taken(robot.robot)
                and self._violation(robot, answer.pose.region) is None
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
        if pose.region in self.state.swept(robot.robot):
            return False
        if self.state.live and not self._out_of_ways(robot, pose):
            return False
        graph = graph_of(robot.robot, self.state.scenario.map)
        kept = robot.assignment.safe_poses
        if graph.one_way and kept is not None and not kept >> graph.number(pose) & 1:
            return False
        return self.traffic.certified(robot.name, pose)

    def _out_of_ways(self, robot: RobotState, pose: Pose) -> bool:
        """Live: whether a robot keeps out of what others occupy, or still need for the joint plan;
        and, while a decision waits for strategies, can come back."""
        taken = self.state.taken(robot.robot)
        if pose.region in taken or self.traffic.ahead(robot.name) >> pose.region & 1:
            return False
        graph = graph_of(robot.robot, self.state.scenario.map)
        if not self.state.owed or not graph.one_way:
            return True
        allowed = graph.everywhere & ~graph.poses_on(region_mask(taken))
        return graph.returns(graph.number(pose), graph.number(robot.pose), allowed)

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
        if not broken:  # a joint plan has left it where its formulas forbid it to stay
            end = Conclusion(Outcome.OPERATOR_NEEDED, f"{robot.name} has no strategy from here")
        yield events.Astray(robot.name, Reason.BLOCKED, end)
