"""The verdict on a bundle: that of its checker, and the comparison of its source."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from safenav.certify.sources import difference
from safenav.errors import InputError, UsageError
from safenav.judge.bundle.check import SOURCE, UNCOMPARED, check, open_bundle
from safenav.trace.reading import read_bytes


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


def check_bundle(bundle: Path) -> BundleVerdict:
    """Check a bundle with the installed checker (not the copy in the bundle), and read its source
    again. Raises UsageError if it is not a bundle."""
    if not (bundle / "manifest.json").is_file() and not zipfile.is_zipfile(bundle):
        what = "a folder with a manifest.json, or a .zip of one"
        raise UsageError(f"{bundle} is not a bundle: {what}")
    said, reason, claims, left = check(bundle)
    verdict = BundleVerdict(Acceptance(said), reason, tuple(claims), tuple(left))
    files = open_bundle(bundle) if verdict.accepted else {}
    found = {n.partition("/")[2]: f.read_bytes() for n, f in files.items() if n.startswith(SOURCE)}
    if not found:
        return verdict
    first = files["trace.jsonl"].read_bytes().splitlines()[0]
    try:
        told = difference(found, read_bytes(first).header)
    except InputError as error:  # a field that the checker does not need
        return BundleVerdict(Acceptance.REFUSED, f"trace.jsonl: {error.diagnostics[0].found}", ())
    if told is not None:
        reason = f"the source is of another scenario than the trace: {told}"
        return BundleVerdict(Acceptance.REFUSED, reason, ())
    left = [each for each in verdict.not_compared if each != UNCOMPARED[SOURCE]]
    return replace(verdict, not_compared=tuple(left))
