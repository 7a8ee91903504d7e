"""The verified checker: proved without an axiom; it accepts what is true, as the verifier does.

Among the tests the campaigns are short; SAFENAV_PROOF=2000 tries as many others.
"""

import json
import os
import re
import shutil
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

import warm
from children import ran
from once import ROOT, SCENARIOS, made_once
from oracle.automata import DAMAGES, damaged, to_json
from oracle.duel import Duel
from oracle.game import build_game, extract, solve
from oracle.generator import random_specification
from oracle.text import inputs_first, to_plain
from proof.cases import KINDS, Case, case_of, with_measures
from safenav.errors import SafenavError
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario
from safenav.spec.compile import compile_task
from safenav.spec.specification import read_specification
from safenav.synthesis.program import find_own_binary
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import NoMeasureError

SOURCE = ROOT / "proof"
COUNT = int(os.environ.get("SAFENAV_PROOF", "60"))
"""How many random games, and how many mutants."""
TOOLS = ("coqc", "coq_makefile", "ocamlfind", "make")
THEOREMS = ("establish_sound", "refute_sound", "parse_print")
REALIZABLE = ("case_study_1", "case_study_3_beliefs", "hello", "warehouse", "beam")
UNREALIZABLE = ("crossing_a_target", "contradictory_objective", "forbidden_way", "impossible_start")


@pytest.fixture(scope="module")
def built() -> Path:
    """The folder in which the verified checker is built, as `make proof` does it; that of `make
    proof` if it is of the present sources."""
    made = ROOT / "build" / "proof"
    sources = [path.stat().st_mtime for path in SOURCE.rglob("*") if path.is_file()]
    if (program := made / "safenav-proved").is_file() and max(sources) < program.stat().st_mtime:
        return made
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {missing[0]}: apt install --no-install-recommends coq ocaml ocaml-findlib")

    def make(folder: Path) -> None:
        ran(["make", "-C", SOURCE, f"OUT={folder}"], check=True)

    return made_once("verified_checker", make)


@pytest.fixture
def program(built: Path) -> Path:
    return built / "safenav-proved"


@pytest.fixture
def duel(tmp_path: Path) -> Duel:
    """The own build of slugs, for counterstrategies."""
    own = find_own_binary()
    assert own is not None
    return Duel(own.path, tmp_path)


def of_scenario(name: str) -> list[Case]:
    """The specifications at the start of a shipped scenario with their automata."""
    plan = load_scenario(SCENARIOS / f"{name}.yaml")
    synthesizer, found = default_synthesizer(plan), []
    for robot, answer in first_results(plan, synthesizer).items():
        spec, result = compile_task(answer.task, plan.map), answer.result
        if not answer.realizable:
            result = synthesizer.counterstrategy(spec)
        assert result.strategy_json is not None
        text, document = spec.to_structuredslugs(), json.loads(result.strategy_json)
        found.append(case_of(f"{name} {robot}", text, document, counter=not answer.realizable))
    return found


def test_the_proof_sources_contain_no_axiom_and_no_admitted_lemma() -> None:
    words = re.compile(r"\b(Admitted|admit|Axiom|Parameter|Conjecture|give_up|Abort)\b")
    files = {file.name: file.read_text() for file in (SOURCE / "theories").glob("*.v")}
    assert files and not [name for name, text in files.items() if words.search(text)]


@pytest.mark.slow
def test_the_theorems_rest_on_no_axiom(built: Path, tmp_path: Path) -> None:
    asks = "".join(f"Print Assumptions {name}.\n" for name in THEOREMS)
    file = tmp_path / "Assumed.v"
    file.write_text(f"From Proved Require Import Certificates Print.\n{asks}")
    done = ran(["coqc", "-Q", built / "theories", "Proved", file], check=True)
    assert done.stdout.splitlines() == ["Closed under the global context"] * len(THEOREMS)


@pytest.mark.parametrize("name", [*REALIZABLE, *(f"unrealizable/{name}" for name in UNREALIZABLE)])
def test_specifications_of_shipped_scenarios_are_proved(
    name: str, program: Path, tmp_path: Path
) -> None:
    cases = of_scenario(name)
    assert any(case.counter for case in cases) is (name not in REALIZABLE)
    refused = {case.name: case.proved(program, tmp_path) for case in cases}
    assert not any(refused.values()), refused


def counted(program: Path, case: Case, folder: Path) -> tuple[int, dict[str, int]]:
    """The edges of a strategy, and what OCaml's runtime counts while it is checked: words that are
    allocated and the most that are held. They are the same on every machine."""
    edges = sum(len(node["trans"]) for node in case.document["nodes"].values())
    counting = {**os.environ, "OCAMLRUNPARAM": "v=0x400"}
    done = ran([program, *case.files(folder)], env=counting, check=True)
    told = (line.split(": ") for line in done.stderr.splitlines())
    return edges, {name: int(float(words)) for name, words in told if words.isdecimal()}


def test_a_large_strategy_takes_little_work_and_memory(program: Path, tmp_path: Path) -> None:
    """The work of an edge hardly depends on the size of its strategy."""
    few, many = (counted(program, lift_of(floors), tmp_path) for floors in (600, 2_400))
    assert many[0] > 3 * few[0] > 5_000
    one, other = (found["minor_words"] / edges for edges, found in (few, many))
    assert other < 2 * one < 4000
    assert many[1]["top_heap_words"] * 8 < 100_000_000


