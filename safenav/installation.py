"""State of the installation, which ``safenav doctor`` reports."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

from msgspec import Struct, to_builtins

import safenav
from safenav.errors import SafenavError
from safenav.extras import install_command, project, requirements
from safenav.outcome import Verdict
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
)
from safenav.synthesis.binary import VARIABLE as SLUGS_VARIABLE
from safenav.synthesis.binary import Binary, find_binary
from safenav.synthesis.cache import VARIABLE as CACHE_VARIABLE
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure

PURPOSES = {
    "maps": "maps from files",
    "pictures": "PNG pictures and GIFs",
    "motion": "motion in metres and 3D pages",
    "mcap": "runs as MCAP files for Foxglove and ROS 2",
    "studio": "the studio and live runs",
    "dask": "batches on a cluster",
    "ros2": "robots with ROS 2",
    "simulation": "robots in a physics simulation",
}
"""The extras that commands need. Their packages are those of safenav's own metadata."""

_ANSWER_SECONDS = 10.0


class Package(Struct, frozen=True):
    """A Python package. ``version``: None if it is not installed; ``extra``: None if it is
    required."""

    name: str
    version: str | None
    extra: str | None = None
    purpose: str = ""


class SlugsHealth(Struct, frozen=True):
    """State of the synthesizer. ``version``: None for a binary that is not safenav's own;
    ``problem``: why it cannot be used."""

    path: str | None
    chosen_by: str
    version: str | None
    seconds: float | None
    problem: str | None


class CacheHealth(Struct, frozen=True):
    """State of the synthesis cache. ``directory``: None if the cache is off."""

    directory: str | None
    chosen_by: str
    entries: int
    bytes: int
    problem: str | None


class Installation(Struct, frozen=True):
    safenav: str
    location: str
    python: str
    platform: str
    packages: tuple[Package, ...]
    slugs: SlugsHealth
    cache: CacheHealth

    @property
    def usable(self) -> bool:
        """Whether scenarios can be run at all."""
        missing = [p for p in self.packages if p.extra is None and p.version is None]
        return not missing and self.slugs.problem is None

    def data(self) -> dict[str, Any]:
        """Return all findings as JSON data."""
        return {"usable": self.usable, **to_builtins(self)}

    def lines(self) -> Iterator[tuple[bool | None, str, str]]:
        """Yield each finding as text: whether it is good (None: a note about something optional),
        its subject, and what was found."""
        yield True, "safenav", f"{self.safenav} in {self.location}"
        yield True, "Python", f"{self.python} on {self.platform}"
        for package in self.packages:
            if package.version is not None:
                yield True, package.name, package.version
            elif package.extra is None:
                yield False, package.name, f"missing: {install_command()}"
            else:
                advice = f"for {package.purpose}: {install_command(package.extra)}"
                yield None, package.name, f"not installed; {advice}"
        slugs, cache = self.slugs, self.cache
        if slugs.path is not None:
            version = slugs.version or "not safenav's own"
            yield True, "slugs", f"{version}, {slugs.path} ({slugs.chosen_by})"
        if slugs.problem is not None:
            yield False, "slugs", slugs.problem
        else:
            yield (
                True,
                "slugs",
                f"synthesizes; its strategy passes the check ({slugs.seconds:.2f} s)",
            )
        if cache.directory is None:
            yield None, "cache", f"off ({cache.chosen_by})"
        else:
            used = f"{cache.entries} results, {cache.bytes / 2**20:.1f} MiB"
            state = cache.problem or f"writable, {used}"
            yield cache.problem is None or None, "cache", f"{cache.directory} ({state})"


def examine() -> Installation:
    """Examine packages, synthesizer and cache. Runs two syntheses, and creates and removes an empty
    file in the cache directory."""
    packages: dict[str, Package] = {}
    for extra in (None, *PURPOSES):
        for name in map(project, requirements(extra or "")):
            purpose = PURPOSES.get(extra or "", "")
            packages.setdefault(name, Package(name, _version(name), extra, purpose))
    return Installation(
        safenav.__version__,
        str(Path(safenav.__file__).parent),
        f"{platform.python_version()} ({sys.executable})",
        platform.platform(),
        tuple(packages.values()),
        _slugs(),
        _cache(),
    )


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _slugs() -> SlugsHealth:
    by = SLUGS_VARIABLE if os.environ.get(SLUGS_VARIABLE) else "came with safenav"
    try:
        binary = find_binary()
    except SafenavError as error:
        return SlugsHealth(None, by, None, None, str(error))
    begun = time.monotonic()
    problem = _wrong_answer(binary)
    seconds = None if problem else round(time.monotonic() - begun, 3)
    return SlugsHealth(str(binary.path), by, binary.version, seconds, problem)


def _wrong_answer(binary: Binary) -> str | None:
    """Return the error of the synthesizer on two tiny specifications; None if it is correct."""
    synthesizer = Synthesizer(
        binary, seconds=_ANSWER_SECONDS, cache=Cache.off(), verifier=first_failure
    )
    for formula, expected in (("b' <-> a", Verdict.REALIZABLE), ("a'", Verdict.UNREALIZABLE)):
        try:
            verdict = synthesizer.synthesize(_tiny(formula)).verdict
        except SafenavError as error:
            return str(error)
        if verdict is not expected:
            return f"it reports {verdict.value} for a specification that is {expected.value}"
    return None


def _tiny(formula: str) -> Specification:
    """Return a specification with one input, one output and one guarantee."""
    rule = Constraint(
        Section.SYS_TRANS, formula, Origin("doctor", "a specification with a known verdict")
    )
    variables = (Variable("a", Owner.INPUT), Variable("b", Owner.OUTPUT))
    return Specification("doctor", "whether the synthesizer works", variables, (rule,))


def _cache() -> CacheHealth:
    by = CACHE_VARIABLE if os.environ.get(CACHE_VARIABLE) else "default"
    directory = Cache.from_environment().directory
    if directory is None:
        return CacheHealth(None, by, 0, 0, None)
    problem = None
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=directory, prefix=".doctor-"):
            pass
    except OSError as error:
        problem = f"not writable: {error.strerror or error}"
    sizes = []
    try:
        sizes = [path.stat().st_size for path in directory.glob("??/*.answer")]
    except OSError as error:
        problem = problem or f"not readable: {error.strerror or error}"
    return CacheHealth(str(directory), by, len(sizes), sum(sizes), problem)
