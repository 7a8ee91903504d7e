"""Bundles that were tampered with in one place, with all checksums and proofs repaired."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from certify.making import Files, files_of, rewrite, shipped
from certify.mutants import lines_of, renamed, with_lines
from lies.forging import ends, first
from safenav.certify.check import check_bundle

Line = dict[str, Any]
Tamper = Callable[[list[Line]], None]


def nth(lines: list[Line], kind: str, **fields: object) -> Line:
    return lines[first(lines, kind, **fields)]


def wall_left_out(lines: list[Line]) -> None:
    """The map gets a wall where a strategy goes."""
    grid = lines[0]["scenario"]["map"]["grid"]
    grid[3] = grid[3][:9] + "#" + grid[3][10:]


def other_node(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["node"] = 5


def other_start(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["region"] = 48


def wrong_memory(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["memory"] = {"scout": 1}


def other_objective(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["objective"] = {"visit": [76, 22]}


def forgotten_rule(lines: list[Line]) -> None:
    lines[0]["scenario"]["robots"]["digit"]["objective"]["avoid"] = [14]


def false_wall(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["closed"] = [[24, "obstacles.door@47"]]


def robot_as_wall(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["closed"] = [[58, "robots.digit"]]


def forbidden_pose(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["forbidden"] = [[35, None]]


def weaker_form(lines: list[Line]) -> None:
    lines[0]["scenario"]["robots"]["quad"]["objective"]["form"] = "literal"
    for line in lines:
        if line["type"] == "synthesis" and line["robot"] == "quad":
            line["form"] = "alternation"


def no_strategy(lines: list[Line]) -> None:
    for line in lines:
        if line["type"] == "synthesis" and line["robot"] == "quad":
            line["strategy"] = None


def no_synthesis(lines: list[Line]) -> None:
    del lines[first(lines, "synthesis", robot="quad")]


def another_way(lines: list[Line]) -> None:
    """The robot goes around, by legal steps."""
    at = first(lines, "move", robot="quad", tick=2)
    lines[at]["to"] = 61
    ends(lines, at + 1, "interrupted")


def staying_step(lines: list[Line]) -> None:
    nth(lines, "move", robot="quad", tick=2)["by"] = "stay"


def step_without_plan(lines: list[Line]) -> None:
    nth(lines, "move", robot="quad", tick=2)["by"] = "plan"


def backs_up_for_fun(lines: list[Line]) -> None:
    at = first(lines, "move", robot="quad", tick=2)
    lines[at] |= {"to": 61, "by": "backtrack"}
    ends(lines, at + 1, "interrupted")


def unresolved(lines: list[Line]) -> None:
    del lines[first(lines, "resolved", obstacle="door@47")]


def incapable(lines: list[Line]) -> None:
    lines[0]["scenario"]["robots"]["digit"]["capabilities"] = []


def one_round_more(lines: list[Line]) -> None:
    lines[0]["scenario"]["until"]["rounds"] = 3


def observed_rivals(lines: list[Line]) -> None:
    """Robots that never meet in the strategies' eyes are said to be rivals."""
    robots = lines[0]["scenario"]["robots"]
    robots["quad"]["conflicts"], robots["digit"]["conflicts"] = ["digit"], ["quad"]


def exclusion(lines: list[Line]) -> None:
    zone = {"robots": ["quad", "digit"], "regions": [*range(14, 77)]}
    lines[0]["scenario"]["never_together"] = [zone]


def names_an_input(lines: list[Line]) -> None:
    nth(lines, "synthesis", robot="quad")["places"] = [22, 76]


def second_header(lines: list[Line]) -> None:
    lines.insert(1, lines[0])


CHAIN = [
    *(wall_left_out, other_node, other_start, wrong_memory, other_objective, forgotten_rule),
    *(false_wall, robot_as_wall, forbidden_pose, weaker_form, no_strategy, no_synthesis),
    *(another_way, staying_step, step_without_plan, backs_up_for_fun, unresolved, incapable),
    *(one_round_more, observed_rivals, exclusion, names_an_input),
    second_header,
]


def no_orders(lines: list[Line]) -> None:
    nth(lines, "plan")["orders"] = []


def circle(lines: list[Line]) -> None:
    orders = nth(lines, "plan")["orders"]
    orders += [[then, j, one, i] for one, i, then, j in orders]


def leap(lines: list[Line]) -> None:
    for way in nth(lines, "plan")["robots"].values():
        del way[1]


