"""The verdict on a bundle, by its checker and a comparison with its source."""

import dataclasses
import tempfile
from collections.abc import Mapping
from html import escape
from os.path import commonpath, dirname, normpath
from pathlib import Path
from string import Template
from typing import Any

from msgspec.structs import replace

from safenav.errors import InputError
from safenav.judge.bundle.check import SOURCE, UNCOMPARED, Judged, check, open_bundle
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.yaml.findings import STDIN, referenced_files, root_of
from safenav.trace.fields import plain
from safenav.trace.file import Trace, read_bytes
from safenav.trace.records import Header


def check_bundle(bundle: str | Path) -> Judged:
    """Return the verdict on a bundle by the installed checker (not the bundle's copy) and by a
    comparison of the trace with its source in the bundle."""
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
    except (OSError, ValueError):  # duplicate names of one place, or an impossible name
        return Judged("refused", "the source has files that cannot be written")
    if told is not None:
        return Judged("refused", f"the source is not the scenario of the trace: {told}")
    left = [each for each in found.not_compared if each != UNCOMPARED[SOURCE]]
    return dataclasses.replace(found, not_compared=left)


def sources_of(scenario: Path, text: str) -> dict[str, bytes]:
    """Return the text of a scenario, and of the map and catalogue files that it reads, by their
    paths relative to their deepest common folder."""
    own = Path("scenario.yaml" if str(scenario) == STDIN else scenario).absolute()
    named = [path for path in referenced_files(root_of(text), own.parent) if path.is_file()]
    found = {normpath(path): path.read_bytes() for path in named} | {normpath(own): text.encode()}
    folder = commonpath(map(dirname, found))
    return {Path(path).relative_to(folder).as_posix(): data for path, data in found.items()}


def difference(sources: Mapping[str, bytes], header: Header) -> str | None:
    """Return, in words, the first difference between the scenario in a trace's header and its
    source; None if there is none. Both have the seed and clock of the run."""
    told, traced = "no file in it is a scenario", header.scenario
    with tempfile.TemporaryDirectory() as folder:
        files = {normpath(Path(folder, name)): data for name, data in sources.items()}
        for path, data in files.items():
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            Path(path).write_bytes(data)
        for path, data in files.items():
            try:
                scenario = load_scenario_text(text := data.decode(), path).recorded
            except (InputError, ValueError):
                continue  # a catalogue or a map
            read = replace(scenario, seed=traced.seed, clock=traced.clock)
            one, other = plain(read), plain(traced)
            wrong = [k for k in sorted(one.keys() | other.keys()) if one.get(k) != other.get(k)]
            used = [path, *map(normpath, referenced_files(root_of(text), Path(path).parent))]
            # A bundle keeps only the last parts of an absolute path, such as /home/ann/map.yaml.
            unused = [n for n in sorted(sources) if not any(one.endswith(f"/{n}") for one in used)]
            if not (wrong or unused):
                return None
            told = wrong[0] if wrong else f"the scenario does not use {unused[0]}"
    return told


_PAGE = Path(__file__).with_name("page.html")


def page_of(trace: Trace, verdict: Judged) -> str:
    """Return the page of a bundle, which shows its trace and the checker's verdict."""
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
