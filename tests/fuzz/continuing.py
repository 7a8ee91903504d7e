"""Runs that are killed and continued: the rest must equal that of the whole run."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from safenav.runtime.analysis.resuming import resumed

from campaigns.seeds import SlowError, crash_of, limited
from safenav import Mission
from safenav.audit.check import audit, check_trace
from safenav.lines import json_line
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import Ltl, formulas_in
from safenav.trace.reading import read_bytes, read_lines
from safenav.trace.writing import as_data
from safenav.world.moves import Heading, Mobility, Pose

LIMITS = ("tick_limit", "time_limit", "search_limit")
Line = Mapping[str, Any]


@dataclass
class Rest:
    """The rest of a run. ``found``: the finding, if any; ``excuse``: why it may end differently."""

    lines: list[str] = field(default_factory=list)
    outcome: str = "no outcome"
    found: list[str] = field(default_factory=list)
    excuse: str | None = None


def told(scenario: Scenario, patience: int) -> list[str]:
    """The trace of a run."""
    lines: list[str] = []
    listener = [lambda record: lines.append(json_line(as_data(record)))]
    with limited(patience):
        Mission(scenario, listeners=listener).run()
    return lines


def rest_of(
    scenario: Scenario, whole: Sequence[str], end: int, patience: float, *, alone: bool
) -> Rest:
    """Continue a run from its first lines; the next one is incomplete. ``alone``: only the scenario
    has changed anything in the run."""
    rest = Rest()
    if findings := check_trace(whole[:end]).findings:
        rest.found.append(f"audit of the first {end} lines: {findings[0]}")
    torn = "".join(whole[:end]) + whole[end][: len(whole[end]) // 2]
    first = read_bytes(torn.encode())
    try:
        begins = resumed(first, scenario)
        rest.lines = told(begins, patience)
    except SlowError:
        rest.found.append(f"slow: no end after {patience} s from line {end}")
        return rest
    except Exception as error:
        rest.found.append(f"crash from line {end}: {crash_of(error)}")
        return rest
    if findings := audit(read_lines(rest.lines), first).findings:
        rest.found.append(f"audit of the rest from line {end}: {findings[0]}")
    records = [json.loads(line) for line in rest.lines]
    met = next((r for r in records if r["type"] == "violation" and _is_known(r, begins)), None)
    if met is not None:
        rest.found.append(f"from line {end} {met['robot']} meets {met['obstacle']} again")
    before, rest.outcome = json.loads(whole[-1])["outcome"], records[-1]["outcome"]
    surprised = any(record["type"] == "violation" for record in records)  # in a trap, perhaps
    alone = alone and json.loads(whole[0])["scenario"]["world"] == "simulated"
    if alone and not surprised and rest.outcome not in (before, "completed"):
        rest.excuse = excuse(
            before, records, scenario, _acting(whole[:end]), in_transit=_in_transit(whole[:end])
        )
        if rest.excuse is None:
            rest.found.append(f"{before}, but continued from line {end} {rest.outcome}")
    return rest


def excuse(
    before: str,
    rest: Sequence[Line],
    scenario: Scenario,
    acting: Collection[str] = (),
    *,
    in_transit: bool = False,
) -> str | None:
    """Return why a rest may end differently from the whole run, which ended ``before``; None: it
    may not. Its plans, and the steps of its strategies, may differ (docs/coordination.md).
    ``acting``: the robots that act again, since the trace tells no result; ``in_transit``: a step
    of several ticks is repeated (docs/limits.md)."""
    end = rest[-1]
    if before in LIMITS:
        return "the whole run had not ended"
    if end["outcome"] == "late":
        if before != "completed":
            return "due before the end of a mission that cannot be completed"
        return "late where a step is repeated" if in_transit else None
    if before == "late" and end.get("proof"):
        return "a proof before something is due"
    robots = {robot.name: robot for robot in scenario.robots}
    flat = {r["robot"] for r in rest if r["type"] == "service" and r.get("cause") == "battery"}
    beside = any(scenario.in_conflict(robots[name]) for name in flat)
    if end["outcome"] == "operator_needed" and beside:
        return "a flat battery beside other robots"
    if end["outcome"] == "operator_needed" and flat & {*acting}:
        return "a flat battery where an action is repeated"
    lost, begun = end.get("unrealizable") or {}, rest[0]["scenario"]["begun"]
    if lost and all(_must_leave(robots[name], scenario) for name in lost):
        return "formulas that forbid a robot to stay"
    if lost and begun.get("plan") and all(isinstance(robots[n].objective, Ltl) for n in lost):
        return "formulas in the middle of a joint plan"
    return None


def _acting(lines: Sequence[str]) -> set[str]:
    """The robots whose last action has no result in these lines."""
    acting = set[str]()
    for record in map(json.loads, lines):
        if record["type"] == "act":
            acting |= {*record["robots"]}
        elif record["type"] in ("resolved", "met"):
            acting -= {record["robot"], *record.get("robots", ())}
        elif record["type"] in ("move", "depart"):
            acting.discard(record["robot"])
    return acting


def _in_transit(lines: Sequence[str]) -> bool:
    """Whether a robot has not finished its last step in these lines."""
    steps = dict[str, bool]()
    for record in map(json.loads, lines):
        if record["type"] in ("move", "depart", "arrive"):
            steps[record["robot"]] = record["type"] == "depart" or "toward" in record
    return any(steps.values())


def _must_leave(robot: Robot, scenario: Scenario) -> bool:
    """Whether its formulas forbid a robot to stay somewhere."""
    formulas = formulas_in(robot.objective)
    ways = [None] if robot.model.mobility is Mobility.FREE else [*Heading]
    poses = [Pose(region, way) for region in scenario.map.free for way in ways]
    return formulas is not None and not all(guarantees_of(formulas).allows(p, p) for p in poses)


def _is_known(violation: Line, rest: Scenario) -> bool:
    """Whether a robot meets the obstacle where it had met it before."""
    begun = rest.begun
    met = {} if begun is None else begun.asked.get(violation["obstacle"], {})
    return violation["tick"] <= 1 and met.get(violation["robot"]) == violation["at"]
