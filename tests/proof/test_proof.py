"""The verified checker: proved without an axiom; it accepts what is true, as the verifier and
`check.py` do, of specifications with automata and measures, and of mutants of them.

Among the tests the campaigns are short; SAFENAV_PROOF=2000 tries as many others.
"""

import copy
import json
import os
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from random import Random
from typing import Any

import pytest

import warm
from children import ran
from once import ROOT, SCENARIOS, made_once
from oracle.automata import DAMAGES, damaged, to_json
from oracle.duel import Duel
from oracle.game import build_game, extract, solve
from oracle.generator import random_specification
from oracle.text import inputs_first, to_plain
from safenav import (
    SafenavError,
    Strategy,
    Synthesizer,
    compile_task,
    first_failure,
    load_scenario,
    read_specification,
)
from safenav.judge.bundle.strategies import check_measure
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.spec.specification import Section
from safenav.synthesis.program import find_own_binary
from safenav.verify.automaton import Automaton, NoMeasureError
from safenav.verify.verification import measures, obligations


@dataclass(frozen=True)
class Case:
    """A specification, and a strategy or counterstrategy with its measures."""

    name: str
    text: str
    document: Any
    measures: Any

    @property
    def counter(self) -> bool:
        return bool(self.measures["of"] == "counterstrategy")

    @cached_property
    def checked(self) -> str:
        """Why the verifier refuses the automaton, or check.py its measures; or ''."""
        try:
            spec = read_specification(self.text, "file", "robot")
            strategy = Strategy.parse(json.dumps(self.document).encode(), spec)
            if (failure := first_failure(spec, strategy, self.counter)) is not None:
                return failure
            every = range(len(strategy.states))
            begin = strategy.initial(True) if self.counter else every
            automaton = Automaton(spec, strategy, begin)
            wanted = obligations(automaton, self.counter)
            for (*_, met, excuses), each in zip(wanted, self.measures["measures"], strict=True):
                goal, allowed = [bool(one) for one in met], [[*e] for e in excuses]
                check_measure(automaton.edges.ends, "a goal", goal, allowed, each)
        except Exception as reason:  # as check.py does: a file is not as documented
            return str(reason) or repr(reason)
        return ""

    def files(self, folder: Path) -> list[Path]:
        """Write the arguments of the verified checker."""
        named = {
            "specification": self.text,
            "automaton": json.dumps(self.document),
            "measures": json.dumps(self.measures),
        }
        for name, data in named.items():
            (folder / name).write_bytes(data.encode())
        return [folder / name for name in named]

    def proved(self, program: Path, folder: Path) -> str:
        """The verified checker's reason for refusing it, or ''."""
        done = ran([program, *self.files(folder)])
        verdict, _, reason = done.stdout.strip().partition(": ")
        assert (done.returncode, verdict) in ((0, "proved"), (1, "refused")), done.stderr
        return reason if done.returncode else ""


def case_of(name: str, text: str, document: Any, *, counter: bool = False) -> Case:
    """Add the measures. Raises NoMeasureError or SafenavError if there are none."""
    spec, data = read_specification(text, "file", "robot"), json.dumps(document).encode()
    return Case(name, text, document, measures(spec, Strategy.parse(data, spec), counter))


def with_measures(name: str, text: str, document: Any) -> Case:
    """Add the best measures; if there are none, add measures that prove nothing."""
    with suppress(SafenavError, NoMeasureError, LookupError):
        return case_of(name, text, document)
    count, goals = len(document["nodes"]), 0
    with suppress(SafenavError):
        spec = read_specification(text, "file", "robot")
        goals = sum(each.section is Section.SYS_LIVENESS for each in spec.constraints)
    flat = [{"n": [0] * count, "a": [None] * count}] * goals
    return Case(name, text, document, {"of": "strategy", "measures": flat})


Change = Callable[[Case, Random], Case | None]
"""An altered case; None if the case has no such part."""


def _measures(change: Callable[[list[Any], int, Random], object]) -> Change:
    def alter(case: Case, source: Random) -> Case | None:
        count, own = len(case.document["nodes"]), copy.deepcopy(case.measures["measures"])
        if case.counter or not own or not count:
            return None
        change(own, source.randrange(count), source)
        return Case(case.name, case.text, case.document, {"of": "strategy", "measures": own})

    return alter


def _number(own: list[Any], node: int, source: Random) -> None:
    source.choice(own)["n"][node] += source.choice([-2, -1, 1, 2, 50])


def _excuse(own: list[Any], node: int, source: Random) -> None:
    source.choice(own)["a"][node] = source.choice([None, 0, 1, 7])


Formulas = dict[str, list[str]]
"""The lines of each section of a specification that are formulas or variables."""


def _text(change: Callable[[Formulas, Random], object]) -> Change:
    """``change``: raises LookupError if there is no such section or formula."""

    def alter(case: Case, source: Random) -> Case | None:
        sections: Formulas = {}
        for line in case.text.split("\n"):
            if line.startswith("["):
                own = sections.setdefault(line, [])
            elif line and not line.startswith("#"):
                own.append(line)
        with suppress(LookupError):
            change(sections, source)
            text = "\n".join(line for name in sections for line in (name, *sections[name]))
            return with_measures(case.name, f"{text}\n", case.document)
        return None

    return alter


def _more(section: str, *formulas: str) -> Change:
    return _text(lambda each, source: each[f"[{section}]"].insert(0, source.choice(formulas)))


def _fewer(section: str) -> Change:
    name = f"[{section}]"
    return _text(lambda each, source: each[name].remove(source.choice(each[name])))


def _replaced(
    sections: Formulas, source: Random, pattern: str, instead: Callable[[str], str]
) -> None:
    """Replace one match of a pattern in the whole text."""
    found = [
        (own, k, match)
        for own in sections.values()
        for k, line in enumerate(own)
        for match in re.finditer(pattern, line)
    ]
    own, k, match = source.choice(found)
    own[k] = f"{own[k][: match.start()]}{instead(match[0])}{own[k][match.end() :]}"


OTHER = {"&": "|", "|": "&", "->": "<->", "<->": "->", "=": "!=", "!=": "="}


def _operator(sections: Formulas, source: Random) -> None:
    _replaced(sections, source, r"(?<= )(&|\||->|<->|=|!=)(?= )", OTHER.__getitem__)


def _range(sections: Formulas, source: Random) -> None:
    step = source.choice([-1, 1])
    _replaced(sections, source, r"(?<=\.\.\.)\d+", lambda most: str(int(most) + step))


KINDS: dict[str, Change] = {
    "a number": _measures(_number),
    "an excuse": _measures(_excuse),
    "a measure fewer": _measures(lambda own, *_: own.pop()),
    "an assumption more": _more("ENV_TRANS", "FALSE"),
    "an assumption fewer": _fewer("ENV_TRANS"),
    "an assumption that fails": _more("ENV_LIVENESS", "FALSE"),
    "a guarantee more": _more("SYS_TRANS", "region' = region", "FALSE", "region' != region"),
    "a guarantee fewer": _fewer("SYS_TRANS"),
    "a goal more": _more("SYS_LIVENESS", "region' = 0", "region' = region", "TRUE"),
    "a goal fewer": _fewer("SYS_LIVENESS"),
    "another beginning": _more("SYS_INIT", "FALSE", "region = 0"),
    "no beginning": _more("ENV_INIT", "FALSE"),
    "an operator": _text(_operator),
    "a range": _text(_range),
    # An assumption that an editor shows as a part of a comment.
    "a separator": _more("ENV_TRANS", *(f"# others{c}FALSE" for c in "\r\v\f\x1c\x85\u2028")),
}


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
