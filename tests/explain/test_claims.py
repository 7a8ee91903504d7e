"""What ``safenav explain`` and ``synth`` claim about random specifications, and about a robot of a
random scenario, is checked by brute force. ``SAFENAV_FUZZ=60`` tries that many."""

import dataclasses
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from random import Random
from typing import Any

import networkx
import pytest
from msgspec.structs import replace

from explain import games
from explain.conftest import invoke
from oracle.automata import check_strategy, from_json
from oracle.game import build_game
from oracle.specification import Atom, Constant, Specification, apply
from oracle.text import to_plain
from safenav import (
    Heading,
    Pose,
    RegionMap,
    Scenario,
    Strategy,
    Synthesizer,
    compile_task,
    explain_team,
    first_failure,
    read_specification,
)

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0"))
SEEDS = range(COUNT or 24)


def one_that(source: Random, wanted: Callable[[Specification], bool]) -> Specification:
    while not wanted(spec := games.drawn(source)):
        pass
    return spec


@pytest.mark.parametrize("seed", SEEDS)
def test_every_claim_about_a_specification_is_true(seed: int, tmp_path: Path) -> None:
    source = Random(seed)
    spec = one_that(source, lambda one: not games.realizable(one))
    text, places = to_plain(spec, source)
    file = tmp_path / "s.structuredslugs"
    file.write_text(text)
    status, said, _ = invoke("explain", file, "--json")
    print(text, said, sep="\n")
    assert status == 1
    data = json.loads(said)["unrealizable"]

    def place(constraint: dict[str, Any]) -> games.Line:
        return places[int(constraint["origin"]["item"].rpartition(":")[2])]

    core = data["core"]
    judge = games.Judge(spec, [[*map(place, member["constraints"])] for member in core["members"]])
    assert judge.fails() and core["minimal"] and judge.minimal()
    omitted = [judge.suffices_to_omit(k) for k in range(len(judge.core))]
    assert core["decisive"] == all(omitted)
    assert len(core["vain"]) == omitted.count(False)
    together = games.realizable_together(judge.part)
    assert core["together"] == together
    said, whole = invoke("explain", file)[1], games.realizable_together(spec)
    assert ("the rest is realizable:" in said) == all(omitted)
    assert ("(realizable if the environment cooperated)" in said) == whole
    assert ("(these alone would be realizable if" in said) == (together and not whole)
    play = data["play"]
    goal = play["goal"] and place(play["goal"])[1]
    judge.check_play(play["ending"], play["walk"], play["cycle"], dict(play["pressure"]), goal)
    for assumption in data["assumptions"]:
        negated, name = re.fullmatch(r"(!?)(\w+)'", assumption).groups()  # type: ignore[union-attr]
        fair = apply("!", Atom(name, True)) if negated else Atom(name, True)
        more = games.with_lines(spec, [*games.lines_of(spec), ("env_liveness", fair)])
        assert games.realizable(more)  # and not because the assumptions can be broken
        assert not games.realizable(dataclasses.replace(more, sys_liveness=(Constant(False),)))


VACUOUS = "the system may win by making assumptions fail: "
DEAD_END = "a state can occur in which the assumptions allow no move"
UNFAIR = "a state can occur from which these assumptions cannot all be met"
NO_BEGINNING = "no initial state satisfies the assumptions, so nothing is guaranteed"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_win_is_vacuous_iff_the_environment_cannot_keep_its_assumptions(
    seed: int, tmp_path: Path
) -> None:
    """Each warning shows a play from a start to where that happens."""
    source = Random(10_000 + seed)
    spec = one_that(source, games.realizable)
    text, _ = to_plain(spec, source)
    (file := tmp_path / "s.structuredslugs").write_text(text)
    status, _, warned = invoke("synth", file, "-o", tmp_path)
    print(text, warned)
    assert status == 0
    printed = (tmp_path / "s.json").read_text()
    automaton, game = from_json(spec, printed), build_game(spec)
    assert not check_strategy(game, automaton)
    found = dict[str, list[str]]()
    for warning in warned.split("warning: ")[1:]:
        cause, *play = warning.removeprefix(VACUOUS).rstrip().splitlines()
        found[cause] = [line.strip() for line in play if line.startswith("    ")]
    if not game.env_init.any():
        assert [*found] == [NO_BEGINNING]
        return
    strategy = Strategy.parse(printed.encode(), read_specification(text))

    def words(nodes: Iterable[int]) -> set[str]:
        return {said(spec, strategy.values(node)) for node in nodes}

    graph = networkx.DiGraph(automaton.edges)
    graph.add_nodes_from(range(len(automaton.nodes)))
    starts = strategy.initial()
    reached = {*starts}.union(*(networkx.descendants(graph, start) for start in starts))
    stuck = {node for node in reached if not graph.adj[node]}
    alive = set(stuck)
    for part in networkx.strongly_connected_components(graph):
        steps = [
            (automaton.nodes[a].state, automaton.nodes[b].state)
            for a, b in graph.subgraph(part).edges
        ]
        if steps and all(any(game.has(fair, *step) for step in steps) for fair in game.assumptions):
            alive |= part
    unfair = {node for node in reached if not alive & {node, *networkx.descendants(graph, node)}}
    for cause, nodes in ((DEAD_END, stuck), (UNFAIR, unfair)):
        assert (cause in found) == bool(nodes)
        assert not nodes or {found[cause][0]} <= words(starts)
        assert not nodes or {found[cause][-1]} <= words(nodes)


