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

from safenav.dataclass import dataclass
from safenav.runtime.checked_world import CheckedWorld
from safenav.runtime.coordination.decision import Decision, coordinate, reconsider
from safenav.runtime.coordination.events import Event, ObstacleChanged, Started, Unsettled
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.coordination.strategy_search import StrategySearch, TaskResult, failed
from safenav.runtime.interventions import Interventions
from safenav.runtime.team import TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turn import Turns
from safenav.scenario.model import Outcome
from safenav.trace.header import objective_in_trace
from safenav.trace.vocabulary import PlanEndReason


@dataclass
class Algorithm:
    """The loop over a team: it owns no state of its own. The team's is changed by ``apply`` alone,
    but for where robots are and what they have done there, which is the turns'."""

    team: TeamState
    world: CheckedWorld
    search: StrategySearch
    strategies: Strategies
    turns: Turns
    traffic: Traffic
    interventions: Interventions
    stop: Stop

    def begin(self) -> None:
        """Synthesize the first controllers. The team has its initial objectives, and no requests
        (``TeamState.initial``). Raises RunEnded if a robot has none."""
        self.settle([Started()])  # 1 to 4

    def tick(self) -> None:
        """One tick: the changes of the world, then each robot's turn. Raises RunEnded."""
        self.stop.check()
        self.team.tick += 1  # 5
        self.settle(self.interventions.apply())
        for change in self.world.changes(self.team.tick, self.team.occupied()):
            if not change.appeared and self.team.knowledge.knows(change.obstacle):
                self.settle(self.turns.leave_plan(PlanEndReason.CHANGED, settling=True))
            self.team.introduce(change.obstacle, change.truth)
            self.settle([ObstacleChanged(change)])
        for robot in self.team.robots.values():
            self.stop.check()
            self.settle(self.turns.step(robot))  # 6
        if self.traffic.tick():
            self.settle(self.turns.leave_plan(PlanEndReason.REACHED))
        self._end_if_due()

    def settle(self, events: Iterable[Event]) -> None:
        """Make the team react to events as they happen: lines 7 to 15 for an obstacle that a robot
        has encountered, 17 to 20 for one that is resolved. Lines 16 and 21 follow elsewhere."""
        for happened in events:
            event: Event | None = happened
            while event is not None:
                decision = coordinate(self.team, event, self.stop.check)  # 7 to 13, 17 to 19
                results = self.search.synthesize(decision.tasks)  # 14, 20
                event = self.apply(decision, results)

    def apply(self, decision: Decision, results: Mapping[str, TaskResult]) -> Event | None:
        """Put a decision in force if there is a strategy for every task, else what follows from
        that; the event that comes next. Raises RunEnded."""
        team = self.team
        if failed(results):
            decision, results = reconsider(team, decision, results), {}
        team.knowledge, team.requests = decision.knowledge, decision.requests
        team.lacks, team.settled = decision.lacks, decision.settled
        for record in decision.records:
            team.emit(record)
        if decision.end is not None:
            raise RunEnded(decision.end)
        if decision.recount:
            team.restart_counts()
        if decision.drafts:
            self.strategies.install(decision.drafts, results, decision.reason)
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
        """Raises RunEnded if the mission is completed, or has used up its ticks."""
        scenario, robots = self.team.scenario, self.team.robots.values()
        wanted = scenario.until.rounds
        done = all(robot.own.rounds >= wanted for robot in robots)
        if done and not self.team.last_settled.found.served:
            plural = "round" if wanted == 1 else "rounds"
            said = f"every robot has met its objective for {wanted} {plural}"
            raise RunEnded(Conclusion(Outcome.COMPLETED, said))
        if self.team.tick >= scenario.limits.ticks:
            said = "; ".join([self._what_is_left(), *self.turns.monitors.unmet_fairness()])
            raise RunEnded(Conclusion(Outcome.TICK_LIMIT, said))

    def _what_is_left(self) -> str:
        """Return the reasons why the run is not completed yet."""
        wanted = self.team.scenario.until.rounds
        left = [
            f"{robot.name} has done {robot.own.rounds} of {wanted} rounds"
            for robot in self.team.robots.values()
            if robot.own.rounds < wanted
        ]
        left += [
            f"{' and '.join(request.requesters)} wait for "
            f"{' and '.join(request.helpers) or 'help'} to resolve {request.obstacle.name}"
            for request in self.team.requests
        ]
        return f"not completed after {self.team.tick} ticks: {'; '.join(left)}"