def begins_elsewhere(lines: list[Line]) -> None:
    for way in nth(lines, "plan")["robots"].values():
        del way[0]


def another_plan(lines: list[Line]) -> None:
    """A plan in which every robot stays: no robot follows it."""
    plan = nth(lines, "plan")
    plan["robots"] = {name: way[:1] for name, way in plan["robots"].items()}
    plan["orders"] = []


def ended_plan(lines: list[Line]) -> None:
    at = first(lines, "plan")
    lines.insert(at + 1, {"type": "plan_end", "tick": lines[at]["tick"], "reason": "changed"})


SWAP = [no_orders, circle, leap, begins_elsewhere, another_plan, ended_plan]


@pytest.mark.parametrize(
    ("name", "tamper"),
    [*(("case_study_3", each) for each in CHAIN), *(("corridor_swap", each) for each in SWAP)],
    ids=lambda each: getattr(each, "__name__", each),
)
def test_tampered_bundles_are_refused(name: str, tamper: Tamper, tmp_path: Path) -> None:
    bundle = shipped(name)
    lines = lines_of(files_of(bundle))
    before = json.dumps(lines)
    tamper(lines)
    assert json.dumps(lines) != before
    files = with_lines(files_of(bundle), lines)
    files = {path: data for path, data in files.items() if not path.startswith("source/")}
    verdict = check_bundle(rewrite(bundle, files, tmp_path / "bundle"))
    assert not verdict.accepted
    assert verdict.reason and not verdict.claims


@pytest.mark.parametrize("field", [("limits", "ticks"), ("seed",)])
def test_a_header_without_a_field_is_refused(field: tuple[str, ...], tmp_path: Path) -> None:
    """Also one that the checker does not read, and one with the same default in the source."""
    bundle = shipped("case_study_1")
    lines = lines_of(files_of(bundle))
    inner = lines[0]["scenario"]
    for key in field[:-1]:
        inner = inner[key]
    del inner[field[-1]]
    files = with_lines(files_of(bundle), lines)
    verdict = check_bundle(rewrite(bundle, files, tmp_path / "bundle"))
    assert not verdict.accepted
    assert field[-1] in verdict.reason


def of_files(change: Callable[[Any], object], folder: str) -> Callable[[Files], Files]:
    def alter(files: Files) -> Files:
        path = min(name for name in files if name.startswith(folder))
        document = json.loads(files[path])
        change(document)
        data = json.dumps(document).encode()
        return renamed(files, path, data) if folder == "strategies/" else files | {path: data}

    return alter


def flat(proof: Any) -> Any:
    for measure in proof.get("measures", ()):
        measure["n"] = [0] * len(measure["n"])
    return proof


FILES: dict[str, Callable[[Files], Files]] = {
    "a strategy that stays": of_files(
        lambda d: [node.update(trans=[int(k)]) for k, node in d["nodes"].items()], "strategies/"
    ),
    "a strategy without answers": of_files(
        lambda d: [node.update(trans=[]) for node in d["nodes"].values()], "strategies/"
    ),
    "a name of a bit": of_files(lambda d: d["variables"].__setitem__(0, "x; y"), "strategies/"),
    "a flat measure": lambda files: {
        path: json.dumps(flat(json.loads(data))).encode() if path.startswith("proofs/") else data
        for path, data in files.items()
    },
    "a negative measure": of_files(
        lambda d: [m.update(n=[n - 99 for n in m["n"]]) for m in d["measures"]], "proofs/"
    ),
    "no measures": of_files(lambda d: d.update(measures=[]), "proofs/"),
    "a page in place of a proof": of_files(lambda d: d.clear(), "proofs/"),
    "a file more": lambda files: files | {"strategies/x.json": b"{}"},
    "another motion": lambda files: files | {"motion.jsonl": b'{"trace": "0"}\n'},
    "a repeated key": lambda files: (
        files | {"trace.jsonl": files["trace.jsonl"].replace(b'{"type"', b'{"tick":9,"type"', 3)}
    ),
}


@pytest.mark.parametrize("what", FILES)
def test_a_file_that_was_tampered_with_is_refused(what: str, tmp_path: Path) -> None:
    bundle = shipped("case_study_3")
    files = FILES[what](files_of(bundle))
    assert files != files_of(bundle)
    prove = what.startswith("a strategy")
    assert not check_bundle(rewrite(bundle, files, tmp_path / "bundle", prove=prove)).accepted
