"""The source of a scenario in a bundle: its YAML, map and catalogue files, and their comparison
with the scenario of the trace."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from safenav.errors import InputError
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.yaml.findings import STDIN, referenced_files, root_of
from safenav.trace.fields import plain
from safenav.trace.records import Header
from safenav.trace.setting import ScenarioHeader, scenario_header

FOLDER = Path("a/b/c/d")
"""Folder in which a scenario is read again: files in folders above it have room."""


def sources_of(scenario: Path, text: str) -> dict[str, bytes]:
    """Return the text of a scenario, and its map and catalogue files, by name."""
    found = {"scenario.yaml" if str(scenario) == STDIN else scenario.name: text.encode()}
    for name, path in _referenced(text, scenario.parent, [*found]):
        if path.is_file():
            found[name] = path.read_bytes()
    return found


def _referenced(text: str, folder: Path, taken: list[str]) -> Iterator[tuple[str, Path]]:
    for path in referenced_files(root_of(text), folder):
        name = path.name
        while name in taken:  # a file of that name from another folder
            name = f"_{name}"
        taken.append(name)
        yield name, path


def difference(sources: Mapping[str, bytes], header: Header) -> str | None:
    """Return how the scenario of a trace's header differs from its source; None if it does not.
    What a run adds is not compared: the truths of obstacles, and another seed or clock."""
    truths = [replace(each, traversable=None) for each in header.scenario.obstacles]
    traced = replace(header.scenario, world="external", obstacles=tuple(truths))
    told = None
    for name, data in sources.items():
        try:
            read = _read_again(name, data.decode(), sources, header)
        except (InputError, ValueError):
            continue  # a catalogue, or a map
        told = next(_differences(plain(read), plain(traced)), None)
        if told is None:
            return None
    return told or "no file in it is a scenario"


def _read_again(
    name: str, text: str, sources: Mapping[str, bytes], header: Header
) -> ScenarioHeader:
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder) / FOLDER
        here.mkdir(parents=True)
        for _ in range(2):  # a map in the format of ROS names its image
            for kept, path in _referenced(text, here, [name]):
                inside = Path(folder).resolve() in path.resolve().parents
                if inside and kept in sources and not path.exists():
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_bytes(sources[kept])
        scenario = load_scenario_text(text, str(here / name))
    scenario = replace(scenario, seed=header.scenario.seed)
    return scenario_header(scenario, None, live=header.clock is not None)


def _differences(one: Any, other: Any, where: str = "") -> Iterator[str]:
    """Yield where two values differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted(one.keys() | other.keys()):
            yield from _differences(one.get(key), other.get(key), f"{where}.{key}".strip("."))
    elif one != other:
        yield where
