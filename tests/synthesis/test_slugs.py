"""Requests to a slugs binary: verdicts, limits, and every way in which a program can fail; in
threads, under signals. No process is left behind."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from children import gone, ran
from once import beside, from_yaml
from safenav import (
    ExitCode,
    ResourceLimitError,
    SafenavError,
    Specification,
    Synthesizer,
    SynthesizerError,
    Verdict,
    first_failure,
)
from safenav.spec.specification import Constraint, Origin, Section
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import Binary, die_with_parent
from safenav.synthesis.slugs import SynthesisProgress
from slugs.commands import ENDLESS

Script = Callable[[str], Binary]
UPSTREAM = 'if [ "$1" = --version ]; then echo "unknown parameter" >&2; exit 1; fi\n'
NATIVE = 'if [ "$1" = --version ]; then echo "slugs 9.9.9"; exit 0; fi\n'
REALIZABLE, UNREALIZABLE = (
    f"echo 'RESULT: Specification is {word}.' >&2\n" for word in ("realizable", "unrealizable")
)
NONE = Cache(None)


def impossible(spec: Specification) -> Specification:
    wall = Constraint(Section.SYS_TRANS, "region' != 5", Origin("obstacles.wall", "no entry"))
    return spec.with_more(wall)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs._HEARTBEAT_SECONDS", 0.05)
    monkeypatch.setattr("safenav.synthesis.slugs.OVERTIME_SECONDS", 0.1)


def test_our_binary_gets_the_specification_on_standard_input_with_its_limits(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    binary = script(
        NATIVE
        + f'cd "{tmp_path}"; cat > given; echo "$@" > arguments; echo "$SLUGS_PARENT" > parent\n'
        + UNREALIZABLE
        + "exit 10"
    )
    binary = Binary(binary.path, ours=True)
    synthesizer = Synthesizer(binary, seconds=7.5, memory_mb=100, cache=NONE)
    handler = signal.getsignal(signal.SIGTERM)
    assert synthesizer.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs()
    assert int((tmp_path / "parent").read_text()) == os.getpid(), "it ends with this process"
    limits = "--nodes 200000 --timeout 7.5 --memory 100"
    assert (tmp_path / "arguments").read_text() == f"--explicitStrategy --jsonOutput {limits} -\n"
    fair = Constraint(Section.ENV_LIVENESS, "request", Origin("", ""))
    synthesizer.synthesize(patrol.with_more(fair))
    assert "--biasForAction" in (tmp_path / "arguments").read_text()
    assert signal.getsignal(signal.SIGTERM) is handler, "another one only while programs run"


@pytest.mark.parametrize(("body", "expected", "words"), from_yaml(beside(__file__, "answers.yaml")))
def test_limits_are_verdicts_and_failures_errors_with_the_last_words_of_the_binary(
    script: Script, patrol: Specification, body: str, expected: str, words: str
) -> None:
    synthesizer = Synthesizer(script(NATIVE + body), seconds=300, cache=NONE)
    if not expected.endswith("Error"):
        result = synthesizer.synthesize(patrol)
        assert (result.verdict, result.strategy) == (expected, None)
        assert words in result.detail
        return
    with pytest.raises(SafenavError, match=words) as raised:
        synthesizer.synthesize(patrol)
    assert type(raised.value).__name__ == expected
    internal = expected == "SynthesizerError"
    assert internal is (raised.value.exit_code is ExitCode.INTERNAL)
    assert internal is ("robot 'carrier'" in str(raised.value))


@pytest.mark.parametrize("stream", ["1", "2"])
@pytest.mark.parametrize(("kind", "limit"), [(NATIVE, 1), (UPSTREAM, 64)], ids=["own", "foreign"])
def test_a_binary_that_floods_its_output_is_stopped_at_the_memory_limit(
    kind: str, limit: int, stream: str, script: Script, patrol: Specification
) -> None:
    binary = script(kind + f"exec yes >&{stream}")
    with pytest.raises(ResourceLimitError, match=f"more than {limit} MiB"):
        Synthesizer(binary, memory_mb=limit, cache=NONE).synthesize(patrol)


@pytest.mark.parametrize("prefix", [UPSTREAM, NATIVE], ids=["upstream", "ours"])
@pytest.mark.usefixtures("quick")
def test_a_binary_that_hangs_is_killed_with_its_children(
    script: Script,
    patrol: Specification,
    tmp_path: Path,
    prefix: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    child, own = tmp_path / "child", script(NATIVE + "cat")
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: own)
    binary = script(prefix + f'echo working >&2; sleep 900 & echo $! > "{child}"; sleep 900; wait')
    result = Synthesizer(binary, seconds=1).synthesize(patrol)
    assert result.verdict is Verdict.TIMEOUT
    # A busy machine may not get as far as the second process.
    assert result.detail in ("", "working")
    assert not child.exists() or not child.read_text() or gone(int(child.read_text()))


def test_a_foreign_binary_is_held_to_its_memory(script: Script, patrol: Specification) -> None:
    eater = (
        "import sys\n"
        "try: data = bytearray(400 << 20)\n"
        "except MemoryError: sys.exit('terminate called after throwing std::bad_alloc')\n"
        "print('RESULT: Specification is unrealizable.', file=sys.stderr)\n"
    )
    binary = script(UPSTREAM + f'exec "{sys.executable}" -c "{eater}"')
    for limit, verdict in ((None, Verdict.UNREALIZABLE), (200, Verdict.OUT_OF_MEMORY)):
        synthesizer = Synthesizer(binary, memory_mb=limit, cache=NONE)
        assert synthesizer.synthesize(patrol).verdict is verdict


def test_upstreams_conventions_give_the_same_results(
    slugs: Binary,
    script: Script,
    patrol: Specification,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """slugsin files only, no option of ours, status 0 for both verdicts: our binary translates, and
    it has the counterstrategies."""
    if not slugs.native:
        pytest.skip("SAFENAV_SLUGS names a foreign binary")
    upstream = script(
        'for argument in "$@"; do case "$argument" in\n'
        "--explicitStrategy|--jsonOutput|--counterStrategy) ;;\n"
        '-*) echo "Error: Did not understand parameter $argument" >&2; exit 1;;\n'
        '*.slugsin) ;; *) echo "Error: no slugsin" >&2; exit 1;;\n'
        f'esac; done\n"{slugs.path}" "$@"; exit 0'
    )
    (tmp_path / "files").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "files"))
    own = "safenav.synthesis.slugs.find_own_binary"
    monkeypatch.setattr(own, lambda: slugs)
    ours, theirs = (Synthesizer(b, cache=NONE, verifier=first_failure) for b in (slugs, upstream))
    assert not theirs.binary.native
    lost = impossible(patrol)
    for spec in (patrol, lost):
        assert theirs.synthesize(spec, strategy=False).verdict is ours.synthesize(spec).verdict
        assert theirs.synthesize(spec).strategy_json == ours.synthesize(spec).strategy_json
    for synthesizer in (ours, theirs):
        result = synthesizer.counterstrategy(lost)
        assert (result.verdict, result.verified) == (Verdict.UNREALIZABLE, True)
        assert result.strategy is not None
        assert synthesizer.counterstrategy(patrol).verdict is Verdict.REALIZABLE
    assert not [*(tmp_path / "files").iterdir()], "files for a foreign binary do not stay"
    broken = script(NATIVE + "echo 'translation is broken' >&2; exit 4")
    monkeypatch.setattr(own, lambda: broken)
    with pytest.raises(SynthesizerError, match=r"does not translate(.|\n)*translation is broken"):
        theirs.synthesize(patrol)
    monkeypatch.setattr(own, lambda: None)
    with pytest.raises(SynthesizerError, match="reads no structured slugs"):
        theirs.synthesize(patrol)
    with pytest.raises(SynthesizerError, match="no counterstrategies"):
        theirs.counterstrategy(lost)


def test_a_wrong_strategy_is_an_error_of_the_synthesizer(
    answering: Callable[[bytes], Binary], patrol: Specification, patrol_json: bytes
) -> None:
    """With ``verify``, what the binary says is not believed, nor what the cache has kept of it."""
    document = json.loads(patrol_json)
    document["nodes"]["1"]["trans"] = [1, 2]
    liar = answering(json.dumps(document).encode())
    for _ in range(2):
        with pytest.raises(SynthesizerError, match=r"wrong result(.|\n)*region = 5"):
            Synthesizer(liar, verifier=first_failure).synthesize(patrol)
        believed = Synthesizer(liar).synthesize(patrol)
        assert (believed.cached, believed.verified) == (False, None)
    honest = answering(patrol_json)
    for cached in (False, True):
        result = Synthesizer(honest, verifier=first_failure).synthesize(patrol)
        assert (result.verified, result.cached) == (True, cached)


@pytest.mark.usefixtures("quick")
def test_several_run_in_parallel_report_that_they_still_run_and_return_in_order(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    """Each of two waits for the other to have started, so they cannot run one by one; and the first
    for a report of the second's result and for two of its own."""
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one processor: nothing runs at once")
    binary = script(
        NATIVE + f'cat > "{tmp_path}/in.$$"; cd "{tmp_path}"\n'
        "while [ $(ls in.* | wc -l) -lt 2 ]; do sleep 0.01; done\n"
        "if grep -q '!= 5' in.$$; then\n"
        f"  while [ ! -e heard ]; do sleep 0.01; done; {UNREALIZABLE} exit 10\nfi\n{REALIZABLE}"
    )
    heard: list[SynthesisProgress] = []

    def listener(progress: SynthesisProgress) -> None:
        heard.append(progress)
        indices = [each.index for each in heard if (each.result is None) == (each.index == 0)]
        if 1 in indices and indices.count(0) >= 2:
            (tmp_path / "heard").touch()

    results = Synthesizer(binary, seconds=300).synthesize_all(
        [impossible(patrol), patrol], strategy=False, progress=listener
    )
    assert [r.verdict for r in results] == [Verdict.UNREALIZABLE, Verdict.REALIZABLE]
    finished = [(p.index, p.result) for p in heard if p.result is not None]
    assert finished == [(1, results[1]), (0, results[0])]
    running = [p.seconds for p in heard if p.index == 0]
    assert {p.robot for p in heard} == {"carrier"}
    assert 0 < running[0] < running[1]


