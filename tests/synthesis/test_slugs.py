"""Requests to a slugs binary: verdicts, limits, and every way in which a program can fail."""

import os
import sys
from pathlib import Path

import pytest

from safenav.errors import ExitCode, ResourceLimitError, SynthesizerError, Verdict
from safenav.spec.specification import Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import Binary
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure
from synthesis.requests import NATIVE, UPSTREAM, Answering, Script, ask, gone, impossible


def test_a_result_contains_size_time_and_strategy(
    answering: Answering, patrol: Specification, patrol_json: bytes
) -> None:
    result = Synthesizer(answering("realizable", patrol_json)).synthesize(patrol)
    assert result.robot == "carrier"
    assert result.states == 9
    assert result.strategy_json == patrol_json
    assert result.strategy is not None and result.strategy.initial() == (0,)
    assert result.strategy_sha256 is not None and len(result.strategy_sha256) == 64
    assert result.detail == ""
    assert (result.cached, result.verified) == (False, None)
    assert 0 < result.seconds < 300


def test_our_binary_gets_the_specification_on_standard_input_with_its_limits(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    binary = script(
        NATIVE
        + f'cd "{tmp_path}"; cat > given; echo "$@" > arguments; echo "$SLUGS_PARENT" > parent\n'
        "echo 'RESULT: Specification is unrealizable.' >&2; exit 10"
    )
    binary = Binary(binary.path, ours=True)
    synthesizer = Synthesizer(binary, seconds=7.5, memory_mb=100, cache=Cache(None))
    assert synthesizer.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs()
    assert int((tmp_path / "parent").read_text()) == os.getpid(), "it ends with this process"
    arguments = (tmp_path / "arguments").read_text().split()
    limits = ["--nodes", "200000", "--timeout", "7.5", "--memory", "100"]
    assert arguments == ["--explicitStrategy", "--jsonOutput", *limits, "-"]


def test_a_strategy_with_too_many_states_is_a_limit(script: Script, patrol: Specification) -> None:
    binary = script(
        NATIVE + "echo 'RESULT: Specification is realizable.' >&2\n"
        "echo 'slugs: node limit reached' >&2; exit 3"
    )
    with pytest.raises(ResourceLimitError, match="strategy of carrier has more than 200,000 sta"):
        ask(binary, patrol)


def test_our_binary_translates_for_a_foreign_one(
    script: Script, patrol: Specification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = script(NATIVE + 'test "$1 $2" = "--translate -" && tr a-z A-Z')
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: own)
    foreign = script(
        UPSTREAM + f'cat "$3" > "{tmp_path}/given"; echo "$@" > "{tmp_path}/arguments"\n'
        "echo 'RESULT: Specification is unrealizable.' >&2"
    )
    assert ask(foreign, patrol) is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs().upper()
    *options, file = (tmp_path / "arguments").read_text().split()
    assert options == ["--explicitStrategy", "--jsonOutput"]
    assert file.endswith(".slugsin") and not Path(file).exists()
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: None)
    with pytest.raises(SynthesizerError, match="reads no structured slugs"):
        ask(foreign, patrol)


def test_a_failed_translation_is_an_error(
    script: Script, patrol: Specification, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = script(NATIVE + "echo 'translation is broken' >&2; exit 4")
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: own)
    with pytest.raises(SynthesizerError, match=r"does not translate(.|\n)*translation is broken"):
        ask(script(UPSTREAM), patrol)


@pytest.mark.parametrize(
    ("words", "verdict"),
    [
        ("time limit reached in iteration 3", Verdict.TIMEOUT),
        ("memory limit reached (100 MB)", Verdict.OUT_OF_MEMORY),
    ],
)
def test_limits_that_our_binary_keeps_are_verdicts_with_its_last_words(
    script: Script, patrol: Specification, words: str, verdict: Verdict
) -> None:
    binary = script(NATIVE + f"echo '{words}' >&2; exit 3")
    result = Synthesizer(binary).synthesize(patrol)
    assert (result.verdict, result.detail, result.strategy) == (verdict, words, None)


