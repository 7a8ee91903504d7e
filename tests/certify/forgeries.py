"""Altered proofs of negatives, joint plans, stack events, and runs that are relabelled.

Mutants like those of ``certify.mutants``, for runs in which somebody is stuck, or follows a plan.
"""

import hashlib
import json
from collections.abc import Callable, Iterator
from copy import deepcopy
from random import Random
from typing import Any

from certify.making import Files
from certify.mutants import Mutant, lines_of, with_lines

Line = dict[str, Any]
Change = Callable[[Line, Random], bool]


def _line(kinds: tuple[str, ...], change: Change) -> Callable[[Files, Random], Files | None]:
    """Some line of these types for which ``change`` finds something to alter is altered."""

    def alter(files: Files, source: Random) -> Files | None:
        lines = lines_of(files)
        found = [line for line in lines if line["type"] in kinds]
        source.shuffle(found)
        done = any(change(line, source) for line in found)
        return with_lines(files, lines) if done else None

    return alter


def _proofs(proof: Any) -> Iterator[Line]:
    """A proof and those inside it."""
    if proof is not None:
        yield proof
        for choice in proof.get("choices", ()):
            yield from _proofs(choice["proof"])


def _proof(kind: str, change: Change) -> Callable[[Files, Random], Files | None]:
    def alter(line: Line, source: Random) -> bool:
        found = [proof for proof in _proofs(line.get("proof")) if proof["kind"] == kind]
        return bool(found) and change(source.choice(found), source)

    return _line(("blocked", "outcome"), alter)


def _place_gone(proof: Line, source: Random) -> bool:
    poses = proof["robots"][source.choice(sorted(proof["robots"]))]["poses"]
    return bool(poses) and poses.pop(source.randrange(len(poses))) is not None


def _place_more(proof: Line, source: Random) -> bool:
    robot = proof["robots"][source.choice(sorted(proof["robots"]))]
    heading = robot["poses"][0][1] if robot["poses"] else None
    robot["poses"].append([source.randrange(1000, 2000), heading])
    return True


def _other_life(proof: Line, source: Random) -> bool:
    robot = proof["robots"][source.choice(sorted(proof["robots"]))]
    robot["live"] = not robot["live"]
    return True


def _other_obstacles(proof: Line, source: Random) -> bool:
    names = source.choice([proof["never"], proof["resolved"]])
    if names:
        names.pop()
    else:
        names.append("door@999")
    return True


def _action_more(files: Files, source: Random) -> Files | None:
    """Robots that could have resolved what is called unresolvable."""
    lines = lines_of(files)
    never = {o for line in lines for p in _proofs(line.get("proof")) for o in p.get("never", ())}
    scenario = lines[0]["scenario"]
    needs = [o for o in scenario["obstacles"] if o["name"] in never]
    if not needs:
        return None
    obstacle = source.choice(needs)
    actions = [n["action"] for n in obstacle.get("needs") or ()] or [obstacle["action"]]
    for robot in scenario["robots"].values():
        robot["capabilities"] = sorted({*robot["capabilities"], *actions})
    return with_lines(files, lines)


def _choice_gone(proof: Line, source: Random) -> bool:
    choices = proof["choices"]
    return bool(choices) and choices.pop(source.randrange(len(choices))) is not None


def _other_option(proof: Line, source: Random) -> bool:
    option = source.choice(proof["choices"])["option"]
    if source.random() < 0.5:
        option["need"] += 1
    else:
        option["robots"] = [*option["robots"], option["robots"][0]]
    return True


def _other_joint(proof: Line, source: Random) -> bool:
    key = source.choice(["states", "sha256", "start", "rounds"])
    if key == "states":
        proof["states"] += source.choice([-1, 1, 7])
    elif key == "sha256":
        proof["sha256"] = hashlib.sha256(str(source.random()).encode()).hexdigest()
    elif key == "start":
        place = proof["start"][source.choice(sorted(proof["start"]))]
        place[0] += source.choice([-1, 1])
    else:
        proof["goal"]["rounds"] += 5
    return True


def _proof_of_another(line: Line, source: Random) -> bool:
    """A closure in which everybody is stuck where it stands, or an empty tree."""
    if line.get("proof") is None:
        return False
    named = list(line["rounds"]) if "rounds" in line else list(line["robots"])
    never = ["door@999"]
    stuck = {name: {"poses": [[1, None]], "live": False} for name in named}
    closure = {"kind": "closure", "resolved": [], "never": never, "robots": stuck}
    line["proof"] = source.choice([closure, {"kind": "tree", "choices": []}])
    return True


def _proof_gone(line: Line, source: Random) -> bool:
    del source
    return line.pop("proof", None) is not None


def _step(files: Files, source: Random) -> Files | None:
    """A place of a plan that a robot comes to: a plan may end before that."""
    lines = lines_of(files)
    plan: Line = {}
    found: list[tuple[list[Any], int]] = []
    for line in lines:
        if line["type"] == "plan":
            plan, taken = line["robots"], dict.fromkeys(line["robots"], 0)
        elif line["type"] == "plan_end":
            plan = {}
        elif line.get("by") == "plan" and plan and line.get("toward") is None:
            taken[line["robot"]] += 1
            found.append((plan[line["robot"]], taken[line["robot"]]))
    if not found:
        return None
    way, k = source.choice(found)
    if source.random() < 0.5:
        del way[k]
    else:
        way[k] = [way[k][0] + source.choice([-1, 1, 13]), way[k][1]]
    return with_lines(files, lines)


