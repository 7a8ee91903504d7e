"""The paper's Algorithm 1 as one loop: event, decision, synthesis, application.

    for robot in order:
        for event in step(robot):                       # propose, check, move or back up
            while event:
                decision = coordinate(team, event)      # pure: requests, duties, objectives, tasks
                answers = synthesize(decision.tasks)
                event = apply(team, decision, answers)  # all of it, or nothing

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

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import partial

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.coordination import events
from safenav.runtime.coordination.decision import Decision, coordinate, reconsider
from safenav.runtime.coordination.events import Event, Unsettled
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.coordination.strategy_search import NotYet, StrategySearch, TaskResult, failed
from safenav.runtime.deadline_monitor.ledger import Deadlines
from safenav.runtime.deadline_monitor.refusal import refusal_of
from safenav.runtime.energy.batteries import Batteries
from safenav.runtime.intervention.applying import Interventions
from safenav.runtime.progress import Progress
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.turn import Turns
from safenav.runtime.worlds.commands import Commands
from safenav.trace.told_objective import objective_in_trace
from safenav.trace.vocabulary import HoldReason, Reason


class Algorithm(Struct):
    """The loop over a team; ``Passes`` runs it as long as the system is active. ``apply`` alone
    changes what follows from decisions: requests, assignments, objectives, service and strategies.
    Turns change the robots' poses, progress and observations."""

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
    _deferred: Unsettled | None = None
    _together: bool = False
    _astray: list[events.OutsideStrategy] = field(default_factory=list)
    _paying: bool = False
    _again: bool = False
    """Whether the team has decided again since a decision was deferred, which may be obsolete."""

    def begin(self) -> None:
        """Synthesize the first controllers. The team has its initial objectives, and no requests
        (``TeamState.initial``). Raises RunEnded if a robot has none, a deadline cannot be met,
        or a charge does not suffice."""
        refusal = refusal_of(self.team, self.batteries)
        if refusal is not None:
            raise RunEnded(refusal)
        self.settle([events.Started()])  # 1 to 4
        self.deadlines.turn_ends(0)

    def execute_controllers(self) -> None:
        """Line 6: the turn of each robot that stands or may have arrived, and its consequences."""
        for number, robot in enumerate(self.team.robots.values(), 1):
            self.stop.check()
            self.deadlines.turn_begins(number)
            if (
                not self.team.claimed_beside(robot)
                if robot.transit is None
                else self.world.may_have_ended(robot.name)
            ):
                turn = partial(self.settle, self._step(robot))
                self.turns.idling.unless_idle(robot, partial(self.run_part, turn))
            self.deadlines.turn_ends(number)

    def _step(self, robot: RobotState) -> Iterator[Event]:
        turn = robot.own.memory.index
        yield from self.turns.step(robot)
        if robot.serves_later and robot.own.memory.index != turn:
            yield Unsettled(Reason.REQUEST)
        yield from self.batteries.turn_ends(robot, completes=self.completes())

    def settle(self, arising: Iterable[Event]) -> None:
        """Make the team react to events as they happen: lines 7 to 15 for an obstacle that a robot
        has encountered, 17 to 20 for one that is resolved. Then it continues (16, 21)."""
        for happened in arising:
            event: Event | None = happened
            while event is not None:
                if self._together and isinstance(event, Unsettled | events.ObstaclesReopened):
                    break  # several interventions are decided together
                self._again |= isinstance(event, Unsettled) and not self._paying
                decision = coordinate(self.team, event, self.stop.check)  # 7 to 13, 17 to 19
                try:
                    answers = self.search.synthesize(decision.tasks)  # 14, 20
                except NotYet:
                    self._defer(decision)
                    break
                event = self.apply(self.team, decision, answers)
        self._forget()

    def apply(
        self, team: TeamState, decision: Decision, answers: Mapping[str, TaskResult]
    ) -> Event | None:
        """Apply a decision if there is a strategy for every task, otherwise the decision that
        follows from the failure. Return the next event. Raises RunEnded."""
        if failed(answers):
            decision, answers = reconsider(team, decision, answers), {}
        for part in ("knowledge", "requests", "lacks", "settled"):
            if (decided := getattr(decision, part)) is not None:
                setattr(team, part, decided)
        if decision.settled is not None:
            self.traffic.look_again()
        team.changes += 1
        for record in decision.records:
            team.emit(record)
        if decision.end is not None:
            before = team.waiting
            if decision.event == events.Started() and self.may_wait(decision.end):
                return events.Started(waits=True)
            if not self.waits_on(decision.end):
                raise RunEnded(decision.end)
            if before is not None:
                lost = {**(before.unrealizable or {}), **(decision.end.unrealizable or {})}
                team.waiting = replace(before, unrealizable=lost)
            return None  # the turn continues
        match decision.event:
            case events.ServiceChanged(name, active):
                team.outdated |= team.waiting is not None
                self.turns.relocation.put_in_service(team.robots[name], active=active)
            case events.ObjectiveGiven(name, objective, within, progress):
                team.give(name, objective, within, progress or Progress(objective))
            case events.OutsideStrategy(name, Reason.BLOCKED, waits=False) if not decision.drafts:
                self.traffic.free(name)
        if decision.recount:
            team.restart_counts()
        if decision.drafts:
            self.strategies.install(decision.drafts, answers, decision.reason)
            for name in answers:
                self.turns.monitors.watch(team.robots[name])
            if isinstance(decision.event, Unsettled):
                team.recorded = {
                    name: objective_in_trace(draft.assignment.objective)
                    for name, draft in decision.drafts.items()
                }
        return decision.next

    def run_part(self, part: Callable[[], None]) -> bool:
        """Do a part of a pass; return whether it was completed without a wait."""
        raise NotImplementedError

    def may_wait(self, end: Conclusion) -> bool:
        """Whether a run that continues another begins with a wait where it would end."""
        raise NotImplementedError

    def waits_on(self, end: Conclusion) -> bool:
        """Whether the team waits where the run would end."""
        raise NotImplementedError

    def completes(self) -> bool:
        """Whether the mission is completed if nothing more happens in this tick."""
        raise NotImplementedError

    def _forget(self) -> None:
        """Discard the synthesis results once no decision waits for any."""
        if not (self.team.deferred or self._astray or self._paying):
            self.search.forget()

    def _defer(self, decision: Decision) -> None:
        """Defer a decision until its strategies are available; robots without a
        strategy that suffices wait."""
        for name in decision.tasks:
            self.team.robots[name].held = HoldReason.SYNTHESIS
        if isinstance(decision.event, Unsettled):
            self._deferred = Unsettled(decision.event.reason)
            self.team.deferred = decision.settled or self.team.last_settled
        elif isinstance(decision.event, events.OutsideStrategy):
            self._astray.append(decision.event)

    def retry_deferred(self) -> None:
        """Repeat the decisions that wait for strategies, and abandon syntheses that none of them
        needs now."""
        deferred, astray = self._deferred, self._astray
        self._again = False
        self.search.wanted.clear()
        self._deferred, self._astray, self.team.deferred = None, [], None
        for robot in self.team.robots.values():
            robot.held = None
        self.team.changes += 1
        self._paying = True
        try:
            self.settle([deferred] if deferred is not None else [])
            for event in astray:
                robot = self.team.robots[event.robot]
                off = robot.planner.node is None and robot.transit is None
                free = off and self._deferred is None
                if event.waits or (free and not self.strategies.relocate(robot)):
                    self.settle([event])
        finally:
            self._paying = False
        self.search.abandon()
        self._forget()

    def first_results(self, names: Collection[str]) -> dict[str, TaskResult]:
        """The initial synthesis results of some robots, without running the mission."""
        tasks = coordinate(self.team, events.Started(), self.stop.check).tasks
        return self.search.synthesize({n: task for n, task in tasks.items() if n in names})