@pytest.mark.parametrize("prefix", [UPSTREAM, NATIVE], ids=["upstream", "ours"])
def test_a_binary_that_hangs_is_killed_with_its_children(
    script: Script,
    patrol: Specification,
    tmp_path: Path,
    prefix: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs.OVERTIME_SECONDS", 0.1)
    child = tmp_path / "child"
    own = script(NATIVE + "cat")
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
    free = Synthesizer(binary, memory_mb=None, cache=Cache(None))
    assert free.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    bound = Synthesizer(binary, memory_mb=200, cache=Cache(None))
    assert bound.synthesize(patrol).verdict is Verdict.OUT_OF_MEMORY


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("echo '-:7:3: unexpected U' >&2; exit 2", r"rejects the spec(.|\n)*unexpected U"),
        ("echo oh dear >&2; kill -SEGV $$", r"crashed \(SIGSEGV\)(.|\n)*oh dear"),
        ("kill -ABRT $$", r"crashed \(SIGABRT\)(.|\n)*printed nothing"),
        ("kill -KILL $$", "killed from outside"),
        ("echo 'slugs: interrupted while solving' >&2; exit 3", r"was interrupted from outside"),
        ("exit 7", r"no verdict \(exit status 7\)"),
        ("head -c 100000 /dev/urandom >&2", "no verdict"),
        ("echo 'RESULT: Specification is realizable.' >&2", "wrong result: the strategy is not"),
        ("echo '{}'; echo 'RESULT: Specification is realizable.' >&2", "wrong result"),
    ],
    ids=[
        "rejected", "segmentation fault", "abort", "killed", "interrupted", "status",
        "binary words", "no strategy", "empty strategy",
    ],
)  # fmt: skip
def test_a_broken_binary_is_an_error_with_its_last_words(
    script: Script, patrol: Specification, body: str, complaint: str
) -> None:
    with pytest.raises(SynthesizerError, match=complaint) as raised:
        ask(script(NATIVE + body), patrol)
    assert raised.value.exit_code is ExitCode.INTERNAL
    assert "robot 'carrier'" in str(raised.value)


@pytest.mark.parametrize("stream", ["1", "2"])
@pytest.mark.parametrize(("kind", "limit"), [(NATIVE, 1), (UPSTREAM, 64)], ids=["own", "foreign"])
def test_a_binary_that_floods_its_output_is_stopped_at_the_memory_limit(
    kind: str, limit: int, stream: str, script: Script, patrol: Specification
) -> None:
    binary = script(kind + f"exec yes >&{stream}")
    with pytest.raises(ResourceLimitError, match=f"more than {limit} MiB"):
        Synthesizer(binary, memory_mb=limit, cache=Cache(None)).synthesize(patrol)


@pytest.fixture
def upstream(slugs: Binary, script: Script, monkeypatch: pytest.MonkeyPatch) -> Binary:
    """The real binary with the manners of upstream's: slugsin files only, no option of ours,
    status 0 for both verdicts."""
    if not slugs.native:
        pytest.skip("SAFENAV_SLUGS names a foreign binary")
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: slugs)
    return script(
        'for argument in "$@"; do case "$argument" in\n'
        "--explicitStrategy|--jsonOutput|--counterStrategy) ;;\n"
        '-*) echo "Error: Did not understand parameter $argument" >&2; exit 1;;\n'
        '*.slugsin) ;; *) echo "Error: no slugsin" >&2; exit 1;;\n'
        f'esac; done\n"{slugs.path}" "$@"; exit 0'
    )


def test_upstreams_manners_give_the_same_answers(
    slugs: Binary, upstream: Binary, patrol: Specification
) -> None:
    ours, theirs = (
        Synthesizer(b, cache=Cache(None), verifier=first_failure) for b in (slugs, upstream)
    )
    assert not theirs.binary.native
    for spec in (patrol, impossible(patrol)):
        assert theirs.synthesize(spec, strategy=False).verdict is ours.synthesize(spec).verdict
        assert theirs.synthesize(spec).strategy_json == ours.synthesize(spec).strategy_json


def test_counterstrategies_come_from_our_binary(
    slugs: Binary, upstream: Binary, patrol: Specification, monkeypatch: pytest.MonkeyPatch
) -> None:
    for binary in (slugs, upstream):
        result = Synthesizer(binary, verifier=first_failure).counterstrategy(impossible(patrol))
        assert (result.verdict, result.verified) == (Verdict.UNREALIZABLE, True)
        assert result.strategy is not None
    assert Synthesizer(slugs).counterstrategy(patrol).verdict is Verdict.REALIZABLE
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: None)
    with pytest.raises(SynthesizerError, match="no counterstrategies"):
        Synthesizer(upstream).counterstrategy(impossible(patrol))
