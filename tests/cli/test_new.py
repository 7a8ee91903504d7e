"""``safenav new``: what one begins with."""

import sys
from pathlib import Path

import pytest

from children import ran
from cli.conftest import Command
from safenav.scenario.beginning import TEMPLATES
from safenav.scenario.reading.loader import load_scenario, schema_text

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("template", TEMPLATES)
def test_a_new_scenario_runs_as_it_expects(template: str, safenav: Command, tmp_path: Path) -> None:
    made = safenav("new", "floor.yaml", "--template", template)
    assert made.returncode == 0, made.stderr
    assert made.stdout == ""
    assert "safenav run floor.yaml" in made.stderr
    assert load_scenario(tmp_path / "floor.yaml").expect.outcome is not None
    run = safenav("run", "floor.yaml", "--trace", "floor.jsonl")
    assert run.returncode == 0, run.stdout + run.stderr
    assert safenav("check", "floor.jsonl").returncode == 0


def test_the_schema_is_printed_and_written(safenav: Command, tmp_path: Path) -> None:
    assert safenav("new", "--schema").stdout == schema_text()
    assert safenav("new", "safenav.schema.json", "--schema").returncode == 0
    assert (tmp_path / "safenav.schema.json").read_text(encoding="utf-8") == schema_text()


@pytest.mark.parametrize("shell", ["bash", "fish"])
def test_shells_complete_commands_as_documented(shell: str, environment: dict[str, str]) -> None:
    documented = (DOCS / "install.md").read_text(encoding="utf-8")
    assert f"_SAFENAV_COMPLETE={shell}_source safenav" in documented
    asked = {"COMP_WORDS": "safenav cer", "COMP_CWORD": "cer" if shell == "fish" else "1"}
    program = "import sys; sys.argv[0] = 'safenav'; from safenav.cli import main; main()"
    found = ran(
        [sys.executable, "-c", program],
        env={**environment, **asked, "_SAFENAV_COMPLETE": f"{shell}_complete"},
        check=True,
    )
    assert "certify" in found.stdout
    assert "doctor" not in found.stdout
