"""Verdict on a bundle: that of its checker, and a comparison with its source."""

import dataclasses
import tempfile
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from msgspec.structs import replace

from safenav.errors import InputError
from safenav.judge.bundle.check import SOURCE, UNCOMPARED, Judged, check, open_bundle
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.yaml.findings import STDIN, referenced_files, root_of
from safenav.trace.fields import plain
from safenav.trace.file import Trace, read_bytes
from safenav.trace.records import Header


def check_bundle(bundle: str | Path) -> Judged:
    """Check a bundle with the installed checker (not the copy in the bundle), and read its source
    again."""
    bundle = Path(bundle)
    found = check(bundle)
    files = open_bundle(bundle) if found.accepted else {}
    kept = {n.partition("/")[2]: f.read_bytes() for n, f in files.items() if n.startswith(SOURCE)}
    if not kept:
        return found
    first = files["trace.jsonl"].read_bytes().splitlines()[0]
    try:
        told = difference(kept, read_bytes(first).header)
    except InputError as error:  # invalid in a field that the checker ignores
        return Judged("refused", f"trace.jsonl: {error.diagnostics[0].found}")
    if told is not None:
        return Judged("refused", f"the source is not the scenario of the trace: {told}")
    left = [each for each in found.not_compared if each != UNCOMPARED[SOURCE]]
    return dataclasses.replace(found, not_compared=left)


FOLDER = Path("a/b/c/d")
"""Folder in which a scenario is read again, so deep that its files may be in folders above."""


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
        while name in taken:  # another folder has a file of this name
            name = f"_{name}"
        taken.append(name)
        yield name, path


def difference(sources: Mapping[str, bytes], header: Header) -> str | None:
    """Return the first difference between the scenario in a trace's header and its source, or None.
    The seed and the clock are those of the run."""
    told = "no file in it is a scenario"
    for name, data in sources.items():
        try:
            read, used = _read_again(name, data.decode(), sources, header.scenario)
        except (InputError, ValueError):
            continue  # a catalogue, or a map
        one, other = plain(read), plain(header.scenario)
        wrong = [key for key in sorted(one.keys() | other.keys()) if one.get(key) != other.get(key)]
        if not wrong and sources.keys() <= used:
            return None
        told = wrong[0] if wrong else f"the scenario does not use {min(sources.keys() - used)}"
    return told


def _read_again(
    name: str, text: str, sources: Mapping[str, bytes], traced: Scenario
) -> tuple[Scenario, set[str]]:
    """Return the scenario of a file, and the names of all files that it uses."""
    used = {name}
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder) / FOLDER
        here.mkdir(parents=True)
        for _ in range(2):  # the second pass: a map of ROS names its image
            for kept, path in _referenced(text, here, [name]):
                used.add(kept)
                inside = Path(folder).resolve() in path.resolve().parents
                if inside and kept in sources and not path.exists():
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_bytes(sources[kept])
        scenario = load_scenario_text(text, str(here / name))
    return replace(scenario.recorded, seed=traced.seed, clock=traced.clock), used


_PAGE = Path(__file__).with_name("page.html")


def page_of(trace: Trace, verdict: Judged) -> str:
    """Return the page of a bundle, of its trace and the checker's verdict."""
    end = trace.outcome
    outcome = "unfinished" if end is None else end.outcome.value
    why = "the trace ends before the run does" if end is None else end.explanation
    return Template(_PAGE.read_text()).substitute(
        name=escape(trace.header.scenario.name),
        outcome=outcome,
        ending=outcome.replace("_", " "),
        why=escape(why[:1].upper() + why[1:].rstrip(".")),
        claims="\n".join(map(_claim, verdict.claims)),
        left="\n".join(f"<li>Not compared: {escape(what)}.</li>" for what in verdict.not_compared),
    )


def _claim(claim: Mapping[str, Any]) -> str:
    links = ", ".join(
        f'<a href="{escape(path)}">{escape(path)}{f", line {line}" if line else ""}</a>'
        for path, line in claim["evidence"]
    )
    about = f"{escape(claim['text'])} <small>{links}</small>"
    return f'<li id="{escape(claim["id"])}">{about}</li>'
