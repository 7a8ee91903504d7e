"""The facts of the assurance page as data: objectives, guarantees, assumptions, observations."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

from safenav.audit.world import World
from safenav.certify.checker.check_objectives import Objective
from safenav.certify.checker.check_tasks import ASSUMED
from safenav.trace.reading import read_lines
from safenav.trace.records import KINDS
from safenav.trace.wording import Wording
from safenav.world.map import RegionMap

Claim = Mapping[str, Any]

NOT_COVERED = (
    "The world model: robots move as specified, detect obstacles before entering them, and their "
    "actions succeed.",
    "The truth of the trace: the program that ran wrote it.",
    "The step from the scenario's YAML file to scenario.json. The checker compares only the grid "
    "of a map drawn in the scenario.",
    "The checker (check.py, check_*.py) and Python itself.",
    "Motion in metres: check.py only compares which trace a motion file names; `safenav check` "
    "judges the rest.",
    "The choice of helpers: `safenav check` judges the bids.",
    "Time: no claim says when a goal is met, only that it is met infinitely often.",
)
"""Limits of a bundle's proof."""

_EVENTS = (
    *("violation", "request", "met", "resolved", "blocked", "appeared", "gone", "truth"),
    *("objective", "service", "told", "assumption", "plan"),
)


def facts_of(
    lines: Sequence[Mapping[str, Any]],
    claims: Sequence[Claim],
    files: Mapping[str, bytes],
) -> dict[str, Any]:
    """Return the contents of the assurance page as data."""
    scenario = lines[0]["scenario"]
    trace = read_lines(map(json.dumps, lines))
    told = trace.header.scenario.map
    world = RegionMap.from_grid(told.grid, told.names, told.areas)
    wording = Wording(
        world.word,
        world.place,
        actions={o.name: [n.action for n in o.all_needs] for o in trace.obstacles.values()},
        skills={n: robot.capabilities for n, robot in trace.header.scenario.robots.items()},
    )
    numbers = (number for number, line in enumerate(lines[1:], 2) if line["type"] in KINDS)
    outcome: Mapping[str, Any] = next(
        (line for line in reversed(lines) if line["type"] == "outcome"), {}
    )
    return {
        "name": scenario["name"],
        "asked": [
            _asked(name, robot, claims, world, World.of(scenario["map"]))
            for name, robot in scenario["robots"].items()
        ],
        "obstacles": [
            {"name": o["name"], "label": wording.obstacle(o["name"])}
            | {key: o[key] for key in ("region", "action")}
            | {"needs": [need["action"] for need in o.get("needs") or [o]]}
            for o in scenario["obstacles"]
        ],
        "outcome": outcome.get("outcome", "unfinished"),
        "explanation": outcome.get("explanation", "the trace ends before the run does"),
        "claims": [dict(claim) for claim in claims],
        "assumptions": _assumptions(lines),
        "happened": [
            {"line": number, "tick": record.tick, "what": wording.sentence(record)}
            for number, record in zip(numbers, trace.records, strict=True)
            if record.type in _EVENTS
        ],
        "not_covered": list(NOT_COVERED),
        "files": {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for name, data in sorted(files.items())
        },
    }


def _asked(
    name: str, robot: Mapping[str, Any], claims: Sequence[Claim], world: RegionMap, places: World
) -> dict[str, Any]:
    """Return a robot's data, with its objective in the proven form."""
    forms = [claim for claim in claims if claim["kind"] == "form"]
    objective = Objective(robot["objective"]).proven(name, places, forms)
    return {
        "robot": name,
        "model": robot["model"],
        "mobility": robot["mobility"],
        "start": robot["start"],
        "start_label": world.place(robot["start"]),
        "capabilities": list(robot["capabilities"]),
        "objective": objective,
        "avoids": list(robot.get("conflicts") or ()),
    }


def _assumptions(lines: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each assumption once: its text, the robots that rely on it, its check and its
    failures."""
    relied: dict[str, set[str]] = {}
    for line in lines:
        fairness = line.get("fairness") or "none"
        if line["type"] == "synthesis" and fairness != "none" and line["verdict"] == "realizable":
            text = ASSUMED[fairness].removeprefix("if ")
            relied.setdefault(text, set()).add(line["robot"])
    found: list[dict[str, Any]] = [
        {
            "text": text,
            "robots": sorted(robots),
            "checked_by": "no finite run can refute it; "
            "joint plans bring it about on shared floors",
            "failed": [],
        }
        for text, robots in relied.items()
    ]
    failed = [
        {"tick": line["tick"], "robot": line["robot"], "what": line["name"]}
        for line in lines
        if line["type"] == "assumption"
    ]
    others = sorted(
        {n for line in lines if line["type"] == "synthesis" for n in line.get("moving") or ()}
    )
    if others:
        found.append(
            {
                "text": "the other robots move one after another, at most to a neighbouring "
                "region, and never onto the robot",
                "robots": others,
                "checked_by": "the other robots' strategies guarantee it; the checker verifies it "
                "for every move",
                "failed": failed,
            }
        )
    return found
