"""Cores, plays and sentences of files that were once explained wrongly."""

import signal
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import pytest

from explain.conftest import Invoke
from once import SCENARIOS, beside
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


def test_without_time_only_what_is_proven_is_printed(
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


CIRCLE = beside(__file__, "scenarios/conflicts_circle.yaml")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seed", range(4))
def test_an_interrupt_ends_it(seed: int, number: signal.Signals, tmp_path: Path) -> None:
    """The runs of repairs took it for the end of one run."""
    circle = tmp_path / "circle.yaml"
    circle.write_text(CIRCLE)
    file = [circle, SCENARIOS / "unrealizable" / "separate_rooms.yaml"][seed % 2]
    command = [sys.executable, "-m", "safenav", "explain", str(file)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:  # type: ignore[call-overload]
        time.sleep(0.8 + 2.5 * Random(seed).random())
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode in (130, 1)
    if process.returncode == 130:
        assert err.endswith("interrupted\n")
        assert "None of the simple repairs" not in out and "ended with interrupted" not in out
