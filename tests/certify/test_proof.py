"""The verified checker: proved without an axiom, it accepts what is true and agrees with check.py.

Among the tests the campaigns are short; SAFENAV_PROOF=2000 tries as many others.
"""

import json
import os
import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest

import warm
from certify.making import Files, bundle_at, files_of, rewrite, shipped
from certify.mutants import lines_of, with_lines
from certify.proving import COUNT, SOURCE, Case, built, disagreements, with_measures
from certify.strategy_mutants import KINDS
from certify.test_bundles import COMPLETED, UNREALIZABLE
from certify.test_strategies import random_game, text_of
from children import ran
from oracle import (
    build_game,
    extract,
    is_realizable,
    solve,
    to_json,
)
from oracle.damage import DAMAGES
from oracle.duel import Duel
from runtime.facts import case
from safenav.certify.checker import check_strategies as checker
from safenav.certify.evidence import counter_evidence
from safenav.certify.measures import NoMeasureError
from safenav.certify.proved import CHECKED, PROVED

THEOREMS = (
    "establish_sound",
    "alive_sound",
    "refute_sound",
    "moves_sound",
    "team_sound",
    "answers_sound",
    "parse_print",
)
LARGE = ("team_of_six", "warehouse")
OTHERS = ("beam", "parked_robot", "circuit", "unrealizable/crossing_a_target")


@pytest.fixture(scope="module")
def program() -> Path:
    return built() / "safenav-proved"


def asked(program: Path, bundle: Path) -> list[dict[str, str]]:
    done = ran([program, bundle])
    found: list[dict[str, str]] = json.loads(done.stdout)
    assert done.returncode == any(each["verdict"] == "refused" for each in found)
    return found


def test_the_proof_sources_contain_no_axiom_and_no_admitted_lemma() -> None:
    words = re.compile(r"\b(Admitted|admit|Axiom|Parameter|Conjecture|give_up|Abort)\b")
    for file in (SOURCE / "theories").glob("*.v"):
        assert not words.search(file.read_text()), file


@pytest.mark.slow
@pytest.mark.usefixtures("program")
def test_the_theorems_rest_on_no_axiom(tmp_path: Path) -> None:
    asks = "".join(f"Print Assumptions {name}.\n" for name in THEOREMS)
    file = tmp_path / "Assumed.v"
    file.write_text(f"From Proved Require Import Files Print.\n{asks}")
    command = ["coqc", "-Q", str(built() / "theories"), "Proved", str(file)]
    done = ran(command, check=True)
    assert done.stdout.splitlines() == ["Closed under the global context"] * len(THEOREMS)


@pytest.mark.parametrize(
    "name",
    [*COMPLETED, *UNREALIZABLE, *OTHERS, *(pytest.param(n, marks=pytest.mark.slow) for n in LARGE)],
)
def test_what_shipped_scenarios_claim_is_proved(name: str, program: Path) -> None:
    said = asked(program, shipped(name))
    assert [each for each in said if each["verdict"] != "proved"] == []
    kinds = {each["kind"] for each in said}
    wanted = {"unrealizable"} if "unrealizable" in name else {"realizes", "alive", "answers"}
    assert kinds >= wanted | {"apart"}


def counted(program: Path, bundle: Path, folder: Path) -> tuple[int, dict[str, int]]:
    """The edges of a bundle's strategies, and what OCaml's runtime counts while these are checked:
    words that are allocated and the most that are held. They are the same on every machine."""
    for part in ("specs", "strategies", "measures"):
        shutil.copytree(bundle / part, folder / part)
    nodes = [json.loads(p.read_text())["nodes"] for p in (folder / "strategies").iterdir()]
    edges = sum(len(node["trans"]) for each in nodes for node in each.values())
    environment = {**os.environ, "OCAMLRUNPARAM": "v=0x400"}
    done = ran([program, folder], env=environment)
    assert {each["verdict"] for each in json.loads(done.stdout)} == {"proved"}
    told = (line.split(": ") for line in done.stderr.splitlines())
    return edges, {name: int(float(words)) for name, words in told if words.isdecimal()}


def test_a_large_bundle_takes_little_work_and_memory(program: Path, tmp_path: Path) -> None:
    """The work of an edge hardly depends on the size of its strategy."""
    small = counted(program, shipped("team_of_six"), tmp_path / "small")
    large = counted(program, shipped("warehouse"), tmp_path / "large")
    assert large[0] > 5 * small[0] > 200_000
    one, other = (found["minor_words"] / edges for edges, found in (small, large))
    assert other < 2 * one < 2000
    assert large[1]["top_heap_words"] * 8 < 100_000_000