def _order(line: Line, source: Random) -> bool:
    if not line["orders"]:
        return False
    order = source.choice(line["orders"])
    at = source.choice([1, 3])
    order[at] = max(0, order[at] + source.choice([-1, 1, 2, 5]))
    return True


def _owner(line: Line, source: Random) -> bool:
    names = sorted(line["robots"])
    if len(names) < 2:
        return False
    one, other = source.sample(names, 2)
    ways = line["robots"]
    ways[one], ways[other] = ways[other], ways[one]
    return ways[one] != ways[other]


def _helper(line: Line, source: Random) -> bool:
    del source
    before = line["helper"]
    line["helper"] = line["requester"]
    return bool(before != line["requester"] and line["obstacle"])


def _obstacle(line: Line, source: Random) -> bool:
    del source
    line["obstacle"] = "door@999"
    return True


def _deadlock(files: Files, source: Random) -> Files | None:
    """A completed run, cut and said to have ended in a deadlock, with one proof or another."""
    lines = lines_of(files)
    if lines[-1].get("outcome") != "completed":
        return None
    tick = source.randrange(1, lines[-1]["tick"])
    kept = [line for line in lines[:-1] if line.get("tick", 0) <= tick]
    at = {}
    for name, robot in lines[0]["scenario"]["robots"].items():
        moves = [m for m in kept if m["type"] == "move" and m["robot"] == name]
        last = moves[-1] if moves else {"to": robot["start"], "heading": robot.get("heading")}
        at[name] = [last.get("toward") or last["to"], last["heading"]]
    text = json.dumps(list(at.values()), separators=(",", ":")) + "\n"
    joint = {
        "kind": "joint",
        "robots": list(at),
        "start": at,
        "stages": {},
        "goal": {"rounds": 1},
        "states": 1,
        "sha256": hashlib.sha256(text.encode()).hexdigest(),
    }
    outcome = {**deepcopy(lines[-1]), "tick": tick, "ticks": tick, "outcome": "operator_needed"}
    outcome["cause"] = "deadlock"
    proof = source.choice([None, joint, {"kind": "tree", "choices": []}])
    outcome |= {} if proof is None else {"proof": proof}
    return with_lines(files, [*kept, outcome])


def _given_up(files: Files, source: Random) -> Files | None:
    """An obstacle that was resolved in the end, declared unresolvable before."""
    lines = lines_of(files)
    resolved = [k for k, line in enumerate(lines) if line["type"] == "resolved"]
    if not resolved:
        return None
    k = source.choice(resolved)
    obstacle, scenario = lines[k]["obstacle"], lines[0]["scenario"]
    found = [o for o in scenario["obstacles"] if o["name"] == obstacle]
    if not found:
        return None
    places = {
        n: {"poses": [[r["start"], None]], "live": True} for n, r in scenario["robots"].items()
    }
    proof = {"kind": "closure", "resolved": [], "never": [obstacle], "robots": places}
    blocked = {
        "type": "blocked",
        "tick": lines[k]["tick"],
        "obstacle": obstacle,
        "robots": found[0]["blocks"],
        "reason": "unresolvable",
    }
    blocked |= source.choice([{}, {"proof": proof}])
    return with_lines(files, [*lines[:k], blocked, *lines[k + 1 :]])


ORDERS = "the robots keep the altered order as well, and it keeps them apart"
PROOF = "the altered proof still holds: it says more than is needed, or what is computed anyway"
ASKED = "who was asked is not claimed, and the robot named can do something about the obstacle"

FORGERIES = (
    Mutant("a place of a closure gone", _proof("closure", _place_gone), PROOF),
    Mutant("a place more in a closure", _proof("closure", _place_more), PROOF),
    Mutant("who can go on", _proof("closure", _other_life), PROOF),
    Mutant("what is never resolved", _proof("closure", _other_obstacles), PROOF),
    Mutant("an action more", _action_more),
    Mutant("a choice of a tree gone", _proof("tree", _choice_gone), PROOF),
    Mutant("another option of a tree", _proof("tree", _other_option), PROOF),
    Mutant("another joint proof", _proof("joint", _other_joint), PROOF),
    Mutant("the proof of something else", _line(("blocked", "outcome"), _proof_of_another)),
    Mutant("no proof", _line(("blocked", "outcome"), _proof_gone)),
    Mutant("a step of a plan", _step),
    Mutant("an order of a plan", _line(("plan",), _order), ORDERS),
    Mutant("whose way it is", _line(("plan",), _owner)),
    Mutant("who helps", _line(("push", "pop"), _helper), ASKED),
    Mutant("what a request is about", _line(("push", "pop"), _obstacle)),
    Mutant("a completed run cut: deadlock", _deadlock),
    Mutant("given up for no reason", _given_up),
)
