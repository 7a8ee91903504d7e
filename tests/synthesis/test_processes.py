"""Several syntheses in parallel, in threads, under signals: no process is left behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from safenav.errors import SynthesizerError, Verdict
from safenav.spec.specification import Specification
from safenav.synthesis.program import Binary, die_with_parent
from safenav.synthesis.slugs import SynthesisProgress, Synthesizer
from slugs.commands import ENDLESS
from synthesis.requests import NATIVE, Script, gone, impossible


def test_several_run_in_parallel_and_return_in_order(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    """Each of two waits for the other to have started, so they cannot run one by one."""
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one processor: nothing runs at once")
    binary = script(
        NATIVE + f'cat > "{tmp_path}/in.$$"; cd "{tmp_path}"\n'
        "while [ $(ls in.* | wc -l) -lt 2 ]; do sleep 0.01; done\n"
        "if grep -q '!= 5' in.$$; then verdict=unrealizable; status=10\n"
        f'  while [ ! -e "{tmp_path}/heard" ]; do sleep 0.01; done\n'
        "else verdict=realizable; status=0; fi\n"
        'echo "RESULT: Specification is $verdict." >&2; exit $status'
    )
    synthesizer = Synthesizer(binary, seconds=300)
    heard: list[SynthesisProgress] = []

    def listener(progress: SynthesisProgress) -> None:
        heard.append(progress)
        if progress.result is not None:
            (tmp_path / "heard").touch()

    results = synthesizer.synthesize_all(
        [impossible(patrol), patrol], strategy=False, progress=listener
    )
    assert [r.verdict for r in results] == [Verdict.UNREALIZABLE, Verdict.REALIZABLE]
    finished = [(p.index, p.result) for p in heard if p.result is not None]
    assert finished == [(1, results[1]), (0, results[0])]


def test_a_long_synthesis_reports_that_it_still_runs(
    script: Script, patrol: Specification, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs._HEARTBEAT_SECONDS", 0.05)
    running: list[SynthesisProgress] = []

    def listener(progress: SynthesisProgress) -> None:
        if progress.result is None:
            running.append(progress)
        if len(running) == 2:
            (tmp_path / "heard").touch()

    binary = script(
        NATIVE + f'while [ ! -e "{tmp_path}/heard" ]; do sleep 0.01; done\n'
        "echo 'RESULT: Specification is realizable.' >&2"
    )
    Synthesizer(binary).synthesize_all([patrol], strategy=False, progress=listener)
    assert running[0].robot == "carrier"
    assert 0 < running[0].seconds < running[-1].seconds


def test_one_failure_ends_all_the_others(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    binary = script(
        NATIVE + f'cat > "{tmp_path}/in.$$"\n'
        f"if grep -q '!= 5' \"{tmp_path}/in.$$\"; then kill -SEGV $$; fi; sleep 900"
    )
    with pytest.raises(SynthesizerError, match="SIGSEGV"):
        Synthesizer(binary).synthesize_all([impossible(patrol), patrol, patrol, patrol])
    assert all(gone(int(file.suffix[1:])) for file in tmp_path.glob("in.*"))


def test_a_listener_that_fails_ends_the_syntheses(
    script: Script, patrol: Specification, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs._HEARTBEAT_SECONDS", 0.05)

    def listener(progress: SynthesisProgress) -> None:
        raise RuntimeError(f"running for {progress.seconds} s")

    binary = script(NATIVE + f'touch "{tmp_path}/in.$$"; sleep 900')
    with pytest.raises(RuntimeError, match="running"):
        Synthesizer(binary).synthesize_all([patrol], progress=listener)
    assert all(gone(int(file.suffix[1:])) for file in tmp_path.glob("in.*"))


_CALLER = """
import sys
from pathlib import Path
from safenav.errors import SynthesizerError
from safenav.spec.specification import Specification
from safenav.synthesis.slugs import Synthesizer
try:
    Synthesizer(Path(sys.argv[1]), seconds=60).synthesize_all([Specification("r", "r", (), ())] * 2)
except KeyboardInterrupt:
    print("interrupted")
    sys.exit(130)
"""


@pytest.mark.parametrize(
    ("sent", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 128 + signal.SIGTERM)]
)
def test_a_signal_ends_the_syntheses_before_the_caller_ends(
    script: Script, tmp_path: Path, sent: signal.Signals, status: int
) -> None:
    binary = script(NATIVE + f'echo $$ >> "{tmp_path}/pids"; sleep 900; wait')
    caller = subprocess.Popen(
        [sys.executable, "-c", _CALLER, str(binary.path)], stdout=subprocess.PIPE, text=True
    )
    wanted = min(2, os.cpu_count() or 1)
    pids: list[str] = []
    for _ in range(15_000):
        time.sleep(0.02)
        if (tmp_path / "pids").exists():
            pids = (tmp_path / "pids").read_text().split()
            if len(pids) >= wanted:
                break
    caller.send_signal(sent)
    printed, _ = caller.communicate(timeout=300)
    assert caller.returncode == status
    assert printed == ("interrupted\n" if sent is signal.SIGINT else "")
    assert pids and all(gone(int(pid)) for pid in pids)


def test_a_synthesizer_ends_with_an_owner_that_is_killed_or_does_not_begin(
    slugs: Binary, tmp_path: Path
) -> None:
    """The owner may end before the program asks the kernel to be killed with it."""
    file = tmp_path / "endless.structuredslugs"
    file.write_text(ENDLESS)
    program = (
        "import os, subprocess, sys\n"
        "subprocess.run(sys.argv[1:], env={'SLUGS_PARENT': str(os.getpid())})"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, slugs.path, file], stderr=subprocess.PIPE
    ) as owner:
        assert owner.stderr is not None and owner.stderr.readline().startswith(b"slugs ")
        children = Path(f"/proc/{owner.pid}/task/{owner.pid}/children").read_text().split()
        owner.kill()
    assert children and gone(int(children[0]))
    done = subprocess.run([slugs.path, "--version"], env={"SLUGS_PARENT": "1"}, check=False)
    assert done.returncode == -signal.SIGKILL


def test_a_foreign_synthesizer_whose_owner_has_ended_does_not_begin(slugs: Binary) -> None:
    """The owner may end before the kernel has been asked to kill the program with it."""
    command = die_with_parent([str(slugs.path), "--version"])
    assert subprocess.run(command, capture_output=True, check=True).stdout
    other = "import subprocess, sys; sys.exit(subprocess.call(sys.argv[1:]))"
    done = subprocess.run([sys.executable, "-c", other, *command], capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (1, b"")


def test_the_applications_own_handler_of_sigterm_is_kept(
    script: Script, patrol: Specification
) -> None:
    class TerminatedError(Exception):
        pass

    def handler(*_: object) -> None:
        raise TerminatedError

    before = signal.signal(signal.SIGTERM, handler)
    try:
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM))
        timer.start()
        with pytest.raises(TerminatedError):
            Synthesizer(script(NATIVE + "sleep 900")).synthesize(patrol)
        timer.join()
        assert signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, before)