def random_cases(seed: int, duel: Duel) -> list[Case]:
    """A random game: its strategy or counterstrategy, sound and damaged."""
    source = Random(seed)
    specification = random_game(seed)
    game, text = build_game(specification), text_of(specification, source)
    winning = solve(game).winning
    if is_realizable(game, winning):
        automata = [("sound", extract(solve(game)))]
    else:
        automata = [("sound", duel.counterstrategy(specification))]
    sound = automata[0][1]
    if any(node.successors for node in sound.nodes):
        automata += [(damage.__name__, damage(sound, [0], source)) for damage in DAMAGES]
    cases = []
    for damage, automaton in automata:
        name, document = f"{seed} {damage}", json.loads(to_json(specification, automaton))
        if is_realizable(game, winning):
            cases.append(with_measures(name, text, document))
            continue
        try:
            proof = counter_evidence(text, json.dumps(document).encode())
        except (checker.RefusedError, NoMeasureError, LookupError):
            continue  # nothing to be shown, and nothing to be judged
        cases.append(Case(name, text, {"automaton": document, **proof}))
    return cases


@pytest.mark.usefixtures("program")
def test_random_games_are_judged_as_by_check_py(program: Path, duel: Duel, tmp_path: Path) -> None:
    for begin in range(0, COUNT, 100):
        seeds = range(begin, min(begin + 100, COUNT))
        cases = [case for seed in seeds for case in random_cases(seed, duel)]
        found = disagreements(program, cases, tmp_path / str(begin))
        assert [(case.name, mine, other) for case, mine, other in found] == []


MUTATED = ("case_study_1", "case_study_3", "hello", "corridor_swap", "two_digits", "beam")


def real_cases(name: str) -> list[Case]:
    files = files_of(shipped(name))
    found = []
    for path in sorted(p for p in files if p.startswith("measures/")):
        spec, _, graph = path[len("measures/") : -len(".json")].partition("-")
        text = files[f"specs/{spec}.structuredslugs"].decode()
        document = json.loads(files[f"strategies/{graph}.json"])
        if len(document["nodes"]) <= 300:
            found.append(Case(f"{name} {spec[:8]}", text, document, json.loads(files[path])))
    return found


def test_mutants_of_real_bundles_are_judged_as_by_check_py(program: Path, tmp_path: Path) -> None:
    """Each kind is refused at least once, but for those that only ask for less."""
    real = [case for name in MUTATED for case in real_cases(name)]
    cases: list[Case] = []
    kinds: list[str] = []
    for seed in range(max(COUNT, 2 * len(KINDS))):
        kind = sorted(KINDS)[seed % len(KINDS)]
        source = Random(f"{kind} {seed}")
        altered = next(
            filter(None, (KINDS[kind](c, source) for c in source.sample(real, len(real))))
        )
        cases.append(altered)
        kinds.append(kind)
    found = disagreements(program, cases, tmp_path)
    assert [(kinds[cases.index(case)], mine, other) for case, mine, other in found] == []
    refused = {kind for kind, case in zip(kinds, cases, strict=True) if case.checked()}
    assert len(refused) >= 15, sorted(refused)


def wall(scenario: Any, at: int) -> None:
    rows, columns = scenario["map"]["grid"], len(scenario["map"]["grid"][0])
    row, col = divmod(at, columns)
    rows[row] = rows[row][:col] + "#" + rows[row][col + 1 :]


def altered_map(change: Callable[[Any, Any], None], name: str = "two_digits") -> Files:
    """A bundle whose scenario and first strategy's circumstances are changed."""
    files = files_of(shipped(name))
    lines = lines_of(files)
    change(lines[0]["scenario"], next(line for line in lines if line["type"] == "synthesis"))
    return with_lines(files, lines)


def visited(line: Any) -> int:
    """A region that the robot of a line has to come to."""
    return int(line["objective"]["visit"][0])


def wider(scenario: Any, _line: Any) -> None:
    scenario["map"]["grid"] = [row + "#" for row in scenario["map"]["grid"]]


MAPS: dict[str, Callable[[Any, Any], None]] = {
    "a wall": lambda scenario, line: wall(scenario, visited(line)),
    "a closed region": lambda _, line: line["closed"].append([visited(line), "a door"]),
    "a target": lambda _, line: line["objective"]["visit"].append(0),
    "a mobility": lambda s, line: s["robots"][line["robot"]].update(mobility="heading", layer="x"),
    "a width": wider,
}


@pytest.mark.parametrize("kind", MAPS)
def test_an_altered_map_is_refused(kind: str, program: Path, tmp_path: Path) -> None:
    name = "corridor_swap" if kind == "a mobility" else "two_digits"
    files = altered_map(MAPS[kind], name)
    bundle = rewrite(shipped(name), files, tmp_path / "bundle")
    visits = [each for each in asked(program, bundle) if each["kind"] == "visits"]
    assert "refused" in {each["verdict"] for each in visits}


