"""Creation of a bundle from a scenario, or from the trace of an earlier run."""

from __future__ import annotations

import tempfile
from pathlib import Path

from msgspec.structs import replace

from safenav.certify.bundle import Made, make_bundle
from safenav.certify.sources import sources_of
from safenav.errors import NotCertifiedError, UsageError
from safenav.lines import read_file
from safenav.runtime.run.mission import Mission, default_synthesizer, uninterrupted
from safenav.scenario.reading.loader import load_scenario_text, scenario_text
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.reading import read_bytes
from safenav.trace.writing import TraceWriter
from safenav.verify.verification import first_failure


def bundle_of_run(
    scenario: Path,
    target: Path,
    *,
    seed: int | None = None,
    motion: bool = False,
) -> Made:
    """Run a scenario and write its bundle, with its ``motion`` in metres if wanted. ``seed``:
    replaces that of the scenario.

    Raises UsageError for bad input, NotCertifiedError if a checker refuses the run.
    """
    text = scenario_text(scenario)
    plan = load_scenario_text(text, str(scenario))
    if seed is not None:
        plan = replace(plan, seed=seed)
    with tempfile.TemporaryDirectory() as directory:
        cache = Cache.from_environment()
        if not cache.usable:
            cache = Cache(Path(directory) / "cache")
        synthesizer = default_synthesizer(plan, cache=cache)
        trace = Path(directory) / "trace.jsonl"
        with TraceWriter(trace) as writer:
            uninterrupted(Mission(plan, synthesizer, listeners=[writer]).run())
        data = trace.read_bytes()
        moved = motion_made(data) if motion else None
        sources = sources_of(scenario, text)
        return make_bundle(target, data, sources, synthesizer, moved)


def bundle_of_trace(trace: Path, target: Path, motion: Path | None = None) -> Made:
    """Write the bundle of an earlier run from its trace, the cache, and its motion file, if any.

    Raises InputError if it is not a trace, UsageError if a part is missing, NotCertifiedError if
    the run or its motion is refused.
    """
    try:
        data = read_file(trace)
    except OSError as error:
        raise UsageError(f"{trace} cannot be read: {error.strerror}") from error
    read_bytes(data, str(trace))
    synthesizer = Synthesizer(cache=Cache.from_environment(), verifier=first_failure)
    moved = None if motion is None else motion_checked(motion, data, trace.name)
    return make_bundle(target, data, {}, synthesizer, moved)


def motion_made(trace: bytes) -> bytes:
    """Return the motion file of a run, computed by its robots' models."""
    # Imported here and below: motion needs numpy, which a batch must do without.
    from safenav.motion.file import text_of
    from safenav.motion.making import motion_of

    return text_of(motion_of(read_bytes(trace))).encode()


def motion_checked(motion: Path, trace: bytes, name: str) -> bytes:
    """Return a motion file. Raises NotCertifiedError if it breaks a rule of motion."""
    from safenav.motion.check.verdict import check_motion
    from safenav.motion.file import read_motion

    found = check_motion(read_motion(motion), read_bytes(trace, name))
    if found:
        raise NotCertifiedError(f"{motion} is not a motion of this run: {found[0]}")
    return motion.read_bytes()
