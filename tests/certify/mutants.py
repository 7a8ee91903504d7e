"""Bundles altered in one place with all checksums repaired, as a forger would do.

A mutant gets the files of a bundle and a random source; it returns None if it can alter nothing.
``harmless`` says why a bundle may still prove its claims after such a change.
"""

import hashlib
import json
import re
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
    """With another trace; scenario.json follows its header."""
    text = "".join(json.dumps(line) + "\n" for line in lines)
    scenario = json.dumps(lines[0]["scenario"]).encode()
    return {**files, "trace.jsonl": text.encode(), "scenario.json": scenario}


def renamed(files: Files, path: str, data: bytes) -> Files:
    """With another text or strategy: its name, the trace and the measures follow."""
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


def _measure(document: list[dict[str, Any]], source: Random) -> bool:
    part = source.choice(document)
    node = source.randrange(len(part["n"]))
    if source.random() < 0.7:
        part["n"][node] = max(0, part["n"][node] + source.choice([-2, -1, 1, 2, 50]))
    else:
        part["a"][node] = source.choice([None, 0, 1, 7])
    return True


def _some_measure(files: Files, source: Random) -> Files | None:
    return _document(source.choice(["measures", "rules"]), _measure)(files, source)


def _text(change: Callable[[list[str], Random], list[str] | None]) -> Alter:
    def alter(files: Files, source: Random) -> Files | None:
        path = some(files, "specs", source)
        assert path is not None
        lines = change(files[path].decode().splitlines(), source)
        return None if lines is None else renamed(files, path, ("\n".join(lines) + "\n").encode())

    return alter


def _section(lines: list[str], name: str) -> list[int]:
    """The numbers of a section's formulas."""
    inside, found = False, []
    for number, line in enumerate(lines):
        if line.startswith("["):
            inside = line == f"[{name}]"
        elif inside and line and not line.startswith("#"):
            found.append(number)
    return found


def _another_assumption(lines: list[str], source: Random) -> list[str] | None:
    inputs = [line for number in _section(lines, "INPUT") for line in [lines[number]]]
    if not inputs:
        return None
    name = source.choice(inputs)
    formula = f"{name.partition(':')[0]}' = 14" if ":" in name else f"!{name}'"
    at = lines.index("[ENV_TRANS]") + 1
    return [*lines[:at], formula, *lines[at:]]


def _never_fair(lines: list[str], source: Random) -> list[str] | None:
    del source
    at = lines.index("[ENV_LIVENESS]") + 1
    return [*lines[:at], "FALSE", *lines[at:]]


def _another_guarantee(lines: list[str], source: Random) -> list[str] | None:
    at = lines.index("[SYS_TRANS]") + 1
    return [
        *lines[:at],
        source.choice(["region' = region", "FALSE", "region' != region"]),
        *lines[at:],
    ]


def _weaker(lines: list[str], source: Random) -> list[str] | None:
    number = source.choice(_section(lines, "SYS_TRANS"))
    return lines[:number] + lines[number + 1 :]


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


def _drop_line(*kinds: str) -> Alter:
    def alter(files: Files, source: Random) -> Files | None:
        lines = lines_of(files)
        found = [k for k, line in enumerate(lines) if line["type"] in kinds]
        if not found:
            return None
        gone = source.choice(found)
        return with_lines(files, lines[:gone] + lines[gone + 1 :])

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
    kept = [k for k, name in bits if name != "wait" and not name.startswith("busy_")]
    if other is not None and all(one["state"][k] == other["state"][k] for k in kept):
        return None
    return with_lines(files, lines)


def _exchange_strategies(files: Files, source: Random) -> Files | None:
    """A strategy that is correct for another specification, with its own measures."""
    lines = lines_of(files)
    found = [line for line in lines if line["type"] == "synthesis" and line["strategy"]]
    if len({line["strategy"] for line in found}) < 2:
        return None
    one, other = source.sample(found, 2)
    if one["strategy"] == other["strategy"]:
        return None
    before, one["strategy"] = one["strategy"], other["strategy"]
    files = with_lines(files, lines)
    own = f"measures/{one['spec']}-{before}.json"
    files[f"measures/{one['spec']}-{one['strategy']}.json"] = files[own]
    return files


