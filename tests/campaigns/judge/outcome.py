"""Judges the end of a run without faults, from the moves of its trace.

``completed`` must follow from the moves alone; after ``operator_needed`` the judge's own search
must find the mission infeasible from the run's end and (if nothing was hidden) from its start.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from campaigns.judge import joint
from campaigns.judge.mission import Mission
from campaigns.judge.replay import Replay, rounds_done
from campaigns.judge.situation import Answer, at_start

Line = Mapping[str, Any]
BUDGET = 40_000
"""States of a search."""


def judge_outcome(mission: Mission, ending: Replay, outcome: Line) -> str:
    """Return what is wrong; empty if nothing is, ``?`` if the search was too large."""
    if ending.problems:
        return "inconsistent: " + "; ".join(ending.problems)
    match outcome["outcome"]:
        case "completed":  # live, a robot that stays makes no moves
            return _completed(mission, ending, 1 if "t" in outcome else mission.rounds)
        case "operator_needed":
            return _operator_needed(mission, ending, outcome)
        case other:
            answer = joint.can_complete(mission, ending.situation, BUDGET)
            return f"{other}; the judge: {answer.value}; {outcome['explanation']}"


def told_by_signals(lines: Sequence[Line]) -> list[str]:
    """With signals a team is synthesized once, and robots for which the known map has changed."""
    blocked: set[str] = set()  # with a new permanent obstacle since their last strategy
    found = []
    for line in lines:
        if line["type"] == "blocked":
            blocked.update(line["robots"])
        if line["type"] != "synthesis" or line["reason"] == "initial":
            continue
        if line["robot"] not in blocked:
            found.append(f"tick {line['tick']}: {line['robot']} again: {line['reason']}")
        blocked -= {line["robot"]}
    return found[:1]


def _completed(mission: Mission, ending: Replay, rounds: int) -> str:
    """``rounds``: those that the moves must show."""
    for robot in mission.robots:
        done = rounds_done(robot, ending.visits[robot.name])
        if done < rounds:
            return f"{robot.name} has done {done} rounds of {rounds}"
    return f"{' and '.join(ending.away)} not at the last target" if ending.away else ""


def _operator_needed(mission: Mission, ending: Replay, outcome: Line) -> str:
    begins = [("from its end", ending.situation)]
    if not mission.obstacles:
        begins.append(("from its start", at_start(mission)))
    for where, begin in begins:
        answer = joint.can_complete(mission, begin, BUDGET)
        if answer is Answer.YES:
            return f"given up ({outcome.get('cause')}), and can be completed {where}"
        if answer is Answer.OVER_BUDGET:
            return "?"
    return ""
