"""The examples of docs/batch.md work as described."""

import re
from pathlib import Path

import pytest

from batch.made_scenarios import Write
from safenav.batch.case import CaseVerdict
from safenav.batch.matrix import read_matrix
from safenav.cli.batch import batch as command

ROOT = Path(__file__).parents[2]
BATCH = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_matrix_file_is_one() -> None:
    (example,) = blocks(BATCH, "yaml")
    matrix = read_matrix(example, "docs/batch.md")
    assert len(matrix.settings) == 10 * 2 * 2 - 10 + 1


def test_the_documentation_names_every_verdict_and_option() -> None:
    for verdict in CaseVerdict:
        assert f"| `{verdict.value}` |" in BATCH
    options = {option for parameter in command.params for option in parameter.opts}
    own = [line for line in BATCH.splitlines() if "docker run" not in line]
    named = set(re.findall(r"(?<!-)--[a-z][a-z-]+", "\n".join(own)))
    assert named <= options
    assert {"--junit", "--resume", "--dask", "--certify"} <= named


@pytest.mark.usefixtures("slugs")
def test_the_library_example_runs(write: Write, capsys: pytest.CaptureFixture[str]) -> None:
    write("scenarios/good.yaml")
    write("scenarios/wrong.yaml", expect="{outcome: completed}")
    (example,) = blocks(BATCH, "python")
    exec(compile(example, "docs/batch.md", "exec"), {})
    reasons = "['outcome: expected completed, got unrealizable']"
    assert capsys.readouterr().out == f"scenarios/wrong.yaml different {reasons}\n"