def _weaker_with_strategy(files: Files, source: Random) -> Files | None:
    """Text and measures lack the last goal: a strategy that never meets it realizes the rest."""
    path = some(files, "specs", source)
    assert path is not None
    lines = files[path].decode().splitlines()
    goals = _section(lines, "SYS_LIVENESS")
    name = path.rpartition("/")[2].partition(".")[0]
    measures = [m for m in files if m.startswith(f"measures/{name}")]
    if not goals or not measures:
        return None
    text = "\n".join(lines[: goals[-1]] + lines[goals[-1] + 1 :]) + "\n"
    files = dict(files)
    for measure in measures:
        files[measure] = json.dumps(json.loads(files[measure])[:-1]).encode()
    stuck = _strategy(_stay_for_ever)(renamed(files, path, text.encode()), source)
    return stuck


def _counter_edge(document: dict[str, Any], source: Random) -> bool:
    nodes = document["automaton"]["nodes"]
    return bool(nodes) and source.choice([_redirect, _drop_edge, _flip_bit])(nodes, source)


def _counter_input(document: dict[str, Any], source: Random) -> bool:
    inputs = source.choice([document["start"], *document["chosen"]])
    if inputs:
        inputs[source.randrange(len(inputs))] ^= 1
    return bool(inputs)


UNUSED = "the strategy and its measures prove the same text's claims; the altered part is not used"
COUNTER = "the counterstrategy keeps the new assumption as well"
MEASURE = "the strategy is the same, and the altered measure still falls"
WEAKER = "the strategy is the same and is validated against the scenario itself, not by this line"
ELSEWHERE = "another answer of the strategy that is correct as well, and not one of this run"

STAYS = "where it waits it meets each of its goals"

LOOSE, STRICT = (
    "; it may cross a target out of turn",
    ", without crossing a target out of turn",
)


def _stronger_form(files: Files, source: Random) -> Files | None:
    """The page states that nothing was crossed where that was not proven."""
    del source
    page = files["index.html"].replace(LOOSE.encode(), STRICT.encode())
    return None if page == files["index.html"] else {**files, "index.html": page}


def _forged_sentence(files: Files, source: Random) -> Files | None:
    """A claim on the page loses the condition under which it was proven."""
    text = files["index.html"].decode()
    listed = list(re.finditer(r"(<li id=[^>]*>.*?), (whatever|if) [^<]*<br>", text))
    if not listed:
        return None
    one = source.choice(listed)
    page = f"{text[: one.start()]}{one[1]}.<br>{text[one.end() :]}"
    return {**files, "index.html": page.encode()}


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
    Mutant("a stronger form on the page", _stronger_form),
    Mutant("a stronger form in the trace", _line("synthesis", _literal)),
    Mutant("a forged sentence on the page", _forged_sentence),
    Mutant("a transition", _strategy(_redirect), ELSEWHERE),
    Mutant("a transition to a twin", _strategy(_redirect_to_a_twin), ELSEWHERE),
    Mutant("waiting for ever", _strategy(_stay_for_ever), STAYS),
    Mutant("a transition gone", _strategy(_drop_edge)),
    Mutant("a bit of a state", _strategy(_flip_bit), ELSEWHERE),
    Mutant("a measure", _some_measure, MEASURE),
    Mutant("an assumption more", _text(_another_assumption), COUNTER),
    Mutant("an assumption that is false", _text(_never_fair), WEAKER),
    Mutant("a guarantee more", _text(_another_guarantee), UNUSED),
    Mutant("a guarantee fewer", _text(_weaker), WEAKER),
    Mutant("a bit of the map", _header(_map_bit)),
    Mutant("a mobility", _header(_mobility)),
    Mutant("a target", _header(_target)),
    Mutant("a start", _header(_start)),
    Mutant("a move", _line("move", _elsewhere)),
    Mutant("a stack event gone", _drop_line("push", "pop")),
    Mutant("where a strategy begins", _begins_elsewhere),
    Mutant("what a strategy is for", _line("synthesis", _set("objective", [{"hold": 29}]))),
    Mutant("an outcome", _line("outcome", _set("outcome", ["completed"]))),
    Mutant("no proof", _line("outcome", _no_proof)),
    Mutant("whose way it is", _line("plan", _exchanged_ways)),
    Mutant("an exchanged strategy", _exchange_strategies),
    Mutant("a weaker text with its strategy", _weaker_with_strategy),
    Mutant(
        "an edge of a counterstrategy", _document("counterstrategies", _counter_edge), ELSEWHERE
    ),
    Mutant(
        "an input of a counterstrategy", _document("counterstrategies", _counter_input), ELSEWHERE
    ),
)
