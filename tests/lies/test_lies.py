"""Each lie is refused by all who must refuse it; those that are not yet are expected failures."""

import json
from pathlib import Path

import pytest

from certify.making import Files, bundle_at, checked, files_of, rewrite, run_checker
from lies.forging import retold
from lies.lies import BUNDLE, FORMULAS, LIES, TRACE, code
from safenav.audit.check import check_trace
from safenav.errors import InputError
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError

JUDGE = "the judge"


def marks(name: str, who: str) -> list[pytest.MarkDecorator]:
    why = LIES[name].accepted.get(who)
    return [] if why is None else [pytest.mark.xfail(reason=why, strict=True)]


CASES = [
    pytest.param(name, who, id=f"{name}: {lie.says} ({who})", marks=marks(name, who))
    for name, lie in LIES.items()
    for who in lie.refused_by
] + [
    pytest.param(n, JUDGE, id=f"{n}: {JUDGE}") for n, lie in LIES.items() if TRACE in lie.refused_by
]


def believed(who: str, bundle: Path, files: Files, target: Path) -> bool:
    """Whether a checker accepts these files, with the claims that it establishes itself."""
    if who == BUNDLE:
        return checked(rewrite(bundle, files, target), compare=False).accepted
    if who == JUDGE:
        try:
            judged = judge(files["trace.jsonl"].splitlines(keepends=True))
        except NotATraceError:
            return False
        return judged.ok and judged.outcome is not None and not judged.notes
    try:
        found = check_trace([line.decode() for line in files["trace.jsonl"].splitlines()])
    except InputError:
        return False
    return found.ok and found.complete and not found.notes


def named(files: Files) -> Files:
    """Without the page, and without the proofs that no line of the trace names any more."""
    lines = [json.loads(line) for line in files["trace.jsonl"].splitlines()]
    asked = [each for line in lines for each in (line, *(line.get("tried") or ()))]
    known = {str(each.get(key)) for each in asked for key in ("spec", "strategy")}

    def is_kept(name: str) -> bool:
        folder, _, file = name.rpartition("/")
        if folder in ("specs", "strategies", "measures", "counterstrategies"):
            return {*file.partition(".")[0].split("-")} <= known
        return folder != "rules" and name not in ("assurance.json", "index.html")

    return {name: data for name, data in files.items() if is_kept(name)}


@pytest.mark.parametrize(("name", "who"), CASES)
def test_a_lie_is_refused(name: str, who: str, tmp_path: Path) -> None:
    lie = LIES[name]
    bundle = lie.source()
    honest = files_of(bundle)
    assert believed(who, bundle, honest, tmp_path / "honest")
    files = lie.forge(dict(honest))
    assert files != honest
    files = files if files.get("index.html") != honest["index.html"] else named(files)
    assert not believed(who, bundle, files, tmp_path / "lie")


@pytest.mark.parametrize("who", [TRACE, JUDGE, BUNDLE, "its own check.py"])
def test_a_name_is_never_code(who: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    bundle = bundle_at("formulas", FORMULAS)
    files = named(retold(code(canary))(files_of(bundle)))
    if who in (TRACE, JUDGE, BUNDLE):
        assert not believed(who, bundle, files, tmp_path / "lie")
    else:
        status, said = run_checker(rewrite(bundle, files, tmp_path / "lie"))
        assert status == 1, said
    assert not canary.exists()
