"""Strategies, proofs and other files of a bundle that were altered, with all checksums right, are
refused, unless they still prove what they claim. Lies in the trace: ``tests/lies``.

Among the tests the campaign is short; SAFENAV_FUZZ=2000 tries as many others.
"""

import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest

from certify.making import Files, files_of, judged, lines_of, rewrite, shipped, with_lines
from safenav.certify.check import check_bundle
from safenav.spec.specification import read_specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import first_failure

Change = Callable[[Any, Random], bool]
"""Changes a document; returns whether there was something to change."""


def renamed(files: Files, path: str, data: bytes) -> Files:
    """With another strategy: its name and the trace follow, and the measures too if the forger
    finds any."""
    old, new = Path(path).stem.encode(), hashlib.sha256(data).hexdigest().encode()
    trace = files["trace.jsonl"].replace(old, new)
    return files | {path.replace(old.decode(), new.decode()): data, "trace.jsonl": trace}


def changed(files: Files, folder: str, change: Change, source: Random) -> Files | None:
    """With one file of a folder changed; None if nothing in it can be."""
    paths = sorted(name for name in files if name.startswith(folder))
    path = source.choice(paths) if paths else ""
    document = json.loads(files[path]) if path else None
    if document is None or not change(document, source):
        return None
    data = json.dumps(document).encode()
    return renamed(files, path, data) if folder == "strategies/" else files | {path: data}


def _redirect(document: Any, source: Random) -> bool:
    nodes = document["nodes"]
    node = nodes[source.choice([k for k, v in nodes.items() if v["trans"]] or ["0"])]
    if not node["trans"] or len(nodes) < 2:
        return False
    at = source.randrange(len(node["trans"]))
    node["trans"][at] = (node["trans"][at] + source.randrange(1, len(nodes))) % len(nodes)
    return True


def _drop_edge(document: Any, source: Random) -> bool:
    node = document["nodes"][source.choice(sorted(document["nodes"]))]
    return bool(node["trans"]) and node["trans"].pop() is not None


def _flip_bit(document: Any, source: Random) -> bool:
    node = document["nodes"][source.choice(sorted(document["nodes"]))]
    node["state"][source.randrange(len(node["state"]))] ^= 1
    return True


def _measure(document: Any, source: Random) -> bool:
    part = source.choice(document["measures"]) if document["measures"] else None
    if part is None or not part["n"]:
        return False
    node = source.randrange(len(part["n"]))
    if source.random() < 0.7:
        part["n"][node] = max(0, part["n"][node] + source.choice([-2, -1, 1, 2, 50]))
    else:
        part["a"][node] = source.choice([None, 0, 1, 7])
    return True


def _counter_edge(document: Any, source: Random) -> bool:
    change = source.choice([_redirect, _drop_edge, _flip_bit])
    return bool(document.get("automaton", {}).get("nodes")) and change(
        document["automaton"], source
    )


def _counter_input(document: Any, source: Random) -> bool:
    if "automaton" not in document:
        return False
    inputs = source.choice([document["start"], *document["chosen"]])
    if inputs:
        inputs[source.randrange(len(inputs))] ^= 1
    else:
        inputs.append(0)
    return True


ALWAYS = {"a transition gone"}
"""Never accepted. Otherwise a bundle may be: with another answer of the strategy that is right as
well, by waiting where it meets its goals, or by another measure that still falls."""
MUTANTS: dict[str, tuple[str, Change]] = {
    "a transition": ("strategies/", _redirect),
    "a transition gone": ("strategies/", _drop_edge),
    "a bit of a state": ("strategies/", _flip_bit),
    "a measure": ("proofs/", _measure),
    "an edge of a counterstrategy": ("proofs/", _counter_edge),
    "an input of a counterstrategy": ("proofs/", _counter_input),
}
COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // len(MUTANTS) or 3
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "1000")) if "SAFENAV_FUZZ" in os.environ else 0
BUNDLES = (
    *("case_study_1", "case_study_1_beliefs", "case_study_3"),
    *("unrealizable/forbidden_way", "hello", "alternation"),
)


@pytest.mark.parametrize("name", MUTANTS)
def test_an_altered_bundle_is_refused_unless_it_proves_the_same(name: str, tmp_path: Path) -> None:
    folder, change = MUTANTS[name]
    altered = 0
    for seed in range(FIRST, FIRST + COUNT):
        source = Random(f"{name} {seed}")
        order = source.sample(BUNDLES, len(BUNDLES))
        made = (changed(files_of(shipped(one)), folder, change, source) for one in order)
        if (files := next(filter(None, made), None)) is None:
            continue
        altered += 1
        verdict = check_bundle(rewrite(files, tmp_path / str(seed)))
        assert verdict.reason or (name not in ALWAYS and still_true(files)), seed
    assert altered


def still_true(files: Files) -> bool:
    """Whether the strategies of a bundle that was accepted are right, by the verifier."""
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


def of_files(change: Callable[[Any], object], folder: str) -> Callable[[Files], Files | None]:
    return lambda files: changed(files, folder, lambda one, _: [change(one)] != [], Random(0))


def flat(document: Any) -> None:
    for measure in document["measures"]:
        measure["n"] = [0] * len(measure["n"])


FILES: dict[str, Callable[[Files], Files | None]] = {
    "a strategy that stays": of_files(
        lambda d: [node.update(trans=[int(k)]) for k, node in d["nodes"].items()], "strategies/"
    ),
    "a name of a bit": of_files(lambda d: d["variables"].__setitem__(0, "x; y"), "strategies/"),
    "a flat measure": of_files(flat, "proofs/"),
    "a negative measure": of_files(
        lambda d: [m.update(n=[n - 99 for n in m["n"]]) for m in d["measures"]], "proofs/"
    ),
    "no measures": of_files(lambda d: d.update(measures=[]), "proofs/"),
    "a page in place of a proof": of_files(lambda d: d.clear(), "proofs/"),
    "a file more": lambda files: files | {"strategies/x.json": b"{}"},
    "a repeated key": lambda files: (
        files | {"trace.jsonl": files["trace.jsonl"].replace(b'{"type"', b'{"tick":9,"type"', 3)}
    ),
    "no limit of ticks": lambda files: _without(files, "limits", "ticks"),
    "no seed": lambda files: _without(files, "seed"),
}


def _without(files: Files, *path: str) -> Files:
    """Without a field of the header, also one that the checker does not read."""
    lines = lines_of(files)
    inner = lines[0]["scenario"]
    for key in path[:-1]:
        inner = inner[key]
    del inner[path[-1]]
    return with_lines(files, lines)


@pytest.mark.parametrize("what", FILES)
def test_a_file_that_was_tampered_with_is_refused(what: str, tmp_path: Path) -> None:
    files = FILES[what](files_of(shipped("case_study_3")))
    assert files is not None and files != files_of(shipped("case_study_3"))
    bundle = rewrite(files, tmp_path / "bundle", prove=what.startswith("a strategy"))
    assert check_bundle(bundle).reason


def test_a_checksum_of_another_file_is_refused(tmp_path: Path) -> None:
    bundle = rewrite(files_of(shipped("hello")), tmp_path / "b")
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
