"""Commands as separate processes, without their start-up time.

The start of Python and the imports take most of the time of a short command. Here a program that
has imported all of safenav, and read a scenario and a trace, forks for each command: the command
has its own process, working directory, environment, files and exit status, and ends as any Python
program does. Tests of the start itself, of signals and of limits start safenav anew.

One program serves all processes of a test run: importing all takes 0.9 s. It is no child of the
test run, so that tests can demand that no child is left; it ends when the test run ends.
"""

import atexit
import contextlib
import fcntl
import gc
import importlib
import json
import os
import pkgutil
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from once import FOLDER, ROOT, RUNNING, locked

LIBRARIES = ("networkx", "numpy", "PIL.Image", "resvg_py", "daqp", "mcap.writer")
LONGEST = 1 << 18
PAUSE = 0.5
"""Seconds after which the program looks whether the test run has ended."""

Done = subprocess.CompletedProcess[str]


def safenav(*arguments: object, **options: Any) -> Done:
    """Run ``safenav ARGUMENTS...``, ``options`` as below; warnings are errors."""
    return program("safenav.cli", *arguments, **options)


def program(
    module: str,
    *arguments: object,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    text: str = "",
    together: bool = False,
) -> Done:
    """Run a module's ``main`` with ``text`` on its standard input; what it returns is the exit
    status. ``together``: standard output has what it writes to standard error as well."""
    words = [str(argument) for argument in arguments]
    with contextlib.ExitStack() as opened:
        given, out, err = (opened.enter_context(tempfile.TemporaryFile("w+b")) for _ in range(3))
        given.write(text.encode())
        given.seek(0)
        files = [stream.fileno() for stream in (given, out, out if together else err)]
        with _asked(module, words, files, cwd, env) as connection:
            connection.recv(LONGEST)
            status = connection.recv(LONGEST)
        assert status, "the program that starts commands has ended"
        out.seek(0)
        err.seek(0)
        texts = [out.read().decode(), err.read().decode()]
    return subprocess.CompletedProcess([module, *words], int(status), *texts)


def started(
    *arguments: object, out: int, cwd: Path | None = None, env: Mapping[str, str] | None = None
) -> int:
    """Start ``safenav ARGUMENTS...``, which writes its output to ``out``; return its process id."""
    words = [str(argument) for argument in arguments]
    with Path(os.devnull).open("rb") as nothing:
        files = [nothing.fileno(), out, out]
        with _asked("safenav.cli", words, files, cwd, env) as connection:
            return int(connection.recv(LONGEST))


def _asked(
    module: str, words: list[str], files: list[int], cwd: Path | None, env: Mapping[str, str] | None
) -> socket.socket:
    """Start a command; return a connection with its process id, and then its exit status."""
    place, environment = str(cwd or Path.cwd()), dict(env or os.environ)
    asked = {"module": module, "words": words, "cwd": place, "env": environment}
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    path = Path(os.environ[FOLDER]) / "warm.socket"
    with locked(path.with_suffix(".lock")):
        if not path.exists():
            _start(path)
    connection.connect(str(path))
    socket.send_fds(connection, [json.dumps(asked).encode()], files)
    return connection


def _start(path: Path) -> None:
    """Start the program, which accepts connections from now on."""
    paths = [str(Path(__file__).parent), *filter(None, sys.path)]
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(path))
        listening.listen(64)
        subprocess.run(
            [sys.executable, "-W", "error", "-c", f"import warm; warm.serve({listening.fileno()})"],
            pass_fds=[listening.fileno()],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
            check=True,
        )


def serve(number: int) -> None:
    """Fork for each request, until the test run has ended, and send what became of it."""
    if os.fork():
        os._exit(0)
    running = (Path(os.environ[FOLDER]) / RUNNING).open()
    _import_everything()
    listening = socket.socket(fileno=number)
    woken, waking = socket.socketpair()  # a child has ended
    for each in (woken, waking):
        each.setblocking(False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(waking.fileno(), warn_on_full_buffer=False)
    children = dict[int, socket.socket]()
    while True:
        ready = select.select([listening, woken], [], [], PAUSE)[0]
        if woken in ready:
            woken.recv(LONGEST)
            _report(children)
        if listening in ready:
            connection, _ = listening.accept()
            asked, files, _, _ = socket.recv_fds(connection, LONGEST, 3)
            if not (child := os.fork()):
                signal.set_wakeup_fd(-1)
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                for held in (running, listening, woken, waking, connection, *children.values()):
                    held.close()
                _become(json.loads(asked), files)
            for file in files:
                os.close(file)
            children[child] = connection
            with contextlib.suppress(BrokenPipeError):
                connection.send(str(child).encode())
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(running, fcntl.LOCK_SH | fcntl.LOCK_NB)
            os._exit(0)


def _report(children: dict[int, socket.socket]) -> None:
    """Send the exit statuses of the commands that have ended."""
    while children and (ended := os.waitpid(-1, os.WNOHANG))[0]:
        with children.pop(ended[0]) as connection, contextlib.suppress(BrokenPipeError):
            connection.send(str(os.waitstatus_to_exitcode(ended[1])).encode())


def _become(asked: Mapping[str, Any], files: list[int]) -> NoReturn:
    """Run the requested command in this process, to its end."""
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.chdir(asked["cwd"])
    os.environ.clear()
    os.environ.update(asked["env"])
    if "coverage" in sys.modules:  # `python -m gate --record`
        test = asked["env"].get("SAFENAV_GATE_TEST", "")  # none while tests are collected
        sys.modules["coverage"].Coverage.current().switch_context(test)
    sys.argv = ["-c", *asked["words"]]
    status = 0
    try:
        status = importlib.import_module(asked["module"]).main() or 0
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    except BaseException:
        traceback.print_exc()
        status = 1
    # The interpreter's actions at exit, except for clearing all modules.
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def _import_everything() -> None:
    """All of safenav and the libraries that it loads late, without those that are missing."""
    import safenav

    names = [module.name for module in pkgutil.walk_packages(safenav.__path__, "safenav.")]
    for name in (*names, *LIBRARIES):
        if not name.endswith("__main__"):
            with contextlib.suppress(ImportError):
                importlib.import_module(name)
    if "coverage" not in sys.modules:  # the test that reads first has run these lines
        with contextlib.suppress(Exception):  # the tests tell which
            _read()
    gc.set_threshold(200_000, 20, 100)  # as the command does
    gc.freeze()


def _read() -> None:
    """Prepare the declarations of scenarios and traces, as each command does."""
    from safenav import check_trace, load_scenario

    load_scenario(ROOT / "tests/scenario/scenarios/schema_full.yaml")
    check_trace(ROOT / "tests/judge/good/door.jsonl")
