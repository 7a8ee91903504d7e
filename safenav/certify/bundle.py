"""Writing of a bundle: the files of a run with their evidence (layout: docs/bundle.md)."""

from __future__ import annotations

import hashlib
import json
import platform
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from msgspec import Struct

import safenav
import safenav.judge
from safenav import line_values, strict_json
from safenav.certify.check import Acceptance, BundleVerdict, check_bundle
from safenav.certify.evidence import proofs_of
from safenav.certify.page import page_of
from safenav.errors import FULL_DISK, NotCertifiedError, ResourceLimitError, UsageError
from safenav.judge.bundle.check import VERSION
from safenav.outcome import Verdict
from safenav.spec.assignable import may_leave
from safenav.spec.specification import read_specification
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.reading import Trace, read_bytes
from safenav.trace.records import Synthesis


class Kept(Struct, frozen=True):
    """Strategies, and the specifications that need a counterstrategy, by the sha256 in the
    trace."""

    texts: dict[str, str] = {}
    strategies: dict[str, bytes] = {}


def kept_of(trace: Trace, synthesizer: Synthesizer) -> Kept:
    """Return the strategies of a trace's ``synthesis`` lines, and the specifications without one:
    by repeated synthesis, from the cache.

    Raises UsageError, which states what is missing, if that is not possible.
    """
    kept = Kept()
    for line in (line for line in trace.records if isinstance(line, Synthesis)):
        strategy = None if line.node is None else line.strategy
        missing = strategy is not None and strategy not in kept.strategies
        if not missing and line.verdict is not Verdict.UNREALIZABLE:
            continue
        text, again = synthesizer.cache.load_text(line.spec), "run the scenario again"
        about = f"of {line.robot} at tick {line.tick} ({(strategy or line.spec)[:12]})"
        if text is None:
            raise UsageError(
                f"the specification {about} is no longer in the cache; {again} with "
                "`safenav certify`"
            )
        kept.texts[line.spec] = text
        if strategy is not None and missing:
            spec = read_specification(text, robot=line.robot)
            data = synthesizer.synthesize(spec).strategy_json
            if data is None or hashlib.sha256(data).hexdigest() != strategy:
                raise UsageError(
                    f"the strategy {about} is no longer in the cache, and the installed "
                    f"synthesizer gives another one; {again} with `safenav certify`"
                )
            kept.strategies[strategy] = data
    return kept


class Made(Struct, frozen=True):
    """A bundle that was written, and the verdict of its own checker."""

    path: Path
    verdict: BundleVerdict
    files: int
    bytes: int


def make_bundle(
    target: Path,
    trace: bytes,
    sources: Mapping[str, bytes],
    synthesizer: Synthesizer,
    motion: bytes | None = None,
) -> Made:
    """Write the bundle of a run to ``target``, a folder or a name that ends in .zip.

    ``sources``: the scenario's YAML, map and catalogue files by name. ``synthesizer``: its cache
    has the strategies. ``motion``: the run in metres.

    Raises UsageError if the target exists, a strategy is missing or the disk is full,
    NotCertifiedError if a checker refuses the bundle, ResourceLimitError if a strategy is larger
    than the checker takes on."""
    if target.exists():
        raise UsageError(f"{target} exists; name a bundle that does not")
    read = read_bytes(trace)
    kept = kept_of(read, synthesizer)
    with _beside(target) as directory:
        folder = directory / "bundle"
        files = files_of_run(trace, sources, kept, synthesizer)
        if motion is not None:
            files["motion.jsonl"] = motion
        write_files(folder, files)
        verdict = check_bundle(folder)
        if verdict.result is Acceptance.TOO_LARGE:
            raise ResourceLimitError(f"no bundle: {verdict.reason}")
        if not verdict.accepted:
            raise NotCertifiedError(f"the checker refuses this run: {verdict.reason}")
        files["index.html"] = page_of(read, verdict, files).encode()
        write_files(folder, files)
        if target.suffix == ".zip":
            _pack(folder, directory / "bundle.zip")
            (directory / "bundle.zip").replace(target)
        else:
            shutil.move(folder, target)
    return Made(target, verdict, len(files) + 1, sum(map(len, files.values())))


@contextmanager
def _beside(target: Path) -> Iterator[Path]:
    """Yield a temporary folder beside the target. A full disk is an error of the target."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{target} cannot be written: {error.strerror}") from error
    try:
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".bundle-") as folder:
            yield Path(folder)
    except OSError as error:
        if error.errno not in FULL_DISK:
            raise
        raise UsageError(f"cannot write {target}: {error.strerror}") from error


def files_of_run(
    trace: bytes, sources: Mapping[str, bytes], kept: Kept, synthesizer: Synthesizer
) -> dict[str, bytes]:
    """Return all files except the page and the manifest."""

    def counters(spec: str, robot: str) -> Iterator[bytes]:
        """By the rules of the scenario robots may leave permanently; the specification may not let
        them. So a counterstrategy that also defeats that is the best one."""
        text = read_specification(kept.texts[spec], robot=robot)
        for wider in dict.fromkeys((may_leave(text), text)):
            answer = synthesizer.counterstrategy(wider)
            if answer.strategy_json is not None and answer.verdict is Verdict.UNREALIZABLE:
                yield answer.strategy_json

    return {
        "trace.jsonl": trace,
        **{f"source/{name}": data for name, data in sources.items()},
        **proofs_of(trace, kept.strategies, counters),
        **programs(),
    }


def programs() -> dict[str, bytes]:
    """Return the files of the checker in a bundle: ``check.py`` and the folder ``judge``."""
    judge = Path(safenav.judge.__file__).parent
    found = {f"judge/{path.relative_to(judge).as_posix()}": path for path in judge.rglob("*.py")}
    found["check.py"] = found.pop("judge/bundle/check.py")
    own = {"safenav.judge": "judge"}
    for module in (line_values, strict_json):
        name = module.__name__.rpartition(".")[2]
        found[f"judge/{name}.py"], own[module.__name__] = (
            Path(str(module.__file__)),
            f"judge.{name}",
        )
    texts = {name: found[name].read_text() for name in sorted(found)}
    for before, after in own.items():
        texts = {name: text.replace(before, after) for name, text in texts.items()}
    return {name: text.encode() for name, text in texts.items()}


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files and their manifest."""
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    manifest = {
        "format": "safenav-bundle",
        "version": VERSION,
        "made_by": {
            "safenav": safenav.__version__,
            "python": platform.python_version(),
            "platform": sys.platform,
        },
        "files": {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for name, data in sorted(files.items())
        },
    }
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def _pack(folder: Path, archive: Path) -> None:
    """Write a .zip whose bytes depend only on the files."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            name = zipfile.ZipInfo(path.relative_to(folder).as_posix(), (1980, 1, 1, 0, 0, 0))
            name.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(name, path.read_bytes())
