"""Paths on the command line become cases."""

from batch.made_scenarios import Write
from safenav.batch.search import find_cases


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
