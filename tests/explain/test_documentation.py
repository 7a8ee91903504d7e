"""docs/explain.md and docs/trust.md: causes are complete, and commands do what they say."""

import re
import shlex
from pathlib import Path

import pytest

from explain.conftest import Invoke
from safenav.cli.synth import explain, synth, verify
from safenav.explain.explanation import NoStrategyCause

ROOT = Path(__file__).parents[2]
TEXT = "".join((ROOT / "docs" / f"{page}.md").read_text("utf-8") for page in ("explain", "trust"))


def test_every_cause_is_explained() -> None:
    table = TEXT.split("| cause |")[1].split("\n\n")[0]
    named = re.findall(r"`(\w+)`", table)
    assert {cause.value for cause in NoStrategyCause} <= set(named)


def test_its_commands_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, invoke: Invoke) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    commands = {"explain": explain, "synth": synth, "verify": verify}
    expected = {"explain": 1, "synth": 0, "verify": 0}
    lines = re.findall(r"^    safenav (\w.*)$", TEXT, re.MULTILINE)
    assert {line.split()[0] for line in lines} == set(commands)
    for line in lines:
        name, *arguments = shlex.split(line)
        assert invoke(commands[name], *arguments).status == expected[name], line