@pytest.mark.parametrize("failing", ["binary", "listener"])
@pytest.mark.usefixtures("quick")
def test_one_failure_ends_all_the_others(
    failing: str, script: Script, patrol: Specification, tmp_path: Path
) -> None:
    def listener(progress: SynthesisProgress) -> None:
        if failing == "listener":
            raise RuntimeError(f"running for {progress.seconds} s")

    crash = f"if grep -q '!= 5' \"{tmp_path}/in.$$\"; then kill -SEGV $$; fi; "
    crash *= failing == "binary"
    binary = script(NATIVE + f'cat > "{tmp_path}/in.$$"\n{crash}sleep 900')
    specs = [impossible(patrol), patrol, patrol, patrol]
    with pytest.raises((SynthesizerError, RuntimeError), match=r"SIGSEGV|running for"):
        Synthesizer(binary).synthesize_all(specs, progress=listener)
    started = [*tmp_path.glob("in.*")]
    assert len(started) <= (os.cpu_count() or 1) + (failing == "binary")
    assert all(gone(int(file.suffix[1:])) for file in started)


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
    (tmp_path / "pids").touch()
    with subprocess.Popen(
        [sys.executable, "-c", _CALLER, str(binary.path)], stdout=subprocess.PIPE, text=True
    ) as caller:
        for _ in range(15_000):
            pids = (tmp_path / "pids").read_text().split()
            if len(pids) >= min(2, os.cpu_count() or 1):
                break
            time.sleep(0.02)
        caller.send_signal(sent)
        printed, _ = caller.communicate(timeout=300)
    assert caller.returncode == status
    assert printed == ("interrupted\n" if sent is signal.SIGINT else "")
    assert pids and all(gone(int(pid)) for pid in pids)


def test_a_synthesizer_ends_with_an_owner_that_is_killed_or_does_not_begin(
    slugs: Binary, tmp_path: Path
) -> None:
    """The owner may end before the program, or for a foreign one its wrapper, asks the kernel to be
    killed with it."""
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
    done = ran([slugs.path, "--version"], env={"SLUGS_PARENT": "1"})
    assert done.returncode == -signal.SIGKILL
    command = die_with_parent([str(slugs.path), "--version"])
    assert ran(command).stdout
    other = "import subprocess, sys; sys.exit(subprocess.call(sys.argv[1:]))"
    done = ran([sys.executable, "-c", other, *command])
    assert (done.returncode, done.stdout) == (1, "")


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
