"""Cores, plays and sentences of files that were once explained wrongly."""

from pathlib import Path

import pytest

from explain.conftest import Invoke
from once import beside
from safenav.cli.synth import explain

TWO_CONFLICTS = """\
[OUTPUT]
a
b
[SYS_TRANS]
a'
!a'
b'
!b'
"""


DROP = beside(__file__, "scenarios/conflicts_drop.yaml")


def test_without_time_only_proven_results_are_printed(
    tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("safenav.explain.realizability.BUDGET_SECONDS", 0.0)
    file = tmp_path / "s"
    file.write_text(TWO_CONFLICTS)
    answer = invoke(explain, file)
    assert answer.status == 1
    assert answer.output.splitlines()[1:] == [
        "These guarantees conflict:",
        "  - line 5 [SYS_TRANS] a'",
        "  - line 6 [SYS_TRANS] !a'",
        "  - line 7 [SYS_TRANS] b'",
        "  - line 8 [SYS_TRANS] !b'",
        "  (some checks timed out: the core may not be minimal)",
    ]
    file = tmp_path / "drop.yaml"
    file.write_text(DROP)
    answer = invoke(explain, file)
    assert answer.status == 1 and "because its guarantees conflict\n" in answer.output
    assert "What happens" not in answer.output and "cooperated" not in answer.output
