"""All files named in docs/paper.md exist, and the figures of the paper can be made."""

import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]
PAPER = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")


def pointed() -> list[str]:
    quoted = set(re.findall(r"`([^`]+)`", PAPER))
    return sorted(
        word for word in quoted if re.match(r"(safenav|tests|scenarios|slugs)/[\w/.]+$", word)
    )


@pytest.mark.parametrize("path", pointed())
def test_every_file_that_is_named_exists(path: str) -> None:
    assert (ROOT / path).exists()


def test_every_test_that_is_named_exists() -> None:
    tests = "".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    named = re.findall(r"`(test_\w+)`", PAPER)
    assert len(named) >= 3
    assert all(f"def {name}(" in tests for name in named)


@pytest.mark.slow
def test_the_figures_and_the_table_are_made_by_one_command(tmp_path: Path) -> None:
    script = ROOT / "packaging" / "paper.py"
    subprocess.run([sys.executable, script, tmp_path, "--repeat", "1"], check=True, timeout=300)
    figures = sorted(path.name for path in tmp_path.glob("*.svg"))
    assert figures == [
        f"case_study_{number}_{name}.svg"
        for number in (1, 2, 3)
        for name in ("end", "request", "start")
    ]
    for figure in tmp_path.glob("*.svg"):
        assert ElementTree.parse(figure).getroot().tag.endswith("svg")
    assert (tmp_path / "times.md").read_text().count("\n") == 8
