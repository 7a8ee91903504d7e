"""Bundles altered in one place with all checksums repaired, as a forger would do.

A mutant gets the files of a bundle and a random source; it returns None if it can alter nothing.
``harmless`` says why a bundle may still prove its claims after such a change.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Any

from certify.making import Files

Alter = Callable[[Files, Random], Files | None]


@dataclass(frozen=True)
class Mutant:
    name: str
    alter: Alter
    harmless: str = ""
    """Why it may be accepted; empty: it must be refused."""


def lines_of(files: Files) -> list[dict[str, Any]]:
    return [json.loads(line) for line in files["trace.jsonl"].splitlines()]


def with_lines(files: Files, lines: list[dict[str, Any]]) -> Files:
    """With another trace."""
    text = "".join(json.dumps(line) + "\n" for line in lines)
    return {**files, "trace.jsonl": text.encode()}


def renamed(files: Files, path: str, data: bytes) -> Files:
    """With another strategy: its name and the trace follow, and the measures too if the forger
    finds any."""
    old = path.rpartition("/")[2].partition(".")[0]
    new = hashlib.sha256(data).hexdigest()
    after = {
        name.replace(old, new): content.replace(old.encode(), new.encode())
        if name == "trace.jsonl"
        else content
        for name, content in files.items()
    }
    after[path.replace(old, new)] = data
    return after


def some(files: Files, folder: str, source: Random) -> str | None:
    found = sorted(name for name in files if name.startswith(folder + "/"))
    return source.choice(found) if found else None


def _document(folder: str, change: Callable[[Any, Random], bool]) -> Alter:
    """A file of a folder, as JSON; a strategy is renamed."""

    def alter(files: Files, source: Random) -> Files | None:
        path = some(files, folder, source)
        document = None if path is None else json.loads(files[path])
        if path is None or not change(document, source):
            return None
        data = json.dumps(document).encode()
        return renamed(files, path, data) if folder == "strategies" else {**files, path: data}

    return alter


def _strategy(change: Callable[[dict[str, Any], Random], bool]) -> Alter:
    def inside(document: Any, source: Random) -> bool:
        return bool(document["nodes"]) and change(document["nodes"], source)

    return _document("strategies", inside)


def _redirect(nodes: dict[str, Any], source: Random) -> bool:
    node = nodes[source.choice([k for k, v in nodes.items() if v["trans"]] or ["0"])]
    if not node["trans"] or len(nodes) < 2:
        return False
    at = source.randrange(len(node["trans"]))
    node["trans"][at] = (node["trans"][at] + source.randrange(1, len(nodes))) % len(nodes)
    return True


def _redirect_to_a_twin(nodes: dict[str, Any], source: Random) -> bool:
    """Break liveness only: lead to a node of the same values that pursues another goal."""
    states: dict[tuple[int, ...], list[int]] = {}
    for number, node in nodes.items():
        states.setdefault(tuple(node["state"]), []).append(int(number))
    edges = [
        (number, at, twin)
        for number, node in nodes.items()
        for at, target in enumerate(node["trans"])
        for twin in states[tuple(nodes[str(target)]["state"])]
        if twin != target
    ]
    if not edges:
        return False
    number, at, twin = source.choice(edges)
    nodes[number]["trans"][at] = twin
    return True


def _stay_for_ever(nodes: dict[str, Any], source: Random) -> bool:
    """Break liveness only: a node leads to itself instead of to its successor."""
    number = source.choice(sorted(nodes))
    node = nodes[number]
    if int(number) in node["trans"] or len(node["trans"]) != 1:
        return False
    node["trans"] = [int(number)]
    return True


def _drop_edge(nodes: dict[str, Any], source: Random) -> bool:
    node = nodes[source.choice(sorted(nodes))]
    return bool(node["trans"]) and node["trans"].pop() is not None


def _flip_bit(nodes: dict[str, Any], source: Random) -> bool:
    node = nodes[source.choice(sorted(nodes))]
    node["state"][source.randrange(len(node["state"]))] ^= 1
    return True


def _measure(document: dict[str, Any], source: Random) -> bool:
    part = source.choice(document["measures"]) if document["measures"] else None
    if part is None or not part["n"]:
        return False
    node = source.randrange(len(part["n"]))
    if source.random() < 0.7:
        part["n"][node] = max(0, part["n"][node] + source.choice([-2, -1, 1, 2, 50]))
    else:
        part["a"][node] = source.choice([None, 0, 1, 7])
    return True


def _header(change: Callable[[dict[str, Any], Random], bool]) -> Alter:
    def alter(files: Files, source: Random) -> Files | None:
        lines = lines_of(files)
        return with_lines(files, lines) if change(lines[0]["scenario"], source) else None

    return alter


def _map_bit(scenario: dict[str, Any], source: Random) -> bool:
    grid = scenario["map"]["grid"]
    row, col = source.randrange(len(grid)), source.randrange(len(grid[0]))
    cell = "." if grid[row][col] == "#" else "#"
    grid[row] = grid[row][:col] + cell + grid[row][col + 1 :]
    return True


def _mobility(scenario: dict[str, Any], source: Random) -> bool:
    robot = scenario["robots"][source.choice(sorted(scenario["robots"]))]
    robot["mobility"] = "free" if robot["mobility"] == "heading" else "heading"
    return True


def _target(scenario: dict[str, Any], source: Random) -> bool:
    robot = scenario["robots"][source.choice(sorted(scenario["robots"]))]
    ((kind, value),) = robot["objective"].items()
    if not isinstance(value, list):
        return False
    cells = "".join(scenario["map"]["grid"])
    free = [r for r, cell in enumerate(cells) if cell == "." and r not in value]
    value[source.randrange(len(value))] = source.choice(free)
    return kind != "ltl"


def _start(scenario: dict[str, Any], source: Random) -> bool:
    robot = scenario["robots"][source.choice(sorted(scenario["robots"]))]
    robot["start"] += source.choice([1, -1, 13])
    return True


def _line(kind: str, change: Callable[[dict[str, Any], Random], bool]) -> Alter:
    def alter(files: Files, source: Random) -> Files | None:
        lines = lines_of(files)
        found = [line for line in lines if line["type"] == kind]
        if not found or not change(source.choice(found), source):
            return None
        return with_lines(files, lines)

    return alter


def _elsewhere(line: dict[str, Any], source: Random) -> bool:
    line["to"] += source.choice([1, -1, 2, 13, -13])
    return True


def _set(key: str, values: list[Any]) -> Callable[[dict[str, Any], Random], bool]:
    def change(line: dict[str, Any], source: Random) -> bool:
        value = source.choice(values)
        before, line[key] = line.get(key), value
        return bool(before != value)

    return change


def _begins_elsewhere(files: Files, source: Random) -> Files | None:
    """In a node that differs in more than in what was observed, or which goal comes first."""
    lines = lines_of(files)
    found = [line for line in lines if line["type"] == "synthesis" and line.get("strategy")]
    if not found:
        return None
    line = source.choice(found)
    strategy = json.loads(files[f"strategies/{line['strategy']}.json"])
    before, line["node"] = line["node"], line["node"] + source.choice([1, 2, 3])
    one, other = (strategy["nodes"].get(str(node)) for node in (before, line["node"]))
    bits = enumerate(strategy["variables"])
    kept = [k for k, name in bits if name != "wait"]
    if other is not None and all(one["state"][k] == other["state"][k] for k in kept):
        return None
    return with_lines(files, lines)


def _exchange_strategies(files: Files, source: Random) -> Files | None:
    """A strategy that is correct for another task."""
    lines = lines_of(files)
    found = [line for line in lines if line["type"] == "synthesis" and line["strategy"]]
    if len({line["strategy"] for line in found}) < 2:
        return None
    one, other = source.sample(found, 2)
    if one["strategy"] == other["strategy"]:
        return None
    one["strategy"] = other["strategy"]
    return with_lines(files, lines)


def _counter_edge(document: dict[str, Any], source: Random) -> bool:
    nodes = document["automaton"]["nodes"] if "automaton" in document else {}
    return bool(nodes) and source.choice([_redirect, _drop_edge, _flip_bit])(nodes, source)


def _counter_input(document: dict[str, Any], source: Random) -> bool:
    if "automaton" not in document:
        return False
    inputs = source.choice([document["start"], *document["chosen"]])
    if inputs:
        inputs[source.randrange(len(inputs))] ^= 1
    else:
        inputs.append(0)
    return True


MEASURE = "the strategy is the same, and the altered measure still falls"
ELSEWHERE = "another answer of the strategy that is correct as well, and not one of this run"
STAYS = "where it waits it meets each of its goals"


def _literal(line: dict[str, Any], source: Random) -> bool:
    del source
    weak = line.get("form") == "alternation"
    line["form"] = "literal"
    return weak


def _exchanged_ways(line: dict[str, Any], source: Random) -> bool:
    ways = line["robots"]
    one, other = source.sample(sorted(ways), 2)
    ways[one], ways[other] = ways[other], ways[one]
    return bool(ways[one] != ways[other])


def _no_proof(line: dict[str, Any], source: Random) -> bool:
    del source
    return line.pop("proof", None) is not None


MUTANTS = (
    Mutant("a stronger form in the trace", _line("synthesis", _literal)),
    Mutant("a transition", _strategy(_redirect), ELSEWHERE),
    Mutant("a transition to a twin", _strategy(_redirect_to_a_twin), ELSEWHERE),
    Mutant("waiting for ever", _strategy(_stay_for_ever), STAYS),
    Mutant("a transition gone", _strategy(_drop_edge)),
    Mutant("a bit of a state", _strategy(_flip_bit), ELSEWHERE),
    Mutant("a measure", _document("proofs", _measure), MEASURE),
    Mutant("a bit of the map", _header(_map_bit)),
    Mutant("a mobility", _header(_mobility)),
    Mutant("a target", _header(_target)),
    Mutant("a start", _header(_start)),
    Mutant("a move", _line("move", _elsewhere)),
    Mutant("where a strategy begins", _begins_elsewhere),
    Mutant("what a strategy is for", _line("synthesis", _set("objective", [{"hold": 29}]))),
    Mutant("an outcome", _line("outcome", _set("outcome", ["completed"]))),
    Mutant("no proof", _line("outcome", _no_proof)),
    Mutant("whose way it is", _line("plan", _exchanged_ways)),
    Mutant("an exchanged strategy", _exchange_strategies),
    Mutant("an edge of a counterstrategy", _document("proofs", _counter_edge), ELSEWHERE),
    Mutant("an input of a counterstrategy", _document("proofs", _counter_input), ELSEWHERE),
)
