"""Running the checker as a reviewer would: separately, with only Python's standard library."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from safenav.certify.sources import difference
from safenav.errors import UsageError
from safenav.judge.bundle.check import SOURCE, UNCOMPARED, open_bundle
from safenav.synthesis.process import die_with_parent

ROOT = Path(__file__).parents[2]
PROGRAM = f"""
import sys
sys.dont_write_bytecode = True
sys.path.insert(0, {str(ROOT)!r})
from safenav.judge.bundle.check import main
sys.exit(main())
"""


class Acceptance(StrEnum):
    ACCEPTED = "accepted"
    REFUSED = "refused"
    TOO_LARGE = "too large"


class BundleVerdict(Struct, frozen=True):
    """Verdict of the checker: the claims that it has established, the reason if it refuses, and
    which parts it did not compare.

    A claim has ``id``, ``kind``, ``text`` and ``evidence``: pairs of a file and a line or None."""

    result: Acceptance
    reason: str
    claims: tuple[Mapping[str, Any], ...]
    not_compared: tuple[str, ...] = ()

    @property
    def accepted(self) -> bool:
        return self.result is Acceptance.ACCEPTED


_JUDGED = (0, 1, 3)


def check_bundle(bundle: Path) -> BundleVerdict:
    """Check a bundle with the installed checker (not the copy in the bundle), and read its source
    again. Raises UsageError if it is not a bundle."""
    command = [sys.executable, "-I", "-S", "-c", PROGRAM, str(bundle), "--json"]
    done = subprocess.run(die_with_parent(command), capture_output=True, text=True, check=False)
    if done.returncode not in _JUDGED:
        raise UsageError((done.stdout + done.stderr).strip().splitlines()[-1])
    return compared(bundle, verdict_of(json.loads(done.stdout)))


def compared(bundle: Path, verdict: BundleVerdict) -> BundleVerdict:
    """Return the verdict on a bundle after the comparison of its source."""
    files = open_bundle(bundle) if verdict.accepted else {}
    found = {n.partition("/")[2]: f.read_bytes() for n, f in files.items() if n.startswith(SOURCE)}
    if not found:
        return verdict
    told = difference(found, json.loads(files["trace.jsonl"].read_bytes().splitlines()[0]))
    if told is not None:
        reason = f"the source is of another scenario than the trace: {told}"
        return BundleVerdict(Acceptance.REFUSED, reason, ())
    left = tuple(each for each in verdict.not_compared if each != UNCOMPARED[SOURCE])
    return replace(verdict, not_compared=left)


def verdict_of(said: Mapping[str, Any]) -> BundleVerdict:
    claims, left = tuple(said["claims"]), tuple(said["not_compared"])
    return BundleVerdict(Acceptance(said["verdict"]), said["reason"], claims, left)
