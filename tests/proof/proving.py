"""The verified checker for tests, and what the verifier and `check.py` say of the same files."""

import json
import os
import shutil
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest

from children import ran
from once import made_once
from safenav.errors import SafenavError
from safenav.judge.bundle.strategies import check_measure
from safenav.spec.specification import Section, read_specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, NoMeasureError
from safenav.verify.verification import first_failure, measures, obligations

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "proof"
TOOLS = ("coqc", "coq_makefile", "ocamlfind", "make")
COUNT = int(os.environ.get("SAFENAV_PROOF", "60"))
"""How many random games, and how many mutants; 2000 in a campaign."""


def built() -> Path:
    """The folder in which the verified checker is built, as `make proof` does it; that of `make
    proof` if it is of the present sources."""
    made = ROOT / "build" / "proof"
    sources = [path for path in SOURCE.rglob("*") if path.is_file()]
    if (program := made / "safenav-proved").is_file() and all(
        path.stat().st_mtime < program.stat().st_mtime for path in sources
    ):
        return made
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"no {missing[0]}: apt install --no-install-recommends coq ocaml ocaml-findlib")

    def make(folder: Path) -> None:
        command = ["make", "-C", SOURCE, f"OUT={folder}"]
        subprocess.run(command, check=True, capture_output=True)

    return made_once("verified_checker", make)


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

    def proved(self, program: Path, folder: Path) -> str:
        """The verified checker's reason for refusing it, or ''."""
        folder.mkdir(exist_ok=True)
        files = folder / "specification", folder / "automaton", folder / "measures"
        files[0].write_bytes(self.text.encode())
        files[1].write_text(json.dumps(self.document))
        files[2].write_text(json.dumps(self.measures))
        done = ran([program, *files])
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


NOTHING, MORE = "the initial inputs", "no node to start from"
"""Where no initial input is possible, the verified checker refuses: nothing is shown. The verifier
demands more of the nodes to start from."""


def disagreements(program: Path, cases: list[Case], folder: Path) -> list[tuple[str, str, str]]:
    """The cases on which both checkers disagree, each with both reasons."""
    both = ((case.name, case.checked, case.proved(program, folder)) for case in cases)
    wrong = [(name, mine, other) for name, mine, other in both if bool(mine) != bool(other)]
    return [one for one in wrong if not one[1].startswith(MORE) and one[2] != NOTHING]
