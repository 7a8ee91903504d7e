"""Requests to a slugs binary: verdicts, limits, and every way in which a program can fail."""

import sys
import time
from pathlib import Path

import pytest

from safenav.errors import ExitCode, ResourceLimitError, SynthesizerError
from safenav.outcome import Verdict
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
)
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
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
        NATIVE + f'cat > "{tmp_path}/given"; echo "$@" > "{tmp_path}/arguments"\n'
        "echo 'RESULT: Specification is unrealizable.' >&2; exit 10"
    )
    synthesizer = Synthesizer(binary, seconds=7.5, memory_mb=100, cache=Cache.off())
    assert synthesizer.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs()
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


def test_a_foreign_binary_gets_a_file_and_only_options_that_it_knows(
    script: Script, patrol: Specification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: None)
    binary = script(
        UPSTREAM + f'cat "$3" > "{tmp_path}/given"; echo "$@" > "{tmp_path}/arguments"\n'
        "echo 'RESULT: Specification is unrealizable.' >&2"
    )
    assert ask(binary, patrol) is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs()
    *options, file = (tmp_path / "arguments").read_text().split()
    assert options == ["--explicitStrategy", "--jsonOutput"]
    assert file.endswith(".structuredslugs") and not Path(file).exists()


def test_our_binary_translates_for_a_foreign_one(
    script: Script, patrol: Specification, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = script(NATIVE + 'test "$1 $2" = "--translate -" && tr a-z A-Z')
    monkeypatch.setattr("safenav.synthesis.slugs.find_own_binary", lambda: own)
    foreign = script(
        UPSTREAM + f'cat "$3" > "{tmp_path}/given"; echo "$3" > "{tmp_path}/name"\n'
        "echo 'RESULT: Specification is unrealizable.' >&2"
    )
    assert ask(foreign, patrol) is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs().upper()
    assert (tmp_path / "name").read_text().strip().endswith(".slugsin")


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
        ("interrupted in iteration 3", Verdict.INTERRUPTED),
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
    child, begun = tmp_path / "child", time.monotonic()
    binary = script(prefix + f'echo working >&2; sleep 900 & echo $! > "{child}"; sleep 900; wait')
    result = Synthesizer(binary, seconds=3).synthesize(patrol)
    assert result.verdict is Verdict.TIMEOUT
    assert result.detail == "working"
    assert 3 <= time.monotonic() - begun < 300
    assert gone(int(child.read_text()))


def test_a_foreign_binary_is_held_to_its_memory(script: Script, patrol: Specification) -> None:
    eater = (
        "import sys\n"
        "try: data = bytearray(400 << 20)\n"
        "except MemoryError: sys.exit('terminate called after throwing std::bad_alloc')\n"
        "print('RESULT: Specification is unrealizable.', file=sys.stderr)\n"
    )
    binary = script(UPSTREAM + f'exec "{sys.executable}" -c "{eater}"')
    free = Synthesizer(binary, memory_mb=None, cache=Cache.off())
    assert free.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    bound = Synthesizer(binary, memory_mb=200, cache=Cache.off())
    assert bound.synthesize(patrol).verdict is Verdict.OUT_OF_MEMORY


@pytest.mark.parametrize("prefix", [UPSTREAM, NATIVE], ids=["upstream", "ours"])
@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        ("echo oh dear >&2; kill -SEGV $$", r"crashed \(SIGSEGV\)(.|\n)*oh dear"),
        ("kill -ABRT $$", r"crashed \(SIGABRT\)(.|\n)*printed nothing"),
        ("kill -KILL $$", "killed from outside"),
        ("exit 0", "no verdict"),
        ("exit 7", r"no verdict \(exit status 7\)"),
        ("head -c 100000 /dev/urandom; echo Segmentation >&2", "no verdict(.|\n)*Segmentation"),
        ("head -c 100000 /dev/urandom >&2", "no verdict"),
        ("echo 'RESULT: Specification is realizable.' >&2", "wrong result: the strategy is not"),
        ("echo '{}'; echo 'RESULT: Specification is realizable.' >&2", "wrong result"),
    ],
    ids=[
        "segmentation fault", "abort", "killed", "silence", "status", "garbage",
        "binary words", "no strategy", "empty strategy",
    ],
)  # fmt: skip
def test_a_broken_binary_is_an_error_with_its_last_words(
    script: Script, patrol: Specification, prefix: str, body: str, complaint: str
) -> None:
    with pytest.raises(SynthesizerError, match=complaint) as raised:
        ask(script(prefix + body), patrol)
    assert raised.value.exit_code is ExitCode.INTERNAL
    assert "robot 'carrier'" in str(raised.value)


