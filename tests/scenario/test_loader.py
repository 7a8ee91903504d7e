"""What a scenario means, and what is wrong with one that is refused: place, error, remedy.

Most is in files: ``accepted.yaml``, ``refused.yaml``, ``first_mistakes.yaml`` and
``scenarios/invalid``, whose first lines announce exactly the errors of each file:
``# error: <line>:<column>: <regular expression for message and hint>``
"""

import builtins
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from once import ROOT, beside, from_yaml
from safenav import InputError, load_scenario, load_scenario_text
from scenario.mistakes import INVALID, recorded, refuse_as_announced

BASE: dict[str, Any] = from_yaml("""
safenav: 1
map:
  grid: ['#######', '#..#..#', '#.....#', '#..#..#', '#######']
  names: {dock: [1, 2], gate: 17}
areas:
  west: {rows: 1-3, columns: 0-2}
  east: [{columns: 4-6}]
  corner: [[3, 4], 26]
robots: {ann: {model: quadcopter, start: 8, objective: {hold: 8}}}
""")


def loaded(keys: dict[str, Any]) -> Any:
    """Load BASE with other keys, beside the map files of the tests."""
    text = yaml.safe_dump(BASE | keys, sort_keys=False)
    return load_scenario_text(text, str(ROOT / "tests/maps/scenario.yaml"))


ACCEPTED = from_yaml(beside(__file__, "accepted.yaml"))


@pytest.mark.parametrize("case", ACCEPTED, ids=[case["claim"] for case in ACCEPTED])
def test_a_form_of_a_key_is_read_with_its_documented_meaning(
    case: dict[str, Any], tmp_path: Path
) -> None:
    scenario = loaded(case["keys"])
    told = recorded(scenario, tmp_path / "t.jsonl")
    assert scenario.map.notes == tuple(case.get("notes", ()))
    for path, expected in case.get("read", {}).items():
        found: Any = told
        for step in path.split("."):
            found = found[int(step)] if isinstance(found, list) else found.get(step)
        assert found == expected
    for need, names in enumerate(case.get("closed", ())):
        obstacle = scenario.obstacles[0]
        need = need and len(obstacle.needs) - 1
        assert [r.name for r in scenario.robots if obstacle.closed_to(r, need)] == names


def test_line_ends_and_byte_order_marks_of_other_systems_are_read(tmp_path: Path) -> None:
    body = yaml.safe_dump(BASE)
    file = tmp_path / "with space and ü.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + body.replace("\n", "\r\n").encode())
    assert load_scenario(file).map == load_scenario_text(body).map


@pytest.mark.parametrize("file", INVALID, ids=[file.stem for file in INVALID])
def test_an_invalid_scenario_reports_exactly_its_listed_errors(file: Path) -> None:
    refuse_as_announced(file)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("", (1, 1), "the file is empty"),
        ("a: \x00", (1, 4), "not text: .*U\\+0000"),
        # After it, a comment to one program would be a key to another.
        *((f"# {c}a: 1", (1, 3), rf"not text: .*U\+{ord(c):04X}") for c in "\r\f\x85\u2028"),
        (r'name: "a\u2028b"', None, r"the text holds .*U\+2028"),
        *((f"b: 1\na: {c}", (2, 4), f"U\\+{ord(c):04X}") for c in "\ud800\uffff"),
        ("a: 1\n" * 200, None, "and 103 more"),
        ("[" * 100_000, None, "nested more than 50 deep"),
        ("{a: " * 100_000, None, "nested more than 50 deep"),
        ("- " * 5_000 + "x", None, "nested more than 50 deep"),
        ("a: " + "[" * 60 + "]" * 60, None, "nested more than 50 deep"),
    ],
    ids=[
        *(
            "an empty file",
            "a NUL",
            "CR",
            "FF",
            "NEL",
            "LS",
            "an escaped LS",
            "half a surrogate pair",
            "a noncharacter",
            "200 errors",
        ),
        *("open lists", "open mappings", "nested blocks", "closed lists"),
    ],
)
def test_unreadable_or_oversized_text_is_refused(
    text: str, place: tuple[int, int] | None, words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_scenario_text(text)
    if place is not None:
        assert [(each.line, each.column) for each in caught.value.diagnostics] == [place]


REFUSED = from_yaml(beside(__file__, "refused.yaml"))


@pytest.mark.parametrize("case", REFUSED, ids=[case["found"] for case in REFUSED])
def test_a_broken_scenario_is_refused_with_the_reason(case: dict[str, Any]) -> None:
    with pytest.raises(InputError) as caught:
        loaded(case["keys"])
    assert re.search(
        case["found"], " ".join(f"{d.found} {d.hint}" for d in caught.value.diagnostics)
    )


def test_a_map_or_a_team_that_is_too_large_is_refused() -> None:
    robot = {"model": "quadcopter", "start": 8, "avoids": [], "objective": {"hold": 9}}
    with pytest.raises(InputError, match="1001 robots; the maximum is 1000"):
        loaded({"robots": {f"r{number}": robot for number in range(1001)}})
    with pytest.raises(InputError, match="a map of 500 x 600 regions; the maximum is 262144"):
        loaded({"map": {"grid": ["." * 600] * 500}, "areas": {}})


def test_without_pillow_an_image_is_refused_with_the_command_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real = builtins.__import__

    def refuse(name: str, *rest: Any, **options: Any) -> Any:
        if name == "PIL":
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(InputError, match=r"(?s)needs Pillow.*pip install 'numpy>=1.26' 'pillow"):
        loaded({"map": {"image": "rooms.png", "rows": 7, "cols": 13}})


FIRST = beside(__file__, "scenarios/first_mistakes_first.yaml")
MISTAKES = from_yaml(beside(__file__, "first_mistakes.yaml"))


def test_the_example_of_a_first_scenario_is_valid() -> None:
    assert load_scenario_text(FIRST).name == "first try"


@pytest.mark.parametrize("mistake", MISTAKES, ids=[each["written"] for each in MISTAKES])
def test_an_error_in_a_first_scenario_is_reported_with_its_remedy(mistake: dict[str, Any]) -> None:
    assert mistake["part"] in FIRST
    with pytest.raises(InputError) as caught:
        load_scenario_text(FIRST.replace(mistake["part"], mistake["written"], 1), "first.yaml")
    found = caught.value.diagnostics
    told = [f"{d.line}:{d.column}: {d.found}" + (f" ({d.hint})" if d.hint else "") for d in found]
    assert told == mistake["told"]
