"""The paper's Algorithm 1 as one loop: event, decision, synthesis, application.

    for robot in order:
        for event in step(robot):                   # propose, check, move or back up
            while event:
                decision = coordinate(team, event)  # pure: requests, duties, objectives, tasks
                results = synthesize(decision.tasks)
                event = apply(decision, results)    # all of it, or nothing

Numbers in comments are the lines of Algorithm 1 (docs/coordination.md has it beside this file):

     1  for p in P do                              12        if c_r in C_p then
     2    phi_p <- initial objectives              13          add state in S_r to phi_p
     3  phi_stack <- empty                         14          synthesize controllers
     4  synthesize controllers                     15          break
     5  while system active do                     16      continue
     6    execute controllers                      17    else if r in phi_pr then
     7    if r encountered by p_r at s_o then      18      resolve obstacle r
     8      if c_r not in C_pr then                19      pop phi off of phi_stack
     9        push all phi onto phi_stack          20      synthesize controllers
    10        change phi_pr to safe behaviour      21      continue
    11      for p in P do
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from functools import partial

from safenav.dataclass import dataclass
from safenav.runtime.commands import Commands
from safenav.runtime.coordination.decision import Decision, coordinate, reconsider
from safenav.runtime.coordination.events import (
    Astray,
    Event,
    HopeReturned,
    ObstacleChanged,
    RequestsSetAside,
    Started,
    Unsettled,
)
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.coordination.strategy_search import (
    NotYet,
    StrategySearch,
    TaskResult,
    failed,
)
from safenav.runtime.deadlines.ledger import Deadlines
from safenav.runtime.deadlines.refusal import refuse_what_cannot_be_kept
from safenav.runtime.energy.batteries import Batteries
from safenav.runtime.interventions import Interventions
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turn import Turns
from safenav.scenario.model import Obstacle, Outcome
from safenav.trace import records
from safenav.trace.header import objective_in_trace
from safenav.trace.vocabulary import Ending, HoldReason, OperatorCause, PlanEndReason
from safenav.trace.wording import seconds_words

WAITS = (Outcome.OPERATOR_NEEDED, Outcome.ASSUMPTION_VIOLATED, Outcome.SEARCH_LIMIT)
"""The ends after which an operator can help."""
STILL = 3
"""Passes without any change after which nothing will change."""
SLOWEST = 20.0
"""Seconds for each tick of the limit, where a simulated run has no limit in seconds."""


@dataclass
class Algorithm:
    """The loop over a team. The team's state is changed by ``apply`` alone, but for where robots
    are and what they have done there, which is the turns'."""

    team: TeamState
    world: Commands
    search: StrategySearch
    strategies: Strategies
    turns: Turns
    traffic: Traffic
    interventions: Interventions
    stop: Stop
    deadlines: Deadlines
    batteries: Batteries
    attended: bool = False
    """Live: whether an operator can intervene; then the run waits where it would end."""

    def __post_init__(self) -> None:
        self._changed, self._still, self._come = True, 0, False
        self._owed: Unsettled | None = None
        self._together = False
        self._astray: list[Astray] = []
        self.limit = self._limit()

    def begin(self) -> None:
        """Synthesize the first controllers. The team has its initial objectives, and no requests
        (``TeamState.initial``). Raises RunEnded if a robot has none."""
        refuse_what_cannot_be_kept(self.team, self.batteries)
        self.settle([Started()])  # 1 to 4

    def tick(self) -> None:
        """One tick, or one pass of a live run: what the world reports, the changes, each robot's
        turn. Raises RunEnded."""
        team, before = self.team, self.team.changes
        self.stop.check()
        asked = self.interventions.asked
        if team.waiting is not None and not asked and self.world.simulated and self.world.idle:
            return  # time stands still until an operator intervenes
        self._come = self.search.fresh() or self._come
        if not self.world.hear(self._due(), self._changed or self._come or asked):
            return  # there is nothing to do yet
        team.tick += 1  # 5
        self.deadlines.tick_begins()
        self._hear()
        given_up, self._together = self.interventions.given_up, team.waiting is not None and asked
        self._guarded(lambda: self.settle(self.batteries.tick_begins()))
        self._guarded(lambda: self.settle(self.interventions.apply()))
        if given_up:
            raise RunEnded(team.waiting or Conclusion(Outcome.INTERRUPTED, "given up"))
        for change in self.world.changes(team.occupied()):
            if not change.appeared and team.knowledge.knows(change.obstacle):
                self.settle(self.turns.leave_plan(PlanEndReason.CHANGED, settling=True))
            team.introduce(change.obstacle, change.truth)
            self.settle([ObstacleChanged(change)])
        if self._together:
            self._resume()
        for number, robot in enumerate(team.robots.values(), 1):
            self.stop.check()
            if robot.transit is None or self.world.may_have_ended(robot.name):
                self._guarded(partial(self._step, robot))
            self.deadlines.turn_ends(number)
        if team.waiting is None:
            self._guarded(self._plan)
        self._end_if_due()
        self._changed = team.changes > before
        if team.live:
            self._guarded(self._unless_still)

    def _step(self, robot: RobotState) -> None:
        self.settle(self.turns.step(robot))  # 6
        self.settle(self.batteries.turn_ends(robot))

    def _settle_gone(self, obstacle: Obstacle) -> None:
        self.settle(self.turns.gone(obstacle))

    def _plan(self) -> None:
        """Finish the joint plan, or begin one that is due."""
        if self.traffic.tick():
            self.settle(self.turns.leave_plan(PlanEndReason.REACHED))
        if self.traffic.hopeless:
            names, self.traffic.hopeless = self.traffic.hopeless, frozenset()
            self.settle([RequestsSetAside(names)])

    def _unless_still(self) -> None:
        """Live: where robots wait only for robots that wait, they plan. Where nothing can change,
        the run ends. Raises RunEnded."""
        team = self.team
        if self._changed or team.waiting is not None or team.owed or self._astray:
            self._still = 0
            return
        if self.traffic.quiescent(all_still=self.world.idle):
            self._changed = True
        if self._changed or not self.world.idle or self._times():
            return
        self._still += 1
        self._changed = self._still < STILL
        if not self._changed:
            if any(not robot.active for robot in team.robots.values()):
                self._unless_back()
            said = f"no robot moves; {self._what_is_left()}"
            raise RunEnded(Conclusion(Outcome.TIME_LIMIT, said))

    def _times(self) -> list[float]:
        """The times to come at which the scenario changes something."""
        now = self.world.now()
        changes = (float(change.at) for change in self.team.scenario.changes)
        seconds = [float(int(now) + 1)] if self.team.inputs and self.world.simulated else []
        return [time for time in (*changes, *seconds, *self.world.times()) if time > now]

    def _due(self) -> float | None:
        """The time at which there is something to do, whatever the world reports until then."""
        if not self.team.live:
            return None
        limits = [self.limit] if self.limit is not None else []
        return min((*self._times(), *limits), default=None)

    def _limit(self) -> float | None:
        """Seconds of a live run: those of the scenario, or of as many steps of its slowest robot
        as it has ticks."""
        limits = self.team.scenario.limits
        if limits.seconds is not None or not self.world.simulated:
            return limits.seconds
        return limits.ticks * SLOWEST

    def _guarded(self, part: Callable[[], None]) -> None:
        """Do a part of a pass; where the run would end and an operator can help, it waits."""
        try:
            part()
        except RunEnded as over:
            if not self.attended or over.conclusion.outcome not in WAITS:
                raise
            self.wait_for_operator(over.conclusion)

    def wait_for_operator(self, conclusion: Conclusion) -> None:
        """Let the robots stand until an intervention, but those that can still pursue their own
        objective. Nothing of the decision that could not be
        made is in force."""
        team = self.team
        if team.waiting is not None:
            return
        for _ in self.turns.leave_plan(PlanEndReason.CHANGED, settling=True):
            pass  # strategies come with the decision after an intervention
        team.waiting, team.changes = conclusion, team.changes + 1
        outcome = Ending(conclusion.outcome.value)
        cause = None if conclusion.cause is None else OperatorCause(conclusion.cause)
        told = conclusion.explanation, cause, conclusion.proof
        team.emit(records.Waiting(team.tick, outcome, *told))

    def _resume(self) -> None:
        """Decide once after all interventions of a pass: first what was given up is requested
        again, for what it lacked may be there now."""
        self.team.waiting, self._together = None, False
        self._guarded(lambda: self.settle([HopeReturned()]))

    def _hear(self) -> None:
        """Take in what the world has reported beside the ends of commands."""
        failures = self.team.failures
        for dropped in self.world.take_dropped():
            event = dropped.event
            kind, name = type(event).__name__.lower(), getattr(event, "robot", None)
            self.turns.tell.late(kind, dropped.reason, name, None, self.world.at(event))
        for sensed in self.world.take_sensed():
            obstacle, said = sensed.obstacle, "the obstacle was opened later"
            at = self.world.at(sensed)
            if failures.is_late(obstacle.name, at):
                self.turns.tell.late("sensed", said, sensed.by, obstacle, at)
            elif not sensed.there:
                self._guarded(partial(self._settle_gone, obstacle))
        if self._come:
            self._come = False
            self._guarded(self._pay)

    def settle(self, events: Iterable[Event]) -> None:
        """Make the team react to events as they happen: lines 7 to 15 for an obstacle that a robot
        has encountered, 17 to 20 for one that is resolved. Lines 16 and 21 follow elsewhere."""
        for happened in events:
            event: Event | None = happened
            while event is not None:
                if self._together and isinstance(event, Unsettled):
                    break  # what follows from several interventions is decided once
                decision = coordinate(self.team, event, self.stop.check)  # 7 to 13, 17 to 19
                try:
                    results = self.search.synthesize(decision.tasks)  # 14, 20
                except NotYet:
                    self._owe(event, decision)
                    break
                event = self.apply(decision, results)
        if not self.team.owed and not self._astray:
            self.search.forget()

    def _owe(self, event: Event, decision: Decision) -> None:
        """Nothing of a decision is in force until its strategies are there; robots without a
        strategy that suffices wait."""
        for name in decision.tasks:
            self.team.robots[name].held = HoldReason.SYNTHESIS
        if isinstance(event, Unsettled):
            self._owed, self.team.owed = Unsettled(event.reason), True
        elif isinstance(event, Astray):
            self._astray.append(event)

    def _pay(self) -> None:
        """Make the decisions again that wait for strategies."""
        owed, astray = self._owed, self._astray
        self._owed, self._astray, self.team.owed = None, [], False
        for robot in self.team.robots.values():
            robot.held = None
        self.team.changes += 1
        self.settle([owed] if owed is not None else [])
        for event in astray:
            robot = self.team.robots[event.robot]
            planner = robot.planner
            if planner is None or planner.node is not None or robot.transit is not None:
                continue
            if self._owed is not None:
                continue
            if not self.strategies.relocate(robot):
                self.settle([event])

    def apply(self, decision: Decision, results: Mapping[str, TaskResult]) -> Event | None:
        """Put a decision in force if there is a strategy for every task, else what follows from
        that; the event that comes next. Raises RunEnded."""
        team = self.team
        if failed(results):
            decision, results = reconsider(team, decision, results), {}
        team.knowledge, team.requests = decision.knowledge, decision.requests
        team.lacks, team.settled = decision.lacks, decision.settled
        team.changes += 1
        for record in decision.records:
            team.emit(record)
        if decision.end is not None:
            raise RunEnded(decision.end)
        if decision.recount:
            team.restart_counts()
        if decision.drafts:
            self.strategies.install(decision.drafts, results, decision.reason)
            for name in results:
                robot = team.robots[name]
                assert robot.planner is not None
                self.turns.monitors.watch(robot.robot, robot.planner)
            if isinstance(decision.event, Unsettled):
                team.recorded = {
                    name: objective_in_trace(draft.assignment.objective)
                    for name, draft in decision.drafts.items()
                }
        return decision.next

    def first_results(self, names: Collection[str]) -> dict[str, TaskResult]:
        """The synthesis results with which a run begins, for some robots. Nothing runs."""
        tasks = coordinate(self.team, Started(), self.stop.check).tasks
        return self.search.synthesize({n: task for n, task in tasks.items() if n in names})

    def _end_if_due(self) -> None:
        """Raises RunEnded if the mission is completed, or has used up its ticks or seconds."""
        team, scenario = self.team, self.team.scenario
        wanted = scenario.until.rounds
        done = all(r.own.rounds >= wanted and r.base is None for r in team.robots.values())
        free = not any(robot.acting for robot in team.robots.values()) and team.waiting is None
        now = self.world.now() if team.live else team.tick
        coming = any(o.ordered and (o.appears or 0) > now for o in scenario.obstacles)
        if done and free and not (coming or team.owed or team.last_settled.found.served):
            plural = "round" if wanted == 1 else "rounds"
            said = f"every robot has met its objective for {wanted} {plural}"
            self.deadlines.completed()
            raise RunEnded(Conclusion(Outcome.COMPLETED, said))
        left = [robot for robot in team.robots.values() if robot.own.rounds < wanted]
        served = team.last_settled.found.served
        if team.live and free and left and not served and not any(r.active for r in left):
            self._guarded(self._unless_back)
        if team.live:
            if self.limit is not None and self.world.now() >= self.limit:
                raise RunEnded(self._out_of(Outcome.TIME_LIMIT))
        elif team.tick >= scenario.limits.ticks:
            raise RunEnded(self._out_of(Outcome.TICK_LIMIT))

    def _unless_back(self) -> None:
        """Only robots out of service have something left to do. Raises RunEnded unless one may be
        back by itself."""
        if not self._times():
            out = [robot.name for robot in self.team.robots.values() if not robot.active]
            said = f"{' and '.join(out)} out of service; {self._what_is_left()}"
            raise RunEnded(Conclusion(Outcome.OPERATOR_NEEDED, said, "out_of_service"))

    def _out_of(self, limit: Outcome) -> Conclusion:
        said = "; ".join([self._what_is_left(), *self.turns.monitors.unmet_fairness()])
        return Conclusion(limit, said)

    def _what_is_left(self) -> str:
        """Return the reasons why the run is not completed yet."""
        wanted = self.team.scenario.until.rounds
        left = [
            f"{robot.name} has done {robot.own.rounds} of {wanted} rounds"
            for robot in self.team.robots.values()
            if robot.own.rounds < wanted
        ]
        left += [
            f"{' and '.join(request.requesters) or 'the environment'} wait for "
            f"{' and '.join(request.helpers) or 'help'} to resolve {request.obstacle.name}"
            for request in self.team.requests
        ]
        after = f"{self.team.tick} ticks"
        if self.team.live:
            after = seconds_words(self.world.now())
        return f"not completed after {after}: {'; '.join(left)}"
