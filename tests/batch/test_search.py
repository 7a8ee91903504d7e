"""Paths on the command line become cases, and docs/batch.md works as described."""

import re
from pathlib import Path

import pytest

from batch.made_scenarios import Write
from safenav.batch.case import CaseVerdict
from safenav.batch.matrix import read_matrix
from safenav.batch.search import find_cases
from safenav.cli.batch import batch as command


def names(*paths: str) -> list[str]:
    return [case.name for case in find_cases(paths).cases]


def test_an_unreadable_scenario_does_not_vanish_from_a_search(write: Write) -> None:
    write("suite/latin.yaml").write_bytes("name: Tür\n".encode("latin-1"))
    (case,) = find_cases(["suite"]).cases
    assert case.text is None


def test_circular_links_are_not_followed(write: Write) -> None:
    path = write("suite/a.yaml")
    (path.parent / "again").symlink_to(path.parent)
    (path.parent / "b.yaml").symlink_to(path)
    assert names("suite") == ["suite/a.yaml"]


def test_the_name_of_a_case_states_its_settings_and_is_unique(write: Write) -> None:
    write("a.yaml")
    long = "x" * 60
    write(
        "m.yaml",
        text="batch: 1\nscenarios: [a.yaml, ./a.yaml]\n"
        f"matrix: {{seed: [1], map.grid: [{long}1, {long}2, [1, 2], short, short]}}\n",
    )
    clipped = "x" * 37 + "..."
    assert names("m.yaml") == [
        f"a.yaml [seed=1, map.grid={clipped}]",
        f"a.yaml [seed=1, map.grid={clipped}] #2",
        "a.yaml [seed=1, map.grid=[1, 2]]",
        "a.yaml [seed=1, map.grid=short]",
    ]


ROOT = Path(__file__).parents[2]
BATCH = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def test_the_matrix_file_is_one() -> None:
    (example,) = blocks(BATCH, "yaml")
    matrix = read_matrix(example, "docs/batch.md")
    assert len(matrix.settings) == 10 * 2 * 2


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
