"""Altered bundles are refused, unless they still prove what they claim.

The broken traces of ``tests/judge`` try each rule about lines, which bundles are judged by, too.
Among the tests the campaign is short; SAFENAV_FUZZ=2000 tries as many others.
"""

import json
import os
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Any

import pytest

from certify.making import Files, files_of, judged, rewrite, shipped
from certify.mutants import MEASURE, MUTANTS, Mutant, lines_of
from safenav.spec.parsing import read_specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import first_failure

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // len(MUTANTS) or 3
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "1000")) if "SAFENAV_FUZZ" in os.environ else 0
BUNDLES = (
    "case_study_1",
    "case_study_1_beliefs",
    "case_study_3",
    "two_digits",
    "hello, assignable",
    "unrealizable/forbidden_way",
    "hello",
    "corridor_swap",
    "never resolvable",
    "deadlock",
    "one way",
    "alternation",
)


@pytest.fixture(scope="module")
def check() -> Any:
    """The checker, called in this process: thousands of times."""
    return import_module("safenav.judge.bundle.check").check


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda m: m.name)
def test_an_altered_bundle_is_refused_unless_it_proves_the_same(
    mutant: Mutant, check: Any, tmp_path: Path
) -> None:
    altered = 0
    for seed in range(FIRST, FIRST + COUNT):
        source = Random(f"{mutant.name} {seed}")
        names = list(BUNDLES)
        source.shuffle(names)
        for name in names:
            files = mutant.alter(files_of(shipped(name)), source)
            if files is not None:
                break
        else:
            continue
        altered += 1
        bundle = rewrite(shipped(name), files, tmp_path / str(seed))
        verdict, reason, *_ = check(bundle)
        if verdict == "accepted":
            assert mutant.harmless, (name, seed)
            assert still_true(mutant, files), (name, seed)
        else:
            assert reason
    assert altered


def still_true(mutant: Mutant, files: Files) -> bool:
    """Whether the claims of a bundle that was accepted are true, by the verifier's judgement."""
    if mutant.harmless == MEASURE:  # it is not about strategies
        return True
    cache = Cache.from_environment()
    for line in lines_of(files):
        text = cache.load_text(line["spec"]) if line["type"] == "synthesis" else None
        data = files.get(f"strategies/{line.get('strategy')}.json")
        if text is None or data is None:
            continue
        spec = read_specification(text, robot=line["robot"])
        if first_failure(spec, Strategy.parse(data, spec), False) is not None:
            return False
    return True


def test_a_checksum_of_another_file_is_refused(tmp_path: Path) -> None:
    bundle = rewrite(shipped("hello"), files_of(shipped("hello")), tmp_path / "b")
    manifest = json.loads((bundle / "manifest.json").read_bytes())
    for name in manifest["files"]:
        before = (bundle / name).read_bytes()
        if name.endswith(".py"):
            continue
        (bundle / name).write_bytes(before[:-2] + b" \n")
        status, said = judged(bundle)
        assert status == 1, name
        assert "is not the file that the manifest names" in said
        (bundle / name).write_bytes(before)
