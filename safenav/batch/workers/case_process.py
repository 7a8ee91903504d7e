"""The process that runs cases, one after the other: ``Worker`` starts it and talks to it.

It reads JSON lines from standard input and writes JSON lines to the original standard output; all
other output goes to standard error. When standard input ends, because the batch has ended, this
process also ends, with its synthesis.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import queue
import resource
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from safenav.lines import line_output

READY = "ready"


def main() -> None:
    """Serve until standard input ends."""
    answer = line_output()
    faulthandler.enable()  # prints the stack at a crash, and at the SIGABRT for a hung case
    _forbid_core_dumps()
    from safenav.batch.cases.case import Case, Conditions
    from safenav.batch.workers.execution import execute

    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    try:
        answer(READY)
        while task := tasks.get():
            given: dict[str, Any] = json.loads(task)
            if given["directory"] is not None:
                with contextlib.suppress(OSError):  # if missing, only its files are not found
                    os.chdir(given["directory"])
            trace = Path(given["trace"]) if given["trace"] is not None else None
            result = execute(Case(**given["case"]), Conditions(**given["conditions"]), trace)
            answer(result.record())
    except BrokenPipeError:
        os._exit(0)  # the reader has gone


def _listen(tasks: queue.SimpleQueue[bytes]) -> None:
    for line in sys.stdin.buffer:
        tasks.put(line)
    tasks.put(b"")
    # During a synthesis, SIGTERM first kills that; otherwise it ends this process immediately.
    os.kill(os.getpid(), signal.SIGTERM)


def _forbid_core_dumps() -> None:
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
