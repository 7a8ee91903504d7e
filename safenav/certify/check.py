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

from safenav.errors import UsageError
from safenav.synthesis.process import die_with_parent

ROOT = Path(__file__).parents[2]
PROGRAM = f"""
import sys
sys.dont_write_bytecode = True
sys.path.insert(0, {str(ROOT)!r})
from safenav.certify.checker.check import main
sys.exit(main())
"""


class Acceptance(StrEnum):
    ACCEPTED = "accepted"
    REFUSED = "refused"
    TOO_LARGE = "too large"


class BundleVerdict(Struct, frozen=True):
    """Verdict of the checker: the claims that it has established, and the reason if it refuses.

    A claim has ``id``, ``kind``, ``text`` and ``evidence``: pairs of a file and a line or None."""

    result: Acceptance
    reason: str
    claims: tuple[Mapping[str, Any], ...]

    @property
    def accepted(self) -> bool:
        return self.result is Acceptance.ACCEPTED


_JUDGED = (0, 1, 3)


def check_bundle(bundle: Path, *, compare: bool = True) -> BundleVerdict:
    """Check a bundle with the installed checker (not the copy in the bundle). ``compare``: the
    manifest must claim what the evidence establishes. Raises UsageError if it is not a bundle."""
    command = [sys.executable, "-I", "-S", "-c", PROGRAM, str(bundle), "--json"]
    if not compare:
        command.append("--any-claims")
    done = subprocess.run(die_with_parent(command), capture_output=True, text=True, check=False)
    if done.returncode not in _JUDGED:
        raise UsageError((done.stdout + done.stderr).strip().splitlines()[-1])
    said = json.loads(done.stdout)
    return BundleVerdict(Acceptance(said["verdict"]), said["reason"], tuple(said["claims"]))
