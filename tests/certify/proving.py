"""The verified checker for tests, with many requests in one call."""

import json
import os
import shutil
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from children import ran
from once import made_once
from safenav.certify.checker import check_strategies as checker
from safenav.certify.evidence import strategy_measures
from safenav.certify.measures import NoMeasureError

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "safenav" / "certify" / "proof"
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
    """A specification and a strategy (with its measures) or a counterstrategy (with them in it)."""

    name: str
    text: str
    document: Any
    measures: Any = None

    @property
    def counter(self) -> bool:
        return self.measures is None

    def checked(self) -> str:
        """Why check.py refuses it, or ''."""
        try:
            if self.counter:
                graph = checker.Strategy(self.document["automaton"], self.text)
                measures = self.document["measures"]
                checker.check_counterstrategy(graph, graph, self.document, measures)
            else:
                graph = checker.Strategy(self.document, self.text)
                checker.check_realizes(graph, self.measures)
        except Exception as reason:  # as check.py does: a file is not as documented
            return str(reason) or repr(reason)
        return ""


def with_measures(name: str, text: str, document: Any) -> Case:
    """Add the best measures; if there are none, add measures that prove nothing."""
    measures: Any = None
    with suppress(checker.RefusedError, NoMeasureError, LookupError):
        measures = strategy_measures(text, json.dumps(document).encode())
    if measures is None:
        count, goals = len(document["nodes"]), 0
        with suppress(checker.RefusedError):
            goals = len(checker.Specification(text).goals)
        measures = [{"n": [0] * count, "a": [None] * count}] * goals
    return Case(name, text, document, measures)


def proved(program: Path, cases: list[Case], folder: Path) -> dict[int, str]:
    """Return for each case the verified checker's reason for refusing it, or ''."""
    for part in ("specs", "strategies", "measures", "counterstrategies"):
        (folder / part).mkdir(parents=True)
    for k, case in enumerate(cases):
        (folder / "specs" / f"{k}.structuredslugs").write_bytes(case.text.encode())
        if case.counter:
            (folder / "counterstrategies" / f"{k}.json").write_text(json.dumps(case.document))
        else:
            (folder / "strategies" / f"{k}.json").write_text(json.dumps(case.document))
            (folder / "measures" / f"{k}-{k}.json").write_text(json.dumps(case.measures))
    done = ran([program, folder])
    said = (each for each in json.loads(done.stdout) if each["kind"] != "alive")
    verdicts = {int(each["spec"]): each["reason"] for each in said}
    assert verdicts.keys() == {*range(len(cases))}
    return verdicts


def disagreements(program: Path, cases: list[Case], folder: Path) -> list[tuple[Case, str, str]]:
    """Return the cases on which both checkers disagree, each with both reasons."""
    verdicts = proved(program, cases, folder)
    both = [(case, case.checked(), verdicts[k]) for k, case in enumerate(cases)]
    return [(case, mine, other) for case, mine, other in both if bool(mine) != bool(other)]