def test_an_assumption_that_the_world_does_not_keep_is_refused(
    program: Path, tmp_path: Path
) -> None:
    """A strategy that counts on nobody to the north keeps all rules, but not the world's."""
    files = files_of(shipped("two_digits"))
    path = next(p for p in files if p.startswith("measures/"))
    spec, _, graph = path[len("measures/") : -len(".json")].partition("-")
    lines = files[f"specs/{spec}.structuredslugs"].decode().split("\n")
    at = lines.index("[ENV_TRANS]") + 1
    text = "\n".join([*lines[:at], "!busy_north'", *lines[at:]])
    document = json.loads(files[f"strategies/{graph}.json"])
    north = document["variables"].index("busy_north")
    for node in document["nodes"].values():
        node["trans"] = [t for t in node["trans"] if not document["nodes"][str(t)]["state"][north]]
    case = with_measures("", text, document)
    assert case.checked() == ""
    files[f"specs/{spec}.structuredslugs"] = text.encode()
    files[f"strategies/{graph}.json"] = json.dumps(document).encode()
    files[path] = json.dumps(case.measures).encode()
    said = asked(program, rewrite(shipped("two_digits"), files, tmp_path / "bundle"))
    verdicts = {each["kind"]: each for each in said if each["verdict"] != "proved"}
    assert [*verdicts] == ["answers"]
    assert "no answer to something that it can observe" in verdicts["answers"]["reason"]


def test_robots_that_start_in_one_region_are_refused(program: Path, tmp_path: Path) -> None:
    files = files_of(shipped("two_digits"))
    scenario = json.loads(files["scenario.json"])
    left, right = scenario["robots"].values()
    left["start"] = right["start"]
    files["scenario.json"] = json.dumps(scenario).encode()
    said = asked(program, rewrite(shipped("two_digits"), files, tmp_path / "bundle"))
    assert [each["kind"] for each in said if each["verdict"] == "refused"] == ["apart"]


def test_the_verified_checker_names_robots_that_it_does_not_cover(program: Path) -> None:
    said = {
        each["kind"]: each
        for each in asked(program, bundle_at("plan", case("certified/exact_start_of_another")))
    }
    assert said["apart"]["verdict"] == "not covered"
    assert "line 2: a knows positions of others" in said["apart"]["reason"]
    assert "answers" not in said
    assert said["realizes"]["verdict"] == "proved"


def test_the_command_says_what_each_claim_rests_on(
    program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAFENAV_PROVED", str(program))
    scenario = Path(__file__).parents[2] / "scenarios" / "hello.yaml"
    done = warm.safenav("certify", "--proved", scenario, "-o", tmp_path / "bundle.zip")
    assert done.returncode == 0, done.stderr
    done = warm.safenav("check-bundle", "--proved", "--json", tmp_path / "bundle.zip")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    rests = {claim["kind"]: claim["rests_on"] for claim in said["claims"]}
    assert rests["realizes"] == PROVED
    assert rests["moves"] == CHECKED
    assert "proved by a verified checker" in rests["keeps"]
    assert {proof["verdict"] for proof in said["proofs"]} == {"proved"}
    done = warm.safenav("certify", "--proved", scenario, "-o", tmp_path / "bundle")
    page = (tmp_path / "bundle" / "index.html").read_text()
    assert (
        PROVED in page and CHECKED in page and "Robots in conflict never occupy one region" in page
    )
    done = warm.safenav("check-bundle", "--proved", tmp_path / "bundle")
    assert PROVED in done.stdout


def test_a_refusal_of_the_verified_checker_is_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = {"kind": "realizes", "spec": "abc", "strategy": "d"}
    said = json.dumps([names | {"verdict": "refused", "reason": "?"}])
    program = tmp_path / "proved"
    program.write_text(f"#!{sys.executable}\nprint('''{said}''')\n")
    program.chmod(0o755)
    monkeypatch.setenv("SAFENAV_PROVED", str(program))
    done = warm.safenav("check-bundle", "--proved", shipped("hello"))
    assert done.returncode == 1
    assert "the verified checker refuses realizes, abc: ?" in done.stdout


def test_without_the_program_the_command_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAFENAV_PROVED", str(tmp_path / "nothing"))
    done = warm.safenav("check-bundle", "--proved", shipped("hello"))
    assert done.returncode == 2
    assert "gives no answer" in done.stderr
    monkeypatch.delenv("SAFENAV_PROVED")
    monkeypatch.setattr("safenav.certify.proved._BUILT", tmp_path / "nothing")
    monkeypatch.setenv("PATH", str(tmp_path))
    from safenav.certify.proved import find_program

    assert find_program() is None
