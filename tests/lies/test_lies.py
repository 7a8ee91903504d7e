"""Each lie is refused by all who must refuse it; those that are not yet are expected failures."""

from pathlib import Path

import pytest

from certify.making import Files, bundle_at, files_of, rewrite, run_checker
from lies.forging import retold
from lies.lies import BUNDLE, FORMULAS, LIES, TRACE, code
from safenav.certify.check import check_bundle
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError

CASES = [
    pytest.param(name, who, id=f"{name}: {lie.says} ({who})")
    for name, lie in LIES.items()
    for who in lie.refused_by
]


def believed(who: str, bundle: Path, files: Files, target: Path) -> bool:
    """Whether a checker accepts these files, with the claims that it establishes itself."""
    if who == BUNDLE:
        return check_bundle(rewrite(bundle, files, target)).accepted
    try:
        judged = judge(files["trace.jsonl"].splitlines(keepends=True))
    except NotATraceError:
        return False
    return judged.ok and judged.outcome is not None and not judged.notes


@pytest.mark.parametrize(("name", "who"), CASES)
def test_a_lie_is_refused(name: str, who: str, tmp_path: Path) -> None:
    lie = LIES[name]
    bundle = lie.source()
    honest = files_of(bundle)
    assert believed(who, bundle, honest, tmp_path / "honest")
    files = lie.forge(dict(honest))
    assert files != honest
    assert not believed(who, bundle, files, tmp_path / "lie")


@pytest.mark.parametrize("who", [TRACE, BUNDLE, "its own check.py"])
def test_a_name_is_never_code(who: str, tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    bundle = bundle_at("formulas", FORMULAS)
    files = retold(code(canary))(files_of(bundle))
    if who in (TRACE, BUNDLE):
        assert not believed(who, bundle, files, tmp_path / "lie")
    else:
        status, said = run_checker(rewrite(bundle, files, tmp_path / "lie"))
        assert status == 1, said
    assert not canary.exists()
