"""The verified checker, if it is built, and the checkers behind each claim of a bundle.

Its verdicts follow from theorems (docs/proof.md); ``make proof`` builds it.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from msgspec import Struct

from safenav.errors import UsageError
from safenav.synthesis.process import die_with_parent

VARIABLE = "SAFENAV_PROVED"
PROGRAM = "safenav-proved"
_BUILT = Path(__file__).parents[2] / "build" / "proof" / PROGRAM

CHECKED = "checked by check.py"
PROVED = "checked, and proved by a verified checker"
_KEPT = {
    "moves": "checked by check.py; its moves are proved by a verified checker",
    "visits": "checked by check.py; its moves, and infinitely many visits to its targets under the "
    "assumptions of the specification, are proved by a verified checker",
}
_REFUTED = " for the specification; for the rules of the scenario checked by check.py"


class Proof(Struct, frozen=True):
    """A verdict of the verified checker.

    ``kind``: ``realizes`` or ``alive`` (``spec``, ``strategy``), ``unrealizable`` (``spec``),
    ``moves`` or ``visits`` (moves and targets of the strategy in a ``line`` of the trace),
    ``apart`` or ``answers`` (the team). ``verdict``: ``proved``, ``refused`` or ``not covered``;
    ``reason``: the reason if it is not proved.
    """

    kind: str
    verdict: str
    reason: str = ""
    spec: str = ""
    strategy: str = ""
    line: str = ""

    @property
    def proved(self) -> bool:
        return self.verdict == "proved"


TEAM = {
    "apart": "Robots in conflict never occupy one region, standing or in transit, and no robot is "
    "ever in a wall or in an unresolved obstacle that blocks it, for every order of moves by these "
    "strategies and every duration.",
    "answers": "In every state that the team reaches, each strategy has a successor for what its "
    "robot sees of the others.",
}
"""Proved properties of all strategies of a bundle together; hypotheses: docs/proof.md."""


def find_program() -> Path | None:
    """Return the verified checker: ``SAFENAV_PROVED``, else on the PATH, else as built in a
    checkout; None if there is none."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    found = shutil.which(PROGRAM)
    if found:
        return Path(found)
    return _BUILT if _BUILT.is_file() else None


def prove(bundle: Path) -> tuple[Proof, ...]:
    """Return the verdicts of the verified checker on a bundle, a folder or a .zip.

    Raises UsageError if it is not installed or cannot check the bundle.
    """
    program = find_program()
    if program is None:
        hint = "build it with `make proof` (docs/proof.md), or name it in " + VARIABLE
        raise UsageError(f"the verified checker, {PROGRAM}, is not installed; {hint}")
    with tempfile.TemporaryDirectory() as directory:
        if bundle.is_file():
            with zipfile.ZipFile(bundle) as packed:
                packed.extractall(directory)
            bundle = Path(directory)
        try:
            command = die_with_parent([str(program), str(bundle)])
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            said = json.loads(done.stdout)
        except (OSError, ValueError) as error:
            words = (str(error) if isinstance(error, OSError) else done.stderr.strip())[-300:]
            found = f"the verified checker, {program}, gives no answer: {words}"
            raise UsageError(found) from error
    return tuple(Proof(**each) for each in said)


def refusals(proofs: Sequence[Proof]) -> list[str]:
    """Return the refusals of the verified checker, each with its reason."""
    named = ((p, p.spec[:12] or (f"line {p.line}" if p.line else "the team")) for p in proofs)
    return [f"{p.kind}, {what}: {p.reason}" for p, what in named if p.verdict == "refused"]


def rests_on(claim: Mapping[str, Any], proofs: Sequence[Proof]) -> str:
    """Return the checkers that have established a claim of the manifest, in words."""
    files = [path for path, _ in claim["evidence"]]
    lines = [str(line) for _, line in claim["evidence"] if line is not None]
    for proof in proofs:
        if not proof.proved or proof.kind not in _ABOUT.get(claim["kind"], ()):
            continue
        if proof.kind in _KEPT:
            if proof.line in lines:
                return _KEPT[proof.kind]
        elif f"specs/{proof.spec}.structuredslugs" in files:
            if claim["kind"] == "unrealizable":
                return PROVED + _REFUTED
            if claim["kind"] == "weakest" or f"strategies/{proof.strategy}.json" in files:
                return PROVED
    return CHECKED


_ABOUT = {
    "realizes": ("realizes",),
    "keeps": ("moves", "visits"),
    "unrealizable": ("unrealizable",),
    "weakest": ("unrealizable",),
}
