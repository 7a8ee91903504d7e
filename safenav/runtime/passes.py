"""The passes of a run: reports of the world, turns of the robots, and the end of the run.

In lockstep a pass is a tick; live, a pass begins with an event. ``safenav.runtime.algorithm`` makes
and applies the decisions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from msgspec import field

from safenav.outcome import Outcome
from safenav.runtime.algorithm import Algorithm
from safenav.runtime.coordination.coordination_recorder import left_words
from safenav.runtime.coordination.events import (
    Continued,
    ObstacleChanged,
    ObstaclesReopened,
    OutsideStrategy,
    RequestsSetAside,
)
from safenav.runtime.coordination.infeasibility import what_is_left, where_out
from safenav.runtime.instant import Instant
from safenav.runtime.team import RobotState, Role
from safenav.runtime.termination import Conclusion, RunEnded
from safenav.runtime.turns.while_waiting import has_other_objective
from safenav.scenario.settings import Coordination, switching
from safenav.trace import records
from safenav.trace.vocabulary import OperatorCause, PlanEndReason, Reason

WAITS = (Outcome.OPERATOR_NEEDED, Outcome.ASSUMPTION_VIOLATED, Outcome.SEARCH_LIMIT)
"""Outcomes that an operator can avert."""
STILL = 3
"""Number of unchanged passes after which the state counts as stationary."""
SLOWEST = 20.0
"""Seconds per tick of the limit, for a simulated live run without a limit in seconds."""


class Passes(Algorithm):
    """The passes of a team. ``attended`` (live): an operator can intervene, so the run waits
    instead of ending. So does any run while its scenario has changes to come, until
    ``team.waits_until``. It needs an operator only after that, except in a world that runs in real
    time."""

    attended: bool = False
    limit: float | None = None
    _changed: bool = True
    _still: int = 0
    _come: bool = False
    _instant: Instant = field(default_factory=Instant)

    def __post_init__(self) -> None:
        limits = self.team.scenario.limits
        self.limit = limits.seconds  # the limit of a live run
        if self.limit is None and self.world.simulated:
            self.limit = limits.ticks * SLOWEST
        self.team.changes_to_come = lambda: bool(self._to_come())
        self.team.listeners = (*self.team.listeners, self._instant)

    def tick(self) -> None:
        """Perform one tick, or one pass of a live run: reports of the world, changes, each robot's
        turn. Raises RunEnded."""
        team, before = self.team, self.team.changes
        self.stop.check()
        asked = self.interventions.asked
        stands = self.attended and self.world.simulated and self.world.idle
        if team.waits_for_operator and not (asked or team.outdated) and stands:
            return  # time stands still until an operator intervenes
        self._come = self.search.fresh() or self._come
        changed = self._changed or self._come or asked or self.traffic.thinking.fresh()
        changed = changed or (not self.world.simulated and self.interventions.inputs.changed)
        if not self.world.hear(self._due(), changed):
            return  # there is nothing to do yet
        team.tick += 1  # 5
        self.deadlines.tick_begins()
        self._hear()
        self._apply_changes()
        if self._again and (team.deferred or self._astray):
            self.run_part(self.retry_deferred)
        self._again = False
        self.execute_controllers()  # 6
        if team.waiting is None:
            self.run_part(self._plan)
        self._end_if_due()
        self._changed = team.changes > before
        if team.live:
            self.run_part(self._resolve_standstill)
            self.run_part(self._end_livelock)

    def _apply_changes(self) -> None:
        """Apply the changes by users, the scenario and the world before the turns. Raises
        RunEnded."""
        team, given_up, together = self.team, self.interventions.given_up, self._together
        begun = team.scenario.begun if team.tick == 1 else None
        goes_on = begun is not None and bool(begun.asked or begun.stays)
        outdated = team.outdated
        self._together |= goes_on
        self.run_part(lambda: self.settle(self.batteries.tick_begins()))
        waited, self.interventions.took_effect = team.waiting is not None, False
        self.interventions.ends_wait = False
        self._together |= waited or self.interventions.finds_lost
        while not self.run_part(lambda: self.settle(self.interventions.apply())):
            pass  # the previous change ended in a wait
        if waited:  # no intervention is decided yet
            self._together = together or self.interventions.took_effect
        elif goes_on:  # decided with the requests of the run before
            self._together = together
        self._together |= self.interventions.ends_wait or outdated
        if goes_on:
            self.run_part(partial(self.settle, [Continued()]))
        if given_up:
            if team.outdated:
                self._resume()
            stands = None if self.interventions.took_effect else team.waiting
            raise RunEnded(stands or Conclusion(Outcome.INTERRUPTED, "given up"))
        if team.waiting is not None and team.waits_until is not None:
            self._together |= team.waits_until <= self.world.now()
        for change in self.world.changes(team.occupied()):
            known = team.knowledge.knows(change.obstacle)
            self._together |= team.waiting is not None
            if change.obstacle.ordered if change.appeared else known:  # then duties change
                self.settle(self.turns.relocation.leave_plan())
            if change.appeared:
                team.failures.appeared(change.obstacle.name)
            team.introduce(change.obstacle, change.truth)
            self.run_part(partial(self.settle, [ObstacleChanged(change)]))
        if self._together:
            self._resume()
        if begun is not None and begun.plan is not None and team.waiting is None:
            self.traffic.plan.resume(begun.plan)

    def _plan(self) -> None:
        """Finish the joint plan, or begin one that is due."""
        ended = self.traffic.tick()
        if ended is not None:
            over = self.team.live and self.completes()  # no robot needs a strategy
            self.settle(self.turns.relocation.leave_plan(ended, settling=over))
        if ended is PlanEndReason.CHANGED:
            self.traffic.tick()
        if names := self.traffic.given_up():
            self.settle([RequestsSetAside(names)])
        for name, target in self.traffic.turned().items():
            robot = self.team.robots[name]
            robot.own.begin_with(target)
            self.settle(
                [OutsideStrategy(name, Reason.PLAN)] if robot.assignment.role is Role.OWN else []
            )

    def _resolve_standstill(self) -> None:
        """Resolve a circular wait in a live run by a plan; end the run if nothing can change.
        Raises RunEnded."""
        team = self.team
        thinks = self.traffic.wanted is not None and self.traffic.thinking.background
        if self._changed or team.waiting is not None or team.deferred or self._astray or thinks:
            self._still = 0
            return
        if self.traffic.quiescent(all_still=self.world.idle):
            self._changed = True
        if self._changed or not self.world.idle or self._times():
            return
        self._still += 1
        self._changed = self._still < STILL
        if not self._changed:
            if team.out_of_service:
                self._require_return()
            if self._inputs_may_change():
                return
            words = f"no robot moves; {what_is_left(self.team)}"
            if team.inputs:
                on = sorted(name for name, value in team.inputs.items() if value)
                words += f"; inputs: {' and '.join(on) or 'none'} on"
            raise RunEnded(Conclusion(Outcome.TIME_LIMIT, words))

    def _end_livelock(self) -> None:
        """End the run if robots decide repeatedly while no time passes. Raises RunEnded."""
        robots = self.team.robots.values()
        rounds = sum(robot.own.rounds for robot in robots)
        if words := self._instant.livelock(self.world.now(), rounds, len(robots)):
            raise RunEnded(Conclusion(Outcome.SEARCH_LIMIT, f"{words}; {what_is_left(self.team)}"))

    def _inputs_may_change(self) -> bool:
        """Return whether idle robots may wait for an input that the world still changes. If an
        operator sets it, the team waits for the operator."""
        outside = self.interventions.inputs.world is not None and not self.world.pauses
        return outside and bool(self.team.scenario.inputs) and not self.attended

    def _times(self) -> list[float]:
        """The future times at which the scenario changes something."""
        now, inputs = self.world.now(), self.team.scenario.inputs
        switches = map(float, switching(inputs)) if self.world.simulated else ()
        times = (*switches, *self._of_scenario(), *self.batteries.times())
        return [time for time in times if time > now]

    def _to_come(self) -> list[float]:
        """The future times, within the limits, of the scenario's own events: obstacles, orders,
        objectives, service, listed inputs."""
        now, scenario = self.world.now(), self.team.scenario
        last = self.limit if self.team.live else float(scenario.limits.ticks)
        times = (*self._of_scenario(), *map(float, switching(scenario.inputs)))
        return [time for time in times if now < time and (last is None or time <= last)]

    def _of_scenario(self) -> list[float]:
        """The times at which the scenario changes robots or the world changes by itself, and those
        of the orders that the run announces in a world without orders."""
        changes = [change.at for change in self.team.scenario.changes]
        orders = [o.appears for o in self.team.scenario.obstacles if o.ordered]
        return [*self.world.times(), *(float(at) for at in (*changes, *orders) if at is not None)]

    def _due(self) -> float | None:
        """The time of the next pass without a report of the world."""
        if not self.team.live:
            return None
        limits = [self.limit] if self.limit is not None else []
        return min((*self._times(), *limits), default=None)

    def run_part(self, part: Callable[[], None]) -> bool:
        """Do a part of a pass. If the run would end, but an operator can help or the scenario still
        changes something, wait. Return whether the part was completed."""
        try:
            part()
            return True
        except RunEnded as over:
            if self._is_over(over.conclusion):
                raise RunEnded(self._completed()) from over
            conclusion = self._ends(over.conclusion)
            if conclusion is not None:
                raise RunEnded(conclusion) from over
            return False

    def may_wait(self, end: Conclusion) -> bool:
        scenario = self.team.scenario  # strategies with assignable goals serve only those
        kept = scenario.coordination is Coordination.ASSIGNABLE
        return scenario.continues and not kept and self._may_be_helped(end)

    def waits_on(self, end: Conclusion) -> bool:
        begun = all(robot.has_strategy for robot in self.team.robots.values())
        return begun and not self._is_over(end) and self._ends(end) is None

    def _is_over(self, end: Conclusion) -> bool:
        """Return whether the mission is completed although the run would end otherwise: no robot
        needs what is still open."""
        return end.outcome in WAITS and self.completes()

    def _ends(self, end: Conclusion) -> Conclusion | None:
        """The end of the run, with its proof; None if the team waits instead, or decides again
        after the other changes of this moment."""
        conclusion = self._for_want_of(self.traffic.proven(end))
        if conclusion.outcome in WAITS and self.interventions.more_changes:
            self._together = True
        elif self._may_be_helped(conclusion):
            self.wait(conclusion)
        else:
            return conclusion
        return None

    def _may_be_helped(self, conclusion: Conclusion) -> bool:
        """Whether an operator or a coming change of the scenario can help."""
        if conclusion.outcome is Outcome.TIME_LIMIT:  # no robot moves
            return self.attended and bool(self.team.scenario.inputs)
        coming = conclusion.outcome is Outcome.OPERATOR_NEEDED and self._to_come()
        return conclusion.outcome in WAITS and (self.attended or bool(coming))

    def _for_want_of(self, conclusion: Conclusion) -> Conclusion:
        """Return ``operator_needed`` instead of a search limit if only an operator can bring back a
        robot with remaining duties, whatever another search would find."""
        robots = self.team.robots.values()
        out = [r.name for r in robots if not (r.active or self.team.has_done_all(r))]
        if conclusion.outcome is not Outcome.SEARCH_LIMIT or not out or self._times():
            return conclusion
        words = f"{' and '.join(out)} out of service; {conclusion.explanation}"
        return Conclusion(Outcome.OPERATOR_NEEDED, words, "out_of_service")

    def wait(self, conclusion: Conclusion) -> None:
        """Stop the robots until an operator intervenes or the scenario changes something, except
        those that can still pursue their own objective. The failed decision has no effect."""
        team = self.team
        if team.waiting is not None:
            return
        for _ in self.turns.relocation.leave_plan():
            pass  # strategies come with the decision after an intervention
        team.waiting, team.changes = conclusion, team.changes + 1
        outcome = conclusion.outcome
        cause = None if conclusion.cause is None else OperatorCause(conclusion.cause)
        told = conclusion.explanation, cause, conclusion.proof
        asks = self.attended and not self.world.simulated  # any change ends such a wait
        coming = self._to_come() if outcome is Outcome.OPERATOR_NEEDED and not asks else []
        team.waits_until = min(coming, default=None)
        team.emit(records.Waiting(team.tick, outcome, *told, team.waits_until))
        for robot in team.robots.values():
            if has_other_objective(team, robot):
                self.settle([OutsideStrategy(robot.name, Reason.BLOCKED, waits=True)])

    def _resume(self) -> None:
        """Decide once after all interventions of a pass, or after a change of the scenario. First
        reopen the requests that were given up, since the missing capability may be available."""
        self.team.waiting, self._together, self.team.outdated = None, False, False
        self.run_part(lambda: self.settle([ObstaclesReopened()]))

    def _hear(self) -> None:
        """Process the reports of the world, other than the ends of commands."""
        team, failures = self.team, self.team.failures
        for robot, regions in self.world.claims():  # others may have their turns first
            found = team.robots[robot]
            found.claims = dict.fromkeys({*regions} - found.occupied, frozenset())
        while self.world.dropped:
            event, reason = self.world.dropped.pop(0)
            kind, name = type(event).__name__.lower(), getattr(event, "robot", None)
            self.turns.recorder.late(kind, reason, name, None, self.world.at(event))
        while self.world.sensed:
            sensed = self.world.sensed.pop(0)
            obstacle, words = sensed.obstacle, "the obstacle was opened later"
            at = self.world.at(sensed)
            if failures.is_late(obstacle.name, at):
                self.turns.recorder.late("sensed", words, sensed.by, obstacle, at)
            elif sensed.there:  # as if a robot that may enter it had sensed it
                team.knowledge.sight(obstacle)
            else:  # as if an operator had resolved it
                known = team.knowledge.knows(obstacle)
                self._together |= known and team.waiting is not None
                self.run_part(partial(self.settle, self.turns.actions.gone(obstacle)))
        if self._come:
            self._come = False
            self.run_part(self.retry_deferred)

    def completes(self) -> bool:
        team = self.team
        if not (self._is_free() and all(map(self._is_done, team.robots.values()))):
            return False
        now = self.world.now() if team.live else team.tick
        if any(o.ordered and (o.appears or 0) > now for o in team.scenario.obstacles):
            return False
        if (team.deferred or team.last_settled).found.served:
            return False
        return not (self._undone() and self._to_come())

    def _is_done(self, robot: RobotState) -> bool:
        return self.team.has_done_all(robot) and robot.base is None

    def _is_free(self) -> bool:
        """Whether no robot acts, and the team does not wait."""
        acting = any(robot.acting for robot in self.team.robots.values())
        return not acting and self.team.waiting is None

    def _end_if_due(self) -> None:
        """Raise RunEnded if the mission is completed, or has exhausted its ticks or seconds."""
        team, scenario = self.team, self.team.scenario
        if self.completes():
            raise RunEnded(self._completed())
        left = [robot for robot in team.robots.values() if not team.has_done_all(robot)]
        served = team.last_settled.found.served
        if (
            team.out_of_service
            and left
            and self._is_free()
            and not served
            and self.traffic.searches.only_out(left)
        ):
            self.run_part(self._require_return)
        if team.live:
            if self.limit is not None and self.world.now() >= self.limit:
                raise RunEnded(self._out_of(Outcome.TIME_LIMIT))
        elif team.tick >= scenario.limits.ticks:
            raise RunEnded(self._out_of(Outcome.TICK_LIMIT))

    def _completed(self) -> Conclusion:
        wanted = self.team.scenario.until.rounds
        plural = "round" if wanted == 1 else "rounds"
        words = f"every robot has met its objective for {wanted} {plural}"
        if undone := self._undone():
            words += f"; still open: {', '.join(left_words(self.team, name) for name in undone)}"
        self.deadlines.completed()
        return Conclusion(Outcome.COMPLETED, words)

    def _undone(self) -> list[str]:
        """The open orders."""
        given_up = self.team.knowledge.given_up()  # a robot may have fulfilled one in passing
        left_out = (r for r in self.team.requests.given_up if r.obstacle.name in given_up)
        requests = (*self.team.requests, *left_out)
        return [r.obstacle.name for r in requests if r.obstacle.ordered]

    def _require_return(self) -> None:
        """Handle a state in which only robots out of service have remaining duties. Raises RunEnded
        unless one may return by itself."""
        now, live = self.world.now(), self.team.live
        charges = live and any(time > now for time in self.batteries.times())
        if not (self.batteries.returns or charges or self._to_come()):  # no random inputs
            out = [self.team.robots[name] for name in self.team.out_of_service]
            words = f"{' and '.join(where_out(self.team, robot) for robot in out)} out of service"
            flat = " and ".join(robot.name for robot in out if robot.too_flat)
            words += f" (battery of {flat} empty)" if flat else ""
            words += f"; {what_is_left(self.team)}"
            raise RunEnded(Conclusion(Outcome.OPERATOR_NEEDED, words, "out_of_service"))

    def _out_of(self, limit: Outcome) -> Conclusion:
        return Conclusion(limit, what_is_left(self.team))
