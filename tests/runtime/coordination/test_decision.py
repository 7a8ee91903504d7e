"""``coordinate`` is a function of the team and an event; it changes nothing."""

import copy

import pytest

from safenav.outcome import Verdict
from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination.decision import Decision, coordinate, reconsider
from safenav.runtime.coordination.events import (
    Astray,
    Event,
    HelpRequested,
    ObstacleChanged,
    ObstacleEncountered,
    ObstaclesResolved,
    Started,
    Unsettled,
)
from safenav.runtime.coordination.strategy_search import TaskResult
from safenav.runtime.team import Role, TeamState
from safenav.runtime.worlds.world import Change
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.verdict import SynthesisResult
from safenav.trace.vocabulary import Reason

LAB = """
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
catalogue:
  robots: {presser: {mobility: free, layer: ground, capabilities: [press]}}
  obstacles: {gate: {action: press, resolve_at: [[2, 1]]}}
robots:
  eye: {model: quadcopter, start: [1, 1], objective: {visit: [[1, 5], [1, 1]]}}
  pia: {model: presser, start: [2, 5], objective: {hold: [2, 5]}}
obstacles: [{type: gate, region: [1, 3]}]
"""
GATE = "gate@10"


def lab() -> TeamState:
    """The team after its first decision."""
    team = TeamState.initial(load_scenario_text(LAB))
    put_in_force(team, decided(team, Started()))
    return team


def decided(team: TeamState, event: Event) -> Decision:
    """The decision; deciding twice gives the same records, and leaves the team as it is."""
    before = team.requests, copy.deepcopy(team.knowledge.pending), dict(team.knowledge.joined)
    found = coordinate(team, event, lambda: None)
    assert coordinate(team, event, lambda: None).records == found.records
    assert (team.requests, team.knowledge.pending, team.knowledge.joined) == before
    return found


def put_in_force(team: TeamState, decision: Decision) -> None:
    """What ``apply`` does, without strategies."""
    for part in ("knowledge", "requests", "lacks", "settled"):
        setattr(team, part, getattr(decision, part) or getattr(team, part))
    for name, draft in decision.drafts.items():
        team.robots[name].assign(draft.assignment)


def met(team: TeamState, robot: str = "eye") -> ForbiddenMove:
    return ForbiddenMove(team.robots[robot].robot, 9, 10, team.scenario.obstacles[0])


def kinds(decision: Decision) -> list[str]:
    return [record.type for record in decision.records]


def test_what_a_robot_encounters_is_known_and_requested_at_once() -> None:
    team = lab()
    decision = decided(team, ObstacleEncountered(met(team)))
    assert decision.knowledge is not None and decision.requests is not None
    assert list(decision.knowledge.pending) == [GATE] and not team.knowledge.pending
    assert [list(r.requesters) for r in decision.requests] == [["eye"]]
    assert (kinds(decision), decision.tasks, decision.next) == ([], {}, None)


def test_a_request_is_settled_by_duties_pushes_and_tasks() -> None:
    team = lab()
    put_in_force(team, decided(team, ObstacleEncountered(met(team))))
    raised = decided(team, HelpRequested(met(team)))
    assert raised.next == Unsettled(Reason.REQUEST)
    put_in_force(team, raised)
    decision = decided(team, Unsettled(Reason.REQUEST))
    assert kinds(decision) == ["request", "push"]
    roles = {name: draft.assignment.role for name, draft in decision.drafts.items()}
    assert roles == {"eye": Role.WAITS, "pia": Role.HELPS}
    assert sorted(decision.tasks) == ["eye", "pia"]
    assert [request.helpers for request in decision.requests or ()] == [("pia",)]


@pytest.mark.parametrize(
    ("event", "records", "follows", "left"),
    [
        ("resolved", ["resolved"], Unsettled(Reason.RESOLVED), 0),
        ("untraversable", ["resolved", "blocked"], Unsettled(Reason.RESOLVED), 0),
        ("gone", ["gone"], Unsettled(Reason.GONE), 0),
        ("met again", [], None, 1),
    ],
)
def test_what_follows_from_an_event_about_a_known_obstacle(
    event: str, records: list[str], follows: Event | None, left: int
) -> None:
    team = lab()
    put_in_force(team, decided(team, ObstacleEncountered(met(team))))
    gate, pia = team.scenario.obstacles[0], team.robots["pia"].robot
    decision = decided(
        team,
        {
            "resolved": ObstaclesResolved(pia, ((gate, None),)),
            "untraversable": ObstaclesResolved(pia, ((gate, False),)),
            "gone": ObstacleChanged(Change(gate, appeared=False)),
            "met again": ObstacleEncountered(met(team, "pia")),
        }[event],
    )
    assert decision.knowledge is not None and decision.requests is not None
    assert (kinds(decision), decision.next) == (records, follows)
    assert len(decision.requests.stack) == left
    assert decision.recount == ("resolved" in records)
    assert (GATE in decision.knowledge.joined) == ("blocked" in records)


def test_a_helper_without_a_strategy_is_passed_over() -> None:
    """A failed task leaves the team as it is, and the same event is decided again: nobody else
    can press, so the request stays open, and eye goes round the gate."""
    team = lab()
    for event in (ObstacleEncountered(met(team)), HelpRequested(met(team))):
        put_in_force(team, decided(team, event))
    decision = decided(team, Unsettled(Reason.REQUEST))
    task = decision.tasks["pia"].candidates[0]
    lost = SynthesisResult("pia", Verdict.UNREALIZABLE, 0.0, False, "0" * 64)
    result = TaskResult(task[1], lost, decision.tasks["pia"].objective, task[0])
    again = reconsider(team, decision, {"pia": result})
    assert again.requests is None and not again.drafts
    assert isinstance(again.next, Unsettled) and list(again.next.refused) == [("pia", GATE)]
    final = decided(team, again.next)
    assert kinds(final) == ["request", "synthesis", "push"]
    assert [draft.assignment.role for draft in final.drafts.values()] == [Role.OWN, Role.OWN]
    assert [request.helpers for request in final.requests or ()] == [()]


def test_a_robot_off_its_strategy_gets_a_new_one_for_what_it_does() -> None:
    team = lab()
    decision = decided(team, Astray("eye", Reason.PLAN))
    assert list(decision.drafts) == list(decision.tasks) == ["eye"]
    assert decision.reason is Reason.PLAN and kinds(decision) == []
