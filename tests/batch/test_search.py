"""Paths on the command line become cases."""

from pathlib import Path

import pytest

from batch.made_scenarios import Write
from safenav.batch.search import find_cases
from safenav.errors import InputError, UsageError


def names(*paths: str) -> list[str]:
    return [case.name for case in find_cases(paths).cases]


@pytest.fixture
def suite(write: Write) -> None:
    for name in ["b.yaml", "a.yml", "deep/er/c.yaml", "invalid/d.yaml", "deep/invalid/e.yaml"]:
        write(f"suite/{name}")
    write("suite/.hidden/f.yaml")
    write("suite/notes.txt", text="nothing")
    write("suite/lab.yaml", text="image: lab.pgm\nresolution: 0.05\n")
    write("suite/nightly.yaml", text="batch: 1\nscenarios: [b.yaml]\nmatrix: {seed: [1]}\n")


@pytest.mark.usefixtures("suite")
def test_a_folder_is_searched_for_scenarios_that_are_meant_to_work() -> None:
    found = find_cases(["suite"])
    assert [case.name for case in found.cases] == [
        "suite/a.yml",
        "suite/b.yaml",
        "suite/deep/er/c.yaml",
    ]
    assert found.passed_over == ["suite/lab.yaml"]
    assert found.matrices == ["suite/nightly.yaml"]


@pytest.mark.usefixtures("suite")
@pytest.mark.parametrize("order", [1, -1])
def test_a_matrix_file_that_is_named_is_not_skipped(order: int) -> None:
    found = find_cases(["suite", "suite/nightly.yaml"][::order])
    assert found.matrices == []
    assert "suite/b.yaml [seed=1]" in [case.name for case in found.cases]


@pytest.mark.usefixtures("suite")
@pytest.mark.parametrize(
    ("paths", "expected"),
    [
        (["suite/b.yaml"], ["suite/b.yaml"]),
        (["./suite/../suite/b.yaml", "suite/b.yaml"], ["suite/b.yaml"]),
        (["suite/invalid"], ["suite/invalid/d.yaml"]),
        (["suite/invalid/d.yaml"], ["suite/invalid/d.yaml"]),
        (["suite/**/*.yaml"], ["suite/b.yaml", "suite/deep/er/c.yaml"]),
        (["suite/**/invalid/*.yaml"], ["suite/deep/invalid/e.yaml", "suite/invalid/d.yaml"]),
        (["suite/nightly.yaml"], ["suite/b.yaml [seed=1]"]),
        (["suite/lab.yaml"], ["suite/lab.yaml"]),
    ],
)
def test_named_files_and_patterns_are_taken(paths: list[str], expected: list[str]) -> None:
    assert names(*paths) == expected


def test_a_file_name_may_look_like_a_pattern(write: Write) -> None:
    write("door[1].yaml")
    assert names("door[1].yaml") == ["door[1].yaml"]


@pytest.mark.parametrize(
    "text",
    [
        "safenav: 1\nmap: [",
        "map: [\nrobots: }",
        "map: {}\nrobots: {}\n",
        "{safenav: 1, map: {}}",
        "safenav: 1\n---\nsafenav: 1\n",
    ],
    ids=["broken", "broken-without-version", "no-version", "flow", "two-documents"],
)
def test_a_broken_scenario_does_not_vanish_from_a_search(write: Write, text: str) -> None:
    write("suite/broken.yaml", text=text)
    assert names("suite") == ["suite/broken.yaml"]


def test_an_unreadable_scenario_does_not_vanish_from_a_search(write: Write) -> None:
    write("suite/latin.yaml").write_bytes("name: Tür\n".encode("latin-1"))
    (case,) = find_cases(["suite"]).cases
    assert case.text is None


def test_links_that_lead_round_in_a_circle_are_not_followed(write: Write) -> None:
    path = write("suite/a.yaml")
    (path.parent / "again").symlink_to(path.parent)
    (path.parent / "b.yaml").symlink_to(path)
    assert names("suite") == ["suite/a.yaml"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("suit", r"no such file or folder: suit\n.*did you mean 'suite'"),
        ("suite/dor.yaml", r"did you mean 'suite/door.yaml'"),
        ("none/door.yaml", r"the folder none does not exist"),
        ("suite/*.xml", r"no scenario found: suite/\*.xml"),
        ("empty", r"no scenario found: empty"),
        ("x" * 5000, r"^x{60}: File name too long"),
    ],
)
def test_a_path_that_leads_to_no_scenario_is_an_error(
    write: Write, path: str, message: str
) -> None:
    write("suite/door.yaml")
    Path("empty").mkdir()
    with pytest.raises(UsageError, match=message):
        find_cases([path])


def test_the_name_of_a_case_tells_its_settings_and_is_unique(write: Write) -> None:
    write("a.yaml")
    long = "x" * 60
    write(
        "m.yaml",
        text="batch: 1\nscenarios: a.yaml\ninclude:\n"
        f"- {{seed: 1, map.grid: {long}1}}\n- {{seed: 1, map.grid: {long}2}}\n"
        "- {robots.quick.start: [1, 2]}\n- {seed: 1, map.grid: short}\n"
        "- {seed: 1, map.grid: short}\n",
    )
    clipped = "x" * 37 + "..."
    assert names("m.yaml") == [
        f"a.yaml [seed=1, map.grid={clipped}]",
        f"a.yaml [seed=1, map.grid={clipped}] #2",
        "a.yaml [robots.quick.start=[1, 2]]",
        "a.yaml [seed=1, map.grid=short]",
    ]


def test_paths_of_a_matrix_file_are_beside_it(write: Write) -> None:
    write("suites/doors/a.yaml")
    write("suites/b.yaml")
    write("suites/m.yaml", text="batch: 1\nscenarios: [b.yaml, doors]\nmatrix: {seed: [1, 2]}\n")
    assert names("suites/m.yaml") == [
        "suites/b.yaml [seed=1]",
        "suites/b.yaml [seed=2]",
        "suites/doors/a.yaml [seed=1]",
        "suites/doors/a.yaml [seed=2]",
    ]


def test_a_matrix_file_that_leads_nowhere_says_where_it_says_so(write: Write) -> None:
    write("a.yaml")
    write("m.yaml", text="batch: 1\nscenarios: [a.yaml, aa.yaml]\n")
    with pytest.raises(UsageError, match=r"m.yaml:2:21: no such file .*\n.*'a.yaml'"):
        find_cases(["m.yaml"])
    write("n.yaml", text="batch: 1\nscenarios: [m.yaml]\n")
    write("m.yaml", text="batch: 1\nscenarios: [a.yaml]\n")
    with pytest.raises(UsageError, match=r"n.yaml:2:13: m.yaml is a matrix file itself"):
        find_cases(["n.yaml"])
    write("self.yaml", text="batch: 1\nscenarios: [self.yaml]\n")
    write("long.yaml", text=f"batch: 1\nscenarios: {'x' * 5000}\n")
    with pytest.raises(UsageError, match=r"long.yaml:2:12: File name too long"):
        find_cases(["long.yaml"])
    with pytest.raises(UsageError, match=r"self.yaml:2:13: self.yaml is a matrix file itself"):
        find_cases(["self.yaml"])
    write("o.yaml", text="batch: 2\nscenarios: [a.yaml]\n")
    with pytest.raises(InputError, match=r"o.yaml:1:8: version 2 .* unknown"):
        find_cases(["o.yaml"])
