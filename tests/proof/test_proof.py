"""The verified checker: proved without an axiom; it accepts what `safenav synth` writes of a
specification, with little work. Random games, and mutants: ``test_agreement``."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import warm
from children import ran
from once import ROOT, beside, from_yaml
from proof.conftest import LIFT, SOURCE, Files, lift_of, of_scenario

THEOREMS = ("establish_sound", "refute_sound", "parse_print")
REALIZABLE = ("case_study_1", "case_study_3_beliefs", "hello", "warehouse", "beam")
UNREALIZABLE = ("crossing_a_target", "contradictory_objective", "forbidden_way", "impossible_start")


def test_the_proof_sources_contain_no_axiom_and_no_admitted_lemma() -> None:
    words = re.compile(r"\b(Admitted|admit|Axiom|Parameter|Conjecture|give_up|Abort)\b")
    files = {file.name: file.read_text() for file in (SOURCE / "theories").glob("*.v")}
    assert files and not [name for name, text in files.items() if words.search(text)]


@pytest.mark.slow
def test_the_theorems_rest_on_no_axiom(built: Path, tmp_path: Path) -> None:
    together = f"Definition theorems := ({', '.join(THEOREMS)})."  # much is common to their proofs
    asks = "From Proved Require Import Certificates Print.", together, "Print Assumptions theorems."
    (file := tmp_path / "Assumed.v").write_text("\n".join(asks))
    done = ran(["coqc", "-Q", built / "theories", "Proved", file], check=True)
    assert done.stdout == "Closed under the global context\n"


@pytest.mark.parametrize("name", [*REALIZABLE, *(f"unrealizable/{name}" for name in UNREALIZABLE)])
def test_strategies_for_shipped_scenarios_are_proved(
    name: str, proved: Callable[[Files], str]
) -> None:
    found = of_scenario(name)
    counter = ["counterstrategy" in automaton.name for _, automaton, _ in found]
    assert any(counter) is (name not in REALIZABLE)
    refused = {files[0].stem: proved(files) for files in found}
    assert refused and not any(refused.values()), refused


def counted(program: Path, files: Files) -> tuple[int, dict[str, int]]:
    """The edges of a strategy, and what OCaml's runtime counts while it is checked: words that are
    allocated and the most that are held. They are the same on every machine."""
    nodes = json.loads(files[1].read_bytes())["nodes"].values()
    counting = {**os.environ, "OCAMLRUNPARAM": "v=0x400"}
    done = ran([program, *files], env=counting, check=True)
    told = (line.split(": ") for line in done.stderr.splitlines())
    counts = {name: int(float(words)) for name, words in told if words.isdecimal()}
    return sum(len(node["trans"]) for node in nodes), counts


def test_checking_a_large_strategy_takes_little_memory(program: Path, tmp_path: Path) -> None:
    """The work of an edge hardly depends on the size of its strategy."""
    few, many = (counted(program, lift_of(floors, tmp_path)) for floors in (400, 1_600))
    assert many[0] > 3 * few[0] > 3_000
    one, other = (found["minor_words"] / edges for edges, found in (few, many))
    assert other < 2 * one < 4000
    assert many[1]["top_heap_words"] * 8 < 70_000_000


@pytest.mark.parametrize("lost", [False, True])
def test_the_documented_commands_prove_the_documented_lift(
    lost: bool, built: Path, tmp_path: Path
) -> None:
    """Word for word; without its assumption no strategy exists."""
    *_, synth, prove = re.findall("(?m)^    (.+)", (ROOT / "docs" / "proof.md").read_text())
    text = LIFT.replace("[ENV_LIVENESS]\nrequest'\n", "") if lost else LIFT
    (tmp_path / "lift.structuredslugs").write_text(text)
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "proof").symlink_to(built)
    assert warm.safenav(*synth.split()[1:], cwd=tmp_path).returncode == lost
    automaton = "lift.counterstrategy.json" if lost else "lift.json"
    done = ran(prove.replace("lift.json", automaton).split(), cwd=tmp_path, check=True)
    what = "no strategy realizes" if lost else "the strategy realizes"
    assert done.stdout == f"proved: {what} the specification\n"


def test_the_proved_checker_reads_edited_files_as_safenav_does(
    proved: Callable[[Files], str], tmp_path: Path
) -> None:
    *sources, measures = lift_of(4, tmp_path)
    for name, edit in from_yaml(beside(__file__, "edits.yaml")).items():
        files = [tmp_path / "specification", tmp_path / "automaton", measures]
        for file, source in zip(files, sources, strict=False):
            text = source.read_text()
            for pattern, instead in edit.get(file.name, {}).items():
                text, count = re.subn(pattern, instead, text)
                assert count, (name, pattern)
            file.write_text(text)
        reason = proved(files)
        assert reason.startswith(edit.get("refused", "")), (name, reason)
        verified = warm.safenav("verify", *files[:2]).returncode
        assert bool(reason) is bool(verified) is ("refused" in edit), (name, reason)


def test_the_program_refuses_incomplete_or_missing_files(
    program: Path, proved: Callable[[Files], str], tmp_path: Path
) -> None:
    files = lift_of(4, tmp_path)
    files[2].write_text(json.dumps({"of": "strategy", "measures": [{"n": [], "a": []}] * 2}))
    assert proved(files) == "too few ranks"
    assert ran([program, tmp_path / "none", tmp_path, tmp_path]).returncode == 2
    assert ran([program]).returncode == 2
