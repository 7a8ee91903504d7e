"""Writing of a bundle: the files of a run with their evidence (layout: docs/certificates.md)."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from msgspec import Struct

import safenav
import safenav.audit
from safenav import line_values, strict_json
from safenav.certify.check import Acceptance, BundleVerdict, check_bundle
from safenav.certify.evidence import RulesEvidence, counter_evidence, strategy_measures
from safenav.certify.page import page_of
from safenav.certify.run import Kept, read_lines
from safenav.errors import FULL_DISK, NotCertifiedError, ResourceLimitError, UsageError
from safenav.lines import json_line
from safenav.outcome import Verdict
from safenav.spec.assignable import may_leave
from safenav.spec.parsing import read_specification
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.measures import NoMeasureError

CHECKER = Path(__file__).parent / "checker"


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
    kept: Kept,
    synthesizer: Synthesizer,
    motion: bytes | None = None,
) -> Made:
    """Write the bundle of a run to ``target``, a folder or a name that ends in .zip.

    ``sources``: the scenario's YAML, map and catalogue files by name. ``kept``: texts and
    strategies of all ``synthesis`` lines (see ``Kept.complete``). ``motion``: the run in metres.

    Raises UsageError if the target exists or the disk is full, NotCertifiedError if a checker
    refuses the bundle, ResourceLimitError if a strategy is larger than the checker takes on."""
    if target.exists():
        raise UsageError(f"{target} exists; name a bundle that does not")
    with (
        _disk(target),
        tempfile.TemporaryDirectory(dir=_parent(target), prefix=".bundle-") as directory,
    ):
        folder = Path(directory) / "bundle"
        files = files_of_run(trace, sources, kept, synthesizer)
        if motion is not None:
            files["motion.jsonl"] = motion
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
        manifest = _manifest(files, [])
        _write_manifest(folder, manifest)
        verdict = check_bundle(folder, compare=False)
        if verdict.result is Acceptance.TOO_LARGE:
            raise ResourceLimitError(f"no bundle: {verdict.reason}")
        if not verdict.accepted:
            raise NotCertifiedError(f"the checker refuses this run: {verdict.reason}")
        page = page_of(read_lines(trace, "trace.jsonl"), verdict.claims, files).encode()
        files["index.html"] = page
        (folder / "index.html").write_bytes(page)
        _write_manifest(folder, _manifest(files, [dict(claim) for claim in verdict.claims]))
        if target.suffix == ".zip":
            _pack(folder, Path(directory) / "bundle.zip")
            (Path(directory) / "bundle.zip").replace(target)
        else:
            shutil.move(folder, target)
    return Made(target, verdict, len(files) + 1, sum(map(len, files.values())))


@contextmanager
def _disk(target: Path) -> Iterator[None]:
    """Report a full disk as an error of the target."""
    try:
        yield
    except OSError as error:
        if error.errno not in FULL_DISK:
            raise
        raise UsageError(f"cannot write {target}: {error.strerror}") from error


def _parent(target: Path) -> Path:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{target} cannot be written: {error.strerror}") from error
    return target.parent


def files_of_run(
    trace: bytes, sources: Mapping[str, bytes], kept: Kept, synthesizer: Synthesizer
) -> dict[str, bytes]:
    """Return all files except the page and the manifest."""
    lines = read_lines(trace, "trace.jsonl")
    files = {
        "scenario.json": _json(lines[0]["scenario"]),
        "trace.jsonl": trace,
        **{f"source/{name}": data for name, data in sources.items()},
        **programs(),
    }
    rules = RulesEvidence(lines[0])
    for line in lines:
        if line["type"] != "synthesis":
            continue
        spec, strategy = line["spec"], line.get("strategy")
        text = kept.texts[spec]
        files[f"specs/{spec}.structuredslugs"] = text.encode()
        if strategy is not None:
            files[f"strategies/{strategy}.json"] = kept.strategies[strategy]
            name = f"measures/{spec}-{strategy}.json"
            if name not in files:
                files[name] = _json(strategy_measures(text, kept.strategies[strategy]))
            name = rules.name(line)
            if name not in files and line.get("node") is not None:
                found = rules.measures(line, text, kept.strategies[strategy])
                files |= {name: _json(found)} if found is not None else {}
        failed = [tried["spec"] for tried in line.get("tried") or ()]
        failed += [spec] if line["verdict"] == "unrealizable" else []
        for spec in failed:
            name = f"counterstrategies/{spec}.json"
            if name in files or spec not in kept.texts:
                continue
            beaten = _counterstrategy(kept.texts[spec], line["robot"], synthesizer)
            if beaten is not None:
                files[f"specs/{spec}.structuredslugs"] = kept.texts[spec].encode()
                files[name] = beaten
        name = f"counterstrategies/{line['spec']}.json"
        if line["verdict"] == "unrealizable" and name in files:
            proof = json.loads(files[name])
            found = rules.measures(line, text, json.dumps(proof["automaton"]).encode(), proof)
            files |= {rules.name(line): _json(found)} if found is not None else {}
    return files


def programs() -> dict[str, bytes]:
    """Return the files of the checker in a bundle: its programs, and the rules of a run in
    ``audit``."""
    audit = Path(safenav.audit.__file__).parent
    found = {path.name: path for path in sorted(CHECKER.glob("check*.py"))}
    for path in sorted(audit.rglob("*.py")):
        name = path.relative_to(audit).as_posix()
        found |= {f"audit/{name}": path} if name != "check.py" else {}  # it needs safenav's reader
    found["check_json.py"] = Path(strict_json.__file__)
    found["check_values.py"] = Path(line_values.__file__)
    own = {"safenav.certify.checker.": "", "safenav.audit": "audit"}
    own |= {"safenav.strict_json": "check_json", "safenav.line_values": "check_values"}
    texts = {name: path.read_text() for name, path in found.items()}
    for before, after in own.items():
        texts = {name: text.replace(before, after) for name, text in texts.items()}
    return {name: text.encode() for name, text in texts.items()}


def _counterstrategy(text: str, robot: str, synthesizer: Synthesizer) -> bytes | None:
    """Return the proof that a specification is unrealizable; None if no proof is possible within
    the limits. It also defeats robots that leave permanently, if possible: by the rules of the
    scenario they may."""
    spec = read_specification(text, robot=robot)
    for wider in dict.fromkeys((may_leave(spec), spec)):
        answer = synthesizer.counterstrategy(wider)
        if answer.strategy_json is None or answer.verdict is not Verdict.UNREALIZABLE:
            continue
        try:
            replies = wider.to_structuredslugs()
            evidence = counter_evidence(text, answer.strategy_json, replies)
        except (NoMeasureError, LookupError, ResourceLimitError):
            return None
        return _json({"automaton": json.loads(answer.strategy_json), **evidence})
    return None


def _json(data: Any) -> bytes:
    return json_line(data).encode()


def _manifest(files: Mapping[str, bytes], claims: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "format": "safenav-bundle",
        "version": 4,
        "made_by": {
            "safenav": safenav.__version__,
            "python": platform.python_version(),
            "networkx": importlib.metadata.version("networkx"),
            "platform": sys.platform,
        },
        "files": {
            name: {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for name, data in sorted(files.items())
        },
        "claims": claims,
    }


def _write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")


def _pack(folder: Path, archive: Path) -> None:
    """Write a .zip whose bytes depend only on the files."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            name = zipfile.ZipInfo(path.relative_to(folder).as_posix(), (1980, 1, 1, 0, 0, 0))
            name.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(name, path.read_bytes())
