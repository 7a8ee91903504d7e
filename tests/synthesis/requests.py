"""Stand-ins for slugs, and requests to them."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from safenav.errors import Verdict
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import Binary
from safenav.synthesis.slugs import Synthesizer

Script = Callable[[str], Binary]
Answering = Callable[..., Binary]

UPSTREAM = 'if [ "$1" = --version ]; then echo "unknown parameter" >&2; exit 1; fi\n'
NATIVE = 'if [ "$1" = --version ]; then echo "slugs 9.9.9"; exit 0; fi\n'


def impossible(spec: Specification) -> Specification:
    wall = Constraint(Section.SYS_TRANS, "region' != 5", Origin("obstacles.wall", "no entry"))
    return spec.with_more(wall)


def ask(binary: Binary, spec: Specification) -> Verdict:
    return Synthesizer(binary, seconds=300, cache=Cache(None)).synthesize(spec).verdict


def gone(pid: int) -> bool:
    """Whether a process that is not our child has ended, waiting a moment for init."""
    for _ in range(15_000):
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True  # killed; its new parent has not looked yet
            os.kill(pid, 0)
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False
