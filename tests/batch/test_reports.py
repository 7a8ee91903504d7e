"""Reports of a batch: JUnit, a table, a comparison with an earlier batch."""

import re
import xml.etree.ElementTree as ET
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from safenav.batch.case import Case, CaseVerdict, Result
from safenav.batch.session import Report
from safenav.report.batch import summary, to_junit


@cache
def schema() -> Any:
    import xmlschema

    return xmlschema.XMLSchema(str(Path(__file__).with_name("junit.xsd")))


def case(name: str, **settings: int) -> Case:
    return Case(name, name.split(" ")[0], "", settings)


def ran(name: str, seconds: float = 1.0, wrong: str = "", **measured: object) -> Result:
    verdict = CaseVerdict.DIFFERENT if wrong else CaseVerdict.PASSED
    result = case(name).result(verdict, [wrong] if wrong else [])
    result = replace(result, outcome="completed", ticks=40, rounds={"quad": 2}, seconds=seconds)
    return replace(result, wall_seconds=seconds + 0.01, **measured)  # type: ignore[arg-type]


def report(*results: Result, not_run: int = 0) -> Report:
    cases = [case(result.name) for result in results]
    cases += [case(f"z/not-run-{number}.yaml") for number in range(not_run)]
    return Report(tuple(cases), {result.name: result for result in results}, seconds=7.5)


CRASH = case("b/crash.yaml").result(
    CaseVerdict.CRASHED, ["killed by \x1b SIGSEGV <&>"], "Fatal\x00: ü 🚪 ]]>"
)
QUICK = ran("a/quick.yaml")
MIXED = report(
    ran("a/slow.yaml", 3.0),
    ran("a/wrong.yaml", 0.5, "ticks: expected at most 5, got 40"),
    CRASH,
    QUICK,
    not_run=2,
)


def test_a_junit_report_keeps_to_the_schema() -> None:
    text = to_junit(MIXED, when=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))
    schema().validate(text)
    root = ET.fromstring(text)
    assert {key: root.get(key) for key in ("tests", "failures", "errors")} == {
        "tests": "6",
        "failures": "1",
        "errors": "1",
    }
    suites = {suite.get("name"): suite for suite in root}
    assert list(suites) == ["a", "b", "z"]
    assert [suites["z"].get(key) for key in ("tests", "skipped", "timestamp")] == [
        "2",
        "2",
        "2026-01-02T03:04:05",
    ]
    failure = suites["a"].find("testcase[@name='wrong.yaml']/failure")
    assert failure is not None
    assert failure.get("message") == "ticks: expected at most 5, got 40"
    error = suites["b"].find("testcase/error")
    assert error is not None and error.text is not None
    assert error.get("type") == "crashed"
    assert error.get("message") == "killed by ? SIGSEGV <&>"
    assert "Fatal?: ü 🚪 ]]>" in error.text


def test_the_table_starts_with_failed_cases_and_then_slow_ones() -> None:
    fast = [ran(f"a/{number}.yaml", number / 10) for number in range(12)]
    shown = report(*fast, *MIXED.results.values())
    lines = summary(shown)
    rows = [line.split() for line in (*lines[2:7], lines[14])]
    assert [row[0] for row in rows] == [
        "\x1b[31ma/wrong.yaml",
        "\x1b[31mb/crash.yaml",
        "a/slow.yaml",
        "a/11.yaml",
        "a/10.yaml",
        "...",
    ]
    assert lines[14] == "... and 4 more passed"
    text = re.sub("\x1b.*?m", "", "\n".join(lines))
    assert "a/wrong.yaml: different\n  ticks: expected at most 5, got 40\n" in text
    assert text.endswith("14 passed, 1 different, 1 crashed in 7.5 s")


def test_names_and_reasons_give_no_orders_to_the_terminal() -> None:
    """A file may have any name; a reason may quote what a process has written."""
    shown = summary(report(ran("a/\x1b[2J.yaml"), CRASH))
    plain = re.sub("\x1b\\[[0-9]*m", "", "\n".join(shown))
    assert "\x1b" not in plain and "a/?[2J.yaml" in plain and "killed by ? SIGSEGV <&>" in plain
