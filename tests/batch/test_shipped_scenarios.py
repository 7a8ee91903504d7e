"""The scenarios that come with safenav, with the real synthesizer."""

import os
from pathlib import Path

import pytest
import xmlschema

from batch.running import safenav
from safenav.synthesis.binary import find_own_binary

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(
    not os.environ.get("SAFENAV_SLUGS") and find_own_binary() is None,
    reason="slugs is not built (run `make slugs`)",
)


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("SAFENAV_CACHE", "off")


def test_the_case_studies_are_as_they_expect(tmp_path: Path) -> None:
    """All shipped scenarios are played, and audited, in tests/runtime."""
    report = tmp_path / "out.xml"
    done = safenav("scenarios/case_study_*.yaml", "--jobs", "2", "--junit", str(report))
    assert done.returncode == 0, done.stdout
    schema = xmlschema.XMLSchema(str(Path(__file__).with_name("junit.xsd")))
    schema.validate(report)
    assert 'failures="0" errors="0"' in report.read_text()


def test_a_deliberately_wrong_expectation_fails_and_names_the_difference(tmp_path: Path) -> None:
    matrix = tmp_path / "wrong.yaml"
    matrix.write_text(
        f"batch: 1\nscenarios: ['{ROOT}/scenarios/case_study_1.yaml']\ninclude:\n"
        "- expect.order: [violation quad door@47, request digit, resolved digit door@47]\n"
        "- expect.order: [resolved door@47, violation door@47]\n"
        "- {expect.helpers: {door@47: quad}, expect.ticks: 3}\n"
    )
    done = safenav(str(matrix), "--out", str(tmp_path / "out"))
    assert done.returncode == 1
    assert "  order: expected 'violation door@47' after 'resolved door@47' (tick 16)" in done.stdout
    assert "  helpers: expected quad to be requested for door@47, digit was\n" in done.stdout
    assert "  ticks: expected at most 3, got 46\n" in done.stdout
    assert "1 passed, 2 different" in done.stdout
    assert len(list((tmp_path / "out" / "failures").glob("*/replay.html"))) == 2
