"""The verified checker, and specifications with automata and measures as `safenav synth` writes
them."""

import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

import warm
from children import ran
from once import ROOT, SCENARIOS, made_once

SOURCE = ROOT / "proof"
TOOLS = ("coqc", "coq_makefile", "ocamlfind", "make")
Files = list[Path]
"""A specification, a strategy or counterstrategy, and its measures."""
PAGE = (ROOT / "docs" / "specifications.md").read_text()
LIFT = PAGE.partition('title="lift.structuredslugs"\n')[2].partition("```")[0]


@pytest.fixture(scope="session")
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


@pytest.fixture(scope="session")
def program(built: Path) -> Path:
    return built / "safenav-proved"


@pytest.fixture
def proved(program: Path) -> Callable[[Files], str]:
    """Gives the verified checker's reason for refusing files, or ''."""

    def reason(files: Files) -> str:
        done = ran([program, *files])
        verdict, _, why = done.stdout.strip().partition(": ")
        assert (done.returncode, verdict) in ((0, "proved"), (1, "refused")), done.stderr
        return why if done.returncode else ""

    return reason


def synthesized(specification: Path) -> Files:
    """The winner's automaton and its measures, beside the specification."""
    folder, name = specification.parent, specification.stem
    measures = folder / f"{name}.measures"
    made = warm.safenav("synth", specification, "-o", folder, "--measures", measures)
    assert made.returncode in (0, 1), made.stderr
    return [specification, next(folder.glob(f"{name}*.json")), measures]


@cache
def of_scenario(name: str) -> list[Files]:
    """The specifications at the start of a shipped scenario with their automata."""

    def make(folder: Path) -> None:
        made = warm.safenav("synth", SCENARIOS / f"{name}.yaml", "-o", folder)
        assert made.returncode in (0, 1), made.stderr
        for file in folder.glob("*.structuredslugs"):
            synthesized(file)

    folder = made_once(f"automata of {Path(name).name}", make)
    return [
        [file, next(folder.glob(f"{file.stem}*.json")), file.with_suffix(".measures")]
        for file in sorted(folder.glob("*.structuredslugs"))
    ]


def lift_of(floors: int, folder: Path) -> Files:
    """A lift, in whose strategy nodes differ in their goal alone."""
    text = LIFT.replace("0...3", f"0...{floors - 1}").replace("= 3", f"= {floors - 1}")
    (file := folder / f"lift_{floors}.structuredslugs").write_text(text)
    return synthesized(file)