def random_cases(seed: int, duel: Duel) -> list[Case]:
    """A random game: its strategy, sound and damaged, or its counterstrategy."""
    source = Random(seed)
    drawn = random_specification(Random(seed), integers=seed % 3 == 0, bits=3 + seed % 4)
    specification = inputs_first(drawn)
    solution, (text, _) = solve(build_game(specification)), to_plain(specification, source)
    realizable = solution.realizable()
    sound = extract(solution) if realizable else duel.counterstrategy(specification)
    automata = [("sound", sound)]
    if realizable and sound.edges:
        automata += [(each.__name__, damaged(sound, each, [0], source)) for each in DAMAGES]
    cases = []
    for damage, automaton in automata:
        name, document = f"{seed} {damage}", json.loads(to_json(automaton))
        if realizable:
            cases.append(with_measures(name, text, document))
            continue
        # else nothing is to be shown, and nothing to be judged
        with suppress(SafenavError, NoMeasureError, LookupError):
            cases.append(case_of(name, text, document, counter=True))
    return cases


NOTHING, MORE = "the initial inputs", "no node to start from"
"""Where no initial input is possible, the verified checker refuses: nothing is shown. The verifier
demands more of the nodes to start from."""


def disagreements(program: Path, cases: list[Case], folder: Path) -> list[tuple[str, str, str]]:
    """The cases on which both checkers disagree, each with both reasons."""
    both = ((case.name, case.checked, case.proved(program, folder)) for case in cases)
    wrong = [(name, mine, other) for name, mine, other in both if bool(mine) != bool(other)]
    return [one for one in wrong if not one[1].startswith(MORE) and one[2] != NOTHING]


def test_random_games_are_judged_as_by_the_verifier(
    program: Path, duel: Duel, tmp_path: Path
) -> None:
    cases = [case for seed in range(COUNT) for case in random_cases(seed, duel)]
    assert disagreements(program, cases, tmp_path) == []
    refused = [case for case in cases if case.checked]
    assert len(cases) > len(refused) > len(cases) / 4
    assert {case.counter for case in cases} == {False, True}


LIFT = """\
[INPUT]
request
[OUTPUT]
floor:0...3
[SYS_INIT]
floor = 0
[SYS_TRANS]
floor' <= floor + 1 & floor <= floor' + 1
[ENV_LIVENESS]
request'
[SYS_LIVENESS]
request & floor = 3
floor = 0
"""


def lift_of(floors: int) -> Case:
    """A lift, in whose strategy nodes differ in their goal alone."""
    text = LIFT.replace("0...3", f"0...{floors - 1}").replace("= 3", f"= {floors - 1}")
    lift = Synthesizer().synthesize(read_specification(text, "lift", "lift")).strategy_json
    assert lift is not None
    return case_of("lift", text, json.loads(lift))


def test_mutants_of_real_strategies_are_judged_as_by_the_verifier(
    program: Path, tmp_path: Path
) -> None:
    """Each kind is refused at least once, but for those that only ask for less."""
    every = [*(case for name in REALIZABLE for case in of_scenario(name)), lift_of(4)]
    real = [case for case in every if len(case.document["nodes"]) <= 300]
    cases, refused = list[Case](), set[str]()
    for seed in range(max(COUNT, 2 * len(KINDS))):
        kind = sorted(KINDS)[seed % len(KINDS)]
        source = Random(f"{kind} {seed}")
        some = (KINDS[kind](case, source) for case in source.sample(real, len(real)))
        altered = next(filter(None, some))
        cases.append(replace(altered, name=f"{kind}: {altered.name}"))
        refused |= {kind} if altered.checked else set()
    assert disagreements(program, cases, tmp_path) == []
    assert len(refused) >= 9, sorted(refused)


@pytest.mark.parametrize("strategy", ["lift", "lift.counterstrategy"])
def test_synth_writes_the_measures_that_the_program_reads(
    strategy: str, program: Path, tmp_path: Path
) -> None:
    lost = strategy != "lift"
    text = LIFT.replace("[ENV_LIVENESS]\nrequest'\n", "") if lost else LIFT
    (spec := tmp_path / "lift.structuredslugs").write_text(text)
    measures = tmp_path / "measures.json"
    made = warm.safenav("synth", spec, "-o", tmp_path, "--measures", measures)
    assert made.returncode == lost, made.stderr
    done = ran([program, spec, tmp_path / f"{strategy}.json", measures], check=True)
    what = "no strategy realizes" if lost else "the strategy realizes"
    assert done.stdout == f"proved: {what} the specification\n"


def test_the_program_refuses_unreadable_files(program: Path, tmp_path: Path) -> None:
    case = of_scenario("hello")[0]
    assert replace(case, text="[INPUT").proved(program, tmp_path) == (
        "the text of the specification is not understood"
    )
    few = {"of": "strategy", "measures": [{"n": [], "a": []}]}
    assert replace(case, measures=few).proved(program, tmp_path) == "too few ranks"
    assert ran([program, tmp_path / "none", tmp_path, tmp_path]).returncode == 2
    assert ran([program]).returncode == 2
