"""Forged bundles: an honest one in which one thing is changed, with proofs as good as a forger can
get them and checksums that fit.

What the checker accepts must be harmless: its run to the oracle of traces; each strategy steps to
neighbours on allowed regions, reaches each target in every cycle, and satisfies the specification
of its task unless that is forged; no negative is new. ``SAFENAV_FUZZ=500`` makes as many."""

import hashlib
import json
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import cycle
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import networkx

from certify.making import TEXTS, Files, files_of, lines_of, rewrite, shipped, with_lines
from drawn import tried
from judge.oracle import BESIDE, Facts
from judge.test_forgeries import FORGERIES, free
from safenav import (
    ResourceLimitError,
    Strategy,
    Synthesizer,
    check_bundle,
    first_failure,
    read_specification,
)
from safenav.certify.bundle import bundle_of_run
from support.damage import Line, live
from support.missions import mission

SHIPPED = (
    *(*TEXTS, "unrealizable/forbidden_way", "hello", "corridor_swap", "two_digits"),
    *("case_study_1", "case_study_1_beliefs", "case_study_3"),
)
FAMILIES = ("mixed", "labs", "apart", "apart_needs", "tracked", "formulas", "spoken", "traps")
RULES, NEGATIVE = ("avoid", "always", "form"), ("unrealizable", "never", "lost", "outcome")

Change = Callable[[Any, Random], object]
"""Changes a document, or the lines of a trace; False if there is nothing to change."""


def a_run(lines: list[Line], chance: Random) -> bool:
    """Change what happened, as the forgeries of traces do."""
    told = not live(lines) and len(lines) > 9
    return told and chance.choice([*FORGERIES.values()])(lines, chance)


def a_task(lines: list[Line], chance: Random) -> bool:
    """Change what a synthesis is made for, or its strategy."""
    stated = [x for x in lines if x["type"] == "synthesis"]
    if not stated:
        return False
    line, other, where = *chance.choices(stated, k=2), chance.choice(free(lines))
    rest = {k: v for k, v in line["objective"].items() if k not in RULES}
    fewer = {k: v[:-1] if isinstance(v, list) and len(v) > 1 else v for k, v in rest.items()}
    changes: list[Line] = [{"objective": rest}, {"objective": fewer}, {"form": "alternation"}]
    changes += [{"knowledge": {}, "beliefs": {}}, {"closed": [[where, "obstacles.x"]]}]
    changes += [{"verdict": "unrealizable"}, {"strategy": other.get("strategy")}]
    changes += [{key: other[key]} for key in chance.choices([*other], k=5)]
    change, spec = json.dumps(chance.choice(changes)), line["spec"]
    for each in stated:
        each |= json.loads(change) if each["spec"] == spec else {}
    return True


def a_node(change: Callable[[Line, int, Random], object], document: Line, chance: Random) -> bool:
    """Change a node that has transitions, of an automaton of this many nodes."""
    nodes = (document.get("automaton") or document).get("nodes", {}).values()
    some = [node for node in nodes if node["trans"]]
    return bool(some) and change(chance.choice(some), len(nodes), chance) is not False


def redirected(node: Line, count: int, chance: Random) -> bool:
    at, further = chance.randrange(len(node["trans"])), chance.randrange(count)
    node["trans"][at] = (node["trans"][at] + further) % count
    return further > 0


def shortened(node: Line, *_: object) -> None:
    node["trans"].pop()


def doubled(node: Line, *_: object) -> None:
    node["trans"] += node["trans"][:1]


def flipped(node: Line, _: int, chance: Random) -> None:
    node["state"][chance.randrange(len(node["state"]))] ^= 1


def one_of_these(node: Line, count: int, chance: Random) -> object:
    return chance.choice([redirected, shortened, flipped])(node, count, chance)


def a_measure(document: Line, chance: Random) -> bool:
    part = chance.choice(document["measures"]) if document["measures"] else None
    if part is None or not part["n"]:
        return False
    node = chance.randrange(len(part["n"]))
    if chance.random() < 0.7:
        part["n"][node] = max(0, part["n"][node] + chance.choice([-2, -1, 1, 2, 50]))
    else:
        part["a"][node] = chance.choice([None, 0, 1, 7])
    return True


def no_measure(document: Line, chance: Random) -> None:
    """One fewer, or a page in place of a proof."""
    kept = document["measures"] and chance.random() < 0.5
    document["measures"].pop() if kept else document.clear()


def an_input(document: Line, chance: Random) -> bool:
    if "automaton" not in document:
        return False
    inputs = chance.choice([document["start"], *document["chosen"]])
    if inputs:
        inputs[chance.randrange(len(inputs))] ^= 1
    else:
        inputs.append(0)
    return True


KINDS: dict[str, tuple[str, Change]] = {
    "a run": ("trace", a_run),
    "a task": ("trace", a_task),
    "a transition": ("strategies/", partial(a_node, redirected)),
    "a transition gone": ("strategies/", partial(a_node, shortened)),
    "a transition twice": ("strategies/", partial(a_node, doubled)),
    "a bit of a state": ("strategies/", partial(a_node, flipped)),
    "a measure": ("proofs/", a_measure),
    "no measure": ("proofs/", no_measure),
    "an edge of a counterstrategy": ("proofs/", partial(a_node, one_of_these)),
    "an input of a counterstrategy": ("proofs/", an_input),
}


