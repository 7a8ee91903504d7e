"""The page of rules has the sentence of each rule."""

from pathlib import Path

from safenav.judge.engine import FACTS

PAGE = Path(__file__).parents[2] / "docs" / "judge.md"


def test_the_page_states_each_rule() -> None:
    table = PAGE.read_text().partition("## Rules")[2].partition("## Limits")[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    assert rows == [f"| `{rule.name}` | {rule.text} |" for rule in FACTS]
