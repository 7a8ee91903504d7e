"""The state of the installation, as ``safenav doctor`` reports it."""

import os
import platform
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from msgspec import Struct

import safenav
from safenav.errors import SafenavError, Verdict, install_command, requirements
from safenav.spec.specification import read_specification
from safenav.synthesis.cache import VARIABLE as CACHE_VARIABLE
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import VARIABLE as SLUGS_VARIABLE
from safenav.synthesis.program import find_binary
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure

PURPOSES = {
    "maps": "maps from files",
    "pictures": "PNG pictures and GIFs",
    "motion": "motion in metres and 3D pages",
    "mcap": "runs as MCAP files for Foxglove and ROS 2",
    "dask": "batches on a cluster",
    "ros2": "robots with ROS 2",
    "simulation": "robots in a physics simulation",
}
"""The extras that commands need. safenav's metadata lists their packages."""

_ANSWER_SECONDS = 10.0


class InstallationFinding(Struct, frozen=True):
    """A line of the report. ``good``: None for a note about an optional part."""

    good: bool | None
    subject: str
    text: str


def examine() -> Iterator[InstallationFinding]:
    """Examine packages, synthesizer and cache: run two syntheses, and create and remove an empty
    file in the cache directory. Scenarios can run unless a finding is bad."""
    location = Path(safenav.__file__).parent
    yield InstallationFinding(True, "safenav", f"{safenav.__version__} in {location}")
    system = f"{platform.python_version()} ({sys.executable}) on {platform.platform()}"
    yield InstallationFinding(True, "Python", system)
    seen = set[str]()
    for extra in ("", *PURPOSES):
        for name in map(project, requirements(extra)):
            if name not in seen:
                seen.add(name)
                yield _package(name, extra)
    yield from _synthesizer()
    yield _cache()


def project(requirement: str) -> str:
    """Return the name of the package in a requirement."""
    found = re.match(r"[\w.-]+", requirement)
    return found[0] if found else requirement


def _package(name: str, extra: str) -> InstallationFinding:
    try:
        return InstallationFinding(True, name, metadata.version(name))
    except metadata.PackageNotFoundError:
        advice = install_command(extra)
    if not extra:
        return InstallationFinding(False, name, f"missing: {advice}")
    return InstallationFinding(None, name, f"not installed; for {PURPOSES[extra]}: {advice}")


def _synthesizer() -> Iterator[InstallationFinding]:
    try:
        binary = find_binary()
    except SafenavError as error:
        yield InstallationFinding(False, "slugs", str(error))
        return
    by = SLUGS_VARIABLE if os.environ.get(SLUGS_VARIABLE) else "came with safenav"
    yield InstallationFinding(True, "slugs", f"{binary} ({by})")
    begun = time.monotonic()
    problem = _wrong_answer(binary)
    good = f"synthesizes; its strategy passes the check ({time.monotonic() - begun:.2f} s)"
    yield InstallationFinding(problem is None, "slugs", problem or good)


def _wrong_answer(binary: Path) -> str | None:
    """Return the synthesizer's error on two tiny specifications; None if both are correct."""
    synthesizer = Synthesizer(
        binary, seconds=_ANSWER_SECONDS, cache=Cache(None), verifier=first_failure
    )
    for formula, expected in (("b' <-> a", Verdict.REALIZABLE), ("a'", Verdict.UNREALIZABLE)):
        text = f"[INPUT]\na\n[OUTPUT]\nb\n[SYS_TRANS]\n{formula}\n"
        spec = read_specification(text, "doctor", "doctor")
        try:
            verdict = synthesizer.synthesize(spec).verdict
        except SafenavError as error:
            return str(error)
        if verdict is not expected:
            return f"it reports {verdict.value} for a specification that is {expected.value}"
    return None


def _cache() -> InstallationFinding:
    by = CACHE_VARIABLE if os.environ.get(CACHE_VARIABLE) else "default"
    directory = Cache.from_environment().directory
    if directory is None:
        return InstallationFinding(None, "cache", f"off ({by})")
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=directory, prefix=".doctor-"):
            pass
        sizes = [path.stat().st_size for path in directory.glob("??/*.answer")]
    except OSError as error:
        problem = f"not writable: {error.strerror or error}"
        return InstallationFinding(None, "cache", f"{directory} ({problem})")
    used = f"{len(sizes)} results, {sum(sizes) / 2**20:.1f} MiB"
    return InstallationFinding(True, "cache", f"{directory} (writable, {used}; {by})")