def said(spec: Specification, values: Mapping[str, int]) -> str:
    """The values of a state as safenav prints them: outputs, then inputs."""
    ordered = sorted(spec.variables, key=lambda variable: variable.owner == "input")
    bits = ((v.name, "" if values[v.name] else "!", v.range is None) for v in ordered)
    each = (f"{no}{name}" if bit else f"{name}={values[name]}" for name, no, bit in bits)
    return " ".join(each) or "(no variables)"


def unrealizable(source: Random) -> tuple[Scenario, Any]:
    while True:
        scenario = games.drawn_scenario(source)
        for found in explain_team(scenario, Synthesizer(verifier=first_failure)):
            print(found)
            return scenario, found


@pytest.mark.parametrize("seed", range(COUNT or 8))
def test_every_claim_about_a_robot_is_true(seed: int, played: Callable[[], None]) -> None:
    scenario, found = unrealizable(Random(seed))
    played()
    core = found.core
    spec = games.as_oracle(compile_task(found.task, scenario.map))
    assert not games.realizable(spec)
    judge = games.Judge(
        spec, [[*map(games.line_of, member.constraints)] for member in core.members]
    )
    assert judge.fails() and core.minimal and judge.minimal()
    assert core.together == games.realizable_together(judge.part)
    assert core.all_together == games.realizable_together(spec)
    assert core.decisive == (not core.vain)
    for member in core.members:
        suffices = suffices_to_omit(member, found, scenario.map)
        assert suffices in (None, member not in core.vain), member
    check_cause(found, judge)
    assert found.play is not None
    check_play(found.play, judge, found, scenario)
    for repair in found.repairs:  # the verifier accepts a strategy
        synthesizer = Synthesizer(verifier=first_failure)
        assert not [*explain_team(repair.scenario, synthesizer)], repair.change


def suffices_to_omit(member: Any, found: Any, world: RegionMap) -> bool | None:
    """Whether the whole is realizable without a member of the core; None for rules of the mobility,
    which the core has with the edge of the map."""
    if member.origin.item == "map":
        opened = replace(world, walls=world.walls - {*member.regions})
        return games.realizable(games.as_oracle(compile_task(found.task, opened)))
    if member.origin.item.endswith("mobility"):
        return None
    whole = compile_task(found.task, world)
    return games.realizable(games.as_oracle(whole.without(member.constraints)))


def check_cause(found: Any, judge: games.Judge) -> None:
    """Check the sentence that names the cause."""
    sections = {section for section, _ in judge.core}
    items = {member.origin.item for member in found.core.members}
    moving = {"map", "robots.r.mobility"}
    match found.cause:
        case "cornered":
            assert found.core.together and "sys_liveness" not in sections
        case "kept_away":
            assert found.core.together and "sys_liveness" in sections
        case "impossible_start":
            assert sections == {"sys_init"}
        case "contradiction":
            assert not found.core.together and not items & moving
        case "conflict":
            raise AssertionError("nothing was limited")
        case _:
            assert not games.realizable_together(judge.spec)


def check_play(play: Any, judge: games.Judge, found: Any, scenario: Scenario) -> None:
    robot, world = found.task.robot, scenario.map
    if play.ending == "confined":
        reached, queue = {found.task.pose}, [found.task.pose]
        for pose in queue:
            fresh = [p for p in games.moves(robot, pose, world) if p not in reached]
            reached.update(fresh)
            queue += fresh
        literal = found.cause == "crossing"
        regions = {pose.region for pose in reached}
        assert (
            found.diagnosis.confined <= regions if literal else found.diagnosis.confined == regions
        )
        assert literal or any(not target & regions for target in found.task.targets)
        return
    goal = play.goal and games.line_of(play.goal)[1]
    judge.check_play(play.ending.value, play.walk, play.cycle, dict(play.pressure), goal)
    for dilemma in play.dilemmas:
        last = play.walk[-1]
        heading = Heading(last["heading"]) if "heading" in last else None
        possible = games.moves(robot, Pose(last["region"], heading), world)
        assert Pose(dilemma.region, dilemma.heading) in possible
        assert games.line_of(dilemma.broken) in judge.core
