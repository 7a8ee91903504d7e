"""Requests to a slugs binary, as the library and the commands make them: which binary, verdicts,
limits, and every way in which a program can fail; in threads. No process is left behind (by
signals: ``faults``). Files of the cache are correct or ignored, whatever happens to them."""

import json
import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from children import gone
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
    read_specification,
)
from safenav.synthesis.cache import Cache, CacheEntry, CacheWarning

Script = Callable[[str], Path]
REALIZABLE, UNREALIZABLE = (
    f"echo 'RESULT: Specification is {word}.' >&2\n" for word in ("realizable", "unrealizable")
)


def extended(spec: Specification, more: str) -> Specification:
    return read_specification(spec.to_structuredslugs() + more, robot=spec.robot)


def impossible(spec: Specification) -> Specification:
    return extended(spec, "[SYS_TRANS]\nregion' != 5\n")


@pytest.fixture
def uncached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", "off")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("safenav.synthesis.slugs._HEARTBEAT_SECONDS", 0.05)
    monkeypatch.setattr("safenav.synthesis.slugs.OVERTIME_SECONDS", 0.1)


def test_limits_are_options_and_the_specification_is_standard_input(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    binary = script(
        f'cd "{tmp_path}"; cat > given; echo "$@" > arguments\n' + UNREALIZABLE + "exit 10"
    )
    synthesizer = Synthesizer(binary, seconds=7.5, memory_mb=100)
    assert synthesizer.synthesize(patrol).verdict is Verdict.UNREALIZABLE
    assert (tmp_path / "given").read_text() == patrol.to_structuredslugs()
    limits = "--nodes 200000 --timeout 7.5 --memory 100"
    assert (tmp_path / "arguments").read_text() == f"--explicitStrategy --jsonOutput {limits} -\n"
    unlimited = Synthesizer(binary, seconds=None, memory_mb=None)
    unlimited.synthesize(extended(patrol, "[ENV_LIVENESS]\nrequest\n"))
    options = "--explicitStrategy --jsonOutput --biasForAction --nodes 200000 -\n"
    assert (tmp_path / "arguments").read_text() == options


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda _: None, "does not exist"),
        (lambda path: path.mkdir(), "is a directory"),
        (lambda path: path.write_text("no program"), "is not executable"),
    ],
    ids=["missing", "directory", "not executable"],
)
def test_an_environment_variable_without_a_usable_binary_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: Callable[[Path], object], complaint: str
) -> None:
    make(tmp_path / "slugs")
    monkeypatch.setenv("SAFENAV_SLUGS", str(tmp_path / "slugs"))
    with pytest.raises(SynthesizerError, match=rf"{complaint}(.|\n)*SAFENAV_SLUGS"):
        Synthesizer()


@pytest.mark.usefixtures("uncached")
@pytest.mark.parametrize(("body", "expected", "words"), from_yaml(beside(__file__, "answers.yaml")))
def test_limits_are_verdicts_and_failures_are_errors_with_the_last_messages(
    script: Script, patrol: Specification, body: str, expected: str, words: str
) -> None:
    synthesizer = Synthesizer(script(body), seconds=300)
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
def test_a_binary_that_floods_its_output_is_stopped_at_the_memory_limit(
    stream: str, script: Script, patrol: Specification
) -> None:
    binary = script(f"exec yes >&{stream}")
    with pytest.raises(ResourceLimitError, match="more than 1 MiB"):
        Synthesizer(binary, memory_mb=1).synthesize(patrol)


