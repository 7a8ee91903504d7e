"""From a scenario, or from the trace of an earlier run, to a bundle."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import yaml

from safenav.certify.bundle import Made, make_bundle
from safenav.certify.run import Kept, read_lines
from safenav.errors import UsageError
from safenav.runtime.mission import Mission, default_synthesizer
from safenav.scenario.model import Controllers
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.writing import TraceWriter
from safenav.verify.verification import first_failure


def bundle_of_run(scenario: Path, target: Path, *, seed: int | None = None) -> Made:
    """Run a scenario and write the bundle of that run.

    Raises UsageError for bad input, NotCertifiedError if the checker refuses the run.
    """
    plan = load_scenario(scenario)
    if plan.controllers is Controllers.ON_DEMAND:
        raise UsageError(
            f"{scenario}: 'controllers: on_demand' lists no strategies, and a certificate is about "
            "listed ones; certify it with 'controllers: listed'"
        )
    if seed is not None:
        plan = replace(plan, seed=seed)
    with tempfile.TemporaryDirectory() as directory:
        cache = Cache.from_environment()
        if cache.directory is None:
            cache = Cache(Path(directory) / "cache")
        synthesizer, kept = default_synthesizer(plan, cache=cache), Kept()
        trace = Path(directory) / "trace.jsonl"
        with TraceWriter(trace) as writer:
            Mission(plan, synthesizer, listeners=[writer], progress=kept).run()
        data = trace.read_bytes()
        kept.complete(syntheses_of(data, scenario.name), cache, synthesizer)
        return make_bundle(target, data, sources_of(scenario), kept, synthesizer)


def bundle_of_trace(trace: Path, target: Path) -> Made:
    """Write the bundle of an earlier run, from its trace and what the cache has kept.

    Raises UsageError if a part is gone, NotCertifiedError if the checker refuses the run.
    """
    try:
        data = trace.read_bytes()
    except OSError as error:
        raise UsageError(f"{trace} cannot be read: {error.strerror}") from error
    cache, kept = Cache.from_environment(), Kept()
    synthesizer = Synthesizer(cache=cache, verifier=first_failure)
    kept.complete(syntheses_of(data, trace.name), cache, synthesizer)
    return make_bundle(target, data, {}, kept, synthesizer)


def syntheses_of(trace: bytes, name: str) -> list[dict[str, object]]:
    """The ``synthesis`` lines of a trace."""
    return [line for line in read_lines(trace, name) if line["type"] == "synthesis"]


def sources_of(scenario: Path) -> dict[str, bytes]:
    """The scenario's file, and the files that it names for its map and its catalogue."""
    text = scenario.read_bytes()
    found = {scenario.name: text}
    queue = [(scenario, yaml.safe_load(text))]
    for place, document in queue:
        for value in _named_files(document):
            path = place.parent / value
            name = path.name
            if path.is_file() and name not in found:
                found[name] = path.read_bytes()
                if path.suffix in (".yaml", ".yml"):
                    queue.append((path, yaml.safe_load(found[name])))
    return found


def _named_files(document: object) -> list[str]:
    """The file names in a document: of the map (or of a ROS map's image) and of the catalogue."""
    if not isinstance(document, dict):
        return []
    section = document.get("map")
    places = [document, section if isinstance(section, dict) else {}]
    keys = ("image", "ros", "movingai", "catalogue")
    return [v for place in places for k in keys if isinstance(v := place.get(k), str)]
