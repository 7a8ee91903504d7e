"""A small patrol whose strategy is written down by hand, and slugs binaries that misbehave."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from children import none_left
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary, find_own_binary
from synthesis.requests import UPSTREAM, Script

PATROL = """\
# carrier: patrols regions 5 and 3

[INPUT]
request

[OUTPUT]
region:3...5

[ENV_INIT]
!request

[SYS_INIT]
region = 3

[ENV_TRANS]

[SYS_TRANS]
# robots.carrier: one region a tick
region' <= region + 1
region <= region' + 1

[ENV_LIVENESS]

[SYS_LIVENESS]
# robots.carrier.objective: patrol
region = 5
region = 3
"""

PHASES = [(3, 0), (4, 0), (5, 0), (4, 1), (3, 1)]
"""(region, goal) along the patrol; from the last phase it continues with the second."""


@pytest.fixture
def patrol() -> Specification:
    return read_specification(PATROL, "patrol.structuredslugs", "carrier")


@pytest.fixture
def patrol_json() -> bytes:
    """The patrol's strategy: node 2 * phase + request, but for the start without a request."""
    return automaton()


def automaton() -> bytes:
    ids = {(0, 0): 0}
    for phase in range(1, len(PHASES)):
        for request in (0, 1):
            ids[phase, request] = len(ids)
    nodes = {}
    for (phase, request), number in ids.items():
        region, goal = PHASES[phase]
        after = phase + 1 if phase + 1 < len(PHASES) else 1
        nodes[str(number)] = {
            "rank": goal,
            "state": [request, (region - 3) & 1, (region - 3) >> 1],
            "trans": [ids[after, 0], ids[after, 1]],
        }
    names = ["request", "region@0.3.5", "region@1"]
    return json.dumps({"version": 0, "slugs": "0.0.1", "variables": names, "nodes": nodes}).encode()


@pytest.fixture
def script(tmp_path: Path) -> Script:
    """Makes a shell script that stands for a slugs binary. Like upstream's, it does not know
    ``--version`` and reads its request from a file, unless it handles them itself."""

    def make(body: str) -> Binary:
        path = tmp_path / f"slugs-{len(list(tmp_path.iterdir()))}"
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)
        return Binary(path)

    return make


@pytest.fixture
def answering(script: Script, tmp_path: Path) -> Callable[..., Binary]:
    """Makes a binary that prints a verdict, a file's content, and exits."""

    def make(verdict: str, printed: bytes, status: int = 0, prefix: str = UPSTREAM) -> Binary:
        output = tmp_path / f"printed-{len(list(tmp_path.iterdir()))}"
        output.write_bytes(printed)
        return script(
            f'{prefix}cat "{output}"\n'
            f"echo 'RESULT: Specification is {verdict}.' >&2\n"
            f"exit {status}"
        )

    return make


@pytest.fixture(scope="session")
def slugs() -> Binary:
    """The real binary: SAFENAV_SLUGS names one, else safenav's own."""
    named = os.environ.get("SAFENAV_SLUGS")
    binary = Binary(Path(named)) if named else find_own_binary()
    if binary is None:
        pytest.skip("slugs is not built (run `make slugs`)")
    return binary


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No test sees or fills the user's cache."""
    directory = tmp_path / "cache"
    monkeypatch.setenv("SAFENAV_CACHE", str(directory))
    return directory


@pytest.fixture(autouse=True)
def no_children() -> Iterator[None]:
    """Every test leaves no child process behind, neither running nor as a zombie."""
    with none_left():
        yield