@pytest.mark.usefixtures("quick")
def test_a_binary_that_hangs_is_killed_with_its_children(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    child = tmp_path / "child"
    binary = script(f'echo working >&2; sleep 900 & echo $! > "{child}"; sleep 900; wait')
    result = Synthesizer(binary, seconds=1).synthesize(patrol)
    assert result.verdict is Verdict.TIMEOUT
    # A busy machine may not get as far as the second process.
    assert result.detail in ("", "working")
    assert not child.exists() or not child.read_text() or gone(int(child.read_text()))


def test_a_wrong_strategy_is_an_error_of_the_synthesizer(
    answering: Callable[[bytes], Path], patrol: Specification, patrol_json: bytes
) -> None:
    """With ``verify``, neither the output of the binary nor the cache is trusted."""
    document = json.loads(patrol_json)
    document["nodes"]["1"]["trans"] = [1, 2]
    liar = answering(json.dumps(document).encode())
    for again in (False, True):
        with pytest.raises(SynthesizerError, match=r"wrong result(.|\n)*region = 5"):
            Synthesizer(liar, verifier=first_failure).synthesize(patrol)
        believed = Synthesizer(liar).synthesize(patrol)
        assert (believed.cached, believed.verified) == (again, None)
    honest = answering(patrol_json)
    for cached in (False, True):
        result = Synthesizer(honest, verifier=first_failure).synthesize(patrol)
        assert (result.verified, result.cached) == (True, cached)


@pytest.mark.parametrize(
    ("named", "xdg", "folder"),
    [
        ("/here", None, Path("/here")),
        ("OFF", None, None),
        (None, "/xdg", Path("/xdg/safenav")),
        (None, "not/absolute", Path("/home/me/.cache/safenav")),
        ("~without-a-home/here", None, None),
    ],
)
def test_the_environment_determines_the_folder_of_the_cache(
    named: str | None, xdg: str | None, folder: Path | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("SAFENAV_CACHE", named), ("XDG_CACHE_HOME", xdg), ("HOME", "/home/me")):
        monkeypatch.delenv(name, raising=False)
        if value is not None:
            monkeypatch.setenv(name, value)
    assert Synthesizer().cache.directory == folder


def test_a_request_is_synthesized_once(
    answering: Callable[[bytes], Path], patrol: Specification, patrol_json: bytes, tmp_path: Path
) -> None:
    """Another request, or another binary in its place, is synthesized again; not other comments."""
    binary = answering(patrol_json)
    copy = read_specification(patrol.to_structuredslugs(), "copy", "carrier")
    first, second = (Synthesizer(binary).synthesize(spec) for spec in (patrol, copy))
    assert first.spec_sha256 != second.spec_sha256, "comments name the file"
    assert (first.cached, second.cached) == (False, True)
    assert second.strategy_json == first.strategy_json
    assert second.strategy_sha256 == first.strategy_sha256
    assert second.seconds == first.seconds
    assert second.strategy is not None and second.strategy.initial() == (0,)
    assert (second.robot, second.states, second.verified) == ("carrier", 9, None)
    assert len(first.strategy_sha256 or "") == 64 and 0 < first.seconds < 300
    assert not Synthesizer(binary).synthesize(patrol, strategy=False).cached
    binary.write_text(binary.read_text() + "# a newer version\n")
    assert not Synthesizer(binary).synthesize(patrol).cached
    assert (tmp_path / "calls").read_text() == "call\n" * 3


@pytest.mark.usefixtures("quick")
def test_parallel_syntheses_report_that_they_still_run_and_return_in_order(
    script: Script, patrol: Specification, tmp_path: Path
) -> None:
    """Each of two waits for the other to have started, so they cannot run one by one; and the first
    for a report of the second's result and for two of its own."""
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one processor: nothing runs at once")
    binary = script(
        f'cat > "{tmp_path}/in.$$"; cd "{tmp_path}"\n'
        "while [ $(ls in.* | wc -l) -lt 2 ]; do sleep 0.01; done\n"
        "if grep -q '!= 5' in.$$; then\n"
        f"  while [ ! -e heard ]; do sleep 0.01; done; {UNREALIZABLE} exit 10\nfi\n{REALIZABLE}"
    )
    heard = list[Any]()

    def listener(progress: Any) -> None:
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
def test_one_failure_ends_all_other_syntheses(
    failing: str, script: Script, patrol: Specification, tmp_path: Path
) -> None:
    def listener(progress: Any) -> None:
        if failing == "listener":
            raise RuntimeError(f"running for {progress.seconds} s")

    crash = f"if grep -q '!= 5' \"{tmp_path}/in.$$\"; then kill -SEGV $$; fi; "
    crash *= failing == "binary"
    binary = script(f'cat > "{tmp_path}/in.$$"\n{crash}sleep 900')
    specs = [impossible(patrol), patrol, patrol, patrol]
    with pytest.raises((SynthesizerError, RuntimeError), match=r"SIGSEGV|running for"):
        Synthesizer(binary).synthesize_all(specs, progress=listener)
    started = [*tmp_path.glob("in.*")]
    assert len(started) <= (os.cpu_count() or 1) + (failing == "binary")
    assert all(gone(int(file.suffix[1:])) for file in started)


KEY = "ab" + "0" * 62
ENTRY = CacheEntry(Verdict.REALIZABLE, 0.125, b'{"nodes": "\n\xff"}')


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "answers")


