"""Each lie is refused by all who must refuse it (``lies.yaml``)."""

import json
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from certify.making import (
    Files,
    bundle_at,
    files_of,
    lines_of,
    rewrite,
    run_checker,
    shipped,
    with_lines,
)
from once import from_yaml
from safenav import check_bundle
from support.damage import Line, damage
from support.judged import believed

DATA = from_yaml((Path(__file__).parent / "lies.yaml").read_text())
LIES: dict[str, dict[str, Any]] = {lie["says"]: lie for lie in DATA["lies"]}


def refused(files: Files, *, prove: bool = True) -> str:
    """Why the checker of bundles refuses these files (``prove``: with the forger's best proofs)."""
    with TemporaryDirectory() as folder:
        verdict = check_bundle(rewrite(files, Path(folder) / "bundle", prove=prove))
    assert bool(verdict.claims) is verdict.accepted is not bool(verdict.reason)
    return verdict.reason


def trace_of(files: Files) -> list[bytes]:
    return files["trace.jsonl"].splitlines(keepends=True)


@cache
def is_honest(name: str) -> bool:
    return not refused(files_of(shipped(name)))


@pytest.mark.parametrize("says", LIES)
def test_a_bundle_with_a_lie_is_refused(says: str) -> None:
    lie = LIES[says]
    assert is_honest(lie["of"])
    files = files_of(shipped(lie["of"]))
    files |= {f"proofs/{n}": json.dumps(p).encode() for n, p in lie.get("proofs", {}).items()}
    files = with_lines(files, damage(lines_of(files), lie["edits"]))
    files = {name: data for name, data in files.items() if not name.startswith("source/")}
    assert files["trace.jsonl"] != (shipped(lie["of"]) / "trace.jsonl").read_bytes()
    assert believed(trace_of(files)) is ("trace" in lie)
    if lie.get("bundle", True):
        reason = refused(files, prove=lie.get("prove", True))
        assert reason and lie.get("told", "") in reason


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside the right one"])
def test_the_source_of_another_mission_is_refused(beside: bool) -> None:
    files = files_of(shipped("corridor"))
    (name,) = (name for name in files if name.startswith("source/"))
    text = files[name].replace(b"rounds: 2", b"rounds: 9").replace(b"[7, 10]", b"[8, 9]")
    kept = {"source/the_same.yaml": files[name]} if beside else {}
    assert "not the scenario of the trace" in refused({**files, name: text, **kept})


ALONE = """name: alone
robots: {{{0}: {{model: quadcopter, start: {1}, objective: {{visit: [{1}, {2}], avoid: [{3}]}}}}}}
map: {{grid: ["########", "#......#", "#......#", "########"]}}
until: {{rounds: 2}}
limits: {{ticks: 40}}
"""


def test_strategies_that_treat_each_other_as_walls_are_refused() -> None:
    """Each of two robots in one lab has a strategy for a lab in which the other stands still."""
    one, other = (
        files_of(bundle_at(f"alone_{about[0]}", ALONE.format(*about)))
        for about in (("a", 9, 11, 22), ("b", 22, 20, 9))
    )
    mine, theirs = lines_of(one), lines_of(other)
    mine[0]["scenario"]["robots"] += theirs[0]["scenario"]["robots"]
    for lines, name, region in ((mine, "b", 22), (theirs, "a", 9)):
        for line in lines:
            if line["type"] == "synthesis":
                line["closed"] = [[region, f"robots.{name}"]]
    body = [line for line in (*mine[1:], *theirs[1:]) if line["type"] != "outcome"]
    body = sorted((line for line in body if line["tick"] < 5), key=lambda line: int(line["tick"]))
    merged: list[Line] = [mine[0], *body, mine[-1]]
    stated = [line for line in body if line["type"] == "synthesis"]
    for line in (*mine[0]["scenario"]["robots"], *stated):
        line["objective"].pop("avoid", None)
    merged = damage(merged, [{"line": len(merged) - 1, "cut": {"outcome": "interrupted"}}])
    assert refused(with_lines(one | {n: d for n, d in other.items() if n[0] in "sp"}, merged))


@pytest.mark.parametrize("who", ["check", "check of a bundle", "its own check.py"])
def test_a_name_is_never_executed_as_code(who: str, tmp_path: Path) -> None:
    """The name of a variable is a text that opens a file, were it ever evaluated."""
    canary = tmp_path / "canary"
    name = f"m: 0, open({str(canary)!r}, 'w').close(), lambda y"
    about = {"objective.ltl.memory": {name: "bool"}, "objective.ltl.inputs": [name]}
    files = files_of(shipped("formulas"))
    edits = [
        {"line": ["header"], "fields": {f"scenario.robots.q.{k}": v for k, v in about.items()}},
        {"line": ["synthesis"], "every": True, "fields": about},
    ]
    files = with_lines(files, damage(lines_of(files), edits))
    if who == "check":
        assert not believed(trace_of(files))
    elif who == "check of a bundle":
        assert refused(files)
    else:
        status, said = run_checker(rewrite(files, tmp_path / "lie"))
        assert status == 1, said
    assert not canary.exists()
