"""``coordinate`` is a function of the team and an event; it changes nothing."""

import copy

import pytest
from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination.decision import Decision, coordinate
from safenav.runtime.coordination.events import (
    Event,
    ObstacleChanged,
    ObstacleEncountered,
    ObstaclesResolved,
    Started,
    Unsettled,
)
from safenav.runtime.team import TeamState

from safenav.runtime.worlds.world import Change
from safenav.scenario.reading.loader import load_scenario_text
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
    before = team.requests, copy.deepcopy(team.knowledge.pending), dict(team.knowledge.permanent)
    found = coordinate(team, event, lambda: None)
    assert coordinate(team, event, lambda: None).records == found.records
    assert (team.requests, team.knowledge.pending, team.knowledge.permanent) == before
    return found


def put_in_force(team: TeamState, decision: Decision) -> None:
    """Apply a decision like ``apply``, without strategies."""
    for part in ("knowledge", "requests", "lacks", "settled"):
        setattr(team, part, getattr(decision, part) or getattr(team, part))
    for name, draft in decision.drafts.items():
        team.robots[name].assign(draft.assignment)


def met(team: TeamState, robot: str = "eye") -> ForbiddenMove:
    return ForbiddenMove(team.robots[robot].robot, 9, 10, team.scenario.obstacles[0])


def kinds(decision: Decision) -> list[str]:
    return [record.type for record in decision.records]


@pytest.mark.parametrize(
    ("event", "records", "follows", "left"),
    [
        ("resolved", ["resolved"], Unsettled(Reason.RESOLVED), 0),
        ("untraversable", ["resolved", "blocked"], Unsettled(Reason.RESOLVED), 0),
        ("gone", ["gone"], Unsettled(Reason.GONE), 0),
        ("met again", [], None, 1),
    ],
)
def test_events_about_a_known_obstacle_lead_to_their_decisions(
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
    assert (GATE in decision.knowledge.permanent) == ("blocked" in records)