def _files(cache: Cache) -> list[Path]:
    assert cache.directory is not None
    return sorted(p for p in cache.directory.rglob("*") if p.is_file())


def test_every_flipped_byte_and_every_truncation_is_detected(cache: Cache) -> None:
    cache.store(KEY, CacheEntry(Verdict.TIMEOUT, 60.0, None))
    assert cache.load(KEY) is None, "exhausted limits are not stored"
    cache.store(KEY, ENTRY)
    (file,) = _files(cache)
    good = file.read_bytes()
    damaged = [good[:cut] for cut in range(len(good))]
    damaged += [good[:i] + bytes([good[i] ^ 1]) + good[i + 1 :] for i in range(len(good))]
    for data in (*damaged, good + b"x", b"\0" * len(good)):
        file.write_bytes(data)
        assert cache.load(KEY) is None
    cache.store(KEY, ENTRY)
    other = "ab1" + KEY[3:]
    file.rename(file.with_name(other + file.suffix))
    assert cache.load(other) is None, "an entry under another name is not believed"


def test_the_oldest_results_are_removed_from_a_full_cache(tmp_path: Path) -> None:
    size = 10_000
    keys = [f"{i:02x}" * 32 for i in range(12)]
    cache = Cache(tmp_path / "answers", limit_bytes=8 * size)
    half = tmp_path / "answers" / "00" / f".{keys[0]}.1.of-a-killed-writer"
    other = tmp_path / "answers" / "go" / "of-somebody-else.txt"
    for file in (half, other):
        file.parent.mkdir(parents=True)
        file.write_bytes(b"half")
        os.utime(file, (1e8, 1e8))
    for age, key in enumerate(keys):
        cache.store(key, CacheEntry(Verdict.REALIZABLE, 1.0, bytes(size)))
        for file in _files(cache):
            if file.stem == key:
                os.utime(file, (1e9 + age, 1e9 + age))
    assert sum(f.stat().st_size for f in _files(cache)) <= 8 * size
    kept = [key for key in keys if cache.load(key) is not None]
    assert kept and kept == keys[-len(kept) :]
    assert not half.exists()
    assert other.exists()


def test_a_full_disk_leaves_no_partial_entry(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        real(path, data[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.warns(CacheWarning, match="No space left"):
        cache.store(KEY, ENTRY)
    assert _files(cache) == []


def test_a_text_is_cached_under_its_sha256_and_dropped_if_damaged(tmp_path: Path) -> None:
    """A cache without a directory keeps it in memory, since a bundle of a run needs it."""
    text = "[OUTPUT]\nx\n"
    name = sha256(text.encode()).hexdigest()
    assert Cache(tmp_path).load_text(name) is None
    for cache in (Cache(tmp_path), nowhere := Cache(None)):
        cache.keep_text(name, text)
    assert Cache(tmp_path).load_text(name) == nowhere.load_text(name) == text
    (file,) = (p for p in tmp_path.rglob("*") if p.is_file())
    file.write_text("[OUTPUT]\ny\n")
    assert Cache(tmp_path).load_text(name) is None
    file.write_text(text)  # as an older version kept it
    Cache(tmp_path).keep_text(name, text)
    assert Cache(tmp_path).load_text(name) == text


# From the first choice to the last: in the package, in an installation of it, in the source tree.
PLACES = ("tree/safenav/_bin/slugs", "site-packages/safenav/_bin/slugs", "tree/slugs/build/slugs")


def _program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_environment_variable_the_package_and_the_source_tree_are_searched_in_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If none has it, the message names the remedy."""
    monkeypatch.setattr("safenav.synthesis.program._PACKAGE", tmp_path / "tree" / "safenav")
    monkeypatch.setattr("sysconfig.get_path", lambda _: str(tmp_path / "site-packages"))
    monkeypatch.delenv("SAFENAV_SLUGS", raising=False)
    with pytest.raises(SynthesizerError, match="make slugs") as raised:
        Synthesizer()
    assert "SAFENAV_SLUGS" in str(raised.value)
    for place in reversed(PLACES):
        program = _program(tmp_path / place)
        assert Synthesizer().binary == program
    named = _program(tmp_path / "with space ü" / "slugs")
    with pytest.raises(SynthesizerError, match=r"cannot be read: No such file"):
        Synthesizer(named.with_name("lost")).synthesize(read_specification("[OUTPUT]\nx\n"))
    monkeypatch.setenv("SAFENAV_SLUGS", str(named))
    assert Synthesizer().binary == named
