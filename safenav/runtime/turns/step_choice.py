"""The step that a robot takes: its strategy's, if the world and the team allow it, else another."""

from __future__ import annotations

from collections.abc import Hashable, Mapping

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.characterization import ForbiddenMove, characterize
from safenav.runtime.coordination.assignable_goals import signal
from safenav.runtime.navigation import Proposal
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.move_recorder import MoveRecorder
from safenav.runtime.worlds.commands import Commands
from safenav.scenario.model import Tracking
from safenav.spec.other_robots.tracking import Sightings, observe
from safenav.trace import records
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import region_mask


class StepChoice(Struct, frozen=True):
    """Observes for a robot, and checks the steps that its strategy proposes."""

    state: TeamState
    world: Commands
    recorder: MoveRecorder
    traffic: Traffic

    def look(self, robot: RobotState, shown: frozenset[Region] = frozenset()) -> dict[str, int]:
        """Return the inputs of a robot's strategy, as it observes them now."""
        planner = robot.planner
        observed = observe(planner.task, self.state.scenario.map, self.look_around(robot, shown))
        observed |= {
            each.name: int(self.state.inputs[each.name]) for each, _ in planner.task.inputs
        }
        if planner.switch is not None:
            observed |= signal(self.state, robot, observed)
        return observed

    def look_around(self, robot: RobotState, shown: frozenset[Region] = frozenset()) -> Sightings:
        """Look around, once per turn: each look extends beliefs by one step of the other robots. So
        beliefs stay true also in turns without a decision. Regions ``shown`` count as occupied."""
        team, here, task = self.state, robot.pose.region, robot.planner.task
        positions = {o.name: team.robots[o.name].pose.region for o in task.observed}
        known = team.beliefs.look(task, team.scenario.map, here, positions)
        moving = [team.robots[o.name] for o in task.observed if o.danger]
        busy = team.had_by_others(robot.robot) if moving else set[Region]()
        sides = set(team.scenario.map.neighbours(here))
        # A specification assumes at most as many busy sides as robots (spec.other_robots.nearby).
        room = len(sides) if task.exclusive else len(moving) - len(sides & busy)
        busy |= set(sorted(shown - busy)[: max(0, room)])
        self.recorder.looked(task, known)
        return Sightings(here, frozenset(busy), positions, known)

    def observation(self, robot: RobotState) -> Hashable:
        """Return all that a robot's decision depends on; None if its strategy observes more than
        the sides of its region."""
        planner = robot.planner
        if planner.switch is not None or planner.task.tracking is not Tracking.NEARBY:
            return None
        sides = self.state.scenario.map.neighbours(robot.pose.region)
        busy = self.state.had_by_others(robot.robot, sides)
        ahead = self.traffic.plan.ahead(robot.name)
        return (
            planner.strategy,
            planner.node,
            planner.behind,
            frozenset(busy),
            frozenset(side for side in sides if ahead >> side & 1),
            tuple(self.state.inputs.values()),
            self.traffic.holds(robot.name),
            self.state.deferred,
        )

    def violation(self, robot: RobotState, pose: Pose) -> ForbiddenMove | None:
        """Return the violation of knowledge or observation by a step to ``pose``, or None."""
        return characterize(self.world, self.state, robot.robot, robot.pose, pose.region)

    def back_up(
        self,
        robot: RobotState,
        observed: Mapping[str, int],
        refused: Proposal,
        violation: ForbiddenMove,
    ) -> Proposal:
        """Return to the previous state and take a safe move (paper, Section V-B)."""
        self.recorder.violation(robot, violation)
        planner = robot.planner
        if planner.switch is not None and self.state.knowledge.knows(violation.obstacle):
            planner.switch.stopped = robot.pose
        options = planner.alternatives(robot.pose, observed, refused)
        if self.state.live or robot.robot.model.timing > 1:
            # Help is requested at the end of this turn, and not by a robot in transit.
            options = [option for option in options if option.pose == robot.pose]
        safe = next(
            option
            for option in options
            if self.violation(robot, option.pose) is None and self._may_move(robot, option.pose)
        )
        node = safe.node if safe.pose != robot.pose else None
        self.state.emit(records.Backtrack(self.state.tick, robot.name, safe.pose.region, node))
        return safe

    def allowed(
        self, robot: RobotState, observed: Mapping[str, int], proposal: Proposal
    ) -> Proposal:
        """Return a proposal that loses nothing; else another successor, with the refused region
        shown as occupied, or a stay."""
        if self._may_move(robot, proposal.pose):
            return proposal
        planner = robot.planner
        if planner.switch is None and planner.task.tracking is Tracking.NEARBY:
            shown = frozenset({proposal.pose.region})
            answer = planner.propose(self.look(robot, shown))
            if (
                answer is not None
                and answer.pose.region != proposal.pose.region
                and answer.pose.region not in self.state.had_by_others(robot.robot)
                and self.violation(robot, answer.pose) is None
                and self._may_move(robot, answer.pose)
            ):
                return replace(answer, shown=shown)
        if planner.switch is not None:
            planner.switch.refused = robot.pose
        return planner.held_back(robot.pose, observed)

    def _may_move(self, robot: RobotState, pose: Pose) -> bool:
        """Whether a move loses nothing: the team can continue from there, alone and together. Live:
        it also avoids regions that others occupy or still need for the joint plan; and, while a
        decision waits for strategies, lets the robot return."""
        if pose == robot.pose:
            return True
        state, graph, safe = self.state, self.state.graph(robot), robot.assignment.safe_poses
        closed = state.had_by_others(robot.robot) if state.live else set[Region]()
        if state.live and self.traffic.plan.ahead(robot.name) >> pose.region & 1:
            return False
        number = graph.number(pose)
        if pose.region in closed or (graph.one_way and safe is not None and not safe >> number & 1):
            return False
        if state.deferred and graph.one_way:
            free = graph.everywhere & ~graph.poses_on(region_mask(closed))
            if not graph.returns(number, graph.number(robot.pose), free):
                return False
        return self.traffic.certified(robot.name, pose)
