"""The verified checker judges as the verifier and `check.py` do: random games with sound and
damaged automata, and mutants of specifications and measures.

Among the tests the campaigns are short; SAFENAV_PROOF=2000 tries as many others.
"""

import copy
import json
import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from random import Random
from typing import Any

from oracle.automata import DAMAGES, damaged, to_json
from oracle.duel import Duel
from oracle.game import build_game, extract, solve
from oracle.generator import random_specification
from oracle.text import inputs_first, to_plain
from proof.conftest import Files, lift_of, of_scenario
from proof.test_proof import REALIZABLE
from safenav import SafenavError, Strategy, Synthesizer, first_failure, read_specification
from safenav.judge.bundle.strategies import check_measure
from safenav.verify.automaton import Automaton, NoMeasureError
from safenav.verify.verification import measures, obligations

COUNT = int(os.environ.get("SAFENAV_PROOF", "60"))
"""How many random games, and how many mutants."""
Proved = Callable[[Files], str]


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

    def files(self, folder: Path) -> Files:
        """Write the arguments of the verified checker."""
        named = {
            "specification": self.text,
            "automaton": json.dumps(self.document),
            "measures": json.dumps(self.measures),
        }
        for name, data in named.items():
            (folder / name).write_bytes(data.encode())
        return [folder / name for name in named]


def case_of(name: str, text: str, document: Any, *, counter: bool = False) -> Case:
    """Add the measures. Raises NoMeasureError or SafenavError if there are none."""
    spec, data = read_specification(text, "file", "robot"), json.dumps(document).encode()
    return Case(name, text, document, measures(spec, Strategy.parse(data, spec), counter))


def read_case(files: Files) -> Case:
    text, automaton, own = (file.read_text() for file in files)
    return Case(files[0].stem, text, json.loads(automaton), json.loads(own))


def with_measures(name: str, text: str, document: Any) -> Case:
    """Add the best measures; if there are none, add measures that prove nothing."""
    with suppress(SafenavError, NoMeasureError, LookupError):
        return case_of(name, text, document)
    count, goals = len(document["nodes"]), 0
    with suppress(SafenavError):
        spec = read_specification(text, "file", "robot")
        goals = sum(each.section == "SYS_LIVENESS" for each in spec.constraints)
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


def _text(pattern: str, instead: Callable[[str, Random], str]) -> Change:
    """Replace one match of a pattern in the text without comments."""

    def alter(case: Case, source: Random) -> Case | None:
        text = re.sub("(?m)^#.*\n", "", case.text)
        if not (found := [*re.finditer(pattern, text)]):
            return None
        match = source.choice(found)
        changed = f"{text[: match.start()]}{instead(match[0], source)}{text[match.end() :]}"
        return with_measures(case.name, changed, case.document)

    return alter


def _more(section: str, *formulas: str) -> Change:
    return _text(rf"\[{section}\]\n", lambda head, source: f"{head}{source.choice(formulas)}\n")


def _fewer(section: str) -> Change:
    def without_one(part: str, source: Random) -> str:
        head, *lines = part.split("\n")
        lines.remove(source.choice(lines))
        return "\n".join([head, *lines])

    return _text(rf"\[{section}\](\n[^\n]+)+", without_one)


OTHER = {"&": "|", "|": "&", "->": "<->", "<->": "->", "=": "!=", "!=": "="}


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
    "an operator": _text(r"(?<= )(&|\||->|<->|=|!=)(?= )", lambda one, _: OTHER[one]),
    "a range": _text(
        r"(?<=\.\.\.)\d+", lambda most, source: str(int(most) + source.choice([-1, 1]))
    ),
    # An assumption that an editor shows as a part of a comment.
    "a separator": _more("ENV_TRANS", *(f"# others{c}FALSE" for c in "\r\v\f\x1c\x85\u2028")),
}


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


MORE = "no node to start from"
"""The verifier demands more of these nodes: that they come first."""


def disagreements(proved: Proved, cases: list[Case], folder: Path) -> list[tuple[str, str, str]]:
    """The cases on which both checkers disagree, each with both reasons."""
    both = ((case.name, case.checked, proved(case.files(folder))) for case in cases)
    wrong = [(name, mine, other) for name, mine, other in both if bool(mine) != bool(other)]
    return [one for one in wrong if not one[1].startswith(MORE)]


def test_the_proved_checker_and_the_verifier_agree_on_random_games(
    proved: Proved, tmp_path: Path
) -> None:
    duel = Duel(Synthesizer().binary, tmp_path)  # for counterstrategies
    cases = [case for seed in range(COUNT) for case in random_cases(seed, duel)]
    assert disagreements(proved, cases, tmp_path) == []
    refused = [case for case in cases if case.checked]
    assert len(cases) > len(refused) > len(cases) / 4
    assert {case.counter for case in cases} == {False, True}


def test_the_proved_checker_and_the_verifier_agree_on_mutants_of_strategies(
    proved: Proved, tmp_path: Path
) -> None:
    """Each kind is refused at least once, but for those that only ask for less."""
    shipped = (files for name in REALIZABLE for files in of_scenario(name))
    every = [read_case(files) for files in (*shipped, lift_of(4, tmp_path))]
    real = [case for case in every if len(case.document["nodes"]) <= 300]
    cases, refused = list[Case](), set[str]()
    for seed in range(max(COUNT, 2 * len(KINDS))):
        kind = sorted(KINDS)[seed % len(KINDS)]
        source = Random(f"{kind} {seed}")
        some = (KINDS[kind](case, source) for case in source.sample(real, len(real)))
        altered = next(filter(None, some))
        cases.append(replace(altered, name=f"{kind}: {altered.name}"))
        refused |= {kind} if altered.checked else set()
    assert disagreements(proved, cases, tmp_path) == []
    assert len(refused) >= 9, sorted(refused)
