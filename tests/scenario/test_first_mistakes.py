"""Mistakes in a first scenario, and the message of each: place, error, remedy."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from once import beside
from safenav.errors import Diagnostic, InputError
from safenav.scenario.reading.loader import load_scenario, load_scenario_text

FIRST = beside(__file__, "scenarios/first_mistakes_first.yaml")

MISTAKES = yaml.safe_load((Path(__file__).parent / "first_mistakes.yaml").read_text())


def messages(found: tuple[Diagnostic, ...]) -> list[str]:
    """Return messages as ``line:column: error (remedy)``."""
    return [f"{d.line}:{d.column}: {d.found}" + (f" ({d.hint})" if d.hint else "") for d in found]


def test_the_first_scenario_is_valid() -> None:
    assert load_scenario_text(FIRST).name == "first try"


@pytest.mark.parametrize("mistake", MISTAKES, ids=[each["written"] for each in MISTAKES])
def test_a_mistake_is_reported_with_its_remedy(mistake: dict[str, Any]) -> None:
    assert mistake["part"] in FIRST
    text = FIRST.replace(mistake["part"], mistake["written"], 1)
    with pytest.raises(InputError) as caught:
        load_scenario_text(text, "first.yaml")
    assert messages(caught.value.diagnostics) == mistake["told"]


FILES = {
    "latin 1": (
        FIRST.replace("first try", "é").encode("latin-1"),
        "2:7: not UTF-8: byte 0xE9 (save it as UTF-8)",
    ),
    "utf 16": (FIRST.encode("utf-16"), "1:1: not UTF-8: byte 0xFF (save it as UTF-8)"),
    "image": (
        b"\x89PNG\r\n\x1a\n",
        "0:0: this is an image (PNG), not YAML (name the YAML file that refers to it; to see "
        "a map alone: safenav draw FILE)",
    ),
    "empty": (
        b"",
        "1:1: the file is empty (safenav new FILE writes a scenario, with --fleet SCENARIO a "
        "fleet file)",
    ),
    "only a comment": (
        b"# to do\n",
        "1:1: the file is empty (safenav new FILE writes a scenario, with --fleet SCENARIO a "
        "fleet file)",
    ),
    "two documents": (
        b"safenav: 1\n---\nsafenav: 1\n",
        "2:1: a second document (keep one scenario in a file; remove '---' and what follows)",
    ),
    "trace": (
        b'{"type": "header", "trace": 3}\n',
        "0:0: this is a trace, not a scenario (show it with: safenav replay {path})",
    ),
    "fleet file": (
        b"safenav-fleet: 1\ntransport: ros2\n",
        "0:0: this is a fleet file, not a scenario (use it with: safenav drive SCENARIO "
        "--fleet {path})",
    ),
    "specification": (
        b"[INPUT]\n[OUTPUT]\nmove:0...3\n",
        "0:0: this is a specification, not a scenario (its strategy: safenav synth {path}; "
        "why not: safenav explain)",
    ),
    "ROS map": (
        b"image: a.pgm\nresolution: 0.05\nnegate: 0\n",
        "0:0: this is a map of ROS map_server, not a scenario (draw it with: safenav draw "
        "{path}; begin a scenario on it: safenav new FILE --map {path})",
    ),
    "list": (
        b"- safenav: 1\n",
        "1:1: the scenario: found a list of 1, expected a mapping (key: value)",
    ),
    "text": (
        b"a robot goes to the dock\n",
        "1:1: the scenario: found the text 'a robot goes to the dock', expected a mapping "
        "(key: value)",
    ),
    "too deep": ((b"[" * 60) + (b"]" * 60), "1:51: nested more than 50 deep"),
    "too large": (b"#" * 5_000_001, "0:0: the file is larger than 5 MB"),
    "too many values": (
        b"safenav: [" + b"1," * 100_001 + b"]",
        "1:200009: more than 100000 values in one file (aliases count with all their content)",
    ),
    "a control character": (
        FIRST.replace("first try", "first\x07try").encode(),
        "2:12: not text: the character U+0007 (remove it: programs disagree on what it means,"
        " for example on whether a line ends there)",
    ),
}
"""The content of a file, and its message."""


@pytest.mark.parametrize("name", FILES)
def test_a_wrong_file_is_reported_with_its_remedy(name: str, tmp_path: Path) -> None:
    content, told = FILES[name]
    path = tmp_path / "first.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert messages(caught.value.diagnostics) == [told.replace("{path}", str(path))]


def test_a_missing_file_names_a_similar_one(tmp_path: Path) -> None:
    (tmp_path / "first.yaml").write_text(FIRST)
    with pytest.raises(InputError) as caught:
        load_scenario(tmp_path / "frist.yaml")
    hint = f"did you mean '{tmp_path / 'first.yaml'}'?"
    assert messages(caught.value.diagnostics) == [f"0:0: no such file ({hint})"]


def test_a_folder_is_not_a_scenario(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load_scenario(tmp_path)
    told = ["0:0: this is a directory (name a file in it)"]
    assert messages(caught.value.diagnostics) == told