def test_a_rejected_specification_shows_the_complaint(
    script: Script, patrol: Specification
) -> None:
    binary = script(NATIVE + "echo '-:7:3: unexpected U' >&2; exit 2")
    with pytest.raises(SynthesizerError, match=r"rejects the specification(.|\n)*unexpected U"):
        ask(binary, patrol)


@pytest.mark.parametrize("stream", ["1", "2"])
@pytest.mark.parametrize(("kind", "limit"), [(NATIVE, 1), (UPSTREAM, 64)], ids=["own", "foreign"])
def test_a_binary_that_floods_its_output_is_stopped_at_the_memory_limit(
    kind: str, limit: int, stream: str, script: Script, patrol: Specification
) -> None:
    binary = script(kind + f"exec yes >&{stream}")
    error = ResourceLimitError if stream == "1" else SynthesizerError
    with pytest.raises(error, match=f"more than {limit} MiB"):
        Synthesizer(binary, memory_mb=limit, cache=Cache.off()).synthesize(patrol)


def test_a_specification_larger_than_a_pipe_is_passed_whole(
    script: Script, patrol: Specification
) -> None:
    many = tuple(
        Constraint(Section.SYS_TRANS, f"region < 6 | region > {n}", Origin("map", f"row {n}"))
        for n in range(6000)
    )
    spec = Specification("r", "r", patrol.variables, many)
    binary = script(
        NATIVE + "head -c 200000 /dev/zero >&2; wc -c >&2\n"
        "echo 'RESULT: Specification is unrealizable.' >&2; exit 10"
    )
    result = Synthesizer(binary).synthesize(spec)
    assert str(len(spec.to_structuredslugs())) in result.detail


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
        Synthesizer(b, cache=Cache.off(), verifier=first_failure) for b in (slugs, upstream)
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


def test_limits_of_the_installed_binary_are_distinguished(slugs: Binary) -> None:
    """Counting to a million in twenty bits, backwards and forwards, takes longer than this."""
    if not slugs.native:
        pytest.skip("SAFENAV_SLUGS names a foreign binary")
    variables = tuple(
        Variable(name, owner, (0, 1 << 20))
        for name, owner in (("i", Owner.INPUT), ("o", Owner.OUTPUT), ("p", Owner.OUTPUT))
    )
    lines = ("o' + i < p' + 7 | p + i' = o' + 3", "p' <= p + 1 & p <= p' + 1", "o' < o + i'")
    goals = ("o + p = i", "p > o + 77")
    origin = Origin("test", "heavy arithmetic")
    constraints = tuple(Constraint(Section.SYS_TRANS, line, origin) for line in lines)
    constraints += tuple(Constraint(Section.SYS_LIVENESS, line, origin) for line in goals)
    spec = Specification("r", "r", variables, constraints)
    late = Synthesizer(slugs, seconds=0.05, cache=Cache.off()).synthesize(spec)
    assert late.verdict is Verdict.TIMEOUT
    assert "time limit" in late.detail
    large = Synthesizer(slugs, seconds=60, memory_mb=1, cache=Cache.off()).synthesize(spec)
    assert large.verdict is Verdict.OUT_OF_MEMORY
    assert "memory limit" in large.detail
