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

from collections.abc import Collection, Iterable, Mapping

from msgspec import Struct, field

from safenav.runtime.coordination.decision import Decision, coordinate, reconsider
from safenav.runtime.coordination.events import (
    Astray,
    Event,
    Started,
    Unsettled,
)
from safenav.runtime.coordination.ladder import misses_its_rounds
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.coordination.strategy_search import (
    NotYet,
    StrategySearch,
    TaskResult,
    failed,
)
from safenav.runtime.energy.batteries import Batteries
from safenav.runtime.interventions import Interventions
from safenav.runtime.promises.ledger import Deadlines
from safenav.runtime.promises.refusal import refuse_what_cannot_be_kept
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turn import Turns
from safenav.runtime.worlds.commands import Commands
from safenav.trace.header import objective_in_trace
from safenav.trace.vocabulary import HoldReason, Reason


class Algorithm(Struct):
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
    _owed: Unsettled | None = None
    _together: bool = False
    _astray: list[Astray] = field(default_factory=list)
    _paying: bool = False

    def begin(self) -> None:
        """Synthesize the first controllers. The team has its initial objectives, and no requests
        (``TeamState.initial``). Raises RunEnded if a robot has none."""
        refuse_what_cannot_be_kept(self.team, self.batteries)
        self.settle([Started()])  # 1 to 4
        self.deadlines.turn_ends(0)

    def _step(self, robot: RobotState) -> None:
        rounds = robot.own.rounds
        self.settle(self.turns.step(robot))  # 6
        if robot.own.rounds > rounds and misses_its_rounds(self.team, robot):
            self.settle([Astray(robot.name, Reason.ROUND)])
        self.settle(self.batteries.turn_ends(robot))

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
        self._forget()

    def _forget(self) -> None:
        """Forget the strategies that have come, once no decision waits for any."""
        if not (self.team.owed or self._astray or self._paying):
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
        self._paying = True
        try:
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
        finally:
            self._paying = False
        self._forget()

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
            if self.waits_on(decision.end):
                return None  # and the turn continues
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

    def waits_on(self, end: Conclusion) -> bool:
        """Whether the team waits already where the run would end."""
        del end
        return False

    def first_results(self, names: Collection[str]) -> dict[str, TaskResult]:
        """The synthesis results with which a run begins, for some robots. Nothing runs."""
        tasks = coordinate(self.team, Started(), self.stop.check).tasks
        return self.search.synthesize({n: task for n, task in tasks.items() if n in names})
