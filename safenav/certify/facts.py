"""The facts of the assurance page as data: what was asked, guaranteed, assumed, seen, left open."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from typing import Any

from safenav.certify.checker.check_strategies import Objective
from safenav.certify.proved import TEAM, Proof, rests_on

Claim = Mapping[str, Any]

NOT_COVERED = (
    "That robots move as their mobility says, notice an obstacle before they enter it, and "
    "succeed in what their capabilities name: the model of the world.",
    "That the trace tells what happened: it was written by the program that ran.",
    "The step from the scenario's YAML file to scenario.json; of a map that is drawn in the file "
    "the grid is compared.",
    "The checker (check.py, check_strategies.py) and Python itself.",
    "Motion in metres: of a motion file check.py only sees that it names this trace; `safenav "
    "check-motion` checks the rest.",
    "Who was asked for help, and why: `safenav check-trace` audits the bids.",
    "Time: no claim says when a goal is met, only that it is met again and again.",
)
"""What a bundle does not prove."""

_ASSUMED = {
    "out_of_my_way": "again and again none of the others is beside it",
    "off_my_targets": "the others are not on its targets again and again",
    "out_of_my_sight": "the others are out of its sight again and again",
    "at_its_targets": "the others are at their own targets again and again",
}
_TOLD = (
    "violation",
    "request",
    "met",
    "resolved",
    "blocked",
    "appeared",
    "gone",
    "truth",
    "objective",
    "service",
    "told",
    "assumption",
    "plan",
)


def facts_of(
    lines: Sequence[Mapping[str, Any]],
    claims: Sequence[Claim],
    files: Mapping[str, bytes],
    proofs: Sequence[Proof] = (),
) -> dict[str, Any]:
    """Everything that the assurance page says, for programs. ``proofs``: what the verified checker
    said, if it was asked."""
    scenario = lines[0]["scenario"]
    outcome: Mapping[str, Any] = next(
        (line for line in reversed(lines) if line["type"] == "outcome"), {}
    )
    return {
        "name": scenario["name"],
        "asked": [_asked(name, robot, claims) for name, robot in scenario["robots"].items()],
        "obstacles": [
            {"name": o["name"], "region": o["region"], "action": o["action"]}
            for o in scenario["obstacles"]
        ],
        "outcome": outcome.get("outcome", "unfinished"),
        "explanation": outcome.get("explanation", "the trace ends before the run does"),
        "claims": [dict(claim) for claim in claims],
        "rests_on": {claim["id"]: rests_on(claim, proofs) for claim in claims},
        "proved_of_the_team": [TEAM[p.kind] for p in proofs if p.kind in TEAM and p.proved],
        "assumptions": _assumptions(lines),
        "happened": [
            {"line": number, "tick": line["tick"], "what": _event(line)}
            for number, line in enumerate(lines, 1)
            if line["type"] in _TOLD
        ],
        "not_covered": list(NOT_COVERED),
        "files": {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for name, data in sorted(files.items())
        },
    }


def _asked(name: str, robot: Mapping[str, Any], claims: Sequence[Claim]) -> dict[str, Any]:
    """A robot as the scenario has it, its objective in the form that was proven."""
    texts = (claim["text"] for claim in claims if claim["kind"] == "form")
    forms = [re.sub(r"^Tick \d+: ", "", text) for text in texts]
    own = Objective(robot["objective"])
    known = [f"{name}: {own.words(form)}." for form in ("literal", "alternation")]
    proven = next((text for text in forms if text in known), f"{name}: {own.words()}.")
    return {
        "robot": name,
        "model": robot["model"],
        "mobility": robot["mobility"],
        "start": robot["start"],
        "capabilities": list(robot["capabilities"]),
        "objective": proven.removeprefix(f"{name}: ")[:-1],
        "avoids": list(robot.get("conflicts") or ()),
    }


def _assumptions(lines: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Each assumption once: what it is, who relies on it, who checks it, whether it failed."""
    relied: dict[str, set[str]] = {}
    for line in lines:
        text = _ASSUMED.get(line.get("fairness") or "none")
        if line["type"] == "synthesis" and text and line["verdict"] == "realizable":
            relied.setdefault(text, set()).add(line["robot"])
    found: list[dict[str, Any]] = [
        {
            "text": text,
            "robots": sorted(robots),
            "checked_by": "nobody can see it fail in a finite run; the run shows how it went, and "
            "joint plans bring about what it asks of robots that share a floor",
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
                "text": "the others step to a neighbouring region at most, one after the other, "
                "and never onto the robot",
                "robots": others,
                "checked_by": "the other robots' own strategies guarantee it, and the trace is "
                "checked for it move by move",
                "failed": failed,
            }
        )
    return found


def _event(line: Mapping[str, Any]) -> str:
    match line["type"]:
        case "violation":
            return f"{line['robot']} finds {line['obstacle']} in its way and steps back"
        case "request":
            helper = line.get("helper") or "nobody"
            if helper == line["requester"]:
                return f"{helper} goes to resolve {line['obstacle']} itself"
            return f"{line['requester']} asks for help with {line['obstacle']}: {helper}"
        case "met":
            who = ", ".join(line.get("robots") or [line["robot"]])
            return f"{who}: need {line['need'] + 1} of {line['obstacle']} ({line['action']})"
        case "resolved":
            return f"{line['robot']} resolves {line['obstacle']}"
        case "blocked":
            return f"{line['obstacle']} stays for {', '.join(line['robots'])}: {line['reason']}"
        case "assumption":
            return f"an assumption of {line['robot']} failed: {line['name']}"
        case "truth":
            return f"{line['obstacle']} is changed: it may hide another truth from now on"
        case "objective":
            what = Objective(line["objective"]).words()
            return f"{line['robot']} is given another objective: {what}"
        case "told":
            return f"{line['robot']} is told: {Objective(line['objective']).words()}"
        case "service":
            return f"{line['robot']} is {'back' if line['active'] else 'taken out of service'}"
        case "plan":
            return f"a joint plan for {', '.join(line['robots'])}"
        case kind:
            return f"{line['obstacle']} {kind}"
