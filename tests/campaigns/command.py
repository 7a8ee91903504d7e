"""The ``safenav`` command as users call it, with a time limit."""

import importlib
import os
import pkgutil
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Ended:
    """The end of a call. ``exit``: its status, None if only SIGKILL ended it; ``interrupted``:
    SIGINT was sent at its time limit; ``deaf``: seconds until it ended after that; ``seen``: result
    of ``look`` at that moment."""

    exit: int | None
    output: str
    errors: str
    seconds: float
    interrupted: bool = False
    deaf: float = 0.0
    seen: bytes = b""


class Command:
    """Calls the entry point of the program, each time in a forked copy of this process, which has
    imported all of safenav already: for thousands of calls."""

    def __init__(self) -> None:
        import safenav

        for module in pkgutil.walk_packages(safenav.__path__, "safenav."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)

    def call(
        self,
        arguments: Sequence[str | Path],
        seconds: float,
        patience: float = 5.0,
        look: Callable[[], bytes] = bytes,
    ) -> Ended:
        """Run ``safenav`` with these arguments. After ``seconds`` it gets a SIGINT, after
        ``patience`` more a SIGKILL. It stands still while ``look`` is called."""
        words = list(map(str, arguments))
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            begun = time.monotonic()
            process = self._start(words, out.fileno(), err.fileno())
            exit_status = _wait(process, begun + seconds)
            interrupted = exit_status is None
            deaf, seen = 0.0, b""
            if exit_status is None:
                os.kill(process, signal.SIGSTOP)
                seen = look()
                sent = time.monotonic()
                os.kill(process, signal.SIGINT)
                os.kill(process, signal.SIGCONT)
                exit_status = _wait(process, sent + patience)
                deaf = time.monotonic() - sent
            if exit_status is None:
                os.killpg(process, signal.SIGKILL)
                os.waitpid(process, 0)
            spent = time.monotonic() - begun
            texts = []
            for stream in (out, err):
                stream.seek(0)
                texts.append(stream.read().decode(errors="replace"))
        return Ended(exit_status, texts[0], texts[1], spent, interrupted, deaf, seen)

    def _start(self, words: list[str], out: int, err: int) -> int:
        sys.stdout.flush()
        sys.stderr.flush()
        # Python loses signals during a fork: an interrupt waits for its handler.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        child = os.fork()
        if child:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            return child
        status = 4
        try:
            os.setsid()
            os.dup2(out, 1)
            os.dup2(err, 2)
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            # As Python does by default: an interrupt may come between a file's opening and the
            # `with` that would close it.
            warnings.simplefilter("ignore", ResourceWarning)
            sys.argv = ["safenav", *words]
            from safenav.cli import main

            main()
            status = 0
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        return child


def _wait(process: int, until: float) -> int | None:
    """The exit status of a child; None if it has not ended at that time."""
    pause = 0.005
    while True:
        done, status = os.waitpid(process, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() >= until:
            return None
        time.sleep(pause)
        pause = min(pause * 1.3, 0.1)
