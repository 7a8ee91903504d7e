"""Bundles of real scenarios for tests, each made once, and the checker as a reviewer runs it."""

import hashlib
import io
import json
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from children import ran
from once import ROOT, SCENARIOS, from_yaml, made_once
from runtime.played import whole
from safenav.certify.bundle import bundle_of_run, programs, proofs_of, write_files
from safenav.judge.bundle import check as checker
from support.damage import Line, text

Files = dict[str, bytes]
"""A bundle as data: content by name, without the manifest."""
TEXTS: dict[str, str] = from_yaml(Path(__file__).with_name("scenarios.yaml").read_text())


@cache
def bundle_at(name: str, text: str) -> Path:
    """The bundle of the run of a scenario that is given as text; not to be changed."""

    def make(folder: Path) -> None:
        scenario = folder / f"{name}.yaml"
        scenario.write_text(whole(text).replace("ROOT", str(ROOT)))
        bundle_of_run(scenario.read_text(), scenario, folder / name)

    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    return made_once(f"bundle of {name} {digest}", make) / name


@cache
def shipped(name: str) -> Path:
    """The bundle of a scenario of ``scenarios.yaml`` or of a shipped one."""
    if name in TEXTS:
        return bundle_at(name.replace(" ", "_"), f"name: {name}\n{TEXTS[name]}")
    return bundle_at(Path(name).name, (SCENARIOS / f"{name}.yaml").read_text())


def files_of(bundle: Path) -> Files:
    found = (path for path in bundle.rglob("*") if path.is_file())
    files = {path.relative_to(bundle).as_posix(): path.read_bytes() for path in found}
    del files["manifest.json"]
    return files


def with_proofs(files: Files) -> Files:
    """Return the files with just the proofs that lines name, as good as a forger can get them."""

    def automata(line: Any) -> Iterator[bytes]:
        if line.verdict == "realizable":
            name = f"strategies/{line.strategy}.json"
            yield from (files[n] for n in files if n == name)
            return
        proofs = (json.loads(data) for name, data in files.items() if name.startswith("proofs/"))
        yield from (json.dumps(p["automaton"]).encode() for p in proofs if "automaton" in p)

    try:
        found = proofs_of(files["trace.jsonl"], automata)
    except Exception:  # an unreadable trace has no proofs
        return files
    kept = {n: d for n, d in files.items() if not n.startswith(("proofs/", "strategies/"))}
    return kept | {name: files.get(name, data) for name, data in found.items()}


def lines_of(files: Files) -> list[Line]:
    return [json.loads(line) for line in files["trace.jsonl"].splitlines()]


def with_lines(files: Files, lines: list[Line]) -> Files:
    """Return the files with another trace."""
    return {**files, "trace.jsonl": "".join(f"{one}\n" for one in text(lines)).encode()}


def rewrite(files: Files, target: Path, *, prove: bool = True) -> Path:
    """A bundle with these files whose manifest, and proofs, were repaired."""
    write_files(target, with_proofs(files) if prove else files)
    return target


def certified(text: str) -> str:
    """Return the checker's result for the bundle of a scenario's run, which it accepts."""
    status, said = judged(bundle_at("plan", text))
    assert status == 0, said
    return said


def run_checker(bundle: Path, program: Path | None = None) -> tuple[int, str]:
    """Exit status and output of the checker (default: the bundle's own copy)."""
    program = program or bundle / "check.py"
    done = ran([sys.executable, "-I", "-S", str(program), str(bundle)], cwd="/", env={})
    return done.returncode, done.stdout + done.stderr


def judged(bundle: Path) -> tuple[int, str]:
    """The same of a bundle whose copy is this tree's checker, without a process of its own."""
    assert all((bundle / name).read_bytes() == text for name, text in programs().items())
    with redirect_stdout(io.TextIOWrapper(io.BytesIO(), "utf-8")) as out:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["check.py", str(bundle)])
            status = checker.main()
        out.flush()
        return status, out.buffer.getvalue().decode()  # type: ignore[attr-defined]
