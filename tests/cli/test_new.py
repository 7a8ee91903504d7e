"""``safenav new``: what one begins with."""

import sys
from pathlib import Path

import pytest

from children import ran
from cli.conftest import Command
from safenav.scenario.beginning import DEFAULT, TEMPLATES, template_text
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


def test_a_file_that_exists_is_replaced_only_by_force(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("precious\n")
    refused = safenav("new", "mine.yaml")
    assert refused.returncode == 2
    assert "mine.yaml already exists" in refused.stderr
    assert "--force" in refused.stderr
    assert (tmp_path / "mine.yaml").read_text() == "precious\n"
    assert safenav("new", "mine.yaml", "--force").returncode == 0
    assert (tmp_path / "mine.yaml").read_text(encoding="utf-8") == template_text(DEFAULT)
    assert [file.name for file in tmp_path.iterdir()] == ["mine.yaml"], "nothing is left behind"


def test_the_schema_is_printed_and_written(safenav: Command, tmp_path: Path) -> None:
    assert safenav("new", "--schema").stdout == schema_text()
    assert safenav("new", "safenav.schema.json", "--schema").returncode == 0
    assert (tmp_path / "safenav.schema.json").read_text(encoding="utf-8") == schema_text()
    assert safenav("new", "no/where.json", "--schema").returncode == 2


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
