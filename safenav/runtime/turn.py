"""One robot's turn: propose, check, backtrack if need be, move, act, count.

The order of what happens here is the order of lines in a trace (docs/trace.md).
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence

from safenav.runtime.controllers import Controllers
from safenav.runtime.coordination import Impasse, Resynthesis
from safenav.runtime.environment import Violation, World
from safenav.runtime.monitor import Monitors
from safenav.runtime.navigation import Planner, Proposal
from safenav.runtime.state import TeamState, Transit
from safenav.runtime.traffic import Traffic
from safenav.scenario.model import Robot
from safenav.spec.others.belief import watch_for
from safenav.spec.others.knowledge import Knowledge
from safenav.spec.others.tracking import observe
from safenav.spec.task import Task
from safenav.trace import records
from safenav.world.moves import Pose


class LostError(Exception):
    """A robot's assumptions were broken and it has no strategy from where it is. ``rules``:
    what the others were assumed to do."""

    def __init__(self, rules: Sequence[str]) -> None:
        self.rules = tuple(dict.fromkeys(rules))
        super().__init__("; ".join(self.rules))


class Turns:
    """Carries out turns on a team's state in a world."""

    def __init__(
        self,
        state: TeamState,
        world: World,
        controllers: Controllers,
        coordination: Resynthesis,
        traffic: Traffic,
    ) -> None:
        self._state = state
        self._world = world
        self._controllers = controllers
        self._coordination = coordination
        self._traffic = traffic
        self.monitors = Monitors(state)
        self._looked: tuple[Task, Mapping[str, Knowledge]] | None = None
        self._told: dict[tuple[str, str], Knowledge] = {}
        seed = state.scenario.seed
        self._clocks = {
            robot.name: random.Random(f"{seed}/{robot.name}") for robot in state.scenario.robots
        }

    def take(self, robot: Robot) -> Impasse | None:
        """One turn. Raises LostError if the others broke what the robot assumed and nothing
        can be done about it."""
        state, name = self._state, robot.name
        transit = state.transits.get(name)
        if transit is not None:
            return self._travel(robot, transit)
        planner = state.planners[name]
        observed = self._observe(robot, planner)
        broken = self.monitors.broken_assumptions(robot, planner, observed)
        proposal = planner.propose(observed)
        lost = proposal is None
        silent = lost and planner.node is not None and not broken
        if proposal is None:
            proposal = Proposal(state.poses[name], None)
        violation = self._check(robot, proposal)
        if violation is not None:
            proposal = self._backtrack(robot, planner, observed, proposal, violation)
        self.monitors.check_guarantees(robot, planner, observed, proposal)
        ticks = self._duration(robot, proposal.pose)
        before = planner.values()
        planner.follow(proposal)
        if ticks > 1:
            state.transits[name] = Transit(proposal.pose, state.tick + ticks - 1)
            planner.before = before
            self._traffic.note(robot)
            self._tell_move(robot, state.poses[name], proposal.pose)
            self.monitors.tell(robot, broken)
            return self._act(robot)
        impasse = self._arrive(robot, proposal.pose, before)
        self.monitors.tell(robot, broken)
        if silent:
            self._report_no_answer(robot, observed)
        if impasse is None and violation is not None:
            impasse = self._coordination.on_violation(violation)
        if impasse is None and lost and self._coordination.resynthesize():
            raise LostError([constraint.origin.rule for constraint in broken])
        return impasse

    def _travel(self, robot: Robot, transit: Transit) -> Impasse | None:
        """A tick of a step that takes several."""
        state, name = self._state, robot.name
        if state.tick < transit.arrives:
            self._tell_move(robot, state.poses[name], transit.pose)
            return self._act(robot)
        del state.transits[name]
        return self._arrive(robot, transit.pose, state.planners[name].before)

    def _arrive(self, robot: Robot, pose: Pose, before: Mapping[str, int]) -> Impasse | None:
        """Bring the robot to ``pose``, let it act there, and count its progress."""
        state, name = self._state, robot.name
        start = state.poses[name]
        self._world.move(robot, pose)
        state.poses[name] = pose
        self._traffic.note(robot)
        self._tell_move(robot, start, pose)
        planner = state.planners[name]
        after = planner.values()
        impasse = self._act(robot)
        if impasse is not None or state.planners[name].assignment is not planner.assignment:
            return impasse
        if not planner.begun:
            self._controllers.begin(name)
            return None
        progress = planner.assignment.progress
        for goal in progress.arrive(pose.region, before, after):
            state.emit(records.Goal(state.tick, name, goal.goal, pose.region, progress.rounds))
        return None

    def _observe(self, robot: Robot, planner: Planner) -> dict[str, int]:
        closed = self._traffic.closed_to(robot) if self._state.scenario.deadlock else frozenset()
        sightings = self._state.sightings(robot, planner.task, closed)
        self._looked = (planner.task, sightings.known)
        observed = observe(planner.task, self._state.scenario.map, sightings)
        if planner.switch is not None:
            signal = self._state.tasks.current[robot.name].signal
            observed |= planner.switch.inputs(signal, self._state.region(robot))
        return observed

    def _check(self, robot: Robot, proposal: Proposal) -> Violation | None:
        pose = self._state.poses[robot.name]
        return self._state.knowledge.check(robot, pose, proposal.pose.region)

    def _backtrack(
        self,
        robot: Robot,
        planner: Planner,
        observed: Mapping[str, int],
        refused: Proposal,
        violation: Violation,
    ) -> Proposal:
        """Go back to the state before and take what is safe (paper, Section V-B)."""
        state, name, obstacle = self._state, robot.name, violation.obstacle
        state.introduce(obstacle)
        state.emit(
            records.Violation(
                state.tick,
                name,
                violation.at,
                violation.proposed,
                obstacle.name,
                obstacle.type.action,
            )
        )
        here = state.poses[name]
        options = planner.alternatives(here, observed, refused)
        if robot.model.timing.most > 1:
            # Help is asked for at the end of this turn, and not by a robot on its way elsewhere.
            options = [option for option in options if option.pose == here]
        safe = next(p for p in options if self._check(robot, p) is None)
        state.emit(records.Backtrack(state.tick, name, safe.pose.region))
        return safe

    def _duration(self, robot: Robot, target: Pose) -> int:
        """Ticks of a step: drawn from the seed if the model leaves it open; staying takes 1."""
        timing = robot.model.timing
        if target.region == self._state.region(robot):
            return 1
        return self._clocks[robot.name].randint(timing.least, timing.most)

    def _tell_move(self, robot: Robot, start: Pose, target: Pose) -> None:
        """The move line of this tick: towards the target while in transit, then to it."""
        state = self._state
        transit = robot.name in state.transits
        now = start if transit else target
        heading = now.heading.label if now.heading is not None else None
        toward = target.region if transit else None
        state.emit(records.Move(state.tick, robot.name, start.region, now.region, heading, toward))
        self._tell_beliefs(robot)

    def _tell_beliefs(self, robot: Robot) -> None:
        """What the robot has learnt of others by its look in this turn, where it is new."""
        if self._looked is None:
            return
        task, knowledge = self._looked
        self._looked = None
        for other, known in knowledge.items():
            if self._told.get((robot.name, other)) == known:
                continue
            self._told[robot.name, other] = known
            seen = isinstance(known, int)
            regions = (
                frozenset({known})
                if isinstance(known, int)
                else watch_for(task, self._state.scenario.map).possible(known)
            )
            self._state.emit(records.Belief(self._state.tick, robot.name, other, seen, regions))
        for (name, other), known in list(self._told.items()):
            # Nobody looks for those who wait: where they do is known to the team.
            where = self._state.poses[other].region
            if name == robot.name and other not in knowledge and known != where:
                self._told[name, other] = where
                self._state.emit(
                    records.Belief(self._state.tick, name, other, False, frozenset({where}))
                )

    def _act(self, robot: Robot) -> Impasse | None:
        for obstacle, traversable in self._world.act(robot):
            self._state.introduce(obstacle)
            impasse = self._coordination.on_resolved(robot, obstacle, traversable)
            if impasse is not None:
                return impasse
        return None

    def _report_no_answer(self, robot: Robot, observed: Mapping[str, int]) -> None:
        """The strategy knows no answer, and no single assumption says why: what was observed
        cannot be said in its inputs."""
        where = ", ".join(f"{name} = {value}" for name, value in observed.items())
        name = f"how the others move (now {where})"
        self._state.emit(records.Assumption(self._state.tick, robot.name, name))
