"""Specifications with automata and measures; what the verified checker says of them, and what the
verifier and `check.py` say; and ways to alter them (the graph alone: ``oracle.automata``)."""

import copy
import json
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from random import Random
from typing import Any

from children import ran
from safenav.errors import SafenavError
from safenav.judge.bundle.strategies import check_measure
from safenav.spec.specification import Section, read_specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, NoMeasureError
from safenav.verify.verification import first_failure, measures, obligations


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
