"""Commands as separate processes, without their start-up time.

The start of Python and the imports take most of the time of a short command. Here a program that
has imported all of safenav forks for each command: the command has its own process, working
directory, environment, files and exit status, and ends as any Python program does. Tests of the
start itself, of signals and of limits start safenav anew.

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
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NoReturn

from once import FOLDER, locked

TESTS = Path(__file__).parent
PROGRAM = "from warm import serve; serve({0}, {1!r})"
LIBRARIES = ("networkx", "numpy", "PIL.Image", "resvg_py", "daqp", "mcap.writer")
LONGEST = 1 << 16
PAUSE = 0.5
"""Seconds after which the program looks whether anybody is connected."""

Done = subprocess.CompletedProcess[str]


def safenav(
    *arguments: object,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    text: str = "",
    together: bool = False,
) -> Done:
    """Run ``safenav ARGUMENTS...`` with ``text`` on its standard input; warnings are errors."""
    return program("safenav.cli", *arguments, cwd=cwd, env=env, text=text, together=together)


def program(
    module: str,
    *arguments: object,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    text: str = "",
    together: bool = False,
) -> Done:
    """Run a module's ``main`` in the same way; what it returns is the exit status. ``together``:
    standard output has what it writes to standard error as well."""
    words = [str(argument) for argument in arguments]
    with (
        tempfile.TemporaryFile() as given,
        tempfile.TemporaryFile() as out,
        tempfile.TemporaryFile() as err,
    ):
        given.write(text.encode())
        given.seek(0)
        files = [stream.fileno() for stream in (given, out, out if together else err)]
        status = _ask(b"run", files, module, words, cwd, env)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read().decode())
    return subprocess.CompletedProcess([module, *words], status, *texts)


def started(
    *arguments: object, out: int, cwd: Path | None = None, env: Mapping[str, str] | None = None
) -> int:
    """Start ``safenav ARGUMENTS...``, which writes its output to ``out``; return its process id,
    which is not reused until the next command."""
    words = [str(argument) for argument in arguments]
    with Path(os.devnull).open("rb") as nothing:
        return _ask(b"start", [nothing.fileno(), out, out], "safenav.cli", words, cwd, env)


def _ask(
    word: bytes,
    files: list[int],
    module: str,
    words: list[str],
    cwd: Path | None,
    env: Mapping[str, str] | None,
) -> int:
    """The exit status of a command that is run, or the process id of one that is started."""
    place, environment = str(cwd or Path.cwd()), dict(env or os.environ)
    asked = {"module": module, "words": words, "cwd": place, "env": environment}
    server = _server()
    with tempfile.TemporaryFile() as question:
        question.write(json.dumps(asked).encode())
        question.flush()
        socket.send_fds(server, [word], [*files, question.fileno()])
    answer = server.recv(LONGEST)
    assert answer, "the program that starts commands has ended"
    return int(answer)


@cache
def _server() -> socket.socket:
    """A connection to the program, one for this process."""
    place = Path(os.environ[FOLDER]) / "warm.socket"
    ours = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with locked(place.with_suffix(".lock")):  # the program cannot end before we connect
        try:
            ours.connect(str(place))
        except (FileNotFoundError, ConnectionRefusedError):
            _start(place)
            ours.connect(str(place))
    atexit.register(ours.close)  # when all have, the program ends
    return ours


def _start(place: Path) -> None:
    """Start the program, which accepts connections from now on."""
    place.unlink(missing_ok=True)
    paths = [str(TESTS), *filter(None, sys.path)]
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(place))
        listening.listen(64)
        program = PROGRAM.format(listening.fileno(), str(place.with_suffix(".lock")))
        starter = subprocess.run(
            [sys.executable, "-W", "error", "-c", program],
            pass_fds=[listening.fileno()],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
            check=False,
        )
    assert starter.returncode == 0


def serve(number: int, lock: str) -> None:
    """Fork for each connection, until all have ended."""
    connecting = Path(lock).open()  # noqa: SIM115 (to the end)
    if os.fork():
        os._exit(0)
    _import_everything()
    listening = socket.socket(fileno=number)
    served = 0
    while True:
        if not served:
            fcntl.flock(connecting, fcntl.LOCK_EX)
            if not select.select([listening], [], [], 0.0)[0]:
                listening.close()  # later connections are refused, and start another program
                break
            fcntl.flock(connecting, fcntl.LOCK_UN)
        if select.select([listening], [], [], PAUSE)[0]:
            connection, _ = listening.accept()
            if not os.fork():
                listening.close()
                _serve(connection)
            connection.close()
            served += 1
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                served -= 1
    fcntl.flock(connecting, fcntl.LOCK_UN)  # commands that continue also have the file
    os._exit(0)


def _serve(connection: socket.socket) -> NoReturn:
    """Fork for each request, until the connection ends."""
    while True:
        word, files, _, _ = socket.recv_fds(connection, LONGEST, 4)
        if not word:
            os._exit(0)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:  # what was started and has ended
                pass
        child = os.fork()
        if not child:
            connection.close()
            _become(files)
        for file in files:
            os.close(file)
        answer = child
        if word == b"run":
            answer = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        with contextlib.suppress(BrokenPipeError):
            connection.send(str(answer).encode())


def _become(files: list[int]) -> NoReturn:
    """Run the requested command in this process, to its end."""
    for number, file in enumerate(files[:3]):
        os.dup2(file, number)
    with os.fdopen(files[3], "rb") as question:
        question.seek(0)
        asked = json.loads(question.read())
    for file in files[:3]:
        os.close(file)
    os.chdir(asked["cwd"])
    os.environ.clear()
    os.environ.update(asked["env"])
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
    gc.freeze()