def altered(files: Files, kind: str, chance: Random) -> Files | None:
    """Forged files whose names fit; None if there is nothing to change."""
    folder, change = KINDS[kind]
    if folder == "trace":
        applies = change(lines := lines_of(files), chance) is not False
        return with_lines(files, lines) if applies and lines != lines_of(files) else None
    path = chance.choice(sorted(name for name in files if name.startswith(folder)) or [""])
    document = json.loads(files[path]) if path else None
    if document is None or change(document, chance) is False:
        return None
    data = json.dumps(document).encode()
    if folder == "proofs/":
        return files | {path: data}
    old, new = Path(path).stem, hashlib.sha256(data).hexdigest()
    trace = files["trace.jsonl"].replace(old.encode(), new.encode())
    return files | {path.replace(old, new): data, "trace.jsonl": trace}


def astray(document: Line, line: Line, shut: set[int], cols: int) -> set[str]:
    """The harms of a strategy, of which the nodes that it reaches are left. ``shut``: walls and
    avoided regions."""
    bits = [k for k, name in enumerate(document["variables"]) if name.startswith("region@")]
    least, first = int(document["variables"][bits[0]].split(".")[1]), line["node"]
    graph = networkx.DiGraph({int(k): node["trans"] for k, node in document["nodes"].items()})
    graph = graph.subgraph({first, *networkx.descendants(graph, first)})
    nodes = document["nodes"] = {k: document["nodes"][str(k)] for k in graph}
    at = {k: least + sum(nodes[k]["state"][b] << i for i, b in enumerate(bits)) for k in nodes}
    found = {f"it enters {at[k]}" for k in at if at[k] in shut and k != first}
    found |= {
        f"node {k} has one answer twice" for k in at if len(graph[k]) < len(nodes[k]["trans"])
    }
    for one, other in graph.edges:
        (row, col), (row2, col2) = divmod(at[one], cols), divmod(at[other], cols)
        if (row2 - row, col2 - col) not in ((0, 0), *BESIDE):
            found.add(f"it jumps from {at[one]} to {at[other]}")
    ((kind, goals),) = ((k, v) for k, v in line["objective"].items() if k not in RULES)
    goals = [goals] if kind == "hold" else goals[-1:] if kind == "once" else goals
    for goal in goals if kind != "ltl" else ():
        away = {k for k in at if at[k] not in (goal if isinstance(goal, list) else [goal])}
        if not networkx.is_directed_acyclic_graph(graph.subgraph(away)):
            found.add(f"it may never reach {goal}")
    return found


def harms(files: Files, claims: list[Line], true: Files, told: list[Line]) -> set[str]:
    """What is wrong with files that are accepted with these claims, beside honest ones."""
    lines, before, cache = lines_of(files), lines_of(true), Synthesizer().cache
    found = {x["text"] for x in claims if x["kind"] in NEGATIVE} - {x["text"] for x in told}
    found |= set() if live(lines) else {*Facts(lines).harms()} - {*Facts(before).harms()}
    scenario, tasks = lines[0]["scenario"], {task_of(x): x.get("strategy") for x in before}
    own = {each["name"]: each["objective"] for each in scenario["robots"]}
    kept = {x["evidence"][0][1] for x in claims if x["kind"] == "keeps"}
    for k, line in enumerate(lines, 1):
        own |= {line["robot"]: line["objective"]} if line["type"] == "objective" else {}
        if k in kept:
            document = json.loads(files[f"strategies/{line['strategy']}.json"])
            mine, its = own[line["robot"]], line["objective"]
            rules = {k for k in RULES[:2] if {*mine.get(k, ())} != {*its.get(k, ())}}
            found |= {f"{line['robot']} is free of its rules {rules}"} if rules else set()
            shut = {*scenario["map"]["walls"], *mine.get("avoid", ())}
            found |= astray(document, line, shut, scenario["map"]["cols"])
            if (right := tasks.get(task_of(line))) is not None:
                whole = json.loads(true[f"strategies/{right}.json"])["nodes"]
                document["nodes"] = whole | {str(n): x for n, x in document["nodes"].items()}
                spec = read_specification(cache.load_text(line["spec"]) or "", robot=line["robot"])
                strategy = Strategy.parse(json.dumps(document).encode(), spec)
                found |= {*filter(None, [first_failure(spec, strategy, False)])}
    return found


def task_of(line: Line) -> str:
    return json.dumps({key: line[key] for key in line if key not in ("strategy", "node")})


def honest(bundle: Path) -> Files:
    """The files that a forger has; the scenario's own would give each lie about it away."""
    return {path: data for path, data in files_of(bundle).items() if path[:7] != "source/"}


def forged(kind: str, seed: int) -> set[str] | None:
    """The harms of a bundle with a forgery of a kind, perhaps of a random mission; None if it is
    refused."""
    chance = Random(f"{kind} {seed}")
    others = (shipped(each) for each in cycle(chance.sample(SHIPPED, len(SHIPPED))))
    with TemporaryDirectory() as name:
        folder, bundle = Path(name), next(others)

        def made(number: int) -> Path:
            data = mission(chance.choice(FAMILIES), number) | {"coordination": "resynthesis"}
            bundle_of_run(json.dumps(data), folder / "mission.yaml", folder / "true")
            return folder / "true"

        if chance.random() < 0.5:
            with suppress(ResourceLimitError):  # a strategy may be too large for the checker
                bundle = tried(made, seed)
        while (wrong := altered(true := honest(bundle), kind, chance)) is None:
            bundle = next(others)
        prove = not KINDS[kind][0].startswith("proofs/")
        found = check_bundle(rewrite(wrong, folder / "forged", prove=prove))
        if not found.accepted:
            return None
        told = check_bundle(bundle).claims
        return harms(honest(folder / "forged"), [*found.claims], true, [*told])
